#ifndef DLM_GRIDIMPL_H
#define DLM_GRIDIMPL_H

#include "../dlmgrid.h"
#include "kuhn.h"

struct _p_DLMGrid {
  MPI_Comm  comm;
  PetscReal h;
  PetscReal lower[3];      /* corner of the box */
  PetscInt  cells[3];
  PetscBool periodic[3];
  PetscInt  nodes[3];      /* velocity nodes per axis */
  PetscInt  processes[3];  /* ranks per axis */
  PetscInt *start[3];      /* start[d][r]: first velocity node of process r on axis d; processes[d]+1 entries */
  PetscInt  line;          /* axis along which the box solver keeps levels: the last wall axis, else x3 */
  DM        velocity, pressure;
};

/* A DMDA on the velocity nodes, shared over the ranks as they are. Collective. */
PETSC_INTERN PetscErrorCode DLMGridCreateDM(DLMGrid grid, PetscInt dof, DMDAStencilType stencil, PetscInt width, DM *dm);

/* Place of node i on axis d of a mesh of n cells on that axis. */
static inline int DLMGridPlace(DLMGrid grid, int d, PetscInt i, PetscInt n)
{
  if (grid->periodic[d]) return DLM_INNER;
  return i == 0 ? DLM_LOWER : (i == n ? DLM_UPPER : DLM_INNER);
}

/* True if the velocity node lies on a wall. */
static inline PetscBool DLMGridOnWall(DLMGrid grid, PetscInt i, PetscInt j, PetscInt k)
{
  const PetscInt node[3] = { i, j, k };
  for (int d = 0; d < 3; d++)
    if (!grid->periodic[d] && (node[d] == 0 || node[d] == grid->cells[d])) return PETSC_TRUE;
  return PETSC_FALSE;
}
#endif
