/*
  The preconditioner "hhtconstraint" for [A B^T; B 0] with finite elements in A, on any number of ranks:

    P = [D B^T; B 0],    D = A without the couplings between different nodes of finite-element bodies

  What is not a node, as rigid bodies, modes and multipliers, stays whole, with everything that couples it to nodes, and is factored (fine.h). Each solve with P satisfies the
  constraints exactly, so that conjugate gradients, which begin at P^-1 b, move along them from then on and do not meet the indefiniteness of the whole matrix (Gould,
  Hribar, Nocedal, SIAM J. Sci. Comput. 23, 2001, 1376-1395, algorithm 6.2). Without multipliers D alone is block Jacobi.

  Where positions of nodes are known, a coarse level (coarse.h) is added, which has all that is no node, too: iterations no longer grow with the size of a body in elements.
  -pc_hhtconstraint_aggregate says how many nodes it takes together, 0: no such level.

  Where a few digits are asked for, the Krylov method's products are made in single precision (node_product.h), unless -pc_hhtconstraint_single 0.
*/
#ifndef HHTDAE_LINEAR_CONSTRAINT_H
#define HHTDAE_LINEAR_CONSTRAINT_H

#include <petscpc.h>

#define PCHHTCONSTRAINT "hhtconstraint"

/* On a matrix, by PetscObjectCompose(): an IS of its rank's unknowns that belong to nodes, of as many at a time as the block size of the IS.
   Where there is none, consecutive rows with a diagonal entry and the same pattern are a node. */
#define LINEAR_NODES "hhtdae_nodes"

/* Likewise what the coarse level needs: a Vec with positions of nodes of three unknowns in the rows of these */
#define LINEAR_POSITIONS "hhtdae_positions"

PetscErrorCode LinearRegisterConstraint(void);

#endif
