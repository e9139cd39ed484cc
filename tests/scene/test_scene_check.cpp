/* Errors in the description of a scene are all reported at once, with the names of parts */
#include "hhtdae/query.h"
#include "hhtdae/scene.h"
#include "scene/model.h"
#include "scene_output.h"
#include "scene_start.h"

using namespace hhtdae;
using namespace hhtest;

namespace
{

/* The error of setUp(), empty if there is none */
std::string complaint(Scene &s)
{
  ErrorTrap            trap;
  const PetscErrorCode code = s.setUp();
  EXPECT_EQ(code != 0, !trap.message.empty());
  return trap.message;
}

std::string complaint(const RigidBody &b, hhtdae::Space space = hhtdae::Space::Spatial)
{
  Scene s(PETSC_COMM_SELF, space);
  s.add("arm", b);
  return complaint(s);
}

#define SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

RigidBody massOf(double m)
{
  RigidBody b;
  b.mass = m;
  return b;
}
RigidBody inertiaOf(const Matrix3 &I)
{
  RigidBody b;
  b.inertia = I;
  return b;
}

} // namespace

TEST(SceneCheck, AGoodBodyPasses) { EXPECT_EQ(complaint(RigidBody()), ""); }

TEST(SceneCheck, EmptyScene)
{
  Scene s(PETSC_COMM_SELF);
  SAYS(complaint(s), "no bodies");
}

TEST(SceneCheck, Mass)
{
  SAYS(complaint(massOf(0)), "body arm moves in a way that has no inertia and that no joint or motion determines (3 such movements");
  SAYS(complaint(massOf(-2.5)), "mass is -2.5");
  SAYS(complaint(massOf(NAN)), "mass is nan");
}

TEST(SceneCheck, Inertia)
{
  Matrix3 I = Matrix3::Identity();
  I(0, 1)   = 0.1;
  SAYS(complaint(inertiaOf(I)), "body arm: inertia is not symmetric (off by 0.141421)");
  SAYS(complaint(inertiaOf(Vector3(1, -1, 1).asDiagonal())),
       "principal moments of inertia are -1, 1, 1, must be positive");
  SAYS(complaint(inertiaOf(Vector3(0, 1, 1).asDiagonal())), "no joint or motion determines (1 such movements");
  SAYS(complaint(inertiaOf(Vector3(1, 1, 3).asDiagonal())), "the largest exceeds the sum of the others");
  SAYS(complaint(inertiaOf(Vector3(1, NAN, 1).asDiagonal())), "inertia must be finite");
  EXPECT_EQ(complaint(inertiaOf(Vector3(1e-6, 1, 1).asDiagonal())), "");
  EXPECT_EQ(complaint(inertiaOf(Vector3(1, 1, 2).asDiagonal())), ""); /* a plate */
}

TEST(SceneCheck, SlenderRodsInAPlane)
{
  EXPECT_EQ(complaint(inertiaOf(Vector3(0, 0, 1).asDiagonal()), hhtdae::Space::Planar), "");
  SAYS(complaint(inertiaOf(Vector3(1, 1, 0).asDiagonal()), hhtdae::Space::Planar), "no joint or motion determines");
  SAYS(complaint(inertiaOf(Vector3(1, 1, -1).asDiagonal()), hhtdae::Space::Planar), "inertia(2,2) is -1");
}

TEST(SceneCheck, Rotation)
{
  RigidBody b;
  b.rotation(0, 0) = 1.1;
  SAYS(complaint(b), "body arm: rotation is not orthonormal");
  b.rotation = Vector3(1, 1, -1).asDiagonal();
  SAYS(complaint(b), "left-handed");
}

TEST(SceneCheck, ThePlaneOfAPlanarScene)
{
  RigidBody b;
  b.position = {0, 0, 0.5};
  SAYS(complaint(b, hhtdae::Space::Planar), "body arm: z is 0.5");
  b                  = RigidBody();
  b.angular_velocity = {1, 0, 0};
  SAYS(complaint(b, hhtdae::Space::Planar), "angular velocity is 1, 0, 0");
  b          = RigidBody();
  b.rotation = Eigen::AngleAxisd(0.3, Vector3::UnitX()).toRotationMatrix();
  SAYS(complaint(b, hhtdae::Space::Planar), "its z axis is not along z");

  Scene      s(PETSC_COMM_SELF, hhtdae::Space::Planar);
  const Body arm = s.add("arm", RigidBody());
  s.marker(arm, {0, 0, 1});
  s.marker(arm, {0, 0, 0}, axesAlong({1, 0, 0}), "tip");
  const std::string text = complaint(s);
  SAYS(text, "marker 0 on arm: z is 1");
  SAYS(text, "marker tip: its z axis is 1, 0, 0");
}

/* A planar scene has forces in its plane and moments about z. Other loads are errors, except that gravity along z,
   which planar models copied from spatial ones have, is only reported */
