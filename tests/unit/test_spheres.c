/* Ownership of spheres and of the nodes in them, pairs and gaps against brute force. */
#include "dlmtest.h"
#include "private/spheresimpl.h"

enum { MOST = 300 };

static const PetscInt cells[3] = { 24, 20, 16 }; /* h = 0.125: a box of 3 x 2.5 x 2 */

typedef struct {
  DLMScene      scene;
  DLMSphereSpec spec[MOST];
  DLMGrid       grid;
  DLMSpheres    spheres;
} Case;

static void SetSphere(Case *c, int i, double radius, double x1, double x2, double x3)
{
  c->spec[i] = (DLMSphereSpec){ .center = { x1, x2, x3 }, .radius = radius, .density = 1.0, .motion = DLM_MOTION_FREE };
}

static void StartCase(unsigned periodic, PetscInt n, Case *c)
{
  MakeScene(PETSC_COMM_WORLD, cells, periodic, &c->scene);
  c->scene.n_spheres = n;
  c->scene.spheres   = c->spec;
}

static void OpenCase(Case *c)
{
  Call(DLMGridCreate(&c->scene, &c->grid));
  Call(DLMSpheresCreate(c->grid, &c->scene, &c->spheres));
}

static void CloseCase(Case *c)
{
  Call(DLMSpheresDestroy(&c->spheres));
  Call(DLMGridDestroy(&c->grid));
}

/* n spheres of radius 0.02 to 0.08 anywhere in the box, some of them some periods away. */
static void OpenRandom(unsigned periodic, PetscInt n, Case *c)
{
  StartCase(periodic, n, c);
  for (int i = 0; i < n; i++) {
    SetSphere(c, i, 0.05 + 0.03 * Hash(1, i), 0, 0, 0);
    for (int d = 0; d < 3; d++) {
      c->spec[i].center[d] = (0.5 * c->scene.box_size[d] - c->spec[i].radius) * Hash(2, 3 * i + d);
      if (c->scene.box_periodic[d]) c->spec[i].center[d] += c->scene.box_size[d] * ((i + d) % 4 - 1);
    }
  }
  OpenCase(c);
}

/* Smallest distance of the centres over all images, axis by axis. */
static double Distance(const Case *c, PetscInt i, PetscInt j)
{
  double r2 = 0.0;

  for (int d = 0; d < 3; d++) {
    const double x     = c->spheres->state[j].center[d] - c->spheres->state[i].center[d];
    double       least = fabs(x);
    for (int shift = -5; shift <= 5 && c->scene.box_periodic[d]; shift++) least = fmin(least, fabs(x + shift * c->scene.box_size[d]));
    r2 += least * least;
  }
  return sqrt(r2);
}

static void PairsEqualBruteForce(void **state)
{
  static char near[MOST][MOST];

  for (unsigned periodic = 0; periodic < 8; periodic++) {
    Case c;
    OpenRandom(periodic, MOST, &c);
    for (int k = 0; k < 3; k++) {
      const double gap = (double[3]){ 0.0, 0.07, 0.9 }[k];
      PetscInt     n, *pairs, expected = 0;
      Call(DLMSpheresFindPairs(c.spheres, gap, &n, &pairs));
      memset(near, 0, sizeof(near));
      for (PetscInt p = 0; p < n; p++) {
        assert_true(pairs[2 * p] < pairs[2 * p + 1]);
        assert_int_equal(near[pairs[2 * p]][pairs[2 * p + 1]]++, 0);
      }
      for (PetscInt i = 0; i < MOST; i++)
        for (PetscInt j = i + 1; j < MOST; j++) {
          const int meet = Distance(&c, i, j) - c.spec[i].radius - c.spec[j].radius < gap;
          assert_int_equal(near[i][j], meet);
          expected += meet;
        }
      assert_int_equal(n, expected);
      assert_true(n > 0);
      Call(PetscFree(pairs));
    }
    CloseCase(&c);
  }
}

static void SeparationIsTheNearestImage(void **state)
{
  for (unsigned periodic = 0; periodic < 8; periodic++) {
    Case c;
    OpenRandom(periodic, 40, &c);
    for (PetscInt i = 0; i < 40; i++)
      for (PetscInt j = 0; j < 40; j++) {
        PetscReal d[3], back[3];
        Call(DLMSpheresSeparation(c.spheres, i, j, d));
        Call(DLMSpheresSeparation(c.spheres, j, i, back));
        AssertNear(sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), Distance(&c, i, j), 1e-13);
        for (int k = 0; k < 3; k++) {
          const double turns = (c.spheres->state[j].center[k] - c.spheres->state[i].center[k] - d[k]) / c.scene.box_size[k];
          AssertNear(d[k], -back[k], 1e-13);
          AssertNear(turns, c.scene.box_periodic[k] ? round(turns) : 0.0, 1e-13);
        }
      }
    CloseCase(&c);
  }
}

