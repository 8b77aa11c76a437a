#include "../../include/private/saddleimpl.h"
#include <petscblaslapack.h>

/* One sphere, two or three in a row; larger clusters continue the table (shorter ones make the blocks of heaps indefinite). */
static PetscInt Reach(const DLMScene *scene)
{
  const PetscReal reach  = scene->n_spheres > 2 ? 6.0 : (scene->n_spheres > 1 ? 4.0 : 2.0);
  PetscReal       radius = 0.0;

  for (PetscInt i = 0; i < scene->n_spheres; i++) radius = PetscMax(radius, scene->spheres[i].radius);
  return (PetscInt)PetscCeilReal(reach * radius / scene->h) + 5;
}

PetscReal DLMSaddleForeseeResponses(const DLMScene *scene)
{
  return scene->n_spheres ? DLMResponseBytes(Reach(scene)) : 0.0;
}

PetscErrorCode DLMBlocksCreate(DLMStokes stokes, DLMPairing pairing, DLMSpheres spheres, const DLMScene *scene, DLMLubrication *lubrication, PetscBool plain,
                               DLMBlocks **new_blocks)
{
  DLMCover   cover = { .degree = 0 };
  DLMBlocks *blocks;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&blocks));
  blocks->spheres = spheres;
  blocks->pairing = pairing;
  blocks->scene   = scene;
  blocks->stokes  = stokes;
  blocks->plain   = plain;
  blocks->lubrication = lubrication;
  blocks->scale   = plain ? DLMUzawaScale(stokes) : 1.0;
  if (!plain) {
    PetscReal radius = 0.0;
    for (PetscInt i = 0; i < scene->n_spheres; i++) radius = PetscMax(radius, scene->spheres[i].radius);
    PetscCall(DLMResponseGet(stokes, Reach(scene), &blocks->response));
    if (scene->n_spheres) PetscCall(DLMPairingGetCover(scene, radius, &cover));
    blocks->smooth = (PetscBool)(cover.degree && scene->pairing_points != DLM_POINTS_VOLUME);
    if (!blocks->smooth) blocks->scale = 0.3; /* may need large shifts: steps longer than 2 */
  }
  *new_blocks = blocks;
  PetscFunctionReturn(0);
}

static PetscErrorCode BlockDestroy(DLMBlock *b)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(b->factor));
  PetscCall(PetscFree(b->origin));
  PetscCall(PetscFree5(b->spheres, b->center, b->R, b->Y, b->W));
  PetscCall(PetscMemzero(b, sizeof(*b)));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMBlocksDestroy(DLMBlocks **pointer)
{
  DLMBlocks *blocks = *pointer;

  PetscFunctionBeginUser;
  if (!blocks) PetscFunctionReturn(0);
  for (PetscInt k = 0; k < blocks->n; k++) PetscCall(BlockDestroy(&blocks->block[k]));
  PetscCall(PetscFree(blocks->block));
  PetscCall(PetscFree(blocks->gathered));
  PetscCall(PetscSFDestroy(&blocks->gather));
  PetscCall(PetscFree(*pointer));
  PetscFunctionReturn(0);
}

void DLMRigidMass(const DLMScene *scene, PetscInt i, PetscReal weight, PetscReal mass[6])
{
  const DLMSphereSpec *s = &scene->spheres[i];
  const PetscReal      M = 4.0 / 3.0 * PETSC_PI * s->radius * s->radius * s->radius * s->density;

  for (int c = 0; c < 6; c++) mass[c] = DLMRigidHeld(scene, i, c) ? 1.0 : weight * (c < 3 ? M : 0.4 * M * s->radius * s->radius);
}

/*
  Cholesky factor in place. Volume points make S nearly singular, and the table makes it slightly inexact: a shift of the diagonal lifts
  what came out negative; conjugate gradients around the block mend the rest.
*/
static PetscErrorCode Factorise(PetscInt n, PetscReal **S, PetscReal shift)
{
  PetscBLASInt size = (PetscBLASInt)n, info = 1;
  PetscReal    largest = 0.0, *copy;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n * n, &copy));
  for (PetscInt i = 0; i < n; i++) largest = PetscMax(largest, (*S)[i * (n + 1)]);
  for (; info; shift *= 10.0) {
    PetscCheck(shift < 10.0, PETSC_COMM_SELF, PETSC_ERR_LIB, "A multiplier block of size %" PetscInt_FMT " is not positive definite", n);
    PetscCall(PetscArraycpy(copy, *S, n * n));
    for (PetscInt i = 0; i < n; i++) copy[i * (n + 1)] += shift * largest;
    LAPACKpotrf_("L", &size, copy, &size, &info);
  }
  PetscCall(PetscFree(*S));
  *S = copy;
  PetscFunctionReturn(0);
}

