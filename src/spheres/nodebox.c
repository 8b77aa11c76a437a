#include "../../include/private/spheresimpl.h"

PetscErrorCode DLMNodeType(MPI_Datatype *type)
{
  static MPI_Datatype node = MPI_DATATYPE_NULL;

  PetscFunctionBegin;
  if (node == MPI_DATATYPE_NULL) {
    PetscCallMPI(MPI_Type_contiguous(3, MPIU_SCALAR, &node));
    PetscCallMPI(MPI_Type_commit(&node));
  }
  *type = node;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMNodeBoxForest(DLMGrid grid, PetscInt n, const DLMNodeBox *boxes, PetscSF *sf)
{
  PetscInt     leaves = 0, at = 0, width[3];
  PetscSFNode *remote;

  PetscFunctionBeginUser;
  for (PetscInt b = 0; b < n; b++) leaves += boxes[b].width[0] * boxes[b].width[1] * boxes[b].width[2];
  PetscCall(PetscMalloc1(leaves, &remote));
  for (PetscInt b = 0; b < n; b++)
    for (PetscInt k = 0; k < boxes[b].width[2]; k++)
      for (PetscInt j = 0; j < boxes[b].width[1]; j++)
        for (PetscInt i = 0; i < boxes[b].width[0]; i++, at++) {
          const PetscInt node[3] = { boxes[b].low[0] + i, boxes[b].low[1] + j, boxes[b].low[2] + k };
          PetscMPIInt    rank;
          PetscCall(DLMGridLocate(grid, 1, node, &rank, &remote[at].index));
          remote[at].rank = rank;
        }
  PetscCall(DMDAGetCorners(grid->velocity, NULL, NULL, NULL, &width[0], &width[1], &width[2]));
  PetscCall(PetscSFCreate(grid->comm, sf));
  PetscCall(PetscSFSetGraph(*sf, width[0] * width[1] * width[2], leaves, NULL, PETSC_COPY_VALUES, remote, PETSC_OWN_POINTER));
  PetscCall(PetscSFSetUp(*sf));
  PetscFunctionReturn(0);
}
