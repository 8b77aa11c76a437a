/*
  YAML options files: a mapping whose keys are joined with _ over its levels, `box: {size: [1, 2, 3]}` for -box_size 1,2,3. libyaml reads them event by event, so
  that every complaint has its line, and a file that nests without end is left at its first step too deep.
*/
#include "sceneimpl.h"
#include <ctype.h>
#include <yaml.h>

enum { MOST_LEVELS = 16 };

typedef struct {
  DLMOptionsFile *file;
  const char     *text;
  yaml_parser_t   parser;
  yaml_event_t    event; /* the present one */
} Reader;

static PetscErrorCode Refuse(Reader *reader, size_t line, const char why[])
{
  const char *start = reader->text;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < line; i++) {
    const char *end = start + strcspn(start, "\n");
    if (!*end || !end[1]) break; /* the end of the text: its last line */
    start = end + 1;
  }
  if (start[strspn(start, " ")] == '\t') why = "indented with a tab";
  DLMUserCheck(PETSC_FALSE, reader->file->comm,
               "options file %s, line %zu: '%.*s' cannot be read (%s); allowed: YAML, 'key: value' with lists as [1, 2, 3], indented with blanks", reader->file->path, line + 1,
               (int)PetscMin(strcspn(start, "\r\n"), 60), start, why);
  PetscFunctionReturn(0);
}

/* The line to blame for a failure. Within something that begins on one line, a list or a word, it is that line. */
static size_t Culprit(const Reader *reader)
{
  const yaml_parser_t *p = &reader->parser;
  size_t               line = 0;

  if (p->error != YAML_READER_ERROR) return p->context && !strstr(p->context, "block") ? p->context_mark.line : p->problem_mark.line;
  for (size_t i = 0; i < p->problem_offset && reader->text[i]; i++) line += reader->text[i] == '\n';
  return line;
}

/* Steps to the next event. */
static PetscErrorCode Next(Reader *reader)
{
  PetscFunctionBeginUser;
  yaml_event_delete(&reader->event);
  if (yaml_parser_parse(&reader->parser, &reader->event)) PetscFunctionReturn(0);
  PetscCall(Refuse(reader, Culprit(reader), reader->parser.problem ? reader->parser.problem : "no memory"));
  PetscFunctionReturn(0);
}

static size_t Line(const Reader *reader)
{
  return reader->event.start_mark.line;
}

/* The text of a scalar event; a value that YAML calls null is none. */
static const char *Text(const Reader *reader)
{
  const char *text = (const char *)reader->event.data.scalar.value;
  const char *null[] = { "~", "null", "Null", "NULL" };

  for (int k = 0; k < 4 && reader->event.data.scalar.style == YAML_PLAIN_SCALAR_STYLE; k++)
    if (!strcmp(text, null[k])) return "";
  return text;
}

/* The scalars of a sequence, joined by commas, malloc'ed. */
static PetscErrorCode JoinSequence(Reader *reader, char **joined)
{
  size_t n;
  FILE  *out = open_memstream(joined, &n);

  PetscFunctionBeginUser;
  PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory for a list");
  for (PetscInt i = 0;; i++) {
    PetscCall(Next(reader));
    if (reader->event.type == YAML_SEQUENCE_END_EVENT) break;
    if (reader->event.type != YAML_SCALAR_EVENT) PetscCall(Refuse(reader, Line(reader), "a list holds something else than words and numbers"));
    fprintf(out, "%s%s", i ? "," : "", Text(reader));
  }
  PetscCheck(!fclose(out), PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory for a list");
  PetscFunctionReturn(0);
}

/* Without the blanks and line ends around it, as block scalars have them. */
static PetscErrorCode InsertTrimmed(Reader *reader, size_t line, const char name[], const char value[])
{
  char  *copy;
  size_t n;

  PetscFunctionBeginUser;
  while (isspace((unsigned char)*value)) value++;
  for (n = strlen(value); n && isspace((unsigned char)value[n - 1]); n--) { }
  PetscCall(PetscStrallocpy(value, &copy));
  copy[n] = '\0';
  PetscCall(DLMOptionsFileInsert(reader->file, (PetscInt)line + 1, name, copy));
  PetscCall(PetscFree(copy));
  PetscFunctionReturn(0);
}

/* The keys of a mapping up to its end; prefix is the keys above it. */
static PetscErrorCode ReadMapping(Reader *reader, const char prefix[], PetscInt level)
{
  char name[2 * DLM_KEY_LENGTH + 2], *joined = NULL;

  PetscFunctionBeginUser;
  for (;;) {
    PetscCall(Next(reader));
    if (reader->event.type == YAML_MAPPING_END_EVENT) break;
    const size_t line = Line(reader);
    if (reader->event.type != YAML_SCALAR_EVENT) PetscCall(Refuse(reader, line, "a key is one word"));
    snprintf(name, sizeof(name), "%s%.*s", prefix, DLM_KEY_LENGTH, (const char *)reader->event.data.scalar.value);
    PetscCall(Next(reader));
    if (reader->event.type == YAML_SCALAR_EVENT) {
      PetscCall(InsertTrimmed(reader, line, name, Text(reader)));
    } else if (reader->event.type == YAML_SEQUENCE_START_EVENT) {
      PetscCall(JoinSequence(reader, &joined));
      PetscCall(InsertTrimmed(reader, line, name, joined));
      free(joined);
    } else if (reader->event.type == YAML_MAPPING_START_EVENT) {
      if (level == MOST_LEVELS || strlen(name) >= DLM_KEY_LENGTH) PetscCall(Refuse(reader, Line(reader), "too many levels"));
      strcat(name, "_");
      PetscCall(ReadMapping(reader, name, level + 1));
    } else PetscCall(Refuse(reader, Line(reader), "an alias stands for the value of another key"));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode ReadStream(Reader *reader)
{
  PetscFunctionBeginUser;
  PetscCall(Next(reader)); /* start of the stream */
  PetscCall(Next(reader));
  if (reader->event.type == YAML_STREAM_END_EVENT) PetscFunctionReturn(0); /* an empty file */
  PetscCall(Next(reader));
  if (reader->event.type != YAML_MAPPING_START_EVENT) PetscCall(Refuse(reader, Line(reader), "expected 'key: value'"));
  PetscCall(ReadMapping(reader, "", 1));
  PetscCall(Next(reader)); /* end of the document */
  PetscCall(Next(reader));
  if (reader->event.type != YAML_STREAM_END_EVENT) PetscCall(Refuse(reader, Line(reader), "a second document begins here"));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMInsertYaml(DLMOptionsFile *file, const char text[])
{
  Reader reader = { .file = file, .text = text };

  PetscFunctionBeginUser;
  PetscCheck(yaml_parser_initialize(&reader.parser), PETSC_COMM_SELF, PETSC_ERR_MEM, "no memory to read YAML");
  yaml_parser_set_input_string(&reader.parser, (const unsigned char *)text, strlen(text));
  PetscCall(ReadStream(&reader));
  yaml_event_delete(&reader.event);
  yaml_parser_delete(&reader.parser);
  PetscFunctionReturn(0);
}
