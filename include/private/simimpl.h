#ifndef DLM_SIMIMPL_H
#define DLM_SIMIMPL_H

#include <petsctime.h>
#include "../dlmpolymer.h"
#include "../dlmsim.h"
#include "checkpoint.h"
#include "dlmfieldsio.h"

typedef struct _p_DLMOutput *DLMOutput;

/* What a simulation may consist of, in dependency order (parts.c). */
typedef enum {
  DLM_PART_GRID,
  DLM_PART_STOKES,
  DLM_PART_PRESSURE_BLOCKS,
  DLM_PART_SPHERES,
  DLM_PART_LUBRICATION,
  DLM_PART_CONTACT,
  DLM_PART_MOTION,
  DLM_PART_INERTIA,
  DLM_PART_FLOW,
  DLM_PART_RESPONSES,
  DLM_PART_BLOCKS,
  DLM_PART_POLYMER,
  DLM_PART_STEPPING,
  DLM_PART_ADAPTED,
  DLM_PART_STEP_COPY,
  DLM_PART_TRAJECTORY,
  DLM_PART_BULK,
  DLM_PART_FIELDS,
  DLM_PART_CHECKPOINTS,
  DLM_PART_WORK,
  DLM_N_PARTS
} DLMPart;

typedef struct {
  PetscBool      built;
  char           why[128];
  PetscReal      bytes;   /* heap of this rank that it grew by */
  PetscLogDouble seconds; /* to build it; of an output: to write it, so far */
} DLMPartRecord;

/* A row of the table that users see. */
typedef struct {
  const char *object;
  PetscBool   built;
  const char *why;   /* or why not; borrowed from the simulation */
  PetscReal   bytes; /* on all ranks */
} DLMModelled;

/* Where a checkpoint stands. */
typedef struct {
  PetscInt  step;
  PetscReal time, dt, ts_dt, ts_max_time; /* dt: of the next step; then the options of the run that wrote it */
} DLMRunState;

/*
  The mesh rides along periodic axes with the mean velocity of the walls: creeping flow does not know which wall moves, and so neither do the
  errors of the mesh. Objects below the simulation live in that frame; files and messages speak of the frame of the scene.
*/
/* What adapt.c knows of the steps before: mean rates of what moves, over an interval; newest last, then room for the present step's. */
typedef struct {
  PetscBool  exists, own_rtol; /* -ts_adapt_type scene; the saddle's tolerance is the user's */
  PetscInt   n, known;         /* rates; steps whose rates are known, at most 2 */
  PetscReal *rate[3], interval[2];
  PetscReal  mean[6];          /* of C at the start of the present step, after the rule for C inside the spheres */
} DLMAdaptState;

struct _p_DLMSimulation {
  const DLMScene *scene;    /* as the user wrote it */
  const DLMScene *whole;    /* the same, or what the scene is a piece of (dryrun.c) */
  DLMScene        riding;   /* the same in the frame of the mesh; owns its spheres */
  PetscReal       frame_velocity[3];
  DLMPartRecord   part[DLM_N_PARTS];
  DLMGrid         grid;
  DLMStokes       stokes;
  DLMSpheres      spheres;  /* NULL without spheres, like pairing */
  DLMPairing      pairing;
  DLMSaddle       saddle;
  DLMContact      contact;
  DLMLubrication  lubrication; /* for the moves of the centres; the saddle keeps its own */
  PetscBool       flowing;  /* a velocity has been solved for */
  PetscReal       implicit_viscosity; /* of the last solve (V3) */
  DLMPolymer      polymer;  /* NULL in Newtonian fluid, like what follows */
  Vec             body_force; /* of the polymer's stress */
  DLMPolymerHealth health, worst; /* of the last step; smallest eigenvalue, largest trace and courant number of the run so far */
  PetscReal       worst_time;
  DLMSphereState *kept; /* of the start of the step, like the next two */
  PetscReal       kept_velocity_time, kept_last_interval, kept_dt;
  Vec             kept_fluid;
  TS              ts;
  DLMAdaptState   adapt;
  Vec             sphere_states, solution; /* solution: sphere states, nested with C if there is polymer; sphere states: centre, V, omega and those of the step before, 15 per sphere */
  PetscReal      *start;    /* centres at the start of the step, 3 per sphere */
  PetscReal      *force, *torque; /* on the spheres beside the fluid */
  PetscReal       velocity_time, last_interval; /* time of the last velocities; interval before it, 0 in the first step */
  PetscReal       gap;          /* now, infinity without spheres */
  PetscReal       smallest_gap, largest_slip;   /* of the run so far */
  DLMCheckpointFile *restart;    /* open from Create to Solve, NULL if the run starts anew */
  PetscInt        first_step;    /* that the run starts from */
  PetscInt        saved_step;    /* of the checkpoint.h5 that this run has written, or -1 */
  PetscBool       checkpoint_due; /* after the outputs of this step, like stop_signal the same on every rank */
  int             stop_signal;   /* that ended the run, or 0 */
  PetscLogDouble  last_checkpoint;
  DLMOutput       output;
  PetscReal       heap;          /* of this rank after the set-up, without what outputs keep since */
  PetscLogDouble  created, setup_seconds;
};

