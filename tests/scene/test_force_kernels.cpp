/* Springs, dampers, torsional springs and bushings as kernels: derivatives, balance, energy, known values */
#include "force_checks.h"
#include "scene/kernels/bushing.h"
#include "scene/kernels/rotation_vector.h"
#include "scene/kernels/spring.h"
#include "scene/kernels/spring_torsion.h"

using namespace hhtdae;

namespace
{

using testing::Test;

template <bool Damped> typename LinearSpring<Damped>::Data SpringData(Random &random)
{
  return {random(.5, 3), random(.5, 2), random(0, 3), random(-1, 1)};
}

CurveSpring::Data CurveData(Random &random)
{
  const double k = random(.5, 2), c = random(.5, 2);
  return {[=](const Real &l, const Real &v) -> Real { return k * l * l * l + c * sin(v) * l; }};
}

/* keeps x_i away from z_j, where the angle is undefined */
void DefinedAngle(Random &random, Frame<double> *f)
{
  while (std::abs(f[0].R.col(0).dot(f[1].R.col(2))) > .9) f[0].R = random.rotation();
}

template <bool Damped> typename LinearTorsion<Damped>::Data TorsionData(Random &random, Frame<double> *f)
{
  DefinedAngle(random, f);
  typename LinearTorsion<Damped>::Data d = {
      {random(-10, 10)}, random(.5, 3), random(.5, 2), random(-4, 4), random(-1, 1)};
  LinearTorsion<Damped>::accept(d, f); /* otherwise a difference might pass half a turn from the counted angle */
  return d;
}

CurveTorsion::Data CurveTorsionData(Random &random, Frame<double> *f)
{
  const double k = random(.5, 2), c = random(.5, 2);
  DefinedAngle(random, f);
  CurveTorsion::Data d = {{random(-10, 10)},
                          [=](const Real &a, const Real &v) -> Real { return -k * sin(a) - c * v * v * v; }};
  CurveTorsion::accept(d, f);
  return d;
}

Vector3 Positive(Random &random) { return {random(.5, 3), random(.5, 3), random(.5, 3)}; }

template <bool Damped> typename BushingForce<Damped>::Data BushingData(Random &random, Frame<double> *f)
{
  const Vector3 k = Positive(random), kt = Positive(random), c = Positive(random), ct = Positive(random),
                p = random.vector();
  RelativeRotation(random, f);
  return {k, kt, c, ct, p, random.vector()};
}

} // namespace

/* ---- rotation vectors ---- */

TEST(RotationVector, InvertsTheExponential)
{
  Random random(1);
  for (double angle : {0., 1e-300, 1e-15, 1e-9, 1e-6, 1e-3, .03, .0632, .0633, .1, 1., 2., 3., 3.14159, M_PI - 1e-9})
    for (int k = 0; k < 20; k++) {
      const Vec3<double> axis = k < 3 ? Vec3<double>(Vec3<double>::Unit(k)) : random.direction();
      const Mat3<double> R    = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
      const Vec3<double> phi  = RotationVector<double>(UnitQuaternion<double>(R));
      EXPECT_LT((phi - angle * axis).norm(), 3e-15 + 1e-15 * angle)
          << "angle " << angle << ", axis " << axis.transpose();
      const Quaternion<double> h = HalfTurn<double>(UnitQuaternion<double>(R));
      const Mat3<double>       H = RotationMatrix<double>(h);
      EXPECT_LT((H - Eigen::AngleAxisd(angle / 2, axis).toRotationMatrix()).norm(), 1e-14);
    }
  /* for half a turn either sign is right */
  for (int k = 0; k < 3; k++) {
    const Mat3<double> R   = Eigen::AngleAxisd(M_PI, Vec3<double>::Unit(k)).toRotationMatrix();
    const Vec3<double> phi = RotationVector<double>(UnitQuaternion<double>(R)).cwiseAbs();
    EXPECT_LT((phi - M_PI * Vec3<double>::Unit(k)).norm(), 1e-14);
  }
}

