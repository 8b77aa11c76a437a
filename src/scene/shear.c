#include "../../include/dlmscene.h"

PetscBool DLMSceneGetShear(const DLMScene *scene, DLMShear *shear)
{
  PetscInt  walled = 0;
  PetscReal speed  = 0.0;

  shear->axis = 0;
  for (int d = 0; d < 3; d++) {
    if (!scene->box_periodic[d]) shear->axis = d;
    walled += !scene->box_periodic[d];
  }
  if (walled != 1) return PETSC_FALSE;
  const PetscReal(*wall)[3] = scene->wall_velocity[shear->axis];
  for (int c = 0; c < 3; c++) {
    shear->e[0][c] = c == shear->axis ? 0.0 : wall[1][c] - wall[0][c];
    shear->e[1][c] = c == shear->axis;
    speed += PetscSqr(shear->e[0][c]);
  }
  if (speed == 0.0) return PETSC_FALSE;
  speed       = PetscSqrtReal(speed);
  shear->rate = speed / scene->box_size[shear->axis];
  for (int c = 0; c < 3; c++) shear->e[0][c] /= speed;
  for (int c = 0; c < 3; c++) shear->e[2][c] = shear->e[0][(c + 1) % 3] * shear->e[1][(c + 2) % 3] - shear->e[0][(c + 2) % 3] * shear->e[1][(c + 1) % 3];
  return PETSC_TRUE;
}
