#include "../../include/private/tensor.h"
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

long DLMTensorSweep(long n, DLMTensorFast fast, DLMTensorRobust robust, const void *context, double *const c[6])
{
  double out[6][DLM_TENSOR_BLOCK], good[DLM_TENSOR_BLOCK], single[6];
  long   bad = -1;

  for (long first = 0; first < n; first += DLM_TENSOR_BLOCK) {
    const int count = n - first < DLM_TENSOR_BLOCK ? (int)(n - first) : DLM_TENSOR_BLOCK;
    fast(context, first, count, out, good);
    for (int i = 0; i < count; i++) {
      if (good[i] != 0.0) continue;
      if (!robust(context, first + i, single) && bad < 0) bad = first + i;
      for (int k = 0; k < 6; k++) out[k][i] = single[k];
    }
    for (int k = 0; k < 6; k++) memcpy(c[k] + first, out[k], count * sizeof(double));
  }
  return bad;
}

DLM_KERNEL long DLMTensorCholesky(long n, double *const c[6], double *const a[6])
{
  const double *c11 = c[0], *c22 = c[1], *c33 = c[2], *c12 = c[3], *c13 = c[4], *c23 = c[5];
  double       *a11 = a[0], *a22 = a[1], *a33 = a[2], *a21 = a[3], *a31 = a[4], *a32 = a[5];
  long          good = 0, i;

#pragma GCC ivdep
  for (i = 0; i < n; i++) {
    const double l11 = sqrt(c11[i]), r1 = 1.0 / l11, l21 = c12[i] * r1, l31 = c13[i] * r1;
    const double l22 = sqrt(c22[i] - l21 * l21), l32 = (c23[i] - l31 * l21) / l22;
    const double l33 = sqrt(c33[i] - l31 * l31 - l32 * l32);
    a11[i] = l11, a22[i] = l22, a33[i] = l33, a21[i] = l21, a31[i] = l31, a32[i] = l32;
    good += (l11 > 0.0) & (l22 > 0.0) & (l33 > 0.0) & (l11 + l22 + l33 <= DBL_MAX);
  }
  if (good == n) return -1;
  for (i = 0; a11[i] > 0.0 && a22[i] > 0.0 && a33[i] > 0.0 && a11[i] + a22[i] + a33[i] <= DBL_MAX;) i++;
  return i;
}

DLM_KERNEL void DLMTensorSquare(long n, double *const a[6], double *const c[6])
{
  const double *a11 = a[0], *a22 = a[1], *a33 = a[2], *a21 = a[3], *a31 = a[4], *a32 = a[5];
  double       *c11 = c[0], *c22 = c[1], *c33 = c[2], *c12 = c[3], *c13 = c[4], *c23 = c[5];

#pragma GCC ivdep
  for (long i = 0; i < n; i++) {
    const double l11 = a11[i], l22 = a22[i], l33 = a33[i], l21 = a21[i], l31 = a31[i], l32 = a32[i];
    c11[i] = l11 * l11;
    c22[i] = l21 * l21 + l22 * l22;
    c33[i] = l31 * l31 + l32 * l32 + l33 * l33;
    c12[i] = l11 * l21;
    c13[i] = l11 * l31;
    c23[i] = l21 * l31 + l22 * l32;
  }
}

/* A symmetric matrix on its way to diag(d), o = (12, 13, 23), and the eigenvectors v[k] gathered so far. */
typedef struct {
  double d[3], o[3], v[3][3];
} Jacobi;

/* Rotation in the plane p, q that annuls the entry apq; apr, aqr couple it to the third axis. */
DLM_INLINE void Rotate(double *app, double *aqq, double *apq, double *apr, double *aqr, double vp[3], double vq[3])
{
  const double d = *aqq - *app, h = 2.0 * *apq, u = fabs(d) + sqrt(d * d + h * h) + DBL_MIN;
  const double t = (d >= 0.0 ? h : -h) / u, c = 1.0 / sqrt(1.0 + t * t), s = t * c;
  const double change = t * *apq, pr = *apr, qr = *aqr;

  *app -= change, *aqq += change, *apq = 0.0;
  *apr = c * pr - s * qr;
  *aqr = s * pr + c * qr;
  for (int k = 0; k < 3; k++) {
    const double x = vp[k], y = vq[k];
    vp[k] = c * x - s * y;
    vq[k] = s * x + c * y;
  }
}

