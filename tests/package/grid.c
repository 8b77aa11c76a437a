/* A program of a user: the nodes of the grid that a scene asks for. */
#include <dlmsim.h>

int main(int argc, char **argv)
{
  DLMScene     *scene;
  DLMSimulation sim;
  DLMGrid       grid;
  DM            velocity, pressure;
  PetscInt      n[3];

  if (DLMInitialize(argc, argv, NULL)) return 1;
  PetscCall(DLMOptionsInsert(PETSC_COMM_WORLD, argc, argv));
  PetscCall(DLMSceneCreate(PETSC_COMM_WORLD, &scene));
  PetscCall(DLMSimulationCreate(scene, &sim));
  PetscCall(DLMSimulationGetObjects(sim, NULL, &grid, NULL, NULL, NULL));
  PetscCall(DLMGridGetDMs(grid, &velocity, &pressure));
  PetscCall(DMDAGetInfo(velocity, NULL, &n[0], &n[1], &n[2], NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%d x %d x %d nodes\n", (int)n[0], (int)n[1], (int)n[2]));
  PetscCall(DLMSimulationDestroy(&sim));
  PetscCall(DLMSceneDestroy(&scene));
  return PetscFinalize();
}
