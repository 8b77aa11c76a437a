/*
  The file of checkpoints: what is written is read back; whatever is done to a byte of it, or to its length, it is refused with one message, before HDF5 sees it.
*/
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>
#include "private/checkpoint.h"

#define Call(expression) assert_int_equal(expression, 0)

static char                 path[64], message[512];
static int                  messages;
static PetscMPIInt          rank;
static unsigned char        whole[1 << 20]; /* rank 0: the file */
static size_t               n_whole;

static PetscErrorCode KeepMessage(MPI_Comm comm, int line, const char *function, const char *in, PetscErrorCode code, PetscErrorType type, const char *text, void *context)
{
  if (type != PETSC_ERROR_INITIAL) return code;
  snprintf(message, sizeof(message), "%s", text);
  messages++;
  return code;
}

/* One list writes and reads, as in src/io/checkpoint.c. */
static void Move(DLMCheckpointFile *file, DM dm, Vec v, char text[DLM_CHECKPOINT_TEXT], PetscInt ints[2], PetscReal reals[3], PetscBool *flag)
{
  Call(DLMCheckpointText(file, "scene/key", text));
  Call(DLMCheckpointInts(file, "a/ints", 2, ints));
  Call(DLMCheckpointReals(file, "a/reals", 3, reals));
  Call(DLMCheckpointBool(file, "flag", flag));
  Call(DLMCheckpointField(file, "fluid/v", dm, NULL, v));
}

static void ReadsWhatWasWritten(void **state)
{
  char               text[DLM_CHECKPOINT_TEXT] = "as the user wrote it";
  PetscInt           ints[2]  = { 7, -3 };
  PetscReal          reals[3] = { 0.1, 1e300, -0.0 };
  PetscBool          flag     = PETSC_TRUE;
  DLMCheckpointFile *file;
  DM                 dm;
  Vec                v, w;
  int                failed;
  PetscReal          difference;

  Call(DMDACreate3d(PETSC_COMM_WORLD, DM_BOUNDARY_PERIODIC, DM_BOUNDARY_PERIODIC, DM_BOUNDARY_NONE, DMDA_STENCIL_BOX, 6, 8, 5, PETSC_DECIDE, PETSC_DECIDE, PETSC_DECIDE, 3, 1, NULL,
                    NULL, NULL, &dm));
  Call(DMSetUp(dm));
  Call(DMCreateGlobalVector(dm, &v));
  Call(VecDuplicate(v, &w));
  Call(VecSetRandom(v, NULL));
  Call(DLMCheckpointFileCreate(PETSC_COMM_WORLD, path, &file));
  Move(file, dm, v, text, ints, reals, &flag);
  Call(DLMCheckpointFileSave(file, &failed));
  assert_int_equal(failed, 0);
  Call(DLMCheckpointFileDestroy(&file));

  memset(text, 0, sizeof(text));
  ints[0] = ints[1] = 0;
  reals[0] = reals[1] = reals[2] = 1.0;
  flag = PETSC_FALSE;
  Call(DLMCheckpointFileOpen(PETSC_COMM_WORLD, path, &file));
  Move(file, dm, w, text, ints, reals, &flag);
  Call(DLMCheckpointFileDestroy(&file));
  assert_string_equal(text, "as the user wrote it");
  assert_true(ints[0] == 7 && ints[1] == -3 && reals[0] == 0.1 && reals[1] == 1e300 && reals[2] == 0.0 && flag == PETSC_TRUE);
  Call(VecAXPY(w, -1.0, v));
  Call(VecNorm(w, NORM_INFINITY, &difference));
  assert_true(difference == 0.0);
  Call(VecDestroy(&v));
  Call(VecDestroy(&w));
  Call(DMDestroy(&dm));
  if (rank == 0) {
    FILE *in = fopen(path, "rb");
    n_whole  = fread(whole, 1, sizeof(whole), in);
    fclose(in);
  }
  MPI_Bcast(&n_whole, sizeof(n_whole), MPI_BYTE, 0, PETSC_COMM_WORLD);
}

/* The file with its first n bytes as given, on rank 0. */
static void Put(const unsigned char *bytes, size_t n)
{
  if (rank == 0) {
    FILE *out = fopen(path, "wb");
    assert_int_equal(fwrite(bytes, 1, n, out), n);
    fclose(out);
  }
}

