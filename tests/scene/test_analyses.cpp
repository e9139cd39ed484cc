/* Static equilibrium, assembly and kinematics called on a run, compared with closed forms and with runs in time */
#include "hhtdae/analyses.h"
#include "hhtdae/helpers.h"
#include "hhtdae/linearize.h"
#include "hhtdae/query.h"
#include "kernel_checks.h"
#include "scene_start.h"
#include <cmath>

using namespace hhtest;
using namespace hhtdae;

namespace
{

/* A TS that is destroyed at the end of the test */
struct OwnTS {
  TS ts = nullptr;
  OwnTS() = default;
  explicit OwnTS(Scene &s) { must(s.createTS(&ts)); }
  ~OwnTS() { TSDestroy(&ts); }
  OwnTS(const OwnTS &) = delete;
  double time() const
  {
    PetscReal t;
    must(TSGetTime(ts, &t));
    return t;
  }
};

/* A rod of 1 m with a pin at its end and a torsional spring, pulled to one side by a force that grows with time */
struct Lever {
  Scene   scene{PETSC_COMM_SELF};
  Body    arm;
  Marker  i, j, tip;
  Element axle, push;

  explicit Lever(double stiffness = 0)
  {
    arm  = scene.add("arm", rod({0, 0, 0}, {0, -1, 0}));
    i    = scene.markerAt(arm, Vector3::Zero());
    j    = scene.marker(scene.ground());
    tip  = scene.markerAt(arm, {0, -1, 0});
    axle = scene.add("axle", Revolute{i, j});
    UserForce f;
    f.i     = tip;
    f.force = {Expression(Measure::time()), Expression{{}, [](const Real *) { return Real(0); }}, Expression{{}, [](const Real *) { return Real(0); }}};
    push    = scene.add("push", f);
    if (stiffness > 0) scene.add("spring", TorsionalSpringDamper{i, j, stiffness});
    scene.gravity({0, -10, 0});
  }
};

} // namespace

/* In equilibrium tan(angle) is the force over half of the weight, and the reactions balance the loads; the analysis
   changes neither the scene nor other runs */
TEST(Analyses, QuasiStaticLever)
{
  Lever    l;
  OwnTS      run(l.scene), other(l.scene);
  Snapshot now;
  for (double t : {0., 1., 3., 40., -5., 0.}) {
    must(StaticEquilibrium(run.ts, t));
    Motion m;
    Load   pin;
    must(now.take(run.ts));
    EXPECT_EQ(now.time(), t);
    must(now.motion(l.tip, &m));
    EXPECT_NEAR(m.position(0), std::sin(std::atan(t / 5)), 1e-9) << t;
    must(now.load(l.axle, l.i, &pin));
    EXPECT_LT((pin.force - Vector3(-t, 10, 0)).norm(), 1e-6) << pin.force.transpose();
    EXPECT_LT(m.velocity.norm() + m.acceleration.norm(), 1e-6);
  }
  Motion m;
  must(now.take(other.ts));
  must(now.motion(l.tip, &m));
  EXPECT_NEAR(m.position(0), 0, 1e-12);
}

/* Equilibria over several turns count the angle of the spring on the way; the run continues from the last one at rest */
TEST(Analyses, TurnsAreCountedOnTheWay)
{
  Scene     s(PETSC_COMM_SELF);
  RigidBody b;
  const Body   wheel = s.add("wheel", b);
  const Marker i = s.marker(wheel), j = s.marker(s.ground());
  UserScalarForce torque{i, j, Expression(Measure::time())};
  torque.rotational = true;
  s.add("axle", Revolute{i, j});
  s.add("spring", TorsionalSpringDamper{i, j, 2, 0, 0, 0});
  s.add("torque", torque);
  s.channel("angle", Measure::angle(i, j));
  OwnTS run(s);
  for (int k = 1; k <= 10; k++) must(StaticEquilibrium(run.ts, 4. * k));
  must(TSSetMaxTime(run.ts, 40.01));
  must(s.solve(run.ts));
  std::vector<double> now;
  must(s.sample(run.ts, 40.01, now));
  EXPECT_NEAR(now[0], 20, 1e-4);
  EXPECT_NEAR(run.time(), 40.01, 1e-12);
}

