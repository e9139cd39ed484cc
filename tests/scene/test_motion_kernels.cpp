/* Angles, displacements and motions: derivatives, full turns, and one motion given by its displacement and by its velocity */
#include "kernel_checks.h"
#include "scene/kernels/angle.h"
#include "scene/kernels/motion.h"

using namespace hhtdae;

namespace
{

const TimeFunction kDrive = TimeFunction::harmonic(.7, 2, .3, .1);

/* Keeps the two frames where the angle is well defined: the curvature grows like 1/sin^2 of the angle between x_i and z_j */
void Separate(Random &random, Frame<double> *f)
{
  while (std::abs(f[0].R.col(0).dot(f[1].R.col(2))) > .9) f[0].R = random.rotation();
}

MotionData Turning(Random &random, Frame<double> *f)
{
  Separate(random, f);
  return {kDrive, 2};
}

std::function<MotionData(Random &)> Along(int axis)
{
  return [axis](Random &) { return MotionData{kDrive, axis}; };
}

/* Frames that move and rotate smoothly in time, with their exact twists */
struct Flight {
  Vec3<double> x, v, a, axis, w;
  Mat3<double> R;

  explicit Flight(Random &random)
      : x(random.vector(2)), v(random.vector(2)), a(random.vector(2)), axis(random.direction()),
        w(axis * random(-2, 2)), R(random.rotation())
  {
  }
  Frame<double> frame(double t) const
  {
    return {x + t * v + t * t / 2 * a, Eigen::AngleAxisd(w.dot(axis) * t, axis).toRotationMatrix() * R};
  }
  Twist<double> twist(double t) const { return {v + t * a, w}; }
};

/* j in a general pose; i is rotated about j's z axis and displaced */
Frame<double> Turned(const Frame<double> &j, double angle, const Vec3<double> &moved = Vec3<double>::Zero())
{
  return {j.x + j.R * moved, j.R * Eigen::AngleAxisd(angle, Vec3<double>::UnitZ()).toRotationMatrix()};
}

} // namespace

/* ---- angle.h ---- */

TEST(Angle, IsTheRotationAboutZWhereAxesAreParallel)
{
  Random random(3);
  for (double angle : {-3.1, -1., 0., .5, 2., 3.1}) {
    const Frame<double> j = random.frame(), i = Turned(j, angle, {.3, -.2, 1});
    EXPECT_NEAR(PrincipalAngle<double>(i, j), angle, 1e-14);
    EXPECT_NEAR((AngleGradient<double>(i, j) - j.R.col(2)).norm(), 0, 1e-14);
    EXPECT_NEAR(Advance<double>(i, j, 0), .3, 1e-14);
    EXPECT_NEAR(Advance<double>(i, j, 2), 1, 1e-14);
  }
}

TEST(Angle, CountsFullTurnsBothWays)
{
  Random              random(4);
  const Frame<double> j  = random.frame();
  double              up = 0, down = 0;
  for (int k = 1; k <= 100; k++) {
    up   = UnwoundAngle<double>(Turned(j, .3 * k), j, up);
    down = UnwoundAngle<double>(Turned(j, -.3 * k), j, down);
    EXPECT_NEAR(up, .3 * k, 1e-12);
    EXPECT_NEAR(down, -.3 * k, 1e-12);
  }
}

/* adding full turns does not change the derivatives */
TEST(Angle, UnwindingKeepsDerivatives)
{
  using T = Dual<1>;
  T a(-3, 0);
  EXPECT_NEAR(Unwind<T>(a, 3).value(), -3 + kTurn, 1e-14);
  EXPECT_EQ(Unwind<T>(a, 3).derivatives()(0), 1);
  EXPECT_EQ(Unwind<double>(.25, .3), .25);
}