static void SmallestGapEqualsBruteForce(void **state)
{
  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (PetscInt n = 1; n <= 40; n += 13) {
      Case      c;
      double    expected = INFINITY;
      PetscReal gap;
      OpenRandom(periodic, n, &c);
      for (PetscInt i = 0; i < n; i++) {
        for (PetscInt j = 0; j < i; j++) expected = fmin(expected, Distance(&c, i, j) - c.spec[i].radius - c.spec[j].radius);
        for (int d = 0; d < 3; d++)
          if (!c.scene.box_periodic[d]) expected = fmin(expected, 0.5 * c.scene.box_size[d] - fabs(c.spec[i].center[d]) - c.spec[i].radius);
      }
      Call(DLMSpheresGetSmallestGap(c.spheres, &gap));
      if (expected < 1e300) AssertNear(gap, expected, 1e-13);
      else assert_true(gap >= PETSC_MAX_REAL / 4); /* PETSc's infinity: nothing to be near to */
      CloseCase(&c);
    }
}

/* Two far spheres in a long periodic box: the gap is half the box, whatever their radius. */
static void TheSmallestGapMayBeLarge(void **state)
{
  const PetscInt tall[3] = { 8, 8, 160 };

  for (int i = 0; i < 20; i++) {
    Case      c = { .scene = { 0 } };
    PetscReal gap;
    MakeScene(PETSC_COMM_WORLD, tall, 7, &c.scene);
    c.scene.n_spheres = 2;
    c.scene.spheres   = c.spec;
    for (int k = 0; k < 2; k++) SetSphere(&c, k, 0.1 + 0.01 * i, 0, 0, k ? 5.0 : -5.0);
    OpenCase(&c);
    Call(DLMSpheresGetSmallestGap(c.spheres, &gap));
    AssertNear(gap, 9.8 - 0.02 * i, 1e-12);
    CloseCase(&c);
  }
}

