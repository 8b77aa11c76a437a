/*
  The kernels of the Kuhn mesh against quadrature over explicit tetrahedra: volumes and gradients from vertex coordinates, P1
  functions from barycentric coordinates, points found by search. Mesh of unit cubes; pure C.
*/
#include "dlmtest.h"

enum { CELLS = 4, NODES = CELLS + 1 };

/* Corners of the six tetrahedra around the diagonal of a cube, as bits x1 x2 x3. */
static const int corner[6][4][3] = {
  { { 0, 0, 0 }, { 1, 0, 0 }, { 1, 1, 0 }, { 1, 1, 1 } }, { { 0, 0, 0 }, { 1, 0, 0 }, { 1, 0, 1 }, { 1, 1, 1 } },
  { { 0, 0, 0 }, { 0, 1, 0 }, { 1, 1, 0 }, { 1, 1, 1 } }, { { 0, 0, 0 }, { 0, 1, 0 }, { 0, 1, 1 }, { 1, 1, 1 } },
  { { 0, 0, 0 }, { 0, 0, 1 }, { 1, 0, 1 }, { 1, 1, 1 } }, { { 0, 0, 0 }, { 0, 0, 1 }, { 0, 1, 1 }, { 1, 1, 1 } },
};

/* Barycentric coordinates of a tetrahedron: L[a](x) = constant[a] + gradient[a] . x */
typedef struct {
  int    node[4][3];
  double volume, constant[4], gradient[4][3];
} Tetrahedron;

static void Cross(const double a[3], const double b[3], double c[3])
{
  for (int d = 0; d < 3; d++) c[d] = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
}

static double Dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Tetrahedron t of the cube of the given edge at its lower corner. */
static Tetrahedron GetTetrahedron(const int low[3], int edge, int t)
{
  Tetrahedron q;
  double      x[4][3];

  for (int a = 0; a < 4; a++)
    for (int d = 0; d < 3; d++) x[a][d] = q.node[a][d] = low[d] + edge * corner[t][a][d];
  for (int a = 0; a < 4; a++) {
    double e[2][3], to_a[3], normal[3], height;
    for (int d = 0; d < 3; d++) {
      e[0][d] = x[(a + 2) % 4][d] - x[(a + 1) % 4][d];
      e[1][d] = x[(a + 3) % 4][d] - x[(a + 1) % 4][d];
      to_a[d] = x[a][d] - x[(a + 1) % 4][d];
    }
    Cross(e[0], e[1], normal);
    height   = Dot(normal, to_a);
    q.volume = fabs(height) / 6.0;
    for (int d = 0; d < 3; d++) q.gradient[a][d] = normal[d] / height;
    q.constant[a] = -Dot(q.gradient[a], x[(a + 1) % 4]);
  }
  return q;
}

static double Barycentric(const Tetrahedron *q, int a, const double x[3])
{
  return q->constant[a] + Dot(q->gradient[a], x);
}

/* The P1 basis function of a node of the infinite mesh of the given edge, by searching the tetrahedra around the node. */
static double Basis(int edge, const int node[3], const double x[3])
{
  for (int c = 0; c < 8; c++)
    for (int t = 0; t < 6; t++) {
      const int         low[3] = { node[0] - edge * (c & 1), node[1] - edge * ((c >> 1) & 1), node[2] - edge * (c >> 2) };
      const Tetrahedron q      = GetTetrahedron(low, edge, t);
      double            least = 1.0, mine = 0.0;
      for (int a = 0; a < 4; a++) {
        least = fmin(least, Barycentric(&q, a, x));
        if (!memcmp(q.node[a], node, sizeof(q.node[a]))) mine = Barycentric(&q, a, x);
      }
      if (least >= -1e-14) return mine;
    }
  return 0.0;
}

/* Four-point Gauss rule, exact for quadratics. */
static void GaussPoint(const Tetrahedron *q, int g, double x[3])
{
  const double near = 0.58541019662496845446, far = 0.13819660112501051518;

  x[0] = x[1] = x[2] = 0.0;
  for (int a = 0; a < 4; a++)
    for (int d = 0; d < 3; d++) x[d] += (a == g ? near : far) * q->node[a][d];
}

/* Rows of a mesh of CELLS^3 cubes, [node][node], by quadrature. */
static double mass[125][125], stiffness[125][125], derivative[3][125][125], lumped[125];

static int Index(const int node[3])
{
  return node[0] + NODES * (node[1] + NODES * node[2]);
}

