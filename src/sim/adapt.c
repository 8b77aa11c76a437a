#include <petsc/private/tsimpl.h>
#include "../../include/private/simimpl.h"

/*
  TSAdapt type `scene` (docs/theory.md, T4). Watched: the mean rates over a step of what moves, V/a and omega of every sphere and the mean of C. A step's
  error is dt times what its rates differ from those foretold by the steps before, extrapolated under an order-2 scheme; it is allowed -ts_rtol.
*/
enum { TENSOR = 6, PER_SPHERE = 6 };

/* The next step is also no longer than: cells a sphere moves by on the mesh, part of a gap that two bodies close, Courant number, lambda1. */
static const PetscReal most_cells = 2.0, most_gap = 0.3, most_courant = 4.0, most_lambda = 0.5;
/* Steps shorter than this part of -ts_dt are accepted whatever their error. */
static const PetscReal shortest = 1e-4;

static PetscErrorCode MeanConformation(DLMSimulation sim, PetscReal mean[TENSOR])
{
  PetscInt           n, all;
  Vec                C;
  const PetscScalar *c;

  PetscFunctionBegin;
  PetscCall(DLMPolymerGetConformation(sim->polymer, &C));
  PetscCall(VecGetLocalSize(C, &n));
  PetscCall(VecGetSize(C, &all));
  PetscCall(VecGetArrayRead(C, &c));
  PetscCall(PetscArrayzero(mean, TENSOR));
  for (PetscInt x = 0; x < n; x++) mean[x / (n / TENSOR)] += c[x];
  PetscCall(VecRestoreArrayRead(C, &c));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, mean, TENSOR, MPIU_REAL, MPIU_SUM, sim->scene->comm));
  for (int k = 0; k < TENSOR; k++) mean[k] *= (PetscReal)TENSOR / all;
  PetscFunctionReturn(0);
}

/* The rates of the step of length h that has just been made. */
static PetscErrorCode Rates(DLMSimulation sim, PetscReal h, PetscReal *rate)
{
  const DLMScene *scene = sim->scene;
  DLMSphereState *state;
  PetscReal       mean[TENSOR];
  PetscInt        n = 0;

  PetscFunctionBegin;
  if (sim->spheres) PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
  for (PetscInt i = 0; i < n; i++)
    for (int d = 0; d < 3; d++) {
      *rate++ = state[i].velocity[d] / scene->spheres[i].radius;
      *rate++ = state[i].omega[d];
    }
  if (!sim->polymer) PetscFunctionReturn(0);
  PetscCall(MeanConformation(sim, mean));
  const PetscReal size = PetscMax(1.0, (mean[0] + mean[1] + mean[2]) / 3.0);
  for (int k = 0; k < TENSOR; k++) *rate++ = (mean[k] - sim->adapt.mean[k]) / (h * size);
  PetscFunctionReturn(0);
}

