#include "../../include/private/saddleimpl.h"
#include <petscblaslapack.h>

/*
  A sphere's points and multipliers in a block. Matrices of one sphere keep the components apart, [column][component][point], so that Q^T is one
  matrix product; blocks hold them together, 3 multiplier + component.
*/
typedef struct {
  PetscInt         sphere, first, n_points, n, start; /* n: multipliers (3-vectors), from entry start of the block */
  PetscInt         carried, columns;                  /* Q: that many points carry that many multipliers; others are their own */
  const PetscReal *Q;
  PetscReal        scale;
  DLMCover         cover;
} Member;

static PetscErrorCode GetMember(DLMBlocks *blocks, PetscInt sphere, PetscInt first, PetscInt end, PetscInt start, Member *m)
{
  const PetscReal        radius = blocks->scene->spheres[sphere].radius;
  const DLMPointSetData *set;
  DLMCover               cover;

  PetscFunctionBegin;
  PetscCall(DLMPairingGetBlockCover(blocks->scene, radius, &cover));
  PetscCall(DLMPairingGetPointSet(blocks->pairing, &cover, &set));
  *m = (Member){ .sphere = sphere, .first = first, .n_points = end - first, .n = end - first, .start = start, .scale = 1.0 };
  PetscCall(DLMPairingGetCover(blocks->scene, radius, &m->cover));
  if (set->Q) {
    m->Q       = set->Q;
    m->carried = set->n;
    m->columns = set->m;
    m->n       = m->columns + m->n_points - m->carried;
    m->scale   = PetscSqrtReal((PetscReal)m->cover.n_points / cover.n_points);
  }
  PetscFunctionReturn(0);
}

/* The members of a block; free with PetscFree. */
static PetscErrorCode GetMembers(DLMBlocks *blocks, const DLMBlock *b, const PetscInt *first, Member **members)
{
  PetscFunctionBegin;
  PetscCall(PetscMalloc1(b->n_spheres, members));
  for (PetscInt s = 0, start = 0; s < b->n_spheres; start += 3 * (*members)[s++].n)
    PetscCall(GetMember(blocks, b->spheres[s], first[s], first[s + 1], start, &(*members)[s]));
  PetscFunctionReturn(0);
}

/* y[column][component][multiplier] <- Q^T x[column][component][point] */
static void Project(const Member *m, PetscInt columns, const PetscReal *x, PetscReal *y)
{
  const PetscInt own = m->n_points - m->carried;
  PetscBLASInt   rows = (PetscBLASInt)m->columns, n = 3 * (PetscBLASInt)columns, depth = (PetscBLASInt)m->carried;
  PetscBLASInt   ldx = (PetscBLASInt)m->n_points, ldy = (PetscBLASInt)m->n;
  PetscReal      zero = 0.0;

  if (m->Q) BLASgemm_("T", "N", &rows, &n, &depth, &m->scale, m->Q, &depth, x, &ldx, &zero, y, &ldy);
  for (PetscInt j = 0; j < 3 * columns; j++)
    for (PetscInt i = 0; i < own; i++) y[j * m->n + m->columns + i] = x[j * m->n_points + m->carried + i];
}

/* From the images of two spheres that are nearest to each other: what to add to nodes around sphere j, in h. */
static PetscErrorCode ImageShift(DLMBlocks *blocks, PetscInt i, PetscInt j, PetscInt shift[3])
{
  PetscReal d[3];

  PetscFunctionBegin;
  PetscCall(DLMSpheresSeparation(blocks->spheres, j, i, d));
  for (int c = 0; c < 3; c++) {
    const PetscReal apart = blocks->spheres->state[i].center[c] - blocks->spheres->state[j].center[c];
    shift[c]              = i == j ? 0 : (PetscInt)PetscFloorReal(0.5 + (apart - d[c]) / blocks->stokes->grid->h);
  }
  PetscFunctionReturn(0);
}

/* S[force, point of t][velocity, point of s] <- J L J^T between the points of two spheres; x: all points, in h from the lower corner. */
static PetscErrorCode PairPoints(DLMBlocks *blocks, PetscBool walled, const DLMMarkers *markers, const PetscReal *x, const Member *s, const Member *t,
                                 DLMResponseField *field, PetscReal *S)
{
  PetscInt shift[3];

  PetscFunctionBegin;
  PetscCall(ImageShift(blocks, s->sphere, t->sphere, shift));
  for (PetscInt j = 0; j < t->n_points; j++) {
    DLMResponseFieldSetPoint(field, blocks->response, blocks->stokes->grid, markers, t->first + j, x + 3 * (t->first + j));
    for (PetscInt i = s == t ? j : 0; i < s->n_points; i++) {
      PetscReal entry[9];
      DLMResponseFieldEntry(field, s->first + i, x + 3 * (s->first + i), shift, entry);
      if (walled) DLMResponseAddWalls(blocks->stokes->grid, blocks->stokes->viscosity, x + 3 * (t->first + j), x + 3 * (s->first + i), entry);
      for (int v = 0; v < 3; v++)
        for (int c = 0; c < 3; c++) {
          S[((c * t->n_points + j) * 3 + v) * s->n_points + i] = entry[3 * v + c];
          if (s == t) S[((v * t->n_points + i) * 3 + c) * s->n_points + j] = entry[3 * v + c];
        }
    }
  }
  PetscFunctionReturn(0);
}

