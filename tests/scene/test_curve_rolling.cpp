/* Kernels of rolling, of the knife edge and of the point on a curve */
#include "hhtdae/helpers.h"
#include "hhtdae/query.h"
#include "kernel_checks.h"
#include "scene/kernels/curve.h"
#include "scene/kernels/primitives.h"
#include "scene/kernels/rolling.h"
#include "scene_output.h"
#include <limits>

using namespace hhtdae;

namespace
{

/* a disc or a sphere on either side of the plane, not lying flat */
RollingData RandomRolling(Random &random, Frame<double> *f)
{
  const double side = random(-1, 1) < 0 ? -1 : 1;
  while (std::abs(f[0].R.col(2).dot(f[1].R.col(2))) > .9) f[0].R = random.rotation();
  return {random(.2, 2), side};
}

} // namespace

TEST(Rolling, Derivatives)
{
  CheckConstraint<DiscOnPlane>(RandomRolling);
  CheckVelocityConstraint<DiscNoSlip>(RandomRolling);
  CheckVelocityConstraint<SphereNoSlip<2, 2>>(RandomRolling);
  CheckVelocityConstraint<SphereNoSlip<1, 1>>(RandomRolling);
  CheckVelocityConstraint<KnifeNoSlip>();
}

/* ---- known values ---- */

namespace
{

constexpr double kNone = 0;

/* A disc or sphere of radius r with the axes R on the xy plane of the ground, with angular velocity w and velocity v */
struct OnGround {
  Frame<double> f[2];
  Twist<double> w[2];
  OnGround(double height, const Mat3<double> &R)
  {
    f[0] = {{1, 2, height}, R};
    f[1] = {Vec3<double>::Zero(), Mat3<double>::Identity()};
    for (Twist<double> &twist : w) twist = {Vec3<double>::Zero(), Vec3<double>::Zero()};
  }
};

Mat3<double> About(const Vec3<double> &axis, double angle) { return Eigen::AngleAxisd(angle, axis).toRotationMatrix(); }

} // namespace

/* An upright disc with its axis along y: v_x = r w_y. A disc that leans by b: its centre has the height r cos b */
TEST(Rolling, DiscOnTheGround)
{
  const double       r = .7, lean = .3;
  const RollingData  data{r, 1};
  const Mat3<double> upright = About(Vec3<double>::UnitX(), -M_PI / 2); /* z_i = y */
  OnGround           s(r, upright);
  double             phi, psi[2];
  DiscOnPlane::value<double>(data, s.f, 0, &phi);
  EXPECT_NEAR(phi, 0, 1e-15);
  s.w[0] = {{r * 3, 0, 0}, {0, 3, 0}};
  DiscNoSlip::value<double>(data, s.f, s.w, 0, psi);
  EXPECT_NEAR(psi[0], 0, 1e-14);
  EXPECT_NEAR(psi[1], 0, 1e-14);
  s.w[0].v(1) = .5; /* sideways */
  DiscNoSlip::value<double>(data, s.f, s.w, 0, psi);
  EXPECT_NEAR(psi[0], 0, 1e-14);
  EXPECT_NEAR(psi[1], -.5, 1e-14);
  OnGround leaning(r * std::cos(lean), About(Vec3<double>::UnitX(), lean) * upright);
  DiscOnPlane::value<double>(data, leaning.f, 0, &phi);
  EXPECT_NEAR(phi, 0, 1e-15);
}

/* Steady turning: the lowest point of a leaning disc moves on a circle of radius R on the ground. Without slip the
   disc's spin about its axis is rate R / r, in addition to the turning of its plane with the rate about the vertical */
TEST(Rolling, DiscInACircle)
{
  const double       r = .4, lean = .5, rate = 1.3, R = 2;
  const RollingData  data{r, 1};
  const Vec3<double> contact(R, 0, 0), inward(-1, 0, 0), up(0, 0, 1);
  const Vec3<double> center = contact + r * (std::cos(lean) * up + std::sin(lean) * inward);
  const Vec3<double> axis   = std::cos(lean) * inward - std::sin(lean) * up; /* normal to the disc, which holds y */
  OnGround           s(0, axesAlong(axis));
  double             phi, psi[2];
  s.f[0].x = center;
  DiscOnPlane::value<double>(data, s.f, 0, &phi);
  EXPECT_NEAR(phi, 0, 1e-15);
  const double spin = rate * R / r;
  s.w[0].w          = rate * up + spin * axis;
  s.w[0].v          = (rate * up).cross(center);
  DiscNoSlip::value<double>(data, s.f, s.w, 0, psi);
  EXPECT_NEAR(psi[0], 0, 1e-14);
  EXPECT_NEAR(psi[1], 0, 1e-14);
}

