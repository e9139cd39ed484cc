/*
  User-defined variables, force states and a first-order controller: a crane. A cart (mass mc, position s) rolls on a
  rail and carries a load (mass m, at x, y) on a rod of length L. The cart is held by a spring-damper with friction, and
  an actuator damps it by its filtered acceleration. With N the force of the rail on the cart:

    mc s'' - (x-s) lambda - F - P = 0                   cart
    m x''  + (x-s) lambda         = 0                   load
    m y''  + y lambda + m g       = 0
    ((x-s)^2 + y^2 - L^2) / 2     = 0                   rod; lambda = tension / L
    tau w' + w - A                = 0                   low-pass filter, a first-order state
    A - s''                       = 0                   accelerometer, a variable defined by q''
    N - mc g + y lambda           = 0                   rail force, a variable defined by lambda
    F + k s + c s' + mF s'' + nu N tanh(s'/v0) = 0      force state: spring, damper, carried mass, friction
    P + kw w - P0 sin(W t)        = 0                   force state: actuator

  The acceleration reaches the actuator through the filter only, so that q'' is always determined.

  Reference: with s and the rod's angle theta from the downward vertical as coordinates (x = s + L sin theta, y = -L cos
  theta) everything else is explicit; extrapolation of order 20 in long double. Halving its step changes the state at t
  = 5 by less than 1e-14.
*/
#ifndef HHTEX_USERVARS_H
#define HHTEX_USERVARS_H

#include "../problem.h"
#include "extrapolation.h"

#include <algorithm>

namespace hhtex
{

struct UserVars : Problem {
  static constexpr double mc = 2., m = 1., L = 1., g = 9.81;               /* cart, load, rod */
  static constexpr double k = 40., c = 0.5, mF = 0.3, nu = 0.02, v0 = 0.2; /* spring-damper F */
  static constexpr double tau = 0.05, kw = 1., P0 = 3., W = 4.;            /* filter and actuator */
  static constexpr double s0 = 0.1, theta0 = 0.6;                          /* start, at rest, filter at w = 0 */
  enum { S, X, Y, LAMBDA, FILTER, ACCEL, RAIL, SPRING, ACTUATOR };

  explicit UserVars(double end = 5., double referenceStep = 0.01)
      : minimal_(rates, 0.L, referenceStep, {(long double)s0, (long double)theta0, 0.L, 0.L, 0.L})
  {
    name = "uservars";
    n    = 9;
    t1   = end;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC, TSHHT3_STATE,
            TSHHT3_VARIABLE,   TSHHT3_VARIABLE,   TSHHT3_FORCE,      TSHHT3_FORCE};
  }

