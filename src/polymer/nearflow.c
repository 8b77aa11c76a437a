#include "../../include/private/polymerimpl.h"
#include <petscblaslapack.h>

/*
  The flow that carries and stretches C near a sphere (docs/theory.md, V8). The mesh smears the kink of the velocity at a surface over about a mesh width on both sides, and
  what C makes of a gradient is of second and third order in it. So there C takes Stokes's flow past the sphere, whose 26 modes are fitted to the velocity of the mesh a
  little further out. No bound is sharp: nodes that lie on one, or as near to one sphere as to another, must not be sorted by rounding. Distances from the surface, in h:
*/
static const PetscReal fit_from = 1.5, fit_to = 3.0, edge = 0.5; /* nodes that are fitted, with ramps of half a mesh width about the ends */
static const PetscReal fade_outside = 2.0, fade_inside = 2.5; /* where the fitted flow ends; a mesh width before, it is whole */
static const PetscReal keep_off = 0.5; /* by so much another body has to be farther off for the fitted flow to begin; a mesh width on, it is whole */
static const PetscReal pin_edge = 0.1; /* across the surface */
static const PetscReal ridge = 1e-5; /* relative, of the normal equations: keeps modes that too few nodes tell apart small */

enum { N = DLM_LAMB_MODES };

typedef struct {
  PetscReal A[N][N], b[N];
} Normal;

/* r[0], r[1] <- distances of the nodes from the two spheres next to them. */
static PetscErrorCode RankVisit(DLMPolymer p, const DLMNearNode *node, void *context)
{
  double *near = &p->r[0][DLMPolymerGhostedIndex(p, node->i)], *next = &p->r[1][DLMPolymerGhostedIndex(p, node->i)];

  *next = PetscMin(*next, PetscMax(*near, node->distance));
  *near = PetscMin(*near, node->distance);
  return 0;
}

static PetscErrorCode FindNeighbours(DLMPolymer p, const DLMNearFlow *flow)
{
  PetscFunctionBegin;
  for (int k = 0; k < 2; k++)
    for (PetscInt q = 0; q < p->block.n_ghosted; q++) p->r[k][q] = PETSC_MAX_REAL;
  PetscCall(DLMPolymerVisitNear(p, flow, (fit_to + 0.5 * edge) * p->grid->h, RankVisit, NULL));
  PetscFunctionReturn(0);
}

static PetscReal Ramp(PetscReal x)
{
  return PetscMax(0.0, PetscMin(1.0, x));
}

/* Distance of the node from the sphere next to it, the node's own left out. */
static PetscReal OtherDistance(DLMPolymer p, const DLMNearNode *node)
{
  const PetscInt q = DLMPolymerGhostedIndex(p, node->i);

  return p->r[p->r[0][q] < node->distance ? 0 : 1][q];
}

/* Not at the centre itself. */
static PetscBool HasNormal(DLMPolymer p, const DLMNearNode *node)
{
  return (PetscBool)(p->scene->spheres[node->sphere].radius + node->distance > 1e-6 * p->grid->h);
}

/* Velocity of the rigid motion at x from the centre. */
static void Rigid(const DLMNearFlow *flow, const PetscReal x[3], double v[3])
{
  const PetscReal *w = flow->omega;

  for (int i = 0; i < 3; i++) v[i] = flow->velocity[i] + w[(i + 1) % 3] * x[(i + 2) % 3] - w[(i + 2) % 3] * x[(i + 1) % 3];
}

/* Adds the velocity v at x to the normal equations. */
static void AddVelocity(Normal *normal, PetscReal weight, const PetscReal x[3], const double v[3])
{
  double u[N][3];

  DLMLambModes(x, u, NULL);
  for (int k = 0; k < N; k++) {
    normal->b[k] += weight * (u[k][0] * v[0] + u[k][1] * v[1] + u[k][2] * v[2]);
    for (int m = 0; m <= k; m++) normal->A[k][m] += weight * (u[k][0] * u[m][0] + u[k][1] * u[m][1] + u[k][2] * u[m][2]);
  }
}

