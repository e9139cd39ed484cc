/*
  MUMPS with an ordering of ours, as the factorization package "mumpsnd" for MATSEQAIJ and MATMPIAIJ, LU and LDL^T,
  and for MATSEQSBAIJ and MATMPISBAIJ, LDL^T.

  PETSc's own interface hands MUMPS an ordering for LU on one process only, and there it passes the list of unknowns in
  the order of elimination where PERM_IN wants each unknown's position in it (seen in 3.18.5); MUMPS as Debian builds it
  has no METIS inside. Operations for L D L^T of elastic blocks clamped by multipliers (tests/bench/ordering.cpp; MUMPS
  5.5.1; "METIS" is the ordering of this package, every multiplier right after a coordinate that it holds):

      bricks          n         AMD       AMF      PORD     METIS   delayed pivots PORD / METIS
      16 x 16 x 16    15606   9.1e9     8.2e9     7.0e9     4.5e9    573 / 0
      20 x 20 x 20    29106   4.5e10    3.5e10    2.6e10    1.6e10   834 / 0
      24 x 24 x 24    48750             8.5e10    5.9e10    4.7e10  1271 / 0
      32 x 32 x 32   111078                       3.6e11    2.3e11   (analysis only)
      64 x 12 x 12    33462   2.0e10    1.7e10    9.6e9     1.05e10  297 / 0

  Long thin bodies are the reason why both are tried.

  On several processes results differ from run to run by rounding. Measured: with a factor once made, 19 of 200 solves of 3600 unknowns on
  two ranks had other bits than the first one.
*/
#ifndef HHTDAE_LINEAR_MUMPSND_H
#define HHTDAE_LINEAR_MUMPSND_H

#include <petscmat.h>

#define LINEAR_MUMPSND "mumpsnd"

/* The same in single precision: half the memory and some 0.6 of the time (README.md), and solutions to a few digits, the fewer the worse the
   matrix is conditioned. A matrix that is singular to single precision, or has entries beyond its range, fails. */
#define LINEAR_SMUMPSND "smumpsnd"

/* Does nothing where PETSc was built without MUMPS, or not for double precision */
PetscErrorCode LinearRegisterMumpsND(void);

/* A package for LU of MATAIJ and LDL^T of MATAIJ and MATSBAIJ */
PetscErrorCode LinearRegisterForTypes(const char package[], PetscErrorCode (*get)(Mat, MatFactorType, Mat *));

#endif