/* A slow motion may turn the bodies that it drives through a thread, gears, a rack or a formula by many turns */
TEST(Analyses, KinematicsOfWhatIsGearedUp)
{
  const double ratio = .002;
  for (int how = 0; how < 4; how++) {
    Scene        s(PETSC_COMM_SELF);
    s.start().assembly = Assembly::Project;
    const Body   fast = s.add("fast", RigidBody{}), slow = s.add("slow", RigidBody{});
    const Marker i = s.marker(fast), j = s.marker(s.ground()), k = s.marker(slow), l = s.marker(s.ground());
    if (how == 0) { /* the nut itself moves */
      s.add("thread", Screw{i, j, 2 * M_PI * ratio});
      s.add("feed", TranslationalMotion{i, j, TimeFunction::polynomial({0, 1})});
      s.add("held", Fixed{k, l});
    } else if (how == 1) {
      s.add("axle", Revolute{i, j});
      s.add("other", Revolute{k, l});
      s.add("gears", Gear{k, l, i, j, -ratio});
      s.add("feed", RotationalMotion{k, l, TimeFunction::polynomial({0, 1})});
    } else {
      s.add("axle", Revolute{i, j});
      s.add("guide", Translational{k, l});
      if (how == 2)
        s.add("rack", RackAndPinion{i, j, k, l, ratio});
      else {
        UserConstraint tie;
        tie.rows = {Expression{{Measure::displacement(k, 2, l), Measure::angle(i, j)}, [=](const Real *m) { return m[0] - ratio * m[1]; }}};
        s.add("tie", tie);
      }
      s.add("feed", TranslationalMotion{k, l, TimeFunction::polynomial({0, 1})});
    }
    OwnTS run(s);
    for (double t : {.01, .5, 1., .2}) {
      Snapshot now;
      double   angle;
      must(Kinematics(run.ts, t));
      must(now.take(run.ts));
      must(now.value(Measure::angle(i, j), &angle));
      EXPECT_NEAR(std::abs(angle), t / ratio, 1e-6 * t / ratio) << how << " at " << t;
    }
  }
}

/* A free body has no equilibrium; a failed analysis leaves the run unchanged */
TEST(Analyses, WhatFailsLeavesTheRunWhereItWas)
{
  Scene     s(PETSC_COMM_SELF);
  PointMass p;
  p.position = {0.3, 0.2, 0.1};
  const Body b = s.add("stone", p);
  const Marker i = s.marker(b);
  s.gravity({0, 0, -10});
  OwnTS run(s);
  {
    ErrorTrap error;
    EXPECT_NE(StaticEquilibrium(run.ts, 2), 0);
    EXPECT_TRUE(error.says("no static equilibrium found")) << error.message;
  }
  EXPECT_EQ(run.time(), 0);
  Snapshot now;
  Motion   m;
  must(now.take(run.ts));
  must(now.motion(i, &m));
  EXPECT_EQ(m.position, Vector3(0.3, 0.2, 0.1));
  EXPECT_NEAR(m.acceleration(2), -10, 1e-12) << "accelerations of the start";
}

/* Static equilibrium at t > 0 takes the positions of motions at that time, but no velocities or accelerations: the
   pendulum on an accelerated wagon hangs straight down */
TEST(Analyses, MotionsAreHeldStill)
{
  Scene     s(PETSC_COMM_SELF);
  RigidBody b;
  const Body   wagon = s.add("wagon", b), arm = s.add("arm", rod({0, 0, 0}, {0.6, -0.8, 0}));
  const Marker i = s.marker(wagon), j = s.marker(s.ground()), tip = s.markerAt(arm, {0.6, -0.8, 0});
  const Marker pin = s.markerAt(arm, Vector3::Zero());
  s.add("rail", Translational{s.marker(wagon, Vector3::Zero(), hhtest::axesAlong(Vector3(1, 0, 0))), s.marker(s.ground(), Vector3::Zero(), hhtest::axesAlong(Vector3(1, 0, 0)))});
  const Element drive = s.add("drive", TranslationalMotion{i, j, TimeFunction::polynomial({0, 0, 2}), MotionOf::Displacement, 0});
  s.add("hinge", Revolute{pin, i});
  s.gravity({0, -10, 0});
  OwnTS    run(s);
  Snapshot now;
  Motion   m;
  Load     l;
  must(StaticEquilibrium(run.ts, 1.5));
  must(now.take(run.ts));
  must(now.motion(tip, &m));
  EXPECT_LT((m.position - Vector3(4.5, -1, 0)).norm(), 1e-9);
  EXPECT_EQ(m.acceleration.norm() + m.velocity.norm(), 0);
  must(now.load(drive, i, &l));
  EXPECT_NEAR(l.force(0), 0, 1e-9) << "no force makes anything faster";
}

/* A mass on a spring on a base that a motion shakes: a run that begins in equilibrium, by call or by the scene's
   start, begins with the velocity of the base */
