/*
  The kernels of symmetric tensor fields against closed forms and long double references. Bounds are in units of the largest
  component unless said otherwise; eps = 2.2e-16; cond = largest over smallest eigenvalue. Random numbers are the same in every run.
*/
#include <float.h>
#include "dlmtest.h"
#include "private/tensor.h"

enum { N = 1003 };
typedef long double Real;

static double        store[12][N];
static double *const c[6] = { store[0], store[1], store[2], store[3], store[4], store[5] };
static double *const d[6] = { store[6], store[7], store[8], store[9], store[10], store[11] };
static Real          exact[6][N];

static int Entry(int i, int j)
{
  return i == j ? i : i + j + 2;
}

static void FillField(double *const f[6], int node, const Real m[6])
{
  for (int k = 0; k < 6; k++) f[k][node] = (double)m[k];
}

static void FillIdentity(void)
{
  for (int k = 0; k < 6; k++)
    for (int i = 0; i < N; i++) c[k][i] = k < 3;
}

/* Largest difference of a node from the exact field, over the largest exact component. */
static double NodeError(double *const f[6], int node)
{
  Real difference = 0.0, largest = 0.0;
  for (int k = 0; k < 6; k++) {
    const Real e = fabsl(f[k][node] - exact[k][node]);
    if (!(e <= difference)) difference = e;
    largest = fmaxl(largest, fabsl(exact[k][node]));
  }
  return (double)(largest > 0.0 ? difference / largest : difference);
}

static double FieldError(double *const f[6])
{
  double worst = 0.0;
  for (int i = 0; i < N; i++) {
    const double e = NodeError(f, i);
    if (!(e <= worst)) worst = e;
  }
  return worst;
}

/* Rows of a random orthogonal matrix. */
static void RandomAxes(int seed, int node, Real v[3][3])
{
  Real size = 0.0;
  for (int i = 0; i < 2; i++) {
    for (int k = 0; k < 3; k++) v[i][k] = Hash(seed, 6 * node + 3 * i + k);
    for (int m = 0; m < i; m++) {
      Real dot = 0.0;
      for (int k = 0; k < 3; k++) dot += v[0][k] * v[1][k];
      for (int k = 0; k < 3; k++) v[1][k] -= dot * v[0][k];
    }
    size = sqrtl(v[i][0] * v[i][0] + v[i][1] * v[i][1] + v[i][2] * v[i][2]);
    for (int k = 0; k < 3; k++) v[i][k] /= size;
  }
  for (int k = 0; k < 3; k++) v[2][k] = v[0][(k + 1) % 3] * v[1][(k + 2) % 3] - v[0][(k + 2) % 3] * v[1][(k + 1) % 3];
}

static void Compose(const Real value[3], Real v[3][3], Real m[6])
{
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++) {
      m[Entry(i, j)] = 0.0;
      for (int k = 0; k < 3; k++) m[Entry(i, j)] += value[k] * v[k][i] * v[k][j];
    }
}

/* Eigenvalues of log C in [shift - spread, shift + spread]; a third of the nodes has two or three equal ones. */
static void RandomLogs(int seed, int node, double spread, double shift, Real value[3])
{
  for (int k = 0; k < 3; k++) value[k] = shift + spread * (Real)Hash(seed + 100, 3 * node + k);
  if (node % 6 == 1) value[2] = value[node % 4 / 2];
  if (node % 6 == 3) value[0] = value[1] = value[2];
}

/* Fills psi and C = exp psi exactly. */
static void FillPair(int seed, double spread, double shift, double *const psi[6], double *const conformation[6])
{
  for (int i = 0; i < N; i++) {
    Real value[3], v[3][3], m[6];
    RandomAxes(seed, i, v);
    RandomLogs(seed, i, spread, shift, value);
    Compose(value, v, m);
    FillField(psi, i, m);
    for (int k = 0; k < 3; k++) value[k] = expl(value[k]);
    Compose(value, v, m);
    FillField(conformation, i, m);
  }
}

static void KeepExact(double *const f[6])
{
  for (int k = 0; k < 6; k++)
    for (int i = 0; i < N; i++) exact[k][i] = f[k][i];
}

