/* Bodies without mass or moments of inertia whose motion joints determine: the motion is that of a single joint in
   their place */
#include "hhtdae/analyses.h"
#include "hhtdae/query.h"
#include "scene_output.h"
#include "scene_start.h"
#include <cmath>

using namespace hhtest;

namespace
{

RigidBody nothing(const Vector3 &at)
{
  RigidBody b;
  b.mass = 0;
  b.inertia.setZero();
  b.position = at;
  return b;
}

/* Two masses 1 m apart, connected by a massless rod or a point distance, the upper one on a rail along x; returns the
   final position of the lower one */
Vector3 onARail(bool part, double *tension)
{
  Scene     s(PETSC_COMM_SELF, Space::Planar);
  RigidBody b;
  b.mass            = 2;
  const Body upper  = s.add("upper", b);
  b.position        = {1, 0, 0};
  const Body lower  = s.add("lower", b);
  const Marker i = s.marker(upper), j = s.marker(lower);
  s.add("rail", Translational{i, s.marker(s.ground())});
  Element link;
  Marker  end = j;
  if (part) {
    const Body rod = s.add("rod", nothing({0.3, 0, 0})); /* the initial position of a massless body is arbitrary */
    end            = s.markerAt(rod, {1, 0, 0});
    s.add("first", Revolute{s.markerAt(rod, Vector3::Zero()), i});
    link = s.add("second", Revolute{j, end});
  } else
    link = s.add("link", PointDistance{j, i});
  s.gravity({0, -9.81, 0});
  SceneRun run(s, 1, tolerance(1e-9));
  must(run.solve());
  Snapshot now;
  Motion   m, n;
  Load     l;
  must(now.take(run.ts));
  must(now.motion(j, &m));
  must(now.motion(i, &n));
  must(now.load(link, j, &l));
  *tension = l.force.dot((n.position - m.position).normalized());
  EXPECT_NEAR(l.force.norm(), std::abs(*tension), 1e-6 * l.force.norm()) << "along the rod alone";
  return m.position;
}

/* A bob on an arm of 1 m, on a universal joint or on a massless cross and two revolutes */
Vector3 onACross(bool part)
{
  Scene     s(PETSC_COMM_SELF);
  RigidBody b     = rod({0, 0, 0}, {0.6, 0, -0.8});
  b.inertia       = Vector3(1e-3, 1. / 12, 1. / 12).asDiagonal();
  const Body bob  = s.add("bob", b);
  const auto axes = [](const Vector3 &z) { return hhtest::axesAlong(z); };
  const Vector3 x(1, 0, 0), y(0, 1, 0);
  if (part) {
    const Body cross = s.add("cross", nothing({0, 0, 0}));
    s.add("one", Revolute{s.marker(cross, Vector3::Zero(), axes(x)), s.marker(s.ground(), Vector3::Zero(), axes(x))});
    s.add("two", Revolute{s.markerAt(bob, Vector3::Zero(), axes(y)), s.marker(cross, Vector3::Zero(), axes(y))});
  } else
    s.add("joint", Universal{s.markerAt(bob, Vector3::Zero(), axes(y)), s.marker(s.ground(), Vector3::Zero(), axes(x))});
  s.gravity({0, 3, -9});
  const Marker tip = s.markerAt(bob, {0.6, 0, -0.8});
  SceneRun     run(s, 1.5, tolerance(1e-8));
  must(run.solve());
  Snapshot now;
  Motion   m;
  must(now.take(run.ts));
  must(now.motion(tip, &m));
  return m.position;
}

} // namespace

TEST(Massless, RodAsAPointDistance)
{
  double        tension[2];
  const Vector3 a = onARail(true, &tension[0]), b = onARail(false, &tension[1]);
  MEASURED("apart by %g, tension %.9g and %.9g", (a - b).norm(), tension[0], tension[1]);
  EXPECT_LT((a - b).norm(), 1e-5);
  EXPECT_NEAR(tension[0], tension[1], 5e-3); /* of 20; changes of h shortly before the end cause up to 2.5e-3 at some tolerances near 1e-9 */
}

TEST(Massless, CrossAsAUniversalJoint)
{
  const Vector3 a = onACross(true), b = onACross(false);
  MEASURED("apart by %g", (a - b).norm());
  EXPECT_LT((a - b).norm(), 1e-5);
}

/* A cross between two shafts at an angle of 0.5 rad, with mass and moments far below theirs: tan b = cos 0.5 tan a.
   Where the axes meet at right angles, as at the start, two rows are dependent by accident; a neighbouring position
   shows that they are not redundant */
