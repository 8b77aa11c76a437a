/* Friction across narrow gaps (docs/theory.md, L5 and L6): the part Z of the rigid motions' equations. */
#include "../../include/private/saddleimpl.h"

static void Motion(const DLMSphereState *state, PetscReal U[6])
{
  for (int c = 0; c < 3; c++) {
    U[c]     = state->velocity[c];
    U[3 + c] = state->omega[c];
  }
}

PetscErrorCode DLMSaddleSubtractFriction(DLMSaddle s, const PetscScalar *U, PetscScalar *load)
{
  const PetscInt n = s->scene->n_spheres;
  PetscReal     *all, *total;

  PetscFunctionBegin;
  if (!s->lubrication.n) PetscFunctionReturn(0);
  PetscCall(PetscCalloc2(6 * n, &all, 6 * n, &total));
  for (PetscInt k = 0; k < s->spheres->n_owned; k++)
    for (int c = 0; c < 6; c++)
      if (!DLMRigidHeld(s->scene, s->spheres->owned[k], c)) all[6 * s->spheres->owned[k] + c] = U[6 * k + c];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, all, (PetscMPIInt)(6 * n), MPIU_REAL, MPI_SUM, s->scene->comm));
  for (PetscInt g = 0; g < s->lubrication.n; g++) {
    DLMGap         gap = s->lubrication.gaps[g];
    const PetscInt j   = PetscMax(gap.j, 0);
    for (int c = 0; c < 3; c++) gap.wall[c] = 0.0;
    DLMGapAddLoads(&gap, all + 6 * gap.i, all + 6 * j, total + 6 * gap.i, total + 6 * j);
  }
  for (PetscInt k = 0; k < s->spheres->n_owned; k++)
    for (int c = 0; c < 6; c++)
      if (!DLMRigidHeld(s->scene, s->spheres->owned[k], c)) load[6 * k + c] += total[6 * s->spheres->owned[k] + c];
  PetscCall(PetscFree2(all, total));
  PetscFunctionReturn(0);
}

/* Adds the loads on i and j of a gap (load_j: not looked at against a wall) by the motions in the states, in units of the viscosity ratio. */
static void GapLoads(DLMSaddle s, const DLMGap *gap, PetscReal *load_i, PetscReal *load_j)
{
  PetscReal Ui[6], Uj[6] = { 0.0 };

  Motion(&s->spheres->state[gap->i], Ui);
  if (gap->j >= 0) Motion(&s->spheres->state[gap->j], Uj);
  DLMGapAddLoads(gap, Ui, Uj, load_i, load_j);
}

void DLMSaddleAddFriction(DLMSaddle s, PetscReal *load)
{
  for (PetscInt g = 0; g < s->lubrication.n; g++) {
    const DLMGap *gap = &s->lubrication.gaps[g];
    GapLoads(s, gap, load + 6 * gap->i, load + 6 * PetscMax(gap->j, 0));
  }
}

static void Cross(const PetscReal x[3], const PetscReal y[3], PetscReal z[3])
{
  for (int c = 0; c < 3; c++) z[c] = x[(c + 1) % 3] * y[(c + 2) % 3] - x[(c + 2) % 3] * y[(c + 1) % 3];
}

/*
  The force acts at the gap, arm e from the centre. What its torque does not explain is a couple m of forces along e beside that point, so the first moment of
  the traction is arm e f + (e x m) e (L3).
*/
static void AddToState(const PetscReal load[6], PetscReal arm, const PetscReal e[3], DLMSphereState *state)
{
  static const int a[6] = { 0, 1, 2, 0, 0, 1 }, b[6] = { 0, 1, 2, 1, 2, 2 };
  const PetscReal  third = arm * (e[0] * load[0] + e[1] * load[1] + e[2] * load[2]) / 3.0;
  PetscReal        couple[3], beside[3];

  Cross(e, load, couple);
  for (int c = 0; c < 3; c++) couple[c] = load[3 + c] - arm * couple[c];
  Cross(e, couple, beside);
  for (int c = 0; c < 3; c++) {
    state->force[c] += load[c];
    state->torque[c] += load[3 + c];
    state->stresslet[c] -= third;
  }
  for (int k = 0; k < 6; k++)
    state->stresslet[k] += 0.5 * (arm * (e[a[k]] * load[b[k]] + e[b[k]] * load[a[k]]) + beside[a[k]] * e[b[k]] + beside[b[k]] * e[a[k]]);
}

void DLMSaddleShareFriction(DLMSaddle s)
{
  for (PetscInt g = 0; g < s->lubrication.n; g++) {
    const DLMGap *gap = &s->lubrication.gaps[g];
    PetscReal     load[12] = { 0.0 };
    GapLoads(s, gap, load, load + 6);
    for (int c = 0; c < 12; c++) load[c] *= s->viscosity;
    AddToState(load, gap->arm[0], gap->e, &s->spheres->state[gap->i]);
    if (gap->j >= 0) AddToState(load + 6, -gap->arm[1], gap->e, &s->spheres->state[gap->j]);
  }
}

void DLMSaddleWallFriction(DLMSaddle s, int axis, DLMWallMoments *moments)
{
  DLMGrid grid = s->spheres->grid;

  for (PetscInt g = 0; g < s->lubrication.n; g++) {
    const DLMGap   *gap  = &s->lubrication.gaps[g];
    const PetscReal wall = grid->lower[axis] + (gap->e[axis] > 0.0 ? grid->cells[axis] * grid->h : 0.0);
    PetscReal       load[6] = { 0.0 };
    if (gap->j >= 0 || gap->e[axis] == 0.0) continue;
    GapLoads(s, gap, load, NULL);
    for (int c = 0; c < 3; c++) {
      moments->friction[c] += wall * s->viscosity * load[c];
      moments->widths[c] += gap->e[axis] * gap->width * s->viscosity * load[c];
    }
  }
}
