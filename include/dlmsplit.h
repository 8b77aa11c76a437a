/*
  TS type "split": walks a table of sub-steps. The stepper knows no physics: it calls named verbs in the order, and over the
  fractions of dt, that the scheme says. Verbs that a scene does not add are skipped.

    -ts_split_scheme lie     predict, saddle, advect, stretch, judge                             order 1 (thesis 3.3.56-3.3.65)
    -ts_split_scheme strang  predict 1/2, saddle, stretch 1/2, advect, stretch 1/2, correct, judge  order 2, the default

  A verb may reject the step (DLMSplitReject): the state goes back to its start and the step is tried again with half of dt, up to
  -split_retries times; then the run's own end of it is called.
*/
#ifndef DLMSPLIT_H
#define DLMSPLIT_H

#include <petscts.h>

#define TSSPLIT "split"

enum { DLM_SPLIT_VERBS = 8 }; /* most verbs of a TS */

/* One verb: advances its part of the state from t over fraction * dt. */
typedef PetscErrorCode (*DLMSubstep)(void *context, PetscReal t, PetscReal dt, PetscReal fraction);
/* Moves the state between the objects that the verbs work on and the TS solution. */
typedef PetscErrorCode (*DLMStateCopy)(void *context, Vec solution);

PETSC_EXTERN PetscErrorCode DLMSplitRegister(void);
/* Adds a verb under its name in the schemes. Logs under a stage of that name. */
PETSC_EXTERN PetscErrorCode DLMSplitAddSubstep(TS ts, const char *name, DLMSubstep verb, void *context);
/* load: solution -> objects, before the first sub-step of a run; store: objects -> solution, after every step. */
PETSC_EXTERN PetscErrorCode DLMSplitSetState(TS ts, DLMStateCopy load, DLMStateCopy store, void *context);
/* save: keeps what a step changes, at its start; restore: brings it back; give_up: raises the error that ends the run. */
PETSC_EXTERN PetscErrorCode DLMSplitSetRetry(TS ts, PetscErrorCode (*save)(void *), PetscErrorCode (*restore)(void *), PetscErrorCode (*give_up)(void *), void *context);
/* Called by a verb, the same on every rank: the rest of the step is skipped. */
PETSC_EXTERN PetscErrorCode DLMSplitReject(TS ts);
/* Scheme by name; PETSC_ERR_USER_INPUT if there is none. */
PETSC_EXTERN PetscErrorCode DLMSplitSetScheme(TS ts, const char *name);
PETSC_EXTERN PetscErrorCode DLMSplitGetScheme(TS ts, const char **name, PetscInt *order);
/* The scheme's sub-steps that were added, with their fractions of dt: " predict(0.5) saddle(1)". */
PETSC_EXTERN PetscErrorCode DLMSplitDescribe(TS ts, size_t size, char text[]);
/* Seconds spent in the k-th verb added (this rank); name NULL past the last. */
PETSC_EXTERN PetscErrorCode DLMSplitGetTime(TS ts, PetscInt k, const char **name, PetscReal *seconds, PetscInt *calls);
#endif
