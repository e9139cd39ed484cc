/*
  Conjugate gradients with the preconditioner "hhtconstraint" in place of a factor: where there is no room for one, and where most unknowns belong to
  nodes of finite elements, so that a large factor is the slower way (README.md). A body for which they take many iterations gets its factor.
*/
#include "choose.h"
#include "constraint.h"

static const PetscInt  MOST_ITERATIONS = 100; /* of a solve: with 17,000 to 120,000 unknowns a factor and its solves take as long as 65 to 360 (src/flexible/README.md) */
static const PetscInt  END = 300; /* of one that does not converge */
static const PetscReal PETSCS = 1e-5, LOOSE = 1e-2; /* relative tolerances, PETSc's default and ours */

/* On a KSP whose types were set here, which nobody shall take for the user's */
static const char OURS[] = "hhtdae_linear_krylov";

static PetscErrorCode IsOurs(KSP ksp, PetscBool *ours)
{
  PetscObject mark;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)ksp, OURS, &mark));
  *ours = (PetscBool)(mark != NULL);
  PetscFunctionReturn(0);
}

/* A correction is followed by the next one, which makes up for what the Krylov method leaves: with PETSc's 1e-5 a step of a finite-element body takes
   twice the iterations. */
PetscErrorCode LinearLoosen(KSP ksp, LinearChoice *choice)
{
  PetscReal rtol;
  PetscBool constraint, given;
  PC        pc;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCHHTCONSTRAINT, &constraint));
  choice->constraint = constraint;
  PetscCall(LinearOptionGiven(ksp, "-ksp_rtol", &given));
  PetscCall(KSPGetTolerances(ksp, &rtol, NULL, NULL, NULL));
  if (!constraint || given || rtol != PETSCS) PetscFunctionReturn(0);
  PetscCall(KSPSetTolerances(ksp, LOOSE, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(PetscInfo(ksp, "Linear solver: relative tolerance %g with " PCHHTCONSTRAINT ", -ksp_rtol sets another\n", (double)LOOSE));
  PetscFunctionReturn(0);
}

/* hhtconstraint sets both for conjugate gradients, whose successor shall not depend on them */
static PetscErrorCode ForgetGuess(KSP ksp)
{
  PetscFunctionBegin;
  PetscCall(KSPSetInitialGuessKnoll(ksp, PETSC_FALSE));
  PetscCall(KSPSetInitialGuessNonzero(ksp, PETSC_FALSE));
  PetscFunctionReturn(0);
}

/* Joints and motions make a few rows unsymmetric, which the preconditioner solves exactly: conjugate gradients take as many iterations then as FGMRES, in less time
   and without its basis (tests/bench/whole_bodies.md), and where they do not serve a factor follows. Where there is no room for one, FGMRES is the safe way. */
PetscErrorCode LinearSetKrylov(KSP ksp, PetscBool symmetric, LinearChoice *choice)
{
  const bool cg = symmetric || !choice->no_room;
  PetscBool  by_option;

  PetscFunctionBegin;
  PetscCall(LinearOptionGiven(ksp, "-ksp_type", &by_option));
  if (!by_option) PetscCall(KSPSetType(ksp, cg ? KSPCG : KSPFGMRES));
  if (!by_option && !cg) PetscCall(ForgetGuess(ksp));
  PetscCall(PetscSNPrintf(choice->text, sizeof choice->text, "%s with %s: %s", cg ? "conjugate gradients" : "FGMRES", PCHHTCONSTRAINT,
                          choice->no_room ? "there is no room for a factor (-mat_mumps_memory)" : "most unknowns are those of nodes of finite elements (a factor by -pc_type lu or cholesky)"));
  PetscFunctionReturn(0);
}

static PetscErrorCode TakeKrylov(KSP ksp, PetscBool symmetric, LinearChoice *choice)
{
  PC             pc;
  PetscContainer mark;
  PetscBool      given;

  PetscFunctionBegin;
  choice->iterative = PETSC_TRUE;
  choice->cholesky  = symmetric;
  PetscCall(PetscContainerCreate(PetscObjectComm((PetscObject)ksp), &mark));
  PetscCall(PetscObjectCompose((PetscObject)ksp, OURS, (PetscObject)mark));
  PetscCall(PetscContainerDestroy(&mark));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(LinearSetType(pc, PCHHTCONSTRAINT));
  PetscCall(PCSetFromOptions(pc));
  PetscCall(LinearSetKrylov(ksp, symmetric, choice));
  PetscCall(KSPSetFromOptions(ksp)); /* of "preonly" it has read none */
  PetscCall(LinearOptionGiven(ksp, "-ksp_max_it", &given));
  if (!given && !choice->no_room) PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, END));
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
  if (choice->user_pc || choice->user_package || choice->slow || !factors || !rows) PetscFunctionReturn(0);
  choice->no_room = *changed = PETSC_TRUE;
  PetscCall(TakeKrylov(ksp, choice->cholesky, choice));
  PetscCall(LinearLoosen(ksp, choice));
  PetscCall(PetscInfo(ksp, "Linear solver: %s\n", choice->text));
  PetscFunctionReturn(0);
}

