/*
  LU of a distributed, very sparse matrix, as the factorization package "kluparts" for MATMPIAIJ.

  Unknowns that are coupled across ranks are covered by a small interface, so that what is left on one rank is coupled
  to no other rank: its interior. KLU (klupair.h) factors the interiors at the same time, each rank adds what its
  interior contributes to the Schur complement of the interface, and that small dense matrix is factored by LAPACK on
  every rank. A solve is one sweep down the interior, one sum over the ranks, one sweep up. In a chain of bodies cut
  into p parts the interface is the multipliers of p - 1 joints.

  An interior must be regular by itself. Multipliers are therefore taken in preference to coordinates: what is left is
  then a mechanism with fewer constraints; an interface coordinate brings along the multipliers it is coupled to. Where
  an interior turns out singular nevertheless, or so close to it that the residual of a solve shows it, the unknown in
  question moves to the interface; if the interface is then singular, so is the matrix.
*/
#ifndef HHTDAE_LINEAR_KLUPARTS_H
#define HHTDAE_LINEAR_KLUPARTS_H

#include <petscmat.h>

#define LINEAR_KLUPARTS "kluparts"

/* Does nothing where the library was built without KLU */
PetscErrorCode LinearRegisterKLUParts(void);

/* What "kluparts" would have to do for a matrix; of the interiors, the largest number of each */
struct LinearPartsWork {
  PetscBool possible  = PETSC_FALSE; /* else what follows is not counted */
  double    couplings = 0;           /* entries between ranks */
  PetscInt  interface = 0;
  double    unknowns = 0, factor = 0, flops = 0; /* rows, entries of L, operations of L D L^T */
  double    sweeps = 0, products = 0;            /* multiplications for the Schur complement: sparse and dense */
};

/* Collective; possible = PETSC_FALSE if the type is another, or with more than so many couplings or interface unknowns
 */
PetscErrorCode LinearPartsCount(Mat A, double max_couplings, PetscInt max_interface, LinearPartsWork *work);

#endif
