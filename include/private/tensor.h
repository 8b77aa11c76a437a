/*
  Kernels of symmetric tensor fields: plain C on planar arrays, no PETSc, no MPI.

  A symmetric field is double *const c[6], n nodes each, the components in the order 11, 22, 33, 12, 13, 23; a lower factor has
  the order 11, 22, 33, 21, 31, 32; a gradient is g[9], g[3 i + j] = d u_i / d x_j. The six (nine) arrays of a field do not
  overlap. Where "in place" is allowed the output is the very same field as the input, not a shifted one.

  Most kernels work in two passes over blocks of nodes: a branch-free loop that the compiler vectorises, and a robust scalar
  path for the nodes where the loop's error bound does not hold. NaN and Inf go in and come out. eps = 2.2e-16.
*/
#ifndef DLM_TENSOR_H
#define DLM_TENSOR_H

/* A loop over nodes: compiled for several processors unless the build already aims at one with AVX2. */
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__gnu_linux__) && defined(__OPTIMIZE__) \
  && !defined(__AVX2__) && !defined(__SANITIZE_ADDRESS__)
  #define DLM_KERNEL __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
  #define DLM_KERNEL
#endif
/* Inlined into every clone of a kernel, or it would not be vectorised. */
#define DLM_INLINE static inline __attribute__((always_inline))

/* Lower A of C = A A^T; in place allowed. First node where C is not positive definite (pivot <= 0 or not finite), or -1. */
long DLMTensorCholesky(long n, double *const c[6], double *const a[6]);
/* C = A A^T of a lower A; in place allowed. */
void DLMTensorSquare(long n, double *const a[6], double *const c[6]);

/*
  psi = log C; in place allowed. First node where C is not positive definite, or -1 (psi is NaN there). The error is that of a
  relative change of C by some eps: below 10 eps (|psi| + cond C), less where C is nearly diagonal.
*/
long DLMTensorLog(long n, double *const c[6], double *const psi[6]);
/* C = exp psi; in place allowed. Error below (60 + |tr psi|) eps |C|; at large spreads DLMTensorRepair keeps C positive. */
void DLMTensorExp(long n, double *const psi[6], double *const c[6]);

/* Eigenvalues of a symmetric matrix, ascending, and vector[k] of value[k]; all NaN if c is not finite. */
void DLMTensorEigen(const double c[6], double value[3], double vector[3][3]);
/* Smallest eigenvalue (within 16 eps tr C), its node, largest trace. Any NaN or Inf: smallest and trace NaN, its first node. */
void DLMTensorRange(long n, double *const c[6], double *smallest, long *where, double *largest_trace);
/* Raises small eigenvalues to at least 4 eps times the largest, only where a Cholesky factorisation might fail. */
void DLMTensorRepair(double c[6]);

/*
  Relaxation over a step: decay = exp(-dt/lambda), and the two-point Gauss rule, exact for cubics f,
  int_0^dt exp(-s/lambda)/lambda f(s) ds = source[0] f(node[0]) + source[1] f(node[1]);  source[0] + source[1] = 1 - decay.
*/
typedef struct {
  double dt, decay, source[2], node[2], lambda;
} DLMRelaxation;

/* dt >= 0, lambda > 0. */
void DLMRelaxationSet(double dt, double lambda, DLMRelaxation *r);

/*
  Step of dC/dt = G C + C G^T - (C - w I)/lambda with constant G, w = weight[node] or 1 if weight is NULL:
  C <- decay F C F^T + w sum_k source[k] F_k F_k^T,  F = exp(dt G), F_k = exp(node[k] G).
  Exact but for the rule: error below (1 - decay) (2 dt |G|)^4 / 4320 e^(2 dt |G|) up to dt |G| = 0.5, 1e-11 beyond it
  (cut into short steps), none in simple shear.
  Positive definite for every dt |G| that does not overflow.
*/
void DLMTensorStretch(long n, const double *const g[9], const DLMRelaxation *r, const double *weight, double *const c[6]);
/* First-order pair: C <- F C F^T, then C <- I + (C - I) exp(-dt/lambda). */
void DLMTensorStretchSplit(long n, const double *const g[9], double dt, double lambda, double *const c[6]);
/*
  The thesis's step (3.3.65): A+ = ((1 + dt/(2 lambda)) I - dt G)^-1 A, C = A+ A+^T + (dt/lambda) I; A lower, in place
  allowed. With s = dt/lambda: C at rest is (1 + 3s/4) I; in steady shear N1 is low by s/4 and C_12 by s^2/16, relatively.
*/
void DLMTensorStretchFactor(long n, const double *const g[9], double dt, double lambda, double *const a[6], double *const c[6]);

/*
  The two passes. Fast fills out[.][i] and good[i] (1 or 0) of the nodes first + i, i < count; Robust computes one node again and
  returns 0 if there is no result. Both read what they need from the context, which may point to c. Sweep returns the
  first node without result, or -1.
*/
enum { DLM_TENSOR_BLOCK = 40 };
typedef void (*DLMTensorFast)(const void *context, long first, int count, double out[6][DLM_TENSOR_BLOCK], double *good);
typedef int (*DLMTensorRobust)(const void *context, long node, double out[6]);
long DLMTensorSweep(long n, DLMTensorFast fast, DLMTensorRobust robust, const void *context, double *const c[6]);
#endif
