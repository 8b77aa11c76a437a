/*
  The advection of C by a steady velocity against its exact solution: C is carried along the characteristics, which are followed backwards to rounding
  of their own. Order 2 is measured on three meshes; walls let C out without reflection and in as I.
*/
#include "polymertest.h"

static const double pi = 3.14159265358979323846;

/* A box of edges 1 in n^3 cells. */
static void MakeUnitBox(PetscInt n, unsigned periodic, DLMPolymerForm form, PetscReal courant, PolymerCase *c)
{
  MakePolymerScene(PETSC_COMM_WORLD, (PetscInt[3]){ n, n, n }, periodic, c);
  c->scene.grid_resolution = (PetscReal)n;
  c->scene.h               = 1.0 / n;
  c->scene.polymer_form    = form;
  c->scene.polymer_courant = courant;
  for (int d = 0; d < 3; d++) c->scene.box_size[d] = 1.0;
}

/* A smooth C = A A^T of period 1: its diagonal varies by a factor of 3. */
static double SmoothStart(const double x[3], int component, const void *context)
{
  static const int first[6] = { 0, 1, 2, 0, 0, 1 }, second[6] = { 0, 1, 2, 1, 2, 2 };
  const double     s[3] = { sin(2 * pi * x[0] + 0.3), sin(2 * pi * x[1] - 0.5), sin(2 * pi * x[2] + 1.1) };
  const double     a[3][3] = { { 1.2 + 0.3 * s[0] * s[1], 0.0, 0.0 }, { 0.4 * s[2], 1.0 + 0.2 * s[0], 0.0 }, { 0.3 * s[1], 0.2 * s[0] * s[2], 0.9 - 0.2 * s[2] } };
  double           sum = 0.0;

  for (int k = 0; k < 3; k++) sum += a[first[component]][k] * a[second[component]][k];
  return sum;
}

/* Solenoidal velocities of at most order one: u[3] at x. */
typedef void (*Flow)(const double x[3], double u[3]);

/* Arnold, Beltrami and Childress: fully periodic. */
static void PeriodicFlow(const double x[3], double u[3])
{
  for (int d = 0; d < 3; d++) u[d] = 0.4 * sin(2 * pi * x[(d + 2) % 3]) + 0.3 * cos(2 * pi * x[(d + 1) % 3]);
}

/* Cells in the plane 13 and a shear along x2, tangential at walls x3 = -1/2 and 1/2. */
static void SlitFlow(const double x[3], double u[3])
{
  u[0] = -0.5 * sin(pi * x[2]) * cos(2 * pi * x[0]) + 0.2 * x[2];
  u[1] = 0.3 * sin(2 * pi * x[0]) + 0.5 * x[2];
  u[2] = cos(pi * x[2]) * sin(2 * pi * x[0]); /* at walls not quite zero: rounding must not let anything in */
}

/* The same in a box of six walls, with one cell in the plane 13. */
static void ClosedFlow(const double x[3], double u[3])
{
  u[0] = -0.7 * sin(pi * x[2]) * cos(pi * x[0]);
  u[1] = 0.0;
  u[2] = 0.7 * cos(pi * x[2]) * sin(pi * x[0]);
}

static double FlowValue(const double x[3], int component, const void *context)
{
  double u[3];

  (*(const Flow *)context)(x, u);
  return u[component];
}

typedef struct {
  Flow   flow;
  double time;
} Carried;

/* y <- where the fluid at x was before, by 16 steps of Runge and Kutta's fourth-order method: 1e-6 here. */
static void FollowBack(const Carried *carried, const double x[3], double y[3])
{
  const double dt = -carried->time / 16, part[4] = { 0.0, 0.5, 0.5, 1.0 }, weight[4] = { 1.0, 2.0, 2.0, 1.0 };

  memcpy(y, x, 3 * sizeof(double));
  for (int step = 0; step < 16; step++) {
    double k[3] = { 0.0 }, sum[3] = { 0.0 };
    for (int stage = 0; stage < 4; stage++) {
      const double at[3] = { y[0] + part[stage] * dt * k[0], y[1] + part[stage] * dt * k[1], y[2] + part[stage] * dt * k[2] };
      carried->flow(at, k);
      for (int d = 0; d < 3; d++) sum[d] += weight[stage] / 6.0 * k[d];
    }
    for (int d = 0; d < 3; d++) y[d] += dt * sum[d];
  }
}

