#include "../../include/private/saddleimpl.h"
#include <metis.h>

static PetscInt Root(PetscInt *parent, PetscInt i)
{
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

/* Graph of the near pairs inside one cluster, in METIS's compressed form. */
static PetscErrorCode BuildGraph(PetscInt n, const PetscInt *member, const PetscInt *local, PetscInt n_pairs, const PetscInt *pairs,
                                 const PetscInt *cluster, PetscInt c, idx_t **xadj, idx_t **adjncy)
{
  PetscFunctionBegin;
  PetscCall(PetscCalloc2(n + 2, xadj, 2 * n_pairs + 1, adjncy));
  for (PetscInt k = 0; k < 2 * n_pairs; k++)
    if (cluster[pairs[k]] == c) (*xadj)[local[pairs[k]] + 2]++;
  for (PetscInt i = 0; i < n; i++) (*xadj)[i + 2] += (*xadj)[i + 1];
  for (PetscInt k = 0; k < 2 * n_pairs; k++)
    if (cluster[pairs[k]] == c) (*adjncy)[(*xadj)[local[pairs[k]] + 1]++] = (idx_t)local[pairs[k ^ 1]];
  PetscFunctionReturn(0);
}

/* Weight of the heaviest part of more than one sphere. */
static idx_t HeaviestPart(PetscInt n, const idx_t *weight, const idx_t *part, idx_t n_parts)
{
  idx_t heaviest = 0;

  for (idx_t p = 0; p < n_parts; p++) {
    idx_t sum = 0, spheres = 0;
    for (PetscInt i = 0; i < n; i++) {
      sum += part[i] == p ? weight[i] : 0;
      spheres += part[i] == p;
    }
    if (spheres > 1) heaviest = PetscMax(heaviest, sum);
  }
  return heaviest;
}

/* Cuts one cluster into parts of at most limit unknowns (a single sphere may exceed it). */
static PetscErrorCode CutCluster(PetscInt n, const PetscInt *member, const DLMBodyLayout *layout, idx_t *xadj, idx_t *adjncy, PetscInt limit, idx_t *part)
{
  idx_t  nodes = (idx_t)n, one = 1, cut, options[METIS_NOPTIONS], total = 0;
  idx_t *weight;

  PetscFunctionBegin;
  PetscCall(PetscMalloc1(n, &weight));
  for (PetscInt i = 0; i < n; i++) {
    weight[i] = (idx_t)(3 * layout->points[member[i]]);
    total += weight[i];
  }
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  for (idx_t parts = PetscMin(nodes, (idx_t)((total + limit - 1) / limit)); parts <= nodes; parts++) {
    if (parts == nodes) {
      for (PetscInt i = 0; i < n; i++) part[i] = (idx_t)i;
      break;
    }
    if (parts == 1) PetscCall(PetscArrayzero(part, n));
    else if (METIS_PartGraphRecursive(&nodes, &one, xadj, adjncy, weight, NULL, NULL, &parts, NULL, NULL, options, &cut, part) != METIS_OK)
      SETERRQ(PETSC_COMM_SELF, PETSC_ERR_LIB, "METIS could not cut a cluster of %" PetscInt_FMT " spheres", n);
    if (HeaviestPart(n, weight, part, parts) <= limit) break;
  }
  PetscCall(PetscFree(weight));
  PetscFunctionReturn(0);
}

/* Renumbers: a cluster is named by its first sphere, then counted. */
static void Renumber(PetscInt n_spheres, PetscInt *cluster, PetscInt *name, PetscInt *n)
{
  *n = 0;
  for (PetscInt i = 0; i < 2 * n_spheres; i++) name[i] = -1;
  for (PetscInt i = 0; i < n_spheres; i++) {
    if (name[cluster[i]] < 0) name[cluster[i]] = (*n)++;
    cluster[i] = name[cluster[i]];
  }
}

PetscErrorCode DLMFindClusters(DLMSpheres spheres, const DLMScene *scene, const DLMBodyLayout *layout, PetscInt *n, PetscInt *cluster)
{
  const PetscInt total = scene->n_spheres;
  PetscInt       n_pairs, *pairs, *local, *member, *name, next = total;

  PetscFunctionBegin;
  PetscCall(DLMSpheresFindPairs(spheres, scene->saddle_cluster_gap * scene->h, &n_pairs, &pairs));
  PetscCall(PetscMalloc3(total, &local, total, &member, 2 * total, &name));
  for (PetscInt i = 0; i < total; i++) cluster[i] = i;
  for (PetscInt k = 0; k < n_pairs; k++) {
    const PetscInt a = Root(cluster, pairs[2 * k]), b = Root(cluster, pairs[2 * k + 1]);
    cluster[PetscMax(a, b)] = PetscMin(a, b);
  }
  for (PetscInt i = 0; i < total; i++) cluster[i] = Root(cluster, i);
  for (PetscInt c = 0; n_pairs > 0 && c < total; c++) {
    PetscInt size = 0, unknowns = 0;
    idx_t   *xadj, *adjncy, *part;
    if (cluster[c] != c) continue;
    for (PetscInt i = c; i < total; i++)
      if (cluster[i] == c) {
        local[i]       = size;
        member[size++] = i;
        unknowns += 3 * layout->points[i];
      }
    if (size == 1 || unknowns <= scene->saddle_cluster_limit) continue;
    PetscCall(PetscMalloc1(size, &part));
    PetscCall(BuildGraph(size, member, local, n_pairs, pairs, cluster, c, &xadj, &adjncy));
    PetscCall(CutCluster(size, member, layout, xadj, adjncy, scene->saddle_cluster_limit, part));
    for (PetscInt i = 0; i < size; i++) name[i] = -1;
    for (PetscInt i = 0; i < size; i++) {
      if (name[part[i]] < 0) name[part[i]] = next++; /* parts of cut clusters are numbered after all spheres */
      cluster[member[i]] = name[part[i]];
    }
    PetscCall(PetscFree(part));
    PetscCall(PetscFree2(xadj, adjncy));
  }
  Renumber(total, cluster, name, n);
  PetscCall(PetscFree3(local, member, name));
  PetscCall(PetscFree(pairs));
  PetscFunctionReturn(0);
}
