/* User constraints given by expressions: derivatives, and runs compared with the library's joints and with closed
   equations of motion */
#include "hhtdae/query.h"
#include "kernel_checks.h"
#include "scene/kernels/user_constraint.h"
#include "scene_jacobian.h"
#include "scene_output.h"
#include <cmath>

using namespace hhtest;

namespace
{

using Argument = UserRow::Argument;

Argument reads(Measure::Kind kind, int i, int j, int frame = -1, int component = 0, int number = -1)
{
  Argument a;
  a.kind      = kind;
  a.component = component;
  a.marker[0] = i;
  a.marker[1] = j;
  a.marker[2] = frame;
  a.number    = number;
  a.reach     = 1;
  return a;
}

UserRowData row(std::vector<Argument> arguments, RealFunction<const Real *> f)
{
  auto       r = std::make_shared<UserRow>();
  Expression e;
  e.f = f;
  e.arguments.resize(arguments.size());
  r->f         = UserFunction("row", e);
  r->arguments = std::move(arguments);
  UserRowData d;
  d.row = r;
  return d;
}

/* keeps the angle of marker 0 about z of marker 1 well defined, with a count of some turns */
void angle(Random &random, Frame<double> *f, UserRowData &d)
{
  while (std::abs(f[0].R.col(0).dot(f[1].R.col(2))) > .9) f[0].R = random.rotation();
  d.memory[0] = 4 * kTurn;
  d.row->accept(f, d.memory);
}

Real positions(const Real *m) { return sin(m[0]) * m[1] + m[2] * m[2] * m[3] + exp(-m[4] * m[3]); }

UserRowData ofPositions(Random &random, Frame<double> *f)
{
  UserRowData d = row({reads(Measure::Angle, 0, 1, -1, 0, 0), reads(Measure::Displacement, 2, 3, 2, 1), reads(Measure::Distance, 0, 2), reads(Measure::Displacement, 1, -1, -1, 2),
                       reads(Measure::Time, -1, -1)},
                      positions);
  angle(random, f, d);
  return d;
}

Real velocities(const Real *m) { return m[0] * m[1] + sin(m[2]) * m[3] - m[4] * m[2] + m[5] * m[5] + 2 * m[6] - m[7]; }

UserRowData ofVelocities(Random &random, Frame<double> *f)
{
  UserRowData d = row({reads(Measure::Distance, 0, 3), reads(Measure::Velocity, 0, 1, 0, 1), reads(Measure::Angle, 0, 1, -1, 0, 0), reads(Measure::Rate, 2, 3),
                       reads(Measure::AngularVelocity, 1, -1, 3, 2), reads(Measure::Value, -1, -1, -1, 0, 0), reads(Measure::Velocity, 3, -1, -1, 0), reads(Measure::Time, -1, -1)},
                      velocities);
  angle(random, f, d);
  return d;
}

/* A bead that slides on the parabola y = x^2/2 under gravity */
struct Bead {
  Scene   scene;
  Body    bead;
  Marker  at, origin;
  Element wire;

