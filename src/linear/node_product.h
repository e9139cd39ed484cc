/*
  The product with a matrix of finite elements in single precision, for Krylov methods with loose tolerances.

  The speed of such a product is limited by the memory it reads. Couplings between nodes of three unknowns are stored as 3 x 3 blocks in single precision, if they are symmetric one for
  each pair of own nodes: 2.2 bytes per entry in place of 12. All other entries stay in double precision, so that constraints are exact. Sums over the blocks of a node are in single
  precision, too.
*/
#ifndef HHTDAE_LINEAR_NODE_PRODUCT_H
#define HHTDAE_LINEAR_NODE_PRODUCT_H

#include "local_rows.h"
#include <vector>

/* Rows of 3 x 3 blocks, each stored by columns: the blocks of node i are first[i] to first[i + 1] - 1 */
struct NodeBlocks {
  std::vector<PetscInt> first, column;
  std::vector<float>    value;
};

struct NodeProduct {
  Mat                   shell = nullptr; /* MATSHELL whose MatMult() is this product */
  std::vector<PetscInt> row;             /* first row of each own node, from 0 */
  NodeBlocks            own, other;      /* couplings with own nodes, the upper triangle if symmetric, and with nodes of other ranks */
  bool                  symmetric = true;
  std::vector<PetscInt> rest_row, rest_first, rest_column; /* all other entries, by rows; columns: own unknowns, then `fetched` */
  std::vector<double>   rest_value;
  Vec                   fetched     = nullptr; /* unknowns of other ranks: first those of nodes, three each, then the others */
  VecScatter            scatter     = nullptr;
  PetscInt              other_nodes = 0;
  std::vector<float>    x, y, other_x; /* vectors of nodes, padded to four components, of which the fourth is zero */
};

/* Copies the values of A. node: for each local column of A (local_rows.h) the global number of the first row of its node of three unknowns, or -1. *usable: the values are within the
   range of single precision. Collective. */
PetscErrorCode NodeProductFill(Mat A, const std::vector<PetscInt> &node, bool same_pattern, NodeProduct *p, PetscBool *usable);
PetscErrorCode NodeProductDestroy(NodeProduct *p);

#endif
