#include "../../include/private/polymerimpl.h"

PetscErrorCode DLMPolymerVisitNear(DLMPolymer p, const DLMNearFlow *flow, PetscReal reach, DLMNearVisit visit, void *context)
{
  const DLMPolymerBlock *b      = &p->block;
  const PetscReal       *period = p->scene->box_size;
  DLMSphereState        *state;
  DLMNearNode            node;
  PetscInt               n, *i = node.i;

  PetscFunctionBegin;
  PetscCall(DLMSpheresGetStates(p->spheres, &n, &state));
  for (node.sphere = 0; node.sphere < n; node.sphere++) {
    const PetscReal  a = p->scene->spheres[node.sphere].radius, *center = flow ? flow[node.sphere].center : state[node.sphere].center;
    PetscReal        square[3] = { 0.0 }; /* of the distance along x3; x2 and x3; all */
    for (i[2] = 0; i[2] < b->ghost_width[2]; i[2]++)
      for (i[1] = 0; i[1] < b->ghost_width[1]; i[1]++)
        for (i[0] = 0; i[0] < b->ghost_width[0]; i[0]++) {
          for (int d = i[0] ? 0 : 2; d >= 0; d--) {
            PetscReal x = p->grid->lower[d] + p->grid->h * (b->ghost_start[d] + i[d]) - center[d];
            if (p->grid->periodic[d]) x -= period[d] * PetscFloorReal(0.5 + x / period[d]);
            node.x[d] = x;
            square[d] = x * x + (d < 2 ? square[d + 1] : 0.0);
          }
          if (square[1] >= (a + reach) * (a + reach)) break; /* the whole line is too far */
          node.distance = PetscSqrtReal(square[0]) - a;
          if (node.distance < reach) PetscCall(visit(p, &node, context));
        }
  }
  PetscFunctionReturn(0);
}

/*
  Fluid part of a node near a sphere (docs/theory.md, V7): 1/2 + y/h - stress_offset between 0 and 1, y its distance from the surface. The extra stress
  counts with this part; force and gradient stay adjoint under the masses that it leaves.
*/
static PetscErrorCode AddPart(DLMPolymer p, const DLMNearNode *node, void *context)
{
  PetscInt own;

  PetscFunctionBegin;
  if (!DLMPolymerOwnedIndex(p, node->i, &own)) PetscFunctionReturn(0);
  if (p->n_parts == p->parts_capacity) {
    p->parts_capacity = 2 * p->parts_capacity + 1024;
    PetscCall(PetscRealloc(p->parts_capacity * sizeof(*p->parts), &p->parts));
  }
  p->parts[p->n_parts++] = (DLMFluidPart){ own, PetscMax(0.0, 0.5 - p->stress_offset + node->distance / p->grid->h) };
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerFindParts(DLMPolymer p)
{
  PetscFunctionBegin;
  p->n_parts = 0;
  if (p->spheres && p->stress_offset > 0.0) PetscCall(DLMPolymerVisitNear(p, NULL, (0.5 + p->stress_offset) * p->grid->h, AddPart, NULL));
  PetscFunctionReturn(0);
}

void DLMPolymerWeighStress(DLMPolymer p, double *const T[6])
{
  for (PetscInt q = 0; q < p->n_parts; q++)
    for (int k = 0; k < 6; k++) T[k][p->parts[q].own] *= p->parts[q].part;
}
