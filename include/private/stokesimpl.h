#ifndef DLM_STOKESIMPL_H
#define DLM_STOKESIMPL_H

#include "../dlmstokes.h"
#include "box.h"

/* Nonzero runs of a divergence row at one place: coefficients of `length` neighbouring doubles of the velocity array. */
typedef struct {
  PetscInt offset[3]; /* fine nodes from the pressure node to the start of the run */
  PetscInt length;    /* doubles */
  double   coefficient[15];
} DLMRun;

typedef struct {
  PetscInt n;
  DLMRun   run[25];
} DLMRunList;

struct _p_DLMStokes {
  DLMGrid     grid;
  PetscReal   viscosity;
  PetscReal   speed;          /* norm of the last velocity of an inner solve */
  PetscBool   watch_inner;    /* the inner solves have to converge, since nothing around them checks */
  KSP         failed;         /* the first solve that was no good since the last DLMStokesRequireSolved, and why; NULL: none */
  KSPConvergedReason failure;
  DLMBox     *box;
  Mat         A, B, BT, K; /* A shell or assembled; B = -divergence (shell) */
  Mat         mass;        /* -pressure mass / mu: stands in for the Schur complement where it is not exact */
  DM          viscous_dm;  /* star stencil, for the assembled A */
  KSP         ksp;
  IS          part[2];     /* velocity, pressure */
  Vec         wall_force;
  PetscInt    n_u, n_p;    /* local sizes */
  DLMRunList *runs;        /* one per class of place: [5][5][5] */
};

PETSC_INTERN PetscErrorCode DLMStokesBuildDivergence(DLMStokes stokes);
PETSC_INTERN PetscErrorCode DLMStokesBuildViscous(DLMStokes stokes, PetscBool assemble);
PETSC_INTERN PetscErrorCode DLMStokesBuildPressureMass(DLMStokes stokes);
PETSC_INTERN PetscErrorCode DLMStokesBuildWallForce(DLMStokes stokes, const DLMScene *scene);
/* f -= factor h^3 gradient at the owned velocity nodes off the walls: that of the scene is part of wall_force. Not collective. */
PETSC_INTERN void DLMStokesAddPressureGradient(DLMStokes stokes, const PetscReal gradient[3], PetscReal factor, PetscScalar *f);
/* The stokes object that a matrix belongs to; error if none. */
PETSC_INTERN PetscErrorCode DLMStokesFromMat(Mat mat, DLMStokes *stokes);
PETSC_INTERN PetscErrorCode DLMStokesAttach(DLMStokes stokes, Mat mat);
#endif
