/*
  The relative angle of marker i about z_j, and the advance of i along an axis of j: values, rates, gradients and
  curvatures, shared by motions, couplers and torsional springs.

  The angle is that of the projection of x_i on the xy plane of j, from x_j, positive about z_j,

    theta = atan2(x_i . y_j, x_i . x_j),    d theta = g . (d theta_i - d theta_j),    g = (z_j - h x_i)/(1 - h^2),  h =
  x_i . z_j,

  This is exact even if the z axes are not parallel; if they are, g = z_j. The angle is undefined if x_i is along z_j:
  derivatives are then not finite, and the step fails.
*/
#ifndef HHTDAE_SCENE_KERNELS_ANGLE_H
#define HHTDAE_SCENE_KERNELS_ANGLE_H

#include "scene/kernel.h"
#include <cmath>
#include <limits>

namespace hhtdae
{

constexpr double kTurn = 6.283185307179586477;

/* theta + 2 pi n with the integer n that makes it nearest to `near` */
template <class T> T Unwind(const T &theta, double near)
{
  return theta + T(kTurn * std::round((near - Plain(theta)) / kTurn));
}

/* The angle in (-pi, pi]; values within rounding of -pi become pi (CountedAngles.HalfATurnAtTheStart) */
template <class T> T PrincipalAngle(const Frame<T> &i, const Frame<T> &j)
{
  const T s = i.R.col(0).dot(j.R.col(1)), c = i.R.col(0).dot(j.R.col(0));
  using std::atan2;
  const T theta = atan2(s, c);
  return Plain(theta) < -kTurn / 2 + 1e-12 ? theta + T(kTurn) : theta;
}

/* The angle with full turns: the value within half a turn of `remembered`, which is the angle at the last accepted step */
template <class T> T UnwoundAngle(const Frame<T> &i, const Frame<T> &j, double remembered)
{
  return Unwind<T>(PrincipalAngle<T>(i, j), remembered);
}

/* g, the derivative of the angle by rotations of i; the derivative by rotations of j is -g */
template <class T> Vec3<T> AngleGradient(const Frame<T> &i, const Frame<T> &j)
{
  const T       h = i.R.col(0).dot(j.R.col(2)), k = T(1) / (T(1) - h * h);
  const Vec3<T> n = j.R.col(2) - i.R.col(0) * h;
  return n * k;
}

/* Time, s, in which an angle with this rate and acceleration changes by two radians. Counting full turns requires a
   change of less than half a turn between accepted steps; the difference is a margin for rates that grow */
inline double LongestTurn(double rate, double acceleration)
{
  const double fast = std::fabs(rate) + std::sqrt(rate * rate + 4 * std::fabs(acceleration));
  return fast > 0 ? 4 / fast : std::numeric_limits<double>::infinity(); /* also if the rate is NaN */
}

/* The exact time derivative of the angle */
template <class T> T AngleRate(const Frame<T> &i, const Frame<T> &j, const Twist<T> &wi, const Twist<T> &wj)
{
  const Vec3<T> g = AngleGradient<T>(i, j), w = wi.w - wj.w;
  return g.dot(w);
}

/* dg/d theta_i and dg/d theta_j */
inline void AngleCurvature(const Frame<double> &i, const Frame<double> &j, Mat3<double> &Gi, Mat3<double> &Gj)
{
  const Vec3<double> x = i.R.col(0), z = j.R.col(2), q = x.cross(z);
  const double       h = x.dot(z), k = 1 / (1 - h * h);
  const Vec3<double> g = k * (z - h * x);
  const Mat3<double> A = (2 * h * g - x) * q.transpose();
  Gi                   = k * (A + h * Cross<double>(x));
  Gj                   = -k * (A + Cross<double>(z));
}

/* Whether the angle is well defined: x_i and z_j enclose at least about one degree */
inline bool AngleDefined(const Frame<double> &i, const Frame<double> &j)
{
  return std::abs(i.R.col(0).dot(j.R.col(2))) < 0.9998;
}

/* The component of x_i - x_j along an axis of j */
template <class T> T Advance(const Frame<T> &i, const Frame<T> &j, int axis)
{
  const Vec3<T> u = i.x - j.x;
  return u.dot(j.R.col(axis));
}

/* Its exact time derivative, including the rotation of j's axis */
template <class T> T AdvanceRate(const Frame<T> &i, const Frame<T> &j, const Twist<T> &wi, const Twist<T> &wj, int axis)
{
  const Vec3<T> e = j.R.col(axis), u = i.x - j.x, v = wi.v - wj.v, m = e.cross(u);
  const T       along = e.dot(v), turning = m.dot(wj.w);
  return along + turning;
}

/* Add the gradient (a row) or the curvature of angle and advance, times `factor`; columns are the 12 directions (x_i, theta_i, x_j, theta_j) */
template <class Row> void AddAngleGradient(const Frame<double> &i, const Frame<double> &j, double factor, Row &&J)
{
  const Vec3<double> g = factor * AngleGradient<double>(i, j);
  J.template segment<3>(3) += g.transpose();
  J.template segment<3>(9) -= g.transpose();
}

template <class Block> void AddAngleCurvature(const Frame<double> &i, const Frame<double> &j, double factor, Block &&H)
{
  Mat3<double> Gi, Gj;
  AngleCurvature(i, j, Gi, Gj);
  H.template block<3, 3>(3, 3) += factor * Gi;
  H.template block<3, 3>(3, 9) += factor * Gj;
  H.template block<3, 3>(9, 3) -= factor * Gi;
  H.template block<3, 3>(9, 9) -= factor * Gj;
}

template <class Row>
void AddAdvanceGradient(const Frame<double> &i, const Frame<double> &j, int axis, double factor, Row &&J)
{
  const Vec3<double> e = factor * j.R.col(axis), u = i.x - j.x;
  J.template segment<3>(0) += e.transpose();
  J.template segment<3>(6) -= e.transpose();
  J.template segment<3>(9) += e.cross(u).transpose();
}

template <class Block>
void AddAdvanceCurvature(const Frame<double> &i, const Frame<double> &j, int axis, double factor, Block &&H)
{
  const Vec3<double> u = i.x - j.x;
  const Mat3<double> E = Cross<double>(factor * j.R.col(axis));
  H.template block<3, 3>(0, 9) -= E;
  H.template block<3, 3>(6, 9) += E;
  H.template block<3, 3>(9, 0) += E;
  H.template block<3, 3>(9, 6) -= E;
  H.template block<3, 3>(9, 9) += Cross<double>(u) * E;
}

/* Whether block (a, b) of these curvatures can be nonzero, for Constraint::curved(); a and b are in 0..3 */
constexpr bool AngleCurved(int a, int b) { return (a == 1 || a == 3) && (b == 1 || b == 3); }
constexpr bool AdvanceCurved(int a, int b) { return (a == 3 && b != 1) || (b == 3 && a != 1); }

} // namespace hhtdae

#endif
