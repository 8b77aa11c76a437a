/* YAML options files. PETSc reads them; here a mistake gets its line. */
#include "sceneimpl.h"

static PetscErrorCode CaptureError(MPI_Comm comm, int line, const char *function, const char *file,
                                   PetscErrorCode code, PetscErrorType type, const char *message, void *context)
{
  char *why = context;

  if (type == PETSC_ERROR_INITIAL && message) snprintf(why, 128, "%s", message);
  return code;
}

/* Reads text into a database of its own; true if it is YAML of the kind PETSc takes, else why not. */
static PetscErrorCode TryYaml(const char text[], PetscBool *good, char why[128])
{
  PetscOptions   scratch;
  PetscErrorCode failed;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsCreate(&scratch));
  PetscCall(PetscPushErrorHandler(CaptureError, why));
  failed = PetscOptionsInsertStringYAML(scratch, text);
  PetscCall(PetscPopErrorHandler());
  PetscCall(PetscOptionsDestroy(&scratch));
  *good = failed ? PETSC_FALSE : PETSC_TRUE;
  PetscFunctionReturn(0);
}

static PetscInt CountLines(const char text[])
{
  PetscInt n = 0;

  for (; *text; text++) n += (*text == '\n' || text[1] == '\0');
  return n;
}

static char *LineStart(char text[], PetscInt line)
{
  for (PetscInt i = 0; i < line; i++) text = strchr(text, '\n') + 1;
  return text;
}

/* PETSc does not say where YAML fails: it is the line after the longest part of the text that still reads. */
static PetscErrorCode RefuseYaml(MPI_Comm comm, const char path[], char text[], const char why[])
{
  PetscInt  n = CountLines(text), line = n;
  PetscBool good = PETSC_FALSE;
  char      unused[128];
  char     *start;

  PetscFunctionBeginUser;
  while (!good && --line > 0) {
    char *end = LineStart(text, line), first = *end;

    *end = '\0';
    PetscCall(TryYaml(text, &good, unused));
    *end = first;
  }
  start = LineStart(text, line);
  start[strcspn(start, "\r\n")] = '\0';
  DLMUserCheck(PETSC_FALSE, comm,
               "options file %s, line %" PetscInt_FMT
               ": '%.60s' cannot be read (%s); allowed: YAML, 'key: value' with"
               " lists as [1, 2, 3], indented with blanks",
               path, line + 1, start, why);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMInsertYaml(MPI_Comm comm, const char path[], char text[])
{
  PetscBool good;
  char      why[128] = "";

  PetscFunctionBeginUser;
  PetscCall(TryYaml(text, &good, why));
  if (!good) PetscCall(RefuseYaml(comm, path, text, why));
  PetscCall(PetscOptionsInsertStringYAML(NULL, text));
  PetscFunctionReturn(0);
}