TEST(Analyses, ARunFromEquilibriumGoesWithItsMotions)
{
  const double a = 1e-3, w = 7, mass = 2, k = 500, g = 10;
  for (bool by_scene : {false, true}) {
    Scene      scene(PETSC_COMM_SELF);
    RigidBody  one;
    const Body base        = scene.add("base", one);
    one.mass               = mass;
    one.position           = {0, 0, 0.5};
    const Body   top       = scene.add("top", one);
    const Marker on_ground = scene.marker(scene.ground()), on_base = scene.marker(base), on_top = scene.marker(top);
    scene.add("guide", Translational{on_base, on_ground});
    scene.add("drive", TranslationalMotion{on_base, on_ground, TimeFunction::harmonic(a, w)});
    scene.add("column", Translational{on_top, on_base});
    SpringDamper spring{on_top, on_base};
    spring.stiffness = k;
    spring.length    = 0.5;
    scene.add("spring", spring);
    scene.gravity({0, 0, -g});
    scene.start().equilibrium = by_scene;
    scene.start().assembly    = Assembly::Project;
    OwnTS    run(scene);
    Snapshot now;
    Motion   x;
    if (!by_scene) must(StaticEquilibrium(run.ts, 0));
    must(TSSetTolerances(run.ts, 1e-9, nullptr, 1e-9, nullptr));
    must(TSSetMaxTime(run.ts, 2));
    must(scene.solve(run.ts));
    must(now.take(run.ts));
    must(now.motion(on_top, &x));
    /* z'' = W^2 (a sin wt - z) about the equilibrium, from rest */
    const double W = std::sqrt(k / mass), t = 2, forced = a * W * W / (W * W - w * w);
    EXPECT_NEAR(x.position(2), 0.5 - mass * g / k + forced * (std::sin(w * t) - w / W * std::sin(W * t)), 2e-5);
  }
}

/* Snapshots show the present state of the TS, also after the user has changed time or state */
TEST(Analyses, AStateThatWasChangedByHand)
{
  Lever    l;
  OwnTS    run(l.scene);
  Snapshot now;
  Motion   m;
  Vec      U, V;
  must(StaticEquilibrium(run.ts, 5));
  must(TS2GetSolution(run.ts, &U, &V));
  must(now.take(run.ts));
  must(now.motion(l.tip, &m));
  EXPECT_LT(m.acceleration.norm(), 1e-8);
  must(TSSetTime(run.ts, 6)); /* the pulling force is larger at this time */
  must(now.take(run.ts));
  must(now.motion(l.tip, &m));
  const double larger = m.acceleration.norm();
  EXPECT_NEAR(larger, std::sqrt(0.5) / (1. / 3), 1e-6) << "its moment over the inertia";
  must(TSSetTime(run.ts, 5));
  must(VecShift(U, 0.1)); /* other angle and position, and arbitrary multipliers */
  must(now.take(run.ts));
  must(now.motion(l.tip, &m));
  EXPECT_GT(m.acceleration.norm(), 0.1);
}

/* Linearization about an equilibrium found by a call: a pendulum under gravity, pulled aside by the force at t = 5 */
TEST(Analyses, ModesAboutAnEquilibrium)
{
  Lever l;
  OwnTS   run(l.scene);
  must(StaticEquilibrium(run.ts, 5));
  Linearization     about;
  std::vector<Mode> modes;
  must(about.take(run.ts));
  must(about.modes(&modes));
  ASSERT_EQ(modes.size(), 1u);
  /* stiffness: weight/2 cos + force sin, with angle 45 degrees; inertia 1/3 */
  EXPECT_NEAR(std::abs(modes[0].value), std::sqrt(3 * (5 * std::sqrt(0.5) + 5 * std::sqrt(0.5))), 1e-6);
}

/* A mode can be used only with the linearization that made it */
TEST(Analyses, ModesOfAnotherLinearization)
{
  Lever l;
  OwnTS run(l.scene);
  must(StaticEquilibrium(run.ts, 5));
  Linearization     about;
  std::vector<Mode> modes;
  must(about.take(run.ts));
  must(about.modes(&modes));
  for (int more : {-1, 1, 100}) {
    Mode                 foreign = modes.at(0);
    std::complex<double> x;
    BodyPart             part;
    ErrorTrap            trap;
    foreign.shape.resize(foreign.shape.size() + more);
    EXPECT_EQ(about.value(foreign, Measure::displacement(l.tip, 0), &x), PETSC_ERR_ARG_WRONG);
    EXPECT_EQ(about.part(foreign, l.scene.ground(), &part), PETSC_ERR_ARG_WRONG);
    EXPECT_EQ(about.animate(foreign, "mode", 1), PETSC_ERR_ARG_WRONG);
    EXPECT_EQ(about.normalize(&foreign), PETSC_ERR_ARG_WRONG);
    EXPECT_NE(trap.message.find("mode"), std::string::npos);
  }
}

namespace
{

/* The linkage of scene_start.h with its crank driven */
struct Driven {
  Scene   scene{PETSC_COMM_SELF};
  Linkage linkage;
  Marker  crank_pin, ground_pin, at_rocker;
  Element drive;