TEST(Angle, RatesAreTimeDerivatives)
{
  Random random(5);
  for (int k = 0; k < 20; k++) {
    SCOPED_TRACE(k);
    Flight i(random), j(random);
    while (std::abs(i.R.col(0).dot(j.R.col(2))) > .9) i.R = random.rotation();
    const double angle = PrincipalAngle<double>(i.frame(0), j.frame(0));
    const auto   g     = [&](double t) {
      DynamicVector y(4);
      y(0) = UnwoundAngle<double>(i.frame(t), j.frame(t), angle);
      for (int axis = 0; axis < 3; axis++) y(1 + axis) = Advance<double>(i.frame(t), j.frame(t), axis);
      return y;
    };
    DynamicVector rates(4);
    rates(0) = AngleRate<double>(i.frame(0), j.frame(0), i.twist(0), j.twist(0));
    for (int axis = 0; axis < 3; axis++)
      rates(1 + axis) = AdvanceRate<double>(i.frame(0), j.frame(0), i.twist(0), j.twist(0), axis);
    ExpectClose(rates, Difference(g), 1e-8, "rates");
  }
}

TEST(Angle, IsUndefinedWhereXMeetsZ)
{
  Random              random(6);
  const Frame<double> j = random.frame();
  Frame<double>       i = j;
  EXPECT_TRUE(AngleDefined(i, j));
  i.R.col(0) = j.R.col(2);
  i.R.col(2) = -j.R.col(0);
  EXPECT_FALSE(AngleDefined(i, j));
}

/* ---- motions ---- */

TEST(MotionKernels, DrivenAngle) { CheckConstraint<DrivenAngle>(Turning); }

TEST(MotionKernels, DrivenAdvance)
{
  for (int axis = 0; axis < 3; axis++) CheckConstraint<DrivenAdvance>(Along(axis), 10 + axis);
}

TEST(MotionKernels, DrivenAngularVelocity) { CheckVelocityConstraint<DrivenAngularVelocity>(Turning); }

TEST(MotionKernels, DrivenVelocity)
{
  for (int axis = 0; axis < 3; axis++) CheckVelocityConstraint<DrivenVelocity>(Along(axis), 20 + axis);
}

/* the state that gives the velocity is an additional input */
TEST(MotionKernels, RatesOfAState)
{
  CheckVelocityConstraint<StateAngularVelocity>(Turning, 30);
  for (int axis = 0; axis < 3; axis++) CheckVelocityConstraint<StateVelocity>(Along(axis), 31 + axis);
}

namespace
{

/* Compares with the automatic derivatives, which the kernels replace by their own gradient and curvature */
template <class K> void CompareWithAutomaticRate(unsigned seed)
{
  using Automatic = VelocityConstraint<K, 2, 1>;
  Random random(seed);
  for (int k = 0; k < 10; k++) {
    SCOPED_TRACE(K::name);
    Frame<double>                f[2]   = {random.frame(), random.frame()};
    const Twist<double>          w[2]   = {random.twist(), random.twist()};
    const MotionData             d      = Turning(random, f);
    const double                 lambda = random(-2, 2), z = random(-2, 2);
    typename Automatic::Gradient J, P, Ja, Pa;
    typename Automatic::Hessian  H, Ha;
    double                       zj = 0, za = 0;
    K::gradient(d, f, w, .3, &z, J, P, &zj);
    K::curvature(d, f, w, .3, &z, &lambda, H);
    Automatic::gradient(d, f, w, .3, &z, Ja, Pa, &za);
    Automatic::curvature(d, f, w, .3, &z, &lambda, Ha);
    ExpectClose(J, Ja, 1e-12, "J");
    ExpectClose(P, Pa, 1e-12, "P");
    ExpectClose(H, Ha, 1e-12, "H");
    EXPECT_EQ(zj, za);
  }
}

} // namespace

TEST(MotionKernels, RateRowsAgreeWithAutomaticDifferentiation)
{
  CompareWithAutomaticRate<DrivenAngularVelocity>(40);
  CompareWithAutomaticRate<DrivenVelocity>(41);
  CompareWithAutomaticRate<StateAngularVelocity>(42);
  CompareWithAutomaticRate<StateVelocity>(43);
}

/* The velocity constraint is the time derivative of the displacement constraint of the integral, along any motion of
   the frames */
