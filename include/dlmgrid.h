/*
  The uniform mesh: velocity nodes on T^h, pressure nodes on T^2h, on matching DMDAs.

  Axis d has cells[d] cells of edge h (even). A periodic axis has cells[d] velocity nodes, an axis between walls cells[d]+1; the
  pressure lives on every second node. A rank that owns the pressure nodes [a, b) of an axis owns the velocity nodes
  [2a, 2b), cut at the upper wall. Node i lies at lower + i h.
*/
#ifndef DLMGRID_H
#define DLMGRID_H

#include <petscdmda.h>
#include "dlmscene.h"

typedef struct _p_DLMGrid *DLMGrid;

/* Collective on scene->comm. Raises PETSC_ERR_USER_INPUT if the ranks cannot share the mesh. */
PETSC_EXTERN PetscErrorCode DLMGridCreate(const DLMScene *scene, DLMGrid *grid);
/*
  Of a mesh that is not to be built: the number of velocity nodes, how many more the ranks' ghosted vectors hold, and whether the ranks can share it
  (fits NULL: DLMGridCreate's error if they cannot). Collective.
*/
PETSC_EXTERN PetscErrorCode DLMGridForesee(const DLMScene *scene, PetscBool *fits, PetscReal *nodes, PetscReal *ghosts);
PETSC_EXTERN PetscErrorCode DLMGridDestroy(DLMGrid *grid);
/* Borrowed. velocity: 3 dof, box stencil of width 2; pressure: 1 dof, box stencil of width 1. */
PETSC_EXTERN PetscErrorCode DLMGridGetDMs(DLMGrid grid, DM *velocity, DM *pressure);
/*
  Owner of a node (any integer on a periodic axis) and its place in the owner's part of a global vector, counted in nodes.
  coarsening is 1 for a velocity node, 2 for a pressure node (then i counts in 2h). index may be NULL. Not collective.
*/
PETSC_EXTERN PetscErrorCode DLMGridLocate(DLMGrid grid, PetscInt coarsening, const PetscInt i[3], PetscMPIInt *rank, PetscInt *index);
#endif