/* parts.c: builds the simulation, part by part. Collective, like the next three. */
PETSC_INTERN PetscErrorCode DLMSimulationBuildParts(DLMSimulation sim);
/* Counts the heap that the steps have made since the set-up. */
PETSC_INTERN PetscErrorCode DLMSimulationCountWork(DLMSimulation sim);
PETSC_INTERN PetscErrorCode DLMSimulationGetModelled(DLMSimulation sim, DLMModelled modelled[DLM_N_PARTS]);
/* As the table names it. */
PETSC_INTERN const char *DLMPartName(DLMPart part);
PETSC_INTERN PetscErrorCode DLMModelledView(const DLMModelled modelled[DLM_N_PARTS], PetscViewer viewer);
/* sim.c: the TS and its verbs; numbers that the program chose, beside the table; a simulation of a piece of a scene, described as the whole. Collective. */
PETSC_INTERN PetscErrorCode DLMSimulationCreateStepping(DLMSimulation sim);
PETSC_INTERN PetscErrorCode DLMSimulationViewDetails(DLMSimulation sim, PetscViewer viewer);
PETSC_INTERN PetscErrorCode DLMSimulationCreatePiece(const DLMScene *piece, const DLMScene *whole, DLMSimulation *sim);
/* Steps dt that fill a time, at most `most`. */
PETSC_INTERN PetscReal DLMSimulationCountSteps(PetscReal time, PetscReal dt, PetscInt most);
/* Times that something is written at the start, every so many steps, and at the end. */
PETSC_INTERN PetscReal DLMSimulationCountOutputs(PetscReal steps, PetscInt every);

