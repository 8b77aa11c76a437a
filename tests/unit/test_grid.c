/* The matching DMDAs and who owns a node, against PETSc's own ownership, for every layout of the ranks. */
#include "dlmtest.h"

static const PetscInt cells[3] = { 16, 20, 18 }; /* 9, 11, 10 pressure nodes between walls: uneven on 2, 3 and 4 ranks */

/* Calls test for every combination of periodic axes and every layout, layout 0,0,0 (chosen by the program) included. */
static void ForEveryGrid(void (*test)(DLMGrid))
{
  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (int k = -1;; k++) {
      DLMScene scene;
      DLMGrid  grid;
      MakeScene(PETSC_COMM_WORLD, cells, periodic, &scene);
      if (k >= 0 && !Layout(k, scene.grid_processes)) break;
      Call(DLMGridCreate(&scene, &grid));
      for (int d = 0; d < 3 && k >= 0; d++) AssertAll(grid->processes[d] == scene.grid_processes[d]);
      test(grid);
      Call(DLMGridDestroy(&grid));
    }
}

static void CheckRefinement(DLMGrid grid)
{
  DM        velocity, pressure;
  PetscInt  fs[3], fw[3], cs[3], cw[3], fine[3], coarse[3], dof[2], width[2];
  PetscBool good = PETSC_TRUE;

  Call(DLMGridGetDMs(grid, &velocity, &pressure));
  Call(DMDAGetInfo(velocity, NULL, &fine[0], &fine[1], &fine[2], NULL, NULL, NULL, &dof[0], &width[0], NULL, NULL, NULL, NULL));
  Call(DMDAGetInfo(pressure, NULL, &coarse[0], &coarse[1], &coarse[2], NULL, NULL, NULL, &dof[1], &width[1], NULL, NULL, NULL, NULL));
  AssertAll(dof[0] == 3 && width[0] == 2 && dof[1] == 1 && width[1] == 1);
  Call(DMDAGetCorners(velocity, &fs[0], &fs[1], &fs[2], &fw[0], &fw[1], &fw[2]));
  Call(DMDAGetCorners(pressure, &cs[0], &cs[1], &cs[2], &cw[0], &cw[1], &cw[2]));
  for (int d = 0; d < 3; d++) {
    const PetscInt wall = grid->periodic[d] ? 0 : 1;
    good = (PetscBool)(good && fine[d] == cells[d] + wall && coarse[d] == cells[d] / 2 + wall);
    good = (PetscBool)(good && fs[d] == 2 * cs[d] && fs[d] + fw[d] == PetscMin(2 * (cs[d] + cw[d]), fine[d]));
    good = (PetscBool)(good && cw[d] >= 2); /* the velocity stencil of width 2 reaches the next rank only */
  }
  AssertAll(good);
}

static void VelocityOwnershipRefinesPressureOwnership(void **state)
{
  ForEveryGrid(CheckRefinement);
}

static double NaturalIndex(const PetscInt i[3], int c, const void *context)
{
  const PetscInt *nodes = context;
  return (double)(c + 3 * (i[0] + nodes[0] * (i[1] + nodes[1] * i[2])));
}

/* Writes the natural index of every node into a vector and looks it up at the rank and place that DLMGridLocate names. */
static void CheckLocate(DLMGrid grid)
{
  for (PetscInt coarsening = 1; coarsening <= 2; coarsening++) {
    DM                 dm = coarsening == 1 ? grid->velocity : grid->pressure;
    Vec                v, all;
    VecScatter         gather;
    const PetscScalar *x;
    const PetscInt    *range;
    PetscInt           nodes[3], dof, i[3], wrong = 0;
    Call(DMDAGetInfo(dm, NULL, &nodes[0], &nodes[1], &nodes[2], NULL, NULL, NULL, &dof, NULL, NULL, NULL, NULL, NULL));
    Call(DMCreateGlobalVector(dm, &v));
    FillNodes(dm, NaturalIndex, nodes, v);
    Call(VecScatterCreateToAll(v, &gather, &all));
    Call(VecScatterBegin(gather, v, all, INSERT_VALUES, SCATTER_FORWARD));
    Call(VecScatterEnd(gather, v, all, INSERT_VALUES, SCATTER_FORWARD));
    Call(VecGetOwnershipRanges(v, &range));
    Call(VecGetArrayRead(all, &x));
    for (i[2] = 0; i[2] < nodes[2]; i[2]++)
      for (i[1] = 0; i[1] < nodes[1]; i[1]++)
        for (i[0] = 0; i[0] < nodes[0]; i[0]++) {
          PetscMPIInt rank;
          PetscInt    index, at;
          Call(DLMGridLocate(grid, coarsening, i, &rank, &index));
          at = range[rank] + dof * index;
          wrong += at >= range[rank + 1] || x[at] != NaturalIndex(i, 0, nodes);
        }
    AssertAll(wrong == 0);
    Call(VecRestoreArrayRead(all, &x));
    Call(VecScatterDestroy(&gather));
    Call(VecDestroy(&all));
    Call(VecDestroy(&v));
  }
}