  explicit Driven(const TimeFunction &f)
  {
    linkage.build(scene);
    const Matrix3 z = hhtest::axesAlong(Vector3(0, 0, 1));
    crank_pin       = scene.markerAt(linkage.crank, linkage.A, z);
    ground_pin      = scene.marker(scene.ground(), linkage.A, z);
    at_rocker       = scene.markerAt(linkage.rocker, linkage.C);
    drive           = scene.add("drive", RotationalMotion{crank_pin, ground_pin, f});
    scene.start().assembly = Assembly::Project; /* the scene describes bodies at rest */
    scene.gravity({0, -9.81, 0});
  }
};

} // namespace

/* A four-bar over full turns of its crank in few steps. Reference of positions: geometry; of velocities and
   accelerations: differences of positions; of the moment of the drive: a run in time */
TEST(Analyses, KinematicsOfAFourBar)
{
  Driven     d(TimeFunction::polynomial({0, 2, 0.3}));
  OwnTS        run(d.scene);
  Snapshot   now;
  const auto geometry = [&](double t, Vector3 *C) {
    const Linkage l(1 + 2 * t + 0.3 * t * t);
    *C = l.C;
  };
  for (double t : {0., 0.05, 0.4, 0.8, 1.3, 2.0, 3.1, 4.4}) {
    Motion  m;
    Vector3 C[5];
    must(Kinematics(run.ts, t));
    must(now.take(run.ts));
    must(now.motion(d.at_rocker, &m));
    const double h = 1e-3;
    for (int k = 0; k < 5; k++) geometry(t + (k - 2) * h, &C[k]);
    const Vector3 v = (C[0] - 8 * C[1] + 8 * C[3] - C[4]) / (12 * h), a = (-C[0] + 16 * C[1] - 30 * C[2] + 16 * C[3] - C[4]) / (12 * h * h);
    EXPECT_LT((m.position - C[2]).norm(), 1e-10) << t;
    EXPECT_LT((m.velocity - v).norm(), 1e-8 * (1 + v.norm())) << t;
    EXPECT_LT((m.acceleration - a).norm(), 1e-6 * (1 + a.norm())) << t;
  }
  double moment[2];
  must(now.value(Measure::jointMoment(d.drive, 2), &moment[0]));
  Options opt("-ts_hhtdae_alpha -0.05");
  OwnTS dynamic(d.scene);
  must(TSSetMaxTime(dynamic.ts, 4.4));
  must(TSSetTolerances(dynamic.ts, 1e-8, nullptr, 1e-8, nullptr));
  must(TSSetFromOptions(dynamic.ts));
  must(d.scene.solve(dynamic.ts));
  must(now.take(dynamic.ts));
  must(now.value(Measure::jointMoment(d.drive, 2), &moment[1]));
  MEASURED("moment of the drive %.12g, of a run in time %.12g", moment[0], moment[1]);
  EXPECT_NEAR(moment[0], moment[1], 1e-4 * std::abs(moment[0]));
}

namespace
{

/* A crank of radius 1 about the origin, driven at a rate of 1 from the angle `from` on; in the plane, since a linkage with all axes parallel has redundant rows in space */
struct CrankDriven {
  Scene   scene{PETSC_COMM_SELF, Space::Planar};
  Vector3 pin;
  Body    crank;
  Marker  out;

  explicit CrankDriven(double from) : pin(std::cos(from), std::sin(from), 0), crank(scene.add("crank", rod(Vector3::Zero(), pin)))
  {
    const Marker i = scene.markerAt(crank, Vector3::Zero()), j = scene.marker(scene.ground());
    scene.add("bearing", Revolute{i, j});
    scene.add("drive", RotationalMotion{i, j, TimeFunction::polynomial({0, 1})});
    scene.start().assembly = Assembly::Project; /* it is described at rest */
  }
  void join(Body i, Body j, const Vector3 &at) { scene.add("", Revolute{scene.markerAt(i, at), j.id < 0 ? scene.marker(j, at) : scene.markerAt(j, at)}); }
  /* The slider's motion is on x; side: of the crank's pin */
  void slider(double length, int side)
  {
    const Vector3 at(pin(0) + side * std::sqrt(length * length - pin(1) * pin(1)), 0, 0);
    const Body    link = scene.add("link", rod(pin, at));
    RigidBody     b;
    b.position         = at;
    const Body   block = scene.add("block", b);
    join(crank, link, pin);
    join(link, block, at);
    out = scene.markerAt(block, at);
    scene.add("rail", Translational{out, scene.marker(scene.ground())});
  }
  void fourBar(double ground, double coupler, double rocker, int side)
  {
    const Vector3 D(ground, 0, 0), e = (D - pin).normalized(), n(-e(1), e(0), 0);
    const double  d = (D - pin).norm(), x = (d * d + coupler * coupler - rocker * rocker) / (2 * d);
    const Vector3 C    = pin + x * e + side * std::sqrt(coupler * coupler - x * x) * n;
    const Body    link = scene.add("coupler", rod(pin, C)), last = scene.add("rocker", rod(C, D));
    join(crank, link, pin);
    join(link, last, C);
    join(last, scene.ground(), D);
    out = scene.markerAt(last, C);
  }
  Vector3 position(TS ts) const
  {
    Snapshot now;
    Motion   m;
    must(now.take(ts));
    must(now.motion(out, &m));
    return m.position;
  }
};

} // namespace

