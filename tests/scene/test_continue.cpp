/* Runs that continue from the state of another run: joints that are released or engaged, other parameters, or the same scene */
#include "hhtdae/query.h"
#include "own_ts.h"
#include "scene_output.h"
#include <cmath>

using namespace hhtest;

namespace
{

/* A bar that swings on a pin, which may be released, and whose centre may be held on a vertical line */
struct Swing {
  Scene     scene{PETSC_COMM_SELF};
  Parameter held, caught, line;
  Body      bar;
  Marker    end, centre, at, wall;

  Swing()
  {
    held   = scene.parameter("held", 1);
    caught = scene.parameter("caught", 0);
    line   = scene.parameter("line", 0);
    RigidBody b;
    b.inertia  = Vector3(0.01, 1. / 12, 1. / 12).asDiagonal();
    b.position = {0.5, 0, 0};
    bar        = scene.add("bar", b);
    end        = scene.marker(bar, {-0.5, 0, 0});
    centre     = scene.marker(bar);
    at         = scene.marker(scene.ground());
    wall       = scene.marker(scene.ground(), [x = line] { return Place({x, 0, 0}, Eigen::AngleAxisd(M_PI / 2, Vector3::UnitX()).toRotationMatrix()); });
    scene.add("pin", [h = held, i = end, j = at] { return h > 0 ? std::optional<Revolute>(Revolute{i, j}) : std::nullopt; });
    scene.add("guide", [c = caught, i = centre, j = wall] { return c > 0 ? std::optional<InLine>(InLine{i, j}) : std::nullopt; });
    scene.gravity({0, -9.81, 0});
  }
};

Motion of(TS ts, Marker m)
{
  Snapshot now;
  Motion   x;
  must(now.take(ts));
  must(now.motion(m, &x));
  return x;
}

TS goOn(Scene &scene, TS from, double end)
{
  TS      ts;
  Options in(tolerance(1e-8));
  must(scene.createTS(&ts, from));
  must(TSSetMaxTime(ts, end));
  must(TSSetFromOptions(ts));
  must(scene.solve(ts));
  return ts;
}

} // namespace

/* A pendulum in 25 runs, each continued from the one before, with and without a parameter in the scene; the pin's
   reactions at their ends against the closed form. The state at the end of a step satisfies the constraints only to
   the tolerance: it must not be refused, but its velocities must be projected */
TEST(Continue, ChainOfRuns)
{
  for (const double eps : {1e-3, 1e-4, 1e-5})
    for (const bool parameter : {false, true}) {
      Scene     scene(PETSC_COMM_SELF);
      RigidBody b;
      Options   in(tolerance(eps));
      TS        ts = nullptr, next;
      double    worst = 0;
      if (parameter) scene.parameter("unused", 0);
      b.inertia         = Vector3(0.01, 1. / 12, 1. / 12).asDiagonal();
      b.position        = {0.5, 0, 0};
      const Body    bar = scene.add("bar", b);
      const Marker  at = scene.marker(bar), on = scene.marker(scene.ground());
      const Element pin = scene.add("pin", Revolute{scene.marker(bar, {-0.5, 0, 0}), on});
      scene.gravity({0, -9.81, 0});
      for (int k = 1; k <= 25; k++) {
        if (ts) must(scene.createTS(&next, ts));
        else must(scene.createTS(&next));
        must(TSDestroy(&ts));
        ts = next;
        must(TSSetMaxTime(ts, 0.08 * k));
        must(TSSetFromOptions(ts));
        must(scene.solve(ts));
        Snapshot now;
        Load     load;
        must(now.take(ts));
        must(now.load(pin, on, &load));
        const Motion x     = of(ts, at);
        const double angle = std::atan2(x.position.y(), x.position.x()), square = -3 * 9.81 * std::sin(angle), turning = -1.5 * 9.81 * std::cos(angle);
        const double force = 9.81 + 0.5 * (turning * std::cos(angle) - square * std::sin(angle));
        worst              = std::max(worst, std::abs(std::abs(load.force.y()) - std::abs(force)));
      }
      must(TSDestroy(&ts));
      EXPECT_LT(worst, eps > 5e-4 ? 3. : eps > 5e-5 ? 0.4 : 0.06) << eps << (parameter ? " with" : " without") << " a parameter";
    }
}