/* One message of one line, which begins as it should, on every rank; the file is not opened. */
static void Refused(const char *what)
{
  DLMCheckpointFile *file;

  messages = 0;
  Call(PetscPushErrorHandler(KeepMessage, NULL));
  assert_int_equal(DLMCheckpointFileOpen(PETSC_COMM_WORLD, path, &file), PETSC_ERR_USER_INPUT);
  Call(PetscPopErrorHandler());
  assert_int_equal(messages, 1);
  assert_null(strchr(message, '\n'));
  assert_int_equal(strncmp(message, "-restart ", 9), 0);
  assert_non_null(strstr(message, "; allowed: "));
  if (what && !strstr(message, what)) fail_msg("%s: no %s", message, what);
}

/* Every bit of the head, the bits around its end and at the end of the file, and bits anywhere. */
static void RefusesEveryFlippedBit(void **state)
{
  size_t flips = 0;
  int    fd    = -1;

  Put(whole, n_whole);
  if (rank == 0) fd = open(path, O_WRONLY);
  for (size_t k = 0; k < 8 * 600 + 64 + 1000; k++) {
    size_t bit = k < 4800 ? k : k < 4864 ? 8 * n_whole - (k - 4799) : (k * UINT64_C(2654435761)) % (8 * n_whole);
    if (rank == 0) {
      unsigned char byte = whole[bit / 8] ^ (unsigned char)(1u << bit % 8);
      assert_int_equal(pwrite(fd, &byte, 1, (off_t)(bit / 8)), 1);
    }
    Refused(NULL);
    if (rank == 0) assert_int_equal(pwrite(fd, &whole[bit / 8], 1, (off_t)(bit / 8)), 1);
    flips++;
  }
  if (rank == 0) close(fd);
  if (rank == 0) print_message("%zu flipped bits of a checkpoint of %zu bytes refused\n", flips, n_whole);
}

static void RefusesOtherLengths(void **state)
{
  for (size_t n = 0; n < n_whole; n += n < 1024 ? 1 : 997) {
    Put(whole, n);
    Refused(n < 512 ? "is not a checkpoint, or its beginning is lost" : "is damaged: it has");
  }
  Put(whole, n_whole - 1);
  Refused("is damaged: it has");
  if (rank == 0) whole[n_whole] = 0;
  Put(whole, n_whole + 1);
  Refused("is damaged: it has");
}

/* Of another version, and files that are something else. */
static void RefusesOtherFiles(void **state)
{
  static unsigned char other[1 << 16];
  char                *head = (char *)other;

  snprintf(head, 512, "dlmfd checkpoint\nformat 1\nprogram 0.0.1\nbytes 512\ncrc64 0123456789abcdef\n");
  Put(other, 512);
  Refused("has format 1, written by dlmfd 0.0.1; allowed: format 4, that of this dlmfd ");
  for (unsigned seed = 0; seed < 200; seed++) { /* noise, behind ever more of a head */
    srand(seed);
    for (size_t k = 0; k < sizeof(other); k++) other[k] = (unsigned char)rand();
    if (seed % 4) memcpy(other, "dlmfd checkpoint\nformat 4\nprogram 0.1.0\nbytes 9999999999999999999999\ncrc64 zz\n", 17 + seed % 4 * 13);
    Put(other, sizeof(other) >> seed % 9);
    Refused(NULL);
  }
  if (rank == 0) unlink(path);
  if (rank == 0) assert_int_equal(mkfifo(path, 0666), 0);
  Refused("is not a checkpoint");
  if (rank == 0) unlink(path);
  if (rank == 0) assert_int_equal(mkdir(path, 0777), 0);
  Refused("cannot be read (Is a directory)");
  if (rank == 0) rmdir(path);
  MPI_Barrier(PETSC_COMM_WORLD);
  Refused("cannot be read (No such file or directory)");
}

int main(int argc, char **argv)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(ReadsWhatWasWritten),
    cmocka_unit_test(RefusesEveryFlippedBit),
    cmocka_unit_test(RefusesOtherLengths),
    cmocka_unit_test(RefusesOtherFiles),
  };
  PetscMPIInt ranks;
  int         failed;

  if (PetscInitialize(&argc, &argv, NULL, NULL)) return 1;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  snprintf(path, sizeof(path), "test_checkpoint_%d.h5", ranks);
  failed = cmocka_run_group_tests(tests, NULL, NULL);
  return PetscFinalize() || failed;
}
