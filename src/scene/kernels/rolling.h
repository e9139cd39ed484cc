/*
  Rolling without slip on the body of marker j: one holonomic row keeps the contact, velocity-level rows exclude
  slip. The touching points of both bodies have the same velocity along the tangents e of the surface,

    -e . (v_i + w_i x arm - v_j - w_j x (d + arm)) = 0,   d = x_i - x_j, arm from x_i to the point of contact,

  and the multipliers of these rows are the friction force on i's body at the point of contact, along j's axes. The multiplier of
  the holonomic row is the normal force. The contact is bilateral: it also pulls.

  n, the normal on i's side of the plane, is side z_j; the start determines side = +1 or -1.
*/
#ifndef HHTDAE_SCENE_ROLLING_H
#define HHTDAE_SCENE_ROLLING_H

#include "scene/kernel.h"
#include <cmath>
#include <limits>
#include <type_traits>

namespace hhtdae
{

struct RollingData {
  double radius = 1, side = 1;
};

/* Velocity of i's body relative to j's body at the point of contact, x_i + arm */
template <class T> Vec3<T> SlipVelocity(const Frame<T> *f, const Twist<T> *w, const Vec3<T> &arm)
{
  const Vec3<T> lever = f[0].x - f[1].x + arm;
  const Vec3<T> on_i = w[0].w.cross(arm), on_j = w[1].w.cross(lever);
  return w[0].v + on_i - w[1].v - on_j;
}

/* ---- disc about z_i ---- */

/* The part of n in the plane of the disc; its length is the cosine of the angle between that plane and n. */
template <class T> Vec3<T> Upward(double side, const Frame<T> *f)
{
  const Vec3<T> n = f[1].R.col(2) * T(side), z = f[0].R.col(2);
  const T       along = n.dot(z);
  return n - z * along;
}

/* r |q| - n . d = 0, q = n - (n . z_i) z_i: the lowest point x_i - r q/|q| is in the plane. Multiplier: force on i's body
   along n, at the lowest point. A disc that lies flat has no lowest point. longestStep() ensures that a step at most
   halves the angle between disc and plane; below flat_angle the row is NaN, so that the run ends with an error that names
   the joint and the cause (JointRuns.ADiscThatFallsFlat). */
struct DiscOnPlane : Constraint<DiscOnPlane, 2, 1> {
  static constexpr const char *name = "disc on plane", *undefined = "the disc falls flat on the plane, where it has no lowest point";
  static constexpr double      flat_angle = 1e-2; /* rad, between the disc and the plane */
  using Data                        = RollingData;
  static constexpr bool curved(int a, int b) { return a == 3 || b == 3 || (a == 1 && b == 1); }

  template <class T> static void value(const Data &data, const Frame<T> *f, const T &, T *phi)
  {
    using std::sqrt;
    const Vec3<T> q = Upward<T>(data.side, f), d = f[0].x - f[1].x;
    const T       length = sqrt(q.squaredNorm());
    phi[0]               = length * T(data.radius) - d.dot(f[1].R.col(2)) * T(data.side);
    if constexpr (std::is_same_v<T, double>)
      /* only in the residual, where the error message names this row; for a NaN in the matrix it would name all coupled
         rows */
      if (length < flat_angle) phi[0] = std::numeric_limits<double>::quiet_NaN();
  }

  /* Time, s, in which the angle between disc and plane is halved */
  static double longestStep(const Data &data, const Frame<double> *f, const Twist<double> *w, double, double angular)
  {
    const Vec3<double> n = f[1].R.col(2) * data.side, z = f[0].R.col(2), turn = w[0].w - w[1].w;
    const double       cosine = n.dot(z), sine = n.cross(z).norm();
    const double       laying = n.dot(turn.cross(z)) * (cosine < 0 ? -1 : 1) / sine; /* rate at which the angle decreases */
    const double       left   = std::atan2(sine, std::fabs(cosine));
    const double       fast   = laying + std::sqrt(laying * laying + angular * left);
    return fast > 0 ? left / fast : std::numeric_limits<double>::infinity();
  }
};

/* The lowest point of the disc does not slip. Multipliers: friction on i's body along j's x and y axes. */
struct DiscNoSlip : VelocityConstraint<DiscNoSlip, 2, 2> {
  static constexpr const char *name = "disc without slip";
  using Data                        = RollingData;
  static constexpr bool curved(int a, int b)
  {
    if (a == 1) return b == 1 || b == 3; /* moment on i: arm x force */
    return a == 3 || b == 3;
  }

  template <class T> static void value(const Data &data, const Frame<T> *f, const Twist<T> *w, const T &, T *psi)
  {
    using std::sqrt;
    const Vec3<T> q      = Upward<T>(data.side, f);
    const T       factor = T(-data.radius) / sqrt(q.squaredNorm());
    const Vec3<T> slip   = SlipVelocity<T>(f, w, q * factor);
    for (int r = 0; r < 2; r++) psi[r] = -slip.dot(f[1].R.col(r));
  }
};

/* ---- sphere about x_i, or a wheel in a planar scene: the point of contact is x_i - r n with n along axis N of j ----
 */

/* R = 2: rows for both tangents, in the order of the axes; R = 1: a row for the first. Multipliers: friction on i's body along these axes
   of j. The holonomic row is OnPlane<N> with offset side * radius (primitives.h); its multiplier is the force on i's body
   along axis N of j. */
template <int N, int R> struct SphereNoSlip : VelocityConstraint<SphereNoSlip<N, R>, 2, R> {
  static constexpr const char *name = "sphere without slip";
  using Data                        = RollingData;
  static constexpr bool curved(int a, int b) { return (b == 3) || (a == 3 && b != 1); }
  static constexpr int  tangent(int r) { return r < N ? r : r + 1; }

  template <class T> static void value(const Data &data, const Frame<T> *f, const Twist<T> *w, const T &, T *psi)
  {
    const Vec3<T> arm  = f[1].R.col(N) * T(-data.side * data.radius);
    const Vec3<T> slip = SlipVelocity<T>(f, w, arm);
    for (int r = 0; r < R; r++) psi[r] = -slip.dot(f[1].R.col(tangent(r)));
  }
};

/* ---- knife edge along x_i, a skate: no velocity of i's origin along y_i. Multiplier: force on i's body along y_i.
 * ---- */

struct KnifeNoSlip : VelocityConstraint<KnifeNoSlip, 2, 1> {
  static constexpr const char *name = "knife edge";
  static constexpr bool        curved(int a, int b) { return (a == 3 && b != 3) || ((a == 0 || a == 2) && b == 1); }

  template <class T> static void value(const Empty &, const Frame<T> *f, const Twist<T> *w, const T &, T *psi)
  {
    const Vec3<T> arm(T(0), T(0), T(0)), slip = SlipVelocity<T>(f, w, arm);
    psi[0] = -slip.dot(f[0].R.col(1));
  }
};

} // namespace hhtdae

#endif
