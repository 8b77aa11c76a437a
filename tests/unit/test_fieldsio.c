/*
  Field files: known fields written in two steps and read back through HDF5; restart; what cannot be written or read; messages. Leaves its files in
  fieldsio_<ranks>/ for tests/scenes/check_xdmf.py.
*/
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <errno.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>
#include "private/dlmfieldsio.h"

#define Call(expression) assert_int_equal(expression, 0)

/* Unequal on purpose: a transposed axis cannot go unnoticed. x1, x2 periodic. */
static const PetscInt  fine[3] = {8, 6, 5}, coarse[3] = {4, 3, 3};
static const PetscBool periodic[3] = {PETSC_TRUE, PETSC_TRUE, PETSC_FALSE};
static const PetscReal origin[3] = {-0.8, -0.6, -0.4}, h[3] = {0.2, 0.2, 0.2}, h2[3] = {0.4, 0.4, 0.4};
enum { POINTS = 28 };
static char            dir[64], message[512];
static PetscMPIInt     rank;

/* Component c at node (i, j, k): linear, all different. */
static double Value(const PetscInt n[3], PetscInt i, PetscInt j, PetscInt k, PetscInt c, double time)
{
  return time + (i % n[0]) + 100.0 * (j % n[1]) + 10000.0 * k + 0.125 * c;
}

static void MakeDA(const PetscInt n[3], PetscInt dof, DM *da)
{
  Call(DMDACreate3d(PETSC_COMM_WORLD, DM_BOUNDARY_PERIODIC, DM_BOUNDARY_PERIODIC, DM_BOUNDARY_NONE,
                    DMDA_STENCIL_BOX, n[0], n[1], n[2], PETSC_DECIDE, PETSC_DECIDE, PETSC_DECIDE, dof, 1, NULL,
                    NULL, NULL, da));
  Call(DMSetUp(*da));
}

static void WriteField(DLMFieldFile file, const char *mesh, const char *name, const PetscInt n[3], PetscInt dof,
                       double time)
{
  DM              da;
  Vec             v;
  PetscInt        s[3], w[3];
  PetscScalar ****a;

  MakeDA(n, dof, &da);
  Call(DMCreateGlobalVector(da, &v));
  Call(DMDAGetCorners(da, &s[0], &s[1], &s[2], &w[0], &w[1], &w[2]));
  Call(DMDAVecGetArrayDOF(da, v, &a));
  for (PetscInt k = s[2]; k < s[2] + w[2]; k++)
    for (PetscInt j = s[1]; j < s[1] + w[1]; j++)
      for (PetscInt i = s[0]; i < s[0] + w[0]; i++)
        for (PetscInt c = 0; c < dof; c++) a[k][j][i][c] = Value(n, i, j, k, c, time);
  Call(DMDAVecRestoreArrayDOF(da, v, &a));
  Call(DLMFieldFileWriteVec(file, mesh, name, da, NULL, v));
  Call(VecDestroy(&v));
  Call(DMDestroy(&da));
}

/* Two sets of points; point i of the second one is at (time + i, -i, 0.5 i) and belongs to i mod 3. */
static void WritePoints(DLMFieldFile file, double time)
{
  const PetscReal x[6] = {time, 1, 2, 3, 4, 5}, radius[2] = {0.1, 0.2}, V[6] = {1, 0, 0, -1, 0, 0};
  PetscReal       y[3 * POINTS];
  int             owner[POINTS];

  for (int i = 0; i < POINTS; i++) {
    owner[i] = i % 3;
    for (int d = 0; d < 3; d++) y[3 * i + d] = d == 0 ? time + i : d == 1 ? -i : 0.5 * i;
  }
  Call(DLMFieldFileWritePoints(file, "spheres", 2, 3, (DLMPointArray[]){{"center", 3, x}, {"radius", 1, radius}, {"velocity", 3, V}}));
  Call(DLMFieldFileWritePoints(file, "points", POINTS, 3, (DLMPointArray[]){{"place", 3, y}, {"owner", 0, owner}, {"twice", 3, y}}));
  Call(DLMFieldFileWritePoints(file, "nothing", 0, 3, (DLMPointArray[]){{"place", 3, y}}));
}