/* The pin is released at the bottom: the centre moves along a parabola, and the bar keeps its angular velocity */
TEST(Continue, AJointLetsGo)
{
  Swing    s;
  SceneRun run(s.scene, 0.5, tolerance(1e-8));
  must(run.solve());
  const Motion before = of(run.ts, s.centre);
  must(s.scene.set("held", 0));
  TS           ts    = goOn(s.scene, run.ts, 1.2);
  const Motion after = of(ts, s.centre);
  const double t     = 0.7;
  EXPECT_LT((after.position - before.position - t * before.velocity - 0.5 * t * t * Vector3(0, -9.81, 0)).norm(), 1e-6);
  EXPECT_LT((after.angular_velocity - before.angular_velocity).norm(), 1e-7);
  EXPECT_GT(before.velocity.norm(), 1);
  PetscReal now;
  must(TSGetTime(ts, &now));
  EXPECT_DOUBLE_EQ(now, 1.2);
  must(TSDestroy(&ts));
}

/* The bar is caught by a guide: a plastic impact, in which only the velocity across the guide is lost */
TEST(Continue, AJointTakesHold)
{
  Swing    s;
  SceneRun run(s.scene, 0.3, tolerance(1e-8));
  must(run.solve());
  const Motion x = of(run.ts, s.centre);
  must(s.scene.set("held", 0));
  must(s.scene.set("caught", 1));
  ErrorTrap trap;
  TS        ts;
  must(s.scene.set("line", x.position(0) + 0.01)); /* the line is not where the bar is */
  EXPECT_NE(s.scene.createTS(&ts, run.ts), 0);
  EXPECT_TRUE(trap.says("in-line guide: not met by 0.01")) << trap.message;
  must(s.scene.set("line", x.position(0)));
  must(s.scene.createTS(&ts, run.ts));
  const Motion y = of(ts, s.centre);
  EXPECT_NEAR(y.velocity(0), 0, 1e-9); /* the velocity across the line */
  EXPECT_NEAR(y.velocity(1), x.velocity(1), 1e-9);
  EXPECT_LT((y.angular_velocity - x.angular_velocity).norm(), 1e-9);
  must(TSDestroy(&ts));
}

/* Two free bodies dock by a massless link, in an impact that conserves their momenta */
TEST(Continue, ImpactOfALinkWithoutMass)
{
  Scene           s(PETSC_COMM_SELF);
  const Parameter docked = s.parameter("docked", 0);
  const double    mass[3] = {5, 3, 0};
  const Matrix3   inertia[3] = {Vector3(0.3, 0.4, 0.5).asDiagonal(), Vector3(0.1, 0.12, 0.14).asDiagonal(), Matrix3::Zero()};
  const Vector3   place[3] = {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}}, spin[3] = {{0, 0, 0.2}, {0, 0.1, -0.05}, {0, 0, 0.2}}, velocity[3] = {{0.1, 0, 0}, {0, 0, 0}, {0.1, 0.1, 0}};
  Body            body[3];
  for (int k = 0; k < 3; k++) {
    RigidBody b;
    b.mass             = mass[k];
    b.inertia          = inertia[k];
    b.position         = place[k];
    b.velocity         = velocity[k];
    b.angular_velocity = spin[k];
    body[k]            = s.add(std::string(1, "abl"[k]), b);
  }
  s.add("link", Fixed{s.marker(body[2]), s.marker(body[0], {0.5, 0, 0})});
  s.add("dock", [docked, i = s.marker(body[2]), j = s.marker(body[1], {-0.5, 0, 0})] { return docked > 0 ? std::optional<Spherical>(Spherical{i, j}) : std::nullopt; });
  const auto momenta = [&](TS ts, Vector3 *P, Vector3 *L) {
    P->setZero();
    L->setZero();
    for (int k = 0; k < 2; k++) {
      const Motion x = of(ts, s.marker(body[k]));
      *P += mass[k] * x.velocity;
      *L += mass[k] * x.position.cross(x.velocity) + x.axes * inertia[k] * x.axes.transpose() * x.angular_velocity;
    }
  };
  SceneRun run(s, 1e-8, tolerance(1e-8));
  Vector3  P[2], L[2];
  TS       ts;
  must(run.solve());
  momenta(run.ts, &P[0], &L[0]);
  must(s.set("docked", 1));
  must(s.createTS(&ts, run.ts));
  momenta(ts, &P[1], &L[1]);
  EXPECT_LT((P[1] - P[0]).norm(), 1e-10);
  EXPECT_LT((L[1] - L[0]).norm(), 1e-9);
  EXPECT_GT((of(ts, s.marker(body[1])).velocity).norm(), 0.01);
  must(TSDestroy(&ts));
}

