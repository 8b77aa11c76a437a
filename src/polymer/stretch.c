#include "../../include/private/tensor.h"
#include <float.h>
#include <math.h>
#include <string.h>

enum { DEGREE = 14 }; /* of exp(G) by Taylor's series: the rest is below 1e-15 at |G| = 0.5 */
static const double fast_limit = 0.5;

/* m[k] = int_0^1 exp(-x u) (u - centre)^k du by five Gauss points on panels so short that they are exact. */
static void Moments(double x, double centre, double m[4])
{
  static const double point[5]  = { -0.90617984593866399280, -0.53846931010568309104, 0.0, 0.53846931010568309104,
                                    0.90617984593866399280 };
  static const double weight[5] = { 0.23692688505618908751, 0.47862867049936646804, 0.56888888888888888889,
                                    0.47862867049936646804, 0.23692688505618908751 };
  const int           panels    = 1 + (int)fmin(20.0 * x, 8.0 + 3.0 * x);

  memset(m, 0, 4 * sizeof(double));
  for (int i = 0; i < panels; i++)
    for (int j = 0; j < 5; j++) {
      const double u = (i + 0.5 + 0.5 * point[j]) / panels;
      double       f = exp(-x * u) * weight[j] * 0.5 / panels;
      for (int k = 0; k < 4; k++) {
        m[k] += f;
        f *= u - centre;
      }
    }
}

/* Gauss rule from the Jacobi matrix (a0 b; b a1) of the weight; beyond 45 lambda the weight is below rounding. */
void DLMRelaxationSet(double dt, double lambda, DLMRelaxation *r)
{
  const double end = fmin(dt, 45.0 * lambda), total = -expm1(-dt / lambda);
  double       m[4], a0, a1, b2, middle, half;

  Moments(end / lambda, 0.0, m);
  a0 = m[1] / m[0];
  Moments(end / lambda, a0, m);
  b2           = m[2] / m[0];
  a1           = a0 + m[3] / m[2];
  middle       = 0.5 * (a0 + a1);
  half         = sqrt(0.25 * (a1 - a0) * (a1 - a0) + b2);
  r->dt        = dt;
  r->lambda    = lambda;
  r->decay     = exp(-dt / lambda);
  r->node[0]   = end * (middle - half);
  r->node[1]   = end * (middle + half);
  r->source[0] = total * (middle + half - a0) / (2.0 * half);
  r->source[1] = total * (a0 - middle + half) / (2.0 * half);
}

/* G^2 */
DLM_INLINE void Square(const double g[9], double g2[9])
{
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) g2[3 * i + j] = g[3 * i] * g[j] + g[3 * i + 1] * g[3 + j] + g[3 * i + 2] * g[6 + j];
}

/* F F^T */
DLM_INLINE void Gram(const double f[9], double c[6])
{
  c[0] = f[0] * f[0] + f[1] * f[1] + f[2] * f[2];
  c[1] = f[3] * f[3] + f[4] * f[4] + f[5] * f[5];
  c[2] = f[6] * f[6] + f[7] * f[7] + f[8] * f[8];
  c[3] = f[0] * f[3] + f[1] * f[4] + f[2] * f[5];
  c[4] = f[0] * f[6] + f[1] * f[7] + f[2] * f[8];
  c[5] = f[3] * f[6] + f[4] * f[7] + f[5] * f[8];
}

/* F C F^T */
DLM_INLINE void Congruence(const double f[9], const double c[6], double out[6])
{
  double h[9];

  for (int i = 0; i < 3; i++) {
    h[3 * i]     = f[3 * i] * c[0] + f[3 * i + 1] * c[3] + f[3 * i + 2] * c[4];
    h[3 * i + 1] = f[3 * i] * c[3] + f[3 * i + 1] * c[1] + f[3 * i + 2] * c[5];
    h[3 * i + 2] = f[3 * i] * c[4] + f[3 * i + 1] * c[5] + f[3 * i + 2] * c[2];
  }
  out[0] = h[0] * f[0] + h[1] * f[1] + h[2] * f[2];
  out[1] = h[3] * f[3] + h[4] * f[4] + h[5] * f[5];
  out[2] = h[6] * f[6] + h[7] * f[7] + h[8] * f[8];
  out[3] = h[0] * f[3] + h[1] * f[4] + h[2] * f[5];
  out[4] = h[0] * f[6] + h[1] * f[7] + h[2] * f[8];
  out[5] = h[3] * f[6] + h[4] * f[7] + h[5] * f[8];
}

