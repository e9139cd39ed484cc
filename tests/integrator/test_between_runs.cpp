/* What the user changes between steps and between runs of one TS: tolerances, values, time, parts of a run; and events */
#include "integrator/start/start.h"
#include "integrator/state.h"
#include "support.h"
#include <array>

using namespace hhtest;

namespace
{

PetscErrorCode again(Simulation &run, const Array &u, const Array &v, double end, bool count = true)
{
  PetscFunctionBegin;
  PetscCall(TSSetTime(run.ts, 0.));
  if (count) PetscCall(TSSetStepNumber(run.ts, 0));
  PetscCall(TSSetMaxTime(run.ts, end));
  for (PetscInt i = 0; i < (PetscInt)u.size(); i++) {
    PetscCall(VecSetValue(run.U, i, u[i], INSERT_VALUES));
    PetscCall(VecSetValue(run.V, i, v[i], INSERT_VALUES));
  }
  for (Vec x : {run.U, run.V}) {
    PetscCall(VecAssemblyBegin(x));
    PetscCall(VecAssemblyEnd(x));
  }
  PetscCall(run.solve());
  PetscFunctionReturn(0);
}

const Oscillators &oscillator()
{
  static const Oscillators p({2.}, {0.}, false, 2.);
  return p;
}

/* q'' + k q = load sin(2 pi t); an event handler changes k at t = 1 */
struct Switched : Problem {
  mutable double k = 4.;
  double         load;
  explicit Switched(double amplitude) : load(amplitude)
  {
    name = "switched";
    n    = 1;
    t1   = 2.;
    role = {TSHHT3_COORDINATE};
  }
  void initial(double *u, double *v) const override { u[0] = 1., v[0] = 0.; }
  void residual(double t, const double *u, const double *, const double *a, double *f) const override { f[0] = a[0] + k * u[0] - load * std::sin(2. * M_PI * t); }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override { J.add(0, 0, sa + k); }
};

PetscErrorCode atOne(TS, PetscReal t, Vec, PetscScalar *f, void *)
{
  f[0] = t - 1.;
  return 0;
}

PetscErrorCode stiffen(TS ts, PetscInt, PetscInt *, PetscReal, Vec, PetscBool, void *k)
{
  *static_cast<double *>(k) = 1e6;
  return TSRestartStep(ts);
}

PetscErrorCode leave(TS, PetscInt, PetscInt *, PetscReal, Vec, PetscBool, void *) { return 0; }

void watchFor(TS ts, PetscErrorCode (*then)(TS, PetscInt, PetscInt *, PetscReal, Vec, PetscBool, void *), void *ctx)
{
  PetscInt  direction = 0;
  PetscBool terminate = PETSC_FALSE;
  must(TSSetEventHandler(ts, 1, &direction, &terminate, atOne, then, ctx));
}

} // namespace

TEST(BetweenRuns, OtherTolerances)
{
  for (bool vector : {false, true}) {
    Simulation run(oscillator(), tolerance(1e-3)), sharp(oscillator(), tolerance(1e-8));
    Vec        tol;
    must(VecDuplicate(run.U, &tol));
    must(VecSet(tol, 1e-8));
    must(run.solve());
    must(sharp.solve());
    const PetscInt loose = run.statistics().steps;
    must(TSSetTolerances(run.ts, 1e-8, vector ? tol : nullptr, 1e-8, vector ? tol : nullptr));
    must(TSSetMaxTime(run.ts, 4.));
    must(run.solve());
    EXPECT_GT(run.statistics().steps - loose, 0.8 * (double)sharp.statistics().steps) << vector;
    must(VecDestroy(&tol));
  }
}

TEST(BetweenRuns, ANewRunForgetsHowLargeTheOldOneWas)
{
  Simulation run(oscillator(), tolerance(1e-6)), fresh(oscillator(), tolerance(1e-6));
  must(fresh.solve());
  must(again(run, {1e6}, {0.}, 2.));
  const PetscInt before = run.statistics().steps;
  must(again(run, {1.}, {0.}, 2.));
  EXPECT_NEAR((double)(run.statistics().steps - before), (double)fresh.statistics().steps, 2.);
  EXPECT_NEAR(run.u()[0], std::cos(4.), 1e-3);
}

/* Setting the time back to its initial value starts a new run, although PETSc's step number continues */
TEST(BetweenRuns, ANewRunAtTheSameTime)
{
  Simulation run(oscillator(), tolerance(1e-6)), fresh(oscillator(), tolerance(1e-6));
  must(fresh.solve());
  must(again(run, {1e3}, {0.}, 2.));
  const PetscInt before = run.statistics().steps;
  must(again(run, {1.}, {0.}, 2., false));
  EXPECT_NEAR((double)(run.statistics().steps - before), (double)fresh.statistics().steps, 2.);
}

/* When fixed steps are adjusted so that a part ends exactly at its final time, this adjustment must not be carried
   over into the next part, where it would accumulate */
TEST(BetweenRuns, FixedStepsInParts)
{
  for (double part : {.1, .01, .0005}) { /* the last one is shorter than a step */
    Simulation run(oscillator(), fixedSteps(1e-3));
    for (int k = 1; k <= 16; k++) {
      must(TSSetMaxTime(run.ts, k * part));
      must(run.solve());
    }
    EXPECT_EQ(run.statistics().steps, part < 1e-3 ? 16 : (PetscInt)std::lround(16 * part / 1e-3)) << part;
    if (part > 1e-3) {
      EXPECT_NEAR(run.statistics().h_min, 1e-3, 1e-12) << part;
    }
    must(TSSetTimeStep(run.ts, 5e-4)); /* the user sets another step size */
    must(TSSetMaxTime(run.ts, 16 * part + 0.1));
    const PetscInt before = run.statistics().steps;
    must(run.solve());
    EXPECT_EQ(run.statistics().steps - before, 200) << part;
  }
}

/* A run that is solved in parts continues as it would have without them: no new start, no step size equal to the
   rounding error of the last part's end, and no new search for loads over the whole remaining run */
