#include <sys/stat.h>
#include <errno.h>
#include <signal.h>
#include <unistd.h>
#include "../../include/private/memory.h"
#include "../../include/private/outputimpl.h"

/* Creates a folder and those above it. Rank 0. Returns 0 or errno. */
static int MakeFolder(const char *path)
{
  char part[PETSC_MAX_PATH_LEN];

  for (size_t i = 1; i <= strlen(path); i++) {
    if (path[i] != '/' && path[i] != '\0') continue;
    snprintf(part, sizeof(part), "%.*s", (int)i, path);
    if (mkdir(part, 0777) && errno != EEXIST) return errno;
  }
  return 0;
}

/* Where the run can go on from, if the file is still there. Rank 0. */
static PetscErrorCode Advice(DLMSimulation sim, char text[], size_t size)
{
  const PetscBool saved = (PetscBool)(sim->saved_step >= 0);
  char            path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  if (saved) PetscCall(PetscSNPrintf(path, sizeof(path), "%s/checkpoint.h5", sim->scene->output_dir));
  else PetscCall(PetscStrncpy(path, sim->scene->restart, sizeof(path)));
  text[0] = '\0';
  if (path[0] && access(path, R_OK) == 0)
    PetscCall(PetscSNPrintf(text, size, "; -restart %s goes on from step %" PetscInt_FMT, path, saved ? sim->saved_step : sim->first_step));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMOutputRequire(DLMSimulation sim, int failed, const char *path)
{
  char        note[2 * PETSC_MAX_PATH_LEN] = "";
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&failed, 1, MPI_INT, 0, sim->scene->comm));
  if (!failed) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Comm_rank(sim->scene->comm, &rank));
  if (rank == 0) PetscCall(Advice(sim, note, sizeof(note))); /* rank 0 alone speaks */
  DLMUserCheck(failed != DLM_FILE_CHANGED, sim->scene->comm, "-output_dir %s: %s is not as this run left it; allowed: a folder of its own for each run%s", sim->scene->output_dir, path,
               note);
  DLMUserCheck(failed != DLM_FILE_COLUMNS, sim->scene->comm, "-output_dir %s: %s has other columns than this version writes; allowed: files of this version, or none: move this one away",
               sim->scene->output_dir, path);
  DLMUserCheck(PETSC_FALSE, sim->scene->comm, "-output_dir %s: cannot write %s (%s); allowed: a folder that can be written, with space%s", sim->scene->output_dir, path,
               strerror(failed), note);
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateFolder(DLMSimulation sim)
{
  PetscMPIInt rank;
  int         failed = 0;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(sim->scene->comm, &rank));
  if (rank == 0) failed = MakeFolder(sim->scene->output_dir);
  PetscCall(DLMOutputRequire(sim, failed, sim->scene->output_dir));
  PetscFunctionReturn(0);
}

static PetscErrorCode WriteCheckpoint(DLMOutput output, PetscInt step, PetscReal time)
{
  DLMSimulation sim = output->sim;
  PetscReal   dt;
  PetscMPIInt rank;
  int         failed;
  char        path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(TSGetTimeStep(sim->ts, &dt));
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/checkpoint.h5", sim->scene->output_dir));
  PetscCall(DLMCheckpointWrite(sim, path, dt, &failed));
  PetscCall(DLMOutputRequire(sim, failed, path));
  sim->saved_step = step;
  PetscCall(PetscTime(&sim->last_checkpoint));
  PetscCallMPI(MPI_Comm_rank(sim->scene->comm, &rank));
  if (rank == 0 && sim->stop_signal)
    printf("stopped by %s at t = %.6g, step %ld: -restart %s goes on\n", sim->stop_signal == SIGTERM ? "SIGTERM" : "SIGUSR1", (double)time, (long)step, path);
  PetscFunctionReturn(0);
}

/*
  A summary tells that a run has ended: that of a run before goes. The checkpoint of an earlier run does not belong to the files of a new one, but is not
  thrown away.
*/
static PetscErrorCode PutAside(DLMSimulation sim)
{
  PetscMPIInt rank;
  char        path[PETSC_MAX_PATH_LEN], aside[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(sim->scene->comm, &rank));
  if (rank) PetscFunctionReturn(0);
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/summary.json", sim->scene->output_dir));
  unlink(path);
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/checkpoint.h5", sim->scene->output_dir));
  PetscCall(PetscSNPrintf(aside, sizeof(aside), "%s/checkpoint_before.h5", sim->scene->output_dir));
  if (sim->first_step < 0 && rename(path, aside) == 0) printf("%s of an earlier run is now %s\n", path, aside);
  PetscFunctionReturn(0);
}

