#include "../../include/private/gridimpl.h"

/* Pressure nodes of an axis. */
static PetscInt CoarseNodes(DLMGrid grid, int d)
{
  return grid->cells[d] / 2 + DLMGridHasEnds(grid, d);
}

/* Fewest pressure nodes a rank may hold on an axis: the velocity stencil has width 2. */
static PetscInt MostProcesses(DLMGrid grid, int d)
{
  return PetscMax(1, CoarseNodes(grid, d) / 2);
}

/* Slabs along the line axis keep the plane transforms local; where they would be too thin, the other axes are cut too. fits NULL: an error if there is no way. */
static PetscErrorCode ChooseProcesses(DLMGrid grid, const DLMScene *scene, PetscBool *fits)
{
  const PetscInt *wanted = scene->grid_processes;
  PetscMPIInt     size;
  PetscInt        best = -1, axis[3] = { grid->line, (grid->line + 2) % 3, (grid->line + 1) % 3 };

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(grid->comm, &size));
  for (PetscInt a = PetscMin(size, MostProcesses(grid, axis[0])); a >= 1; a--) {
    for (PetscInt b = PetscMin(size / a, MostProcesses(grid, axis[1])); b >= 1; b--) {
      const PetscInt c = size / (a * b), share[3] = { a, b, c };
      PetscBool      fits = (PetscBool)(a * b * c == size && c <= MostProcesses(grid, axis[2]) && best < 0);
      for (int d = 0; d < 3; d++) fits = (PetscBool)(fits && (!wanted[axis[d]] || wanted[axis[d]] == share[d]));
      if (!fits) continue;
      best = a;
      for (int d = 0; d < 3; d++) grid->processes[axis[d]] = share[d];
    }
  }
  if (fits) *fits = (PetscBool)(best > 0);
  DLMUserCheck(best > 0 || fits, grid->comm,
               "-grid_processes %" PetscInt_FMT ",%" PetscInt_FMT ",%" PetscInt_FMT " (0: chosen): %d ranks cannot share a mesh of %" PetscInt_FMT " x %" PetscInt_FMT " x %" PetscInt_FMT
               " cells so; allowed: factors of %d that leave at least 4 cells of every axis to each rank, or fewer ranks",
               wanted[0], wanted[1], wanted[2], size, grid->cells[0], grid->cells[1], grid->cells[2], size);
  PetscFunctionReturn(0);
}

