#include "../../include/private/response.h"

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
          DLMResponseFar(r, r->far_table, o)[3 * v + c] += leaves[3 * at + v] / 8.0;
          if (near) DLMResponseNear(r, parity, o)[3 * v + c] = leaves[3 * at + v];
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
        PetscReal     *a = DLMResponseFar(r, r->far_table, o), *b = DLMResponseFar(r, r->far_table, m);
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
        PetscReal *s = DLMResponseFar(r, r->smooth_table, o);
        for (PetscInt q = 0; q < 27; q++) {
          const PetscInt  e[3] = { q % 3 - 1, (q / 3) % 3 - 1, q / 9 - 1 };
          PetscInt        n[3];
          const PetscReal weight = 1.0 / (PetscReal)(8 << (PetscAbsInt(e[0]) + PetscAbsInt(e[1]) + PetscAbsInt(e[2])));
          for (int d = 0; d < 3; d++) n[d] = PetscMax(-r->far, PetscMin(r->far, o[d] + e[d]));
          for (int k = 0; k < 9; k++) s[k] += weight * DLMResponseFar(r, r->far_table, n)[k];
        }
      }
}

static const PetscInt near_reach = DLM_RESPONSE_CLOSE + 2 * DLM_RESPONSE_REACH;

static PetscInt Cube(PetscInt reach)
{
  return (2 * reach + 1) * (2 * reach + 1) * (2 * reach + 1);
}

PetscReal DLMResponseBytes(PetscInt far)
{
  return 9.0 * sizeof(PetscReal) * (8.0 * Cube(near_reach) + 2.0 * Cube(PetscMax(far, near_reach)));
}

/*
  The velocity at the nodes of a box. Half a box answers an impulse together with its mirror image, or, turned, with the negative of that: the mean of the two answers is that of the
  impulse alone.
*/
static PetscErrorCode Respond(DLMStokes stokes, PetscSF sf, const DLMNodeBox *box, Vec rhs, Vec x, PetscBool turned, PetscScalar *values)
{
  DLMGrid            grid = stokes->grid;
  const PetscScalar *u;
  MPI_Datatype       node;

  PetscFunctionBeginUser;
  PetscCall(DLMNodeType(&node));
  DLMBoxTurn(stokes->box, turned);
  PetscCall(DLMStokesSolve(stokes, rhs, x));
  DLMBoxTurn(stokes->box, PETSC_FALSE);
  PetscCall(VecGetArrayRead(x, &u));
  PetscCall(PetscSFBcastBegin(sf, node, u, values, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, node, u, values, MPI_REPLACE));
  PetscCall(VecRestoreArrayRead(x, &u));
  for (PetscInt l = 0; l < box->width[0] * box->width[1] * box->width[2] && grid->half; l++) {
    PetscBool image;
    (void)DLMGridFold(grid, 1, grid->cells[1], box->low[1] + l / box->width[0] % box->width[1], &image);
    for (int c = 0; c < 3 && image; c++) values[3 * l + c] *= turned ? -DLMMirrorVector[c] : DLMMirrorVector[c];
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Create(DLMStokes stokes, PetscInt far, DLMResponse **new_response)
{
  DLMGrid      grid = stokes->grid;
  DLMResponse *r;
  DLMNodeBox   box = { .start = 0 };
  PetscInt     base[3], leaves = 1;
  PetscSF      sf;
  Vec          rhs, x;
  PetscScalar *values, *turned;
  PetscReal    rtol;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&r));
  r->near = near_reach;
  r->far  = PetscMax(far, r->near);
  PetscCall(PetscCalloc3(9 * 8 * Cube(r->near), &r->near_table, 9 * Cube(r->far), &r->far_table, 9 * Cube(r->far), &r->smooth_table));
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
  PetscCall(DLMNodeBoxForest(grid, 1, &box, &sf));
  PetscCall(PetscMalloc2(3 * leaves, &values, grid->half ? 3 * leaves : 0, &turned));
  PetscCall(DLMStokesCreateVec(stokes, &rhs));
  PetscCall(VecDuplicate(rhs, &x));
  PetscCall(DLMStokesSetInnerTolerance(stokes, 1e-4, &rtol)); /* the tables only feed a preconditioner */
  for (PetscInt parity = 0; parity < 8; parity++) {
    const PetscInt source[3] = { base[0] + parity % 2, base[1] + (parity / 2) % 2, base[2] + parity / 4 };
    for (int c = 0; c < 3; c++) {
      PetscCall(SetImpulse(stokes, source, c, rhs));
      PetscCall(Respond(stokes, sf, &box, rhs, x, PETSC_FALSE, values));
      if (grid->half) {
        PetscCall(Respond(stokes, sf, &box, rhs, x, PETSC_TRUE, turned));
        for (PetscInt i = 0; i < 3 * leaves; i++) values[i] = 0.5 * (values[i] + turned[i]);
      }
      Store(r, &box, values, source, parity, c);
    }
  }
  PetscCall(DLMStokesSetInnerTolerance(stokes, rtol, &rtol));
  Symmetrise(r);
  Smooth(r);
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&rhs));
  PetscCall(PetscFree2(values, turned));
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
