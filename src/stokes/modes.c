#include "../../include/private/modes.h"
#include <petscblaslapack.h>

PetscReal DLMModesEigenvalue(const DLMModes *modes, PetscInt axis, PetscInt i)
{
  const PetscInt n = modes->cells[axis];

  if (modes->half && axis == modes->slow) return 2.0 - 2.0 * PetscCosReal(PETSC_PI * i / n);
  if (modes->grid->periodic[axis]) return 2.0 - 2.0 * PetscCosReal(2.0 * PETSC_PI * i / n);
  return 2.0 - 2.0 * PetscCosReal(PETSC_PI * (i + 1) / n);
}

static void SetAxes(DLMModes *modes)
{
  DLMGrid        grid   = modes->grid;
  const PetscInt coarse = modes->dof == 1 ? 2 : 1;

  modes->line       = grid->line;
  modes->half       = grid->half;
  modes->slow       = grid->half ? 1 : (modes->line == 2 ? 1 : 2);
  modes->fast       = 3 - modes->line - modes->slow;
  modes->is_complex = (PetscBool)(grid->periodic[modes->fast] && grid->periodic[modes->slow]);
  modes->scale      = 1.0;
  for (int d = 0; d < 3; d++) {
    const PetscBool inner = (PetscBool)(!grid->periodic[d] && modes->dof == 3);
    modes->cells[d]       = grid->cells[d] / coarse;
    modes->first[d]       = inner ? 1 : 0;
    modes->count[d]       = DLMGridHasEnds(grid, d) ? modes->cells[d] + (inner ? -1 : 1) : modes->cells[d];
    if (d != modes->line) modes->scale /= DLMGridHasEnds(grid, d) ? 2 * modes->cells[d] : modes->cells[d];
  }
  modes->row = modes->is_complex ? 2 * (modes->count[modes->fast] / 2 + 1) : modes->count[modes->fast];
  modes->row        = 4 * ((modes->row + 3) / 4); /* keeps every row aligned for FFTW's vector code */
  modes->plane_size = 4 * ((modes->count[modes->fast] * modes->count[modes->slow] + 3) / 4);
}

/* Families of `weight` rows, `before` of `total` rows come earlier: who gets it. */
static PetscInt FamilyOwner(PetscMPIInt size, PetscInt before, PetscInt weight, PetscInt total)
{
  return PetscMin(size - 1, (size * (2 * before + weight)) / (2 * total));
}

PetscInt DLMModesMostPressureRows(PetscInt rows, PetscBool half, PetscMPIInt size)
{
  const PetscInt last = half ? rows : rows / 2, total = half ? rows + 1 : rows;
  PetscInt       most = 0, owner = 0, mine = 0;

  for (PetscInt f = 0, before = 0; f <= last; f++) {
    const PetscInt weight = half || f == 0 || 2 * f == rows ? 1 : 2, next = FamilyOwner(size, before, weight, total);
    mine  = (next == owner ? mine : 0) + weight;
    owner = next;
    most  = PetscMax(most, mine);
    before += weight;
  }
  return most;
}

/* Rows of slow modes that share a pressure row, or its conjugate, form a family. */
static PetscInt Family(const DLMModes *modes, PetscInt k)
{
  const PetscInt n = modes->grid->cells[modes->slow] / 2;

  if (!modes->is_complex) return k;
  return modes->half ? PetscMin(k, 2 * n - k) : PetscMin(k % n, n - k % n);
}

