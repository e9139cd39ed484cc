/*
  Numbers with derivatives (automatic differentiation, forward mode). They can be copied, stored and returned like doubles, and mixed with
  doubles and integers.

    Dual<N>             a value and N first derivatives
    Dual<N, Dual<N>>    second derivatives as well: x.derivatives()(a).derivatives()(b)
    Real                up to 16 derivatives, their number known at run time: arguments of users' expressions

  Available: arithmetic, comparisons (of the values only), sin cos tan asin acos atan atan2 sinh cosh tanh exp log log10 pow sqrt cbrt hypot
  abs fabs min max. Any other function of x is chain(x, f, f1), with its value f and derivative f1 at x.value().

  Values are those of the functions of <cmath>. At points where a function has no derivative, or no finite one, the derivative is:
    sqrt, cbrt, log and pow at 0, asin and acos at +-1   infinite as their limits
    abs at 0, hypot at the origin                        0, the mean of both sides
    atan2 at the origin                                  not a number
    min and max of equal values                          that of the first argument
  A component of the derivative that is exactly 0 in the argument is 0 in the result, even there: sqrt(x*x) at 0 has derivative 0.
    pow(x, p)   with a constant p is defined at x < 0 for integer p, at x = 0 with derivative p 0^(p-1), and is 1 for p = 0
    pow(x, y)   with a variable y: d/dy = x^y log x; it is 0 at x = 0 for y > 0, and not a number at x < 0
*/
#ifndef HHTDAE_DUAL_H
#define HHTDAE_DUAL_H

