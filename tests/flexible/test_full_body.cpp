/* A whole finite-element model in a scene: Jacobian against differences, rigid motion, ties, refused input */
#include "box_model.h"
#include "hhtdae/analyses.h"
#include "hhtdae/flexible.h"
#include "hhtdae/query.h"
#include "scene/extension.h"
#include "scene_jacobian.h"
#include "scene_output.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

struct Beam8 {
  FeModel model{PETSC_COMM_WORLD};
  explicit Beam8(std::vector<int> n = {2, 1, 1}, Material soft = {1000, 0.3, 2}) { BoxBuilder({{n[0], n[1], n[2]}, {2, 0.7, 0.5}, soft}, &model); }
};

FullBody placed(FeLaw law)
{
  FullBody b;
  b.law              = law;
  b.position         = {0.4, -0.1, 0.7};
  b.rotation         = Eigen::AngleAxisd(0.8, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
  b.velocity         = {0.3, 1, -0.2};
  b.angular_velocity = {1, 0.5, -2};
  b.mass_damping     = 0.3;
  return b;
}

/* Rigid attachment on a ball joint; averaging attachment with a rigid body and a spring */
struct Held {
  Beam8      beam;
  Scene      scene{PETSC_COMM_WORLD};
  FullFeBody fe;
  explicit Held(FeLaw law)
  {
    FullBody b = placed(law);
    if (law == FeLaw::Small) b.stiffness_damping = 0.02;
    b.attachments.resize(2);
    b.attachments[0].name     = "left";
    b.attachments[0].at_given = true;
    b.attachments[0].position = {0, 0.2, -0.1};
    b.attachments[1].name     = "right";
    b.attachments[1].tie      = Tie::Average;
    b.attachments[1].at_given = true;
    b.attachments[1].position = {2.1, 0.3, 0.2};
    scene.gravity({0.3, 1, -9.81});
    must(fe.add(scene, "beam", beam.model, b));
    const Marker left = scene.marker(fe.attachment("left")), right = scene.marker(fe.attachment("right"));
    const auto   l = DataOf(scene).frame(left), r = DataOf(scene).frame(right);
    scene.add("ball", Spherical{left, scene.marker(scene.ground(), l.x)});
    RigidBody load;
    load.position = r.x;
    load.rotation = r.R;
    scene.add("hinge", Revolute{right, scene.marker(scene.add("load", load))});
    scene.add("spring", SpringDamper{right, scene.marker(scene.ground(), Vector3(r.x + Vector3(1, 1, 1))), 100, 5, 1});
    scene.start().assembly = Assembly::Off;
    must(scene.setUp());
  }
};

} // namespace

TEST(FullBody, JacobianAgainstDifferences)
{
  for (FeLaw law : {FeLaw::Small, FeLaw::Large}) {
    Held h(law);
    for (unsigned seed : {1, 2}) {
      AnyState s(h.scene, seed, 0.1);
      EXPECT_LT(s.jacobianError(2.7, 13., .2), 1e-5) << (law == FeLaw::Small ? "small" : "large");
    }
  }
}

/* Neither a large rotation (law large) nor a displacement that is rigid to first order (law small) causes strain */
TEST(FullBody, RigidMotionMakesNoForce)
{
  for (FeLaw law : {FeLaw::Small, FeLaw::Large}) {
    Beam8      beam;
    Scene      scene(PETSC_COMM_WORLD);
    FullFeBody fe;
    FullBody   b     = placed(law);
    b.mass_damping   = 0;
    must(fe.add(scene, "beam", beam.model, b));
    must(scene.setUp());
    AnyState s(scene, 1, 0);
    must(VecSet(s.V, 0));
    must(VecSet(s.A, 0));
    double       *u;
    const Matrix3 R = Eigen::AngleAxisd(law == FeLaw::Large ? 2.5 : 1e-7, Vector3(1, 1, 0.3).normalized()).toRotationMatrix();
    must(VecGetArray(s.U, &u));
    for (PetscInt i = 0; i < s.R.n; i += 3) {
      const Vector3 x(u[i], u[i + 1], u[i + 2]), y = R * x + Vector3(5, -3, 1);
      std::copy(y.data(), y.data() + 3, u + i);
    }
    must(VecRestoreArray(s.U, &u));
    double most = 0;
    for (double f : s.residual()) widen(most, std::abs(f));
    EXPECT_LT(most, 1e-10);
  }
}

