/*
  -accuracy: presets from the fronts of error against cost that tools/tradeoff measures (docs/tradeoff.md).

  A preset is a row: radius over mesh width, time step in units of the scene's own time, and words for other keys. It speaks only where the user does not. The errors stand beside
  it, per cent, as docs/tradeoff/ has them, for scenes in which the answer is known.
*/
#include "sceneimpl.h"
#include "../../include/private/amounts.h"
#include <petscviewer.h>
#include <math.h>

typedef enum { KIND_SETTLING, KIND_ROTATION, KIND_ROTATION_POLYMER, KIND_PAIR, KIND_PAIR_POLYMER, N_KINDS } Kind;

typedef struct {
  PetscReal   cells_per_radius, dt; /* dt: in units of SceneTime */
  const char *scheme, *rtol, *pairing_type, *pairing_points, *form;
  PetscReal   error[N_KINDS]; /* per cent, as docs/tradeoff/ has them (test scenes.presets_foretold); 0: not measured */
} Preset;

/* in the order of DLMAccuracies */
static const Preset presets[] = {
  [DLM_ACCURACY_DRAFT]     = {2.8, 0.2, "strang", "1e-3", "immersed", "surface", "factor", {0.75, 0.029, 1.3, 1.9, 3.1}},
  [DLM_ACCURACY_STANDARD]  = {3.6, 0.1, "strang", "1e-4", "immersed", "surface", "factor", {0.44, 0.044, 1.3, 0.72, 2.8}},
  [DLM_ACCURACY_FINE]      = {4.8, 0.05, "strang", "1e-5", "immersed", "surface", "factor", {0.22, 0.028, 0.054, 0.16, 1.5}},
  [DLM_ACCURACY_REFERENCE] = {6.4, 0.02, "strang", "1e-6", "immersed", "surface", "factor", {0.085, 0.027, 0.2, 0.13, 0.82}},
};

/* What an error was measured in, and of what. */
static const struct {
  const char *scene, *error;
} kinds[N_KINDS] = {
  [KIND_SETTLING]         = {"a sphere that settles, a = 0.1, box 2x2x2", "speed and distance after falling one radius from rest, the worse"},
  [KIND_ROTATION]         = {"a sphere in Newtonian shear, K = 0.3", "rate of rotation"},
  [KIND_ROTATION_POLYMER] = {"a sphere in Oldroyd-B shear, K = 0.2, Wi = 0.5 and 1", "rate of rotation, the worse of the two Wi"},
  [KIND_PAIR]             = {"a Newtonian pair that passes at a gap of 0.28 a", "path, over the radius"},
  [KIND_PAIR_POLYMER]     = {"an Oldroyd-B pair that passes, Wi = 0.5", "path, over the radius"},
};

static PetscReal Length(const PetscReal x[3])
{
  return PetscSqrtReal(PetscSqr(x[0]) + PetscSqr(x[1]) + PetscSqr(x[2]));
}

PetscReal DLMSceneDrivingRate(const DLMScene *scene)
{
  const PetscReal mu = scene->fluid_viscosity;
  PetscReal       flow = 0.0, spheres = 0.0;

  for (int d = 0; d < 3; d++) {
    PetscReal slide[3];
    for (int c = 0; c < 3; c++) slide[c] = scene->wall_velocity[d][1][c] - scene->wall_velocity[d][0][c];
    flow = PetscMax(flow, Length(slide) / scene->box_size[d]);
    if (!scene->box_periodic[d]) flow = PetscMax(flow, Length(scene->pressure_gradient) * scene->box_size[d] / (2.0 * mu));
  }
  for (PetscInt i = 0; i < scene->n_spheres; i++) {
    const DLMSphereSpec *s = &scene->spheres[i];
    const PetscReal      a = s->radius, volume = 4.0 / 3.0 * PETSC_PI * a * a * a;
    const PetscReal      push = Length(s->force) + PetscAbsReal(s->density - scene->fluid_density) * volume * Length(scene->gravity);
    PetscReal            rate = Length(s->torque) / (8.0 * PETSC_PI * mu * a * a * a);
    if (s->motion == DLM_MOTION_FREE) rate = PetscMax(rate, push / (6.0 * PETSC_PI * mu * a * a));
    if (s->motion == DLM_MOTION_FIXED) rate = PetscMax(Length(s->velocity) / a, Length(s->omega));
    spheres = PetscMax(spheres, rate);
  }
  return PetscMax(flow, spheres);
}

