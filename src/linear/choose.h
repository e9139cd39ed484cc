/* What the sources of the choice share */
#ifndef HHTDAE_LINEAR_CHOOSE_H
#define HHTDAE_LINEAR_CHOOSE_H

#include "linear.h"

PetscErrorCode LinearOptionGiven(KSP ksp, const char name[], PetscBool *given);

/* A type of our choice, which nobody shall take for the user's */
PetscErrorCode LinearSetType(PC pc, PCType type);

/* The package that it has now is our choice, too; NULL: it is the user's */
PetscErrorCode LinearMarkPackage(PC pc, const char package[]);

/* What a factorization takes. large: for the packages that work on dense fronts; parts: for KLU on every rank; single: the factor is as large that
   single precision pays. */
struct LinearSize {
  PetscBool large = PETSC_FALSE, parts = PETSC_FALSE, single = PETSC_FALSE;
  char      text[160] = "";
};

/* many_solves: hundreds of solves follow each factorization */
PetscErrorCode LinearMeasure(Mat P, PetscBool symmetric, PetscBool many_solves, LinearSize *size);

/* Whether the matrix alone says that its factor is large */
PetscErrorCode LinearHasManyEntries(Mat P, PetscBool *yes);

/* Whether hhtconstraint is in use, and the tolerance of its Krylov method where nobody has set one */
PetscErrorCode LinearLoosen(KSP ksp, LinearChoice *choice);

/* The Krylov method in place of a factor, where no option names one */
PetscErrorCode LinearSetKrylov(KSP ksp, PetscBool symmetric, LinearChoice *choice);

/* For a matrix whose factor is large, by default: *taken, where most unknowns are those of nodes of finite elements */
PetscErrorCode LinearPreferKrylov(KSP ksp, Mat P, PetscBool symmetric, LinearChoice *choice, PetscBool *taken);

/* What has been chosen, for a run that goes on with it */
struct LinearChosen {
  PetscBool cholesky    = PETSC_FALSE; /* LDL^T, or the Krylov method for a symmetric matrix */
  PetscBool iterative   = PETSC_FALSE, no_room = PETSC_FALSE, slow = PETSC_FALSE; /* as in LinearChoice */
  PetscBool set_up      = PETSC_FALSE; /* the preconditioner was, and may have a state of its own */
  char      package[64] = "";
};

/* LinearChoose() where a run goes on with the solver that it had: nothing is looked for anew, but for what the user chooses otherwise now */
PetscErrorCode LinearChooseAgain(KSP ksp, Mat P, const LinearChosen &was, LinearChoice *choice);

/* The Krylov method that the run had by choice->no_room or as the faster one: *taken, unless the user chooses a solver now */
PetscErrorCode LinearTakeKrylovAgain(KSP ksp, Mat P, PetscBool symmetric, LinearChoice *choice, PetscBool *taken);

/* Types that were set for a Krylov method, back to those of a factor; nothing where they are the user's */
PetscErrorCode LinearTakeFactor(KSP ksp, LinearChoice *choice);

#endif
