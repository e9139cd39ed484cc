/* Linear solves with a matrix of the integrator's, factor.cpp, and what their preconditioner knows of nodes, nodes.cpp. */
#ifndef HHTDAE_SOLVER_H
#define HHTDAE_SOLVER_H

#include "integrator/state.h"

namespace hht3
{

/* Before options are read: a direct solver, where the program has set none */
PetscErrorCode SolverDefaults(TS ts, KSP ksp);
PetscErrorCode LeaveSolver(TS ts);

/* Where the user chose none, once the matrix has its first values, and again if it ceases to be symmetric */
PetscErrorCode ChooseSolver(KSP ksp, Mat P, LinearState *linear);

/* linear->failed: of the last factorization on entry, of this one on return */
PetscErrorCode Factor(TS ts, KSP ksp, Mat J, Mat P, LinearState *linear);

/* After a solve by the run's solver. *other: another one takes its place, which has no factor yet */
PetscErrorCode GiveUpKrylov(TS ts, PetscBool *other);

/* x from the matrix and the solver of the run, which makes a factor where it has none. ok: it is a solution */
PetscErrorCode SolveOfTheRun(TS ts, Vec b, Vec x, PetscBool *ok);

/* Why a matrix could not be factored: whether all its entries are numbers, whether it has no inverse, the package that may be the cause if it has one, and a text for I.failure (h = 0: of no step) */
PetscErrorCode MatrixHasNumbers(Mat P, PetscBool *numbers);
PetscErrorCode MatrixIsSingular(TS ts, PetscBool *yes);
PetscErrorCode PackageInDoubt(TS ts, MatSolverType *package);
PetscErrorCode ExplainLinearFailure(TS ts, PetscReal t, PetscReal h);

/* nodes.cpp: P has been evaluated at U; what TSHHT3SetNodes() has told of one matrix, for another one of the same rows */
PetscErrorCode TellPositions(Mat P, Vec U);
PetscErrorCode CopyNodes(Mat from, Mat to);

} // namespace hht3

#endif
