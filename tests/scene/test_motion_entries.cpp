/* Motions, screw and couplers in a scene: which input is refused with which message, Jacobians, runs with known solutions */
#include "scene/kernels/angle.h"
#include "scene_jacobian.h"
#include "scene_output.h"

using namespace hhtest;

namespace
{

const double       kNaN  = std::numeric_limits<double>::quiet_NaN();
const TimeFunction kWave = TimeFunction::harmonic(.3, 2, .1, .2);

Matrix3 AboutZ(double angle) { return Eigen::AngleAxisd(angle, Vector3::UnitZ()).toRotationMatrix(); }
Matrix3 Tilted() { return Eigen::AngleAxisd(.8, Vector3(1, 2, 0).normalized()).toRotationMatrix(); }

RigidBody Block(const Vector3 &position = Vector3::Zero(), const Matrix3 &rotation = Matrix3::Identity())
{
  RigidBody b;
  b.mass     = 2;
  b.inertia  = Vector3(.1, .2, .3).asDiagonal();
  b.position = position;
  b.rotation = rotation;
  return b;
}

/* Two blocks and a point mass, markers on them and on the ground */
struct Parts {
  Scene  scene;
  Body   first, second, bead;
  Marker i, j, ground, point;

  explicit Parts(Space space = Space::Spatial) : scene(PETSC_COMM_SELF, space)
  {
    scene.start().assembly = Assembly::Off; /* off, because most of these scenes are not assembled */
    const bool planar = space == Space::Planar;
    first             = scene.add("first", Block({.2, .1, 0}, planar ? AboutZ(.4) : Tilted()));
    second            = scene.add("second", Block({1, 2, 0}));
    bead              = scene.add("bead", PointMass{});
    i                 = scene.marker(first, {.1, 0, 0});
    j                 = scene.marker(second, {.3, .4, 0});
    ground            = scene.marker(scene.ground(), {1, 2, 0});
    point             = scene.marker(bead);
  }
  template <class Spec> std::string errors(const Spec &s)
  {
    std::string all;
    scene.add("it", s);
    for (const std::string &e : DataOf(scene).errors) all += e + "\n";
    DataOf(scene).errors.clear();
    return all;
  }
};

void ExpectSays(const std::string &errors, const std::string &words)
{
  EXPECT_NE(errors.find(words), std::string::npos) << "expected: " << words << "\ngot: " << errors;
}

double JacobianError(Scene &scene, unsigned seed)
{
  double worst = 0;
  must(scene.setUp());
  for (Rotations r : all_rotations) widen(worst, AnyState(scene, seed, 0.4, r).jacobianError(.7, .4, r == Rotations::Local ? .4 : 0));
  return worst;
}

/* Pose of a body at the present time of the run */
Frame<double> Pose(const SceneRun &run, Body body)
{
  Vec                U, V;
  const PetscScalar *u, *v;
  Runtime           &R = *RunOf(run.ts);
  must(TS2GetSolution(run.ts, &U, &V));
  must(VecGetArrayRead(U, &u));
  must(VecGetArrayRead(V, &v));
  R.bodies.move(u, v);
  must(VecRestoreArrayRead(U, &u));
  must(VecRestoreArrayRead(V, &v));
  const BodyMotion &b = R.bodies.now[R.local_body[body.id]];
  return {b.r, b.A};
}

/* Multiplier of the last row of an element */
double Multiplier(Scene &scene, const SceneRun &run, Element e)
{
  const Part part = DataOf(scene).elements[e.id].parts.back();
  Vec        U, V;
  must(TS2GetSolution(run.ts, &U, &V));
  return whole(U)[part.store->start[part.index]];
}

const std::string tight = "-ts_atol 1e-8 -ts_rtol 1e-8 -ts_dt 1e-3 -ts_max_steps 100000";

} // namespace

/* ---- what is refused ---- */

