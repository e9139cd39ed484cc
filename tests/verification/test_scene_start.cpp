/* Assembly, redundant constraints and static equilibrium against closed forms. */
#include "hhtdae/scene.h"
#include "scene_start.h"
#include <chrono>

using namespace hhtest;
using hhtdae::Assembly;
using hhtdae::Redundant;
using hhtdae::Space;

namespace
{

std::string complaint(Scene &s)
{
  ErrorTrap trap;
  (void)s.setUp();
  return trap.message;
}

#define SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

const hhtdae::BodyData &body(const Scene &s, Body b) { return DataOf(s).bodies[b.id]; }
Vector3 pointOf(const Scene &s, Body b, const Vector3 &in_body) { return body(s, b).r + body(s, b).A * in_body; }
double  angleOf(const Scene &s, Body b) { return std::atan2(body(s, b).A(1, 0), body(s, b).A(0, 0)); }

/* Solves to t and returns the state */
Array run(Scene &s, double t, const std::string &options, Array *rates = nullptr)
{
  Options in(options);
  TS      ts;
  Vec     U, V;
  must(s.createTS(&ts));
  must(TSSetMaxTime(ts, t));
  must(TSSetFromOptions(ts));
  must(s.solve(ts));
  must(TS2GetSolution(ts, &U, &V));
  Array u = whole(U);
  if (rates) *rates = whole(V);
  must(TSDestroy(&ts));
  return u;
}

} // namespace

/* ---- violated constraints ---- */

TEST(SceneAssembly, AMisfitIsAnErrorThatNamesTheJoint)
{
  Scene      s(PETSC_COMM_SELF);
  const Body arm = s.add("arm", rod({0, 0, 0}, {1, 0, 0}));
  s.add("hinge", hhtdae::Revolute{s.marker(arm, {-0.5, 0.25, 0}), s.marker(s.ground())});
  const std::string text = complaint(s);
  SAYS(text, "revolute hinge: not met by 0.25");
  SAYS(text, "-scene_assemble project");
}

TEST(SceneAssembly, ASmallMisfitPasses)
{
  Scene      s(PETSC_COMM_SELF);
  const Body arm = s.add("arm", rod({0, 0, 0}, {1, 0, 0}));
  s.add("hinge", hhtdae::Revolute{s.marker(arm, {-0.5 + 1e-8, 0, 0}), s.marker(s.ground())});
  EXPECT_EQ(complaint(s), "");
  EXPECT_NEAR(DataOf(s).started.misfit, 2e-8, 1e-10); /* relative to the size of the model, half a metre */
}

/* Neither unconnected bodies nor markers used only for measuring, far away, make a gap relatively smaller */
TEST(SceneAssembly, FarMarkersAndBodies)
{
  for (int other = 0; other < 4; other++) {
    Scene         s(PETSC_COMM_SELF);
    const Vector3 at(1e4, 0, 0);
    const Body    arm = s.add("arm", rod(at, at + Vector3(1, 0, 0)));
    s.add("hinge", hhtdae::Revolute{s.marker(arm, {-0.5 + 5e-3, 0, 0}), s.markerAt(s.ground(), at)});
    if (other == 1) s.channel("height", Measure::displacement(s.marker(arm), 2, s.marker(s.ground())));
    if (other == 2) s.add("far", PointMass{});
    if (other == 3) s.add("another", hhtdae::Spherical{s.marker(s.add("bob", rod({0, 0, 0}, {1, 0, 0})), {-.5, 0, 0}), s.marker(s.ground())});
    SAYS(complaint(s), "revolute hinge: not met by 0.005");
  }
}

TEST(SceneAssembly, OffLetsEverythingPass)
{
  Scene      s(PETSC_COMM_SELF);
  const Body arm = s.add("arm", rod({0, 0, 0}, {1, 0, 0}));
  s.add("hinge", hhtdae::Revolute{s.marker(arm, {0, 0, 0}), s.marker(s.ground())});
  s.start().assembly = Assembly::Off;
  EXPECT_EQ(complaint(s), "");
}