TEST(BetweenRuns, SolvedInParts)
{
  for (int parts : {7, 50, 300}) {
    const Pendulum p(-90., 0., 1.);
    Simulation     run(p, tolerance(1e-4));
    must(TSSetTimeStep(run.ts, hht3::unset_step));
    for (int k = 1; k <= parts; k++) {
      PetscReal h;
      must(TSSetMaxTime(run.ts, k / (double)parts));
      must(run.solve());
      must(TSGetTimeStep(run.ts, &h));
      EXPECT_GT(h, 1e-6) << parts << " " << k;
    }
    const TSHHT3Statistics s = run.statistics();
    MEASURED("%d parts: %d steps, %d of them tiny, %d residuals", parts, (int)s.steps, (int)s.tiny_steps, (int)s.residuals);
    EXPECT_EQ(s.tiny_steps, 0) << parts;
    EXPECT_LT(s.residuals, 400 + 15 * s.steps) << parts;
  }
}

/* The first part is shorter than one step; the following steps have the fixed length again */
TEST(BetweenRuns, FixedStepsAfterAShortPart)
{
  Simulation run(oscillator(), fixedSteps(1e-2));
  for (double end : {0.005, 1.005}) {
    must(TSSetMaxTime(run.ts, end));
    must(run.solve());
  }
  EXPECT_EQ(run.statistics().steps, 101);
}

/* Times of the span are closer together than a step, or their distance is not a multiple of the step */
TEST(BetweenRuns, FixedStepsInATimeSpan)
{
  const Oscillators p({1.}, {0.}, false, 1.);
  PetscReal         times[] = {0., 0.1, 0.105, 0.3, 0.32, 0.33, 0.5, 1.};
  for (const char *h : {"0.03", "0.15", "0.004"}) {
    Simulation run(p, "-ts_adapt_type none -ts_dt " + std::string(h) + " ");
    PetscInt   n;
    Vec       *x;
    must(TSSetTimeSpan(run.ts, 8, times));
    must(run.solve());
    must(TSGetTimeSpanSolutions(run.ts, &n, &x));
    ASSERT_EQ(n, 8);
    for (PetscInt k = 0; k < n; k++) {
      const PetscScalar *q;
      Array              exact(1), v(1), a(1);
      ASSERT_TRUE(p.reference(times[k], exact.data(), v.data(), a.data()));
      must(VecGetArrayRead(x[k], &q));
      EXPECT_NEAR(q[0], exact[0], 1e-2) << h << " " << times[k];
      must(VecRestoreArrayRead(x[k], &q));
    }
    EXPECT_EQ(run.t(), 1.) << h;
  }
}

/* A TSSolve() at the final time does nothing and must not change the step size: the next part gives the same digits as
   without it */
TEST(BetweenRuns, SolvedAgainAtTheEnd)
{
  for (const std::string &steps : {tolerance(1e-6), tolerance(1e-6) + "-ts_dt 1e-3 ", fixedSteps(1e-2)}) {
    Array    u;
    PetscInt n = 0;
    for (int again : {0, 1, 2}) {
      Simulation run(oscillator(), steps);
      for (int k = again ? 0 : 1; k <= 4; k++) {
        must(TSSetMaxTime(run.ts, 0.25 * k));
        for (int i = 0; i <= again; i++) must(run.solve());
        EXPECT_EQ(run.reason(), TS_CONVERGED_TIME);
      }
      if (!again) {
        u = run.u();
        n = run.statistics().steps;
      }
      EXPECT_EQ(run.t(), 1.);
      EXPECT_EQ(run.u(), u) << steps << again;
      EXPECT_EQ(run.statistics().steps, n) << steps << again;
    }
  }
}

/* Times of the span before the beginning of the run have no solutions; TSSolve() of PETSc shortens the first step
   according to such a time, which must have no effect */
TEST(BetweenRuns, BeginInATimeSpan)
{
  for (const std::string &steps : {tolerance(1e-6), tolerance(1e-6) + "-ts_dt 1e-3", fixedSteps(1e-2)})
    for (double begin : {0., 0.2, 0.5}) {
      Simulation run(oscillator(), steps);
      double     first   = 0.;
      PetscReal  times[] = {0., 0.5, 1.};
      must(TSSetTimeSpan(run.ts, 3, times));
      must(TSSetTime(run.ts, begin));
      run.watch = [&](Simulation &, PetscInt step, double t) { if (step == 1) first = t - begin; };
      must(run.solve());
      EXPECT_EQ(run.t(), 1.);
      EXPECT_NEAR(run.u()[0], std::cos(2. * (1. - begin)), 1e-3) << steps << begin;
      if (steps.find("-ts_dt 1e-3") != std::string::npos) {
        EXPECT_NEAR(first, 1e-3, 1e-12) << begin;
      }
      if (steps == fixedSteps(1e-2)) {
        EXPECT_EQ(run.statistics().steps, std::lround(100 * (1. - begin))) << begin;
      }
      if (PETSC_VERSION_GE(3, 23, 0)) continue; /* from 3.23 on PETSc keeps no solutions for these times */
      PetscInt n;
      Vec     *x;
      must(TSGetTimeSpanSolutions(run.ts, &n, &x));
      ASSERT_EQ(n, 3);
      for (int k = 0; k < 3; k++) {
        const double q = whole(x[k])[0];
        if (times[k] < begin) EXPECT_TRUE(std::isnan(q)) << k;
        else EXPECT_NEAR(q, std::cos(2. * (times[k] - begin)), 1e-3) << k;
      }
    }
}

/* With a load of period 1, setting the time back by 1 in the middle of a run does not change the solution */
TEST(BetweenRuns, TimeSetBack)
{
  const Switched p(1.);
  for (const char *order : {"2", "3", "5"}) {
    double q[2];
    for (bool back : {false, true}) {
      Simulation run(p, fixedSteps(2e-3) + "-ts_hhtdae_order " + order);
      must(TSSetMaxTime(run.ts, 3.));
      for (int k = 0; k < 1000; k++) {
        must(run.step());
        if (back && (k == 300 || k == 600)) must(TSSetTime(run.ts, run.t() - 1.));
      }
      q[back] = run.u()[0];
    }
    EXPECT_NEAR(q[1], q[0], 1e-4) << order;
  }
}

/* PETSc accepts the step from an event to the end of the interrupted step without an error test. The integrator tests
   its error, so that the stiffness that the event's handler has switched on is noticed */