/* Returns what DLMFieldFileEndStep says, and the path. */
static char failed_path[PETSC_MAX_PATH_LEN];

static int WriteStep(DLMFieldFile file, PetscInt step, double time)
{
  int failed;

  Call(DLMFieldFileBeginStep(file, step, time));
  WriteField(file, "velocity", "velocity", fine, 3, time);
  WriteField(file, "velocity", "conformation", fine, 6, time);
  WriteField(file, "pressure", "pressure", coarse, 1, time);
  WritePoints(file, time);
  Call(DLMFieldFileEndStep(file, &failed, failed_path));
  return failed;
}

static void Open(PetscInt keep_through, DLMFieldFile *file)
{
  Call(DLMFieldFileCreate(PETSC_COMM_WORLD, dir, keep_through, file));
  Call(DLMFieldFileAddMesh(*file, "velocity", fine, origin, h, periodic));
  Call(DLMFieldFileAddMesh(*file, "pressure", coarse, origin, h2, periodic));
}

/* Serial read of a whole dataset; asserts its shape, given without trailing zeros. */
static double *Read(hid_t h5, const char *path, hsize_t d0, hsize_t d1, hsize_t d2, hsize_t d3)
{
  hsize_t want[4] = {d0, d1, d2, d3}, dims[4] = {0, 0, 0, 0}, n = 1;
  hid_t   data = H5Dopen2(h5, path, H5P_DEFAULT), space = H5Dget_space(data);
  double *values;

  assert_true(data >= 0);
  H5Sget_simple_extent_dims(space, dims, NULL);
  assert_memory_equal(dims, want, sizeof(dims));
  for (int i = 0; i < 4 && dims[i]; i++) n *= dims[i];
  values = malloc(n * sizeof(double));
  assert_true(H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0);
  H5Sclose(space);
  H5Dclose(data);
  return values;
}

static void CheckField(hid_t h5, const char *path, const PetscInt n[3], PetscInt dof, double time)
{
  PetscInt m[3] = {n[0] + 1, n[1] + 1, n[2]};
  double  *values = Read(h5, path, (hsize_t)m[2], (hsize_t)m[1], (hsize_t)m[0], dof == 1 ? 0 : (hsize_t)dof),
         *v = values;

  for (PetscInt k = 0; k < m[2]; k++)
    for (PetscInt j = 0; j < m[1]; j++)
      for (PetscInt i = 0; i < m[0]; i++)
        for (PetscInt c = 0; c < dof; c++) assert_true(*v++ == Value(n, i, j, k, c, time));
  free(values);
}

static void CheckPoints(hid_t h5, PetscInt step, double time)
{
  static const char *const names[4] = {"place", "twice", "id", "owner"};
  char                     path[64];

  for (int k = 0; k < 4; k++) {
    double *values;
    snprintf(path, sizeof(path), DLM_STEP_NAME "/points/%s", step, names[k]);
    values = Read(h5, path, POINTS, k < 2 ? 3 : 0, 0, 0);
    for (int i = 0; i < POINTS; i++) {
      if (k < 2) assert_true(values[3 * i] == time + i && values[3 * i + 1] == -i && values[3 * i + 2] == 0.5 * i);
      else assert_true(values[i] == (k == 2 ? i : i % 3));
    }
    free(values);
  }
}

static void CheckStep(hid_t h5, PetscInt step, double time)
{
  char    path[64];
  double  got;
  double *x;
  hid_t   attribute;

  snprintf(path, sizeof(path), DLM_STEP_NAME, step);
  attribute = H5Aopen_by_name(h5, path, "time", H5P_DEFAULT, H5P_DEFAULT);
  assert_true(H5Aread(attribute, H5T_NATIVE_DOUBLE, &got) >= 0);
  H5Aclose(attribute);
  assert_true(got == time);
  snprintf(path, sizeof(path), DLM_STEP_NAME "/velocity", step);
  CheckField(h5, path, fine, 3, time);
  snprintf(path, sizeof(path), DLM_STEP_NAME "/conformation", step);
  CheckField(h5, path, fine, 6, time);
  snprintf(path, sizeof(path), DLM_STEP_NAME "/pressure", step);
  CheckField(h5, path, coarse, 1, time);
  snprintf(path, sizeof(path), DLM_STEP_NAME "/spheres/center", step);
  x = Read(h5, path, 2, 3, 0, 0);
  assert_true(x[0] == time && x[5] == 5);
  free(x);
  CheckPoints(h5, step, time);
}