/* A node's gradient, and G^k = p G^2 + q G + r I by the invariants of the characteristic polynomial. */
typedef struct {
  double g[9], g2[9], first, second, third;
} Gradient;

DLM_INLINE Gradient ReadGradient(const double *const *g, long i)
{
  Gradient d = { .g = { g[0][i], g[1][i], g[2][i], g[3][i], g[4][i], g[5][i], g[6][i], g[7][i], g[8][i] } };

  Square(d.g, d.g2);
  d.first  = d.g[0] + d.g[4] + d.g[8];
  d.second = 0.5 * (d.first * d.first - (d.g2[0] + d.g2[4] + d.g2[8]));
  d.third  = d.g[0] * (d.g[4] * d.g[8] - d.g[5] * d.g[7]) - d.g[1] * (d.g[3] * d.g[8] - d.g[5] * d.g[6])
            + d.g[2] * (d.g[3] * d.g[7] - d.g[4] * d.g[6]);
  return d;
}

DLM_INLINE double NormSquared(const double g[9])
{
  return (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]) + (g[3] * g[3] + g[4] * g[4] + g[5] * g[5])
         + (g[6] * g[6] + g[7] * g[7] + g[8] * g[8]);
}

/* a0 I + a1 G + a2 G^2 = exp(s G), taylor[k] = s^k / k! */
DLM_INLINE void Coefficients(const Gradient *d, const double taylor[DEGREE + 1], double a[3])
{
  double p = 1.0, q = 0.0, r = 0.0;

  a[0] = taylor[0];
  a[1] = taylor[1];
  a[2] = taylor[2];
#pragma GCC unroll 16
  for (int k = 3; k <= DEGREE; k++) {
    const double old = p;
    p = d->first * old + q;
    q = r - d->second * old;
    r = d->third * old;
    a[2] += taylor[k] * p;
    a[1] += taylor[k] * q;
    a[0] += taylor[k] * r;
  }
}

DLM_INLINE void Exponential(const Gradient *d, const double taylor[DEGREE + 1], double f[9])
{
  double a[3];

  Coefficients(d, taylor, a);
  for (int k = 0; k < 9; k++) f[k] = a[1] * d->g[k] + a[2] * d->g2[k];
  f[0] += a[0];
  f[4] += a[0];
  f[8] += a[0];
}

/* A Cholesky factorisation is certain to succeed: det C / (c11 c22 c33) is far from rounding. */
DLM_INLINE int SurelyPositive(const double c[6])
{
  const double minor = c[0] * c[1] - c[3] * c[3], product = c[0] * c[1] * c[2];
  const double determinant = c[2] * minor - c[0] * c[5] * c[5] - c[1] * c[4] * c[4] + 2.0 * c[3] * c[4] * c[5];
  return (c[0] > 0.0) & (minor > 0.0) & (determinant > 2e-14 * product) & (product <= DBL_MAX);
}

/* What both passes read; taylor[.][k] = s^k / k! at s = dt and at the two nodes of the rule. */
typedef struct {
  const double *const *g;
  double *const       *c;
  const double        *weight;
  const DLMRelaxation *r;
  double               taylor[3][DEGREE + 1];
} Step;

static void Powers(double s, double taylor[DEGREE + 1])
{
  taylor[0] = 1.0;
  for (int k = 1; k <= DEGREE; k++) taylor[k] = taylor[k - 1] * s / k;
}

DLM_KERNEL static void StretchFast(const void *context, long first, int count, double out[6][DLM_TENSOR_BLOCK], double *good)
{
  const Step  *s     = context;
  const double decay = s->r->decay, limit = fast_limit * fast_limit, dt2 = s->r->dt * s->r->dt;
  const double source0 = s->r->source[0], source1 = s->r->source[1];
  double        taylor[3][DEGREE + 1], weight[DLM_TENSOR_BLOCK];
  const double *g[9], *c[6];

  memcpy(taylor, s->taylor, sizeof(taylor));
  for (int i = 0; i < count; i++) weight[i] = s->weight ? s->weight[first + i] : 1.0;
  for (int k = 0; k < 9; k++) g[k] = s->g[k] + first;
  for (int k = 0; k < 6; k++) c[k] = s->c[k] + first;
#pragma GCC ivdep
  for (int i = 0; i < count; i++) {
    const Gradient d     = ReadGradient(g, i);
    const double   now[6] = { c[0][i], c[1][i], c[2][i], c[3][i], c[4][i], c[5][i] }, w = weight[i];
    double         f[9], next[6], gram0[6], gram1[6];
    Exponential(&d, taylor[0], f);
    Congruence(f, now, next);
    Exponential(&d, taylor[1], f);
    Gram(f, gram0);
    Exponential(&d, taylor[2], f);
    Gram(f, gram1);
    for (int k = 0; k < 6; k++) next[k] = decay * next[k] + w * (source0 * gram0[k] + source1 * gram1[k]);
    out[0][i] = next[0], out[1][i] = next[1], out[2][i] = next[2];
    out[3][i] = next[3], out[4][i] = next[4], out[5][i] = next[5];
    good[i] = ((dt2 * NormSquared(d.g) <= limit) & SurelyPositive(next)) ? 1.0 : 0.0;
  }
}