/* Linkages that can change to another assembly, or nearly so, go on as they do in small steps: sliders with a link as long as the crank, whose closed form is known, parallelograms and other
   four-bars with s + l = p + q, and such with a gap there. One to three turns in one call land where 60 calls do. */
TEST(Analyses, KinematicsThroughChangePoints)
{
  hhtdae::Random random(1);
  for (int sample = 0; sample < 30; sample++) {
    const double from = random(.2, 1.3) + M_PI / 2 * (sample % 4), gap = sample % 3 ? 0 : std::pow(10, random(-2.5, -.5)), end = 2 * M_PI * random(1, 3), a = random(1.2, 3), b = random(1.2, 3);
    const int    side = random(-1, 1) < 0 ? -1 : 1, kind = sample % 5;
    Vector3      at[2];
    for (int calls : {1, 60}) {
      CrankDriven d(from);
      if (kind < 2) d.slider(1 + gap, side);
      else if (kind == 2) d.fourBar(a, a, 1 + gap, side);
      else if (kind == 3) d.fourBar(a, b, a + b - 1 - gap, side);
      else d.fourBar(a, b, std::abs(a - b) + 1 + gap, side);
      OwnTS run(d.scene);
      for (int k = 1; k <= calls; k++) must(Kinematics(run.ts, k == calls ? end : end * k / calls));
      at[calls > 1] = d.position(run.ts);
      const double length = 1 + gap, y = std::sin(from + end), x = std::cos(from + end);
      if (kind < 2) { /* with a link of the same length the block goes on through the middle, or stays there */
        const double way = gap > 0 ? x + side * std::sqrt(length * length - y * y) : std::cos(from) * side > 0 ? 2 * x : 0;
        EXPECT_NEAR(at[calls > 1](0), way, 1e-7) << sample << ", " << calls;
      }
    }
    EXPECT_LT((at[1] - at[0]).norm(), 1e-7) << sample << ": gap " << gap << ", from " << from << " on " << end;
  }
}

/* What locks is not followed to positions beyond; the message says until when it can be */
TEST(Analyses, KinematicsOfWhatLocks)
{
  for (double end : {2., 6.}) { /* at 6 the crank is back where it may be */
    CrankDriven d(.5);
    d.fourBar(1.2, .8, .7, 1);
    OwnTS     run(d.scene);
    ErrorTrap error;
    EXPECT_NE(Kinematics(run.ts, end), 0);
    EXPECT_TRUE(error.says("no motion leads there beyond t = ")) << error.message;
  }
}

/* Results do not depend on the unit of length: a crank with its centre of mass off its pin, in steps of 0.9 rad.
   Newton's first correction is a straight one and takes the crank off its pin. In small units this constraint
   violation is a much larger number than the initial error of the sine of the angle, although the state is nearer to
   the solution */
TEST(Analyses, KinematicsInAnyUnitsOfLength)
{
  for (double R : {1e-6, 1e-3, 1., 1e3, 1e6, 1e12}) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody b;
    b.inertia          = R * R * 0.1 * Matrix3::Identity();
    b.position         = {R, 0, 0};
    b.velocity         = {0, R, 0};
    b.angular_velocity = {0, 0, 1};
    const Body   crank = s.add("crank", b);
    const Marker i = s.markerAt(crank, Vector3::Zero()), j = s.marker(s.ground());
    s.add("pin", Revolute{i, j});
    s.add("drive", RotationalMotion{i, j, TimeFunction::polynomial({0, 1})});
    OwnTS    run(s);
    Snapshot now;
    Motion   m;
    for (int k = 1; k <= 8; k++) {
      const double a = 0.9 * k;
      must(Kinematics(run.ts, a));
      must(now.take(run.ts));
      must(now.motion(crank, &m));
      EXPECT_LT((m.position - R * Vector3(std::cos(a), std::sin(a), 0)).norm(), 1e-10 * R) << R;
      EXPECT_LT((m.velocity - R * Vector3(-std::sin(a), std::cos(a), 0)).norm(), 1e-9 * R) << R;
    }
  }
}

