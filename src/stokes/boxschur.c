#include "../../include/private/box.h"
#include <petscblaslapack.h>

/* LAPACK's complex routines: Hermitian positive definite factor and inverse. PETSc's real build declares only the real ones. */
extern void zpotrf_(const char *, const PetscBLASInt *, double *, const PetscBLASInt *, PetscBLASInt *);
extern void zpotri_(const char *, const PetscBLASInt *, double *, const PetscBLASInt *, PetscBLASInt *);

/*
  Sum over the plane offsets of a divergence row times exp(i theta . o): the row seen by one plane mode. Between mirrors cosines along the slow axis stay cosines, and
  the sines of the component along it become cosines: the other half of the exponential cancels.
*/
static void RowSymbol(const DLMModes *m, int component, const double row[125], PetscInt dz, PetscReal theta_fast, PetscReal theta_slow, double *re, double *im)
{
  *re = *im = 0.0;
  for (int s = -2; s <= 2; s++)
    for (int f = -2; f <= 2; f++) {
      PetscInt o[3];
      double   b;
      o[m->line] = dz;
      o[m->fast] = f;
      o[m->slow] = s;
      b          = row[(o[0] + 2) + 5 * (o[1] + 2) + 25 * (o[2] + 2)];
      if (m->half) b *= component == m->slow ? PetscSinReal(theta_slow * s) : PetscCosReal(theta_slow * s);
      *re += b * PetscCosReal(theta_fast * f + (m->half ? 0.0 : theta_slow * s));
      *im += b * PetscSinReal(theta_fast * f + (m->half ? 0.0 : theta_slow * s));
    }
}

PetscErrorCode DLMBoxBuildSymbol(DLMBox *box)
{
  DLMModes       *m    = box->velocity;
  const PetscInt  half = m->row / 2, nf = m->count[m->fast], period = m->cells[m->slow] * (m->half ? 2 : 1);
  const PetscReal h2   = box->grid->h * box->grid->h;

  PetscFunctionBeginUser;
  box->symbol = fftw_alloc_real(PetscMax(4, 3 * 5 * 3 * m->n_rows * m->row));
  for (int c = 0; c < 3; c++) {
    int    place[3] = { DLM_INNER, DLM_INNER, DLM_INNER };
    double row[3][125];
    place[m->line] = c;
    DLMKuhnDivergence(place, box->grid->symmetric, row);
    for (PetscInt dz = -2; dz <= 2; dz++)
      for (int j = 0; j < 3; j++)
        for (PetscInt r = 0; r < m->n_rows; r++) {
          double *symbol = (double *)DLMBoxSymbol(box, c, dz, j, r);
          for (PetscInt i = 0; i < half; i++) {
            symbol[i] = symbol[half + i] = 0.0;
            if (i > nf / 2) continue;
            RowSymbol(m, j, row[j], dz, 2.0 * PETSC_PI * i / nf, 2.0 * PETSC_PI * m->rows[r] / period, &symbol[i], &symbol[half + i]);
            symbol[i] *= h2;
            symbol[half + i] *= h2;
          }
        }
  }
  PetscFunctionReturn(0);
}

/* The divergence rows of one velocity mode, conjugated on demand: coefficient[place][dz+2][j][re, im]. */
typedef double ModeSymbol[3][5][3][2];

static void GetModeSymbol(const DLMBox *box, PetscInt row, PetscInt fast, PetscBool conjugate, ModeSymbol symbol)
{
  const PetscInt half = box->velocity->row / 2;

  for (int c = 0; c < 3; c++)
    for (int dz = -2; dz <= 2; dz++)
      for (int j = 0; j < 3; j++) {
        const double *s         = DLMBoxSymbol(box, c, dz, j, row);
        symbol[c][dz + 2][j][0] = s[fast];
        symbol[c][dz + 2][j][1] = conjugate ? -s[half + fast] : s[half + fast];
      }
}

/* Line solve of one mode for many right-hand sides: x[level][n]. */
static void SolveLineColumns(const DLMBox *box, PetscInt at, PetscInt n, double *x)
{
  const PetscInt width = box->velocity->n_rows * box->velocity->row, inner = box->levels - (box->border ? 1 : 0);
  const double   scale = 1.0 / (box->viscosity * box->grid->h), *pivot = box->pivot + at;

  for (PetscInt k = 1; k < inner; k++)
    for (PetscInt i = 0; i < n; i++) x[k * n + i] += pivot[(k - 1) * width] * x[(k - 1) * n + i];
  for (PetscInt k = inner - 1; k >= 0; k--)
    for (PetscInt i = 0; i < n; i++)
      x[k * n + i] = pivot[k * width] * (scale * x[k * n + i] + (k < inner - 1 ? x[(k + 1) * n + i] : 0.0));
  if (!box->border) return;
  for (PetscInt i = 0; i < n; i++) {
    double *last = x + inner * n + i;
    *last        = box->border_inverse[at] * (scale * *last + x[i] + x[(inner - 1) * n + i]);
    for (PetscInt k = 0; k < inner; k++) x[k * n + i] += box->border[k * width + at] * *last;
  }
}

