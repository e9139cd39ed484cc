/*
  Stiff spring pendulum: a point mass on a spring of stiffness k and free length l0, released horizontally at rest. No
  constraints; for large k the fast stretching frequency sqrt(k/m) lies far above the swing.

    m r'' + k (|r| - l0) r / |r| + (0, m g) = 0

  Reference: extrapolation of order 20 in long double with steps of 1/sqrt(k/m); halving them changes the state at t = 2
  by less than 1e-12 for k = 1e2 .. 1e6.
*/
#ifndef HHTEX_SPRINGPENDULUM_H
#define HHTEX_SPRINGPENDULUM_H

#include "../problem.h"
#include "extrapolation.h"

#include <algorithm>

namespace hhtex
{

struct SpringPendulum : Problem {
  static constexpr double m = 1., g = 9.81, l0 = 1.;
  const double            k;

  explicit SpringPendulum(double stiffness = 1e4, double end = 2., double referenceStep = 0.)
      : k(stiffness), solution_([this](long double, const long double *y, long double *f) { rates(y, f); }, 0.L,
                                referenceStep > 0. ? referenceStep : std::min(.05, 1. / std::sqrt(stiffness / m)),
                                {(long double)l0, 0.L, 0.L, 0.L})
  {
    name = "springpendulum";
    n    = 2;
    t1   = end;
    role.assign(2, TSHHT3_COORDINATE);
  }

  void initial(double *u, double *v) const override
  {
    u[0] = l0;
    u[1] = v[0] = v[1] = 0.;
  }

  void residual(double, const double *u, const double *, const double *a, double *f) const override
  {
    const double l = std::hypot(u[0], u[1]), pull = k * (l - l0) / l;
    f[0] = m * a[0] + pull * u[0];
    f[1] = m * a[1] + pull * u[1] + m * g;
  }

  void jacobian(double, const double *u, const double *, const double *, double, double sa, Entries &J) const override
  {
    const double l = std::hypot(u[0], u[1]), pull = k * (l - l0) / l, stretch = k * l0 / (l * l * l);
    J.add(0, 0, sa * m + pull + stretch * u[0] * u[0]);
    J.add(0, 1, stretch * u[0] * u[1]);
    J.add(1, 0, stretch * u[0] * u[1]);
    J.add(1, 1, sa * m + pull + stretch * u[1] * u[1]);
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    const auto  y = solution_.at(t - t0);
    long double f[4];
    rates(y.data(), f);
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

  void rates(const long double *y, long double *f) const
  {
    const long double l = std::sqrt(y[0] * y[0] + y[1] * y[1]), pull = k * (l - l0) / (l * m);
    f[0] = y[2];
    f[1] = y[3];
    f[2] = -pull * y[0];
    f[3] = -pull * y[1] - g;
  }
};

} // namespace hhtex

#endif
