/*
  The kernels that stretch and relax a conformation tensor against closed forms and a Taylor integrator in long double. Errors are
  relative to the largest component of C; eps = 2.2e-16. Random numbers are the same in every run.
*/
#include <float.h>
#include "dlmtest.h"
#include "private/tensor.h"

enum { N = 403 };
typedef long double Real;

static double              store[15][N], half[6][N];
static double *const       c[6]     = { store[0], store[1], store[2], store[3], store[4], store[5] };
static double *const       twice[6] = { half[0], half[1], half[2], half[3], half[4], half[5] };
static const double *const g[9] = { store[6], store[7], store[8], store[9], store[10], store[11], store[12], store[13], store[14] };
static const int           plane[6][2] = { { 0, 1 }, { 1, 0 }, { 0, 2 }, { 2, 0 }, { 1, 2 }, { 2, 1 } };

static int Entry(int i, int j)
{
  return i == j ? i : i + j + 2;
}

static void FillIdentity(void)
{
  for (int k = 0; k < 6; k++)
    for (int i = 0; i < N; i++) c[k][i] = k < 3;
}

/* The same gradient, one or two components, everywhere. */
static void FillGradient(int k, double value, int k2, double value2)
{
  memset(store[6], 0, 9 * sizeof(store[6]));
  for (int i = 0; i < N; i++) {
    store[6 + k][i]  = value;
    store[6 + k2][i] = value2;
  }
}

/* Random gradients of norm dt |G| = size, trace-free at even nodes; C = A A^T of a random A with entries of order one. */
static void FillRandomNodes(int seed, double size, double dt)
{
  for (int i = 0; i < N; i++) {
    double norm = 0.0, a[9];
    for (int k = 0; k < 9; k++) {
      store[6 + k][i] = Hash(seed, 9 * i + k);
      a[k]            = Hash(seed + 1, 9 * i + k) + 0.5 * (k % 4 == 0);
    }
    if (i % 2 == 0) store[14][i] = -store[6][i] - store[10][i];
    for (int k = 0; k < 9; k++) norm += store[6 + k][i] * store[6 + k][i];
    for (int k = 0; k < 9; k++) store[6 + k][i] *= size / (dt * sqrt(norm));
    for (int k = 0; k < 3; k++)
      for (int m = k; m < 3; m++) {
        c[Entry(k, m)][i] = 0.01 * (k == m);
        for (int l = 0; l < 3; l++) c[Entry(k, m)][i] += a[3 * k + l] * a[3 * m + l];
      }
  }
}

static void Keep(void)
{
  for (int k = 0; k < 6; k++) memcpy(half[k], c[k], sizeof(half[k]));
}

/* Largest difference of two nodes over the largest component. */
static double Difference(const Real expected[6], double *const f[6], int node)
{
  Real difference = 0.0, largest = 0.0;
  for (int k = 0; k < 6; k++) {
    const Real e = fabsl(f[k][node] - expected[k]);
    if (!(e <= difference)) difference = e;
    largest = fmaxl(largest, fabsl(expected[k]));
  }
  return (double)(difference / largest);
}

/* m: C after dt by steps of 24 terms of Taylor's series; no relaxation if lambda is infinite. */
static void Integrate(int node, double dt, double lambda, double w, int steps, Real m[6])
{
  const Real h = (Real)dt / steps;

  for (int s = 0; s < steps; s++) {
    Real term[6], next[6];
    memcpy(term, m, sizeof(term));
    for (int k = 1; k < 25; k++) {
      for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
          Real sum = (k == 1 && i == j ? w : 0.0) / (Real)lambda - term[Entry(i, j)] / (Real)lambda;
          for (int l = 0; l < 3; l++) sum += g[3 * i + l][node] * term[Entry(l, j)] + g[3 * j + l][node] * term[Entry(l, i)];
          next[Entry(i, j)] = sum * h / k;
        }
      memcpy(term, next, sizeof(term));
      for (int l = 0; l < 6; l++) m[l] += term[l];
    }
  }
}