  explicit Bead(double unit = 1) : scene(PETSC_COMM_SELF)
  {
    PointMass p;
    p.mass     = 2;
    p.position = unit * Vector3(1, 0.5, 0);
    bead       = scene.add("bead", p);
    at         = scene.marker(bead);
    origin     = scene.marker(scene.ground());
    wire       = scene.add("wire", UserConstraint{{Expression{{Measure::displacement(at, 0), Measure::displacement(at, 1)},
                                                              [=](const Real *m) { return m[1] * unit - 0.5 * m[0] * m[0]; }},
                                                   Expression{{Measure::displacement(at, 2)}, [](const Real *m) { return m[0]; }}}});
    scene.gravity({0, -9.81 * unit, 0});
  }
};

/* Integrates (1 + x^2) x'' + x x'^2 + g x = 0 by classical Runge-Kutta steps; x, x' at t, from x = 1 at rest */
void parabola(double t, double *x)
{
  const auto f = [](const double *y, double *d) {
    d[0] = y[1];
    d[1] = -y[0] * (y[1] * y[1] + 9.81) / (1 + y[0] * y[0]);
  };
  const int    n = 4000;
  const double h = t / n;
  x[0] = 1, x[1] = 0;
  for (int s = 0; s < n; s++) {
    double k[4][2], y[2];
    f(x, k[0]);
    for (int i = 1; i < 4; i++) {
      for (int c = 0; c < 2; c++) y[c] = x[c] + (i < 3 ? h / 2 : h) * k[i - 1][c];
      f(y, k[i]);
    }
    for (int c = 0; c < 2; c++) x[c] += h / 6 * (k[0][c] + 2 * k[1][c] + 2 * k[2][c] + k[3][c]);
  }
}

} // namespace

TEST(UserConstraint, DerivativesOfPositions) { CheckConstraint<UserPosition<4, UserRow::angles>>(ofPositions, 3); }
TEST(UserConstraint, DerivativesOfVelocities) { CheckVelocityConstraint<UserVelocity<4, UserRow::angles>>(ofVelocities, 4); }

TEST(UserConstraint, BeadOnAParabola)
{
  Bead b;
  b.scene.channel("force", Measure::jointForce(b.wire, 1));
  SceneRun run(b.scene, 2, tolerance(1e-9));
  must(run.solve());
  double x[2];
  parabola(2, x);
  Snapshot now;
  Motion   m;
  Load     l;
  double   multiplier;
  must(now.take(run.ts));
  must(now.motion(b.at, &m));
  must(now.load(b.wire, b.at, &l));
  must(now.value(Measure::multiplier(b.wire, 0), &multiplier));
  MEASURED("x = %.12g, by Runge and Kutta %.12g", m.position(0), x[0]);
  EXPECT_NEAR(m.position(0), x[0], 1e-5);
  EXPECT_NEAR(m.velocity(0), x[1], 2e-5);
  EXPECT_NEAR(m.position(1), m.position(0) * m.position(0) / 2, 1e-9);
  EXPECT_LT((l.force - 2 * (m.acceleration - Vector3(0, -9.81, 0))).norm(), 5e-6 * l.force.norm()) << "Newton, as far as the corrector goes";
  EXPECT_LT((l.force - multiplier * Vector3(-m.position(0), 1, 0)).norm(), 1e-9 * l.force.norm()) << "its multiplier times the derivatives of the row";
  std::vector<double> channel;
  must(b.scene.sample(run.ts, now.time(), channel));
  EXPECT_NEAR(channel[0], l.force(1), 1e-9 * l.force.norm());
}

/* A row in mm^2 has numbers a million times as large; a satisfied constraint must be recognized nevertheless */
TEST(UserConstraint, ItsUnitIsNoMisfit)
{
  for (double unit : {1., 1e3, 1e-3}) {
    Bead off(unit);
    off.scene.start().tolerance = 1e-6;
    DataOf(off.scene).bodies[0].r(1) += 1e-7 * unit;
    EXPECT_EQ(off.scene.setUp(), 0) << unit;
    Bead far(unit);
    DataOf(far.scene).bodies[0].r(1) += 1e-4 * unit;
    ErrorTrap error;
    EXPECT_NE(far.scene.setUp(), 0) << unit;
    EXPECT_TRUE(error.says("user constraint wire: not met")) << error.message;
    Bead moved(unit);
    DataOf(moved.scene).bodies[0].r += unit * Vector3(0.1, -0.2, 0.1);
    moved.scene.start().assembly = Assembly::Project;
    must(moved.scene.setUp());
    const Vector3 r = DataOf(moved.scene).bodies[0].r / unit;
    EXPECT_NEAR(r(1), r(0) * r(0) / 2, 1e-9);
  }
}

