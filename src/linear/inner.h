/* A direct solver inside a preconditioner, chosen as any other where the user chooses none: its options have the prefix of the preconditioner's own, and a name. */
#ifndef HHTDAE_LINEAR_INNER_H
#define HHTDAE_LINEAR_INNER_H

#include "linear.h"

struct InnerSolver {
  KSP          ksp = nullptr;
  LinearChoice choice;
};

/* After each change of A's values; another: of its pattern, too. *failed where A is singular. Collective on the preconditioner. */
PetscErrorCode InnerSetUp(PC pc, const char name[], Mat A, PetscBool another, InnerSolver *s, PetscBool *failed);
PetscErrorCode InnerSolve(InnerSolver *s, Vec b, Vec x, PetscBool *failed);
PetscErrorCode InnerView(const InnerSolver &s, PetscViewer viewer);
PetscErrorCode InnerDestroy(InnerSolver *s);

#endif
