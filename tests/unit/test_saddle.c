/* The saddle problem of a step: no slip, force balance, motions, every pairing, ranks, warm start, iterations, and the thesis's Uzawa. */
#include "dlmtest.h"
#include "dlmsaddle.h"

enum { MOST = 20 };

static const DLMInertia no_inertia = { 0.0, 0.0, 0.0 };

/* A box of 3 x 2 x 2, periodic in x1 and x2, walls at x3 driven to and fro: shear rate 1. */
typedef struct {
  DLMScene        scene;
  DLMSphereSpec   spec[MOST];
  PetscReal       force[3 * MOST], torque[3 * MOST];
  DLMGrid         grid;
  DLMStokes       stokes;
  DLMSpheres      spheres;
  DLMPairing      pairing;
  DLMSaddle       saddle;
  DLMSphereState *state;
} Bodies;

static void StartCase(MPI_Comm comm, PetscInt cells_x1, PetscReal rtol, Bodies *b)
{
  const PetscInt cells[3] = { cells_x1, 2 * cells_x1 / 3, 2 * cells_x1 / 3 };

  memset(b, 0, sizeof(*b));
  MakeScene(comm, cells, 3, &b->scene);
  b->scene.h               = 3.0 / cells_x1;
  b->scene.grid_resolution = cells_x1 / 3.0;
  for (int d = 0; d < 3; d++) b->scene.box_size[d] = cells[d] * b->scene.h;
  b->scene.pairing_type         = DLM_PAIRING_IMMERSED;
  b->scene.pairing_points       = DLM_POINTS_SURFACE;
  b->scene.pairing_spacing      = DLM_AUTO;
  b->scene.pairing_degree       = DLM_AUTO;
  b->scene.pairing_retraction   = DLM_AUTO;
  b->scene.pairing_compliance   = DLM_AUTO;
  b->scene.saddle_rtol          = rtol;
  b->scene.saddle_cluster_gap   = 2.0;
  b->scene.saddle_cluster_limit = 4000;
  for (int side = 0; side < 2; side++) b->scene.wall_velocity[2][side][0] = side ? 1.0 : -1.0;
  b->scene.spheres = b->spec;
}

static void AddSphere(Bodies *b, DLMMotion motion, PetscReal radius, PetscReal x1, PetscReal x2, PetscReal x3)
{
  b->spec[b->scene.n_spheres++] = (DLMSphereSpec){ .center = { x1, x2, x3 }, .radius = radius, .density = 1.5, .motion = motion };
}

static void Push(Bodies *b, PetscInt i, PetscReal F1, PetscReal F2, PetscReal F3, PetscReal T1, PetscReal T2, PetscReal T3)
{
  const PetscReal F[3] = { F1, F2, F3 }, T[3] = { T1, T2, T3 };

  for (int d = 0; d < 3; d++) {
    b->force[3 * i + d]  = F[d];
    b->torque[3 * i + d] = T[d];
  }
}

/* Boxes without spheres: all cases of a mesh share one, and its impulse responses. */
static struct {
  DLMScene  scene;
  DLMGrid   grid;
  DLMStokes stokes;
} boxes[8];
static int n_boxes;

static void FindBox(Bodies *b)
{
  int k = 0;

  while (k < n_boxes && (boxes[k].scene.comm != b->scene.comm || boxes[k].scene.cells[0] != b->scene.cells[0])) k++;
  if (k == n_boxes) {
    boxes[k].scene = b->scene;
    Call(DLMGridCreate(&boxes[k].scene, &boxes[k].grid));
    Call(DLMStokesCreate(boxes[k].grid, &boxes[k].scene, &boxes[k].stokes));
    n_boxes++;
  }
  b->grid   = boxes[k].grid;
  b->stokes = boxes[k].stokes;
}

static int DestroyBoxes(void **state)
{
  for (; n_boxes > 0; n_boxes--) {
    Call(DLMStokesDestroy(&boxes[n_boxes - 1].stokes));
    Call(DLMGridDestroy(&boxes[n_boxes - 1].grid));
  }
  return 0;
}

static void OpenCase(const char *options, Bodies *b)
{
  Call(PetscOptionsClear(NULL));
  Call(PetscOptionsInsertString(NULL, options));
  FindBox(b);
  Call(DLMSpheresCreate(b->grid, &b->scene, &b->spheres));
  Call(DLMPairingCreate(b->spheres, &b->scene, &b->pairing));
  Call(DLMSaddleCreate(b->stokes, b->spheres, b->pairing, &b->scene, &b->saddle));
  Call(DLMSpheresGetStates(b->spheres, NULL, &b->state));
}

