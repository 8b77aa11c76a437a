#include "../../include/dlmlubrication.h"
#include "../../include/private/spheresimpl.h"

PetscBool DLMBodiesCanMeet(const DLMScene *scene)
{
  PetscBool walls = PETSC_FALSE, moving = PETSC_FALSE;

  for (int d = 0; d < 3; d++) walls = (PetscBool)(walls || !scene->box_periodic[d]);
  for (PetscInt i = 0; i < scene->n_spheres; i++) {
    const DLMSphereSpec *s   = &scene->spheres[i];
    const PetscBool      led = (PetscBool)(s->motion == DLM_MOTION_FIXED && (s->velocity[0] != 0.0 || s->velocity[1] != 0.0 || s->velocity[2] != 0.0));
    moving                   = (PetscBool)(moving || led || s->motion == DLM_MOTION_FREE);
  }
  return (PetscBool)(moving && (walls || scene->n_spheres > 1));
}

/* The narrowest gap of the scene's sphere i to a wall or to a sphere after it, over what the range is counted in. */
static PetscReal NarrowestFrom(const DLMScene *scene, PetscInt i)
{
  const DLMSphereSpec *s = &scene->spheres[i];
  PetscReal            narrowest = PETSC_INFINITY;

  for (int d = 0; d < 3; d++)
    if (!scene->box_periodic[d]) narrowest = PetscMin(narrowest, (0.5 * scene->box_size[d] - PetscAbsReal(s->center[d]) - s->radius) / (0.5 * s->radius));
  for (PetscInt j = i + 1; j < scene->n_spheres; j++) {
    const DLMSphereSpec *other = &scene->spheres[j];
    PetscReal            square = 0.0;
    for (int d = 0; d < 3; d++) {
      const PetscReal x = other->center[d] - s->center[d], L = scene->box_size[d];
      square += PetscSqr(scene->box_periodic[d] ? x - L * PetscFloorReal(x / L + 0.5) : x);
    }
    narrowest = PetscMin(narrowest, (PetscSqrtReal(square) - s->radius - other->radius) / (0.5 * (s->radius + other->radius)));
  }
  return narrowest;
}

/* Spheres that stay where they are turn, or hold against the flow, in the gaps that they have. */
static PetscBool HasNarrowGap(const DLMScene *scene)
{
  for (PetscInt i = 0; i < scene->n_spheres; i++)
    if (NarrowestFrom(scene, i) < scene->lubrication_range) return PETSC_TRUE;
  return PETSC_FALSE;
}

/* auto: where the friction is known, in Newtonian fluid, and what the mesh resolves of it is measured, for the default cover. NULL: there it is. */
static PetscErrorCode WhyNone(const DLMScene *scene, const char **absent)
{
  DLMCover cover = { .degree = 0 };

  PetscFunctionBegin;
  *absent = NULL;
  if (scene->n_spheres) PetscCall(DLMPairingGetCover(scene, scene->spheres[0].radius, &cover));
  if (!scene->n_spheres) *absent = "the scene has no spheres";
  else if (scene->lubrication == DLM_LUBRICATION_FALSE) *absent = "-lubrication false";
  else if (scene->lubrication == DLM_LUBRICATION_TRUE) *absent = NULL;
  else if (scene->fluid_model != DLM_FLUID_NEWTONIAN) *absent = "-lubrication auto: the friction of a gap is known for Newtonian fluid only";
  else if (scene->pairing_type != DLM_PAIRING_IMMERSED || scene->pairing_points != DLM_POINTS_SURFACE || cover.degree == 0)
    *absent = "-lubrication auto: what the mesh misses is measured for the default cover only";
  else if (!DLMBodiesCanMeet(scene) && !HasNarrowGap(scene)) *absent = "no two bodies are close, or can come close";
  PetscFunctionReturn(0);
}

PetscErrorCode DLMLubricationCreate(const DLMScene *scene, DLMLubrication *lubrication)
{
  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(lubrication, sizeof(*lubrication)));
  lubrication->range = scene->lubrication_range;
  PetscCall(WhyNone(scene, &lubrication->absent));
  lubrication->exists = (PetscBool)!lubrication->absent;
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
  DLMGapSetFriction(scene->fluid_viscosity, scene->h, a, b, 0.5 * lubrication->range * (a + b), gap);
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
  DLMGapSetFriction(scene->fluid_viscosity, scene->h, a, 0.0, 0.5 * lubrication->range * a, gap);
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

