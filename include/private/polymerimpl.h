#ifndef DLM_POLYMERIMPL_H
#define DLM_POLYMERIMPL_H

#include "../dlmpolymer.h"
#include "gridimpl.h"
#include "lag.h"
#include "lamb.h"
#include "rheology.h"
#include "stressgrad.h"
#include "tensor.h"

/*
  Planar arrays of a rank: owned ones hold the n nodes of the rank, x1 fastest; ghosted ones one layer more on every side that has a neighbour.
*/
typedef struct {
  PetscInt start[3], width[3], n;                /* owned nodes */
  PetscInt ghost_start[3], ghost_width[3], n_ghosted;
  long     stride[3];                            /* of ghosted arrays */
} DLMPolymerBlock;

/* The force of the extra stress at the last two moments, and a vector to write the next one to. */
typedef struct {
  Vec       now, before, spare;
  PetscReal time_now, time_before;
  PetscInt  n; /* how many of the two are known */
} DLMForceHistory;

/* An owned node that is not wholly fluid. */
typedef struct {
  PetscInt  own;
  PetscReal part;
} DLMFluidPart;

/* Stokes's flow past a sphere (nearflow.c), of the last velocity: where the sphere was then, its motion, and the amplitudes of lamb.h, lengths in radii. */
typedef struct {
  PetscReal center[3], velocity[3], omega[3], mode[DLM_LAMB_MODES];
} DLMNearFlow;

/* A node near a sphere: at i[3] of the ghosted arrays, x[3] from the centre, at a distance from the surface (negative inside). */
typedef struct {
  PetscInt  sphere, i[3];
  PetscReal x[3], distance;
} DLMNearNode;

struct _p_DLMPolymer {
  DLMGrid            grid;
  DLMSpheres         spheres;
  const DLMScene    *scene;
  const DLMRheology *model;
  DM                 dm;      /* one scalar per node, one ghost layer */
  DLMPolymerBlock    block;
  DLMKuhnRow         rows[27];
  Vec                C;
  Vec                owned, local; /* shells around planar arrays, for the exchange of ghosts */
  double            *c[6];    /* planar components of C while it is checked out */
  double            *gradient[2], *g[9]; /* owned: projected gradient of the last velocity, g in one of two buffers; the other keeps that of the step before */
  int                buffer;
  PetscBool          fresh;   /* a velocity came since the state was kept */
  double            *ghosted, *t[6], *r[6], *u[3]; /* ghosted work arrays; u: the last velocity */
  double            *scratch; /* owned: 4 n */
  double            *line;    /* work of the advection */
  char              *inside;  /* ghosted: layer inside a sphere (inside.c), 0 outside */
  PetscInt           n_parts, parts_capacity;
  DLMFluidPart      *parts;
  DLMNearFlow       *near_flow[2]; /* of every sphere, for the gradient of the same buffer; NULL: the mesh's flow carries C everywhere */
  double            *inside_stress; /* 6 per sphere: DLMPolymerGetInsideStress */
  PetscReal          implicit_viscosity, growing; /* of the operator that the next force belongs to; part of the polymer's viscosity that grows within a step */
  PetscReal          stress_offset; /* the stress counts from a + stress_offset h on; 0: everywhere, inside the spheres too */
  int                cut;     /* which of the four ways to cut the cubes the last advection took */
  PetscInt           n_velocities; /* how many of the gradients in the two buffers are known */
  PetscReal          velocity_time, velocity_time_before; /* those of the last velocity and of the one of the step before */
  PetscReal          largest_speed; /* |u1| + |u2| + |u3| */
  DLMForceHistory    force;
  DLMPolymerHealth   health;
  Vec                kept_C; /* of the start of the step, like what follows */
  DLMForceHistory    kept_force;
  PetscReal          kept_time, kept_time_before, kept_trace;
  PetscInt           kept_velocities;
};

/* Owned index of the node at i[3] of the ghosted arrays; false if another rank owns it. */
static inline PetscBool DLMPolymerOwnedIndex(DLMPolymer p, const PetscInt i[3], PetscInt *own)
{
  const DLMPolymerBlock *b = &p->block;

  *own = 0;
  for (int d = 2; d >= 0; d--) {
    const PetscInt at = b->ghost_start[d] + i[d] - b->start[d];
    if (at < 0 || at >= b->width[d]) return PETSC_FALSE;
    *own = *own * b->width[d] + at;
  }
  return PETSC_TRUE;
}