/* int_0^x exp(-t) t^k dt by a series of positive terms. */
static Real Moment(int k, Real x)
{
  Real term = expl(-x) * powl(x, k + 1) / (k + 1), sum = 0.0;
  if (x > 100.0) return k < 2 ? 1.0 : k == 2 ? 2.0 : 6.0;
  for (int j = 0; j < 600; j++) {
    sum += term;
    term *= x / (k + 2 + j);
  }
  return sum;
}

static void RelaxationIntegratesCubicsWithin24eps(void **state)
{
  const double lambda = 0.3;

  for (int e = -120; e <= 120; e++) {
    const double  dt = lambda * pow(10.0, 0.1 * e);
    DLMRelaxation r;
    DLMRelaxationSet(dt, lambda, &r);
    assert_true(0.0 < r.node[0] && r.node[0] < r.node[1] && r.node[1] < dt && r.source[0] > 0.0 && r.source[1] > 0.0);
    AssertNear(r.decay, exp(-dt / lambda), DBL_EPSILON);
    for (int k = 0; k < 4; k++) {
      const Real rule = r.source[0] * powl(r.node[0] / lambda, k) + r.source[1] * powl(r.node[1] / lambda, k);
      AssertNear((double)(rule / Moment(k, (Real)dt / lambda)), 1.0, 24.0 * DBL_EPSILON);
    }
  }
}

/* Error of the rule, (1 - decay) (2 dt |G|)^4 / 4320 of the sources' e^(2 dt |G|), up to dt |G| = 0.5; 1e-11 + rounding beyond. */
static void StretchAgreesWithIntegration(void **state)
{
  static const double size[9] = { 1e-3, 4e-3, 0.05, 0.2, 0.49, 0.51, 2.0, 8.0, 30.0 }, lambda[3] = { 0.02, 0.3, 40.0 };

  for (int pass = 0; pass < 27; pass++) {
    const double  x = size[pass / 3], dt = 0.25, rule = x <= 0.5 ? pow(2.0 * x, 4.0) / 4320.0 * exp(2.0 * x) : 1e-11;
    double        weight[N];
    DLMRelaxation r;
    DLMRelaxationSet(dt, lambda[pass % 3], &r);
    FillRandomNodes(pass, x, dt);
    Keep();
    for (int i = 0; i < N; i++) weight[i] = 0.5 + 0.5 * fabs(Hash(77, i));
    DLMTensorStretch(N, g, &r, weight, c);
    for (int i = 0; i < N; i += 31) {
      Real m[6];
      for (int k = 0; k < 6; k++) m[k] = half[k][i];
      Integrate(i, dt, lambda[pass % 3], weight[i], 20 + (int)(20.0 * (x + dt / lambda[pass % 3])), m);
      AssertNear(Difference(m, c, i), 0.0, (1.0 - r.decay) * rule + 16.0 * (1.0 + x) * DBL_EPSILON);
    }
  }
}

/* C_12 = Wi (1 - e^-x), C_11 = 1 + 2 Wi^2 (1 - (1 + x) e^-x), x = dt/lambda, in every plane: exact at any shear. */
static void StartUpShearIsExactWithin48eps(void **state)
{
  static const double x[4] = { 0.01, 0.3, 2.0, 30.0 }, shear[5] = { 1e-3, 0.4, 3.0, 200.0, 1e4 }, lambda = 0.7;

  for (int pass = 0; pass < 120; pass++) {
    const int     i = plane[pass % 6][0], j = plane[pass % 6][1];
    const double  s = x[pass / 6 % 4], rate = shear[pass / 24] / (s * lambda), wi = rate * lambda;
    const Real    rest = 1.0 - (1.0 + (Real)s) * expl(-(Real)s);
    DLMRelaxation r;
    Real          m[6] = { 1.0, 1.0, 1.0 };
    DLMRelaxationSet(s * lambda, lambda, &r);
    FillIdentity();
    FillGradient(3 * i + j, rate, 3 * i + j, rate);
    DLMTensorStretch(N, g, &r, NULL, c);
    m[i] += 2.0 * wi * wi * rest;
    m[Entry(i, j)] = -wi * expm1(-s);
    for (int k = 0; k < 6; k++) AssertNear(c[k][N - 1], (double)m[k], 48.0 * DBL_EPSILON * sqrt((double)(m[i] * (k == i ? m[i] : 1.0))));
    AssertNear(c[i][0], c[i][N - 1], 8.0 * DBL_EPSILON * c[i][0]);
  }
}

