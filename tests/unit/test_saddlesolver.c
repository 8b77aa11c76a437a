/* The solver of the saddle problem: warm starts, iterations, and the thesis's Uzawa. */
#include "saddletest.h"
#include "private/response.h"

static void WarmStartCostsNothingWhenNothingChanged(void **state)
{
  for (int p = 0; p < N_PAIRINGS; p++) {
    Bodies   b;
    PetscInt cold, warm;
    StartCase(PETSC_COMM_WORLD, 24, 1e-7, &b);
    SetPairing(&pairings[p], &b);
    if (b.scene.pairing_points == DLM_POINTS_VOLUME) {
      continue; /* inner points start from zero */
    }
    AddThree(&b);
    OpenCase("", &b);
    cold = Solve(&b, no_inertia);
    warm = Solve(&b, no_inertia);
    AssertAtMost(warm, 1);
    assert_true(cold > warm);
    CloseCase(&b);
  }
}

/* Small steps: most of the first solve's work is saved. */
static void WarmStartSavesIterations(void **state)
{
  Bodies   b;
  PetscInt cold, warm = 0;
  double   slip = 0.0;

  StartCase(PETSC_COMM_WORLD, 24, 1e-6, &b);
  AddThree(&b);
  OpenCase("", &b);
  cold = Solve(&b, no_inertia);
  for (int k = 0; k < 5; k++) {
    for (int i = 0; i < 3; i++)
      for (int d = 0; d < 3; d++) b.state[i].center[d] += 0.01 * b.state[i].velocity[d];
    const PetscInt its = Solve(&b, no_inertia);
    warm               = PetscMax(warm, its);
    slip = fmax(slip, Slip(&b));
  }
  print_message("  %d iterations cold, at most %d warm, slip %.1e\n", (int)cold, (int)warm, slip);
  AssertAtMost(slip, 2e-6);
  AssertAtMost(warm, cold - 1);
  CloseCase(&b);
}

/* A sphere and its neighbour walk through the whole box: every rank boundary and the periodic face are crossed. */
static void MigrationKeepsTheWarmStart(void **state)
{
  for (int p = 0; p < 2; p++) {
    PetscInt cold, most = 0, staying = 0, owners = 0;
    Bodies   b;
    StartCase(PETSC_COMM_WORLD, 24, 1e-5, &b);
    SetPairing(&pairings[p], &b);
    AddSphere(&b, DLM_MOTION_FREE, 0.3, -1.4, -0.9, -0.6);
    AddSphere(&b, DLM_MOTION_FREE, 0.3, 0.7, 0.3, -0.4);
    Push(&b, 0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.1);
    OpenCase("", &b);
    cold = Solve(&b, no_inertia);
    for (int k = 0; k < 120; k++) { /* 0.2 h a step */
      PetscInt       n;
      const PetscInt *owned;
      PetscBool      had, has;
      Call(DLMSpheresGetOwned(b.spheres, &n, &owned));
      had = (PetscBool)(n > 0 && owned[0] == 0);
      for (int d = 0; d < 3; d++) b.state[0].center[d] += (double[3]){ 0.025, 0.015, 0.01 }[d];
      const PetscInt its = Solve(&b, no_inertia);
      Call(DLMSpheresGetOwned(b.spheres, &n, &owned));
      has = (PetscBool)(n > 0 && owned[0] == 0);
      if (TrueOnAll((PetscBool)(had == has))) staying = PetscMax(staying, its);
      else {
        owners++;
        most = PetscMax(most, its);
      }
    }
    print_message("  %s: cold %d, warm %d, after one of %d changes of owner %d\n", p ? "points" : "harmonics", (int)cold, (int)staying, (int)owners, (int)most);
    PetscMPIInt size;
    Call(MPI_Comm_size(PETSC_COMM_WORLD, &size));
    assert_true(size == 1 || owners > 0);
    AssertAtMost(most, staying);
    AssertAtMost(staying, cold - 1);
    CloseCase(&b);
  }
}

/* The bounds, at two mesh widths each, from a cold start. */
static PetscInt IterationsAtHeight(PetscInt cells, PetscReal radius, PetscReal x, PetscReal y, PetscReal z)
{
  PetscInt its;
  Bodies   b;

  StartCase(PETSC_COMM_WORLD, cells, 1e-8, &b);
  AddSphere(&b, DLM_MOTION_FREE, radius, x, y, z);
  Push(&b, 0, 1.0, -2.0, 0.5, 0.1, 0.2, -0.3);
  OpenCase("", &b);
  its = Solve(&b, no_inertia);
  print_message("  a/h = %.2f, gap to the wall %.2f h: %d iterations\n", radius / b.scene.h, (1.0 - fabs(z) - radius) / b.scene.h, (int)its);
  CloseCase(&b);
  return its;
}

