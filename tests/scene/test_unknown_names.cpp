/* The names of a scene's unknowns in messages of the integrator */
#include "scene/model.h"
#include "scene_start.h"
#include <set>

using namespace hhtdae;
using namespace hhtest;

namespace
{

/* Two rods on pins, with a variable, a state and a force state; redundant rows of the second pin are dropped */
struct NamedRods {
  Scene scene;
  Body  first, second;
  bool  torn = false;

  explicit NamedRods(Space space = Space::Spatial, bool force_states = true) : scene(PETSC_COMM_SELF, space)
  {
    RigidBody b;
    b.mass     = 2;
    b.inertia  = Vector3(.1, .1, .1).asDiagonal();
    b.position = {1, 0, 0};
    first      = scene.add("upper", b);
    b.position = {3, 0, 0};
    second     = scene.add("lower", b);
    scene.add("hinge", Revolute{scene.marker(first, {-1, 0, 0}), scene.marker(scene.ground())});
    scene.add("knee", Revolute{scene.marker(second, {-1, 0, 0}), scene.marker(first, {1, 0, 0})});
    const State s = scene.state("valve", Expression{{}, [](const Real *) -> Real { return 0; }}, 0);
    scene.variable("pressure", Expression{{Measure::value(s)}, [](const Real *k) -> Real { return k[0]; }});
    UserForce f;
    f.i     = scene.marker(second);
    f.force = {Expression{{Measure::time()}, [this](const Real *k) -> Real { return torn && k[0].value() > .05 ? Real(NAN) : Real(0); }}, Expression(Measure::value(s)), Expression(Measure::value(s))};
    f.state = force_states;
    scene.add("thrust", f);
    scene.gravity({0, -9.81, 0});
  }
};

std::vector<std::string> namesOf(Scene &scene)
{
  std::vector<std::string> all;
  must(scene.setUp());
  for (PetscInt i = 0; i < ModelOf(scene).number.first.back(); i++) all.push_back(UnknownName(ModelOf(scene), i));
  return all;
}

} // namespace

TEST(UnknownNames, InSpace)
{
  NamedRods                      r;
  const std::vector<std::string> n = namesOf(r.scene), expected = {"x of body upper", "y of body upper", "z of body upper", "rotation 1 of body upper", "rotation 2 of body upper", "rotation 3 of body upper"};
  ASSERT_EQ(n.size(), 12u + 10 + 3 + 2);
  EXPECT_EQ(std::vector<std::string>(n.begin(), n.begin() + 6), expected);
  EXPECT_EQ(n[11], "rotation 3 of body lower");
  EXPECT_EQ(n[12].rfind("revolute hinge: row 1 of 5 (", 0), 0u) << n[12];
  EXPECT_EQ(n[16].rfind("revolute knee: row 2 of 5 (", 0), 0u) << n[16];
  EXPECT_EQ(n[19].rfind("revolute hinge: row 5 of 5 (", 0), 0u) << n[19];
  EXPECT_EQ(n[21].rfind("revolute knee: row 5 of 5 (", 0), 0u) << n[21];
  EXPECT_NE(n[22].find("component 1 of "), std::string::npos) << n[22];
  EXPECT_NE(n[24].find(" thrust"), std::string::npos) << n[24];
  EXPECT_EQ(n[25], "variable pressure");
  EXPECT_EQ(n[26], "state valve");
}

TEST(UnknownNames, InThePlane)
{
  NamedRods                      r(Space::Planar);
  const std::vector<std::string> n = namesOf(r.scene);
  ASSERT_EQ(n.size(), 6u + 4 + 3 + 2);
  EXPECT_EQ(n[1], "y of body upper");
  EXPECT_EQ(n[5], "angle of body lower");
  EXPECT_EQ(n[9].rfind("revolute knee: row 2 of 2 (", 0), 0u) << n[9];
}

/* Dropped rows have no unknowns; the rows after them keep their own names */
TEST(UnknownNames, BesideDroppedRows)
{
  NamedRods r;
  r.scene.add("again", Revolute{r.scene.marker(r.first, {-1, 0, .5}), r.scene.marker(r.scene.ground(), {0, 0, .5})});
  r.scene.start().redundant        = Redundant::Drop;
  const std::vector<std::string> n = namesOf(r.scene);
  EXPECT_EQ(n.size(), 12u + 10 + 3 + 2);
  EXPECT_EQ(std::set<std::string>(n.begin(), n.end()).size(), n.size());
  for (const std::string &name : n) EXPECT_EQ(name.find("again"), std::string::npos);
}

/* The message of a run that ends with an error */
std::string MessageOf(Scene &scene)
{
  TS ts;
  must(scene.createTS(&ts));
  must(TSSetMaxTime(ts, 1));
  ErrorTrap trap;
  EXPECT_NE(scene.solve(ts), 0);
  TSDestroy(&ts);
  return trap.message;
}

/* Without force states the row is that of the body, and the force is named beside it */
TEST(UnknownNames, OfAForceThatIsNoNumber)
{
  for (bool states : {true, false}) {
    NamedRods r(Space::Spatial, states);
    r.torn                    = true;
    const std::string message = MessageOf(r.scene);
    EXPECT_EQ(message.find("component 1 of ") != std::string::npos, states) << message;
    EXPECT_NE(message.find(states ? " thrust" : " thrust is not a number)"), std::string::npos) << message;
    EXPECT_EQ(message.find("locks"), std::string::npos) << message;
  }
}

/* A driven crank that cannot turn on: the shortest link is the rocker. Joints of the four-bar alone do not lock; the motion is named that asks for it. */
TEST(UnknownNames, OfAMotionThatLocks)
{
  Scene         scene(PETSC_COMM_SELF, Space::Planar);
  const Vector3 A(0, 0, 0), B(0, 1, 0), C(1.5, 1.2, 0), D(2.6, 0, 0);
  const Body    crank = scene.add("crank", rod(A, B)), coupler = scene.add("coupler", rod(B, C)), rocker = scene.add("rocker", rod(C, D));
  const Marker  i = scene.markerAt(crank, A), j = scene.marker(scene.ground(), A);
  scene.add("bearing", Revolute{i, j});
  scene.add("pin B", Revolute{scene.markerAt(coupler, B), scene.markerAt(crank, B)});
  scene.add("pin C", Revolute{scene.markerAt(rocker, C), scene.markerAt(coupler, C)});
  scene.add("pin D", Revolute{scene.markerAt(rocker, D), scene.marker(scene.ground(), D)});
  scene.add("drive", RotationalMotion{i, j, TimeFunction::polynomial({0, 2})});
  scene.start().assembly    = Assembly::Project;
  const std::string message = MessageOf(scene);
  EXPECT_NE(message.find("locks"), std::string::npos) << message;
  EXPECT_NE(message.find("(rotational motion drive: row 1 of 1 (driven angle)) depends on time"), std::string::npos) << message;
}
