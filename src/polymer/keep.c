#include "../../include/private/polymerimpl.h"

/*
  The state of the polymer between steps: C, the forces kept for extrapolation, and the last velocity's gradient (its own force is made from it when
  the next step begins).
*/
PetscErrorCode DLMPolymerKeep(DLMPolymer p)
{
  PetscFunctionBeginUser;
  if (!p->kept_C) {
    PetscCall(VecDuplicate(p->C, &p->kept_C));
    for (int k = 0; k < 4; k++) PetscCall(VecDuplicate(p->stress.now, &p->kept[k]));
    PetscCall(PetscMalloc1(9 * (size_t)p->block.n, &p->kept_gradient));
  }
  PetscCall(VecCopy(p->C, p->kept_C));
  if (p->stress.n) {
    PetscCall(VecCopy(p->stress.now, p->kept[0]));
    PetscCall(VecCopy(p->stress.before, p->kept[1]));
    PetscCall(VecCopy(p->viscous.now, p->kept[2]));
    PetscCall(VecCopy(p->viscous.before, p->kept[3]));
  }
  PetscCall(PetscArraycpy(p->kept_gradient, p->gradient, 9 * (size_t)p->block.n));
  p->kept_stress   = p->stress;
  p->kept_viscous  = p->viscous;
  p->kept_time     = p->velocity_time;
  p->kept_moves    = p->moves;
  PetscFunctionReturn(0);
}

/* Puts the kept times and vectors into whichever vectors the history holds now. */
static PetscErrorCode BringHistory(DLMForceHistory *h, const DLMForceHistory *kept, Vec now, Vec before)
{
  PetscFunctionBegin;
  h->n           = kept->n;
  h->time_now    = kept->time_now;
  h->time_before = kept->time_before;
  if (!h->n) PetscFunctionReturn(0);
  PetscCall(VecCopy(now, h->now));
  PetscCall(VecCopy(before, h->before));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerBringBack(DLMPolymer p)
{
  PetscFunctionBeginUser;
  PetscCall(VecCopy(p->kept_C, p->C));
  PetscCall(BringHistory(&p->stress, &p->kept_stress, p->kept[0], p->kept[1]));
  PetscCall(BringHistory(&p->viscous, &p->kept_viscous, p->kept[2], p->kept[3]));
  PetscCall(PetscArraycpy(p->gradient, p->kept_gradient, 9 * (size_t)p->block.n));
  p->velocity_time = p->kept_time;
  p->moves         = p->kept_moves;
  p->health.sound  = PETSC_TRUE;
  PetscFunctionReturn(0);
}
