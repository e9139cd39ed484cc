/*
  The fine level of the preconditioner "hhtconstraint": [A B^T; B 0] without the couplings between different nodes. For nodes that are coupled to nodes only this leaves 3 x 3 blocks,
  whose inverses are stored in single precision; the remaining rows and columns are a separate matrix, which is factored.
*/
#ifndef HHTDAE_LINEAR_FINE_H
#define HHTDAE_LINEAR_FINE_H

#include "inner.h"
#include "matrix_nodes.h"

struct FineLevel {
  std::vector<float>    inverse;                  /* inverse 3 x 3 block of each node of MatrixNodes::node_blocks, by rows */
  Mat                   rest = nullptr;           /* matrix of the unknowns MatrixNodes::other_rows; NULL if no rank has any, or the coarse level solves for them */
  std::vector<PetscInt> number;                   /* for each local column (local_rows.h): its global row in `rest`, or -1 */
  Vec                   b = nullptr, x = nullptr; /* right-hand side and solution of `rest` */
  InnerSolver           inner;
};

/* To be called after each change of the values of pc->pmat; fresh: its pattern has changed, too. blocks_only: the coarse level solves for all other rows. *failed if a block of this
   rank, or the matrix of the other rows, is singular. Collective. */
PetscErrorCode FineFill(PC pc, const MatrixNodes &nodes, PetscBool blocks_only, PetscBool fresh, FineLevel *f, PetscBool *failed);
PetscErrorCode FineSolve(FineLevel *f, const MatrixNodes &nodes, Vec x, Vec y, PetscBool *failed);
/* To be called after FineFill(); results are those of this rank only. Collective. */
PetscErrorCode FineSaveState(const FineLevel &f, Archive *archive);
PetscErrorCode FineLoadState(PC pc, FineLevel *f, Archive *archive, PetscBool *same, PetscBool *failed);
PetscErrorCode FineDestroy(FineLevel *f);

#endif
