/*
  Impulse responses of the Stokes solve: velocity at offset o (in h) from a unit force on a velocity node. The mesh repeats every 2h,
  so near the source there is one table per parity of the source node; farther off the mean of the eight serves all.
*/
#ifndef DLM_RESPONSE_H
#define DLM_RESPONSE_H

#include "stokesimpl.h"
#include "spheresimpl.h"

typedef struct {
  PetscInt   near, far;   /* radii: offsets -near..near and -far..far on each axis */
  PetscReal *near_table;  /* [parity][o3][o2][o1][3 velocity + force direction] */
  PetscReal *far_table;   /* [o3][o2][o1][9], mean over the parities */
  PetscReal *smooth_table; /* the far table seen through one delta, for pairs of immersed points */
} DLMResponse;

/*
  The responses of a Stokes solver to offsets of at least far, made by 24 solves from the middle of the box when first asked for. Borrowed: they live as long
  as the solver. Collective.
*/
PETSC_INTERN PetscErrorCode DLMResponseGet(DLMStokes stokes, PetscInt far, const DLMResponse **response);
/*
  entry[9] <- J L J^T between point i of markers a and point j of markers b; shift (in h, multiples of the period) is added to the
  nodes of b. Not collective.
*/
PETSC_INTERN void DLMResponseEntry(const DLMResponse *response, DLMGrid grid, const DLMMarkers *a, PetscInt i, const PetscReal xa[3],
                                   const DLMMarkers *b, PetscInt j, const PetscReal xb[3], const PetscInt shift[3], PetscReal entry[9]);
#endif
