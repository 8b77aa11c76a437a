#include "../../include/private/simimpl.h"

PetscErrorCode DLMSimulationCreateStepping(DLMSimulation sim)
{
  PetscFunctionBegin;
  PetscCall(DLMSplitRegister());
  PetscCall(TSCreate(sim->scene->comm, &sim->ts));
  PetscCall(TSSetType(sim->ts, TSSPLIT));
  PetscCall(TSSetProblemType(sim->ts, TS_NONLINEAR));
  PetscCall(TSSetTimeStep(sim->ts, sim->scene->ts_dt));
  PetscCall(TSSetMaxTime(sim->ts, sim->scene->ts_max_time));
  PetscCall(TSSetExactFinalTime(sim->ts, TS_EXACTFINALTIME_MATCHSTEP));
  PetscCall(DLMSimulationAddSubsteps(sim));
  PetscCall(TSSetApplicationContext(sim->ts, sim));
  PetscCall(DLMSplitSetState(sim->ts, DLMSimulationLoad, DLMSimulationStore, sim));
  PetscCall(DLMAdaptRegister());
  PetscCall(TSSetTolerances(sim->ts, PETSC_DECIDE, NULL, sim->scene->ts_rtol, NULL));
  PetscCall(TSSetFromOptions(sim->ts));
  PetscCall(TSSetSolution(sim->ts, sim->solution));
  PetscCall(DLMAdaptCreate(sim));
  if (sim->polymer || sim->adapt.exists)
    PetscCall(DLMSplitSetRetry(sim->ts, DLMSimulationKeep, DLMSimulationBringBack, DLMSimulationGiveUp, sim));
  PetscFunctionReturn(0);
}

PetscReal DLMSimulationCountSteps(PetscReal time, PetscReal dt, PetscInt most)
{
  return PetscMax(0.0, PetscMin(PetscCeilReal(time / dt - 1e-9), (PetscReal)most));
}

PetscReal DLMSimulationCountOutputs(PetscReal steps, PetscInt every)
{
  return every > 0 ? 1.0 + PetscCeilReal(steps / every) : 0.0;
}