/* Whether at least half of the rows belong to nodes whose positions are known */
static PetscErrorCode HasNodes(Mat P, PetscBool *yes)
{
  IS       nodes;
  Vec      positions;
  PetscInt n, rows;

  PetscFunctionBegin;
  *yes = PETSC_FALSE;
  PetscCall(PetscObjectQuery((PetscObject)P, LINEAR_NODES, (PetscObject *)&nodes));
  PetscCall(PetscObjectQuery((PetscObject)P, LINEAR_POSITIONS, (PetscObject *)&positions));
  if (!nodes || !positions) PetscFunctionReturn(0);
  PetscCall(ISGetLocalSize(nodes, &n));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &n, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)P)));
  PetscCall(MatGetSize(P, &rows, NULL));
  *yes = (PetscBool)(n >= rows / 2);
  PetscFunctionReturn(0);
}

/* Whether the choice of the faster solver is left to us, and the matrix gives its rows */
static PetscErrorCode IsFree(KSP ksp, Mat P, const LinearChoice &choice, PetscBool *yes)
{
  PetscBool rows, preonly, given;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)P, &rows, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPPREONLY, &preonly));
  PetscCall(LinearOptionGiven(ksp, "-ksp_type", &given));
  *yes = (PetscBool)(!choice.user_pc && !choice.user_package && rows && (choice.no_room || (preonly && !given)));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearPreferKrylov(KSP ksp, Mat P, PetscBool symmetric, LinearChoice *choice, PetscBool *taken)
{
  PetscBool nodes;

  PetscFunctionBegin;
  *taken = PETSC_FALSE;
  if (!choice->may_be_rough || choice->slow) PetscFunctionReturn(0);
  PetscCall(IsFree(ksp, P, *choice, taken));
  if (!*taken) PetscFunctionReturn(0);
  PetscCall(HasNodes(P, &nodes));
  *taken = nodes;
  if (nodes) PetscCall(TakeKrylov(ksp, symmetric, choice));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearTakeKrylovAgain(KSP ksp, Mat P, PetscBool symmetric, LinearChoice *choice, PetscBool *taken)
{
  PetscFunctionBegin;
  PetscCall(IsFree(ksp, P, *choice, taken));
  if (*taken) PetscCall(TakeKrylov(ksp, symmetric, choice));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearUsersMethod(KSP ksp, const LinearChoice &choice, KSPType *type)
{
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(KSPGetType(ksp, type));
  PetscCall(LinearOptionGiven(ksp, "-ksp_type", &given));
  if (choice.iterative && !given) *type = KSPPREONLY;
  PetscFunctionReturn(0);
}

PetscErrorCode LinearTakeFactor(KSP ksp, LinearChoice *choice)
{
  PC        pc;
  PetscBool ours = PETSC_FALSE;
  PetscReal rtol;
  PetscInt  end;

  PetscFunctionBegin;
  PetscCall(IsOurs(ksp, &ours));
  if (!ours) PetscFunctionReturn(0);
  choice->iterative = choice->constraint = PETSC_FALSE;
  PetscCall(PetscObjectCompose((PetscObject)ksp, OURS, NULL));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(LinearSetType(pc, PCLU));
  PetscCall(PCSetFromOptions(pc)); /* of a factor the preconditioner has read none */
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(ForgetGuess(ksp));
  PetscCall(KSPGetTolerances(ksp, &rtol, NULL, NULL, &end));
  PetscCall(KSPSetTolerances(ksp, rtol == LOOSE ? PETSCS : rtol, PETSC_DEFAULT, PETSC_DEFAULT, end == END ? 10000 : end));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearGiveUpKrylov(KSP ksp, Mat P, LinearChoice *choice, PetscBool *changed)
{
  KSPConvergedReason reason;
  PCFailedReason     failed;
  PetscInt           its;
  PC                 pc;

  PetscFunctionBegin;
  *changed = PETSC_FALSE;
  if (!choice->iterative || choice->no_room) PetscFunctionReturn(0);
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(KSPGetIterationNumber(ksp, &its));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetFailedReason(pc, &failed));
  const bool nan = reason == KSP_DIVERGED_NANORINF && !failed; /* of the residual, which no solver helps */
  *changed       = (PetscBool)(!nan && (reason < 0 || failed || its > MOST_ITERATIONS));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, changed, 1, MPIU_BOOL, MPI_LOR, PetscObjectComm((PetscObject)ksp)));
  if (!*changed) PetscFunctionReturn(0);
  PetscCall(PetscInfo(ksp, "Linear solver: conjugate gradients took %" PetscInt_FMT " iterations (%s), a factor from now on\n", its, failed ? PCFailedReasons[failed] : KSPConvergedReasons[reason]));
  choice->slow              = PETSC_TRUE;
  const PetscBool symmetric = choice->cholesky;
  PetscCall(LinearTakeFactor(ksp, choice));
  PetscCall(LinearChoose(ksp, P, symmetric, choice));
  PetscFunctionReturn(0);
}
