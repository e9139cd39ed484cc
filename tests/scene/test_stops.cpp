/* Stops, ropes and struts: derivatives, force law, and runs against closed forms */
#include "force_checks.h"
#include "hhtdae/query.h"
#include "scene/kernels/stop.h"
#include "scene/model.h"
#include "scene_output.h"
#include <cmath>

using namespace hhtest;

namespace
{

/* a state with the coordinate s below, within or beyond the travel */
StopData stop(Random &random, double s)
{
  StopData d{};
  const int where = int(random(0, 2.999));
  d.lower         = where == 0 ? s + random(.2, 1) : s - random(.2, 1);
  d.upper         = d.lower + (where == 1 ? 3 : where == 2 ? 0.1 : 0.5);
  d.law.stiffness = random(1, 3);
  d.law.exponent  = random(0, 1) < .5 ? 1 : 1.5;
  d.law.damping   = random(.05, .15);
  d.axis          = int(random(0, 2.999));
  return d;
}

/* A mass that slides along x between stops at -1 and 1 */
struct Slider {
  Scene   scene{PETSC_COMM_SELF};
  Body    body;
  Marker  i, j;
  Element stop;

  explicit Slider(double speed, ContactLaw law)
  {
    RigidBody b;
    b.mass     = 2;
    b.velocity = {speed, 0, 0};
    body       = scene.add("slider", b);
    const Matrix3 along = Eigen::AngleAxisd(M_PI / 2, Vector3::UnitY()).toRotationMatrix(); /* z along x */
    i = scene.marker(body, Vector3::Zero(), along);
    j = scene.marker(scene.ground(), Vector3::Zero(), along);
    scene.add("guide", Translational{i, j});
    TranslationalStop s{i, j};
    s.lower = -1;
    s.upper = 1;
    s.law   = law;
    stop    = scene.add("stop", s);
  }
};

} // namespace

TEST(Stops, Derivatives)
{
  CheckForce<TurnStop>([](Random &random, Frame<double> *f) {
    while (std::abs(f[0].R.col(0).dot(f[1].R.col(2))) > .9) f[0].R = random.rotation();
    StopData d  = stop(random, PrincipalAngle<double>(f[0], f[1]) + 2 * kTurn);
    d.memory[0] = PrincipalAngle<double>(f[0], f[1]) + 2 * kTurn;
    return d;
  });
  CheckForce<AdvanceStop>([](Random &random, Frame<double> *f) {
    StopData d = stop(random, 0);
    const double s = Advance<double>(f[0], f[1], d.axis);
    d.lower += s;
    d.upper += s;
    return d;
  });
  CheckForce<LengthStop>([](Random &random, Frame<double> *f) { return stop(random, (f[0].x - f[1].x).norm()); });
}

/* A mass thrown against a linear stop is in contact for half a period of the spring and returns with the same speed;
   energy is conserved */
TEST(Stops, ASliderBouncesBetweenTheEnds)
{
  ContactLaw law;
  law.stiffness = 2e3;
  law.exponent  = 1;
  Slider s(3, law);
  const double omega = std::sqrt(law.stiffness / 2), depth = 3 / omega, contact = M_PI / omega, period = 4. / 3 + 2 * contact;
  SceneRun run(s.scene, 1.25 * period, tolerance(1e-8)); /* a quarter of a period after a cycle: at the upper end, in the middle of the contact */
  must(run.solve());
  Snapshot now;
  Motion   m;
  double   force, kinetic, potential;
  must(now.take(run.ts));
  must(now.motion(s.body, &m));
  must(now.value(Measure::force(s.stop, 0), &force));
  must(now.energy(&kinetic, &potential));
  EXPECT_NEAR(m.position(0), 1 + depth, 1e-4 * depth);
  EXPECT_NEAR(force, -law.stiffness * depth, 1e-3 * law.stiffness * depth);
  EXPECT_NEAR(kinetic + potential, 9, 1e-2); /* numerical damping takes 1.2e-3 */
}