TEST(RotationVector, HasTheDifferentialOfTheLogarithm)
{
  Random random(2);
  for (double angle : {0., 1e-12, 1e-5, .2, .23, 1., 3.1}) {
    const Vec3<double>   axis = random.direction(), phi = angle * axis;
    const Frame<double>  f = {Vector3::Zero(), Eigen::AngleAxisd(angle, axis).toRotationMatrix()};
    const Frame<Dual<6>> s = Seed<6>(f, 0);
    const Vec3<Dual<6>>  x = RotationVector<Dual<6>>(UnitQuaternion<Dual<6>>(s.R));
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 3; k++)
        EXPECT_NEAR(x(i).derivatives()(3 + k), BushingForce<false>::turn(phi)(i, k), 1e-13 * (1 + angle))
            << "angle " << angle;
  }
}

/* closed forms on one side of the switch and series on the other agree */
TEST(RotationVector, SeriesMeetClosedForms)
{
  for (double s : {.009999, .0100001, .049999, .050001}) {
    const long double a = std::sqrt((long double)s);
    EXPECT_NEAR(HalfCot(s), (double)((1 - a / 2 / std::tan(a / 2)) / s), 1e-13);
    EXPECT_NEAR(Cosecant(s), (double)((a / std::sin(a) - 1) / s), 1e-13);
    EXPECT_NEAR(HalfTan(s), (double)(std::tan(a / 2) / a), 1e-15);
  }
}

/* ---- springs along a line ---- */

TEST(Spring, Kernels)
{
  CheckForce<LinearSpring<true>>(SpringData<true>);
  CheckForce<LinearSpring<false>>(SpringData<false>);
  CheckForce<CurveSpring>(CurveData);
}

TEST(Spring, AgreesWithAutomaticDifferentiation)
{
  CompareForce<LinearSpring<true>>(SpringData<true>);
  CompareForce<LinearSpring<false>>(SpringData<false>);
}

TEST(Spring, Potential)
{
  ExpectSymmetric<LinearSpring<false>>(SpringData<false>);
  ExpectPotential<LinearSpring<false>>(SpringData<false>, LinearSpring<false>::energy);
  ExpectDissipative<LinearSpring<true>>(SpringData<true>);
  ExpectObjective<LinearSpring<true>>(SpringData<true>);
}

/* stretched from 2 m to 5 m along (3, 4, 0), growing at 1 m/s: tension 10 * 3 + 4 * 1 + 6 = 40 */
TEST(Spring, KnownTension)
{
  const LinearSpring<true>::Data data = {10, 4, 2, 6};
  Frame<double>                  f[2];
  Twist<double>                  w[2];
  Wrench<double>                 on[2];
  double                         tension;
  f[0].x = {4, 3, 1};
  f[1].x = {1, -1, 1};
  w[0]   = {{.6, .8, 7}, {1, 2, 3}};
  w[1]   = {{0, 0, 2}, {-4, 5, 6}};
  LinearSpring<true>::components<double>(data, f, w, 0., nullptr, &tension);
  LinearSpring<true>::wrench(data, f, w, 0, nullptr, on);
  EXPECT_NEAR(tension, 40, 1e-13);
  EXPECT_LT((on[0].f - Vector3(-24, -32, 0)).norm(), 1e-13);
  EXPECT_LT((on[1].f - Vector3(24, 32, 0)).norm(), 1e-13);
}

TEST(Spring, CoincidentOrigins)
{
  Frame<double>       f[2];
  Twist<double>       w[2] = {{{1, 2, 3}, {0, 0, 0}}, {{0, 0, 1}, {0, 0, 0}}};
  Wrench<double>      on[2];
  ForceJacobian<2, 0> J;
  f[0].x = f[1].x = {1, 2, 3};

  /* free length zero: f = -k d - c v, exactly linear there */
  LinearSpring<true>::jacobian({5, 2, 0, 0}, f, w, 0, nullptr, on, J);
  EXPECT_EQ(on[0].f, Vector3(-2, -4, -4));
  EXPECT_EQ((J.frames.block<3, 3>(0, 0)), -5 * Matrix3::Identity());
  EXPECT_EQ((J.twists.block<3, 3>(0, 6)), 2 * Matrix3::Identity());
  /* and next to this position the stiffness is the same in all directions */
  f[0].x(0) += 1e-9;
  LinearSpring<false>::jacobian({5, 0, 0, 0}, f, nullptr, 0, nullptr, on, J);
  EXPECT_LT((J.frames.block<3, 3>(0, 0) + 5 * Matrix3::Identity()).norm(), 1e-14);
  EXPECT_LT((on[0].f + 5 * (f[0].x - f[1].x)).norm(), 1e-22);

  /* With a free length and coinciding ends there is no direction and hence no force, and nothing is infinite; the same
     with automatic derivatives (force states) */
  f[0].x = f[1].x;
  f[0].R = f[1].R = Matrix3::Identity();
  LinearSpring<true>::jacobian({5, 2, 3, 1}, f, w, 0, nullptr, on, J);
  EXPECT_EQ(on[1].f, Vector3(2, 4, 4));
  EXPECT_TRUE(J.frames.allFinite() && J.twists.allFinite());
  Force<LinearSpring<true>, 2, 1>::jacobian(LinearSpring<true>::Data{5, 2, 3, 1}, f, w, 0, nullptr, on, J);
  EXPECT_EQ(on[0].f.norm(), 0);
  EXPECT_TRUE(J.frames.allFinite() && J.twists.allFinite());
  const CurveSpring::Data curve = {[](const Real &l, const Real &v) -> Real { return l + v; }};
  CurveSpring::jacobian(curve, f, w, 0, nullptr, on, J);
  EXPECT_EQ(on[0].f.norm(), 0);
  EXPECT_TRUE(J.frames.allFinite() && J.twists.allFinite());
}

