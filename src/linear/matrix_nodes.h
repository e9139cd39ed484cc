/* Finds the unknowns of a matrix that belong to nodes of finite elements, and the nodes that are coupled to other nodes only */
#ifndef HHTDAE_LINEAR_MATRIX_NODES_H
#define HHTDAE_LINEAR_MATRIX_NODES_H

#include "local_rows.h"
#include <vector>

struct MatrixNodes {
  std::vector<PetscInt> node;                   /* for each local column (local_rows.h): global number of the first row of its node, or -1 */
  PetscInt              count          = 0;     /* of this rank */
  bool                  three_unknowns = false; /* the nodes were named by LINEAR_NODES, and all have three unknowns */
  std::vector<PetscInt> node_blocks;            /* first rows, counted from this rank's first row, of nodes of three unknowns that are coupled to nodes only */
  std::vector<PetscInt> other_rows;             /* all other rows of this rank, likewise, ascending */
};

/* Finds the nodes of A by the index set LINEAR_NODES (constraint.h) or, without it, by the pattern. Collective. */
PetscErrorCode FindMatrixNodes(Mat A, MatrixNodes *nodes);

/* On input *value has one value for each own column; appends the values of the other local columns, fetched from their owners. Collective. */
PetscErrorCode LinearFetchColumns(Mat A, const LocalRows &rows, std::vector<PetscInt> *value);

/* False for couplings between different nodes, which the fine level leaves out; of_row, of_column: nodes of row and column, or -1 */
inline bool IsKept(PetscInt of_row, PetscInt of_column) { return of_row < 0 || of_column < 0 || of_row == of_column; }

#endif
