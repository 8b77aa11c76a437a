#include <petsc/private/pcimpl.h>
#include "../../include/private/saddleimpl.h"

/* f <- -J^T Q lambda, on the velocity part of f; the multipliers lead the bodies' vector. */
static PetscErrorCode CouplingMult(Mat mat, Vec b, Vec f)
{
  DLMSaddle          s;
  const PetscScalar *lambda;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(mat, &s));
  PetscCall(VecZeroEntries(f));
  PetscCall(VecGetArrayRead(b, &lambda));
  PetscCall(DLMPairingExpand(s->pairing, lambda, s->at_points));
  PetscCall(DLMPairingSpread(s->pairing, -1.0, s->at_points, f));
  PetscCall(VecRestoreArrayRead(b, &lambda));
  PetscFunctionReturn(0);
}

/* b <- (-Q^T J u, 0) */
static PetscErrorCode CouplingMultTranspose(Mat mat, Vec u, Vec b)
{
  DLMSaddle    s;
  PetscScalar *x;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(mat, &s));
  PetscCall(VecGetArray(b, &x));
  PetscCall(DLMPairingInterpolate(s->pairing, u, s->at_points));
  PetscCall(DLMPairingProject(s->pairing, s->at_points, x));
  for (PetscInt i = 0; i < s->layout.n_multipliers; i++) x[i] = -x[i];
  PetscCall(PetscArrayzero(x + s->layout.n_multipliers, s->layout.n_local - s->layout.n_multipliers));
  PetscCall(VecRestoreArray(b, &x));
  PetscFunctionReturn(0);
}

/* y <- (R U - epsilon lambda, R^T lambda + (M/dt + Z) U), held components apart. */
static PetscErrorCode BodiesMult(Mat mat, Vec x, Vec y)
{
  DLMSaddle          s;
  const PetscScalar *in, *U;
  PetscScalar       *out, *load, *moving, *friction;

  PetscFunctionBeginUser;
  PetscCall(MatShellGetContext(mat, &s));
  PetscCall(VecGetArrayRead(x, &in));
  PetscCall(VecGetArray(y, &out));
  /* the rigid motions are the tail of both vectors */
  U    = in + s->layout.n_multipliers;
  load = out + s->layout.n_multipliers;
  PetscCall(PetscCalloc2(6 * s->spheres->n_owned, &moving, 6 * s->spheres->n_owned, &friction));
  for (PetscInt k = 0; k < s->spheres->n_owned; k++)
    for (int c = 0; c < 6; c++) moving[6 * k + c] = DLMRigidHeld(s->scene, s->spheres->owned[k], c) ? 0.0 : U[6 * k + c];
  PetscCall(DLMSaddleRigidMotion(s, moving, out));
  PetscCall(DLMSaddleComply(s, in, out));
  PetscCall(DLMSaddleLoads(s, in, load));
  PetscCall(DLMSaddleSubtractFriction(s, moving, friction));
  for (PetscInt k = 0; k < s->spheres->n_owned; k++) {
    PetscReal mass[6];
    DLMRigidMass(s->scene, s->spheres->owned[k], s->inertia.weight, mass);
    for (int c = 0; c < 6; c++)
      load[6 * k + c] = mass[c] * U[6 * k + c] - friction[6 * k + c] + (DLMRigidHeld(s->scene, s->spheres->owned[k], c) ? 0.0 : load[6 * k + c]);
  }
  PetscCall(PetscFree2(moving, friction));
  PetscCall(VecRestoreArray(y, &out));
  PetscCall(VecRestoreArrayRead(x, &in));
  PetscFunctionReturn(0);
}

static PetscErrorCode FromMat(Mat mat, DLMSaddle *s)
{
  PetscContainer container;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)mat, "DLMSaddle", (PetscObject *)&container));
  PetscCheck(container, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONG, "The matrix does not belong to a DLMSaddle object");
  PetscCall(PetscContainerGetPointer(container, (void **)s));
  PetscFunctionReturn(0);
}

static PetscErrorCode Attach(DLMSaddle s, Mat mat)
{
  PetscContainer container;

  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(s->scene->comm, &container));
  PetscCall(PetscContainerSetPointer(container, s));
  PetscCall(PetscObjectCompose((PetscObject)mat, "DLMSaddle", (PetscObject)container));
  PetscCall(PetscContainerDestroy(&container));
  PetscFunctionReturn(0);
}

