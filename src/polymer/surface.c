#include "../../include/private/polymerimpl.h"

/*
  Fluid part of a node near a sphere (docs/theory.md, V7): 1/2 + y/h - stress_offset between 0 and 1, y its distance from the surface. The extra stress
  counts with this part; force and gradient stay adjoint under the masses that it leaves. The kink of the velocity at the surface is smeared over about a
  mesh width, so stresses that are quadratic in the gradient have a radius of their own, as drag and torque have.
*/
static void AddLine(DLMPolymer p, PetscReal x, PetscReal rest, PetscReal a, PetscInt own)
{
  const PetscReal h = p->grid->h, offset = p->stress_offset;

  for (PetscInt i = 0; i < p->block.width[0]; i++) {
    PetscReal y = x + h * i, part;
    if (p->grid->periodic[0]) y -= p->scene->box_size[0] * PetscFloorReal(0.5 + y / p->scene->box_size[0]);
    part = 0.5 - offset + (PetscSqrtReal(y * y + rest) - a) / h;
    if (part >= 1.0) continue;
    if (p->n_near == p->near_capacity) {
      p->near_capacity = 2 * p->near_capacity + 1024;
      p->near          = realloc(p->near, (size_t)p->near_capacity * sizeof(*p->near));
    }
    p->near[p->n_near++] = (DLMNearNode){ own + i, PetscMax(0.0, part) };
  }
}

PetscErrorCode DLMPolymerFindNear(DLMPolymer p)
{
  const DLMPolymerBlock *b = &p->block;
  const PetscReal        h = p->grid->h;
  DLMSphereState        *state;
  PetscInt               n;

  PetscFunctionBegin;
  p->n_near = 0;
  if (!p->spheres || p->stress_offset == 0.0) PetscFunctionReturn(0);
  PetscCall(DLMSpheresGetStates(p->spheres, &n, &state));
  for (PetscInt s = 0; s < n; s++) {
    const PetscReal a = p->scene->spheres[s].radius, reach = a + (0.5 + p->stress_offset) * h;
    for (PetscInt k = 0; k < b->width[2]; k++)
      for (PetscInt j = 0; j < b->width[1]; j++) {
        const PetscInt node[3] = { b->start[0], b->start[1] + j, b->start[2] + k };
        PetscReal      x[3];
        for (int d = 0; d < 3; d++) {
          x[d] = p->grid->lower[d] + h * node[d] - state[s].center[d];
          if (p->grid->periodic[d] && d > 0) x[d] -= p->scene->box_size[d] * PetscFloorReal(0.5 + x[d] / p->scene->box_size[d]);
        }
        const PetscReal rest = x[1] * x[1] + x[2] * x[2];
        if (rest < reach * reach) AddLine(p, x[0], rest, a, b->width[0] * (j + b->width[1] * k));
      }
  }
  PetscFunctionReturn(0);
}

void DLMPolymerWeighStress(DLMPolymer p, double *const T[6])
{
  for (PetscInt q = 0; q < p->n_near; q++)
    for (int k = 0; k < 6; k++) T[k][p->near[q].own] *= p->near[q].part;
}