/* A user constraint that counts no angles may be added or removed, too: a guide by expressions, on position level and
   on velocity level */
TEST(Continue, AUserConstraintTakesHold)
{
  for (bool velocities : {false, true}) {
    Swing      s;
    const auto guide = [c = s.caught, x = s.line, i = s.centre, velocities] {
      const double   at = x;
      UserConstraint rows;
      if (velocities) rows.rows = {Expression{{Measure::velocity(i, 0)}, [](const Real *m) { return m[0]; }}};
      else rows.rows = {Expression{{Measure::displacement(i, 0)}, [at](const Real *m) { return m[0] - at; }}};
      return c < 0 ? std::optional<UserConstraint>(rows) : std::nullopt;
    };
    s.scene.add("rows", guide);
    SceneRun run(s.scene, 0.3, tolerance(1e-8));
    must(run.solve());
    const Motion x = of(run.ts, s.centre);
    must(s.scene.set("held", 0));
    must(s.scene.set("caught", -1));
    must(s.scene.set("line", x.position(0)));
    TS ts = goOn(s.scene, run.ts, 0.5);
    const Motion caught = of(ts, s.centre);
    EXPECT_NEAR(caught.position(0), x.position(0), 1e-7);
    EXPECT_NEAR(caught.velocity(0), 0, 1e-7);
    must(s.scene.set("caught", 0)); /* and is removed */
    TS next = goOn(s.scene, ts, 0.6);
    EXPECT_LT((of(next, s.centre).velocity - caught.velocity - Vector3(0, -0.981, 0)).norm(), 1e-6);
    must(TSDestroy(&next));
    must(TSDestroy(&ts));
  }
}

/* A run continued without changes has the same motion, including counted angles */
TEST(Continue, NothingChanged)
{
  for (bool with_parameters : {false, true}) {
    Scene s(PETSC_COMM_SELF);
    if (with_parameters) s.parameter("unused", 1);
    RigidBody b;
    b.angular_velocity = {0, 0, 9};
    const Body   wheel = s.add("wheel", b);
    const Marker on = s.marker(wheel), at = s.marker(s.ground());
    s.add("pin", Revolute{on, at});
    const Element       spring = s.add("spring", TorsionalSpringDamper{on, at, 0.05, 0, 0, 0});
    SceneRun            whole(s, 3, tolerance(1e-8)), half(s, 1.5, tolerance(1e-8));
    std::vector<double> x;
    Snapshot            now;
    double              moment[2];
    must(whole.solve());
    must(half.solve());
    TS ts = goOn(s, half.ts, 3);
    int k = 0;
    for (TS end : {whole.ts, ts}) {
      must(now.take(end));
      must(now.value(Measure::force(spring, 0), &moment[k++]));
    }
    EXPECT_GT(std::abs(moment[0]), 0.05 * 2 * M_PI); /* more than a turn */
    EXPECT_NEAR(moment[0], moment[1], 1e-6);
    must(TSDestroy(&ts));
  }
}

