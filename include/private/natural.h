/*
  A vector of a DMDA in natural order [n3][n2][n1][components], whole on rank 0: what files hold, whatever the number of ranks, and whether the DMDA holds the
  box or its half x2 >= 0. All collective.
*/
#ifndef DLM_NATURAL_H
#define DLM_NATURAL_H

#include <petscdmda.h>

typedef struct {
  DM               dm;   /* borrowed, like the next */
  const PetscReal *sign; /* of each component in the mirror, if the DMDA holds half of the box; else NULL */
  PetscInt         nodes[3], dof; /* of the whole box */
  Vec              natural, all;
  VecScatter       scatter;
  PetscScalar     *whole; /* of rank 0, if the DMDA holds half */
} DLMNatural;

PETSC_INTERN PetscErrorCode DLMNaturalCreate(DM dm, const PetscReal *sign, DLMNatural *n);
/* v to the array, which has entries on rank 0 only; and back. */
PETSC_INTERN PetscErrorCode DLMNaturalGather(DLMNatural *n, Vec v);
PETSC_INTERN PetscErrorCode DLMNaturalSpread(DLMNatural *n, Vec v);
/* The array; give it back before the next. */
PETSC_INTERN PetscErrorCode DLMNaturalGetArray(DLMNatural *n, PetscScalar **x);
PETSC_INTERN PetscErrorCode DLMNaturalRestoreArray(DLMNatural *n, PetscScalar **x);
PETSC_INTERN PetscErrorCode DLMNaturalDestroy(DLMNatural *n);
#endif
