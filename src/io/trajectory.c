#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include "../../include/private/outputimpl.h"
#include "../../include/private/wholefile.h"

static const char header[] = "step,time,sphere,x1,x2,x3,V1,V2,V3,omega1,omega2,omega3,F1,F2,F3,T1,T2,T3\n";

/*
  Rows of a trajectory up to and including a step, whole ones only, through a temporary file. An absent file has none. Returns 0 or errno.
*/
static int KeepRows(const char *path, PetscInt last)
{
  FILE   *old = fopen(path, "r"), *kept;
  char   *row = NULL, fresh[PETSC_MAX_PATH_LEN + 8];
  size_t  room = 0;
  ssize_t length;
  int     failed = 0;

  if (!old && errno != ENOENT) return errno;
  snprintf(fresh, sizeof(fresh), "%s.new", path);
  kept = fopen(fresh, "w");
  if (!kept) failed = errno;
  if (!failed) fputs(header, kept);
  while (!failed && old && (length = getline(&row, &room, old)) > 0) {
    char *end;
    const long step = strtol(row, &end, 10);
    if (row[length - 1] == '\n' && *end == ',' && end > row && step <= (long)last) fputs(row, kept);
  }
  free(row);
  if (old) fclose(old);
  if (!failed && (fflush(kept) || ferror(kept) || fsync(fileno(kept)))) failed = errno ? errno : EIO;
  if (kept && fclose(kept) && !failed) failed = errno;
  if (!failed && rename(fresh, path)) failed = errno;
  if (failed) unlink(fresh);
  return failed;
}

PetscErrorCode DLMTrajectoryOpen(DLMOutput output)
{
  const DLMScene *scene = output->sim->scene;
  PetscMPIInt     rank;
  struct stat     status;
  int             failed = 0;

  PetscFunctionBegin;
  if (!output->sim->spheres) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Comm_rank(scene->comm, &rank));
  PetscCall(PetscSNPrintf(output->trajectory, sizeof(output->trajectory), "%s/trajectory.csv", scene->output_dir));
  if (rank == 0) {
    if (output->sim->first_step >= 0) failed = KeepRows(output->trajectory, output->sim->first_step);
    else failed = DLMFileReplace(output->trajectory, header, strlen(header), NULL, 0);
    if (!failed && stat(output->trajectory, &status)) failed = errno;
    if (!failed) output->trajectory_bytes = (size_t)status.st_size;
  }
  PetscCall(DLMOutputRequire(output->sim, failed, output->trajectory));
  PetscFunctionReturn(0);
}

/* The rows of a step as text, malloc'ed, NULL if there is no memory. */
static char *Rows(DLMOutput output, PetscInt step, PetscReal time, PetscInt n, const DLMSphereState state[], size_t *size)
{
  char *text = NULL;
  FILE *out  = open_memstream(&text, size);

  for (PetscInt i = 0; out && i < n; i++) {
    PetscReal center[3], velocity[3];
    for (int d = 0; d < 3; d++) {
      center[d]   = state[i].center[d] + output->sim->frame_velocity[d] * time;
      velocity[d] = state[i].velocity[d] + output->sim->frame_velocity[d];
    }
    const PetscReal *columns[5] = { center, velocity, state[i].omega, state[i].force, state[i].torque };
    fprintf(out, "%ld,%.15g,%ld", (long)step, (double)time, (long)i);
    for (int c = 0; c < 15; c++) fprintf(out, ",%.15g", (double)columns[c / 3][c % 3]);
    fputc('\n', out);
  }
  if (out && !fclose(out)) return text;
  free(text);
  return NULL;
}

/*
  Whole rows at the end of the file, which is opened for them alone: a file that was moved, deleted or written by another program is noticed, not written to.
  Returns 0, errno or DLM_FILE_CHANGED; the file then ends where it did.
*/
static int Append(const char *path, size_t *bytes, const char *text, size_t n, PetscBool flush)
{
  struct stat status;
  int         failed = 0, fd = open(path, O_WRONLY | O_APPEND);

  if (fd < 0) return errno;
  if (fstat(fd, &status)) failed = errno;
  else if ((size_t)status.st_size != *bytes) failed = DLM_FILE_CHANGED;
  else {
    failed = DLMFileWrite(fd, text, n);
    if (!failed && flush && fsync(fd)) failed = errno;
    if (failed && ftruncate(fd, (off_t)*bytes)) failed = errno;
  }
  if (close(fd) && !failed) failed = errno;
  if (!failed) *bytes += n;
  return failed;
}

PetscErrorCode DLMTrajectoryWrite(DLMOutput output, PetscInt step, PetscReal time)
{
  DLMSphereState *state;
  PetscInt        n;
  PetscMPIInt     rank;
  int             failed = 0;

  PetscFunctionBegin;
  if (!output->sim->spheres) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Comm_rank(output->sim->scene->comm, &rank));
  PetscCall(DLMSpheresGetStates(output->sim->spheres, &n, &state));
  if (rank == 0) {
    size_t size;
    char  *text = Rows(output, step, time, n, state, &size);
    failed = text ? Append(output->trajectory, &output->trajectory_bytes, text, size, output->sim->checkpoint_due) : ENOMEM;
    free(text);
  }
  PetscCall(DLMOutputRequire(output->sim, failed, output->trajectory));
  PetscFunctionReturn(0);
}
