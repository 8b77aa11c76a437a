#ifndef DLM_SADDLEIMPL_H
#define DLM_SADDLEIMPL_H

#include "../dlmsaddle.h"
#include "../dlmlubrication.h"
#include "response.h"

/*
  Where every sphere's unknowns live in the bodies' vector: on rank r first the multipliers of its spheres (3 per point), then
  V, omega of each (6 per sphere). Known on every rank.
*/
typedef struct {
  PetscInt     n_multipliers, n_local; /* of this rank */
  PetscInt    *points;                 /* multipliers of sphere i, in 3-vectors */
  PetscInt    *multiplier, *rigid;     /* offsets of sphere i in its owner's part */
  PetscMPIInt *rank;
} DLMBodyLayout;

/* One dense block: the spheres of a cluster, and the factors of its constraint preconditioner. */
typedef struct {
  PetscInt   n_spheres, *spheres; /* ascending */
  PetscInt   n;                   /* multipliers */
  PetscReal *center;              /* where the spheres were when the block was built */
  PetscReal *origin;              /* the same, or where the sphere was whose factors a lone sphere took over */
  PetscReal *factor;              /* Cholesky factor of S = Q^T J L J^T Q, column major, lower; NULL: the unit matrix */
  PetscReal *R, *Y;               /* n x 6 n_spheres: Q^T of the rigid motions, and (scale S)^-1 R */
  PetscBool  harmonic;            /* fewer multipliers than points */
  PetscReal *W;                   /* Cholesky factor of R^T (scale S)^-1 R + M/dt + Z, Z without cut gaps */
  PetscInt   start;               /* first entry in the gathered vector: multipliers, then rigid motions */
} DLMBlock;

/*
  Dense preconditioner of the bodies' Schur complement [-J L J^T, R; R^T, M/dt].

  Iterates of lambda hardly depend on the scale of S, but the part of the slip that is a rigid motion changes by 1 - alpha per step of length alpha, and
  alpha goes with the scale: where steps may be longer than 2 that part would grow until nothing else is left of the residual (Rozloznik and
  Simoncini, SIAM J. Matrix Anal. Appl. 24, 2002).
*/
typedef struct {
  DLMSpheres     spheres;
  DLMPairing     pairing;
  const DLMScene *scene;
  DLMStokes      stokes;
  DLMLubrication *lubrication;
  const DLMResponse *response;
  PetscBool      plain;           /* unit matrix in place of J L J^T (Uzawa) */
  PetscBool      smooth;          /* harmonics on surface points: S is well conditioned */
  PetscReal      scale;           /* of S in all blocks */
  PetscInt       n, capacity;
  DLMBlock      *block;           /* of this rank */
  PetscSF        gather;          /* bodies' vector -> blocks */
  PetscInt       n_gathered;
  PetscReal     *gathered;
  PetscInt       n_cut;           /* gaps whose friction couples two blocks */
  PetscInt       n_clusters, largest, built;
} DLMBlocks;

struct _p_DLMSaddle {
  DLMStokes       stokes;
  DLMSpheres      spheres;
  DLMPairing      pairing;
  const DLMScene *scene;
  DLMBodyLayout   layout;
  DLMBlocks      *blocks;
  DLMInertia      inertia;
  DLMLubrication  lubrication;    /* at the centres of the last solve */
  PetscBool       uzawa;          /* velocity | (pressure, bodies) instead of fluid | bodies */
  KSP             bodies_ksp;     /* borrowed from ksp */
  PetscReal       rtol;           /* of the bodies' solve */
  PetscReal       viscosity;      /* of the fluid over that of the Stokes operator (B10) */
  Vec             lumped_mass;    /* Uzawa: -pressure mass / mu */
  KSP             ksp;            /* NULL before the first solve and after a change of layout */
  Mat             coupling, bodies; /* C = -J^T Q, E */
  PetscScalar    *at_points;      /* work: 3 per point of this rank */
  Vec             rhs, x;         /* (u, p, lambda, U) */
  Vec             fluid;          /* (u, p) of the last solve */
  PetscReal      *lambda;         /* multipliers and rigid motions the next solve starts from */
  PetscReal       reference;      /* energy norm that the tolerance refers to */
  DLMSaddleWork   work;
  DLMSaddleParts  parts;
};

