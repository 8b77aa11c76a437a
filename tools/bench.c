/*
  The benchmark behind tools/bench: copies of the velocity vector (the unit), Stokes solves, cold and warm steps of a two-sphere scene. Prints one
  CSV row per measurement: name, seconds (the least of the repetitions, the slowest rank), ratio to the copy.
*/
#include <sys/resource.h>
#include <petsctime.h>
#include <dlmsim.h>

typedef struct {
  MPI_Comm  comm;
  PetscReal unit;
} Bench;

static PetscErrorCode Report(Bench *b, const char *name, PetscReal seconds)
{
  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(b->comm, "%s,%.6g,%.1f\n", name, (double)seconds, (double)(b->unit > 0.0 ? seconds / b->unit : 1.0)));
  PetscFunctionReturn(0);
}

/* Seconds of one call, from the first rank that starts to the last that ends. */
static PetscErrorCode Clock(Bench *b, PetscErrorCode (*work)(void *), void *context, PetscReal *seconds)
{
  PetscLogDouble start, end;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Barrier(b->comm));
  PetscCall(PetscTime(&start));
  PetscCall(work(context));
  PetscCallMPI(MPI_Barrier(b->comm));
  PetscCall(PetscTime(&end));
  *seconds = end - start;
  PetscFunctionReturn(0);
}

static PetscErrorCode Least(Bench *b, PetscInt n, PetscErrorCode (*work)(void *), void *context, PetscReal *least)
{
  PetscFunctionBeginUser;
  *least = PETSC_MAX_REAL;
  for (PetscInt i = 0; i < n; i++) {
    PetscReal seconds;
    PetscCall(Clock(b, work, context, &seconds));
    *least = PetscMin(*least, seconds);
  }
  PetscFunctionReturn(0);
}

typedef struct {
  DLMStokes stokes;
  Vec       a, b;
} Pair;

static PetscErrorCode Copy(void *context)
{
  PetscFunctionBeginUser;
  PetscCall(VecCopy(((Pair *)context)->a, ((Pair *)context)->b));
  PetscFunctionReturn(0);
}

static PetscErrorCode StokesSolve(void *context)
{
  PetscFunctionBeginUser;
  PetscCall(DLMStokesSolve(((Pair *)context)->stokes, ((Pair *)context)->a, ((Pair *)context)->b));
  PetscFunctionReturn(0);
}

static PetscErrorCode Step(void *context)
{
  PetscFunctionBeginUser;
  PetscCall(TSStep((TS)context));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(int argc, char **argv)
{
  Bench          b = { PETSC_COMM_WORLD, 0.0 };
  DLMScene      *scene;
  DLMSimulation  sim;
  DLMSaddle      saddle;
  DLMSaddleWork  work;
  TS             ts;
  Pair           copy, solve;
  Vec            rhs, u;
  PetscReal      seconds, memory;
  PetscLogDouble start, end;
  struct rusage  usage;

  PetscFunctionBeginUser;
  PetscCall(DLMOptionsInsert(b.comm, argc, argv));
  PetscCall(DLMSceneCreate(b.comm, &scene));
  PetscCall(DLMSimulationSettle(scene));
  PetscCall(PetscTime(&start));
  PetscCall(DLMSimulationCreate(scene, &sim));
  PetscCall(PetscTime(&end));
  PetscCall(DLMSimulationGetObjects(sim, &ts, NULL, &solve.stokes, NULL, &saddle));
  PetscCall(DLMStokesGetWallForce(solve.stokes, &rhs));
  PetscCall(VecDuplicate(rhs, &solve.a));
  PetscCall(VecCopy(rhs, solve.a));
  PetscCall(VecDuplicate(rhs, &solve.b));
  PetscCall(DLMStokesGetParts(solve.stokes, rhs, &u, NULL));
  PetscCall(VecDuplicate(u, &copy.a));
  PetscCall(VecCopy(u, copy.a));
  PetscCall(DLMStokesRestoreParts(solve.stokes, rhs, &u, NULL));
  PetscCall(VecDuplicate(copy.a, &copy.b));
  PetscCall(Least(&b, 20, Copy, &copy, &b.unit));
  PetscCall(Report(&b, "copy", b.unit));
  PetscCall(Report(&b, "set_up", end - start));
  PetscCall(Least(&b, scene->stokes_block_limit > 0 ? 5 : 1, StokesSolve, &solve, &seconds));
  PetscCall(Report(&b, "stokes_solve", seconds));
  PetscCall(Clock(&b, Step, ts, &seconds));
  PetscCall(Report(&b, "step_cold", seconds));
  PetscCall(Least(&b, 3, Step, ts, &seconds));
  PetscCall(Report(&b, "step_warm", seconds));
  PetscCall(DLMSaddleGetWork(saddle, &work));
  getrusage(RUSAGE_SELF, &usage);
  memory = usage.ru_maxrss / 1024.0;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &memory, 1, MPIU_REAL, MPIU_SUM, b.comm));
  PetscCall(PetscPrintf(b.comm, "iterations,%" PetscInt_FMT ",%" PetscInt_FMT "\npeak_memory_MiB,%.1f,\n", work.most_iterations, work.last_iterations, (double)memory));
  PetscCall(VecDestroy(&copy.a));
  PetscCall(VecDestroy(&copy.b));
  PetscCall(VecDestroy(&solve.a));
  PetscCall(VecDestroy(&solve.b));
  PetscCall(DLMSimulationDestroy(&sim));
  PetscCall(DLMSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscErrorCode ierr;

  if (DLMInitialize(argc, argv, NULL)) return 1;
  if (PetscPushErrorHandler(DLMErrorHandler, NULL)) return 1;
  ierr = Run(argc, argv);
  if (ierr && ierr != PETSC_ERR_USER_INPUT) MPI_Abort(MPI_COMM_WORLD, 1);
  if (PetscFinalize()) return 1;
  return ierr ? 2 : 0;
}
