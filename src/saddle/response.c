#include "../../include/private/response.h"

/* Points closer than this (in h, on every axis) are paired exactly, node by node. */
enum { CLOSE = 3, REACH = 2 };

/* The impulse: unit force along axis c at a node. */
static PetscErrorCode SetImpulse(DLMStokes stokes, const PetscInt node[3], int c, Vec rhs)
{
  PetscInt     index;
  PetscMPIInt  owner, rank;
  PetscScalar *f;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(stokes->grid->comm, &rank));
  PetscCall(DLMGridLocate(stokes->grid, 1, node, &owner, &index));
  PetscCall(VecZeroEntries(rhs));
  PetscCall(VecGetArray(rhs, &f));
  if (owner == rank) f[3 * index + c] = 1.0;
  PetscCall(VecRestoreArray(rhs, &f));
  PetscFunctionReturn(0);
}

static PetscReal *NearEntry(const DLMResponse *r, PetscInt parity, const PetscInt o[3])
{
  const PetscInt w = 2 * r->near + 1;

  return r->near_table + 9 * ((o[0] + r->near) + w * ((o[1] + r->near) + w * ((o[2] + r->near) + w * parity)));
}

static PetscReal *FarEntry(const DLMResponse *r, PetscReal *table, const PetscInt o[3])
{
  const PetscInt w = 2 * r->far + 1;

  return table + 9 * ((o[0] + r->far) + w * ((o[1] + r->far) + w * (o[2] + r->far)));
}

/* Stores the response around a source node, from the leaves of a node box. */
static void Store(DLMResponse *r, const DLMNodeBox *box, const PetscScalar *leaves, const PetscInt source[3], PetscInt parity, int c)
{
  PetscInt o[3];

  for (o[2] = -r->far; o[2] <= r->far; o[2]++)
    for (o[1] = -r->far; o[1] <= r->far; o[1]++)
      for (o[0] = -r->far; o[0] <= r->far; o[0]++) {
        const PetscBool near = (PetscBool)(PetscAbsInt(o[0]) <= r->near && PetscAbsInt(o[1]) <= r->near && PetscAbsInt(o[2]) <= r->near);
        PetscInt        at   = 0;
        PetscBool       inside = PETSC_TRUE;
        for (int d = 2; d >= 0; d--) {
          const PetscInt i = source[d] + o[d] - box->low[d];
          inside           = (PetscBool)(inside && i >= 0 && i < box->width[d]);
          at               = at * box->width[d] + i;
        }
        if (!inside) continue;
        for (int v = 0; v < 3; v++) {
          FarEntry(r, r->far_table, o)[3 * v + c] += leaves[3 * at + v] / 8.0;
          if (near) NearEntry(r, parity, o)[3 * v + c] = leaves[3 * at + v];
        }
      }
}

/* G(o) = G(-o)^T holds for the exact response of an unbounded box; the mean over parities gets it back. */
static void Symmetrise(DLMResponse *r)
{
  PetscInt o[3];

  for (o[2] = -r->far; o[2] <= r->far; o[2]++)
    for (o[1] = -r->far; o[1] <= r->far; o[1]++)
      for (o[0] = -r->far; o[0] <= r->far; o[0]++) {
        const PetscInt m[3] = { -o[0], -o[1], -o[2] };
        PetscReal     *a = FarEntry(r, r->far_table, o), *b = FarEntry(r, r->far_table, m);
        for (int v = 0; v < 3; v++)
          for (int c = 0; c < 3; c++) a[3 * v + c] = b[3 * c + v] = 0.5 * (a[3 * v + c] + b[3 * c + v]);
      }
}