static void CloseCase(Bodies *b)
{
  Call(DLMSaddleDestroy(&b->saddle));
  Call(DLMPairingDestroy(&b->pairing));
  Call(DLMSpheresDestroy(&b->spheres));
}

/* Returns the iterations. */
static PetscInt Solve(Bodies *b, DLMInertia inertia)
{
  DLMSaddleWork work;

  Call(DLMSaddleSolve(b->saddle, inertia, b->force, b->torque, NULL));
  Call(DLMSaddleGetWork(b->saddle, &work));
  return work.last_iterations;
}

/* Slip over the velocity of the fluid at the spheres, both as root mean squares over the multipliers. */
static double Slip(Bodies *b)
{
  PetscInt     n_points, n;
  PetscReal    slip, scale[2] = { 0.0, 0.0 };
  PetscScalar *points, *values;
  Vec          fluid;

  Call(DLMSaddleGetSlip(b->saddle, &slip));
  Call(DLMSaddleGetFluid(b->saddle, &fluid));
  Call(DLMPairingGetPoints(b->pairing, &n_points, NULL, NULL));
  Call(DLMPairingGetMultipliers(b->pairing, &n, NULL));
  Call(PetscMalloc2(3 * n_points, &points, 3 * n, &values));
  Call(DLMPairingInterpolate(b->pairing, fluid, points));
  Call(DLMPairingProject(b->pairing, points, values));
  for (PetscInt i = 0; i < 3 * n; i++) scale[0] += values[i] * values[i];
  scale[1] = n;
  Call(MPI_Allreduce(MPI_IN_PLACE, scale, 2, MPIU_REAL, MPI_SUM, b->scene.comm));
  Call(PetscFree2(points, values));
  return slip / sqrt(scale[0] / scale[1]);
}

/* Largest difference of velocity, omega, force and torque, each against its largest value; lengths and times are of order one here. */
static double Difference(const Bodies *a, const Bodies *b)
{
  double worst = 0.0;

  for (int part = 0; part < 4; part++) {
    const size_t at[4] = { offsetof(DLMSphereState, velocity), offsetof(DLMSphereState, omega), offsetof(DLMSphereState, force), offsetof(DLMSphereState, torque) };
    double       difference = 0.0, largest = 1.0;
    for (PetscInt i = 0; i < a->scene.n_spheres; i++)
      for (int d = 0; d < 3; d++) {
        const double x = ((const PetscReal *)((const char *)&a->state[i] + at[part]))[d], y = ((const PetscReal *)((const char *)&b->state[i] + at[part]))[d];
        if (!(fabs(x - y) <= difference)) difference = fabs(x - y);
        largest = fmax(largest, fabs(y));
      }
    worst = fmax(worst, difference / largest);
  }
  return worst;
}

/* A free, a rotating and a fixed sphere, one across the periodic faces, one near a wall. */
static void AddThree(Bodies *b)
{
  AddSphere(b, DLM_MOTION_FREE, 0.3, -0.37, 0.91, 0.36);
  AddSphere(b, DLM_MOTION_ROTATE, 0.32, 0.41, -0.13, -0.55);
  AddSphere(b, DLM_MOTION_FIXED, 0.28, 1.43, 0.25, 0.15);
  for (int d = 0; d < 3; d++) {
    b->spec[2].velocity[d] = (double[3]){ 0.2, -0.1, 0.05 }[d];
    b->spec[2].omega[d]    = (double[3]){ -0.3, 0.2, 0.4 }[d];
  }
  Push(b, 0, 1.0, -2.0, 0.5, 0.1, 0.2, -0.3);
  Push(b, 1, 3.0, 1.0, 2.0, -0.2, 0.3, 0.1);
  Push(b, 2, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0); /* a held sphere does not care */
}

/* Pairings: type x points x (a multiplier at every point, harmonics, and those with what calibration chooses). */
typedef struct {
  DLMPairingType type;
  DLMPointSet    points;
  PetscReal      degree;
} PairingCase;

