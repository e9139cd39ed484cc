/* Settings that cannot work lead to an error message that gives the reason, never to a crash or to NaN in the state */
#include "support.h"

using namespace hhtest;

namespace
{

struct Refusal {
  std::string options, says;
};

void expectRefused(const Refusal &r)
{
  const Pendulum p(-90., 0., .1);
  std::string    message;
  PetscErrorCode code = 0;
  ErrorTrap      trap;
  Printed        out;
  try {
    Simulation run(p, tolerance(1e-5) + r.options);
    code = run.solve();
  } catch (const std::runtime_error &) {
    code = PETSC_ERR_ARG_WRONG; /* raised while options are read */
  }
  EXPECT_NE(code, 0) << r.options;
  EXPECT_TRUE(trap.says(r.says) || trap.says("less than allowed bound") || trap.says("greater than allowed bound")) << r.options << ": " << trap.message; /* PETSc's own message since 3.21 */
}

} // namespace

TEST(RefusedSettings, Numbers)
{
  for (const char *value : {"nan", "-1e-3", "inf"}) {
    const std::string v = value;
    for (const Refusal &r :
         {Refusal{"-ts_rtol " + v, "relative tolerance"}, Refusal{"-ts_atol " + v, "absolute tolerance"},
          Refusal{"-ts_dt " + v, "time step"}, Refusal{"-ts_hhtdae_corrector_tolerance " + v, "Corrector tolerance"},
          Refusal{"-ts_hhtdae_radius " + v, "adius"}, Refusal{"-ts_hhtdae_alpha -" + v, "alpha"}})
      if (r.options != "-ts_hhtdae_alpha --1e-3") expectRefused(r);
  }
  expectRefused({"-ts_init_time nan", "must be numbers"});
  expectRefused({"-ts_init_time inf", "must be numbers"});
  expectRefused({"-ts_max_time nan -ts_max_steps 3", "must be numbers"});
  expectRefused({"-ts_adapt_dt_min 1 -ts_adapt_dt_max .1", ""});
  expectRefused({"-ts_adapt_dt_max nan", ""});
  expectRefused({"-ts_adapt_safety nan", ""});
}

TEST(RefusedSettings, VectorsOfTolerances)
{
  const Pendulum p(-90., 0., .1);
  for (double bad : {(double)NAN, -1., (double)INFINITY}) {
    for (int which = 0; which < 2; which++) {
      Simulation run(p, tolerance(1e-5));
      Vec        tol;
      must(VecDuplicate(run.U, &tol));
      must(VecSet(tol, 1e-5));
      must(VecSetValue(tol, 1, bad, INSERT_VALUES));
      must(VecAssemblyBegin(tol));
      must(VecAssemblyEnd(tol));
      must(TSSetTolerances(run.ts, 1e-5, which ? nullptr : tol, 1e-5, which ? tol : nullptr));
      must(VecDestroy(&tol));
      ErrorTrap trap;
      EXPECT_EQ(run.solve(), PETSC_ERR_ARG_OUTOFRANGE);
      EXPECT_TRUE(trap.says("tolerance of unknown 1")) << trap.message;
    }
  }
}

TEST(RefusedSettings, TypesOfSNES)
{
  expectRefused({"-snes_type vinewtonrsls", "variational inequalities"});
  expectRefused({"-snes_type vinewtonssls", "variational inequalities"});
  expectRefused({"-snes_type ksptransposeonly", "transposed"});
  expectRefused({"-snes_type ms", "without asking for a test of convergence"});
  expectRefused({"-snes_type ngs", "row by row"});
  expectRefused({"-snes_mf", "-snes_mf_operator"});
}

