/*
  A direct solver within a preconditioner. It is chosen like the solver of a Newton matrix (choose.cpp) unless the user chooses one; its options have the prefix of the preconditioner
  followed by the name of the level. On several ranks a small matrix is factored by each rank: gathering its right-hand side takes less time than messages at each level of an elimination.
*/
#ifndef HHTDAE_LINEAR_INNER_H
#define HHTDAE_LINEAR_INNER_H

#include "linear.h"

struct InnerSolver {
  KSP          ksp      = nullptr;
  Mat         *gathered = nullptr; /* the whole matrix on each rank, an array of one; NULL if the matrix stays distributed */
  VecScatter   gather   = nullptr;
  Vec          b = nullptr, x = nullptr; /* gathered right-hand side and solution */
  LinearChoice choice;
};

/* Factors A; to be called after each change of its values, and after InnerDestroy() if its pattern has changed. *failed if A is singular. Collective on the preconditioner. */
PetscErrorCode InnerSetUp(PC pc, const char name[], Mat A, InnerSolver *s, PetscBool *failed);
PetscErrorCode InnerSolve(InnerSolver *s, Vec b, Vec x, PetscBool *failed);
/* LinearSaveState() and LinearLoadState() (linear.h). A must have the values that the state belongs to; *same is the result of this rank only. */
PetscErrorCode InnerSaveState(const InnerSolver &s, Archive *archive);
PetscErrorCode InnerLoadState(PC pc, const char name[], Mat A, InnerSolver *s, Archive *archive, PetscBool *same, PetscBool *failed);
PetscErrorCode InnerView(const InnerSolver &s, PetscViewer viewer);
PetscErrorCode InnerDestroy(InnerSolver *s);

#endif
