/* Kernels of joints: derivatives at random states, meaning of their multipliers, and whether the checks themselves
   detect errors */
#include "kernel_checks.h"
#include "scene/kernels/convel.h"
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
  CheckConstraint<EqualRotation<false>>();
  CheckConstraint<EqualRotation<true>>();
}

/* ---- meaning of the multipliers ---- */

namespace
{

Mat3<double> AboutAxis(const Vec3<double> &axis, double angle) { return Eigen::AngleAxisd(angle, axis).toRotationMatrix(); }

/* i and j in a random position with parallel axes; i is at `local` in j's axes and rotated by `turn` in them */
struct Pair {
  Frame<double> f[2];
  explicit Pair(Random &random, const Vec3<double> &local = Vec3<double>::Zero(),
                const Mat3<double> &turn = Mat3<double>::Identity())
  {
    f[1] = random.frame();
    f[0] = {f[1].x + f[1].R * local, f[1].R * turn};
  }
  Vec3<double> j(int axis) const { return f[1].R.col(axis); }
};

/* The reaction -J^T lambda for the multiplier 1 in row r: force and moment on i, force and moment on j */
template <class K> Matrix<12, 1> Reaction(const Pair &p, int r, const typename K::Data &data = {})
{
  typename K::Gradient J;
  double               phi[K::rows];
  K::template value<double>(data, p.f, 0, phi);
  EXPECT_NEAR(phi[r], 0, 1e-14) << "the joint is not closed";
  K::gradient(data, p.f, 0, J);
  return -J.row(r).transpose();
}

/* A force at i's origin and its opposite at the same point of j; or a moment and its opposite */
void ExpectForce(const Pair &p, const Matrix<12, 1> &reaction, const Vec3<double> &force)
{
  Matrix<12, 1> expected;
  expected << force, Vec3<double>::Zero(), -force, -(p.f[0].x - p.f[1].x).cross(force);
  EXPECT_LT((reaction - expected).norm(), 1e-13) << reaction.transpose() << "\nshould be\n" << expected.transpose();
}
void ExpectMoment(const Matrix<12, 1> &reaction, const Vec3<double> &moment)
{
  Matrix<12, 1> expected;
  expected << Vec3<double>::Zero(), moment, Vec3<double>::Zero(), -moment;
  EXPECT_LT((reaction - expected).norm(), 1e-13) << reaction.transpose() << "\nshould be\n" << expected.transpose();
}

} // namespace

TEST(JointKernels, MultipliersOfPointsAreForces)
{
  Random random(2);
  for (int k = 0; k < 10; k++) {
    const Mat3<double> turn = random.rotation();
    const Pair same(random, {0, 0, 0}, turn), plane(random, {.3, -.8, .7}, turn), line(random, {0, 0, -1.3}, turn);
    for (int r = 0; r < 3; r++) ExpectForce(same, Reaction<Coincide>(same, r), Vec3<double>::Unit(r));
    for (int r = 0; r < 2; r++) ExpectForce(same, Reaction<Coincide2>(same, r), Vec3<double>::Unit(r));
    ExpectForce(plane, Reaction<OnPlane<2>>(plane, 0, {.7}), plane.j(2));
    ExpectForce(plane, Reaction<OnPlane<1>>(plane, 0, {-.8}), plane.j(1));
    for (int r = 0; r < 2; r++) ExpectForce(line, Reaction<OnLine>(line, r), line.j(r));
    const Vec3<double> d = plane.f[0].x - plane.f[1].x; /* tension pulls i towards j */
    ExpectForce(plane, Reaction<Distance>(plane, 0, {d.norm()}), -d.normalized());
  }
}

TEST(JointKernels, MultipliersOfAxesAreMoments)
{
  Random random(3);
  for (int k = 0; k < 10; k++) {
    const double       spin = random(-3, 3);
    const Vec3<double> z    = Vec3<double>::UnitZ();
    const Pair         about_z(random, random.vector(), AboutAxis(z, spin)), aligned(random, random.vector());
    for (int r = 0; r < 2; r++) ExpectMoment(Reaction<Parallel>(about_z, r), about_z.j(r));
    for (int r = 0; r < 3; r++) ExpectMoment(Reaction<Orient>(aligned, r), aligned.j(r));
    ExpectMoment(Reaction<OrientInPlane>(aligned, 0), aligned.j(2));
    const Pair cross(random, {0, 0, 0},
                     AboutAxis(z, spin) * AboutAxis(Vec3<double>::UnitX(), M_PI / 2) * AboutAxis(z, random(-3, 3)));
    ExpectMoment(Reaction<AxesPerpendicular<2, 2>>(cross, 0), cross.j(2).cross(Vec3<double>(cross.f[0].R.col(2))));
  }
}