/* The components of a node follow each other: its characteristic is followed once. */
static double CarriedValue(const double x[3], int component, const void *context)
{
  static double origin[3];

  if (component == 0) FollowBack(context, x, origin);
  return SmoothStart(origin, component, NULL);
}

/* Root mean square error of C at t = 1/4 on n cells per edge, n/2 steps: courant number near 0.5. */
static double AdvectionError(PetscInt n, unsigned periodic, DLMMirror mirror, Flow flow, DLMPolymerForm form, PetscReal courant, PetscInt *substeps)
{
  const Carried    exact = { flow, 0.25 };
  const PetscInt   steps = n / 2;
  DLMPolymerHealth health;
  PolymerCase      c;
  PetscReal        size, error;
  Vec              found, expected;

  MakeUnitBox(n, periodic, form, courant, &c);
  c.scene.box_mirror = mirror;
  OpenPolymer(&c);
  SetConformation(&c, SmoothStart, NULL);
  SetPointVelocity(&c, FlowValue, &exact.flow);
  for (PetscInt step = 0; step < steps; step++) Call(DLMPolymerAdvect(c.polymer, exact.time / steps));
  Call(DLMPolymerGetHealth(c.polymer, &health));
  AssertAll(health.sound && health.courant < 1.0);
  *substeps = health.substeps;
  found     = NewConformation(&c);
  expected  = NewPointField(&c, c.six, CarriedValue, &exact);
  Call(VecNorm(expected, NORM_2, &size));
  Call(VecAXPY(found, -1.0, expected));
  Call(VecNorm(found, NORM_2, &error));
  Call(VecDestroy(&found));
  Call(VecDestroy(&expected));
  ClosePolymer(&c);
  return error / size;
}

static void AdvectionIsOfSecondOrder(void **state)
{
  static const struct {
    const char *name;
    unsigned    periodic;
    DLMMirror   mirror; /* of the mesh: where its cut turns round, faces do not match */
    Flow        flow;
  } flows[] = { { "periodic", 7, DLM_MIRROR_NONE, PeriodicFlow }, { "symmetric", 7, DLM_MIRROR_WHOLE, PeriodicFlow }, { "slit", 3, DLM_MIRROR_NONE, SlitFlow }, { "closed", 0, DLM_MIRROR_NONE, ClosedFlow } };
  static const PetscInt meshes[3] = { 16, 24, 32 };

  for (int f = 0; f < 4; f++)
    for (int form = 0; form < 2; form++)
      for (int many = 0; many < 2; many++) {
        double   error[3];
        PetscInt substeps;
        for (int m = 0; m < 3; m++) error[m] = AdvectionError(meshes[m], flows[f].periodic, flows[f].mirror, flows[f].flow, form ? DLM_FORM_LOG : DLM_FORM_FACTOR, many ? 0.15 : 1.0, &substeps);
        print_message("%-9s %-6s Q = %d: errors %.3e %.3e %.3e, orders %.2f %.2f\n", flows[f].name, form ? "log" : "factor", (int)substeps, error[0], error[1],
                      error[2], log(error[0] / error[1]) / log(1.5), log(error[1] / error[2]) / log(4.0 / 3.0));
        assert_true(many ? substeps > 2 : substeps == 1);
        assert_true(error[2] < 0.05);
        assert_true(log(error[1] / error[2]) / log(4.0 / 3.0) >= 1.9);
      }
}

