#include "../../include/private/simimpl.h"

/*
  What a step changes, kept at its start for a step that is rejected. The multipliers are first guesses only; so is the fluid, but a checkpoint takes the
  polymer's gradient from it.
*/
PetscErrorCode DLMSimulationKeep(void *context)
{
  DLMSimulation   sim = (DLMSimulation)context;
  DLMSphereState *state;
  PetscInt        n;
  Vec             fluid;

  PetscFunctionBegin;
  PetscCall(DLMSaddleGetFluid(sim->saddle, &fluid));
  if (!sim->kept_fluid) PetscCall(VecDuplicate(fluid, &sim->kept_fluid));
  PetscCall(VecCopy(fluid, sim->kept_fluid));
  PetscCall(TSGetTimeStep(sim->ts, &sim->kept_dt));
  if (sim->spheres) {
    PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
    if (!sim->kept) PetscCall(PetscMalloc1(n, &sim->kept));
    PetscCall(PetscArraycpy(sim->kept, state, n));
  }
  sim->kept_velocity_time = sim->velocity_time;
  sim->kept_last_interval = sim->last_interval;
  if (sim->polymer) PetscCall(DLMPolymerKeep(sim->polymer));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationBringBack(void *context)
{
  DLMSimulation   sim = (DLMSimulation)context;
  DLMSphereState *state;
  PetscInt        n;

  PetscFunctionBegin;
  if (sim->spheres) {
    PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
    PetscCall(PetscArraycpy(state, sim->kept, n));
  }
  sim->velocity_time = sim->kept_velocity_time;
  sim->last_interval = sim->kept_last_interval;
  if (sim->polymer) PetscCall(DLMPolymerBringBack(sim->polymer));
  PetscFunctionReturn(0);
}

/*
  The state of the start of the step is back: it goes to a checkpoint of its own, without the multipliers of the failed step. checkpoint.h5 stays, since
  the trouble may have begun before.
*/
static PetscErrorCode SaveLast(DLMSimulation sim, char note[], size_t size)
{
  DLMSaddleState saddle;
  PetscInt       step;
  int            failed;
  Vec            fluid;
  char           path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  note[0] = '\0';
  PetscCall(TSGetStepNumber(sim->ts, &step));
  if (step == 0 || sim->scene->dry_run) PetscFunctionReturn(0);
  PetscCall(DLMSaddleGetFluid(sim->saddle, &fluid));
  PetscCall(VecCopy(sim->kept_fluid, fluid));
  if (sim->spheres) {
    PetscCall(DLMSaddleStateCreate(sim->saddle, &saddle));
    PetscCall(DLMSaddleGetState(sim->saddle, &saddle));
    PetscCall(PetscArrayzero(saddle.multipliers, saddle.n_multipliers));
    saddle.reference = 0.0;
    PetscCall(DLMSaddleSetState(sim->saddle, &saddle));
    PetscCall(DLMSaddleStateDestroy(&saddle));
  }
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/checkpoint_last.h5", sim->scene->output_dir));
  PetscCall(DLMCheckpointWrite(sim, path, sim->kept_dt, &failed));
  if (failed) PetscCall(PetscSNPrintf(note, size, "; %s could not be written (%s)", path, strerror(failed)));
  else PetscCall(PetscSNPrintf(note, size, "; -restart %s goes on from the step before", path));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationGiveUp(void *context)
{
  DLMSimulation    sim = (DLMSimulation)context;
  const PetscReal *x   = sim->worst.place;
  char             note[PETSC_MAX_PATH_LEN + 128];

  PetscFunctionBegin;
  PetscCall(SaveLast(sim, note, sizeof(note)));
  DLMUserCheck(PETSC_FALSE, sim->scene->comm,
               "the conformation tensor lost positivity or became infinite at t = %.6g near x = %.4g,%.4g,%.4g (largest trace so far %.4g): use a smaller -ts_dt, "
               "-polymer_form log, -split_retries 3, or a finer -grid_resolution%s",
               (double)sim->worst_time, (double)x[0], (double)x[1], (double)x[2], (double)sim->worst.largest_trace, note);
  PetscFunctionReturn(0);
}
