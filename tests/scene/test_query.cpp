/* Snapshots of a run, compared with the known motion and with channels */
#include "hhtdae/query.h"
#include "scene_output.h"
#include <cmath>

using namespace hhtest;

namespace
{

/* A rod on a pin on a turning disc, with a spring to the ground: contains every kind of motion and load */
struct Machine {
  Scene    scene;
  Body     disc, rod;
  Marker   hub, ground, pivot, at_pivot, tip, anchor, centre;
  Element  axle, pin, spring, drive, winder;
  Variable v;
  State    x;

  explicit Machine(MPI_Comm comm = PETSC_COMM_SELF) : scene(comm)
  {
    RigidBody d, r;
    d.mass             = 2;
    d.inertia          = Vector3(0.3, 0.3, 0.5).asDiagonal();
    d.angular_velocity = {0, 0, 2};
    r.mass             = 0.7;
    r.inertia          = Vector3(0.01, 0.06, 0.06).asDiagonal();
    r.position         = {0.9, 0, 0};
    r.angular_velocity = {0, 0, 2};
    r.velocity         = {0, 1.8, 0};
    disc               = scene.add("disc", d);
    rod                = scene.add("rod", r);
    const Matrix3 about_y = Eigen::AngleAxisd(-M_PI / 2, Vector3::UnitX()).toRotationMatrix();
    hub      = scene.marker(disc);
    ground   = scene.marker(scene.ground());
    pivot    = scene.marker(disc, {0.4, 0, 0}, about_y);
    at_pivot = scene.marker(rod, {-0.5, 0, 0}, about_y);
    tip      = scene.marker(rod, {0.5, 0, 0});
    centre   = scene.marker(rod);
    anchor   = scene.marker(scene.ground(), {1, 1, 1});
    axle     = scene.add("axle", Revolute{hub, ground});
    pin      = scene.add("pin", Revolute{at_pivot, pivot});
    spring   = scene.add("spring", SpringDamper{tip, anchor, 8, 0.1});
    winder   = scene.add("winder", TorsionalSpringDamper{hub, ground, 0.02, 0, 0, 0});
    drive    = scene.add("drive", UserScalarForce{hub, ground, Expression{{Measure::time()}, [](const Real *t) -> Real { return 0.5 * t[0]; }}, true, true});
    v        = scene.variable("v", Measure::distance(tip, anchor));
    x        = scene.state("x", Measure::rate(tip, anchor), 0);
    scene.gravity({0, 0, -9.81});
  }

  std::vector<Measure> measures() const
  {
    std::vector<Measure> all = {Measure::time(), Measure::distance(tip, anchor), Measure::rate(tip, anchor), Measure::value(v), Measure::value(x), Measure::force(spring, 0),
                                Measure::force(drive, 0), Measure::force(winder, 0), energy(Measure::KineticEnergy), energy(Measure::PotentialEnergy)};
    for (int c = 0; c < 3; c++) {
      for (Marker frame : {Marker{}, tip}) {
        all.push_back(Measure::displacement(tip, c, hub, frame));
        all.push_back(Measure::velocity(tip, c, hub, frame));
        all.push_back(Measure::acceleration(tip, c, hub, frame));
        all.push_back(Measure::angularVelocity(tip, c, hub, frame));
        all.push_back(Measure::angularAcceleration(tip, c, hub, frame));
        all.push_back(Measure::jointForce(pin, c, frame));
        all.push_back(Measure::jointMoment(pin, c, frame));
        for (Element e : {axle, pin, spring, winder, drive}) {
          const Marker on = e.id == axle.id || e.id == winder.id || e.id == drive.id ? hub : tip;
          all.push_back(Measure::elementForce(e, on, c, frame));
          all.push_back(Measure::elementMoment(e, on, c, frame));
        }
      }
    }
    for (int r = 0; r < 5; r++) all.push_back(Measure::multiplier(pin, r));
    return all;
  }
};

void expectNear(const Vector3 &a, const Vector3 &b, double tolerance) { EXPECT_LT((a - b).norm(), tolerance) << a.transpose() << " for " << b.transpose(); }

} // namespace

