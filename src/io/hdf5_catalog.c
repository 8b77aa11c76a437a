/* The outputs that fields.h5 holds: found at a restart; fields.xmf. All of rank 0. */
#include "../../include/private/dlmfieldsio.h"

/* The step of a group of fields.h5, -1 if it is something else. */
static PetscInt StepOf(const char *name)
{
  char     again[64];
  PetscInt step = (PetscInt)(strncmp(name, "step_", 5) ? -1 : strtol(name + 5, NULL, 10));

  snprintf(again, sizeof(again), DLM_STEP_NAME, step);
  return strcmp(name, again) ? -1 : step;
}

static int Ascending(const void *a, const void *b)
{
  return *(const PetscInt *)a < *(const PetscInt *)b ? -1 : *(const PetscInt *)a > *(const PetscInt *)b;
}

typedef struct {
  PetscInt n, *steps;
} StepList;

static herr_t AddToList(hid_t h5, const char *name, const H5L_info_t *info, void *context)
{
  StepList *list = context;
  PetscInt *more;

  if (StepOf(name) < 0) return 0;
  more = realloc(list->steps, (size_t)(list->n + 1) * sizeof(*more));
  if (!more) return -1;
  list->steps            = more;
  list->steps[list->n++] = StepOf(name);
  return 0;
}

/* Reads what an object consists of: HDF5 holds it against its checksums then. */
static herr_t Inspect(hid_t object)
{
#if H5_VERSION_GE(1, 12, 0)
  H5O_native_info_t info;

  return H5Oget_native_info(object, &info, H5O_NATIVE_INFO_ALL);
#else
  H5O_info_t info;

  return H5Oget_info2(object, &info, H5O_INFO_ALL);
#endif
}

/* Inspects an object and, as deep as *context says, those below it. A file that others have added links to may be deeper, or go round. */
static herr_t LookAt(hid_t group, const char *name, const H5L_info_t *info, void *context)
{
  int    below = *(const int *)context - 1;
  hid_t  object;
  herr_t status;

  if (info->type != H5L_TYPE_HARD) return 0;
  object = H5Oopen(group, name, H5P_DEFAULT);
  if (object < 0) return -1;
  status = Inspect(object);
  if (status >= 0 && H5Iget_type(object) == H5I_GROUP && below > 0) status = H5Literate(object, H5_INDEX_NAME, H5_ITER_NATIVE, NULL, LookAt, &below);
  return H5Oclose(object) < 0 ? -1 : status;
}

/* A step's part of fields.xmf, malloc'ed; NULL if it cannot be read. */
static char *ReadXdmf(hid_t h5, const char *step)
{
  hid_t  attribute = H5Aopen_by_name(h5, step, DLM_XDMF_NAME, H5P_DEFAULT, H5P_DEFAULT), type = -1;
  size_t n         = 0;
  char  *text      = NULL;

  if (attribute < 0) return NULL;
  type = H5Aget_type(attribute);
  if (type >= 0 && H5Tget_class(type) == H5T_STRING && !H5Tis_variable_str(type)) n = H5Tget_size(type);
  if (n) text = calloc(n + 1, 1);
  if (text && H5Aread(attribute, type, text) < 0) {
    free(text);
    text = NULL;
  }
  if (type >= 0) H5Tclose(type);
  H5Aclose(attribute);
  return text;
}

/* Keeps the steps through keep_through and removes those after it. Returns whether all could be read. */
static PetscErrorCode Sort(DLMFieldFile file, const StepList *list, PetscInt keep_through, PetscBool *whole)
{
  char name[64];

  PetscFunctionBegin;
  for (PetscInt s = 0; s < list->n && *whole; s++) {
    snprintf(name, sizeof(name), DLM_STEP_NAME, list->steps[s]);
    if (list->steps[s] > keep_through) {
      *whole = (PetscBool)(H5Ldelete(file->h5, name, H5P_DEFAULT) >= 0);
    } else {
      char *xdmf = ReadXdmf(file->h5, name);
      *whole = (PetscBool)(xdmf != NULL);
      if (xdmf) PetscCall(DLMFieldFileAddStep(file, list->steps[s], xdmf));
    }
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileReadCatalog(DLMFieldFile file, PetscInt keep_through, PetscBool *whole)
{
  StepList list  = { 0, NULL };
  int      depth = 4; /* the file, output, set of points, array */

  PetscFunctionBegin;
  *whole = (PetscBool)(LookAt(file->h5, "/", &(H5L_info_t){ .type = H5L_TYPE_HARD }, &depth) >= 0);
  if (*whole) *whole = (PetscBool)(H5Literate(file->h5, H5_INDEX_NAME, H5_ITER_NATIVE, NULL, AddToList, &list) >= 0);
  if (list.n) qsort(list.steps, (size_t)list.n, sizeof(*list.steps), Ascending);
  PetscCall(Sort(file, &list, keep_through, whole));
  free(list.steps);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileAddStep(DLMFieldFile file, PetscInt step, char *xdmf)
{
  DLMFieldStep *steps;

  PetscFunctionBegin;
  while (file->n_steps && file->steps[file->n_steps - 1].step >= step) free(file->steps[--file->n_steps].xdmf);
  steps = realloc(file->steps, (size_t)(file->n_steps + 1) * sizeof(*steps));
  PetscCheck(steps, PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory for the table of outputs");
  file->steps = steps;
  file->steps[file->n_steps++] = (DLMFieldStep){ step, xdmf };
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileWriteIndex(DLMFieldFile file, int *failed, char path[PETSC_MAX_PATH_LEN])
{
  char  *text = NULL;
  size_t n    = 0;
  FILE  *out  = open_memstream(&text, &n);

  PetscFunctionBegin;
  PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory for the text of fields.xmf");
  DLMFieldFileWriteXdmf(file, out);
  PetscCheck(!fclose(out), PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory for the text of fields.xmf");
  PetscCall(PetscSNPrintf(path, PETSC_MAX_PATH_LEN, "%s/fields.xmf", file->dir));
  *failed = DLMFileReplace(path, NULL, 0, text, n);
  free(text);
  PetscFunctionReturn(0);
}
