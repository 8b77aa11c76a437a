#include <math.h>
#include "../../include/private/polymerimpl.h"

/* The velocity of x, interleaved with two ghost layers, as planar arrays with one. */
static PetscErrorCode ReadVelocity(DLMPolymer p, Vec x)
{
  const DLMPolymerBlock *b = &p->block;
  const PetscScalar     *all;
  PetscScalar          ****v;
  PetscReal              speed = 0.0;
  Vec                    u, local;

  PetscFunctionBegin;
  PetscCall(DMGetGlobalVector(p->grid->velocity, &u));
  PetscCall(DMGetLocalVector(p->grid->velocity, &local));
  PetscCall(VecGetArrayRead(x, &all));
  PetscCall(VecPlaceArray(u, all));
  PetscCall(DLMGridGlobalToLocal(p->grid, p->grid->velocity, DLMMirrorVector, u, local));
  PetscCall(VecResetArray(u));
  PetscCall(VecRestoreArrayRead(x, &all));
  PetscCall(DMDAVecGetArrayDOFRead(p->grid->velocity, local, &v));
  for (PetscInt k = 0, q = 0; k < b->ghost_width[2]; k++)
    for (PetscInt j = 0; j < b->ghost_width[1]; j++) {
      const PetscScalar *line = v[b->ghost_start[2] + k][b->ghost_start[1] + j][b->ghost_start[0]];
      for (PetscInt i = 0; i < b->ghost_width[0]; i++, q++) {
        for (int c = 0; c < 3; c++) p->u[c][q] = line[3 * i + c];
        speed = PetscMax(speed, PetscAbsReal(line[3 * i]) + PetscAbsReal(line[3 * i + 1]) + PetscAbsReal(line[3 * i + 2]));
      }
    }
  PetscCall(DMDAVecRestoreArrayDOFRead(p->grid->velocity, local, &v));
  PetscCall(DMRestoreLocalVector(p->grid->velocity, &local));
  PetscCall(DMRestoreGlobalVector(p->grid->velocity, &u));
  PetscCallMPI(MPI_Allreduce(&speed, &p->largest_speed, 1, MPIU_REAL, MPIU_MAX, p->grid->comm));
  PetscFunctionReturn(0);
}

static void GradientVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  const double *u[3] = { p->u[0] + ghost, p->u[1] + ghost, p->u[2] + ghost };
  double       *g[9];

  for (int k = 0; k < 9; k++) g[k] = p->g[k] + own;
  DLMGradientLine(row, p->block.stride, n, u, g);
}

PetscErrorCode DLMPolymerTakeVelocity(DLMPolymer p, PetscReal time, Vec x)
{
  PetscFunctionBegin;
  PetscCall(ReadVelocity(p, x));
  if (!p->fresh) {
    DLMPolymerTurnGradient(p);
    p->velocity_time_before = p->velocity_time;
    p->n_velocities         = PetscMin(2, p->n_velocities + 1);
  }
  p->fresh = PETSC_TRUE;
  DLMPolymerLines(p, GradientVisit, NULL);
  p->velocity_time = time;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerSetVelocity(DLMPolymer p, PetscReal time, Vec x)
{
  PetscFunctionBeginUser;
  PetscCall(DLMPolymerTakeVelocity(p, time, x));
  PetscCall(DLMPolymerNearFlow(p, PETSC_FALSE));
  PetscFunctionReturn(0);
}

typedef struct {
  double *f;          /* interleaved, owned */
  double *line[3];
} ForceContext;

static void ForceVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  ForceContext *c = context;
  const double *T[6];
  double       *f = c->f + 3 * own;

  if (wall) { /* test functions vanish there */
    PetscArrayzero(f, 3 * n);
    return;
  }
  for (int k = 0; k < 6; k++) T[k] = p->t[k] + ghost;
  DLMForceLine(row, p->block.stride, n, T, c->line);
  for (PetscInt i = 0; i < n; i++)
    for (int k = 0; k < 3; k++) f[3 * i + k] = c->line[k][i];
}

/* f <- div T of the owned planar tensor T, whose ghosts are fetched here. */
static PetscErrorCode Divergence(DLMPolymer p, double *const T[6], Vec f)
{
  ForceContext c;

  PetscFunctionBegin;
  DLMPolymerWeighStress(p, T);
  PetscCall(DLMPolymerExchange(p, T, p->t));
  for (int k = 0; k < 3; k++) c.line[k] = p->line + (size_t)k * p->block.ghost_width[0];
  PetscCall(VecGetArray(f, &c.f));
  DLMPolymerLines(p, ForceVisit, &c);
  PetscCall(VecRestoreArray(f, &c.f));
  PetscFunctionReturn(0);
}

/* Viscosities at every owned node by the model's law: solvent[n], polymer[n]. At rest before the first velocity. */
static void Viscosities(DLMPolymer p, double *solvent, double *polymer)
{
  double *rate = p->scratch + 2 * (size_t)p->block.n, **g = p->g;

  for (PetscInt x = 0; x < p->block.n; x++)
    rate[x] = p->n_velocities ? PetscSqrtReal(2.0 * (g[0][x] * g[0][x] + g[4][x] * g[4][x] + g[8][x] * g[8][x]) + PetscSqr(g[1][x] + g[3][x]) + PetscSqr(g[2][x] + g[6][x]) +
                                       PetscSqr(g[5][x] + g[7][x])) :
                         0.0;
  p->model->viscosity(p->scene, p->block.n, rate, solvent, polymer);
}