static const PairingCase pairings[] = {
  { DLM_PAIRING_IMMERSED, DLM_POINTS_SURFACE, DLM_AUTO },  { DLM_PAIRING_IMMERSED, DLM_POINTS_SURFACE, 0.0 },
  { DLM_PAIRING_IMMERSED, DLM_POINTS_VOLUME, DLM_AUTO },   { DLM_PAIRING_COLLOCATION, DLM_POINTS_SURFACE, DLM_AUTO },
  { DLM_PAIRING_COLLOCATION, DLM_POINTS_VOLUME, DLM_AUTO }, { DLM_PAIRING_COLLOCATION, DLM_POINTS_SURFACE, 3.0 },
  { DLM_PAIRING_IMMERSED, DLM_POINTS_VOLUME, 3.0 },
};

enum { N_PAIRINGS = sizeof(pairings) / sizeof(pairings[0]) };

static void SetPairing(const PairingCase *p, Bodies *b)
{
  b->scene.pairing_type   = p->type;
  b->scene.pairing_points = p->points;
  b->scene.pairing_degree = p->degree;
}

static void SlipIsWithinTheTolerance(void **state)
{
  for (int p = 0; p < N_PAIRINGS; p++)
    for (int k = 0; k < 2; k++) {
      const PetscReal rtol = k ? 1e-9 : 1e-5;
      Bodies          b;
      StartCase(PETSC_COMM_WORLD, 24, rtol, &b);
      SetPairing(&pairings[p], &b);
      AddThree(&b);
      OpenCase("", &b);
      const PetscInt its = Solve(&b, no_inertia);
      const double slip = Slip(&b);
      print_message("  %s %s degree %g, rtol %g: slip %.2e, %d iterations\n", DLMPairingTypes[pairings[p].type], DLMPointSets[pairings[p].points],
                    pairings[p].degree, rtol, slip, (int)its);
      AssertAtMost(slip, 2.0 * rtol); /* the solver's norm is the energy */
      CloseCase(&b);
    }
}

/* F_hyd + F = 0 without inertia, for every component that is not held. */
static void ForcesBalance(void **state)
{
  for (int p = 0; p < N_PAIRINGS; p++) {
    Bodies b;
    StartCase(PETSC_COMM_WORLD, 24, 1e-6, &b);
    SetPairing(&pairings[p], &b);
    AddThree(&b);
    OpenCase("", &b);
    Solve(&b, no_inertia);
    for (int d = 0; d < 3; d++) {
      AssertNear(b.state[0].force[d], -b.force[d], 1e-11);
      AssertNear(b.state[0].torque[d], -b.torque[d], 1e-11);
      AssertNear(b.state[1].torque[d], -b.torque[3 + d], 1e-11);
    }
    CloseCase(&b);
  }
}

/* F_hyd + F = M weight (V - now V^n - before V^(n-1)), over several steps of changing weights. */
static void InertiaBalances(void **state)
{
  const DLMInertia steps[] = { { 10.0, 1.0, 0.0 }, { 15.0, 4.0 / 3.0, -1.0 / 3.0 }, { 17.0, 1.3, -0.3 } };
  Bodies           b;

  StartCase(PETSC_COMM_WORLD, 24, 1e-6, &b);
  AddThree(&b);
  b.spec[0].velocity[1] = 0.7;
  b.spec[0].omega[2]    = -0.4;
  OpenCase("", &b);
  for (int k = 0; k < 3; k++) {
    const DLMSphereState old[2] = { b.state[0], b.state[1] };
    Solve(&b, steps[k]);
    for (int i = 0; i < 2; i++) {
      const double a = b.spec[i].radius, M = 4.0 / 3.0 * M_PI * a * a * a * b.spec[i].density, moment = 0.4 * M * a * a, w = steps[k].weight;
      for (int d = 0; d < 3; d++) {
        const double dV = b.state[i].velocity[d] - steps[k].now * old[i].velocity[d] - steps[k].before * old[i].velocity_before[d];
        const double dw = b.state[i].omega[d] - steps[k].now * old[i].omega[d] - steps[k].before * old[i].omega_before[d];
        if (i == 0) AssertNear(b.state[i].force[d] + b.force[3 * i + d], M * w * dV, 1e-11);
        AssertNear(b.state[i].torque[d] + b.torque[3 * i + d], moment * w * dw, 1e-11);
        AssertNear(b.state[i].velocity_before[d], old[i].velocity[d], 0.0);
        AssertNear(b.state[i].omega_before[d], old[i].omega[d], 0.0);
      }
    }
    AssertAtMost(Slip(&b), 2e-6);
  }
  CloseCase(&b);
}