/* Every measure equals its channel, between steps and at their ends, while the winder turns more than once */
TEST(Query, MeasuresAgreeWithChannels)
{
  Machine m;
  const std::vector<Measure> all = m.measures();
  for (const Measure &x : all) m.scene.channel("", x);
  SceneRun run(m.scene, 5, tolerance(1e-7));
  must(run.solve());
  PetscReal before, end;
  must(TSGetPrevTime(run.ts, &before));
  must(TSGetTime(run.ts, &end));
  Snapshot now;
  for (double t : {0.3 * before + 0.7 * end, end}) {
    std::vector<double> channel;
    must(now.take(run.ts, t));
    must(m.scene.sample(run.ts, t, channel));
    for (std::size_t k = 0; k < all.size(); k++) {
      double x;
      must(now.value(all[k], &x));
      EXPECT_NEAR(x, channel[k], 1e-9 * std::max(1., std::abs(channel[k]))) << "measure " << k << " of kind " << all[k].kind << ", component " << all[k].component;
    }
  }
}

/* Two balls start at the same position and separate with 3 m/s: at the start their distance has no derivative, and the
   rate must be finite nevertheless */
TEST(Query, RateOfMarkersThatCoincide)
{
  Scene      scene(PETSC_COMM_SELF);
  PointMass  b;
  const Body still     = scene.add("still", b);
  b.velocity           = {3, 0, 0};
  const Body    moving = scene.add("moving", b);
  const Measure rate   = Measure::rate(scene.marker(moving), scene.marker(still));
  scene.variable("rate", rate);
  SceneRun run(scene, 1, "");
  Snapshot now;
  double   x;
  must(now.take(run.ts, 0));
  must(now.value(rate, &x));
  EXPECT_EQ(x, 0);
  must(run.solve());
  must(now.take(run.ts));
  must(now.value(rate, &x));
  EXPECT_NEAR(x, 3, 1e-12);
}

/* Velocities and accelerations are the time derivatives of positions and velocities, relative to space and to a moving
   marker */
TEST(Query, MotionIsTheRateOfMotion)
{
  Machine  m;
  SceneRun run(m.scene, 1, tolerance(1e-9));
  must(run.solve());
  PetscReal before, end;
  must(TSGetPrevTime(run.ts, &before));
  must(TSGetTime(run.ts, &end));
  const double t = 0.5 * (before + end), d = 0.2 * (end - before);
  Snapshot     now;
  for (bool relative : {false, true}) {
    Motion x[3];
    for (int k = 0; k < 3; k++) {
      must(now.take(run.ts, t + (k - 1) * d));
      if (relative) must(now.relativeMotion(m.tip, m.hub, &x[k]));
      else must(now.motion(m.tip, &x[k]));
    }
    expectNear(x[1].velocity, (x[2].position - x[0].position) / (2 * d), 1e-4);
    expectNear(x[1].acceleration, (x[2].velocity - x[0].velocity) / (2 * d), 1e-2);
    expectNear(x[1].angular_acceleration, (x[2].angular_velocity - x[0].angular_velocity) / (2 * d), 1e-2);
    const Matrix3 turn = (x[2].axes - x[0].axes) / (2 * d) * x[1].axes.transpose();
    expectNear(x[1].angular_velocity, {turn(2, 1), turn(0, 2), turn(1, 0)}, 1e-4);
  }
}

