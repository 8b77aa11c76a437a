/* Cases of the tests of the saddle problem: a box of sheared fluid, its spheres, every pairing. */
#ifndef SADDLETEST_H
#define SADDLETEST_H

#include "dlmtest.h"
#include "dlmsaddle.h"

enum { MOST = 20 };

static const DLMInertia no_inertia = { 0.0, 0.0, 0.0 };

/* A box of 3 x 2 x 2, periodic in x1 and x2, walls at x3 driven to and fro: shear rate 1. */
typedef struct {
  DLMScene        scene;
  DLMSphereSpec   spec[MOST];
  PetscReal       force[3 * MOST], torque[3 * MOST];
  DLMGrid         grid;
  DLMStokes       stokes;
  DLMSpheres      spheres;
  DLMPairing      pairing;
  DLMSaddle       saddle;
  DLMSphereState *state;
} Bodies;

static inline void StartCase(MPI_Comm comm, PetscInt cells_x1, PetscReal rtol, Bodies *b)
{
  const PetscInt cells[3] = { cells_x1, 2 * cells_x1 / 3, 2 * cells_x1 / 3 };

  memset(b, 0, sizeof(*b));
  MakeScene(comm, cells, 3, &b->scene);
  b->scene.h               = 3.0 / cells_x1;
  b->scene.grid_resolution = cells_x1 / 3.0;
  for (int d = 0; d < 3; d++) b->scene.box_size[d] = cells[d] * b->scene.h;
  b->scene.pairing_type         = DLM_PAIRING_IMMERSED;
  b->scene.pairing_points       = DLM_POINTS_SURFACE;
  b->scene.pairing_spacing      = DLM_AUTO;
  b->scene.pairing_degree       = DLM_AUTO;
  b->scene.pairing_retraction   = DLM_AUTO;
  b->scene.pairing_compliance   = DLM_AUTO;
  b->scene.pairing_spin_compliance = b->scene.pairing_strain_compliance = DLM_AUTO;
  b->scene.saddle_rtol          = rtol;
  b->scene.saddle_cluster_gap   = 2.0;
  b->scene.saddle_cluster_limit = 4000;
  for (int side = 0; side < 2; side++) b->scene.wall_velocity[2][side][0] = side ? 1.0 : -1.0;
  b->scene.spheres = b->spec;
}

static inline void AddSphere(Bodies *b, DLMMotion motion, PetscReal radius, PetscReal x1, PetscReal x2, PetscReal x3)
{
  b->spec[b->scene.n_spheres++] = (DLMSphereSpec){ .center = { x1, x2, x3 }, .radius = radius, .density = 1.5, .motion = motion };
}

static inline void Push(Bodies *b, PetscInt i, PetscReal F1, PetscReal F2, PetscReal F3, PetscReal T1, PetscReal T2, PetscReal T3)
{
  const PetscReal F[3] = { F1, F2, F3 }, T[3] = { T1, T2, T3 };

  for (int d = 0; d < 3; d++) {
    b->force[3 * i + d]  = F[d];
    b->torque[3 * i + d] = T[d];
  }
}

/* Boxes without spheres: all cases of a mesh share one, and its impulse responses. */
static struct {
  DLMScene  scene;
  DLMGrid   grid;
  DLMStokes stokes;
} boxes[8];
static int n_boxes;

static inline void FindBox(Bodies *b)
{
  int k = 0;

  while (k < n_boxes && (boxes[k].scene.comm != b->scene.comm || boxes[k].scene.cells[0] != b->scene.cells[0])) k++;
  if (k == n_boxes) {
    boxes[k].scene = b->scene;
    Call(DLMGridCreate(&boxes[k].scene, &boxes[k].grid));
    Call(DLMStokesCreate(boxes[k].grid, &boxes[k].scene, &boxes[k].stokes));
    n_boxes++;
  }
  b->grid   = boxes[k].grid;
  b->stokes = boxes[k].stokes;
}

static inline int DestroyBoxes(void **state)
{
  for (; n_boxes > 0; n_boxes--) {
    Call(DLMStokesDestroy(&boxes[n_boxes - 1].stokes));
    Call(DLMGridDestroy(&boxes[n_boxes - 1].grid));
  }
  return 0;
}

static inline void OpenCase(const char *options, Bodies *b)
{
  Call(PetscOptionsClear(NULL));
  Call(PetscOptionsInsertString(NULL, options));
  FindBox(b);
  Call(DLMSpheresCreate(b->grid, &b->scene, &b->spheres));
  Call(DLMPairingCreate(b->spheres, &b->scene, &b->pairing));
  Call(DLMSaddleCreate(b->stokes, b->spheres, b->pairing, &b->scene, &b->saddle));
  Call(DLMSpheresGetStates(b->spheres, NULL, &b->state));
}

static inline void CloseCase(Bodies *b)
{
  Call(DLMSaddleDestroy(&b->saddle));
  Call(DLMPairingDestroy(&b->pairing));
  Call(DLMSpheresDestroy(&b->spheres));
}