DLM_INLINE void SweepJacobi(Jacobi *j)
{
  Rotate(&j->d[0], &j->d[1], &j->o[0], &j->o[1], &j->o[2], j->v[0], j->v[1]);
  Rotate(&j->d[0], &j->d[2], &j->o[1], &j->o[0], &j->o[2], j->v[0], j->v[2]);
  Rotate(&j->d[1], &j->d[2], &j->o[2], &j->o[0], &j->o[1], j->v[1], j->v[2]);
}

DLM_INLINE Jacobi StartJacobi(const double c[6])
{
  return (Jacobi){ { c[0], c[1], c[2] }, { c[3], c[4], c[5] }, { { 1.0, 0.0, 0.0 }, { 0.0, 1.0, 0.0 }, { 0.0, 0.0, 1.0 } } };
}

/* What is left changes no eigenvalue by more than eps of itself. */
DLM_INLINE int Converged(const Jacobi *j)
{
  const double small = 0.25 * DBL_EPSILON * DBL_EPSILON;
  return (j->o[0] * j->o[0] <= small * fabs(j->d[0] * j->d[1])) & (j->o[1] * j->o[1] <= small * fabs(j->d[0] * j->d[2]))
         & (j->o[2] * j->o[2] <= small * fabs(j->d[1] * j->d[2]));
}

/* sum_k value[k] v[k] v[k]^T */
DLM_INLINE void Assemble(const double value[3], double v[3][3], double c[6])
{
  for (int k = 0; k < 3; k++) c[k] = value[0] * v[0][k] * v[0][k] + value[1] * v[1][k] * v[1][k] + value[2] * v[2][k] * v[2][k];
  c[3] = value[0] * v[0][0] * v[0][1] + value[1] * v[1][0] * v[1][1] + value[2] * v[2][0] * v[2][1];
  c[4] = value[0] * v[0][0] * v[0][2] + value[1] * v[1][0] * v[1][2] + value[2] * v[2][0] * v[2][2];
  c[5] = value[0] * v[0][1] * v[0][2] + value[1] * v[1][1] * v[1][2] + value[2] * v[2][1] * v[2][2];
}

void DLMTensorEigen(const double c[6], double value[3], double vector[3][3])
{
  double size = 0.0, sum = 0.0, scaled[6];
  int    exponent, order[3] = { 0, 1, 2 };
  Jacobi j;

  for (int k = 0; k < 6; k++) {
    size = fmax(size, fabs(c[k]));
    sum += 0.0 * c[k];
  }
  frexp(size, &exponent);
  for (int k = 0; k < 6; k++) scaled[k] = sum == 0.0 ? ldexp(c[k], -exponent) : NAN;
  j = StartJacobi(scaled);
  for (int sweep = 0; sweep < 12 && !Converged(&j); sweep++) SweepJacobi(&j);
  for (int i = 0; i < 2; i++)
    for (int k = 0; k < 2 - i; k++)
      if (j.d[order[k]] > j.d[order[k + 1]]) {
        const int swap = order[k];
        order[k]       = order[k + 1];
        order[k + 1]   = swap;
      }
  for (int k = 0; k < 3; k++) {
    value[k] = ldexp(j.d[order[k]], exponent);
    memcpy(vector[k], j.v[order[k]], sizeof(vector[k]));
  }
}

/* log x of a normal x > 0: x = 2^k m, 1/sqrt 2 < m < sqrt 2, log m = 2 atanh((m - 1)/(m + 1)). */
DLM_INLINE double Log(double x)
{
  const uint64_t half = UINT64_C(0x3fe6a09e667f3bcd), magic = UINT64_C(0x4330000000000000);
  uint64_t       bits, power, mantissa;
  double         k, m;

  memcpy(&bits, &x, sizeof(x));
  bits -= half;
  power    = ((bits + (UINT64_C(1023) << 52)) >> 52) | magic;
  mantissa = (bits & UINT64_C(0x000fffffffffffff)) + half;
  memcpy(&k, &power, sizeof(x));
  memcpy(&m, &mantissa, sizeof(x));
  k -= 4503599627370496.0 + 1023.0;
  const double z = (m - 1.0) / (m + 1.0), y = z * z, y2 = y * y, y4 = y2 * y2;
  const double low = (1.0 / 3.0 + y * (1.0 / 5.0)) + y2 * (1.0 / 7.0 + y * (1.0 / 9.0));
  const double high = (1.0 / 11.0 + y * (1.0 / 13.0)) + y2 * (1.0 / 15.0 + y * (1.0 / 17.0)) + y4 * (1.0 / 19.0 + y * (1.0 / 21.0));
  return k * 0.693147180369123816490 + (k * 1.90821492927058770002e-10 + (2.0 * z + 2.0 * z * y * (low + y4 * high)));
}

