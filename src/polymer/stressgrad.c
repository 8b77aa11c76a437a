#include <math.h>
#include <string.h>
#include "../../include/private/kuhn.h"
#include "../../include/private/stressgrad.h"
#include "../../include/private/tensor.h"

/*
  Row of D_j and the lumped mass at a place, averaged over the four ways to cut the cubes (mirrored in x1, x2): one cut alone prefers a diagonal,
  and quadratic stresses then turn a sphere at first order in Wi (docs/theory.md, P2).
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

DLM_KERNEL void DLMGradientLine(const DLMKuhnRow *row, const long stride[3], long n, const double *const u[3], double *const g[9])
{
  const double scale = 1.0 / row->mass;

  for (int k = 0; k < 9; k++) memset(g[k], 0, (size_t)n * sizeof(double));
  for (int i = 0; i < 3; i++) {
    double *restrict g0 = g[3 * i], *restrict g1 = g[3 * i + 1], *restrict g2 = g[3 * i + 2];
    for (int e = 0; e < row->n; e++) {
      const double *restrict v = u[i] + Shift(row, e, stride);
      const double d0 = scale * row->d[e][0], d1 = scale * row->d[e][1], d2 = scale * row->d[e][2];
      for (long x = 0; x < n; x++) {
        g0[x] += d0 * v[x];
        g1[x] += d1 * v[x];
        g2[x] += d2 * v[x];
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
    for (long x = 0; x < n; x++) {
      f0[x] += d0 * t0[x] + d1 * t3[x] + d2 * t4[x];
      f1[x] += d0 * t3[x] + d1 * t1[x] + d2 * t5[x];
      f2[x] += d0 * t4[x] + d1 * t5[x] + d2 * t2[x];
    }
  }
}

/* Mean velocity along the path edges, over h, and how strongly each corner takes part in the residual. */
DLM_KERNEL static void Weights(long n, const long corner[4], const int axis[3], int mirror, double h, double first, double second, const double *const u[3], double *w[3], double *gain[4])
{
  const double volume = h * h * h / 6.0;

  for (int k = 0; k < 3; k++) {
    const double *restrict v = u[axis[k]];
    double *restrict       y = w[k];
    const double           scale = ((mirror >> axis[k]) & 1 ? -0.25 : 0.25) / h;
    for (long x = 0; x < n; x++) y[x] = scale * (v[x + corner[0]] + v[x + corner[1]] + v[x + corner[2]] + v[x + corner[3]]);
  }
  for (int k = 0; k < 4; k++) {
    const double *restrict in = k > 0 ? w[k - 1] : NULL, *restrict out = k < 3 ? w[k] : NULL;
    double *restrict       y = gain[k];
    for (long x = 0; x < n; x++) y[x] = -volume * (0.25 * first + second * ((in ? in[x] : 0.0) - (out ? out[x] : 0.0)));
  }
}

/* q <- u.grad phi on one tetrahedron of every cell of a line, then its share in the four corners. */
DLM_KERNEL static void AddTetrahedra(long n, const long corner[4], double *const w[3], double *const gain[4], const double *phi, double *restrict q, double *r)
{
  const double *restrict a = phi + corner[0], *restrict b = phi + corner[1], *restrict c = phi + corner[2], *restrict d = phi + corner[3];
  const double *restrict w0 = w[0], *restrict w1 = w[1], *restrict w2 = w[2];

  for (long x = 0; x < n; x++) q[x] = w0[x] * (b[x] - a[x]) + w1[x] * (c[x] - b[x]) + w2[x] * (d[x] - c[x]);
  for (int k = 0; k < 4; k++) {
    const double *restrict y = gain[k];
    double *restrict       z = r + corner[k];
    for (long x = 0; x < n; x++) z[x] += y[x] * q[x];
  }
}

void DLMAdvectCells(const long cells[3], const long stride[3], double h, double first, double second, const double *const u[3], const double *const phi[6],
                    double *const r[6], double *work, int mirror)
{
  const long  n = cells[0];
  double     *w[3] = { work, work + n, work + 2 * n }, *gain[4] = { work + 3 * n, work + 4 * n, work + 5 * n, work + 6 * n }, *q = work + 7 * n;
  DLMKuhnCube cube;

  DLMKuhnCubeFill(&cube);
  for (long k = 0; k < cells[2]; k++)
    for (long j = 0; j < cells[1]; j++)
      for (int t = 0; t < 6; t++) {
        const long line = j * stride[1] + k * stride[2];
        long       corner[4];
        for (int v = 0; v < 4; v++) {
          corner[v] = line;
          for (int d = 0; d < 3; d++) corner[v] += (((mirror >> d) & 1) ^ cube.vertex[t][v][d]) * stride[d];
        }
        Weights(n, corner, cube.axis[t], mirror, h, first, second, u, w, gain);
        for (int c = 0; c < 6; c++) AddTetrahedra(n, corner, w, gain, phi[c], q, r[c]);
      }
}