/* exp(s G) - I of a small s G */
static void Series(const double g[9], double s, double e[9])
{
  double power[9], next[9];

  for (int k = 0; k < 9; k++) power[k] = e[k] = s * g[k];
  for (int m = 2; m < 9; m++) {
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++)
        next[3 * i + j] = (g[3 * i] * power[j] + g[3 * i + 1] * power[3 + j] + g[3 * i + 2] * power[6 + j]) * s / m;
    memcpy(power, next, sizeof(power));
    for (int k = 0; k < 9; k++) e[k] += power[k];
  }
}

/* I + E; out may be e. */
static void AddIdentity(const double e[9], double out[9])
{
  for (int k = 0; k < 9; k++) out[k] = e[k] + (k % 4 == 0);
}

/*
  F = exp(dt G) and K = int_0^dt exp(-s/lambda)/lambda F(s) F(s)^T ds for any dt |G|: from a t with t |G| < 1/256, where the rule
  is exact to 1e-12, by K(2t) = K(t) + exp(-t/lambda) F(t) K(t) F(t)^T and E(2t) = 2 E + E^2, E = F - I.
*/
static void Flow(const double g[9], double dt, double lambda, double f[9], double K[6])
{
  const double  size = 256.0 * dt * sqrt(NormSquared(g));
  double        t, square[9], gram[6];
  int           doublings = 0;
  DLMRelaxation r;

  if (size <= DBL_MAX) frexp(size, &doublings);
  if (doublings < 0) doublings = 0;
  t = ldexp(dt, -doublings);
  DLMRelaxationSet(t, lambda, &r);
  memset(K, 0, 6 * sizeof(double));
  for (int m = 0; m < 2; m++) {
    Series(g, r.node[m], f);
    AddIdentity(f, f);
    Gram(f, gram);
    for (int k = 0; k < 6; k++) K[k] += r.source[m] * gram[k];
  }
  Series(g, t, f);
  for (; doublings > 0; doublings--, t *= 2.0) {
    double whole[9];
    AddIdentity(f, whole);
    Congruence(whole, K, gram);
    for (int k = 0; k < 6; k++) K[k] += exp(-t / lambda) * gram[k];
    Square(f, square);
    for (int k = 0; k < 9; k++) f[k] = 2.0 * f[k] + square[k];
  }
  AddIdentity(f, f);
}

/* C <- decay F C F^T + w K, or + (1 - decay) I after the split. */
static int Redo(const Step *s, long node, int split, double out[6])
{
  const double decay = s->r->decay, w = s->weight ? s->weight[node] : 1.0;
  double       g[9], c[6], f[9], K[6];

  for (int k = 0; k < 9; k++) g[k] = s->g[k][node];
  for (int k = 0; k < 6; k++) c[k] = s->c[k][node];
  Flow(g, s->r->dt, s->r->lambda, f, K);
  Congruence(f, c, out);
  for (int k = 0; k < 6; k++) out[k] = decay * out[k] + (split ? (k < 3) * (1.0 - decay) : w * K[k]);
  DLMTensorRepair(out);
  return 1;
}

static int StretchRobust(const void *context, long node, double out[6])
{
  return Redo(context, node, 0, out);
}

void DLMTensorStretch(long n, const double *const g[9], const DLMRelaxation *r, const double *weight, double *const c[6])
{
  Step s = { .g = g, .c = c, .weight = weight, .r = r };

  Powers(r->dt, s.taylor[0]);
  Powers(r->node[0], s.taylor[1]);
  Powers(r->node[1], s.taylor[2]);
  DLMTensorSweep(n, StretchFast, StretchRobust, &s, c);
}

