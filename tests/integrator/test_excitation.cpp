/* Starts from rest of runs that are long compared with the time scale of loads and motions, for example 100 Hz in 100
   s; many parts of such a run contain a whole number of periods */
#include "integrator/start/start.h"
#include "support.h"

using namespace hhtest;

namespace
{

/* A mass of 2 kg on a rail with prescribed position q = s(t), beside a free mass of 1 kg with the load s(t); both
   begin at rest */
struct Shaken : Problem {
  const double w, phase;
  Shaken(double frequency, double end, bool cosine) : w(2. * M_PI * frequency), phase(cosine ? M_PI / 2. : 0.)
  {
    name = "shaken";
    n    = 3;
    t1   = end;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
  }
  double motion(double t) const { return 1e-3 * (1. - std::cos(w * t)); }
  double load(double t) const { return std::sin(w * t + phase); }
  void   initial(double *u, double *v) const override { std::fill_n(u, 3, 0.), std::fill_n(v, 3, 0.); }
  void   residual(double t, const double *u, const double *, const double *a, double *f) const override
  {
    f[0] = 2. * a[0] + u[2];
    f[1] = a[1] - load(t);
    f[2] = u[0] - motion(t);
  }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
  {
    J.add(0, 0, 2. * sa);
    J.add(0, 2, 1.);
    J.add(1, 1, sa);
    J.add(2, 0, 1.);
  }
};

Array accelerations(Simulation &run)
{
  Vec A;
  must(VecDuplicate(run.U, &A));
  must(TSHHT3Interpolate(run.ts, run.problem.t0, nullptr, nullptr, A));
  const Array a = whole(A);
  must(VecDestroy(&A));
  return a;
}

} // namespace

/* Differences over fractions of the run that are whole numbers of periods would see no motion: the initial
   acceleration would be zero, and the initial velocities would wrongly be reported as inconsistent */
TEST(Excitation, FastForTheRun)
{
  for (double end : {1., 100., 1000.})
    for (double frequency : {100., 1000.})
      for (const char *start : {"", "-ts_hhtdae_start project"}) {
        const Shaken p(frequency, end, true);
        Printed      out;
        Simulation   run(p, tolerance(1e-5) + start);
        must(run.step());
        const Array a = accelerations(run);
        EXPECT_NEAR(a[0] / (1e-3 * p.w * p.w), 1., 1e-4) << frequency << " Hz in " << end << " s " << start;
        EXPECT_NEAR(a[1], 1., 1e-8);
        EXPECT_EQ(out.text(), "");
      }
}

/* Without any other information the first step was a fraction of the run, far longer than the period of the load */
TEST(Excitation, TheFirstStepFollowsTheLoad)
{
  for (double end : {10., 1000.})
    for (double frequency : {1., 100., 1000.})
      for (bool cosine : {false, true}) {
        const Shaken p(frequency, end, cosine);
        Simulation   run(p, tolerance(1e-3));
        must(TSSetTimeStep(run.ts, hht3::unset_step));
        must(run.step());
        EXPECT_LT(run.t(), .25 / frequency) << frequency << " Hz in " << end << " s";
      }
}

/* Sampling times are chosen such that no frequency has whole periods at all of them */
TEST(Excitation, ManyFrequencies)
{
  for (double end : {1., 100., 1e4})
    for (int k = 0; k < 200; k++) {
      const Shaken p(80. + .37 * k, end, true);
      Simulation   run(p, tolerance(1e-5));
      must(run.step());
      const Array a = accelerations(run);
      EXPECT_NEAR(a[0] / (1e-3 * p.w * p.w), 1., 1e-4) << p.w / (2. * M_PI) << " Hz in " << end << " s";
    }
}

namespace
{

/* The same masses under a single pulse at the start, one period long */
struct Pushed : Shaken {
  Pushed(double duration, double end) : Shaken(1. / duration, end, true) {}
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override { Shaken::residual(std::min(t, 2. * M_PI / w), u, v, a, f); }
};

} // namespace

TEST(Excitation, APulseAtTheStart)
{
  for (double part : {.5, .1, 1e-2, 1e-3, 1e-4}) {
    const Pushed p(part * 20., 20.);
    Simulation   run(p, tolerance(1e-5));
    must(run.step());
    const Array a = accelerations(run);
    EXPECT_NEAR(a[0] / (1e-3 * p.w * p.w), 1., 1e-4) << part << " of the run";
  }
}

/* If steps are longer than the period of a load whose displacements are below the tolerance, the velocities are wrong
   without any error estimate noticing; the integrator warns once */
