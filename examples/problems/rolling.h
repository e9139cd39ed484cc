/*
  Non-holonomic constraints: rows Psi(q,q') = 0 with the reaction Psi_q'^T mu.

  Chaplygin sleigh: a body whose centre of mass (x, y) lies a ahead of a blade that cannot slip sideways.

    m x'' - mu sin theta = 0,   m y'' + mu cos theta = 0,   I theta'' - a mu = 0
    -x' sin theta + y' cos theta - a theta' = 0

  Exact: with the blade's forward speed u = U tanh(beta (t - tc)) and theta' = Omega sech(beta (t - tc)), U^2 = 2E/m,
  J = I + m a^2, beta = a m U / J, Omega = U sqrt(m/J); x and y by quadrature (extrapolation, 18 digits).

  Vertical disc of radius R rolling on a plane: contact point (x, y), spin phi, heading psi. It runs in a circle.

    m x'' + mu1 = 0,   m y'' + mu2 = 0,   I phi'' - R (mu1 cos psi + mu2 sin psi) = 0,   D psi'' = 0
    x' - R phi' cos psi = 0,   y' - R phi' sin psi = 0
*/
#ifndef HHTEX_ROLLING_H
#define HHTEX_ROLLING_H

#include "../problem.h"
#include "extrapolation.h"

#include <algorithm>

namespace hhtex
{

struct Sleigh : Problem {
  const double m = 1., I = 0.2, a = 0.3; /* mass, central inertia, blade to centre of mass */
  const double u0 = -0.5, omega0 = 2.;   /* starts backwards, which is unstable: it turns round */

  explicit Sleigh(double end = 10.)
      : J_(I + (long double)m * a * a), U_(std::sqrt(u0 * (long double)u0 + J_ / m * omega0 * omega0)),
        beta_(a * m * U_ / J_), Omega_(U_ * std::sqrt(m / J_)), tc_(-std::atanh(u0 / U_) / beta_),
        blade_(
            [this](long double t, const long double *, long double *f) {
              long double u, theta, omega;
              motion(t, u, theta, omega);
              f[0] = u * std::cos(theta);
              f[1] = u * std::sin(theta);
            },
            0.L, 0.05L, {0.L, 0.L})
  {
    name = "sleigh";
    n    = 4;
    t1   = end;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_NONHOLONOMIC};
  }

  void initial(double *u, double *v) const override
  {
    const double u_[4] = {a, 0., 0., 0.}, v_[4] = {u0, a * omega0, omega0, 0.};
    std::copy_n(u_, 4, u);
    std::copy_n(v_, 4, v);
  }

  void residual(double, const double *u, const double *v, const double *acc, double *f) const override
  {
    const double s = std::sin(u[2]), c = std::cos(u[2]), mu = u[3];
    f[0] = m * acc[0] - s * mu;
    f[1] = m * acc[1] + c * mu;
    f[2] = I * acc[2] - a * mu;
    f[3] = -s * v[0] + c * v[1] - a * v[2];
  }

  void jacobian(double, const double *u, const double *v, const double *, double sv, double sa,
                Entries &J) const override
  {
    const double s = std::sin(u[2]), c = std::cos(u[2]), mu = u[3], G[3] = {-s, c, -a};
    J.add(0, 0, sa * m);
    J.add(1, 1, sa * m);
    J.add(2, 2, sa * I);
    J.add(0, 2, -c * mu);
    J.add(1, 2, -s * mu);
    for (PetscInt i = 0; i < 3; i++) {
      J.add(i, 3, G[i]);
      J.add(3, i, sv * G[i]);
    }
    J.add(3, 2, -c * v[0] - s * v[1]);
  }

  bool reference(double t, double *q, double *v, double *acc) const override
  {
    long double u, theta, omega;
    motion(t - t0, u, theta, omega);
    const auto        p = blade_.at(t - t0);
    const long double s = std::sin(theta), c = std::cos(theta), alpha = -m * a * u * omega / J_;
    const long double sideways = u * omega + a * alpha; /* acceleration; along the blade u' - a omega^2 = 0 */
    setUnknown(q, v, acc);
    q[0]   = p[0] + a * c;
    q[1]   = p[1] + a * s;
    q[2]   = theta;
    q[3]   = I * alpha / a;
    v[0]   = u * c - a * omega * s;
    v[1]   = u * s + a * omega * c;
    v[2]   = omega;
    acc[0] = -sideways * s;
    acc[1] = sideways * c;
    acc[2] = alpha;
    return true;
  }

