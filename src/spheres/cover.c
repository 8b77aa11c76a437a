#include "../../include/private/spheresimpl.h"

/*
  Calibrated covers (docs/calibration.md, made by tools/calibrate).
*/
PetscErrorCode DLMPairingGetCover(const DLMScene *scene, PetscReal radius, DLMCover *cover)
{
  const PetscBool immersed = (PetscBool)(scene->pairing_type == DLM_PAIRING_IMMERSED);
  const PetscReal a        = radius / scene->h;

  PetscFunctionBegin;
  cover->retraction = scene->pairing_retraction;
  cover->spacing    = scene->pairing_spacing;
  cover->degree     = (PetscInt)scene->pairing_degree;
  if (scene->pairing_degree < 0.0) cover->degree = immersed && scene->pairing_points == DLM_POINTS_SURFACE && scene->pairing_retraction < 0.0 ? PetscMax(2, (PetscInt)(1.5 * a)) : 0;
  if (scene->pairing_spacing < 0.0) cover->spacing = cover->degree ? 1.0 : 1.5;
  if (scene->pairing_retraction < 0.0) cover->retraction = immersed ? 0.6 : 0.12;
  cover->n_points = DLMSurfaceCount(a - cover->retraction, cover->spacing);
  while (cover->degree && (cover->degree + 1) * (cover->degree + 1) > 0.8 * cover->n_points) {
    cover->spacing *= 0.9; /* enough points to tell the harmonics apart */
    cover->n_points = DLMSurfaceCount(a - cover->retraction, cover->spacing);
  }
  cover->n_multipliers = cover->degree ? (cover->degree + 1) * (cover->degree + 1) : cover->n_points;
  /* kappa h / mu in units of traction; a coefficient of Q is traction over the density of points */
  cover->compliance = 0.0;
  if (cover->degree > 1) {
    const PetscReal kappa = scene->pairing_compliance < 0.0 ? 1.0 : scene->pairing_compliance, r = radius - cover->retraction * scene->h;
    cover->compliance     = kappa * scene->h / scene->fluid_viscosity * cover->n_points / (4.0 * PETSC_PI * r * r);
  }
  PetscFunctionReturn(0);
}
