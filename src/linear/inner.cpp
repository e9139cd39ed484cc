#include "inner.h"

namespace
{

PetscErrorCode Create(PC pc, const char name[], InnerSolver *s)
{
  const char *prefix;

  PetscFunctionBegin;
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)pc), &s->ksp));
  PetscCall(PetscObjectIncrementTabLevel((PetscObject)s->ksp, (PetscObject)pc, 1));
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(KSPSetOptionsPrefix(s->ksp, prefix));
  PetscCall(KSPAppendOptionsPrefix(s->ksp, name));
  PetscCall(KSPSetErrorIfNotConverged(s->ksp, PETSC_FALSE));
  PetscCall(LinearDefaults(s->ksp, &s->choice));
  PetscCall(KSPSetFromOptions(s->ksp));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode InnerSetUp(PC pc, const char name[], Mat A, PetscBool another, InnerSolver *s, PetscBool *failed)
{
  const bool     first = !s->ksp;
  PetscBool      symmetric;
  PC             inner;
  PCFailedReason reason;

  PetscFunctionBegin;
  if (first) PetscCall(Create(pc, name, s));
  PetscCall(KSPSetOperators(s->ksp, A, A));
  if (first || another || s->choice.cholesky) {
    PetscCall(LinearIsSymmetric(A, &symmetric));
    if (first || another || !symmetric) PetscCall(LinearChoose(s->ksp, A, symmetric, &s->choice));
  }
  PetscCall(KSPSetUp(s->ksp));
  PetscCall(KSPGetPC(s->ksp, &inner));
  PetscCall(PCGetFailedReason(inner, &reason));
  *failed = (PetscBool)(reason != PC_NOERROR);
  PetscFunctionReturn(0);
}

PetscErrorCode InnerSolve(InnerSolver *s, Vec b, Vec x, PetscBool *failed)
{
  KSPConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(KSPSolve(s->ksp, b, x));
  PetscCall(KSPGetConvergedReason(s->ksp, &reason));
  *failed = (PetscBool)(reason < 0);
  PetscFunctionReturn(0);
}

PetscErrorCode InnerView(const InnerSolver &s, PetscViewer viewer)
{
  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPushTab(viewer));
  PetscCall(KSPView(s.ksp, viewer));
  PetscCall(PetscViewerASCIIPopTab(viewer));
  PetscFunctionReturn(0);
}

PetscErrorCode InnerDestroy(InnerSolver *s)
{
  PetscFunctionBegin;
  PetscCall(KSPDestroy(&s->ksp));
  *s = InnerSolver();
  PetscFunctionReturn(0);
}
