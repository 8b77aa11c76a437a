/* Options files, YAML or plain, and the command line that wins over them. */
#include "sceneimpl.h"
#include <ctype.h>
#include <strings.h>

static char     scene_source[PETSC_MAX_PATH_LEN] = "";
static PetscInt n_inserted; /* keys of all options files so far */

const char *DLMOptionsSource(void)
{
  return scene_source;
}

static PetscBool IsKey(const char name[])
{
  if (!isalpha((unsigned char)name[0]) || strlen(name) >= DLM_KEY_LENGTH) return PETSC_FALSE;
  for (; *name; name++)
    if (!isalnum((unsigned char)*name) && !strchr("_-.", *name)) return PETSC_FALSE;
  return PETSC_TRUE;
}

PetscErrorCode DLMOptionsFileInsert(DLMOptionsFile *file, PetscInt line, const char name[], const char value[])
{
  PetscFunctionBeginUser;
  DLMUserCheck(IsKey(name), file->comm, "options file %s, line %" PetscInt_FMT ": '%.60s' is no key; allowed: a letter, then letters, digits and _, fewer than %d in all", file->path, line,
               name, DLM_KEY_LENGTH);
  for (PetscInt i = 0; i < file->n; i++)
    DLMUserCheck(strcasecmp(name, file->keys[i].name), file->comm, "options file %s, line %" PetscInt_FMT ": %s was given in line %" PetscInt_FMT " already; allowed: each key once in a file",
                 file->path, line, name, file->keys[i].line);
  DLMUserCheck(n_inserted++ < DLM_MOST_KEYS, file->comm, "options file %s, line %" PetscInt_FMT ": '%.60s' is one key too many; allowed: up to %d keys in all options files", file->path,
               line, name, DLM_MOST_KEYS);
  DLMUserCheck(strncasecmp(name, "options_file", 12), file->comm, "options file %s, line %" PetscInt_FMT ": -%s inside a file is not followed; allowed: on the command line", file->path, line,
               name);
  snprintf(file->keys[file->n].name, DLM_KEY_LENGTH + 1, "-%s", name);
  PetscCall(PetscOptionsSetValue(NULL, file->keys[file->n].name, value && *value ? value : NULL));
  snprintf(file->keys[file->n].name, DLM_KEY_LENGTH + 1, "%s", name);
  file->keys[file->n++].line = line;
  PetscFunctionReturn(0);
}

static PetscBool IsYaml(const char path[])
{
  const char *dot = strrchr(path, '.');

  return dot && (!strcasecmp(dot, ".yaml") || !strcasecmp(dot, ".yml") || !strcasecmp(dot, ".json"))
             ? PETSC_TRUE
             : PETSC_FALSE;
}

static PetscErrorCode InsertFile(MPI_Comm comm, const char path[], PetscBool yaml)
{
  char           *text;
  DLMOptionsFile *file;

  PetscFunctionBeginUser;
  PetscCall(DLMLoadTextCollective(comm, path, &text));
  if (!scene_source[0]) PetscCall(PetscStrncpy(scene_source, path, sizeof(scene_source)));
  PetscCall(PetscNew(&file));
  file->comm = comm;
  file->path = path;
  if (yaml) PetscCall(DLMInsertYaml(file, text));
  else PetscCall(DLMInsertPlain(file, text));
  PetscCall(PetscFree(file));
  PetscCall(PetscFree(text));
  PetscFunctionReturn(0);
}

/* ---- the command line ---- */

static PetscBool NamesFile(const char argument[])
{
  return !strcasecmp(argument, "-options_file") || !strcasecmp(argument, "-options_file_yaml") ? PETSC_TRUE
                                                                                               : PETSC_FALSE;
}

static PetscBool IsVersion(const char argument[])
{
  return !strcasecmp(argument, "-version") || !strcasecmp(argument, "--version") ? PETSC_TRUE : PETSC_FALSE;
}

PetscBool DLMOptionsAskVersion(int argc, char **argv)
{
  for (int i = 1; i < argc; i++) {
    if (IsVersion(argv[i])) return PETSC_TRUE;
  }
  return PETSC_FALSE;
}

static PetscBool IsPrefix(const char argument[])
{
  return !strcasecmp(argument, "-prefix_push") || !strcasecmp(argument, "-prefix_pop") ? PETSC_TRUE : PETSC_FALSE;
}

