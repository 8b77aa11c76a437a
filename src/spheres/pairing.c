#include "../../include/private/spheresimpl.h"

PetscErrorCode DLMPairingCreate(DLMSpheres spheres, const DLMScene *scene, DLMPairing *new_pairing)
{
  DLMPairing pairing;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&pairing));
  pairing->spheres = spheres;
  pairing->scene   = scene;
  PetscCall(PetscCalloc2(spheres->n + 1, &pairing->first, spheres->n + 1, &pairing->first_multiplier));
  PetscCall(PetscCalloc1(spheres->n, &pairing->box));
  *new_pairing = pairing;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPairingDestroy(DLMPairing *pointer)
{
  DLMPairing pairing = *pointer;

  PetscFunctionBeginUser;
  if (!pairing) PetscFunctionReturn(0);
  for (PetscInt i = 0; i < pairing->n_sets; i++) {
    PetscCall(PetscFree(pairing->sets[i].x));
    PetscCall(PetscFree(pairing->sets[i].Q));
  }
  PetscCall(PetscFree(pairing->sets));
  PetscCall(DLMMarkersDestroy(&pairing->markers));
  PetscCall(PetscFree2(pairing->first, pairing->first_multiplier));
  PetscCall(PetscFree(pairing->leaf));
  PetscCall(PetscFree(pairing->box));
  PetscCall(PetscFree2(pairing->leaf_kind, pairing->leaves));
  PetscCall(PetscSFDestroy(&pairing->sf));
  PetscCall(PetscFree(*pointer));
  PetscFunctionReturn(0);
}

/* A sphere belongs to the rank that owns the node at or below its centre. */
static PetscErrorCode UpdateOwners(DLMSpheres spheres)
{
  DLMGrid     grid = spheres->grid;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(grid->comm, &rank));
  spheres->n_owned = 0;
  for (PetscInt i = 0; i < spheres->n; i++) {
    PetscInt node[3];
    for (int d = 0; d < 3; d++) {
      node[d] = (PetscInt)PetscFloorReal((spheres->state[i].center[d] - grid->lower[d]) / grid->h);
      if (!grid->periodic[d]) node[d] = PetscMax(0, PetscMin(grid->cells[d], node[d]));
    }
    PetscCall(DLMGridLocate(grid, 1, node, &spheres->owner[i], NULL));
    if (spheres->owner[i] == rank) spheres->owned[spheres->n_owned++] = i;
  }
  PetscFunctionReturn(0);
}

void DLMPairingGetBox(DLMPairing pairing, PetscInt i, DLMNodeBox *box)
{
  DLMGrid         grid   = pairing->spheres->grid;
  const PetscReal reach  = pairing->scene->spheres[i].radius / grid->h + 2.0;

  for (int d = 0; d < 3; d++) {
    const PetscReal x = (pairing->spheres->state[i].center[d] - grid->lower[d]) / grid->h;
    PetscInt        low = (PetscInt)PetscFloorReal(x - reach), high = (PetscInt)PetscCeilReal(x + reach);
    if (!grid->periodic[d]) {
      low  = PetscMax(low, 0);
      high = PetscMin(high, grid->cells[d]);
    }
    box->low[d]   = low;
    box->width[d] = high - low + 1;
  }
}

static int LeafKind(DLMGrid grid, PetscInt i, PetscInt j, PetscInt k)
{
  PetscBool image;
  PetscInt  node;

  if (DLMGridOnWall(grid, i, j, k)) return DLM_LEAF_WALL;
  if (!grid->half) return DLM_LEAF_NODE;
  node = DLMGridFold(grid, 1, grid->cells[1], j, &image);
  if (node == 0 || node == grid->cells[1]) return DLM_LEAF_MIRROR;
  return image ? DLM_LEAF_IMAGE : DLM_LEAF_TWIN;
}

/* What a leaf reads of its node's velocity, and what of a leaf's force comes to its node: the mean of the force and its mirror image (P1). */
static const PetscReal reads[][3]  = { [DLM_LEAF_NODE] = { 1, 1, 1 }, [DLM_LEAF_WALL] = { 1, 1, 1 }, [DLM_LEAF_TWIN] = { 1, 1, 1 }, [DLM_LEAF_IMAGE] = { 1, -1, 1 }, [DLM_LEAF_MIRROR] = { 1, 0, 1 } };
static const PetscReal passes[][3] = { [DLM_LEAF_NODE] = { 1, 1, 1 }, [DLM_LEAF_WALL] = { 0, 0, 0 }, [DLM_LEAF_TWIN] = { 0.5, 0.5, 0.5 }, [DLM_LEAF_IMAGE] = { 0.5, -0.5, 0.5 }, [DLM_LEAF_MIRROR] = { 1, 0, 1 } };

