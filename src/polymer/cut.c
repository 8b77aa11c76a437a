#include "../../include/private/polymerimpl.h"

/*
  Fluid-weighted adjoint pair near the spheres (docs/theory.md, P7). The stress of the polymer lives in the fluid: its force is
  -int_fluid tau : grad v, and the gradient that stretches C at a node is the mean over the fluid parts of its tetrahedra:

    g_b = sum_t w_t grad u_t / sum_t w_t,      f_a = - sum_t w_t V grad phi_a . (mean of tau over the corners of t)

  w_t: fluid part of tetrahedron t under the linear level set of its corners. Where w = 1 this is the plain pair; the two stay adjoint
  under the masses sum_t w_t V/4.
*/

/* Part of a tetrahedron where the linear function of corner values s is positive. */
static double PositivePart(const double s[4])
{
  double p[4], n[4];
  int    np = 0, nn = 0;

  for (int k = 0; k < 4; k++) {
    if (s[k] > 0.0) p[np++] = s[k];
    else n[nn++] = -s[k];
  }
  switch (np) {
  case 0: return 0.0;
  case 1: return p[0] * p[0] * p[0] / ((p[0] + n[0]) * (p[0] + n[1]) * (p[0] + n[2]));
  case 2: {
    const double ac = p[0] / (p[0] + n[0]), ad = p[0] / (p[0] + n[1]), bc = p[1] / (p[1] + n[0]), bd = p[1] / (p[1] + n[1]);
    return ac * ad + bc * bd * (1.0 - ac) + ac * bd * (1.0 - ad);
  }
  case 3: return 1.0 - n[0] * n[0] * n[0] / ((n[0] + p[0]) * (n[0] + p[1]) * (n[0] + p[2]));
  default: return 1.0;
  }
}

/* level <- distance to the nearest surface, positive in the fluid, where it is below `reach`; else reach. */
static PetscErrorCode SetLevel(DLMPolymer p, PetscReal reach)
{
  const DLMPolymerBlock *b = &p->block;
  const PetscReal        h = p->grid->h;
  DLMSphereState        *state;
  PetscInt               n;

  PetscFunctionBegin;
  for (PetscInt x = 0; x < b->n_ghosted; x++) p->level[x] = reach;
  PetscCall(DLMSpheresGetStates(p->spheres, &n, &state));
  for (PetscInt s = 0; s < n; s++) {
    const PetscReal a = p->scene->spheres[s].radius;
    for (PetscInt k = 0; k < b->ghost_width[2]; k++)
      for (PetscInt j = 0; j < b->ghost_width[1]; j++) {
        const PetscInt node[3] = { b->ghost_start[0], b->ghost_start[1] + j, b->ghost_start[2] + k };
        PetscReal      x[3];
        for (int d = 0; d < 3; d++) {
          x[d] = p->grid->lower[d] + h * node[d] - state[s].center[d];
          if (p->grid->periodic[d] && d > 0) x[d] -= p->scene->box_size[d] * PetscFloorReal(0.5 + x[d] / p->scene->box_size[d]);
        }
        if (x[1] * x[1] + x[2] * x[2] >= (a + reach) * (a + reach)) continue;
        for (PetscInt i = 0; i < b->ghost_width[0]; i++) {
          PetscReal y = x[0] + h * i, *level = &p->level[i + b->stride[1] * j + b->stride[2] * k];
          if (p->grid->periodic[0]) y -= p->scene->box_size[0] * PetscFloorReal(0.5 + y / p->scene->box_size[0]);
          *level = PetscMin(*level, PetscSqrtReal(y * y + x[1] * x[1] + x[2] * x[2]) - a);
        }
      }
  }
  PetscFunctionReturn(0);
}

static void CollectVisit(DLMPolymer p, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context)
{
  const double reach = 1.75 * p->grid->h; /* beyond sqrt(3) h no tetrahedron of a node is cut */

  for (PetscInt x = 0; x < n; x++) {
    if (p->level[ghost + x] >= reach) continue;
    if (p->n_cut == p->cut_capacity) {
      p->cut_capacity = 2 * p->cut_capacity + 1024;
      p->cut          = realloc(p->cut, (size_t)p->cut_capacity * sizeof(*p->cut));
    }
    p->cut[p->n_cut++] = (DLMCutNode){ own + x, ghost + x, wall };
  }
}

PetscErrorCode DLMPolymerSetCut(DLMPolymer p)
{
  PetscFunctionBegin;
  if (!p->spheres) PetscFunctionReturn(0);
  p->n_cut = 0;
  PetscCall(SetLevel(p, 4.0 * p->grid->h));
  DLMPolymerLines(p, CollectVisit, NULL);
  PetscFunctionReturn(0);
}

