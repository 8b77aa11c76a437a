#ifndef DLM_AMOUNTS_H
#define DLM_AMOUNTS_H

#include <petscsys.h>

/* Amounts as people read them: "2d 3:04:05", "1.2 GB". They return text. */
PETSC_INTERN const char *DLMDurationText(double seconds, char text[32]);
PETSC_INTERN const char *DLMSizeText(double bytes, char text[32]);
#endif