TEST(Excitation, UnfollowedIsTold)
{
  const std::string told = "does not follow loads";
  for (double frequency : {.5, 100.}) {
    const Shaken p(frequency, 100., false);
    Printed      out;
    Simulation   run(p, tolerance(1e-2) + "-ts_adapt_dt_max 5");
    must(run.solve());
    EXPECT_TRUE(out.says(told)) << frequency << " Hz";
    EXPECT_EQ(out.text().find(told), out.text().rfind(told)) << "once";
  }
  for (const char *options : {"-ts_rtol 1e-5 -ts_atol 1e-5 -ts_max_steps 1000", "-ts_adapt_type none -ts_dt 1e-3 -ts_max_steps 1000"}) {
    const Shaken p(100., 100., false);
    Printed      out;
    Simulation   run(p, options);
    must(run.solve());
    EXPECT_EQ(out.text(), "") << options;
  }
  for (double part : {.5, .1, 1e-2, 1e-3, 1e-4}) { /* the pulse ends before most steps begin */
    const Pushed p(part * 20., 20.);
    Printed      out;
    Simulation   run(p, tolerance(1e-2));
    must(run.solve());
    EXPECT_EQ(out.text(), "") << part;
  }
}

/* For a system at rest that depends on the state only, the search for excitation costs few residuals, and constraints
   are not differenced */
TEST(Excitation, NoneAtRest)
{
  const Pendulum p(0., 0., 10.);
  Simulation     run(p, tolerance(1e-4) + "-ts_max_steps 1");
  must(run.step());
  MEASURED("pendulum from rest: %d residuals, %d factorizations in the first step", (int)run.statistics().residuals, (int)run.statistics().factorizations);
  EXPECT_LT(run.statistics().residuals, 107); /* 89 of them look for loads ahead, since the first step hardly moves anything */
}

namespace
{

/* A free mass of 1 kg under a load that is a function of time, from rest */
struct PushedLater : Problem {
  double (*const load)(double);
  PushedLater(double (*f)(double), double end) : load(f)
  {
    name = "pushed later";
    n    = 1;
    t1   = end;
    role = {TSHHT3_COORDINATE};
  }
  void initial(double *u, double *v) const override { u[0] = v[0] = 0.; }
  void residual(double t, const double *, const double *, const double *a, double *f) const override { f[0] = a[0] - load(t); }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override { J.add(0, 0, sa); }
};

double speedAtTheEnd(double (*load)(double), double end)
{
  const PushedLater p(load, end);
  Simulation   run(p, tolerance(1e-6));
  must(run.solve());
  return run.v()[0];
}

} // namespace

/* The system is at rest until a load of 1 sets in, of which neither the start nor the end of the run shows anything */
TEST(Excitation, WhatSetsInLater)
{
  EXPECT_NEAR(speedAtTheEnd([](double t) { return t > 3. && t < 7. ? 1. : 0.; }, 10.), 4., 1e-2);
  EXPECT_NEAR(speedAtTheEnd([](double t) { return t > 30. && t < 70. ? 1. : 0.; }, 1000.), 40., 1e-1);
  /* A step ends within each half period, wherever it is (with growth by 3 in place of 2 the error of the distance was
     a factor of 5 and more) */
  for (double end : {10., 10.25, 20.25}) {
    const PushedLater square([](double t) { return std::sin(2. * M_PI * t) >= 0. ? 1. : -1.; }, end);
    Simulation        run(square, tolerance(1e-6));
    must(run.solve());
    EXPECT_NEAR(run.u()[0] / (end * .25), 1., .05) << end;
  }
}

/* A block that creeps along a guide until a load sets in at t = 0.5, beside an oscillator of tiny amplitude. In steps
   of any length the accelerations are below the rounding of the constraint, so that steps are made by Taylor's series;
   these must notice the load */
TEST(Excitation, WhereAccelerationsAreNextToNothing)
{
  struct Block : Problem {
    Block()
    {
      name = "block";
      n    = 4;
      t1   = 1;
      role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC, TSHHT3_COORDINATE};
    }
    void initial(double *u, double *v) const override
    {
      std::fill_n(u, n, 0.);
      std::fill_n(v, n, 0.);
      v[1] = 1e-8;
      u[3] = swing;
    }
    void residual(double t, const double *u, const double *, const double *a, double *f) const override
    {
      f[0] = a[0] + u[2];
      f[1] = a[1] - (t > 0.5 ? 10 : 0);
      f[2] = u[0];
      f[3] = a[3] + u[3];
    }
    void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
    {
      for (int k : {0, 1, 3}) J.add(k, k, sa + (k == 3));
      J.add(0, 2, 1);
      J.add(2, 0, 1);
      J.add(2, 2, 0);
    }
    double swing = 1e-13;
  } block;
  for (double swing : {1e-12, 1e-13, 1e-14}) {
    block.swing = swing;
    Simulation run(block, tolerance(1e-6));
    must(run.solve());
    MEASURED("swing of %g: y off by %.1e in %d steps", swing, std::abs(run.u()[1] - 1.25), (int)run.statistics().steps);
    EXPECT_NEAR(run.u()[1], 1.25, 5e-3) << swing;
  }
}

