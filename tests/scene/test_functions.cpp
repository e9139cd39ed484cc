/* Functions of time: values, derivatives against closed forms and differences, smoothness, and refused input */
#include "hhtdae/functions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

using namespace hhtdae;
using Formula = TimeFunction::Number;

namespace
{

/* f1 and f2 against central differences of f and f1, whose error is of order d^2 for f of order one */
void ExpectDerivatives(const TimeFunction &f, double t, double tolerance = 1e-8)
{
  const double              d = 1e-5;
  const TimeFunction::Value v = f(t), a = f(t - d), b = f(t + d);
  const double              scale = 1 + std::abs(v.f) + std::abs(v.f1) + std::abs(v.f2);
  EXPECT_NEAR(v.f1, (b.f - a.f) / (2 * d), tolerance * scale) << "f' at " << t;
  EXPECT_NEAR(v.f2, (b.f1 - a.f1) / (2 * d), tolerance * scale) << "f'' at " << t;
}

const double kNaN = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();

} // namespace

TEST(TimeFunctions, ConstantsHaveNoDerivatives)
{
  const TimeFunction f(2.5), zero, p = TimeFunction::polynomial({-3});
  EXPECT_TRUE(f.isConstant() && zero.isConstant() && p.isConstant());
  for (double t : {-1., 0., 7.}) {
    EXPECT_EQ(f(t).f, 2.5);
    EXPECT_EQ(f(t).f1, 0);
    EXPECT_EQ(f(t).f2, 0);
    EXPECT_EQ(zero(t).f, 0);
    EXPECT_EQ(p(t).f, -3);
  }
  EXPECT_EQ(f.error(), "");
}

TEST(TimeFunctions, PolynomialIsExact)
{
  const TimeFunction f = TimeFunction::polynomial({1, -2, 3, .5});
  EXPECT_FALSE(f.isConstant());
  for (double t : {-2., 0., .75, 4.}) {
    const TimeFunction::Value v = f(t);
    EXPECT_NEAR(v.f, 1 - 2 * t + 3 * t * t + .5 * t * t * t, 1e-13);
    EXPECT_NEAR(v.f1, -2 + 6 * t + 1.5 * t * t, 1e-13);
    EXPECT_NEAR(v.f2, 6 + 3 * t, 1e-13);
  }
}

TEST(TimeFunctions, HarmonicIsExact)
{
  const TimeFunction f = TimeFunction::harmonic(2, 3, .4, 5);
  for (double t : {-2., 0., .75, 4.}) {
    const TimeFunction::Value v = f(t);
    EXPECT_NEAR(v.f, 5 + 2 * std::sin(3 * t + .4), 1e-14);
    EXPECT_NEAR(v.f1, 6 * std::cos(3 * t + .4), 1e-14);
    EXPECT_NEAR(v.f2, -18 * std::sin(3 * t + .4), 1e-13);
  }
}

TEST(TimeFunctions, StepIsAQuinticWithFlatEnds)
{
  const double       t0 = 1, t1 = 3, x0 = -2, x1 = 5;
  const TimeFunction f = TimeFunction::step5(t0, x0, t1, x1);
  for (double t : {-1., 0., 1.}) {
    EXPECT_EQ(f(t).f, x0);
    EXPECT_EQ(f(t).f1, 0);
    EXPECT_EQ(f(t).f2, 0);
  }
  for (double t : {3., 10.}) {
    EXPECT_EQ(f(t).f, x1);
    EXPECT_EQ(f(t).f1, 0);
    EXPECT_EQ(f(t).f2, 0);
  }
  EXPECT_NEAR(f(2).f, (x0 + x1) / 2, 1e-14);
  EXPECT_NEAR(f(2).f1, 15. / 8 * (x1 - x0) / (t1 - t0), 1e-13); /* the largest slope of the quintic */
  EXPECT_NEAR(f(2).f2, 0, 1e-13);
  const double s = .3; /* 10 s^3 - 15 s^4 + 6 s^5 */
  EXPECT_NEAR(f(t0 + 2 * s).f, x0 + 7 * s * s * s * (10 - 15 * s + 6 * s * s), 1e-13);
  for (double t : {1.1, 1.7, 2.2, 2.9}) ExpectDerivatives(f, t);
}

