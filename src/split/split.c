#include <petsc/private/tsimpl.h>
#include <petsctime.h>
#include "../../include/dlmsplit.h"
#include "../../include/dlmscene.h"

enum { MOST_SUBSTEPS = 8 };

typedef struct {
  const char *verb;
  PetscReal   fraction;
} Entry;

typedef struct {
  const char *name;
  PetscInt    order;
  Entry       entry[MOST_SUBSTEPS]; /* ends at verb NULL */
} Scheme;

static const Scheme schemes[] = { /* the first one is the default */
  { "strang", 2, { { "predict", 0.5 }, { "saddle", 1.0 }, { "stretch", 0.5 }, { "advect", 1.0 }, { "stretch", 0.5 }, { "correct", 1.0 }, { "judge", 1.0 } } },
  { "lie", 1, { { "predict", 1.0 }, { "saddle", 1.0 }, { "advect", 1.0 }, { "stretch", 1.0 }, { "judge", 1.0 } } },
};

typedef struct {
  const char   *name;
  DLMSubstep    apply;
  void         *context;
  PetscLogStage stage;
  PetscReal     seconds;
  PetscInt      calls;
} Verb;

typedef struct {
  const Scheme *scheme;
  PetscInt      n;
  Verb          verb[DLM_SPLIT_VERBS];
  DLMStateCopy  load, store;
  void         *state_context;
  PetscBool     loaded, rejected;
  PetscInt      retries;
  PetscErrorCode (*save)(void *), (*restore)(void *), (*give_up)(void *);
  void         *retry_context;
} TS_Split;

static PetscErrorCode WalkScheme(TS ts)
{
  TS_Split *s = (TS_Split *)ts->data;

  PetscFunctionBegin;
  s->rejected = PETSC_FALSE;
  for (PetscInt e = 0; e < MOST_SUBSTEPS && s->scheme->entry[e].verb && !s->rejected; e++)
    for (PetscInt k = 0; k < s->n; k++) {
      Verb          *verb = &s->verb[k];
      PetscLogDouble start, end;
      PetscBool      same;
      PetscCall(PetscStrcmp(verb->name, s->scheme->entry[e].verb, &same));
      if (!same) continue;
      PetscCall(PetscLogStagePush(verb->stage));
      PetscCall(PetscTime(&start));
      PetscCall(verb->apply(verb->context, ts->ptime, ts->time_step, s->scheme->entry[e].fraction));
      PetscCall(PetscTime(&end));
      PetscCall(PetscLogStagePop());
      verb->seconds += end - start;
      verb->calls++;
    }
  PetscFunctionReturn(0);
}

/* The step, tried again with half of dt as often as a verb rejects it. */
static PetscErrorCode TryStep(TS ts)
{
  TS_Split *s = (TS_Split *)ts->data;

  PetscFunctionBegin;
  if (s->save) PetscCall(s->save(s->retry_context));
  PetscCall(WalkScheme(ts));
  for (PetscInt k = 0; s->rejected && k < s->retries; k++) {
    PetscCall(s->restore(s->retry_context));
    ts->time_step *= 0.5;
    ts->reject++;
    PetscCall(WalkScheme(ts));
  }
  if (!s->rejected) PetscFunctionReturn(0);
  PetscCall(s->restore(s->retry_context));
  PetscCall(s->give_up(s->retry_context));
  PetscFunctionReturn(0);
}

static PetscErrorCode TSStep_Split(TS ts)
{
  TS_Split *s      = (TS_Split *)ts->data;
  PetscReal next   = ts->time_step;
  PetscBool accept = PETSC_TRUE;

  PetscFunctionBegin;
  if (s->load && !s->loaded) PetscCall(s->load(s->state_context, ts->vec_sol));
  s->loaded = PETSC_TRUE;
  for (;;) {
    PetscCall(TSPreStage(ts, ts->ptime));
    PetscCall(TryStep(ts));
    PetscCall(TSAdaptChoose(ts->adapt, ts, ts->time_step, NULL, &next, &accept));
    if (accept || !s->restore) break;
    PetscCall(s->restore(s->retry_context));
    ts->time_step = next;
    ts->reject++;
  }
  if (s->store) PetscCall(s->store(s->state_context, ts->vec_sol));
  PetscCall(TSPostStage(ts, ts->ptime, 0, &ts->vec_sol));
  ts->ptime += ts->time_step;
  ts->time_step = next;
  PetscFunctionReturn(0);
}

static PetscErrorCode TSSetUp_Split(TS ts)
{
  PetscFunctionBegin;
  PetscCall(TSGetAdapt(ts, &ts->adapt));
  PetscCall(TSAdaptCandidatesClear(ts->adapt));
  PetscFunctionReturn(0);
}

static PetscErrorCode TSReset_Split(TS ts)
{
  PetscFunctionBegin;
  ((TS_Split *)ts->data)->loaded = PETSC_FALSE;
  PetscFunctionReturn(0);
}

static PetscErrorCode TSDestroy_Split(TS ts)
{
  PetscFunctionBegin;
  PetscCall(PetscFree(ts->data));
  PetscFunctionReturn(0);
}

