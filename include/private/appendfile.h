/*
  An HDF5 file that grows and is whole at every moment, though a run may be killed at any and other programs read. Rank 0 alone.

  HDF5 adds to a file by new bytes behind its end, which nobody sees yet, and by a few changes to bytes that are there: superblock, table of the root group.
  A kill among those would lose the file. So while it is open here (a file driver of HDF5) new bytes go to the disk at once and changes are kept in memory;
  when it is closed the new bytes are flushed, the changes written to NAME.redo, which is flushed and renamed into place, then to the file, and NAME.redo
  goes. After a kill the file is what it was, with a tail that HDF5 does not look at; or NAME.redo is there, and the next run goes on from what it says.

  Changes need the file alone, as HDF5's readers lock it: while one has it open they wait in NAME.redo, for a later DLMAppendClose or DLMAppendFinish.
*/
#ifndef DLM_APPENDFILE_H
#define DLM_APPENDFILE_H

#include "wholefile.h"

/* Bytes of the file that are to change. */
typedef struct {
  haddr_t        at;
  size_t         n;
  unsigned char *bytes;
} DLMPatch;

/* To begin with, path and zeros. */
typedef struct {
  char      path[PETSC_MAX_PATH_LEN];
  ino_t     inode; /* of the file as this run left it, 0 before that; and its length */
  haddr_t   bytes;
  /* while it is open */
  int       fd, failed; /* failed: the first errno of a write */
  haddr_t   kept, size; /* length when it was opened; length now */
  haddr_t   end;        /* of what HDF5 has given out */
  size_t    n_before;     /* patches that had to wait when it was opened */
  /* changes that are not in the file yet, in the order they were written: the last one counts */
  size_t    n_patches, room;
  DLMPatch *patches;
} DLMAppendFile;

/* A new file in place of any other, with nothing in it. *failed: 0 or errno. */
PETSC_INTERN PetscErrorCode DLMAppendCreate(DLMAppendFile *file, int *failed);
/*
  Opens the file for additions. *failed: 0, errno, DLM_FILE_CHANGED if it is not as this run left it, or, at the first time, DLM_FILE_DAMAGED if it is no
  HDF5 file; then *h5 is -1 and nothing is to be closed.
*/
PETSC_INTERN PetscErrorCode DLMAppendOpen(DLMAppendFile *file, hid_t *h5, int *failed);
/* Closes it and brings the additions to the disk. *failed: 0 or errno, and then the file is what it was, or NAME.redo says what it is to be. */
PETSC_INTERN PetscErrorCode DLMAppendClose(DLMAppendFile *file, hid_t *h5, int *failed);
/* At the end of a run: what had to wait goes into the file, after two seconds without regard to readers; if that fails it stays in NAME.redo. */
PETSC_INTERN PetscErrorCode DLMAppendFinish(DLMAppendFile *file);
#endif
