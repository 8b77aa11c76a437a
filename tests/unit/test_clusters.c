/* Near contact: which spheres share a dense block, how METIS cuts large clusters, and that the cut does not change the answer. */
#include "dlmtest.h"
#include "dlmsaddle.h"
#include "../../src/saddle/clusters.c" /* DLMFindClusters is not exported */

enum { HEAP = 60, LONE = 3, N = HEAP + LONE };

typedef struct {
  DLMScene      scene;
  DLMSphereSpec spec[N];
  DLMGrid       grid;
  DLMSpheres    spheres;
  DLMBodyLayout layout; /* only the number of multipliers is needed */
  PetscInt      points[N];
} Case;

/* h = 0.125, a = 2.4 h. */
static void AddSphere(Case *c, double x1, double x2, double x3)
{
  c->spec[c->scene.n_spheres++] = (DLMSphereSpec){ .center = { x1, x2, x3 }, .radius = 0.3, .density = 1.0, .motion = DLM_MOTION_FREE };
}

static void StartCase(MPI_Comm comm, const PetscInt cells[3], PetscInt limit, Case *c)
{
  memset(c, 0, sizeof(*c));
  MakeScene(comm, cells, 3, &c->scene);
  c->scene.pairing_type         = DLM_PAIRING_IMMERSED;
  c->scene.pairing_points       = DLM_POINTS_SURFACE;
  c->scene.pairing_spacing      = DLM_AUTO;
  c->scene.pairing_degree       = DLM_AUTO;
  c->scene.pairing_compliance   = DLM_AUTO;
  c->scene.pairing_spin_compliance = c->scene.pairing_strain_compliance = DLM_AUTO;
  c->scene.saddle_rtol          = 1e-9;
  c->scene.saddle_cluster_gap   = 1.0;
  c->scene.saddle_cluster_limit = limit;
  c->scene.wall_velocity[2][1][0] = 1.0;
  c->scene.spheres              = c->spec;
}

/*
  Touching lumps of close-packed spheres: layers of 3 x 2 in a face-centred packing, contacts a hair apart. One lump of 60 or,
  with a gap between them that the cluster gap does not bridge, two of 30.
*/
static void AddHeap(Case *c, double gap)
{
  const double d = 0.6001, height = sqrt(2.0 / 3.0) * d, row = sqrt(0.75) * d;
  int          n = 0;

  for (int k = 0; n < HEAP; k++)
    for (int j = 0; j < 4; j++)
      for (int i = 0; i < 3 && n < HEAP; i++, n++)
        AddSphere(c, (i - 1) * d + (j % 2 ? 0.5 * d : 0.0) + (k % 2 ? 0.5 * d : 0.0), (j - 1.5) * row + (k % 2 ? row / 3.0 : -row / 3.0) * 0.5,
                  (k - 2.0) * height + (k > 2 ? gap : 0.0));
}

static void OpenCase(Case *c)
{
  Call(PetscOptionsClear(NULL));
  Call(DLMGridCreate(&c->scene, &c->grid));
  Call(DLMSpheresCreate(c->grid, &c->scene, &c->spheres));
  for (int i = 0; i < N; i++) c->points[i] = 16;
  c->layout.points = c->points;
}

static void CloseCase(Case *c)
{
  Call(DLMSpheresDestroy(&c->spheres));
  Call(DLMGridDestroy(&c->grid));
}

static const PetscInt heap_box[3] = { 32, 32, 40 }; /* 4 x 4 x 5 */

static void AddLone(Case *c)
{
  AddSphere(c, 1.65, 1.7, 0.0);
  AddSphere(c, 1.65, 1.7, 1.5);
  AddSphere(c, -1.7, -1.7, -1.5);
}

static double Gap(const Case *c, PetscInt i, PetscInt j)
{
  PetscReal d[3];

  Call(DLMSpheresSeparation(c->spheres, i, j, d));
  return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - c->spec[i].radius - c->spec[j].radius;
}

/* reached[j]: there is a path of near pairs from i to j (inside i's cluster, if clusters are given). Returns how many. */
static int Reach(const Case *c, PetscInt i, const PetscInt *cluster, char reached[N])
{
  int stack[N], top = 0, n = 0;

  memset(reached, 0, N);
  reached[i]   = 1;
  stack[top++] = (int)i;
  while (top > 0) {
    const int k = stack[--top];
    n++;
    for (int j = 0; j < c->scene.n_spheres; j++)
      if (!reached[j] && (!cluster || cluster[j] == cluster[k]) && Gap(c, k, j) < c->scene.saddle_cluster_gap * c->scene.h) {
        reached[j]   = 1;
        stack[top++] = j;
      }
  }
  return n;
}

static PetscInt FindClusters(Case *c, PetscInt cluster[N])
{
  PetscInt n;

  Call(DLMFindClusters(c->spheres, &c->scene, &c->layout, &n, cluster));
  return n;
}

