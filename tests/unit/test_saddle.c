/* The saddle problem of a step: no slip, force balance, inertia, motions, every pairing, any number of ranks. */
#include "saddletest.h"

static void SlipIsWithinTheTolerance(void **state)
{
  for (int p = 0; p < N_PAIRINGS; p++)
    for (int k = 0; k < 2; k++) {
      const PetscReal rtol = k ? 1e-9 : 1e-5;
      Bodies          b;
      StartCase(PETSC_COMM_WORLD, 24, rtol, &b);
      SetPairing(&pairings[p], &b);
      AddThree(&b);
      OpenCase("", &b);
      const PetscInt its = Solve(&b, no_inertia);
      const double slip = Slip(&b);
      print_message("  %s %s degree %g, rtol %g: slip %.2e, %d iterations\n", DLMPairingTypes[pairings[p].type], DLMPointSets[pairings[p].points],
                    pairings[p].degree, rtol, slip, (int)its);
      AssertAtMost(slip, 2.0 * rtol); /* the solver's norm is the energy */
      CloseCase(&b);
    }
}

/* F_hyd + F = 0 without inertia, for every component that is not held. */
static void ForcesBalance(void **state)
{
  for (int p = 0; p < N_PAIRINGS; p++) {
    Bodies b;
    StartCase(PETSC_COMM_WORLD, 24, 1e-6, &b);
    SetPairing(&pairings[p], &b);
    AddThree(&b);
    OpenCase("", &b);
    Solve(&b, no_inertia);
    for (int d = 0; d < 3; d++) {
      AssertNear(b.state[0].force[d], -b.force[d], 1e-11);
      AssertNear(b.state[0].torque[d], -b.torque[d], 1e-11);
      AssertNear(b.state[1].torque[d], -b.torque[3 + d], 1e-11);
    }
    CloseCase(&b);
  }
}

/* F_hyd + F = M weight (V - now V^n - before V^(n-1)), over several steps of changing weights. */
static void InertiaBalances(void **state)
{
  const DLMInertia steps[] = { { 10.0, 1.0, 0.0 }, { 15.0, 4.0 / 3.0, -1.0 / 3.0 }, { 17.0, 1.3, -0.3 } };
  Bodies           b;

  StartCase(PETSC_COMM_WORLD, 24, 1e-6, &b);
  AddThree(&b);
  b.spec[0].velocity[1] = 0.7;
  b.spec[0].omega[2]    = -0.4;
  OpenCase("", &b);
  for (int k = 0; k < 3; k++) {
    const DLMSphereState old[2] = { b.state[0], b.state[1] };
    Solve(&b, steps[k]);
    for (int i = 0; i < 2; i++) {
      const double a = b.spec[i].radius, M = 4.0 / 3.0 * M_PI * a * a * a * b.spec[i].density, moment = 0.4 * M * a * a, w = steps[k].weight;
      for (int d = 0; d < 3; d++) {
        const double dV = b.state[i].velocity[d] - steps[k].now * old[i].velocity[d] - steps[k].before * old[i].velocity_before[d];
        const double dw = b.state[i].omega[d] - steps[k].now * old[i].omega[d] - steps[k].before * old[i].omega_before[d];
        if (i == 0) AssertNear(b.state[i].force[d] + b.force[3 * i + d], M * w * dV, 1e-11);
        AssertNear(b.state[i].torque[d] + b.torque[3 * i + d], moment * w * dw, 1e-11);
        AssertNear(b.state[i].velocity_before[d], old[i].velocity[d], 0.0);
        AssertNear(b.state[i].omega_before[d], old[i].omega[d], 0.0);
      }
    }
    AssertAtMost(Slip(&b), 2e-6);
  }
  CloseCase(&b);
}

static void HeldSpheresKeepTheirMotion(void **state)
{
  for (int k = 0; k < 2; k++) {
    Bodies b;
    StartCase(PETSC_COMM_WORLD, 24, 1e-6, &b);
    AddThree(&b);
    OpenCase("", &b);
    Solve(&b, k ? (DLMInertia){ 10.0, 1.0, 0.0 } : no_inertia);
    for (int d = 0; d < 3; d++) {
      AssertNear(b.state[1].velocity[d], 0.0, 0.0);
      AssertNear(b.state[2].velocity[d], b.spec[2].velocity[d], 0.0);
      AssertNear(b.state[2].omega[d], b.spec[2].omega[d], 0.0);
    }
    if (!k) AssertNear(b.state[1].omega[1], 0.5 + 0.3 / (8.0 * M_PI * 0.7 * 0.32 * 0.32 * 0.32), 0.1);
    CloseCase(&b);
  }
}