/* Value and two derivatives are continuous where pieces join: differences over 2 d are of order d */
TEST(TimeFunctions, PiecesAreTwiceContinuouslyDifferentiable)
{
  const std::vector<double> t{-1, 0, .3, 1.5, 2, 4}, x{2, -1, .5, .7, 3, -2};
  const TimeFunction        spline = TimeFunction::spline(t, x), step = TimeFunction::step5(0, 1, 2, -1);
  const double              d = 1e-9;
  for (const auto &[f, joint] : {std::pair{spline, t}, std::pair{step, std::vector<double>{0, 2}}})
    for (double at : joint) {
      const TimeFunction::Value a = f(at - d), b = f(at + d);
      EXPECT_NEAR(a.f, b.f, 1e-6) << at;
      EXPECT_NEAR(a.f1, b.f1, 1e-6) << at;
      EXPECT_NEAR(a.f2, b.f2, 1e-6) << at;
    }
}

TEST(TimeFunctions, SplineInterpolatesAndIsNatural)
{
  const std::vector<double> t{-1, 0, .3, 1.5, 2, 4}, x{2, -1, .5, .7, 3, -2};
  const TimeFunction        f = TimeFunction::spline(t, x);
  EXPECT_EQ(f.error(), "");
  for (size_t k = 0; k < t.size(); k++) EXPECT_NEAR(f(t[k]).f, x[k], 1e-14);
  EXPECT_NEAR(f(-1).f2, 0, 1e-14);
  EXPECT_NEAR(f(4).f2, 0, 1e-14);
  for (double at : {-3., -.5, .1, .9, 1.7, 3., 6.}) ExpectDerivatives(f, at);
}

TEST(TimeFunctions, SplineThroughThreePointsHasItsClosedForm)
{
  /* (0,0), (1,1), (2,0): m_1 = 6 (-1 - 1) / 4 = -3, so on [0,1] f = -t^3/2 + 3t/2 */
  const TimeFunction f = TimeFunction::spline({0, 1, 2}, {0, 1, 0});
  for (double t : {0., .25, .5, 1.}) {
    EXPECT_NEAR(f(t).f, 1.5 * t - .5 * t * t * t, 1e-15);
    EXPECT_NEAR(f(2 - t).f, f(t).f, 1e-15);
    EXPECT_NEAR(f(t).f1, 1.5 - 1.5 * t * t, 1e-15);
    EXPECT_NEAR(f(t).f2, -3 * t, 1e-15);
  }
  EXPECT_NEAR(f(-2).f, -3, 1e-15); /* the slope at the end */
  EXPECT_NEAR(f(5).f, -4.5, 1e-15);
  EXPECT_EQ(f(5).f2, 0);
}

TEST(TimeFunctions, SplineOfALineIsTheLine)
{
  const TimeFunction two  = TimeFunction::spline({1, 3}, {2, 6}),
                     five = TimeFunction::spline({0, 1, 3, 4, 9}, {1, 3, 7, 9, 19});
  for (double t : {-1., 1., 2.2, 20.}) {
    EXPECT_NEAR(two(t).f, 2 * t, 1e-13);
    EXPECT_NEAR(two(t).f1, 2, 1e-13);
    EXPECT_NEAR(five(t).f, 1 + 2 * t, 1e-13);
    EXPECT_NEAR(five(t).f2, 0, 1e-13);
  }
}

/* sin has no second derivative at 0 and pi, so that natural end conditions do not reduce the order */
TEST(TimeFunctions, SplineConvergesWithFourthOrder)
{
  double error[2];
  for (int level = 0; level < 2; level++) {
    const int           n = 10 << level;
    std::vector<double> t, x;
    for (int k = 0; k <= n; k++) {
      t.push_back(k * M_PI / n);
      x.push_back(std::sin(t.back()));
    }
    const TimeFunction f = TimeFunction::spline(t, x);
    error[level]         = 0;
    for (double at = 0; at <= M_PI; at += .01) error[level] = std::max(error[level], std::abs(f(at).f - std::sin(at)));
  }
  EXPECT_NEAR(std::log2(error[0] / error[1]), 4, .2);
}