/* A block of nodes in the loop over rotations: d, o, v of Jacobi in planar arrays. */
typedef struct {
  double d[3][DLM_TENSOR_BLOCK], o[3][DLM_TENSOR_BLOCK], v[3][3][DLM_TENSOR_BLOCK];
} JacobiBlock;

/* The rotation in the plane p, q at every node: one rotation per loop keeps the divisions of many nodes in flight. */
DLM_INLINE void RotateBlock(JacobiBlock *b, int count, int p, int q)
{
  double *app = b->d[p], *aqq = b->d[q], *apq = b->o[p + q - 1], *apr = b->o[2 - q], *aqr = b->o[2 - p];
  double(*vp)[DLM_TENSOR_BLOCK] = b->v[p], (*vq)[DLM_TENSOR_BLOCK] = b->v[q];

#pragma GCC ivdep
  for (int i = 0; i < count; i++) {
    double x[3] = { vp[0][i], vp[1][i], vp[2][i] }, y[3] = { vq[0][i], vq[1][i], vq[2][i] };
    Rotate(&app[i], &aqq[i], &apq[i], &apr[i], &aqr[i], x, y);
    vp[0][i] = x[0], vp[1][i] = x[1], vp[2][i] = x[2];
    vq[0][i] = y[0], vq[1][i] = y[1], vq[2][i] = y[2];
  }
}

/* Four sweeps of Jacobi's method less one rotation settle all but a few nodes in a thousand. */
DLM_KERNEL static void LogFast(const void *context, long first, int count, double out[6][DLM_TENSOR_BLOCK], double *good)
{
  double *const *c = context;
  JacobiBlock    b;

  for (int k = 0; k < 3; k++) {
    memcpy(b.d[k], c[k] + first, count * sizeof(double));
    memcpy(b.o[k], c[k + 3] + first, count * sizeof(double));
    for (int m = 0; m < 3; m++)
      for (int i = 0; i < count; i++) b.v[k][m][i] = k == m;
  }
  for (int sweep = 0; sweep < 4; sweep++) {
    RotateBlock(&b, count, 0, 1);
    RotateBlock(&b, count, 0, 2);
    if (sweep < 3) RotateBlock(&b, count, 1, 2);
  }
#pragma GCC ivdep
  for (int i = 0; i < count; i++) {
    Jacobi j = { { b.d[0][i], b.d[1][i], b.d[2][i] },
                 { b.o[0][i], b.o[1][i], b.o[2][i] },
                 { { b.v[0][0][i], b.v[0][1][i], b.v[0][2][i] },
                   { b.v[1][0][i], b.v[1][1][i], b.v[1][2][i] },
                   { b.v[2][0][i], b.v[2][1][i], b.v[2][2][i] } } };
    const double value[3] = { Log(j.d[0]), Log(j.d[1]), Log(j.d[2]) };
    double       psi[6];
    Assemble(value, j.v, psi);
    for (int k = 0; k < 6; k++) out[k][i] = psi[k];
    const int usual = (j.d[0] > 1e-100) & (j.d[1] > 1e-100) & (j.d[2] > 1e-100) & (j.d[0] + j.d[1] + j.d[2] < 1e100);
    good[i]         = (usual & Converged(&j)) ? 1.0 : 0.0;
  }
}

DLM_INLINE void ReadNode(const void *context, long node, double c[6])
{
  double *const *field = context;
  for (int k = 0; k < 6; k++) c[k] = field[k][node];
}

static int LogRobust(const void *context, long node, double psi[6])
{
  double c[6], value[3], vector[3][3];

  ReadNode(context, node, c);
  DLMTensorEigen(c, value, vector);
  const int positive = value[0] > 0.0 && value[2] <= DBL_MAX;
  for (int k = 0; k < 3; k++) value[k] = positive ? log(value[k]) : NAN;
  Assemble(value, vector, psi);
  return positive;
}

long DLMTensorLog(long n, double *const c[6], double *const psi[6])
{
  return DLMTensorSweep(n, LogFast, LogRobust, c, psi);
}

