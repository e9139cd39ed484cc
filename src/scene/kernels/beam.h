/*
  A two-node Timoshenko beam from j (x = 0) to i (x = L) along the x axes of the markers, linear in a co-rotated frame.

  The co-rotated frame is the mean frame of the two markers, halfway on the rotation from j to i, E = R_j exp([phi]/2),
  which treats both ends alike. In its axes, with d = x_i - x_j,

    u = d - (L, 0, 0)    relative displacement,        phi    relative rotation, half of it at each end

  The mean rotation in this frame is zero. So the 12 x 12 stiffness of the linear element (Przemieniecki 1968, with the shear
  parameters Phi_y = 12 E I_zz/(G A_y L^2), Phi_z = 12 E I_yy/(G A_z L^2)) becomes diagonal in (u, phi):

    K_u   = EA/L,  12 E I_zz/((1 + Phi_y) L^3),  12 E I_yy/((1 + Phi_z) L^3)
    K_phi = GJ/L,  E I_yy/L,  E I_zz/L

  The potential is u^T K_u u/2 + phi^T K_phi phi/2. The stress resultants are n = K_u (u + zeta u'), q = K_phi (phi + zeta
  phi'), with the damping zeta, s, and the exact rates u', phi' in the moving frame. The principle of virtual work, with the differentials of E
  and phi, gives

    f   = -n                                                   force on i
    m_i = (s - HalfTan s x phi)/2 - P q,   s = d x n           moment on i about its origin; P: phi' = P (w_i - w_j)

  in the axes E. Displacements and rotations of the whole beam may be arbitrarily large. The relative rotation of the two ends must stay
  below half a turn, and the element is accurate for moderate relative rotations: large bending requires several elements.
*/
#ifndef HHTDAE_SCENE_KERNELS_BEAM_H
#define HHTDAE_SCENE_KERNELS_BEAM_H

#include "hhtdae/types.h"
#include "scene/kernels/relative_force.h"

namespace hhtdae
{

template <bool Damped> struct BeamForce : RelativeForce<BeamForce<Damped>, Damped> {
  static constexpr const char *name = Damped ? "beam" : "undamped beam";
  struct Data {
    double  length;
    Vector3 stretching, turning; /* diagonals of K_u and K_phi */
    double  damping;
  };

  /* The data of a cross-section. Shear areas of zero mean no shear deformation (Euler-Bernoulli beam) */
  static Data section(double L, double E, double G, double area, double Iyy, double Izz, double J, double shear_y,
                      double shear_z, double damping)
  {
    const double phi_y = shear_y > 0 ? 12 * E * Izz / (G * shear_y * L * L) : 0;
    const double phi_z = shear_z > 0 ? 12 * E * Iyy / (G * shear_z * L * L) : 0;
    return {L,
            {E * area / L, 12 * E * Izz / ((1 + phi_y) * L * L * L), 12 * E * Iyy / ((1 + phi_z) * L * L * L)},
            {G * J / L, E * Iyy / L, E * Izz / L},
            damping};
  }

  template <class T> static Mat3<T> axes(const Mat3<T> &Rj, const Quaternion<T> &q)
  {
    return Rj * RotationMatrix<T>(HalfTurn<T>(q));
  }
  static Mat3<double> spin(const Vec3<double> &phi)
  {
    const Vec3<double> x = 0.5 * phi;
    return 0.5 * Mat3<double>::Identity() - 0.5 * HalfTan<double>(x.squaredNorm()) * Cross<double>(x);
  }
  static Mat3<double> turn(const Vec3<double> &phi)
  {
    const Mat3<double> X = Cross<double>(0.5 * phi);
    return Mat3<double>::Identity() - Cosecant<double>(0.25 * phi.squaredNorm()) * X * X;
  }

  template <class T> static void local(const Data &p, const Relative<T> &r, T *c)
  {
    const Vec3<T> x  = r.phi * T(0.5);
    const T       a2 = x.dot(x), tau = HalfTan<T>(a2), csc = Cosecant<T>(a2);
    Vec3<T>       u = r.d, phi = r.phi;
    u(0) -= T(p.length);
    if constexpr (Damped) {
      const Vec3<T> w = r.wi - r.wj, xw = x.cross(w), xxw = x.cross(xw);
      const Vec3<T> mean = (r.wi + r.wj - xw * tau) * T(0.5), du = r.v - mean.cross(r.d);
      u += du * T(p.damping);
      phi += (w - xxw * csc) * T(p.damping);
    }
    Vec3<T> n, q;
    for (int k = 0; k < 3; k++) {
      n(k) = u(k) * T(p.stretching(k));
      q(k) = phi(k) * T(p.turning(k));
    }
    const Vec3<T> s = r.d.cross(n), sx = s.cross(x), xq = x.cross(q), xxq = x.cross(xq);
    for (int k = 0; k < 3; k++) {
      c[k]     = -n(k);
      c[3 + k] = T(0.5) * (s(k) - tau * sx(k)) - q(k) + csc * xxq(k);
    }
  }

  static double energy(const Data &p, const Frame<double> *f)
  {
    Mat3<double> E;
    const auto   r = BeamForce<false>::template relative<double>(f, nullptr, E);
    Vector3      u = r.d;
    u(0) -= p.length;
    return 0.5 * u.dot(p.stretching.cwiseProduct(u)) + 0.5 * r.phi.dot(p.turning.cwiseProduct(r.phi));
  }
};

} // namespace hhtdae

#endif
