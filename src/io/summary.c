#include <errno.h>
#include <dlmversion.h>
#include "../../include/private/memory.h"
#include "../../include/private/outputimpl.h"
#include "../../include/private/wholefile.h"

static void Vector(FILE *file, const char *name, const PetscReal x[3])
{
  fprintf(file, "    \"%s\": [%.15g, %.15g, %.15g],\n", name, (double)x[0], (double)x[1], (double)x[2]);
}

/* JSON has no infinity; PETSc's is a large number. */
static void Number(FILE *file, const char *name, PetscReal x)
{
  if (PetscIsInfOrNanReal(x) || x >= PETSC_INFINITY) fprintf(file, "  \"%s\": null,\n", name);
  else fprintf(file, "  \"%s\": %.15g,\n", name, (double)x);
}

static void Quoted(FILE *file, const char *text)
{
  fputc('"', file);
  for (; *text; text++) {
    if (*text == '"' || *text == '\\') fputc('\\', file);
    if ((unsigned char)*text >= 32) fputc(*text, file);
  }
  fputc('"', file);
}

static void Text(FILE *file, const char *name, const char *text, const char *end)
{
  fprintf(file, "\"%s\": ", name);
  Quoted(file, text);
  fputs(end, file);
}

static void Line(FILE *file, const char *name, const char *text)
{
  fputs("    ", file);
  Text(file, name, text, ",\n");
}

static PetscErrorCode WriteVersion(FILE *file)
{
  const char *name;
  char        value[1024];

  PetscFunctionBegin;
  fputs("  \"version\": {", file);
  for (PetscInt k = 0;; k++) {
    PetscCall(DLMVersionGetFact(k, &name, value, sizeof(value)));
    if (!name) break;
    fprintf(file, "%s\n    \"%s\": ", k ? "," : "", name);
    Quoted(file, value);
  }
  fputs("\n  },\n", file);
  PetscFunctionReturn(0);
}

/* As the scene starts them. */
static void WriteSpheres(FILE *file, const DLMScene *scene)
{
  fprintf(file, "    \"n_spheres\": %ld,\n    \"spheres\": [", (long)scene->n_spheres);
  for (PetscInt i = 0; i < scene->n_spheres; i++) {
    const DLMSphereSpec *s = &scene->spheres[i];
    fprintf(file, "%s\n      {\"radius\": %.15g, \"density\": %.15g, \"motion\": \"%s\"", i ? "," : "", (double)s->radius, (double)s->density, DLMMotions[s->motion]);
    fprintf(file, ", \"center\": [%.15g, %.15g, %.15g]", (double)s->center[0], (double)s->center[1], (double)s->center[2]);
    fprintf(file, ", \"force\": [%.15g, %.15g, %.15g]", (double)s->force[0], (double)s->force[1], (double)s->force[2]);
    fprintf(file, ", \"torque\": [%.15g, %.15g, %.15g]}", (double)s->torque[0], (double)s->torque[1], (double)s->torque[2]);
  }
  fputs("\n    ]\n", file);
}

/* What -accuracy set, and which of its keys were given by hand. */
static void WriteAccuracy(FILE *file, const DLMScene *scene)
{
  fprintf(file, "    \"accuracy\": {\"preset\": \"%s\"", DLMAccuracies[scene->accuracy]);
  for (PetscInt i = 0; i < scene->n_preset_keys; i++)
    fprintf(file, ", \"%s\": \"%s\"", scene->preset_key[i].key, scene->preset_key[i].applied ? scene->preset_key[i].value : "as given");
  fputs("},\n", file);
}

