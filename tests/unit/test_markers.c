/* Point sets of the surface and harmonics on them, Peskin's delta, and its weights near walls. Pure C. */
#include "dlmtest.h"
#include "private/markers.h"

/* About as many points as these; DLMSurfaceCount says how many exactly. */
static const int about[] = { 12, 14, 18, 20, 24, 26, 30, 36, 50, 61, 73, 98, 113, 150, 200, 251, 300, 404, 602, 1000, 1800, 3000 };

enum { N_COUNTS = sizeof(about) / sizeof(about[0]) };

static int     counts[N_COUNTS];
static double *points, *sets[N_COUNTS], nearest[3100];

static int MakeSets(void **state)
{
  for (int i = 0; i < N_COUNTS; i++) {
    counts[i] = DLMSurfaceCount(sqrt(about[i] / (4.0 * M_PI)), 1.0);
    sets[i]   = malloc(sizeof(double) * 3 * counts[i]);
    DLMSurfacePoints(counts[i], sets[i]);
  }
  return 0;
}

static int FreeSets(void **state)
{
  for (int i = 0; i < N_COUNTS; i++) free(sets[i]);
  return 0;
}

/* Makes set i the points that the tests look at; returns their number. */
static int Take(int i)
{
  points = sets[i];
  return counts[i];
}

/* Distance from each point to its nearest neighbour; returns the mean. */
static double FindNearest(int n)
{
  double mean = 0.0;

  for (int i = 0; i < n; i++) {
    nearest[i] = 4.0;
    for (int k = 0; k < n; k++) {
      double r2 = 0.0;
      for (int d = 0; d < 3; d++) r2 += (points[3 * i + d] - points[3 * k + d]) * (points[3 * i + d] - points[3 * k + d]);
      if (k != i) nearest[i] = fmin(nearest[i], sqrt(r2));
    }
    mean += nearest[i] / n;
  }
  return mean;
}

static int Contains(int n, const double x[3])
{
  for (int i = 0; i < n; i++)
    if (fabs(points[3 * i] - x[0]) < 1e-12 && fabs(points[3 * i + 1] - x[1]) < 1e-12 && fabs(points[3 * i + 2] - x[2]) < 1e-12) return 1;
  return 0;
}

/* What the mesh maps to itself maps the points to themselves: the point reflection and the permutations of the axes it generates. */
static void PointsHaveTheSymmetriesOfTheMesh(void **state)
{
  for (int c = 0; c < N_COUNTS; c++) {
    const int n = Take(c);
    for (int i = 0; i < n; i++) {
      const double *x = points + 3 * i, image[3][3] = { { -x[0], -x[1], -x[2] }, { x[1], x[2], x[0] }, { -x[0], x[1], x[2] } };
      AssertNear(x[0] * x[0] + x[1] * x[1] + x[2] * x[2], 1.0, 1e-14);
      for (int k = 0; k < 3; k++) assert_true(Contains(n, image[k]));
    }
  }
}

/* Every point has its nearest neighbour near the mean distance, and the mean is that of an even arrangement. */
static void PointsAreEvenlySpaced(void **state)
{
  for (int c = 0; c < N_COUNTS; c++) {
    const int    n = Take(c);
    const double mean = FindNearest(n), square = sqrt(4.0 * M_PI / n);
    for (int i = 0; i < n; i++)
      if (!(nearest[i] >= 0.75 * mean && nearest[i] <= 1.25 * mean))
        fail_msg("%d points: point %d has its neighbour at %.3f of the mean", n, i, nearest[i] / mean);
    if (!(mean > 0.85 * square && mean < 1.1 * square)) fail_msg("%d points: mean spacing %g, square %g", n, mean, square);
  }
}

static void SecondMomentIsIsotropic(void **state)
{
  for (int c = 0; c < N_COUNTS; c++) {
    const int n = Take(c);
    for (int p = 0; p < 9; p++) {
      double sum = 0.0;
      for (int i = 0; i < n; i++) sum += points[3 * i + p % 3] * points[3 * i + p / 3];
      AssertNear(sum, p % 3 == p / 3 ? n / 3.0 : 0.0, 1e-12 * n);
    }
  }
}

/* Orthonormal columns that contain the functions 1, x1, x2, x3 on the sphere. */
static void HarmonicsAreOrthonormal(void **state)
{
  static double Q[36 * 120];

  for (int degree = 1; degree <= 5; degree++) {
    const int n = Take(12), m = DLMHarmonics(n, points, degree, Q); /* about 113 points */
    assert_int_equal(m, (degree + 1) * (degree + 1));
    for (int a = 0; a < m; a++)
      for (int b = 0; b <= a; b++) {
        double sum = 0.0;
        for (int i = 0; i < n; i++) sum += Q[a * n + i] * Q[b * n + i];
        AssertNear(sum, a == b ? 1.0 : 0.0, 1e-12);
      }
    for (int f = 0; f < 4; f++) { /* a function of the span equals its projection */
      double projection[120] = { 0.0 };
      for (int a = 0; a < m; a++) {
        double sum = 0.0;
        for (int i = 0; i < n; i++) sum += Q[a * n + i] * (f < 3 ? points[3 * i + f] : 1.0);
        for (int i = 0; i < n; i++) projection[i] += sum * Q[a * n + i];
      }
      for (int i = 0; i < n; i++) AssertNear(projection[i], f < 3 ? points[3 * i + f] : 1.0, 1e-12);
    }
  }
}

