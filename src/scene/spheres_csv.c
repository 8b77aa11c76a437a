/* The spheres of a CSV file: rank 0 reads and checks, everyone gets the result. */
#include "sceneimpl.h"
#include <ctype.h>
#include <strings.h>

enum { MAX_COLUMNS = 32, MESSAGE_SIZE = 512 };

typedef enum { COLUMN_REAL, COLUMN_POSITIVE, COLUMN_MOTION } ColumnType;

typedef struct {
  const char *name;
  ColumnType  type;
  size_t      offset;
} Column;

#define AT(field) offsetof(DLMSphereSpec, field)
#define VECTOR(prefix, field)                                                                                  \
  {prefix "1", COLUMN_REAL, AT(field[0])}, {prefix "2", COLUMN_REAL, AT(field[1])},                            \
  {                                                                                                            \
    prefix "3", COLUMN_REAL, AT(field[2])                                                                      \
  }
static const Column columns[] = {
    VECTOR("x", center),
    VECTOR("V", velocity),
    VECTOR("omega", omega),
    VECTOR("F", force),
    VECTOR("T", torque),
    {"radius", COLUMN_POSITIVE, AT(radius)},
    {"density", COLUMN_POSITIVE, AT(density)},
    {"motion", COLUMN_MOTION, AT(motion)},
};
enum { N_COLUMNS = sizeof(columns) / sizeof(columns[0]) };

/* The file being read. A failure leaves one line in message. */
typedef struct {
  const char    *path;
  PetscInt       line; /* from 1 */
  PetscInt       n_header;
  const Column  *header[MAX_COLUMNS]; /* what each column of the file is */
  PetscInt       n, room;
  DLMSphereSpec *spheres; /* malloc'ed */
  char          *message;
} Reader;

static const char *ColumnName(PetscInt i)
{
  return columns[i].name;
}

#define FAIL(reader, ...) (snprintf((reader)->message, MESSAGE_SIZE, __VA_ARGS__), PETSC_FALSE)
#define WHERE "%s, line %" PetscInt_FMT

/* Cuts the next entry, without the blanks around it, off *rest; *rest is NULL after the last. */
static char *NextEntry(char **rest)
{
  char *entry = *rest, *comma = strchr(entry, ','), *end = comma ? comma : entry + strlen(entry);

  *rest = comma ? comma + 1 : NULL;
  while (isspace((unsigned char)*entry) && entry < end) entry++;
  while (end > entry && isspace((unsigned char)end[-1])) end--;
  *end = '\0';
  return entry;
}

static PetscBool ReadHeaderEntry(Reader *reader, const char name[])
{
  const Column *found = NULL;
  const char   *nearest;

  for (PetscInt i = 0; i < N_COLUMNS && !found; i++) {
    if (!strcasecmp(name, columns[i].name)) found = &columns[i];
  }
  if (!found) {
    nearest = DLMNearest(name, N_COLUMNS, ColumnName);
    return FAIL(reader,
                WHERE ": unknown column '%.40s'%s%s%s; allowed: x1,x2,x3 and radius, density, motion, V1..V3,"
                      " omega1..omega3, F1..F3, T1..T3",
                reader->path, reader->line, name, nearest ? ", did you mean " : "", nearest ? nearest : "",
                nearest ? "?" : "");
  }
  for (PetscInt i = 0; i < reader->n_header; i++) {
    if (reader->header[i] == found) {
      return FAIL(reader, WHERE ": column '%s' appears twice; allowed: once", reader->path, reader->line, name);
    }
  }
  reader->header[reader->n_header++] = found; /* N_COLUMNS different ones at most */
  return PETSC_TRUE;
}

static PetscBool ReadHeader(Reader *reader, char *line)
{
  for (char *rest = line; rest;) {
    if (!ReadHeaderEntry(reader, NextEntry(&rest))) return PETSC_FALSE;
  }
  for (PetscInt d = 0; d < 3; d++) {
    PetscBool present = PETSC_FALSE;
    for (PetscInt i = 0; i < reader->n_header; i++) present |= reader->header[i] == &columns[d];
    if (!present) {
      return FAIL(reader,
                  WHERE ": column %s is missing; allowed: a first row naming x1,x2,x3 and optional columns",
                  reader->path, reader->line, columns[d].name);
    }
  }
  return PETSC_TRUE;
}

static PetscBool ReadEntry(Reader *reader, const Column *column, const char text[], DLMSphereSpec *sphere)
{
  PetscReal number;

  if (column->type == COLUMN_MOTION) {
    PetscInt motion = DLMParseWord(text, strlen(text), DLMMotions);
    if (motion < 0) {
      return FAIL(reader, WHERE ", column motion: '%.40s' is not known; allowed: free, rotate or fixed",
                  reader->path, reader->line, text);
    }
    sphere->motion = (DLMMotion)motion;
    return PETSC_TRUE;
  }
  if (!DLMParseReal(text, strlen(text), &number)) {
    return FAIL(reader, WHERE ", column %s: '%.40s' is not a number; allowed: a number%s", reader->path,
                reader->line, column->name, text, column->type == COLUMN_POSITIVE ? " > 0" : "");
  }
  if (column->type == COLUMN_POSITIVE && number <= 0) {
    return FAIL(reader, WHERE ", column %s: %.40s is out of range; allowed: a number > 0", reader->path,
                reader->line, column->name, text);
  }
  *(PetscReal *)((char *)sphere + column->offset) = number;
  return PETSC_TRUE;
}