static void WriteScene(FILE *file, DLMSimulation sim)
{
  static const char *const walls[3][2] = { { "wall_velocity_x1_lower", "wall_velocity_x1_upper" },
                                           { "wall_velocity_x2_lower", "wall_velocity_x2_upper" },
                                           { "wall_velocity_lower", "wall_velocity_upper" } };
  const DLMScene *scene = sim->scene;

  fputs("  \"scene\": {\n", file);
  Line(file, "source", scene->source);
  WriteAccuracy(file, scene);
  Vector(file, "box_size", scene->box_size);
  fprintf(file, "    \"box_periodic\": [%s, %s, %s],\n", scene->box_periodic[0] ? "true" : "false", scene->box_periodic[1] ? "true" : "false",
          scene->box_periodic[2] ? "true" : "false");
  fprintf(file, "    \"box_mirror\": \"%s\",\n", DLMMirrors[scene->box_mirror]);
  fprintf(file, "    \"grid_resolution\": %.15g,\n    \"cells\": [%ld, %ld, %ld],\n", (double)scene->grid_resolution, (long)scene->cells[0],
          (long)scene->cells[1], (long)scene->cells[2]);
  for (int d = 0; d < 3; d++)
    for (int side = 0; side < 2 && (d == 2 || !scene->box_periodic[d]); side++) Vector(file, walls[d][side], scene->wall_velocity[d][side]);
  Vector(file, "gravity", scene->gravity);
  Vector(file, "pressure_gradient", scene->pressure_gradient);
  Line(file, "fluid_model", DLMFluidModels[scene->fluid_model]);
  fprintf(file, "    \"fluid_density\": %.15g,\n    \"fluid_viscosity\": %.15g,\n", (double)scene->fluid_density, (double)scene->fluid_viscosity);
  if (sim->polymer) {
    fprintf(file, "    \"relaxation_time\": %.15g,\n    \"retardation_time\": %.15g,\n    \"carreau_n\": %.15g,\n", (double)scene->relaxation_time,
            (double)scene->retardation_time, (double)scene->carreau_n);
    Line(file, "polymer_form", DLMPolymerForms[scene->polymer_form]);
    Line(file, "polymer_coupling", DLMCouplings[scene->polymer_coupling]);
    Line(file, "polymer_inside", DLMInsides[scene->polymer_inside]);
    fprintf(file, "    \"polymer_mode_amplitude\": %.15g,\n", (double)scene->polymer_mode_amplitude);
    Line(file, "polymer_mode_plane", DLMPlanes[scene->polymer_mode_plane]);
  }
  Line(file, "pairing_type", DLMPairingTypes[scene->pairing_type]);
  Line(file, "pairing_points", DLMPointSets[scene->pairing_points]);
  fprintf(file, "    \"lubrication\": %s,\n", sim->lubrication.exists ? "true" : "false");
  fprintf(file, "    \"contact_range\": %.15g,\n    \"contact_stiffness\": %.15g,\n", (double)sim->contact.range, (double)sim->contact.stiffness);
  fprintf(file, "    \"sphere_inertia\": %s,\n", scene->sphere_inertia ? "true" : "false");
  WriteSpheres(file, scene);
  fputs("  },\n", file);
}

static PetscErrorCode WriteWork(FILE *file, DLMSimulation sim)
{
  DLMSaddleWork work;
  const char   *name;
  PetscReal     seconds;
  PetscInt      calls;

  PetscFunctionBegin;
  PetscCall(DLMSaddleGetWork(sim->saddle, &work));
  fprintf(file, "  \"iterations\": {\"bodies_total\": %ld, \"bodies_most\": %ld, \"saddle_solves\": %ld, \"blocks_built\": %ld},\n", (long)work.iterations,
          (long)work.most_iterations, (long)work.solves, (long)work.blocks_built);
  fprintf(file, "  \"seconds_by_substep\": {\"set_up\": %.6g", sim->setup_seconds);
  for (PetscInt k = 0;; k++) {
    PetscCall(DLMSplitGetTime(sim->ts, k, &name, &seconds, &calls));
    if (!name) break;
    if (calls > 0) fprintf(file, ", \"%s\": %.6g", name, (double)seconds);
  }
  fputs("},\n", file);
  PetscFunctionReturn(0);
}

/* What was built and what was not, and the time of the outputs that were written. */
static void WriteModelled(FILE *file, const DLMModelled modelled[DLM_N_PARTS], const DLMPartRecord part[DLM_N_PARTS])
{
  const char *separator = "";

  fputs("  \"modelled\": [", file);
  for (int k = 0; k < DLM_N_PARTS; k++) {
    fprintf(file, "%s\n    {", k ? "," : "");
    Text(file, "object", modelled[k].object, ", ");
    fprintf(file, "\"built\": %s, ", modelled[k].built ? "true" : "false");
    Text(file, "why", modelled[k].why, ", ");
    fprintf(file, "\"bytes\": %.0f}", (double)modelled[k].bytes);
  }
  fputs("\n  ],\n  \"seconds_by_output\": {", file);
  for (int k = DLM_PART_TRAJECTORY; k <= DLM_PART_CHECKPOINTS; k++) {
    if (part[k].seconds <= 0.0) continue;
    fprintf(file, "%s\"%s\": %.6g", separator, modelled[k].object, part[k].seconds);
    separator = ", ";
  }
  fputs("},\n", file);
}

static void WriteHealth(FILE *file, DLMSimulation sim)
{
  const DLMPolymerHealth *w = &sim->worst;

  fprintf(file, "  \"polymer\": {\"smallest_eigenvalue\": %.15g, \"smallest_eigenvalue_place\": [%.15g, %.15g, %.15g], \"smallest_eigenvalue_time\": %.15g,\n",
          (double)w->smallest_eigenvalue, (double)w->place[0], (double)w->place[1], (double)w->place[2], (double)sim->worst_time);
  fprintf(file, "    \"largest_trace\": %.15g, \"courant_number\": %.15g, \"advection_substeps\": %ld, \"elastic_number\": %.15g},\n", (double)w->largest_trace,
          (double)w->courant, (long)w->substeps, (double)DLMSimulationElasticNumber(sim, sim->scene->ts_dt, w->largest_trace));
}

