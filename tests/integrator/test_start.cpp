/* The consistent start: accelerations and multipliers, projection and report of inconsistent values, singular problems
 */
#include "integrator/start/start.h"
#include "support.h"

using namespace hhtest;

namespace
{

struct StartValues {
  Array u, a;
};

/* The values from which the first step started, by dense output at its beginning */
StartValues startValues(const Problem &p, const std::string &options)
{
  Simulation run(p, options);
  Vec        U, A;
  must(run.step());
  must(VecDuplicate(run.U, &U));
  must(VecDuplicate(run.U, &A));
  must(TSHHT3Interpolate(run.ts, p.t0, U, nullptr, A));
  StartValues s = {whole(U), whole(A)};
  must(VecDestroy(&U));
  must(VecDestroy(&A));
  return s;
}

/* A pendulum with arbitrary initial values */
struct Displaced : Pendulum {
  Array q, v;
  Displaced(Array position, Array velocity) : Pendulum(-90., 0., 1.), q(std::move(position)), v(std::move(velocity)) {}
  void initial(double *u, double *w) const override
  {
    u[0] = q[0];
    u[1] = q[1];
    u[2] = 0.;
    w[0] = v[0];
    w[1] = v[1];
    w[2] = 0.;
  }
};

/* A mass on a rail, driven: m q'' + lambda = 0, q - s(t) = 0, with s'' jumping at t_0 */
struct Driven : Problem {
  const double w;
  explicit Driven(double frequency) : w(frequency)
  {
    name = "driven";
    n    = 2;
    t1   = 1.;
    role = {TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
  }
  double motion(double t) const { return t < 0. ? NAN : 1. - std::cos(w * t); } /* s'' = w^2 immediately after t_0 */
  void   initial(double *u, double *v) const override { u[0] = u[1] = v[0] = v[1] = 0.; }
  void   residual(double t, const double *u, const double *, const double *a, double *f) const override
  {
    f[0] = 2. * a[0] + u[1];
    f[1] = u[0] - motion(t);
  }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
  {
    J.add(0, 0, 2. * sa);
    J.add(0, 1, 1.);
    J.add(1, 0, 1.);
  }
};

/* A pendulum whose constraint appears twice */
struct Redundant : Pendulum {
  Redundant()
  {
    n    = 4;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC, TSHHT3_HOLONOMIC};
  }
  void initial(double *u, double *v) const override
  {
    Pendulum::initial(u, v);
    u[3] = v[3] = 0.;
  }
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    Pendulum::residual(t, u, v, a, f);
    f[0] += 2. * u[0] * u[3];
    f[1] += 2. * u[1] * u[3];
    f[3] = 2. * f[2];
  }
  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa,
                Entries &J) const override
  {
    Pendulum::jacobian(t, u, v, a, sv, sa, J);
    J.add(0, 0, 2. * u[3]);
    J.add(1, 1, 2. * u[3]);
    for (PetscInt i = 0; i < 2; i++) {
      J.add(i, 3, 2. * u[i]);
      J.add(3, i, 2. * u[i]);
    }
  }
  bool reference(double, double *, double *, double *) const override { return false; }
};

/* A mass of 1 kg in a damper that moves along with it, m q'' + c (q' - v) = m: q'' = 1 however strong the damper */
struct Dragged : Problem {
  const double c;
  explicit Dragged(double damping) : c(damping)
  {
    name = "dragged";
    n    = 1;
    t1   = 1.;
    role = {TSHHT3_COORDINATE};
  }
  void initial(double *u, double *v) const override
  {
    u[0] = 0.;
    v[0] = 1.;
  }
  void residual(double t, const double *, const double *v, const double *a, double *f) const override
  {
    f[0] = a[0] - 1. + c * (v[0] - (1. + t));
  }
  void jacobian(double, const double *, const double *, const double *, double sv, double sa, Entries &J) const override
  {
    J.add(0, 0, sa + c * sv);
  }
};

/* A mass of 2 kg whose velocity is a state: 2 q'' + lambda = 0, s' + 3 s = 0, q' - s = 0 */
struct Followed : Problem {
  const double given; /* the initial s' given by the application */
  explicit Followed(double rate) : given(rate)
  {
    name = "followed";
    n    = 3;
    t1   = 1.;
    role = {TSHHT3_COORDINATE, TSHHT3_STATE, TSHHT3_NONHOLONOMIC};
  }
  void initial(double *u, double *v) const override
  {
    u[0] = u[2] = v[2] = 0.;
    u[1] = v[0] = 1.;
    v[1]        = given;
  }
  void residual(double, const double *u, const double *v, const double *a, double *f) const override
  {
    f[0] = 2. * a[0] + u[2];
    f[1] = v[1] + 3. * u[1];
    f[2] = v[0] - u[1];
  }
  void jacobian(double, const double *, const double *, const double *, double sv, double sa, Entries &J) const override
  {
    J.add(0, 0, 2. * sa);
    J.add(0, 2, 1.);
    J.add(1, 1, sv + 3.);
    J.add(2, 0, sv);
    J.add(2, 1, -1.);
  }
};