#include <cmath>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace hhtdae
{

/* The value as a double, without derivatives of any level */
inline double Plain(double x) { return x; }
template <class D, class = typename D::Value> double Plain(const D &x) { return Plain(x.value()); }

/*
  Operations of both kinds of numbers, Dual and Real. D is the kind; it has value(), of type Value, and

    D::linear(f, x, a)         value f, derivatives a x'
    D::linear(f, x, a, y, b)   value f, derivatives a x' + b y'

  Argument-dependent lookup finds the functions; they are not templates, so that overload resolution prefers them to std::min and std::max.
*/
template <class D, class V> class DualFunctions
{
public:
  using Value = V;

  friend D operator+(const D &x) { return x; }
  friend D operator-(const D &x) { return D::linear(-x.value(), x, -1.0); }
  friend D operator*(const D &x, const D &y) { return D::linear(x.value() * y.value(), x, y.value(), y, x.value()); }
  friend D operator/(const D &x, const D &y)
  {
    const V inverse = 1.0 / y.value(), q = x.value() / y.value();
    return D::linear(q, x, inverse, y, -(q * inverse));
  }
  friend D operator+(const D &x, double a) { return x.withValue(x.value() + a); }
  friend D operator+(double a, const D &x) { return x.withValue(a + x.value()); }
  friend D operator-(const D &x, double a) { return x.withValue(x.value() - a); }
  friend D operator-(double a, const D &x) { return D::linear(a - x.value(), x, -1.0); }
  friend D operator*(const D &x, double a) { return D::linear(x.value() * a, x, a); }
  friend D operator*(double a, const D &x) { return D::linear(a * x.value(), x, a); }
  friend D operator/(const D &x, double a) { return D::linear(x.value() / a, x, 1 / a); }
  friend D operator/(double a, const D &x)
  {
    const V q = a / x.value();
    return D::linear(q, x, -q / x.value());
  }

  friend D &operator*=(D &x, const D &y) { return x = x * y; }
  friend D &operator/=(D &x, const D &y) { return x = x / y; }
  friend D &operator*=(D &x, double a) { return x = x * a; }
  friend D &operator/=(D &x, double a) { return x = x / a; }

  friend bool operator==(const D &x, const D &y) { return Plain(x) == Plain(y); }
  friend bool operator!=(const D &x, const D &y) { return Plain(x) != Plain(y); }
  friend bool operator<(const D &x, const D &y) { return Plain(x) < Plain(y); }
  friend bool operator>(const D &x, const D &y) { return Plain(x) > Plain(y); }
  friend bool operator<=(const D &x, const D &y) { return Plain(x) <= Plain(y); }
  friend bool operator>=(const D &x, const D &y) { return Plain(x) >= Plain(y); }

  /* f(x) from value f and derivative f1 at x.value(); f(x, y) from value f and partial derivatives fx, fy */
  friend D chain(const D &x, const V &f, const V &f1)
  {
    return finite(f1) ? D::linear(f, x, f1) : D::linear(f, x, Steep{f1});
  }
  friend D chain(const D &x, const V &fx, const D &y, const V &fy, const V &f)
  {
    return finite(fx) && finite(fy) ? D::linear(f, x, fx, y, fy) : D::linear(f, x, Steep{fx}, y, Steep{fy});
  }

  friend D sin(const D &x)
  {
    using std::cos;
    using std::sin;
    return chain(x, sin(x.value()), cos(x.value()));
  }
  friend D cos(const D &x)
  {
    using std::cos;
    using std::sin;
    return chain(x, cos(x.value()), -sin(x.value()));
  }
  friend D tan(const D &x)
  {
    using std::tan;
    const V t = tan(x.value());
    return chain(x, t, 1.0 + t * t);
  }
  friend D asin(const D &x)
  {
    using std::asin;
    using std::sqrt;
    return chain(x, asin(x.value()), 1.0 / sqrt((1.0 - x.value()) * (1.0 + x.value())));
  }
  friend D acos(const D &x)
  {
    using std::acos;
    using std::sqrt;
    return chain(x, acos(x.value()), -1.0 / sqrt((1.0 - x.value()) * (1.0 + x.value())));
  }
  friend D atan(const D &x)
  {
    using std::atan;
    return chain(x, atan(x.value()), 1.0 / (1.0 + x.value() * x.value()));
  }
  friend D atan2(const D &y, const D &x)
  {
    using std::atan2;
    const V r2 = y.value() * y.value() + x.value() * x.value();
    return chain(y, x.value() / r2, x, -y.value() / r2, atan2(y.value(), x.value()));
  }
  friend D sinh(const D &x)
  {
    using std::cosh;
    using std::sinh;
    return chain(x, sinh(x.value()), cosh(x.value()));
  }
  friend D cosh(const D &x)
  {
    using std::cosh;
    using std::sinh;
    return chain(x, cosh(x.value()), sinh(x.value()));
  }
  friend D tanh(const D &x)
  {
    using std::tanh;
    const V t = tanh(x.value());
    return chain(x, t, (1.0 - t) * (1.0 + t));
  }
  friend D exp(const D &x)
  {
    using std::exp;
    const V e = exp(x.value());
    return chain(x, e, e);
  }
  friend D log(const D &x)
  {
    using std::log;
    return chain(x, log(x.value()), 1.0 / x.value());
  }
  friend D log10(const D &x)
  {
    using std::log10;
    return chain(x, log10(x.value()), 0.43429448190325182765 / x.value());
  }
  friend D sqrt(const D &x)
  {
    using std::sqrt;
    const V root = sqrt(x.value());
    return chain(x, root, 0.5 / root);
  }
  friend D cbrt(const D &x)
  {
    using std::cbrt;
    const V root = cbrt(x.value());
    return chain(x, root, (1. / 3) / (root * root));
  }
  friend D hypot(const D &x, const D &y)
  {
    using std::hypot;
    const V r = hypot(x.value(), y.value());
    if (r == 0) return chain(x, V(0), y, V(0), r);
    return chain(x, x.value() / r, y, y.value() / r, r);
  }
  friend D abs(const D &x)
  {
    using std::abs;
    return chain(x, abs(x.value()), V((x > 0) - (x < 0)));
  }
  friend D fabs(const D &x) { return abs(x); }
  friend D min(const D &x, const D &y) { return y < x ? y : x; }
  friend D max(const D &x, const D &y) { return x < y ? y : x; }

  friend D pow(const D &x, double p)
  {
    using std::pow;
    return p == 0 ? chain(x, V(1), V(0)) : chain(x, pow(x.value(), p), p * pow(x.value(), p - 1));
  }
  friend D pow(double a, const D &y)
  {
    using std::log;
    using std::pow;
    const V f = pow(a, y.value());
    return chain(y, f, a == 0 && y > 0 ? V(0) : V(f * log(a)));
  }
  friend D pow(const D &x, const D &y)
  {
    using std::log;
    using std::pow;
    const V f = pow(x.value(), y.value());
    const V by_x = y == 0 ? V(0) : V(y.value() * pow(x.value(), y.value() - 1.0));
    return chain(x, by_x, y, x == 0 && y > 0 ? V(0) : V(f * log(x.value())), f);
  }

protected:
  /* A factor that is not finite; its product with zero is defined as zero */
  struct Steep {
    V factor;
    V operator*(const V &x) const { return product(factor, x); }
  };
  static bool finite(double x) { return std::isfinite(x); }
  template <class T> static bool finite(const T &x)
  {
    bool all = finite(x.value());
    for (int k = 0; k < x.derivatives().size(); k++) all = all && finite(x.derivatives()(k));
    return all;
  }
  static double product(double steep, double x) { return x == 0 ? 0 : steep * x; }
  template <class T> static T product(const T &steep, const T &x)
  {
    T r(product(steep.value(), x.value()));
    for (int k = 0; k < r.derivatives().size(); k++)
      r.derivatives()(k) = product(steep.value(), x.derivatives()(k)) + product(steep.derivatives()(k), x.value());
    return r;
  }
};

template <int N, class T = double> class Dual : public DualFunctions<Dual<N, T>, T>
{
  static_assert(N > 0, "a number with derivatives has at least one");

public:
  struct Derivatives {
    T x[N];

    static constexpr int size() { return N; }
    const T             *data() const { return x; }
    T                   &operator()(int k) { return x[k]; }
    const T             &operator()(int k) const { return x[k]; }
    T                   &operator[](int k) { return x[k]; }
    const T             &operator[](int k) const { return x[k]; }
  };

  Dual() = default; /* uninitialized, like a double */
  template <class S, std::enable_if_t<std::is_arithmetic<S>::value || std::is_same<S, T>::value, int> = 0>
  Dual(const S &constant) : d_{}, value_(constant)
  {
  }
  explicit Dual(const T &value, int k) : d_{}, value_(value) { d_.x[k] = T(1); } /* variable k */

  T                 &value() { return value_; }
  const T           &value() const { return value_; }
  Derivatives       &derivatives() { return d_; }
  const Derivatives &derivatives() const { return d_; }

  Dual &operator+=(const Dual &y)
  {
    value_ += y.value_;
    for (int k = 0; k < N; k++) d_.x[k] += y.d_.x[k];
    return *this;
  }
  Dual &operator-=(const Dual &y)
  {
    value_ -= y.value_;
    for (int k = 0; k < N; k++) d_.x[k] -= y.d_.x[k];
    return *this;
  }
  friend Dual operator+(const Dual &x, const Dual &y)
  {
    Dual r;
    r.value_ = x.value_ + y.value_;
    for (int k = 0; k < N; k++) r.d_.x[k] = x.d_.x[k] + y.d_.x[k];
    return r;
  }
  friend Dual operator-(const Dual &x, const Dual &y)
  {
    Dual r;
    r.value_ = x.value_ - y.value_;
    for (int k = 0; k < N; k++) r.d_.x[k] = x.d_.x[k] - y.d_.x[k];
    return r;
  }

  Dual withValue(const T &value) const
  {
    Dual r   = *this;
    r.value_ = value;
    return r;
  }
  template <class A> static Dual linear(const T &value, const Dual &x, const A &a)
  {
    Dual r;
    r.value_ = value;
    for (int k = 0; k < N; k++) r.d_.x[k] = a * x.d_.x[k];
    return r;
  }
  template <class A> static Dual linear(const T &value, const Dual &x, const A &a, const Dual &y, const A &b)
  {
    Dual r;
    r.value_ = value;
    for (int k = 0; k < N; k++) r.d_.x[k] = a * x.d_.x[k] + b * y.d_.x[k];
    return r;
  }

private:
  Derivatives d_;
  T           value_;
};

/* A Real without derivatives is a constant and combines with all others. Two Reals with different numbers of derivatives cannot be combined. */
class Real : public DualFunctions<Real, double>
{
public:
  static constexpr int most = 16;

  class Derivatives
  {
  public:
    int           size() const { return n_; }
    const double *data() const { return x_; }
    double       &operator()(int k) { return x_[k]; }
    double        operator()(int k) const { return x_[k]; }
    double       &operator[](int k) { return x_[k]; }
    double        operator[](int k) const { return x_[k]; }

  private:
    friend Real;
    int    n_ = 0;
    double x_[most];
  };

  Real() : value_(0) {}
  template <class S, std::enable_if_t<std::is_arithmetic<S>::value, int> = 0> Real(S constant) : value_(constant) {}
  /* variable k of n; n = 0: a constant */
  Real(double value, int n, int k) : value_(value)
  {
    if (n < 0 || n > most || k < 0 || (n > 0 && k >= n))
      throw std::invalid_argument("variable " + std::to_string(k) + " of " + std::to_string(n) + ": there may be 16, from 0 on");
    d_.n_ = n;
    for (int l = 0; l < n; l++) d_.x_[l] = l == k;
  }

  double            &value() { return value_; }
  double             value() const { return value_; }
  Derivatives       &derivatives() { return d_; }
  const Derivatives &derivatives() const { return d_; }

  Real       &operator+=(const Real &y) { return *this = *this + y; }
  Real       &operator-=(const Real &y) { return *this = *this - y; }
  friend Real operator+(const Real &x, const Real &y) { return linear(x.value_ + y.value_, x, 1.0, y, 1.0); }
  friend Real operator-(const Real &x, const Real &y) { return linear(x.value_ - y.value_, x, 1.0, y, -1.0); }

  Real withValue(double value) const
  {
    Real r   = *this;
    r.value_ = value;
    return r;
  }
  template <class A> static Real linear(double value, const Real &x, const A &a)
  {
    Real r(value);
    r.d_.n_ = x.d_.n_;
    for (int k = 0; k < r.d_.n_; k++) r.d_.x_[k] = a * x.d_.x_[k];
    return r;
  }
  template <class A> static Real linear(double value, const Real &x, const A &a, const Real &y, const A &b)
  {
    if (y.d_.n_ == 0) return linear(value, x, a);
    if (x.d_.n_ == 0) return linear(value, y, b);
    if (x.d_.n_ != y.d_.n_) mixed(x.d_.n_, y.d_.n_);
    Real r(value);
    r.d_.n_ = x.d_.n_;
    for (int k = 0; k < r.d_.n_; k++) r.d_.x_[k] = a * x.d_.x_[k] + b * y.d_.x_[k];
    return r;
  }

private:
  Derivatives d_;
  double      value_;

  [[noreturn]] static void mixed(int n, int m)
  {
    throw std::invalid_argument("a number with " + std::to_string(n) + " derivatives was combined with one with " + std::to_string(m) +
                                "; a number of another call may have been kept");
  }
};

} // namespace hhtdae

#endif