/* The laws of Newton and Euler for the rod: m a and the rate of the angular momentum equal the sum of all loads */
TEST(Query, LoadsMakeTheMotion)
{
  Machine  m;
  SceneRun run(m.scene, 2, tolerance(1e-8) + "-ts_hhtdae_corrector_tolerance 1e-6"); /* the residual that a step may leave */
  must(run.solve());
  Snapshot now;
  must(now.take(run.ts));
  Motion x;
  must(now.motion(m.rod, &x));
  Vector3 f = 0.7 * Vector3(0, 0, -9.81), moment = Vector3::Zero();
  for (Element e : {m.axle, m.pin, m.spring, m.winder, m.drive}) {
    Load l;
    must(now.load(e, m.centre, &l));
    f += l.force;
    moment += l.moment;
  }
  expectNear(f, 0.7 * x.acceleration, 1e-6);
  const Matrix3 J = x.axes * Vector3(0.01, 0.06, 0.06).asDiagonal() * x.axes.transpose();
  expectNear(moment, J * x.angular_acceleration + x.angular_velocity.cross(J * x.angular_velocity), 1e-6);
  Load on_i, on_j;
  must(now.load(m.pin, m.at_pivot, &on_i));
  must(now.load(m.pin, m.pivot, &on_j));
  expectNear(on_i.force, -on_j.force, 1e-9);
  EXPECT_GT(on_i.force.norm(), 1);
  must(now.load(m.spring, m.hub, &on_i));
  EXPECT_EQ(on_i.force.norm(), 0); /* the element is not connected to the disc */
}

/* A channel may be any function of measures, including energies */
TEST(Query, AnExpressionAsChannel)
{
  Machine m;
  m.scene.channel("energy", Expression{{Measure::kineticEnergy(), Measure::potentialEnergy()}, [](const Real *e) -> Real { return e[0] + e[1]; }}, "J");
  m.scene.channel("ratio", Expression{{Measure::distance(m.tip, m.anchor), Measure::jointForce(m.pin, 2)}, [](const Real *x) -> Real { return x[1] / (x[0] * x[0]); }});
  SceneRun            run(m.scene, 1, tolerance(1e-7));
  std::vector<double> x;
  Snapshot            now;
  double              kinetic, potential, distance, force;
  must(run.solve());
  must(m.scene.sample(run.ts, 1, x));
  must(now.take(run.ts, 1));
  must(now.energy(&kinetic, &potential));
  must(now.value(Measure::distance(m.tip, m.anchor), &distance));
  must(now.value(Measure::jointForce(m.pin, 2), &force));
  EXPECT_NEAR(x[0], kinetic + potential, 1e-12 * std::abs(kinetic));
  EXPECT_NEAR(x[1], force / (distance * distance), 1e-9 * std::abs(x[1]));
  Machine empty;
  empty.scene.channel("nothing", Expression());
  ErrorTrap trap;
  EXPECT_NE(empty.scene.setUp(), 0);
  EXPECT_TRUE(trap.says("channel nothing: its function is empty")) << trap.message;
}

TEST(Query, Angles)
{
  for (const Vector3 &a : {Vector3(0.3, 1.1, -2.5), Vector3(-3, 0.2, 0.4)}) {
    const auto about = [](double angle, const Vector3 &axis) { return Eigen::AngleAxisd(angle, axis).toRotationMatrix(); };
    Motion     m;
    m.axes = about(a(0), Vector3::UnitZ()) * about(a(1), Vector3::UnitX()) * about(a(2), Vector3::UnitZ());
    expectNear(m.euler(), a, 1e-12);
    EXPECT_LT((m.quaternion().toRotationMatrix() - m.axes).norm(), 1e-12);
    m.axes = about(a(0), Vector3::UnitX()) * about(a(1), Vector3::UnitY()) * about(a(2), Vector3::UnitZ());
    expectNear(m.bryant(), a, 1e-12);
  }
  for (double sign : {1., -1.}) { /* also at the singularities the attitude is right */
    Motion m;
    m.axes << std::cos(0.4), -std::sin(0.4), 0, sign * std::sin(0.4), sign * std::cos(0.4), 0, 0, 0, sign;
    Vector3 e = m.euler();
    EXPECT_LT((Eigen::AngleAxisd(e(0), Vector3::UnitZ()) * Eigen::AngleAxisd(e(1), Vector3::UnitX()) * Eigen::AngleAxisd(e(2), Vector3::UnitZ()).toRotationMatrix() - m.axes).norm(), 1e-12);
    m.axes = Eigen::AngleAxisd(0.7, Vector3::UnitX()).toRotationMatrix() * Eigen::AngleAxisd(sign * M_PI / 2, Vector3::UnitY()).toRotationMatrix();
    e      = m.bryant();
    expectNear(e, {0.7, sign * M_PI / 2, 0}, 1e-9);
  }
}

