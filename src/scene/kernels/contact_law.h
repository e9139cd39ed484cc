/*
  The force of a contact as a function of penetration d, unit normal n (from body j to body i) and relative velocity v
  of i against j at the contact point, the rate of penetration being d' = -n.v:

    F = N n - mu N tanh(|v_t|/v_s) v_t/|v_t|,    N = k d^e g(1 + c d'),    v_t = v - (n.v) n

  Hunt and Crossley, "Coefficient of restitution interpreted as damping in vibroimpact", J. Appl. Mech. 42 (1975): the
  damping is a factor of the elastic force, so that N starts and ends at zero. Their law has 1 + c d' in place of g(1 +
  c d') and pulls when the bodies part fast; g(s) is a twice continuously differentiable max(0, s). As g is monotone and
  g(1) = 1, what N adds to the elastic force always takes energy. N is never negative. Coefficient of restitution at
  impact speed u: about 1 - 2/3 c u.
*/
#ifndef HHTDAE_SCENE_KERNELS_CONTACT_LAW_H
#define HHTDAE_SCENE_KERNELS_CONTACT_LAW_H

#include "friction_slip.h"
#include "hhtdae/forces.h"

namespace hhtdae
{

struct ContactLawData : ContactLaw {
  double onset = 0; /* penetration within which the linear law (exponent 1) sets in smoothly */
};

/* max(0, s), exact outside |s| < w; in between the slope rises from 0 to 1 by the cubic 3 u^2 - 2 u^3 */
template <class T> T SmoothRamp(const T &s)
{
  constexpr double w = 0.25;
  if (Plain(s) <= -w) return T(0);
  if (Plain(s) >= w) return s;
  const T u = (s + T(w)) * T(0.5 / w);
  return u * u * u * (T(1) - T(0.5) * u) * T(2 * w);
}

/* k d^e for d > 0. With e = 1 the kink at d = 0 is taken away by the factor 3 u^2 - 2 u^3, u = d/onset, until u = 1. */
template <class T> T ElasticForce(const ContactLawData &law, const T &d)
{
  using std::pow;
  using std::sqrt;
  if (law.exponent == 1) {
    if (Plain(d) >= law.onset) return T(law.stiffness) * d;
    const T u = d * T(1 / law.onset);
    return T(law.stiffness) * d * u * u * (T(3) - T(2) * u);
  }
  if (law.exponent == 1.5) {
    const T root = sqrt(d);
    return T(law.stiffness) * d * root;
  }
  const T power = pow(d, law.exponent);
  return T(law.stiffness) * power;
}

/* the work that it takes to get to d > 0: the integral of ElasticForce() */
inline double ElasticEnergy(const ContactLawData &law, double d)
{
  const double e = law.exponent, k = law.stiffness, o = law.onset;
  if (e == 1 && d < o) return k * d * d * (d / o) * (d / o) * (0.75 - 0.4 * d / o);
  if (e == 1) return k * (0.5 * d * d - 0.15 * o * o);
  return k * std::pow(d, e + 1) / (e + 1);
}

/* F for d > 0, in the axes of n and v */
template <class T> Vec3<T> ContactForce(const ContactLawData &law, const T &d, const Vec3<T> &n, const Vec3<T> &v)
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
