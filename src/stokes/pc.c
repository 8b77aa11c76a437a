#include <petsc/private/pcimpl.h>
#include "../../include/private/stokesimpl.h"

/* The wall rows of A are 6 mu h u = f. */
static PetscErrorCode SolveWallRows(DLMStokes stokes, const PetscScalar *f, PetscScalar *u)
{
  DLMGrid         grid     = stokes->grid;
  const PetscReal diagonal = 6.0 * stokes->viscosity * grid->h;
  PetscInt        start[3], width[3];

  PetscFunctionBegin;
  PetscCall(DMDAGetCorners(grid->velocity, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  for (int d = 0; d < 3; d++) {
    if (grid->periodic[d]) continue;
    for (int side = 0; side < 2; side++) {
      const PetscInt i = side * grid->cells[d] - start[d];
      PetscInt       low[3] = { 0, 0, 0 }, high[3] = { width[0], width[1], width[2] };
      if (i < 0 || i >= width[d]) continue;
      low[d]  = i;
      high[d] = i + 1;
      for (PetscInt k = low[2]; k < high[2]; k++)
        for (PetscInt j = low[1]; j < high[1]; j++)
          for (PetscInt q = 3 * low[0]; q < 3 * high[0]; q++) {
            const PetscInt at = q + 3 * width[0] * (j + width[1] * k);
            u[at]             = f[at] / diagonal;
          }
    }
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Context(PC pc, DLMStokes *stokes)
{
  Mat pmat;

  PetscFunctionBegin;
  PetscCall(PCGetOperators(pc, NULL, &pmat));
  PetscCall(DLMStokesFromMat(pmat, stokes));
  PetscFunctionReturn(0);
}

static PetscErrorCode RequireBlocks(PC pc, DLMStokes stokes)
{
  const char *prefix;

  PetscFunctionBegin;
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  DLMUserCheck(stokes->box->pressure, PetscObjectComm((PetscObject)pc),
               "-%spc_type %s needs two periodic axes and at most -stokes_block_limit MiB of blocks; allowed here: fieldsplit (conjugate gradients on the pressure)", prefix ? prefix : "",
               ((PetscObject)pc)->type_name);
  PetscFunctionReturn(0);
}

static PetscErrorCode PCApply_Velocity(PC pc, Vec f, Vec u)
{
  DLMStokes          stokes;
  const PetscScalar *x;
  PetscScalar       *y;

  PetscFunctionBegin;
  PetscCall(Context(pc, &stokes));
  PetscCall(VecGetArrayRead(f, &x));
  PetscCall(VecGetArray(u, &y));
  PetscCall(DLMBoxSolveVelocity(stokes->box, x, y));
  PetscCall(SolveWallRows(stokes, x, y));
  PetscCall(VecRestoreArray(u, &y));
  PetscCall(VecRestoreArrayRead(f, &x));
  PetscFunctionReturn(0);
}

static PetscErrorCode PCApply_Pressure(PC pc, Vec b, Vec p)
{
  DLMStokes          stokes;
  const PetscScalar *x;
  PetscScalar       *y;

  PetscFunctionBegin;
  PetscCall(Context(pc, &stokes));
  PetscCall(VecGetArrayRead(b, &x));
  PetscCall(VecGetArray(p, &y));
  PetscCall(DLMBoxSolveSchur(stokes->box, x, y));
  PetscCall(VecRestoreArray(p, &y));
  PetscCall(VecRestoreArrayRead(b, &x));
  PetscCall(VecScale(p, -1.0));
  PetscFunctionReturn(0);
}

static PetscErrorCode PCApply_Stokes(PC pc, Vec b, Vec x)
{
  DLMStokes          stokes;
  const PetscScalar *f;
  PetscScalar       *u;

  PetscFunctionBegin;
  PetscCall(Context(pc, &stokes));
  PetscCall(VecGetArrayRead(b, &f));
  PetscCall(VecGetArray(x, &u));
  PetscCall(DLMBoxSolveStokes(stokes->box, f, f + stokes->n_u, u, u + stokes->n_u));
  PetscCall(SolveWallRows(stokes, f, u));
  PetscCall(VecRestoreArray(x, &u));
  PetscCall(VecRestoreArrayRead(b, &f));
  PetscFunctionReturn(0);
}

static PetscErrorCode PCSetUp_Blocks(PC pc)
{
  DLMStokes stokes;

  PetscFunctionBegin;
  PetscCall(Context(pc, &stokes));
  PetscCall(RequireBlocks(pc, stokes));
  PetscFunctionReturn(0);
}

static PetscErrorCode Create(PC pc, PetscErrorCode (*apply)(PC, Vec, Vec), PetscErrorCode (*setup)(PC))
{
  PetscFunctionBegin;
  pc->data                = NULL;
  pc->ops->apply          = apply;
  pc->ops->applytranspose = apply;
  pc->ops->setup          = setup;
  PetscFunctionReturn(0);
}

static PetscErrorCode PCCreate_Velocity(PC pc)
{
  PetscFunctionBegin;
  PetscCall(Create(pc, PCApply_Velocity, NULL));
  PetscFunctionReturn(0);
}

static PetscErrorCode PCCreate_Pressure(PC pc)
{
  PetscFunctionBegin;
  PetscCall(Create(pc, PCApply_Pressure, PCSetUp_Blocks));
  PetscFunctionReturn(0);
}

static PetscErrorCode PCCreate_Stokes(PC pc)
{
  PetscFunctionBegin;
  PetscCall(Create(pc, PCApply_Stokes, PCSetUp_Blocks));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesRegister(void)
{
  static PetscBool done = PETSC_FALSE;

  PetscFunctionBeginUser;
  if (done) PetscFunctionReturn(0);
  done = PETSC_TRUE;
  PetscCall(PCRegister(PCDLMVELOCITY, PCCreate_Velocity));
  PetscCall(PCRegister(PCDLMPRESSURE, PCCreate_Pressure));
  PetscCall(PCRegister(PCDLMSTOKES, PCCreate_Stokes));
  PetscFunctionReturn(0);
}
