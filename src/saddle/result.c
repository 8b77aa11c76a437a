#include "../../include/private/saddleimpl.h"

/* slip[n_multipliers] <- Q^T (J u - V - omega x r) + epsilon lambda/viscosity. */
static PetscErrorCode Slip(DLMSaddle s, PetscReal viscosity, PetscScalar *slip)
{
  PetscScalar *rigid, *comply;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(s->layout.n_multipliers, &rigid));
  PetscCall(PetscCalloc1(s->layout.n_multipliers, &comply));
  PetscCall(DLMPairingInterpolate(s->pairing, s->fluid, s->at_points));
  PetscCall(DLMPairingProject(s->pairing, s->at_points, slip));
  PetscCall(DLMSaddleRigidMotion(s, s->lambda + s->layout.n_multipliers, rigid));
  PetscCall(DLMSaddleComply(s, s->lambda, comply));
  for (PetscInt i = 0; i < s->layout.n_multipliers; i++) slip[i] -= rigid[i] + comply[i] / viscosity;
  PetscCall(PetscFree(comply));
  PetscCall(PetscFree(rigid));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleGetSlip(DLMSaddle s, PetscReal *slip)
{
  PetscReal    sum[2] = { 0.0, (PetscReal)s->layout.n_multipliers / 3.0 };
  PetscScalar *values;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(s->layout.n_multipliers, &values));
  PetscCall(Slip(s, s->viscosity, values));
  for (PetscInt i = 0; i < s->layout.n_multipliers; i++) sum[0] += PetscSqr(values[i]);
  PetscCall(PetscFree(values));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPIU_SUM, s->scene->comm));
  *slip = sum[1] > 0.0 ? PetscSqrtReal(sum[0] / sum[1]) : 0.0;
  PetscFunctionReturn(0);
}

/*
  The energy that conjugate gradients reduce does not see a slip that is a rigid motion: the iterates of lambda are right, those of U lag behind and may
  even drift (B6). So U is read off at the end: it takes up the rigid part of the slip. With inertia or friction lambda follows, to keep the force balance.
*/
static PetscErrorCode ReadMotions(DLMSaddle s)
{
  const PetscInt n = s->layout.n_local, rigid = s->layout.n_multipliers;
  PetscScalar   *r, *z;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(n, &r, n, &z));
  PetscCall(Slip(s, 1.0, r));
  PetscCall(DLMBlocksApply(s->blocks, r, z));
  for (PetscInt i = rigid; i < n; i++) s->lambda[i] += z[i];
  if (s->inertia.weight > 0.0 || s->lubrication.n) {
    PetscCall(PetscArrayzero(r, n));
    PetscCall(DLMSaddleSubtractFriction(s, z + rigid, r + rigid));
    for (PetscInt k = 0; k < s->spheres->n_owned; k++) {
      PetscReal mass[6];
      DLMRigidMass(s->scene, s->spheres->owned[k], s->inertia.weight, mass);
      for (int c = 0; c < 6; c++) r[rigid + 6 * k + c] -= mass[c] * z[rigid + 6 * k + c];
    }
    PetscCall(DLMBlocksApply(s->blocks, r, z));
    for (PetscInt i = 0; i < n; i++) s->lambda[i] += z[i];
  }
  PetscCall(PetscFree2(r, z));
  PetscFunctionReturn(0);
}

/* u, p and the increments of lambda and U. */
static PetscErrorCode StoreSolution(DLMSaddle s)
{
  const PetscInt     n_u = s->stokes->n_u, n_p = s->stokes->n_p;
  const PetscScalar *x;
  PetscScalar       *fluid;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(s->x, &x));
  PetscCall(VecGetArray(s->fluid, &fluid));
  PetscCall(PetscArraycpy(fluid, x, n_u));
  for (PetscInt i = n_u; i < n_u + n_p; i++) fluid[i] = x[i] + (s->uzawa ? fluid[i] : 0.0);
  PetscCall(VecRestoreArray(s->fluid, &fluid));
  for (PetscInt i = 0; i < s->layout.n_local; i++) s->lambda[i] += x[n_u + n_p + i];
  PetscCall(VecRestoreArrayRead(s->x, &x));
  PetscFunctionReturn(0);
}

