/* Contradictions between keys. Every tolerance is relative, so boxes of 1e-6 and 1e3 are judged alike. */
#include "sceneimpl.h"
#include <math.h>

#define ROUNDING 1e-12 /* of decimal input, relative to the lengths involved */

static PetscErrorCode CheckCells(const DLMScene *scene, int d, PetscReal cells)
{
  const PetscReal size = scene->box_size[d], h = 1 / scene->grid_resolution;
  const PetscReal even = 2 * round(cells / 2), lower = PetscMax(4, 2 * floor(cells / 2)),
                  upper = PetscMax(4, lower + 2);
  const MPI_Comm comm = scene->comm;

  PetscFunctionBeginUser;
  DLMUserCheck(
      cells > 3.5, comm,
      "-box_size %.6g along x%d with -grid_resolution %.6g gives %.12g cells; allowed: at least 4, so a size of"
      " at least %.6g or a resolution of at least %.6g",
      size, d + 1, scene->grid_resolution, cells, 4 * h, 4 / size);
  DLMUserCheck(fabs(cells - even) <= 1e-9 * cells, comm,
               "-box_size %.6g along x%d with -grid_resolution %.6g gives %.12g cells%s; allowed: an even "
               "number of cells"
               " (a multiple of 2h), so a size of %.10g or %.10g or a resolution of %.10g or %.10g",
               size, d + 1, scene->grid_resolution, cells,
               fabs(cells - round(cells)) <= 1e-9 * cells ? ", odd" : "", lower * h, upper * h, lower / size,
               upper / size);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSceneSetGrid(DLMScene *scene)
{
  PetscReal nodes = 1;

  PetscFunctionBeginUser;
  scene->h = 1 / scene->grid_resolution;
  for (int d = 0; d < 3; d++) {
    PetscReal cells = scene->box_size[d] * scene->grid_resolution;

    PetscCall(CheckCells(scene, d, cells));
    nodes *= cells + 1;
    DLMUserCheck(
        3 * nodes < (PetscReal)PETSC_MAX_INT, scene->comm,
        "-grid_resolution %.6g gives more unknowns than this PETSc can number; allowed: up to %" PetscInt_FMT
        " nodes, or a PETSc with 64-bit indices",
        scene->grid_resolution, (PetscInt)(PETSC_MAX_INT / 3));
    scene->cells[d] = (PetscInt)round(cells);
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckProcesses(const DLMScene *scene)
{
  const PetscInt *p = scene->grid_processes;
  PetscMPIInt     ranks;
  PetscInt        fixed = 1, chosen = 0;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(scene->comm, &ranks));
  for (int d = 0; d < 3; d++) {
    const PetscInt most = PetscMax(1, (DLMSceneNodes(scene, d) + 1) / 2 / 2); /* two pressure nodes each */
    DLMUserCheck(p[d] <= most, scene->comm,
                 "-grid_processes %" PetscInt_FMT " along x%d: the mesh has %" PetscInt_FMT
                 " cells there; allowed: up to %" PetscInt_FMT,
                 p[d], d + 1, scene->cells[d], most);
    if (p[d]) fixed *= p[d]; /* below the number of cells: no overflow */
    else chosen++;
  }
  DLMUserCheck(chosen ? ranks % fixed == 0 : fixed == ranks, scene->comm,
               "-grid_processes %" PetscInt_FMT ",%" PetscInt_FMT ",%" PetscInt_FMT
               " on %d ranks; allowed: a product of %d, 0 where the program chooses",
               p[0], p[1], p[2], ranks, ranks);
  PetscFunctionReturn(0);
}

static void WallKey(int axis, int side, char key[32])
{
  const char *names[3] = {"x1_", "x2_", ""};

  snprintf(key, 32, "-wall_velocity_%s%s", names[axis], side ? "upper" : "lower");
}

static PetscErrorCode CheckWalls(const DLMScene *scene)
{
  const PetscReal *size = scene->box_size;
  PetscReal        net = 0, largest = 0;
  char             key[32], culprit[128] = "";

  PetscFunctionBeginUser;
  for (int d = 0; d < 3; d++) {
    const PetscReal area = size[(d + 1) % 3] * size[(d + 2) % 3];

    for (int side = 0; side < 2; side++) {
      const PetscReal *u = scene->wall_velocity[d][side];
      const PetscReal  flux = u[d] * area;

      WallKey(d, side, key);
      DLMUserCheck(!scene->box_periodic[d] || (u[0] == 0 && u[1] == 0 && u[2] == 0), scene->comm,
                   "%s %.6g,%.6g,%.6g: x%d is periodic and has no walls; allowed: 0,0,0, or -box_periodic with "
                   "0 for x%d",
                   key, u[0], u[1], u[2], d + 1, d + 1);
      net += side ? flux : -flux;
      if (fabs(flux) <= largest) continue;
      largest = fabs(flux);
      snprintf(culprit, sizeof(culprit), "%s %g,%g,%g", key, u[0], u[1], u[2]);
    }
  }
  DLMUserCheck(fabs(net) <= 1e-9 * largest, scene->comm,
               "%s and the other walls change the volume of the box at a rate of %.6g; allowed: wall velocities"
               " without net flux, the sum over axes of (upper - lower) normal velocity times area being 0",
               culprit, net);
  PetscFunctionReturn(0);
}

const char *DLMSphereName(const DLMScene *scene, PetscInt i, char text[DLM_SPHERE_NAME])
{
  const PetscInt line = scene->spheres[i].line;

  if (line) snprintf(text, DLM_SPHERE_NAME, "sphere %" PetscInt_FMT " (%s, line %" PetscInt_FMT ")", i, scene->spheres_file, line);
  else snprintf(text, DLM_SPHERE_NAME, "sphere %" PetscInt_FMT, i);
  return text;
}

static PetscErrorCode CheckSphereInBox(const DLMScene *scene, PetscInt i, int d)
{
  const DLMSphereSpec *sphere = &scene->spheres[i];
  const PetscReal     *c = sphere->center, a = sphere->radius;
  const PetscReal      half = scene->box_size[d] / 2, gap = half - fabs(c[d]) - a;
  char                 name[DLM_SPHERE_NAME];

  PetscFunctionBeginUser;
  DLMUserCheck(fabs(c[d]) <= half * (1 + ROUNDING), scene->comm,
               "%s at %.6g,%.6g,%.6g is outside the box along x%d; allowed: centres from %.6g to %.6g there",
               DLMSphereName(scene, i, name), c[0], c[1], c[2], d + 1, -half, half);
  if (scene->box_periodic[d]) {
    DLMUserCheck(a <= half * (1 + ROUNDING), scene->comm,
                 "%s of radius %.6g meets its own image along x%d; allowed: a radius up to %.6g, half the period",
                 DLMSphereName(scene, i, name), a, d + 1, half);
  } else {
    DLMUserCheck(gap >= -ROUNDING * (a + half), scene->comm,
                 "%s at %.6g,%.6g,%.6g of radius %.6g overlaps the %s wall of x%d, gap %.6g; allowed: a gap >= 0",
                 DLMSphereName(scene, i, name), c[0], c[1], c[2], a, c[d] < 0 ? "lower" : "upper", d + 1, gap);
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckSphere(const DLMScene *scene, PetscInt i)
{
  const DLMSphereSpec *sphere = &scene->spheres[i];
  const PetscReal     *c = sphere->center, *v = sphere->velocity, least = 1.2 * scene->h;
  char                 name[DLM_SPHERE_NAME];

  PetscFunctionBeginUser;
  DLMUserCheck(
      sphere->radius >= least * (1 - 1e-9), scene->comm,
      "%s at %.6g,%.6g,%.6g of radius %.6g is too small for the mesh; allowed: a radius of at least 1.2 h = %.6g,"
      " or -grid_resolution of at least %.6g",
      DLMSphereName(scene, i, name), c[0], c[1], c[2], sphere->radius, least, 1.2 / sphere->radius);
  DLMUserCheck(sphere->motion != DLM_MOTION_ROTATE || (v[0] == 0 && v[1] == 0 && v[2] == 0), scene->comm,
               "%s of motion rotate has velocity %.6g,%.6g,%.6g; allowed: 0,0,0, since its centre is held",
               DLMSphereName(scene, i, name), v[0], v[1], v[2]);
  for (int d = 0; d < 3; d++) PetscCall(CheckSphereInBox(scene, i, d));
  PetscFunctionReturn(0);
}

/* A centre beyond a face by rounding only is put on the face. */
static void ClampCenters(DLMScene *scene)
{
  for (PetscInt i = 0; i < scene->n_spheres; i++) {
    for (int d = 0; d < 3; d++) {
      PetscReal half = scene->box_size[d] / 2, *x = &scene->spheres[i].center[d];
      *x = PetscMax(-half, PetscMin(half, *x));
    }
  }
}

/* Times of the polymer, and the viscosity that is solved for. */
static PetscErrorCode CheckPolymer(DLMScene *scene)
{
  const PetscReal lambda1 = scene->relaxation_time;
  const PetscBool ucm     = (PetscBool)(scene->fluid_model == DLM_FLUID_UCM);

  PetscFunctionBeginUser;
  scene->implicit_viscosity = scene->fluid_viscosity;
  if (scene->fluid_model == DLM_FLUID_NEWTONIAN) PetscFunctionReturn(0);
  if (scene->retardation_time < 0.0) scene->retardation_time = ucm ? 0.0 : lambda1 / 8.0;
  DLMUserCheck(scene->retardation_time <= lambda1, scene->comm, "-fluid_retardation_time %.6g; allowed: up to the relaxation time %.6g",
               (double)scene->retardation_time, (double)lambda1);
  DLMUserCheck(!ucm || scene->retardation_time == 0.0, scene->comm,
               "-fluid_retardation_time %.6g with -fluid_model ucm, which has no solvent; allowed: 0, or -fluid_model oldroyd_b", (double)scene->retardation_time);
  DLMUserCheck(scene->polymer_coupling == DLM_COUPLING_BOTH_SIDES || scene->retardation_time > 0.0, scene->comm,
               "-polymer_coupling explicit with no solvent viscosity (-fluid_retardation_time 0); allowed: both_sides");
  if (scene->polymer_coupling == DLM_COUPLING_EXPLICIT) scene->implicit_viscosity *= scene->retardation_time / lambda1;
  if (scene->polymer_inside == DLM_INSIDE_AUTO) { /* docs/theory.md, V8 */
    const PetscReal most = scene->n_spheres == 1 ? PetscMin(1.0, 0.25 * scene->spheres[0].radius / scene->h) : 0.0;
    const PetscBool slow = (PetscBool)(lambda1 * DLMSceneDrivingRate(scene) <= most * (1.0 + 1e-9));
    scene->polymer_inside = scene->n_spheres == 1 && slow && scene->polymer_coupling == DLM_COUPLING_BOTH_SIDES ? DLM_INSIDE_STOKES : DLM_INSIDE_EXTEND;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSceneCheck(DLMScene *scene)
{
  PetscFunctionBeginUser;
  PetscCall(CheckPolymer(scene));
  DLMUserCheck(scene->pairing_degree < 0.0 || scene->pairing_degree == PetscFloorReal(scene->pairing_degree), scene->comm,
               "-pairing_degree %.6g: not an integer; allowed: auto or an integer from 0 to 12", (double)scene->pairing_degree);
  DLMUserCheck(!scene->output_multipliers || scene->output_fields_every > 0, scene->comm,
               "-output_multipliers true with -output_fields_every 0, but they are part of the fields; allowed: -output_fields_every of at least 1");
  PetscCall(DLMSceneSetMirror(scene));
  PetscCall(CheckProcesses(scene));
  PetscCall(CheckWalls(scene));
  for (PetscInt i = 0; i < scene->n_spheres; i++) PetscCall(CheckSphere(scene, i));
  ClampCenters(scene);
  PetscCall(DLMSceneCheckOverlap(scene));
  PetscFunctionReturn(0);
}
