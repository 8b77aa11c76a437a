/* The flow fitted about spheres: a flow of its modes is found again, with its gradient at the surface, beside other bodies and on any number of ranks. */
#include "polymertest.h"

enum { N = DLM_LAMB_MODES };
static const PetscInt  cells[3] = { 24, 28, 26 }; /* of 1/8: a box of 3 x 3.5 x 3.25 */
static const PetscReal radius   = 0.6;            /* 4.8 h */

typedef struct {
  DLMScene *scene;
  PetscReal velocity[3], omega[3], mode[N];
  PetscBool disturbed; /* the second sphere's surroundings move at random */
} Flow;

/* From the centre of sphere s, in the nearest image. */
static double Offset(const DLMScene *scene, int s, const double at[3], double x[3])
{
  double square = 0.0;

  for (int d = 0; d < 3; d++) {
    x[d] = at[d] - scene->spheres[s].center[d];
    if (scene->box_periodic[d]) x[d] -= scene->box_size[d] * floor(0.5 + x[d] / scene->box_size[d]);
    square += x[d] * x[d];
  }
  return sqrt(square);
}

/* The rigid motion inside the first sphere, and outside Stokes's flow past it, cut off far away so that it may be periodic. */
static double Exact(const double at[3], int i, const Flow *flow)
{
  double x[3], r = Offset(flow->scene, 0, at, x), v, u[N][3];

  v = flow->velocity[i] + flow->omega[(i + 1) % 3] * x[(i + 2) % 3] - flow->omega[(i + 2) % 3] * x[(i + 1) % 3];
  if (r <= radius || r > radius + 4.5 * flow->scene->h) return v;
  for (int d = 0; d < 3; d++) x[d] /= radius;
  DLMLambModes(x, u, NULL);
  for (int k = 0; k < N; k++) v += flow->mode[k] * u[k][i];
  return v;
}

/* Of the mesh: that, but noise within a mesh width of the surface, which is not fitted, and about the second sphere. */
static double Velocity(const double at[3], int i, const void *context)
{
  const Flow *flow = context;
  double      x[3];

  if (fabs(Offset(flow->scene, 0, at, x) - radius) < flow->scene->h || (flow->disturbed && Offset(flow->scene, 1, at, x) < radius + 1.2 * flow->scene->h))
    return Hash(7, (uint64_t)(1e6 * (at[0] + 2.0 * at[1] + 3.0 * at[2] + 20.0 + i)));
  return Exact(at, i, flow);
}

static void OpenFlow(MPI_Comm comm, unsigned periodic, const PetscInt *processes, int n_spheres, PolymerCase *c, Flow *flow)
{
  DLMSphereState *state;
  PetscInt        n;

  MakePolymerScene(comm, cells, periodic, c);
  for (int d = 0; d < 3 && processes; d++) c->scene.grid_processes[d] = processes[d];
  c->scene.polymer_inside = DLM_INSIDE_STOKES;
  c->scene.n_spheres      = n_spheres;
  c->scene.polymer_stress_offset = DLM_AUTO;
  for (int s = 0; s < n_spheres; s++) c->spec[s] = (DLMSphereSpec){ .radius = radius, .density = 1.0, .center = { 0.013, 0.021 + s * (2.0 * radius + 0.1), -0.017 } };
  for (int d = 0; d < 3 && n_spheres == 1; d++)
    if (c->scene.box_periodic[d]) c->spec[0].center[d] += -0.5 * c->scene.box_size[d] + 0.3; /* across the face */
  OpenPolymer(c);
  assert_true(c->polymer->stress_offset == 0.1);
  memset(flow, 0, sizeof(*flow));
  flow->scene = &c->scene;
  for (int d = 0; d < 3; d++) {
    flow->velocity[d] = Hash(1, d);
    flow->omega[d]    = Hash(2, d);
  }
  for (int k = 0; k < N; k++) flow->mode[k] = Hash(3, k);
  Call(DLMSpheresGetStates(c->spheres, &n, &state));
  for (int d = 0; d < 3; d++) {
    state[0].velocity[d] = flow->velocity[d];
    state[0].omega[d]    = flow->omega[d];
  }
}

