#include "../../include/private/simimpl.h"

PetscErrorCode DLMSimulationCreatePolymer(DLMSimulation sim)
{
  Vec x, u;

  PetscFunctionBegin;
  PetscCall(DLMPolymerCreate(sim->grid, sim->spheres, &sim->riding, &sim->polymer));
  PetscCall(DLMSaddleGetFluid(sim->saddle, &x));
  PetscCall(DLMStokesGetParts(sim->stokes, x, &u, NULL));
  PetscCall(VecDuplicate(u, &sim->body_force));
  PetscCall(DLMStokesRestoreParts(sim->stokes, x, &u, NULL));
  sim->worst = (DLMPolymerHealth){ .smallest_eigenvalue = 1.0, .largest_trace = 3.0, .sound = PETSC_TRUE };
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationDestroyPolymer(DLMSimulation sim)
{
  PetscFunctionBegin;
  PetscCall(VecDestroy(&sim->body_force));
  PetscCall(PetscFree(sim->kept));
  PetscCall(VecDestroy(&sim->kept_fluid));
  PetscCall(DLMPolymerDestroy(&sim->polymer));
  PetscFunctionReturn(0);
}

static PetscErrorCode SolveSaddle(DLMSimulation sim, DLMInertia inertia)
{
  PetscFunctionBegin;
  PetscCall(DLMSaddleSolve(sim->saddle, inertia, sim->spheres ? sim->force : NULL, sim->spheres ? sim->torque : NULL, sim->body_force));
  PetscFunctionReturn(0);
}

/* Norm of the velocity in x: with the pressure it would depend on the units. */
static PetscErrorCode VelocityNorm(DLMSimulation sim, Vec x, PetscReal *norm)
{
  Vec u;

  PetscFunctionBegin;
  PetscCall(DLMStokesGetParts(sim->stokes, x, &u, NULL));
  PetscCall(VecNorm(u, NORM_2, norm));
  PetscCall(DLMStokesRestoreParts(sim->stokes, x, &u, NULL));
  PetscFunctionReturn(0);
}

/* Chebyshev iteration for u = S(u), the eigenvalues of I - S' lying between low and 1. */
typedef struct {
  PetscReal theta, delta, rho;
  Vec       d; /* the last change */
} Chebyshev;

/* Half the sum and half the difference of the bounds. The solvent's part of the implicit viscosity is the lower one; a thinning solvent may lose any part of it. */
static void ChebyshevSet(DLMSimulation sim, Chebyshev *c)
{
  const DLMScene *scene = sim->scene;
  const PetscBool thins = (PetscBool)(scene->fluid_model == DLM_FLUID_CARREAU && scene->carreau_n < 1.0);
  const PetscReal low   = PetscMax(thins ? 0.0 : scene->fluid_viscosity * scene->retardation_time / (scene->relaxation_time * sim->implicit_viscosity), 0.05);

  c->theta = 0.5 * (1.0 + low);
  c->delta = 0.5 * (1.0 - low);
  c->rho   = 0.0;
}

/* u, which holds S(u) - u, becomes the next iterate; x: S(u). */
static PetscErrorCode ChebyshevUpdate(Chebyshev *c, Vec x, Vec u)
{
  PetscFunctionBegin;
  if (c->rho == 0.0) {
    PetscCall(VecCopy(u, c->d));
    PetscCall(VecScale(c->d, 1.0 / c->theta));
    c->rho = c->delta / c->theta;
  } else {
    const PetscReal next = 1.0 / (2.0 * c->theta - c->rho * c->delta); /* delta is 0 where all is solvent */
    PetscCall(VecAXPBY(c->d, 2.0 * next, c->delta * next * c->rho, u));
    c->rho = c->delta * next;
  }
  PetscCall(VecAXPBY(u, 1.0, -1.0, x)); /* the old u again */
  PetscCall(VecAXPY(u, 1.0, c->d));
  PetscFunctionReturn(0);
}

/*
  The both-sides coupling takes the projected gradient from the last velocity. Before the first step there is none: u = S(u) is solved by iteration
  (docs/theory.md, V4).
*/
static PetscErrorCode SolveFirstFlow(DLMSimulation sim, PetscReal t, PetscReal target, PetscInt order, DLMInertia inertia)
{
  PetscReal       size, change;
  DLMSphereState *state, *start = NULL;
  PetscInt        n = 0;
  Chebyshev       c;
  Vec             x, u;

  PetscFunctionBegin;
  if (sim->spheres) {
    PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
    PetscCall(PetscMalloc1(n, &start));
    PetscCall(PetscArraycpy(start, state, n));
  }
  PetscCall(DLMSaddleGetFluid(sim->saddle, &x));
  PetscCall(VecDuplicate(x, &u));
  PetscCall(VecDuplicate(x, &c.d));
  ChebyshevSet(sim, &c);
  PetscCall(DLMPolymerForce(sim->polymer, t, t, order, sim->body_force));
  PetscCall(SolveSaddle(sim, inertia));
  PetscCall(VecCopy(x, u));
  for (PetscInt k = 0; k < 40; k++) {
    PetscCall(DLMPolymerSetVelocity(sim->polymer, target, u));
    PetscCall(DLMPolymerForce(sim->polymer, t, t, order, sim->body_force));
    if (n && inertia.weight > 0.0) PetscCall(PetscArraycpy(state, start, n)); /* without inertia the last velocities are but a guess */
    PetscCall(SolveSaddle(sim, inertia));
    PetscCall(VelocityNorm(sim, x, &size));
    PetscCall(VecAXPBY(u, 1.0, -1.0, x)); /* u <- S(u) - u */
    PetscCall(VelocityNorm(sim, u, &change));
    PetscCall(ChebyshevUpdate(&c, x, u));
    if (change <= PetscMax(10.0 * sim->scene->saddle_rtol, 1e-7) * size) break;
  }
  PetscCall(VecDestroy(&u));
  PetscCall(VecDestroy(&c.d));
  PetscCall(PetscFree(start));
  PetscFunctionReturn(0);
}

/* The multipliers hold the jump of the traction; with the moment of its inner side, which is the stress in the sphere, the stresslet is that of the outer one (B7). */
static PetscErrorCode CompleteStresslets(DLMSimulation sim)
{
  DLMSphereState  *state;
  const PetscReal *stress;
  PetscInt         n;

  PetscFunctionBegin;
  if (!sim->spheres) PetscFunctionReturn(0);
  PetscCall(DLMPolymerGetInsideStress(sim->polymer, &stress));
  PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal *inside = stress + 6 * i, trace = (inside[0] + inside[1] + inside[2]) / 3.0;
    for (int k = 0; k < 6; k++) state[i].stresslet[k] += inside[k] - (k < 3 ? trace : 0.0);
  }
  PetscFunctionReturn(0);
}

