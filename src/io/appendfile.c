#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include "../../include/private/appendfile.h"
#if H5_VERSION_GE(1, 13, 0)
  #include <H5FDdevelop.h>
#endif

static const int patience = 200; /* hundredths of a second that a change waits for readers where it cannot wait longer */

/* n bytes at an offset. Returns 0 or errno. */
static int WriteAt(int fd, const void *data, size_t n, haddr_t at)
{
  return lseek(fd, (off_t)at, SEEK_SET) < 0 ? errno : DLMFileWrite(fd, data, n);
}

/* What cannot be read, as behind the end, is 0. */
static void ReadAt(int fd, void *data, size_t n, haddr_t at)
{
  char *p = data;

  while (n) {
    ssize_t done = pread(fd, p, n, (off_t)at);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) break;
    p += done;
    n -= (size_t)done;
    at += (haddr_t)done;
  }
  memset(p, 0, n);
}

/* The file as it will be. */
static void Read(const DLMAppendFile *file, haddr_t at, size_t n, void *data)
{
  ReadAt(file->fd, data, n, at);
  for (const DLMPatch *patch = file->patches; patch < file->patches + file->n_patches; patch++) {
    const haddr_t from = PetscMax(at, patch->at), to = PetscMin(at + n, patch->at + patch->n);
    if (from < to) memcpy((char *)data + (from - at), patch->bytes + (from - patch->at), (size_t)(to - from));
  }
}

/* The driver: HDF5's view of a DLMAppendFile. */
typedef struct {
  H5FD_t         pub;
  DLMAppendFile *file;
} Driver;

static DLMAppendFile *FileOf(const H5FD_t *driver)
{
  return ((const Driver *)driver)->file;
}

static H5FD_t *DriverOpen(const char *name, unsigned flags, hid_t access, haddr_t most)
{
  Driver *driver = calloc(1, sizeof(*driver));

  if (!driver) return NULL;
  driver->file      = *(DLMAppendFile *const *)H5Pget_driver_info(access);
  driver->file->end = 0; /* HDF5 opens a file twice: to look at it, to use it */
  return (H5FD_t *)driver;
}

static herr_t DriverClose(H5FD_t *driver)
{
  free(driver);
  return 0;
}

static herr_t DriverQuery(const H5FD_t *driver, unsigned long *flags)
{
  *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_AGGREGATE_SMALLDATA;
  return 0;
}

static haddr_t DriverGetEnd(const H5FD_t *driver, H5FD_mem_t type)
{
  return FileOf(driver)->end;
}

static herr_t DriverSetEnd(H5FD_t *driver, H5FD_mem_t type, haddr_t end)
{
  FileOf(driver)->end = end;
  return 0;
}

static haddr_t DriverGetSize(const H5FD_t *driver, H5FD_mem_t type)
{
  return FileOf(driver)->size;
}

static herr_t DriverRead(H5FD_t *driver, H5FD_mem_t type, hid_t transfer, haddr_t at, size_t n, void *data)
{
  Read(FileOf(driver), at, n, data);
  return 0;
}

static int AddPatch(DLMAppendFile *file, haddr_t at, size_t n, const void *data)
{
  DLMPatch *patch;

  if (file->n_patches == file->room) {
    DLMPatch *more = realloc(file->patches, (2 * file->room + 16) * sizeof(*more));
    if (!more) return ENOMEM;
    file->patches = more;
    file->room    = 2 * file->room + 16;
  }
  patch        = &file->patches[file->n_patches];
  patch->at    = at;
  patch->n     = n;
  patch->bytes = malloc(n);
  if (!patch->bytes) return ENOMEM;
  memcpy(patch->bytes, data, n);
  file->n_patches++;
  return 0;
}

