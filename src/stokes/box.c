#include <petsctime.h>
#include "../../include/private/box.h"

/* Pivots of the Thomas recurrence for (-1, 2 + c, -1), c the eigenvalue of the plane operator. */
static PetscErrorCode BuildPivots(DLMBox *box)
{
  DLMModes       *m     = box->velocity;
  const PetscInt  width = m->n_rows * m->row;
  const PetscBool wrap  = m->grid->periodic[m->line];
  const PetscInt  inner = box->levels - (wrap ? 1 : 0);

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(PetscMax(1, width * box->levels), &box->pivot));
  if (wrap) PetscCall(PetscCalloc2(width * box->levels, &box->border, width, &box->border_inverse));
  for (PetscInt r = 0; r < m->n_rows; r++) {
    for (PetscInt i = 0; i < m->row; i++) {
      const PetscInt  f        = PetscMin(m->is_complex ? i / 2 : i, m->count[m->fast] - 1);
      const PetscReal diagonal = 2.0 + DLMModesEigenvalue(m, m->fast, f) + DLMModesEigenvalue(m, m->slow, m->rows[r]);
      double         *pivot = box->pivot + r * m->row + i, *w = wrap ? box->border + r * m->row + i : NULL;
      PetscReal       last  = 0.0;
      for (PetscInt k = 0; k < inner; k++) pivot[k * width] = last = 1.0 / (diagonal - last);
      if (!wrap) continue;
      w[0]                    = 1.0;
      w[(inner - 1) * width] += 1.0;
      for (PetscInt k = 1; k < inner; k++) w[k * width] += pivot[(k - 1) * width] * w[(k - 1) * width];
      w[(inner - 1) * width] *= pivot[(inner - 1) * width];
      for (PetscInt k = inner - 2; k >= 0; k--) w[k * width] = pivot[k * width] * (w[k * width] + w[(k + 1) * width]);
      last = diagonal - w[0] - w[(inner - 1) * width];
      /* the mean has no viscous force: its border value is set to zero here and the mean removed in SolveMean */
      box->border_inverse[r * m->row + i] = PetscAbsReal(diagonal - 2.0) < 1e-14 ? 0.0 : 1.0 / last;
    }
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMBoxCreate(DLMGrid grid, PetscReal viscosity, PetscReal limit, DLMBox **new_box)
{
  DLMBox   *box;
  PetscReal largest;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&box));
  box->grid      = grid;
  box->viscosity = viscosity;
  PetscCall(DLMModesCreate(grid, 3, &box->velocity));
  box->levels = box->velocity->count[grid->line];
  PetscCall(BuildPivots(box));
  box->work = fftw_alloc_real(box->levels * 3 * box->velocity->row);
  if (box->velocity->is_complex) {
    PetscCall(DLMModesCreate(grid, 1, &box->pressure));
    box->p_levels    = box->pressure->count[grid->line];
    box->padded      = 4 * ((box->p_levels + 3) / 4);
    box->schur_bytes = (PetscReal)box->pressure->n_rows * (box->pressure->count[box->pressure->fast] / 2 + 1) * DLMBoxBlockBytes(box->p_levels);
    PetscCallMPI(MPI_Allreduce(&box->schur_bytes, &largest, 1, MPIU_REAL, MPIU_MAX, grid->comm));
    if (largest > limit * 1048576.0) {
      PetscCall(DLMModesDestroy(&box->pressure));
    } else {
      PetscLogDouble start, end;
      PetscCall(DLMBoxBuildSymbol(box));
      PetscCall(PetscTime(&start));
      PetscCall(DLMBoxBuildSchur(box));
      PetscCall(PetscTime(&end));
      box->schur_seconds = end - start;
    }
  }
  *new_box = box;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMBoxDestroy(DLMBox **pointer)
{
  DLMBox *box = *pointer;

  PetscFunctionBeginUser;
  if (!box) PetscFunctionReturn(0);
  PetscCall(DLMModesDestroy(&box->velocity));
  PetscCall(DLMModesDestroy(&box->pressure));
  PetscCall(PetscFree(box->pivot));
  PetscCall(PetscFree2(box->border, box->border_inverse));
  fftw_free(box->symbol);
  fftw_free(box->schur);
  fftw_free(box->work);
  PetscCall(PetscFree(*pointer));
  PetscFunctionReturn(0);
}

