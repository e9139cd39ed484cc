/* Shapes in contact, against known penetration, normal and contact point */
#include "contact_cases.h"

using namespace hhtdae;

namespace
{

template <class Shape>
Touch<double> TouchAt(const typename Shape::Data &d, const Vec3<double> &x, const Mat3<double> &R = upright)
{
  const Frame<double> f[2] = {{x, R}, origin};
  Touch<double>       t;
  Shape::template touch<double>(d, f, t);
  return t;
}

void ExpectTouch(const Touch<double> &t, double depth, const Vec3<double> &n, const Vec3<double> &p,
                 double tolerance = 1e-14)
{
  EXPECT_NEAR(t.depth, depth, tolerance);
  EXPECT_LT((t.n - n).norm(), tolerance) << "normal " << t.n.transpose();
  EXPECT_LT((t.p - p).norm(), tolerance) << "contact point " << t.p.transpose();
}

} // namespace

TEST(ContactShapes, SphereOnPlane)
{
  ExpectTouch(TouchAt<SpherePlaneShape>({2, 2}, {3, 4, 1.9}), .1, {0, 0, 1}, {3, 4, -.1});
  ExpectTouch(TouchAt<SpherePlaneShape>({2, 2}, {3, 4, 2.5}), -.5, {0, 0, 1}, {3, 4, .5});
  ExpectTouch(TouchAt<SpherePlaneShape>({2, 1}, {3, 1.5, 0}), .5, {0, 1, 0}, {3, -.5, 0}); /* disc of a planar scene */
}

/* upright ellipsoids by their semiaxes; a turned one by its support function */
TEST(ContactShapes, EllipsoidOnPlane)
{
  const EllipsoidPlaneShape::Data d{{1, 2, 3}, 2};
  ExpectTouch(TouchAt<EllipsoidPlaneShape>(d, {5, 6, 2.8}), .2, {0, 0, 1}, {5, 6, -.2});
  const Mat3<double> lying = Eigen::AngleAxisd(M_PI / 2, Vec3<double>::UnitX()).toRotationMatrix();
  ExpectTouch(TouchAt<EllipsoidPlaneShape>(d, {5, 6, 2.8}, lying), -.8, {0, 0, 1}, {5, 6, .8});
  const Mat3<double> tilted = Eigen::AngleAxisd(M_PI / 4, Vec3<double>::UnitX()).toRotationMatrix();
  const double       reach  = std::sqrt((4 + 9) / 2.);
  const auto         t      = TouchAt<EllipsoidPlaneShape>(d, {0, 0, 2}, tilted);
  EXPECT_NEAR(t.depth, reach - 2, 1e-14);
  const Vec3<double> local = tilted.transpose() * (t.p - Vec3<double>(0, 0, 2));
  EXPECT_NEAR(local(0) * local(0) + local(1) * local(1) / 4 + local(2) * local(2) / 9, 1, 1e-14); /* the point is on the surface */
  EXPECT_NEAR(t.p(2), 2 - reach, 1e-14);                                                          /* and is the lowest point */
}

TEST(ContactShapes, EllipsoidWithEqualSemiaxesIsASphere)
{
  Random random(29);
  for (int k = 0; k < 20; k++) {
    Frame<double>                            f[2] = {random.frame(), random.frame()};
    const Twist<double>                      w[2] = {random.twist(), random.twist()};
    const Contact<SpherePlaneShape>::Data    sphere{{1.3, 2}, SomeLaw(random)};
    const Contact<EllipsoidPlaneShape>::Data ellipsoid{{{1.3, 1.3, 1.3}, 2}, sphere.law};
    Press<SpherePlaneShape>(sphere.shape, f, .2);
    ForceJacobian<2, 0> a, b;
    Wrench<double>      on_a[2], on_b[2];
    Contact<SpherePlaneShape>::jacobian(sphere, f, w, 0, nullptr, on_a, a);
    Contact<EllipsoidPlaneShape>::jacobian(ellipsoid, f, w, 0, nullptr, on_b, b);
    ExpectClose(checks::ToVector<2>(on_b), checks::ToVector<2>(on_a), 1e-12, "wrenches");
    ExpectClose(b.frames, a.frames, 1e-12, "d wrenches/d frames");
    ExpectClose(b.twists, a.twists, 1e-12, "d wrenches/d twists");
  }
}

