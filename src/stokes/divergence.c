#include "../../include/private/stokesimpl.h"

/*
  Places of a pressure node on an axis: on a wall, next to one, or inside. A row next to a wall still reaches the wall's
  velocity nodes; those columns are zero here, because they are data (wall force).
*/
enum { NEAR_LOWER = 1, INSIDE = 2, NEAR_UPPER = 3, PLACES = 5 };

static int AxisPlace(DLMGrid grid, int d, PetscInt c)
{
  const PetscInt n = grid->cells[d] / 2;

  if (grid->periodic[d]) return INSIDE;
  if (c == 0) return 0;
  if (c == n) return 4;
  return c == 1 ? NEAR_LOWER : (c == n - 1 ? NEAR_UPPER : INSIDE);
}

static PetscInt NodePlace(DLMGrid grid, const PetscInt c[3])
{
  return AxisPlace(grid, 0, c[0]) + PLACES * (AxisPlace(grid, 1, c[1]) + PLACES * AxisPlace(grid, 2, c[2]));
}

/* Divergence row at pressure node c with its wall columns, or only them, left out. */
static void PlaceRow(DLMGrid grid, const PetscInt c[3], PetscBool wall_columns, double row[3][125])
{
  int place[3];

  for (int d = 0; d < 3; d++) place[d] = DLMGridPlace(grid, d, c[d], grid->cells[d] / 2);
  DLMKuhnDivergence(place, grid->symmetric, row);
  for (int i = 0; i < 125; i++) {
    const PetscBool wall = DLMGridOnWall(grid, 2 * c[0] + i % 5 - 2, 2 * c[1] + (i / 5) % 5 - 2, 2 * c[2] + i / 25 - 2);
    for (int j = 0; j < 3; j++) row[j][i] *= wall == wall_columns ? grid->h * grid->h : 0.0;
  }
}

static void RunsFromRow(double row[3][125], DLMRunList *list)
{
  list->n = 0;
  for (int line = 0; line < 25; line++) {
    DLMRun *run   = &list->run[list->n];
    int     first = 5, last = -1;
    for (int o = 0; o < 5; o++)
      if (row[0][line * 5 + o] != 0.0 || row[1][line * 5 + o] != 0.0 || row[2][line * 5 + o] != 0.0) {
        first = PetscMin(first, o);
        last  = o;
      }
    if (last < 0) continue;
    run->offset[0] = first - 2;
    run->offset[1] = line % 5 - 2;
    run->offset[2] = line / 5 - 2;
    run->length    = 3 * (last - first + 1);
    for (int o = first; o <= last; o++)
      for (int j = 0; j < 3; j++) run->coefficient[3 * (o - first) + j] = row[j][line * 5 + o];
    list->n++;
  }
}

