/*
  What a simulation consists of: one table. A row's function decides from the scene, builds what is needed, and says why or why not. The table builds the
  simulation (sim.c), is shown at the start of a run and written to summary.json, and dryrun.c estimates by it.
*/
#include <stdarg.h>
#include "../../include/private/amounts.h"
#include "../../include/private/memory.h"
#include "../../include/private/simimpl.h"

typedef struct {
  const char *object;
  PetscErrorCode (*decide)(DLMSimulation sim, DLMPartRecord *part);
} PartRow;

static PetscErrorCode Say(DLMPartRecord *part, PetscBool built, const char *format, ...)
{
  va_list arguments;

  PetscFunctionBegin;
  part->built = built;
  va_start(arguments, format);
  vsnprintf(part->why, sizeof(part->why), format, arguments);
  va_end(arguments);
  PetscFunctionReturn(0);
}

static const char no_spheres[] = "the scene has no spheres";

/* Bytes and seconds that the part `from` counted belong to this one. */
static void Take(DLMSimulation sim, DLMPart from, DLMPartRecord *part, PetscReal bytes, PetscLogDouble seconds)
{
  sim->part[from].bytes -= bytes;
  sim->part[from].seconds -= seconds;
  part->bytes += bytes;
  part->seconds += seconds;
}

static PetscErrorCode Grid(DLMSimulation sim, DLMPartRecord *part)
{
  const PetscInt *cells = sim->whole->cells;
  static const char *const symmetric[] = { [DLM_MIRROR_NONE] = "", [DLM_MIRROR_WHOLE] = ", symmetric in x2", [DLM_MIRROR_HALF] = ", of which x2 < 0 is the mirror image of the rest" };

  PetscFunctionBegin;
  PetscCall(DLMGridCreate(&sim->riding, &sim->grid));
  PetscCall(Say(part, PETSC_TRUE, "velocity on a mesh of %ld x %ld x %ld cells%s, pressure on every second node", (long)cells[0], (long)cells[1], (long)cells[2],
                symmetric[sim->whole->box_mirror]));
  PetscFunctionReturn(0);
}

static PetscErrorCode Stokes(DLMSimulation sim, DLMPartRecord *part)
{
  PCType type;
  KSP    ksp;
  PC     pc;

  PetscFunctionBegin;
  PetscCall(DLMStokesCreate(sim->grid, &sim->riding, &sim->stokes));
  PetscCall(DLMStokesGetKSP(sim->stokes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetType(pc, &type));
  PetscCall(Say(part, PETSC_TRUE, "every step solves for the flow, by -stokes_pc_type %s", type));
  PetscFunctionReturn(0);
}

static PetscErrorCode PressureBlocks(DLMSimulation sim, DLMPartRecord *part)
{
  const char    *absent;
  PetscReal      bytes;
  PetscLogDouble seconds;

  PetscFunctionBegin;
  PetscCall(DLMStokesGetPressureBlocks(sim->stokes, &bytes, &seconds, &absent));
  Take(sim, DLM_PART_STOKES, part, bytes, seconds);
  PetscCall(Say(part, (PetscBool)!absent, "%s", absent ? absent : "two periodic axes: the pressure is solved for exactly"));
  PetscFunctionReturn(0);
}

static PetscErrorCode Spheres(DLMSimulation sim, DLMPartRecord *part)
{
  const PetscInt n = sim->scene->n_spheres, all = sim->whole->n_spheres;

  PetscFunctionBegin;
  if (!n) {
    PetscCall(Say(part, PETSC_FALSE, no_spheres));
    PetscFunctionReturn(0);
  }
  PetscCall(DLMSpheresCreate(sim->grid, &sim->riding, &sim->spheres));
  PetscCall(DLMPairingCreate(sim->spheres, &sim->riding, &sim->pairing));
  PetscCall(PetscCalloc2(3 * n, &sim->force, 3 * n, &sim->torque));
  PetscCall(Say(part, PETSC_TRUE, "%ld sphere%s: states, points and their pairing with the mesh", (long)all, all > 1 ? "s" : ""));
  PetscFunctionReturn(0);
}

static PetscErrorCode Lubrication(DLMSimulation sim, DLMPartRecord *part)
{
  PetscFunctionBegin;
  if (!sim->spheres) {
    PetscCall(Say(part, PETSC_FALSE, no_spheres));
    PetscFunctionReturn(0);
  }
  PetscCall(DLMLubricationCreate(sim->whole, &sim->lubrication));
  if (sim->lubrication.absent) PetscCall(Say(part, PETSC_FALSE, "%s", sim->lubrication.absent));
  else PetscCall(Say(part, PETSC_TRUE, "friction across gaps of up to %.3g mean radii, which the mesh does not resolve", (double)sim->lubrication.range));
  PetscFunctionReturn(0);
}

static PetscErrorCode Contact(DLMSimulation sim, DLMPartRecord *part)
{
  PetscFunctionBegin;
  if (!sim->spheres) {
    PetscCall(Say(part, PETSC_FALSE, no_spheres));
    PetscFunctionReturn(0);
  }
  PetscCall(DLMContactCreate(sim->whole, sim->lubrication.exists, &sim->contact));
  if (sim->contact.absent) PetscCall(Say(part, PETSC_FALSE, "%s", sim->contact.absent));
  else PetscCall(Say(part, PETSC_TRUE, "bodies can meet: range %.3g, stiffness %.3g", (double)sim->contact.range, (double)sim->contact.stiffness));
  PetscFunctionReturn(0);
}

/* Seen from the mesh, which may ride: a sphere that is held may move in it. */
static PetscErrorCode Motion(DLMSimulation sim, DLMPartRecord *part)
{
  PetscBool moves = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < sim->riding.n_spheres; i++) {
    const DLMSphereSpec *s = &sim->riding.spheres[i];
    moves = (PetscBool)(moves || s->motion == DLM_MOTION_FREE || s->velocity[0] != 0.0 || s->velocity[1] != 0.0 || s->velocity[2] != 0.0);
  }
  if (moves) PetscCall(PetscCalloc1(3 * sim->riding.n_spheres, &sim->start));
  PetscCall(Say(part, moves, "%s", moves ? "centres move: sub-steps predict and correct" : (sim->spheres ? "no sphere's centre moves" : no_spheres)));
  PetscFunctionReturn(0);
}