  void initial(double *u, double *v) const override
  {
    std::fill_n(u, 9, 0.);
    std::fill_n(v, 9, 0.);
    u[S] = s0;
    u[X] = s0 + L * std::sin(theta0);
    u[Y] = -L * std::cos(theta0);
  }

  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    const double dx = u[X] - u[S];
    f[S]            = mc * a[S] - dx * u[LAMBDA] - u[SPRING] - u[ACTUATOR];
    f[X]            = m * a[X] + dx * u[LAMBDA];
    f[Y]            = m * a[Y] + u[Y] * u[LAMBDA] + m * g;
    f[LAMBDA]       = (dx * dx + u[Y] * u[Y] - L * L) / 2.;
    f[FILTER]       = tau * v[FILTER] + u[FILTER] - u[ACCEL];
    f[ACCEL]        = u[ACCEL] - a[S];
    f[RAIL]         = u[RAIL] - mc * g + u[Y] * u[LAMBDA];
    f[SPRING]       = u[SPRING] + k * u[S] + c * v[S] + mF * a[S] + nu * u[RAIL] * std::tanh(v[S] / v0);
    f[ACTUATOR]     = u[ACTUATOR] + kw * u[FILTER] - P0 * std::sin(W * t);
  }

  void jacobian(double, const double *u, const double *v, const double *, double sv, double sa,
                Entries &J) const override
  {
    const double dx = u[X] - u[S], lambda = u[LAMBDA], friction = std::tanh(v[S] / v0);
    J.add(S, S, sa * mc + lambda);
    J.add(S, X, -lambda);
    J.add(X, S, -lambda);
    J.add(X, X, sa * m + lambda);
    J.add(Y, Y, sa * m + lambda);
    J.add(S, LAMBDA, -dx);
    J.add(X, LAMBDA, dx);
    J.add(Y, LAMBDA, u[Y]);
    J.add(LAMBDA, S, -dx);
    J.add(LAMBDA, X, dx);
    J.add(LAMBDA, Y, u[Y]);
    J.add(S, SPRING, -1.);
    J.add(S, ACTUATOR, -1.);
    J.add(FILTER, FILTER, sv * tau + 1.);
    J.add(FILTER, ACCEL, -1.);
    J.add(ACCEL, ACCEL, 1.);
    J.add(ACCEL, S, -sa);
    J.add(RAIL, RAIL, 1.);
    J.add(RAIL, Y, lambda);
    J.add(RAIL, LAMBDA, u[Y]);
    J.add(SPRING, SPRING, 1.);
    J.add(SPRING, S, k + sv * (c + nu * u[RAIL] * (1. - friction * friction) / v0) + sa * mF);
    J.add(SPRING, RAIL, nu * friction);
    J.add(ACTUATOR, ACTUATOR, 1.);
    J.add(ACTUATOR, FILTER, kw);
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    const auto        y = minimal_.at(t - t0);
    long double       f[5], tension, springForce;
    const long double sine = std::sin(y[1]), cosine = std::cos(y[1]);
    solve(t - t0, y.data(), f, tension, springForce);
    setUnknown(u, v, a);
    u[S]        = y[0];
    u[X]        = y[0] + L * sine;
    u[Y]        = -L * cosine;
    u[LAMBDA]   = tension / L;
    u[FILTER]   = y[4];
    u[ACCEL]    = f[2];
    u[RAIL]     = mc * g + tension * cosine;
    u[SPRING]   = springForce;
    u[ACTUATOR] = P0 * std::sin(W * (t - t0)) - kw * y[4];
    v[S]        = y[2];
    v[X]        = y[2] + L * cosine * y[3];
    v[Y]        = L * sine * y[3];
    v[FILTER]   = f[4];
    a[S]        = f[2];
    a[X]        = f[2] + L * (cosine * f[3] - sine * y[3] * y[3]);
    a[Y]        = L * (sine * f[3] + cosine * y[3] * y[3]);
    return true;
  }

  bool                referenceEverywhere() const override { return true; }
  std::vector<double> referenceTimes() const override { return equallySpaced(10); }

private:
  mutable Extrapolation minimal_; /* s, theta, s', theta', w */

  static void rates(long double t, const long double *y, long double *f)
  {
    long double tension, springForce;
    solve(t, y, f, tension, springForce);
  }

  static void solve(long double t, const long double *y, long double *f, long double &tension, long double &springForce)
  {
    const long double sine = std::sin(y[1]), cosine = std::cos(y[1]), friction = nu * std::tanh(y[2] / v0);
    const long double atRest   = m * (g * cosine + L * y[3] * y[3]); /* tension if the cart did not accelerate */
    const long double actuator = P0 * std::sin(W * t) - kw * y[4], passive = -k * y[0] - c * y[2];
    /* tension = atRest - m s'' sine, in the cart's equation with F and P inserted */
    const long double inertia = mc + mF + m * sine * (sine - friction * cosine);
    f[0]                      = y[2];
    f[1]                      = y[3];
    f[2]                      = (passive + actuator - friction * (mc * g + cosine * atRest) + sine * atRest) / inertia;
    f[3]                      = -(g * sine + f[2] * cosine) / L;
    f[4]                      = (f[2] - y[4]) / tau;
    tension                   = atRest - m * f[2] * sine;
    springForce               = passive - mF * f[2] - friction * (mc * g + tension * cosine);
  }
};

} // namespace hhtex

#endif