TEST(Events, WhatTheyLeaveIsUnderTheErrorTest)
{
  for (const char *order : {"2", "5"}) {
    const Switched p(0.);
    Simulation     run(p, tolerance(1e-6) + "-ts_hhtdae_order " + order);
    double         largest = 0.;
    watchFor(run.ts, stiffen, &p.k);
    run.watch = [&](Simulation &r, PetscInt, double t) {
      if (t > 1.) widen(largest, std::abs(r.u()[0]));
    };
    must(run.solve());
    EXPECT_EQ(p.k, 1e6);
    EXPECT_NEAR(largest, std::abs(std::cos(2.)), 2e-3) << order;
  }
}

/* If an event function crosses zero against the requested direction, TSEvent of PETSc 3.18 requests steps backwards in
   time. This must be an error, not an endless run */
TEST(Events, ThatGoBackAreRefused)
{
  struct Fall : Problem {
    Fall()
    {
      name = "fall";
      n    = 1;
      t1   = 2.3;
      role = {TSHHT3_COORDINATE};
    }
    void initial(double *u, double *v) const override { u[0] = 1., v[0] = 0.; }
    void residual(double, const double *, const double *, const double *a, double *f) const override { f[0] = a[0] + 9.81; }
    void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override { J.add(0, 0, sa); }
  } fall;
  const auto height = [](TS, PetscReal, Vec U, PetscScalar *f, void *) { return VecGetValues(U, 1, std::array<PetscInt, 1>{0}.data(), f); };
  Simulation run(fall, tolerance(1e-6));
  PetscInt   up        = 1;
  PetscBool  terminate = PETSC_FALSE;
  ErrorTrap  trap;
  must(TSSetEventHandler(run.ts, 1, &up, &terminate, height, leave, nullptr));
  if (run.solve()) {
    EXPECT_NE(trap.message.find("set direction 0"), std::string::npos) << trap.message;
  } else {
    EXPECT_NEAR(run.u()[0], 1. - 9.81 * 2.3 * 2.3 / 2., 1e-6);
  }
}

/* Monitors can sample and interpolate the solution also after an event has shortened a step */
TEST(Events, SamplesInMonitors)
{
  const Switched p(0.);
  Simulation     run(p, tolerance(1e-4));
  Vec            U, A;
  must(VecDuplicate(run.U, &U));
  must(VecDuplicate(run.U, &A));
  watchFor(run.ts, leave, nullptr);
  run.watch = [&](Simulation &r, PetscInt step, double t) {
    if (!step) return;
    must(TSHHT3EvaluateAt(r.ts, t, U, nullptr, A));
    EXPECT_EQ(whole(U), r.u()) << t;
    EXPECT_NEAR(whole(A)[0], -4. * r.u()[0], 1e-2) << t;
    must(TSHHT3Interpolate(r.ts, t, U, nullptr, nullptr));
    EXPECT_EQ(whole(U), r.u()) << t;
  };
  must(run.solve());
  must(VecDestroy(&U));
  must(VecDestroy(&A));
}

namespace
{

/* Largest error of the multiplier of a pendulum released at 90 degrees, relative to its largest value 3 m g/L; the
   exact multiplier is a function of y alone. `every`: TSRestartStep() after so many steps; `stops`: a time span */
double errorOfTension(const std::string &options, int every = 0, const Array &stops = {})
{
  const Pendulum p(-90., 0., 2.);
  Simulation     run(p, options);
  double         error = 0.;
  if (!stops.empty()) {
    Array at{0.};
    at.insert(at.end(), stops.begin(), stops.end());
    at.push_back(2.);
    must(TSSetTimeSpan(run.ts, (PetscInt)at.size(), at.data()));
  }
  run.watch = [&](Simulation &r, PetscInt step, double) {
    const Array u = r.u();
    if (step) widen(error, std::abs(u[2] + 3. * p.m * p.g * u[1] / (p.L * p.L)));
    if (every && step % every == 0) must(TSRestartStep(r.ts));
  };
  must(run.solve());
  return error / (3. * p.m * p.g / p.L);
}

} // namespace

/* The velocities at the end of a step satisfy the constraints only to second order. If a restart used them without
   projection, the multipliers would oscillate with an amplitude of first order */
TEST(BetweenRuns, RestartsKeepTheMultipliers)
{
  for (const char *alpha : {"-0.3", "-0.05"})
    for (const std::string &steps : {fixedSteps(0.01), tolerance(1e-6)}) {
      const std::string o    = steps + "-ts_hhtdae_alpha " + alpha;
      const double      once = errorOfTension(o), often = errorOfTension(o, 40);
      MEASURED("%s: %.1e of the tension, with restarts %.1e", o.c_str(), once, often);
      EXPECT_LT(often, 3. * once) << o;
    }
}

/* A mass follows x = sin 3 t, whose acceleration is zero at the start. Steps of ordinary length must not be treated as
   steps too short for the corrector */
