#include <math.h>
#include "../../include/private/rheology.h"

/* eta1(gd) = eta1 (1 + (lambda1 gd)^2)^((n-1)/2); solvent and polymer keep the ratio lambda2/lambda1 (docs/theory.md, V6). */
void DLMCarreauViscosity(const DLMScene *fluid, long n, const double *rate, double *solvent, double *polymer)
{
  const double part = fluid->retardation_time / fluid->relaxation_time, power = 0.5 * (fluid->carreau_n - 1.0);

  for (long x = 0; x < n; x++) {
    const double s     = fluid->relaxation_time * rate[x];
    const double total = power == 0.0 ? fluid->fluid_viscosity : fluid->fluid_viscosity * pow(1.0 + s * s, power);
    solvent[x]         = total * part;
    polymer[x]         = total - solvent[x];
  }
}