/* Component i grows like y' = (2 e - 1/lambda) y + 1/lambda; planar e, -e, 0 and uniaxial e, -e/2, -e/2 on every axis. */
static void ExtensionFollowsClosedForm(void **state)
{
  static const double strain[6] = { 1e-3, 0.1, 0.35, 0.7, 20.0, 150.0 };

  for (int pass = 0; pass < 36; pass++) {
    const int     axis = pass % 3, uniaxial = pass / 3 % 2;
    const double  s = 0.6, e = strain[pass / 6] / s, ratio[3] = { 1.0, uniaxial ? -0.5 : -1.0, uniaxial ? -0.5 : 0.0 };
    const double  x = e * s * (uniaxial ? sqrt(1.5) : sqrt(2.0)), rule = x <= 0.5 ? pow(2.0 * x, 4.0) / 4320.0 * exp(2.0 * x) : 1e-11;
    DLMRelaxation r;
    FillIdentity();
    memset(store[6], 0, 9 * sizeof(store[6]));
    for (int k = 0; k < 3; k++)
      for (int i = 0; i < N; i++) store[6 + 4 * ((axis + k) % 3)][i] = ratio[k] * e;
    DLMRelaxationSet(s, 1.0, &r);
    DLMTensorStretch(N, g, &r, NULL, c);
    for (int k = 0; k < 3; k++) {
      const double growth = 2.0 * e * ratio[k] - 1.0, y = exp(growth * s) + expm1(growth * s) / growth;
      AssertNear(c[(axis + k) % 3][11] / y, 1.0, rule + 32.0 * (1.0 + x) * DBL_EPSILON);
    }
  }
}

/* Rigid rotation by any angle leaves I and the eigenvalues of C alone; a quarter turn about axis 3 exchanges 11 and 22. */
static void RotationOnlyRotates(void **state)
{
  for (int pass = 0; pass < 4; pass++) {
    const double  angle = 0.5 * acos(-1.0) * (pass < 3 ? 1 + 40 * pass : 1e-2);
    DLMRelaxation r;
    FillIdentity();
    FillGradient(1, -angle, 3, angle);
    DLMRelaxationSet(1.0, 2.0, &r);
    DLMTensorStretch(N, g, &r, NULL, c);
    for (int k = 0; k < 6; k++) AssertNear(c[k][5], k < 3, 16.0 * (1.0 + angle) * DBL_EPSILON);
    if (pass == 3) continue;
    for (int k = 0; k < 6; k++) c[k][5] = 1.0 + k + (k < 3 ? 10.0 : 0.0);
    DLMRelaxationSet(1.0, 1e300, &r);
    DLMTensorStretch(N, g, &r, NULL, c);
    const Real m[6] = { 12.0, 11.0, 13.0, -4.0, -6.0, 5.0 };
    AssertNear(Difference(m, c, 5), 0.0, 16.0 * (1.0 + angle) * DBL_EPSILON);
  }
}

