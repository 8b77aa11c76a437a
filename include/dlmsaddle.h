/*
  The saddle problem of one step: fluid and bodies together (spec 4, step 2; docs/theory.md, section "Saddle"):

    [ K_f  -J^T ] [u,p     ]   [ wall force + body force ]
    [ -J    E   ] [lambda,U]   [ 0, F + M U_old/dt       ]     E = [ 0 R; R^T M/dt ],  U = (V, omega)

  solved by PCFIELDSPLIT: exact fluid solves, conjugate gradients on the Schur complement of the bodies, preconditioned by one dense
  block per cluster of spheres.
*/
#ifndef DLMSADDLE_H
#define DLMSADDLE_H

#include "dlmspheres.h"
#include "dlmstokes.h"

typedef struct _p_DLMSaddle *DLMSaddle;

#define PCDLMBODIES      "dlmbodies"      /* constraint preconditioner of the bodies' Schur complement */
#define PCDLMMULTIPLIERS "dlmmultipliers" /* the thesis's: pressure mass, plain multipliers */

/* Rigid-body inertia of a step: (M/dt)(U - U_old); weight 0 leaves the inertia out. */
typedef struct {
  PetscReal weight; /* factor of M: 1/dt, 3/(2 dt), ... or 0 */
  PetscReal now, before; /* M U_old weight = M (now V^n + before V^(n-1)) */
} DLMInertia;

/* Work done since the start. */
typedef struct {
  PetscInt solves, iterations, most_iterations, last_iterations, blocks_built;
} DLMSaddleWork;

/* What was made for the spheres, after the set-up. */
typedef struct {
  PetscInt       clusters, largest; /* dense blocks on all ranks, unknowns of the largest */
  PetscReal      response_bytes, pairing_bytes, block_bytes; /* on this rank: tables of impulse responses (0: none), points and their pairing, dense blocks */
  PetscLogDouble block_seconds;     /* to build the blocks */
} DLMSaddleParts;

/* What the dense blocks are made from; an entry (or three) per sphere. */
typedef struct {
  PetscInt   n_ranks;
  PetscInt  *first, *rank;      /* first sphere of the sphere's block, and the rank that holds it */
  PetscReal *center, *origin;   /* 3 each: centres when the block was built, and those that its factors belong to */
} DLMBlockState;

/* Beside the fluid, what the next solve starts from and is preconditioned by. The same on every rank. */
typedef struct {
  PetscInt      n_multipliers;
  PetscReal    *multipliers;    /* of all spheres' surfaces, sphere by sphere */
  PetscReal     reference;      /* norm that the tolerance refers to */
  DLMBlockState blocks;
} DLMSaddleState;

/* All objects must outlive it. Reads -saddle_ options. Collective. */
PETSC_EXTERN PetscErrorCode DLMSaddleCreate(DLMStokes stokes, DLMSpheres spheres, DLMPairing pairing, const DLMScene *scene, DLMSaddle *saddle);
PETSC_EXTERN PetscErrorCode DLMSaddleDestroy(DLMSaddle *saddle);
/*
  Places the markers at the present centres and solves. force[3 n], torque[3 n] act on the spheres beside the fluid (NULL: none);
  body_force (a velocity vector, NULL: none) acts on the fluid. Writes velocity, omega, force, torque and stresslet of every
  sphere. Starts from the multipliers of the last solve. Collective. Raises PETSC_ERR_NOT_CONVERGED.
*/
PETSC_EXTERN PetscErrorCode DLMSaddleSolve(DLMSaddle saddle, DLMInertia inertia, const PetscReal *force, const PetscReal *torque, Vec body_force);
/*
  The viscosity of the fluid in the next solves over that of the Stokes operator, above 0; at first 1 (docs/theory.md, B10). Lubrication's friction and the
  cover's compliances go with it. Not collective.
*/
PETSC_EXTERN PetscErrorCode DLMSaddleSetViscosity(DLMSaddle saddle, PetscReal ratio);
/* Velocity and pressure of the last solve, in the layout of DLMStokesCreateVec. Borrowed. */
PETSC_EXTERN PetscErrorCode DLMSaddleGetFluid(DLMSaddle saddle, Vec *x);
/* Relative tolerance of the next solves; the scene's saddle_rtol at first. */
PETSC_EXTERN PetscErrorCode DLMSaddleSetTolerance(DLMSaddle saddle, PetscReal rtol);
PETSC_EXTERN PetscErrorCode DLMSaddleGetWork(DLMSaddle saddle, DLMSaddleWork *work);
/* Not collective. */
PETSC_EXTERN PetscErrorCode DLMSaddleGetParts(DLMSaddle saddle, DLMSaddleParts *parts);
/* Bytes of the tables that a rank would make for a scene. */
PETSC_EXTERN PetscReal DLMSaddleForeseeResponses(const DLMScene *scene);
PETSC_EXTERN PetscErrorCode DLMSaddleView(DLMSaddle saddle, PetscViewer viewer);
/*
  The state as it is, and one to go on from, which may come from another number of ranks (the centres are set before, the fluid in DLMSaddleGetFluid's
  vector). StateCreate makes room for the spheres of this scene. Collective.
*/
PETSC_EXTERN PetscErrorCode DLMSaddleStateCreate(DLMSaddle saddle, DLMSaddleState *state);
PETSC_EXTERN PetscErrorCode DLMSaddleStateDestroy(DLMSaddleState *state);
PETSC_EXTERN PetscErrorCode DLMSaddleGetState(DLMSaddle saddle, DLMSaddleState *state);
PETSC_EXTERN PetscErrorCode DLMSaddleSetState(DLMSaddle saddle, const DLMSaddleState *state);
/* Root mean square over all multipliers of Q^T (J u - V - omega x r), after a solve. Collective. */
PETSC_EXTERN PetscErrorCode DLMSaddleGetSlip(DLMSaddle saddle, PetscReal *slip);
/* lambda[3 n], the forces of the spheres on the fluid at this rank's points (DLMPairingGetPoints). Borrowed until the next call to the object. Not collective. */
PETSC_EXTERN PetscErrorCode DLMSaddleGetPointForces(DLMSaddle saddle, const PetscScalar **lambda);
/* First moments along an axis with walls, x = 0 in the middle of the box, per component. */
typedef struct {
  PetscReal multipliers[3]; /* of the spheres' forces lambda on the fluid: sum of lambda x, x as the pairing sees it */
  PetscReal deltas[3];      /* half of what smoothed deltas put on the nodes of the upper wall less half of that on the lower one; times the gap: their moment */
  PetscReal friction[3];    /* of the walls' friction on the spheres, at the walls */
  PetscReal widths[3];      /* the same friction times the widths of its gaps, towards the wall */
} DLMWallMoments;

/* After a solve, over all ranks. Collective. */
PETSC_EXTERN PetscErrorCode DLMSaddleGetWallMoments(DLMSaddle saddle, int axis, DLMWallMoments *moments);
#endif
