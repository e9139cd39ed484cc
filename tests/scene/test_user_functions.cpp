/* Which C++ functions of Reals are accepted as user's functions, and smooth steps of the state */
#include "hhtdae/scene.h"
#include "support.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

/* with and without "-> Real" the result is a Real, not an expression that refers to its operands */
const auto bare     = [](const Real &l, const Real &v) { return 100. * l * l + 2. * v; };
const auto typed    = [](const Real &l, const Real &v) -> Real { return 100. * l * l + 2. * v; };
const auto plain    = [](const Real &l, const Real &) { return l; };
const auto constant = [](const Real &, const Real &) { return 3; };
const auto several  = [](const Real *m) { return m[0] * m[1]; };
const auto words     = [](const Real &, const Real &) { return "3"; };

template <class F> constexpr bool law        = std::is_constructible<decltype(NonlinearSpring::tension), F>::value;
template <class F> constexpr bool torsion    = std::is_constructible<decltype(NonlinearTorsionalSpring::moment), F>::value;
template <class F> constexpr bool expression = std::is_constructible<Expression, std::vector<Measure>, F>::value;
template <class F> constexpr bool assigned   = std::is_assignable<decltype(NonlinearSpring::tension) &, F>::value;

} // namespace

TEST(UserFunctions, ALambdaHasToReturnANumber)
{
  EXPECT_TRUE(law<decltype(bare)>);
  EXPECT_TRUE(torsion<decltype(bare)>);
  EXPECT_TRUE(assigned<decltype(bare)>);
  EXPECT_TRUE(expression<decltype(several)>);
  EXPECT_TRUE(law<decltype(typed)>);
  EXPECT_TRUE(law<decltype(plain)>);
  EXPECT_TRUE(law<decltype(constant)>);
  EXPECT_FALSE(law<decltype(several)>); /* functions with other arguments are rejected */
  EXPECT_FALSE(law<decltype(words)>);
  EXPECT_TRUE((law<std::function<Real(const Real &, const Real &)>>));
}

TEST(UserFunctions, TheyAreCopiedAndAsked)
{
  ForceLaw f, g = bare;
  EXPECT_FALSE((bool)f);
  f = g;
  ASSERT_TRUE((bool)f);
  for (const ForceLaw &law : {f, ForceLaw(typed)}) {
    const Real y = law(Real(2, 2, 0), Real(3, 2, 1));
    EXPECT_EQ(y.value(), 406);
    EXPECT_EQ(y.derivatives()(0), 400);
    EXPECT_EQ(y.derivatives()(1), 2);
  }
  EXPECT_EQ(ForceLaw(constant)(Real(2, 2, 0), Real(3, 2, 1)).value(), 3);
}

/* Parts of a formula may be stored by auto, and no type needs to be written; the run is the same to the last bit */
TEST(UserFunctions, ARunWithLambdasWithoutTypes)
{
  const double end = 2;
  const auto   run = [&](const ForceLaw &tension, const RealFunction<const Real *> &push) {
    TS     ts;
    Vec    U;
    double x = NAN;
    Scene  scene(PETSC_COMM_SELF);
    PointMass mass;
    mass.mass      = 1;
    mass.position  = Vector3(1.5, 0, 0);
    const Marker at = scene.marker(scene.add("mass", mass)), origin = scene.marker(scene.ground());
    scene.add("spring", NonlinearSpring{at, origin, tension});
    scene.add("push", UserScalarForce{at, origin, Expression{{Measure::time(), Measure::distance(at, origin)}, push}});
    EXPECT_EQ(scene.createTS(&ts), 0);
    EXPECT_EQ(TSSetMaxTime(ts, end), 0);
    EXPECT_EQ(scene.solve(ts), 0);
    EXPECT_EQ(TSGetSolution(ts, &U), 0);
    const PetscScalar *u;
    EXPECT_EQ(VecGetArrayRead(U, &u), 0);
    x = u[0];
    EXPECT_EQ(VecRestoreArrayRead(U, &u), 0);
    EXPECT_EQ(TSDestroy(&ts), 0);
    return x;
  };
  const double bareRun = run(
    [](const Real &l, const Real &v) {
      const auto stretch = l - 1, cube = stretch * stretch * stretch;
      return stretch + 0.1 * cube + 0.2 * v;
    },
    [](const Real *m) { return sin(m[0]) * m[1]; });
  const double typedRun = run([](const Real &l, const Real &v) -> Real { return (l - 1) + 0.1 * ((l - 1) * (l - 1) * (l - 1)) + 0.2 * v; },
                              [](const Real *m) -> Real { return sin(m[0]) * m[1]; });
  EXPECT_EQ(bareRun, typedRun);
  EXPECT_TRUE(std::isfinite(bareRun));
  EXPECT_NE(bareRun, 1.5);

  using Number = TimeFunction::Number;
  const TimeFunction f = TimeFunction::formula([](auto t) {
    const auto s = sin(t);
    return s * t;
  });
  const TimeFunction g = TimeFunction::formula([](const Number &t) -> Number { return sin(t) * t; });
  EXPECT_EQ(f(1.3).f2, g(1.3).f2);
  EXPECT_NEAR(f(1.3).f2, 2 * std::cos(1.3) - 1.3 * std::sin(1.3), 1e-14);
  EXPECT_EQ(TimeFunction::formula([](auto) { return 7; })(1).f, 7);
}