/* A body with small displacements (law small) that turns by more than 0.1 rad about its length, or across it, is
   reported once */
TEST(FullBody, TurnsTooFarForSmallDisplacements)
{
  struct Case {
    FeLaw  law;
    int    axis;
    double angle;
    int    lines;
  };
  for (const Case &c : {Case{FeLaw::Small, 2, 0.2, 1}, {FeLaw::Small, 0, 0.2, 1}, {FeLaw::Small, 2, 0.09, 0}, {FeLaw::Large, 2, 0.2, 0}}) {
    Beam8      beam({2, 1, 1}, {1e6, 0.3, 2});
    Scene      scene(PETSC_COMM_WORLD);
    FullFeBody fe;
    FullBody   b;
    TS         ts;
    TSAdapt    adapt;
    b.law                      = c.law;
    b.angular_velocity[c.axis] = 1;
    must(fe.add(scene, "beam", beam.model, b));
    must(scene.createTS(&ts));
    must(TSSetMaxTime(ts, c.angle));
    must(TSSetTolerances(ts, 1e-5, nullptr, 1e-5, nullptr));
    must(TSGetAdapt(ts, &adapt));
    must(TSAdaptSetStepLimits(adapt, PETSC_DEFAULT, 0.02)); /* reports come at the ends of steps */
    testing::internal::CaptureStdout();
    must(scene.solve(ts));
    const std::string said = testing::internal::GetCapturedStdout();
    const auto        at   = said.find("full body beam has turned");
    EXPECT_EQ(at != std::string::npos, c.lines == 1) << said;
    if (c.lines) {
      EXPECT_EQ(said.find("has turned", at + 20), std::string::npos) << said;
      EXPECT_NE(said.find("law large", at), std::string::npos) << said;
    }
    must(TSDestroy(&ts));
  }
}

/* The constraints that tie attachment frames to nodes are satisfied at the start, for rigid and averaging attachments */
TEST(FullBody, TiesHold)
{
  Held        h(FeLaw::Large);
  AnyState    s(h.scene, 1, 0);
  const Array f = s.residual();
  for (std::size_t x = 0; x < DataOf(h.scene).extensions.size(); x++) {
    const Extension &e = *DataOf(h.scene).extensions[x];
    for (PetscInt i = 0; i < e.multipliers(); i++) EXPECT_NEAR(f[e.start[0] + e.coordinates() + i], 0, 1e-12);
    EXPECT_EQ(e.multipliers(), 3 * 4 + 6);
  }
}

namespace
{

/* A cantilever in static equilibrium under a lateral force at its tip; returns the displacement along the force and
   the motion of the tip's marker */
double deflection(const Box &box, FeLaw law, double force, Motion *x, Matrix3 *axes)
{
  FeModel  model(PETSC_COMM_WORLD);
  BoxBuilder(box, &model);
  Scene    scene(PETSC_COMM_WORLD);
  FullBody b = placed(law);
  b.velocity = b.angular_velocity = Vector3::Zero();
  b.attachments = {{"left"}, {"right"}};
  FullFeBody fe;
  must(fe.add(scene, "beam", model, b));
  const Marker left = scene.marker(fe.attachment("left")), right = scene.marker(fe.attachment("right"));
  const auto   l = DataOf(scene).frame(left), r = DataOf(scene).frame(right);
  scene.add("clamp", Fixed{left, scene.marker(scene.ground(), l.x, l.R)});
  const Vector3 f = force * r.R.col(2);
  UserForce     load;
  load.i = right;
  for (int c = 0; c < 3; c++) load.force.push_back(Expression({Measure::time()}, [y = f(c)](const Real *t) -> Real { return 0. * t[0] + y; }));
  scene.add("load", load);
  SceneRun run(scene, 1, "");
  must(StaticEquilibrium(run.ts, 0));
  Snapshot now;
  must(now.take(run.ts));
  must(now.motion(right, x));
  *axes = r.R;
  return r.R.col(2).dot(x->position - r.x);
}

} // namespace