/* x <- (scale S)^-1 x for m columns. */
static PetscErrorCode SolveFactor(const DLMBlocks *blocks, const DLMBlock *b, PetscInt m, PetscReal *x)
{
  PetscBLASInt n = (PetscBLASInt)b->n, columns = (PetscBLASInt)m, info;

  PetscFunctionBegin;
  if (b->factor) LAPACKpotrs_("L", &n, &columns, b->factor, &n, x, &n, &info);
  for (PetscInt i = 0; i < b->n * m; i++) x[i] /= blocks->scale;
  PetscFunctionReturn(0);
}

static PetscErrorCode BuildBlock(DLMBlocks *blocks, DLMBlock *b)
{
  const PetscInt m = 6 * b->n_spheres;
  DLMMarkers     markers = { 0 };
  DLMCover       cover;
  PetscInt       n_pairs, *pairs, *first, *sphere_of;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(b->n_spheres + 1, &first));
  PetscCall(DLMPairingOverlaps(blocks->pairing, &n_pairs, &pairs));
  for (PetscInt s = 0; s < b->n_spheres; s++) {
    first[s] = markers.n;
    PetscCall(DLMPairingGetBlockCover(blocks->scene, blocks->scene->spheres[b->spheres[s]].radius, &cover));
    PetscCall(DLMMarkersAppend(blocks->pairing, b->spheres[s], &cover, n_pairs, pairs, &markers));
    PetscCall(PetscArraycpy(b->center + 3 * s, blocks->spheres->state[b->spheres[s]].center, 3));
  }
  first[b->n_spheres] = markers.n;
  PetscCall(PetscMalloc1(markers.n, &sphere_of));
  for (PetscInt s = 0; s < b->n_spheres; s++)
    for (PetscInt i = first[s]; i < first[s + 1]; i++) sphere_of[i] = b->spheres[s];
  if (!blocks->plain) {
    PetscCall(DLMBlockAssemble(blocks, b, &markers, first, sphere_of));
    PetscCall(Factorise(b->n, &b->factor, blocks->scene->pairing_points == DLM_POINTS_VOLUME ? 1e-6 : 1e-12));
  }
  PetscCall(DLMBlockFillRigid(blocks, b, &markers, first));
  PetscCall(PetscArraycpy(b->Y, b->R, b->n * m));
  PetscCall(SolveFactor(blocks, b, m, b->Y));
  PetscCall(PetscArraycpy(b->origin, b->center, 3 * b->n_spheres));
  blocks->built++;
  PetscCall(PetscFree(first));
  PetscCall(PetscFree(sphere_of));
  PetscCall(PetscFree(pairs));
  PetscCall(DLMMarkersDestroy(&markers));
  PetscFunctionReturn(0);
}

/* A block stays good while its spheres have moved, against the mesh or (harmonics) against each other, by less than this (in h). */
static const PetscReal stale_distance = 0.1;
/* The same towards a wall that is near, against the gap. */
static const PetscReal stale_gap = 0.1;

static PetscReal MostMove(const DLMBlocks *blocks)
{
  const PetscBool inner = (PetscBool)(blocks->scene->pairing_points == DLM_POINTS_VOLUME);

  return blocks->plain || inner ? 0.0 : stale_distance * blocks->scene->h;
}

PetscReal DLMBlockWallGap(const DLMBlocks *blocks, const DLMBlock *b, const PetscReal center[3])
{
  const DLMGrid   grid = blocks->stokes->grid;
  const PetscReal radius = blocks->scene->spheres[b->spheres[0]].radius, *x = center ? center : blocks->spheres->state[b->spheres[0]].center;
  PetscReal       gap = radius;

  if (b->n_spheres > 1 || !blocks->smooth) return PETSC_MAX_REAL;
  for (int d = 0; d < 3; d++) {
    const PetscReal height = x[d] - grid->lower[d];
    if (!grid->periodic[d]) gap = PetscMin(gap, PetscMin(height, grid->cells[d] * grid->h - height) - radius);
  }
  return gap >= grid->h && gap < radius ? gap : PETSC_MAX_REAL;
}

