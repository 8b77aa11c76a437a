/*
  Checkpoints: what a run needs to go on as if it had not stopped. One HDF5 file, written by rank 0 from memory: gathered in natural order, so that any
  number of ranks can read it.

    first 512 bytes   text: format, program version, length, CRC-64 of the whole file (its own digits taken as 0)
    then HDF5         /scene/KEY  what must not change, as text;   everything else: numbers, and fields as [n3][n2][n1][components]

  HDF5 tools look for their data at byte 512 by themselves.
*/
#ifndef DLM_CHECKPOINT_H
#define DLM_CHECKPOINT_H

#include <petscdmda.h>
#include <hdf5.h>

enum { DLM_CHECKPOINT_FORMAT = 4, DLM_CHECKPOINT_HEAD = 512, DLM_CHECKPOINT_TEXT = 256 };

typedef struct {
  MPI_Comm  comm;
  PetscBool writing; /* else reading: the verbs below take their data instead of giving it */
  hid_t     h5;      /* rank 0 */
  char      path[PETSC_MAX_PATH_LEN];
} DLMCheckpointFile;

/* checkpoint_file.c. A file in memory for writing; all collective. */
PETSC_EXTERN PetscErrorCode DLMCheckpointFileCreate(MPI_Comm comm, const char *path, DLMCheckpointFile **file);
/* Opens an existing file after a look at every byte of it; raises a user error if it is missing, damaged or of another format. */
PETSC_EXTERN PetscErrorCode DLMCheckpointFileOpen(MPI_Comm comm, const char *path, DLMCheckpointFile **file);
/* Brings the file in memory to the disk: under a temporary name, flushed, then renamed. *failed: 0 or errno; the file of before is then untouched. */
PETSC_EXTERN PetscErrorCode DLMCheckpointFileSave(DLMCheckpointFile *file, int *failed);
PETSC_EXTERN PetscErrorCode DLMCheckpointFileDestroy(DLMCheckpointFile **file);

/*
  The verbs: each moves one named item in the direction of the file, so that one list of calls writes and reads. Numbers and texts are the same on every
  rank. v belongs to dm, whose components are interleaved; sign is as in DLMNaturalCreate: the file has the whole box.
*/
PETSC_EXTERN PetscErrorCode DLMCheckpointReals(DLMCheckpointFile *file, const char *name, PetscInt n, PetscReal *x);
PETSC_EXTERN PetscErrorCode DLMCheckpointInts(DLMCheckpointFile *file, const char *name, PetscInt n, PetscInt *x);
PETSC_EXTERN PetscErrorCode DLMCheckpointBool(DLMCheckpointFile *file, const char *name, PetscBool *x);
PETSC_EXTERN PetscErrorCode DLMCheckpointText(DLMCheckpointFile *file, const char *name, char text[DLM_CHECKPOINT_TEXT]);
PETSC_EXTERN PetscErrorCode DLMCheckpointField(DLMCheckpointFile *file, const char *name, DM dm, const PetscReal *sign, Vec v);
#endif
