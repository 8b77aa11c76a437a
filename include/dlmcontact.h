/*
  Short-range repulsion (spec 6; Glowinski, Pan, Hesla, Joseph and Periaux 1999): for two spheres with centres d apart and
  touching distance D = a_i + a_j,

    F = stiffness ((D + range - d) / range)^2 (G_i - G_j) / d   if d < D + range, else 0,

  and against a wall the same with the mirror image (D = 2 a, d = twice the distance) and twice the stiffness.
*/
#ifndef DLMCONTACT_H
#define DLMCONTACT_H

#include "dlmspheres.h"

typedef struct {
  PetscBool can_meet;  /* two bodies of the scene can come closer to each other */
  PetscBool exists;    /* and then repel */
  const char *absent;  /* why not, or NULL */
  PetscReal range;     /* rho */
  PetscReal stiffness; /* force at touching */
  PetscReal largest;   /* largest force so far in the run */
  PetscReal moment[6]; /* of the present forces: minus the sum of force times lever arm, which is what repulsion adds to the box's stress times its volume */
} DLMContact;

/*
  Chooses what the scene leaves open: range h/8, or a thousandth of the smallest radius where lubrication keeps the bodies apart; stiffness five times the
  largest viscous and buoyant force on a sphere.
*/
PETSC_EXTERN PetscErrorCode DLMContactCreate(const DLMScene *scene, PetscBool lubricated, DLMContact *contact);
/*
  The stiffness, unless the scene gives it, in a fluid of so many times the scene's viscosity: repulsion pushes against viscous forces and must not outrun them.
  Not collective.
*/
PETSC_EXTERN void DLMContactSetViscosity(const DLMScene *scene, PetscReal ratio, DLMContact *contact);
/* force[3 n] <- repulsion on every sphere at the present centres; the same on every rank. Not collective. */
PETSC_EXTERN PetscErrorCode DLMContactForces(DLMContact *contact, DLMSpheres spheres, PetscReal *force);
#endif
