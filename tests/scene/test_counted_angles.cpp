/* Angles that count full turns: in snapshots, in PETSc's events, in kinematics and in continued runs */
#include "hhtdae/helpers.h"
#include "hhtdae/analyses.h"
#include "hhtdae/query.h"
#include "scene_output.h"
#include <cmath>

using namespace hhtest;

namespace
{

constexpr double turn = 2 * M_PI;

/* A wheel on an axle that is inclined in space */
struct Wheel {
  Scene   scene;
  Body    wheel;
  Marker  i, j;
  Element axle;

  explicit Wheel(double speed = 0, Space space = Space::Spatial, bool parameters = false) : scene(PETSC_COMM_SELF, space)
  {
    if (parameters) scene.parameter("unused", 0);
    const Vector3 z = space == Space::Planar ? Vector3(0, 0, 1) : Vector3(Vector3(1, 2, 2) / 3);
    const Matrix3 R = hhtdae::axesAlong(z);
    RigidBody     b;
    b.rotation         = R;
    b.angular_velocity = speed * z;
    wheel              = scene.add("wheel", b);
    i                  = scene.marker(wheel);
    j                  = scene.markerAt(scene.ground(), Vector3::Zero(), R);
    axle               = scene.add("axle", Revolute{i, j});
  }
};

double angleAt(TS ts, double t, Marker i, Marker j)
{
  Snapshot now;
  double   x;
  must(now.take(ts, t));
  must(now.value(Measure::angle(i, j), &x));
  return x;
}
double angleOf(TS ts, Marker i, Marker j)
{
  PetscReal t;
  must(TSGetTime(ts, &t));
  return angleAt(ts, t, i, j);
}

} // namespace

/* The angle is asked for after the run only. The turns are known from whatever counts them: the motion, the spring, a
   channel, a variable, or in a planar scene the body itself */
TEST(CountedAngles, AfterTheRunByWhatCounts)
{
  const double end = 5.3;
  for (int how = 0; how < 5; how++) {
    Wheel w(how == 0 ? 0 : turn, how == 4 ? Space::Planar : Space::Spatial);
    if (how == 0) w.scene.add("drive", RotationalMotion{w.i, w.j, TimeFunction::polynomial({0, 0, turn})});
    if (how == 1) w.scene.add("spring", TorsionalSpringDamper{w.i, w.j});
    if (how == 2) w.scene.channel("angle", Measure::angle(w.i, w.j));
    if (how == 3) w.scene.variable("angle", Measure::angle(w.i, w.j));
    SceneRun run(w.scene, end, "-ts_rtol 1e-6 -ts_atol 1e-6");
    must(run.solve());
    EXPECT_NEAR(angleOf(run.ts, w.i, w.j), how == 0 ? turn * end * end : turn * end, 1e-4) << how;
  }
}

/* Half a turn is +pi for any axes: a spring with this free angle has no moment, and a stop stays open */
TEST(CountedAngles, HalfATurnAtTheStart)
{
  for (Space space : {Space::Spatial, Space::Planar})
    for (int k = 0; k < 40; k++) {
      const double a = .157 * k;
      const auto   turned = [](double angle) { return Matrix3(Eigen::AngleAxisd(angle, Vector3::UnitZ())); };
      Scene        s(PETSC_COMM_SELF, space);
      RigidBody    b;
      b.rotation = turned(a + M_PI);
      const Body   wheel = s.add("wheel", b);
      const Marker i = s.marker(wheel), j = s.markerAt(s.ground(), Vector3::Zero(), turned(a));
      s.add("axle", Revolute{i, j});
      const Element spring = s.add("spring", TorsionalSpringDamper{i, j, 2, 0, M_PI, 0});
      SceneRun      run(s, 1, "-ts_rtol 1e-6 -ts_atol 1e-6");
      Snapshot      now;
      double        moment;
      must(now.take(run.ts));
      must(now.value(Measure::force(spring, 0), &moment));
      EXPECT_NEAR(moment, 0, 1e-9) << k;
      EXPECT_NEAR(angleOf(run.ts, i, j), M_PI, 1e-12) << k;
    }
}