TEST(SceneAssembly, VelocitiesAreHeldAgainstTheConstraints)
{
  Scene     s(PETSC_COMM_SELF);
  RigidBody b    = rod({0, 0, 0}, {1, 0, 0});
  b.velocity     = {0, 1, 0}; /* a rod that rotates about its end with 2 rad/s */
  const Body arm = s.add("arm", b);
  pin(s, "hinge", arm, s.ground(), {0, 0, 0});
  SAYS(complaint(s), "revolute hinge: velocities violate it by 1");
}

/* ---- projection ---- */

/* Two point masses on a rod of given length share the correction in the ratio of their masses */
TEST(SceneAssembly, TheSmallestChangeInTheMetricOfTheMasses)
{
  Scene      s(PETSC_COMM_SELF);
  const Body a = s.add("light", hhtdae::PointMass{1, {0, 0, 0}, {0, 0, 0}, false});
  const Body b = s.add("heavy", hhtdae::PointMass{3, {1.4, 0, 0}, {4, 1, 0}, false});
  s.add("rod", hhtdae::PointDistance{s.marker(a), s.marker(b), 1});
  s.start().assembly = Assembly::Project;
  ASSERT_EQ(s.setUp(), 0);
  EXPECT_NEAR(body(s, a).r(0), 0.3, 1e-12);
  EXPECT_NEAR(body(s, b).r(0), 1.3, 1e-12);
  EXPECT_NEAR(body(s, a).v(0), 3, 1e-9); /* momentum is conserved: (0 + 3 * 4) / 4 */
  EXPECT_NEAR(body(s, b).v(0), 3, 1e-9);
  EXPECT_NEAR(body(s, b).v(1), 1, 1e-12);
}

TEST(SceneAssembly, AFixedStartStays)
{
  Scene      s(PETSC_COMM_SELF);
  const Body a = s.add("held", hhtdae::PointMass{1e-3, {0, 0, 0}, {0, 2, 0}, true});
  const Body b = s.add("free", hhtdae::PointMass{3, {1.4, 0, 0}, {5, 0, 0}, false});
  s.add("rod", hhtdae::PointDistance{s.marker(a), s.marker(b), 1});
  s.start().assembly = Assembly::Project;
  ASSERT_EQ(s.setUp(), 0);
  EXPECT_EQ(body(s, a).r, Vector3(0, 0, 0));
  EXPECT_EQ(body(s, a).v, Vector3(0, 2, 0));
  EXPECT_NEAR(body(s, b).r(0), 1, 1e-12);
  EXPECT_NEAR(body(s, b).v(0), 0, 1e-9);
}

/* The crank is fixed, the other bodies are displaced: positions by intersection of circles, angular velocities by the
   loop equation */
TEST(SceneAssembly, AWronglyGivenFourBar)
{
  for (Space space : {Space::Planar, Space::Spatial}) {
    Scene         s(PETSC_COMM_SELF, space);
    const Linkage given(1.0), m(1.0);
    Linkage       f(1.0);
    RigidBody     crank    = rod(f.A, f.B);
    const double  w        = 2;
    crank.fixed_start      = true;
    crank.angular_velocity = {0, 0, w};
    crank.velocity         = Vector3(0, 0, w).cross(crank.position);
    f.build(s, crank, {0.3, 0.4, space == Space::Planar ? 0.0 : 0.2});
    s.start().assembly = Assembly::Project;
    Printed quiet;
    ASSERT_EQ(s.setUp(), 0);
    EXPECT_EQ(body(s, f.crank).r, crank.position);
    EXPECT_NEAR((pointOf(s, f.coupler, {1.25, 0, 0}) - m.C).norm(), 0, 1e-9);
    EXPECT_NEAR((pointOf(s, f.rocker, {1, 0, 0}) - m.D).norm(), 0, 1e-9);
    /* w_r z x (C - D) = w z x B + w_c z x (C - B) */
    Eigen::Matrix2d A;
    const Vector3   bc = m.C - m.B, dc = m.C - m.D;
    A << -dc(1), bc(1), dc(0), -bc(0);
    const Eigen::Vector2d turn = A.inverse() * (w * Eigen::Vector2d(-m.B(1), m.B(0)));
    EXPECT_NEAR(body(s, f.rocker).w(2), turn(0), 1e-8);
    EXPECT_NEAR(body(s, f.coupler).w(2), turn(1), 1e-8);
    MEASURED("four-bar thrown off by %.2g assembled in %d iterations", DataOf(s).started.moved,
             (int)DataOf(s).started.assembly_iterations);
  }
}

