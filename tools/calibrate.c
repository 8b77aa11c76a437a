/*
  Measures the hydrodynamic radius of covered spheres: drag, torque and stresslet against the exact values, over positions of the centre in the
  mesh (docs/calibration.md).

    dlmfd_calibrate > docs/calibration.csv                       the table, about a quarter of an hour on one core
    dlmfd_calibrate -radii 3,4.8 -positions 4 -pairing_degree 3  another cover: any key -pairing_... takes the table's place
    dlmfd_calibrate -fit                                         the rows of src/spheres/cover.c, ten minutes; with -radii, only theirs;
                                                                 -pairing_compliance, -pairing_degree in place of the table's

  The box is 2 x 2 x 2, periodic in x1 and x2. A force along x2, a torque about x3 and a shear in the x1-x3 plane act at once; by symmetry
  they do not disturb each other, but the mesh is less symmetric, so none may be much stronger than the others.
*/
#include <dlmsaddle.h>

/*
  Walls and periodic images: V = F/(6 pi mu) (1/a + 0.1102 - 0.19 a^2), omega = T/(8 pi mu) (1/a^3 - 0.606), S = (10/3) pi mu a^3 (1 + 0.9 a^3).
  The first meets the exact 1.010834 at a = 0.1; the other coefficients are fits to one cover on five meshes.
*/
static PetscReal DragImages(PetscReal a)
{
  return 0.1102 - 0.19 * a * a;
}
static const PetscReal torque_images = -0.606, stresslet_images = 0.9;

enum { DRAG, TORQUE, STRESSLET, MOMENTS };

/* A cover, the largest a/h it is measured at, and over how many positions. */
typedef struct {
  DLMPairingType type;
  DLMPointSet    points;
  PetscReal      spacing, degree, compliance, retraction, least, most;
  PetscInt       positions;
} Plan;

#define COLLOCATION DLM_PAIRING_COLLOCATION
#define IMMERSED    DLM_PAIRING_IMMERSED
#define VOLUME      DLM_POINTS_VOLUME
#define SURFACE     DLM_POINTS_SURFACE

static const Plan table[] = {
  { IMMERSED, SURFACE, DLM_AUTO, DLM_AUTO, DLM_AUTO, DLM_AUTO, 2, 8, 12 }, /* what a scene gets */
  { IMMERSED, SURFACE, DLM_AUTO, 1, 0, 0, 2, 6, 6 },                       /* harmonics of degree 1 alone */
  { IMMERSED, SURFACE, DLM_AUTO, 4, 0, 0, 3, 6, 6 },                       /* rigid harmonics */
  /* a multiplier at every point, thesis's retraction; beyond a/h = 4 volume points take hundreds of iterations at 1 h */
  { IMMERSED, SURFACE, 1.0, 0, 0, 0, 2, 8, 12 },
  { IMMERSED, SURFACE, 1.5, 0, 0, 0, 2, 8, 12 },
  { IMMERSED, SURFACE, 2.0, 0, 0, 0, 2, 8, 12 },
  { IMMERSED, VOLUME, 1.0, 0, 0, 0, 2, 4, 12 },
  { IMMERSED, VOLUME, 1.5, 0, 0, 0, 2, 4, 12 },
  { IMMERSED, VOLUME, 1.5, 0, 0, 0, 5, 8, 4 },
  { IMMERSED, VOLUME, 2.0, 0, 0, 0, 2, 4, 12 },
  { IMMERSED, VOLUME, 2.0, 0, 0, 0, 5, 8, 4 },
  { COLLOCATION, SURFACE, 1.0, 0, 0, 0, 2, 8, 12 },
  { COLLOCATION, SURFACE, 1.5, 0, 0, 0, 2, 8, 12 },
  { COLLOCATION, SURFACE, 2.0, 0, 0, 0, 2, 8, 12 },
  { COLLOCATION, VOLUME, 1.0, 0, 0, 0, 2, 4, 12 },
  { COLLOCATION, VOLUME, 1.5, 0, 0, 0, 2, 4, 12 },
  { COLLOCATION, VOLUME, 1.5, 0, 0, 0, 5, 8, 4 },
  { COLLOCATION, VOLUME, 2.0, 0, 0, 0, 2, 4, 12 },
  { COLLOCATION, VOLUME, 2.0, 0, 0, 0, 5, 8, 4 },
};

