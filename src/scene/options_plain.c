/* Plain options files, as PETSc has them: one "-key value" a line, # starts a comment, -prefix_push and -prefix_pop put a word before the keys between them. */
#include "sceneimpl.h"
#include <ctype.h>

enum { MOST_PREFIXES = 16 };

typedef struct {
  DLMOptionsFile *file;
  PetscInt        line;
  char            prefix[DLM_KEY_LENGTH]; /* of the keys to come */
  PetscInt        depth;
  size_t          ends[MOST_PREFIXES]; /* length of the prefix without its last word, and so on */
} Plain;

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
  for (const char *c = *value; *c; c++)
    if (isspace((unsigned char)*c)) return PETSC_FALSE;
  return PETSC_TRUE;
}

static PetscErrorCode Push(Plain *plain, const char word[])
{
  const size_t end = strlen(plain->prefix);

  PetscFunctionBeginUser;
  DLMUserCheck(isalpha((unsigned char)word[0]) && end + strlen(word) < DLM_KEY_LENGTH && plain->depth < MOST_PREFIXES, plain->file->comm,
               "options file %s, line %" PetscInt_FMT ": -prefix_push %.60s; allowed: a word that begins with a letter, up to %d of them open and %d letters in all", plain->file->path,
               plain->line, word, MOST_PREFIXES, DLM_KEY_LENGTH - 1);
  plain->ends[plain->depth++] = end;
  memcpy(plain->prefix + end, word, strlen(word) + 1);
  PetscFunctionReturn(0);
}

static PetscErrorCode InsertPair(Plain *plain, const char key[], const char value[])
{
  char name[2 * DLM_KEY_LENGTH];

  PetscFunctionBeginUser;
  if (!strcmp(key, "prefix_push")) {
    PetscCall(Push(plain, value));
  } else if (!strcmp(key, "prefix_pop")) {
    DLMUserCheck(plain->depth > 0, plain->file->comm, "options file %s, line %" PetscInt_FMT ": -prefix_pop without a prefix; allowed: after -prefix_push", plain->file->path, plain->line);
    plain->prefix[plain->ends[--plain->depth]] = '\0';
  } else {
    snprintf(name, sizeof(name), "%s%.*s", plain->prefix, DLM_KEY_LENGTH, key);
    PetscCall(DLMOptionsFileInsert(plain->file, plain->line, name, value));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode InsertLine(Plain *plain, char line[])
{
  char     *key, *value;
  PetscBool is_key;

  PetscFunctionBeginUser;
  line[strcspn(line, "#")] = '\0';
  key = TrimInPlace(line);
  if (!*key) PetscFunctionReturn(0);
  DLMUserCheck(key[0] == '-' && (isalpha((unsigned char)key[1]) || key[1] == '-'), plain->file->comm, "options file %s, line %" PetscInt_FMT ": '%.60s' is no key; allowed: -key value",
               plain->file->path, plain->line, key);
  value = key + strcspn(key, " \t");
  if (*value) *value++ = '\0';
  value = TrimInPlace(value);
  PetscCall(PetscOptionsValidKey(value, &is_key));
  DLMUserCheck(!is_key && Unquote(&value), plain->file->comm,
               "options file %s, line %" PetscInt_FMT ": %.60s %.60s: more than one value; allowed: one key a line, lists as 1,2,3 without blanks", plain->file->path, plain->line, key, value);
  PetscCall(InsertPair(plain, key + 1, value));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMInsertPlain(DLMOptionsFile *file, char text[])
{
  Plain plain = { .file = file };

  PetscFunctionBeginUser;
  if (!strncmp(text, DLM_BYTE_ORDER_MARK, 3)) text += 3;
  while (text) {
    char *next = strchr(text, '\n');

    if (next) *next++ = '\0';
    plain.line++;
    PetscCall(InsertLine(&plain, text));
    text = next;
  }
  DLMUserCheck(plain.depth == 0, file->comm, "options file %s: -prefix_push without its end; allowed: -prefix_pop after it", file->path);
  PetscFunctionReturn(0);
}