TEST(TimeFunctions, FormulasAreDifferentiatedExactly)
{
  const TimeFunction f =
      TimeFunction::formula([](const Formula &t) -> Formula { return sin(2.0 * t) * exp(-t) + 1.0 / (2.0 + t * t); });
  for (double t : {-.7, 0., .4, 3.}) {
    const TimeFunction::Value v = f(t);
    const double              s = std::sin(2 * t), c = std::cos(2 * t), e = std::exp(-t), r = 1 / (2 + t * t);
    EXPECT_NEAR(v.f, s * e + r, 1e-14);
    EXPECT_NEAR(v.f1, (2 * c - s) * e - 2 * t * r * r, 1e-14);
    EXPECT_NEAR(v.f2, (-3 * s - 4 * c) * e - 2 * r * r + 8 * t * t * r * r * r, 1e-13);
    ExpectDerivatives(f, t);
  }
}

TEST(TimeFunctions, FormulasMayBranchAndBeConstant)
{
  const TimeFunction f = TimeFunction::formula([](const Formula &t) -> Formula {
    if (t < 1.0) return t * t * t;
    return sqrt(t);
  });
  EXPECT_NEAR(f(.5).f2, 3, 1e-15);
  EXPECT_NEAR(f(4).f, 2, 1e-15);
  EXPECT_NEAR(f(4).f1, .25, 1e-15);
  EXPECT_NEAR(f(4).f2, -1. / 32, 1e-15);
  const TimeFunction c = TimeFunction::formula([](const Formula &) -> Formula { return Formula(7); });
  EXPECT_EQ(c(2).f, 7);
  EXPECT_EQ(c(2).f1, 0);
  EXPECT_EQ(c(2).f2, 0);
}

TEST(TimeFunctions, ValuesAreHandedThrough)
{
  const TimeFunction f = TimeFunction::values([](double t) { return TimeFunction::Value{t * t, 2 * t, 2}; });
  EXPECT_EQ(f(3).f, 9);
  EXPECT_EQ(f(3).f1, 6);
  EXPECT_EQ(f(3).f2, 2);
}

TEST(TimeFunctions, BadInputIsNamed)
{
  const auto says = [](const TimeFunction &f, const char *words) {
    EXPECT_NE(f.error().find(words), std::string::npos) << "\"" << f.error() << "\" lacks \"" << words << "\"";
    EXPECT_TRUE(std::isnan(f(0).f) || std::isinf(f(0).f));
  };
  says(TimeFunction(kNaN), "constant is nan");
  says(TimeFunction(kInf), "constant is inf");
  says(TimeFunction::polynomial({}), "at least one");
  says(TimeFunction::polynomial({1, kInf}), "finite");
  says(TimeFunction::harmonic(1, kNaN), "omega nan");
  says(TimeFunction::step5(1, 0, 1, 1), "t = 1 to t = 1");
  says(TimeFunction::step5(2, 0, 1, 1), "end after it begins");
  says(TimeFunction::step5(0, kNaN, 1, 1), "finite");
  says(TimeFunction::spline({0, 1, 2}, {0, 1}), "3 times and 2 values");
  says(TimeFunction::spline({}, {}), "0 points");
  says(TimeFunction::spline({1}, {1}), "1 point needs");
  says(TimeFunction::spline({0, 2, 1.5}, {0, 1, 2}), "2 is followed by 1.5");
  says(TimeFunction::spline({0, 1, 1}, {0, 1, 2}), "1 is followed by 1");
  says(TimeFunction::spline({0, 1, kNaN}, {0, 1, 2}), "finite");
  says(TimeFunction::spline({0, 1e-310, 2e-310}, {0, 1, 0}), "too close");
  says(TimeFunction::formula(std::function<Formula(const Formula &)>()), "empty");
  says(TimeFunction::values({}), "empty");
}

/* A value that is NaN is passed on, not hidden */
TEST(TimeFunctions, NotANumberPassesThrough)
{
  for (const TimeFunction &f : {TimeFunction::polynomial({1, 2}), TimeFunction::harmonic(1, 1),
                                TimeFunction::step5(0, 0, 1, 1), TimeFunction::spline({0, 1, 2}, {0, 1, 0})})
    EXPECT_TRUE(std::isnan(f(kNaN).f));
  const TimeFunction late = TimeFunction::formula([](const Formula &t) -> Formula { return log(1.0 - t); });
  EXPECT_TRUE(std::isfinite(late(.5).f));
  EXPECT_TRUE(std::isnan(late(2).f));
}
