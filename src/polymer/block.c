#include "../../include/private/polymerimpl.h"

void DLMPolymerLines(DLMPolymer p, DLMLineVisit visit, void *context)
{
  const DLMPolymerBlock *b = &p->block;
  const PetscInt         cells = p->grid->cells[0];

  for (PetscInt k = 0; k < b->width[2]; k++)
    for (PetscInt j = 0; j < b->width[1]; j++) {
      const int      place[2] = { DLMGridPlace(p->grid, 1, b->start[1] + j, p->grid->cells[1]), DLMGridPlace(p->grid, 2, b->start[2] + k, p->grid->cells[2]) };
      const PetscInt own      = b->width[0] * (j + b->width[1] * k);
      const PetscInt ghost    = (b->start[0] - b->ghost_start[0]) + b->stride[1] * (b->start[1] - b->ghost_start[1] + j) +
                             b->stride[2] * (b->start[2] - b->ghost_start[2] + k);
      for (PetscInt i = 0, n; i < b->width[0]; i += n) {
        const int       first = DLMGridPlace(p->grid, 0, b->start[0] + i, cells);
        const PetscBool wall  = (PetscBool)(first != DLM_INNER || place[0] != DLM_INNER || place[1] != DLM_INNER);
        n                     = 1;
        if (first == DLM_INNER)
          while (i + n < b->width[0] && DLMGridPlace(p->grid, 0, b->start[0] + i + n, cells) == DLM_INNER) n++;
        visit(p, &p->rows[first + 3 * place[0] + 9 * place[1]], own + i, ghost + i, n, wall, context);
      }
    }
}

