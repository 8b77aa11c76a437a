/*
  Progress: on a terminal one line that is rewritten, else a line every -progress_every seconds; at the end the extremes of the run. What a scene lacks is not
  in its line.
*/
#include <fcntl.h>
#include <stdarg.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include "../../include/private/amounts.h"
#include "../../include/private/outputimpl.h"

/* A line that grows; what does not fit is left out. */
typedef struct {
  size_t used;
  char   text[256];
} Line;

static void Add(Line *line, const char *format, ...)
{
  va_list arguments;
  int     wanted;

  va_start(arguments, format);
  wanted = vsnprintf(line->text + line->used, sizeof(line->text) - line->used, format, arguments);
  va_end(arguments);
  line->used = PetscMin(line->used + (size_t)PetscMax(0, wanted), sizeof(line->text) - 1);
}

/* Columns of the terminal behind a file; 0: none is there, or not told, as of the one that mpirun puts between itself and a rank. */
static size_t Columns(int file)
{
  struct winsize window;

  return isatty(file) && !ioctl(file, TIOCGWINSZ, &window) ? window.ws_col : 0;
}

/* Of the terminal that shows the run: that of the standard output, of this process or of the mpirun that made it; 0: a log. */
static size_t TerminalWidth(void)
{
  size_t width = Columns(STDOUT_FILENO);
  char   path[32];
  int    file;

  if (width || !isatty(STDOUT_FILENO)) return width;
  snprintf(path, sizeof(path), "/proc/%ld/fd/1", (long)getppid());
  file = open(path, O_RDONLY | O_NOCTTY | O_NONBLOCK);
  if (file < 0) return 0;
  width = Columns(file);
  close(file);
  return width;
}

/* The first step costs more than the others, so the pace is theirs. */
static PetscErrorCode AddTimeLeft(Line *line, DLMOutput output, PetscInt step, PetscReal time, PetscLogDouble now)
{
  const PetscInt made = step - output->start_step;
  PetscReal      dt, end;
  PetscInt       most;
  double         pace;
  char           text[32];

  PetscFunctionBegin;
  if (made < 1) PetscFunctionReturn(0);
  PetscCall(TSGetTimeStep(output->sim->ts, &dt));
  PetscCall(TSGetMaxTime(output->sim->ts, &end));
  PetscCall(TSGetMaxSteps(output->sim->ts, &most));
  pace = made > 1 ? (now - output->started - output->first_seconds) / (made - 1) : output->first_seconds;
  Add(line, "  left %s", DLMDurationText(pace * PetscMin((end - time) / dt, (double)(most - step)), text));
  PetscFunctionReturn(0);
}

/* The parts of a step and their seconds so far: sub-steps, then outputs. */
static PetscErrorCode GetParts(DLMSimulation sim, const char *name[DLM_STEP_PARTS], PetscReal seconds[DLM_STEP_PARTS])
{
  PetscInt calls;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < DLM_SPLIT_VERBS; k++) PetscCall(DLMSplitGetTime(sim->ts, k, &name[k], &seconds[k], &calls));
  for (int k = DLM_SPLIT_VERBS; k < DLM_STEP_PARTS; k++) {
    name[k]    = DLMPartName(DLM_PART_TRAJECTORY + k - DLM_SPLIT_VERBS);
    seconds[k] = sim->part[DLM_PART_TRAJECTORY + k - DLM_SPLIT_VERBS].seconds;
  }
  PetscFunctionReturn(0);
}

/* What a step costs, and its parts from two per cent on; since the last line (all: since the start). Other: copies, the choice of the next step, waiting. */
static PetscErrorCode AddStepCost(Line *line, DLMOutput output, PetscInt step, PetscLogDouble now, PetscBool all)
{
  const PetscInt steps   = step - (all ? output->start_step : output->last_step);
  const double   elapsed = now - (all ? output->started : output->last_progress);
  double         other   = 1.0;
  const char    *name[DLM_STEP_PARTS];
  PetscReal      seconds[DLM_STEP_PARTS];

  PetscFunctionBegin;
  if (steps <= 0 || elapsed <= 0.0) PetscFunctionReturn(0);
  PetscCall(GetParts(output->sim, name, seconds));
  Add(line, "  %.3g s/step:", elapsed / steps);
  for (int k = 0; k < DLM_STEP_PARTS; k++) {
    const double part = name[k] ? (seconds[k] - (all ? 0.0 : output->part_seconds[k])) / elapsed : 0.0;
    if (part >= 0.02) Add(line, " %s %.0f%%", name[k], 100.0 * part);
    other -= part;
    if (name[k]) output->part_seconds[k] = seconds[k];
  }
  if (other >= 0.02) Add(line, " other %.0f%%", 100.0 * other);
  PetscFunctionReturn(0);
}

