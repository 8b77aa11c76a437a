/*
  The rigid motions' matrix of the constraint preconditioner, W = R^T S^-1 R + M/dt + Z (docs/theory.md, B3 and L6): dense in a block. The friction
  of a gap whose spheres are in different blocks (a cut gap) couples them; W is then solved by conjugate gradients to rounding, since the
  preconditioner must keep the force balance exactly. Without the cut gaps W is its preconditioner, so every cut gap costs a few iterations at most.
*/
#include "../../include/private/saddleimpl.h"
#include <petscblaslapack.h>

static PetscInt PlaceInBlock(const DLMBlock *b, PetscInt sphere)
{
  for (PetscInt s = 0; s < b->n_spheres; s++)
    if (b->spheres[s] == sphere) return s;
  return -1;
}

/* Adds the friction of the block's own gaps to W. */
static void AddFriction(const DLMBlocks *blocks, DLMBlock *b)
{
  const PetscInt m = 6 * b->n_spheres;

  for (PetscInt g = 0; g < blocks->lubrication->n; g++) {
    const DLMGap  *gap = &blocks->lubrication->gaps[g];
    const PetscInt place[2] = { PlaceInBlock(b, gap->i), gap->j < 0 ? 0 : PlaceInBlock(b, gap->j) };
    PetscReal      Z[144];
    if (gap->cut || place[0] < 0) continue;
    DLMGapMatrix(gap, Z);
    for (int r = 0; r < (gap->j < 0 ? 6 : 12); r++)
      for (int c = 0; c < (gap->j < 0 ? 6 : 12); c++) {
        if (DLMRigidHeld(blocks->scene, r < 6 ? gap->i : gap->j, r % 6) || DLMRigidHeld(blocks->scene, c < 6 ? gap->i : gap->j, c % 6)) continue;
        b->W[(6 * place[c / 6] + c % 6) * m + 6 * place[r / 6] + r % 6] += Z[12 * r + c];
      }
  }
}

PetscErrorCode DLMBlockBuildRigid(const DLMBlocks *blocks, DLMBlock *b, PetscReal inertia_weight)
{
  const PetscInt m = 6 * b->n_spheres;
  PetscBLASInt   size = (PetscBLASInt)m, info;

  PetscFunctionBegin;
  for (PetscInt j = 0; j < m; j++)
    for (PetscInt i = 0; i < m; i++) {
      PetscReal sum = 0.0;
      for (PetscInt k = 0; k < b->n; k++) sum += b->R[i * b->n + k] * b->Y[j * b->n + k];
      b->W[j * m + i] = sum;
    }
  for (PetscInt s = 0; s < b->n_spheres; s++) {
    PetscReal mass[6];
    DLMRigidMass(blocks->scene, b->spheres[s], inertia_weight, mass);
    for (int c = 0; c < 6; c++) b->W[(6 * s + c) * (m + 1)] += mass[c];
  }
  AddFriction(blocks, b);
  LAPACKpotrf_("L", &size, b->W, &size, &info);
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "The rigid-motion block of sphere %" PetscInt_FMT " is not positive definite", b->spheres[0]);
  PetscFunctionReturn(0);
}

/* x <- W^-1 x, cut gaps apart, on the rigid motions of all blocks one after the other. */
static void SolveBlocks(const DLMBlocks *blocks, PetscReal *x)
{
  for (PetscInt k = 0; k < blocks->n; k++) {
    PetscBLASInt m = (PetscBLASInt)(6 * blocks->block[k].n_spheres), unit = 1, info;
    LAPACKpotrs_("L", &m, &unit, blocks->block[k].W, &m, x, &m, &info);
    x += m;
  }
}