/* One scene on one mesh; its Stokes solver serves all covers. */
typedef struct {
  DLMScene *scene;
  DLMGrid   grid;
  DLMStokes stokes;
} Setup;

/* Where a sphere stays in x2 = 0, force and torque act in that mirror, as the shear does: each is solved for alone. */
static PetscBool InMirror(const Setup *s)
{
  return (PetscBool)(s->scene->box_mirror == DLM_MIRROR_HALF);
}

/* Effective radii from drag, torque and stresslet of one sphere, in h. */
static PetscErrorCode Measure(Setup *s, PetscReal radius[MOMENTS], PetscInt *iterations)
{
  DLMSphereSpec  *spec = &s->scene->spheres[0];
  const int       f = InMirror(s) ? 0 : 1, t = f + 1; /* axes of force and torque */
  const DLMInertia inertia = { 0.0, 0.0, 0.0 };
  const PetscReal mu = s->scene->fluid_viscosity, a = spec->radius, none[3] = { 0.0, 0.0, 0.0 };
  PetscReal       velocity, omega;
  DLMSpheres      spheres;
  DLMPairing      pairing;
  DLMSaddle       saddle;
  DLMSaddleWork   work;
  DLMSphereState *state;

  PetscFunctionBeginUser;
  PetscCall(DLMSpheresCreate(s->grid, s->scene, &spheres));
  PetscCall(DLMPairingCreate(spheres, s->scene, &pairing));
  PetscCall(DLMSaddleCreate(s->stokes, spheres, pairing, s->scene, &saddle));
  PetscCall(DLMSpheresGetStates(spheres, NULL, &state));
  PetscCall(DLMSaddleSolve(saddle, inertia, InMirror(s) ? none : spec->force, InMirror(s) ? none : spec->torque, NULL));
  velocity = state->velocity[f];
  omega    = state->omega[t];
  if (InMirror(s)) {
    PetscCall(DLMSaddleSolve(saddle, inertia, spec->force, none, NULL));
    velocity = state->velocity[f] - velocity;
    PetscCall(DLMSaddleSolve(saddle, inertia, none, spec->torque, NULL));
    omega = state->omega[t] - omega;
    PetscCall(DLMSaddleSolve(saddle, inertia, none, none, NULL));
  }
  PetscCall(DLMSaddleGetWork(saddle, &work));
  *iterations       = work.last_iterations;
  radius[DRAG]      = 1.0 / (6.0 * PETSC_PI * mu * velocity / spec->force[f] - DragImages(a));
  radius[TORQUE]    = PetscPowReal(8.0 * PETSC_PI * mu * omega / spec->torque[t] - torque_images, -1.0 / 3.0);
  radius[STRESSLET] = PetscPowReal(PetscAbsReal(state->stresslet[4]) / (10.0 / 3.0 * PETSC_PI * mu * (1.0 + stresslet_images * a * a * a)), 1.0 / 3.0);
  for (int k = 0; k < MOMENTS; k++) radius[k] /= s->scene->h;
  PetscCall(DLMSaddleDestroy(&saddle));
  PetscCall(DLMPairingDestroy(&pairing));
  PetscCall(DLMSpheresDestroy(&spheres));
  PetscFunctionReturn(0);
}

/* A number, or "auto". */
static PetscErrorCode PrintChoice(MPI_Comm comm, PetscReal value)
{
  PetscFunctionBeginUser;
  if (value < 0.0) PetscCall(PetscPrintf(comm, ",auto"));
  else PetscCall(PetscPrintf(comm, ",%.4g", (double)value));
  PetscFunctionReturn(0);
}

/* Force and torque that move the surface as fast as the shear (of rate 1) moves the fluid there. */
static void LoadLikeShear(PetscReal mu, int axis, DLMSphereSpec *spec)
{
  const PetscReal a = spec->radius;

  spec->force[axis]      = 6.0 * PETSC_PI * mu * a * a;
  spec->torque[axis + 1] = 8.0 * PETSC_PI * mu * a * a * a;
}

