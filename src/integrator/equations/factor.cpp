/*
  The factorization of the Newton matrix, and what a linear solve that failed says. A package that cannot factor a matrix says so
  through its preconditioner (PCGetFailedReason()), on one rank alone if every rank has a block of its own: the ranks agree on it here,
  and the correction fails. Errors of PETSc's (a package that is not there, a defect) go up.
*/
#include "rows.h"
#include "solver.h"

namespace hht3
{

namespace
{

/* The gravest reason of all ranks; PC_SETUP_ERROR, which is negative, before the others */
PetscErrorCode FailedReason(PC pc, PCFailedReason *reason)
{
  PetscMPIInt worst[2];

  PetscFunctionBegin;
  PetscCall(PCGetFailedReason(pc, reason));
  const PetscMPIInt mine[2] = {(PetscMPIInt)*reason, -(PetscMPIInt)*reason};
  PetscCallMPI(MPI_Allreduce(mine, worst, 2, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)pc)));
  *reason = (PCFailedReason)(worst[1] > 0 ? -worst[1] : worst[0]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* No smaller step makes room. But pivots that are not numbers are delayed until nothing has room for them. */
PetscErrorCode CheckMemory(TS ts, PC pc, Mat P, PCFailedReason failed)
{
  PetscBool     numbers = PETSC_FALSE;
  MatSolverType package = NULL;
  PetscInt      n;

  PetscFunctionBegin;
  if (failed != PC_FACTOR_OUTMEMORY) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatrixHasNumbers(P, &numbers));
  PetscCall(MatGetSize(P, &n, NULL));
  PetscCall(PCFactorGetMatSolverType(pc, &package));
  PetscCheck(!numbers, PetscObjectComm((PetscObject)ts), PETSC_ERR_MEM,
             "There is not enough memory to factor the Newton matrix of %" PetscInt_FMT " rows by %s at t = %g: more ranks, or an iterative solver (-ksp_type cg -pc_type hhtconstraint -ksp_rtol 0.1)", n,
             package ? package : "the preconditioner", (double)Get(ts).t1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode MatrixHasNumbers(Mat P, PetscBool *numbers)
{
  PetscReal norm;

  PetscFunctionBegin;
  PetscCall(MatNorm(P, NORM_FROBENIUS, &norm));
  *numbers = (PetscBool)!PetscIsInfOrNanReal(norm);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ChooseSolver(KSP ksp, Mat P, LinearState *linear)
{
  PetscBool symmetric, numbers = PETSC_TRUE; /* NaN is not symmetric, but no reason to choose another solver */

  PetscFunctionBegin;
  if (linear->chosen && !linear->cholesky) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LinearIsSymmetric(P, &symmetric));
  if (linear->chosen && !symmetric) PetscCall(MatrixHasNumbers(P, &numbers));
  if (!linear->chosen || (!symmetric && numbers)) PetscCall(LinearChoose(ksp, P, symmetric, linear));
  linear->chosen = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SolverDefaults(TS ts, KSP ksp)
{
  PetscFunctionBegin;
  PetscCall(LinearDefaults(ksp, &Get(ts).linear));
  Get(ts).linear.may_be_rough = PETSC_TRUE; /* the corrector measures what its solves leave */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The KSP is PETSc's to choose again for another type of TS */
PetscErrorCode LeaveSolver(TS ts)
{
  KSP ksp;

  PetscFunctionBegin;
  if (!ts->snes) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(LinearLeave(ksp, &Get(ts).linear));
  PetscFunctionReturn(PETSC_SUCCESS);
}

constexpr PetscReal petsc_abstol = 1e-50; /* PETSc's own, which tells whether the user has set one */

/* An absolute tolerance ends a solve before it has begun where the residual, whose units differ from row to row and with h, is below it: a correction of zero, which proves
   nothing (LinearSolves.AbsoluteTolerances; PETSc's own does so where a motion dies away, LinearSolves.AMotionThatDiesAway). So solves end by the relative one alone. */
static PetscErrorCode TakeTolerance(TS ts, KSP ksp)
{
  Hooks    &H = Get(ts).hooks;
  PetscReal abstol;

  PetscFunctionBegin;
  PetscCall(KSPGetTolerances(ksp, NULL, &abstol, NULL, NULL));
  if (abstol <= 0) PetscFunctionReturn(PETSC_SUCCESS);
  if (abstol > petsc_abstol && !H.abstol_told) {
    PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts), "%s: -ksp_atol %g has no effect, as it would take every correction for zero whose residual is below it: -ksp_rtol rules\n", TSHHT3, (double)abstol));
    H.abstol_told = PETSC_TRUE;
  }
  H.abstol = abstol;
  PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, 0, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Factor(TS ts, KSP ksp, Mat J, Mat P, LinearState *linear)
{
  PC        pc;
  PetscBool other = PETSC_FALSE, numbers;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  /* a factor that failed may keep its error: PCSetUp_LU() forgives zero pivots alone, and MUMPS under PETSc forgives nothing */
  if (linear->failed) PetscCall(PCReset(pc));
  linear->failed = PC_NOERROR;
  PetscCall(TakeTolerance(ts, ksp));
  PetscCall(KSPSetOperators(ksp, J, P));
  if (ts->snes->lagpreconditioner != 1) PetscFunctionReturn(PETSC_SUCCESS); /* the user's: SNES says whether, the solve sets up */
  PetscCall(KSPSetUp(ksp));
  PetscCall(FailedReason(pc, &linear->failed));
  for (int attempt = 0; linear->failed && attempt < 2; attempt++) { /* no Krylov method, then no room */
    PetscCall(MatrixHasNumbers(P, &numbers));
    if (numbers && linear->failed == PC_FACTOR_OUTMEMORY) PetscCall(LinearChooseSmaller(ksp, P, linear, &other));
    else if (numbers) PetscCall(LinearGiveUpKrylov(ksp, P, linear, &other));
    if (!numbers || !other) break;
    PetscCall(KSPSetOperators(ksp, J, P));
    PetscCall(KSPSetUp(ksp));
    PetscCall(FailedReason(pc, &linear->failed));
  }
  PetscCall(CheckMemory(ts, pc, P, linear->failed));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode GiveUpKrylov(TS ts, PetscBool *other)
{
  KSP ksp;
  Mat P;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(LinearGiveUpKrylov(ksp, P, &Get(ts).linear, other));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the failure of the preconditioner means that the matrix has no inverse: not of an incomplete factorization, a relaxation or
   blocks */
PetscErrorCode MatrixIsSingular(TS ts, PetscBool *yes)
{
  KSP            ksp;
  PC             pc;
  PCFailedReason reason;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(FailedReason(pc, &reason));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, yes, PCLU, PCCHOLESKY, PCQR, PCREDUNDANT, ""));
  *yes = (PetscBool)(*yes && (reason == PC_FACTOR_STRUCT_ZEROPIVOT || reason == PC_FACTOR_NUMERIC_ZEROPIVOT));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The package that has met a zero pivot, unless it is known to exchange rows: the diagonal entries of multipliers are zero, and a matrix with such a pivot need not be singular */
PetscErrorCode PackageInDoubt(TS ts, MatSolverType *package)
{
  KSP       ksp;
  PC        pc;
  Mat       P;
  PetscBool factors, dense, known;

  PetscFunctionBegin;
  *package = NULL;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetOperators(pc, NULL, &P));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &factors, PCLU, PCCHOLESKY, ""));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)P, &dense, MATSEQDENSE, MATMPIDENSE, ""));
  if (!factors || dense) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCFactorGetMatSolverType(pc, package));
  PetscCall(LinearExchangesRows(*package, &known));
  if (known) *package = NULL;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Into the text of the failure; h = 0: it has nothing to do with a step */
