/* The Stokes solver: residuals of every path, the same answer from all of them, what it prints and what it refuses. */
#include "dlmtest.h"

#define FIELDSPLIT "-stokes_pc_type fieldsplit -stokes_ksp_type preonly "
#define TIGHT "-stokes_fieldsplit_pressure_ksp_rtol 1e-14 -stokes_fieldsplit_pressure_ksp_max_it 200 "
#define ITERATIVE "-stokes_fieldsplit_velocity_ksp_type cg -stokes_fieldsplit_velocity_ksp_rtol 1e-10 "

static const PetscInt cells[3] = { 16, 8, 12 };

static void OpenCase(unsigned periodic, PetscReal block_limit, const char *options, StokesCase *c)
{
  MakeScene(PETSC_COMM_WORLD, cells, periodic, &c->scene);
  c->scene.stokes_block_limit = block_limit;
  CreateStokes(options, c);
}

static PetscBool TwoPeriodicAxes(unsigned periodic)
{
  return (PetscBool)((periodic & (periodic - 1)) != 0);
}

/* |K x - b| / |b|, the larger one of the velocity and the pressure rows. */
static double Residual(const StokesCase *c, Vec b, Vec x)
{
  Vec       r;
  PetscReal norm[2];
  double    worst = 0.0;

  Call(VecDuplicate(b, &r));
  Call(MatMult(c->K, x, r));
  Call(VecAYPX(r, -1.0, b));
  for (int i = 0; i < 2; i++) {
    Vec part[2];
    Call(DLMStokesGetParts(c->stokes, r, i ? NULL : &part[0], i ? &part[0] : NULL));
    Call(DLMStokesGetParts(c->stokes, b, i ? NULL : &part[1], i ? &part[1] : NULL));
    for (int k = 0; k < 2; k++) Call(VecNorm(part[k], NORM_2, &norm[k]));
    Call(DLMStokesRestoreParts(c->stokes, r, i ? NULL : &part[0], i ? &part[0] : NULL));
    Call(DLMStokesRestoreParts(c->stokes, b, i ? NULL : &part[1], i ? &part[1] : NULL));
    worst = fmax(worst, norm[0] / norm[1]);
  }
  Call(VecDestroy(&r));
  return worst;
}

static void CheckResidual(unsigned periodic, PetscReal block_limit, const char *options, const char *pc_type)
{
  StokesCase      c;
  Vec       b, x;
  KSP       ksp;
  PC        pc;
  PetscBool same;

  OpenCase(periodic, block_limit, options, &c);
  Call(DLMStokesGetKSP(c.stokes, &ksp));
  Call(KSPGetPC(ksp, &pc));
  Call(PetscObjectTypeCompare((PetscObject)pc, pc_type, &same));
  AssertAll(same);
  b = NewRightHandSide(&c);
  x = NewSolution(&c, b);
  AssertAtMost(Residual(&c, b, x), 1e-12);
  Call(VecDestroy(&x));
  Call(VecDestroy(&b));
  DestroyStokes(&c);
}

static void EveryPathSolvesToRounding(void **state)
{
  for (unsigned periodic = 0; periodic < 8; periodic++) {
    if (TwoPeriodicAxes(periodic)) {
      CheckResidual(periodic, 1024.0, "", PCDLMSTOKES);
      CheckResidual(periodic, 1024.0, FIELDSPLIT, PCFIELDSPLIT);
    }
    CheckResidual(periodic, 0.0, TIGHT, PCFIELDSPLIT);
  }
}

static void EveryLayoutSolvesToRounding(void **state)
{
  const PetscInt larger[3] = { 16, 20, 18 };
  StokesCase           c;
  Vec            b, x;

  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (int k = 0;; k++) {
      MakeScene(PETSC_COMM_WORLD, larger, periodic, &c.scene);
      if (!Layout(k, c.scene.grid_processes)) break;
      CreateStokes(TIGHT, &c);
      b = NewRightHandSide(&c);
      x = NewSolution(&c, b);
      AssertAtMost(Residual(&c, b, x), 1e-12);
      Call(VecDestroy(&x));
      Call(VecDestroy(&b));
      DestroyStokes(&c);
    }
}

