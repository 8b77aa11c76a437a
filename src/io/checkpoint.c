/* What a checkpoint holds. Each list below is walked to write and to read: see docs/developer.md on adding an item. */
#include "../../include/private/gridimpl.h"
#include "../../include/private/simimpl.h"

/*
  What must not change between the legs of a run, as a user would write it: the text is moved, and a leg that has another one is refused.
*/
static PetscErrorCode MoveFact(DLMCheckpointFile *file, const DLMScene *scene, const char key[], const char format[], ...)
{
  char      name[64], now[DLM_CHECKPOINT_TEXT], text[DLM_CHECKPOINT_TEXT];
  PetscBool same;
  va_list   values;

  PetscFunctionBegin;
  va_start(values, format);
  PetscCall(PetscVSNPrintf(now, sizeof(now), format, NULL, values));
  va_end(values);
  PetscCall(PetscSNPrintf(name, sizeof(name), "scene/%s", key[0] == '-' ? key + 1 : key));
  PetscCall(PetscStrncpy(text, now, sizeof(text)));
  PetscCall(DLMCheckpointText(file, name, text));
  PetscCall(PetscStrcmp(text, now, &same));
  DLMUserCheck(same, scene->comm, "%s %s cannot go on from -restart %s, which has %s; allowed: the same", key, now, file->path, text);
  PetscFunctionReturn(0);
}

static PetscErrorCode MoveNumber(DLMCheckpointFile *file, const DLMScene *scene, const char key[], PetscReal value)
{
  PetscFunctionBegin;
  if (value == DLM_AUTO) PetscCall(MoveFact(file, scene, key, "auto"));
  else PetscCall(MoveFact(file, scene, key, "%.15g", (double)value));
  PetscFunctionReturn(0);
}

static PetscErrorCode MoveScene(DLMCheckpointFile *file, DLMSimulation sim)
{
  const DLMScene *s     = sim->scene;
  const PetscReal *size = s->box_size, *frame = sim->frame_velocity;
  PetscReal      *radius;

  PetscFunctionBegin;
  PetscCall(MoveFact(file, s, "-box_size", "%.15g,%.15g,%.15g", (double)size[0], (double)size[1], (double)size[2]));
  PetscCall(MoveFact(file, s, "-box_periodic", "%d,%d,%d", s->box_periodic[0] != 0, s->box_periodic[1] != 0, s->box_periodic[2] != 0));
  PetscCall(MoveFact(file, s, "-grid_resolution", "%.15g", (double)s->grid_resolution));
  PetscCall(MoveFact(file, s, "-fluid_model", "%s", DLMFluidModels[s->fluid_model]));
  PetscCall(MoveFact(file, s, "-polymer_form", "%s", s->fluid_model ? DLMPolymerForms[s->polymer_form] : "none"));
  PetscCall(MoveFact(file, s, "-polymer_inside", "%s", s->fluid_model ? DLMInsides[s->polymer_inside] : "none"));
  PetscCall(MoveFact(file, s, "-pairing_type", "%s", DLMPairingTypes[s->pairing_type]));
  PetscCall(MoveFact(file, s, "-pairing_points", "%s", DLMPointSets[s->pairing_points]));
  PetscCall(MoveNumber(file, s, "-pairing_spacing", s->pairing_spacing));
  PetscCall(MoveNumber(file, s, "-pairing_degree", s->pairing_degree));
  PetscCall(MoveNumber(file, s, "-pairing_retraction", s->pairing_retraction));
  PetscCall(MoveFact(file, s, "number of spheres", "%" PetscInt_FMT, s->n_spheres));
  PetscCall(MoveFact(file, s, "mean wall velocity", "%.15g,%.15g,%.15g", (double)frame[0], (double)frame[1], (double)frame[2]));
  PetscCall(PetscMalloc1(s->n_spheres, &radius));
  for (PetscInt i = 0; i < s->n_spheres; i++) radius[i] = s->spheres[i].radius;
  PetscCall(DLMCheckpointReals(file, "scene/radii", s->n_spheres, radius));
  for (PetscInt i = 0; i < s->n_spheres; i++)
    DLMUserCheck(radius[i] == s->spheres[i].radius, s->comm, "radius %.15g of sphere %" PetscInt_FMT " cannot go on from -restart %s, which has %.15g; allowed: the same",
                 (double)s->spheres[i].radius, i, file->path, (double)radius[i]);
  PetscCall(PetscFree(radius));
  PetscCall(MoveFact(file, s, "-box_mirror", "%s", s->box_mirror == DLM_MIRROR_NONE ? "none" : "half or whole")); /* the same flow */
  PetscFunctionReturn(0);
}