/* Runs of every class of place on this rank, without the wall columns or with them alone. */
static PetscErrorCode BuildRuns(DLMGrid grid, PetscBool wall_columns, DLMRunList **runs)
{
  double   row[3][125];
  PetscInt start[3], width[3];
  char     done[PLACES * PLACES * PLACES] = { 0 };

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc1(PLACES * PLACES * PLACES, runs));
  PetscCall(DMDAGetCorners(grid->pressure, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  for (PetscInt k = start[2]; k < start[2] + width[2]; k++)
    for (PetscInt j = start[1]; j < start[1] + width[1]; j++)
      for (PetscInt i = start[0]; i < start[0] + width[0]; i++) {
        const PetscInt c[3] = { i, j, k };
        const PetscInt place = NodePlace(grid, c);
        if (done[place]) continue;
        done[place] = 1;
        PlaceRow(grid, c, wall_columns, row);
        RunsFromRow(row, *runs + place);
      }
  PetscFunctionReturn(0);
}

/* What the loops over pressure nodes need: the local velocity array and its strides. */
typedef struct {
  PetscInt start[3], width[3];   /* pressure nodes of this rank */
  PetscInt ghost[3], stride[3];  /* first node and strides (doubles) of the local velocity array */
} Loop;

static PetscErrorCode LoopSetUp(DLMGrid grid, Loop *l)
{
  PetscInt m[3];

  PetscFunctionBegin;
  PetscCall(DMDAGetCorners(grid->pressure, &l->start[0], &l->start[1], &l->start[2], &l->width[0], &l->width[1], &l->width[2]));
  PetscCall(DMDAGetGhostCorners(grid->velocity, &l->ghost[0], &l->ghost[1], &l->ghost[2], &m[0], &m[1], &m[2]));
  l->stride[0] = 3;
  l->stride[1] = 3 * m[0];
  l->stride[2] = 3 * m[0] * m[1];
  PetscFunctionReturn(0);
}

/* forward: p -= B u; else u -= B^T p. p is the global, u the local (ghosted) array. */
static void ApplyRuns(DLMGrid grid, const DLMRunList *runs, const Loop *l, PetscBool forward, double *u, double *p)
{
  for (PetscInt k = 0; k < l->width[2]; k++)
    for (PetscInt j = 0; j < l->width[1]; j++)
      for (PetscInt i = 0; i < l->width[0]; i++, p++) {
        const PetscInt    c[3]   = { l->start[0] + i, l->start[1] + j, l->start[2] + k };
        const DLMRunList *list   = runs + NodePlace(grid, c);
        double           *center = u;
        double            sum    = 0.0;
        for (int d = 0; d < 3; d++) center += (2 * c[d] - l->ghost[d]) * l->stride[d];
        for (PetscInt r = 0; r < list->n; r++) {
          const DLMRun    *run = &list->run[r];
          double *restrict x   = center + run->offset[0] * l->stride[0] + run->offset[1] * l->stride[1] + run->offset[2] * l->stride[2];
          if (forward)
            for (PetscInt q = 0; q < run->length; q++) sum += run->coefficient[q] * x[q];
          else
            for (PetscInt q = 0; q < run->length; q++) x[q] -= run->coefficient[q] * *p;
        }
        if (forward) *p -= sum;
      }
}

static PetscErrorCode DivergenceMult(Mat mat, Vec u, Vec p)
{
  DLMStokes    stokes;
  Loop         loop;
  Vec          local;
  PetscScalar *x, *y;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(mat, &stokes));
  PetscCall(LoopSetUp(stokes->grid, &loop));
  PetscCall(DMGetLocalVector(stokes->grid->velocity, &local));
  PetscCall(DLMGridGlobalToLocal(stokes->grid, stokes->grid->velocity, DLMMirrorVector, u, local));
  PetscCall(VecZeroEntries(p));
  PetscCall(VecGetArray(local, &x));
  PetscCall(VecGetArray(p, &y));
  ApplyRuns(stokes->grid, stokes->runs, &loop, PETSC_TRUE, x, y);
  PetscCall(VecRestoreArray(p, &y));
  PetscCall(VecRestoreArray(local, &x));
  PetscCall(DMRestoreLocalVector(stokes->grid->velocity, &local));
  PetscFunctionReturn(0);
}

