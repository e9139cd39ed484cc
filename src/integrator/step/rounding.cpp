/*
  The size of corrections that rounding makes. Rounding of the residual depends on how its terms cancel, and its effect on the unknowns on the
  matrix: where Phi_q nearly loses rank it is far above rounding of q, and a step later no longer. So both are measured at the iterate.
*/
#include "corrector.h"
#include "integrator/entries.h"
#include "estimate.h"
#include "integrator/proofs/proofs.h"
#include "integrator/random.h"
#include "integrator/work_vec.h"

namespace hht3
{

/* dX = J^{-1} r with the present Newton matrix, by an accurate solve, as no further correction follows that would remove its error */
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

/* Its size in units of the tolerance; infinite if the solve fails, since nothing is known then */
PetscErrorCode SizeOfCorrectionFor(TS ts, Vec r, Vec dX, PetscReal *e)
{
  PetscBool solved;

  PetscFunctionBegin;
  *e = PETSC_INFINITY;
  PetscCall(CorrectionFor(ts, r, dX, &solved));
  if (solved) PetscCall(CorrectionNorm(ts, dX, Get(ts).h, e));
  if (PetscIsNanReal(*e)) *e = PETSC_INFINITY;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The size e of corrections that rounding of the residual makes at X, in units of the tolerance: the larger of two samples, since in
   a single one rows may cancel (Stiff.FastModeBesideASlowOne). Each row of the residual's rounding gets a random factor of its own,
   as rounding errors of different rows are independent. (The difference of two residuals, at X and at slightly changed unknowns,
   would not do: the solve returns just this small change, however near to singular the matrix is.) */
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
    if (sample < PETSC_INFINITY) *e = PetscMax(*e, sample);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
