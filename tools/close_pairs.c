/*
  Measures two equal spheres close to each other: resistance to prescribed motions, and motion under prescribed forces and in shear. One line per
  radius, gap and place; tools/close_pairs compares it with exact values (docs/close_pairs.md).

    dlmfd_close_pairs -radii 3.2 -gaps 1,0.1 -places 2     any other key -pairing_..., -lubrication_..., -saddle_... goes to the scene

  The box is 2 x 2 x 2, periodic in x1 and x2, walls at x3 shear the fluid at rate 1 in the last case. Values are those of tools/two_spheres.
*/
#include <dlmsaddle.h>

/* Prescribed: velocity along or across, rotation the same or opposite (all held); then force along, across (free), and shear. */
typedef enum { SQUEEZE, SLIDE, SAME, COUNTER, PULL, PUSH, SHEAR, CASES } Case;

typedef struct {
  DLMScene  *scene;
  DLMGrid    grid;
  DLMStokes  still, sheared;
  DLMSpheres spheres;
  PetscReal  e[3], t[3], b[3]; /* from sphere 0 to 1, across, e x t */
} Setup;

static PetscReal Dot(const PetscReal x[3], const PetscReal y[3])
{
  return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
}

/* Centres about a place in the 2h cell, and a direction, both by number. */
static void Place(Setup *s, PetscInt p, PetscReal gap)
{
  static const PetscReal directions[][3] = { { 0.80, 0.20, 0.57 }, { 0.62, -0.48, -0.62 }, { -0.75, 0.05, 0.66 }, { 0.45, 0.55, 0.70 } };
  const PetscReal        golden[3]       = { 0.8191725133961645, 0.6710436067037893, 0.5497004779019703 }, *d = directions[p % 4];
  const PetscReal        length = PetscSqrtReal(Dot(d, d)), half = s->scene->spheres[0].radius + 0.5 * gap;
  PetscReal              across;

  for (int c = 0; c < 3; c++) s->e[c] = d[c] / length;
  across  = PetscSqrtReal(PetscSqr(s->e[0]) + PetscSqr(s->e[1]));
  s->t[0] = -s->e[1] / across;
  s->t[1] = s->e[0] / across;
  s->t[2] = 0.0;
  for (int c = 0; c < 3; c++) s->b[c] = s->e[(c + 1) % 3] * s->t[(c + 2) % 3] - s->e[(c + 2) % 3] * s->t[(c + 1) % 3];
  for (int c = 0; c < 3; c++) {
    const PetscReal middle       = 2.0 * s->scene->h * ((p + 1) * golden[c] - PetscFloorReal((p + 1) * golden[c]));
    s->scene->spheres[0].center[c] = middle - half * s->e[c];
    s->scene->spheres[1].center[c] = middle + half * s->e[c];
  }
}

/* Motions, forces and kind of motion of a case. Forces move the spheres at a speed of about 1. */
static void Prescribe(Setup *s, Case which)
{
  const PetscReal a = s->scene->spheres[0].radius, push = 6.0 * PETSC_PI * s->scene->fluid_viscosity * a;

  for (int i = 0; i < 2; i++) {
    DLMSphereSpec  *spec = &s->scene->spheres[i];
    const PetscReal sign = i ? -1.0 : 1.0;
    spec->motion         = which < PULL ? DLM_MOTION_FIXED : DLM_MOTION_FREE;
    for (int c = 0; c < 3; c++) {
      spec->velocity[c] = which == SQUEEZE ? sign * s->e[c] : (which == SLIDE ? sign * s->t[c] : 0.0);
      spec->omega[c]    = which == SAME ? s->b[c] / a : (which == COUNTER ? sign * s->b[c] / a : 0.0);
      spec->force[c]    = which == PULL ? sign * push * s->e[c] : (which == PUSH ? sign * push * s->t[c] : 0.0);
    }
  }
}