/* Two coordinates that share one mass */
struct SharedMass : Problem {
  SharedMass()
  {
    name = "sharedmass";
    n    = 2;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE};
  }
  void initial(double *u, double *v) const override
  {
    u[0] = 1.;
    u[1] = v[0] = v[1] = 0.;
  }
  void residual(double, const double *u, const double *, const double *a, double *f) const override
  {
    f[0] = a[0] + a[1] + u[0];
    f[1] = a[0] + a[1] + 2. * u[0];
  }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
  {
    J.add(0, 0, sa + 1.);
    J.add(0, 1, sa);
    J.add(1, 0, sa + 2.);
    J.add(1, 1, sa);
  }
};

double radius(const Array &u) { return std::hypot(u[0], u[1]); }

} // namespace

TEST(Start, AndrewsAccelerationsAndMultipliers)
{
  const double      a[7] = {14222.4439199541138705911625887, -10666.8329399655854029433719415, 0., 0., 0., 0., 0.};
  const double      l[6] = {98.5668703962410896057654982170, -6.12268834425566265503114393122, 0., 0., 0., 0.};
  const StartValues s    = startValues(Andrews(), tolerance(1e-6));
  double            da = 0., dl = 0.;
  for (int i = 0; i < 7; i++) widen(da, std::abs(s.a[i] - a[i]) / a[0]);
  for (int i = 0; i < 6; i++) widen(dl, std::abs(s.u[7 + i] - l[i]) / l[0]);
  MEASURED("andrews: q''_0 to %.1e, lambda_0 to %.1e relative", da, dl);
  EXPECT_LT(da, 1e-8);
  EXPECT_LT(dl, 1e-8);
}

/* Phi_tt of the bumpy road */
TEST(Start, CarAxisAccelerations)
{
  const double      a[4] = {0., -1., 0., -1.};
  const StartValues s    = startValues(CarAxis(), tolerance(1e-6));
  double            da = 0., dl = 0.;
  for (int i = 0; i < 4; i++) widen(da, std::abs(s.a[i] - a[i]));
  for (int i = 0; i < 2; i++) widen(dl, std::abs(s.u[4 + i]));
  MEASURED("caraxis: q''_0 to %.1e, lambda_0 to %.1e", da, dl);
  EXPECT_LT(da, 1e-7);
  EXPECT_LT(dl, 1e-9);
}

/* A motion that begins at t_0 must not be evaluated before t_0 */
TEST(Start, MotionThatBeginsAtTheStart)
{
  for (double w : {.1, 1., 30., 1000.}) {
    const StartValues s = startValues(Driven(w), tolerance(1e-6) + "-ts_dt 1e-5");
    MEASURED("driven at w = %g: q''_0 to %.1e relative", w, std::abs(s.a[0] / (w * w) - 1.));
    EXPECT_NEAR(s.a[0] / (w * w), 1., 1e-6);
    EXPECT_NEAR(s.u[1] / (-2. * w * w), 1., 1e-6);
  }
}

/* The velocity constraint q' = s is differentiated with the rate s' = -3 s of the state, whatever initial s' was given */
TEST(Start, ConstraintsFollowStates)
{
  for (double given : {0., -3., 5.}) {
    const StartValues s = startValues(Followed(given), tolerance(1e-6));
    MEASURED("followed, s' given as %g: q''_0 %.10g (-3), lambda_0 %.10g (6)", given, s.a[0], s.u[2]);
    EXPECT_NEAR(s.a[0], -3., 1e-8);
    EXPECT_NEAR(s.u[2], 6., 1e-8);
  }
}

/* The matrix of the start contains only inertia, so that strong damping has no influence */
TEST(Start, StrongDampingIsNoInertia)
{
  for (double damping : {1e4, 1e9, 1e12, 1e15}) {
    const StartValues s = startValues(Dragged(damping), "-ts_dt 1e-3");
    EXPECT_NEAR(s.a[0], 1., 1e-12) << damping;
  }
}

