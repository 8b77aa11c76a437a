/* The scene: made from the options database, shown, freed. */
#include "sceneimpl.h"
#include <petscviewer.h>

static PetscErrorCode MakeSpheres(MPI_Comm comm, DLMSceneDraft *draft)
{
  DLMScene *scene = &draft->scene;

  PetscFunctionBeginUser;
  DLMUserCheck(!scene->spheres_file[0] || !draft->n_centers, comm,
               "-spheres_file %s and -sphere_centers are both given; allowed: one of them",
               scene->spheres_file);
  if (scene->spheres_file[0]) {
    PetscCall(DLMSpheresReadCSV(comm, scene->spheres_file, &draft->sphere, &scene->n_spheres, &scene->spheres));
    PetscFunctionReturn(0);
  }
  scene->n_spheres = draft->n_centers / 3;
  PetscCall(PetscMalloc1(scene->n_spheres, &scene->spheres));
  for (PetscInt i = 0; i < scene->n_spheres; i++) {
    scene->spheres[i] = draft->sphere;
    PetscCall(PetscArraycpy(scene->spheres[i].center, &draft->centers[3 * i], 3));
  }
  PetscFunctionReturn(0);
}

/* The TS reads these keys too: it has to see our defaults, not its own. */
static PetscErrorCode ShowDefaultsToTS(void)
{
  const char *const shared[] = {"ts_dt", "ts_max_time", "ts_max_steps", "ts_split_scheme"};

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < DLMSceneKeyCount; i++) {
    const DLMSceneKey *key = &DLMSceneKeys[i];
    char               name[64];
    PetscBool          given, is_shared = PETSC_FALSE;

    for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(shared); k++) is_shared = (PetscBool)(is_shared || !strcmp(key->name, shared[k]));
    if (!is_shared) continue;
    PetscCall(PetscSNPrintf(name, sizeof(name), "-%s", key->name));
    PetscCall(PetscOptionsHasName(NULL, NULL, name, &given));
    if (given) continue;
    PetscCall(PetscOptionsSetValue(NULL, name, key->preset));
    PetscCall(PetscOptionsHasName(NULL, NULL, name, &given)); /* marks it as read */
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSceneCreate(MPI_Comm comm, DLMScene **scene)
{
  DLMSceneDraft *draft;
  PetscBool      help;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsHasHelp(NULL, &help));
  if (help) PetscCall(DLMScenePrintHelp(comm));
  PetscCall(DLMSceneRefuseUnknown(comm));
  PetscCall(PetscNew(&draft));
  PetscCall(DLMSceneReadKeys(comm, draft));
  draft->scene.comm = comm;
  PetscCall(MakeSpheres(comm, draft));
  PetscCall(DLMSceneApplyPreset(draft));
  PetscCall(PetscNew(scene));
  **scene = draft->scene;
  PetscCall(PetscStrncpy((*scene)->source, DLMOptionsSource(), PETSC_MAX_PATH_LEN));
  PetscCall(DLMSceneSetGrid(*scene));
  PetscCall(DLMSceneCheck(*scene));
  PetscCall(ShowDefaultsToTS());
  PetscCall(PetscFree(draft->centers));
  PetscCall(PetscFree(draft));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSceneDestroy(DLMScene **scene)
{
  PetscFunctionBeginUser;
  if (!*scene) PetscFunctionReturn(0);
  PetscCall(PetscFree((*scene)->spheres));
  PetscCall(PetscFree(*scene));
  PetscFunctionReturn(0);
}

static PetscErrorCode ViewBox(const DLMScene *scene, PetscViewer viewer)
{
  const PetscReal *size = scene->box_size;
  const PetscInt  *n = scene->cells;
  const char      *kind[2] = {"walls", "periodic"}, *side[2] = {"lower", "upper"};

  PetscFunctionBeginUser;
  PetscCall(PetscViewerASCIIPrintf(viewer, "box       %.6g x %.6g x %.6g; x1 %s, x2 %s, x3 %s\n", size[0],
                                   size[1], size[2], kind[scene->box_periodic[0]], kind[scene->box_periodic[1]],
                                   kind[scene->box_periodic[2]]));
  PetscCall(PetscViewerASCIIPrintf(
      viewer, "mesh      %" PetscInt_FMT " x %" PetscInt_FMT " x %" PetscInt_FMT " cells, h = %.6g\n", n[0],
      n[1], n[2], scene->h));
  for (int d = 0; d < 3; d++) {
    for (int s = 0; s < 2 && !scene->box_periodic[d]; s++) {
      const PetscReal *u = scene->wall_velocity[d][s];
      PetscCall(PetscViewerASCIIPrintf(viewer, "wall      x%d %s: velocity %.6g,%.6g,%.6g\n", d + 1, side[s],
                                       u[0], u[1], u[2]));
    }
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode ViewFluid(const DLMScene *scene, PetscViewer viewer)
{
  const PetscReal *g = scene->gravity, *G = scene->pressure_gradient;

  PetscFunctionBeginUser;
  PetscCall(PetscViewerASCIIPrintf(viewer, "fluid     %s, viscosity %.6g, density %.6g\n",
                                   DLMFluidModels[scene->fluid_model], scene->fluid_viscosity,
                                   scene->fluid_density));
  if (scene->fluid_model != DLM_FLUID_NEWTONIAN)
    PetscCall(PetscViewerASCIIPrintf(viewer, "polymer   relaxation %.6g, retardation %.6g, %s form, coupling %s, inside spheres %s\n",
                                     scene->relaxation_time, scene->retardation_time, DLMPolymerForms[scene->polymer_form],
                                     DLMCouplings[scene->polymer_coupling], DLMInsides[scene->polymer_inside]));
  if (g[0] != 0 || g[1] != 0 || g[2] != 0)
    PetscCall(PetscViewerASCIIPrintf(viewer, "gravity   %.6g,%.6g,%.6g\n", g[0], g[1], g[2]));
  if (G[0] != 0 || G[1] != 0 || G[2] != 0) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "pressure  mean gradient %.6g,%.6g,%.6g\n", G[0], G[1], G[2]));
  }
  PetscFunctionReturn(0);
}