/* Index in the ghosted arrays of the node at i[3] of them. */
static inline PetscInt DLMPolymerGhostedIndex(DLMPolymer p, const PetscInt i[3])
{
  return i[0] + (PetscInt)p->block.stride[1] * i[1] + (PetscInt)p->block.stride[2] * i[2];
}

/* Node of an owned index: counted in the whole mesh. */
static inline void DLMPolymerNode(DLMPolymer p, PetscInt own, PetscInt node[3])
{
  const DLMPolymerBlock *b = &p->block;

  node[0] = b->start[0] + own % b->width[0];
  node[1] = b->start[1] + own / b->width[0] % b->width[1];
  node[2] = b->start[2] + own / b->width[0] / b->width[1];
}

/* Entries of the gradient whose sum is 2 D, in the order of C. */
static const int DLMEntryIJ[6] = { 0, 4, 8, 1, 2, 5 }, DLMEntryJI[6] = { 0, 4, 8, 3, 6, 7 };

/* The lines of owned nodes: calls visit(polymer, place class, owned index, ghosted index, nodes, context) for runs of one class along x1. */
typedef void (*DLMLineVisit)(DLMPolymer polymer, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context);
PETSC_INTERN void DLMPolymerLines(DLMPolymer polymer, DLMLineVisit visit, void *context);
/*
  surface.c: visits every ghosted node whose distance from a sphere's surface is below reach, once for each such sphere; the centres are those of flow, or
  the present ones if that is NULL.
*/
typedef PetscErrorCode (*DLMNearVisit)(DLMPolymer polymer, const DLMNearNode *node, void *context);
PETSC_INTERN PetscErrorCode DLMPolymerVisitNear(DLMPolymer polymer, const DLMNearFlow *flow, PetscReal reach, DLMNearVisit visit, void *context);
/*
  nearflow.c: if the scene's rule for C asks for it, fits the near flows to the velocity in u (known: they are there already) and puts them, and their
  gradients, into u and g. Overwrites r[0], r[1]. Collective.
*/
PETSC_INTERN PetscErrorCode DLMPolymerNearFlow(DLMPolymer polymer, PetscBool known);
/* nearflow.c: under the same rule, what C holds along the normal inside the spheres <- 1. Not collective. */
PETSC_INTERN PetscErrorCode DLMPolymerPinNear(DLMPolymer polymer);
/* surface.c: finds the nodes near the spheres' present surfaces; weighs the owned planar tensor T by their fluid part. */
PETSC_INTERN PetscErrorCode DLMPolymerFindParts(DLMPolymer polymer);
PETSC_INTERN void           DLMPolymerWeighStress(DLMPolymer polymer, double *const T[6]);
/*
  coupling.c: the owned planar tensor T <- what the stress of C holds beyond the implicit operator's part; ahead: weight of the velocity's extrapolation
  (docs/theory.md, V3, V4). Not collective.
*/
PETSC_INTERN PetscErrorCode DLMPolymerExtraStress(DLMPolymer polymer, PetscReal ahead, double *const T[6]);
/* sums.c: inside_stress from the extra stress in the owned arrays r. Collective. */
PETSC_INTERN PetscErrorCode DLMPolymerSumInside(DLMPolymer polymer);
/* coupling.c: as DLMPolymerSetVelocity, but for the near flow. */
PETSC_INTERN PetscErrorCode DLMPolymerTakeVelocity(DLMPolymer polymer, PetscReal time, Vec x);
/* keep.c: makes the other gradient buffer the present one. */
PETSC_INTERN void DLMPolymerTurnGradient(DLMPolymer polymer);
/* A symmetric tensor: owned[k] -> ghosted[k], in the order of C. Collective. */
PETSC_INTERN PetscErrorCode DLMPolymerExchange(DLMPolymer polymer, double *const owned[6], double *const ghosted[6]);
/* Planar pointers into C; give them back. */
PETSC_INTERN PetscErrorCode DLMPolymerCheckOut(DLMPolymer polymer);
PETSC_INTERN PetscErrorCode DLMPolymerCheckIn(DLMPolymer polymer);
/* A visit that writes the lumped masses of the owned nodes to context, a double[n]. */
PETSC_INTERN void DLMPolymerMassVisit(DLMPolymer polymer, const DLMKuhnRow *row, PetscInt own, PetscInt ghost, PetscInt n, PetscBool wall, void *context);
/* Notes in the health that a kernel found C unsound at owned node bad of this rank, or at none (bad < 0). Collective. */
PETSC_INTERN PetscErrorCode DLMPolymerJudge(DLMPolymer polymer, long bad);
#endif