/* If nothing else counts turns, they are counted from the first question on */
TEST(CountedAngles, FromTheFirstQuestion)
{
  Wheel    w(turn);
  SceneRun run(w.scene, 2.3, "");
  EXPECT_NEAR(angleOf(run.ts, w.i, w.j), 0, 1e-12);
  must(run.solve());
  Snapshot  old;
  PetscReal before;
  double    x;
  must(old.take(run.ts));
  must(TSGetPrevTime(run.ts, &before));
  EXPECT_NEAR(angleOf(run.ts, w.i, w.j), 2.3 * turn, 1e-6);
  EXPECT_NEAR(angleAt(run.ts, (before + 2.3) / 2, w.i, w.j), (before + 2.3) / 2 * turn, 1e-6);
  EXPECT_NEAR(angleOf(run.ts, w.j, w.i), -0.3 * turn, 1e-6); /* the angle of j relative to i is counted separately */
  must(TSSetMaxTime(run.ts, 7.2));
  must(run.solve());
  EXPECT_NEAR(angleOf(run.ts, w.i, w.j), 7.2 * turn, 1e-6);
  EXPECT_NEAR(angleOf(run.ts, w.j, w.i), -5.2 * turn, 1e-6); /* from -0.3 turns at 2.3 */
  must(old.value(Measure::angle(w.i, w.j), &x));
  EXPECT_NEAR(x, 2.3 * turn, 1e-6);
}

/* A snapshot keeps its values when the run continues, including the turns counted by elements at that time */
TEST(CountedAngles, OldSnapshots)
{
  Wheel         w(turn);
  const Marker  rim    = w.scene.marker(w.wheel, {1, 0, 0});
  const Element spring = w.scene.add("spring", TorsionalSpringDamper{w.i, w.j, 1e-3});
  SceneRun      run(w.scene, 0.4, "");
  Snapshot      old;
  Motion        before, after;
  Load          load, later;
  double        kinetic, potential[2], angle;
  must(run.solve());
  must(old.take(run.ts));
  must(old.motion(rim, &before));
  must(old.load(spring, w.i, &load));
  must(old.energy(&kinetic, &potential[0]));
  must(TSSetMaxTime(run.ts, 4.2));
  must(run.solve());
  Snapshot now;
  must(now.take(run.ts));
  must(now.motion(rim, &after));
  EXPECT_GT((after.position - before.position).norm(), 0.5);
  must(old.motion(rim, &after));
  EXPECT_EQ((after.position - before.position).norm(), 0);
  EXPECT_EQ((after.velocity - before.velocity).norm(), 0);
  must(old.load(spring, w.i, &later));
  EXPECT_EQ((later.moment - load.moment).norm(), 0);
  must(old.energy(&kinetic, &potential[1]));
  EXPECT_EQ(potential[1], potential[0]);
  must(old.value(Measure::angle(w.i, w.j), &angle));
  EXPECT_NEAR(angle, 0.4 * turn, 1e-2);
  must(now.load(spring, w.i, &later)); /* the run itself keeps its counts */
  must(now.value(Measure::angle(w.i, w.j), &angle));
  EXPECT_GT(angle, turn);
  EXPECT_NEAR(later.moment.norm(), 1e-3 * angle, 1e-12);
}

/* In planar scenes a step may turn bodies by more than half a turn */
TEST(CountedAngles, InThePlaneWhateverTheStep)
{
  Wheel    w(40 * turn, Space::Planar);
  SceneRun run(w.scene, 1.3, "-ts_adapt_type none -ts_dt 0.1");
  must(run.solve());
  EXPECT_NEAR(angleOf(run.ts, w.i, w.j), 52 * turn, 1e-6);
}

/* Fixed steps lose the turns that springs and channels count in space if a step turns them by more than half of one; steps of the integrator's choice never do */
TEST(CountedAngles, FixedStepsThatAreTooLong)
{
  struct Case {
    const char *options;
    double      speed;
    bool        told;
  };
  for (const auto &[options, speed, told] : {Case{"-ts_adapt_type none -ts_dt 0.1", 40, true}, Case{"-ts_adapt_type none -ts_dt 0.1", 30, false}, Case{"-ts_rtol 1e-3", 40, false}}) {
    Wheel   w(speed);
    Printed printed;
    w.scene.add("spring", TorsionalSpringDamper{w.i, w.j, 1e-6});
    SceneRun run(w.scene, 1, options);
    must(run.solve());
    const std::string text = "scene: fixed steps of 0.1 are too long to count full turns: one has turned body wheel by 4 rad.", all = printed.text();
    EXPECT_EQ(printed.says(text), told) << options << " " << speed << "\n" << all;
    EXPECT_EQ(all.find(text), all.rfind(text));
    EXPECT_EQ(std::abs(angleOf(run.ts, w.i, w.j) - speed) < 1e-3, !told) << speed;
  }
}

