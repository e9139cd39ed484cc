/* Setters and options: which values they accept and refuse, and that PETSc's own options take precedence over the defaults */
#include "integrator/state.h"
#include "support.h"

using namespace hhtest;

namespace
{

/* Expects that a call returns this error with this message */
void expectRefused(PetscErrorCode (*call)(TS), PetscErrorCode code, const std::string &message)
{
  const Pendulum p;
  Simulation     run(p, "");
  ErrorTrap      trap;
  EXPECT_EQ(call(run.ts), code);
  EXPECT_TRUE(trap.says(message)) << trap.message;
}

std::string typeOf(void *object) { return object ? ((PetscObject)object)->type_name : ""; }

} // namespace

TEST(Options, Defaults)
{
  const Pendulum p;
  Simulation     run(p, "");
  TSHHT3Form     form;
  PetscReal      alpha;
  must(TSHHT3GetForm(run.ts, &form));
  must(TSHHT3GetAlpha(run.ts, &alpha));
  EXPECT_EQ(form, TSHHT3_FORM_SECOND_ORDER);
  EXPECT_DOUBLE_EQ(alpha, -.3);
  TSAdapt adapt;
  must(TSGetAdapt(run.ts, &adapt));
  must(TSSetUp(run.ts));
  EXPECT_EQ(typeOf(adapt), TSHHT3);
}

TEST(Options, AreRead)
{
  const Pendulum p;
  Simulation     run(
          p,
          "-ts_hhtdae_form paper -ts_hhtdae_alpha -0.1 -ts_hhtdae_corrector_tolerance 1e-5 -ts_hhtdae_predictor_degree 2 "
              "-ts_hhtdae_reuse 1.5,0.3,1.1 -ts_hhtdae_start project");
  const hht3::Integrator &I = hht3::Get(run.ts);
  EXPECT_EQ(I.form, TSHHT3_FORM_PAPER);
  EXPECT_DOUBLE_EQ(I.alpha, -.1);
  EXPECT_DOUBLE_EQ(I.corrector.c, 1e-5);
  EXPECT_TRUE(I.predictor.fixed);
  EXPECT_EQ(I.predictor.degree_max, 2);
  EXPECT_DOUBLE_EQ(I.corrector.ratio, 1.5);
  EXPECT_DOUBLE_EQ(I.corrector.slow_rate, .3);
  EXPECT_DOUBLE_EQ(I.corrector.hold, 1.1);
  EXPECT_EQ(I.start_policy, TSHHT3_START_PROJECT);
}

TEST(Options, OutOfRangeIsRefused)
{
  expectRefused([](TS ts) { return TSHHT3SetAlpha(ts, .1); }, PETSC_ERR_ARG_OUTOFRANGE,
                "alpha = 0.1 is not in [-1/3, 0]");
  expectRefused([](TS ts) { return TSHHT3SetAlpha(ts, -.4); }, PETSC_ERR_ARG_OUTOFRANGE, "alpha = -0.4");
  expectRefused([](TS ts) { return TSHHT3SetAlpha(ts, NAN); }, PETSC_ERR_ARG_OUTOFRANGE, "alpha = nan");
  expectRefused([](TS ts) { return TSHHT3SetRadius(ts, 1.1); }, PETSC_ERR_ARG_OUTOFRANGE, "radius 1.1");
  expectRefused([](TS ts) { return TSHHT3SetRadius(ts, -.1); }, PETSC_ERR_ARG_OUTOFRANGE, "radius -0.1");
  expectRefused([](TS ts) { return TSHHT3SetCorrectorTolerance(ts, 0.); }, PETSC_ERR_ARG_OUTOFRANGE, "tolerance 0");
  expectRefused([](TS ts) { return TSHHT3SetCorrectorTolerance(ts, 1.); }, PETSC_ERR_ARG_OUTOFRANGE, "tolerance 1");
  expectRefused([](TS ts) { return TSHHT3SetPredictorDegree(ts, 4); }, PETSC_ERR_ARG_OUTOFRANGE, "degree 4");
  expectRefused([](TS ts) { return TSHHT3SetPredictorDegree(ts, -2); }, PETSC_ERR_ARG_OUTOFRANGE, "degree -2");
  expectRefused([](TS ts) { return TSHHT3SetReuse(ts, .9, .2, 1.2); }, PETSC_ERR_ARG_OUTOFRANGE, "ratio 0.9");
  expectRefused([](TS ts) { return TSHHT3SetReuse(ts, 1.4, -.2, 1.2); }, PETSC_ERR_ARG_OUTOFRANGE, "rate -0.2");
  expectRefused([](TS ts) { return TSHHT3SetReuse(ts, 1.4, .2, .5); }, PETSC_ERR_ARG_OUTOFRANGE, "hold 0.5");
  expectRefused([](TS ts) { return TSHHT3SetForm(ts, (TSHHT3Form)7); }, PETSC_ERR_ARG_OUTOFRANGE, "form 7");
  expectRefused([](TS ts) { return TSHHT3SetStart(ts, (TSHHT3Start)7); }, PETSC_ERR_ARG_OUTOFRANGE, "start 7");
}