TEST(SceneAssembly, LargeTurns)
{
  Scene     s(PETSC_COMM_SELF);
  RigidBody b;
  b.rotation     = Eigen::AngleAxisd(0.8, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  const Body box = s.add("box", b);
  s.add("weld", hhtdae::Fixed{s.marker(box), s.marker(s.ground())});
  s.start().assembly = Assembly::Project;
  ASSERT_EQ(s.setUp(), 0);
  EXPECT_NEAR((body(s, box).A - Matrix3::Identity()).norm(), 0, 1e-9);
  EXPECT_NEAR(DataOf(s).started.turned, 0.8, 1e-9);
}

TEST(SceneAssembly, MotionsGiveVelocities)
{
  Scene        s(PETSC_COMM_SELF);
  const Body   arm = s.add("arm", rod({0, 0, 0}, {1, 0, 0}));
  const Marker i = s.markerAt(arm, {0, 0, 0}), j = s.marker(s.ground());
  s.add("hinge", hhtdae::Revolute{i, j});
  s.add("drive", hhtdae::RotationalMotion{i, j, hhtdae::TimeFunction::polynomial({0.5, 3})});
  s.start().assembly = Assembly::Project;
  s.start().time     = 0.1;
  ASSERT_EQ(s.setUp(), 0);
  EXPECT_NEAR(angleOf(s, arm), 0.8, 1e-9);
  EXPECT_NEAR(body(s, arm).w(2), 3, 1e-9);
  EXPECT_NEAR(body(s, arm).v.norm(), 1.5, 1e-9);
  TS        ts;
  PetscReal t;
  ASSERT_EQ(s.createTS(&ts), 0);
  ASSERT_EQ(TSGetTime(ts, &t), 0);
  EXPECT_EQ(t, 0.1);
  ASSERT_EQ(TSDestroy(&ts), 0);
}

TEST(SceneAssembly, WhatCannotBeAssembledIsNamedAndStays)
{
  Scene      s(PETSC_COMM_SELF, Space::Planar);
  const Body arm = s.add("arm", rod({0, 0, 0}, {1, 0, 0}));
  s.add("near", hhtdae::Revolute{s.markerAt(arm, {0, 0, 0}), s.marker(s.ground())});
  s.add("far", hhtdae::Revolute{s.markerAt(arm, {1, 0, 0}), s.marker(s.ground(), {1.5, 0, 0})});
  s.start().assembly     = Assembly::Project;
  const std::string text = complaint(s);
  SAYS(text, "cannot be assembled");
  SAYS(text, "revolute far: not met by 0.25");
  SAYS(text, "revolute near: not met by 0.25");
  EXPECT_EQ(body(s, arm).r, Vector3(0.5, 0, 0));
}

TEST(SceneAssembly, ContradictingMotions)
{
  Scene        s(PETSC_COMM_SELF);
  const Body   arm = s.add("arm", rod({0, 0, 0}, {1, 0, 0}));
  const Marker i = s.markerAt(arm, {0, 0, 0}), j = s.marker(s.ground());
  s.add("hinge", hhtdae::Revolute{i, j});
  s.add("slow", hhtdae::RotationalMotion{i, j, hhtdae::TimeFunction::polynomial({0, 1})});
  s.add("fast", hhtdae::RotationalMotion{i, j, hhtdae::TimeFunction::polynomial({0, 2})});
  s.start().assembly     = Assembly::Project;
  const std::string text = complaint(s);
  SAYS(text, "no initial velocities satisfy all constraints");
  SAYS(text, "rotational motion slow");
}

/* Shafts of a constant-velocity joint that are described a quarter turn apart: there the gradient of the constraint
   violation gives no direction in which to turn them */
TEST(SceneAssembly, AQuarterTurnOff)
{
  for (double more : {0., 1e-9}) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody shaft;
    shaft.inertia       = Vector3(0.1, 0.1, 0.2).asDiagonal();
    shaft.position      = {0, 0, -0.5};
    const Body a        = s.add("a", shaft);
    shaft.position      = {0, 0, 0.5};
    shaft.rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1; /* exactly, whereas cos(M_PI / 2) is not zero */
    shaft.rotation = shaft.rotation * Eigen::AngleAxisd(more, Vector3::UnitZ()).toRotationMatrix();
    const Body b        = s.add("b", shaft);
    s.add("ja", hhtdae::Revolute{s.marker(a), s.marker(s.ground(), {0, 0, -0.5})});
    s.add("jb", hhtdae::Cylindrical{s.marker(b), s.marker(s.ground(), {0, 0, 0.5})});
    s.add("cv", hhtdae::ConstantVelocity{s.marker(a, {0, 0, 0.5}), s.marker(b, {0, 0, -0.5})});
    s.start().assembly = Assembly::Project;
    Printed quiet;
    EXPECT_EQ(s.setUp(), 0) << more;
    EXPECT_LT(DataOf(s).started.misfit, 1e-9);
    EXPECT_NEAR(DataOf(s).started.turned, M_PI / 4, 0.1); /* each shaft turns by half of it */
  }
}

