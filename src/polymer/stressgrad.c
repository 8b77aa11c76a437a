#include <math.h>
#include <string.h>
#include "../../include/private/kuhn.h"
#include "../../include/private/stressgrad.h"
#include "../../include/private/tensor.h"

/*
  Row of D_j and the lumped mass at a place, averaged over the four ways to cut the cubes (mirrored in x1, x2): one cut alone prefers a diagonal,
  and quadratic stresses then turn a sphere at first order in Wi (docs/theory.md, V2).
*/
static void FillRow(double h, const int place[3], DLMKuhnRow *row)
{
  double D[3][27] = { { 0.0 } };

  row->n    = 0;
  row->mass = 0.0;
  for (int mirror = 0; mirror < 4; mirror++) {
    int at[3];
    for (int d = 0; d < 3; d++) at[d] = (mirror >> d) & 1 ? 2 - place[d] : place[d];
    row->mass += 0.25 * DLMKuhnLumpedMass(at) * h * h * h;
    for (int j = 0; j < 3; j++) {
      double       cut[27];
      const double sign = (mirror >> j) & 1 ? -1.0 : 1.0;
      DLMKuhnDerivative(j, at, cut);
      for (int o = 0; o < 27; o++) {
        const int x = mirror & 1 ? 2 - o % 3 : o % 3, y = mirror & 2 ? 2 - (o / 3) % 3 : (o / 3) % 3;
        D[j][x + 3 * y + 9 * (o / 9)] += 0.25 * h * h * sign * cut[o];
      }
    }
  }
  for (int o = 0; o < 27; o++) {
    if (fabs(D[0][o]) + fabs(D[1][o]) + fabs(D[2][o]) < 1e-14 * h * h) continue;
    row->offset[row->n][0] = o % 3 - 1;
    row->offset[row->n][1] = (o / 3) % 3 - 1;
    row->offset[row->n][2] = o / 9 - 1;
    for (int j = 0; j < 3; j++) row->d[row->n][j] = D[j][o];
    row->n++;
  }
}

void DLMKuhnRowsFill(double h, DLMKuhnRow rows[27])
{
  for (int c = 0; c < 27; c++) FillRow(h, (int[3]){ c % 3, (c / 3) % 3, c / 9 }, &rows[c]);
}

static inline long Shift(const DLMKuhnRow *row, int e, const long stride[3])
{
  return row->offset[e][0] * stride[0] + row->offset[e][1] * stride[1] + row->offset[e][2] * stride[2];
}

enum { TERMS = 4 }; /* of a row that are summed at once: the sums stay in registers, which takes 0.4 of the time of one term after the other */

/* A row's terms from e on at a line of v: their values and weights; weight 0 where the row has no more. */
static inline void TakeTerms(const DLMKuhnRow *row, int e, const long stride[3], const double *v, const double *value[TERMS], double d[3][TERMS])
{
  for (int q = 0; q < TERMS; q++) {
    const int at = e + q < row->n ? e + q : e;
    value[q]     = v + Shift(row, at, stride);
    for (int j = 0; j < 3; j++) d[j][q] = e + q < row->n ? row->d[at][j] / row->mass : 0.0;
  }
}

DLM_KERNEL void DLMGradientLine(const DLMKuhnRow *row, const long stride[3], long n, const double *const u[3], double *const g[9])
{
  for (int k = 0; k < 9; k++) memset(g[k], 0, (size_t)n * sizeof(double));
  for (int i = 0; i < 3; i++) {
    double *restrict g0 = g[3 * i], *restrict g1 = g[3 * i + 1], *restrict g2 = g[3 * i + 2];
    for (int e = 0; e < row->n; e += TERMS) {
      const double *v[TERMS];
      double        d[3][TERMS];
      TakeTerms(row, e, stride, u[i], v, d);
      const double *restrict v0 = v[0], *restrict v1 = v[1], *restrict v2 = v[2], *restrict v3 = v[3];
#pragma omp simd
      for (long x = 0; x < n; x++) {
        g0[x] += d[0][0] * v0[x] + d[0][1] * v1[x] + d[0][2] * v2[x] + d[0][3] * v3[x];
        g1[x] += d[1][0] * v0[x] + d[1][1] * v1[x] + d[1][2] * v2[x] + d[1][3] * v3[x];
        g2[x] += d[2][0] * v0[x] + d[2][1] * v1[x] + d[2][2] * v2[x] + d[2][3] * v3[x];
      }
    }
  }
}

DLM_KERNEL void DLMForceLine(const DLMKuhnRow *row, const long stride[3], long n, const double *const T[6], double *const f[3])
{
  double *restrict f0 = f[0], *restrict f1 = f[1], *restrict f2 = f[2];

  for (int i = 0; i < 3; i++) memset(f[i], 0, (size_t)n * sizeof(double));
  for (int e = 0; e < row->n; e++) {
    const long             at = Shift(row, e, stride);
    const double *restrict t0 = T[0] + at, *restrict t1 = T[1] + at, *restrict t2 = T[2] + at;
    const double *restrict t3 = T[3] + at, *restrict t4 = T[4] + at, *restrict t5 = T[5] + at;
    const double d0 = row->d[e][0], d1 = row->d[e][1], d2 = row->d[e][2];
#pragma omp simd
    for (long x = 0; x < n; x++) {
      f0[x] += d0 * t0[x] + d1 * t3[x] + d2 * t4[x];
      f1[x] += d0 * t3[x] + d1 * t1[x] + d2 * t5[x];
      f2[x] += d0 * t4[x] + d1 * t5[x] + d2 * t2[x];
    }
  }
}

