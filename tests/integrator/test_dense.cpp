/* Dense output: exact at both ends, of third order between them, and what PETSc builds on it */
#include "support.h"

#include <array>

using namespace hhtest;

namespace
{

struct Vectors {
  Vec U, V, A;
  explicit Vectors(Vec like)
  {
    for (Vec *x : {&U, &V, &A}) must(VecDuplicate(like, x));
  }
  ~Vectors()
  {
    for (Vec *x : {&U, &V, &A}) VecDestroy(x);
  }
};

struct DenseErrors {
  double q = 0., v = 0., a = 0., s = 0., lambda = 0.;
};

/* The part of the interpolation error that interpolation itself adds: error between steps minus the linearly
   interpolated errors at both ends (which are smooth). Fixed steps to t = 1/2, evaluated in the second half */
DenseErrors betweenSteps(const Problem &p, double h, const std::string &options)
{
  Simulation  run(p, fixedSteps(h) + options);
  Vectors     x(run.U);
  DenseErrors worst;
  using State   = std::array<Array, 3>;
  auto errorsAt = [&](double t) {
    State e = {Array(p.n), Array(p.n), Array(p.n)};
    must(TSHHT3Interpolate(run.ts, t, x.U, x.V, x.A));
    p.reference(t, e[0].data(), e[1].data(), e[2].data());
    const State y = {whole(x.U), whole(x.V), whole(x.A)};
    for (int k = 0; k < 3; k++)
      for (PetscInt i = 0; i < p.n; i++) e[k][i] = y[k][i] - e[k][i];
    return e;
  };
  double last = 0.;
  while (run.t() < .5) {
    must(run.step());
    const double t = run.t();
    if (t > .25) {
      const State e0 = errorsAt(last), e1 = errorsAt(t);
      for (double theta : {.2, .5, .7}) {
        const State e = errorsAt(last + theta * (t - last));
        for (PetscInt i = 0; i < p.n; i++) {
          double extra[3];
          for (int k = 0; k < 3; k++) extra[k] = std::abs(e[k][i] - (1. - theta) * e0[k][i] - theta * e1[k][i]);
          if (p.role[i] == TSHHT3_COORDINATE) {
            widen(worst.q, extra[0]);
            widen(worst.v, extra[1]);
            widen(worst.a, extra[2]);
          } else
            widen(p.role[i] == TSHHT3_STATE ? worst.s : worst.lambda, extra[0]);
        }
      }
    }
    last = t;
  }
  return worst;
}

void expectThirdOrder(const Problem &p, double h, const std::string &options = "", double inV = 2.9)
{
  const DenseErrors c = betweenSteps(p, h, options), f = betweenSteps(p, h / 2., options);
  MEASURED("%-14s %-24s dense output: order q %.2f, q' %.2f, q'' %.2f, states %.2f, lambda and definitions %.2f; "
           "errors q %.1e, q' %.1e",
           p.name.c_str(), options.c_str(), order(c.q, f.q), order(c.v, f.v), order(c.a, f.a), order(c.s, f.s),
           order(c.lambda, f.lambda), f.q, f.v);
  EXPECT_GE(order(c.q, f.q), 2.9);
  EXPECT_GE(order(c.v, f.v), inV);
  EXPECT_GE(order(c.a, f.a), 1.9);
  if (c.lambda > 0.) {
    EXPECT_GE(order(c.lambda, f.lambda), 1.9);
  }
  if (c.s > 0.) {
    EXPECT_GE(order(c.s, f.s), 2.9);
  }
}

} // namespace

TEST(Dense, ThirdOrder)
{
  for (const char *options : {"", "-ts_hhtdae_radius 0.5"}) {
    expectThirdOrder(Oscillators({1., 3.}, {0., .1}, true, 1.), .02, options);
    expectThirdOrder(DoublePendulum(1.), .01, options);
    expectThirdOrder(Pendulum(-60., 1., 1.), .02, options);
    expectThirdOrder(UserVars(1.), .004, options);
  }
  /* In the paper's form the unknown a_{n+1} is used as q''_{n+1}, from which it differs by O(alpha h); this affects
     the slopes of q' */
  expectThirdOrder(Pendulum(-60., 1., 1.), .02, "-ts_hhtdae_form paper", 1.9);
}