TEST(MotionEntries, BadFunctionsAreNamed)
{
  Parts p;
  ExpectSays(p.errors(RotationalMotion{p.i, p.ground, TimeFunction::spline({1, 0}, {1, 2})}),
             "rotational motion it: its function: the spline's times must increase, but 1 is followed by 0");
  ExpectSays(p.errors(TranslationalMotion{p.i, p.ground, kNaN, MotionOf::Velocity}),
             "translational motion it: its function");
  const TimeFunction root =
      TimeFunction::formula([](const TimeFunction::Number &t) -> TimeFunction::Number { return sqrt(t); });
  const TimeFunction pole =
      TimeFunction::formula([](const TimeFunction::Number &t) -> TimeFunction::Number { return 1.0 / t; });
  ExpectSays(p.errors(RotationalMotion{p.i, p.ground, root}), "derivatives inf");
  ExpectSays(p.errors(RotationalMotion{p.i, p.ground, pole, MotionOf::Velocity}), "inf at the start, t = 0");
  EXPECT_EQ(p.errors(RotationalMotion{p.i, p.ground, root, MotionOf::Velocity}), "");
  p.scene.start().time = 1; /* a motion that has begun before the start */
  EXPECT_EQ(p.errors(RotationalMotion{p.i, p.ground, root}), "");
  EXPECT_EQ(p.errors(RotationalMotion{p.i, p.ground, pole, MotionOf::Velocity}), "");
}

TEST(MotionEntries, BadPairsAreNamed)
{
  Parts        p;
  Matrix3      sideways;
  const Marker twin = p.scene.marker(p.first, {0, 1, 0});
  sideways << 0, 0, -1, 0, 1, 0, 1, 0, 0; /* x is along the other marker's z */
  const Marker odd = p.scene.marker(p.second, {0, 0, 0}, sideways);
  ExpectSays(p.errors(RotationalMotion{p.i, Marker{}, kWave}), "marker j is not a marker");
  ExpectSays(p.errors(RotationalMotion{p.i, twin, kWave}), "both markers are on first");
  ExpectSays(p.errors(RotationalMotion{p.point, p.ground, kWave}), "marker i is on the point mass bead");
  ExpectSays(p.errors(RotationalMotion{odd, p.ground, kWave}), "there is no angle about z");
  ExpectSays(p.errors(TranslationalMotion{p.i, p.point, kWave}), "marker j is on the point mass bead");
  EXPECT_EQ(p.errors(TranslationalMotion{p.point, p.ground, kWave}), "");
  ExpectSays(p.errors(TranslationalMotion{p.i, p.ground, kWave, MotionOf::Displacement, 3}),
             "axis is 3, must be 0, 1 or 2");
  ExpectSays(p.errors(TranslationalMotion{p.i, p.ground, kWave, MotionOf::Displacement, -1}), "axis is -1");
  Parts planar(Space::Planar);
  ExpectSays(planar.errors(TranslationalMotion{planar.i, planar.ground, kWave, MotionOf::Displacement, 3}), "axis is 3, must be 0, 1 or 2");
}

TEST(MotionEntries, BadCouplersAreNamed)
{
  Parts p, planar(Space::Planar);
  using Term = Coupler::Term;
  ExpectSays(p.errors(Screw{p.i, p.ground, kNaN}), "screw it: pitch is nan");
  ExpectSays(planar.errors(Screw{planar.i, planar.ground, 1}), "a planar scene has no screws");
  ExpectSays(p.errors(Gear{p.i, p.ground, p.j, p.ground, 0}), "gear it: ratio is 0");
  ExpectSays(p.errors(Gear{p.i, p.ground, p.j, Marker{99}, 2}), "term 2: marker j is not a marker");
  ExpectSays(p.errors(RackAndPinion{p.i, p.ground, p.j, p.ground, kNaN}), "rack and pinion it: radius is nan");
  ExpectSays(p.errors(Coupler{}), "0 terms, must be two or three");
  ExpectSays(p.errors(Coupler{{Term{p.i, p.ground}}}), "1 terms, must be two or three");
  ExpectSays(p.errors(Coupler{{Term{p.i, p.ground}, Term{p.j, p.ground, true, 0}}}), "term 2: factor is 0");
  ExpectSays(p.errors(Coupler{{Term{p.i, p.ground}, Term{p.point, p.ground}}}),
             "term 2: marker i is on the point mass");
  EXPECT_EQ(p.errors(Coupler{{Term{p.i, p.ground}, Term{p.point, p.ground, false}}}), "");
}

