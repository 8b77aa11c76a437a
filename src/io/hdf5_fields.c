/* Field output: rank 0 gathers field by field and adds them to fields.h5. See dlmfieldsio.h for the layout. */
#include <errno.h>
#include "../../include/dlmscene.h"
#include "../../include/private/dlmfieldsio.h"
#include "../../include/private/natural.h"

/* What is wrong, from rank 0 to all: nothing, or a user error. */
static PetscErrorCode Agree(DLMFieldFile file, char problem[2 * PETSC_MAX_PATH_LEN])
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(problem, 2 * PETSC_MAX_PATH_LEN, MPI_CHAR, 0, file->comm));
  DLMUserCheck(!problem[0], file->comm, "%s", problem);
  PetscFunctionReturn(0);
}

/* The folder as this run finds it; rank 0. fields.xmf loses what goes before fields.h5 does. */
static PetscErrorCode TakeOver(DLMFieldFile file, PetscInt keep_through, char problem[], size_t size)
{
  char      path[PETSC_MAX_PATH_LEN];
  PetscBool whole  = PETSC_TRUE;
  int       failed = ENOENT;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/fields.h5", file->dir));
  PetscCall(PetscStrncpy(file->append.path, path, sizeof(file->append.path)));
  if (keep_through >= 0) PetscCall(DLMAppendOpen(&file->append, &file->h5, &failed));
  if (file->h5 >= 0) PetscCall(DLMFieldFileReadCatalog(file, keep_through, &whole));
  if (!whole) failed = DLM_FILE_DAMAGED;
  if (!failed || failed == ENOENT) PetscCall(DLMFieldFileWriteIndex(file, &failed, path));
  if (!failed) PetscCall(PetscStrncpy(path, file->append.path, sizeof(path)));
  if (file->h5 >= 0) {
    file->append.failed = failed; /* then nothing is written */
    PetscCall(DLMAppendClose(&file->append, &file->h5, &failed));
  } else if (!failed) PetscCall(DLMAppendCreate(&file->append, &failed));
  if (failed == DLM_FILE_DAMAGED) PetscCall(PetscSNPrintf(problem, size, "%s is damaged, and -restart goes on in it; allowed: a whole file, or none: move this one away", path));
  else if (failed) PetscCall(PetscSNPrintf(problem, size, "-output_dir %s: cannot write %s (%s); allowed: a folder that can be written, with space", file->dir, path, strerror(failed)));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileCreate(MPI_Comm comm, const char *dir, PetscInt keep_through, DLMFieldFile *new_file)
{
  DLMFieldFile file;
  char         problem[2 * PETSC_MAX_PATH_LEN] = "";

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&file));
  file->comm = comm;
  file->h5   = -1;
  PetscCallMPI(MPI_Comm_rank(comm, &file->rank));
  PetscCall(PetscStrncpy(file->dir, dir, sizeof(file->dir)));
  if (file->rank == 0) PetscCall(TakeOver(file, keep_through, problem, sizeof(problem)));
  PetscCall(Agree(file, problem));
  *new_file = file;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileDestroy(DLMFieldFile *file)
{
  PetscFunctionBeginUser;
  if (!*file) PetscFunctionReturn(0);
  PetscCall(DLMAppendFinish(&(*file)->append));
  for (PetscInt s = 0; s < (*file)->n_steps; s++) free((*file)->steps[s].xdmf);
  free((*file)->steps);
  PetscCall(PetscFree(*file));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileAddMesh(DLMFieldFile file, const char *name, const PetscInt nodes[3], const PetscReal origin[3], const PetscReal spacing[3],
                                   const PetscBool periodic[3])
{
  DLMFieldMesh *mesh = &file->meshes[file->n_meshes];

  PetscFunctionBeginUser;
  PetscCheck(file->n_meshes < DLM_FIELD_MOST, file->comm, PETSC_ERR_ARG_OUTOFRANGE, "At most %d meshes", DLM_FIELD_MOST);
  PetscCall(PetscStrncpy(mesh->name, name, DLM_FIELD_NAME));
  for (int i = 0; i < 3; i++) {
    mesh->nodes[i]    = nodes[i];
    mesh->periodic[i] = periodic[i] ? 1 : 0;
    mesh->origin[i]   = origin[i];
    mesh->spacing[i]  = spacing[i];
  }
  file->n_meshes++;
  PetscFunctionReturn(0);
}

static PetscErrorCode PutAttribute(hid_t object, const char *name, hid_t type, hsize_t n, const void *data)
{
  hid_t space, attribute;

  PetscFunctionBegin;
  H5Get(space, H5Screate_simple(1, &n, NULL));
  H5Get(attribute, H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT));
  H5Do(H5Awrite(attribute, type, data));
  H5Do(H5Aclose(attribute));
  H5Do(H5Sclose(space));
  PetscFunctionReturn(0);
}

