/* What may stand where a user's function of Reals is asked for, and steps of the state */
#include "hhtdae/scene.h"
#include "support.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

/* A lambda without "-> Real" returns one of Eigen's expressions, which refers to Reals of the call */
const auto dangling = [](const Real &l, const Real &v) { return 100. * l * l + 2. * v; };
const auto safe     = [](const Real &l, const Real &v) -> Real { return 100. * l * l + 2. * v; };
const auto plain    = [](const Real &l, const Real &) { return l; };
const auto constant = [](const Real &, const Real &) { return 3.; };
const auto many     = [](const Real *m) { return m[0] * m[1]; };
const auto good     = [](const Real *m) -> Real { return m[0] * m[1]; };

template <class F> constexpr bool law        = std::is_constructible<decltype(NonlinearSpring::tension), F>::value;
template <class F> constexpr bool torsion    = std::is_constructible<decltype(NonlinearTorsionalSpring::moment), F>::value;
template <class F> constexpr bool expression = std::is_constructible<Expression, std::vector<Measure>, F>::value;
template <class F> constexpr bool assigned   = std::is_assignable<decltype(NonlinearSpring::tension) &, F>::value;

} // namespace

TEST(UserFunctions, ALambdaHasToReturnNumbers)
{
  EXPECT_FALSE(law<decltype(dangling)>);
  EXPECT_FALSE(torsion<decltype(dangling)>);
  EXPECT_FALSE(assigned<decltype(dangling)>);
  EXPECT_FALSE(expression<decltype(many)>);
  EXPECT_TRUE(law<decltype(safe)>);
  EXPECT_TRUE(torsion<decltype(safe)>);
  EXPECT_TRUE(assigned<decltype(safe)>);
  EXPECT_TRUE(law<decltype(plain)>);
  EXPECT_TRUE(law<decltype(constant)>);
  EXPECT_TRUE(expression<decltype(good)>);
  EXPECT_FALSE(law<decltype(good)>); /* other arguments */
  EXPECT_TRUE((law<std::function<Real(const Real &, const Real &)>>));
}

TEST(UserFunctions, TheyAreCopiedAndAsked)
{
  RealFunction<const Real &, const Real &> f, g = safe;
  EXPECT_FALSE((bool)f);
  f = g;
  ASSERT_TRUE((bool)f);
  const Real y = f(Real(2, 2, 0), Real(3, 2, 1));
  EXPECT_EQ(y.value(), 406);
  EXPECT_EQ(y.derivatives()(0), 400);
  EXPECT_EQ(y.derivatives()(1), 2);
}

namespace
{

using StateStep = Real (*)(const Real &, double, double, double, double);

void expectDerivative(StateStep f, double x)
{
  const double d = 1e-6;
  const auto   at = [&](double z) { return f(Real(z, 3, 1), 1, -2, 3, 5); };
  EXPECT_NEAR(at(x).derivatives()(1), (at(x + d).value() - at(x - d).value()) / (2 * d), 1e-5) << x; /* at the ends of the cubic the second derivative jumps */
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
    EXPECT_TRUE(std::isnan(f(Real(2, 3, 1), 3, -2, 3, 5).value())); /* no width */
    EXPECT_EQ(f(Real(std::log(1.), 0, 0), 1, -2, 3, 5).derivatives().size(), 0);
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
  EXPECT_NEAR(cubic(1 + d).f2, 6 * 7 / 4., 1e-6); /* jumps from 0 */
  EXPECT_NEAR(quintic(1 + d).f2, 0, 1e-6);
  EXPECT_NE(TimeFunction::step(1, 0, 1, 1).error(), "");
  EXPECT_NE(TimeFunction::step5(2, 0, 1, 1).error(), "");
}
