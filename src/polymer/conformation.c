#include "../../include/private/polymerimpl.h"

void DLMPolymerMassVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  double *mass = context;
  for (PetscInt x = 0; x < n; x++) mass[own + x] = row->mass;
}

/* Springs that are not Hooke's: (1 - a)/(2 lambda1) on the diagonal of grad u turns the relaxation of C into -(a C - b I)/lambda1. */
static void ShiftGradient(DLMPolymer p, double sign, double **b)
{
  const PetscInt n = p->block.n;
  double        *trace = p->scratch, *a = p->scratch + (size_t)n;

  *b = NULL;
  if (!p->model->spring) return;
  *b = p->scratch + 2 * (size_t)n;
  if (sign > 0.0) {
    for (PetscInt x = 0; x < n; x++) trace[x] = p->c[0][x] + p->c[1][x] + p->c[2][x];
    p->model->spring(p->scene, n, trace, a, *b);
  }
  for (int k = 0; k < 9; k += 4)
    for (PetscInt x = 0; x < n; x++) p->g[k][x] += sign * 0.5 * (1.0 - a[x]) / p->scene->relaxation_time;
}

PetscErrorCode DLMPolymerStretch(DLMPolymer p, PetscReal dt, PetscInt order)
{
  const PetscReal      lambda = p->scene->relaxation_time;
  const double *const *g      = (const double *const *)p->g;
  const PetscInt       n      = p->block.n;
  long                 bad    = -1;
  DLMRelaxation        relax;
  double              *b;

  PetscFunctionBeginUser;
  if (!p->health.sound) PetscFunctionReturn(0);
  PetscCall(DLMPolymerCheckOut(p));
  ShiftGradient(p, 1.0, &b);
  if (order == 2 || b) {
    DLMRelaxationSet(dt, lambda, &relax);
    DLMTensorStretch(n, g, &relax, b, p->c);
  } else if (p->scene->polymer_form == DLM_FORM_LOG) {
    DLMTensorStretchSplit(n, g, dt, lambda, p->c);
  } else {
    bad = DLMTensorCholesky(n, p->c, p->c);
    DLMTensorStretchFactor(n, g, dt, lambda, p->c, p->c);
  }
  ShiftGradient(p, -1.0, &b);
  PetscCall(DLMPolymerCheckIn(p));
  PetscCall(DLMPolymerJudge(p, bad));
  PetscFunctionReturn(0);
}

/* The least value over ranks and the position that goes with it. */
static PetscErrorCode ReduceLeast(DLMPolymer p, PetscReal value, PetscInt node, PetscReal *least, PetscReal place[3])
{
  struct {
    double value;
    int    rank;
  } mine;
  PetscMPIInt rank;
  PetscInt    i[3];

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(p->grid->comm, &rank));
  DLMPolymerNode(p, node, i);
  for (int d = 0; d < 3; d++) place[d] = p->grid->lower[d] + p->grid->h * i[d];
  mine.value = PetscIsInfOrNanReal(value) ? -PETSC_MAX_REAL : value; /* what is not finite wins */
  mine.rank  = rank;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &mine, 1, MPI_DOUBLE_INT, MPI_MINLOC, p->grid->comm));
  *least = mine.value;
  PetscCallMPI(MPI_Bcast(place, 3, MPIU_REAL, mine.rank, p->grid->comm));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerJudge(DLMPolymer p, long bad)
{
  PetscReal least, place[3];

  PetscFunctionBegin;
  PetscCall(ReduceLeast(p, bad >= 0 ? -1.0 : 1.0, (PetscInt)PetscMax(bad, 0), &least, place));
  if (least > 0.0) PetscFunctionReturn(0);
  p->health.sound               = PETSC_FALSE;
  p->health.smallest_eigenvalue = 0.0;
  PetscCall(PetscArraycpy(p->health.place, place, 3));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerGetHealth(DLMPolymer p, DLMPolymerHealth *health)
{
  PetscReal smallest, trace, place[3];
  long      where;

  PetscFunctionBeginUser;
  if (p->health.sound) {
    PetscCall(DLMPolymerCheckOut(p));
    DLMTensorRange(p->block.n, p->c, &smallest, &where, &trace);
    PetscCall(DLMPolymerCheckIn(p));
    PetscCall(ReduceLeast(p, smallest, (PetscInt)where, &p->health.smallest_eigenvalue, place));
    PetscCallMPI(MPI_Allreduce(&trace, &p->health.largest_trace, 1, MPIU_REAL, MPIU_MAX, p->grid->comm));
    PetscCall(PetscArraycpy(p->health.place, place, 3));
    p->health.sound = (PetscBool)(p->health.smallest_eigenvalue > 0.0);
  }
  *health = p->health;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerView(DLMPolymer p, PetscViewer viewer)
{
  const DLMScene *s = p->scene;
  const PetscReal mu = s->fluid_viscosity * s->retardation_time / s->relaxation_time, b = (s->fluid_viscosity - mu) / s->fluid_viscosity;

  PetscFunctionBeginUser;
  PetscCall(PetscViewerASCIIPrintf(viewer, "Polymer: %s, solvent viscosity %.6g, polymer viscosity %.6g (fraction %.3g), implicit viscosity %.6g\n", p->model->name, (double)mu,
                                   (double)(s->fluid_viscosity - mu), (double)b, (double)s->implicit_viscosity));
  PetscFunctionReturn(0);
}