/* Two half steps are one: within 1e-12 where the rule is (dt |G| <= 0.004, or cut into small steps beyond 0.5), in shear always. */
static void HalfStepsComposeWithin1em12(void **state)
{
  static const double size[7] = { 1e-3, 4e-3, 1.1, 6.0, 0.3, 0.8, 50.0 };

  for (int pass = 0; pass < 7; pass++) {
    DLMRelaxation whole, part;
    DLMRelaxationSet(0.2, 0.5, &whole);
    DLMRelaxationSet(0.1, 0.5, &part);
    FillRandomNodes(pass, size[pass], 0.2);
    if (pass > 3) {
      const int k = 3 * plane[pass % 6][0] + plane[pass % 6][1];
      FillGradient(k, size[pass] / 0.2, k, size[pass] / 0.2);
    }
    Keep();
    DLMTensorStretch(N, g, &whole, NULL, c);
    DLMTensorStretch(N, g, &part, NULL, twice);
    DLMTensorStretch(N, g, &part, NULL, twice);
    for (int i = 0; i < N; i++) {
      Real m[6];
      for (int k = 0; k < 6; k++) m[k] = twice[k][i];
      AssertNear(Difference(m, c, i), 0.0, 1e-12);
    }
  }
}

/* A Cholesky factorisation succeeds after every step, step after step, large and small, up to dt |G| = 200 in any direction. */
static void ConformationStaysPositive(void **state)
{
  static const double size[6] = { 0.3, 1.0, 5.0, 20.0, 80.0, 200.0 };

  for (int pass = 0; pass < 36; pass++) {
    DLMRelaxation r;
    DLMRelaxationSet(0.1, pass % 2 ? 1e6 : 0.3, &r);
    FillIdentity();
    for (int step = 0; step < (pass / 6 < 4 ? 8 : 2); step++) {
      Keep();
      FillRandomNodes(100 * pass + step, step % 2 ? 0.4 : size[pass / 6], 0.1);
      for (int k = 0; k < 6; k++) memcpy(c[k], half[k], sizeof(half[k]));
      if (pass % 3) DLMTensorStretch(N, g, &r, NULL, c);
      else DLMTensorStretchSplit(N, g, 0.1, r.lambda, c);
      Keep();
      assert_int_equal(DLMTensorCholesky(N, twice, twice), -1);
    }
  }
}

/* NaN and Inf come out of one node and stay there. */
static void BadNodesStayVisible(void **state)
{
  DLMRelaxation r;
  DLMRelaxationSet(0.1, 0.3, &r);
  FillIdentity();
  FillGradient(1, 1.0, 5, 2.0);
  c[3][7]       = NAN;
  store[10][99] = INFINITY;
  store[10][98] = NAN;
  store[7][97]  = 1e200;
  DLMTensorStretch(N, g, &r, NULL, c);
  for (int i = 0; i < N; i++) assert_int_equal(isfinite(c[0][i] + c[1][i] + c[2][i]) != 0, i != 7 && (i < 97 || i > 99));
}

/* F C F^T within rounding, then exact relaxation; I at rest exactly; first order in dt in steady shear. */
static void SplitIsFirstOrderAndExactAtRest(void **state)
{
  double error[2];

  for (int pass = 0; pass < 4; pass++) {
    static const double size[4] = { 1e-3, 0.4, 3.0, 20.0 };
    FillRandomNodes(pass, size[pass], 0.25);
    Keep();
    DLMTensorStretchSplit(N, g, 0.25, 0.4, c);
    for (int i = 0; i < N; i += 31) {
      const double decay = exp(-0.25 / 0.4);
      Real         m[6];
      for (int k = 0; k < 6; k++) m[k] = half[k][i];
      Integrate(i, 0.25, INFINITY, 0.0, 10 + (int)(20.0 * size[pass]), m);
      for (int k = 0; k < 6; k++) m[k] = decay * m[k] + (k < 3) * (1.0 - decay);
      AssertNear(Difference(m, c, i), 0.0, 16.0 * (1.0 + size[pass]) * DBL_EPSILON);
    }
  }
  for (int k = 0; k < 200; k++) {
    if (k == 0) FillIdentity();
    FillGradient(0, 0.0, 0, 0.0);
    DLMTensorStretchSplit(N, g, 0.01 * (k + 1), 0.3, c);
    for (int m = 0; m < 6; m++) assert_true(c[m][3] == (m < 3) && c[m][N - 1] == (m < 3));
  }
  for (int level = 0; level < 2; level++) {
    FillIdentity();
    FillGradient(1, 1.0, 1, 1.0);
    for (int k = 0; k < 2000; k++) DLMTensorStretchSplit(N, g, 0.02 / (1 + level), 1.0, c);
    error[level] = fabs(c[3][0] - 1.0);
  }
  AssertNear(error[0] / error[1], 2.0, 0.02);
}

