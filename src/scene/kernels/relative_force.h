/*
  Forces between two frames that depend on their relative position, rotation and motion alone, in the axes E of a
  reference frame that is carried along by both: what bushing and beam share.

  In the axes E: d = x_i - x_j; phi, the rotation vector of R_j^T R_i; v = v_i - v_j and the angular velocities. The
  kernel says

    axes(R_j, q)   the reference axes E, q the quaternion of R_j^T R_i
    spin(phi)      S:  E turns with  S theta_i + (1 - S) theta_j
    turn(phi)      P:  d phi = P (theta_i - theta_j)
    local(...)     the six components: force and moment on i in the axes E, the moment about the origin of i

  The wrench on j is the one that balances these: -f and -m - d x f. The wrench turns with the two frames by
  construction, so that a rigid motion of both leaves the components as they are.
*/
#ifndef HHTDAE_SCENE_KERNELS_RELATIVE_FORCE_H
#define HHTDAE_SCENE_KERNELS_RELATIVE_FORCE_H

#include "scene/kernel.h"
#include "scene/kernels/rotation_vector.h"

namespace hhtdae
{

template <class T> struct Relative {
  Vec3<T> d, phi;    /* x_i - x_j, rotation vector of R_j^T R_i */
  Vec3<T> v, wi, wj; /* v_i - v_j, angular velocities; undefined where the kernel is not damped */
};

template <class K, bool Damped> struct RelativeForce : Force<K, 2, 6> {
  static constexpr bool damped = Damped, symmetric = !Damped;

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
    The components are differentiated automatically in the few numbers of Relative<>. A variation of the frames changes
    these by

      d d = theta_x + [d] e,  d phi = P (theta_i - theta_j),  d v = [v] e,  d w = [w] e,    e = S theta_i + (1 - S)
    theta_j

    with theta_x = dx_i - dx_j, all in the axes E; and a vector u carried by E changes by E (du - [u] e).
  */
  template <class Data, int Z>
  static void jacobian(const Data &data, const Frame<double> *f, const Twist<double> *w, double, const double *,
                       Wrench<double> *on, ForceJacobian<2, Z> &J)
  {
    Mat3<double>           E;
    const Relative<double> r = relative<double>(f, w, E);
    double                 c[6];
    Matrix<6, 6>           frame;
    Matrix<6, 9>           motion;
    differentiate(data, r, c, frame, motion);
    balance<double>(E, f[0].x - f[1].x, c, on);

    const Vec3<double> cf(c[0], c[1], c[2]), cm(c[3], c[4], c[5]), cj = cm + r.d.cross(cf);
    const Mat3<double> S = K::spin(r.phi), P = K::turn(r.phi), D = Cross<double>(r.d), F = Cross<double>(cf);

    /* columns theta_x, theta_i, theta_j; rows force on i, moment on i, minus the moment on j */
    Matrix<9, 9> L;
    Matrix<6, 3> spun = frame.template leftCols<3>() * D; /* by e */
    if constexpr (Damped)
      spun += motion.template leftCols<3>() * Cross<double>(r.v) +
              motion.template middleCols<3>(3) * Cross<double>(r.wi) +
              motion.template rightCols<3>() * Cross<double>(r.wj);
    const Matrix<6, 3> turned    = frame.template rightCols<3>() * P;
    L.template block<6, 3>(0, 0) = frame.template leftCols<3>();
    L.template block<6, 3>(0, 3) = turned + spun * S;
    L.template block<6, 3>(0, 6) = spun - spun * S - turned;
    /* cm + d x cf, of which [cf] acts on dd = theta_x + [d] e */
    L.template bottomRows<3>() = L.template middleRows<3>(3) + D * L.template topRows<3>();
    L.template block<3, 3>(6, 0) -= F;
    const Mat3<double> FD = F * D;
    L.template block<3, 3>(6, 3) -= FD * S;
    L.template block<3, 3>(6, 6) -= FD - FD * S;
    /* the turning of the axes */
    Matrix<9, 3> carried;
    carried << F, Cross<double>(cm), Cross<double>(cj);
    const Matrix<9, 3> carried_i = carried * S;
    L.template middleCols<3>(3) -= carried_i;
    L.template rightCols<3>() -= carried - carried_i;
    spread(E, L, J.frames);
    if constexpr (Damped) {
      L.template topRows<6>()    = motion;
      L.template bottomRows<3>() = motion.template bottomRows<3>() + D * motion.template topRows<3>();
      spread(E, L, J.twists);
    } else
      J.twists.setZero();
  }

private:
  /* components and their derivatives in (d, phi) and (v, w_i, w_j) */
  template <class Data>
  static void differentiate(const Data &data, const Relative<double> &r, double *c, Matrix<6, 6> &frame,
                            Matrix<6, 9> &motion)
  {
    constexpr int N = Damped ? 15 : 6;
    using T         = Dual<N>;
    Relative<T> s;
    T           y[6];
    for (int k = 0; k < 3; k++) {
      s.d(k)   = T(r.d(k), N, k);
      s.phi(k) = T(r.phi(k), N, 3 + k);
      if constexpr (Damped) {
        s.v(k)  = T(r.v(k), N, 6 + k);
        s.wi(k) = T(r.wi(k), N, 9 + k);
        s.wj(k) = T(r.wj(k), N, 12 + k);
      }
    }
    K::template local<T>(data, s, y);
    for (int k = 0; k < 6; k++) {
      c[k]         = y[k].value();
      frame.row(k) = y[k].derivatives().template head<6>().transpose();
      if constexpr (Damped) motion.row(k) = y[k].derivatives().template tail<9>().transpose();
    }
  }

  /* from the axes E to space, and from relative to both markers */
  static void spread(const Mat3<double> &E, const Matrix<9, 9> &L, Matrix<12, 12> &J)
  {
    for (int col = 0; col < 3; col++) {
      const int to = col == 0 ? 0 : col == 1 ? 3 : 9;
      for (int row = 0; row < 3; row++) {
        const Mat3<double> B = E * L.template block<3, 3>(3 * row, 3 * col) * E.transpose();
        if (row < 2) J.template block<3, 3>(3 * row, to) = B;
        if (row == 0) J.template block<3, 3>(6, to) = -B;
        if (row == 2) J.template block<3, 3>(9, to) = -B;
      }
    }
    J.template middleCols<3>(6) = -J.template leftCols<3>();
  }
};

} // namespace hhtdae

#endif