/* ---- redundant constraints ---- */

TEST(SceneRedundant, TreesCostNothing)
{
  Scene s(PETSC_COMM_SELF);
  Body  last = s.ground();
  for (int k = 0; k < 2000; k++) {
    const Vector3 from(k, 0, 0), to(k + 1, 0, 0);
    const Body    next = s.add("", rod(from, to));
    pin(s, "", next, last, from);
    last = next;
  }
  ASSERT_EQ(s.setUp(), 0);
  EXPECT_EQ(DataOf(s).started.core, 0);
  EXPECT_EQ(DataOf(s).started.redundant, 0);
  EXPECT_EQ(DataOf(s).started.degreesOfFreedom(), 2000);
}

TEST(SceneRedundant, APlanarFourBarOfSpatialHinges)
{
  Scene   s(PETSC_COMM_SELF);
  Linkage f;
  f.build(s);
  Printed printed;
  ASSERT_EQ(s.setUp(), 0);
  const hhtdae::StartResult &r = DataOf(s).started;
  EXPECT_EQ(r.coordinates, 18);
  EXPECT_EQ(r.rows, 20);
  EXPECT_EQ(r.redundant, 3);
  EXPECT_EQ(r.dropped.size(), 3u);
  EXPECT_EQ(r.degreesOfFreedom(), 1);
  EXPECT_TRUE(printed.says("scene: 3 redundant of 20 constraints dropped"));
  EXPECT_TRUE(printed.says("(parallel axes)")) << printed.text();
  MEASURED("%s", printed.text().c_str());
}

/* One hinge is misaligned by less than the precision with which a direction is usually given. Either its redundant
   rows are dropped and the mechanism moves, or an error says that it is locked */
TEST(SceneRedundant, AHingeSlightlyOutOfLine)
{
  for (double tilt : {0., 1e-10, 1e-9, 3e-9, 1e-8, 3e-8, 1e-7, 3e-7, 6e-7}) {
    Scene      s(PETSC_COMM_SELF);
    const Body a = s.add("a", rod({0, 0, 0}, {0, 1, 0})), b = s.add("b", rod({0, 1, 0}, {2, 1, 0})), c = s.add("c", rod({2, -0.5, 0}, {2, 1, 0}));
    pin(s, "A", a, s.ground(), {0, 0, 0});
    pin(s, "B", b, a, {0, 1, 0});
    pin(s, "C", c, b, {2, 1, 0});
    pin(s, "D", c, s.ground(), {2, -0.5, 0}, Vector3(tilt, 0.3 * tilt, 1).normalized());
    Printed              printed;
    ErrorTrap            trap;
    const PetscErrorCode failed = s.setUp();
    if (failed) {
      EXPECT_TRUE(trap.says("with them it is locked")) << trap.message;
      EXPECT_GT(tilt, 1e-8);
    } else EXPECT_EQ(DataOf(s).started.degreesOfFreedom(), 1) << tilt;
  }
}

