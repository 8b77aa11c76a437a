#include "../../include/private/outputimpl.h"

static const char header[] = "step,time,sphere,x1,x2,x3,V1,V2,V3,omega1,omega2,omega3,F1,F2,F3,T1,T2,T3,S11,S12,S13,S22,S23,S33\n";

PetscErrorCode DLMTrajectoryOpen(DLMOutput output)
{
  PetscFunctionBegin;
  if (output->sim->spheres) PetscCall(DLMCsvOpen(output->sim, "trajectory.csv", header, &output->trajectory));
  PetscFunctionReturn(0);
}

/* The rows of a step as text, malloc'ed, NULL if there is no memory. */
static char *Rows(DLMOutput output, PetscInt step, PetscReal time, PetscInt n, const DLMSphereState state[], size_t *size)
{
  static const int order[6] = { 0, 3, 4, 1, 5, 2 }; /* of 11, 22, 33, 12, 13, 23 in the header */
  char            *text     = NULL;
  FILE            *out      = open_memstream(&text, size);

  for (PetscInt i = 0; out && i < n; i++) {
    PetscReal center[3], velocity[3];
    for (int d = 0; d < 3; d++) {
      center[d]   = state[i].center[d] + output->sim->frame_velocity[d] * time;
      velocity[d] = state[i].velocity[d] + output->sim->frame_velocity[d];
    }
    const PetscReal *columns[5] = { center, velocity, state[i].omega, state[i].force, state[i].torque };
    fprintf(out, "%ld,%.15g,%ld", (long)step, (double)time, (long)i);
    for (int c = 0; c < 15; c++) fprintf(out, ",%.15g", (double)columns[c / 3][c % 3]);
    for (int c = 0; c < 6; c++) fprintf(out, ",%.15g", (double)state[i].stresslet[order[c]]);
    fputc('\n', out);
  }
  if (out && !fclose(out)) return text;
  free(text);
  return NULL;
}

PetscErrorCode DLMTrajectoryWrite(DLMOutput output, PetscInt step, PetscReal time)
{
  DLMSphereState *state;
  PetscInt        n;
  PetscMPIInt     rank;
  size_t          size = 0;
  char           *text = NULL;

  PetscFunctionBegin;
  if (!output->sim->spheres) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Comm_rank(output->sim->scene->comm, &rank));
  PetscCall(DLMSpheresGetStates(output->sim->spheres, &n, &state));
  if (rank == 0) text = Rows(output, step, time, n, state, &size);
  PetscCall(DLMCsvAppend(output->sim, &output->trajectory, text, size));
  free(text);
  PetscFunctionReturn(0);
}
