/*
  A piece of a scene, to try a step on: the same mesh width, fluid, walls and kind of spheres in a smaller box, so that a node and a sphere of it take the
  memory and the time that they take in the whole scene.
*/
#include "../../include/private/dryrun.h"

static PetscReal Nodes(const DLMScene *scene)
{
  PetscReal nodes = 1.0;

  for (int d = 0; d < 3; d++) nodes *= DLMSceneNodes(scene, d);
  return nodes;
}

/* What is left of n without its factors 2, 3, 5 and 7: transforms of lengths with the same rest cost alike. */
static PetscInt Rest(PetscInt n)
{
  for (PetscInt p = 2; p <= 7; p++)
    while (n % p == 0) n /= p;
  return n;
}

/* The next smaller number of cells, a multiple of step, that transforms like `cells`, or 0. */
static PetscInt Smaller(PetscInt now, PetscInt cells, PetscInt step)
{
  for (now -= step; now > 0 && Rest(now) != Rest(cells); now -= step);
  return now;
}

/* Cuts the longest of some axes until most nodes are left or no axis can be cut further. */
static void Cut(const DLMScene *whole, const PetscBool allowed[3], const PetscInt least[3], PetscReal most, DLMScene *piece)
{
  const PetscInt step[3] = { 2, whole->box_mirror == DLM_MIRROR_HALF ? 4 : 2, 2 };

  while (Nodes(piece) > most) {
    int longest = -1;
    for (int d = 0; d < 3; d++)
      if (allowed[d] && Smaller(piece->cells[d], whole->cells[d], step[d]) >= least[d] && (longest < 0 || piece->cells[d] > piece->cells[longest])) longest = d;
    if (longest < 0) return;
    piece->cells[longest] = Smaller(piece->cells[longest], whole->cells[longest], step[longest]);
  }
}

static PetscInt Largest(const DLMScene *scene)
{
  PetscInt largest = 0;

  for (PetscInt i = 1; i < scene->n_spheres; i++)
    if (scene->spheres[i].radius > scene->spheres[largest].radius) largest = i;
  return largest;
}

/*
  Periodic axes of the plane first: a node costs the same then, down to the pressure blocks. The rest only where that is far from enough. Around a sphere
  there is room of its diameter.
*/
static void CutBox(const DLMScene *whole, PetscReal most, DLMScene *piece)
{
  PetscBool plane[3], all[3] = { PETSC_TRUE, PETSC_TRUE, PETSC_TRUE };
  PetscInt  least[3], line = 2;
  PetscReal room = 0.0;

  for (PetscInt d = 0; d < 3; d++)
    if (!whole->box_periodic[d]) line = d;
  if (whole->n_spheres) room = 4.0 * whole->spheres[Largest(whole)].radius / whole->h;
  for (PetscInt d = 0; d < 3; d++) {
    plane[d] = (PetscBool)(d != line && whole->box_periodic[d]);
    least[d] = (PetscInt)PetscMax(16.0, PetscMax(PetscCeilReal(room), 4.0 * whole->grid_processes[d]));
  }
  Cut(whole, plane, least, most, piece);
  if (Nodes(piece) > 2.0 * most) Cut(whole, all, least, 2.0 * most, piece);
  for (int d = 0; d < 3; d++) {
    const PetscReal part = (PetscReal)piece->cells[d] / whole->cells[d];
    piece->box_size[d] *= part;
    for (int c = 0; c < 3; c++) { /* the shear rate stays */
      piece->wall_velocity[d][0][c] *= part;
      piece->wall_velocity[d][1][c] *= part;
    }
  }
}

/* The spheres that lie wholly in the piece, which is centred, as far as walls let it, at the largest one. */
static PetscErrorCode CutSpheres(const DLMScene *whole, DLMScene *piece)
{
  const DLMSphereSpec *first = &whole->spheres[Largest(whole)];

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(whole->n_spheres, &piece->spheres));
  piece->n_spheres = 0;
  for (PetscInt i = 0; i < whole->n_spheres; i++) {
    DLMSphereSpec s      = whole->spheres[i];
    PetscBool     inside = PETSC_TRUE;
    for (int d = 0; d < 3; d++) {
      const PetscReal size = whole->box_size[d], half = 0.5 * piece->box_size[d], slack = 0.5 * size - half;
      if (piece->cells[d] == whole->cells[d]) continue;
      s.center[d] -= whole->box_periodic[d] ? first->center[d] : PetscMax(-slack, PetscMin(slack, first->center[d]));
      if (whole->box_periodic[d]) s.center[d] -= size * PetscFloorReal(s.center[d] / size + 0.5);
      inside = (PetscBool)(inside && PetscAbsReal(s.center[d]) + s.radius <= half);
    }
    if (inside) piece->spheres[piece->n_spheres++] = s;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPieceCreate(const DLMScene *whole, PetscReal most, DLMScene *piece)
{
  PetscReal bytes, nodes, ghosts;
  PetscBool exact, fits;

  PetscFunctionBegin;
  *piece = *whole;
  CutBox(whole, most, piece);
  PetscCall(DLMGridForesee(piece, &fits, &nodes, &ghosts));
  if (!fits) *piece = *whole;
  PetscCall(CutSpheres(whole, piece));
  piece->restart[0] = '\0';
  PetscCall(DLMStokesForeseePressureBlocks(whole, &bytes, &exact));
  piece->stokes_block_limit = exact ? PETSC_INFINITY : 0.0;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPieceDestroy(DLMScene *piece)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(piece->spheres));
  PetscFunctionReturn(0);
}
