#include "../../include/private/gridimpl.h"
#include "../../include/private/outputimpl.h"

/*
  Fields are drawn where the mesh is: in the frame that rides with the mean wall velocity. Velocities are those of the scene's frame.
*/
PetscErrorCode DLMFieldsOpen(DLMOutput output)
{
  DLMGrid         grid = output->sim->grid;
  const PetscReal fine[3] = { grid->h, grid->h, grid->h }, coarse[3] = { 2.0 * grid->h, 2.0 * grid->h, 2.0 * grid->h };
  PetscInt        nodes[3];

  PetscFunctionBegin;
  PetscCall(DLMFieldFileCreate(grid->comm, output->sim->scene->output_dir, output->sim->first_step, &output->fields));
  PetscCall(DLMFieldFileAddMesh(output->fields, "velocity_mesh", grid->nodes, grid->lower, fine, grid->periodic));
  for (int d = 0; d < 3; d++) nodes[d] = grid->cells[d] / 2 + (grid->periodic[d] ? 0 : 1);
  PetscCall(DLMFieldFileAddMesh(output->fields, "pressure_mesh", nodes, grid->lower, coarse, grid->periodic));
  PetscFunctionReturn(0);
}

static PetscErrorCode WriteSpheres(DLMOutput output)
{
  DLMSphereState *state;
  PetscInt        n;
  PetscReal      *x, *radius, *V, *omega;

  PetscFunctionBegin;
  PetscCall(DLMSpheresGetStates(output->sim->spheres, &n, &state));
  PetscCall(PetscMalloc4(3 * n, &x, n, &radius, 3 * n, &V, 3 * n, &omega));
  for (PetscInt i = 0; i < n; i++) {
    radius[i] = output->sim->scene->spheres[i].radius;
    PetscCall(DLMSpheresGetWrapped(output->sim->spheres, i, x + 3 * i));
    for (int d = 0; d < 3; d++) V[3 * i + d] = state[i].velocity[d] + output->sim->frame_velocity[d];
    PetscCall(PetscArraycpy(omega + 3 * i, state[i].omega, 3));
  }
  PetscCall(DLMFieldFileWriteSpheres(output->fields, n, x, radius, V, omega));
  PetscCall(PetscFree4(x, radius, V, omega));
  PetscFunctionReturn(0);
}

/* Planar components (11, 22, 33, 12, 13, 23) as XDMF orders a symmetric tensor: 11, 12, 13, 22, 23, 33. */
static PetscErrorCode WriteConformation(DLMOutput output, DM velocity)
{
  static const int   order[6] = { 0, 3, 4, 1, 5, 2 };
  const PetscScalar *planar;
  PetscScalar       *x;
  PetscInt           n;
  DM                 dm;
  Vec                C, shown;

  PetscFunctionBegin;
  PetscCall(DLMPolymerGetConformation(output->sim->polymer, &C));
  PetscCall(DMDACreateCompatibleDMDA(velocity, 6, &dm));
  PetscCall(DMCreateGlobalVector(dm, &shown));
  PetscCall(VecGetLocalSize(C, &n));
  PetscCall(VecGetArrayRead(C, &planar));
  PetscCall(VecGetArray(shown, &x));
  for (PetscInt i = 0; i < n / 6; i++)
    for (int k = 0; k < 6; k++) x[6 * i + k] = planar[order[k] * (n / 6) + i];
  PetscCall(VecRestoreArray(shown, &x));
  PetscCall(VecRestoreArrayRead(C, &planar));
  PetscCall(DLMFieldFileWriteVec(output->fields, "velocity_mesh", "conformation", dm, shown));
  PetscCall(VecDestroy(&shown));
  PetscCall(DMDestroy(&dm));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldsWrite(DLMOutput output, PetscInt step, PetscReal time)
{
  DM   velocity, pressure;
  Vec  x, u, p, shown;
  int  failed;
  char path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(DLMGridGetDMs(output->sim->grid, &velocity, &pressure));
  PetscCall(DLMSaddleGetFluid(output->sim->saddle, &x));
  PetscCall(DLMStokesGetParts(output->sim->stokes, x, &u, &p));
  PetscCall(DMGetGlobalVector(velocity, &shown));
  PetscCall(VecCopy(u, shown));
  for (int d = 0; d < 3; d++) {
    PetscScalar *v;
    PetscInt     n;
    PetscCall(VecGetLocalSize(shown, &n));
    PetscCall(VecGetArray(shown, &v));
    for (PetscInt i = d; i < n; i += 3) v[i] += output->sim->frame_velocity[d];
    PetscCall(VecRestoreArray(shown, &v));
  }
  PetscCall(DLMFieldFileBeginStep(output->fields, step, time));
  PetscCall(DLMFieldFileWriteVec(output->fields, "velocity_mesh", "velocity", velocity, shown));
  PetscCall(DMRestoreGlobalVector(velocity, &shown));
  PetscCall(DLMFieldFileWriteVec(output->fields, "pressure_mesh", "pressure", pressure, p));
  if (output->sim->polymer) PetscCall(WriteConformation(output, velocity));
  if (output->sim->spheres) PetscCall(WriteSpheres(output));
  PetscCall(DLMStokesRestoreParts(output->sim->stokes, x, &u, &p));
  PetscCall(DLMFieldFileEndStep(output->fields, &failed, path));
  PetscCall(DLMOutputRequire(output->sim, failed, path));
  PetscFunctionReturn(0);
}