/* All reactions of a contact act at one point: J = -e (1, [arm]) for i and its opposite for j. */
TEST(Rolling, ReactionsActAtThePointOfContact)
{
  Random random(3);
  for (int k = 0; k < 20; k++) {
    Frame<double>         f[2] = {random.frame(), random.frame()};
    const Twist<double>   w[2] = {random.twist(), random.twist()};
    const RollingData     data = RandomRolling(random, f);
    const Vec3<double>    n = data.side * f[1].R.col(2), d = f[0].x - f[1].x;
    const Vec3<double>    down = n.dot(f[0].R.col(2)) * f[0].R.col(2) - n, arm = data.radius * down.normalized();
    DiscOnPlane::Gradient height;
    DiscNoSlip::Gradient  slip, P;
    DiscOnPlane::gradient(data, f, 0, height);
    DiscNoSlip::gradient(data, f, w, 0, &kNone, slip, P, nullptr);
    for (int r = 0; r < 3; r++) {
      const Vec3<double>  e   = r < 2 ? Vec3<double>(f[1].R.col(r)) : n;
      const Matrix<1, 12> row = r < 2 ? Matrix<1, 12>(slip.row(r)) : Matrix<1, 12>(height);
      Matrix<12, 1>       load;
      load << e, arm.cross(e), -e, -(d + arm).cross(e);
      EXPECT_LT((row.transpose() + load).norm(), 1e-13) << "row " << r;
    }
  }
}

/* A ball rolls on a plane that itself moves and turns: both have the same velocity at the contact point */
TEST(Rolling, SphereOnAMovingPlane)
{
  Random             random(5);
  Frame<double>      f[2] = {random.frame(), random.frame()};
  Twist<double>      w[2] = {random.twist(), random.twist()};
  const double       r    = .3;
  const Vec3<double> n    = f[1].R.col(2);
  f[0].x                  = f[1].x + f[1].R * Vec3<double>(.4, -.7, r);
  double phi, psi[2];
  OnPlane<2>::value<double>({r}, f, 0, &phi);
  EXPECT_NEAR(phi, 0, 1e-15);
  const Vec3<double> contact = f[0].x - r * n, ground = w[1].v + w[1].w.cross(contact - f[1].x);
  w[0].v = ground + r * w[0].w.cross(n) + .6 * n; /* v at the contact = ground along the plane */
  SphereNoSlip<2, 2>::value<double>({r, 1}, f, w, 0, psi);
  EXPECT_NEAR(psi[0], 0, 1e-14);
  EXPECT_NEAR(psi[1], 0, 1e-14);
  w[0].v += .2 * f[1].R.col(1);
  SphereNoSlip<2, 2>::value<double>({r, 1}, f, w, 0, psi);
  EXPECT_NEAR(psi[0], 0, 1e-14);
  EXPECT_NEAR(psi[1], -.2, 1e-14);
}

/* A wheel in a planar scene above the x axis of j rolls to the right by turning clockwise; below the axis it turns the
   other way */
TEST(Rolling, WheelInThePlane)
{
  for (double side : {1., -1.}) {
    OnGround s(0, About(Vec3<double>::UnitZ(), .4));
    double   psi;
    s.w[0] = {{1.5, 0, 0}, {0, 0, -side * 3}};
    SphereNoSlip<1, 1>::value<double>({.5, side}, s.f, s.w, 0, &psi);
    EXPECT_NEAR(psi, 0, 1e-15);
    s.w[0].v(0) += 1;
    SphereNoSlip<1, 1>::value<double>({.5, side}, s.f, s.w, 0, &psi);
    EXPECT_NEAR(psi, -1, 1e-15);
  }
}