static void SetCover(DLMScene *scene, const Plan *plan)
{
  scene->pairing_type       = plan->type;
  scene->pairing_points     = plan->points;
  scene->pairing_spacing    = plan->spacing;
  scene->pairing_degree     = plan->degree;
  scene->pairing_compliance = plan->compliance;
  scene->pairing_retraction = plan->retraction;
}

/* What the positions of the centre in the mesh make of the radius. */
typedef struct {
  PetscReal mean[MOMENTS], least[MOMENTS], most[MOMENTS], iterations;
} Spread;

/* Measures at one radius (in h) over positions in the 2h cell. */
static PetscErrorCode Sweep(Setup *s, PetscReal r, PetscInt positions, Spread *spread)
{
  const PetscReal golden[3] = { 0.8191725133961645, 0.6710436067037893, 0.5497004779019703 };
  DLMScene       *scene     = s->scene;

  PetscFunctionBeginUser;
  *spread                  = (Spread){ .iterations = 0.0 };
  scene->spheres[0].radius = r * scene->h;
  LoadLikeShear(scene->fluid_viscosity, InMirror(s) ? 0 : 1, &scene->spheres[0]);
  for (PetscInt p = 0; p < positions; p++) {
    PetscReal radius[MOMENTS];
    PetscInt  its;
    for (int d = 0; d < 3; d++) scene->spheres[0].center[d] = 2.0 * scene->h * ((p + 1) * golden[d] - PetscFloorReal((p + 1) * golden[d]));
    if (InMirror(s)) scene->spheres[0].center[1] = 0.0;
    PetscCall(Measure(s, radius, &its));
    spread->iterations += (PetscReal)its / positions;
    for (int k = 0; k < MOMENTS; k++) {
      spread->mean[k] += radius[k] / positions;
      spread->least[k] = p ? PetscMin(spread->least[k], radius[k]) : radius[k];
      spread->most[k]  = p ? PetscMax(spread->most[k], radius[k]) : radius[k];
    }
  }
  PetscFunctionReturn(0);
}

/*
  A row of src/spheres/cover.c: the compliance of the higher harmonics is chosen (docs/calibration.md); retraction, then the compliances of torque and
  stresslet take away what is too large. A slip of kappa per traction shortens the radius by kappa (torque) and 5/3 kappa (stresslet), times the fourth
  power of the ratio of the sphere's radius to that of its points.
*/
static PetscErrorCode Fit(Setup *s, PetscReal r, PetscReal compliance, PetscReal degree, PetscInt positions)
{
  DLMScene *scene = s->scene;
  DLMCover  cover;
  Spread    spread;

  PetscFunctionBeginUser;
  SetCover(scene, &table[0]);
  PetscCall(DLMPairingGetCover(scene, r * scene->h, &cover));
  scene->pairing_degree            = degree > 0.0 ? degree : cover.degree;
  scene->pairing_compliance        = compliance;
  scene->pairing_retraction        = 0.5;
  scene->pairing_spin_compliance   = 0.0;
  scene->pairing_strain_compliance = 0.0;
  for (int pass = 0; pass < 6; pass++) {
    PetscCall(Sweep(s, r, positions, &spread));
    const PetscReal per_slip = PetscPowReal(1.0 - scene->pairing_retraction / r, 4.0);
    scene->pairing_retraction += spread.mean[DRAG] - r;
    scene->pairing_spin_compliance += per_slip * (spread.mean[TORQUE] - r);
    scene->pairing_strain_compliance += 0.6 * per_slip * (spread.mean[STRESSLET] - r);
  }
  PetscCall(PetscPrintf(scene->comm, "  { %.3g, %.3f, %.4f, %.4f, %.4f },", (double)r, (double)compliance, (double)scene->pairing_retraction,
                        (double)scene->pairing_spin_compliance, (double)scene->pairing_strain_compliance));
  PetscCall(PetscPrintf(scene->comm, " /* left: %.1e %.1e %.1e h */\n", (double)(spread.mean[DRAG] - r), (double)(spread.mean[TORQUE] - r), (double)(spread.mean[STRESSLET] - r)));
  PetscFunctionReturn(0);
}