static PetscBool ReadRow(Reader *reader, const DLMSphereSpec *preset, char *line)
{
  PetscInt i = 0, given = 1;

  for (char *c = line; *c; c++) given += *c == ',';
  if (given != reader->n_header) {
    return FAIL(reader,
                WHERE ": '%.60s' has %" PetscInt_FMT " entries; allowed: %" PetscInt_FMT
                      ", as the header names",
                reader->path, reader->line, line, given, reader->n_header);
  }
  if (reader->n == reader->room) {
    PetscInt       room = 2 * reader->room + 64;
    DLMSphereSpec *larger = realloc(reader->spheres, (size_t)room * sizeof(*larger));
    if (!larger) return FAIL(reader, WHERE ": no memory for so many spheres; allowed: what fits", reader->path, reader->line);
    reader->spheres = larger;
    reader->room = room;
  }
  reader->spheres[reader->n]      = *preset;
  reader->spheres[reader->n].line = reader->line;
  for (char *rest = line; rest; i++) {
    if (!ReadEntry(reader, reader->header[i], NextEntry(&rest), &reader->spheres[reader->n]))
      return PETSC_FALSE;
  }
  reader->n++;
  return PETSC_TRUE;
}

static PetscBool ReadText(Reader *reader, const DLMSphereSpec *preset, char *text)
{
  if (!strncmp(text, DLM_BYTE_ORDER_MARK, 3)) text += 3;
  for (reader->line = 1; text; reader->line++) {
    char *line = text, *next = strchr(text, '\n');

    if (next) *next++ = '\0';
    text = next;
    line[strcspn(line, "#")] = '\0';
    line[strcspn(line, "\r")] = '\0';
    if (line[strspn(line, " \t")] == '\0') continue;
    if (!(reader->n_header ? ReadRow(reader, preset, line) : ReadHeader(reader, line))) return PETSC_FALSE;
  }
  if (reader->n == 0)
    return FAIL(reader, "%s: no spheres; allowed: a header row and a row a sphere", reader->path);
  return PETSC_TRUE;
}

/* The path as given, or beside the scene's file. */
static char *LoadBesideScene(const char path[], char reason[], size_t size)
{
  const char *source = DLMOptionsSource(), *slash = strrchr(source, '/');
  char        beside[2 * PETSC_MAX_PATH_LEN], *text = DLMLoadText(path, reason, size);

  if (text || path[0] == '/' || !slash) return text;
  snprintf(beside, sizeof(beside), "%.*s%s", (int)(slash - source) + 1, source, path);
  return DLMLoadText(beside, reason, size);
}

static void ReadOnRoot(Reader *reader, const DLMSphereSpec *preset)
{
  char  reason[128];
  char *text = LoadBesideScene(reader->path, reason, sizeof(reason));

  if (!text) (void)FAIL(reader, "%s: %s; allowed: a CSV file that can be read", reader->path, reason);
  else if (!ReadText(reader, preset, text)) reader->n = 0;
  free(text);
}

PetscErrorCode DLMSpheresReadCSV(MPI_Comm comm, const char path[], const DLMSphereSpec *preset, PetscInt *n,
                                 DLMSphereSpec *spheres[])
{
  char         message[MESSAGE_SIZE] = "";
  Reader       reader = {.path = path, .message = message};
  PetscMPIInt  rank;
  MPI_Datatype row;

  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) ReadOnRoot(&reader, preset);
  PetscCallMPI(MPI_Bcast(message, MESSAGE_SIZE, MPI_CHAR, 0, comm));
  DLMUserCheck(!message[0], comm, "-spheres_file %s", message);
  PetscCallMPI(MPI_Bcast(&reader.n, 1, MPIU_INT, 0, comm));
  PetscCall(PetscMalloc1(reader.n, spheres));
  if (!rank) PetscCall(PetscArraycpy(*spheres, reader.spheres, reader.n));
  free(reader.spheres);
  PetscCallMPI(MPI_Type_contiguous((PetscMPIInt)sizeof(DLMSphereSpec), MPI_BYTE, &row));
  PetscCallMPI(MPI_Type_commit(&row));
  PetscCallMPI(MPI_Bcast(*spheres, (PetscMPIInt)reader.n, row, 0, comm));
  PetscCallMPI(MPI_Type_free(&row));
  *n = reader.n;
  PetscFunctionReturn(0);
}
