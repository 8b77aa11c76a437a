#include "../../include/private/polymerimpl.h"

/*
  The state of the polymer between steps: C, the forces kept for extrapolation, and the last velocity's gradient. Only C is copied: forces and gradients
  of a step are written to buffers that the kept state does not use.
*/
PetscErrorCode DLMPolymerKeep(DLMPolymer p)
{
  PetscFunctionBeginUser;
  if (!p->kept_C) PetscCall(VecDuplicate(p->C, &p->kept_C));
  PetscCall(VecCopy(p->C, p->kept_C));
  p->kept_force       = p->force;
  p->kept_time        = p->velocity_time;
  p->kept_time_before = p->velocity_time_before;
  p->kept_velocities  = p->n_velocities;
  p->kept_trace       = p->health.largest_trace;
  p->fresh            = PETSC_FALSE;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerBringBack(DLMPolymer p)
{
  PetscFunctionBeginUser;
  PetscCall(VecCopy(p->kept_C, p->C));
  p->force                = p->kept_force;
  p->velocity_time        = p->kept_time;
  p->velocity_time_before = p->kept_time_before;
  p->n_velocities         = p->kept_velocities;
  if (p->fresh) DLMPolymerTurnGradient(p);
  p->fresh        = PETSC_FALSE;
  p->health.sound         = PETSC_TRUE;
  p->health.largest_trace = p->kept_trace;
  PetscFunctionReturn(0);
}

void DLMPolymerTurnGradient(DLMPolymer p)
{
  p->buffer = 1 - p->buffer;
  for (int k = 0; k < 9; k++) p->g[k] = p->gradient[p->buffer] + (size_t)k * p->block.n;
}

PetscErrorCode DLMPolymerGetState(DLMPolymer p, DLMPolymerState *state)
{
  PetscFunctionBeginUser;
  *state = (DLMPolymerState){ .force_now = p->force.now, .force_before = p->force.before, .time_now = p->force.time_now, .time_before = p->force.time_before,
                              .n_forces = p->force.n, .velocity_time = p->velocity_time, .velocity_time_before = p->velocity_time_before,
                              .n_velocities = p->n_velocities, .cut = p->cut, .near = (PetscReal *)p->near_flow[p->buffer],
                              .n_near = p->near_flow[0] ? p->scene->n_spheres * (PetscInt)(sizeof(DLMNearFlow) / sizeof(PetscReal)) : 0 };
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerGetRateBefore(DLMPolymer p, Vec rate)
{
  const PetscInt n = p->block.n;
  const double  *g = p->gradient[1 - p->buffer];
  PetscScalar   *x;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(rate, &x));
  for (int k = 0; k < 6; k++)
    for (PetscInt i = 0; i < n; i++) x[k * n + i] = 0.5 * (g[DLMEntryIJ[k] * n + i] + g[DLMEntryJI[k] * n + i]);
  PetscCall(VecRestoreArray(rate, &x));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerSetState(DLMPolymer p, const DLMPolymerState *state, Vec rate_before, Vec velocity)
{
  const PetscInt     n = p->block.n;
  DLMPolymerHealth   health;
  const PetscScalar *x;

  PetscFunctionBeginUser;
  p->force.time_now    = state->time_now;
  p->force.time_before = state->time_before;
  p->force.n           = state->n_forces;
  p->cut               = (int)state->cut;
  PetscCall(DLMPolymerGetHealth(p, &health));
  if (state->n_velocities == 0) PetscFunctionReturn(0);
  if (state->n_velocities > 1) {
    PetscCall(VecGetArrayRead(rate_before, &x));
    for (int k = 0; k < 6; k++) {
      PetscCall(PetscArraycpy(p->g[DLMEntryIJ[k]], x + k * n, n));
      PetscCall(PetscArraycpy(p->g[DLMEntryJI[k]], x + k * n, n));
    }
    PetscCall(VecRestoreArrayRead(rate_before, &x));
  }
  p->n_velocities  = state->n_velocities - 1;
  p->velocity_time = state->velocity_time_before;
  p->fresh         = PETSC_FALSE;
  PetscCall(DLMPolymerTakeVelocity(p, state->velocity_time, velocity));
  if (state->n_near) PetscCall(PetscMemcpy(p->near_flow[p->buffer], state->near, state->n_near * sizeof(PetscReal)));
  PetscCall(DLMPolymerNearFlow(p, PETSC_TRUE));
  PetscFunctionReturn(0);
}
