/* Flows that the mesh holds exactly: Couette, Poiseuille, through-flow, uniform motion, and what fixes the mean of a periodic box. */
#include "dlmtest.h"

#define TIGHT "-stokes_fieldsplit_pressure_ksp_rtol 1e-14 -stokes_fieldsplit_pressure_ksp_max_it 200 "

static const PetscInt cells[3] = { 16, 8, 12 };

/* An exact flow: u_c = constant_c + slope_c x + curvature_c (x - lower) (x - upper) along one axis, p = -gradient . x */
typedef struct {
  const StokesCase *c;
  int         axis;
  double      constant[3], slope[3], curvature[3], pressure_slope[3];
} Flow;

static double FlowVelocity(const PetscInt i[3], int component, const void *context)
{
  const Flow  *f = context;
  const double length = f->c->scene.box_size[f->axis], x = i[f->axis] * f->c->scene.h;
  return f->constant[component] + f->slope[component] * (x - 0.5 * length) + f->curvature[component] * x * (x - length);
}

static double FlowPressure(const PetscInt i[3], int component, const void *context)
{
  const Flow *f   = context;
  double      sum = 0.0;
  for (int d = 0; d < 3; d++) sum += f->pressure_slope[d] * (2.0 * i[d] * f->c->scene.h - 0.5 * f->c->scene.box_size[d]);
  return sum;
}

/* Solves with the wall force alone and compares with the flow at the nodes. */
static void AssertFlow(const Flow *f)
{
  const StokesCase *c = f->c;
  Vec         b, x, exact, part[2][2];
  double      mean;

  Call(DLMStokesGetWallForce(c->stokes, &b));
  x = NewSolution(c, b);
  Call(VecDuplicate(x, &exact));
  Call(DLMStokesGetParts(c->stokes, x, &part[0][0], &part[0][1]));
  Call(DLMStokesGetParts(c->stokes, exact, &part[1][0], &part[1][1]));
  FillNodes(c->grid->velocity, FlowVelocity, f, part[1][0]);
  FillNodes(c->grid->pressure, FlowPressure, f, part[1][1]);
  for (int k = 0; k < 2; k++) {
    PetscInt n;
    Call(VecGetSize(part[k][1], &n));
    Call(VecSum(part[k][1], &mean));
    Call(VecShift(part[k][1], -mean / n));
  }
  for (int i = 0; i < 2; i++) {
    PetscReal error;
    Call(VecAXPY(part[0][i], -1.0, part[1][i]));
    Call(VecNorm(part[0][i], NORM_INFINITY, &error));
    AssertAtMost(error, 1e-11);
  }
  Call(DLMStokesRestoreParts(c->stokes, exact, &part[1][0], &part[1][1]));
  Call(DLMStokesRestoreParts(c->stokes, x, &part[0][0], &part[0][1]));
  Call(VecDestroy(&exact));
  Call(VecDestroy(&x));
}

/* One pair of walls, sheared in their plane with a flow through them, driven by a pressure gradient as well. */
static void CouettePoiseuilleAndThroughFlowAreExact(void **state)
{
  for (int axis = 0; axis < 3; axis++)
    for (int fallback = 0; fallback < 2; fallback++) {
      StokesCase c;
      Flow f = { .c = &c, .axis = axis };
      MakeScene(PETSC_COMM_WORLD, cells, 7u & ~(1u << axis), &c.scene);
      c.scene.stokes_block_limit = fallback ? 0.0 : 1024.0;
      for (int d = 0; d < 3; d++) {
        const double lower = 0.3 + d, upper = d == axis ? lower : -1.1 * d;
        c.scene.wall_velocity[axis][0][d] = lower;
        c.scene.wall_velocity[axis][1][d] = upper;
        c.scene.pressure_gradient[d]      = 2.0 - 1.5 * d;
        f.constant[d]                     = 0.5 * (lower + upper);
        f.slope[d]                        = (upper - lower) / c.scene.box_size[axis];
        if (d != axis) f.curvature[d] = c.scene.pressure_gradient[d] / (2.0 * c.scene.fluid_viscosity);
        else f.pressure_slope[d] = -c.scene.pressure_gradient[d]; /* a wall holds the fluid: p balances the force */
      }
      CreateStokes(TIGHT, &c);
      AssertFlow(&f);
      DestroyStokes(&c);
    }
}

/* All walls move alike, through their normals too: the whole fluid moves with them. Also on closed boxes and ducts. */
static void UniformFlowIsExactInEveryBox(void **state)
{
  for (unsigned periodic = 0; periodic < 7; periodic++) {
    StokesCase c;
    Flow f = { .c = &c, .constant = { 0.7, -0.4, 1.3 } };
    MakeScene(PETSC_COMM_WORLD, cells, periodic, &c.scene);
    for (int d = 0; d < 3; d++)
      for (int q = 0; q < 6 && !c.scene.box_periodic[d]; q++) c.scene.wall_velocity[d][q / 3][q % 3] = f.constant[q % 3];
    for (int d = 0; d < 3; d++) {
      if (c.scene.box_periodic[d]) continue;
      c.scene.pressure_gradient[d] = 1.0 + d;
      f.pressure_slope[d]          = -c.scene.pressure_gradient[d];
    }
    CreateStokes(TIGHT, &c);
    AssertFlow(&f);
    DestroyStokes(&c);
  }
}

/* Nothing holds the fluid of a fully periodic box: its mean velocity is zero, and a mean force goes into the pressure unseen. */
static void AFullyPeriodicBoxHasNoMeanFlow(void **state)
{
  const PetscReal limits[2] = { 1024.0, 0.0 };

  for (int i = 0; i < 2; i++) {
    StokesCase      c;
    Vec       b, x, y, u;
    PetscReal mean[3], largest;
    MakeScene(PETSC_COMM_WORLD, cells, 7, &c.scene);
    c.scene.stokes_block_limit = limits[i];
    for (int d = 0; d < 3; d++) c.scene.pressure_gradient[d] = 3.0 - d;
    CreateStokes(TIGHT, &c);
    b = NewRightHandSide(&c);
    x = NewSolution(&c, b);
    Call(DLMStokesGetWallForce(c.stokes, &y));
    Call(VecNorm(y, NORM_INFINITY, &largest));
    AssertAll(largest > 0.0);
    Call(VecAXPY(b, 1.0, y)); /* a uniform force on every node */
    y = NewSolution(&c, b);
    AssertAtMost(SolutionDifference(&c, x, y), 1e-11);
    Call(DLMStokesGetParts(c.stokes, y, &u, NULL));
    Call(VecSetBlockSize(u, 3));
    Call(VecStrideSumAll(u, mean));
    Call(VecNorm(u, NORM_1, &largest));
    for (int d = 0; d < 3; d++) AssertAtMost(fabs(mean[d]) / largest, 1e-13);
    Call(DLMStokesRestoreParts(c.stokes, y, &u, NULL));
    Call(VecDestroy(&x));
    Call(VecDestroy(&y));
    Call(VecDestroy(&b));
    DestroyStokes(&c);
  }
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(CouettePoiseuilleAndThroughFlowAreExact),
  cmocka_unit_test(UniformFlowIsExactInEveryBox),
  cmocka_unit_test(AFullyPeriodicBoxHasNoMeanFlow),
};

RUN_ON_ALL_RANKS(tests)
