/*
  bulk.csv: the stress of the suspension where one pair of walls shears it (docs/theory.md, B8), in the directions of rheology (DLMShear).
*/
#include "../../include/private/gridimpl.h"
#include "../../include/private/outputimpl.h"

static const char header[] = "step,time,shear_rate,viscosity,stress12,N1,N2,wall12,solvent12,solventN1,solventN2,polymer12,polymerN1,polymerN2,"
                             "particle12,particleN1,particleN2,contact12,contactN1,contactN2,external12\n";

/* A shear component and the two differences of normal stresses. */
typedef struct {
  PetscReal s12, N1, N2;
} Stress;

enum { SOLVENT, POLYMER, PARTICLE, CONTACT, PARTS };

/* a.T.b of a symmetric tensor 11, 22, 33, 12, 13, 23. */
static PetscReal Between(const PetscReal a[3], const PetscReal T[6], const PetscReal b[3])
{
  static const int at[3][3] = { { 0, 3, 4 }, { 3, 1, 5 }, { 4, 5, 2 } };
  PetscReal        sum = 0.0;

  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) sum += a[i] * T[at[i][j]] * b[j];
  return sum;
}

static void AddTensor(const DLMShear *s, PetscReal scale, const PetscReal T[6], Stress *sum)
{
  const PetscReal(*e)[3] = s->e, normal[3] = { Between(e[0], T, e[0]), Between(e[1], T, e[1]), Between(e[2], T, e[2]) };

  sum->s12 += scale * Between(e[0], T, e[1]);
  sum->N1 += scale * (normal[0] - normal[1]);
  sum->N2 += scale * (normal[1] - normal[2]);
}

