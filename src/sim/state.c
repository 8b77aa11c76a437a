#include "../../include/private/simimpl.h"

/* A sphere's part of the TS solution: the first five vectors of DLMSphereState. */
enum { STATE_WIDTH = 15 };

PetscErrorCode DLMSimulationCreateSolution(DLMSimulation sim)
{
  PetscFunctionBegin;
  PetscCall(VecCreateMPI(sim->scene->comm, PETSC_DECIDE, STATE_WIDTH * sim->scene->n_spheres, &sim->sphere_states));
  PetscCall(PetscObjectSetName((PetscObject)sim->sphere_states, "sphere states"));
  if (sim->polymer) {
    Vec C;
    PetscCall(DLMPolymerGetConformation(sim->polymer, &C));
    PetscCall(VecCreateNest(sim->scene->comm, 2, NULL, (Vec[]){ sim->sphere_states, C }, &sim->solution));
  } else {
    PetscCall(PetscObjectReference((PetscObject)sim->sphere_states));
    sim->solution = sim->sphere_states;
  }
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
  PetscCall(VecGetOwnershipRange(sim->sphere_states, &start, &end));
  PetscCall(VecGetArray(sim->sphere_states, &x));
  for (PetscInt i = start; i < end; i++) x[i - start] = ((PetscReal *)&state[i / STATE_WIDTH])[i % STATE_WIDTH];
  PetscCall(VecRestoreArray(sim->sphere_states, &x));
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
  PetscCall(VecScatterCreateToAll(sim->sphere_states, &scatter, &all));
  PetscCall(VecScatterBegin(scatter, sim->sphere_states, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, sim->sphere_states, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(all, &x));
  for (PetscInt i = 0; i < n; i++) PetscCall(PetscArraycpy((PetscReal *)&state[i], x + STATE_WIDTH * i, STATE_WIDTH));
  PetscCall(VecRestoreArrayRead(all, &x));
  PetscCall(VecDestroy(&all));
  PetscCall(VecScatterDestroy(&scatter));
  PetscFunctionReturn(0);
}