/* Where the run is, and its records so far. */
static PetscErrorCode MoveRun(DLMCheckpointFile *file, DLMSimulation sim, DLMRunState *run)
{
  DLMPolymerHealth *worst = &sim->worst;

  PetscFunctionBegin;
  PetscCall(DLMCheckpointInts(file, "step", 1, &run->step));
  PetscCall(DLMCheckpointReals(file, "time", 1, &run->time));
  PetscCall(DLMCheckpointReals(file, "dt", 1, &run->dt));
  PetscCall(DLMCheckpointReals(file, "ts_dt", 1, &run->ts_dt));
  PetscCall(DLMCheckpointReals(file, "ts_max_time", 1, &run->ts_max_time));
  PetscCall(DLMCheckpointReals(file, "velocity_time", 1, &sim->velocity_time));
  PetscCall(DLMCheckpointReals(file, "last_interval", 1, &sim->last_interval));
  PetscCall(DLMCheckpointBool(file, "flowing", &sim->flowing));
  PetscCall(DLMCheckpointReals(file, "records/contact_force", 1, &sim->contact.largest));
  PetscCall(DLMCheckpointReals(file, "records/gap", 1, &sim->smallest_gap));
  PetscCall(DLMCheckpointReals(file, "records/slip", 1, &sim->largest_slip));
  PetscCall(DLMCheckpointReals(file, "records/eigenvalue", 1, &worst->smallest_eigenvalue));
  PetscCall(DLMCheckpointReals(file, "records/eigenvalue_place", 3, worst->place));
  PetscCall(DLMCheckpointReals(file, "records/eigenvalue_time", 1, &sim->worst_time));
  PetscCall(DLMCheckpointReals(file, "records/trace", 1, &worst->largest_trace));
  PetscCall(DLMCheckpointReals(file, "records/courant", 1, &worst->courant));
  PetscCall(DLMCheckpointInts(file, "records/substeps", 1, &worst->substeps));
  PetscFunctionReturn(0);
}

/* What the choice of the next step needs; a run that begins to adapt its steps at a restart has none. */
static PetscErrorCode MoveAdapt(DLMCheckpointFile *file, DLMSimulation sim)
{
  DLMAdaptState *a = &sim->adapt;
  PetscInt       n = a->exists ? a->n : 0;

  PetscFunctionBegin;
  PetscCall(DLMCheckpointInts(file, "adapt/n", 1, &n));
  if (n == 0 || !a->exists) PetscFunctionReturn(0);
  PetscCall(DLMCheckpointInts(file, "adapt/known", 1, &a->known));
  PetscCall(DLMCheckpointReals(file, "adapt/interval", 2, a->interval));
  PetscCall(DLMCheckpointReals(file, "adapt/rate_before", n, a->rate[0]));
  PetscCall(DLMCheckpointReals(file, "adapt/rate", n, a->rate[1]));
  PetscFunctionReturn(0);
}

static PetscErrorCode MoveSpheres(DLMCheckpointFile *file, DLMSimulation sim)
{
  DLMSphereState *state;
  DLMSaddleState  saddle;
  PetscInt        n;

  PetscFunctionBegin;
  if (!sim->spheres) PetscFunctionReturn(0);
  PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
  PetscCall(DLMCheckpointReals(file, "spheres/states", n * (PetscInt)(sizeof(*state) / sizeof(PetscReal)), (PetscReal *)state));
  for (PetscInt i = 0; i < n && sim->grid->half; i++) state[i].center[1] = 0.0; /* the whole box may have left it there to rounding */
  PetscCall(DLMSaddleStateCreate(sim->saddle, &saddle));
  if (file->writing) PetscCall(DLMSaddleGetState(sim->saddle, &saddle));
  PetscCall(DLMCheckpointReals(file, "spheres/multipliers", saddle.n_multipliers, saddle.multipliers));
  PetscCall(DLMCheckpointReals(file, "spheres/reference", 1, &saddle.reference));
  PetscCall(DLMCheckpointInts(file, "blocks/n_ranks", 1, &saddle.blocks.n_ranks));
  PetscCall(DLMCheckpointInts(file, "blocks/first", n, saddle.blocks.first));
  PetscCall(DLMCheckpointInts(file, "blocks/rank", n, saddle.blocks.rank));
  PetscCall(DLMCheckpointReals(file, "blocks/center", 3 * n, saddle.blocks.center));
  PetscCall(DLMCheckpointReals(file, "blocks/origin", 3 * n, saddle.blocks.origin));
  if (!file->writing) PetscCall(DLMSaddleSetState(sim->saddle, &saddle));
  PetscCall(DLMSaddleStateDestroy(&saddle));
  PetscFunctionReturn(0);
}