/* Joints have turned by more than half a turn before a scene with parameters is described again */
TEST(Continue, TurnsOfGearsAndScrewsGoOn)
{
  for (Assembly assembly : {Assembly::Report, Assembly::Project}) {
    Scene s(PETSC_COMM_SELF);
    s.parameter("unused", 1);
    s.start().assembly = assembly;
    RigidBody a, b, n;
    a.angular_velocity = {0, 0, 9};
    b.position         = {1, 0, 0};
    b.angular_velocity = {0, 0, -18};
    n.position         = {0, 3, 0};
    n.angular_velocity = {0, 0, 9};
    n.velocity         = {0, 0, 9 * 0.2 / (2 * M_PI)};
    const Body   first = s.add("first", a), second = s.add("second", b), nut = s.add("nut", n);
    const Marker i1 = s.marker(first), j1 = s.marker(s.ground()), i2 = s.marker(second), j2 = s.marker(s.ground(), {1, 0, 0});
    s.add("bearing", Revolute{i1, j1});
    s.add("other bearing", Revolute{i2, j2});
    s.add("gear", Gear{i1, j1, i2, j2, 0.5});
    s.add("screw", Screw{s.marker(nut), s.marker(s.ground(), {0, 3, 0}), 0.2});
    for (double until : {0.2, 0.63, 3.}) {
      SceneRun half(s, until, tolerance(1e-8));
      must(half.solve());
      TS ts = goOn(s, half.ts, until + 1);
      EXPECT_NEAR(of(ts, i1).angular_velocity(2), 9, 1e-6) << until;
      EXPECT_NEAR(of(ts, i2).angular_velocity(2), -18, 1e-6) << until;
      Snapshot now;
      Motion   x;
      must(now.take(ts));
      must(now.motion(nut, &x));
      EXPECT_NEAR(x.position(2), 9 * (until + 1) * 0.2 / (2 * M_PI), 1e-6) << until;
      must(TSDestroy(&ts));
    }
  }
}

/* Gears get another ratio, racks and screws another radius and pitch, and a cable is tied: no position jumps, and velocities are those of the new teeth. They go on in
   further runs, and what a run from the start takes from there stays as it was */
TEST(Continue, WhatIsTakenFromTheStart)
{
  for (Assembly assembly : {Assembly::Report, Assembly::Project}) {
    Scene           s(PETSC_COMM_SELF);
    const Parameter size = s.parameter("size", .1), tied = s.parameter("tied", 0);
    s.parameter("other", 1);
    s.start().assembly = assembly;
    const auto body    = [&](const char *name, double y, double spin, double speed) {
      RigidBody b;
      b.position         = {0, y, 0};
      b.angular_velocity = {0, 0, spin};
      b.velocity         = {0, 0, speed};
      return s.add(name, b);
    };
    const Body   pinion = body("pinion", 0, 1, 0), rack = body("rack", 1, 0, .1), wheel = body("wheel", 2, -10, 0), nut = body("nut", 3, 4, .2 / M_PI), big = body("big", 4, 4, 0),
                 small = body("small", 5, -12, 0), load = body("load", 6, 0, 1);
    const auto   fixed = [&](double y) { return s.marker(s.ground(), {0, y, 0}); };
    const Marker p = s.marker(pinion), P = fixed(0), r = s.marker(rack), R = fixed(1), w = s.marker(wheel), W = fixed(2), n = s.marker(nut), N = fixed(3), b = s.marker(big), B = fixed(4),
                 c = s.marker(small), C = fixed(5), l = s.marker(load), anchor = s.marker(s.ground(), {0, 6, -1});
    const Marker teeth = s.marker(s.ground(), [size] { return Place({0, 4 + 7.5 * size, 0}, Eigen::AngleAxisd(M_PI / 2, Vector3::UnitY()).toRotationMatrix()); });
    const std::pair<Marker, Marker> turns[] = {{p, P}, {w, W}, {b, B}, {c, C}};
    for (auto [i, j] : turns) s.add("", Revolute{i, j});
    s.add("way", Translational{r, R});
    s.add("rack", [=] { return RackAndPinion{p, P, r, R, size}; });
    s.add("gear", [=] { return Gear{p, P, w, W, size}; });
    s.add("screw", [=] { return Screw{n, N, size}; });
    s.add("mesh", GearMesh{b, B, c, C, teeth});
    s.add("cable", [=] { return tied > 0 ? std::optional<PointDistance>(PointDistance{l, anchor}) : std::nullopt; });
    SceneRun first(s, 1.3, tolerance(1e-8));
    must(first.solve());
    must(s.set("size", .11));
    must(s.set("tied", 1));
    OwnTS second;
    must(s.createTS(&second.ts, first.ts));
    const auto same = [&](TS x, TS y) {
      for (Marker k : {p, r, w, n, b, c, l}) {
        EXPECT_LT((of(x, k).position - of(y, k).position).norm(), 1e-7);
        EXPECT_LT((of(x, k).axes - of(y, k).axes).norm(), 1e-7);
      }
    };
    same(first.ts, second.ts);
    const auto rates = [&](TS ts, double error) {
      EXPECT_NEAR(of(ts, r).velocity(2), .11 * of(ts, p).angular_velocity(2), error);
      EXPECT_NEAR(of(ts, w).angular_velocity(2), -of(ts, p).angular_velocity(2) / .11, error);
      EXPECT_NEAR(of(ts, n).velocity(2), .11 / (2 * M_PI) * of(ts, n).angular_velocity(2), error);
      EXPECT_NEAR(of(ts, c).angular_velocity(2), -.825 / .175 * of(ts, b).angular_velocity(2), error);
      EXPECT_NEAR(of(ts, l).velocity(2), 0, error);
    };
    rates(second.ts, 1e-9);
    must(s.set("other", 2));
    OwnTS third;
    third.ts = goOn(s, second.ts, 2);
    rates(third.ts, 1e-6);
    OwnTS fourth;
    must(s.createTS(&fourth.ts, third.ts));
    same(third.ts, fourth.ts);
    must(s.set("size", .1));
    must(s.set("tied", 0));
    SceneRun again(s, 1.3, tolerance(1e-8));
    must(again.solve());
    same(first.ts, again.ts);
  }
}