/* PC types: the constraint preconditioner, alone or behind the pressure mass. */
static PetscErrorCode PCApply_Bodies(PC pc, Vec r, Vec z)
{
  DLMSaddle          s;
  const PetscScalar *x;
  PetscScalar       *y;

  PetscFunctionBegin;
  PetscCall(FromMat(pc->pmat, &s));
  PetscCall(VecGetArrayRead(r, &x));
  PetscCall(VecGetArray(z, &y));
  PetscCall(DLMBlocksApply(s->blocks, x, y));
  PetscCall(VecRestoreArray(z, &y));
  PetscCall(VecRestoreArrayRead(r, &x));
  PetscFunctionReturn(0);
}

static PetscErrorCode PCApply_Multipliers(PC pc, Vec r, Vec z)
{
  DLMSaddle          s;
  const PetscScalar *x, *mass;
  PetscScalar       *y;

  PetscFunctionBegin;
  PetscCall(FromMat(pc->pmat, &s));
  PetscCall(VecGetArrayRead(r, &x));
  PetscCall(VecGetArrayRead(s->lumped_mass, &mass));
  PetscCall(VecGetArray(z, &y));
  for (PetscInt i = 0; i < s->stokes->n_p; i++) y[i] = x[i] / mass[i];
  PetscCall(DLMBlocksApply(s->blocks, x + s->stokes->n_p, y + s->stokes->n_p));
  PetscCall(VecRestoreArray(z, &y));
  PetscCall(VecRestoreArrayRead(s->lumped_mass, &mass));
  PetscCall(VecRestoreArrayRead(r, &x));
  PetscFunctionReturn(0);
}

static PetscErrorCode PCCreate_Bodies(PC pc)
{
  PetscFunctionBegin;
  pc->ops->apply = pc->ops->applytranspose = PCApply_Bodies;
  PetscFunctionReturn(0);
}

static PetscErrorCode PCCreate_Multipliers(PC pc)
{
  PetscFunctionBegin;
  pc->ops->apply = pc->ops->applytranspose = PCApply_Multipliers;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleRegister(void)
{
  static PetscBool done = PETSC_FALSE;

  PetscFunctionBeginUser;
  if (done) PetscFunctionReturn(0);
  done = PETSC_TRUE;
  PetscCall(PCRegister(PCDLMBODIES, PCCreate_Bodies));
  PetscCall(PCRegister(PCDLMMULTIPLIERS, PCCreate_Multipliers));
  PetscFunctionReturn(0);
}

/*
  Stops when the energy norm of the residual (no slip, in the norm of the preconditioner) is small against that of the multipliers
  themselves, so that a warm start is rewarded and nothing depends on units.
*/
static PetscErrorCode EnergyTest(KSP ksp, PetscInt it, PetscReal norm, KSPConvergedReason *reason, void *context)
{
  DLMSaddle s = (DLMSaddle)context;
  PetscReal rtol;
  PetscInt  most;

  PetscFunctionBegin;
  PetscCall(KSPGetTolerances(ksp, &rtol, NULL, NULL, &most));
  if (it == 0) s->reference = PetscMax(s->reference, norm);
  *reason = KSP_CONVERGED_ITERATING;
  if (PetscIsInfOrNanReal(norm)) *reason = KSP_DIVERGED_NANORINF;
  else if (norm <= rtol * s->reference) *reason = KSP_CONVERGED_RTOL;
  else if (it >= most) *reason = KSP_DIVERGED_ITS;
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateShells(DLMSaddle s)
{
  const PetscInt fluid = s->stokes->n_u + (s->uzawa ? 0 : s->stokes->n_p), n = s->layout.n_local;

  PetscFunctionBeginUser;
  PetscCall(MatCreateShell(s->scene->comm, fluid, n, PETSC_DETERMINE, PETSC_DETERMINE, s, &s->coupling));
  PetscCall(MatShellSetOperation(s->coupling, MATOP_MULT, (void (*)(void))CouplingMult));
  PetscCall(MatShellSetOperation(s->coupling, MATOP_MULT_TRANSPOSE, (void (*)(void))CouplingMultTranspose));
  PetscCall(MatCreateShell(s->scene->comm, n, n, PETSC_DETERMINE, PETSC_DETERMINE, s, &s->bodies));
  PetscCall(MatShellSetOperation(s->bodies, MATOP_MULT, (void (*)(void))BodiesMult));
  PetscCall(MatShellSetOperation(s->bodies, MATOP_MULT_TRANSPOSE, (void (*)(void))BodiesMult));
  PetscCall(Attach(s, s->bodies));
  PetscFunctionReturn(0);
}

/* Index sets of consecutive parts of a vector, given the local sizes. */
static PetscErrorCode CreateParts(MPI_Comm comm, PetscInt n, const PetscInt size[], IS is[])
{
  PetscInt    total = 0, start = 0;
  PetscMPIInt rank;

  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < n; i++) total += size[i];
  PetscCallMPI(MPI_Exscan(&total, &start, 1, MPIU_INT, MPI_SUM, comm));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) start = 0;
  for (PetscInt i = 0; i < n; i++) {
    PetscCall(ISCreateStride(comm, size[i], start, 1, &is[i]));
    start += size[i];
  }
  PetscFunctionReturn(0);
}

