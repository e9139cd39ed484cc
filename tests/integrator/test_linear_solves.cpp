/* Linear solvers of the user's that have solved nothing, whatever they say */
#include "support.h"

using namespace hhtest;

namespace
{

PetscErrorCode nothing(PC, Vec, Vec y) { return VecZeroEntries(y); }

/* The identity but for the row of the constraint */
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

/* A residual below it is no solution: GMRES would make no iteration, and the predictor's values would stand */
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
    EXPECT_EQ(out.text().find("has no effect"), out.text().rfind("has no effect")) << out.text(); /* said once */
    must(VecDestroy(&U));
    must(VecDestroy(&V));
  }
}

/* Packages that exchange no rows, or not all, meet zeros on the diagonal of a matrix that has an inverse */
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

/* The user's is in place again for another type */
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

/* GMRES converges in the norm of its preconditioner: BoomerAMG's is blind for rows of this problem, and the run ended with an error of 500 % and no word of it */
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

/* One without the rows of constraints */
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

/* In the start, and where it begins on the way: a step is not accepted with the predictor's values */
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

/* Answers as small as rounding can tell, and smaller, are answers: a motion that dies away takes no more steps than another */
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

/* A factorization or a package that the program names is taken after TSSetFromOptions(), and where that is never called, too */
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

/* A type alone leaves the package to the integrator */
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
