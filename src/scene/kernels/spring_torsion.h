/*
  Torsional springs and dampers about z_j. The component M is a moment on i, a function of the angle of i's x axis about
  z_j, with full turns, and of its rate. The wrench follows from the work M d angle: the moment M g on i
  and -M g on j, with the gradient g of the angle (angle.h). If a joint keeps the z axes parallel, g = z_j; otherwise
  g makes an elastic moment conservative.
*/
#ifndef HHTDAE_SCENE_KERNELS_SPRING_TORSION_H
#define HHTDAE_SCENE_KERNELS_SPRING_TORSION_H

#include "scene/kernels/angle.h"
#include "scene/kernels/spring.h"

namespace hhtdae
{

template <class K> struct TurnForce : Force<K, 2, 1> {
  static constexpr int      memory = 1, angles = 1;
  static constexpr unsigned depends = Rotation(0) | Rotation(1), acts = depends;

  template <class T, class Data> static void apply(const Data &, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    const Vec3<T> g = AngleGradient<T>(f[0], f[1]), M = g * c[0];
    on[0].f = on[1].f = Vec3<T>(T(0), T(0), T(0));
    on[0].m           = M;
    on[1].m           = -M;
  }

  template <class Data> static void accept(Data &p, const Frame<double> *f)
  {
    p.memory[0] = UnwoundAngle<double>(f[0], f[1], p.memory[0]);
  }

  template <class Data>
  static double longestStep(const Data &, const Frame<double> *f, const Twist<double> *w, double, double angular)
  {
    return LongestTurn(AngleRate<double>(f[0], f[1], w[0], w[1]), angular);
  }

  /* Derivatives of the wrenches from the value of M and its derivatives by angle and rate: d(M g) = dM g + M dg, d angle
     = g . (d theta_i - d theta_j), d rate = w . dg + g . dw */
  static void spread(double M, double by_angle, double by_rate, const Frame<double> *f, const Twist<double> *w,
                     Matrix<12, 12> &frames, Matrix<12, 12> &twists)
  {
    const Vec3<double> g = AngleGradient<double>(f[0], f[1]);
    Mat3<double>       Gi, Gj, Bi, Bj;
    AngleCurvature(f[0], f[1], Gi, Gj);
    Bi = M * Gi + by_angle * g * g.transpose();
    Bj = M * Gj - by_angle * g * g.transpose();
    frames.setZero();
    twists.setZero();
    if constexpr (K::damped) {
      const Vec3<double> relative = w[0].w - w[1].w;
      Bi += by_rate * g * (relative.transpose() * Gi);
      Bj += by_rate * g * (relative.transpose() * Gj);
      const Mat3<double> C     = by_rate * g * g.transpose();
      twists.block<3, 3>(3, 3) = twists.block<3, 3>(9, 9) = C;
      twists.block<3, 3>(3, 9) = twists.block<3, 3>(9, 3) = -C;
    }
    frames.block<3, 3>(3, 3) = Bi;
    frames.block<3, 3>(3, 9) = Bj;
    frames.block<3, 3>(9, 3) = -Bi;
    frames.block<3, 3>(9, 9) = -Bj;
  }
};

/* M = preload - k (angle - free angle) - c angle' */
template <bool Damped> struct LinearTorsion : TurnForce<LinearTorsion<Damped>> {
  static constexpr const char *name   = Damped ? "torsional spring-damper" : "torsional spring";
  static constexpr bool        damped = Damped;
  struct Data {
    double memory[1];
    double stiffness, damping, angle, preload;
  };

  template <class T>
  static void components(const Data &p, const Frame<T> *f, const Twist<T> *w, const T &, const T *, T *c)
  {
    c[0] = T(p.preload) - T(p.stiffness) * (UnwoundAngle<T>(f[0], f[1], p.memory[0]) - T(p.angle));
    if constexpr (Damped) c[0] -= T(p.damping) * AngleRate<T>(f[0], f[1], w[0], w[1]);
  }

  /* Potential energy of spring and preload */
  static double energy(const Data &p, const Frame<double> *f)
  {
    const double angle = UnwoundAngle<double>(f[0], f[1], p.memory[0]), turn = angle - p.angle;
    return 0.5 * p.stiffness * turn * turn - p.preload * angle;
  }

  template <int Z>
  static void jacobian(const Data &p, const Frame<double> *f, const Twist<double> *w, double t, const double *z,
                       Wrench<double> *on, ForceJacobian<2, Z> &J)
  {
    double M;
    components<double>(p, f, w, t, z, &M);
    LinearTorsion::template apply<double>(p, f, &M, on);
    LinearTorsion::spread(M, -p.stiffness, -p.damping, f, w, J.frames, J.twists);
  }
};

/* M = f(angle, angle') */
struct CurveTorsion : TurnForce<CurveTorsion> {
  static constexpr const char *name = "nonlinear torsional spring";
  struct Data {
    double   memory[1];
    ForceLaw moment;
  };

  template <class T>
  static void components(const Data &p, const Frame<T> *f, const Twist<T> *w, const T &, const T *, T *c)
  {
    c[0] = Evaluate<T>(p.moment, UnwoundAngle<T>(f[0], f[1], p.memory[0]), AngleRate<T>(f[0], f[1], w[0], w[1]));
  }

  template <int Z>
  static void jacobian(const Data &p, const Frame<double> *f, const Twist<double> *w, double, const double *,
                       Wrench<double> *on, ForceJacobian<2, Z> &J)
  {
    const double angle = UnwoundAngle<double>(f[0], f[1], p.memory[0]),
                 rate  = AngleRate<double>(f[0], f[1], w[0], w[1]);
    Dual<2> M          = Evaluate<Dual<2>>(p.moment, Dual<2>(angle, 0), Dual<2>(rate, 1));
    double  value      = M.value();
    apply<double>(p, f, &value, on);
    spread(value, M.derivatives()(0), M.derivatives()(1), f, w, J.frames, J.twists);
  }
};

} // namespace hhtdae

#endif
