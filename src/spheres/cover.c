#include "../../include/private/spheresimpl.h"

/*
  Calibrated cover of immersed surface points that carry harmonics (docs/calibration.md, found by tools/calibrate -fit): for a compliance of the
  higher harmonics, the retraction that makes the drag right, and the compliances that make torque and stresslet so. First on the cut mesh, then on the symmetric one, for
  centres in x2 = 0 (-fit -box_mirror half).
*/
enum { RADIUS, COMPLIANCE, RETRACTION, SPIN, STRAIN, VALUES, ROWS = 15 }; /* radius and retraction in h, the others in h/viscosity */
static const PetscReal calibrated[2][ROWS][VALUES] = { {
  { 1.2, 0.10, 0.7600, 0.0045, 0.0022 }, /* by hand: six passes do not converge, and V wobbles by 4 % */
  { 1.5, 0.10, 0.6377, 0.0226, 0.0107 }, { 1.9, 0.10, 0.5482, 0.0388, 0.0166 }, { 2.2, 0.10, 0.5376, 0.0337, 0.0135 }, { 2.43, 0.10, 0.5383, 0.0256, 0.0108 },
  { 2.68, 0.10, 0.5411, 0.0154, 0.0082 }, { 2.9, 0.08, 0.5550, 0.0019, 0.0056 }, { 3.2, 0.05, 0.5810, -0.0198, 0.0036 }, { 3.5, 0.05, 0.5783, -0.0294, 0.0050 },
  { 4.1, 0.05, 0.5653, -0.0408, 0.0102 }, { 4.8, 0.05, 0.5484, -0.0470, 0.0143 }, { 5.7, 0.05, 0.5292, -0.0494, 0.0167 }, { 6.75, 0.05, 0.5110, -0.0485, 0.0176 },
  { 8.0, 0.05, 0.4944, -0.0459, 0.0173 }, { 12.0, 0.05, 0.4600, -0.0345, 0.0152 },
}, {
  { 1.2, 0.10, 0.7740, 0.0045, 0.0022 },
  { 1.5, 0.10, 0.6541, 0.0207, 0.0103 }, { 1.9, 0.10, 0.5565, 0.0369, 0.0175 }, { 2.2, 0.10, 0.5435, 0.0321, 0.0151 }, { 2.43, 0.10, 0.5423, 0.0243, 0.0115 },
  { 2.68, 0.10, 0.5441, 0.0143, 0.0094 }, { 2.9, 0.08, 0.5585, 0.0006, 0.0059 }, { 3.2, 0.05, 0.5847, -0.0213, 0.0037 }, { 3.5, 0.05, 0.5804, -0.0303, 0.0057 },
  { 4.1, 0.05, 0.5666, -0.0415, 0.0111 }, { 4.8, 0.05, 0.5490, -0.0473, 0.0148 }, { 5.7, 0.05, 0.5295, -0.0495, 0.0170 }, { 6.75, 0.05, 0.5113, -0.0488, 0.0177 },
  { 8.0, 0.05, 0.4951, -0.0464, 0.0174 }, { 12.0, 0.05, 0.4611, -0.0355, 0.0150 },
} };

/* Linear between the rows, constant beyond them. */
static void Calibrated(PetscReal a, PetscBool symmetric, PetscReal value[VALUES])
{
  const PetscReal(*row)[VALUES] = calibrated[symmetric];
  PetscReal t;

  for (PetscInt i = 0; i < ROWS - 2 && a > row[1][RADIUS]; i++) row++;
  t = PetscMax(0.0, PetscMin(1.0, (a - row[0][RADIUS]) / (row[1][RADIUS] - row[0][RADIUS])));
  for (int k = 0; k < VALUES; k++) value[k] = (1.0 - t) * row[0][k] + t * row[1][k];
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
  const PetscBool fitted = (PetscBool)(scene->pairing_retraction < 0.0 && scene->pairing_compliance < 0.0); /* the table's rows hold together */
  const PetscReal a      = radius / scene->h;
  PetscReal       value[VALUES];

  PetscFunctionBegin;
  Calibrated(a, (PetscBool)(scene->box_mirror != DLM_MIRROR_NONE), value);
  cover->degree = (PetscInt)scene->pairing_degree;
  if (scene->pairing_degree < 0.0)
    cover->degree = smooth && scene->pairing_retraction < 0.0 ? PetscMax(3, PetscMin(8, (PetscInt)(0.9 * a + 0.5))) : 0;
  cover->spacing    = scene->pairing_spacing >= 0.0 ? scene->pairing_spacing : (cover->degree ? 0.65 : 1.5);
  cover->retraction = scene->pairing_retraction >= 0.0 ? scene->pairing_retraction : (cover->degree ? value[RETRACTION] : point_retraction[scene->pairing_type]);
  CountPoints(a, cover);
  cover->compliance = cover->spin_compliance = cover->strain_compliance = 0.0;
  if (cover->degree > 0) { /* a coefficient of Q is traction over the density of points */
    const PetscReal r = radius - cover->retraction * scene->h, unit = scene->h / scene->fluid_viscosity * cover->n_points / (4.0 * PETSC_PI * r * r);
    cover->compliance        = unit * (scene->pairing_compliance >= 0.0 ? scene->pairing_compliance : value[COMPLIANCE]);
    cover->spin_compliance   = unit * (scene->pairing_spin_compliance != DLM_AUTO ? scene->pairing_spin_compliance : (fitted ? value[SPIN] : 0.0));
    cover->strain_compliance = unit * (scene->pairing_strain_compliance != DLM_AUTO ? scene->pairing_strain_compliance : (fitted ? value[STRAIN] : 0.0));
  }
  PetscFunctionReturn(0);
}

void DLMCoverComply(const DLMCover *cover, PetscReal scale, const PetscScalar *c, PetscScalar *y)
{
  static const int column[3] = { 2, 1, 3 }; /* of the harmonic x_d, in the order of DLMHarmonics */
  PetscScalar      first[3][3];             /* first moments: [d][i] of component i over x_d */

  if (cover->degree == 0) return;
  for (int d = 0; d < 3; d++)
    for (int i = 0; i < 3; i++) first[d][i] = scale * c[3 * column[d] + i];
  const PetscScalar mean = (first[0][0] + first[1][1] + first[2][2]) / 3.0;
  for (int d = 0; d < 3; d++)
    for (int i = 0; i < 3; i++) {
      const PetscScalar turn = 0.5 * (first[d][i] - first[i][d]), stretch = 0.5 * (first[d][i] + first[i][d]) - (d == i ? mean : 0.0);
      y[3 * column[d] + i] += cover->spin_compliance * turn + cover->strain_compliance * stretch;
    }
  for (PetscInt k = 3 * 4; k < 3 * (cover->degree + 1) * (cover->degree + 1); k++) y[k] += scale * cover->compliance * c[k];
}

/* Column k of DLMHarmonics belongs to a monomial x1^a x2^b x3^c; they are orthonormalised over points that are their own mirror image, so parities do not mix. */
static PetscInt PowerOfX2(PetscInt k)
{
  PetscInt l = 0, c;

  while ((l + 1) * (l + 1) <= k) l++;
  k -= l * l;
  c = k > l;
  return l - c - (c ? k - l - 1 : k);
}

void DLMCoverSymmetrise(const DLMCover *cover, PetscScalar *x)
{
  for (PetscInt k = 0; k < cover->n_multipliers; k++)
    for (int d = 0; d < 3; d++)
      if (PowerOfX2(k) % 2 != (d == 1)) x[3 * k + d] = 0.0;
}
