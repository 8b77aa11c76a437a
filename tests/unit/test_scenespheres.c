/* A scene's spheres: their file, boxes of any size, bodies that touch or overlap. */
#include <petsctime.h>
#include "scenetest.h"

static void CsvFillsAbsentColumnsFromOptions(void **state)
{
  DLMScene *s;

  WriteFile("full.csv", "\xef\xbb\xbf# made by hand\n\nx3, x1, x2, "
                        "radius,density,motion,V1,V2,V3,omega1,omega2,omega3,F1,F2,F3,T1,T2,T3\r\n"
                        "0.25,0,0,0.1,1.5,free,1,2,3,4,5,6,7,8,9,10,11,12 # the first\n\n"
                        " -0.25 , 0, 0, 0.2,2.5, rotate,0,0,0,4,5,6,7,8,9,10,11,12\n");
  s = Make("-spheres_file @full.csv -sphere_radius 0.3");
  assert_int_equal(s->n_spheres, 2);
  AssertVector(s->spheres[0].center, 0, 0, 0.25);
  AssertVector(s->spheres[0].velocity, 1, 2, 3);
  AssertVector(s->spheres[0].omega, 4, 5, 6);
  AssertVector(s->spheres[0].force, 7, 8, 9);
  AssertVector(s->spheres[0].torque, 10, 11, 12);
  assert_true(s->spheres[0].radius == 0.1 && s->spheres[0].density == 1.5);
  assert_int_equal(s->spheres[0].motion, DLM_MOTION_FREE);
  assert_true(s->spheres[1].radius == 0.2 && s->spheres[1].motion == DLM_MOTION_ROTATE);
  OK(DLMSceneDestroy(&s));

  WriteFile("bare.csv", "x1,x2,x3\n0,0,0\n");
  s = Make("-spheres_file @bare.csv -sphere_radius 0.3 -sphere_density 4 -sphere_motion fixed -sphere_velocity "
           "1,0,0");
  assert_int_equal(s->n_spheres, 1);
  assert_true(s->spheres[0].radius == 0.3 && s->spheres[0].density == 4 &&
              s->spheres[0].motion == DLM_MOTION_FIXED);
  AssertVector(s->spheres[0].velocity, 1, 0, 0);
  OK(DLMSceneDestroy(&s));
}

static void CsvIsFoundBesideTheScene(void **state)
{
  DLMScene *s;

  WriteFile("bare.csv", "x1,x2,x3\n0,0,0\n");
  WriteFile("with_csv.yaml", "spheres_file: bare.csv\n");
  s = Make("@with_csv.yaml");
  assert_int_equal(s->n_spheres, 1);
  OK(DLMSceneDestroy(&s));
}

/* Touching walls, each other and their own images, centres on faces: allowed at any scale, for decimal input.
 */
static void TouchingIsAllowedAtAnyScale(void **state)
{
  static const double scales[] = {1e-6, 1e-3, 1, 7.3, 1e3};
  char                line[512];

  for (int i = 0; i < 5; i++) {
    double    L = scales[i];
    DLMScene *s;

    snprintf(line, sizeof(line),
             "-box_size %.17g,%.17g,%.17g -grid_resolution %.17g -sphere_radius %.17g -sphere_centers "
             "%.17g,0,%.17g,%.17g,0,%.17g,%.17g,0,%.17g",
             L, L, L, 30 / L, 0.1 * L, 0.1 * L, 0.4 * L, -0.1 * L, 0.4 * L, 0.5 * L, -0.4 * L);
    s = Make(line);
    assert_true(s->cells[0] == 30 && s->cells[2] == 30);
    assert_int_equal(s->n_spheres, 3);
    OK(DLMSceneDestroy(&s));
    snprintf(line, sizeof(line),
             "-box_size %.17g,%.17g,%.17g -grid_resolution %.17g -sphere_radius %.17g -sphere_centers 0,0,0", L,
             2 * L, 2 * L, 30 / L, 0.5 * L);
    s = Make(line);
    OK(DLMSceneDestroy(&s));
  }
}