/* Thomas recurrence on n neighbouring modes at once. */
static void SolveThomas(PetscInt n, PetscInt levels, const double *pivot, PetscInt width, double *x, PetscInt stride, double scale)
{
  for (PetscInt k = 1; k < levels; k++) {
    const double *restrict r = pivot + (k - 1) * width, *restrict below = x + (k - 1) * stride;
    double *restrict       y = x + k * stride;
    for (PetscInt i = 0; i < n; i++) y[i] += r[i] * below[i];
  }
  for (PetscInt k = levels - 1; k >= 0; k--) {
    const double *restrict r = pivot + k * width, *restrict above = x + (k + 1) * stride;
    double *restrict       y = x + k * stride;
    if (k == levels - 1)
      for (PetscInt i = 0; i < n; i++) y[i] = r[i] * scale * y[i];
    else
      for (PetscInt i = 0; i < n; i++) y[i] = r[i] * (scale * y[i] + above[i]);
  }
}

/* A periodic line: the last level is eliminated as a border of the others. */
static void SolveBordered(const DLMBox *box, PetscInt row, double *x, PetscInt stride, double scale)
{
  const DLMModes *m     = box->velocity;
  const PetscInt  width = m->n_rows * m->row, inner = box->levels - 1, at = row * m->row;
  double         *last  = x + inner * stride;

  SolveThomas(m->row, inner, box->pivot + at, width, x, stride, scale);
  for (PetscInt i = 0; i < m->row; i++)
    last[i] = box->border_inverse[at + i] * (scale * last[i] + x[i] + x[(inner - 1) * stride + i]);
  for (PetscInt k = 0; k < inner; k++)
    for (PetscInt i = 0; i < m->row; i++) x[k * stride + i] += box->border[k * width + at + i] * last[i];
  if (m->rows[row] == 0) { /* entry 0, 1: the plane mean; the velocity has zero mean, a mean force is taken up by the pressure */
    for (int i = 0; i < 2; i++) {
      double mean = 0.0;
      for (PetscInt k = 0; k < box->levels; k++) mean += x[k * stride + i] / box->levels;
      for (PetscInt k = 0; k < box->levels; k++) x[k * stride + i] -= mean;
    }
  }
}

/* Removes the mean force of a periodic line before it is solved: nothing viscous could balance it. */
static void RemoveMeanForce(const DLMBox *box, double *x, PetscInt stride)
{
  for (int i = 0; i < 2; i++) {
    double mean = 0.0;
    for (PetscInt k = 0; k < box->levels; k++) mean += x[k * stride + i] / box->levels;
    for (PetscInt k = 0; k < box->levels; k++) x[k * stride + i] -= mean;
  }
}

void DLMBoxSolveLines(const DLMBox *box, PetscInt row, double *x, PetscInt level_stride, PetscInt component_stride)
{
  const DLMModes *m     = box->velocity;
  const double    scale = 1.0 / (box->viscosity * box->grid->h);

  for (int c = 0; c < 3; c++) {
    double *y = x + c * component_stride;
    if (box->border) {
      if (m->rows[row] == 0) RemoveMeanForce(box, y, level_stride);
      SolveBordered(box, row, y, level_stride, scale);
    } else {
      SolveThomas(m->row, box->levels, box->pivot + row * m->row, m->n_rows * m->row, y, level_stride, scale);
    }
  }
}

PetscErrorCode DLMBoxSolveVelocity(DLMBox *box, const PetscScalar *f, PetscScalar *u)
{
  DLMModes      *m     = box->velocity;
  const PetscInt width = m->n_rows * m->row;

  PetscFunctionBeginUser;
  PetscCall(DLMModesForward(m, f));
  for (PetscInt r = 0; r < m->n_rows; r++) DLMBoxSolveLines(box, r, m->modal + r * m->row, 3 * width, width);
  PetscCall(DLMModesBackward(m, u));
  PetscFunctionReturn(0);
}

