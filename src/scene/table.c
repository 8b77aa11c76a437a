/* The table of keys: it drives reading, checking, -help and docs/options.md. */
#include "sceneimpl.h"
#include <float.h>
#include <math.h>

/* clang-format off */
const char *const DLMMotions[]      = {"free", "rotate", "fixed", "DLMMotion", "DLM_MOTION_", NULL};
const char *const DLMPairingTypes[] = {"collocation", "immersed", "DLMPairingType", "DLM_PAIRING_", NULL};
const char *const DLMPointSets[]    = {"volume", "surface", "DLMPointSet", "DLM_POINTS_", NULL};
const char *const DLMFluidModels[]  = {"newtonian", "oldroyd_b", "ucm", "carreau", "DLMFluidModel", "DLM_FLUID_", NULL};
const char *const DLMPolymerForms[] = {"factor", "log", "DLMPolymerForm", "DLM_FORM_", NULL};
const char *const DLMCouplings[]    = {"explicit", "both_sides", "DLMCoupling", "DLM_COUPLING_", NULL};
const char *const DLMInsides[]      = {"identity", "evolve", "extend", "stokes", "auto", "DLMInside", "DLM_INSIDE_", NULL};
const char *const DLMLubrications[] = {"false", "true", "auto", "DLMLubricationChoice", "DLM_LUBRICATION_", NULL};
const char *const DLMPlanes[]       = {"12", "13", "23", "DLMPlane", "DLM_PLANE_", NULL};
const char *const DLMMirrors[]      = {"none", "half", "whole", "auto", "DLMMirror", "DLM_MIRROR_", NULL};
const char *const DLMAccuracies[]   = {"none", "draft", "standard", "fine", "reference", "DLMAccuracy", "DLM_ACCURACY_", NULL};
static const char *const SplitSchemes[] = {"lie", "strang", "DLMSplitScheme", "DLM_SPLIT_", NULL};
static const char *const AdaptTypes[] = {"none", "scene", "DLMAdaptType", "DLM_ADAPT_", NULL};

#define AT(field)    offsetof(DLMSceneDraft, field)
#define WALL(axis, side) AT(scene.wall_velocity[axis][side])
#define ANY          -INFINITY, INFINITY, NULL
#define POSITIVE     DBL_MIN, INFINITY, NULL
#define NOT_NEGATIVE 0, INFINITY, NULL
#define BETWEEN(least, most) least, most, NULL
#define ONE_OF(list) 0, 0, list