/*
  Uzawa's preconditioner: this times the pressure mass over mu, and this times a unit matrix of the size of J A^-1 J^T for the multipliers (see DLMBlocks). Below 1
  for the sake of steps longer than 2.
*/
static const PetscReal DLMUzawaFactor = 0.2;

static inline PetscReal DLMUzawaScale(DLMStokes stokes)
{
  return DLMUzawaFactor / (stokes->viscosity * stokes->grid->h);
}

/* clusters.c: cluster[i] of every sphere, numbered by their first sphere; the same on every rank. */
PETSC_INTERN PetscErrorCode DLMFindClusters(DLMSpheres spheres, const DLMScene *scene, const DLMBodyLayout *layout, PetscInt *n, PetscInt *cluster);

/*
  blocks.c: the gap between a lone sphere at the center (NULL: where it is now) and a wall, from h to the radius; else, and for a cluster, PETSC_MAX_REAL, and
  the block leaves the walls out: images blurred by the delta (narrower gaps), of several spheres, or on point multipliers can make it indefinite. Not collective.
*/
PETSC_INTERN PetscReal DLMBlockWallGap(const DLMBlocks *blocks, const DLMBlock *block, const PetscReal center[3]);
/*
  assemble.c: the dense matrices of a block from its markers. Points of its s-th sphere start at first[s]; sphere_of names the sphere of every
  point. block->factor <- S, block->R <- Q^T of the rigid motions.
*/
PETSC_INTERN PetscErrorCode DLMBlockAssemble(DLMBlocks *blocks, DLMBlock *block, const DLMMarkers *markers, const PetscInt *first, const PetscInt *sphere_of);
PETSC_INTERN PetscErrorCode DLMBlockFillRigid(DLMBlocks *blocks, DLMBlock *block, const DLMMarkers *markers, const PetscInt *first);

PETSC_INTERN PetscErrorCode DLMBlocksCreate(DLMStokes stokes, DLMPairing pairing, DLMSpheres spheres, const DLMScene *scene, DLMLubrication *lubrication, PetscBool plain,
                                            DLMBlocks **blocks);
PETSC_INTERN PetscErrorCode DLMBlocksDestroy(DLMBlocks **blocks);
/* Brings the blocks up to date with centres, layout and inertia. Collective. */
PETSC_INTERN PetscErrorCode DLMBlocksUpdate(DLMBlocks *blocks, const DLMBodyLayout *layout, PetscReal inertia_weight);
/*
  What the blocks are made from, by sphere and the same on every rank, and blocks made anew from it: on the rank that had them, or on that of their first
  sphere if the number of ranks was another one. Blocks that do not outlast a move are left to DLMBlocksUpdate. Collective.
*/
PETSC_INTERN PetscErrorCode DLMBlocksGetState(DLMBlocks *blocks, DLMBlockState *state);
PETSC_INTERN PetscErrorCode DLMBlocksSetState(DLMBlocks *blocks, const DLMBodyLayout *layout, const DLMBlockState *state);
/* z <- [-scale S, R; R^T, M/dt]^-1 r, block by block; local parts of bodies' vectors. Collective. */
PETSC_INTERN PetscErrorCode DLMBlocksApply(DLMBlocks *blocks, const PetscScalar *r, PetscScalar *z);
/* sum over the blocks of lambda^T S lambda. Collective. */
PETSC_INTERN PetscErrorCode DLMBlocksEnergy(DLMBlocks *blocks, const PetscScalar *x, PetscReal *energy);

/* rigid.c: W of a block, factored; and the solve with the W of all blocks, in place in the gathered vector, when cut gaps couple them. Collective. */
PETSC_INTERN PetscErrorCode DLMBlockBuildRigid(const DLMBlocks *blocks, DLMBlock *block, PetscReal inertia_weight);
PETSC_INTERN PetscErrorCode DLMBlocksSolveRigid(DLMBlocks *blocks);
/*
  friction.c. Friction on the owned spheres: load[6 owned] -= Z U, held components apart in U and load, walls at rest. Collective; does nothing without gaps.
*/
PETSC_INTERN PetscErrorCode DLMSaddleSubtractFriction(DLMSaddle saddle, const PetscScalar *U, PetscScalar *load);
/* load[6 n] += friction on every sphere by the motions in the states, walls moving. Not collective. */
PETSC_INTERN void DLMSaddleAddFriction(DLMSaddle saddle, PetscReal *load);
/* The friction's part of the moments, from the gaps at the walls of an axis. Not collective. */
PETSC_INTERN void DLMSaddleWallFriction(DLMSaddle saddle, int axis, DLMWallMoments *moments);
/* Adds friction to force, torque and stresslet of all spheres, the same on every rank. Not collective. */
PETSC_INTERN void DLMSaddleShareFriction(DLMSaddle saddle);