/* a wheel about the y axis, leaning by an angle towards lying flat */
TEST(ContactShapes, TorusOnPlane)
{
  const TorusPlaneShape::Data d{2, .5};
  auto leaning = [](double a) { return Eigen::AngleAxisd(a - M_PI / 2, Vec3<double>::UnitX()).toRotationMatrix(); };
  ExpectTouch(TouchAt<TorusPlaneShape>(d, {7, 8, 2.4}, leaning(0)), .1, {0, 0, 1}, {7, 8, -.1});
  for (double a : {.3, M_PI / 4, 1.5}) {
    /* z_i is at (0, cos a, sin a), so the circle's lowest point is at 2 (0, sin a, -cos a) */
    const double reach = 2 * std::cos(a) + .5;
    ExpectTouch(TouchAt<TorusPlaneShape>(d, {7, 8, 2}, leaning(a)), reach - 2, {0, 0, 1},
                {7, 8 + 2 * std::sin(a), 2 - reach}, 1e-13);
  }
}

/* The torus lies flat: the contact point is the middle of the ring, and the force is differentiable through this position */
TEST(ContactShapes, TorusLyingFlat)
{
  const TorusPlaneShape::Data d{2, .5};
  ExpectTouch(TouchAt<TorusPlaneShape>(d, {7, 8, .4}), .1 + 2 * .375e-3, {0, 0, 1}, {7, 8, -.1});
  Random random(31);
  for (double tilt : {0., 1e-4, .9e-3, 1.1e-3}) {
    const Mat3<double>         R    = Eigen::AngleAxisd(tilt, random.direction()).toRotationMatrix();
    const Frame<double>        f[2] = {{Vec3<double>(7, 8, .4), R}, origin};
    const Twist<double>        w[2] = {random.twist(), random.twist()};
    Encounter<TorusPlaneShape> s(random);
    std::copy(f, f + 2, s.f);
    std::copy(w, w + 2, s.w);
    s.d.shape                = d;
    const DynamicVector rate = Difference([&](double h) { return s.depthAfter(h); }, 2e-6);
    EXPECT_NEAR(s.rate(s.touch()), rate(0), 1e-7);
    const Contact<TorusPlaneShape>::Data contact{d, MakeLaw(3, 1.5, .2, .5, 1)};
    ForceJacobian<2, 0>                  J;
    Wrench<double>                       on[2];
    DynamicMatrix                        frames(12, 12);
    Contact<TorusPlaneShape>::jacobian(contact, f, w, 0, nullptr, on, J);
    for (int a = 0; a < 12; a++)
      frames.col(a) = Difference(
          [&](double h) {
            Frame<double>  g[2] = {f[0], f[1]};
            Wrench<double> moved[2];
            g[a / 6] = Moved(f[a / 6], a % 6, h);
            Contact<TorusPlaneShape>::wrench(contact, g, w, 0, nullptr, moved);
            return checks::ToVector<2>(moved);
          },
          2e-6);
    ExpectClose(J.frames, frames, 1e-7, "d wrenches/d frames");
  }
}

TEST(ContactShapes, SphereOnSphere)
{
  ExpectTouch(TouchAt<SphereSphereShape>({1, 2}, {0, 2.8, 0}), .2, {0, 1, 0}, {0, 1.9, 0}, 1e-11);
  ExpectTouch(TouchAt<SphereSphereShape>({1, 2}, {4, 0, 3}), -2, {.8, 0, .6}, {2.4, 0, 1.8}, 1e-11);
  const auto inside = TouchAt<SphereSphereShape>({1, 2}, {0, 0, 0});
  EXPECT_TRUE(inside.n.allFinite() && inside.p.allFinite());
  EXPECT_EQ(inside.n.norm(), 0);
}

