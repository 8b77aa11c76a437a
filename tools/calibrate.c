/*
  Measures the hydrodynamic radius of spheres covered by markers at radius r: drag, torque and stresslet against the exact values, over the
  positions of the centre in the mesh. One Stokes solver serves all cases.

    dlmfd_calibrate [-grid_resolution 48] [-radii 2,3,4] [-spacings 1,1.5,2] [-positions 12] > docs/calibration.csv

  The box is 2 x 2 x 2, periodic in x1 and x2. A force along x2, a torque about x3 and a shear in the x1-x3 plane act at once; by symmetry
  they do not disturb each other. The image correction of the drag, V = F/(6 pi mu) (1/a - k), is that of the exact value
  1.010834 at a = 0.1 (docs/theory.md); those of torque and stresslet are of order (a/L)^3 and left out.
*/
#include <dlmsaddle.h>

static const PetscReal image_correction = -0.10834;

typedef struct {
  PetscReal sum[3], square[3], iterations;
} Sample;

/* Effective radii from drag, torque and stresslet of one sphere. */
static PetscErrorCode Measure(DLMGrid grid, DLMStokes stokes, DLMScene *scene, PetscReal radius[3], PetscInt *iterations)
{
  DLMSphereSpec  *spec = &scene->spheres[0];
  DLMSpheres      spheres;
  DLMPairing      pairing;
  DLMSaddle       saddle;
  DLMSaddleWork   work;
  DLMSphereState *state;
  const PetscReal mu = scene->fluid_viscosity;

  PetscFunctionBeginUser;
  PetscCall(DLMSpheresCreate(grid, scene, &spheres));
  PetscCall(DLMPairingCreate(spheres, scene, &pairing));
  PetscCall(DLMSaddleCreate(stokes, spheres, pairing, scene, &saddle));
  PetscCall(DLMSaddleSolve(saddle, (DLMInertia){ 0.0, 0.0, 0.0 }, spec->force, spec->torque, NULL));
  PetscCall(DLMSpheresGetStates(spheres, NULL, &state));
  PetscCall(DLMSaddleGetWork(saddle, &work));
  *iterations = work.last_iterations;
  radius[0]   = 1.0 / (6.0 * PETSC_PI * mu * state->velocity[1] / spec->force[1] + image_correction);
  radius[1]   = PetscPowReal(spec->torque[2] / (8.0 * PETSC_PI * mu * state->omega[2]), 1.0 / 3.0);
  radius[2]   = PetscPowReal(PetscAbsReal(state->stresslet[4]) / (10.0 / 3.0 * PETSC_PI * mu), 1.0 / 3.0);
  PetscCall(DLMSaddleDestroy(&saddle));
  PetscCall(DLMPairingDestroy(&pairing));
  PetscCall(DLMSpheresDestroy(&spheres));
  PetscFunctionReturn(0);
}

/* One line of the table: means over the positions, and their spread. */
static PetscErrorCode Case(DLMGrid grid, DLMStokes stokes, DLMScene *scene, PetscReal r, PetscInt positions)
{
  const PetscReal golden[3] = { 0.8191725133961645, 0.6710436067037893, 0.5497004779019703 };
  Sample          s         = { { 0.0 }, { 0.0 }, 0.0 };
  DLMSphereSpec  *spec      = &scene->spheres[0];

  PetscFunctionBeginUser;
  spec->radius = r * scene->h;
  for (PetscInt p = 0; p < positions; p++) {
    PetscReal radius[3];
    PetscInt  its;
    for (int d = 0; d < 3; d++) spec->center[d] = 2.0 * scene->h * ((p + 1) * golden[d] - PetscFloorReal((p + 1) * golden[d]));
    PetscCall(Measure(grid, stokes, scene, radius, &its));
    s.iterations += its;
    for (int k = 0; k < 3; k++) {
      s.sum[k] += radius[k] / scene->h;
      s.square[k] += PetscSqr(radius[k] / scene->h);
    }
  }
  PetscCall(PetscPrintf(scene->comm, "%s,%s,%.6g,%" PetscInt_FMT ",%.6g,%.6g", DLMPairingTypes[scene->pairing_type], DLMPointSets[scene->pairing_points],
                        (double)scene->pairing_spacing, (PetscInt)scene->pairing_degree, (double)scene->pairing_compliance, (double)r));
  for (int k = 0; k < 3; k++) {
    const PetscReal mean = s.sum[k] / positions;
    PetscCall(PetscPrintf(scene->comm, ",%.6f,%.6f", (double)(mean - r), (double)PetscSqrtReal(PetscMax(0.0, s.square[k] / positions - mean * mean))));
  }
  PetscCall(PetscPrintf(scene->comm, ",%.6g\n", (double)(s.iterations / positions)));
  PetscFunctionReturn(0);
}

