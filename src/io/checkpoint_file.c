#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <unistd.h>
#include <dlmbuild.h>
#include "../../include/dlmscene.h"
#include "../../include/private/checkpoint.h"
#include "../../include/private/natural.h"
#include "../../include/private/wholefile.h"

static PetscBool IsFirst(const DLMCheckpointFile *file)
{
  PetscMPIInt rank;

  return (PetscBool)(!MPI_Comm_rank(file->comm, &rank) && rank == 0);
}

static void WriteHead(char head[DLM_CHECKPOINT_HEAD], int format, const char *version, long long bytes, uint64_t crc)
{
  memset(head, 0, DLM_CHECKPOINT_HEAD);
  snprintf(head, DLM_CHECKPOINT_HEAD, "dlmfd checkpoint\nformat %d\nprogram %s\nbytes %lld\ncrc64 %016" PRIx64 "\n", format, version, bytes, crc);
}

static PetscErrorCode NewFile(MPI_Comm comm, const char *path, PetscBool writing, DLMCheckpointFile **new_file)
{
  DLMCheckpointFile *file;

  PetscFunctionBegin;
  PetscCall(PetscNew(&file));
  file->comm    = comm;
  file->writing = writing;
  file->h5      = -1;
  PetscCall(PetscStrncpy(file->path, path, sizeof(file->path)));
  *new_file = file;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMCheckpointFileCreate(MPI_Comm comm, const char *path, DLMCheckpointFile **file)
{
  PetscFunctionBegin;
  PetscCall(NewFile(comm, path, PETSC_TRUE, file));
  if (IsFirst(*file)) PetscCall(DLMImageCreate(&(*file)->h5));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMCheckpointFileDestroy(DLMCheckpointFile **file)
{
  PetscFunctionBegin;
  if (!*file) PetscFunctionReturn(0);
  if ((*file)->h5 >= 0) H5Do(H5Fclose((*file)->h5));
  PetscCall(PetscFree(*file));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMCheckpointFileSave(DLMCheckpointFile *file, int *failed)
{
  PetscFunctionBegin;
  *failed = 0;
  if (IsFirst(file)) {
    char     head[DLM_CHECKPOINT_HEAD];
    size_t   n;
    void    *image;
    uint64_t crc;
    PetscCall(DLMImageGetBytes(file->h5, &image, &n));
    WriteHead(head, DLM_CHECKPOINT_FORMAT, DLM_VERSION, (long long)n + DLM_CHECKPOINT_HEAD, 0);
    crc = DLMFileCRC(DLMFileCRC(0, (unsigned char *)head, sizeof(head)), image, n);
    WriteHead(head, DLM_CHECKPOINT_FORMAT, DLM_VERSION, (long long)n + DLM_CHECKPOINT_HEAD, crc);
    *failed = DLMFileReplace(file->path, head, sizeof(head), image, n);
    PetscCall(PetscFree(image));
  }
  PetscCallMPI(MPI_Bcast(failed, 1, MPI_INT, 0, file->comm));
  PetscFunctionReturn(0);
}

/* Reads every byte. problem stays empty if the file is whole and of this format. */
static void Inspect(const char *path, char problem[], size_t size)
{
  static unsigned char buffer[1 << 16];
  char                 head[DLM_CHECKPOINT_HEAD], plain[DLM_CHECKPOINT_HEAD], version[64] = "";
  int                  format = 0, fd = open(path, O_RDONLY | O_NONBLOCK); /* a pipe would wait for its writer */
  long long            bytes = 0, found = 0;
  uint64_t             told = 0, crc = 0;
  ssize_t              n = -1;

  problem[0] = '\0';
  if (fd >= 0) n = read(fd, head, sizeof(head));
  if (n < 0) {
    snprintf(problem, size, "cannot be read (%s)", strerror(errno));
  } else if (n < (ssize_t)sizeof(head) || strncmp(head, "dlmfd checkpoint\n", 17)) {
    snprintf(problem, size, "is not a checkpoint, or its beginning is lost");
  } else if (head[sizeof(head) - 1] || sscanf(head + 17, "format %d program %63s bytes %lld crc64 %" SCNx64, &format, version, &bytes, &told) != 4) {
    snprintf(problem, size, "is damaged: its first lines cannot be understood");
  } else if (format != DLM_CHECKPOINT_FORMAT) {
    snprintf(problem, size, "has format %d, written by dlmfd %s; allowed: format %d, that of this dlmfd " DLM_VERSION, format, version, DLM_CHECKPOINT_FORMAT);
  } else {
    WriteHead(plain, format, version, bytes, 0);
    crc = DLMFileCRC(0, (unsigned char *)plain, sizeof(plain));
    for (found = sizeof(head); (n = read(fd, buffer, sizeof(buffer))) > 0; found += n) crc = DLMFileCRC(crc, buffer, (size_t)n);
    WriteHead(plain, format, version, bytes, told);
    if (n < 0) snprintf(problem, size, "cannot be read (%s)", strerror(errno));
    else if (found != bytes) snprintf(problem, size, "is damaged: it has %lld bytes and should have %lld", found, bytes);
    else if (crc != told || memcmp(head, plain, sizeof(head))) snprintf(problem, size, "is damaged: its checksum is wrong");
  }
  if (fd >= 0) close(fd);
}

PetscErrorCode DLMCheckpointFileOpen(MPI_Comm comm, const char *path, DLMCheckpointFile **file)
{
  char problem[256] = "";

  PetscFunctionBegin;
  PetscCall(NewFile(comm, path, PETSC_FALSE, file));
  if (IsFirst(*file)) Inspect(path, problem, sizeof(problem));
  PetscCallMPI(MPI_Bcast(problem, sizeof(problem), MPI_CHAR, 0, comm));
  DLMUserCheck(!problem[0], comm, "-restart %s %s%s", path, problem, strstr(problem, "allowed") ? "" : "; allowed: a whole checkpoint.h5 of this program");
  if (IsFirst(*file)) H5Get((*file)->h5, H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT));
  PetscFunctionReturn(0);
}

/* Moves one dataset between rank 0's x and the file. */
static PetscErrorCode Move(DLMCheckpointFile *file, const char *name, hid_t type, int n_dims, const hsize_t dims[], void *x)
{
  hid_t space, data, links;

  PetscFunctionBegin;
  if (file->writing) {
    H5Get(links, H5Pcreate(H5P_LINK_CREATE));
    H5Do(H5Pset_create_intermediate_group(links, 1));
    H5Get(space, H5Screate_simple(n_dims, dims, NULL));
    H5Get(data, H5Dcreate2(file->h5, name, type, space, links, H5P_DEFAULT, H5P_DEFAULT));
    H5Do(H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, x));
    H5Do(H5Pclose(links));
  } else {
    hssize_t found, expected = 1;
    for (int d = 0; d < n_dims; d++) expected *= (hssize_t)dims[d];
    H5Get(data, H5Dopen2(file->h5, name, H5P_DEFAULT));
    H5Get(space, H5Dget_space(data));
    H5Get(found, H5Sget_simple_extent_npoints(space));
    PetscCheck(found == expected, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED, "%s holds %lld entries of %s, %lld are needed", file->path, (long long)found, name, (long long)expected);
    H5Do(H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, x));
  }
  H5Do(H5Dclose(data));
  H5Do(H5Sclose(space));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMCheckpointReals(DLMCheckpointFile *file, const char *name, PetscInt n, PetscReal *x)
{
  const hsize_t dims = (hsize_t)n;

  PetscFunctionBegin;
  if (!n) PetscFunctionReturn(0);
  if (IsFirst(file)) PetscCall(Move(file, name, H5T_NATIVE_DOUBLE, 1, &dims, x));
  if (!file->writing) PetscCallMPI(MPI_Bcast(x, (PetscMPIInt)n, MPIU_REAL, 0, file->comm));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMCheckpointInts(DLMCheckpointFile *file, const char *name, PetscInt n, PetscInt *x)
{
  const hsize_t dims = (hsize_t)n;

  PetscFunctionBegin;
  if (!n) PetscFunctionReturn(0);
  if (IsFirst(file)) {
    int64_t *wide;
    PetscCall(PetscMalloc1(n, &wide));
    for (PetscInt i = 0; i < n; i++) wide[i] = x[i];
    PetscCall(Move(file, name, H5T_NATIVE_INT64, 1, &dims, wide));
    for (PetscInt i = 0; i < n; i++) x[i] = (PetscInt)wide[i];
    PetscCall(PetscFree(wide));
  }
  if (!file->writing) PetscCallMPI(MPI_Bcast(x, (PetscMPIInt)n, MPIU_INT, 0, file->comm));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMCheckpointBool(DLMCheckpointFile *file, const char *name, PetscBool *x)
{
  PetscInt number = *x ? 1 : 0;

  PetscFunctionBegin;
  PetscCall(DLMCheckpointInts(file, name, 1, &number));
  *x = number ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMCheckpointText(DLMCheckpointFile *file, const char *name, char text[DLM_CHECKPOINT_TEXT])
{
  const hsize_t one = 1;

  PetscFunctionBegin;
  if (IsFirst(file)) {
    hid_t type;
    H5Get(type, H5Tcopy(H5T_C_S1));
    H5Do(H5Tset_size(type, DLM_CHECKPOINT_TEXT));
    PetscCall(Move(file, name, type, 1, &one, text));
    H5Do(H5Tclose(type));
    text[DLM_CHECKPOINT_TEXT - 1] = '\0';
  }
  if (!file->writing) PetscCallMPI(MPI_Bcast(text, DLM_CHECKPOINT_TEXT, MPI_CHAR, 0, file->comm));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMCheckpointField(DLMCheckpointFile *file, const char *name, DM dm, const PetscReal *sign, Vec v)
{
  DLMNatural   n;
  PetscScalar *x;

  PetscFunctionBegin;
  PetscCall(DLMNaturalCreate(dm, sign, &n));
  if (file->writing) PetscCall(DLMNaturalGather(&n, v));
  PetscCall(DLMNaturalGetArray(&n, &x));
  if (IsFirst(file)) PetscCall(Move(file, name, H5T_NATIVE_DOUBLE, 4, (hsize_t[]){ (hsize_t)n.nodes[2], (hsize_t)n.nodes[1], (hsize_t)n.nodes[0], (hsize_t)n.dof }, x));
  PetscCall(DLMNaturalRestoreArray(&n, &x));
  if (!file->writing) PetscCall(DLMNaturalSpread(&n, v));
  PetscCall(DLMNaturalDestroy(&n));
  PetscFunctionReturn(0);
}