TEST(FirstStep, DrivenFromNoAcceleration)
{
  struct Driven : Problem {
    Driven()
    {
      name = "driven";
      n    = 2;
      t1   = 0.5;
      role = {TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
    }
    void initial(double *u, double *v) const override { u[0] = u[1] = v[1] = 0., v[0] = 3.; }
    void residual(double t, const double *u, const double *, const double *a, double *f) const override
    {
      f[0] = a[0] + u[1];
      f[1] = u[0] - std::sin(3. * t);
    }
    void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
    {
      J.add(0, 0, sa);
      J.add(0, 1, 1.);
      J.add(1, 0, 1.);
    }
  };
  const Driven p;
  for (double eps : {1e-8, 1e-9, 1e-10}) {
    double     error = 0.;
    Simulation run(p, tolerance(eps));
    run.watch = [&](Simulation &r, PetscInt, double t) { widen(error, std::abs(r.u()[1] - 9. * std::sin(3. * t))); };
    must(run.solve());
    MEASURED("%g: multiplier off by %.1e of 9", eps, error);
    EXPECT_LT(error, 2e-3) << eps;
  }
}

/* When -ts_adapt_dt_max keeps steps short, the iteration error that the corrector may leave in q must not appear,
   divided by h^2, in the multipliers */
TEST(BetweenRuns, ShortStepsKeepTheMultipliers)
{
  for (const char *alpha : {"-0.3", "-0.05"}) {
    const double error = errorOfTension(tolerance(1e-4) + "-ts_adapt_dt_max 1e-4 -ts_hhtdae_alpha " + std::string(alpha));
    MEASURED("alpha %s: %.1e of the tension", alpha, error);
    EXPECT_LT(error, 1e-4) << alpha;
  }
}

/* A step far shorter than its neighbours (the first step, a step to an output time or to an event) has rounding errors
   in its accelerations and rates. The growing steps that follow must not magnify them, by factors of h and h^2, into
   errors of the multipliers */
TEST(BetweenRuns, GrowthFromAShortStepKeepsTheMultipliers)
{
  for (const char *order : {"2", "auto"})
    for (const char *growth : {"10", "2"}) {
      const std::string o = tolerance(1e-6) + "-ts_hhtdae_order " + order + " -ts_adapt_clip 0.1," + growth + " ";
      const double      whole = errorOfTension(o);
      for (const char *first : {"1e-5", "1e-6", "1e-8", "1e-11"}) {
        const double error = errorOfTension(o + "-ts_dt " + first);
        EXPECT_LT(error, 3. * whole) << o << first;
      }
      for (double gap : {1e-4, 1e-5, 1e-7, 1e-9}) {
        const double error = errorOfTension(o, 0, {0.6, 0.6 + gap, 1.1, 1.1 + gap});
        EXPECT_LT(error, 3. * whole) << o << gap;
      }
      MEASURED("%s: %.1e of the tension", o.c_str(), whole);
    }
}

namespace
{

/* A pendulum of length 1 on a pivot that moves by 0.5 sin(t) */
struct MovedPendulum : Problem {
  const double g = 9.81;
  explicit MovedPendulum(double end)
  {
    name = "pendulum on a moving pivot";
    n    = 3;
    t1   = end;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
  }
  void initial(double *u, double *v) const override
  {
    u[0] = 1., u[1] = u[2] = 0.;
    v[0] = 0.5, v[1] = -3., v[2] = 0.;
  }
  void residual(double t, const double *u, const double *, const double *a, double *f) const override
  {
    const double x = u[0] - 0.5 * std::sin(t);
    f[0]           = a[0] + u[2] * x;
    f[1]           = a[1] + u[2] * u[1] + g;
    f[2]           = (x * x + u[1] * u[1] - 1.) / 2.;
  }
  void jacobian(double t, const double *u, const double *, const double *, double, double sa, Entries &J) const override
  {
    const double x = u[0] - 0.5 * std::sin(t);
    for (int k = 0; k < 2; k++) {
      J.add(k, k, sa + u[2]);
      J.add(k, 2, k ? u[1] : x);
      J.add(2, k, k ? u[1] : x);
    }
    J.add(2, 2, 0.);
  }
  double tension(double t, const Array &u, const Array &v) const
  {
    const double x = u[0] - 0.5 * std::sin(t), w = v[0] - 0.5 * std::cos(t);
    return w * w + v[1] * v[1] - g * u[1] + 0.5 * std::sin(t) * x;
  }
};

} // namespace

/* Constraints are differentiated in time over the time scale of the motion, not over the length of the run or the time
   that remains at a restart, either of which may be far too short */
TEST(BetweenRuns, ShortRunsHaveTheirMultipliers)
{
  const auto largest = [](double end, int every) {
    const MovedPendulum p(end);
    Simulation          run(p, tolerance(1e-6));
    double              error = 0.;
    run.watch = [&](Simulation &r, PetscInt step, double t) {
      if (step) widen(error, std::abs(r.u()[2] - p.tension(t, r.u(), r.v())));
      if (every && step % every == 0) must(TSRestartStep(r.ts));
    };
    must(run.solve());
    return error;
  };
  for (double end : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7}) {
    const double error = largest(end, 0);
    MEASURED("run of %g: tension off by %.1e of 9", end, error);
    EXPECT_LT(error, end < 1e-4 ? 0.5 : 0.01) << end; /* rounding of positions, divided by h^2 */
  }
  EXPECT_LT(largest(0.5, 3), 0.3); /* the tension is 38 at most */
  for (double end : {1e-4, 1e-5}) { /* from rest, where nothing has moved noticeably by the end of the run */
    const Pendulum p(60., 0., end);
    Simulation     run(p, tolerance(1e-7));
    Array          tension;
    run.watch = [&](Simulation &r, PetscInt step, double) { if (step) tension.push_back(r.u()[2]); };
    must(run.solve());
    for (double x : tension) EXPECT_NEAR(x, tension[0], 0.01 * std::abs(tension[0])) << end;
  }
}

/* The first step after an event is as short as the rest of the run. The drift of the constraints that the last step
   has left must be projected away, and the constraints must not be differentiated over such a short time */
TEST(Events, ShortlyBeforeTheEnd)
{
  for (const char *start : {"report", "off", "project"})
    for (double left : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-9}) {
      const MovedPendulum p(1. + left);
      Simulation          run(p, tolerance(1e-4) + "-ts_hhtdae_start " + start);
      double              before = 0., behind = 0.;
      watchFor(run.ts, leave, nullptr);
      run.watch = [&](Simulation &r, PetscInt step, double t) {
        if (step) widen(t <= 1. + left / 100. ? before : behind, std::abs(r.u()[2] - p.tension(t, r.u(), r.v())));
      };
      must(run.solve());
      MEASURED("%g before the end, start %s: tension off by %.1e, before by %.1e", left, start, behind, before);
      EXPECT_LT(behind, 2. * before) << left << start;
    }
}

/* The last steps before the end of a run have about the same length. If the last step were simply cut to end in time,
   the multipliers at the end would be inaccurate, the more so the higher the order */
TEST(LastSteps, AreOfOneLength)
{
  for (const char *order : {"2", "auto"})
    for (double end : {2., 2.03, 2.07, 2.11}) {
      const MovedPendulum p(end);
      Simulation          run(p, tolerance(1e-5) + "-ts_hhtdae_order " + order);
      double              on_the_way = 0., last = 0., t_last = 0.;
      Array               h;
      run.watch = [&](Simulation &r, PetscInt step, double t) {
        last = std::abs(r.u()[2] - p.tension(t, r.u(), r.v()));
        if (step && t < 0.8 * end) widen(on_the_way, last);
        h.push_back(t - t_last);
        t_last = t;
      };
      must(run.solve());
      MEASURED("order %s to %g: tension off by %.1e at the end, by %.1e before", order, end, last, on_the_way);
      EXPECT_LT(last, 1.1 * on_the_way) << order << end;
      for (size_t k = h.size() - 4; k < h.size(); k++) EXPECT_GT(h[k], 0.85 * h[k - 1]) << order << end;
    }
}

