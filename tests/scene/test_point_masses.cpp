/* Elements that would apply a moment to a point mass, or rotate with it, are refused by name, since a point mass has
   no rotation */
#include "hhtdae/scene.h"
#include "support.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

/* A point mass, a block and the ground, each with a marker; tests choose the position */
struct Bead {
  Scene  scene;
  Marker bead, block, ground;

  explicit Bead(Space space = Space::Spatial) : scene(PETSC_COMM_SELF, space)
  {
    RigidBody b;
    b.position = {2, 0.3, 0};
    bead       = scene.marker(scene.add("bead", PointMass{1, {1, 0.2, 0}}));
    block      = scene.marker(scene.add("block", b));
    ground     = scene.marker(scene.ground());
  }
  std::string complaint()
  {
    ErrorTrap trap;
    scene.setUp();
    return trap.message;
  }
};

/* The error of a scene with this one element; empty if there is none */
template <class Spec> std::string with(const std::function<Spec(Bead &)> &spec, Space space = Space::Spatial)
{
  Bead b(space);
  b.scene.add("it", spec(b));
  return b.complaint();
}

const std::vector<Expression> three(3, Expression(Measure::time()));

ContactLaw rough()
{
  ContactLaw law;
  law.friction = 0.3;
  return law;
}

#define REFUSES(Spec, marker, ...) \
  do { \
    const std::string said = with<Spec>([&](Bead &f) { (void)f; return Spec __VA_ARGS__; }); \
    EXPECT_NE(said.find("marker " marker " is on the point mass bead, which takes no moment"), std::string::npos) << #Spec #__VA_ARGS__ << ": " << said; \
  } while (0)
#define TAKES(Spec, ...) EXPECT_EQ(with<Spec>([&](Bead &f) { return Spec __VA_ARGS__; }), "") << #Spec #__VA_ARGS__

} // namespace

TEST(PointMasses, MomentsAreRefused)
{
  REFUSES(UserForce, "i", {f.bead, {}, {}, {}, three});
  REFUSES(UserForce, "j", {f.block, f.bead, {}, {}, three});
  REFUSES(UserScalarForce, "i", {f.bead, f.ground, Expression(Measure::time()), true});
  REFUSES(UserScalarForce, "j", {f.block, f.bead, Expression(Measure::time()), true});
  REFUSES(TorsionalSpringDamper, "i", {f.bead, f.ground, 1});
  REFUSES(RotationalStop, "j", {f.block, f.bead, -1, 1});
  REFUSES(Beam, "i", {f.bead, f.ground, -1, 1, 1, 1, 1, 1, 1});
  TAKES(UserForce, {f.bead, {}, {}, three, {}});
  TAKES(UserForce, {f.bead, f.ground, {}, three, {}});
  TAKES(UserScalarForce, {f.bead, f.block, Expression(Measure::time())});
  TAKES(SpringDamper, {f.bead, f.block, 3, 1});
}

/* A force at i whose reaction acts at i's position, or along an axis of j, would apply a moment to j */
TEST(PointMasses, ReactionsOffTheirOriginAreRefused)
{
  REFUSES(UserForce, "j", {f.block, f.bead, {}, three, {}});
  REFUSES(Bushing, "j", {f.block, f.bead, {1, 1, 1}});
  REFUSES(TranslationalStop, "j", {f.block, f.bead, -9, 9});
  TAKES(TranslationalStop, {f.bead, f.block, -9, 9});
  TAKES(DistanceStop, {f.bead, f.block, 0, 9});
}

TEST(PointMasses, ContactsWithAMomentAreRefused)
{
  REFUSES(SpherePlane, "i", {f.bead, f.ground, 0.1, rough()});
  REFUSES(SpherePlane, "j", {f.block, f.bead, 0.1});
  REFUSES(SphereSphere, "j", {f.block, f.bead, 0.1, 0.1, rough()});
  REFUSES(SphereBox, "j", {f.block, f.bead, 0.1});
  REFUSES(EllipsoidPlane, "i", {f.bead, f.ground});
  REFUSES(TorusPlane, "i", {f.bead, f.ground});
  TAKES(SpherePlane, {f.bead, f.ground, 0.1});
  TAKES(SphereSphere, {f.bead, f.block, 0.1, 0.1});
  TAKES(SphereBox, {f.bead, f.block, 0.1, {0.1, 0.1, 0.1}});
}

/* The derivative of the constraint with respect to the rotation of the point mass would be a moment on it */
TEST(PointMasses, UserConstraintsThatTurnWithOneAreRefused)
{
  const auto row = [](const Measure &m) { return UserConstraint{{Expression{{m}, [](const Real *x) { return x[0] - x[0].value(); }}}}; };
  const auto says = [](const std::string &text) { return text.find("the point mass bead, which takes no moment") != std::string::npos; };
  EXPECT_TRUE(says(with<UserConstraint>([&](Bead &f) { return row(Measure::angle(f.block, f.bead)); })));
  EXPECT_TRUE(says(with<UserConstraint>([&](Bead &f) { return row(Measure::angularVelocity(f.block, 2, f.bead)); })));
  EXPECT_TRUE(says(with<UserConstraint>([&](Bead &f) { return row(Measure::displacement(f.block, 2, f.ground, f.bead)); })));
  EXPECT_FALSE(says(with<UserConstraint>([&](Bead &f) { return row(Measure::displacement(f.bead, 2, f.ground, f.block)); })));
}
