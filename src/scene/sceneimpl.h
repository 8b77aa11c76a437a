/* What the files of src/scene share. */
#ifndef DLM_SCENEIMPL_H
#define DLM_SCENEIMPL_H

#include <dlmscene.h>

/* The options as read, before spheres are made of them. */
typedef struct {
  DLMScene      scene;
  DLMSphereSpec sphere; /* -sphere_...: the spheres of -sphere_centers, and the columns a file leaves out */
  PetscInt      n_centers; /* numbers in -sphere_centers, 3 a sphere */
  PetscReal    *centers;
  PetscInt      ts_max_steps, split_retries;
  int           ts_split_scheme, ts_adapt_type;
} DLMSceneDraft;

typedef enum {
  DLM_KEY_BOOL,
  DLM_KEY_BOOL3,
  DLM_KEY_INT,
  DLM_KEY_INT3,
  DLM_KEY_REAL,
  DLM_KEY_AUTO, /* a real number or the word auto */
  DLM_KEY_REAL3,
  DLM_KEY_REALS, /* any number of reals; the draft's centers */
  DLM_KEY_WORD,  /* stored as an enum */
  DLM_KEY_TEXT
} DLMKeyType;

typedef struct {
  const char        *group, *name;
  DLMKeyType         type;
  const char        *preset; /* the default, as a user would write it */
  size_t             offset; /* in DLMSceneDraft */
  PetscReal          least, most;
  const char *const *words; /* a PETSc enum list, for DLM_KEY_WORD */
  const char        *unit, *help;
} DLMSceneKey;

extern const DLMSceneKey DLMSceneKeys[];
extern const PetscInt    DLMSceneKeyCount;

/* table.c: what a key allows, as words; the table as the text of -help */
PETSC_INTERN void           DLMKeyAllowed(const DLMSceneKey *key, char text[], size_t size);
PETSC_INTERN PetscErrorCode DLMScenePrintHelp(MPI_Comm comm);

/* parse.c: strict readers of one value, false where the text is anything else (trailing text, nan, inf) */
PETSC_INTERN PetscBool      DLMParseReal(const char text[], size_t length, PetscReal *value);
PETSC_INTERN PetscInt       DLMWordCount(const char *const words[]);
PETSC_INTERN PetscInt       DLMParseWord(const char text[], size_t length, const char *const words[]);
PETSC_INTERN PetscErrorCode DLMSceneReadKeys(MPI_Comm comm, DLMSceneDraft *draft);
/* one key of the options database, if it is there */
PETSC_INTERN PetscErrorCode DLMSceneReadKey(MPI_Comm comm, const DLMSceneKey *key, DLMSceneDraft *draft);

/* presets.c: puts what -accuracy says into the options database where the user gave no such key, and reads it */
PETSC_INTERN PetscErrorCode DLMSceneApplyPreset(DLMSceneDraft *draft);
/* presets.c: the fastest rate at which the walls, the mean pressure gradient and what acts on a sphere deform the fluid or carry a sphere past its own radius */
PETSC_INTERN PetscReal DLMSceneDrivingRate(const DLMScene *scene);

/* unknown.c */
PETSC_INTERN PetscErrorCode DLMSceneRefuseUnknown(MPI_Comm comm);
PETSC_INTERN const char    *DLMNearest(const char name[], PetscInt n,
                                       const char *(*candidate)(PetscInt)); /* or NULL */

/* text.c: the text of a file, malloc'ed, or NULL and the reason (what is cut off at a zero byte is no text); the same on every rank, freed with PetscFree */
PETSC_INTERN char          *DLMLoadText(const char path[], char reason[], size_t size);
PETSC_INTERN PetscErrorCode DLMLoadTextCollective(MPI_Comm comm, const char path[], char *text[]);
#define DLM_BYTE_ORDER_MARK "\xef\xbb\xbf"

/* An options file that is being read. */
enum { DLM_MOST_KEYS = 300, DLM_MOST_ARGUMENTS = 200, DLM_KEY_LENGTH = 128 }; /* PETSc keeps 512 keys */
typedef struct {
  MPI_Comm    comm;
  const char *path;
  PetscInt    n;
  struct {
    char     name[DLM_KEY_LENGTH + 1];
    PetscInt line;
  } keys[DLM_MOST_KEYS];
} DLMOptionsFile;

/* options_file.c: puts a key of the file, without its dash, into the database; a user error if it is none, is there already, or is one too many */
PETSC_INTERN PetscErrorCode DLMOptionsFileInsert(DLMOptionsFile *file, PetscInt line, const char name[], const char value[]);
/* options_plain.c, options_yaml.c: the keys of a text, which the plain form cuts up */
PETSC_INTERN PetscErrorCode DLMInsertPlain(DLMOptionsFile *file, char text[]);
PETSC_INTERN PetscErrorCode DLMInsertYaml(DLMOptionsFile *file, const char text[]);
/* options_file.c */
PETSC_INTERN const char *DLMOptionsSource(void);   /* the scene's file or "" */

/* spheres_csv.c: the spheres of a file, in its order; the same on every rank. preset fills the absent columns.
 */
PETSC_INTERN PetscErrorCode DLMSpheresReadCSV(MPI_Comm comm, const char path[], const DLMSphereSpec *preset,
                                              PetscInt *n, DLMSphereSpec *spheres[]);

/* check.c: mesh of the box, then contradictions */
PETSC_INTERN PetscErrorCode DLMSceneSetGrid(DLMScene *scene);
PETSC_INTERN PetscErrorCode DLMSceneCheck(DLMScene *scene);
/* check.c: "sphere 3", and where a file names it; the text of a message */
enum { DLM_SPHERE_NAME = PETSC_MAX_PATH_LEN + 64 };
PETSC_INTERN const char *DLMSphereName(const DLMScene *scene, PetscInt i, char text[DLM_SPHERE_NAME]);
/* overlap.c: refuses spheres that overlap, periodic images counted, in time O(number of spheres) */
/* mirror.c: true if the scene, whose -box_mirror need not be resolved, is to be computed on half of the box, should its mesh allow it. */
PETSC_INTERN PetscBool DLMSceneWantsHalf(const DLMScene *scene);
/* mirror.c: resolves -box_mirror, or says why half of the box will not do. */
PETSC_INTERN PetscErrorCode DLMSceneSetMirror(DLMScene *scene);
PETSC_INTERN PetscErrorCode DLMSceneCheckOverlap(const DLMScene *scene);

#endif