static void LocateAgreesWithPETSc(void **state)
{
  ForEveryGrid(CheckLocate);
}

/* A periodic axis takes any integer: shifted by whole periods, a node stays where it is. */
static void CheckWrap(DLMGrid grid)
{
  for (PetscInt coarsening = 1; coarsening <= 2; coarsening++)
    for (int n = 0; n < 200; n++) {
      PetscInt    inside[3], shifted[3], index[3];
      PetscMPIInt rank[3];
      for (int d = 0; d < 3; d++) {
        const PetscInt period = cells[d] / coarsening;
        inside[d]             = (PetscInt)((0.5 + 0.4999 * Hash(2, 3 * n + d)) * period);
        shifted[d]            = inside[d] + (grid->periodic[d] ? period * ((n + d) % 5 - 2) : 0);
      }
      Call(DLMGridLocate(grid, coarsening, inside, &rank[0], &index[0]));
      Call(DLMGridLocate(grid, coarsening, shifted, &rank[1], &index[1]));
      Call(DLMGridLocate(grid, coarsening, shifted, &rank[2], NULL));
      assert_int_equal(rank[1], rank[0]);
      assert_int_equal(rank[2], rank[0]);
      assert_int_equal(index[1], index[0]);
    }
}

static void LocateWrapsPeriodicAxes(void **state)
{
  ForEveryGrid(CheckWrap);
}

/* The box solver keeps its levels along the last wall axis; the program cuts that axis first. */
static void TheLineIsTheLastWallAxis(void **state)
{
  const PetscInt line[8] = { 2, 2, 2, 2, 1, 1, 0, 2 };
  PetscMPIInt    size;

  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  for (unsigned periodic = 0; periodic < 8; periodic++) {
    DLMScene scene;
    DLMGrid  grid;
    MakeScene(PETSC_COMM_WORLD, cells, periodic, &scene);
    Call(DLMGridCreate(&scene, &grid));
    assert_int_equal(grid->line, line[periodic]);
    assert_int_equal(grid->processes[grid->line], size);
    Call(DLMGridDestroy(&grid));
  }
}

static void AMeshTooThinForSlabsIsCutOnOtherAxes(void **state)
{
  const PetscInt flat[3] = { 8, 24, 4 };
  PetscMPIInt    size;
  DLMScene       scene;
  DLMGrid        grid;

  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  MakeScene(PETSC_COMM_WORLD, flat, 3, &scene);
  Call(DLMGridCreate(&scene, &grid));
  assert_int_equal(grid->processes[2], 1);
  assert_int_equal(grid->processes[0] * grid->processes[1], size);
  Call(DLMGridDestroy(&grid));
}

static void AssertRefused(DLMScene *scene, const char *message)
{
  DLMGrid        grid;
  PetscErrorCode error;

  CallKeepingMessage(error, DLMGridCreate(scene, &grid));
  AssertAll(error == PETSC_ERR_USER_INPUT);
  AssertAll(strstr(last_message, message) != NULL);
}

static void RanksThatCannotShareTheMeshAreRefused(void **state)
{
  const PetscInt small[3] = { 4, 4, 4 };
  PetscMPIInt    size;
  DLMScene       scene;
  char           message[128];

  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  MakeScene(PETSC_COMM_WORLD, cells, 3, &scene);
  scene.grid_processes[0] = size;
  scene.grid_processes[1] = scene.grid_processes[2] = 2;
  snprintf(message, sizeof(message), "-grid_processes %d,2,2 (0: chosen): %d ranks cannot share a mesh of", size, size);
  AssertRefused(&scene, message);
  if (size == 1) return;
  MakeScene(PETSC_COMM_WORLD, small, 3, &scene);
  snprintf(message, sizeof(message), "-grid_processes 0,0,0 (0: chosen): %d ranks cannot share a mesh of 4 x 4 x 4 cells so", size);
  AssertRefused(&scene, message);
  for (int d = 0; d < 3; d++) scene.grid_processes[d] = d == 1 ? size : 1;
  snprintf(message, sizeof(message), "-grid_processes 1,%d,1 (0: chosen): %d ranks cannot share a mesh", size, size);
  AssertRefused(&scene, message);
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(VelocityOwnershipRefinesPressureOwnership),
  cmocka_unit_test(LocateAgreesWithPETSc),
  cmocka_unit_test(LocateWrapsPeriodicAxes),
  cmocka_unit_test(TheLineIsTheLastWallAxis),
  cmocka_unit_test(AMeshTooThinForSlabsIsCutOnOtherAxes),
  cmocka_unit_test(RanksThatCannotShareTheMeshAreRefused),
};

RUN_ON_ALL_RANKS(tests)