/* With -ts_exact_final_time interpolate a part ends between steps, and the next part continues from the end of the
   last step. The digits are those of one run, also after a checkpoint */
TEST(BetweenRuns, GoOnFromInterpolatedEnds)
{
  const MovedPendulum p(2.);
  const std::string   file = "interpolated_" + std::to_string(getpid()) + ".cp", options = tolerance(1e-6) + "-ts_exact_final_time ";
  Simulation          one(p, options + "stepover"), parts(p, options + "interpolate"), resumed(p, options + "stepover -ts_hhtdae_resume " + file);
  for (double t : {0.1, 2.}) { /* the first step depends on the end of the first part */
    must(TSSetMaxTime(one.ts, t));
    must(one.solve());
  }
  for (int k = 1; k <= 20; k++) {
    const double t = 0.1 * k;
    must(TSSetMaxTime(parts.ts, t));
    must(TSSolve(parts.ts, parts.U));
    const Array u = whole(parts.U);
    EXPECT_NEAR(std::hypot(u[0] - 0.5 * std::sin(t), u[1]), 1., 1e-6) << k;
    if (k == 10) must(TSHHT3CheckpointSave(parts.ts, file.c_str()));
  }
  must(resumed.solve());
  std::remove(file.c_str());
  EXPECT_EQ(parts.statistics().restarts, 1);
  for (Simulation *run : {&parts, &resumed}) {
    PetscReal t, t_one;
    must(TSGetTime(run->ts, &t));
    must(TSGetTime(one.ts, &t_one));
    EXPECT_EQ(t, t_one);
    EXPECT_EQ(run->statistics().steps, one.statistics().steps);
  }
  EXPECT_EQ(resumed.u(), one.u());
}

/* The velocity of a mass with a damper is changed between two runs: it then moves by m v/c within a thousandth of the
   present step size. An uncoupled oscillator is not disturbed */
TEST(BetweenRuns, AKickOfADampedMass)
{
  struct Damped : Problem {
    Damped()
    {
      n    = 2;
      t1   = 0.5;
      role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE};
    }
    void initial(double *u, double *v) const override { u[0] = u[1] = v[0] = 0, v[1] = 1; }
    void residual(double, const double *u, const double *v, const double *a, double *f) const override { f[0] = a[0] + 1000 * v[0], f[1] = a[1] + u[1]; }
    void jacobian(double, const double *, const double *, const double *, double sv, double sa, Entries &J) const override { J.add(0, 0, sa + 1000 * sv), J.add(1, 1, sa + 1); }
  } p;
  Simulation run(p, tolerance(1e-6));
  must(run.solve());
  must(VecSetValue(run.V, 0, 10, INSERT_VALUES));
  must(VecAssemblyBegin(run.V));
  must(VecAssemblyEnd(run.V));
  must(TSRestartStep(run.ts));
  must(TSSetMaxTime(run.ts, 2));
  must(run.solve());
  EXPECT_NEAR(run.u()[0], 0.01, 5e-5);
  EXPECT_NEAR(run.u()[1], std::sin(2), 1e-3);
}

namespace
{

enum class After { Restart, RollBack, Normalize, Forget } after;

/* Post-step function: changes the state of a pendulum (x, y, lambda) in every fifth step, as `after` says, but only
   once if that step is repeated */
PetscErrorCode changeWhatIsLeft(TS ts)
{
  static PetscInt last = -1;
  PetscInt        step;
  PetscReal       h;
  Vec             U;
  PetscScalar    *u;
  PetscFunctionBegin;
  PetscCall(TSGetStepNumber(ts, &step));
  if (step % 5 != 4 || step == last) {
    last = step % 5 == 4 ? -1 : last;
    PetscFunctionReturn(0);
  }
  last = step;
  PetscCall(TSGetSolution(ts, &U));
  PetscCall(TSGetTimeStep(ts, &h));
  if (after == After::Restart) PetscCall(TSRestartStep(ts));
  if (after == After::RollBack) {
    PetscCall(TSRollBack(ts));
    PetscCall(TSSetTimeStep(ts, h / 2));
  }
  if (after == After::Restart || after == After::RollBack) PetscFunctionReturn(0);
  PetscCall(VecGetArray(U, &u));
  if (after == After::Forget) u[2] = 0.;
  else {
    const double r = std::hypot(u[0], u[1]);
    for (int c = 0; c < 2; c++) u[c] /= r;
  }
  PetscCall(VecRestoreArray(U, &u));
  PetscFunctionReturn(0);
}

} // namespace

/* The constraint violation left by the integrator itself must not be reported as an inconsistent start when the user
   restarts, rolls back, normalizes the length or sets multipliers to zero */
TEST(BetweenRuns, WhatAStepHasLeft)
{
  const Pendulum p(-30., 0., 2.);
  double         angle[4];
  for (After x : {After::Restart, After::RollBack, After::Normalize, After::Forget}) {
    after = x;
    Simulation run(p, tolerance(1e-7));
    Printed    out;
    must(TSSetPostStep(run.ts, changeWhatIsLeft));
    must(run.solve());
    EXPECT_EQ(out.text().find("violate"), std::string::npos) << out.text();
    EXPECT_GT(run.statistics().restarts, 10);
    angle[(int)x] = std::atan2(run.u()[1], run.u()[0]);
    EXPECT_NEAR(angle[(int)x], angle[0], 2e-3) << (int)x;
  }
  Simulation run(p, tolerance(1e-7)); /* and when the user sets the step number to 0 */
  Printed    out;
  for (double end : {1., 2.}) {
    must(TSSetMaxTime(run.ts, end));
    must(TSSetStepNumber(run.ts, 0));
    must(run.solve());
  }
  EXPECT_EQ(out.text().find("violate"), std::string::npos) << out.text();
}

/* The short steps with which TSEvent locates a zero in the last step of a part must not be taken for a step size that
   the user has set for the next part */
