/* -dry_run: what a run would build, need and take, printed without writing anything. */
#include <sys/statvfs.h>
#include <unistd.h>
#include "../../include/private/amounts.h"
#include "../../include/private/dryrun.h"

/* Bytes of a row of trajectory.csv and of bulk.csv (measured). */
static const PetscReal trajectory_row = 430.0, bulk_row = 290.0;
/*
  Doubles that a node takes while an output is gathered and written, in Newtonian and in viscoelastic fluid (measured): PETSc's scatter to the first rank,
  copies; of a checkpoint also the file in memory and its image.
*/
static const PetscReal fields_passing[2] = { 24.5, 60.0 }, checkpoint_passing[2] = { 30.0, 104.0 };

/* What outputs of a run take, in bytes; on the disk but for the last, which is memory, on all ranks. */
typedef struct {
  PetscReal trajectory, bulk, fields, checkpoint, passing;
} Files;

/* The step and the time that a run starts from; refuses a checkpoint that does not fit. */
static PetscErrorCode ReadStart(const DLMScene *scene, PetscInt *step, PetscReal *time)
{
  struct _p_DLMSimulation none = { .scene = scene, .whole = scene };

  PetscFunctionBegin;
  *step = 0;
  *time = 0.0;
  PetscCall(DLMSimulationRide(&none));
  PetscCall(DLMCheckpointOpen(&none));
  if (none.restart) PetscCall(DLMCheckpointReadStart(&none, step, time));
  PetscCall(DLMCheckpointFileDestroy(&none.restart));
  PetscCall(PetscFree(none.riding.spheres));
  PetscFunctionReturn(0);
}

/* Nodes of a piece that is tried in a second or two. */
static PetscErrorCode Affordable(const DLMScene *scene, PetscReal *nodes)
{
  PetscReal   bytes;
  PetscBool   exact;
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(scene->comm, &size));
  PetscCall(DLMStokesForeseePressureBlocks(scene, &bytes, &exact));
  *nodes = size * (scene->fluid_model == DLM_FLUID_NEWTONIAN ? 60e3 : 35e3) * (exact ? 1.0 : 0.1);
  PetscFunctionReturn(0);
}

