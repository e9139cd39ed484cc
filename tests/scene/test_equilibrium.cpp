/* Static equilibrium where forces set in during the search: contacts and stops */
#include "hhtdae/analyses.h"
#include "hhtdae/helpers.h"
#include "hhtdae/query.h"
#include "scene/kernels/contact_law.h"
#include "own_ts.h"
#include "scene_output.h"
#include "scene_start.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

constexpr double g = 10;

/* A ball of 1 kg and radius 1 that a guide lets move along z only, with its centre at z initially */
struct Guided {
  Scene  scene{PETSC_COMM_SELF};
  Body   ball;
  Marker i, j;

  explicit Guided(double z)
  {
    RigidBody b;
    b.inertia  = 0.4 * Matrix3::Identity();
    b.position = {0, 0, z};
    ball       = scene.add("ball", b);
    i          = scene.marker(ball);
    j          = scene.marker(scene.ground());
    scene.gravity({0, 0, -g});
    scene.add("guide", Translational{i, j});
    scene.start().equilibrium = true;
  }
  double depth()
  {
    must(scene.setUp());
    return 1 - DataOf(scene).bodies[ball.id].r(2);
  }
};

ContactLaw Law(double stiffness, double exponent)
{
  ContactLaw law;
  law.stiffness = stiffness;
  law.exponent  = exponent;
  return law;
}

} // namespace

/* From positions before contact, at its beginning and within it: in equilibrium the contact law carries the weight */
TEST(SceneEquilibrium, ABallOnAPlane)
{
  for (double exponent : {1., 1.5, 2.})
    for (double stiffness : {1e4, 1e5, 1e6, 1e8})
      for (double z : {0.9999, 1., 1.001, 1.1}) {
        Guided      s(z);
        SpherePlane contact{s.i, s.j, 1};
        contact.law.stiffness = stiffness;
        contact.law.exponent  = exponent;
        s.scene.add("contact", contact);
        const double d = s.depth();
        EXPECT_NEAR(ElasticForce<double>(Law(stiffness, exponent), d), g, 1e-6 * g) << exponent << " " << stiffness << " " << z << ": " << d;
      }
}

/* A wheel whose centre of mass is 0.3 m off its centre rolls down an incline until the centre of mass is above the
   contact point; rolling couples displacement and rotation */
TEST(SceneEquilibrium, AnEccentricWheelRolls)
{
  const double slope = 0.3, R = 0.5, e = 0.3, spin = 1, weight = 4 * g;
  for (double stiffness : {0., 5., 50.}) {
    Scene     s(PETSC_COMM_SELF, Space::Planar);
    RigidBody b;
    b.mass     = 4;
    b.inertia  = inertia::disc(4, R);
    b.position = {0, R, 0};
    b.center   = {e * std::cos(spin), e * std::sin(spin), 0};
    s.gravity({g * std::sin(slope), -g * std::cos(slope), 0});
    const Body   wheel = s.add("wheel", b);
    const Marker i = s.marker(wheel), j = s.marker(s.ground()), hook = s.marker(s.ground(), {-2, R, 0});
    s.add("roll", hhtdae::RollingDisc{i, j, R});
    if (stiffness > 0) s.add("spring", SpringDamper{i, hook, stiffness, 0, 0.5});
    SceneRun run(s, 1, "");
    must(StaticEquilibrium(run.ts, 0));
    Snapshot now;
    double   x, turn;
    must(now.take(run.ts));
    must(now.value(Measure::displacement(i, 0), &x));
    must(now.value(Measure::angle(i, j), &turn));
    EXPECT_NEAR(x, -R * turn, 1e-9) << stiffness;
    const double angle  = spin + turn; /* moments about the contact */
    const double moment = weight * (e * std::cos(angle) * -std::cos(slope) - (R + e * std::sin(angle)) * std::sin(slope)) + stiffness * (x + 2 - 0.5) * R;
    EXPECT_NEAR(moment, 0, 1e-6 * weight) << stiffness;
    EXPECT_GT(std::abs(x), 0.1) << stiffness;
  }
}

