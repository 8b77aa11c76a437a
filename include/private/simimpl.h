#ifndef DLM_SIMIMPL_H
#define DLM_SIMIMPL_H

#include <petsctime.h>
#include "../dlmsim.h"
#include "dlmfieldsio.h"

typedef struct _p_DLMOutput *DLMOutput;

struct _p_DLMSimulation {
  const DLMScene *scene;
  DLMGrid         grid;
  DLMStokes       stokes;
  DLMSpheres      spheres;  /* NULL without spheres, like pairing */
  DLMPairing      pairing;
  DLMSaddle       saddle;
  DLMContact      contact;
  TS              ts;
  Vec             solution; /* sphere states: centre, V, omega and those of the step before, 15 per sphere */
  PetscReal      *start;    /* centres at the start of the step, 3 per sphere */
  PetscReal      *force, *torque; /* on the spheres beside the fluid */
  PetscReal       last_dt;  /* of the step before; 0 in the first */
  DLMOutput       output;
  PetscLogDouble  created, setup_seconds;
};

/* state.c */
PETSC_INTERN PetscErrorCode DLMSimulationCreateSolution(DLMSimulation sim);
PETSC_INTERN PetscErrorCode DLMSimulationLoad(void *sim, Vec solution);
PETSC_INTERN PetscErrorCode DLMSimulationStore(void *sim, Vec solution);
/* substeps.c */
PETSC_INTERN PetscErrorCode DLMSimulationAddSubsteps(DLMSimulation sim);
/* Velocities that balance the forces at the present centres, for spheres without inertia. */
PETSC_INTERN PetscErrorCode DLMSimulationStart(DLMSimulation sim);
/* io/output.c: a TS monitor that writes the run's files and its progress. */
PETSC_INTERN PetscErrorCode DLMOutputCreate(DLMSimulation sim, DLMOutput *output);
PETSC_INTERN PetscErrorCode DLMOutputFinish(DLMOutput output);
PETSC_INTERN PetscErrorCode DLMOutputDestroy(DLMOutput *output);
#endif
