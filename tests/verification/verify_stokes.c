/*
  Manufactured Stokes flows on three meshes: measures the L2 errors of velocity and pressure (mean removed) by quadrature over the
  tetrahedra and fails if the order of the velocity falls below 1.9 or that of the pressure below 1.4.

  The velocity is a curl of products of one-dimensional functions, zero with its normal derivative on walls; -verify_cells a,b,c
  chooses the meshes (cells per edge of a unit cube).
*/
#include "dlmstokes.h"
#include "private/gridimpl.h"

#define MU 1.7

/*
  Along an axis: s[k] is the k-th derivative of S, q[k] that of the pressure factor Q. S = sin^2(pi x) between walls, and a wave
  with a phase on a periodic axis.
*/
typedef struct {
  double s[4], q[2];
} Factor;

static Factor Axis(PetscBool periodic, int axis, double x)
{
  const double w = 2.0 * PETSC_PI, y = w * x + (periodic ? 0.4 + axis : 0.0), z = periodic ? y : 2.3 * x + 0.3 * axis;
  Factor       f = { .q = { sin(z), (periodic ? w : 2.3) * cos(z) } };

  if (periodic) {
    f.s[0] = 1.0 + 0.5 * sin(y);
    f.s[1] = 0.5 * w * cos(y);
    f.s[2] = -0.5 * w * w * sin(y);
    f.s[3] = -0.5 * w * w * w * cos(y);
  } else {
    f.s[0] = 0.5 * (1.0 - cos(y));
    f.s[1] = 0.5 * w * sin(y);
    f.s[2] = 0.5 * w * w * cos(y);
    f.s[3] = -0.5 * w * w * w * sin(y);
  }
  return f;
}

/* u = curl (a SSS) with constant a; S the product of the factors. f = -mu lap u + grad p. x in [0,1]^3. */
static void Exact(const PetscBool periodic[3], const double x[3], double u[3], double *p, double f[3])
{
  const double a[3] = { 0.3, -0.2, 0.5 };
  Factor       g[3];

  for (int d = 0; d < 3; d++) g[d] = Axis(periodic[d], d, x[d]);
  *p = g[0].q[0] * g[1].q[0] * g[2].q[0];
  for (int c = 0; c < 3; c++) {
    const int i = (c + 1) % 3, j = (c + 2) % 3;
    /* u_c = d_i (a_j S) - d_j (a_i S) */
    u[c] = a[j] * g[c].s[0] * g[i].s[1] * g[j].s[0] - a[i] * g[c].s[0] * g[i].s[0] * g[j].s[1];
    f[c] = g[c].q[1] * g[i].q[0] * g[j].q[0];
    for (int d = 0; d < 3; d++) { /* second derivative along d */
      int n[3] = { 0, 0, 0 };
      n[d]     = 2;
      f[c] -= MU * a[j] * g[c].s[n[c]] * g[i].s[1 + n[i]] * g[j].s[n[j]];
      f[c] += MU * a[i] * g[c].s[n[c]] * g[i].s[n[i]] * g[j].s[1 + n[j]];
    }
  }
}

/* The 24 points of a four-point Gauss rule on the six tetrahedra of the unit cube, and the P1 weights of its corners there. */
typedef struct {
  double x[24][3], weight[24][8];
} Quadrature;

static void QuadratureFill(Quadrature *q)
{
  const double near = 0.58541019662496845446, far = 0.13819660112501051518;
  DLMKuhnCube  cube;

  DLMKuhnCubeFill(&cube);
  for (int g = 0; g < 24; g++) {
    for (int d = 0; d < 3; d++) {
      q->x[g][d] = 0.0;
      for (int a = 0; a < 4; a++) q->x[g][d] += (a == g % 4 ? near : far) * cube.vertex[g / 4][a][d];
    }
    DLMKuhnInterpolate(q->x[g], q->weight[g]);
  }
}

/* L2 error of the velocity (dof 3) or of the pressure up to a constant (dof 1); n cubes per edge of the unit cube. */
static PetscErrorCode MeasureError(DLMGrid grid, DM dm, Vec v, PetscInt n, int dof, PetscReal *error)
{
  Vec             local;
  PetscScalar ****x;
  PetscInt        start[3], width[3], i[3];
  PetscReal       sum[2] = { 0.0, 0.0 };
  Quadrature      q;

  PetscFunctionBeginUser;
  QuadratureFill(&q);
  PetscCall(DMGetLocalVector(dm, &local));
  PetscCall(DMGlobalToLocal(dm, v, INSERT_VALUES, local));
  PetscCall(DMDAVecGetArrayDOFRead(dm, local, &x));
  PetscCall(DMDAGetCorners(dm, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  for (i[2] = start[2]; i[2] < PetscMin(n, start[2] + width[2]); i[2]++)
    for (i[1] = start[1]; i[1] < PetscMin(n, start[1] + width[1]); i[1]++)
      for (i[0] = start[0]; i[0] < PetscMin(n, start[0] + width[0]); i[0]++)
        for (int g = 0; g < 24; g++) {
          double at[3], u[3], p, f[3];
          for (int d = 0; d < 3; d++) at[d] = (i[d] + q.x[g][d]) / n;
          Exact(grid->periodic, at, u, &p, f);
          for (int d = 0; d < dof; d++) {
            double e = dof == 1 ? -p : -u[d];
            for (int c = 0; c < 8; c++) e += q.weight[g][c] * x[i[2] + c / 4][i[1] + (c / 2) % 2][i[0] + c % 2][d];
            sum[0] += e * e / (24.0 * n * n * n);
            sum[1] += e / (24.0 * n * n * n);
          }
        }
  PetscCall(DMDAVecRestoreArrayDOFRead(dm, local, &x));
  PetscCall(DMRestoreLocalVector(dm, &local));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, grid->comm));
  *error = PetscSqrtReal(dof == 1 ? sum[0] - sum[1] * sum[1] : sum[0]);
  PetscFunctionReturn(0);
}

