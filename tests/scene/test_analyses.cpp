/* Static equilibrium, assembly and kinematics called on a run, compared with closed forms and with runs in time */
#include "hhtdae/analyses.h"
#include "hhtdae/helpers.h"
#include "hhtdae/linearize.h"
#include "hhtdae/query.h"
#include "kernel_checks.h"
#include "own_ts.h"
#include "scene_start.h"
#include <cmath>

using namespace hhtest;
using namespace hhtdae;

namespace
{

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
