/*
  Kernels of the multiplier points ("markers"): plain C on small arrays, no PETSc object, no MPI. Lengths in mesh widths.
*/
#ifndef DLM_MARKERS_H
#define DLM_MARKERS_H

/* Markers that cover a sphere of radius r (in h) at about the given spacing (area per point = spacing^2): at least 12. */
int DLMSurfaceCount(double r, double spacing);
/*
  n unit vectors spread evenly over the sphere, x[3 n], n from DLMSurfaceCount: orbits of the pyritohedral group, relaxed by mutual
  repulsion. The set has the symmetries that the mesh has (point reflection, permutation of the axes) and isotropic second moments, so that
  a sphere at a point of symmetry of the mesh feels no spurious force.
*/
void DLMSurfacePoints(int n, double *x);

/*
  Q[m][n] (m = (degree + 1)^2 columns of n): real spherical harmonics up to a degree at n points on the unit sphere, orthonormal as vectors. Returns m,
  or fewer if the points cannot tell them apart.
*/
int DLMHarmonics(int n, const double *x, int degree, double *Q);

/* Peskin's four-point delta (thesis 2.4), argument in h. */
double DLMDelta(double r);

/* Interpolation weights along one axis: node index and weight, n_entries of them. */
typedef struct {
  int    n;
  int    node[8];
  double weight[8];
} DLMAxisWeights;

/*
  Weights of the delta at x on an axis. Between walls (nodes 0..cells) the nodes outside are closed by linear continuation,
  v(-k) = 2 v(0) - v(k): the weights still sum to one and reproduce linear fields (docs/theory.md, eq. P3).
*/
void DLMDeltaWeights(double x, int periodic, int cells, DLMAxisWeights *axis);
#endif