/* Every problem whose reference knows accelerations, multipliers, variables and force states at t_0 */
TEST(Start, AllReferences)
{
  for (const Factory &f : allProblems()) {
    const auto p = f.make();
    Array      ur(p->n), vr(p->n), ar(p->n);
    if (!p->reference(p->t0, ur.data(), vr.data(), ar.data())) continue;
    const StartValues s  = startValues(*p, tolerance(1e-6));
    double            da = 0., du = 0., scale = 1e-3, uscale = 1e-3;
    for (PetscInt i = 0; i < p->n; i++) {
      if (p->role[i] == TSHHT3_COORDINATE && !std::isnan(ar[i])) {
        widen(da, std::abs(s.a[i] - ar[i]));
        scale = std::max(scale, std::abs(ar[i]));
      } else if (p->role[i] != TSHHT3_COORDINATE && !std::isnan(ur[i])) {
        widen(du, std::abs(s.u[i] - ur[i]));
        uscale = std::max(uscale, std::abs(ur[i]));
      }
    }
    MEASURED("%-15s q''_0 to %.1e, algebraic unknowns to %.1e of the largest", f.name, da / scale, du / uscale);
    EXPECT_LT(da / scale, 1e-7) << f.name;
    EXPECT_LT(du / uscale, 1e-7) << f.name;
  }
}

TEST(Start, ProjectionMovesAPerturbedPendulumBack)
{
  const Displaced   p({1.02, -.01}, {.3, .5});
  const std::string o = tolerance(1e-6) + "-ts_hhtdae_start project";
  const StartValues s = startValues(p, o);
  EXPECT_NEAR(radius(s.u), 1., 1e-12);
  /* since the mass matrix is a multiple of the unit matrix, the nearest point lies on the same ray */
  EXPECT_NEAR(s.u[0] / s.u[1], 1.02 / -.01, 1e-2 * 102.);
  EXPECT_NEAR(s.u[0], 1.02 / std::hypot(1.02, .01), 1e-4);
  Simulation run(p, o);
  must(run.step());
  Vec V;
  must(VecDuplicate(run.V, &V));
  must(TSHHT3Interpolate(run.ts, 0., nullptr, V, nullptr));
  const Array v = whole(V);
  must(VecDestroy(&V));
  EXPECT_NEAR(v[0] * s.u[0] + v[1] * s.u[1], 0., 1e-10);
  /* only the velocity component along the rod has been removed */
  EXPECT_NEAR(-v[0] * s.u[1] + v[1] * s.u[0], -.3 * s.u[1] + .5 * s.u[0], 1e-9);
  must(run.solve());
  EXPECT_NEAR(radius(run.u()), 1., 1e-8);
}

TEST(Start, MisfitIsReported)
{
  const Displaced position({1.02, -.01}, {0., 0.}), velocity({1., 0.}, {.1, 0.}), good({1., 0.}, {0., .5});
  {
    Printed out;
    startValues(position, tolerance(1e-6));
    EXPECT_TRUE(out.says("positions violate the constraints")) << out.text();
    EXPECT_TRUE(out.says("in row 2")) << out.text();
    EXPECT_TRUE(out.says("-ts_hhtdae_start project")) << out.text();
  }
  {
    Printed out;
    startValues(velocity, tolerance(1e-6));
    EXPECT_TRUE(out.says("velocities violate the constraints")) << out.text();
    EXPECT_FALSE(out.says("positions")) << out.text();
  }
  for (const char *options : {"", "-ts_hhtdae_start project"}) {
    Printed out;
    startValues(good, tolerance(1e-6) + options);
    EXPECT_EQ(out.text(), "");
  }
  {
    Printed out; /* below the tolerance nothing is reported */
    startValues(Displaced({1. + 1e-5, 0.}, {0., 0.}), tolerance(1e-3));
    EXPECT_EQ(out.text(), "");
  }
}

TEST(Start, OffTakesValuesAsTheyAre)
{
  Printed           out;
  const StartValues s = startValues(Displaced({1.02, -.01}, {.3, .5}), tolerance(1e-6) + "-ts_hhtdae_start off");
  EXPECT_EQ(out.text(), "");
  EXPECT_EQ(s.u[0], 1.02);
  EXPECT_EQ(s.u[1], -.01);
}

