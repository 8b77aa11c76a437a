/* The operators of the Stokes problem, for all combinations of periodic axes and all layouts of the ranks. */
#include "dlmtest.h"
#include "private/stokesimpl.h"

static const PetscInt cells[3] = { 16, 20, 18 }; /* uneven on 2, 3 and 4 ranks */

static void OpenCase(MPI_Comm comm, unsigned periodic, const PetscInt *processes, const char *options, StokesCase *c)
{
  MakeScene(comm, cells, periodic, &c->scene);
  for (int d = 0; d < 3; d++) {
    if (processes) c->scene.grid_processes[d] = processes[d];
    for (int q = 0; q < 6 && !c->scene.box_periodic[d]; q++) c->scene.wall_velocity[d][q / 3][q % 3] = Hash(5, 6 * d + q);
    c->scene.pressure_gradient[d] = 0.4 * d - 0.3;
  }
  CreateStokes(options, c);
}

static void ForEveryLayout(void (*test)(const StokesCase *, unsigned))
{
  PetscInt processes[3];

  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (int k = 0; Layout(k, processes); k++) {
      StokesCase c;
      OpenCase(PETSC_COMM_WORLD, periodic, processes, "", &c);
      test(&c, periodic);
      DestroyStokes(&c);
    }
}

static Vec NewRandom(const StokesCase *c, DM dm, unsigned seed)
{
  Vec v;

  Call(DMCreateGlobalVector(dm, &v));
  FillRandom(c->grid, dm, seed, 0, v);
  return v;
}

static double RelativeDifference(Vec a, Vec b, Vec c, Vec d) /* <a,b> and <c,d> */
{
  PetscScalar x, y;
  PetscReal   norm_a, norm_b;

  Call(VecDot(a, b, &x));
  Call(VecDot(c, d, &y));
  Call(VecNorm(a, NORM_2, &norm_a));
  Call(VecNorm(b, NORM_2, &norm_b));
  return fabs(x - y) / (norm_a * norm_b);
}

static void CheckAdjoint(const StokesCase *c, unsigned periodic)
{
  Vec       u = NewRandom(c, c->grid->velocity, 1), q = NewRandom(c, c->grid->pressure, 2), bu, btq;
  PetscReal norm;

  Call(VecDuplicate(q, &bu));
  Call(VecDuplicate(u, &btq));
  Call(MatMult(c->B, u, bu));
  Call(MatMultTranspose(c->B, q, btq));
  Call(VecNorm(bu, NORM_2, &norm));
  AssertAll(norm > 0.0);
  AssertAtMost(RelativeDifference(bu, q, u, btq), 1e-14);
  for (Vec *v = (Vec[]){ u, q, bu, btq, NULL }; *v; v++) Call(VecDestroy(v));
}

static void DivergenceAndGradientAreAdjoint(void **state)
{
  ForEveryLayout(CheckAdjoint);
}

static void CheckSymmetric(const StokesCase *c, unsigned periodic)
{
  Vec x[2], kx[2], u, p;

  for (int i = 0; i < 2; i++) {
    Call(DLMStokesCreateVec(c->stokes, &x[i]));
    Call(VecDuplicate(x[i], &kx[i]));
    Call(DLMStokesGetParts(c->stokes, x[i], &u, &p));
    FillRandom(c->grid, c->grid->velocity, 3 + i, 0, u);
    FillRandom(c->grid, c->grid->pressure, 7 + i, 0, p);
    Call(DLMStokesRestoreParts(c->stokes, x[i], &u, &p));
    Call(MatMult(c->K, x[i], kx[i]));
  }
  AssertAtMost(RelativeDifference(kx[0], x[1], x[0], kx[1]), 1e-14);
  for (int i = 0; i < 2; i++) {
    Call(VecDestroy(&x[i]));
    Call(VecDestroy(&kx[i]));
  }
}

static void TheStokesOperatorIsSymmetric(void **state)
{
  ForEveryLayout(CheckSymmetric);
}

static void CheckAssembled(const StokesCase *c, unsigned periodic)
{
  Vec  u = NewRandom(c, c->grid->velocity, 1), shell, assembled;
  StokesCase other;
  MatType    type;

  OpenCase(PETSC_COMM_WORLD, periodic, c->grid->processes, "-stokes_pc_type fieldsplit -stokes_fieldsplit_velocity_pc_type jacobi", &other);
  Call(MatGetType(c->A, &type));
  AssertAll(!strcmp(type, MATSHELL));
  Call(MatGetType(other.A, &type));
  AssertAll(strstr(type, "aij"));
  Call(VecDuplicate(u, &shell));
  Call(VecDuplicate(u, &assembled));
  Call(MatMult(c->A, u, shell));
  Call(MatMult(other.A, u, assembled));
  AssertAtMost(FieldDifference(c->grid->velocity, shell, c->grid->velocity, assembled), 1e-15);
  Call(MatGetDiagonal(c->A, shell));
  Call(MatGetDiagonal(other.A, assembled));
  AssertAtMost(FieldDifference(c->grid->velocity, shell, c->grid->velocity, assembled), 1e-15);
  for (Vec *v = (Vec[]){ u, shell, assembled, NULL }; *v; v++) Call(VecDestroy(v));
  DestroyStokes(&other);
}

