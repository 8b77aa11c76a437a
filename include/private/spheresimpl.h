#ifndef DLM_SPHERESIMPL_H
#define DLM_SPHERESIMPL_H

#include <petscsf.h>
#include "../dlmspheres.h"
#include "gridimpl.h"
#include "markers.h"

struct _p_DLMSpheres {
  DLMGrid         grid;
  const DLMScene *scene;
  PetscInt        n;
  DLMSphereState *state;
  PetscMPIInt    *owner;
  PetscInt        n_owned, *owned;
};

/* A box of nodes around an owned sphere; its nodes are leaves of the pairing's star forest. */
typedef struct {
  PetscInt low[3], width[3], start; /* start: first leaf */
} DLMNodeBox;

/* Surface points of the unit sphere and their harmonics, shared by all spheres of a size. */
typedef struct {
  PetscInt   n, degree, m;
  PetscReal *x;
  PetscReal *Q; /* m columns of n; NULL: unit matrix */
} DLMPointSetData;

/* Multiplier points of some spheres, and the nodes and weights of their stencils. */
typedef struct {
  PetscInt   n, n_entries, capacity, entry_capacity;
  PetscReal *r;      /* 3 per point, from the sphere's centre */
  PetscInt  *entry;  /* n + 1: entries of each point */
  PetscInt  *node;   /* 3 per entry, not wrapped */
  PetscReal *weight; /* one per entry */
} DLMMarkers;

/* What a leaf stands for: an unknown node; one whose velocity is a wall's; in half a box a node, the mirror image of a node, or a node on the mirror. */
enum { DLM_LEAF_NODE, DLM_LEAF_WALL, DLM_LEAF_TWIN, DLM_LEAF_IMAGE, DLM_LEAF_MIRROR };

struct _p_DLMPairing {
  DLMSpheres       spheres;
  const DLMScene  *scene;
  PetscInt         n_sets;
  DLMPointSetData *sets;
  DLMMarkers       markers;    /* of the owned spheres */
  PetscInt        *first;      /* owned + 1: points of each owned sphere */
  PetscInt        *first_multiplier; /* owned + 1 */
  PetscInt        *leaf;       /* leaf of each entry */
  PetscInt         n_boxes, n_leaves;
  DLMNodeBox      *box;
  char            *leaf_kind;  /* DLM_LEAF_... */
  PetscScalar     *leaves;     /* 3 per leaf */
  PetscSF          sf;         /* velocity nodes -> leaves */
};

/*
  Star forest from velocity nodes (roots, DLMNodeType units) to the nodes of boxes on this rank (leaves), box by box with x1
  fastest. Boxes may wrap around periodic axes and reach through mirrors, where a leaf holds the node that it is the image of; on other axes they lie inside
  the mesh. Collective.
*/
PETSC_INTERN PetscErrorCode DLMNodeBoxForest(DLMGrid grid, PetscInt n, const DLMNodeBox *boxes, PetscSF *sf);
/* Three scalars; created once, never freed before MPI_Finalize. */
PETSC_INTERN PetscErrorCode DLMNodeType(MPI_Datatype *type);

/* The nodes that a sphere's stencils can touch; start is left alone. Not collective. */
PETSC_INTERN void DLMPairingGetBox(DLMPairing pairing, PetscInt sphere, DLMNodeBox *box);
/*
  Appends the points of any sphere, owned or not, at its present centre: surface points first, then inner nodes. near: the spheres that
  overlap it (2 n_pairs sphere numbers, pair by pair). Not collective.
*/
PETSC_INTERN PetscErrorCode DLMMarkersAppend(DLMPairing pairing, PetscInt sphere, const DLMCover *cover, PetscInt n_pairs, const PetscInt *pairs, DLMMarkers *markers);
PETSC_INTERN PetscErrorCode DLMMarkersReset(DLMMarkers *markers);
PETSC_INTERN PetscErrorCode DLMMarkersDestroy(DLMMarkers *markers);
/* The unit points of a cover, and their Q. Borrowed, until the next new cover. */
PETSC_INTERN PetscErrorCode DLMPairingGetPointSet(DLMPairing pairing, const DLMCover *cover, const DLMPointSetData **set);
/*
  The cover that dense blocks are built from: the same harmonics on fewer points. A coefficient on n points stands for
  sqrt(n_block / n) of it on the block's.
*/
PETSC_INTERN PetscErrorCode DLMPairingGetBlockCover(const DLMScene *scene, PetscReal radius, DLMCover *cover);
/* y[3 n_multipliers] += scale epsilon c, the compliance of one sphere's cover (docs/theory.md, P5). */
PETSC_INTERN void DLMCoverComply(const DLMCover *cover, PetscReal scale, const PetscScalar *c, PetscScalar *y);
/* c[3 n_multipliers] of one sphere's harmonics <- their symmetric part under the mirror x2 -> -x2. */
PETSC_INTERN void DLMCoverSymmetrise(const DLMCover *cover, PetscScalar *c);
/* Pairs of overlapping spheres, where the point set needs them; else none. Free with PetscFree. */
PETSC_INTERN PetscErrorCode DLMPairingOverlaps(DLMPairing pairing, PetscInt *n, PetscInt **pairs);
#endif