/* Writes, and books the time and what stays on the heap to the output's part. */
static PetscErrorCode Write(DLMOutput output, DLMPart k, PetscErrorCode (*write)(DLMOutput, PetscInt, PetscReal), PetscInt step, PetscReal time)
{
  DLMPartRecord  *part   = &output->sim->part[k];
  const PetscReal before = DLMMemoryInUse();
  PetscReal       kept;
  PetscLogDouble  start, end;

  PetscFunctionBegin;
  PetscCall(PetscTime(&start));
  PetscCall(write(output, step, time));
  PetscCall(PetscTime(&end));
  kept = DLMMemoryInUse() - before;
  part->seconds += end - start;
  part->bytes += kept;
  output->sim->heap += kept;
  PetscFunctionReturn(0);
}

/* Every step: files at their intervals, the health of the run, progress; then the checkpoint, which stands for all that is written before it. */
static PetscErrorCode Monitor(TS ts, PetscInt step, PetscReal time, Vec solution, void *context)
{
  DLMOutput       output = (DLMOutput)context;
  DLMSimulation   sim    = output->sim;
  const DLMScene *scene  = sim->scene;
  TSConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(TSGetConvergedReason(ts, &reason));
  const PetscBool last = (PetscBool)(reason != TS_CONVERGED_ITERATING);
  if (step == sim->first_step) PetscFunctionReturn(0); /* the run before has written it */
  if (sim->spheres) {
    PetscReal slip = 0.0;
    PetscCall(DLMSpheresGetSmallestGap(sim->spheres, &sim->gap));
    sim->smallest_gap = PetscMin(sim->smallest_gap, sim->gap);
    if (step > 0) PetscCall(DLMSaddleGetSlip(sim->saddle, &slip));
    sim->largest_slip = PetscMax(sim->largest_slip, slip);
  }
  const PetscBool rows = (PetscBool)(step % PetscMax(1, scene->output_every) == 0 || last);
  if (rows && sim->part[DLM_PART_TRAJECTORY].built) PetscCall(Write(output, DLM_PART_TRAJECTORY, DLMTrajectoryWrite, step, time));
  if (rows && sim->part[DLM_PART_BULK].built && sim->flowing) PetscCall(Write(output, DLM_PART_BULK, DLMBulkWrite, step, time));
  if (output->fields && (step % scene->output_fields_every == 0 || last)) PetscCall(Write(output, DLM_PART_FIELDS, DLMFieldsWrite, step, time));
  PetscCall(DLMProgress(output, step, time, last));
  if (sim->checkpoint_due) PetscCall(Write(output, DLM_PART_CHECKPOINTS, WriteCheckpoint, step, time));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMOutputCreate(DLMSimulation sim, DLMOutput *new_output)
{
  DLMOutput output;

  PetscFunctionBegin;
  PetscCall(PetscNew(&output));
  output->sim = sim;
  *new_output = output;
  signal(SIGXFSZ, SIG_IGN); /* a file beyond the limit of its size is a write that fails, not the end of the process */
  PetscCall(CreateFolder(sim));
  PetscCall(PetscTime(&output->started));
  output->last_progress = output->started;
  PetscCall(TSGetStepNumber(sim->ts, &output->start_step));
  output->last_step = output->start_step;
  PetscCall(DLMTrajectoryOpen(output));
  PetscCall(DLMBulkOpen(output));
  PetscCall(PutAside(sim)); /* after what may refuse the folder */
  if (sim->scene->output_fields_every > 0) PetscCall(DLMFieldsOpen(output));
  PetscCall(TSMonitorSet(sim->ts, Monitor, output, NULL));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMOutputFinish(DLMOutput output)
{
  PetscFunctionBegin;
  PetscCall(DLMSummaryWrite(output));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMOutputDestroy(DLMOutput *output)
{
  PetscFunctionBegin;
  if (!*output) PetscFunctionReturn(0);
  PetscCall(DLMFieldFileDestroy(&(*output)->fields));
  PetscCall(PetscFree(*output));
  PetscFunctionReturn(0);
}
