/* Failures: residuals that are NaN or infinite, now and then or permanently; steps that cannot succeed; limits of the
   number of steps and failures */
#include "support.h"

using namespace hhtest;

namespace
{

/* A pendulum whose residual is replaced by `value` in calls for which `bad` is true */
struct Spoiled : Pendulum {
  std::function<bool(int call, double t)> bad;
  double                                  value;
  mutable int                             calls = 0;
  explicit Spoiled(double end, double with, std::function<bool(int, double)> when)
      : Pendulum(-60., 1., end), bad(std::move(when)), value(with)
  {
  }
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    Pendulum::residual(t, u, v, a, f);
    if (bad(calls++, t)) f[1] = value;
  }
};

} // namespace

TEST(Failures, NotANumberNowAndThenCutsTheStep)
{
  for (double value : {(double)NAN, (double)INFINITY}) {
    const Spoiled p(2., value, [](int call, double t) { return t > .1 && call % 97 == 0; });
    Simulation    run(p, tolerance(1e-6));
    must(run.solve());
    const TSHHT3Statistics s = run.statistics();
    MEASURED("residual %g every 97th time: %d steps, %d failed corrections, error q %.1e", value, (int)s.steps,
             (int)s.corrector_fails, run.errors().q);
    EXPECT_EQ(run.t(), 2.);
    EXPECT_GT(s.corrector_fails + s.retries, 3);
    EXPECT_LT(run.errors().q, 2e-3);
  }
}

/* A residual that is NaN or infinite from t = 0.5 on ends the run with an error that names the row; the last accepted
   state stays valid */
TEST(Failures, NotANumberForEverIsAnErrorThatNamesTheRow)
{
  for (double value : {(double)NAN, (double)INFINITY}) {
    const Spoiled p(2., value, [](int, double t) { return t > .5; });
    Simulation    run(p, tolerance(1e-6));
    double        last = 0.;
    Array         u, v;
    run.watch = [&](Simulation &r, PetscInt, double t) {
      last = t;
      u    = r.u();
      v    = r.v();
    };
    ErrorTrap trap;
    EXPECT_EQ(run.solve(), PETSC_ERR_NOT_CONVERGED);
    EXPECT_TRUE(trap.says("not a number")) << trap.message;
    EXPECT_TRUE(trap.says("row 1")) << trap.message;
    EXPECT_TRUE(trap.says("equation of motion")) << trap.message;
    EXPECT_TRUE(trap.says("last accepted state")) << trap.message;
    EXPECT_EQ(run.t(), last);
    EXPECT_LT(relativeDifference(run.u(), u), 1e-5); /* the next attempt has projected the state */
    EXPECT_LT(relativeDifference(run.v(), v), 1e-5);
    EXPECT_NEAR(last, .5, 1e-2);
    /* near t = 1/2 steps become as short as rounding, which must not spoil the accepted state */
    const ProblemErrors e = run.errors();
    MEASURED("residual %g from t = 0.5 on: stops at t = %.17g with errors q %.1e, q' %.1e, lambda %.1e", value, last,
             e.q, e.v, e.lambda);
    EXPECT_LT(e.q, 1e-3);
    EXPECT_LT(e.v, 1e-2);
    EXPECT_LT(e.lambda, 5e-2);
  }
}

TEST(Failures, NotANumberAtTheStart)
{
  const Spoiled p(2., NAN, [](int, double) { return true; });
  Simulation    run(p, tolerance(1e-6));
  ErrorTrap     trap;
  EXPECT_NE(run.solve(), 0);
  EXPECT_TRUE(trap.says("t = 0")) << trap.message;
  EXPECT_TRUE(trap.says("not a number")) << trap.message;
}

/* With -ts_error_if_step_fails 0 the run ends with a TSConvergedReason in place of an error, in the last accepted state */
TEST(Failures, ReasonInPlaceOfAnError)
{
  const Spoiled p(2., NAN, [](int, double t) { return t > .5; });
  Simulation    run(p, tolerance(1e-6) + "-ts_error_if_step_fails 0");
  must(run.solve());
  EXPECT_LT(run.reason(), 0) << TSConvergedReasons[run.reason()];
  EXPECT_LE(run.t(), .5);
  EXPECT_LT(run.errors().q, 1e-3);
  for (double x : run.v()) EXPECT_TRUE(std::isfinite(x));
}

TEST(Failures, TooManyRejections)
{
  const Spoiled p(2., NAN, [](int, double t) { return t > .5; });
  {
    Simulation run(p, tolerance(1e-6) + "-ts_error_if_step_fails 0 -ts_max_reject 3");
    must(run.solve());
    EXPECT_EQ(run.reason(), TS_DIVERGED_STEP_REJECTED);
    EXPECT_LT(run.errors().q, 1e-3);
  }
  Simulation run(p, tolerance(1e-6) + "-ts_max_reject 3");
  ErrorTrap  trap;
  EXPECT_EQ(run.solve(), PETSC_ERR_NOT_CONVERGED);
  EXPECT_TRUE(trap.says("rejected too often")) << trap.message;
}

