#include "../../include/private/stokesimpl.h"

/* Sets the wall nodes of a ghosted velocity array to zero: A does not couple to them. */
static PetscErrorCode ZeroWalls(DLMGrid grid, PetscScalar ****x)
{
  PetscInt start[3], width[3];

  PetscFunctionBegin;
  PetscCall(DMDAGetGhostCorners(grid->velocity, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  for (int d = 0; d < 3; d++) {
    if (grid->periodic[d]) continue;
    for (int side = 0; side < 2; side++) {
      PetscInt low[3], high[3];
      for (int e = 0; e < 3; e++) {
        low[e]  = start[e];
        high[e] = start[e] + width[e];
      }
      if (side * grid->cells[d] < low[d] || side * grid->cells[d] >= high[d]) continue;
      low[d]  = side * grid->cells[d];
      high[d] = low[d] + 1;
      for (PetscInt k = low[2]; k < high[2]; k++)
        for (PetscInt j = low[1]; j < high[1]; j++) PetscCall(PetscArrayzero(x[k][j][low[0]], 3 * (high[0] - low[0])));
    }
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode ViscousMult(Mat mat, Vec u, Vec f)
{
  DLMStokes         stokes;
  DLMGrid           grid;
  Vec               local;
  PetscScalar   ****x, ****y;
  const PetscScalar ****z;
  PetscInt          start[3], width[3];

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(mat, &stokes));
  grid = stokes->grid;
  PetscCall(DMGetLocalVector(grid->velocity, &local));
  PetscCall(DLMGridGlobalToLocal(grid, grid->velocity, DLMMirrorVector, u, local));
  PetscCall(DMDAVecGetArrayDOF(grid->velocity, local, &x));
  PetscCall(DMDAVecGetArrayDOFRead(grid->velocity, u, &z));
  PetscCall(DMDAVecGetArrayDOF(grid->velocity, f, &y));
  PetscCall(ZeroWalls(grid, x));
  PetscCall(DMDAGetCorners(grid->velocity, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  for (PetscInt k = start[2]; k < start[2] + width[2]; k++)
    for (PetscInt j = start[1]; j < start[1] + width[1]; j++)
      for (PetscInt i = start[0]; i < start[0] + width[0]; i++)
        for (int c = 0; c < 3; c++) {
          const PetscReal a = stokes->viscosity * grid->h;
          if (DLMGridOnWall(grid, i, j, k)) y[k][j][i][c] = 6.0 * a * z[k][j][i][c];
          else
            y[k][j][i][c] = a * (6.0 * x[k][j][i][c] - x[k][j][i - 1][c] - x[k][j][i + 1][c] - x[k][j - 1][i][c] - x[k][j + 1][i][c] -
                                 x[k - 1][j][i][c] - x[k + 1][j][i][c]);
        }
  PetscCall(DMDAVecRestoreArrayDOF(grid->velocity, f, &y));
  PetscCall(DMDAVecRestoreArrayDOFRead(grid->velocity, u, &z));
  PetscCall(DMDAVecRestoreArrayDOF(grid->velocity, local, &x));
  PetscCall(DMRestoreLocalVector(grid->velocity, &local));
  PetscFunctionReturn(0);
}

static PetscErrorCode ViscousGetDiagonal(Mat mat, Vec diagonal)
{
  DLMStokes stokes;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(mat, &stokes));
  PetscCall(VecSet(diagonal, 6.0 * stokes->viscosity * stokes->grid->h));
  PetscFunctionReturn(0);
}

/* Seven entries a row; DMCreateMatrix would couple the components or ask for a colouring. */
static PetscErrorCode CreateStarMatrix(DM dm, PetscInt n, Mat *A)
{
  ISLocalToGlobalMapping mapping;
  PetscInt               start[3], width[3];

  PetscFunctionBeginUser;
  PetscCall(MatCreate(PetscObjectComm((PetscObject)dm), A));
  PetscCall(MatSetSizes(*A, n, n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetBlockSize(*A, 3));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*A, 7, NULL));
  PetscCall(MatMPIAIJSetPreallocation(*A, 7, NULL, 7, NULL));
  PetscCall(DMGetLocalToGlobalMapping(dm, &mapping));
  PetscCall(MatSetLocalToGlobalMapping(*A, mapping, mapping));
  PetscCall(DMDAGetGhostCorners(dm, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  PetscCall(MatSetStencil(*A, 3, width, start, 3));
  PetscFunctionReturn(0);
}

/* One row of the assembled A: node i, component c. */
static PetscErrorCode SetRow(DLMStokes stokes, Mat A, const PetscInt i[3], int c)
{
  const PetscReal a = stokes->viscosity * stokes->grid->h;
  MatStencil      row = { .i = i[0], .j = i[1], .k = i[2], .c = c }, column[7];
  PetscScalar     value[7] = { 6.0 * a };
  PetscInt        n = 1;

  PetscFunctionBegin;
  column[0] = row;
  if (!DLMGridOnWall(stokes->grid, i[0], i[1], i[2]))
    for (int d = 0; d < 3; d++)
      for (int s = -1; s <= 1; s += 2) {
        PetscInt q[3] = { i[0], i[1], i[2] };
        q[d] += s;
        if (DLMGridOnWall(stokes->grid, q[0], q[1], q[2])) continue;
        column[n]  = (MatStencil){ .i = q[0], .j = q[1], .k = q[2], .c = c };
        value[n++] = -a;
      }
  PetscCall(MatSetValuesStencil(A, 1, &row, n, column, value, INSERT_VALUES));
  PetscFunctionReturn(0);
}

static PetscErrorCode AssembleViscous(DLMStokes stokes)
{
  PetscInt start[3], width[3], i[3];

  PetscFunctionBeginUser;
  PetscCall(DLMGridCreateDM(stokes->grid, 3, DMDA_STENCIL_STAR, 1, &stokes->viscous_dm)); /* serves the matrix and its multigrid */
  PetscCall(CreateStarMatrix(stokes->viscous_dm, stokes->n_u, &stokes->A));
  PetscCall(DMDAGetCorners(stokes->viscous_dm, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  for (i[2] = start[2]; i[2] < start[2] + width[2]; i[2]++)
    for (i[1] = start[1]; i[1] < start[1] + width[1]; i[1]++)
      for (i[0] = start[0]; i[0] < start[0] + width[0]; i[0]++)
        for (int c = 0; c < 3; c++) PetscCall(SetRow(stokes, stokes->A, i, c));
  PetscCall(MatAssemblyBegin(stokes->A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(stokes->A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

/* In a fully periodic box A maps constants to zero: solvers leave the mean velocity at zero and ignore a mean force. */
static PetscErrorCode AttachNullSpace(DLMStokes stokes)
{
  DLMGrid      grid = stokes->grid;
  MatNullSpace constants;
  Vec          v[3];

  PetscFunctionBeginUser;
  if (!grid->periodic[0] || !grid->periodic[1] || !grid->periodic[2]) PetscFunctionReturn(0);
  for (int c = 0; c < 3; c++) {
    PetscCall(DMCreateGlobalVector(grid->velocity, &v[c]));
    PetscCall(VecStrideSet(v[c], c, 1.0));
    PetscCall(VecNormalize(v[c], NULL));
  }
  PetscCall(MatNullSpaceCreate(grid->comm, PETSC_FALSE, 3, v, &constants));
  PetscCall(MatSetNullSpace(stokes->A, constants));
  PetscCall(MatNullSpaceDestroy(&constants));
  for (int c = 0; c < 3; c++) PetscCall(VecDestroy(&v[c]));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesBuildViscous(DLMStokes stokes, PetscBool assemble)
{
  PetscFunctionBeginUser;
  if (assemble) {
    PetscCall(AssembleViscous(stokes));
  } else {
    PetscCall(MatCreateShell(stokes->grid->comm, stokes->n_u, stokes->n_u, PETSC_DETERMINE, PETSC_DETERMINE, stokes, &stokes->A));
    PetscCall(MatShellSetOperation(stokes->A, MATOP_MULT, (void (*)(void))ViscousMult));
    PetscCall(MatShellSetOperation(stokes->A, MATOP_MULT_TRANSPOSE, (void (*)(void))ViscousMult));
    PetscCall(MatShellSetOperation(stokes->A, MATOP_GET_DIAGONAL, (void (*)(void))ViscousGetDiagonal));
  }
  PetscCall(MatSetOption(stokes->A, MAT_SPD, PETSC_TRUE));
  PetscCall(AttachNullSpace(stokes));
  PetscCall(DLMStokesAttach(stokes, stokes->A));
  PetscFunctionReturn(0);
}

/* Pressure mass on T^2h over -mu: spectrally equivalent to the Schur complement -B A^-1 B^T. */
PetscErrorCode DLMStokesBuildPressureMass(DLMStokes stokes)
{
  DLMGrid         grid  = stokes->grid;
  const PetscReal scale = -8.0 * grid->h * grid->h * grid->h / stokes->viscosity;
  PetscInt        start[3], width[3], i[3];
  MatNullSpace    constant;

  PetscFunctionBeginUser;
  PetscCall(DMSetMatType(grid->pressure, MATAIJ));
  PetscCall(DMCreateMatrix(grid->pressure, &stokes->mass));
  PetscCall(DMDAGetCorners(grid->pressure, &start[0], &start[1], &start[2], &width[0], &width[1], &width[2]));
  for (i[2] = start[2]; i[2] < start[2] + width[2]; i[2]++)
    for (i[1] = start[1]; i[1] < start[1] + width[1]; i[1]++)
      for (i[0] = start[0]; i[0] < start[0] + width[0]; i[0]++) {
        MatStencil row = { .i = i[0], .j = i[1], .k = i[2] };
        int        place[3];
        double     stencil[27];
        for (int d = 0; d < 3; d++) place[d] = DLMGridPlace(grid, d, i[d], grid->cells[d] / 2);
        DLMKuhnMass(place, stencil);
        for (int q = 0; q < 27; q++) {
          MatStencil  column = { .i = i[0] + q % 3 - 1, .j = i[1] + (q / 3) % 3 - 1, .k = i[2] + q / 9 - 1 };
          PetscScalar value  = scale * stencil[q];
          if (stencil[q] != 0.0) PetscCall(MatSetValuesStencil(stokes->mass, 1, &row, 1, &column, &value, ADD_VALUES));
        }
      }
  PetscCall(MatAssemblyBegin(stokes->mass, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(stokes->mass, MAT_FINAL_ASSEMBLY));
  PetscCall(MatNullSpaceCreate(grid->comm, PETSC_TRUE, 0, NULL, &constant));
  PetscCall(PetscObjectCompose((PetscObject)stokes->part[1], "nullspace", (PetscObject)constant));
  PetscCall(MatNullSpaceDestroy(&constant));
  PetscCall(DLMStokesAttach(stokes, stokes->mass));
  PetscFunctionReturn(0);
}
