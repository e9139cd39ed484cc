/*
  Conjugate gradients with the preconditioner "hhtconstraint" in place of a factor: where memory does not suffice for a factor, and where most unknowns
  belong to nodes of finite elements, so that a large factor is slower (README.md). Where they take many iterations, a factor replaces them.
*/
#include "choose.h"
#include "constraint.h"

/* A solve that takes more iterations makes a factor replace the Krylov method: with 17,000 to 120,000 unknowns a factorization and its solves take as long as 65
   to 360 iterations (src/flexible/README.md). */
static const PetscInt GIVE_UP_ITERATIONS = 100;

/* Limit of iterations of a solve that does not converge, unless -ksp_max_it is given */
static const PetscInt MAX_ITERATIONS = 300;

/* Relative tolerances: PETSc's default, and the one that replaces it with hhtconstraint */
static const PetscReal PETSC_RTOL = 1e-5, LOOSE_RTOL = 1e-2;

/* Name of the object composed with a KSP whose types were set here, which tells them from the user's */
static const char MARK_KRYLOV[] = "hhtdae_linear_krylov";

static PetscErrorCode HasKrylovMark(KSP ksp, PetscBool *marked)
{
  PetscObject mark;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)ksp, MARK_KRYLOV, &mark));
  *marked = (PetscBool)(mark != NULL);
  PetscFunctionReturn(0);
}

/* The next corrector iteration removes the error that a loose tolerance leaves; with PETSc's 1e-5 a step of a finite-element body takes twice as many Krylov
   iterations. */
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
  if (!constraint || given || rtol != PETSC_RTOL) PetscFunctionReturn(0);
  PetscCall(KSPSetTolerances(ksp, LOOSE_RTOL, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(PetscInfo(ksp, "Linear solver: relative tolerance %g with " PCHHTCONSTRAINT ", -ksp_rtol sets another\n", (double)LOOSE_RTOL));
  PetscFunctionReturn(0);
}

/* Resets the initial guess that hhtconstraint sets for conjugate gradients, so that the method that replaces them does not use it */
static PetscErrorCode ResetInitialGuess(KSP ksp)
{
  PetscFunctionBegin;
  PetscCall(KSPSetInitialGuessKnoll(ksp, PETSC_FALSE));
  PetscCall(KSPSetInitialGuessNonzero(ksp, PETSC_FALSE));
  PetscFunctionReturn(0);
}

/* Joints and motions make a few rows of the matrix unsymmetric, but the preconditioner solves these exactly: conjugate gradients take as many iterations as FGMRES,
   in less time and without storing a basis (tests/bench/whole_bodies.md), and a factor replaces them if they fail. Where memory does not suffice for a factor,
   FGMRES is taken for unsymmetric matrices. */
PetscErrorCode LinearSetKrylov(KSP ksp, PetscBool symmetric, LinearChoice *choice)
{
  const bool cg = symmetric || !choice->no_room;
  PetscBool  by_option;

  PetscFunctionBegin;
  PetscCall(LinearOptionGiven(ksp, "-ksp_type", &by_option));
  if (!by_option) PetscCall(KSPSetType(ksp, cg ? KSPCG : KSPFGMRES));
  if (!by_option && !cg) PetscCall(ResetInitialGuess(ksp));
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
  PetscCall(PetscObjectCompose((PetscObject)ksp, MARK_KRYLOV, (PetscObject)mark));
  PetscCall(PetscContainerDestroy(&mark));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(LinearSetType(pc, PCHHTCONSTRAINT));
  PetscCall(PCSetFromOptions(pc));
  PetscCall(LinearSetKrylov(ksp, symmetric, choice));
  PetscCall(KSPSetFromOptions(ksp)); /* options of the new type have not been read yet */
  PetscCall(LinearOptionGiven(ksp, "-ksp_max_it", &given));
  if (!given && !choice->no_room) PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, MAX_ITERATIONS));
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
  if (choice->user_pc || choice->user_package || choice->krylov_given_up || !factors || !rows) PetscFunctionReturn(0);
  choice->no_room = *changed = PETSC_TRUE;
  PetscCall(TakeKrylov(ksp, choice->cholesky, choice));
  PetscCall(LinearLoosen(ksp, choice));
  PetscCall(PetscInfo(ksp, "Linear solver: %s\n", choice->text));
  PetscFunctionReturn(0);
}