/* Every sphere has one owner: the rank whose part of the velocity DMDA holds the node at or below its centre. */
static void CheckOwners(Case *c, DLMPairing pairing)
{
  PetscInt        start[3], width[3], n, total, wrong = 0;
  const PetscInt *owned;

  Call(DLMPairingUpdate(pairing));
  Call(DLMSpheresGetOwned(c->spheres, &n, &owned));
  Call(DMDAGetCorners(c->grid->velocity, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  for (PetscInt k = 0; k < n; k++) {
    PetscReal x[3];
    wrong += k > 0 && owned[k] <= owned[k - 1];
    Call(DLMSpheresGetWrapped(c->spheres, owned[k], x));
    for (int d = 0; d < 3; d++) {
      const PetscInt node = (PetscInt)floor((x[d] + 0.5 * c->scene.box_size[d]) / c->scene.h);
      wrong += x[d] < -0.5 * c->scene.box_size[d] || x[d] >= 0.5 * c->scene.box_size[d] || node < start[d] || node >= start[d] + width[d];
    }
  }
  AssertAll(wrong == 0);
  MPI_Allreduce(&n, &total, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
  AssertAll(total == c->scene.n_spheres);
}

/* Spheres wander through the box and around it; on several ranks the owner must change on the way. */
static void OwnersFollowTheCentres(void **state)
{
  for (unsigned periodic = 0; periodic < 8; periodic += 7)
    for (int layout = 0;; layout++) {
      Case       c;
      DLMPairing pairing;
      PetscInt   changes = 0;
      StartCase(periodic, 6, &c);
      if (!Layout(layout, c.scene.grid_processes)) break;
      for (int i = 0; i < 6; i++) SetSphere(&c, i, 0.2, 0.2 * i - 0.5, 0.1 * i - 0.3, 0.25 - 0.1 * i);
      OpenCase(&c);
      Call(DLMPairingCreate(c.spheres, &c.scene, &pairing));
      CheckOwners(&c, pairing);
      for (int step = 0; step < 25; step++) {
        const PetscMPIInt before = c.spheres->owner[0];
        for (int i = 0; i < 6; i++)
          for (int d = 0; d < 3; d++) {
            const double room = 0.5 * c.scene.box_size[d] - 0.201, x = c.spheres->state[i].center[d] + (d ? -0.23 : 0.31);
            c.spheres->state[i].center[d] = periodic ? x : (x > room ? -room : (x < -room ? room : x));
          }
        CheckOwners(&c, pairing);
        changes += c.spheres->owner[0] != before;
      }
      AssertAll((changes > 0) == (c.scene.grid_processes[0] * c.scene.grid_processes[1] * c.scene.grid_processes[2] > 1));
      Call(DLMPairingDestroy(&pairing));
      CloseCase(&c);
    }
}

/* Two spheres of a size overlap: each inner node of either is a point of the nearer, once; no node is lost. */
static void ANodeInTwoSpheresBelongsToTheNearer(void **state)
{
  const double     h = 0.125, inner = 0.5 - 0.5 * h;
  Case             c;
  DLMPairing       pairing;
  PetscInt         nodes = 24 * 20 * 16, wrong = 0, shared = 0, n_owned, *owner;
  const PetscReal *r;
  const PetscInt  *first, *owned;

  StartCase(7, 2, &c);
  c.scene.pairing_points = DLM_POINTS_VOLUME;
  SetSphere(&c, 0, 0.5, 1.3, 0.03, 0.95); /* overlapping across periodic faces */
  SetSphere(&c, 1, 0.5, -1.25, 0.11, -0.9);
  OpenCase(&c);
  Call(DLMPairingCreate(c.spheres, &c.scene, &pairing));
  Call(DLMPairingUpdate(pairing));
  Call(DLMPairingGetPoints(pairing, NULL, &r, &first));
  Call(DLMSpheresGetOwned(c.spheres, &n_owned, &owned));
  Call(PetscCalloc1(nodes, &owner));
  for (PetscInt k = 0; k < n_owned; k++)
    for (PetscInt i = first[k]; i < first[k + 1]; i++) {
      PetscInt node[3], on_node = 1;
      for (int d = 0; d < 3; d++) {
        const double x = (c.spheres->state[owned[k]].center[d] + r[3 * i + d] + 0.5 * c.scene.box_size[d]) / h;
        node[d]        = ((PetscInt)round(x) + cells[d]) % cells[d];
        on_node        = on_node && fabs(x - round(x)) < 1e-9;
      }
      if (on_node) owner[node[0] + 24 * (node[1] + 20 * node[2])] += owned[k] == 0 ? 1 : 1000;
    }
  MPI_Allreduce(MPI_IN_PLACE, owner, (int)nodes, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
  for (PetscInt at = 0; at < nodes; at++) {
    const PetscInt node[3] = { at % 24, (at / 24) % 20, at / 480 };
    double         r2[2]   = { 0.0, 0.0 };
    for (int s = 0; s < 2; s++)
      for (int d = 0; d < 3; d++) {
        const double x = node[d] * h - 0.5 * c.scene.box_size[d] - c.spec[s].center[d];
        r2[s] += pow(x - c.scene.box_size[d] * round(x / c.scene.box_size[d]), 2);
      }
    shared += fmax(r2[0], r2[1]) <= inner * inner;
    wrong += owner[at] != (fmin(r2[0], r2[1]) > inner * inner ? 0 : (r2[0] < r2[1] ? 1 : 1000));
  }
  assert_true(shared > 20);
  assert_int_equal(wrong, 0);
  Call(PetscFree(owner));
  Call(DLMPairingDestroy(&pairing));
  CloseCase(&c);
}

/* One number of each thing that is shared. */
static PetscReal *Shared(const Case *c, PetscInt i, PetscInt q)
{
  DLMSphereState *s = &c->spheres->state[i];
  return (PetscReal *[6]){ &s->velocity[0], &s->omega[2], &s->omega_before[1], &s->force[1], &s->torque[0], &s->stresslet[5] }[q];
}

/* What owners computed reaches every rank; centres stay as they are. */
static void SharingSpreadsWhatOwnersComputed(void **state)
{
  Case           c;
  DLMPairing     pairing;
  PetscMPIInt    rank;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  OpenRandom(3, 30, &c);
  Call(DLMPairingCreate(c.spheres, &c.scene, &pairing));
  Call(DLMPairingUpdate(pairing));
  for (PetscInt i = 0; i < 30; i++)
    for (PetscInt q = 0; q < 6; q++) *Shared(&c, i, q) = c.spheres->owner[i] == rank ? Hash(6, 10 * i + q) : -7.0 - rank;
  Call(DLMSpheresShare(c.spheres));
  for (PetscInt i = 0; i < 30; i++) {
    for (PetscInt q = 0; q < 6; q++) AssertNear(*Shared(&c, i, q), Hash(6, 10 * i + q), 0.0);
    for (int d = 0; d < 3; d++) AssertNear(c.spheres->state[i].center[d], c.spec[i].center[d], 0.0);
  }
  Call(DLMPairingDestroy(&pairing));
  CloseCase(&c);
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(PairsEqualBruteForce),
  cmocka_unit_test(SeparationIsTheNearestImage),
  cmocka_unit_test(SmallestGapEqualsBruteForce),
  cmocka_unit_test(TheSmallestGapMayBeLarge),
  cmocka_unit_test(OwnersFollowTheCentres),
  cmocka_unit_test(ANodeInTwoSpheresBelongsToTheNearer),
  cmocka_unit_test(SharingSpreadsWhatOwnersComputed),
};

RUN_ON_ALL_RANKS(tests)