/*
  The arguments PETSc may read itself: all but those whose errors it would report with a trace, the scene's file, -options_file FILE, what CheckArguments refuses,
  and -version, to which it would answer with its own. The caller frees the list (the strings stay argv's).
*/
static char **KeepPlainArguments(int argc, char **argv, int *n)
{
  char **kept = malloc(((size_t)argc + 1) * sizeof(*kept));

  *n = 0;
  for (int i = 0; kept && i < argc && i < DLM_MOST_ARGUMENTS; i++) {
    if (i > 0 && (NamesFile(argv[i]) || IsPrefix(argv[i]))) i += (i + 1 < argc && argv[i + 1][0] != '-');
    else if ((i != 1 || argv[i][0] == '-') && (i == 0 || !IsVersion(argv[i]))) kept[(*n)++] = argv[i];
  }
  if (kept) kept[*n] = NULL;
  return kept;
}

/*
  A process that no launcher started needs neither the daemon that Open MPI would start beside it nor a folder of sockets: without the daemon all such processes have one
  folder, and delete it under each other. What the user sets wins; other MPIs do not read these.
*/
static void StandAlone(void)
{
  static const char *const launched[] = { "OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK" };

  for (size_t k = 0; k < sizeof(launched) / sizeof(*launched); k++)
    if (getenv(launched[k])) return;
  setenv("OMPI_MCA_ess_singleton_isolated", "1", 0);
  setenv("OMPI_MCA_orte_create_session_dirs", "0", 0);
}

PetscErrorCode DLMInitialize(int argc, char **argv, const char help[])
{
  static char **kept; /* PETSc keeps a pointer to it */
  static int    n;

  StandAlone();
  kept = KeepPlainArguments(argc, argv, &n);
  return kept ? PetscInitialize(&n, &kept, NULL, help) : PETSC_ERR_MEM;
}

/* Every argument is a key, the value of the key before it, or, in first place, the scene's file. */
static PetscErrorCode CheckArguments(MPI_Comm comm, int argc, char **argv)
{
  PetscBool is_key, follows = PETSC_FALSE; /* follows: a value may come */

  PetscFunctionBeginUser;
  DLMUserCheck(argc <= DLM_MOST_ARGUMENTS, comm, "%d arguments; allowed: up to %d, more keys in a file after -options_file", argc - 1, DLM_MOST_ARGUMENTS - 1);
  for (int i = 1; i < argc; i++) {
    PetscCall(PetscOptionsValidKey(argv[i], &is_key));
    DLMUserCheck(!IsPrefix(argv[i]), comm, "argument %s is not read here; allowed: in a plain options file", argv[i]);
    DLMUserCheck(
        is_key || follows || i == 1, comm,
        "argument %.80s belongs to no key; allowed: dlmfd SCENE -key value ..., lists as 1,2,3 without blanks",
        argv[i]);
    DLMUserCheck(!is_key || !NamesFile(argv[i]) || (i + 1 < argc && argv[i + 1][0] != '-'), comm,
                 "%s has no value; allowed: the path of an options file", argv[i]);
    DLMUserCheck(is_key || argv[i][0] != '-' || follows, comm, "argument %.80s is no key; allowed: -key value",
                 argv[i]);
    follows = is_key;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMOptionsInsert(MPI_Comm comm, int argc, char **argv)
{
  char    **kept;
  int       n;
  PetscBool logs, logs_now;

  PetscFunctionBeginUser;
  scene_source[0] = '\0';
  n_inserted      = 0;
  PetscCall(CheckArguments(comm, argc, argv));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-log_view", &logs));
  if (argc > 1 && argv[1][0] != '-') PetscCall(InsertFile(comm, argv[1], IsYaml(argv[1])));
  for (int i = 1; i + 1 < argc; i++) {
    if (!NamesFile(argv[i])) continue;
    PetscCall(
        InsertFile(comm, argv[i + 1], strcasecmp(argv[i], "-options_file") ? PETSC_TRUE : IsYaml(argv[i + 1])));
  }
  PetscCall(PetscOptionsHasName(NULL, NULL, "-log_view", &logs_now));
  if (logs_now && !logs) PetscCall(PetscLogDefaultBegin()); /* PetscInitialize came too early to see it */
  kept = KeepPlainArguments(argc, argv, &n);
  PetscCheck(kept, PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory for %d arguments", argc);
  PetscCall(PetscOptionsInsertArgs(NULL, n - 1, kept + 1));
  free(kept);
  PetscFunctionReturn(0);
}