/* Without inertia and polymer the rates of the start are known, so that the first step has something to be compared with. */
PetscErrorCode DLMAdaptStart(DLMSimulation sim)
{
  DLMAdaptState *a = &sim->adapt;

  PetscFunctionBegin;
  if (!a->exists || sim->polymer || sim->first_step >= 0 || sim->scene->sphere_inertia) PetscFunctionReturn(0);
  PetscCall(Rates(sim, 1.0, a->rate[1]));
  a->known = 1;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMAdaptNoteConformation(DLMSimulation sim)
{
  PetscFunctionBegin;
  if (sim->adapt.exists) PetscCall(MeanConformation(sim, sim->adapt.mean));
  PetscFunctionReturn(0);
}

/* Largest error of the step over rtol; *order: the power of h it falls with, 0 if there is nothing to compare with. */
static PetscReal Error(DLMSimulation sim, PetscReal h, PetscReal rtol, PetscInt scheme_order, PetscInt *order)
{
  const DLMAdaptState *a = &sim->adapt;
  const PetscReal     *new = a->rate[2], *now = a->rate[1], *before = a->rate[0];
  PetscReal            largest = 0.0, ahead = 0.0;

  *order = a->known > 0 ? (scheme_order == 2 && a->known > 1 ? 3 : 2) : 0;
  if (*order == 0) return 0.0;
  if (*order == 3) ahead = (h + a->interval[1]) / (a->interval[1] + a->interval[0]);
  for (PetscInt k = 0; k < a->n; k++) largest = PetscMax(largest, PetscAbsReal(new[k] - now[k] - ahead * (now[k] - before[k])));
  return h * largest / rtol;
}

static void Remember(DLMAdaptState *a, PetscReal h)
{
  PetscReal *room = a->rate[0];

  a->rate[0]     = a->rate[1];
  a->rate[1]     = a->rate[2];
  a->rate[2]     = room;
  a->interval[0] = a->interval[1];
  a->interval[1] = h;
  a->known       = PetscMin(2, a->known + 1);
}

/* Longest step in which no two bodies close more than a part of their gap, at their present velocities; the contact's range is left alone. */
static PetscErrorCode GapLimit(DLMSimulation sim, const DLMSphereState *state, PetscReal *limit)
{
  const DLMScene *scene = &sim->riding;
  PetscReal       reach = 0.0;
  PetscInt        n, *pairs;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < scene->n_spheres; i++) reach = PetscMax(reach, scene->spheres[i].radius);
  PetscCall(DLMSpheresFindPairs(sim->spheres, reach, &n, &pairs));
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt i = pairs[2 * k], j = pairs[2 * k + 1];
    PetscReal      d[3], distance, closing = 0.0;
    PetscCall(DLMSpheresSeparation(sim->spheres, i, j, d));
    distance = PetscSqrtReal(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int c = 0; c < 3; c++) closing += (state[i].velocity[c] - state[j].velocity[c]) * d[c] / distance;
    if (closing > 0.0)
      *limit = PetscMin(*limit, most_gap * PetscMax(distance - scene->spheres[i].radius - scene->spheres[j].radius, sim->contact.range) / closing);
  }
  PetscCall(PetscFree(pairs));
  for (PetscInt i = 0; i < scene->n_spheres; i++)
    for (int d = 0; d < 3; d++) {
      const PetscReal v = state[i].velocity[d], gap = 0.5 * scene->box_size[d] - scene->spheres[i].radius - (v > 0.0 ? state[i].center[d] : -state[i].center[d]);
      if (!scene->box_periodic[d] && v != 0.0) *limit = PetscMin(*limit, most_gap * PetscMax(gap, sim->contact.range) / PetscAbsReal(v));
    }
  PetscFunctionReturn(0);
}

static PetscErrorCode Limit(DLMSimulation sim, PetscReal h, PetscReal *limit)
{
  const DLMScene  *scene = sim->scene;
  DLMSphereState  *state;
  DLMPolymerHealth health;
  PetscInt         n;

  PetscFunctionBegin;
  *limit = PETSC_INFINITY;
  if (sim->spheres) {
    PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
    for (PetscInt i = 0; i < n; i++)
      for (int d = 0; d < 3; d++)
        if (state[i].velocity[d] != 0.0) *limit = PetscMin(*limit, most_cells * scene->h / PetscAbsReal(state[i].velocity[d]));
    if (sim->contact.exists) PetscCall(GapLimit(sim, state, limit));
  }
  if (!sim->polymer) PetscFunctionReturn(0);
  PetscCall(DLMPolymerGetHealth(sim->polymer, &health));
  *limit = PetscMin(*limit, most_lambda * scene->relaxation_time);
  if (health.courant > 0.0) *limit = PetscMin(*limit, h * most_courant / health.courant);
  if (scene->polymer_coupling == DLM_COUPLING_EXPLICIT) *limit = PetscMin(*limit, 0.5 * DLMSimulationExplicitBound(sim));
  PetscFunctionReturn(0);
}

