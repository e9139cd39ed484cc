/*
  A wheelset on a straight track (IVP test set, index 2 there; B. Simeon, C. Führer, P. Rentrop, "Introduction to differential-algebraic
  equations in vehicle system dynamics", Surv. Math. Ind. 1, 1991): conical wheels on rails of circular profile, each in contact at one
  point, with creep forces that depend on the forces of the constraints.

    coordinates   x, y, z (lateral, vertical, along the track) and angles theta, phi of the axle; b' is the part of its spin beyond
                  V/r, b itself appears nowhere
    multipliers   of the two conditions that the wheels touch; minus the test set's, in N

  The contact points, four more unknowns in the test set, follow in closed form from the tangent planes. The same formulas hold for both
  wheels, with the inclination of the contact plane taken in the same sense.

  Reference at t = 10: the test set's (DASSL at 1e-9). Its initial values have five digits; those here agree with them and satisfy
  the constraints.
*/
#ifndef HHTEX_WHEELSET_H
#define HHTEX_WHEELSET_H

#include "../problem.h"

#include <algorithm>
#include <cmath>
#include <hhtdae/dual.h>

namespace hhtex
{

struct Wheelset : Problem {
  static constexpr int size = 8;
  static constexpr int X = 0, Y = 1, Z = 2, Theta = 3, Phi = 4, B = 5, ForceL = 6, ForceR = 7;

  Wheelset()
  {
    name = "wheelset";
    n    = size;
    t1   = 10.;
    role.assign(size, TSHHT3_COORDINATE);
    role[ForceL] = role[ForceR] = TSHHT3_HOLONOMIC;
  }

  void initial(double *u, double *v) const override
  {
    const double u0[size] = {0.14941e-2, 4.0091045969062167e-07, 0.11241e-5, -0.28573e-3, 2.6459345878907556e-04, 0., 83.593, 74.144};
    std::copy_n(u0, size, u);
    std::fill_n(v, size, 0.);
  }

  void residual(double, const double *u, const double *v, const double *a, double *f) const override { equations(u, v, a, f); }

  void jacobian(double, const double *u, const double *v, const double *a, double sv, double sa, Entries &J) const override
  {
    using Number = hhtdae::Dual<size>;
    Number U[size], V[size], A[size], F[size];
    for (int j = 0; j < size; j++) {
      U[j] = Number(u[j], j);
      V[j] = v[j] + sv * (U[j] - u[j]);
      A[j] = a[j] + sa * (U[j] - u[j]);
    }
    equations(U, V, A, F);
    for (int i = 0; i < size; i++)
      for (int j = 0; j < size; j++) J.add(i, j, F[i].derivatives()(j));
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    static const double end[2][size] = {{0.86355386965811e-2, 0.13038281022727e-4, -0.93635784016818e-4, -0.13642299804033e-1, 0.15292895005422e-2, NAN, 0.10124044903201e3, 0.56285630573753e2},
                                        {-0.76985374142666e-1, -0.25151106429207e-3, 0.20541188079539e-2, -0.23904837703692, -0.13633468454173e-1, -0.24421377661131, NAN, NAN}};
    setUnknown(u, v, a);
    if (t == t0) initial(u, v);
    else if (t == t1) std::copy_n(end[0], size, u), std::copy_n(end[1], size, v);
    return t == t0 || t == t1;
  }

  std::vector<double> referenceTimes() const override { return {t0, t1}; }

private:
  const double mass = 16.08, gravity = 9.81, speed = 30., radius = 0.1, I1 = 0.0605, I2 = 0.366, friction = 0.12, arm = 0.19, stiffness = 6400.;
  const double cone = 0.0262, half = 0.1506, rail = 0.06; /* inclination of the cones, half of the distance of the wheels, radius of the rails' profile */

  /* Geometry of one wheel's contact, as a function of the axle's coordinates */
  template <class T> struct Side {
    T q[5];         /* gradient of the condition that it touches, by x, y, z, theta, phi */
    T sin_d, cos_d; /* of the inclination of the contact plane */
    T ss, cs;       /* sine and cosine of the angle psi of the contact point about the axle */
    T xi, r, slope; /* its place along the axle, radius of the wheel there, and derivative of that */
    T gap, g1, g2;  /* distance from the rail; derivatives of the rail's profile */
  };