TEST(Massless, NextToNothing)
{
  const double bend = 0.5;
  for (double mass : {1e-12, 1.})
    for (double moment : {1e-14, 1e-9}) {
      Scene         s(PETSC_COMM_SELF);
      const Vector3 y(0, 1, 0), z1(0, 0, 1), z2(std::sin(bend), 0, std::cos(bend)), x1(1, 0, 0), x2 = y.cross(z2);
      const auto    axes = [](const Vector3 &z, const Vector3 &x) { return (Matrix3() << x, z.cross(x), z).finished(); };
      const auto    shaft = [&](const char *name, const Vector3 &at) {
        RigidBody b;
        b.mass     = 1;
        b.inertia  = Vector3(0.01, 0.01, 0.02).asDiagonal();
        b.position = at;
        return s.add(name, b);
      };
      const Body first = shaft("first", -0.5 * z1), second = shaft("second", 0.5 * z2);
      RigidBody  part;
      part.mass        = mass;
      part.inertia     = moment * Matrix3::Identity();
      const Body cross = s.add("cross", part);
      const auto both  = [&](const Body &a, const Body &b, const Vector3 &at, const Matrix3 &R) { return std::make_pair(s.markerAt(a, at, R), s.markerAt(b, at, R)); };
      const auto in = both(first, s.ground(), -0.5 * z1, axes(z1, x1)), out = both(second, s.ground(), 0.5 * z2, axes(z2, x2));
      const auto to = both(cross, first, Vector3::Zero(), axes(y, x1)), from = both(cross, second, Vector3::Zero(), axes(x2, y));
      s.add("in", Revolute{in.first, in.second});
      s.add("out", Cylindrical{out.first, out.second});
      s.add("to", Revolute{to.first, to.second});
      s.add("from", Revolute{from.first, from.second});
      s.add("turn", RotationalMotion{in.first, in.second, TimeFunction::polynomial({0, 2})});
      SceneRun run(s, 0.5, tolerance(1e-8) + "-scene_assemble project ");
      must(run.solve());
      Snapshot now;
      double   angle;
      must(now.take(run.ts));
      must(now.value(Measure::angle(out.first, out.second), &angle));
      EXPECT_NEAR(angle, std::atan(std::cos(bend) * std::tan(1.)), 1e-5) << mass << ' ' << moment;
    }
}

/* Rods without moment of inertia about their axes, on universal joints that determine the rotation about the axis */
TEST(Massless, RodsWithoutMomentAboutTheirAxes)
{
  Vector3 end[2];
  for (int exact = 0; exact < 2; exact++) {
    Scene  s(PETSC_COMM_SELF);
    Marker last = s.marker(s.ground(), Vector3::Zero(), hhtest::axesAlong(Vector3(0, 1, 0)));
    Body   body;
    for (int k = 0; k < 3; k++) {
      RigidBody b = rod(Vector3(k, 0, 0), Vector3(k + 1, 0, 0));
      b.inertia   = Vector3(exact ? 0 : 1e-9, 1. / 12, 1. / 12).asDiagonal();
      body        = s.add("rod" + std::to_string(k), b);
      s.add("joint" + std::to_string(k), Universal{s.markerAt(body, Vector3(k, 0, 0), hhtest::axesAlong(Vector3(0, 0, 1))), last});
      last = s.markerAt(body, Vector3(k + 1, 0, 0), hhtest::axesAlong(Vector3(0, 1, 0)));
    }
    s.gravity({0, 2, -9.81});
    SceneRun run(s, 1, tolerance(1e-8));
    must(run.solve());
    Snapshot now;
    Motion   m;
    must(now.take(run.ts));
    must(now.motion(last, &m));
    end[exact] = m.position;
  }
  EXPECT_LT((end[0] - end[1]).norm(), 1e-5);
}

/* Assembly and equilibrium work without mass */
TEST(Massless, AssembledAndInEquilibrium)
{
  Scene      s(PETSC_COMM_SELF, Space::Planar);
  RigidBody  b;
  b.position       = {1.9, 0.2, 0};
  const Body link  = s.add("link", nothing({0.6, 0.1, 0})), load = s.add("load", b);
  s.add("pin", Revolute{s.marker(link, {-0.5, 0, 0}), s.marker(s.ground())});
  s.add("clamp", Fixed{s.marker(load, {-1, 0, 0}), s.marker(link, {0.5, 0, 0})});
  s.gravity({0, -10, 0});
  s.start().assembly    = Assembly::Project;
  s.start().equilibrium = true;
  must(s.setUp());
  EXPECT_LT((DataOf(s).bodies[load.id].r - Vector3(0, -2, 0)).norm(), 1e-8);
}

TEST(Massless, WhatIsFreeIsRefused)
{
  Scene s(PETSC_COMM_SELF);
  const Body arm = s.add("arm", nothing({1, 0, 0})), weight = s.add("weight", RigidBody());
  s.add("ball", Spherical{s.markerAt(arm, Vector3::Zero()), s.marker(s.ground())});
  s.add("tip", Spherical{s.markerAt(arm, {2, 0, 0}), s.markerAt(weight, {2, 0, 0})});
  ErrorTrap error;
  EXPECT_NE(s.setUp(), 0);
  EXPECT_TRUE(error.says("body arm moves in a way that has no inertia and that no joint or motion determines (1 such movements in the scene)")) << error.message;
}