/* A tetrahedron of a node: its corners in the ghosted arrays along the path, the node's place on it, and the sign of the path along each axis. */
typedef struct {
  long       corner[4];
  int        at, mirror;
  const int *axis;
  double     fluid;
} Tetrahedron;

enum { MOST_TETRAHEDRA = 96 }; /* 24 under each of the four ways to cut the cubes */

/* The tetrahedra of a node with their fluid parts; those beyond a wall do not exist. */
static int NodeTetrahedra(DLMPolymer p, const DLMCutNode *node, Tetrahedron t[MOST_TETRAHEDRA])
{
  const DLMPolymerBlock *b = &p->block;
  const PetscInt         place[3] = { b->start[0] + node->own % b->width[0], b->start[1] + (node->own / b->width[0]) % b->width[1],
                                      b->start[2] + node->own / (b->width[0] * b->width[1]) };
  int n = 0;

  for (int mirror = 0; mirror < 4; mirror++)
    for (int k = 0; k < 6; k++)
      for (int v = 0; v < 4; v++) {
        long   base   = node->ghost;
        int    exists = 1;
        double s[4];
        for (int d = 0; d < 3; d++) {
          const int      own  = p->cube.vertex[k][v][d] ^ ((mirror >> d) & 1);
          const PetscInt cell = place[d] - own;
          exists              = exists && (p->grid->periodic[d] || (cell >= 0 && cell < p->grid->cells[d]));
          base -= own * b->stride[d];
        }
        if (!exists) continue;
        for (int c = 0; c < 4; c++) {
          t[n].corner[c] = base;
          for (int d = 0; d < 3; d++) t[n].corner[c] += (p->cube.vertex[k][c][d] ^ ((mirror >> d) & 1)) * b->stride[d];
          s[c] = p->level[t[n].corner[c]] - p->cut_offset * p->grid->h;
        }
        t[n].at     = v;
        t[n].mirror = mirror;
        t[n].axis   = p->cube.axis[k];
        t[n].fluid  = PositivePart(s);
        n++;
      }
  return n;
}

static inline double Sign(const Tetrahedron *t, int e)
{
  return (t->mirror >> t->axis[e]) & 1 ? -1.0 : 1.0;
}

void DLMPolymerCutGradient(DLMPolymer p)
{
  for (PetscInt q = 0; q < p->n_cut; q++) {
    Tetrahedron t[MOST_TETRAHEDRA];
    const int   n      = NodeTetrahedra(p, &p->cut[q], t);
    double      weight = 0.0, g[9] = { 0.0 };
    for (int k = 0; k < n; k++) {
      weight += t[k].fluid;
      for (int e = 0; e < 3; e++)
        for (int i = 0; i < 3; i++) g[3 * i + t[k].axis[e]] += t[k].fluid * Sign(&t[k], e) * (p->u[i][t[k].corner[e + 1]] - p->u[i][t[k].corner[e]]);
    }
    if (weight < 1e-3) continue;
    for (int i = 0; i < 9; i++) p->g[i][p->cut[q].own] = g[i] / (weight * p->grid->h);
  }
}

void DLMPolymerCutForce(DLMPolymer p, double *f)
{
  static const int entry[3][3] = { { 0, 3, 4 }, { 3, 1, 5 }, { 4, 5, 2 } };
  const double     scale       = -p->grid->h * p->grid->h / 96.0;

  for (PetscInt q = 0; q < p->n_cut; q++) {
    Tetrahedron t[MOST_TETRAHEDRA];
    double     *y = f + 3 * (size_t)p->cut[q].own;
    const int   n = p->cut[q].wall ? 0 : NodeTetrahedra(p, &p->cut[q], t);
    y[0] = y[1] = y[2] = 0.0;
    for (int k = 0; k < n; k++) {
      const int in = t[k].at > 0 ? t[k].axis[t[k].at - 1] : -1, out = t[k].at < 3 ? t[k].axis[t[k].at] : -1;
      const double plus = in >= 0 ? Sign(&t[k], t[k].at - 1) : 0.0, minus = out >= 0 ? Sign(&t[k], t[k].at) : 0.0;
      double       sum[6] = { 0.0 };
      if (t[k].fluid == 0.0) continue;
      for (int c = 0; c < 4; c++)
        for (int m = 0; m < 6; m++) sum[m] += p->t[m][t[k].corner[c]];
      for (int i = 0; i < 3; i++) y[i] += scale * t[k].fluid * ((in >= 0 ? plus * sum[entry[i][in]] : 0.0) - (out >= 0 ? minus * sum[entry[i][out]] : 0.0));
    }
  }
}