/* A rigid attachment of a body with small displacements rotates to first order, consistent with the linear bending, so
   that deflections are proportional to the load. With an exact rotation the face would be strained by half the square
   of the angle, against the stiffness K: 7 % less deflection here, at an angle of 0.03 */
TEST(FullBody, SmallDisplacementsAreLinear)
{
  const Box    box{{20, 2, 2}, {2, 0.04, 0.02}, {1e9, 0.3, 1000}};
  Motion       x;
  Matrix3      axes;
  const double little = deflection(box, FeLaw::Small, 0.05, &x, &axes), much = deflection(box, FeLaw::Small, 5, &x, &axes);
  EXPECT_NEAR((x.axes.col(2) - axes.col(2)).norm(), 0.032, 0.005);
  EXPECT_NEAR(much, 100 * little, 1e-3 * much);
}

/* If only rounding errors remain the state counts as equilibrium, and a tiny load causes the right deflection */
TEST(FullBody, UnloadedInEquilibrium)
{
  const Box box{{6, 1, 1}, {1, 0.1, 0.1}, {2e11, 0.3, 7800}};
  Motion    x;
  Matrix3   axes;
  for (FeLaw law : {FeLaw::Small, FeLaw::Large}) {
    const double loaded = deflection(box, law, 1, &x, &axes);
    EXPECT_GT(loaded, 1e-8);
    EXPECT_NEAR(deflection(box, law, 0, &x, &axes), 0, 1e-15);
    EXPECT_NEAR(deflection(box, law, 1e-6, &x, &axes), 1e-6 * loaded, 1e-15);
  }
}

/* Node positions before the first step are those of the present state: at the start, and after static equilibrium */
TEST(FullBody, PositionsBeforeTheFirstStep)
{
  const double L = 2, g = 9.81;
  for (FeLaw law : {FeLaw::Small, FeLaw::Large}) {
    Beam8      beam({4, 1, 1}, {1e5, 0, 2});
    Scene      scene(PETSC_COMM_WORLD);
    FullBody   b;
    FullFeBody fe;
    b.law         = law;
    b.attachments = {{"left"}};
    scene.gravity({g, 0, 0}); /* gravity along the beam */
    must(fe.add(scene, "beam", beam.model, b));
    const Marker left = scene.marker(fe.attachment("left"));
    const auto   l    = DataOf(scene).frame(left);
    scene.add("clamp", Fixed{left, scene.marker(scene.ground(), l.x, l.R)});
    SceneRun run(scene, 1, "");
    Array    x;
    must(fe.positions(run.ts, 0, &x));
    EXPECT_EQ(x, beam.model.coordinates);
    must(StaticEquilibrium(run.ts, 0));
    must(fe.positions(run.ts, 0, &x));
    ASSERT_EQ(x.size(), beam.model.coordinates.size());
    for (PetscInt n : beam.model.sets["right"]) EXPECT_NEAR(x[3 * n] - L, 2 * g * L * L / (2 * 1e5), 1e-2 * 2 * g * L * L / (2 * 1e5));
    ErrorTrap trap;
    EXPECT_NE(fe.positions(run.ts, 0.5, &x), 0);
    EXPECT_TRUE(trap.says("There is no step")) << trap.message;
  }
}

/* The error has the name of the body and lists its attachments */
TEST(FullBody, UnknownAttachment)
{
  Beam8      beam;
  Scene      scene(PETSC_COMM_WORLD);
  FullFeBody fe;
  FullBody   b;
  b.attachments = {{"left"}, {"right"}};
  must(fe.add(scene, "beam", beam.model, b));
  scene.marker(fe.attachment("middle"));
  ErrorTrap trap;
  EXPECT_NE(scene.setUp(), 0);
  EXPECT_TRUE(trap.says("finite-element body beam: it has no attachment middle, but left, right")) << trap.message;
}

/* A mesh in two parts whose nodes were not merged: a part that nothing holds is reported. An attachment of any kind
   connects the parts that its nodes belong to */