static PetscErrorCode Choose(TSAdapt adapt, TS ts, PetscReal h, PetscInt *scheme, PetscReal *next, PetscBool *accept, PetscReal *wlte, PetscReal *wltea, PetscReal *wlter)
{
  DLMSimulation  sim;
  DLMAdaptState *a;
  PetscReal      limit, factor = adapt->clip[1];
  PetscInt       scheme_order, order;

  PetscFunctionBegin;
  PetscCall(TSGetApplicationContext(ts, &sim));
  a = &sim->adapt;
  PetscCall(DLMSplitGetScheme(ts, NULL, &scheme_order));
  PetscCall(Rates(sim, h, a->rate[2]));
  *wlte = Error(sim, h, ts->rtol, scheme_order, &order);
  if (order > 0) factor = *wlte > 0.0 ? PetscClipInterval(adapt->safety * PetscPowReal(*wlte, -1.0 / order), adapt->clip[0], adapt->clip[1]) : adapt->clip[1];
  *accept = (PetscBool)(*wlte <= 1.0 || adapt->always_accept || h <= adapt->dt_min);
  if (*accept) Remember(a, h);
  PetscCall(Limit(sim, h, &limit));
  *next   = PetscClipInterval(PetscMin(h * factor, limit), adapt->dt_min, adapt->dt_max);
  *scheme = 0;
  *wltea = *wlter = -1.0;
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateAdapt(TSAdapt adapt)
{
  PetscFunctionBegin;
  adapt->ops->choose = Choose;
  PetscCall(TSAdaptSetClip(adapt, 0.2, 2.0));
  PetscCall(TSAdaptSetSafety(adapt, 0.8, 0.5));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMAdaptRegister(void)
{
  static PetscBool done = PETSC_FALSE;

  PetscFunctionBegin;
  if (!done) PetscCall(TSAdaptRegister("scene", CreateAdapt));
  done = PETSC_TRUE;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMAdaptCreate(DLMSimulation sim)
{
  DLMAdaptState *a = &sim->adapt;
  TSAdapt        adapt;

  PetscFunctionBegin;
  PetscCall(TSGetAdapt(sim->ts, &adapt));
  PetscCall(PetscObjectTypeCompare((PetscObject)adapt, "scene", &a->exists));
  if (!a->exists) PetscFunctionReturn(0);
  a->n = PER_SPHERE * sim->scene->n_spheres + (sim->polymer ? TENSOR : 0);
  for (int k = 0; k < 3; k++) PetscCall(PetscCalloc1(a->n, &a->rate[k]));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-saddle_rtol", &a->own_rtol));
  adapt->dt_min = PetscMax(adapt->dt_min, shortest * sim->scene->ts_dt);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMAdaptDestroy(DLMSimulation sim)
{
  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) PetscCall(PetscFree(sim->adapt.rate[k]));
  PetscFunctionReturn(0);
}

/* A relative error e of the velocities moves a sphere by e |V| dt, and turns its surface by e |omega| a dt: a fiftieth of what the step is
   allowed, since such errors add up. */
PetscErrorCode DLMAdaptSetTolerance(DLMSimulation sim, PetscReal dt)
{
  DLMSphereState *state;
  PetscReal       fastest = 0.0;
  PetscInt        n;

  PetscFunctionBegin;
  if (!sim->adapt.exists || sim->adapt.own_rtol || !sim->spheres) PetscFunctionReturn(0);
  PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
  for (PetscInt i = 0; i < n; i++)
    for (int d = 0; d < 3; d++) fastest = PetscMax(fastest, PetscMax(PetscAbsReal(state[i].velocity[d]) / sim->scene->spheres[i].radius, PetscAbsReal(state[i].omega[d])));
  PetscCall(DLMSaddleSetTolerance(sim->saddle, PetscClipInterval(0.02 * sim->ts->rtol / PetscMax(fastest * dt, 1e-30), 1e-8, 1e-3)));
  PetscFunctionReturn(0);
}
