/*
  Double pendulum of two point masses in relative angles, theta_1 from the downward vertical and theta_2 from the first
  rod: no constraints, but a mass matrix that depends on q, which tells the two forms of the method apart.

    M11 = m (3 + 2 c) L^2, M12 = m (1 + c) L^2, M22 = m L^2,   c = cos theta_2     (equal masses m, equal lengths L)

  Reference: extrapolation of order 20 in long double. Halving its step changes the state at t = 1 by less than 1e-14.
*/
#ifndef HHTEX_DOUBLEPENDULUM_H
#define HHTEX_DOUBLEPENDULUM_H

#include "../problem.h"
#include "extrapolation.h"

namespace hhtex
{

struct DoublePendulum : Problem {
  static constexpr double m = 1., L = 1., g = 9.81, mLL = m * L * L, mgL = m * g * L;
  static constexpr double theta1 = 2., theta2 = 1.; /* start, at rest */

  explicit DoublePendulum(double end = 1., double referenceStep = 0.01)
      : solution_(rates, 0.L, referenceStep, {(long double)theta1, (long double)theta2, 0.L, 0.L})
  {
    name = "doublependulum";
    n    = 2;
    t1   = end;
    role.assign(2, TSHHT3_COORDINATE);
  }

  void initial(double *u, double *v) const override
  {
    u[0] = theta1;
    u[1] = theta2;
    v[0] = v[1] = 0.;
  }

  /* -Q: centrifugal and Coriolis terms and weight */
  template <class T> static void forces(const T *u, const T *v, T *f)
  {
    const T s = std::sin(u[1]), tip = mgL * std::sin(u[0] + u[1]);
    f[0] = -mLL * s * v[1] * (2 * v[0] + v[1]) + 2 * mgL * std::sin(u[0]) + tip;
    f[1] = mLL * s * v[0] * v[0] + tip;
  }

  void residual(double, const double *u, const double *v, const double *a, double *f) const override
  {
    const double c = std::cos(u[1]);
    forces(u, v, f);
    f[0] += mLL * ((3. + 2. * c) * a[0] + (1. + c) * a[1]);
    f[1] += mLL * ((1. + c) * a[0] + a[1]);
  }

  void jacobian(double, const double *u, const double *v, const double *a, double sv, double sa,
                Entries &J) const override
  {
    const double c = std::cos(u[1]), s = std::sin(u[1]), tip = mgL * std::cos(u[0] + u[1]);
    J.add(0, 0, sa * mLL * (3. + 2. * c) - sv * mLL * s * 2. * v[1] + 2. * mgL * std::cos(u[0]) + tip);
    J.add(0, 1,
          sa * mLL * (1. + c) - sv * mLL * s * 2. * (v[0] + v[1]) - mLL * c * v[1] * (2. * v[0] + v[1]) + tip -
              mLL * s * (2. * a[0] + a[1]));
    J.add(1, 0, sa * mLL * (1. + c) + sv * mLL * s * 2. * v[0] + tip);
    J.add(1, 1, sa * mLL + mLL * c * v[0] * v[0] + tip - mLL * s * a[0]);
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    const auto  y = solution_.at(t - t0);
    long double f[4];
    rates(t, y.data(), f);
    for (int i = 0; i < 2; i++) {
      u[i] = y[i];
      v[i] = y[2 + i];
      a[i] = f[2 + i];
    }
    return true;
  }

  bool                referenceEverywhere() const override { return true; }
  std::vector<double> referenceTimes() const override { return equallySpaced(10); }

private:
  mutable Extrapolation solution_;

  static void rates(long double, const long double *y, long double *f)
  {
    const long double c = std::cos(y[1]), M11 = 3.L + 2.L * c, M12 = 1.L + c, det = mLL * (M11 - M12 * M12);
    long double       b[2];
    forces(y, y + 2, b);
    f[0] = y[2];
    f[1] = y[3];
    f[2] = -(b[0] - M12 * b[1]) / det;
    f[3] = -(M11 * b[1] - M12 * b[0]) / det;
  }
};

} // namespace hhtex

#endif