/* Kinematics of a scene that contains a pure integrator: a state whose rate does not depend on the state */
TEST(Analyses, KinematicsBesideIntegrators)
{
  Scene         s(PETSC_COMM_SELF);
  const Matrix3 x = hhtest::axesAlong(Vector3(1, 0, 0));
  const Body    slider = s.add("slider", RigidBody());
  const Marker  i = s.marker(slider, Vector3::Zero(), x), j = s.marker(s.ground(), Vector3::Zero(), x);
  s.add("rail", Translational{i, j});
  s.add("drive", TranslationalMotion{i, j, TimeFunction::polynomial({0, 0.5, 1})});
  s.state("way", Expression{{Measure::displacement(i, 0)}, [](const Real *m) { return m[0]; }}, 0.25);
  s.start().assembly = Assembly::Project;
  OwnTS run(s);
  for (double t : {0.5, 1.}) {
    Snapshot now;
    Motion   m;
    must(Kinematics(run.ts, t));
    must(now.take(run.ts));
    must(now.motion(i, &m));
    EXPECT_NEAR(m.position(0), 0.5 * t + t * t, 1e-9) << t;
    EXPECT_NEAR(m.velocity(0), 0.5 + 2 * t, 1e-7) << t;
  }
}

/* Velocities that are zero except for rounding, or small, do not tell how fast a motion will become; nor do velocities
   of other bodies */
TEST(Analyses, KinematicsWhereAMotionHasStoodStill)
{
  for (double first : {0., 1e-4, 3e-4})
    for (bool cart : {false, true}) {
      Scene        s(PETSC_COMM_SELF);
      const Body   wheel = s.add("wheel", RigidBody());
      const Marker i = s.marker(wheel), j = s.marker(s.ground());
      s.add("axle", Revolute{i, j});
      const Element drive = s.add("drive", RotationalMotion{i, j, TimeFunction::step5(0, 0, 1, 1)});
      if (cart) {
        RigidBody other;
        other.velocity   = {0, 6e-17, 0};
        const Body     c = s.add("cart", other);
        const Marker   x = s.marker(c, Vector3::Zero(), hhtdae::axesAlong(Vector3::UnitX())), y = s.marker(s.ground(), Vector3::Zero(), hhtdae::axesAlong(Vector3::UnitX()));
        s.add("rail", Translational{x, y});
        s.add("hold", TranslationalMotion{x, y, TimeFunction::polynomial({0})});
      }
      OwnTS    run(s);
      Snapshot now;
      Motion   m;
      Load     load;
      must(Kinematics(run.ts, first));
      for (double t = .1; t < 1; t += .1) {
        must(Kinematics(run.ts, t));
        must(now.take(run.ts));
        must(now.motion(wheel, &m));
        must(now.load(drive, i, &load));
        EXPECT_NEAR(m.angular_velocity(2), 30 * t * t * (1 - t) * (1 - t), 1e-8) << first << " " << t;
        EXPECT_NEAR(load.moment(2), 60 * t * (1 - t) * (1 - 2 * t), 1e-5) << first << " " << t;
      }
    }
}

namespace
{

/* A body of mass and inertia 1 driven by a motion, on a pin or on a rail */
struct DrivenBody {
  Scene   scene{PETSC_COMM_SELF};
  Element drive;

  DrivenBody(bool turns, const TimeFunction &f)
  {
    const Body   body = scene.add("body", RigidBody());
    const Marker i = scene.marker(body), j = scene.marker(scene.ground());
    if (turns) scene.add("pin", Revolute{i, j});
    else scene.add("rail", Translational{i, j});
    drive = turns ? scene.add("drive", RotationalMotion{i, j, f}) : scene.add("drive", TranslationalMotion{i, j, f});
  }
};

/* The multiplier of the motion at t, which equals the acceleration */
double LoadAt(OwnTS &run, const DrivenBody &d, double t)
{
  Snapshot now;
  double   load;
  must(Kinematics(run.ts, t));
  must(now.take(run.ts));
  must(now.value(Measure::multiplier(d.drive, 0), &load));
  return load;
}

} // namespace

/* Motions a (1 - cos w t) and a w t - a sin w t at times where velocities vanish except for rounding: at the start,
   there again after other times, and at turning points. Differences over sufficiently long times vanish there and seem
   to agree, over times near a period even earlier */