static const char *AutoText(PetscReal value, char text[32])
{
  if (value == DLM_AUTO) snprintf(text, 32, "auto");
  else snprintf(text, 32, "%.6g", value);
  return text;
}

static PetscErrorCode ViewSpheres(const DLMScene *scene, PetscViewer viewer)
{
  const PetscInt n = scene->n_spheres, shown = n > 5 ? 4 : n;
  char           first[32], second[32];

  PetscFunctionBeginUser;
  if (n == 0) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "spheres   none\n"));
    PetscFunctionReturn(0);
  }
  PetscCall(PetscViewerASCIIPrintf(viewer, "spheres   %" PetscInt_FMT ", %s inertia\n", n,
                                   scene->sphere_inertia ? "with" : "without"));
  for (PetscInt i = 0; i < shown; i++) {
    const DLMSphereSpec *s = &scene->spheres[i];
    PetscCall(PetscViewerASCIIPrintf(
        viewer, "  %-7" PetscInt_FMT " %s at %.6g,%.6g,%.6g, radius %.6g (%.3g h), density %.6g\n", i,
        DLMMotions[s->motion], s->center[0], s->center[1], s->center[2], s->radius, s->radius / scene->h,
        s->density));
  }
  if (shown < n) PetscCall(PetscViewerASCIIPrintf(viewer, "  ...     %" PetscInt_FMT " more\n", n - shown));
  PetscCall(PetscViewerASCIIPrintf(viewer, "pairing   %s, %s points, retraction %s, harmonics %s\n",
                                   DLMPairingTypes[scene->pairing_type], DLMPointSets[scene->pairing_points],
                                   AutoText(scene->pairing_retraction, first), AutoText(scene->pairing_degree, second)));
  PetscCall(PetscViewerASCIIPrintf(viewer, "contact   range %s, stiffness %s\n",
                                   AutoText(scene->contact_range, first),
                                   AutoText(scene->contact_stiffness, second)));
  PetscFunctionReturn(0);
}

static PetscErrorCode ViewAccuracy(const DLMScene *scene, PetscViewer viewer)
{
  PetscFunctionBeginUser;
  if (scene->accuracy == DLM_ACCURACY_NONE) PetscFunctionReturn(0);
  PetscCall(PetscViewerASCIIPrintf(viewer, "accuracy  %s:", DLMAccuracies[scene->accuracy]));
  for (PetscInt i = 0; i < scene->n_preset_keys; i++) {
    const DLMPresetKey *key = &scene->preset_key[i];
    PetscCall(PetscViewerASCIIPrintf(viewer, "%s %s %s", i ? "," : "", key->key, key->applied ? key->value : "as given"));
  }
  PetscCall(PetscViewerASCIIPrintf(viewer, "\n"));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSceneView(const DLMScene *scene, PetscViewer viewer)
{
  PetscBool ascii;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(0);
  PetscCall(PetscViewerASCIIPrintf(viewer, "scene     %s\n",
                                   scene->source[0] ? scene->source : "from the command line"));
  PetscCall(ViewAccuracy(scene, viewer));
  PetscCall(ViewBox(scene, viewer));
  PetscCall(ViewFluid(scene, viewer));
  PetscCall(ViewSpheres(scene, viewer));
  PetscCall(
      PetscViewerASCIIPrintf(viewer, "time      to %.6g in steps of %.6g\n", scene->ts_max_time, scene->ts_dt));
  PetscCall(PetscViewerASCIIPrintf(viewer, "output    %s\n", scene->output_dir));
  PetscFunctionReturn(0);
}