static PetscErrorCode InertiaOfSpheres(DLMSimulation sim, DLMPartRecord *part)
{
  PetscBool free = PETSC_FALSE;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < sim->whole->n_spheres; i++) free = (PetscBool)(free || sim->whole->spheres[i].motion != DLM_MOTION_FIXED);
  if (!sim->spheres) PetscCall(Say(part, PETSC_FALSE, no_spheres));
  else if (!sim->whole->sphere_inertia) PetscCall(Say(part, PETSC_FALSE, "-sphere_inertia 0"));
  else PetscCall(Say(part, free, free ? "-sphere_inertia: M dV/dt and I domega/dt" : "every sphere is fixed"));
  PetscFunctionReturn(0);
}

static PetscErrorCode Flow(DLMSimulation sim, DLMPartRecord *part)
{
  DLMSaddleParts parts;

  PetscFunctionBegin;
  PetscCall(DLMSaddleCreate(sim->stokes, sim->spheres, sim->pairing, &sim->riding, &sim->saddle));
  PetscCall(DLMSaddleGetParts(sim->saddle, &parts));
  Take(sim, DLM_PART_FLOW, &sim->part[DLM_PART_SPHERES], parts.pairing_bytes, 0.0);
  PetscCall(Say(part, PETSC_TRUE, sim->spheres ? "velocity and pressure, and the solver of fluid and spheres together" : "velocity and pressure"));
  PetscFunctionReturn(0);
}

static PetscErrorCode Responses(DLMSimulation sim, DLMPartRecord *part)
{
  DLMSaddleParts parts;

  PetscFunctionBegin;
  PetscCall(DLMSaddleGetParts(sim->saddle, &parts));
  Take(sim, DLM_PART_FLOW, part, parts.response_bytes, 0.0);
  const PetscBool exist = (PetscBool)(parts.response_bytes > 0.0);
  if (!sim->spheres) PetscCall(Say(part, PETSC_FALSE, no_spheres));
  else PetscCall(Say(part, exist, exist ? "tables from 24 Stokes solves, to build the dense blocks from" : "-saddle_split velocity does without"));
  PetscFunctionReturn(0);
}

static PetscErrorCode Blocks(DLMSimulation sim, DLMPartRecord *part)
{
  DLMSaddleParts parts;

  PetscFunctionBegin;
  PetscCall(DLMSaddleGetParts(sim->saddle, &parts));
  Take(sim, DLM_PART_FLOW, part, parts.block_bytes, parts.block_seconds);
  if (!sim->spheres) PetscCall(Say(part, PETSC_FALSE, no_spheres));
  else if (sim->scene->n_spheres < sim->whole->n_spheres) PetscCall(Say(part, PETSC_TRUE, "precondition the spheres, one for each cluster of near ones"));
  else
    PetscCall(Say(part, PETSC_TRUE, "precondition the spheres: %ld block%s of up to %ld unknowns", (long)parts.clusters, parts.clusters > 1 ? "s" : "", (long)parts.largest));
  PetscFunctionReturn(0);
}

