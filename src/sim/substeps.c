#include "../../include/private/simimpl.h"

/*
  The verbs of a Newtonian step. Centres: predict moves them with the last velocity over its fraction of dt and correct brings them from the start
  of the step over the whole of it with the new one.
*/
static PetscErrorCode MoveFromStart(DLMSimulation sim, PetscReal time)
{
  DLMSphereState *state;
  PetscInt        n;

  PetscFunctionBegin;
  PetscCall(DLMLubricationUpdate(&sim->lubrication, sim->spheres)); /* gaps where the centres are before the move */
  PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
  for (PetscInt i = 0; i < n; i++)
    for (int d = 0; d < 3; d++) state[i].center[d] = sim->start[3 * i + d] + time * state[i].velocity[d];
  PetscCall(DLMLubricationKeepGaps(&sim->lubrication, sim->spheres, sim->start, time));
  PetscFunctionReturn(0);
}

static PetscErrorCode Predict(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  DLMSimulation   sim = (DLMSimulation)context;
  DLMSphereState *state;
  PetscInt        n;

  PetscFunctionBegin;
  PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
  for (PetscInt i = 0; i < n; i++)
    for (int d = 0; d < 3; d++) sim->start[3 * i + d] = state[i].center[d];
  PetscCall(MoveFromStart(sim, fraction * dt));
  PetscFunctionReturn(0);
}

static PetscErrorCode Correct(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  PetscFunctionBegin;
  PetscCall(MoveFromStart((DLMSimulation)context, fraction * dt));
  PetscFunctionReturn(0);
}

/* Buoyancy (1 - rho_f/rho_s) M g, what the scene prescribes, and the mean pressure gradient on the sphere's volume. */
static void ScenePush(const DLMScene *scene, PetscInt i, PetscReal force[3], PetscReal torque[3])
{
  const DLMSphereSpec *spec   = &scene->spheres[i];
  const PetscReal      volume = 4.0 / 3.0 * PETSC_PI * spec->radius * spec->radius * spec->radius;

  for (int d = 0; d < 3; d++) {
    force[d]  = spec->force[d] + (spec->density - scene->fluid_density) * volume * scene->gravity[d];
    torque[d] = spec->torque[d];
  }
}

static PetscErrorCode Forces(DLMSimulation sim)
{
  PetscFunctionBegin;
  PetscCall(DLMContactForces(&sim->contact, sim->spheres, sim->force));
  for (PetscInt i = 0; i < sim->scene->n_spheres; i++) {
    PetscReal push[3];
    ScenePush(sim->scene, i, push, sim->torque + 3 * i);
    for (int d = 0; d < 3; d++) sim->force[3 * i + d] += push[d];
  }
  PetscFunctionReturn(0);
}

/* The state stays finite and the centres stay between the walls, or the run stops here. */
static PetscErrorCode CheckStates(DLMSimulation sim, PetscReal t)
{
  DLMSphereState *state;
  PetscInt        n;

  PetscFunctionBegin;
  PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
  for (PetscInt i = 0; i < n; i++)
    for (int d = 0; d < 3; d++) {
      const PetscReal x = state[i].center[d], half = 0.5 * sim->scene->box_size[d];
      DLMUserCheck(!PetscIsInfOrNanReal(x) && !PetscIsInfOrNanReal(state[i].velocity[d]), sim->scene->comm,
                   "the state of sphere %" PetscInt_FMT " is no longer finite at t = %.6g: use a smaller -ts_dt", i, (double)t);
      DLMUserCheck(sim->scene->box_periodic[d] || PetscAbsReal(x) < half, sim->scene->comm,
                   "sphere %" PetscInt_FMT " left the box through a wall of axis x%d at t = %.6g (centre at %.6g, allowed: -%.6g to %.6g): use a smaller -ts_dt or a larger -contact_stiffness",
                   i, d + 1, (double)t, (double)x, (double)half, (double)half);
    }
  PetscFunctionReturn(0);
}

/*
  Inertia of the step, implicit: backward differences over the interval between the times that the velocities belong to (the end of a step, or its
  middle under a second-order scheme), of order 2 there once two intervals are behind (r: their ratio).
*/
static DLMInertia Inertia(DLMSimulation sim, PetscReal t, PetscReal dt)
{
  PetscInt  order;
  PetscReal now, interval, r;

  if (!sim->scene->sphere_inertia || DLMSplitGetScheme(sim->ts, NULL, &order)) return (DLMInertia){ 0.0, 0.0, 0.0 };
  now                = t + (order == 2 ? 0.5 : 1.0) * dt;
  interval           = now - sim->velocity_time;
  r                  = sim->last_interval > 0.0 ? interval / sim->last_interval : 0.0;
  sim->velocity_time = now;
  sim->last_interval = interval;
  if (order < 2 || r == 0.0) return (DLMInertia){ 1.0 / interval, 1.0, 0.0 };
  const PetscReal lead = (1.0 + 2.0 * r) / (1.0 + r);
  return (DLMInertia){ lead / interval, (1.0 + r) / lead, -r * r / ((1.0 + r) * lead) };
}

static PetscErrorCode Saddle(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  DLMSimulation sim = (DLMSimulation)context;

  PetscFunctionBegin;
  PetscCall(DLMSimulationSetViscosity(sim, t, dt));
  if (!sim->spheres) {
    PetscCall(DLMSimulationSolveFlow(sim, t, dt, (DLMInertia){ 0.0, 0.0, 0.0 }));
    PetscFunctionReturn(0);
  }
  PetscCall(CheckStates(sim, t));
  PetscCall(Forces(sim));
  PetscCall(DLMAdaptSetTolerance(sim, dt));
  PetscCall(DLMSimulationSolveFlow(sim, t, dt, Inertia(sim, t, dt)));
  PetscCall(CheckStates(sim, t));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationStart(DLMSimulation sim)
{
  PetscFunctionBegin;
  if (!sim->spheres || sim->scene->sphere_inertia) PetscFunctionReturn(0);
  PetscCall(DLMSimulationSetViscosity(sim, 0.0, 0.0));
  PetscCall(Forces(sim));
  PetscCall(DLMSimulationSolveFlow(sim, 0.0, 0.0, (DLMInertia){ 0.0, 0.0, 0.0 }));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationAddSubsteps(DLMSimulation sim)
{
  PetscFunctionBegin;
  const PetscBool moves = sim->part[DLM_PART_MOTION].built;

  if (moves) PetscCall(DLMSplitAddSubstep(sim->ts, "predict", Predict, sim));
  PetscCall(DLMSplitAddSubstep(sim->ts, "saddle", Saddle, sim));
  if (moves) PetscCall(DLMSplitAddSubstep(sim->ts, "correct", Correct, sim));
  if (sim->polymer) PetscCall(DLMSimulationAddPolymerSubsteps(sim));
  PetscFunctionReturn(0);
}
