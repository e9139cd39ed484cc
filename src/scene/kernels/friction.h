/*
  Friction in joints, computed from the reaction of the joint. The inputs z of these force kernels are the multipliers of the
  joint's position rows, which are forces; their Euclidean norm is the load N of the bearing. The friction force is mu N
  tanh(s/v_s) against the slip velocity s of the surfaces, see friction_slip.h. A pin or ball of radius r slips at r
  times the relative angular velocity.

  Not modelled: the multipliers of the joint's rotation rows, which are moments, increase the load of a bearing of finite
  length.
*/
#ifndef HHTDAE_SCENE_KERNELS_FRICTION_H
#define HHTDAE_SCENE_KERNELS_FRICTION_H

#include "friction_slip.h"
#include "scene/kernel.h"

namespace hhtdae
{

struct FrictionData {
  double coefficient, radius, slip_velocity;
  int    axis; /* axis of j along which a translational joint slides */
};

/* |z|, not smoothed at zero: smoothing would require a force scale, which would depend on the unit of force and remove
   the friction of small loads (JointFrictionKernel.GrowsWithTheLoadInAnyUnits). At z = 0, an unloaded bearing, the
   derivatives are set to zero, the mean of the derivatives in opposite directions. */
template <int Rows, class T> T BearingLoad(const T *z)
{
  using std::sqrt;
  T square(0);
  for (int k = 0; k < Rows; k++) square += z[k] * z[k];
  if (Plain(square) == 0) return T(0);
  const T load = sqrt(square);
  return load;
}

/* Velocity of i's origin relative to the material of j at that point */
template <class T> Vec3<T> SlidingVelocity(const Frame<T> *f, const Twist<T> *w)
{
  const Vec3<T> x = f[0].x - f[1].x, v = w[0].v - w[1].v, turning = w[1].w.cross(x);
  return v - turning;
}

/* The wrenches of a force F at i's origin and a moment m on i, with their reactions on j */
template <class T> void PlaceSliding(const Frame<T> *f, const Vec3<T> &F, const Vec3<T> &m, Wrench<T> *on)
{
  const Vec3<T> x = f[0].x - f[1].x, about_j = x.cross(F);
  on[0].f = F;
  on[0].m = m;
  on[1].f = -F;
  on[1].m = -m - about_j;
}

template <class T> void PlaceMoment(const Vec3<T> &m, Wrench<T> *on)
{
  on[0].f = on[1].f = Vec3<T>(T(0), T(0), T(0));
  on[0].m           = m;
  on[1].m           = -m;
}

/* Component: moment on i about z_j, -mu r N tanh(r w/v_s), where w is the relative angular velocity about z_j */
template <int Rows> struct RevoluteFriction : Force<RevoluteFriction<Rows>, 2, 1> {
  static constexpr bool        may_be_force_states = false;
  static constexpr const char *name    = "friction in a revolute joint";
  static constexpr int         inputs  = Rows;
  static constexpr unsigned    depends = Rotation(0) | Rotation(1), acts = depends;
  using Data = FrictionData;
  template <class T>
  static void components(const Data &d, const Frame<T> *f, const Twist<T> *w, const T &, const T *z, T *c)
  {
    const Vec3<T> axis = f[1].R.col(2), turning = w[0].w - w[1].w;
    const T       slip = axis.dot(turning) * T(d.radius), limit = BearingLoad<Rows, T>(z) * T(d.coefficient);
    const T       speed2 = slip * slip, factor = SlipFactor<T>(limit, speed2, d.slip_velocity);
    c[0] = factor * slip * T(d.radius);
  }
  template <class T> static void apply(const Data &, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    PlaceMoment<T>(f[1].R.col(2) * c[0], on);
  }
};

/* Component: force on i along an axis of j, -mu N tanh(v/v_s) */
template <int Rows> struct TranslationalFriction : Force<TranslationalFriction<Rows>, 2, 1> {
  static constexpr bool        may_be_force_states = false;
  static constexpr const char *name    = "friction in a translational joint";
  static constexpr int         inputs  = Rows;
  static constexpr unsigned    depends = Position(0) | Position(1) | Rotation(1), acts = depends;
  using Data = FrictionData;
  template <class T>
  static void components(const Data &d, const Frame<T> *f, const Twist<T> *w, const T &, const T *z, T *c)
  {
    const Vec3<T> axis = f[1].R.col(d.axis), v = SlidingVelocity<T>(f, w);
    const T       slip = axis.dot(v), limit = BearingLoad<Rows, T>(z) * T(d.coefficient);
    const T       speed2 = slip * slip, factor = SlipFactor<T>(limit, speed2, d.slip_velocity);
    c[0] = factor * slip;
  }
  template <class T> static void apply(const Data &d, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    const Vec3<T> axis = f[1].R.col(d.axis), F = axis * c[0], none(T(0), T(0), T(0));
    PlaceSliding<T>(f, F, none, on);
  }
};

/* Components: force on i along z_j and moment about it. The surfaces slip along a helix, with the velocity (v, r w), and
   the friction force has the opposite direction; so a rotating shaft slides easily. */
struct CylindricalFriction : Force<CylindricalFriction, 2, 2> {
  static constexpr bool        may_be_force_states = false;
  static constexpr const char *name   = "friction in a cylindrical joint";
  static constexpr int         inputs = 2;
  using Data                          = FrictionData;
  template <class T>
  static void components(const Data &d, const Frame<T> *f, const Twist<T> *w, const T &, const T *z, T *c)
  {
    const Vec3<T> axis = f[1].R.col(2), turning = w[0].w - w[1].w, v = SlidingVelocity<T>(f, w);
    const T       along = axis.dot(v), around = axis.dot(turning) * T(d.radius);
    const T       speed2 = along * along + around * around, limit = BearingLoad<2, T>(z) * T(d.coefficient);
    const T       factor = SlipFactor<T>(limit, speed2, d.slip_velocity);
    c[0]                 = factor * along;
    c[1]                 = factor * around * T(d.radius);
  }
  template <class T> static void apply(const Data &, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    const Vec3<T> axis = f[1].R.col(2), F = axis * c[0], m = axis * c[1];
    PlaceSliding<T>(f, F, m, on);
  }
};

/* Components: moment on i in space axes against the relative angular velocity w, -mu r N tanh(r |w|/v_s) w/|w| */
struct SphericalFriction : Force<SphericalFriction, 2, 3> {
  static constexpr bool        may_be_force_states = false;
  static constexpr const char *name    = "friction in a spherical joint";
  static constexpr int         inputs  = 3;
  static constexpr unsigned    depends = Rotation(0) | Rotation(1), acts = depends;
  static constexpr bool        needs_rotation = false;
  using Data                                  = FrictionData;
  template <class T>
  static void components(const Data &d, const Frame<T> *, const Twist<T> *w, const T &, const T *z, T *c)
  {
    const Vec3<T> turning = w[0].w - w[1].w, slip = turning * T(d.radius);
    const T       speed2 = slip.squaredNorm(), limit = BearingLoad<3, T>(z) * T(d.coefficient);
    const T       factor = SlipFactor<T>(limit, speed2, d.slip_velocity);
    for (int k = 0; k < 3; k++) c[k] = factor * slip(k) * T(d.radius);
  }
  template <class T> static void apply(const Data &, const Frame<T> *, const T *c, Wrench<T> *on)
  {
    PlaceMoment<T>(Vec3<T>(c[0], c[1], c[2]), on);
  }
};

} // namespace hhtdae

#endif
