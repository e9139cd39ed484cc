/*
  Regularized Coulomb friction: a force of magnitude mu N tanh(|v|/v_s) against the slip velocity v. The factor of v,
  -(mu N/v_s) tanh(x)/x with x = |v|/v_s, is an analytic function of x^2, so that the force is smooth at v = 0.
*/
#ifndef HHTDAE_SCENE_KERNELS_FRICTION_SLIP_H
#define HHTDAE_SCENE_KERNELS_FRICTION_SLIP_H

#include "scene/frames.h"
#include <cmath>

namespace hhtdae
{

/* tanh(x)/x as a function of y = x^2 */
template <class T> T TanhRatio(const T &y)
{
  using std::sqrt;
  using std::tanh;
  const double plain = Plain(y);
  if (plain < 1e-3) { /* Taylor series, truncated below rounding */
    T s = T(62. / 2835.) - T(1382. / 155925.) * y;
    s   = s * y - T(17. / 315.);
    s   = s * y + T(2. / 15.);
    s   = s * y - T(1. / 3.);
    s   = s * y + T(1);
    return s;
  }
  const T x = sqrt(y);
  if (plain > 400) return T(1) / x; /* tanh is 1 to rounding; cosh in its derivative would overflow for larger arguments */
  const T ratio = tanh(x) / x;
  return ratio;
}

/* The factor of the slip velocity in the friction force: F = SlipFactor(mu N, |v|^2, v_s) v */
template <class T> T SlipFactor(const T &limit, const T &speed2, double slip_velocity)
{
  const T y = speed2 * T(1 / (slip_velocity * slip_velocity));
  const T r = TanhRatio<T>(y);
  return limit * r * T(-1 / slip_velocity);
}

} // namespace hhtdae

#endif