/* A and B of Batchelor and Green from the relative velocity in the shear u1 = x3. */
static void ShearFunctions(const Setup *s, const DLMSphereState *state, PetscReal *A, PetscReal *B)
{
  PetscReal r[3], v[3], strained[3], along, across = 0.0, square = 0.0;

  for (int c = 0; c < 3; c++) {
    r[c] = s->scene->spheres[1].center[c] - s->scene->spheres[0].center[c];
    v[c] = state[1].velocity[c] - state[0].velocity[c];
  }
  strained[0] = 0.5 * r[2];
  strained[1] = 0.0;
  strained[2] = 0.5 * r[0];
  v[0] -= 0.5 * r[2]; /* rotation of the fluid */
  v[2] += 0.5 * r[0];
  along = Dot(strained, s->e);
  *A    = 1.0 - Dot(v, s->e) / along;
  for (int c = 0; c < 3; c++) {
    const PetscReal x = strained[c] - along * s->e[c];
    across += x * v[c];
    square += x * x;
  }
  *B = 1.0 - across / square;
}

/* Solves a case and writes its values, dimensionless. */
static PetscErrorCode Measure(Setup *s, Case which, PetscReal value[2], PetscInt *iterations)
{
  const PetscReal a = s->scene->spheres[0].radius, mu = s->scene->fluid_viscosity, *force[2];
  PetscReal       loads[6];
  DLMPairing      pairing;
  DLMSaddle       saddle;
  DLMSaddleWork   work;
  DLMSphereState *state;

  PetscFunctionBeginUser;
  Prescribe(s, which);
  PetscCall(DLMSpheresCreate(s->grid, s->scene, &s->spheres));
  PetscCall(DLMPairingCreate(s->spheres, s->scene, &pairing));
  PetscCall(DLMSaddleCreate(which == SHEAR ? s->sheared : s->still, s->spheres, pairing, s->scene, &saddle));
  for (int i = 0; i < 6; i++) loads[i] = s->scene->spheres[i / 3].force[i % 3];
  PetscCall(DLMSaddleSolve(saddle, (DLMInertia){ 0.0, 0.0, 0.0 }, loads, NULL, NULL));
  PetscCall(DLMSpheresGetStates(s->spheres, NULL, &state));
  PetscCall(DLMSaddleGetWork(saddle, &work));
  *iterations = PetscMax(*iterations, work.last_iterations);
  value[1]    = 0.0;
  force[0]    = state[0].force;
  force[1]    = state[1].force;
  switch (which) {
  case SQUEEZE: value[0] = 0.5 * (Dot(force[1], s->e) - Dot(force[0], s->e)) / (6.0 * PETSC_PI * mu * a); break;
  case SLIDE:
    value[0] = 0.5 * (Dot(force[1], s->t) - Dot(force[0], s->t)) / (6.0 * PETSC_PI * mu * a);
    value[1] = -0.5 * (Dot(state[0].torque, s->b) + Dot(state[1].torque, s->b)) / (4.0 * PETSC_PI * mu * a * a);
    break;
  case SAME: value[0] = -0.5 * (Dot(state[0].torque, s->b) + Dot(state[1].torque, s->b)) / (8.0 * PETSC_PI * mu * a * a); break;
  case COUNTER: value[0] = -0.5 * (Dot(state[0].torque, s->b) - Dot(state[1].torque, s->b)) / (8.0 * PETSC_PI * mu * a * a); break;
  case PULL: value[0] = 0.5 * (Dot(state[0].velocity, s->e) - Dot(state[1].velocity, s->e)); break;
  case PUSH: value[0] = 0.5 * (Dot(state[0].velocity, s->t) - Dot(state[1].velocity, s->t)); break;
  default: ShearFunctions(s, state, &value[0], &value[1]);
  }
  PetscCall(DLMSaddleDestroy(&saddle));
  PetscCall(DLMPairingDestroy(&pairing));
  PetscCall(DLMSpheresDestroy(&s->spheres));
  PetscFunctionReturn(0);
}