TEST(Rolling, KnifeMovesAlongItsEdge)
{
  OnGround s(0, About(Vec3<double>::UnitZ(), .4));
  double   psi;
  s.w[0] = {2 * s.f[0].R.col(0), {0, 0, 5}};
  KnifeNoSlip::value<double>({}, s.f, s.w, 0, &psi);
  EXPECT_NEAR(psi, 0, 1e-15);
  s.w[0].v = 2 * s.f[0].R.col(1);
  KnifeNoSlip::value<double>({}, s.f, s.w, 0, &psi);
  EXPECT_NEAR(psi, -2, 1e-15);
}

/* ---- curves ---- */

namespace
{

using Points = std::vector<Vec3<double>>;

/* a knotted closed curve */
Vec3<double> Trefoil(double a)
{
  return {std::sin(a) + 2 * std::sin(2 * a), std::cos(a) - 2 * std::cos(2 * a), -std::sin(3 * a)};
}
Points TrefoilPoints(int n)
{
  Points p;
  for (int k = 0; k < n; k++) p.push_back(Trefoil(2 * M_PI * k / n));
  return p;
}
Points OpenPoints() { return {{0, 0, 0}, {1, .3, .2}, {1.7, 1.2, -.3}, {2, 2.2, .4}, {3.1, 2.5, 1}}; }
Points PlanarPoints() { return {{0, 0, 0}, {1, .5, 0}, {2, -.3, 0}, {3.2, .4, 0}}; }

struct Point {
  Vec3<double> c, c1, c2, n1, n2;
};
Point At(const Curve &curve, double s)
{
  Point p;
  curve.path()(s, p.c, p.c1, p.c2);
  curve.at<double>(s, p.c, p.n1, p.n2);
  return p;
}

/* a marker near the curve of j, away from its spline knots, with a remembered parameter nearby */
template <int R>
typename OnCurve<R>::Data NearCurve(std::shared_ptr<const Curve> curve, Random &random, Frame<double> *f)
{
  const auto        &knots = curve->path().knots();
  const int          k     = (int)random(0, knots.size() - 1.001);
  const double       s     = knots[k] + random(.2, .8) * (knots[k + 1] - knots[k]);
  const Point        p     = At(*curve, s);
  const Vec3<double> local = p.c + random(-.1, .1) * p.n1 + random(-.1, .1) * p.n2;
  f[0].x                   = f[1].x + f[1].R * local;
  return {{s + random(-.1, .1)}, curve};
}

} // namespace

TEST(Curve, Derivatives)
{
  const auto closed = std::make_shared<const Curve>(TrefoilPoints(24), true, false);
  const auto open   = std::make_shared<const Curve>(OpenPoints(), false, false);
  const auto planar = std::make_shared<const Curve>(PlanarPoints(), false, true);
  ASSERT_EQ(closed->error() + open->error() + planar->error(), "");
  CheckConstraint<OnCurve<2>>([&](Random &random, Frame<double> *f) { return NearCurve<2>(closed, random, f); });
  CheckConstraint<OnCurve<2>>([&](Random &random, Frame<double> *f) { return NearCurve<2>(open, random, f); });
  CheckConstraint<OnCurve<1>>([&](Random &random, Frame<double> *f) { return NearCurve<1>(planar, random, f); });
}

TEST(Curve, PassesThroughItsPointsTwiceContinuouslyDifferentiable)
{
  for (bool closed : {false, true}) {
    const Points points = closed ? TrefoilPoints(15) : OpenPoints();
    const Curve  curve(points, closed, false);
    const auto  &knots = curve.path().knots();
    ASSERT_EQ(curve.error(), "");
    ASSERT_EQ(knots.size(), points.size() + closed);
    const double e = 1e-9;
    for (std::size_t k = 0; k < knots.size(); k++) {
      const Point before = At(curve, knots[k] - e), behind = At(curve, knots[k] + e);
      EXPECT_LT((At(curve, knots[k]).c - points[k % points.size()]).norm(), 1e-14);
      EXPECT_LT((before.c - behind.c).norm(), 1e-8);
      EXPECT_LT((before.c1 - behind.c1).norm(), 1e-7);
      EXPECT_LT((before.c2 - behind.c2).norm(), 1e-6);
      EXPECT_LT((before.n1 - behind.n1).norm(), 1e-7);
    }
  }
}

