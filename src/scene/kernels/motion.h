/*
  Motions: the angle of i about z_j, or the advance of i along an axis of j, is equal to f(t); or its rate is equal to f(t); or its rate is
  equal to a first-order state w, w' = f(t). Rows are prescribed minus actual value, so that the multiplier is the moment of the drive
  on i's body about z_j, or its force on i's body along the axis of j; the opposite load acts on j's body.
*/
#ifndef HHTDAE_SCENE_KERNELS_MOTION_H
#define HHTDAE_SCENE_KERNELS_MOTION_H

#include "angle.h"
#include "hhtdae/functions.h"

namespace hhtdae
{

struct MotionData {
  TimeFunction function;
  int          axis = 2; /* axis of j; only for translations */
};

/* ---- the driven coordinate: value, rate, gradient and curvature as in couplers and springs, angle.h ---- */

struct TurnAboutZ {
  static constexpr unsigned depends = Rotation(0) | Rotation(1);
  static constexpr bool     curved(int a, int b) { return AngleCurved(a, b); }

  template <class T> static T value(const MotionData &, const Frame<T> *f, double near)
  {
    return UnwoundAngle<T>(f[0], f[1], near);
  }
  template <class T> static T rate(const MotionData &, const Frame<T> *f, const Twist<T> *w)
  {
    return AngleRate<T>(f[0], f[1], w[0], w[1]);
  }
  static void gradient(const MotionData &, const Frame<double> *f, double factor, Matrix<1, 12> &J)
  {
    J.setZero();
    AddAngleGradient(f[0], f[1], factor, J);
  }
  static void curvature(const MotionData &, const Frame<double> *f, double factor, Matrix<12, 12> &H)
  {
    H.setZero();
    AddAngleCurvature(f[0], f[1], factor, H);
  }
};

struct AdvanceAlongAxis {
  static constexpr unsigned depends = Everything(2) & ~Rotation(0);
  static constexpr bool     curved(int a, int b) { return AdvanceCurved(a, b); }

  template <class T> static T value(const MotionData &d, const Frame<T> *f, double)
  {
    return Advance<T>(f[0], f[1], d.axis);
  }
  template <class T> static T rate(const MotionData &d, const Frame<T> *f, const Twist<T> *w)
  {
    return AdvanceRate<T>(f[0], f[1], w[0], w[1], d.axis);
  }
  static void gradient(const MotionData &d, const Frame<double> *f, double factor, Matrix<1, 12> &J)
  {
    J.setZero();
    AddAdvanceGradient(f[0], f[1], d.axis, factor, J);
  }
  static void curvature(const MotionData &d, const Frame<double> *f, double factor, Matrix<12, 12> &H)
  {
    H.setZero();
    AddAdvanceCurvature(f[0], f[1], d.axis, factor, H);
  }
};

/* ---- f(t) - displacement = 0 ---- */

/* The number of full turns is the one for which the angle is nearest to f(t), so that no memory is needed. */
template <class K, class Moves> struct DrivenDisplacement : Constraint<K, 2, 1> {
  using Data                        = MotionData;
  using Base                        = Constraint<K, 2, 1>;
  static constexpr bool     driven  = true;
  static constexpr unsigned depends = Moves::depends;
  static constexpr bool     curved(int a, int b) { return Moves::curved(a, b); }

  template <class T> static void value(const Data &d, const Frame<T> *f, const T &t, T *phi)
  {
    const TimeFunction::Value v = d.function(Plain(t));
    phi[0]                      = Taylor(v.f, v.f1, v.f2, t) - Moves::template value<T>(d, f, v.f);
  }
  static void gradient(const Data &d, const Frame<double> *f, double, typename Base::Gradient &J)
  {
    Moves::gradient(d, f, -1, J);
  }
  static void curvature(const Data &d, const Frame<double> *f, double, const double *lambda, typename Base::Hessian &H)
  {
    Moves::curvature(d, f, -lambda[0], H);
  }
  static void time(const Data &d, const Frame<double> *, double t, double *rate) { rate[0] = d.function(t).f1; }
};

struct DrivenAngle : DrivenDisplacement<DrivenAngle, TurnAboutZ> {
  static constexpr const char *name       = "driven angle";
  static constexpr bool        prescribes_angle = true;
  static double                angleAt(const Data &d, double t) { return d.function(t).f; }
};
struct DrivenAdvance : DrivenDisplacement<DrivenAdvance, AdvanceAlongAxis> {
  static constexpr const char *name = "driven advance";
};

/* ---- f(t) - rate = 0, or w - rate = 0 with a state w; rate: time derivative of the displacement ---- */

/* The rate is J u with the gradient J of the displacement's row and the twists u, so that its derivative by the frames is u^T dJ^T. */
template <class K, class Moves> struct RateRow : VelocityConstraint<K, 2, 1> {
  using Data                        = MotionData;
  using Base                        = VelocityConstraint<K, 2, 1>;
  static constexpr unsigned depends = Moves::depends;
  static constexpr bool     curved(int a, int b) { return Moves::curved(a, b); }

  static void gradient(const Data &d, const Frame<double> *f, const Twist<double> *w, double, const double *,
                       typename Base::Gradient &J, typename Base::Gradient &P, double *zj)
  {
    typename Base::Hessian H;
    Matrix<12, 1>          u;
    Moves::gradient(d, f, -1, J);
    Moves::curvature(d, f, -1, H);
    u << w[0].v, w[0].w, w[1].v, w[1].w;
    P.noalias() = u.transpose() * H;
    if (K::inputs > 0 && zj) zj[0] = 1;
  }
  static void curvature(const Data &d, const Frame<double> *f, const Twist<double> *, double, const double *,
                        const double *lambda, typename Base::Hessian &H)
  {
    Moves::curvature(d, f, -lambda[0], H);
  }
};

template <class K, class Moves> struct DrivenRate : RateRow<K, Moves> {
  template <class T> static void value(const MotionData &d, const Frame<T> *f, const Twist<T> *w, const T &t, T *psi)
  {
    const TimeFunction::Value v = d.function(Plain(t));
    psi[0]                      = Taylor(v.f, v.f1, v.f2, t) - Moves::template rate<T>(d, f, w);
  }
};

/* w is a first-order state of the scene; the equation w' = f(t) is a row of that state and not part of this kernel. */
template <class K, class Moves> struct StateRate : RateRow<K, Moves> {
  static constexpr int inputs = 1;

  template <class T>
  static void value(const MotionData &d, const Frame<T> *f, const Twist<T> *w, const T &, const T *z, T *psi)
  {
    psi[0] = z[0] - Moves::template rate<T>(d, f, w);
  }
};

struct DrivenAngularVelocity : DrivenRate<DrivenAngularVelocity, TurnAboutZ> {
  static constexpr const char *name = "driven angular velocity";
};
struct DrivenVelocity : DrivenRate<DrivenVelocity, AdvanceAlongAxis> {
  static constexpr const char *name = "driven velocity";
};
struct StateAngularVelocity : StateRate<StateAngularVelocity, TurnAboutZ> {
  static constexpr const char *name = "angular velocity of a state";
};
struct StateVelocity : StateRate<StateVelocity, AdvanceAlongAxis> {
  static constexpr const char *name = "velocity of a state";
};

} // namespace hhtdae

#endif