namespace
{

using StateStep = Real (*)(const Real &, double, double, double, double);

void expectDerivative(StateStep f, double x)
{
  const double d = 1e-6;
  const auto   at = [&](double z) { return f(Real(z, 3, 1), 1, -2, 3, 5); };
  EXPECT_NEAR(at(x).derivatives()(1), (at(x + d).value() - at(x - d).value()) / (2 * d), 1e-5) << x; /* whose second derivative jumps at its ends */
  EXPECT_EQ(at(x).derivatives()(0), 0);
  EXPECT_EQ(at(x).derivatives().size(), 3);
}

} // namespace

TEST(UserFunctions, StepsOfTheState)
{
  for (StateStep f : {StateStep(step), StateStep(step5)}) {
    for (double x : {-1., 0.99, 1., 1.2, 2., 2.7, 3., 3.5}) expectDerivative(f, x);
    EXPECT_EQ(f(Real(0, 3, 1), 1, -2, 3, 5).value(), -2);
    EXPECT_EQ(f(Real(4, 3, 1), 1, -2, 3, 5).value(), 5);
    EXPECT_NEAR(f(Real(2, 3, 1), 1, -2, 3, 5).value(), 1.5, 1e-14);
    EXPECT_TRUE(std::isnan(f(Real(2, 3, 1), 3, -2, 3, 5).value())); /* zero width */
    EXPECT_EQ(f(Real(0.), 1, -2, 3, 5).derivatives().size(), 0);
  }
  const double s = 0.3;
  EXPECT_NEAR(step(Real(1 + 2 * s, 1, 0), 1, -2, 3, 5).value(), -2 + 7 * s * s * (3 - 2 * s), 1e-14);
  EXPECT_NEAR(step5(Real(1 + 2 * s, 1, 0), 1, -2, 3, 5).value(), -2 + 7 * s * s * s * (10 - 15 * s + 6 * s * s), 1e-14);
  EXPECT_NEAR(step(Real(2, 1, 0), 1, -2, 3, 5).derivatives()(0), 1.5 * 7 / 2, 1e-13);
  EXPECT_NEAR(step5(Real(2, 1, 0), 1, -2, 3, 5).derivatives()(0), 15. / 8 * 7 / 2, 1e-13);
}

/* STEP(t, 1, -2, 3, 5) and STEP5 of the same, with two derivatives */
TEST(UserFunctions, StepsOfTime)
{
  const TimeFunction cubic = TimeFunction::step(1, -2, 3, 5), quintic = TimeFunction::step5(1, -2, 3, 5);
  for (const TimeFunction &f : {cubic, quintic}) {
    for (double t : {0., 1.}) EXPECT_EQ(f(t).f, -2);
    for (double t : {3., 4.}) EXPECT_EQ(f(t).f, 5);
    EXPECT_EQ(f(0.5).f1, 0);
    EXPECT_EQ(f(3.5).f2, 0);
    for (double t : {1.1, 1.7, 2.2, 2.9}) {
      const double d = 1e-5;
      EXPECT_NEAR(f(t).f1, (f(t + d).f - f(t - d).f) / (2 * d), 1e-8) << t;
      EXPECT_NEAR(f(t).f2, (f(t + d).f1 - f(t - d).f1) / (2 * d), 1e-7) << t;
    }
  }
  const double s = 0.3, d = 1e-9;
  EXPECT_NEAR(cubic(1 + 2 * s).f, -2 + 7 * s * s * (3 - 2 * s), 1e-14);
  EXPECT_NEAR(cubic(1 + d).f2, 6 * 7 / 4., 1e-6); /* the second derivative jumps from 0 */
  EXPECT_NEAR(quintic(1 + d).f2, 0, 1e-6);
  EXPECT_NE(TimeFunction::step(1, 0, 1, 1).error(), "");
  EXPECT_NE(TimeFunction::step5(2, 0, 1, 1).error(), "");
}
