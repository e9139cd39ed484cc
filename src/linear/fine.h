/*
  The fine level of the preconditioner "hhtconstraint": [A B^T; B 0] without the couplings between different nodes. Nodes that are coupled to nothing but nodes are blocks of three,
  which are inverted, in single precision; all else is a matrix of its own, which is factored.
*/
#ifndef HHTDAE_LINEAR_FINE_H
#define HHTDAE_LINEAR_FINE_H

#include "inner.h"
#include "matrix_nodes.h"

struct FineLevel {
  std::vector<float>    inverse;      /* of each node of MatrixNodes::alone, 3 x 3 by rows */
  Mat                   apart = nullptr; /* of the unknowns MatrixNodes::apart; NULL where there are none on any rank, or another level has them */
  std::vector<PetscInt> number;       /* of columns (local_rows.h): their row of `apart`, or -1 */
  Vec                   b = nullptr, x = nullptr;
  InnerSolver           inner;
};

/* After each change of the values of pc->pmat. fresh: or of its pattern. nodes_alone: another level answers all else. *failed: it is singular, of this rank or all. Collective. */
PetscErrorCode FineFill(PC pc, const MatrixNodes &nodes, PetscBool nodes_alone, PetscBool fresh, FineLevel *f, PetscBool *failed);
PetscErrorCode FineSolve(FineLevel *f, const MatrixNodes &nodes, Vec x, Vec y, PetscBool *failed);
/* After FineFill(); each rank its own answers, collective all the same */
PetscErrorCode FineSaveState(const FineLevel &f, Archive *archive);
PetscErrorCode FineLoadState(PC pc, FineLevel *f, Archive *archive, PetscBool *same, PetscBool *failed);
PetscErrorCode FineDestroy(FineLevel *f);

#endif