/* The far table seen through a delta that sits on a node: weights 1/4, 1/2, 1/4 on each axis. */
static void Smooth(DLMResponse *r)
{
  PetscInt o[3];

  for (o[2] = -r->far; o[2] <= r->far; o[2]++)
    for (o[1] = -r->far; o[1] <= r->far; o[1]++)
      for (o[0] = -r->far; o[0] <= r->far; o[0]++) {
        PetscReal *s = FarEntry(r, r->smooth_table, o);
        for (PetscInt q = 0; q < 27; q++) {
          const PetscInt  e[3] = { q % 3 - 1, (q / 3) % 3 - 1, q / 9 - 1 };
          PetscInt        n[3];
          const PetscReal weight = 1.0 / (PetscReal)(8 << (PetscAbsInt(e[0]) + PetscAbsInt(e[1]) + PetscAbsInt(e[2])));
          for (int d = 0; d < 3; d++) n[d] = PetscMax(-r->far, PetscMin(r->far, o[d] + e[d]));
          for (int k = 0; k < 9; k++) s[k] += weight * FarEntry(r, r->far_table, n)[k];
        }
      }
}

static PetscErrorCode Create(DLMStokes stokes, PetscInt far, DLMResponse **new_response)
{
  DLMGrid      grid = stokes->grid;
  DLMResponse *r;
  DLMNodeBox   box = { .start = 0 };
  PetscInt     base[3], width, leaves = 1;
  PetscSF      sf;
  MPI_Datatype node;
  Vec          rhs, x;
  PetscScalar *values;
  PetscReal    rtol;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&r));
  r->near = CLOSE + 2 * REACH;
  r->far  = PetscMax(far, r->near);
  width   = 2 * r->far + 1;
  PetscCall(PetscCalloc3(9 * 8 * PetscSqr(2 * r->near + 1) * (2 * r->near + 1), &r->near_table, 9 * width * width * width, &r->far_table,
                         9 * width * width * width, &r->smooth_table));
  for (int d = 0; d < 3; d++) {
    base[d]       = 2 * (grid->cells[d] / 4);
    box.low[d]    = base[d] - r->far;
    box.width[d]  = 2 * r->far + 2;
    if (!grid->periodic[d]) {
      box.low[d]   = PetscMax(0, box.low[d]);
      box.width[d] = PetscMin(grid->cells[d], base[d] + r->far + 1) - box.low[d] + 1;
    }
    leaves *= box.width[d];
  }
  PetscCall(DLMNodeType(&node));
  PetscCall(DLMNodeBoxForest(grid, 1, &box, &sf));
  PetscCall(PetscMalloc1(3 * leaves, &values));
  PetscCall(DLMStokesCreateVec(stokes, &rhs));
  PetscCall(VecDuplicate(rhs, &x));
  PetscCall(DLMStokesSetInnerTolerance(stokes, 1e-4, &rtol)); /* the tables only feed a preconditioner */
  for (PetscInt parity = 0; parity < 8; parity++) {
    const PetscInt source[3] = { base[0] + parity % 2, base[1] + (parity / 2) % 2, base[2] + parity / 4 };
    for (int c = 0; c < 3; c++) {
      const PetscScalar *u;
      PetscCall(SetImpulse(stokes, source, c, rhs));
      PetscCall(DLMStokesSolve(stokes, rhs, x));
      PetscCall(VecGetArrayRead(x, &u));
      PetscCall(PetscSFBcastBegin(sf, node, u, values, MPI_REPLACE));
      PetscCall(PetscSFBcastEnd(sf, node, u, values, MPI_REPLACE));
      PetscCall(VecRestoreArrayRead(x, &u));
      Store(r, &box, values, source, parity, c);
    }
  }
  PetscCall(DLMStokesSetInnerTolerance(stokes, rtol, &rtol));
  Symmetrise(r);
  Smooth(r);
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&rhs));
  PetscCall(PetscFree(values));
  PetscCall(PetscSFDestroy(&sf));
  *new_response = r;
  PetscFunctionReturn(0);
}

