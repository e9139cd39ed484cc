/* Numbers with derivatives: every function against differences, behaviour where a function has no derivative, and
   independence of their operands */
#include "hhtdae/dual.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

using namespace hhtdae;

namespace
{

const double kInf = std::numeric_limits<double>::infinity();

double near(double x) { return 1e-8 * (1 + std::abs(x)); }

/* Checks a generic function f of one number at x: values equal those of doubles, f' for all kinds of numbers and f''
   against differences */
template <class F> void ExpectDerivatives(const char *name, F f, std::initializer_list<double> points)
{
  using Second = Dual<1, Dual<1>>;
  for (double x : points) {
    SCOPED_TRACE(testing::Message() << name << " at " << x);
    const double  d    = 1e-5;
    const double  f1   = (f(x + d) - f(x - d)) / (2 * d);
    const auto    at   = [&](double z) { return f(Second(Dual<1>(z, 0), 0)); };
    const Second  y    = at(x);
    const double  f2   = (at(x + d).value().derivatives()(0) - at(x - d).value().derivatives()(0)) / (2 * d);
    const Dual<3> three = f(Dual<3>(x, 1));
    const Real    real  = f(Real(x, 4, 2));
    EXPECT_EQ(three.value(), f(x));
    EXPECT_EQ(real.value(), f(x));
    EXPECT_EQ(y.value().value(), f(x));
    EXPECT_NEAR(three.derivatives()(1), f1, near(f1));
    EXPECT_EQ(three.derivatives()(0), 0);
    EXPECT_EQ(three.derivatives()(2), 0);
    ASSERT_EQ(real.derivatives().size(), 4);
    EXPECT_EQ(real.derivatives()(2), three.derivatives()(1));
    EXPECT_EQ(real.derivatives()(0), 0);
    EXPECT_EQ(y.value().derivatives()(0), y.derivatives()(0).value());
    EXPECT_NEAR(y.derivatives()(0).value(), f1, near(f1));
    EXPECT_NEAR(y.derivatives()(0).derivatives()(0), f2, near(f2));
  }
}

/* First derivative of a number that may be a constant, which has no storage for derivatives */
double slope(const Real &x) { return x.derivatives().size() ? x.derivatives()(0) : 0.; }

/* f(x, y): gradient and mixed second derivatives */
template <class F> void ExpectGradient(const char *name, F f, double x, double y)
{
  SCOPED_TRACE(testing::Message() << name << " at " << x << ", " << y);
  using First     = Dual<2>;
  using Second    = Dual<2, Dual<2>>;
  const double d  = 1e-5;
  const auto   at = [&](double a, double b) { return f(First(a, 0), First(b, 1)); };
  const double f1[2] = {(f(x + d, y) - f(x - d, y)) / (2 * d), (f(x, y + d) - f(x, y - d)) / (2 * d)};
  const First  ends[2][2] = {{at(x - d, y), at(x + d, y)}, {at(x, y - d), at(x, y + d)}};
  const First  z          = at(x, y);
  const Real   real       = f(Real(x, 2, 0), Real(y, 2, 1));
  const Second w          = f(Second(First(x, 0), 0), Second(First(y, 1), 1));
  EXPECT_EQ(z.value(), f(x, y));
  for (int a = 0; a < 2; a++) {
    EXPECT_NEAR(z.derivatives()(a), f1[a], near(f1[a]));
    EXPECT_EQ(real.derivatives()(a), z.derivatives()(a));
    for (int b = 0; b < 2; b++) {
      const double f2 = (ends[b][1].derivatives()(a) - ends[b][0].derivatives()(a)) / (2 * d);
      EXPECT_NEAR(w.derivatives()(a).derivatives()(b), f2, near(f2)) << a << b;
    }
  }
  /* one of the arguments is a plain number */
  EXPECT_NEAR(f(First(x, 0), y).derivatives()(0), f1[0], near(f1[0]));
  EXPECT_NEAR(f(x, First(y, 1)).derivatives()(1), f1[1], near(f1[1]));
  EXPECT_NEAR(slope(f(Real(x, 1, 0), y)), f1[0], near(f1[0]));
  EXPECT_NEAR(slope(f(x, Real(y, 1, 0))), f1[1], near(f1[1]));
  EXPECT_NEAR(slope(f(Real(x, 1, 0), Real(y))), f1[0], near(f1[0]));
}

using std::abs, std::acos, std::asin, std::atan, std::atan2, std::cbrt, std::cos, std::cosh, std::exp, std::fabs, std::hypot, std::log,
    std::log10, std::max, std::min, std::pow, std::sin, std::sinh, std::sqrt, std::tan, std::tanh;

} // namespace