/* A family stays together; each rank takes a share. */
static PetscErrorCode ShareRows(DLMModes *modes)
{
  const PetscInt n        = modes->count[modes->slow];
  const PetscInt pressure = modes->is_complex ? modes->grid->cells[modes->slow] / 2 + (modes->half ? 1 : 0) : n;
  const PetscInt families = modes->is_complex && !modes->half ? pressure / 2 + 1 : pressure;
  PetscInt      *weight, *owner, before = 0, total = 0, filled = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc2(families, &weight, families, &owner));
  PetscCall(PetscMalloc4(n, &modes->row_order, n, &modes->row_owner, n, &modes->rows, n, &modes->row_of));
  for (PetscInt k = 0; k < pressure; k++) weight[Family(modes, k)]++;
  for (PetscInt f = 0; f < families; f++) total += weight[f];
  for (PetscInt f = 0; f < families; f++) {
    owner[f] = FamilyOwner(modes->size, before, weight[f], total);
    before += weight[f];
  }
  for (PetscInt k = 0; k < n; k++) {
    modes->row_owner[k] = owner[Family(modes, k)];
    modes->row_of[k]    = -1;
  }
  for (PetscInt r = 0; r < modes->size; r++)
    for (PetscInt k = 0; k < n; k++)
      if (modes->row_owner[k] == r) {
        modes->row_order[filled++] = k;
        if (r == modes->rank) {
          modes->row_of[k]             = modes->n_rows;
          modes->rows[modes->n_rows++] = k;
        }
      }
  PetscCall(PetscFree2(weight, owner));
  PetscFunctionReturn(0);
}

/* A DMDA that is not cut into slabs across the line axis is brought to slabs by a star forest. */
static PetscErrorCode SetUpSlabForest(DLMModes *modes, DM dm)
{
  const PetscInt nf = modes->count[modes->fast], ns = modes->count[modes->slow];
  const PetscInt leaves = nf * ns * modes->n_levels;
  PetscSFNode   *remote;
  PetscInt       roots, l = 0;
  Vec            v;

  PetscFunctionBeginUser;
  PetscCall(DMGetGlobalVector(dm, &v));
  PetscCall(VecGetLocalSize(v, &roots));
  PetscCall(DMRestoreGlobalVector(dm, &v));
  PetscCall(PetscMalloc1(leaves, &remote));
  for (PetscInt k = 0; k < modes->n_levels; k++)
    for (PetscInt s = 0; s < ns; s++)
      for (PetscInt f = 0; f < nf; f++) {
        PetscInt    node[3], index;
        PetscMPIInt owner;
        node[modes->line] = modes->first[modes->line] + modes->level_start + k;
        node[modes->slow] = modes->first[modes->slow] + s;
        node[modes->fast] = modes->first[modes->fast] + f;
        PetscCall(DLMGridLocate(modes->grid, modes->dof == 1 ? 2 : 1, node, &owner, &index));
        remote[l].rank    = owner;
        remote[l++].index = index;
      }
  PetscCall(PetscSFCreate(modes->grid->comm, &modes->sf));
  PetscCall(PetscSFSetGraph(modes->sf, roots / modes->dof, leaves, NULL, PETSC_COPY_VALUES, remote, PETSC_OWN_POINTER));
  PetscCall(PetscSFSetUp(modes->sf));
  PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)modes->dof, MPIU_SCALAR, &modes->node));
  PetscCallMPI(MPI_Type_commit(&modes->node));
  modes->slab = fftw_alloc_real(PetscMax(1, leaves * modes->dof));
  PetscFunctionReturn(0);
}