/* HDF5 is not told of an error, which it would answer with traces: the file goes back to what it was when it is closed. */
static herr_t DriverWrite(H5FD_t *driver, H5FD_mem_t type, hid_t transfer, haddr_t at, size_t n, const void *data)
{
  DLMAppendFile *file = FileOf(driver);
  const size_t   old  = at >= file->kept ? 0 : PetscMin(n, (size_t)(file->kept - at)); /* bytes that are there already */

  if (!file->failed && old) file->failed = AddPatch(file, at, old, data);
  if (!file->failed && old < n) file->failed = WriteAt(file->fd, (const char *)data + old, n - old, at + old);
  file->size = PetscMax(file->size, at + n);
  return 0;
}

static const H5FD_class_t append_class = {
#if H5_VERSION_GE(1, 13, 0)
  .version = H5FD_CLASS_VERSION,
  .value   = 512, /* free for local use */
#endif
  .name         = "dlmfd append",
  .maxaddr      = (haddr_t)1 << 62,
  .fc_degree    = H5F_CLOSE_STRONG,
  .fapl_size    = sizeof(DLMAppendFile *),
  .open         = DriverOpen,
  .close        = DriverClose,
  .query        = DriverQuery,
  .get_eoa      = DriverGetEnd,
  .set_eoa      = DriverSetEnd,
  .get_eof      = DriverGetSize,
  .read         = DriverRead,
  .write        = DriverWrite,
  .fl_map       = H5FD_FLMAP_DICHOTOMY,
};

/* Forgets all patches but the first n. */
static void DropPatches(DLMAppendFile *file, size_t n)
{
  while (file->n_patches > n) free(file->patches[--file->n_patches].bytes);
  if (n) return;
  free(file->patches);
  file->patches = NULL;
  file->room    = 0;
}

static void NameRedo(const DLMAppendFile *file, char redo[PETSC_MAX_PATH_LEN + 8])
{
  snprintf(redo, PETSC_MAX_PATH_LEN + 8, "%s.redo", file->path);
}

enum { SUPERBLOCK = 48 }; /* bytes at the beginning, with the length of the file, so that they tell one of its states from another */

#define REDO "dlmfd redo\nbytes %zu crc64 %016" PRIx64 "\n\n"

/* NAME.redo: the superblock that the patches find, then where each patch goes, how long it is, and what it says. */
static int WriteRedo(const DLMAppendFile *file, const char *redo)
{
  size_t n = SUPERBLOCK;
  char   head[256], *body, *p;
  int    n_head, failed;

  for (size_t k = 0; k < file->n_patches; k++) n += 2 * sizeof(uint64_t) + file->patches[k].n;
  body = malloc(n);
  if (!body) return ENOMEM;
  ReadAt(file->fd, body, SUPERBLOCK, 0);
  p = body + SUPERBLOCK;
  for (size_t k = 0; k < file->n_patches; k++) {
    const uint64_t where[2] = { file->patches[k].at, file->patches[k].n };
    memcpy(p, where, sizeof(where));
    memcpy(p + sizeof(where), file->patches[k].bytes, file->patches[k].n);
    p += sizeof(where) + file->patches[k].n;
  }
  n_head = snprintf(head, sizeof(head), REDO, n, DLMFileCRC(0, body, n));
  failed = DLMFileReplace(redo, head, (size_t)n_head, body, n);
  free(body);
  return failed;
}

/* The n bytes of a whole NAME.redo, malloc'ed, or NULL. */
static char *LoadRedo(const char *redo, size_t *n)
{
  uint64_t  crc = 0;
  char      head[256] = "", again[256], *body = NULL;
  FILE     *in = fopen(redo, "rb");
  PetscBool good;

  if (!in) return NULL;
  good = (PetscBool)(fread(head, 1, sizeof(head) - 1, in) > 0 && sscanf(head, "dlmfd redo bytes %zu crc64 %" SCNx64, n, &crc) == 2 && *n >= SUPERBLOCK);
  snprintf(again, sizeof(again), REDO, *n, crc);
  good = (PetscBool)(good && !strncmp(head, again, strlen(again)) && !fseek(in, (long)strlen(again), SEEK_SET) && (body = malloc(*n + 1)) && fread(body, 1, *n + 1, in) == *n &&
                     DLMFileCRC(0, body, *n) == crc);
  fclose(in);
  if (good) return body;
  free(body);
  return NULL;
}

