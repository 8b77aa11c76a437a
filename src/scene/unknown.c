/* Keys that nothing knows. */
#include "sceneimpl.h"
#include <ctype.h>
#include <strings.h>

/* clang-format off */
/* Keys PETSc itself reads, some of them only while it finalizes: never refused. */
static const char *const petsc_keys[] = {
  "options_", "log_", "malloc", "memory_", "objects_", "help", "version", "info", "on_error", "error_output", "fp_trap",
  "debug", "start_in_debugger", "stop_for_debugger", "history", "citations", "checkstack", "check_pointer_intensity", "mpi_",
  "mpidump", "get_total_flops", "skip_petscrc", "petsc_", "saws_", "nox", "display", "draw_", "viewer_", "shared_tmp",
  "not_shared_tmp", "use_gpu_aware_mpi", "device_", "root_device_", "cuda_", "hip_", "kokkos_", "omp_", "no_signal_handler",
  "process_view", "prefix_", NULL};

/* Keys of objects that exist only once the simulation is built: judged then, by DLMSceneCheckUnused. */
static const char *const solver_keys[] = {
  "ts_", "stokes_", "saddle_", "uzawa_", "split_", "snes_", "ksp_", "pc_", "mat_", "vec_", "dm_", "da_", "sf_", "is_",
  "partitioning_", NULL};
static const char *const solver_words[] = {
  "_ksp_", "_pc_", "_mat_", "_vec_", "_dm_", "_da_", "_sf_", "_partitioning_", NULL};
/* Keys that solvers read only when they solve, too late to be judged before the run. */
static const char *const late_words[] = {
  "ts_view", "ksp_view", "pc_view", "mat_view", "vec_view", "dm_view", "ksp_converged_reason", "ksp_converged_rate", "_mg_levels_", NULL};
/* clang-format on */

static PetscBool BeginsWithAny(const char name[], const char *const list[])
{
  for (PetscInt i = 0; list[i]; i++) {
    if (!strncasecmp(name, list[i], strlen(list[i]))) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

static PetscBool ContainsAny(const char name[], const char *const list[])
{
  for (PetscInt i = 0; list[i]; i++) {
    if (strstr(name, list[i])) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

static const char *SceneKeyName(PetscInt i)
{
  return DLMSceneKeys[i].name;
}

static PetscBool IsSceneKey(const char name[])
{
  for (PetscInt i = 0; i < DLMSceneKeyCount; i++) {
    if (!strcasecmp(name, DLMSceneKeys[i].name)) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

/* Letters to insert, delete, replace or swap with their neighbour to turn a into b (Damerau and Levenshtein).
 */
static PetscInt EditDistance(const char a[], const char b[])
{
  enum { LONGEST = 64 };
  PetscInt na = (PetscInt)strlen(a), nb = (PetscInt)strlen(b), d[LONGEST + 1][LONGEST + 1];

  if (na > LONGEST || nb > LONGEST) return LONGEST;
  for (PetscInt i = 0; i <= na; i++) d[i][0] = i;
  for (PetscInt j = 0; j <= nb; j++) d[0][j] = j;
  for (PetscInt i = 1; i <= na; i++) {
    for (PetscInt j = 1; j <= nb; j++) {
      PetscInt replace =
          d[i - 1][j - 1] + (tolower((unsigned char)a[i - 1]) != tolower((unsigned char)b[j - 1]));

      d[i][j] = PetscMin(replace, PetscMin(d[i - 1][j], d[i][j - 1]) + 1);
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = PetscMin(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[na][nb];
}

/* The candidate most like name, or NULL if none is near enough to be meant. */
const char *DLMNearest(const char name[], PetscInt n, const char *(*candidate)(PetscInt))
{
  PetscInt    least = PetscMax(2, (PetscInt)strlen(name) / 3) + 1;
  const char *nearest = NULL;

  for (PetscInt i = 0; i < n; i++) {
    PetscInt distance = EditDistance(name, candidate(i));

    if (distance < least) {
      least = distance;
      nearest = candidate(i);
    }
  }
  return nearest;
}

static PetscErrorCode Refuse(MPI_Comm comm, const char name[], const char value[], const char why[])
{
  const char *nearest = DLMNearest(name, DLMSceneKeyCount, SceneKeyName);

  PetscFunctionBeginUser;
  DLMUserCheck(!nearest, comm, "-%.80s%s%.80s: %s; did you mean -%s? (all keys: dlmfd -help or docs/options.md)",
               name, value ? " " : "", value ? value : "", why, nearest);
  DLMUserCheck(PETSC_FALSE, comm, "-%.80s%s%.80s: %s (all keys: dlmfd -help or docs/options.md)", name,
               value ? " " : "", value ? value : "", why);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSceneRefuseUnknown(MPI_Comm comm)
{
  PetscInt n;
  char   **names, **values;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsLeftGet(NULL, &n, &names, &values));
  for (PetscInt i = 0; i < n; i++) {
    if (IsSceneKey(names[i]) || BeginsWithAny(names[i], petsc_keys)) continue;
    if (BeginsWithAny(names[i], solver_keys) || ContainsAny(names[i], solver_words)) continue;
    PetscCall(Refuse(comm, names[i], values[i], "unknown key"));
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &n, &names, &values));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSceneCheckUnused(MPI_Comm comm)
{
  PetscInt n;
  char   **names, **values;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsLeftGet(NULL, &n, &names, &values));
  for (PetscInt i = 0; i < n; i++) {
    if (BeginsWithAny(names[i], petsc_keys)) continue;
    if (BeginsWithAny(names[i], solver_keys) && ContainsAny(names[i], late_words)) continue;
    PetscCall(Refuse(comm, names[i], values[i], "no object of this run reads this key"));
  }
  PetscCall(PetscOptionsLeftRestore(NULL, &n, &names, &values));
  PetscFunctionReturn(0);
}