/* p <- scale S^-1 p in modal space, one dense block per pressure mode. */
static void ApplyBlocks(const DLMBox *box, double scale)
{
  const DLMModes *m = box->pressure;
  const PetscInt  n = box->p_levels, padded = box->padded, modes = m->count[m->fast] / 2 + 1, width = m->n_rows * m->row;
  double          re[padded], im[padded];

  for (PetscInt r = 0; r < m->n_rows; r++)
    for (PetscInt f = 0; f < modes; f++) {
      const double *block = box->schur + (r * modes + f) * n * 2 * padded;
      double       *p     = m->modal + r * m->row + 2 * f;
      for (PetscInt k = 0; k < padded; k++) {
        re[k] = k < n ? scale * p[k * width] : 0.0;
        im[k] = k < n ? scale * p[k * width + 1] : 0.0;
      }
      for (PetscInt i = 0; i < n; i++) {
        const double *restrict a = block + i * 2 * padded, *restrict b = a + padded;
        double                 sum_re = 0.0, sum_im = 0.0;
#pragma omp simd reduction(+ : sum_re, sum_im)
        for (PetscInt k = 0; k < padded; k++) {
          sum_re += a[k] * re[k] - b[k] * im[k];
          sum_im += a[k] * im[k] + b[k] * re[k];
        }
        p[i * width]     = sum_re;
        p[i * width + 1] = sum_im;
      }
    }
}

PetscErrorCode DLMBoxSolveSchur(DLMBox *box, const PetscScalar *b, PetscScalar *p)
{
  PetscFunctionBeginUser;
  PetscCall(DLMModesForward(box->pressure, b));
  ApplyBlocks(box, 1.0);
  PetscCall(DLMModesBackward(box->pressure, p));
  PetscFunctionReturn(0);
}

void DLMBoxTurn(DLMBox *box, PetscBool turned)
{
  box->velocity->turned = turned;
  if (box->pressure) box->pressure->turned = turned;
}

/*
  Between mirrors: sign of the pressure's sine that a velocity row aliases onto, and of the symbol of u2, in turned fields (docs/theory.md, B11). The middle row aliases onto
  itself, as sines from both sides with opposite signs.
*/
static double AliasSign(const DLMBox *box, PetscInt row)
{
  const PetscInt k = box->velocity->rows[row], middle = box->pressure->cells[box->pressure->slow];

  if (!box->velocity->turned || k < middle) return 1.0;
  return k > middle ? -1.0 : 0.0;
}

static double SymbolSign(const DLMBox *box, int component)
{
  return box->velocity->turned && component == box->velocity->slow ? -1.0 : 1.0;
}

/* Pressure rows that a velocity row aliases onto: as it is, and conjugated. */
static void AliasRows(const DLMBox *box, PetscInt row, PetscInt *direct, PetscInt *conjugate)
{
  *direct    = box->pressure->row_of[DLMModesAlias(box->pressure, box->velocity->rows[row], PETSC_FALSE)];
  *conjugate = box->pressure->row_of[DLMModesAlias(box->pressure, box->velocity->rows[row], PETSC_TRUE)];
}

/* pressure modes += B u for one velocity row. */
static void AddDivergence(const DLMBox *box, PetscInt row, const double *u, PetscInt level_stride, PetscInt component_stride)
{
  const DLMModes *p = box->pressure, *v = box->velocity;
  const PetscInt  half = v->row / 2, coarse = p->count[p->fast], modes = coarse / 2 + 1, width = p->n_rows * p->row;
  const double    weight = AliasSign(box, row) * (v->half && v->rows[row] == p->cells[p->slow] ? 0.5 : 0.25); /* the middle cosine aliases onto itself */
  double          re[half], im[half];
  PetscInt        direct, conjugate;

  AliasRows(box, row, &direct, &conjugate);
  for (PetscInt m = 0; m < box->p_levels; m++) {
    double *d = p->modal + m * width + direct * p->row, *c = p->modal + m * width + conjugate * p->row;
    for (PetscInt i = 0; i < half; i++) re[i] = im[i] = 0.0;
    for (PetscInt dz = -2; dz <= 2; dz++) {
      const PetscInt l = DLMBoxFineLevel(box, m, dz);
      if (l < 0) continue;
      for (int j = 0; j < 3; j++) {
        const double *restrict x = u + l * level_stride + j * component_stride;
        const double *restrict a = DLMBoxSymbol(box, DLMBoxPlace(box, m), dz, j, row), *restrict b = a + half;
        const double           sign = SymbolSign(box, j);
#pragma omp simd
        for (PetscInt i = 0; i < half; i++) {
          re[i] += sign * (a[i] * x[2 * i] - b[i] * x[2 * i + 1]);
          im[i] += sign * (a[i] * x[2 * i + 1] + b[i] * x[2 * i]);
        }
      }
    }
    for (PetscInt f = 0; f < modes; f++) {
      d[2 * f] += weight * re[f];
      d[2 * f + 1] += weight * im[f];
      c[2 * f] += weight * re[coarse - f];
      c[2 * f + 1] -= weight * im[coarse - f];
    }
  }
}