PetscErrorCode DLMPolymerExchange(DLMPolymer p, double *const owned[6], double *const ghosted[6])
{
  PetscFunctionBegin;
  for (int k = 0; k < 6; k++) {
    PetscCall(VecPlaceArray(p->owned, owned[k]));
    PetscCall(VecPlaceArray(p->local, ghosted[k]));
    PetscCall(DLMGridGlobalToLocal(p->grid, p->dm, DLMMirrorTensor + k, p->owned, p->local));
    PetscCall(VecResetArray(p->local));
    PetscCall(VecResetArray(p->owned));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerCheckOut(DLMPolymer p)
{
  PetscFunctionBegin;
  PetscCall(VecGetArray(p->C, &p->c[0]));
  for (int k = 1; k < 6; k++) p->c[k] = p->c[0] + (size_t)k * p->block.n;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerCheckIn(DLMPolymer p)
{
  PetscFunctionBegin;
  PetscCall(VecRestoreArray(p->C, &p->c[0]));
  PetscFunctionReturn(0);
}

static PetscErrorCode FillBlock(DLMPolymer p)
{
  DLMPolymerBlock *b = &p->block;

  PetscFunctionBegin;
  PetscCall(DMDAGetCorners(p->dm, &b->start[0], &b->start[1], &b->start[2], &b->width[0], &b->width[1], &b->width[2]));
  PetscCall(DMDAGetGhostCorners(p->dm, &b->ghost_start[0], &b->ghost_start[1], &b->ghost_start[2], &b->ghost_width[0], &b->ghost_width[1], &b->ghost_width[2]));
  b->n         = b->width[0] * b->width[1] * b->width[2];
  b->stride[0] = 1;
  b->stride[1] = b->ghost_width[0];
  b->stride[2] = b->ghost_width[0] * (long)b->ghost_width[1];
  b->n_ghosted = b->stride[2] * b->ghost_width[2];
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateArrays(DLMPolymer p)
{
  const PetscInt n = p->block.n, m = p->block.n_ghosted;
  Vec            u;

  PetscFunctionBegin;
  PetscCall(VecCreateMPI(p->grid->comm, 6 * n, PETSC_DETERMINE, &p->C));
  PetscCall(PetscObjectSetName((PetscObject)p->C, "conformation"));
  PetscCall(VecCreateMPIWithArray(p->grid->comm, 1, n, PETSC_DETERMINE, NULL, &p->owned));
  PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, m, NULL, &p->local));
  PetscCall(PetscCalloc6(9 * (size_t)n, &p->gradient[0], 9 * (size_t)n, &p->gradient[1], 15 * (size_t)m, &p->ghosted, 4 * (size_t)n, &p->scratch,
                         3 * p->block.ghost_width[0], &p->line, m, &p->inside));
  DLMPolymerTurnGradient(p);
  for (int k = 0; k < 6; k++) p->t[k] = p->ghosted + (size_t)k * m;
  for (int k = 0; k < 6; k++) p->r[k] = p->ghosted + (size_t)(6 + k) * m;
  for (int k = 0; k < 3; k++) p->u[k] = p->ghosted + (size_t)(12 + k) * m;
  PetscCall(DMGetGlobalVector(p->grid->velocity, &u));
  PetscCall(VecDuplicate(u, &p->force.now));
  PetscCall(VecDuplicate(u, &p->force.before));
  PetscCall(VecDuplicate(u, &p->force.spare));
  PetscCall(DMRestoreGlobalVector(p->grid->velocity, &u));
  PetscFunctionReturn(0);
}

/* C = I + amplitude sin(2 pi number x3/L3) (e_i e_j + e_j e_i) */
static PetscErrorCode SetStart(DLMPolymer p)
{
  static const int       component[] = { [DLM_PLANE_12] = 3, [DLM_PLANE_13] = 4, [DLM_PLANE_23] = 5 };
  const DLMPolymerBlock *b = &p->block;
  const DLMScene        *s = p->scene;

  PetscFunctionBegin;
  PetscCall(VecZeroEntries(p->C));
  PetscCall(DLMPolymerCheckOut(p));
  for (PetscInt x = 0; x < b->n; x++) {
    const PetscReal z = p->grid->lower[2] + p->grid->h * (b->start[2] + x / (b->width[0] * b->width[1]));
    for (int k = 0; k < 3; k++) p->c[k][x] = 1.0;
    p->c[component[s->polymer_mode_plane]][x] = s->polymer_mode_amplitude * PetscSinReal(2.0 * PETSC_PI * s->polymer_mode_number * z / s->box_size[2]);
  }
  PetscCall(DLMPolymerCheckIn(p));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerCreate(DLMGrid grid, DLMSpheres spheres, const DLMScene *scene, DLMPolymer *new_polymer)
{
  static const PetscReal offsets[] = { [DLM_INSIDE_EXTEND] = 0.75, [DLM_INSIDE_STOKES] = 0.1 }; /* calibrated (docs/theory.md, V7, V8) */
  DLMPolymer             p;

  PetscFunctionBeginUser;
  PetscCall(PetscNew(&p));
  p->grid    = grid;
  p->spheres = spheres;
  p->scene   = scene;
  p->implicit_viscosity = scene->implicit_viscosity;
  p->model   = DLMRheologyFind(scene->fluid_model);
  PetscCall(DLMGridCreateDM(grid, 1, DMDA_STENCIL_BOX, 1, &p->dm));
  PetscCall(FillBlock(p));
  DLMKuhnRowsFill(grid->h, p->rows);
  p->stress_offset = scene->polymer_stress_offset;
  if (p->stress_offset == DLM_AUTO) p->stress_offset = scene->polymer_coupling == DLM_COUPLING_BOTH_SIDES ? offsets[scene->polymer_inside] : 0.0;
  PetscCall(CreateArrays(p));
  PetscCall(PetscCalloc1(6 * scene->n_spheres, &p->inside_stress));
  for (int k = 0; k < 2 && spheres && scene->polymer_inside == DLM_INSIDE_STOKES; k++) PetscCall(PetscCalloc1(scene->n_spheres, &p->near_flow[k]));
  PetscCall(SetStart(p));
  p->health.sound = PETSC_TRUE;
  *new_polymer    = p;
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerDestroy(DLMPolymer *pointer)
{
  DLMPolymer p = *pointer;

  PetscFunctionBeginUser;
  if (!p) PetscFunctionReturn(0);
  PetscCall(VecDestroy(&p->force.now));
  PetscCall(VecDestroy(&p->force.before));
  PetscCall(VecDestroy(&p->force.spare));
  PetscCall(VecDestroy(&p->C));
  PetscCall(VecDestroy(&p->kept_C));
  PetscCall(VecDestroy(&p->owned));
  PetscCall(VecDestroy(&p->local));
  PetscCall(DMDestroy(&p->dm));
  PetscCall(PetscFree(p->parts));
  for (int k = 0; k < 2; k++) PetscCall(PetscFree(p->near_flow[k]));
  PetscCall(PetscFree(p->inside_stress));
  PetscCall(PetscFree6(p->gradient[0], p->gradient[1], p->ghosted, p->scratch, p->line, p->inside));
  PetscCall(PetscFree(*pointer));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMPolymerGetConformation(DLMPolymer p, Vec *C)
{
  PetscFunctionBeginUser;
  *C = p->C;
  PetscFunctionReturn(0);
}