TEST(DualNumbers, FunctionsOfOneArgument)
{
#define EXPECT_DERIVATIVES(f, ...) ExpectDerivatives(#f, [](auto x) { return f(x); }, __VA_ARGS__)
  EXPECT_DERIVATIVES(sin, {-2., 0., .3, 1.5, 7.});
  EXPECT_DERIVATIVES(cos, {-2., 0., .3, 1.5, 7.});
  EXPECT_DERIVATIVES(tan, {-1., 0., .3, 4.});
  EXPECT_DERIVATIVES(asin, {-.8, 0., .3});
  EXPECT_DERIVATIVES(acos, {-.8, 0., .3});
  EXPECT_DERIVATIVES(atan, {-3., 0., .3, 5.});
  EXPECT_DERIVATIVES(sinh, {-3., 0., .3});
  EXPECT_DERIVATIVES(cosh, {-3., 0., .3});
  EXPECT_DERIVATIVES(tanh, {-3., 0., .3, 9.});
  EXPECT_DERIVATIVES(exp, {-3., 0., .3});
  EXPECT_DERIVATIVES(log, {.3, 1., 20.});
  EXPECT_DERIVATIVES(log10, {.3, 1., 20.});
  EXPECT_DERIVATIVES(sqrt, {.3, 1., 20.});
  EXPECT_DERIVATIVES(cbrt, {-8., .3, 1., 20.});
  EXPECT_DERIVATIVES(abs, {-8., .3});
  EXPECT_DERIVATIVES(fabs, {-8., .3});
#undef EXPECT_DERIVATIVES
}

TEST(DualNumbers, FunctionsOfTwoArguments)
{
  const double points[][2] = {{.7, 2.1}, {3, -1.3}, {1.2, .4}};
  for (const auto &p : points) {
    ExpectGradient("sum", [](auto x, auto y) { return x + y; }, p[0], p[1]);
    ExpectGradient("difference", [](auto x, auto y) { return x - y; }, p[0], p[1]);
    ExpectGradient("product", [](auto x, auto y) { return x * y; }, p[0], p[1]);
    ExpectGradient("quotient", [](auto x, auto y) { return x / y; }, p[0], p[1]);
    ExpectGradient("atan2", [](auto x, auto y) { return atan2(x, y); }, p[0], p[1]);
    ExpectGradient("atan2", [](auto x, auto y) { return atan2(y, x); }, -p[0], p[1]);
    ExpectGradient("pow", [](auto x, auto y) { return pow(x, y); }, p[0], p[1]);
    ExpectGradient("hypot", [](auto x, auto y) { return hypot(x, y); }, p[0], p[1]);
    ExpectGradient("min", [](auto x, auto y) { return min<decltype(x + y)>(x, y); }, p[0], p[1]);
    ExpectGradient("max", [](auto x, auto y) { return max<decltype(x + y)>(x, y); }, p[0], p[1]);
  }
}

TEST(DualNumbers, AssignmentsAndMixedArithmetic)
{
  const auto f = [](auto x) {
    auto y = 3 * x - 1;
    y += x;
    y -= 2;
    y *= x + 4L;
    y /= 1 + x * x;
    y *= 2;
    y /= 4.f;
    y += 1;
    return -(2 - y) / 3 + 1 / (+y * 7.0 + 5) - pow(x, 3) + pow(2, x) + pow(x, -2) + x / 2;
  };
  ExpectDerivatives("mixed", f, {.4, 1., 2.5});
}

TEST(DualNumbers, MinAndMaxNextToThoseOfTheStandardLibrary)
{
  const Dual<1> x(2, 0);
  const Real    y(2, 1, 0);
  EXPECT_EQ(max(x, Dual<1>(3)).derivatives()(0), 0);
  EXPECT_EQ(max(x, 1.).derivatives()(0), 1);
  EXPECT_EQ(min(1, x).value(), 1);
  EXPECT_EQ(min(y, 3).derivatives()(0), 1);
  EXPECT_EQ(max(0., y).value(), 2);
  EXPECT_EQ(max(x, 2.).derivatives()(0), 1); /* for equal arguments that of the first one */
  EXPECT_EQ(max(2., x).derivatives()(0), 0);
  EXPECT_EQ(min(y, 2).derivatives()(0), 1);
}

