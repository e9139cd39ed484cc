/* Users' functions of time, with exact first and second derivatives. */
#include "hhtdae/functions.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace hhtdae
{

namespace
{

using Value = TimeFunction::Value;

bool Finite(const std::vector<double> &x)
{
  return std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); });
}

template <class... Parts> std::string Text(const Parts &...parts)
{
  std::ostringstream s;
  s.precision(12);
  (s << ... << parts);
  return s.str();
}

/* Horner's scheme, with derivatives */
Value Polynomial(const std::vector<double> &c, double t)
{
  Value v{0, 0, 0};
  for (size_t k = c.size(); k-- > 0;) {
    v.f2 = v.f2 * t + 2 * v.f1;
    v.f1 = v.f1 * t + v.f;
    v.f  = v.f * t + c[k];
  }
  return v;
}

/* d times the polynomial that steps from 0 to 1 on [0, 1], with derivatives */
Value Cubic(double s, double d) { return {d * s * s * (3 - 2 * s), d * 6 * s * (1 - s), d * (6 - 12 * s)}; }
Value Quintic(double s, double d)
{
  const double r = 1 - s;
  return {d * s * s * s * (10 + s * (6 * s - 15)), d * 30 * s * s * r * r, d * 60 * s * r * (r - s)};
}

/* Step from x0 before t0 to x1 after t1; NaN if t is NaN */
Value Step(Value (*shape)(double, double), double t, double t0, double x0, double t1, double x1)
{
  const double h = t1 - t0, s = (t - t0) / h;
  if (s <= 0) return {x0, 0, 0};
  if (s >= 1) return {x1, 0, 0};
  const Value p = shape(s, x1 - x0);
  return {x0 + p.f, p.f1 / h, p.f2 / (h * h)};
}

/* The same for a Real: step from h0 at x0 to h1 at x1. NaN unless x1 > x0; the start of the run reports such values. */
Real Step(Value (*shape)(double, double), const Real &x, double x0, double h0, double x1, double h1)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Value  y   = x1 > x0 ? Step(shape, x.value(), x0, h0, x1, h1) : Value{nan, nan, nan};
  return chain(x, y.f, y.f1);
}

/* What is wrong with the data of a step function, as text; empty if nothing */
std::string StepError(double t0, double x0, double t1, double x1)
{
  if (!Finite({t0, x0, t1, x1})) return "times and values of a step function must be finite";
  if (!(t1 > t0)) return Text("a step function from t = ", t0, " to t = ", t1, " must end after it begins");
  return "";
}

struct Spline {
  std::vector<double> t, x, m; /* knots and second derivatives there */

  /* Computes m from continuity of the first derivative with m_0 = m_n = 0, a diagonally dominant tridiagonal system */
  void solve()
  {
    const size_t        n = t.size();
    std::vector<double> upper(n, 0.0);
    m.assign(n, 0.0);
    for (size_t k = 1; k + 1 < n; k++) {
      const double h0 = t[k] - t[k - 1], h1 = t[k + 1] - t[k];
      const double jump  = (x[k + 1] - x[k]) / h1 - (x[k] - x[k - 1]) / h0;
      const double pivot = 2 * (h0 + h1) - h0 * upper[k - 1];
      upper[k]           = h1 / pivot;
      m[k]               = (6 * jump - h0 * m[k - 1]) / pivot;
    }
    for (size_t k = n - 1; k-- > 1;) m[k] -= upper[k] * m[k + 1];
  }

  Value inside(size_t k, double at) const /* between knots k and k + 1 */
  {
    const double h = t[k + 1] - t[k], a = (t[k + 1] - at) / h, b = (at - t[k]) / h;
    Value        v;
    v.f  = a * x[k] + b * x[k + 1] + ((a * a * a - a) * m[k] + (b * b * b - b) * m[k + 1]) * h * h / 6;
    v.f1 = (x[k + 1] - x[k]) / h + ((3 * b * b - 1) * m[k + 1] - (3 * a * a - 1) * m[k]) * h / 6;
    v.f2 = a * m[k] + b * m[k + 1];
    return v;
  }

