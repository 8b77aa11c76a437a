#ifndef DLM_MEMORY_H
#define DLM_MEMORY_H

#include <petscsys.h>

/* Bytes that this rank has on the heap now: everything that was asked for and not given back, by whichever library. Not collective. */
PETSC_INTERN PetscReal DLMMemoryInUse(void);
/* Bytes that this process holds now: its heap, code, libraries, what they map, and freed memory that was not given back. Not collective. */
PETSC_INTERN PetscReal DLMMemoryResident(void);
/* Gives freed memory back to the system. */
PETSC_INTERN void DLMMemoryTrim(void);
/* Most bytes that this process has held so far, its code and libraries included. Not collective. */
PETSC_INTERN PetscReal DLMMemoryPeak(void);
#endif
