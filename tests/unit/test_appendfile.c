/*
  A growing HDF5 file and a run that is killed at each of the calls that change a disk, or whose call fails there: the file is what it was or what it
  should become, HDF5 alone can read it unless the kill fell among its changes, and the next run goes on.
*/
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>
#include "private/appendfile.h"

#define Call(expression) assert_int_equal(expression, 0)

enum { NEVER = 0, KILL, FAIL };
static int  mode, calls, at; /* what happens at the call number at, from 1 */
static char folder[] = "appendfile", path[] = "appendfile/data.h5", redo[] = "appendfile/data.h5.redo";

/* Whether this call is to fail. half: what is done before a kill. */
static int Strikes(void)
{
  if (mode == NEVER || ++calls != at) return 0;
  if (mode == KILL) return KILL;
  mode  = NEVER;
  errno = ENOSPC;
  return FAIL;
}

/* These stand before those of the C library. A kill leaves half of what was to be written. */
ssize_t write(int fd, const void *data, size_t n)
{
  const int strike = Strikes();

  if (strike == FAIL) return -1;
  if (strike == KILL) {
    syscall(SYS_write, fd, data, n / 2);
    _exit(9);
  }
  return syscall(SYS_write, fd, data, n);
}

#define BEFORE() \
  do { \
    const int strike = Strikes(); \
    if (strike == FAIL) return -1; \
    if (strike == KILL) _exit(9); \
  } while (0)

int fsync(int fd)
{
  BEFORE();
  return 0;
}

int ftruncate(int fd, off_t n)
{
  BEFORE();
  return (int)syscall(SYS_ftruncate, fd, n);
}

int rename(const char *from, const char *to)
{
  BEFORE();
  return (int)syscall(SYS_rename, from, to);
}

int unlink(const char *name)
{
  BEFORE();
  return (int)syscall(SYS_unlink, name);
}

/* Group k with its number, and an array that holds it. */
static void AddGroup(hid_t h5, int k)
{
  const hsize_t n = 1000;
  double        x[1000];
  char          name[16];
  hid_t         group, space, data;

  for (int i = 0; i < 1000; i++) x[i] = k + 0.001 * i;
  snprintf(name, sizeof(name), "step_%d", k);
  Call(DLMImageNewGroup(h5, name, &group));
  space = H5Screate_simple(1, &n, NULL);
  data  = H5Dcreate2(group, "x", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  assert_true(H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, x) >= 0);
  H5Dclose(data);
  H5Sclose(space);
  H5Gclose(group);
}

/* A run's session: adds groups from to to - 1, or removes them if from > to. Returns failed. */
static int Session(DLMAppendFile *file, int from, int to)
{
  int   failed;
  char  name[16];
  hid_t h5;

  Call(DLMAppendOpen(file, &h5, &failed));
  if (failed) return failed;
  for (int k = from; k < to; k++) AddGroup(h5, k);
  for (int k = from - 1; k >= to; k--) {
    snprintf(name, sizeof(name), "step_%d", k);
    assert_true(H5Ldelete(h5, name, H5P_DEFAULT) >= 0);
  }
  Call(DLMAppendClose(file, &h5, &failed));
  return failed;
}

/* What a run knows before it has opened the file. */
static void NewRun(DLMAppendFile *file)
{
  memset(file, 0, sizeof(*file));
  strcpy(file->path, path);
}

static void MakeFile(DLMAppendFile *file)
{
  int failed;

  NewRun(file);
  Call(DLMAppendCreate(file, &failed));
  assert_int_equal(failed, 0);
}

/* The number of groups of the file, read by HDF5 alone, after a look at every number; -1 if it cannot be read. */
static int CountGroups(void)
{
  hid_t      h5, data;
  H5G_info_t info;
  double     x[1000];
  char       name[32];
  int        n = -1;

  H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
  h5 = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
  if (h5 >= 0 && H5Gget_info(h5, &info) >= 0) n = (int)info.nlinks;
  for (int k = 0; k < n; k++) {
    snprintf(name, sizeof(name), "step_%d/x", k);
    data = H5Dopen2(h5, name, H5P_DEFAULT);
    if (data < 0 || H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, x) < 0) n = -1;
    for (int i = 0; i < 1000 && n >= 0; i++)
      if (x[i] != k + 0.001 * i) n = -1;
    if (data >= 0) H5Dclose(data);
  }
  if (h5 >= 0) H5Fclose(h5);
  return n;
}

