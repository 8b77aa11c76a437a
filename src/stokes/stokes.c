#include "../../include/private/stokesimpl.h"

PetscErrorCode DLMStokesAttach(DLMStokes stokes, Mat mat)
{
  PetscContainer container;

  PetscFunctionBeginUser;
  PetscCall(PetscContainerCreate(PetscObjectComm((PetscObject)mat), &container));
  PetscCall(PetscContainerSetPointer(container, stokes));
  PetscCall(PetscObjectCompose((PetscObject)mat, "DLMStokes", (PetscObject)container));
  PetscCall(PetscContainerDestroy(&container));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesFromMat(Mat mat, DLMStokes *stokes)
{
  PetscContainer container;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)mat, "DLMStokes", (PetscObject *)&container));
  PetscCheck(container, PetscObjectComm((PetscObject)mat), PETSC_ERR_ARG_WRONG, "The matrix does not belong to a DLMStokes object");
  PetscCall(PetscContainerGetPointer(container, (void **)stokes));
  PetscFunctionReturn(0);
}

/* Solver options that hold unless the user sets them. */
typedef struct {
  const char *name, *exact, *fallback;
} Default;

static const Default fieldsplit_defaults[] = {
  { "-stokes_fieldsplit_velocity_ksp_type", "preonly", "preonly" },
  { "-stokes_fieldsplit_velocity_pc_type", PCDLMVELOCITY, PCDLMVELOCITY },
  { "-stokes_fieldsplit_pressure_ksp_type", "preonly", "cg" },
  { "-stokes_fieldsplit_pressure_ksp_rtol", NULL, "1e-10" },
  { "-stokes_fieldsplit_pressure_pc_type", PCDLMPRESSURE, "jacobi" },
};

static PetscErrorCode InsertDefaults(PetscBool exact)
{
  PetscFunctionBegin;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(fieldsplit_defaults); i++) {
    const char *value = exact ? fieldsplit_defaults[i].exact : fieldsplit_defaults[i].fallback;
    PetscBool   set;
    PetscCall(PetscOptionsHasName(NULL, NULL, fieldsplit_defaults[i].name, &set));
    if (!set && value) PetscCall(PetscOptionsSetValue(NULL, fieldsplit_defaults[i].name, value));
    if (!set && value) PetscCall(PetscOptionsHasName(NULL, NULL, fieldsplit_defaults[i].name, &set)); /* marks it as read: another solver than ours may not need it */
  }
  PetscFunctionReturn(0);
}