static void HeldSpheresKeepTheirMotion(void **state)
{
  for (int k = 0; k < 2; k++) {
    Bodies b;
    StartCase(PETSC_COMM_WORLD, 24, 1e-6, &b);
    AddThree(&b);
    OpenCase("", &b);
    Solve(&b, k ? (DLMInertia){ 10.0, 1.0, 0.0 } : no_inertia);
    for (int d = 0; d < 3; d++) {
      AssertNear(b.state[1].velocity[d], 0.0, 0.0);
      AssertNear(b.state[2].velocity[d], b.spec[2].velocity[d], 0.0);
      AssertNear(b.state[2].omega[d], b.spec[2].omega[d], 0.0);
    }
    if (!k) AssertNear(b.state[1].omega[1], 0.5 + 0.3 / (8.0 * M_PI * 0.7 * 0.32 * 0.32 * 0.32), 0.1);
    CloseCase(&b);
  }
}

/* Mobility is the inverse of resistance: a sphere held at the motion of a pushed one feels the push, a rotating one the missing force. */
static void FixedSpheresFeelThePush(void **state)
{
  Bodies free, held;

  StartCase(PETSC_COMM_WORLD, 24, 1e-9, &free);
  AddSphere(&free, DLM_MOTION_FREE, 0.3, 0.13, 0.24, 0.35);
  AddSphere(&free, DLM_MOTION_FREE, 0.3, 0.13, 0.94, 0.35);
  Push(&free, 0, 1.0, -2.0, 0.5, 0.1, 0.2, -0.3);
  Push(&free, 1, 0.3, 0.7, -1.0, 0.2, 0.0, 0.4);
  OpenCase("", &free);
  Solve(&free, no_inertia);
  StartCase(PETSC_COMM_WORLD, 24, 1e-9, &held);
  AddSphere(&held, DLM_MOTION_FIXED, 0.3, 0.13, 0.24, 0.35);
  AddSphere(&held, DLM_MOTION_FREE, 0.3, 0.13, 0.94, 0.35);
  Push(&held, 1, 0.3, 0.7, -1.0, 0.2, 0.0, 0.4);
  for (int d = 0; d < 3; d++) {
    held.spec[0].velocity[d] = free.state[0].velocity[d];
    held.spec[0].omega[d]    = free.state[0].omega[d];
  }
  OpenCase("", &held);
  Solve(&held, no_inertia);
  AssertAtMost(Difference(&held, &free), 1e-7);
  CloseCase(&held);
  CloseCase(&free);
}

/* Force, torque and shear act on a lone sphere in the middle: V, omega and the drag point where they should, within the box's correction. */
static void APushedSphereMovesAsStokesSays(void **state)
{
  const double a = 0.3, mu = 0.7;
  Bodies       b;

  StartCase(PETSC_COMM_WORLD, 36, 1e-8, &b);
  AddSphere(&b, DLM_MOTION_FREE, a, 0.0, 0.0, 0.0);
  Push(&b, 0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5);
  OpenCase("", &b);
  Solve(&b, no_inertia);
  AssertNear(b.state[0].velocity[1] * 6.0 * M_PI * mu * a, 0.85, 0.15);
  AssertNear(b.state[0].omega[2] * 8.0 * M_PI * mu * a * a * a / 0.5, 0.97, 0.05);
  AssertNear(b.state[0].omega[1], 0.5, 0.02);
  AssertNear(b.state[0].stresslet[4] / (20.0 / 3.0 * M_PI * mu * a * a * a * 0.5), 1.05, 0.1);
  for (int d = 0; d < 3; d++)
    if (d != 1) AssertNear(b.state[0].velocity[d], 0.0, 1e-3);
  CloseCase(&b);
}

/* The same case on one rank. */
static double DifferenceFromOneRank(const Bodies *b, const PairingCase *pairing, DLMInertia inertia)
{
  double difference;
  Bodies alone;

  StartCase(PETSC_COMM_SELF, 24, 1e-10, &alone);
  SetPairing(pairing, &alone);
  AddThree(&alone);
  OpenCase("", &alone);
  Solve(&alone, inertia);
  difference = Difference(b, &alone);
  CloseCase(&alone);
  return difference;
}

