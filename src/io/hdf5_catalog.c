/* The outputs of fields that are on the disk: found at a restart, tied together by fields.h5 and fields.xmf. All of rank 0. */
#include <dirent.h>
#include <errno.h>
#include <inttypes.h>
#include <sys/stat.h>
#include <unistd.h>
#include "../../include/private/dlmfieldsio.h"
#include "../../include/private/wholefile.h"

/* The step of a file of the folder fields, -1 if it is something else. */
static PetscInt StepOf(const char *name)
{
  char     again[64];
  PetscInt step = (PetscInt)(strncmp(name, "step_", 5) ? -1 : strtol(name + 5, NULL, 10));

  snprintf(again, sizeof(again), DLM_STEP_NAME ".h5", step);
  return strcmp(name, again) ? -1 : step;
}

static int Ascending(const void *a, const void *b)
{
  return *(const PetscInt *)a < *(const PetscInt *)b ? -1 : *(const PetscInt *)a > *(const PetscInt *)b;
}

/* The steps of the folder, ascending; the caller frees them. */
static PetscErrorCode ListSteps(DLMFieldFile file, PetscInt *n, PetscInt **steps)
{
  char           path[PETSC_MAX_PATH_LEN];
  struct dirent *entry;
  DIR           *folder;

  PetscFunctionBegin;
  *n     = 0;
  *steps = NULL;
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/fields", file->dir));
  folder = opendir(path);
  while (folder && (entry = readdir(folder))) {
    if (StepOf(entry->d_name) < 0) continue;
    PetscCall(PetscRealloc((size_t)(*n + 1) * sizeof(**steps), steps));
    (*steps)[(*n)++] = StepOf(entry->d_name);
  }
  if (folder) closedir(folder);
  if (*n) qsort(*steps, (size_t)*n, sizeof(**steps), Ascending);
  PetscFunctionReturn(0);
}

#define HEAD "dlmfd fields\nhead %zu bytes %lld text %zu crc64 %016" PRIx64 "\n\n"

PetscErrorCode DLMFieldFileMakeHead(const char *xdmf, size_t n_image, char **head, size_t *n)
{
  const size_t   text = strlen(xdmf);
  const uint64_t crc  = DLMFileCRC(0, xdmf, text);
  int            first;

  PetscFunctionBegin;
  for (*n = 512; *n < text + 128; *n *= 2) { }
  PetscCall(PetscCalloc1(*n, head));
  first = snprintf(*head, *n, HEAD, *n, (long long)(*n + n_image), text, crc);
  PetscCall(PetscArraycpy(*head + first, xdmf, text));
  PetscFunctionReturn(0);
}

/* The part of fields.xmf in the head of an output, malloc'ed; NULL if the file is not one, not whole, or its head is damaged. */
static char *ReadXdmf(const char *path)
{
  char        first[128] = "", again[128], *text = NULL;
  size_t      head = 0, n = 0;
  long long   bytes = 0;
  uint64_t    crc = 0;
  struct stat status;
  FILE       *in = fopen(path, "rb");

  if (!in) return NULL;
  if (fread(first, 1, sizeof(first) - 1, in) > 0 && sscanf(first, "dlmfd fields head %zu bytes %lld text %zu crc64 %" SCNx64, &head, &bytes, &n, &crc) == 4 &&
      snprintf(again, sizeof(again), HEAD, head, bytes, n, crc) < (int)sizeof(again) && !strncmp(first, again, strlen(again)) && !fstat(fileno(in), &status) &&
      status.st_size == bytes && n < head && (long long)head < bytes && !fseek(in, (long)strlen(again), SEEK_SET))
    text = malloc(n + 1);
  if (text && (fread(text, 1, n, in) != n || DLMFileCRC(0, text, n) != crc)) {
    free(text);
    text = NULL;
  }
  if (text) text[n] = '\0';
  fclose(in);
  return text;
}