TEST(MotionKernels, VelocityRowIsTheTimeDerivativeOfTheDisplacementRow)
{
  const TimeFunction rate = TimeFunction::values([](double t) {
    const TimeFunction::Value v = kDrive(t);
    return TimeFunction::Value{v.f1, v.f2, 0};
  });
  Random             random(8);
  for (int k = 0; k < 20; k++) {
    SCOPED_TRACE(k);
    Flight i(random), j(random);
    while (std::abs(i.R.col(0).dot(j.R.col(2))) > .9) i.R = random.rotation();
    const Frame<double> f[2] = {i.frame(0), j.frame(0)};
    const Twist<double> w[2] = {i.twist(0), j.twist(0)};
    double              turning, moving;
    DrivenAngularVelocity::value<double>({rate, 2}, f, w, 0., &turning);
    DrivenVelocity::value<double>({rate, 1}, f, w, 0., &moving);
    const DynamicVector derivative = Difference([&](double t) {
      const Frame<double> at[2] = {i.frame(t), j.frame(t)};
      DynamicVector       phi(2);
      DrivenAngle::value<double>({kDrive, 2}, at, t, &phi(0));
      DrivenAdvance::value<double>({kDrive, 1}, at, t, &phi(1));
      return phi;
    });
    EXPECT_NEAR(turning, derivative(0), 1e-8 * (1 + std::abs(turning)));
    EXPECT_NEAR(moving, derivative(1), 1e-8 * (1 + std::abs(moving)));
  }
}

/* A driven angle of many turns is satisfied where the angle is f(t) modulo 2 pi, at any time and without a history */
TEST(MotionKernels, DrivenAngleFollowsManyTurns)
{
  Random              random(9);
  const Frame<double> j = random.frame();
  const MotionData    d{TimeFunction::polynomial({1, 50}), 2};
  for (double t : {0., .1, 1., 10., -10.}) {
    double              phi;
    const Frame<double> met[2] = {Turned(j, 1 + 50 * t), j}, ahead[2] = {Turned(j, 1.4 + 50 * t), j};
    DrivenAngle::value<double>(d, met, t, &phi);
    EXPECT_NEAR(phi, 0, 1e-12);
    DrivenAngle::value<double>(d, ahead, t, &phi);
    EXPECT_NEAR(phi, -.4, 1e-12);
  }
}

TEST(MotionKernels, AFunctionWithoutValueShows)
{
  const MotionData d{
      TimeFunction::formula([](const TimeFunction::Number &t) -> TimeFunction::Number { return sqrt(1.0 - t); }), 2};
  Random              random(11);
  const Frame<double> f[2] = {random.frame(), random.frame()};
  const Twist<double> w[2] = {random.twist(), random.twist()};
  double              phi[4];
  DrivenAngle::value<double>(d, f, 2., phi);
  DrivenAdvance::value<double>(d, f, 2., phi + 1);
  DrivenAngularVelocity::value<double>(d, f, w, 2., phi + 2);
  DrivenVelocity::value<double>(d, f, w, 2., phi + 3);
  for (double x : phi) EXPECT_TRUE(std::isnan(x));
}

/* -J^T lambda on i's body is the multiplier as moment about z_j, or as force along the axis */
TEST(MotionKernels, TheMultiplierIsTheDrive)
{
  Random              random(12);
  const Frame<double> j    = random.frame();
  const Frame<double> f[2] = {Turned(j, .7, {.1, .2, .3}), j};
  Matrix<1, 12>       J;
  DrivenAngle::gradient({kDrive, 2}, f, 0, J);
  EXPECT_NEAR((-J.segment<3>(3).transpose() - j.R.col(2)).norm(), 0, 1e-14);
  EXPECT_EQ(J.segment<3>(0).norm(), 0);
  DrivenAdvance::gradient({kDrive, 1}, f, 0, J);
  EXPECT_NEAR((-J.segment<3>(0).transpose() - j.R.col(1)).norm(), 0, 1e-14);
  EXPECT_EQ(J.segment<3>(3).norm(), 0);
}
