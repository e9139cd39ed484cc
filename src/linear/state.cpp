/* What a preconditioner takes over from one matrix to the next, asked of the factor that it holds; and what its solves are for */
#include "linear.h"
#include <petsc/private/petscimpl.h>

/* NULL where there is none */
static PetscErrorCode FactorOf(KSP ksp, Mat *F)
{
  PC        pc;
  PetscBool factors;

  PetscFunctionBegin;
  *F = NULL;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &factors, PCLU, PCCHOLESKY, ""));
  if (factors) PetscCall(PCFactorGetMatrix(pc, F));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearSaveState(KSP ksp, Archive *archive)
{
  Mat F;

  PetscFunctionBegin;
  PetscCall(FactorOf(ksp, &F));
  if (F) PetscTryMethod(F, LINEAR_SAVE_STATE, (Mat, Archive *), (F, archive));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearLoadState(KSP ksp, Mat P, Archive *archive, PetscBool *same, PetscBool *usable)
{
  Mat            F;
  MatFactorError error = MAT_FACTOR_NOERROR;

  PetscFunctionBegin;
  *same = PETSC_FALSE;
  PetscCall(FactorOf(ksp, &F));
  if (F) PetscTryMethod(F, LINEAR_LOAD_STATE, (Mat, Mat, Archive *, PetscBool *), (F, P, archive, same));
  if (F) PetscCall(MatFactorGetError(F, &error));
  *usable = (PetscBool)!error;
  for (PetscBool *answer : {same, usable}) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, answer, 1, MPIU_BOOL, MPI_LAND, PetscObjectComm((PetscObject)ksp)));
  PetscFunctionReturn(0);
}

static const char ROUGH[] = "hhtdae_linear_rough";

PetscErrorCode LinearSolveRoughly(Mat P, PetscBool rough)
{
  PetscContainer mark;

  PetscFunctionBegin;
  if (!rough) {
    PetscCall(PetscObjectCompose((PetscObject)P, ROUGH, NULL));
    PetscFunctionReturn(0);
  }
  PetscCall(PetscContainerCreate(PetscObjectComm((PetscObject)P), &mark));
  PetscCall(PetscObjectCompose((PetscObject)P, ROUGH, (PetscObject)mark));
  PetscCall(PetscContainerDestroy(&mark));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearSolvesRoughly(Mat P, PetscBool *rough)
{
  PetscObject mark;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)P, ROUGH, &mark));
  *rough = (PetscBool)(mark != NULL);
  PetscFunctionReturn(0);
}