/* The centre of mass of a body shifts: the body frame keeps its position and velocity, and the body then rotates about
   its new centre of mass */
TEST(Continue, AnotherCentreOfMass)
{
  Scene           s(PETSC_COMM_SELF);
  const Parameter shift = s.parameter("shift", 0);
  const Body      body  = s.add("body", [shift] {
    RigidBody b;
    b.position         = {1, 2, 3};
    b.velocity         = {0.5, 0, 0};
    b.angular_velocity = {0, 0, 2};
    b.center           = {shift, 0, 0};
    return b;
  });
  const Marker    at    = s.marker(body, {0.3, -0.2, 0});
  SceneRun        half(s, 0.7, tolerance(1e-8));
  must(half.solve());
  const Motion before = of(half.ts, at);
  must(s.set("shift", 0.4));
  TS ts;
  must(s.createTS(&ts, half.ts));
  Motion after = of(ts, at);
  EXPECT_LT((after.position - before.position).norm(), 1e-14);
  EXPECT_LT((after.velocity - before.velocity).norm(), 1e-14);
  must(TSDestroy(&ts));
  ts = goOn(s, half.ts, 1.7);
  /* about the centre of mass, which moves on with the velocity of its point of the body */
  const double  angle = 2 * 0.7;
  const Vector3 arm = 0.4 * Vector3(std::cos(angle), std::sin(angle), 0), centre = Vector3(1 + 0.5 * 0.7, 2, 3) + arm;
  const Vector3 speed = Vector3(0.5, 0, 0) + Vector3(0, 0, 2).cross(arm);
  const Vector3 from  = Eigen::AngleAxisd(2 * 1.7, Vector3::UnitZ()) * Vector3(0.3 - 0.4, -0.2, 0);
  EXPECT_LT((of(ts, at).position - (centre + speed + from)).norm(), 1e-6);
  must(TSDestroy(&ts));
}

/* Continuing a run does not change what a run from the start is, whether the continued run can be made or not */
TEST(Continue, TheStartStaysTheStart)
{
  Swing    s;
  SceneRun run(s.scene, 0.3, tolerance(1e-8));
  must(run.solve());
  const Motion first = of(run.ts, s.centre);
  must(TSSetMaxTime(run.ts, 0.5));
  must(run.solve());
  TS ts = goOn(s.scene, run.ts, 0.6);
  must(TSDestroy(&ts));
  for (int k = 0; k < 2; k++) {
    SceneRun  again(s.scene, 0.3, tolerance(1e-8));
    PetscReal begin;
    must(TSGetTime(again.ts, &begin));
    EXPECT_EQ(begin, 0);
    must(again.solve());
    EXPECT_EQ(of(again.ts, s.centre).position, first.position);
    must(s.scene.set("caught", 1)); /* refused, because the line is elsewhere */
    ErrorTrap trap;
    EXPECT_NE(s.scene.createTS(&ts, run.ts), 0);
    must(s.scene.set("caught", 0));
  }
}