/* Leaves change only when a sphere moves on by a node or changes owner. */
static PetscErrorCode UpdateForest(DLMPairing pairing)
{
  DLMGrid   grid = pairing->spheres->grid;
  PetscBool same = (PetscBool)(pairing->sf && pairing->n_boxes == pairing->spheres->n_owned);
  PetscInt  leaves = 0;

  PetscFunctionBeginUser;
  pairing->n_boxes = pairing->spheres->n_owned;
  for (PetscInt k = 0; k < pairing->n_boxes; k++) {
    DLMNodeBox box = { .start = leaves };
    PetscBool  equal;
    DLMPairingGetBox(pairing, pairing->spheres->owned[k], &box);
    PetscCall(PetscArraycmp((const char *)&box, (const char *)&pairing->box[k], sizeof(box), &equal));
    same            = (PetscBool)(same && equal);
    pairing->box[k] = box;
    leaves += box.width[0] * box.width[1] * box.width[2];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPIU_BOOL, MPI_LAND, grid->comm));
  if (same) PetscFunctionReturn(0);
  PetscCall(PetscSFDestroy(&pairing->sf));
  PetscCall(PetscFree2(pairing->leaf_kind, pairing->leaves));
  PetscCall(PetscMalloc2(leaves, &pairing->leaf_kind, 3 * leaves, &pairing->leaves));
  pairing->n_leaves = 0;
  for (PetscInt b = 0; b < pairing->n_boxes; b++) {
    const DLMNodeBox *box = &pairing->box[b];
    for (PetscInt k = 0; k < box->width[2]; k++)
      for (PetscInt j = 0; j < box->width[1]; j++)
        for (PetscInt i = 0; i < box->width[0]; i++)
          pairing->leaf_kind[pairing->n_leaves++] = (char)LeafKind(grid, box->low[0] + i, box->low[1] + j, box->low[2] + k);
  }
  PetscCall(DLMNodeBoxForest(grid, pairing->n_boxes, pairing->box, &pairing->sf));
  PetscFunctionReturn(0);
}

