/* Friction across narrow gaps: its coefficients against exact values, its symmetries, what it does in the saddle problem, and the gaps of a move. */
#include "saddletest.h"
#include "dlmlubrication.h"

static DLMGap Gap(double a, double b, double width, double range)
{
  DLMGap gap = { .i = 0, .j = b > 0.0 ? 1 : -1, .width = width, .e = { 0.0, 0.0, 1.0 }, .arm = { a, b } };

  DLMGapSetFriction(1.0, 0.6 * a, a, b, range, &gap); /* a coarse mesh */
  return gap;
}

/*
  Resistances at a gap of 0.002 minus those at 0.01, radii 1 and b (0: wall): the mesh resolves little of that difference. Exact values by
  tools/two_spheres: force by V along e, force and torque by V across e, torque by omega of the same sphere, of the other, and of the other on itself.
*/
static const struct {
  double b, exact[6];
} steep[] = {
  { 1.0, { 1891.7456, 5.0395, 4.9743, 7.8803, 1.9726, 7.8803 } },
  { 2.0, { 3358.4822, 7.1602, 5.2801, 10.4895, 5.2605, 42.512 } },
  { 0.0, { 7545.8345, 16.007, 3.8788, 15.6624, 0.0, 0.0 } },
};

static void NarrowGapsResistLikeExactSpheres(void **state)
{
  const int    entry[6][2] = { { 2, 2 }, { 0, 0 }, { 4, 0 }, { 4, 4 }, { 4, 10 }, { 10, 10 } };

  for (size_t k = 0; k < sizeof(steep) / sizeof(steep[0]); k++) {
    const DLMGap near = Gap(1.0, steep[k].b, 0.002, 0.75), far = Gap(1.0, steep[k].b, 0.01, 0.75);
    PetscReal    M[144], N[144];
    DLMGapMatrix(&near, M);
    DLMGapMatrix(&far, N);
    for (int q = 0; q < 6; q++) {
      const int at = 12 * entry[q][0] + entry[q][1];
      print_message("  radius %g, entry %d: %.4f, exact %.4f\n", steep[k].b, q, M[at] - N[at], steep[k].exact[q]);
      AssertNear(M[at] - N[at], steep[k].exact[q], (q ? 0.03 : 0.001) * steep[k].exact[q]);
    }
  }
}

/* Friction grows as the gap narrows, ends at the range without a jump, and stays finite at contact and overlap. */
static void FrictionEndsAtTheRange(void **state)
{
  for (int wall = 0; wall < 2; wall++) {
    double last[3] = { 0.0 };
    for (int k = 0; k <= 400; k++) {
      const DLMGap gap     = Gap(0.4, wall ? 0.0 : 0.3, 0.1 * (1.0 - k / 400.0) + (k == 400 ? -0.01 : 0.0), 0.1);
      const double now[3] = { gap.normal, gap.slide, gap.roll };
      for (int c = 0; c < 3; c++) {
        assert_true(isfinite(now[c]) && (k < 2 ? now[c] >= last[c] : now[c] > last[c]));
        if (k < 2) AssertNear(now[c], 0.0, k ? 0.1 : 0.0);
        last[c] = now[c];
      }
    }
  }
}

/* (L4) What is missing falls with h: the log of it by log 2 where h is halved, once the gap is far below h; in a gap of several h almost nothing is missing. */
static void AFinerMeshMissesLess(void **state)
{
  for (int wall = 0; wall < 2; wall++) {
    DLMGap gap[3] = { { .width = 1e-4 }, { .width = 1e-4 }, { .width = 0.1 } };
    for (int k = 0; k < 3; k++) DLMGapSetFriction(1.0, (double[3]){ 0.1, 0.05, 0.01 }[k], 1.0, wall ? 0.0 : 1.0, 0.75, &gap[k]);
    AssertNear(gap[0].slide - gap[1].slide, (wall ? 3.2 : 1.0) * PETSC_PI * log(2.0), 0.06 * (wall ? 3.2 : 1.0));
    assert_true(gap[1].normal < gap[0].normal && gap[1].roll < gap[0].roll);
    assert_true(gap[2].slide < 0.02 * gap[0].slide);
  }
}

