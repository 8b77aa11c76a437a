#include "../../include/private/polymerimpl.h"

/*
  Advection of the carried variable (components of the Cholesky factor or of log C) by the wave-like equation (docs/theory.md, V5; thesis 3.4.80-3.4.84):
  phi'' = div((u.grad phi) u), phi' = -u.grad phi at the start, lumped mass, sub-steps tau under a Courant bound. The first sub-step is
  Lax and Wendroff's; the later ones are three-level and conserve. A wall with normal velocity lets the fluid in with C = I or out freely.
*/
typedef struct {
  double **old;       /* owned: phi of the sub-step before; NULL: this is the first */
  double **phi;       /* owned: phi now, replaced by the next */
  PetscReal tau;
} Substep;

/* Velocity of the fluid through a wall of axis d into the box, as the scene has it: the velocity itself may hold rounding there. */
static double Inward(DLMPolymer p, int d, PetscInt node)
{
  if (p->grid->periodic[d] || (node != 0 && node != p->grid->cells[d])) return 0.0;
  return (node ? -1.0 : 1.0) * p->scene->wall_velocity[d][node != 0][d];
}

/*
  The term of a wall through which fluid leaves, int u.n phi' phi_a over it, lumped and over twice the mass; phi' by the difference in time of the
  scheme. Without it the wall reflects (thesis 3.4.83).
*/
static double Outflow(DLMPolymer p, PetscInt own)
{
  PetscInt node[3];
  double   sum = 0.0;

  DLMPolymerNode(p, own, node);
  for (int d = 0; d < 3; d++) sum += PetscMax(0.0, -Inward(p, d, node[d])) / p->grid->h;
  return sum;
}

static void UpdateVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  const Substep *s     = context;
  const double   beta  = wall ? s->tau * Outflow(p, own) : 0.0;
  const double   scale = 1.0 / (row->mass * (1.0 + beta)), now = 2.0 / (1.0 + beta), before = (1.0 - beta) / (1.0 + beta);

  for (int k = 0; k < 6; k++) {
    const double *restrict r = p->r[k] + ghost;
    double *restrict       phi = s->phi[k] + own;
    if (!s->old)
      for (PetscInt x = 0; x < n; x++) phi[x] += scale * r[x];
    else {
      double *restrict old = s->old[k] + own;
      for (PetscInt x = 0; x < n; x++) {
        const double next = now * phi[x] - before * old[x] + scale * r[x];
        old[x]            = phi[x];
        phi[x]            = next;
      }
    }
  }
}

/* Cells that touch an owned node. */
static void OwnCells(DLMPolymer p, PetscInt first[3], PetscInt last[3])
{
  const DLMPolymerBlock *b = &p->block;

  for (int d = 0; d < 3; d++) {
    const PetscBool lower = (PetscBool)(DLMGridHasEnds(p->grid, d) && b->start[d] == 0);
    const PetscBool upper = (PetscBool)(DLMGridHasEnds(p->grid, d) && b->start[d] + b->width[d] == p->grid->nodes[d]);
    first[d] = b->start[d] - (lower ? 0 : 1);
    last[d]  = b->start[d] + b->width[d] - (upper ? 2 : 1);
  }
}

/* Where a cell's node (0,0,0) is in the ghosted arrays. */
static PetscInt CellBase(DLMPolymer p, const PetscInt cell[3])
{
  PetscInt base = 0;

  for (int d = 0; d < 3; d++) base += (PetscInt)p->block.stride[d] * (cell[d] - p->block.ghost_start[d]);
  return base;
}

/* Beyond a mirror the cubes are cut in mirror images, so its nodes get the same again from there, but for components that the mirror turns round. */
static void MirrorVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  PetscInt node[3];

  DLMPolymerNode(p, own, node);
  if (DLMGridImages(p->grid, node[1]) > 1) return;
  for (int k = 0; k < 6; k++)
    for (PetscInt x = 0; x < n; x++) p->r[k][ghost + x] *= 1.0 + DLMMirrorTensor[k];
}

