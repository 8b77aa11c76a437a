/* What a run will take, from some steps on a piece of its scene. */
#include "../../include/private/dryrun.h"
#include "../../include/private/memory.h"

/* What a part's memory and set-up time go with. Ghost nodes: how much of an owned node's memory each takes (measured). */
typedef struct {
  enum { PER_NODE, PER_SPHERE, PER_RANK } law;
  PetscReal ghost;
} Growth;

static const Growth growth[DLM_N_PARTS] = {
  [DLM_PART_GRID]     = { PER_NODE, 2.0 },
  [DLM_PART_STOKES]   = { PER_NODE, 1.0 },
  [DLM_PART_SPHERES]  = { PER_SPHERE, 0.0 },
  [DLM_PART_MOTION]   = { PER_SPHERE, 0.0 },
  [DLM_PART_BLOCKS]   = { PER_SPHERE, 0.0 },
  [DLM_PART_POLYMER]  = { PER_NODE, 0.25 },
  [DLM_PART_STEPPING] = { PER_RANK, 0.0 },
  [DLM_PART_ADAPTED]  = { PER_SPHERE, 0.0 },
};

/* The whole scene over its piece. */
typedef struct {
  PetscReal piece_nodes, piece_ghosts, whole_nodes, whole_ghosts;
  PetscReal nodes, spheres; /* how many times as many */
} Ratio;

static PetscErrorCode Compare(DLMSimulation sim, Ratio *r)
{
  PetscFunctionBegin;
  PetscCall(DLMGridForesee(sim->scene, NULL, &r->piece_nodes, &r->piece_ghosts));
  PetscCall(DLMGridForesee(sim->whole, NULL, &r->whole_nodes, &r->whole_ghosts));
  r->nodes   = r->whole_nodes / r->piece_nodes;
  r->spheres = sim->scene->n_spheres ? (PetscReal)sim->whole->n_spheres / sim->scene->n_spheres : 1.0;
  PetscFunctionReturn(0);
}

static PetscReal BytesFactor(const Ratio *r, Growth growth)
{
  if (growth.law == PER_NODE) return (r->whole_nodes + growth.ghost * r->whole_ghosts) / (r->piece_nodes + growth.ghost * r->piece_ghosts);
  return growth.law == PER_SPHERE ? r->spheres : 1.0;
}

/* Processor seconds of a step. */
static PetscErrorCode Run(DLMSimulation sim, PetscInt steps, PetscReal *seconds)
{
  const PetscReal before = DLMProcessorSeconds();
  PetscInt        now;

  PetscFunctionBegin;
  PetscCall(TSGetStepNumber(sim->ts, &now));
  PetscCall(TSSetMaxSteps(sim->ts, now + steps));
  PetscCall(TSSolve(sim->ts, sim->solution));
  *seconds = (DLMProcessorSeconds() - before) / steps;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, seconds, 1, MPIU_REAL, MPIU_MAX, sim->scene->comm));
  PetscFunctionReturn(0);
}

static PetscErrorCode AddVerbSeconds(DLMSimulation sim, PetscReal weight, PetscReal sum[DLM_SPLIT_VERBS])
{
  const char *name;
  PetscReal   seconds;
  PetscInt    calls;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < DLM_SPLIT_VERBS; k++) {
    PetscCall(DLMSplitGetTime(sim->ts, k, &name, &seconds, &calls));
    if (name) sum[k] += weight * seconds;
  }
  PetscFunctionReturn(0);
}

/* The first step is dearer than the others: it starts from rest. As many others as a second or so allows. */
static PetscErrorCode Try(DLMSimulation sim, DLMEstimate *e)
{
  PetscReal trial, warm = 0.0, all = 0.0;
  PetscInt  more;

  PetscFunctionBegin;
  PetscCall(TSSetMaxTime(sim->ts, PETSC_MAX_REAL));
  PetscCall(DLMSimulationStart(sim));
  PetscCall(DLMAdaptStart(sim));
  PetscCall(DLMSimulationStore(sim, sim->solution));
  PetscCall(Run(sim, 1, &e->first));
  PetscCall(AddVerbSeconds(sim, -1.0, e->verb));
  PetscCall(Run(sim, 1, &trial));
  more = (PetscInt)PetscMin(8.0, 0.7 / PetscMax(trial, 1e-3));
  if (more) PetscCall(Run(sim, more, &warm));
  PetscCall(AddVerbSeconds(sim, 1.0, e->verb));
  e->tried = 2 + more;
  e->step  = (trial + more * warm) / (1 + more);
  for (int k = 0; k < DLM_SPLIT_VERBS; k++) all += e->verb[k];
  for (int k = 0; k < DLM_SPLIT_VERBS; k++) e->verb[k] *= e->step / all;
  PetscFunctionReturn(0);
}