/* Mobility is the inverse of resistance: a sphere held at the motion of a pushed one feels the push, a rotating one the missing force. */
static void FixedSpheresFeelThePush(void **state)
{
  Bodies free, held;

  StartCase(PETSC_COMM_WORLD, 24, 1e-9, &free);
  AddSphere(&free, DLM_MOTION_FREE, 0.3, 0.13, 0.24, 0.35);
  AddSphere(&free, DLM_MOTION_FREE, 0.3, 0.13, 0.94, 0.35);
  Push(&free, 0, 1.0, -2.0, 0.5, 0.1, 0.2, -0.3);
  Push(&free, 1, 0.3, 0.7, -1.0, 0.2, 0.0, 0.4);
  OpenCase("", &free);
  Solve(&free, no_inertia);
  StartCase(PETSC_COMM_WORLD, 24, 1e-9, &held);
  AddSphere(&held, DLM_MOTION_FIXED, 0.3, 0.13, 0.24, 0.35);
  AddSphere(&held, DLM_MOTION_FREE, 0.3, 0.13, 0.94, 0.35);
  Push(&held, 1, 0.3, 0.7, -1.0, 0.2, 0.0, 0.4);
  for (int d = 0; d < 3; d++) {
    held.spec[0].velocity[d] = free.state[0].velocity[d];
    held.spec[0].omega[d]    = free.state[0].omega[d];
  }
  OpenCase("", &held);
  Solve(&held, no_inertia);
  AssertAtMost(Difference(&held, &free), 1e-7);
  CloseCase(&held);
  CloseCase(&free);
}

/* Force, torque and shear act on a lone sphere in the middle: V, omega and the drag point where they should, within the box's correction. */
static void APushedSphereMovesAsStokesSays(void **state)
{
  const double a = 0.3, mu = 0.7;
  Bodies       b;

  StartCase(PETSC_COMM_WORLD, 36, 1e-8, &b);
  AddSphere(&b, DLM_MOTION_FREE, a, 0.0, 0.0, 0.0);
  Push(&b, 0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5);
  OpenCase("", &b);
  Solve(&b, no_inertia);
  AssertNear(b.state[0].velocity[1] * 6.0 * M_PI * mu * a, 0.85, 0.15);
  AssertNear(b.state[0].omega[2] * 8.0 * M_PI * mu * a * a * a / 0.5, 0.97, 0.05);
  AssertNear(b.state[0].omega[1], 0.5, 0.02);
  AssertNear(b.state[0].stresslet[4] / (20.0 / 3.0 * M_PI * mu * a * a * a * 0.5), 1.05, 0.1);
  for (int d = 0; d < 3; d++)
    if (d != 1) AssertNear(b.state[0].velocity[d], 0.0, 1e-3);
  CloseCase(&b);
}

/* The same case on one rank. */
static double DifferenceFromOneRank(const Bodies *b, const PairingCase *pairing, DLMInertia inertia)
{
  double difference;
  Bodies alone;

  StartCase(PETSC_COMM_SELF, 24, 1e-10, &alone);
  SetPairing(pairing, &alone);
  AddThree(&alone);
  OpenCase("", &alone);
  Solve(&alone, inertia);
  difference = Difference(b, &alone);
  CloseCase(&alone);
  return difference;
}

static void EveryNumberOfRanksAgrees(void **state)
{
  PetscMPIInt rank;

  Call(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  for (int p = 0; p < N_PAIRINGS; p++)
    for (int k = 0; k < 2; k++) {
      const DLMInertia inertia = k ? (DLMInertia){ 10.0, 1.0, 0.0 } : no_inertia;
      Bodies           b;
      double           difference = 0.0;
      if (k && p > 1) continue;
      StartCase(PETSC_COMM_WORLD, 24, 1e-10, &b);
      SetPairing(&pairings[p], &b);
      AddThree(&b);
      OpenCase("", &b);
      Solve(&b, inertia);
      if (rank == 0) difference = DifferenceFromOneRank(&b, &pairings[p], inertia);
      print_message("  %s %s degree %g: against one rank %.1e\n", DLMPairingTypes[pairings[p].type], DLMPointSets[pairings[p].points], pairings[p].degree, difference);
      AssertAtMost(difference, 1e-8);
      CloseCase(&b);
    }
}

/* The less inertia, the closer to none, in proportion. */
static void VanishingInertiaIsNoInertia(void **state)
{
  double difference[2];
  Bodies without;

  StartCase(PETSC_COMM_WORLD, 24, 1e-11, &without);
  AddThree(&without);
  OpenCase("", &without);
  Solve(&without, no_inertia);
  for (int k = 0; k < 2; k++) {
    Bodies with;
    StartCase(PETSC_COMM_WORLD, 24, 1e-11, &with);
    AddThree(&with);
    OpenCase("", &with);
    Solve(&with, (DLMInertia){ k ? 1e-5 : 1e-3, 1.0, 0.0 });
    difference[k] = Difference(&with, &without);
    CloseCase(&with);
  }
  print_message("  M/dt = 1e-3: %.2e, 1e-5: %.2e\n", difference[0], difference[1]);
  assert_true(difference[0] > 1e-6 && difference[0] < 1e-3);
  AssertNear(difference[1] / difference[0], 1e-2, 1e-3);
  CloseCase(&without);
}

static const struct CMUnitTest tests[] = {
  cmocka_unit_test(SlipIsWithinTheTolerance),
  cmocka_unit_test(ForcesBalance),
  cmocka_unit_test(InertiaBalances),
  cmocka_unit_test(HeldSpheresKeepTheirMotion),
  cmocka_unit_test(FixedSpheresFeelThePush),
  cmocka_unit_test(APushedSphereMovesAsStokesSays),
  cmocka_unit_test(EveryNumberOfRanksAgrees),
  cmocka_unit_test_teardown(VanishingInertiaIsNoInertia, DestroyBoxes),
};

RUN_ON_ALL_RANKS(tests)
