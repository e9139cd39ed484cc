/*
  Slider-crank of the SUNDIALS example idaSlCrank_dns.c: crank angle q, slider x, rod angle p; a spring-damper between
  the middles of crank and rod, a constant force on the slider. With s1 = sin q, c1 = cos q, s2 = sin p, c2 = cos p:

    J1 q'' + a s1 lambda1 - a c1 lambda2 = Q0           x - c2 - a c1 = 0
    m2 x'' + lambda1                     = Q1           -s2 - a s1    = 0
    J2 p'' + s2 lambda1 - c2 lambda2     = Q2

  The spring's length squared is S(q,x,p) = x^2 - x (c2 + a c1) + (1 + a^2)/4 + a cos(p-q)/2, its force f = k (l - l0) +
  c l' acts along -grad l.

  Reference: q alone as coordinate, extrapolation of order 20 in long double. Halving its step changes the state at t =
  10 by less than 1e-14.
*/
#ifndef HHTEX_SLIDERCRANK_H
#define HHTEX_SLIDERCRANK_H

#include "../problem.h"
#include "extrapolation.h"

#include <algorithm>

namespace hhtex
{

struct SliderCrank : Problem {
  static constexpr double a = 0.5, J1 = 1., m2 = 1., J2 = 2., k = 1., c = 1., l0 = 1., F = 1.;

  explicit SliderCrank(double end = 10., double referenceStep = 0.05)
      : minimal_(
            [](long double, const long double *y, long double *f) {
              Minimal s(y[0], y[1]);
              f[0] = y[1];
              f[1] = s.ddq;
            },
            0.L, referenceStep, {2.L * std::atan(1.L), 0.L})
  {
    name = "slidercrank";
    n    = 5;
    t1   = end;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC, TSHHT3_HOLONOMIC};
  }

  void initial(double *u, double *v) const override
  {
    const double p = std::asin(-a), q = 2. * std::atan(1.);
    const double u0[5] = {q, std::cos(p) + a * std::cos(q), p, 0., 0.};
    std::copy_n(u0, 5, u);
    std::fill_n(v, 5, 0.);
  }

  void residual(double, const double *u, const double *v, const double *acc, double *f) const override
  {
    const double s1 = std::sin(u[0]), c1 = std::cos(u[0]), s2 = std::sin(u[2]), c2 = std::cos(u[2]);
    double       Q[3];
    forces(u, v, Q);
    f[0] = J1 * acc[0] + a * s1 * u[3] - a * c1 * u[4] - Q[0];
    f[1] = m2 * acc[1] + u[3] - Q[1];
    f[2] = J2 * acc[2] + s2 * u[3] - c2 * u[4] - Q[2];
    f[3] = u[1] - c2 - a * c1;
    f[4] = -s2 - a * s1;
  }

  void jacobian(double, const double *u, const double *v, const double *, double sv, double sa,
                Entries &J) const override
  {
    const double s1 = std::sin(u[0]), c1 = std::cos(u[0]), s2 = std::sin(u[2]), c2 = std::cos(u[2]);
    const double mass[3] = {J1, m2, J2}, reaction[3] = {a * (c1 * u[3] + s1 * u[4]), 0., c2 * u[3] + s2 * u[4]};
    const double G[2][3] = {{a * s1, 1., s2}, {-a * c1, 0., -c2}};
    double       K[3][3];
    forceGradient(u, v, sv, K);
    for (PetscInt i = 0; i < 3; i++)
      for (PetscInt j = 0; j < 3; j++) J.add(i, j, (i == j ? sa * mass[i] + reaction[i] : 0.) - K[i][j]);
    for (PetscInt r = 0; r < 2; r++)
      for (PetscInt i = 0; i < 3; i++) {
        J.add(i, 3 + r, G[r][i]);
        J.add(3 + r, i, G[r][i]);
      }
  }

  bool reference(double t, double *u, double *v, double *acc) const override
  {
    const auto    y = minimal_.at(t - t0);
    const Minimal s(y[0], y[1]);
    setUnknown(u, v, acc);
    for (int i = 0; i < 3; i++) {
      u[i]   = s.u[i];
      v[i]   = s.v[i];
      acc[i] = s.a[i];
    }
    u[3] = s.lambda[0];
    u[4] = s.lambda[1];
    return true;
  }