/* An event of TSSetEventHandler() ends the run after five turns, not where the angle is zero again for the first time */
TEST(CountedAngles, InEvents)
{
  Wheel    w(1);
  SceneRun run(w.scene, 100, "");
  struct Event {
    Marker    i, j;
    Snapshot  now;
    PetscReal at = -1;
  } event;
  event.i                   = w.i;
  event.j                   = w.j;
  PetscInt        direction = 0;
  PetscBool       terminate = PETSC_TRUE;
  const auto      value     = [](TS ts, PetscReal t, Vec, PetscScalar f[], void *ctx) {
    Event &e = *static_cast<Event *>(ctx);
    PetscCall(e.now.take(ts, t));
    PetscCall(e.now.value(Measure::angle(e.i, e.j), f));
    f[0] -= 5 * turn;
    return PetscErrorCode(0);
  };
  const auto done = [](TS, PetscInt, PetscInt[], PetscReal t, Vec, PetscBool, void *ctx) {
    static_cast<Event *>(ctx)->at = t;
    return PetscErrorCode(0);
  };
  must(TSSetEventHandler(run.ts, 1, &direction, &terminate, value, done, &event));
  must(run.solve());
  EXPECT_NEAR(event.at, 5 * turn, 1e-5);
}

/* One call of Kinematics() over many turns: the wheel driven by the gear is at the right angle */
TEST(CountedAngles, KinematicsOverManyTurns)
{
  for (Space space : {Space::Spatial, Space::Planar}) {
    Wheel        w(0, space);
    const Body   other = w.scene.add("other", RigidBody());
    const Marker k     = w.scene.marker(other), ground = w.scene.marker(w.scene.ground());
    w.scene.add("axle of other", Revolute{k, ground});
    w.scene.add("gear", Gear{w.i, w.j, k, ground, 3});
    w.scene.add("drive", RotationalMotion{w.i, w.j, TimeFunction::polynomial({0, turn})});
    w.scene.start().assembly = Assembly::Project;
    SceneRun run(w.scene, 1, "");
    for (double t : {5.2, -3.1, 0.4}) {
      must(Kinematics(run.ts, t));
      EXPECT_NEAR(angleOf(run.ts, w.i, w.j), t * turn, 1e-9) << t;
      EXPECT_NEAR(angleOf(run.ts, k, ground), -t * turn / 3, 1e-9) << t;
      Snapshot now;
      Motion   m;
      must(now.take(run.ts));
      must(now.motion(other, &m));
      EXPECT_NEAR(std::remainder(std::atan2(m.axes(1, 0), m.axes(0, 0)) + t * turn / 3, turn), 0, 1e-9) << t;
    }
  }
}

/* The count is taken over by a continued run, with the same model or with other parameters */
TEST(CountedAngles, GoOnWithTheRun)
{
  for (int how = 0; how < 3; how++)
    for (bool parameters : {false, true}) {
      const bool      planar = how > 0, asked = how < 2; /* in space nothing counts turns before the first question */
      Scene           scene(PETSC_COMM_SELF, planar ? Space::Planar : Space::Spatial);
      const Parameter mass = parameters ? scene.parameter("mass", 1) : Parameter();
      RigidBody       b;
      b.angular_velocity = {0, 0, turn};
      const Body   wheel = scene.add("wheel", b);
      const Marker i = scene.marker(wheel), j = scene.marker(scene.ground());
      scene.add("axle", Revolute{i, j});
      SceneRun run(scene, 2.3, "");
      if (asked) { EXPECT_NEAR(angleOf(run.ts, i, j), 0, 1e-12); }
      must(run.solve());
      if (parameters) must(scene.set("mass", 2));
      TS next;
      must(scene.createTS(&next, run.ts));
      must(TSSetMaxTime(next, 4.4));
      must(scene.solve(next));
      EXPECT_NEAR(angleOf(next, i, j), 4.4 * turn, 1e-6) << planar << asked << parameters;
      must(TSDestroy(&next));
    }
}

/* Channels and springs begin in (-pi, pi], as their headers say, and so does an angle that is asked for, even if the
   motion begins beyond half a turn */
TEST(CountedAngles, MotionsThatBeginBeyondHalfATurn)
{
  for (int how = 0; how < 3; how++)
    for (Space space : {Space::Planar, Space::Spatial}) {
      Scene     scene(PETSC_COMM_SELF, space);
      RigidBody b;
      b.rotation         = Eigen::AngleAxisd(4, Vector3::UnitZ()).toRotationMatrix();
      b.angular_velocity = {0, 0, turn};
      const Body   wheel = scene.add("wheel", b);
      const Marker i = scene.marker(wheel), j = scene.marker(scene.ground());
      scene.add("axle", Revolute{i, j});
      scene.add("drive", RotationalMotion{i, j, TimeFunction::polynomial({4, turn})});
      if (how == 1) scene.channel("angle", Measure::angle(i, j));
      if (how == 2) scene.add("spring", TorsionalSpringDamper{i, j});
      SceneRun run(scene, 2.3, "");
      must(run.solve());
      EXPECT_NEAR(angleOf(run.ts, i, j), 4 + 1.3 * turn, 1e-6) << how;
    }
}

/* Assembly and equilibrium may turn a body by more than half a turn before the run begins; all users of the angle
   count on from the described position */