static void CholeskyAndSquareReturnWithin4eps(void **state)
{
  for (int pass = 0; pass < 4; pass++) {
    FillPair(pass, 2.0 * pass, 20.0 * (pass - 2), d, c);
    KeepExact(c);
    assert_int_equal(DLMTensorCholesky(N, c, d), -1);
    AssertNear(d[1][7] * d[1][7] + d[3][7] * d[3][7], c[1][7], 4.0 * DBL_EPSILON * c[1][7]);
    DLMTensorSquare(N, d, c);
    AssertNear(FieldError(c), 0.0, 4.0 * DBL_EPSILON);
    assert_int_equal(DLMTensorCholesky(N, c, c), -1);
    DLMTensorSquare(N, c, c);
    AssertNear(FieldError(c), 0.0, 8.0 * DBL_EPSILON);
  }
}

/* The first bad node is named, whatever is wrong with it. */
static void CholeskyAndLogFindBadNodes(void **state)
{
  static const double bad[5][2] = { { 0, 0.0 }, { 1, -1e-9 }, { 2, NAN }, { 0, INFINITY }, { 5, 1.0000001 } };

  for (int b = 0; b < 5; b++)
    for (int at = 0; at < N; at += 167) {
      FillIdentity();
      c[(int)bad[b][0]][at] = c[(int)bad[b][0]][N - 1] = bad[b][1];
      assert_int_equal(DLMTensorCholesky(N, c, d), at);
      assert_int_equal(DLMTensorLog(N, c, d), at);
      assert_true(isnan(d[0][at]));
    }
}

static void LogOfKnownEigenpairsWithin10eps(void **state)
{
  static const double spread[6] = { 1e-9, 0.01, 1.0, 3.0, 6.0, 9.0 }, shift[3] = { 0.0, -300.0, 300.0 };

  for (int pass = 0; pass < 18; pass++) {
    const double reach = spread[pass % 6], cond = exp(2.0 * reach), size = fabs(shift[pass / 6]) + reach;
    FillPair(pass, reach, shift[pass / 6], d, c);
    KeepExact(d);
    assert_int_equal(DLMTensorLog(N, c, c), -1);
    for (int i = 0; i < N; i++)
      for (int k = 0; k < 6; k++) AssertNear(c[k][i], (double)exact[k][i], 10.0 * DBL_EPSILON * (size + cond));
  }
}

/* Graded matrices keep the relative accuracy of small eigenvalues; C = I gives zero exactly. */
static void LogAndExpOfDiagonalsAreRelativelyExact(void **state)
{
  for (int k = 0; k < 6; k++)
    for (int i = 0; i < N; i++) c[k][i] = k < 3 && i % 10 ? pow(10.0, 12.0 * Hash(k, i)) : k < 3;
  assert_int_equal(DLMTensorLog(N, c, d), -1);
  for (int k = 0; k < 6; k++)
    for (int i = 0; i < N; i++) {
      if (k > 2 || i % 10 == 0) assert_true(d[k][i] == 0.0);
      else AssertNear(d[k][i], log(c[k][i]), 2.0 * DBL_EPSILON * fmax(1.0, fabs(d[k][i])));
    }
  KeepExact(c);
  for (int i = 0; i < N; i++) d[0][i] += 1e-300; /* a trace of noise */
  DLMTensorExp(N, d, c);
  for (int i = 0; i < N; i++) {
    if (i % 10 == 0) assert_true(c[0][i] == 1.0 && c[1][i] == 1.0 && c[2][i] == 1.0);
    AssertNear(NodeError(c, i), 0.0, 60.0 * DBL_EPSILON);
  }
}

static void ExpOfKnownEigenpairsWithin60epsAndTheTrace(void **state)
{
  static const double spread[7] = { 1e-9, 0.01, 1.0, 4.0, 9.0, 14.0, 27.0 }, shift[3] = { 0.0, -600.0, 600.0 };

  for (int pass = 0; pass < 21; pass++) {
    FillPair(pass, spread[pass % 7], shift[pass / 7], d, c);
    KeepExact(c);
    DLMTensorExp(N, d, d);
    AssertNear(FieldError(d), 0.0, (60.0 + 2.0 * fabs(shift[pass / 7])) * DBL_EPSILON);
    if (pass % 7 == 6) assert_int_equal(DLMTensorCholesky(N, d, d), -1);
  }
  d[4][5] = NAN;
  d[1][6] = INFINITY;
  DLMTensorExp(N, d, d);
  for (int i = 5; i < 7; i++) assert_false(isfinite(d[0][i] + d[1][i] + d[2][i]));
}

