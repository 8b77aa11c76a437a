/* What the extra stress (docs/theory.md, V3) sums up to: for bulk.csv and for the stresslets. */
#include "../../include/private/polymerimpl.h"

/* How often component k of a tensor at a node of plane j of x2 counts in a sum over the box: in half of it, what the mirror turns round cancels. */
static double Images(DLMPolymer p, int k, PetscInt j)
{
  return p->grid->half && DLMMirrorTensor[k] < 0.0 ? 0.0 : DLMGridImages(p->grid, j);
}

/* sum[k] += mass of every owned node times T[k], k of 6. */
typedef struct {
  double *const *T;
  PetscReal     *sum;
} SumContext;

static void SumVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  const SumContext *c = context;
  PetscInt          node[3];

  DLMPolymerNode(p, own, node);
  for (int k = 0; k < 6; k++) {
    const double           mass = row->mass * Images(p, k, node[1]);
    const double *restrict t = c->T[k] + own;
    double                 s = 0.0;
#pragma omp simd reduction(+ : s)
    for (PetscInt x = 0; x < n; x++) s += t[x];
    c->sum[k] += mass * s;
  }
}

/* The same of 2 (mu - mu_0) D, mu[n] the solvent's viscosity at the nodes, mu_0 that at rest. */
static void SumSolvent(DLMPolymer p, const double *mu, double *const T[6], PetscReal *sum)
{
  const PetscReal rest = p->scene->fluid_viscosity * p->scene->retardation_time / p->scene->relaxation_time;

  for (int k = 0; k < 6; k++) {
    const double *g = p->g[DLMEntryIJ[k]], *h = p->g[DLMEntryJI[k]];
    for (PetscInt x = 0; x < p->block.n; x++) T[k][x] = (mu[x] - rest) * (g[x] + h[x]);
  }
  DLMPolymerWeighStress(p, T);
  DLMPolymerLines(p, SumVisit, &(SumContext){ T, sum });
}

PetscErrorCode DLMPolymerGetStress(DLMPolymer p, DLMPolymerStress *stress)
{
  const DLMScene *s      = p->scene;
  const PetscReal volume = s->box_size[0] * s->box_size[1] * s->box_size[2];

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(stress, sizeof(*stress)));
  PetscCall(DLMPolymerExtraStress(p, 0.0, p->r));
  DLMPolymerWeighStress(p, p->r);
  DLMPolymerLines(p, SumVisit, &(SumContext){ p->r, stress->box });
  if (p->model->viscosity && p->n_velocities) SumSolvent(p, p->scratch, p->r, stress->solvent);
  for (int k = 0; k < 6; k++) {
    stress->box[k] /= volume;
    stress->solvent[k] /= volume;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, stress, sizeof(*stress) / sizeof(PetscReal), MPIU_REAL, MPI_SUM, p->grid->comm));
  PetscFunctionReturn(0);
}

/* A node's part inside a sphere: a ramp of one mesh width about the surface. */
static PetscErrorCode AddInside(DLMPolymer p, const DLMNearNode *node, void *context)
{
  const DLMPolymerBlock *b    = &p->block;
  const PetscReal        part = PetscMin(1.0, 0.5 - node->distance / p->grid->h);
  PetscInt               own, place = 0;

  PetscFunctionBegin;
  if (!DLMPolymerOwnedIndex(p, node->i, &own)) PetscFunctionReturn(0);
  for (int d = 2; d >= 0; d--) place = 3 * place + DLMGridPlace(p->grid, d, b->ghost_start[d] + node->i[d], p->grid->cells[d]);
  for (int k = 0; k < 6; k++)
    p->inside_stress[6 * node->sphere + k] += part * p->rows[place].mass * Images(p, k, b->ghost_start[1] + node->i[1]) * p->r[k][own];
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerSumInside(DLMPolymer p)
{
  const PetscInt n = 6 * p->scene->n_spheres;

  PetscFunctionBegin;
  if (!p->spheres || p->stress_offset > 0.0) PetscFunctionReturn(0);
  PetscCall(PetscArrayzero(p->inside_stress, n));
  PetscCall(DLMPolymerVisitNear(p, NULL, 0.5 * p->grid->h, AddInside, NULL));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, p->inside_stress, (PetscMPIInt)n, MPIU_REAL, MPI_SUM, p->grid->comm));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerGetInsideStress(DLMPolymer p, const PetscReal **stress)
{
  PetscFunctionBeginUser;
  *stress = p->inside_stress;
  PetscFunctionReturn(0);
}
