/*
  The spheres: their motion, and the pairing <mu, v> between their multipliers and a velocity field.

  The state of every sphere (27 numbers at most) is known to every rank; multipliers, stencils and dense blocks live only on the
  rank that holds the centre.
*/
#ifndef DLMSPHERES_H
#define DLMSPHERES_H

#include <petscvec.h>
#include "dlmgrid.h"

/* State of one sphere. Centres are unwrapped: a sphere that crosses a periodic face goes on counting. */
typedef struct {
  PetscReal center[3], velocity[3], omega[3];
  PetscReal velocity_before[3], omega_before[3]; /* of the step before, for second-order inertia */
  PetscReal force[3], torque[3], stresslet[6];   /* hydrodynamic; stresslet 11, 22, 33, 12, 13, 23, symmetric and traceless */
} DLMSphereState;

typedef struct _p_DLMSpheres *DLMSpheres;
typedef struct _p_DLMPairing *DLMPairing;

/* grid and scene must outlive the object. Collective. */
PETSC_EXTERN PetscErrorCode DLMSpheresCreate(DLMGrid grid, const DLMScene *scene, DLMSpheres *spheres);
PETSC_EXTERN PetscErrorCode DLMSpheresDestroy(DLMSpheres *spheres);
/* Borrowed, n entries, the same on every rank; change it the same way on every rank. */
PETSC_EXTERN PetscErrorCode DLMSpheresGetStates(DLMSpheres spheres, PetscInt *n, DLMSphereState **states);
/* Spheres whose centre lies in this rank's part of the mesh, ascending. Borrowed until the next pairing update. */
PETSC_EXTERN PetscErrorCode DLMSpheresGetOwned(DLMSpheres spheres, PetscInt *n, const PetscInt **owned);
/* centre of sphere i inside the box. Not collective. */
PETSC_EXTERN PetscErrorCode DLMSpheresGetWrapped(DLMSpheres spheres, PetscInt i, PetscReal center[3]);
/* Nearest image of centre j minus centre i. Not collective. */
PETSC_EXTERN PetscErrorCode DLMSpheresSeparation(DLMSpheres spheres, PetscInt i, PetscInt j, PetscReal d[3]);
/* Spreads what owners computed (velocity, omega, force, torque, stresslet) to every rank. Collective. */
PETSC_EXTERN PetscErrorCode DLMSpheresShare(DLMSpheres spheres);
/* Pairs of spheres whose surfaces are closer than gap: pairs[2 k], pairs[2 k + 1], i < j; free with PetscFree. Not collective. */
PETSC_EXTERN PetscErrorCode DLMSpheresFindPairs(DLMSpheres spheres, PetscReal gap, PetscInt *n, PetscInt **pairs);
/* Smallest gap between surfaces of spheres and walls (infinity if none). Not collective. */
PETSC_EXTERN PetscErrorCode DLMSpheresGetSmallestGap(DLMSpheres spheres, PetscReal *gap);

/*
  The pairing (thesis 2.4.2): J interpolates a velocity at the multiplier points, J^T spreads multipliers to the nodes. The two are
  adjoint on velocities that vanish on the walls. Points lie at r from the centre; the order is sphere by sphere.
*/
PETSC_EXTERN PetscErrorCode DLMPairingCreate(DLMSpheres spheres, const DLMScene *scene, DLMPairing *pairing);
PETSC_EXTERN PetscErrorCode DLMPairingDestroy(DLMPairing *pairing);
/* Places the points for the present centres; spheres change owner here. Collective. */
PETSC_EXTERN PetscErrorCode DLMPairingUpdate(DLMPairing pairing);
/* Points of this rank, and where those of its k-th owned sphere start (first has owned + 1 entries). Borrowed. */
PETSC_EXTERN PetscErrorCode DLMPairingGetPoints(DLMPairing pairing, PetscInt *n, const PetscReal **r, const PetscInt **first);
/* values[3 n] <- J u. Collective. */
PETSC_EXTERN PetscErrorCode DLMPairingInterpolate(DLMPairing pairing, Vec u, PetscScalar *values);
/* f += scale J^T lambda, lambda[3 n]; wall nodes get nothing. The velocity leads in u and f, more may follow. Collective. */
PETSC_EXTERN PetscErrorCode DLMPairingSpread(DLMPairing pairing, PetscReal scale, const PetscScalar *lambda, Vec f);
/*
  Multipliers: the values at a sphere's points, or the coefficients of spherical harmonics up to a degree on its surface points (inner points
  keep their own). With Q the orthonormal columns of those harmonics, points = Q multipliers and multipliers = Q^T points; rigid motions
  are reproduced. Multipliers of this rank's spheres, and where those of its k-th sphere start, counted in 3-vectors (owned + 1 entries). Borrowed.
*/
PETSC_EXTERN PetscErrorCode DLMPairingGetMultipliers(DLMPairing pairing, PetscInt *n, const PetscInt **first);
/* points[3 n_points] <- Q multipliers[3 n], and multipliers <- Q^T points. Not collective. */
PETSC_EXTERN PetscErrorCode DLMPairingExpand(DLMPairing pairing, const PetscScalar *multipliers, PetscScalar *points);
PETSC_EXTERN PetscErrorCode DLMPairingProject(DLMPairing pairing, const PetscScalar *points, PetscScalar *multipliers);

/* How the surface of a sphere is covered: what the scene says, or the calibrated choice for its radius (docs/calibration.md). */
typedef struct {
  PetscReal retraction, spacing; /* in h */
  PetscInt  degree;              /* 0: every point its own multiplier */
  PetscInt  n_points, n_multipliers; /* of the surface */
  PetscReal compliance, spin_compliance, strain_compliance; /* epsilon of Q^T (J u - V - omega x r) = -epsilon lambda: beyond degree 1; of torque; of stresslet */
} DLMCover;
PETSC_EXTERN PetscErrorCode DLMPairingGetCover(const DLMScene *scene, PetscReal radius, DLMCover *cover);
#endif
