/*
  Contact of two shapes as a force kernel, Contact<Shape>, with a Shape of contact_shapes.h and the force of contact_law.h.

  The components are the contact force on i's body in the axes of j (between spheres: in space axes). The force and its reaction on
  j's body act at the contact point. While the bodies do not touch, only the gap is evaluated, with plain numbers, also for the
  Jacobian.
*/
#ifndef HHTDAE_SCENE_KERNELS_CONTACT_H
#define HHTDAE_SCENE_KERNELS_CONTACT_H

#include "contact_law.h"
#include "contact_shapes.h"
#include "scene/kernel.h"
#include "scene/look_ahead.h"
#include <algorithm>
#include <limits>
#include <utility>

namespace hhtdae
{

template <class T> Frame<double> PlainFrame(const Frame<T> &f)
{
  Frame<double> p;
  for (int i = 0; i < 3; i++) {
    p.x(i) = Plain(f.x(i));
    for (int c = 0; c < 3; c++) p.R(i, c) = Plain(f.R(i, c));
  }
  return p;
}

/* Derivatives of penetration, normal and contact point by the 12 directions of the two frames */
struct ContactMovement {
  Matrix<1, 12> depth;
  Matrix<3, 12> normal, point;
};

/* Returns the force on i for the slip velocity v. frames, twists: derivatives of both wrenches, by the chain rule from
   the derivatives of the law by the seven numbers (d, n, v) */
Vector3 ContactDerivatives(const ContactLaw &law, const Touch<double> &t, const Vector3 &v, const ContactMovement &by, const Frame<double> *f,
                           const Twist<double> *w, Matrix<12, 12> &frames, Matrix<12, 12> &twists);

/* through() of a shape, or infinity: matter below a plane has no other side */
template <class Shape> auto Deepest(const typename Shape::Data &d, int) -> decltype(Shape::through(d)) { return Shape::through(d); }
template <class Shape> double Deepest(const typename Shape::Data &, long) { return std::numeric_limits<double>::infinity(); }

template <class Shape> struct Contact : Force<Contact<Shape>, 2, 3> {
  static constexpr const char *name           = Shape::name;
  static constexpr bool        needs_rotation = Shape::axes_of_j; /* spheres do not depend on the axes of markers */
  struct Data {
    typename Shape::Data shape;
    ContactLaw           law;
  };

  template <class T> static bool touches(const Data &d, const Frame<T> *f, Touch<T> &t)
  {
    if constexpr (!std::is_same<T, double>::value) {
      const Frame<double> plain[2] = {PlainFrame(f[0]), PlainFrame(f[1])};
      Touch<double>       where;
      if (!touches<double>(d, plain, where)) return false;
    }
    Shape::template touch<T>(d.shape, f, t);
    return Plain(t.depth) > 0;
  }

  /* Velocity of i's material point at p relative to that of j */
  template <class T> static Vec3<T> slip(const Frame<T> *f, const Twist<T> *w, const Vec3<T> &p)
  {
    const Vec3<T> ri = p - f[0].x, rj = p - f[1].x;
    const Vec3<T> vi = w[0].v + w[0].w.cross(ri), vj = w[1].v + w[1].w.cross(rj);
    return vi - vj;
  }

  template <class T>
  static void components(const Data &d, const Frame<T> *f, const Twist<T> *w, const T &, const T *, T *c)
  {
    Touch<T> t;
    Vec3<T>  F(T(0), T(0), T(0));
    if (touches<T>(d, f, t)) {
      const Vec3<T> space = ContactForce<T>(d.law, t.depth, t.n, slip<T>(f, w, t.p));
      if constexpr (Shape::axes_of_j)
        F = f[1].R.transpose() * space;
      else
        F = space;
    }
    for (int k = 0; k < 3; k++) c[k] = F(k);
  }

  template <class T> static void apply(const Data &d, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    const Vec3<T> given(c[0], c[1], c[2]);
    Vec3<T>       F = given;
    if constexpr (Shape::axes_of_j) F = f[1].R * given;
    Touch<T> t;
    Shape::template touch<T>(d.shape, f, t);
    place<T>(f, t.p, F, on);
  }

  /* Upper bound on the step, s, for shapes that define through(), the largest penetration allowed at the end of a step */
  template <class S = Shape, class = decltype(S::through(std::declval<const typename S::Data &>()))>
  static double longestStep(const Data &d, const Frame<double> *f, const Twist<double> *w, double acceleration, double)
  {
    Touch<double> t;
    Shape::template touch<double>(d.shape, f, t);
    return LongestApproach(Shape::through(d.shape), t.depth, -t.n.dot(slip<double>(f, w, t.p)), acceleration);
  }

  /* Look-ahead, batch.h */
  static double gap(const Data &d, const Frame<double> *f)
  {
    Touch<double> t;
    Shape::template touch<double>(d.shape, f, t);
    return -t.depth;
  }
  static GapBounds gapBounds(const Data &d, const MarkerForecast *m, double horizon)
  {
    return BoundsOfDistance(m[0], m[1], Shape::extent(d.shape), Shape::axes_of_j, horizon);
  }
  static double deepest(const Data &d) { return Deepest<Shape>(d.shape, 0); }

  /* Potential energy of the elastic part of the force */
  static double energy(const Data &d, const Frame<double> *f)
  {
    Touch<double> t;
    return touches<double>(d, f, t) ? ElasticEnergy(d.law, t.depth) : 0;
  }

  /* The wrenches of the force F on i and -F on j, both at the point p */
  template <class T> static void place(const Frame<T> *f, const Vec3<T> &p, const Vec3<T> &F, Wrench<T> *on)
  {
    const Vec3<T> ri = p - f[0].x, rj = p - f[1].x;
    on[0].f = F;
    on[0].m = ri.cross(F);
    on[1].f = -F;
    on[1].m = F.cross(rj);
  }

  static void wrench(const Data &d, const Frame<double> *f, const Twist<double> *w, double, const double *,
                     Wrench<double> *on)
  {
    Touch<double> t;
    if (touches<double>(d, f, t))
      place<double>(f, t.p, ContactForce<double>(d.law, t.depth, t.n, slip<double>(f, w, t.p)), on);
    else
      clear(on);
  }

  static void clear(Wrench<double> *on)
  {
    for (int k = 0; k < 2; k++) {
      on[k].f.setZero();
      on[k].m.setZero();
    }
  }

  template <int Z>
  static void jacobian(const Data &d, const Frame<double> *f, const Twist<double> *w, double, const double *,
                       Wrench<double> *on, ForceJacobian<2, Z> &J)
  {
    J.frames.setZero();
    J.twists.setZero();
    J.inputs.setZero();
    Touch<double> t;
    if (!touches<double>(d, f, t)) return clear(on);

    Frame<Dual<12>> s[2];
    Touch<Dual<12>> moved;
    ContactMovement by;
    SeedAll<12, 2>(f, s);
    Shape::template touch<Dual<12>>(d.shape, s, moved);
    by.depth = DerivativeRow(moved.depth);
    for (int k = 0; k < 3; k++) {
      by.normal.row(k) = DerivativeRow(moved.n(k));
      by.point.row(k)  = DerivativeRow(moved.p(k));
    }
    place<double>(f, t.p, ContactDerivatives(d.law, t, slip<double>(f, w, t.p), by, f, w, J.frames, J.twists), on);
  }
};

} // namespace hhtdae

#endif