TEST(Query, SaysWhatIsWrong)
{
  Machine   m, other;
  Snapshot  now;
  Motion    x;
  Load      l;
  double    y;
  ErrorTrap trap;
  const auto refused = [&](PetscErrorCode code, const char *why) {
    EXPECT_NE(code, 0) << why;
    EXPECT_TRUE(trap.says(why)) << trap.message;
  };
  refused(now.motion(m.tip, &x), "call take() first");
  TS ts;
  must(TSCreate(PETSC_COMM_SELF, &ts));
  refused(now.take(ts, 0), "not one of a scene");
  must(TSDestroy(&ts));
  SceneRun run(m.scene, 0.1, "");
  must(now.take(run.ts));
  must(now.motion(m.tip, &x)); /* at the start */
  expectNear(x.position, {1.4, 0, 0}, 1e-12);
  must(run.solve());
  must(now.take(run.ts));
  refused(now.motion(other.tip, &x), "not a marker of this scene");
  refused(now.load(other.pin, m.tip, &l), "not one of this scene");
  refused(now.value(Measure::displacement(other.tip, 0), &y), "marker i is not one of this scene");
}

/* Forces at the start of a pendulum in its lowest position, in any units of length and time */
TEST(Query, Units)
{
  for (double length : {1., 1e3, 1e6})
    for (double time : {1e-3, 1., 1e6}) {
      Scene        scene(PETSC_COMM_SELF);
      RigidBody    b;
      const double L = 5 * length, v = 20 * length / time, g = 9.81 * length / (time * time), want = 2 * (g + v * v / L);
      b.mass             = 2;
      b.inertia          = 0.1 * length * length * Matrix3::Identity();
      b.position         = {0, 0, -L};
      b.velocity         = {v, 0, 0};
      b.angular_velocity = {0, -v / L, 0};
      const Body    body = scene.add("body", b);
      const Marker  pivot = scene.markerAt(body, {0, 0, 0});
      const Element joint = scene.add("joint", Spherical{pivot, scene.marker(scene.ground())});
      scene.gravity({0, 0, -g});
      TS       ts;
      Snapshot now;
      Load     load;
      must(scene.createTS(&ts));
      must(now.take(ts));
      must(now.load(joint, pivot, &load));
      EXPECT_NEAR(load.force[2] / want, 1, 1e-6) << length << " of a metre, " << time << " of a second";
      must(TSDestroy(&ts));
    }
}

/* A marker created after the run was made: its motion can be asked for, and the run and other runs of the scene
   continue unchanged */
TEST(Query, MarkersMadeAfterwards)
{
  const TemporaryFile file("afterwards.checkpoint");
  Machine             m;
  SceneRun            run(m.scene, 0.5, tolerance(1e-6));
  Snapshot            now;
  Motion              x, centre;
  double              height;
  const auto          state = [](const SceneRun &r) {
    Vec U;
    must(TSGetSolution(r.ts, &U));
    return whole(U);
  };
  SceneRun first(m.scene, 1, tolerance(1e-6));
  must(first.solve());
  must(run.solve());
  must(TSHHT3CheckpointSave(run.ts, file.name.c_str()));
  const Marker late = m.scene.marker(m.rod, {0.25, 0.5, 100});
  must(now.take(run.ts));
  must(now.motion(late, &x));
  must(now.motion(m.rod, &centre));
  expectNear(x.position, centre.position + centre.axes * Vector3(0.25, 0.5, 100), 1e-12);
  must(now.value(Measure::displacement(late, 2), &height));
  EXPECT_EQ(height, x.position[2]);
  must(TSSetMaxTime(run.ts, 1));
  must(m.scene.solve(run.ts));
  SceneRun again(m.scene, 1, tolerance(1e-6)), resumed(m.scene, 1, tolerance(1e-6));
  must(again.solve());
  EXPECT_EQ(state(again), state(first));
  must(TSSetUp(resumed.ts));
  must(TSHHT3CheckpointLoad(resumed.ts, file.name.c_str()));
  must(resumed.solve());
  EXPECT_EQ(state(resumed), state(run));
}