/*
  At a gap of 0.05 radii: the exact resistance (tools/two_spheres) less what the program has without friction, in the mean over the places of docs/close_pairs.csv; walls as in
  docs/close_pairs.md. Radius 1: by approach; by sliding; of a pair, by turning oppositely, and at a wall the torque on a sphere that slides.
*/
static const struct {
  double a_over_h, b, missing[3];
} missed[] = {
  { 2.4, 1.0, { 81.3, 2.88, 2.21 } },    { 4.8, 1.0, { 70.0, 1.71, 1.57 } },    { 6.4, 1.0, { 64.6, 1.20, 1.24 } },
  { 2.4, 0.0, { 248.4, 6.09, -0.20 } }, { 4.8, 0.0, { 201.8, 3.32, -0.69 } }, { 6.4, 0.0, { 190.2, 2.39, -0.89 } },
};

static void FrictionIsWhatTheMeshMisses(void **state)
{
  const double within[3] = { 0.03, 0.12, 0.18 };

  for (size_t k = 0; k < sizeof(missed) / sizeof(missed[0]); k++) {
    DLMGap gap = { .width = 0.05 };
    DLMGapSetFriction(1.0, 1.0 / missed[k].a_over_h, 1.0, missed[k].b, missed[k].b > 0.0 ? 0.75 : 0.375, &gap);
    const double is[3] = { gap.normal, gap.slide, missed[k].b > 0.0 ? gap.roll : gap.slide + gap.couple };
    for (int c = 0; c < 3; c++) {
      print_message("  a/h = %g, radius %g, %d: %.3f, missing %.3f\n", missed[k].a_over_h, missed[k].b, c, is[c], missed[k].missing[c]);
      AssertNear(is[c], missed[k].missing[c], within[c] * fmax(1.0, fabs(missed[k].missing[c])));
    }
  }
}

/* Random unit vector, radii and gap; walls every third time. */
static DLMGap RandomGap(int k)
{
  const double a = 1.0 + 0.9 * Hash(1, k), b = k % 3 ? 1.0 + 0.99 * Hash(2, k) : 0.0, width = pow(10.0, -3.0 + 2.0 * Hash(3, k));
  DLMGap       gap = Gap(a, b, width, 0.4 * (a + b));
  double       square = 0.0;

  for (int c = 0; c < 3; c++) square += pow(Hash(4 + c, k), 2);
  for (int c = 0; c < 3; c++) gap.e[c] = Hash(4 + c, k) / sqrt(square);
  gap.arm[0] = a + width * a / (a + b);
  gap.arm[1] = b + width * b / (a + b);
  return gap;
}

static void FrictionIsSymmetricAndNeverDrives(void **state)
{
  for (int k = 0; k < 300; k++) {
    const DLMGap gap = RandomGap(k);
    PetscReal    M[144], largest = 0.0;
    DLMGapMatrix(&gap, M);
    for (int q = 0; q < 144; q++) largest = fmax(largest, fabs(M[q]));
    for (int r = 0; r < 12; r++)
      for (int c = 0; c < r; c++) AssertNear(M[12 * r + c], M[12 * c + r], 1e-13 * largest);
    assert_true(gap.slide * gap.roll >= gap.couple * gap.couple && gap.normal >= 0.0 && gap.roll >= 0.0);
    for (int trial = 0; trial < 20; trial++) {
      double power = 0.0;
      for (int r = 0; r < 12; r++)
        for (int c = 0; c < 12; c++) power += Hash(20 + trial, r) * M[12 * r + c] * Hash(20 + trial, c);
      assert_true(power >= -1e-12 * largest);
    }
  }
}

