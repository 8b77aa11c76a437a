#include "../../include/private/spheresimpl.h"

/*
  Calibrated cover of immersed surface points that carry harmonics (docs/calibration.md, measured by tools/calibrate): retraction
  and compliance at which drag, torque and stresslet give the sphere the same radius, as nearly as one pair of numbers can.
*/
static const struct {
  PetscReal a, retraction, compliance; /* a and retraction in h, compliance in h/viscosity */
} calibrated[] = {
  { 1.9, 0.700, 0.005 }, { 2.2, 0.665, 0.010 }, { 2.43, 0.630, 0.022 }, { 2.68, 0.588, 0.050 }, { 3.05, 0.550, 0.100 }, { 3.5, 0.519, 0.180 },
  { 4.1, 0.497, 0.300 }, { 4.8, 0.477, 0.450 }, { 5.7, 0.462, 0.550 }, { 6.75, 0.451, 0.600 }, { 8.0, 0.444, 0.650 },
};

enum { ROWS = PETSC_STATIC_ARRAY_LENGTH(calibrated) };

/* Linear between the rows, constant beyond them. */
static void Calibrated(PetscReal a, PetscReal *retraction, PetscReal *compliance)
{
  PetscInt  i = 0;
  PetscReal t;

  while (i < ROWS - 2 && a > calibrated[i + 1].a) i++;
  t           = PetscMax(0.0, PetscMin(1.0, (a - calibrated[i].a) / (calibrated[i + 1].a - calibrated[i].a)));
  *retraction = (1.0 - t) * calibrated[i].retraction + t * calibrated[i + 1].retraction;
  *compliance = (1.0 - t) * calibrated[i].compliance + t * calibrated[i + 1].compliance;
}

/* Retraction of point multipliers, in h: where the drag of the same table is right on average. */
static const PetscReal point_retraction[] = { [DLM_PAIRING_COLLOCATION] = 0.17, [DLM_PAIRING_IMMERSED] = 0.6 };

/* Points for a spacing, more if they could not tell the harmonics apart. */
static void CountPoints(PetscReal a, DLMCover *cover)
{
  cover->n_points = DLMSurfaceCount(a - cover->retraction, cover->spacing);
  while (cover->degree && (cover->degree + 1) * (cover->degree + 1) > 0.6 * cover->n_points) {
    cover->spacing *= 0.9;
    cover->n_points = DLMSurfaceCount(a - cover->retraction, cover->spacing);
  }
  cover->n_multipliers = cover->degree ? (cover->degree + 1) * (cover->degree + 1) : cover->n_points;
}

PetscErrorCode DLMPairingGetBlockCover(const DLMScene *scene, PetscReal radius, DLMCover *cover)
{
  PetscFunctionBegin;
  PetscCall(DLMPairingGetCover(scene, radius, cover));
  if (!cover->degree || cover->n_points <= 150) PetscFunctionReturn(0);
  cover->spacing = PetscMax(cover->spacing, 1.0);
  CountPoints(radius / scene->h, cover);
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPairingGetCover(const DLMScene *scene, PetscReal radius, DLMCover *cover)
{
  const PetscBool smooth = (PetscBool)(scene->pairing_type == DLM_PAIRING_IMMERSED && scene->pairing_points == DLM_POINTS_SURFACE);
  const PetscReal a      = radius / scene->h;
  PetscReal       retraction, compliance;

  PetscFunctionBegin;
  Calibrated(a, &retraction, &compliance);
  cover->degree = (PetscInt)scene->pairing_degree;
  if (scene->pairing_degree < 0.0)
    cover->degree = smooth && scene->pairing_retraction < 0.0 ? PetscMax(3, PetscMin(8, (PetscInt)(0.9 * a + 0.5))) : 0;
  cover->spacing    = scene->pairing_spacing >= 0.0 ? scene->pairing_spacing : (cover->degree ? 0.65 : 1.5);
  cover->retraction = scene->pairing_retraction >= 0.0 ? scene->pairing_retraction : (cover->degree ? retraction : point_retraction[scene->pairing_type]);
  CountPoints(a, cover);
  cover->compliance = 0.0;
  if (cover->degree > 1) { /* a coefficient of Q is traction over the density of points */
    const PetscReal kappa = scene->pairing_compliance >= 0.0 ? scene->pairing_compliance : compliance, r = radius - cover->retraction * scene->h;
    cover->compliance     = kappa * scene->h / scene->fluid_viscosity * cover->n_points / (4.0 * PETSC_PI * r * r);
  }
  PetscFunctionReturn(0);
}