static void OneSphereTakesSixIterations(void **state)
{
  for (int k = 0; k < 2; k++)
    for (int p = 0; p < 6; p++) {
      const PetscReal h = k ? 1.0 / 12.0 : 1.0 / 8.0, radius = (double[2]){ 0.3, 0.36 }[p % 2], z = 0.6 * Hash(23, p);
      AssertAtMost(IterationsAtHeight(k ? 36 : 24, radius, 1.5 * Hash(21, p), 1.0 * Hash(22, p), z), 1.0 - fabs(z) - radius < 1.5 * h ? 8 : 6);
    }
}

/* The block knows the images of the sphere at walls, down to a gap of h; without them it takes more, the more the finer the sphere is. */
static void OneSphereNearAWallTakesSixOrSevenIterations(void **state)
{
  for (int k = 0; k < 2; k++)
    for (int p = 0; p < 4; p++) {
      const PetscReal h = k ? 1.0 / 12.0 : 1.0 / 8.0, radius = 0.36, gap = (double[4]){ 2.0, 1.0, 0.99, 0.1 }[p] * h;
      AssertAtMost(IterationsAtHeight(k ? 36 : 24, radius, 1.5 * Hash(21, p), 1.0 * Hash(22, p), (p % 2 ? -1.0 : 1.0) * (1.0 - gap - radius)), p < 1 ? 6 : (p < 2 ? 7 : 13));
    }
}