TEST(Options, OutOfRangeFromTheCommandLineIsRefused)
{
  const Pendulum p;
  ErrorTrap      trap;
  EXPECT_THROW(Simulation(p, "-ts_hhtdae_alpha 0.2"), std::runtime_error);
  EXPECT_TRUE(trap.says("alpha = 0.2")) << trap.message;
  EXPECT_THROW(Simulation(p, "-ts_hhtdae_reuse 1.5,0.3"), std::runtime_error);
  EXPECT_THROW(Simulation(p, "-ts_hhtdae_reuse 1.5,0.3,1.1,2"), std::runtime_error);
  EXPECT_TRUE(trap.says("three numbers")) << trap.message;
  EXPECT_THROW(Simulation(p, "-ts_hhtdae_checkpoint_every -3"), std::runtime_error);
}

TEST(Options, RadiusBelongsToTheSecondOrderForm)
{
  const Pendulum p;
  Simulation     run(p, "-ts_hhtdae_form paper -ts_hhtdae_radius 0.5");
  ErrorTrap      trap;
  EXPECT_EQ(run.solve(), PETSC_ERR_ARG_INCOMP);
  EXPECT_TRUE(trap.says("spectral radius (0.5) belongs to the second-order form")) << trap.message;
}

TEST(Options, MissingI2Function)
{
  TS        ts;
  Vec       U, V;
  ErrorTrap trap;
  must(VecCreateSeq(PETSC_COMM_SELF, 2, &U));
  must(VecDuplicate(U, &V));
  must(TSCreate(PETSC_COMM_SELF, &ts));
  must(TSSetType(ts, TSHHT3));
  must(TS2SetSolution(ts, U, V));
  EXPECT_EQ(TSSetUp(ts), PETSC_ERR_ARG_WRONGSTATE);
  EXPECT_TRUE(trap.says("TSSetI2Function()")) << trap.message;
  must(TSDestroy(&ts));
  must(VecDestroy(&U));
  must(VecDestroy(&V));
}

namespace
{

PetscErrorCode freeFall(TS, PetscReal, Vec, Vec, Vec A, Vec F, void *) { return VecCopy(A, F); }

/* Sets up a TS that has a function, but not everything that belongs to it */
PetscErrorCode setUpWith(PetscInt n, PetscInt m, std::string &message)
{
  TS        ts;
  Vec       U, V, F;
  ErrorTrap trap;
  must(VecCreateSeq(PETSC_COMM_SELF, n, &U));
  must(VecDuplicate(U, &F));
  must(TSCreate(PETSC_COMM_SELF, &ts));
  must(TSSetType(ts, TSHHT3));
  must(TSSetI2Function(ts, F, freeFall, nullptr));
  if (m > 0) {
    must(VecCreateSeq(PETSC_COMM_SELF, m, &V));
    must(TS2SetSolution(ts, U, V));
    must(VecDestroy(&V));
  } else
    must(TSSetSolution(ts, U));
  const PetscErrorCode code = TSSetUp(ts);
  message                   = trap.message;
  must(TSDestroy(&ts));
  must(VecDestroy(&U));
  must(VecDestroy(&F));
  return code;
}

} // namespace

TEST(Options, MissingVelocities)
{
  std::string message;
  EXPECT_EQ(setUpWith(2, 0, message), PETSC_ERR_ARG_WRONGSTATE);
  EXPECT_NE(message.find("TS2SetSolution()"), std::string::npos) << message;
}

