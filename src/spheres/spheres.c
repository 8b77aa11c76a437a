#include "../../include/private/spheresimpl.h"

PetscErrorCode DLMSpheresCreate(DLMGrid grid, const DLMScene *scene, DLMSpheres *new_spheres)
{
  DLMSpheres spheres;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&spheres));
  spheres->grid  = grid;
  spheres->scene = scene;
  spheres->n     = scene->n_spheres;
  PetscCall(PetscCalloc3(spheres->n, &spheres->state, spheres->n, &spheres->owner, spheres->n, &spheres->owned));
  for (PetscInt i = 0; i < spheres->n; i++) {
    const DLMSphereSpec *spec  = &scene->spheres[i];
    DLMSphereState      *state = &spheres->state[i];
    for (int d = 0; d < 3; d++) {
      state->center[d]   = spec->center[d];
      state->velocity[d] = state->velocity_before[d] = spec->velocity[d];
      state->omega[d] = state->omega_before[d] = spec->omega[d];
    }
  }
  *new_spheres = spheres;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSpheresDestroy(DLMSpheres *spheres)
{
  PetscFunctionBeginUser;
  if (!*spheres) PetscFunctionReturn(0);
  PetscCall(PetscFree3((*spheres)->state, (*spheres)->owner, (*spheres)->owned));
  PetscCall(PetscFree(*spheres));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSpheresGetStates(DLMSpheres spheres, PetscInt *n, DLMSphereState **states)
{
  PetscFunctionBegin;
  if (n) *n = spheres->n;
  if (states) *states = spheres->state;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSpheresGetOwned(DLMSpheres spheres, PetscInt *n, const PetscInt **owned)
{
  PetscFunctionBegin;
  if (n) *n = spheres->n_owned;
  if (owned) *owned = spheres->owned;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSpheresGetWrapped(DLMSpheres spheres, PetscInt i, PetscReal center[3])
{
  DLMGrid grid = spheres->grid;

  PetscFunctionBegin;
  for (int d = 0; d < 3; d++) {
    const PetscReal length = DLMGridPeriod(grid, d);
    center[d]              = spheres->state[i].center[d];
    if (grid->periodic[d]) center[d] -= length * PetscFloorReal((center[d] - grid->lower[d]) / length);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSpheresSeparation(DLMSpheres spheres, PetscInt i, PetscInt j, PetscReal d[3])
{
  DLMGrid grid = spheres->grid;

  PetscFunctionBegin;
  for (int c = 0; c < 3; c++) {
    const PetscReal length = DLMGridPeriod(grid, c);
    d[c]                   = spheres->state[j].center[c] - spheres->state[i].center[c];
    if (grid->periodic[c]) d[c] -= length * PetscFloorReal(d[c] / length + 0.5);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSpheresShare(DLMSpheres spheres)
{
  const PetscInt width = (PetscInt)((sizeof(DLMSphereState) - offsetof(DLMSphereState, velocity)) / sizeof(PetscReal));
  PetscMPIInt    rank, size;
  PetscReal     *all;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(spheres->grid->comm, &size));
  if (size == 1) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Comm_rank(spheres->grid->comm, &rank));
  PetscCall(PetscCalloc1(width * spheres->n, &all));
  for (PetscInt i = 0; i < spheres->n; i++)
    if (spheres->owner[i] == rank) PetscCall(PetscArraycpy(all + width * i, spheres->state[i].velocity, width));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, all, (PetscMPIInt)(width * spheres->n), MPIU_REAL, MPI_SUM, spheres->grid->comm));
  for (PetscInt i = 0; i < spheres->n; i++) PetscCall(PetscArraycpy(spheres->state[i].velocity, all + width * i, width));
  PetscCall(PetscFree(all));
  PetscFunctionReturn(0);
}