static PetscInt Unknowns(const Case *c, const PetscInt *cluster, PetscInt k)
{
  PetscInt sum = 0;

  for (PetscInt i = 0; i < c->scene.n_spheres; i++) sum += cluster[i] == k ? 3 * c->points[i] : 0;
  return sum;
}

/* Without a limit a cluster is all that near pairs connect; clusters are numbered in the order of their first spheres. */
static void ClustersAreWhatNearPairsConnect(void **state)
{
  for (int k = 0; k < 2; k++) {
    PetscInt cluster[N], n, seen = 0;
    Case     c;
    StartCase(PETSC_COMM_WORLD, heap_box, 1000000, &c);
    AddHeap(&c, k ? 0.2 : 0.0);
    AddLone(&c);
    OpenCase(&c);
    n = FindClusters(&c, cluster);
    assert_int_equal(n, 1 + k + LONE);
    for (PetscInt i = 0; i < N; i++) {
      char reached[N];
      Reach(&c, i, NULL, reached);
      for (PetscInt j = 0; j < N; j++) assert_int_equal(reached[j], cluster[i] == cluster[j]);
      assert_true(cluster[i] <= seen);
      seen = PetscMax(seen, cluster[i] + 1);
    }
    for (PetscInt i = HEAP; i < N; i++) assert_int_equal(Unknowns(&c, cluster, cluster[i]), 48);
    CloseCase(&c);
  }
}

static void LargeClustersAreCut(void **state)
{
  const PetscInt limits[] = { 2879, 1500, 1000, 500, 200, 96, 48, 47, 1 };

  for (size_t k = 0; k < sizeof(limits) / sizeof(limits[0]); k++) {
    PetscInt cluster[N], n, most = 0, pieces = 0;
    Case     c;
    StartCase(PETSC_COMM_WORLD, heap_box, limits[k], &c);
    AddHeap(&c, 0.0);
    AddLone(&c);
    OpenCase(&c);
    n = FindClusters(&c, cluster);
    for (PetscInt q = 0; q < n; q++) {
      const PetscInt size = Unknowns(&c, cluster, q);
      assert_true(size >= 48);
      assert_true(size <= PetscMax(limits[k], 48));
      most = PetscMax(most, size);
    }
    for (PetscInt i = HEAP; i < N; i++) assert_int_equal(Unknowns(&c, cluster, cluster[i]), 48);
    for (PetscInt i = 0; i < HEAP; i++) {
      char reached[N];
      pieces += Reach(&c, i, cluster, reached) * 48 != Unknowns(&c, cluster, cluster[i]);
    }
    print_message("  limit %d: %d clusters, largest %d, %d spheres in unconnected parts\n", (int)limits[k], (int)n, (int)most, (int)pieces);
    assert_true(n - LONE >= (HEAP * 48 + limits[k] - 1) / PetscMax(limits[k], 48));
    if (limits[k] >= 96) assert_true(n - LONE <= 3 * ((HEAP * 48 + limits[k] - 1) / limits[k])); /* not cut to dust */
    CloseCase(&c);
  }
}

/* Spheres of unequal weight, one of them beyond the limit by itself. */
static void AHeavySphereStaysAlone(void **state)
{
  PetscInt cluster[N], n;
  Case     c;

  StartCase(PETSC_COMM_WORLD, heap_box, 300, &c);
  AddHeap(&c, 0.0);
  AddLone(&c);
  OpenCase(&c);
  c.points[31] = 150;
  n            = FindClusters(&c, cluster);
  for (PetscInt q = 0; q < n; q++) {
    const PetscInt size = Unknowns(&c, cluster, q);
    if (q == cluster[31]) assert_int_equal(size, 450);
    else if (size > 300) fail_msg("cluster %d has %d unknowns, limit 300", (int)q, (int)size);
  }
  CloseCase(&c);
}

static void EveryRankFindsTheSame(void **state)
{
  for (int k = 0; k < 2; k++) {
    PetscInt cluster[N], least[N], most[N], alone[N];
    Case     c, serial;
    StartCase(PETSC_COMM_WORLD, heap_box, k ? 500 : 100000, &c);
    StartCase(PETSC_COMM_SELF, heap_box, k ? 500 : 100000, &serial);
    AddHeap(&c, 0.0);
    AddLone(&c);
    AddHeap(&serial, 0.0);
    AddLone(&serial);
    OpenCase(&c);
    OpenCase(&serial);
    FindClusters(&c, cluster);
    FindClusters(&serial, alone);
    Call(MPI_Allreduce(cluster, least, N, MPIU_INT, MPI_MIN, PETSC_COMM_WORLD));
    Call(MPI_Allreduce(cluster, most, N, MPIU_INT, MPI_MAX, PETSC_COMM_WORLD));
    for (int i = 0; i < N; i++) {
      assert_int_equal(least[i], most[i]);
      assert_int_equal(cluster[i], alone[i]);
    }
    CloseCase(&serial);
    CloseCase(&c);
  }
}

