#include "../../include/private/natural.h"

PetscErrorCode DLMNaturalCreate(DM dm, DLMNatural *n)
{
  PetscFunctionBegin;
  n->dm = dm;
  PetscCall(DMDACreateNaturalVector(dm, &n->natural));
  PetscCall(VecScatterCreateToZero(n->natural, &n->scatter, &n->all));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMNaturalGather(DLMNatural *n, Vec v)
{
  PetscFunctionBegin;
  PetscCall(DMDAGlobalToNaturalBegin(n->dm, v, INSERT_VALUES, n->natural));
  PetscCall(DMDAGlobalToNaturalEnd(n->dm, v, INSERT_VALUES, n->natural));
  PetscCall(VecScatterBegin(n->scatter, n->natural, n->all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(n->scatter, n->natural, n->all, INSERT_VALUES, SCATTER_FORWARD));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMNaturalSpread(DLMNatural *n, Vec v)
{
  PetscFunctionBegin;
  PetscCall(VecScatterBegin(n->scatter, n->all, n->natural, INSERT_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterEnd(n->scatter, n->all, n->natural, INSERT_VALUES, SCATTER_REVERSE));
  PetscCall(DMDANaturalToGlobalBegin(n->dm, n->natural, INSERT_VALUES, v));
  PetscCall(DMDANaturalToGlobalEnd(n->dm, n->natural, INSERT_VALUES, v));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMNaturalDestroy(DLMNatural *n)
{
  PetscFunctionBegin;
  PetscCall(VecScatterDestroy(&n->scatter));
  PetscCall(VecDestroy(&n->all));
  PetscCall(VecDestroy(&n->natural));
  PetscFunctionReturn(0);
}