TEST(SceneCheck, LoadsOutOfThePlane)
{
  using hhtdae::Expression;
  using hhtdae::Measure;
  using hhtdae::Real;
  const auto constant = [](double x) { return Expression{{}, [=](const Real *) -> Real { return x; }}; };
  {
    Scene        s(PETSC_COMM_SELF, hhtdae::Space::Planar);
    const Marker m = s.marker(s.add("arm", RigidBody()));
    s.add("push", hhtdae::UserForce{m, {}, {}, {constant(1), constant(0), constant(5)}, {constant(2), constant(0), constant(3)}});
    const std::string text = complaint(s);
    SAYS(text, "user force push: the force along z is 5; a planar scene has forces in its plane");
    SAYS(text, "the moment about x is 2");
  }
  Scene        s(PETSC_COMM_SELF, hhtdae::Space::Planar);
  const Marker m = s.marker(s.add("arm", RigidBody()));
  const auto   f = s.add("push", hhtdae::UserForce{m, {}, {}, {constant(1), constant(0), Expression{{Measure::time()}, [](const Real *t) { return t[0] + 1; }}}, {}});
  s.gravity({0, -1, -9.81});
  Printed             printed;
  hhtdae::Snapshot    now;
  double              z;
  hhtest::SceneRun    run(s, 0.1, "");
  EXPECT_TRUE(printed.says("gravity along z, -9.81, moves nothing")) << printed.text();
  must(now.take(run.ts));
  must(now.value(Measure::force(f, 2), &z));
  EXPECT_EQ(z, 0);
}

TEST(SceneCheck, NamesAreUnique)
{
  Scene      s(PETSC_COMM_SELF);
  const Body a = s.add("arm", RigidBody()), b = s.add("arm", RigidBody());
  pin(s, "hinge", a, s.ground(), {0, 0, 0});
  pin(s, "hinge", b, s.ground(), {0, 0, 0});
  const std::string text = complaint(s);
  SAYS(text, "body arm: the name is given more than once");
  SAYS(text, "element hinge: the name is given more than once");
}

TEST(SceneCheck, JointsBetweenTwoBodies)
{
  Scene      s(PETSC_COMM_SELF);
  const Body arm = s.add("arm", RigidBody());
  s.add("knot", hhtdae::Revolute{s.marker(arm), s.marker(arm)});
  s.add("anchor", hhtdae::Revolute{s.marker(s.ground()), s.marker(s.ground())});
  s.add("turn", hhtdae::RotationalMotion{s.marker(arm), s.marker(arm, {1, 0, 0}), 0.0});
  const std::string text = complaint(s);
  SAYS(text, "revolute knot: both markers are on arm");
  SAYS(text, "revolute anchor: both markers are on");
  SAYS(text, "rotational motion turn: both markers are on arm");
  EXPECT_EQ(text.find("knot", text.find("knot") + 1), std::string::npos) << "said once: " << text;
}

TEST(SceneCheck, MarkersOfNoBody)
{
  Scene s(PETSC_COMM_SELF);
  s.add("arm", RigidBody());
  s.marker(Body{7}, {0, 0, 0}, Matrix3::Identity(), "lost");
  SAYS(complaint(s), "marker lost: its body is not one of this scene");
}

TEST(SceneCheck, EverythingAtOnce)
{
  Scene s(PETSC_COMM_SELF);
  s.add("a", massOf(-1));
  s.add("b", massOf(-2));
  s.gravity({0, NAN, 0});
  const std::string text = complaint(s);
  SAYS(text, "body a: mass is -1");
  SAYS(text, "body b: mass is -2");
  SAYS(text, "gravity must be finite");
}

TEST(SceneCheck, ManyErrorsAreCounted)
{
  Scene s(PETSC_COMM_SELF);
  for (int k = 0; k < 200; k++) s.add("", massOf(-1));
  const std::string text = complaint(s);
  SAYS(text, "body body 0: mass is -1");
  SAYS(text, "more, see -info");
}

TEST(SceneCheck, OptionsOfTheStart)
{
  Scene s(PETSC_COMM_SELF);
  s.add("arm", RigidBody());
  s.start().equilibrium = false;
  Options in("-scene_assemble project -scene_assemble_tol 1e-4 -scene_redundant refuse -scene_start_time 2");
  ASSERT_EQ(s.setUp(), 0);
  EXPECT_EQ(DataOf(s).start.assembly, hhtdae::Assembly::Project);
  EXPECT_EQ(DataOf(s).start.tolerance, 1e-4);
  EXPECT_EQ(DataOf(s).start.redundant, hhtdae::Redundant::Refuse);
  EXPECT_EQ(DataOf(s).start.time, 2);
  Scene other(PETSC_COMM_SELF);
  other.add("arm", RigidBody());
  {
    Options bad("-scene_assemble_tol -1");
    SAYS(complaint(other), "-scene_assemble_tol is -1");
  }
  Options bad("-scene_angle_tol -1");
  SAYS(complaint(other), "-scene_angle_tol is -1");
}

/* Each run begins according to start() and the options at the time when it is made; the set-up is repeated only if
   these have changed */