/* Lumped load: h^3 f at the inner nodes, nothing on the walls (the velocity is zero there). */
static PetscErrorCode SetLoad(DLMGrid grid, Vec load)
{
  const PetscReal h = grid->h;
  PetscInt        start[3], width[3], i[3];
  PetscScalar ****x;

  PetscFunctionBeginUser;
  PetscCall(DMDAGetCorners(grid->velocity, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  PetscCall(DMDAVecGetArrayDOF(grid->velocity, load, &x));
  for (i[2] = start[2]; i[2] < start[2] + width[2]; i[2]++)
    for (i[1] = start[1]; i[1] < start[1] + width[1]; i[1]++)
      for (i[0] = start[0]; i[0] < start[0] + width[0]; i[0]++) {
        const double at[3] = { i[0] * h, i[1] * h, i[2] * h };
        double       u[3], p, f[3];
        Exact(grid->periodic, at, u, &p, f);
        for (int c = 0; c < 3; c++) x[i[2]][i[1]][i[0]][c] = DLMGridOnWall(grid, i[0], i[1], i[2]) ? 0.0 : h * h * h * f[c];
      }
  PetscCall(DMDAVecRestoreArrayDOF(grid->velocity, load, &x));
  PetscFunctionReturn(0);
}

/* error[0], error[1]: velocity, pressure, on n^3 cells. */
static PetscErrorCode Solve(const PetscBool periodic[3], PetscInt n, PetscReal error[2])
{
  DLMScene  scene = { .comm = PETSC_COMM_WORLD, .h = 1.0 / n, .fluid_viscosity = MU, .implicit_viscosity = MU, .stokes_block_limit = 1024.0 };
  DLMGrid   grid;
  DLMStokes stokes;
  Vec       b, x, u, p;

  PetscFunctionBeginUser;
  for (int d = 0; d < 3; d++) {
    scene.cells[d]        = n;
    scene.box_size[d]     = 1.0;
    scene.box_periodic[d] = periodic[d];
  }
  PetscCall(DLMGridCreate(&scene, &grid));
  PetscCall(DLMStokesCreate(grid, &scene, &stokes));
  PetscCall(DLMStokesCreateVec(stokes, &b));
  PetscCall(VecDuplicate(b, &x));
  PetscCall(DLMStokesGetParts(stokes, b, &u, NULL));
  PetscCall(SetLoad(grid, u));
  PetscCall(DLMStokesRestoreParts(stokes, b, &u, NULL));
  PetscCall(DLMStokesSolve(stokes, b, x));
  PetscCall(DLMStokesGetParts(stokes, x, &u, &p));
  PetscCall(MeasureError(grid, grid->velocity, u, n, 3, &error[0]));
  PetscCall(MeasureError(grid, grid->pressure, p, n / 2, 1, &error[1]));
  PetscCall(DLMStokesRestoreParts(stokes, x, &u, &p));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&x));
  PetscCall(DLMStokesDestroy(&stokes));
  PetscCall(DLMGridDestroy(&grid));
  PetscFunctionReturn(0);
}

/* Prints the table of one box; good is cleared if an order between two meshes falls short. */
static PetscErrorCode Measure(const char *name, const PetscBool periodic[3], const PetscInt n[3], PetscBool *good)
{
  const PetscReal least[2] = { 1.9, 1.4 };
  PetscReal       error[3][2];

  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s\n  cells   velocity   order   pressure   order\n", name));
  for (int k = 0; k < 3; k++) {
    PetscCall(Solve(periodic, n[k], error[k]));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %5" PetscInt_FMT, n[k]));
    for (int q = 0; q < 2; q++) {
      const PetscReal order = k ? log(error[k - 1][q] / error[k][q]) / log((double)n[k] / n[k - 1]) : 0.0;
      if (k) PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %9.3e  %5.2f%s", (double)error[k][q], (double)order, order >= least[q] ? " " : "*"));
      else PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %9.3e        ", (double)error[k][q]));
      if (k && !(order >= least[q])) *good = PETSC_FALSE;
    }
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "\n"));
  }
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscInt  n[3] = { 16, 32, 48 }, three = 3;
  PetscBool good = PETSC_TRUE;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(PetscOptionsGetIntArray(NULL, NULL, "-verify_cells", n, &three, NULL));
  PetscCall(Measure("periodic, periodic, walls", (PetscBool[]){ PETSC_TRUE, PETSC_TRUE, PETSC_FALSE }, n, &good));
  PetscCall(PetscOptionsClear(NULL)); /* the solver's defaults of one kind of box are not those of the next */
  PetscCall(Measure("walls on all sides", (PetscBool[]){ PETSC_FALSE, PETSC_FALSE, PETSC_FALSE }, n, &good));
  PetscCall(PetscOptionsClear(NULL));
  PetscCall(Measure("periodic on all axes", (PetscBool[]){ PETSC_TRUE, PETSC_TRUE, PETSC_TRUE }, n, &good));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, good ? "orders reached: velocity 1.9, pressure 1.4\n" : "* an order falls short of velocity 1.9, pressure 1.4\n"));
  PetscCall(PetscFinalize());
  return good ? 0 : 1;
}
