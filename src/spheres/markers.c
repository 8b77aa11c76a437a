#include "../../include/private/markers.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/*
  Surface points come in orbits of the pyritohedral group (cyclic permutations and all sign changes, 24 elements): 6 points on the axes, 8 on
  the diagonals, 12 on the coordinate planes, or 24. So the set is its own mirror image in every plane, in the centre and under the
  permutations of the mesh, and its second moment is isotropic.
*/
enum { AXES = 6, DIAGONALS = 8, PLANES = 12, GENERAL = 24 };

static const int specials[8][3] = { { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 }, { 1, 1, 0 }, { 1, 0, 1 }, { 0, 1, 1 }, { 1, 1, 1 } };

static int SpecialCount(int k)
{
  return AXES * specials[k][0] + DIAGONALS * specials[k][1] + PLANES * specials[k][2];
}

/* Nearest number of points that orbits can make up, and which special orbits it takes. */
static int NearestCount(double n, int *special)
{
  int best = 0;

  for (int k = 0; k < 8; k++) {
    const int general = (int)fmax(0.0, floor((n - SpecialCount(k)) / GENERAL + 0.5)), count = GENERAL * general + SpecialCount(k);
    if (count < 12 || (best && fabs(count - n) >= fabs(best - n))) continue;
    best     = count;
    *special = k;
  }
  return best;
}

int DLMSurfaceCount(double r, double spacing)
{
  int special;

  return NearestCount(fmax(12.0, 4.0 * M_PI * r * r / (spacing * spacing)), &special);
}

/* Writes the orbit of a generator of the given size. */
static void FillOrbit(int size, const double g[3], double *x)
{
  int n = 0;

  for (int c = 0; c < (size == DIAGONALS ? 1 : 3); c++)
    for (int sign = 0; sign < 8; sign++) {
      double p[3];
      int    repeated = 0;
      for (int d = 0; d < 3; d++) {
        p[(d + c) % 3] = (sign >> d) & 1 ? -g[d] : g[d];
        repeated |= ((sign >> d) & 1) && g[d] == 0.0;
      }
      if (repeated) continue;
      for (int d = 0; d < 3; d++) x[3 * n + d] = p[d];
      n++;
    }
}

/* Tangential repulsion on point i from all others; returns its share of the energy. */
static double Repulsion(int n, const double *x, int i, double force[3])
{
  double radial = 0.0, energy = 0.0;

  force[0] = force[1] = force[2] = 0.0;
  for (int k = 0; k < n; k++) {
    double d[3], r2 = 0.0;
    if (k == i) continue;
    for (int c = 0; c < 3; c++) {
      d[c] = x[3 * i + c] - x[3 * k + c];
      r2 += d[c] * d[c];
    }
    r2 = fmax(r2, 1e-6);
    energy += 1.0 / sqrt(r2);
    for (int c = 0; c < 3; c++) force[c] += d[c] / (r2 * sqrt(r2));
  }
  for (int c = 0; c < 3; c++) radial += force[c] * x[3 * i + c];
  for (int c = 0; c < 3; c++) force[c] -= radial * x[3 * i + c];
  return energy;
}

static void Normalise(double g[3])
{
  const double norm = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);

  for (int c = 0; c < 3; c++) g[c] /= norm;
}

/* Lets the generators drift apart; x holds the orbits one after the other. Returns the energy. */
static double Relax(int n_orbits, const int *size, int n, double *x, int sweeps)
{
  double energy = 0.0;

  for (int s = 0; s <= sweeps; s++) {
    energy = 0.0;
    for (int o = 0, at = 0; o < n_orbits; at += size[o++]) {
      double force[3], g[3];
      energy += size[o] * Repulsion(n, x, at, force);
      if (s == sweeps || size[o] == AXES || size[o] == DIAGONALS) continue;
      for (int c = 0; c < 3; c++) g[c] = x[3 * at + c] + 0.35 / pow(n, 1.5) * force[c]; /* n points repel with stiffness ~ n^(3/2) */
      if (size[o] == PLANES) g[0] = 0.0;
      Normalise(g);
      FillOrbit(size[o], g, x + 3 * at);
    }
  }
  return energy;
}

/* A start for orbit o of a given size: fixed special generators, general ones by the caller. */
static void FillSpecial(int size, double *x)
{
  double g[3] = { size == PLANES ? 0.0 : 1.0, size == AXES ? 0.0 : 1.0, size == AXES ? 0.0 : (size == PLANES ? 0.6 : 1.0) };

  Normalise(g);
  FillOrbit(size, g, x);
}

/* Points of a spiral over the whole sphere that fall into one cell of the group (x >= y, x >= z, all >= 0); returns how many. */
static int SpiralCell(int n, int most, double *g)
{
  int found = 0;

  for (int i = 0; i < n; i++) {
    const double z = 1.0 - (2.0 * i + 1.0) / n, r = sqrt(1.0 - z * z), phi = M_PI * (3.0 - sqrt(5.0)) * i;
    const double p[3] = { r * cos(phi), r * sin(phi), z };
    if (p[1] <= 0.0 || p[2] <= 0.0 || p[0] < p[1] || p[0] < p[2]) continue;
    if (found < most)
      for (int c = 0; c < 3; c++) g[3 * found + c] = p[c];
    found++;
  }
  return found;
}

