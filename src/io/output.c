#include <sys/stat.h>
#include <errno.h>
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

static PetscErrorCode CreateFolder(const DLMScene *scene)
{
  PetscMPIInt rank;
  int         failed = 0;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(scene->comm, &rank));
  if (rank == 0) failed = MakeFolder(scene->output_dir);
  PetscCallMPI(MPI_Bcast(&failed, 1, MPI_INT, 0, scene->comm));
  DLMUserCheck(!failed, scene->comm, "output_dir: cannot create the folder %s (%s), give a folder that can be written", scene->output_dir, strerror(failed));
  PetscFunctionReturn(0);
}

/* Every step: files at their intervals, the health of the run, progress. */
static PetscErrorCode Monitor(TS ts, PetscInt step, PetscReal time, Vec solution, void *context)
{
  DLMOutput       output = (DLMOutput)context;
  const DLMScene *scene  = output->sim->scene;
  TSConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(TSGetConvergedReason(ts, &reason));
  const PetscBool last = (PetscBool)(reason != TS_CONVERGED_ITERATING);
  if (output->sim->spheres) {
    PetscReal gap, slip;
    PetscCall(DLMSpheresGetSmallestGap(output->sim->spheres, &gap));
    output->smallest_gap = PetscMin(output->smallest_gap, gap);
    if (step > 0) PetscCall(DLMSaddleGetSlip(output->sim->saddle, &slip));
    else slip = 0.0;
    output->largest_slip = PetscMax(output->largest_slip, slip);
  }
  if (step % PetscMax(1, scene->output_every) == 0 || last) PetscCall(DLMTrajectoryWrite(output, step, time));
  if (output->fields && (step % scene->output_fields_every == 0 || last)) PetscCall(DLMFieldsWrite(output, step, time));
  PetscCall(DLMProgress(output, step, time, last));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMOutputCreate(DLMSimulation sim, DLMOutput *new_output)
{
  DLMOutput output;

  PetscFunctionBegin;
  PetscCall(PetscNew(&output));
  output->sim          = sim;
  output->smallest_gap = PETSC_INFINITY;
  *new_output          = output;
  PetscCall(CreateFolder(sim->scene));
  PetscCall(PetscTime(&output->started));
  output->last_progress = output->started;
  PetscCall(TSGetTime(sim->ts, &output->start_time));
  PetscCall(DLMTrajectoryOpen(output));
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
  if ((*output)->trajectory) fclose((*output)->trajectory);
  PetscCall(DLMFieldFileDestroy(&(*output)->fields));
  PetscCall(PetscFree(*output));
  PetscFunctionReturn(0);
}
