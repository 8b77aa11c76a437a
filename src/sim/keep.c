#include "../../include/private/simimpl.h"

/* What a step changes, kept at its start for a step that is rejected. The fluid and the multipliers are first guesses only. */
PetscErrorCode DLMSimulationKeep(void *context)
{
  DLMSimulation   sim = (DLMSimulation)context;
  DLMSphereState *state;
  PetscInt        n;

  PetscFunctionBegin;
  if (sim->spheres) {
    PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
    if (!sim->kept) PetscCall(PetscMalloc1(n, &sim->kept));
    PetscCall(PetscArraycpy(sim->kept, state, n));
  }
  sim->kept_velocity_time = sim->velocity_time;
  sim->kept_last_interval = sim->last_interval;
  PetscCall(DLMPolymerKeep(sim->polymer));
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
  PetscCall(DLMPolymerBringBack(sim->polymer));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationGiveUp(void *context)
{
  DLMSimulation    sim = (DLMSimulation)context;
  const PetscReal *x   = sim->worst.place;

  PetscFunctionBegin;
  DLMUserCheck(PETSC_FALSE, sim->scene->comm,
               "the conformation tensor lost positivity or became infinite at t = %.6g near x = %.4g,%.4g,%.4g (largest trace so far %.4g): use a smaller -ts_dt, "
               "-polymer_form log, -split_retries 3, or a finer -grid_resolution",
               (double)sim->worst_time, (double)x[0], (double)x[1], (double)x[2], (double)sim->worst.largest_trace);
  PetscFunctionReturn(0);
}
