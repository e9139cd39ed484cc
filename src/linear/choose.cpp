/* The choice of a direct solver: by the work that a factorization takes, not by the number of unknowns */
#include "choose.h"
#include "klupair.h"
#include "kluparts.h"
#include "linear.h"
#include "mumpsmixed.h"
#include "mumpsnd.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>

static const char *const packages_for_little_work[] = {LINEAR_KLUPAIR, MATSOLVERKLU, MATSOLVERUMFPACK,
                                                       MATSOLVERSUPERLU, LINEAR_MUMPSND, MATSOLVERMUMPS};
static const char *const packages_for_much_work[]   = {LINEAR_MUMPSND, MATSOLVERMUMPS, MATSOLVERSUPERLU_DIST, MATSOLVERUMFPACK,
                                                       MATSOLVERSUPERLU, LINEAR_KLUPAIR, MATSOLVERKLU};

/* MatGetFactorAvailable() without one false positive: PETSc's interface to MUMPS announces LDL^T of MATBAIJ and then refuses it (MatrixTypesRanks.SameRunAsWithAIJ) */
static PetscErrorCode FactorAvailable(Mat P, const char name[], MatFactorType type, PetscBool *available)
{
  PetscBool blocks, mumps;

  PetscFunctionBegin;
  PetscCall(MatGetFactorAvailable(P, name, type, available));
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)P, &blocks, MATSEQBAIJ, MATMPIBAIJ, ""));
  PetscCall(PetscStrcmp(name, MATSOLVERMUMPS, &mumps));
  if (type == MAT_FACTOR_CHOLESKY && blocks && mumps) *available = PETSC_FALSE;
  PetscFunctionReturn(0);
}

/* Sets *package to `name` if that package factors P in this way; else leaves it as it is */
static PetscErrorCode IfAvailable(Mat P, const char name[], MatFactorType type, const char **package)
{
  PetscBool available;

  PetscFunctionBegin;
  PetscCall(FactorAvailable(P, name, type, &available));
  if (available)
    *package = name;
  else
    PetscCall(PetscInfo(P, "%s does not factor this matrix here\n", name));
  PetscFunctionReturn(0);
}

/* The first package of the list that factors P in this way; NULL if none does */
static PetscErrorCode FirstAvailable(Mat P, MatFactorType type, PetscBool large, const char **package)
{
  PetscBool dense;

  PetscFunctionBegin;
  *package = NULL;
  PetscCall(PetscObjectTypeCompare((PetscObject)P, MATSEQDENSE, &dense));
  if (dense) PetscCall(IfAvailable(P, MATSOLVERPETSC, type, package)); /* LAPACK; PETSc 3.21 and newer have an interface to MUMPS for these, too */
  const auto begin = large ? std::begin(packages_for_much_work) : std::begin(packages_for_little_work);
  const auto end   = large ? std::end(packages_for_much_work) : std::end(packages_for_little_work);
  for (auto p = begin; p != end && !*package; ++p) PetscCall(IfAvailable(P, *p, type, package));
  PetscFunctionReturn(0);
}

