/* Parameters: other values without a new description */
#include "hhtdae/linearize.h"
#include "hhtdae/query.h"
#include "scene_output.h"
#include <cmath>
#include <stdexcept>

using namespace hhtest;

namespace
{

/* A block on a guide with a spring from the ground; the spring's free length is the initial distance */
struct Block {
  Scene     scene{PETSC_COMM_SELF};
  Parameter stiffness, mass, reach;
  Body      block;
  Marker    on, at;
  Element   spring;

  Block()
  {
    stiffness = scene.parameter("stiffness", 100);
    mass      = scene.parameter("mass", 1);
    reach     = scene.parameter("reach", 1);
    block     = scene.add("block", [p = mass] {
      PointMass b;
      b.mass     = p;
      b.velocity = {0, 0, 1};
      return b;
    });
    on     = scene.marker(block);
    at     = scene.marker(scene.ground(), [p = reach] { return Vector3(0, 0, -p); });
    spring = scene.add("spring", [i = on, j = at, k = stiffness] { return SpringDamper{i, j, k}; });
    scene.channel("z", Measure::displacement(on, 2), "m");
    scene.channel("force", Measure::force(spring, 0), "N");
  }

  double after(double t, double *force = nullptr)
  {
    SceneRun            run(scene, t, tolerance(1e-9));
    std::vector<double> x;
    must(run.solve());
    must(scene.sample(run.ts, t, x));
    if (force) *force = x[1];
    return x[0];
  }
};

double sine(double k, double m, double t)
{
  const double w = std::sqrt(k / m);
  return std::sin(w * t) / w;
}

} // namespace

TEST(Parameters, TheNextRunHasThem)
{
  Block b;
  EXPECT_NEAR(b.after(0.3), sine(100, 1, 0.3), 1e-5);
  must(b.scene.set("stiffness", 400));
  EXPECT_NEAR(b.after(0.3), sine(400, 1, 0.3), 1e-5);
  must(b.scene.set("mass", 4));
  EXPECT_NEAR(b.after(0.3), sine(400, 4, 0.3), 1e-5);
}

/* Values computed from the description follow the parameters: the free length of the spring is the new distance */
TEST(Parameters, WhatFollowsFromThemFollows)
{
  Block  b;
  double force;
  must(b.scene.set("reach", 0.25));
  const double z = b.after(0.3, &force);
  EXPECT_NEAR(z, sine(100, 1, 0.3), 1e-5);
  EXPECT_NEAR(std::abs(force), 100 * z, 1e-4);
}

/* A run after a change has the same digits as that of a scene described with the new value */
TEST(Parameters, TheSameDigitsAsDescribed)
{
  Block b;
  b.after(0.2);
  must(b.scene.set("stiffness", 321));
  const double again = b.after(0.4);
  Block        c;
  must(c.scene.set("stiffness", 321));
  EXPECT_EQ(again, c.after(0.4));
  must(b.scene.set("stiffness", 100));
  Block first;
  EXPECT_EQ(b.after(0.4), first.after(0.4));
}

/* Gravity given before the first parameter is kept when the parameter changes; everything else given before the first
   parameter is refused */
TEST(Parameters, WhatCameBeforeTheFirst)
{
  Scene scene(PETSC_COMM_SELF);
  scene.gravity({0, 0, -10});
  const Parameter mass = scene.parameter("mass", 1);
  const Body      stone = scene.add("stone", [p = mass] {
    PointMass b;
    b.mass = p;
    return b;
  });
  scene.channel("z", Measure::displacement(scene.marker(stone), 2), "m");
  must(scene.set("mass", 2));
  SceneRun            run(scene, 0.5, tolerance(1e-9));
  std::vector<double> x;
  must(run.solve());
  must(scene.sample(run.ts, 0.5, x));
  EXPECT_NEAR(x[0], -1.25, 1e-9);
  for (int what = 0; what < 2; what++) {
    Scene     late(PETSC_COMM_SELF);
    ErrorTrap trap;
    if (what) late.shape(late.ground(), Shape());
    else late.channel("one", Expression{{}, [](const Real *) -> Real { return 1; }});
    late.parameter("k", 1);
    late.add("stone", PointMass());
    EXPECT_NE(late.setUp(), 0);
    EXPECT_TRUE(trap.says("parameter k: it came too late")) << trap.message;
  }
}

