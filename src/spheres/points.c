#include "../../include/private/spheresimpl.h"

PetscErrorCode DLMPairingGetPointSet(DLMPairing pairing, const DLMCover *cover, const DLMPointSetData **found)
{
  DLMPointSetData *set = NULL;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < pairing->n_sets; i++)
    if (pairing->sets[i].n == cover->n_points && pairing->sets[i].degree == cover->degree) set = &pairing->sets[i];
  if (!set) {
    PetscCall(PetscRealloc((pairing->n_sets + 1) * sizeof(*set), &pairing->sets));
    set         = &pairing->sets[pairing->n_sets++];
    set->n      = cover->n_points;
    set->m      = cover->n_multipliers;
    set->degree = cover->degree;
    set->Q      = NULL;
    PetscCall(PetscMalloc1(3 * set->n, &set->x));
    DLMSurfacePoints((int)set->n, set->x);
    if (set->degree) {
      PetscCall(PetscMalloc1(set->m * set->n, &set->Q));
      const int m = DLMHarmonics((int)set->n, set->x, (int)set->degree, set->Q);
      PetscCheck(m == set->m, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%" PetscInt_FMT " surface points carry %d of %" PetscInt_FMT " harmonics", set->n, m, set->m);
    }
  }
  *found = set;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMMarkersReset(DLMMarkers *markers)
{
  PetscFunctionBegin;
  markers->n = markers->n_entries = 0;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMMarkersDestroy(DLMMarkers *markers)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(markers->r));
  PetscCall(PetscFree(markers->entry));
  PetscCall(PetscFree(markers->node));
  PetscCall(PetscFree(markers->weight));
  PetscCall(PetscMemzero(markers, sizeof(*markers)));
  PetscFunctionReturn(0);
}

static PetscErrorCode AddPoint(DLMMarkers *m, const PetscReal r[3])
{
  PetscFunctionBegin;
  if (m->n == m->capacity) {
    m->capacity = 2 * m->capacity + 256;
    PetscCall(PetscRealloc(3 * m->capacity * sizeof(PetscReal), &m->r));
    PetscCall(PetscRealloc((m->capacity + 1) * sizeof(PetscInt), &m->entry));
  }
  PetscCall(PetscArraycpy(m->r + 3 * m->n, r, 3));
  m->entry[m->n++] = m->n_entries;
  m->entry[m->n]   = m->n_entries;
  PetscFunctionReturn(0);
}

/* Adds a node to the stencil of the last point. */
static PetscErrorCode AddEntry(DLMMarkers *m, const int node[3], PetscReal weight)
{
  PetscFunctionBegin;
  if (m->n_entries == m->entry_capacity) {
    m->entry_capacity = 2 * m->entry_capacity + 4096;
    PetscCall(PetscRealloc(3 * m->entry_capacity * sizeof(PetscInt), &m->node));
    PetscCall(PetscRealloc(m->entry_capacity * sizeof(PetscReal), &m->weight));
  }
  for (int d = 0; d < 3; d++) m->node[3 * m->n_entries + d] = node[d];
  m->weight[m->n_entries++] = weight;
  m->entry[m->n]            = m->n_entries;
  PetscFunctionReturn(0);
}

/* x: position in mesh widths from the lower corner. */
static PetscErrorCode AddDeltaStencil(DLMGrid grid, const PetscReal x[3], DLMMarkers *m)
{
  DLMAxisWeights axis[3];

  PetscFunctionBegin;
  for (int d = 0; d < 3; d++) DLMDeltaWeights(x[d], grid->periodic[d], (int)grid->cells[d], &axis[d]);
  for (int k = 0; k < axis[2].n; k++)
    for (int j = 0; j < axis[1].n; j++)
      for (int i = 0; i < axis[0].n; i++) {
        const int node[3] = { axis[0].node[i], axis[1].node[j], axis[2].node[k] };
        PetscCall(AddEntry(m, node, axis[0].weight[i] * axis[1].weight[j] * axis[2].weight[k]));
      }
  PetscFunctionReturn(0);
}

