/* Which unknowns of a matrix are nodes of finite elements, and which of these are coupled to nothing but nodes */
#ifndef HHTDAE_LINEAR_MATRIX_NODES_H
#define HHTDAE_LINEAR_MATRIX_NODES_H

#include "local_rows.h"
#include <vector>

struct MatrixNodes {
  std::vector<PetscInt> node;  /* of columns (local_rows.h): the global number of the first row of their node, or -1 */
  PetscInt              count = 0;      /* of this rank */
  bool                  threes = false; /* the matrix names them, and all have three unknowns */
  std::vector<PetscInt> alone; /* first own rows, from 0, of nodes of three unknowns that nothing but nodes is coupled to */
  std::vector<PetscInt> apart; /* all other own rows, from 0, ascending */
};

/* Of A by what is composed with it (constraint.h), or by its pattern. Collective. */
PetscErrorCode FindMatrixNodes(Mat A, MatrixNodes *nodes);

/* Values of own columns, to which those of the other columns are added, from their owners. Collective. */
PetscErrorCode LinearFetchColumns(Mat A, const LocalRows &rows, std::vector<PetscInt> *value);

/* Whether an entry stays where couplings between different nodes are left out; of_row, of_column: their nodes, or -1 */
inline bool EntryStays(PetscInt of_row, PetscInt of_column) { return of_row < 0 || of_column < 0 || of_row == of_column; }

#endif
