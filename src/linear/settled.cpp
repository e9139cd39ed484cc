/* Tells which parts of a linear solver the user has set, by options or by program, and which were set here; sets the defaults and undoes them */
#include "choose.h"
#include "linear.h"
#include <petsc/private/kspimpl.h>
#include <petsc/private/pcimpl.h>

PetscErrorCode LinearOptionGiven(KSP ksp, const char name[], PetscBool *given)
{
  PetscOptions options;
  const char  *prefix;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetOptions((PetscObject)ksp, &options));
  PetscCall(KSPGetOptionsPrefix(ksp, &prefix));
  PetscCall(PetscOptionsHasName(options, prefix, name, given));
  PetscFunctionReturn(0);
}

/* Marks composed with KSP and PC: containers whose names are the type and the package that were set here. A type or package that differs from its mark, or has none, was set by
   the program. */
static const char MARK_TYPE[] = "hhtdae_linear_type", MARK_PACKAGE[] = "hhtdae_linear_package";

static PetscErrorCode SetMark(PetscObject pc, const char mark[], const char name[])
{
  PetscContainer ours;

  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(PetscObjectComm(pc), &ours));
  PetscCall(PetscObjectSetName((PetscObject)ours, name));
  PetscCall(PetscObjectCompose(pc, mark, (PetscObject)ours));
  PetscCall(PetscContainerDestroy(&ours));
  PetscFunctionReturn(0);
}

