/*
  Loads of users' forces, computed from their components. The components are inputs: values of expressions that the assembly evaluates, or force
  states.
*/
#ifndef HHTDAE_SCENE_USER_FORCE_H
#define HHTDAE_SCENE_USER_FORCE_H

#include "scene/kernel.h"

namespace hhtdae
{

/* Force at i's origin and moment on i's body, in the axes of the third marker or of space; the reaction acts on j's
   body at the same point. Unused markers may be any valid ones. */
struct UserWrenchData {
  int  force = -1, moment = -1; /* number of the first component of the force and of the moment; -1 if there is none */
  bool reaction = false, framed = false;
};
template <int C> struct UserWrench : Force<UserWrench<C>, 3, C> {
  static constexpr const char *name    = "user force";
  static constexpr int         inputs  = C;
  static constexpr bool        damped  = false;
  static constexpr unsigned    depends = Position(0) | Position(1) | Rotation(2);
  static constexpr unsigned    acts    = Position(0) | Rotation(0) | Position(1) | Rotation(1);
  using Data                           = UserWrenchData;

  template <class T>
  static void components(const Data &, const Frame<T> *, const Twist<T> *, const T &, const T *z, T *c)
  {
    for (int i = 0; i < C; i++) c[i] = z[i];
  }
  template <class T> static void apply(const Data &d, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    const Vec3<T> force = inSpace<T>(d, d.force, f[2], c), moment = inSpace<T>(d, d.moment, f[2], c);
    on[0] = {force, moment};
    for (int k = 1; k < 3; k++) {
      on[k].f.fill(T(0));
      on[k].m.fill(T(0));
    }
    if (!d.reaction) return;
    const Vec3<T> arm = f[0].x - f[1].x, lever = arm.cross(force);
    on[1].f = -force;
    on[1].m = -moment - lever;
  }

private:
  template <class T> static Vec3<T> inSpace(const Data &d, int first, const Frame<T> &frame, const T *c)
  {
    if (first < 0) return Vec3<T>(T(0), T(0), T(0));
    const Vec3<T> x(c[first], c[first + 1], c[first + 2]);
    if (!d.framed) return x;
    const Vec3<T> y = frame.R * x;
    return y;
  }
};

/* A force along the line from j to i, repulsive if positive; zero if the points coincide, since the line then has no direction */
struct UserAlongLine : Force<UserAlongLine, 2, 1> {
  static constexpr const char *name   = "user scalar force";
  static constexpr int         inputs = 1;
  static constexpr bool        damped = false, needs_rotation = false;
  static constexpr unsigned    depends = Position(0) | Position(1);
  static constexpr unsigned    acts    = Position(0) | Position(1);

  template <class T>
  static void components(const Empty &, const Frame<T> *, const Twist<T> *, const T &, const T *z, T *c)
  {
    c[0] = z[0];
  }
  template <class T> static void apply(const Empty &, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    using std::sqrt;
    const Vec3<T> d = f[0].x - f[1].x;
    const T       l2 = d.dot(d), k = Plain(l2) > 0 ? T(c[0] / sqrt(l2)) : T(0);
    on[0].f         = d * k;
    on[1].f         = -on[0].f;
    for (int i = 0; i < 2; i++) on[i].m.fill(T(0));
  }
};

/* A moment on i's body about z_j, and the opposite moment on j's body */
struct UserAboutAxis : Force<UserAboutAxis, 2, 1> {
  static constexpr const char *name    = "user scalar moment";
  static constexpr int         inputs  = 1;
  static constexpr bool        damped  = false;
  static constexpr unsigned    depends = Rotation(1);
  static constexpr unsigned    acts    = Rotation(0) | Rotation(1);

  template <class T>
  static void components(const Empty &, const Frame<T> *, const Twist<T> *, const T &, const T *z, T *c)
  {
    c[0] = z[0];
  }
  template <class T> static void apply(const Empty &, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    on[0].m = f[1].R.col(2) * c[0];
    on[1].m = -on[0].m;
    for (int i = 0; i < 2; i++) on[i].f.fill(T(0));
  }
};

} // namespace hhtdae

#endif