TEST(Events, InTheLastStepOfAPart)
{
  Simulation run(oscillator(), fixedSteps(1e-2));
  PetscInt   direction = 0;
  PetscBool  terminate = PETSC_FALSE;
  const auto near      = [](TS, PetscReal t, Vec, PetscScalar *f, void *) -> PetscErrorCode {
    f[0] = (t - .9953) * (1. + t * t);
    return 0;
  };
  must(TSSetEventHandler(run.ts, 1, &direction, &terminate, near, leave, nullptr));
  must(TSSetMaxTime(run.ts, 1.));
  must(run.solve());
  const PetscInt before = run.statistics().steps;
  must(TSSetMaxTime(run.ts, 2.));
  must(run.solve());
  EXPECT_EQ(run.statistics().steps - before, 100);
}

/* A mechanism with time scales of a microsecond whose first step is chosen automatically. After the steps that locate
   an event, the step size is that before the event, not PETSc's default of 0.1 */
TEST(Events, StepsBehindThemAreThoseBefore)
{
  const Oscillators p({2e6}, {0.}, false, 4e-6);
  Simulation        run(p, tolerance(1e-6));
  must(TSSetTimeStep(run.ts, hht3::unset_step));
  std::vector<double> steps;
  double              last = 0.;
  PetscInt            direction = 0, found = 0;
  PetscBool           terminate = PETSC_FALSE;
  const auto          zero      = [](TS, PetscReal, Vec U, PetscScalar *f, void *) { return VecGetValues(U, 1, std::array<PetscInt, 1>{0}.data(), f); };
  const auto          count     = [](TS, PetscInt, PetscInt *, PetscReal, Vec, PetscBool, void *n) -> PetscErrorCode { return ++*static_cast<PetscInt *>(n), 0; };
  run.watch = [&](Simulation &, PetscInt step, double t) {
    if (step) steps.push_back(t - last);
    last = t;
  };
  must(TSSetEventHandler(run.ts, 1, &direction, &terminate, zero, count, &found));
  must(TSSetEventTolerances(run.ts, 1e-10, nullptr));
  must(run.solve());
  EXPECT_EQ(found, 3);
  EXPECT_LT(*std::max_element(steps.begin(), steps.end()), 1e-7);
  Simulation plain(p, tolerance(1e-6));
  must(TSSetTimeStep(plain.ts, hht3::unset_step));
  must(plain.solve());
  EXPECT_LE(run.statistics().rejected + run.statistics().corrector_fails, plain.statistics().rejected + plain.statistics().corrector_fails);
}

namespace
{

/* Balls in free flight that rebound at height zero */
struct Balls : Problem {
  std::vector<double> height, restitution;
  Balls(std::vector<double> heights, std::vector<double> e, double end) : height(std::move(heights)), restitution(std::move(e))
  {
    name = "balls";
    n    = (PetscInt)height.size();
    t1   = end;
    role.assign(n, TSHHT3_COORDINATE);
  }
  void initial(double *u, double *v) const override
  {
    for (PetscInt i = 0; i < n; i++) u[i] = height[i], v[i] = 0.;
  }
  void residual(double, const double *, const double *, const double *a, double *f) const override
  {
    for (PetscInt i = 0; i < n; i++) f[i] = a[i] + 10.;
  }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
  {
    for (PetscInt i = 0; i < n; i++) J.add(i, i, sa);
  }
  double exact(PetscInt i, double t, int *bounces = nullptr) const
  {
    double begin = std::sqrt(2. * height[i] / 10.), v = 10. * begin * restitution[i];
    if (t < begin) return height[i] - 5. * t * t;
    for (int k = 1;; k++, begin += 2. * v / 10., v *= restitution[i]) {
      if (bounces) *bounces = k;
      if (t < begin + 2. * v / 10.) return (t - begin) * (v - 5. * (t - begin));
    }
  }
};

struct Thrown {
  const Balls *p;
  int          times = 0;
};

PetscErrorCode heights(TS, PetscReal, Vec U, PetscScalar *f, void *)
{
  const Array u = whole(U);
  std::copy(u.begin(), u.end(), f);
  return 0;
}

PetscErrorCode throwBack(TS ts, PetscInt count, PetscInt *which, PetscReal, Vec, PetscBool, void *ctx)
{
  auto *thrown = static_cast<Thrown *>(ctx);
  Vec   U, V;

  PetscFunctionBegin;
  PetscCall(TS2GetSolution(ts, &U, &V));
  for (PetscInt k = 0; k < count; k++) {
    PetscScalar *v;
    PetscCall(VecGetArray(V, &v));
    v[which[k]] *= -thrown->p->restitution[which[k]];
    PetscCall(VecRestoreArray(V, &v));
    thrown->times++;
  }
  PetscFunctionReturn(0);
}

void throwBalls(Simulation &run, Thrown &thrown)
{
  std::vector<PetscInt>  down(thrown.p->n, -1);
  std::vector<PetscBool> go(thrown.p->n, PETSC_FALSE);
  must(TSSetTimeStep(run.ts, hht3::unset_step));
  must(TSSetEventHandler(run.ts, thrown.p->n, down.data(), go.data(), heights, throwBack, &thrown));
  must(TSSetEventTolerances(run.ts, 1e-9, nullptr));
  must(run.solve());
}

} // namespace

/* In free flight the error test does not limit the step. The first step after a bounce must end before the ball comes
   down again, or the next bounce would be missed */
TEST(Events, ABallIsNotLost)
{
  for (double end : {.8, 1.1, 1.3, 1.5, 1.8, 2., 2.5, 3., 3.5, 4., 5., 7.}) {
    const Balls p({1.}, {.9}, end);
    Thrown      thrown{&p};
    Simulation  run(p, tolerance(1e-4));
    int          bounces;
    const double exact = p.exact(0, end, &bounces);
    throwBalls(run, thrown);
    EXPECT_EQ(thrown.times, bounces) << end;
    EXPECT_NEAR(run.u()[0], exact, 1e-6) << end;
    EXPECT_LE(run.statistics().steps, 20 * (bounces + 1)) << end;
  }
}

/* An event function may call TSHHT3EvaluateAt() at the time it is asked for, also when PETSc calls it before the first
   step after an event */