static void RigidMotionsOfThePairAreFree(void **state)
{
  for (int k = 0; k < 300; k++) {
    const DLMGap gap = RandomGap(k);
    PetscReal    U[12], load[12] = { 0.0 };
    if (gap.j < 0) continue;
    for (int i = 0; i < 2; i++)
      for (int c = 0; c < 3; c++) {
        const int        p = (c + 1) % 3, q = (c + 2) % 3;
        const PetscReal  s = i ? gap.arm[1] : -gap.arm[0]; /* centres at s e */
        U[6 * i + c]     = Hash(50 + c, k) + Hash(60 + p, k) * s * gap.e[q] - Hash(60 + q, k) * s * gap.e[p];
        U[6 * i + 3 + c] = Hash(60 + c, k);
      }
    DLMGapAddLoads(&gap, U, U + 6, load, load + 6);
    for (int c = 0; c < 12; c++) AssertNear(load[c], 0.0, 1e-13 * gap.normal);
  }
}

/* Forces are opposite, and so are the moments about any one point. */
static void ActionIsReaction(void **state)
{
  for (int k = 0; k < 300; k++) {
    const DLMGap gap = RandomGap(k);
    PetscReal    U[12], load[12] = { 0.0 };
    if (gap.j < 0) continue;
    for (int c = 0; c < 12; c++) U[c] = Hash(70 + c, k);
    DLMGapAddLoads(&gap, U, U + 6, load, load + 6);
    for (int c = 0; c < 3; c++) {
      const int    p = (c + 1) % 3, q = (c + 2) % 3;
      const double lever = gap.arm[0] + gap.arm[1]; /* about the centre of i */
      AssertNear(load[c] + load[6 + c], 0.0, 1e-13 * gap.normal);
      AssertNear(load[3 + c] + load[9 + c] + lever * (gap.e[p] * load[6 + q] - gap.e[q] * load[6 + p]), 0.0, 1e-12 * gap.normal);
    }
  }
}

/* A wall that moves along with the sphere does nothing; one that moves by itself drags it. */
static void WallsDrag(void **state)
{
  DLMGap    gap = Gap(0.5, 0.0, 0.01, 0.2);
  PetscReal U[6] = { 0.3, -0.2, 0.1, 0.0, 0.0, 0.0 }, load[6] = { 0.0 };

  for (int c = 0; c < 3; c++) gap.wall[c] = U[c];
  DLMGapAddLoads(&gap, U, NULL, load, NULL);
  for (int c = 0; c < 6; c++) AssertNear(load[c], 0.0, 0.0);
  gap.wall[0] += 1.0;
  DLMGapAddLoads(&gap, U, NULL, load, NULL);
  AssertNear(load[0], gap.slide, 1e-12);
  assert_true(load[4] > 0.0);
}

/* Two free spheres and a fixed one in a row, gaps of 1/100 and 1/1000 of a radius, one near the wall; a fourth far from them. */
static void StartRow(MPI_Comm comm, PetscReal rtol, PetscBool lubricated, Bodies *b)
{
  StartCase(comm, 24, rtol, b);
  b->scene.lubrication       = lubricated ? DLM_LUBRICATION_TRUE : DLM_LUBRICATION_FALSE;
  b->scene.lubrication_range = 0.75;
  AddSphere(b, DLM_MOTION_FREE, 0.3, -0.2, 0.1, -0.69);
  AddSphere(b, DLM_MOTION_FREE, 0.3, 0.403, 0.1, -0.69);
  AddSphere(b, DLM_MOTION_FIXED, 0.32, 1.0233, 0.1, -0.6);
  AddSphere(b, DLM_MOTION_FREE, 0.3, 0.0, -0.5, 0.5);
  b->spec[2].velocity[1] = 0.5;
  b->spec[2].omega[0]    = 0.3;
  Push(b, 0, 3.0, 1.0, -2.0, 0.1, 0.2, -0.3);
  Push(b, 1, -4.0, 2.0, 1.0, -0.2, 0.3, 0.1);
}

