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

/* All objects must outlive it. Reads -saddle_ options. Collective. */
PETSC_EXTERN PetscErrorCode DLMSaddleCreate(DLMStokes stokes, DLMSpheres spheres, DLMPairing pairing, const DLMScene *scene, DLMSaddle *saddle);
PETSC_EXTERN PetscErrorCode DLMSaddleDestroy(DLMSaddle *saddle);
/*
  Places the markers at the present centres and solves. force[3 n], torque[3 n] act on the spheres beside the fluid (NULL: none);
  body_force (a velocity vector, NULL: none) acts on the fluid. Writes velocity, omega, force, torque and stresslet of every
  sphere. Starts from the multipliers of the last solve. Collective. Raises PETSC_ERR_NOT_CONVERGED.
*/
PETSC_EXTERN PetscErrorCode DLMSaddleSolve(DLMSaddle saddle, DLMInertia inertia, const PetscReal *force, const PetscReal *torque, Vec body_force);
/* Velocity and pressure of the last solve, in the layout of DLMStokesCreateVec. Borrowed. */
PETSC_EXTERN PetscErrorCode DLMSaddleGetFluid(DLMSaddle saddle, Vec *x);
PETSC_EXTERN PetscErrorCode DLMSaddleGetWork(DLMSaddle saddle, DLMSaddleWork *work);
PETSC_EXTERN PetscErrorCode DLMSaddleView(DLMSaddle saddle, PetscViewer viewer);
/* Root mean square over all multipliers of Q^T (J u - V - omega x r), after a solve. Collective. */
PETSC_EXTERN PetscErrorCode DLMSaddleGetSlip(DLMSaddle saddle, PetscReal *slip);
#endif
