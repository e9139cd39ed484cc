/*
  Springs and dampers along the line between the origins of two markers. The component is the tension, positive if it
  pulls the markers together. With d = x_i - x_j, l = |d|, n = d/l and l' = n . (v_i - v_j), the force on i is -tension n.

  Where the origins coincide, the line has no direction: n is set to zero, so that the tension causes no force.
  For a spring with free length zero and no preload this is the exact limit f = -k d, with the exact derivative -k. The
  force of a damper is then f = -c (v_i - v_j), as for a motion along the line.
*/
#ifndef HHTDAE_SCENE_KERNELS_SPRING_H
#define HHTDAE_SCENE_KERNELS_SPRING_H

#include "hhtdae/functions.h"
#include "scene/kernel.h"
#include <cmath>
#include <type_traits>

namespace hhtdae
{

/* The line from j to i: its length and direction */
template <class T> struct Line {
  T       length;
  Vec3<T> along;

  explicit Line(const Frame<T> *f)
  {
    using std::sqrt;
    const Vec3<T> d  = f[0].x - f[1].x;
    const T       l2 = d.dot(d);
    if (Plain(l2) > 0) {
      length = sqrt(l2);
      along  = d * (T(1) / length);
    } else {
      length = T(0);
      along  = Vec3<T>(T(0), T(0), T(0));
    }
  }
  T rate(const Twist<T> *w) const
  {
    const Vec3<T> v = w[0].v - w[1].v;
    return along.dot(v);
  }
};

/* Common part of all forces along a line */
template <class K> struct LineForce : Force<K, 2, 1> {
  static constexpr unsigned depends = Position(0) | Position(1), acts = depends;
  static constexpr bool     needs_rotation = false;

  template <class T, class Data> static void apply(const Data &, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    const Line<T> line(f);
    pull<T>(line.along * c[0], on);
  }

  /* The wrenches of a force F on j and -F on i */
  template <class T> static void pull(const Vec3<T> &F, Wrench<T> *on)
  {
    on[0].f = -F;
    on[1].f = F;
    on[0].m = on[1].m = Vec3<T>(T(0), T(0), T(0));
  }

  /* J: blocks of the derivatives of forces that depend on x_i - x_j; B = d(-f_i)/d(x_i - x_j) */
  static void spread(const Mat3<double> &B, Matrix<12, 12> &J)
  {
    J.setZero();
    J.template block<3, 3>(0, 0) = J.template block<3, 3>(6, 6) = -B;
    J.template block<3, 3>(0, 6) = J.template block<3, 3>(6, 0) = B;
  }
};

/* tension = k (l - length) + c l' + preload, in N. A spring without damping is a separate kernel, whose matrix is
   symmetric and without derivatives by velocities */
template <bool Damped> struct LinearSpring : LineForce<LinearSpring<Damped>> {
  static constexpr const char *name   = Damped ? "spring-damper" : "spring";
  static constexpr bool        damped = Damped;
  struct Data {
    double stiffness, damping, length, preload;
  };

  template <class T>
  static void components(const Data &p, const Frame<T> *f, const Twist<T> *w, const T &, const T *, T *c)
  {
    const Line<T> line(f);
    c[0] = T(p.stiffness) * (line.length - T(p.length)) + T(p.preload);
    if constexpr (Damped) c[0] += T(p.damping) * line.rate(w);
  }

  /* Potential energy of spring and preload */
  static double energy(const Data &p, const Frame<double> *f)
  {
    const double l = Line<double>(f).length, stretch = l - p.length;
    return 0.5 * p.stiffness * stretch * stretch + p.preload * l;
  }

  static void wrench(const Data &p, const Frame<double> *f, const Twist<double> *w, double t, const double *z,
                     Wrench<double> *on)
  {
    const Line<double> line(f);
    if constexpr (Damped)
      if (line.length == 0) return LinearSpring::template pull<double>(p.damping * (w[0].v - w[1].v), on);
    double tension;
    components<double>(p, f, w, t, z, &tension);
    LinearSpring::template pull<double>(tension * line.along, on);
  }

  /* d(tension n) = n (k n + c dl')^T + tension/l (1 - n n^T),  dl' = (v - l' n)/l. tension/l is k plus terms that are zero for a spring with
     free length zero */
  template <int Z>
  static void jacobian(const Data &p, const Frame<double> *f, const Twist<double> *w, double t, const double *z,
                       Wrench<double> *on, ForceJacobian<2, Z> &J)
  {
    const Line<double>  line(f);
    const Vec3<double> &n = line.along;
    const double        l = line.length, inverse = l > 0 ? 1 / l : 0;
    double              across = p.stiffness + (p.preload - p.stiffness * p.length) * inverse; /* tension/l */
    Mat3<double>        B;

    wrench(p, f, w, t, z, on);
    if constexpr (Damped) {
      const double rate = line.rate(w);
      across += p.damping * rate * inverse;
      B = n * ((p.stiffness - across) * n + p.damping * inverse * (w[0].v - w[1].v - rate * n)).transpose();
    } else
      B = (p.stiffness - across) * n * n.transpose();
    B.diagonal().array() += across;
    LinearSpring::spread(B, J.frames);
    if constexpr (Damped) {
      B = p.damping * n * n.transpose();
      if (l == 0) B.diagonal().array() += p.damping;
      LinearSpring::spread(B, J.twists);
    } else
      J.twists.setZero();
  }
};

/* f(a, b) for dual numbers a, b, from the value and the two derivatives of f at their plain values; exact for double and Dual */
template <class T> T Evaluate(const ForceLaw &f, const T &a, const T &b)
{
  const Real y = f(Real(Plain(a), 2, 0), Real(Plain(b), 2, 1));
  if constexpr (std::is_same_v<T, double>) return y.value();
  else if (y.derivatives().size() == 0) return T(y.value()); /* a constant */
  else return chain(a, y.derivatives()(0), b, y.derivatives()(1), y.value());
}

/* tension = f(l, l') */
struct CurveSpring : LineForce<CurveSpring> {
  static constexpr const char *name = "nonlinear spring";
  struct Data {
    ForceLaw tension;
  };

  template <class T>
  static void components(const Data &p, const Frame<T> *f, const Twist<T> *w, const T &, const T *, T *c)
  {
    const Line<T> line(f);
    c[0] = Evaluate<T>(p.tension, line.length, line.rate(w));
  }
};

} // namespace hhtdae

#endif
