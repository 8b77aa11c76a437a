/*
  The adjoint pair on planar arrays with one layer of ghost nodes: plain C, no PETSc, no MPI.

  grad:  g_ij[a] = (1/m_a) sum_b D_j[a,b] u_i[b]         force:  f_i[a] = sum_b sum_j D_j[a,b] T_ij[b]      (docs/theory.md, V2)

  D_j from DLMKuhnDerivative, m the lumped mass. On velocities that vanish at walls force and -m grad are transposes of each other.
*/
#ifndef DLM_STRESSGRAD_H
#define DLM_STRESSGRAD_H

/* Row of D_1, D_2, D_3 at one class of place: nodes at offset[e], coefficients d[e][j] (h^2 included); mass: h^3 included. */
typedef struct {
  int    n, offset[27][3];
  double d[27][3], mass;
} DLMKuhnRow;

/* The 27 classes, index place_1 + 3 place_2 + 9 place_3 (DLM_LOWER, DLM_INNER, DLM_UPPER). */
void DLMKuhnRowsFill(double h, DLMKuhnRow rows[27]);
/* n nodes along x1 of one class; u[i] points at the first node, stride: of the ghosted array. g[3 i + j] is written. */
void DLMGradientLine(const DLMKuhnRow *row, const long stride[3], long n, const double *const u[3], double *const g[9]);
/* T in the order 11, 22, 33, 12, 13, 23; f[i] is written. */
void DLMForceLine(const DLMKuhnRow *row, const long stride[3], long n, const double *const T[6], double *const f[3]);
/*
  Residual of the wave-like advection (V5) over a block of cells, six fields at once: every pointer is at the node (0,0,0) of the block.

    r[a] += sum over tetrahedra of  - first int phi_a u.grad phi - second int (u.grad phi_a)(u.grad phi),   u its mean over the tetrahedron

  mirror: bit d set cuts the cubes mirrored along axis d.
*/
void DLMAdvectCells(const long cells[3], const long stride[3], double h, double first, double second, int mirror, const double *const u[3], const double *const phi[6],
                    double *const r[6]);
#endif
