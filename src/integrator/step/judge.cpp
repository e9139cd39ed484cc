/*
  When the iteration of a step ends: the stopping test, and what follows from it.

  Stopping, (40) and (41b): with xi the ratio of two successive corrections, the iteration ends as soon as the error left,
  xi/(1-xi) times the last correction, changes the error estimate of the step by less than c times the tolerance. After the first
  correction, the rate last measured with the same matrix is used.

  Where h is not set by the error test (fixed steps, a largest h) the error of the step is far below the tolerance, and an
  iteration error of c times the tolerance would dominate it. Then c refers to the error estimate of the last step instead, however
  small it is; under error control to at least a hundredth of the tolerance while h_limit holds, at fixed steps fifty times more strictly.

  Corrections that no longer decrease are accepted if rounding makes corrections of their size. This is measured at the iterate
  (rounding.cpp) and holds for this iteration alone: in a position where Phi_q nearly loses rank, rounding is far above that of later
  steps, whose errors would otherwise grow with it.

  With constraints and little damping c is smaller, ConstrainedTolerance(): the error left in q excites the
  multipliers' oscillation. At alpha = -0.01, c = 1e-3 was enough for this oscillation to fail the error test, which no reduction of h cures
  (h fell to 1e-6). A c that the user has set is used as it is.

  The iteration goes on after a small correction if the residual has not followed it (verify.cpp), if the next correction would be too
  large, or if forces of driven coordinates are not balanced (driven.cpp); and, where it would fail, if corrections alternate in
  direction (bisection.cpp).
*/
#include "corrector.h"
#include "estimate.h"
#include "integrator/equations/rows.h"
#include "integrator/proofs/proofs.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

/* Factor on the iteration's tolerance at fixed steps: the iteration leaves an error of order c/h^2 in lambda and q'', and no error
   test reduces h to suit it */
constexpr PetscReal fixed_step_factor = 0.02;

/* Rate above which the iteration counts as diverging; below, an old matrix may be the cause and a new one may help */
constexpr PetscReal diverging_rate = 0.8;

/* If the next correction is at least this part of the last one, the matrix is wrong in the direction in which the iteration moves */
constexpr PetscReal stagnation_ratio = 0.5;

/* Largest number of new matrices within one slow iteration. A failed iteration, which reduces h, costs more. Table in tests/bench/README.md. */
constexpr PetscInt max_renewals = 3;

/* Whether the last correction is not larger than what rounding makes, so that further iterations do not improve it */
PetscErrorCode IsRounding(TS ts, Vec X, PetscBool *yes)
{
  Integrator &I = Get(ts);
  Corrector  &c = I.corrector;
  PetscReal   noise;

  PetscFunctionBegin;
  *yes = PETSC_FALSE;
  if (!I.fixed_h && c.e > 1) PetscFunctionReturn(PETSC_SUCCESS); /* above the tolerance nothing is accepted as rounding: the error test would not accept the step */
  PetscCall(RoundingOfCorrection(ts, X, &noise));
  *yes = (PetscBool)(c.e <= rounding_factor * noise);
  if (*yes) PetscCall(PetscInfo(ts, "corrector: corrections of %g of the tolerance are rounding at t = %g, h = %g\n", (double)c.e, (double)I.t1, (double)I.h));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A slow iteration goes on with a new matrix, made at the present iterate */
PetscErrorCode FreshMatrixNextIteration(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (I.corrector.user_lag) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "corrector: rate %g in iteration %" PetscInt_FMT ", new matrix\n", (double)I.corrector.matrix.rate, I.corrector.it));
  PetscCall(SNESSetLagJacobian(ts->snes, -2));
  I.corrector.renewals++;
  I.corrector.base = I.corrector.it;
  I.corrector.matrix.rate = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The unknown whose last correction is largest in units of the tolerance: it shows where a mechanism is stuck (JointRuns.AMotionBeyondReach) */
