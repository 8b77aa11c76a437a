/* The friction of one gap, on plain arrays (docs/theory.md, L1 to L5). */
#include "../../include/dlmlubrication.h"

static PetscReal Dot(const PetscReal x[3], const PetscReal y[3])
{
  return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
}

static void Cross(const PetscReal x[3], const PetscReal y[3], PetscReal z[3])
{
  for (int c = 0; c < 3; c++) z[c] = x[(c + 1) % 3] * y[(c + 2) % 3] - x[(c + 2) % 3] * y[(c + 1) % 3];
}

/* (L4) The gap that the mesh makes of a gap: (gap^power + width^power)^(1/power). Measured (docs/close_pairs.md). */
typedef struct {
  PetscReal per_h, per_reduced, power; /* width over h and over the reduced radius */
} Measured;

typedef struct {
  PetscReal width, power;
} Seen;

enum { NORMAL, SLIDE, ROLL, KINDS };

static const Measured seen_by_pair[KINDS] = { { 0.457, 0.102, 1.67 }, { 0.245, 0.0, 1.38 }, { 0.316, 0.039, 1.34 } };
static const Measured seen_by_wall[KINDS] = { { 0.181, 0.060, 2.34 }, { 0.159, 0.0, 1.37 }, { 0.210, 0.012, 1.46 } };

static PetscReal SeenGap(Seen seen, PetscReal gap)
{
  return PetscPowReal(PetscPowReal(gap, seen.power) + PetscPowReal(seen.width, seen.power), 1.0 / seen.power);
}

/* What the mesh misses of 1/gap and of log(1/gap), zero from the range on. */
static PetscReal MissingPole(Seen seen, PetscReal gap, PetscReal range)
{
  return 1.0 / gap - 1.0 / SeenGap(seen, gap) - (1.0 / range - 1.0 / SeenGap(seen, range));
}

static PetscReal MissingLog(Seen seen, PetscReal gap, PetscReal range)
{
  return PetscLogReal(SeenGap(seen, gap) / gap) - PetscLogReal(SeenGap(seen, range) / range);
}

/* Narrower gaps (and overlaps) count as this one, in reduced radii. */
static const PetscReal narrowest = 1e-5;

/* (L3) The factors of the singular terms (Jeffrey and Onishi 1984); sliding and rolling are coupled for unequal radii only. */
void DLMGapSetFriction(PetscReal viscosity, PetscReal h, PetscReal radius, PetscReal other, PetscReal range, DLMGap *gap)
{
  const Measured *measured = other > 0.0 ? seen_by_pair : seen_by_wall;
  const PetscReal k = other > 0.0 ? radius / other : 0.0, k1 = 1.0 + k, reduced = radius / k1, scale = PETSC_PI * viscosity;
  const PetscReal pole = 6.0 * reduced * reduced, squeeze = 6.0 / 5.0 * radius * (k * k + 7.0 * k + 1.0) / (k1 * k1 * k1);
  const PetscReal slide = 8.0 / 5.0 * radius * (2.0 * k * k + k + 2.0) / (k1 * k1 * k1);
  const PetscReal couple = 4.0 / 5.0 * radius * radius * (4.0 * k + 1.0) / (k1 * k1) - radius * slide;
  const PetscReal roll = 16.0 / 5.0 * radius * radius * radius / k1 - radius * radius * slide - 2.0 * radius * couple;
  const PetscReal width = PetscMax(gap->width, narrowest * reduced);

  gap->normal = gap->slide = gap->couple = gap->roll = 0.0;
  if (width >= range) return;
  Seen seen[KINDS];
  for (int kind = 0; kind < KINDS; kind++) seen[kind] = (Seen){ measured[kind].per_h * h + measured[kind].per_reduced * reduced, measured[kind].power };
  const PetscReal sliding = MissingLog(seen[SLIDE], width, range), rolling = MissingLog(seen[ROLL], width, range);
  gap->normal = scale * (pole * MissingPole(seen[NORMAL], width, range) + squeeze * MissingLog(seen[NORMAL], width, range));
  gap->slide  = scale * slide * sliding;
  gap->roll   = scale * roll * rolling;
  gap->couple = scale * couple * PetscMin(rolling, 1.6 * PetscSqrtReal(sliding * rolling)); /* at most 1.63: couple^2 <= slide roll */
}

/* (L2) Velocity of i relative to j at the point of the gap, and relative rotation; (L3) force and couple on i. */
void DLMGapAddLoads(const DLMGap *gap, const PetscReal Ui[6], const PetscReal *Uj, PetscReal load_i[6], PetscReal *load_j)
{
  const PetscReal *e = gap->e;
  PetscReal        w[3], turn[3], spin[3], turn_e[3], e_w[3], e_force[3], force[3], along, about;

  for (int c = 0; c < 3; c++) {
    spin[c] = gap->arm[0] * Ui[3 + c] + (gap->j < 0 ? 0.0 : gap->arm[1] * Uj[3 + c]);
    turn[c] = Ui[3 + c] - (gap->j < 0 ? 0.0 : Uj[3 + c]);
  }
  Cross(spin, e, w);
  for (int c = 0; c < 3; c++) w[c] += Ui[c] - (gap->j < 0 ? gap->wall[c] : Uj[c]);
  along = Dot(w, e);
  about = Dot(turn, e);
  Cross(turn, e, turn_e);
  Cross(e, w, e_w);
  for (int c = 0; c < 3; c++) force[c] = -gap->normal * along * e[c] - gap->slide * (w[c] - along * e[c]) - gap->couple * turn_e[c];
  Cross(e, force, e_force);
  for (int c = 0; c < 3; c++) {
    const PetscReal couple = -gap->couple * e_w[c] - gap->roll * (turn[c] - about * e[c]);
    load_i[c] += force[c];
    load_i[3 + c] += gap->arm[0] * e_force[c] + couple;
    if (gap->j < 0) continue;
    load_j[c] -= force[c];
    load_j[3 + c] += gap->arm[1] * e_force[c] - couple;
  }
}

void DLMGapMatrix(const DLMGap *gap, PetscReal matrix[144])
{
  DLMGap still = *gap;

  for (int c = 0; c < 3; c++) still.wall[c] = 0.0;
  for (int k = 0; k < 144; k++) matrix[k] = 0.0;
  for (int c = 0; c < (gap->j < 0 ? 6 : 12); c++) {
    PetscReal U[12] = { 0.0 }, load[12] = { 0.0 };
    U[c] = 1.0;
    DLMGapAddLoads(&still, U, U + 6, load, load + 6);
    for (int r = 0; r < 12; r++) matrix[12 * r + c] = -load[r];
  }
}