static PetscErrorCode FitVisit(DLMPolymer p, const DLMNearNode *node, void *context)
{
  Normal         *normal = (Normal *)context + node->sphere;
  const PetscInt  q = DLMPolymerGhostedIndex(p, node->i);
  const PetscReal a = p->scene->spheres[node->sphere].radius;
  const PetscReal y = node->distance / p->grid->h, other = OtherDistance(p, node) / p->grid->h;
  const PetscReal weight = Ramp(0.5 + (y - fit_from) / edge) * Ramp(0.5 + (fit_to - y) / edge) * Ramp(0.5 + (other - fit_from) / edge);
  PetscReal       x[3] = { node->x[0] / a, node->x[1] / a, node->x[2] / a };
  double          v[3];
  PetscInt        own;

  if (weight == 0.0 || !DLMPolymerOwnedIndex(p, node->i, &own)) return 0;
  Rigid(&p->near_flow[p->buffer][node->sphere], node->x, v);
  for (int i = 0; i < 3; i++) v[i] = p->u[i][q] - v[i];
  AddVelocity(normal, weight, x, v);
  if (DLMGridImages(p->grid, p->block.ghost_start[1] + node->i[1]) == 1) return 0;
  x[1] = -x[1];
  v[1] = -v[1];
  AddVelocity(normal, weight, x, v);
  return 0;
}

/* The amplitudes, from the normal equations in modes of one size. */
static PetscErrorCode Solve(Normal *normal, PetscReal mode[N])
{
  const PetscBLASInt n = N, one = 1;
  PetscBLASInt       info;
  PetscReal          size[N];

  PetscFunctionBegin;
  for (int k = 0; k < N; k++) size[k] = normal->A[k][k] > 0.0 ? PetscSqrtReal(normal->A[k][k]) : 1.0;
  for (int k = 0; k < N; k++) {
    mode[k] = normal->b[k] / size[k];
    for (int m = 0; m <= k; m++) normal->A[k][m] /= size[k] * size[m];
    normal->A[k][k] += ridge;
  }
  PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("U", &n, normal->A[0], &n, &info)); /* rows here are columns there */
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_PLIB, "normal equations of the near flow: LAPACK potrf returned %d", (int)info);
  PetscCallBLAS("LAPACKpotrs", LAPACKpotrs_("U", &n, &one, normal->A[0], &n, mode, &n, &info));
  for (int k = 0; k < N; k++) mode[k] /= size[k];
  PetscFunctionReturn(0);
}

static PetscErrorCode Fit(DLMPolymer p, DLMNearFlow *flow)
{
  DLMSphereState *state;
  Normal         *normal;
  PetscInt        n;

  PetscFunctionBegin;
  PetscCall(DLMSpheresGetStates(p->spheres, &n, &state));
  PetscCall(PetscCalloc1(n, &normal));
  for (PetscInt s = 0; s < n; s++)
    for (int d = 0; d < 3; d++) {
      flow[s].center[d]   = state[s].center[d];
      flow[s].velocity[d] = state[s].velocity[d];
      flow[s].omega[d]    = state[s].omega[d];
    }
  PetscCall(FindNeighbours(p, flow));
  PetscCall(DLMPolymerVisitNear(p, flow, (fit_to + 0.5 * edge) * p->grid->h, FitVisit, normal));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, normal, (PetscMPIInt)(n * (PetscInt)(sizeof(Normal) / sizeof(PetscReal))), MPIU_REAL, MPI_SUM, p->grid->comm));
  for (PetscInt s = 0; s < n; s++) PetscCall(Solve(&normal[s], flow[s].mode));
  PetscCall(PetscFree(normal));
  PetscFunctionReturn(0);
}

/* Part of the fitted flow at a node: whole about the surface, none where another body is as near. */
static PetscReal Part(DLMPolymer p, const DLMNearNode *node)
{
  const PetscReal h = p->grid->h, y = node->distance / h;
  PetscReal       other = OtherDistance(p, node);

  for (int d = 0; d < 3; d++) {
    const PetscInt at = p->block.ghost_start[d] + node->i[d];
    if (!p->grid->periodic[d]) other = PetscMin(other, h * PetscMin(at, p->grid->cells[d] - at));
  }
  return Ramp(y > 0.0 ? fade_outside - y : fade_inside + y) * Ramp(other / h - PetscMax(0.0, y) - keep_off);
}