/* Velocities, and the force, torque and stresslet of the fluid on each owned sphere: minus the moments of lambda. */
PetscErrorCode DLMSaddleStoreResult(DLMSaddle s)
{
  PetscFunctionBeginUser;
  PetscCall(StoreSolution(s));
  PetscCall(ReadMotions(s));
  PetscCall(DLMSaddleScaleStress(s, s->viscosity));
  PetscCall(DLMPairingExpand(s->pairing, s->lambda, s->at_points));
  for (PetscInt k = 0; k < s->spheres->n_owned; k++) {
    const PetscInt   i     = s->spheres->owned[k];
    DLMSphereState  *state = &s->spheres->state[i];
    const PetscReal *U     = s->lambda + s->layout.rigid[i];
    PetscReal        load[6] = { 0.0 }, moment[3][3] = { { 0.0 } };
    for (PetscInt q = s->pairing->first[k]; q < s->pairing->first[k + 1]; q++) {
      const PetscReal *r = s->pairing->markers.r + 3 * q, *lambda = s->at_points + 3 * q;
      DLMRigidLoad(lambda, r, load);
      for (int a = 0; a < 3; a++)
        for (int b = 0; b < 3; b++) moment[a][b] += 0.5 * (r[a] * lambda[b] + r[b] * lambda[a]);
    }
    const PetscReal trace = (moment[0][0] + moment[1][1] + moment[2][2]) / 3.0;
    for (int c = 0; c < 3; c++) {
      if (!DLMRigidHeld(s->scene, i, c)) {
        state->velocity_before[c] = state->velocity[c];
        state->velocity[c]        = U[c];
      }
      if (!DLMRigidHeld(s->scene, i, c + 3)) {
        state->omega_before[c] = state->omega[c];
        state->omega[c]        = U[c + 3];
      }
      state->force[c]     = -load[c];
      state->torque[c]    = -load[c + 3];
      state->stresslet[c] = -(moment[c][c] - trace);
    }
    state->stresslet[3] = -moment[0][1];
    state->stresslet[4] = -moment[0][2];
    state->stresslet[5] = -moment[1][2];
  }
  PetscCall(DLMSpheresShare(s->spheres));
  DLMSaddleShareFriction(s);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleGetPointForces(DLMSaddle s, const PetscScalar **lambda)
{
  PetscFunctionBeginUser;
  PetscCall(DLMPairingExpand(s->pairing, s->lambda, s->at_points));
  *lambda = s->at_points;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleGetWallMoments(DLMSaddle s, int axis, DLMWallMoments *moments)
{
  const DLMMarkers *m;
  DLMGrid           grid;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(moments, sizeof(*moments)));
  if (!s->scene->n_spheres) PetscFunctionReturn(0);
  m    = &s->pairing->markers;
  grid = s->spheres->grid;
  PetscCall(DLMPairingExpand(s->pairing, s->lambda, s->at_points));
  for (PetscInt q = 0; q < m->n; q++) {
    PetscReal x = 0.0, walls = 0.0;
    for (PetscInt e = m->entry[q]; e < m->entry[q + 1]; e++) {
      const PetscInt node = m->node[3 * e + axis];
      x += m->weight[e] * (grid->lower[axis] + grid->h * node);
      if (node == 0 || node == grid->cells[axis]) walls += (node ? 0.5 : -0.5) * m->weight[e];
    }
    for (int c = 0; c < 3; c++) {
      moments->multipliers[c] += x * s->at_points[3 * q + c];
      moments->deltas[c] += walls * s->at_points[3 * q + c];
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, moments, sizeof(*moments) / sizeof(PetscReal), MPIU_REAL, MPI_SUM, s->scene->comm));
  DLMSaddleWallFriction(s, axis, moments);
  PetscFunctionReturn(0);
}
