/*
  A CSV file with rows by step, written by rank 0: the first column of every row is the step. It grows in place by whole rows; a run that goes on keeps those
  up to its first step and drops what an interrupted run wrote beyond it.
*/
#ifndef DLM_CSV_H
#define DLM_CSV_H

#include "simimpl.h"

typedef struct {
  char   path[PETSC_MAX_PATH_LEN];
  size_t bytes; /* rank 0: its length as this run left it */
} DLMCsv;

/*
  Starts `name` in the output folder anew, or goes on with it if the simulation goes on; header: the columns, with the end of the line. Raises a user error,
  the file untouched, if it cannot be written or if the one to go on with has other columns. Collective.
*/
PETSC_INTERN PetscErrorCode DLMCsvOpen(DLMSimulation sim, const char *name, const char *header, DLMCsv *csv);
/* Adds the n bytes of rank 0's text, whole rows; NULL: there was no memory for it. Raises a user error if they cannot be written. Collective. */
PETSC_INTERN PetscErrorCode DLMCsvAppend(DLMSimulation sim, DLMCsv *csv, const char *text, size_t n);
#endif