const DLMSceneKey DLMSceneKeys[] = {
  {"Accuracy", "accuracy", DLM_KEY_WORD, "none", AT(scene.accuracy), ONE_OF(DLMAccuracies), "",
   "sets mesh, time step, scheme, tolerance, pairing and polymer form by measured errors (docs/tradeoff.md); any of these keys, where given, wins"},

  {"Box and mesh", "box_size", DLM_KEY_REAL3, "1,1,1", AT(scene.box_size), POSITIVE, "length",
   "lengths of the box, which is centred at the origin"},
  {"Box and mesh", "box_periodic", DLM_KEY_BOOL3, "1,1,0", AT(scene.box_periodic), ANY, "", "periodic axes; the others have walls"},
  {"Box and mesh", "box_mirror", DLM_KEY_WORD, "auto", AT(scene.box_mirror), ONE_OF(DLMMirrors), "",
   "half: of a scene that is its own mirror image in x2 = 0, with all spheres in that plane, only x2 >= 0 is computed, in half of time and memory, on a mesh that is its own "
   "mirror image too; whole: all of it, on that mesh; none: all of it, on the mesh that other scenes have; auto: half where scene and solvers allow it"},
  {"Box and mesh", "grid_resolution", DLM_KEY_REAL, "24", AT(scene.grid_resolution), POSITIVE, "cells/length",
   "1/h; every box length must be an even number of cells"},
  {"Box and mesh", "grid_processes", DLM_KEY_INT3, "0,0,0", AT(scene.grid_processes), NOT_NEGATIVE, "ranks",
   "ranks per axis; 0: chosen by the program"},

  {"Walls and driving", "wall_velocity_lower", DLM_KEY_REAL3, "0,0,0", WALL(2, 0), ANY, "velocity", "wall at the lower end of x3"},
  {"Walls and driving", "wall_velocity_upper", DLM_KEY_REAL3, "0,0,0", WALL(2, 1), ANY, "velocity", "wall at the upper end of x3"},
  {"Walls and driving", "wall_velocity_x1_lower", DLM_KEY_REAL3, "0,0,0", WALL(0, 0), ANY, "velocity", "wall at the lower end of x1"},
  {"Walls and driving", "wall_velocity_x1_upper", DLM_KEY_REAL3, "0,0,0", WALL(0, 1), ANY, "velocity", "wall at the upper end of x1"},
  {"Walls and driving", "wall_velocity_x2_lower", DLM_KEY_REAL3, "0,0,0", WALL(1, 0), ANY, "velocity", "wall at the lower end of x2"},
  {"Walls and driving", "wall_velocity_x2_upper", DLM_KEY_REAL3, "0,0,0", WALL(1, 1), ANY, "velocity", "wall at the upper end of x2"},
  {"Walls and driving", "gravity", DLM_KEY_REAL3, "0,0,0", AT(scene.gravity), ANY, "length/time^2", "acceleration of gravity"},
  {"Walls and driving", "pressure_gradient", DLM_KEY_REAL3, "0,0,0", AT(scene.pressure_gradient), ANY, "pressure/length",
   "mean pressure gradient: the fluid feels minus this as a body force"},

  {"Fluid", "fluid_model", DLM_KEY_WORD, "newtonian", AT(scene.fluid_model), ONE_OF(DLMFluidModels), "", "what the fluid is"},
  {"Fluid", "fluid_density", DLM_KEY_REAL, "1", AT(scene.fluid_density), NOT_NEGATIVE, "mass/length^3", "density, for buoyancy"},
  {"Fluid", "fluid_viscosity", DLM_KEY_REAL, "1", AT(scene.fluid_viscosity), POSITIVE, "pressure time", "total viscosity at zero shear"},
  {"Fluid", "fluid_relaxation_time", DLM_KEY_REAL, "1", AT(scene.relaxation_time), POSITIVE, "time", "lambda1 of a viscoelastic fluid"},
  {"Fluid", "fluid_retardation_time", DLM_KEY_AUTO, "auto", AT(scene.retardation_time), NOT_NEGATIVE, "time",
   "lambda2, up to lambda1: the solvent has the fraction lambda2/lambda1 of the viscosity; auto: lambda1/8, or 0 for ucm"},
  {"Fluid", "fluid_carreau_n", DLM_KEY_REAL, "1", AT(scene.carreau_n), BETWEEN(0.01, 2), "",
   "exponent n of carreau: both viscosities thin as (1 + (lambda1 shear rate)^2)^((n-1)/2)"},

  {"Polymer", "polymer_form", DLM_KEY_WORD, "factor", AT(scene.polymer_form), ONE_OF(DLMPolymerForms), "",
   "what is advected: the Cholesky factor of the conformation tensor C, or its logarithm"},
  {"Polymer", "polymer_coupling", DLM_KEY_WORD, "both_sides", AT(scene.polymer_coupling), ONE_OF(DLMCouplings), "",
   "explicit: polymer stress on the right-hand side (thesis); both_sides: the polymer viscosity on both sides (DEVSS-G)"},
  {"Polymer", "polymer_inside", DLM_KEY_WORD, "auto", AT(scene.polymer_inside), ONE_OF(DLMInsides), "",
   "C in and next to the spheres: identity, reset inside every step (thesis); evolve, as outside; extend, continued from outside, across the layer that the "
   "stress offset leaves out, into two layers; stokes, carried within two mesh widths of a surface by Stokes's flow past the sphere, fitted to the mesh's flow; "
   "auto: stokes, which turns a sphere at the right rate, for one sphere, both_sides and Wi up to 1 and to a quarter of the radius in h; else extend, which carries spheres better"},
  {"Polymer", "polymer_stress_offset", DLM_KEY_AUTO, "auto", AT(scene.polymer_stress_offset), BETWEEN(0, 4), "h",
   "the polymer's stress counts from this far outside a sphere's surface on; 0: everywhere; "
   "auto: calibrated for both_sides, 0.1 with -polymer_inside stokes, 0.75 with extend; else 0"},
  {"Polymer", "polymer_courant", DLM_KEY_REAL, "0.6", AT(scene.polymer_courant), BETWEEN(0.01, 1), "",
   "largest Courant number of an advection sub-step"},
  {"Polymer", "polymer_mode_amplitude", DLM_KEY_REAL, "0", AT(scene.polymer_mode_amplitude), BETWEEN(-0.9, 0.9), "",
   "C starts as I plus this times sin(2 pi number x3/L3) in the components of a plane"},
  {"Polymer", "polymer_mode_plane", DLM_KEY_WORD, "13", AT(scene.polymer_mode_plane), ONE_OF(DLMPlanes), "", "the plane of that mode"},
  {"Polymer", "polymer_mode_number", DLM_KEY_INT, "1", AT(scene.polymer_mode_number), BETWEEN(1, 1000), "", "its wave number"},

  {"Spheres", "spheres_file", DLM_KEY_TEXT, "", AT(scene.spheres_file), ANY, "",
   "CSV file, one sphere a row; looked for in the working directory, then beside the scene's file. "
   "Columns x1,x2,x3 and optionally radius, density, motion, V1..V3, omega1..3, F1..F3, T1..T3"},
  {"Spheres", "sphere_centers", DLM_KEY_REALS, "", AT(centers), ANY, "length", "centres x1,x2,x3,x1,x2,x3,... of equal spheres"},
  {"Spheres", "sphere_radius", DLM_KEY_REAL, "0.1", AT(sphere.radius), POSITIVE, "length",
   "radius, at least 1.2 h; like the keys below: for -sphere_centers and for columns absent from -spheres_file"},
  {"Spheres", "sphere_density", DLM_KEY_REAL, "1", AT(sphere.density), POSITIVE, "mass/length^3", "density"},
  {"Spheres", "sphere_motion", DLM_KEY_WORD, "free", AT(sphere.motion), ONE_OF(DLMMotions), "",
   "free; rotate: the centre is held, rotation free; fixed: velocity and rotation are held"},
  {"Spheres", "sphere_velocity", DLM_KEY_REAL3, "0,0,0", AT(sphere.velocity), ANY, "velocity", "initial velocity; a fixed sphere keeps it"},
  {"Spheres", "sphere_omega", DLM_KEY_REAL3, "0,0,0", AT(sphere.omega), ANY, "1/time", "initial rotation; a fixed sphere keeps it"},
  {"Spheres", "sphere_force", DLM_KEY_REAL3, "0,0,0", AT(sphere.force), ANY, "force", "external force, beside buoyancy"},
  {"Spheres", "sphere_torque", DLM_KEY_REAL3, "0,0,0", AT(sphere.torque), ANY, "force length", "external torque"},
  {"Spheres", "sphere_inertia", DLM_KEY_BOOL, "true", AT(scene.sphere_inertia), ANY, "", "keep M dV/dt and I domega/dt"},

  {"Pairing of fluid and spheres", "pairing_type", DLM_KEY_WORD, "immersed", AT(scene.pairing_type), ONE_OF(DLMPairingTypes), "",
   "how a multiplier sees the velocity: collocation, interpolated at its point; immersed, through a smoothed delta"},
  {"Pairing of fluid and spheres", "pairing_points", DLM_KEY_WORD, "surface", AT(scene.pairing_points), ONE_OF(DLMPointSets), "",
   "where the multipliers lie"},
  {"Pairing of fluid and spheres", "pairing_spacing", DLM_KEY_AUTO, "auto", AT(scene.pairing_spacing), BETWEEN(0.4, 4), "h",
   "distance between surface points; auto: 0.65 under harmonics, else 1.5"},
  {"Pairing of fluid and spheres", "pairing_degree", DLM_KEY_AUTO, "auto", AT(scene.pairing_degree), BETWEEN(0, 12), "",
   "surface multipliers are spherical harmonics up to this degree; 0: one at every point (thesis); "
   "auto: by radius for immersed surface points, 0 where a retraction is given"},
  {"Pairing of fluid and spheres", "pairing_compliance", DLM_KEY_AUTO, "auto", AT(scene.pairing_compliance), BETWEEN(0, 1e6), "h/viscosity",
   "slip per traction allowed to harmonics beyond degree 1, which the pressure mesh resolves badly; auto: calibrated, 0: none"},
  {"Pairing of fluid and spheres", "pairing_spin_compliance", DLM_KEY_AUTO, "auto", AT(scene.pairing_spin_compliance), BETWEEN(-0.1, 1), "h/viscosity",
   "the same for the torque's traction, which makes the sphere's rotation right; auto: calibrated, 0 where compliance or retraction is given"},
  {"Pairing of fluid and spheres", "pairing_strain_compliance", DLM_KEY_AUTO, "auto", AT(scene.pairing_strain_compliance), BETWEEN(-0.1, 1), "h/viscosity",
   "the same for the stresslet's traction; auto: calibrated, 0 where compliance or retraction is given"},
  {"Pairing of fluid and spheres", "pairing_retraction", DLM_KEY_AUTO, "auto", AT(scene.pairing_retraction), BETWEEN(0, 2), "h",
   "surface points lie this deep below the surface; auto: calibrated, 0: the thesis's method"},

  {"Contact", "contact_range", DLM_KEY_AUTO, "auto", AT(scene.contact_range), NOT_NEGATIVE, "length",
   "gap below which bodies repel; auto: h/8, or a thousandth of the smallest radius under lubrication; 0: no repulsion"},
  {"Contact", "contact_stiffness", DLM_KEY_AUTO, "auto", AT(scene.contact_stiffness), NOT_NEGATIVE, "force",
   "repulsion at touching; auto: from shear and buoyancy"},
  {"Contact", "lubrication", DLM_KEY_WORD, "auto", AT(scene.lubrication), ONE_OF(DLMLubrications), "",
   "friction across narrow gaps, for the lubrication that the mesh does not resolve; auto: in Newtonian fluid, under the default cover (for which it was "
   "measured), where two bodies are close or can meet"},
  {"Contact", "lubrication_range", DLM_KEY_REAL, "0.75", AT(scene.lubrication_range), BETWEEN(0.01, 2), "mean radius",
   "gaps narrower than this get that friction; in mean radii of the two bodies, where a wall counts as 0"},

  {"Time", "ts_dt", DLM_KEY_REAL, "0.02", AT(scene.ts_dt), POSITIVE, "time", "time step"},
  {"Time", "ts_max_time", DLM_KEY_REAL, "1", AT(scene.ts_max_time), POSITIVE, "time", "end of the run"},
  {"Time", "ts_max_steps", DLM_KEY_INT, "1000000000", AT(ts_max_steps), NOT_NEGATIVE, "steps", "most steps of the run"},
  {"Time", "ts_split_scheme", DLM_KEY_WORD, "strang", AT(ts_split_scheme), ONE_OF(SplitSchemes), "",
   "splitting scheme: lie, first order (thesis); strang, second order"},
  {"Time", "ts_adapt_type", DLM_KEY_WORD, "none", AT(ts_adapt_type), ONE_OF(AdaptTypes), "",
   "none: steps of ts_dt; scene: after a first step of ts_dt, steps that suit errors, gaps and Courant number"},
  {"Time", "ts_rtol", DLM_KEY_REAL, "1e-3", AT(scene.ts_rtol), BETWEEN(1e-12, 1), "",
   "error allowed to an adapted step, of a sphere's place over its radius and of the mean of C"},
  {"Time", "split_retries", DLM_KEY_INT, "0", AT(split_retries), BETWEEN(0, 20), "",
   "how often a step that loses positivity of C is tried again with half of dt"},

  {"Solvers", "saddle_rtol", DLM_KEY_REAL, "1e-6", AT(scene.saddle_rtol), BETWEEN(1e-14, 0.1), "", "relative tolerance of the bodies' solve"},
  {"Solvers", "saddle_cluster_gap", DLM_KEY_REAL, "2", AT(scene.saddle_cluster_gap), NOT_NEGATIVE, "h",
   "spheres closer than this share one dense block"},
  {"Solvers", "saddle_cluster_limit", DLM_KEY_INT, "4000", AT(scene.saddle_cluster_limit), BETWEEN(1, 1000000), "unknowns",
   "most unknowns of a dense block; larger clusters are cut"},
  {"Solvers", "stokes_block_limit", DLM_KEY_REAL, "1024", AT(scene.stokes_block_limit), NOT_NEGATIVE, "MiB/rank",
   "memory for the exact pressure solve; beyond it: conjugate gradients"},

  {"Output", "output_dir", DLM_KEY_TEXT, "out", AT(scene.output_dir), ANY, "", "folder of everything the run leaves"},
  {"Output", "output_every", DLM_KEY_INT, "1", AT(scene.output_every), BETWEEN(1, INFINITY), "steps", "steps between rows of trajectory.csv"},
  {"Output", "output_fields_every", DLM_KEY_INT, "0", AT(scene.output_fields_every), NOT_NEGATIVE, "steps",
   "steps between fields in fields.h5; 0: none"},
  {"Output", "output_multipliers", DLM_KEY_BOOL, "false", AT(scene.output_multipliers), ANY, "",
   "with the fields: the points of the spheres' multipliers, the forces there and the tractions of the fluid"},
  {"Output", "progress_every", DLM_KEY_REAL, "5", AT(scene.progress_every), NOT_NEGATIVE, "s", "seconds between progress lines"},
  {"Output", "checkpoint_every", DLM_KEY_INT, "0", AT(scene.checkpoint_every), NOT_NEGATIVE, "steps",
   "steps between checkpoints, checkpoint.h5 in the output folder; 0: none"},
  {"Output", "checkpoint_minutes", DLM_KEY_REAL, "0", AT(scene.checkpoint_minutes), NOT_NEGATIVE, "minutes",
   "minutes between checkpoints; 0: none. SIGTERM and SIGUSR1 write one always, and end the run with exit code 3"},
  {"Output", "dry_run", DLM_KEY_BOOL, "false", AT(scene.dry_run), ANY, "",
   "shows the scene as understood, what would be built and why, memory, disk and time needed, also by each -accuracy, and ends: nothing is written"},
  {"Output", "restart", DLM_KEY_TEXT, "", AT(scene.restart), ANY, "",
   "checkpoint to go on from, on any number of ranks, with the files in -output_dir; box, mesh, kind of fluid and spheres must be those of its run"},
};
/* clang-format on */
const PetscInt DLMSceneKeyCount = (PetscInt)(sizeof(DLMSceneKeys) / sizeof(DLMSceneKeys[0]));

