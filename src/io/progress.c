#include <unistd.h>
#include "../../include/private/outputimpl.h"

/* A terminal is asked for by DLM_TERMINAL=1 (mpirun hides it from its children), else found. */
static PetscBool IsTerminal(void)
{
  const char *told = getenv("DLM_TERMINAL");

  return (PetscBool)(told ? told[0] == '1' : isatty(STDOUT_FILENO));
}

PetscErrorCode DLMProgress(DLMOutput output, PetscInt step, PetscReal time, PetscBool last)
{
  const DLMScene *scene = output->sim->scene;
  DLMSaddleWork   work;
  PetscLogDouble  now;
  PetscMPIInt     rank;
  PetscReal       end, left;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(scene->comm, &rank));
  if (rank) PetscFunctionReturn(0);
  output->terminal = IsTerminal();
  PetscCall(PetscTime(&now));
  if (!last && now - output->last_progress < (output->terminal ? 0.2 : scene->progress_every)) PetscFunctionReturn(0);
  output->last_progress = now;
  PetscCall(TSGetMaxTime(output->sim->ts, &end));
  left = time > output->start_time ? (now - output->started) * (end - time) / (time - output->start_time) : 0.0;
  PetscCall(DLMSaddleGetWork(output->sim->saddle, &work));
  printf("%st = %-9.4g of %.4g  step %-6ld  iterations %-3ld", output->terminal ? "\r" : "", (double)time, (double)end, (long)step, (long)work.last_iterations);
  if (output->sim->spheres && output->sim->smallest_gap < PETSC_INFINITY) printf("  smallest gap %-9.3g", (double)output->sim->smallest_gap);
  if (output->sim->polymer) printf("  eigenvalue %-9.3g trace %-9.3g", (double)output->sim->worst.smallest_eigenvalue, (double)output->sim->worst.largest_trace);
  if (last) printf("  took %.1f s   \n", now - output->started);
  else printf("  left %ld:%02ld:%02ld  %s", (long)(left / 3600.0), (long)(left / 60.0) % 60, (long)left % 60, output->terminal ? "" : "\n");
  fflush(stdout);
  PetscFunctionReturn(0);
}