static PetscErrorCode Calibrate(int argc, char **argv)
{
  PetscReal radii[16] = { 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0 }, spacings[8] = { 1.0, 1.25, 1.5, 1.75, 2.0 }, compliances[16] = { 0.0 };
  PetscInt  n_radii = 16, n_spacings = 8, positions = 12, types[2] = { 1, 0 }, n_types = 2, sets[2] = { 1, 0 }, n_sets = 2, degrees[16] = { 0 }, n_degrees = 16, n_compliances = 16;
  PetscBool set;
  DLMScene *scene;
  DLMGrid   grid;
  DLMStokes stokes;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-radii", radii, &n_radii, &set));
  if (!set) n_radii = 8;
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-spacings", spacings, &n_spacings, &set));
  if (!set) n_spacings = 5;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-positions", &positions, NULL));
  PetscCall(PetscOptionsGetIntArray(NULL, NULL, "-types", types, &n_types, &set));
  if (!set) n_types = 2;
  PetscCall(PetscOptionsGetIntArray(NULL, NULL, "-sets", sets, &n_sets, &set));
  if (!set) n_sets = 2;
  PetscCall(PetscOptionsGetIntArray(NULL, NULL, "-degrees", degrees, &n_degrees, &set));
  if (!set) n_degrees = 1;
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-compliances", compliances, &n_compliances, &set));
  if (!set) n_compliances = 1;
  const char *own[] = { "-radii", "-spacings", "-positions", "-types", "-sets", "-degrees", "-compliances" };
  for (int i = 0; i < 7; i++) PetscCall(PetscOptionsClearValue(NULL, own[i]));
  const char *fixed[][2] = { { "-box_size", "2,2,2" }, { "-sphere_centers", "0,0,0" }, { "-sphere_force", "0,1,0" }, { "-sphere_torque", "0,0,1" },
                             { "-sphere_inertia", "0" }, { "-wall_velocity_upper", "1,0,0" }, { "-wall_velocity_lower", "-1,0,0" },
                             { "-pairing_retraction", "0" } };
  for (int i = 0; i < 8; i++) PetscCall(PetscOptionsSetValue(NULL, fixed[i][0], fixed[i][1]));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-grid_resolution", &set));
  if (!set) PetscCall(PetscOptionsSetValue(NULL, "-grid_resolution", "48"));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-saddle_rtol", &set));
  if (!set) PetscCall(PetscOptionsSetValue(NULL, "-saddle_rtol", "1e-5"));
  PetscCall(DLMSceneCreate(PETSC_COMM_WORLD, &scene));
  PetscCall(DLMGridCreate(scene, &grid));
  PetscCall(DLMStokesCreate(grid, scene, &stokes));
  PetscCall(PetscPrintf(scene->comm, "pairing,points,spacing,degree,compliance,marker_radius,drag,drag_spread,torque,torque_spread,stresslet,stresslet_spread,iterations\n"));
  for (PetscInt t = 0; t < n_types; t++)
    for (PetscInt q = 0; q < n_sets; q++)
      for (PetscInt k = 0; k < n_spacings * n_degrees * n_compliances; k++)
        for (PetscInt i = 0; i < n_radii; i++) {
          scene->pairing_type    = (DLMPairingType)types[t];
          scene->pairing_points  = (DLMPointSet)sets[q];
          scene->pairing_compliance = compliances[k % n_compliances];
          scene->pairing_degree     = degrees[(k / n_compliances) % n_degrees];
          scene->pairing_spacing    = spacings[k / n_compliances / n_degrees];
          PetscCall(Case(grid, stokes, scene, radii[i], positions));
        }
  PetscCall(DLMStokesDestroy(&stokes));
  PetscCall(DLMGridDestroy(&grid));
  PetscCall(DLMSceneDestroy(&scene));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscErrorCode ierr = PetscInitialize(&argc, &argv, NULL, NULL);

  if (!ierr) ierr = Calibrate(argc, argv);
  if (ierr) return 1;
  return PetscFinalize();
}