static void RangeText(const DLMSceneKey *key, char text[], size_t size)
{
  if (key->least == DBL_MIN) snprintf(text, size, " > 0");
  else if (isfinite(key->least) && isfinite(key->most))
    snprintf(text, size, " from %g to %g", key->least, key->most);
  else if (isfinite(key->least)) snprintf(text, size, " >= %g", key->least);
  else text[0] = '\0';
}

static void WordsText(const char *const words[], char text[], size_t size)
{
  PetscInt n = DLMWordCount(words);
  size_t   used = 0;

  for (PetscInt i = 0; i < n && used < size; i++) {
    const char *separator = i == 0 ? "" : (i == n - 1 ? " or " : ", ");
    used += (size_t)snprintf(text + used, size - used, "%s%s", separator, words[i]);
  }
}

void DLMKeyAllowed(const DLMSceneKey *key, char text[], size_t size)
{
  char range[64];

  RangeText(key, range, sizeof(range));
  switch (key->type) {
  case DLM_KEY_BOOL:
    snprintf(text, size, "true or false");
    break;
  case DLM_KEY_BOOL3:
    snprintf(text, size, "three of 0 or 1, as in 1,1,0");
    break;
  case DLM_KEY_INT:
    snprintf(text, size, "an integer%s", range);
    break;
  case DLM_KEY_INT3:
    snprintf(text, size, "three integers%s, as in 1,2,3", range);
    break;
  case DLM_KEY_REAL:
    snprintf(text, size, "a number%s", range);
    break;
  case DLM_KEY_AUTO:
    snprintf(text, size, "auto or a number%s", range);
    break;
  case DLM_KEY_REAL3:
    snprintf(text, size, "three numbers%s, as in 1,2,3", range);
    break;
  case DLM_KEY_REALS:
    snprintf(text, size, "numbers, three a sphere, as in 0,0,0,1,0,0");
    break;
  case DLM_KEY_WORD:
    WordsText(key->words, text, size);
    break;
  case DLM_KEY_TEXT:
    snprintf(text, size, "a path");
    break;
  }
}

