#include "../../include/private/kuhn.h"
#include <string.h>

void DLMKuhnCubeFill(DLMKuhnCube *cube)
{
  static const int permutation[6][3] = { { 0, 1, 2 }, { 0, 2, 1 }, { 1, 0, 2 }, { 1, 2, 0 }, { 2, 0, 1 }, { 2, 1, 0 } };

  memset(cube, 0, sizeof(*cube));
  for (int t = 0; t < 6; t++) {
    for (int k = 0; k < 3; k++) {
      cube->axis[t][k] = permutation[t][k];
      for (int d = 0; d < 3; d++) cube->vertex[t][k + 1][d] = cube->vertex[t][k][d];
      cube->vertex[t][k + 1][permutation[t][k]] = 1;
    }
  }
}

/* Gradient of the basis function of each path corner; times 1/h. */
static void PathGradients(const DLMKuhnCube *cube, int t, double gradient[4][3])
{
  memset(gradient, 0, 12 * sizeof(double));
  for (int k = 0; k < 3; k++) {
    gradient[k][cube->axis[t][k]] -= 1.0;
    gradient[k + 1][cube->axis[t][k]] += 1.0;
  }
}

/* Element integral of a pair of corners (a, b) on one tetrahedron of the unit cube. */
typedef double (*PairIntegral)(int a, int b, const double gradient[4][3], int j);

static double DerivativePair(int a, int b, const double gradient[4][3], int j)
{
  return gradient[b][j] / 24.0;
}

static double StiffnessPair(int a, int b, const double gradient[4][3], int j)
{
  double sum = 0.0;
  for (int d = 0; d < 3; d++) sum += gradient[a][d] * gradient[b][d];
  return sum / 6.0;
}

static double MassPair(int a, int b, const double gradient[4][3], int j)
{
  return a == b ? 1.0 / 60.0 : 1.0 / 120.0;
}

static int CellExists(const int cell[3], const int place[3])
{
  for (int d = 0; d < 3; d++)
    if ((place[d] == DLM_LOWER && cell[d] < 0) || (place[d] == DLM_UPPER && cell[d] == 0)) return 0;
  return 1;
}

/* Sums an element integral over the tetrahedra that meet in the node. */
static void AssembleRow(PairIntegral integral, int j, const int place[3], double row[27])
{
  DLMKuhnCube cube;
  double      gradient[4][3];

  DLMKuhnCubeFill(&cube);
  memset(row, 0, 27 * sizeof(double));
  for (int c = 0; c < 8; c++) {
    const int cell[3] = { -(c & 1), -((c >> 1) & 1), -((c >> 2) & 1) };
    if (!CellExists(cell, place)) continue;
    for (int t = 0; t < 6; t++) {
      PathGradients(&cube, t, gradient);
      for (int a = 0; a < 4; a++) {
        const int *va = cube.vertex[t][a];
        if (va[0] + cell[0] || va[1] + cell[1] || va[2] + cell[2]) continue;
        for (int b = 0; b < 4; b++) {
          const int *vb = cube.vertex[t][b];
          row[(vb[0] + cell[0] + 1) + 3 * (vb[1] + cell[1] + 1) + 9 * (vb[2] + cell[2] + 1)] += integral(a, b, gradient, j);
        }
      }
    }
  }
}

void DLMKuhnDerivative(int j, const int place[3], double row[27])
{
  AssembleRow(DerivativePair, j, place, row);
}

void DLMKuhnStiffness(const int place[3], double row[27])
{
  AssembleRow(StiffnessPair, 0, place, row);
}

void DLMKuhnMass(const int place[3], double row[27])
{
  AssembleRow(MassPair, 0, place, row);
}

double DLMKuhnLumpedMass(const int place[3])
{
  double row[27], sum = 0.0;

  DLMKuhnMass(place, row);
  for (int i = 0; i < 27; i++) sum += row[i];
  return sum;
}

double DLMTransferWeight(const int o[3])
{
  int up = 0, down = 0;

  for (int d = 0; d < 3; d++) {
    if (o[d] < -1 || o[d] > 1) return 0.0;
    up |= o[d] > 0;
    down |= o[d] < 0;
  }
  if (up && down) return 0.0;
  return up || down ? 0.5 : 1.0;
}

/* Adds weight * D_j at the fine node at offset b to the divergence row. */
static void AddFineRow(const int b[3], const int place[3], double weight, double row[3][125])
{
  int    fine_place[3];
  double derivative[27];

  for (int d = 0; d < 3; d++) fine_place[d] = b[d] ? DLM_INNER : place[d];
  for (int j = 0; j < 3; j++) {
    DLMKuhnDerivative(j, fine_place, derivative);
    for (int i = 0; i < 27; i++) {
      const int o1 = b[0] + i % 3 - 1, o2 = b[1] + (i / 3) % 3 - 1, o3 = b[2] + i / 9 - 1;
      if (derivative[i] != 0.0) row[j][(o1 + 2) + 5 * (o2 + 2) + 25 * (o3 + 2)] += weight * derivative[i];
    }
  }
}

static void DivergenceOfCut(const int place[3], double row[3][125])
{
  memset(row, 0, 3 * 125 * sizeof(double));
  for (int i = 0; i < 27; i++) {
    const int    b[3]   = { i % 3 - 1, (i / 3) % 3 - 1, i / 9 - 1 };
    const double weight = DLMTransferWeight(b);
    int          exists = weight != 0.0;
    for (int d = 0; d < 3; d++)
      if ((place[d] == DLM_LOWER && b[d] < 0) || (place[d] == DLM_UPPER && b[d] > 0)) exists = 0;
    if (exists) AddFineRow(b, place, weight, row);
  }
}

void DLMKuhnDivergence(const int place[3], int symmetric, double row[3][125])
{
  const int opposite[3] = { place[0], 2 - place[1], place[2] };
  double    image[3][125];

  DivergenceOfCut(place, row);
  if (!symmetric) return;
  DivergenceOfCut(opposite, image);
  for (int j = 0; j < 3; j++)
    for (int i = 0; i < 125; i++) row[j][i] = 0.5 * (row[j][i] + (j == 1 ? -1.0 : 1.0) * image[j][i + 5 * (4 - 2 * ((i / 5) % 5))]);
}

void DLMKuhnInterpolate(const double x[3], double weight[8])
{
  int    order[3] = { 0, 1, 2 }, corner = 0;
  double last = 1.0;

  for (int i = 0; i < 2; i++)
    for (int k = 0; k < 2 - i; k++)
      if (x[order[k]] < x[order[k + 1]]) {
        const int swap = order[k];
        order[k]       = order[k + 1];
        order[k + 1]   = swap;
      }
  memset(weight, 0, 8 * sizeof(double));
  for (int k = 0; k < 3; k++) {
    weight[corner] = last - x[order[k]];
    last           = x[order[k]];
    corner |= 1 << order[k];
  }
  weight[7] = last;
}