/* exp x, |x| < 700: x = k log 2 + r, |r| < 0.35 */
DLM_INLINE double Exp(double x)
{
  const double shift = 6755399441055744.0, shifted = x * 1.44269504088896340736 + shift, k = shifted - shift;
  const double r = (x - k * 0.693147180369123816490) - k * 1.90821492927058770002e-10;
  uint64_t     bits;
  double       power, sum = 1.0;

  memcpy(&bits, &shifted, sizeof(x));
  bits = (bits << 52) + (UINT64_C(1023) << 52);
  memcpy(&power, &bits, sizeof(x));
#pragma GCC unroll 16
  for (int k = 13; k > 1; k--) sum = 1.0 + r * sum * (1.0 / k);
  return power + power * r * sum;
}

/* E <- (I + E)^2 - I */
DLM_INLINE void Double(double e[6])
{
  const double e11 = e[0], e22 = e[1], e33 = e[2], e12 = e[3], e13 = e[4], e23 = e[5];

  e[0] = 2.0 * e11 + (e11 * e11 + e12 * e12 + e13 * e13);
  e[1] = 2.0 * e22 + (e12 * e12 + e22 * e22 + e23 * e23);
  e[2] = 2.0 * e33 + (e13 * e13 + e23 * e23 + e33 * e33);
  e[3] = 2.0 * e12 + (e11 * e12 + e12 * e22 + e13 * e23);
  e[4] = 2.0 * e13 + (e11 * e13 + e12 * e23 + e13 * e33);
  e[5] = 2.0 * e23 + (e12 * e13 + e22 * e23 + e23 * e33);
}

/*
  exp(D) - I of a trace-free D, |D| < 16: Taylor's series at X = D/32, then five doublings. With X^3 = J X + K I every power is
  X^k = p X^2 + q X + r I.
*/
DLM_INLINE void ExpMinusOne(const double d[6], double e[6])
{
  const double s = 0.03125, x11 = s * d[0], x22 = s * d[1], x33 = s * d[2], x12 = s * d[3], x13 = s * d[4], x23 = s * d[5];
  const double minor = x22 * x33 - x23 * x23, J = x12 * x12 + x13 * x13 + x23 * x23 - (x11 * x22 + x11 * x33 + x22 * x33);
  const double K = x11 * minor - x12 * (x12 * x33 - x13 * x23) + x13 * (x12 * x23 - x13 * x22);
  double       p = 1.0, q = 0.0, r = 0.0, a0 = 0.0, a1 = 1.0, a2 = 0.5, f = 0.5;

#pragma GCC unroll 16
  for (int k = 3; k < 16; k++) {
    const double old = p;
    p = q, q = J * old + r, r = K * old;
    f /= k;
    a2 += f * p;
    a1 += f * q;
    a0 += f * r;
  }
  e[0] = a0 + a1 * x11 + a2 * (x11 * x11 + x12 * x12 + x13 * x13);
  e[1] = a0 + a1 * x22 + a2 * (x12 * x12 + x22 * x22 + x23 * x23);
  e[2] = a0 + a1 * x33 + a2 * (x13 * x13 + x23 * x23 + x33 * x33);
  e[3] = a1 * x12 + a2 * (x11 * x12 + x12 * x22 + x13 * x23);
  e[4] = a1 * x13 + a2 * (x11 * x13 + x12 * x23 + x13 * x33);
  e[5] = a1 * x23 + a2 * (x12 * x13 + x22 * x23 + x23 * x33);
  for (int k = 0; k < 5; k++) Double(e);
}

/* exp psi = e^m (I + E), m = tr psi / 3 */
DLM_KERNEL static void ExpFast(const void *context, long first, int count, double out[6][DLM_TENSOR_BLOCK], double *good)
{
  double *const *psi = context;
  const double  *in[6] = { psi[0] + first, psi[1] + first, psi[2] + first, psi[3] + first, psi[4] + first, psi[5] + first };

#pragma GCC ivdep
  for (int i = 0; i < count; i++) {
    const double mean = (in[0][i] + in[1][i] + in[2][i]) / 3.0, size = Exp(mean);
    const double d[6] = { in[0][i] - mean, in[1][i] - mean, in[2][i] - mean, in[3][i], in[4][i], in[5][i] };
    const double norm = d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + 2.0 * (d[3] * d[3] + d[4] * d[4] + d[5] * d[5]);
    double       e[6];
    ExpMinusOne(d, e);
    out[0][i] = size + size * e[0], out[1][i] = size + size * e[1], out[2][i] = size + size * e[2];
    out[3][i] = size * e[3], out[4][i] = size * e[4], out[5][i] = size * e[5];
    good[i] = ((norm < 256.0) & (fabs(mean) < 690.0)) ? 1.0 : 0.0;
  }
}