/* A small mechanism far from the origin keeps all of its constraints */
TEST(SceneRedundant, FarFromTheOrigin)
{
  Scene         s(PETSC_COMM_SELF);
  const Vector3 far(7e6, 0, 0), arm(0.1, 0, 0);
  const Body    a = s.add("a", rod(far - arm, far + arm));
  RigidBody     other = rod(far - arm, far + arm);
  const Body    b = s.add("b", other);
  s.add("one", hhtdae::Spherical{s.markerAt(a, far - arm), s.markerAt(b, far - arm)});
  s.add("two", hhtdae::InLine{s.markerAt(a, far + arm), s.markerAt(b, far + arm, axesAlong({1, 0, 0}))});
  s.add("three", hhtdae::Spherical{s.markerAt(a, far), s.marker(s.ground(), far)});
  s.marker(s.ground());
  Printed quiet;
  ASSERT_EQ(s.setUp(), 0);
  EXPECT_EQ(DataOf(s).started.redundant, 0);
}

/* Dropping redundant rows does not change the motion: it is that of the planar scene, which has none */
TEST(SceneRedundant, TheMotionIsThatOfTheMinimalMechanism)
{
  const std::string options = "-ts_rtol 1e-7 -ts_atol 1e-7";
  double            x[2], y[2];
  for (Space space : {Space::Planar, Space::Spatial}) {
    Scene   s(PETSC_COMM_SELF, space);
    Linkage f;
    f.build(s);
    s.gravity({0, -9.81, 0});
    Printed        quiet;
    const Array    u           = run(s, 0.5, options);
    const PetscInt first       = ModelOf(s).number.body[f.rocker.id];
    x[space == Space::Spatial] = u[first];
    y[space == Space::Spatial] = u[first + 1];
  }
  EXPECT_NEAR(x[0], x[1], 1e-6);
  EXPECT_NEAR(y[0], y[1], 1e-6);
}

TEST(SceneRedundant, Bricard)
{
  Scene s(PETSC_COMM_SELF);
  bricard(s);
  Printed     printed;
  Array       v;
  s.start().rotations = hhtdae::Rotations::Euler313; /* with Euler angles the state that is read below contains whole attitudes */
  const Array u = run(s, 1, "-ts_rtol 1e-7 -ts_atol 1e-7", &v);
  EXPECT_EQ(DataOf(s).started.rows, 30);
  EXPECT_EQ(DataOf(s).started.redundant, 1);
  EXPECT_EQ(DataOf(s).started.degreesOfFreedom(), 1);
  const auto       run_ = layOut(s);
  hhtdae::Runtime &R    = *run_;
  R.bodies.move(u.data(), v.data());
  double energy = 0, start = 0;
  for (PetscInt b = 0; b < 5; b++) {
    const hhtdae::BodyMotion &m = R.bodies.now[b];
    const Vector3             w = m.A.transpose() * m.w;
    energy += 0.5 * m.v.squaredNorm() + 0.5 * w.dot(DataOf(s).bodies[b].inertia * w) + 9.81 * m.r(1);
    start += 9.81 * DataOf(s).bodies[b].r(1);
  }
  /* the last hinge, whose redundant row was dropped */
  const Vector3 end = R.bodies.now[4].r + R.bodies.now[4].A * Vector3(0.5, 0, 0);
  EXPECT_LT((end - Vector3(0, 0, 1)).norm(), 1e-6);
  EXPECT_NEAR(energy, start, 1e-3);
  EXPECT_GT(R.bodies.now[2].v.norm(), 0.1);
  MEASURED("Bricard: energy off by %.2e of %.3g, last hinge open by %.1e at t = 1", energy - start, start,
           (end - Vector3(0, 0, 1)).norm());
}

