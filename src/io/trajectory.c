#include <errno.h>
#include <unistd.h>
#include "../../include/private/outputimpl.h"

static const char header[] = "step,time,sphere,x1,x2,x3,V1,V2,V3,omega1,omega2,omega3,F1,F2,F3,T1,T2,T3\n";

/* Tells every rank whether rank 0 could write. */
static PetscErrorCode Agree(DLMOutput output, int written)
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&written, 1, MPI_INT, 0, output->sim->scene->comm));
  DLMUserCheck(written, output->sim->scene->comm, "output_dir: cannot write %s/trajectory.csv, free some space or give another folder",
               output->sim->scene->output_dir);
  PetscFunctionReturn(0);
}

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
  if (kept && (ferror(kept) | fclose(kept))) failed = errno ? errno : EIO;
  if (!failed && rename(fresh, path)) failed = errno;
  if (failed) unlink(fresh);
  return failed;
}

PetscErrorCode DLMTrajectoryOpen(DLMOutput output)
{
  const DLMScene *scene = output->sim->scene;
  char            path[PETSC_MAX_PATH_LEN];
  PetscMPIInt     rank;
  int             written = 1;

  PetscFunctionBegin;
  if (!output->sim->spheres) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Comm_rank(scene->comm, &rank));
  if (rank == 0) {
    PetscCall(PetscSNPrintf(path, sizeof(path), "%s/trajectory.csv", scene->output_dir));
    if (output->sim->first_step >= 0) written = !KeepRows(path, output->sim->first_step);
    if (written) output->trajectory = fopen(path, output->sim->first_step >= 0 ? "a" : "w");
    written = output->trajectory && (output->sim->first_step >= 0 || fputs(header, output->trajectory) >= 0);
  }
  PetscCall(Agree(output, written));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMTrajectoryWrite(DLMOutput output, PetscInt step, PetscReal time)
{
  DLMSphereState *state;
  PetscInt        n;
  int             written = 1;

  PetscFunctionBegin;
  if (!output->sim->spheres) PetscFunctionReturn(0);
  PetscCall(DLMSpheresGetStates(output->sim->spheres, &n, &state));
  for (PetscInt i = 0; output->trajectory && i < n; i++) {
    PetscReal center[3], velocity[3];
    for (int d = 0; d < 3; d++) {
      center[d]   = state[i].center[d] + output->sim->frame_velocity[d] * time;
      velocity[d] = state[i].velocity[d] + output->sim->frame_velocity[d];
    }
    const PetscReal *columns[5] = { center, velocity, state[i].omega, state[i].force, state[i].torque };
    fprintf(output->trajectory, "%ld,%.15g,%ld", (long)step, (double)time, (long)i);
    for (int c = 0; c < 15; c++) fprintf(output->trajectory, ",%.15g", (double)columns[c / 3][c % 3]);
    fputc('\n', output->trajectory);
  }
  if (output->trajectory) written = !fflush(output->trajectory) && !ferror(output->trajectory);
  PetscCall(Agree(output, written));
  PetscFunctionReturn(0);
}