/* Runs made earlier keep their values, side by side with later runs */
TEST(Parameters, ARunKeepsItsOwn)
{
  Block               b;
  SceneRun            soft(b.scene, 0.3, tolerance(1e-9));
  std::vector<double> x;
  must(b.scene.set("stiffness", 400));
  SceneRun hard(b.scene, 0.3, tolerance(1e-9));
  must(TSSetMaxTime(soft.ts, 0.1));
  must(soft.solve());
  must(hard.solve());
  must(TSSetMaxTime(soft.ts, 0.3));
  must(soft.solve());
  must(b.scene.sample(soft.ts, 0.3, x));
  EXPECT_NEAR(x[0], sine(100, 1, 0.3), 1e-5);
  must(b.scene.sample(hard.ts, 0.3, x));
  EXPECT_NEAR(x[0], sine(400, 1, 0.3), 1e-5);
}

/* An element that a parameter can remove: its loads are zero when it is absent, and other handles stay valid */
TEST(Parameters, AnElementThatMayBeMissing)
{
  Scene           scene(PETSC_COMM_SELF);
  const Parameter held = scene.parameter("held", 1);
  const Body      body = scene.add("block", PointMass());
  const Marker    on = scene.marker(body), at = scene.marker(scene.ground());
  const Element   pin = scene.add("pin", [=] { return held > 0 ? std::optional<Spherical>(Spherical{on, at}) : std::nullopt; });
  const Element   wind = scene.add("wind", UserForce{on, {}, {}, {Expression{{}, [](const Real *) -> Real { return 0.0; }}, Measure::time(), Measure::time()}, {}});
  scene.gravity({0, 0, -2});
  scene.channel("z", Measure::displacement(on, 2));
  scene.channel("reaction", Measure::jointForce(pin, 2));
  scene.channel("wind", Measure::force(wind, 2));
  for (double there : {1., 0., 1.}) {
    must(scene.set("held", there));
    SceneRun            run(scene, 1, tolerance(1e-8));
    std::vector<double> x;
    must(run.solve());
    must(scene.sample(run.ts, 1, x));
    EXPECT_NEAR(x[0], there > 0 ? 0 : -1 + 1. / 6, 1e-5);
    EXPECT_NEAR(x[1], there > 0 ? 1 : 0, 1e-5);
    EXPECT_NEAR(x[2], 1, 1e-9);
  }
}

/* A sweep is told once which constraints were dropped, and again where these are others */
TEST(Parameters, RedundantConstraintsAreToldOnce)
{
  Scene           s(PETSC_COMM_SELF);
  const Parameter mass = s.parameter("mass", 1), third = s.parameter("third", 0);
  const Body      door = s.add("door", [p = mass] {
    RigidBody b;
    b.mass = p;
    return b;
  });
  const auto hinge = [&](double height) { return Revolute{s.marker(door, {0, 0, height}), s.marker(s.ground(), {0, 0, height})}; };
  s.add("low", hinge(-1));
  s.add("high", hinge(1));
  s.add("middle", [third, between = hinge(0)] { return third > 0 ? std::optional<Revolute>(between) : std::nullopt; });
  const auto told = [&](double m, double there) {
    must(s.set("mass", m));
    must(s.set("third", there));
    Printed printed;
    must(s.setUp());
    return printed.text();
  };
  EXPECT_NE(told(1, 0).find("5 redundant of 10"), std::string::npos);
  EXPECT_EQ(told(2, 0), "");
  EXPECT_NE(told(2, 1).find("10 redundant of 15"), std::string::npos);
  EXPECT_EQ(told(1, 0), "");
}

/* Handles are numbers: if an absent element did not make its markers, the handles of later markers would refer to others */
TEST(Parameters, MarkersOfAnElementThatMayBeMissing)
{
  Scene           s(PETSC_COMM_SELF);
  const Parameter on = s.parameter("on", 1);
  const Body      b  = s.add("bar", RigidBody{});
  s.add("spring", [&s, on, b] { return on > 0 ? std::optional<SpringDamper>(SpringDamper{s.marker(b, {0.5, 0, 0}), s.marker(s.ground(), {0.5, 1, 0}), 100}) : std::nullopt; });
  const Marker tip = s.marker(b, {1, 0, 0});
  s.add("pull", SpringDamper{tip, s.marker(s.ground(), {1, 1, 0}), 1});
  TS ts;
  must(s.createTS(&ts));
  must(TSDestroy(&ts));
  must(s.set("on", 2)); /* present with another value: nothing changes */
  must(s.createTS(&ts));
  must(TSDestroy(&ts));
  must(s.set("on", 0));
  ErrorTrap trap;
  EXPECT_NE(s.createTS(&ts), 0);
  EXPECT_TRUE(trap.says("spring: its function makes other markers")) << trap.message;
}