TEST(Start, WhatCannotBeAssembledIsAnError)
{
  struct Impossible : Driven { /* q^2 + 1 = 0 */
    Impossible() : Driven(1.) {}
    void initial(double *u, double *v) const override
    {
      u[0] = .7;
      u[1] = v[0] = v[1] = 0.;
    }
    void residual(double, const double *u, const double *, const double *a, double *f) const override
    {
      f[0] = a[0] + 2. * u[0] * u[1];
      f[1] = u[0] * u[0] + 1.;
    }
    void jacobian(double, const double *u, const double *, const double *, double, double sa, Entries &J) const override
    {
      J.add(0, 0, sa + 2. * u[1]);
      J.add(0, 1, 2. * u[0]);
      J.add(1, 0, 2. * u[0]);
    }
  } p;
  Simulation run(p, "-ts_hhtdae_start project");
  ErrorTrap  trap;
  EXPECT_NE(run.step(), 0);
  EXPECT_TRUE(trap.says("cannot be projected")) << trap.message;
}

TEST(Start, RedundantConstraintsAreNamed)
{
  for (const char *options : {"", "-ts_hhtdae_start off", "-ts_hhtdae_start project"}) {
    SCOPED_TRACE(options);
    const Redundant p;
    Simulation      run(p, options);
    ErrorTrap       trap;
    EXPECT_EQ(run.step(), PETSC_ERR_MAT_LU_ZRPVT);
    EXPECT_TRUE(trap.says("rows 2, 3 depend on one another")) << trap.message;
  }
}

/* As at a dead centre, where rounding makes the matrix singular although the constraints are not quite dependent */
TEST(Start, NearlyDependentConstraintsAreNamed)
{
  constexpr double e = 1e-8;
  struct NearlyDependent : Redundant { /* q_1 = 0, q_1 + e q_2 = 0, where 1 + e^2 is 1 in floating point */
    void initial(double *u, double *v) const override
    {
      for (int i = 0; i < 4; i++) u[i] = v[i] = 0.;
    }
    void residual(double, const double *u, const double *, const double *a, double *f) const override
    {
      f[0] = a[0] + u[2] + u[3];
      f[1] = a[1] + e * u[3] + 9.81;
      f[2] = u[0];
      f[3] = u[0] + e * u[1];
    }
    void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
    {
      J.add(0, 0, sa);
      J.add(1, 1, sa);
      for (int c : {2, 3}) {
        J.add(0, c, 1.);
        J.add(c, 0, 1.);
      }
      J.add(1, 3, e);
      J.add(3, 1, e);
    }
  } p;
  Simulation run(p, "");
  ErrorTrap  trap;
  EXPECT_EQ(run.step(), PETSC_ERR_MAT_LU_ZRPVT);
  EXPECT_TRUE(trap.says("rows 2, 3 nearly depend on one another")) << trap.message;
}

TEST(Start, SingularMassIsNotBlamedOnConstraints)
{
  const SharedMass p;
  Simulation       run(p, "", PETSC_COMM_SELF, true);
  ErrorTrap        trap;
  EXPECT_EQ(run.step(), PETSC_ERR_MAT_LU_ZRPVT);
  EXPECT_TRUE(trap.says("not by dependent constraints")) << trap.message;
}

TEST(Start, TrapezoidalRuleWithConstraintsWarns)
{
  const Pendulum    pendulum(-90., 0., .1);
  const Oscillators oscillators({1.}, {0.}, false, 1.);
  for (const char *options :
       {"-ts_hhtdae_alpha 0", "-ts_hhtdae_radius 1", "-ts_hhtdae_form paper -ts_hhtdae_alpha 0"}) {
    Printed    out;
    Simulation run(pendulum, options);
    must(TSSetUp(run.ts));
    EXPECT_TRUE(out.says("weakly unstable")) << options;
  }
  Printed    out;
  Simulation damped(pendulum, "-ts_hhtdae_alpha -0.05"), free(oscillators, "-ts_hhtdae_alpha 0");
  must(TSSetUp(damped.ts));
  must(TSSetUp(free.ts));
  EXPECT_EQ(out.text(), "");
}

/* Without -ts_dt the first step is chosen such that the error test accepts it and the second step is of similar length */
TEST(Start, FirstStepIsChosen)
{
  for (double eps : {1e-4, 1e-8}) {
    const Pendulum p(-60., 1., 2.);
    Simulation     run(p, tolerance(eps));
    must(TSSetTimeStep(run.ts, hht3::unset_step));
    {
      Options in(tolerance(eps));
      must(TSSetFromOptions(run.ts));
    }
    PetscReal first, second;
    must(run.step());
    first = run.t();
    EXPECT_EQ(run.statistics().rejected, 0);
    must(run.step());
    second = run.t() - first;
    MEASURED("pendulum, tolerance %g: first steps %.2e, %.2e", eps, first, second);
    EXPECT_LT(second / first, 3.);
    EXPECT_GT(second / first, .5);
  }
}