/* Near a wall a block lasts until the gap has changed by a tenth, away from walls for ever; along the wall it lasts. */
static void BlocksFollowTheGapToAWall(void **state)
{
  const struct {
    PetscReal along, gap; /* where the sphere goes next */
    PetscInt  built;
  } moves[] = { { 0.0, 0.20, 1 }, { 0.5, 0.20, 1 }, { 0.5, 0.21, 1 }, { 0.5, 0.25, 2 }, { 0.5, 0.40, 3 }, { 0.5, 0.60, 3 }, { 0.5, 0.20, 4 } };
  const PetscReal radius = 0.36;
  DLMSaddleWork   work;
  Bodies          b;

  StartCase(PETSC_COMM_WORLD, 24, 1e-6, &b);
  AddSphere(&b, DLM_MOTION_FREE, radius, 0.0, 0.0, -1.0 + radius + moves[0].gap);
  Push(&b, 0, 1.0, -2.0, 0.5, 0.1, 0.2, -0.3);
  OpenCase("", &b);
  for (size_t k = 0; k < sizeof(moves) / sizeof(moves[0]); k++) {
    PetscInt built;
    b.state[0].center[0] = moves[k].along;
    b.state[0].center[2] = -1.0 + radius + moves[k].gap;
    Solve(&b, no_inertia);
    Call(DLMSaddleGetWork(b.saddle, &work));
    built = work.blocks_built; /* of this rank: the owner's counts */
    MPI_Allreduce(MPI_IN_PLACE, &built, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
    assert_int_equal(built, moves[k].built);
  }
  CloseCase(&b);
}

/* A force and its image leave no velocity on the wall, whichever axis and side. */
static void AForceAndItsImageRestOnTheWall(void **state)
{
  for (int axis = 0; axis < 3; axis++)
    for (int upper = 0; upper < 2; upper++) {
      const PetscReal side = upper ? -1.0 : 1.0, height = 1.7;
      PetscReal       offset[3] = { 0.4, -1.1, 0.9 }, r = 0.0, image[9];
      offset[axis] = -side * height;
      for (int d = 0; d < 3; d++) r += offset[d] * offset[d];
      r = sqrt(r);
      DLMWallImage(offset, height, axis, side, 0.0, image);
      for (int v = 0; v < 3; v++)
        for (int c = 0; c < 3; c++) AssertAtMost(fabs((v == c) / r + offset[v] * offset[c] / (r * r * r) + image[3 * v + c]), 1e-14);
    }
}

static void TwoSpheresTakeTwelveIterations(void **state)
{
  const double a = 0.3, along[4][3] = { { 1.0, 0.0, 0.0 }, { 0.0, 1.0, 0.0 }, { 0.0, 0.0, 1.0 }, { 0.48, 0.6, 0.64 } };

  for (int k = 0; k < 2; k++)
    for (int p = 0; p < 4; p++) {
      double at[3] = { 0.031, -0.017, 0.045 };
      Bodies b;
      StartCase(PETSC_COMM_WORLD, k ? 36 : 24, 1e-8, &b);
      for (int i = 0; i < 2; i++) {
        double c[3];
        for (int d = 0; d < 3; d++) c[d] = at[d] + (i ? 0.5 : -0.5) * 2.1 * a * along[p][d];
        AddSphere(&b, DLM_MOTION_FREE, a, c[0], c[1], c[2]);
      }
      Push(&b, 0, 1.0, -2.0, 0.5, 0.1, 0.2, -0.3);
      Push(&b, 1, -1.0, 0.0, 0.5, 0.0, -0.2, 0.3);
      OpenCase("", &b);
      const PetscInt its = Solve(&b, no_inertia);
      print_message("  a/h = %.1f, gap a/10 along (%.2g, %.2g, %.2g): %d iterations\n", a / b.scene.h, along[p][0], along[p][1], along[p][2], (int)its);
      AssertAtMost(its, 12);
      CloseCase(&b);
    }
}

/* Up to n spheres of radius a that keep a gap; false if there is no room. */
static PetscBool AddRandom(Bodies *b, PetscInt n, double a, double gap, unsigned seed)
{
  for (PetscInt q = 0; b->scene.n_spheres < n && q < 20000; q++) {
    double    x[3];
    PetscBool apart = PETSC_TRUE;
    for (int d = 0; d < 3; d++) x[d] = (0.5 * b->scene.box_size[d] - (d == 2 ? a + gap : 0.0)) * Hash(seed, 3 * q + d);
    for (PetscInt i = 0; i < b->scene.n_spheres && apart; i++) {
      double r2 = 0.0;
      for (int d = 0; d < 3; d++) {
        double s = x[d] - b->spec[i].center[d];
        if (b->scene.box_periodic[d]) s -= b->scene.box_size[d] * round(s / b->scene.box_size[d]);
        r2 += s * s;
      }
      apart = (PetscBool)(sqrt(r2) > 2.0 * a + gap);
    }
    if (apart) AddSphere(b, DLM_MOTION_FREE, a, x[0], x[1], x[2]);
  }
  return (PetscBool)(b->scene.n_spheres == n);
}

static void TwentySpheresTakeTwentyIterations(void **state)
{
  for (int k = 0; k < 2; k++) {
    Bodies b;
    StartCase(PETSC_COMM_WORLD, k ? 36 : 24, 1e-8, &b);
    assert_true(AddRandom(&b, MOST, 0.3, 0.03, 31));
    for (int i = 0; i < MOST; i++) Push(&b, i, Hash(32, i), Hash(33, i), Hash(34, i), 0.1 * Hash(35, i), 0.1 * Hash(36, i), 0.1 * Hash(37, i));
    OpenCase("", &b);
    const PetscInt its = Solve(&b, no_inertia);
    print_message("  20 spheres, volume fraction 0.19, a/h = %.1f: %d iterations\n", 0.3 / b.scene.h, (int)its);
    AssertAtMost(its, 20);
    AssertAtMost(Slip(&b), 2e-8);
    CloseCase(&b);
  }
}

static void UzawaGivesTheSame(void **state)
{
  for (int p = 0; p < 2; p++)
    for (int k = 0; k < 2; k++) {
      const DLMInertia inertia = k ? (DLMInertia){ 10.0, 1.0, 0.0 } : no_inertia;
      Bodies           b, uzawa;
      PetscInt         its, cold, warm;
      StartCase(PETSC_COMM_WORLD, 24, 1e-10, &b);
      StartCase(PETSC_COMM_WORLD, 24, 1e-10, &uzawa);
      SetPairing(&pairings[p], &b);
      SetPairing(&pairings[p], &uzawa);
      AddThree(&b);
      AddThree(&uzawa);
      OpenCase("", &b);
      OpenCase("-saddle_split velocity", &uzawa);
      its  = Solve(&b, inertia);
      cold = Solve(&uzawa, inertia);
      print_message("  %s, %s inertia: exact %d, Uzawa %d iterations, difference %.1e, slip %.1e\n", p ? "points" : "harmonics", k ? "with" : "without", (int)its,
                    (int)cold, Difference(&uzawa, &b), Slip(&uzawa));
      AssertAtMost(Difference(&uzawa, &b), 1e-8);
      AssertAtMost(Slip(&uzawa), 1e-9);
      if (!k) {
        warm = Solve(&uzawa, inertia);
        AssertAtMost(warm, 1);
        AssertAtMost(Difference(&uzawa, &b), 1e-8);
      }
      CloseCase(&uzawa);
      CloseCase(&b);
    }
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(WarmStartCostsNothingWhenNothingChanged),
  cmocka_unit_test(WarmStartSavesIterations),
  cmocka_unit_test(MigrationKeepsTheWarmStart),
  cmocka_unit_test(OneSphereTakesSixIterations),
  cmocka_unit_test(OneSphereNearAWallTakesSixOrSevenIterations),
  cmocka_unit_test(BlocksFollowTheGapToAWall),
  cmocka_unit_test(AForceAndItsImageRestOnTheWall),
  cmocka_unit_test(TwoSpheresTakeTwelveIterations),
  cmocka_unit_test(TwentySpheresTakeTwentyIterations),
  cmocka_unit_test_teardown(UzawaGivesTheSame, DestroyBoxes),
};

RUN_ON_ALL_RANKS(tests)
