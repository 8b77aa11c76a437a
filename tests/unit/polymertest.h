/* What the tests of the conformation tensor share: a viscoelastic case, fields by position, fields in natural order. */
#ifndef POLYMERTEST_H
#define POLYMERTEST_H

#include "dlmtest.h"
#include "private/polymerimpl.h"

enum { MOST_SPHERES = 4 };

typedef struct {
  DLMScene      scene;
  DLMSphereSpec spec[MOST_SPHERES];
  DLMGrid       grid;
  DLMSpheres    spheres;
  DLMPolymer    polymer;
  DM            six; /* C as six components of a node */
} PolymerCase;

/* An Oldroyd-B fluid without spheres: lambda1 = 0.8, lambda2 = 0.1. The caller may change c->scene before OpenPolymer. */
static inline void MakePolymerScene(MPI_Comm comm, const PetscInt cells[3], unsigned periodic, PolymerCase *c)
{
  memset(c, 0, sizeof(*c));
  MakeScene(comm, cells, periodic, &c->scene);
  c->scene.fluid_model         = DLM_FLUID_OLDROYD_B;
  c->scene.relaxation_time     = 0.8;
  c->scene.retardation_time    = 0.1;
  c->scene.carreau_n           = 1.0;
  c->scene.polymer_form        = DLM_FORM_FACTOR;
  c->scene.polymer_coupling    = DLM_COUPLING_BOTH_SIDES;
  c->scene.polymer_inside      = DLM_INSIDE_EVOLVE;
  c->scene.polymer_courant     = 0.6;
  c->scene.polymer_mode_plane  = DLM_PLANE_13;
  c->scene.polymer_mode_number = 1;
  c->scene.spheres             = c->spec;
}

static inline void OpenPolymer(PolymerCase *c)
{
  Call(DLMGridCreate(&c->scene, &c->grid));
  if (c->scene.n_spheres) Call(DLMSpheresCreate(c->grid, &c->scene, &c->spheres));
  Call(DLMPolymerCreate(c->grid, c->spheres, &c->scene, &c->polymer));
  Call(DMDACreateCompatibleDMDA(c->grid->velocity, 6, &c->six));
}

static inline void ClosePolymer(PolymerCase *c)
{
  Call(DMDestroy(&c->six));
  Call(DLMPolymerDestroy(&c->polymer));
  Call(DLMSpheresDestroy(&c->spheres));
  Call(DLMGridDestroy(&c->grid));
}

/* The planar C of the polymer as a vector of c->six (into_polymer false), or that vector into the polymer. */
static inline void MoveConformation(PolymerCase *c, Vec nodes, PetscBool into_polymer)
{
  Vec          C;
  PetscScalar *planar, *x;
  PetscInt     n;

  Call(DLMPolymerGetConformation(c->polymer, &C));
  Call(VecGetLocalSize(C, &n));
  Call(VecGetArray(C, &planar));
  Call(VecGetArray(nodes, &x));
  for (PetscInt i = 0; i < n / 6; i++)
    for (int k = 0; k < 6; k++) {
      if (into_polymer) planar[k * (n / 6) + i] = x[6 * i + k];
      else x[6 * i + k] = planar[k * (n / 6) + i];
    }
  Call(VecRestoreArray(nodes, &x));
  Call(VecRestoreArray(C, &planar));
}

/* A new vector of c->six with the present C. */
static inline Vec NewConformation(PolymerCase *c)
{
  Vec nodes;

  Call(DMCreateGlobalVector(c->six, &nodes));
  MoveConformation(c, nodes, PETSC_FALSE);
  return nodes;
}

/* A field by position: one component of C (11, 22, 33, 12, 13, 23) or of a velocity. */
typedef double (*PointValue)(const double x[3], int component, const void *context);

typedef struct {
  DLMGrid     grid;
  PointValue  value;
  const void *context;
} PointField;

static inline double ValueAtNode(const PetscInt node[3], int component, const void *context)
{
  const PointField *f = context;
  double            x[3];

  for (int d = 0; d < 3; d++) x[d] = f->grid->lower[d] + f->grid->h * node[d];
  return f->value(x, component, f->context);
}

static inline Vec NewPointField(PolymerCase *c, DM dm, PointValue value, const void *context)
{
  Vec v;

  Call(DMCreateGlobalVector(dm, &v));
  FillNodes(dm, ValueAtNode, &(PointField){ c->grid, value, context }, v);
  return v;
}

static inline void SetConformation(PolymerCase *c, PointValue value, const void *context)
{
  Vec nodes = NewPointField(c, c->six, value, context);

  MoveConformation(c, nodes, PETSC_TRUE);
  Call(VecDestroy(&nodes));
}

static inline void SetPointVelocity(PolymerCase *c, PointValue value, const void *context)
{
  Vec u = NewPointField(c, c->grid->velocity, value, context);

  Call(DLMPolymerSetVelocity(c->polymer, 0.0, u));
  Call(VecDestroy(&u));
}

/* Random C = A A^T + 0.05 I, node by node, the same for every number of ranks. */
static inline double RandomConformation(const PetscInt i[3], int component, const void *context)
{
  static const int first[6] = { 0, 1, 2, 0, 0, 1 }, second[6] = { 0, 1, 2, 1, 2, 2 };
  const unsigned   seed = *(const unsigned *)context;
  const uint64_t   node = (uint64_t)(i[0] + 1000 * (i[1] + 1000 * i[2]));
  double           sum  = component < 3 ? 0.05 : 0.0;

  for (int k = 0; k < 3; k++) {
    const double a = Hash(seed, 9 * node + 3 * first[component] + k), b = Hash(seed, 9 * node + 3 * second[component] + k);
    sum += (a + (first[component] == k)) * (b + (second[component] == k));
  }
  return sum;
}

static inline void SetRandomConformation(PolymerCase *c, unsigned seed)
{
  Vec nodes;

  Call(DMCreateGlobalVector(c->six, &nodes));
  FillNodes(c->six, RandomConformation, &seed, nodes);
  MoveConformation(c, nodes, PETSC_TRUE);
  Call(VecDestroy(&nodes));
}
#endif