static void TooFewPointsForTheHarmonicsAreNoticed(void **state)
{
  static double Q[121 * 14];

  assert_true(DLMHarmonics(Take(0), points, 10, Q) <= 14);
}

/* One marker per spacing^2 of surface, up to what the orbits of 6, 8, 12 and 24 points can make up; at least 12. */
static void CountCoversTheSurface(void **state)
{
  assert_int_equal(DLMSurfaceCount(0.5, 2.0), 12);
  assert_int_equal(DLMSurfaceCount(0.1, 1.0), 12);
  for (int i = 0; i < 200; i++) {
    const double r = 1.0 + 0.05 * i, spacing = 1.0 + (i % 5) / 4.0, exact = 4.0 * M_PI * r * r / (spacing * spacing);
    AssertNear(DLMSurfaceCount(r, spacing), fmax(12.0, exact), 2.0);
  }
}

/* Peskin's conditions (thesis 2.4), at any offset from the mesh. */
static void DeltaHasItsMoments(void **state)
{
  for (int i = 0; i <= 200; i++) {
    const double x   = i / 100.0 - 1.0;
    double       sum[2] = { 0.0, 0.0 }, first = 0.0, squares = 0.0;
    for (int k = -5; k <= 5; k++) {
      const double w = DLMDelta(x - k);
      sum[k & 1] += w;
      first += (x - k) * w;
      squares += w * w;
      assert_true(w >= 0.0);
    }
    AssertNear(sum[0], 0.5, 1e-14);
    AssertNear(sum[1], 0.5, 1e-14);
    AssertNear(first, 0.0, 1e-14);
    AssertNear(squares, 0.375, 1e-14);
    AssertNear(DLMDelta(x), DLMDelta(-x), 0.0);
  }
  AssertNear(DLMDelta(2.0), 0.0, 0.0);
  AssertNear(DLMDelta(2.5), 0.0, 0.0);
  AssertNear(DLMDelta(0.0), 0.5, 1e-15);
}

/* Away from walls, and on a periodic axis anywhere, the weights are the delta itself. */
static void WeightsInsideAreTheDelta(void **state)
{
  for (int i = -8; i <= 40; i++) {
    const double   x        = 0.25 * i + 0.01;
    const int      periodic = x < 1.0 || x > 7.0;
    double         sum      = 0.0;
    DLMAxisWeights w;
    DLMDeltaWeights(x, periodic, 8, &w);
    for (int k = 0; k < w.n; k++) {
      AssertNear(w.weight[k], DLMDelta(x - w.node[k]), 1e-15);
      sum += w.weight[k];
    }
    AssertNear(sum, 1.0, 1e-14);
  }
}

/* From half a cell beyond a wall to well inside: nodes exist, each once; sums to one; linear fields are exact. */
static void WeightsNearWallsAreLinear(void **state)
{
  const int cells = 6;

  for (int side = 0; side < 2; side++)
    for (int i = -50; i <= 250; i++) {
      const double   x = side ? cells - i / 100.0 : i / 100.0;
      double         sum = 0.0, first = 0.0;
      DLMAxisWeights w;
      DLMDeltaWeights(x, 0, cells, &w);
      assert_true(w.n >= 1 && w.n <= 8);
      for (int k = 0; k < w.n; k++) {
        assert_true(w.node[k] >= 0 && w.node[k] <= cells);
        for (int l = 0; l < k; l++) assert_int_not_equal(w.node[k], w.node[l]);
        sum += w.weight[k];
        first += w.weight[k] * w.node[k];
      }
      AssertNear(sum, 1.0, 1e-13);
      AssertNear(first, x, 1e-13);
    }
}

/* On the wall itself the closure takes the wall node alone: the point then sees the wall's velocity. */
static void APointOnTheWallSeesTheWall(void **state)
{
  DLMAxisWeights w;

  for (int side = 0; side < 2; side++) {
    DLMDeltaWeights(side ? 6.0 : 0.0, 0, 6, &w);
    for (int k = 0; k < w.n; k++) AssertNear(w.weight[k], w.node[k] == (side ? 6 : 0) ? 1.0 : 0.0, 1e-15);
  }
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(PointsHaveTheSymmetriesOfTheMesh),
    cmocka_unit_test(PointsAreEvenlySpaced),
    cmocka_unit_test(SecondMomentIsIsotropic),
    cmocka_unit_test(HarmonicsAreOrthonormal),
    cmocka_unit_test(TooFewPointsForTheHarmonicsAreNoticed),
    cmocka_unit_test(CountCoversTheSurface),
    cmocka_unit_test(DeltaHasItsMoments),
    cmocka_unit_test(WeightsInsideAreTheDelta),
    cmocka_unit_test(WeightsNearWallsAreLinear),
    cmocka_unit_test(APointOnTheWallSeesTheWall),
  };

  return cmocka_run_group_tests(tests, MakeSets, FreeSets);
}