/* ---- Jacobians of the assembled scene, at random states ---- */

TEST(MotionEntries, JacobiansInSpace)
{
  for (MotionOf of : {MotionOf::Displacement, MotionOf::Velocity, MotionOf::Acceleration}) {
    Parts p;
    p.scene.add("turn", RotationalMotion{p.i, p.j, kWave, of});
    p.scene.add("move", TranslationalMotion{p.i, p.j, kWave, of, 1});
    p.scene.add("lift", TranslationalMotion{p.point, p.j, kWave, of, 2});
    EXPECT_LT(JacobianError(p.scene, 1), 1e-6) << "motion of kind " << (int)of;
  }
  using Term = Coupler::Term;
  Parts p;
  p.scene.add("screw", Screw{p.i, p.j, .3});
  p.scene.add("gear", Gear{p.i, p.ground, p.j, p.ground, 2});
  p.scene.add("rack", RackAndPinion{p.i, p.j, p.j, p.ground, .2});
  p.scene.add("three",
              Coupler{{Term{p.point, p.ground, false, 2}, Term{p.j, p.ground, true, .3}, Term{p.i, p.j, true, -1}}});
  EXPECT_LT(JacobianError(p.scene, 2), 1e-6);
}

TEST(MotionEntries, JacobiansInThePlane)
{
  for (MotionOf of : {MotionOf::Displacement, MotionOf::Velocity, MotionOf::Acceleration}) {
    Parts p(Space::Planar);
    p.scene.add("turn", RotationalMotion{p.i, p.j, kWave, of});
    p.scene.add("move", TranslationalMotion{p.i, p.j, kWave, of, 1});
    p.scene.add("gear", Gear{p.i, p.ground, p.j, p.ground, 2});
    p.scene.add("rack", RackAndPinion{p.i, p.j, p.j, p.ground, .2});
    EXPECT_LT(JacobianError(p.scene, 3), 1e-6) << "motion of kind " << (int)of;
  }
}

/* ---- runs ---- */

/* A nut off its axis makes two turns, driven by 3 t + 10 t^2 as displacement, velocity or acceleration. The drive
   accelerates the nut about z and, by the thread, along z against gravity */
TEST(MotionEntries, AScrewDrivenInThreeWays)
{
  const double       pitch = .1, lead = pitch / kTurn, speed = 3, mass = 2, gravity = 9.81;
  const Vector3      c(.2, .1, 0);
  const TimeFunction function[] = {TimeFunction::polynomial({0, 3, 10}), TimeFunction::polynomial({3, 20}), 20.};
  const double       angle = 13, axial = mass * (gravity + lead * 20),
               moment = (.3 + mass * c.squaredNorm()) * 20 + lead * axial;
  for (int of = 0; of < 3; of++) {
    Scene     scene(PETSC_COMM_SELF);
    RigidBody b        = Block(c);
    b.angular_velocity = {0, 0, speed};
    b.velocity         = b.angular_velocity.cross(c) + Vector3(0, 0, lead * speed);
    const Body    nut  = scene.add("nut", b);
    const Marker  i = scene.markerAt(nut, Vector3::Zero()), j = scene.marker(scene.ground());
    const Element screw = scene.add("screw", Screw{i, j, pitch});
    const Element drive = scene.add("drive", RotationalMotion{i, j, function[of], (MotionOf)of});
    scene.gravity({0, 0, -gravity});
    SceneRun run(scene, 1, tight);
    must(run.solve());
    const Frame<double> pose = Pose(run, nut);
    const double        dx   = (pose.x - AboutZ(angle) * c - Vector3(0, 0, lead * angle)).norm();
    const double        dR   = (pose.R - AboutZ(angle)).norm();
    EXPECT_LT(dx, 1e-6) << of;
    EXPECT_LT(dR, 1e-6) << of;
    EXPECT_NEAR(Multiplier(scene, run, screw), axial, 1e-3 * axial) << of;
    EXPECT_NEAR(Multiplier(scene, run, drive), moment, 1e-3 * moment) << of;
    MEASURED("screw, motion %d: position to %.1e, attitude to %.1e, force %.5f of %.5f, moment %.5f of %.5f", of, dx,
             dR, Multiplier(scene, run, screw), axial, Multiplier(scene, run, drive), moment);
  }
}

