#include "../../include/private/polymerimpl.h"

/*
  How far outside a surface the inside begins. Under the extend rule that is where the stress begins to count (surface.c): C of nodes whose stress counts
  for nothing must not run free.
*/
static PetscReal Rim(DLMPolymer p)
{
  return p->scene->polymer_inside == DLM_INSIDE_EXTEND ? PetscMax(0.0, p->stress_offset - 0.5) * p->grid->h : 0.0;
}

/* 1 in the layer of depth h below the rim, 2 in the next one, 3 deeper; a node in two spheres takes the deeper mark. */
static PetscErrorCode Mark(DLMPolymer p, const DLMNearNode *node, void *context)
{
  char     *mark  = &p->inside[DLMPolymerGhostedIndex(p, node->i)];
  const int layer = 1 + (int)PetscMin(2.0, (Rim(p) - node->distance) / p->grid->h);

  *mark = (char)PetscMax(*mark, layer);
  return 0;
}

/* A tensor field and the layer that is filled, or the least one that is reset. */
typedef struct {
  double *const *T;
  char           layer;
} Layer;

static void ResetVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  const Layer *l = context;

  for (PetscInt x = 0; x < n; x++)
    for (int k = 0; k < 6 && p->inside[ghost + x] >= l->layer; k++) l->T[k][own + x] = k < 3 ? 1.0 : 0.0;
}

/* Every node of a layer takes the mean of its neighbours in the layers outside it: a convex mean, so C stays positive definite. */
static void FillVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  const Layer *l = context;

  for (PetscInt x = 0; x < n && !wall; x++) {
    double sum[6] = { 0.0 }, weight = 0.0;
    if (p->inside[ghost + x] != l->layer) continue;
    for (int e = 0; e < row->n; e++) {
      const long   at = ghost + x + row->offset[e][0] + row->offset[e][1] * p->block.stride[1] + row->offset[e][2] * p->block.stride[2];
      const double w  = 1.0 / (PetscAbsInt(row->offset[e][0]) + PetscAbsInt(row->offset[e][1]) + PetscAbsInt(row->offset[e][2]));
      if (p->inside[at] >= l->layer) continue;
      weight += w;
      for (int k = 0; k < 6; k++) sum[k] += w * p->t[k][at];
    }
    for (int k = 0; k < 6 && weight > 0.0; k++) l->T[k][own + x] = sum[k] / weight;
  }
}

/* Continues C into the two layers below the surfaces. */
static PetscErrorCode Extend(DLMPolymer p)
{
  PetscFunctionBegin;
  for (char layer = 1; layer <= 2; layer++) {
    PetscCall(DLMPolymerExchange(p, p->c, p->t));
    DLMPolymerLines(p, FillVisit, &(Layer){ p->c, layer });
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerSetInside(DLMPolymer p)
{
  const DLMInside rule = p->scene->polymer_inside;

  PetscFunctionBeginUser;
  PetscCall(DLMPolymerFindParts(p));
  PetscCall(DLMPolymerPinNear(p));
  if (!p->spheres || (rule != DLM_INSIDE_IDENTITY && rule != DLM_INSIDE_EXTEND)) PetscFunctionReturn(0);
  PetscCall(PetscArrayzero(p->inside, p->block.n_ghosted));
  PetscCall(DLMPolymerVisitNear(p, NULL, Rim(p), Mark, NULL));
  PetscCall(DLMPolymerCheckOut(p));
  DLMPolymerLines(p, ResetVisit, &(Layer){ p->c, rule == DLM_INSIDE_IDENTITY ? 1 : 3 });
  if (rule == DLM_INSIDE_EXTEND) PetscCall(Extend(p));
  PetscCall(DLMPolymerCheckIn(p));
  PetscFunctionReturn(0);
}