PetscErrorCode DLMSimulationSettle(DLMScene *scene)
{
  static const struct {
    const char *key, *own;
  } solvers[] = { { "-stokes_ksp_type", KSPPREONLY }, { "-stokes_pc_type", PCDLMSTOKES }, { "-saddle_split", "fluid" } };
  const PetscBool asked = (PetscBool)!scene->mirror_chosen;
  PetscReal       nodes, ghosts, bytes;
  PetscBool       fits, exact, given, same;

  PetscFunctionBeginUser;
  if (scene->box_mirror != DLM_MIRROR_HALF) PetscFunctionReturn(0);
  for (int i = 0; i < (scene->n_spheres ? 3 : 2); i++) {
    char type[64] = "";
    PetscCall(PetscOptionsGetString(NULL, NULL, solvers[i].key, type, sizeof(type), &given));
    PetscCall(PetscStrcmp(type, solvers[i].own, &same));
    if (!given || same) continue;
    DLMUserCheck(!asked, scene->comm, "-box_mirror half with %s %s; allowed: %s, which can do it, or -box_mirror auto", solvers[i].key, type, solvers[i].own);
    scene->box_mirror = DLM_MIRROR_WHOLE;
  }
  PetscCall(DLMGridForesee(scene, asked ? NULL : &fits, &nodes, &ghosts));
  if (!asked && !fits) scene->box_mirror = DLM_MIRROR_WHOLE;
  if (scene->box_mirror == DLM_MIRROR_WHOLE) PetscFunctionReturn(0);
  PetscCall(DLMStokesForeseePressureBlocks(scene, &bytes, &exact));
  DLMUserCheck(exact || !asked, scene->comm, "-box_mirror half with -stokes_block_limit %.6g MiB, too little for the exact pressure solve, without which it cannot be; allowed: more, or -box_mirror auto",
               (double)scene->stokes_block_limit);
  if (!exact) scene->box_mirror = DLM_MIRROR_WHOLE;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationCreate(const DLMScene *scene, DLMSimulation *sim)
{
  PetscFunctionBeginUser;
  PetscCall(DLMSimulationCreatePiece(scene, scene, sim));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationCreatePiece(const DLMScene *scene, const DLMScene *whole, DLMSimulation *new_sim)
{
  DLMSimulation  sim;
  PetscLogDouble now;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&sim));
  PetscCall(PetscTime(&sim->created));
  sim->scene = scene;
  sim->implicit_viscosity = scene->implicit_viscosity;
  sim->whole = whole;
  PetscCall(DLMSimulationRide(sim));
  PetscCall(DLMCheckpointOpen(sim));
  sim->gap = sim->smallest_gap = PETSC_INFINITY;
  sim->first_step = sim->saved_step = -1;
  PetscCall(DLMSimulationBuildParts(sim));
  PetscCall(PetscTime(&now));
  sim->setup_seconds = now - sim->created;
  *new_sim           = sim;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationDestroy(DLMSimulation *pointer)
{
  DLMSimulation sim = *pointer;

  PetscFunctionBeginUser;
  if (!sim) PetscFunctionReturn(0);
  PetscCall(DLMOutputDestroy(&sim->output));
  PetscCall(DLMCheckpointFileDestroy(&sim->restart));
  PetscCall(TSDestroy(&sim->ts));
  PetscCall(DLMAdaptDestroy(sim));
  PetscCall(VecDestroy(&sim->solution));
  PetscCall(VecDestroy(&sim->sphere_states));
  PetscCall(DLMSimulationDestroyPolymer(sim));
  PetscCall(DLMSaddleDestroy(&sim->saddle));
  PetscCall(DLMPairingDestroy(&sim->pairing));
  PetscCall(DLMLubricationDestroy(&sim->lubrication));
  PetscCall(DLMSpheresDestroy(&sim->spheres));
  PetscCall(DLMStokesDestroy(&sim->stokes));
  PetscCall(DLMGridDestroy(&sim->grid));
  PetscCall(PetscFree(sim->start));
  PetscCall(PetscFree2(sim->force, sim->torque));
  PetscCall(PetscFree(sim->riding.spheres));
  PetscCall(PetscFree(*pointer));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationView(DLMSimulation sim, PetscViewer viewer)
{
  DLMModelled modelled[DLM_N_PARTS];

  PetscFunctionBeginUser;
  PetscCall(DLMSimulationGetModelled(sim, modelled));
  PetscCall(DLMModelledView(modelled, viewer));
  PetscCall(DLMSimulationViewDetails(sim, viewer));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationViewDetails(DLMSimulation sim, PetscViewer viewer)
{
  const DLMScene *scene = sim->whole;

  PetscFunctionBegin;
  if (sim->polymer) PetscCall(DLMPolymerView(sim->polymer, viewer));
  if (sim->frame_velocity[0] != 0.0 || sim->frame_velocity[1] != 0.0 || sim->frame_velocity[2] != 0.0)
    PetscCall(PetscViewerASCIIPrintf(viewer, "Mesh: rides with the mean wall velocity %.6g,%.6g,%.6g\n", (double)sim->frame_velocity[0],
                                     (double)sim->frame_velocity[1], (double)sim->frame_velocity[2]));
  if (sim->spheres) {
    DLMCover cover;
    PetscCall(DLMPairingGetCover(scene, scene->spheres[0].radius, &cover));
    PetscCall(PetscViewerASCIIPrintf(viewer, "Sphere 0: %" PetscInt_FMT " surface points at a - %.3g h, %" PetscInt_FMT " multipliers%s\n", cover.n_points,
                                     (double)cover.retraction, cover.n_multipliers, cover.degree ? " (harmonics)" : ""));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationSolve(DLMSimulation sim)
{
  PetscFunctionBeginUser;
  PetscCall(DLMSimulationWarn(sim));
  if (sim->restart) PetscCall(DLMCheckpointLoad(sim));
  else PetscCall(DLMSimulationStart(sim));
  PetscCall(DLMAdaptStart(sim));
  PetscCall(DLMSimulationStore(sim, sim->solution));
  PetscCall(DLMOutputCreate(sim, &sim->output));
  PetscCall(DLMStopCatch(sim));
  PetscCall(TSSolve(sim->ts, sim->solution));
  PetscCall(DLMStopRelease(sim));
  PetscCall(DLMOutputFinish(sim->output));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationGetStopped(DLMSimulation sim, PetscBool *stopped)
{
  PetscFunctionBeginUser;
  *stopped = (PetscBool)(sim->stop_signal != 0);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationGetObjects(DLMSimulation sim, TS *ts, DLMGrid *grid, DLMStokes *stokes, DLMSpheres *spheres, DLMSaddle *saddle)
{
  PetscFunctionBeginUser;
  if (ts) *ts = sim->ts;
  if (grid) *grid = sim->grid;
  if (stokes) *stokes = sim->stokes;
  if (spheres) *spheres = sim->spheres;
  if (saddle) *saddle = sim->saddle;
  PetscFunctionReturn(0);
}
