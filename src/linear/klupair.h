/*
  KLU with pivots chosen here, as the factorization package "klupair" for LU of MATSEQAIJ.

  Multipliers have no diagonal entry. KLU's own analysis therefore looks for a permutation with a zero-free diagonal by
  depth-first search from one column after the other, which for nets and rings of bodies costs the square of their
  number. Here every unknown without a diagonal value is paired with an unknown that it is coupled to, by a maximum
  matching that takes a few sweeps; each pair is ordered as one vertex, and KLU gets both permutations. The factorization
  of a matrix with the same pattern keeps the pivots (klu_refactor) while element growth stays small. KLU's diagonal
  blocks (BTF) are used only where the whole diagonal has values.

  Milliseconds with tests/bench/klupair.cpp (Debian 12, KLU 1.3.8, a busy machine; "again": same pattern, other values;
  residual of a solve with entries of order one):

      bodies in space, by revolute joints       n   package    analysis   factor   again   solve   residual
      chain, 10,000                       110,000   klu              61       91      74     2.5      8e-14
                                                    klupair          64      101      22     2.3      1e-15
      chain, 100,000                    1,100,000   klu             885      938     582      35      8e-14
                                                    klupair         493      690     178      32      2e-15
      rings of eight, 1,000                11,375   klu              16       10     6.0    0.27      2e-13
                                                    klupair         4.4      7.0     2.3    0.24      4e-16
      rings of eight, 10,000              113,750   klu           1,487      104     102     4.8      8e-14
                                                    klupair          59      120      36     4.0      1e-15
*/
#ifndef HHTDAE_LINEAR_KLUPAIR_H
#define HHTDAE_LINEAR_KLUPAIR_H

#include <petscmat.h>

#define LINEAR_KLUPAIR "klupair"

/* Does nothing if the library was built without KLU */
PetscErrorCode LinearRegisterKLUPair(void);

/* Creates the factor of a SEQAIJ matrix, as MatGetFactor() with this package does */
PetscErrorCode LinearKLUPairFactor(Mat A, MatFactorType type, Mat *factor);

#endif
