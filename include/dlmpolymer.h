/*
  The conformation tensor C of a viscoelastic fluid on the velocity grid: its stress, and the steps that carry it.

  dC/dt + (u.grad) C = (grad u) C + C (grad u)^T - (C - I)/lambda1        (thesis 3.2.6)

  C is planar: on each rank the component 11 of all its nodes, then 22, 33, 12, 13, 23; nodes as in a velocity vector. The stress force and
  the gradient that stretches C are discrete adjoints (docs/theory.md, V2): stress work equals stretching to rounding.
*/
#ifndef DLMPOLYMER_H
#define DLMPOLYMER_H

#include "dlmspheres.h"

typedef struct _p_DLMPolymer *DLMPolymer;

/* What a run watches, over all nodes. */
typedef struct {
  PetscReal smallest_eigenvalue, place[3]; /* of C, and its node */
  PetscReal largest_trace;
  PetscReal courant;   /* of the last advection, over its whole interval */
  PetscInt  substeps;  /* it was cut into */
  PetscBool sound;     /* C is finite and positive definite */
} DLMPolymerHealth;

/* What the next step needs beside C and the last velocity. */
typedef struct {
  Vec       force_now, force_before; /* extra force at the last two moments, in the layout of a velocity; borrowed */
  PetscReal time_now, time_before;   /* those moments */
  PetscInt  n_forces;                /* how many of the two are known */
  PetscReal velocity_time, velocity_time_before; /* those of the last velocities */
  PetscInt  n_velocities;            /* how many of the two are known */
  PetscInt  cut;                     /* which way the last advection cut the cubes */
  PetscReal *near;                   /* flows near the spheres that belong to the last velocity, the same on every rank; borrowed */
  PetscInt  n_near;                  /* numbers in them; 0 unless the rule for C is stokes */
} DLMPolymerState;

/* Means of the extra stress (V3, with the fluid parts of V7): symmetric tensors 11, 22, 33, 12, 13, 23, the same on every rank. */
typedef struct {
  PetscReal box[6];     /* over the box */
  PetscReal solvent[6]; /* part of that: what a solvent whose viscosity varies has beyond its viscosity at rest */
} DLMPolymerStress;

/* spheres may be NULL; grid, spheres and scene must outlive the object. C starts at I, or with the mode that the scene asks for. Collective. */
PETSC_EXTERN PetscErrorCode DLMPolymerCreate(DLMGrid grid, DLMSpheres spheres, const DLMScene *scene, DLMPolymer *polymer);
PETSC_EXTERN PetscErrorCode DLMPolymerDestroy(DLMPolymer *polymer);
PETSC_EXTERN PetscErrorCode DLMPolymerView(DLMPolymer polymer, PetscViewer viewer);
/* Borrowed; may be changed between steps. */
PETSC_EXTERN PetscErrorCode DLMPolymerGetConformation(DLMPolymer polymer, Vec *C);
/* Applies the rule of the scene for C inside the spheres at their present centres. Collective. */
PETSC_EXTERN PetscErrorCode DLMPolymerSetInside(DLMPolymer polymer);
/* The viscosity that the implicit operator is to have at target, in a step of dt; the next forces are made for it (V3). Not collective. */
PETSC_EXTERN PetscErrorCode DLMPolymerChooseViscosity(DLMPolymer polymer, PetscReal dt, PetscReal target, PetscReal *viscosity);
/*
  f <- force on the velocity nodes (zero on walls) of the stress of C beyond what the implicit operator holds (V3). C belongs to `time`, the last
  velocity to the time told to SetVelocity; order 2 extrapolates the force to `target`. Collective.
*/
PETSC_EXTERN PetscErrorCode DLMPolymerForce(DLMPolymer polymer, PetscReal time, PetscReal target, PetscInt order, Vec f);
/* Of the present C and the last velocity. Collective. */
PETSC_EXTERN PetscErrorCode DLMPolymerGetStress(DLMPolymer polymer, DLMPolymerStress *stress);
/*
  stress[6 n]: integral over the volume of every sphere of the stress behind the last force, the same on every rank; 0 where a stress offset keeps that out
  of the spheres. Borrowed. Not collective.
*/
PETSC_EXTERN PetscErrorCode DLMPolymerGetInsideStress(DLMPolymer polymer, const PetscReal **stress);
/* Takes the velocity (u leads in x, more may follow) and its projected gradient. Collective. */
PETSC_EXTERN PetscErrorCode DLMPolymerSetVelocity(DLMPolymer polymer, PetscReal time, Vec x);
/* Advects C with that velocity over dt. Collective. */
PETSC_EXTERN PetscErrorCode DLMPolymerAdvect(DLMPolymer polymer, PetscReal dt);
/* Stretches and relaxes C with that gradient over dt: exactly under order 2, by the thesis's step under order 1. Collective. */
PETSC_EXTERN PetscErrorCode DLMPolymerStretch(DLMPolymer polymer, PetscReal dt, PetscInt order);
/* Collective. */
PETSC_EXTERN PetscErrorCode DLMPolymerGetHealth(DLMPolymer polymer, DLMPolymerHealth *health);
/* Keeps the state, and brings the kept one back. Collective. */
PETSC_EXTERN PetscErrorCode DLMPolymerKeep(DLMPolymer polymer);
PETSC_EXTERN PetscErrorCode DLMPolymerBringBack(DLMPolymer polymer);
/*
  For checkpoints. The vectors and arrays of GetState may be written to; SetState then takes the numbers, the rate of deformation D of the velocity before the last one
  (laid out like C; read if two velocities are known) and the last velocity (as for SetVelocity; read if one is known). C follows by
  DLMPolymerGetConformation. Collective.
*/
PETSC_EXTERN PetscErrorCode DLMPolymerGetState(DLMPolymer polymer, DLMPolymerState *state);
PETSC_EXTERN PetscErrorCode DLMPolymerGetRateBefore(DLMPolymer polymer, Vec rate);
PETSC_EXTERN PetscErrorCode DLMPolymerSetState(DLMPolymer polymer, const DLMPolymerState *state, Vec rate_before, Vec velocity);
/* Stress work f.u of a velocity that vanishes on the walls, and minus stretching sum_a m_a tau_a : grad u_a. Equal to rounding. Collective. */
PETSC_EXTERN PetscErrorCode DLMPolymerGetWork(DLMPolymer polymer, Vec u, PetscReal *stress_work, PetscReal *stretching);
#endif
