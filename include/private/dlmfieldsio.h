/*
  Field output for ParaView, VisIt and h5py: one HDF5 file, which grows by each output and is whole at every moment (appendfile.h), and its XDMF text.

    dir/fields.h5    /step_0000010/FIELD   float64 [n3][n2][n1] or [n3][n2][n1][dof], attribute mesh
                     /step_0000010/POINTS  id int32 [n], then the positions float64 [n][3], then float64 or int32 [n] or [n][3]
                     /step_0000010         attributes step, time, xdmf: the output's part of fields.xmf
                     /meshes/NAME          attributes nodes, periodic, origin, spacing
    dir/fields.xmf   XDMF 3; made anew after each output, under a temporary name, then renamed (wholefile.h)

  After a kill or on a full disk the output that was being written is absent, and all before it are whole. Rank 0 gathers one field at a time; the run's
  other files show the same order.

  A periodic axis has as many nodes as cells. The file repeats its first plane at the end, n = nodes + 1, so that the picture is closed; readers that want
  each node once drop the last plane of the axes marked periodic.
*/
#ifndef DLMFIELDSIO_H
#define DLMFIELDSIO_H

#include <petscdmda.h>
#include "appendfile.h"

typedef struct _p_DLMFieldFile *DLMFieldFile;

/*
  DLMFieldFileCreate - starts the field output of a run in the existing folder dir. Collective.

  keep_through < 0: the outputs of an earlier run are removed. keep_through >= 0 (restart): those up to and including this step stay. Raises a user error if
  the files cannot be written, or fields.h5 is damaged.
*/
PETSC_EXTERN PetscErrorCode DLMFieldFileCreate(MPI_Comm comm, const char *dir, PetscInt keep_through, DLMFieldFile *file);
/*
  DLMFieldFileAddMesh - names a uniform mesh for the outputs to come.

  nodes[a] - nodes of the mesh along axis a (2 or more, so at least one cell); origin - position of its first node; spacing - mesh width per axis. The name
  (letters, digits, underscores) becomes that of the grid in ParaView.
*/
PETSC_EXTERN PetscErrorCode DLMFieldFileAddMesh(DLMFieldFile file, const char *name, const PetscInt nodes[3], const PetscReal origin[3],
                                                const PetscReal spacing[3], const PetscBool periodic[3]);
/* Opens an output. Steps ascend; one that is there already (the restart's own) is written anew. */
PETSC_EXTERN PetscErrorCode DLMFieldFileBeginStep(DLMFieldFile file, PetscInt step, PetscReal time);
/*
  DLMFieldFileWriteVec - writes a global vector of the DMDA da on the named mesh. Collective.

  sign: NULL, or, if da holds the half x2 >= 0 of the mesh, what each component is multiplied by in the mirror.

  dof 1: scalar; 3: vector; 6: symmetric tensor in VTK's order 11, 22, 33, 12, 23, 13, in which ParaView names the components.
*/
PETSC_EXTERN PetscErrorCode DLMFieldFileWriteVec(DLMFieldFile file, const char *mesh, const char *name, DM da, const PetscReal *sign, Vec v);
/* Values at points: reals [n][dof], dof 1 or 3, or (dof 0) ints [n]. */
typedef struct {
  const char *name;
  PetscInt    dof;
  const void *values;
} DLMPointArray;

/* Writes a set of n points with ids from 0; the first array is their positions. Nothing if n = 0. Rank 0's arguments count. */
PETSC_EXTERN PetscErrorCode DLMFieldFileWritePoints(DLMFieldFile file, const char *name, PetscInt n, PetscInt n_arrays, const DLMPointArray *arrays);
/*
  DLMFieldFileEndStep - brings the output and fields.xmf to the disk. Collective.

  *failed, on all ranks: 0, errno or DLM_FILE_CHANGED, and then path, of rank 0, names the file; fields.h5 is what it was, unless that is fields.xmf.
*/
PETSC_EXTERN PetscErrorCode DLMFieldFileEndStep(DLMFieldFile file, int *failed, char path[PETSC_MAX_PATH_LEN]);
PETSC_EXTERN PetscErrorCode DLMFieldFileDestroy(DLMFieldFile *file);

#define DLM_FIELD_NAME 64
enum { DLM_FIELD_MOST = 8 }; /* meshes, fields and sets of points of an output, arrays of a set */

typedef struct {
  char      name[DLM_FIELD_NAME];
  PetscInt  nodes[3];
  PetscInt  periodic[3]; /* 0 or 1; the file has nodes + periodic */
  PetscReal origin[3], spacing[3];
} DLMFieldMesh;

typedef struct {
  char     name[DLM_FIELD_NAME];
  PetscInt mesh; /* index into meshes */
  PetscInt dof;  /* 0: one int */
} DLMFieldEntry;

/* A set of points; only the names and dof of its arrays last. */
typedef struct {
  char          name[DLM_FIELD_NAME];
  PetscInt      n, n_arrays;
  DLMFieldEntry array[DLM_FIELD_MOST]; /* mesh: -1 */
} DLMFieldPoints;

/* An output on the disk, as rank 0 knows it. */
typedef struct {
  PetscInt step;
  char    *xdmf; /* its part of fields.xmf, malloc'ed */
} DLMFieldStep;

struct _p_DLMFieldFile {
  MPI_Comm      comm;
  PetscMPIInt   rank;
  char          dir[PETSC_MAX_PATH_LEN];
  PetscInt      n_meshes;
  DLMFieldMesh  meshes[DLM_FIELD_MOST];
  PetscInt      n_steps; /* rank 0, ascending, like the next */
  DLMFieldStep *steps;
  DLMAppendFile append;  /* rank 0 */
  /* the output that is open */
  hid_t         h5, group; /* rank 0, like the next */
  int           failed;    /* why it is not: then nothing is written */
  PetscInt      step;
  PetscReal     time;
  PetscInt       n_fields, n_sets; /* sets: of rank 0 */
  DLMFieldEntry  fields[DLM_FIELD_MOST];
  DLMFieldPoints sets[DLM_FIELD_MOST];
};

#define DLM_STEP_NAME "step_%07" PetscInt_FMT
#define DLM_XDMF_NAME "xdmf"

#define H5_REAL (sizeof(PetscReal) == 8 ? H5T_NATIVE_DOUBLE : H5T_NATIVE_FLOAT)
#define H5_INT (sizeof(PetscInt) == 8 ? H5T_NATIVE_INT64 : H5T_NATIVE_INT32)

/* hdf5_catalog.c; all of rank 0. Finds what fields.h5, which is open, holds already and removes the steps after keep_through. *whole: all could be read. */
PETSC_INTERN PetscErrorCode DLMFieldFileReadCatalog(DLMFieldFile file, PetscInt keep_through, PetscBool *whole);
/* Adds a step to the table, or replaces it and those after it; takes xdmf. */
PETSC_INTERN PetscErrorCode DLMFieldFileAddStep(DLMFieldFile file, PetscInt step, char *xdmf);
/* Writes fields.xmf from the table of steps. *failed and path as in DLMFieldFileEndStep. */
PETSC_INTERN PetscErrorCode DLMFieldFileWriteIndex(DLMFieldFile file, int *failed, char path[PETSC_MAX_PATH_LEN]);
/* xdmf.c: the part of the open output, malloc'ed, NULL if there is no memory; the whole of fields.xmf to out */
PETSC_INTERN char *DLMFieldFileXdmfOfStep(DLMFieldFile file);
PETSC_INTERN void  DLMFieldFileWriteXdmf(DLMFieldFile file, FILE *out);
#endif