static hid_t OpenSerially(void)
{
  char path[128];

  snprintf(path, sizeof(path), "%s/fields.h5", dir);
  return H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
}

/* The text of fields.xmf, and how often it holds a word. */
static char xmf[65536];

static void ReadXmf(void)
{
  char  path[128];
  FILE *in;

  snprintf(path, sizeof(path), "%s/fields.xmf", dir);
  in = fopen(path, "r");
  assert_non_null(in);
  xmf[fread(xmf, 1, sizeof(xmf) - 1, in)] = 0;
  fclose(in);
}

static int CountInXmf(const char *word)
{
  int n = 0;

  for (const char *at = xmf; (at = strstr(at, word)); at++) n++;
  return n;
}

static void WritesWhatItWasGiven(void **state)
{
  DLMFieldFile file;

  Open(-1, &file);
  assert_int_equal(WriteStep(file, 0, 0.0), 0);
  assert_int_equal(WriteStep(file, 10, 0.2), 0);
  Call(DLMFieldFileDestroy(&file));
  assert_null(file);
  if (rank == 0) {
    hid_t h5 = OpenSerially();
    CheckStep(h5, 0, 0.0);
    CheckStep(h5, 10, 0.2);
    H5Fclose(h5);
    ReadXmf();
    assert_int_equal(CountInXmf("<Time "), 2);
    assert_non_null(strstr(xmf, "<DataItem Dimensions=\"5 7 9 3\""));
    assert_non_null(strstr(xmf, "<Topology TopologyType=\"3DCoRectMesh\" Dimensions=\"3 4 5\"/>"));
  }
}

/* Two more steps, then a restart from step 20: step 30 goes, 0 to 20 stay, 40 is added; the XDMF text says the
 * same. */
static void ContinuesAfterARestart(void **state)
{
  DLMFieldFile file;

  Open(10, &file);
  assert_int_equal(WriteStep(file, 20, 0.4), 0);
  assert_int_equal(WriteStep(file, 30, 0.6), 0);
  Call(DLMFieldFileDestroy(&file));
  Open(20, &file);
  assert_int_equal(WriteStep(file, 20, 0.4), 0);
  assert_int_equal(WriteStep(file, 40, 0.8), 0);
  Call(DLMFieldFileDestroy(&file));
  if (rank == 0) {
    hid_t h5 = OpenSerially();
    for (int step = 0; step <= 20; step += 10) CheckStep(h5, step, 0.02 * step);
    CheckStep(h5, 40, 0.8);
    assert_int_equal(H5Lexists(h5, "step_0000030", H5P_DEFAULT), 0);
    H5Fclose(h5);
    ReadXmf();
    assert_int_equal(CountInXmf("<Time "), 4);
    assert_int_equal(CountInXmf("Name=\"velocity\" AttributeType=\"Vector\""), 8);
    assert_int_equal(CountInXmf("Name=\"twice\" AttributeType=\"Vector\""), 4);
    assert_int_equal(CountInXmf("Name=\"owner\" AttributeType=\"Scalar\""), 4);
    assert_int_equal(CountInXmf("/points/place<"), 4);
    assert_int_equal(CountInXmf("Grid Name=\"nothing\""), 0);
    assert_int_equal(CountInXmf("AttributeType=\"Matrix\""), 4);
    assert_int_equal(CountInXmf("step_0000030"), 0);
  }
}

static PetscErrorCode KeepMessage(MPI_Comm comm, int line, const char *function, const char *in,
                                  PetscErrorCode code, PetscErrorType type, const char *text, void *context)
{
  if (type == PETSC_ERROR_INITIAL) snprintf(message, sizeof(message), "%s", text);
  return code;
}

