#include "../../include/private/polymerimpl.h"

PetscErrorCode DLMPolymerVisitNear(DLMPolymer p, PetscReal reach, DLMNearVisit visit)
{
  const DLMPolymerBlock *b      = &p->block;
  const PetscReal       *period = p->scene->box_size;
  DLMSphereState        *state;
  PetscInt               n, i[3];

  PetscFunctionBegin;
  PetscCall(DLMSpheresGetStates(p->spheres, &n, &state));
  for (PetscInt s = 0; s < n; s++) {
    const PetscReal a = p->scene->spheres[s].radius;
    PetscReal       square[3] = { 0.0 }; /* of the distance along x3; x2 and x3; all */
    for (i[2] = 0; i[2] < b->ghost_width[2]; i[2]++)
      for (i[1] = 0; i[1] < b->ghost_width[1]; i[1]++)
        for (i[0] = 0; i[0] < b->ghost_width[0]; i[0]++) {
          for (int d = i[0] ? 0 : 2; d >= 0; d--) {
            PetscReal x = p->grid->lower[d] + p->grid->h * (b->ghost_start[d] + i[d]) - state[s].center[d];
            if (p->grid->periodic[d]) x -= period[d] * PetscFloorReal(0.5 + x / period[d]);
            square[d] = x * x + (d < 2 ? square[d + 1] : 0.0);
          }
          if (square[1] >= (a + reach) * (a + reach)) break; /* the whole line is too far */
          if (square[0] < (a + reach) * (a + reach)) PetscCall(visit(p, s, i, PetscSqrtReal(square[0]) - a));
        }
  }
  PetscFunctionReturn(0);
}

/*
  Fluid part of a node near a sphere (docs/theory.md, V7): 1/2 + y/h - stress_offset between 0 and 1, y its distance from the surface. The extra stress
  counts with this part; force and gradient stay adjoint under the masses that it leaves. The kink of the velocity at the surface is smeared over about a
  mesh width, so stresses that are quadratic in the gradient have a radius of their own, as drag and torque have.
*/
static PetscErrorCode AddNear(DLMPolymer p, PetscInt sphere, const PetscInt i[3], PetscReal distance)
{
  PetscInt own;

  PetscFunctionBegin;
  if (!DLMPolymerOwnedIndex(p, i, &own)) PetscFunctionReturn(0);
  if (p->n_near == p->near_capacity) {
    p->near_capacity = 2 * p->near_capacity + 1024;
    PetscCall(PetscRealloc(p->near_capacity * sizeof(*p->near), &p->near));
  }
  p->near[p->n_near++] = (DLMNearNode){ own, PetscMax(0.0, 0.5 - p->stress_offset + distance / p->grid->h) };
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerFindNear(DLMPolymer p)
{
  PetscFunctionBegin;
  p->n_near = 0;
  if (p->spheres && p->stress_offset > 0.0) PetscCall(DLMPolymerVisitNear(p, (0.5 + p->stress_offset) * p->grid->h, AddNear));
  PetscFunctionReturn(0);
}

void DLMPolymerWeighStress(DLMPolymer p, double *const T[6])
{
  for (PetscInt q = 0; q < p->n_near; q++)
    for (int k = 0; k < 6; k++) T[k][p->near[q].own] *= p->near[q].part;
}
