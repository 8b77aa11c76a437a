#include "../../include/private/polymerimpl.h"

/*
  Advection of the carried variable (components of the Cholesky factor or of log C) by the wave-like equation (docs/theory.md, P5; thesis 3.4.80-3.4.84):
  phi'' = div((u.grad phi) u), phi' = -u.grad phi at the start, lumped mass, sub-steps tau under a Courant bound. The first sub-step is
  Lax and Wendroff's; the later ones are three-level and conserve. A wall with normal velocity lets the fluid in with C = I or out freely.
*/
typedef struct {
  double **old;       /* owned: phi of the sub-step before; NULL: this is the first */
  double **phi;       /* owned: phi now, replaced by the next */
  PetscReal tau;
} Substep;

static void UpdateVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  const Substep *s     = context;
  const double   scale = 1.0 / row->mass;

  for (int k = 0; k < 6; k++) {
    const double *restrict r = p->r[k] + ghost;
    double *restrict       phi = s->phi[k] + own;
    if (!s->old)
      for (PetscInt x = 0; x < n; x++) phi[x] += scale * r[x];
    else {
      double *restrict old = s->old[k] + own;
      for (PetscInt x = 0; x < n; x++) {
        const double next = 2.0 * phi[x] - old[x] + scale * r[x];
        old[x]            = phi[x];
        phi[x]            = next;
      }
    }
  }
}

/* Cells that touch an owned node, as a block whose node (0,0,0) is at *base of the ghosted arrays. */
static void OwnCells(DLMPolymer p, long cells[3], PetscInt *base)
{
  const DLMPolymerBlock *b = &p->block;

  *base = 0;
  for (int d = 0; d < 3; d++) {
    const PetscBool lower = (PetscBool)(!p->grid->periodic[d] && b->start[d] == 0), upper = (PetscBool)(!p->grid->periodic[d] && b->start[d] + b->width[d] == p->grid->nodes[d]);
    const PetscInt  first = b->start[d] - (lower ? 0 : 1), last = b->start[d] + b->width[d] - (upper ? 2 : 1);
    cells[d] = last - first + 1;
    *base += (PetscInt)b->stride[d] * (first - b->ghost_start[d]);
  }
}

static PetscErrorCode AddResidual(DLMPolymer p, double *const phi[6], PetscReal first, PetscReal second)
{
  const double *at[6], *u[3];
  double       *r[6];
  long          cells[3];
  PetscInt      base;

  PetscFunctionBegin;
  PetscCall(DLMPolymerExchange(p, 6, phi, p->t));
  OwnCells(p, cells, &base);
  for (int k = 0; k < 6; k++) {
    PetscCall(PetscArrayzero(p->r[k], p->block.n_ghosted));
    at[k] = p->t[k] + base;
    r[k]  = p->r[k] + base;
  }
  for (int k = 0; k < 3; k++) u[k] = p->u[k] + base;
  DLMAdvectCells(cells, p->block.stride, p->grid->h, first, second, u, at, r, p->line, p->mirror);
  PetscFunctionReturn(0);
}

/* Nodes of walls through which fluid enters keep C = I: factor of the unit matrix, or zero logarithm. */
static void InflowVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  const DLMPolymerBlock *b   = &p->block;
  double *const         *phi = ((const Substep *)context)->phi;
  const double           unit = p->scene->polymer_form == DLM_FORM_LOG ? 0.0 : 1.0;
  const PetscInt         place[3] = { b->start[0] + own % b->width[0], b->start[1] + (own / b->width[0]) % b->width[1], b->start[2] + own / (b->width[0] * b->width[1]) };

  if (!wall) return;
  for (int d = 0; d < 3; d++) {
    if (p->grid->periodic[d] || (place[d] != 0 && place[d] != p->grid->cells[d])) continue;
    for (PetscInt x = 0; x < n; x++) {
      if ((place[d] ? -1.0 : 1.0) * p->u[d][ghost + x] <= 0.0) continue;
      for (int k = 0; k < 6; k++) phi[k][own + x] = k < 3 ? unit : 0.0;
    }
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
    DLMPolymerLines(p, UpdateVisit, &step);
    DLMPolymerLines(p, InflowVisit, &step);
  }
  PetscCall(PetscFree(history));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerAdvect(DLMPolymer p, PetscReal dt)
{
  const PetscBool logarithm = (PetscBool)(p->scene->polymer_form == DLM_FORM_LOG);
  long            bad;

  PetscFunctionBeginUser;
  if (!p->moves || !p->health.sound) PetscFunctionReturn(0);
  p->health.courant  = p->largest_speed * dt / p->grid->h;
  p->health.substeps = PetscMax(1, (PetscInt)PetscCeilReal(PetscMin(1e6, p->health.courant / p->scene->polymer_courant) - 1e-9));
  PetscCall(DLMPolymerCheckOut(p));
  bad = logarithm ? DLMTensorLog(p->block.n, p->c, p->c) : DLMTensorCholesky(p->block.n, p->c, p->c);
  PetscCall(DLMPolymerJudge(p, bad));
  if (p->health.sound) {
    p->mirror = (p->mirror + 1) % 4; /* of x1, x2: the four ways to cut a cube take turns */
    PetscCall(Walk(p, dt, p->health.substeps, p->c));
    if (logarithm) DLMTensorExp(p->block.n, p->c, p->c);
    else DLMTensorSquare(p->block.n, p->c, p->c);
  }
  PetscCall(DLMPolymerCheckIn(p));
  PetscFunctionReturn(0);
}
