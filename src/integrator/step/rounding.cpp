/*
  The size of a correction that is nothing but rounding. Only the residual knows how its terms cancel, and only the matrix how much of
  that arrives in the unknowns: where Phi_q nearly loses rank, that is far more than rounding of q, and a step later it is not.
*/
#include "corrector.h"
#include "integrator/entries.h"
#include "estimate.h"
#include "integrator/proofs/proofs.h"
#include "integrator/random.h"
#include "integrator/work_vec.h"

namespace hht3
{

/* The correction that the matrix at hand makes of a residual r, to rounding: no other one follows */
PetscErrorCode CorrectionFor(TS ts, Vec r, Vec dX, PetscBool *solved)
{
  KSP                ksp;
  KSPConvergedReason reason;
  Mat                P;
  PetscBool          rough = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  if (Get(ts).linear.refines) PetscCall(LinearSolvesRoughly(P, &rough));
  if (rough) PetscCall(LinearSolveRoughly(P, PETSC_FALSE));
  PetscCall(KSPSolve(ksp, r, dX));
  if (rough) PetscCall(LinearSolveRoughly(P, PETSC_TRUE));
  Get(ts).stat.solves++;
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  *solved = (PetscBool)(reason >= 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Its size; 0 if it has none */
PetscErrorCode SizeOfCorrectionFor(TS ts, Vec r, Vec dX, PetscReal *e)
{
  PetscBool solved;

  PetscFunctionBegin;
  *e = 0;
  PetscCall(CorrectionFor(ts, r, dX, &solved));
  if (solved) PetscCall(CorrectionNorm(ts, dX, Get(ts).h, e));
  if (PetscIsInfOrNanReal(*e)) *e = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* e of rounding at the iterate X, in units of the tolerance: the larger of two samples, since in one of them the rows may cancel
   (Stiff.FastModeBesideASlowOne). The noise of the residual is taken with random factors, row by row: rounding of one row knows nothing of that of another. (A residual of
   unknowns that have been moved a little is taken back to them by the matrix, however near to singular it is.) */
PetscErrorCode RoundingOfCorrection(TS ts, Vec X, PetscReal *e)
{
  WorkVec   F, noise, r;
  PetscReal sample;
  PetscInt  first;

  PetscFunctionBegin;
  *e = 0;
  if (!Get(ts).corrector.matrix.have) PetscFunctionReturn(PETSC_SUCCESS);
  for (WorkVec *v : {&F, &noise, &r}) PetscCall(v->like(X, Get(ts).spare));
  PetscCall(SNESComputeFunction(ts->snes, X, F));
  PetscCall(MeasureRounding(ts, X, F, noise));
  PetscCall(VecGetOwnershipRange(X, &first, NULL));
  for (unsigned salt = 0; salt < 2; salt++) {
    PetscCall(ForEntries([&](PetscInt i, PetscScalar size, PetscScalar &x) { x = size * RandomRounding(first + i, salt); }, Read(noise), Write(r)));
    PetscCall(SizeOfCorrectionFor(ts, r, F, &sample));
    *e = PetscMax(*e, sample);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
