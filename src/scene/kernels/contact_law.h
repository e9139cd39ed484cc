/*
  The force of a contact as a function of penetration d, unit normal n (from body j to body i) and relative velocity v
  of i against j at the contact point, the rate of penetration being d' = -n.v:

    F = N n - mu N tanh(|v_t|/v_s) v_t/|v_t|,    N = k d^e g(1 + c d'),    v_t = v - (n.v) n

  Hunt and Crossley, "Coefficient of restitution interpreted as damping in vibroimpact", J. Appl. Mech. 42 (1975): the
  damping multiplies the elastic force, so that N is zero when contact begins and ends. Their law has 1 + c d' instead of g(1 +
  c d'), and the contact pulls when the bodies separate fast; g(s) is a twice continuously differentiable approximation of max(0, s), so that
  N is never negative. Since g is monotone and g(1) = 1, the difference between N and the elastic force always dissipates energy. The
  coefficient of restitution at impact speed u is about 1 - 2/3 c u.
*/
#ifndef HHTDAE_SCENE_KERNELS_CONTACT_LAW_H
#define HHTDAE_SCENE_KERNELS_CONTACT_LAW_H

#include "friction_slip.h"
#include "hhtdae/forces.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace hhtdae
{

/* g(s): equal to max(0, s) for |s| >= w; for |s| < w its slope rises from 0 to 1 as the cubic 3 u^2 - 2 u^3 */
template <class T> T SmoothRamp(const T &s)
{
  constexpr double w = 0.25;
  if (Plain(s) <= -w) return T(0);
  if (Plain(s) >= w) return s;
  const T u = (s + T(w)) * T(0.5 / w);
  return u * u * u * (T(1) - T(0.5) * u) * T(2 * w);
}

/* k d^e for d > 0 */
template <class T> T ElasticForce(const ContactLaw &law, const T &d)
{
  using std::pow;
  using std::sqrt;
  if (law.exponent == 1) return T(law.stiffness) * d;
  if (law.exponent == 1.5) {
    const T root = sqrt(d);
    return T(law.stiffness) * d * root;
  }
  const T power = pow(d, law.exponent);
  return T(law.stiffness) * power;
}

/* Elastic energy for d > 0, the integral of ElasticForce() */
inline double ElasticEnergy(const ContactLaw &law, double d) { return law.stiffness * std::pow(d, law.exponent + 1) / (law.exponent + 1); }

/* Upper bound on the step, s, so that bodies that approach at the speed `closing` do not pass through each other to where
   the law gives no force. At the end of the step the penetration is at most max_depth or, if that is larger, the present
   one plus 0.25 max_depth. For uniform straight motion the distance is a convex function of time, so that it never
   decreases faster than at present. */
inline double LongestApproach(double max_depth, double depth, double closing, double acceleration)
{
  const double distance = std::max(max_depth - depth, 0.25 * max_depth), speed = closing + std::sqrt(closing * closing + 2 * acceleration * distance);
  return speed > 0 ? 2 * distance / speed : std::numeric_limits<double>::infinity();
}

/* F for d > 0, in the same axes as n and v */
template <class T> Vec3<T> ContactForce(const ContactLaw &law, const T &d, const Vec3<T> &n, const Vec3<T> &v)
{
  const T approach = -n.dot(v);
  const T s        = T(1) + T(law.damping) * approach;
  const T elastic  = ElasticForce<T>(law, d);
  const T damping  = SmoothRamp<T>(s);
  const T N        = elastic * damping;
  Vec3<T> F        = n * N;
  if (law.friction > 0) {
    const Vec3<T> slip   = v + n * approach;
    const T       speed2 = slip.squaredNorm(), limit = N * T(law.friction);
    const T       factor = SlipFactor<T>(limit, speed2, law.slip_velocity);
    F += slip * factor;
  }
  return F;
}

} // namespace hhtdae

#endif