static PetscErrorCode Line(Setup *s, PetscReal r, PetscReal gap, PetscInt place)
{
  PetscInt iterations = 0;

  PetscFunctionBeginUser;
  Place(s, place, gap * s->scene->spheres[0].radius);
  PetscCall(PetscPrintf(s->scene->comm, "%.4g,%.4g,%" PetscInt_FMT, (double)r, (double)gap, place));
  for (Case c = SQUEEZE; c < CASES; c++) {
    PetscReal value[2];
    PetscCall(Measure(s, c, value, &iterations));
    PetscCall(PetscPrintf(s->scene->comm, ",%.6g", (double)value[0]));
    if (c == SLIDE || c == SHEAR) PetscCall(PetscPrintf(s->scene->comm, ",%.6g", (double)value[1]));
  }
  PetscCall(PetscPrintf(s->scene->comm, ",%" PetscInt_FMT "\n", iterations));
  PetscFunctionReturn(0);
}

/* One mesh, without and with moving walls. */
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
  PetscCall(DLMStokesCreate(s->grid, s->scene, &s->still));
  s->scene->wall_velocity[2][0][0] = -1.0;
  s->scene->wall_velocity[2][1][0] = 1.0;
  PetscCall(DLMStokesCreate(s->grid, s->scene, &s->sheared));
  PetscFunctionReturn(0);
}

static PetscErrorCode SetupDestroy(Setup *s)
{
  PetscFunctionBeginUser;
  PetscCall(DLMStokesDestroy(&s->still));
  PetscCall(DLMStokesDestroy(&s->sheared));
  PetscCall(DLMGridDestroy(&s->grid));
  PetscCall(DLMSceneDestroy(&s->scene));
  PetscFunctionReturn(0);
}

static PetscErrorCode TakeList(const char *name, PetscInt *n, PetscReal *list, PetscInt preset)
{
  PetscBool set;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetRealArray(NULL, NULL, name, list, n, &set));
  if (!set) *n = preset;
  PetscCall(PetscOptionsClearValue(NULL, name));
  PetscFunctionReturn(0);
}

static PetscErrorCode MeasureAll(void)
{
  const char *fixed[][2] = { { "-box_size", "2,2,2" }, { "-sphere_centers", "0,0,0,0.9,0.9,0" }, { "-sphere_inertia", "0" } };
  PetscReal   radii[16] = { 2.4, 3.2, 4.8 }, gaps[32] = { 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01 }, resolution = 32.0;
  PetscInt    n_radii = 16, n_gaps = 32, places = 4;
  Setup       s = { 0 };

  PetscFunctionBeginUser;
  PetscCall(TakeList("-radii", &n_radii, radii, 3));
  PetscCall(TakeList("-gaps", &n_gaps, gaps, 8));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-places", &places, NULL));
  PetscCall(PetscOptionsClearValue(NULL, "-places"));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-grid_resolution", &resolution, NULL));
  for (size_t i = 0; i < PETSC_STATIC_ARRAY_LENGTH(fixed); i++) PetscCall(PetscOptionsSetValue(NULL, fixed[i][0], fixed[i][1]));
  PetscCall(SetupCreate(resolution, &s));
  PetscCall(PetscPrintf(s.scene->comm, "a_over_h,gap,place,XA,YA,YB,YC_same,YC_counter,mobility_along,mobility_across,A,B,iterations\n"));
  for (PetscInt i = 0; i < n_radii; i++)
    for (PetscInt g = 0; g < n_gaps; g++)
      for (PetscInt p = 0; p < places; p++) {
        for (int k = 0; k < 2; k++) s.scene->spheres[k].radius = radii[i] * s.scene->h;
        PetscCall(Line(&s, radii[i], gaps[g], p));
      }
  PetscCall(SetupDestroy(&s));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  if (DLMInitialize(argc, argv, NULL) || MeasureAll()) return 1;
  return PetscFinalize();
}
