/*
  Lubrication that the mesh does not resolve (docs/theory.md, L1 to L7): friction between two spheres, or a sphere and a wall, across a narrow gap.
  It acts on the motion of the two surfaces relative to each other at the gap, so it is zero for every motion of the pair as one rigid body; force and
  moment on the two are opposite; the friction is symmetric and positive semidefinite.
*/
#ifndef DLMLUBRICATION_H
#define DLMLUBRICATION_H

#include "dlmspheres.h"

/* A narrow gap between sphere i and sphere j, or a wall (j = -1). */
typedef struct {
  PetscInt  i, j;
  PetscReal e[3];         /* unit vector from i to j */
  PetscReal width;        /* gap between the surfaces; below 0: overlap */
  PetscReal arm[2];       /* from the centres of i and j to the point of the gap where motions are compared */
  PetscReal wall[3];      /* velocity of the wall */
  PetscReal normal, slide, couple, roll; /* coefficients of L3 */
  PetscBool cut;          /* its spheres are in different dense blocks (set by the saddle) */
} DLMGap;

typedef struct {
  PetscBool exists;       /* the scene has it */
  const char *absent;     /* why not, or NULL */
  PetscReal range;        /* gaps narrower than this, in mean radii of the two; a wall has radius 0 */
  PetscInt  n;
  DLMGap   *gaps;         /* at the centres of the last update; the same on every rank */
} DLMLubrication;

/* Decides by -lubrication, fluid, cover and whether two bodies are close or can meet. Release with DLMLubricationDestroy. */
PETSC_EXTERN PetscErrorCode DLMLubricationCreate(const DLMScene *scene, DLMLubrication *lubrication);
PETSC_EXTERN PetscErrorCode DLMLubricationDestroy(DLMLubrication *lubrication);
/* The gaps at the present centres. Not collective. */
PETSC_EXTERN PetscErrorCode DLMLubricationUpdate(DLMLubrication *lubrication, DLMSpheres spheres);
/*
  (L7) After the centres have moved from start[3 n] by the states' velocities over a time: a gap that closes at the rate k = speed/width (of the last
  update's centres) is left at no less than exp(-k time) of what it was at the start, as friction that goes with 1/gap would leave it; else a step that is too
  long for k would make the spheres overlap. Where it is not, the two are moved apart. The same on every rank. Not collective.
*/
PETSC_EXTERN PetscErrorCode DLMLubricationKeepGaps(DLMLubrication *lubrication, DLMSpheres spheres, const PetscReal *start, PetscReal time);
/* True if a sphere that is free, or fixed to a velocity, can come closer to a wall or another sphere. */
PETSC_EXTERN PetscBool DLMBodiesCanMeet(const DLMScene *scene);

/* Sets normal, slide, couple and roll from the width; h: of the mesh; other: radius of j, 0 for a wall; range: a length, from which on they are zero. */
PETSC_EXTERN void DLMGapSetFriction(PetscReal viscosity, PetscReal h, PetscReal radius, PetscReal other, PetscReal range, DLMGap *gap);
/* Adds the friction's force and torque (6 each) on i and j, for motions Ui and Uj (V, omega); load_j is NULL against a wall, whose Uj is not looked at. */
PETSC_EXTERN void DLMGapAddLoads(const DLMGap *gap, const PetscReal Ui[6], const PetscReal *Uj, PetscReal load_i[6], PetscReal *load_j);
/* matrix[12 x 12]: minus the loads on (i, j) by their motions (against a wall the first 6 x 6, the rest zero). */
PETSC_EXTERN void DLMGapMatrix(const DLMGap *gap, PetscReal matrix[144]);
#endif