TEST(Analyses, KinematicsAtTurningPoints)
{
  using std::sin;
  Random random(1);
  double worst = 0;
  for (int sample = 0; sample < 100; sample++) {
    const double a = random(.1, 1), w = random(.3, 3), pi = std::acos(-1.);
    const bool   turns = sample % 2, returns = sample / 2 % 2;
    DrivenBody   d(turns, returns ? TimeFunction::harmonic(-a, w, pi / 2, a) : TimeFunction::formula([=](const auto &t) { return a * w * t - a * sin(w * t); }));
    OwnTS        run(d.scene);
    for (double t : {0., 0., 1., 0., pi / w, 1e-9, 2 * pi / w, 1.7, 3 * pi / w, 20 * pi / w, 4 * pi / w}) {
      const double off = std::abs(LoadAt(run, d, t) / (a * w * w) - (returns ? std::cos(w * t) : std::sin(w * t)));
      EXPECT_LT(off, 1e-5) << (turns ? "turn " : "way ") << (returns ? "to and fro, " : "on, ") << a << ", " << w << " at " << t;
      worst = std::max(worst, off);
    }
  }
  MEASURED("largest error: %.1e", worst);
}

/* Time scales from 1e-6 to 1e5 of the unit of time, as for motions of seconds described in days or in microseconds */
TEST(Analyses, KinematicsInAnyUnitsOfTime)
{
  for (double w : {5e-6, 1e-3, 1., 1e3, 1e6})
    for (bool turns : {false, true}) {
      DrivenBody d(turns, TimeFunction::harmonic(.7, w));
      d.scene.start().assembly = Assembly::Project;
      OwnTS run(d.scene);
      for (double x : {1., 2., .5, 4.}) EXPECT_NEAR(LoadAt(run, d, x / w) / (.7 * w * w), -std::sin(x), 1e-4) << (turns ? "turn " : "way ") << w << " at " << x / w;
    }
}

/* A step of T seconds that has hardly begun or is almost over: the small velocity is not rounding and yet says nothing
   about T, also where it was left by an analysis at another time */
TEST(Analyses, KinematicsAfterVelocitiesNearZero)
{
  Random random(1);
  double worst = 0;
  for (int sample = 0; sample < 50; sample++) {
    const double T = std::pow(10, random(-1, 1)), a = random(.1, 2);
    for (bool turns : {false, true}) {
      DrivenBody d(turns, TimeFunction::step5(0, 0, T, a));
      OwnTS  run(d.scene);
      for (double x : {0., .3, 1., .6, 1.2, .9, 0., 1e-4, .5, .99, .1, 1e-3, .7}) {
        const double off = std::abs(LoadAt(run, d, x * T) * T * T / a - (x < 1 ? 60 * x * (1 - x) * (1 - 2 * x) : 0));
        EXPECT_LT(off, 3e-3) << (turns ? "turn" : "way") << " of " << a << " in " << T << " s, at " << x;
        worst = std::max(worst, off);
      }
    }
  }
  MEASURED("largest error: %.1e", worst);
}

/* Also in units in which the scene is large, an error of 1e-4 in an equation of order one means that the assembly has failed */
TEST(Analyses, AssemblyThatFallsShort)
{
  Scene     s(PETSC_COMM_SELF);
  const Body   wheel = s.add("wheel", RigidBody{});
  const Marker i = s.marker(wheel), j = s.marker(s.ground());
  s.marker(wheel, {1e3, 0, 0}); /* makes the scene large */
  s.add("pin", Revolute{i, j});
  s.add("sine", UserConstraint{{Expression{{Measure::angle(i, j), Measure::time()}, [](const Real *m) { return sin(m[0]) - 1.0001 * m[1]; }}}});
  s.start().assembly = Assembly::Project; /* the scene describes bodies at rest */
  OwnTS run(s);
  must(AssembleAt(run.ts, 0.9));
  ErrorTrap error;
  EXPECT_NE(AssembleAt(run.ts, 1), 0);
  EXPECT_TRUE(error.says("the scene cannot be assembled at t = 1")) << error.message;
}

/* Power of the drive = change of kinetic energy + work against gravity, computed from snapshots only */
TEST(Analyses, InverseDynamicsByThePower)
{
  Driven     d(TimeFunction::polynomial({0, 3}));
  OwnTS        run(d.scene);
  Snapshot   now;
  const auto energy = [&](double t) {
    double k, p;
    must(Kinematics(run.ts, t));
    must(now.take(run.ts));
    must(now.energy(&k, &p));
    return k + p;
  };
  const double h = 1e-3, t = 0.7;
  double       E[5], moment;
  for (int k = 0; k < 5; k++) E[k] = energy(t + (k - 2) * h);
  energy(t);
  must(now.value(Measure::jointMoment(d.drive, 2), &moment));
  const double power = (E[0] - 8 * E[1] + 8 * E[3] - E[4]) / (12 * h);
  EXPECT_NEAR(3 * moment, power, 1e-7 * std::abs(power));
}