static PetscErrorCode MoveVec(DLMCheckpointFile *file, const char *name, DM dm, const PetscReal *sign, Vec v)
{
  Vec copy;

  PetscFunctionBegin;
  PetscCall(DMGetGlobalVector(dm, &copy));
  PetscCall(VecCopy(v, copy));
  PetscCall(DLMCheckpointField(file, name, dm, sign, copy));
  if (!file->writing) PetscCall(VecCopy(copy, v));
  PetscCall(DMRestoreGlobalVector(dm, &copy));
  PetscFunctionReturn(0);
}

static PetscErrorCode MoveFluid(DLMCheckpointFile *file, DLMSimulation sim)
{
  DM  velocity, pressure;
  Vec x, u, p;

  PetscFunctionBegin;
  PetscCall(DLMGridGetDMs(sim->grid, &velocity, &pressure));
  PetscCall(DLMSaddleGetFluid(sim->saddle, &x));
  PetscCall(DLMStokesGetParts(sim->stokes, x, &u, &p));
  PetscCall(MoveVec(file, "fluid/velocity", velocity, DLMGridSign(sim->grid, DLMMirrorVector), u));
  PetscCall(MoveVec(file, "fluid/pressure", pressure, DLMGridSign(sim->grid, DLMMirrorScalar), p));
  PetscCall(DLMStokesRestoreParts(sim->stokes, x, &u, &p));
  PetscFunctionReturn(0);
}

/* C is planar on every rank; in the file its components are interleaved: 11, 22, 33, 12, 13, 23. */
static PetscErrorCode Interleave(Vec C, Vec nodal, PetscBool back)
{
  PetscScalar *planar, *x;
  PetscInt     n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(C, &n));
  PetscCall(VecGetArray(C, &planar));
  PetscCall(VecGetArray(nodal, &x));
  for (PetscInt i = 0; i < n / 6; i++)
    for (int k = 0; k < 6; k++) {
      if (back) planar[k * (n / 6) + i] = x[6 * i + k];
      else x[6 * i + k] = planar[k * (n / 6) + i];
    }
  PetscCall(VecRestoreArray(nodal, &x));
  PetscCall(VecRestoreArray(C, &planar));
  PetscFunctionReturn(0);
}

/* A symmetric tensor of the polymer's layout. */
static PetscErrorCode MoveTensor(DLMCheckpointFile *file, const char *name, DLMGrid grid, Vec tensor)
{
  DM  dm;
  Vec nodal;

  PetscFunctionBegin;
  PetscCall(DMDACreateCompatibleDMDA(grid->velocity, 6, &dm));
  PetscCall(DMCreateGlobalVector(dm, &nodal));
  if (file->writing) PetscCall(Interleave(tensor, nodal, PETSC_FALSE));
  PetscCall(DLMCheckpointField(file, name, dm, DLMGridSign(grid, DLMMirrorTensor), nodal));
  if (!file->writing) PetscCall(Interleave(tensor, nodal, PETSC_TRUE));
  PetscCall(VecDestroy(&nodal));
  PetscCall(DMDestroy(&dm));
  PetscFunctionReturn(0);
}