TEST(Events, FunctionsThatAskForTheState)
{
  const Balls     p({1.}, {.9}, 3.);
  Thrown          thrown{&p};
  Simulation      run(p, tolerance(1e-4));
  const PetscInt  down  = -1;
  const PetscBool go    = PETSC_FALSE;
  const auto      asked = [](TS ts, PetscReal t, Vec U, PetscScalar *f, void *) -> PetscErrorCode {
    PetscInt steps;
    Vec      W[3];
    PetscFunctionBegin;
    PetscCall(TSGetStepNumber(ts, &steps));
    for (Vec &x : W) PetscCall(VecDuplicate(U, &x));
    if (steps) PetscCall(TSHHT3EvaluateAt(ts, t, W[0], W[1], W[2]));
    else PetscCall(VecCopy(U, W[0]));
    f[0] = whole(W[0])[0];
    EXPECT_EQ(f[0], whole(U)[0]);
    for (Vec &x : W) PetscCall(VecDestroy(&x));
    PetscFunctionReturn(0);
  };
  const auto back = [](TS ts, PetscInt n, PetscInt *which, PetscReal t, Vec U, PetscBool forward, void *ctx) -> PetscErrorCode {
    PetscFunctionBegin;
    PetscCall(throwBack(ts, n, which, t, U, forward, ctx));
    PetscCall(TSRestartStep(ts));
    PetscFunctionReturn(0);
  };
  int bounces;
  must(TSSetTimeStep(run.ts, hht3::unset_step));
  must(TSSetEventHandler(run.ts, 1, const_cast<PetscInt *>(&down), const_cast<PetscBool *>(&go), asked, back, &thrown));
  must(TSSetEventTolerances(run.ts, 1e-9, nullptr));
  const double exact = p.exact(0, 3., &bounces);
  must(run.solve());
  EXPECT_EQ(thrown.times, bounces);
  EXPECT_NEAR(run.u()[0], exact, 1e-6);
}

/* The step that remains after one event, up to the end of the run, contains a second event */
TEST(Events, TwoInOneStep)
{
  const Balls         p({1.}, {1.}, 1.);
  Simulation          run(p, tolerance(1e-4));
  std::vector<double> times;
  const PetscInt      up[]   = {1, 1};
  const PetscBool     go[]   = {PETSC_FALSE, PETSC_FALSE};
  const auto          clocks = [](TS, PetscReal t, Vec, PetscScalar *f, void *) -> PetscErrorCode { return f[0] = t - .5, f[1] = t - .8, 0; };
  const auto          note   = [](TS, PetscInt, PetscInt *, PetscReal t, Vec, PetscBool, void *list) -> PetscErrorCode { return static_cast<std::vector<double> *>(list)->push_back(t), 0; };
  must(TSSetTimeStep(run.ts, hht3::unset_step));
  must(TSSetEventHandler(run.ts, 2, (PetscInt *)up, (PetscBool *)go, clocks, note, &times));
  must(run.solve());
  ASSERT_EQ(times.size(), 2u);
  EXPECT_NEAR(times[0], .5, 1e-5);
  EXPECT_NEAR(times[1], .8, 1e-5);
}

/* Bounces that accumulate in time end where they are smaller than the tolerance of the event */
TEST(Events, BouncesThatAccumulate)
{
  const Balls p({1.}, {.5}, 3.);
  Thrown      thrown{&p};
  Simulation  run(p, tolerance(1e-4));
  throwBalls(run, thrown);
  EXPECT_GE(thrown.times, 14);
  EXPECT_LE(thrown.times, 30);
  EXPECT_LE(run.statistics().steps, 600);
}

namespace
{

/* A point that is accelerated by 10 m/s^2 towards x = 0; the event handler reverses the force at each passage and
   leaves the solution vector unchanged */
struct Turning : Problem {
  double         height;
  mutable double a = -10.;
  explicit Turning(double h) : height(h)
  {
    name = "turning";
    n    = 1;
    t1   = 3.;
    role.assign(n, TSHHT3_COORDINATE);
  }
  void   initial(double *u, double *v) const override { u[0] = height, v[0] = 0.; }
  void   residual(double, const double *, const double *, const double *acc, double *f) const override { f[0] = acc[0] - a; }
  void   jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override { J.add(0, 0, sa); }
  double period() const { return 4. * std::sqrt(height / 5.); }
  int    passages() const { return (int)((t1 + period() / 4.) / (period() / 2.)); }
  double exact(double t) const
  {
    const double quarter = period() / 4., rest = std::fmod(t + quarter, 2. * quarter) - quarter; /* since the last turning point on this side */
    const int    half = (int)((t + quarter) / (2. * quarter));
    return (half % 2 ? -1. : 1.) * (height - 5. * rest * rest);
  }
};

struct Passages {
  const Turning *p;
  int            count = 0;
};

PetscErrorCode turn(TS, PetscInt, PetscInt *, PetscReal, Vec, PetscBool, void *ctx)
{
  auto *passages = static_cast<Passages *>(ctx);
  passages->p->a = -passages->p->a;
  passages->count++;
  return 0;
}

} // namespace

/* A handler that changes a force but not the solution: the integrator restarts after every event, and finds no passage
   twice in long steps */
TEST(Events, ForcesThatAreTurned)
{
  const PetscInt  direction = 0;
  const PetscBool go        = PETSC_FALSE;
  for (const char *options : {"", "-ts_hhtdae_order auto", "-ts_adapt_type basic", "-ts_adapt_dt_max 0.1", "-ts_adapt_type none -ts_dt 0.05", "-ts_adapt_type none -ts_dt 0.3"})
    for (double height : {0.5, 1., 1.3, 2.3}) {
      SCOPED_TRACE(text("%s from %g m", options, height));
      const Turning p(height);
      Simulation    run(p, tolerance(1e-8) + options);
      Passages      passages{&p};
      if (!std::strstr(options, "none")) must(TSSetTimeStep(run.ts, hht3::unset_step));
      must(TSSetEventHandler(run.ts, 1, const_cast<PetscInt *>(&direction), const_cast<PetscBool *>(&go), heights, turn, &passages));
      must(TSSetEventTolerances(run.ts, 1e-9, nullptr));
      must(run.solve());
      EXPECT_EQ(passages.count, p.passages());
      EXPECT_NEAR(run.u()[0], p.exact(run.t()), 1e-4);
    }
}