/* Width of a gap between centres x and, for a pair, y; d: the vector from x to y. */
static PetscReal Width(DLMSpheres spheres, const DLMGap *gap, const PetscReal x[3], const PetscReal y[3], PetscReal d[3])
{
  const DLMScene *scene = spheres->scene;
  DLMGrid         grid = spheres->grid;
  PetscReal       square = 0.0;

  if (gap->j < 0) {
    PetscReal width = -scene->spheres[gap->i].radius;
    for (int c = 0; c < 3; c++) {
      d[c] = gap->e[c];
      if (d[c] != 0.0) width += d[c] > 0.0 ? grid->lower[c] + grid->cells[c] * grid->h - x[c] : x[c] - grid->lower[c];
    }
    return width;
  }
  for (int c = 0; c < 3; c++) {
    const PetscReal length = DLMGridPeriod(grid, c);
    d[c]                   = y[c] - x[c];
    if (grid->periodic[c]) d[c] -= length * PetscFloorReal(d[c] / length + 0.5);
    square += d[c] * d[c];
  }
  const PetscReal distance = PetscSqrtReal(square);
  for (int c = 0; c < 3; c++) d[c] /= distance;
  return distance - scene->spheres[gap->i].radius - scene->spheres[gap->j].radius;
}

/* Moves the two apart along e by a length: the smaller one goes farther, a held one or a wall stays. */
static void Part(DLMSpheres spheres, const DLMGap *gap, const PetscReal e[3], PetscReal length)
{
  const DLMSphereSpec *spec = spheres->scene->spheres;
  const PetscReal      ease_i = spec[gap->i].motion == DLM_MOTION_FREE ? 1.0 / spec[gap->i].radius : 0.0;
  const PetscReal      ease_j = gap->j >= 0 && spec[gap->j].motion == DLM_MOTION_FREE ? 1.0 / spec[gap->j].radius : 0.0;

  if (ease_i + ease_j == 0.0) return;
  for (int c = 0; c < 3; c++) {
    spheres->state[gap->i].center[c] -= ease_i / (ease_i + ease_j) * length * e[c];
    if (gap->j >= 0) spheres->state[gap->j].center[c] += ease_j / (ease_i + ease_j) * length * e[c];
  }
}

/* Least width of a gap after a time, or minus infinity if the two do not approach each other. */
static PetscReal LeastWidth(DLMSpheres spheres, const DLMGap *gap, const PetscReal *start, PetscReal time)
{
  const DLMSphereState *i = &spheres->state[gap->i], *j = &spheres->state[PetscMax(gap->j, 0)];
  PetscReal             speed = 0.0, d[3], width;

  for (int c = 0; c < 3; c++) speed += gap->e[c] * (i->velocity[c] - (gap->j < 0 ? gap->wall[c] : j->velocity[c]));
  width = Width(spheres, gap, start + 3 * gap->i, start + 3 * PetscMax(gap->j, 0), d);
  return speed > 0.0 && gap->width > 0.0 && width > 0.0 ? width * PetscExpReal(-speed * time / gap->width) : -PETSC_INFINITY;
}

PetscErrorCode DLMLubricationKeepGaps(DLMLubrication *lubrication, DLMSpheres spheres, const PetscReal *start, PetscReal time)
{
  const PetscInt  sweeps = 50;
  const PetscReal tolerance = 1e-3;
  PetscBool       done = PETSC_FALSE;

  PetscFunctionBeginUser;
  for (PetscInt sweep = 0; sweep < sweeps && !done; sweep++) {
    done = PETSC_TRUE;
    for (PetscInt g = 0; g < lubrication->n; g++) {
      const DLMGap   *gap = &lubrication->gaps[g];
      const PetscReal least = LeastWidth(spheres, gap, start, time);
      PetscReal       d[3], missing;
      if (least < 0.0) continue;
      missing = least - Width(spheres, gap, spheres->state[gap->i].center, spheres->state[PetscMax(gap->j, 0)].center, d);
      if (missing <= 0.0) continue;
      Part(spheres, gap, d, missing);
      done = (PetscBool)(done && missing < tolerance * least);
    }
  }
  PetscFunctionReturn(0);
}