/* The error message names the cause of the last rejection: a domain error of the application, a tolerance below
   rounding, and others */
TEST(Failures, CauseOfTheLastRejection)
{
  const Pendulum p(-90., 0., 1.);
  Simulation     bounded(p, tolerance(1e-5)), exact(p, tolerance(1e-16));
  must(TSSetFunctionDomainError(bounded.ts, [](TS, PetscReal t, Vec, PetscBool *in) -> PetscErrorCode {
    *in = (PetscBool)(t < .5);
    return 0;
  }));
  {
    ErrorTrap trap;
    EXPECT_EQ(bounded.solve(), PETSC_ERR_NOT_CONVERGED);
    EXPECT_TRUE(trap.says("TSSetFunctionDomainError()")) << trap.message;
  }
  ErrorTrap trap;
  EXPECT_EQ(exact.solve(), PETSC_ERR_NOT_CONVERGED);
  EXPECT_TRUE(trap.says("the error test at")) << trap.message;
}

TEST(Failures, TooManyFailedCorrections)
{
  const Spoiled p(2., NAN, [](int, double t) { return t > .5; });
  Simulation    run(p, tolerance(1e-6) + "-ts_error_if_step_fails 0 -ts_max_snes_failures 2");
  must(run.solve());
  EXPECT_EQ(run.reason(), TS_DIVERGED_NONLINEAR_SOLVE);
  EXPECT_LT(run.errors().q, 1e-3);
}

/* The error test cannot be met because the smallest allowed step is too large */
TEST(Failures, SmallestStepTooLarge)
{
  const Pendulum p(-60., 1., 2.);
  Simulation run(p, tolerance(1e-10) + "-ts_adapt_dt_min 0.05 -ts_dt 0.1 -ts_error_if_step_fails 0 -ts_max_steps 1000");
  must(run.solve());
  Simulation fixed(p, "-ts_adapt_type none -ts_dt 0.05");
  must(fixed.solve());
  const TSHHT3Statistics s = run.statistics();
  MEASURED("smallest step of 0.05 at tolerance 1e-10: %s at t = %g after %d steps, %d rejected, error %.1e, at fixed steps %.1e", TSConvergedReasons[run.reason()], run.t(),
           (int)s.steps, (int)s.rejected, run.errors().q, fixed.errors().q);
  EXPECT_EQ(run.reason(), TS_CONVERGED_TIME);
  EXPECT_EQ(run.t(), 2.);
  EXPECT_EQ(s.steps, 40);
  EXPECT_GT(s.rejected, 0);
  EXPECT_NEAR(run.errors().q, fixed.errors().q, 0.1 * fixed.errors().q);
}

TEST(Failures, StepBudget)
{
  const Pendulum p(-60., 1., 2.);
  Simulation     run(p, tolerance(1e-8) + "-ts_max_steps 20");
  must(run.solve());
  EXPECT_EQ(run.reason(), TS_CONVERGED_ITS);
  EXPECT_EQ(run.statistics().steps, 20);
  EXPECT_LT(run.errors().q, 1e-5);
}

/* A run that failed can be continued after the cause has been removed */
TEST(Failures, GoOnAfterAFailure)
{
  bool          broken = true;
  const Spoiled p(2., NAN, [&](int, double t) { return broken && t > .5; });
  Simulation    run(p, tolerance(1e-6) + "-ts_error_if_step_fails 0");
  must(run.solve());
  EXPECT_LT(run.reason(), 0);
  broken = false;
  must(TSSetTimeStep(run.ts, 1e-3));
  must(run.solve());
  EXPECT_EQ(run.reason(), TS_CONVERGED_TIME);
  EXPECT_EQ(run.t(), 2.);
  EXPECT_LT(run.errors().q, 2e-3);
}