/* Returns the iterations. */
static inline PetscInt Solve(Bodies *b, DLMInertia inertia)
{
  DLMSaddleWork work;

  Call(DLMSaddleSolve(b->saddle, inertia, b->force, b->torque, NULL));
  Call(DLMSaddleGetWork(b->saddle, &work));
  return work.last_iterations;
}

/* Slip over the velocity of the fluid at the spheres, both as root mean squares over the multipliers. */
static inline double Slip(Bodies *b)
{
  PetscInt     n_points, n;
  PetscReal    slip, scale[2] = { 0.0, 0.0 };
  PetscScalar *points, *values;
  Vec          fluid;

  Call(DLMSaddleGetSlip(b->saddle, &slip));
  Call(DLMSaddleGetFluid(b->saddle, &fluid));
  Call(DLMPairingGetPoints(b->pairing, &n_points, NULL, NULL));
  Call(DLMPairingGetMultipliers(b->pairing, &n, NULL));
  Call(PetscMalloc2(3 * n_points, &points, 3 * n, &values));
  Call(DLMPairingInterpolate(b->pairing, fluid, points));
  Call(DLMPairingProject(b->pairing, points, values));
  for (PetscInt i = 0; i < 3 * n; i++) scale[0] += values[i] * values[i];
  scale[1] = n;
  Call(MPI_Allreduce(MPI_IN_PLACE, scale, 2, MPIU_REAL, MPI_SUM, b->scene.comm));
  Call(PetscFree2(points, values));
  return slip / sqrt(scale[0] / scale[1]);
}

/* Largest difference of velocity, omega, force and torque, each against its largest value; lengths and times are of order one here. */
static inline double Difference(const Bodies *a, const Bodies *b)
{
  double worst = 0.0;

  for (int part = 0; part < 4; part++) {
    const size_t at[4] = { offsetof(DLMSphereState, velocity), offsetof(DLMSphereState, omega), offsetof(DLMSphereState, force), offsetof(DLMSphereState, torque) };
    double       difference = 0.0, largest = 1.0;
    for (PetscInt i = 0; i < a->scene.n_spheres; i++)
      for (int d = 0; d < 3; d++) {
        const double x = ((const PetscReal *)((const char *)&a->state[i] + at[part]))[d], y = ((const PetscReal *)((const char *)&b->state[i] + at[part]))[d];
        if (!(fabs(x - y) <= difference)) difference = fabs(x - y);
        largest = fmax(largest, fabs(y));
      }
    worst = fmax(worst, difference / largest);
  }
  return worst;
}

/* A free, a rotating and a fixed sphere, one across the periodic faces, one near a wall. */
static inline void AddThree(Bodies *b)
{
  AddSphere(b, DLM_MOTION_FREE, 0.3, -0.37, 0.91, 0.36);
  AddSphere(b, DLM_MOTION_ROTATE, 0.32, 0.41, -0.13, -0.55);
  AddSphere(b, DLM_MOTION_FIXED, 0.28, 1.43, 0.25, 0.15);
  for (int d = 0; d < 3; d++) {
    b->spec[2].velocity[d] = (double[3]){ 0.2, -0.1, 0.05 }[d];
    b->spec[2].omega[d]    = (double[3]){ -0.3, 0.2, 0.4 }[d];
  }
  Push(b, 0, 1.0, -2.0, 0.5, 0.1, 0.2, -0.3);
  Push(b, 1, 3.0, 1.0, 2.0, -0.2, 0.3, 0.1);
  Push(b, 2, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0); /* a held sphere does not care */
}

/* Pairings: type x points x (a multiplier at every point, harmonics, and those with what calibration chooses). */
typedef struct {
  DLMPairingType type;
  DLMPointSet    points;
  PetscReal      degree;
} PairingCase;

static const PairingCase pairings[] = {
  { DLM_PAIRING_IMMERSED, DLM_POINTS_SURFACE, DLM_AUTO },  { DLM_PAIRING_IMMERSED, DLM_POINTS_SURFACE, 0.0 },
  { DLM_PAIRING_IMMERSED, DLM_POINTS_VOLUME, DLM_AUTO },   { DLM_PAIRING_COLLOCATION, DLM_POINTS_SURFACE, DLM_AUTO },
  { DLM_PAIRING_COLLOCATION, DLM_POINTS_VOLUME, DLM_AUTO }, { DLM_PAIRING_COLLOCATION, DLM_POINTS_SURFACE, 3.0 },
  { DLM_PAIRING_IMMERSED, DLM_POINTS_VOLUME, 3.0 },
};

enum { N_PAIRINGS = sizeof(pairings) / sizeof(pairings[0]) };

static inline void SetPairing(const PairingCase *p, Bodies *b)
{
  b->scene.pairing_type   = p->type;
  b->scene.pairing_points = p->points;
  b->scene.pairing_degree = p->degree;
}
#endif
