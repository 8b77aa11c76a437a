/* Strict reading of values: the whole text must be what the table asks for. */
#include "sceneimpl.h"
#include <ctype.h>
#include <strings.h>
#include <errno.h>
#include <float.h>
#include <math.h>

/* A piece of a value: text without the blanks around it. */
typedef struct {
  const char *start;
  size_t      length;
} Piece;

static Piece Trim(const char *start, const char *end)
{
  while (start < end && isspace((unsigned char)*start)) start++;
  while (end > start && isspace((unsigned char)end[-1])) end--;
  return (Piece){start, (size_t)(end - start)};
}

/* The text up to the next comma; *rest is what follows the comma, or NULL. */
static Piece NextPiece(const char *text, const char **rest)
{
  const char *comma = strchr(text, ',');

  *rest = comma ? comma + 1 : NULL;
  return Trim(text, comma ? comma : text + strlen(text));
}

static PetscInt CountPieces(const char *text)
{
  PetscInt n = 1;

  for (; *text; text++) n += *text == ',';
  return n;
}

PetscBool DLMParseReal(const char text[], size_t length, PetscReal *value)
{
  char   copy[128], *end;
  double number;

  if (length == 0 || length >= sizeof(copy)) return PETSC_FALSE;
  memcpy(copy, text, length);
  copy[length] = '\0';
  if (strspn(copy, "0123456789+-.eE") != length) return PETSC_FALSE; /* no nan, inf, hexadecimal, blanks */
  number = strtod(copy, &end);
  if (*end || !isfinite(number)) return PETSC_FALSE;
  *value = number;
  return PETSC_TRUE;
}

static PetscBool ParseInt(const char text[], size_t length, PetscInt *value)
{
  char      copy[32], *end;
  long long number;

  if (length == 0 || length >= sizeof(copy)) return PETSC_FALSE;
  memcpy(copy, text, length);
  copy[length] = '\0';
  if (strspn(copy, "0123456789+-") != length) return PETSC_FALSE;
  errno = 0;
  number = strtoll(copy, &end, 10);
  if (*end || errno || number > PETSC_MAX_INT || number < PETSC_MIN_INT) return PETSC_FALSE;
  *value = (PetscInt)number;
  return PETSC_TRUE;
}

/* A PETSc enum list ends with the name of the type, the prefix and NULL. */
PetscInt DLMWordCount(const char *const words[])
{
  PetscInt n = 0;

  while (words[n]) n++;
  return n - 2;
}

static PetscInt FindWord(const char text[], size_t length, const char *const words[], PetscInt n)
{
  for (PetscInt i = 0; i < n; i++) {
    if (strlen(words[i]) == length && !strncasecmp(words[i], text, length)) return i;
  }
  return -1;
}

PetscInt DLMParseWord(const char text[], size_t length, const char *const words[])
{
  return FindWord(text, length, words, DLMWordCount(words));
}

static PetscBool ParseBool(const char text[], size_t length, PetscBool *value)
{
  static const char *const words[] = {"0", "1", "false", "true", "no", "yes", "off", "on"};
  PetscInt                 i = FindWord(text, length, words, 8);

  if (i >= 0) *value = (i % 2) ? PETSC_TRUE : PETSC_FALSE;
  return i >= 0 ? PETSC_TRUE : PETSC_FALSE;
}

/* Reads one entry of a key to the given place. Returns what is wrong with it, or NULL. */
static const char *ParseEntry(const DLMSceneKey *key, Piece piece, void *place)
{
  PetscReal number = 0;

  switch (key->type) {
  case DLM_KEY_BOOL:
  case DLM_KEY_BOOL3:
    return ParseBool(piece.start, piece.length, place) ? NULL : "is neither true nor false";
  case DLM_KEY_INT:
  case DLM_KEY_INT3:
    if (!ParseInt(piece.start, piece.length, place)) return "is not an integer";
    number = *(PetscInt *)place;
    break;
  case DLM_KEY_WORD: {
    PetscInt word = DLMParseWord(piece.start, piece.length, key->words);
    if (word < 0) return "is not known";
    *(int *)place = (int)word;
    return NULL;
  }
  case DLM_KEY_AUTO:
    if (piece.length == 4 && !strncasecmp(piece.start, "auto", 4)) {
      *(PetscReal *)place = DLM_AUTO;
      return NULL;
    } /* fall through */
  default:
    if (!DLMParseReal(piece.start, piece.length, place)) return "is not a number";
    number = *(PetscReal *)place;
  }
  return number >= key->least && number <= key->most ? NULL : "is out of range";
}

