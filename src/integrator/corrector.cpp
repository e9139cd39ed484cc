/*
  The corrector: a modified Newton iteration in SNES, stopped by its measured rate of convergence, and the ladder by which
  its matrix is reused.

  Stopping, (40) and (41b): with xi the ratio of two successive corrections, the iteration ends as soon as the error left,
  xi/(1-xi) times the last correction, changes the error estimate of the step by less than c times the tolerance. The rate
  of the last corrections with the same matrix answers already after the first iteration.

  Where h is not set by the error test (fixed steps, a largest h) the step's own error is far below the tolerance, and an
  iteration error of c times the tolerance would be all that is left of its accuracy. Then c refers to the error estimate of
  the last step instead, down to a hundredth of the tolerance under error control and without limit (and fifty times more
  strictly) at fixed steps.

  A correction that no longer falls is accepted where rounding makes one of its size, which is measured then and there (rounding.cpp) and
  holds for this correction alone: in a position where Phi_q nearly loses rank it is far above that of later steps, whose errors would grow with it.

  With constraints and little damping c is smaller, ConstrainedTolerance(): what is left of a correction in q excites the
  multipliers' oscillation, and at alpha = -0.01 c = 1e-3 was enough to fill the error test with it, which no reduction of h mends
  (h fell to 1e-6). A c that the user has set stands.

  The ladder, from the cheapest rung:
    reuse      as long as h is within a factor `ratio` of the matrix's own and the last correction went at a rate < slow_rate
    renew      before a correction otherwise; within a correction when it is slow, a few times
    retry      a correction that failed with an old matrix is repeated from the prediction with a new one, at the same h
    fail       with a matrix of this very correction: TSAdapt cuts h
  Where old matrices fail again and again (a stiff direction that turns by more than 1/(h omega) in a step) reuse costs a
  correction each time, and one that passes by chance after its first iteration may be far off: after a retry the next step
  gets a new matrix, after the second retry the next two, then four, ... until a reused matrix holds.
  A step size that would grow by less than `hold` is kept, so that the factorization lives on (estimate.cpp).

  All of it goes through SNESSetLagJacobian(): -2 is "once, now", -1 is "not again". A user's -snes_lag_jacobian, line search
  or convergence test stands.
*/
#include "impl.h"

namespace hht3
{

namespace
{

/* A remembered rate is believed down to here: it was measured steps ago on smaller corrections, and the matrix has aged since.
   With 0.02 the error that first iterations left behind was up to ten times that of the step (heavy top, 1e-7); 0.3 costs
   5 to 20 % more iterations. */
constexpr PetscReal remembered = 0.3;

/* At fixed steps no error test forgives what the iteration leaves in lambda and q'', of order c/h^2: it gets this much less */
constexpr PetscReal fixed = 0.02;

/* New matrices within one correction that is slow: cheaper than a failed one, which cuts h */
constexpr PetscInt max_renewals = 3;

/* Steps without reuse after old matrices have failed, at most */
constexpr PetscInt max_renew_steps = 32;

const char *RoleName(const Integrator &I, PetscInt local)
{
  static const char *const names[] = {"the equation of motion of a coordinate", "the equation of a first-order state",
                                      "a holonomic constraint", "a velocity-level constraint",
                                      "the definition of a variable", "the definition of a force state"};
  return names[RoleOf(I, local)];
}

/* The first row of the residual that is not a number, for the message */
PetscErrorCode NameBadRow(TS ts, Vec F)
{
  Integrator        &I = Get(ts);
  const PetscScalar *f;
  PetscInt           n, start, bad[2] = {HHT3_INT_MAX, 0}, first;
  PetscMPIInt        rank;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(F, &start, NULL));
  PetscCall(VecGetLocalSize(F, &n));
  PetscCall(VecGetArrayRead(F, &f));
  for (PetscInt i = n - 1; i >= 0; i--)
    if (PetscIsInfOrNanScalar(f[i])) {
      bad[0] = start + i;
      bad[1] = RoleOf(I, i);
    }
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCallMPI(MPI_Allreduce(&bad[0], &first, 1, MPIU_INT, MPI_MIN, PetscObjectComm((PetscObject)ts)));
  PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)ts), &rank));
  if (first < HHT3_INT_MAX) {
    PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure),
                            "the application's residual is not a number at t = %g, first in row %" PetscInt_FMT "%s%s",
                            (double)I.t1, first, bad[0] == first ? ", " : "", bad[0] == first ? RoleName(I, first - start) : ""));
  } else {
    PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "a correction is not a number at t = %g", (double)I.t1));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* In the start there is no tolerance: relative to the unknowns themselves */