/* The same with a stop: from the stop itself, and from a distance */
/* Friction is zero at rest and holds nothing on an incline; the message says so */
TEST(SceneEquilibrium, FrictionHoldsNothing)
{
  Scene         s(PETSC_COMM_SELF);
  const Matrix3 slope = Eigen::AngleAxisd(.2, Vector3::UnitY()).toRotationMatrix();
  RigidBody     b;
  b.position        = slope * Vector3(0, 0, .1);
  const Body   ball = s.add("ball", b);
  ContactLaw   law;
  law.friction = .5;
  s.add("", SpherePlane{s.marker(ball), s.marker(s.ground(), Vector3::Zero(), slope), .1, law});
  s.gravity({0, 0, -9.81});
  OwnTS     run(s);
  ErrorTrap trap;
  EXPECT_NE(StaticEquilibrium(run.ts, 0), 0);
  EXPECT_TRUE(trap.says("friction holds nothing")) << trap.message;
}

TEST(SceneEquilibrium, ABallOnAStop)
{
  for (double stiffness : {1e4, 1e6, 1e8})
    for (double z : {1., 1.1}) {
      Guided            s(z);
      TranslationalStop stop{s.i, s.j, 1};
      stop.law.stiffness = stiffness;
      stop.law.exponent  = 1;
      s.scene.add("stop", stop);
      const double d = s.depth();
      EXPECT_NEAR(ElasticForce<double>(Law(stiffness, 1), d), g, 1e-6 * g) << stiffness << " " << z << ": " << d;
    }
}

/* A rod whose end falls on rough ground and slides before it comes to rest: the equilibrium is that without friction,
   and the small slip velocity of the friction law does not limit the steps of the search */
TEST(SceneEquilibrium, ALeverOnRoughGround)
{
  double height[2];
  for (int rough = 0; rough < 2; rough++) {
    Scene     scene(PETSC_COMM_SELF);
    RigidBody b;
    b.mass            = 2;
    b.inertia         = 0.1 * Matrix3::Identity();
    b.position        = {0.5, 0, 0.6};
    const Body    rod = scene.add("rod", b);
    const Matrix3 y   = hhtdae::axesAlong(Vector3::UnitY());
    scene.gravity({0, 0, -g});
    scene.add("pin", Revolute{scene.markerAt(rod, {0, 0, 0.6}, y), scene.markerAt(scene.ground(), {0, 0, 0.6}, y)});
    SpherePlane ground{scene.marker(rod, {0.5, 0, 0}), scene.marker(scene.ground()), 0.1};
    ground.law.friction = 0.3 * rough;
    scene.add("ground", ground);
    scene.start().equilibrium = true;
    must(scene.setUp());
    height[rough] = DataOf(scene).bodies[rod.id].r(2);
  }
  EXPECT_NEAR(height[1], height[0], 1e-9);
}

/* A strong damper lets the body only creep towards equilibrium, and forces decrease slowly: the steps of the search
   must grow nevertheless */
TEST(SceneEquilibrium, StrongDamping)
{
  Guided       s(1);
  SpringDamper spring{s.i, s.scene.marker(s.scene.ground(), {0, 0, 3})};
  spring.stiffness = 100;
  spring.damping   = 1e7;
  spring.length    = 1;
  s.scene.add("spring", spring);
  EXPECT_NEAR(s.depth(), 0.1 - 1, 1e-7);
}

/* A controller whose output is a variable: it has no force where the search begins, and none in equilibrium, x = 1 */
TEST(SceneEquilibrium, ALoopThroughAVariable)
{
  for (double from : {0., 0.3}) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody b;
    b.mass          = 2;
    b.position      = {from, 0, 0};
    const Body   m  = s.add("mass", b);
    const Marker at = s.marker(m);
    const auto   x  = Measure::displacement(at, 0);
    s.add("rail", Translational{s.marker(m, {0, 0, 0}, hhtdae::axesAlong(Vector3::UnitX())), s.marker(s.ground(), {0, 0, 0}, hhtdae::axesAlong(Vector3::UnitX()))});
    const State      sum = s.state("sum", Expression{{x}, [](const Real *k) -> Real { return 1 - k[0]; }}, 0);
    const Variable   u   = s.variable("u", Expression{{x, Measure::value(sum), Measure::velocity(at, 0)}, [](const Real *k) -> Real { return 20 * (1 - k[0]) + 8 * k[1] - 0.5 * k[2]; }});
    const Expression none{{}, [](const Real *) { return Real(0); }};
    UserForce        f;
    f.i     = at;
    f.force = {Expression(Measure::value(u)), none, none};
    s.add("actuator", f);
    s.start().equilibrium = true;
    must(s.setUp());
    EXPECT_NEAR(DataOf(s).bodies[m.id].r(0), 1, 1e-8) << from;
    EXPECT_NEAR(DataOf(s).states[0].initial, 0, 1e-8) << from;
  }
}