/* block += weight B A^-1 B^H of one velocity mode; block[col][row] complex, column major. */
static void AddModeBlock(const DLMBox *box, PetscInt row, PetscInt fast, PetscBool conjugate, double *x, double *block)
{
  const PetscInt n = box->p_levels, at = row * box->velocity->row + 2 * fast;
  ModeSymbol     symbol;

  GetModeSymbol(box, row, fast, conjugate, symbol);
  for (int j = 0; j < 3; j++) {
    for (PetscInt i = 0; i < box->levels * 2 * n; i++) x[i] = 0.0;
    for (PetscInt m = 0; m < n; m++)
      for (int dz = -2; dz <= 2; dz++) {
        const PetscInt l = DLMBoxFineLevel(box, m, dz);
        const double  *s = symbol[DLMBoxPlace(box, m)][dz + 2][j];
        if (l < 0) continue;
        x[(l * n + m) * 2] += s[0];
        x[(l * n + m) * 2 + 1] -= s[1];
      }
    SolveLineColumns(box, at, 2 * n, x);
    for (PetscInt m = 0; m < n; m++)
      for (int dz = -2; dz <= 2; dz++) {
        const PetscInt l = DLMBoxFineLevel(box, m, dz);
        const double  *s = symbol[DLMBoxPlace(box, m)][dz + 2][j];
        if (l < 0) continue;
        for (PetscInt q = 0; q < n; q++) {
          const double *y = x + (l * n + q) * 2;
          block[2 * (q * n + m)] += 0.25 * (s[0] * y[0] - s[1] * y[1]);
          block[2 * (q * n + m) + 1] += 0.25 * (s[0] * y[1] + s[1] * y[0]);
        }
      }
  }
}

/* Hermitian inverse in place; a block whose null space is the constant gets its pseudo-inverse. */
static PetscErrorCode InvertBlock(PetscInt n, PetscBool has_constant, double *block)
{
  PetscBLASInt size = (PetscBLASInt)n, info;
  double       shift = 0.0;

  PetscFunctionBegin;
  if (has_constant) {
    for (PetscInt i = 0; i < n; i++) shift += block[2 * i * (n + 1)] / n;
    for (PetscInt i = 0; i < n * n; i++) block[2 * i] += shift / n;
  }
  zpotrf_("L", &size, block, &size, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "A pressure Schur block of size %d is not positive definite (zpotrf: %d)", size, info);
  zpotri_("L", &size, block, &size, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "A pressure Schur block of size %d has no inverse (zpotri: %d)", size, info);
  if (has_constant)
    for (PetscInt i = 0; i < n * n; i++) block[2 * i] -= 1.0 / (shift * n);
  PetscFunctionReturn(0);
}

/* The lower triangle that LAPACK leaves, as full rows with real and imaginary parts apart. */
static void StoreBlock(PetscInt n, PetscInt padded, const double *block, double *store)
{
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt k = 0; k < padded; k++) {
      const PetscBool lower = (PetscBool)(i >= k);
      const double   *entry = block + 2 * (lower ? k * n + i : i * n + PetscMin(k, n - 1));
      store[i * 2 * padded + k]          = k < n ? entry[0] : 0.0;
      store[i * 2 * padded + padded + k] = k < n ? (lower ? entry[1] : -entry[1]) : 0.0;
    }
}

PetscErrorCode DLMBoxBuildSchur(DLMBox *box)
{
  DLMModes      *p = box->pressure, *v = box->velocity;
  const PetscInt n = box->p_levels, coarse = p->count[p->fast], modes = coarse / 2 + 1, ns = p->cells[p->slow];
  double        *x, *block;

  PetscFunctionBeginUser;
  box->schur = fftw_alloc_real(PetscMax(4, p->n_rows * modes * n * 2 * box->padded));
  PetscCall(PetscMalloc2(box->levels * 2 * n, &x, 2 * n * n, &block));
  for (PetscInt r = 0; r < p->n_rows; r++) {
    const PetscInt k = p->rows[r];
    for (PetscInt f = 0; f < modes; f++) {
      PetscCall(PetscArrayzero(block, 2 * n * n));
      for (int alias = 0; alias < 2; alias++) { /* the velocity rows that alias onto this one, and onto its conjugate */
        const PetscInt other = v->half ? 2 * ns - k : k + ns, direct = alias ? other : k;
        AddModeBlock(box, v->row_of[direct], f, PETSC_FALSE, x, block);
        AddModeBlock(box, v->row_of[v->half ? direct : (2 * ns - direct) % (2 * ns)], coarse - f, PETSC_TRUE, x, block);
      }
      PetscCall(InvertBlock(n, (PetscBool)(k == 0 && f == 0), block));
      StoreBlock(n, box->padded, block, box->schur + (r * modes + f) * n * 2 * box->padded);
    }
  }
  PetscCall(PetscFree2(x, block));
  PetscFunctionReturn(0);
}