PetscErrorCode DLMScenePrintHelp(MPI_Comm comm)
{
  const char *group = "";
  char        allowed[128], preset[80];

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < DLMSceneKeyCount; i++) {
    const DLMSceneKey *key = &DLMSceneKeys[i];

    if (strcmp(group, key->group)) PetscCall(PetscPrintf(comm, "%s:\n", key->group));
    group = key->group;
    DLMKeyAllowed(key, allowed, sizeof(allowed));
    PetscCall(PetscSNPrintf(preset, sizeof(preset), "-%s <%s>", key->name, key->preset));
    PetscCall(PetscPrintf(comm, "  %-38s %s (%s%s%s)\n", preset, key->help, allowed, key->unit[0] ? "; " : "",
                          key->unit));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSceneWriteOptionsTable(FILE *file)
{
  const char *group = "";
  char        allowed[128];

  PetscFunctionBeginUser;
  fprintf(file, "# Options of a scene\n\n"
                "Written by `dlmfd -options_table` from the table in src/scene/table.c; do not edit.\n\n"
                "A scene is a file, `dlmfd scene.yaml -ts_dt 0.01`: YAML, where nesting joins words (`box: "
                "{size: [3, 2, 1]}` is\n"
                "`box_size: [3, 2, 1]` is `-box_size 3,2,1`), or PETSc's plain form, one `-key value` a line. "
                "More files follow\n"
                "with `-options_file FILE`; a later file wins over an earlier one, and the command line wins "
                "over all files.\n"
                "Spheres are counted from 0. Units are any consistent system (the thesis uses CGS).\n");
  for (PetscInt i = 0; i < DLMSceneKeyCount; i++) {
    const DLMSceneKey *key = &DLMSceneKeys[i];

    if (strcmp(group, key->group)) {
      fprintf(file, "\n## %s\n\n| key | default | allowed | unit | meaning |\n|---|---|---|---|---|\n",
              key->group);
    }
    group = key->group;
    DLMKeyAllowed(key, allowed, sizeof(allowed));
    fprintf(file, "| `-%s` | %s | %s | %s | %s |\n", key->name, key->preset, allowed, key->unit, key->help);
  }
  PetscFunctionReturn(0);
}