/* P1 interpolation; a point on a node (within rounding) takes that node alone. */
static PetscErrorCode AddLinearStencil(DLMGrid grid, const PetscReal x[3], DLMMarkers *m)
{
  double fraction[3], weight[8];
  int    low[3];

  PetscFunctionBegin;
  for (int d = 0; d < 3; d++) {
    low[d] = (int)PetscFloorReal(x[d] + 1e-9);
    if (!grid->periodic[d]) low[d] = (int)PetscMax(0, PetscMin(low[d], grid->cells[d] - 1));
    fraction[d] = PetscMax(0.0, PetscMin(1.0, x[d] - low[d]));
    if (fraction[d] < 1e-9) fraction[d] = 0.0;
  }
  DLMKuhnInterpolate(fraction, weight);
  for (int c = 0; c < 8; c++) {
    const int node[3] = { low[0] + (c & 1), low[1] + ((c >> 1) & 1), low[2] + ((c >> 2) & 1) };
    if (weight[c] != 0.0) PetscCall(AddEntry(m, node, weight[c]));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode AddSurfacePoints(DLMPairing pairing, PetscInt sphere, const DLMCover *cover, DLMMarkers *m)
{
  DLMGrid                grid   = pairing->spheres->grid;
  const PetscReal        a      = pairing->scene->spheres[sphere].radius, *center = pairing->spheres->state[sphere].center;
  const DLMPointSetData *set = NULL;
  const PetscReal        radius = a - cover->retraction * grid->h;

  PetscFunctionBegin;
  PetscCall(DLMPairingGetPointSet(pairing, cover, &set));
  for (PetscInt k = 0; k < set->n; k++) {
    PetscReal r[3], x[3];
    for (int d = 0; d < 3; d++) {
      r[d] = radius * set->x[3 * k + d];
      x[d] = (center[d] + r[d] - grid->lower[d]) / grid->h;
    }
    PetscCall(AddPoint(m, r));
    if (pairing->scene->pairing_type == DLM_PAIRING_IMMERSED) PetscCall(AddDeltaStencil(grid, x, m));
    else PetscCall(AddLinearStencil(grid, x, m));
  }
  PetscFunctionReturn(0);
}

/* True if the node at r from centre i lies nearer to the centre of another sphere that also contains it. */
static PetscErrorCode BelongsToOther(DLMPairing pairing, PetscInt i, const PetscReal r[3], PetscInt n_pairs, const PetscInt *pairs, PetscBool *other)
{
  PetscFunctionBegin;
  *other = PETSC_FALSE;
  for (PetscInt q = 0; q < 2 * n_pairs; q++) {
    const PetscInt  k = pairs[q ^ 1];
    const PetscReal a = pairing->scene->spheres[k].radius;
    PetscReal       d[3], mine = 0.0, theirs = 0.0;
    if (pairs[q] != i) continue;
    PetscCall(DLMSpheresSeparation(pairing->spheres, i, k, d));
    for (int c = 0; c < 3; c++) {
      mine += r[c] * r[c];
      theirs += (r[c] - d[c]) * (r[c] - d[c]);
    }
    if (theirs < a * a && (theirs < mine || (theirs == mine && k < i))) *other = PETSC_TRUE;
  }
  PetscFunctionReturn(0);
}

/* Velocity nodes at least h/2 inside the surface, paired by their own values. */
static PetscErrorCode AddInnerNodes(DLMPairing pairing, PetscInt i, PetscInt n_pairs, const PetscInt *pairs, DLMMarkers *m)
{
  DLMGrid         grid  = pairing->spheres->grid;
  const PetscReal inner = pairing->scene->spheres[i].radius - 0.5 * grid->h;
  DLMNodeBox      box;

  PetscFunctionBegin;
  DLMPairingGetBox(pairing, i, &box);
  for (PetscInt k = 0; k < box.width[2]; k++)
    for (PetscInt j = 0; j < box.width[1]; j++)
      for (PetscInt l = 0; l < box.width[0]; l++) {
        const int node[3] = { (int)(box.low[0] + l), (int)(box.low[1] + j), (int)(box.low[2] + k) };
        PetscReal r[3], r2 = 0.0;
        PetscBool other;
        for (int d = 0; d < 3; d++) {
          r[d] = grid->lower[d] + node[d] * grid->h - pairing->spheres->state[i].center[d];
          r2 += r[d] * r[d];
        }
        if (r2 > inner * inner || DLMGridOnWall(grid, node[0], node[1], node[2])) continue;
        PetscCall(BelongsToOther(pairing, i, r, n_pairs, pairs, &other));
        if (other) continue;
        PetscCall(AddPoint(m, r));
        PetscCall(AddEntry(m, node, 1.0));
      }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPairingOverlaps(DLMPairing pairing, PetscInt *n, PetscInt **pairs)
{
  PetscFunctionBegin;
  *n     = 0;
  *pairs = NULL;
  if (pairing->scene->pairing_points == DLM_POINTS_VOLUME) PetscCall(DLMSpheresFindPairs(pairing->spheres, 0.0, n, pairs));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMMarkersAppend(DLMPairing pairing, PetscInt sphere, const DLMCover *cover, PetscInt n_pairs, const PetscInt *pairs, DLMMarkers *markers)
{
  PetscFunctionBegin;
  PetscCall(AddSurfacePoints(pairing, sphere, cover, markers));
  if (pairing->scene->pairing_points == DLM_POINTS_VOLUME) PetscCall(AddInnerNodes(pairing, sphere, n_pairs, pairs, markers));
  PetscFunctionReturn(0);
}
