/* Means of the extra stress: over the box, against its force and its value at the walls; within the spheres. */
#include "polymertest.h"

static const PetscInt cells[3] = { 16, 12, 18 }; /* a box of 2 x 1.5 x 2.25 */

/* Entry of a tensor 11, 22, 33, 12, 13, 23. */
static int Entry(int i, int j)
{
  return i == j ? i : i + j + 2;
}

/* Sums over all nodes of the force times the coordinate across the gap, and of C over the two layers of cells at the walls. */
static void SumByHand(PolymerCase *c, Vec f, int axis, double moment[3], double walls[6])
{
  Vec            nodes = NewConformation(c);
  const PetscInt count[3] = { c->grid->nodes[0], c->grid->nodes[1], c->grid->nodes[2] }, last = c->grid->cells[axis];
  PetscInt       n;
  double        *C, *force;

  GatherNatural(c->six, nodes, &n, &C);
  GatherNatural(c->grid->velocity, f, &n, &force);
  for (PetscInt i = 0; i < n / 3; i++) {
    const PetscInt at[3] = { i % count[0], i / count[0] % count[1], i / count[0] / count[1] }, plane = at[axis];
    const double   x = c->grid->lower[axis] + c->grid->h * plane;
    for (int k = 0; k < 3; k++) moment[k] += force[3 * i + k] * x;
    if (plane <= 1 || plane >= last - 1)
      for (int k = 0; k < 6; k++) walls[k] += 0.25 * C[6 * i + k] / (count[(axis + 1) % 3] * count[(axis + 2) % 3]);
  }
  Call(PetscFree(C));
  Call(PetscFree(force));
  Call(VecDestroy(&nodes));
}

/* sum f_i x_g = V (stress_ig at the walls - its mean over the box), to rounding: what a wall feels follows from the mean stress and its force. */
static void TheForceTellsTheWallsFromTheMean(void **state)
{
  for (int axis = 0; axis < 3; axis++) {
    PolymerCase      c;
    DLMPolymerStress stress;
    double           moment[3] = { 0.0 }, walls[6] = { 0.0 }, volume = 1.0;
    Vec              f;
    MakePolymerScene(PETSC_COMM_WORLD, cells, 7u & ~(1u << axis), &c);
    c.scene.polymer_coupling = DLM_COUPLING_EXPLICIT;
    OpenPolymer(&c);
    SetRandomConformation(&c, 3);
    Call(DMCreateGlobalVector(c.grid->velocity, &f));
    Call(DLMPolymerForce(c.polymer, 0.0, 0.0, 1, f));
    Call(DLMPolymerGetStress(c.polymer, &stress));
    SumByHand(&c, f, axis, moment, walls);
    const double elastic = c.scene.fluid_viscosity * (1.0 - 0.1 / 0.8) / 0.8;
    for (int d = 0; d < 3; d++) volume *= c.scene.box_size[d];
    for (int k = 0; k < 3; k++) {
      const double wall = elastic * (walls[Entry(k, axis)] - (k == axis));
      AssertNear(moment[k] / volume, wall - stress.box[Entry(k, axis)], 1e-12 * elastic);
      AssertAll(fabs(wall - stress.box[Entry(k, axis)]) > 1e-6 * elastic);
    }
    Call(VecDestroy(&f));
    ClosePolymer(&c);
  }
}

static double Uniform(const double x[3], int component, const void *context)
{
  return component + 2.0;
}

/*
  A uniform stress has itself for its mean; within a sphere its volume for a factor, at a wall and across a periodic face too; nothing under an offset. The
  ramp at the surface makes the volume too large by (h/a)^2/4, 4 %.
*/
static void AUniformStressHasItsMeans(void **state)
{
  for (int offset = 0; offset < 2; offset++) {
    PolymerCase      c;
    DLMPolymerStress stress;
    const PetscReal *inside;
    Vec              f;
    MakePolymerScene(PETSC_COMM_WORLD, cells, 3u, &c);
    c.scene.polymer_coupling      = DLM_COUPLING_EXPLICIT;
    c.scene.polymer_stress_offset = offset ? 0.75 : 0.0;
    c.scene.n_spheres             = 3;
    for (int i = 0; i < 3; i++) c.spec[i] = (DLMSphereSpec){ .radius = 0.3, .density = 1.0, .center = { 0.98 - 0.6 * i, 0.7 - 0.2 * i, i ? 0.05 : 1.125 - 0.31 } };
    OpenPolymer(&c);
    SetConformation(&c, Uniform, NULL);
    Call(DMCreateGlobalVector(c.grid->velocity, &f));
    Call(DLMPolymerForce(c.polymer, 0.0, 0.0, 1, f));
    Call(DLMPolymerGetStress(c.polymer, &stress));
    Call(DLMPolymerGetInsideStress(c.polymer, &inside));
    const double elastic = c.scene.fluid_viscosity * (1.0 - 0.1 / 0.8) / 0.8, sphere = 4.0 / 3.0 * PETSC_PI * 0.027;
    for (int k = 0; k < 6; k++) {
      const double value = elastic * (k + 2.0 - (k < 3));
      if (!offset) AssertNear(stress.box[k], value, 1e-12 * value);
      for (int i = 0; i < 3; i++) AssertNear(inside[6 * i + k], offset ? 0.0 : value * sphere, 0.06 * value * sphere);
    }
    Call(VecDestroy(&f));
    ClosePolymer(&c);
  }
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(TheForceTellsTheWallsFromTheMean),
  cmocka_unit_test(AUniformStressHasItsMeans),
};

RUN_ON_ALL_RANKS(tests)
