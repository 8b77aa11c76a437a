#ifndef DLM_OUTPUTIMPL_H
#define DLM_OUTPUTIMPL_H

#include "simimpl.h"

struct _p_DLMOutput {
  DLMSimulation  sim;
  FILE          *trajectory; /* rank 0 */
  DLMFieldFile   fields;     /* NULL unless asked for */
  PetscBool      terminal;   /* progress rewrites one line */
  PetscLogDouble started, last_progress;
  PetscReal      start_time;
};

/* Open: a run that goes on keeps what the files hold up to its first step. */
PETSC_INTERN PetscErrorCode DLMTrajectoryOpen(DLMOutput output);
PETSC_INTERN PetscErrorCode DLMTrajectoryWrite(DLMOutput output, PetscInt step, PetscReal time);
PETSC_INTERN PetscErrorCode DLMFieldsOpen(DLMOutput output);
PETSC_INTERN PetscErrorCode DLMFieldsWrite(DLMOutput output, PetscInt step, PetscReal time);
PETSC_INTERN PetscErrorCode DLMProgress(DLMOutput output, PetscInt step, PetscReal time, PetscBool last);
PETSC_INTERN PetscErrorCode DLMSummaryWrite(DLMOutput output);
#endif
