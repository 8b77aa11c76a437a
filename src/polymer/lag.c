#include <math.h>
#include "../../include/private/lag.h"

/* Schur and Cohn's recursion: are all roots of p[0] + p[1] z + ... + p[n] z^n smaller than 1? Overwrites p. */
static int RootsInside(double *p, int n)
{
  for (; n > 0; n--) {
    const double first = p[0], last = p[n];

    if (!(fabs(first) < fabs(last))) return 0;
    for (int k = 0; 2 * k <= n; k++) {
      const double low = p[k], high = p[n - k];
      p[k]     = last * low - first * high;
      p[n - k] = last * high - first * low;
    }
    for (int k = 0; k < n; k++) p[k] = p[k + 1] / last;
  }
  return 1;
}

/*
  Velocity w and stress c of a mode, the implicit viscosity being 1: w = seen (velocity_part w* - stress_part c*), c' = c + decay (w - c), with
  c* = c + F (c - c_before), w* = w_1 + (F + V + F V)(w_1 - w_2) - F V (w_2 - w_3), F and V the weights.
*/
int DLMLagDamps(double velocity_part, double stress_part, double seen, double decay, DLMLag lag, double radius)
{
  const double b = velocity_part * seen, s = stress_part * seen * decay, F = lag.force, V = lag.velocity;
  const double w[4] = { -b * F * V, b * (F + V + 2 * F * V), -b * (1 + F + V + F * V), 1.0 };
  double       p[5] = { 0, 0, -s * F, s * (1 + F), 0 }, scale = 1.0;

  for (int k = 0; k < 4; k++) { /* (z - 1 + decay) (z^3 - ...) */
    p[k + 1] += w[k];
    p[k] -= (1.0 - decay) * w[k];
  }
  for (int k = 0; k < 5; k++, scale *= radius) p[k] *= scale;
  return RootsInside(p, 4);
}

static int DampsAll(double velocity_part, double stress_part, double decay, DLMLag lag, double radius)
{
  for (int k = 1; k <= 20; k++)
    if (!DLMLagDamps(velocity_part, stress_part, k / 20.0, decay, lag, radius * (1.0 + 1e-9))) return 0;
  return 1;
}

/*
  The force's weight first, so that every mode decays; then the velocity's, so that it decays as fast as stress that drives no flow, e^(-dt/lambda1): modes
  that creep to their steady state would cost more than second order gains.
*/
DLMLag DLMLagChoose(double velocity_part, double stress_part, double stiffness, double step)
{
  const double decay = -expm1(-step), radius[2] = { 1.0 - fmin(0.5 * step, 0.05), exp(-step) };
  DLMLag       lag = { 0.0, 0.0 };
  double      *weight[2] = { &lag.force, &lag.velocity };

  for (int i = 0; i < 2; i++) {
    const double s    = stress_part * (i == 0 ? 1.0 : stiffness);
    double       room = 0.5;

    *weight[i] = room;
    if (DampsAll(velocity_part, s, decay, lag, radius[i])) continue;
    *weight[i] = 0.0;
    for (int k = 0; k < 12; k++) {
      room *= 0.5;
      *weight[i] += room;
      if (!DampsAll(velocity_part, s, decay, lag, radius[i])) *weight[i] -= room;
    }
  }
  return lag;
}