static PetscErrorCode TSSetFromOptions_Split(TS ts, PetscOptionItems *PetscOptionsObject)
{
  TS_Split   *s = (TS_Split *)ts->data;
  const char *names[PETSC_STATIC_ARRAY_LENGTH(schemes)];
  PetscInt    choice = (PetscInt)(s->scheme - schemes);

  PetscFunctionBegin;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(schemes); k++) names[k] = schemes[k].name;
  PetscOptionsHeadBegin(PetscOptionsObject, "Operator splitting");
  PetscCall(PetscOptionsEList("-ts_split_scheme", "Splitting scheme", "DLMSplitSetScheme", names, (PetscInt)PETSC_STATIC_ARRAY_LENGTH(schemes),
                              names[choice], &choice, NULL));
  PetscCall(PetscOptionsBoundedInt("-split_retries", "Tries again with half of dt, of a step that was rejected", NULL, s->retries, &s->retries, NULL, 0));
  PetscOptionsHeadEnd();
  s->scheme = &schemes[choice];
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSplitDescribe(TS ts, size_t size, char text[])
{
  TS_Split *s    = (TS_Split *)ts->data;
  size_t    used = 0;

  PetscFunctionBegin;
  text[0] = '\0';
  for (PetscInt e = 0; e < MOST_SUBSTEPS && s->scheme->entry[e].verb; e++)
    for (PetscInt k = 0; k < s->n && used < size; k++) {
      PetscBool same;
      PetscCall(PetscStrcmp(s->verb[k].name, s->scheme->entry[e].verb, &same));
      if (same) used += (size_t)snprintf(text + used, size - used, " %s(%.3g)", s->verb[k].name, (double)s->scheme->entry[e].fraction);
    }
  PetscFunctionReturn(0);
}

static PetscErrorCode TSView_Split(TS ts, PetscViewer viewer)
{
  TS_Split *s = (TS_Split *)ts->data;
  PetscBool ascii;
  char      steps[256];

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(0);
  PetscCall(DLMSplitDescribe(ts, sizeof(steps), steps));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  scheme %s, order %" PetscInt_FMT ":%s\n", s->scheme->name, s->scheme->order, steps));
  PetscFunctionReturn(0);
}

static PetscErrorCode TSCreate_Split(TS ts)
{
  TS_Split *s;

  PetscFunctionBegin;
  PetscCall(PetscNew(&s));
  s->scheme               = &schemes[0];
  ts->data                = s;
  ts->ops->setup          = TSSetUp_Split;
  ts->ops->step           = TSStep_Split;
  ts->ops->reset          = TSReset_Split;
  ts->ops->destroy        = TSDestroy_Split;
  ts->ops->setfromoptions = TSSetFromOptions_Split;
  ts->ops->view           = TSView_Split;
  ts->default_adapt_type  = TSADAPTNONE;
  ts->usessnes            = PETSC_FALSE;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSplitRegister(void)
{
  static PetscBool done = PETSC_FALSE;

  PetscFunctionBeginUser;
  if (!done) PetscCall(TSRegister(TSSPLIT, TSCreate_Split));
  done = PETSC_TRUE;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSplitAddSubstep(TS ts, const char *name, DLMSubstep apply, void *context)
{
  TS_Split *s = (TS_Split *)ts->data;
  Verb     *verb;

  PetscFunctionBeginUser;
  PetscCheck(s->n < DLM_SPLIT_VERBS, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "At most %d sub-steps", DLM_SPLIT_VERBS);
  verb          = &s->verb[s->n++];
  verb->name    = name;
  verb->apply   = apply;
  verb->context = context;
  if (PetscLogStageGetId(name, &verb->stage) || verb->stage < 0) PetscCall(PetscLogStageRegister(name, &verb->stage));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSplitSetState(TS ts, DLMStateCopy load, DLMStateCopy store, void *context)
{
  TS_Split *s = (TS_Split *)ts->data;

  PetscFunctionBeginUser;
  s->load          = load;
  s->store         = store;
  s->state_context = context;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSplitSetRetry(TS ts, PetscErrorCode (*save)(void *), PetscErrorCode (*restore)(void *), PetscErrorCode (*give_up)(void *), void *context)
{
  TS_Split *s = (TS_Split *)ts->data;

  PetscFunctionBeginUser;
  s->save          = save;
  s->restore       = restore;
  s->give_up       = give_up;
  s->retry_context = context;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSplitReject(TS ts)
{
  PetscFunctionBeginUser;
  ((TS_Split *)ts->data)->rejected = PETSC_TRUE;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSplitSetScheme(TS ts, const char *name)
{
  TS_Split *s = (TS_Split *)ts->data;

  PetscFunctionBeginUser;
  for (size_t k = 0; k < PETSC_STATIC_ARRAY_LENGTH(schemes); k++) {
    PetscBool same;
    PetscCall(PetscStrcmp(schemes[k].name, name, &same));
    if (!same) continue;
    s->scheme = &schemes[k];
    PetscFunctionReturn(0);
  }
  SETERRQ(PetscObjectComm((PetscObject)ts), PETSC_ERR_USER_INPUT, "-ts_split_scheme %s: there is no such scheme; allowed: lie or strang", name);
}

PetscErrorCode DLMSplitGetScheme(TS ts, const char **name, PetscInt *order)
{
  TS_Split *s = (TS_Split *)ts->data;

  PetscFunctionBeginUser;
  if (name) *name = s->scheme->name;
  if (order) *order = s->scheme->order;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSplitGetTime(TS ts, PetscInt k, const char **name, PetscReal *seconds, PetscInt *calls)
{
  TS_Split *s = (TS_Split *)ts->data;

  PetscFunctionBeginUser;
  *name = NULL;
  if (k >= s->n) PetscFunctionReturn(0);
  *name    = s->verb[k].name;
  *seconds = s->verb[k].seconds;
  *calls   = s->verb[k].calls;
  PetscFunctionReturn(0);
}
