/* Starts in other units of length and time and in runs of any length: results depend neither on the unit nor on the
   length of the run */
#include "support.h"

using namespace hhtest;

namespace
{

/* A mass of 2 on a rod of length L in its lowest position, with a horizontal velocity: m q'' + Phi_q^T lambda = Q with
   Phi = |q| - L */
struct AtItsLowest : Problem {
  const double L, speed, g;
  AtItsLowest(double unit, double length, double v) : L(length * unit), speed(v * unit), g(9.81 * unit)
  {
    name = "pendulum at its lowest point";
    n    = 3;
    t1   = 1.;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
  }
  void initial(double *u, double *v) const override
  {
    u[0] = u[2] = v[1] = v[2] = 0.;
    u[1]                      = -L;
    v[0]                      = speed;
  }
  void residual(double, const double *u, const double *, const double *a, double *f) const override
  {
    const double r = std::hypot(u[0], u[1]);
    f[0]           = 2. * a[0] + u[2] * u[0] / r;
    f[1]           = 2. * (a[1] + g) + u[2] * u[1] / r;
    f[2]           = r - L;
  }
  void jacobian(double, const double *u, const double *, const double *, double, double sa, Entries &J) const override
  {
    const double r = std::hypot(u[0], u[1]);
    for (int i = 0; i < 2; i++)
      for (int j = 0; j < 2; j++) J.add(i, j, (i == j ? 2. * sa + u[2] / r : 0.) - u[2] * u[i] * u[j] / (r * r * r));
    for (int i = 0; i < 2; i++) J.add(i, 2, u[i] / r), J.add(2, i, u[i] / r);
  }
  /* the computed force of the rod over the exact one */
  double ratio(double lambda) const { return lambda / (2. * (g + speed * speed / L)); }
};

double startRatio(const AtItsLowest &p)
{
  Simulation run(p, tolerance(1e-5));
  Vec        U;
  must(run.step());
  must(VecDuplicate(run.U, &U));
  must(TSHHT3Interpolate(run.ts, 0., U, nullptr, nullptr));
  const Array u = whole(U);
  must(VecDestroy(&U));
  return p.ratio(u[2]);
}

} // namespace

/* The horizontal coordinate is 0 and gives no scale of lengths. Over a time too short for anything to change,
   differences of the constraint vanish, which must not be taken for a zero derivative */
TEST(Units, ForcesOfTheStart)
{
  for (double length : {.5, 5., 20.})
    for (double unit : {1., 1e3, 1e6}) {
      const AtItsLowest p(unit, length, 20.);
      EXPECT_NEAR(startRatio(p), 1., 1e-6) << length << " m in units of 1/" << unit;
    }
}

namespace
{

/* A mass of 3 whose position is prescribed as sin(2 (t - begin) + 0.7) */
struct Late : Problem {
  const double begin;
  explicit Late(double t) : begin(t)
  {
    name = "late in time";
    n    = 2;
    t1   = 1.;
    role = {TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
  }
  double given(double t) const { return std::sin(2. * (t - begin) + 0.7); }
  void   initial(double *u, double *v) const override
  {
    u[0] = given(begin);
    v[0] = 2. * std::cos(0.7);
    u[1] = v[1] = 0.;
  }
  void residual(double t, const double *u, const double *, const double *a, double *f) const override
  {
    f[0] = 3. * a[0] + u[1];
    f[1] = u[0] - given(t);
  }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
  {
    J.add(0, 0, 3. * sa);
    J.add(0, 1, 1.);
    J.add(1, 0, 1.);
  }
};

} // namespace

/* Times like seconds since 1970, whose rounding is a quarter of a microsecond: forces are as accurate as near t = 0 */
TEST(Units, LateInTime)
{
  for (const char *order : {"2", "auto"}) {
    double expected = 0.;
    for (double begin : {0., 1e6, 1.7e9}) {
      const Late p(begin);
      Simulation run(p, tolerance(1e-6) + "-ts_hhtdae_order " + order);
      Printed    out;
      double     off = 0.;
      Vec        sampled;
      must(VecDuplicate(run.U, &sampled));
      run.watch = [&](Simulation &r, PetscInt step, double t) {
        PetscReal last;
        if (step == 0) return;
        widen(off, std::abs(r.u()[1] - 12. * p.given(t)));
        must(TSGetPrevTime(r.ts, &last));
        must(TSHHT3EvaluateAt(r.ts, last + 0.4 * (t - last), sampled, nullptr, nullptr));
        EXPECT_NEAR(whole(sampled)[1], 12. * p.given(last + 0.4 * (t - last)), 1e-4) << begin;
      };
      must(TSSetTime(run.ts, begin));
      must(TSSetMaxTime(run.ts, begin + 1.));
      must(run.solve());
      EXPECT_FALSE(out.says("violate")) << out.text();
      EXPECT_NEAR(run.u()[0], std::sin(2.7), 1e-5) << begin;
      must(VecDestroy(&sampled));
      if (begin == 0.) expected = off;
      EXPECT_LT(off, 1.1 * expected) << order << " " << begin;
      MEASURED("order %s from %g: %.2e", order, begin, off);
    }
  }
}

/* From rest, the length of the run is at first the only known time scale; it must not influence the steps. A run to
   1e300 is a run that something other than the final time ends */
TEST(Units, LongRuns)
{
  const Pendulum p(-60., 0., 2.);
  double         short_run = 0.;
  for (double end : {10., 1e9, 1e20, 1e300}) {
    Simulation run(p, tolerance(1e-6));
    double     error = 0.;
    must(TSSetMaxTime(run.ts, end));
    while (run.t() < 1.9) {
      must(run.step());
      widen(error, run.errors().q);
    }
    if (end == 10.) short_run = error;
    EXPECT_LT(error, 1.2 * short_run) << "a run to " << end;
    EXPECT_EQ(run.statistics().tiny_steps, 0) << "a run to " << end;
  }
}

/* m q'' + lambda = 0, q = 1 - cos(w t) from rest: how well a very long run finds the time scale of the motion */
struct Swung : Problem {
  const double w;
  explicit Swung(double frequency) : w(frequency)
  {
    name = "swung";
    n    = 2;
    t1   = 1.;
    role = {TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
  }
  void initial(double *u, double *v) const override { u[0] = u[1] = v[0] = v[1] = 0.; }
  void residual(double t, const double *u, const double *, const double *a, double *f) const override
  {
    f[0] = 2. * a[0] + u[1];
    f[1] = u[0] - (1. - std::cos(w * t));
  }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
  {
    J.add(0, 0, 2. * sa);
    J.add(0, 1, 1.);
    J.add(1, 0, 1.);
  }
};

TEST(Units, MotionsInLongRuns)
{
  for (double end : {10., 1e8, 1e9, 1e12, 1e30})
    for (double w : {2., 3., 4., 5., 7.}) {
      const Swung p(w);
      Simulation  run(p, tolerance(1e-6));
      double      worst = 0.;
      must(TSSetMaxTime(run.ts, end));
      while (run.t() < 1.) {
        must(run.step());
        widen(worst, std::abs(run.u()[0] - (1. - std::cos(w * run.t()))));
      }
      EXPECT_LT(worst, 1e-3) << "w = " << w << " in a run to " << end;
    }
}