/* The velocity's part of the force exists where the implicit operator does not hold the solvent's viscosity. */
static PetscBool HasViscousForce(DLMPolymer p)
{
  return (PetscBool)(p->n_velocities && (p->model->viscosity || p->scene->polymer_coupling == DLM_COUPLING_BOTH_SIDES));
}

/* Makes room for the force of a moment; the same moment again replaces the newest one. */
static void Push(DLMForceHistory *h, PetscReal time)
{
  const Vec room = h->spare;

  if (h->n > 0 && time == h->time_now) return;
  h->spare       = h->before;
  h->before      = h->now;
  h->now         = room;
  h->time_before = h->time_now;
  h->time_now    = time;
  h->n           = PetscMin(2, h->n + 1);
}

/* 2 D of component k at a node: now (g + h) - then (g0 + h0), the last velocity's, extrapolated from the one before if ahead > 0. */
typedef struct {
  const double *g, *h, *g0, *h0;
  double        now, then;
} Rate;

static Rate RateOf(DLMPolymer p, int k, double ahead)
{
  double *const before = p->gradient[1 - p->buffer];
  Rate          rate   = { .g = p->g[DLMEntryIJ[k]], .h = p->g[DLMEntryJI[k]], .now = 1.0 + ahead, .then = ahead };

  rate.g0 = ahead > 0.0 ? before + (size_t)DLMEntryIJ[k] * p->block.n : rate.g;
  rate.h0 = ahead > 0.0 ? before + (size_t)DLMEntryJI[k] * p->block.n : rate.h;
  return rate;
}

/* T <- (eta/lambda1)(C - I) + excess 2 D with constant viscosities; excess: solvent's less the implicit one. */
static void ConstantStress(DLMPolymer p, double eta, double excess, double ahead, double *const T[6])
{
  const double elastic = eta / p->scene->relaxation_time;

  for (int k = 0; k < 6; k++) {
    const Rate             rate = RateOf(p, k, ahead);
    const double           unit = k < 3 ? elastic : 0.0, now = excess * rate.now, then = excess * rate.then;
    const double *restrict c = p->c[k], *restrict g = rate.g, *restrict h = rate.h, *restrict g0 = rate.g0, *restrict h0 = rate.h0;
    double *restrict       t = T[k];
    for (PetscInt x = 0; x < p->block.n; x++) t[x] = elastic * c[x] - unit + now * (g[x] + h[x]) - then * (g0[x] + h0[x]);
  }
}

/* The same with viscosities and springs of the nodes: (eta/lambda1)(a C - b I) + 2 (mu - mu_implicit) D. */
static void LocalStress(DLMPolymer p, PetscBool viscous, double ahead, double *const T[6])
{
  const PetscInt  n    = p->block.n;
  const PetscReal rate = 1.0 / p->scene->relaxation_time, implicit = p->implicit_viscosity, part = p->scene->retardation_time * rate;
  double         *mu = p->scratch, *eta = mu + n, *a = eta + n, *b = a + n, *trace = T[0];

  if (p->model->viscosity) Viscosities(p, mu, eta);
  else
    for (PetscInt x = 0; x < n; x++) {
      mu[x]  = p->scene->fluid_viscosity * part;
      eta[x] = p->scene->fluid_viscosity - mu[x];
    }
  for (PetscInt x = 0; x < n; x++) {
    trace[x] = p->c[0][x] + p->c[1][x] + p->c[2][x];
    a[x] = b[x] = 1.0;
  }
  if (p->model->spring) p->model->spring(p->scene, n, trace, a, b);
  for (int k = 0; k < 6; k++) {
    const Rate    r = RateOf(p, k, ahead);
    const double *c = p->c[k], unit = k < 3 ? 1.0 : 0.0;
    for (PetscInt x = 0; x < n; x++)
      T[k][x] = rate * eta[x] * (a[x] * c[x] - unit * b[x]) + (viscous ? (mu[x] - implicit) * (r.now * (r.g[x] + r.h[x]) - r.then * (r.g0[x] + r.h0[x])) : 0.0);
  }
}

PetscErrorCode DLMPolymerExtraStress(DLMPolymer p, PetscReal ahead, double *const T[6])
{
  const PetscReal mu = p->scene->fluid_viscosity * p->scene->retardation_time / p->scene->relaxation_time;

  PetscFunctionBegin;
  PetscCall(DLMPolymerCheckOut(p));
  if (p->model->viscosity || p->model->spring) LocalStress(p, HasViscousForce(p), ahead, T);
  else ConstantStress(p, p->scene->fluid_viscosity - mu, HasViscousForce(p) ? mu - p->implicit_viscosity : 0.0, ahead, T);
  PetscCall(DLMPolymerCheckIn(p));
  PetscFunctionReturn(0);
}