/* Whether LDL^T of the package factors indefinite matrices; PCCHOLESKY of other packages needs definite ones */
static PetscErrorCode FactorsIndefinite(const char package[], PetscBool *yes)
{
  PetscBool same;

  PetscFunctionBegin;
  *yes = PETSC_FALSE;
  for (const char *name : {MATSOLVERMUMPS, LINEAR_MUMPSND, LINEAR_SMUMPSND, LINEAR_MUMPSMIXED}) {
    PetscCall(PetscStrcmp(package, name, &same));
    if (same) *yes = PETSC_TRUE;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode LinearExchangesRows(const char package[], PetscBool *yes)
{
  PetscBool same;

  PetscFunctionBegin;
  *yes = PETSC_FALSE;
  for (const char *name : {MATSOLVERMUMPS, LINEAR_MUMPSND, LINEAR_SMUMPSND, LINEAR_MUMPSMIXED, LINEAR_KLUPAIR, LINEAR_KLUPARTS, MATSOLVERKLU, MATSOLVERUMFPACK, MATSOLVERSUPERLU}) {
    PetscCall(PetscStrcmp(package, name, &same));
    if (same) *yes = PETSC_TRUE;
  }
  PetscFunctionReturn(0);
}

/* The package of an existing factor cannot be changed, and PCSetFromOptions() may have created a factor of PETSc's default
   package: the preconditioner is reset before a change */
static PetscErrorCode SetPackage(PC pc, const char package[])
{
  MatSolverType current = NULL;
  PetscBool     same    = PETSC_FALSE;
  Mat           A, P;

  PetscFunctionBegin;
  PetscCall(PCFactorGetMatSolverType(pc, &current));
  if (current) PetscCall(PetscStrcmp(current, package, &same));
  if (same) PetscFunctionReturn(0);
  PetscCall(PCGetOperators(pc, &A, &P));
  PetscCall(PetscObjectReference((PetscObject)A));
  PetscCall(PetscObjectReference((PetscObject)P));
  PetscCall(PCReset(pc));
  PetscCall(PCSetOperators(pc, A, P));
  PetscCall(MatDestroy(&A));
  PetscCall(MatDestroy(&P));
  PetscCall(PCFactorSetMatSolverType(pc, package));
  PetscCall(LinearMarkPackage(pc, package));
  PetscFunctionReturn(0);
}

/*
  Sets type and package of a preconditioner whose type the user did not set. PCSetType() discards what the options set for
  the factorization, so they are read again. The package orders by itself unless the user named an ordering: PETSc would
  pass the ordering that suits its own factorization.
*/
static PetscErrorCode SetFactorization(KSP ksp, PC pc, PCType type, const char package[])
{
  PetscBool same, ordering, petsc;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, type, &same));
  if (!same) PetscCall(LinearSetType(pc, type));
  PetscCall(SetPackage(pc, package));
  if (!same) PetscCall(PCSetFromOptions(pc));
  PetscCall(LinearOptionGiven(ksp, "-pc_factor_mat_ordering_type", &ordering));
  PetscCall(PetscStrcmp(package, MATSOLVERPETSC, &petsc));
  if (!ordering && !petsc) PetscCall(PCFactorSetMatOrderingType(pc, MATORDERINGEXTERNAL));
  PetscFunctionReturn(0);
}

/* For MATSBAIJ without MUMPS: PETSc's own LDL^T, which does not pivot and fails at the zero diagonal entries of multipliers */
static PetscErrorCode ChoosePetscCholesky(KSP ksp, Mat P, PC pc, LinearChoice *choice)
{
  Vec       d;
  PetscReal least;
  PetscBool available;
  MatType   type;

  PetscFunctionBegin;
  PetscCall(MatGetFactorAvailable(P, MATSOLVERPETSC, MAT_FACTOR_CHOLESKY, &available));
  PetscCall(MatCreateVecs(P, &d, NULL));
  PetscCall(MatGetDiagonal(P, d));
  PetscCall(VecAbs(d));
  PetscCall(VecMin(d, NULL, &least));
  PetscCall(VecDestroy(&d));
  PetscCall(MatGetType(P, &type));
  PetscCheck(available && least > 0, PetscObjectComm((PetscObject)P), PETSC_ERR_SUP,
             "No installed package factors this matrix of type %s; MUMPS would. Use a matrix of type %s", type, MATAIJ);
  PetscCall(SetFactorization(ksp, pc, PCCHOLESKY, MATSOLVERPETSC));
  choice->cholesky = PETSC_TRUE;
  PetscCall(PetscStrncpy(choice->text, "LDL^T with petsc, without pivoting: MUMPS is not installed", sizeof choice->text));
  PetscFunctionReturn(0);
}

/* No package was found: PETSc's own LU, which does not pivot, with zeros moved off the diagonal by a permutation; else GMRES without preconditioner */
static PetscErrorCode ChooseLastResort(KSP ksp, Mat P, PC pc, LinearChoice *choice)
{
  PetscBool available, by_option, triangle;

  PetscFunctionBegin;
  PetscCall(LinearStoresTriangle(P, &triangle));
  if (triangle) {
    PetscCall(ChoosePetscCholesky(ksp, P, pc, choice));
    PetscFunctionReturn(0);
  }
  PetscCall(MatGetFactorAvailable(P, MATSOLVERPETSC, MAT_FACTOR_LU, &available));
  if (available) {
    PetscCall(SetPackage(pc, MATSOLVERPETSC));
    PetscCall(PCFactorReorderForNonzeroDiagonal(pc, PETSC_SMALL));
    const char *type;
    PetscCall(MatGetType(P, &type));
    PetscCall(PetscSNPrintf(choice->text, sizeof choice->text,
                            "LU with petsc: no other installed package factors matrices of type %s", type));
    PetscFunctionReturn(0);
  }
  PetscCall(LinearOptionGiven(ksp, "-ksp_type", &by_option));
  if (!by_option) PetscCall(KSPSetType(ksp, KSPGMRES));
  PetscCall(LinearSetType(pc, PCNONE));
  PetscCall(PetscStrncpy(choice->text, "GMRES without preconditioner: nothing factors this type of matrix",
                         sizeof choice->text));
  PetscFunctionReturn(0);
}