/* The same cam as a motion, over three turns: the angle is counted */
TEST(UserConstraint, CamOverManyTurns)
{
  Scene     s(PETSC_COMM_SELF, Space::Planar);
  RigidBody b;
  const Body shaft = s.add("shaft", b), follower = s.add("follower", b);
  const Marker hub = s.marker(shaft), bearing = s.marker(s.ground()), at = s.marker(follower), guide = s.marker(s.ground());
  s.add("axle", Revolute{hub, bearing});
  s.add("slide", Translational{at, guide});
  s.add("drive", RotationalMotion{hub, bearing, TimeFunction::polynomial({0, 1, 2})});
  s.add("cam", UserConstraint{{Expression{{Measure::displacement(at, 0), Measure::angle(hub, bearing)}, [](const Real *m) { return m[0] - 0.01 * m[1] * m[1]; }}}});
  s.start().assembly = Assembly::Project;
  SceneRun run(s, 3, tolerance(1e-6));
  must(run.solve());
  Snapshot now;
  Motion   m;
  must(now.take(run.ts));
  must(now.motion(at, &m));
  EXPECT_NEAR(m.position(0), 0.01 * 21 * 21, 1e-9);
}

/* A skate by a velocity-level row, compared with the library's knife edge */
TEST(UserConstraint, SkateAsKnifeEdge)
{
  Motion m[2];
  double side[2];
  for (int own = 0; own < 2; own++) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody b;
    b.velocity         = {1, 0, 0};
    b.angular_velocity = {0, 0, 0.7};
    const Body   skate = s.add("skate", b);
    const Marker i = s.marker(skate, {0.2, 0, 0}), j = s.marker(s.ground());
    DataOf(s).bodies[0].v(1) = -0.7 * 0.2; /* no velocity along y of the marker */
    s.add("floor", Planar{i, j});
    const Element edge = own ? s.add("edge", UserConstraint{{Expression{{Measure::velocity(i, 1, j, i)}, [](const Real *v) { return v[0]; }}}})
                             : s.add("edge", KnifeEdge{i, j});
    if (!own) s.start().redundant = Redundant::Drop; /* the plane of the floor is constrained twice */
    s.gravity({1, 0.5, 0});
    SceneRun run(s, 3, tolerance(1e-9));
    must(run.solve());
    Snapshot now;
    Load     l;
    must(now.take(run.ts));
    must(now.motion(i, &m[own]));
    must(now.load(edge, i, &l, i));
    side[own] = l.force(1);
    EXPECT_NEAR((m[own].axes.transpose() * m[own].velocity)(1), 0, 1e-8);
  }
  MEASURED("apart by %g after a way of %g", (m[0].position - m[1].position).norm(), m[0].position.norm());
  EXPECT_LT((m[0].position - m[1].position).norm(), 1e-6);
  EXPECT_NEAR(side[0], side[1], 1e-5 * std::abs(side[0]));
}

/* A velocity that follows a state, which is a first-order lag of the demanded velocity */
TEST(UserConstraint, SpeedFollowsAState)
{
  Scene     s(PETSC_COMM_SELF);
  PointMass p;
  const Body   b = s.add("slider", p);
  const Marker i = s.marker(b), j = s.marker(s.ground());
  const State  speed = s.state("speed", Expression{{}, [](const Real *) { return Real(1.); }}, 0);
  s.add("servo", UserConstraint{{Expression{{Measure::velocity(i, 0, j), Measure::value(speed)}, [](const Real *m) { return m[0] - m[1]; }}}});
  SceneRun run(s, 2, tolerance(1e-8));
  must(run.solve());
  Snapshot now;
  Motion   m;
  must(now.take(run.ts));
  must(now.motion(i, &m));
  EXPECT_NEAR(m.velocity(0), 2, 1e-8);
  EXPECT_NEAR(m.position(0), 2, 1e-5);
}