/* The both-sides coupling has no velocity yet to take the projected gradient from. */
static PetscBool IsFirst(DLMSimulation sim)
{
  return (PetscBool)(sim->scene->polymer_coupling == DLM_COUPLING_BOTH_SIDES && !sim->flowing);
}

/* The time that the velocities of a step belong to. */
static PetscReal Target(DLMSimulation sim, PetscReal t, PetscReal dt)
{
  PetscInt order = 1;

  (void)DLMSplitGetScheme(sim->ts, NULL, &order);
  return t + (order == 2 ? 0.5 : 1.0) * dt;
}

PetscErrorCode DLMSimulationSetViscosity(DLMSimulation sim, PetscReal t, PetscReal dt)
{
  PetscReal ratio;

  PetscFunctionBegin;
  if (!sim->polymer) PetscFunctionReturn(0);
  PetscCall(DLMPolymerChooseViscosity(sim->polymer, dt, IsFirst(sim) ? t : Target(sim, t, dt), &sim->implicit_viscosity));
  ratio = sim->implicit_viscosity / sim->scene->implicit_viscosity;
  PetscCall(DLMSaddleSetViscosity(sim->saddle, ratio));
  if (sim->contact.exists) DLMContactSetViscosity(sim->whole, ratio, &sim->contact);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationSolveFlow(DLMSimulation sim, PetscReal t, PetscReal dt, DLMInertia inertia)
{
  const PetscReal target = Target(sim, t, dt);
  PetscInt        order;
  Vec             x;

  PetscFunctionBegin;
  if (!sim->polymer) {
    PetscCall(SolveSaddle(sim, inertia));
    sim->flowing = PETSC_TRUE;
    PetscFunctionReturn(0);
  }
  PetscCall(DLMSplitGetScheme(sim->ts, NULL, &order));
  PetscCall(DLMPolymerSetInside(sim->polymer));
  PetscCall(DLMAdaptNoteConformation(sim));
  if (IsFirst(sim)) {
    PetscCall(SolveFirstFlow(sim, t, target, order, inertia));
  } else {
    PetscCall(DLMPolymerForce(sim->polymer, t, target, order, sim->body_force));
    PetscCall(SolveSaddle(sim, inertia));
  }
  sim->flowing = PETSC_TRUE;
  PetscCall(CompleteStresslets(sim));
  PetscCall(DLMSaddleGetFluid(sim->saddle, &x));
  PetscCall(DLMPolymerSetVelocity(sim->polymer, target, x));
  PetscFunctionReturn(0);
}

static PetscErrorCode Advect(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  PetscFunctionBegin;
  PetscCall(DLMPolymerAdvect(((DLMSimulation)context)->polymer, fraction * dt));
  PetscFunctionReturn(0);
}

static PetscErrorCode Stretch(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  DLMSimulation sim = (DLMSimulation)context;
  PetscInt      order;

  PetscFunctionBegin;
  PetscCall(DLMSplitGetScheme(sim->ts, NULL, &order));
  PetscCall(DLMPolymerStretch(sim->polymer, fraction * dt, order));
  PetscFunctionReturn(0);
}

PetscReal DLMSimulationElasticNumber(DLMSimulation sim, PetscReal dt, PetscReal trace)
{
  const DLMScene *scene = sim->scene;

  return dt * scene->fluid_viscosity * (1.0 - scene->retardation_time / scene->relaxation_time) * trace / (scene->relaxation_time * scene->implicit_viscosity);
}

/* C must be finite and positive definite, or the step is rejected. */
static PetscErrorCode Judge(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  DLMSimulation    sim = (DLMSimulation)context;
  DLMPolymerHealth now;

  PetscFunctionBegin;
  PetscCall(DLMPolymerGetHealth(sim->polymer, &now));
  if (!now.sound) {
    sim->worst_time = t + dt;
    for (int d = 0; d < 3; d++) sim->worst.place[d] = now.place[d];
    PetscCall(DLMSplitReject(sim->ts));
    PetscFunctionReturn(0);
  }
  sim->health = now;
  if (now.smallest_eigenvalue < sim->worst.smallest_eigenvalue) {
    sim->worst.smallest_eigenvalue = now.smallest_eigenvalue;
    for (int d = 0; d < 3; d++) sim->worst.place[d] = now.place[d];
    sim->worst_time = t + dt;
  }
  sim->worst.largest_trace = PetscMax(sim->worst.largest_trace, now.largest_trace);
  sim->worst.courant       = PetscMax(sim->worst.courant, now.courant);
  sim->worst.substeps      = PetscMax(sim->worst.substeps, now.substeps);
  PetscFunctionReturn(0);
}

/*
  Largest dt of the explicit coupling: a shear mode obeys g = -K s, s' = -(s - g)/lambda1, K = (eta1 - mu)/mu; with decay e = 1 - exp(-dt/lambda1) it is stable up to
  e = 2/(1 + K) under an order-1 scheme, 2/(1 + 2 K) under order 2 (docs/theory.md, V4).
*/
PetscReal DLMSimulationExplicitBound(DLMSimulation sim)
{
  const DLMScene *scene = sim->scene;
  PetscInt        order = 1;

  (void)DLMSplitGetScheme(sim->ts, NULL, &order);
  const PetscReal K = scene->relaxation_time / scene->retardation_time - 1.0, e = 2.0 / (1.0 + order * K);
  return e < 1.0 ? -scene->relaxation_time * PetscLogReal(1.0 - e) : PETSC_INFINITY;
}

/*
  In steady shear with g = lambda1 times the rate, the Carreau fluid's stress answers a change of the rate at once with eta1(g) (lambda2/lambda1 - (1 - n) g^2/(1 + g^2)): where
  that is negative, shear flow is unstable (docs/theory.md, V6).
*/
static PetscErrorCode WarnOfThinning(DLMSimulation sim)
{
  const DLMScene *scene   = sim->scene;
  const PetscReal solvent = scene->retardation_time / scene->relaxation_time, loss = 1.0 - scene->carreau_n;

  PetscFunctionBegin;
  if (!sim->polymer || scene->fluid_model != DLM_FLUID_CARREAU || loss <= solvent) PetscFunctionReturn(0);
  PetscCall(PetscPrintf(scene->comm,
                        "dlmfd: warning: -fluid_carreau_n %.6g thins by more than the solvent holds: where the shear rate is above %.4g shear flow of this fluid is unstable; n from %.6g on never is\n",
                        (double)scene->carreau_n, (double)(PetscSqrtReal(solvent / (loss - solvent)) / scene->relaxation_time), (double)(1.0 - solvent)));
  PetscFunctionReturn(0);
}

static PetscErrorCode WarnOfTimeStep(DLMSimulation sim)
{
  const DLMScene *scene = sim->scene;
  PetscReal       bound;

  PetscFunctionBegin;
  if (!sim->polymer || scene->polymer_coupling != DLM_COUPLING_EXPLICIT) PetscFunctionReturn(0);
  bound = DLMSimulationExplicitBound(sim);
  if (scene->ts_dt > bound)
    PetscCall(PetscPrintf(scene->comm, "dlmfd: warning: -ts_dt %.6g is above %.6g, where -polymer_coupling explicit becomes unstable; use a smaller step or both_sides\n",
                          (double)scene->ts_dt, (double)bound));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationWarn(DLMSimulation sim)
{
  PetscFunctionBegin;
  PetscCall(WarnOfTimeStep(sim));
  PetscCall(WarnOfThinning(sim));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSimulationAddPolymerSubsteps(DLMSimulation sim)
{
  PetscFunctionBegin;
  PetscCall(DLMSplitAddSubstep(sim->ts, "advect", Advect, sim));
  PetscCall(DLMSplitAddSubstep(sim->ts, "stretch", Stretch, sim));
  PetscCall(DLMSplitAddSubstep(sim->ts, "judge", Judge, sim));
  PetscFunctionReturn(0);
}