static void AddTetrahedron(const Tetrahedron *q)
{
  for (int g = 0; g < 4; g++) {
    double x[3];
    GaussPoint(q, g, x);
    for (int a = 0; a < 4; a++) {
      const int    i      = Index(q->node[a]);
      const double phi_a  = Barycentric(q, a, x), weight = q->volume / 4.0;
      lumped[i] += weight * phi_a;
      for (int b = 0; b < 4; b++) {
        const int k = Index(q->node[b]);
        mass[i][k] += weight * phi_a * Barycentric(q, b, x);
        stiffness[i][k] += weight * Dot(q->gradient[a], q->gradient[b]);
        for (int j = 0; j < 3; j++) derivative[j][i][k] += weight * phi_a * q->gradient[b][j];
      }
    }
  }
}

static int Assemble(void **state)
{
  double volume = 0.0;

  for (int cell = 0; cell < CELLS * CELLS * CELLS; cell++)
    for (int t = 0; t < 6; t++) {
      const int         low[3] = { cell % CELLS, (cell / CELLS) % CELLS, cell / (CELLS * CELLS) };
      const Tetrahedron q      = GetTetrahedron(low, 1, t);
      volume += q.volume;
      AddTetrahedron(&q);
    }
  return fabs(volume - CELLS * CELLS * CELLS) > 1e-12;
}

/* Place number p: a node of the mesh that lies there. The middle node is inside and on the coarse mesh. */
static void GetPlace(int p, int place[3], int node[3])
{
  for (int d = 0; d < 3; d++, p /= 3) {
    place[d] = p % 3;
    node[d]  = place[d] == DLM_LOWER ? 0 : (place[d] == DLM_INNER ? 2 : CELLS);
  }
}

/* Asserts that a row of offsets -reach..reach equals a row of the assembled matrix, zeros beyond the mesh included. */
static void CompareRow(const double *row, int reach, const double matrix[125], const int node[3])
{
  const int n = 2 * reach + 1;

  for (int i = 0; i < n * n * n; i++) {
    const int q[3]   = { node[0] + i % n - reach, node[1] + (i / n) % n - reach, node[2] + i / (n * n) - reach };
    int       inside = 1;
    for (int d = 0; d < 3; d++) inside = inside && q[d] >= 0 && q[d] < NODES;
    AssertNear(row[i], inside ? matrix[Index(q)] : 0.0, 1e-14);
  }
}

static void CubeListsTheSixTetrahedra(void **state)
{
  DLMKuhnCube cube;
  int         found[6] = { 0 };

  DLMKuhnCubeFill(&cube);
  for (int t = 0; t < 6; t++) {
    for (int s = 0; s < 6; s++) found[s] += !memcmp(cube.vertex[t], corner[s], sizeof(corner[s]));
    for (int k = 0; k < 3; k++)
      for (int d = 0; d < 3; d++) assert_int_equal(cube.vertex[t][k + 1][d] - cube.vertex[t][k][d], d == cube.axis[t][k]);
  }
  for (int s = 0; s < 6; s++) assert_int_equal(found[s], 1);
}

static void RowsEqualQuadrature(void **state)
{
  for (int p = 0; p < 27; p++) {
    int    place[3], node[3];
    double row[27];
    GetPlace(p, place, node);
    DLMKuhnMass(place, row);
    CompareRow(row, 1, mass[Index(node)], node);
    DLMKuhnStiffness(place, row);
    CompareRow(row, 1, stiffness[Index(node)], node);
    for (int j = 0; j < 3; j++) {
      DLMKuhnDerivative(j, place, row);
      CompareRow(row, 1, derivative[j][Index(node)], node);
    }
    AssertNear(DLMKuhnLumpedMass(place), lumped[Index(node)], 1e-14);
  }
}

/* B = P^T D: P from the coarse basis at the fine nodes, D from the quadrature above. */
static void DivergenceIsTransferredDerivative(void **state)
{
  int    place[3], node[3];
  double row[3][125], sum[125];

  for (int p = 0; p < 27; p++) {
    GetPlace(p, place, node);
    DLMKuhnDivergence(place, 0, row);
    for (int j = 0; j < 3; j++) {
      memset(sum, 0, sizeof(sum));
      for (int a = 0; a < 125; a++) {
        const double x[3] = { a % NODES, (a / NODES) % NODES, a / (NODES * NODES) };
        for (int b = 0; b < 125; b++) sum[b] += Basis(2, node, x) * derivative[j][a][b];
      }
      CompareRow(row[j], 2, sum, node);
    }
  }
}