TEST(Options, VelocitiesOfAnotherSize)
{
  std::string message;
  EXPECT_EQ(setUpWith(2, 3, message), PETSC_ERR_ARG_SIZ);
  EXPECT_NE(message.find("2 entries and its time derivative 3"), std::string::npos) << message;
}

TEST(Options, NoUnknowns)
{
  TS        ts;
  Vec       U, V, F;
  ErrorTrap trap;
  must(VecCreateSeq(PETSC_COMM_SELF, 0, &U));
  must(VecDuplicate(U, &V));
  must(VecDuplicate(U, &F));
  must(TSCreate(PETSC_COMM_SELF, &ts));
  must(TSSetType(ts, TSHHT3));
  must(TSSetI2Function(ts, F, freeFall, nullptr));
  must(TS2SetSolution(ts, U, V));
  EXPECT_EQ(TSSetUp(ts), PETSC_ERR_ARG_SIZ);
  EXPECT_TRUE(trap.says("no unknowns")) << trap.message;
  must(TSDestroy(&ts));
  must(VecDestroy(&U));
  must(VecDestroy(&V));
  must(VecDestroy(&F));
}

TEST(Options, NoToleranceAtAll)
{
  const Pendulum p;
  Simulation     run(p, "-ts_rtol 0 -ts_atol 0");
  ErrorTrap      trap;
  EXPECT_EQ(run.solve(), PETSC_ERR_ARG_WRONG);
  EXPECT_TRUE(trap.says("No unknown enters the error test")) << trap.message;
}

/* An unknown that is 0 at the start enters the relative error test as soon as it is nonzero, and counts in the mean of
   the norm from the start */
TEST(Options, RelativeToleranceOfWhatIsZeroAtTheStart)
{
  const Oscillators p({1., 2.}, {0., 0.}, false, 1.);
  Simulation        run(p, "-ts_rtol 1e-6 -ts_atol 0");
  const PetscInt    first = 0;
  must(VecSetValue(run.U, first, 0., INSERT_VALUES));
  must(VecAssemblyBegin(run.U));
  must(VecAssemblyEnd(run.U));
  must(VecSetValue(run.V, first, 1., INSERT_VALUES));
  must(VecAssemblyBegin(run.V));
  must(VecAssemblyEnd(run.V));
  must(run.solve());
  EXPECT_EQ(hht3::Get(run.ts).norm_size, 2);
}

/* Above order two the next step is chosen with the norm in which the error is tested */
TEST(Options, LargestErrorAboveOrderTwo)
{
  const Chain p(30, 0., 1.);
  for (const char *order : {"5", "auto"}) {
    Simulation run(p, tolerance(1e-5) + "-ts_adapt_wnormtype infinity -ts_hhtdae_order " + order);
    must(run.solve());
    const TSHHT3Statistics s = run.statistics();
    MEASURED("order %s by the largest error: %d steps, %d rejected", order, (int)s.steps, (int)s.rejected);
    EXPECT_LT(s.rejected, .2 * (double)s.steps) << order;
  }
}

TEST(Options, BackwardInTime)
{
  const Pendulum p;
  Simulation     run(p, "");
  must(TSSetTimeStep(run.ts, -1e-3));
  ErrorTrap trap;
  EXPECT_EQ(run.step(), PETSC_ERR_ARG_OUTOFRANGE);
  EXPECT_TRUE(trap.says("must be positive")) << trap.message;
}

TEST(Options, MethodAfterSetUpIsRefused)
{
  const Pendulum p;
  Simulation     run(p, "");
  must(TSSetUp(run.ts));
  ErrorTrap trap;
  EXPECT_EQ(TSHHT3SetAlpha(run.ts, -.1), PETSC_ERR_ARG_WRONGSTATE);
  EXPECT_EQ(TSHHT3SetForm(run.ts, TSHHT3_FORM_PAPER), PETSC_ERR_ARG_WRONGSTATE);
  EXPECT_EQ(TSHHT3SetRadius(run.ts, .5), PETSC_ERR_ARG_WRONGSTATE);
  EXPECT_TRUE(trap.says("before TSSetUp()")) << trap.message;
}

TEST(Options, AccelerationBeforeTheFirstStepIsRefused)
{
  const Pendulum p;
  Simulation     run(p, "");
  must(TSSetUp(run.ts));
  Vec       A;
  ErrorTrap trap;
  EXPECT_EQ(TSHHT3GetAcceleration(run.ts, &A), PETSC_ERR_ARG_WRONGSTATE);
}

