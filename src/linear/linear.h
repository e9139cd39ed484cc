/*
  Configures the KSP of a Newton matrix: the choice of a direct solver where the user chose none, METIS orderings, and
  the names of redundant constraints when a matrix turns out singular. The integrator calls these functions; nothing
  here depends on time integration.
*/
#ifndef HHTDAE_LINEAR_H
#define HHTDAE_LINEAR_H

#include "archive.h"
#include <petscksp.h>

/* Which parts of the solver the user has set, and what was chosen for the others; one per KSP */
struct LinearChoice {
  PetscBool user_pc         = PETSC_FALSE; /* the program or the options set the preconditioner's type */
  PetscBool user_package    = PETSC_FALSE; /* ... or the package that factors the matrix */
  PetscBool may_be_rough    = PETSC_FALSE; /* the caller declares most solves rough by LinearSolveRoughly(), so that factors in single precision pay */
  PetscBool refines         = PETSC_FALSE; /* the package is "mumpsmixed", whose solves are refined iteratively unless they may be rough */
  PetscBool iterative       = PETSC_FALSE; /* a Krylov method with the constraint preconditioner was chosen */
  PetscBool no_room         = PETSC_FALSE; /* ... because the memory does not suffice for a factor */
  PetscBool krylov_given_up = PETSC_FALSE; /* the Krylov method took too many iterations or failed: a factor from then on */
  PetscBool constraint      = PETSC_FALSE; /* the preconditioner is hhtconstraint, chosen or the user's: a new matrix costs only as much as a few solves */
  PetscBool many_solves     = PETSC_FALSE; /* hundreds of solves follow each factorization: the caller is a preconditioner */
  PetscBool cholesky        = PETSC_FALSE; /* LDL^T, or the Krylov method for symmetric matrices, was chosen: void once the matrix ceases to be symmetric */
  char      text[256]       = "";          /* what was chosen, and why, for -ts_view and -info */
};

/* Registers the ordering "metisnd", the factorization packages and the preconditioner of this directory */
PetscErrorCode LinearRegister(void);

/* To be called before KSPSetFromOptions(). Sets preonly with a factorization where the program set no types, and records in *choice what it did set. */
PetscErrorCode LinearDefaults(KSP ksp, LinearChoice *choice);

/* Undoes LinearDefaults() and LinearChoose(): types and packages that were set by them, not by the user, are unset again */
PetscErrorCode LinearLeave(KSP ksp, LinearChoice *choice);

/* Chooses package and factorization, where the user chose none; the Newton matrix P must have values.
   The integrator calls it again with symmetric = PETSC_FALSE if the matrix ceases to be symmetric. */
PetscErrorCode LinearChoose(KSP ksp, Mat P, PetscBool symmetric, LinearChoice *choice);

/* To be called when memory does not suffice for the chosen factor: takes conjugate gradients, or FGMRES if the matrix is not symmetric, with the preconditioner
   "hhtconstraint" (constraint.h). *changed = PETSC_FALSE if the user chose the solver, or it is no factorization. */
PetscErrorCode LinearChooseSmaller(KSP ksp, Mat P, LinearChoice *choice, PetscBool *changed);

/* To be called after a solve, or a failed set-up, with the Krylov method that LinearChoose() took in place of a factor. If the method failed or took more than 100
   iterations, P is factored from now on and *changed = PETSC_TRUE. Collective. */
PetscErrorCode LinearGiveUpKrylov(KSP ksp, Mat P, LinearChoice *choice, PetscBool *changed);

/* The type of the KSP; KSPPREONLY in place of a Krylov method that was chosen here */
PetscErrorCode LinearUsersMethod(KSP ksp, const LinearChoice &choice, KSPType *type);

/*
  State that a solver carries over from earlier matrices: the choice itself, pivots and orderings of factors that were chosen for other values, aggregates of "hhtconstraint"
  that were made at other positions. LinearSaveState() writes it, each rank its own part. LinearLoadState() puts a KSP that has the operator P and the defaults of
  LinearDefaults() into that state, so that its solves have the same bits and later choices are the same. *same = PETSC_FALSE where this cannot be guaranteed: PETSc's own
  packages and preconditioners, whose state is not saved, and MUMPS on several ranks (mumpsnd.h). If *usable = PETSC_FALSE the matrix has to be factored anew; this is also
  so where the saved solver had been chosen but not set up. Both are collective.
*/
PetscErrorCode LinearSaveState(KSP ksp, const LinearChoice &choice, Archive *archive);
PetscErrorCode LinearLoadState(KSP ksp, Mat P, LinearChoice *choice, Archive *archive, PetscBool *same, PetscBool *usable);

/*
  Declares whether solves with the matrix P may be rough from now on, because an iteration of the caller removes their error. "mumpsmixed", whose factors are of single
  precision, then leaves out iterative refinement (mumpsmixed.h); other packages ignore the declaration.
*/
PetscErrorCode LinearSolveRoughly(Mat P, PetscBool rough);
PetscErrorCode LinearSolvesRoughly(Mat P, PetscBool *rough);

/* Declares that hundreds of solves follow each factorization of P: "klupair" then builds its dense panels with the first factorization */
PetscErrorCode LinearSolveOften(Mat P);
PetscErrorCode LinearSolvesOften(Mat P, PetscBool *often);

/* Names of composed functions. Of a factor: (Mat F, Archive *) and (Mat F, Mat P, Archive *, PetscBool *same). Of a preconditioner that is set up:
   (PC, Archive *) and (PC, Archive *, PetscBool *same). */
#define LINEAR_SAVE_STATE "LinearSaveState_C"
#define LINEAR_LOAD_STATE "LinearLoadState_C"

/* Whether A is a MATSBAIJ, which stores the upper triangle of a symmetric matrix only */
PetscErrorCode LinearStoresTriangle(Mat A, PetscBool *triangle);

/* Whether |y^T A x - x^T A y| is rounding for two fixed pseudo-random vectors; takes two products and no transpose */
PetscErrorCode LinearIsSymmetric(Mat A, PetscBool *symmetric);

/* Whether a package is known to exchange rows where a pivot is zero, as multipliers, whose diagonal entries are zero, need it */
PetscErrorCode LinearExchangesRows(const char package[], PetscBool *yes);

/* For a saddle-point matrix that is singular, or nearly so: at most max global rows of multipliers that take part in linearly dependent
   constraints, from the null space of Phi_q^T by inverse iteration on the regularized matrix (dependent.cpp). tolerance: |Phi_q^T lambda|
   relative to |Phi_q| |lambda|, scaled by the diagonal of the matrix, up to which lambda counts as a null vector.
   Sets *n = 0 if no dependence is found. Collective; every rank gets the same list. */
PetscErrorCode LinearNameDependent(Mat P, IS multipliers, PetscReal tolerance, PetscInt max, PetscInt *n, PetscInt rows[]);

#endif
