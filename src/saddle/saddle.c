#include <petsctime.h>
#include "../../include/private/memory.h"
#include "../../include/private/saddleimpl.h"

PetscErrorCode DLMSaddleDestroy(DLMSaddle *pointer)
{
  DLMSaddle s = *pointer;

  PetscFunctionBeginUser;
  if (!s) PetscFunctionReturn(0);
  PetscCall(DLMSaddleResetSolver(s));
  PetscCall(DLMBlocksDestroy(&s->blocks));
  PetscCall(DLMLubricationDestroy(&s->lubrication));
  PetscCall(DLMLayoutDestroy(&s->layout));
  PetscCall(VecDestroy(&s->fluid));
  PetscCall(VecDestroy(&s->lumped_mass));
  PetscCall(PetscFree(s->lambda));
  PetscCall(PetscFree(s->at_points));
  PetscCall(PetscFree(*pointer));
  PetscFunctionReturn(0);
}

/*
  Brings the multipliers of the last solve to the new layout: a sphere's surface points keep their order when it moves or changes owner.
  Inner points are new ones and start from zero.
*/
static PetscErrorCode CarryMultipliers(DLMSaddle s, const DLMBodyLayout *old, PetscReal *old_lambda)
{
  PetscSFNode *remote;
  PetscInt    *local, n = 0;
  PetscSF      sf;

  PetscFunctionBeginUser;
  PetscCall(PetscFree(s->lambda));
  PetscCall(PetscCalloc1(PetscMax(1, s->layout.n_local), &s->lambda));
  if (!old->points) PetscFunctionReturn(0);
  PetscCall(PetscMalloc2(s->layout.n_multipliers, &remote, s->layout.n_multipliers, &local));
  for (PetscInt k = 0; k < s->spheres->n_owned; k++) {
    const PetscInt i = s->spheres->owned[k];
    DLMCover       cover;
    PetscCall(DLMPairingGetCover(s->scene, s->scene->spheres[i].radius, &cover));
    for (PetscInt q = 0; q < 3 * cover.n_multipliers; q++, n++) {
      local[n]  = s->layout.multiplier[i] + q;
      remote[n] = (PetscSFNode){ old->rank[i], old->multiplier[i] + q };
    }
  }
  PetscCall(PetscSFCreate(s->scene->comm, &sf));
  PetscCall(PetscSFSetGraph(sf, old->n_local, n, local, PETSC_COPY_VALUES, remote, PETSC_COPY_VALUES));
  PetscCall(PetscSFBcastBegin(sf, MPIU_SCALAR, old_lambda, s->lambda, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, MPIU_SCALAR, old_lambda, s->lambda, MPI_REPLACE));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscFree2(remote, local));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleUpdateLayout(DLMSaddle s)
{
  DLMBodyLayout old = s->layout;
  PetscReal    *old_lambda = s->lambda;
  PetscBool     same;

  PetscFunctionBeginUser;
  PetscCall(DLMPairingUpdate(s->pairing));
  PetscCall(PetscMemzero(&s->layout, sizeof(s->layout)));
  PetscCall(DLMLayoutUpdate(s->spheres, s->pairing, &s->layout));
  PetscCall(PetscRealloc(PetscMax(1, 3 * s->pairing->markers.n) * sizeof(PetscScalar), &s->at_points));
  same = (PetscBool)(old.points && old.n_local == s->layout.n_local);
  for (PetscInt i = 0; same && i < s->scene->n_spheres; i++)
    same = (PetscBool)(old.points[i] == s->layout.points[i] && old.rank[i] == s->layout.rank[i] && old.multiplier[i] == s->layout.multiplier[i]);
  if (!same || s->scene->pairing_points == DLM_POINTS_VOLUME) {
    s->lambda = NULL;
    PetscCall(CarryMultipliers(s, &old, old_lambda));
    PetscCall(PetscFree(old_lambda));
  }
  PetscCall(DLMLayoutDestroy(&old));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPIU_BOOL, MPI_LAND, s->scene->comm));
  if (!same || !s->ksp) PetscCall(DLMSaddleBuildSolver(s));
  PetscFunctionReturn(0);
}