  bool                referenceEverywhere() const override { return true; }
  std::vector<double> referenceTimes() const override { return equallySpaced(10); }

private:
  mutable Extrapolation minimal_; /* q, q' */

  /* The spring's length squared: gradient and, if H is given, second derivatives */
  template <class T> static T lengthSquared(const T *u, T *grad, T (*H)[3] = nullptr)
  {
    const T s1 = std::sin(u[0]), c1 = std::cos(u[0]), s2 = std::sin(u[2]), c2 = std::cos(u[2]), x = u[1];
    const T s = std::sin(u[2] - u[0]), c_ = std::cos(u[2] - u[0]);
    grad[0] = a * (x * s1 + s / 2);
    grad[1] = 2 * x - c2 - a * c1;
    grad[2] = x * s2 - a * s / 2;
    if (H) {
      H[0][0] = a * (x * c1 - c_ / 2);
      H[0][1] = H[1][0] = a * s1;
      H[0][2] = H[2][0] = a * c_ / 2;
      H[1][1]           = 2;
      H[1][2] = H[2][1] = s2;
      H[2][2]           = x * c2 - a * c_ / 2;
    }
    return x * x - x * (c2 + a * c1) + (1 + T(a) * a) / 4 + a * c_ / 2;
  }

  template <class T> static void forces(const T *u, const T *v, T *Q)
  {
    T       g[3];
    const T l = std::sqrt(lengthSquared(u, g)), rate = (g[0] * v[0] + g[1] * v[1] + g[2] * v[2]) / (2 * l);
    const T f = k * (l - l0) + c * rate;
    for (int i = 0; i < 3; i++) Q[i] = -f * g[i] / (2 * l);
    Q[1] += F;
    Q[2] -= F * std::sin(u[2]);
  }

  /* K = dQ/dq + sv dQ/dq' */
  static void forceGradient(const double *u, const double *v, double sv, double K[3][3])
  {
    double       g[3], H[3][3];
    const double l = std::sqrt(lengthSquared(u, g, H)), rate = (g[0] * v[0] + g[1] * v[1] + g[2] * v[2]) / (2. * l);
    const double f = k * (l - l0) + c * rate;
    for (int j = 0; j < 3; j++) {
      const double dl    = g[j] / (2. * l);
      const double drate = (H[j][0] * v[0] + H[j][1] * v[1] + H[j][2] * v[2]) / (2. * l) - rate * dl / l;
      const double df    = k * dl + c * (drate + sv * dl);
      for (int i = 0; i < 3; i++) K[i][j] = -(df * g[i] + f * H[i][j] - f * g[i] * dl / l) / (2. * l);
    }
    K[2][2] -= F * std::cos(u[2]);
  }

  /* The whole state from q and q' */
  struct Minimal {
    long double u[3], v[3], a[3], lambda[2], ddq;

    Minimal(long double q, long double dq)
    {
      const long double A = SliderCrank::a, s1 = std::sin(q), c1 = std::cos(q), p = std::asin(-A * s1),
                        s2 = std::sin(p), c2 = std::cos(p);
      const long double dp = -A * c1 / c2; /* dp/dq, dx/dq and their derivatives by q */
      const long double dx = -s2 * dp - A * s1, ddp = (A * s1 + s2 * dp * dp) / c2,
                        ddx  = -c2 * dp * dp - s2 * ddp - A * c1;
      const long double B[3] = {1.L, dx, dp}, curvature[3] = {0.L, ddx * dq * dq, ddp * dq * dq},
                        mass[3] = {J1, m2, J2};
      long double Q[3], M = 0.L, R = 0.L;
      u[0] = q;
      u[1] = c2 + A * c1;
      u[2] = p;
      for (int i = 0; i < 3; i++) v[i] = B[i] * dq;
      forces(u, v, Q);
      for (int i = 0; i < 3; i++) {
        M += B[i] * mass[i] * B[i];
        R += B[i] * (Q[i] - mass[i] * curvature[i]);
      }
      ddq = R / M;
      for (int i = 0; i < 3; i++) a[i] = B[i] * ddq + curvature[i];
      lambda[0] = Q[1] - m2 * a[1];
      lambda[1] = (J2 * a[2] + s2 * lambda[0] - Q[2]) / c2;
    }
  };
};

} // namespace hhtex

#endif