static PetscErrorCode Polymer(DLMSimulation sim, DLMPartRecord *part)
{
  const PetscBool viscoelastic = (PetscBool)(sim->scene->fluid_model != DLM_FLUID_NEWTONIAN);

  PetscFunctionBegin;
  if (viscoelastic) PetscCall(DLMSimulationCreatePolymer(sim));
  PetscCall(Say(part, viscoelastic, "-fluid_model %s%s", DLMFluidModels[sim->scene->fluid_model],
                viscoelastic ? ": C, its gradient and stress; sub-steps advect, stretch, judge" : ""));
  PetscFunctionReturn(0);
}

static PetscErrorCode Stepping(DLMSimulation sim, DLMPartRecord *part)
{
  const char *scheme;
  char        steps[96];

  PetscFunctionBegin;
  PetscCall(DLMSimulationCreateSolution(sim));
  PetscCall(DLMSimulationCreateStepping(sim));
  PetscCall(DLMSplitGetScheme(sim->ts, &scheme, NULL));
  PetscCall(DLMSplitDescribe(sim->ts, sizeof(steps), steps));
  PetscCall(Say(part, PETSC_TRUE, "-ts_split_scheme %s:%s", scheme, steps));
  PetscFunctionReturn(0);
}

static PetscErrorCode AdaptedSteps(DLMSimulation sim, DLMPartRecord *part)
{
  PetscFunctionBegin;
  PetscCall(Say(part, sim->adapt.exists, sim->adapt.exists ? "-ts_adapt_type scene: rates of the steps before" : "-ts_adapt_type none: steps of -ts_dt"));
  PetscFunctionReturn(0);
}

static PetscErrorCode StepCopy(DLMSimulation sim, DLMPartRecord *part)
{
  PetscFunctionBegin;
  if (sim->polymer || sim->adapt.exists) PetscCall(DLMSimulationKeep(sim)); /* makes the room */
  if (sim->polymer) PetscCall(Say(part, PETSC_TRUE, "a step that loses positivity of C is undone"));
  else PetscCall(Say(part, sim->adapt.exists, sim->adapt.exists ? "a step whose error is too large is undone" : "neither polymer nor -ts_adapt_type scene: no step is undone"));
  PetscFunctionReturn(0);
}

static PetscErrorCode Trajectory(DLMSimulation sim, DLMPartRecord *part)
{
  PetscFunctionBegin;
  if (sim->spheres) PetscCall(Say(part, PETSC_TRUE, "trajectory.csv, -output_every %ld", (long)sim->scene->output_every));
  else PetscCall(Say(part, PETSC_FALSE, no_spheres));
  PetscFunctionReturn(0);
}

static PetscErrorCode Bulk(DLMSimulation sim, DLMPartRecord *part)
{
  DLMShear shear;

  PetscFunctionBegin;
  if (DLMSceneGetShear(sim->whole, &shear)) PetscCall(Say(part, PETSC_TRUE, "bulk.csv, -output_every %ld: walls shear the box at the rate %.4g", (long)sim->scene->output_every, (double)shear.rate));
  else PetscCall(Say(part, PETSC_FALSE, "no shear between two walls alone"));
  PetscFunctionReturn(0);
}

/* With the size of an output and, if the steps are known, of all of a run that starts anew: a disk too small is seen in time. */
static PetscErrorCode Fields(DLMSimulation sim, DLMPartRecord *part)
{
  const PetscInt every = sim->scene->output_fields_every;
  PetscReal      bytes = 0.0, end, steps;
  PetscInt       most;
  char           one[32], all[32], run[48] = "";

  PetscFunctionBegin;
  if (!every) {
    PetscCall(Say(part, PETSC_FALSE, "-output_fields_every 0"));
    PetscFunctionReturn(0);
  }
  PetscCall(DLMFieldsGetBytes(sim, &bytes));
  PetscCall(TSGetMaxTime(sim->ts, &end));
  PetscCall(TSGetMaxSteps(sim->ts, &most));
  steps = DLMSimulationCountSteps(end, sim->scene->ts_dt, most);
  if (!sim->adapt.exists) PetscCall(PetscSNPrintf(run, sizeof(run), ", %s in all", DLMSizeText(bytes * DLMSimulationCountOutputs(steps, every), all)));
  PetscCall(Say(part, PETSC_TRUE, "fields.h5 and fields.xmf, -output_fields_every %ld: %s each%s", (long)every, DLMSizeText(bytes, one), run));
  PetscFunctionReturn(0);
}

