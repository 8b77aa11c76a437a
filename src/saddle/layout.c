#include "../../include/private/saddleimpl.h"

PetscErrorCode DLMLayoutUpdate(DLMSpheres spheres, DLMPairing pairing, DLMBodyLayout *l)
{
  const PetscInt n = spheres->n;
  PetscMPIInt    rank, size;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(spheres->grid->comm, &rank));
  PetscCallMPI(MPI_Comm_size(spheres->grid->comm, &size));
  if (!l->points) PetscCall(PetscMalloc4(n, &l->points, n, &l->multiplier, n, &l->rigid, n, &l->rank));
  PetscCall(PetscArrayzero(l->points, n));
  PetscCall(PetscArrayzero(l->multiplier, n));
  PetscCall(PetscArrayzero(l->rigid, n));
  PetscCall(PetscArraycpy(l->rank, spheres->owner, n));
  l->n_multipliers = 3 * pairing->first_multiplier[spheres->n_owned];
  l->n_local       = l->n_multipliers + 6 * spheres->n_owned;
  for (PetscInt k = 0; k < spheres->n_owned; k++) {
    const PetscInt i = spheres->owned[k];
    l->points[i]     = pairing->first_multiplier[k + 1] - pairing->first_multiplier[k];
    l->multiplier[i] = 3 * pairing->first_multiplier[k];
    l->rigid[i]      = l->n_multipliers + 6 * k;
  }
  if (size > 1) {
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, l->points, (PetscMPIInt)n, MPIU_INT, MPI_SUM, spheres->grid->comm));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, l->multiplier, (PetscMPIInt)n, MPIU_INT, MPI_SUM, spheres->grid->comm));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, l->rigid, (PetscMPIInt)n, MPIU_INT, MPI_SUM, spheres->grid->comm));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMLayoutDestroy(DLMBodyLayout *l)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree4(l->points, l->multiplier, l->rigid, l->rank));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleRigidMotion(DLMSaddle s, const PetscScalar *U, PetscScalar *values)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->spheres->n_owned; k++)
    for (PetscInt i = s->pairing->first[k]; i < s->pairing->first[k + 1]; i++)
      DLMRigidVelocity(U + 6 * k, s->pairing->markers.r + 3 * i, s->at_points + 3 * i);
  PetscCall(DLMPairingProject(s->pairing, s->at_points, values));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleLoads(DLMSaddle s, const PetscScalar *multipliers, PetscScalar *load)
{
  PetscFunctionBegin;
  PetscCall(PetscArrayzero(load, 6 * s->spheres->n_owned));
  PetscCall(DLMPairingExpand(s->pairing, multipliers, s->at_points));
  for (PetscInt k = 0; k < s->spheres->n_owned; k++)
    for (PetscInt i = s->pairing->first[k]; i < s->pairing->first[k + 1]; i++)
      DLMRigidLoad(s->at_points + 3 * i, s->pairing->markers.r + 3 * i, load + 6 * k);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleComply(DLMSaddle s, const PetscScalar *multipliers, PetscScalar *values)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < s->spheres->n_owned; k++) {
    const PetscInt at = s->pairing->first_multiplier[k];
    DLMCover       cover;
    PetscCall(DLMPairingGetCover(s->scene, s->scene->spheres[s->spheres->owned[k]].radius, &cover));
    DLMCoverComply(&cover, -1.0, multipliers + 3 * at, values + 3 * at);
  }
  PetscFunctionReturn(0);
}
