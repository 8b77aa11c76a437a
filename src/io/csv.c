#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include "../../include/private/csv.h"
#include "../../include/private/outputimpl.h"
#include "../../include/private/wholefile.h"

/* A first line that a killed run left unfinished is no other one. */
static PetscBool SameColumns(const char *header, const char *line, size_t n)
{
  return (PetscBool)(n <= strlen(header) && !strncmp(line, header, n) && (line[n - 1] != '\n' || n == strlen(header)));
}

/* The header and the whole rows of steps up to and including last. Returns 0, DLM_FILE_COLUMNS or ENOMEM. */
static int CopyRows(FILE *old, const char *header, PetscInt last, FILE *kept)
{
  char   *row  = NULL, *end;
  size_t  room = 0;
  ssize_t n    = getline(&row, &room, old);
  int     failed = n > 0 && !SameColumns(header, row, (size_t)n) ? DLM_FILE_COLUMNS : 0;

  fputs(header, kept);
  while (!failed && (n = getline(&row, &room, old)) > 0) {
    const long step = strtol(row, &end, 10);
    if (row[n - 1] == '\n' && *end == ',' && end > row && step <= (long)last) fputs(row, kept);
  }
  free(row);
  return failed;
}

/* What a run that goes on finds stays up to its first step, through a temporary file; an absent file has no rows. Returns 0, errno or DLM_FILE_COLUMNS. */
static int KeepRows(const char *path, const char *header, PetscInt last)
{
  FILE *old = fopen(path, "r"), *kept;
  char  fresh[PETSC_MAX_PATH_LEN + 8];
  int   failed;

  if (!old) return errno == ENOENT ? DLMFileReplace(path, header, strlen(header), NULL, 0) : errno;
  snprintf(fresh, sizeof(fresh), "%s.new", path);
  kept   = fopen(fresh, "w");
  failed = kept ? CopyRows(old, header, last, kept) : errno;
  fclose(old);
  if (!failed && (fflush(kept) || ferror(kept) || fsync(fileno(kept)))) failed = errno ? errno : EIO;
  if (kept && fclose(kept) && !failed) failed = errno;
  if (!failed && rename(fresh, path)) failed = errno;
  if (failed) unlink(fresh);
  return failed;
}

PetscErrorCode DLMCsvOpen(DLMSimulation sim, const char *name, const char *header, DLMCsv *csv)
{
  PetscMPIInt rank;
  struct stat status;
  int         failed = 0;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(sim->scene->comm, &rank));
  PetscCall(PetscSNPrintf(csv->path, sizeof(csv->path), "%s/%s", sim->scene->output_dir, name));
  if (rank == 0) {
    if (sim->first_step >= 0) failed = KeepRows(csv->path, header, sim->first_step);
    else failed = DLMFileReplace(csv->path, header, strlen(header), NULL, 0);
    if (!failed && stat(csv->path, &status)) failed = errno;
    if (!failed) csv->bytes = (size_t)status.st_size;
  }
  PetscCall(DLMOutputRequire(sim, failed, csv->path));
  PetscFunctionReturn(0);
}

/*
  Whole rows at the end of the file, which is opened for them alone: a file that was moved, deleted or written by another program is noticed, not written to.
  Returns 0, errno or DLM_FILE_CHANGED; the file then ends where it did.
*/
static int Append(DLMCsv *csv, const char *text, size_t n, PetscBool flush)
{
  struct stat status;
  int         failed = 0, fd = open(csv->path, O_WRONLY | O_APPEND);

  if (fd < 0) return errno;
  if (fstat(fd, &status)) failed = errno;
  else if ((size_t)status.st_size != csv->bytes) failed = DLM_FILE_CHANGED;
  else {
    failed = DLMFileWrite(fd, text, n);
    if (!failed && flush && fsync(fd)) failed = errno;
    if (failed && ftruncate(fd, (off_t)csv->bytes)) failed = errno;
  }
  if (close(fd) && !failed) failed = errno;
  if (!failed) csv->bytes += n;
  return failed;
}

PetscErrorCode DLMCsvAppend(DLMSimulation sim, DLMCsv *csv, const char *text, size_t n)
{
  PetscMPIInt rank;
  int         failed = 0;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(sim->scene->comm, &rank));
  if (rank == 0) failed = text ? Append(csv, text, n, sim->checkpoint_due) : ENOMEM;
  PetscCall(DLMOutputRequire(sim, failed, csv->path));
  PetscFunctionReturn(0);
}
