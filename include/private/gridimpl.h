#ifndef DLM_GRIDIMPL_H
#define DLM_GRIDIMPL_H

#include "../dlmgrid.h"
#include "kuhn.h"

struct _p_DLMGrid {
  MPI_Comm  comm;
  PetscReal h;
  PetscReal lower[3];      /* corner of the box */
  PetscInt  cells[3];
  PetscBool periodic[3];   /* no walls */
  PetscBool symmetric;     /* the divergence is the mean of the cut and its mirror image in x2 */
  PetscBool half;          /* cells[1] are those of 0 <= x2 <= L2/2: what lies beyond is their mirror image (G6) */
  PetscInt  nodes[3];      /* velocity nodes per axis */
  PetscInt  processes[3];  /* ranks per axis */
  PetscInt *start[3];      /* start[d][r]: first velocity node of process r on axis d; processes[d]+1 entries */
  PetscInt  line;          /* axis along which the box solver keeps levels: the last wall axis, else x3 */
  DM        velocity, pressure;
};

/* A DMDA on the velocity nodes, shared over the ranks as they are. Collective. */
PETSC_INTERN PetscErrorCode DLMGridCreateDM(DLMGrid grid, PetscInt dof, DMDAStencilType stencil, PetscInt width, DM *dm);

/* Signs in the mirror: of a scalar, of the components of a velocity and of a symmetric tensor (11, 22, 33, 12, 13, 23). */
static const PetscReal DLMMirrorScalar[1] = { 1.0 }, DLMMirrorVector[3] = { 1.0, -1.0, 1.0 }, DLMMirrorTensor[6] = { 1.0, 1.0, 1.0, -1.0, 1.0, -1.0 };

/*
  As DMGlobalToLocal with INSERT_VALUES, for a DMDA on the grid's nodes; beyond a mirror plane the ghosts are images, each component times its sign[dof]. Collective.
*/
PETSC_INTERN PetscErrorCode DLMGridGlobalToLocal(DLMGrid grid, DM dm, const PetscReal sign[], Vec global, Vec local);

/* Axis d ends in planes of nodes: walls or mirrors. */
static inline PetscBool DLMGridHasEnds(DLMGrid grid, int d)
{
  return (PetscBool)(!grid->periodic[d] || (grid->half && d == 1));
}

/* Length after which axis d, if periodic, repeats. */
static inline PetscReal DLMGridPeriod(DLMGrid grid, int d)
{
  return grid->h * grid->cells[d] * (grid->half && d == 1 ? 2 : 1);
}

/* How many nodes of the box velocity node j of axis x2 stands for: between mirrors it has an image. */
static inline PetscInt DLMGridImages(DLMGrid grid, PetscInt j)
{
  return grid->half && j > 0 && j < grid->cells[1] ? 2 : 1;
}

/* The signs, if the grid holds half of the box; else NULL: nothing is an image. */
static inline const PetscReal *DLMGridSign(DLMGrid grid, const PetscReal *sign)
{
  return grid->half ? sign : NULL;
}

/* The node of 0..n-1 (or 0..n between mirrors) that node i of a periodic axis of n cells stands for, and whether as its mirror image. */
static inline PetscInt DLMGridFold(DLMGrid grid, int d, PetscInt n, PetscInt i, PetscBool *image)
{
  const PetscInt period = grid->half && d == 1 ? 2 * n : n, node = ((i % period) + period) % period;

  *image = (PetscBool)(node > n);
  return *image ? period - node : node;
}

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
