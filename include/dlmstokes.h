/*
  The Stokes problem in the box, without spheres, on the matching DMDAs of a DLMGrid:

    K (u, p) = (f, g),   K = [ A  -B^T ]   A = <mu grad u, grad v>,  (B u, q) = int q div u
                             [-B   0   ]

  u holds the wall nodes too: their rows of A are mu h 6 u = f, their columns are moved to the right-hand side once
  (DLMStokesGetWallForce), so K is symmetric. A vector is the velocity part followed by the pressure part on every rank.
*/
#ifndef DLMSTOKES_H
#define DLMSTOKES_H

#include <petscksp.h>
#include "dlmgrid.h"

typedef struct _p_DLMStokes *DLMStokes;

/* PC types for the box; any prefix can name them (-stokes_pc_type, -stokes_fieldsplit_velocity_pc_type, ...). */
#define PCDLMVELOCITY "dlmvelocity" /* exact A^-1 in sine and Fourier modes */
#define PCDLMPRESSURE "dlmpressure" /* exact (-B A^-1 B^T)^-1, needs two periodic axes */
#define PCDLMSTOKES   "dlmstokes"   /* exact K^-1: the two above in one pass through modal space */

/* Registers the PC types above. Not collective. */
PETSC_EXTERN PetscErrorCode DLMStokesRegister(void);
/* The grid must outlive the object. Reads -stokes_ options. Collective. */
PETSC_EXTERN PetscErrorCode DLMStokesCreate(DLMGrid grid, const DLMScene *scene, DLMStokes *stokes);
PETSC_EXTERN PetscErrorCode DLMStokesDestroy(DLMStokes *stokes);
/* Says which solver was built and why, and its memory. Collective. */
PETSC_EXTERN PetscErrorCode DLMStokesView(DLMStokes stokes, PetscViewer viewer);

/* Bytes of the exact pressure solve's blocks on this rank, the seconds they took to build, and NULL or why there are none. Not collective. */
PETSC_EXTERN PetscErrorCode DLMStokesGetPressureBlocks(DLMStokes stokes, PetscReal *bytes, PetscLogDouble *seconds, const char **absent);
/*
  The same bytes, over all ranks, for a mesh that need not be built; exists: within the scene's limit and with two periodic axes. Not collective.
*/
PETSC_EXTERN PetscErrorCode DLMStokesForeseePressureBlocks(const DLMScene *scene, PetscReal *bytes, PetscBool *exists);

/* Borrowed. any may be NULL: K (MATNEST), A (viscous block), B (-B, rectangular). */
PETSC_EXTERN PetscErrorCode DLMStokesGetOperators(DLMStokes stokes, Mat *K, Mat *A, Mat *B);
PETSC_EXTERN PetscErrorCode DLMStokesGetKSP(DLMStokes stokes, KSP *ksp);
/* A new vector (u, p); zero. Collective. */
PETSC_EXTERN PetscErrorCode DLMStokesCreateVec(DLMStokes stokes, Vec *x);
/* The parts of such a vector, without copying. Give them back. Collective. */
PETSC_EXTERN PetscErrorCode DLMStokesGetParts(DLMStokes stokes, Vec x, Vec *u, Vec *p);
PETSC_EXTERN PetscErrorCode DLMStokesRestoreParts(DLMStokes stokes, Vec x, Vec *u, Vec *p);
/* Right-hand side (f, g) of wall velocity and mean pressure gradient alone. Borrowed. */
PETSC_EXTERN PetscErrorCode DLMStokesGetWallForce(DLMStokes stokes, Vec *rhs);
/*
  Loosens inner iterations to rtol for solves that only feed a preconditioner, and tightens them again with the value returned in before; exact
  solvers are left alone. Collective.
*/
PETSC_EXTERN PetscErrorCode DLMStokesSetInnerTolerance(DLMStokes stokes, PetscReal rtol, PetscReal *before);
/*
  Raises PETSC_ERR_NOT_CONVERGED, naming solver and keys, if a Stokes solve since the last call failed, be it DLMStokesSolve or one inside another solver.
  Collective.
*/
PETSC_EXTERN PetscErrorCode DLMStokesRequireSolved(DLMStokes stokes);
/* x <- K^-1 rhs. Collective. Raises PETSC_ERR_NOT_CONVERGED naming the solver if it fails. */
PETSC_EXTERN PetscErrorCode DLMStokesSolve(DLMStokes stokes, Vec rhs, Vec x);
#endif
