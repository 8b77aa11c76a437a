/* The spheres and their pairing with a velocity: adjoint, exact on linear fields, the same on every number of ranks. */
#include "dlmtest.h"
#include "private/spheresimpl.h"

static const PetscInt cells[3] = { 24, 20, 16 }; /* h = 0.125: a box of 3 x 2.5 x 2 */

/* Near walls, across periodic faces, on rank boundaries, overlapping (the last two); radius, then centre over box size. */
static const double spheres_at[][4] = {
  { 0.30, 0.0, 0.0, 0.0 },    { 0.25, 0.45, 0.1, 0.2 },   { 0.20, -0.3, 0.49, -0.3 },   { 0.26, 0.2, -0.3, 0.3675 },
  { 0.21, -0.2, -0.2, 0.47 }, { 0.28, -0.35, 0.2, 0.06 }, { 0.30, 0.2, 0.22, -0.26 },   { 0.30, 0.27, 0.26, -0.2 },
};

enum { N = sizeof(spheres_at) / sizeof(spheres_at[0]) };

typedef struct {
  DLMScene      scene;
  DLMSphereSpec spec[N];
  DLMGrid       grid;
  DLMSpheres    spheres;
  DLMPairing    pairing;
  PetscInt      n; /* points of this rank */
  const PetscReal *r;
  const PetscInt  *first;
} Case;

static void GetPoints(Case *c)
{
  Call(DLMPairingUpdate(c->pairing));
  Call(DLMPairingGetPoints(c->pairing, &c->n, &c->r, &c->first));
}

/* Spheres keep inside the walls of closed axes. */
static void SetScene(MPI_Comm comm, unsigned periodic, DLMPairingType type, DLMPointSet points, Case *c)
{
  MakeScene(comm, cells, periodic, &c->scene);
  c->scene.pairing_type   = type;
  c->scene.pairing_points = points;
  c->scene.n_spheres      = N;
  c->scene.spheres        = c->spec;
  memset(c->spec, 0, sizeof(c->spec));
  for (int i = 0; i < N; i++) {
    const double a = spheres_at[i][0];
    c->spec[i].radius  = a;
    c->spec[i].density = 1.0;
    for (int d = 0; d < 3; d++) {
      const double room = 0.5 * c->scene.box_size[d] - 1.0001 * a, x = spheres_at[i][1 + d] * c->scene.box_size[d];
      c->spec[i].center[d] = c->scene.box_periodic[d] ? x : fmax(-room, fmin(room, x));
    }
  }
}

static void Build(Case *c)
{
  Call(DLMGridCreate(&c->scene, &c->grid));
  Call(DLMSpheresCreate(c->grid, &c->scene, &c->spheres));
  Call(DLMPairingCreate(c->spheres, &c->scene, &c->pairing));
  GetPoints(c);
}

static void OpenCase(MPI_Comm comm, unsigned periodic, DLMPairingType type, DLMPointSet points, Case *c)
{
  SetScene(comm, periodic, type, points, c);
  Build(c);
}

static void CloseCase(Case *c)
{
  Call(DLMPairingDestroy(&c->pairing));
  Call(DLMSpheresDestroy(&c->spheres));
  Call(DLMGridDestroy(&c->grid));
}

static void ForEveryCase(void (*test)(Case *, unsigned))
{
  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (int k = 0; k < 4; k++) {
      Case c;
      OpenCase(PETSC_COMM_WORLD, periodic, (DLMPairingType)(k & 1), (DLMPointSet)(k >> 1), &c);
      test(&c, periodic);
      CloseCase(&c);
    }
}

