/*
  The conformation tensor as a parallel object: stress and gradient are discrete adjoints, the gradient of a linear velocity is exact, and any number
  of ranks gives the same C. Its advection: test_advection.c; its pointwise kernels: test_tensor.c and test_stretch.c.
*/
#include "polymertest.h"

static const PetscInt cells[3] = { 16, 20, 18 }; /* uneven on 2, 3 and 4 ranks; a box of 2 x 2.5 x 2.25 */

static void OpenLayout(MPI_Comm comm, unsigned periodic, const PetscInt *processes, PolymerCase *c)
{
  MakePolymerScene(comm, cells, periodic, c);
  for (int d = 0; d < 3 && processes; d++) c->scene.grid_processes[d] = processes[d];
}

/* Three spheres: one across the first periodic face, one that all but touches the first wall, one in the middle. */
static void AddSpheres(PolymerCase *c)
{
  c->scene.n_spheres = 3;
  for (int i = 0; i < 3; i++) c->spec[i] = (DLMSphereSpec){ .radius = 0.3, .density = 1.0, .center = { 0.013 * i, 0.021, -0.017 } };
  for (int d = 2; d >= 0; d--) {
    const double half = 0.5 * c->scene.box_size[d];
    c->spec[0].center[d] = c->scene.box_periodic[d] ? -half + 0.07 : 0.25;
    c->spec[1].center[d] = c->scene.box_periodic[d] ? -0.41 : half - 0.3 - 1e-3;
  }
}

static Vec NewRandomVelocity(PolymerCase *c, unsigned seed)
{
  Vec u;

  Call(DMCreateGlobalVector(c->grid->velocity, &u));
  FillRandom(c->grid, c->grid->velocity, seed, 1, u);
  return u;
}

/* |stress work - stretching| of a random velocity, relative; the viscosities are those of another one. */
static double Imbalance(PolymerCase *c)
{
  Vec       u = NewRandomVelocity(c, 5), before = NewRandomVelocity(c, 6);
  PetscReal work, stretching;

  Call(DLMPolymerSetVelocity(c->polymer, 0.0, before));
  Call(DLMPolymerGetWork(c->polymer, u, &work, &stretching));
  Call(VecDestroy(&u));
  Call(VecDestroy(&before));
  return fabs(work - stretching) / fabs(work);
}

static void StressWorkIsStretching(void **state)
{
  static const DLMFluidModel models[] = { DLM_FLUID_OLDROYD_B, DLM_FLUID_UCM, DLM_FLUID_CARREAU };
  PetscInt                   processes[3];

  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (int k = 0; Layout(k, processes); k++)
      for (int m = 0; m < 3; m++) {
        PolymerCase c;
        OpenLayout(PETSC_COMM_WORLD, periodic, processes, &c);
        c.scene.fluid_model      = models[m];
        c.scene.retardation_time = models[m] == DLM_FLUID_UCM ? 0.0 : 0.1;
        c.scene.carreau_n        = 0.5;
        OpenPolymer(&c);
        SetRandomConformation(&c, 3);
        AssertAtMost(Imbalance(&c), 1e-12);
        ClosePolymer(&c);
      }
}

/* The rules for C inside the spheres keep it positive definite, and the balance holds after them. */
static void StressWorkIsStretchingAmongSpheres(void **state)
{
  static const DLMInside rules[] = { DLM_INSIDE_IDENTITY, DLM_INSIDE_EVOLVE, DLM_INSIDE_EXTEND };
  PetscInt               processes[3];

  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (int k = 0; Layout(k, processes); k++)
      for (int r = 0; r < 3; r++) {
        PolymerCase      c;
        DLMPolymerHealth health;
        OpenLayout(PETSC_COMM_WORLD, periodic, processes, &c);
        c.scene.polymer_inside = rules[r];
        AddSpheres(&c);
        OpenPolymer(&c);
        SetRandomConformation(&c, 3);
        Call(DLMPolymerSetInside(c.polymer));
        Call(DLMPolymerGetHealth(c.polymer, &health));
        AssertAll(health.sound && health.smallest_eigenvalue > 0.01);
        AssertAtMost(Imbalance(&c), 1e-12);
        ClosePolymer(&c);
      }
}

