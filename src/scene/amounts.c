#include "../../include/private/amounts.h"

const char *DLMDurationText(double seconds, char text[32])
{
  const long s = (long)(PetscMin(seconds, 1e12) + 0.5), days = s / 86400;
  int        used = 0;

  if (days) used = snprintf(text, 32, "%ldd ", days);
  snprintf(text + used, 32 - (size_t)used, "%ld:%02ld:%02ld", s / 3600 % 24, s / 60 % 60, s % 60);
  return text;
}

const char *DLMSizeText(double bytes, char text[32])
{
  static const char *const units[] = { "bytes", "kB", "MB", "GB", "TB" };
  int                      k       = 0;

  for (; bytes >= 1000.0 && k < 4; k++) bytes /= 1000.0;
  snprintf(text, 32, "%.3g %s", bytes, units[k]);
  return text;
}