/* Force balance holds with the friction in it, the approach is slow, and few iterations do. */
static void FrictionHoldsBackTheApproach(void **state)
{
  double speed[2];

  for (int with = 0; with < 2; with++) {
    Bodies b;
    StartRow(PETSC_COMM_WORLD, 1e-4, with, &b); /* far from converged, the balance holds all the same */
    OpenCase("", &b);
    const PetscInt its = Solve(&b, no_inertia);
    speed[with]        = b.state[0].velocity[0] - b.state[1].velocity[0];
    print_message("  %s friction: approach %.3e, %d iterations\n", with ? "with" : "without", speed[with], (int)its);
    for (int i = 0; i < 4; i++)
      for (int d = 0; d < 3 && i != 2; d++) {
        AssertNear(b.state[i].force[d], -b.force[3 * i + d], 1e-8);
        AssertNear(b.state[i].torque[d], -b.torque[3 * i + d], 1e-8);
      }
    for (int d = 0; d < 3; d++) AssertNear(b.state[2].velocity[d], b.spec[2].velocity[d], 0.0);
    AssertAtMost(Slip(&b), 1e-3);
    assert_true(its <= 16);
    CloseCase(&b);
  }
  assert_true(fabs(speed[1]) < 0.5 * fabs(speed[0]));
}

/* One rank or several, one dense block or one for every sphere (all gaps cut), fluid and bodies or the thesis's splitting: one answer. */
static void BlocksRanksAndSplittingsAgree(void **state)
{
  Bodies one;

  StartRow(PETSC_COMM_SELF, 1e-9, PETSC_TRUE, &one);
  OpenCase("", &one);
  Solve(&one, (DLMInertia){ 3.0, 1.0, 0.0 });
  for (int k = 0; k < 3; k++) {
    Bodies other;
    StartRow(PETSC_COMM_WORLD, 1e-9, PETSC_TRUE, &other);
    if (k == 1) other.scene.saddle_cluster_limit = 10;
    OpenCase(k == 2 ? "-saddle_split velocity" : "", &other);
    const PetscInt its = Solve(&other, (DLMInertia){ 3.0, 1.0, 0.0 });
    print_message("  %s: difference %.2e, %d iterations\n", k == 0 ? "ranks" : (k == 1 ? "cut gaps" : "Uzawa"), Difference(&other, &one), (int)its);
    AssertAtMost(Difference(&other, &one), 1e-6);
    CloseCase(&other);
  }
  CloseCase(&one);
}

/* Friction across gaps exists where it is asked for, or by itself in Newtonian fluid where bodies can meet. */
static void TheSceneDecides(void **state)
{
  const struct {
    DLMLubricationChoice choice;
    DLMFluidModel        fluid;
    DLMMotion            motion;
    PetscReal            speed;
    PetscBool            exists;
  } cases[] = {
    { DLM_LUBRICATION_AUTO, DLM_FLUID_NEWTONIAN, DLM_MOTION_FREE, 0.0, PETSC_TRUE },   { DLM_LUBRICATION_AUTO, DLM_FLUID_NEWTONIAN, DLM_MOTION_FIXED, 0.0, PETSC_FALSE },
    { DLM_LUBRICATION_AUTO, DLM_FLUID_OLDROYD_B, DLM_MOTION_FREE, 0.0, PETSC_FALSE },  { DLM_LUBRICATION_TRUE, DLM_FLUID_OLDROYD_B, DLM_MOTION_FREE, 0.0, PETSC_TRUE },
    { DLM_LUBRICATION_FALSE, DLM_FLUID_NEWTONIAN, DLM_MOTION_FREE, 0.0, PETSC_FALSE }, { DLM_LUBRICATION_TRUE, DLM_FLUID_NEWTONIAN, DLM_MOTION_FIXED, 0.0, PETSC_TRUE },
    { DLM_LUBRICATION_AUTO, DLM_FLUID_NEWTONIAN, DLM_MOTION_FIXED, 0.1, PETSC_TRUE },  { DLM_LUBRICATION_AUTO, DLM_FLUID_NEWTONIAN, DLM_MOTION_ROTATE, 0.1, PETSC_FALSE },
  };

  for (size_t k = 0; k < sizeof(cases) / sizeof(cases[0]); k++) {
    DLMLubrication lubrication;
    Bodies         b;
    StartCase(PETSC_COMM_WORLD, 24, 1e-6, &b);
    b.scene.lubrication = cases[k].choice;
    b.scene.fluid_model = cases[k].fluid;
    AddSphere(&b, cases[k].motion, 0.3, 0.0, 0.0, 0.0);
    b.spec[0].velocity[2] = cases[k].speed;
    Call(DLMLubricationCreate(&b.scene, &lubrication));
    assert_int_equal(lubrication.exists, cases[k].exists);
    Call(DLMLubricationDestroy(&lubrication));
  }
}

