/* Vectorized loops over vectors: both versions give the same result, also for lengths that are not multiples of four,
   and write nothing beyond the end */
#include "integrator/sweeps.h"
#include "support.h"
#include <cmath>
#include <limits>
#include <random>

using namespace hht3;

namespace
{

/* y = a y + x, the sum of squares and the largest size of y before */
struct Probe {
  PetscScalar        a;
  const PetscScalar *x;
  PetscScalar       *y;
  Four               sum = {0, 0, 0, 0}, largest = {0, 0, 0, 0};

  template <class At>
  HHT3_INLINE void operator()(const At &at)
  {
    const Four old = at.get(y);
    sum += old * old;
    largest = Larger(Absolute(old), largest);
    at.put(y, a * old + at.get(x));
  }
};

std::vector<PetscScalar> random(PetscInt n, unsigned seed)
{
  std::mt19937                           engine(seed);
  std::uniform_real_distribution<double> in(-1, 1);
  std::vector<PetscScalar>               x;
  for (PetscInt i = 0; i < n; i++) x.push_back(in(engine));
  return x;
}

PetscReal Most(const Four &v) { return std::max(std::max(v[0], v[1]), std::max(v[2], v[3])); }

} // namespace

TEST(Sweeps, EveryLengthAndNothingBeyond)
{
  for (PetscInt n = 0; n <= 13; n++) {
    const auto x = random(n, 1), before = random(n + 4, 2);
    auto       y   = before;
    const auto end = Sweep(n, Probe{3, x.data(), y.data()});
    PetscReal  sum = 0, most = 0;
    for (PetscInt i = 0; i < n; i++) {
      EXPECT_DOUBLE_EQ(y[i], 3 * before[i] + x[i]) << i << " of " << n;
      sum += before[i] * before[i];
      most = std::max(most, std::abs(before[i]));
    }
    for (PetscInt i = n; i < n + 4; i++) EXPECT_EQ(y[i], before[i]) << i << " of " << n;
    EXPECT_NEAR(Total(end.sum), sum, 1e-14) << n;
    EXPECT_EQ(Most(end.largest), most) << n;
  }
}

#if defined(__x86_64__) && defined(__GNUC__)
TEST(Sweeps, BothVersionsGiveTheSameDigits)
{
  if (!NewerProcessor()) GTEST_SKIP() << "the processor runs one version only";
  for (PetscInt n : {5, 64, 1003}) {
    const auto x = random(n, 3);
    auto       y = random(n, 4), z = y;
    const auto plain = SweepPlain(n, Probe{1 / 3., x.data(), y.data()}), newer = SweepNewer(n, Probe{1 / 3., x.data(), z.data()});
    EXPECT_EQ(y, z);
    EXPECT_EQ(Total(plain.sum), Total(newer.sum));
  }
}
#endif

/* A multiplier enters the corrector's norm as 0 times its correction; a NaN in it must nevertheless be noticed */
TEST(Sweeps, NoNumberStaysNoNumber)
{
  const std::vector<PetscScalar> x(6, 0);
  for (PetscInt at = 0; at < 6; at++) {
    std::vector<PetscScalar> y(6, 1);
    y[at] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(std::isnan(Total(Sweep(6, Probe{0, x.data(), y.data()}).sum))) << at;
    EXPECT_TRUE(std::isnan(y[at])) << at;
  }
}