static void ClustersReachAcrossPeriodicFaces(void **state)
{
  const PetscInt cells[3] = { 24, 16, 16 };
  PetscInt       cluster[N];
  Case           c;

  StartCase(PETSC_COMM_WORLD, cells, 4000, &c);
  AddSphere(&c, -1.3, 0.0, 0.0);
  AddSphere(&c, 0.0, 0.0, 0.0);
  AddSphere(&c, 1.08, 0.0, 0.0); /* gap 0.02 through the face */
  OpenCase(&c);
  assert_int_equal(FindClusters(&c, cluster), 2);
  assert_int_equal(cluster[0], cluster[2]);
  assert_int_not_equal(cluster[0], cluster[1]);
  CloseCase(&c);
}

/* The heap falls and is sheared; blocks of every size lead to the same motion. */
static void TheCutDoesNotChangeTheAnswer(void **state)
{
  const PetscInt  limits[] = { 100000, 700, 150 };
  PetscReal       force[3 * N], torque[3 * N] = { 0.0 };
  DLMSphereState *found[3], *states;
  DLMStokes       stokes;
  DLMGrid         grid;
  Case            c;

  for (int i = 0; i < N; i++)
    for (int d = 0; d < 3; d++) force[3 * i + d] = 0.2 * Hash(41, 3 * i + d) - (d == 2);
  StartCase(PETSC_COMM_WORLD, heap_box, 0, &c);
  Call(PetscOptionsClear(NULL));
  Call(DLMGridCreate(&c.scene, &grid));
  Call(DLMStokesCreate(grid, &c.scene, &stokes));
  for (int k = 0; k < 3; k++) {
    DLMPairing    pairing;
    DLMSaddle     saddle;
    DLMSaddleWork work;
    PetscReal     slip;
    double        difference = 0.0, largest = 0.0;
    StartCase(PETSC_COMM_WORLD, heap_box, limits[k], &c);
    AddHeap(&c, 0.0);
    AddLone(&c);
    c.scene.pairing_spacing = 1.4; /* as few points as the harmonics allow */
    Call(DLMSpheresCreate(grid, &c.scene, &c.spheres));
    Call(DLMPairingCreate(c.spheres, &c.scene, &pairing));
    Call(DLMSaddleCreate(stokes, c.spheres, pairing, &c.scene, &saddle));
    Call(DLMSaddleSolve(saddle, (DLMInertia){ 0.0, 0.0, 0.0 }, force, torque, NULL));
    Call(DLMSaddleGetWork(saddle, &work));
    Call(DLMSaddleGetSlip(saddle, &slip));
    Call(DLMSpheresGetStates(c.spheres, NULL, &states));
    Call(PetscMalloc1(N, &found[k]));
    Call(PetscArraycpy(found[k], states, N));
    for (int i = 0; i < N; i++)
      for (int d = 0; d < 3; d++) {
        difference = fmax(difference, fabs(found[k][i].velocity[d] - found[0][i].velocity[d]) + 0.3 * fabs(found[k][i].omega[d] - found[0][i].omega[d]));
        largest    = fmax(largest, fabs(found[0][i].velocity[d]));
      }
    print_message("  limit %d: %d blocks, %d iterations to 1e-9, slip %.1e, velocity up to %.3g, difference %.1e\n", (int)limits[k], (int)work.blocks_built, (int)work.last_iterations,
                  slip, largest, difference / largest);
    if (k == 0) AssertAtMost(work.last_iterations, 16); /* the whole heap in one block; 35 with tables that reach two spheres only */
    AssertAtMost(difference, 2e-9 * largest); /* a few times the tolerance: both would be 2e-8 if V and omega were those of the iteration */
    AssertAtMost(slip, 1e-9 * largest);
    Call(DLMSaddleDestroy(&saddle));
    Call(DLMPairingDestroy(&pairing));
    Call(DLMSpheresDestroy(&c.spheres));
  }
  for (int k = 0; k < 3; k++) Call(PetscFree(found[k]));
  Call(DLMStokesDestroy(&stokes));
  Call(DLMGridDestroy(&grid));
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(ClustersAreWhatNearPairsConnect),  cmocka_unit_test(LargeClustersAreCut),
  cmocka_unit_test(AHeavySphereStaysAlone),           cmocka_unit_test(EveryRankFindsTheSame),
  cmocka_unit_test(ClustersReachAcrossPeriodicFaces), cmocka_unit_test(TheCutDoesNotChangeTheAnswer),
};

RUN_ON_ALL_RANKS(tests)