/* Steady shear, Wi = 1.5, s = dt/lambda, in every plane: exact for the exact step; fingerprints of the thesis's step within s^2. */
static void SteadyShearShowsFingerprints(void **state)
{
  const double wi = 1.5, s = 0.02;

  for (int p = 0; p < 12; p++) {
    const int     i = plane[p % 6][0], j = plane[p % 6][1], factor = p / 6;
    DLMRelaxation r;
    DLMRelaxationSet(s, 1.0, &r);
    FillIdentity();
    FillGradient(3 * i + j, wi, 3 * i + j, wi);
    for (int step = 0; step < 2500; step++) {
      if (!factor) DLMTensorStretch(N, g, &r, NULL, c);
      else assert_int_equal(DLMTensorCholesky(N, c, c), -1);
      if (factor) DLMTensorStretchFactor(N, g, s, 1.0, c, c);
    }
    const double low_n1 = 1.0 - (c[i][0] - c[j][0]) / (2.0 * wi * wi), low_shear = 1.0 - c[Entry(i, j)][0] / wi;
    AssertNear(low_n1, factor * s / 4.0, factor ? s * s : 1e-13);
    AssertNear(low_shear, factor * s * s / 16.0, factor ? s * s * s / 16.0 : 1e-13);
    AssertNear(c[3 - i - j][0], factor ? (1.0 + 0.5 * s) * (1.0 + 0.5 * s) / (1.0 + 0.25 * s) : 1.0, 1e-13);
    AssertNear(c[3 - i - j][0], 1.0 + factor * 0.75 * s, factor ? s * s : 1e-13);
  }
}

/* M B = A and C = B B^T + s I, checked without an inverse: M (C - s I) M^T = A A^T. */
static void FactorStepSolvesItsEquation(void **state)
{
  const double dt = 0.1, lambda = 0.4, s = dt / lambda;

  FillRandomNodes(5, 0.4, dt);
  Keep();
  assert_int_equal(DLMTensorCholesky(N, c, c), -1);
  DLMTensorStretchFactor(N, g, dt, lambda, c, c);
  for (int node = 0; node < N; node++) {
    Real m[3][3], product[6] = { 0.0 };
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) m[i][j] = (i == j) * (1.0 + 0.5 * s) - dt * g[3 * i + j][node];
    for (int i = 0; i < 3; i++)
      for (int j = i; j < 3; j++)
        for (int k = 0; k < 3; k++)
          for (int l = 0; l < 3; l++) product[Entry(i, j)] += m[i][k] * (c[Entry(k, l)][node] - (k == l) * s) * m[j][l];
    AssertNear(Difference(product, twice, node), 0.0, 32.0 * DBL_EPSILON);
  }
}

int main(int argc, char **argv)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(RelaxationIntegratesCubicsWithin24eps),
    cmocka_unit_test(StretchAgreesWithIntegration),
    cmocka_unit_test(StartUpShearIsExactWithin48eps),
    cmocka_unit_test(ExtensionFollowsClosedForm),
    cmocka_unit_test(RotationOnlyRotates),
    cmocka_unit_test(HalfStepsComposeWithin1em12),
    cmocka_unit_test(ConformationStaysPositive),
    cmocka_unit_test(BadNodesStayVisible),
    cmocka_unit_test(SplitIsFirstOrderAndExactAtRest),
    cmocka_unit_test(SteadyShearShowsFingerprints),
    cmocka_unit_test(FactorStepSolvesItsEquation),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
