/* Extreme step sizes: tiny and huge steps, final times just beyond the end of a step, corrections of the size of rounding */
#include "support.h"

using namespace hhtest;

namespace
{

/* Lengths of the accepted steps */
std::vector<double> stepLengths(Simulation &run)
{
  std::vector<double> h;
  double              last = run.t();
  run.watch                = [&](Simulation &, PetscInt step, double t) {
    if (step) h.push_back(t - last);
    last = t;
  };
  must(run.solve());
  return h;
}

double energy(const Pendulum &p, const Array &u, const Array &v)
{
  return p.m / 2. * (v[0] * v[0] + v[1] * v[1]) + p.m * p.g * u[1];
}

} // namespace

/* A start with a given h: for every h the results are finite, and for small h the accelerations contain no noise */
TEST(Steps, TinyAndHuge)
{
  const Pendulum pendulum(-60., 1., 10.);
  const FourBar  fourbar(2, 10.);
  const Andrews  andrews;
  for (const Problem *p : {(const Problem *)&pendulum, (const Problem *)&fourbar, (const Problem *)&andrews}) {
    for (int k = 0; k <= 12; k++) {
      const double h = std::pow(10., -k);
      Simulation   run(*p, fixedSteps(h) + "-ts_exact_final_time stepover -ts_error_if_step_fails 0");
      SCOPED_TRACE(p->name + text(", h = %g", h));
      int n = 0;
      for (; n < 20 && run.t() < p->t1; n++) must(run.step());
      const Array u = run.u(), v = run.v(), a = run.a();
      for (PetscInt i = 0; i < p->n; i++) {
        EXPECT_TRUE(std::isfinite(u[i]) && std::isfinite(v[i]) && std::isfinite(a[i]));
      }
      Array ur(p->n), vr(p->n), ar(p->n);
      if (h > 2e-6 || !p->reference(p->referenceEverywhere() ? run.t() : 0., ur.data(), vr.data(), ar.data())) continue;
      /* after at most 20 steps of 1e-6 the acceleration is that of the reference, or close to the initial one */
      double worst = 0., scale = 1e-3, lambda = 0., lscale = 1e-3;
      for (PetscInt i = 0; i < p->n; i++)
        if (p->role[i] == TSHHT3_COORDINATE) {
          widen(worst, std::abs(a[i] - ar[i]));
          scale = std::max(scale, std::abs(ar[i]));
        } else {
          widen(lambda, std::abs(u[i] - ur[i]));
          lscale = std::max(lscale, std::abs(ur[i]));
        }
      MEASURED("%-9s %d steps of %g: q'' to %.1e, lambda to %.1e relative; %d by Taylor series", p->name.c_str(), n, h,
               worst / scale, lambda / lscale, (int)run.statistics().tiny_steps);
      EXPECT_LT(worst / scale, 5e-2); /* the corrector's result may contain a noise of some percent */
      EXPECT_LT(lambda / lscale, 5e-2);
    }
  }
}

/* Fixed steps so small that the rounding of q, eps/(beta h^2), is visible in the accelerations; the state stays accurate */
TEST(Steps, SmallFixedStepsForALongTime)
{
  for (double h : {1e-4, 1e-5}) {
    const Pendulum p(-60., 1., 2000 * h);
    Simulation     run(p, fixedSteps(h));
    must(run.solve());
    const ProblemErrors e = run.errors();
    MEASURED("pendulum, 2000 steps of %g: errors q %.1e, q' %.1e, lambda %.1e", h, e.q, e.v, e.lambda);
    EXPECT_LT(e.q, 5. * h * h);
    EXPECT_LT(e.v, 50. * h * h);
    EXPECT_LT(e.lambda, 1e-3);
  }
}

/* The final time is a whole number of steps plus or minus a tiny remainder; no tiny step may result */
TEST(Steps, NoSliverAtTheEnd)
{
  for (double sliver : {-1e-10, -1e-13, -1e-15, 0., 1e-15, 1e-13, 1e-10, 1e-7})
    for (int fixed = 0; fixed < 2; fixed++) {
      const Pendulum p(-60., 1., 1. + sliver);
      SCOPED_TRACE(text("t1 = 1 + %g, %s", sliver, fixed ? "fixed steps" : "error control"));
      Simulation                run(p, fixed ? fixedSteps(.01) : tolerance(1e-6) + "-ts_adapt_dt_max 0.01 -ts_dt 0.01");
      const std::vector<double> h = stepLengths(run);
      EXPECT_EQ(run.t(), p.t1);
      const double shortest = *std::min_element(h.begin(), h.end());
      MEASURED("t1 = 1 %+.0e, %-13s shortest step %.2e, lambda to %.1e", sliver,
               fixed ? "fixed steps" : "error control", shortest, run.errors().lambda);
      EXPECT_GT(shortest, 2e-3);
      EXPECT_LT(run.errors().lambda, 1e-2);
    }
}

