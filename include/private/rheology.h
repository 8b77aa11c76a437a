/*
  The table of viscoelastic models: pointwise functions on n nodes, plain C. A new model (FENE-P, FENE-CR, ...) is one file with its functions and
  one line in the table of src/polymer/rheology.c.
*/
#ifndef DLM_RHEOLOGY_H
#define DLM_RHEOLOGY_H

#include "../dlmscene.h"

typedef struct {
  DLMFluidModel model;
  const char   *name;
  /*
    solvent and polymer viscosity at the shear rate sqrt(2 D:D); NULL: constant, eta1 lambda2/lambda1 and the rest.
  */
  void (*viscosity)(const DLMScene *fluid, long n, const double *rate, double *solvent, double *polymer);
  /*
    a and b of node x from the trace of C, in  stress = (eta/lambda1)(a C - b I)  and  relaxation = -(a C - b I)/lambda1; NULL: a = b = 1.
  */
  void (*spring)(const DLMScene *fluid, long n, const double *trace, double *a, double *b);
} DLMRheology;

/* The model of a scene; NULL: Newtonian. */
const DLMRheology *DLMRheologyFind(DLMFluidModel model);
/* carreau.c: viscosities of the shear-thinning Oldroyd-B fluid (thesis 3.3.73) */
void DLMCarreauViscosity(const DLMScene *fluid, long n, const double *rate, double *solvent, double *polymer);
#endif
