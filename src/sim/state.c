#include "../../include/private/simimpl.h"

/* A sphere's part of the TS solution: the first five vectors of DLMSphereState. */
enum { STATE_WIDTH = 15 };

PetscErrorCode DLMSimulationCreateSolution(DLMSimulation sim)
{
  PetscFunctionBegin;
  PetscCall(VecCreateMPI(sim->scene->comm, PETSC_DECIDE, STATE_WIDTH * sim->scene->n_spheres, &sim->solution));
  PetscCall(PetscObjectSetName((PetscObject)sim->solution, "sphere states"));
  if (sim->spheres) PetscCall(DLMSimulationStore(sim, sim->solution));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationStore(void *context, Vec solution)
{
  DLMSimulation   sim = (DLMSimulation)context;
  DLMSphereState *state;
  PetscInt        start, end;
  PetscScalar    *x;

  PetscFunctionBegin;
  if (!sim->spheres) PetscFunctionReturn(0);
  PetscCall(DLMSpheresGetStates(sim->spheres, NULL, &state));
  PetscCall(VecGetOwnershipRange(solution, &start, &end));
  PetscCall(VecGetArray(solution, &x));
  for (PetscInt i = start; i < end; i++) x[i - start] = state[i / STATE_WIDTH].center[i % STATE_WIDTH];
  PetscCall(VecRestoreArray(solution, &x));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationLoad(void *context, Vec solution)
{
  DLMSimulation      sim = (DLMSimulation)context;
  DLMSphereState    *state;
  VecScatter         scatter;
  PetscInt           n;
  Vec                all;
  const PetscScalar *x;

  PetscFunctionBegin;
  if (!sim->spheres) PetscFunctionReturn(0);
  PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
  PetscCall(VecScatterCreateToAll(solution, &scatter, &all));
  PetscCall(VecScatterBegin(scatter, solution, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, solution, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(all, &x));
  for (PetscInt i = 0; i < n; i++) PetscCall(PetscArraycpy(state[i].center, x + STATE_WIDTH * i, STATE_WIDTH));
  PetscCall(VecRestoreArrayRead(all, &x));
  PetscCall(VecDestroy(&all));
  PetscCall(VecScatterDestroy(&scatter));
  PetscFunctionReturn(0);
}