static PetscReal Dot(const PetscReal a[3], const PetscReal b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Sum over this rank's nodes of v.e1, a velocity or a force, times the weight of the node's plane across the gap. */
static PetscErrorCode SumAcross(DLMOutput output, Vec v, const PetscReal *weight, PetscReal *sum)
{
  const DLMShear *s = &output->shear;
  PetscScalar ****a;
  PetscInt        start[3], width[3], i[3];
  DM              velocity;

  PetscFunctionBegin;
  *sum = 0.0;
  PetscCall(DLMGridGetDMs(output->sim->grid, &velocity, NULL));
  PetscCall(DMDAGetCorners(velocity, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  PetscCall(DMDAVecGetArrayDOFRead(velocity, v, &a));
  for (i[2] = start[2]; i[2] < start[2] + width[2]; i[2]++)
    for (i[1] = start[1]; i[1] < start[1] + width[1]; i[1]++)
      for (i[0] = start[0]; i[0] < start[0] + width[0]; i[0]++)
        if (weight[i[s->axis]] != 0.0) *sum += DLMGridImages(output->sim->grid, i[1]) * weight[i[s->axis]] * Dot(s->e[0], a[i[2]][i[1]][i[0]]);
  PetscCall(DMDAVecRestoreArrayDOFRead(velocity, v, &a));
  PetscFunctionReturn(0);
}

/*
  The shear stress that the walls feel beyond the mean stress of the fluid in the box (B9): from the mean shear rate in the two layers of cells at the walls,
  the first moment of the polymer's force per volume, what deltas put on wall nodes, and friction. Collective.
*/
static PetscErrorCode WallExcess(DLMOutput output, const DLMWallMoments *moments, PetscReal *excess)
{
  DLMSimulation   sim  = output->sim;
  DLMGrid         grid = sim->grid;
  const DLMShear *s    = &output->shear;
  const PetscInt  n    = grid->cells[s->axis];
  const PetscReal gap = sim->scene->box_size[s->axis], area = output->volume / gap, layer = 0.5 * grid->h / area;
  PetscReal      *rate, *moment, sum[2] = { 0.0, 0.0 };
  Vec             x, u;

  PetscFunctionBegin;
  PetscCall(PetscCalloc2(n + 1, &rate, n + 1, &moment));
  for (PetscInt k = 0; k <= n; k++) moment[k] = (grid->lower[s->axis] + grid->h * k) / output->volume;
  rate[n] += layer;
  rate[n - 1] -= layer;
  rate[1] += layer;
  rate[0] -= layer;
  PetscCall(DLMSaddleGetFluid(sim->saddle, &x));
  PetscCall(DLMStokesGetParts(sim->stokes, x, &u, NULL));
  PetscCall(SumAcross(output, u, rate, &sum[0]));
  PetscCall(DLMStokesRestoreParts(sim->stokes, x, &u, NULL));
  if (sim->polymer) PetscCall(SumAcross(output, sim->body_force, moment, &sum[1]));
  PetscCall(PetscFree2(rate, moment));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPIU_REAL, MPI_SUM, sim->scene->comm));
  *excess = sim->implicit_viscosity * (sum[0] - s->rate) + sum[1] + (Dot(s->e[0], moments->friction) - gap * Dot(s->e[0], moments->deltas)) / output->volume;
  PetscFunctionReturn(0);
}

static void AddParticles(DLMOutput output, const PetscReal *inside, const DLMWallMoments *moments, Stress part[PARTS])
{
  const DLMShear *s     = &output->shear;
  const PetscReal scale = 1.0 / output->volume, across = scale * Dot(s->e[1], moments->widths);
  DLMSphereState *state;
  PetscInt        n;

  (void)DLMSpheresGetStates(output->sim->spheres, &n, &state);
  for (PetscInt i = 0; i < n; i++) {
    AddTensor(s, scale, state[i].stresslet, &part[PARTICLE]);
    if (inside) AddTensor(s, -scale, inside + 6 * i, &part[POLYMER]); /* the stresslet holds it */
  }
  part[PARTICLE].s12 += scale * Dot(s->e[0], moments->widths); /* stresslets end at the surface, walls' friction at the wall */
  part[PARTICLE].N1 -= across;
  part[PARTICLE].N2 += across;
  AddTensor(s, scale, output->sim->contact.moment, &part[CONTACT]);
}

/* The parts of the stress; all of the shear stress; the shear stress that the walls feel. Collective. */
static PetscErrorCode Evaluate(DLMOutput output, Stress part[PARTS], PetscReal *all, PetscReal *wall)
{
  DLMSimulation    sim     = output->sim;
  const DLMScene  *scene   = sim->scene;
  const DLMShear  *s       = &output->shear;
  const PetscReal  solvent = scene->fluid_viscosity * (sim->polymer ? scene->retardation_time / scene->relaxation_time : 1.0);
  DLMPolymerStress polymer = { { 0.0 }, { 0.0 } };
  DLMWallMoments   moments;
  const PetscReal *inside = NULL;
  PetscReal        fluid;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(part, PARTS));
  if (sim->polymer) PetscCall(DLMPolymerGetStress(sim->polymer, &polymer));
  if (sim->polymer) PetscCall(DLMPolymerGetInsideStress(sim->polymer, &inside));
  part[SOLVENT].s12 = solvent * s->rate;
  part[POLYMER].s12 = (sim->implicit_viscosity - solvent) * s->rate;
  AddTensor(s, 1.0, polymer.solvent, &part[SOLVENT]);
  AddTensor(s, -1.0, polymer.solvent, &part[POLYMER]);
  AddTensor(s, 1.0, polymer.box, &part[POLYMER]);
  fluid = part[SOLVENT].s12 + part[POLYMER].s12;
  PetscCall(DLMSaddleGetWallMoments(sim->saddle, s->axis, &moments));
  PetscCall(WallExcess(output, &moments, wall));
  *all = fluid + (Dot(s->e[0], moments.friction) - Dot(s->e[0], moments.multipliers)) / output->volume;
  *wall += fluid;
  if (sim->spheres) AddParticles(output, inside, &moments, part);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMBulkOpen(DLMOutput output)
{
  const DLMScene *scene = output->sim->scene;

  PetscFunctionBegin;
  output->volume = scene->box_size[0] * scene->box_size[1] * scene->box_size[2];
  if (DLMSceneGetShear(scene, &output->shear)) PetscCall(DLMCsvOpen(output->sim, "bulk.csv", header, &output->bulk));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMBulkWrite(DLMOutput output, PetscInt step, PetscReal time)
{
  const PetscReal rate = output->shear.rate;
  Stress          part[PARTS], sum = { 0.0, 0.0, 0.0 };
  PetscReal       all = 0.0, wall = 0.0;
  char            row[2048];
  int             n;

  PetscFunctionBegin;
  PetscCall(Evaluate(output, part, &all, &wall));
  for (int k = 0; k < PARTS; k++) sum = (Stress){ sum.s12 + part[k].s12, sum.N1 + part[k].N1, sum.N2 + part[k].N2 };
  n = snprintf(row, sizeof(row), "%ld,%.15g,%.15g,%.15g,%.15g,%.15g,%.15g,%.15g", (long)step, (double)time, (double)rate, (double)(all / rate), (double)all, (double)sum.N1,
               (double)sum.N2, (double)wall);
  for (int k = 0; k < PARTS; k++)
    n += snprintf(row + n, sizeof(row) - (size_t)n, ",%.15g,%.15g,%.15g", (double)part[k].s12, (double)part[k].N1, (double)part[k].N2);
  n += snprintf(row + n, sizeof(row) - (size_t)n, ",%.15g\n", (double)(all - sum.s12)); /* what no part holds is external */
  PetscCall(DLMCsvAppend(output->sim, &output->bulk, row, (size_t)n));
  PetscFunctionReturn(0);
}