/* For a TS of another type setters do nothing, and getters are an error */
TEST(Options, OtherTypes)
{
  TS        ts;
  PetscReal alpha;
  must(TSCreate(PETSC_COMM_SELF, &ts));
  must(TSSetType(ts, TSALPHA2));
  EXPECT_EQ(TSHHT3SetAlpha(ts, -.1), 0);
  EXPECT_EQ(TSHHT3SetReuse(ts, 2., .5, 1.), 0);
  {
    ErrorTrap trap;
    EXPECT_NE(TSHHT3GetAlpha(ts, &alpha), 0);
  }
  must(TSSetType(ts, TSHHT3)); /* and back and forth */
  EXPECT_EQ(TSHHT3SetAlpha(ts, -.1), 0);
  must(TSHHT3GetAlpha(ts, &alpha));
  EXPECT_DOUBLE_EQ(alpha, -.1);
  must(TSSetType(ts, TSALPHA2));
  must(TSDestroy(&ts));
}

TEST(Options, UsersLinearSolverWins)
{
  const FourBar p(2, .2);
  Simulation    run(p, tolerance(1e-5) + "-ksp_type gmres -ksp_rtol 1e-12 -pc_type jacobi"), plain(p, tolerance(1e-5));
  must(run.solve());
  must(plain.solve());
  SNES snes;
  KSP  ksp;
  PC   pc;
  must(TSGetSNES(run.ts, &snes));
  must(SNESGetKSP(snes, &ksp));
  must(KSPGetPC(ksp, &pc));
  EXPECT_EQ(typeOf(ksp), KSPGMRES);
  EXPECT_EQ(typeOf(pc), PCJACOBI);
  EXPECT_LT(relativeDifference(run.v(), plain.v()), 1e-6);
  must(TSGetSNES(plain.ts, &snes));
  must(SNESGetKSP(snes, &ksp));
  EXPECT_EQ(typeOf(ksp), KSPPREONLY); /* a direct solver: one triangular solve per iteration */
}

TEST(Options, UsersJacobianLagWins)
{
  const Pendulum p(-90., 0., .5);
  const int      steps = 100;
  Simulation     always(p, fixedSteps(.5 / steps) + "-snes_lag_jacobian 1"), ladder(p, fixedSteps(.5 / steps));
  must(always.solve());
  must(ladder.solve());
  const TSHHT3Statistics a = always.statistics(), l = ladder.statistics();
  MEASURED("%d steps: %d factorizations in %d iterations with -snes_lag_jacobian 1, %d in %d with the ladder", steps,
           (int)a.factorizations, (int)a.newton, (int)l.factorizations, (int)l.newton);
  EXPECT_GE(a.factorizations, a.newton - 10); /* a factorization in every iteration except those of the start */
  EXPECT_LT(l.factorizations, l.newton / 2);
}

TEST(Options, SNESMonitorsWork)
{
  const Pendulum p(-90., 0., .5);
  Simulation     run(p, fixedSteps(.01) + "-snes_monitor -snes_converged_reason");
  Printed        out;
  must(run.solve());
  EXPECT_TRUE(out.says("0 SNES Function norm")) << out.text().substr(0, 400);
  EXPECT_TRUE(out.says("1 SNES Function norm"));
  EXPECT_TRUE(out.says("Nonlinear solve converged"));
}

/* A line search of the user replaces ours and gives the same result */
TEST(Options, UsersLineSearchWins)
{
  /* all line searches of PETSc evaluate the residual after the last correction, which ours omits */
  const Pendulum p(-60., 1., .5);
  Simulation     plain(p, tolerance(1e-6));
  must(plain.solve());
  for (const char *type : {SNESLINESEARCHBASIC, SNESLINESEARCHBT}) {
    Simulation run(p, tolerance(1e-6) + "-snes_linesearch_type " + type);
    must(run.solve());
    SNES               snes;
    SNESLineSearch     search;
    SNESLineSearchType in_use;
    must(TSGetSNES(run.ts, &snes));
    must(SNESGetLineSearch(snes, &search));
    must(SNESLineSearchGetType(search, &in_use));
    EXPECT_STREQ(in_use, type);
    EXPECT_GE(run.statistics().residuals - run.statistics().newton, plain.statistics().residuals - plain.statistics().newton + run.statistics().steps) << type;
    EXPECT_LT(relativeDifference(run.u(), plain.u()), 1e-6) << type;
  }
}

