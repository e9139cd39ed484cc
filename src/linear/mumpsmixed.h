/*
  Factors in single precision for results in double precision, as the factorization package "mumpsmixed" for MATAIJ, LU and LDL^T, and for MATSBAIJ,
  LDL^T.

  The factor is one of "smumpsnd" (mumpsnd.h): half the memory of one in double precision and some 0.6 of the time. Solves are refined with the residual
  in double precision until corrections are rounding, as LAPACK's dsgesv() does it (Demmel et al., ACM Trans. Math. Softw. 32, 2006): three
  sweeps through the factor where one of double precision takes one. A caller whose own iteration removes the error of the solve asks for
  rough ones, which take one sweep: LinearSolveRoughly() in linear.h.

  How fast refinement contracts is measured with every factorization, by two steps of power iteration. Where it is too slow, where the matrix is
  singular to single precision, or has entries beyond its range, the factor is made in double precision by "mumpsnd" instead. The next matrix
  gets another try in single precision; if that fails the one after two more, then after four, ... -info tells every fall back, -ksp_view, and with it -ts_view,
  the present state.
*/
#ifndef HHTDAE_LINEAR_MUMPSMIXED_H
#define HHTDAE_LINEAR_MUMPSMIXED_H

#include <petscmat.h>

#define LINEAR_MUMPSMIXED "mumpsmixed"

/* Does nothing where MUMPS has no single precision */
PetscErrorCode LinearRegisterMumpsMixed(void);

#endif
