/*
  Bushing. In j's axes, with the displacement d of i's origin from j's origin and the rotation vector phi of i relative to j,

    f = f_0 - K d - C d'                          on i, d' = the velocity of i's origin seen by an observer on j
    m = -B(phi)^T (K_t phi - m_0) - C_t w         on i about i's origin, w = the angular velocity of i relative to j

  where d phi = B(phi) d theta. The moment is conjugate to the rotation vector, so that all terms but the damping have the
  potential  d^T K d/2 - f_0 . d + phi^T K_t phi/2 - m_0 . phi. Since B^T = 1 + [phi]/2 + O(phi^2), m = m_0 - K_t phi - C_t w holds for small
  rotations, and for any rotation if K_t is isotropic and m_0 is zero. |phi| must stay below half a
  turn. The usual choice of j's axes is not symmetric in i and j.
*/
#ifndef HHTDAE_SCENE_KERNELS_BUSHING_H
#define HHTDAE_SCENE_KERNELS_BUSHING_H

#include "hhtdae/types.h"
#include "scene/kernels/relative_force.h"

namespace hhtdae
{

template <bool Damped> struct BushingForce : RelativeForce<BushingForce<Damped>, Damped> {
  static constexpr const char *name = Damped ? "bushing" : "undamped bushing";
  struct Data {
    Vector3 stiffness, torsional_stiffness, damping, torsional_damping, force, moment;
  };

  template <class T> static Mat3<T> axes(const Mat3<T> &Rj, const Quaternion<T> &) { return Rj; }
  static Mat3<double>               spin(const Vec3<double> &) { return Mat3<double>::Zero(); }
  static Mat3<double>               turn(const Vec3<double> &phi)
  {
    const Mat3<double> X = Cross<double>(phi);
    return Mat3<double>::Identity() - 0.5 * X + HalfCot<double>(phi.squaredNorm()) * X * X;
  }

  template <class T> static void local(const Data &p, const Relative<T> &r, T *c)
  {
    Vec3<T> e;
    for (int k = 0; k < 3; k++) e(k) = r.phi(k) * T(p.torsional_stiffness(k)) - T(p.moment(k));
    const T       gamma = HalfCot<T>(T(r.phi.dot(r.phi)));
    const Vec3<T> once = r.phi.cross(e), twice = r.phi.cross(once);
    for (int k = 0; k < 3; k++) {
      c[k]     = T(p.force(k)) - r.d(k) * T(p.stiffness(k));
      c[3 + k] = -e(k) - T(0.5) * once(k) - gamma * twice(k);
    }
    if constexpr (Damped) {
      const Vec3<T> convective = r.wj.cross(r.d);
      for (int k = 0; k < 3; k++) {
        c[k] -= T(p.damping(k)) * (r.v(k) - convective(k));
        c[3 + k] -= T(p.torsional_damping(k)) * (r.wi(k) - r.wj(k));
      }
    }
  }

  /* Potential energy of the springs and preloads */
  static double energy(const Data &p, const Frame<double> *f)
  {
    Mat3<double> E;
    const auto   r = BushingForce<false>::template relative<double>(f, nullptr, E);
    return r.d.dot(0.5 * p.stiffness.cwiseProduct(r.d) - p.force) +
           r.phi.dot(0.5 * p.torsional_stiffness.cwiseProduct(r.phi) - p.moment);
  }
};

} // namespace hhtdae

#endif