TEST(SceneRedundant, RefusedOrKept)
{
  {
    Scene   s(PETSC_COMM_SELF);
    Linkage f;
    f.build(s);
    s.start().redundant    = Redundant::Refuse;
    const std::string text = complaint(s);
    SAYS(text, "3 of 20 constraints follow from the others");
    SAYS(text, "revolute ");
    SAYS(text, " of 5 (");
  }
  Scene   s(PETSC_COMM_SELF);
  Linkage f;
  f.build(s);
  s.start().redundant = Redundant::Keep;
  ASSERT_EQ(s.setUp(), 0);
  EXPECT_EQ(ModelOf(s).n, 18 + 20);
}

/* Links in one line: a row is dependent only in this singular position and must not be dropped */
TEST(SceneRedundant, ASingularStartDropsNothing)
{
  Scene      s(PETSC_COMM_SELF, Space::Planar);
  const Body a = s.add("crank", rod({0, 0, 0}, {1, 0, 0})), b = s.add("coupler", rod({1, 0, 0}, {4.5, 0, 0})),
             c = s.add("rocker", rod({3, 0, 0}, {4.5, 0, 0}));
  pin(s, "A", a, s.ground(), {0, 0, 0});
  pin(s, "B", a, b, {1, 0, 0});
  pin(s, "C", b, c, {4.5, 0, 0});
  pin(s, "D", c, s.ground(), {3, 0, 0});
  Printed printed;
  ASSERT_EQ(s.setUp(), 0);
  EXPECT_EQ(DataOf(s).started.redundant, 0);
  EXPECT_TRUE(printed.says("singular position: 1 constraints are redundant there and 0 next to it")) << printed.text();
}

/* A kinematically driven mechanism without degrees of freedom is allowed; a motion that repeats the row of a joint is
   redundant */
TEST(SceneRedundant, NoDegreesOfFreedom)
{
  Scene        s(PETSC_COMM_SELF);
  const Body   arm = s.add("arm", rod({0, 0, 0}, {1, 0, 0}));
  const Marker i = s.markerAt(arm, {0, 0, 0}), j = s.marker(s.ground());
  s.add("hinge", hhtdae::Revolute{i, j});
  s.add("drive", hhtdae::RotationalMotion{i, j, 0.0});
  s.add("again", hhtdae::RotationalMotion{i, j, 0.0});
  Printed quiet;
  ASSERT_EQ(s.setUp(), 0);
  EXPECT_EQ(DataOf(s).started.degreesOfFreedom(), 0);
  EXPECT_EQ(DataOf(s).started.redundant, 1);
}

TEST(SceneRedundant, ANetOfLoops)
{
  for (int n : {4, 12, 32}) {
    Scene s(PETSC_COMM_SELF);
    net(s, n);
    Printed    quiet;
    const auto begin = std::chrono::steady_clock::now();
    ASSERT_EQ(s.setUp(), 0);
    const double               time   = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const hhtdae::StartResult &r      = DataOf(s).started;
    const int                  bodies = 2 * n * (n - 1), hinges = 2 * bodies - n * n + 1, loops = hinges - bodies;
    EXPECT_EQ(r.rows, 5 * hinges);
    EXPECT_EQ(r.redundant, 3 * loops);
    /* planar: three coordinates per rod, two rows per hinge */
    EXPECT_EQ(r.degreesOfFreedom(), 3 * bodies - 2 * hinges);
    MEASURED("net of %d rods, %d rows, core %d: %d redundant, set-up in %.3f s", bodies, (int)r.rows, (int)r.core,
             (int)r.redundant, time);
  }
}

/* ---- equilibrium ---- */