/* The same law given by numbers and by a function */
TEST(Spring, FunctionOfLengthAndRate)
{
  const LinearSpring<true>::Data data = {10, 4, 2, 6};
  const CurveSpring::Data curve = {[](const Real &l, const Real &v) -> Real { return 10. * (l - 2.) + 4. * v + 6.; }};
  const CurveSpring::Data constant = {[](const Real &, const Real &) -> Real { return Real(3.); }};
  Random                  random(4);
  const checks::Sample<CurveSpring> s([&](Random &) { return curve; }, random);
  ForceJacobian<2, 0>               J, J2;
  Wrench<double>                    on[2], on2[2];
  LinearSpring<true>::jacobian(data, s.f, s.w, 0, nullptr, on, J);
  CurveSpring::jacobian(curve, s.f, s.w, 0, nullptr, on2, J2);
  ExpectClose(J.frames, J2.frames, 1e-12, "d wrenches/d frames");
  ExpectClose(J.twists, J2.twists, 1e-12, "d wrenches/d twists");
  ExpectClose(checks::ToVector<2>(on), checks::ToVector<2>(on2), 1e-12, "wrenches");
  CurveSpring::jacobian(constant, s.f, s.w, 0, nullptr, on2, J2);
  EXPECT_NEAR(on2[0].f.norm(), 3, 1e-13);
  EXPECT_EQ(J2.twists.norm(), 0);
}

/* ---- torsional springs ---- */

TEST(Torsion, Kernels)
{
  CheckForce<LinearTorsion<true>>(TorsionData<true>);
  CheckForce<LinearTorsion<false>>(TorsionData<false>);
  CheckForce<CurveTorsion>(CurveTorsionData);
}

TEST(Torsion, AgreesWithAutomaticDifferentiation)
{
  CompareForce<LinearTorsion<true>>(TorsionData<true>);
  CompareForce<LinearTorsion<false>>(TorsionData<false>);
  CompareForce<CurveTorsion>(CurveTorsionData);
}

TEST(Torsion, Potential)
{
  ExpectSymmetric<LinearTorsion<false>>(TorsionData<false>);
  ExpectPotential<LinearTorsion<false>>(TorsionData<false>, LinearTorsion<false>::energy);
  ExpectDissipative<LinearTorsion<true>>(TorsionData<true>);
  ExpectObjective<LinearTorsion<true>>(TorsionData<true>);
}

/* i turns about z_j by three turns in steps of 100 degrees, and back; the moment follows the counted angle */
TEST(Torsion, CountsTurns)
{
  Random                    random(9);
  const Matrix3             Rj   = random.rotation();
  const Vector3             z    = Rj.col(2);
  LinearTorsion<true>::Data data = {{0}, 2, .5, .25, .125};
  Frame<double>             f[2] = {{{1, 2, 3}, Rj}, {{-1, 0, 2}, Rj}};
  Twist<double>             w[2] = {{{1, 0, 0}, 4 * z}, {{0, 1, 0}, z}};
  Wrench<double>            on[2];
  const double              step = 100 * M_PI / 180;
  int                       turn = 0;
  for (int k = 1; k <= 22; k++) {
    turn += k <= 11 ? 1 : -1;
    f[0].R = Rj * Eigen::AngleAxisd(turn * step, Vector3::UnitZ()).toRotationMatrix();
    LinearTorsion<true>::wrench(data, f, w, 0, nullptr, on);
    const double moment = .125 - 2 * (turn * step - .25) - .5 * 3;
    EXPECT_LT((on[0].m - moment * z).norm(), 1e-12) << "after " << k;
    EXPECT_LT((on[1].m + moment * z).norm(), 1e-12) << "after " << k;
    EXPECT_EQ(on[0].f.norm() + on[1].f.norm(), 0);
    LinearTorsion<true>::accept(data, f);
    EXPECT_NEAR(data.memory[0], turn * step, 1e-13);
  }
}

