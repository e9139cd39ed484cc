/* Orders three to five: observed orders, dense output, restarts, roll-back, checkpoints, changes of coordinates, and
   the choice of the order where an oscillation is not resolved */
#include "support.h"
#include "tumbling.h"

#include <array>
#include <unistd.h>

using namespace hhtest;

namespace
{

std::string ofOrder(int k) { return text(" -ts_hhtdae_order %d ", k); }

/* Increases the step up to h from steps a hundred times shorter, so that errors of the first steps, of order two, are
   negligible */
void growTo(Simulation &run, double h)
{
  for (double s = .01 * h; s < h; s *= 1.2) {
    must(TSSetTimeStep(run.ts, s));
    must(run.step());
  }
  must(TSSetTimeStep(run.ts, h));
}

std::string strict() { return fixedSteps(.01) + " -ts_max_time 1e3 "; }

/* Largest errors in the second half of the run, with steps h, ratio h, h, ratio h, ... */
ProblemErrors errorsAt(const Problem &p, double h, double ratio, const std::string &options)
{
  Simulation    run(p, strict() + options);
  ProblemErrors worst;
  bool          longer = false;
  growTo(run, h);
  while (run.t() < p.t1 - ratio * h) {
    must(TSSetTimeStep(run.ts, longer ? ratio * h : h));
    longer = !longer;
    must(run.step());
    if (run.t() < .5 * p.t1) continue;
    const ProblemErrors e = run.errors();
    widen(worst.q, e.q);
    widen(worst.v, e.v);
    widen(worst.lambda, e.lambda);
    widen(worst.other, e.other);
  }
  return worst;
}

struct Orders {
  double q, v, lambda, other;
};

Orders measure(const Problem &p, int k, double h, double ratio)
{
  const ProblemErrors coarse = errorsAt(p, h, ratio, ofOrder(k)), fine = errorsAt(p, h / 2, ratio, ofOrder(k));
  const Orders o = {order(coarse.q, fine.q), order(coarse.v, fine.v), order(coarse.lambda, fine.lambda), order(coarse.other, fine.other)};
  MEASURED("%-15s order %d, ratio %.1f: q %.2f, q' %.2f, lambda %.2f, others %.2f; errors q %.1e, q' %.1e, lambda %.1e", p.name.c_str(), k, ratio, o.q, o.v,
           o.lambda, o.other, fine.q, fine.v, fine.lambda);
  return o;
}

enum class Multipliers { None, Judged };

/* h is the step for order 3; higher orders use longer steps, because their errors would soon be rounding errors */
void expectOrders(const Problem &p, double h, Multipliers lambda, bool others = false)
{
  for (double ratio : {1., 1.2})
    for (int k : {3, 4, 5}) {
      SCOPED_TRACE(p.name + text(" order %d, ratio %g", k, ratio));
      const Orders o = measure(p, k, h * (k - 2), ratio);
      EXPECT_GE(o.q, k - .25);
      EXPECT_GE(o.v, k - .25);
      EXPECT_LT(o.q, k + 1.2);
      /* with alternating steps the error of a change of h is in all multipliers */
      if (lambda == Multipliers::Judged) {
        EXPECT_GE(o.lambda, ratio > 1 ? k - 1.3 : k - .3);
      }
      if (others) {
        EXPECT_GE(o.other, k - 1.3);
      }
    }
}

struct StateVectors {
  Vec U, V, A;
  explicit StateVectors(Vec like)
  {
    for (Vec *x : {&U, &V, &A}) must(VecDuplicate(like, x));
  }
  ~StateVectors()
  {
    for (Vec *x : {&U, &V, &A}) VecDestroy(x);
  }
};

/* Largest errors of dense output between steps: of q, of q' of coordinates, of q'', of multipliers */
std::array<double, 4> betweenSteps(const Problem &p, int k, double h)
{
  Simulation            run(p, strict() + ofOrder(k));
  StateVectors               x(run.U);
  std::array<double, 4> worst = {};
  growTo(run, h);
  while (run.t() < p.t1 - h) {
    must(run.step());
    if (run.t() < .5 * p.t1) continue;
    for (double theta : {.3, .5, .8}) {
      const double t = run.t() - theta * h;
      Array        u(p.n), v(p.n), a(p.n);
      must(TSHHT3Interpolate(run.ts, t, x.U, x.V, x.A));
      p.reference(t, u.data(), v.data(), a.data());
      const Array U = whole(x.U), V = whole(x.V), A = whole(x.A);
      for (PetscInt i = 0; i < p.n; i++)
        if (p.role[i] == TSHHT3_COORDINATE) {
          widen(worst[0], std::abs(U[i] - u[i]));
          widen(worst[1], std::abs(V[i] - v[i]));
          widen(worst[2], std::abs(A[i] - a[i]));
        } else
          widen(worst[3], std::abs(U[i] - u[i]));
    }
  }
  return worst;
}

struct Step {
  double t;
  Array  u, v, a;
  bool   operator==(const Step &o) const { return t == o.t && u == o.u && v == o.v && a == o.a; }
};

Step now(const Simulation &run) { return {run.t(), run.u(), run.v(), run.statistics().steps ? run.a() : Array()}; }

PetscInt above(const TSHHT3Statistics &s) { return s.of_order[3] + s.of_order[4] + s.of_order[5]; }

} // namespace