enum { CHUNK = 64 }; /* cells of a line that are worked on at once */

/*
  A chunk of a line of cells. Corners are numbered by their bits, mirrored so that every cut of the cube looks like the one around the diagonal 0-7; its
  tetrahedra are the paths 0, e_i, e_i + e_j, 7, numbered by the permutation (i, j, k).
*/
typedef struct {
  double w[6][3][CHUNK]; /* mean velocity of a tetrahedron along the edges of its path, over h */
} Speeds;

#define PATHS(DO) DO(0, 0, 1, 2) DO(1, 0, 2, 1) DO(2, 1, 0, 2) DO(3, 1, 2, 0) DO(4, 2, 0, 1) DO(5, 2, 1, 0)

DLM_KERNEL static void SetSpeeds(long n, const double *const u[3][8], const double scale[3], Speeds *speeds)
{
#define EDGE(t, e, axis, b, c)                                                                                   \
  {                                                                                                              \
    const double *restrict u0 = u[axis][0], *restrict u1 = u[axis][b], *restrict u2 = u[axis][c], *restrict u7 = u[axis][7]; \
    double *restrict       w = speeds->w[t][e];                                                                  \
    for (long x = 0; x < n; x++) w[x] = scale[axis] * (u0[x] + u1[x] + u2[x] + u7[x]);                           \
  }
#define PATH(t, i, j, k) EDGE(t, 0, i, 1 << i, (1 << i) | (1 << j)) EDGE(t, 1, j, 1 << i, (1 << i) | (1 << j)) EDGE(t, 2, k, 1 << i, (1 << i) | (1 << j))
  PATHS(PATH)
#undef PATH
#undef EDGE
}

/* Residual of one field on a chunk: r of the even corners is added to, that of the odd ones, which overlap it, goes to odd. */
DLM_KERNEL static void AddChunk(long n, const double *const phi[8], const Speeds *speeds, double first, double second, double *const r[8], double odd[4][CHUNK])
{
  const double *restrict p0 = phi[0], *restrict p1 = phi[1], *restrict p2 = phi[2], *restrict p3 = phi[3], *restrict p4 = phi[4], *restrict p5 = phi[5],
                         *restrict p6 = phi[6], *restrict p7 = phi[7];
  double *restrict r0 = r[0], *restrict r2 = r[2], *restrict r4 = r[4], *restrict r6 = r[6];

#pragma omp simd
  for (long x = 0; x < n; x++) {
    const double v[8] = { p0[x], p1[x], p2[x], p3[x], p4[x], p5[x], p6[x], p7[x] };
    double       y[8] = { 0.0 };
#define PATH(t, i, j, k)                                                                        \
  {                                                                                             \
    const int    b = 1 << i, c = (1 << i) | (1 << j);                                           \
    const double w0 = speeds->w[t][0][x], w1 = speeds->w[t][1][x], w2 = speeds->w[t][2][x];     \
    const double q  = w0 * (v[b] - v[0]) + w1 * (v[c] - v[b]) + w2 * (v[7] - v[c]), s = second * q; \
    y[0] += first * q - s * w0;                                                                 \
    y[b] += first * q + s * (w0 - w1);                                                          \
    y[c] += first * q + s * (w1 - w2);                                                          \
    y[7] += first * q + s * w2;                                                                 \
  }
    PATHS(PATH)
#undef PATH
    r0[x] += y[0];
    r2[x] += y[2];
    r4[x] += y[4];
    r6[x] += y[6];
    odd[0][x] = y[1];
    odd[1][x] = y[3];
    odd[2][x] = y[5];
    odd[3][x] = y[7];
  }
}

DLM_KERNEL static void AddOdd(long n, double odd[4][CHUNK], double *const r[8])
{
  for (int c = 0; c < 4; c++) {
    double *restrict       y = r[2 * c + 1];
    const double *restrict o = odd[c];
    for (long x = 0; x < n; x++) y[x] += o[x];
  }
}

void DLMAdvectCells(const long cells[3], const long stride[3], double h, double first, double second, int mirror, const double *const u[3], const double *const phi[6],
                    double *const r[6])
{
  const double volume = h * h * h / 6.0;
  double       scale[3], odd[4][CHUNK];
  long         corner[8];
  Speeds       speeds;

  for (int d = 0; d < 3; d++) scale[d] = ((mirror >> d) & 1 ? -0.25 : 0.25) / h;
  for (int c = 0; c < 8; c++) {
    const int at = c ^ mirror;
    corner[c]    = (at & 1) * stride[0] + ((at >> 1) & 1) * stride[1] + ((at >> 2) & 1) * stride[2];
  }
  for (long k = 0; k < cells[2]; k++)
    for (long j = 0; j < cells[1]; j++)
      for (long i = 0; i < cells[0]; i += CHUNK) {
        const long    n = cells[0] - i < CHUNK ? cells[0] - i : CHUNK, base = i * stride[0] + j * stride[1] + k * stride[2];
        const double *at[3][8], *value[8];
        double       *sum[8];
        for (int d = 0; d < 3; d++)
          for (int c = 0; c < 8; c++) at[d][c] = u[d] + base + corner[c];
        SetSpeeds(n, (const double *const(*)[8])at, scale, &speeds);
        for (int m = 0; m < 6; m++) {
          for (int c = 0; c < 8; c++) {
            value[c] = phi[m] + base + corner[c];
            sum[c]   = r[m] + base + corner[c];
          }
          AddChunk(n, value, &speeds, -0.25 * first * volume, -second * volume, sum, odd);
          AddOdd(n, odd, sum);
        }
      }
}
