/*
  Simple pendulum in absolute coordinates (IFToMM benchmark A01): a point mass m at distance L from the origin.

    m x'' + x lambda       = 0
    m y'' + y lambda + m g = 0
    (x^2 + y^2 - L^2) / 2  = 0         lambda = T / L with the tension T of the rod

  Released at an angle from the downward vertical with an angular velocity; exact solution by elliptic functions.
*/
#ifndef HHTEX_PENDULUM_H
#define HHTEX_PENDULUM_H

#include "../problem.h"
#include "elliptic.h"

namespace hhtex
{

struct Pendulum : Problem {
  const double m = 1., L = 1., g = 9.81;
  double       theta0, omega0; /* rad, rad/s */

  explicit Pendulum(double releaseAngle = -90., double releaseSpin = 0., double end = 10.) /* degrees, rad/s, s */
      : theta0(releaseAngle * std::atan(1.) / 45.), omega0(releaseSpin)
  {
    name = "pendulum";
    n    = 3;
    t1   = end;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
  }

  void initial(double *u, double *v) const override
  {
    const double s = std::sin(theta0), c = std::cos(theta0);
    u[0] = L * s;
    u[1] = -L * c;
    u[2] = 0.;
    v[0] = L * omega0 * c;
    v[1] = L * omega0 * s;
    v[2] = 0.;
  }

  void residual(double, const double *u, const double *, const double *a, double *f) const override
  {
    const double x = u[0], y = u[1], lambda = u[2];
    f[0] = m * a[0] + x * lambda;
    f[1] = m * a[1] + y * lambda + m * g;
    f[2] = (x * x + y * y - L * L) / 2.;
  }

  void jacobian(double, const double *u, const double *, const double *, double, double sa, Entries &J) const override
  {
    const double x = u[0], y = u[1], lambda = u[2];
    J.add(0, 0, sa * m + lambda);
    J.add(1, 1, sa * m + lambda);
    J.add(0, 2, x);
    J.add(1, 2, y);
    J.add(2, 0, x);
    J.add(2, 1, y);
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    const PendulumMotion p(std::sqrt((long double)g / L), theta0, omega0, t - t0);
    setUnknown(u, v, a);
    u[0] = L * p.sine;
    u[1] = -L * p.cosine;
    u[2] = m / L * (L * p.omega * p.omega + g * p.cosine);
    v[0] = L * p.omega * p.cosine;
    v[1] = L * p.omega * p.sine;
    a[0] = L * (p.alpha * p.cosine - p.omega * p.omega * p.sine);
    a[1] = L * (p.alpha * p.sine + p.omega * p.omega * p.cosine);
    return true;
  }

  bool                referenceEverywhere() const override { return true; }
  std::vector<double> referenceTimes() const override { return equallySpaced(20); }
};

} // namespace hhtex

#endif