/* Shares the pressure nodes of an axis evenly; the velocity nodes follow. */
static PetscErrorCode ShareAxis(DLMGrid grid, int d, PetscInt *coarse, PetscInt *fine)
{
  const PetscInt n = CoarseNodes(grid, d), size = grid->processes[d];
  PetscInt       first = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc1(size + 1, &grid->start[d]));
  for (PetscInt r = 0; r < size; r++) {
    coarse[r]         = n / size + (r < n % size ? 1 : 0);
    grid->start[d][r] = 2 * first;
    first += coarse[r];
    fine[r] = PetscMin(2 * first, grid->nodes[d]) - grid->start[d][r];
  }
  grid->start[d][size] = grid->nodes[d];
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateDM(DLMGrid grid, const PetscInt nodes[3], PetscInt dof, DMDAStencilType stencil, PetscInt width, const PetscInt *const share[3], DM *dm)
{
  DMBoundaryType boundary[3];

  PetscFunctionBeginUser;
  for (int d = 0; d < 3; d++) boundary[d] = !grid->periodic[d] ? DM_BOUNDARY_NONE : (DLMGridHasEnds(grid, d) ? DM_BOUNDARY_GHOSTED : DM_BOUNDARY_PERIODIC);
  PetscCall(DMDACreate3d(grid->comm, boundary[0], boundary[1], boundary[2], stencil, nodes[0], nodes[1], nodes[2],
                         grid->processes[0], grid->processes[1], grid->processes[2], dof, width, share[0], share[1], share[2], dm));
  PetscCall(DMSetUp(*dm));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMGridCreateDM(DLMGrid grid, PetscInt dof, DMDAStencilType stencil, PetscInt width, DM *dm)
{
  const PetscInt *share[3];

  PetscFunctionBegin;
  PetscCall(DMDAGetOwnershipRanges(grid->velocity, &share[0], &share[1], &share[2]));
  PetscCall(CreateDM(grid, grid->nodes, dof, stencil, width, share, dm));
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateDMs(DLMGrid grid)
{
  PetscInt *coarse[3], *fine[3], coarse_nodes[3];

  PetscFunctionBeginUser;
  for (int d = 0; d < 3; d++) {
    coarse_nodes[d] = CoarseNodes(grid, d);
    PetscCall(PetscMalloc2(grid->processes[d], &coarse[d], grid->processes[d], &fine[d]));
    PetscCall(ShareAxis(grid, d, coarse[d], fine[d]));
  }
  PetscCall(CreateDM(grid, grid->nodes, 3, DMDA_STENCIL_BOX, 2, (const PetscInt *const *)fine, &grid->velocity));
  PetscCall(CreateDM(grid, coarse_nodes, 1, DMDA_STENCIL_BOX, 1, (const PetscInt *const *)coarse, &grid->pressure));
  PetscCall(PetscObjectSetName((PetscObject)grid->velocity, "velocity"));
  PetscCall(PetscObjectSetName((PetscObject)grid->pressure, "pressure"));
  for (int c = 0; c < 3; c++) {
    const char *name[3] = { "u1", "u2", "u3" };
    PetscCall(DMDASetFieldName(grid->velocity, c, name[c]));
  }
  for (int d = 0; d < 3; d++) PetscCall(PetscFree2(coarse[d], fine[d]));
  PetscFunctionReturn(0);
}

/* All but the DMs. */
static PetscErrorCode Describe(const DLMScene *scene, DLMGrid grid, PetscBool *fits)
{
  PetscFunctionBeginUser;
  grid->comm = scene->comm;
  grid->h    = scene->h;
  grid->line = 2;
  grid->half = (PetscBool)(scene->box_mirror == DLM_MIRROR_HALF);
  grid->symmetric = (PetscBool)(scene->box_mirror != DLM_MIRROR_NONE);
  for (int d = 0; d < 3; d++) {
    grid->lower[d]    = -0.5 * scene->box_size[d];
    grid->cells[d]    = scene->cells[d];
    grid->periodic[d] = scene->box_periodic[d];
    if (grid->half && d == 1) {
      grid->lower[d] = 0.0;
      grid->cells[d] /= 2;
    }
    grid->nodes[d] = grid->cells[d] + DLMGridHasEnds(grid, d);
  }
  for (int d = 0; d < 3; d++)
    if (!grid->periodic[d]) grid->line = d;
  PetscCall(ChooseProcesses(grid, scene, fits));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMGridForesee(const DLMScene *scene, PetscBool *fits, PetscReal *nodes, PetscReal *ghosts)
{
  struct _p_DLMGrid grid;
  PetscReal         all = 1.0;

  PetscFunctionBeginUser;
  PetscCall(Describe(scene, &grid, fits));
  *nodes = *ghosts = 1.0;
  if (fits && !*fits) PetscFunctionReturn(0);
  for (int d = 0; d < 3; d++) {
    *nodes *= grid.nodes[d];
    all *= grid.nodes[d] + 4 * (grid.processes[d] - (grid.periodic[d] ? 0 : 1)); /* two at each end that is not a wall */
  }
  *ghosts = all - *nodes;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMGridCreate(const DLMScene *scene, DLMGrid *new_grid)
{
  DLMGrid grid;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&grid));
  PetscCall(Describe(scene, grid, NULL));
  PetscCall(CreateDMs(grid));
  *new_grid = grid;
  PetscFunctionReturn(0);
}

/* The planes of ghosts beyond a mirror, from the planes inside it: both are in the local vector. */
static PetscErrorCode FillImages(DLMGrid grid, DM dm, const PetscReal sign[], Vec local)
{
  PetscInt     ghost[3], width[3], dof, cells;
  PetscScalar *x;

  PetscFunctionBegin;
  PetscCall(DMDAGetInfo(dm, NULL, NULL, &cells, NULL, NULL, NULL, NULL, &dof, NULL, NULL, NULL, NULL, NULL));
  PetscCall(DMDAGetGhostCorners(dm, &ghost[0], &ghost[1], &ghost[2], &width[0], &width[1], &width[2]));
  cells--; /* nodes 0..cells */
  PetscCall(VecGetArray(local, &x));
  for (PetscInt j = ghost[1]; j < ghost[1] + width[1]; j++) {
    const PetscInt from = j < 0 ? -j : 2 * cells - j;
    if (j >= 0 && j <= cells) continue;
    for (PetscInt k = 0; k < width[2]; k++) {
      PetscScalar       *to    = x + dof * width[0] * (j - ghost[1] + width[1] * k);
      const PetscScalar *image = x + dof * width[0] * (from - ghost[1] + width[1] * k);
      for (PetscInt i = 0; i < dof * width[0]; i++) to[i] = sign[i % dof] * image[i];
    }
  }
  PetscCall(VecRestoreArray(local, &x));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMGridGlobalToLocal(DLMGrid grid, DM dm, const PetscReal sign[], Vec global, Vec local)
{
  PetscFunctionBegin;
  PetscCall(DMGlobalToLocal(dm, global, INSERT_VALUES, local));
  if (grid->half) PetscCall(FillImages(grid, dm, sign, local));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMGridDestroy(DLMGrid *grid)
{
  PetscFunctionBeginUser;
  if (!*grid) PetscFunctionReturn(0);
  PetscCall(DMDestroy(&(*grid)->velocity));
  PetscCall(DMDestroy(&(*grid)->pressure));
  for (int d = 0; d < 3; d++) PetscCall(PetscFree((*grid)->start[d]));
  PetscCall(PetscFree(*grid));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMGridGetDMs(DLMGrid grid, DM *velocity, DM *pressure)
{
  PetscFunctionBeginUser;
  if (velocity) *velocity = grid->velocity;
  if (pressure) *pressure = grid->pressure;
  PetscFunctionReturn(0);
}

/* Process of an axis that owns a node: start[] is sorted and short. */
static PetscInt AxisProcess(DLMGrid grid, int d, PetscInt i)
{
  PetscInt low = 0, high = grid->processes[d];

  while (high - low > 1) {
    const PetscInt mid = (low + high) / 2;
    if (i >= grid->start[d][mid]) low = mid;
    else high = mid;
  }
  return low;
}

PetscErrorCode DLMGridLocate(DLMGrid grid, PetscInt coarsening, const PetscInt i[3], PetscMPIInt *rank, PetscInt *index)
{
  PetscInt process[3], local[3], width[3];

  PetscFunctionBegin;
  for (int d = 0; d < 3; d++) {
    PetscBool      image;
    const PetscInt node = grid->periodic[d] ? DLMGridFold(grid, d, grid->cells[d] / coarsening, i[d], &image) : i[d];
    process[d] = AxisProcess(grid, d, coarsening * node);
    local[d]   = node - grid->start[d][process[d]] / coarsening;
    width[d]   = (grid->start[d][process[d] + 1] + coarsening - 1) / coarsening - grid->start[d][process[d]] / coarsening;
  }
  *rank = (PetscMPIInt)(process[0] + grid->processes[0] * (process[1] + grid->processes[1] * process[2]));
  if (index) *index = local[0] + width[0] * (local[1] + width[1] * local[2]);
  PetscFunctionReturn(0);
}