static void NamesWhatIsWrong(void **state)
{
  const PetscInt other[3] = {8, 6, 7};
  DLMFieldFile   file;
  DM             da;
  Vec            v;

  Call(PetscPushErrorHandler(KeepMessage, NULL));
  assert_int_equal(DLMFieldFileCreate(PETSC_COMM_WORLD, "no/such/folder", -1, &file), PETSC_ERR_USER_INPUT);
  assert_string_equal(message, "-output_dir no/such/folder: cannot write no/such/folder/fields.xmf (No such file or directory); allowed: a folder that can be written, with space");

  Open(40, &file);
  MakeDA(other, 3, &da);
  Call(DMCreateGlobalVector(da, &v));
  assert_int_equal(DLMFieldFileWriteVec(file, "velocity", "u", da, NULL, v), PETSC_ERR_ARG_SIZ);
  assert_string_equal(message, "Field u has 7 nodes along x3, mesh velocity has 5");
  assert_int_equal(DLMFieldFileWriteVec(file, "stress", "u", da, NULL, v), PETSC_ERR_ARG_WRONG);
  assert_string_equal(message, "Field u: no mesh named stress");
  Call(PetscPopErrorHandler());
  Call(VecDestroy(&v));
  Call(DMDestroy(&da));
  Call(DLMFieldFileDestroy(&file));
}

static void InDir(const char *name, char path[128])
{
  snprintf(path, 128, "%s/%s", dir, name);
}

/* A folder in the way of what brings an output into fields.h5, and of fields.xmf: errno and the path on every rank; the files are whole, and the next output
   succeeds. */
static void SaysWhatCannotBeWritten(void **state)
{
  DLMFieldFile file;
  char         way[128];

  Open(40, &file);
  for (int k = 0; k < 2; k++) {
    InDir(k ? "fields.xmf.new" : "fields.h5.redo.new", way);
    if (rank == 0) assert_int_equal(mkdir(way, 0777), 0);
    assert_int_equal(WriteStep(file, 50, 1.0), EISDIR);
    if (rank == 0) {
      hid_t h5;
      assert_int_equal(strncmp(failed_path, way, strlen(failed_path)), 0);
      assert_int_equal(rmdir(way), 0);
      ReadXmf();
      assert_int_equal(CountInXmf("<Time "), 4);
      h5 = OpenSerially();
      CheckStep(h5, 40, 0.8);
      assert_int_equal(H5Lexists(h5, "step_0000050", H5P_DEFAULT), k);
      H5Fclose(h5);
    }
  }
  assert_int_equal(WriteStep(file, 50, 1.0), 0);
  ReadXmf();
  assert_int_equal(CountInXmf("<Time "), 5);
  Call(DLMFieldFileDestroy(&file));
}

/* A file of the folder, up to 1 MiB, on rank 0. */
static size_t Load(const char *name, unsigned char bytes[1 << 20])
{
  char   path[128];
  size_t n;
  FILE  *in;

  InDir(name, path);
  in = fopen(path, "rb");
  assert_non_null(in);
  n = fread(bytes, 1, 1 << 20, in);
  fclose(in);
  return n;
}

static void Save(const char *name, const unsigned char *bytes, size_t n)
{
  char  path[128];
  FILE *out;

  InDir(name, path);
  out = fopen(path, "r+b"); /* the same inode */
  if (!out) out = fopen(path, "wb");
  assert_non_null(out);
  assert_int_equal(fwrite(bytes, 1, n, out), n);
  fclose(out);
  assert_int_equal(truncate(path, (off_t)n), 0);
}

static unsigned char before[1 << 20], torn[1 << 20];

/* Another program that writes to the file is noticed. */
static void SeesThatTheFileWasChanged(void **state)
{
  DLMFieldFile file;
  size_t       n = 0;

  Open(50, &file);
  if (rank == 0) {
    n = Load("fields.h5", before);
    Save("fields.h5", before, n + 1);
  }
  assert_int_equal(WriteStep(file, 60, 1.2), DLM_FILE_CHANGED);
  if (rank == 0) Save("fields.h5", before, n);
  assert_int_equal(WriteStep(file, 60, 1.2), 0);
  Call(DLMFieldFileDestroy(&file));
}

