/*
  Overlapping spheres, in time O(N): the spheres are entered one by one into the cells that their bounding boxes
  touch and compared with those already there. Cells are no narrower than the smallest diameter, so a cell meets
  only a few spheres that do not overlap, and large spheres among small ones cost no more than the cells they
  cover.
*/
#include "sceneimpl.h"
#include <math.h>

typedef struct {
  PetscInt sphere, next; /* next: another entry of the cell, or -1 */
} Entry;

typedef struct {
  PetscInt  n[3];
  PetscInt *first; /* first entry of each cell, or -1 */
  Entry    *entries;
  PetscInt  n_entries, room;
} CellList;

static PetscErrorCode CellListCreate(const DLMScene *scene, CellList *list)
{
  const PetscReal *size = scene->box_size;
  PetscReal        width = PETSC_MAX_REAL;
  PetscInt         n_cells;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(list, sizeof(*list)));
  for (PetscInt i = 0; i < scene->n_spheres; i++) width = PetscMin(width, 2 * scene->spheres[i].radius);
  width = PetscMax(width, cbrt(size[0] * size[1] * size[2] / (4.0 * scene->n_spheres + 64)));
  for (int d = 0; d < 3; d++) list->n[d] = PetscMax(1, (PetscInt)(size[d] / width));
  n_cells = list->n[0] * list->n[1] * list->n[2]; /* below the number of nodes: no overflow */
  PetscCall(PetscMalloc1(n_cells, &list->first));
  for (PetscInt c = 0; c < n_cells; c++) list->first[c] = -1;
  PetscFunctionReturn(0);
}

static PetscErrorCode CellListDestroy(CellList *list)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(list->first));
  free(list->entries);
  PetscFunctionReturn(0);
}

static PetscErrorCode CellListAdd(CellList *list, PetscInt cell, PetscInt sphere)
{
  PetscFunctionBeginUser;
  if (list->n_entries == list->room) {
    PetscInt room = 2 * list->room + 64;
    Entry   *entries = realloc(list->entries, (size_t)room * sizeof(*entries));

    PetscCheck(entries, PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory to compare the spheres");
    list->entries = entries;
    list->room = room;
  }
  list->entries[list->n_entries] = (Entry){sphere, list->first[cell]};
  list->first[cell] = list->n_entries++;
  PetscFunctionReturn(0);
}

/* The cells that the sphere's bounding box touches along axis d: first, and how many (the box wraps on a
 * periodic axis). */
static void CellRange(const DLMScene *scene, const CellList *list, PetscInt i, int d, PetscInt *first,
                      PetscInt *count)
{
  const DLMSphereSpec *s = &scene->spheres[i];
  const PetscReal      width = scene->box_size[d] / list->n[d], middle = s->center[d] + scene->box_size[d] / 2;
  const PetscInt       n = list->n[d], last = (PetscInt)floor((middle + s->radius) / width);

  *first = (PetscInt)floor((middle - s->radius) / width);
  *count = PetscMin(last - *first + 1, n);
  if (scene->box_periodic[d]) {
    *first = (*first + n) % n; /* the bounding box starts at most one period below the box */
  } else {
    *first = PetscMax(0, PetscMin(*first, n - 1));
    *count = PetscMin(last, n - 1) - *first + 1;
  }
}

/* The distance of two centres; nearest images on periodic axes. */
static PetscReal Distance(const DLMScene *scene, const PetscReal a[3], const PetscReal b[3], PetscBool *across)
{
  PetscReal square = 0;

  *across = PETSC_FALSE;
  for (int d = 0; d < 3; d++) {
    PetscReal x = b[d] - a[d], period = scene->box_size[d];

    if (scene->box_periodic[d] && fabs(x) > period / 2) {
      x -= copysign(period, x);
      *across = PETSC_TRUE;
    }
    square += PetscSqr(x);
  }
  return sqrt(square);
}

static PetscErrorCode ComparePair(const DLMScene *scene, PetscInt i, PetscInt j)
{
  const DLMSphereSpec *s = &scene->spheres[i], *t = &scene->spheres[j];
  const PetscReal     *x = s->center, *y = t->center, sum = s->radius + t->radius;
  const PetscReal      longest = PetscMax(scene->box_size[0], PetscMax(scene->box_size[1], scene->box_size[2]));
  PetscBool            across;
  char                 first[DLM_SPHERE_NAME], second[DLM_SPHERE_NAME];
  const PetscReal      gap = Distance(scene, x, y, &across) - sum;

  PetscFunctionBeginUser;
  DLMUserCheck(gap >= -(1e-12 * sum + 4 * PETSC_MACHINE_EPSILON * longest), scene->comm,
               "%s at %.6g,%.6g,%.6g and %s at %.6g,%.6g,%.6g overlap%s, gap %.6g; allowed: a gap >= 0",
               DLMSphereName(scene, i, first), x[0], x[1], x[2], DLMSphereName(scene, j, second), y[0], y[1], y[2], across ? " through a periodic face" : "", gap);
  PetscFunctionReturn(0);
}

static PetscErrorCode CompareAndAdd(const DLMScene *scene, CellList *list, PetscInt i)
{
  PetscInt first[3], count[3];

  PetscFunctionBeginUser;
  for (int d = 0; d < 3; d++) CellRange(scene, list, i, d, &first[d], &count[d]);
  for (PetscInt c3 = 0; c3 < count[2]; c3++) {
    for (PetscInt c2 = 0; c2 < count[1]; c2++) {
      for (PetscInt c1 = 0; c1 < count[0]; c1++) {
        PetscInt k1 = (first[0] + c1) % list->n[0], k2 = (first[1] + c2) % list->n[1],
                 k3 = (first[2] + c3) % list->n[2];
        PetscInt cell = k1 + list->n[0] * (k2 + list->n[1] * k3);

        for (PetscInt e = list->first[cell]; e >= 0; e = list->entries[e].next) {
          PetscCall(ComparePair(scene, list->entries[e].sphere, i));
        }
        PetscCall(CellListAdd(list, cell, i));
      }
    }
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSceneCheckOverlap(const DLMScene *scene)
{
  CellList list;

  PetscFunctionBeginUser;
  if (scene->n_spheres < 2) PetscFunctionReturn(0);
  PetscCall(CellListCreate(scene, &list));
  for (PetscInt i = 0; i < scene->n_spheres; i++) PetscCall(CompareAndAdd(scene, &list, i));
  PetscCall(CellListDestroy(&list));
  PetscFunctionReturn(0);
}
