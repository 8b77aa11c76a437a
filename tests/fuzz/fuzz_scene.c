/*
  Reads many scenes in one process, each as the program would: DLMOptionsInsert, then DLMSceneCreate, errors said by DLMErrorHandler. A start of the program
  costs a hundred times as much.

    fuzz_scene LIST     LIST: one scene a line, its arguments apart by tabs; what the program says of each stands on stderr between "== begin N" and "== end N CODE CELLS"

  CODE: 0, or PETSc's code of the error; CELLS: of an accepted scene. An input that takes longer than LIMIT seconds ends the process.
*/
#include <dlmscene.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST_ARGUMENTS = 64, LIMIT = 60 };

static PetscMPIInt rank;

/* Marks of rank 0, whose word the program takes. */
static void Mark(const char *what, long n, int code, double cells)
{
  MPI_Barrier(PETSC_COMM_WORLD);
  if (rank) return;
  fprintf(stderr, "== %s %ld %d %.0f\n", what, n, code, cells);
  fflush(stderr);
}

static PetscErrorCode ReadScene(int argc, char **argv, double *cells)
{
  DLMScene *scene;

  PetscFunctionBeginUser;
  PetscCall(DLMOptionsInsert(PETSC_COMM_WORLD, argc, argv));
  PetscCall(DLMSceneCreate(PETSC_COMM_WORLD, &scene));
  *cells = (double)scene->cells[0] * (double)scene->cells[1] * (double)scene->cells[2];
  PetscCall(DLMSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

static PetscErrorCode ReadLine(char *line, PetscErrorCode *found, double *cells)
{
  char        *argv[MOST_ARGUMENTS + 1] = { (char *)"dlmfd" };
  int          argc                     = 1;
  PetscOptions options;

  PetscFunctionBeginUser;
  line[strcspn(line, "\n")] = '\0';
  for (char *word = strtok(line, "\t"); word && argc < MOST_ARGUMENTS; word = strtok(NULL, "\t")) argv[argc++] = word;
  PetscCall(PetscOptionsCreate(&options));
  PetscCall(PetscOptionsPush(options));
  alarm(LIMIT);
  *found = ReadScene(argc, argv, cells);
  alarm(0);
  PetscCall(PetscOptionsPop());
  PetscCall(PetscOptionsDestroy(&options));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  char  *line = NULL;
  size_t room = 0;
  long   n    = 0;
  FILE  *list;

  if (argc < 2 || !(list = fopen(argv[1], "r"))) return 1;
  argc = 1;
  if (DLMInitialize(argc, argv, "") || PetscPushErrorHandler(DLMErrorHandler, NULL)) return 1;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  signal(SIGALRM, SIG_DFL);
  while (getline(&line, &room, list) > 0) {
    PetscErrorCode code  = 0;
    double         cells = 0.0;
    Mark("begin", n, 0, 0.0);
    if (ReadLine(line, &code, &cells)) return 1;
    Mark("end", n++, (int)code, cells);
  }
  free(line);
  fclose(list);
  return PetscFinalize() ? 1 : 0;
}