TEST(HigherOrder, ConstantMassWithConstraints) { expectOrders(Pendulum(-90., 0., 1.), .004, Multipliers::Judged); }

TEST(HigherOrder, VariableMass) { expectOrders(DoublePendulum(1.), .002, Multipliers::None); }

TEST(HigherOrder, VariableMassWithConstraints) { expectOrders(HeavyTop(.2), .00015, Multipliers::Judged); }

TEST(HigherOrder, StatesAndDefinitions) { expectOrders(UserVars(1.), .004, Multipliers::Judged, true); }

TEST(HigherOrder, NonholonomicConstraints) { expectOrders(Sleigh(1.5), .004, Multipliers::Judged); }

TEST(HigherOrder, DenseOutput)
{
  const Pendulum p(-90., 0., 1.2);
  for (int k : {3, 4, 5}) {
    const double                h = .006 * (k - 2);
    const std::array<double, 4> coarse = betweenSteps(p, k, h), fine = betweenSteps(p, k, h / 2);
    MEASURED("order %d between steps: q %.2f, q' %.2f, q'' %.2f, lambda %.2f", k, order(coarse[0], fine[0]), order(coarse[1], fine[1]), order(coarse[2], fine[2]), order(coarse[3], fine[3]));
    for (int i = 0; i < 4; i++) EXPECT_GE(order(coarse[i], fine[i]), k - .4) << k << " " << i;
  }
}

/* At both ends of every step, including those where the order changes, dense output has the values of the steps */
TEST(HigherOrder, DenseOutputMeetsTheStep)
{
  const UserVars p(1.);
  Simulation     run(p, tolerance(1e-6) + " -ts_hhtdae_order auto ");
  StateVectors        x(run.U);
  Array          u = run.u(), v = run.v(), a;
  double         t = 0.;
  while (run.t() < p.t1) {
    must(run.step());
    if (t > 0.) {
      must(TSHHT3Interpolate(run.ts, t, x.U, x.V, x.A));
      EXPECT_LT(relativeDifference(whole(x.U), u), 1e-14);
      EXPECT_LT(relativeDifference(whole(x.V), v), 1e-14);
      EXPECT_LT(relativeDifference(whole(x.A), a), 1e-12);
    }
    t = run.t();
    u = run.u();
    v = run.v();
    a = run.a();
    must(TSHHT3Interpolate(run.ts, t, x.U, x.V, x.A));
    EXPECT_TRUE(whole(x.U) == u);
    EXPECT_TRUE(whole(x.V) == v);
    EXPECT_TRUE(whole(x.A) == a);
  }
  EXPECT_GT(above(run.statistics()), 20);
}

/* Fewer steps for the same error than with order two, the more so the smaller the error */
TEST(HigherOrder, FewerSteps)
{
  const Pendulum p(-90., 0., 4.);
  for (double eps : {1e-5, 1e-7}) {
    double   error[2];
    PetscInt steps[2];
    for (int k = 0; k < 2; k++) {
      Simulation run(p, tolerance(eps) + (k ? " -ts_hhtdae_order auto " : ""));
      must(run.solve());
      error[k] = run.errors().q;
      steps[k] = run.statistics().steps;
    }
    MEASURED("eps %.0e: order 2 %d steps, error %.1e; auto %d steps, error %.1e", eps, (int)steps[0], error[0], (int)steps[1], error[1]);
    EXPECT_LT(steps[1], steps[0] / (eps < 1e-6 ? 4 : 2));
    EXPECT_LT(error[1], 1.5 * error[0]);
  }
}