static size_t EntrySize(DLMKeyType type)
{
  if (type == DLM_KEY_BOOL3) return sizeof(PetscBool);
  return type == DLM_KEY_INT3 ? sizeof(PetscInt) : sizeof(PetscReal);
}

static PetscErrorCode ReadEntries(MPI_Comm comm, const DLMSceneKey *key, const char text[], PetscInt n,
                                  char *place)
{
  char        allowed[128];
  const char *rest = text;

  PetscFunctionBeginUser;
  DLMKeyAllowed(key, allowed, sizeof(allowed));
  DLMUserCheck(n == CountPieces(text), comm, "-%s %.80s has %" PetscInt_FMT " %s; allowed: %s", key->name, text,
               CountPieces(text), CountPieces(text) == 1 ? "entry" : "entries", allowed);
  for (PetscInt i = 0; i < n; i++) {
    Piece       piece = NextPiece(rest, &rest);
    const char *wrong = ParseEntry(key, piece, place + (size_t)i * EntrySize(key->type));

    DLMUserCheck(!wrong, comm, "-%s %.80s: '%.*s' %s; allowed: %s%s%s", key->name, text,
                 (int)PetscMin(piece.length, 40), piece.start, wrong, allowed, key->unit[0] ? ", in " : "",
                 key->unit);
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode ReadCenters(MPI_Comm comm, const DLMSceneKey *key, const char text[],
                                  DLMSceneDraft *draft)
{
  PetscInt n = CountPieces(text);

  PetscFunctionBeginUser;
  PetscCall(PetscFree(draft->centers));
  draft->n_centers = 0;
  if (!text[0]) PetscFunctionReturn(0);
  PetscCall(PetscMalloc1(n, &draft->centers));
  PetscCall(ReadEntries(comm, key, text, n, (char *)draft->centers));
  DLMUserCheck(n % 3 == 0, comm, "-%s has %" PetscInt_FMT " numbers; allowed: three a sphere, x1,x2,x3",
               key->name, n);
  draft->n_centers = n;
  PetscFunctionReturn(0);
}

static PetscErrorCode ReadKey(MPI_Comm comm, const DLMSceneKey *key, const char text[], DLMSceneDraft *draft)
{
  char *place = (char *)draft + key->offset;

  PetscFunctionBeginUser;
  switch (key->type) {
  case DLM_KEY_TEXT:
    DLMUserCheck(strlen(text) < PETSC_MAX_PATH_LEN - 64, comm, "-%s %.80s... is too long; allowed: fewer than %d letters", key->name, text,
                 PETSC_MAX_PATH_LEN - 64); /* names of files follow */
    PetscCall(PetscStrncpy(place, text, PETSC_MAX_PATH_LEN));
    break;
  case DLM_KEY_REALS:
    PetscCall(ReadCenters(comm, key, text, draft));
    break;
  case DLM_KEY_BOOL3:
  case DLM_KEY_INT3:
  case DLM_KEY_REAL3:
    PetscCall(ReadEntries(comm, key, text, 3, place));
    break;
  default:
    PetscCall(ReadEntries(comm, key, text, 1, place));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSceneReadKey(MPI_Comm comm, const DLMSceneKey *key, DLMSceneDraft *draft)
{
  char        name[64], allowed[128];
  const char *text;
  PetscBool   given;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(name, sizeof(name), "-%s", key->name));
  PetscCall(PetscOptionsFindPair(NULL, NULL, name, &text, &given));
  if (!given) PetscFunctionReturn(0);
  if (key->type == DLM_KEY_BOOL && (!text || !text[0])) text = "true"; /* a bare flag */
  DLMKeyAllowed(key, allowed, sizeof(allowed));
  DLMUserCheck(text && text[0], comm, "-%s has no value; allowed: %s", key->name, allowed);
  PetscCall(ReadKey(comm, key, text, draft));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMSceneReadKeys(MPI_Comm comm, DLMSceneDraft *draft)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < DLMSceneKeyCount; i++) {
    PetscCall(ReadKey(comm, &DLMSceneKeys[i], DLMSceneKeys[i].preset, draft));
    PetscCall(DLMSceneReadKey(comm, &DLMSceneKeys[i], draft));
  }
  PetscFunctionReturn(0);
}
