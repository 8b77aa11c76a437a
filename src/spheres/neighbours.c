#include "../../include/private/spheresimpl.h"

/* Spheres sorted into bins at least one interaction length wide. */
typedef struct {
  PetscInt  bins[3];
  PetscInt *first, *sphere; /* spheres of bin b: sphere[first[b]] .. sphere[first[b+1]-1] */
  PetscInt *bin;            /* of each sphere, per axis */
} BinList;

static PetscErrorCode SortIntoBins(DLMSpheres spheres, PetscReal length, BinList *list)
{
  DLMGrid  grid = spheres->grid;
  PetscInt total = 1, most = 1;

  PetscFunctionBegin;
  while ((most + 1) * (most + 1) * (most + 1) <= 8 * spheres->n + 8) most++;
  for (int d = 0; d < 3; d++) {
    list->bins[d] = (PetscInt)PetscMax(1.0, PetscMin((PetscReal)most, PetscFloorReal(grid->cells[d] * grid->h / length)));
    total *= list->bins[d];
  }
  PetscCall(PetscCalloc3(total + 2, &list->first, spheres->n, &list->sphere, 3 * spheres->n, &list->bin));
  for (PetscInt i = 0; i < spheres->n; i++) {
    PetscReal center[3];
    PetscInt *bin = list->bin + 3 * i;
    PetscCall(DLMSpheresGetWrapped(spheres, i, center));
    for (int d = 0; d < 3; d++) {
      bin[d] = (PetscInt)PetscFloorReal((center[d] - grid->lower[d]) / (grid->cells[d] * grid->h) * list->bins[d]);
      bin[d] = PetscMax(0, PetscMin(list->bins[d] - 1, bin[d]));
    }
    list->first[2 + bin[0] + list->bins[0] * (bin[1] + list->bins[1] * bin[2])]++;
  }
  for (PetscInt b = 0; b < total; b++) list->first[b + 2] += list->first[b + 1];
  for (PetscInt i = 0; i < spheres->n; i++) {
    const PetscInt *bin = list->bin + 3 * i;
    list->sphere[list->first[1 + bin[0] + list->bins[0] * (bin[1] + list->bins[1] * bin[2])]++] = i;
  }
  PetscFunctionReturn(0);
}

/* Neighbour of bin b on an axis: each exists once, however few bins there are. */
static PetscBool NeighbourBin(DLMGrid grid, int d, PetscInt bins, PetscInt b, PetscInt shift, PetscInt *neighbour)
{
  *neighbour = b + shift;
  if (!grid->periodic[d]) return (PetscBool)(*neighbour >= 0 && *neighbour < bins);
  if ((bins == 1 && shift != 0) || (bins == 2 && shift < 0)) return PETSC_FALSE;
  *neighbour = (*neighbour + bins) % bins;
  return PETSC_TRUE;
}

static PetscErrorCode AddPairIfNear(DLMSpheres spheres, PetscInt i, PetscInt j, PetscReal gap, PetscInt *n, PetscInt *capacity, PetscInt **pairs)
{
  const PetscReal reach = spheres->scene->spheres[i].radius + spheres->scene->spheres[j].radius + gap;
  PetscReal       d[3];

  PetscFunctionBegin;
  PetscCall(DLMSpheresSeparation(spheres, i, j, d));
  if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] >= reach * reach) PetscFunctionReturn(0);
  if (*n == *capacity) {
    *capacity = 2 * *capacity + 64;
    PetscCall(PetscRealloc(2 * *capacity * sizeof(PetscInt), pairs));
  }
  (*pairs)[2 * *n]       = i;
  (*pairs)[2 * (*n)++ + 1] = j;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSpheresFindPairs(DLMSpheres spheres, PetscReal gap, PetscInt *n, PetscInt **pairs)
{
  DLMGrid   grid     = spheres->grid;
  PetscReal radius   = 0.0;
  PetscInt  capacity = 0;
  BinList   list;

  PetscFunctionBegin;
  *n     = 0;
  *pairs = NULL;
  for (PetscInt i = 0; i < spheres->n; i++) radius = PetscMax(radius, spheres->scene->spheres[i].radius);
  if (spheres->n < 2) PetscFunctionReturn(0);
  PetscCall(SortIntoBins(spheres, 2.0 * radius + gap, &list));
  for (PetscInt i = 0; i < spheres->n; i++)
    for (PetscInt q = 0; q < 27; q++) {
      const PetscInt shift[3] = { q % 3 - 1, (q / 3) % 3 - 1, q / 9 - 1 };
      PetscInt       b[3];
      PetscBool      exists = PETSC_TRUE;
      for (int d = 0; d < 3; d++) exists = (PetscBool)(exists && NeighbourBin(grid, d, list.bins[d], list.bin[3 * i + d], shift[d], &b[d]));
      if (!exists) continue;
      const PetscInt at = b[0] + list.bins[0] * (b[1] + list.bins[1] * b[2]);
      for (PetscInt k = list.first[at]; k < list.first[at + 1]; k++)
        if (list.sphere[k] > i) PetscCall(AddPairIfNear(spheres, i, list.sphere[k], gap, n, &capacity, pairs));
    }
  PetscCall(PetscFree3(list.first, list.sphere, list.bin));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSpheresGetSmallestGap(DLMSpheres spheres, PetscReal *gap)
{
  DLMGrid   grid = spheres->grid;
  PetscReal reach = 0.0;
  PetscInt  n, *pairs;

  PetscFunctionBegin;
  *gap = PETSC_INFINITY;
  for (PetscInt i = 0; i < spheres->n; i++) {
    const PetscReal a = spheres->scene->spheres[i].radius;
    reach             = PetscMax(reach, a);
    for (int d = 0; d < 3; d++) {
      const PetscReal x = spheres->state[i].center[d] - grid->lower[d];
      if (!grid->periodic[d]) *gap = PetscMin(*gap, PetscMin(x, grid->cells[d] * grid->h - x) - a);
    }
  }
  for (n = 0; n == 0 && spheres->n > 1 && reach < 4.0 * grid->h * (grid->cells[0] + grid->cells[1] + grid->cells[2]); reach *= 4.0) {
    PetscCall(DLMSpheresFindPairs(spheres, reach, &n, &pairs));
    for (PetscInt k = 0; k < n; k++) {
      PetscReal d[3];
      PetscCall(DLMSpheresSeparation(spheres, pairs[2 * k], pairs[2 * k + 1], d));
      *gap = PetscMin(*gap, PetscSqrtReal(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - spheres->scene->spheres[pairs[2 * k]].radius -
                              spheres->scene->spheres[pairs[2 * k + 1]].radius);
    }
    PetscCall(PetscFree(pairs));
  }
  PetscFunctionReturn(0);
}
