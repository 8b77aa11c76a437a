/* dlmfd: rigid spheres in bounded shear flows of viscoelastic fluids. The program at a glance. */
#include <dlmsim.h>
#include <dlmversion.h>

static const char help[] = "Rigid spheres in bounded shear flows: distributed Lagrange multipliers on a uniform mesh.\n"
                           "  dlmfd SCENE.yaml [-key value ...]        or        mpirun -n 2 dlmfd SCENE.yaml [-key value ...]\n"
                           "  dlmfd -version        version, build and libraries\n\n";

static PetscErrorCode Run(int argc, char **argv, PetscBool *stopped)
{
  const MPI_Comm comm = PETSC_COMM_WORLD;
  DLMScene      *scene;
  DLMSimulation  sim;
  PetscBool      table, only_help;
  PetscMPIInt    rank;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (DLMOptionsAskVersion(argc, argv)) {
    if (rank == 0) PetscCall(DLMVersionPrint(stdout));
    PetscFunctionReturn(0);
  }
  PetscCall(DLMOptionsInsert(comm, argc, argv));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-options_table", &table));
  if (table) {
    if (rank == 0) PetscCall(DLMSceneWriteOptionsTable(stdout));
    PetscFunctionReturn(0);
  }
  PetscCall(DLMSceneCreate(comm, &scene));
  PetscCall(DLMSimulationSettle(scene));
  PetscCall(PetscOptionsHasHelp(NULL, &only_help));
  if (scene->dry_run && !only_help) {
    PetscCall(DLMSimulationDryRun(scene));
    PetscCall(DLMSceneDestroy(&scene));
    PetscFunctionReturn(0);
  }
  PetscCall(DLMSimulationCreate(scene, &sim));
  if (!only_help) {
    PetscCall(DLMSceneCheckUnused(comm));
    PetscCall(DLMSceneView(scene, PETSC_VIEWER_STDOUT_WORLD));
    PetscCall(DLMSimulationView(sim, PETSC_VIEWER_STDOUT_WORLD));
    PetscCall(DLMSimulationSolve(sim));
    PetscCall(DLMSimulationGetStopped(sim, stopped));
  }
  PetscCall(DLMSimulationDestroy(&sim));
  PetscCall(DLMSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscErrorCode ierr;
  PetscBool      stopped = PETSC_FALSE;

  if (DLMInitialize(argc, argv, help)) return 1;
  if (PetscPushErrorHandler(DLMErrorHandler, NULL)) return 1;
  ierr = Run(argc, argv, &stopped);
  if (ierr && (ierr == PETSC_ERR_MEM || !DLMErrorIsUsers())) MPI_Abort(MPI_COMM_WORLD, DLMErrorIsUsers() ? 2 : 1); /* the other ranks do not know */
  if (PetscFinalize()) return 1;
  return ierr ? 2 : (stopped ? 3 : 0); /* 3: a signal ended the run, -restart continues it */
}
