/*
  A direct solver inside a preconditioner, chosen as any other where the user chooses none: its options have the prefix of the preconditioner's own, and a name.
  On several ranks each factors a small matrix by itself: to gather its right-hand side takes less time than messages at each level of an elimination.
*/
#ifndef HHTDAE_LINEAR_INNER_H
#define HHTDAE_LINEAR_INNER_H

#include "linear.h"

struct InnerSolver {
  KSP          ksp = nullptr;
  Mat         *whole = nullptr; /* one, on each rank; NULL where the matrix stays distributed */
  VecScatter   gather = nullptr;
  Vec          b = nullptr, x = nullptr; /* of `whole` */
  LinearChoice choice;
};

/* After each change of A's values; where its pattern changes InnerDestroy() comes before. *failed where A is singular. Collective on the preconditioner. */
PetscErrorCode InnerSetUp(PC pc, const char name[], Mat A, InnerSolver *s, PetscBool *failed);
PetscErrorCode InnerSolve(InnerSolver *s, Vec b, Vec x, PetscBool *failed);
/* linear.h; A, whose values are set, is the matrix that the state belongs to. *same: of this rank alone. */
PetscErrorCode InnerSaveState(const InnerSolver &s, Archive *archive);
PetscErrorCode InnerLoadState(PC pc, const char name[], Mat A, InnerSolver *s, Archive *archive, PetscBool *same, PetscBool *failed);
PetscErrorCode InnerView(const InnerSolver &s, PetscViewer viewer);
PetscErrorCode InnerDestroy(InnerSolver *s);

#endif