/* Exchanging the spheres exchanges their wrenches */
TEST(ContactShapes, SpheresExchanged)
{
  Random random(37);
  for (int k = 0; k < 20; k++) {
    const Encounter<SphereSphereShape> s(random);
    const Frame<double>                f[2] = {s.f[1], s.f[0]};
    const Twist<double>                w[2] = {s.w[1], s.w[0]};
    Wrench<double>                     on[2], exchanged[2];
    Contact<SphereSphereShape>::wrench(s.d, s.f, s.w, 0, nullptr, on);
    Contact<SphereSphereShape>::wrench({{s.d.shape.radius_j, s.d.shape.radius_i}, s.d.law}, f, w, 0, nullptr,
                                       exchanged);
    for (int m = 0; m < 2; m++) {
      EXPECT_LT((on[m].f - exchanged[1 - m].f).norm(), 1e-11 * (1 + on[m].f.norm()));
      EXPECT_LT((on[m].m - exchanged[1 - m].m).norm(), 1e-11 * (1 + on[m].m.norm()));
    }
  }
}

TEST(ContactShapes, SphereOnBox)
{
  const SphereBoxShape::Data d{1, {1, 2, 3}};
  const double               r2 = std::sqrt(.5), r3 = std::sqrt(1 / 3.);
  /* faces */
  ExpectTouch(TouchAt<SphereBoxShape>(d, {.5, 1, 3.8}), .2, {0, 0, 1}, {.5, 1, 2.8});
  ExpectTouch(TouchAt<SphereBoxShape>(d, {-2.5, 1, 2}), -.5, {-1, 0, 0}, {-1.5, 1, 2});
  /* edges, corners */
  ExpectTouch(TouchAt<SphereBoxShape>(d, {1.6, -2.8, 1}), 0, {.6, -.8, 0}, {1, -2, 1}, 1e-13);
  ExpectTouch(TouchAt<SphereBoxShape>(d, {1.5, .3, -3.5}), 1 - r2, {r2, 0, -r2}, {1.5 - r2, .3, -3.5 + r2});
  ExpectTouch(TouchAt<SphereBoxShape>(d, {-1.5, 2.5, 3.5}), 1 - .5 / r3, {-r3, r3, r3},
              {-1.5 + r3, 2.5 - r3, 3.5 - r3});
  /* centre inside the box, nearest to the face x = 1; on the face; exactly on the corner */
  ExpectTouch(TouchAt<SphereBoxShape>(d, {.9, 1, 2}), 1.1, {1, 0, 0}, {-.1, 1, 2});
  ExpectTouch(TouchAt<SphereBoxShape>(d, {1, 1, 2}), 1, {1, 0, 0}, {0, 1, 2});
  EXPECT_NEAR(TouchAt<SphereBoxShape>(d, {1, 2, 3}).n.norm(), 1, 1e-14);
  EXPECT_NEAR(TouchAt<SphereBoxShape>(d, {1 + 3e-16, 2 + 5e-16, 3}).n.norm(), 1, 1e-14);
  /* a box that is infinite along z, as in planar scenes */
  ExpectTouch(TouchAt<SphereBoxShape>({1, {1, 2, std::numeric_limits<double>::infinity()}}, {.9, 1, 0}), 1.1, {1, 0, 0},
              {-.1, 1, 0});
}

/* Depth and normal are continuous from face to edge to corner, and through a face */
TEST(ContactShapes, SphereOnBoxIsContinuous)
{
  const SphereBoxShape::Data d{1, {1, 2, 3}};
  const double               e         = 1e-9;
  const Vec3<double>         borders[] = {{1, 1, 3.5}, {1, 2, 3.5}, {1.3, 2, 3.5}, {.5, 1.5, 3}};
  for (const Vec3<double> &x : borders)
    for (int k = 0; k < 8; k++) {
      const Vec3<double> step(k & 1 ? e : -e, k & 2 ? e : -e, k & 4 ? e : -e);
      const auto         here = TouchAt<SphereBoxShape>(d, x), there = TouchAt<SphereBoxShape>(d, x + step);
      EXPECT_NEAR(here.depth, there.depth, 4 * e);
      EXPECT_LT((here.n - there.n).norm(), 10 * e);
    }
}

/* With the centre inside the box, away from points equally near to two faces, the derivatives are also right */
TEST(ContactShapes, SphereInsideBox)
{
  CheckForce<Contact<SphereBoxShape>>([](Random &random, Frame<double> *f) {
    f[0].x = f[1].x + f[1].R * Vec3<double>(random(-.5, .5), random(-.5, .5), random(.8, .9));
    return Contact<SphereBoxShape>::Data{{.4, {1, 1, 1}}, SomeLaw(random)};
  });
}