/* A body of 1 kg at the end of an arm of 1 m: the multipliers of a joint are about the axes of marker j, also if those
   of i point the opposite way */
TEST(JointMultipliers, AxesThatPointAwayFromEachOther)
{
  for (int flip : {-1, 0, 1, 2})
    for (bool fixed : {false, true}) {
      Scene s(PETSC_COMM_SELF);
      s.gravity({0, 0, -10});
      RigidBody b;
      b.position         = {1, 0, 0};
      const Body    arm  = s.add("arm", b);
      const Matrix3 axes = flip < 0 ? Matrix3(Matrix3::Identity()) : Eigen::AngleAxisd(M_PI, Vector3::Unit(flip)).toRotationMatrix();
      const Marker  i = s.markerAt(arm, {0, 0, 0}, axes), j = s.marker(s.ground());
      const Element joint = fixed ? s.add("joint", Fixed{i, j}) : s.add("joint", Revolute{i, j});
      SceneRun      run(s, 1, "");
      Snapshot      now;
      double        x;
      must(now.take(run.ts));
      must(now.value(Measure::jointMoment(joint, 1), &x));
      EXPECT_NEAR(x, -10, 1e-9);
      must(now.value(Measure::multiplier(joint, 4), &x));
      EXPECT_NEAR(x, -10, 1e-9) << fixed << flip;
    }
  for (int flip : {-1, 2}) {
    Scene s(PETSC_COMM_SELF, Space::Planar);
    s.gravity({0, -10, 0});
    RigidBody b;
    b.position         = {1, 0, 0};
    const Body    arm  = s.add("arm", b);
    const Matrix3 axes = flip < 0 ? Matrix3(Matrix3::Identity()) : Eigen::AngleAxisd(M_PI, Vector3::Unit(flip)).toRotationMatrix();
    const Element joint = s.add("joint", Fixed{s.markerAt(arm, {0, 0, 0}, axes), s.marker(s.ground())});
    SceneRun      run(s, 1, "");
    Snapshot      now;
    double        x;
    must(now.take(run.ts));
    must(now.value(Measure::multiplier(joint, 2), &x));
    EXPECT_NEAR(x, 10, 1e-9) << flip;
  }
}

/* The marker whose axes a force uses is not loaded by the force; asking for the load on its body is an error */
TEST(Query, TheFrameOfAForceTakesNoLoad)
{
  Scene        s(PETSC_COMM_SELF);
  const Body   a = s.add("a", RigidBody()), b = s.add("b", RigidBody());
  const Marker i = s.marker(a), frame = s.marker(b);
  UserForce    f;
  f.i                = i;
  f.frame            = frame;
  f.force            = {TimeFunction(1), TimeFunction(2), TimeFunction(3)};
  const Element force = s.add("force", f);
  SceneRun      run(s, 1, "");
  Snapshot      now;
  double        x;
  must(now.take(run.ts));
  must(now.value(Measure::elementForce(force, i, 0), &x));
  EXPECT_NEAR(x, 1, 1e-12);
  ErrorTrap trap;
  EXPECT_NE(now.value(Measure::elementForce(force, frame, 0), &x), 0);
}
