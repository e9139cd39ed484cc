/*
  One run of SNES: the full step as a line search, the judgement of corrections (judge.cpp) as the convergence test, and messages about
  failures. A line search, convergence test, lag or type that the user has set is not changed.
*/
#include "corrector.h"
#include "integrator/entries.h"
#include "estimate.h"
#include "integrator/equations/rows.h"
#include "integrator/type/settings.h"
#include "integrator/equations/solver.h"
#include "stage.h"
#include "integrator/work_vec.h"
#include <initializer_list>

namespace hht3
{

namespace
{

/* The line search: takes the full step and judges the correction. As (40) needs the correction alone, the residual after the last
   one is not evaluated. SNESConverged_HHT() hands the judgement to the SNES. */
PetscErrorCode FullStep(SNESLineSearch ls, void *ctx)
{
  TS          ts = (TS)ctx;
  Integrator &I  = Get(ts);
  SNES        snes;
  Vec         X, F, Y;
  PetscReal   xnorm, fnorm, ynorm, e;
  PetscInt    monitors;
  PetscBool   evaluated = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(SNESLineSearchGetSNES(ls, &snes));
  PetscCall(SNESLineSearchGetVecs(ls, &X, &F, &Y, NULL, NULL));
  PetscCall(SNESLineSearchGetNorms(ls, &xnorm, &fnorm, &ynorm));
  PetscCall(SNESLineSearchSetReason(ls, SNES_LINESEARCH_SUCCEEDED));
  PetscCall(SubtractCorrection(ts, X, Y, &e));
  PetscCall(CountCorrection(ts, e, X, Y, F, &evaluated));
  monitors = snes->numbermonitors;
  if (!I.corrector.reason || monitors || I.corrector.user_test) {
    if (!evaluated) PetscCall(SNESComputeFunction(snes, X, F));
    if (monitors || I.corrector.user_test) PetscCall(VecNorm(F, NORM_2, &fnorm)); /* else not needed: a residual that is not finite shows in the next correction */
  }
  if (I.corrector.user_test) {
    PetscCall(VecNorm(X, NORM_2, &xnorm));
    PetscCall(VecNorm(Y, NORM_2, &ynorm));
    PetscCall(SNESLineSearchSetNorms(ls, xnorm, fnorm, ynorm));
  } else PetscCall(SNESLineSearchSetNorms(ls, 1, fnorm, I.corrector.e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Writes the reason of a failure into I.failure. judge.cpp has done so already for SNES_DIVERGED_DTOL; left are a residual that
   is not finite, a failed linear solve, and other reasons of SNES, such as those of a user's test. */
PetscErrorCode ExplainSNES(TS ts, SNESConvergedReason reason)
{
  Integrator &I = Get(ts);
  Vec         F;
  PetscReal   norm;

  PetscFunctionBegin;
  I.corrector.no_solve = (PetscBool)(reason == SNES_DIVERGED_LINEAR_SOLVE || reason == SNES_DIVERGED_JACOBIAN_DOMAIN);
  if (reason == SNES_DIVERGED_DTOL) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetFunction(ts->snes, &F, NULL, NULL));
  PetscCall(VecNorm(F, NORM_2, &norm));
  if (PetscIsInfOrNanReal(norm)) {
    PetscCall(NameBadRow(ts, I.t1, F));
  } else if (I.corrector.no_solve) {
    PetscCall(ExplainLinearFailure(ts, I.t1, I.h));
  } else {
    PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "SNES stopped with %s at t = %g, h = %g", SNESConvergedReasons[reason], (double)I.t1, (double)I.h));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Judges the correction that a SNES has made without the line search of this file. SNESNEWTONLS keeps its correction; for other types the
   difference to the iterate before is taken. This may have been shortened, by a trust region or a mixing parameter: so it counts for at least as
   much as the correction that the matrix would make next. */
PetscErrorCode MeasureCorrection(TS ts, SNES snes, PetscInt it)
{
  Integrator &I = Get(ts);
  PetscBool   newton;
  Vec         X, Y, F;
  PetscReal   e = 0;
  PetscBool   evaluated = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SNESNEWTONLS, &newton));
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(SNESGetSolutionUpdate(snes, &Y));
  if (!newton) {
    if (!I.before) PetscCall(VecDuplicate(X, &I.before));
    if (it) PetscCall(VecAYPX(I.before, -1, X));
    Y = I.before;
  }
  if (it) PetscCall(CorrectionNorm(ts, Y, I.h, &e));
  PetscCall(SNESGetFunction(snes, &F, NULL, NULL));
  if (!newton && it && I.corrector.matrix.have) {
    WorkVec   next;
    PetscReal left;
    PetscCall(next.like(X));
    PetscCall(SizeOfCorrectionFor(ts, F, next, &left));
    e = PetscMax(e, left);
  }
  if (!newton) PetscCall(VecCopy(X, I.before));
  if (it) PetscCall(CountCorrection(ts, e, X, Y, F, &evaluated));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a SNES type that does not call SNESConverged_HHT(): takes over its number of iterations. The rate of convergence is not
   known, so that the next step gets a new matrix unless the problem is linear. If no convergence test was called at all, nothing
   shows that the equations of the step hold. That is an error, but for SNESKSPONLY, with which the user asserts that one linear solve
   suffices. */
PetscErrorCode CountForeign(TS ts, PetscBool solved)
{
  Integrator &I = Get(ts);
  SNESType    type;
  PetscInt    its;
  PetscBool   linear;

  PetscFunctionBegin;
  PetscCall(SNESGetType(ts->snes, &type));
  PetscCall(PetscObjectTypeCompare((PetscObject)ts->snes, SNESKSPONLY, &linear));
  PetscCheck(!solved || linear || I.corrector.user_test, PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP,
             "-snes_type %s ended without asking for a test of convergence, so that nothing is known of its result: use %s or, for linear problems, %s", type, SNESNEWTONLS, SNESKSPONLY);
  PetscCall(SNESGetIterationNumber(ts->snes, &its));
  I.corrector.it = its;
  I.stat.newton += its;
  I.stat.solves += its;
  if (ts->problem_type != TS_LINEAR) I.corrector.xi_max = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* The convergence test of the SNES. With a line search other than FullStep() the correction has not been judged yet. */
PetscErrorCode SNESConverged_HHT(SNES snes, PetscInt it, PetscReal, PetscReal, PetscReal, SNESConvergedReason *reason, void *ctx)
{
  TS          ts = (TS)ctx;
  Integrator &I  = Get(ts);

  PetscFunctionBegin;
  if (I.corrector.it < it || (!it && !I.hooks.line_search)) PetscCall(MeasureCorrection(ts, snes, it));
  *reason = it ? I.corrector.reason : SNES_CONVERGED_ITERATING;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether all the vectors, of which the first is a residual at t and the others its state, are finite; if not, I.failure names the
   row of the residual */
PetscErrorCode CheckNumbers(TS ts, PetscReal t, std::initializer_list<Vec> all, PetscBool *ok)
{
  PetscFunctionBegin;
  *ok = PETSC_TRUE;
  for (Vec x : all) {
    PetscReal norm;
    PetscCall(VecNorm(x, NORM_2, &norm));
    if (PetscIsInfOrNanReal(norm)) *ok = PETSC_FALSE;
  }
  if (!*ok) PetscCall(NameBadRow(ts, t, *all.begin()));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CorrectorSetUp(TS ts)
{
  Integrator    &I = Get(ts);
  SNES           snes;
  SNESLineSearch ls;
  PetscBool      shell;

  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCheck(!snes->mf || snes->mf_operator, PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP,
             "-snes_mf leaves no matrix, which the consistent start needs; use -snes_mf_operator, whose preconditioner is the assembled matrix");
  /* Before SNESSetType(), which sets the type of the line search to backtracking if it has none, as when TSSetFromOptions() was not called */
  PetscCall(HooksLineSearch(ts));
  if (!((PetscObject)snes)->type_name) PetscCall(SNESSetType(snes, SNESNEWTONLS));
  PetscCall(HooksInstall(ts));
  PetscCall(SNESGetLineSearch(snes, &ls));
  PetscCall(PetscObjectTypeCompare((PetscObject)ls, SNESLINESEARCHSHELL, &shell));
  if (!shell) I.hooks.line_search = PETSC_FALSE; /* an option has set another type */
  if (I.hooks.line_search) PetscCall(SNESLineSearchShellSetApply(ls, FullStep, ts));
  PetscCall(TakeSNESSettings(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void BeginIteration(Integrator &I)
{
  static_cast<Correction &>(I.corrector) = {};
  I.corrector.matrix.fresh               = PETSC_FALSE;
}

/* Trust regions and line searches compare norms of residuals. Where these norms are rounding, or do not decrease on the way to the
   solution, they fail or shorten corrections to nothing. Then full steps with the present matrix, judged as usual, show whether the
   equations hold. */
static PetscErrorCode FinishWithFullSteps(TS ts, SNESConvergedReason *reason)
{
  Integrator     &I     = Get(ts);
  Corrector      &c     = I.corrector;
  const PetscBool fresh = c.matrix.fresh;
  PetscBool       newton, solved, evaluated = PETSC_FALSE;
  Vec             X, F;
  WorkVec         Y;
  PetscReal       e;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)ts->snes, SNESNEWTONLS, &newton));
  const bool shortened = newton ? !I.hooks.line_search && (*reason == SNES_DIVERGED_LINE_SEARCH || (*reason > 0 && !c.reason))
                                : *reason == SNES_DIVERGED_TR_DELTA || *reason == SNES_DIVERGED_INNER || *reason == SNES_DIVERGED_DTOL;
  if (!shortened || !c.matrix.have || c.user_test) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "corrector: full steps after %s\n", SNESConvergedReasons[*reason]));
  ts->snes_its += c.it;
  BeginIteration(I);
  c.matrix.fresh = fresh;
  PetscCall(SNESGetSolution(ts->snes, &X));
  PetscCall(SNESGetFunction(ts->snes, &F, NULL, NULL));
  PetscCall(Y.like(X));
  while (!c.reason && c.it < ts->snes->max_its) {
    if (!evaluated) PetscCall(SNESComputeFunction(ts->snes, X, F));
    PetscCall(CorrectionFor(ts, F, Y, &solved));
    if (!solved) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(SubtractCorrection(ts, X, Y, &e));
    evaluated = PETSC_FALSE;
    PetscCall(CountCorrection(ts, e, X, Y, F, &evaluated));
  }
  if (c.reason) *reason = c.reason;
  PetscCall(SNESSetConvergedReason(ts->snes, *reason)); /* by which TSAdapt judges the step */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One run of SNES from the present X, with a new matrix if corrector.matrix.want */
PetscErrorCode RunSNES(TS ts, PetscBool *ok)
{
  Integrator         &I = Get(ts);
  Corrector          &c = I.corrector;
  SNESConvergedReason reason;
  Mat                 P;
  PetscInt            its;
  PetscBool           other;

  PetscFunctionBegin;
  BeginIteration(I);
  c.user_test = HooksUserTest(ts);
  if (ts->snes->lagjacobian > 0) c.user_lag = PETSC_TRUE; /* the user has set a lag after the set-up */
  if (!c.user_lag) PetscCall(SNESSetLagJacobian(ts->snes, c.matrix.want ? -2 : -1));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  if (I.linear.refines) PetscCall(LinearSolveRoughly(P, PETSC_TRUE)); /* each correction removes the error of the last one, and the rate is measured */
  ts->snes->jacobiandomainerror = PETSC_FALSE; /* PETSc 3.18 never clears it: one singular matrix would fail all later solves */
  const PetscErrorCode failed = SNESSolve(ts->snes, NULL, I.X);
  if (I.linear.refines) PetscCall(LinearSolveRoughly(P, PETSC_FALSE));
  if (failed && !c.user_lag) PetscCall(SNESSetLagJacobian(ts->snes, -1));
  PetscCall(failed);
  PetscCall(SNESGetConvergedReason(ts->snes, &reason));
  PetscCall(FinishWithFullSteps(ts, &reason));
  if (!c.user_lag) PetscCall(SNESSetLagJacobian(ts->snes, -1)); /* FreshMatrices() may have set 1 */
  PetscCall(SNESGetLinearSolveIterations(ts->snes, &its));
  ts->ksp_its += its;
  PetscCall(GiveUpKrylov(ts, &other));
  if (other) {
    c.matrix.forget();
    c.matrix.fresh = PETSC_FALSE;
  }
  const bool foreign = !c.it;
  *ok                = (PetscBool)(reason > 0);
  if (foreign) PetscCall(CountForeign(ts, *ok));
  ts->snes_its += c.it;
  if (!*ok) PetscCall(ExplainSNES(ts, reason));
  if (*ok) PetscCall(StageVectors(ts, I.X));
  if (*ok && (foreign || c.user_test)) PetscCall(CheckNumbers(ts, I.t1, {ts->snes->vec_func, I.U1, I.V1, I.A1}, ok));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