TEST(Continue, SaysWhatCannotBe)
{
  Swing     s, other;
  SceneRun  run(other.scene, 0.1, "");
  ErrorTrap trap;
  TS        ts;
  EXPECT_NE(s.scene.createTS(&ts, run.ts), 0);
  EXPECT_TRUE(trap.says("the TS is not of this scene")) << trap.message;
}

/* A snapshot of a continued run before its first step equals that at the end of the previous run, although rotation
   vectors count from another reference attitude */
TEST(Continue, SnapshotsBeforeTheFirstStep)
{
  Scene     scene(PETSC_COMM_SELF);
  RigidBody b;
  b.mass             = 2;
  b.inertia          = Vector3(.3, .2, .1).asDiagonal();
  b.position         = {.5, 0, 0};
  b.velocity         = {0, 2.5, 0};
  b.angular_velocity = {0, 0, 5};
  const Body   body  = scene.add("body", b);
  const Marker tip   = scene.marker(body, {.5, 0, 0});
  scene.gravity({0, 0, -9.81});
  const Element joint = scene.add("joint", Spherical{scene.markerAt(body, {0, 0, 0}), scene.marker(scene.ground())});
  scene.channel("x", Measure::displacement(tip, 0));
  TS first, next;
  {
    Options in(tolerance(1e-6));
    must(scene.createTS(&first));
    must(TSSetMaxTime(first, 1));
    must(TSSetFromOptions(first));
    must(scene.solve(first));
    must(scene.createTS(&next, first));
  }
  const Motion old = of(first, tip), now = of(next, tip);
  EXPECT_LT((now.position - old.position).norm(), 1e-9);
  EXPECT_LT((now.axes - old.axes).norm(), 1e-9);
  EXPECT_LT((now.acceleration - old.acceleration).norm(), 1e-3 * old.acceleration.norm());
  Snapshot             s;
  Load                 before, load;
  std::vector<double>  sampled;
  must(s.take(first));
  must(s.load(joint, tip, &before));
  must(s.take(next));
  must(s.load(joint, tip, &load));
  EXPECT_LT((load.force - before.force).norm(), 1e-3 * before.force.norm());
  must(scene.sample(next, 1, sampled));
  EXPECT_NEAR(sampled[0], old.position[0], 1e-9);
  must(TSDestroy(&first));
  must(TSDestroy(&next));
}

/* One stop that counts full turns is removed and another one is added, with the same kernel and therefore the same
   number of stored values; it must not inherit the turns */
TEST(Continue, AStopDoesNotTakeTheTurnsOfAnother)
{
  Scene      s(PETSC_COMM_SELF);
  Parameter  which = s.parameter("which", 0);
  RigidBody  b;
  TS         next;
  ErrorTrap  trap;
  b.angular_velocity = {0, 0, 9};
  const Body   first = s.add("first", b), second = s.add("second", RigidBody());
  const Marker i = s.marker(first), j = s.marker(s.ground()), k = s.marker(second), l = s.marker(s.ground());
  s.add("first axle", Revolute{i, j});
  s.add("second axle", Revolute{k, l});
  s.add("first stop", [=] { return which < 1 ? std::optional<RotationalStop>(RotationalStop{i, j, -INFINITY, 100}) : std::nullopt; });
  s.add("second stop", [=] { return which > 0 ? std::optional<RotationalStop>(RotationalStop{k, l, -0.1, 0.1}) : std::nullopt; });
  SceneRun run(s, 1.5, tolerance(1e-6));
  must(run.solve());
  must(s.set("which", 1));
  EXPECT_NE(s.createTS(&next, run.ts), 0);
  EXPECT_TRUE(trap.says("have come or gone that count angles over full turns or follow a curve, as rotational stop first stop has")) << trap.message;
}