/* The scene's own time: one over that rate, or twice the relaxation time where that is shorter; 0 if nothing drives the scene. */
static PetscReal SceneTime(const DLMScene *scene)
{
  const PetscReal rate = DLMSceneDrivingRate(scene), memory = scene->fluid_model == DLM_FLUID_NEWTONIAN ? PETSC_INFINITY : 2.0 * scene->relaxation_time;

  if (rate == 0.0) return memory == PETSC_INFINITY ? 0.0 : memory;
  return PetscMin(1.0 / rate, memory);
}

/* Every axis has an even number of cells; if halved, half of that of x2 is even too. */
static PetscBool EvenOnEveryAxis(const DLMScene *scene, PetscBool halved, PetscReal resolution)
{
  for (int d = 0; d < 3; d++) {
    const PetscReal cells = scene->box_size[d] * resolution, step = halved && d == 1 ? 4.0 : 2.0;
    if (cells < 3.5 || PetscAbsReal(cells - step * round(cells / step)) > 1e-9 * cells) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* The smallest resolution from least to most which fits the box, or 0. */
static PetscReal SmallestResolution(const DLMScene *scene, PetscBool halved, PetscReal least, PetscReal most)
{
  const PetscReal *size     = scene->box_size;
  const PetscReal  shortest = PetscMin(size[0], PetscMin(size[1], size[2])), to_pairs = 0.5 * shortest * (1.0 - 1e-9);

  for (PetscReal pairs = PetscMax(2.0, PetscCeilReal(to_pairs * least)); pairs <= PetscMax(2.0, to_pairs * most); pairs += 1.0)
    if (EvenOnEveryAxis(scene, halved, 2.0 * pairs / shortest)) return 2.0 * pairs / shortest;
  return 0.0;
}

/* The smallest resolution from least to twice that which fits the box, or one that fits half of it and does not have twice as many nodes; or 0. */
static PetscReal FittingResolution(const DLMScene *scene, PetscReal least)
{
  const PetscReal whole = SmallestResolution(scene, PETSC_FALSE, least, 2.0 * least);
  const PetscReal half  = DLMSceneWantsHalf(scene) && whole > 0.0 ? SmallestResolution(scene, PETSC_TRUE, whole, 1.25 * whole) : 0.0;

  return half > 0.0 ? half : whole;
}

PetscErrorCode DLMScenePresetMesh(const DLMScene *scene, DLMAccuracy accuracy, PetscReal *resolution, PetscReal *dt)
{
  const Preset *preset = &presets[accuracy];
  PetscReal     a      = PETSC_INFINITY;

  PetscFunctionBeginUser;
  PetscCheck(accuracy > DLM_ACCURACY_NONE && accuracy <= DLM_ACCURACY_REFERENCE, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "No preset");
  for (PetscInt i = 0; i < scene->n_spheres; i++) a = PetscMin(a, scene->spheres[i].radius);
  *resolution = 0.0;
  *dt         = preset->dt * SceneTime(scene);
  if (!scene->n_spheres) PetscFunctionReturn(0);
  *resolution = FittingResolution(scene, preset->cells_per_radius / a);
  DLMUserCheck(*resolution > 0.0, scene->comm,
               "-accuracy %s: no mesh of %.6g to %.6g cells per unit length makes the box %.10g x %.10g x %.10g an even number of cells on every axis; allowed: a box whose lengths have a common "
               "measure, or -grid_resolution",
               DLMAccuracies[accuracy], (double)(preset->cells_per_radius / a), (double)(2.0 * preset->cells_per_radius / a), (double)scene->box_size[0], (double)scene->box_size[1],
               (double)scene->box_size[2]);
  PetscFunctionReturn(0);
}

/* Sets one key to a text unless the user gave it, and remembers which. */
static PetscErrorCode SetKey(DLMSceneDraft *draft, const char key[], const char value[])
{
  DLMScene     *scene = &draft->scene;
  DLMPresetKey *entry = &scene->preset_key[scene->n_preset_keys++];
  char          name[64];
  PetscBool     given;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(name, sizeof(name), "-%s", key));
  PetscCall(PetscOptionsHasName(NULL, NULL, name, &given));
  PetscCall(PetscStrncpy(entry->value, value, sizeof(entry->value)));
  entry->key     = key;
  entry->applied = (PetscBool)!given;
  if (given) PetscFunctionReturn(0);
  PetscCall(PetscOptionsSetValue(NULL, name, value));
  for (PetscInt i = 0; i < DLMSceneKeyCount; i++)
    if (!strcmp(DLMSceneKeys[i].name, key)) PetscCall(DLMSceneReadKey(scene->comm, &DLMSceneKeys[i], draft));
  PetscFunctionReturn(0);
}

/* The shortest text that reads back as the number. */
static void NumberText(PetscReal x, char text[32])
{
  for (int digits = 6; digits <= 17; digits++) {
    snprintf(text, 32, "%.*g", digits, (double)x);
    if (strtod(text, NULL) == x) return;
  }
}

PetscErrorCode DLMSceneApplyPreset(DLMSceneDraft *draft)
{
  const DLMScene *scene  = &draft->scene;
  const Preset   *preset = &presets[scene->accuracy];
  PetscReal       resolution = 0.0, dt;
  PetscBool       mesh_given, dt_given;
  char            text[32];

  PetscFunctionBeginUser;
  if (scene->accuracy == DLM_ACCURACY_NONE) PetscFunctionReturn(0);
  PetscCall(PetscOptionsHasName(NULL, NULL, "-grid_resolution", &mesh_given));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-ts_dt", &dt_given));
  dt = preset->dt * SceneTime(scene);
  if (!mesh_given) PetscCall(DLMScenePresetMesh(scene, scene->accuracy, &resolution, &dt));
  DLMUserCheck(dt_given || dt > 0.0, scene->comm, "-accuracy %s finds no time step, since nothing drives this scene; allowed: -ts_dt with it", DLMAccuracies[scene->accuracy]);
  if (scene->n_spheres) {
    NumberText(resolution, text);
    PetscCall(SetKey(draft, "grid_resolution", text));
  }
  NumberText(dt, text);
  PetscCall(SetKey(draft, "ts_dt", text));
  PetscCall(SetKey(draft, "ts_split_scheme", preset->scheme));
  if (scene->n_spheres) {
    PetscCall(SetKey(draft, "saddle_rtol", preset->rtol));
    PetscCall(SetKey(draft, "pairing_type", preset->pairing_type));
    PetscCall(SetKey(draft, "pairing_points", preset->pairing_points));
  }
  if (scene->fluid_model != DLM_FLUID_NEWTONIAN) PetscCall(SetKey(draft, "polymer_form", preset->form));
  PetscFunctionReturn(0);
}

/* The measured scene that is like this one, or N_KINDS. */
static Kind KindOf(const DLMScene *scene)
{
  const PetscBool polymer = (PetscBool)(scene->fluid_model != DLM_FLUID_NEWTONIAN);
  PetscBool       pushed  = PETSC_FALSE;

  for (PetscInt i = 0; i < scene->n_spheres; i++) {
    const DLMSphereSpec *s = &scene->spheres[i];
    pushed = (PetscBool)(pushed || Length(s->force) > 0.0 || (s->density != scene->fluid_density && Length(scene->gravity) > 0.0));
  }
  if (scene->n_spheres == 0 || scene->n_spheres > 2 || (polymer && scene->fluid_model != DLM_FLUID_OLDROYD_B)) return N_KINDS;
  if (pushed) return scene->n_spheres == 1 && !polymer ? KIND_SETTLING : N_KINDS;
  if (scene->n_spheres == 2) return polymer ? KIND_PAIR_POLYMER : KIND_PAIR;
  return polymer ? KIND_ROTATION_POLYMER : KIND_ROTATION;
}

static PetscErrorCode ViewRow(const DLMScene *scene, DLMAccuracy accuracy, Kind kind, PetscReal node_seconds, PetscReal time, PetscViewer viewer)
{
  const Preset   *preset     = &presets[accuracy];
  const PetscReal dt         = preset->dt * SceneTime(scene), steps = PetscCeilReal(time / dt - 1e-9);
  PetscReal       resolution = scene->grid_resolution, a = PETSC_INFINITY, nodes = 1.0;
  char            error[16] = "?", lasts[32];

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < scene->n_spheres; i++) a = PetscMin(a, scene->spheres[i].radius);
  if (scene->n_spheres) resolution = FittingResolution(scene, preset->cells_per_radius / a);
  if (resolution == 0.0) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "%-9s  no mesh of %.6g to %.6g cells per unit length fits the box\n", DLMAccuracies[accuracy], (double)(preset->cells_per_radius / a),
                                     (double)(2.0 * preset->cells_per_radius / a)));
    PetscFunctionReturn(0);
  }
  for (int d = 0; d < 3; d++) nodes *= scene->box_size[d] * resolution + !scene->box_periodic[d];
  if (scene->box_mirror == DLM_MIRROR_HALF) nodes *= 0.5; /* as in this run */
  if (kind < N_KINDS && preset->error[kind] > 0.0) PetscCall(PetscSNPrintf(error, sizeof(error), "%.2g %%", (double)preset->error[kind]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "%-9s  %7.6g  %9.4g  %12s  %8s  %9.0f  %s%s\n", DLMAccuracies[accuracy], (double)resolution, (double)dt, preset->rtol, error, (double)steps,
                                   DLMDurationText((double)(node_seconds * nodes * steps), lasts), accuracy == scene->accuracy ? "  (this run)" : ""));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMScenePresetView(const DLMScene *scene, PetscReal node_seconds, PetscReal time, PetscViewer viewer)
{
  const Kind      kind = KindOf(scene);
  const PetscReal Wi   = scene->fluid_model == DLM_FLUID_NEWTONIAN ? 0.0 : scene->relaxation_time * DLMSceneDrivingRate(scene);

  PetscFunctionBeginUser;
  if (SceneTime(scene) == 0.0) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "-accuracy finds no time step, since nothing drives this scene\n"));
    PetscFunctionReturn(0);
  }
  PetscCall(PetscViewerASCIIPrintf(viewer, "-accuracy      1/h         dt  -saddle_rtol     error      steps  time, about\n"));
  for (DLMAccuracy k = DLM_ACCURACY_DRAFT; k <= DLM_ACCURACY_REFERENCE; k++) PetscCall(ViewRow(scene, k, kind, node_seconds, time, viewer));
  if (kind == N_KINDS || presets[DLM_ACCURACY_DRAFT].error[kind] == 0.0)
    PetscCall(PetscViewerASCIIPrintf(viewer, "?: no error was measured in a scene like this one (docs/tradeoff.md)\n"));
  else
    PetscCall(PetscViewerASCIIPrintf(viewer, "error: of the %s, in %s; valid for scenes like that, with gaps above h, Wi up to 1, and some 10 units of time (docs/tradeoff.md)\n", kinds[kind].error,
                                     kinds[kind].scene));
  if (Wi > 1.0) PetscCall(PetscViewerASCIIPrintf(viewer, "Wi is %.3g here: expect larger errors\n", (double)Wi));
  PetscFunctionReturn(0);
}