static PetscErrorCode PlaceMarkers(DLMPairing pairing)
{
  DLMMarkers *m = &pairing->markers;
  PetscInt    n_pairs, *pairs;

  PetscFunctionBeginUser;
  PetscCall(DLMPairingOverlaps(pairing, &n_pairs, &pairs));
  PetscCall(DLMMarkersReset(m));
  for (PetscInt k = 0; k < pairing->n_boxes; k++) {
    const PetscInt sphere = pairing->spheres->owned[k];
    DLMCover       cover;
    pairing->first[k] = m->n;
    PetscCall(DLMPairingGetCover(pairing->scene, pairing->scene->spheres[sphere].radius, &cover));
    PetscCall(DLMMarkersAppend(pairing, sphere, &cover, n_pairs, pairs, m));
    pairing->first_multiplier[k + 1] = pairing->first_multiplier[k] + cover.n_multipliers + m->n - pairing->first[k] - cover.n_points;
  }
  pairing->first[pairing->n_boxes] = m->n;
  PetscCall(PetscFree(pairs));
  PetscCall(PetscRealloc(PetscMax(1, m->n_entries) * sizeof(PetscInt), &pairing->leaf));
  for (PetscInt k = 0, e = 0; k < pairing->n_boxes; k++) {
    const DLMNodeBox *box = &pairing->box[k];
    for (; e < (pairing->first[k + 1] ? m->entry[pairing->first[k + 1]] : 0); e++) {
      PetscInt leaf = 0;
      for (int d = 2; d >= 0; d--) leaf = leaf * box->width[d] + m->node[3 * e + d] - box->low[d];
      pairing->leaf[e] = box->start + leaf;
    }
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPairingUpdate(DLMPairing pairing)
{
  PetscFunctionBeginUser;
  PetscCall(UpdateOwners(pairing->spheres));
  PetscCall(UpdateForest(pairing));
  PetscCall(PlaceMarkers(pairing));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPairingGetPoints(DLMPairing pairing, PetscInt *n, const PetscReal **r, const PetscInt **first)
{
  PetscFunctionBegin;
  if (n) *n = pairing->markers.n;
  if (r) *r = pairing->markers.r;
  if (first) *first = pairing->first;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPairingInterpolate(DLMPairing pairing, Vec u, PetscScalar *values)
{
  const DLMMarkers  *m = &pairing->markers;
  const PetscScalar *x;
  MPI_Datatype       node;

  PetscFunctionBeginUser;
  PetscCall(DLMNodeType(&node));
  PetscCall(VecGetArrayRead(u, &x));
  PetscCall(PetscSFBcastBegin(pairing->sf, node, x, pairing->leaves, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(pairing->sf, node, x, pairing->leaves, MPI_REPLACE));
  PetscCall(VecRestoreArrayRead(u, &x));
  for (PetscInt l = 0; l < pairing->n_leaves; l++)
    for (int c = 0; c < 3; c++) pairing->leaves[3 * l + c] *= reads[(int)pairing->leaf_kind[l]][c];
  for (PetscInt i = 0; i < m->n; i++) {
    PetscScalar sum[3] = { 0.0, 0.0, 0.0 };
    for (PetscInt e = m->entry[i]; e < m->entry[i + 1]; e++)
      for (int c = 0; c < 3; c++) sum[c] += m->weight[e] * pairing->leaves[3 * pairing->leaf[e] + c];
    for (int c = 0; c < 3; c++) values[3 * i + c] = sum[c];
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPairingSpread(DLMPairing pairing, PetscReal scale, const PetscScalar *lambda, Vec f)
{
  const DLMMarkers *m = &pairing->markers;
  PetscScalar      *x;
  MPI_Datatype      node;

  PetscFunctionBeginUser;
  PetscCall(DLMNodeType(&node));
  PetscCall(PetscArrayzero(pairing->leaves, 3 * pairing->n_leaves));
  for (PetscInt i = 0; i < m->n; i++)
    for (PetscInt e = m->entry[i]; e < m->entry[i + 1]; e++)
      for (int c = 0; c < 3; c++) pairing->leaves[3 * pairing->leaf[e] + c] += scale * m->weight[e] * lambda[3 * i + c];
  for (PetscInt l = 0; l < pairing->n_leaves; l++)
    for (int c = 0; c < 3; c++) pairing->leaves[3 * l + c] *= passes[(int)pairing->leaf_kind[l]][c];
  PetscCall(VecGetArray(f, &x));
  PetscCall(PetscSFReduceBegin(pairing->sf, node, pairing->leaves, x, MPI_SUM));
  PetscCall(PetscSFReduceEnd(pairing->sf, node, pairing->leaves, x, MPI_SUM));
  PetscCall(VecRestoreArray(f, &x));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPairingGetMultipliers(DLMPairing pairing, PetscInt *n, const PetscInt **first)
{
  PetscFunctionBegin;
  if (n) *n = pairing->first_multiplier[pairing->n_boxes];
  if (first) *first = pairing->first_multiplier;
  PetscFunctionReturn(0);
}

/* expand: points <- Q multipliers; else multipliers <- Q^T points. Inner points are copied. */
static PetscErrorCode ApplyHarmonics(DLMPairing pairing, PetscBool expand, PetscScalar *multipliers, PetscScalar *points)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < pairing->n_boxes; k++) {
    const DLMPointSetData *set;
    PetscScalar           *c = multipliers + 3 * pairing->first_multiplier[k], *p = points + 3 * pairing->first[k];
    PetscInt               carried; /* surface points with multipliers of their own come with the inner ones */
    DLMCover               cover;
    PetscCall(DLMPairingGetCover(pairing->scene, pairing->scene->spheres[pairing->spheres->owned[k]].radius, &cover));
    PetscCall(DLMPairingGetPointSet(pairing, &cover, &set));
    carried = set->Q ? set->n : 0;
    const PetscInt inner = 3 * (pairing->first[k + 1] - pairing->first[k] - carried), columns = set->Q ? set->m : 0;
    if (expand) PetscCall(PetscArraycpy(p + 3 * carried, c + 3 * columns, inner));
    else PetscCall(PetscArraycpy(c + 3 * columns, p + 3 * carried, inner));
    PetscCall(PetscArrayzero(expand ? p : c, 3 * (expand ? carried : columns)));
    for (PetscInt m = 0; m < columns; m++)
      for (PetscInt i = 0; i < carried; i++)
        for (int d = 0; d < 3; d++) {
          if (expand) p[3 * i + d] += set->Q[m * set->n + i] * c[3 * m + d];
          else c[3 * m + d] += set->Q[m * set->n + i] * p[3 * i + d];
        }
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPairingExpand(DLMPairing pairing, const PetscScalar *multipliers, PetscScalar *points)
{
  PetscFunctionBegin;
  PetscCall(ApplyHarmonics(pairing, PETSC_TRUE, (PetscScalar *)multipliers, points));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPairingProject(DLMPairing pairing, const PetscScalar *points, PetscScalar *multipliers)
{
  PetscFunctionBegin;
  PetscCall(ApplyHarmonics(pairing, PETSC_FALSE, multipliers, (PetscScalar *)points));
  PetscFunctionReturn(0);
}