/* The levels of the pressure blocks: their factorisation goes with one power more than their size. */
static PetscReal Levels(const DLMScene *scene)
{
  PetscInt line = 2;

  for (int d = 0; d < 3; d++)
    if (!scene->box_periodic[d]) line = d;
  return scene->cells[line];
}

/* quiet: processor seconds of a second. */
static PetscErrorCode ScaleParts(DLMSimulation sim, const Ratio *r, PetscReal quiet, DLMEstimate *e)
{
  DLMModelled *blocks = &e->modelled[DLM_PART_PRESSURE_BLOCKS];
  PetscReal    before = blocks->bytes;
  PetscMPIInt  size;
  PetscBool    exist;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(sim->scene->comm, &size));
  for (int k = 0; k < DLM_N_PARTS; k++) {
    const PetscReal times = growth[k].law == PER_NODE ? r->nodes : (growth[k].law == PER_SPHERE ? r->spheres : 1.0);
    e->modelled[k].bytes *= BytesFactor(r, growth[k]);
    if (k != DLM_PART_PRESSURE_BLOCKS) e->set_up += quiet * sim->part[k].seconds * times;
  }
  PetscCall(DLMStokesForeseePressureBlocks(sim->whole, &blocks->bytes, &exist));
  if (before > 0.0) e->set_up += quiet * sim->part[DLM_PART_PRESSURE_BLOCKS].seconds * blocks->bytes / before * Levels(sim->whole) / Levels(sim->scene);
  if (e->modelled[DLM_PART_RESPONSES].built) e->modelled[DLM_PART_RESPONSES].bytes = size * DLMSaddleForeseeResponses(sim->whole);
  PetscFunctionReturn(0);
}

/* Memory on all ranks: code and libraries, and what the set-up or a step takes beyond that and the parts' heap. */
static PetscErrorCode MeasureMemory(DLMSimulation sim, PetscReal held, PetscReal *program, PetscReal *passing)
{
  PetscReal sum[3] = { 0.0, held, 0.0 };

  PetscFunctionBegin;
  for (int k = 0; k < DLM_N_PARTS; k++) sum[0] += sim->part[k].bytes;
  DLMMemoryTrim();
  sum[2] = DLMMemoryResident() - sum[0];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 3, MPIU_REAL, MPIU_SUM, sim->scene->comm));
  *program = sum[2];
  *passing = PetscMax(0.0, sum[1] - sum[2] - sum[0]);
  PetscFunctionReturn(0);
}

/* What lives only within the set-up goes with the spheres and the tables, so it is the same in the whole; what lives only within a step goes with the mesh. */
PetscErrorCode DLMEstimateMake(DLMSimulation sim, PetscReal set_up, DLMEstimate *e)
{
  PetscReal in_set_up, in_step;
  Ratio     r;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(e, sizeof(*e)));
  PetscCall(Compare(sim, &r));
  PetscCall(MeasureMemory(sim, DLMMemoryPeak(), &e->program, &in_set_up));
  PetscCall(Try(sim, e));
  PetscCall(DLMSimulationCountWork(sim));
  PetscCall(MeasureMemory(sim, DLMMemoryResident(), &e->program, &in_step));
  PetscCall(DLMSimulationGetModelled(sim, e->modelled));
  PetscCall(ScaleParts(sim, &r, set_up / sim->setup_seconds, e));
  for (int k = 0; k < DLM_N_PARTS; k++) e->objects += e->modelled[k].bytes;
  e->within = PetscMax(in_step * r.nodes, in_set_up - e->modelled[DLM_PART_WORK].bytes);
  e->first *= r.nodes;
  e->step *= r.nodes;
  for (int k = 0; k < DLM_SPLIT_VERBS; k++) e->verb[k] *= r.nodes;
  PetscFunctionReturn(0);
}
