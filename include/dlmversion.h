/*
  What this program is and what it stands on: version, commit, build, libraries.
*/
#ifndef DLMVERSION_H
#define DLMVERSION_H

#include <petscsys.h>

/*
  DLMVersionGetFact - fact k = 0, 1, ... as a lower-case name and a line of text, shorter than size; name is NULL beyond the last. The first is the
  program's version. Versions of PETSc, MPI, HDF5, FFTW and libyaml are those of the libraries that run; of METIS, and of hypre, which comes with PETSc,
  those that were there when dlmfd and PETSc were compiled. Not collective; needs neither MPI nor PETSc to be initialised.
*/
PETSC_EXTERN PetscErrorCode DLMVersionGetFact(PetscInt k, const char **name, char value[], size_t size);
/* Prints the facts, one a line: `dlmfd -version`. Not collective. */
PETSC_EXTERN PetscErrorCode DLMVersionPrint(FILE *file);
#endif