TEST(Curve, NormalsAreOrthonormal)
{
  for (bool closed : {false, true}) {
    const Curve curve(closed ? TrefoilPoints(15) : OpenPoints(), closed, false);
    for (double s = -1; s < curve.path().length() + 1; s += .037) {
      const Point  p = At(curve, s);
      Mat3<double> R;
      R << p.c1.normalized(), p.n1, p.n2;
      EXPECT_LT((R.transpose() * R - Mat3<double>::Identity()).norm(), 1e-13);
      EXPECT_NEAR(R.determinant(), 1, 1e-13);
    }
  }
}

/* A circle through 60 points: the error is of fourth order in their distance. A closed curve is periodic in its parameter */
TEST(Curve, Circle)
{
  double radial[2];
  for (int k = 0; k < 2; k++) {
    Points points;
    for (int i = 0, n = 30 << k; i < n; i++)
      points.push_back({2 * std::cos(2 * M_PI * i / n), 2 * std::sin(2 * M_PI * i / n), 0});
    const Curve curve(points, true, true);
    ASSERT_EQ(curve.error(), "");
    radial[k] = 0;
    for (double s = 0; s < curve.path().length(); s += .01)
      radial[k] = std::max(radial[k], std::abs(At(curve, s).c.norm() - 2));
    EXPECT_LT((At(curve, .3).c - At(curve, .3 + 3 * curve.path().length()).c).norm(), 1e-13);
    EXPECT_LT((At(curve, .3).c - At(curve, .3 - 2 * curve.path().length()).c).norm(), 1e-13);
  }
  EXPECT_LT(radial[1], 1e-5);
  EXPECT_NEAR(std::log2(radial[0] / radial[1]), 4, .3);
}

TEST(Curve, GoesOnStraightBeyondItsEnds)
{
  const Curve  curve(OpenPoints(), false, false);
  const double end = curve.path().length();
  for (double s : {0., end}) EXPECT_LT(At(curve, s).c2.norm(), 1e-13);
  const Point last = At(curve, end), beyond = At(curve, end + 3), first = At(curve, 0), before = At(curve, -3);
  EXPECT_LT((beyond.c - last.c - 3 * last.c1).norm(), 1e-13);
  EXPECT_LT((before.c - first.c + 3 * first.c1).norm(), 1e-13);
  EXPECT_NEAR(curve.closest(beyond.c + .2 * beyond.n1, end), end + 3, 1e-12);
}

TEST(Curve, ClosestPoint)
{
  Random random(7);
  for (bool closed : {false, true}) {
    const Curve curve(closed ? TrefoilPoints(24) : OpenPoints(), closed, false);
    for (int k = 0; k < 50; k++) {
      const double       s  = random(0, curve.path().length());
      const Point        at = At(curve, s);
      const Vec3<double> p  = at.c + random(-.1, .1) * at.n1 + random(-.1, .1) * at.n2;
      EXPECT_LT((At(curve, curve.closest(p)).c - at.c).norm(), 1e-12);
      EXPECT_NEAR(curve.closest(p, s + random(-.2, .2)), s, 1e-12);
    }
  }
}

/* A diverged iteration may ask for the curve point closest to NaN or infinity; the search must end */
TEST(Curve, ClosestPointToNowhereEnds)
{
  const Curve  curve(OpenPoints(), false, false);
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(curve.closest(Vec3<double>(NAN, 0, 0), .3), .3);
  EXPECT_EQ(curve.closest(Vec3<double>(0, infinity, 0), .3), .3);
}

/* On the curve the constraint rows vanish, and the force of the two multipliers is normal to the curve */
TEST(Curve, MultipliersAreNormalForces)
{
  const auto curve = std::make_shared<const Curve>(TrefoilPoints(24), true, false);
  Random     random(9);
  for (int k = 0; k < 20; k++) {
    Frame<double>          f[2] = {random.frame(), random.frame()};
    const double           s    = random(0, curve->path().length());
    const Point            p    = At(*curve, s);
    const OnCurve<2>::Data data{{s + .1}, curve};
    OnCurve<2>::Gradient   J;
    double                 phi[2];
    f[0].x = f[1].x + f[1].R * p.c;
    OnCurve<2>::value<double>(data, f, 0, phi);
    OnCurve<2>::gradient(data, f, 0, J);
    EXPECT_NEAR(phi[0], 0, 1e-13);
    EXPECT_NEAR(phi[1], 0, 1e-13);
    EXPECT_LT((-J.row(0).head<3>().transpose() - f[1].R * p.n1).norm(), 1e-12);
    EXPECT_LT((-J.row(1).head<3>().transpose() - f[1].R * p.n2).norm(), 1e-12);
  }
}

