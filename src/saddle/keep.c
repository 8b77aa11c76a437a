#include "../../include/private/saddleimpl.h"

/* 3-vectors on the surfaces of the spheres before sphere i. */
static PetscErrorCode SurfaceOffset(DLMSaddle s, PetscInt i, PetscInt *offset)
{
  PetscFunctionBegin;
  *offset = 0;
  for (PetscInt k = 0; k < i; k++) {
    DLMCover cover;
    PetscCall(DLMPairingGetCover(s->scene, s->scene->spheres[k].radius, &cover));
    *offset += cover.n_multipliers;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleStateCreate(DLMSaddle s, DLMSaddleState *state)
{
  const PetscInt n = s->scene->n_spheres;
  DLMBlockState *b = &state->blocks;

  PetscFunctionBeginUser;
  PetscCall(PetscMemzero(state, sizeof(*state)));
  PetscCall(SurfaceOffset(s, n, &state->n_multipliers));
  state->n_multipliers *= 3;
  PetscCall(PetscCalloc1(state->n_multipliers, &state->multipliers));
  PetscCall(PetscCalloc4(n, &b->first, n, &b->rank, 3 * n, &b->center, 3 * n, &b->origin));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleStateDestroy(DLMSaddleState *state)
{
  PetscFunctionBeginUser;
  PetscCall(PetscFree(state->multipliers));
  PetscCall(PetscFree4(state->blocks.first, state->blocks.rank, state->blocks.center, state->blocks.origin));
  PetscFunctionReturn(0);
}

/* Surface multipliers of the owned spheres between the bodies' vector and the list of all spheres. */
static PetscErrorCode MoveMultipliers(DLMSaddle s, PetscReal *all, PetscBool to_list)
{
  PetscInt at = 0;

  PetscFunctionBegin;
  for (PetscInt i = 0, k = 0; i < s->scene->n_spheres; i++) {
    DLMCover cover;
    PetscCall(DLMPairingGetCover(s->scene, s->scene->spheres[i].radius, &cover));
    if (k < s->spheres->n_owned && s->spheres->owned[k] == i) {
      PetscReal *here = s->lambda + s->layout.multiplier[i];
      PetscCall(PetscArraycpy(to_list ? all + at : here, to_list ? here : all + at, 3 * cover.n_multipliers));
      k++;
    }
    at += 3 * cover.n_multipliers;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleGetState(DLMSaddle s, DLMSaddleState *state)
{
  PetscFunctionBeginUser;
  if (!s->scene->n_spheres) PetscFunctionReturn(0);
  PetscCall(PetscArrayzero(state->multipliers, state->n_multipliers));
  PetscCall(MoveMultipliers(s, state->multipliers, PETSC_TRUE));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, state->multipliers, (PetscMPIInt)state->n_multipliers, MPIU_REAL, MPI_SUM, s->scene->comm));
  state->reference = s->reference;
  PetscCall(DLMBlocksGetState(s->blocks, &state->blocks));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleSetState(DLMSaddle s, const DLMSaddleState *state)
{
  PetscFunctionBeginUser;
  if (!s->scene->n_spheres) PetscFunctionReturn(0);
  PetscCall(DLMSaddleUpdateLayout(s));
  PetscCall(PetscArrayzero(s->lambda, s->layout.n_local));
  PetscCall(MoveMultipliers(s, state->multipliers, PETSC_FALSE));
  s->reference = state->reference;
  PetscCall(DLMBlocksSetState(s->blocks, &s->layout, &state->blocks));
  PetscFunctionReturn(0);
}