/* hω = 2 for an undamped mode with almost no motion: with order 5 at constant steps its oscillation grows without
   limit; the automatic order avoids this */
TEST(HigherOrder, UndampedOscillationThatIsNotResolved)
{
  const Oscillators p({1., 1000.}, {0., 0.}, false, 4.);
  for (const char *which : {"5", "auto"}) {
    Simulation run(p, text(" -ts_adapt_type none -ts_dt 0.002 -ts_rtol 1e-6 -ts_atol 1e-6 -ts_hhtdae_order %s ", which));
    double     largest = 0.;
    run.watch          = [&](Simulation &r, PetscInt, double) { widen(largest, norm(r.u())); };
    run.solve();
    MEASURED("h omega = 2 at constant steps, order %s: largest |q| %.1e", which, largest);
    if (which[0] == '5') {
      EXPECT_GT(largest, 1e3);
    } else {
      EXPECT_LT(largest, 10.);
    }
  }
}

/* Undamped springs of various stiffnesses with almost no motion. For some of them order 5 excites an oscillation that
   limits the step, which HHT does not: the automatic order must not be slower than HHT alone */
TEST(HigherOrder, StiffUndampedModeDoesNotHoldTheStep)
{
  const char *const which[] = {"2", "5", "auto"};
  double            held    = 0.;
  for (double stiffness : {1e3, 3e3, 1e4, 3e4, 1e5, 1e6, 1e8}) {
    const SpringPendulum p(stiffness, 10.);
    TSHHT3Statistics     s[3];
    for (int k = 0; k < 3; k++) {
      Simulation run(p, tolerance(1e-3) + text(" -ts_max_steps 20000 -ts_hhtdae_order %s ", which[k]));
      must(run.solve());
      s[k] = run.statistics();
    }
    MEASURED("stiffness %g: order 2 %d steps, order 5 %d, auto %d (%d of order 2)", stiffness, (int)s[0].steps, (int)s[1].steps, (int)s[2].steps, (int)s[2].of_order[2]);
    EXPECT_LT(s[2].steps, 1.1 * s[0].steps + 20) << stiffness;
    widen(held, (double)s[1].steps / s[2].steps);
  }
  EXPECT_GT(held, 2.);
}

/* The first steps of order three follow steps of HHT, whose velocities violate the differentiated constraints: the
   error of multipliers is of second order there, not lower */
TEST(HigherOrder, MultipliersWhereTheOrderRises)
{
  const Pendulum p(-60., 2., 1.);
  double         worst[2] = {0., 0.};
  for (int fine = 0; fine < 2; fine++) {
    Simulation run(p, fixedSteps(fine ? .001 : .002) + ofOrder(3));
    for (int k = 0; k < 12; k++) {
      must(run.step());
      if (run.statistics().of_order[3]) widen(worst[fine], run.errors().lambda);
    }
    EXPECT_GE(run.statistics().of_order[3], 6);
  }
  MEASURED("multipliers in the first steps of order 3: order %.2f, error %.1e", order(worst[0], worst[1]), worst[1]);
  EXPECT_GE(order(worst[0], worst[1]), 1.8);
}

namespace
{

/* From t = 0.5 on the residual is NaN twice: in one attempt, and in its repetition with a new matrix */
struct Hiccup : Pendulum {
  mutable int done = 0;
  bool        begun = false; /* set after the first step, because the start evaluates the residual at much later times */
  Hiccup() : Pendulum(-60., 2., 1.) {}
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    Pendulum::residual(t, u, v, a, f);
    if (done == 2 || !begun || t < .5) return;
    done++;
    f[0] = std::nan("");
  }
};

} // namespace

/* A correction that fails is repeated with order two and the same h; for this a_n and the drift of velocities must be
   computed */
TEST(HigherOrder, MultipliersWhereTheOrderFalls)
{
  double worst[2] = {0., 0.};
  for (int fine = 0; fine < 2; fine++) {
    Hiccup       p;
    Simulation   run(p, fixedSteps(fine ? .0025 : .005) + ofOrder(5));
    while (run.t() < .6) {
      must(run.step());
      p.begun = true;
      if (p.done) widen(worst[fine], run.errors().lambda);
    }
    const TSHHT3Statistics s = run.statistics();
    EXPECT_EQ(s.corrector_fails, 1);
    EXPECT_EQ(s.restarts, 1);
    EXPECT_GT(s.of_order[2], 8);
    EXPECT_NEAR(s.h_min, s.h_max, 1e-12);
  }
  MEASURED("multipliers in steps of order 2 after order 5: order %.2f, error %.1e", order(worst[0], worst[1]), worst[1]);
  EXPECT_GE(order(worst[0], worst[1]), 1.8);
}

