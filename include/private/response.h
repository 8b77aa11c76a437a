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
/* Bytes of the tables that reach far, on every rank. */
PETSC_INTERN PetscReal DLMResponseBytes(PetscInt far);
/* Points closer than CLOSE (in h, on every axis) are paired exactly, by their nodes; a stencil reaches REACH nodes away. */
enum { DLM_RESPONSE_CLOSE = 3, DLM_RESPONSE_REACH = 2, DLM_RESPONSE_WINDOW = 2 * (DLM_RESPONSE_CLOSE + DLM_RESPONSE_REACH + 1) + 1 };

/* The velocity L J^T of unit forces on one point: at nodes around it, each when first asked for. */
typedef struct {
  const DLMResponse *response;
  DLMGrid            grid;
  const DLMMarkers  *markers;
  PetscInt           point, base[3]; /* base: the node below the point */
  PetscReal          x[3];           /* of the point, in h from the lower corner */
  PetscInt           n_sources;      /* nodes that the point pushes, those on walls left out */
  PetscReal          weight[64];
  const PetscReal   *response_at_base[64]; /* near table of each source: what it does at the base */
  PetscBool          known[DLM_RESPONSE_WINDOW * DLM_RESPONSE_WINDOW * DLM_RESPONSE_WINDOW];
  PetscReal          velocity[9 * DLM_RESPONSE_WINDOW * DLM_RESPONSE_WINDOW * DLM_RESPONSE_WINDOW]; /* [node][3 velocity + force direction] */
} DLMResponseField;

/* The field of point j at x. Not collective. */
PETSC_INTERN void DLMResponseFieldSetPoint(DLMResponseField *field, const DLMResponse *response, DLMGrid grid, const DLMMarkers *markers, PetscInt j,
                                           const PetscReal x[3]);
/*
  entry[9] <- J L J^T between point i at x, of the same markers, and the field's point; shift (in h, multiples of the period) is added to the
  nodes of the field's point. Not collective.
*/
PETSC_INTERN void DLMResponseFieldEntry(DLMResponseField *field, PetscInt i, const PetscReal x[3], const PetscInt shift[3], PetscReal entry[9]);

/*
  image.c. entry[9] <- what a plane wall at rest adds to the velocity at an offset from a unit force, in 1/(8 pi mu h): [3 velocity + force direction]. The wall lies
  across the axis, below the force (side 1) or above it (-1), height away; lengths in h. blur, in h^2, is added to the square of the distance from the image;
  with 0 the velocity is zero on the wall. Not collective.
*/
PETSC_INTERN void DLMWallImage(const PetscReal offset[3], PetscReal height, int axis, PetscReal side, PetscReal blur, PetscReal entry[9]);
/*
  entry[9] += what the walls of the box do more to a force and a point at these places (in h from the lower corner) than to a pair in the middle, where the tables
  are made; wall by wall. Not collective.
*/
PETSC_INTERN void DLMResponseAddWalls(DLMGrid grid, PetscReal viscosity, const PetscReal force[3], const PetscReal x[3], PetscReal entry[9]);

static inline PetscReal *DLMResponseNear(const DLMResponse *r, PetscInt parity, const PetscInt o[3])
{
  const PetscInt w = 2 * r->near + 1;

  return r->near_table + 9 * ((o[0] + r->near) + w * ((o[1] + r->near) + w * ((o[2] + r->near) + w * parity)));
}

static inline PetscReal *DLMResponseFar(const DLMResponse *r, PetscReal *table, const PetscInt o[3])
{
  const PetscInt w = 2 * r->far + 1;

  return table + 9 * ((o[0] + r->far) + w * ((o[1] + r->far) + w * (o[2] + r->far)));
}
#endif
