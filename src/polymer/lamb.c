#include <math.h>
#include <string.h>
#include "../../include/private/lamb.h"

/* H is the product of the linear forms p.x of one to three vectors p at right angles to each other: a solid harmonic, and every one is a sum of such. */
typedef struct {
  int    degree;
  double p[3][3];
} Harmonic;

static const Harmonic harmonics[] = {
  { 1, { { 1, 0, 0 } } },
  { 1, { { 0, 1, 0 } } },
  { 1, { { 0, 0, 1 } } },
  { 2, { { 1, 0, 0 }, { 0, 1, 0 } } },
  { 2, { { 0, 1, 0 }, { 0, 0, 1 } } },
  { 2, { { 0, 0, 1 }, { 1, 0, 0 } } },
  { 2, { { 1, 1, 0 }, { 1, -1, 0 } } },
  { 2, { { 0, 1, 1 }, { 0, 1, -1 } } },
  { 3, { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } } },
  { 3, { { 1, 0, 0 }, { 0, 1, 1 }, { 0, 1, -1 } } },
  { 3, { { 0, 1, 0 }, { 1, 0, 1 }, { 1, 0, -1 } } },
  { 3, { { 0, 0, 1 }, { 1, 1, 0 }, { 1, -1, 0 } } },
  { 3, { { 1, 2, 2 }, { 2, 1, -2 }, { 2, -2, 1 } } },
  { 3, { { 2, 1, 2 }, { -2, 2, 1 }, { 1, 2, -2 } } },
  { 3, { { 2, 2, 1 }, { 1, -2, 2 }, { -2, 1, 2 } } },
};

/* Polynomials f and g in s = 1/r: coefficients of s^-2 to s^9. */
enum { FIRST = -2, TERMS = 12 };
typedef struct {
  int    harmonic, n, turns; /* the harmonics it goes through; A = grad H x x */
  double f[TERMS], g[TERMS];
} Family;

#define S(power) [(power) - FIRST]
static const Family families[] = {
  { 0, 3, 0, { S(0) = 1, S(1) = -3.0 / 4, S(3) = -1.0 / 4 }, { S(3) = -3.0 / 4, S(5) = 3.0 / 4 } },                                         /* uniform */
  { 0, 3, 1, { S(0) = 1, S(3) = -1 }, { 0 } },                                                                                               /* turning */
  { 3, 5, 0, { S(0) = 1, S(5) = -1 }, { S(5) = -5, S(7) = 5 } },                                                                /* straining */
  { 3, 5, 1, { S(0) = 1, S(5) = -1 }, { 0 } },                                                                                               /* twisting */
  { 8, 7, 0, { S(0) = 1, S(5) = 7.0 / 8, S(7) = -15.0 / 8 }, { S(7) = -105.0 / 8, S(9) = 105.0 / 8 } },                                      /* potential */
  { 0, 3, 0, { S(-2) = 1.0 / 5, S(1) = -1.0 / 8, S(3) = -3.0 / 40 }, { S(0) = -1.0 / 10, S(3) = -1.0 / 8, S(5) = 9.0 / 40 } }, /* by pressure */
};
#undef S

static double Dot(const double a[3], const double b[3])
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void Cross(const double a[3], const double b[3], double c[3])
{
  for (int i = 0; i < 3; i++) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* H, its gradient and its second derivatives at x. */
static double Evaluate(const Harmonic *harmonic, const double x[3], double d[3], double dd[3][3])
{
  const int n = harmonic->degree;
  double    form[3] = { 1.0, 1.0, 1.0 };

  memset(d, 0, 3 * sizeof(double));
  memset(dd, 0, 9 * sizeof(double));
  for (int k = 0; k < n; k++) form[k] = Dot(harmonic->p[k], x);
  for (int k = 0; k < n; k++) {
    const double others = form[(k + 1) % 3] * form[(k + 2) % 3];
    for (int i = 0; i < 3; i++) d[i] += harmonic->p[k][i] * others;
    for (int m = 0; m < n; m++)
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3 && m != k; j++) dd[i][j] += harmonic->p[k][i] * harmonic->p[m][j] * form[3 - k - m];
  }
  return form[0] * form[1] * form[2];
}

/* f(r), and f'(r)/r. */
static double Radial(const double f[TERMS], const double power[TERMS], double *slope)
{
  double sum = 0.0;

  *slope = 0.0;
  for (int t = 0; t < TERMS; t++) {
    sum += f[t] * power[t];
    *slope -= (FIRST + t) * f[t] * power[t];
  }
  *slope *= power[2 - FIRST];
  return sum;
}

static void Mode(const Family *family, const Harmonic *harmonic, const double x[3], const double power[TERMS], double u[3], double g[9])
{
  double       d[3], dd[3][3], A[3], dA[3][3], f_slope, g_slope; /* dA[j][i] = dA_i/dx_j */
  const double H = Evaluate(harmonic, x, d, dd), f = Radial(family->f, power, &f_slope), h = Radial(family->g, power, &g_slope);

  memcpy(A, d, sizeof(A));
  memcpy(dA, dd, sizeof(dA));
  if (family->turns) {
    Cross(d, x, A);
    for (int j = 0; j < 3; j++) {
      double fixed[3];
      Cross(dd[j], x, dA[j]);
      Cross(d, (double[3]){ j == 0, j == 1, j == 2 }, fixed);
      for (int i = 0; i < 3; i++) dA[j][i] += fixed[i];
    }
  }
  for (int i = 0; i < 3; i++) {
    u[i] = f * A[i] + h * x[i] * H;
    for (int j = 0; j < 3 && g; j++) g[3 * i + j] = f * dA[j][i] + h * ((i == j) * H + x[i] * d[j]) + x[j] * (f_slope * A[i] + g_slope * x[i] * H);
  }
}

void DLMLambModes(const double x[3], double u[DLM_LAMB_MODES][3], double g[DLM_LAMB_MODES][9])
{
  const double s = 1.0 / sqrt(Dot(x, x));
  double       power[TERMS];
  int          mode = 0;

  power[0] = 1.0 / (s * s);
  for (int t = 1; t < TERMS; t++) power[t] = power[t - 1] * s;
  for (size_t k = 0; k < sizeof(families) / sizeof(*families); k++)
    for (int m = 0; m < families[k].n; m++, mode++) Mode(&families[k], &harmonics[families[k].harmonic + m], x, power, u[mode], g ? g[mode] : NULL);
}
