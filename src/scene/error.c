#include "sceneimpl.h"
#include <ctype.h>

/*
  What a user can mend takes one line: errors of input, solves that do not converge, want of memory. It is raised once (INITIAL) and then passed up (REPEAT): only the first
  says anything, on rank 0; memory may be short on any rank.
*/
PetscErrorCode DLMErrorHandler(MPI_Comm comm, int line, const char *function, const char *file,
                               PetscErrorCode code, PetscErrorType type, const char *message, void *context)
{
  PetscMPIInt rank = 0;
  char        text[2048];
  size_t      n = 0;

  if (type == PETSC_ERROR_INITIAL && function && strstr(function, "lloc") && strncmp(function, "Petsc", 5) == 0) code = PETSC_ERR_MEM; /* PETSc 3.18 gives the number of a line instead */
  if (code != PETSC_ERR_USER_INPUT && code != PETSC_ERR_NOT_CONVERGED && code != PETSC_ERR_MEM)
    return PetscTraceBackErrorHandler(comm, line, function, file, code, type, message, context);
  if (type != PETSC_ERROR_INITIAL) return code;
  if (comm != MPI_COMM_NULL) MPI_Comm_rank(code == PETSC_ERR_MEM ? PETSC_COMM_WORLD : comm, &rank);
  if (rank && code != PETSC_ERR_MEM) return code;
  for (; message && message[n] && n + 1 < sizeof(text); n++) text[n] = (char)(iscntrl((unsigned char)message[n]) ? ' ' : message[n]); /* one line, and no orders to a terminal */
  text[n] = '\0';
  if (code != PETSC_ERR_MEM) fprintf(stderr, "dlmfd: error: %s\n", text);
  else fprintf(stderr, "dlmfd: error: the memory of rank %d is too small (in %s); allowed: a smaller -grid_resolution, or more machines\n", rank, text);
  fflush(stderr);
  return code;
}