static double ConstantConformation(const double x[3], int component, const void *context)
{
  static const double value[6] = { 3.0, 1.5, 0.7, 0.8, -0.6, 0.2 };
  return value[component];
}

/* Velocities that need not be smooth: random, zero on the walls. */
static void AUniformConformationStays(void **state)
{
  PetscInt processes[3];

  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (int k = 0; Layout(k, processes); k++)
      for (int form = 0; form < 2; form++)
        for (int many = 0; many < 2; many++) {
          PolymerCase c;
          Vec         u, before, after;
          MakePolymerScene(PETSC_COMM_WORLD, (PetscInt[3]){ 16, 20, 18 }, periodic, &c);
          for (int d = 0; d < 3; d++) c.scene.grid_processes[d] = processes[d];
          c.scene.polymer_form    = form ? DLM_FORM_LOG : DLM_FORM_FACTOR;
          c.scene.polymer_courant = many ? 0.05 : 1.0;
          OpenPolymer(&c);
          SetConformation(&c, ConstantConformation, NULL);
          before = NewConformation(&c);
          Call(DMCreateGlobalVector(c.grid->velocity, &u));
          FillRandom(c.grid, c.grid->velocity, 8, 1, u);
          Call(DLMPolymerSetVelocity(c.polymer, 0.0, u));
          for (int step = 0; step < 3; step++) Call(DLMPolymerAdvect(c.polymer, 0.02));
          after = NewConformation(&c);
          AssertAtMost(FieldDifference(c.six, after, c.six, before), 2e-14);
          for (Vec *v = (Vec[]){ u, before, after, NULL }; *v; v++) Call(VecDestroy(v));
          ClosePolymer(&c);
        }
}

/* Along one axis between two walls: a wave of C on its way out, or a C that the entering fluid pushes out. */
typedef struct {
  int axis, sign;
} Wind;

static double WindValue(const double x[3], int component, const void *context)
{
  const Wind *w = context;
  return component == w->axis ? w->sign : 0.0;
}

/* A box of n cells of h along the axis of the wind, four along the others, which are periodic. */
static void MakeTunnel(PetscInt n, double h, const Wind *w, PolymerCase *c)
{
  MakePolymerScene(PETSC_COMM_WORLD, (PetscInt[3]){ 4, 4, 4 }, 7u & ~(1u << w->axis), c);
  c->scene.cells[w->axis] = n;
  c->scene.h              = h;
  for (int d = 0; d < 3; d++) c->scene.box_size[d] = c->scene.cells[d] * h;
  for (int side = 0; side < 2; side++) c->scene.wall_velocity[w->axis][side][w->axis] = w->sign;
}

/* I plus a bump of width 0.1, half-way. */
static double BumpValue(const double x[3], int component, const void *context)
{
  const Wind  *w = context;
  const double r = x[w->axis] / 0.1, bump = exp(-r * r);
  return component < 3 ? 1.0 + (component + 1) * bump : 0.4 * bump;
}

/* Courant number of an interval of advection, and the bound of its sub-steps. */
typedef struct {
  double interval, bound;
} Pace;

/* Largest |C - I| when the bump and its tail should be far out of the box of n cells; the highest trace meanwhile. */
static double LeftOver(PetscInt n, const Wind *w, DLMPolymerForm form, const Pace *pace, double *highest)
{
  const double     end   = 1.1;
  const PetscInt   steps = (PetscInt)(end * n / pace->interval);
  PolymerCase      c;
  DLMPolymerHealth health;
  PetscReal        left;
  Vec              C, unit;

  MakeTunnel(n, 1.0 / n, w, &c);
  c.scene.polymer_form    = form;
  c.scene.polymer_courant = pace->bound;
  OpenPolymer(&c);
  unit = NewConformation(&c);
  SetConformation(&c, BumpValue, w);
  SetPointVelocity(&c, WindValue, w);
  *highest = 0.0;
  for (PetscInt step = 0; step < steps; step++) {
    Call(DLMPolymerAdvect(c.polymer, end / steps));
    Call(DLMPolymerGetHealth(c.polymer, &health));
    AssertAll(health.sound);
    *highest = fmax(*highest, health.largest_trace);
  }
  C = NewConformation(&c);
  Call(VecAXPY(C, -1.0, unit));
  Call(VecNorm(C, NORM_INFINITY, &left));
  Call(VecDestroy(&C));
  Call(VecDestroy(&unit));
  ClosePolymer(&c);
  return left;
}