static PetscErrorCode Destroy(void *pointer)
{
  DLMResponse *r = (DLMResponse *)pointer;

  PetscFunctionBegin;
  PetscCall(PetscFree3(r->near_table, r->far_table, r->smooth_table));
  PetscCall(PetscFree(r));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMResponseGet(DLMStokes stokes, PetscInt far, const DLMResponse **response)
{
  PetscContainer container;
  DLMResponse   *r;

  PetscFunctionBeginUser;
  PetscCall(PetscObjectQuery((PetscObject)stokes->K, "DLMResponse", (PetscObject *)&container));
  if (container) {
    PetscCall(PetscContainerGetPointer(container, (void **)response));
    if ((*response)->far >= far) PetscFunctionReturn(0);
  }
  PetscCall(Create(stokes, far, &r));
  PetscCall(PetscContainerCreate(stokes->grid->comm, &container));
  PetscCall(PetscContainerSetPointer(container, r));
  PetscCall(PetscContainerSetUserDestroy(container, Destroy));
  PetscCall(PetscObjectCompose((PetscObject)stokes->K, "DLMResponse", (PetscObject)container));
  PetscCall(PetscContainerDestroy(&container));
  *response = r;
  PetscFunctionReturn(0);
}

/* Node by node, with the table of each source node's parity. */
static void NearPair(const DLMResponse *r, DLMGrid grid, const DLMMarkers *a, PetscInt i, const DLMMarkers *b, PetscInt j, const PetscInt shift[3], PetscReal entry[9])
{
  for (PetscInt q = b->entry[j]; q < b->entry[j + 1]; q++) {
    const PetscInt *source = b->node + 3 * q, parity = (source[0] & 1) + 2 * (source[1] & 1) + 4 * (source[2] & 1);
    if (DLMGridOnWall(grid, source[0], source[1], source[2])) continue;
    for (PetscInt p = a->entry[i]; p < a->entry[i + 1]; p++) {
      const PetscInt  *target = a->node + 3 * p;
      const PetscInt   o[3]   = { target[0] - source[0] - shift[0], target[1] - source[1] - shift[1], target[2] - source[2] - shift[2] };
      const PetscReal *g      = NearEntry(r, parity, o), weight = a->weight[p] * b->weight[q];
      if (DLMGridOnWall(grid, target[0], target[1], target[2])) continue;
      for (int k = 0; k < 9; k++) entry[k] += weight * g[k];
    }
  }
}

/* The mean response at distance d: the delta on the smoothed table, or linear interpolation for collocated points. */
static void FarPair(const DLMResponse *r, const PetscReal d[3], PetscBool immersed, PetscReal entry[9])
{
  const PetscInt taps  = immersed ? 4 : 2, most = r->far - 2;
  PetscReal     *table = immersed ? r->smooth_table : r->far_table, scale = 1.0, weight[3][4], x[3], out = 0.0;
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
    for (PetscInt j = 0; j < taps; j++)
      for (PetscInt i = 0; i < taps; i++) {
        const PetscInt   o[3] = { first[0] + i, first[1] + j, first[2] + k };
        const PetscReal *g = FarEntry(r, table, o), w = scale * weight[0][i] * weight[1][j] * weight[2][k];
        for (int c = 0; c < 9; c++) entry[c] += w * g[c];
      }
}

void DLMResponseEntry(const DLMResponse *r, DLMGrid grid, const DLMMarkers *a, PetscInt i, const PetscReal xa[3], const DLMMarkers *b,
                      PetscInt j, const PetscReal xb[3], const PetscInt shift[3], PetscReal entry[9])
{
  const PetscBool immersed = (PetscBool)(a->entry[i + 1] - a->entry[i] > 8 && b->entry[j + 1] - b->entry[j] > 8);
  PetscReal       d[3];
  PetscBool       near = PETSC_TRUE;

  for (int c = 0; c < 3; c++) {
    d[c] = xa[c] - xb[c] - shift[c];
    near = (PetscBool)(near && PetscAbsReal(d[c]) <= CLOSE);
  }
  for (int k = 0; k < 9; k++) entry[k] = 0.0;
  if (near) NearPair(r, grid, a, i, b, j, shift, entry);
  else FarPair(r, d, immersed, entry);
}
