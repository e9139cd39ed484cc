/*
  MUMPS with METIS' ordering, as the factorization package "mumpsnd" for LU and LDL^T of MATSEQAIJ and MATMPIAIJ,
  and for LDL^T of MATSEQSBAIJ and MATMPISBAIJ.

  PETSc's own interface passes an ordering to MUMPS for LU on one process only, and there it passes the list of unknowns in
  the order of elimination where PERM_IN wants each unknown's position in it (seen in 3.18.5); Debian builds MUMPS
  without METIS. Operations for L D L^T of elastic blocks clamped by multipliers (tests/bench/ordering.cpp; MUMPS
  5.5.1; "METIS" is the ordering of this package, every multiplier directly after a coordinate that it constrains):

      bricks          n         AMD       AMF      PORD     METIS   delayed pivots PORD / METIS
      16 x 16 x 16    15606   9.1e9     8.2e9     7.0e9     4.5e9    573 / 0
      20 x 20 x 20    29106   4.5e10    3.5e10    2.6e10    1.6e10   834 / 0
      24 x 24 x 24    48750             8.5e10    5.9e10    4.7e10  1271 / 0
      32 x 32 x 32   111078                       3.6e11    2.3e11   (analysis only)
      64 x 12 x 12    33462   2.0e10    1.7e10    9.6e9     1.05e10  297 / 0

  METIS and MUMPS' own ordering are both tried because of long thin bodies, for which PORD may be better.

  On several processes results differ from run to run by rounding: of 200 solves of 3600 unknowns with the same factor on
  two ranks 19 differed from the first one in some bits.
*/
#ifndef HHTDAE_LINEAR_MUMPSND_H
#define HHTDAE_LINEAR_MUMPSND_H

#include <petscmat.h>

#define LINEAR_MUMPSND "mumpsnd"

/* The same in single precision: half the memory, some 0.6 of the time (README.md), and solutions to a few digits, depending on the condition of the
   matrix. The factorization fails if the matrix is singular to single precision or has entries beyond its range. */
#define LINEAR_SMUMPSND "smumpsnd"

/* Does nothing if PETSc was built without MUMPS, or not for double precision */
PetscErrorCode LinearRegisterMumpsND(void);

/* Registers a package for LU of MATAIJ and for LDL^T of MATAIJ and MATSBAIJ */
PetscErrorCode LinearRegisterForTypes(const char package[], PetscErrorCode (*get)(Mat, MatFactorType, Mat *));

#endif