/* The cell lies in the lower half of an axis; one beyond a periodic face counts where its image is. */
static PetscBool InLowerHalf(DLMPolymer p, int axis, PetscInt cell)
{
  const PetscInt n = p->grid->cells[axis];

  return (PetscBool)((cell + n) % n < n / 2);
}

/*
  On a mesh that is its own mirror image in x2 the cut turns round at that plane. So that the mesh is also its own image under a point reflection, as a sphere in the middle needs,
  it turns round at the middle of x3 as well, where the faces of the tetrahedra then do not match (V5).
*/
static int CutOf(DLMPolymer p, PetscInt j, PetscInt k)
{
  const PetscBool below = (PetscBool)(!p->grid->half && InLowerHalf(p, 1, j));

  return p->grid->symmetric && below != InLowerHalf(p, 2, k) ? p->cut ^ 2 : p->cut;
}

static PetscErrorCode AddResidual(DLMPolymer p, double *const phi[6], PetscReal first, PetscReal second)
{
  PetscInt low[3], high[3];

  PetscFunctionBegin;
  PetscCall(DLMPolymerExchange(p, phi, p->t));
  OwnCells(p, low, high);
  for (int m = 0; m < 6; m++) PetscCall(PetscArrayzero(p->r[m], p->block.n_ghosted));
  for (PetscInt k = low[2], above; k <= high[2]; k = above) {
    for (above = k + 1; above <= high[2] && CutOf(p, low[1], above) == CutOf(p, low[1], k); above++);
    for (PetscInt j = low[1], next; j <= high[1]; j = next) {
      const PetscInt base = CellBase(p, (PetscInt[3]){ low[0], j, k });
      const double  *at[6], *u[3];
      double        *r[6];
      for (next = j + 1; next <= high[1] && CutOf(p, next, k) == CutOf(p, j, k); next++);
      for (int m = 0; m < 6; m++) {
        at[m] = p->t[m] + base;
        r[m]  = p->r[m] + base;
      }
      for (int c = 0; c < 3; c++) u[c] = p->u[c] + base;
      DLMAdvectCells((long[3]){ high[0] - low[0] + 1, next - j, above - k }, p->block.stride, p->grid->h, first, second, CutOf(p, j, k), u, at, r);
    }
  }
  if (p->grid->half) DLMPolymerLines(p, MirrorVisit, NULL);
  PetscFunctionReturn(0);
}

/* Nodes of walls through which fluid enters keep C = I: factor of the unit matrix, or zero logarithm. */
static void InflowVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  double *const *phi  = ((const Substep *)context)->phi;
  const double   unit = p->scene->polymer_form == DLM_FORM_LOG ? 0.0 : 1.0;
  PetscInt       node[3];

  if (!wall) return;
  DLMPolymerNode(p, own, node);
  for (int d = 0; d < 3; d++)
    for (int k = 0; k < 6 && Inward(p, d, node[d]) > 0.0; k++)
      for (PetscInt x = 0; x < n; x++) phi[k][own + x] = k < 3 ? unit : 0.0;
}

/*
  At a wall without flow through it the weights phi_a of the residual have their centre 5/12 h inside the fluid, so it is there that r/m is the rate of
  change; at nodes inside it is at the node. A line through the two gives the rate at the wall, without which the scheme is of first order there. Edges
  of two walls are left as they are.
*/
static void WallRateVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  PetscInt node[3];
  int      axis = -1, walls = 0;
  long     in;

  if (!wall) return;
  DLMPolymerNode(p, own, node);
  for (int d = 0; d < 3; d++) {
    if (p->grid->periodic[d] || (node[d] != 0 && node[d] != p->grid->cells[d])) continue;
    if (Inward(p, d, node[d]) != 0.0) return;
    axis = d;
    walls++;
  }
  if (walls != 1) return;
  in = node[axis] ? -p->block.stride[axis] : p->block.stride[axis];
  for (int k = 0; k < 6; k++) {
    double *r = p->r[k] + ghost;
    for (PetscInt x = 0; x < n; x++) r[x] = (12.0 * r[x] - 5.0 * 0.5 * r[x + in]) / 7.0; /* the mass of the inner node is twice that of the wall's */
  }
}

