#include "../../include/private/saddleimpl.h"

/* J L J^T of the block's markers, both triangles, column major. */
static PetscErrorCode AssemblePoints(DLMBlocks *blocks, const DLMMarkers *m, const PetscInt *sphere_of, PetscReal *S)
{
  DLMGrid        grid = blocks->stokes->grid;
  const PetscInt n    = 3 * m->n;
  PetscReal     *x;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(3 * m->n, &x));
  for (PetscInt i = 0; i < m->n; i++)
    for (int d = 0; d < 3; d++) x[3 * i + d] = (blocks->spheres->state[sphere_of[i]].center[d] + m->r[3 * i + d] - grid->lower[d]) / grid->h;
  for (PetscInt j = 0; j < m->n; j++)
    for (PetscInt i = j; i < m->n; i++) {
      PetscInt  shift[3] = { 0, 0, 0 };
      PetscReal entry[9];
      if (sphere_of[i] != sphere_of[j]) { /* nearest image of the other sphere */
        PetscReal d[3];
        PetscCall(DLMSpheresSeparation(blocks->spheres, sphere_of[j], sphere_of[i], d));
        for (int c = 0; c < 3; c++) {
          const PetscReal apart = blocks->spheres->state[sphere_of[i]].center[c] - blocks->spheres->state[sphere_of[j]].center[c];
          shift[c]              = (PetscInt)PetscFloorReal(0.5 + (apart - d[c]) / grid->h);
        }
      }
      DLMResponseEntry(blocks->response, grid, m, i, x + 3 * i, m, j, x + 3 * j, shift, entry);
      for (int v = 0; v < 3; v++)
        for (int c = 0; c < 3; c++) S[(3 * j + c) * n + 3 * i + v] = S[(3 * i + v) * n + 3 * j + c] = entry[3 * v + c];
    }
  PetscCall(PetscFree(x));
  PetscFunctionReturn(0);
}

/*
  Rows of x (the block's points of each sphere, 3 components, m columns of leading dimension n) -> rows of y (its multipliers): y = Q^T x, in
  the scale of the sphere's own cover.
*/
static PetscErrorCode ProjectRows(DLMBlocks *blocks, const DLMBlock *b, const PetscInt *first, PetscInt m, const PetscReal *x, PetscInt n, PetscReal *y)
{
  PetscInt to = 0;

  PetscFunctionBegin;
  for (PetscInt s = 0; s < b->n_spheres; s++) {
    const PetscReal        radius = blocks->scene->spheres[b->spheres[s]].radius;
    const DLMPointSetData *set;
    DLMCover               cover, own_cover;
    PetscCall(DLMPairingGetCover(blocks->scene, radius, &own_cover));
    PetscCall(DLMPairingGetBlockCover(blocks->scene, radius, &cover));
    PetscCall(DLMPairingGetPointSet(blocks->pairing, &cover, &set));
    const PetscReal scale = PetscSqrtReal((PetscReal)own_cover.n_points / cover.n_points);
    const PetscInt carried = set->Q ? set->n : 0, columns = set->Q ? set->m : 0, own = first[s + 1] - first[s] - carried;
    for (PetscInt j = 0; j < m; j++) {
      const PetscReal *p = x + j * n + 3 * first[s];
      PetscReal       *c = y + j * b->n + 3 * to;
      for (PetscInt q = 0; q < columns; q++) {
        PetscReal sum[3] = { 0.0, 0.0, 0.0 };
        for (PetscInt i = 0; i < carried; i++)
          for (int d = 0; d < 3; d++) sum[d] += set->Q[q * set->n + i] * p[3 * i + d];
        for (int d = 0; d < 3; d++) c[3 * q + d] = scale * sum[d];
      }
      PetscCall(PetscArraycpy(c + 3 * columns, p + 3 * carried, 3 * own));
    }
    to += columns + own;
  }
  PetscFunctionReturn(0);
}

static void Transpose(PetscInt rows, PetscInt columns, const PetscReal *x, PetscReal *y)
{
  for (PetscInt j = 0; j < columns; j++)
    for (PetscInt i = 0; i < rows; i++) y[i * columns + j] = x[j * rows + i];
}

/* factor <- S = Q^T J L J^T Q + epsilon. */
PetscErrorCode DLMBlockAssemble(DLMBlocks *blocks, DLMBlock *b, const DLMMarkers *m, const PetscInt *first, const PetscInt *sphere_of)
{
  const PetscInt n = 3 * m->n;
  PetscReal     *points, *half, *turned;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n * n, &points));
  PetscCall(AssemblePoints(blocks, m, sphere_of, points));
  b->harmonic = (PetscBool)(n != b->n);
  if (!b->harmonic) { /* as many multipliers as points: Q is the unit matrix */
    b->factor = points;
    PetscFunctionReturn(0);
  }
  PetscCall(PetscMalloc2(b->n * n, &half, b->n * n, &turned));
  PetscCall(PetscMalloc1(b->n * b->n, &b->factor));
  PetscCall(ProjectRows(blocks, b, first, n, points, n, half));
  Transpose(b->n, n, half, turned);
  PetscCall(ProjectRows(blocks, b, first, b->n, turned, n, b->factor));
  for (PetscInt s = 0, to = 0; s < b->n_spheres; s++) {
    DLMCover cover;
    PetscCall(DLMPairingGetCover(blocks->scene, blocks->scene->spheres[b->spheres[s]].radius, &cover));
    for (PetscInt i = 3 * DLM_STIFF_MULTIPLIERS; i < 3 * cover.n_multipliers; i++) b->factor[(to + i) * (b->n + 1)] += cover.compliance;
    to += 3 * cover.n_multipliers; /* harmonics come with surface points only, or inner ones behind them */
    PetscCall(DLMPairingGetBlockCover(blocks->scene, blocks->scene->spheres[b->spheres[s]].radius, &cover));
    to += 3 * (first[s + 1] - first[s] - cover.n_points);
  }
  PetscCall(PetscFree2(half, turned));
  PetscCall(PetscFree(points));
  PetscFunctionReturn(0);
}

/* Columns of R: Q^T of the points' velocity for unit V and omega of each sphere; zero for held components. */
PetscErrorCode DLMBlockFillRigid(DLMBlocks *blocks, DLMBlock *b, const DLMMarkers *m, const PetscInt *first)
{
  PetscReal *x;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(18 * m->n * b->n_spheres, &x));
  for (PetscInt s = 0; s < b->n_spheres; s++)
    for (int c = 0; c < 6; c++) {
      PetscReal U[6] = { 0.0 };
      if (DLMRigidHeld(blocks->scene, b->spheres[s], c)) continue;
      U[c] = 1.0;
      for (PetscInt i = first[s]; i < first[s + 1]; i++) DLMRigidVelocity(U, m->r + 3 * i, x + (6 * s + c) * 3 * m->n + 3 * i);
    }
  PetscCall(ProjectRows(blocks, b, first, 6 * b->n_spheres, x, 3 * m->n, b->R));
  PetscCall(PetscFree(x));
  PetscFunctionReturn(0);
}
