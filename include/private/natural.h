/* A vector of a DMDA in natural order [n3][n2][n1][components], whole on rank 0: what files hold, whatever the number of ranks. All collective. */
#ifndef DLM_NATURAL_H
#define DLM_NATURAL_H

#include <petscdmda.h>

typedef struct {
  DM         dm; /* borrowed */
  Vec        natural, all;
  VecScatter scatter;
} DLMNatural;

PETSC_INTERN PetscErrorCode DLMNaturalCreate(DM dm, DLMNatural *n);
/* v to n->all, which has entries on rank 0 only; and back. */
PETSC_INTERN PetscErrorCode DLMNaturalGather(DLMNatural *n, Vec v);
PETSC_INTERN PetscErrorCode DLMNaturalSpread(DLMNatural *n, Vec v);
PETSC_INTERN PetscErrorCode DLMNaturalDestroy(DLMNatural *n);
#endif