static PetscErrorCode ForeseeFiles(DLMSimulation sim, PetscReal steps, Files *files)
{
  const DLMScene *scene   = sim->whole;
  const PetscBool polymer = (PetscBool)(sim->polymer != NULL);
  PetscReal       nodes, ghosts, all = 1.0; /* all: of the whole box, which files hold */
  PetscInt        order;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(files, sizeof(*files)));
  for (int d = 0; d < 3; d++) all *= scene->cells[d] + !scene->box_periodic[d];
  PetscCall(DLMGridForesee(scene, NULL, &nodes, &ghosts));
  PetscCall(DLMSplitGetScheme(sim->ts, NULL, &order));
  if (sim->part[DLM_PART_TRAJECTORY].built) files->trajectory = trajectory_row * scene->n_spheres * DLMSimulationCountOutputs(steps, scene->output_every);
  if (sim->part[DLM_PART_BULK].built) files->bulk = bulk_row * DLMSimulationCountOutputs(steps, scene->output_every);
  if (sim->part[DLM_PART_FIELDS].built) {
    PetscCall(DLMFieldsGetBytes(sim, &files->fields));
    files->fields *= DLMSimulationCountOutputs(steps, scene->output_fields_every);
    files->passing = 8.0 * (nodes * fields_passing[polymer] + (nodes < all ? all * (polymer ? 6.0 : 3.0) : 0.0));
  }
  if (sim->part[DLM_PART_CHECKPOINTS].built) { /* u, p; C; two forces and a rate, if forces are extrapolated */
    files->checkpoint = 8.0 * all * (3.0 + 0.125 + (polymer ? 6.0 + (order == 2 ? 12.0 : 0.0) : 0.0)) + 8.0 * 34.0 * scene->n_spheres + 20e3;
    files->passing    = PetscMax(files->passing, 8.0 * nodes * checkpoint_passing[polymer] + (nodes < all ? files->checkpoint : 0.0));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode ViewMemory(DLMSimulation sim, const DLMEstimate *e, PetscReal output)
{
  const MPI_Comm  comm = sim->scene->comm;
  const PetscReal MiB = 1048576.0, within = e->within + output, machine = (PetscReal)sysconf(_SC_PHYS_PAGES) * sysconf(_SC_PAGESIZE);
  PetscMPIInt     size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(PetscPrintf(comm, "memory    %.0f MiB on %d rank%s: objects %.0f, program %.0f, within a step or an output %.0f; this machine has %.0f MiB\n",
                        (double)((e->objects + e->program + within) / MiB), size, size > 1 ? "s" : "", (double)(e->objects / MiB), (double)(e->program / MiB),
                        (double)(within / MiB), (double)(machine / MiB)));
  PetscFunctionReturn(0);
}

/* Free room where the output folder is, or would be. */
static PetscReal FreeRoom(const char *folder)
{
  char           path[PETSC_MAX_PATH_LEN];
  struct statvfs file_system;

  snprintf(path, sizeof(path), "%s", folder);
  while (statvfs(path, &file_system)) {
    char *slash = strrchr(path, '/');
    if (!strcmp(path, ".") || !strcmp(path, "/")) return 0.0;
    if (slash) slash[slash == path] = '\0';
    else snprintf(path, sizeof(path), ".");
  }
  return (PetscReal)file_system.f_bavail * (PetscReal)file_system.f_frsize;
}

static PetscErrorCode ViewDisk(DLMSimulation sim, const Files *files)
{
  const MPI_Comm  comm      = sim->scene->comm;
  const PetscReal bytes[]   = { files->trajectory, files->bulk, files->fields, files->checkpoint };
  static const char *const names[] = { "trajectory.csv", "bulk.csv", "fields.h5", "checkpoint.h5" };
  char            all[32], room[32], one[32];

  PetscFunctionBegin;
  PetscCall(PetscPrintf(comm, "disk      %s of %s that are free: ", DLMSizeText(bytes[0] + bytes[1] + bytes[2] + 2.0 * bytes[3], all),
                        DLMSizeText(FreeRoom(sim->whole->output_dir), room)));
  for (int k = 0; k < 4; k++)
    if (bytes[k] > 0.0) PetscCall(PetscPrintf(comm, "%s %s%s, ", names[k], DLMSizeText(bytes[k], one), k == 3 ? ", twice while it is replaced" : ""));
  PetscCall(PetscPrintf(comm, "summary.json\n"));
  PetscFunctionReturn(0);
}

static PetscErrorCode ViewTime(DLMSimulation sim, PetscReal steps, const DLMEstimate *e)
{
  const MPI_Comm  comm = sim->scene->comm;
  const PetscInt *n    = sim->scene->cells, *whole = sim->whole->cells;
  const PetscReal all  = e->set_up + (steps > 0.0 ? e->first + (steps - 1.0) * e->step : 0.0);
  const char     *name;
  char            text[32];
  PetscReal       seconds;
  PetscInt        calls;

  PetscFunctionBegin;
  PetscCall(PetscPrintf(comm, "time      about %s: set-up %.3g s, first step %.3g s, then %.3g s/step:", DLMDurationText(all, text), (double)e->set_up, (double)e->first, (double)e->step));
  for (PetscInt k = 0; k < DLM_SPLIT_VERBS; k++) {
    PetscCall(DLMSplitGetTime(sim->ts, k, &name, &seconds, &calls));
    if (name && e->verb[k] >= 0.02 * e->step) PetscCall(PetscPrintf(comm, " %s %.0f%%", name, (double)(100.0 * e->verb[k] / e->step)));
  }
  PetscCall(PetscPrintf(comm, "\n          without outputs, with nothing else to do; measured in %" PetscInt_FMT " steps on %s%" PetscInt_FMT " x %" PetscInt_FMT " x %" PetscInt_FMT " cells\n",
                        e->tried, n[0] * n[1] * n[2] < whole[0] * whole[1] * whole[2] ? "a piece of " : "", n[0], n[1], n[2]));
  PetscFunctionReturn(0);
}

/* Steps that are adapted are taken to stay as long as the last one that was tried. */
static PetscErrorCode ViewSteps(DLMSimulation sim, PetscReal steps, PetscReal dt)
{
  const MPI_Comm comm = sim->scene->comm;

  PetscFunctionBegin;
  if (sim->adapt.exists) PetscCall(PetscPrintf(comm, "steps     about %.0f, adapted: the last one tried was %.3g long\n", (double)steps, (double)dt));
  else PetscCall(PetscPrintf(comm, "steps     %.0f\n", (double)steps));
  PetscFunctionReturn(0);
}

/* sim: of a piece of the scene, which took set_up processor seconds to make. */
static PetscErrorCode Foresee(DLMSimulation sim, PetscInt step, PetscReal time, PetscReal set_up)
{
  PetscViewer viewer = PETSC_VIEWER_STDOUT_(sim->scene->comm);
  DLMEstimate estimate;
  Files       files;
  PetscReal   dt = sim->whole->ts_dt, end, steps, nodes, ghosts;
  PetscInt    most;

  PetscFunctionBegin;
  PetscCall(TSGetMaxTime(sim->ts, &end));
  PetscCall(TSGetMaxSteps(sim->ts, &most));
  PetscCall(DLMGridForesee(sim->whole, NULL, &nodes, &ghosts));
  PetscCall(DLMEstimateMake(sim, set_up, &estimate));
  if (sim->adapt.exists) PetscCall(TSGetTimeStep(sim->ts, &dt));
  steps = DLMSimulationCountSteps(end - time, dt, most - step);
  PetscCall(ForeseeFiles(sim, steps, &files));
  PetscCall(DLMModelledView(estimate.modelled, viewer));
  PetscCall(DLMSimulationViewDetails(sim, viewer));
  PetscCall(ViewSteps(sim, steps, dt));
  PetscCall(ViewMemory(sim, &estimate, files.passing));
  PetscCall(ViewDisk(sim, &files));
  PetscCall(ViewTime(sim, steps, &estimate));
  PetscCall(DLMScenePresetView(sim->whole, estimate.step / nodes, end - time, viewer));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationDryRun(const DLMScene *scene)
{
  DLMScene       piece;
  DLMSimulation  sim;
  PetscReal      time, nodes, ghosts, before;
  PetscInt       step;

  PetscFunctionBeginUser;
  PetscCall(ReadStart(scene, &step, &time));
  PetscCall(DLMGridForesee(scene, NULL, &nodes, &ghosts)); /* or the ranks cannot share it */
  PetscCall(Affordable(scene, &nodes));
  PetscCall(DLMPieceCreate(scene, nodes, &piece));
  before = DLMProcessorSeconds();
  PetscCall(DLMSimulationCreatePiece(&piece, scene, &sim));
  const PetscReal set_up = DLMProcessorSeconds() - before;
  PetscCall(DLMSceneCheckUnused(scene->comm));
  PetscCall(DLMSceneView(scene, PETSC_VIEWER_STDOUT_(scene->comm)));
  PetscCall(DLMSimulationWarn(sim));
  PetscCall(Foresee(sim, step, time, set_up));
  PetscCall(PetscPrintf(scene->comm, "nothing was written: -dry_run\n"));
  PetscCall(DLMSimulationDestroy(&sim));
  PetscCall(DLMPieceDestroy(&piece));
  PetscFunctionReturn(0);
}
