/*
  Forces between two frames that depend only on their relative position, rotation and motion, expressed in the axes E of a
  reference frame that moves with both: the common part of bushing and beam.

  In the axes E: d = x_i - x_j; phi, the rotation vector of R_j^T R_i; v = v_i - v_j and the angular velocities. The
  kernel defines

    axes(R_j, q)   the reference axes E, q the quaternion of R_j^T R_i
    spin(phi)      S:  E rotates by  S theta_i + (1 - S) theta_j
    turn(phi)      P:  d phi = P (theta_i - theta_j)
    local(...)     the six components: force and moment on i in the axes E, the moment about the origin of i

  The wrench on j balances these: -f and -m - d x f. A rigid motion of both frames does not change the components, since
  E moves with the frames.
*/
#ifndef HHTDAE_SCENE_KERNELS_RELATIVE_FORCE_H
#define HHTDAE_SCENE_KERNELS_RELATIVE_FORCE_H

#include "scene/kernel.h"
#include "scene/kernels/rotation_vector.h"

namespace hhtdae
{

template <class T> struct Relative {
  Vec3<T> d, phi;    /* d = x_i - x_j; phi: rotation vector of R_j^T R_i */
  Vec3<T> v, wi, wj; /* v_i - v_j, angular velocities; not set if the kernel is not damped */
};

/* Components of a kernel at one state, and the derivatives that the matrix needs */
struct RelativeDerivatives {
  double       c[6];       /* components */
  Matrix<6, 6> frame;      /* derivatives of the components by (d, phi) */
  Matrix<6, 9> motion;     /* derivatives of the components by (v, w_i, w_j); not set if the kernel is not damped */
  Mat3<double> spin, turn; /* S, P */
};

/* Derivatives of both wrenches by the frames and, unless null, by the twists */
void Spread(const Mat3<double> &E, const Relative<double> &r, const RelativeDerivatives &by, Matrix<12, 12> &frames, Matrix<12, 12> *twists);

template <class K, bool Damped> struct RelativeForce : Force<K, 2, 6> {
  static constexpr bool damped = Damped;

  template <class T> static Relative<T> relative(const Frame<T> *f, const Twist<T> *w, Mat3<T> &E)
  {
    const Mat3<T>       R = f[1].R.transpose() * f[0].R;
    const Quaternion<T> q = UnitQuaternion<T>(R);
    Relative<T>         r;
    E               = K::template axes<T>(f[1].R, q);
    const Vec3<T> d = f[0].x - f[1].x;
    r.d             = E.transpose() * d;
    r.phi           = RotationVector<T>(q);
    if constexpr (Damped) {
      const Vec3<T> v = w[0].v - w[1].v;
      r.v             = E.transpose() * v;
      r.wi            = E.transpose() * w[0].w;
      r.wj            = E.transpose() * w[1].w;
    }
    return r;
  }

  template <class T, class Data>
  static void components(const Data &data, const Frame<T> *f, const Twist<T> *w, const T &, const T *, T *c)
  {
    Mat3<T>           E;
    const Relative<T> r = relative<T>(f, w, E);
    K::template local<T>(data, r, c);
  }

  template <class T, class Data> static void apply(const Data &, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    const Mat3<T> R = f[1].R.transpose() * f[0].R;
    const Mat3<T> E = K::template axes<T>(f[1].R, UnitQuaternion<T>(R));
    balance<T>(E, f[0].x - f[1].x, c, on);
  }

  template <class T> static void balance(const Mat3<T> &E, const Vec3<T> &d, const T *c, Wrench<T> *on)
  {
    const Vec3<T> cf(c[0], c[1], c[2]), cm(c[3], c[4], c[5]);
    on[0].f = E * cf;
    on[0].m = E * cm;
    on[1].f = -on[0].f;
    on[1].m = -on[0].m - d.cross(on[0].f);
  }

  /*
    The components are differentiated automatically by the few numbers of Relative<>. A variation of the frames changes
    these numbers by

      d d = theta_x + [d] e,  d phi = P (theta_i - theta_j),  d v = [v] e,  d w = [w] e,    e = S theta_i + (1 - S)
    theta_j

    with theta_x = dx_i - dx_j, all in the axes E. A vector with the components u in the axes E changes by E (du - [u] e).
  */
  template <class Data, int Z>
  static void jacobian(const Data &data, const Frame<double> *f, const Twist<double> *w, double, const double *,
                       Wrench<double> *on, ForceJacobian<2, Z> &J)
  {
    Mat3<double>           E;
    const Relative<double> r = relative<double>(f, w, E);
    RelativeDerivatives    by;
    by.spin = K::spin(r.phi);
    by.turn = K::turn(r.phi);
    differentiate(data, r, by);
    balance<double>(E, f[0].x - f[1].x, by.c, on);
    Spread(E, r, by, J.frames, Damped ? &J.twists : nullptr);
    if constexpr (!Damped) J.twists.setZero();
  }

private:
  /* The components and their derivatives by (d, phi) and (v, w_i, w_j) */
  template <class Data>
  static void differentiate(const Data &data, const Relative<double> &r, RelativeDerivatives &by)
  {
    constexpr int N = Damped ? 15 : 6;
    using T         = Dual<N>;
    Relative<T> s;
    T           y[6];
    for (int k = 0; k < 3; k++) {
      s.d(k)   = T(r.d(k), k);
      s.phi(k) = T(r.phi(k), 3 + k);
      if constexpr (Damped) {
        s.v(k)  = T(r.v(k), 6 + k);
        s.wi(k) = T(r.wi(k), 9 + k);
        s.wj(k) = T(r.wj(k), 12 + k);
      }
    }
    K::template local<T>(data, s, y);
    for (int k = 0; k < 6; k++) {
      by.c[k]         = y[k].value();
      by.frame.row(k) = DerivativeRow<6>(y[k], 0);
      if constexpr (Damped) by.motion.row(k) = DerivativeRow<9>(y[k], 6);
    }
  }
};

} // namespace hhtdae

#endif
