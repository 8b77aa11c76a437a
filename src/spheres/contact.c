#include "../../include/dlmcontact.h"
#include "../../include/dlmlubrication.h"
#include "../../include/private/spheresimpl.h"

/* Largest viscous force of the wall-driven shear on a sphere, in a fluid of so many times the scene's viscosity, plus its net weight. */
static PetscReal ForceScale(const DLMScene *scene, PetscReal viscosity, const DLMSphereSpec *spec)
{
  PetscReal shear = 0.0, gravity = 0.0, push = 0.0, pressure = 0.0;

  for (int d = 0; d < 3; d++) {
    PetscReal speed = 0.0;
    for (int c = 0; c < 3; c++) speed += PetscSqr(scene->wall_velocity[d][1][c] - scene->wall_velocity[d][0][c]);
    shear = PetscMax(shear, PetscSqrtReal(speed) / scene->box_size[d]);
    gravity += PetscSqr(scene->gravity[d]);
    push += PetscSqr(spec->force[d]);
    pressure += PetscSqr(scene->pressure_gradient[d]);
  }
  const PetscReal a = spec->radius, volume = 4.0 / 3.0 * PETSC_PI * a * a * a;
  return 6.0 * PETSC_PI * viscosity * scene->fluid_viscosity * a * a * shear + PetscAbsReal(spec->density - scene->fluid_density) * volume * PetscSqrtReal(gravity) +
         PetscSqrtReal(push) + volume * PetscSqrtReal(pressure);
}

/* Why no body is pushed by another, or NULL. */
static const char *WhyNone(const DLMScene *scene, const DLMContact *contact)
{
  PetscInt free = 0;

  for (PetscInt i = 0; i < scene->n_spheres; i++) free += scene->spheres[i].motion == DLM_MOTION_FREE;
  if (!free) return "no sphere is free to move";
  if (!contact->can_meet) return "one sphere and no walls";
  if (contact->range == 0.0) return "-contact_range 0";
  return contact->stiffness > 0.0 ? NULL : "no stiffness: nothing drives the bodies";
}

/* Repulsion that waits until lubrication has done its work, or that has to do without it. */
static PetscReal AutoRange(const DLMScene *scene, PetscBool lubricated)
{
  PetscReal radius = PETSC_INFINITY;

  for (PetscInt i = 0; i < scene->n_spheres; i++) radius = PetscMin(radius, scene->spheres[i].radius);
  return lubricated ? 1e-3 * radius : scene->h / 8.0;
}

void DLMContactSetViscosity(const DLMScene *scene, PetscReal ratio, DLMContact *contact)
{
  contact->stiffness = scene->contact_stiffness;
  if (contact->stiffness >= 0.0) return;
  contact->stiffness = 0.0;
  for (PetscInt i = 0; i < scene->n_spheres; i++) contact->stiffness = PetscMax(contact->stiffness, 5.0 * ForceScale(scene, ratio, &scene->spheres[i]));
}

PetscErrorCode DLMContactCreate(const DLMScene *scene, PetscBool lubricated, DLMContact *contact)
{
  PetscFunctionBeginUser;
  contact->largest   = 0.0;
  PetscCall(PetscArrayzero(contact->moment, 6));
  contact->range     = scene->contact_range < 0.0 ? AutoRange(scene, lubricated) : scene->contact_range;
  DLMContactSetViscosity(scene, 1.0, contact);
  contact->can_meet = DLMBodiesCanMeet(scene);
  contact->absent   = WhyNone(scene, contact);
  contact->exists   = (PetscBool)!contact->absent;
  PetscFunctionReturn(0);
}

static PetscReal Repulsion(const DLMContact *contact, PetscReal touching, PetscReal distance, PetscReal stiffness)
{
  const PetscReal overlap = (touching + contact->range - distance) / contact->range;

  return overlap > 0.0 ? stiffness * overlap * overlap : 0.0;
}

/* moment -= f d d / |d|: two bodies d apart push each other with f. Order 11, 22, 33, 12, 13, 23. */
static void AddMoment(DLMContact *contact, PetscReal f, const PetscReal d[3], PetscReal distance)
{
  static const int i[6] = { 0, 1, 2, 0, 0, 1 }, j[6] = { 0, 1, 2, 1, 2, 2 };

  for (int k = 0; k < 6; k++) contact->moment[k] -= f * d[i[k]] * d[j[k]] / distance;
}

PetscErrorCode DLMContactForces(DLMContact *contact, DLMSpheres spheres, PetscReal *force)
{
  DLMGrid  grid = spheres->grid;
  PetscInt n, *pairs;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(force, 3 * spheres->n));
  PetscCall(PetscArrayzero(contact->moment, 6));
  if (!contact->exists) PetscFunctionReturn(0);
  PetscCall(DLMSpheresFindPairs(spheres, contact->range, &n, &pairs));
  for (PetscInt k = 0; k < n; k++) {
    const PetscInt  i = pairs[2 * k], j = pairs[2 * k + 1];
    const PetscReal touching = spheres->scene->spheres[i].radius + spheres->scene->spheres[j].radius;
    PetscReal       d[3], distance, f;
    PetscCall(DLMSpheresSeparation(spheres, i, j, d));
    distance = PetscSqrtReal(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    f        = Repulsion(contact, touching, distance, contact->stiffness);
    for (int c = 0; c < 3; c++) {
      force[3 * i + c] -= f * d[c] / distance;
      force[3 * j + c] += f * d[c] / distance;
    }
    AddMoment(contact, f, d, distance);
    contact->largest = PetscMax(contact->largest, f);
  }
  PetscCall(PetscFree(pairs));
  for (PetscInt i = 0; i < spheres->n; i++)
    for (int d = 0; d < 3; d++) {
      const PetscReal x = spheres->state[i].center[d] - grid->lower[d], touching = 2.0 * spheres->scene->spheres[i].radius;
      PetscReal       lower, upper;
      if (grid->periodic[d]) continue;
      lower = Repulsion(contact, touching, 2.0 * x, 2.0 * contact->stiffness);
      upper = Repulsion(contact, touching, 2.0 * (grid->cells[d] * grid->h - x), 2.0 * contact->stiffness);
      force[3 * i + d] += lower - upper;
      contact->moment[d] -= lower * x + upper * (grid->cells[d] * grid->h - x);
      contact->largest = PetscMax(contact->largest, PetscMax(lower, upper));
    }
  PetscFunctionReturn(0);
}
