/* Saving and loading the state of a solver, by functions composed with its preconditioner or factor; and the marks of a matrix that tell what its solves are for */
#include "choose.h"
#include <petsc/private/pcimpl.h>

/* The factor of a KSP with LU or LDL^T; NULL with other preconditioners */
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

PetscErrorCode LinearSaveState(KSP ksp, const LinearChoice &choice, Archive *archive)
{
  PC            pc;
  Mat           F;
  MatSolverType package = NULL;
  LinearChosen  chosen;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCFactorGetMatSolverType(pc, &package));
  if (package) PetscCall(PetscStrncpy(chosen.package, package, sizeof chosen.package));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCCHOLESKY, &chosen.cholesky));
  if (choice.iterative) chosen.cholesky = choice.cholesky;
  chosen.iterative       = choice.iterative;
  chosen.no_room         = choice.no_room;
  chosen.krylov_given_up = choice.krylov_given_up;
  chosen.set_up          = (PetscBool) !!pc->setupcalled;
  archive->plain(chosen);
  if (!chosen.set_up) PetscFunctionReturn(0);
  PetscCall(FactorOf(ksp, &F));
  if (F) PetscTryMethod(F, LINEAR_SAVE_STATE, (Mat, Archive *), (F, archive));
  else PetscTryMethod(pc, LINEAR_SAVE_STATE, (PC, Archive *), (pc, archive));
  PetscFunctionReturn(0);
}

/* The choice of rank 0 on all ranks; the default choice, and *good = PETSC_FALSE, if any rank's archive is damaged */
static PetscErrorCode LoadChosen(MPI_Comm comm, Archive *archive, LinearChosen *was, PetscBool *good)
{
  PetscFunctionBegin;
  archive->plain(*was);
  *good = (PetscBool)archive->good;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, good, 1, MPIU_BOOL, MPI_LAND, comm));
  if (!*good) *was = LinearChosen();
  PetscCallMPI(MPI_Bcast(was, sizeof *was, MPI_BYTE, 0, comm));
  was->package[sizeof was->package - 1] = 0;
  PetscFunctionReturn(0);
}

PetscErrorCode LinearLoadState(KSP ksp, Mat P, LinearChoice *choice, Archive *archive, PetscBool *same, PetscBool *usable)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)ksp);
  PC             pc;
  Mat            F;
  MatFactorError error = MAT_FACTOR_NOERROR;
  PCFailedReason reason;
  LinearChosen   was;

  PetscFunctionBegin;
  *usable = PETSC_FALSE;
  PetscCall(LoadChosen(comm, archive, &was, same));
  PetscCall(LinearChooseAgain(ksp, P, was, choice));
  if (!was.set_up) PetscFunctionReturn(0);
  *same = PETSC_FALSE;
  PetscCall(KSPSetUp(ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetFailedReason(pc, &reason));
  *usable = (PetscBool)!reason;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, usable, 1, MPIU_BOOL, MPI_LAND, comm));
  if (!*usable) PetscFunctionReturn(0);
  PetscCall(FactorOf(ksp, &F));
  if (F) PetscTryMethod(F, LINEAR_LOAD_STATE, (Mat, Mat, Archive *, PetscBool *), (F, P, archive, same));
  else PetscTryMethod(pc, LINEAR_LOAD_STATE, (PC, Archive *, PetscBool *), (pc, archive, same));
  if (F) PetscCall(MatFactorGetError(F, &error));
  PetscCall(PCGetFailedReason(pc, &reason));
  *usable = (PetscBool)(!error && !reason);
  for (PetscBool *answer : {same, usable}) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, answer, 1, MPIU_BOOL, MPI_LAND, comm));
  if (!*usable) PetscCall(PCReset(pc)); /* the error code of a factor would persist */
  PetscFunctionReturn(0);
}

static const char MARK_ROUGH_SOLVES[] = "hhtdae_linear_rough", MARK_MANY_SOLVES[] = "hhtdae_linear_often";

static PetscErrorCode Mark(Mat P, const char name[])
{
  PetscContainer mark;

  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(PetscObjectComm((PetscObject)P), &mark));
  PetscCall(PetscObjectCompose((PetscObject)P, name, (PetscObject)mark));
  PetscCall(PetscContainerDestroy(&mark));
  PetscFunctionReturn(0);
}

static PetscErrorCode IsMarked(Mat P, const char name[], PetscBool *yes)
{
  PetscObject mark;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)P, name, &mark));
  *yes = (PetscBool)(mark != NULL);
  PetscFunctionReturn(0);
}

PetscErrorCode LinearSolveRoughly(Mat P, PetscBool rough)
{
  PetscFunctionBegin;
  if (rough) PetscCall(Mark(P, MARK_ROUGH_SOLVES));
  else PetscCall(PetscObjectCompose((PetscObject)P, MARK_ROUGH_SOLVES, NULL));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearSolvesRoughly(Mat P, PetscBool *rough)
{
  PetscFunctionBegin;
  PetscCall(IsMarked(P, MARK_ROUGH_SOLVES, rough));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearSolveOften(Mat P)
{
  PetscFunctionBegin;
  PetscCall(Mark(P, MARK_MANY_SOLVES));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearSolvesOften(Mat P, PetscBool *often)
{
  PetscFunctionBegin;
  PetscCall(IsMarked(P, MARK_MANY_SOLVES, often));
  PetscFunctionReturn(0);
}
