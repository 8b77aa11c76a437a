#include "../../include/private/response.h"

void DLMResponseFieldSetPoint(DLMResponseField *f, const DLMResponse *response, DLMGrid grid, const DLMMarkers *m, PetscInt j, const PetscReal x[3])
{
  f->response  = response;
  f->grid      = grid;
  f->markers   = m;
  f->point     = j;
  f->n_sources = 0;
  for (int d = 0; d < 3; d++) {
    f->x[d]    = x[d];
    f->base[d] = (PetscInt)PetscFloorReal(x[d]);
  }
  for (PetscInt q = m->entry[j]; q < m->entry[j + 1]; q++) {
    const PetscInt *source = m->node + 3 * q, parity = (source[0] & 1) + 2 * (source[1] & 1) + 4 * (source[2] & 1);
    const PetscInt  o[3]   = { f->base[0] - source[0], f->base[1] - source[1], f->base[2] - source[2] };
    if (DLMGridOnWall(grid, source[0], source[1], source[2])) continue;
    f->weight[f->n_sources]             = m->weight[q];
    f->response_at_base[f->n_sources++] = DLMResponseNear(response, parity, o);
  }
  for (PetscInt k = 0; k < DLM_RESPONSE_WINDOW * DLM_RESPONSE_WINDOW * DLM_RESPONSE_WINDOW; k++) f->known[k] = PETSC_FALSE;
}

/* The velocity at offset o from the base. */
static void SumSources(const DLMResponseField *f, const PetscInt o[3], PetscReal velocity[9])
{
  const PetscInt w = 2 * f->response->near + 1, at = 9 * (o[0] + w * (o[1] + w * o[2]));
  PetscReal      sum[9] = { 0.0 };

  for (PetscInt q = 0; q < f->n_sources; q++) {
    const PetscReal weight = f->weight[q], *g = f->response_at_base[q] + at;
    for (int k = 0; k < 9; k++) sum[k] += weight * g[k];
  }
  for (int k = 0; k < 9; k++) velocity[k] = sum[k];
}

static void NearPair(DLMResponseField *f, PetscInt i, const PetscInt shift[3], PetscReal entry[9])
{
  const DLMMarkers *m = f->markers;

  for (PetscInt p = m->entry[i]; p < m->entry[i + 1]; p++) {
    const PetscInt *node = m->node + 3 * p, o[3] = { node[0] - shift[0] - f->base[0], node[1] - shift[1] - f->base[1], node[2] - shift[2] - f->base[2] };
    const PetscReal weight = m->weight[p];
    PetscInt        at = 0;
    if (DLMGridOnWall(f->grid, node[0], node[1], node[2])) continue;
    for (int d = 2; d >= 0; d--) at = DLM_RESPONSE_WINDOW * at + o[d] + DLM_RESPONSE_WINDOW / 2;
    if (!f->known[at]) SumSources(f, o, f->velocity + 9 * at);
    f->known[at] = PETSC_TRUE;
    for (int k = 0; k < 9; k++) entry[k] += weight * f->velocity[9 * at + k];
  }
}

/* The mean response at distance d: the delta on the smoothed table, or linear interpolation for collocated points. */
static void FarPair(const DLMResponse *r, const PetscReal d[3], PetscBool immersed, PetscReal entry[9])
{
  const PetscInt taps  = immersed ? 4 : 2, most = r->far - 2;
  PetscReal     *table = immersed ? r->smooth_table : r->far_table, scale = 1.0, weight[3][4], x[3], out = 0.0, sum[9] = { 0.0 };
  PetscInt       first[3];

  for (int c = 0; c < 3; c++) out = PetscMax(out, PetscAbsReal(d[c]));
  if (out > most) scale = most / out; /* beyond the table: as 1/r along the same direction */
  for (int c = 0; c < 3; c++) {
    x[c]     = scale * d[c];
    first[c] = (PetscInt)PetscFloorReal(x[c]) - (immersed ? 1 : 0);
    for (PetscInt k = 0; k < taps; k++) {
      const PetscReal z = x[c] - (first[c] + k);
      weight[c][k]      = immersed ? DLMDelta(z) : 1.0 - PetscAbsReal(z);
    }
  }
  for (PetscInt k = 0; k < taps; k++)
    for (PetscInt j = 0; j < taps; j++) {
      const PetscReal *g = DLMResponseFar(r, table, (PetscInt[3]){ first[0], first[1] + j, first[2] + k }), row = scale * weight[1][j] * weight[2][k];
      for (PetscInt i = 0; i < taps; i++, g += 9) {
        const PetscReal w = row * weight[0][i];
        for (int c = 0; c < 9; c++) sum[c] += w * g[c];
      }
    }
  for (int c = 0; c < 9; c++) entry[c] += sum[c];
}

void DLMResponseFieldEntry(DLMResponseField *f, PetscInt i, const PetscReal x[3], const PetscInt shift[3], PetscReal entry[9])
{
  const PetscInt *first = f->markers->entry;
  const PetscBool immersed = (PetscBool)(first[i + 1] - first[i] > 8 && first[f->point + 1] - first[f->point] > 8);
  PetscReal       d[3];
  PetscBool       near = PETSC_TRUE;

  for (int c = 0; c < 3; c++) {
    d[c] = x[c] - f->x[c] - shift[c];
    near = (PetscBool)(near && PetscAbsReal(d[c]) <= DLM_RESPONSE_CLOSE);
  }
  for (int k = 0; k < 9; k++) entry[k] = 0.0;
  if (near) NearPair(f, i, shift, entry);
  else FarPair(f->response, d, immersed, entry);
}