TEST(Analyses, WhatIsNotKinematic)
{
  Lever l;
  OwnTS   run(l.scene);
  {
    ErrorTrap error;
    EXPECT_NE(Kinematics(run.ts, 1), 0);
    EXPECT_TRUE(error.says("leave 1 degrees of freedom")) << error.message;
  }
  must(TSSetMaxTime(run.ts, 0.1));
  must(l.scene.solve(run.ts));
  {
    ErrorTrap error;
    EXPECT_NE(StaticEquilibrium(run.ts, 1), 0);
    EXPECT_TRUE(error.says("StaticEquilibrium(): the run has begun")) << error.message;
  }
  OwnTS next;
  must(l.scene.createTS(&next.ts, run.ts));
  must(StaticEquilibrium(next.ts, 1)); /* a run that continues from it can be moved */
  Driven    d(TimeFunction::polynomial({0, 1}));
  Scene     skate(PETSC_COMM_SELF);
  RigidBody b;
  const Body   body = skate.add("body", b);
  const Marker i = skate.marker(body), j = skate.marker(skate.ground());
  skate.add("slide", Translational{i, j});
  skate.add("speed", TranslationalMotion{i, j, 1., MotionOf::Velocity});
  skate.start().assembly = Assembly::Project;
  OwnTS rate(skate);
  ErrorTrap error;
  EXPECT_NE(Kinematics(rate.ts, 1), 0);
  EXPECT_TRUE(error.says("of velocities do not say where bodies are")) << error.message;
}

/* Assembly at a later time: a constraint that depends on time has moved the loop away from its description; velocities
   satisfy the rate of the constraint */
TEST(Analyses, AssemblyAtATime)
{
  Scene   s(PETSC_COMM_SELF);
  Linkage l;
  l.build(s);
  const Marker B = s.markerAt(l.crank, l.B), C = s.markerAt(l.rocker, l.C);
  s.add("lift", UserConstraint{{Expression{{Measure::displacement(B, 1), Measure::time()}, [](const Real *m) { return m[0] - sin(1 + m[1]); }}}});
  s.start().assembly = Assembly::Project;
  OwnTS run(s);
  must(AssembleAt(run.ts, 0.3));
  Snapshot now;
  Motion   m;
  must(now.take(run.ts));
  must(now.motion(C, &m));
  const Vector3 before = Linkage(1.3 - 1e-4).C, after = Linkage(1.3 + 1e-4).C;
  EXPECT_LT((m.position - Linkage(1.3).C).norm(), 1e-10);
  EXPECT_LT((m.velocity - (after - before) / 2e-4).norm(), 1e-7);
}

/* A constraint whose residual is NaN is not satisfied */
TEST(Analyses, AssemblyOfWhatIsNoNumber)
{
  Scene        s(PETSC_COMM_SELF);
  const Body   ball = s.add("ball", PointMass());
  const Marker i    = s.marker(ball);
  s.add("circle", UserConstraint{{Expression{{Measure::displacement(i, 0), Measure::time()}, [](const Real *m) { return m[0] - sqrt(1 - m[1] * m[1]); }}}});
  s.start().assembly = Assembly::Project;
  OwnTS run(s);
  must(AssembleAt(run.ts, 0.6));
  ErrorTrap error;
  EXPECT_NE(AssembleAt(run.ts, 2), 0);
  EXPECT_TRUE(error.says("the scene cannot be assembled at t = 2")) << error.message;
}

/* An equilibrium belongs to the parameter values with which it was found; functions read the present values */
TEST(Analyses, AParameterChangesAfterEquilibrium)
{
  Scene           s(PETSC_COMM_SELF);
  const Parameter p = s.parameter("load", 0);
  s.gravity({0, 0, -10});
  PointMass    m;
  const Body   b = s.add("mass", m);
  const Marker q = s.marker(b), g = s.marker(s.ground());
  s.add("line", InLine{q, g});
  UserForce f;
  f.i                 = q;
  f.force             = {TimeFunction(0), TimeFunction(0), Expression({Measure::displacement(q, 2)}, [p](const Real *x) { return -100 * x[0] + p; })};
  const Element force = s.add("force", f);
  TS            ts;
  Snapshot      now;
  double        x;
  must(s.createTS(&ts));
  must(StaticEquilibrium(ts, 0));
  must(now.take(ts));
  must(now.value(Measure::force(force, 2), &x));
  EXPECT_NEAR(x, 10, 1e-8);
  must(s.set("load", 5));
  must(now.take(ts));
  must(now.value(Measure::force(force, 2), &x));
  EXPECT_NEAR(x, 15, 1e-8);
  must(now.value(Measure::acceleration(q, 2), &x));
  EXPECT_NEAR(x, 5, 1e-8);
  must(TSDestroy(&ts));
}