static void EveryNumberOfRanksAgrees(void **state)
{
  PetscMPIInt rank;

  Call(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (int p = 0; p < N_PAIRINGS; p++)
    for (int k = 0; k < 2; k++) {
      const DLMInertia inertia = k ? (DLMInertia){ 10.0, 1.0, 0.0 } : no_inertia;
      Bodies           b;
      double           difference = 0.0;
      if (k && p > 1) continue;
      StartCase(PETSC_COMM_WORLD, 24, 1e-10, &b);
      SetPairing(&pairings[p], &b);
      AddThree(&b);
      OpenCase("", &b);
      Solve(&b, inertia);
      if (rank == 0) difference = DifferenceFromOneRank(&b, &pairings[p], inertia);
      print_message("  %s %s degree %g: against one rank %.1e\n", DLMPairingTypes[pairings[p].type], DLMPointSets[pairings[p].points], pairings[p].degree, difference);
      AssertAtMost(difference, 1e-8);
      CloseCase(&b);
    }
}

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
static void OneSphereTakesSixIterations(void **state)
{
  PetscInt most[2] = { 0, 0 };

  for (int k = 0; k < 2; k++)
    for (int p = 0; p < 6; p++) {
      const PetscReal radius = (double[2]){ 0.3, 0.36 }[p % 2];
      Bodies          b;
      StartCase(PETSC_COMM_WORLD, k ? 36 : 24, 1e-8, &b);
      AddSphere(&b, DLM_MOTION_FREE, radius, 1.5 * Hash(21, p), 1.0 * Hash(22, p), 0.6 * Hash(23, p));
      Push(&b, 0, 1.0, -2.0, 0.5, 0.1, 0.2, -0.3);
      OpenCase("", &b);
      const PetscInt its = Solve(&b, no_inertia);
      print_message("  a/h = %.2f, gap to the wall %.2f h: %d iterations\n", radius / b.scene.h, (1.0 - fabs(b.spec[0].center[2]) - radius) / b.scene.h, (int)its);
      const int near = 1.0 - fabs(b.spec[0].center[2]) < 2.0 * radius;
      most[near]     = PetscMax(most[near], its);
      CloseCase(&b);
    }
  AssertAtMost(most[0], 6);
  AssertAtMost(most[1], 8); /* a wall within a radius: the blocks know nothing of it */
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

/* The less inertia, the closer to none, in proportion. */
static void VanishingInertiaIsNoInertia(void **state)
{
  double difference[2];
  Bodies without;

  StartCase(PETSC_COMM_WORLD, 24, 1e-11, &without);
  AddThree(&without);
  OpenCase("", &without);
  Solve(&without, no_inertia);
  for (int k = 0; k < 2; k++) {
    Bodies with;
    StartCase(PETSC_COMM_WORLD, 24, 1e-11, &with);
    AddThree(&with);
    OpenCase("", &with);
    Solve(&with, (DLMInertia){ k ? 1e-5 : 1e-3, 1.0, 0.0 });
    difference[k] = Difference(&with, &without);
    CloseCase(&with);
  }
  print_message("  M/dt = 1e-3: %.2e, 1e-5: %.2e\n", difference[0], difference[1]);
  assert_true(difference[0] > 1e-6 && difference[0] < 1e-3);
  AssertNear(difference[1] / difference[0], 1e-2, 1e-3);
  CloseCase(&without);
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(SlipIsWithinTheTolerance),
  cmocka_unit_test(ForcesBalance),
  cmocka_unit_test(InertiaBalances),
  cmocka_unit_test(HeldSpheresKeepTheirMotion),
  cmocka_unit_test(FixedSpheresFeelThePush),
  cmocka_unit_test(APushedSphereMovesAsStokesSays),
  cmocka_unit_test(EveryNumberOfRanksAgrees),
  cmocka_unit_test(WarmStartCostsNothingWhenNothingChanged),
  cmocka_unit_test(WarmStartSavesIterations),
  cmocka_unit_test(MigrationKeepsTheWarmStart),
  cmocka_unit_test(OneSphereTakesSixIterations),
  cmocka_unit_test(TwoSpheresTakeTwelveIterations),
  cmocka_unit_test(TwentySpheresTakeTwentyIterations),
  cmocka_unit_test(UzawaGivesTheSame),
  cmocka_unit_test_teardown(VanishingInertiaIsNoInertia, DestroyBoxes),
};

RUN_ON_ALL_RANKS(tests)