/* Tables and blocks for the first centres belong to the set-up, and so do markers and solver, which are made between them. */
static PetscErrorCode CreateForSpheres(DLMSaddle s)
{
  PetscReal      before;
  PetscLogDouble start, end;

  PetscFunctionBeginUser;
  PetscCall(DLMLubricationCreate(s->scene, &s->lubrication));
  PetscCall(DLMBlocksCreate(s->stokes, s->pairing, s->spheres, s->scene, &s->lubrication, s->uzawa, &s->blocks));
  if (s->blocks->response) s->parts.response_bytes = DLMResponseBytes(s->blocks->response->far);
  before = DLMMemoryInUse();
  PetscCall(DLMPairingUpdate(s->pairing));
  s->parts.pairing_bytes = DLMMemoryInUse() - before;
  PetscCall(DLMSaddleUpdateLayout(s));
  before = DLMMemoryInUse();
  PetscCall(PetscTime(&start));
  PetscCall(DLMBlocksUpdate(s->blocks, &s->layout, 0.0));
  PetscCall(PetscTime(&end));
  s->parts.block_bytes   = DLMMemoryInUse() - before;
  s->parts.block_seconds = end - start;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleCreate(DLMStokes stokes, DLMSpheres spheres, DLMPairing pairing, const DLMScene *scene, DLMSaddle *new_saddle)
{
  static const char *const splits[] = { "fluid", "velocity" };
  PetscInt                 split    = 0;
  DLMSaddle                s;
  PetscBool                set;

  PetscFunctionBeginUser;
  PetscCall(DLMSaddleRegister());
  PetscCall(PetscNew(&s));
  s->stokes    = stokes;
  s->spheres   = spheres;
  s->pairing   = pairing;
  s->scene     = scene;
  s->rtol      = scene->saddle_rtol;
  s->viscosity = 1.0;
  PetscCall(PetscOptionsGetEList(NULL, NULL, "-saddle_split", splits, 2, &split, &set));
  s->uzawa = (PetscBool)(split == 1);
  PetscCall(DLMStokesCreateVec(stokes, &s->fluid));
  if (s->uzawa && !stokes->mass) PetscCall(DLMStokesBuildPressureMass(stokes));
  if (s->uzawa) {
    PetscCall(MatCreateVecs(stokes->mass, &s->lumped_mass, NULL));
    PetscCall(MatGetRowSum(stokes->mass, s->lumped_mass));
    PetscCall(VecScale(s->lumped_mass, DLMUzawaFactor));
  }
  if (scene->n_spheres) PetscCall(CreateForSpheres(s));
  *new_saddle = s;
  PetscFunctionReturn(0);
}

/* Starts from the last velocities, then moves (lambda, U) onto the force balance R^T lambda + (M/dt + Z) U = F + M U_old/dt. */
static PetscErrorCode BalanceStart(DLMSaddle s, const PetscReal *force, const PetscReal *torque)
{
  PetscScalar *r, *z, *load, *friction;

  PetscFunctionBeginUser;
  PetscCall(PetscCalloc4(s->layout.n_local, &r, s->layout.n_local, &z, 6 * s->spheres->n_owned, &load, 6 * s->scene->n_spheres, &friction));
  PetscCall(DLMSaddleLoads(s, s->lambda, load));
  DLMSaddleAddFriction(s, friction);
  for (PetscInt k = 0; k < s->spheres->n_owned; k++) {
    const PetscInt        i     = s->spheres->owned[k];
    const DLMSphereState *state = &s->spheres->state[i];
    PetscReal            *U = s->lambda + s->layout.rigid[i], *balance = r + s->layout.rigid[i], mass[6];
    DLMRigidMass(s->scene, i, s->inertia.weight, mass);
    for (int c = 0; c < 6; c++) {
      const int        d = c % 3;
      const PetscReal  now = c < 3 ? state->velocity[d] : state->omega[d], before = c < 3 ? state->velocity_before[d] : state->omega_before[d];
      const PetscReal *outer = c < 3 ? force : torque;
      U[c]                   = now;
      if (DLMRigidHeld(s->scene, i, c)) continue;
      balance[c] = (outer ? outer[3 * i + d] / s->viscosity : 0.0) + friction[6 * i + c] - load[6 * k + c];
      if (s->inertia.weight > 0.0) balance[c] += mass[c] * (s->inertia.now * now + s->inertia.before * before - U[c]);
    }
  }
  PetscCall(DLMBlocksApply(s->blocks, r, z));
  for (PetscInt i = 0; i < s->layout.n_local; i++) s->lambda[i] += z[i];
  if (!s->uzawa) { /* its norm is that of a velocity: the largest first residual stays the reference */
    PetscCall(DLMBlocksEnergy(s->blocks, s->lambda, &s->reference));
    s->reference = PetscSqrtReal(s->reference / s->blocks->scale);
  }
  PetscCall(PetscFree4(r, z, load, friction));
  PetscFunctionReturn(0);
}

/* Uzawa solves for the increment of the pressure too: f -= -B^T p of the last one. */
static PetscErrorCode SubtractPressure(DLMSaddle s)
{
  const PetscScalar *push;
  PetscScalar       *f;
  Vec                u, p, work;

  PetscFunctionBeginUser;
  PetscCall(DLMStokesGetParts(s->stokes, s->fluid, &u, &p));
  PetscCall(VecDuplicate(u, &work));
  PetscCall(MatMult(s->stokes->BT, p, work));
  PetscCall(VecGetArrayRead(work, &push));
  PetscCall(VecGetArray(s->rhs, &f));
  for (PetscInt i = 0; i < s->stokes->n_u; i++) f[i] -= push[i];
  PetscCall(VecRestoreArray(s->rhs, &f));
  PetscCall(VecRestoreArrayRead(work, &push));
  PetscCall(VecDestroy(&work));
  PetscCall(DLMStokesRestoreParts(s->stokes, s->fluid, &u, &p));
  PetscFunctionReturn(0);
}

/* f[n_u + n_p] <- wall velocities, the mean pressure gradient and the body force, over the ratio of the viscosities where they are forces. */
static PetscErrorCode SetFluidForce(DLMSaddle s, Vec body_force, PetscScalar *f)
{
  const PetscScalar *wall, *extra;

  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(s->stokes->wall_force, &wall));
  PetscCall(PetscArraycpy(f, wall, s->stokes->n_u + s->stokes->n_p));
  PetscCall(VecRestoreArrayRead(s->stokes->wall_force, &wall));
  if (s->viscosity != 1.0) DLMStokesAddPressureGradient(s->stokes, s->scene->pressure_gradient, 1.0 / s->viscosity - 1.0, f);
  if (!body_force) PetscFunctionReturn(0);
  PetscCall(VecGetArrayRead(body_force, &extra));
  for (PetscInt i = 0; i < s->stokes->n_u; i++) f[i] += extra[i] / s->viscosity;
  PetscCall(VecRestoreArrayRead(body_force, &extra));
  PetscFunctionReturn(0);
}

