#include "sceneimpl.h"
#include <ctype.h>

static PetscBool users_fault; /* the error that is being passed up took one line */

PetscBool DLMErrorIsUsers(void)
{
  return users_fault;
}

/* PETSc's own complaint about the value of a key of its own. */
static PetscBool IsOfAKey(const char function[])
{
  static const char *const ends[] = { "SetType", "SetTolerances", NULL };
  const size_t             n      = strlen(function);

  if (!strncmp(function, "PetscOptions", 12)) return PETSC_TRUE;
  for (int k = 0; ends[k]; k++)
    if (n >= strlen(ends[k]) && !strcmp(function + n - strlen(ends[k]), ends[k])) return PETSC_TRUE;
  return PETSC_FALSE;
}

/* PETSc 3.18 gives a failed malloc the number of a line for its code. */
static PetscBool IsOfMemory(PetscErrorCode code, const char function[])
{
  return code == PETSC_ERR_MEM || !strcmp(function, "PetscMallocAlign") || !strcmp(function, "PetscReallocAlign") ? PETSC_TRUE : PETSC_FALSE;
}

static PetscBool HasWord(const char text[], const char word[])
{
  const size_t n = strlen(word);

  for (const char *at = text; n && (at = strstr(at, word)); at++)
    if ((at == text || !isalnum((unsigned char)at[-1])) && !isalnum((unsigned char)at[n])) return PETSC_TRUE;
  return PETSC_FALSE;
}

/* "-key value: " of the key whose value PETSc's message speaks of, and which the message leaves out. */
static void FindKey(const char message[], char found[], size_t size)
{
  char *all = NULL, *save = NULL, *key = NULL;

  found[0] = '\0';
  if (PetscOptionsGetAll(NULL, &all) || !all) return;
  for (char *word = strtok_r(all, " ", &save); word && !found[0]; word = strtok_r(NULL, " ", &save)) {
    if (word[0] == '-' && isalpha((unsigned char)word[1])) key = word;
    else if (key) {
      char first[101]; /* of a value like ascii:file:format */
      snprintf(first, sizeof(first), "%.*s", (int)strcspn(word, ":"), word);
      if (HasWord(message, first)) snprintf(found, size, "%.100s %.100s: ", key, word);
    }
  }
  (void)PetscFree(all);
}

/* message as one line, and no orders to a terminal. */
static void Say(const char before[], const char message[], const char after[])
{
  fprintf(stderr, "dlmfd: error: %s", before);
  for (; *message; message++) fputc(iscntrl((unsigned char)*message) ? ' ' : *message, stderr);
  fprintf(stderr, "%s\n", after);
  fflush(stderr);
}

/*
  What a user can mend takes one line: errors of input, solves that do not converge, values that PETSc refuses for keys of its own, want of memory. It is raised
  once (INITIAL) and then passed up (REPEAT): only the first says anything, on rank 0; memory may be short on any rank.
*/
PetscErrorCode DLMErrorHandler(MPI_Comm comm, int line, const char *function, const char *file, PetscErrorCode code, PetscErrorType type, const char *message, void *context)
{
  PetscMPIInt rank = 0;
  char        key[256] = "";

  if (type != PETSC_ERROR_INITIAL) return users_fault ? code : PetscTraceBackErrorHandler(comm, line, function, file, code, type, message, context);
  if (!function) function = "";
  if (!message) message = "";
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  users_fault = PETSC_TRUE;
  if (IsOfMemory(code, function)) {
    snprintf(key, sizeof(key), "the memory of rank %d is too small (in ", rank);
    Say(key, message, "); allowed: a smaller -grid_resolution, or more machines");
    return PETSC_ERR_MEM;
  }
  if (code == PETSC_ERR_USER_INPUT || code == PETSC_ERR_NOT_CONVERGED) {
    if (rank == 0) Say("", message, "");
  } else if (IsOfAKey(function)) {
    FindKey(message, key, sizeof(key));
    if (rank == 0) Say(key, message, strstr(message, "Available options") ? "" : "; allowed: what PETSc's manual has for this key");
  } else {
    users_fault = PETSC_FALSE;
    return PetscTraceBackErrorHandler(comm, line, function, file, code, type, message, context);
  }
  return code;
}
