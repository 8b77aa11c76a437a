/* The TS type "split" on an equation of known solution: orders, final time, limits, skipped verbs, and what it counts. */
#include "dlmtest.h"
#include "dlmsplit.h"

/* y' = (A + B) y with A = [0 1; -1 0] and B = [-1 0; 1 0]: each solved exactly, they do not commute. */
typedef struct {
  double   y[2];
  PetscInt order[64], n_calls; /* which verb was called when */
  double   fractions[64];
  PetscInt loads, stores;
} Model;

static void Count(Model *m, PetscInt verb, double fraction)
{
  if (m->n_calls < 64) {
    m->order[m->n_calls]     = verb;
    m->fractions[m->n_calls] = fraction;
  }
  m->n_calls++;
}

static PetscErrorCode Advect(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  Model       *m = context;
  const double s = fraction * dt, y[2] = { m->y[0], m->y[1] };

  Count(m, 2, fraction);
  m->y[0] = cos(s) * y[0] + sin(s) * y[1];
  m->y[1] = -sin(s) * y[0] + cos(s) * y[1];
  return 0;
}

static PetscErrorCode Stretch(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  Model       *m = context;
  const double decay = exp(-fraction * dt), y0 = m->y[0];

  Count(m, 3, fraction);
  m->y[0] = decay * y0;
  m->y[1] += (1.0 - decay) * y0;
  return 0;
}

static PetscErrorCode Predict(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  Count(context, 0, fraction);
  return 0;
}

static PetscErrorCode Saddle(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  Count(context, 1, fraction);
  return 0;
}

static PetscErrorCode Correct(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  Count(context, 4, fraction);
  return 0;
}

static PetscErrorCode Load(void *context, Vec solution)
{
  Model             *m = context;
  const PetscScalar *x;

  m->loads++;
  PetscCall(VecGetArrayRead(solution, &x));
  for (int i = 0; i < 2; i++) m->y[i] = x[i];
  PetscCall(VecRestoreArrayRead(solution, &x));
  return 0;
}

static PetscErrorCode Store(void *context, Vec solution)
{
  Model       *m = context;
  PetscScalar *x;

  m->stores++;
  PetscCall(VecGetArray(solution, &x));
  for (int i = 0; i < 2; i++) x[i] = m->y[i];
  PetscCall(VecRestoreArray(solution, &x));
  return 0;
}

enum { PREDICT = 1, SADDLE = 2, ADVECT = 4, STRETCH = 8, CORRECT = 16, ALL = 31 };

typedef struct {
  Model model;
  TS    ts;
  Vec   y;
} Case;

/* Every rank steps a model of its own. The verbs are added in an order that is not the scheme's. */
static void OpenCase(int verbs, double dt, double end, const char *options, Case *c)
{
  Call(PetscOptionsClear(NULL));
  Call(PetscOptionsInsertString(NULL, options));
  Call(DLMSplitRegister());
  memset(&c->model, 0, sizeof(c->model));
  Call(TSCreate(PETSC_COMM_SELF, &c->ts));
  Call(TSSetType(c->ts, TSSPLIT));
  Call(TSSetProblemType(c->ts, TS_NONLINEAR));
  Call(TSSetTimeStep(c->ts, dt));
  Call(TSSetMaxTime(c->ts, end));
  Call(TSSetExactFinalTime(c->ts, TS_EXACTFINALTIME_MATCHSTEP));
  if (verbs & STRETCH) Call(DLMSplitAddSubstep(c->ts, "stretch", Stretch, &c->model));
  if (verbs & ADVECT) Call(DLMSplitAddSubstep(c->ts, "advect", Advect, &c->model));
  if (verbs & CORRECT) Call(DLMSplitAddSubstep(c->ts, "correct", Correct, &c->model));
  if (verbs & PREDICT) Call(DLMSplitAddSubstep(c->ts, "predict", Predict, &c->model));
  if (verbs & SADDLE) Call(DLMSplitAddSubstep(c->ts, "saddle", Saddle, &c->model));
  Call(DLMSplitSetState(c->ts, Load, Store, &c->model));
  Call(TSSetFromOptions(c->ts));
  Call(VecCreateSeq(PETSC_COMM_SELF, 2, &c->y));
  Call(VecSetValue(c->y, 0, 1.0, INSERT_VALUES));
  Call(VecSetValue(c->y, 1, 0.5, INSERT_VALUES));
  Call(VecAssemblyBegin(c->y));
  Call(VecAssemblyEnd(c->y));
}