/* Right-hand side for the increments of lambda and U (and of the pressure, under Uzawa). */
static PetscErrorCode SetRightHandSide(DLMSaddle s, Vec body_force)
{
  const PetscInt n_u = s->stokes->n_u, n_p = s->stokes->n_p;
  PetscScalar   *f;

  PetscFunctionBeginUser;
  PetscCall(VecGetArray(s->rhs, &f));
  PetscCall(SetFluidForce(s, body_force, f));
  PetscCall(PetscArrayzero(f + n_u + n_p, s->layout.n_local));
  PetscCall(DLMSaddleRigidMotion(s, s->lambda + s->layout.n_multipliers, f + n_u + n_p));
  PetscCall(DLMSaddleComply(s, s->lambda, f + n_u + n_p));
  for (PetscInt i = 0; i < s->layout.n_multipliers; i++) f[n_u + n_p + i] = -f[n_u + n_p + i];
  PetscCall(VecRestoreArray(s->rhs, &f));
  PetscCall(DLMPairingExpand(s->pairing, s->lambda, s->at_points));
  PetscCall(DLMPairingSpread(s->pairing, 1.0, s->at_points, s->rhs));
  if (s->uzawa) PetscCall(SubtractPressure(s));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleScaleStress(DLMSaddle s, PetscReal factor)
{
  Vec p;

  PetscFunctionBeginUser;
  if (factor == 1.0) PetscFunctionReturn(0);
  PetscCall(DLMStokesGetParts(s->stokes, s->fluid, NULL, &p));
  PetscCall(VecScale(p, factor));
  PetscCall(DLMStokesRestoreParts(s->stokes, s->fluid, NULL, &p));
  for (PetscInt i = 0; i < s->layout.n_multipliers; i++) s->lambda[i] *= factor;
  PetscFunctionReturn(0);
}

static PetscErrorCode SolveFluidAlone(DLMSaddle s, Vec body_force)
{
  Vec          rhs;
  PetscScalar *f;

  PetscFunctionBeginUser;
  PetscCall(VecDuplicate(s->stokes->wall_force, &rhs));
  PetscCall(VecGetArray(rhs, &f));
  PetscCall(SetFluidForce(s, body_force, f));
  PetscCall(VecRestoreArray(rhs, &f));
  PetscCall(DLMSaddleScaleStress(s, 1.0 / s->viscosity));
  PetscCall(DLMStokesSolve(s->stokes, rhs, s->fluid));
  PetscCall(DLMSaddleScaleStress(s, s->viscosity));
  PetscCall(VecDestroy(&rhs));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleSolve(DLMSaddle s, DLMInertia inertia, const PetscReal *force, const PetscReal *torque, Vec body_force)
{
  KSPConvergedReason reason;
  PetscInt           its;

  PetscFunctionBeginUser;
  if (!s->scene->n_spheres) {
    PetscCall(SolveFluidAlone(s, body_force));
    PetscFunctionReturn(0);
  }
  inertia.weight /= s->viscosity;
  s->inertia = inertia;
  PetscCall(DLMSaddleUpdateLayout(s));
  PetscCall(DLMSaddleScaleStress(s, 1.0 / s->viscosity));
  PetscCall(DLMLubricationUpdate(&s->lubrication, s->spheres));
  PetscCall(DLMBlocksUpdate(s->blocks, &s->layout, inertia.weight));
  PetscCall(BalanceStart(s, force, torque));
  PetscCall(SetRightHandSide(s, body_force));
  PetscCall(KSPSolve(s->ksp, s->rhs, s->x));
  PetscCall(DLMStokesRequireSolved(s->stokes));
  PetscCall(KSPGetConvergedReason(s->bodies_ksp, &reason));
  PetscCall(KSPGetIterationNumber(s->bodies_ksp, &its));
  DLMUserCheck(reason != KSP_DIVERGED_NANORINF, s->scene->comm, "the flow is no longer finite: use a smaller -ts_dt");
  PetscCheck(reason > 0, s->scene->comm, PETSC_ERR_NOT_CONVERGED,
             "-saddle_rtol %.3g: the bodies' solve did not reach it in %" PetscInt_FMT " iterations (%s); allowed: a larger one, a smaller -ts_dt, or a larger "
             "-saddle_fieldsplit_%s_ksp_max_it",
             (double)s->rtol, its, KSPConvergedReasons[reason], s->uzawa ? "multipliers" : "bodies");
  s->work.solves++;
  s->work.iterations += its;
  s->work.last_iterations = its;
  s->work.most_iterations = PetscMax(s->work.most_iterations, its);
  s->work.blocks_built    = s->blocks->built;
  PetscCall(DLMSaddleStoreResult(s));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleSetTolerance(DLMSaddle s, PetscReal rtol)
{
  PetscFunctionBeginUser;
  s->rtol = rtol;
  if (s->bodies_ksp) PetscCall(KSPSetTolerances(s->bodies_ksp, rtol, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleSetViscosity(DLMSaddle s, PetscReal ratio)
{
  PetscFunctionBeginUser;
  s->viscosity = ratio;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleGetFluid(DLMSaddle s, Vec *x)
{
  PetscFunctionBeginUser;
  *x = s->fluid;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleGetWork(DLMSaddle s, DLMSaddleWork *work)
{
  PetscFunctionBeginUser;
  *work = s->work;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleGetParts(DLMSaddle s, DLMSaddleParts *parts)
{
  PetscFunctionBeginUser;
  *parts = s->parts;
  if (!s->blocks) PetscFunctionReturn(0);
  parts->clusters = s->blocks->n_clusters;
  parts->largest  = s->blocks->largest;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSaddleView(DLMSaddle s, PetscViewer viewer)
{
  PetscFunctionBeginUser;
  if (!s->scene->n_spheres) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "Bodies: none\n"));
  } else if (s->uzawa) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "Bodies: Uzawa conjugate gradients on pressure and multipliers\n"));
  } else {
    PetscCall(PetscViewerASCIIPrintf(viewer, "Bodies: conjugate gradients, dense blocks from impulse responses (near %" PetscInt_FMT ", far %" PetscInt_FMT " h)\n",
                                     s->blocks->response->near, s->blocks->response->far));
  }
  PetscFunctionReturn(0);
}