PetscErrorCode DLMFieldFileReadCatalog(DLMFieldFile file, PetscInt keep_through, char problem[], size_t size)
{
  PetscInt  n, *steps;
  char      path[PETSC_MAX_PATH_LEN];

  PetscFunctionBegin;
  PetscCall(ListSteps(file, &n, &steps));
  for (PetscInt s = 0; s < n && steps[s] <= keep_through && !problem[0]; s++) {
    char *xdmf;
    PetscCall(PetscSNPrintf(path, sizeof(path), "%s/fields/" DLM_STEP_NAME ".h5", file->dir, steps[s]));
    xdmf = ReadXdmf(path);
    if (xdmf) PetscCall(DLMFieldFileAddStep(file, steps[s], xdmf));
    else PetscCall(PetscSNPrintf(problem, size, "%s cannot be read or is damaged, and -restart goes on after it; allowed: a whole output, or none: move this one away", path));
  }
  PetscCall(PetscFree(steps));
  PetscFunctionReturn(0);
}

static PetscBool Known(DLMFieldFile file, PetscInt step)
{
  for (PetscInt s = 0; s < file->n_steps; s++)
    if (file->steps[s].step == step) return PETSC_TRUE;
  return PETSC_FALSE;
}

PetscErrorCode DLMFieldFileSweep(DLMFieldFile file)
{
  char           path[PETSC_MAX_PATH_LEN], bare[64];
  struct dirent *entry;
  DIR           *folder;

  PetscFunctionBegin;
  PetscCall(PetscSNPrintf(path, sizeof(path), "%s/fields", file->dir));
  folder = opendir(path);
  while (folder && (entry = readdir(folder))) {
    const size_t    length = strlen(entry->d_name);
    const PetscBool fresh  = (PetscBool)(length > 4 && !strcmp(entry->d_name + length - 4, ".new"));
    snprintf(bare, sizeof(bare), "%.*s", (int)(fresh ? length - 4 : length), entry->d_name);
    if (StepOf(bare) < 0 || (!fresh && Known(file, StepOf(bare)))) continue;
    PetscCall(PetscSNPrintf(path, sizeof(path), "%s/fields/%s", file->dir, entry->d_name));
    unlink(path);
  }
  if (folder) closedir(folder);
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

/* fields.h5 in memory. */
static PetscErrorCode MakeLinks(DLMFieldFile file, void **image, size_t *n)
{
  char  target[64], name[64];
  hid_t h5;

  PetscFunctionBegin;
  PetscCall(DLMImageCreate(&h5));
  for (PetscInt s = 0; s < file->n_steps; s++) {
    PetscCall(PetscSNPrintf(target, sizeof(target), "fields/" DLM_STEP_NAME ".h5", file->steps[s].step));
    PetscCall(PetscSNPrintf(name, sizeof(name), DLM_STEP_NAME, file->steps[s].step));
    H5Do(H5Lcreate_external(target, "/", h5, name, H5P_DEFAULT, H5P_DEFAULT));
  }
  if (file->n_steps) H5Do(H5Lcreate_external(target, "/meshes", h5, "meshes", H5P_DEFAULT, H5P_DEFAULT));
  PetscCall(DLMImageGetBytes(h5, image, n));
  H5Do(H5Fclose(h5));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMFieldFileWriteIndex(DLMFieldFile file, int *failed, char path[PETSC_MAX_PATH_LEN])
{
  void  *image;
  char  *text = NULL;
  size_t n    = 0;
  FILE  *out;

  PetscFunctionBegin;
  PetscCall(MakeLinks(file, &image, &n));
  PetscCall(PetscSNPrintf(path, PETSC_MAX_PATH_LEN, "%s/fields.h5", file->dir));
  *failed = DLMFileReplace(path, NULL, 0, image, n);
  PetscCall(PetscFree(image));
  if (*failed) PetscFunctionReturn(0);
  out = open_memstream(&text, &n);
  PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory for the text of fields.xmf");
  DLMFieldFileWriteXdmf(file, out);
  PetscCheck(!fclose(out), PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory for the text of fields.xmf");
  PetscCall(PetscSNPrintf(path, PETSC_MAX_PATH_LEN, "%s/fields.xmf", file->dir));
  *failed = DLMFileReplace(path, NULL, 0, text, n);
  free(text);
  PetscFunctionReturn(0);
}