/* An error code of the application's function is returned unchanged */
TEST(Failures, ErrorOfTheApplication)
{
  TS   ts;
  Vec  U, V, F;
  auto function = [](TS, PetscReal t, Vec, Vec, Vec A, Vec R, void *) -> PetscErrorCode {
    PetscFunctionBegin;
    PetscCheck(t < .5, PETSC_COMM_SELF, PETSC_ERR_USER, "no table beyond t = 0.5");
    PetscCall(VecCopy(A, R));
    PetscCall(VecShift(R, 9.81));
    PetscFunctionReturn(0);
  };
  auto jacobian = [](TS, PetscReal, Vec, Vec, Vec, PetscReal, PetscReal sa, Mat J, Mat, void *) -> PetscErrorCode {
    PetscFunctionBegin;
    PetscCall(MatZeroEntries(J));
    PetscCall(MatShift(J, sa));
    PetscFunctionReturn(0);
  };
  Mat J;
  must(VecCreateSeq(PETSC_COMM_SELF, 2, &U));
  must(VecDuplicate(U, &V));
  must(VecDuplicate(U, &F));
  must(MatCreateSeqAIJ(PETSC_COMM_SELF, 2, 2, 1, nullptr, &J));
  for (PetscInt i = 0; i < 2; i++) must(MatSetValue(J, i, i, 1., INSERT_VALUES));
  must(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
  must(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  must(TSCreate(PETSC_COMM_SELF, &ts));
  must(TSSetType(ts, TSHHT3));
  must(TSSetI2Function(ts, F, function, nullptr));
  must(TSSetI2Jacobian(ts, J, J, jacobian, nullptr));
  must(TS2SetSolution(ts, U, V));
  must(TSSetMaxTime(ts, 1.));
  must(TSSetTimeStep(ts, .01));
  must(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_MATCHSTEP));
  {
    ErrorTrap trap;
    EXPECT_EQ(TSSolve(ts, nullptr), PETSC_ERR_USER);
    EXPECT_TRUE(trap.says("no table beyond")) << trap.message;
  }
  must(TSDestroy(&ts));
  must(MatDestroy(&J));
  for (Vec *x : {&U, &V, &F}) must(VecDestroy(x));
}

namespace
{

/* A pendulum whose constraint vanishes after the start, so that no equation determines the multiplier */
struct Detached : Pendulum {
  Detached() : Pendulum(-60., 1., 1.) {}
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    Pendulum::residual(t, u, v, a, f);
    if (t > 0.) f[2] = 0.;
  }
  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa, Entries &J) const override
  {
    Pendulum::jacobian(t, u, v, a, sv, sa, J);
    for (size_t k = 0; k < J.row.size(); k++)
      if (t > 0. && J.row[k] == 2) J.value[k] = 0.;
  }
};

} // namespace

/* A singular matrix is noticed in steps so short that they are made without the corrector (1e-9) as in ordinary ones (1e-2) */
TEST(Failures, SingularMatrixIsAFailedStepOfAnySize)
{
  for (double h : {1e-9, 1e-2}) {
    const Detached p;
    Simulation     run(p, fixedSteps(h) + "-ts_max_steps 3 ");
    SCOPED_TRACE(text("h = %g", h));
    ErrorTrap trap;
    EXPECT_EQ(run.solve(), PETSC_ERR_NOT_CONVERGED);
    EXPECT_TRUE(trap.says("singular")) << trap.message;
    EXPECT_EQ(run.statistics().steps, 0);
    EXPECT_EQ(run.t(), 0.);
  }
}

namespace
{

/* A pendulum one of whose rows is spoiled from t = 1/2 on */
struct SpoiledRow : Pendulum {
  int    row;
  double value;
  SpoiledRow(int i, double with) : Pendulum(-60., 1., 2.), row(i), value(with) {}
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    Pendulum::residual(t, u, v, a, f);
    if (t >= .5) f[row] = value;
  }
};

} // namespace

/* A spoiled row of any kind, also of constraints, which the start differentiates, ends the run soon; it must not
   proceed by ever shorter steps below rounding */
TEST(Failures, NotANumberInAnyRowStopsTheRunSoon)
{
  for (double value : {(double)NAN, (double)INFINITY})
    for (int row = 0; row < 3; row++) {
      SCOPED_TRACE(text("row %d is %g", row, value));
      const SpoiledRow p(row, value);
      Simulation       run(p, tolerance(1e-6) + "-ts_max_steps 5000");
      double           last = 0.;
      run.watch = [&](Simulation &, PetscInt, double t) { last = t; };
      ErrorTrap trap;
      EXPECT_EQ(run.solve(), PETSC_ERR_NOT_CONVERGED);
      EXPECT_TRUE(trap.says("not a number")) << trap.message;
      EXPECT_TRUE(trap.says("t = 0.")) << trap.message;
      const TSHHT3Statistics s = run.statistics();
      MEASURED("row %d is %g from t = 0.5 on: %d steps, %d tiny, %d failed, stops at %.17g", row, value, (int)s.steps, (int)s.tiny_steps,
               (int)s.corrector_fails, last);
      EXPECT_LT(s.steps, 1000);
      EXPECT_LT(last, .5);
      EXPECT_GT(last, .4);
      EXPECT_EQ(run.t(), last);
      const ProblemErrors e = run.errors();
      EXPECT_LT(e.q, 1e-3);
      EXPECT_LT(e.v, 1e-2);
    }
}