TEST(SceneCheck, AStartThatChangesLater)
{
  Scene      s(PETSC_COMM_SELF);
  int        described = 0;
  const auto start     = [&]() -> const hhtdae::StartPolicy & { return must(s.setUp()), DataOf(s).start; };
  s.add("body", [&] { return described++, RigidBody(); });
  EXPECT_EQ(start().rotations, Rotations::Local);
  {
    Options in("-scene_rotations euler313");
    EXPECT_EQ(start().rotations, Rotations::Euler313);
    EXPECT_EQ(start().rotations, Rotations::Euler313);
    EXPECT_EQ(described, 2);
  }
  EXPECT_EQ(start().rotations, Rotations::Local);
  EXPECT_EQ(described, 3);
  s.start().angle_tol = 1e-3;
  EXPECT_EQ(start().angle_tol, 1e-3);
  EXPECT_EQ(start().angle_tol, 1e-3);
  EXPECT_EQ(described, 4);
  s.start().tolerance = -1;
  SAYS(complaint(s), "-scene_assemble_tol is -1");
  s.start().tolerance = 1e-6;
  EXPECT_EQ(start().angle_tol, 1e-3);
  {
    Options in("-scene_equilibrium_pc_type lu -ts_dt -1 -scene_dt 1");
    start();
    start();
    EXPECT_EQ(described, 5); /* options of the set-up's solvers count, those of a run do not; refused options have left the model unchanged */
  }
}

/* Moments of inertia that do not exist, those of a planar body about x and y and those of a point mass, do not set the
   scale by which assembly judges the inertia of a body as too light */
TEST(SceneCheck, InertiaThatIsNotThere)
{
  for (const bool planar : {true, false}) {
    Scene     s(PETSC_COMM_SELF, planar ? Space::Planar : Space::Spatial);
    RigidBody gear;
    gear.mass    = 1e-3;
    gear.inertia = planar ? Matrix3(Vector3(1, 1, 1e-9).asDiagonal()) : Matrix3(1e-9 * Matrix3::Identity());
    s.add("gear", gear);
    s.add("point", PointMass());
    must(s.setUp());
    EXPECT_EQ(ModelOf(s).scene.bodies[0].light_inertia, 0);
  }
}

TEST(SceneCheck, ShearOfAPlanarBeam)
{
  Scene        s(PETSC_COMM_SELF, Space::Planar);
  RigidBody    b;
  b.position = {1, 0, 0};
  Beam beam;
  beam.i    = s.marker(s.add("body", b));
  beam.j    = s.marker(s.ground());
  beam.E    = beam.area = beam.Izz = beam.Iyy = beam.shear_z = 1;
  s.add("beam", beam);
  SAYS(complaint(s), "beam beam: G is 0");
}

/* Points placed at the same position on two bodies, one of them rotated, coincide except for rounding, which must be
   recognized */
TEST(SceneCheck, PointsAtOnePlaceButForRounding)
{
  const Vector3 p(.1, .2, .3);
  for (bool link : {false, true}) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody b;
    b.position           = {1, .7, .2};
    b.rotation           = Eigen::AngleAxisd(.3, Vector3::UnitZ()).toRotationMatrix();
    const Body   turned  = s.add("turned", b);
    const Marker i = s.markerAt(turned, p), j = s.marker(s.ground(), p);
    if (link) s.add("link", hhtdae::PointDistance{i, j});
    else s.add("push", hhtdae::UserScalarForce{i, j, hhtdae::TimeFunction(5)});
    SAYS(complaint(s), "coincide");
  }
}

/* Axes rotated by a third of a turn about (1, 1, 1) are a permutation of the original ones, so that the scalar
   products of a fixed joint vanish although the axes are not parallel */
TEST(SceneCheck, MarkersWithOtherAxes)
{
  for (double angle : {2 * M_PI / 3, -2 * M_PI / 3}) {
    Scene         s(PETSC_COMM_SELF);
    const Body    b    = s.add("arm", RigidBody());
    const Matrix3 axes = Eigen::AngleAxisd(angle, Vector3(1, 1, 1).normalized()).toRotationMatrix();
    const Marker  i = s.marker(b, {0, 0, 0}, axes), j = s.marker(s.ground());
    s.add("fixed", hhtdae::Fixed{i, j});
    SAYS(complaint(s), "fixed: the axes of markers i and j are not parallel at the start");
  }
}

/* For assembly, a planar body without a moment of inertia about z takes one like those of other bodies, whatever its
   other moments of inertia */
TEST(SceneCheck, LightInertiaInThePlane)
{
  Scene     s(PETSC_COMM_SELF, hhtdae::Space::Planar);
  RigidBody b;
  b.inertia(2, 2)  = 0;
  b.mass           = 1e-6;
  const Body   rod = s.add("rod", b);
  s.add("pin", hhtdae::Fixed{s.marker(rod), s.marker(s.ground(), {0, 0, 0})});
  s.marker(rod, {1e-3, 0, 0});
  must(s.setUp());
  EXPECT_LT(hhtdae::DataOf(s).bodies[rod.id].light_inertia, 1e-9);
}