static PetscErrorCode SetUpLevels(DLMModes *modes)
{
  DLMGrid        grid = modes->grid;
  DM             dm   = modes->dof == 3 ? grid->velocity : grid->pressure;
  const PetscInt l = modes->line, levels = modes->count[l];
  PetscInt       start[3], width[3];

  PetscFunctionBeginUser;
  if (grid->processes[l] == modes->size) {
    PetscCall(DMDAGetCorners(dm, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
    modes->level_start = PetscMax(start[l], modes->first[l]) - modes->first[l];
    modes->n_levels    = PetscMin(start[l] + width[l], modes->first[l] + levels) - modes->first[l] - modes->level_start;
    modes->stride[0]   = modes->dof;
    modes->stride[1]   = modes->stride[0] * width[0];
    modes->stride[2]   = modes->stride[1] * width[1];
    modes->origin      = 0;
    for (int d = 0; d < 3; d++) modes->origin += modes->stride[d] * (modes->first[d] - start[d]);
    modes->origin += modes->stride[l] * modes->level_start;
  } else {
    modes->level_start          = (levels * modes->rank) / modes->size;
    modes->n_levels             = (levels * (modes->rank + 1)) / modes->size - modes->level_start;
    modes->stride[modes->fast]  = modes->dof;
    modes->stride[modes->slow]  = modes->dof * modes->count[modes->fast];
    modes->stride[l]            = modes->stride[modes->slow] * modes->count[modes->slow];
    modes->origin               = 0;
    PetscCall(SetUpSlabForest(modes, dm));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode SetUpTranspose(DLMModes *modes)
{
  PetscInt mine[2] = { modes->n_rows, modes->n_levels }, *all;

  PetscFunctionBeginUser;
  PetscCall(PetscMalloc4(modes->size + 1, &modes->slab_count, modes->size + 1, &modes->slab_start, modes->size + 1, &modes->mode_count,
                         modes->size + 1, &modes->mode_start));
  PetscCall(PetscMalloc1(2 * modes->size, &all));
  PetscCallMPI(MPI_Allgather(mine, 2, MPIU_INT, all, 2, MPIU_INT, modes->grid->comm));
  modes->slab_start[0] = modes->mode_start[0] = 0;
  for (PetscMPIInt r = 0; r < modes->size; r++) {
    PetscCall(PetscMPIIntCast(modes->n_levels * modes->dof * all[2 * r] * modes->row, &modes->slab_count[r]));
    PetscCall(PetscMPIIntCast(all[2 * r + 1] * modes->dof * modes->n_rows * modes->row, &modes->mode_count[r]));
    modes->mode_start[r + 1] = modes->mode_start[r] + modes->mode_count[r];
    if (r == modes->rank) modes->slab_count[r] = modes->mode_count[r] = 0; /* own rows need no exchange */
    modes->slab_start[r + 1] = modes->slab_start[r] + modes->slab_count[r];
  }
  PetscCall(PetscFree(all));
  PetscFunctionReturn(0);
}

static PetscErrorCode CreatePlans(DLMModes *modes)
{
  const int           n[2]     = { (int)modes->count[modes->slow], (int)modes->count[modes->fast] };
  const int           out[2]   = { n[0], (int)modes->row }, half[2] = { n[0], (int)modes->row / 2 };
  const PetscBool     wall_s   = (PetscBool)!modes->grid->periodic[modes->slow], wall_f = (PetscBool)!modes->grid->periodic[modes->fast];
  const fftw_r2r_kind to[2]    = { wall_s ? FFTW_RODFT00 : FFTW_R2HC, wall_f ? FFTW_RODFT00 : FFTW_R2HC };
  const fftw_r2r_kind from[2]  = { wall_s ? FFTW_RODFT00 : FFTW_HC2R, wall_f ? FFTW_RODFT00 : FFTW_HC2R };
  const unsigned      flags    = FFTW_ESTIMATE | FFTW_DESTROY_INPUT; /* estimate: the same plan, bit for bit, in every run */
  double             *x = modes->plane, *y = modes->plane_modes;
  fftw_complex       *z = (fftw_complex *)modes->plane_modes;

  PetscFunctionBeginUser;
  if (modes->half) {
    modes->forward  = fftw_plan_many_dft_r2c(1, n + 1, n[0], x, NULL, 1, n[1], z, NULL, 1, half[1], flags);
    modes->backward = fftw_plan_many_dft_c2r(1, n + 1, n[0], z, NULL, 1, half[1], x, NULL, 1, n[1], flags);
  } else if (modes->is_complex) {
    modes->forward  = fftw_plan_many_dft_r2c(2, n, 1, x, NULL, 1, 0, z, half, 1, 0, flags);
    modes->backward = fftw_plan_many_dft_c2r(2, n, 1, z, half, 1, 0, x, NULL, 1, 0, flags);
  } else {
    modes->forward  = fftw_plan_many_r2r(2, n, 1, x, NULL, 1, 0, y, out, 1, 0, to, flags);
    modes->backward = fftw_plan_many_r2r(2, n, 1, y, out, 1, 0, x, NULL, 1, 0, from, flags);
  }
  PetscCheck(modes->forward && modes->backward, modes->grid->comm, PETSC_ERR_LIB, "FFTW made no plan for planes of %d x %d", n[0], n[1]);
  PetscFunctionReturn(0);
}

/* Nodes 0..n/2 of a mode's wave, n the cells: 2 cos(pi j k/n) or 2 sin(pi j k/n), node 0 once, as FFTW's REDFT00 and RODFT00 have them. */
static PetscErrorCode CreateWaves(DLMModes *modes)
{
  const PetscInt n = modes->cells[modes->slow], nodes = n / 2 + 1;

  PetscFunctionBeginUser;
  for (int sine = 0; sine < 2; sine++)
    for (PetscInt odd = 0; odd < 2; odd++) {
      double *w = modes->waves[sine][odd] = fftw_alloc_real(nodes * nodes);
      for (PetscInt k = odd, i = 0; k <= n; k += 2)
        for (PetscInt j = 0; j < nodes; j++, i++) w[i] = sine ? 2.0 * PetscSinReal(PETSC_PI * j * k / n) : (j ? 2.0 : 1.0) * PetscCosReal(PETSC_PI * j * k / n);
    }
  modes->folded = fftw_alloc_real((n + 1) * modes->row);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMModesCreate(DLMGrid grid, PetscInt dof, DLMModes **new_modes)
{
  DLMModes *modes;
  size_t    plane, local;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&modes));
  modes->grid = grid;
  modes->dof  = dof;
  PetscCallMPI(MPI_Comm_size(grid->comm, &modes->size));
  PetscCallMPI(MPI_Comm_rank(grid->comm, &modes->rank));
  SetAxes(modes);
  PetscCheck(dof == 3 || modes->is_complex, grid->comm, PETSC_ERR_SUP, "Pressure modes need two periodic axes");
  PetscCall(ShareRows(modes));
  PetscCall(SetUpLevels(modes));
  PetscCall(SetUpTranspose(modes));
  plane              = (size_t)modes->count[modes->slow] * modes->row;
  local              = (size_t)modes->count[modes->line] * dof * modes->n_rows * modes->row;
  modes->plane       = fftw_alloc_real(dof * modes->plane_size);
  modes->plane_modes = fftw_alloc_real(plane);
  modes->modal       = fftw_alloc_real(PetscMax(4, local));
  if (modes->size > 1) modes->buffer = fftw_alloc_real(PetscMax(4, modes->n_levels * dof * plane));
  PetscCall(PetscArrayzero(modes->plane_modes, plane));
  PetscCall(CreatePlans(modes));
  if (modes->half) PetscCall(CreateWaves(modes));
  PetscCall(PetscArrayzero(modes->modal, local));
  PetscCall(PetscArrayzero(modes->plane_modes, plane));
  *new_modes = modes;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMModesDestroy(DLMModes **pointer)
{
  DLMModes *modes = *pointer;

  PetscFunctionBeginUser;
  if (!modes) PetscFunctionReturn(0);
  PetscCall(PetscSFDestroy(&modes->sf));
  if (modes->slab) PetscCallMPI(MPI_Type_free(&modes->node));
  fftw_free(modes->slab);
  fftw_free(modes->plane);
  fftw_free(modes->plane_modes);
  fftw_free(modes->modal);
  fftw_free(modes->buffer);
  fftw_destroy_plan(modes->forward);
  fftw_destroy_plan(modes->backward);
  for (int k = 0; k < 4; k++) fftw_free(modes->waves[k / 2][k % 2]);
  fftw_free(modes->folded);
  PetscCall(PetscFree4(modes->row_order, modes->row_owner, modes->rows, modes->row_of));
  PetscCall(PetscFree4(modes->slab_count, modes->slab_start, modes->mode_count, modes->mode_start));
  PetscCall(PetscFree(*pointer));
  PetscFunctionReturn(0);
}

/* Takes the components of one level apart into planes, and puts them together again. */
static void ReadPlanes(const DLMModes *modes, const double *restrict level)
{
  const PetscInt    nf = modes->count[modes->fast], ns = modes->count[modes->slow];
  const PetscInt    sf = modes->stride[modes->fast], ss = modes->stride[modes->slow];
  double *restrict  p0 = modes->plane, *restrict p1 = p0 + modes->plane_size, *restrict p2 = p1 + modes->plane_size;

  for (PetscInt s = 0; s < ns; s++) {
    const double *restrict x = level + s * ss;
    if (modes->dof == 1)
      for (PetscInt f = 0; f < nf; f++) p0[s * nf + f] = x[f * sf];
    else
      for (PetscInt f = 0; f < nf; f++) {
        p0[s * nf + f] = x[f * sf];
        p1[s * nf + f] = x[f * sf + 1];
        p2[s * nf + f] = x[f * sf + 2];
      }
  }
}

static void WritePlanes(const DLMModes *modes, double *restrict level)
{
  const PetscInt         nf = modes->count[modes->fast], ns = modes->count[modes->slow];
  const PetscInt         sf = modes->stride[modes->fast], ss = modes->stride[modes->slow];
  const PetscReal        scale = modes->scale;
  const double *restrict p0 = modes->plane, *restrict p1 = p0 + modes->plane_size, *restrict p2 = p1 + modes->plane_size;

  for (PetscInt s = 0; s < ns; s++) {
    double *restrict x = level + s * ss;
    if (modes->dof == 1)
      for (PetscInt f = 0; f < nf; f++) x[f * sf] = scale * p0[s * nf + f];
    else
      for (PetscInt f = 0; f < nf; f++) {
        x[f * sf]     = scale * p0[s * nf + f];
        x[f * sf + 1] = scale * p1[s * nf + f];
        x[f * sf + 2] = scale * p2[s * nf + f];
      }
  }
}

/*
  Copies the modal rows of one transformed plane to or from where they are exchanged: the buffer of their owner, or, for this rank's own rows, their
  final place.
*/
static PetscErrorCode ExchangeRows(DLMModes *modes, PetscInt block, PetscBool send)
{
  const PetscInt n = modes->count[modes->slow], row = modes->row, blocks = modes->n_levels * modes->dof;

  PetscFunctionBegin;
  for (PetscInt q = 0; q < n;) {
    const PetscInt owner = modes->row_owner[modes->row_order[q]];
    const PetscInt rows  = owner == modes->rank ? modes->n_rows : modes->slab_count[owner] / (blocks * row);
    double        *place = owner == modes->rank ? modes->modal + (modes->level_start * modes->dof + block) * rows * row
                                                : modes->buffer + modes->slab_start[owner] + block * rows * row;
    for (PetscInt r = 0; r < rows; r++, q++) {
      double *mode = modes->plane_modes + modes->row_order[q] * row;
      if (send) PetscCall(PetscArraycpy(place + r * row, mode, row));
      else PetscCall(PetscArraycpy(mode, place + r * row, row));
    }
  }
  PetscFunctionReturn(0);
}

/*
  Between mirrors: cosines along the slow axis, for u2 sines, which vanish on the mirrors (turned: the other way round); the same either way. Seen from the middle an even mode of cosines is even and an odd
  one odd, those of sines the other way round, so the one takes the sums of opposite nodes, the other their differences.
*/
static void TransformSlow(const DLMModes *modes, PetscInt component, double *mode)
{
  const int          sine = (component == modes->slow) != modes->turned;
  const PetscInt     row = modes->row, n = modes->cells[modes->slow], pairs = (n + 1) / 2;
  const PetscBLASInt width = (PetscBLASInt)row, apart = 2 * width, nodes = (PetscBLASInt)n / 2 + 1;
  double            *sum = modes->folded, *difference = sum + nodes * row;
  const PetscReal    one = 1.0, zero = 0.0;

  for (PetscInt j = 0; j < pairs; j++) {
    const double *restrict a = mode + j * row, *restrict b = mode + (n - j) * row;
    double *restrict       s = sum + j * row, *restrict d = difference + j * row;
    for (PetscInt i = 0; i < row; i++) {
      s[i] = a[i] + b[i];
      d[i] = a[i] - b[i];
    }
  }
  for (PetscInt i = pairs * row; i < nodes * row; i++) sum[i] = mode[i]; /* of an even number of cells: the node in the middle has no difference */
  for (int odd = 0; odd < 2; odd++) {
    const PetscBLASInt waves = (PetscBLASInt)(odd ? pairs : nodes), from = odd == sine ? nodes : (PetscBLASInt)pairs;
    BLASgemm_("N", "N", &width, &waves, &from, &one, odd == sine ? sum : difference, &width, modes->waves[sine][odd], &nodes, &zero, mode + odd * row, &apart);
  }
}

static void Transform(const DLMModes *modes, PetscBool forward, PetscInt component, double *plane, double *mode)
{
  if (modes->half && !forward) TransformSlow(modes, component, mode);
  if (modes->is_complex && forward) fftw_execute_dft_r2c(modes->forward, plane, (fftw_complex *)mode);
  else if (modes->is_complex) fftw_execute_dft_c2r(modes->backward, (fftw_complex *)mode, plane);
  else if (forward) fftw_execute_r2r(modes->forward, plane, mode);
  else fftw_execute_r2r(modes->backward, mode, plane);
  if (modes->half && forward) TransformSlow(modes, component, mode);
}

PetscErrorCode DLMModesForward(DLMModes *modes, const PetscScalar *array)
{
  const PetscInt plane = modes->count[modes->slow] * modes->row;
  const double  *source = modes->sf ? modes->slab : array;

  PetscFunctionBeginUser;
  if (modes->sf) {
    PetscCall(PetscSFBcastBegin(modes->sf, modes->node, array, modes->slab, MPI_REPLACE));
    PetscCall(PetscSFBcastEnd(modes->sf, modes->node, array, modes->slab, MPI_REPLACE));
  }
  for (PetscInt k = 0; k < modes->n_levels; k++) {
    ReadPlanes(modes, source + modes->origin + k * modes->stride[modes->line]);
    for (PetscInt c = 0; c < modes->dof; c++) {
      const PetscInt block = k * modes->dof + c;
      Transform(modes, PETSC_TRUE, c, modes->plane + c * modes->plane_size, modes->size > 1 ? modes->plane_modes : modes->modal + block * plane);
      if (modes->size > 1) PetscCall(ExchangeRows(modes, block, PETSC_TRUE));
    }
  }
  if (modes->size > 1)
    PetscCallMPI(MPI_Alltoallv(modes->buffer, modes->slab_count, modes->slab_start, MPI_DOUBLE, modes->modal, modes->mode_count,
                               modes->mode_start, MPI_DOUBLE, modes->grid->comm));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMModesBackward(DLMModes *modes, PetscScalar *array)
{
  const PetscInt plane = modes->count[modes->slow] * modes->row;
  double        *target = modes->sf ? modes->slab : array;

  PetscFunctionBeginUser;
  if (modes->size > 1)
    PetscCallMPI(MPI_Alltoallv(modes->modal, modes->mode_count, modes->mode_start, MPI_DOUBLE, modes->buffer, modes->slab_count,
                               modes->slab_start, MPI_DOUBLE, modes->grid->comm));
  for (PetscInt k = 0; k < modes->n_levels; k++) {
    for (PetscInt c = 0; c < modes->dof; c++) {
      const PetscInt block = k * modes->dof + c;
      if (modes->size > 1) PetscCall(ExchangeRows(modes, block, PETSC_FALSE));
      Transform(modes, PETSC_FALSE, c, modes->plane + c * modes->plane_size, modes->size > 1 ? modes->plane_modes : modes->modal + block * plane);
    }
    WritePlanes(modes, target + modes->origin + k * modes->stride[modes->line]);
  }
  if (modes->sf) {
    PetscCall(PetscSFReduceBegin(modes->sf, modes->node, modes->slab, array, MPI_REPLACE));
    PetscCall(PetscSFReduceEnd(modes->sf, modes->node, modes->slab, array, MPI_REPLACE));
  }
  PetscFunctionReturn(0);
}