/* A step far too long for the approach leaves exp(-k dt) of every gap: between free spheres, at a fixed one, at a wall. */
static void LongStepsKeepGaps(void **state)
{
  const PetscReal width = 0.01, time = 10.0, speed = 0.02, left = width * exp(-speed * time / width);
  DLMLubrication  lubrication;
  PetscReal       start[9];
  Bodies          b;

  StartCase(PETSC_COMM_WORLD, 24, 1e-6, &b);
  b.scene.lubrication       = DLM_LUBRICATION_TRUE;
  b.scene.lubrication_range = 0.75;
  AddSphere(&b, DLM_MOTION_FREE, 0.3, -0.2, 0.0, -1.0 + 0.3 + width);
  AddSphere(&b, DLM_MOTION_FREE, 0.2, 0.3 + width, 0.0, -1.0 + 0.3 + width);
  AddSphere(&b, DLM_MOTION_FIXED, 0.2, 0.7 + 2.0 * width, 0.0, -1.0 + 0.3 + width);
  OpenCase("", &b);
  b.state[0].velocity[2] = -speed;
  b.state[1].velocity[0] = speed; /* towards the fixed sphere, away from the other */
  Call(DLMLubricationCreate(&b.scene, &lubrication));
  Call(DLMLubricationUpdate(&lubrication, b.spheres));
  assert_int_equal(lubrication.n, 3); /* two pairs; sphere 0 at the wall */
  for (int q = 0; q < 9; q++) {
    start[q] = b.state[q / 3].center[q % 3];
    b.state[q / 3].center[q % 3] += time * b.state[q / 3].velocity[q % 3];
  }
  Call(DLMLubricationKeepGaps(&lubrication, b.spheres, start, time));
  AssertNear(b.state[0].center[2], -0.7 + left, 1e-3 * left);
  AssertNear(b.state[0].center[0], start[0], 1e-12);
  AssertNear(b.state[1].center[0], start[6] - 0.4 - left, 1e-3 * left);
  for (int d = 0; d < 3; d++) AssertNear(b.state[2].center[d], start[6 + d], 0.0);
  Call(DLMLubricationDestroy(&lubrication));
  CloseCase(&b);
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(NarrowGapsResistLikeExactSpheres),
  cmocka_unit_test(FrictionEndsAtTheRange),
  cmocka_unit_test(AFinerMeshMissesLess),
  cmocka_unit_test(FrictionIsWhatTheMeshMisses),
  cmocka_unit_test(FrictionIsSymmetricAndNeverDrives),
  cmocka_unit_test(RigidMotionsOfThePairAreFree),
  cmocka_unit_test(ActionIsReaction),
  cmocka_unit_test(WallsDrag),
  cmocka_unit_test(TheSceneDecides),
  cmocka_unit_test(FrictionHoldsBackTheApproach),
  cmocka_unit_test(BlocksRanksAndSplittingsAgree),
  cmocka_unit_test_teardown(LongStepsKeepGaps, DestroyBoxes),
};

RUN_ON_ALL_RANKS(tests)
