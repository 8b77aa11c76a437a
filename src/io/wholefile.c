#include <errno.h>
#include <fcntl.h>
#include <unistd.h>
#include "../../include/private/wholefile.h"

int DLMFileWrite(int fd, const void *data, size_t n)
{
  for (const char *p = data; n;) {
    ssize_t done = write(fd, p, n < (1 << 30) ? n : (size_t)1 << 30);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return done ? errno : ENOSPC;
    p += done;
    n -= (size_t)done;
  }
  return 0;
}

/* The new name itself must reach the disk. */
static void FlushFolderOf(const char *path)
{
  char  folder[PETSC_MAX_PATH_LEN], *slash;
  int   fd;

  snprintf(folder, sizeof(folder), "%s", path);
  slash = strrchr(folder, '/');
  if (slash) slash[slash == folder] = '\0';
  fd = open(slash ? folder : ".", O_RDONLY);
  if (fd < 0) return;
  fsync(fd);
  close(fd);
}

int DLMFileBegin(const char *path)
{
  char fresh[PETSC_MAX_PATH_LEN + 8];

  snprintf(fresh, sizeof(fresh), "%s.new", path);
  return open(fresh, O_RDWR | O_CREAT | O_TRUNC, 0666);
}

int DLMFileFinish(const char *path, int fd, int failed)
{
  char fresh[PETSC_MAX_PATH_LEN + 8];

  snprintf(fresh, sizeof(fresh), "%s.new", path);
  if (!failed && fsync(fd)) failed = errno;
  if (close(fd) && !failed) failed = errno;
  if (!failed && rename(fresh, path)) failed = errno;
  if (failed) unlink(fresh);
  else FlushFolderOf(path);
  return failed;
}

int DLMFileReplace(const char *path, const void *head, size_t n_head, const void *body, size_t n_body)
{
  int failed, fd = DLMFileBegin(path);

  if (fd < 0) return errno;
  failed = DLMFileWrite(fd, head, n_head);
  if (!failed) failed = DLMFileWrite(fd, body, n_body);
  return DLMFileFinish(path, fd, failed);
}

uint64_t DLMFileCRC(uint64_t crc, const void *bytes, size_t n)
{
  static uint64_t      table[256];
  const unsigned char *data = bytes;

  if (!table[1])
    for (int i = 0; i < 256; i++) {
      table[i] = (uint64_t)i;
      for (int k = 0; k < 8; k++) table[i] = (table[i] >> 1) ^ (table[i] & 1 ? UINT64_C(0xc96c5795d7870f42) : 0);
    }
  crc = ~crc;
  for (size_t i = 0; i < n; i++) crc = table[(crc ^ data[i]) & 255] ^ (crc >> 8);
  return ~crc;
}

PetscErrorCode DLMImageCreate(hid_t *h5)
{
  hid_t access, creation;

  PetscFunctionBegin;
  H5Get(access, H5Pcreate(H5P_FILE_ACCESS));
  H5Do(H5Pset_fapl_core(access, (size_t)1 << 20, 0));
  H5Get(creation, H5Pcreate(H5P_FILE_CREATE));
  H5Do(H5Pset_link_creation_order(creation, H5P_CRT_ORDER_TRACKED));
  H5Get(*h5, H5Fcreate("in memory", H5F_ACC_TRUNC, creation, access));
  H5Do(H5Pclose(creation));
  H5Do(H5Pclose(access));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMImageNewGroup(hid_t parent, const char *name, hid_t *group)
{
  hid_t creation;

  PetscFunctionBegin;
  H5Get(creation, H5Pcreate(H5P_GROUP_CREATE));
  H5Do(H5Pset_link_creation_order(creation, H5P_CRT_ORDER_TRACKED));
  H5Get(*group, H5Gcreate2(parent, name, H5P_DEFAULT, creation, H5P_DEFAULT));
  H5Do(H5Pclose(creation));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMImageGetBytes(hid_t h5, void **bytes, size_t *n)
{
  ssize_t size;

  PetscFunctionBegin;
  H5Do(H5Fflush(h5, H5F_SCOPE_GLOBAL));
  H5Get(size, H5Fget_file_image(h5, NULL, 0));
  PetscCall(PetscMalloc(size, bytes));
  H5Do(H5Fget_file_image(h5, *bytes, (size_t)size));
  *n = (size_t)size;
  PetscFunctionReturn(0);
}