/* Over a whole run the error between steps is no larger than that at the steps */
TEST(Dense, AsGoodAsTheSteps)
{
  const Pendulum p(-90., 0., 2.);
  Simulation     run(p, tolerance(1e-6));
  Vectors        x(run.U);
  double         at = 0., between = 0., vat = 0., vbetween = 0.;
  double         last = 0.;
  run.watch           = [&](Simulation &r, PetscInt step, double t) {
    Array ur(3), vr(3), ar(3);
    if (step) {
      for (double theta : {.3, .5, .8}) {
        const double s = last + theta * (t - last);
        must(TSHHT3Interpolate(r.ts, s, x.U, x.V, nullptr));
        p.reference(s, ur.data(), vr.data(), ar.data());
        const Array u = whole(x.U), v = whole(x.V);
        for (int i = 0; i < 2; i++) {
          widen(between, std::abs(u[i] - ur[i]));
          widen(vbetween, std::abs(v[i] - vr[i]));
        }
      }
      p.reference(t, ur.data(), vr.data(), ar.data());
      for (int i = 0; i < 2; i++) {
        widen(at, std::abs(r.u()[i] - ur[i]));
        widen(vat, std::abs(r.v()[i] - vr[i]));
      }
    }
    last = t;
  };
  must(run.solve());
  MEASURED("pendulum, tolerance 1e-6: errors at the steps %.2e, %.2e, between them %.2e, %.2e", at, vat, between,
           vbetween);
  EXPECT_LT(between, 1.05 * at);
  EXPECT_LT(vbetween, 1.05 * vat);
}

TEST(Dense, ExactAtBothEnds)
{
  const Pendulum pendulum(-90., 0., 1.);
  const UserVars uservars(1.);
  for (const Problem *p : {(const Problem *)&pendulum, (const Problem *)&uservars}) {
    Simulation run(*p, tolerance(1e-5));
    Vectors    x(run.U);
    Array      u, v, a;
    double     t = 0.;
    for (int step = 0; step < 50; step++) {
      must(run.step());
      if (step) { /* the beginning of this step is the end of the last one */
        must(TSHHT3Interpolate(run.ts, t, x.U, x.V, x.A));
        EXPECT_EQ(whole(x.U), u);
        EXPECT_EQ(whole(x.V), v);
        EXPECT_EQ(whole(x.A), a);
        must(TSInterpolate(run.ts, t, x.U));
        EXPECT_EQ(whole(x.U), u);
      }
      t = run.t();
      u = run.u();
      v = run.v();
      a = run.a();
      must(TSHHT3Interpolate(run.ts, t, x.U, x.V, x.A));
      EXPECT_EQ(whole(x.U), u);
      EXPECT_EQ(whole(x.V), v);
      EXPECT_EQ(whole(x.A), a);
      must(TSInterpolate(run.ts, t, x.U));
      EXPECT_EQ(whole(x.U), u);
    }
  }
}

TEST(Dense, RefusesOtherTimes)
{
  const Pendulum p(-90., 0., 1.);
  Simulation     run(p, tolerance(1e-5));
  Vectors        x(run.U);
  {
    ErrorTrap trap;
    must(TSSetUp(run.ts));
    EXPECT_NE(TSHHT3Interpolate(run.ts, 0., x.U, nullptr, nullptr), 0);
    EXPECT_TRUE(trap.says("no step")) << trap.message;
  }
  must(run.step());
  must(run.step());
  ErrorTrap trap;
  EXPECT_NE(TSHHT3Interpolate(run.ts, 0., x.U, nullptr, nullptr), 0);
  EXPECT_TRUE(trap.says("not in the last step")) << trap.message;
  EXPECT_NE(TSHHT3Interpolate(run.ts, 2. * run.t(), x.U, nullptr, nullptr), 0);
}

