/* Options files, YAML or plain, and the command line that wins over them. */
#include "sceneimpl.h"
#include <ctype.h>
#include <errno.h>
#include <strings.h>

static char scene_source[PETSC_MAX_PATH_LEN] = "";

const char *DLMOptionsSource(void)
{
  return scene_source;
}

char *DLMLoadText(const char path[], char reason[], size_t size)
{
  FILE  *file = fopen(path, "rb");
  char  *text = NULL;
  size_t used = 0, room = 4096, got;

  do {
    char *larger = file ? realloc(text, room) : NULL;

    if (!larger) {
      free(text);
      text = NULL;
      break;
    }
    text = larger;
    got = fread(text + used, 1, room - used - 1, file);
    used += got;
    text[used] = '\0';
    room *= 2;
  } while (got > 0);
  if (file && text && !ferror(file)) {
    fclose(file);
    return text;
  }
  snprintf(reason, size, "%s", strerror(errno));
  if (file) fclose(file);
  free(text);
  return NULL;
}

/* The text of a file on every rank, to be freed with PetscFree; a user error if rank 0 cannot read it. */
static PetscErrorCode LoadTextCollective(MPI_Comm comm, const char path[], char *text[])
{
  PetscMPIInt rank;
  PetscInt64  size = -1;
  char        reason[128] = "", *read = NULL;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    read = DLMLoadText(path, reason, sizeof(reason));
    if (read) size = (PetscInt64)strlen(read);
  }
  PetscCallMPI(MPI_Bcast(&size, 1, MPIU_INT64, 0, comm));
  PetscCallMPI(MPI_Bcast(reason, (PetscMPIInt)sizeof(reason), MPI_CHAR, 0, comm));
  DLMUserCheck(size >= 0, comm, "options file %s: %s; allowed: a file that can be read", path, reason);
  DLMUserCheck(size < PETSC_MPI_INT_MAX, comm, "options file %s: too large; allowed: up to 2 GB", path);
  PetscCall(PetscMalloc1(size + 1, text));
  if (!rank) memcpy(*text, read, (size_t)size + 1);
  free(read);
  PetscCallMPI(MPI_Bcast(*text, (PetscMPIInt)size + 1, MPI_CHAR, 0, comm));
  PetscFunctionReturn(0);
}

/* ---- plain: one "-key value" a line, # starts a comment ---- */

static char *TrimInPlace(char *text)
{
  size_t n;

  while (isspace((unsigned char)*text)) text++;
  n = strlen(text);
  while (n > 0 && isspace((unsigned char)text[n - 1])) text[--n] = '\0';
  return text;
}

/* Takes the quotes off a value; false if the value is more than one word. */
static PetscBool Unquote(char **value)
{
  size_t n = strlen(*value);

  if (n >= 2 && (*value)[0] == '"' && (*value)[n - 1] == '"') {
    (*value)[n - 1] = '\0';
    (*value)++;
    return PETSC_TRUE;
  }
  return (*value)[strcspn(*value, " \t")] ? PETSC_FALSE : PETSC_TRUE;
}

/* depth counts the prefixes that are pushed. */
static PetscErrorCode InsertPair(MPI_Comm comm, const char path[], PetscInt number, const char key[],
                                 const char value[], PetscInt *depth)
{
  PetscFunctionBeginUser;
  if (!strcmp(key, "-prefix_push")) {
    PetscCall(PetscOptionsPrefixPush(NULL, value));
    ++*depth;
  } else if (!strcmp(key, "-prefix_pop")) {
    DLMUserCheck((*depth)-- > 0, comm,
                 "options file %s, line %" PetscInt_FMT
                 ": -prefix_pop without a prefix; allowed: after -prefix_push",
                 path, number);
    PetscCall(PetscOptionsPrefixPop(NULL));
  } else PetscCall(PetscOptionsSetValue(NULL, key, *value ? value : NULL));
  PetscFunctionReturn(0);
}