/* The last gradient follows from the velocity, which has to be there already. */
static PetscErrorCode MovePolymer(DLMCheckpointFile *file, DLMSimulation sim)
{
  DLMPolymerState state;
  Vec             x, C, rate;

  PetscFunctionBegin;
  if (!sim->polymer) PetscFunctionReturn(0);
  PetscCall(DLMPolymerGetState(sim->polymer, &state));
  PetscCall(DLMPolymerGetConformation(sim->polymer, &C));
  PetscCall(VecDuplicate(C, &rate));
  PetscCall(MoveTensor(file, "polymer/conformation", sim->grid, C));
  PetscCall(DLMCheckpointInts(file, "polymer/n_forces", 1, &state.n_forces));
  PetscCall(DLMCheckpointReals(file, "polymer/time_now", 1, &state.time_now));
  PetscCall(DLMCheckpointReals(file, "polymer/time_before", 1, &state.time_before));
  PetscCall(DLMCheckpointInts(file, "polymer/n_velocities", 1, &state.n_velocities));
  PetscCall(DLMCheckpointReals(file, "polymer/velocity_time", 1, &state.velocity_time));
  PetscCall(DLMCheckpointReals(file, "polymer/velocity_time_before", 1, &state.velocity_time_before));
  PetscCall(DLMCheckpointInts(file, "polymer/cut", 1, &state.cut));
  if (state.n_near > 0) PetscCall(DLMCheckpointReals(file, "polymer/near_flow", state.n_near, state.near));
  if (state.n_forces > 0) PetscCall(MoveVec(file, "polymer/force_now", sim->grid->velocity, DLMGridSign(sim->grid, DLMMirrorVector), state.force_now));
  if (state.n_forces > 1) PetscCall(MoveVec(file, "polymer/force_before", sim->grid->velocity, DLMGridSign(sim->grid, DLMMirrorVector), state.force_before));
  if (state.n_velocities > 1 && file->writing) PetscCall(DLMPolymerGetRateBefore(sim->polymer, rate));
  if (state.n_velocities > 1) PetscCall(MoveTensor(file, "polymer/rate_before", sim->grid, rate));
  if (!file->writing) {
    PetscCall(DLMSaddleGetFluid(sim->saddle, &x));
    PetscCall(DLMPolymerSetState(sim->polymer, &state, rate, x));
  }
  PetscCall(VecDestroy(&rate));
  PetscFunctionReturn(0);
}

static PetscErrorCode MoveState(DLMCheckpointFile *file, DLMSimulation sim, DLMRunState *run)
{
  PetscFunctionBegin;
  PetscCall(MoveRun(file, sim, run));
  PetscCall(MoveAdapt(file, sim));
  PetscCall(MoveSpheres(file, sim));
  PetscCall(MoveFluid(file, sim));
  PetscCall(MovePolymer(file, sim));
  PetscFunctionReturn(0);
}


PetscErrorCode DLMCheckpointWrite(DLMSimulation sim, const char *path, PetscReal dt, int *failed)
{
  DLMRunState        run = { .dt = dt, .ts_dt = sim->scene->ts_dt, .ts_max_time = sim->scene->ts_max_time };
  DLMCheckpointFile *file;

  PetscFunctionBegin;
  PetscCall(TSGetStepNumber(sim->ts, &run.step));
  PetscCall(TSGetTime(sim->ts, &run.time));
  PetscCall(DLMCheckpointFileCreate(sim->scene->comm, path, &file));
  PetscCall(MoveScene(file, sim));
  PetscCall(MoveState(file, sim, &run));
  PetscCall(DLMCheckpointFileSave(file, failed));
  PetscCall(DLMCheckpointFileDestroy(&file));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMCheckpointOpen(DLMSimulation sim)
{
  PetscFunctionBegin;
  if (!sim->scene->restart[0]) PetscFunctionReturn(0);
  PetscCall(DLMCheckpointFileOpen(sim->scene->comm, sim->scene->restart, &sim->restart));
  PetscCall(MoveScene(sim->restart, sim));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMCheckpointReadStart(DLMSimulation sim, PetscInt *step, PetscReal *time)
{
  PetscFunctionBegin;
  PetscCall(DLMCheckpointInts(sim->restart, "step", 1, step));
  PetscCall(DLMCheckpointReals(sim->restart, "time", 1, time));
  PetscFunctionReturn(0);
}

/* Steps near the end of a leg were fitted to that end: another end starts from the scene's dt, and so does a changed dt. */
PetscErrorCode DLMCheckpointLoad(DLMSimulation sim)
{
  const DLMScene *scene = sim->scene;
  DLMRunState     run;
  PetscBool       fitted;

  PetscFunctionBegin;
  PetscCall(MoveState(sim->restart, sim, &run));
  PetscCall(DLMCheckpointFileDestroy(&sim->restart));
  fitted = (PetscBool)(run.ts_max_time != scene->ts_max_time && run.time + 2.02 * run.dt >= run.ts_max_time);
  PetscCall(TSSetStepNumber(sim->ts, run.step));
  PetscCall(TSSetTime(sim->ts, run.time));
  PetscCall(TSSetTimeStep(sim->ts, run.ts_dt != scene->ts_dt || fitted ? scene->ts_dt : run.dt));
  sim->first_step = run.step;
  PetscFunctionReturn(0);
}