/* C of nodes in the spheres: I at all of them (identity), at those deeper than 2 h (extend), untouched (evolve); outside untouched. */
static void TheRulesInsideReachTheirNodes(void **state)
{
  static const DLMInside rules[] = { DLM_INSIDE_IDENTITY, DLM_INSIDE_EVOLVE, DLM_INSIDE_EXTEND };

  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (int r = 0; r < 3; r++) {
      PolymerCase c;
      Vec         before, after;
      PetscInt    n;
      double     *x, *y, wrong = 0.0;
      int         touched = 0;
      OpenLayout(PETSC_COMM_WORLD, periodic, NULL, &c);
      c.scene.polymer_inside = rules[r];
      AddSpheres(&c);
      OpenPolymer(&c);
      SetRandomConformation(&c, 3);
      before = NewConformation(&c);
      Call(DLMPolymerSetInside(c.polymer));
      after = NewConformation(&c);
      GatherNatural(c.six, before, &n, &x);
      GatherNatural(c.six, after, &n, &y);
      for (PetscInt i = 0; i < n / 6; i++) {
        const PetscInt *nodes = c.grid->nodes, at[3] = { i % nodes[0], (i / nodes[0]) % nodes[1], i / (nodes[0] * nodes[1]) };
        double          depth = -1e300, away_from_unit = 0.0, change = 0.0;
        for (int s = 0; s < 3; s++) {
          double r2 = 0.0;
          for (int d = 0; d < 3; d++) {
            const double size = c.scene.box_size[d], z = c.grid->lower[d] + c.grid->h * at[d] - c.spec[s].center[d];
            r2 += c.scene.box_periodic[d] ? pow(z - size * floor(0.5 + z / size), 2) : z * z;
          }
          depth = fmax(depth, 0.3 - sqrt(r2));
        }
        for (int k = 0; k < 6; k++) {
          away_from_unit = fmax(away_from_unit, fabs(y[6 * i + k] - (k < 3)));
          change         = fmax(change, fabs(y[6 * i + k] - x[6 * i + k]));
        }
        touched += change > 0.0;
        if (depth <= 0.0 || rules[r] == DLM_INSIDE_EVOLVE) wrong = fmax(wrong, change);
        else if (rules[r] == DLM_INSIDE_IDENTITY || depth > 2.0 * c.scene.h) wrong = fmax(wrong, away_from_unit);
      }
      AssertNear(wrong, 0.0, 0.0);
      AssertAll(rules[r] == DLM_INSIDE_EVOLVE ? touched == 0 : touched > 100);
      Call(PetscFree(x));
      Call(PetscFree(y));
      Call(VecDestroy(&before));
      Call(VecDestroy(&after));
      ClosePolymer(&c);
    }
}

typedef struct {
  double a[3], g[9];
} Linear;

static double LinearVelocity(const double x[3], int i, const void *context)
{
  const Linear *l = context;
  return l->a[i] + l->g[3 * i] * x[0] + l->g[3 * i + 1] * x[1] + l->g[3 * i + 2] * x[2];
}

/* Linear along the axes with walls, constant along the periodic ones. */
static void TheGradientOfALinearVelocityIsExact(void **state)
{
  PetscInt processes[3];

  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (int k = 0; Layout(k, processes); k++) {
      PolymerCase c;
      Linear      l;
      double      worst = 0.0;
      OpenLayout(PETSC_COMM_WORLD, periodic, processes, &c);
      OpenPolymer(&c);
      for (int i = 0; i < 3; i++) l.a[i] = Hash(1, i);
      for (int i = 0; i < 9; i++) l.g[i] = (periodic >> (i % 3)) & 1u ? 0.0 : Hash(2, i);
      SetPointVelocity(&c, LinearVelocity, &l);
      for (int i = 0; i < 9; i++)
        for (PetscInt x = 0; x < c.polymer->block.n; x++) worst = fmax(worst, fabs(c.polymer->g[i][x] - l.g[i]));
      AssertAtMost(worst, 1e-13);
      ClosePolymer(&c);
    }
}

typedef struct {
  DLMPolymerForm form;
  PetscReal      courant;
  PetscInt       order;
  PetscBool      spheres;
} Walk;

/* Three steps of advection and stretching with a velocity that changes. */
static Vec NewWalk(const Walk *w, MPI_Comm comm, unsigned periodic, const PetscInt *processes, PolymerCase *c)
{
  Vec nodes;

  OpenLayout(comm, periodic, processes, c);
  c->scene.polymer_form    = w->form;
  c->scene.polymer_courant = w->courant;
  c->scene.polymer_inside  = w->spheres ? DLM_INSIDE_EXTEND : DLM_INSIDE_EVOLVE;
  if (w->spheres) AddSpheres(c);
  OpenPolymer(c);
  SetRandomConformation(c, 4);
  for (unsigned step = 0; step < 3; step++) {
    Vec u = NewRandomVelocity(c, 20 + step);
    Call(DLMPolymerSetInside(c->polymer));
    Call(DLMPolymerSetVelocity(c->polymer, 0.1 * step, u));
    Call(DLMPolymerAdvect(c->polymer, 0.01));
    Call(DLMPolymerStretch(c->polymer, 0.01, w->order));
    Call(VecDestroy(&u));
  }
  nodes = NewConformation(c);
  return nodes;
}

