/*
  The corrector: a modified Newton iteration in SNES (iterate.cpp), stopped by its measured rate of convergence (judge.cpp), and the rules
  by which the Newton matrix is reused.

  These are, from the cheapest to the most expensive:
    reuse      while h is within a factor `ratio` of the h of the matrix and the last iteration converged at a rate < slow_rate
    renew      otherwise, before the iteration; also within an iteration that is slow, at most max_renewals times
    retry      an iteration that failed with an old matrix is repeated from the prediction with a new one, at the same h
    start over at fixed steps, where h must not be cut: repeated from the positions at t_n, as the prediction may be bad
    fail       if it failed with a matrix made in this very iteration: TSAdapt cuts h
  Where old matrices fail again and again (a stiff direction that turns by more than 1/(h omega) in a step) each attempt at reuse costs a
  failed iteration, and an iteration that is accepted by chance after its first correction may be far off. So the step after a retry gets
  a new matrix, after the second retry the next two steps, then four, ... until a reused matrix works (MatrixPolicy::learn()).
  A step size that would grow by less than a factor `hold` is kept, so that the factorization can be used again (adapt.cpp).

  SNESSetLagJacobian() controls all of this: -2 means "one new matrix, now", -1 "no new matrix". A user's -snes_lag_jacobian, line search
  or convergence test has precedence.
*/
#include "corrector.h"
#include "predictor.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr PetscReal fraction_after_failure = 0.7; /* h_limit as a part of the h at which the corrector has failed */

/* Repeats the iteration with a new Newton matrix, from the prediction or, if from_rest, from the positions at t_n (PredictRest()) */
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

/* After a step that converged only from the positions at its beginning: starts this one from these or from the prediction, whichever
   has the smaller residual */
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

/* Solves (9) for X at t1 = t_n + h, from the prediction in X, by the rules above */
PetscErrorCode RunCorrector(TS ts, PetscBool *converged)
{
  Integrator &I = Get(ts);
  Corrector  &c = I.corrector;
  PetscBool   once;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)ts->snes, SNESKSPONLY, &once)); /* its only solve needs the matrix of exactly this h */
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
    /* A matrix that is singular now and then at any h would lower h_limit with each failure, without end
       (Failures.SingularMatrixNowAndThen) */
    if (!c.no_solve || I.h_limit <= 0) I.h_limit = fraction_after_failure * I.h;
    I.stat.corrector_fails++;
    PetscCall(PetscInfo(ts, "corrector: %s\n", I.failure));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