static void GeneralSolversGiveTheSameAnswer(void **state)
{
  const char *options[] = {
    FIELDSPLIT,
    FIELDSPLIT ITERATIVE "-stokes_fieldsplit_velocity_pc_type hypre -stokes_fieldsplit_velocity_pc_hypre_type boomeramg",
    FIELDSPLIT ITERATIVE "-stokes_fieldsplit_velocity_pc_type mg -stokes_fieldsplit_velocity_pc_mg_levels 2 "
                         "-stokes_fieldsplit_velocity_pc_mg_galerkin both",
  };

  for (unsigned periodic = 0; periodic < 8; periodic++) {
    StokesCase c;
    Vec  b, x;
    OpenCase(periodic, 1024.0, TIGHT, &c);
    b = NewRightHandSide(&c);
    x = NewSolution(&c, b);
    for (int i = 0; i < 3; i++) {
      StokesCase other;
      Vec  y;
      OpenCase(periodic, 1024.0, options[i], &other);
      y = NewSolution(&other, b);
      AssertAtMost(SolutionDifference(&c, x, y), 1e-6);
      Call(VecDestroy(&y));
      DestroyStokes(&other);
    }
    Call(VecDestroy(&x));
    Call(VecDestroy(&b));
    DestroyStokes(&c);
  }
}

/* What DLMStokesView prints, on rank 0; elsewhere nothing. */
static void GetView(unsigned periodic, PetscReal block_limit, char *text, size_t size)
{
  StokesCase        c;
  PetscViewer viewer;
  FILE       *file = tmpfile();

  memset(text, 0, size);
  OpenCase(periodic, block_limit, "", &c);
  Call(PetscViewerASCIIOpenWithFILE(PETSC_COMM_WORLD, file, &viewer));
  Call(DLMStokesView(c.stokes, viewer));
  Call(PetscViewerDestroy(&viewer));
  rewind(file);
  if (fread(text, 1, size - 1, file) == 0) text[0] = 0;
  fclose(file);
  DestroyStokes(&c);
}

static void TheViewNamesSolverAndMemory(void **state)
{
  char        text[512];
  PetscMPIInt rank;

  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  GetView(3, 1024.0, text, sizeof(text));
  AssertAll(rank || (strstr(text, "dlmstokes; exact pressure Schur complement") && strstr(text, " MiB of blocks per rank")));
  GetView(3, 0.0, text, sizeof(text));
  AssertAll(rank || strstr(text, "fieldsplit; conjugate gradients on the pressure (exact blocks would need "));
  AssertAll(rank || strstr(text, " MiB per rank, over -stokes_block_limit)"));
  GetView(1, 1024.0, text, sizeof(text));
  AssertAll(rank || strstr(text, "conjugate gradients on the pressure (fewer than two periodic axes)"));
}

static void ASolveThatDoesNotConvergeIsAnError(void **state)
{
  StokesCase           c;
  Vec            b, x;
  PetscErrorCode error;

  OpenCase(1, 1024.0, "-stokes_fieldsplit_pressure_ksp_max_it 2", &c);
  b = NewRightHandSide(&c);
  Call(VecDuplicate(b, &x));
  CallKeepingMessage(error, DLMStokesSolve(c.stokes, b, x));
  AssertAll(error == PETSC_ERR_NOT_CONVERGED);
  AssertAll(strstr(last_message, "-stokes_"));
  Call(VecDestroy(&x));
  Call(VecDestroy(&b));
  DestroyStokes(&c);
}

static void ExactBlocksWithoutPeriodicAxesAreRefused(void **state)
{
  StokesCase           c;
  PetscErrorCode error;

  MakeScene(PETSC_COMM_WORLD, cells, 1, &c.scene);
  Call(PetscOptionsClear(NULL));
  Call(PetscOptionsInsertString(NULL, "-stokes_pc_type dlmstokes"));
  Call(DLMGridCreate(&c.scene, &c.grid));
  CallKeepingMessage(error, DLMStokesCreate(c.grid, &c.scene, &c.stokes));
  AssertAll(error == PETSC_ERR_USER_INPUT);
  AssertAll(strstr(last_message, "dlmstokes needs two periodic axes"));
  Call(DLMGridDestroy(&c.grid));
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(EveryPathSolvesToRounding),
  cmocka_unit_test(EveryLayoutSolvesToRounding),
  cmocka_unit_test(GeneralSolversGiveTheSameAnswer),
  cmocka_unit_test(TheViewNamesSolverAndMemory),
  cmocka_unit_test(ASolveThatDoesNotConvergeIsAnError),
  cmocka_unit_test(ExactBlocksWithoutPeriodicAxesAreRefused),
};

RUN_ON_ALL_RANKS(tests)