/*
  Points feel where they lie in the mesh; harmonics average over it, so that only the spheres' places in the cluster and near walls matter, and the block of
  a lone sphere lasts for the whole run.
*/
static PetscBool IsCurrent(const DLMBlocks *blocks, const DLMBlock *b, PetscInt n_spheres, const PetscInt *spheres, PetscInt n)
{
  const DLMGrid   grid = blocks->stokes->grid;
  const PetscReal most = MostMove(blocks), gap = DLMBlockWallGap(blocks, b, NULL);
  PetscReal       common[3] = { 0.0, 0.0, 0.0 };

  if (b->n_spheres != n_spheres || b->n != n) return PETSC_FALSE;
  if ((gap < PETSC_MAX_REAL) != (DLMBlockWallGap(blocks, b, b->center) < PETSC_MAX_REAL)) return PETSC_FALSE;
  for (int d = 0; d < 3 && b->harmonic; d++) {
    common[d] = blocks->spheres->state[spheres[0]].center[d] - b->center[d];
    if (!grid->periodic[d] && PetscAbsReal(common[d]) > stale_gap * gap) return PETSC_FALSE;
  }
  for (PetscInt s = 0; s < n_spheres; s++) {
    if (b->spheres[s] != spheres[s]) return PETSC_FALSE;
    for (int d = 0; d < 3; d++)
      if (PetscAbsReal(blocks->spheres->state[spheres[s]].center[d] - b->center[3 * s + d] - common[d]) > most) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

/* A lone sphere takes over the factors of another of the same size, both away from walls. */
static PetscErrorCode CopyTwin(DLMBlocks *blocks, PetscInt n_blocks, const DLMBlock *other, DLMBlock *b, PetscBool *copied)
{
  PetscFunctionBegin;
  *copied = PETSC_FALSE;
  if (DLMBlockWallGap(blocks, b, NULL) < PETSC_MAX_REAL) PetscFunctionReturn(0);
  for (PetscInt k = 0; k < n_blocks && !*copied; k++) {
    const DLMBlock      *o = &other[k];
    const DLMSphereSpec *spec = blocks->scene->spheres;
    if (!o->harmonic || o->n_spheres != 1 || b->n_spheres != 1 || spec[o->spheres[0]].radius != spec[b->spheres[0]].radius ||
        spec[o->spheres[0]].motion != spec[b->spheres[0]].motion || DLMBlockWallGap(blocks, o, o->center) < PETSC_MAX_REAL)
      continue;
    PetscCall(PetscMalloc1(b->n * b->n, &b->factor));
    PetscCall(PetscArraycpy(b->factor, o->factor, b->n * b->n));
    PetscCall(PetscArraycpy(b->R, o->R, 6 * b->n));
    PetscCall(PetscArraycpy(b->Y, o->Y, 6 * b->n));
    PetscCall(PetscArraycpy(b->center, blocks->spheres->state[b->spheres[0]].center, 3));
    PetscCall(PetscArraycpy(b->origin, o->origin, 3));
    b->harmonic = *copied = PETSC_TRUE;
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode BlockCreate(PetscInt n_spheres, const PetscInt *spheres, PetscInt n, DLMBlock *b)
{
  PetscFunctionBegin;
  PetscCall(PetscMemzero(b, sizeof(*b)));
  b->n_spheres = n_spheres;
  b->n         = n;
  PetscCall(PetscCalloc5(n_spheres, &b->spheres, 3 * n_spheres, &b->center, 6 * n_spheres * n, &b->R, 6 * n_spheres * n, &b->Y, 36 * n_spheres * n_spheres, &b->W));
  PetscCall(PetscCalloc1(3 * n_spheres, &b->origin));
  PetscCall(PetscArraycpy(b->spheres, spheres, n_spheres));
  PetscFunctionReturn(0);
}

/* Puts the block of a cluster at place k: an old one that is still current, or a new one. */
static PetscErrorCode PlaceBlock(DLMBlocks *blocks, PetscInt n_old, DLMBlock *old, PetscInt n_spheres, const PetscInt *spheres, PetscInt n, DLMBlock *place)
{
  PetscBool copied;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(place, sizeof(*place)));
  for (PetscInt k = 0; k < n_old; k++) {
    if (!old[k].n_spheres || !IsCurrent(blocks, &old[k], n_spheres, spheres, n)) continue;
    *place = old[k];
    PetscCall(PetscMemzero(&old[k], sizeof(old[k])));
    PetscFunctionReturn(0);
  }
  PetscCall(BlockCreate(n_spheres, spheres, n, place));
  PetscCall(CopyTwin(blocks, blocks->n, blocks->block, place, &copied));
  if (!copied) PetscCall(BuildBlock(blocks, place));
  PetscFunctionReturn(0);
}

/* Star forest from the bodies' vector to the blocks: multipliers of a block's spheres, then their rigid motions. */
static PetscErrorCode BuildGather(DLMBlocks *blocks, const DLMBodyLayout *layout)
{
  PetscSFNode *remote;
  PetscInt     at = 0;

  PetscFunctionBegin;
  blocks->n_gathered = 0;
  for (PetscInt k = 0; k < blocks->n; k++) {
    blocks->block[k].start = blocks->n_gathered;
    blocks->n_gathered += blocks->block[k].n + 6 * blocks->block[k].n_spheres;
  }
  PetscCall(PetscMalloc1(blocks->n_gathered, &remote));
  for (PetscInt k = 0; k < blocks->n; k++) {
    const DLMBlock *b = &blocks->block[k];
    for (PetscInt s = 0; s < b->n_spheres; s++)
      for (PetscInt i = 0; i < 3 * layout->points[b->spheres[s]]; i++)
        remote[at++] = (PetscSFNode){ layout->rank[b->spheres[s]], layout->multiplier[b->spheres[s]] + i };
    for (PetscInt s = 0; s < b->n_spheres; s++)
      for (PetscInt c = 0; c < 6; c++) remote[at++] = (PetscSFNode){ layout->rank[b->spheres[s]], layout->rigid[b->spheres[s]] + c };
  }
  PetscCall(PetscSFDestroy(&blocks->gather));
  PetscCall(PetscSFCreate(blocks->scene->comm, &blocks->gather));
  PetscCall(PetscSFSetGraph(blocks->gather, layout->n_local, blocks->n_gathered, NULL, PETSC_COPY_VALUES, remote, PETSC_OWN_POINTER));
  PetscCall(PetscSFSetUp(blocks->gather));
  PetscCall(PetscFree(blocks->gathered));
  PetscCall(PetscMalloc1(blocks->n_gathered, &blocks->gathered));
  PetscFunctionReturn(0);
}

static void MarkCut(DLMBlocks *blocks, const PetscInt *cluster)
{
  blocks->n_cut = 0;
  for (PetscInt g = 0; g < blocks->lubrication->n; g++) {
    DLMGap *gap = &blocks->lubrication->gaps[g];
    gap->cut    = (PetscBool)(gap->j >= 0 && cluster[gap->i] != cluster[gap->j]);
    blocks->n_cut += gap->cut;
  }
}

PetscErrorCode DLMBlocksUpdate(DLMBlocks *blocks, const DLMBodyLayout *layout, PetscReal inertia_weight)
{
  const PetscInt total = blocks->scene->n_spheres, n_old = blocks->n;
  DLMBlock      *old = blocks->block;
  PetscInt      *cluster, *member, *size;
  PetscMPIInt    rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(blocks->scene->comm, &rank));
  PetscCall(PetscMalloc2(total, &cluster, total, &member));
  PetscCall(DLMFindClusters(blocks->spheres, blocks->scene, layout, &blocks->n_clusters, cluster));
  MarkCut(blocks, cluster);
  PetscCall(PetscCalloc1(blocks->n_clusters + 1, &size));
  PetscCall(PetscCalloc1(blocks->n_clusters, &blocks->block));
  for (PetscInt i = 0; i < total; i++) size[cluster[i] + 1]++;
  for (PetscInt c = 0; c < blocks->n_clusters; c++) size[c + 1] += size[c];
  for (PetscInt i = 0; i < total; i++) member[size[cluster[i]]++] = i;
  blocks->n = blocks->largest = 0;
  for (PetscInt c = 0; c < blocks->n_clusters; c++) {
    const PetscInt first = c ? size[c - 1] : 0, n_spheres = size[c] - first;
    PetscInt       n = 0;
    for (PetscInt s = 0; s < n_spheres; s++) n += 3 * layout->points[member[first + s]];
    blocks->largest = PetscMax(blocks->largest, n);
    if (layout->rank[member[first]] != rank) continue; /* the rank of its first sphere keeps a cluster's block */
    PetscCall(PlaceBlock(blocks, n_old, old, n_spheres, member + first, n, &blocks->block[blocks->n]));
    PetscCall(DLMBlockBuildRigid(blocks, &blocks->block[blocks->n++], inertia_weight));
  }
  for (PetscInt k = 0; k < n_old; k++) PetscCall(BlockDestroy(&old[k]));
  PetscCall(PetscFree(old));
  PetscCall(PetscFree2(cluster, member));
  PetscCall(PetscFree(size));
  PetscCall(BuildGather(blocks, layout));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMBlocksGetState(DLMBlocks *blocks, DLMBlockState *state)
{
  const PetscInt n = blocks->scene->n_spheres;
  const MPI_Comm comm = blocks->scene->comm;
  PetscMPIInt    rank, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  state->n_ranks = size;
  PetscCall(PetscArrayzero(state->first, n));
  PetscCall(PetscArrayzero(state->rank, n));
  PetscCall(PetscArrayzero(state->center, 3 * n));
  PetscCall(PetscArrayzero(state->origin, 3 * n));
  for (PetscInt k = 0; k < blocks->n; k++)
    for (PetscInt s = 0; s < blocks->block[k].n_spheres; s++) {
      const DLMBlock *b = &blocks->block[k];
      const PetscInt  i = b->spheres[s];
      state->first[i]   = b->spheres[0];
      state->rank[i]    = rank;
      PetscCall(PetscArraycpy(state->center + 3 * i, b->center + 3 * s, 3));
      PetscCall(PetscArraycpy(state->origin + 3 * i, b->origin + 3 * s, 3));
    }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, state->first, (PetscMPIInt)n, MPIU_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, state->rank, (PetscMPIInt)n, MPIU_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, state->center, (PetscMPIInt)(3 * n), MPIU_REAL, MPI_SUM, comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, state->origin, (PetscMPIInt)(3 * n), MPIU_REAL, MPI_SUM, comm));
  PetscFunctionReturn(0);
}

/* A block from the centres that its factors belong to; a lone sphere may find them in a block made before. */
static PetscErrorCode RemakeBlock(DLMBlocks *blocks, const DLMBlockState *state, DLMBlock *b)
{
  const PetscReal *origin = state->origin + 3 * b->spheres[0];
  PetscBool        copied = PETSC_FALSE, same;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < blocks->n && !copied && b->n_spheres == 1; k++) {
    PetscCall(PetscArraycmp(blocks->block[k].origin, origin, 3, &same));
    if (same) PetscCall(CopyTwin(blocks, 1, &blocks->block[k], b, &copied));
  }
  if (!copied) {
    for (PetscInt s = 0; s < b->n_spheres; s++)
      PetscCall(PetscArraycpy(blocks->spheres->state[b->spheres[s]].center, state->origin + 3 * b->spheres[s], 3));
    PetscCall(BuildBlock(blocks, b));
  }
  for (PetscInt s = 0; s < b->n_spheres; s++) PetscCall(PetscArraycpy(b->center + 3 * s, state->center + 3 * b->spheres[s], 3));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMBlocksSetState(DLMBlocks *blocks, const DLMBodyLayout *layout, const DLMBlockState *state)
{
  const PetscInt  total = blocks->scene->n_spheres;
  PetscInt       *member;
  PetscReal      *now;
  PetscMPIInt     rank, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(blocks->scene->comm, &rank));
  PetscCallMPI(MPI_Comm_size(blocks->scene->comm, &size));
  for (PetscInt k = 0; k < blocks->n; k++) PetscCall(BlockDestroy(&blocks->block[k]));
  PetscCall(PetscFree(blocks->block));
  PetscCall(PetscCalloc1(total, &blocks->block));
  PetscCall(PetscMalloc2(total, &member, 3 * total, &now));
  for (PetscInt i = 0; i < total; i++) PetscCall(PetscArraycpy(now + 3 * i, blocks->spheres->state[i].center, 3));
  blocks->n = 0;
  for (PetscInt i = 0; i < total && MostMove(blocks) > 0.0; i++) {
    PetscInt n_spheres = 0, n = 0;
    if (state->first[i] != i || rank != (size == state->n_ranks ? state->rank[i] : layout->rank[i])) continue;
    for (PetscInt j = i; j < total; j++)
      if (state->first[j] == i) {
        member[n_spheres++] = j;
        n += 3 * layout->points[j];
      }
    PetscCall(BlockCreate(n_spheres, member, n, &blocks->block[blocks->n]));
    PetscCall(RemakeBlock(blocks, state, &blocks->block[blocks->n]));
    blocks->n++;
  }
  for (PetscInt i = 0; i < total; i++) PetscCall(PetscArraycpy(blocks->spheres->state[i].center, now + 3 * i, 3));
  PetscCall(PetscFree2(member, now));
  PetscFunctionReturn(0);
}

