/* Stokes flow past a sphere: every mode vanishes on it, is free of divergence, obeys Stokes's equations, and they are independent. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>
#include "private/lamb.h"

enum { N = DLM_LAMB_MODES };

static double Hash(unsigned seed)
{
  const double x = sin(12.9898 * seed + 78.233) * 43758.5453;
  return 2.0 * (x - floor(x)) - 1.0;
}

/* The k-th of some points at a distance from r0 to r1. */
static void Point(unsigned k, double r0, double r1, double x[3])
{
  const double z = Hash(3 * k), phi = 3.14159265 * Hash(3 * k + 1), r = r0 + (r1 - r0) * 0.5 * (1.0 + Hash(3 * k + 2));
  x[0] = r * sqrt(1.0 - z * z) * cos(phi);
  x[1] = r * sqrt(1.0 - z * z) * sin(phi);
  x[2] = r * z;
}

static void EveryModeIsAtRestOnTheSphere(void **state)
{
  for (unsigned k = 0; k < 100; k++) {
    double x[3], u[N][3];
    Point(k, 1.0, 1.0, x);
    DLMLambModes(x, u, NULL);
    for (int m = 0; m < N; m++)
      for (int i = 0; i < 3; i++) assert_true(fabs(u[m][i]) < 1e-12);
  }
}

static void TheGradientIsThatOfTheVelocity(void **state)
{
  for (unsigned k = 0; k < 100; k++) {
    const double e = 1e-4;
    double       x[3], u[N][3], g[N][9], up[N][3], down[N][3];
    Point(k, 0.9, 3.0, x);
    DLMLambModes(x, u, g);
    for (int j = 0; j < 3; j++) {
      double a[3] = { x[0], x[1], x[2] }, b[3] = { x[0], x[1], x[2] };
      a[j] += e;
      b[j] -= e;
      DLMLambModes(a, up, NULL);
      DLMLambModes(b, down, NULL);
      for (int m = 0; m < N; m++)
        for (int i = 0; i < 3; i++) assert_true(fabs((up[m][i] - down[m][i]) / (2.0 * e) - g[m][3 * i + j]) < 1e-4);
    }
    for (int m = 0; m < N; m++) assert_true(fabs(g[m][0] + g[m][4] + g[m][8]) < 1e-11);
  }
}

static void AddVorticity(double weight, const double x[3], double w[N][3])
{
  double u[N][3], g[N][9];

  DLMLambModes(x, u, g);
  for (int m = 0; m < N; m++) {
    w[m][0] += weight * (g[m][7] - g[m][5]);
    w[m][1] += weight * (g[m][2] - g[m][6]);
    w[m][2] += weight * (g[m][3] - g[m][1]);
  }
}

/* Stokes's equations are met if the vorticity is harmonic; differences of fourth order. */
static void TheVorticityIsHarmonic(void **state)
{
  static const double weight[5] = { -1.0 / 12, 4.0 / 3, -5.0 / 2, 4.0 / 3, -1.0 / 12 };

  for (unsigned k = 0; k < 30; k++) {
    const double h = 0.01;
    double       x[3], w[N][3] = { { 0.0 } };
    Point(k, 1.1, 2.0, x);
    for (int d = 0; d < 3; d++)
      for (int s = -2; s <= 2; s++) {
        double at[3] = { x[0], x[1], x[2] };
        at[d] += s * h;
        AddVorticity(weight[s + 2] / (h * h), at, w);
      }
    for (int m = 0; m < N; m++)
      for (int i = 0; i < 3; i++) assert_true(fabs(w[m][i]) < 0.03); /* of terms up to 1e3 */
  }
}

/* Far away a mode is the polynomial that flows past the sphere. */
static void FarAwayTheFlowIsAPolynomial(void **state)
{
  static const int first[] = { 0, 3, 11, N }; /* degrees 0, 1 and 2 */
  double           u[N][3], v[N][3];
  const double     x[3] = { 3e5, -2e5, 4e5 }, y[3] = { 6e5, -4e5, 8e5 };

  DLMLambModes(x, u, NULL);
  DLMLambModes(y, v, NULL);
  for (int degree = 0; degree < 3; degree++)
    for (int m = first[degree]; m < first[degree + 1]; m++)
      for (int i = 0; i < 3; i++) assert_true(fabs(v[m][i] - pow(2.0, degree) * u[m][i]) <= 1e-4 * (fabs(v[m][i]) + 1.0));
}

/* The least pivot of the Gram matrix of modes of one size, next to the sphere. */
static void TheModesAreIndependent(void **state)
{
  static double A[N][N];
  double        least = 1.0;

  for (unsigned k = 0; k < 500; k++) {
    double x[3], u[N][3];
    Point(k, 1.3, 1.6, x);
    DLMLambModes(x, u, NULL);
    for (int m = 0; m < N; m++)
      for (int n = 0; n < N; n++) A[m][n] += u[m][0] * u[n][0] + u[m][1] * u[n][1] + u[m][2] * u[n][2];
  }
  for (int m = 0; m < N; m++) {
    const double size = sqrt(A[m][m]);
    for (int n = 0; n < N; n++) A[m][n] /= size;
    for (int n = 0; n < N; n++) A[n][m] /= size;
  }
  for (int m = 0; m < N; m++) {
    least = fmin(least, A[m][m]);
    for (int n = m + 1; n < N; n++)
      for (int q = N - 1; q >= m; q--) A[n][q] -= A[n][m] / A[m][m] * A[m][q];
  }
  assert_true(least > 0.005);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(EveryModeIsAtRestOnTheSphere), cmocka_unit_test(TheGradientIsThatOfTheVelocity), cmocka_unit_test(TheVorticityIsHarmonic),
    cmocka_unit_test(FarAwayTheFlowIsAPolynomial),  cmocka_unit_test(TheModesAreIndependent),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
