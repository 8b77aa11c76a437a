#include <signal.h>
#include "../../include/private/simimpl.h"

/* The signals with which batch systems announce the end of a job. */
static const int             signals[] = { SIGTERM, SIGUSR1 };
static volatile sig_atomic_t caught;
static struct sigaction      before[2];

static void Catch(int number)
{
  caught = number;
}

/*
  Ranks agree at the end of a step whether a signal came to any of them and whether a checkpoint is due; the monitor writes it after the step's outputs.
  Runs that write checkpoints end with one.
*/
static PetscErrorCode Agree(TS ts)
{
  DLMSimulation     sim;
  TSConvergedReason reason;
  PetscInt          step;
  PetscLogDouble    now;
  int               told[2] = { caught, 0 };

  PetscFunctionBegin;
  PetscCall(TSGetApplicationContext(ts, &sim));
  PetscCall(TSGetStepNumber(ts, &step));
  PetscCall(TSGetConvergedReason(ts, &reason));
  PetscCall(PetscTime(&now));
  const DLMScene *scene = sim->scene;
  if (scene->checkpoint_every > 0) told[1] |= step % scene->checkpoint_every == 0 || reason != TS_CONVERGED_ITERATING;
  if (scene->checkpoint_minutes > 0.0) told[1] |= now - sim->last_checkpoint >= 60.0 * scene->checkpoint_minutes || reason != TS_CONVERGED_ITERATING;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, told, 2, MPI_INT, MPI_MAX, scene->comm));
  if (told[0] && reason == TS_CONVERGED_ITERATING) {
    PetscCall(TSSetConvergedReason(ts, TS_CONVERGED_USER));
    sim->stop_signal = told[0];
  }
  sim->checkpoint_due = (PetscBool)(told[1] || sim->stop_signal);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStopCatch(DLMSimulation sim)
{
  struct sigaction action;

  PetscFunctionBegin;
  caught = 0;
  PetscCall(PetscMemzero(&action, sizeof(action)));
  action.sa_handler = Catch;
  action.sa_flags   = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (int k = 0; k < 2; k++) sigaction(signals[k], &action, &before[k]);
  PetscCall(PetscTime(&sim->last_checkpoint));
  PetscCall(TSSetPostStep(sim->ts, Agree));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStopRelease(DLMSimulation sim)
{
  PetscFunctionBegin;
  for (int k = 0; k < 2; k++) sigaction(signals[k], &before[k], NULL);
  PetscFunctionReturn(0);
}