  template <class T> static T sine(const T &x)
  {
    using std::sin;
    return sin(x);
  }
  template <class T> static T cosine(const T &x)
  {
    using std::cos;
    return cos(x);
  }

  template <class T> struct Axle {
    T st, ct, sp, cp; /* of theta and phi */
    explicit Axle(const T *u) : st(sine(u[Theta])), ct(cosine(u[Theta])), sp(sine(u[Phi])), cp(cosine(u[Phi])) {}
  };

  /* Geometry of a wheel, sign = 1 on the left and -1 on the right. The normals of wheel and rail are parallel. Their components along the track
     give psi; those across it give the slope of the rail, from which the contact points on rail and wheel follow. */
  template <class T> Side<T> touch(const T *u, const Axle<T> &k, double sign) const
  {
    using std::asin;
    using std::atan;
    using std::sqrt;
    Side<T>      s;
    const double t   = std::tan(cone);
    const T      psi = asin(-sign * t * k.st * k.cp / sqrt(k.ct * k.ct + k.st * k.st * k.sp * k.sp)) - atan(k.st * k.sp / k.ct);
    s.ss             = sine(psi);
    s.cs             = cosine(psi);
    s.slope          = T(-sign * t);
    s.g1             = -(s.slope * k.ct * k.cp - k.ct * k.sp * s.cs + k.st * s.ss) / (s.slope * k.sp + k.cp * s.cs);
    const T off = -sign * s.g1 * rail / sqrt(1 + s.g1 * s.g1), across = sign * (half + std::sin(cone) * rail + off), tilt = k.ct * k.sp * s.cs - k.st * s.ss;
    const T root = sqrt(rail * rail - off * off);
    s.g2         = -rail * rail / (root * root * root);
    s.xi         = (across - u[X] - (radius + t * half) * tilt) / (k.ct * k.cp + s.slope * tilt);
    s.r          = radius + t * half + s.slope * s.xi;
    s.gap        = root - radius - std::cos(cone) * rail - u[Y] - s.xi * k.sp + s.r * k.cp * s.cs;
    s.q[0]       = s.g1;
    s.q[1]       = T(-1.);
    s.q[2]       = T(0.);
    s.q[3]       = s.g1 * (s.r * (-k.ct * s.ss - s.cs * k.sp * k.st) - k.cp * k.st * s.xi);
    s.q[4]       = -(s.cs * s.r * k.sp) - k.cp * s.xi + s.g1 * (k.cp * s.cs * k.ct * s.r - k.ct * k.sp * s.xi);
    const T d    = atan(((s.slope * k.cp - k.sp * s.cs) * k.ct + s.ss * k.st) / (-s.slope * k.sp - s.cs * k.cp));
    s.sin_d      = sine(d);
    s.cos_d      = cosine(d);
    return s;
  }

  /* Creep force of a wheel with normal force N, after A. Jaschinski */
  template <class T> void creep(const T *u, const T *v, const Axle<T> &k, const Side<T> &s, const T &N, T force[3]) const
  {
    using std::cbrt;
    using std::sqrt;
    using std::tanh;
    constexpr double E = 1.3537956, G = 0.7115218, sigma = 0.28, shear = 7.92e10, pi = 3.1415926, c11 = 4.72772197, c22 = 4.27526987, c23 = 1.97203505; /* pi as published */
    const T          ss = s.ss, cs = s.cs, spin = speed / radius + v[B];
    const T          st = sine(u[Theta] / s.cos_d), ct = cosine(u[Theta] / s.cos_d);
    const T          lever = s.xi * k.sp - s.r * k.cp * cs, along = s.r * (st * k.sp * cs + ct * ss) + s.xi * st * k.cp, across = s.xi * ct * k.cp + s.r * (ct * k.sp * cs - st * ss);
    const T          w1 = -spin * s.r * (st * cs + ct * k.sp * ss) + v[X] - v[Theta] * along - v[Phi] * ct * lever;
    const T          w2 = spin * s.r * k.cp * ss + v[Y] + v[Phi] * (s.xi * k.cp + s.r * k.sp * cs);
    const T          w3 = -spin * s.r * (ct * cs - st * k.sp * ss) + speed + v[Z] - v[Theta] * across + v[Phi] * st * lever;
    const T          r1 = w1 - 2 * v[X], r2 = w2 - 2 * v[Y], r3 = w3 - 2 * v[Z] - 2 * speed, rolling = 0.5 * sqrt(r1 * r1 + r2 * r2 + r3 * r3);
    const T          nu_x = (st * w1 + ct * w3) / rolling, nu_y = (ct * s.cos_d * w1 + s.sin_d * w2 - st * s.cos_d * w3) / rolling, turn = (-s.sin_d * spin + s.cos_d * v[Theta]) / rolling;
    const T          bend = 1 + s.g1 * s.g1, curvature = 0.5 / (s.r * sqrt(1 + s.slope * s.slope)) - 0.5 * s.g2 / (bend * sqrt(bend));
    const T          c  = cbrt(3 * sqrt(N * N) * (1 - sigma) * E / (2 * pi * curvature * shear * std::sqrt(G)));
    const T          w  = friction * N;
    T                tx = -w * tanh(shear * c * c * c11 * nu_x / w), ty = -w * tanh((shear * c * c * c22 * nu_y + shear * c * c * c * c23 * turn) / w);
    const T          size2 = tx * tx + ty * ty;
    if (size2 > w * w) {
      const T part = sqrt(w * w / size2);
      tx *= part;
      ty *= part;
    }
    force[0] = st * tx + ct * s.cos_d * ty;
    force[1] = s.sin_d * ty;
    force[2] = ct * tx - st * s.cos_d * ty;
  }