static PetscReal Stiffness(DLMPolymer p)
{
  return PetscMax(1.0, p->health.largest_trace - 2.0);
}

/*
  What the projected gradient does not see has to resist with what the fluid has at a time: the solvent's viscosity and what of the polymer's has grown since the start
  from C = I; for the sake of stability with what grows within a step; and with a little where there is no solvent (V3).
*/
static PetscReal ViscosityAt(DLMPolymer p, PetscReal time)
{
  const DLMScene *s       = p->scene;
  const PetscReal solvent = s->fluid_viscosity * s->retardation_time / s->relaxation_time, grown = PetscMax(-expm1(-time / s->relaxation_time), p->growing);

  if (s->polymer_coupling == DLM_COUPLING_EXPLICIT) return s->implicit_viscosity;
  return PetscMax(solvent + PetscMin(1.0, grown) * (s->fluid_viscosity - solvent), 0.05 * s->fluid_viscosity);
}

PetscErrorCode DLMPolymerChooseViscosity(DLMPolymer p, PetscReal dt, PetscReal target, PetscReal *viscosity)
{
  PetscFunctionBeginUser;
  p->growing            = -Stiffness(p) * expm1(-dt / p->scene->relaxation_time);
  p->implicit_viscosity = *viscosity = ViscosityAt(p, target);
  PetscFunctionReturn(0);
}

/* Weights of the differences to the step before that bring force and velocity to the middle of a step, damped where V4 asks for it. */
static DLMLag LagOf(DLMPolymer p, PetscReal time, PetscReal target)
{
  const DLMScene        *s    = p->scene;
  const DLMForceHistory *h    = &p->force;
  const PetscReal        half = target - time, apart = p->velocity_time - p->velocity_time_before;
  const PetscReal        solvent = s->fluid_viscosity * s->retardation_time / s->relaxation_time;
  DLMLag                 lag = { .force = 0.5 }, weight = { 0.0, 0.0 };

  if (s->polymer_coupling == DLM_COUPLING_BOTH_SIDES)
    lag = DLMLagChoose(1.0 - solvent / p->implicit_viscosity, (s->fluid_viscosity - solvent) / p->implicit_viscosity, Stiffness(p), 2.0 * half / s->relaxation_time);
  if (p->model->viscosity && s->carreau_n != 1.0) lag.velocity = 0.0;
  if (h->n == 2) weight.force = 2.0 * lag.force * half / (h->time_now - h->time_before);
  if (p->n_velocities == 2 && lag.velocity > 0.0)
    weight.velocity = PetscMax(0.0, lag.velocity / (1.0 - lag.force) * ((target - p->velocity_time) / apart - weight.force));
  return weight;
}

PetscErrorCode DLMPolymerForce(DLMPolymer p, PetscReal time, PetscReal target, PetscInt order, Vec f)
{
  const PetscReal  implicit = p->implicit_viscosity;
  DLMForceHistory *h        = &p->force;
  DLMLag           weight   = { 0.0, 0.0 };

  PetscFunctionBeginUser;
  if (order >= 2) {
    Push(h, time);
    weight = LagOf(p, time, target);
    p->implicit_viscosity = (implicit + weight.force * ViscosityAt(p, h->time_before)) / (1.0 + weight.force); /* the extrapolation makes it that of the target again */
  }
  PetscCall(DLMPolymerExtraStress(p, weight.velocity, p->r));
  p->implicit_viscosity = implicit;
  PetscCall(Divergence(p, p->r, order < 2 ? f : h->now));
  PetscCall(DLMPolymerSumInside(p));
  if (order < 2) PetscFunctionReturn(0);
  PetscCall(VecCopy(h->now, f));
  if (weight.force != 0.0) PetscCall(VecAXPBY(f, -weight.force, 1.0 + weight.force, h->before));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerGetWork(DLMPolymer p, Vec u, PetscReal *stress_work, PetscReal *stretching)
{
  const PetscInt n = p->block.n;
  double *const *T = p->r, *mass = p->scratch;
  PetscReal      sum = 0.0;
  Vec            f;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(u, &f));
  p->n_velocities = 0; /* the elastic stress alone */
  PetscCall(DLMPolymerExtraStress(p, 0.0, T));
  PetscCall(Divergence(p, T, f));
  PetscCall(VecDot(f, u, stress_work));
  PetscCall(DLMPolymerTakeVelocity(p, p->velocity_time, u));
  DLMPolymerLines(p, DLMPolymerMassVisit, mass);
  for (PetscInt x = 0; x < n; x++)
    sum -= mass[x] * (T[0][x] * p->g[0][x] + T[1][x] * p->g[4][x] + T[2][x] * p->g[8][x] + T[3][x] * (p->g[1][x] + p->g[3][x]) +
                      T[4][x] * (p->g[2][x] + p->g[6][x]) + T[5][x] * (p->g[5][x] + p->g[7][x]));
  PetscCallMPI(MPI_Allreduce(&sum, stretching, 1, MPIU_REAL, MPIU_SUM, p->grid->comm));
  PetscCall(VecDestroy(&f));
  PetscFunctionReturn(0);
}