DLM_KERNEL static void SplitFast(const void *context, long first, int count, double out[6][DLM_TENSOR_BLOCK], double *good)
{
  const Step   *s     = context;
  const double  decay = s->r->decay, source = 1.0 - decay, limit = fast_limit * fast_limit, dt2 = s->r->dt * s->r->dt;
  double        taylor[DEGREE + 1];
  const double *g[9], *c[6];

  memcpy(taylor, s->taylor[0], sizeof(taylor));
  for (int k = 0; k < 9; k++) g[k] = s->g[k] + first;
  for (int k = 0; k < 6; k++) c[k] = s->c[k] + first;
#pragma GCC ivdep
  for (int i = 0; i < count; i++) {
    const Gradient d      = ReadGradient(g, i);
    const double   now[6] = { c[0][i], c[1][i], c[2][i], c[3][i], c[4][i], c[5][i] };
    double         f[9], next[6];
    Exponential(&d, taylor, f);
    Congruence(f, now, next);
    for (int k = 0; k < 6; k++) next[k] = decay * next[k] + (k < 3 ? source : 0.0);
    out[0][i] = next[0], out[1][i] = next[1], out[2][i] = next[2];
    out[3][i] = next[3], out[4][i] = next[4], out[5][i] = next[5];
    good[i] = ((dt2 * NormSquared(d.g) <= limit) & SurelyPositive(next)) ? 1.0 : 0.0;
  }
}

static int SplitRobust(const void *context, long node, double out[6])
{
  return Redo(context, node, 1, out);
}

void DLMTensorStretchSplit(long n, const double *const g[9], double dt, double lambda, double *const c[6])
{
  const DLMRelaxation r = { .dt = dt, .lambda = lambda, .decay = exp(-dt / lambda) };
  Step                s = { .g = g, .c = c, .r = &r };

  Powers(dt, s.taylor[0]);
  DLMTensorSweep(n, SplitFast, SplitRobust, &s, c);
}

/* C = B B^T + s I, B = M^-1 A by the cofactors of M = (1 + s/2) I - dt G. */
DLM_INLINE void FactorStep(const double g[9], const double a[6], double dt, double s, double c[6])
{
  const double one = 1.0 + 0.5 * s;
  const double m0 = one - dt * g[0], m1 = -dt * g[1], m2 = -dt * g[2], m3 = -dt * g[3], m4 = one - dt * g[4];
  const double m5 = -dt * g[5], m6 = -dt * g[6], m7 = -dt * g[7], m8 = one - dt * g[8];
  const double k[9] = { m4 * m8 - m5 * m7, m2 * m7 - m1 * m8, m1 * m5 - m2 * m4, m5 * m6 - m3 * m8, m0 * m8 - m2 * m6,
                        m2 * m3 - m0 * m5, m3 * m7 - m4 * m6, m1 * m6 - m0 * m7, m0 * m4 - m1 * m3 };
  const double scale = 1.0 / (m0 * k[0] + m1 * k[3] + m2 * k[6]);
  double       b[9];

  for (int i = 0; i < 3; i++) {
    b[3 * i]     = scale * (k[3 * i] * a[0] + k[3 * i + 1] * a[3] + k[3 * i + 2] * a[4]);
    b[3 * i + 1] = scale * (k[3 * i + 1] * a[1] + k[3 * i + 2] * a[5]);
    b[3 * i + 2] = scale * (k[3 * i + 2] * a[2]);
  }
  Gram(b, c);
  for (int i = 0; i < 3; i++) c[i] += s;
}

DLM_KERNEL void DLMTensorStretchFactor(long n, const double *const g[9], double dt, double lambda, double *const a[6],
                                       double *const c[6])
{
  const double *gradient[9], *in[6], s = dt / lambda;
  double       *out[6];

  memcpy(gradient, g, sizeof(gradient));
  memcpy(in, a, sizeof(in));
  memcpy(out, c, sizeof(out));
#pragma GCC ivdep
  for (long i = 0; i < n; i++) {
    const double node[9]   = { gradient[0][i], gradient[1][i], gradient[2][i], gradient[3][i], gradient[4][i],
                               gradient[5][i], gradient[6][i], gradient[7][i], gradient[8][i] };
    const double factor[6] = { in[0][i], in[1][i], in[2][i], in[3][i], in[4][i], in[5][i] };
    double       next[6];
    FactorStep(node, factor, dt, s, next);
    out[0][i] = next[0], out[1][i] = next[1], out[2][i] = next[2];
    out[3][i] = next[3], out[4][i] = next[4], out[5][i] = next[5];
  }
}
