/* Half of a box that is its own mirror image in x2 = 0: the same flow as in the whole box with the same divergence. */
#include "dlmtest.h"
#include "private/response.h"

/* Both boxes of one scene. */
typedef struct {
  StokesCase half, whole;
} Pair;

static void OpenPair(const PetscInt cells[3], unsigned periodic, const PetscInt processes[3], Pair *pair)
{
  for (int k = 0; k < 2; k++) {
    StokesCase *c = k ? &pair->whole : &pair->half;
    MakeScene(PETSC_COMM_WORLD, cells, periodic, &c->scene);
    c->scene.box_mirror = k ? DLM_MIRROR_WHOLE : DLM_MIRROR_HALF;
    for (int d = 0; d < 3; d++) {
      c->scene.grid_processes[d] = processes[d];
      for (int side = 0; side < 2 && !c->scene.box_periodic[d]; side++) c->scene.wall_velocity[d][side][2 - d] = side ? 0.7 : -0.3;
    }
    CreateStokes("", c);
  }
}

static void ClosePair(Pair *pair)
{
  DestroyStokes(&pair->half);
  DestroyStokes(&pair->whole);
}

/* A random field that is its own mirror image: of a node's distance from x2 = 0, whichever box holds it. */
typedef struct {
  DLMGrid         grid;
  unsigned        seed;
  PetscInt        cells; /* of the whole axis, on this mesh */
  const PetscReal *sign;
} Symmetric;

static double SymmetricValue(const PetscInt i[3], int component, const void *context)
{
  const Symmetric *s = context;
  const PetscInt   j = i[1] - (s->grid->half ? 0 : s->cells / 2), distance = PetscAbsInt(j);
  const double     value = Hash(s->seed, (uint64_t)(component + 3 * (i[0] + 1000 * (distance + 1000 * i[2]))));

  if (s->sign[component] < 0.0) return distance == 0 || distance == s->cells / 2 ? 0.0 : (j < 0 ? -value : value);
  return value;
}

static void FillSymmetric(const StokesCase *c, DM dm, unsigned seed, Vec v)
{
  const PetscBool vector = (PetscBool)(dm == c->grid->velocity);

  FillNodes(dm, SymmetricValue, &(Symmetric){ c->grid, seed, c->scene.cells[1] / (vector ? 1 : 2), vector ? DLMMirrorVector : DLMMirrorScalar }, v);
}

/* Largest difference of a field on the nodes of the half, over the largest value. */
static double HalfDifference(DM half_dm, Vec half, DM whole_dm, Vec whole)
{
  PetscInt n, nodes[3], all, dof;
  double  *x, *y, difference = 0.0, largest = 0.0;

  GatherNatural(half_dm, half, &n, &x);
  GatherNatural(whole_dm, whole, &n, &y);
  Call(DMDAGetInfo(half_dm, NULL, &nodes[0], &nodes[1], &nodes[2], NULL, NULL, NULL, &dof, NULL, NULL, NULL, NULL, NULL));
  Call(DMDAGetInfo(whole_dm, NULL, NULL, &all, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL));
  for (PetscInt k = 0; k < nodes[2]; k++)
    for (PetscInt j = 0; j < nodes[1]; j++)
      for (PetscInt i = 0; i < dof * nodes[0]; i++) {
        const double value = y[i + dof * nodes[0] * ((j + all / 2) % all + all * k)];
        difference         = fmax(difference, fabs(x[i + dof * nodes[0] * (j + nodes[1] * k)] - value));
        largest            = fmax(largest, fabs(value));
      }
  Call(PetscFree(x));
  Call(PetscFree(y));
  return difference / largest;
}

static Vec NewSymmetric(const StokesCase *c)
{
  Vec x, u, p;

  Call(DLMStokesCreateVec(c->stokes, &x));
  Call(DLMStokesGetParts(c->stokes, x, &u, &p));
  FillSymmetric(c, c->grid->velocity, 1, u);
  FillSymmetric(c, c->grid->pressure, 2, p);
  Call(DLMStokesRestoreParts(c->stokes, x, &u, &p));
  return x;
}

static void AssertSame(const Pair *pair, Vec half, Vec whole, double tolerance)
{
  Vec u[2], p[2];

  Call(DLMStokesGetParts(pair->half.stokes, half, &u[0], &p[0]));
  Call(DLMStokesGetParts(pair->whole.stokes, whole, &u[1], &p[1]));
  AssertAtMost(HalfDifference(pair->half.grid->velocity, u[0], pair->whole.grid->velocity, u[1]), tolerance);
  AssertAtMost(HalfDifference(pair->half.grid->pressure, p[0], pair->whole.grid->pressure, p[1]), tolerance);
  Call(DLMStokesRestoreParts(pair->whole.stokes, whole, &u[1], &p[1]));
  Call(DLMStokesRestoreParts(pair->half.stokes, half, &u[0], &p[0]));
}

static void CheckPair(const PetscInt cells[3], unsigned periodic, const PetscInt processes[3])
{
  Pair pair;
  Vec  b[2], x[2], wall[2], u, p, flux[2];

  OpenPair(cells, periodic, processes, &pair);
  for (int k = 0; k < 2; k++) {
    const StokesCase *c = k ? &pair.whole : &pair.half;
    b[k]                = NewSymmetric(c);
    x[k]                = NewSolution(c, b[k]);
    Call(DLMStokesGetWallForce(c->stokes, &wall[k]));
    Call(DLMStokesGetParts(c->stokes, b[k], &u, &p));
    Call(VecDuplicate(p, &flux[k]));
    Call(MatMult(c->B, u, flux[k]));
    Call(DLMStokesRestoreParts(c->stokes, b[k], &u, &p));
  }
  AssertSame(&pair, x[0], x[1], 1e-11);
  if (periodic != 7) AssertSame(&pair, wall[0], wall[1], 1e-13);
  AssertAtMost(HalfDifference(pair.half.grid->pressure, flux[0], pair.whole.grid->pressure, flux[1]), 1e-13);
  for (int k = 0; k < 2; k++) {
    Call(VecDestroy(&b[k]));
    Call(VecDestroy(&x[k]));
    Call(VecDestroy(&flux[k]));
  }
  ClosePair(&pair);
}

