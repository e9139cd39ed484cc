/* What solves where there is no room for a factor */
#include "choose.h"
#include "constraint.h"

/* Per solve; the corrector goes on from there. Half the time of 1e-2 on blocks and frames (src/flexible/README.md). */
static const PetscReal LOOSE = 0.1;

PetscErrorCode LinearSetKrylov(KSP ksp, PetscBool symmetric, LinearChoice *choice)
{
  PetscBool by_option;
  PetscReal rtol, atol, dtol;
  PetscInt  max_it;

  PetscFunctionBegin;
  PetscCall(LinearOptionGiven(ksp, "-ksp_type", &by_option));
  if (!by_option) PetscCall(KSPSetType(ksp, symmetric ? KSPCG : KSPFGMRES));
  PetscCall(LinearOptionGiven(ksp, "-ksp_rtol", &by_option));
  PetscCall(KSPGetTolerances(ksp, &rtol, &atol, &dtol, &max_it));
  if (!by_option) PetscCall(KSPSetTolerances(ksp, LOOSE, atol, dtol, max_it));
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
  PetscCall(PetscInfo(ksp, "Linear solver: %s\n", choice->text));
  PetscFunctionReturn(0);
}
