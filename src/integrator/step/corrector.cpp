/*
  The corrector: a modified Newton iteration in SNES (iterate.cpp), stopped by its measured rate of convergence (judge.cpp), and the ladder
  by which its matrix is reused.

  The ladder, from the cheapest rung:
    reuse      as long as h is within a factor `ratio` of the matrix's own and the last correction went at a rate < slow_rate
    renew      before a correction otherwise; within a correction when it is slow, a few times
    retry      a correction that failed with an old matrix is repeated from the prediction with a new one, at the same h
    start over at fixed steps, where h is not for us to cut: from where the step begins, where a prediction led astray
    fail       with a matrix of this very correction: TSAdapt cuts h
  Where old matrices fail again and again (a stiff direction that turns by more than 1/(h omega) in a step) reuse costs a
  correction each time, and one that passes by chance after its first iteration may be far off: after a retry the next step
  gets a new matrix, after the second retry the next two, then four, ... until a reused matrix holds.
  A step size that would grow by less than `hold` is kept, so that the factorization lives on (adapt.cpp).

  All of it goes through SNESSetLagJacobian(): -2 is "once, now", -1 is "not again". A user's -snes_lag_jacobian, line search
  or convergence test stands.
*/
#include "corrector.h"
#include "predictor.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr PetscReal proven_fraction        = 0.9; /* of h: so long a step has shown that the solver works at this length */
constexpr PetscReal fraction_after_failure = 0.7; /* of h at which a correction has failed: what h may grow to, for a while */

/* Once more with a matrix of its own, from the prediction or from where the step begins */
PetscErrorCode RunSNESAgain(TS ts, bool from_rest, PetscBool *converged)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  I.stat.retries++;
  I.corrector.matrix.want = PETSC_TRUE;
  PetscCall(Predict(ts, I.X));
  if (from_rest) PetscCall(PredictRest(I, I.X));
  PetscCall(RunSNES(ts, converged));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a step that went from where it began and not from its prediction: the smaller residual tells which to take for this one */
PetscErrorCode ChoosePrediction(TS ts)
{
  Integrator &I = Get(ts);
  WorkVec     rest, F;
  PetscReal   predicted, at_rest;

  PetscFunctionBegin;
  PetscCall(rest.like(I.X, I.spare));
  PetscCall(F.like(I.X, I.spare));
  PetscCall(SNESComputeFunction(ts->snes, I.X, F));
  PetscCall(VecNorm(F, NORM_2, &predicted));
  PetscCall(VecCopy(I.X, rest));
  PetscCall(PredictRest(I, rest));
  PetscCall(SNESComputeFunction(ts->snes, rest, F));
  PetscCall(VecNorm(F, NORM_2, &at_rest));
  I.corrector.from_rest = (PetscBool)(at_rest < predicted);
  if (I.corrector.from_rest) PetscCall(VecCopy(rest, I.X));
  PetscCall(PetscInfo(ts, "corrector: residual %g of the prediction, %g where the step begins\n", (double)predicted, (double)at_rest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* Solves (9) for X at t1 = t_n + h, from the prediction in X; the ladder above */
PetscErrorCode RunCorrector(TS ts, PetscBool *converged)
{
  Integrator &I = Get(ts);
  Corrector  &c = I.corrector;
  PetscBool   once;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)ts->snes, SNESKSPONLY, &once)); /* one solve, which has to be the step's own */
  c.matrix.want = (PetscBool)(c.matrix.due(EffectiveStep(I), c) || (once && EffectiveStep(I) != c.matrix.h));
  if (c.matrix.have && c.matrix.want) PetscCall(PetscInfo(ts, "corrector: new matrix, h = %g after %g, rate %g\n", (double)EffectiveStep(I), (double)c.matrix.h, (double)c.matrix.rate));
  if (c.from_rest) PetscCall(ChoosePrediction(ts));
  PetscCall(RunSNES(ts, converged));
  const bool retry = !*converged && !c.matrix.fresh && !c.user_lag;
  if (retry) {
    PetscCall(PetscInfo(ts, "corrector: failed with an old matrix (%s), retried with a new one\n", I.failure));
    PetscCall(RunSNESAgain(ts, false, converged));
  }
  if (!*converged && I.fixed_h && I.order.now == 2 && !c.user_lag) { /* higher orders fall to two first */
    PetscCall(PetscInfo(ts, "corrector: failed (%s), retried from where the step begins\n", I.failure));
    PetscCall(RunSNESAgain(ts, true, converged));
    c.from_rest = *converged;
  }
  c.matrix.learn(*converged, retry, c.xi_max, c.of(I.linear.constraint));
  if (!*converged) {
    /* A matrix that is singular now and then, whatever h, would bring h down to nothing: not below what the last step has shown to work
       (Failures.SingularMatrixNowAndThen) */
    if (!c.no_solve || I.h_limit <= 0 || I.h_last < proven_fraction * I.h) I.h_limit = fraction_after_failure * I.h;
    I.stat.corrector_fails++;
    PetscCall(PetscInfo(ts, "corrector: %s\n", I.failure));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