static void HalfFlowsAsTheWhole(void **state)
{
  const PetscInt cells[4][3] = { { 16, 32, 20 }, { 16, 40, 16 }, { 20, 32, 16 }, { 18, 36, 16 } }; /* the last: an odd number of pressure cells between the mirrors */
  const unsigned periodic[4] = { 3, 7, 6, 3 };
  PetscInt       processes[3];

  for (int k = 0; k < 4; k++)
    for (int layout = 0; Layout(layout, processes); layout++) CheckPair(cells[k], periodic[k], processes);
}

static void GhostsAreImages(void **state)
{
  PetscInt processes[3];

  for (int layout = 0; Layout(layout, processes); layout++) {
    Pair     pair;
    DLMGrid  grid;
    Vec      u, local;
    PetscInt start[3], width[3], images = 0;
    double   worst = 0.0, ****x;
    OpenPair((PetscInt[3]){ 16, 40, 16 }, 3, processes, &pair);
    grid = pair.half.grid;
    Call(DMCreateGlobalVector(grid->velocity, &u));
    Call(DMCreateLocalVector(grid->velocity, &local));
    FillSymmetric(&pair.half, grid->velocity, 3, u);
    Call(DLMGridGlobalToLocal(grid, grid->velocity, DLMMirrorVector, u, local));
    Call(DMDAGetGhostCorners(grid->velocity, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
    Call(DMDAVecGetArrayDOFRead(grid->velocity, local, &x));
    for (PetscInt k = start[2]; k < start[2] + width[2]; k++)
      for (PetscInt j = start[1]; j < start[1] + width[1]; j++)
        for (PetscInt i = start[0]; i < start[0] + width[0]; i++)
          for (int c = 0; c < 3; c++) {
            PetscBool      image;
            const PetscInt fold    = DLMGridFold(grid, 1, grid->cells[1], j, &image);
            const double   value   = SymmetricValue((PetscInt[3]){ (i + 16) % 16, fold, k }, c, &(Symmetric){ grid, 3, 40, DLMMirrorVector });
            images += image;
            worst = fmax(worst, fabs(x[k][j][i][c] - (image ? DLMMirrorVector[c] : 1.0) * value));
          }
    Call(DMDAVecRestoreArrayDOFRead(grid->velocity, local, &x));
    AssertAtMost(worst, 0.0);
    MPI_Allreduce(MPI_IN_PLACE, &images, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
    assert_true(images > 0);
    Call(VecDestroy(&u));
    Call(VecDestroy(&local));
    ClosePair(&pair);
  }
}

/* Answers to an impulse and its image, and to it and the negative of its image, add up to those of the impulse alone: beyond the mirrors too. */
static void ResponsesAreThoseOfTheWhole(void **state)
{
  PetscInt processes[3];

  for (int layout = 0; layout < 2 && Layout(layout, processes); layout++) {
    const DLMResponse *half, *whole;
    Pair               pair;
    double             worst = 0.0, largest = 0.0;
    OpenPair((PetscInt[3]){ 24, 24, 24 }, 3, processes, &pair);
    Call(DLMResponseGet(pair.half.stokes, 10, &half));
    Call(DLMResponseGet(pair.whole.stokes, 10, &whole));
    for (PetscInt i = 0; i < 9 * 21 * 21 * 21; i++) {
      largest = fmax(largest, fabs(whole->far_table[i]));
      worst   = fmax(worst, fabs(half->far_table[i] - whole->far_table[i]));
    }
    for (PetscInt i = 0; i < 9 * 8 * (2 * whole->near + 1) * (2 * whole->near + 1) * (2 * whole->near + 1); i++) worst = fmax(worst, fabs(half->near_table[i] - whole->near_table[i]));
    AssertAtMost(worst / largest, 1e-12);
    assert_true(half->far == 10 && whole->far == 10);
    ClosePair(&pair);
  }
}

static void OtherSolversAreRefused(void **state)
{
  StokesCase     c;
  Vec            x, u, p, f;
  PetscErrorCode error;

  MakeScene(PETSC_COMM_WORLD, (PetscInt[3]){ 16, 40, 16 }, 3, &c.scene);
  c.scene.box_mirror = DLM_MIRROR_HALF;
  CreateStokes("", &c);
  Call(DLMStokesCreateVec(c.stokes, &x));
  Call(DLMStokesGetParts(c.stokes, x, &u, &p));
  Call(VecDuplicate(u, &f));
  CallKeepingMessage(error, MatMultTranspose(c.B, p, f));
  AssertAll(error == PETSC_ERR_USER_INPUT);
  AssertAll(strstr(last_message, "-box_mirror half with another solver"));
  Call(VecDestroy(&f));
  Call(DLMStokesRestoreParts(c.stokes, x, &u, &p));
  Call(VecDestroy(&x));
  DestroyStokes(&c);
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(GhostsAreImages),
  cmocka_unit_test(ResponsesAreThoseOfTheWhole),
  cmocka_unit_test(OtherSolversAreRefused),
  cmocka_unit_test(HalfFlowsAsTheWhole),
};

RUN_ON_ALL_RANKS(tests)
