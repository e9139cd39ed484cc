/* What solves where there is no room for a factor */
#include "choose.h"
#include "constraint.h"

/* A correction is followed by the next one, which makes up for what the Krylov method leaves: with PETSc's 1e-5 a step of a finite-element body takes
   twice the iterations. */
PetscErrorCode LinearLoosen(KSP ksp, LinearChoice *choice)
{
  const PetscReal petscs = 1e-5, loose = 1e-2;
  PetscReal       rtol;
  PetscBool       constraint, given;
  PC              pc;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCHHTCONSTRAINT, &constraint));
  choice->constraint = constraint;
  PetscCall(LinearOptionGiven(ksp, "-ksp_rtol", &given));
  PetscCall(KSPGetTolerances(ksp, &rtol, NULL, NULL, NULL));
  if (!constraint || given || rtol != petscs) PetscFunctionReturn(0);
  PetscCall(KSPSetTolerances(ksp, loose, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(PetscInfo(ksp, "Linear solver: relative tolerance %g with " PCHHTCONSTRAINT ", -ksp_rtol sets another\n", (double)loose));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearSetKrylov(KSP ksp, PetscBool symmetric, LinearChoice *choice)
{
  PetscBool by_option;

  PetscFunctionBegin;
  PetscCall(LinearOptionGiven(ksp, "-ksp_type", &by_option));
  if (!by_option) PetscCall(KSPSetType(ksp, symmetric ? KSPCG : KSPFGMRES));
  PetscCall(PetscSNPrintf(choice->text, sizeof choice->text, "%s with %s: there is no room for a factor (-mat_mumps_memory)", symmetric ? "conjugate gradients" : "FGMRES", PCHHTCONSTRAINT));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearChooseSmaller(KSP ksp, Mat P, LinearChoice *choice, PetscBool *changed)
{
  PC        pc;
  PetscBool factors, rows;

  PetscFunctionBegin;
  *changed = PETSC_FALSE;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &factors, PCLU, PCCHOLESKY, ""));
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)P, &rows, MATSEQAIJ, MATMPIAIJ, ""));
  if (choice->user_pc || choice->user_package || !factors || !rows) PetscFunctionReturn(0);
  const PetscBool symmetric = choice->cholesky;
  choice->iterative         = *changed = PETSC_TRUE;
  PetscCall(PCSetType(pc, PCHHTCONSTRAINT));
  PetscCall(PCSetFromOptions(pc));
  PetscCall(LinearSetKrylov(ksp, symmetric, choice));
  PetscCall(LinearLoosen(ksp, choice));
  PetscCall(PetscInfo(ksp, "Linear solver: %s\n", choice->text));
  PetscFunctionReturn(0);
}