  Value operator()(double at) const
  {
    const size_t last = t.size() - 1;
    if (at < t.front() || at > t.back()) {
      const bool   before = at < t.front();
      const double end    = before ? t.front() : t.back();
      Value        v      = inside(before ? 0 : last - 1, end);
      return {v.f + v.f1 * (at - end), v.f1, 0};
    }
    /* t[k-1] <= at < t[k]; if `at` is NaN, k is limited to the last interval below */
    const size_t k = std::upper_bound(t.begin(), t.end(), at) - t.begin();
    return inside(std::min(std::max(k, size_t(1)), last) - 1, at);
  }
};

} // namespace

TimeFunction::TimeFunction(double constant) : constant_(constant)
{
  if (!std::isfinite(constant)) error_ = Text("the constant is ", constant, ", must be finite");
}

/* A function that stores an error, which setUp() reports; its values are NaN. */
TimeFunction TimeFunction::faulty(const std::string &error)
{
  TimeFunction g;
  g.constant_ = std::numeric_limits<double>::quiet_NaN();
  g.error_    = error;
  return g;
}

TimeFunction TimeFunction::polynomial(const std::vector<double> &c)
{
  if (c.empty()) return faulty("a polynomial needs at least one coefficient");
  if (!Finite(c)) return faulty("the polynomial's coefficients must be finite");
  if (c.size() == 1) return TimeFunction(c[0]);
  TimeFunction g;
  g.f_ = [c](double t) { return Polynomial(c, t); };
  return g;
}

TimeFunction TimeFunction::harmonic(double amplitude, double omega, double phase, double offset)
{
  if (!Finite({amplitude, omega, phase, offset}))
    return faulty(Text("amplitude ", amplitude, ", omega ", omega, ", phase ", phase, " and offset ", offset,
                       " of a harmonic function must be finite"));
  TimeFunction g;
  g.f_ = [=](double t) {
    const double s = amplitude * std::sin(omega * t + phase), c = amplitude * std::cos(omega * t + phase);
    return Value{offset + s, omega * c, -omega * omega * s};
  };
  return g;
}

TimeFunction TimeFunction::step(double t0, double x0, double t1, double x1)
{
  const std::string error = StepError(t0, x0, t1, x1);
  if (!error.empty()) return faulty(error);
  TimeFunction g;
  g.f_ = [=](double t) { return Step(Cubic, t, t0, x0, t1, x1); };
  return g;
}

TimeFunction TimeFunction::step5(double t0, double x0, double t1, double x1)
{
  const std::string error = StepError(t0, x0, t1, x1);
  if (!error.empty()) return faulty(error);
  TimeFunction g;
  g.f_ = [=](double t) { return Step(Quintic, t, t0, x0, t1, x1); };
  return g;
}

TimeFunction TimeFunction::spline(const std::vector<double> &t, const std::vector<double> &x)
{
  if (t.size() != x.size())
    return faulty(Text("a spline of ", t.size(), " times and ", x.size(), " values needs as many of both"));
  if (t.size() < 2)
    return faulty(Text("a spline of ", t.size(), t.size() == 1 ? " point" : " points", " needs at least two"));
  if (!Finite(t) || !Finite(x)) return faulty("times and values of a spline must be finite");
  for (size_t k = 1; k < t.size(); k++)
    if (!(t[k] > t[k - 1]))
      return faulty(Text("the spline's times must increase, but ", t[k - 1], " is followed by ", t[k]));
  Spline s{t, x, {}};
  s.solve();
  if (!Finite(s.m)) return faulty("the spline's times are too close to each other for its values");
  TimeFunction g;
  g.f_ = s;
  return g;
}

Real step(const Real &x, double x0, double h0, double x1, double h1) { return Step(Cubic, x, x0, h0, x1, h1); }
Real step5(const Real &x, double x0, double h0, double x1, double h1) { return Step(Quintic, x, x0, h0, x1, h1); }

TimeFunction TimeFunction::formula(std::function<Number(const Number &)> f)
{
  if (!f) return faulty("the formula is empty");
  TimeFunction g;
  g.f_ = [f](double t) {
    const Number y = f(Number(Dual<1>(t, 0), 0));
    return Value{y.value().value(), y.value().derivatives()(0), y.derivatives()(0).derivatives()(0)};
  };
  return g;
}

TimeFunction TimeFunction::values(std::function<Value(double)> f)
{
  if (!f) return faulty("the function is empty");
  TimeFunction g;
  g.f_ = std::move(f);
  return g;
}

} // namespace hhtdae