/* Measures at one radius (in h) and prints a line: means over the positions, and largest minus smallest. */
static PetscErrorCode Line(Setup *s, PetscReal r, PetscInt positions)
{
  const PetscReal power[MOMENTS] = { 1.0, 3.0, 3.0 };
  DLMScene       *scene = s->scene;
  Spread          spread;
  DLMCover        cover;

  PetscFunctionBeginUser;
  PetscCall(Sweep(s, r, positions, &spread));
  PetscCall(DLMPairingGetCover(scene, scene->spheres[0].radius, &cover));
  PetscCall(PetscPrintf(scene->comm, "%s,%s,%.3g,%" PetscInt_FMT, DLMPairingTypes[scene->pairing_type], DLMPointSets[scene->pairing_points], (double)cover.spacing, cover.degree));
  PetscCall(PrintChoice(scene->comm, cover.degree > 1 ? scene->pairing_compliance : 0.0));
  PetscCall(PetscPrintf(scene->comm, ",%.3f,%.4g,%.4g,%" PetscInt_FMT, (double)cover.retraction, (double)r, (double)scene->grid_resolution, positions));
  for (int k = 0; k < MOMENTS; k++) PetscCall(PetscPrintf(scene->comm, ",%.3f", (double)(spread.mean[k] - r)));
  for (int k = 0; k < MOMENTS; k++) PetscCall(PetscPrintf(scene->comm, ",%.2f", (double)(100.0 * (PetscPowReal(spread.mean[k] / r, power[k]) - 1.0))));
  for (int k = 0; k < MOMENTS; k++) PetscCall(PetscPrintf(scene->comm, ",%.2f", (double)(100.0 * power[k] * (spread.most[k] - spread.least[k]) / spread.mean[k])));
  PetscCall(PetscPrintf(scene->comm, ",%.1f\n", (double)spread.iterations));
  PetscFunctionReturn(0);
}

static PetscErrorCode SetupCreate(PetscReal resolution, Setup *s)
{
  char      text[32];
  PetscBool given;

  PetscFunctionBeginUser;
  PetscCall(PetscSNPrintf(text, sizeof(text), "%g", (double)resolution));
  PetscCall(PetscOptionsSetValue(NULL, "-grid_resolution", text));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-box_mirror", &given));
  if (!given) PetscCall(PetscOptionsSetValue(NULL, "-box_mirror", "none")); /* the spheres leave x2 = 0 */
  PetscCall(DLMSceneCreate(PETSC_COMM_WORLD, &s->scene));
  PetscCall(DLMGridCreate(s->scene, &s->grid));
  PetscCall(DLMStokesCreate(s->grid, s->scene, &s->stokes));
  PetscFunctionReturn(0);
}

static PetscErrorCode SetupDestroy(Setup *s)
{
  PetscFunctionBeginUser;
  PetscCall(DLMStokesDestroy(&s->stokes));
  PetscCall(DLMGridDestroy(&s->grid));
  PetscCall(DLMSceneDestroy(&s->scene));
  PetscFunctionReturn(0);
}

/* Makes the scene and its solver anew where the mesh is another. */
static PetscErrorCode UseMesh(Setup *s, PetscReal resolution)
{
  PetscFunctionBeginUser;
  if (s->scene && s->scene->grid_resolution == resolution) PetscFunctionReturn(0);
  if (s->scene) PetscCall(SetupDestroy(s));
  PetscCall(SetupCreate(resolution, s));
  PetscFunctionReturn(0);
}

/* Mesh for a radius in h: fine enough that the sphere stays small beside the box. */
static PetscReal Resolution(PetscReal r)
{
  return r <= 3.0 ? 24.0 : (r <= 4.0 ? 32.0 : (r <= 8.0 ? 48.0 : 72.0));
}

/* True if the command line names a cover. */
static PetscErrorCode CoverGiven(PetscBool *given)
{
  const char *keys[] = { "-pairing_type",       "-pairing_points",     "-pairing_spacing",         "-pairing_degree",
                         "-pairing_compliance", "-pairing_retraction", "-pairing_spin_compliance", "-pairing_strain_compliance" };

  PetscFunctionBeginUser;
  *given = PETSC_FALSE;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(keys); i++) {
    PetscBool set;
    PetscCall(PetscOptionsHasName(NULL, NULL, keys[i], &set));
    *given = (PetscBool)(*given || set);
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode FixScene(void)
{
  const char *fixed[][2] = { { "-box_size", "2,2,2" }, { "-sphere_centers", "0,0,0" }, { "-sphere_inertia", "0" }, { "-wall_velocity_upper", "1,0,0" },
                             { "-wall_velocity_lower", "-1,0,0" } };
  PetscBool   set;

  PetscFunctionBeginUser;
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(fixed); i++) PetscCall(PetscOptionsSetValue(NULL, fixed[i][0], fixed[i][1]));
  PetscCall(PetscOptionsHasName(NULL, NULL, "-saddle_rtol", &set));
  if (!set) PetscCall(PetscOptionsSetValue(NULL, "-saddle_rtol", "1e-5"));
  PetscFunctionReturn(0);
}