template <class D> void ExpectComparisons(const D &x) /* 2 */
{
  EXPECT_TRUE(x < 3 && 1 < x && x < x + 1 && !(x < 2.));
  EXPECT_TRUE(x > 1. && 3 > x && x + 1 > x && !(x > x));
  EXPECT_TRUE(x <= 2 && 2 <= x && x <= x && !(x <= 1));
  EXPECT_TRUE(x >= 2 && 2 >= x && x >= x && !(x >= 3));
  EXPECT_TRUE(x == 2 && 2 == x && x == x + 0 && !(x == 3));
  EXPECT_TRUE(x != 3 && 3 != x && x != x + 1 && !(x != 2));
}

TEST(DualNumbers, ComparisonsLookAtValues)
{
  ExpectComparisons(Dual<2>(2, 1));
  ExpectComparisons(Dual<1, Dual<1>>(Dual<1>(2, 0), 0));
  ExpectComparisons(Real(2, 3, 1));
  EXPECT_TRUE(Dual<2>(2, 1) == Dual<2>(2, 0));
}

TEST(DualNumbers, AnyOtherFunctionByItsDerivative)
{
  const Dual<2> x(3, 0), y(5, 1), f = chain(2 * x, 7., .5), g = chain(x, 2., y, -3., 11.);
  EXPECT_EQ(f.value(), 7);
  EXPECT_EQ(f.derivatives()(0), 1);
  EXPECT_EQ(g.value(), 11);
  EXPECT_EQ(g.derivatives()(0), 2);
  EXPECT_EQ(g.derivatives()(1), -3);
  EXPECT_EQ(chain(Real(3, 2, 1), 7, .5).derivatives()(1), .5);
}

/* ---- points without a derivative, or with an infinite one; there a constant argument gives no derivative either ---- */

template <class F> double Slope(F f, double x)
{
  const Dual<2> y = f(Dual<2>(x, 0));
  const Real    z = f(Real(x, 2, 0));
  const double  none[2] = {y.derivatives()(1), z.derivatives()(1)};
  EXPECT_EQ(none[0], 0);
  EXPECT_EQ(none[1], 0);
  EXPECT_TRUE(y.derivatives()(0) == z.derivatives()(0) || std::isnan(z.derivatives()(0)));
  return y.derivatives()(0);
}

TEST(DualNumbers, InfiniteSlopes)
{
  EXPECT_EQ(Slope([](auto x) { return sqrt(x); }, 0), kInf);
  EXPECT_EQ(Slope([](auto x) { return cbrt(x); }, 0), kInf);
  EXPECT_EQ(Slope([](auto x) { return log(x); }, 0), kInf);
  EXPECT_EQ(Slope([](auto x) { return log10(x); }, 0), kInf);
  EXPECT_EQ(Slope([](auto x) { return asin(x); }, 1), kInf);
  EXPECT_EQ(Slope([](auto x) { return asin(x); }, -1), kInf);
  EXPECT_EQ(Slope([](auto x) { return acos(x); }, 1), -kInf);
  EXPECT_EQ(Slope([](auto x) { return acos(x); }, -1), -kInf);
  EXPECT_EQ(Slope([](auto x) { return pow(x, .5); }, 0), kInf);
  EXPECT_EQ(sqrt(Dual<1>(0, 0)).value(), 0);
  /* and the second derivatives of t -> sqrt(t), t^1.5 */
  const Dual<1, Dual<1>> t(Dual<1>(0, 0), 0);
  EXPECT_EQ(sqrt(t).derivatives()(0).derivatives()(0), -kInf);
  EXPECT_EQ(pow(t, 1.5).derivatives()(0).value(), 0);
  EXPECT_EQ(pow(t, 1.5).derivatives()(0).derivatives()(0), kInf);
}

TEST(DualNumbers, KinksHaveTheMeanOfBothSides)
{
  EXPECT_EQ(Slope([](auto x) { return abs(x); }, 0), 0);
  EXPECT_EQ(Slope([](auto x) { return sqrt(x * x); }, 0), 0);
  EXPECT_EQ(Slope([](auto x) { return hypot(x, 0); }, 0), 0);
  EXPECT_EQ(Slope([](auto x) { return hypot(x, x); }, 0), 0);
}