namespace
{

/* Either the result is right, or there is an error message */
void tryTypeOfSNES(const std::string &type)
{
  const Pendulum p(-90., 0., .1);
  Simulation     plain(p, tolerance(1e-5));
  must(plain.solve());
  const auto options = tolerance(1e-5) + "-ts_max_steps 2000 -ts_max_reject 30 -snes_type " + type;
  ErrorTrap  trap;
  Printed    out;
  try {
    Simulation           run(p, options);
    const PetscErrorCode code = run.solve();
    const double         e    = code ? NAN : relativeDifference(run.u(), plain.u());
    MEASURED("%-12s %s%g %s", type.c_str(), code ? "error " : "", code ? (double)code : e, code ? trap.message.substr(0, 150).c_str() : "");
    if (!code && run.t() >= .1) {
      EXPECT_LT(e, 1e-2) << type;
    }
    EXPECT_EQ(code != 0, !trap.message.empty()) << type;
    if (type.find("newton") == 0 || type == "ksponly") {
      EXPECT_EQ(code, 0) << type << ": " << trap.message;
    }
  } catch (const std::runtime_error &) {
    EXPECT_FALSE(trap.message.empty()) << type; /* raised while options are read */
  }
}

} // namespace

/* Every SNES type of PETSc */
TEST(RefusedSettings, EveryTypeOfSNES)
{
  for (const char *type : {"newtonls", "newtontr", "newtontrdc", "ksponly", "nrichardson", "ngmres", "anderson", "qn", "ncg", "ngs", "ms", "fas", "nasm", "aspin", "composite", "multiblock", "shell"})
    tryTypeOfSNES(type);
}

/* Trust regions and line searches may fail where residual norms are rounding errors; this is no reason to reduce h.
   The four-bar here passes through its flat positions */
TEST(RefusedSettings, NormsThatAreRounding)
{
  const FourBar p(2, 10.);
  for (double eps : {1e-3, 3e-5, 1e-5, 1e-6}) {
    Simulation plain(p, tolerance(eps)), run(p, tolerance(eps) + "-snes_type newtontr");
    must(plain.solve());
    must(run.solve());
    MEASURED("%g: %d steps, %d", eps, (int)run.statistics().steps, (int)plain.statistics().steps);
    EXPECT_LT(run.statistics().steps, 1.4 * plain.statistics().steps) << eps;
    EXPECT_LT(run.errors().q, 3 * plain.errors().q) << eps;
  }
}

/* Tested separately, because SNESPATCH leaks its DM and communicator where there are no cells to build patches from;
   skipped when leaks are checked */
TEST(RefusedSettings, SNESOfTypePatch)
{
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "PETSc's leak";
#endif
  tryTypeOfSNES("patch");
}

namespace
{

/* A residual that is not a number after some time */
struct Broken : Pendulum {
  Broken() : Pendulum(-60., 1., 1.) {}
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    Pendulum::residual(t, u, v, a, f);
    if (t > .2) f[0] = NAN;
  }
};

} // namespace

/* SNES types that do not test norms */
TEST(RefusedSettings, NotANumberIsNotAccepted)
{
  const Broken p;
  for (const char *type : {"ksponly", "ms", "newtonls", "newtontr"}) {
    Simulation run(p, tolerance(1e-4) + "-ts_dt 1e-2 -ts_max_reject 20 -snes_type " + type);
    ErrorTrap  trap;
    EXPECT_NE(run.solve(), 0) << type;
    EXPECT_FALSE(trap.message.empty());
    for (double x : run.u()) EXPECT_TRUE(std::isfinite(x)) << type;
    EXPECT_LE(run.t(), .2);
  }
}

TEST(RefusedSettings, SolversThatDoNotFit)
{
  expectRefused({"-pc_factor_mat_solver_type nosuchpackage", "nosuchpackage"});
  expectRefused({"-pc_type nosuchpc", "nosuchpc"});
  for (const char *options : {"-ksp_type richardson -pc_type sor -ksp_max_it 5", "-ksp_type gmres -pc_type sor -ksp_max_it 3", "-ksp_type gmres -pc_type ilu -ksp_max_it 1"}) {
    const Pendulum p(-90., 0., .1);
    Simulation     run(p, tolerance(1e-5) + options);
    ErrorTrap      trap;
    if (run.solve()) {
      MEASURED("%s: %s", options, trap.message.c_str());
      EXPECT_FALSE(trap.says("Phi_q 0] is singular")) << trap.message;
    } else
      EXPECT_LT(run.errors().q, 1e-2) << options;
  }
}

