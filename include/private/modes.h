/*
  Plane modes of a DMDA field, kept level by level along the line axis.

  The two plane axes (fast, slow) are transformed by FFTW: Fourier on a periodic axis, sine on an axis between walls (velocity only:
  the unknowns are the inner nodes). Between mirrors x2, then the slow axis, has cosines, and sines for u2: as
  matrix products, which on the lengths of boxes beat FFTW's. A modal row holds every fast mode of one slow mode; the rows are shared over the
  ranks, each rank holds all levels of its rows:

    modal[((level * dof + component) * n_rows + r) * row + i]

  With both plane axes periodic a row holds complex pairs, fast modes 0..nf/2. Rows that alias onto the same pressure
  mode, or onto its conjugate, stay on one rank, so that the divergence is local in modal space.
*/
#ifndef DLM_MODES_H
#define DLM_MODES_H

#include <fftw3.h>
#include <petscsf.h>
#include "gridimpl.h"

typedef struct {
  DLMGrid      grid;
  PetscInt     dof;
  PetscInt     line, fast, slow;        /* axes */
  PetscInt     first[3], count[3];      /* unknown nodes of each axis */
  PetscInt     cells[3];                /* cells of this field's mesh */
  PetscBool    is_complex;              /* both plane axes periodic */
  PetscBool    half;                    /* the slow axis lies between mirrors */
  PetscBool    turned;                  /* half: the fields are not their own mirror images but the negatives of them, so sines and cosines change places */
  PetscInt     row;                     /* doubles in a modal row, a multiple of 4; the padding is zero */
  PetscInt     plane_size;              /* doubles in one component of a plane, a multiple of 4 */
  PetscInt     n_rows;                  /* rows of this rank */
  PetscInt    *rows;                    /* their slow modes */
  PetscInt    *row_of;                  /* slow mode -> local row, or -1 */
  double      *modal;
  PetscReal    scale;                   /* 1 / (backward of forward) */
  /* set-up of the data's way */
  PetscMPIInt  size, rank;
  PetscInt     level_start, n_levels;   /* levels this rank transforms, counted from first[line] */
  PetscInt     stride[3];               /* of the axes in the source array, in doubles */
  PetscInt     origin;                  /* of the first unknown of the first level in the source array, in doubles */
  PetscSF      sf;                      /* DMDA vector -> levels; NULL if the DMDA consists of such slabs */
  MPI_Datatype node;
  double      *slab, *plane, *plane_modes, *buffer;
  PetscInt    *row_order, *row_owner;   /* all slow modes, sorted by owner */
  PetscMPIInt *slab_count, *slab_start, *mode_count, *mode_start;
  fftw_plan    forward, backward;
  double      *waves[2][2];             /* half: cosines and sines of the slow axis; of the even and of the odd modes, [mode][node] */
  double      *folded;                  /* half: sums and differences of the nodes of a plane's modes */
} DLMModes;

/* dof 3: velocity, dof 1: pressure (needs both plane axes periodic). Collective. */
PETSC_INTERN PetscErrorCode DLMModesCreate(DLMGrid grid, PetscInt dof, DLMModes **modes);
PETSC_INTERN PetscErrorCode DLMModesDestroy(DLMModes **modes);
/* array: the local part of a global vector. Collective. */
PETSC_INTERN PetscErrorCode DLMModesForward(DLMModes *modes, const PetscScalar *array);
/* Writes the unknown nodes only; the result is multiplied by modes->scale. Destroys modes->modal. Collective. */
PETSC_INTERN PetscErrorCode DLMModesBackward(DLMModes *modes, PetscScalar *array);
/* Pressure rows of the rank that has most of them, if the slow axis has `rows` pressure modes (rows + 1 if half) and both plane axes are periodic. */
PETSC_INTERN PetscInt DLMModesMostPressureRows(PetscInt rows, PetscBool half, PetscMPIInt size);
/* Pressure row that a velocity row aliases onto, as it is and conjugated. */
static inline PetscInt DLMModesAlias(const DLMModes *pressure, PetscInt row, PetscBool conjugate)
{
  const PetscInt n = pressure->cells[pressure->slow];

  if (pressure->half) return PetscMin(row, 2 * n - row);
  return (conjugate ? 2 * n - row : row) % n;
}
/* Eigenvalue of (-1, 2, -1) on an axis for mode i as FFTW orders them. */
PETSC_INTERN PetscReal DLMModesEigenvalue(const DLMModes *modes, PetscInt axis, PetscInt i);
#endif
