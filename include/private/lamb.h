/*
  Stokes flow past a sphere at rest in a flow that is a polynomial of degree 0, 1 or 2 (Lamb's solution; docs/theory.md, V8): plain C, no PETSc, no MPI.

  Mode k is u = f(r) A(x) + g(r) x H(x) with r = |x| in radii: H a solid harmonic, A = grad H or, for a flow that turns, grad H x x; u = 0 at r = 1.
*/
#ifndef DLM_LAMB_H
#define DLM_LAMB_H

enum { DLM_LAMB_MODES = 26 }; /* uniform 3, turning 3, straining 5; of second degree: twisting 5, potential 7, driven by pressure 3 */

/* At x, in radii from the centre, r > 0: u[k][i], and, unless g is NULL, g[k][3 i + j] = du_i/dx_j. */
void DLMLambModes(const double x[3], double u[DLM_LAMB_MODES][3], double g[DLM_LAMB_MODES][9]);
#endif