PetscErrorCode ExplainLinearFailure(TS ts, PetscReal t, PetscReal h)
{
  Integrator        &I = Get(ts);
  KSP                ksp;
  PC                 pc;
  KSPType            ksp_type;
  PCType             pc_type;
  KSPConvergedReason ended;
  PCFailedReason     reason;
  PetscBool          bad, singular;
  MatSolverType      package;
  Mat                P;
  char               why[256] = "the Newton matrix is singular", step[32] = "";

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(NameBadMatrix(ts, t, P, &bad));
  if (bad) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(KSPGetType(ksp, &ksp_type));
  PetscCall(PCGetType(pc, &pc_type));
  PetscCall(MatrixIsSingular(ts, &singular));
  PetscCall(FailedReason(pc, &reason));
  PetscCall(KSPGetConvergedReason(ksp, &ended));
  PetscCall(PackageInDoubt(ts, &package));
  if (singular && package)
    PetscCall(PetscSNPrintf(why, sizeof(why), "the Newton matrix is singular, or a pivot of it too small for %s: -pc_factor_mat_solver_type mumps or klupair exchanges rows there", package));
  if (!singular && reason) PetscCall(PetscSNPrintf(why, sizeof(why), "the preconditioner %s cannot treat this matrix, %s", pc_type, PCFailedReasons[reason]));
  else if (!singular && ended > 0)
    PetscCall(PetscSNPrintf(why, sizeof(why), "the Krylov method %s with preconditioner %s ended with %s, and with zero or too little for the right-hand side: no solution", ksp_type, pc_type, KSPConvergedReasons[ended]));
  else if (!singular) PetscCall(PetscSNPrintf(why, sizeof(why), "the Krylov method %s with preconditioner %s ended with %s", ksp_type, pc_type, KSPConvergedReasons[ended]));
  if (h > 0) PetscCall(PetscSNPrintf(step, sizeof(step), ", h = %g", (double)h));
  PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "the linear solve failed at t = %g%s: %s", (double)t, step, why));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SolveOfTheRun(TS ts, Vec b, Vec x, PetscBool *ok)
{
  KSP                ksp;
  KSPConvergedReason reason;
  PetscReal          norm;
  PetscBool          other = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  while (other) {
    PetscCall(KSPSolve(ksp, b, x));
    Get(ts).stat.solves++;
    PetscCall(KSPGetConvergedReason(ksp, &reason));
    PetscCall(GiveUpKrylov(ts, &other));
  }
  PetscCall(VecNorm(x, NORM_INFINITY, &norm));
  *ok = (PetscBool)(reason >= 0 && !PetscIsInfOrNanReal(norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