/* A function of the state that contains a parameter reads its value at every evaluation, for example a controller that
   changes it between steps */
TEST(Parameters, AFunctionReadsThePresentValue)
{
  Scene           scene(PETSC_COMM_SELF);
  const Parameter push = scene.parameter("push", 0);
  const Body      body = scene.add("block", PointMass());
  const Marker    on   = scene.marker(body);
  const auto      none = Expression{{}, [](const Real *) -> Real { return 0.0; }};
  scene.add("push", UserForce{on, {}, {}, {none, none, Expression{{}, [=](const Real *) -> Real { return push.value(); }}}, {}});
  scene.channel("v", Measure::velocity(on, 2));
  SceneRun            run(scene, 1, tolerance(1e-8));
  std::vector<double> x;
  must(run.solve());
  must(scene.sample(run.ts, 1, x));
  EXPECT_NEAR(x[0], 0, 1e-12);
  must(scene.set("push", 3));
  must(TSSetMaxTime(run.ts, 1.5));
  must(run.solve());
  must(scene.sample(run.ts, 1.5, x));
  EXPECT_NEAR(x[0], 1.5, 1e-9);
}

/* A motion that jumps between two parts of a run, whose steps it has met until then: solve() begins anew, and names it before a step is made */
TEST(Parameters, AMotionThatJumps)
{
  Scene           scene(PETSC_COMM_SELF, Space::Planar);
  const Parameter speed = scene.parameter("speed", 10);
  RigidBody       disc;
  disc.angular_velocity = {0, 0, 10};
  const Body   body     = scene.add("disc", disc);
  const Marker i = scene.marker(body), j = scene.marker(scene.ground());
  scene.add("pin", Revolute{i, j});
  scene.add("drive", RotationalMotion{i, j, TimeFunction::formula([=](const TimeFunction::Number &t) { return speed.value() * t; })});
  SceneRun run(scene, 10, tolerance(1e-6));
  PetscInt before, after;
  must(run.solve());
  must(TSGetStepNumber(run.ts, &before));
  must(scene.set("speed", 10.1));
  must(TSSetMaxTime(run.ts, 10.5));
  {
    ErrorTrap trap;
    EXPECT_NE(run.solve(), 0);
    EXPECT_TRUE(trap.says("At t = 10. the positions violate the constraints, which have been changed")) << trap.message;
    EXPECT_TRUE(trap.says("drive")) << trap.message;
  }
  must(TSGetStepNumber(run.ts, &after));
  EXPECT_EQ(after, before);
}

/* Forces, accelerations and reactions at the present time, after parameters or velocities have been changed since the
   last step, are those of a start from this state. A mass on a link of length 1 is pulled along it */