static PetscErrorCode DivergenceMultTranspose(Mat mat, Vec p, Vec u)
{
  DLMStokes    stokes;
  Loop         loop;
  Vec          local;
  PetscScalar *x, *y;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(mat, &stokes));
  DLMUserCheck(!stokes->grid->half, stokes->grid->comm, "-box_mirror half with another solver of the fluid or of the bodies than the program's; allowed: -box_mirror none or whole");
  PetscCall(LoopSetUp(stokes->grid, &loop));
  PetscCall(DMGetLocalVector(stokes->grid->velocity, &local));
  PetscCall(VecZeroEntries(local));
  PetscCall(VecZeroEntries(u));
  PetscCall(VecGetArray(local, &x));
  PetscCall(VecGetArrayRead(p, (const PetscScalar **)&y));
  ApplyRuns(stokes->grid, stokes->runs, &loop, PETSC_FALSE, x, y);
  PetscCall(VecRestoreArrayRead(p, (const PetscScalar **)&y));
  PetscCall(VecRestoreArray(local, &x));
  PetscCall(DMLocalToGlobal(stokes->grid->velocity, local, ADD_VALUES, u));
  PetscCall(DMRestoreLocalVector(stokes->grid->velocity, &local));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesBuildDivergence(DLMStokes stokes)
{
  PetscFunctionBeginUser;
  PetscCall(BuildRuns(stokes->grid, PETSC_FALSE, &stokes->runs));
  PetscCall(MatCreateShell(stokes->grid->comm, stokes->n_p, stokes->n_u, PETSC_DETERMINE, PETSC_DETERMINE, stokes, &stokes->B));
  PetscCall(MatShellSetOperation(stokes->B, MATOP_MULT, (void (*)(void))DivergenceMult));
  PetscCall(MatShellSetOperation(stokes->B, MATOP_MULT_TRANSPOSE, (void (*)(void))DivergenceMultTranspose));
  PetscCall(MatCreateTranspose(stokes->B, &stokes->BT));
  PetscFunctionReturn(0);
}

/* g <- B w over the wall columns, w the wall velocity as a ghosted array. */
static PetscErrorCode SetWallFlux(DLMStokes stokes, PetscScalar *w, PetscScalar *g)
{
  DLMRunList *runs;
  Loop        loop;

  PetscFunctionBeginUser;
  PetscCall(LoopSetUp(stokes->grid, &loop));
  PetscCall(BuildRuns(stokes->grid, PETSC_TRUE, &runs));
  ApplyRuns(stokes->grid, runs, &loop, PETSC_TRUE, w, g);
  for (PetscInt i = 0; i < stokes->n_p; i++) g[i] = -g[i];
  PetscCall(PetscFree(runs));
  PetscFunctionReturn(0);
}

/*
  Velocity of a wall node. On an edge, component c follows the wall normal to axis c if the edge lies on it (so the flux through
  every wall is exact), else the mean of the walls that meet.
*/
static void WallVelocity(DLMGrid grid, const DLMScene *scene, const PetscInt node[3], PetscScalar w[3])
{
  int meet = 0;

  w[0] = w[1] = w[2] = 0.0;
  for (int d = 0; d < 3; d++) {
    if (grid->periodic[d] || (node[d] != 0 && node[d] != grid->cells[d])) continue;
    for (int c = 0; c < 3; c++) w[c] += scene->wall_velocity[d][node[d] ? 1 : 0][c];
    meet++;
  }
  for (int c = 0; c < 3; c++) {
    if (meet) w[c] /= meet;
    if (!grid->periodic[c] && (node[c] == 0 || node[c] == grid->cells[c])) w[c] = scene->wall_velocity[c][node[c] ? 1 : 0][c];
  }
}

