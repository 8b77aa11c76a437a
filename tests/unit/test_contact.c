/* The short-range repulsion (spec 6) against its formula. */
#include "dlmtest.h"
#include "dlmcontact.h"

static const PetscInt cells[3] = { 16, 16, 16 }; /* h = 0.125: a box of 2 x 2 x 2 */

typedef struct {
  DLMScene      scene;
  DLMSphereSpec spec[2];
  DLMGrid       grid;
  DLMSpheres    spheres;
  DLMContact    contact;
  PetscReal     force[6];
} Case;

static DLMSphereSpec Sphere(double radius, double x1, double x2, double x3)
{
  return (DLMSphereSpec){ .center = { x1, x2, x3 }, .radius = radius, .density = 1.0, .motion = DLM_MOTION_FREE };
}

static void Start(unsigned periodic, DLMSphereSpec a, DLMSphereSpec b, Case *c)
{
  MakeScene(PETSC_COMM_WORLD, cells, periodic, &c->scene);
  c->spec[0]                 = a;
  c->spec[1]                 = b;
  c->scene.n_spheres         = b.radius > 0.0 ? 2 : 1;
  c->scene.spheres           = c->spec;
  c->scene.contact_range     = 0.05;
  c->scene.contact_stiffness = 3.0;
}

/* Builds everything, takes the forces, clears up. */
static void Run(Case *c)
{
  for (int i = 0; i < 6; i++) c->force[i] = 99.0;
  Call(DLMGridCreate(&c->scene, &c->grid));
  Call(DLMSpheresCreate(c->grid, &c->scene, &c->spheres));
  Call(DLMContactCreate(&c->scene, PETSC_FALSE, &c->contact));
  Call(DLMContactForces(&c->contact, c->spheres, c->force));
  Call(DLMSpheresDestroy(&c->spheres));
  Call(DLMGridDestroy(&c->grid));
}

static const DLMSphereSpec none = { .radius = 0.0 };

/* Spheres of 0.3 and 0.2 at gap g along a slanted line, across a periodic face too: size, direction, opposite forces. */
static void PairsRepelEachOther(void **state)
{
  const double e[3] = { 2.0 / 3.0, -2.0 / 3.0, 1.0 / 3.0 };

  for (int across = 0; across < 2; across++)
    for (int k = -2; k <= 6; k++) {
      const double  g = 0.01 * k, d = 0.5 + g, expected = g < 0.05 ? 3.0 * pow((0.05 - g) / 0.05, 2) : 0.0, x = across ? 0.9 : 0.0;
      DLMSphereSpec b = Sphere(0.2, x + d * e[0], d * e[1], d * e[2]);
      Case          c;
      if (across) b.center[0] -= 2.0;
      Start(3, Sphere(0.3, x, 0.0, 0.0), b, &c);
      Run(&c);
      for (int q = 0; q < 3; q++) {
        AssertNear(c.force[q], -expected * e[q], 1e-12);
        AssertNear(c.force[3 + q], expected * e[q], 1e-12);
      }
      AssertNear(c.contact.largest, expected, 1e-12);
    }
}

/* A wall repels as the mirror image would, with twice the stiffness: (range - 2 gap) / range. */
static void WallsRepel(void **state)
{
  for (int axis = 0; axis < 3; axis++)
    for (int side = 0; side < 2; side++)
      for (int k = 0; k <= 5; k++) {
        const double gap = 0.01 * k, expected = gap < 0.025 ? 6.0 * pow((0.05 - 2.0 * gap) / 0.05, 2) : 0.0;
        Case         c;
        Start(7u & ~(1u << axis), Sphere(0.3, 0.0, 0.0, 0.0), none, &c);
        c.spec[0].center[axis] = side ? 0.7 - gap : gap - 0.7;
        Run(&c);
        for (int q = 0; q < 3; q++) AssertNear(c.force[q], q == axis ? (side ? -expected : expected) : 0.0, 1e-12);
        AssertNear(c.contact.largest, expected, 1e-12);
      }
}

/* One sphere in a periodic box, spheres that do not move, no range: nothing to compute, and no force even if they touch. */
static void NothingCanMeet(void **state)
{
  const DLMSphereSpec a = Sphere(0.3, 0.0, 0.0, 0.0), b = Sphere(0.3, 0.6, 0.0, 0.0);
  Case                c;

  for (int k = 0; k < 5; k++) {
    Start(k == 0 ? 7 : 3, a, k == 0 ? none : b, &c);
    if (k == 1) c.scene.contact_range = 0.0;
    if (k == 2) c.spec[0].motion = c.spec[1].motion = DLM_MOTION_FIXED;
    if (k == 3) c.spec[0].motion = DLM_MOTION_ROTATE, c.spec[1].motion = DLM_MOTION_FIXED;
    Run(&c);
    assert_int_equal(c.contact.exists, k == 4);
    for (int q = 0; q < 3 * c.scene.n_spheres; q++) AssertNear(c.force[q], k == 4 && q % 3 == 0 ? (q ? 3.0 : -3.0) : 0.0, 1e-12);
  }
  Start(7, a, b, &c); /* two spheres meet without walls, one sphere meets walls */
  Run(&c);
  assert_true(c.contact.exists);
  Start(6, a, none, &c);
  Run(&c);
  assert_true(c.contact.exists);
}

/* Range h/8; stiffness five times the largest of viscous, net weight and prescribed force. */
static void TheProgramChoosesRangeAndStiffness(void **state)
{
  const double volume = 4.0 / 3.0 * M_PI * 0.027;
  Case         c;

  for (int k = 0; k < 4; k++) {
    double expected = 0.0;
    Start(3, Sphere(0.3, 0.0, 0.0, 0.0), Sphere(0.2, 0.0, 0.0, 0.6), &c);
    c.scene.contact_range = c.scene.contact_stiffness = DLM_AUTO;
    if (k == 0 || k == 3) {
      c.scene.wall_velocity[2][0][0] = -1.0;
      c.scene.wall_velocity[2][1][0] = 2.0;
      expected += 6.0 * M_PI * 0.7 * 0.09 * 1.5;
    }
    if (k == 1 || k == 3) {
      c.scene.gravity[2] = -10.0;
      c.spec[0].density  = 1.5;
      expected += 0.5 * volume * 10.0;
    }
    if (k == 2 || k == 3) {
      c.spec[0].force[1] = -4.0;
      expected += 4.0;
    }
    Run(&c);
    AssertNear(c.contact.range, 0.125 / 8.0, 1e-15);
    AssertNear(c.contact.stiffness, 5.0 * expected, 1e-12);
    assert_true(c.contact.exists);
  }
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(PairsRepelEachOther),
  cmocka_unit_test(WallsRepel),
  cmocka_unit_test(NothingCanMeet),
  cmocka_unit_test(TheProgramChoosesRangeAndStiffness),
};

RUN_ON_ALL_RANKS(tests)