static PetscErrorCode Walk(DLMPolymer p, PetscReal dt, PetscInt Q, double **phi)
{
  const PetscReal tau = dt / Q;
  double         *history = NULL, *old[6];
  Substep         step    = { NULL, phi, tau };

  PetscFunctionBegin;
  if (Q > 1) PetscCall(PetscMalloc1(6 * (size_t)p->block.n, &history));
  for (int k = 0; k < 6; k++) old[k] = history + (Q > 1 ? (size_t)k * p->block.n : 0);
  for (PetscInt q = 0; q < Q; q++) {
    if (q == 0) {
      for (int k = 0; k < 6 && Q > 1; k++) PetscCall(PetscArraycpy(old[k], phi[k], p->block.n));
      PetscCall(AddResidual(p, phi, tau, 0.5 * tau * tau));
    } else {
      step.old = old;
      PetscCall(AddResidual(p, phi, 0.0, tau * tau));
    }
    DLMPolymerLines(p, WallRateVisit, NULL);
    DLMPolymerLines(p, UpdateVisit, &step);
    DLMPolymerLines(p, InflowVisit, &step);
  }
  PetscCall(PetscFree(history));
  PetscFunctionReturn(0);
}

enum { MOST_SUBSTEPS = 1000 }; /* an interval that needs more has lost its flow */

/* An owned node of the largest speed, or -1. */
static long FastestNode(DLMPolymer p)
{
  for (PetscInt x = 0; x < p->block.n; x++) {
    PetscInt node[3];
    long     at = 0;
    DLMPolymerNode(p, x, node);
    for (int d = 0; d < 3; d++) at += p->block.stride[d] * (node[d] - p->block.ghost_start[d]);
    if (PetscAbsReal(p->u[0][at]) + PetscAbsReal(p->u[1][at]) + PetscAbsReal(p->u[2][at]) >= p->largest_speed) return x;
  }
  return -1;
}

PetscErrorCode DLMPolymerAdvect(DLMPolymer p, PetscReal dt)
{
  const PetscBool logarithm = (PetscBool)(p->scene->polymer_form == DLM_FORM_LOG);
  PetscReal       needed;
  long            bad;

  PetscFunctionBeginUser;
  if (!p->n_velocities || !p->health.sound) PetscFunctionReturn(0);
  p->health.courant = p->largest_speed * dt / p->grid->h;
  needed            = PetscCeilReal(p->health.courant / p->scene->polymer_courant - 1e-9);
  if (!(needed <= MOST_SUBSTEPS)) {
    PetscCall(DLMPolymerJudge(p, FastestNode(p)));
    PetscFunctionReturn(0);
  }
  p->health.substeps = PetscMax(1, (PetscInt)needed);
  PetscCall(DLMPolymerCheckOut(p));
  bad = logarithm ? DLMTensorLog(p->block.n, p->c, p->c) : DLMTensorCholesky(p->block.n, p->c, p->c);
  PetscCall(DLMPolymerJudge(p, bad));
  if (p->health.sound) {
    p->cut = (p->cut + 1) % 4; /* of x1, x2: the four ways to cut a cube take turns */
    PetscCall(Walk(p, dt, p->health.substeps, p->c));
    if (logarithm) DLMTensorExp(p->block.n, p->c, p->c);
    else DLMTensorSquare(p->block.n, p->c, p->c);
  }
  PetscCall(DLMPolymerCheckIn(p));
  PetscFunctionReturn(0);
}
