#include "../../include/dlmlubrication.h"
#include "../../include/private/spheresimpl.h"

PetscBool DLMBodiesCanMeet(const DLMScene *scene)
{
  PetscBool walls = PETSC_FALSE, moving = PETSC_FALSE;

  for (int d = 0; d < 3; d++) walls = (PetscBool)(walls || !scene->box_periodic[d]);
  for (PetscInt i = 0; i < scene->n_spheres; i++) moving = (PetscBool)(moving || scene->spheres[i].motion == DLM_MOTION_FREE);
  return (PetscBool)(moving && (walls || scene->n_spheres > 1));
}

/* auto: where the friction is known, in Newtonian fluid, and what the mesh resolves of it is measured, for the default cover. */
static PetscErrorCode Choose(const DLMScene *scene, PetscBool *chosen)
{
  DLMCover cover = { .degree = 0 };

  PetscFunctionBegin;
  if (scene->n_spheres) PetscCall(DLMPairingGetCover(scene, scene->spheres[0].radius, &cover));
  *chosen = (PetscBool)(scene->fluid_model == DLM_FLUID_NEWTONIAN && scene->pairing_type == DLM_PAIRING_IMMERSED &&
                        scene->pairing_points == DLM_POINTS_SURFACE && cover.degree > 0 && DLMBodiesCanMeet(scene));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMLubricationCreate(const DLMScene *scene, DLMLubrication *lubrication)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(lubrication, sizeof(*lubrication)));
  lubrication->range  = scene->lubrication_range;
  lubrication->exists = (PetscBool)(scene->lubrication == DLM_LUBRICATION_TRUE && scene->n_spheres > 0);
  if (scene->lubrication == DLM_LUBRICATION_AUTO) PetscCall(Choose(scene, &lubrication->exists));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMLubricationDestroy(DLMLubrication *lubrication)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(lubrication->gaps));
  PetscCall(PetscMemzero(lubrication, sizeof(*lubrication)));
  PetscFunctionReturn(0);
}

/* The gap shares out its width by the radii, so that a rigid motion of the two has no relative velocity there. */
static PetscErrorCode AddPair(DLMLubrication *lubrication, DLMSpheres spheres, PetscInt i, PetscInt j)
{
  DLMGap         *gap = &lubrication->gaps[lubrication->n];
  const DLMScene *scene = spheres->scene;
  const PetscReal a = scene->spheres[i].radius, b = scene->spheres[j].radius;
  PetscReal       distance, d[3];

  PetscFunctionBegin;
  PetscCall(DLMSpheresSeparation(spheres, i, j, d));
  distance = PetscSqrtReal(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  *gap     = (DLMGap){ .i = i, .j = j, .width = distance - a - b, .arm = { distance * a / (a + b), distance * b / (a + b) } };
  for (int c = 0; c < 3; c++) gap->e[c] = d[c] / distance;
  DLMGapSetFriction(scene->fluid_viscosity, a, b, 0.5 * lubrication->range * (a + b), gap);
  lubrication->n += gap->normal > 0.0;
  PetscFunctionReturn(0);
}

/* The gap between sphere i and the lower (0) or upper (1) wall of axis d. */
static void AddWall(DLMLubrication *lubrication, DLMSpheres spheres, PetscInt i, int d, int side)
{
  const DLMScene *scene = spheres->scene;
  DLMGrid         grid = spheres->grid;
  DLMGap         *gap = &lubrication->gaps[lubrication->n];
  const PetscReal a = scene->spheres[i].radius, x = spheres->state[i].center[d] - grid->lower[d];

  *gap      = (DLMGap){ .i = i, .j = -1, .width = (side ? grid->cells[d] * grid->h - x : x) - a, .arm = { a, 0.0 } };
  gap->e[d] = side ? 1.0 : -1.0;
  for (int c = 0; c < 3; c++) gap->wall[c] = scene->wall_velocity[d][side][c];
  DLMGapSetFriction(scene->fluid_viscosity, a, 0.0, 0.5 * lubrication->range * a, gap);
  lubrication->n += gap->normal > 0.0;
}

PetscErrorCode DLMLubricationUpdate(DLMLubrication *lubrication, DLMSpheres spheres)
{
  PetscReal radius = 0.0;
  PetscInt  n_pairs, *pairs;

  PetscFunctionBeginUser;
  lubrication->n = 0;
  if (!lubrication->exists) PetscFunctionReturn(0);
  for (PetscInt i = 0; i < spheres->n; i++) radius = PetscMax(radius, spheres->scene->spheres[i].radius);
  PetscCall(DLMSpheresFindPairs(spheres, lubrication->range * radius, &n_pairs, &pairs));
  PetscCall(PetscRealloc((n_pairs + 6 * spheres->n) * sizeof(DLMGap), &lubrication->gaps));
  for (PetscInt k = 0; k < n_pairs; k++) PetscCall(AddPair(lubrication, spheres, pairs[2 * k], pairs[2 * k + 1]));
  for (PetscInt i = 0; i < spheres->n; i++)
    for (int d = 0; d < 3; d++)
      for (int side = 0; side < 2 && !spheres->grid->periodic[d]; side++) AddWall(lubrication, spheres, i, d, side);
  PetscCall(PetscFree(pairs));
  PetscFunctionReturn(0);
}