/* y <- W x with the cut gaps. all: work, 12 per sphere of the scene. */
static PetscErrorCode Multiply(const DLMBlocks *blocks, PetscInt n, const PetscReal *x, PetscReal *y, PetscReal *all)
{
  const PetscInt total = 6 * blocks->scene->n_spheres;
  PetscReal     *load = all + total;
  PetscInt       at = 0;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(all, 2 * total));
  PetscCall(PetscArraycpy(y, x, n));
  for (PetscInt k = 0; k < blocks->n; k++) {
    const DLMBlock *b = &blocks->block[k];
    PetscBLASInt    m = (PetscBLASInt)(6 * b->n_spheres), unit = 1;
    for (PetscInt i = 0; i < m; i++)
      if (!DLMRigidHeld(blocks->scene, b->spheres[i / 6], i % 6)) all[6 * b->spheres[i / 6] + i % 6] = x[at + i];
    BLAStrmv_("L", "T", "N", &m, b->W, &m, y + at, &unit);
    BLAStrmv_("L", "N", "N", &m, b->W, &m, y + at, &unit);
    at += m;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, all, (PetscMPIInt)total, MPIU_REAL, MPI_SUM, blocks->scene->comm));
  for (PetscInt g = 0; g < blocks->lubrication->n; g++) {
    const DLMGap *gap = &blocks->lubrication->gaps[g];
    if (gap->cut) DLMGapAddLoads(gap, all + 6 * gap->i, all + 6 * gap->j, load + 6 * gap->i, load + 6 * gap->j);
  }
  at = 0;
  for (PetscInt k = 0; k < blocks->n; k++)
    for (PetscInt i = 0; i < 6 * blocks->block[k].n_spheres; i++, at++)
      if (!DLMRigidHeld(blocks->scene, blocks->block[k].spheres[i / 6], i % 6)) y[at] -= load[6 * blocks->block[k].spheres[i / 6] + i % 6];
  PetscFunctionReturn(0);
}

static PetscErrorCode Product(const DLMBlocks *blocks, PetscInt n, const PetscReal *x, const PetscReal *y, PetscReal *sum)
{
  PetscFunctionBegin;
  *sum = 0.0;
  for (PetscInt i = 0; i < n; i++) *sum += x[i] * y[i];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 1, MPIU_REAL, MPI_SUM, blocks->scene->comm));
  PetscFunctionReturn(0);
}

/* Conjugate gradients: x <- W^-1 r; r, z, p, q: work, r is used up. */
static PetscErrorCode SolveCut(const DLMBlocks *blocks, PetscInt n, PetscReal *x, PetscReal *r, PetscReal *work, PetscReal *all)
{
  const PetscReal rtol = 1e-13;
  const PetscInt  most = 50 + 10 * blocks->n_cut;
  PetscReal      *z = work, *p = work + n, *q = work + 2 * n, rz, first, pq, last;

  PetscFunctionBegin;
  PetscCall(PetscArrayzero(x, n));
  PetscCall(PetscArraycpy(z, r, n));
  SolveBlocks(blocks, z);
  PetscCall(PetscArraycpy(p, z, n));
  PetscCall(Product(blocks, n, r, z, &rz));
  first = rz;
  for (PetscInt it = 0; it < most && rz > rtol * rtol * first; it++) {
    PetscCall(Multiply(blocks, n, p, q, all));
    PetscCall(Product(blocks, n, p, q, &pq));
    for (PetscInt i = 0; i < n; i++) {
      x[i] += rz / pq * p[i];
      r[i] -= rz / pq * q[i];
    }
    PetscCall(PetscArraycpy(z, r, n));
    SolveBlocks(blocks, z);
    last = rz;
    PetscCall(Product(blocks, n, r, z, &rz));
    for (PetscInt i = 0; i < n; i++) p[i] = z[i] + rz / last * p[i];
  }
  PetscFunctionReturn(0);
}

/* Rigid motions between the gathered vector and one that holds them alone. */
static void Move(const DLMBlocks *blocks, PetscReal *alone, PetscBool take)
{
  for (PetscInt k = 0; k < blocks->n; k++) {
    PetscReal *U = blocks->gathered + blocks->block[k].start + blocks->block[k].n;
    for (PetscInt i = 0; i < 6 * blocks->block[k].n_spheres; i++, alone++) *(take ? alone : &U[i]) = take ? U[i] : *alone;
  }
}

PetscErrorCode DLMBlocksSolveRigid(DLMBlocks *blocks)
{
  PetscInt   n = 0;
  PetscReal *x, *r, *work, *all;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < blocks->n; k++) n += 6 * blocks->block[k].n_spheres;
  PetscCall(PetscMalloc4(n, &x, n, &r, 3 * n, &work, 12 * blocks->scene->n_spheres, &all));
  Move(blocks, r, PETSC_TRUE);
  if (blocks->n_cut) {
    PetscCall(SolveCut(blocks, n, x, r, work, all));
    Move(blocks, x, PETSC_FALSE);
  } else {
    SolveBlocks(blocks, r);
    Move(blocks, r, PETSC_FALSE);
  }
  PetscCall(PetscFree4(x, r, work, all));
  PetscFunctionReturn(0);
}