/* A pendulum of 1 m stays between stops at +-0.3 rad, also after its angle has been counted over more than a turn */
TEST(Stops, AnArmStaysWithinItsAngles)
{
  Scene     s(PETSC_COMM_SELF);
  RigidBody b;
  b.position               = {0, -1, 0};
  b.angular_velocity       = {0, 0, 4};
  b.velocity               = {4, 0, 0};
  const Body   arm         = s.add("arm", b);
  const Marker i           = s.marker(arm, {0, 1, 0}), j = s.marker(s.ground());
  RotationalStop stop{i, j};
  stop.lower         = -0.5;
  stop.upper         = 2 * M_PI + 0.3;
  stop.law.stiffness = 1e5;
  stop.law.damping   = 10; /* strong damping, so that it does not rebound */
  s.add("pin", Revolute{i, j});
  s.add("stop", stop);
  s.channel("angle", Measure::angle(i, j));
  SceneRun run(s, 4, tolerance(1e-6));
  must(run.solve());
  std::vector<double> now;
  must(s.sample(run.ts, 4, now));
  EXPECT_GT(now[0], 2 * M_PI);
  EXPECT_LT(now[0], 2 * M_PI + 0.31);
}

/* A mass falls 1 m on a rope of 0.5 m: the largest tension follows from energy, and there is no force while the rope
   is slack */
TEST(Stops, ARopeHoldsAndIsSlack)
{
  Scene     s(PETSC_COMM_SELF);
  PointMass p;
  p.position = {0, 0, 0};
  const Body   b = s.add("bag", p);
  const Marker i = s.marker(b), j = s.marker(s.ground());
  DistanceStop rope{i, j};
  rope.upper         = 0.5;
  rope.law.stiffness = 4e3;
  rope.law.exponent  = 1;
  const Element r = s.add("rope", rope);
  s.gravity({0, 0, -9.81});
  s.channel("tension", Measure::force(r, 0));
  const double fall = std::sqrt(2 * 0.5 / 9.81), v = 9.81 * fall, omega = std::sqrt(4e3), sag = 9.81 / (omega * omega),
               most = sag + std::hypot(sag, v / omega), lowest = fall + (M_PI / 2 + std::atan2(sag, v / omega)) / omega; /* time and depth of the lowest point */
  SceneRun run(s, lowest, tolerance(1e-8));
  double   at_half = -1;
  must(TSSetMaxTime(run.ts, 0.5 * fall));
  must(run.solve());
  std::vector<double> now;
  must(s.sample(run.ts, 0.5 * fall, now));
  at_half = now[0];
  must(TSSetMaxTime(run.ts, lowest));
  must(run.solve());
  must(s.sample(run.ts, lowest, now));
  EXPECT_EQ(at_half, 0);
  MEASURED("tension %.9g, by energy %.9g", now[0], 4e3 * most);
  EXPECT_NEAR(now[0], 4e3 * most, 1e-3 * 4e3 * most);
}

/* The same load on the same stop, for any position of the marker from which the travel is measured */
TEST(Stops, ALoadOnAStopAnywhere)
{
  const double g = 9.81, k = 1e5;
  for (double limit : {0., 1., 10., 1000.}) {
    Scene        scene(PETSC_COMM_SELF);
    RigidBody    b;
    const Body   body = scene.add("body", b);
    const Marker i = scene.marker(body), j = scene.marker(scene.ground(), {0, 0, -limit});
    scene.gravity({0, 0, -g});
    scene.add("guide", Translational{i, j});
    TranslationalStop s{i, j};
    s.lower = limit;
    s.law   = {k, 1};
    scene.add("stop", s);
    scene.start().equilibrium = true;
    must(scene.setUp());
    EXPECT_NEAR(DataOf(scene).bodies[body.id].r(2), -g / k, 1e-6 * g / k + 1e-15 * limit) << limit;
  }
}

/* In a planar scene a stop without an axis acts along x_j, like Translational; here x_j points up, and the block rests
   on the stop */
