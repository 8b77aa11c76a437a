#include "sceneimpl.h"
#include <ctype.h>

/* A user error is raised once (INITIAL) and then passed up (REPEAT): only the first says anything. */
PetscErrorCode DLMErrorHandler(MPI_Comm comm, int line, const char *function, const char *file,
                               PetscErrorCode code, PetscErrorType type, const char *message, void *context)
{
  PetscMPIInt rank = 0;
  char        text[2048];
  size_t      n = 0;

  if (code != PETSC_ERR_USER_INPUT) {
    return PetscTraceBackErrorHandler(comm, line, function, file, code, type, message, context);
  }
  if (type != PETSC_ERROR_INITIAL) return code;
  if (comm != MPI_COMM_NULL) MPI_Comm_rank(comm, &rank);
  if (rank) return code;
  for (; message && message[n] && n + 1 < sizeof(text); n++) text[n] = (char)(iscntrl((unsigned char)message[n]) ? ' ' : message[n]); /* one line, and no orders to a terminal */
  text[n] = '\0';
  fprintf(stderr, "dlmfd: error: %s\n", text);
  fflush(stderr);
  return code;
}