/* Generators of the general orbits: from a spiral with the right number of points in the cell (start 0), else scattered. */
static void Start(int start, int n_general, unsigned *seed, double *g)
{
  int found = -1;

  for (int n = GENERAL * n_general - 40; start == 0 && n < GENERAL * n_general + 60; n++)
    if (n > 0 && SpiralCell(n, 0, g) == n_general) {
      found = SpiralCell(n, n_general, g);
      break;
    }
  for (int i = 0; found != n_general && i < n_general; i++) {
    for (int c = 0; c < 3; c++) {
      *seed        = 1664525u * *seed + 1013904223u;
      g[3 * i + c] = 0.05 + (*seed >> 8) / 16777216.0;
    }
    Normalise(g + 3 * i);
  }
}

/* Relaxes n points from several starts and keeps those of the least energy. */
static void FindPoints(int n, double *x)
{
  int      special, n_orbits = 0, *size = malloc(sizeof(int) * (n / GENERAL + 4));
  double  *trial = malloc(sizeof(double) * 3 * n), *g = malloc(sizeof(double) * (3 * (n / GENERAL) + 3)), best = INFINITY;
  unsigned seed  = 1;

  NearestCount(n, &special);
  for (int left = n - SpecialCount(special); left > 0; left -= GENERAL) size[n_orbits++] = GENERAL;
  const int n_general = n_orbits;
  if (specials[special][0]) size[n_orbits++] = AXES;
  if (specials[special][1]) size[n_orbits++] = DIAGONALS;
  if (specials[special][2]) size[n_orbits++] = PLANES;
  /* about 10^7 pair evaluations, shared between starts and sweeps */
  const double pairs  = (double)n_orbits * n;
  const int    sweeps = (int)fmax(40.0, fmin(600.0, 4e6 / pairs)), starts = (int)fmax(1.0, fmin(24.0, 1e7 / (pairs * sweeps)));
  for (int s = 0; s < starts; s++) {
    Start(s, n_general, &seed, g);
    for (int o = 0, at = 0; o < n_orbits; at += size[o++]) {
      if (o < n_general) FillOrbit(GENERAL, g + 3 * o, trial + 3 * at);
      else FillSpecial(size[o], trial + 3 * at);
    }
    const double energy = Relax(n_orbits, size, n, trial, sweeps);
    if (energy >= best) continue;
    best = energy;
    for (int i = 0; i < 3 * n; i++) x[i] = trial[i];
  }
  free(trial);
  free(g);
  free(size);
}

/* Relaxation takes a tenth of a second, so the sets found so far are kept, for as long as the program runs. */
void DLMSurfacePoints(int n, double *x)
{
  enum { MOST = 64 };
  static struct {
    int     n;
    double *x;
  } kept[MOST];
  static int n_kept = 0;
  int        k      = 0;

  while (k < n_kept && kept[k].n != n) k++;
  if (k == n_kept) {
    FindPoints(n, x);
    if (n_kept == MOST || !(kept[k].x = malloc(sizeof(double) * 3 * n))) return;
    kept[n_kept++].n = n;
    memcpy(kept[k].x, x, sizeof(double) * 3 * n);
  }
  memcpy(x, kept[k].x, sizeof(double) * 3 * n);
}

/* Takes the components along the columns before out of a column, twice; returns its remaining norm. */
static double Orthogonalise(int n, int columns, double *Q)
{
  double *q = Q + (long)columns * n, norm = 0.0;

  for (int pass = 0; pass < 2; pass++)
    for (int c = 0; c < columns; c++) {
      double dot = 0.0;
      for (int i = 0; i < n; i++) dot += Q[(long)c * n + i] * q[i];
      for (int i = 0; i < n; i++) q[i] -= dot * Q[(long)c * n + i];
    }
  for (int i = 0; i < n; i++) norm += q[i] * q[i];
  return sqrt(norm);
}

int DLMHarmonics(int n, const double *x, int degree, double *Q)
{
  int columns = 0;

  /* monomials of degree l restricted to the sphere, z at most once: they span the harmonics of degree l beyond the lower ones */
  for (int l = 0; l <= degree; l++)
    for (int c = 0; c < 2; c++)
      for (int a = 0; a <= l - c && columns < n; a++) {
        double *q = Q + (long)columns * n, size = 0.0, rest;
        for (int i = 0; i < n; i++) {
          q[i] = pow(x[3 * i], a) * pow(x[3 * i + 1], l - c - a) * (c ? x[3 * i + 2] : 1.0);
          size += q[i] * q[i];
        }
        rest = Orthogonalise(n, columns, Q);
        if (rest < 1e-6 * sqrt(size)) continue;
        for (int i = 0; i < n; i++) q[i] /= rest;
        columns++;
      }
  return columns;
}