PetscErrorCode RelativeNorm(Vec X, Vec dX, PetscReal *e)
{
  PetscReal x, d;

  PetscFunctionBegin;
  PetscCall(VecNorm(dX, NORM_2, &d));
  PetscCall(VecNorm(X, NORM_2, &x));
  *e = x > 0 ? d / x : d;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A correction that no longer falls is as good as it gets where rounding makes one of its size */
PetscErrorCode AcceptRounding(TS ts, Vec X, PetscBool *accepted)
{
  Integrator &I = Get(ts);
  Corrector  &c = I.corrector;
  PetscReal   noise;

  PetscFunctionBegin;
  PetscCall(RoundingOfCorrection(ts, X, &noise));
  *accepted = (PetscBool)(c.e <= noise);
  if (!*accepted) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "corrector: corrections of %g of the tolerance are rounding at t = %g, h = %g\n", (double)c.e, (double)I.t1, (double)I.h));
  c.reason = SNES_CONVERGED_SNORM_RELATIVE;
  c.rate   = -1; /* that of noise says nothing of the matrix */
  c.xi_max = 0; /* a new matrix would not help */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Diverge(TS ts, const char *why)
{
  Integrator &I = Get(ts);
  Corrector  &c = I.corrector;

  PetscFunctionBegin;
  c.reason = SNES_DIVERGED_DTOL;
  PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "the corrector %s at t = %g, h = %g (iteration %" PetscInt_FMT ", correction %g of the tolerance)",
                          why, (double)I.t1, (double)I.h, c.it, (double)c.e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What may be left of a correction, in units of the tolerance */
PetscReal Tolerance(const Integrator &I)
{
  const Corrector &c = I.corrector;
  if (I.mode == Mode::Start) return 1e-13;
  const PetscReal tol = CorrectorTolerance(I);
  return I.fixed_h ? fixed * tol * PetscMin(c.wlte, 1) : tol * PetscClipInterval(c.wlte, 0.01, 1);
}

/* One more correction of size e has been made: converged, going on, renew the matrix, or give up */
PetscErrorCode Judge(TS ts, PetscReal e, Vec X)
{
  Integrator     &I     = Get(ts);
  Corrector      &c     = I.corrector;
  const PetscReal old_e = c.e;
  const PetscReal tol   = Tolerance(I);
  const PetscInt  left  = c.max_it - c.it;

  PetscFunctionBegin;
  c.e = e;
  if (PetscIsInfOrNanReal(e)) {
    PetscCall(Diverge(ts, "produced a correction that is not a number"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (e <= c.floor) {
    c.reason = SNES_CONVERGED_SNORM_RELATIVE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (c.it - c.base < 2) { /* no rate of this matrix in this correction yet */
    const bool known = c.rate >= 0 && CorrectorError(PetscMax(c.rate, remembered), e) <= tol;
    if (known || e <= 0.1 * tol) c.reason = SNES_CONVERGED_SNORM_RELATIVE;
    else if (left <= 0) PetscCall(Diverge(ts, "needs too many iterations"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  const PetscReal xi = e / old_e;
  c.rate             = xi;
  c.xi_max           = PetscMax(c.xi_max, xi);
  if (CorrectorError(xi, e) <= tol) {
    c.reason = SNES_CONVERGED_SNORM_RELATIVE;
  } else if (I.mode == Mode::Start && xi > 0.3) {
    if (e < 1e-8) c.reason = SNES_CONVERGED_SNORM_RELATIVE; /* rounding */
    else if (left <= 0 || xi > 2) PetscCall(Diverge(ts, "finds no consistent accelerations"));
    else PetscCall(FreshMatrixNextIteration(ts));
  } else if (xi >= 1 || left <= 0 || PetscPowReal(xi, left) * CorrectorError(xi, e) > tol) {
    PetscBool rounding = PETSC_FALSE;
    if (I.mode == Mode::Step) PetscCall(AcceptRounding(ts, X, &rounding));
    if (rounding) PetscFunctionReturn(PETSC_SUCCESS);
    if (c.renewals < max_renewals && left > 2 && xi < 0.8) PetscCall(FreshMatrixNextIteration(ts));
    else PetscCall(Diverge(ts, xi >= 1 ? "diverges" : "converges too slowly"));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where the user's test decides, the rate is only measured, for the reuse of the matrix */
PetscErrorCode Measure(TS ts, PetscReal e)
{
  Corrector      &c  = Get(ts).corrector;
  const PetscReal xi = c.e > 0 ? e / c.e : 0;

  PetscFunctionBegin;
  c.e = e;
  if (c.it - c.base < 2) PetscFunctionReturn(PETSC_SUCCESS);
  c.rate   = xi;
  c.xi_max = PetscMax(c.xi_max, xi);
  if (xi >= c.slow_rate && c.renewals < max_renewals) PetscCall(FreshMatrixNextIteration(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FailUnproved(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  I.corrector.reason = SNES_DIVERGED_DTOL;
  if (I.corrector.wrong_jacobian) I.corrector.blames += 1;
  PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure),
                          "the residual does not follow the corrections at t = %g, h = %g: the Jacobian (TSSetI2Jacobian()) claims up to %g times the "
                          "inertia of an unknown, which the residual does not show; -snes_test_jacobian compares the two",
                          (double)I.t1, (double)I.h, (double)I.verify.largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residual has not followed the correction: on with the iteration, whose rate will tell; then with a new matrix; and where that
   one is no better, the application's Jacobian is at fault, of which less is left at a smaller h */
PetscErrorCode GoOnUnproved(TS ts)
{
  Corrector &c = Get(ts).corrector;

  PetscFunctionBegin;
  c.reason  = SNES_CONVERGED_ITERATING;
  if (c.wrong_jacobian || c.it >= c.max_it) PetscCall(FailUnproved(ts));
  else if (c.it - c.base >= 2) {
    if (c.fresh || c.user_lag) PetscCall(FailUnproved(ts));
    else PetscCall(FreshMatrixNextIteration(ts));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The correction dX has led to X: judged, and proved if it is to be the last one. F holds the residual at X on return if `evaluated`. */
PetscErrorCode CountCorrection(TS ts, PetscReal e, Vec X, Vec dX, Vec F, PetscBool *evaluated)
{
  Integrator &I = Get(ts);
  PetscBool   proved;

  PetscFunctionBegin;
  I.corrector.it++;
  I.stat.newton++;
  I.stat.solves++;
  if (I.corrector.user_test) PetscCall(Measure(ts, e));
  else PetscCall(Judge(ts, e, X));
  if (I.corrector.reason > 0) {
    PetscCall(Verify(ts, X, dX, F, evaluated, &proved));
    if (!proved) PetscCall(GoOnUnproved(ts));
  } else if (I.corrector.reason < 0 && !PetscIsInfOrNanReal(e)) {
    PetscCall(BlameJacobian(ts, X, dX, F, evaluated));
    if (I.corrector.wrong_jacobian) PetscCall(FailUnproved(ts));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The full step, and no residual after the last one: (40) needs the correction alone. The judgement is handed to SNES by
   ConvergenceTest(). */
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
    if (monitors || I.corrector.user_test) PetscCall(VecNorm(F, NORM_2, &fnorm)); /* a residual that is not a number shows in the next correction */
  }
  if (I.corrector.user_test) {
    PetscCall(VecNorm(X, NORM_2, &xnorm));
    PetscCall(VecNorm(Y, NORM_2, &ynorm));
    PetscCall(SNESLineSearchSetNorms(ls, xnorm, fnorm, ynorm));
  } else PetscCall(SNESLineSearchSetNorms(ls, 1, fnorm, I.corrector.e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* SNES ended without our judgement: a residual or a linear solve that went wrong, or a user's own test */
PetscErrorCode ExplainSNES(TS ts, SNESConvergedReason reason)
{
  Integrator &I = Get(ts);
  Vec         F;

  PetscFunctionBegin;
  I.corrector.no_solve = (PetscBool)(reason == SNES_DIVERGED_LINEAR_SOLVE || reason == SNES_DIVERGED_JACOBIAN_DOMAIN);
  if (I.corrector.no_solve) {
    PetscCall(ExplainLinearFailure(ts));
  } else if (reason != SNES_DIVERGED_DTOL) {
    PetscCall(SNESGetFunction(ts->snes, &F, NULL, NULL));
    PetscReal norm;
    PetscCall(VecNorm(F, NORM_2, &norm));
    if (PetscIsInfOrNanReal(norm)) PetscCall(NameBadRow(ts, F));
    else PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "SNES stopped with %s at t = %g, h = %g", SNESConvergedReasons[reason], (double)I.t1, (double)I.h));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* The correction that a SNES has made without our line search. Newton's methods leave it behind; of others the iterate before is kept. */
static PetscErrorCode MeasureCorrection(TS ts, SNES snes, PetscInt it)
{
  Integrator &I = Get(ts);
  PetscBool   newton;
  Vec         X, Y, F;
  PetscReal   e = 0;
  PetscBool   evaluated = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)snes, &newton, SNESNEWTONLS, SNESNEWTONTR, SNESNEWTONTRDC, ""));
  PetscCall(SNESGetSolution(snes, &X));
  PetscCall(SNESGetSolutionUpdate(snes, &Y));
  if (!newton) {
    if (!I.before) PetscCall(VecDuplicate(X, &I.before));
    if (it) PetscCall(VecAYPX(I.before, -1, X));
    Y = I.before;
  }
  if (it) PetscCall(CorrectionNorm(ts, Y, &e));
  if (!newton) PetscCall(VecCopy(X, I.before));
  PetscCall(SNESGetFunction(snes, &F, NULL, NULL));
  if (it) PetscCall(CountCorrection(ts, e, X, Y, F, &evaluated));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* SNES's test. Where a line search other than ours is in place the correction has not been judged yet. */
PetscErrorCode ConvergenceTest(SNES snes, PetscInt it, PetscReal, PetscReal, PetscReal, SNESConvergedReason *reason, void *ctx)
{
  TS          ts = (TS)ctx;
  Integrator &I  = Get(ts);

  PetscFunctionBegin;
  if (I.corrector.it < it || (!it && !I.hooks.line_search)) PetscCall(MeasureCorrection(ts, snes, it));
  *reason = it ? I.corrector.reason : SNES_CONVERGED_ITERATING;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the state at t1 and the residual F there are numbers, named if not */
PetscErrorCode CheckNumbers(TS ts, Vec F, PetscBool *ok)
{
  Integrator &I     = Get(ts);
  Vec         all[] = {F, I.U1, I.V1, I.A1};

  PetscFunctionBegin;
  *ok = PETSC_TRUE;
  for (Vec x : all) {
    PetscReal norm;
    PetscCall(VecNorm(x, NORM_2, &norm));
    if (PetscIsInfOrNanReal(norm)) *ok = PETSC_FALSE;
  }
  if (!*ok) PetscCall(NameBadRow(ts, F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A slow correction goes on with a matrix made at its present iterate */
PetscErrorCode FreshMatrixNextIteration(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (I.corrector.user_lag) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "corrector: rate %g in iteration %" PetscInt_FMT ", new matrix\n", (double)I.corrector.rate, I.corrector.it));
  PetscCall(SNESSetLagJacobian(ts->snes, -2));
  I.corrector.renewals++;
  I.corrector.base = I.corrector.it;
  I.corrector.rate = -1;
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
  /* before SNESSetType(), which gives backtracking to a line search without a type: TSSetFromOptions() need not have been called */
  PetscCall(HooksLineSearch(ts));
  if (!((PetscObject)snes)->type_name) PetscCall(SNESSetType(snes, SNESNEWTONLS));
  PetscCall(HooksInstall(ts));
  PetscCall(SNESGetLineSearch(snes, &ls));
  PetscCall(PetscObjectTypeCompare((PetscObject)ls, SNESLINESEARCHSHELL, &shell));
  if (!shell) I.hooks.line_search = PETSC_FALSE; /* an option has named another */
  if (I.hooks.line_search) PetscCall(SNESLineSearchShellSetApply(ls, FullStep, ts));
  PetscCall(TakeSNESSettings(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A SNES type that asks for no convergence test of ours (ksponly, ms) has counted by itself. How well the matrix served is not known:
   where the problem is not linear, the next step gets a new one. */
static PetscErrorCode CountForeign(TS ts)
{
  Integrator &I = Get(ts);
  PetscInt    its;

  PetscFunctionBegin;
  PetscCall(SNESGetIterationNumber(ts->snes, &its));
  I.corrector.it = its;
  I.stat.newton += its;
  I.stat.solves += its;
  if (ts->problem_type != TS_LINEAR) I.corrector.xi_max = 1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A type that never asks for the convergence test (ngs, ms) leaves it open whether the equations of the step hold. One linear solve is
   the user's word that they do. */
static PetscErrorCode CheckJudged(TS ts)
{
  SNESType  type;
  PetscBool linear;

  PetscFunctionBegin;
  PetscCall(SNESGetType(ts->snes, &type));
  PetscCall(PetscObjectTypeCompare((PetscObject)ts->snes, SNESKSPONLY, &linear));
  PetscCheck(linear || Get(ts).corrector.user_test, PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP,
             "-snes_type %s ended without asking for a test of convergence, so that nothing is known of its result: use %s or, for linear problems, %s", type, SNESNEWTONLS, SNESKSPONLY);
  PetscFunctionReturn(PETSC_SUCCESS);
}

static void BeginIteration(Integrator &I)
{
  Corrector &c = I.corrector;
  c.it = c.base = c.renewals = 0;
  c.e = c.xi_max = 0;
  c.reason = SNES_CONVERGED_ITERATING;
  c.fresh  = PETSC_FALSE;
  c.wrong_jacobian = PETSC_FALSE;
}

/* One run of SNES from the present X. A new matrix is asked for by want_matrix. */
PetscErrorCode Iterate(TS ts, PetscBool *ok)
{
  Integrator         &I = Get(ts);
  Corrector          &c = I.corrector;
  SNESConvergedReason reason;
  PetscInt            its;

  PetscFunctionBegin;
  BeginIteration(I);
  c.user_test = HooksUserTest(ts);
  if (ts->snes->lagjacobian > 0) c.user_lag = PETSC_TRUE; /* since the set-up */
  if (!c.user_lag) PetscCall(SNESSetLagJacobian(ts->snes, c.want_matrix ? -2 : -1));
  ts->snes->jacobiandomainerror = PETSC_FALSE; /* PETSc 3.18 never clears it: one singular matrix would fail all later solves */
  PetscCall(SNESSolve(ts->snes, NULL, I.X));
  PetscCall(SNESGetConvergedReason(ts->snes, &reason));
  PetscCall(SNESGetLinearSolveIterations(ts->snes, &its));
  ts->ksp_its += its;
  const bool foreign = !c.it;
  *ok                = (PetscBool)(reason > 0);
  if (foreign && *ok) PetscCall(CheckJudged(ts));
  if (foreign) PetscCall(CountForeign(ts));
  ts->snes_its += c.it;
  if (!*ok) PetscCall(ExplainSNES(ts, reason));
  if (*ok) PetscCall(StageVectors(ts, I.X));
  if (*ok && (foreign || c.user_test)) PetscCall(CheckNumbers(ts, ts->snes->vec_func, ok));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One correction of the start, with the assembled matrix */
static PetscErrorCode CorrectStart(TS ts, KSP ksp, Vec F, Vec Y, PetscBool *ok)
{
  Integrator        &I = Get(ts);
  KSPConvergedReason reason;
  PetscInt           its;
  PetscReal          e = 0;
  PetscBool          evaluated = PETSC_FALSE; /* of no use in the start, where nothing is to be proved */
  PetscFunctionBegin;
  PetscCall(KSPSolve(ksp, F, Y));
  PetscCall(KSPGetIterationNumber(ksp, &its));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  ts->ksp_its += its;
  *ok = (PetscBool)(reason >= 0);
  if (!*ok) {
    I.corrector.no_solve = PETSC_TRUE;
    PetscCall(ExplainLinearFailure(ts));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VecAXPY(I.X, -1, Y));
  PetscCall(RelativeNorm(I.X, Y, &e));
  PetscCall(CountCorrection(ts, e, I.X, Y, F, &evaluated));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The corrector of the start: the same iteration and judgement without SNES, whose type, test and number of iterations are the user's
   and meant for steps. The matrix has been made. */
PetscErrorCode IterateStart(TS ts, PetscBool *ok)
{
  Integrator &I = Get(ts);
  Corrector  &c = I.corrector;
  KSP         ksp;
  Mat         P;
  Vec         F, Y;

  PetscFunctionBegin;
  BeginIteration(I);
  c.user_test = PETSC_FALSE;
  c.max_it    = CorrectorOptions().max_it;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(VecDuplicate(I.X, &F));
  PetscCall(VecDuplicate(I.X, &Y));
  *ok = PETSC_TRUE;
  while (*ok && !c.reason) {
    const PetscInt renewals = c.renewals;
    PetscCall(FormFunction(ts->snes, I.X, F, ts));
    PetscCall(CheckNumbers(ts, F, ok));
    if (*ok) PetscCall(CorrectStart(ts, ksp, F, Y, ok));
    if (*ok && c.renewals > renewals) PetscCall(FormJacobian(ts->snes, I.X, P, P, ts));
  }
  ts->snes_its += c.it;
  *ok = (PetscBool)(*ok && c.reason > 0);
  if (*ok) PetscCall(StageVectors(ts, I.X));
  PetscCall(SNESSetConvergedReason(ts->snes, *ok ? SNES_CONVERGED_SNORM_RELATIVE : SNES_DIVERGED_INNER)); /* for TSAdapt */
  PetscCall(VecDestroy(&Y));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the end of a correction says about the reuse of matrices in the next steps */
static void LearnReuse(Corrector &c, bool converged, bool retried)
{
  const bool reused = converged && !c.fresh;
  if (retried) c.renew_steps = c.renew_left = PetscClipInterval(2 * c.renew_steps, 1, max_renew_steps);
  else if (reused) c.renew_steps = c.renew_left = 0;
  else if (c.renew_left > 0) c.renew_left--;
  c.want_matrix = (PetscBool)(!converged || c.xi_max >= c.slow_rate || c.renew_left > 0);
}

/* Solves (9) for X at t1 = t_n + h, from the prediction in X; the ladder above */
PetscErrorCode Correct(TS ts, PetscBool *converged)
{
  Integrator     &I = Get(ts);
  Corrector      &c = I.corrector;
  const PetscReal q = c.h_matrix > 0 ? I.h / c.h_matrix : 0;

  PetscFunctionBegin;
  if (!c.have_matrix || q > c.ratio || q * c.ratio < 1) c.want_matrix = PETSC_TRUE;
  if (c.have_matrix && c.want_matrix) PetscCall(PetscInfo(ts, "corrector: new matrix, h/h_matrix = %g, rate %g\n", (double)q, (double)c.rate));
  PetscCall(Iterate(ts, converged));
  const bool retry = !*converged && !c.fresh && !c.user_lag;
  if (retry) {
    PetscCall(PetscInfo(ts, "corrector: failed with an old matrix (%s), retried with a new one\n", I.failure));
    I.stat.retries++;
    c.want_matrix = PETSC_TRUE;
    PetscCall(Predict(ts, I.X));
    PetscCall(Iterate(ts, converged));
  }
  LearnReuse(c, *converged, retry);
  if (!*converged) {
    /* A matrix that is singular now and then, whatever h, would bring h down to nothing: not below what steps since the last
       failure have shown to work */
    if (!c.no_solve || I.h_limit <= 0 || I.h_proven < 0.9 * I.h) I.h_limit = 0.7 * I.h;
    I.h_proven = 0;
    I.stat.corrector_fails++;
    PetscCall(PetscInfo(ts, "corrector: %s\n", I.failure));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