/* A very short step, as to an output time, does not affect the accuracy of the steps after it */
TEST(HigherOrder, StepFarShorterThanTheOthers)
{
  const Pendulum p(-60., 0., 1.);
  for (int k : {3, 5}) {
    double worst[2] = {0., 0.};
    for (int shorter = 0; shorter < 2; shorter++) {
      Simulation run(p, fixedSteps(.005) + " -ts_max_time 1e3 " + ofOrder(k));
      for (int n = 0; n < 80; n++) {
        must(TSSetTimeStep(run.ts, shorter && n == 40 ? 1e-6 : .005));
        must(run.step());
        if (n > 40) widen(worst[shorter], run.errors().lambda);
      }
      EXPECT_EQ(run.statistics().restarts, 1);
    }
    MEASURED("order %d, error of lambda after a step of 1e-6: %.1e, without it %.1e", k, worst[1], worst[0]);
    EXPECT_LT(worst[1], 100 * worst[0]);
  }
}

TEST(HigherOrder, RestartBeginsWithOrderTwo)
{
  const Pendulum p(-90., 0., 2.);
  Simulation     run(p, tolerance(1e-6) + " -ts_hhtdae_order 5 ");
  while (run.t() < 1.) must(run.step());
  const TSHHT3Statistics before = run.statistics();
  EXPECT_GT(before.of_order[5], 10);
  must(TSRestartStep(run.ts));
  for (int k = 0; k < 3; k++) must(run.step());
  EXPECT_EQ(run.statistics().of_order[2], before.of_order[2] + 3);
  EXPECT_EQ(run.statistics().restarts, 2);
  while (run.t() < 1.9) must(run.step());
  EXPECT_GT(run.statistics().of_order[5], before.of_order[5] + 10);
  EXPECT_LT(run.errors().q, 1e-3);
}

/* Every step is made twice; the second time it is the same except for what the corrector has learnt, and so are the orders */
TEST(HigherOrder, RollBack)
{
  const Pendulum p(-90., 0., 2.);
  for (const char *which : {"3", "5", "auto"}) {
    Simulation run(p, tolerance(1e-6) + text(" -ts_hhtdae_order %s ", which));
    for (int k = 0; k < 60; k++) {
      const Step             before = now(run);
      must(run.step());
      const Step             first = now(run);
      const TSHHT3Statistics s     = run.statistics();
      must(TSRollBack(run.ts));
      EXPECT_EQ(run.t(), before.t);
      if (k) {
        EXPECT_TRUE(run.u() == before.u && run.v() == before.v) << which << " " << k;
      }
      must(TSSetTimeStep(run.ts, first.t - before.t));
      must(run.step());
      EXPECT_NEAR(run.t(), first.t, 1e-14);
      const Array u = run.u();
      for (PetscInt i = 0; i < p.n; i++)
        if (p.role[i] == TSHHT3_COORDINATE) {
          EXPECT_NEAR(u[i], first.u[i], 1e-7) << which << " " << k;
        }
      for (int m = 2; m <= 5; m++) EXPECT_EQ(run.statistics().of_order[m], s.of_order[m]) << which << " " << k;
    }
    EXPECT_GT(above(run.statistics()), 40);
  }
}

TEST(HigherOrder, CheckpointsRepeatTheRun)
{
  const Pendulum    pendulum(-90., 0., 1.);
  const UserVars    uservars(.6);
  const std::string file = testing::TempDir() + "hhtdae-order-" + std::to_string((long)getpid());
  for (const Problem *p : {(const Problem *)&pendulum, (const Problem *)&uservars})
    for (const char *which : {"4", "auto"}) {
      SCOPED_TRACE(p->name + " " + which);
      const std::string options = tolerance(1e-6) + text(" -ts_hhtdae_order %s ", which);
      for (int at : {2, 5, 7, 20}) {
        std::vector<Step> steps;
        Simulation        plain(*p, options);
        for (int k = 0; k < at; k++) must(plain.step());
        must(TSHHT3CheckpointSave(plain.ts, file.c_str()));
        for (int k = 0; k < 15; k++) {
          must(plain.step());
          steps.push_back(now(plain));
        }
        Simulation resumed(*p, options + " -ts_hhtdae_resume " + file);
        for (int k = 0; k < 15; k++) {
          must(resumed.step());
          EXPECT_TRUE(now(resumed) == steps[k]) << at << " " << k;
        }
        for (int k = 2; k <= 5; k++) EXPECT_EQ(resumed.statistics().of_order[k], plain.statistics().of_order[k]);
      }
      ErrorTrap  trap;
      Simulation other(*p, tolerance(1e-6) + " -ts_hhtdae_order 3 -ts_hhtdae_resume " + file);
      EXPECT_NE(other.step(), 0);
      EXPECT_TRUE(trap.says("give the same -ts_hhtdae_order")) << trap.message;
    }
  std::remove(file.c_str());
  std::remove((file + ".info").c_str());
}