/* Two wheels with different axes in space and the ratio 2.5: the first makes six turns, the second six turns over the
   ratio, backwards */
TEST(MotionEntries, AGearOverManyTurns)
{
  Scene         scene(PETSC_COMM_SELF);
  const Matrix3 X   = Tilted();
  const Body    one = scene.add("one", Block()), two = scene.add("two", Block({1, 0, 0}));
  const Marker  i1 = scene.markerAt(one, {0, 0, 0}, X), j1 = scene.marker(scene.ground(), {0, 0, 0}, X);
  const Marker  i2 = scene.markerAt(two, {1, 0, 0}), j2 = scene.marker(scene.ground(), {1, 0, 0});
  scene.add("pin 1", Revolute{i1, j1});
  scene.add("pin 2", Revolute{i2, j2});
  scene.add("gear", Gear{i1, j1, i2, j2, 2.5});
  scene.add("drive", RotationalMotion{i1, j1, TimeFunction::polynomial({0, 0, 10})});
  SceneRun run(scene, 2, tight);
  must(run.solve());
  const double d1 = (Pose(run, one).R - X * AboutZ(40) * X.transpose()).norm();
  const double d2 = (Pose(run, two).R - AboutZ(-16)).norm();
  EXPECT_LT(d1, 1e-8);
  EXPECT_LT(d2, 1e-8);
  MEASURED("gear: wheels at 40 and -16 rad to %.1e and %.1e", d1, d2);
}

/* A translational motion without an axis acts along the guide of Translational: z_j in space, x_j in the plane. s =
   t^2 as displacement, velocity or acceleration; the multiplier is the force on the block, 2 times its mass */
TEST(MotionEntries, ATranslationWithoutAnAxisIsAlongItsGuide)
{
  const TimeFunction function[] = {TimeFunction::polynomial({0, 0, 1}), TimeFunction::polynomial({0, 2}), 2.};
  for (Space space : {Space::Spatial, Space::Planar})
    for (int of = 0; of < 3; of++) {
      const Matrix3 turned = AboutZ(.4);
      const Vector3 way = turned.col(0), from(.3, -.2, 0);
      const Matrix3 axes = space == Space::Planar ? turned : (Matrix3() << turned.col(1), turned.col(2), way).finished();
      Scene         scene(PETSC_COMM_SELF, space);
      const Body    block = scene.add("block", Block(from));
      const Marker  i = scene.markerAt(block, from, axes), j = scene.marker(scene.ground(), from, axes);
      scene.add("guide", Translational{i, j});
      const Element drive = scene.add("drive", TranslationalMotion{i, j, function[of], (MotionOf)of});
      SceneRun      run(scene, 1, tight);
      must(run.solve());
      EXPECT_LT((Pose(run, block).x - from - way).norm(), 1e-6) << of;
      EXPECT_NEAR(Multiplier(scene, run, drive), 4, 4e-3) << of;
    }
}