static void CloseCase(Case *c)
{
  Call(VecDestroy(&c->y));
  Call(TSDestroy(&c->ts));
}

/* A + B = [-1 1; 0 0]: y0 = y1 + (y0(0) - y1(0)) exp(-t), y1 stays. */
static double Error(Case *c, double t)
{
  const PetscScalar *x;
  double             error;

  Call(VecGetArrayRead(c->y, &x));
  error = hypot(x[0] - 0.5 - 0.5 * exp(-t), x[1] - 0.5);
  Call(VecRestoreArrayRead(c->y, &x));
  return error;
}

static double ErrorAt(const char *scheme, double dt, double end)
{
  Case   c;
  double error;

  OpenCase(ALL, dt, end, "", &c);
  Call(DLMSplitSetScheme(c.ts, scheme));
  Call(TSSolve(c.ts, c.y));
  error = Error(&c, end);
  CloseCase(&c);
  return error;
}

static void LieIsOfOrderOneAndStrangOfOrderTwo(void **state)
{
  const char *const schemes[2] = { "lie", "strang" };

  for (int s = 0; s < 2; s++) {
    double      error[3];
    const char *name;
    PetscInt    order;
    Case        c;
    for (int k = 0; k < 3; k++) error[k] = ErrorAt(schemes[s], 0.1 / (1 << k), 2.0);
    print_message("  %s: errors %.3e %.3e %.3e, orders %.3f %.3f\n", schemes[s], error[0], error[1], error[2], log2(error[0] / error[1]), log2(error[1] / error[2]));
    for (int k = 0; k < 2; k++) AssertNear(log2(error[k] / error[k + 1]), s + 1.0, 0.1);
    OpenCase(ALL, 0.1, 1.0, s ? "-ts_split_scheme strang" : "-ts_split_scheme lie", &c);
    Call(DLMSplitGetScheme(c.ts, &name, &order));
    assert_string_equal(name, schemes[s]);
    assert_int_equal(order, s + 1);
    CloseCase(&c);
  }
}

/* The verbs, in order: 0 predict, 1 saddle, 2 advect, 3 stretch, 4 correct. */
static void ExpectSteps(const char *scheme, int verbs, int n, const int *order, const double *fraction)
{
  Case c;

  OpenCase(verbs, 0.25, 0.5, "", &c);
  Call(DLMSplitSetScheme(c.ts, scheme));
  Call(TSSolve(c.ts, c.y));
  assert_int_equal(c.model.n_calls, 2 * n);
  for (int k = 0; k < 2 * n; k++) {
    assert_int_equal(c.model.order[k], order[k % n]);
    AssertNear(c.model.fractions[k], fraction[k % n], 0.0);
  }
  assert_int_equal(c.model.loads, 1);
  assert_int_equal(c.model.stores, 2);
  CloseCase(&c);
}

static void TheSchemesAreWalkedInOrder(void **state)
{
  ExpectSteps("lie", ALL, 4, (int[]){ 0, 1, 2, 3 }, (double[]){ 1.0, 1.0, 1.0, 1.0 });
  ExpectSteps("strang", ALL, 6, (int[]){ 0, 1, 3, 2, 3, 4 }, (double[]){ 0.5, 1.0, 0.5, 1.0, 0.5, 1.0 });
}

static void AbsentVerbsAreSkipped(void **state)
{
  ExpectSteps("lie", SADDLE, 1, (int[]){ 1 }, (double[]){ 1.0 });
  ExpectSteps("lie", PREDICT | SADDLE | CORRECT, 2, (int[]){ 0, 1 }, (double[]){ 1.0, 1.0 });
  ExpectSteps("strang", PREDICT | SADDLE | CORRECT, 3, (int[]){ 0, 1, 4 }, (double[]){ 0.5, 1.0, 1.0 });
  ExpectSteps("strang", STRETCH, 2, (int[]){ 3, 3 }, (double[]){ 0.5, 0.5 });
}

static void VerbsBeyondTheSchemeAreIgnored(void **state)
{
  Case c;

  OpenCase(ADVECT, 0.5, 1.0, "", &c);
  Call(DLMSplitAddSubstep(c.ts, "nowhere", Stretch, &c.model));
  Call(TSSolve(c.ts, c.y));
  assert_int_equal(c.model.n_calls, 2);
  CloseCase(&c);
}

