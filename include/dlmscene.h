/*
  The scene: what the options describe, as plain data. Everything else is built from it.

  All lengths, times and masses are in one consistent system of units (the thesis uses CGS).
*/
#ifndef DLMSCENE_H
#define DLMSCENE_H

#include <petscsys.h>

typedef enum { DLM_MOTION_FREE, DLM_MOTION_ROTATE, DLM_MOTION_FIXED } DLMMotion;
typedef enum { DLM_PAIRING_COLLOCATION, DLM_PAIRING_IMMERSED } DLMPairingType;
typedef enum { DLM_POINTS_VOLUME, DLM_POINTS_SURFACE } DLMPointSet;
typedef enum { DLM_FLUID_NEWTONIAN, DLM_FLUID_OLDROYD_B, DLM_FLUID_UCM, DLM_FLUID_CARREAU } DLMFluidModel;
typedef enum { DLM_FORM_FACTOR, DLM_FORM_LOG } DLMPolymerForm;
typedef enum { DLM_COUPLING_EXPLICIT, DLM_COUPLING_BOTH_SIDES } DLMCoupling;
typedef enum { DLM_INSIDE_IDENTITY, DLM_INSIDE_EVOLVE, DLM_INSIDE_EXTEND, DLM_INSIDE_STOKES, DLM_INSIDE_AUTO } DLMInside;
typedef enum { DLM_MIRROR_NONE, DLM_MIRROR_HALF, DLM_MIRROR_WHOLE, DLM_MIRROR_AUTO } DLMMirror;
typedef enum { DLM_ACCURACY_NONE, DLM_ACCURACY_DRAFT, DLM_ACCURACY_STANDARD, DLM_ACCURACY_FINE, DLM_ACCURACY_REFERENCE } DLMAccuracy;
typedef enum { DLM_PLANE_12, DLM_PLANE_13, DLM_PLANE_23 } DLMPlane;
typedef enum { DLM_LUBRICATION_FALSE, DLM_LUBRICATION_TRUE, DLM_LUBRICATION_AUTO } DLMLubricationChoice;

extern const char *const DLMMotions[];
extern const char *const DLMPairingTypes[];
extern const char *const DLMPointSets[];
extern const char *const DLMFluidModels[];
extern const char *const DLMPolymerForms[];
extern const char *const DLMCouplings[];
extern const char *const DLMInsides[];
extern const char *const DLMLubrications[];
extern const char *const DLMPlanes[];
extern const char *const DLMMirrors[];
extern const char *const DLMAccuracies[];

/* One rigid sphere as the scene starts it. */
typedef struct {
  PetscReal center[3];   /* inside the box */
  PetscReal velocity[3]; /* initial V; a fixed sphere keeps it (default 0) */
  PetscReal omega[3];    /* initial omega; a fixed sphere keeps it (default 0) */
  PetscReal force[3];    /* prescribed external force, beside buoyancy */
  PetscReal torque[3];   /* prescribed external torque */
  PetscReal radius;
  PetscReal density;
  DLMMotion motion; /* free; rotate: V = 0, omega free; fixed: V and omega held */
  PetscInt  line;   /* of -spheres_file, for messages; 0: none */
} DLMSphereSpec;

/* One key that -accuracy sets: as a user would write it. */
typedef struct {
  const char *key;
  char        value[32];
  PetscBool   applied; /* false: the user gave the key, and that wins */
} DLMPresetKey;

enum { DLM_PRESET_KEYS = 8 };

#define DLM_AUTO (-1.0) /* value of a key left at "auto": the program chooses */

