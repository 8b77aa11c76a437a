#include "../../include/private/polymerimpl.h"

/*
  Marks ghosted nodes inside the spheres: 1 in the layer of depth h below the surface, 2 in the next one, 3 deeper; 0 outside. Under the extend rule the surface is
  where the stress begins to count (surface.c): C of nodes whose stress counts for nothing must not run free. A node in two spheres takes the deeper mark.
*/
static PetscErrorCode MarkInside(DLMPolymer p)
{
  const DLMPolymerBlock *b = &p->block;
  const PetscReal        h = p->grid->h;
  DLMSphereState        *state;
  PetscInt               n;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(p->inside, b->n_ghosted));
  PetscCall(DLMSpheresGetStates(p->spheres, &n, &state));
  for (PetscInt s = 0; s < n; s++) {
    const PetscReal a = p->scene->spheres[s].radius + (p->scene->polymer_inside == DLM_INSIDE_EXTEND && p->stress_offset > 0.5 ? (p->stress_offset - 0.5) * h : 0.0);
    for (PetscInt k = 0; k < b->ghost_width[2]; k++)
      for (PetscInt j = 0; j < b->ghost_width[1]; j++) {
        const PetscInt node[3] = { b->ghost_start[0], b->ghost_start[1] + j, b->ghost_start[2] + k };
        PetscReal      x[3];
        for (int d = 0; d < 3; d++) {
          x[d] = p->grid->lower[d] + h * node[d] - state[s].center[d];
          if (p->grid->periodic[d] && d > 0) x[d] -= p->scene->box_size[d] * PetscFloorReal(0.5 + x[d] / p->scene->box_size[d]);
        }
        if (x[1] * x[1] + x[2] * x[2] >= a * a) continue;
        for (PetscInt i = 0; i < b->ghost_width[0]; i++) {
          PetscReal y = x[0] + h * i, depth;
          if (p->grid->periodic[0]) y -= p->scene->box_size[0] * PetscFloorReal(0.5 + y / p->scene->box_size[0]);
          depth = a - PetscSqrtReal(y * y + x[1] * x[1] + x[2] * x[2]);
          if (depth <= 0.0) continue;
          char *mark = &p->inside[i + b->stride[1] * j + b->stride[2] * k];
          *mark      = (char)PetscMax(*mark, (int)PetscMin(3.0, 1.0 + PetscFloorReal(depth / h)));
        }
      }
  }
  PetscFunctionReturn(0);
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
    PetscCall(DLMPolymerExchange(p, 6, p->c, p->t));
    DLMPolymerLines(p, FillVisit, &(Layer){ p->c, layer });
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerSetInside(DLMPolymer p)
{
  const DLMInside rule = p->scene->polymer_inside;

  PetscFunctionBeginUser;
  PetscCall(DLMPolymerFindNear(p));
  if (!p->spheres || rule == DLM_INSIDE_EVOLVE) PetscFunctionReturn(0);
  PetscCall(MarkInside(p));
  PetscCall(DLMPolymerCheckOut(p));
  DLMPolymerLines(p, ResetVisit, &(Layer){ p->c, rule == DLM_INSIDE_IDENTITY ? 1 : 3 });
  if (rule == DLM_INSIDE_EXTEND) PetscCall(Extend(p));
  PetscCall(DLMPolymerCheckIn(p));
  PetscFunctionReturn(0);
}