/* frame.c: x + frame_velocity t, for a position or a shift of one. */
PETSC_INTERN PetscErrorCode DLMSimulationRide(DLMSimulation sim);
/* state.c */
PETSC_INTERN PetscErrorCode DLMSimulationCreateSolution(DLMSimulation sim);
PETSC_INTERN PetscErrorCode DLMSimulationLoad(void *sim, Vec solution);
PETSC_INTERN PetscErrorCode DLMSimulationStore(void *sim, Vec solution);
/* fluid.c: the polymer's verbs and the saddle solve with its stress; does without polymer too. */
/* Gives the implicit operator the viscosity that it has in a step from t, and repulsion that of the forces it works against. Before the forces of the step. */
PETSC_INTERN PetscErrorCode DLMSimulationSetViscosity(DLMSimulation sim, PetscReal t, PetscReal dt);
PETSC_INTERN PetscErrorCode DLMSimulationSolveFlow(DLMSimulation sim, PetscReal t, PetscReal dt, DLMInertia inertia);
PETSC_INTERN PetscErrorCode DLMSimulationCreatePolymer(DLMSimulation sim);
PETSC_INTERN PetscErrorCode DLMSimulationDestroyPolymer(DLMSimulation sim);
PETSC_INTERN PetscErrorCode DLMSimulationAddPolymerSubsteps(DLMSimulation sim);
/* Elastic number of a step dt that finds or leaves this trace of C: dt times the elastic stress over the implicit viscosity (docs/theory.md, V4). */
PETSC_INTERN PetscReal DLMSimulationElasticNumber(DLMSimulation sim, PetscReal dt, PetscReal trace);
/* Largest dt that the explicit coupling bears; infinity if any. */
PETSC_INTERN PetscReal DLMSimulationExplicitBound(DLMSimulation sim);
/* Prints a line if dt is beyond it, and one if the fluid thins by so much that its shear flow is unstable. Collective. */
PETSC_INTERN PetscErrorCode DLMSimulationWarn(DLMSimulation sim);
/* keep.c */
PETSC_INTERN PetscErrorCode DLMSimulationKeep(void *sim);
PETSC_INTERN PetscErrorCode DLMSimulationBringBack(void *sim);
PETSC_INTERN PetscErrorCode DLMSimulationGiveUp(void *sim);
/*
  adapt.c: the TSAdapt type `scene`. Create: after the TS has its options; Start: before the first step; NoteConformation: when C of a step's start is ready; SetTolerance: the saddle's, for a step dt that is
  allowed -ts_rtol, unless -saddle_rtol is given. Collective.
*/
PETSC_INTERN PetscErrorCode DLMAdaptRegister(void);
PETSC_INTERN PetscErrorCode DLMAdaptCreate(DLMSimulation sim);
PETSC_INTERN PetscErrorCode DLMAdaptStart(DLMSimulation sim);
PETSC_INTERN PetscErrorCode DLMAdaptNoteConformation(DLMSimulation sim);
PETSC_INTERN PetscErrorCode DLMAdaptSetTolerance(DLMSimulation sim, PetscReal dt);
PETSC_INTERN PetscErrorCode DLMAdaptDestroy(DLMSimulation sim);
/* stop.c: SIGTERM and SIGUSR1 end the run after the present step; StopCatch at its start, StopRelease at its end. */
PETSC_INTERN PetscErrorCode DLMStopCatch(DLMSimulation sim);
PETSC_INTERN PetscErrorCode DLMStopRelease(DLMSimulation sim);
/* substeps.c */
PETSC_INTERN PetscErrorCode DLMSimulationAddSubsteps(DLMSimulation sim);
/* Velocities that balance the forces at the present centres, for spheres without inertia. */
PETSC_INTERN PetscErrorCode DLMSimulationStart(DLMSimulation sim);
/*
  io/checkpoint.c. Write: the state after the last accepted step, to go on with dt; *failed is 0 or errno, and then an older file is untouched.
  Open: if the scene asks for a restart, checks the file and what must not change. Load: sets every object and the TS.
*/
PETSC_INTERN PetscErrorCode DLMCheckpointWrite(DLMSimulation sim, const char *path, PetscReal dt, int *failed);
PETSC_INTERN PetscErrorCode DLMCheckpointOpen(DLMSimulation sim);
PETSC_INTERN PetscErrorCode DLMCheckpointLoad(DLMSimulation sim);
/* Where the opened checkpoint stands. */
PETSC_INTERN PetscErrorCode DLMCheckpointReadStart(DLMSimulation sim, PetscInt *step, PetscReal *time);
/* io/fields.c: bytes of numbers in one output of fields. Collective. */
PETSC_INTERN PetscErrorCode DLMFieldsGetBytes(DLMSimulation sim, PetscReal *bytes);
/* io/output.c: a TS monitor that writes the run's files and its progress. */
PETSC_INTERN PetscErrorCode DLMOutputCreate(DLMSimulation sim, DLMOutput *output);
PETSC_INTERN PetscErrorCode DLMOutputFinish(DLMOutput output);
PETSC_INTERN PetscErrorCode DLMOutputDestroy(DLMOutput *output);
#endif