/* Two rows with the same meaning: one is redundant, however it is scaled */
TEST(UserConstraint, RowsThatSayTheSame)
{
  Bead b;
  b.scene.add("again", UserConstraint{{Expression{{Measure::displacement(b.at, 0), Measure::displacement(b.at, 1)}, [](const Real *m) { return 100 * m[1] - 50 * m[0] * m[0]; }}}});
  must(b.scene.setUp());
  EXPECT_EQ(DataOf(b.scene).started.redundant, 1);
}

TEST(UserConstraint, JacobianOfAScene)
{
  Scene     s(PETSC_COMM_SELF);
  RigidBody r;
  r.position     = {1, 0, 0};
  r.inertia      = Vector3(0.1, 0.2, 0.3).asDiagonal();
  const Body   a = s.add("a", r);
  r.position     = {0, 1, 0.5};
  const Body   b = s.add("b", r);
  const Marker i = s.marker(a, {0.1, 0.2, 0}), j = s.marker(b, {0.3, 0, 0}), k = s.marker(s.ground(), {0, 0, 1}), f = s.marker(b);
  const State  x = s.state("x", Measure::distance(i, j), 0.1);
  s.add("position", UserConstraint{{Expression{{Measure::distance(i, j), Measure::displacement(i, 1, k, f), Measure::time(), Measure::angle(i, f)},
                                               [](const Real *m) { return m[0] * m[1] - sin(m[2]) + m[3] * m[0]; }}}});
  s.add("velocity", UserConstraint{{Expression{{Measure::rate(i, k), Measure::angularVelocity(i, 2, j, f), Measure::displacement(j, 0), Measure::value(x)},
                                               [](const Real *m) { return m[0] * m[2] - m[1] + m[3] * m[3]; }}}});
  s.start().assembly = Assembly::Off;
  must(s.setUp());
  AnyState any(s, 5);
  EXPECT_LT(any.jacobianError(0, 0), 1e-5);
  EXPECT_LT(any.jacobianError(20, 400, .02), 1e-5);
}

/* An exception that is thrown after the first evaluation, during assembly or in a step, becomes an error with the name
   of the row */
TEST(UserConstraint, WhatThrowsLater)
{
  for (int good : {3, 40}) {
    Bead b;
    int  calls = 0;
    b.scene.add("moody", UserConstraint{{Expression{{Measure::velocity(b.at, 0)}, [&calls, good](const Real *m) -> Real {
                                                      if (++calls > good) throw std::runtime_error("no more");
                                                      return m[0];
                                                    }}}});
    ErrorTrap error;
    TS        ts = nullptr;
    PetscErrorCode failed = b.scene.setUp();
    if (!failed) failed = b.scene.createTS(&ts);
    if (!failed) failed = TSSetMaxTime(ts, 10);
    if (!failed) failed = b.scene.solve(ts);
    EXPECT_NE(failed, 0) << good;
    EXPECT_TRUE(error.says("user constraint moody, row 1: no more")) << error.message;
    TSDestroy(&ts);
  }
}

