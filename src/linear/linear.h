/*
  What KSP gets: the choice of a direct solver where the user chose none, METIS orderings, and the names of redundant
  constraints when a matrix turns out singular. The integrator calls these; they know nothing of time.
*/
#ifndef HHTDAE_LINEAR_H
#define HHTDAE_LINEAR_H

#include "archive.h"
#include <petscksp.h>

/* What the user settled, and what was chosen in its place; one per integrator */
struct LinearChoice {
  PetscBool user_pc      = PETSC_FALSE; /* the program or the options chose the preconditioner's type */
  PetscBool user_package = PETSC_FALSE; /* ... or the package that factors the matrix */
  PetscBool may_be_rough = PETSC_FALSE; /* the caller has LinearSolveRoughly() for most solves: factors in single precision pay */
  PetscBool refines      = PETSC_FALSE; /* solves with the factor are refined unless they may be rough */
  PetscBool iterative    = PETSC_FALSE; /* a Krylov method with the constraint preconditioner was chosen */
  PetscBool no_room      = PETSC_FALSE; /* ... as there was no room for a factor */
  PetscBool slow         = PETSC_FALSE; /* ... and given up: it took too many iterations, or failed */
  PetscBool constraint   = PETSC_FALSE; /* hhtconstraint behind a Krylov method, chosen or the user's: a matrix costs as much as a few solves */
  PetscBool many_solves  = PETSC_FALSE; /* hundreds follow each factorization: the caller is a preconditioner */
  PetscBool cholesky     = PETSC_FALSE; /* LDL^T was chosen, which stands on the symmetry of the matrix */
  char      text[256]    = "";          /* for -ts_view and -info: what was chosen, and why */
};

/* Registers the ordering "metisnd" and whatever else KSP may be asked for by name */
PetscErrorCode LinearRegister(void);

/* Before KSPSetFromOptions(): preonly with a factorization where the program set no types, and notes what it did set */
PetscErrorCode LinearDefaults(KSP ksp, LinearChoice *choice);

/* What LinearDefaults() and LinearChoose() have set is taken back: types and packages that nobody has set are none */
PetscErrorCode LinearLeave(KSP ksp, LinearChoice *choice);

/* Once the Newton matrix P has its first values: the package and factorization, where the user chose none.
   The integrator calls it again with symmetric = PETSC_FALSE if the matrix ceases to be symmetric. */
PetscErrorCode LinearChoose(KSP ksp, Mat P, PetscBool symmetric, LinearChoice *choice);

/* Where there was no room for the factor that was chosen: conjugate gradients, or FGMRES if the matrix is not symmetric, with the preconditioner "hhtconstraint"
   (constraint.h). *changed = PETSC_FALSE if the choice was the user's, or is this one already. */
PetscErrorCode LinearChooseSmaller(KSP ksp, Mat P, LinearChoice *choice, PetscBool *changed);

/* After a solve, or a set-up that failed, with the Krylov method that LinearChoose() took in place of a factor: *changed, if it failed or took more iterations than
   the factor is worth, which P gets from now on. Collective. */
PetscErrorCode LinearGiveUpKrylov(KSP ksp, Mat P, LinearChoice *choice, PetscBool *changed);

/* The type of the KSP if the user has set it, by options or by program; KSPPREONLY if the Krylov method was chosen here */
PetscErrorCode LinearUsersMethod(KSP ksp, const LinearChoice &choice, KSPType *type);

/*
  What a solver takes over from the matrices before: the choice itself, pivots and orderings of factors that were chosen for other values, aggregates of "hhtconstraint" that
  were made at other positions. LinearSaveState() notes it, each rank its own. LinearLoadState() puts a KSP that has the operator P and the defaults of LinearDefaults() into that
  state, so that its solves have the same bits and it will choose alike with the matrices to come; *same = PETSC_FALSE where this cannot be had: PETSc's own packages and
  preconditioners, of which it is not known what they keep, and MUMPS on several ranks (mumpsnd.h). Without *usable the matrix has to be factored anew, as it has where the
  run had chosen a solver and not set it up yet. Both collective.
*/
PetscErrorCode LinearSaveState(KSP ksp, const LinearChoice &choice, Archive *archive);
PetscErrorCode LinearLoadState(KSP ksp, Mat P, LinearChoice *choice, Archive *archive, PetscBool *same, PetscBool *usable);

/*
  Solves with the matrix P may be rough from now on, or may no longer be: those of a caller whose own iteration removes their error. A package
  whose factors are of single precision leaves out its refinement then (mumpsmixed.h); others do not ask.
*/
PetscErrorCode LinearSolveRoughly(Mat P, PetscBool rough);
PetscErrorCode LinearSolvesRoughly(Mat P, PetscBool *rough);

/* Hundreds of solves follow each factorization of P: a package may do more for them (klupair.h) */
PetscErrorCode LinearSolveOften(Mat P);
PetscErrorCode LinearSolvesOften(Mat P, PetscBool *often);

/* Functions by these names: of a factor, (Mat F, Archive *) and (Mat F, Mat P, Archive *, PetscBool *same); of a preconditioner that was set up with its operators,
   (PC, Archive *) and (PC, Archive *, PetscBool *same) */
#define LINEAR_SAVE_STATE "LinearSaveState_C"
#define LINEAR_LOAD_STATE "LinearLoadState_C"

/* Whether A holds one triangle of a symmetric matrix, MATSBAIJ: its rows are upper parts of rows, and KLU cannot read it */
PetscErrorCode LinearStoresTriangle(Mat A, PetscBool *triangle);

/* Whether |y^T A x - x^T A y| is rounding for two fixed pseudo-random vectors: two products, no transpose */
PetscErrorCode LinearIsSymmetric(Mat A, PetscBool *symmetric);

/* Whether a package is known to exchange rows where a pivot is zero */
PetscErrorCode LinearExchangesRows(const char package[], PetscBool *yes);

/* For a singular saddle-point matrix: global rows of multipliers that take part in linearly dependent constraints,
   from the null space of Phi_q^T by inverse iteration on the regularized matrix; at most max of them.
   Sets *n = 0 if no dependence is found. Collective; every rank gets the same list. */
PetscErrorCode LinearNameDependent(Mat P, IS multipliers, PetscInt max, PetscInt *n, PetscInt rows[]);

#endif