/* Linear solves that depend on earlier ones; these options had led to multipliers wrong by percents or to an endless run */
TEST(RefusedSettings, SolvesThatGoOnFromOthers)
{
  expectRefused({"-ksp_type gmres -pc_type none -snes_ksp_ew", "-snes_ksp_ew"});
  expectRefused({"-ksp_type gmres -ksp_diagonal_scale", "-ksp_diagonal_scale"});
  expectRefused({"-ksp_type cg -ksp_initial_guess_nonzero", "-ksp_initial_guess_nonzero"});
  expectRefused({"-ksp_type gmres -ksp_diagonal_scale -ksp_diagonal_scale_fix", "-ksp_diagonal_scale"});
}

/* PETSc's options for Jacobians by differences */
TEST(RefusedSettings, JacobiansFromDifferences)
{
  const Pendulum p(-90., 0., .5);
  Simulation     plain(p, tolerance(1e-6));
  must(plain.solve());
  for (const char *option : {"-snes_fd", "-snes_fd_color", "-ts_fd_color"}) {
    Simulation run(p, tolerance(1e-6) + option);
    must(run.solve());
    MEASURED("%s: %d steps, %d iterations, with its Jacobian %d and %d", option, (int)run.statistics().steps, (int)run.statistics().newton, (int)plain.statistics().steps,
             (int)plain.statistics().newton);
    EXPECT_LT(relativeDifference(run.u(), plain.u()), 1e-5) << option;
    EXPECT_LT(run.statistics().newton, plain.statistics().newton * 11 / 10 + 5) << option;
    EXPECT_GE(run.statistics().residuals, plain.statistics().residuals + 3 * run.statistics().jacobians) << option; /* differences were used */
  }
}

TEST(RefusedSettings, FinalTimeByInterpolation)
{
  const Pendulum p(-90., 0., .5);
  Simulation     run(p, tolerance(1e-6) + "-ts_exact_final_time interpolate");
  ErrorTrap      trap;
  /* TSSolve(ts, NULL): older versions of PETSc cannot interpolate into the solution */
#if PETSC_VERSION_LT(3, 20, 0)
  EXPECT_EQ(run.solve(), PETSC_ERR_ARG_NULL);
  EXPECT_TRUE(trap.says("TSSolve(ts, U)")) << trap.message;
#else
  EXPECT_EQ(run.solve(), 0) << trap.message;
  PetscReal end;
  must(TSGetSolveTime(run.ts, &end));
  EXPECT_DOUBLE_EQ(end, .5);
#endif
}

/* Multigrid whose coarse matrices are not formed from the scaled matrix; this had ended in a segmentation fault */
TEST(RefusedSettings, MultigridWithMatricesOfTheApplication) { expectRefused({"-ksp_type gmres -pc_type mg -pc_mg_levels 2", "coarse levels"}); }

/* Vectors of tolerances must have one entry per unknown */
TEST(RefusedSettings, VectorsOfTolerancesOfAnotherLayout)
{
  const Pendulum p(-90., 0., .1);
  for (int which = 0; which < 2; which++) {
    Simulation run(p, tolerance(1e-5));
    Vec        tol;
    must(VecCreateSeq(PETSC_COMM_SELF, p.n - 1, &tol));
    must(VecSet(tol, 1e-5));
    must(TSSetTolerances(run.ts, 1e-5, which ? nullptr : tol, 1e-5, which ? tol : nullptr));
    ErrorTrap trap;
    EXPECT_NE(run.solve(), 0);
    EXPECT_TRUE(trap.says("tolerances has 2 entries")) << trap.message;
    must(VecDestroy(&tol));
  }
}
