/*
  What fields.h5 holds: the tables of meshes and steps, kept in memory, read back from it after a restart.
*/
#include "private/dlmfieldsio.h"
#include "dlmscene.h"
#include <stdio.h>

PetscErrorCode DLMFieldFilePutAttribute(DLMFieldFile file, hid_t object, const char *name, hid_t type,
                                        hsize_t n, const void *data)
{
  hid_t space, attribute;

  PetscFunctionBeginUser;
  H5CallGet(file, space, H5Screate_simple, (1, &n, NULL));
  H5CallGet(file, attribute, H5Acreate2, (object, name, type, space, H5P_DEFAULT, H5P_DEFAULT));
  H5Call(file, H5Awrite, (attribute, type, data));
  H5Call(file, H5Aclose, (attribute));
  H5Call(file, H5Sclose, (space));
  PetscFunctionReturn(0);
}

static PetscErrorCode GetAttribute(DLMFieldFile file, hid_t object, const char *name, hid_t type, void *data)
{
  hid_t attribute;

  PetscFunctionBeginUser;
  H5CallGet(file, attribute, H5Aopen, (object, name, H5P_DEFAULT));
  H5Call(file, H5Aread, (attribute, type, data));
  H5Call(file, H5Aclose, (attribute));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileNameType(DLMFieldFile file, hid_t *type)
{
  PetscFunctionBeginUser;
  H5CallGet(file, *type, H5Tcopy, (H5T_C_S1));
  H5Call(file, H5Tset_size, (*type, DLM_FIELD_NAME));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileOpenH5(DLMFieldFile file, PetscBool create)
{
  hid_t access, creation;

  PetscFunctionBeginUser;
  H5CallGet(file, creation, H5Pcreate, (H5P_FILE_CREATE));
  H5Call(file, H5Pset_link_creation_order, (creation, H5P_CRT_ORDER_TRACKED));
  H5CallGet(file, access, H5Pcreate, (H5P_FILE_ACCESS));
  H5Call(file, H5Pset_fapl_mpio, (access, file->comm, MPI_INFO_NULL));
  H5Call(file, H5Pset_all_coll_metadata_ops, (access, 1));
  H5Call(file, H5Pset_coll_metadata_write, (access, 1));
  H5E_BEGIN_TRY
  {
    if (create) file->h5 = H5Fcreate(file->h5_path, H5F_ACC_TRUNC, creation, access);
    else file->h5 = H5Fopen(file->h5_path, H5F_ACC_RDWR, access);
  }
  H5E_END_TRY
  DLMUserCheck(
      file->h5 >= 0, file->comm,
      create ? "cannot create %s: does its folder exist, may it be written?"
             : "cannot open %s (a run killed while it wrote may leave it broken: move it away to continue)",
      file->h5_path);
  H5Call(file, H5Pclose, (access));
  H5Call(file, H5Pclose, (creation));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileCloseH5(DLMFieldFile file)
{
  PetscFunctionBeginUser;
  H5Call(file, H5Fclose, (file->h5));
  file->h5 = -1;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileNewGroup(DLMFieldFile file, hid_t parent, const char *name, hid_t *group)
{
  hid_t creation;

  PetscFunctionBeginUser;
  H5CallGet(file, creation, H5Pcreate, (H5P_GROUP_CREATE));
  H5Call(file, H5Pset_link_creation_order, (creation, H5P_CRT_ORDER_TRACKED));
  H5CallGet(file, *group, H5Gcreate2, (parent, name, H5P_DEFAULT, creation, H5P_DEFAULT));
  H5Call(file, H5Pclose, (creation));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileNewStep(DLMFieldFile file, PetscInt step, PetscReal time)
{
  PetscFunctionBeginUser;
  PetscCall(PetscRealloc((file->n_steps + 1) * sizeof(*file->steps), &file->steps));
  file->steps[file->n_steps++] = (DLMFieldStep){.step = step, .time = time};
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileNewField(DLMFieldStep *step, const char *name, PetscInt mesh, PetscInt dof)
{
  DLMFieldEntry *field;

  PetscFunctionBeginUser;
  PetscCall(PetscRealloc((step->n_fields + 1) * sizeof(*step->fields), &step->fields));
  field = &step->fields[step->n_fields++];
  PetscCall(PetscStrncpy(field->name, name, DLM_FIELD_NAME));
  field->mesh = mesh;
  field->dof = dof;
  PetscFunctionReturn(0);
}

PetscInt DLMFieldFileFindMesh(DLMFieldFile file, const char *name)
{
  for (PetscInt m = 0; m < file->n_meshes; m++)
    if (!strcmp(file->meshes[m].name, name)) return m;
  return -1;
}

PetscErrorCode DLMFieldFileDropSteps(DLMFieldFile file, PetscInt first)
{
  PetscFunctionBeginUser;
  while (file->n_steps && file->steps[file->n_steps - 1].step >= first) {
    DLMFieldStep *last = &file->steps[file->n_steps - 1];
    char          name[DLM_FIELD_NAME];
    PetscCall(PetscSNPrintf(name, sizeof(name), DLM_STEP_NAME, last->step));
    H5Call(file, H5Ldelete, (file->h5, name, H5P_DEFAULT));
    PetscCall(PetscFree(last->fields));
    file->n_steps--;
  }
  PetscFunctionReturn(0);
}

static PetscBool SameMesh(const DLMFieldMesh *a, const DLMFieldMesh *b)
{
  for (int i = 0; i < 3; i++) {
    PetscReal slack = 1e-9 * a->spacing[i];
    if (a->nodes[i] != b->nodes[i] || a->periodic[i] != b->periodic[i]) return PETSC_FALSE;
    if (PetscAbsReal(a->spacing[i] - b->spacing[i]) > slack) return PETSC_FALSE;
    if (PetscAbsReal(a->origin[i] - b->origin[i]) > slack) return PETSC_FALSE;
  }
  return PETSC_TRUE;
}

static PetscErrorCode PutMesh(DLMFieldFile file, const DLMFieldMesh *mesh)
{
  hid_t group, object;

  PetscFunctionBeginUser;
  PetscCall(DLMFieldFileOpenH5(file, PETSC_FALSE));
  H5CallGet(file, group, H5Gopen2, (file->h5, "meshes", H5P_DEFAULT));
  PetscCall(DLMFieldFileNewGroup(file, group, mesh->name, &object));
  PetscCall(DLMFieldFilePutAttribute(file, object, "nodes", H5_INT, 3, mesh->nodes));
  PetscCall(DLMFieldFilePutAttribute(file, object, "periodic", H5_INT, 3, mesh->periodic));
  PetscCall(DLMFieldFilePutAttribute(file, object, "origin", H5_REAL, 3, mesh->origin));
  PetscCall(DLMFieldFilePutAttribute(file, object, "spacing", H5_REAL, 3, mesh->spacing));
  H5Call(file, H5Gclose, (object));
  H5Call(file, H5Gclose, (group));
  PetscCall(DLMFieldFileCloseH5(file));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileAddMesh(DLMFieldFile file, const char *name, const PetscInt nodes[3],
                                   const PetscReal origin[3], const PetscReal spacing[3],
                                   const PetscBool periodic[3])
{
  DLMFieldMesh mesh = {.name = ""};
  PetscInt     known;

  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(mesh.name, name, DLM_FIELD_NAME));
  for (int i = 0; i < 3; i++) {
    mesh.nodes[i] = nodes[i];
    mesh.periodic[i] = periodic[i] ? 1 : 0;
    mesh.origin[i] = origin[i];
    mesh.spacing[i] = spacing[i];
  }
  known = DLMFieldFileFindMesh(file, name);
  if (known >= 0) {
    DLMUserCheck(
        SameMesh(&mesh, &file->meshes[known]), file->comm,
        "mesh %s differs from the one in %s: continue with the same box and resolution, or in another folder",
        name, file->h5_path);
    PetscFunctionReturn(0);
  }
  PetscCall(PutMesh(file, &mesh));
  PetscCall(PetscRealloc((file->n_meshes + 1) * sizeof(mesh), &file->meshes));
  file->meshes[file->n_meshes++] = mesh;
  PetscFunctionReturn(0);
}

/* Name of the i-th link of a group, in the order of creation. */
static PetscErrorCode LinkName(DLMFieldFile file, hid_t group, hsize_t i, char name[DLM_FIELD_NAME])
{
  PetscFunctionBeginUser;
  H5Call(file, H5Lget_name_by_idx,
         (group, ".", H5_INDEX_CRT_ORDER, H5_ITER_INC, i, name, DLM_FIELD_NAME, H5P_DEFAULT));
  PetscFunctionReturn(0);
}

static PetscErrorCode ReadMesh(DLMFieldFile file, hid_t group, const char *name)
{
  DLMFieldMesh mesh = {.name = ""};
  hid_t        object;

  PetscFunctionBeginUser;
  PetscCall(PetscStrncpy(mesh.name, name, DLM_FIELD_NAME));
  H5CallGet(file, object, H5Gopen2, (group, name, H5P_DEFAULT));
  PetscCall(GetAttribute(file, object, "nodes", H5_INT, mesh.nodes));
  PetscCall(GetAttribute(file, object, "periodic", H5_INT, mesh.periodic));
  PetscCall(GetAttribute(file, object, "origin", H5_REAL, mesh.origin));
  PetscCall(GetAttribute(file, object, "spacing", H5_REAL, mesh.spacing));
  H5Call(file, H5Gclose, (object));
  PetscCall(PetscRealloc((file->n_meshes + 1) * sizeof(mesh), &file->meshes));
  file->meshes[file->n_meshes++] = mesh;
  PetscFunctionReturn(0);
}

/* Adds the dataset name of a step's group to the step's fields, or notes the number of spheres. */
static PetscErrorCode ReadField(DLMFieldFile file, hid_t group, const char *name, DLMFieldStep *step)
{
  PetscBool spheres;
  hid_t     data, space, type;
  hsize_t   dims[4];
  int       rank;
  char      mesh[DLM_FIELD_NAME];

  PetscFunctionBeginUser;
  PetscCall(PetscStrcmp(name, "spheres", &spheres));
  H5CallGet(file, data, H5Dopen2, (group, spheres ? "spheres/id" : name, H5P_DEFAULT));
  H5CallGet(file, space, H5Dget_space, (data));
  H5CallGet(file, rank, H5Sget_simple_extent_dims, (space, dims, NULL));
  if (spheres) {
    step->n_spheres = (PetscInt)dims[0];
  } else {
    PetscCall(DLMFieldFileNameType(file, &type));
    PetscCall(GetAttribute(file, data, "mesh", type, mesh));
    PetscCall(
        DLMFieldFileNewField(step, name, DLMFieldFileFindMesh(file, mesh), rank == 4 ? (PetscInt)dims[3] : 1));
    H5Call(file, H5Tclose, (type));
  }
  H5Call(file, H5Sclose, (space));
  H5Call(file, H5Dclose, (data));
  PetscFunctionReturn(0);
}

static PetscErrorCode ReadStep(DLMFieldFile file, hid_t group)
{
  PetscInt   step;
  PetscReal  time;
  H5G_info_t info;
  char       name[DLM_FIELD_NAME];

  PetscFunctionBeginUser;
  PetscCall(GetAttribute(file, group, "step", H5_INT, &step));
  PetscCall(GetAttribute(file, group, "time", H5_REAL, &time));
  PetscCall(DLMFieldFileNewStep(file, step, time));
  H5Call(file, H5Gget_info, (group, &info));
  for (hsize_t i = 0; i < info.nlinks; i++) {
    PetscCall(LinkName(file, group, i, name));
    PetscCall(ReadField(file, group, name, &file->steps[file->n_steps - 1]));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileReadCatalog(DLMFieldFile file)
{
  hid_t      group;
  H5G_info_t info;
  char       name[DLM_FIELD_NAME];

  PetscFunctionBeginUser;
  H5CallGet(file, group, H5Gopen2, (file->h5, "meshes", H5P_DEFAULT));
  H5Call(file, H5Gget_info, (group, &info));
  for (hsize_t i = 0; i < info.nlinks; i++) {
    PetscCall(LinkName(file, group, i, name));
    PetscCall(ReadMesh(file, group, name));
  }
  H5Call(file, H5Gclose, (group));
  H5Call(file, H5Gget_info, (file->h5, &info));
  for (hsize_t i = 0; i < info.nlinks; i++) {
    PetscCall(LinkName(file, file->h5, i, name));
    if (strncmp(name, "step_", 5)) continue;
    H5CallGet(file, group, H5Gopen2, (file->h5, name, H5P_DEFAULT));
    PetscCall(ReadStep(file, group));
    H5Call(file, H5Gclose, (group));
  }
  PetscFunctionReturn(0);
}