namespace
{

/* A pendulum whose Jacobian is singular in every fifth call */
struct SingularNowAndThen : Pendulum {
  mutable int calls = 0;
  SingularNowAndThen() : Pendulum(-60., 1., 2.) {}
  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa, Entries &J) const override
  {
    Pendulum::jacobian(t, u, v, a, sv, sa, J);
    if (t > .1 && ++calls % 5 == 0)
      for (size_t k = 0; k < J.row.size(); k++)
        if (J.row[k] == 2) J.value[k] = 0.;
  }
};

} // namespace

/* Failures that have nothing to do with h must not reduce h permanently */
TEST(Failures, SingularMatrixNowAndThen)
{
  const SingularNowAndThen p;
  Simulation               run(p, tolerance(1e-6) + "-ts_hhtdae_reuse 1,0,1 -ts_max_steps 20000");
  must(run.solve());
  const TSHHT3Statistics s = run.statistics();
  MEASURED("every fifth matrix singular: %d steps, %d failed corrections, h at least %.1e, error q %.1e", (int)s.steps, (int)s.corrector_fails,
           s.h_min, run.errors().q);
  EXPECT_EQ(run.t(), 2.);
  EXPECT_GT(s.corrector_fails, 20);
  EXPECT_LT(s.steps, 3000);
  EXPECT_LT(run.errors().q, 2e-3);
}

namespace
{

/* Two masses on a rod that falls and spins: (x1, y1, x2, y2, lambda), |x2 - x1|^2/2 = 1/2. From t = 1/2 on a force of
   1e70 acts on one mass for 25 evaluations of the residual; evaluations at the initial positions do not trigger it */
struct Dumbbell : Problem {
  static constexpr double mass[2] = {1., 2.}, g = 9.81, spin = 3.;
  mutable int             calls   = 0;
  Dumbbell()
  {
    name = "dumbbell";
    n    = 5;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
  }
  void initial(double *u, double *v) const override
  {
    double a[5];
    reference(0., u, v, a);
  }
  void residual(double t, const double *u, const double *, const double *a, double *f) const override
  {
    const double d[2] = {u[2] - u[0], u[3] - u[1]}, pull = ((t > .5 && u[1] != 0.) || calls) && calls++ < 25 ? 1e70 : 0.;
    for (int k = 0; k < 4; k++) f[k] = mass[k / 2] * (a[k] + (k % 2) * g) + (k < 2 ? -1. : 1.) * d[k % 2] * u[4];
    f[0] -= pull;
    f[4] = (d[0] * d[0] + d[1] * d[1] - 1.) / 2.;
  }
  void jacobian(double, const double *u, const double *, const double *, double, double sa, Entries &J) const override
  {
    for (int k = 0; k < 4; k++) {
      const double sign = k < 2 ? -1. : 1., d = u[2 + k % 2] - u[k % 2];
      J.add(k, k, sa * mass[k / 2] + u[4]);
      J.add(k, (k + 2) % 4, -u[4]);
      J.add(k, 4, sign * d);
      J.add(4, k, sign * d);
    }
  }
  bool reference(double t, double *u, double *v, double *a) const override
  {
    for (int k = 0; k < 2; k++) { /* about the centre of mass, which falls */
      const double r = k ? 1. / 3. : -2. / 3., c = r * std::cos(spin * t), s = r * std::sin(spin * t);
      u[2 * k] = c, u[2 * k + 1] = s - g * t * t / 2.;
      v[2 * k] = -spin * s, v[2 * k + 1] = spin * c - g * t;
      a[2 * k] = -spin * spin * c, a[2 * k + 1] = -spin * spin * s - g;
    }
    u[4] = 2. / 3. * spin * spin;
    v[4] = a[4] = 0.;
    return true;
  }
};

} // namespace

/* After failed corrections the velocities are projected with a matrix of the last accepted state, not one of the
   failed correction with its huge multipliers */
TEST(Failures, MultipliersOfAFailedCorrection)
{
  const Dumbbell p;
  Simulation     run(p, tolerance(1e-6) + "-ts_max_steps 20000");
  must(run.solve());
  const TSHHT3Statistics s = run.statistics();
  MEASURED("force of 1e70 for a moment: %d steps, %d failed corrections, %d restarts, error q %.1e, q' %.1e", (int)s.steps, (int)s.corrector_fails, (int)s.restarts,
           run.errors().q, run.errors().v);
  EXPECT_EQ(run.t(), 1.);
  EXPECT_GE(s.corrector_fails, 2);
  EXPECT_GT(s.restarts, 1);
  EXPECT_LT(run.errors().q, 2e-3);
  EXPECT_LT(run.errors().v, 1e-2);
}