static PetscErrorCode Checkpoints(DLMSimulation sim, DLMPartRecord *part)
{
  const DLMScene *scene = sim->scene;

  PetscFunctionBegin;
  if (scene->checkpoint_every > 0) PetscCall(Say(part, PETSC_TRUE, "-checkpoint_every %ld", (long)scene->checkpoint_every));
  else if (scene->checkpoint_minutes > 0.0) PetscCall(Say(part, PETSC_TRUE, "-checkpoint_minutes %.6g", (double)scene->checkpoint_minutes));
  else PetscCall(Say(part, PETSC_FALSE, "-checkpoint_every 0; a signal writes one all the same"));
  PetscFunctionReturn(0);
}

static PetscErrorCode Work(DLMSimulation sim, DLMPartRecord *part)
{
  PetscFunctionBegin;
  PetscCall(Say(part, PETSC_TRUE, "what the first steps make and keep"));
  PetscFunctionReturn(0);
}

/* In dependency order; a row may take bytes from one above it. */
static const PartRow rows[DLM_N_PARTS] = {
  [DLM_PART_GRID]            = { "grid", Grid },
  [DLM_PART_STOKES]          = { "Stokes solver", Stokes },
  [DLM_PART_PRESSURE_BLOCKS] = { "pressure blocks", PressureBlocks },
  [DLM_PART_SPHERES]         = { "spheres", Spheres },
  [DLM_PART_LUBRICATION]     = { "lubrication", Lubrication },
  [DLM_PART_CONTACT]         = { "contact", Contact },
  [DLM_PART_MOTION]          = { "motion", Motion },
  [DLM_PART_INERTIA]         = { "inertia", InertiaOfSpheres },
  [DLM_PART_FLOW]            = { "flow", Flow },
  [DLM_PART_RESPONSES]       = { "impulse responses", Responses },
  [DLM_PART_BLOCKS]          = { "dense blocks", Blocks },
  [DLM_PART_POLYMER]         = { "polymer", Polymer },
  [DLM_PART_STEPPING]        = { "time stepping", Stepping },
  [DLM_PART_ADAPTED]         = { "adapted steps", AdaptedSteps },
  [DLM_PART_STEP_COPY]       = { "copy of the step", StepCopy },
  [DLM_PART_TRAJECTORY]      = { "trajectory", Trajectory },
  [DLM_PART_BULK]            = { "bulk stress", Bulk },
  [DLM_PART_FIELDS]          = { "fields", Fields },
  [DLM_PART_CHECKPOINTS]     = { "checkpoints", Checkpoints },
  [DLM_PART_WORK]            = { "work of the steps", Work },
};

const char *DLMPartName(DLMPart part)
{
  return rows[part].object;
}

PetscErrorCode DLMSimulationBuildParts(DLMSimulation sim)
{
  PetscFunctionBegin;
  for (int k = 0; k < DLM_N_PARTS; k++) {
    const PetscReal before = DLMMemoryInUse();
    PetscLogDouble  start, end;
    PetscCall(PetscTime(&start));
    PetscCall(rows[k].decide(sim, &sim->part[k]));
    PetscCall(PetscTime(&end));
    sim->part[k].bytes += DLMMemoryInUse() - before;
    if (k < DLM_PART_TRAJECTORY) sim->part[k].seconds += end - start;
  }
  sim->heap = DLMMemoryInUse();
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationCountWork(DLMSimulation sim)
{
  PetscFunctionBegin;
  sim->part[DLM_PART_WORK].bytes = DLMMemoryInUse() - sim->heap;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationGetModelled(DLMSimulation sim, DLMModelled modelled[DLM_N_PARTS])
{
  PetscReal bytes[DLM_N_PARTS];

  PetscFunctionBeginUser;
  for (int k = 0; k < DLM_N_PARTS; k++) bytes[k] = sim->part[k].bytes;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, bytes, DLM_N_PARTS, MPIU_REAL, MPIU_SUM, sim->scene->comm));
  for (int k = 0; k < DLM_N_PARTS; k++) modelled[k] = (DLMModelled){ rows[k].object, sim->part[k].built, sim->part[k].why, bytes[k] };
  PetscFunctionReturn(0);
}

PetscErrorCode DLMModelledView(const DLMModelled modelled[DLM_N_PARTS], PetscViewer viewer)
{
  PetscFunctionBeginUser;
  PetscCall(PetscViewerASCIIPrintf(viewer, "%-18s %5s %9s  why\n", "object", "built", "MiB"));
  for (int k = 0; k < DLM_N_PARTS; k++) {
    char size[16] = "";
    if (modelled[k].built) PetscCall(PetscSNPrintf(size, sizeof(size), "%.1f", (double)(modelled[k].bytes / 1048576.0)));
    PetscCall(PetscViewerASCIIPrintf(viewer, "%-18s %5s %9s  %s\n", modelled[k].object, modelled[k].built ? "yes" : "no", size, modelled[k].why));
  }
  PetscFunctionReturn(0);
}