  bool                referenceEverywhere() const override { return true; }
  std::vector<double> referenceTimes() const override { return equallySpaced(10); }

private:
  long double           J_, U_, beta_, Omega_, tc_;
  mutable Extrapolation blade_;

  /* Forward speed of the blade, heading and its rate */
  void motion(long double t, long double &u, long double &theta, long double &omega) const
  {
    const long double z = beta_ * (t - tc_), z0 = -beta_ * tc_;
    u     = U_ * std::tanh(z);
    omega = Omega_ / std::cosh(z);
    theta = 2.L * Omega_ / beta_ * (std::atan(std::tanh(z / 2.L)) - std::atan(std::tanh(z0 / 2.L)));
  }
};

struct RollingDisc : Problem {
  const double m = 1., R = 0.5, I = m * R * R / 2., D = m * R * R / 4.;
  const double spin = 2., turn = 0.7; /* phi', psi', both constant */

  explicit RollingDisc(double end = 10.)
  {
    name = "disc";
    n    = 6;
    t1   = end;
    role.assign(6, TSHHT3_COORDINATE);
    role[4] = role[5] = TSHHT3_NONHOLONOMIC;
  }

  void initial(double *u, double *v) const override
  {
    const double v0[6] = {R * spin, 0., spin, turn, 0., 0.};
    std::fill_n(u, 6, 0.);
    std::copy_n(v0, 6, v);
  }

  void residual(double, const double *u, const double *v, const double *acc, double *f) const override
  {
    const double s = std::sin(u[3]), c = std::cos(u[3]), mu1 = u[4], mu2 = u[5];
    f[0] = m * acc[0] + mu1;
    f[1] = m * acc[1] + mu2;
    f[2] = I * acc[2] - R * (c * mu1 + s * mu2);
    f[3] = D * acc[3];
    f[4] = v[0] - R * c * v[2];
    f[5] = v[1] - R * s * v[2];
  }

  void jacobian(double, const double *u, const double *v, const double *, double sv, double sa,
                Entries &J) const override
  {
    const double s = std::sin(u[3]), c = std::cos(u[3]), mu1 = u[4], mu2 = u[5];
    J.add(0, 0, sa * m);
    J.add(1, 1, sa * m);
    J.add(2, 2, sa * I);
    J.add(3, 3, sa * D);
    J.add(2, 3, R * (s * mu1 - c * mu2));
    J.add(0, 4, 1.);
    J.add(1, 5, 1.);
    J.add(2, 4, -R * c);
    J.add(2, 5, -R * s);
    J.add(4, 0, sv);
    J.add(5, 1, sv);
    J.add(4, 2, -sv * R * c);
    J.add(5, 2, -sv * R * s);
    J.add(4, 3, R * s * v[2]);
    J.add(5, 3, -R * c * v[2]);
  }

  bool reference(double t, double *u, double *v, double *acc) const override
  {
    const double psi = turn * (t - t0), s = std::sin(psi), c = std::cos(psi), speed = R * spin, radius = speed / turn;
    setUnknown(u, v, acc);
    u[0]   = radius * s;
    u[1]   = radius * (1. - c);
    u[2]   = spin * (t - t0);
    u[3]   = psi;
    u[4]   = m * speed * turn * s;
    u[5]   = -m * speed * turn * c;
    v[0]   = speed * c;
    v[1]   = speed * s;
    v[2]   = spin;
    v[3]   = turn;
    acc[0] = -speed * turn * s;
    acc[1] = speed * turn * c;
    acc[2] = acc[3] = 0.;
    return true;
  }

  bool                referenceEverywhere() const override { return true; }
  std::vector<double> referenceTimes() const override { return equallySpaced(10); }
};

} // namespace hhtex

#endif
