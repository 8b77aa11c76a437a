#include "../../include/private/natural.h"

PetscErrorCode DLMNaturalCreate(DM dm, const PetscReal *sign, DLMNatural *n)
{
  PetscMPIInt rank;

  PetscFunctionBegin;
  n->dm    = dm;
  n->sign  = sign;
  n->whole = NULL;
  PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)dm), &rank));
  PetscCall(DMDAGetInfo(dm, NULL, &n->nodes[0], &n->nodes[1], &n->nodes[2], NULL, NULL, NULL, &n->dof, NULL, NULL, NULL, NULL, NULL));
  if (sign) n->nodes[1] = 2 * (n->nodes[1] - 1);
  PetscCall(DMDACreateNaturalVector(dm, &n->natural));
  PetscCall(VecScatterCreateToZero(n->natural, &n->scatter, &n->all));
  if (sign && rank == 0) PetscCall(PetscMalloc1(n->dof * n->nodes[0] * n->nodes[1] * n->nodes[2], &n->whole));
  PetscFunctionReturn(0);
}

/* Between n->all, the planes from the middle of x2 up, and n->whole: unfolds the one into the other, or takes it from there. */
static PetscErrorCode Fold(DLMNatural *n, PetscBool unfold)
{
  const PetscInt line = n->dof * n->nodes[0], middle = n->nodes[1] / 2;
  PetscScalar   *half;

  PetscFunctionBegin;
  if (!n->whole) PetscFunctionReturn(0);
  PetscCall(VecGetArray(n->all, &half));
  for (PetscInt k = 0; k < n->nodes[2]; k++)
    for (PetscInt j = 0; j < n->nodes[1]; j++) {
      const PetscBool image = (PetscBool)(j > 0 && j < middle); /* plane 0 is its own image: it is that of the other end */
      PetscScalar    *here  = half + line * (PetscAbsInt(j - middle) + (middle + 1) * k), *there = n->whole + line * (j + n->nodes[1] * k);
      for (PetscInt i = 0; i < line; i++) {
        if (unfold) there[i] = (image ? n->sign[i % n->dof] : 1.0) * here[i];
        else if (!image) here[i] = there[i];
      }
    }
  PetscCall(VecRestoreArray(n->all, &half));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMNaturalGather(DLMNatural *n, Vec v)
{
  PetscFunctionBegin;
  PetscCall(DMDAGlobalToNaturalBegin(n->dm, v, INSERT_VALUES, n->natural));
  PetscCall(DMDAGlobalToNaturalEnd(n->dm, v, INSERT_VALUES, n->natural));
  PetscCall(VecScatterBegin(n->scatter, n->natural, n->all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(n->scatter, n->natural, n->all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(Fold(n, PETSC_TRUE));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMNaturalGetArray(DLMNatural *n, PetscScalar **x)
{
  PetscFunctionBegin;
  if (n->whole) *x = n->whole;
  else PetscCall(VecGetArray(n->all, x));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMNaturalRestoreArray(DLMNatural *n, PetscScalar **x)
{
  PetscFunctionBegin;
  if (!n->whole) PetscCall(VecRestoreArray(n->all, x));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMNaturalSpread(DLMNatural *n, Vec v)
{
  PetscFunctionBegin;
  PetscCall(Fold(n, PETSC_FALSE));
  PetscCall(VecScatterBegin(n->scatter, n->all, n->natural, INSERT_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterEnd(n->scatter, n->all, n->natural, INSERT_VALUES, SCATTER_REVERSE));
  PetscCall(DMDANaturalToGlobalBegin(n->dm, n->natural, INSERT_VALUES, v));
  PetscCall(DMDANaturalToGlobalEnd(n->dm, n->natural, INSERT_VALUES, v));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMNaturalDestroy(DLMNatural *n)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(n->whole));
  PetscCall(VecScatterDestroy(&n->scatter));
  PetscCall(VecDestroy(&n->all));
  PetscCall(VecDestroy(&n->natural));
  PetscFunctionReturn(0);
}
