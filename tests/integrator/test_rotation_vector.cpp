/* Rotation vectors for orders above two, against Rodrigues' formula and the series of the tangent operator */
#include "integrator/coordinates/rotation_vector.h"
#include "support.h"
#include <array>
#include <random>

using namespace hht3;

namespace
{

using Vector = std::array<PetscScalar, 3>;

/* exp([x]) y by Rodrigues' formula */
Vector rotated(const Vector &x, const Vector &y)
{
  const double a = VectorLength(x.data()), along = a > 0 ? Dot(x.data(), y.data()) / (a * a) : 0;
  Vector       c, r;
  Cross(a > 0 ? std::sin(a) / a : 1, x.data(), y.data(), c.data());
  for (int i = 0; i < 3; i++) r[i] = std::cos(a) * y[i] + c[i] + (1 - std::cos(a)) * along * x[i];
  return r;
}

/* T(x) y = sum [x]^k y/(k+1)! */
Vector tangent(const Vector &x, const Vector &y)
{
  Vector term = y, sum = y;
  for (int k = 1; k < 40; k++) {
    Vector next;
    Cross(1. / (k + 1), x.data(), term.data(), next.data());
    term = next;
    for (int i = 0; i < 3; i++) sum[i] += term[i];
  }
  return sum;
}

struct Random {
  std::mt19937                           engine{7};
  std::uniform_real_distribution<double> in{-1, 1};
  Vector                                 operator()(double size)
  {
    Vector x{in(engine), in(engine), in(engine)};
    for (auto &c : x) c *= size;
    return x;
  }
};

} // namespace

TEST(RotationVector, Relative)
{
  Random random;
  for (double size : {1e-12, 1e-5, .1, 1., 1.8})
    for (int n = 0; n < 20; n++) {
      const Vector x = random(size), y = random(size), z = random(1);
      Vector       r;
      RelativeRotation(x.data(), Turn(y.data()), r.data());
      const Vector one = rotated(r, rotated(y, z)), other = rotated(x, z);
      for (int i = 0; i < 3; i++) EXPECT_NEAR(one[i], other[i], 4e-15) << size;
      EXPECT_LE(VectorLength(r.data()), PETSC_PI * (1 + 1e-15));
    }
  const Vector x{1e-9, 2e-9, -1e-9}, none{};
  Vector       r;
  RelativeRotation(x.data(), Turn(none.data()), r.data());
  for (int i = 0; i < 3; i++) EXPECT_NEAR(r[i], x[i], 1e-24);
}

TEST(RotationVector, Stumpff)
{
  for (double a : {0., 1e-3, .3, .99999, 1.00001, 2.5}) {
    const Stumpff f(a * a);
    double        s[6] = {}, term = 1;
    for (int m = 2; m < 6; m++) {
      term = 1;
      for (int k = 2; k <= m; k++) term /= k;
      for (int k = 0; k < 20; k++) {
        s[m] += term;
        term *= -a * a / ((2 * k + m + 1) * (2 * k + m + 2));
      }
    }
    EXPECT_NEAR(f.s2, s[2], 2e-16) << a;
    EXPECT_NEAR(f.s3, s[3], 2e-16) << a;
    EXPECT_NEAR(f.s4, s[4], 2e-16) << a;
    EXPECT_NEAR(f.s5, s[5], 2e-16) << a;
  }
}

/* Solves x - base = T(x)^{-1} g, for rotations as large as those of a step and larger */
TEST(RotationVector, Implicit)
{
  Random random;
  for (double size : {1e-9, 1e-3, .1, .5, 1.})
    for (int n = 0; n < 50; n++) {
      const Vector base = random(size), g = random(size);
      Vector       x;
      ImplicitRotation(base.data(), g.data(), x.data());
      const Vector left = tangent(x, {x[0] - base[0], x[1] - base[1], x[2] - base[2]});
      for (int i = 0; i < 3; i++) EXPECT_NEAR(left[i], g[i], 4e-15 * std::max(size, 1e-9)) << size;
    }
  const PetscScalar nan = std::nan("");
  Vector            x, bad{nan, 0, 0}, g{1, 0, 0};
  ImplicitRotation(bad.data(), g.data(), x.data());
  EXPECT_TRUE(std::isnan(x[0]));
}