/* Fills u with the wall velocity on wall nodes and zero elsewhere. */
static PetscErrorCode SetWallVelocity(DLMGrid grid, const DLMScene *scene, Vec u)
{
  PetscInt       start[3], width[3], i[3];
  PetscScalar ****x;

  PetscFunctionBeginUser;
  PetscCall(VecZeroEntries(u));
  PetscCall(DMDAGetCorners(grid->velocity, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  PetscCall(DMDAVecGetArrayDOF(grid->velocity, u, &x));
  for (i[2] = start[2]; i[2] < start[2] + width[2]; i[2]++)
    for (i[1] = start[1]; i[1] < start[1] + width[1]; i[1]++)
      for (i[0] = start[0]; i[0] < start[0] + width[0]; i[0]++)
        if (DLMGridOnWall(grid, i[0], i[1], i[2])) WallVelocity(grid, scene, i, x[i[2]][i[1]][i[0]]);
  PetscCall(DMDAVecRestoreArrayDOF(grid->velocity, u, &x));
  PetscFunctionReturn(0);
}

void DLMStokesAddPressureGradient(DLMStokes stokes, const PetscReal gradient[3], PetscReal factor, PetscScalar *f)
{
  DLMGrid         grid = stokes->grid;
  const PetscReal h3   = factor * grid->h * grid->h * grid->h;
  PetscInt        start[3], width[3];

  if (gradient[0] == 0.0 && gradient[1] == 0.0 && gradient[2] == 0.0) return;
  (void)DMDAGetCorners(grid->velocity, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]);
  for (PetscInt k = start[2]; k < start[2] + width[2]; k++)
    for (PetscInt j = start[1]; j < start[1] + width[1]; j++)
      for (PetscInt i = start[0]; i < start[0] + width[0]; i++, f += 3)
        for (int c = 0; c < 3 && !DLMGridOnWall(grid, i, j, k); c++) f[c] -= h3 * gradient[c];
}

/* Force on the velocity nodes: identity rows on the walls, what the wall columns move to the right. */
static PetscErrorCode SetWallForce(DLMStokes stokes, PetscScalar ****w, PetscScalar ****f)
{
  DLMGrid         grid = stokes->grid;
  const PetscReal a    = stokes->viscosity * grid->h;
  PetscInt        start[3], width[3];

  PetscFunctionBeginUser;
  PetscCall(DMDAGetCorners(grid->velocity, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  for (PetscInt k = start[2]; k < start[2] + width[2]; k++)
    for (PetscInt j = start[1]; j < start[1] + width[1]; j++)
      for (PetscInt i = start[0]; i < start[0] + width[0]; i++)
        for (int c = 0; c < 3; c++) {
          if (DLMGridOnWall(grid, i, j, k)) f[k][j][i][c] = 6.0 * a * w[k][j][i][c];
          else f[k][j][i][c] = a * (w[k][j][i - 1][c] + w[k][j][i + 1][c] + w[k][j - 1][i][c] + w[k][j + 1][i][c] + w[k - 1][j][i][c] + w[k + 1][j][i][c]);
        }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesBuildWallForce(DLMStokes stokes, const DLMScene *scene)
{
  DM           dm = stokes->grid->velocity;
  Vec          u, g, wall, local;
  PetscScalar ****w, ****f, *flat, *y;

  PetscFunctionBeginUser;
  PetscCall(DLMStokesCreateVec(stokes, &stokes->wall_force));
  PetscCall(DLMStokesGetParts(stokes, stokes->wall_force, &u, &g));
  PetscCall(DMGetGlobalVector(dm, &wall));
  PetscCall(DMGetLocalVector(dm, &local));
  PetscCall(SetWallVelocity(stokes->grid, scene, wall));
  PetscCall(DLMGridGlobalToLocal(stokes->grid, dm, DLMMirrorVector, wall, local));
  PetscCall(DMDAVecGetArrayDOF(dm, local, &w));
  PetscCall(DMDAVecGetArrayDOF(dm, u, &f));
  PetscCall(SetWallForce(stokes, w, f));
  PetscCall(DMDAVecRestoreArrayDOF(dm, u, &f));
  PetscCall(VecGetArray(u, &y));
  DLMStokesAddPressureGradient(stokes, scene->pressure_gradient, 1.0, y);
  PetscCall(VecRestoreArray(u, &y));
  PetscCall(DMDAVecRestoreArrayDOF(dm, local, &w));
  PetscCall(VecGetArray(local, &flat));
  PetscCall(VecGetArray(g, &y));
  PetscCall(SetWallFlux(stokes, flat, y));
  PetscCall(VecRestoreArray(g, &y));
  PetscCall(VecRestoreArray(local, &flat));
  PetscCall(DMRestoreLocalVector(dm, &local));
  PetscCall(DMRestoreGlobalVector(dm, &wall));
  PetscCall(DLMStokesRestoreParts(stokes, stokes->wall_force, &u, &g));
  PetscFunctionReturn(0);
}
