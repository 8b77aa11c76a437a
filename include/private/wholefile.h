/*
  Files that are whole or as they were. What a run leaves is made in memory on rank 0 and brought to the disk by DLMFileReplace, so that no fault (a kill, a
  full disk) leaves half of a file; trajectory.csv and bulk.csv grow in place (csv.h), and fields.h5 (appendfile.h). HDF5 never writes to a disk itself: its
  errors there would come with traces and leave a file that nothing can read.
*/
#ifndef DLM_WHOLEFILE_H
#define DLM_WHOLEFILE_H

#include <stdint.h>
#include <petscsys.h>
#include <hdf5.h>

/* result = call; what HDF5 fails at in memory, or in a file that was found whole, is no user's fault. */
#define H5Get(result, call) \
  do { \
    (result) = call; \
    PetscCheck((result) >= 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "HDF5 failed at %s", #call); \
  } while (0)
#define H5Do(call) \
  do { \
    long long h5_status_; \
    H5Get(h5_status_, call); \
  } while (0)

/* What can be wrong with a file beside errno: it is not as this run left it; it has other columns than this version writes; it is not whole. */
enum { DLM_FILE_CHANGED = -1, DLM_FILE_COLUMNS = -2, DLM_FILE_DAMAGED = -3 };

/* All n bytes to an open file. Returns 0 or errno. */
PETSC_INTERN int DLMFileWrite(int fd, const void *data, size_t n);
/* A new file, path.new. Returns its descriptor, or -1 and errno. */
PETSC_INTERN int DLMFileBegin(const char *path);
/* path.new, which is open as fd, takes the place of path if nothing has failed: flushed, closed, renamed; else it goes. Returns failed, or errno. */
PETSC_INTERN int DLMFileFinish(const char *path, int fd, int failed);
/* Head and body to path: into path.new, which then takes its place. Returns 0 or errno, and then path is what it was. */
PETSC_INTERN int DLMFileReplace(const char *path, const void *head, size_t n_head, const void *body, size_t n_body);
/* CRC-64 of ECMA-182, reflected, of what crc stands for and then n bytes; crc = 0: of nothing. */
PETSC_INTERN uint64_t DLMFileCRC(uint64_t crc, const void *bytes, size_t n);

/* An HDF5 file in memory, whose groups remember the order of their members. To be closed with H5Fclose. */
PETSC_INTERN PetscErrorCode DLMImageCreate(hid_t *h5);
PETSC_INTERN PetscErrorCode DLMImageNewGroup(hid_t parent, const char *name, hid_t *group);
/* A copy of its bytes, to be freed with PetscFree. */
PETSC_INTERN PetscErrorCode DLMImageGetBytes(hid_t h5, void **bytes, size_t *n);
#endif