static void TheAssembledViscousBlockIsTheSame(void **state)
{
  ForEveryLayout(CheckAssembled);
}

/* A u, -B^T q, force of the walls; -B u, flux of the walls. The caller destroys them. */
static void ApplyAll(const StokesCase *c, Vec result[5])
{
  Vec u = NewRandom(c, c->grid->velocity, 1), q = NewRandom(c, c->grid->pressure, 2), wall, part[2];

  for (int i = 0; i < 5; i++) Call(VecDuplicate(i < 3 ? u : q, &result[i]));
  Call(MatMult(c->A, u, result[0]));
  Call(MatMultTranspose(c->B, q, result[1]));
  Call(MatMult(c->B, u, result[3]));
  Call(DLMStokesGetWallForce(c->stokes, &wall));
  Call(DLMStokesGetParts(c->stokes, wall, &part[0], &part[1]));
  Call(VecCopy(part[0], result[2]));
  Call(VecCopy(part[1], result[4]));
  Call(DLMStokesRestoreParts(c->stokes, wall, &part[0], &part[1]));
  Call(VecDestroy(&u));
  Call(VecDestroy(&q));
}

static void CheckAgainstOneRank(const StokesCase *c, unsigned periodic)
{
  StokesCase serial;
  Vec  parallel_result[5], serial_result[5];

  OpenCase(PETSC_COMM_SELF, periodic, NULL, "", &serial);
  ApplyAll(c, parallel_result);
  ApplyAll(&serial, serial_result);
  for (int i = 0; i < 5; i++) {
    DM a = i < 3 ? c->grid->velocity : c->grid->pressure, b = i < 3 ? serial.grid->velocity : serial.grid->pressure;
    AssertAtMost(FieldDifference(a, parallel_result[i], b, serial_result[i]), 1e-14);
    Call(VecDestroy(&parallel_result[i]));
    Call(VecDestroy(&serial_result[i]));
  }
  DestroyStokes(&serial);
}

static void AnyLayoutGivesTheOperatorsOfOneRank(void **state)
{
  ForEveryLayout(CheckAgainstOneRank);
}

/* Neighbour of a node in natural order (nodes per axis n), or -1 beyond a wall. */
static PetscInt Neighbour(const StokesCase *c, const PetscInt n[3], const PetscInt i[3], const PetscInt o[3])
{
  PetscInt q[3];

  for (int d = 0; d < 3; d++) {
    q[d] = i[d] + o[d];
    if (c->grid->periodic[d]) q[d] = (q[d] + n[d]) % n[d];
    else if (q[d] < 0 || q[d] >= n[d]) return -1;
  }
  return q[0] + n[0] * (q[1] + n[1] * q[2]);
}

/* f <- A u or, where move_walls is set, what the wall values of u move to the right-hand side; from the rows of the kernel. */
static double ViscousRow(const StokesCase *c, const double *u, const PetscInt i[3], int component, PetscBool move_walls)
{
  const int    inner[3] = { DLM_INNER, DLM_INNER, DLM_INNER };
  const double a        = c->scene.fluid_viscosity * c->scene.h;
  double       row[27], sum = 0.0;

  DLMKuhnStiffness(inner, row);
  for (int k = 0; k < 27; k++) {
    const PetscInt o[3] = { k % 3 - 1, (k / 3) % 3 - 1, k / 9 - 1 };
    if (row[k] == 0.0 || DLMGridOnWall(c->grid, i[0] + o[0], i[1] + o[1], i[2] + o[2]) != move_walls) continue;
    sum += (move_walls ? -a : a) * row[k] * u[3 * Neighbour(c, c->grid->nodes, i, o) + component];
  }
  return sum;
}

/* sum of the divergence row over the wall columns, or over the others. */
static double DivergenceRow(const StokesCase *c, const double *u, const PetscInt i[3], PetscBool walls)
{
  const PetscInt fine[3] = { 2 * i[0], 2 * i[1], 2 * i[2] };
  double         row[3][125], sum = 0.0;
  int            place[3];

  for (int d = 0; d < 3; d++) place[d] = DLMGridPlace(c->grid, d, i[d], c->grid->cells[d] / 2);
  DLMKuhnDivergence(place, c->grid->symmetric, row);
  for (int k = 0; k < 125; k++) {
    const PetscInt o[3] = { k % 5 - 2, (k / 5) % 5 - 2, k / 25 - 2 }, at = Neighbour(c, c->grid->nodes, fine, o);
    if (at < 0 || DLMGridOnWall(c->grid, fine[0] + o[0], fine[1] + o[1], fine[2] + o[2]) != walls) continue;
    for (int j = 0; j < 3; j++) sum += c->scene.h * c->scene.h * row[j][k] * u[3 * at + j];
  }
  return sum;
}