static herr_t OpenObject(hid_t group, const char *name, const H5L_info_t *info, void *context)
{
  hid_t  object = H5Oopen(group, name, H5P_DEFAULT);
  herr_t status = object < 0 ? -1 : 0;

  if (status == 0 && H5Iget_type(object) == H5I_GROUP) status = H5Literate(object, H5_INDEX_NAME, H5_ITER_NATIVE, NULL, OpenObject, context);
  if (object >= 0) H5Oclose(object);
  ++*(int *)context;
  return status;
}

/* Everything in the file opens; returns how much that is. */
static int CountWhole(void)
{
  hid_t h5 = OpenSerially();
  int   n = 0;

  assert_true(h5 >= 0);
  assert_int_equal(H5Literate(h5, H5_INDEX_NAME, H5_ITER_NATIVE, NULL, OpenObject, &n), 0);
  H5Fclose(h5);
  return n;
}

/* The byte to damage: the beginning, anywhere, in the header of some object. */
static size_t Target(size_t k, size_t n)
{
  size_t at = (k * 7919) % n, left = n;

  if (k < 100) return k;
  if (k < 200) return at;
  while (left-- && memcmp(before + at, "OHDR", 4)) at = (at + 1) % (n - 4);
  return at + 6 + k % 20;
}

/* Whatever is damaged: a restart names the file, or everything that it keeps can be read; never a crash. */
static void NamesADamagedFile(void **state)
{
  PetscErrorCode ierr;
  DLMFieldFile   file;
  size_t         n = 0, refused = 0;
  int            objects = 0;

  Open(50, &file); /* drops 60 */
  Call(DLMFieldFileDestroy(&file));
  Call(PetscPushErrorHandler(KeepMessage, NULL));
  if (rank == 0) {
    n       = Load("fields.h5", before);
    objects = CountWhole();
  }
  for (size_t k = 0; k < 300; k++) { /* or a shorter file */
    if (rank == 0) {
      const size_t at = Target(k, n);
      memcpy(torn, before, n);
      torn[at] ^= 0x5a;
      Save("fields.h5", torn, k % 10 ? n : at);
    }
    ierr = DLMFieldFileCreate(PETSC_COMM_WORLD, dir, 50, &file);
    assert_true(ierr == 0 || ierr == PETSC_ERR_USER_INPUT);
    if (ierr) assert_non_null(strstr(message, "fields.h5 is damaged, and -restart goes on in it; allowed: a whole file, or none"));
    else {
      Call(DLMFieldFileDestroy(&file));
      if (rank == 0) assert_int_equal(CountWhole(), objects);
    }
    refused += ierr != 0;
  }
  print_message("%zu of 300 damaged files refused\n", refused);
  assert_in_range(refused, 60, 299);
  if (rank == 0) Save("fields.h5", before, n);
  Call(PetscPopErrorHandler());
  Open(40, &file); /* drops 50: what stays is what check_xdmf.py counts */
  Call(DLMFieldFileDestroy(&file));
}

int main(int argc, char **argv)
{
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(WritesWhatItWasGiven),
      cmocka_unit_test(ContinuesAfterARestart),
      cmocka_unit_test(NamesWhatIsWrong),
      cmocka_unit_test(SaysWhatCannotBeWritten),
      cmocka_unit_test(SeesThatTheFileWasChanged),
      cmocka_unit_test(NamesADamagedFile),
  };
  PetscMPIInt ranks;
  int         failed;

  if (PetscInitialize(&argc, &argv, NULL, NULL)) return 1;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  snprintf(dir, sizeof(dir), "fieldsio_%d", ranks);
  if (rank == 0) {
    char way[128];
    mkdir(dir, 0777);
    InDir("fields.xmf.new", way); /* that a run of these tests left, if it was stopped */
    rmdir(way);
    InDir("fields.h5.redo.new", way);
    rmdir(way);
  }
  MPI_Barrier(PETSC_COMM_WORLD);
  failed = cmocka_run_group_tests(tests, NULL, NULL);
  return PetscFinalize() || failed;
}
