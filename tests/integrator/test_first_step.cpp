/* A first step that the user has set is used, however it was set; otherwise the first step is chosen, whether options
   were read or not */
#include "integrator/start/start.h"
#include "support.h"
#include <vector>

using namespace hhtest;

namespace
{

/* A TS as a program makes it, without options unless it asks for them */
class Program
{
public:
  TS ts = nullptr;

  explicit Program(PetscErrorCode (*before)(TS) = nullptr, double end = 3.) : problem_({1.}, {0.}, true, end)
  {
    TS made;
    must(ProblemCreateTS(PETSC_COMM_SELF, problem_, &made, &U_, &V_, false));
    ts = made;
    must(TSSetTimeStep(ts, .1)); /* the value of TSCreate() */
    must(TSSetTolerances(ts, 1e-4, nullptr, 1e-4, nullptr));
    if (before) must(before(ts));
    must(TSSetType(ts, TSHHT3));
  }
  ~Program()
  {
    TSDestroy(&ts);
    VecDestroy(&U_);
    VecDestroy(&V_);
  }
  /* Length of the first step */
  double first()
  {
    PetscReal t;
    must(TSSetMaxSteps(ts, 1));
    must(TSSolve(ts, nullptr));
    must(TSGetTime(ts, &t));
    return t;
  }
  double chosen() const
  {
    Program same(nullptr, problem_.t1);
    return same.first();
  }

private:
  const Oscillators problem_;
  Vec               U_ = nullptr, V_ = nullptr;
};

} // namespace

TEST(FirstStep, IsChosenWithoutAWordOfTheUser)
{
  Program   p, q;
  Options   none("");
  PetscReal h;
  must(TSGetTimeStep(p.ts, &h));
  EXPECT_NEAR(h, .1, 1e-15);
  const double chosen = p.first();
  must(TSSetFromOptions(q.ts));
  MEASURED("first step %g", chosen);
  EXPECT_GT(std::abs(chosen - .1), 1e-3); /* otherwise the tests below would show nothing */
  EXPECT_EQ(q.first(), chosen);
}

/* From rest, the accelerations of a pendulum begin to change with the square of the time, so that their rates at the
   start are rounding errors. The first step must be about as long as those that follow */
TEST(FirstStep, FromRest)
{
  for (double eps : {1e-3, 1e-5, 1e-7, 1e-9}) {
    const Pendulum      p(-90., 0., 1.);
    Simulation          run(p, tolerance(eps));
    std::vector<double> t;
    must(TSSetTimeStep(run.ts, hht3::unset_step));
    PetscInt            rejected = 0;
    run.watch = [&](Simulation &r, PetscInt step, double now) {
      t.push_back(now);
      if (step == 1) must(TSGetStepRejections(r.ts, &rejected));
    };
    must(run.solve());
    MEASURED("%g: first step %.2e, the sixth %.2e", eps, t[1] - t[0], t[6] - t[5]);
    EXPECT_EQ(rejected, 0) << eps;
    EXPECT_GT(t[1] - t[0], 0.3 * (t[6] - t[5])) << eps;
  }
}

/* A first step of fixed length does not depend on the tolerance: the multiplier is of second order at any tolerance */
TEST(FirstStep, OfFixedLengthIsOfSecondOrderAtAnyTolerance)
{
  const Pendulum p(-60., 2., 10.);
  for (double eps : {1e-4, 1e-12}) {
    double error[2];
    for (int k = 0; k < 2; k++) {
      Simulation run(p, text("-ts_adapt_type none -ts_dt %g -ts_max_steps 1 -ts_rtol %g -ts_atol %g", 0.02 / (k + 1), eps, eps));
      must(run.solve());
      error[k] = run.errors().lambda;
    }
    MEASURED("tolerance %g: multiplier off by %.1e and %.1e with half the step", eps, error[0], error[1]);
    EXPECT_GT(error[0], 3. * error[1]) << eps;
  }
}

TEST(FirstStep, SetByTheProgram)
{
  for (double h : {1e-3, 1e-2, .1}) {
    Program p, q, r;
    must(TSSetTimeStep(p.ts, h));
    EXPECT_EQ(p.first(), h);
    must(TSSetUp(q.ts)); /* set only after TSSetUp() */
    must(TSSetTimeStep(q.ts, h));
    EXPECT_EQ(q.first(), h);
    Options none("");
    must(TSSetTimeStep(r.ts, h));
    must(TSSetFromOptions(r.ts));
    EXPECT_EQ(r.first(), h);
  }
  Program before([](TS ts) { return TSSetTimeStep(ts, 1e-3); });
  EXPECT_EQ(before.first(), 1e-3);
}

TEST(FirstStep, SetByOption)
{
  for (double h : {1e-3, .1}) {
    Options in(text("-ts_dt %g", h));
    Program p;
    must(TSSetFromOptions(p.ts));
    EXPECT_EQ(p.first(), h);
  }
}

TEST(FirstStep, OfARunShorterThanTheDefault)
{
  Program p(nullptr, .05), q(nullptr, .05);
  EXPECT_LE(p.first(), .005 + 1e-15);
  must(TSSetTimeStep(q.ts, 2e-3));
  EXPECT_EQ(q.first(), 2e-3);
}

TEST(FirstStep, OfOneLengthIsPETScsDefault)
{
  Program p;
  TSAdapt adapt;
  must(TSGetAdapt(p.ts, &adapt));
  must(TSAdaptSetType(adapt, TSADAPTNONE));
  EXPECT_EQ(p.first(), .1);
}

TEST(FirstStep, AnotherTypeFindsPETScsDefault)
{
  Program   p;
  PetscReal h;
  must(TSSetType(p.ts, TSALPHA2));
  must(TSGetTimeStep(p.ts, &h));
  EXPECT_EQ(h, .1);
  must(TSSetType(p.ts, TSHHT3));
  EXPECT_EQ(p.first(), p.chosen());
}
