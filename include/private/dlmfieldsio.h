/*
  Field output: one HDF5 file and one XDMF 3 file per run, for ParaView, VisIt and h5py.

    dir/fields.h5    /meshes/NAME              attributes nodes, periodic, origin, spacing
                     /step_0000010             attributes step, time
                     /step_0000010/FIELD       float64 [n3][n2][n1] or [n3][n2][n1][dof], attribute mesh
                     /step_0000010/spheres     center, velocity, omega [n][3], radius [n], id [n]
    dir/fields.xmf   rewritten after each step under a temporary name, then renamed: always whole

  A periodic axis has as many nodes as cells. The file repeats its first plane at the end, n = nodes + 1, so
  that the picture is closed; readers that want each node once drop the last plane of the axes marked periodic.

  The HDF5 file is open only between BeginStep and EndStep: it can be read while the run goes on.
*/
#ifndef DLMFIELDSIO_H
#define DLMFIELDSIO_H

#include <petscdmda.h>
#include <hdf5.h>

typedef struct _p_DLMFieldFile *DLMFieldFile;

/*
  DLMFieldFileCreate - starts the field output of a run in the existing folder dir. Collective.

  keep_through < 0: a new file; a file of an earlier run is replaced.
  keep_through >= 0 (restart): an existing file is continued; its steps up to and including keep_through stay,
  later ones are dropped. Without an existing file, a new one is made.
*/
PETSC_EXTERN PetscErrorCode DLMFieldFileCreate(MPI_Comm comm, const char *dir, PetscInt keep_through,
                                               DLMFieldFile *file);
/*
  DLMFieldFileAddMesh - names a uniform mesh. Collective.

  nodes[a] - nodes of the DMDA along axis a (2 or more, so at least one cell); origin - position of its first
  node; spacing - mesh width per axis. The name (letters, digits, underscores) becomes that of the grid in
  ParaView. After a restart the mesh must equal the one in the file.
*/
PETSC_EXTERN PetscErrorCode DLMFieldFileAddMesh(DLMFieldFile file, const char *name, const PetscInt nodes[3],
                                                const PetscReal origin[3], const PetscReal spacing[3],
                                                const PetscBool periodic[3]);
/* Opens a step. Steps ascend; one that is there already (the restart's own) is written anew. Collective. */
PETSC_EXTERN PetscErrorCode DLMFieldFileBeginStep(DLMFieldFile file, PetscInt step, PetscReal time);
/*
  DLMFieldFileWriteVec - writes a global vector of the DMDA da on the named mesh. Collective.

  dof 1: scalar; 3: vector; 6: symmetric tensor, components in the order xx, xy, xz, yy, yz, zz.
*/
PETSC_EXTERN PetscErrorCode DLMFieldFileWriteVec(DLMFieldFile file, const char *mesh, const char *name, DM da,
                                                 Vec v);
/* Writes n spheres: x, V, omega [3n], radius [n]; none if n = 0. Collective; rank 0's arguments count. */
PETSC_EXTERN PetscErrorCode DLMFieldFileWriteSpheres(DLMFieldFile file, PetscInt n, const PetscReal *x,
                                                     const PetscReal *radius, const PetscReal *V,
                                                     const PetscReal *omega);
/* Closes the step and brings fields.xmf up to date. Collective. */
PETSC_EXTERN PetscErrorCode DLMFieldFileEndStep(DLMFieldFile file);
PETSC_EXTERN PetscErrorCode DLMFieldFileDestroy(DLMFieldFile *file);

#define DLM_FIELD_NAME 64

typedef struct {
  char      name[DLM_FIELD_NAME];
  PetscInt  nodes[3];    /* of the DMDA */
  PetscInt  periodic[3]; /* 0 or 1; the file has nodes + periodic */
  PetscReal origin[3], spacing[3];
} DLMFieldMesh;

typedef struct {
  char     name[DLM_FIELD_NAME];
  PetscInt mesh; /* index into meshes */
  PetscInt dof;
} DLMFieldEntry;

typedef struct {
  PetscInt       step;
  PetscReal      time;
  PetscInt       n_fields;
  DLMFieldEntry *fields;
  PetscInt       n_spheres; /* 0: none written */
} DLMFieldStep;

struct _p_DLMFieldFile {
  MPI_Comm      comm;
  char          h5_path[PETSC_MAX_PATH_LEN], xmf_path[PETSC_MAX_PATH_LEN];
  hid_t         h5, group; /* the file and the step's group while a step is open, else -1 */
  PetscInt      n_meshes, n_steps;
  DLMFieldMesh *meshes;
  DLMFieldStep *steps; /* what the HDF5 file holds, ascending; the same on every rank */
};

#define DLM_STEP_NAME "step_%07" PetscInt_FMT

#define H5_REAL (sizeof(PetscReal) == 8 ? H5T_NATIVE_DOUBLE : H5T_NATIVE_FLOAT)
#define H5_INT (sizeof(PetscInt) == 8 ? H5T_NATIVE_INT64 : H5T_NATIVE_INT32)

/* result = func args; a negative result becomes a PETSc error that names the file. */
#define H5CallGet(file, result, func, args)                                                                    \
  do {                                                                                                         \
    (result) = func args;                                                                                      \
    PetscCheck((result) >= 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "%s failed on %s", #func, (file)->h5_path);      \
  } while (0)
#define H5Call(file, func, args)                                                                               \
  do {                                                                                                         \
    long long h5_status_;                                                                                      \
    H5CallGet(file, h5_status_, func, args);                                                                   \
  } while (0)

/* Opens the file on all ranks, or creates it. Collective. */
PETSC_INTERN PetscErrorCode DLMFieldFileOpenH5(DLMFieldFile file, PetscBool create);
PETSC_INTERN PetscErrorCode DLMFieldFileCloseH5(DLMFieldFile file);
/* Creates a group that remembers the order of its members. Collective. */
PETSC_INTERN PetscErrorCode DLMFieldFileNewGroup(DLMFieldFile file, hid_t parent, const char *name,
                                                 hid_t *group);
/* Attaches n numbers to an object. Collective. */
PETSC_INTERN PetscErrorCode DLMFieldFilePutAttribute(DLMFieldFile file, hid_t object, const char *name,
                                                     hid_t type, hsize_t n, const void *data);
/* Fixed-length string of DLM_FIELD_NAME bytes; close with H5Tclose. */
PETSC_INTERN PetscErrorCode DLMFieldFileNameType(DLMFieldFile file, hid_t *type);
/* Appends to the tables in memory. */
PETSC_INTERN PetscErrorCode DLMFieldFileNewStep(DLMFieldFile file, PetscInt step, PetscReal time);
PETSC_INTERN PetscErrorCode DLMFieldFileNewField(DLMFieldStep *step, const char *name, PetscInt mesh,
                                                 PetscInt dof);
/* Index of the named mesh, -1 if there is none. */
PETSC_INTERN PetscInt DLMFieldFileFindMesh(DLMFieldFile file, const char *name);
/* Fills the tables of meshes and steps from the open file. Collective. */
PETSC_INTERN PetscErrorCode DLMFieldFileReadCatalog(DLMFieldFile file);
/* Removes the steps from first on, from the file and the table. The file is open. Collective. */
PETSC_INTERN PetscErrorCode DLMFieldFileDropSteps(DLMFieldFile file, PetscInt first);

/* Writes fields.xmf from the tables of meshes and steps. Rank 0 only. */
PETSC_INTERN PetscErrorCode DLMFieldFileWriteXdmf(DLMFieldFile file);
#endif