/* TSRollBack() before the first step is an error, whether the TS has been set up or not */
TEST(BetweenRuns, NoStepToTakeBack)
{
  for (const bool setUp : {false, true}) {
    Simulation run(oscillator(), tolerance(1e-6));
    if (setUp) must(TSSetUp(run.ts));
    const Array before = run.u();
    ErrorTrap   trap;
    EXPECT_NE(TSRollBack(run.ts), 0);
    EXPECT_NE(trap.message.find("no step to take back"), std::string::npos) << trap.message;
    EXPECT_EQ(run.u(), before);
  }
}

/* TSSolve() to a time before the present one does nothing. PETSc sets a negative step size there, which must not
   affect the next run */
TEST(BetweenRuns, GoOnFromATimeThatIsPast)
{
  for (const char *options : {"", "-ts_adapt_type none -ts_dt 1e-2 "}) {
    Simulation plain(oscillator(), tolerance(1e-6) + options), run(oscillator(), tolerance(1e-6) + options);
    for (Simulation *s : {&plain, &run}) {
      must(TSSetMaxTime(s->ts, 0.5));
      must(s->solve());
    }
    must(TSSetMaxTime(run.ts, 0.25));
    must(TSSolve(run.ts, nullptr));
    EXPECT_EQ(run.t(), 0.5);
    for (Simulation *s : {&plain, &run}) {
      must(TSSetMaxTime(s->ts, 1.));
      must(s->solve());
    }
    EXPECT_NEAR(run.u()[0], plain.u()[0], 1e-5) << options;
  }
}

/* A relative tolerance without an absolute one is refused for coordinates that begin at zero; the message recommends
   -ts_atol */
TEST(BetweenRuns, RelativeToleranceFromZero)
{
  Simulation run(oscillator(), "-ts_rtol 1e-6 -ts_atol 0");
  must(VecZeroEntries(run.U));
  must(VecSet(run.V, 1.));
  ErrorTrap trap;
  EXPECT_NE(run.solve(), 0);
  EXPECT_NE(trap.message.find("-ts_atol says how small is small"), std::string::npos) << trap.message;
}

/* The user gives another vector of velocities, whose PetscObjectState equals that of the old one; the change must be
   noticed nevertheless */
TEST(BetweenRuns, VelocitiesInAnotherVector)
{
  Simulation       run(oscillator(), fixedSteps(1e-2));
  Vec              other;
  PetscObjectState old, now;
  must(TSSetMaxTime(run.ts, .1));
  must(run.solve());
  must(VecDuplicate(run.V, &other));
  must(VecSet(other, 7.));
  must(PetscObjectStateGet((PetscObject)run.V, &old));
  must(PetscObjectStateGet((PetscObject)other, &now));
  ASSERT_LE(now, old);
  must(PetscObjectStateSet((PetscObject)other, old));
  must(TS2SetSolution(run.ts, run.U, other));
  must(TSSetMaxTime(run.ts, .1 + 1e-2));
  must(run.solve());
  EXPECT_NEAR(whole(other)[0], 7., 0.5);
  must(VecDestroy(&other));
}

namespace
{

/* Reads the options again and solves the second half of the run */
PetscErrorCode secondHalf(Simulation &run, const std::string &options)
{
  Options in(options);
  PetscFunctionBegin;
  PetscCall(TSSetFromOptions(run.ts));
  PetscCall(TSSetMaxTime(run.ts, 1.));
  PetscCall(TSSolve(run.ts, nullptr));
  PetscFunctionReturn(0);
}

} // namespace

/* TSSetFromOptions() between two runs chooses the linear solver again, and options of SNES act as before the first run */
TEST(BetweenRuns, OptionsReadAgain)
{
  const Pendulum    p(-90., 0., 1.);
  const std::string all = tolerance(1e-6);
  Simulation        plain(p, all);
  must(plain.solve());
  for (const std::string more : {"", "-snes_max_it 7", "-snes_type newtontr", "-snes_linesearch_type bt", "-snes_fd", "-snes_lag_jacobian 1", "-pc_type lu -pc_factor_mat_solver_type klu"}) {
    Simulation run(p, all + "-ts_max_time .5");
    must(run.solve());
    const TSHHT3Statistics before = run.statistics();
    must(secondHalf(run, all + more));
    const TSHHT3Statistics  after = run.statistics();
    const hht3::Integrator &I     = hht3::Get(run.ts);
    EXPECT_LT(relativeDifference(run.u(), plain.u()), 1e-3) << more;
    EXPECT_STRNE(I.linear.text, "") << more;
    EXPECT_EQ(I.corrector.max_it, more == "-snes_max_it 7" ? 7 : 10);
    EXPECT_EQ(I.hooks.line_search, (PetscBool)(more != "-snes_type newtontr" && more != "-snes_linesearch_type bt")) << more;
    EXPECT_EQ(I.differences != nullptr, more == "-snes_fd");
    EXPECT_EQ(after.factorizations - before.factorizations > after.steps - before.steps, more == "-snes_lag_jacobian 1") << more;
  }
  Simulation run(p, all + "-ts_max_time .5");
  must(run.solve());
  ErrorTrap trap;
  EXPECT_EQ(secondHalf(run, all + "-snes_type ngs"), PETSC_ERR_SUP);
}

/* Reading the same options again changes nothing; degree -1 keeps the present predictor degree, which depends on the order */
TEST(BetweenRuns, TheSameOptionsReadAgain)
{
  const Pendulum p(-90., 0., 1.);
  for (const char *method : {"-ts_hhtdae_predictor_degree -1 -ts_hhtdae_order 5", "-ts_hhtdae_predictor_degree 2 -ts_hhtdae_order 5", "-ts_hhtdae_predictor_degree -1"}) {
    const std::string all = tolerance(1e-6) + method;
    Simulation        run(p, all + " -ts_max_time .5");
    must(run.solve());
    const PetscInt degree = hht3::Get(run.ts).predictor.degree_max;
    EXPECT_EQ(secondHalf(run, all), 0) << method;
    EXPECT_EQ(hht3::Get(run.ts).predictor.degree_max, degree) << method;
  }
}