/* Mesh widths that a step carries things: C with the fluid, else spheres' centres. */
static PetscErrorCode Courant(DLMSimulation sim, PetscReal dt, PetscReal *courant)
{
  DLMSphereState *state;
  PetscInt        n;

  PetscFunctionBegin;
  *courant = sim->polymer ? sim->health.courant : 0.0;
  if (sim->polymer) PetscFunctionReturn(0);
  PetscCall(DLMSpheresGetStates(sim->spheres, &n, &state));
  for (PetscInt i = 0; i < n; i++)
    *courant = PetscMax(*courant, (PetscAbsReal(state[i].velocity[0]) + PetscAbsReal(state[i].velocity[1]) + PetscAbsReal(state[i].velocity[2])) * dt / sim->scene->h);
  PetscFunctionReturn(0);
}

/* The health of the last step. */
static PetscErrorCode AddHealth(Line *line, DLMSimulation sim, PetscReal time)
{
  DLMSaddleWork work;
  PetscReal     courant, before;

  PetscFunctionBegin;
  PetscCall(TSGetPrevTime(sim->ts, &before));
  PetscCall(DLMSaddleGetWork(sim->saddle, &work));
  if (sim->spheres) Add(line, "  its %ld", (long)work.last_iterations);
  if (sim->adapt.exists) Add(line, "  dt %.2g", (double)(time - before));
  if (sim->polymer || sim->part[DLM_PART_MOTION].built) {
    PetscCall(Courant(sim, time - before, &courant));
    Add(line, "  CFL %.2g", (double)courant);
  }
  if (sim->contact.can_meet && sim->gap < PETSC_INFINITY) Add(line, "  gap %.3g", (double)sim->gap);
  if (sim->polymer)
    Add(line, "  eig %.2g  tr %.3g  El %.2g", (double)sim->health.smallest_eigenvalue, (double)sim->health.largest_trace,
        (double)DLMSimulationElasticNumber(sim, time - before, sim->health.largest_trace));
  PetscFunctionReturn(0);
}

/* The extremes of the run. */
static PetscErrorCode PrintEnd(DLMOutput output, PetscInt step, PetscReal time, PetscLogDouble now)
{
  DLMSimulation           sim  = output->sim;
  const DLMPolymerHealth *w    = &sim->worst;
  Line                    line = { 0 };
  DLMSaddleWork           work;
  char                    text[32];

  PetscFunctionBegin;
  PetscCall(DLMSaddleGetWork(sim->saddle, &work));
  Add(&line, "%ld steps to t = %.6g took %s", (long)(step - output->start_step), (double)time, DLMDurationText(now - output->started, text));
  PetscCall(AddStepCost(&line, output, step, now, PETSC_TRUE));
  if (sim->spheres && work.solves > 0) Add(&line, "; iterations %.1f a solve, at most %ld", (double)work.iterations / work.solves, (long)work.most_iterations);
  printf("%s\n", line.text);
  if (sim->contact.can_meet && sim->smallest_gap < PETSC_INFINITY)
    printf("smallest gap %.4g, largest repulsion %.3g\n", (double)sim->smallest_gap, (double)sim->contact.largest);
  if (sim->polymer)
    printf("C: smallest eigenvalue %.4g at x = %.4g,%.4g,%.4g, t = %.6g; largest trace %.4g; Courant number %.3g in %ld sub-step%s; elastic number %.3g\n",
           (double)w->smallest_eigenvalue, (double)w->place[0], (double)w->place[1], (double)w->place[2], (double)sim->worst_time, (double)w->largest_trace,
           (double)w->courant, (long)w->substeps, w->substeps == 1 ? "" : "s", (double)DLMSimulationElasticNumber(sim, sim->scene->ts_dt, w->largest_trace));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMProgress(DLMOutput output, PetscInt step, PetscReal time, PetscBool last)
{
  const DLMScene *scene = output->sim->scene;
  Line            line  = { 0 };
  PetscLogDouble  now;
  PetscMPIInt     rank;
  PetscReal       end;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(scene->comm, &rank));
  if (rank || step == output->start_step) PetscFunctionReturn(0);
  PetscCall(PetscTime(&now));
  if (step == output->start_step + 1) output->first_seconds = now - output->started;
  const size_t width = TerminalWidth();
  if (!last && now - output->last_progress < (width ? 0.2 : scene->progress_every)) PetscFunctionReturn(0);
  PetscCall(TSGetMaxTime(output->sim->ts, &end));
  Add(&line, "step %ld  t %.4g/%.4g", (long)step, (double)time, (double)end);
  if (!last) PetscCall(AddTimeLeft(&line, output, step, time, now));
  PetscCall(AddStepCost(&line, output, step, now, PETSC_FALSE));
  PetscCall(AddHealth(&line, output->sim, time));
  if (width) printf("\r%.*s\033[K%s", (int)width - 1, line.text, last ? "\n" : "");
  else printf("%s\n", line.text);
  output->last_progress = now;
  output->last_step     = step;
  if (last) PetscCall(PrintEnd(output, step, time, now));
  fflush(stdout);
  PetscFunctionReturn(0);
}