/* Takes "mumpsmixed" in place of "mumpsnd", only with preonly: in a Krylov method every iteration would make a rough solve */
static PetscErrorCode PreferSingle(KSP ksp, Mat P, MatFactorType type, const char **package)
{
  PetscBool is_mumpsnd, preonly;

  PetscFunctionBegin;
  PetscCall(PetscStrcmp(*package, LINEAR_MUMPSND, &is_mumpsnd));
  PetscCall(PetscObjectTypeCompare((PetscObject)ksp, KSPPREONLY, &preonly));
  if (is_mumpsnd && preonly) PetscCall(IfAvailable(P, LINEAR_MUMPSMIXED, type, package));
  PetscFunctionReturn(0);
}

static PetscErrorCode ChoosePackage(KSP ksp, Mat P, PetscBool symmetric, PC pc, LinearChoice *choice)
{
  LinearSize  size;
  const char *package = NULL;
  PetscBool   lu, cholesky, many_entries, krylov = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCLU, &lu));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCCHOLESKY, &cholesky));
  if (!lu && !cholesky) {
    PetscCall(PetscStrncpy(choice->text, "as the user chose", sizeof choice->text));
    PetscFunctionReturn(0);
  }
  PetscCall(LinearHasManyEntries(P, &many_entries));
  if (many_entries) PetscCall(LinearPreferKrylov(ksp, P, symmetric, choice, &krylov)); /* before the matrix is ordered, which takes time */
  if (!krylov) PetscCall(LinearMeasure(P, symmetric, choice->many_solves, &size));
  if (!krylov && size.single) PetscCall(LinearPreferKrylov(ksp, P, symmetric, choice, &krylov));
  if (krylov) PetscFunctionReturn(0);
  if (!choice->user_pc) {
    /* LDL^T for MUMPS' fronts, where it halves the work, if a package for indefinite matrices is installed */
    PetscBool indefinite = PETSC_FALSE;
    if (symmetric && size.large && !size.parts) PetscCall(FirstAvailable(P, MAT_FACTOR_CHOLESKY, PETSC_TRUE, &package));
    if (package) PetscCall(FactorsIndefinite(package, &indefinite));
    cholesky = choice->cholesky = indefinite;
  }
  package = NULL;
  if (size.parts && !cholesky) PetscCall(IfAvailable(P, LINEAR_KLUPARTS, MAT_FACTOR_LU, &package));
  if (!package)
    PetscCall(FirstAvailable(P, cholesky ? MAT_FACTOR_CHOLESKY : MAT_FACTOR_LU, cholesky ? PETSC_TRUE : size.large,
                             &package));
  if (!package && !cholesky) PetscCall(IfAvailable(P, LINEAR_KLUPARTS, MAT_FACTOR_LU, &package)); /* without MUMPS */
  if (!package && !choice->user_pc) {
    PetscCall(ChooseLastResort(ksp, P, pc, choice));
    PetscFunctionReturn(0);
  }
  if (choice->user_pc && cholesky && !symmetric)
    PetscCall(PetscPrintf(PetscObjectComm((PetscObject)P), "hhtdae: -pc_type cholesky takes one triangle of a matrix that is not symmetric: corrections will be slow, and less accurate; use lu\n"));
  if (package && size.single && choice->may_be_rough) PetscCall(PreferSingle(ksp, P, cholesky ? MAT_FACTOR_CHOLESKY : MAT_FACTOR_LU, &package));
  if (package && choice->user_pc)
    PetscCall(SetPackage(pc, package));
  else if (package)
    PetscCall(SetFactorization(ksp, pc, cholesky ? PCCHOLESKY : PCLU, package));
  PetscMPIInt ranks;
  PetscBool   mumps = PETSC_FALSE;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)P), &ranks));
  if (package && ranks > 1) PetscCall(FactorsIndefinite(package, &mumps));
  PetscCall(PetscSNPrintf(choice->text, sizeof choice->text, "%s with %s%s: %s", cholesky ? "LDL^T" : "LU",
                          package ? package : "PETSc's default", mumps ? " (runs repeat to rounding only)" : "", size.text));
  PetscFunctionReturn(0);
}

