/*
  The rotation vector phi of a rotation matrix R = exp([phi]), computed from its unit quaternion; exact for angles up to
  pi, smooth at zero. Derivatives are correct for rotations of R, R -> (1 + [theta]) R; kernels use no other variations.

  The functions of s = |phi|^2 below are even functions of the angle, computed by series near zero.
*/
#ifndef HHTDAE_SCENE_KERNELS_ROTATION_VECTOR_H
#define HHTDAE_SCENE_KERNELS_ROTATION_VECTOR_H

#include "scene/frames.h"
#include <cmath>

namespace hhtdae
{

template <class T> struct Quaternion {
  T       w;
  Vec3<T> v;
};

/* The unit quaternion of R with w >= 0, by the one of four formulas that has the largest divisor (Shepperd 1978) */
template <class T> Quaternion<T> UnitQuaternion(const Mat3<T> &R)
{
  using std::sqrt;
  const T       trace = R(0, 0) + R(1, 1) + R(2, 2);
  Quaternion<T> q;
  int           i = 0;
  for (int k = 1; k < 3; k++)
    if (Plain(R(k, k)) > Plain(R(i, i))) i = k;
  if (Plain(trace) >= Plain(R(i, i))) {
    const T s = sqrt(T(1) + trace), r = T(0.5) / s;
    q.w    = T(0.5) * s;
    q.v(0) = r * (R(2, 1) - R(1, 2));
    q.v(1) = r * (R(0, 2) - R(2, 0));
    q.v(2) = r * (R(1, 0) - R(0, 1));
  } else {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const T   s = sqrt(T(1) + T(2) * R(i, i) - trace), r = T(0.5) / s;
    q.w    = r * (R(k, j) - R(j, k));
    q.v(i) = T(0.5) * s;
    q.v(j) = r * (R(j, i) + R(i, j));
    q.v(k) = r * (R(k, i) + R(i, k));
  }
  if (Plain(q.w) < 0) {
    q.w = -q.w;
    q.v = -q.v;
  }
  return q;
}

/* The rotation matrix of a unit quaternion */
template <class T> Mat3<T> RotationMatrix(const Quaternion<T> &q)
{
  const Mat3<T> V = Cross<T>(q.v), V2 = V * V;
  Mat3<T>       R;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) R(i, j) = T(i == j) + T(2) * (q.w * V(i, j) + V2(i, j));
  return R;
}

/* The quaternion of half the rotation; since w >= 0 the angle is at most half a turn, far from the singularity at a full turn */
template <class T> Quaternion<T> HalfTurn(const Quaternion<T> &q)
{
  using std::sqrt;
  const T       w1 = T(1) + q.w, r = T(1) / sqrt(T(2) * w1);
  Quaternion<T> h;
  h.w = w1 * r;
  h.v = q.v * r;
  return h;
}

template <class T> Vec3<T> RotationVector(const Quaternion<T> &q)
{
  using std::atan2;
  using std::sqrt;
  const T v2 = q.v.dot(q.v);
  T       factor;
  if (Plain(v2) < 1e-3 * Plain(q.w) * Plain(q.w)) { /* series of 2 atan(x)/x for x = |v|/w */
    const T y = v2 / (q.w * q.w);
    factor    = (T(1) - y * (T(1. / 3) - y * (T(1. / 5) - y * (T(1. / 7) - y * T(1. / 9))))) * T(2) / q.w;
  } else {
    const T v = sqrt(v2);
    factor    = T(2) * atan2(v, q.w) / v;
  }
  return q.v * factor;
}

/* (1 - a/2 cot(a/2)) / a^2 for s = a^2, a coefficient of the inverse differential of the exponential map,
   d phi = (1 - [phi]/2 + HalfCot [phi]^2) d theta for exp([phi]) -> (1 + [d theta]) exp([phi]) */
template <class T> T HalfCot(const T &s)
{
  using std::cos;
  using std::sin;
  using std::sqrt;
  if (Plain(s) < 0.05)
    return T(1. / 12) + s * (T(1. / 720) + s * (T(1. / 30240) + s * (T(1. / 1209600) + s * T(1. / 47900160))));
  const T half = T(0.5) * sqrt(s);
  return (T(1) - half * cos(half) / sin(half)) / s;
}

/* (a / sin a - 1) / a^2 for s = a^2 */
template <class T> T Cosecant(const T &s)
{
  using std::sin;
  using std::sqrt;
  if (Plain(s) < 0.01)
    return T(1. / 6) + s * (T(7. / 360) + s * (T(31. / 15120) + s * (T(127. / 604800) + s * T(73. / 3421440))));
  const T a = sqrt(s);
  return (a / sin(a) - T(1)) / s;
}

/* tan(a/2) / a for s = a^2 */
template <class T> T HalfTan(const T &s)
{
  using std::cos;
  using std::sin;
  using std::sqrt;
  if (Plain(s) < 0.01)
    return T(0.5) + s * (T(1. / 24) + s * (T(1. / 240) + s * (T(17. / 40320) + s * T(31. / 725760))));
  const T a = sqrt(s), half = T(0.5) * a;
  return sin(half) / (cos(half) * a);
}

} // namespace hhtdae

#endif