static int ExpRobust(const void *context, long node, double c[6])
{
  double psi[6], value[3], vector[3][3];

  ReadNode(context, node, psi);
  DLMTensorEigen(psi, value, vector);
  for (int k = 0; k < 3; k++) value[k] = exp(value[k]);
  Assemble(value, vector, c);
  DLMTensorRepair(c);
  return 1;
}

void DLMTensorExp(long n, double *const psi[6], double *const c[6])
{
  DLMTensorSweep(n, ExpFast, ExpRobust, psi, c);
}

/* Cholesky's pivots stay positive when 16 eps of the diagonal are taken away: more than its rounding (12 eps). */
static int Factors(const double c[6])
{
  const double less = 1.0 - 16.0 * DBL_EPSILON, d1 = less * c[0], l21 = c[3] / d1, d2 = less * c[1] - l21 * c[3];
  const double e = c[5] - l21 * c[4], d3 = less * c[2] - c[4] * (c[4] / d1) - e * (e / d2);

  return d1 > 0.0 && d2 > 0.0 && d3 > 0.0;
}

void DLMTensorRepair(double c[6])
{
  double value[3], vector[3][3];

  for (double least = 4.0 * DBL_EPSILON; least < 1e-12 && !Factors(c); least *= 4.0) {
    DLMTensorEigen(c, value, vector);
    if (!(value[2] <= DBL_MAX)) return;
    for (int k = 0; k < 3; k++) value[k] = fmax(value[k], least * value[2]);
    Assemble(value, vector, c);
  }
}

/* safe[i] = 1 where C is finite and its eigenvalues exceed the bound less 8 eps tr C: pivots of the difference. */
DLM_KERNEL static void Screen(int count, const double *const in[6], double bound, double *safe, double *trace)
{
#pragma GCC ivdep
  for (int i = 0; i < count; i++) {
    const double t = in[0][i] + in[1][i] + in[2][i], shift = bound - 8.0 * DBL_EPSILON * t;
    const double d1 = in[0][i] - shift, c12 = in[3][i], c13 = in[4][i], r1 = 1.0 / d1, l21 = c12 * r1;
    const double d2 = in[1][i] - shift - l21 * c12, e = in[5][i] - l21 * c13;
    const double d3 = in[2][i] - shift - c13 * (c13 * r1) - e * (e / d2);
    trace[i] = t;
    safe[i]  = ((d1 > 0.0) & (d2 > 0.0) & (d3 > 0.0) & (t <= DBL_MAX)) ? 1.0 : 0.0;
  }
}

/* Takes the eigenvalue of a node into the minimum; 0 if it is not finite. */
static int Lower(double *const c[6], long node, double *smallest, long *where)
{
  double single[6], value[3], vector[3][3];

  ReadNode(c, node, single);
  DLMTensorEigen(single, value, vector);
  if (value[0] >= *smallest) return 1;
  *smallest = value[0];
  *where    = node;
  return value[0] == value[0];
}

void DLMTensorRange(long n, double *const c[6], double *smallest, long *where, double *largest_trace)
{
  double    safe[DLM_TENSOR_BLOCK], trace[DLM_TENSOR_BLOCK];
  const int samples = n < 64 ? (int)n : 64;

  *smallest      = INFINITY;
  *where         = -1;
  *largest_trace = -INFINITY;
  for (int k = 0; k < samples; k++) (void)Lower(c, n / samples * k, smallest, where);
  for (long first = 0; first < n; first += DLM_TENSOR_BLOCK) {
    const int           count = n - first < DLM_TENSOR_BLOCK ? (int)(n - first) : DLM_TENSOR_BLOCK;
    const double *const in[6] = { c[0] + first, c[1] + first, c[2] + first, c[3] + first, c[4] + first, c[5] + first };
    Screen(count, in, *smallest, safe, trace);
    for (int i = 0; i < count; i++) {
      if (safe[i] == 0.0 && !Lower(c, first + i, smallest, where)) {
        *largest_trace = NAN;
        return;
      }
      if (trace[i] > *largest_trace) *largest_trace = trace[i];
    }
  }
}