static void AnyLayoutGivesTheConformationOfOneRank(void **state)
{
  static const Walk walks[] = {
    { DLM_FORM_FACTOR, 0.6, 1, PETSC_FALSE }, { DLM_FORM_FACTOR, 0.1, 2, PETSC_TRUE }, { DLM_FORM_LOG, 0.6, 2, PETSC_FALSE }, { DLM_FORM_LOG, 0.1, 1, PETSC_TRUE }
  };
  PetscInt processes[3];

  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (int w = 0; w < 4; w++) {
      PolymerCase      one;
      DLMPolymerHealth alone;
      Vec              expected = NewWalk(&walks[w], PETSC_COMM_SELF, periodic, NULL, &one);
      Call(DLMPolymerGetHealth(one.polymer, &alone));
      assert_true(alone.sound);
      assert_int_equal(alone.substeps > 1, walks[w].courant < 0.5);
      for (int k = 0; Layout(k, processes); k++) {
        PolymerCase      c;
        DLMPolymerHealth health;
        Vec              found = NewWalk(&walks[w], PETSC_COMM_WORLD, periodic, processes, &c);
        AssertAtMost(FieldDifference(c.six, found, one.six, expected), 1e-12);
        Call(DLMPolymerGetHealth(c.polymer, &health));
        AssertNear(health.smallest_eigenvalue, alone.smallest_eigenvalue, 1e-11);
        AssertNear(health.largest_trace, alone.largest_trace, 1e-11);
        AssertNear(health.courant, alone.courant, 1e-13);
        for (int d = 0; d < 3; d++) AssertNear(health.place[d], alone.place[d], 1e-13);
        AssertAll(health.sound && health.substeps == alone.substeps);
        Call(VecDestroy(&found));
        ClosePolymer(&c);
      }
      Call(VecDestroy(&expected));
      ClosePolymer(&one);
    }
}

/* Keep and BringBack undo a step to the last bit. */
static void AStepCanBeTakenBack(void **state)
{
  const Walk  walk = { DLM_FORM_FACTOR, 0.6, 2, PETSC_TRUE };
  PolymerCase c;
  Vec         before = NewWalk(&walk, PETSC_COMM_WORLD, 3, NULL, &c), u = NewRandomVelocity(&c, 9), after, force[2];

  for (int k = 0; k < 2; k++) Call(VecDuplicate(u, &force[k]));
  Call(DLMPolymerForce(c.polymer, 0.3, 0.35, 2, force[0]));
  Call(DLMPolymerKeep(c.polymer));
  Call(DLMPolymerForce(c.polymer, 0.4, 0.45, 2, force[0]));
  Call(DLMPolymerSetVelocity(c.polymer, 0.45, u));
  Call(DLMPolymerAdvect(c.polymer, 0.01));
  Call(DLMPolymerStretch(c.polymer, 0.01, 2));
  Call(DLMPolymerForce(c.polymer, 0.5, 0.55, 2, force[1]));
  Call(DLMPolymerBringBack(c.polymer));
  after = NewConformation(&c);
  assert_true(FieldDifference(c.six, after, c.six, before) == 0.0);
  Call(DLMPolymerForce(c.polymer, 0.4, 0.45, 2, force[1]));
  assert_true(FieldDifference(c.grid->velocity, force[1], c.grid->velocity, force[0]) == 0.0);
  for (Vec *v = (Vec[]){ before, u, after, force[0], force[1], NULL }; *v; v++) Call(VecDestroy(v));
  ClosePolymer(&c);
}

enum { BAD_ENTRY = 50, NOT_A_NUMBER };
static const PetscInt bad_node[3] = { 11, 3, 7 };

/* I but at bad_node. */
static double UnsoundConformation(const PetscInt i[3], int component, const void *context)
{
  const int bad = *(const int *)context;

  if (i[0] == bad_node[0] && i[1] == bad_node[1] && i[2] == bad_node[2] && component == 3) return bad == NOT_A_NUMBER ? NAN : bad;
  return component < 3;
}

/* A C that is not positive definite at one node is found there, on every rank, and C stays as it is from then on. */
static void AnUnsoundNodeIsFound(void **state)
{
  for (int form = 0; form < 2; form++)
    for (int bad = BAD_ENTRY; bad <= NOT_A_NUMBER; bad++)
      for (int advect = 0; advect < 2; advect++) {
        const Walk       walk = { form ? DLM_FORM_LOG : DLM_FORM_FACTOR, 0.6, 1, PETSC_FALSE };
        PolymerCase      c;
        DLMPolymerHealth health;
        Vec              nodes = NewWalk(&walk, PETSC_COMM_WORLD, 3, NULL, &c);
        FillNodes(c.six, UnsoundConformation, &bad, nodes);
        MoveConformation(&c, nodes, PETSC_TRUE);
        if (advect) Call(DLMPolymerAdvect(c.polymer, 0.01));
        Call(DLMPolymerGetHealth(c.polymer, &health));
        AssertAll(!health.sound);
        for (int d = 0; d < 3; d++) AssertNear(health.place[d], c.grid->lower[d] + c.grid->h * bad_node[d], 1e-13);
        Call(VecDestroy(&nodes));
        ClosePolymer(&c);
      }
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(StressWorkIsStretching),
  cmocka_unit_test(StressWorkIsStretchingAmongSpheres),
  cmocka_unit_test(TheRulesInsideReachTheirNodes),
  cmocka_unit_test(TheGradientOfALinearVelocityIsExact),
  cmocka_unit_test(AnyLayoutGivesTheConformationOfOneRank),
  cmocka_unit_test(AStepCanBeTakenBack),
  cmocka_unit_test(AnUnsoundNodeIsFound),
};

RUN_ON_ALL_RANKS(tests)