/* K = [K_f, C; C^T, E]: fluid | bodies. */
static PetscErrorCode NestFluidBodies(DLMSaddle s, IS is[2], Mat *K, Mat *pre)
{
  Mat transpose;

  PetscFunctionBeginUser;
  PetscCall(CreateParts(s->scene->comm, 2, (PetscInt[]){ s->stokes->n_u + s->stokes->n_p, s->layout.n_local }, is));
  PetscCall(MatCreateTranspose(s->coupling, &transpose));
  PetscCall(MatCreateNest(s->scene->comm, 2, is, 2, is, (Mat[]){ s->stokes->K, s->coupling, transpose, s->bodies }, K));
  PetscCall(MatDestroy(&transpose));
  PetscCall(PetscObjectReference((PetscObject)s->bodies));
  *pre = s->bodies;
  PetscFunctionReturn(0);
}

/* The same system as velocity | (pressure, bodies), the thesis's splitting. */
static PetscErrorCode NestVelocityMultipliers(DLMSaddle s, IS is[2], Mat *K, Mat *pre)
{
  const PetscInt n_u = s->stokes->n_u, n_p = s->stokes->n_p, n_b = s->layout.n_local;
  MPI_Comm       comm = s->scene->comm;
  IS             inner[2], velocity;
  Mat            zero, down, up, both;

  PetscFunctionBeginUser;
  PetscCall(CreateParts(comm, 2, (PetscInt[]){ n_u, n_p + n_b }, is));
  PetscCall(CreateParts(comm, 1, &n_u, &velocity));
  PetscCall(CreateParts(comm, 2, (PetscInt[]){ n_p, n_b }, inner));
  PetscCall(MatCreateConstantDiagonal(comm, n_p, n_p, PETSC_DETERMINE, PETSC_DETERMINE, 0.0, &zero));
  PetscCall(MatCreateNest(comm, 2, inner, 2, inner, (Mat[]){ zero, NULL, NULL, s->bodies }, &both));
  PetscCall(MatCreateNest(comm, 1, &velocity, 2, inner, (Mat[]){ s->stokes->BT, s->coupling }, &up));
  PetscCall(MatCreateTranspose(up, &down));
  PetscCall(MatCreateNest(comm, 2, is, 2, is, (Mat[]){ s->stokes->A, up, down, both }, K));
  PetscCall(Attach(s, both));
  PetscCall(MatDestroy(&zero));
  PetscCall(MatDestroy(&up));
  PetscCall(MatDestroy(&down));
  PetscCall(ISDestroy(&velocity));
  PetscCall(ISDestroy(&inner[0]));
  PetscCall(ISDestroy(&inner[1]));
  *pre = both;
  PetscFunctionReturn(0);
}