/* Inside the sphere the gradient is that of the surface above, so that C there is what it is at the surface, and the velocity that of the sphere. */
static PetscErrorCode PutVisit(DLMPolymer p, const DLMNearNode *node, void *context)
{
  const DLMNearFlow *flow = (const DLMNearFlow *)context + node->sphere;
  const PetscInt     q = DLMPolymerGhostedIndex(p, node->i);
  const PetscReal    a = p->scene->spheres[node->sphere].radius, part = Part(p, node), r = a + node->distance;
  const PetscReal   *w = flow->omega, unit = node->distance > 0.0 ? 1.0 / a : 1.0 / r, x[3] = { unit * node->x[0], unit * node->x[1], unit * node->x[2] };
  double             u[N][3], g[N][9], v[3], G[9] = { 0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0 };
  PetscInt           own;

  if (part == 0.0 || !HasNormal(p, node)) return 0;
  DLMLambModes(x, u, g);
  Rigid(flow, node->x, v);
  for (int k = 0; k < N; k++) {
    for (int i = 0; i < 3 && node->distance > 0.0; i++) v[i] += flow->mode[k] * u[k][i];
    for (int j = 0; j < 9; j++) G[j] += flow->mode[k] * g[k][j] / a;
  }
  for (int i = 0; i < 3; i++) p->u[i][q] += part * (v[i] - p->u[i][q]);
  for (int j = 0; j < 9 && DLMPolymerOwnedIndex(p, node->i, &own); j++) p->g[j][own] += part * (G[j] - p->g[j][own]);
  return 0;
}

PetscErrorCode DLMPolymerNearFlow(DLMPolymer p, PetscBool known)
{
  DLMNearFlow *flow = p->near_flow[p->buffer];

  PetscFunctionBegin;
  if (!flow) PetscFunctionReturn(0);
  if (known) PetscCall(FindNeighbours(p, flow));
  else PetscCall(Fit(p, flow));
  PetscCall(DLMPolymerVisitNear(p, flow, fade_outside * p->grid->h, PutVisit, flow));
  PetscFunctionReturn(0);
}

/*
  C_nn <- 1 by a congruence, which keeps C positive definite; n: the normal of the surface. At the surface the fluid moves with the sphere and nothing stretches it along n, so
  there C_nn = 1 in every flow. What the mesh makes of C as it turns with the sphere would feed C_nn, and shear then multiplies it.
*/
static PetscErrorCode PinVisit(DLMPolymer p, const DLMNearNode *node, void *context)
{
  static const int at[3][3] = { { 0, 3, 4 }, { 3, 1, 5 }, { 4, 5, 2 } };
  const PetscReal  r = p->scene->spheres[node->sphere].radius + node->distance;
  double           n[3], Cn[3] = { 0.0 }, nn = 0.0, k;
  PetscInt         own;

  if (!HasNormal(p, node) || !DLMPolymerOwnedIndex(p, node->i, &own)) return 0;
  for (int i = 0; i < 3; i++) n[i] = node->x[i] / r;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) Cn[i] += p->c[at[i][j]][own] * n[j];
  for (int i = 0; i < 3; i++) nn += Cn[i] * n[i];
  if (!(nn > 0.0)) return 0; /* C is lost; whoever judges it stops the run */
  k = Ramp(0.5 - node->distance / (pin_edge * p->grid->h)) * (1.0 / PetscSqrtReal(nn) - 1.0);
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++) p->c[at[i][j]][own] += k * (n[i] * Cn[j] + Cn[i] * n[j]) + k * k * nn * n[i] * n[j];
  return 0;
}

PetscErrorCode DLMPolymerPinNear(DLMPolymer p)
{
  PetscFunctionBegin;
  if (!p->near_flow[0] || p->model->spring) PetscFunctionReturn(0); /* other springs rest elsewhere */
  PetscCall(DLMPolymerCheckOut(p));
  PetscCall(DLMPolymerVisitNear(p, NULL, 0.5 * pin_edge * p->grid->h, PinVisit, NULL));
  PetscCall(DLMPolymerCheckIn(p));
  PetscFunctionReturn(0);
}