/* If no correction is needed, PETSc's line searches and trust regions end in their own ways without calling the
   convergence test; these must not count as failures */
TEST(Options, OtherSearchesAtEquilibrium)
{
  const Pendulum hanging(0., 0., 2.);
  for (const char *type : {"-snes_linesearch_type bt", "-snes_linesearch_type cp", "-snes_linesearch_type l2", "-snes_type newtontr", "-snes_type ngmres -npc_snes_type newtonls"}) {
    SCOPED_TRACE(type);
    Simulation run(hanging, tolerance(1e-6) + type);
    must(run.solve());
    EXPECT_EQ(run.statistics().corrector_fails, 0);
    EXPECT_NEAR(run.u()[0], 0, 1e-9);
  }
}

/* If the user chooses a preconditioner that is not a direct solver, PETSc's default Krylov method is used, not a
   single application of the preconditioner */
TEST(Options, APreconditionerHasAKrylovMethod)
{
  for (const auto &[type, method] : {std::make_pair("jacobi", KSPGMRES), std::make_pair("lu", KSPPREONLY), std::make_pair("svd", KSPPREONLY)}) {
    const Chain p(3);
    Simulation  run(p, tolerance(1e-5) + "-pc_type " + type);
    SNES        snes;
    KSP         ksp;
    KSPType     in_use;
    must(run.solve());
    must(TSGetSNES(run.ts, &snes));
    must(SNESGetKSP(snes, &ksp));
    must(KSPGetType(ksp, &in_use));
    EXPECT_STREQ(in_use, method) << type;
  }
}

/* With TS_LINEAR there is one linear solve per step, which needs a matrix of that very step: two masses with a stiff
   spring between them */
TEST(Options, OneSolveOfALinearProblem)
{
  struct Coupled : Problem {
    Coupled()
    {
      n    = 2;
      t1   = 5;
      role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE};
    }
    void initial(double *u, double *v) const override { u[0] = u[1] = 1, v[0] = v[1] = 0; }
    void residual(double t, const double *u, const double *v, const double *a, double *f) const override
    {
      const double spring = 1e6 * (u[0] - u[1]) + 0.5 * (v[0] - v[1]);
      f[0] = a[0] + u[0] + spring - std::cos(t);
      f[1] = 2 * a[1] - spring;
    }
    void jacobian(double, const double *, const double *, const double *, double sv, double sa, Entries &J) const override
    {
      const double k = 1e6 + 0.5 * sv;
      J.add(0, 0, sa + 1 + k), J.add(0, 1, -k), J.add(1, 0, -k), J.add(1, 1, 2 * sa + k);
    }
  } p;
  Simulation one(p, tolerance(1e-6)), many(p, tolerance(1e-6));
  must(TSSetProblemType(one.ts, TS_LINEAR));
  must(one.solve());
  must(many.solve());
  EXPECT_LE(one.statistics().steps, 1.1 * many.statistics().steps);
  EXPECT_NEAR(one.u()[0] - one.u()[1], many.u()[0] - many.u()[1], 1e-8); /* relative to the spring's force this is 1e6 times as much */
}

TEST(Options, SummaryLine)
{
  const Pendulum p(-90., 0., .5);
  Simulation     run(p, tolerance(1e-6) + "-ts_hhtdae_summary");
  Printed        out;
  must(run.solve());
  size_t at = out.text().find("summary:");
  ASSERT_NE(at, std::string::npos) << out.text();
  for (const char *key :
       {" steps=", " rejected=", " newton=", " residuals=", " jacobians=", " factorizations=", " solves=", " time="}) {
    const size_t next = out.text().find(key, at);
    ASSERT_NE(next, std::string::npos) << key << " in " << out.text();
    at = next;
  }
  EXPECT_TRUE(out.says(text("steps=%d ", (int)run.statistics().steps)));
}