TEST(FullBody, PartsAreTold)
{
  FeModel model{PETSC_COMM_WORLD};
  Box     box = {{5, 1, 1}, {0.5, 0.1, 0.1}};
  box.present = [](int i, int, int) { return i != 2; };
  BoxBuilder builder(box, &model);
  builder.addSet("all ends", [](const Vector3 &x) { return x[0] < 1e-9 || x[0] > 0.5 - 1e-9; });
  for (const char *nodes : {"left", "all ends"}) {
    Scene      scene(PETSC_COMM_WORLD);
    FullFeBody fe;
    FullBody   b;
    b.attachments        = {{nodes}};
    b.attachments[0].tie = Tie::Average;
    Printed printed;
    must(fe.add(scene, "bar", model, b));
    const bool told = printed.says("finite-element body bar: its mesh falls into 2 parts that nothing holds together");
    EXPECT_EQ(told, std::string(nodes) == "left") << printed.text();
  }
}

/* A body that was refused leaves nothing in the scene and is not described again when parameters change */
TEST(FullBody, ARefusedBodyIsForgotten)
{
  Beam8      beam;
  Scene      scene(PETSC_COMM_WORLD);
  FullFeBody fe;
  FullBody   b  = placed(FeLaw::Large);
  b.attachments = {{"left"}};
  beam.model.elements.clear();
  scene.parameter("p", 1);
  {
    ErrorTrap trap;
    EXPECT_NE(fe.add(scene, "beam", beam.model, b), 0);
    EXPECT_TRUE(trap.says("need elements")) << trap.message;
  }
  b.law = FeLaw::Small;
  must(fe.add(scene, "beam", beam.model, b));
  scene.marker(fe.attachment("left"));
  const std::size_t markers = DataOf(scene).markers.size();
  must(scene.set("p", 2));
  must(scene.setUp());
  EXPECT_EQ(DataOf(scene).extensions.size(), 1u);
  EXPECT_EQ(DataOf(scene).markers.size(), markers);
}

TEST(FullBody, RefusesByName)
{
  const auto refused = [](const std::function<void(FeModel &, FullBody &)> &spoil, const char *why) {
    Beam8      beam;
    Scene      scene(PETSC_COMM_WORLD);
    FullFeBody fe;
    FullBody   b = placed(FeLaw::Large);
    spoil(beam.model, b);
    ErrorTrap trap;
    EXPECT_NE(fe.add(scene, "beam", beam.model, b), 0);
    EXPECT_TRUE(trap.says(why)) << trap.message;
  };
  refused([](FeModel &m, FullBody &) { m.elements.clear(); }, "need elements");
  refused([](FeModel &, FullBody &b) { b.stiffness_damping = 1; }, "FeLaw::Small");
  refused([](FeModel &, FullBody &b) { b.attachments = {{"middle"}}; }, "no node set 'middle'");
  refused([](FeModel &m, FullBody &b) {
    m.sets["edge"] = {m.sets["left"][0], m.sets["left"][1]};
    b.attachments  = {{"edge"}};
  }, "on a line");
  refused([](FeModel &, FullBody &b) { b.rotation(0, 0) += 1; }, "orthonormal");
  refused([](FeModel &, FullBody &b) { b.mass_damping = INFINITY; }, "damping coefficients must be finite");
  refused([](FeModel &m, FullBody &) { m.coordinates.clear(); }, "has no coordinates of its nodes");
  refused([](FeModel &, FullBody &b) { b.attachments = {{"left"}, {"again", "left"}}; }, "Attachments left and again overlap");
  refused([](FeModel &, FullBody &b) { b.attachments = {{"left"}, {"left", "right"}}; }, "two attachments of the name left");
  refused([](FeModel &, FullBody &b) {
    b.attachments            = {{"left"}};
    b.attachments[0].weights = {1, 2, 3, 4};
  }, "weights are for averages");
  refused([](FeModel &, FullBody &b) {
    b.attachments            = {{"left", "", Tie::Average}};
    b.attachments[0].weights = {-1, 2, 2, 2};
  }, "weights have to be positive numbers or zero");
  refused([](FeModel &, FullBody &b) {
    b.attachments             = {{"left"}};
    b.attachments[0].at_given = true;
    b.attachments[0].position = {NAN, 0, 0};
  }, "its position is not finite");
  refused([](FeModel &m, FullBody &) { m.elements.pop_back(); }, "have more or less mass or stiffness than the elements");
  refused([](FeModel &m, FullBody &) { m.materials[0].young *= 2; }, "have more or less mass or stiffness than the elements");
}
