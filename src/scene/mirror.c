/* Scenes that are their own mirror image in the plane x2 = 0: there half of the box stands for all of it (docs/theory.md, G6). */
#include "sceneimpl.h"
#include <math.h>

enum { TEXT = DLM_SPHERE_NAME + 256 };

/* A centre this close to the plane, over the box, lies in it: decimal input is rounded. */
static const PetscReal in_plane = 1e-12;

static PetscReal DrivenAlongX2(const DLMScene *scene)
{
  PetscReal sum = fabs(scene->gravity[1]) + fabs(scene->pressure_gradient[1]);

  for (int d = 0; d < 3; d++) sum += fabs(scene->wall_velocity[d][0][1]) + fabs(scene->wall_velocity[d][1][1]);
  if (scene->polymer_mode_plane != DLM_PLANE_13) sum += fabs(scene->polymer_mode_amplitude);
  return sum;
}

static PetscBool SphereInPlane(const DLMScene *scene, const DLMSphereSpec *s)
{
  const PetscReal across = fabs(s->velocity[1]) + fabs(s->force[1]), turning = fabs(s->omega[0]) + fabs(s->omega[2]) + fabs(s->torque[0]) + fabs(s->torque[2]);

  return (PetscBool)(fabs(s->center[1]) <= in_plane * scene->box_size[1] && across + turning == 0.0);
}

/* Spheres whose multipliers are their own mirror image: harmonics on the points of the surface, under deltas. */
static PetscBool SymmetricPairing(const DLMScene *scene)
{
  const PetscBool harmonics = (PetscBool)(scene->pairing_degree > 0.0 || (scene->pairing_degree < 0.0 && scene->pairing_retraction < 0.0));

  return (PetscBool)(!scene->n_spheres || (scene->pairing_type == DLM_PAIRING_IMMERSED && scene->pairing_points == DLM_POINTS_SURFACE && harmonics));
}

/* What in the scene is not its own mirror image, and what is allowed; false: nothing. */
static PetscBool FindAsymmetry(const DLMScene *scene, char text[TEXT])
{
  const PetscBool *periodic = scene->box_periodic;
  char             name[DLM_SPHERE_NAME];

  if (!periodic[1] || !(periodic[0] || periodic[2])) {
    snprintf(text, TEXT, "-box_periodic %d,%d,%d; allowed: x2 and one more axis periodic", periodic[0], periodic[1], periodic[2]);
    return PETSC_TRUE;
  }
  if (DrivenAlongX2(scene) != 0.0) {
    snprintf(text, TEXT, "gravity, pressure gradient, a wall's velocity or -polymer_mode_plane along x2; allowed: none of them");
    return PETSC_TRUE;
  }
  if (!SymmetricPairing(scene)) {
    snprintf(text, TEXT, "-pairing_type %s, -pairing_points %s, -pairing_degree %g; allowed: immersed, surface and harmonics (a degree of at least 1, or auto without a retraction)",
             DLMPairingTypes[scene->pairing_type], DLMPointSets[scene->pairing_points], scene->pairing_degree < 0.0 ? 0.0 : (double)scene->pairing_degree);
    return PETSC_TRUE;
  }
  for (PetscInt i = 0; i < scene->n_spheres; i++) {
    if (SphereInPlane(scene, &scene->spheres[i])) continue;
    snprintf(text, TEXT, "%s at x2 = %.6g; allowed: x2 = 0, velocity and force in that plane, rotation and torque about x2", DLMSphereName(scene, i, name), (double)scene->spheres[i].center[1]);
    return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Why half of the mesh cannot be had; false: it can. */
static PetscBool FindObstacle(const DLMScene *scene, char text[TEXT])
{
  if (scene->cells[1] % 4 || scene->cells[1] < 8) {
    snprintf(text, TEXT, "%" PetscInt_FMT " cells along x2; allowed: a multiple of 4, from 8 on", scene->cells[1]);
    return PETSC_TRUE;
  }
  if (scene->grid_processes[1] > (scene->cells[1] / 4 + 1) / 2) {
    snprintf(text, TEXT, "-grid_processes %" PetscInt_FMT " along x2; allowed: up to %" PetscInt_FMT, scene->grid_processes[1], (scene->cells[1] / 4 + 1) / 2);
    return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

PetscBool DLMSceneWantsHalf(const DLMScene *scene)
{
  char text[TEXT];

  if (scene->box_mirror == DLM_MIRROR_AUTO) return (PetscBool)!FindAsymmetry(scene, text);
  return (PetscBool)(scene->box_mirror == DLM_MIRROR_HALF);
}

PetscErrorCode DLMSceneSetMirror(DLMScene *scene)
{
  char            text[TEXT] = "";
  const PetscBool asked = (PetscBool)(scene->box_mirror == DLM_MIRROR_HALF);

  PetscFunctionBeginUser;
  scene->mirror_chosen = (PetscBool)(scene->box_mirror == DLM_MIRROR_AUTO);
  if (!asked && !scene->mirror_chosen) PetscFunctionReturn(0);
  if (FindAsymmetry(scene, text)) scene->box_mirror = DLM_MIRROR_NONE;
  else scene->box_mirror = FindObstacle(scene, text) ? DLM_MIRROR_WHOLE : DLM_MIRROR_HALF;
  DLMUserCheck(!asked || scene->box_mirror == DLM_MIRROR_HALF, scene->comm, "-box_mirror half: %s, or -box_mirror auto", text);
  for (PetscInt i = 0; i < scene->n_spheres && scene->box_mirror == DLM_MIRROR_HALF; i++) scene->spheres[i].center[1] = 0.0;
  PetscFunctionReturn(0);
}