TEST(UserConstraint, Refuses)
{
  Bead       b;
  const auto bad = [&](const UserConstraint &c) {
    std::string all;
    b.scene.add("it", c);
    for (const std::string &e : DataOf(b.scene).errors) all += e + "\n";
    DataOf(b.scene).errors.clear();
    return all;
  };
  const auto one  = [&](std::vector<Measure> m, RealFunction<const Real *> f) { return bad(UserConstraint{{Expression{std::move(m), std::move(f)}}}); };
  const auto says = [](const std::string &errors, const char *words) { EXPECT_NE(errors.find(words), std::string::npos) << "expected: " << words << "\ngot: " << errors; };
  const auto same = [](const Real *m) { return m[0]; };
  const Variable v = b.scene.variable("v", Measure::time());
  says(bad({}), "user constraint it: it has no rows");
  says(one({Measure::displacement(b.at, 0)}, {}), "row 1: its function is empty");
  says(one({Measure::acceleration(b.at, 0)}, same), "argument 1 is acceleration: a constraint reads displacements");
  says(one({Measure::value(v)}, same), "a row of positions has no variables or states");
  says(one({Measure::time()}, same), "row 1 reads no marker of a body");
  says(one({Measure::displacement(b.origin, 0)}, same), "row 1 reads no marker of a body");
  says(one({Measure::displacement(Marker{99}, 0)}, same), "marker i is not one of this scene");
  Scene none(PETSC_COMM_SELF);
  none.add("it", UserConstraint{{Expression{{Measure::time()}, same}}});
  ASSERT_EQ(DataOf(none).errors.size(), 1u);
  says(DataOf(none).errors[0], "row 1 reads no marker of a body");
  says(one({Measure::velocity(b.at, 0)}, [](const Real *m) { return m[0] * m[0] - 1; }), "not linear in its velocities");
  says(one({Measure::velocity(b.at, 0), Measure::value(v)}, [](const Real *m) { return m[0] * m[1]; }), "not linear in its velocities");
  says(one({Measure::displacement(b.at, 0)}, [](const Real *m) { return log(m[0] - 2); }), "nan at the start, must be finite");
  says(one({Measure::displacement(b.at, 0)}, [](const Real *m) { return sqrt(m[0] - 1); }), "no finite derivatives");
  says(one({Measure::displacement(b.at, 0)}, [](const Real *) -> Real { throw std::runtime_error("no such table"); }), "row 1 has failed at the start: user constraint it, row 1: no such table");
  std::vector<Measure> many;
  for (int k = 0; k < 7; k++) many.push_back(Measure::distance(b.at, b.scene.marker(b.scene.ground(), Vector3(k, 1, 1))));
  says(one(many, same), "names 8 markers, at most 6");
}

/* z' = V, V = -2 z, from 0.1: consistent initial velocities follow from the definition of V, whatever its given
   initial value */
TEST(UserConstraint, StartVelocitiesByAVariable)
{
  for (Assembly how : {Assembly::Report, Assembly::Project})
    for (double initial : {0., -0.2}) {
      Scene     s(PETSC_COMM_SELF);
      PointMass m;
      m.position           = {0, 0, 0.1};
      m.velocity           = {0, 0, how == Assembly::Report ? -0.2 : 0};
      s.start().assembly   = how;
      const Body     b     = s.add("mass", m);
      const Marker   q     = s.marker(b);
      const Measure  z     = Measure::displacement(q, 2);
      s.add("line", InLine{q, s.marker(s.ground())});
      const Variable v = s.variable("speed", Expression({z}, [](const Real *x) { return -2 * x[0]; }), initial);
      s.add("row", UserConstraint{{Expression({Measure::velocity(q, 2), Measure::value(v)}, [](const Real *x) { return x[0] - x[1]; })}});
      SceneRun run(s, 1, tolerance(1e-7));
      Snapshot now;
      double   x;
      must(run.solve());
      must(now.take(run.ts, 1));
      must(now.value(z, &x));
      EXPECT_NEAR(x, 0.1 * std::exp(-2), 1e-5) << initial;
    }
}

/* Derivatives that are NaN at the trial state do not let a row be taken for a linear one */
TEST(UserConstraint, NoNumberIsNotLinear)
{
  const UserRowData d = row({reads(Measure::Velocity, 0, 1)}, [](const Real *m) { return pow(m[0], 1.5); });
  Random            random(1);
  Frame<double>     f[2];
  Twist<double>     w[2];
  for (int k = 0; k < 2; k++) {
    f[k] = {random.vector(), random.rotation()};
    w[k] = {Vector3::Zero(), Vector3::Zero()};
  }
  EXPECT_FALSE(d.row->linear({f, w, 0, nullptr, d.memory}));
}