static PetscErrorCode InsertPlainLine(MPI_Comm comm, const char path[], PetscInt number, char line[],
                                      PetscInt *depth)
{
  char     *key, *value;
  PetscBool is_key, is_second;

  PetscFunctionBeginUser;
  line[strcspn(line, "#")] = '\0';
  key = TrimInPlace(line);
  if (!*key) PetscFunctionReturn(0);
  PetscCall(PetscOptionsValidKey(key, &is_key));
  DLMUserCheck(is_key, comm, "options file %s, line %" PetscInt_FMT ": '%.60s' is no key; allowed: -key value",
               path, number, key);
  value = key + strcspn(key, " \t");
  if (*value) *value++ = '\0';
  value = TrimInPlace(value);
  PetscCall(PetscOptionsValidKey(value, &is_second));
  DLMUserCheck(Unquote(&value) && !is_second, comm,
               "options file %s, line %" PetscInt_FMT
               ": %s %.60s: more than one value; allowed: one key a line, lists"
               " as 1,2,3 without blanks",
               path, number, key, value);
  PetscCall(InsertPair(comm, path, number, key, value, depth));
  PetscFunctionReturn(0);
}

static PetscErrorCode InsertPlain(MPI_Comm comm, const char path[], char text[])
{
  PetscInt depth = 0;

  PetscFunctionBeginUser;
  for (PetscInt number = 1; text; number++) {
    char *next = strchr(text, '\n');

    if (next) *next++ = '\0';
    PetscCall(InsertPlainLine(comm, path, number, text, &depth));
    text = next;
  }
  DLMUserCheck(depth == 0, comm, "options file %s: -prefix_push without its end; allowed: -prefix_pop after it",
               path);
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
  char     *text;
  PetscBool nested;

  PetscFunctionBeginUser;
  PetscCall(LoadTextCollective(comm, path, &text));
  if (!scene_source[0]) PetscCall(PetscStrncpy(scene_source, path, sizeof(scene_source)));
  if (yaml) PetscCall(DLMInsertYaml(comm, path, text));
  else PetscCall(InsertPlain(comm, path, text));
  PetscCall(PetscFree(text));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-options_file", &nested));
  DLMUserCheck(!nested, comm,
               "options file %s: -options_file inside a file is not followed; allowed: on the command line",
               path);
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

/*
  The arguments PETSC may read itself: all but the scene's file and -options_file FILE, whose errors PETSc would
  report with a trace, and -version, to which it would answer with its own. The caller frees the list (the strings stay argv's).
*/
static char **KeepPlainArguments(int argc, char **argv, int *n)
{
  char **kept = malloc(((size_t)argc + 1) * sizeof(*kept));

  *n = 0;
  for (int i = 0; kept && i < argc; i++) {
    if (i > 0 && NamesFile(argv[i])) i += (i + 1 < argc && argv[i + 1][0] != '-');
    else if ((i != 1 || argv[i][0] == '-') && (i == 0 || !IsVersion(argv[i]))) kept[(*n)++] = argv[i];
  }
  if (kept) kept[*n] = NULL;
  return kept;
}

PetscErrorCode DLMInitialize(int argc, char **argv, const char help[])
{
  static char **kept; /* PETSc keeps a pointer to it */
  static int    n;

  kept = KeepPlainArguments(argc, argv, &n);
  return kept ? PetscInitialize(&n, &kept, NULL, help) : PETSC_ERR_MEM;
}

/* Every argument is a key, the value of the key before it, or, in first place, the scene's file. */
static PetscErrorCode CheckArguments(MPI_Comm comm, int argc, char **argv)
{
  PetscBool is_key, follows = PETSC_FALSE; /* follows: a value may come */

  PetscFunctionBeginUser;
  for (int i = 1; i < argc; i++) {
    PetscCall(PetscOptionsValidKey(argv[i], &is_key));
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