static PetscErrorCode Refuses(const char *text)
{
  DLMScene      *scene;
  PetscErrorCode code;

  OK(PetscOptionsClear(NULL));
  OK(PetscOptionsInsertString(NULL, text));
  OK(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  code = DLMSceneCreate(PETSC_COMM_WORLD, &scene);
  OK(PetscPopErrorHandler());
  return code;
}

/* One large sphere among small ones, in a random place: the cell lists agree with all pairs. */
static void OverlapsAreFoundWhateverTheSizes(void **state)
{
  enum { N = 60 };
  unsigned    seed = 1;
  int         n_refused = 0;
  static char csv[64 * N];
  char        path[PETSC_MAX_PATH_LEN], line[2 * PETSC_MAX_PATH_LEN];

  PathOf("random.csv", path);
  snprintf(line, sizeof(line), "-grid_resolution 100 -spheres_file %s -box_periodic 1,0,1", path);
  for (int trial = 0; trial < 40; trial++) {
    double x[N][3], a[N];
    int    used = 0, n = 0, overlap = 0;

    for (int tries = 0; tries < 400 && n < 20 + trial;
         tries++) { /* the last one goes in whether it overlaps or not */
      a[n] = n == 0 ? 0.3 : 0.02 + 0.03 * (rand_r(&seed) / (double)RAND_MAX);
      overlap = 0;
      for (int d = 0; d < 3; d++)
        x[n][d] = (rand_r(&seed) / (double)RAND_MAX - 0.5) * (d == 1 ? 1 - 2 * a[n] : 1);
      for (int j = 0; j < n; j++) {
        double square = 0;
        for (int d = 0; d < 3; d++) {
          double dx = x[n][d] - x[j][d];
          if (d != 1) dx -= round(dx);
          square += dx * dx;
        }
        overlap |= sqrt(square) < a[n] + a[j];
      }
      if (!overlap || n == 19 + trial) n++;
    }
    used = snprintf(csv, sizeof(csv), "x1,x2,x3,radius\n");
    for (int i = 0; i < n; i++) {
      used += snprintf(csv + used, sizeof(csv) - used, "%.12f,%.12f,%.12f,%.12f\n", x[i][0], x[i][1], x[i][2],
                       a[i]);
    }
    MPI_Barrier(PETSC_COMM_WORLD);
    WriteFile("random.csv", csv);
    assert_int_equal(Refuses(line), overlap && n == 20 + trial ? PETSC_ERR_USER_INPUT : 0);
    n_refused += overlap;
  }
  assert_in_range(n_refused, 5, 35); /* both answers were met */
}

static void ManySpheres(void **state)
{
  enum { M = 47 }; /* M^3 > 1e5 */
  char           path[PETSC_MAX_PATH_LEN];
  PetscMPIInt    rank;
  PetscLogDouble start, end;
  DLMScene      *s;

  PathOf("many.csv", path);
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  if (!rank) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fprintf(file, "x1,x2,x3,radius,density,motion\n");
    for (int i = 0; i < M * M * M; i++) {
      fprintf(file, "%.15g,%.15g,%.15g,0.5,1,free\n", i % M + 0.5 - M / 2., i / M % M + 0.5 - M / 2.,
              i / M / M + 0.5 - M / 2.);
    }
    fclose(file);
  }
  OK(PetscTime(&start));
  s = Make("-box_size 48,48,48 -grid_resolution 4 -spheres_file @many.csv");
  OK(PetscTime(&end));
  assert_int_equal(s->n_spheres, M * M * M);
  assert_true(s->spheres[M * M * M - 1].center[2] == M / 2. - 0.5);
  if (!rank) print_message("%d spheres read and checked in %.2f s\n", M * M * M, end - start);
  assert_true(end - start < 10);
  OK(DLMSceneDestroy(&s));
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(CsvFillsAbsentColumnsFromOptions),
  cmocka_unit_test(CsvIsFoundBesideTheScene),
  cmocka_unit_test(TouchingIsAllowedAtAnyScale),
  cmocka_unit_test(OverlapsAreFoundWhateverTheSizes),
  cmocka_unit_test(ManySpheres),
};

RUN_IN_A_FOLDER(tests)
