/*
  Kernels of the Kuhn (Freudenthal) mesh: plain C on small arrays, no PETSc, no MPI.

  A cube of edge h is cut into six tetrahedra, one per permutation (i,j,k) of the axes, with the vertex path
  0, e_i, e_i + e_j, (1,1,1). A P1 function on such a tetrahedron has the derivative along axis j equal to its difference
  along the one path edge of that axis (docs/theory.md, eq. G1).

  A stencil is the row of a P1 matrix at one node: 27 coefficients at offsets o in {-1,0,1}^3, index
  (o1+1) + 3 (o2+1) + 9 (o3+1). The row depends on the node's place on each axis: DLM_LOWER on the lower wall, DLM_INNER, or
  DLM_UPPER on the upper wall (cells beyond a wall do not exist).
*/
#ifndef DLM_KUHN_H
#define DLM_KUHN_H

enum { DLM_LOWER = 0, DLM_INNER = 1, DLM_UPPER = 2 };

/* vertex[t][k][d]: corner k on the path of tetrahedron t, in {0,1}^3; axis[t][k]: axis of the path edge k -> k+1. */
typedef struct {
  int vertex[6][4][3];
  int axis[6][3];
} DLMKuhnCube;

void DLMKuhnCubeFill(DLMKuhnCube *cube);

/* Row of D_j[a,b] = int phi_a d_j phi_b; times h^2. */
void DLMKuhnDerivative(int j, const int place[3], double row[27]);
/* Row of int grad phi_a . grad phi_b; times h. Inside it is the 7-point stencil. */
void DLMKuhnStiffness(const int place[3], double row[27]);
/* Row of int phi_a phi_b; times h^3. */
void DLMKuhnMass(const int place[3], double row[27]);
/* Lumped mass int phi_a; times h^3. */
double DLMKuhnLumpedMass(const int place[3]);

/* Pressure transfer P: weight of a coarse node in the fine node at offset o (fine mesh widths) from it; 0 if none. */
double DLMTransferWeight(const int o[3]);

/*
  Row of the divergence B = P^T (D_1 D_2 D_3) at a coarse node, times h^2 (h the fine mesh width): row[j][.] holds the
  coefficients of u_j at the fine offsets o in {-2..2}^3 from it, index (o1+2) + 5 (o2+2) + 25 (o3+2).

  symmetric: the mean of this cut and its mirror image in x2 (docs/theory.md, G6).
*/
void DLMKuhnDivergence(const int place[3], int symmetric, double row[3][125]);

/* P1 interpolation at the fractional position x in [0,1]^3 of a cube: weights of its 8 corners, index c1 + 2 c2 + 4 c3. */
void DLMKuhnInterpolate(const double x[3], double weight[8]);
#endif