/* The factorization for the package that the user set: LDL^T if the matrix is symmetric and the package factors indefinite matrices, or offers no LU */
static PetscErrorCode ChooseForUsersPackage(KSP ksp, Mat P, PetscBool symmetric, PC pc, LinearChoice *choice)
{
  MatSolverType package = NULL;
  PetscBool     lu, cholesky, indefinite = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PCFactorGetMatSolverType(pc, &package));
  if (!package) PetscFunctionReturn(0);
  PetscCall(MatGetFactorAvailable(P, package, MAT_FACTOR_LU, &lu));
  PetscCall(FactorAvailable(P, package, MAT_FACTOR_CHOLESKY, &cholesky));
  if (symmetric && cholesky) PetscCall(FactorsIndefinite(package, &indefinite));
  choice->cholesky = indefinite || (cholesky && !lu) ? PETSC_TRUE : PETSC_FALSE;
  char name[64];
  PetscCall(PetscStrncpy(name, package, sizeof name)); /* PCSetType() frees the string */
  PetscCall(SetFactorization(ksp, pc, choice->cholesky ? PCCHOLESKY : PCLU, name));
  PetscCall(LinearMarkPackage(pc, NULL)); /* the package is still the user's choice */
  PetscCall(PetscSNPrintf(choice->text, sizeof choice->text, "%s, with %s as the user chose",
                          choice->cholesky ? "LDL^T" : "LU", name));
  PetscFunctionReturn(0);
}

/* Refuses LU, if the user asked for it, of a matrix that stores one triangle */
static PetscErrorCode RefuseTriangle(PC pc, Mat P)
{
  PetscBool triangle, lu;
  MatType   type;

  PetscFunctionBegin;
  PetscCall(LinearStoresTriangle(P, &triangle));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCLU, &lu));
  PetscCall(MatGetType(P, &type));
  PetscCheck(!triangle || !lu, PetscObjectComm((PetscObject)pc), PETSC_ERR_ARG_INCOMP,
             "LU needs both triangles of the matrix, whose type %s holds one: use -pc_type cholesky, or a matrix of type %s",
             type, MATAIJ);
  PetscFunctionReturn(0);
}

static PetscErrorCode NoteRefinement(PC pc, LinearChoice *choice)
{
  MatSolverType package = NULL;

  PetscFunctionBegin;
  PetscCall(PCFactorGetMatSolverType(pc, &package));
  PetscCall(PetscStrcmp(package, LINEAR_MUMPSMIXED, &choice->refines));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearChoose(KSP ksp, Mat P, PetscBool symmetric, LinearChoice *choice)
{
  PC pc;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  if (choice->iterative)
    PetscCall(LinearSetKrylov(ksp, choice->cholesky = symmetric, choice));
  else if (choice->user_pc && choice->user_package)
    PetscCall(PetscStrncpy(choice->text, "as the user chose", sizeof choice->text));
  else if (choice->user_package)
    PetscCall(ChooseForUsersPackage(ksp, P, symmetric, pc, choice));
  else
    PetscCall(ChoosePackage(ksp, P, symmetric, pc, choice));
  PetscCall(RefuseTriangle(pc, P));
  PetscCall(LinearLoosen(ksp, choice));
  PetscCall(NoteRefinement(pc, choice));
  PetscCall(PetscInfo(ksp, "Linear solver: %s\n", choice->text));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearChooseAgain(KSP ksp, Mat P, const LinearChosen &was, LinearChoice *choice)
{
  PC        pc;
  PetscBool available = (PetscBool)(was.package[0] != 0), krylov = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(LinearTakeFactor(ksp, choice)); /* the KSP may have been set up for another run before */
  choice->krylov_given_up = was.krylov_given_up;
  choice->no_room         = was.no_room;
  if (was.iterative) PetscCall(LinearTakeKrylovAgain(ksp, P, was.cholesky, choice, &krylov));
  if (available) PetscCall(FactorAvailable(P, was.package, was.cholesky ? MAT_FACTOR_CHOLESKY : MAT_FACTOR_LU, &available));
  const bool by_user = choice->user_pc && choice->user_package;
  if (!krylov && !by_user && (!available || choice->user_package)) {
    PetscCall(LinearChoose(ksp, P, was.cholesky, choice));
    PetscFunctionReturn(0);
  }
  if (!krylov && !by_user) {
    if (choice->user_pc) PetscCall(SetPackage(pc, was.package));
    else PetscCall(SetFactorization(ksp, pc, was.cholesky ? PCCHOLESKY : PCLU, was.package));
    choice->cholesky = (PetscBool)(was.cholesky && !choice->user_pc);
    PetscCall(PetscSNPrintf(choice->text, sizeof choice->text, "%s with %s, as before", was.cholesky ? "LDL^T" : "LU", was.package));
  }
  PetscCall(LinearLoosen(ksp, choice));
  PetscCall(NoteRefinement(pc, choice));
  PetscFunctionReturn(0);
}
