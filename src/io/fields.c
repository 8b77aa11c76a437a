#include "../../include/private/gridimpl.h"
#include "../../include/private/outputimpl.h"

/* Closed periodic axes have the first plane again. */
static PetscReal NodesOf(const DLMScene *scene, PetscInt coarsening)
{
  return (PetscReal)(scene->cells[0] / coarsening + 1) * (PetscReal)(scene->cells[1] / coarsening + 1) * (PetscReal)(scene->cells[2] / coarsening + 1);
}

PetscErrorCode DLMFieldsGetBytes(DLMSimulation sim, PetscReal *bytes)
{
  const DLMScene *scene  = sim->whole;
  PetscInt        points = 0;

  PetscFunctionBegin;
  if (sim->spheres && scene->output_multipliers) PetscCall(DLMPairingGetPoints(sim->pairing, &points, NULL, NULL));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &points, 1, MPIU_INT, MPI_SUM, scene->comm));
  *bytes = 8.0 * (NodesOf(scene, 1) * (sim->polymer ? 10.0 : 3.0) + NodesOf(scene, 2)) + (4.0 + 8.0 * 10.0) * (PetscReal)scene->n_spheres +
           (8.0 + 8.0 * 9.0) * (PetscReal)points * PetscMax(1, scene->n_spheres) / PetscMax(1, sim->scene->n_spheres);
  PetscFunctionReturn(0);
}

/*
  Fields are drawn where the mesh is: in the frame that rides with the mean wall velocity. Velocities are those of the scene's frame.
*/
PetscErrorCode DLMFieldsOpen(DLMOutput output)
{
  DLMGrid         grid = output->sim->grid;
  const PetscReal fine[3] = { grid->h, grid->h, grid->h }, coarse[3] = { 2.0 * grid->h, 2.0 * grid->h, 2.0 * grid->h };
  const DLMScene *scene = output->sim->scene;
  PetscReal       lower[3];
  PetscInt        nodes[3];

  PetscFunctionBegin;
  PetscCall(DLMFieldFileCreate(grid->comm, output->sim->scene->output_dir, output->sim->first_step, &output->fields));
  for (int d = 0; d < 3; d++) {
    lower[d] = -0.5 * scene->box_size[d];
    nodes[d] = scene->cells[d] + !scene->box_periodic[d];
  }
  PetscCall(DLMFieldFileAddMesh(output->fields, "velocity_mesh", nodes, lower, fine, grid->periodic));
  for (int d = 0; d < 3; d++) nodes[d] = scene->cells[d] / 2 + !scene->box_periodic[d];
  PetscCall(DLMFieldFileAddMesh(output->fields, "pressure_mesh", nodes, lower, coarse, grid->periodic));
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
  const DLMPointArray arrays[] = { { "center", 3, x }, { "radius", 1, radius }, { "velocity", 3, V }, { "omega", 3, omega } };
  PetscCall(DLMFieldFileWritePoints(output->fields, "spheres", n, 4, arrays));
  PetscCall(PetscFree4(x, radius, V, omega));
  PetscFunctionReturn(0);
}

/* C in VTK's order, 11, 22, 33, 12, 23, 13, from planar components 11, 22, 33, 12, 13, 23; and its trace. */
static PetscErrorCode WriteConformation(DLMOutput output, DM velocity)
{
  static const int       order[6] = { 0, 1, 2, 3, 5, 4 };
  static const PetscReal signs[6] = { 1.0, 1.0, 1.0, -1.0, -1.0, 1.0 };
  const DLMGrid      grid = output->sim->grid;
  const PetscScalar *planar;
  PetscScalar       *x, *t;
  PetscInt           n;
  DM                 six, one;
  Vec                C, shown, trace;

  PetscFunctionBegin;
  PetscCall(DLMPolymerGetConformation(output->sim->polymer, &C));
  PetscCall(DMDACreateCompatibleDMDA(velocity, 6, &six));
  PetscCall(DMDACreateCompatibleDMDA(velocity, 1, &one));
  PetscCall(DMCreateGlobalVector(six, &shown));
  PetscCall(DMCreateGlobalVector(one, &trace));
  PetscCall(VecGetLocalSize(trace, &n));
  PetscCall(VecGetArrayRead(C, &planar));
  PetscCall(VecGetArray(shown, &x));
  PetscCall(VecGetArray(trace, &t));
  for (PetscInt i = 0; i < n; i++) {
    for (int k = 0; k < 6; k++) x[6 * i + k] = planar[order[k] * n + i];
    t[i] = planar[i] + planar[n + i] + planar[2 * n + i];
  }
  PetscCall(VecRestoreArray(trace, &t));
  PetscCall(VecRestoreArray(shown, &x));
  PetscCall(VecRestoreArrayRead(C, &planar));
  PetscCall(DLMFieldFileWriteVec(output->fields, "velocity_mesh", "conformation", six, DLMGridSign(grid, signs), shown));
  PetscCall(DLMFieldFileWriteVec(output->fields, "velocity_mesh", "conformation_trace", one, DLMGridSign(grid, DLMMirrorScalar), trace));
  PetscCall(VecDestroy(&shown));
  PetscCall(VecDestroy(&trace));
  PetscCall(DMDestroy(&six));
  PetscCall(DMDestroy(&one));
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
  PetscCall(DLMFieldFileWriteVec(output->fields, "velocity_mesh", "velocity", velocity, DLMGridSign(output->sim->grid, DLMMirrorVector), shown));
  PetscCall(DMRestoreGlobalVector(velocity, &shown));
  PetscCall(DLMFieldFileWriteVec(output->fields, "pressure_mesh", "pressure", pressure, DLMGridSign(output->sim->grid, DLMMirrorScalar), p));
  if (output->sim->polymer) PetscCall(WriteConformation(output, velocity));
  if (output->sim->spheres) PetscCall(WriteSpheres(output));
  if (output->sim->spheres && output->sim->scene->output_multipliers) PetscCall(DLMMultipliersWrite(output->sim, output->fields));
  PetscCall(DLMStokesRestoreParts(output->sim->stokes, x, &u, &p));
  PetscCall(DLMFieldFileEndStep(output->fields, &failed, path));
  PetscCall(DLMOutputRequire(output->sim, failed, path));
  PetscFunctionReturn(0);
}