/* Whether at least half of the rows belong to nodes whose positions are known */
static PetscErrorCode MostRowsAreNodes(Mat P, PetscBool *yes)
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

/* Whether the user has chosen neither method, preconditioner nor package, and the matrix is a MATAIJ, as hhtconstraint needs */
static PetscErrorCode ChoiceIsFree(KSP ksp, Mat P, const LinearChoice &choice, PetscBool *yes)
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
  if (!choice->may_be_rough || choice->krylov_given_up) PetscFunctionReturn(0);
  PetscCall(ChoiceIsFree(ksp, P, *choice, taken));
  if (!*taken) PetscFunctionReturn(0);
  PetscCall(MostRowsAreNodes(P, &nodes));
  *taken = nodes;
  if (nodes) PetscCall(TakeKrylov(ksp, symmetric, choice));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearTakeKrylovAgain(KSP ksp, Mat P, PetscBool symmetric, LinearChoice *choice, PetscBool *taken)
{
  PetscFunctionBegin;
  PetscCall(ChoiceIsFree(ksp, P, *choice, taken));
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
  PetscBool marked = PETSC_FALSE;
  PetscReal rtol;
  PetscInt  max_it;

  PetscFunctionBegin;
  PetscCall(HasKrylovMark(ksp, &marked));
  if (!marked) PetscFunctionReturn(0);
  choice->iterative = choice->constraint = PETSC_FALSE;
  PetscCall(PetscObjectCompose((PetscObject)ksp, MARK_KRYLOV, NULL));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(LinearSetType(pc, PCLU));
  PetscCall(PCSetFromOptions(pc)); /* options of the factorization have not been read yet */
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(ResetInitialGuess(ksp));
  PetscCall(KSPGetTolerances(ksp, &rtol, NULL, NULL, &max_it));
  PetscCall(KSPSetTolerances(ksp, rtol == LOOSE_RTOL ? PETSC_RTOL : rtol, PETSC_DEFAULT, PETSC_DEFAULT, max_it == MAX_ITERATIONS ? 10000 : max_it));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearGiveUpKrylov(KSP ksp, Mat P, LinearChoice *choice, PetscBool *changed)
{
  KSPConvergedReason reason;
  PCFailedReason     failed;
  PetscInt           its;
  PC                 pc;
  KSPType            type;

  PetscFunctionBegin;
  *changed = PETSC_FALSE;
  if (!choice->iterative || choice->no_room) PetscFunctionReturn(0);
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(KSPGetIterationNumber(ksp, &its));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetFailedReason(pc, &failed));
  const bool nan = reason == KSP_DIVERGED_NANORINF && !failed; /* the right-hand side is not finite: no other solver helps */
  *changed       = (PetscBool)(!nan && (reason < 0 || failed || its > GIVE_UP_ITERATIONS));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, changed, 1, MPIU_BOOL, MPI_LOR, PetscObjectComm((PetscObject)ksp)));
  if (!*changed) PetscFunctionReturn(0);
  PetscCall(KSPGetType(ksp, &type));
  PetscCall(PetscInfo(ksp, "Linear solver: %s took %" PetscInt_FMT " iterations (%s), a factor from now on\n", type, its, failed ? PCFailedReasons[failed] : KSPConvergedReasons[reason]));
  choice->krylov_given_up   = PETSC_TRUE;
  const PetscBool symmetric = choice->cholesky;
  PetscCall(LinearTakeFactor(ksp, choice));
  PetscCall(LinearChoose(ksp, P, symmetric, choice));
  PetscFunctionReturn(0);
}