TEST(Parameters, TheStateAfterAChangeIsOne)
{
  const double g = 9.81;
  for (bool restart : {false, true})
    for (bool velocity : {false, true}) {
      Scene           scene(PETSC_COMM_SELF);
      const Parameter pull = scene.parameter("pull", 0);
      PointMass       m;
      m.position         = {0, -1, 0};
      const Marker  on   = scene.marker(scene.add("mass", m));
      const Element link = scene.add("link", PointDistance{on, scene.marker(scene.ground())});
      const auto    none = Expression{{}, [](const Real *) -> Real { return 0.0; }};
      scene.gravity({0, -g, 0});
      scene.add("plane", InPlane{on, scene.marker(scene.ground())});
      scene.add("pull", UserForce{on, {}, {}, {none, Expression{{}, [=](const Real *) -> Real { return -pull.value(); }}, none}, {}});
      scene.channel("tension", Measure::multiplier(link, 0));
      SceneRun            run(scene, 1, tolerance(1e-7));
      std::vector<double> x;
      std::vector<Mode>   modes;
      Snapshot            now;
      Linearization       small;
      double              fastest = 0;
      must(run.solve());
      must(scene.sample(run.ts, 1, x));
      const double before = std::abs(x[0]);
      EXPECT_NEAR(before, g, 1e-9);
      if (velocity) {
        Vec     U, V;
        double *v;
        must(TS2GetSolution(run.ts, &U, &V));
        must(VecGetArray(V, &v));
        v[0] = 3;
        must(VecRestoreArray(V, &v));
      } else must(scene.set("pull", 90));
      if (restart) must(TSRestartStep(run.ts));
      const double tension = velocity ? g + 9 : g + 90;
      must(scene.sample(run.ts, 1, x));
      EXPECT_NEAR(std::abs(x[0]), tension, 1e-6);
      must(now.take(run.ts));
      double y;
      must(now.value(Measure::multiplier(link, 0), &y));
      EXPECT_NEAR(std::abs(y), tension, 1e-6);
      Motion of;
      must(now.motion(on, &of));
      EXPECT_NEAR(of.velocity(0), velocity ? 3 : 0, 1e-12);
      EXPECT_NEAR(of.acceleration(1), velocity ? 9 : 0, 1e-6);
      if (velocity) continue;
      must(small.take(run.ts));
      must(small.modes(&modes));
      for (const Mode &each : modes) fastest = std::max(fastest, std::abs(each.value));
      EXPECT_NEAR(fastest, std::sqrt(tension), 1e-5);
      must(TSSetMaxTime(run.ts, 1.1)); /* the run continues */
      must(run.solve());
      must(scene.sample(run.ts, 1.1, x));
      EXPECT_NEAR(std::abs(x[0]), tension, 1e-6);
    }
}

TEST(Parameters, SayWhatIsWrong)
{
  Block     b;
  ErrorTrap trap;
  EXPECT_NE(b.scene.set("stifness", 1), 0);
  EXPECT_TRUE(trap.says("no parameter stifness, but mass, reach, stiffness")) << trap.message;
  EXPECT_NE(b.scene.set("mass", NAN), 0);
  EXPECT_TRUE(trap.says("mass cannot be nan")) << trap.message;
  must(b.scene.set("mass", -1));
  TS ts;
  EXPECT_NE(b.scene.createTS(&ts), 0);
  EXPECT_TRUE(trap.says("mass is -1, must be positive")) << trap.message;
  must(b.scene.set("mass", 2)); /* and is usable again */
  EXPECT_NEAR(b.after(0.3), sine(100, 2, 0.3), 1e-6);
  Scene late(PETSC_COMM_SELF);
  late.add("body", PointMass());
  late.parameter("k", 1);
  EXPECT_NE(late.setUp(), 0);
  EXPECT_TRUE(trap.says("parameter k: it came too late")) << trap.message;
}

/* A function that throws has added nothing, also when what came before and after it is described with other parameters; its exception comes as it is */
TEST(Parameters, AFunctionThatThrowsAddsNothing)
{
  const auto fails = [](const std::function<void()> &call) { EXPECT_THROW(call(), std::range_error); };
  const auto no    = [](auto what) { return [=]() -> decltype(what) { throw std::range_error("off the table"); }; };
  Block      b;
  Scene     &s = b.scene;
  fails([&] { s.add("rigid", no(RigidBody())); });
  fails([&] { s.add("point", no(PointMass())); });
  fails([&] { s.add("element", no(SpringDamper())); });
  fails([&] { s.add("maybe", no(std::optional<SpringDamper>())); });
  fails([&] { s.marker(b.block, no(Vector3())); });
  fails([&] { s.markerAt(b.block, no(Vector3())); });
  fails([&] { s.gravity(no(Vector3())); });
  fails([&] { s.add("law", NonlinearSpring{b.on, b.at, [](Real, Real) -> Real { throw std::range_error("no such law"); }}); });
  fails([&] {
    s.add("with markers", [&, i = b.block]() -> SpringDamper {
      s.add("half", SpringDamper{s.marker(i), s.marker(s.ground(), {0, 0, 3}), 1});
      throw std::range_error("half way");
    });
  });
  const Marker top = s.marker(s.ground(), {0, 0, 5});
  s.channel("top", Measure::distance(b.on, top), "m");
  for (double k : {100., 400.}) {
    must(s.set("stiffness", k));
    SceneRun            run(s, 0.3, tolerance(1e-9));
    std::vector<double> x;
    must(run.solve());
    must(s.sample(run.ts, 0.3, x));
    EXPECT_NEAR(x[0], sine(k, 1, 0.3), 1e-5);
    EXPECT_NEAR(x[2], 5 - x[0], 1e-9);
  }
}