static off_t Size(void)
{
  struct stat status;

  Call(stat(path, &status));
  return status.st_size;
}

/* The session in a process of its own that is killed at a call. Returns whether it was. */
static int Killed(DLMAppendFile *file, int from, int to, int call)
{
  int   status;
  pid_t child = fork();

  if (!child) {
    mode  = KILL;
    calls = 0;
    at    = call;
    _exit(Session(file, from, to));
  }
  assert_int_equal(waitpid(child, &status, 0), child);
  assert_true(WIFEXITED(status) && (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 9));
  return WEXITSTATUS(status) == 9;
}

/* Compact and dense tables of the root group, and the step between them; additions, removals of some and of all. */
static const int cases[][2] = {{0, 1}, {3, 4}, {7, 9}, {8, 9}, {9, 10}, {40, 41}, {41, 40}, {9, 8}, {12, 3}, {5, 0}};

static void SurvivesAKillAtEveryCall(void **state)
{
  int kills = 0, unread = 0;

  for (size_t c = 0; c < sizeof(cases) / sizeof(*cases); c++) {
    const int from = cases[c][0], to = cases[c][1];
    for (int call = 1, killed = 1; killed; call++) {
      DLMAppendFile file, next;
      int           found;
      MakeFile(&file);
      assert_int_equal(Session(&file, 0, from), 0);
      killed = Killed(&file, from, to, call);
      found  = CountGroups();
      if (found < 0) assert_int_equal(access(redo, F_OK), 0); /* then the next run knows what to do */
      else assert_true(killed ? found == from || found == to : found == to);
      NewRun(&next);
      assert_int_equal(Session(&next, 0, 0), 0);
      assert_true(CountGroups() == to || (killed && CountGroups() == from));
      assert_int_equal(access(redo, F_OK), -1);
      assert_int_equal(Session(&next, CountGroups(), 50), 0);
      assert_int_equal(CountGroups(), 50);
      kills += killed;
      unread += found < 0;
    }
  }
  print_message("%d kills; after %d of them the file could not be read before the next run\n", kills, unread);
  assert_true(kills > 100);
}

static void IsWhatItWasWhereACallFails(void **state)
{
  int failures = 0;

  for (size_t c = 0; c < sizeof(cases) / sizeof(*cases); c++) {
    const int from = cases[c][0], to = cases[c][1];
    for (int call = 1, struck = 1; struck; call++) {
      DLMAppendFile file;
      int           failed, found;
      MakeFile(&file);
      assert_int_equal(Session(&file, 0, from), 0);
      mode   = FAIL;
      calls  = 0;
      at     = call;
      failed = Session(&file, from, to);
      struck = mode == NEVER;
      mode   = NEVER;
      found  = CountGroups();
      if (found < 0) assert_true(failed && access(redo, F_OK) == 0);
      else assert_true(failed ? found == from || found == to : found == to);
      NewRun(&file);
      assert_int_equal(Session(&file, 0, 0), 0);
      assert_true(CountGroups() == to || (failed && CountGroups() == from));
      failures += struck;
    }
  }
  print_message("%d calls failed\n", failures);
  assert_true(failures > 100);
}

/* A run that lives on after a write that failed, as a full disk has room again: nothing of the failed session comes back. */
static void ForgetsWhatFailed(void **state)
{
  DLMAppendFile file;

  for (int call = 1; call < 4; call++) {
    MakeFile(&file);
    assert_int_equal(Session(&file, 0, 20), 0);
    mode  = FAIL;
    calls = 0;
    at    = call;
    assert_int_equal(Session(&file, 20, 25), ENOSPC);
    assert_int_equal(CountGroups(), 20);
    assert_int_equal(Session(&file, 20, 21), 0);
    assert_int_equal(CountGroups(), 21);
  }
}

