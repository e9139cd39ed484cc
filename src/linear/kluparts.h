/*
  LU of a distributed, very sparse matrix, as the factorization package "kluparts" for MATMPIAIJ.

  A small set of unknowns, the interface, covers all couplings between ranks: the remaining unknowns of a rank, its
  interior, are coupled to no other rank. KLU (klupair.h) factors the interiors in parallel, each rank adds the
  contribution of its interior to the Schur complement of the interface, and that small dense matrix is factored by LAPACK on
  every rank. A solve takes one forward sweep in the interior, one sum over the ranks and one backward sweep. In a chain of
  bodies cut into p parts the interface consists of the multipliers of p - 1 joints.

  An interior must be regular by itself. Multipliers are therefore preferred to coordinates as interface unknowns: the
  interior is then a mechanism with fewer constraints. An interface coordinate brings along the multipliers it is coupled
  to. If an interior is singular nevertheless, or so close to it that the residual of a solve shows it, the unknowns that
  cause it move to the interface; if the interface is then singular, so is the matrix.
*/
#ifndef HHTDAE_LINEAR_KLUPARTS_H
#define HHTDAE_LINEAR_KLUPARTS_H

#include <petscmat.h>

#define LINEAR_KLUPARTS "kluparts"

/* Does nothing if the library was built without KLU */
PetscErrorCode LinearRegisterKLUParts(void);

/* The predicted work of "kluparts" for a matrix; figures of interiors are the largest over the ranks */
struct LinearPartsWork {
  PetscBool possible  = PETSC_FALSE; /* "kluparts" applies, and the other figures were counted */
  double    couplings = 0;           /* entries between ranks */
  PetscInt  interface = 0;
  double    unknowns = 0, factor = 0, flops = 0; /* rows, entries of L, operations of L D L^T */
  double    sweeps = 0, products = 0;            /* multiplications for the Schur complement: sparse ones and dense ones */
};

/* Collective; possible = PETSC_FALSE if the type is not MATMPIAIJ, or there are more than max_couplings entries between ranks or max_interface interface unknowns */
PetscErrorCode LinearPartsCount(Mat A, double max_couplings, PetscInt max_interface, LinearPartsWork *work);

#endif