TEST(SceneEquilibrium, AMassOnASpring)
{
  Scene        s(PETSC_COMM_SELF);
  const double k = 200, m = 2, g = 9.81, L = 0.5;
  const Body   b = s.add("mass", hhtdae::PointMass{m, {0.4, 0.3, 0.2}, {1, 0, 0}, false});
  s.add("spring", hhtdae::SpringDamper{s.marker(b), s.marker(s.ground()), k, 0, L});
  s.gravity({0, 0, -g});
  s.start().equilibrium = true;
  ASSERT_EQ(s.setUp(), 0);
  EXPECT_NEAR(body(s, b).r(2), -(L + m * g / k), 1e-8);
  EXPECT_NEAR(body(s, b).r.head<2>().norm(), 0, 1e-7);
  EXPECT_EQ(body(s, b).v, Vector3(0, 0, 0));
  MEASURED("mass on a spring: %d steps to equilibrium", (int)DataOf(s).started.equilibrium_iterations);
}

/* A box suspended from a spring at a point off its centre of mass: spring, marker and centre of mass end up on a
   vertical line */
TEST(SceneEquilibrium, ABoxHungOffItsCentre)
{
  Scene        s(PETSC_COMM_SELF);
  const double k = 1000, m = 3, g = 10, L = 0.2;
  RigidBody    box;
  box.mass        = m;
  box.inertia     = Vector3(0.1, 0.2, 0.15).asDiagonal();
  box.position    = {0.3, 0.1, -0.2};
  const Body    b = s.add("box", box);
  const Vector3 eye(0.1, 0.2, 0.3);
  s.add("spring", hhtdae::SpringDamper{s.marker(b, eye), s.marker(s.ground()), k, 0, L});
  s.gravity({0, 0, -g});
  s.start().equilibrium = true;
  ASSERT_EQ(s.setUp(), 0);
  const double  low = L + m * g / k;
  const Vector3 at  = pointOf(s, b, eye);
  EXPECT_NEAR(at(2), -low, 1e-8);
  EXPECT_NEAR(at.head<2>().norm(), 0, 1e-6);
  EXPECT_NEAR(body(s, b).r(2), -low - eye.norm(), 1e-8);
  /* and it stays there */
  Array v;
  run(s, 1, "-ts_rtol 1e-6 -ts_atol 1e-6", &v);
  for (double x : v) EXPECT_NEAR(x, 0, 1e-5);
}

TEST(SceneEquilibrium, APendulumFromAnywhere)
{
  for (Space space : {Space::Planar, Space::Spatial}) {
    Scene      s(PETSC_COMM_SELF, space);
    const Body arm = s.add("arm", rod({0, 0, 0}, {0.6, 0.8, 0})); /* initially above the pivot */
    pin(s, "hinge", arm, s.ground(), {0, 0, 0});
    s.gravity({0, -9.81, 0});
    s.start().equilibrium = true;
    ASSERT_EQ(s.setUp(), 0);
    EXPECT_NEAR((body(s, arm).r - Vector3(0, -0.5, 0)).norm(), 0, 1e-8);
    MEASURED("pendulum from above: %d steps", (int)DataOf(s).started.equilibrium_iterations);
  }
}

TEST(SceneEquilibrium, WhatFallsForEverIsNamed)
{
  Scene      s(PETSC_COMM_SELF);
  const Body arm = s.add("arm", rod({0, 0, 0}, {1, 0, 0}));
  RigidBody  b;
  b.position   = {0, 3, 0};
  b.velocity   = {1, 0, 0};
  b.mass       = 5;
  const Body f = s.add("stone", b);
  pin(s, "hinge", arm, s.ground(), {0, 0, 0});
  s.gravity({0, -9.81, 0});
  s.start().equilibrium  = true;
  const std::string text = complaint(s);
  SAYS(text, "no static equilibrium");
  SAYS(text, "left on stone");
  EXPECT_EQ(body(s, f).r, Vector3(0, 3, 0));
  EXPECT_EQ(body(s, f).v, Vector3(1, 0, 0));
}
