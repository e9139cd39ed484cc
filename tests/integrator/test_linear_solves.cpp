/* Linear solvers of the user that report convergence although they have not solved the system */
#include "support.h"

using namespace hhtest;

namespace
{

PetscErrorCode nothing(PC, Vec, Vec y) { return VecZeroEntries(y); }

/* A preconditioner that is the identity except for the row of the constraint, which it sets to zero */
PetscErrorCode withoutLast(PC, Vec x, Vec y)
{
  must(VecCopy(x, y));
  must(VecSetValue(y, 2, 0, INSERT_VALUES));
  must(VecAssemblyBegin(y));
  return VecAssemblyEnd(y);
}

const Pendulum &pendulum()
{
  static const Pendulum p(-90., 0., .5);
  return p;
}

KSP solverOf(TS ts)
{
  SNES snes;
  KSP  ksp;
  must(TSGetSNES(ts, &snes));
  must(SNESGetKSP(snes, &ksp));
  return ksp;
}

} // namespace

/* A residual below an absolute tolerance is not a criterion: GMRES would make no iteration, and the predicted values
   would be accepted. -ksp_atol is ignored with a message */
TEST(LinearSolves, AbsoluteTolerances)
{
  Simulation plain(pendulum(), tolerance(1e-5));
  must(plain.solve());
  for (const char *atol : {"1", "1e-3", "1e-12"}) {
    Printed    out;
    Simulation run(pendulum(), tolerance(1e-5) + "-ksp_type gmres -pc_type none -ksp_atol " + atol);
    Vec        U, V;
    must(VecDuplicate(run.U, &U));
    must(VecDuplicate(run.U, &V));
    run.watch = [&](Simulation &r, PetscInt step, double t) {
      if (step == 5) must(TSHHT3EvaluateAt(r.ts, t - 1e-4, U, V, NULL));
    };
    must(run.solve());
    EXPECT_LT(relativeDifference(run.u(), plain.u()), 1e-5) << atol;
    EXPECT_LT(run.statistics().steps, plain.statistics().steps * 11 / 10) << atol;
    EXPECT_EQ(out.text().find("hhtdae: -ksp_atol"), 0) << out.text();
    EXPECT_EQ(out.text().find("has no effect"), out.text().rfind("has no effect")) << out.text(); /* printed once */
    must(VecDestroy(&U));
    must(VecDestroy(&V));
  }
}

/* Packages that do no row exchanges, or only some, meet zero pivots on the diagonal of a nonsingular matrix */
TEST(LinearSolves, PackagesThatExchangeNoRows)
{
  const FourBar bars(2, .4);
  for (const char *package : {"petsc", "superlu_dist"}) {
    PetscBool there;
    {
      Mat P;
      must(MatCreateSeqAIJ(PETSC_COMM_SELF, 1, 1, 1, NULL, &P));
      must(MatGetFactorAvailable(P, package, MAT_FACTOR_LU, &there));
      must(MatDestroy(&P));
    }
    if (!there) continue;
    Simulation run(bars, tolerance(1e-5) + "-pc_type lu -pc_factor_mat_solver_type " + package);
    ErrorTrap  trap;
    EXPECT_EQ(run.solve(), PETSC_ERR_MAT_LU_ZRPVT);
    EXPECT_TRUE(trap.says(std::string(package) + " has met a zero pivot")) << trap.message;
    EXPECT_TRUE(trap.says("-pc_factor_mat_solver_type mumps or klupair")) << trap.message;
    Simulation whole(bars, tolerance(1e-5) + "-pc_type lu -pc_factor_mat_solver_type klupair");
    EXPECT_EQ(whole.solve(), 0);
  }
}

/* The user's absolute tolerance is restored for another TS type */
TEST(LinearSolves, AbsoluteTolerancesComeBack)
{
  Printed    out;
  Simulation run(pendulum(), tolerance(1e-5) + "-ts_max_steps 2");
  PetscReal  atol;
  must(KSPSetTolerances(solverOf(run.ts), PETSC_DEFAULT, 1e-3, PETSC_DEFAULT, PETSC_DEFAULT));
  must(run.solve());
  must(KSPGetTolerances(solverOf(run.ts), NULL, &atol, NULL, NULL));
  EXPECT_EQ(atol, 0);
  must(TSSetType(run.ts, TSALPHA2));
  must(KSPGetTolerances(solverOf(run.ts), NULL, &atol, NULL, NULL));
  EXPECT_EQ(atol, 1e-3);
}

/* GMRES tests convergence in the preconditioned norm. BoomerAMG is singular for some rows of this problem; without a
   check the run ended with an error of 500 % and no message */
TEST(LinearSolves, PreconditionersOfOtherProblems)
{
  PetscBool there;
  must(PetscHasExternalPackage("hypre", &there));
  if (!there) GTEST_SKIP() << "PETSc has no hypre";
  const UserVars p(1.);
  Simulation     run(p, tolerance(1e-5) + "-ksp_type gmres -pc_type hypre");
  ErrorTrap      trap;
  EXPECT_EQ(run.solve(), PETSC_ERR_NOT_CONVERGED);
  EXPECT_TRUE(trap.says("zero or too little for the right-hand side")) << trap.message;
}