/* The trace starts at 9 at most; a reflection would raise it at the wall and stay behind. */
static void WallsLetConformationOut(void **state)
{
  static const Pace paces[] = { { 0.5, 1.0 }, { 0.5, 0.1 }, { 6.0, 0.6 } };

  for (int axis = 0; axis < 3; axis++)
    for (int form = 0; form < 2; form++)
      for (int k = 0; k < 3; k++) {
        const Wind wind = { axis, (axis + form + k) % 2 ? 1 : -1 };
        double     left[2], highest[2];
        for (int m = 0; m < 2; m++) left[m] = LeftOver(m ? 64 : 32, &wind, form ? DLM_FORM_LOG : DLM_FORM_FACTOR, &paces[k], &highest[m]);
        print_message("axis %d, %+d, %-6s courant %.1f in sub-steps of %.1f: left over %.1e, %.1e; highest trace %.3f, %.3f\n", axis + 1, wind.sign,
                      form ? "log" : "factor", paces[k].interval, paces[k].bound, left[0], left[1], highest[0], highest[1]);
        assert_true(highest[0] < 9.05 && highest[1] < 9.05);
        assert_true(left[0] < 0.04 && left[1] < 0.2 * left[0]);
      }
}

/* A uniform C other than I leaves; behind it the fluid that came in has C = I. */
static void WallsLetTheUnitTensorIn(void **state)
{
  for (int axis = 0; axis < 3; axis++)
    for (int sign = -1; sign <= 1; sign += 2) {
      const Wind     wind = { axis, sign };
      PolymerCase    c;
      PetscInt       n;
      double        *x, behind = 0.0, ahead = 0.0;
      Vec            C;
      MakeTunnel(64, 0.125, &wind, &c);
      OpenPolymer(&c);
      SetConformation(&c, ConstantConformation, NULL);
      SetPointVelocity(&c, WindValue, &wind);
      for (int step = 0; step < 64; step++) Call(DLMPolymerAdvect(c.polymer, 4.0 / 64));
      C = NewConformation(&c);
      GatherNatural(c.six, C, &n, &x);
      for (PetscInt i = 0; i < n / 6; i++) {
        const PetscInt *nodes = c.grid->nodes, at[3] = { i % nodes[0], (i / nodes[0]) % nodes[1], i / (nodes[0] * nodes[1]) };
        const double    z = wind.sign * (c.grid->lower[axis] + c.grid->h * at[axis]); /* the front is at 0 */
        for (int k = 0; k < 6; k++) {
          if (z < -3.0) behind = fmax(behind, fabs(x[6 * i + k] - (k < 3)));
          if (z > 1.0) ahead = fmax(ahead, fabs(x[6 * i + k] - ConstantConformation(NULL, k, NULL)));
        }
      }
      print_message("axis %d, %+d: %.1e from I behind the front, %.1e from the old C ahead of it\n", axis + 1, sign, behind, ahead);
      assert_true(behind < 0.02 && ahead < 0.02);
      Call(PetscFree(x));
      Call(VecDestroy(&C));
      ClosePolymer(&c);
    }
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(AdvectionIsOfSecondOrder),
  cmocka_unit_test(AUniformConformationStays),
  cmocka_unit_test(WallsLetConformationOut),
  cmocka_unit_test(WallsLetTheUnitTensorIn),
};

RUN_ON_ALL_RANKS(tests)
