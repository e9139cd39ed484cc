/* The counters of a run, and the reuse of the matrix as the counters show it */
#include "support.h"
#include <chrono>
#include <thread>

using namespace hhtest;

namespace
{

/* Counts the calls of the integrator */
struct Counting : Pendulum {
  mutable int residuals = 0, jacobians = 0;
  explicit Counting(double end, double speed = 0.) : Pendulum(-90., speed, end) {}
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    residuals++;
    Pendulum::residual(t, u, v, a, f);
  }
  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa,
                Entries &J) const override
  {
    jacobians++;
    Pendulum::jacobian(t, u, v, a, sv, sa, J);
  }
};

} // namespace

TEST(Statistics, CountEverythingTheProblemIsAskedFor)
{
  const Counting p(2.);
  Simulation     run(p, tolerance(1e-6));
  must(TSSetUp(run.ts));
  const int residuals = p.residuals, jacobians = p.jacobians; /* calls made for the detection of the roles */
  must(run.solve());
  const TSHHT3Statistics s = run.statistics();
  EXPECT_EQ(s.residuals, p.residuals - residuals);
  EXPECT_EQ(s.jacobians, p.jacobians - jacobians);
  EXPECT_EQ(s.factorizations, s.jacobians);
  PetscInt steps, rejected, iterations;
  must(TSGetStepNumber(run.ts, &steps));
  must(TSGetStepRejections(run.ts, &rejected));
  must(TSGetSNESIterations(run.ts, &iterations));
  EXPECT_EQ(s.steps, steps);
  EXPECT_EQ(s.rejected + s.corrector_fails, rejected);
  EXPECT_EQ(s.newton, iterations);
  EXPECT_GE(s.solves, s.newton);
  EXPECT_EQ(s.restarts, 1);
  EXPECT_EQ(s.tiny_steps, 0);
}

/* The rates at the start use the factorization for the accelerations; from rest they use its matrix as well, and so
   does the residual of the velocity constraints */
TEST(Statistics, FactorizationsOfAStart)
{
  PetscLogEvent      event;
  PetscEventPerfInfo before, after;
  must(PetscLogDefaultBegin());
  must(PetscLogEventGetId("MatLUFactorNum", &event));
  for (double speed : {0., 1.}) {
    const Counting p(2., speed);
    Simulation     run(p, tolerance(1e-6));
    must(TSSetUp(run.ts));
    must(PetscLogEventGetPerfInfo(PETSC_DETERMINE, event, &before));
    must(run.step());
    must(PetscLogEventGetPerfInfo(PETSC_DETERMINE, event, &after));
    const TSHHT3Statistics s = run.statistics();
    EXPECT_EQ(s.factorizations, 2) << speed; /* one of the start, one of the first step */
    EXPECT_EQ(after.count - before.count, 2) << speed;
    EXPECT_EQ(s.jacobians, speed ? 3 : 2) << speed;
  }
}

TEST(Statistics, StepSizes)
{
  const Pendulum p(-90., 0., 2.);
  Simulation     run(p, tolerance(1e-6));
  double         last = 0., smallest = 1e9, largest = 0.;
  run.watch = [&](Simulation &, PetscInt step, double t) {
    if (step) {
      smallest = std::min(smallest, t - last);
      largest  = std::max(largest, t - last);
    }
    last = t;
  };
  must(run.solve());
  EXPECT_NEAR(run.statistics().h_min, smallest, 1e-12);
  EXPECT_NEAR(run.statistics().h_max, largest, 1e-12);
  EXPECT_LT(smallest, largest);
}

TEST(Statistics, Times)
{
  const Chain p(20, 0., .5);
  Simulation  run(p, tolerance(1e-6));
  must(run.solve());
  EXPECT_GT(run.statistics().time, 0.);
  EXPECT_GT(run.statistics().cpu, 0.);
  EXPECT_LT(run.statistics().cpu, 60.);
}

/* Time of steps is counted without the time between two solves */
TEST(Statistics, TimesOfStepsAlone)
{
  const Pendulum p(-90., 0., .1);
  Simulation     run(p, tolerance(1e-6));
  const auto     pause = std::chrono::milliseconds(250);
  must(TSSetUp(run.ts));
  std::this_thread::sleep_for(pause);
  must(run.step());
  const PetscReal first = run.statistics().time;
  EXPECT_GT(first, 0.);
  EXPECT_GE(run.statistics().time, first);
  must(run.solve());
  std::this_thread::sleep_for(pause);
  must(TSSetMaxTime(run.ts, .2));
  must(run.solve());
  EXPECT_GT(run.statistics().time, first);
  EXPECT_LT(run.statistics().time, 1e-3 * (double)pause.count());
}

/* A linear problem at constant h needs one matrix besides those of the start */
TEST(Statistics, OneFactorizationForALinearProblemAtOneStepSize)
{
  const Oscillators p({1., 5., 20.}, {0., .1, .02}, true, 10.);
  Simulation        run(p, fixedSteps(.01));
  must(run.solve());
  const TSHHT3Statistics s = run.statistics();
  MEASURED("linear, fixed h: %d steps, %d iterations, %d factorizations", (int)s.steps, (int)s.newton,
           (int)s.factorizations);
  EXPECT_EQ(s.steps, 1000);
  EXPECT_LE(s.factorizations, 4);
}

TEST(Statistics, FewFactorizationsForALinearProblemWithErrorControl)
{
  const Oscillators p({1.}, {0.}, false, 30.);
  Simulation        run(p, tolerance(1e-6));
  must(run.solve());
  const TSHHT3Statistics s = run.statistics();
  MEASURED("linear, error control: %d steps, %d iterations, %d factorizations", (int)s.steps, (int)s.newton,
           (int)s.factorizations);
  EXPECT_GT(s.steps, 500);
  EXPECT_LT(s.factorizations, s.steps / 10);
}

TEST(Statistics, FewFactorizationsForMechanisms)
{
  for (const Factory &f : allProblems()) {
    const auto p = f.make();
    Simulation run(*p, tolerance(1e-7));
    must(run.solve());
    const TSHHT3Statistics s = run.statistics();
    MEASURED("%-15s %d steps, %d rejected, %d failed corrections, %.2f iterations and %.3f factorizations a step",
             f.name, (int)s.steps, (int)s.rejected, (int)s.corrector_fails, (double)s.newton / s.steps,
             (double)s.factorizations / s.steps);
    EXPECT_LT(s.factorizations, s.steps / 2) << f.name;
    EXPECT_LT(s.newton, 4 * s.steps) << f.name;
    EXPECT_LT(s.rejected, s.steps / 5) << f.name;
    EXPECT_EQ(s.restarts, 1) << f.name;
  }
}

/* -ts_hhtdae_reuse 1,0,1 makes a new matrix in every step; the result is the same */
TEST(Statistics, ReuseCanBeSwitchedOff)
{
  const UserVars p(1.);
  Simulation     fresh(p, fixedSteps(.002) + "-ts_hhtdae_reuse 1,0,1"), reused(p, fixedSteps(.002));
  must(fresh.solve());
  must(reused.solve());
  MEASURED("500 steps: %d factorizations without reuse, %d with it", (int)fresh.statistics().factorizations,
           (int)reused.statistics().factorizations);
  EXPECT_GE(fresh.statistics().factorizations, 500);
  EXPECT_LT(reused.statistics().factorizations, 100);
  EXPECT_LT(relativeDifference(fresh.u(), reused.u()), 1e-5);
}