/*
  Pressure and multipliers times a factor. Between solves they are stresses; within one they are divided by the ratio of the viscosities, as is all else that is a
  force, and the operator is that of the Stokes object (B10). Collective.
*/
PETSC_INTERN PetscErrorCode DLMSaddleScaleStress(DLMSaddle saddle, PetscReal factor);
/* M and I of sphere i times weight, per rigid component; 1 for a held component. */
PETSC_INTERN void DLMRigidMass(const DLMScene *scene, PetscInt i, PetscReal weight, PetscReal mass[6]);
static inline PetscBool DLMRigidHeld(const DLMScene *scene, PetscInt i, int c)
{
  const DLMMotion motion = scene->spheres[i].motion;
  if (scene->box_mirror == DLM_MIRROR_HALF && (c == 1 || c == 3 || c == 5)) return PETSC_TRUE; /* its mirror image would do the opposite */
  return (PetscBool)(motion == DLM_MOTION_FIXED || (motion == DLM_MOTION_ROTATE && c < 3));
}
/* v <- V + omega x r. */
static inline void DLMRigidVelocity(const PetscReal U[6], const PetscReal r[3], PetscReal v[3])
{
  v[0] = U[0] + U[4] * r[2] - U[5] * r[1];
  v[1] = U[1] + U[5] * r[0] - U[3] * r[2];
  v[2] = U[2] + U[3] * r[1] - U[4] * r[0];
}

/* load += (lambda, r x lambda). */
static inline void DLMRigidLoad(const PetscReal lambda[3], const PetscReal r[3], PetscReal load[6])
{
  for (int c = 0; c < 3; c++) load[c] += lambda[c];
  load[3] += r[1] * lambda[2] - r[2] * lambda[1];
  load[4] += r[2] * lambda[0] - r[0] * lambda[2];
  load[5] += r[0] * lambda[1] - r[1] * lambda[0];
}

/* values[n_multipliers] <- Q^T (V + omega x r) for rigid motions U given by sphere (6 each, at stride from U of the k-th owned one). */
PETSC_INTERN PetscErrorCode DLMSaddleRigidMotion(DLMSaddle s, const PetscScalar *U, PetscScalar *values);
/* values -= epsilon lambda, the compliance of the cover (P5). */
PETSC_INTERN PetscErrorCode DLMSaddleComply(DLMSaddle s, const PetscScalar *multipliers, PetscScalar *values);
/* load[6 owned] <- force and torque (sum of lambda, sum of r x lambda) of multipliers; overwritten. */
PETSC_INTERN PetscErrorCode DLMSaddleLoads(DLMSaddle s, const PetscScalar *multipliers, PetscScalar *load);

/* saddle.c: markers, layout and solver for the present centres; the multipliers move along. Collective. */
PETSC_INTERN PetscErrorCode DLMSaddleUpdateLayout(DLMSaddle saddle);
PETSC_INTERN PetscErrorCode DLMLayoutUpdate(DLMSpheres spheres, DLMPairing pairing, DLMBodyLayout *layout);
PETSC_INTERN PetscErrorCode DLMLayoutDestroy(DLMBodyLayout *layout);

/* solver.c: the KSP for the present layout. */
PETSC_INTERN PetscErrorCode DLMSaddleBuildSolver(DLMSaddle saddle);
PETSC_INTERN PetscErrorCode DLMSaddleResetSolver(DLMSaddle saddle);
PETSC_INTERN PetscErrorCode DLMSaddleRegister(void);

/* result.c: takes u, p, lambda and U from the solution of the KSP and writes the states of the spheres. Collective. */
PETSC_INTERN PetscErrorCode DLMSaddleStoreResult(DLMSaddle saddle);
#endif