/*
  Root mean square error over that of the value, of the gradient at the owned nodes less than a mesh width outside the surface or one and a half inside, where the gradient
  is that of the surface above.
*/
static double GradientError(PolymerCase *c, const Flow *flow)
{
  double sum[2] = { 0.0 };

  for (PetscInt own = 0; own < c->polymer->block.n; own++) {
    PetscInt node[3];
    double   at[3], x[3], r, u[N][3], g[N][9];
    DLMPolymerNode(c->polymer, own, node);
    for (int d = 0; d < 3; d++) at[d] = c->grid->lower[d] + c->grid->h * node[d];
    r = Offset(&c->scene, 0, at, x);
    if (r < radius - 1.5 * c->grid->h || r > radius + c->grid->h) continue;
    for (int d = 0; d < 3; d++) x[d] /= fmin(r, radius);
    DLMLambModes(x, u, g);
    for (int j = 0; j < 9; j++) {
      const double turn = j % 4 == 0 ? 0.0 : (((j % 3 - j / 3 + 3) % 3) == 1 ? -1.0 : 1.0) * flow->omega[3 - j / 3 - j % 3];
      double       G    = turn;
      for (int k = 0; k < N; k++) G += flow->mode[k] * g[k][j] / radius;
      sum[0] += pow(c->polymer->g[j][own] - G, 2);
      sum[1] += G * G;
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sum, 2, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  return sqrt(sum[0] / sum[1]);
}

/* Largest error of the velocity that carries C at the nodes of the rank, ghost nodes too, in the same layer. */
static double VelocityError(PolymerCase *c, const Flow *flow)
{
  const DLMPolymerBlock *b = &c->polymer->block;
  double                 worst = 0.0;

  for (PetscInt q = 0; q < b->n_ghosted; q++) {
    const PetscInt i[3] = { q % b->ghost_width[0], q / b->ghost_width[0] % b->ghost_width[1], q / b->ghost_width[0] / b->ghost_width[1] };
    double         at[3], x[3], r;
    for (int d = 0; d < 3; d++) at[d] = c->grid->lower[d] + c->grid->h * (b->ghost_start[d] + i[d]);
    r = Offset(&c->scene, 0, at, x);
    for (int k = 0; k < 3 && r > radius - 1.5 * c->grid->h && r < radius + c->grid->h; k++) worst = fmax(worst, fabs(c->polymer->u[k][q] - Exact(at, k, flow)));
  }
  return worst;
}

static double ModeError(PolymerCase *c, const Flow *flow)
{
  double worst = 0.0;

  for (int k = 0; k < N; k++) worst = fmax(worst, fabs(c->polymer->near_flow[c->polymer->buffer][0].mode[k] - flow->mode[k]));
  return worst;
}

static void AFlowOfTheModesIsFoundAgain(void **state)
{
  PetscInt processes[3];

  for (unsigned periodic = 0; periodic < 8; periodic++)
    for (int k = 0; Layout(k, processes); k++) {
      PolymerCase c;
      Flow        flow;
      Vec         u;
      OpenFlow(PETSC_COMM_WORLD, periodic, processes, 1, &c, &flow);
      u = NewPointField(&c, c.grid->velocity, Velocity, &flow);
      Call(DLMPolymerTakeVelocity(c.polymer, 0.0, u));
      if (k == 0) assert_true(GradientError(&c, &flow) > 0.2); /* of the mesh alone */
      Call(DLMPolymerSetVelocity(c.polymer, 0.0, u));
      AssertAtMost(ModeError(&c, &flow), 5e-3); /* what the ridge takes */
      AssertAtMost(GradientError(&c, &flow), 2e-3);
      AssertAtMost(VelocityError(&c, &flow), 2e-3);
      Call(VecDestroy(&u));
      ClosePolymer(&c);
    }
}

/* Nodes within 1.25 h of another sphere are not fitted. */
static void AnotherSphereIsKeptOut(void **state)
{
  PetscInt processes[3];

  for (int k = 0; Layout(k, processes); k++) {
    PolymerCase c;
    Flow        flow;
    Vec         u;
    OpenFlow(PETSC_COMM_WORLD, 3, processes, 2, &c, &flow);
    flow.disturbed = PETSC_TRUE;
    u              = NewPointField(&c, c.grid->velocity, Velocity, &flow);
    Call(DLMPolymerSetVelocity(c.polymer, 0.0, u));
    AssertAtMost(ModeError(&c, &flow), 0.05);
    Call(VecDestroy(&u));
    ClosePolymer(&c);
  }
}

/* C along the normal is 1 inside after the rule, C stays positive definite, and outside nothing changes. */
static void InsideNothingIsStretchedAlongTheNormal(void **state)
{
  PolymerCase      c;
  Flow             flow;
  Vec              before, after;
  DLMPolymerHealth health;
  PetscInt         n, inside = 0;
  double          *x, *y, wrong = 0.0;

  OpenFlow(PETSC_COMM_WORLD, 3, NULL, 1, &c, &flow);
  SetRandomConformation(&c, 3);
  before = NewConformation(&c);
  Call(DLMPolymerSetInside(c.polymer));
  after = NewConformation(&c);
  Call(DLMPolymerGetHealth(c.polymer, &health));
  AssertAll(health.sound && health.smallest_eigenvalue > 0.001);
  GatherNatural(c.six, before, &n, &x);
  GatherNatural(c.six, after, &n, &y);
  for (PetscInt i = 0; i < n / 6; i++) {
    const PetscInt *nodes = c.grid->nodes;
    const double    at[3] = { c.grid->lower[0] + c.grid->h * (i % nodes[0]), c.grid->lower[1] + c.grid->h * ((i / nodes[0]) % nodes[1]), c.grid->lower[2] + c.grid->h * (i / (nodes[0] * nodes[1])) };
    double          r[3], distance = Offset(&c.scene, 0, at, r), *C = y + 6 * i, nn;
    nn = (C[0] * r[0] * r[0] + C[1] * r[1] * r[1] + C[2] * r[2] * r[2] + 2.0 * (C[3] * r[0] * r[1] + C[4] * r[0] * r[2] + C[5] * r[1] * r[2])) / (distance * distance);
    inside += distance < radius;
    for (int k = 0; k < 6 && distance >= radius + 0.05 * c.grid->h; k++) wrong = fmax(wrong, fabs(C[k] - x[6 * i + k]));
    if (distance < radius - 0.05 * c.grid->h) wrong = fmax(wrong, fabs(nn - 1.0)); /* a ramp of 0.1 h about the surface */
  }
  assert_true(inside > 400);
  AssertAtMost(wrong, 1e-12);
  Call(PetscFree(x));
  Call(PetscFree(y));
  Call(VecDestroy(&before));
  Call(VecDestroy(&after));
  ClosePolymer(&c);
}

/* A node at the centre of a sphere so small that the fitted flow reaches there has no normal. */
static void ANodeAtTheCentreIsNoTrouble(void **state)
{
  PolymerCase c;
  Flow        flow;
  Vec         u;
  double      sum = 0.0;

  MakePolymerScene(PETSC_COMM_WORLD, cells, 3, &c);
  c.scene.polymer_inside = DLM_INSIDE_STOKES;
  c.scene.n_spheres      = 1;
  c.spec[0]              = (DLMSphereSpec){ .radius = 2.0 * c.scene.h, .density = 1.0 };
  OpenPolymer(&c);
  flow = (Flow){ .scene = &c.scene, .omega = { 0.3, 0.2, 0.1 } };
  u    = NewPointField(&c, c.grid->velocity, Velocity, &flow);
  Call(DLMPolymerSetInside(c.polymer));
  Call(DLMPolymerSetVelocity(c.polymer, 0.0, u));
  for (int j = 0; j < 9; j++)
    for (PetscInt x = 0; x < c.polymer->block.n; x++) sum += fabs(c.polymer->g[j][x]);
  AssertAll(isfinite(sum) && sum > 0.0);
  Call(VecDestroy(&u));
  ClosePolymer(&c);
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(AFlowOfTheModesIsFoundAgain),
  cmocka_unit_test(AnotherSphereIsKeptOut),
  cmocka_unit_test(InsideNothingIsStretchedAlongTheNormal),
  cmocka_unit_test(ANodeAtTheCentreIsNoTrouble),
};

RUN_ON_ALL_RANKS(tests)
