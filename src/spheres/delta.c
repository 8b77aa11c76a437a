#include "../../include/private/markers.h"
#include <math.h>

double DLMDelta(double r)
{
  const double z = fabs(r);

  if (z >= 2.0) return 0.0;
  if (z <= 1.0) return 0.125 * (3.0 - 2.0 * z + sqrt(1.0 + 4.0 * z - 4.0 * z * z));
  return 0.125 * (5.0 - 2.0 * z - sqrt(fmax(0.0, -7.0 + 12.0 * z - 4.0 * z * z)));
}

static void AddWeight(DLMAxisWeights *axis, int node, double weight)
{
  for (int i = 0; i < axis->n; i++)
    if (axis->node[i] == node) {
      axis->weight[i] += weight;
      return;
    }
  axis->node[axis->n]     = node;
  axis->weight[axis->n++] = weight;
}

void DLMDeltaWeights(double x, int periodic, int cells, DLMAxisWeights *axis)
{
  const int first = (int)floor(x) - 1;

  axis->n = 0;
  for (int k = first; k < first + 4; k++) {
    const double weight = DLMDelta(x - k);
    const int    wall   = k < 0 ? 0 : cells;
    if (weight == 0.0) continue;
    if (periodic || (k >= 0 && k <= cells)) {
      AddWeight(axis, k, weight);
    } else {
      AddWeight(axis, wall, 2.0 * weight);
      AddWeight(axis, 2 * wall - k, -weight);
    }
  }
}