/* Along many rounds of a closed curve the remembered parameter follows and stays within one period */
TEST(Curve, RemembersWhereItIs)
{
  const auto       curve  = std::make_shared<const Curve>(TrefoilPoints(24), true, false);
  const double     length = curve->path().length();
  OnCurve<2>::Data data{{0}, curve};
  Frame<double>    f[2] = {{Vec3<double>::Zero(), Mat3<double>::Identity()},
                           {Vec3<double>::Zero(), Mat3<double>::Identity()}};
  for (double s = 0; s < 2.5 * length; s += .3) {
    double phi[2];
    f[0].x = At(*curve, s).c;
    OnCurve<2>::value<double>(data, f, 0, phi);
    EXPECT_LT(std::abs(phi[0]) + std::abs(phi[1]), 1e-12);
    OnCurve<2>::accept(data, f);
    EXPECT_NEAR(data.memory[0], s - length * std::floor(s / length), 1e-10);
  }
}

/* A bead on a straight track with a bump, which two ends of a step need not show; over the bump it is slower */
TEST(Curve, ABumpOnAStraightTrack)
{
  for (double eps : {1e-4, 1e-6, 1e-8}) {
    Scene                scene(PETSC_COMM_SELF, Space::Planar);
    PointMass            bead;
    std::vector<Vector3> points;
    bead.position = {1, 0, 0};
    bead.velocity = {5, 0, 0};
    for (int k = 0; k <= 400; k++) {
      const double x = 0.05 * k, at = (x - 10) / 0.3;
      points.push_back({x, std::abs(at) < 1 ? 0.05 * (1 + std::cos(M_PI * at)) : 0, 0});
    }
    const Marker i = scene.marker(scene.add("bead", bead));
    scene.gravity({0, -9.81, 0});
    scene.add("track", PointOnCurve{i, scene.marker(scene.ground()), points});
    hhtest::SceneRun run(scene, 3.5, hhtest::tolerance(eps));
    Snapshot now;
    Motion   m;
    hhtest::must(run.solve());
    hhtest::must(now.take(run.ts));
    hhtest::must(now.motion(i, &m));
    EXPECT_LT(m.position(0), 18.47) << eps; /* 18.5 without the bump */
    EXPECT_NEAR(m.position(0), 18.448, eps < 1e-5 ? 0.02 : 0.2) << eps; /* from the bead's energy, by quadrature */
  }
}

TEST(Curve, SaysWhatIsWrong)
{
  const auto error = [](Points p, bool closed, bool planar) { return Curve(std::move(p), closed, planar).error(); };
  EXPECT_NE(error({}, false, false).find("has 0 points, an open one needs at least 2"), std::string::npos);
  EXPECT_NE(error({{0, 0, 0}, {1, 0, 0}}, true, false).find("has 2 points, a closed one needs at least 3"),
            std::string::npos);
  EXPECT_NE(error({{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}, true, false).find("has 2 points"), std::string::npos);
  EXPECT_NE(error({{0, 0, 0}, {1, 0, 0}, {1, 0, 0}}, false, false).find("points 1 and 2 of the curve coincide"),
            std::string::npos);
  EXPECT_NE(error({{0, 0, 0}, {1, NAN, 0}}, false, false).find("point 1 of the curve is not finite"),
            std::string::npos);
  EXPECT_NE(error({{0, 0, 0}, {1, 0, 1}}, false, true).find("point 1 of the curve has z"), std::string::npos);
  EXPECT_NE(error({{0, 0, 0}, {1, 0, 0}, {.01, 0, 0}, {2, 0, 0}}, false, false).find("turns too sharply"),
            std::string::npos);
  EXPECT_EQ(error({{0, 0, 0}, {1, 0, 0}}, false, false), "");
  EXPECT_EQ(error({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}}, true, false), "") << "the first point may be repeated";
}