/* Bodies held by springs alone: the remaining forces are rounding errors, and there are no accelerations or reactions
   to compare them with */
TEST(SceneEquilibrium, OfBodiesOnSprings)
{
  for (int seed = 1; seed <= 200; seed++) {
    std::srand(seed);
    Scene     s(PETSC_COMM_SELF);
    RigidBody b;
    b.mass     = 1.7;
    b.inertia  = Vector3(.1, .2, .25).asDiagonal();
    b.position = 2 * Vector3::Random();
    b.rotation = Eigen::Quaterniond(Eigen::Vector4d::Random().normalized()).toRotationMatrix();
    const Body body = s.add("b", b);
    s.gravity(5 * Vector3::Random());
    for (int k = 0; k < 4; k++) {
      SpringDamper spring;
      spring.i         = s.marker(body, .5 * Vector3::Random());
      spring.j         = s.marker(s.ground(), 4 * Vector3::Random());
      spring.stiffness = 125 + 75 * Vector3::Random()(0);
      spring.damping   = 5;
      spring.length    = .5;
      s.add("spring " + std::to_string(k), spring);
    }
    s.start().equilibrium = true;
    TS ts;
    must(s.createTS(&ts));
    must(TSSetMaxTime(ts, .1));
    EXPECT_EQ(s.solve(ts), 0) << seed;
    must(TSDestroy(&ts));
  }
}

namespace
{

/* A body of 1 kg in a guide along z, and measures of its run after StaticEquilibrium() */
struct Levelled {
  Scene  scene{PETSC_COMM_SELF};
  Marker q, g;
  explicit Levelled(double z)
  {
    PointMass m;
    m.position = {0, 0, z};
    q          = scene.marker(scene.add("mass", m));
    g          = scene.marker(scene.ground());
    scene.gravity({0, 0, -10});
    scene.add("line", InLine{q, g});
  }
  std::vector<double> find(const std::vector<Measure> &what, bool at_the_start)
  {
    TS                  ts;
    Snapshot            now;
    std::vector<double> x(what.size());
    scene.start().equilibrium = at_the_start;
    must(scene.createTS(&ts));
    if (!at_the_start) must(StaticEquilibrium(ts, 0));
    must(now.take(ts));
    for (std::size_t k = 0; k < what.size(); k++) must(now.value(what[k], &x[k]));
    must(TSDestroy(&ts));
    return x;
  }
};

} // namespace

/* A self-levelling spring whose stiffness x is a state, x' = 200 (-0.05 - z): at z = 0 no force depends on x, in
   equilibrium x carries the weight */
TEST(SceneEquilibrium, AStateThatIsAFactor)
{
  for (bool at_the_start : {false, true})
    for (double z0 : {0., -0.01}) {
      Levelled      s(z0);
      const Measure z = Measure::displacement(s.q, 2);
      const State   x = s.scene.state("stiffness", Expression({z}, [](const Real *m) { return 200 * (-0.05 - m[0]); }), 100);
      UserForce     f;
      f.i     = s.q;
      f.force = {TimeFunction(0), TimeFunction(0), Expression({Measure::value(x), z}, [](const Real *m) { return -m[0] * m[1]; })};
      s.scene.add("spring", f);
      SpringDamper d;
      d.i         = s.q;
      d.j         = s.scene.marker(s.scene.ground(), {0, 0, -5});
      d.damping   = 5;
      d.stiffness = 0;
      s.scene.add("damper", d);
      const std::vector<double> found = s.find({z, Measure::value(x), Measure::acceleration(s.q, 2)}, at_the_start);
      EXPECT_NEAR(found[0], -0.05, 1e-9) << at_the_start << z0;
      EXPECT_NEAR(found[1], 200, 1e-5) << at_the_start << z0;
      EXPECT_NEAR(found[2], 0, 1e-6) << at_the_start << z0;
    }
}

/* A pendulum with a moment x about its axis of symmetry, x' = rate (1 - x): in equilibrium x = 1, for any rate, mass
   and unit, starting where the body is balanced or elsewhere */