/* A preconditioner without the rows of constraints */
TEST(LinearSolves, SingularPreconditioners)
{
  for (const char *type : {"gmres", "preonly"}) {
    Simulation run(pendulum(), tolerance(1e-5) + "-ksp_type " + type);
    PC         pc;
    must(KSPGetPC(solverOf(run.ts), &pc));
    must(PCSetType(pc, PCSHELL));
    must(PCShellSetApply(pc, withoutLast));
    ErrorTrap trap;
    EXPECT_EQ(run.solve(), PETSC_ERR_NOT_CONVERGED) << type;
    EXPECT_TRUE(trap.says("zero or too little for the right-hand side")) << trap.message;
  }
}

/* A preconditioner that returns zero, from the start on or from step 10 on: a step must not be accepted with the
   predicted values */
TEST(LinearSolves, ZeroIsNoSolution)
{
  for (bool from_start : {true, false}) {
    Simulation run(pendulum(), tolerance(1e-5) + "-ts_max_reject 20");
    const auto answerNothing = [&] {
      PC pc;
      must(KSPGetPC(solverOf(run.ts), &pc));
      must(PCSetType(pc, PCSHELL));
      must(PCShellSetApply(pc, nothing));
    };
    if (from_start) answerNothing();
    else run.watch = [&](Simulation &, PetscInt step, double) { if (step == 10) answerNothing(); };
    ErrorTrap trap;
    EXPECT_EQ(run.solve(), PETSC_ERR_NOT_CONVERGED) << from_start;
    EXPECT_TRUE(trap.says("zero or too little for the right-hand side")) << trap.message;
    PetscInt steps;
    must(TSGetStepNumber(run.ts, &steps));
    EXPECT_EQ(steps, from_start ? 0 : 10);
  }
}

/* Corrections as small as rounding, and smaller, are valid solutions: a motion that decays to 1e-150 takes no more
   steps than another */
TEST(LinearSolves, AMotionThatDiesAway)
{
  for (const char *solver : {"", "-ksp_type gmres -pc_type jacobi"}) {
    const Oscillators p({1e4}, {0.}, false, 600.);
    Simulation        run(p, fixedSteps(1.) + "-ts_hhtdae_radius 0 -ts_rtol 1e-13 -ts_atol 1e-13 " + solver);
    must(run.solve());
    EXPECT_EQ(run.statistics().steps, 600) << solver;
    EXPECT_EQ(run.statistics().corrector_fails, 0) << solver;
    EXPECT_LT(std::abs(run.u()[0]), 1e-150) << solver;
  }
}

/* A factorization or package that the program sets is used, whether it is set after TSSetFromOptions() or the latter
   is never called */
TEST(LinearSolves, FactorsThatTheProgramNames)
{
  for (bool options : {true, false})
    for (bool cholesky : {false, true}) {
      TS            ts;
      Vec           U, V;
      PC            pc;
      PCType        type;
      MatSolverType package;
      must(ProblemCreateTS(PETSC_COMM_SELF, pendulum(), &ts, &U, &V));
      must(TSSetType(ts, TSHHT3));
      if (options) must(TSSetFromOptions(ts));
      else must(KSPSetType(solverOf(ts), KSPPREONLY));
      must(KSPGetPC(solverOf(ts), &pc));
      must(PCSetType(pc, cholesky ? PCCHOLESKY : PCLU));
      must(PCFactorSetMatSolverType(pc, cholesky ? MATSOLVERMUMPS : MATSOLVERKLU));
      must(TSSetMaxSteps(ts, 3));
      must(TSSolve(ts, nullptr));
      PetscReal t, h;
      must(TSGetTime(ts, &t));
      must(TSGetPrevTime(ts, &h));
      must(TSHHT3EvaluateAt(ts, (t + h) / 2., nullptr, V, nullptr)); /* by the same package */
      must(PCGetType(pc, &type));
      must(PCFactorGetMatSolverType(pc, &package));
      EXPECT_STREQ(type, cholesky ? PCCHOLESKY : PCLU) << options;
      EXPECT_STREQ(package, cholesky ? MATSOLVERMUMPS : MATSOLVERKLU) << options;
      must(TSDestroy(&ts));
      must(VecDestroy(&U));
      must(VecDestroy(&V));
    }
}

/* If only the type of the factorization is set, the integrator chooses the package */
TEST(LinearSolves, CholeskyOfTheProgram)
{
  Simulation run(pendulum(), tolerance(1e-5) + "-ts_max_steps 3");
  PC         pc;
  PCType     type;
  must(KSPGetPC(solverOf(run.ts), &pc));
  must(PCSetType(pc, PCCHOLESKY));
  must(run.solve());
  must(PCGetType(pc, &type));
  EXPECT_STREQ(type, PCCHOLESKY);
}
