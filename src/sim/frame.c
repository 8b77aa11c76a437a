#include "../../include/private/simimpl.h"

/* Mean velocity of all walls along the periodic axes. */
static void FrameVelocity(const DLMScene *scene, PetscReal v[3])
{
  PetscInt walls = 0;

  v[0] = v[1] = v[2] = 0.0;
  for (int d = 0; d < 3; d++) {
    if (scene->box_periodic[d]) continue;
    walls += 2;
    for (int c = 0; c < 3; c++) v[c] += scene->wall_velocity[d][0][c] + scene->wall_velocity[d][1][c];
  }
  for (int c = 0; c < 3; c++) v[c] = scene->box_periodic[c] && walls ? v[c] / walls : 0.0;
}

PetscErrorCode DLMSimulationRide(DLMSimulation sim)
{
  const DLMScene *scene = sim->scene;

  PetscFunctionBegin;
  FrameVelocity(scene, sim->frame_velocity);
  sim->riding = *scene;
  PetscCall(PetscMalloc1(scene->n_spheres, &sim->riding.spheres));
  PetscCall(PetscArraycpy(sim->riding.spheres, scene->spheres, scene->n_spheres));
  for (int c = 0; c < 3; c++) {
    for (int d = 0; d < 3; d++)
      for (int side = 0; side < 2; side++)
        if (!scene->box_periodic[d]) sim->riding.wall_velocity[d][side][c] -= sim->frame_velocity[c];
    for (PetscInt i = 0; i < scene->n_spheres; i++) sim->riding.spheres[i].velocity[c] -= sim->frame_velocity[c];
  }
  PetscFunctionReturn(0);
}
