/*
  Exact solves in a uniform box: the viscous operator in sine or Fourier modes, and, where both plane axes are periodic, the
  pressure Schur complement as one dense Hermitian block per pressure mode (docs/theory.md, section "Box solver").

  With A = mu <grad, grad> (mu h times the 7-point stencil), B the divergence and K = [A -B^T; -B 0].
*/
#ifndef DLM_BOX_H
#define DLM_BOX_H

#include "modes.h"

typedef struct {
  DLMGrid    grid;
  PetscReal  viscosity;
  DLMModes  *velocity;
  DLMModes  *pressure;   /* NULL: no exact Schur complement (fewer than two periodic axes, or over the memory limit) */
  PetscInt   levels;     /* unknown velocity levels along the line axis */
  PetscInt   p_levels;   /* pressure levels */
  double    *pivot;      /* [level][modal entry]: 1/pivot of the line systems */
  double    *border;     /* periodic line: response of the other levels to the last one; else NULL */
  double    *border_inverse;
  double    *symbol;     /* [place][dz+2][component][re, im][row][fast mode]: the divergence row in plane modes */
  PetscInt   padded;     /* p_levels rounded up to a multiple of 4 */
  double    *schur;      /* [row][fast mode][i][re, im][padded]: inverse Schur blocks */
  double    *work;       /* one modal row of all levels and components */
  PetscReal  schur_bytes; /* memory of the blocks on this rank, built or not */
  PetscLogDouble schur_seconds; /* to build them */
} DLMBox;

/* Bytes of a pressure mode's block of so many pressure levels. */
static inline PetscReal DLMBoxBlockBytes(PetscInt levels)
{
  return 16.0 * levels * 4 * ((levels + 3) / 4);
}

/* limit: most MiB of Schur blocks on a rank. Collective. */
PETSC_INTERN PetscErrorCode DLMBoxCreate(DLMGrid grid, PetscReal viscosity, PetscReal limit, DLMBox **box);
PETSC_INTERN PetscErrorCode DLMBoxDestroy(DLMBox **box);
/* In half a box: what follows is done for fields that are the negatives of their mirror images, or (false) again for their own images. Not collective. */
PETSC_INTERN void DLMBoxTurn(DLMBox *box, PetscBool turned);
/* u <- A^-1 f on the unknown nodes (wall nodes of u are left alone). Arrays: local parts of global vectors. Collective. */
PETSC_INTERN PetscErrorCode DLMBoxSolveVelocity(DLMBox *box, const PetscScalar *f, PetscScalar *u);
/* p <- (B A^-1 B^T)^-1 b on zero-mean pressures. Needs box->pressure. Collective. */
PETSC_INTERN PetscErrorCode DLMBoxSolveSchur(DLMBox *box, const PetscScalar *b, PetscScalar *p);
/* K (u, p) = (f, g) in one pass: one transform of the velocity each way. Needs box->pressure. Collective. */
PETSC_INTERN PetscErrorCode DLMBoxSolveStokes(DLMBox *box, const PetscScalar *f, const PetscScalar *g, PetscScalar *u, PetscScalar *p);

/* Line systems of one modal row: x <- (mu h T)^-1 x for three components; level stride in doubles. */
PETSC_INTERN void DLMBoxSolveLines(const DLMBox *box, PetscInt row, double *x, PetscInt level_stride, PetscInt component_stride);
/* Fills box->symbol and box->schur. */
PETSC_INTERN PetscErrorCode DLMBoxBuildSymbol(DLMBox *box);
PETSC_INTERN PetscErrorCode DLMBoxBuildSchur(DLMBox *box);

/* Divergence row in plane modes: real parts at [0], imaginary parts at [row / 2]. */
static inline const double *DLMBoxSymbol(const DLMBox *box, int place, PetscInt dz, int component, PetscInt row)
{
  return box->symbol + ((((PetscInt)place * 5 + dz + 2) * 3 + component) * box->velocity->n_rows + row) * box->velocity->row;
}

/* Place of a pressure level, and the unknown velocity level at fine offset dz from it (-1: on or beyond a wall). */
static inline int DLMBoxPlace(const DLMBox *box, PetscInt level)
{
  if (box->grid->periodic[box->grid->line]) return DLM_INNER;
  return level == 0 ? DLM_LOWER : (level == box->p_levels - 1 ? DLM_UPPER : DLM_INNER);
}

static inline PetscInt DLMBoxFineLevel(const DLMBox *box, PetscInt level, PetscInt dz)
{
  const PetscInt n = box->levels, l = 2 * level + dz;
  if (box->grid->periodic[box->grid->line]) return (l + n) % n;
  return l < 1 || l > n ? -1 : l - 1;
}
#endif