PetscErrorCode LabelLargestCorrection(TS ts, RowLabel *label)
{
  Integrator &I = Get(ts);
  Vec         Y;
  WorkVec     size;
  PetscInt    at;
  PetscReal   largest;

  PetscFunctionBegin;
  PetscCall(SNESGetSolutionUpdate(ts->snes, &Y));
  if (!Y) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(size.like(Y));
  PetscCall(VecPointwiseMult(size, Y, I.weight));
  PetscCall(VecAbs(size));
  PetscCall(VecMax(size, &at, &largest));
  if (largest > 0) PetscCall(LabelRow(ts, at, label));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode EndDiverged(TS ts, const char *why)
{
  Integrator &I = Get(ts);
  Corrector  &c = I.corrector;
  RowLabel    where;

  PetscFunctionBegin;
  c.reason = SNES_DIVERGED_DTOL;
  if (!PetscIsInfOrNanReal(c.e)) PetscCall(LabelLargestCorrection(ts, &where));
  PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure), "the corrector %s at t = %g, h = %g (iteration %" PetscInt_FMT ", correction %g of the tolerance%s%s)",
                          why, (double)I.t1, (double)I.h, c.it, (double)c.e, where.text[0] ? ", most of it in unknown " : "", where.text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest error that the iteration may leave, in units of the tolerance */
PetscReal IterationTolerance(const Integrator &I)
{
  const Corrector &c = I.corrector;
  const PetscReal tol = CorrectorTolerance(I);
  const PetscReal least = I.h_limit > 0 ? 0.01 : 0; /* failures have made h small, and a tolerance that falls with the error would cause more of them */
  return I.fixed_h ? fixed_step_factor * tol * PetscMin(c.wlte, 1) : tol * PetscClipInterval(c.wlte, least, 1);
}

/* The iteration does not converge with the present matrix: accepts it if that is rounding, tries a new matrix, or ends it as failed */
PetscErrorCode TryNewMatrix(TS ts, const Corrections &so_far, Vec X)
{
  Corrector      &c        = Get(ts).corrector;
  const PetscReal xi       = so_far.rate();
  PetscBool       rounding = PETSC_FALSE;

  PetscFunctionBegin;
  if (c.base || xi >= diverging_rate) PetscCall(IsRounding(ts, X, &rounding)); /* otherwise a new matrix is tried in any case */
  if (rounding && c.base) c.reason = SNES_CONVERGED_SNORM_RELATIVE;
  else if (c.renewals < max_renewals && so_far.left > 2 && (xi < diverging_rate || rounding)) PetscCall(FreshMatrixNextIteration(ts));
  else PetscCall(EndDiverged(ts, xi >= 1 ? "diverges" : "converges too slowly"));
  c.rounding = (PetscBool)(c.reason > 0);
  if (c.rounding) {
    c.matrix.rate = -1; /* a rate of rounding says nothing about the matrix */
    c.xi_max      = 0;  /* a new matrix would not help */
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Judges the iteration after a correction of size e: converged, to be continued, to be continued with a new matrix, or failed */
PetscErrorCode JudgeIteration(TS ts, PetscReal e, Vec X)
{
  Integrator       &I      = Get(ts);
  Corrector        &c      = I.corrector;
  const Corrections so_far = {e, c.e, c.it - c.base, c.limit() - c.it, (bool)I.linear.constraint};

  PetscFunctionBegin;
  c.e        = e;
  c.rounding = PETSC_FALSE;
  if (PetscIsInfOrNanReal(e)) {
    PetscCall(EndDiverged(ts, "produced a correction that is not a number"));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  const Verdict verdict = JudgeCorrections(so_far, c.matrix.rate, IterationTolerance(I), c.floor);
  const bool slow_too_early = so_far.tooEarly() && so_far.rate() >= c.of(I.linear.constraint).slow_rate;
  if (so_far.with_matrix >= 2 && !slow_too_early && e > c.floor) {
    c.matrix.rate = so_far.rate();
    c.xi_max      = PetscMax(c.xi_max, c.matrix.rate);
  }
  if (verdict == Verdict::Converged) c.reason = SNES_CONVERGED_SNORM_RELATIVE;
  else if (verdict == Verdict::TooMany) PetscCall(EndDiverged(ts, "needs too many iterations"));
  else if (verdict == Verdict::Stalled) PetscCall(TryNewMatrix(ts, so_far, X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* If the user's convergence test decides, the rate is only measured, for the reuse of the matrix */
PetscErrorCode MeasureRate(TS ts, PetscReal e)
{
  Corrector      &c  = Get(ts).corrector;
  const PetscReal xi = c.e > 0 ? e / c.e : 0;

  PetscFunctionBegin;
  c.e = e;
  if (c.it - c.base < 2) PetscFunctionReturn(PETSC_SUCCESS);
  c.matrix.rate   = xi;
  c.xi_max = PetscMax(c.xi_max, xi);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode FailUnproved(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  I.corrector.reason = SNES_DIVERGED_DTOL;
  if (I.corrector.wrong_jacobian) I.corrector.jacobian_faults += 1;
  PetscCall(PetscSNPrintf(I.failure, sizeof(I.failure),
                          "the residual does not follow the corrections at t = %g, h = %g: the Jacobian (TSSetI2Jacobian()) has a stiffness of up to %g times the "
                          "inertia of an unknown, which the residual has not; -snes_test_jacobian compares the two. If the Jacobian is right, the roles of unknowns detected at the start may no longer hold: give them by TSHHT3SetIS()",
                          (double)I.t1, (double)I.h, (double)I.verify.largest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The iteration goes on with a new matrix at every iterate: while a stiff direction turns, spurious forces at an iterate give a matrix that is
   wrong again at the next one */
PetscErrorCode FreshMatrices(TS ts)
{
  PetscFunctionBegin;
  if (Get(ts).corrector.user_lag) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FreshMatrixNextIteration(ts));
  PetscCall(SNESSetLagJacobian(ts->snes, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residual has not followed the correction. The iteration goes on, so that its rate can be measured; then with new matrices, as
   stiffness may end on the way of a correction. If these do not help either, the step fails and is repeated with a smaller h, at
   which the stiffness matters less. */
PetscErrorCode GoOnUnproved(TS ts)
{
  Corrector &c = Get(ts).corrector;

  PetscFunctionBegin;
  c.reason  = SNES_CONVERGED_ITERATING;
  if (c.wrong_jacobian || c.it >= c.limit()) PetscCall(FailUnproved(ts));
  else if (c.it - c.base >= 2) {
    if (c.renewals >= max_renewals || c.user_lag) PetscCall(FailUnproved(ts));
    else PetscCall(FreshMatrices(ts));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An iteration that has failed with a matrix of its own may alternate between two sides of a steep force; after a bisection it may do
   so at once. Then bisection finds the point between them. In a system with several steep forces the next bisection is at another
   one, and each adds two iterations to the limit. */
PetscErrorCode GoOnBetween(TS ts, Vec X, Vec dX, Vec F, PetscBool *evaluated)
{
  Corrector &c = Get(ts).corrector;
  PetscBool  found;

  PetscFunctionBegin;
  if (!(c.matrix.fresh || c.user_lag) || c.it >= c.limit()) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(BisectIterates(ts, X, dX, F, &found));
  *evaluated = found;
  if (!found) PetscFunctionReturn(PETSC_SUCCESS);
  c.reason = SNES_CONVERGED_ITERATING;
  c.met++;
  PetscCall(FreshMatrixNextIteration(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether the correction `next` goes on in the direction of dX: its component along dX is at least stagnation_ratio |dX| */
PetscErrorCode ContinuesCorrection(const Integrator &I, Vec dX, Vec next, Vec work, PetscBool *yes)
{
  PetscScalar dot, square;

  PetscFunctionBegin;
  PetscCall(WeightCorrection(I, dX, work));
  PetscCall(VecDot(dX, work, &square));
  PetscCall(VecDot(next, work, &dot));
  *yes = (PetscBool)(PetscRealPart(dot) >= stagnation_ratio * PetscRealPart(square));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residual F has become small along with the last correction, but what is left of it may have another direction: at a right angle
   to a stiff spring it is a force on a soft direction, which a matrix that is slightly off takes for a stiff one, correction after
   correction. So the next correction is computed. If it is small, this proves nothing as long as it goes on in the direction of the
   last one. */
PetscErrorCode AskNextCorrection(TS ts, Vec X, Vec dX, Vec F)
{
  Integrator     &I    = Get(ts);
  Corrector      &c    = I.corrector;
  const Vec       next = I.verify.work, work = I.verify.model; /* free again: the proof is over */
  const PetscReal tol  = IterationTolerance(I);
  PetscReal       e;
  PetscBool       goes_on = PETSC_TRUE, rounding = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(SizeOfCorrectionFor(ts, F, next, &e));
  const PetscReal xi = c.e > 0 ? e / c.e : 0;
  if (e < PETSC_INFINITY && CorrectorError(xi, e) <= tol) PetscFunctionReturn(PETSC_SUCCESS);
  if (e <= immediate_tolerance * tol) PetscCall(ContinuesCorrection(I, dX, next, work, &goes_on));
  if (goes_on && c.base && xi >= stagnation_ratio) PetscCall(IsRounding(ts, X, &rounding));
  if (!goes_on || rounding) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "corrector: after a correction of %g of the tolerance the next one is %g\n", (double)c.e, (double)e));
  c.reason = SNES_CONVERGED_ITERATING;
  if (c.it >= c.limit()) PetscCall(EndDiverged(ts, "needs too many iterations"));
  else if (xi >= stagnation_ratio) PetscCall(FreshMatrices(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces of driven coordinates, which corrections do not show, have to be balanced, too. With an old matrix they may not converge:
   then a new one is made. */
PetscErrorCode AskForces(TS ts, Vec X, Vec F, PetscBool *evaluated)
{
  Integrator     &I      = Get(ts);
  Corrector      &c      = I.corrector;
  const PetscReal before = c.forces;
  PetscBool       good;

  PetscFunctionBegin;
  PetscCall(ForcesOfDriven(ts, IterationTolerance(I), X, F, evaluated, &good));
  if (good) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "corrector: forces of driven coordinates, %g of the tolerance after iteration %" PetscInt_FMT "\n", (double)c.forces, c.it));
  c.reason = SNES_CONVERGED_ITERATING;
  if (c.it >= c.limit()) PetscCall(EndDiverged(ts, "does not balance the forces of driven coordinates"));
  else if (c.it - c.base >= 2 && c.forces >= c.slow_rate * before && c.renewals < max_renewals) PetscCall(FreshMatrixNextIteration(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* Norms below this count as zero: their squares underflow, so that a solution of zero is right. A motion that dies away gets there
   (LinearSolves.AMotionThatDiesAway). */
constexpr PetscReal least_norm = 1e-150;

/* A Krylov method with a singular preconditioner can report convergence although it has solved nothing
   (LinearSolves.PreconditionersOfOtherProblems). Any solution of J dX = F satisfies |dX| >= |F|/|J|; a dX of less than half of that
   is recognized here. */
PetscErrorCode SolveFoundNothing(TS ts, Vec dX, Vec F, bool after, PetscBool *yes)
{
  KSP       ksp;
  PC        pc;
  Mat       J;
  PetscReal d, f, norm;
  PetscBool direct, has_norm;

  PetscFunctionBegin;
  PetscCall(VecNorm(dX, NORM_INFINITY, &d));
  PetscCall(VecNorm(F, NORM_2, &f));
  *yes = (PetscBool)(d == 0 && f > least_norm);
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &direct, PCLU, PCCHOLESKY, ""));
  if (d == 0 || after || direct || Get(ts).linear.constraint) PetscFunctionReturn(PETSC_SUCCESS); /* PCHHTCONSTRAINT is singular only if the matrix is */
  PetscCall(KSPGetOperators(ksp, &J, NULL));
  PetscCall(MatHasOperation(J, MATOP_NORM, &has_norm));
  if (!has_norm) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatNorm(J, NORM_FROBENIUS, &norm));
  PetscCall(VecNorm(dX, NORM_2, &d));
  *yes = (PetscBool)(f > 2 * norm * PetscMax(d, least_norm));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Counts and judges the correction dX, which has led to X, and proves it if it is to be the last one. On return F holds the residual
   at X if `evaluated`. */
PetscErrorCode CountCorrection(TS ts, PetscReal e, Vec X, Vec dX, Vec F, PetscBool *evaluated)
{
  Integrator &I = Get(ts);
  PetscBool   proved, unanswered = PETSC_FALSE;

  PetscFunctionBegin;
  I.corrector.it++;
  I.stat.newton++;
  I.stat.solves++;
  if (!I.corrector.user_test && (e == 0 || !*evaluated)) PetscCall(SolveFoundNothing(ts, dX, F, *evaluated, &unanswered));
  if (unanswered) {
    I.corrector.reason = SNES_DIVERGED_LINEAR_SOLVE;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(NoteForces(ts, F, *evaluated));
  if (I.corrector.user_test) PetscCall(MeasureRate(ts, e));
  else PetscCall(JudgeIteration(ts, e, X));
  if (I.corrector.reason > 0) {
    PetscCall(VerifyCorrection(ts, X, dX, F, evaluated, &proved));
    if (!proved) PetscCall(GoOnUnproved(ts));
    else if (I.verify.looked && !I.corrector.rounding) PetscCall(AskNextCorrection(ts, X, dX, F));
    if (I.corrector.reason > 0 && !I.corrector.rounding) PetscCall(AskForces(ts, X, F, evaluated));
  } else if (I.corrector.reason < 0 && !PetscIsInfOrNanReal(e)) {
    PetscCall(GoOnBetween(ts, X, dX, F, evaluated));
    if (!I.corrector.reason) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(BlameJacobian(ts, X, dX, F, evaluated));
    if (I.corrector.wrong_jacobian) PetscCall(FailUnproved(ts));
  } else if (!I.corrector.reason && I.corrector.met && I.corrector.it - I.corrector.base == 1) PetscCall(GoOnBetween(ts, X, dX, F, evaluated));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
