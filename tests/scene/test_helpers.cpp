/* Axes; moments of inertia against sums over points; joints from a point and an axis */
#include "hhtdae/helpers.h"
#include "hhtdae/query.h"
#include "scene_output.h"

using namespace hhtest;

namespace
{

/* Inertia of those points of a cube of half edge `half` that are inside; all points have the same mass */
template <class Inside> Matrix3 summed(double mass, double half, const Inside &inside)
{
  const int n = 80;
  Matrix3   J = Matrix3::Zero();
  int       count = 0;
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++)
      for (int k = 0; k < n; k++) {
        const Vector3 x = half * (Vector3(2 * i + 1, 2 * j + 1, 2 * k + 1) / n - Vector3::Ones());
        if (!inside(x)) continue;
        count++;
        J += x.squaredNorm() * Matrix3::Identity() - x * x.transpose();
      }
  return mass / count * J;
}

void expectNear(const Matrix3 &a, const Matrix3 &b, double relative) { EXPECT_LT((a - b).norm(), relative * b.norm()) << a << "\nfor\n" << b; }

} // namespace

TEST(Helpers, Inertia)
{
  expectNear(inertia::box(3, {1, 2, 0.5}), summed(3, 1, [](const Vector3 &x) { return std::abs(x(0)) < 0.5 && std::abs(x(1)) < 1 && std::abs(x(2)) < 0.25; }), 1e-3);
  expectNear(inertia::tube(3, 0.8, 0.5, 1.5),
             summed(3, 1, [](const Vector3 &x) { const double r = x.head<2>().norm(); return r < 0.8 && r > 0.5 && std::abs(x(2)) < 0.75; }), 5e-3);
  expectNear(inertia::cylinder(3, 0.7, 1.8), summed(3, 1, [](const Vector3 &x) { return x.head<2>().norm() < 0.7 && std::abs(x(2)) < 0.9; }), 5e-3);
  expectNear(inertia::ellipsoid(3, {1, 0.5, 0.7}), summed(3, 1, [](const Vector3 &x) { return x.cwiseQuotient(Vector3(1, 0.5, 0.7)).norm() < 1; }), 5e-3);
  expectNear(inertia::sphere(2, 0.9), 2 * 0.4 * 0.81 * Matrix3::Identity(), 1e-14);
  expectNear(inertia::disc(2, 0.9), inertia::diagonal(0.405, 0.405, 0.81), 1e-14);
}

/* A box composed of two halves has the inertia of the whole box, for any position and orientation of the halves */
TEST(Helpers, Composed)
{
  const Matrix3   R = axesAlong({1, 2, 3}, {0, 1, 0});
  const Vector3   at(0.3, -0.2, 0.7);
  RigidBody       half[2];
  for (int k = 0; k < 2; k++) {
    half[k].mass     = 2;
    half[k].inertia  = inertia::box(2, {1, 0.4, 0.2});
    half[k].rotation = R;
    half[k].center   = {0.1, 0, 0};
    half[k].position = at + R * Vector3(k ? 0.5 : -0.5, 0, 0) - R * half[k].center;
  }
  const RigidBody whole = composed({half[0], half[1]});
  EXPECT_DOUBLE_EQ(whole.mass, 4);
  EXPECT_LT((whole.center - at).norm(), 1e-14);
  expectNear(whole.inertia, inertia::turned(inertia::box(4, {2, 0.4, 0.2}), R), 1e-14);
}

TEST(Helpers, AxesAlong)
{
  for (const Vector3 &z : {Vector3(0, 0, 2), Vector3(-1, 1e-9, 0), Vector3(1, 2, 3)})
    for (const Vector3 &x : {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(z)}) {
      const Matrix3 A = axesAlong(z, x);
      EXPECT_LT((A.transpose() * A - Matrix3::Identity()).norm(), 1e-14);
      EXPECT_NEAR(A.determinant(), 1, 1e-14);
      EXPECT_LT((A.col(2) - z.normalized()).norm(), 1e-14);
    }
  EXPECT_LT((axesAlong({0, 0, 1}, {1, 0, 5}) - Matrix3::Identity()).norm(), 1e-14);
}

