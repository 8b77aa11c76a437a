#ifndef DLM_OUTPUTIMPL_H
#define DLM_OUTPUTIMPL_H

#include "csv.h"
#include "simimpl.h"
#include "wholefile.h"

enum { DLM_STEP_PARTS = DLM_SPLIT_VERBS + DLM_PART_WORK - DLM_PART_TRAJECTORY }; /* sub-steps and outputs */

struct _p_DLMOutput {
  DLMSimulation  sim;
  DLMCsv         trajectory; /* with spheres */
  DLMCsv         bulk;       /* if the walls shear the box, like the next */
  DLMShear       shear;
  PetscReal      volume;     /* of the box */
  DLMFieldFile   fields;     /* NULL unless asked for */
  PetscLogDouble started, last_progress;
  PetscLogDouble first_seconds;                /* of the first step */
  PetscInt       start_step, last_step;        /* last_: of the last progress line */
  PetscReal      part_seconds[DLM_STEP_PARTS]; /* spent in the parts of the steps until then */
};

/* Ends the run with one line if rank 0 could not write the file path; failed, of rank 0: 0, errno or one of wholefile.h. Collective. */
PETSC_INTERN PetscErrorCode DLMOutputRequire(DLMSimulation sim, int failed, const char *path);
/* Open: a run that goes on keeps what the files hold up to its first step. */
PETSC_INTERN PetscErrorCode DLMTrajectoryOpen(DLMOutput output);
PETSC_INTERN PetscErrorCode DLMTrajectoryWrite(DLMOutput output, PetscInt step, PetscReal time);
PETSC_INTERN PetscErrorCode DLMBulkOpen(DLMOutput output);
PETSC_INTERN PetscErrorCode DLMBulkWrite(DLMOutput output, PetscInt step, PetscReal time);
PETSC_INTERN PetscErrorCode DLMFieldsOpen(DLMOutput output);
/* multipliers.c: points, multipliers and tractions into the open output. Collective. */
PETSC_INTERN PetscErrorCode DLMMultipliersWrite(DLMSimulation sim, DLMFieldFile file);
PETSC_INTERN PetscErrorCode DLMFieldsWrite(DLMOutput output, PetscInt step, PetscReal time);
PETSC_INTERN PetscErrorCode DLMProgress(DLMOutput output, PetscInt step, PetscReal time, PetscBool last);
PETSC_INTERN PetscErrorCode DLMSummaryWrite(DLMOutput output);
#endif