static void StiffnessIsSevenPoint(void **state)
{
  const int inner[3] = { DLM_INNER, DLM_INNER, DLM_INNER }, wall[3] = { DLM_LOWER, DLM_INNER, DLM_INNER };
  const int edge[3] = { DLM_INNER, DLM_LOWER, DLM_LOWER }, cut[3] = { DLM_INNER, DLM_LOWER, DLM_UPPER };
  const int in_wall[4] = { 4, 10, 16, 22 };
  double    row[27];

  DLMKuhnStiffness(inner, row);
  for (int i = 0; i < 27; i++) {
    const int distance = abs(i % 3 - 1) + abs((i / 3) % 3 - 1) + abs(i / 9 - 1);
    AssertNear(row[i], distance == 0 ? 6.0 : (distance == 1 ? -1.0 : 0.0), 1e-14);
  }
  DLMKuhnStiffness(wall, row); /* half of the neighbours in the wall, all of the one inside, none beyond */
  AssertNear(row[13], 3.0, 1e-14);
  AssertNear(row[14], -1.0, 1e-14);
  AssertNear(row[12], 0.0, 0.0);
  for (int i = 0; i < 4; i++) AssertNear(row[in_wall[i]], -0.5, 1e-14);
  DLMKuhnStiffness(edge, row); /* a box edge is shared by one cube: two of its tetrahedra, or one */
  AssertNear(row[14], -1.0 / 3.0, 1e-14);
  DLMKuhnStiffness(cut, row);
  AssertNear(row[14], -1.0 / 6.0, 1e-14);
}

/* Ones and linear functions: sums over a row, and D_j u / lumped mass, at inner and wall nodes alike. */
static void LinearFieldsAreExact(void **state)
{
  const double g[3] = { 0.7, -1.3, 2.1 };

  for (int p = 0; p < 27; p++) {
    int    place[3], node[3];
    double row[27], b[3][125], sum = 0.0, total = 0.0;
    GetPlace(p, place, node);
    DLMKuhnStiffness(place, row);
    for (int i = 0; i < 27; i++) sum += row[i];
    AssertNear(sum, 0.0, 1e-14);
    for (int j = 0; j < 3; j++) {
      double one = 0.0, linear = 0.0;
      DLMKuhnDerivative(j, place, row);
      for (int i = 0; i < 27; i++) {
        one += row[i];
        linear += row[i] * (5.0 + g[0] * (i % 3 - 1) + g[1] * ((i / 3) % 3 - 1) + g[2] * (i / 9 - 1));
      }
      AssertNear(one, 0.0, 1e-14);
      AssertNear(linear / DLMKuhnLumpedMass(place), g[j], 1e-13);
    }
    DLMKuhnDivergence(place, 0, b); /* div of (g1 x1, g2 x2, g3 x3) is the trace; the coarse lumped mass is 8 fine ones */
    for (int i = 0; i < 125; i++) total += g[0] * (i % 5 - 2) * b[0][i] + g[1] * ((i / 5) % 5 - 2) * b[1][i] + g[2] * (i / 25 - 2) * b[2][i];
    AssertNear(total, 8.0 * DLMKuhnLumpedMass(place) * (g[0] + g[1] + g[2]), 1e-12);
  }
}

static void TransferIsTheCoarseBasis(void **state)
{
  const int origin[3] = { 0, 0, 0 };

  for (int i = 0; i < 343; i++) {
    const int    o[3] = { i % 7 - 3, (i / 7) % 7 - 3, i / 49 - 3 };
    const double x[3] = { o[0], o[1], o[2] };
    AssertNear(DLMTransferWeight(o), Basis(2, origin, x), 1e-14);
  }
}

static void InterpolationIsTheBasis(void **state)
{
  for (int n = 0; n < 500; n++) {
    double x[3], weight[8], sum = 0.0, linear[3] = { 0.0, 0.0, 0.0 };
    /* the first 125 lie on a lattice, where coordinates tie and faces, edges and corners are hit */
    for (int d = 0; d < 3; d++) x[d] = n < 125 ? (n / (d == 0 ? 1 : (d == 1 ? 5 : 25)) % 5) / 4.0 : 0.5 + 0.5 * Hash(1, 3 * n + d);
    DLMKuhnInterpolate(x, weight);
    for (int c = 0; c < 8; c++) {
      const int node[3] = { c & 1, (c >> 1) & 1, c >> 2 };
      AssertNear(weight[c], Basis(1, node, x), 1e-14);
      assert_true(weight[c] >= 0.0);
      sum += weight[c];
      for (int d = 0; d < 3; d++) linear[d] += weight[c] * node[d];
    }
    AssertNear(sum, 1.0, 1e-14);
    for (int d = 0; d < 3; d++) AssertNear(linear[d], x[d], 1e-14);
  }
}

