/* Kernels of joints: derivatives over random states, what their multipliers are, and whether the checks themselves can
 * fail */
#include "kernel_checks.h"
#include "scene/kernels/primitives.h"
#include "scene/kernels/primitives_axes.h"

#include <gtest/gtest-spi.h>

using namespace hhtdae;

TEST(JointKernels, PointsDerivatives)
{
  CheckConstraint<Coincide>();
  CheckConstraint<Coincide2>();
  const auto plane = [](Random &random) { return OnPlane<2>::Data{random(-1, 1)}; };
  CheckConstraint<OnPlane<2>>(plane);
  CheckConstraint<OnPlane<1>>([](Random &random) { return OnPlane<1>::Data{random(-1, 1)}; });
  CheckConstraint<OnLine>();
  CheckConstraint<Distance>([](Random &random) { return Distance::Data{random(.1, 3)}; });
}

TEST(JointKernels, AxesDerivatives)
{
  CheckConstraint<AxesPerpendicular<2, 2>>();
  CheckConstraint<AxesPerpendicular<0, 1>>();
  CheckConstraint<Parallel>();
  CheckConstraint<Orient>();
  CheckConstraint<OrientInPlane>();
}

/* ---- the checks themselves ---- */

namespace
{

/* number of failures inside f, which are not reported */
int Failures(const std::function<void()> &f)
{
  testing::TestPartResultArray results;
  {
    testing::ScopedFakeTestPartResultReporter reporter(testing::ScopedFakeTestPartResultReporter::INTERCEPT_ALL_THREADS,
                                                       &results);
    f();
  }
  return results.size();
}

struct WrongGradient : OnLine {
  static void gradient(const Empty &d, const Frame<double> *f, double t, Gradient &J)
  {
    OnLine::gradient(d, f, t, J);
    J(1, 10) *= 1.00001;
  }
};
struct WrongCurvature : OnLine {
  static void curvature(const Empty &d, const Frame<double> *f, double t, const double *lambda, Hessian &H)
  {
    OnLine::curvature(d, f, t, lambda, H);
    H(9, 10) = H(10, 9); /* turns do not commute */
  }
};
struct WrongDepends : OnLine {
  static constexpr unsigned depends = Position(0) | Position(1);
};
struct WrongCurved : OnLine {
  static constexpr bool curved(int a, int b) { return OnLine::curved(a, b) && a != b; }
};

/* spring and damper along the line between the markers, and the ways to get it wrong */
enum Mistake { None, NoReaction, Undamped, Mask };
template <Mistake mistake> struct Spring : Force<Spring<mistake>, 2, 1> {
  static constexpr const char *name    = "spring";
  static constexpr bool        damped  = mistake != Undamped;
  static constexpr int         inputs  = 1;
  static constexpr unsigned    acts    = Position(0) | (mistake == Mask ? 0u : Position(1));
  static constexpr unsigned    depends = Position(0) | Position(1);

  template <class T>
  static void components(const Empty &, const Frame<T> *f, const Twist<T> *w, const T &, const T *z, T *c)
  {
    using std::sqrt;
    const Vec3<T> d      = f[0].x - f[1].x;
    const T       length = sqrt(d.squaredNorm());
    c[0]                 = T(length - T(1)) * T(3) + z[0] * z[0];
    if constexpr (mistake != Undamped || std::is_same_v<T, double>) c[0] += T(d.dot(w[0].v - w[1].v)) / length;
  }
  template <class T> static void apply(const Empty &, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    using std::sqrt;
    const Vec3<T> d = f[0].x - f[1].x;
    const T       s = T(c[0]) / sqrt(d.squaredNorm());
    on[0].f         = -d * s;
    on[1].f         = mistake == NoReaction ? Vec3<T>(d * T(0)) : Vec3<T>(d * s);
    for (int k = 0; k < 2; k++) on[k].m = Vec3<T>(T(0), T(0), T(0));
  }
};

/* a driven velocity row with an input, and one that is quadratic in the twists */
template <bool quadratic> struct Drive : VelocityConstraint<Drive<quadratic>, 2, 1> {
  static constexpr const char *name   = "drive";
  static constexpr int         inputs = 1;
  template <class T>
  static void value(const Empty &, const Frame<T> *f, const Twist<T> *w, const T &t, const T *z, T *psi)
  {
    using std::sin;
    const Vec3<T> d = w[0].w - w[1].w;
    psi[0]          = f[1].R.col(2).dot(d) - sin(t) * z[0];
    if (quadratic) psi[0] += w[0].v(0) * w[0].v(0) * T(1e-3);
  }
};

} // namespace

TEST(KernelChecks, FindMistakesOfConstraints)
{
  EXPECT_GT(Failures([] { CheckConstraint<WrongGradient>(); }), 0);
  EXPECT_GT(Failures([] { CheckConstraint<WrongCurvature>(); }), 0);
  EXPECT_EQ(Failures([] { CheckVelocityConstraint<Drive<false>>(); }), 0);
  EXPECT_GT(Failures([] { CheckVelocityConstraint<Drive<true>>(); }), 0);
}

TEST(KernelChecks, FindMistakesOfMasks)
{
  EXPECT_GT(Failures([] { CheckConstraint<WrongDepends>(); }), 0);
  EXPECT_GT(Failures([] { CheckConstraint<WrongCurved>(); }), 0);
}

TEST(KernelChecks, FindMistakesOfForces)
{
  EXPECT_EQ(Failures([] { CheckForce<Spring<None>>(); }), 0);
  EXPECT_GT(Failures([] { CheckForce<Spring<NoReaction>>(); }), 0);
  EXPECT_EQ(Failures([] { CheckForce<Spring<NoReaction>>({}, false); }), 0);
  EXPECT_GT(Failures([] { CheckForce<Spring<Undamped>>(); }), 0);
  EXPECT_GT(Failures([] { CheckForce<Spring<Mask>>(); }), 0);
}