static void CheckAdjoint(Case *c, unsigned periodic)
{
  PetscScalar *ju, *mu, sum = 0.0, dot;
  PetscReal    norm_u, squares = 0.0;
  Vec          u, f;

  Call(PetscMalloc2(3 * c->n, &ju, 3 * c->n, &mu));
  Call(DMCreateGlobalVector(c->grid->velocity, &u));
  Call(VecDuplicate(u, &f));
  FillRandom(c->grid, c->grid->velocity, 1, 1, u);
  Call(DLMPairingInterpolate(c->pairing, u, ju));
  for (PetscInt k = 0; k < c->spheres->n_owned; k++)
    for (PetscInt i = 3 * c->first[k]; i < 3 * c->first[k + 1]; i++) {
      mu[i] = Hash(3, (uint64_t)(100000 * c->spheres->owned[k] + i - 3 * c->first[k]));
      sum += mu[i] * ju[i];
      squares += mu[i] * mu[i];
    }
  Call(DLMPairingSpread(c->pairing, -0.5, mu, f));
  Call(VecDot(u, f, &dot));
  Call(VecNorm(u, NORM_2, &norm_u));
  dot *= -2.0; /* the scale was -1/2 */
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  MPI_Allreduce(MPI_IN_PLACE, &squares, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  AssertAll(fabs(dot) > 1e-6 * norm_u * sqrt(squares));
  AssertAtMost(fabs(sum - dot) / (norm_u * sqrt(squares)), 1e-15);
  Call(PetscFree2(ju, mu));
  for (Vec *v = (Vec[]){ u, f, NULL }; *v; v++) Call(VecDestroy(v));
}

static void InterpolationAndSpreadingAreAdjoint(void **state)
{
  ForEveryCase(CheckAdjoint);
}

/* Spreading adds to what is there, gives wall nodes nothing, and conserves the force of points far from walls. */
static void CheckSpread(Case *c, unsigned periodic)
{
  PetscScalar *lambda;
  PetscReal    force[3], sum[3] = { 0.0, 0.0, 0.0 };
  Vec          f, walls;

  Call(PetscCalloc1(3 * c->n, &lambda));
  for (PetscInt k = 0; k < c->spheres->n_owned; k++)
    if (c->spheres->owned[k] == 0) /* the sphere in the middle of the box */
      for (PetscInt i = 3 * c->first[k]; i < 3 * c->first[k + 1]; i++) sum[i % 3] += lambda[i] = 1.0 + Hash(4, i - 3 * c->first[k]);
  Call(DMCreateGlobalVector(c->grid->velocity, &f));
  Call(VecSet(f, 2.0));
  Call(DLMPairingSpread(c->pairing, 1.0, lambda, f));
  Call(VecDuplicate(f, &walls));
  Call(VecShift(f, -2.0));
  Call(VecStrideSumAll(f, force));
  MPI_Allreduce(MPI_IN_PLACE, sum, 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  for (int d = 0; d < 3; d++) AssertAtMost(fabs(force[d] - sum[d]) / sum[d], 1e-11);
  for (PetscInt i = 0; i < 3 * c->n; i++) lambda[i] = 1.0;
  Call(VecSet(f, 0.0));
  Call(DLMPairingSpread(c->pairing, 1.0, lambda, f));
  FillNodes(c->grid->velocity, RandomValue, &(RandomField){ c->grid, 1, 1 }, walls);
  Call(VecPointwiseDivide(walls, walls, walls)); /* 1 inside, 0/0 = 0 on the walls in PETSc */
  Call(VecPointwiseMult(walls, walls, f));
  Call(VecAXPY(f, -1.0, walls));
  Call(VecNorm(f, NORM_INFINITY, &force[0]));
  AssertAtMost(force[0], 0.0);
  Call(PetscFree(lambda));
  for (Vec *v = (Vec[]){ walls, f, NULL }; *v; v++) Call(VecDestroy(v));
}

static void SpreadingAddsAndSparesTheWalls(void **state)
{
  ForEveryCase(CheckSpread);
}

/* u = V + G x with x from the middle of the box; G only along closed axes, where the field is one-valued. */
static const double V[3] = { 0.3, -0.7, 0.4 }, G[3][3] = { { 0.5, 1.0, -2.0 }, { -1.0, 0.2, 3.0 }, { 2.0, -3.0, -0.6 } };

static double LinearAt(DLMGrid grid, const double x[3], int component)
{
  double u = V[component];
  for (int d = 0; d < 3; d++) u += grid->periodic[d] ? 0.0 : G[component][d] * x[d];
  return u;
}

static double LinearValue(const PetscInt i[3], int component, const void *context)
{
  DLMGrid grid = (DLMGrid)context;
  double  x[3];
  for (int d = 0; d < 3; d++) x[d] = grid->lower[d] + i[d] * grid->h;
  return LinearAt(grid, x, component);
}

/* Rigid motion and shear included: with all axes closed G is full. */
static void CheckLinear(Case *c, unsigned periodic)
{
  double       worst = 0.0;
  PetscScalar *ju;
  Vec          u;

  Call(PetscMalloc1(3 * c->n, &ju));
  Call(DMCreateGlobalVector(c->grid->velocity, &u));
  FillNodes(c->grid->velocity, LinearValue, c->grid, u);
  Call(DLMPairingInterpolate(c->pairing, u, ju));
  for (PetscInt k = 0; k < c->spheres->n_owned; k++)
    for (PetscInt i = c->first[k]; i < c->first[k + 1]; i++) {
      double x[3];
      for (int d = 0; d < 3; d++) x[d] = c->spheres->state[c->spheres->owned[k]].center[d] + c->r[3 * i + d];
      for (int d = 0; d < 3; d++) worst = fmax(worst, fabs(ju[3 * i + d] - LinearAt(c->grid, x, d)));
    }
  AssertAtMost(worst, 1e-13);
  Call(PetscFree(ju));
  Call(VecDestroy(&u));
}

static void LinearFieldsAreExactAtThePoints(void **state)
{
  ForEveryCase(CheckLinear);
}

/* Points and J of a random field against those on one rank. shift: periods added to every centre. */
static void CompareWithOneRank(Case *c, unsigned periodic, const PetscInt shift[3])
{
  Case         serial;
  Vec          u, v;
  PetscScalar *ju, *jv;
  double       worst = 0.0;

  OpenCase(PETSC_COMM_SELF, periodic, c->scene.pairing_type, c->scene.pairing_points, &serial);
  for (int i = 0; i < N; i++)
    for (int d = 0; d < 3; d++)
      if (c->scene.box_periodic[d]) c->spheres->state[i].center[d] = serial.spheres->state[i].center[d] + shift[d] * c->scene.box_size[d];
  GetPoints(c);
  Call(PetscMalloc2(3 * c->n, &ju, 3 * serial.n, &jv));
  Call(DMCreateGlobalVector(c->grid->velocity, &u));
  Call(DMCreateGlobalVector(serial.grid->velocity, &v));
  FillRandom(c->grid, c->grid->velocity, 1, 0, u);
  FillRandom(serial.grid, serial.grid->velocity, 1, 0, v);
  Call(DLMPairingInterpolate(c->pairing, u, ju));
  Call(DLMPairingInterpolate(serial.pairing, v, jv));
  for (PetscInt k = 0; k < c->spheres->n_owned; k++) {
    const PetscInt s = c->spheres->owned[k], n = c->first[k + 1] - c->first[k], at = serial.first[s];
    if (n != serial.first[s + 1] - at) worst = 1.0;
    for (PetscInt i = 0; i < 3 * n && worst < 1.0; i++) {
      worst = fmax(worst, fabs(c->r[3 * c->first[k] + i] - serial.r[3 * at + i]));
      worst = fmax(worst, fabs(ju[3 * c->first[k] + i] - jv[3 * at + i]));
    }
  }
  AssertAtMost(worst, 1e-12);
  Call(PetscFree2(ju, jv));
  for (Vec *w = (Vec[]){ u, v, NULL }; *w; w++) Call(VecDestroy(w));
  CloseCase(&serial);
}

static void CheckOneRank(Case *c, unsigned periodic)
{
  CompareWithOneRank(c, periodic, (PetscInt[3]){ 0, 0, 0 });
}

static void CheckUnwrapped(Case *c, unsigned periodic)
{
  CompareWithOneRank(c, periodic, (PetscInt[3]){ 3, -2, 1 });
}

static void AnyNumberOfRanksGivesTheSameValues(void **state)
{
  ForEveryCase(CheckOneRank);
}

static void UnwrappedCentresGiveTheSameValues(void **state)
{
  ForEveryCase(CheckUnwrapped);
}

/* Harmonics as multipliers: Q^T after Q is the identity, the two are adjoint, and rigid motions are kept. */
static void HarmonicsKeepRigidMotions(void **state)
{
  const PetscInt *first;
  PetscScalar    *m, *p, *back, sum[2] = { 0.0, 0.0 };
  double          worst = 0.0;
  PetscInt        n;
  Case            c;

  SetScene(PETSC_COMM_WORLD, 3, DLM_PAIRING_IMMERSED, DLM_POINTS_VOLUME, &c);
  c.scene.pairing_degree = 3;
  Build(&c);
  Call(DLMPairingGetMultipliers(c.pairing, &n, &first));
  AssertAll(n < c.n || c.spheres->n_owned == 0);
  Call(PetscMalloc3(3 * n, &m, 3 * c.n, &p, 3 * PetscMax(n, c.n), &back));
  for (PetscInt i = 0; i < 3 * n; i++) m[i] = Hash(8, i);
  Call(DLMPairingExpand(c.pairing, m, p));
  Call(DLMPairingProject(c.pairing, p, back));
  for (PetscInt i = 0; i < 3 * n; i++) worst = fmax(worst, fabs(back[i] - m[i]));
  AssertAtMost(worst, 1e-12);
  for (PetscInt i = 0; i < 3 * c.n; i++) sum[0] += p[i] * Hash(9, i);
  for (PetscInt i = 0; i < 3 * c.n; i++) p[i] = Hash(9, i);
  Call(DLMPairingProject(c.pairing, p, back));
  for (PetscInt i = 0; i < 3 * n; i++) sum[1] += back[i] * m[i];
  AssertAtMost(fabs(sum[0] - sum[1]), 1e-10);
  for (PetscInt i = 0; i < c.n; i++)
    for (int d = 0; d < 3; d++) p[3 * i + d] = V[d] + c.r[3 * i + (d + 1) % 3] * G[0][(d + 2) % 3] - c.r[3 * i + (d + 2) % 3] * G[0][(d + 1) % 3];
  Call(DLMPairingProject(c.pairing, p, m));
  Call(DLMPairingExpand(c.pairing, m, back));
  for (PetscInt i = 0; i < 3 * c.n; i++) worst = fmax(worst, fabs(back[i] - p[i]));
  AssertAtMost(worst, 1e-12);
  Call(PetscFree3(m, p, back));
  CloseCase(&c);
}

/* A traction like omega x r slips by the torque's compliance, one like E r by the stresslet's, a uniform or radial one not at all. */
static void TurningAndStrainingSlipByCompliancesOfTheirOwn(void **state)
{
  enum { UNIFORM, RADIAL, TURN, STRAIN, FIELDS };
  const double    gradient[FIELDS][3][3] = { [RADIAL] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } },
                                             [TURN]   = { { 0, -0.3, 0.2 }, { 0.3, 0, -0.7 }, { -0.2, 0.7, 0 } },
                                             [STRAIN] = { { 0.5, 0.1, -0.4 }, { 0.1, 0.3, 0.6 }, { -0.4, 0.6, -0.8 } } };
  const DLMCover  cover        = { .degree = 3, .compliance = 5.0, .spin_compliance = 2.0, .strain_compliance = 3.0 };
  const double    slip[FIELDS] = { [TURN] = cover.spin_compliance, [STRAIN] = cover.strain_compliance };
  const PetscInt *first;
  PetscReal      *p, *m, *y, *out;
  PetscInt        n;
  Case            c;

  SetScene(PETSC_COMM_SELF, 1, DLM_PAIRING_IMMERSED, DLM_POINTS_SURFACE, &c);
  c.scene.pairing_degree = 3;
  Build(&c);
  Call(DLMPairingGetMultipliers(c.pairing, &n, &first));
  Call(PetscMalloc4(3 * c.n, &p, 3 * n, &m, 3 * n, &y, 3 * c.n, &out));
  for (int f = 0; f < FIELDS; f++) {
    double worst = 0.0;
    for (PetscInt i = 0; i < c.n; i++)
      for (int d = 0; d < 3; d++) {
        p[3 * i + d] = f == UNIFORM ? V[d] : 0.0;
        for (int e = 0; e < 3; e++) p[3 * i + d] += gradient[f][d][e] * c.r[3 * i + e];
      }
    Call(DLMPairingProject(c.pairing, p, m));
    Call(PetscArrayzero(y, 3 * n));
    for (PetscInt k = 0; k < c.spheres->n_owned; k++) DLMCoverComply(&cover, -1.0, m + 3 * first[k], y + 3 * first[k]);
    Call(DLMPairingExpand(c.pairing, y, out));
    for (PetscInt i = 0; i < 3 * c.n; i++) worst = fmax(worst, fabs(out[i] + slip[f] * p[i]));
    AssertAtMost(worst, 1e-12);
  }
  Call(PetscFree4(p, m, y, out));
  CloseCase(&c);
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(InterpolationAndSpreadingAreAdjoint),
  cmocka_unit_test(SpreadingAddsAndSparesTheWalls),
  cmocka_unit_test(LinearFieldsAreExactAtThePoints),
  cmocka_unit_test(AnyNumberOfRanksGivesTheSameValues),
  cmocka_unit_test(UnwrappedCentresGiveTheSameValues),
  cmocka_unit_test(HarmonicsKeepRigidMotions),
  cmocka_unit_test(TurningAndStrainingSlipByCompliancesOfTheirOwn),
};

RUN_ON_ALL_RANKS(tests)
