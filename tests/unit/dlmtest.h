/*
  What the unit tests share: scenes by hand, fields that do not depend on the number of ranks, gathering, and a cmocka runner.

  An assertion leaves its test by a jump: where ranks may disagree, use AssertAll, which fails on all of them.
*/
#ifndef DLMTEST_H
#define DLMTEST_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <math.h>
#include <cmocka.h>
#include "dlmstokes.h"
#include "private/gridimpl.h"

/* A failing library call ends the run on every rank, after PETSc has printed its trace. */
#define Call(...)                                                       \
  do {                                                                  \
    const PetscErrorCode error_ = (__VA_ARGS__);                        \
    if (error_) MPI_Abort(PETSC_COMM_WORLD, error_ > 255 ? 1 : error_); \
  } while (0)

static inline PetscBool TrueOnAll(PetscBool here)
{
  PetscBool all;
  MPI_Allreduce(&here, &all, 1, MPIU_BOOL, MPI_LAND, PETSC_COMM_WORLD);
  return all;
}

static inline double LargestOnAll(double here)
{
  double largest;
  here = here == here ? here : 1e300; /* a NaN must not pass */
  MPI_Allreduce(&here, &largest, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
  return largest;
}

/* Collective assertions. */
#define AssertAll(condition) _assert_true(TrueOnAll((PetscBool)(condition)), #condition " on all ranks", __FILE__, __LINE__)
#define AssertAtMost(value, limit)                                                                             \
  do {                                                                                                         \
    const double value_ = LargestOnAll(value);                                                                 \
    if (!(value_ <= (limit))) fail_msg("%s = %g, at most %g allowed", #value, value_, (double)(limit));        \
  } while (0)

/* Not collective: for what every rank computes alike. */
#define AssertNear(value, expected, tolerance)                                                                 \
  do {                                                                                                         \
    const double value_ = (value), expected_ = (expected);                                                     \
    if (!(fabs(value_ - expected_) <= (tolerance)))                                                            \
      fail_msg("%s = %.17g, expected %.17g within %g", #value, value_, expected_, (double)(tolerance));        \
  } while (0)

/* A number in [-1, 1] that looks random; equal arguments, equal number. */
static inline double Hash(uint64_t seed, uint64_t index)
{
  uint64_t z = (seed << 40) + index + UINT64_C(0x9e3779b97f4a7c15) * (seed + 1);
  z          = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
  z          = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
  z ^= z >> 31;
  return (double)(z >> 11) / 4503599627370496.0 - 1.0;
}

/* A sphere-free scene of h = 0.125, viscosity 0.7; bit d of periodic: axis d is periodic. */
static inline void MakeScene(MPI_Comm comm, const PetscInt cells[3], unsigned periodic, DLMScene *scene)
{
  *scene                    = (DLMScene){ .comm = comm, .h = 0.125, .grid_resolution = 8.0, .fluid_viscosity = 0.7, .implicit_viscosity = 0.7, .fluid_density = 1.0 };
  scene->stokes_block_limit = 1024.0;
  scene->pairing_spacing    = 1.5;
  scene->pairing_retraction = DLM_AUTO;
  scene->contact_range      = DLM_AUTO;
  scene->contact_stiffness  = DLM_AUTO;
  for (int d = 0; d < 3; d++) {
    scene->cells[d]        = cells[d];
    scene->box_size[d]     = cells[d] * scene->h;
    scene->box_periodic[d] = (PetscBool)((periodic >> d) & 1u);
  }
}

/* The k-th way to split the ranks over the axes, none twice; false when there are no more. */
static inline PetscBool Layout(int k, PetscInt processes[3])
{
  PetscMPIInt size;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  for (processes[2] = 1; processes[2] <= size; processes[2]++)
    for (processes[1] = 1; processes[1] <= size; processes[1]++)
      for (processes[0] = 1; processes[0] <= size; processes[0]++)
        if (processes[0] * processes[1] * processes[2] == size && k-- == 0) return PETSC_TRUE;
  return PETSC_FALSE;
}

typedef double (*NodeValue)(const PetscInt node[3], int component, const void *context);

/* Fills a vector of a DMDA node by node. */
static inline void FillNodes(DM dm, NodeValue value, const void *context, Vec v)
{
  PetscInt       start[3], width[3], dof, i[3];
  PetscScalar ****x;

  Call(DMDAGetCorners(dm, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  Call(DMDAGetInfo(dm, NULL, NULL, NULL, NULL, NULL, NULL, NULL, &dof, NULL, NULL, NULL, NULL, NULL));
  Call(DMDAVecGetArrayDOF(dm, v, &x));
  for (i[2] = start[2]; i[2] < start[2] + width[2]; i[2]++)
    for (i[1] = start[1]; i[1] < start[1] + width[1]; i[1]++)
      for (i[0] = start[0]; i[0] < start[0] + width[0]; i[0]++)
        for (int c = 0; c < dof; c++) x[i[2]][i[1]][i[0]][c] = value(i, c, context);
  Call(DMDAVecRestoreArrayDOF(dm, v, &x));
}

typedef struct {
  DLMGrid  grid;
  unsigned seed;
  int      zero_walls; /* velocity that vanishes on the walls */
} RandomField;

static inline double RandomValue(const PetscInt i[3], int component, const void *context)
{
  const RandomField *f = context;
  if (f->zero_walls && DLMGridOnWall(f->grid, i[0], i[1], i[2])) return 0.0;
  return Hash(f->seed, (uint64_t)(component + 3 * (i[0] + 1000 * (i[1] + 1000 * i[2]))));
}

/* Random velocity or pressure, the same for every number of ranks. */
static inline void FillRandom(DLMGrid grid, DM dm, unsigned seed, int zero_walls, Vec v)
{
  FillNodes(dm, RandomValue, &(RandomField){ grid, seed, zero_walls }, v);
}

/* The whole field on every rank in natural order, x1 and component fastest; free with PetscFree. Collective on the DM. */
static inline void GatherNatural(DM dm, Vec v, PetscInt *n, double **all)
{
  PetscInt                start[3], width[3], nodes[3], dof;
  const PetscScalar ****x;

  Call(DMDAGetCorners(dm, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  Call(DMDAGetInfo(dm, NULL, &nodes[0], &nodes[1], &nodes[2], NULL, NULL, NULL, &dof, NULL, NULL, NULL, NULL, NULL));
  *n = dof * nodes[0] * nodes[1] * nodes[2];
  Call(PetscCalloc1(*n, all));
  Call(DMDAVecGetArrayDOFRead(dm, v, &x));
  for (PetscInt k = start[2]; k < start[2] + width[2]; k++)
    for (PetscInt j = start[1]; j < start[1] + width[1]; j++)
      for (PetscInt i = start[0]; i < start[0] + width[0]; i++)
        for (int c = 0; c < dof; c++) (*all)[c + dof * (i + nodes[0] * (j + nodes[1] * k))] = x[k][j][i][c];
  Call(DMDAVecRestoreArrayDOFRead(dm, v, &x));
  MPI_Allreduce(MPI_IN_PLACE, *all, (int)*n, MPI_DOUBLE, MPI_SUM, PetscObjectComm((PetscObject)dm));
}

/* Largest difference of two fields on the same mesh with different ranks, over the largest value of b. Collective on both. */
static inline double FieldDifference(DM dm_a, Vec a, DM dm_b, Vec b)
{
  PetscInt n_a, n_b;
  double  *x, *y, difference = 0.0, largest = 0.0;

  GatherNatural(dm_a, a, &n_a, &x);
  GatherNatural(dm_b, b, &n_b, &y);
  if (n_a != n_b) MPI_Abort(PETSC_COMM_WORLD, 1);
  for (PetscInt i = 0; i < n_a; i++) {
    if (!(fabs(x[i] - y[i]) <= difference)) difference = fabs(x[i] - y[i]);
    largest = PetscMax(largest, fabs(y[i]));
  }
  Call(PetscFree(x));
  Call(PetscFree(y));
  return largest > 0.0 ? difference / largest : difference;
}

/* A Stokes problem with its operators; B is -divergence. */
typedef struct {
  DLMScene  scene;
  DLMGrid   grid;
  DLMStokes stokes;
  Mat       K, A, B;
} StokesCase;

/* Builds c->scene with these options alone: solver options are global, so every case starts from none. */
static inline void CreateStokes(const char *options, StokesCase *c)
{
  Call(PetscOptionsClear(NULL));
  Call(PetscOptionsInsertString(NULL, options));
  Call(DLMGridCreate(&c->scene, &c->grid));
  Call(DLMStokesCreate(c->grid, &c->scene, &c->stokes));
  Call(DLMStokesGetOperators(c->stokes, &c->K, &c->A, &c->B));
}

static inline void DestroyStokes(StokesCase *c)
{
  Call(DLMStokesDestroy(&c->stokes));
  Call(DLMGridDestroy(&c->grid));
}

/* x with K x = b. */
static inline Vec NewSolution(const StokesCase *c, Vec b)
{
  Vec x;

  Call(VecDuplicate(b, &x));
  Call(VecSet(x, 0.0));
  Call(DLMStokesSolve(c->stokes, b, x));
  return x;
}

/* K x of a random x. */
static inline Vec NewRightHandSide(const StokesCase *c)
{
  Vec x, b, u, p;

  Call(DLMStokesCreateVec(c->stokes, &x));
  Call(VecDuplicate(x, &b));
  Call(DLMStokesGetParts(c->stokes, x, &u, &p));
  FillRandom(c->grid, c->grid->velocity, 11, 0, u);
  FillRandom(c->grid, c->grid->pressure, 12, 0, p);
  Call(DLMStokesRestoreParts(c->stokes, x, &u, &p));
  Call(MatMult(c->K, x, b));
  Call(VecDestroy(&x));
  return b;
}

/* Relative difference of two solutions, part by part, the pressure up to a constant. */
static inline double SolutionDifference(const StokesCase *c, Vec x, Vec y)
{
  Vec       difference, part[2][2];
  PetscReal norm[2];
  double    worst = 0.0;

  Call(VecDuplicate(x, &difference));
  Call(VecWAXPY(difference, -1.0, x, y));
  Call(DLMStokesGetParts(c->stokes, x, &part[0][0], &part[0][1]));
  Call(DLMStokesGetParts(c->stokes, difference, &part[1][0], &part[1][1]));
  for (int i = 0; i < 2; i++) {
    for (int k = 0; k < 2; k++) {
      PetscReal sum;
      PetscInt  n;
      Call(VecSum(part[k][i], &sum));
      Call(VecGetSize(part[k][i], &n));
      if (i == 1) Call(VecShift(part[k][i], -sum / n));
      Call(VecNorm(part[k][i], NORM_2, &norm[k]));
    }
    worst = PetscMax(worst, norm[1] / norm[0]);
  }
  Call(DLMStokesRestoreParts(c->stokes, difference, &part[1][0], &part[1][1]));
  Call(DLMStokesRestoreParts(c->stokes, x, &part[0][0], &part[0][1]));
  Call(VecDestroy(&difference));
  return worst;
}

/* The last error message, for tests that provoke one: push this handler, call, pop. */
static char last_message[1024];

static inline PetscErrorCode KeepMessage(MPI_Comm comm, int line, const char *function, const char *file, PetscErrorCode code,
                                         PetscErrorType type, const char *text, void *context)
{
  if (type == PETSC_ERROR_INITIAL) strncpy(last_message, text ? text : "", sizeof(last_message) - 1);
  return code;
}

/* result <- error code of a call that is expected to fail quietly; last_message holds its message. */
#define CallKeepingMessage(result, ...)                \
  do {                                                 \
    last_message[0] = 0;                               \
    Call(PetscPushErrorHandler(KeepMessage, NULL));    \
    (result) = (__VA_ARGS__);                          \
    Call(PetscPopErrorHandler());                      \
  } while (0)

/* main of a test on any number of ranks: non-zero on every rank if any test failed on any rank. Rank 0 prints the progress. */
#define RUN_ON_ALL_RANKS(tests)                                                          \
  int main(int argc, char **argv)                                                        \
  {                                                                                      \
    int rank, failed;                                                                    \
    if (PetscInitialize(&argc, &argv, NULL, NULL)) return 1;                             \
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);                                              \
    if (rank > 0 && !freopen("/dev/null", "w", stdout)) return 1;                        \
    failed = cmocka_run_group_tests(tests, NULL, NULL) != 0;                             \
    MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD);         \
    return PetscFinalize() || failed;                                                    \
  }
#endif
