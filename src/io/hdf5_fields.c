/*
  Field output to fields.h5: create the file, write the steps. See dlmfieldsio.h for the layout.

  HDF5's own C interface is used, not PETSc's viewer, because the file's shape is its interface: natural
  ordering, closed periodic axes, one group per step.
*/
#include "private/dlmfieldsio.h"
#include <stdio.h>
#include <unistd.h>

PetscErrorCode DLMFieldFileCreate(MPI_Comm comm, const char *dir, PetscInt keep_through, DLMFieldFile *new_file)
{
  DLMFieldFile file;
  PetscMPIInt  rank;
  int          present = 0;
  hid_t        group;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&file));
  file->comm = comm;
  file->h5 = file->group = -1;
  PetscCall(PetscSNPrintf(file->h5_path, sizeof(file->h5_path), "%s/fields.h5", dir));
  PetscCall(PetscSNPrintf(file->xmf_path, sizeof(file->xmf_path), "%s/fields.xmf", dir));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) present = keep_through >= 0 && access(file->h5_path, F_OK) == 0;
  PetscCallMPI(MPI_Bcast(&present, 1, MPI_INT, 0, comm));
  PetscCall(DLMFieldFileOpenH5(file, present ? PETSC_FALSE : PETSC_TRUE));
  if (present) {
    PetscCall(DLMFieldFileReadCatalog(file));
    PetscCall(DLMFieldFileDropSteps(file, keep_through + 1));
  } else {
    PetscCall(DLMFieldFileNewGroup(file, file->h5, "meshes", &group));
    H5Call(file, H5Gclose, (group));
  }
  PetscCall(DLMFieldFileCloseH5(file));
  if (rank == 0) PetscCall(DLMFieldFileWriteXdmf(file));
  *new_file = file;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileDestroy(DLMFieldFile *file)
{
  PetscFunctionBeginUser;
  if (!*file) PetscFunctionReturn(0);
  for (PetscInt s = 0; s < (*file)->n_steps; s++) PetscCall(PetscFree((*file)->steps[s].fields));
  PetscCall(PetscFree((*file)->steps));
  PetscCall(PetscFree((*file)->meshes));
  PetscCall(PetscFree(*file));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileBeginStep(DLMFieldFile file, PetscInt step, PetscReal time)
{
  char name[DLM_FIELD_NAME];

  PetscFunctionBeginUser;
  PetscCall(DLMFieldFileOpenH5(file, PETSC_FALSE));
  PetscCall(DLMFieldFileDropSteps(file, step));
  PetscCall(PetscSNPrintf(name, sizeof(name), DLM_STEP_NAME, step));
  PetscCall(DLMFieldFileNewGroup(file, file->h5, name, &file->group));
  PetscCall(DLMFieldFilePutAttribute(file, file->group, "step", H5_INT, 1, &step));
  PetscCall(DLMFieldFilePutAttribute(file, file->group, "time", H5_REAL, 1, &time));
  PetscCall(DLMFieldFileNewStep(file, step, time));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileEndStep(DLMFieldFile file)
{
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  H5Call(file, H5Gclose, (file->group));
  file->group = -1;
  PetscCall(DLMFieldFileCloseH5(file));
  PetscCallMPI(MPI_Comm_rank(file->comm, &rank));
  if (rank == 0) PetscCall(DLMFieldFileWriteXdmf(file));
  PetscFunctionReturn(0);
}

/* The nodes a rank writes: its own and, if it has the first plane of a periodic axis, that plane again. */
typedef struct {
  PetscInt start[3], width[3], dof;
  PetscInt repeat[3]; /* 1: plane 0 is written at index nodes too */
  PetscInt nodes[3];
} OwnedBox;

/* Copies the owned nodes, repeated planes included, in the order in which HDF5 walks the selection below. */
static void PackBox(const OwnedBox *box, const PetscScalar *array, PetscReal *packed)
{
  const PetscInt *w = box->width;

  for (PetscInt k = 0; k < w[2] + box->repeat[2]; k++) {
    for (PetscInt j = 0; j < w[1] + box->repeat[1]; j++) {
      for (PetscInt i = 0; i < w[0] + box->repeat[0]; i++) {
        const PetscScalar *node = array + (((k % w[2]) * w[1] + j % w[1]) * w[0] + i % w[0]) * box->dof;
        for (PetscInt c = 0; c < box->dof; c++) *packed++ = PetscRealPart(node[c]);
      }
    }
  }
}

/* Selects in the file up to 2 x 2 x 2 boxes: along each axis the owned range and perhaps the repeated plane. */
static PetscErrorCode SelectBox(DLMFieldFile file, const OwnedBox *box, hid_t space)
{
  PetscFunctionBeginUser;
  H5Call(file, H5Sselect_none, (space));
  for (int corner = 0; corner < 8; corner++) {
    hsize_t   start[4] = {0, 0, 0, 0}, count[4] = {0, 0, 0, (hsize_t)box->dof};
    PetscBool present = PETSC_TRUE;
    for (int axis = 0; axis < 3; axis++) {
      PetscBool again = (corner >> axis) & 1 ? PETSC_TRUE : PETSC_FALSE;
      if (again && !box->repeat[axis]) present = PETSC_FALSE;
      start[2 - axis] = (hsize_t)(again ? box->nodes[axis] : box->start[axis]);
      count[2 - axis] = (hsize_t)(again ? 1 : box->width[axis]);
    }
    if (present) H5Call(file, H5Sselect_hyperslab, (space, H5S_SELECT_OR, start, NULL, count, NULL));
  }
  PetscFunctionReturn(0);
}

/* Writes each rank's share, packed, at the current selection of the file's space. Collective. */
static PetscErrorCode WriteData(DLMFieldFile file, hid_t data, hid_t type, hid_t space, const void *values)
{
  hid_t   transfer, memory;
  hsize_t n = (hsize_t)H5Sget_select_npoints(space);

  PetscFunctionBeginUser;
  H5CallGet(file, transfer, H5Pcreate, (H5P_DATASET_XFER));
  H5Call(file, H5Pset_dxpl_mpio, (transfer, H5FD_MPIO_COLLECTIVE));
  H5CallGet(file, memory, H5Screate_simple, (1, &n, NULL));
  H5Call(file, H5Dwrite, (data, type, memory, space, transfer, values));
  H5Call(file, H5Sclose, (memory));
  H5Call(file, H5Pclose, (transfer));
  PetscFunctionReturn(0);
}

/* The box of a DMDA on a mesh, checked. */
static PetscErrorCode GetBox(DLMFieldFile file, const DLMFieldMesh *mesh, const char *name, DM da,
                             OwnedBox *box)
{
  PetscInt *start = box->start, *width = box->width, *nodes = box->nodes;

  PetscFunctionBeginUser;
  PetscCall(DMDAGetInfo(da, NULL, &nodes[0], &nodes[1], &nodes[2], NULL, NULL, NULL, &box->dof, NULL, NULL,
                        NULL, NULL, NULL));
  PetscCall(DMDAGetCorners(da, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  PetscCheck(box->dof == 1 || box->dof == 3 || box->dof == 6, file->comm, PETSC_ERR_ARG_WRONG,
             "Field %s has %" PetscInt_FMT " components; allowed: 1, 3, 6", name, box->dof);
  for (int i = 0; i < 3; i++) {
    PetscCheck(nodes[i] == mesh->nodes[i], file->comm, PETSC_ERR_ARG_SIZ,
               "Field %s has %" PetscInt_FMT " nodes along x%d, mesh %s has %" PetscInt_FMT, name, nodes[i],
               i + 1, mesh->name, mesh->nodes[i]);
    box->repeat[i] = mesh->periodic[i] && start[i] == 0;
  }
  PetscFunctionReturn(0);
}

/* Creates the empty dataset of a field and marks its mesh. Collective. */
static PetscErrorCode CreateField(DLMFieldFile file, const DLMFieldMesh *mesh, const char *name, PetscInt dof,
                                  hid_t *data, hid_t *space)
{
  hid_t   type;
  hsize_t dims[4] = {0, 0, 0, (hsize_t)dof};

  PetscFunctionBeginUser;
  for (int i = 0; i < 3; i++) dims[2 - i] = (hsize_t)(mesh->nodes[i] + mesh->periodic[i]);
  H5CallGet(file, *space, H5Screate_simple, (dof == 1 ? 3 : 4, dims, NULL));
  H5CallGet(file, *data, H5Dcreate2,
            (file->group, name, H5_REAL, *space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  PetscCall(DLMFieldFileNameType(file, &type));
  PetscCall(DLMFieldFilePutAttribute(file, *data, "mesh", type, 1, mesh->name));
  H5Call(file, H5Tclose, (type));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileWriteVec(DLMFieldFile file, const char *mesh_name, const char *name, DM da, Vec v)
{
  const PetscInt     mesh = DLMFieldFileFindMesh(file, mesh_name);
  const PetscScalar *array;
  PetscReal         *packed;
  OwnedBox           box;
  hid_t              space, data;

  PetscFunctionBeginUser;
  PetscCheck(mesh >= 0, file->comm, PETSC_ERR_ARG_WRONG, "Field %s: no mesh named %s", name, mesh_name);
  PetscCall(GetBox(file, &file->meshes[mesh], name, da, &box));
  PetscCall(CreateField(file, &file->meshes[mesh], name, box.dof, &data, &space));
  PetscCall(SelectBox(file, &box, space));
  PetscCall(PetscMalloc1(H5Sget_select_npoints(space), &packed));
  PetscCall(VecGetArrayRead(v, &array));
  PackBox(&box, array, packed);
  PetscCall(VecRestoreArrayRead(v, &array));
  PetscCall(WriteData(file, data, H5_REAL, space, packed));
  PetscCall(PetscFree(packed));
  H5Call(file, H5Dclose, (data));
  H5Call(file, H5Sclose, (space));
  PetscCall(DLMFieldFileNewField(&file->steps[file->n_steps - 1], name, mesh, box.dof));
  PetscFunctionReturn(0);
}

/* Writes [n] or [n][3] values of rank 0. */
static PetscErrorCode WriteFromFirst(DLMFieldFile file, hid_t group, const char *name, hid_t type, PetscInt n,
                                     int dof, const void *values)
{
  hsize_t     dims[2] = {(hsize_t)n, (hsize_t)dof};
  hid_t       space, data;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(file->comm, &rank));
  H5CallGet(file, space, H5Screate_simple, (dof == 1 ? 1 : 2, dims, NULL));
  H5CallGet(file, data, H5Dcreate2, (group, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  if (rank) H5Call(file, H5Sselect_none, (space));
  PetscCall(WriteData(file, data, type, space, values));
  H5Call(file, H5Dclose, (data));
  H5Call(file, H5Sclose, (space));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileWriteSpheres(DLMFieldFile file, PetscInt n, const PetscReal *x,
                                        const PetscReal *radius, const PetscReal *V, const PetscReal *omega)
{
  hid_t group;
  int  *id;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Bcast(&n, 1, MPIU_INT, 0, file->comm));
  if (n == 0) PetscFunctionReturn(0);
  PetscCall(PetscMalloc1(n, &id));
  for (PetscInt i = 0; i < n; i++) id[i] = (int)i;
  PetscCall(DLMFieldFileNewGroup(file, file->group, "spheres", &group));
  PetscCall(WriteFromFirst(file, group, "id", H5T_NATIVE_INT, n, 1, id));
  PetscCall(WriteFromFirst(file, group, "center", H5_REAL, n, 3, x));
  PetscCall(WriteFromFirst(file, group, "radius", H5_REAL, n, 1, radius));
  PetscCall(WriteFromFirst(file, group, "velocity", H5_REAL, n, 3, V));
  PetscCall(WriteFromFirst(file, group, "omega", H5_REAL, n, 3, omega));
  H5Call(file, H5Gclose, (group));
  PetscCall(PetscFree(id));
  file->steps[file->n_steps - 1].n_spheres = n;
  PetscFunctionReturn(0);
}