TEST(CountedAngles, StartsThatPassHalfATurn)
{
  for (Space space : {Space::Planar, Space::Spatial})
    for (bool equilibrium : {false, true}) {
      Scene     scene(PETSC_COMM_SELF, space);
      RigidBody b;
      b.rotation         = Eigen::AngleAxisd(3, Vector3::UnitZ()).toRotationMatrix();
      const Body   wheel = scene.add("wheel", b);
      const Marker i = scene.marker(wheel), j = scene.marker(scene.ground());
      scene.add("axle", Revolute{i, j});
      if (equilibrium) {
        TorsionalSpringDamper spring{i, j, 1, .1};
        spring.angle = 3.9;
        UserScalarForce pull{i, j, Expression({Measure::angle(i, j)}, [](const Real *x) { return .2 - .1 * x[0]; }), true};
        scene.add("spring", spring);
        scene.add("pull", pull);
        scene.start().equilibrium = true;
      } else {
        scene.add("drive", RotationalMotion{i, j, TimeFunction(3.5)});
        scene.start().assembly = Assembly::Project;
      }
      const double expected = equilibrium ? 4.1 / 1.1 : 3.5;
      scene.variable("angle", Measure::angle(i, j));
      scene.channel("angle", Measure::angle(i, j));
      SceneRun run(scene, .3, "");
      must(run.solve());
      EXPECT_NEAR(angleOf(run.ts, i, j), expected, 1e-6) << equilibrium;
    }
}

/* A wheel that oscillates by ten radians on a spring, under a TS type of PETSc; the square of its angular velocity
   from Euler angles */
TEST(CountedAngles, UnderOtherTypes)
{
  for (const bool planar : {true, false}) {
    const double end = 2, swing = 10, rate = 0.5;
    Wheel        w(swing * rate, planar ? Space::Planar : Space::Spatial);
    w.scene.add("spring", TorsionalSpringDamper{w.i, w.j, rate * rate});
    SceneRun run(w.scene, end, "-ts_type alpha2 -ts_alpha_radius 1 -ts_adapt_type none -ts_dt 5e-3 -scene_rotations euler313 -pc_type lu -pc_factor_mat_solver_type klu");
    must(run.solve());
    Vec                U, V;
    const PetscScalar *u, *v;
    must(TS2GetSolution(run.ts, &U, &V));
    must(VecGetArrayRead(U, &u));
    must(VecGetArrayRead(V, &v));
    const double square = planar ? v[2] * v[2] : v[3] * v[3] + v[4] * v[4] + v[5] * v[5] + 2 * v[3] * v[5] * std::cos(u[4]);
    must(VecRestoreArrayRead(U, &u));
    must(VecRestoreArrayRead(V, &v));
    EXPECT_NEAR(std::sqrt(square), swing * rate * std::cos(rate * end), 1e-3) << (planar ? "planar" : "spatial");
  }
}

/* In a user constraint: the displacement of a cam follower shows how far the wheel has turned */
TEST(CountedAngles, InUserConstraints)
{
  Wheel        w(9);
  const Body   follower = w.scene.add("follower", RigidBody());
  const Marker at       = w.scene.marker(follower);
  w.scene.add("slide", Translational{at, w.scene.marker(w.scene.ground())});
  w.scene.add("cam", UserConstraint{{Expression{{Measure::displacement(at, 2), Measure::angle(w.i, w.j)}, [](const Real *m) { return m[0] - 0.01 * m[1]; }}}});
  w.scene.start().assembly = Assembly::Project;
  SceneRun run(w.scene, 3, tolerance(1e-6));
  Snapshot now;
  Motion   m;
  must(run.solve());
  must(now.take(run.ts));
  must(now.motion(at, &m));
  EXPECT_GT(m.position(2), 0.01 * 3 * turn);
  EXPECT_NEAR(angleOf(run.ts, w.i, w.j), 100 * m.position(2), 1e-5);
}

/* The angle of a motion is first asked for in a run that continues from a continued run */
TEST(CountedAngles, OfMotionsAfterRunsThatWentOn)
{
  Wheel w(0, Space::Spatial, true);
  w.scene.add("drive", RotationalMotion{w.i, w.j, TimeFunction::polynomial({0, 0, turn})});
  SceneRun run(w.scene, 1.3, tolerance(1e-6));
  must(run.solve());
  TS ts = run.ts, next;
  for (double end : {2.1, 2.7}) {
    must(w.scene.createTS(&next, ts));
    must(TSSetMaxTime(next, end));
    must(w.scene.solve(next));
    if (ts != run.ts) must(TSDestroy(&ts));
    ts = next;
  }
  EXPECT_NEAR(angleOf(ts, w.i, w.j), turn * 2.7 * 2.7, 1e-4);
  must(TSDestroy(&ts));
}
