/*
  Jacobi's elliptic functions and the incomplete integral of the first kind by the arithmetic-geometric mean
  (Abramowitz and Stegun 16.4, 17.6), in long double: about 18 digits. With them, the motion of a pendulum.

  Modulus k and complementary modulus kc = sqrt(1 - k^2) are both given, because near k = 1 the caller knows kc to all
  its digits and 1 - k^2 would lose them.
*/
#ifndef HHTEX_ELLIPTIC_H
#define HHTEX_ELLIPTIC_H

#include <cmath>

namespace hhtex
{

struct Jacobi {
  long double sn, cn, dn, am;
};

inline Jacobi jacobi(long double u, long double k, long double kc)
{
  if (kc == 0.L) {
    const long double sech = 1.L / std::cosh(u);
    return {std::tanh(u), sech, sech, 2.L * std::atan(std::tanh(u / 2.L))};
  }
  long double a[32], c[32], b = kc;
  int         levels = 0;
  a[0]               = 1.L;
  c[0]               = k;
  while (levels < 31 && std::fabs(c[levels]) > 1e-20L * a[levels]) {
    a[levels + 1] = (a[levels] + b) / 2.L;
    c[levels + 1] = (a[levels] - b) / 2.L;
    b             = std::sqrt(a[levels] * b);
    levels++;
  }
  long double phi = std::ldexp(a[levels] * u, levels);
  for (int i = levels; i > 0; i--) phi = (phi + std::asin(c[i] / a[i] * std::sin(phi))) / 2.L;
  const long double sn = std::sin(phi), cn = std::cos(phi);
  return {sn, cn, std::sqrt(kc * kc + k * k * cn * cn), phi};
}

/* F(phi,k), by Landen's transformation */
inline long double ellipticF(long double phi, long double k, long double kc)
{
  if (kc == 0.L) return std::asinh(std::tan(phi));
  const long double twoPi = 8.L * std::atan(1.L);
  long double       a = 1.L, b = kc, c = k;
  int               levels = 0;
  while (levels < 31 && std::fabs(c) > 1e-20L * a) {
    const long double principal = std::atan2(b * std::sin(phi), a * std::cos(phi));
    phi += principal + twoPi * std::round((phi - principal) / twoPi); /* the branch next to phi */
    c                      = (a - b) / 2.L;
    const long double mean = (a + b) / 2.L;
    b                      = std::sqrt(a * b);
    a                      = mean;
    levels++;
  }
  return std::ldexp(phi, -levels) / a;
}

/*
  theta'' = -w^2 sin theta from theta_0, theta'_0 at t = 0. With k^2 = sin^2(theta_0/2) + (theta'_0/(2w))^2:

    k < 1 (swings)             sin(theta/2) = k sn(w t + u0, k)
    k > 1 (goes over the top)  theta/2 = am(k w t + u0, 1/k)
*/
struct PendulumMotion {
  long double theta, sine, cosine, omega, alpha; /* angle, its sine and cosine, theta', theta'' */

  PendulumMotion(long double w, long double theta0, long double omega0, long double t)
  {
    const long double h = omega0 / (2.L * w), s0 = std::sin(theta0 / 2.L), c0 = std::cos(theta0 / 2.L);
    const long double k = std::sqrt(s0 * s0 + h * h), kc2 = c0 * c0 - h * h; /* 1 - k^2 without cancellation */
    long double       s = 0.L, c = 1.L;                                      /* sin and cos of theta/2 */
    theta = omega = 0.L;
    if (k > 0.L && kc2 >= 0.L) {
      const long double kc = std::sqrt(kc2);
      const Jacobi      e  = jacobi(w * t + ellipticF(std::atan2(s0, h), k, kc), k, kc);
      s                    = k * e.sn;
      c                    = e.dn;
      theta                = 2.L * std::atan2(s, c);
      omega                = 2.L * w * k * e.cn;
    } else if (k > 0.L) {
      const long double direction = omega0 < 0.L ? -1.L : 1.L, kappa = 1.L / k, kappac = std::sqrt(-kc2) / k;
      const Jacobi      e = jacobi(direction * k * w * t + ellipticF(theta0 / 2.L, kappa, kappac), kappa, kappac);
      s                   = e.sn;
      c                   = e.cn;
      theta               = 2.L * e.am;
      omega               = direction * 2.L * w * k * e.dn;
    }
    sine   = 2.L * s * c;
    cosine = c * c - s * s;
    alpha  = -w * w * sine;
  }
};

} // namespace hhtex

#endif