namespace
{

/* A mass on two springs in series with a damper at the point between them that acts from 0.3 s on; before, the rate of
   this point occurs in no equation */
struct LateDamper : Problem {
  static constexpr double k = 500., soft = 10., c = 40., g = 9.81, on = 0.3;

  LateDamper()
  {
    name = "late damper";
    n    = 2;
    t1   = 0.5;
    role = {TSHHT3_COORDINATE, TSHHT3_STATE};
  }
  static double damper(double t) { return t < on ? 0. : c; }
  void          initial(double *u, double *v) const override
  {
    u[0] = 0.5, u[1] = 0.5 * k / (k + soft);
    v[0] = v[1] = 0.;
  }
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    f[0] = a[0] + g + k * (u[0] - u[1]);
    f[1] = damper(t) * v[1] + soft * u[1] + k * (u[1] - u[0]);
  }
  void jacobian(double t, const double *, const double *, const double *, double sv, double sa, Entries &J) const override
  {
    J.add(0, 0, sa + k);
    J.add(0, 1, -k);
    J.add(1, 0, -k);
    J.add(1, 1, sv * damper(t) + soft + k);
  }
  /* In closed form until the damper acts, afterwards by many steps of the classical Runge-Kutta method; good to 9 digits */
  double exact() const
  {
    const double          w = std::sqrt(k * soft / (k + soft)), mid = -g / (w * w), amplitude = 0.5 - mid, q = mid + amplitude * std::cos(w * on);
    std::array<double, 3> y{q, -amplitude * w * std::sin(w * on), q * k / (k + soft)};
    const auto            rate  = [](const std::array<double, 3> &x) { return std::array<double, 3>{x[1], -g - k * (x[0] - x[2]), -(soft * x[2] + k * (x[2] - x[0])) / c}; };
    const int             steps = 10000;
    const double          h     = (t1 - on) / steps;
    for (int i = 0; i < steps; i++) {
      std::array<double, 3> sum = y, x = y;
      for (const auto &[weight, next] : {std::array<double, 2>{1. / 6., .5}, {1. / 3., .5}, {1. / 3., 1.}, {1. / 6., 0.}}) {
        const auto f = rate(x);
        for (int j = 0; j < 3; j++) sum[j] += weight * h * f[j], x[j] = y[j] + next * h * f[j];
      }
      y = sum;
    }
    return y[0];
  }
};

} // namespace

/* The rate of such a point at the start must not be computed from rounding errors (it had been rounding divided by 1e-28) */
TEST(Start, RatesThatMeanNothingAtFirst)
{
  const LateDamper p;
  for (double eps : {1e-5, 1e-7}) {
    Simulation run(p, tolerance(eps), PETSC_COMM_SELF, true);
    must(run.solve());
    MEASURED("tolerance %g: off by %.1e after %d steps", eps, run.u()[0] - p.exact(), (int)run.statistics().steps);
    EXPECT_NEAR(run.u()[0], p.exact(), 100. * eps);
    EXPECT_LT(run.statistics().steps, 400);
  }
}

namespace
{

/* x = sin 3 t is prescribed and defined only up to the end of the run */
struct Tabulated : Problem {
  explicit Tabulated(double begin)
  {
    name = "tabulated";
    n    = 2;
    t0   = begin;
    role = {TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
  }
  void initial(double *u, double *v) const override { u[0] = std::sin(3. * t0), v[0] = 3. * std::cos(3. * t0), u[1] = v[1] = 0.; }
  void residual(double t, const double *u, const double *, const double *a, double *f) const override
  {
    f[0] = a[0] + u[1];
    f[1] = u[0] - (t <= t1 ? std::sin(3. * t) : NAN);
  }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
  {
    J.add(0, 0, sa);
    J.add(0, 1, 1.);
    J.add(1, 0, 1.);
  }
};

} // namespace

/* Where constraints are NaN at later times they are differentiated by backward differences */
TEST(Start, WhereATableEnds)
{
  for (double left : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
    const Tabulated p(1. - left);
    const double    exact = -9. * std::sin(3. * p.t0), a = startValues(p, tolerance(1e-5)).a[0];
    MEASURED("%g before the end: acceleration off by %.1e of %.1f", left, std::abs(a - exact), exact);
    EXPECT_NEAR(a, exact, 1e-2) << left; /* contains the lag of the first step */
  }
}
