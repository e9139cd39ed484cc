/*
  Factors in single precision for results in double precision, as the factorization package "mumpsmixed" for MATAIJ, LU and LDL^T, and for MATSBAIJ,
  LDL^T.

  The factor is one of "smumpsnd" (mumpsnd.h), which takes half the memory of one in double precision and some 0.6 of the time. Solves are refined
  iteratively with the residual in double precision until corrections are rounding, as in LAPACK's dsgesv() (Demmel et al., ACM Trans. Math. Softw.
  32, 2006): a solve takes three sweeps through the factor in place of one. A caller whose own iteration removes the error of a solve may ask for
  rough solves of one sweep by LinearSolveRoughly() (linear.h).

  The contraction rate of the refinement is measured with every factorization, by two steps of power iteration. If it is too slow, if the matrix is
  singular to single precision, or has entries beyond its range, the matrix is factored in double precision by "mumpsnd" instead. Single precision is tried
  again 1, 2, 4, ... matrices later. -info reports every fall back, -ksp_view and -ts_view show the present state.
*/
#ifndef HHTDAE_LINEAR_MUMPSMIXED_H
#define HHTDAE_LINEAR_MUMPSMIXED_H

#include <petscmat.h>

#define LINEAR_MUMPSMIXED "mumpsmixed"

/* Does nothing if MUMPS in single precision is not installed */
PetscErrorCode LinearRegisterMumpsMixed(void);

#endif