static PetscErrorCode BearsMark(PetscObject pc, const char mark[], const char name[], PetscBool *marked)
{
  PetscObject ours;
  const char *was;

  PetscFunctionBegin;
  *marked = PETSC_FALSE;
  PetscCall(PetscObjectQuery(pc, mark, &ours));
  if (!ours) PetscFunctionReturn(0);
  PetscCall(PetscObjectGetName(ours, &was));
  PetscCall(PetscStrcmp(was, name, marked));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearSetType(PC pc, PCType type)
{
  PetscFunctionBegin;
  PetscCall(PCSetType(pc, type));
  PetscCall(SetMark((PetscObject)pc, MARK_TYPE, type));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearMarkPackage(PC pc, const char package[])
{
  PetscFunctionBegin;
  if (package) PetscCall(SetMark((PetscObject)pc, MARK_PACKAGE, package));
  else PetscCall(PetscObjectCompose((PetscObject)pc, MARK_PACKAGE, NULL));
  PetscFunctionReturn(0);
}

static PetscErrorCode PackageByProgram(PC pc, PetscBool *by_program)
{
  MatSolverType package = NULL;
  PetscBool     ours    = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PCFactorGetMatSolverType(pc, &package));
  if (package) PetscCall(BearsMark((PetscObject)pc, MARK_PACKAGE, package, &ours));
  *by_program = package && !ours ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(0);
}

static PetscErrorCode TypeByProgram(PC pc, PetscBool *by_program)
{
  PetscBool ours = PETSC_FALSE;
  PCType    type;

  PetscFunctionBegin;
  PetscCall(PCGetType(pc, &type));
  if (type) PetscCall(BearsMark((PetscObject)pc, MARK_TYPE, type, &ours));
  *by_program = type && !ours ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(0);
}

/* Whether the preconditioner solves exactly, so that preonly is the default KSP: true for direct solvers and if the user chose no preconditioner */
static PetscErrorCode IsSolver(KSP ksp, PC pc, PetscBool by_program, PetscBool *solver)
{
  PetscOptions options;
  const char  *prefix, *const solvers[] = {PCLU, PCCHOLESKY, PCSVD, PCQR, PCREDUNDANT};
  char         type[64] = "";
  PetscBool    by_option, same;
  PCType       set;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetOptions((PetscObject)ksp, &options));
  PetscCall(KSPGetOptionsPrefix(ksp, &prefix));
  PetscCall(PetscOptionsGetString(options, prefix, "-pc_type", type, sizeof(type), &by_option));
  if (!by_option && by_program) {
    PetscCall(PCGetType(pc, &set));
    PetscCall(PetscStrncpy(type, set, sizeof(type)));
  }
  *solver = type[0] ? PETSC_FALSE : PETSC_TRUE;
  for (const char *name : solvers) {
    PetscCall(PetscStrcmp(type, name, &same));
    if (same) *solver = PETSC_TRUE;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode LinearDefaults(KSP ksp, LinearChoice *choice)
{
  PC        pc;
  KSPType   ksp_type;
  PCType    pc_type;
  PetscBool operators, triangle = PETSC_FALSE;
  Mat       P;
  PetscBool pc_by_program = PETSC_FALSE, pc_by_option, by_option, package_by_program = PETSC_FALSE, package_by_option, solver = PETSC_TRUE;

  PetscFunctionBegin;
  *choice = LinearChoice();
  PetscCall(LinearTakeFactor(ksp, choice));
  PetscCall(KSPGetType(ksp, &ksp_type));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetType(pc, &pc_type));
  PetscCall(TypeByProgram(pc, &pc_by_program));
  PetscCall(IsSolver(ksp, pc, pc_by_program, &solver));
  if (!ksp_type) { /* GMRES, PETSc's default, for preconditioners that are no solvers */
    PetscCall(KSPSetType(ksp, solver ? KSPPREONLY : KSPGMRES));
    PetscCall(LinearOptionGiven(ksp, "-ksp_type", &by_option));
    if (!by_option) PetscCall(SetMark((PetscObject)ksp, MARK_TYPE, solver ? KSPPREONLY : KSPGMRES));
  }
  PetscCall(LinearOptionGiven(ksp, "-pc_type", &pc_by_option));
  PetscCall(PackageByProgram(pc, &package_by_program));
  PetscCall(LinearOptionGiven(ksp, "-pc_factor_mat_solver_type", &package_by_option));
  choice->user_pc      = pc_by_program || pc_by_option ? PETSC_TRUE : PETSC_FALSE;
  choice->user_package = package_by_program || package_by_option ? PETSC_TRUE : PETSC_FALSE;
  if (!pc_type) { /* PCSetFromOptions() looks for the factorization at once if options name a package: it must be one that the matrix has */
    PetscCall(KSPGetOperatorsSet(ksp, NULL, &operators));
    if (operators) PetscCall(KSPGetOperators(ksp, NULL, &P));
    if (operators) PetscCall(LinearStoresTriangle(P, &triangle));
    PetscCall(LinearSetType(pc, triangle ? PCCHOLESKY : PCLU));
  }
  PetscFunctionReturn(0);
}

/* Puts the KSP into the state before KSPSetType(), for which PETSc has no function, so that PETSc's defaults apply at the next set-up */
static PetscErrorCode MakeTypeless(KSP ksp)
{
  PetscFunctionBegin;
  PetscTryTypeMethod(ksp, destroy);
  ksp->data = NULL;
  PetscCall(PetscMemzero(ksp->ops, sizeof(*ksp->ops)));
  ksp->ops->buildsolution = KSPBuildSolutionDefault;
  ksp->ops->buildresidual = KSPBuildResidualDefault;
  PetscCall(PetscObjectChangeTypeName((PetscObject)ksp, NULL));
  PetscFunctionReturn(0);
}

/* Likewise the state before PCSetType() */
static PetscErrorCode MakeTypeless(PC pc)
{
  PetscFunctionBegin;
  PetscTryTypeMethod(pc, destroy);
  pc->data = NULL;
  PetscCall(PetscMemzero(pc->ops, sizeof(*pc->ops)));
  PetscCall(PetscObjectChangeTypeName((PetscObject)pc, NULL));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearLeave(KSP ksp, LinearChoice *choice)
{
  PC        pc;
  KSPType   method;
  PCType    type;
  PetscBool given, ours = PETSC_FALSE, package_by_program;

  PetscFunctionBegin;
  PetscCall(LinearTakeFactor(ksp, choice));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(KSPGetType(ksp, &method));
  PetscCall(PCGetType(pc, &type));
  if (!method && !type) PetscFunctionReturn(0);
  PetscCall(KSPReset(ksp));
  PetscCall(LinearOptionGiven(ksp, "-ksp_type", &given));
  if (method && !given) PetscCall(BearsMark((PetscObject)ksp, MARK_TYPE, method, &ours));
  if (ours) PetscCall(MakeTypeless(ksp));
  ours = PETSC_FALSE;
  PetscCall(LinearOptionGiven(ksp, "-pc_type", &given));
  if (type && !given) PetscCall(BearsMark((PetscObject)pc, MARK_TYPE, type, &ours));
  PetscCall(PackageByProgram(pc, &package_by_program));
  PetscCall(LinearOptionGiven(ksp, "-pc_factor_mat_solver_type", &given));
  if (ours) PetscCall(MakeTypeless(pc));
  else if (!package_by_program && !given) PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERPETSC));
  PetscFunctionReturn(0);
}
