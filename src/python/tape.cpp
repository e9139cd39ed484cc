#include "tape.h"
#include "bind.h"
#include <algorithm>
#include <cfloat>
#include <cmath>

namespace hhtdae
{
namespace python
{

namespace
{

using Number = TimeFunction::Number;

/* The value of a table, or its first or second derivative, at x */
double At(const TimeFunction &f, double x, int derivative)
{
  const TimeFunction::Value y = f(x);
  return derivative == 0 ? y.f : derivative == 1 ? y.f1 : y.f2;
}
Real At(const TimeFunction &f, const Real &x, int derivative)
{
  if (derivative > 1) throw std::runtime_error("the third derivative of a table is not known");
  const TimeFunction::Value y = f(x.value());
  return derivative ? chain(x, y.f1, y.f2) : chain(x, y.f, y.f1);
}
Number At(const TimeFunction &f, const Number &x, int derivative)
{
  if (derivative) throw std::runtime_error("the derivative of a table is no function of time here");
  const TimeFunction::Value y = f(x.value().value());
  return chain(x, chain(x.value(), y.f, y.f1), chain(x.value(), y.f1, y.f2));
}

py::tuple Pack(const std::vector<double> &x)
{
  py::tuple t(x.size());
  for (std::size_t k = 0; k < x.size(); k++) t[k] = x[k];
  return t;
}

double ValueOf(const Tape::Function &f, const std::vector<double> &x)
{
  py::gil_scoped_acquire gil;
  try {
    return Call(f.value, Pack(x)).cast<double>();
  } catch (const py::cast_error &) {
    throw std::runtime_error("the Python function did not return a number");
  }
}

/* Central differences over at most `steps_tried` steps, each shorter than the one before by the factor `shorter`: from
   6e-6 of the argument (or of 1) to 4.5e-14 of it. An argument may be very small in its unit, such as micrometres in
   metres, so that the first step may be longer than the whole range in which the function varies. Test:
   Operations.test_differences of test_expressions.py. */
constexpr int    steps_tried = 10;
constexpr double shorter     = 8;
/* relative difference of two successive results that ends the search: sufficient for the Newton matrix and for the
   directions of reactions */
constexpr double agreement   = 1e-6;
constexpr double noisy       = 0.1;  /* once the relative difference of two results is below this, larger ones at shorter steps are caused by noise */

struct Difference {
  double slope, bend, change, size, h; /* (f+ - f-) / 2h; f+ - 2 f + f-; |f+ - f-|; the largest |f|; h */
};

Difference DifferenceOf(const Tape::Function &f, std::vector<double> &x, std::size_t k, double y, double h)
{
  const double at = x[k], above = at + h, below = at - h;
  x[k]            = above;
  const double up = ValueOf(f, x);
  x[k]            = below;
  const double down = ValueOf(f, x);
  x[k]              = at;
  return {(up - down) / (above - below), up - 2 * y + down, std::abs(up - down), std::max({std::abs(up), std::abs(down), std::abs(y)}), 0.5 * (above - below)};
}

/* Whether a, and b over a shorter step, agree up to rounding. If f has a short hump between the four points, both slopes
   may be zero and agree by chance. Therefore the second difference `bend` must also decrease: with this ratio of steps it
   decreases by a factor of 64 if f is smooth, and of 8 at a kink. */
bool Agree(const Difference &a, const Difference &b)
{
  const double rounding = 8 * DBL_EPSILON * std::max(a.size, b.size);
  return std::abs(a.slope - b.slope) <= std::max(rounding / b.h, agreement * std::abs(b.slope)) &&
         std::abs(b.bend) <= std::max({std::abs(a.bend) / 4, 8 * rounding, 1e-3 * b.change});
}

/* The derivative of f by its argument k, where f(x) = y: the difference over the longest step that agrees with the next
   one. If none does, because f is noisy or has a singularity, that of the two successive steps whose results differ
   least: the truncation error decreases with the step, while the effect of noise increases. */
double SlopeOf(const Tape::Function &f, std::vector<double> &x, std::size_t k, double y)
{
  double     h = std::cbrt(DBL_EPSILON) * std::max(1.0, std::abs(x[k])), best = 0, least = -1, before[2] = {0, 0};
  Difference a = DifferenceOf(f, x, k, y, h);
  for (int n = 1; n < steps_tried; n++) {
    h /= shorter;
    const Difference b = DifferenceOf(f, x, k, y, h);
    if (Agree(a, b)) return a.slope;
    const double apart = std::abs(a.slope - b.slope), relative = apart / std::max(std::abs(a.slope), std::abs(b.slope));
    if (least < 0 ? apart == apart : apart < least) {
      least = apart;
      best  = a.slope;
    }
    if (n > 2 && before[0] < noisy && before[0] < before[1] && before[1] < relative) break;
    before[0] = before[1];
    before[1] = relative;
    a         = b;
  }
  return least < 0 ? a.slope : best;
}

/* The gradient of f at x, where f(x) = y, from the user's gradient function or else by differences; needed: the arguments
   on which the derivatives of the formula depend */
std::vector<double> GradientOf(const Tape::Function &f, std::vector<double> x, double y, const std::vector<bool> &needed)
{
  py::gil_scoped_acquire gil;
  std::vector<double>    g(x.size());
  if (f.gradient != Py_None) {
    const Array a = ToArray(Call(f.gradient, Pack(x)), "the gradient that a Python function returned");
    if (a.size() != (py::ssize_t)g.size())
      throw std::runtime_error("the gradient has " + std::to_string(a.size()) + " numbers for " + std::to_string(g.size()) + " arguments");
    std::copy(a.data(), a.data() + g.size(), g.begin());
    return g;
  }
  for (std::size_t k = 0; k < x.size(); k++)
    if (needed[k]) g[k] = SlopeOf(f, x, k, y);
  return g;
}

double Apply(const Tape::Function &f, const std::vector<double> &x)
{
  std::vector<double> v;
  for (int k : f.operands) v.push_back(x[k]);
  return ValueOf(f, v);
}
Real Apply(const Tape::Function &f, const std::vector<Real> &x)
{
  std::vector<double> v;
  std::vector<bool>   needed;
  bool                constant = true;
  for (int k : f.operands) {
    v.push_back(x[k].value());
    needed.push_back(x[k].derivatives().size() != 0);
    constant = constant && !needed.back();
  }
  Real y(ValueOf(f, v));
  if (constant) return y;
  const std::vector<double> g = GradientOf(f, v, y.value(), needed);
  for (std::size_t k = 0; k < v.size(); k++)
    if (needed[k]) y += (x[f.operands[k]] - v[k]) * g[k];
  return y;
}
Number Apply(const Tape::Function &, const std::vector<Number> &)
{
  throw std::runtime_error("a Python function in a function of time has no derivatives: give them with hhtdae.time_values()");
}

/* Work memory of a thread, reused by its evaluations. Nested evaluations have separate memory, since a callback may
   evaluate this tape or another one, in another run */
template <class N> class Lent
{
public:
  std::vector<N> x;

  explicit Lent(std::size_t n)
  {
    x.swap(spare());
    if (x.size() < n) x.resize(n);
  }
  ~Lent() { x.swap(spare()); }
  Lent(const Lent &) = delete;

private:
  static std::vector<N> &spare()
  {
    static thread_local std::vector<N> x;
    return x;
  }
};

} // namespace

/* Every operation is evaluated, including both branches of `where`, which selects one value, so that the other one may be NaN. */
template <class N> void Tape::run(const N *u, std::vector<N> &x) const
{
  using std::abs, std::acos, std::asin, std::atan, std::atan2, std::cbrt, std::cos, std::cosh, std::exp, std::hypot, std::log, std::log10, std::max,
    std::min, std::pow, std::sin, std::sinh, std::sqrt, std::tan, std::tanh;
  for (std::size_t k = 0; k < operations.size(); k++) {
    const Operation &o = operations[k];
    const N         &a = x[o.a], &b = x[o.b];
    switch (o.code) {
    case op_constant: x[k] = N(constants[o.c]); break;
    case op_argument: x[k] = u[o.c]; break;
    case op_parameter: x[k] = N(parameters[o.c].value()); break;
    case op_add: x[k] = a + b; break;
    case op_subtract: x[k] = a - b; break;
    case op_multiply: x[k] = a * b; break;
    case op_divide: x[k] = a / b; break;
    case op_negate: x[k] = -a; break;
    case op_power: x[k] = operations[o.b].code == op_constant ? N(pow(a, constants[operations[o.b].c])) : N(pow(a, b)); break;
    case op_sin: x[k] = sin(a); break;
    case op_cos: x[k] = cos(a); break;
    case op_tan: x[k] = tan(a); break;
    case op_asin: x[k] = asin(a); break;
    case op_acos: x[k] = acos(a); break;
    case op_atan: x[k] = atan(a); break;
    case op_atan2: x[k] = atan2(a, b); break;
    case op_sinh: x[k] = sinh(a); break;
    case op_cosh: x[k] = cosh(a); break;
    case op_tanh: x[k] = tanh(a); break;
    case op_exp: x[k] = exp(a); break;
    case op_log: x[k] = log(a); break;
    case op_log10: x[k] = log10(a); break;
    case op_sqrt: x[k] = sqrt(a); break;
    case op_cbrt: x[k] = cbrt(a); break;
    case op_hypot: x[k] = hypot(a, b); break;
    case op_abs: x[k] = abs(a); break;
    case op_minimum: x[k] = N(min(a, b)); break;
    case op_maximum: x[k] = N(max(a, b)); break;
    case op_less: x[k] = N(Plain(a) < Plain(b) ? 1. : 0.); break;
    case op_less_equal: x[k] = N(Plain(a) <= Plain(b) ? 1. : 0.); break;
    case op_equal: x[k] = N(Plain(a) == Plain(b) ? 1. : 0.); break;
    case op_logical_and: x[k] = N(Plain(a) != 0 && Plain(b) != 0 ? 1. : 0.); break;
    case op_logical_or: x[k] = N(Plain(a) != 0 || Plain(b) != 0 ? 1. : 0.); break;
    case op_logical_not: x[k] = N(Plain(a) == 0 ? 1. : 0.); break;
    case op_where: x[k] = Plain(a) != 0 ? b : x[o.c]; break;
    case op_table: x[k] = At(tables[o.c], a, 0); break;
    case op_table_rate: x[k] = At(tables[o.c], a, 1); break;
    case op_table_curvature: x[k] = At(tables[o.c], a, 2); break;
    case op_function: x[k] = Apply(functions[o.c], x); break;
    }
  }
}

template <class N> N Tape::run(const N *u) const
{
  Lent<N> lent(operations.size());
  run(u, lent.x);
  return lent.x[outputs[0]];
}

void Tape::evaluate(const double *u, double *out) const
{
  Lent<double> lent(operations.size());
  run(u, lent.x);
  for (std::size_t k = 0; k < outputs.size(); k++) out[k] = lent.x[outputs[k]];
}

/* Residuals and channels need no derivatives and are evaluated with plain numbers, which need an eighth of the memory
   traffic of numbers with up to 16 derivatives. Channels may also have more than 16 arguments. */
Real Tape::operator()(const Real *u) const
{
  Lent<double> values(arguments);
  bool         constant = true;
  for (int k = 0; k < arguments; k++) {
    values.x[k] = u[k].value();
    constant    = constant && u[k].derivatives().size() == 0;
  }
  return constant ? Real(run(values.x.data())) : run(u);
}

Number Tape::operator()(const Number &t) const { return run(&t); }

} // namespace python
} // namespace hhtdae