/* Changes that belong to another file, or are damaged, are not made. */
static void KnowsWhatIsAboutTheFile(void **state)
{
  DLMAppendFile file;
  char          bytes[1 << 16];
  size_t        n;

  for (int k = 0; k < 2; k++) {
    hid_t reader;
    FILE *f;
    MakeFile(&file);
    assert_int_equal(Session(&file, 0, 12), 0);
    reader = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_int_equal(Session(&file, 12, 13), 0); /* waits */
    H5Fclose(reader);
    f = fopen(redo, "rb");
    assert_non_null(f);
    n = fread(bytes, 1, sizeof(bytes), f);
    fclose(f);
    bytes[n / 2] ^= k;
    NewRun(&file);
    if (!k) {
      MakeFile(&file);
      assert_int_equal(Session(&file, 0, 5), 0);
      NewRun(&file);
    }
    f = fopen(redo, "wb");
    assert_int_equal(fwrite(bytes, 1, n, f), n);
    fclose(f);
    assert_int_equal(Session(&file, 0, 0), 0);
    assert_int_equal(CountGroups(), k ? 12 : 5);
    assert_int_equal(Session(&file, CountGroups(), 14), 0);
    assert_int_equal(CountGroups(), 14);
    assert_int_equal(access(redo, F_OK), -1);
  }
}

/* While another program reads, the file stays as it is: what is added waits, over a kill too; the end of the run does not wait for ever. */
static void WaitsForReaders(void **state)
{
  DLMAppendFile file;
  hid_t         reader;
  int           writer;

  for (int end = 0; end < 3; end++) {
    MakeFile(&file);
    assert_int_equal(Session(&file, 0, 12), 0);
    reader = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    assert_true(reader >= 0);
    for (int k = 12; k < 30; k++) assert_int_equal(Session(&file, k, k + 1), 0);
    H5Fclose(reader);
    assert_int_equal(CountGroups(), 12);
    Call(access(redo, F_OK));
    if (end == 0) assert_int_equal(Session(&file, 30, 31), 0);
    if (end == 1) {
      NewRun(&file);
      assert_int_equal(Session(&file, 30, 31), 0);
    }
    if (end == 2) {
      int fd = open(path, O_RDONLY);
      assert_int_equal(flock(fd, LOCK_SH), 0);
      Call(DLMAppendFinish(&file));
      close(fd);
    }
    assert_int_equal(CountGroups(), end == 2 ? 30 : 31);
    assert_int_equal(access(redo, F_OK), -1);
  }
  writer = open(path, O_RDWR); /* and nobody reads while it changes */
  assert_int_equal(flock(writer, LOCK_EX), 0);
  assert_int_equal(CountGroups(), -1);
  close(writer);
}

/* What a run removes at the end is given back: runs that go on again and again from an early step do not fill the disk. */
static void GivesRemovedGroupsBack(void **state)
{
  DLMAppendFile file;
  off_t         first;

  MakeFile(&file);
  assert_int_equal(Session(&file, 0, 20), 0);
  first = Size();
  for (int k = 0; k < 10; k++) {
    assert_int_equal(Session(&file, 20, 10), 0);
    for (int step = 10; step < 20; step++) assert_int_equal(Session(&file, step, step + 1), 0);
  }
  print_message("20 groups: %ld bytes; after ten times half of them anew: %ld\n", (long)first, (long)Size());
  assert_in_range(Size(), first - first / 10, first + first / 10);
}

int main(int argc, char **argv)
{
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(SurvivesAKillAtEveryCall),
      cmocka_unit_test(IsWhatItWasWhereACallFails),
      cmocka_unit_test(ForgetsWhatFailed),
      cmocka_unit_test(KnowsWhatIsAboutTheFile),
      cmocka_unit_test(WaitsForReaders),
      cmocka_unit_test(GivesRemovedGroupsBack),
  };
  int failed;

  if (PetscInitialize(&argc, &argv, NULL, NULL)) return 1;
  mkdir(folder, 0777);
  failed = cmocka_run_group_tests(tests, NULL, NULL);
  return PetscFinalize() || failed;
}
