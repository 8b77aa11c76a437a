#ifndef DLM_OUTPUTIMPL_H
#define DLM_OUTPUTIMPL_H

#include "simimpl.h"

struct _p_DLMOutput {
  DLMSimulation  sim;
  char           trajectory[PETSC_MAX_PATH_LEN]; /* path of trajectory.csv */
  size_t         trajectory_bytes;               /* rank 0: its length as this run left it */
  DLMFieldFile   fields;     /* NULL unless asked for */
  PetscBool      terminal;   /* progress rewrites one line */
  PetscLogDouble started, last_progress;
  PetscReal      start_time;
};

/* What DLMOutputRequire takes beside errno: the file is not as this run left it. */
enum { DLM_FILE_CHANGED = -1 };

/* Ends the run with one line if rank 0 could not write the file path; failed, of rank 0: 0, errno or DLM_FILE_CHANGED. Collective. */
PETSC_INTERN PetscErrorCode DLMOutputRequire(DLMSimulation sim, int failed, const char *path);
/* Open: a run that goes on keeps what the files hold up to its first step. */
PETSC_INTERN PetscErrorCode DLMTrajectoryOpen(DLMOutput output);
PETSC_INTERN PetscErrorCode DLMTrajectoryWrite(DLMOutput output, PetscInt step, PetscReal time);
PETSC_INTERN PetscErrorCode DLMFieldsOpen(DLMOutput output);
PETSC_INTERN PetscErrorCode DLMFieldsWrite(DLMOutput output, PetscInt step, PetscReal time);
PETSC_INTERN PetscErrorCode DLMProgress(DLMOutput output, PetscInt step, PetscReal time, PetscBool last);
PETSC_INTERN PetscErrorCode DLMSummaryWrite(DLMOutput output);
#endif
