/*
  The preconditioner "hhtconstraint" for [A B^T; B 0] with finite elements in A, on any number of ranks:

    P = [D B^T; B 0],    D = A without the couplings between different nodes of finite-element bodies

  Unknowns that do not belong to nodes, as those of rigid bodies, modes and multipliers, keep all their couplings, also to nodes, and are factored together (fine.h). Each solve with P satisfies the
  constraints exactly, so that the iterates of conjugate gradients, which begin at P^-1 b, stay on the constraints, where the matrix is definite (Gould,
  Hribar, Nocedal, SIAM J. Sci. Comput. 23, 2001, 1376-1395, algorithm 6.2). Without multipliers D alone is block Jacobi.

  If positions of nodes are known, a coarse level (coarse.h) is added, which includes all unknowns that do not belong to nodes: the number of iterations then no longer grows with the number of
  elements. -pc_hhtconstraint_aggregate sets the largest number of nodes of an aggregate; 0: no coarse level.

  At relative tolerances from 1e-4 on the Krylov method's matrix products are computed in single precision (node_product.h), unless -pc_hhtconstraint_single 0.
*/
#ifndef HHTDAE_LINEAR_CONSTRAINT_H
#define HHTDAE_LINEAR_CONSTRAINT_H

#include <petscpc.h>

#define PCHHTCONSTRAINT "hhtconstraint"

/* Name of an IS composed with the matrix (PetscObjectCompose()): this rank's unknowns that belong to nodes; the block size of the IS is the number of unknowns of a node.
   Without it, consecutive rows with a diagonal entry and the same pattern are taken for a node. */
#define LINEAR_NODES "hhtdae_nodes"

/* Name of a Vec composed likewise, which the coarse level needs: positions of nodes of three unknowns, in the rows of these unknowns */
#define LINEAR_POSITIONS "hhtdae_positions"

PetscErrorCode LinearRegisterConstraint(void);

#endif