static void LogOfExpReturnsWithin60epsCond(void **state)
{
  for (int pass = 0; pass < 5; pass++) {
    FillPair(50 + pass, pass, 0.0, d, c);
    KeepExact(d);
    DLMTensorExp(N, d, d);
    assert_int_equal(DLMTensorLog(N, d, d), -1);
    for (int i = 0; i < N; i++)
      for (int k = 0; k < 6; k++) AssertNear(d[k][i], (double)exact[k][i], 60.0 * DBL_EPSILON * exp(2.0 * pass));
  }
}

/* C v = lambda v and v_i . v_j within 8 eps; ascending; known values. */
static void EigenDecomposes(void **state)
{
  FillPair(3, 3.0, 1.0, d, c);
  for (int i = 0; i < N; i++) {
    const double m[6] = { d[0][i], d[1][i], d[2][i], d[3][i], d[4][i], d[5][i] };
    double       value[3], v[3][3];
    Real         known[3];
    DLMTensorEigen(m, value, v);
    RandomLogs(3, i, 3.0, 1.0, known);
    AssertNear(value[0], (double)fminl(known[0], fminl(known[1], known[2])), 40.0 * DBL_EPSILON);
    assert_true(value[0] <= value[1] && value[1] <= value[2]);
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 3; b++) {
        const double image = m[Entry(b, 0)] * v[a][0] + m[Entry(b, 1)] * v[a][1] + m[Entry(b, 2)] * v[a][2];
        AssertNear(image, value[a] * v[a][b], 32.0 * DBL_EPSILON);
        AssertNear(v[a][0] * v[b][0] + v[a][1] * v[b][1] + v[a][2] * v[b][2], a == b, 8.0 * DBL_EPSILON);
      }
  }
}

static void RangeAgreesWithEveryNodesEigenvalue(void **state)
{
  for (int pass = 0; pass < 6; pass++) {
    double smallest, trace, least = INFINITY, largest = 0.0;
    long   where, first;
    FillPair(pass, pass, 0.0, d, c);
    for (int i = 0; i < N; i++) {
      const double m[6] = { c[0][i], c[1][i], c[2][i], c[3][i], c[4][i], c[5][i] };
      double       value[3], v[3][3];
      DLMTensorEigen(m, value, v);
      least   = fmin(least, value[0]);
      largest = fmax(largest, m[0] + m[1] + m[2]);
    }
    DLMTensorRange(N, c, &smallest, &where, &trace);
    AssertNear(smallest, least, 16.0 * DBL_EPSILON * largest);
    AssertNear(trace, largest, 2.0 * DBL_EPSILON * largest);
    assert_in_range(where, 0, N - 1);
    first             = 1 + 150 * pass;
    c[pass][N - 1]    = NAN;
    c[5 - pass][first] = pass % 2 ? NAN : INFINITY;
    DLMTensorRange(N, c, &smallest, &where, &trace);
    assert_true(isnan(smallest) && isnan(trace));
    assert_int_equal(where, first);
  }
}

int main(int argc, char **argv)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(CholeskyAndSquareReturnWithin4eps),
    cmocka_unit_test(CholeskyAndLogFindBadNodes),
    cmocka_unit_test(LogOfKnownEigenpairsWithin10eps),
    cmocka_unit_test(LogAndExpOfDiagonalsAreRelativelyExact),
    cmocka_unit_test(ExpOfKnownEigenpairsWithin60epsAndTheTrace),
    cmocka_unit_test(LogOfExpReturnsWithin60epsCond),
    cmocka_unit_test(EigenDecomposes),
    cmocka_unit_test(RangeAgreesWithEveryNodesEigenvalue),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