TEST(DualNumbers, NoDirectionAtTheOrigin)
{
  EXPECT_TRUE(std::isnan(Slope([](auto x) { return atan2(x, 0); }, 0)));
  EXPECT_TRUE(std::isnan(Slope([](auto x) { return atan2(0, x); }, 0)));
  EXPECT_EQ(atan2(Dual<1>(0.), Dual<1>(0.)).derivatives()(0), 0);
  EXPECT_EQ(atan2(Dual<1>(0, 0), 0.).value(), 0);
}

TEST(DualNumbers, Powers)
{
  EXPECT_EQ(Slope([](auto x) { return pow(x, 0); }, 0), 0);
  EXPECT_EQ(Slope([](auto x) { return pow(x, 1); }, 0), 1);
  EXPECT_EQ(Slope([](auto x) { return pow(x, 2); }, 0), 0);
  EXPECT_EQ(Slope([](auto x) { return pow(x, 2.5); }, 0), 0);
  EXPECT_EQ(Slope([](auto x) { return pow(x, -1); }, 0), -kInf);
  EXPECT_EQ(Slope([](auto x) { return pow(x, 0); }, -3), 0);
  EXPECT_EQ(Slope([](auto x) { return pow(x, 3); }, -2), 12);
  EXPECT_EQ(Slope([](auto x) { return pow(x, -1); }, -2), -.25);
  EXPECT_EQ(pow(Dual<1>(0, 0), 0).value(), 1);
  EXPECT_TRUE(std::isnan(pow(Dual<1>(-2, 0), .5).value()));
  EXPECT_TRUE(std::isnan(Slope([](auto x) { return pow(x, .5); }, -2)));
  /* An exponent that is a number with derivatives but does not change acts like a plain one */
  EXPECT_EQ(Slope([](auto x) { return pow(x, decltype(x)(3)); }, -2), 12);
  EXPECT_EQ(Slope([](auto x) { return pow(x, decltype(x)(2)); }, 0), 0);
  EXPECT_EQ(Slope([](auto x) { return pow(x, decltype(x)(0)); }, 0), 0);
  EXPECT_EQ(Slope([](auto y) { return pow(0, y); }, 2), 0);
  EXPECT_EQ(Slope([](auto y) { return pow(decltype(y)(0), y); }, 2), 0);
  EXPECT_TRUE(std::isnan(Slope([](auto y) { return pow(-2, y); }, 2)));
  EXPECT_EQ(pow(-2., Dual<1>(2, 0)).value(), 4);
}

/* ---- values ---- */

TEST(DualNumbers, TheyAreValues)
{
  static_assert(std::is_trivially_copyable<Dual<12>>::value && std::is_trivially_copyable<Real>::value, "copied as bytes");
  static_assert(sizeof(Dual<12>) == 13 * sizeof(double), "a plain array");
  static_assert(!std::is_convertible<Dual<2>, Dual<3>>::value && !std::is_convertible<Dual<2>, double>::value, "no silent loss");
  const auto law = [](const Real &l, const Real &v) { return 100 * l * l + 2 * v; }; /* the result is a number even without "-> Real" */
  static_assert(std::is_same<decltype(law(Real(), Real())), Real>::value, "not an expression");
  const auto kept = law(Real(2, 2, 0), Real(3, 2, 1));
  EXPECT_EQ(kept.value(), 406);
  EXPECT_EQ(kept.derivatives()(0), 400);
  EXPECT_EQ(kept.derivatives()(1), 2);
}

TEST(DualNumbers, ConstantsGoWithAllOthers)
{
  const Real x(3, 2, 1), one = 1, sum = x + one, product = one * x;
  EXPECT_EQ(one.derivatives().size(), 0);
  EXPECT_EQ((one * 2 + one).derivatives().size(), 0);
  EXPECT_EQ(sum.derivatives().size(), 2);
  EXPECT_EQ(sum.derivatives()(1), 1);
  EXPECT_EQ((one - x).derivatives()(1), -1);
  EXPECT_EQ(product.derivatives()(1), 1);
  EXPECT_EQ(Real().value(), 0);
}

TEST(DualNumbers, NumbersOfDifferentFunctionsDoNotMix)
{
  EXPECT_THROW(Real(1, 2, 0) * Real(1, 3, 0), std::invalid_argument);
  EXPECT_THROW(Real(1, 17, 0), std::invalid_argument);
  EXPECT_THROW(Real(1, 2, 2), std::invalid_argument);
  EXPECT_NO_THROW(Real(1, 16, 15));
}
