#ifndef DLM_DRYRUN_H
#define DLM_DRYRUN_H

#include <time.h>
#include "simimpl.h"

/* Processor seconds of this process so far: what else the machine does does not count. */
static inline PetscReal DLMProcessorSeconds(void)
{
  return (PetscReal)clock() / CLOCKS_PER_SEC;
}

/* piece.c: a piece of about `most` nodes or less, if there is one, else the scene. Free with Destroy. Collective. */
PETSC_INTERN PetscErrorCode DLMPieceCreate(const DLMScene *whole, PetscReal most, DLMScene *piece);
PETSC_INTERN PetscErrorCode DLMPieceDestroy(DLMScene *piece);

/* How costly a run will be: bytes over all ranks, and seconds, of the whole scene. */
typedef struct {
  PetscInt    tried;                      /* steps tried on the piece */
  DLMModelled modelled[DLM_N_PARTS];
  PetscReal   objects, program, within;   /* memory: the modelled; code and libraries; what lives only within the set-up or a step */
  PetscReal   set_up, first, step;        /* seconds: before the first step, of it, of another */
  PetscReal   verb[DLM_SPLIT_VERBS];      /* of another, by sub-step */
} DLMEstimate;

/*
  estimate.c: tries some steps on a piece and scales what they took. sim is the simulation of that piece, which took set_up processor seconds to make.
  Collective.
*/
PETSC_INTERN PetscErrorCode DLMEstimateMake(DLMSimulation sim, PetscReal set_up, DLMEstimate *estimate);
#endif