/* New Euler angles from time to time; past values are transformed with them */
TEST(HigherOrder, ChangesOfCoordinates)
{
  const Tumbling p(true, 4.);
  for (int k : {3, 4, 5}) {
    double worst[2] = {0., 0.};
    for (int turn = 0; turn < 2; turn++) {
      Simulation   run(p, tolerance(1e-7) + ofOrder(k));
      FrameChanges changes(run, p, turn ? 12 : 0, true);
      run.watch = [&](Simulation &s, PetscInt step, double t) {
        if (step) widen(worst[turn], p.errors(t, s.u(), s.v(), s.a()).q);
      };
      must(run.solve());
      const TSHHT3Statistics s = run.statistics();
      EXPECT_EQ(s.restarts, 1);
      EXPECT_GT(s.of_order[k], s.steps / 2);
      MEASURED("order %d: %d steps, %d changes, error of q %.1e", k, (int)s.steps, (int)s.changes, worst[turn]);
      if (turn) {
        EXPECT_GT(s.changes, 5);
      }
    }
    EXPECT_LT(worst[1], 10 * worst[0]);
  }
}

TEST(HigherOrder, SettersAndOptions)
{
  const Pendulum p(-90., 0., .1);
  {
    Simulation run(p, "");
    PetscInt   k;
    must(TSHHT3GetOrder(run.ts, &k));
    EXPECT_EQ(k, 2);
    must(TSHHT3SetOrder(run.ts, TSHHT3_ORDER_AUTO));
    must(TSHHT3GetOrder(run.ts, &k));
    EXPECT_EQ(k, TSHHT3_ORDER_AUTO);
    for (PetscInt bad : {0, 1, 6, -2}) {
      ErrorTrap trap;
      EXPECT_NE(TSHHT3SetOrder(run.ts, bad), 0);
      EXPECT_TRUE(trap.says("neither TSHHT3_ORDER_AUTO nor in 2..5")) << trap.message;
    }
    must(run.step());
    ErrorTrap trap;
    EXPECT_NE(TSHHT3SetOrder(run.ts, 3), 0);
    EXPECT_TRUE(trap.says("must be set before TSSetUp()")) << trap.message;
  }
  for (const char *which : {"2", "3", "4", "5", "auto"}) {
    Simulation run(p, text(" -ts_hhtdae_order %s ", which));
    PetscInt   k;
    must(TSHHT3GetOrder(run.ts, &k));
    EXPECT_EQ(k, which[0] == 'a' ? TSHHT3_ORDER_AUTO : which[0] - '0');
  }
  {
    Simulation run(p, " -ts_hhtdae_order 3 -ts_hhtdae_form paper ");
    ErrorTrap  trap;
    EXPECT_NE(run.step(), 0);
    EXPECT_TRUE(trap.says("-ts_hhtdae_form paper")) << trap.message;
  }
  /* after TSReset() the next run begins with order two */
  Simulation run(p, " -ts_hhtdae_order 4 ");
  must(run.solve());
  must(TSReset(run.ts));
  must(TSHHT3SetOrder(run.ts, 2));
}

/* Order 2 is plain HHT, whether it is set by the option or by default */
TEST(HigherOrder, OrderTwoIsTheDefault)
{
  const FourBar p(2, .4);
  Simulation    plain(p, tolerance(1e-5)), two(p, tolerance(1e-5) + ofOrder(2));
  must(plain.solve());
  must(two.solve());
  EXPECT_TRUE(now(plain) == now(two));
  EXPECT_EQ(two.statistics().of_order[2], two.statistics().steps);
  EXPECT_EQ(above(plain.statistics()), 0);
}