static void TheFinalTimeIsExact(void **state)
{
  const double steps[] = { 0.3, 0.7, 0.26, 5.0 };

  for (int k = 0; k < 4; k++) {
    Case      c;
    PetscReal t;
    PetscInt  n;
    OpenCase(ALL, steps[k], 2.0, "-ts_split_scheme strang", &c);
    Call(TSSolve(c.ts, c.y));
    Call(TSGetTime(c.ts, &t));
    Call(TSGetStepNumber(c.ts, &n));
    AssertNear(t, 2.0, 1e-14);
    assert_int_equal(n, (int)ceil(2.0 / steps[k]));
    if (k < 3) AssertNear(Error(&c, 2.0), 0.0, 0.4 * steps[k] * steps[k]);
    CloseCase(&c);
  }
}

static void TheNumberOfStepsIsLimited(void **state)
{
  Case      c;
  PetscReal t;
  PetscInt  n;

  OpenCase(ALL, 0.1, 2.0, "-ts_max_steps 3", &c);
  Call(TSSolve(c.ts, c.y));
  Call(TSGetTime(c.ts, &t));
  Call(TSGetStepNumber(c.ts, &n));
  assert_int_equal(n, 3);
  AssertNear(t, 0.3, 1e-14);
  assert_int_equal(c.model.n_calls, 18);
  CloseCase(&c);
}

/* TSSolve twice: the second run goes on from the solution of the first. */
static void ARunGoesOn(void **state)
{
  Case c;

  OpenCase(ALL, 0.05, 1.0, "-ts_split_scheme strang", &c);
  Call(TSSolve(c.ts, c.y));
  Call(TSSetMaxTime(c.ts, 2.0));
  Call(TSSolve(c.ts, c.y));
  AssertNear(Error(&c, 2.0), ErrorAt("strang", 0.05, 2.0), 1e-14);
  CloseCase(&c);
}

static void UnknownSchemesAreRefused(void **state)
{
  const char    *name;
  PetscErrorCode result;
  Case           c;

  OpenCase(ALL, 0.1, 1.0, "", &c);
  CallKeepingMessage(result, DLMSplitSetScheme(c.ts, "yoshida"));
  assert_int_equal(result, PETSC_ERR_USER_INPUT);
  assert_non_null(strstr(last_message, "ts_split_scheme"));
  assert_non_null(strstr(last_message, "yoshida"));
  assert_non_null(strstr(last_message, "lie or strang"));
  Call(DLMSplitGetScheme(c.ts, &name, NULL));
  assert_string_equal(name, "strang");
  Call(PetscOptionsSetValue(NULL, "-ts_split_scheme", "yoshida"));
  CallKeepingMessage(result, TSSetFromOptions(c.ts));
  assert_int_not_equal(result, 0);
  assert_non_null(strstr(last_message, "yoshida"));
  CloseCase(&c);
}

static PetscErrorCode Slow(void *context, PetscReal t, PetscReal dt, PetscReal fraction)
{
  return PetscSleep(0.01);
}

static void CallsAndSecondsAreCounted(void **state)
{
  const char *const names[3] = { "stretch", "advect", "saddle" };
  Case              c;
  const char       *name;
  PetscReal         seconds;
  PetscInt          calls;

  OpenCase(STRETCH | ADVECT, 0.5, 2.0, "-ts_split_scheme strang", &c);
  Call(DLMSplitAddSubstep(c.ts, "saddle", Slow, NULL));
  Call(TSSolve(c.ts, c.y));
  for (int k = 0; k < 3; k++) {
    Call(DLMSplitGetTime(c.ts, k, &name, &seconds, &calls));
    assert_string_equal(name, names[k]);
    assert_int_equal(calls, k ? 4 : 8);
    assert_true(seconds >= (k == 2 ? 0.04 : 0.0) && seconds < 30.0);
  }
  Call(DLMSplitGetTime(c.ts, 3, &name, &seconds, &calls));
  assert_null(name);
  CloseCase(&c);
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(LieIsOfOrderOneAndStrangOfOrderTwo),
  cmocka_unit_test(TheSchemesAreWalkedInOrder),
  cmocka_unit_test(AbsentVerbsAreSkipped),
  cmocka_unit_test(VerbsBeyondTheSchemeAreIgnored),
  cmocka_unit_test(TheFinalTimeIsExact),
  cmocka_unit_test(TheNumberOfStepsIsLimited),
  cmocka_unit_test(ARunGoesOn),
  cmocka_unit_test(UnknownSchemesAreRefused),
  cmocka_unit_test(CallsAndSecondsAreCounted),
};

RUN_ON_ALL_RANKS(tests)
