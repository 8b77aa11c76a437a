/* The lagged terms of the both-sides coupling: the chosen weights damp every mode of the step, larger ones would not. */
#include <math.h>
#include "dlmtest.h"
#include "private/lag.h"

/* Growth of a mode over many steps of the scheme itself (docs/theory.md, V4), from a start at rest with stress. */
static double Growth(double polymer_part, double seen, double step, DLMLag lag)
{
  const double b = polymer_part * seen, decay = -expm1(-step);
  double       c = 1.0, f = 0.0, u = 0.0, u_before = 0.0, largest = 0.0;

  for (int n = 0; n < 4000; n++) {
    const double now = b * (u + lag.velocity * (u - u_before) - c), force = now + lag.force * (now - f);
    u_before = u, u = force, f = now;
    c += decay * (u - c);
    if (fabs(u) + fabs(c) > 1e9) return 1e9;
    if (n >= 3900) largest = fmax(largest, fabs(u) + fabs(c));
  }
  return largest;
}

static double WorstGrowth(double polymer_part, double step, DLMLag lag)
{
  double worst = 0.0;

  for (int k = 1; k <= 40; k++) worst = fmax(worst, Growth(polymer_part, k / 40.0, step, lag));
  return worst;
}

static const double parts[] = { 0.5, 0.75, 0.875, 0.9, 0.95, 0.99, 1.0 }, steps[] = { 0.003, 0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 1.0, 3.0, 20.0 };

static void ChosenWeightsDamp(void **state)
{
  for (size_t i = 0; i < sizeof(parts) / sizeof(parts[0]); i++)
    for (size_t j = 0; j < sizeof(steps) / sizeof(steps[0]); j++) {
      const DLMLag lag = DLMLagChoose(parts[i], parts[i], 1.0, steps[j]);
      assert_true(lag.force >= 0.0 && lag.force <= 0.5 && lag.velocity >= 0.0 && lag.force + lag.velocity <= 1.0);
      assert_true(WorstGrowth(parts[i], steps[j], lag) <= 1.0);
    }
}

/* Where the choice stays below second order, second order would grow. */
static void SecondOrderWhereItIsDamped(void **state)
{
  const DLMLag second = { 0.5, 0.5 };
  DLMLag       lag    = DLMLagChoose(0.875, 0.875, 1.0, 0.01);

  assert_true(lag.force == 0.5 && lag.velocity == 0.5);
  lag = DLMLagChoose(0.875, 0.875, 1.0, 0.1);
  assert_true(lag.velocity > 0.05 && lag.velocity < 0.2);
  assert_true(WorstGrowth(0.875, 0.1, second) == 1e9);
  assert_true(DLMLagChoose(0.5, 0.5, 1.0, 0.1).velocity == 0.5);
}

/* The recursion on the roots against the scheme: both call the same weights stable. */
static void RootsAgreeWithTheScheme(void **state)
{
  int both[2] = { 0, 0 };

  for (double velocity = 0.0; velocity <= 0.8; velocity += 0.05)
    for (double step = 0.02; step < 2.0; step *= 1.7) {
      const DLMLag lag    = { 0.5, velocity };
      const int    damped = DLMLagDamps(0.9, 0.9, 1.0, -expm1(-step), lag, 0.997);
      if (damped) assert_true(Growth(0.9, 1.0, step, lag) < 1.0);
      if (!DLMLagDamps(0.9, 0.9, 1.0, -expm1(-step), lag, 1.003)) assert_true(Growth(0.9, 1.0, step, lag) > 1.0);
      both[damped]++;
    }
  assert_true(both[0] > 20 && both[1] > 20);
}

int main(void)
{
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(ChosenWeightsDamp),
    cmocka_unit_test(SecondOrderWhereItIsDamped),
    cmocka_unit_test(RootsAgreeWithTheScheme),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