static PetscErrorCode ConfigureSubSolvers(DLMSaddle s, PC pc)
{
  PC        fluid, bodies;
  KSP      *sub;
  PetscBool direct;

  PetscFunctionBeginUser;
  PetscCall(PCFieldSplitSchurGetSubKSP(pc, NULL, &sub));
  PetscCall(KSPSetType(sub[0], KSPPREONLY));
  PetscCall(KSPGetPC(sub[0], &fluid));
  if (s->uzawa) {
    PetscCall(PCSetType(fluid, PCDLMVELOCITY));
    if (s->stokes->viscous_dm) {
      PetscCall(KSPSetDM(sub[0], s->stokes->viscous_dm));
      PetscCall(KSPSetDMActive(sub[0], PETSC_FALSE));
    }
  } else {
    PetscCall(PetscObjectTypeCompare((PetscObject)s->stokes->ksp, KSPPREONLY, &direct));
    if (direct) { /* the fluid's PC is its whole solver */
      PetscCall(KSPGetPC(s->stokes->ksp, &fluid));
      PetscCall(KSPSetPC(sub[0], fluid));
    } else {
      PetscCall(PCSetType(fluid, PCKSP));
      PetscCall(PCKSPSetKSP(fluid, s->stokes->ksp));
    }
  }
  if (s->uzawa) PetscCall(KSPSetFromOptions(sub[0]));
  PetscCall(KSPSetType(sub[1], KSPCG));
  PetscCall(KSPSetNormType(sub[1], KSP_NORM_NATURAL));
  PetscCall(KSPSetTolerances(sub[1], s->rtol, PETSC_DEFAULT, PETSC_DEFAULT, s->uzawa ? 20000 : 500));
  PetscCall(KSPSetConvergenceTest(sub[1], EnergyTest, s, NULL));
  PetscCall(KSPGetPC(sub[1], &bodies));
  PetscCall(PCSetType(bodies, s->uzawa ? PCDLMMULTIPLIERS : PCDLMBODIES));
  PetscCall(KSPSetFromOptions(sub[1]));
  s->bodies_ksp = sub[1];
  PetscCall(PetscFree(sub));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleBuildSolver(DLMSaddle s)
{
  IS  is[2];
  Mat K, pre;
  PC  pc;

  PetscFunctionBeginUser;
  PetscCall(DLMSaddleResetSolver(s));
  PetscCall(CreateShells(s));
  if (s->uzawa) PetscCall(NestVelocityMultipliers(s, is, &K, &pre));
  else PetscCall(NestFluidBodies(s, is, &K, &pre));
  PetscCall(KSPCreate(s->scene->comm, &s->ksp));
  PetscCall(KSPSetOptionsPrefix(s->ksp, "saddle_"));
  PetscCall(KSPSetOperators(s->ksp, K, K));
  PetscCall(KSPSetType(s->ksp, KSPPREONLY));
  PetscCall(KSPGetPC(s->ksp, &pc));
  PetscCall(PCSetType(pc, PCFIELDSPLIT));
  PetscCall(PCFieldSplitSetIS(pc, s->uzawa ? "velocity" : "fluid", is[0]));
  PetscCall(PCFieldSplitSetIS(pc, s->uzawa ? "multipliers" : "bodies", is[1]));
  PetscCall(PCFieldSplitSetType(pc, PC_COMPOSITE_SCHUR));
  PetscCall(PCFieldSplitSetSchurFactType(pc, PC_FIELDSPLIT_SCHUR_FACT_FULL));
  PetscCall(PCFieldSplitSetSchurPre(pc, PC_FIELDSPLIT_SCHUR_PRE_USER, pre));
  PetscCall(KSPSetFromOptions(s->ksp));
  PetscCall(KSPSetUp(s->ksp));
  PetscCall(ConfigureSubSolvers(s, pc));
  PetscCall(VecCreateMPI(s->scene->comm, s->stokes->n_u + s->stokes->n_p + s->layout.n_local, PETSC_DETERMINE, &s->rhs));
  PetscCall(VecDuplicate(s->rhs, &s->x));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&pre));
  PetscCall(ISDestroy(&is[0]));
  PetscCall(ISDestroy(&is[1]));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleResetSolver(DLMSaddle s)
{
  PetscFunctionBeginUser;
  PetscCall(KSPDestroy(&s->ksp));
  PetscCall(MatDestroy(&s->coupling));
  PetscCall(MatDestroy(&s->bodies));
  PetscCall(VecDestroy(&s->rhs));
  PetscCall(VecDestroy(&s->x));
  PetscFunctionReturn(0);
}