/* ---- bushing ---- */

TEST(Bushing, Kernels)
{
  CheckForce<BushingForce<true>>(BushingData<true>);
  CheckForce<BushingForce<false>>(BushingData<false>);
}

TEST(Bushing, AgreesWithAutomaticDifferentiation)
{
  CompareForce<BushingForce<true>>(BushingData<true>);
  CompareForce<BushingForce<false>>(BushingData<false>);
}

TEST(Bushing, Potential)
{
  ExpectSymmetric<BushingForce<false>>(BushingData<false>);
  ExpectPotential<BushingForce<false>>(BushingData<false>, BushingForce<false>::energy);
  ExpectDissipative<BushingForce<true>>(BushingData<true>);
  ExpectObjective<BushingForce<true>>(BushingData<true>);
}

/* With aligned frames everything is linear and in j's axes; the matrix at rest is that of six springs */
TEST(Bushing, KnownValues)
{
  const BushingForce<true>::Data data = {{1, 2, 3}, {4, 5, 6}, {.1, .2, .3}, {.4, .5, .6}, {7, 8, 9}, {-1, -2, -3}};
  Random                         random(21);
  const Matrix3                  R = random.rotation();
  const Vector3                  d(.5, -.25, 1), w(1, 2, 3), v(3, 2, 1);
  Frame<double>                  f[2] = {{Vector3(1, 2, 3) + R * d, R}, {Vector3(1, 2, 3), R}};
  Twist<double>                  u[2] = {{R * v, R * w}, {Vector3::Zero(), Vector3::Zero()}};
  Wrench<double>                 on[2];
  BushingForce<true>::wrench(data, f, u, 0, nullptr, on);
  const Vector3 force(7 - .5 - .3, 8 + .5 - .4, 9 - 3 - .3), moment(-1 - .4, -2 - 1, -3 - 1.8);
  EXPECT_LT((on[0].f - R * force).norm(), 1e-13);
  EXPECT_LT((on[0].m - R * moment).norm(), 1e-13);
  EXPECT_LT((on[1].f + R * force).norm(), 1e-13);
  EXPECT_LT((on[1].m + R * (moment + d.cross(force))).norm(), 1e-13);
}

/* For a rotation about a principal axis the moment is -k times the angle, up to half a turn; with equal stiffnesses
   about any axis */
TEST(Bushing, LargeRotations)
{
  BushingForce<false>::Data data = {Vector3::Zero(), {4, 5, 6},       Vector3::Zero(),
                                    Vector3::Zero(), Vector3::Zero(), Vector3::Zero()};
  Random                    random(22);
  Frame<double>             f[2] = {random.frame(), random.frame()};
  Wrench<double>            on[2];
  for (double angle : {1e-8, .1, 1., 2., 3., 3.14159})
    for (int k = 0; k < 3; k++) {
      f[0].R                   = f[1].R * Eigen::AngleAxisd(angle, Vector3::Unit(k)).toRotationMatrix();
      data.torsional_stiffness = {4, 5, 6};
      BushingForce<false>::wrench(data, f, nullptr, 0, nullptr, on);
      EXPECT_LT((on[0].m + (4 + k) * angle * f[1].R.col(k)).norm(), 1e-13) << "axis " << k << ", angle " << angle;
      const Vector3 axis       = random.direction();
      f[0].R                   = f[1].R * Eigen::AngleAxisd(angle, axis).toRotationMatrix();
      data.torsional_stiffness = {3, 3, 3};
      BushingForce<false>::wrench(data, f, nullptr, 0, nullptr, on);
      EXPECT_LT((on[0].m + 3 * angle * (f[1].R * axis)).norm(), 1e-13) << "any axis, angle " << angle;
    }
}
