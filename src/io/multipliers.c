/* The points of the spheres' multipliers as part of a field output: gathered on rank 0, sphere by sphere. */
#include "../../include/private/gridimpl.h"
#include "../../include/private/outputimpl.h"

enum { WIDTH = 9 }; /* position, multiplier and traction of a point */

/* The points of this rank, in the order of its spheres. Traction of the fluid on the sphere: minus the multiplier over the area that a surface point stands for. */
static PetscErrorCode FillPoints(DLMSimulation sim, PetscInt n_owned, const PetscInt *owned, const PetscInt *first, const PetscReal *r, PetscReal *point)
{
  const PetscScalar *lambda;

  PetscFunctionBegin;
  PetscCall(DLMSaddleGetPointForces(sim->saddle, &lambda));
  for (PetscInt k = 0; k < n_owned; k++) {
    PetscReal center[3];
    DLMCover  cover;
    PetscCall(DLMPairingGetCover(sim->scene, sim->scene->spheres[owned[k]].radius, &cover));
    PetscCall(DLMSpheresGetWrapped(sim->spheres, owned[k], center));
    const PetscReal radius = sim->scene->spheres[owned[k]].radius - cover.retraction * sim->grid->h;
    for (PetscInt i = first[k]; i < first[k + 1]; i++) {
      const PetscReal density = i - first[k] < cover.n_points ? (PetscReal)cover.n_points / (4.0 * PETSC_PI * radius * radius) : 0.0;
      for (int d = 0; d < 3; d++) {
        point[WIDTH * i + d]     = center[d] + r[3 * i + d];
        point[WIDTH * i + 3 + d] = lambda[3 * i + d];
        point[WIDTH * i + 6 + d] = -density * lambda[3 * i + d];
      }
    }
  }
  PetscFunctionReturn(0);
}

/* place[2 i], place[2 i + 1]: rank that holds sphere i, and its number of points; the same on every rank. */
static PetscErrorCode FindPlaces(DLMSimulation sim, PetscInt n_owned, const PetscInt *owned, const PetscInt *first, PetscInt *place)
{
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(sim->scene->comm, &rank));
  PetscCall(PetscArrayzero(place, 2 * sim->scene->n_spheres));
  for (PetscInt k = 0; k < n_owned; k++) {
    place[2 * owned[k]]     = rank;
    place[2 * owned[k] + 1] = first[k + 1] - first[k];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, place, (PetscMPIInt)(2 * sim->scene->n_spheres), MPIU_INT, MPI_SUM, sim->scene->comm));
  PetscFunctionReturn(0);
}

/* Rank 0's n points, which came rank by rank, sphere by sphere into one array a quantity. start[r]: first point of rank r, used up. */
static PetscErrorCode WriteInOrder(DLMSimulation sim, DLMFieldFile file, PetscInt n, const PetscInt *place, PetscMPIInt *start, const PetscReal *all)
{
  PetscReal *x, *multiplier, *traction;
  int       *sphere;

  PetscFunctionBegin;
  PetscCall(PetscMalloc4(3 * n, &x, 3 * n, &multiplier, 3 * n, &traction, n, &sphere));
  for (PetscInt i = 0, q = 0; i < sim->scene->n_spheres; i++)
    for (PetscInt k = 0; k < place[2 * i + 1]; k++, q++) {
      const PetscReal *point = all + WIDTH * (size_t)start[place[2 * i]]++;
      sphere[q]              = (int)i;
      PetscCall(PetscArraycpy(x + 3 * q, point, 3));
      PetscCall(PetscArraycpy(multiplier + 3 * q, point + 3, 3));
      PetscCall(PetscArraycpy(traction + 3 * q, point + 6, 3));
    }
  const DLMPointArray arrays[] = { { "point", 3, x }, { "sphere", 0, sphere }, { "multiplier", 3, multiplier }, { "traction", 3, traction } };
  PetscCall(DLMFieldFileWritePoints(file, "multipliers", n, 4, arrays));
  PetscCall(PetscFree4(x, multiplier, traction, sphere));
  PetscFunctionReturn(0);
}

PetscErrorCode DLMMultipliersWrite(DLMSimulation sim, DLMFieldFile file)
{
  const PetscInt  *owned, *first;
  const PetscReal *r;
  PetscInt         n, n_owned, total = 0, *place;
  PetscReal       *mine, *all;
  PetscMPIInt      rank, size, *count, *start;
  MPI_Datatype     type;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(sim->scene->comm, &rank));
  PetscCallMPI(MPI_Comm_size(sim->scene->comm, &size));
  PetscCall(DLMSpheresGetOwned(sim->spheres, &n_owned, &owned));
  PetscCall(DLMPairingGetPoints(sim->pairing, &n, &r, &first));
  PetscCall(PetscCalloc3(size, &count, size, &start, 2 * sim->scene->n_spheres, &place));
  PetscCall(FindPlaces(sim, n_owned, owned, first, place));
  for (PetscInt i = 0; i < sim->scene->n_spheres; i++) count[place[2 * i]] += (PetscMPIInt)place[2 * i + 1];
  for (PetscMPIInt p = 0; p < size; total += count[p++]) start[p] = (PetscMPIInt)total;
  PetscCall(PetscMalloc2(WIDTH * (size_t)n, &mine, rank ? 0 : WIDTH * (size_t)total, &all));
  PetscCall(FillPoints(sim, n_owned, owned, first, r, mine));
  PetscCallMPI(MPI_Type_contiguous(WIDTH, MPIU_REAL, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCallMPI(MPI_Gatherv(mine, (PetscMPIInt)n, type, all, count, start, type, 0, sim->scene->comm));
  PetscCallMPI(MPI_Type_free(&type));
  if (rank == 0) PetscCall(WriteInOrder(sim, file, total, place, start, all));
  PetscCall(PetscFree2(mine, all));
  PetscCall(PetscFree3(count, start, place));
  PetscFunctionReturn(0);
}