typedef struct {
  MPI_Comm comm;

  DLMAccuracy  accuracy;              /* the preset, or none */
  PetscInt     n_preset_keys;         /* what it set in this scene */
  DLMPresetKey preset_key[DLM_PRESET_KEYS];

  PetscReal box_size[3];
  PetscBool box_periodic[3];
  DLMMirror box_mirror;               /* what of a scene that is its own mirror image in x2 = 0 is computed; the check resolves DLM_MIRROR_AUTO */
  PetscBool mirror_chosen;            /* by that check, not by the user */
  PetscReal grid_resolution;          /* cells per unit length, 1/h */
  PetscReal h;                        /* mesh width */
  PetscInt  cells[3];                 /* cells per axis, even */
  PetscInt  grid_processes[3];        /* ranks per axis; 0,0,0: chosen by the program */
  PetscReal wall_velocity[3][2][3];   /* [axis][0 lower, 1 upper][component]; zero on periodic axes */
  PetscReal gravity[3];
  PetscReal pressure_gradient[3];     /* mean pressure gradient: a uniform body force -pressure_gradient on the fluid */

  DLMFluidModel fluid_model;
  PetscReal     fluid_density;
  PetscReal     fluid_viscosity;      /* eta1, total zero-shear viscosity */
  PetscReal     relaxation_time;      /* lambda1 */
  PetscReal     retardation_time;     /* lambda2; the solvent has eta1 lambda2/lambda1 */
  PetscReal     carreau_n;            /* exponent of the shear-thinning viscosities */
  PetscReal     implicit_viscosity;   /* that of the implicit operator: eta1 (once the polymer has grown, V3), or the solvent's under the explicit coupling */

  DLMPolymerForm polymer_form;        /* what is advected: Cholesky factor or logarithm of C */
  DLMCoupling    polymer_coupling;
  DLMInside      polymer_inside;      /* C in and next to the spheres; the check resolves DLM_INSIDE_AUTO */
  PetscReal      polymer_stress_offset; /* the extra stress counts from this far outside a surface on, in h; DLM_AUTO; 0: everywhere */
  PetscReal      polymer_courant;     /* bound of an advection sub-step */
  PetscReal      polymer_mode_amplitude; /* C starts as I + amplitude sin(2 pi number x3/L3) in one plane */
  DLMPlane       polymer_mode_plane;
  PetscInt       polymer_mode_number;

  PetscInt       n_spheres;
  DLMSphereSpec *spheres;             /* owned; the same on every rank */
  PetscBool      sphere_inertia;      /* M dV/dt and I domega/dt kept */

  DLMPairingType pairing_type;
  DLMPointSet    pairing_points;
  PetscReal      pairing_spacing;     /* marker spacing on the surface, in h; DLM_AUTO: calibrated */
  PetscReal      pairing_degree;      /* spherical harmonics that carry the surface multipliers; 0: every point its own; DLM_AUTO */
  PetscReal      pairing_retraction;  /* surface markers lie at a - retraction h; DLM_AUTO: calibrated */

  /* slip per traction, in h/viscosity: of the harmonics beyond degree 1, of the torque's and the stresslet's part of degree 1; 0: none; DLM_AUTO: calibrated */
  PetscReal      pairing_compliance, pairing_spin_compliance, pairing_strain_compliance;

  PetscReal contact_range;            /* rho; DLM_AUTO: h/8; 0: no repulsion */
  PetscReal contact_stiffness;        /* repulsion at touching (force); DLM_AUTO: from shear and buoyancy */
  DLMLubricationChoice lubrication;   /* friction across narrow gaps */
  PetscReal lubrication_range;        /* gaps narrower than this, in mean radii of the two bodies */

  PetscReal ts_dt, ts_max_time, ts_rtol; /* read here for checks and reports; TS reads its own keys too */

  PetscReal saddle_rtol;              /* tolerance of the bodies' solve */
  PetscReal saddle_cluster_gap;       /* spheres closer than this share one dense block; in h */
  PetscInt  saddle_cluster_limit;     /* most unknowns of a dense block; larger clusters are cut */
  PetscReal stokes_block_limit;       /* MiB per rank for the pressure Schur blocks; beyond: conjugate gradients */

  char      spheres_file[PETSC_MAX_PATH_LEN]; /* "": spheres of -sphere_centers, or none */
  char      output_dir[PETSC_MAX_PATH_LEN];
  PetscInt  output_every;             /* steps between rows of trajectory.csv */
  PetscInt  output_fields_every;      /* steps between field outputs; 0: none */
  PetscBool output_multipliers;       /* with the fields: points, multipliers and tractions of the spheres */
  PetscReal progress_every;           /* seconds between progress lines in a batch log */
  PetscInt  checkpoint_every;         /* steps between checkpoints; 0: none */
  PetscReal checkpoint_minutes;       /* minutes between checkpoints; 0: none */
  PetscBool dry_run;                  /* show what a run needs, and end */
  char      restart[PETSC_MAX_PATH_LEN]; /* the checkpoint to go on from, or "" */
  char      source[PETSC_MAX_PATH_LEN]; /* the scene's file, "" if written in options only */
} DLMScene;