/* What is described after a description that has failed has the places that it has without that */
TEST(Parameters, AFailedDescriptionLeavesTheLastOne)
{
  Block     b;
  ErrorTrap trap;
  Scene    &s = b.scene;
  s.add("late", [i = b.on, j = b.at, m = b.mass] {
    if (m > 5) throw std::range_error("too heavy");
    return SpringDamper{i, j, 0};
  });
  const Marker low = s.marker(s.ground(), {0, 0, -7});
  must(s.set("mass", 6));
  EXPECT_NE(s.setUp(), 0);
  EXPECT_TRUE(trap.says("too heavy")) << trap.message;
  s.channel("top", Measure::distance(b.on, s.marker(s.ground(), {0, 0, 5})), "m");
  s.channel("low", Measure::distance(b.on, low), "m");
  must(s.set("mass", 1));
  SceneRun            run(s, 0.3, tolerance(1e-9));
  std::vector<double> x;
  must(run.solve());
  must(s.sample(run.ts, 0.3, x));
  EXPECT_NEAR(x[2], 5 - x[0], 1e-9);
  EXPECT_NEAR(x[3], 7 + x[0], 1e-9);
}

/* A checkpoint can be resumed only with the parameter values with which it was written, both of elements and of
   functions; otherwise the error names the parameter. The stop is open when the checkpoint is written, so that the
   residual does not show its stiffness */
TEST(Parameters, OfCheckpoints)
{
  const TemporaryFile file("parameters.checkpoint");
  const auto          swing = [&](double stiffness, double load, const auto &use) {
    Scene           s(PETSC_COMM_SELF);
    const Parameter k = s.parameter("stiffness", 100), f = s.parameter("load", 1);
    const Body      mass = s.add("mass", PointMass());
    const Marker    i = s.marker(mass), j = s.marker(s.ground());
    s.add("stop", [=] { return TranslationalStop{i, j, -INFINITY, 0.5, ContactLaw{k, 1}, 0}; });
    s.add("load", UserScalarForce{i, s.marker(s.ground(), {-1, 0, 0}), Expression{{Measure::time()}, [f](const Real *t) { return f.value() * step(t[0], 0.3, 0, 0.4, 1); }}});
    must(s.set("stiffness", stiffness));
    must(s.set("load", load));
    SceneRun run(s, 0.2, tolerance(1e-6));
    use(s, run.ts);
  };
  swing(200, 3, [&](Scene &s, TS ts) {
    must(s.solve(ts));
    must(TSHHT3CheckpointSave(ts, file.name.c_str()));
  });
  for (const auto &[stiffness, load, word] : {std::tuple<double, double, const char *>{200, 3, ""}, {100, 3, "stiffness = 200"}, {200, 1, "load = 3"}, {200, 3, "load was 3"}})
    swing(stiffness, load, [&, word = word](Scene &s, TS ts) {
      ErrorTrap trap;
      must(TSSetUp(ts));
      if (std::string(word) == "load was 3") must(s.set("load", 1));
      const PetscErrorCode failed = TSHHT3CheckpointLoad(ts, file.name.c_str());
      EXPECT_EQ(failed != 0, word[0] != 0);
      EXPECT_TRUE(trap.says(word)) << trap.message;
    });
}

/* Different masses distinguish the scenes of checkpoints; if the mass is a parameter, the error names it */
TEST(Parameters, OfCheckpointsInMasses)
{
  const TemporaryFile file("masses.checkpoint");
  Scene               s(PETSC_COMM_SELF);
  const Parameter     m = s.parameter("mass", 1);
  s.add("ball", [=] {
    PointMass b;
    b.mass = m;
    return b;
  });
  {
    SceneRun run(s, 0.2, tolerance(1e-6));
    must(s.solve(run.ts));
    must(TSHHT3CheckpointSave(run.ts, file.name.c_str()));
  }
  must(s.set("mass", 2));
  SceneRun  run(s, 0.2, tolerance(1e-6));
  ErrorTrap trap;
  must(TSSetUp(run.ts));
  EXPECT_NE(TSHHT3CheckpointLoad(run.ts, file.name.c_str()), 0);
  EXPECT_TRUE(trap.says("is of a run with parameter mass = 1, this one was made with 2")) << trap.message;
}