/* v <- B^T p for one velocity row. */
static void SetGradient(const DLMBox *box, PetscInt row, double *v, PetscInt level_stride, PetscInt component_stride)
{
  const DLMModes *p = box->pressure;
  const PetscInt  half = box->velocity->row / 2, coarse = p->count[p->fast], width = p->n_rows * p->row;
  const double    alias = AliasSign(box, row);
  double          re[half], im[half];
  PetscInt        direct, conjugate;

  AliasRows(box, row, &direct, &conjugate);
  for (PetscInt l = 0; l < box->levels; l++)
    for (int j = 0; j < 3; j++)
      for (PetscInt i = 0; i < 2 * half; i++) v[l * level_stride + j * component_stride + i] = 0.0;
  for (PetscInt m = 0; m < box->p_levels; m++) {
    const double *d = p->modal + m * width + direct * p->row, *c = p->modal + m * width + conjugate * p->row;
    for (PetscInt i = 0; i < half; i++) {
      const PetscBool plain = (PetscBool)(i <= coarse / 2), exists = (PetscBool)(i <= coarse);
      re[i] = exists ? (plain ? d[2 * i] : c[2 * (coarse - i)]) : 0.0;
      im[i] = exists ? (plain ? d[2 * i + 1] : -c[2 * (coarse - i) + 1]) : 0.0;
    }
    for (PetscInt dz = -2; dz <= 2; dz++) {
      const PetscInt l = DLMBoxFineLevel(box, m, dz);
      if (l < 0) continue;
      for (int j = 0; j < 3; j++) {
        double *restrict       x = v + l * level_stride + j * component_stride;
        const double *restrict a = DLMBoxSymbol(box, DLMBoxPlace(box, m), dz, j, row), *restrict b = a + half;
        const double           sign = alias * SymbolSign(box, j);
#pragma omp simd
        for (PetscInt i = 0; i < half; i++) {
          x[2 * i] += sign * (a[i] * re[i] + b[i] * im[i]);
          x[2 * i + 1] += sign * (a[i] * im[i] - b[i] * re[i]);
        }
      }
    }
  }
}

PetscErrorCode DLMBoxSolveStokes(DLMBox *box, const PetscScalar *f, const PetscScalar *g, PetscScalar *u, PetscScalar *p)
{
  DLMModes      *m     = box->velocity;
  const PetscInt row   = m->row, width = m->n_rows * row;
  double        *work  = box->work;

  PetscFunctionBeginUser;
  PetscCall(DLMModesForward(m, f));
  PetscCall(DLMModesForward(box->pressure, g));
  for (PetscInt r = 0; r < m->n_rows; r++) {
    DLMBoxSolveLines(box, r, m->modal + r * row, 3 * width, width);
    AddDivergence(box, r, m->modal + r * row, 3 * width, width);
  }
  ApplyBlocks(box, -1.0);
  for (PetscInt r = 0; r < m->n_rows; r++) {
    SetGradient(box, r, work, 3 * row, row);
    DLMBoxSolveLines(box, r, work, 3 * row, row);
    for (PetscInt k = 0; k < 3 * box->levels; k++) {
      double *restrict       x = m->modal + k * width + r * row;
      const double *restrict w = work + k * row;
      for (PetscInt i = 0; i < row; i++) x[i] += w[i];
    }
  }
  PetscCall(DLMModesBackward(box->pressure, p));
  PetscCall(DLMModesBackward(m, u));
  PetscFunctionReturn(0);
}
