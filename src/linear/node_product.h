/*
  The product with a matrix of finite elements in single precision, for Krylov methods that are to reduce a residual by a few digits.

  Such a product is bound by the memory that it reads. Couplings between nodes of three unknowns are stored as blocks, of each pair of own nodes one if they are symmetric, in single
  precision: 2.2 bytes an entry in place of 12. What is not coupled node to node stays in double precision: constraints are exact. Sums of a node are of single precision as well.
*/
#ifndef HHTDAE_LINEAR_NODE_PRODUCT_H
#define HHTDAE_LINEAR_NODE_PRODUCT_H

#include "local_rows.h"
#include <vector>

/* Blocks of 3 x 3, column by column, of rows of nodes: those of node i are first[i] to first[i + 1] - 1 */
struct NodeBlocks {
  std::vector<PetscInt> first, column;
  std::vector<float>    value;
};

struct NodeProduct {
  Mat                   shell = nullptr;     /* its product */
  std::vector<PetscInt> row;                 /* first row of each own node, from 0 */
  NodeBlocks            own, other;          /* with own nodes, from the diagonal on if symmetric; with nodes of other ranks */
  bool                  symmetric = true;
  std::vector<PetscInt> rest_row, rest_first, rest_column; /* entries of the other rows and columns; columns: own unknowns, then `fetched` */
  std::vector<double>   rest_value;
  Vec                   fetched = nullptr;   /* unknowns of other ranks: of nodes, three at a time, then the others */
  VecScatter            scatter = nullptr;
  PetscInt              other_nodes = 0;
  std::vector<float>    x, y, other_x;       /* of nodes, four places each: the fourth is zero */
};

/* The values of A. node: of the columns of A (local_rows.h) the global number of the first row of their node of three, or -1. *usable: single precision has room for them. Collective. */
PetscErrorCode NodeProductFill(Mat A, const std::vector<PetscInt> &node, bool same_pattern, NodeProduct *p, PetscBool *usable);
PetscErrorCode NodeProductDestroy(NodeProduct *p);

#endif