/* A spring that counts full turns gets a damper, which changes the kernel of its force; the turns are kept */
TEST(Continue, ASpringGetsADamper)
{
  Scene     s(PETSC_COMM_SELF);
  Parameter damping = s.parameter("damping", 0);
  RigidBody b;
  b.angular_velocity = {0, 0, 9};
  const Body   first = s.add("first", b), second = s.add("second", b);
  Element      spring[2];
  int          n = 0;
  for (Body at : {first, second}) {
    const Marker i = s.marker(at), j = s.marker(s.ground());
    s.add("", Revolute{i, j});
    spring[n] = s.add("spring " + std::to_string(n), [=] { return TorsionalSpringDamper{i, j, 0.05, n ? double(damping) : 0.1, 0, 0}; });
    n++;
  }
  SceneRun run(s, 1.5, tolerance(1e-6));
  Snapshot now;
  double   before[2], after[2];
  must(run.solve());
  must(now.take(run.ts));
  for (int k = 0; k < 2; k++) must(now.value(Measure::force(spring[k], 0), &before[k]));
  must(s.set("damping", 1e-9));
  TS ts;
  must(s.createTS(&ts, run.ts));
  must(now.take(ts));
  for (int k = 0; k < 2; k++) {
    must(now.value(Measure::force(spring[k], 0), &after[k]));
    EXPECT_GT(std::abs(before[k]), 0.05 * 2 * M_PI);
    EXPECT_NEAR(after[k], before[k], 1e-6) << k;
  }
  must(TSDestroy(&ts));
}

/* A description that cannot be built, or does not fit the state of the run, leaves the run intact */
TEST(Continue, ARunOutlivesAFailedDescription)
{
  Swing s;
  s.scene.channel("x", Measure::displacement(s.centre, 0));
  s.scene.start().assembly = Assembly::Project;
  SceneRun            run(s.scene, 0.2, tolerance(1e-6));
  std::vector<double> x;
  TS                  next;
  must(run.solve());
  {
    ErrorTrap trap;
    must(s.scene.set("caught", 1));
    must(s.scene.set("line", 50)); /* out of reach */
    EXPECT_NE(s.scene.createTS(&next, run.ts), 0);
  }
  must(TSSetMaxTime(run.ts, 0.4));
  must(run.solve());
  must(s.scene.sample(run.ts, 0.4, x));
}

/* An exception of the user's function becomes an error, and the run stays where it was */
TEST(Continue, ADescriptionThatThrows)
{
  Scene      s(PETSC_COMM_SELF);
  Parameter  bad = s.parameter("bad", 0);
  const Body b   = s.add("body", RigidBody());
  s.add("spring", [=, i = s.marker(b), j = s.marker(s.ground(), {1, 0, 0})] {
    if (bad > 0) throw std::runtime_error("no such spring");
    return SpringDamper{i, j, 1};
  });
  SceneRun run(s, 0.1, tolerance(1e-6));
  must(run.solve());
  must(s.set("bad", 1));
  TS next;
  {
    ErrorTrap trap;
    EXPECT_NE(s.createTS(&next, run.ts), 0);
    EXPECT_TRUE(trap.says("no such spring")) << trap.message;
  }
  must(TSSetMaxTime(run.ts, 0.2));
  must(run.solve());
}

/* Additions to the scene while it runs are refused and change nothing in the run */
TEST(Continue, GravityThatComesTooLate)
{
  Scene        s(PETSC_COMM_SELF);
  const Marker i = s.marker(s.add("ball", PointMass()));
  s.gravity({0, 0, -1});
  for (int k = 0; k < 3; k++) s.channel("", Measure::displacement(i, 2));
  SceneRun run(s, 1, tolerance(1e-6));
  must(TSMonitorSet(run.ts, [](TS, PetscInt step, PetscReal, Vec, void *scene) -> PetscErrorCode {
    if (step == 1) static_cast<Scene *>(scene)->gravity({0, 0, 5});
    for (int k = 0; k < 20; k++) static_cast<Scene *>(scene)->channel("", Measure::time());
    return 0;
  }, &s, nullptr));
  must(run.solve());
  EXPECT_NEAR(of(run.ts, i).position(2), -0.5, 1e-8);
}
