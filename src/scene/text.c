/* Text files of the user: read whole on rank 0, found to be text, given to every rank. */
#include "sceneimpl.h"
#include <errno.h>

enum { LONGEST = 1 << 30 };

/* All bytes of a file and a zero after them, malloc'ed; NULL and errno. */
static char *ReadBytes(FILE *file, size_t *n)
{
  size_t room = 1 << 16;
  char  *text = malloc(room), *larger;

  for (*n = 0; text; text = larger, room *= 2) {
    *n += fread(text + *n, 1, room - *n - 1, file);
    if (*n + 1 < room) break;
    if (room >= LONGEST) errno = EFBIG;
    larger = room < LONGEST ? realloc(text, 2 * room) : NULL;
    if (!larger) free(text);
  }
  if (text && !ferror(file)) {
    text[*n] = '\0';
    return text;
  }
  free(text);
  return NULL;
}

char *DLMLoadText(const char path[], char reason[], size_t size)
{
  FILE  *file = fopen(path, "rb");
  size_t n    = 0;
  char  *text = file ? ReadBytes(file, &n) : NULL;
  long   line = 1;

  if (!text) snprintf(reason, size, "%s", strerror(errno));
  if (file) fclose(file);
  if (!text || strlen(text) == n) return text;
  for (const char *c = text; *c; c++) line += *c == '\n';
  snprintf(reason, size, "line %ld holds a zero byte, so it is no text in UTF-8", line);
  free(text);
  return NULL;
}

PetscErrorCode DLMLoadTextCollective(MPI_Comm comm, const char path[], char *text[])
{
  PetscMPIInt rank, size = -1;
  char        reason[128] = "", *read = NULL;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    read = DLMLoadText(path, reason, sizeof(reason));
    if (read) size = (PetscMPIInt)strlen(read);
  }
  PetscCallMPI(MPI_Bcast(&size, 1, MPI_INT, 0, comm));
  PetscCallMPI(MPI_Bcast(reason, (PetscMPIInt)sizeof(reason), MPI_CHAR, 0, comm));
  DLMUserCheck(size >= 0, comm, "options file %s: %s; allowed: a text file that can be read, up to 1 GiB", path, reason);
  PetscCall(PetscMalloc1(size + 1, text));
  if (!rank) memcpy(*text, read, (size_t)size + 1);
  free(read);
  PetscCallMPI(MPI_Bcast(*text, size + 1, MPI_CHAR, 0, comm));
  PetscFunctionReturn(0);
}
