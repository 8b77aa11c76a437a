/* What the tests of the scene share: a folder of the test, files in it, scenes made of a line of arguments. */
#ifndef SCENETEST_H
#define SCENETEST_H

#include <dlmscene.h>
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <math.h>
#include <cmocka.h>

#define OK(call) assert_int_equal((int)(call), 0)

enum { MAX_ARGUMENTS = 64 };

static char folder[PETSC_MAX_PATH_LEN];

static inline void PathOf(const char *name, char path[PETSC_MAX_PATH_LEN])
{
  snprintf(path, PETSC_MAX_PATH_LEN, "%s/%s", folder, name);
}

static inline void WriteFile(const char *name, const char *text)
{
  char        path[PETSC_MAX_PATH_LEN];
  PetscMPIInt rank;

  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  PathOf(name, path);
  if (!rank) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
  }
}

/* Makes a scene of the arguments, split at blanks; @name is the path of a file in the test's folder. */
static inline DLMScene *Make(const char *line)
{
  static char copy[4096], paths[MAX_ARGUMENTS][PETSC_MAX_PATH_LEN];
  char       *arguments[MAX_ARGUMENTS] = {"dlmfd"}, *save;
  int         n = 1;
  DLMScene   *scene = NULL;

  snprintf(copy, sizeof(copy), "%s", line);
  for (char *word = strtok_r(copy, " ", &save); word; word = strtok_r(NULL, " ", &save), n++) {
    if (word[0] == '@') PathOf(word + 1, paths[n]);
    arguments[n] = word[0] == '@' ? paths[n] : word;
  }
  OK(PetscOptionsClear(NULL));
  OK(DLMOptionsInsert(PETSC_COMM_WORLD, n, arguments));
  OK(DLMSceneCreate(PETSC_COMM_WORLD, &scene));
  OK(DLMSceneCheckUnused(PETSC_COMM_WORLD));
  return scene;
}

static inline void AssertVector(const PetscReal v[3], PetscReal a, PetscReal b, PetscReal c)
{
  assert_true(v[0] == a && v[1] == b && v[2] == c);
}

static inline int MakeFolder(void **state)
{
  PetscMPIInt rank;
  char        path[PETSC_MAX_PATH_LEN] = "/tmp/test_scene_XXXXXX";

  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  if (!rank && !mkdtemp(path)) return 1;
  MPI_Bcast(path, PETSC_MAX_PATH_LEN, MPI_CHAR, 0, PETSC_COMM_WORLD);
  memcpy(folder, path, sizeof(folder));
  return 0;
}

static inline int RemoveFolder(void **state)
{
  static const char *const names[] = {"same.yaml", "same.opts", "other.yaml",    "a.yaml",     "b.opts", "full.csv",
                                      "bare.csv",  "many.csv",  "with_csv.yaml", "random.csv", "two.csv"};
  PetscMPIInt              rank;
  char                     path[PETSC_MAX_PATH_LEN];

  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Barrier(PETSC_COMM_WORLD);
  for (size_t i = 0; !rank && i < PETSC_STATIC_ARRAY_LENGTH(names); i++) {
    PathOf(names[i], path);
    remove(path);
  }
  return rank ? 0 : remove(folder);
}

#define RUN_IN_A_FOLDER(tests)                                       \
  int main(int argc, char **argv)                                    \
  {                                                                  \
    int failures;                                                    \
    if (DLMInitialize(argc, argv, NULL)) return 1;                   \
    failures = cmocka_run_group_tests(tests, MakeFolder, RemoveFolder); \
    PetscFinalize();                                                 \
    return failures;                                                 \
  }
#endif