/* Antiparallel axes are another branch of the same constraint: it is satisfied there, with the same reactions */
TEST(JointKernels, AlignmentsHaveTwoBranches)
{
  Random random(4);
  double misses;
  for (int axis = 0; axis < 3; axis++) {
    const Pair flipped(random, {0, 0, 0}, AboutAxis(Vec3<double>(Vec3<double>::Unit(axis)), M_PI));
    for (int r = 0; r < 2; r++) ExpectMoment(Reaction<Parallel>(flipped, r, Parallel::branch(flipped.f[0], flipped.f[1])), flipped.j(r));
    for (int r = 0; r < 3; r++) ExpectMoment(Reaction<Orient>(flipped, r, Orient::branch(flipped.f[0], flipped.f[1], &misses)), flipped.j(r));
    EXPECT_NEAR(misses, 1, 1e-12);
  }
  const Pair in_plane(random, {0, 0, 0}, AboutAxis(Vec3<double>::UnitZ(), M_PI));
  ExpectMoment(Reaction<OrientInPlane>(in_plane, 0, OrientInPlane::branch(in_plane.f[0], in_plane.f[1])), in_plane.j(2));
  const Pair third(random, {0, 0, 0}, AboutAxis(Vec3<double>(1, 1, 1).normalized(), 2 * M_PI / 3));
  Orient::branch(third.f[0], third.f[1], &misses);
  EXPECT_NEAR(misses, -0.5, 1e-12);
}

/* Shafts at a constant angle satisfy the constraint if they turn by the same angle, however large, and violate it if
   they do not */
TEST(JointKernels, ConstantVelocityTurnsBothShaftsAlike)
{
  Random             random(5);
  const Vec3<double> z = Vec3<double>::UnitZ(), x = Vec3<double>::UnitX();
  for (int k = 0; k < 20; k++) {
    const double       bend = random(-1.2, 1.2), spin = random(-10, 10), other = random(.1, 2), plane = random(-3, 3);
    const Mat3<double> B    = AboutAxis({std::cos(plane), std::sin(plane), 0}, bend);
    const Mat3<double> turn = AboutAxis(z, -spin) * B * AboutAxis(z, spin), flip = AboutAxis(x, M_PI);
    double             phi;
    const Pair         alike(random, {0, 0, 0}, turn), away(random, {0, 0, 0}, turn * flip);
    const Pair         apart(random, {0, 0, 0}, turn * AboutAxis(z, other));
    EqualRotation<false>::value<double>({}, alike.f, 0, &phi);
    EXPECT_NEAR(phi, 0, 1e-14);
    EqualRotation<true>::value<double>({}, away.f, 0, &phi);
    EXPECT_NEAR(phi, 0, 1e-14);
    EqualRotation<false>::value<double>({}, apart.f, 0, &phi);
    EXPECT_NEAR(phi, -std::sin(other) * std::pow(std::cos(bend / 2), 2), 1e-13);
    /* The moment is about the bisector of the two shafts, whichever way z_i points */
    const Vec3<double> half       = (alike.f[0].R.col(2) + alike.j(2)).normalized();
    const Vec3<double> other_half = (away.j(2) - away.f[0].R.col(2)).normalized();
    ExpectMoment(Reaction<EqualRotation<false>>(alike, 0), std::cos(bend / 2) * half);
    ExpectMoment(Reaction<EqualRotation<true>>(away, 0), std::cos(bend / 2) * other_half);
  }
}

/* ---- the checks themselves ---- */

namespace
{

/* Number of failures inside f, which are intercepted instead of reported */
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
    H(9, 10) = H(10, 9); /* wrong, because rotations do not commute */
  }
};
struct WrongDepends : OnLine {
  static constexpr unsigned depends = Position(0) | Position(1);
};
struct WrongCurved : OnLine {
  static constexpr bool curved(int a, int b) { return OnLine::curved(a, b) && a != b; }
};

/* A spring and damper along the line between the markers, with deliberate mistakes */
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

/* A driven velocity-level constraint with an input, and one that is wrongly quadratic in the twists */
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