/* With the first output. */
static PetscErrorCode PutMeshes(DLMFieldFile file)
{
  htri_t there;
  hid_t  meshes, group;

  PetscFunctionBegin;
  H5Get(there, H5Lexists(file->h5, "meshes", H5P_DEFAULT));
  if (there) PetscFunctionReturn(0);
  PetscCall(DLMImageNewGroup(file->h5, "meshes", &meshes));
  for (const DLMFieldMesh *mesh = file->meshes; mesh < file->meshes + file->n_meshes; mesh++) {
    PetscCall(DLMImageNewGroup(meshes, mesh->name, &group));
    PetscCall(PutAttribute(group, "nodes", H5_INT, 3, mesh->nodes));
    PetscCall(PutAttribute(group, "periodic", H5_INT, 3, mesh->periodic));
    PetscCall(PutAttribute(group, "origin", H5_REAL, 3, mesh->origin));
    PetscCall(PutAttribute(group, "spacing", H5_REAL, 3, mesh->spacing));
    H5Do(H5Gclose(group));
  }
  H5Do(H5Gclose(meshes));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileBeginStep(DLMFieldFile file, PetscInt step, PetscReal time)
{
  char   name[64];
  htri_t there;

  PetscFunctionBeginUser;
  file->step     = step;
  file->time     = time;
  file->n_fields = file->n_sets = 0;
  if (file->rank) PetscFunctionReturn(0);
  PetscCall(DLMAppendOpen(&file->append, &file->h5, &file->failed));
  if (file->failed) PetscFunctionReturn(0);
  PetscCall(PutMeshes(file));
  PetscCall(PetscSNPrintf(name, sizeof(name), DLM_STEP_NAME, step));
  H5Get(there, H5Lexists(file->h5, name, H5P_DEFAULT));
  if (there) H5Do(H5Ldelete(file->h5, name, H5P_DEFAULT));
  PetscCall(DLMImageNewGroup(file->h5, name, &file->group));
  PetscCall(PutAttribute(file->group, "step", H5_INT, 1, &step));
  PetscCall(PutAttribute(file->group, "time", H5_REAL, 1, &time));
  PetscFunctionReturn(0);
}

/* Rank 0. */
static PetscErrorCode EndStep(DLMFieldFile file, int *failed, char path[PETSC_MAX_PATH_LEN])
{
  char *xdmf;
  hid_t type;

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(path, file->append.path, PETSC_MAX_PATH_LEN));
  *failed = file->failed;
  if (*failed) PetscFunctionReturn(0);
  xdmf = DLMFieldFileXdmfOfStep(file);
  PetscCheck(xdmf, PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory for the text of fields.xmf");
  H5Get(type, H5Tcopy(H5T_C_S1));
  H5Do(H5Tset_size(type, strlen(xdmf) + 1));
  PetscCall(PutAttribute(file->group, DLM_XDMF_NAME, type, 1, xdmf));
  H5Do(H5Tclose(type));
  H5Do(H5Gclose(file->group));
  PetscCall(DLMAppendClose(&file->append, &file->h5, failed));
  if (*failed) {
    free(xdmf);
    PetscFunctionReturn(0);
  }
  PetscCall(DLMFieldFileAddStep(file, file->step, xdmf));
  PetscCall(DLMFieldFileWriteIndex(file, failed, path));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileEndStep(DLMFieldFile file, int *failed, char path[PETSC_MAX_PATH_LEN])
{
  PetscFunctionBeginUser;
  *failed = 0;
  if (file->rank == 0) PetscCall(EndStep(file, failed, path));
  PetscCallMPI(MPI_Bcast(failed, 1, MPI_INT, 0, file->comm));
  PetscFunctionReturn(0);
}

/* The part of a dataset, or of the nodes in memory, at one corner of the box: along each axis all nodes, or the first plane, which the dataset has again. */
static PetscErrorCode SelectCorner(const PetscInt nodes[3], PetscInt dof, int corner, PetscBool in_file, hid_t space)
{
  hsize_t start[4] = { 0, 0, 0, 0 }, count[4] = { 1, 1, 1, (hsize_t)dof };

  PetscFunctionBegin;
  for (int axis = 0; axis < 3; axis++) {
    const PetscBool again = (PetscBool)((corner >> axis) & 1);
    if (again && in_file) start[2 - axis] = (hsize_t)nodes[axis];
    if (!again) count[2 - axis] = (hsize_t)nodes[axis];
  }
  H5Do(H5Sselect_hyperslab(space, H5S_SELECT_SET, start, NULL, count, NULL));
  PetscFunctionReturn(0);
}

/* x [n3][n2][n1][dof] as a dataset that repeats the first plane of periodic axes. */
static PetscErrorCode WriteClosed(DLMFieldFile file, const DLMFieldMesh *mesh, const char *name, PetscInt dof, const PetscScalar *x)
{
  const int n_dims   = dof == 1 ? 3 : 4;
  const int periodic = (int)(mesh->periodic[0] + 2 * mesh->periodic[1] + 4 * mesh->periodic[2]);
  hsize_t   open[4] = { 0, 0, 0, (hsize_t)dof }, closed[4] = { 0, 0, 0, (hsize_t)dof };
  hid_t     memory, space, data, type;

  PetscFunctionBegin;
  for (int axis = 0; axis < 3; axis++) {
    open[2 - axis]   = (hsize_t)mesh->nodes[axis];
    closed[2 - axis] = (hsize_t)(mesh->nodes[axis] + mesh->periodic[axis]);
  }
  H5Get(memory, H5Screate_simple(n_dims, open, NULL));
  H5Get(space, H5Screate_simple(n_dims, closed, NULL));
  H5Get(data, H5Dcreate2(file->group, name, H5_REAL, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Get(type, H5Tcopy(H5T_C_S1));
  H5Do(H5Tset_size(type, DLM_FIELD_NAME));
  PetscCall(PutAttribute(data, "mesh", type, 1, mesh->name));
  H5Do(H5Tclose(type));
  for (int corner = 0; corner < 8; corner++) {
    if (corner & ~periodic) continue;
    PetscCall(SelectCorner(mesh->nodes, dof, corner, PETSC_FALSE, memory));
    PetscCall(SelectCorner(mesh->nodes, dof, corner, PETSC_TRUE, space));
    H5Do(H5Dwrite(data, H5_REAL, memory, space, H5P_DEFAULT, x));
  }
  H5Do(H5Dclose(data));
  H5Do(H5Sclose(space));
  H5Do(H5Sclose(memory));
  PetscFunctionReturn(0);
}

/* Notes the field for fields.xmf after a look at what it is. */
static PetscErrorCode AddField(DLMFieldFile file, const char *mesh_name, const char *name, const DLMNatural *natural, DLMFieldEntry **new_field)
{
  DLMFieldEntry  *field = &file->fields[file->n_fields];
  const PetscInt *nodes = natural->nodes;

  PetscFunctionBegin;
  PetscCheck(file->n_fields < DLM_FIELD_MOST, file->comm, PETSC_ERR_ARG_OUTOFRANGE, "At most %d fields", DLM_FIELD_MOST);
  PetscCall(PetscStrncpy(field->name, name, DLM_FIELD_NAME));
  for (field->mesh = 0; field->mesh < file->n_meshes && strcmp(file->meshes[field->mesh].name, mesh_name); field->mesh++) { }
  PetscCheck(field->mesh < file->n_meshes, file->comm, PETSC_ERR_ARG_WRONG, "Field %s: no mesh named %s", name, mesh_name);
  field->dof = natural->dof;
  PetscCheck(field->dof == 1 || field->dof == 3 || field->dof == 6, file->comm, PETSC_ERR_ARG_WRONG,
             "Field %s has %" PetscInt_FMT " components; allowed: 1, 3, 6", name, field->dof);
  for (int i = 0; i < 3; i++)
    PetscCheck(nodes[i] == file->meshes[field->mesh].nodes[i], file->comm, PETSC_ERR_ARG_SIZ, "Field %s has %" PetscInt_FMT " nodes along x%d, mesh %s has %" PetscInt_FMT,
               name, nodes[i], i + 1, mesh_name, file->meshes[field->mesh].nodes[i]);
  file->n_fields++;
  *new_field = field;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileWriteVec(DLMFieldFile file, const char *mesh_name, const char *name, DM da, const PetscReal *sign, Vec v)
{
  DLMFieldEntry *field = NULL;
  DLMNatural     natural;
  PetscScalar   *x;

  PetscFunctionBeginUser;
  PetscCall(DLMNaturalCreate(da, sign, &natural));
  PetscCall(AddField(file, mesh_name, name, &natural, &field));
  PetscCall(DLMNaturalGather(&natural, v));
  PetscCall(DLMNaturalGetArray(&natural, &x));
  if (file->rank == 0 && !file->failed) PetscCall(WriteClosed(file, &file->meshes[field->mesh], name, field->dof, x));
  PetscCall(DLMNaturalRestoreArray(&natural, &x));
  PetscCall(DLMNaturalDestroy(&natural));
  PetscFunctionReturn(0);
}

static PetscErrorCode WriteArray(hid_t group, PetscInt n, const DLMPointArray *array)
{
  const hid_t type    = array->dof ? H5_REAL : H5T_NATIVE_INT;
  hsize_t     dims[2] = { (hsize_t)n, (hsize_t)array->dof };
  hid_t       space, data;

  PetscFunctionBegin;
  H5Get(space, H5Screate_simple(array->dof > 1 ? 2 : 1, dims, NULL));
  H5Get(data, H5Dcreate2(group, array->name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  H5Do(H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, array->values));
  H5Do(H5Dclose(data));
  H5Do(H5Sclose(space));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileWritePoints(DLMFieldFile file, const char *name, PetscInt n, PetscInt n_arrays, const DLMPointArray *arrays)
{
  DLMFieldPoints *set = &file->sets[file->n_sets];
  hid_t           group;
  int            *id;

  PetscFunctionBeginUser;
  if (file->rank || file->failed || !n) PetscFunctionReturn(0);
  PetscCheck(file->n_sets < DLM_FIELD_MOST && n_arrays <= DLM_FIELD_MOST, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "At most %d sets of points, and arrays of a set", DLM_FIELD_MOST);
  file->n_sets++;
  set->n        = n;
  set->n_arrays = n_arrays;
  PetscCall(PetscStrncpy(set->name, name, DLM_FIELD_NAME));
  PetscCall(PetscMalloc1(n, &id));
  for (PetscInt i = 0; i < n; i++) id[i] = (int)i;
  PetscCall(DLMImageNewGroup(file->group, name, &group));
  PetscCall(WriteArray(group, n, &(DLMPointArray){ "id", 0, id }));
  for (PetscInt k = 0; k < n_arrays; k++) {
    PetscCall(WriteArray(group, n, &arrays[k]));
    PetscCall(PetscStrncpy(set->array[k].name, arrays[k].name, DLM_FIELD_NAME));
    set->array[k].mesh = -1;
    set->array[k].dof  = arrays[k].dof;
  }
  H5Do(H5Gclose(group));
  PetscCall(PetscFree(id));
  PetscFunctionReturn(0);
}
