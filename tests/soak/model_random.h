/* Random numbers that are the same on every machine, so that model k of seed s is always the same */
#ifndef HHTDAE_SOAK_MODEL_RANDOM_H
#define HHTDAE_SOAK_MODEL_RANDOM_H

#include "hhtdae/types.h"
#include <cmath>
#include <cstdint>
#include <initializer_list>

namespace soak
{

using hhtdae::Matrix3;
using hhtdae::Vector3;

/* splitmix64 */
class Random
{
public:
  Random(std::uint64_t seed, std::uint64_t number)
      : state_(seed * 0x9E3779B97F4A7C15ull + number * 0xD1B54A32D192ED03ull)
  {
    next();
  }

  double uniform(double a = 0, double b = 1) { return a + (b - a) * ((double)(next() >> 11) * 0x1p-53); }
  double logarithmic(double a, double b) { return a * std::pow(b / a, uniform()); }
  bool   chance(double p) { return uniform() < p; }
  int    integer(int a, int b) { return a + (int)(next() % (std::uint64_t)(b - a + 1)); } /* both ends included */
  double sign() { return chance(0.5) ? 1 : -1; }

  /* an index, chosen with a probability proportional to its weight */
  int choose(std::initializer_list<double> weights)
  {
    double sum = 0;
    for (double w : weights) sum += w;
    double x = uniform(0, sum);
    int    k = 0;
    for (double w : weights) {
      if (x < w) return k;
      x -= w;
      k++;
    }
    return k - 1;
  }

  Vector3 vector() /* of length 1 or less */
  {
    for (;;) {
      const double  x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
      const Vector3 v(x, y, z);
      if (v.squaredNorm() <= 1) return v;
    }
  }
  Vector3 direction()
  {
    for (;;) {
      const Vector3 v = vector();
      if (v.norm() > 0.1) return v.normalized();
    }
  }
  Matrix3 rotation()
  {
    const Vector3 axis = direction();
    return Eigen::AngleAxisd(uniform(-M_PI, M_PI), axis).toRotationMatrix();
  }

private:
  std::uint64_t state_;

  std::uint64_t next()
  {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15ull;
    z               = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z               = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    return z ^ (z >> 31);
  }
};

} // namespace soak

#endif
