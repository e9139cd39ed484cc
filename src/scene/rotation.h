/*
  Attitude of a body as a function of its three rotational coordinates U: dA = [G dU] A, G the matrix of 3-1-3 Euler angles (euler.h) or, by
  default, the tangent operator of a local rotation vector.

  A local rotation vector x, in space axes, rotates the body from a reference attitude C: A = exp([x]) C. The reference is the
  attitude at the last accepted state, so that x is the rotation in the present step. G is singular at a full turn;
  step_limit.cpp keeps the rotation of a step far below that. The velocities and accelerations of these coordinates are the
  angular velocity w and its derivative, which do not depend on the reference. With x = 0 at the beginning of a step,
  Newmark's relations are those of the generalized-alpha method on the rotation group, see
  src/integrator/coordinates/rotations.cpp. The moment equations of a body are multiplied by G^T in both cases, as generalized
  forces.

    exp([x]) = 1 + S1 [x] + S2 [x]^2,    G = 1 + S2 [x] + S3 [x]^2,    w = G x',    S_m(z) = sum (-z)^k/(2k+m)!,  z = |x|^2

  are Stumpff's functions: S1 = sin a/a, S2 = (1 - cos a)/a^2, ..., with dS_m/dz = (m S_{m+2} - S_{m+1})/2 and S_m = 1/m! - z S_{m+2}.
*/
#ifndef HHTDAE_SCENE_ROTATION_H
#define HHTDAE_SCENE_ROTATION_H

#include "frames.h"

namespace hhtdae
{

/* S1 to S5 at z, to machine precision; s[0] is not used */
struct Stumpff {
  double s[6];
  explicit Stumpff(double z)
  {
    if (z > 1) {
      const double a = std::sqrt(z);
      s[1]           = std::sin(a) / a;
      s[2]           = (1 - std::cos(a)) / z;
      for (int m = 3; m < 6; m++) s[m] = (1. / (m == 3 ? 1 : m == 4 ? 2 : 6) - s[m - 2]) / z;
      return;
    }
    s[5] = 1 / 120. - z * (1 / 5040. - z * (1 / 362880. - z * (1 / 39916800. - z * (1 / 6227020800. - z * (1 / 1307674368000. - z * (1 / 355687428096000.))))));
    s[4] = 1 / 24. - z * (1 / 720. - z * (1 / 40320. - z * (1 / 3628800. - z * (1 / 479001600. - z * (1 / 87178291200. - z * (1 / 20922789888000.))))));
    for (int m = 3; m > 0; m--) s[m] = 1. / (m == 3 ? 6 : m) - z * s[m + 2];
  }
};

inline void LocalFrame(const Vector3 &x, const Matrix3 &C, Matrix3 &A, Matrix3 &G)
{
  const double  z = x.squaredNorm();
  const Stumpff f(z);
  const Matrix3 X = Cross<double>(x), X2 = x * x.transpose() - z * Matrix3::Identity();
  A.noalias() = (Matrix3::Identity() + f.s[1] * X + f.s[2] * X2) * C;
  G           = Matrix3::Identity() + f.s[2] * X + f.s[3] * X2;
}

/* d(G^T m)/dx for fixed m */
inline Matrix3 LocalMomentGradient(const Vector3 &x, const Vector3 &m)
{
  const double  z = x.squaredNorm(), along = x.dot(m);
  const Stumpff f(z);
  const double  d2 = 2 * f.s[4] - f.s[3], d3 = 3 * f.s[5] - f.s[4]; /* 2 dS2/dz, 2 dS3/dz */
  return f.s[2] * Cross<double>(m) + f.s[3] * (along * Matrix3::Identity() + x * m.transpose() - 2 * m * x.transpose()) +
         (d3 * (along * x - z * m) - d2 * x.cross(m)) * x.transpose();
}

/* The unit quaternion of exp([x]) */
inline Eigen::Quaterniond LocalTurn(const Vector3 &x)
{
  const double  z = 0.25 * x.squaredNorm();
  const Stumpff f(z);
  const Vector3 v = 0.5 * f.s[1] * x;
  return {1 - z * f.s[2], v(0), v(1), v(2)};
}

} // namespace hhtdae

#endif