namespace
{

/* A rack of mass 2 falls along `axis` of its guide and turns a pinion of inertia 0.3, radius r: a = g m/(m + I/r^2) */
void RackFalls(Space space)
{
  const double  m = 2, I = .3, r = .25, g = 9.81, a = g * m / (m + I / (r * r)), t = 1.5;
  const bool    planar = space == Space::Planar;
  Matrix3       down; /* the direction of the guide (x in the plane, z in space) is along -y */
  Scene         scene(PETSC_COMM_SELF, space);
  const Vector3 place(.25, 0, 0);
  if (planar)
    down << 0, 1, 0, -1, 0, 0, 0, 0, 1;
  else
    down << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const Body    rack = scene.add("rack", Block(place)), pinion = scene.add("pinion", Block());
  const Marker  ip = scene.marker(pinion), jp = scene.marker(scene.ground());
  const Marker  ir = scene.markerAt(rack, place, down), jr = scene.marker(scene.ground(), place, down);
  const Element mesh = scene.add("mesh", RackAndPinion{ip, jp, ir, jr, r});
  scene.add("pin", Revolute{ip, jp});
  scene.add("guide", Translational{ir, jr});
  scene.gravity({0, -g, 0});
  SceneRun run(scene, t, tight);
  must(run.solve());
  const double fall = a * t * t / 2;
  EXPECT_GT(fall / r, kTurn); /* more than a turn */
  const double dx = (Pose(run, rack).x - place - Vector3(0, -fall, 0)).norm();
  const double dR = (Pose(run, pinion).R - AboutZ(fall / r)).norm();
  EXPECT_LT(dx, 1e-6);
  EXPECT_LT(dR, 1e-6);
  EXPECT_NEAR(Multiplier(scene, run, mesh), -m * (g - a),
              1e-4 * m * g); /* the pinion's force opposes the rack's motion */
  MEASURED("rack: position to %.1e of %.2f, pinion to %.1e, force %.6f of %.6f", dx, fall, dR,
           Multiplier(scene, run, mesh), -m * (g - a));
}

} // namespace

TEST(MotionEntries, ARackTurnsItsPinionInSpace) { RackFalls(Space::Spatial); }
TEST(MotionEntries, ARackTurnsItsPinionInThePlane) { RackFalls(Space::Planar); }

/* A differential: angle_1 + angle_2 - 2 angle_3 = 0. The third wheel follows the mean of two drives. */
TEST(MotionEntries, ADifferentialOfThreeWheels)
{
  Scene                      scene(PETSC_COMM_SELF, Space::Planar);
  std::vector<Coupler::Term> terms;
  Body                       wheel[3];
  const double               speed[2] = {9, -4}, factor[3] = {1, 1, -2};
  for (int k = 0; k < 3; k++) {
    RigidBody b        = Block({2. * k, 0, 0});
    b.angular_velocity = {0, 0, k < 2 ? speed[k] : (speed[0] + speed[1]) / 2};
    wheel[k]           = scene.add("", b);
    const Marker i = scene.marker(wheel[k]), j = scene.marker(scene.ground(), b.position);
    scene.add("", Revolute{i, j});
    terms.push_back({i, j, true, factor[k]});
    if (k < 2) scene.add("", RotationalMotion{i, j, speed[k], MotionOf::Velocity});
  }
  scene.add("differential", Coupler{terms});
  SceneRun run(scene, 3, tight);
  must(run.solve());
  EXPECT_LT((Pose(run, wheel[0]).R - AboutZ(27)).norm(), 1e-7);
  EXPECT_LT((Pose(run, wheel[2]).R - AboutZ(7.5)).norm(), 1e-7);
}

/* A drive whose function ends in the middle of the run leads to an error, not to a result */
TEST(MotionEntries, AFunctionThatEndsStopsTheRun)
{
  Scene        scene(PETSC_COMM_SELF, Space::Planar);
  const Body   b = scene.add("", Block());
  const Marker i = scene.marker(b), j = scene.marker(scene.ground());
  scene.add("pin", Revolute{i, j});
  const TimeFunction ends = TimeFunction::values([](double t) {
    return t < .5 ? TimeFunction::Value{t, 1, 0} : TimeFunction::Value{kNaN, kNaN, kNaN};
  });
  scene.add("drive", RotationalMotion{i, j, ends, MotionOf::Velocity});
  SceneRun  run(scene, 1, tight + " -ts_max_snes_failures 3");
  ErrorTrap trap;
  PetscReal t;
  EXPECT_NE(run.solve(), 0);
  EXPECT_TRUE(trap.says("too many corrections failed")) << trap.message;
  must(TSGetTime(run.ts, &t));
  EXPECT_LE(t, .5);
  EXPECT_GT(t, .4);
}
