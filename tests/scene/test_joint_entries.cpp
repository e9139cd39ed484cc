/* Joints in a scene: numbers of rows, which input is refused with which message, and runs with known solutions */
#include "scene/runtime.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

using namespace hhtdae;

namespace
{

Matrix3 About(const Vector3 &axis, double angle)
{
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

/* two rigid bodies beside the ground, a point mass, and markers */
struct Fixture {
  Scene  scene;
  Body   body, point;
  Marker i, j, beside, bead;

  explicit Fixture(Space space = Space::Spatial) : scene(PETSC_COMM_SELF, space)
  {
    RigidBody b;
    b.position = {2, .5, 0};
    body       = scene.add("block", b);
    point      = scene.add("bead", PointMass{});
    i          = scene.marker(body);
    j          = scene.marker(scene.ground());
    beside     = scene.marker(body, {0, 1, 0});
    bead       = scene.marker(point);
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

template <class Spec>
std::string Errors(const std::function<void(Fixture &, Spec &)> &change, Space space = Space::Spatial)
{
  Fixture f(space);
  Spec    s;
  s.i = f.i;
  s.j = f.j;
  change(f, s);
  return f.errors(s);
}

void ExpectSays(const std::string &errors, const std::string &words)
{
  EXPECT_NE(errors.find(words), std::string::npos) << "expected: " << words << "\ngot: " << errors;
}

/* Numbers of holonomic and velocity-level rows of the joint; -1 where the joint is refused */
struct Rows {
  int position, velocity;
};
bool          operator==(Rows a, Rows b) { return a.position == b.position && a.velocity == b.velocity; }
std::ostream &operator<<(std::ostream &o, Rows r)
{
  return o << r.position << " holonomic, " << r.velocity << " velocity-level rows";
}
constexpr Rows kRefused{-1, -1};

template <class Spec> Rows RowsOf(Spec s, Space space)
{
  Fixture f(space);
  Rows    rows{0, 0};
  s.i             = f.i;
  s.j             = f.j;
  const Element e = f.scene.add("it", s);
  if (!DataOf(f.scene).errors.empty()) return kRefused;
  for (const Part &p : DataOf(f.scene).elements[e.id].parts)
    (p.store->isHolonomic() ? rows.position : rows.velocity) += p.store->rows();
  return rows;
}
template <class Spec> void ExpectRows(const Spec &s, Rows spatial, Rows planar = kRefused)
{
  EXPECT_EQ(RowsOf(s, Space::Spatial), spatial);
  EXPECT_EQ(RowsOf(s, Space::Planar), planar);
}

PointOnCurve Line()
{
  PointOnCurve s;
  s.points = {{0, 0, 0}, {1, 0, 0}, {2, 1, 0}};
  return s;
}

} // namespace

TEST(JointEntries, Rows)
{
  ExpectRows(Spherical{}, {3, 0});
  ExpectRows(Revolute{}, {5, 0}, {2, 0});
  ExpectRows(Universal{}, {4, 0});
  ExpectRows(ConstantVelocity{}, {4, 0});
  ExpectRows(Translational{}, {5, 0}, {2, 0});
  ExpectRows(Cylindrical{}, {4, 0});
  ExpectRows(Planar{}, {3, 0});
  ExpectRows(Fixed{}, {6, 0}, {3, 0});
  ExpectRows(InLine{}, {2, 0});
  ExpectRows(InPlane{}, {1, 0});
  ExpectRows(ParallelAxes{}, {2, 0});
  ExpectRows(Perpendicular{}, {1, 0});
  ExpectRows(Orientation{}, {3, 0});
  ExpectRows(PointDistance{}, {1, 0}, {1, 0});
  ExpectRows(Line(), {2, 0}, {1, 0});
  ExpectRows(RollingSphere{}, {1, 2});
  ExpectRows(KnifeEdge{}, {1, 1});
  ExpectRows(hhtdae::RollingDisc{}, kRefused, {1, 1}); /* refused in space, where the disc would lie flat */
}

TEST(JointEntries, RefuseOneBodyAndPointMasses)
{
  ExpectSays(Errors<Revolute>([](Fixture &f, Revolute &s) { s.j = f.beside; }),
             "revolute it: both markers are on block, must be on two bodies");
  ExpectSays(Errors<Spherical>([](Fixture &f, Spherical &s) { s.i = f.scene.marker(f.scene.ground()); }),
             "both markers are on ground");
  ExpectSays(Errors<Revolute>([](Fixture &f, Revolute &s) { s.i = f.bead; }),
             "marker i is on the point mass bead, must be on a rigid");
  ExpectSays(Errors<InPlane>([](Fixture &f, InPlane &s) { s.j = f.bead; }), "marker j is on the point mass bead");
  EXPECT_EQ(Errors<InPlane>([](Fixture &f, InPlane &s) { s.i = f.bead; }), "");
  EXPECT_EQ(Errors<Spherical>([](Fixture &f, Spherical &s) { s.i = f.bead; }), "");
  ExpectSays(Errors<Universal>([](Fixture &, Universal &s) { s.j = Marker{}; }),
             "marker j is not a marker of this scene");
  ExpectSays(Errors<Cylindrical>([](Fixture &, Cylindrical &) {}, Space::Planar),
             "cylindrical it: not for planar scenes");
}

TEST(JointEntries, RefuseNumbers)
{
  const auto distance = [](double length) {
    return Errors<PointDistance>([=](Fixture &, PointDistance &s) { s.length = length; });
  };
  EXPECT_EQ(distance(1.5), "");
  EXPECT_EQ(distance(-1), "");
  ExpectSays(distance(0), "point distance it: length is 0, must be positive and finite");
  ExpectSays(distance(NAN), "length is nan");
  ExpectSays(distance(INFINITY), "length is inf");
  ExpectSays(Errors<PointDistance>([](Fixture &f, PointDistance &s) {
               s.j = f.scene.marker(f.scene.ground(), {2, .5, 0});
             }),
             "the markers coincide at the start");
  ExpectSays(Errors<RollingSphere>([](Fixture &, RollingSphere &s) { s.radius = -1; }),
             "radius is -1, must be positive");
  ExpectSays(Errors<hhtdae::RollingDisc>([](Fixture &, hhtdae::RollingDisc &s) { s.radius = 0; }), "radius is 0");
  ExpectSays(Errors<hhtdae::RollingDisc>([](Fixture &, hhtdae::RollingDisc &) {}), "the disc lies flat on the plane");
  const auto upright = [](Fixture &f) { return f.scene.marker(f.body, {0, 0, 0}, About(Vector3::UnitX(), M_PI / 2)); };
  EXPECT_EQ(Errors<hhtdae::RollingDisc>([&](Fixture &f, hhtdae::RollingDisc &s) { s.i = upright(f); }), "");
  ExpectSays(Errors<KnifeEdge>([&](Fixture &f, KnifeEdge &s) { s.i = upright(f); }), "y_i is normal to the plane");
  ExpectSays(Errors<PointOnCurve>([](Fixture &, PointOnCurve &) {}), "point on curve it: the curve has 0 points");
}

/* ---- runs ---- */

namespace
{

constexpr double g = 9.81;

/* positions of the bodies of a scene at time T */
struct Final {
  Scene                  &scene;
  std::vector<BodyMotion> bodies;

  Final(Scene &s, double T, double tolerance = 1e-9) : scene(s), bodies(DataOf(s).bodies.size())
  {
    EXPECT_EQ(run(T, tolerance), 0);
  }
  const BodyMotion &operator[](Body b) const { return bodies[b.id]; }

  PetscErrorCode run(double T, double tolerance)
  {
    TS                 ts;
    Vec                U, V;
    const PetscScalar *u, *v;
    PetscFunctionBegin;
    PetscCall(scene.createTS(&ts));
    PetscCall(TSSetMaxTime(ts, T));
    PetscCall(TSSetTimeStep(ts, 1e-3));
    PetscCall(TSSetTolerances(ts, tolerance, nullptr, tolerance, nullptr));
    PetscCall(scene.solve(ts));
    PetscCall(TS2GetSolution(ts, &U, &V));
    PetscCall(VecGetArrayRead(U, &u));
    PetscCall(VecGetArrayRead(V, &v));
    Runtime &R = *RunOf(ts);
    R.bodies.move(u, v);
    for (std::size_t b = 0; b < bodies.size(); b++) bodies[b] = R.bodies.now[R.local_body[b]];
    PetscCall(VecRestoreArrayRead(U, &u));
    PetscCall(VecRestoreArrayRead(V, &v));
    PetscCall(TSDestroy(&ts));
    PetscFunctionReturn(0);
  }
};

} // namespace

/* A ball on an incline: acceleration 5/7 g sin a, on either side of the plane's marker */
TEST(JointRuns, BallOnAnIncline)
{
  const double a = .3, r = .2, T = .8;
  for (double side : {1., -1.}) {
    Scene     scene(PETSC_COMM_SELF);
    RigidBody b;
    b.mass             = 3;
    b.inertia          = .4 * b.mass * r * r * Matrix3::Identity();
    b.rotation         = About({1, 2, 3}, 1);
    const Matrix3 R    = About(Vector3::UnitY(), a);
    b.position         = R * Vector3(0, 0, r);
    const Body    ball = scene.add("ball", b);
    const Matrix3 flip = side > 0 ? Matrix3::Identity() : About(Vector3::UnitX(), M_PI);
    scene.add("rolls", RollingSphere{scene.marker(ball), scene.marker(scene.ground(), {0, 0, 0}, R * flip), r});
    scene.gravity({0, 0, -g});
    const Final  end(scene, T);
    const double s = .5 * 5. / 7. * g * std::sin(a) * T * T;
    EXPECT_LT((end[ball].r - b.position - s * R.col(0)).norm(), 1e-5);
    EXPECT_LT((end[ball].w - 2 * s / (T * r) * Vector3::UnitY()).norm(), 1e-4);
  }
}

/* A wheel rolls down an incline with 2/3 g sin a, as a disc in space and in a planar scene */
TEST(JointRuns, WheelOnAnIncline)
{
  const double a = .3, r = .5, T = .8, mass = 2, s = .5 * 2. / 3. * g * std::sin(a) * T * T;
  for (Space space : {Space::Spatial, Space::Planar}) {
    const bool planar = space == Space::Planar;
    Scene      scene(PETSC_COMM_SELF, space);
    RigidBody  b;
    b.mass               = mass;
    b.inertia            = mass * r * r * Vector3(.25, .25, .5).asDiagonal();
    const Matrix3 R      = planar ? About(Vector3::UnitZ(), -a) : About(Vector3::UnitY(), a);
    const Vector3 normal = planar ? R.col(1) : R.col(2), axis = planar ? R.col(2) : R.col(1);
    b.rotation       = planar ? Matrix3(Matrix3::Identity()) : About(Vector3::UnitX(), -M_PI / 2); /* z_i is along y */
    b.position       = r * normal;
    const Body wheel = scene.add("wheel", b);
    scene.add("rolls", hhtdae::RollingDisc{scene.marker(wheel), scene.marker(scene.ground(), {0, 0, 0}, R), r});
    scene.gravity(planar ? Vector3(0, -g, 0) : Vector3(0, 0, -g));
    const Final end(scene, T);
    EXPECT_LT((end[wheel].r - b.position - s * R.col(0)).norm(), 1e-5);
    EXPECT_LT((end[wheel].w - (planar ? -1 : 1) * 2 * s / (T * r) * axis).norm(), 1e-4);
  }
}

/* A skate on an incline with spin w does not go down, but draws cycloids: from rest with its edge downhill, and k = g
   sin a / w^2, k/2 sin(w t)^2 down and k/2 (w t - sin(2 w t)/2) across (Neimark and Fufaev, Dynamics of Nonholonomic
   Systems) */
TEST(JointRuns, SkateOnAnIncline)
{
  const double  a = .3, w = 2, T = 1, k = g * std::sin(a) / (w * w);
  Scene         scene(PETSC_COMM_SELF);
  RigidBody     b;
  const Matrix3 R    = About(Vector3::UnitY(), a); /* x down the incline */
  b.rotation         = R;
  b.angular_velocity = w * R.col(2);
  const Body   skate = scene.add("skate", b);
  const Marker i = scene.marker(skate), j = scene.marker(scene.ground(), {0, 0, 0}, R);
  scene.add("edge", KnifeEdge{i, j});
  scene.add("upright", ParallelAxes{i, j});
  scene.gravity({0, 0, -g});
  const Final   end(scene, T);
  const Vector3 at = R.transpose() * end[skate].r;
  EXPECT_NEAR(at(0), k / 2 * std::pow(std::sin(w * T), 2), 1e-5);
  EXPECT_NEAR(at(1), k / 2 * (w * T - std::sin(2 * w * T) / 2), 1e-5);
  EXPECT_NEAR(at(2), 0, 1e-10);
}

/* A bead on a helix of radius r and slope tan(p): s = g sin(p) t^2 / 2 along the wire */
TEST(JointRuns, BeadOnAHelix)
{
  const double r = 1, p = .5, T = 1, per = r / std::cos(p); /* length per angle */
  Scene        scene(PETSC_COMM_SELF);
  PointMass    m;
  PointOnCurve wire;
  const auto   helix = [&](double angle) {
    return Vector3(r * std::cos(angle), r * std::sin(angle), -r * std::tan(p) * angle);
  };
  for (int k = -20; k <= 100; k++) wire.points.push_back(helix(.05 * k));
  m.position      = helix(0);
  const Body bead = scene.add("bead", m);
  wire.i          = scene.marker(bead);
  wire.j          = scene.marker(scene.ground());
  scene.add("wire", wire);
  scene.gravity({0, 0, -g});
  const Final end(scene, T);
  EXPECT_LT((end[bead].r - helix(.5 * g * std::sin(p) * T * T / per)).norm(), 2e-5);
}

/* A bead moves round a closed curve in the plane several times; its energy is constant */
TEST(JointRuns, BeadRoundACircleInThePlane)
{
  const double v0 = 7, T = 3;
  Scene        scene(PETSC_COMM_SELF, Space::Planar);
  PointMass    m;
  PointOnCurve wire;
  wire.closed = true;
  for (int k = 0; k < 60; k++) wire.points.push_back({std::cos(2 * M_PI * k / 60), std::sin(2 * M_PI * k / 60), 0});
  m.position      = {1, 0, 0};
  m.velocity      = {0, v0, 0};
  const Body bead = scene.add("bead", m);
  wire.i          = scene.marker(bead);
  wire.j          = scene.marker(scene.ground());
  scene.add("wire", wire);
  scene.gravity({0, -g, 0});
  const Final end(scene, T, 1e-7);
  EXPECT_NEAR(end[bead].r.norm(), 1, 1e-5);
  EXPECT_NEAR(.5 * end[bead].v.squaredNorm() + g * end[bead].r(1), .5 * v0 * v0, .02);
}

/* Two shafts bent by b, both held in their directions: a constant-velocity joint keeps their speeds equal; over a
   universal joint, arm of the first shaft normal to both at phi = 0, the second one has w2/w1 = cos b / (1 - sin(b)^2
   sin(phi)^2) */
TEST(JointRuns, BentShafts)
{
  const double bend = .6, w = 3, T = .7;
  for (bool universal : {false, true}) {
    Scene         scene(PETSC_COMM_SELF);
    RigidBody     drive, driven;
    const Matrix3 B         = About(Vector3::UnitX(), bend);
    drive.angular_velocity  = w * Vector3::UnitZ();
    driven.inertia          = Vector3(1, 1, .5).asDiagonal();
    driven.rotation         = B;
    driven.angular_velocity = w * (universal ? std::cos(bend) : 1) * B.col(2);
    const Body one = scene.add("drive", drive), two = scene.add("driven", driven);
    scene.add("bearing", Revolute{scene.marker(one), scene.marker(scene.ground())});
    scene.add("direction", ParallelAxes{scene.marker(two), scene.marker(scene.ground(), {0, 0, 0}, B)});
    const Matrix3 y_as_z = About(Vector3::UnitX(), -M_PI / 2),
                  x_as_z = About(Vector3::UnitY(), M_PI / 2); /* arms of the cross */
    if (universal)
      scene.add("joint", Universal{scene.marker(two, {0, 0, 0}, y_as_z), scene.marker(one, {0, 0, 0}, x_as_z)});
    else
      scene.add("joint", ConstantVelocity{scene.marker(two), scene.marker(one)});
    const Final   end(scene, T);
    const Matrix3 A   = end[one].A;
    const double  phi = std::atan2(A(1, 0), A(0, 0)), s = std::sin(bend) * std::sin(phi);
    const double  ratio = universal ? std::cos(bend) / (1 - s * s) : 1;
    EXPECT_GT(phi, 1);
    EXPECT_NEAR(end[two].w.dot(B.col(2)), end[one].w(2) * ratio, 1e-5);
    /* without friction the energy of both stays: of the first 1/2 w1^2, of the second 1/2 (1/2) w2^2 */
    const double w2 = universal ? w * std::cos(bend) : w;
    EXPECT_NEAR(end[one].w.squaredNorm() + .5 * end[two].w.squaredNorm(), w * w + .5 * w2 * w2, 1e-4);
  }
}

/* ---- two bodies in free flight, connected by each joint in turn: momentum, angular momentum and energy are constant ---- */

namespace
{

struct Totals {
  Vector3 linear = Vector3::Zero(), angular = Vector3::Zero();
  double  energy = 0;
  void    add(const RigidBody &b, const Vector3 &r, const Matrix3 &A, const Vector3 &v, const Vector3 &w)
  {
    const Vector3 spin = A * (b.inertia * (A.transpose() * w));
    linear += b.mass * v;
    angular += b.mass * r.cross(v) + spin;
    energy += .5 * b.mass * v.squaredNorm() + .5 * w.dot(spin);
  }
};

/* Initially the bodies move as one rigid body, which every joint permits: marker i is at `offset` in j's axes and
   rotated by `turn` in them */
template <class Spec>
void FlyTogether(Spec s, const Vector3 &offset = {0, 0, 0}, const Matrix3 &turn = Matrix3::Identity(),
                 Space space = Space::Spatial)
{
  const bool    planar = space == Space::Planar;
  const double  out    = planar ? 0 : 1; /* 0 in the plane, where out-of-plane components must vanish */
  Scene         scene(PETSC_COMM_SELF, space);
  RigidBody     part[2];
  Body          body[2];
  Totals        before, behind;
  const Vector3 spin(out, -2 * out, 1.5), drift(.3, .2, -.1 * out), joint(.4, .1, -.3 * out);
  const Matrix3 axes = planar ? About(Vector3::UnitZ(), .9) : About({2, -1, 1}, .9);
  for (int k = 0; k < 2; k++) {
    RigidBody &b       = part[k];
    b.mass             = 1 + k;
    b.inertia          = Vector3(.5, .7 + .2 * k, .8).asDiagonal();
    b.position         = k == 0 ? Vector3(1, .2, .3 * out) : Vector3(-.4, -.3, .1 * out);
    b.rotation         = About({out, out * k, .5}, .7 + k);
    b.angular_velocity = spin;
    b.velocity         = drift + spin.cross(b.position);
    before.add(b, b.position, b.rotation, b.velocity, b.angular_velocity);
    body[k] = scene.add(k == 0 ? "first" : "second", b);
  }
  s.j = scene.markerAt(body[1], joint, axes);
  s.i = scene.markerAt(body[0], joint + axes * offset, axes * turn);
  scene.add("joint", s);
  const Final end(scene, .5);
  for (int k = 0; k < 2; k++) behind.add(part[k], end[body[k]].r, end[body[k]].A, end[body[k]].v, end[body[k]].w);
  SCOPED_TRACE(DataOf(scene).elements[0].type);
  EXPECT_LT((behind.linear - before.linear).norm(), 1e-9);
  EXPECT_LT((behind.angular - before.angular).norm(), 2e-5);
  EXPECT_NEAR(behind.energy, before.energy, 2e-5);
}

} // namespace

TEST(JointRuns, JointsKeepMomentumAndEnergy)
{
  FlyTogether(Spherical{});
  FlyTogether(Revolute{});
  FlyTogether(ConstantVelocity{}, {0, 0, 0}, About(Vector3::UnitX(), .8));
  FlyTogether(Translational{}, {0, 0, .2});
  FlyTogether(Cylindrical{}, {0, 0, .2}, About(Vector3::UnitZ(), 1));
  FlyTogether(Planar{}, {.3, .2, 0}, About(Vector3::UnitZ(), 1));
  FlyTogether(Fixed{});
  FlyTogether(Universal{}, {0, 0, 0}, About(Vector3::UnitX(), M_PI / 2));
}

TEST(JointRuns, PrimitivesKeepMomentumAndEnergy)
{
  FlyTogether(InLine{}, {0, 0, .2}, About({1, 2, 3}, 1));
  FlyTogether(InPlane{}, {.3, .2, 0}, About({1, 2, 3}, 1));
  FlyTogether(ParallelAxes{}, {.3, .2, .1}, About(Vector3::UnitZ(), 1));
  FlyTogether(Perpendicular{}, {.3, .2, .1}, About(Vector3::UnitX(), M_PI / 2));
  FlyTogether(Orientation{}, {.3, .2, .1});
  FlyTogether(PointDistance{}, {.3, .2, .1}, About({1, 2, 3}, 1));
  PointOnCurve wire;
  wire.points = {{-1, 0, 0}, {-.4, .3, -.1}, {0, 0, 0}, {.5, -.1, .3}, {1, .4, .2}};
  FlyTogether(wire, {0, 0, 0}, About({1, 2, 3}, 1));
}

TEST(JointRuns, RollingKeepsMomentumAndEnergy)
{
  FlyTogether(RollingSphere{{}, {}, .3}, {.2, .1, .3}, About({1, 2, 3}, 1));
  FlyTogether(RollingSphere{{}, {}, .3}, {.2, .1, -.3}, About({1, 2, 3}, 1));
  FlyTogether(hhtdae::RollingDisc{{}, {}, .3}, {.2, .1, .3 * std::cos(.2)}, About(Vector3::UnitX(), M_PI / 2 + .2));
  FlyTogether(KnifeEdge{}, {.2, .1, 0}, About(Vector3::UnitX(), .4));
}

/* A coin released at half a radian from upright. A disc lying flat has no lowest point: the run ends with an error
   before, with the energy of its start */
TEST(JointRuns, ADiscThatFallsFlat)
{
  for (const char *tolerance : {"-ts_rtol 1e-4 -ts_atol 1e-4", "-ts_rtol 1e-6 -ts_atol 1e-6", "-ts_rtol 1e-8 -ts_atol 1e-8"}) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody coin;
    const double radius = .1, lean = .5;
    coin.inertia  = Vector3(.0025, .0025, .005).asDiagonal();
    coin.position = {0, 0, radius * std::cos(lean)};
    coin.rotation = About(Vector3::UnitX(), M_PI / 2 + lean);
    const Body b  = s.add("coin", coin);
    s.gravity({0, 0, -9.81});
    s.add("table", hhtdae::RollingDisc{s.marker(b), s.marker(s.ground()), radius});
    s.channel("energy", Expression{{Measure::kineticEnergy(), Measure::potentialEnergy()}, [](const Real *m) { return m[0] + m[1]; }});
    SceneRun run(s, 1, tolerance);
    ErrorTrap trap;
    EXPECT_NE(run.solve(), 0) << tolerance;
    EXPECT_TRUE(trap.says("rolling disc table")) << trap.message;
    EXPECT_TRUE(trap.says("the disc falls flat on the plane")) << trap.message;
    PetscReal           t;
    std::vector<double> energy;
    must(TSGetTime(run.ts, &t));
    EXPECT_GT(t, .1);
    EXPECT_LT(t, .22);
    must(s.sample(run.ts, t, energy));
    EXPECT_NEAR(energy[0], 9.81 * radius * std::cos(lean), .05) << tolerance;
  }
}

/* A bob on a link of 1 m is drawn along x to where the link does not reach, beside another bob that swings: the error
   names the one that is stuck */
TEST(JointRuns, AMotionBeyondReach)
{
  Scene      s(PETSC_COMM_SELF, Space::Planar);
  const auto hung = [&](const std::string &name, double x) {
    RigidBody b;
    b.position   = {x, -std::sqrt(1 - x * x), 0};
    const Body   bob = s.add(name, b);
    const Marker end = s.marker(bob), pin = s.marker(s.ground());
    s.add("link of " + name, PointDistance{end, pin, 1});
    return end;
  };
  hung("free", .5);
  s.add("draw", TranslationalMotion{hung("drawn", .8), s.marker(s.ground()), TimeFunction::polynomial({.8, .5, .7}), MotionOf::Displacement, 0});
  s.start().assembly = Assembly::Project;
  s.gravity({0, -9.81, 0});
  SceneRun  run(s, 1, "-ts_rtol 1e-6 -ts_atol 1e-6");
  ErrorTrap trap;
  EXPECT_NE(run.solve(), 0);
  PetscReal t;
  must(TSGetTime(run.ts, &t));
  EXPECT_NEAR(t, (std::sqrt(.25 + 4 * .7 * .2) - .5) / 1.4, 1e-3);
  EXPECT_TRUE(trap.says("most of it in unknown") && trap.says("of body drawn")) << trap.message;
}

TEST(JointRuns, PlanarJointsKeepMomentumAndEnergy)
{
  const Matrix3 none = Matrix3::Identity(), turn = About(Vector3::UnitZ(), 1);
  FlyTogether(Revolute{}, {0, 0, 0}, turn, Space::Planar);
  FlyTogether(Translational{}, {.3, 0, 0}, none, Space::Planar);
  FlyTogether(Fixed{}, {0, 0, 0}, none, Space::Planar);
  FlyTogether(PointDistance{}, {.3, .2, 0}, turn, Space::Planar);
  FlyTogether(hhtdae::RollingDisc{{}, {}, .3}, {.2, .3, 0}, turn, Space::Planar);
  PointOnCurve wire;
  wire.points = {{-1, 0, 0}, {-.4, .3, 0}, {0, 0, 0}, {.5, -.1, 0}, {1, .4, 0}};
  FlyTogether(wire, {0, 0, 0}, turn, Space::Planar);
}