/* Rows of the symmetric divergence: their own images in x2, exact on linear fields, and the mean of the cut's and its image's. */
static void SymmetricDivergenceIsItsOwnImage(void **state)
{
  int    place[3], node[3], opposite[3];
  double row[3][125], image[3][125], cut[3][125], other[3][125];

  for (int p = 0; p < 27; p++) {
    GetPlace(p, place, node);
    for (int d = 0; d < 3; d++) opposite[d] = d == 1 ? 2 - place[d] : place[d];
    DLMKuhnDivergence(place, 1, row);
    DLMKuhnDivergence(opposite, 1, image);
    DLMKuhnDivergence(place, 0, cut);
    DLMKuhnDivergence(opposite, 0, other);
    for (int j = 0; j < 3; j++)
      for (int o = 0; o < 125; o++) {
        const int    x = o % 5, y = o / 5 % 5, z = o / 25, m = x + 5 * (4 - y) + 25 * z;
        const double sign = j == 1 ? -1.0 : 1.0;
        AssertNear(row[j][o], sign * image[j][m], 1e-15);
        AssertNear(row[j][o], 0.5 * (cut[j][o] + sign * other[j][m]), 1e-15);
      }
  }
}

/* Least eigenvalue of B A^-1 B^T against the pressure mass over mu in a periodic box of n^3 pressure cells, by its symbol (docs/theory.md, G6). */
static double LeastEigenvalue(int n, int symmetric)
{
  const int inner[3] = { DLM_INNER, DLM_INNER, DLM_INNER };
  double    row[3][125], mass[27], least = 1e300;

  DLMKuhnDivergence(inner, symmetric, row);
  DLMKuhnMass(inner, mass);
  for (int k = 1; k < n * n * n; k++) {
    const int mode[3] = { k % n, k / n % n, k / n / n };
    double    schur = 0.0, weight = 0.0;
    for (int alias = 0; alias < 8; alias++) {
      double theta[3], stiffness = 6.0, b[3][2] = { { 0.0 } };
      for (int d = 0; d < 3; d++) {
        theta[d] = M_PI * (mode[d] + n * ((alias >> d) & 1)) / n;
        stiffness -= 2.0 * cos(theta[d]);
      }
      for (int o = 0; o < 125; o++) {
        const double phase = theta[0] * (o % 5 - 2) + theta[1] * (o / 5 % 5 - 2) + theta[2] * (o / 25 - 2);
        for (int j = 0; j < 3; j++) {
          b[j][0] += row[j][o] * cos(phase);
          b[j][1] += row[j][o] * sin(phase);
        }
      }
      for (int j = 0; j < 3; j++) schur += (b[j][0] * b[j][0] + b[j][1] * b[j][1]) / (8.0 * stiffness);
    }
    for (int o = 0; o < 27; o++) weight += 8.0 * mass[o] * cos(2.0 * M_PI / n * (mode[0] * (o % 3 - 1) + mode[1] * (o / 3 % 3 - 1) + mode[2] * (o / 9 - 1)));
    least = fmin(least, schur / weight);
  }
  return least;
}

static void ThePressureIsStable(void **state)
{
  for (int symmetric = 0; symmetric < 2; symmetric++) {
    const double coarse = LeastEigenvalue(8, symmetric), fine = LeastEigenvalue(16, symmetric);
    print_message("%s: least eigenvalue %.4f and %.4f\n", symmetric ? "symmetric" : "Kuhn's cut", coarse, fine);
    assert_true(coarse > 0.3 && fine > 0.3);
    AssertNear(fine / coarse, 1.0, 0.1);
  }
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(CubeListsTheSixTetrahedra),
  cmocka_unit_test(RowsEqualQuadrature),
  cmocka_unit_test(DivergenceIsTransferredDerivative),
  cmocka_unit_test(SymmetricDivergenceIsItsOwnImage),
  cmocka_unit_test(ThePressureIsStable),
  cmocka_unit_test(StiffnessIsSevenPoint),
  cmocka_unit_test(LinearFieldsAreExact),
  cmocka_unit_test(TransferIsTheCoarseBasis),
  cmocka_unit_test(InterpolationIsTheBasis),
};

int main(void)
{
  return cmocka_run_group_tests(tests, Assemble, NULL);
}
