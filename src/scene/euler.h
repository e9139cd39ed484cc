/* 3-1-3 Euler angles (phi, theta, psi): A = Rz(phi) Rx(theta) Rz(psi); angular velocity in space axes w = G eps'. */
#ifndef HHTDAE_SCENE_EULER_H
#define HHTDAE_SCENE_EULER_H

#include "hhtdae/types.h"
#include <cmath>

namespace hhtdae
{

/* Columns of G: the axes, in space, about which phi, theta and psi turn. The first is the z axis of space. */
struct EulerAxes {
  Vector3 g2, g3;
  EulerAxes() = default;
  explicit EulerAxes(const Matrix3 &G) : g2(G.col(1)), g3(G.col(2)) {}
  Matrix3 G() const
  {
    Matrix3 m;
    m << 0, g2(0), g3(0), 0, g2(1), g3(1), 1, g2(2), g3(2);
    return m;
  }
  Vector3 p() const { return g2.cross(g3); } /* d g3 / d theta */
};

inline Vector3 CrossZ(const Vector3 &a) { return {-a(1), a(0), 0}; } /* z x a */

inline void EulerFrame(const double eps[3], Matrix3 &A, EulerAxes &e)
{
  const double sp = std::sin(eps[0]), cp = std::cos(eps[0]), st = std::sin(eps[1]), ct = std::cos(eps[1]);
  const double ss = std::sin(eps[2]), cs = std::cos(eps[2]);
  e.g2 = {cp, sp, 0};
  e.g3 = {sp * st, -cp * st, ct};
  const Vector3 y(-sp * ct, cp * ct, st); /* second axis before the rotation by psi */
  A.col(0) = cs * e.g2 + ss * y;
  A.col(1) = cs * y - ss * e.g2;
  A.col(2) = e.g3;
}

inline Vector3 EulerAngles(const Matrix3 &A)
{
  const double st = std::hypot(A(2, 0), A(2, 1));
  return {std::atan2(A(0, 2), -A(1, 2)), std::atan2(st, A(2, 2)), std::atan2(A(2, 0), A(2, 1))};
}

/* w = G eps' */
inline Vector3 AngularVelocity(const EulerAxes &e, const Vector3 &rate)
{
  return Vector3(0, 0, rate(0)) + rate(1) * e.g2 + rate(2) * e.g3;
}
/* c, the part of w' = G eps'' + c that is quadratic in the rates */
inline Vector3 Convective(const EulerAxes &e, const Vector3 &rate, const Vector3 &w)
{
  return rate(0) * CrossZ(w) + rate(1) * rate(2) * e.p();
}
/* d(G x)/d eps for fixed x, given y = G x */
inline Matrix3 RateGradient(const EulerAxes &e, const Vector3 &x, const Vector3 &y)
{
  Matrix3 W;
  W.col(0) = CrossZ(y);
  W.col(1) = x(2) * e.p();
  W.col(2).setZero();
  return W;
}
/* d(G^T m)/d eps for fixed m */
inline Matrix3 MomentGradient(const EulerAxes &e, const Vector3 &m)
{
  Matrix3 D = Matrix3::Zero();
  D(1, 0) = CrossZ(e.g2).dot(m);
  D(2, 0) = CrossZ(e.g3).dot(m);
  D(2, 1) = e.p().dot(m);
  return D;
}
/* eps' = G^-1 w, singular at sin theta = 0 */
inline Vector3 EulerRates(const EulerAxes &e, const Vector3 &w)
{
  const double s2    = 1 - e.g3(2) * e.g3(2); /* sin^2 theta */
  const double theta = e.g2.dot(w), along = w(2), spin = e.g3.dot(w);
  const double psi   = (spin - e.g3(2) * along) / s2;
  return {along - e.g3(2) * psi, theta, psi};
}

/* A body gets new axes if |sin theta| is below this value, that is within 30 degrees of the singularity. */
constexpr double singular_sine = 0.5;

/*
  Axes for a body of attitude A (body axes as columns) with angular velocity w: the constant rotation C of A = A313(eps) C for which a
  steady rotation never needs other axes. With the third axis along w, theta is constant. With the third axis horizontal and normal to w,
  theta oscillates about 90 degrees by the angle between w and the horizontal plane. The better of the two choices keeps |cos theta| <= 0.71.
*/
Matrix3 ChooseAxes(const Matrix3 &A, const Vector3 &w);

} // namespace hhtdae

#endif