TEST(Stops, WithoutAnAxisItIsAlongTheGuideInThePlane)
{
  const double g = 9.81, k = 1e5, height = 0.4;
  double       rests[3];
  for (int axis : {0, 2}) {
    Scene         scene(PETSC_COMM_SELF, Space::Planar);
    const Matrix3 up = Eigen::AngleAxisd(M_PI / 2, Vector3::UnitZ()).toRotationMatrix();
    RigidBody     b;
    b.mass            = 2;
    b.position        = {0.1, height, 0};
    const Body   body = scene.add("body", b);
    const Marker i = scene.markerAt(body, b.position, up), j = scene.marker(scene.ground(), {0.1, 0, 0}, up);
    scene.gravity({0, -g, 0});
    scene.add("guide", Translational{i, j});
    TranslationalStop s{i, j};
    s.lower = height;
    s.law   = {k, 1};
    if (axis == 0) s.axis = 0; /* otherwise the default axis */
    const Element stop = scene.add("stop", s);
    scene.start().equilibrium = true;
    TS       ts;
    Snapshot now;
    Load     load;
    must(scene.createTS(&ts));
    must(now.take(ts));
    must(now.load(stop, i, &load));
    must(TSDestroy(&ts));
    rests[axis] = DataOf(scene).bodies[body.id].r(1);
    EXPECT_NEAR(rests[axis], height - 2 * g / k, 1e-6 * g / k) << axis;
    EXPECT_NEAR(load.force(1), 2 * g, 1e-4 * g) << axis;
  }
  EXPECT_EQ(rests[0], rests[2]);
}

/* A mass flies towards a stop at a least distance of 0.5, past its centre at 0.3. Without other forces the steps would
   grow until one passes over the whole contact */
TEST(Stops, NothingFliesThroughALeastDistance)
{
  Vector3 gone[2];
  for (double limit : {0., 0.01}) {
    Scene     scene(PETSC_COMM_SELF);
    RigidBody b;
    b.mass            = 1;
    b.inertia         = 0.01 * Matrix3::Identity();
    b.position        = {-20, 0.3, 0};
    b.velocity        = {10, 0, 0};
    const Body   body = scene.add("body", b);
    const Marker i    = scene.marker(body);
    DistanceStop s{i, scene.marker(scene.ground())};
    s.lower = 0.5;
    s.law   = {1e4, 1};
    scene.add("stop", s);
    SceneRun run(scene, 4, "-ts_rtol 1e-6 -ts_atol 1e-6" + (limit > 0 ? " -ts_adapt_dt_max " + std::to_string(limit) : std::string()));
    must(run.solve());
    Snapshot now;
    Motion   x;
    must(now.take(run.ts));
    must(now.motion(i, &x));
    gone[limit > 0] = x.velocity;
  }
  EXPECT_GT(gone[1](1), 9);
  EXPECT_LT((gone[0] - gone[1]).norm(), 0.01);
}

TEST(Stops, Refuses)
{
  Slider     s(0, {});
  const auto bad = [&](auto spec) {
    std::string all;
    s.scene.add("it", spec);
    for (const std::string &e : DataOf(s.scene).errors) all += e + "\n";
    DataOf(s.scene).errors.clear();
    return all;
  };
  const auto says = [](const std::string &errors, const char *words) { EXPECT_NE(errors.find(words), std::string::npos) << "expected: " << words << "\ngot: " << errors; };
  RotationalStop r{s.i, s.j};
  says(bad(r), "neither lower nor upper is given");
  r.lower = 1, r.upper = -1;
  says(bad(r), "lower is 1 and upper -1");
  r.lower = std::nan("");
  says(bad(r), "must be numbers");
  TranslationalStop t{s.i, s.j};
  t.upper = 1;
  t.axis  = 3;
  says(bad(t), "axis is 3");
  t.axis         = 2;
  t.law.friction = 0.1;
  says(bad(t), "a stop has none");
  DistanceStop d{s.i, s.j};
  says(bad(d), "neither lower nor upper is given");
  d.lower = -1;
  says(bad(d), "a distance is not negative");
}
