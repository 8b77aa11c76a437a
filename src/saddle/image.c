#include "../../include/private/response.h"

/*
  (B4) Blake (Proc. Camb. Phil. Soc. 70, 1971): what a wall at rest below adds to the velocity v of a unit force along c, in units of 1/(8 pi mu).
  image: from the mirror image of the force; d: height of the force over the wall, which lies across the axis.
*/
static PetscReal BlakeImage(const PetscReal image[3], PetscReal d, PetscReal blur, int axis, int v, int c)
{
  const PetscReal inverse = 1.0 / PetscSqrtReal(image[0] * image[0] + image[1] * image[1] + image[2] * image[2] + blur), cube = inverse * inverse * inverse;
  const PetscReal n = image[axis], along = v == axis, across = c == axis, same = v == c, product = image[v] * image[c] * cube;
  const PetscReal doublet = d * (same * cube - 3.0 * product * inverse * inverse);
  const PetscReal slope   = same * n * cube + across * image[v] * cube - along * image[c] * cube - 3.0 * product * n * inverse * inverse;

  return -(same * inverse + product) + (across ? -2.0 : 2.0) * d * (doublet - slope);
}

void DLMWallImage(const PetscReal offset[3], PetscReal height, int axis, PetscReal side, PetscReal blur, PetscReal entry[9])
{
  PetscReal image[3] = { offset[0], offset[1], offset[2] };

  image[axis] = 2.0 * height + side * offset[axis];
  for (int v = 0; v < 3; v++)
    for (int c = 0; c < 3; c++) entry[3 * v + c] = ((v == axis) == (c == axis) ? 1.0 : side) * BlakeImage(image, height, blur, axis, v, c);
}

/* The deltas at both ends; from 1 to 3 the iterations are fewest. */
static const PetscReal delta_blur = 2.0;

void DLMResponseAddWalls(DLMGrid grid, PetscReal viscosity, const PetscReal force[3], const PetscReal x[3], PetscReal entry[9])
{
  const PetscReal scale = 1.0 / (8.0 * PETSC_PI * viscosity * grid->h);
  PetscReal       offset[3], here[9], middle[9];

  for (int d = 0; d < 3; d++) offset[d] = x[d] - force[d];
  for (int d = 0; d < 3; d++)
    for (int wall = 0; wall < 2 && !grid->periodic[d]; wall++) {
      const PetscReal side = wall ? -1.0 : 1.0;
      DLMWallImage(offset, wall ? grid->cells[d] - force[d] : force[d], d, side, delta_blur, here);
      DLMWallImage(offset, 0.5 * (grid->cells[d] - side * offset[d]), d, side, delta_blur, middle);
      for (int k = 0; k < 9; k++) entry[k] += scale * (here[k] - middle[k]);
    }
}
