/* Variables and states in constraints: which dependences are accepted, and that accelerations and multipliers take the
   change of the variables into account */
#include "support.h"

#include <cmath>

using namespace hhtest;

namespace
{

double speed(double t) { return .3 * std::sin(3. * t); }
double rate(double t) { return .9 * std::cos(3. * t); }

/* how the constraint gets the velocity of the cart */
enum class Speed { Time,
                   Variable,
                   Chain,
                   Factor,
                   State,
                   OfPosition,
                   OfVelocity,
                   OfMultiplier };

/* A cart of mass 2 whose velocity is given by a velocity-level constraint, and a free cart beside it; lambda = -2 x'' */
struct Cart : Problem {
  Speed how;

  explicit Cart(Speed s) : how(s)
  {
    name = "cart";
    n    = 5;
    t1   = 1.;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, s == Speed::State ? TSHHT3_STATE : TSHHT3_VARIABLE, TSHHT3_VARIABLE, TSHHT3_NONHOLONOMIC};
  }
  void initial(double *u, double *v) const override
  {
    std::fill_n(u, n, 0.);
    std::fill_n(v, n, 0.);
    v[1] = .5;
    if (how == Speed::OfVelocity) v[0] = .5;
    if (how == Speed::OfPosition) u[1] = .4, v[0] = .4;
  }
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    f[0] = 2. * a[0] + u[4];
    f[1] = a[1];
    f[2] = u[2];
    f[3] = u[3] - speed(t);
    f[4] = v[0] - u[2];
    switch (how) {
    case Speed::Time:
      f[4] = v[0] - speed(t), f[2] = u[2] - speed(t);
      break;
    case Speed::Variable:
      f[2] = u[2] - speed(t);
      break;
    case Speed::Chain:
      f[2] = u[2] - u[3];
      break;
    case Speed::Factor:
      f[2] = 3. * u[2] - speed(t);
      break;
    case Speed::State:
      f[2] = v[2] - rate(t);
      break;
    case Speed::OfPosition:
      f[2] = u[2] - u[1];
      break;
    case Speed::OfVelocity:
      f[2] = u[2] - v[1];
      break;
    case Speed::OfMultiplier:
      f[2] = u[2] - speed(t) - u[3], f[3] = u[3] - .1 * u[4];
      break;
    }
  }
  void jacobian(double, const double *, const double *, const double *, double sv, double sa, Entries &J) const override
  {
    J.add(0, 0, 2. * sa);
    J.add(0, 4, 1.);
    J.add(1, 1, sa);
    J.add(2, 2, how == Speed::State ? sv : how == Speed::Factor ? 3.
                                                                : 1.);
    J.add(2, 3, how == Speed::Chain || how == Speed::OfMultiplier ? -1. : 0.);
    J.add(2, 1, how == Speed::OfPosition ? -1. : how == Speed::OfVelocity ? -sv
                                                                          : 0.);
    J.add(3, 3, 1.);
    J.add(3, 4, how == Speed::OfMultiplier ? -.1 : 0.);
    J.add(4, 0, sv);
    J.add(4, 2, how == Speed::Time ? 0. : -1.);
  }
  double force(double t) const { return how == Speed::OfPosition ? -1. : -2. * rate(t); }
};

/* A bead on a line that moves with a state or a variable */
struct Bead : Problem {
  bool state;

  explicit Bead(bool s) : state(s)
  {
    name = "bead";
    n    = 3;
    role = {TSHHT3_COORDINATE, s ? TSHHT3_STATE : TSHHT3_VARIABLE, TSHHT3_HOLONOMIC};
  }
  void initial(double *u, double *v) const override
  {
    std::fill_n(u, n, 0.);
    std::fill_n(v, n, 0.);
  }
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    f[0] = a[0] + u[2];
    f[1] = state ? v[1] - speed(t) : u[1] - speed(t);
    f[2] = u[0] - u[1];
  }
  void jacobian(double, const double *, const double *, const double *, double sv, double sa, Entries &J) const override
  {
    J.add(0, 0, sa);
    J.add(0, 2, 1.);
    J.add(1, 1, state ? sv : 1.);
    J.add(2, 0, 1.);
    J.add(2, 1, -1.);
  }
};

std::string refusal(const Problem &p)
{
  ErrorTrap  error;
  Simulation run(p, "");
  EXPECT_NE(run.solve(), 0) << p.name;
  return error.message;
}

} // namespace

/* At the start, in the first step and at times between steps the multiplier is the same as if the constraint contained
   the velocity as a function of time */
TEST(Variables, InConstraintsOfVelocities)
{
  for (Speed how : {Speed::Time, Speed::Variable, Speed::Chain, Speed::State, Speed::OfPosition}) {
    const Cart p(how);
    Simulation run(p, tolerance(1e-7));
    double     last = 0., worst = 0.;
    int        samples = 0;
    Vec        U;
    must(VecDuplicate(run.U, &U));
    while (run.t() < p.t1) {
      must(run.step());
      if (!samples) {
        EXPECT_NEAR(run.u()[4], p.force(run.t()), 1e-4) << "first step, kind " << (int)how;
      }
      for (double part : {.2, .5, .9}) {
        const double t = last + part * (run.t() - last);
        must(TSHHT3EvaluateAt(run.ts, t, U, nullptr, nullptr));
        widen(worst, std::abs(whole(U)[4] - p.force(t)));
        samples++;
      }
      last = run.t();
    }
    must(VecDestroy(&U));
    MEASURED("kind %d: multiplier at %d samples within steps to %.1e", (int)how, samples, worst);
    EXPECT_LT(worst, how == Speed::State ? 2e-4 : 1e-7) << "kind " << (int)how; /* rates of states are interpolated at such times */
    EXPECT_GT(samples, 10);
  }
}

/* Variables that depend on velocities or multipliers would make the differentiated constraint depend on the unknown
   accelerations; they are refused in constraints */
TEST(Variables, OfVelocitiesOrMultipliersInConstraintsAreRefused)
{
  EXPECT_NE(refusal(Cart(Speed::OfVelocity)).find("row 4 depends on a variable or force state that itself depends on velocities"), std::string::npos);
  EXPECT_NE(refusal(Cart(Speed::OfMultiplier)).find("row 4 depends on a variable or force state that itself depends on velocities"), std::string::npos);
  EXPECT_NE(refusal(Cart(Speed::Factor)).find("Row 2 defines a variable or force state"), std::string::npos);
}

TEST(Variables, InConstraintsOfPositionsAreRefused)
{
  for (bool state : {true, false}) EXPECT_NE(refusal(Bead(state)).find("The holonomic constraint of row 2 depends on"), std::string::npos);
}