/* Velocity of a wall node: its wall's; on an edge the normal component of either wall, else the mean. */
static double WallValue(const PetscInt i[3], int component, const void *context)
{
  const StokesCase *c    = context;
  double            sum  = 0.0;
  int               meet = 0;

  for (int d = 0; d < 3; d++) {
    if (c->grid->periodic[d] || (i[d] != 0 && i[d] != cells[d])) continue;
    if (d == component) return c->scene.wall_velocity[d][i[d] != 0][component];
    sum += c->scene.wall_velocity[d][i[d] != 0][component];
    meet++;
  }
  return meet ? sum / meet : 0.0;
}

/* Largest difference of A u (given in x) and of the wall force f from what the kernels say; w: the wall values. */
static double ViscousDifference(const StokesCase *c, const double *u, const double *w, const double *x, const double *f)
{
  const double a = c->scene.fluid_viscosity * c->scene.h, h3 = c->scene.h * c->scene.h * c->scene.h;
  double       worst = 0.0;
  PetscInt     i[3], at = 0;

  for (i[2] = 0; i[2] < c->grid->nodes[2]; i[2]++)
    for (i[1] = 0; i[1] < c->grid->nodes[1]; i[1]++)
      for (i[0] = 0; i[0] < c->grid->nodes[0]; i[0]++)
        for (int d = 0; d < 3; d++, at++) {
          const PetscBool wall  = DLMGridOnWall(c->grid, i[0], i[1], i[2]);
          const double    force = wall ? 0.0 : ViscousRow(c, w, i, d, PETSC_TRUE) - h3 * c->scene.pressure_gradient[d];
          worst = fmax(worst, fabs(x[at] - (wall ? 6.0 * a * u[at] : ViscousRow(c, u, i, d, PETSC_FALSE))));
          worst = fmax(worst, fabs(f[at] - (wall ? 6.0 * a * w[at] : force)));
        }
  return worst;
}

/* The same for -B u in x and the flux of the wall columns in g. */
static double DivergenceDifference(const StokesCase *c, const double *u, const double *w, const double *x, const double *g)
{
  double   worst = 0.0;
  PetscInt i[3], n[3], at = 0;

  for (int d = 0; d < 3; d++) n[d] = (c->grid->nodes[d] + 1) / 2;
  for (i[2] = 0; i[2] < n[2]; i[2]++)
    for (i[1] = 0; i[1] < n[1]; i[1]++)
      for (i[0] = 0; i[0] < n[0]; i[0]++, at++) {
        worst = fmax(worst, fabs(x[at] + DivergenceRow(c, u, i, PETSC_FALSE)));
        worst = fmax(worst, fabs(g[at] - DivergenceRow(c, w, i, PETSC_TRUE)));
      }
  return worst;
}

/* On one rank: the operators and the wall force from the rows of the kernels, which test_kuhn.c has checked. */
static void OperatorsFollowTheKernels(void **state)
{
  for (unsigned periodic = 0; periodic < 8; periodic++) {
    StokesCase c;
    Vec        result[5], u, wall;
    double    *x[5], *v, *w;
    PetscInt   n;
    OpenCase(PETSC_COMM_SELF, periodic, NULL, "", &c);
    u = NewRandom(&c, c.grid->velocity, 1);
    Call(VecDuplicate(u, &wall));
    FillNodes(c.grid->velocity, WallValue, &c, wall);
    ApplyAll(&c, result);
    GatherNatural(c.grid->velocity, u, &n, &v);
    GatherNatural(c.grid->velocity, wall, &n, &w);
    for (int r = 0; r < 5; r++) GatherNatural(r < 3 ? c.grid->velocity : c.grid->pressure, result[r], &n, &x[r]);
    AssertNear(ViscousDifference(&c, v, w, x[0], x[2]), 0.0, 1e-14);
    AssertNear(DivergenceDifference(&c, v, w, x[3], x[4]), 0.0, 1e-14);
    for (double **array = (double *[]){ v, w, x[0], x[1], x[2], x[3], x[4], NULL }; *array; array++) Call(PetscFree(*array));
    for (int r = 0; r < 5; r++) Call(VecDestroy(&result[r]));
    Call(VecDestroy(&u));
    Call(VecDestroy(&wall));
    DestroyStokes(&c);
  }
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(OperatorsFollowTheKernels),
  cmocka_unit_test(DivergenceAndGradientAreAdjoint),
  cmocka_unit_test(TheStokesOperatorIsSymmetric),
  cmocka_unit_test(TheAssembledViscousBlockIsTheSame),
  cmocka_unit_test(AnyLayoutGivesTheOperatorsOfOneRank),
};

RUN_ON_ALL_RANKS(tests)