/* Largest entry of B u over the volume of a pressure node: what is left of div u. */
static PetscErrorCode LargestDivergence(DLMSimulation sim, PetscReal *largest)
{
  Vec x, u, p, flux, rhs, g;
  Mat B;

  PetscFunctionBegin;
  PetscCall(DLMStokesGetOperators(sim->stokes, NULL, NULL, &B));
  PetscCall(DLMSaddleGetFluid(sim->saddle, &x));
  PetscCall(DLMStokesGetParts(sim->stokes, x, &u, &p));
  PetscCall(VecDuplicate(p, &flux));
  PetscCall(MatMult(B, u, flux));
  PetscCall(DLMStokesRestoreParts(sim->stokes, x, &u, &p));
  PetscCall(DLMStokesGetWallForce(sim->stokes, &rhs));
  PetscCall(DLMStokesGetParts(sim->stokes, rhs, NULL, &g));
  PetscCall(VecAXPY(flux, -1.0, g));
  PetscCall(DLMStokesRestoreParts(sim->stokes, rhs, NULL, &g));
  PetscCall(VecNorm(flux, NORM_INFINITY, largest));
  *largest /= 8.0 * sim->scene->h * sim->scene->h * sim->scene->h;
  PetscCall(VecDestroy(&flux));
  PetscFunctionReturn(0);
}

/* Number of velocity nodes. */
static long Nodes(const DLMScene *scene)
{
  long n = 1;

  for (int d = 0; d < 3; d++) n *= DLMSceneNodes(scene, d);
  return n;
}

/* What all ranks find together. */
typedef struct {
  PetscMPIInt ranks;
  PetscReal   divergence, memory;
  DLMModelled modelled[DLM_N_PARTS];
} Findings;

static PetscErrorCode WriteAll(FILE *file, DLMOutput output, const Findings *found)
{
  DLMSimulation   sim   = output->sim;
  const DLMScene *scene = sim->scene;
  PetscReal       time;
  PetscInt        steps, rejected, order;
  PetscLogDouble  now;
  const char     *scheme;

  PetscFunctionBegin;
  PetscCall(TSGetTime(sim->ts, &time));
  PetscCall(TSGetStepNumber(sim->ts, &steps));
  PetscCall(TSGetStepRejections(sim->ts, &rejected));
  PetscCall(DLMSplitGetScheme(sim->ts, &scheme, &order));
  PetscCall(PetscTime(&now));
  fputs("{\n", file);
  PetscCall(WriteVersion(file));
  WriteScene(file, sim);
  fprintf(file, "  \"nodes\": %ld,\n  \"ranks\": %d,\n  \"scheme\": \"%s\",\n  \"dt\": %.15g,\n  \"steps\": %ld,\n  \"steps_rejected\": %ld,\n",
          Nodes(scene), found->ranks, scheme, (double)scene->ts_dt, (long)steps, (long)rejected);
  fprintf(file, "  \"frame_velocity\": [%.15g, %.15g, %.15g],\n", (double)sim->frame_velocity[0], (double)sim->frame_velocity[1], (double)sim->frame_velocity[2]);
  Number(file, "time", time);
  Number(file, "seconds", now - output->started);
  PetscCall(WriteWork(file, sim));
  WriteModelled(file, found->modelled, sim->part);
  Number(file, "peak_memory_MiB", found->memory);
  Number(file, "largest_slip", sim->largest_slip);
  Number(file, "smallest_gap", sim->smallest_gap);
  Number(file, "largest_contact_force", sim->contact.largest);
  if (sim->polymer) WriteHealth(file, sim);
  fprintf(file, "  \"largest_divergence\": %.6g\n}\n", (double)found->divergence);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSummaryWrite(DLMOutput output)
{
  const MPI_Comm comm = output->sim->scene->comm;
  PetscMPIInt    rank;
  Findings       found;
  int            failed = 0;
  char           path[PETSC_MAX_PATH_LEN], *text = NULL;
  size_t         size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &found.ranks));
  PetscCall(LargestDivergence(output->sim, &found.divergence));
  PetscCall(DLMSimulationCountWork(output->sim));
  PetscCall(DLMSimulationGetModelled(output->sim, found.modelled));
  found.memory = DLMMemoryPeak() / 1048576.0;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &found.memory, 1, MPIU_REAL, MPIU_SUM, comm));
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/summary.json", output->sim->scene->output_dir));
  if (rank == 0) {
    FILE *file = open_memstream(&text, &size);
    PetscCheck(file, PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory for summary.json");
    PetscCall(WriteAll(file, output, &found));
    failed = fclose(file) ? ENOMEM : DLMFileReplace(path, text, size, NULL, 0);
    free(text);
  }
  PetscCall(DLMOutputRequire(output->sim, failed, path));
  PetscFunctionReturn(0);
}