TEST(SceneEquilibrium, SlowStates)
{
  for (double unit : {1., 1e-6})
    for (double rate : {1., 0.05, 1e-4})
      for (double mass : {1., 1500., 1e6})
        for (double tilt : {0., 0.3}) {
          Scene     s(PETSC_COMM_SELF);
          RigidBody b;
          b.mass         = mass;
          b.inertia      = mass * Matrix3::Identity();
          b.rotation     = Eigen::AngleAxisd(tilt, Vector3::UnitX()).toRotationMatrix();
          b.position     = b.rotation * Vector3(0, 0, -1);
          const Body   p = s.add("pendulum", b);
          const Marker i = s.marker(p, {0, 0, 1}), j = s.marker(s.ground());
          s.gravity({0, 0, -9.81});
          s.add("pin", Spherical{i, j});
          Bushing bush;
          bush.i                   = i;
          bush.j                   = j;
          bush.torsional_stiffness = {mass, mass, mass};
          s.add("bush", bush);
          const Measure x = Measure::value(State{0});
          s.state("x", Expression({x}, [=](const Real *m) -> Real { return rate * (unit - m[0]); }), 0);
          UserForce f;
          f.i      = s.marker(p);
          f.j      = j;
          f.moment = {TimeFunction(0), TimeFunction(0), Expression({x}, [=](const Real *m) -> Real { return m[0] / unit; })};
          s.add("load", f);
          TS       ts;
          Snapshot now;
          double   found;
          must(s.createTS(&ts));
          must(StaticEquilibrium(ts, 0));
          must(now.take(ts));
          must(now.value(x, &found));
          EXPECT_NEAR(found, unit, 1e-6 * unit) << rate << " " << mass << " " << tilt;
          must(TSDestroy(&ts));
        }
}

/* With a motion of nonzero velocity there is no equilibrium, however small its effect is compared with the weight */
TEST(SceneEquilibrium, AMotionOfASmallVelocity)
{
  for (double mass : {1., 1e6, 1e8}) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody b;
    b.mass         = mass;
    b.velocity     = {0, 0, 0.01};
    const Body   p = s.add("lift", b);
    const Marker i = s.marker(p), j = s.marker(s.ground());
    TS           ts;
    s.gravity({0, 0, -9.81});
    s.add("guide", Translational{i, j});
    s.add("drive", TranslationalMotion{i, j, TimeFunction(0.01), MotionOf::Velocity});
    must(s.createTS(&ts));
    ErrorTrap trap;
    EXPECT_NE(StaticEquilibrium(ts, 0), 0) << mass;
    must(TSDestroy(&ts));
  }
}

/* On the way to its free angle a torsional spring turns the body by more than half a turn, and by a gear a second
   wheel by another angle; a run that begins in this equilibrium begins without a moment */
TEST(SceneEquilibrium, TurnsOnTheWay)
{
  for (Space space : {Space::Planar, Space::Spatial})
    for (bool gear : {false, true}) {
      Scene     s(PETSC_COMM_SELF, space);
      RigidBody b;
      const Body   wheel = s.add("wheel", b);
      const Marker i = s.marker(wheel), j = s.marker(s.ground());
      s.add("axle", Revolute{i, j});
      TorsionalSpringDamper spring{i, j, 1, .1};
      spring.angle         = 7;
      const Element torque = s.add("spring", spring);
      if (gear) {
        b.position         = {1, 0, 0};
        const Body   other = s.add("other", b);
        const Marker k = s.marker(other), l = s.marker(s.ground(), {1, 0, 0});
        s.add("other axle", Revolute{k, l});
        s.add("gear", Gear{i, j, k, l, .7});
      }
      s.channel("angle", Measure::angle(i, j));
      s.start().equilibrium = true;
      SceneRun            run(s, .5, "");
      std::vector<double> sampled;
      Snapshot            now;
      double              x;
      must(s.sample(run.ts, 0, sampled));
      EXPECT_NEAR(sampled[0], 7, 1e-6) << gear;
      must(run.solve());
      must(now.take(run.ts));
      must(now.value(Measure::force(torque, 0), &x));
      EXPECT_NEAR(x, 0, 1e-6) << gear;
      must(now.value(Measure::angle(i, j), &x));
      EXPECT_NEAR(x, 7, 1e-6) << gear;
    }
}
