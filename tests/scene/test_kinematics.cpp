/* Kinematics called on a run: which positions a motion leads to, from change point to change point and in any units */
#include "hhtdae/analyses.h"
#include "hhtdae/helpers.h"
#include "hhtdae/query.h"
#include "kernel_checks.h"
#include "own_ts.h"
#include "scene_start.h"
#include <cmath>

using namespace hhtest;
using namespace hhtdae;

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

/* At a dead centre of a parallelogram, and so near it that rounding is all of its loads, a notice or the error of a singular matrix names the time and the pins. A light body between heavy ones is no reason for it */
TEST(Analyses, KinematicsAtADeadCentre)
{
  for (double before : {0., 1e-8, 1e-6, 1e-2}) {
    CrankDriven d(.5);
    d.fourBar(2, 2, 1, 1);
    OwnTS     run(d.scene);
    Printed   out;
    ErrorTrap trap;
    const bool near = before < 1e-3, failed = Kinematics(run.ts, M_PI - .5 - before) != 0; /* the matrix may be singular to rounding */
    const std::string said = failed ? trap.message : out.text();
    EXPECT_EQ(said.find("depend on one another") != std::string::npos, near) << before << ": " << said;
    EXPECT_EQ(said.find("at t = 2.64159") != std::string::npos, near) << before << ": " << said;
    EXPECT_EQ(said.find("revolute") != std::string::npos, near) << before << ": " << said;
  }
  for (double mass : {1., 1e-18}) {
    CrankDriven d(.5);
    RigidBody   light = rod(d.pin, d.pin + Vector3(1, 0, 0)), heavy;
    light.mass *= mass;
    light.inertia *= mass;
    heavy.position     = d.pin + Vector3(1, 0, 0);
    const Body between = d.scene.add("light", light), block = d.scene.add("heavy", heavy);
    d.join(d.crank, between, d.pin);
    d.join(between, block, heavy.position);
    d.scene.add("rail", Translational{d.scene.marker(block), d.scene.marker(d.scene.ground(), heavy.position)});
    OwnTS   run(d.scene);
    Printed out;
    must(AssembleAt(run.ts, 0));
    EXPECT_EQ(out.text(), "") << mass;
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