  template <class T> void equations(const T *u, const T *v, const T *a, T *f) const
  {
    const Axle<T> k(u);
    const Side<T> side[2] = {touch(u, k, 1.), touch(u, k, -1.)};
    const T       e[2] = {-u[ForceL], -u[ForceR]}, spin = speed / radius + v[B], st_rate = v[Theta] * k.sp;
    /* normal forces: lateral and vertical forces of the constraints, resolved along the two normals */
    const T det = side[0].cos_d * side[1].sin_d - side[0].sin_d * side[1].cos_d, w1 = side[0].q[0] * e[0] + side[1].q[0] * e[1], w2 = side[0].q[1] * e[0] + side[1].q[1] * e[1];
    const T N[2] = {(side[1].cos_d * w1 + side[1].sin_d * w2) / det, (-side[0].cos_d * w1 - side[0].sin_d * w2) / det};
    f[X]         = mass * a[X] + 2 * stiffness * u[X];
    f[Y]         = mass * a[Y] + mass * gravity;
    f[Z]         = mass * a[Z] + 2 * stiffness * u[Z];
    f[Theta]     = I2 * k.cp * a[Theta] - I2 * st_rate * v[Phi] + I1 * spin * v[Phi] + (I1 - I2) * st_rate * v[Phi] + 2 * arm * arm * stiffness * k.cp * u[Theta];
    f[Phi]       = I2 * a[Phi] - I1 * spin * v[Theta] * k.cp - (I1 - I2) * st_rate * v[Theta] * k.cp;
    f[B]         = I1 * k.sp * a[Theta] + I1 * a[B] + I1 * v[Theta] * v[Phi] * k.cp + 2 * arm * arm * stiffness * k.sp * u[Theta];
    for (int w = 0; w < 2; w++) {
      const Side<T> &s = side[w];
      T              t[3];
      creep(u, v, k, s, N[w], t);
      for (int i = 0; i < 3; i++) f[i] -= t[i];
      for (int i = 0; i < 5; i++) f[i] -= s.q[i] * e[w];
      f[Theta] -= -(s.xi * k.st + s.r * s.ss * k.ct * k.cp) * t[0] - s.r * s.ss * k.sp * t[1] + (-s.xi * k.ct + s.r * s.ss * k.st * k.cp) * t[2];
      f[Phi] -= -(s.xi * k.ct * k.sp - s.r * s.cs * k.ct * k.cp) * t[0] + (s.xi * k.cp + s.r * s.cs * k.sp) * t[1] + (s.xi * k.st * k.sp - s.r * s.cs * k.st * k.cp) * t[2];
      f[B] -= -s.r * (s.cs * k.st + s.ss * k.ct * k.sp) * t[0] + s.r * s.ss * k.cp * t[1] - s.r * (s.cs * k.ct - s.ss * k.st * k.sp) * t[2];
      f[ForceL + w] = s.gap;
    }
  }
};

} // namespace hhtex

#endif