/* A corrector that does not know the level of rounding can never meet its tolerance there, and smaller steps make it worse */
TEST(Steps, CorrectorStopsAtRounding)
{
  for (const char *c : {"1e-3", "1e-6", "1e-12"})
    for (double h : {2e-3, 1.25e-3, 2e-4}) {
      const UserVars p(500 * h);
      Simulation     run(p, fixedSteps(h) + "-ts_hhtdae_radius 0.5 -ts_hhtdae_corrector_tolerance " + c);
      SCOPED_TRACE(text("c = %s, h = %g", c, h));
      must(run.solve());
      EXPECT_EQ(run.statistics().steps, 500);
      EXPECT_EQ(run.statistics().corrector_fails, 0);
      EXPECT_LT(run.errors().q, 1e-4);
    }
}

TEST(Steps, ToleranceBelowRounding)
{
  const Pendulum pendulum(-60., 1., .01);
  const UserVars uservars(.01);
  for (const Problem *p : {(const Problem *)&pendulum, (const Problem *)&uservars}) {
    Simulation run(*p, "-ts_rtol 1e-18 -ts_atol 1e-18 -ts_max_steps 3000 -ts_error_if_step_fails 0");
    must(run.solve());
    const TSHHT3Statistics s = run.statistics();
    const ProblemErrors    e = run.errors();
    MEASURED("%s, tolerance 1e-18: %s at t = %g after %d steps, %d rejected, %d failed corrections, error %.1e", p->name.c_str(),
             TSConvergedReasons[run.reason()], run.t(), (int)s.steps, (int)s.rejected, (int)s.corrector_fails, e.q);
    EXPECT_NE(run.reason(), TS_CONVERGED_TIME);
    EXPECT_LT(run.t(), p->t1);
    EXPECT_GT(s.steps, 50); /* as far as possible */
    EXPECT_LT(e.q, 1e-12);
  }
}

/* Any first step, however unsuitable, leads to steps that fit the tolerance */
TEST(Steps, AnyFirstStep)
{
  for (double h : {1e-12, 1e-6, .1, 1., 10.}) {
    const Pendulum p(-60., 1., 2.);
    Simulation     run(p, tolerance(1e-6) + text("-ts_dt %g -ts_max_steps 3000", h));
    must(run.solve());
    EXPECT_EQ(run.t(), 2.);
    const TSHHT3Statistics s = run.statistics();
    MEASURED("pendulum, -ts_dt %-6g %d steps, %d rejected, error q %.1e", h, (int)s.steps, (int)s.rejected,
             run.errors().q);
    EXPECT_LT(run.errors().q, 2e-3);
    EXPECT_LT(s.steps, 2000);
  }
}

/* A pendulum that swings through its inverted position and back; there the motion is slowest and the steps are longest */
TEST(Steps, PendulumThroughItsInvertedPosition)
{
  for (double angle : {179.9, 180. - 1e-3}) {
    double before = 0.;
    for (double eps : {1e-5, 1e-7, 1e-9}) {
      const Pendulum p(angle, 0., 20.);
      Simulation     run(p, tolerance(eps));
      double         drift = 0., length = 0., E0 = energy(p, run.u(), run.v());
      run.watch = [&](Simulation &r, PetscInt, double) {
        widen(drift, std::abs(energy(p, r.u(), r.v()) - E0));
        widen(length, std::abs(std::hypot(r.u()[0], r.u()[1]) - 1.));
      };
      must(run.solve());
      MEASURED("pendulum from %g degrees, tolerance %g: energy to %.1e, length to %.1e, %d steps", angle, eps, drift,
               length, (int)run.statistics().steps);
      EXPECT_LT(length, 10. * eps);
      EXPECT_LT(drift, before > 0. ? before / 3. : 1.);
      before = drift;
    }
  }
}