/* x holds r1, r2: r1 <- S^-1 r1, r2 <- r2 + R^T S^-1 r1. */
static PetscErrorCode CondenseBlock(const DLMBlocks *blocks, const DLMBlock *b, PetscReal *x)
{
  PetscReal    one = 1.0;
  PetscBLASInt n = (PetscBLASInt)b->n, m = (PetscBLASInt)(6 * b->n_spheres), unit = 1;

  PetscFunctionBegin;
  PetscCall(SolveFactor(blocks, b, 1, x));
  BLASgemv_("T", &n, &m, &one, b->R, &n, x, &unit, &one, x + b->n, &unit);
  PetscFunctionReturn(0);
}

/* lambda <- Y U - S^-1 r1, in place. */
static void ExpandBlock(const DLMBlock *b, PetscReal *x)
{
  PetscReal    one = 1.0, minus = -1.0;
  PetscBLASInt n = (PetscBLASInt)b->n, m = (PetscBLASInt)(6 * b->n_spheres), unit = 1;

  BLASgemv_("N", &n, &m, &one, b->Y, &n, x + b->n, &unit, &minus, x, &unit);
}

/* Half a box knows nothing of multipliers that the mirror turns round: there are none in the right-hand side, and stay none (B11). */
static PetscErrorCode SymmetriseBlock(const DLMBlocks *blocks, const DLMBlock *b, PetscReal *x)
{
  DLMCover cover;

  PetscFunctionBegin;
  if (!blocks->stokes->grid->half) PetscFunctionReturn(0);
  for (PetscInt s = 0; s < b->n_spheres; s++, x += 3 * cover.n_multipliers) {
    PetscCall(DLMPairingGetCover(blocks->scene, blocks->scene->spheres[b->spheres[s]].radius, &cover));
    DLMCoverSymmetrise(&cover, x);
  }
  PetscFunctionReturn(0);
}