/* The patches of NAME.redo, if it is there, whole and about this file, which may have some of them already. */
static int ReadRedo(DLMAppendFile *file, const char *redo)
{
  unsigned char now[SUPERBLOCK], then[SUPERBLOCK];
  uint64_t      where[2];
  size_t        n = 0;
  char         *body   = LoadRedo(redo, &n);
  int           failed = 0;

  for (size_t at = SUPERBLOCK; at < n && body && !failed; at += sizeof(where) + where[1]) {
    memcpy(where, body + at, sizeof(where));
    failed = AddPatch(file, where[0], where[1], body + at + sizeof(where));
  }
  ReadAt(file->fd, now, SUPERBLOCK, 0);
  Read(file, 0, SUPERBLOCK, then);
  for (int i = 0; i < SUPERBLOCK && body; i++)
    if (now[i] != then[i] && now[i] != (unsigned char)body[i]) DropPatches(file, 0);
  free(body);
  return failed;
}

/* Keeps HDF5 in other programs from opening the file. Waits for those that have it open, but no longer than so many hundredths of a second. */
static PetscBool Lock(int fd, int patience)
{
  while (flock(fd, LOCK_EX | LOCK_NB)) {
    if (errno != EWOULDBLOCK) return PETSC_TRUE; /* no locks here: as if nobody read */
    if (!patience--) return PETSC_FALSE;
    usleep(10000);
  }
  return PETSC_TRUE;
}

/* The patches into the file, and its tail off. */
static int Apply(DLMAppendFile *file, const char *redo)
{
  int failed = 0;

  for (size_t k = 0; k < file->n_patches && !failed; k++) failed = WriteAt(file->fd, file->patches[k].bytes, file->patches[k].n, file->patches[k].at);
  if (!failed && ftruncate(file->fd, (off_t)file->end)) failed = errno;
  flock(file->fd, LOCK_UN);
  if (!failed && fsync(file->fd)) failed = errno;
  if (!failed && file->n_patches && unlink(redo)) failed = errno;
  if (!failed) DropPatches(file, 0);
  return failed;
}

/* Opens the file, if it is as this run left it. Returns 0, errno or DLM_FILE_CHANGED. */
static int OpenFile(DLMAppendFile *file)
{
  struct stat status;

  file->failed = 0;
  file->fd     = open(file->path, O_RDWR);
  if (file->fd < 0) return errno;
  if (fstat(file->fd, &status)) return errno;
  if (file->inode && (file->inode != status.st_ino || file->bytes != (haddr_t)status.st_size)) return DLM_FILE_CHANGED;
  file->kept = file->size = (haddr_t)status.st_size;
  return 0;
}

/* Remembers how the file is left. Returns failed, or errno. */
static int CloseFile(DLMAppendFile *file, int failed)
{
  struct stat status;

  if (file->fd < 0) return failed;
  if (!failed && fstat(file->fd, &status)) failed = errno;
  if (close(file->fd) && !failed) failed = errno;
  if (failed) return failed;
  file->inode = status.st_ino;
  file->bytes = (haddr_t)status.st_size;
  return 0;
}

/* How HDF5 uses the file: through the driver, with formats since 1.8, which have checksums on all but the numbers. To be closed with H5Pclose. */
static PetscErrorCode NewAccess(DLMAppendFile *file, hid_t *access)
{
  hid_t id;

  PetscFunctionBegin;
  H5Do(H5Eset_auto2(H5E_DEFAULT, NULL, NULL)); /* no traces of a damaged file, and no word at the end about what HDF5 itself leaves open then */
  H5Get(*access, H5Pcreate(H5P_FILE_ACCESS));
  H5Do(H5Pset_libver_bounds(*access, H5F_LIBVER_V18, H5F_LIBVER_LATEST));
  H5Get(id, H5FDregister(&append_class));
  H5Do(H5Pset_driver(*access, id, &file));
  H5Do(H5FDunregister(id)); /* the list has it */
  PetscFunctionReturn(0);
}