/* Both triangles of the block <- Q^T S Q of a pair of spheres. S is overwritten; half and turned are work space. */
static void PairMultipliers(DLMBlock *b, const Member *s, const Member *t, PetscReal *S, PetscReal *half, PetscReal *turned)
{
  const PetscInt rows = 3 * s->n, columns = 3 * t->n_points;

  if (s->Q || t->Q) {
    Project(s, columns, S, half);
    for (PetscInt j = 0; j < columns; j++)
      for (PetscInt i = 0; i < rows; i++) turned[i * columns + j] = half[j * rows + i];
    Project(t, rows, turned, half);
    for (PetscInt j = 0; j < 3 * t->n; j++)
      for (PetscInt i = 0; i < rows; i++) S[j * rows + i] = half[i * 3 * t->n + j];
  }
  for (int c = 0; c < 3; c++)
    for (PetscInt r = 0; r < t->n; r++)
      for (int v = 0; v < 3; v++)
        for (PetscInt q = 0; q < s->n; q++) {
          const PetscInt i = s->start + 3 * q + v, j = t->start + 3 * r + c;
          b->factor[i * b->n + j] = b->factor[j * b->n + i] = S[((c * t->n + r) * 3 + v) * s->n + q];
        }
}

/* The compliance of a member on its diagonal block, column by column. */
static PetscErrorCode AddCompliance(DLMBlock *b, const Member *m)
{
  const PetscInt n = 3 * m->columns;
  PetscScalar   *unit, *column;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(n, &unit, n, &column));
  for (PetscInt j = 0; j < n; j++) {
    PetscCall(PetscArrayzero(column, n));
    unit[j] = 1.0;
    DLMCoverComply(&m->cover, 1.0, unit, column);
    unit[j] = 0.0;
    for (PetscInt i = 0; i < n; i++) b->factor[(m->start + j) * b->n + m->start + i] += column[i];
  }
  PetscCall(PetscFree2(unit, column));
  PetscFunctionReturn(0);
}

/* factor <- S = Q^T J L J^T Q + epsilon, pair by pair of spheres: all points of a large cluster at once would not fit the memory. */
PetscErrorCode DLMBlockAssemble(DLMBlocks *blocks, DLMBlock *b, const DLMMarkers *m, const PetscInt *first, const PetscInt *sphere_of)
{
  DLMGrid           grid = blocks->stokes->grid;
  const PetscBool   walled = DLMBlockWallGap(blocks, b, b->center) < PETSC_MAX_REAL;
  PetscInt          most = 0, room;
  DLMResponseField *field;
  PetscReal        *x, *S, *half, *turned;
  Member           *members;

  PetscFunctionBegin;
  b->harmonic = (PetscBool)(3 * m->n != b->n);
  PetscCall(GetMembers(blocks, b, first, &members));
  for (PetscInt s = 0; s < b->n_spheres; s++) most = PetscMax(most, 3 * members[s].n_points);
  room = b->harmonic ? most * most : 0;
  PetscCall(PetscMalloc4(3 * m->n, &x, most * most, &S, room, &half, room, &turned));
  PetscCall(PetscMalloc1(b->n * b->n, &b->factor));
  PetscCall(PetscNew(&field));
  for (PetscInt i = 0; i < m->n; i++)
    for (int d = 0; d < 3; d++) x[3 * i + d] = (blocks->spheres->state[sphere_of[i]].center[d] + m->r[3 * i + d] - grid->lower[d]) / grid->h;
  for (PetscInt t = 0; t < b->n_spheres; t++)
    for (PetscInt s = t; s < b->n_spheres; s++) {
      PetscCall(PairPoints(blocks, walled, m, x, &members[s], &members[t], field, S));
      PairMultipliers(b, &members[s], &members[t], S, half, turned);
    }
  for (PetscInt s = 0; s < b->n_spheres; s++) PetscCall(AddCompliance(b, &members[s]));
  PetscCall(PetscFree(field));
  PetscCall(PetscFree4(x, S, half, turned));
  PetscCall(PetscFree(members));
  PetscFunctionReturn(0);
}

/* Columns of R: Q^T of the points' velocity for unit V and omega of each sphere; zero for held components. */
PetscErrorCode DLMBlockFillRigid(DLMBlocks *blocks, DLMBlock *b, const DLMMarkers *m, const PetscInt *first)
{
  PetscReal *x, *y;
  Member    *members;

  PetscFunctionBegin;
  PetscCall(GetMembers(blocks, b, first, &members));
  PetscCall(PetscArrayzero(b->R, 6 * b->n_spheres * b->n));
  for (PetscInt s = 0; s < b->n_spheres; s++) {
    const Member *member = &members[s];
    PetscCall(PetscCalloc2(18 * member->n_points, &x, 18 * member->n, &y));
    for (int c = 0; c < 6; c++) {
      PetscReal U[6] = { 0.0 }, v[3];
      if (DLMRigidHeld(blocks->scene, member->sphere, c)) continue;
      U[c] = 1.0;
      for (PetscInt i = 0; i < member->n_points; i++) {
        DLMRigidVelocity(U, m->r + 3 * (member->first + i), v);
        for (int d = 0; d < 3; d++) x[(3 * c + d) * member->n_points + i] = v[d];
      }
    }
    Project(member, 6, x, y);
    for (int c = 0; c < 6; c++)
      for (PetscInt q = 0; q < member->n; q++)
        for (int d = 0; d < 3; d++) b->R[(6 * s + c) * b->n + member->start + 3 * q + d] = y[(3 * c + d) * member->n + q];
    PetscCall(PetscFree2(x, y));
  }
  PetscCall(PetscFree(members));
  PetscFunctionReturn(0);
}
