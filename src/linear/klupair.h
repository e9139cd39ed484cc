/*
  KLU with pivots that we find, as the factorization package "klupair" for MATSEQAIJ, LU.

  Multipliers have no diagonal entry. KLU's own analysis therefore looks for a permutation with a zero-free diagonal by
  depth-first search from one column after the other, which for chains of bodies in space costs the square of their
  number. Here every unknown without a diagonal value is paired with an unknown that it is coupled to, all of them at
  once and in a few sweeps; the pairs are ordered as one vertex each, and KLU gets both permutations. The factorization
  of a matrix with the same pattern keeps the pivots (klu_refactor) while they remain good.
*/
#ifndef HHTDAE_LINEAR_KLUPAIR_H
#define HHTDAE_LINEAR_KLUPAIR_H

#include <petscmat.h>

#define LINEAR_KLUPAIR "klupair"

/* Does nothing where the library was built without KLU */
PetscErrorCode LinearRegisterKLUPair(void);

#endif
