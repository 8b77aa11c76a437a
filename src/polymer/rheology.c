#include "../../include/private/rheology.h"

static const DLMRheology models[] = {
  { DLM_FLUID_OLDROYD_B, "oldroyd_b", NULL, NULL },
  { DLM_FLUID_UCM, "ucm", NULL, NULL },
  { DLM_FLUID_CARREAU, "carreau", DLMCarreauViscosity, NULL },
};

const DLMRheology *DLMRheologyFind(DLMFluidModel model)
{
  for (size_t k = 0; k < sizeof(models) / sizeof(models[0]); k++)
    if (models[k].model == model) return &models[k];
  return NULL;
}
