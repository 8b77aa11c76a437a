/*
  The simulation: every object that a scene needs, in dependency order, and the TS that drives them.
*/
#ifndef DLMSIM_H
#define DLMSIM_H

#include "dlmcontact.h"
#include "dlmlubrication.h"
#include "dlmsaddle.h"
#include "dlmsplit.h"

typedef struct _p_DLMSimulation *DLMSimulation;

/*
  DLMSimulationSettle - takes the whole box where the scene's check chose half of it but this run needs all: other solvers than the program's, more ranks than half a mesh
  feeds, blocks over -stokes_block_limit; refuses these where the user asked for half. Call before the others. Collective.
*/
PETSC_EXTERN PetscErrorCode DLMSimulationSettle(DLMScene *scene);
/* scene must outlive it. Builds only what the scene needs. Collective on scene->comm. */
PETSC_EXTERN PetscErrorCode DLMSimulationCreate(const DLMScene *scene, DLMSimulation *sim);
PETSC_EXTERN PetscErrorCode DLMSimulationDestroy(DLMSimulation *sim);
/* What was built and why. Collective. */
PETSC_EXTERN PetscErrorCode DLMSimulationView(DLMSimulation sim, PetscViewer viewer);
/*
  Prints the scene, what would be built and why, and the memory, disk and time that the run needs, measured on a piece of the scene in a second or two; writes
  nothing. Refuses what DLMSimulationCreate refuses. Collective.
*/
PETSC_EXTERN PetscErrorCode DLMSimulationDryRun(const DLMScene *scene);
/* Runs to ts_max_time or ts_max_steps, or until SIGTERM or SIGUSR1; goes on from -restart. Writes the output files into scene->output_dir, which it creates. Collective. */
PETSC_EXTERN PetscErrorCode DLMSimulationSolve(DLMSimulation sim);
/* True if a signal ended the run before its time; a checkpoint of it was written. */
PETSC_EXTERN PetscErrorCode DLMSimulationGetStopped(DLMSimulation sim, PetscBool *stopped);
/* Borrowed; NULL where the scene has no such object. */
PETSC_EXTERN PetscErrorCode DLMSimulationGetObjects(DLMSimulation sim, TS *ts, DLMGrid *grid, DLMStokes *stokes, DLMSpheres *spheres, DLMSaddle *saddle);
#endif