/* Without a given x: x is the space axis along which z has its smallest component (the first of several), minus its
   component along z, as in Python's axes_along() */
TEST(Helpers, AxesAlongOneDirection)
{
  const Vector3 ex(1, 0, 0), ey(0, 1, 0), ez(0, 0, 1);
  EXPECT_EQ((axesAlong(ez) - Matrix3::Identity()).norm(), 0);
  const struct {
    Vector3 z, x;
  } cases[] = {{ex, ey}, {ey, ex}, {ez, ex}, {-ex, ey}, {-ey, ex}, {-ez, ex}, {5 * ez, ex}, {{3, 4, 0}, ez}, {{0, 0.6, -0.8}, ex}, {{0.6, 0, 0.8}, ey},
               {{1, 1, 1}, {2, -1, -1}}, {{1, -2, 3}, {13, 2, -3}}, {{-3, 2, 1}, {3, -2, 13}}, {{2, -1, 2}, {2, 8, 2}}};
  for (const auto &c : cases)
    for (const Vector3 &x : {Vector3(0, 0, 0), c.z, Vector3(-2 * c.z)}) {
      const Matrix3 A = axesAlong(c.z, x);
      EXPECT_LT((A.col(2) - c.z.normalized()).norm(), 1e-14) << c.z.transpose();
      EXPECT_LT((A.col(0) - c.x.normalized()).norm(), 1e-14) << c.z.transpose() << " has x along " << A.col(0).transpose();
      EXPECT_LT((A.col(1) - c.z.cross(c.x).normalized()).norm(), 1e-14) << c.z.transpose();
    }
}

/* In a planar scene connect() with Translational lets a body slide along the x axis of space */
TEST(Helpers, ASlideInThePlane)
{
  Scene     scene(PETSC_COMM_SELF, Space::Planar);
  RigidBody b;
  b.position       = {0.5, 0.2, 0};
  b.velocity       = {3, 0, 0};
  const Body body  = scene.add("slider", b);
  const Element  e = connect<Translational>(scene, "slide", body, scene.ground(), b.position);
  scene.gravity({0, -10, 0});
  scene.channel("x", Measure::displacement(scene.marker(body), 0));
  scene.channel("y", Measure::displacement(scene.marker(body), 1));
  scene.channel("guide", Measure::jointForce(e, 1)); /* along y_j */
  SceneRun            run(scene, 2, tolerance(1e-8));
  std::vector<double> now;
  must(run.solve());
  must(scene.sample(run.ts, 2, now));
  EXPECT_NEAR(now[0], 6.5, 1e-6);
  EXPECT_NEAR(now[1], 0.2, 1e-9);
  EXPECT_NEAR(now[2], 10, 1e-5);
}

/* A rod with a pin through its end about a slanted axis swings like a pendulum with the moment of inertia about the pin */
TEST(Helpers, AJointFromAPointAndAnAxis)
{
  Scene         scene(PETSC_COMM_SELF);
  const Vector3 axis = Vector3(0, 1, 1).normalized();
  RigidBody     rod;
  rod.mass     = 2;
  rod.inertia  = inertia::cylinder(2, 0.02, 1);
  rod.rotation = axesAlong({1, 0, 0});
  rod.position = {0.5, 0, 0};
  const Body    body  = scene.add("rod", rod);
  const Element pin   = connect<Revolute>(scene, "pin", body, scene.ground(), Vector3::Zero(), axis);
  scene.gravity({0, 0, -9.81});
  scene.channel("a", Measure::angularAcceleration(scene.marker(body), 1));
  SceneRun            run(scene, 1e-4, tolerance(1e-8));
  std::vector<double> x;
  must(run.solve());
  must(scene.sample(run.ts, 1e-4, x));
  const double J = inertia::about(inertia::turned(rod.inertia, rod.rotation), 2, {-0.5, 0, 0})(1, 1), moment = 2 * 9.81 * 0.5 * axis(1);
  EXPECT_NEAR(x[0], moment / J * axis(1), 1e-4);
  EXPECT_EQ(pin.id, 0);
}