/* W U = r2 + R^T S^-1 r1, then lambda = Y U - S^-1 r1. */
PetscErrorCode DLMBlocksApply(DLMBlocks *blocks, const PetscScalar *r, PetscScalar *z)
{
  PetscFunctionBeginUser;
  PetscCall(PetscSFBcastBegin(blocks->gather, MPIU_SCALAR, r, blocks->gathered, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(blocks->gather, MPIU_SCALAR, r, blocks->gathered, MPI_REPLACE));
  for (PetscInt k = 0; k < blocks->n; k++) PetscCall(CondenseBlock(blocks, &blocks->block[k], blocks->gathered + blocks->block[k].start));
  PetscCall(DLMBlocksSolveRigid(blocks));
  for (PetscInt k = 0; k < blocks->n; k++) {
    ExpandBlock(&blocks->block[k], blocks->gathered + blocks->block[k].start);
    PetscCall(SymmetriseBlock(blocks, &blocks->block[k], blocks->gathered + blocks->block[k].start));
  }
  PetscCall(PetscSFReduceBegin(blocks->gather, MPIU_SCALAR, blocks->gathered, z, MPI_REPLACE));
  PetscCall(PetscSFReduceEnd(blocks->gather, MPIU_SCALAR, blocks->gathered, z, MPI_REPLACE));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMBlocksEnergy(DLMBlocks *blocks, const PetscScalar *x, PetscReal *energy)
{
  PetscBLASInt unit = 1;

  PetscFunctionBeginUser;
  PetscCall(PetscSFBcastBegin(blocks->gather, MPIU_SCALAR, x, blocks->gathered, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(blocks->gather, MPIU_SCALAR, x, blocks->gathered, MPI_REPLACE));
  *energy = 0.0;
  for (PetscInt k = 0; k < blocks->n; k++) {
    const DLMBlock *b = &blocks->block[k];
    PetscBLASInt    n = (PetscBLASInt)b->n;
    PetscReal      *y = blocks->gathered + b->start;
    if (b->factor) BLAStrmv_("L", "T", "N", &n, b->factor, &n, y, &unit); /* |L^T lambda|^2 */
    for (PetscInt i = 0; i < b->n; i++) *energy += y[i] * y[i];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, energy, 1, MPIU_REAL, MPIU_SUM, blocks->scene->comm));
  PetscFunctionReturn(0);
}
