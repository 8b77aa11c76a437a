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