/* A load that sets in later is also found by a TS that has made longer steps in an earlier run */
TEST(Excitation, WhatSetsInLaterInANewRun)
{
  static bool       pushed;
  const PushedLater p([](double t) { return pushed && t > .003 && t < .008 ? 200. : 0.; }, 100.);
  Simulation        run(p, tolerance(1e-6));
  for (pushed = false;; pushed = true) {
    must(VecZeroEntries(run.U));
    must(VecZeroEntries(run.V));
    must(TSSetTime(run.ts, 0.));
    must(TSSetStepNumber(run.ts, 0));
    must(TSSetTimeStep(run.ts, 1e-4));
    must(TSSetMaxTime(run.ts, pushed ? 1. : 100.));
    must(TS2SetSolution(run.ts, run.U, run.V));
    must(run.solve());
    if (pushed) break;
  }
  EXPECT_NEAR(run.v()[0], 1., 1e-2);
}

/* A pulse of a fortieth of the run is not stepped over, whenever it comes and however long nothing has moved before;
   nor is a smooth pulse, of which the samples of the start have seen only a trace */
TEST(Excitation, InTheMiddleOfTheRun)
{
  static double begin;
  for (begin = 0.; begin <= 9.; begin += .25)
    for (double length : {1., .25}) {
      static double end;
      end = begin + length;
      EXPECT_NEAR(speedAtTheEnd([](double t) { return t > begin && t < end ? 1. / (end - begin) : 0.; }, 10.), 1., 2e-2) << begin << " " << length;
    }
  for (begin = 2.; begin <= 8.; begin += .25)
    EXPECT_NEAR(speedAtTheEnd([](double t) { return std::exp(-8. * (t - begin) * (t - begin)) * std::sqrt(8. / M_PI); }, 10.), 1., 2e-2) << begin;
}

/* In a run without a final time no loads are evaluated near the end of the run */
TEST(Excitation, RunsWithoutEnd)
{
  static double latest;
  latest = 0.;
  const PushedLater p([](double t) { return latest = std::max(latest, t), 0.; }, PETSC_MAX_REAL);
  Simulation        run(p, tolerance(1e-6) + "-ts_dt 1e-3 -ts_max_steps 5");
  must(run.solve());
  EXPECT_LT(latest, 1e9);
  EXPECT_GT(run.t(), 1e-3);
}

/* When a run is continued beyond its old final time, or resumed from a checkpoint, the search for loads covers the new
   interval */
TEST(Excitation, InARunThatGoesOn)
{
  const PushedLater p([](double t) { return t > 5. && t < 7. ? .5 : 0.; }, 2.);
  const std::string file = ::testing::TempDir() + "goes_on.checkpoint";
  for (bool resumed : {false, true}) {
    Simulation first(p, tolerance(1e-6));
    must(first.solve());
    if (resumed) must(TSHHT3CheckpointSave(first.ts, file.c_str()));
    Simulation  second(p, tolerance(1e-6));
    Simulation &run = resumed ? second : first;
    if (resumed) must(TSHHT3CheckpointLoad(run.ts, file.c_str()));
    must(TSSetMaxTime(run.ts, 10.));
    must(run.solve());
    EXPECT_NEAR(run.v()[0], 1., 1e-2) << resumed;
  }
}

namespace
{

/* A thrust of 5 + 30 sin(50 t), and moments of this thrust about points on its line of action, which are zero except
   for rounding */
struct Cancelled : Problem {
  Cancelled()
  {
    name = "cancelled";
    n    = 13;
    t1   = .1;
    role.assign(n, TSHHT3_COORDINATE);
  }
  void initial(double *u, double *v) const override { std::fill_n(u, n, 0.), std::fill_n(v, n, 0.); }
  void residual(double t, const double *, const double *, const double *a, double *f) const override
  {
    const double F = 5. + 30. * std::sin(50. * t);
    f[0]           = 100. * a[0] - F;
    for (PetscInt k = 1; k < n; k++) {
      const double r = 1.1 * k, c = std::cos(.3 * k), s = std::sin(.3 * k);
      f[k] = a[k] - ((r * c) * (F * s) - (r * s) * (F * c));
    }
  }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
  {
    for (PetscInt k = 0; k < n; k++) J.add(k, k, k ? sa : 100. * sa);
  }
};

} // namespace

/* The time scale of loads that cancel is that of the loads, not that of the rounding errors of their sum */
TEST(Excitation, OfLoadsThatCancel)
{
  const Cancelled p;
  Printed         out;
  Simulation      run(p, tolerance(1e-9));
  must(run.step());
  EXPECT_NEAR(accelerations(run)[0], .05, 1e-6);
  must(run.solve());
  EXPECT_FALSE(out.says("does not follow loads")) << out.text();
  EXPECT_LT(run.statistics().steps, 300);
  EXPECT_NEAR(run.v()[0], (5. * .1 + .6 * (1. - std::cos(5.))) / 100., 1e-5);
}