TEST(Dense, RefusesVectorsOfAnotherSize)
{
  const Pendulum p(-90., 0., 2.);
  Simulation     run(p, tolerance(1e-4));
  Vec            other;
  must(run.solve());
  must(VecCreateSeq(PETSC_COMM_SELF, 1, &other));
  ErrorTrap trap;
  EXPECT_EQ(TSInterpolate(run.ts, 2., other), PETSC_ERR_ARG_SIZ);
  EXPECT_TRUE(trap.says("has 1 entries on this rank, must be 3")) << trap.message;
  EXPECT_EQ(TSHHT3Interpolate(run.ts, 2., nullptr, other, nullptr), PETSC_ERR_ARG_SIZ);
  must(VecDestroy(&other));
}

TEST(Dense, FinalTimeInterpolate)
{
  const Pendulum p(-90., 0., 1.);
  Simulation     run(p, tolerance(1e-6) + "-ts_exact_final_time interpolate");
  PetscReal      t;
  Array          ur(3), vr(3), ar(3);
  must(TSSolve(run.ts, run.U)); /* U receives the interpolated solution */
  must(TSGetSolveTime(run.ts, &t));
  EXPECT_DOUBLE_EQ(t, 1.);
  p.reference(1., ur.data(), vr.data(), ar.data());
  const Array u = run.u();
  MEASURED("-ts_exact_final_time interpolate: error %.1e at t = 1, last step to %.4f",
           std::hypot(u[0] - ur[0], u[1] - ur[1]), run.t());
  EXPECT_LT(std::hypot(u[0] - ur[0], u[1] - ur[1]), 4e-4);
}

TEST(Dense, FinalTimeStepover)
{
  const Pendulum p(-90., 0., 1.);
  Simulation     run(p, tolerance(1e-6) + "-ts_exact_final_time stepover");
  must(run.solve());
  EXPECT_GE(run.t(), 1.);
  EXPECT_LT(run.t(), 1.1);
  EXPECT_LT(run.errors().q, 4e-4);
}

TEST(Dense, FinalTimeMatchstep)
{
  const Pendulum p(-90., 0., 1.);
  Simulation     run(p, tolerance(1e-6) + "-ts_exact_final_time matchstep");
  must(run.solve());
  EXPECT_EQ(run.t(), 1.);
  EXPECT_EQ(run.reason(), TS_CONVERGED_TIME);
  EXPECT_LT(run.errors().q, 4e-4);
}

#if PETSC_VERSION_GE(3, 18, 0)
TEST(Dense, TimeSpan)
{
  const Pendulum   p(-90., 0., 1.);
  PetscReal        times[] = {0., .1, .25, .2500001, .7, .95, 1.};
  const PetscInt   n       = sizeof(times) / sizeof(times[0]);
  Simulation       run(p, tolerance(1e-6));
  std::vector<Vec> at;
  must(TSSetTimeSpan(run.ts, n, times));
  must(run.solve());
  PetscInt m;
  Vec     *sols;
  must(TSGetTimeSpanSolutions(run.ts, &m, &sols));
  ASSERT_EQ(m, n);
  double worst = 0.;
  for (PetscInt k = 0; k < n; k++) {
    Array       ur(3), vr(3), ar(3);
    const Array u = whole(sols[k]);
    p.reference(times[k], ur.data(), vr.data(), ar.data());
    widen(worst, std::hypot(u[0] - ur[0], u[1] - ur[1]));
  }
  const TSHHT3Statistics s = run.statistics();
  MEASURED("time span: error %.1e, %d steps, shortest %.1e", worst, (int)s.steps, s.h_min);
  EXPECT_LT(worst, 4e-4);
  EXPECT_EQ(run.t(), 1.);
}
#endif
