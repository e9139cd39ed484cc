/*
  The corrector of the start: the same iteration and judgement without SNES, whose type, test and number of iterations are the user's
  and meant for steps.
*/
#include "impl.h"

namespace hht3
{

namespace
{

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

/* One correction of the start, with the assembled matrix */
PetscErrorCode CorrectStart(TS ts, KSP ksp, Vec F, Vec Y, PetscBool *ok)
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

} // namespace

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

} // namespace hht3