/* A must be assembled for every velocity preconditioner but our own. */
static PetscErrorCode NeedsAssembly(PetscBool *needs)
{
  const char *names[] = { "-stokes_fieldsplit_velocity_pc_type", "-saddle_fieldsplit_velocity_pc_type" };

  PetscFunctionBegin;
  *needs = PETSC_FALSE;
  for (int i = 0; i < 2; i++) {
    char      type[64] = "";
    PetscBool set, ours;
    PetscCall(PetscOptionsGetString(NULL, NULL, names[i], type, sizeof(type), &set));
    PetscCall(PetscStrcmp(type, PCDLMVELOCITY, &ours));
    if (set && !ours) *needs = PETSC_TRUE;
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateParts(DLMStokes stokes)
{
  DLMGrid  grid = stokes->grid;
  Vec      v;
  PetscInt start, local = 0;

  PetscFunctionBeginUser;
  PetscCall(DMGetGlobalVector(grid->velocity, &v));
  PetscCall(VecGetLocalSize(v, &stokes->n_u));
  PetscCall(DMRestoreGlobalVector(grid->velocity, &v));
  PetscCall(DMGetGlobalVector(grid->pressure, &v));
  PetscCall(VecGetLocalSize(v, &stokes->n_p));
  PetscCall(DMRestoreGlobalVector(grid->pressure, &v));
  local = stokes->n_u + stokes->n_p;
  PetscCallMPI(MPI_Exscan(&local, &start, 1, MPIU_INT, MPI_SUM, grid->comm));
  PetscMPIInt rank;
  PetscCallMPI(MPI_Comm_rank(grid->comm, &rank));
  if (rank == 0) start = 0;
  PetscCall(ISCreateStride(grid->comm, stokes->n_u, start, 1, &stokes->part[0]));
  PetscCall(ISCreateStride(grid->comm, stokes->n_p, start + stokes->n_u, 1, &stokes->part[1]));
  PetscFunctionReturn(0);
}

/*
  The first solve that is no good. Solves around it go on when it ran out of iterations. Where an outer Krylov method checks its own residual, it may live with
  that of an inner one, and is watched itself.
*/
static PetscErrorCode NoteFailure(KSP ksp, Vec rhs, Vec x, void *context)
{
  DLMStokes          stokes = (DLMStokes)context;
  KSPConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  if (reason >= 0 || stokes->failed) PetscFunctionReturn(0);
  if (ksp != stokes->ksp && !stokes->watch_inner) PetscFunctionReturn(0);
  stokes->failed  = ksp;
  stokes->failure = reason;
  PetscFunctionReturn(0);
}

/* Norm of the last velocity that an inner solve gave. */
static PetscErrorCode TakeSpeed(KSP ksp, Vec rhs, Vec u, void *context)
{
  PetscFunctionBegin;
  PetscCall(NoteFailure(ksp, rhs, u, context));
  PetscCall(VecNorm(u, NORM_2, &((DLMStokes)context)->speed));
  PetscFunctionReturn(0);
}

/*
  A flow that needs no pressure leaves the rounding of B u as the right-hand side of the pressure, of which no relative tolerance can be had: its size, under the
  pressure mass over mu, is the absolute one.
*/
static PetscErrorCode SetRounding(KSP ksp, Vec rhs, Vec p, void *context)
{
  DLMStokes stokes = (DLMStokes)context;

  PetscFunctionBegin;
  PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_MACHINE_EPSILON * stokes->viscosity / stokes->grid->h * stokes->speed, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(0);
}

static PetscErrorCode ConfigureSubSolvers(DLMStokes stokes, PC pc)
{
  KSP *sub;

  PetscFunctionBegin;
  PetscCall(PCFieldSplitSchurGetSubKSP(pc, NULL, &sub));
  PetscCall(KSPSetPostSolve(sub[0], TakeSpeed, stokes));
  PetscCall(KSPSetPreSolve(sub[1], SetRounding, stokes));
  PetscCall(KSPSetPostSolve(sub[1], NoteFailure, stokes));
  if (stokes->viscous_dm) {
    PetscCall(KSPSetDM(sub[0], stokes->viscous_dm));
    PetscCall(KSPSetDMActive(sub[0], PETSC_FALSE));
  }
  PetscCall(PetscFree(sub));
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateSolver(DLMStokes stokes)
{
  const PetscBool exact = (PetscBool)(stokes->box->pressure != NULL);
  PetscBool       split;
  PC              pc;

  PetscFunctionBeginUser;
  PetscCall(KSPCreate(stokes->grid->comm, &stokes->ksp));
  PetscCall(KSPSetOptionsPrefix(stokes->ksp, "stokes_"));
  PetscCall(KSPSetOperators(stokes->ksp, stokes->K, stokes->K));
  PetscCall(KSPSetType(stokes->ksp, KSPPREONLY));
  PetscCall(KSPSetTolerances(stokes->ksp, 1e-10, PETSC_DEFAULT, PETSC_DEFAULT, 1000));
  PetscCall(KSPGetPC(stokes->ksp, &pc));
  PetscCall(PCSetType(pc, exact ? PCDLMSTOKES : PCFIELDSPLIT));
  PetscCall(KSPSetFromOptions(stokes->ksp));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCFIELDSPLIT, &split));
  if (split) {
    PetscCall(InsertDefaults(exact));
    PetscCall(DLMStokesBuildPressureMass(stokes));
    PetscCall(PCFieldSplitSetIS(pc, "velocity", stokes->part[0]));
    PetscCall(PCFieldSplitSetIS(pc, "pressure", stokes->part[1]));
    PetscCall(PCFieldSplitSetType(pc, PC_COMPOSITE_SCHUR));
    PetscCall(PCFieldSplitSetSchurFactType(pc, PC_FIELDSPLIT_SCHUR_FACT_FULL));
    PetscCall(PCFieldSplitSetSchurPre(pc, PC_FIELDSPLIT_SCHUR_PRE_USER, stokes->mass));
    PetscCall(KSPSetFromOptions(stokes->ksp));
  }
  PetscCall(KSPSetUp(stokes->ksp));
  PetscCall(KSPSetPostSolve(stokes->ksp, NoteFailure, stokes));
  PetscCall(PetscObjectTypeCompare((PetscObject)stokes->ksp, KSPPREONLY, &stokes->watch_inner));
  if (split) PetscCall(ConfigureSubSolvers(stokes, pc));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesCreate(DLMGrid grid, const DLMScene *scene, DLMStokes *new_stokes)
{
  DLMStokes stokes;
  PetscBool assemble;

  PetscFunctionBeginUser;
  PetscCall(DLMStokesRegister());
  PetscCall(PetscNew(&stokes));
  stokes->grid      = grid;
  stokes->viscosity = scene->implicit_viscosity;
  PetscCall(CreateParts(stokes));
  PetscCall(DLMBoxCreate(grid, stokes->viscosity, scene->stokes_block_limit, &stokes->box));
  PetscCall(NeedsAssembly(&assemble));
  PetscCall(DLMStokesBuildViscous(stokes, assemble));
  PetscCall(DLMStokesBuildDivergence(stokes));
  PetscCall(MatCreateNest(grid->comm, 2, stokes->part, 2, stokes->part, (Mat[]){ stokes->A, stokes->BT, stokes->B, NULL }, &stokes->K));
  PetscCall(DLMStokesAttach(stokes, stokes->K));
  PetscCall(DLMStokesBuildWallForce(stokes, scene));
  PetscCall(CreateSolver(stokes));
  *new_stokes = stokes;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesDestroy(DLMStokes *pointer)
{
  DLMStokes stokes = *pointer;

  PetscFunctionBeginUser;
  if (!stokes) PetscFunctionReturn(0);
  PetscCall(KSPDestroy(&stokes->ksp));
  PetscCall(MatDestroy(&stokes->K));
  PetscCall(MatDestroy(&stokes->BT));
  PetscCall(MatDestroy(&stokes->B));
  PetscCall(MatDestroy(&stokes->A));
  PetscCall(MatDestroy(&stokes->mass));
  PetscCall(DMDestroy(&stokes->viscous_dm));
  PetscCall(VecDestroy(&stokes->wall_force));
  PetscCall(ISDestroy(&stokes->part[0]));
  PetscCall(ISDestroy(&stokes->part[1]));
  PetscCall(PetscFree(stokes->runs));
  PetscCall(DLMBoxDestroy(&stokes->box));
  PetscCall(PetscFree(*pointer));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesForeseePressureBlocks(const DLMScene *scene, PetscReal *bytes, PetscBool *exists)
{
  const PetscBool half = (PetscBool)(scene->box_mirror == DLM_MIRROR_HALF);
  PetscInt        line = 2, fast, slow, levels, rows;
  PetscMPIInt     size;
  PetscReal       row;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_size(scene->comm, &size));
  for (PetscInt d = 0; d < 3; d++)
    if (!scene->box_periodic[d]) line = d;
  slow    = half || line == 2 ? 1 : 2;
  fast    = 3 - line - slow;
  rows    = scene->cells[slow] / (half ? 4 : 2); /* pressure cells of the slow axis */
  levels  = scene->cells[line] / 2 + (scene->box_periodic[line] ? 0 : 1);
  row     = (scene->cells[fast] / 4 + 1) * DLMBoxBlockBytes(levels);
  *exists = (PetscBool)(scene->box_periodic[fast] && scene->box_periodic[slow] &&
                        row * DLMModesMostPressureRows(rows, half, size) <= scene->stokes_block_limit * 1048576.0);
  *bytes  = *exists ? row * (rows + half) : 0.0;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesGetPressureBlocks(DLMStokes stokes, PetscReal *bytes, PetscLogDouble *seconds, const char **absent)
{
  const DLMBox *box = stokes->box;

  PetscFunctionBeginUser;
  *bytes   = box->pressure ? box->schur_bytes : 0.0;
  *seconds = box->schur_seconds;
  *absent  = box->pressure ? NULL : (box->velocity->is_complex ? "over -stokes_block_limit: conjugate gradients on the pressure" : "fewer than two periodic axes: conjugate gradients on the pressure");
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesView(DLMStokes stokes, PetscViewer viewer)
{
  PetscReal bytes;
  PCType    type;
  PC        pc;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(&stokes->box->schur_bytes, &bytes, 1, MPIU_REAL, MPIU_MAX, stokes->grid->comm));
  PetscCall(KSPGetPC(stokes->ksp, &pc));
  PetscCall(PCGetType(pc, &type));
  PetscCall(PetscViewerASCIIPrintf(viewer, "Stokes solver: %s; ", type));
  if (stokes->box->pressure)
    PetscCall(PetscViewerASCIIPrintf(viewer, "exact pressure Schur complement, %.1f MiB of blocks per rank\n", (double)(bytes / 1048576.0)));
  else if (stokes->box->velocity->is_complex)
    PetscCall(PetscViewerASCIIPrintf(viewer, "conjugate gradients on the pressure (exact blocks would need %.1f MiB per rank, over -stokes_block_limit)\n",
                                     (double)(bytes / 1048576.0)));
  else PetscCall(PetscViewerASCIIPrintf(viewer, "conjugate gradients on the pressure (fewer than two periodic axes)\n"));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesGetOperators(DLMStokes stokes, Mat *K, Mat *A, Mat *B)
{
  PetscFunctionBeginUser;
  if (K) *K = stokes->K;
  if (A) *A = stokes->A;
  if (B) *B = stokes->B;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesGetKSP(DLMStokes stokes, KSP *ksp)
{
  PetscFunctionBeginUser;
  *ksp = stokes->ksp;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesCreateVec(DLMStokes stokes, Vec *x)
{
  PetscFunctionBeginUser;
  PetscCall(VecCreateMPI(stokes->grid->comm, stokes->n_u + stokes->n_p, PETSC_DETERMINE, x));
  PetscCall(VecZeroEntries(*x));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesGetParts(DLMStokes stokes, Vec x, Vec *u, Vec *p)
{
  PetscFunctionBeginUser;
  if (u) {
    PetscCall(VecGetSubVector(x, stokes->part[0], u));
  }
  if (p) PetscCall(VecGetSubVector(x, stokes->part[1], p));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesRestoreParts(DLMStokes stokes, Vec x, Vec *u, Vec *p)
{
  PetscFunctionBeginUser;
  if (u) PetscCall(VecRestoreSubVector(x, stokes->part[0], u));
  if (p) PetscCall(VecRestoreSubVector(x, stokes->part[1], p));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesGetWallForce(DLMStokes stokes, Vec *rhs)
{
  PetscFunctionBeginUser;
  *rhs = stokes->wall_force;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesSetInnerTolerance(DLMStokes stokes, PetscReal rtol, PetscReal *before)
{
  PetscBool split;
  KSP      *sub;
  PC        pc;

  PetscFunctionBeginUser;
  *before = rtol;
  PetscCall(KSPGetPC(stokes->ksp, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCFIELDSPLIT, &split));
  if (!split) PetscFunctionReturn(0);
  PetscCall(PCFieldSplitSchurGetSubKSP(pc, NULL, &sub));
  PetscCall(KSPGetTolerances(sub[1], before, NULL, NULL, NULL));
  PetscCall(KSPSetTolerances(sub[1], rtol, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(PetscFree(sub));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesRequireSolved(DLMStokes stokes)
{
  const KSPConvergedReason reason = stokes->failure;
  PetscReal                rtol;
  PetscInt                 most;
  const char              *prefix;

  PetscFunctionBeginUser;
  if (!stokes->failed) PetscFunctionReturn(0);
  PetscCall(KSPGetTolerances(stokes->failed, &rtol, NULL, NULL, &most));
  PetscCall(KSPGetOptionsPrefix(stokes->failed, &prefix));
  stokes->failed = NULL;
  DLMUserCheck(reason != KSP_DIVERGED_NANORINF, stokes->grid->comm, "the flow is no longer finite: use a smaller -ts_dt");
  PetscCheck(PETSC_FALSE, stokes->grid->comm, PETSC_ERR_NOT_CONVERGED,
             "-%sksp_rtol %.3g: the solve for %s did not reach it (%s, at most %" PetscInt_FMT " iterations); allowed: a larger one, a larger -%sksp_max_it, or the solvers chosen by the program",
             prefix, (double)rtol, strstr(prefix, "pressure") ? "the pressure" : (strstr(prefix, "velocity") ? "the velocity" : "the flow"), KSPConvergedReasons[reason], most, prefix);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMStokesSolve(DLMStokes stokes, Vec rhs, Vec x)
{
  PetscFunctionBeginUser;
  PetscCall(KSPSolve(stokes->ksp, rhs, x));
  PetscCall(DLMStokesRequireSolved(stokes));
  PetscFunctionReturn(0);
}
