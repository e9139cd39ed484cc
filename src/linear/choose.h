/* Declarations shared by choose.cpp, settled.cpp, krylov.cpp, work.cpp and state.cpp */
#ifndef HHTDAE_LINEAR_CHOOSE_H
#define HHTDAE_LINEAR_CHOOSE_H

#include "linear.h"

PetscErrorCode LinearOptionGiven(KSP ksp, const char name[], PetscBool *given);

/* Sets the preconditioner's type and marks it as chosen here, not by the user */
PetscErrorCode LinearSetType(PC pc, PCType type);

/* Marks the package as chosen here; NULL removes the mark: the package is the user's */
PetscErrorCode LinearMarkPackage(PC pc, const char package[]);

/* What the size of a factorization suggests. large: packages that work on dense fronts, as MUMPS; parts: KLU on every rank ("kluparts"); single: the
   factor is so large that single precision pays. */
struct LinearSize {
  PetscBool large = PETSC_FALSE, parts = PETSC_FALSE, single = PETSC_FALSE;
  char      text[160] = "";
};

/* many_solves: hundreds of solves follow each factorization */
PetscErrorCode LinearMeasure(Mat P, PetscBool symmetric, PetscBool many_solves, LinearSize *size);

/* Whether the matrix has so many entries that its factor is large whatever the ordering */
PetscErrorCode LinearHasManyEntries(Mat P, PetscBool *yes);

/* Records in *choice whether hhtconstraint is in use, and loosens the relative tolerance of its Krylov method unless the user has set one */
PetscErrorCode LinearLoosen(KSP ksp, LinearChoice *choice);

/* Sets the type of the KSP that replaces a factor, unless -ksp_type names one */
PetscErrorCode LinearSetKrylov(KSP ksp, PetscBool symmetric, LinearChoice *choice);

/* For a matrix whose factor is large: takes the Krylov method if the user chose no solver and at least half of the unknowns belong to nodes of finite elements */
PetscErrorCode LinearPreferKrylov(KSP ksp, Mat P, PetscBool symmetric, LinearChoice *choice, PetscBool *taken);

/* The choice as a checkpoint stores it */
struct LinearChosen {
  PetscBool cholesky  = PETSC_FALSE;                                                       /* LDL^T, or the Krylov method for a symmetric matrix */
  PetscBool iterative = PETSC_FALSE, no_room = PETSC_FALSE, krylov_given_up = PETSC_FALSE; /* as in LinearChoice */
  PetscBool set_up      = PETSC_FALSE;                                                     /* the preconditioner was set up: its state follows in the archive, if it has one */
  char      package[64] = "";
};

/* LinearChoose() for a run that resumes with the solver `was`: nothing is measured again, and what the user chooses now takes precedence */
PetscErrorCode LinearChooseAgain(KSP ksp, Mat P, const LinearChosen &was, LinearChoice *choice);

/* Takes the Krylov method that the resumed run had; *taken = PETSC_FALSE if the user chooses a solver now */
PetscErrorCode LinearTakeKrylovAgain(KSP ksp, Mat P, PetscBool symmetric, LinearChoice *choice, PetscBool *taken);

/* Sets the types of a factorization in place of a Krylov method that was chosen here; does nothing if the user chose the types */
PetscErrorCode LinearTakeFactor(KSP ksp, LinearChoice *choice);

#endif