TEST(Options, ResetAndRunAgain)
{
  const UserVars p(.2);
  Simulation     run(p, tolerance(1e-5));
  must(run.solve());
  const Array u = run.u();
  SNES        snes;
  Mat         J, P;
  must(TSGetSNES(run.ts, &snes));
  must(SNESGetJacobian(snes, &J, &P, nullptr, nullptr));
  must(PetscObjectReference((PetscObject)J));
  must(TSReset(run.ts)); /* PETSc drops the matrix but not the function that fills it */
  must(SNESSetJacobian(snes, J, J, nullptr, nullptr));
  must(MatDestroy(&J));
  Array u0(p.n), v0(p.n);
  p.initial(u0.data(), v0.data());
  Vec *x[2] = {&run.U, &run.V};
  for (int k = 0; k < 2; k++)
    for (PetscInt i = 0; i < p.n; i++) must(VecSetValue(*x[k], i, k ? v0[i] : u0[i], INSERT_VALUES));
  for (Vec *y : x) {
    must(VecAssemblyBegin(*y));
    must(VecAssemblyEnd(*y));
  }
  must(TS2SetSolution(run.ts, run.U, run.V));
  must(TSSetTime(run.ts, 0.));
  must(TSSetTimeStep(run.ts, 2e-4));
  must(TSSetStepNumber(run.ts, 0));
  must(run.solve());
  EXPECT_LT(relativeDifference(run.u(), u), 1e-5);
}

/* A matrix-free operator, preconditioned by the assembled matrix; without any assembled matrix no consistent start is
   possible */
TEST(Options, MatrixFreeOperators)
{
  const Pendulum p(-90., 0., 2.);
  Simulation     plain(p, tolerance(1e-6)), free(p, tolerance(1e-6) + "-snes_mf_operator -ksp_type gmres -ksp_rtol 1e-10 ");
  must(plain.solve());
  must(free.solve());
  EXPECT_LT(free.errors().q, 1e-3);
  EXPECT_LT(free.errors().q, 3. * plain.errors().q);

  Simulation none(p, tolerance(1e-6) + "-snes_mf ");
  ErrorTrap  trap;
  EXPECT_EQ(none.solve(), PETSC_ERR_SUP);
  EXPECT_TRUE(trap.says("-snes_mf_operator")) << trap.message;
}

/* A SNES of type ksponly, one linear solve per step, counts its iterations correctly */
TEST(Options, OneLinearSolvePerStep)
{
  const Oscillators p({1., 3.}, {0., .1}, true, 2.);
  Simulation        run(p, fixedSteps(.01) + "-snes_type ksponly ");
  must(run.solve());
  const TSHHT3Statistics s = run.statistics();
  EXPECT_EQ(s.steps, 200);
  EXPECT_EQ(s.newton, s.solves);
  EXPECT_GE(s.newton, s.steps);
  EXPECT_LT(run.errors().q, 1e-3);
}

TEST(Options, AlphaOfARadius)
{
  const Pendulum p;
  Simulation     run(p, "");
  PetscReal      before, after;
  must(TSHHT3SetRadius(run.ts, .8));
  must(TSHHT3GetAlpha(run.ts, &before));
  must(TSSetUp(run.ts));
  must(TSHHT3GetAlpha(run.ts, &after));
  EXPECT_DOUBLE_EQ(before, -.8 / 1.8);
  EXPECT_DOUBLE_EQ(after, before);
}

/* Setting the same values after the set-up is allowed, since TSSetFromOptions() between two TSSolve() does this */
TEST(Options, TheSameValuesAfterTheSetUp)
{
  const Pendulum p;
  for (const bool radius : {false, true}) {
    Simulation run(p, std::string("-ts_hhtdae_predictor_degree 2 ") + (radius ? "-ts_hhtdae_radius 0.8" : "-ts_hhtdae_alpha -0.1"));
    must(TSSetUp(run.ts));
    EXPECT_EQ(TSHHT3SetPredictorDegree(run.ts, 2), 0);
    EXPECT_EQ(radius ? TSHHT3SetRadius(run.ts, .8) : TSHHT3SetAlpha(run.ts, -.1), 0);
    ErrorTrap trap;
    EXPECT_NE(TSHHT3SetPredictorDegree(run.ts, 3), 0);
    EXPECT_NE(TSHHT3SetPredictorDegree(run.ts, -1), 0);
    EXPECT_NE(TSHHT3SetRadius(run.ts, .7), 0);
    EXPECT_NE(TSHHT3SetAlpha(run.ts, radius ? -.1 : -.2), 0);
  }
}