/* A file with an empty root group, which remembers the order of its members; room of what is removed is given back, or used again. */
static PetscErrorCode MakeEmpty(DLMAppendFile *file)
{
  hid_t access, creation, h5;

  PetscFunctionBegin;
  file->kept = file->size = 0;
  file->failed            = 0;
  PetscCall(NewAccess(file, &access));
  H5Get(creation, H5Pcreate(H5P_FILE_CREATE));
  H5Do(H5Pset_link_creation_order(creation, H5P_CRT_ORDER_TRACKED));
  H5Do(H5Pset_file_space_strategy(creation, H5F_FSPACE_STRATEGY_FSM_AGGR, 1, 1));
  H5Get(h5, H5Fcreate(file->path, H5F_ACC_TRUNC, creation, access));
  H5Do(H5Fclose(h5));
  H5Do(H5Pclose(creation));
  H5Do(H5Pclose(access));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMAppendCreate(DLMAppendFile *file, int *failed)
{
  char redo[PETSC_MAX_PATH_LEN + 8];

  PetscFunctionBegin;
  NameRedo(file, redo);
  file->fd = unlink(redo) && errno != ENOENT ? -1 : DLMFileBegin(file->path);
  *failed  = file->fd < 0 ? errno : 0;
  if (*failed) PetscFunctionReturn(0);
  PetscCall(MakeEmpty(file));
  *failed = DLMFileFinish(file->path, file->fd, file->failed);
  if (!*failed) *failed = OpenFile(file);
  *failed = CloseFile(file, *failed);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMAppendOpen(DLMAppendFile *file, hid_t *h5, int *failed)
{
  char  redo[PETSC_MAX_PATH_LEN + 8];
  hid_t access;

  PetscFunctionBegin;
  *h5 = -1;
  NameRedo(file, redo);
  *failed = OpenFile(file);
  if (!*failed && !file->inode) *failed = ReadRedo(file, redo);
  file->n_before = file->n_patches;
  if (!*failed) {
    PetscCall(NewAccess(file, &access));
    *h5 = file->kept ? H5Fopen(file->path, H5F_ACC_RDWR, access) : -1; /* an empty one HDF5 would begin anew */
    H5Do(H5Pclose(access));
    if (*h5 < 0) *failed = file->inode ? DLM_FILE_CHANGED : DLM_FILE_DAMAGED;
  }
  if (*failed && file->fd >= 0) close(file->fd);
  if (*failed && !file->inode) DropPatches(file, 0);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMAppendClose(DLMAppendFile *file, hid_t *h5, int *failed)
{
  char redo[PETSC_MAX_PATH_LEN + 8];

  PetscFunctionBegin;
  NameRedo(file, redo);
  H5Do(H5Fclose(*h5));
  *h5     = -1;
  *failed = file->failed;
  if (!*failed && fsync(file->fd)) *failed = errno;
  if (!*failed && file->n_patches) *failed = WriteRedo(file, redo);
  if (*failed) {
    DropPatches(file, file->n_before);
    if (ftruncate(file->fd, (off_t)file->kept)) *failed = errno;
  } else {
    const PetscBool shorter = (PetscBool)(file->end < file->kept); /* which cannot wait: later additions would be changes */
    if (Lock(file->fd, shorter ? patience : 0) || shorter) *failed = Apply(file, redo);
  }
  *failed = CloseFile(file, *failed);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMAppendFinish(DLMAppendFile *file)
{
  char redo[PETSC_MAX_PATH_LEN + 8];
  int  failed;

  PetscFunctionBegin;
  if (!file->n_patches) PetscFunctionReturn(0);
  NameRedo(file, redo);
  failed = OpenFile(file);
  if (!failed) Lock(file->fd, patience);
  if (!failed) failed = Apply(file, redo);
  CloseFile(file, failed);
  DropPatches(file, 0);
  PetscFunctionReturn(0);
}