/* The rows of src/spheres/cover.c, or those of the given radii; -pairing_compliance and -pairing_degree take the place of the chosen ones. */
static PetscErrorCode FitTable(Setup *s, PetscInt n_radii, const PetscReal *radii, PetscInt positions)
{
  static const PetscReal chosen[][2] = { { 1.5, 0.1 }, { 1.9, 0.1 }, { 2.2, 0.1 }, { 2.43, 0.1 }, { 2.68, 0.1 }, { 2.9, 0.08 }, { 3.2, 0.05 }, { 3.5, 0.05 },
                                         { 4.1, 0.05 }, { 4.8, 0.05 }, { 5.7, 0.05 }, { 6.75, 0.05 }, { 8.0, 0.05 }, { 12.0, 0.05 } }; /* a/h, compliance */

  PetscReal              compliance, degree = DLM_AUTO;
  PetscBool              given;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-pairing_compliance", &compliance, &given));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-pairing_degree", &degree, NULL));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(chosen); i++) {
    PetscBool wanted = n_radii ? PETSC_FALSE : PETSC_TRUE;

    for (PetscInt k = 0; k < n_radii; k++) wanted = wanted || radii[k] == chosen[i][0];
    if (!wanted) continue;
    PetscCall(UseMesh(s, Resolution(chosen[i][0])));
    PetscCall(Fit(s, chosen[i][0], given ? compliance : chosen[i][1], degree, positions));
  }
  PetscFunctionReturn(0);
}

/* docs/calibration.csv, or the lines of the cover that the command line names. */
static PetscErrorCode MeasureTable(Setup *s, PetscInt n_radii, const PetscReal *radii, PetscReal resolution, PetscInt positions)
{
  PetscBool given;

  PetscFunctionBeginUser;
  PetscCall(CoverGiven(&given));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "pairing,points,spacing,degree,compliance,retraction,a_over_h,resolution,positions,drag_excess,torque_excess,stresslet_excess,"
                                          "drag_error,torque_error,stresslet_error,drag_range,torque_range,stresslet_range,iterations\n"));
  for (PetscInt i = 0; i < n_radii; i++) {
    PetscCall(UseMesh(s, resolution > 0.0 ? resolution : Resolution(radii[i])));
    if (given) PetscCall(Line(s, radii[i], positions ? positions : 12));
    for (size_t k = 0; !given && k < PETSC_STATIC_ARRAY_LENGTH(table); k++) {
      SetCover(s->scene, &table[k]);
      if (radii[i] >= table[k].least && radii[i] <= table[k].most) PetscCall(Line(s, radii[i], positions ? positions : table[k].positions));
    }
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Calibrate(void)
{
  PetscReal radii[16] = { 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0 }, resolution = 0.0;
  PetscInt  n_radii = 16, positions = 0;
  PetscBool set, fit = PETSC_FALSE;
  Setup     s = { 0 };

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, "-radii", radii, &n_radii, &set));
  if (!set) n_radii = 7;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-positions", &positions, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-grid_resolution", &resolution, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-fit", &fit, NULL));
  for (int i = 0; i < 3; i++) PetscCall(PetscOptionsClearValue(NULL, (const char *[]){ "-radii", "-positions", "-fit" }[i]));
  PetscCall(FixScene());
  if (fit) PetscCall(FitTable(&s, set ? n_radii : 0, radii, positions ? positions : 12));
  else PetscCall(MeasureTable(&s, n_radii, radii, resolution, positions));
  PetscCall(SetupDestroy(&s));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  if (DLMInitialize(argc, argv, NULL) || Calibrate()) return 1;
  return PetscFinalize();
}
