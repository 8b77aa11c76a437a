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
  p->kept_force = p->force;
  p->kept_time  = p->velocity_time;
  p->kept_moves = p->moves;
  p->fresh      = PETSC_FALSE;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerBringBack(DLMPolymer p)
{
  PetscFunctionBeginUser;
  PetscCall(VecCopy(p->kept_C, p->C));
  p->force         = p->kept_force;
  p->velocity_time = p->kept_time;
  p->moves         = p->kept_moves;
  if (p->fresh) DLMPolymerTurnGradient(p);
  p->fresh        = PETSC_FALSE;
  p->health.sound = PETSC_TRUE;
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
  *state = (DLMPolymerState){ p->force.now, p->force.before, p->force.time_now, p->force.time_before, p->force.n, p->velocity_time, p->moves, p->mirror };
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerSetState(DLMPolymer p, const DLMPolymerState *state)
{
  PetscFunctionBeginUser;
  p->force.time_now    = state->time_now;
  p->force.time_before = state->time_before;
  p->force.n           = state->n_forces;
  p->velocity_time     = state->velocity_time;
  p->moves             = state->moves;
  p->mirror            = (int)state->mirror;
  PetscFunctionReturn(0);
}