/* Velocity nodes that are kept on axis d. Not collective. */
static inline PetscInt DLMSceneNodes(const DLMScene *scene, int d)
{
  if (d == 1 && scene->box_mirror == DLM_MIRROR_HALF) return scene->cells[d] / 2 + 1;
  return scene->cells[d] + (scene->box_periodic[d] ? 0 : 1);
}

/* The shear that the walls of one axis drive, in the directions of rheology: 1 the flow, 2 across the gap, 3 = 1 x 2. */
typedef struct {
  int       axis;    /* across the gap */
  PetscReal e[3][3]; /* unit vectors of the directions; 1: upper wall's velocity less the lower one's */
  PetscReal rate;    /* > 0 */
} DLMShear;

/* True if exactly one axis has walls and they differ in velocity along themselves. Not collective. */
PETSC_EXTERN PetscBool DLMSceneGetShear(const DLMScene *scene, DLMShear *shear);

/*
  DLMSceneCreate - reads the options database into a checked scene.

  Collective on comm. The spheres' file is read on rank 0 and broadcast. Raises PETSC_ERR_USER_INPUT with one line
  (key, value, what is allowed) when a key is out of range or keys contradict each other.
*/
PETSC_EXTERN PetscErrorCode DLMSceneCreate(MPI_Comm comm, DLMScene **scene);
PETSC_EXTERN PetscErrorCode DLMSceneDestroy(DLMScene **scene);
/* Prints the scene as understood. Collective. */
PETSC_EXTERN PetscErrorCode DLMSceneView(const DLMScene *scene, PetscViewer viewer);
/*
  DLMScenePresetMesh - mesh and time step that -accuracy gives this scene where no key says otherwise: cells per unit length (rounded up until every box length is
  an even number of cells; 0 without spheres) and dt (0 if nothing drives the scene). Not collective; a user error if no mesh fits the box.
*/
PETSC_EXTERN PetscErrorCode DLMScenePresetMesh(const DLMScene *scene, DLMAccuracy accuracy, PetscReal *resolution, PetscReal *dt);
/*
  Prints the presets for this scene: mesh, time step, the error measured in a scene like it, with the range in which that was measured, and how long a run
  over `time` takes at node_seconds per node and step. Collective.
*/
PETSC_EXTERN PetscErrorCode DLMScenePresetView(const DLMScene *scene, PetscReal node_seconds, PetscReal time, PetscViewer viewer);
/* Refuses keys of the options database that nothing has read. Call once every object is set up. Collective. */
PETSC_EXTERN PetscErrorCode DLMSceneCheckUnused(MPI_Comm comm);
/* Writes the table of keys as Markdown (docs/options.md) to file. Rank 0 only. */
PETSC_EXTERN PetscErrorCode DLMSceneWriteOptionsTable(FILE *file);
/*
  DLMInitialize - PetscInitialize for a program that takes a scene file and -options_file: PETSc sees the other arguments
  only, since it would report a missing or malformed file with a trace. DLMOptionsInsert reads the files.
*/
PETSC_EXTERN PetscErrorCode DLMInitialize(int argc, char **argv, const char help[]);
/*
  DLMOptionsInsert - loads options files into the database so that the command line wins. Call after DLMInitialize.
  A first argument without a dash is a scene file too: `dlmfd scene.yaml -ts_dt 0.01`.
*/
PETSC_EXTERN PetscErrorCode DLMOptionsInsert(MPI_Comm comm, int argc, char **argv);
/* True if -version or --version is among the arguments. */
PETSC_EXTERN PetscBool DLMOptionsAskVersion(int argc, char **argv);

/*
  User-facing errors: DLMUserCheck(cond, comm, fmt, ...) raises PETSC_ERR_USER_INPUT when cond is false. Collective: cond must agree on all ranks.
  DLMErrorHandler (pushed by main) prints such an error, and what else a user can mend, as the one line "dlmfd: error: ..." and every other error as PETSc
  does; DLMErrorIsUsers tells which kind came last.
*/
#define DLMUserCheck(cond, comm, ...) PetscCheck(cond, comm, PETSC_ERR_USER_INPUT, __VA_ARGS__)
PETSC_EXTERN PetscBool      DLMErrorIsUsers(void);
PETSC_EXTERN PetscErrorCode DLMErrorHandler(MPI_Comm, int, const char *, const char *, PetscErrorCode, PetscErrorType,
                                            const char *, void *);
#endif
