/* Small motions about states that move: differences of two runs, single freedoms at any speed, steady motions */
#include "hhtdae/helpers.h"
#include "hhtdae/linearize.h"
#include "scene_output.h"
#include "small_motions.h"
#include <Eigen/LU>
#include <algorithm>

using namespace hhtest;

/* Two runs with slightly different initial values, at any time of any motion: their difference in space axes satisfies
   M x'' + C x' + K x = 0, because no external force acts that is not in the linearization. Rotations: x' = dw + w x x,
   x'' = da + a x x + w x x' */
TEST(Linearize, DifferenceOfTwoTumblingRuns)
{
  constexpr double apart = 1e-6, end = 0.3, inside = end - 1e-5;
  for (double spin : {1., 7.}) {
    Linearization small;
    Motion        motion[2];
    TS            first = nullptr;
    for (int run = 0; run < 2; run++) {
      Scene     scene(PETSC_COMM_SELF);
      RigidBody b        = body(2, {0.3, 0.5, 0.7}, Vector3(1, 2, 3) + run * apart * Vector3(1, -2, 0.5));
      b.rotation         = Eigen::AngleAxisd(run * apart, Vector3(2, 1, -1).normalized()).toRotationMatrix() * Eigen::AngleAxisd(0.9, Vector3(1, 1, 2).normalized()).toRotationMatrix();
      b.velocity         = Vector3(0.3, -0.2, 0.1) + run * apart * Vector3(0.5, 1, 2);
      b.angular_velocity = spin * Vector3(1, -0.5, 0.8) + run * apart * Vector3(-1, 3, 0.7);
      const Body one     = scene.add("one", b);
      scene.add("spring", SpringDamper{scene.marker(one, {0.2, 0.1, -0.3}), scene.marker(scene.ground(), {3, 1, 2}), 40, 0.5, 1});
      SceneRun ts(scene, end, tolerance(1e-7));
      Snapshot now;
      must(ts.solve());
      must(now.take(ts.ts, inside)); /* not at the end of the step, so that accelerations are solved for */
      must(now.motion(one, &motion[run]));
      if (run) continue;
      must(small.take(ts.ts, inside));
      must(PetscObjectReference((PetscObject)ts.ts));
      first = ts.ts;
    }
    const Motion &p = motion[0], &q = motion[1];
    const Eigen::AngleAxisd turn(Matrix3(q.axes * p.axes.transpose()));
    Eigen::Matrix<double, 6, 1> x[3];
    const Vector3 theta = turn.angle() * turn.axis(), rate = q.angular_velocity - p.angular_velocity + p.angular_velocity.cross(theta);
    x[0] << q.position - p.position, theta;
    x[1] << q.velocity - p.velocity, rate;
    x[2] << q.acceleration - p.acceleration, q.angular_acceleration - p.angular_acceleration + p.angular_acceleration.cross(theta) + p.angular_velocity.cross(rate);
    Mat part[3]; /* M, C, K */
    must(small.operators(&part[0], &part[1], &part[2]));
    Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
    double                      size = 0;
    for (int k = 0; k < 3; k++) {
      Vec in, out;
      must(MatCreateVecs(part[k], &in, &out));
      for (int i = 0; i < 6; i++) must(VecSetValue(in, i, x[2 - k](i), INSERT_VALUES));
      must(VecAssemblyBegin(in));
      must(VecAssemblyEnd(in));
      must(MatMult(part[k], in, out));
      const Array y = whole(out);
      for (int i = 0; i < 6; i++) {
        sum(i) += y[i];
        widen(size, std::abs(y[i]));
      }
      must(VecDestroy(&in));
      must(VecDestroy(&out));
    }
    EXPECT_GT(size, apart);
    EXPECT_LT(sum.norm(), 1e-4 * size) << spin << ": " << sum.transpose() << " of " << size;
    must(TSDestroy(&first));
  }
}

/* With a single degree of freedom the minimal coordinate is the arc length in the metric of the masses, s'' = -dV/ds -
   c s', at any speed: a rod at rest in a raised position, a swinging and a rotating one, although no such state is
   steady */
TEST(Linearize, APendulumThatSwings)
{
  constexpr double mass = 2, half = 0.7, J = 0.4 + mass * half * half, g = 9.81, damping = 0.8;
  for (Space kind : {Space::Planar, Space::Spatial})
    for (Rotations rotations : {Rotations::Local, Rotations::Euler313})
      for (double speed : {0., 3., -20.}) {
        const double angle = 1.1;
        Scene        scene(PETSC_COMM_SELF, kind);
        RigidBody    b     = body(mass, {0.4, 0.1, 0.4}, half * Vector3(std::sin(angle), -std::cos(angle), 0));
        b.rotation         = Eigen::AngleAxisd(angle, Vector3::UnitZ()).toRotationMatrix();
        b.angular_velocity = {0, 0, speed};
        b.velocity         = b.angular_velocity.cross(b.position);
        scene.start().rotations = rotations;
        scene.gravity({0, -g, 0});
        const Body   rod = scene.add("rod", b);
        const Marker pin = scene.marker(rod, {0, half, 0}), ground = scene.marker(scene.ground());
        scene.add("pin", Revolute{pin, ground});
        scene.add("damper", TorsionalSpringDamper{pin, ground, 0, damping, 0});
        const Started start(scene);
        for (const Mode &mode : start.modes()) {
          const Complex s = mode.value;
          EXPECT_LT(std::abs(J * s * s + damping * s + mass * g * half * std::cos(angle)), 1e-6) << speed << " " << s;
        }
      }
}

/* The same for a slider-crank, whose energies are known functions of the crank's angle */
TEST(Linearize, ASliderCrankAtSpeed)
{
  constexpr double r = 0.3, l = 0.8, m1 = 1, m2 = 2, m3 = 1.5, J1 = 0.02, J2 = 0.15, stiffness = 300, g = 9.81;
  const auto       at = [&](double a, double *inertia) { /* potential energy, and kinetic energy for unit angular velocity */
    const double b = std::asin(r * std::sin(a) / l), db = r * std::cos(a) / (l * std::cos(b)), x = r * std::cos(a) + l * std::cos(b);
    const double dx = -r * std::sin(a) - l * std::sin(b) * db, dx2 = -r * std::sin(a) - l / 2 * std::sin(b) * db, dy2 = l / 2 * std::cos(b) * db;
    *inertia = m1 * r * r / 4 + J1 + m2 * (dx2 * dx2 + dy2 * dy2) + J2 * db * db + m3 * dx * dx;
    return m1 * g * r / 2 * std::sin(a) + m2 * g * l / 2 * std::sin(b) + stiffness / 2 * (x - 0.5) * (x - 0.5);
  };
  for (double speed : {0., 4., 25.}) {
    constexpr double angle = 0.9, e = 1e-3;
    double           J[3], V[3];
    for (int k = -1; k <= 1; k++) V[k + 1] = at(angle + k * e, &J[k + 1]);
    const double expected = -((V[2] - 2 * V[1] + V[0]) / (e * e) - (V[2] - V[0]) * (J[2] - J[0]) / (8 * e * e * J[1])) / J[1];
    const double b = std::asin(r * std::sin(angle) / l), db = r * std::cos(angle) / (l * std::cos(b));
    Scene        scene(PETSC_COMM_SELF);
    scene.gravity({0, -g, 0});
    const auto turned = [](double a) { return Eigen::AngleAxisd(a, Vector3::UnitZ()).toRotationMatrix(); };
    RigidBody  crank  = body(m1, {1, 1, J1}, r / 2 * Vector3(std::cos(angle), std::sin(angle), 0)), rod = body(m2, {1, 1, J2}), slider = body(m3, {1, 1, 1});
    crank.rotation         = turned(angle);
    crank.angular_velocity = {0, 0, speed};
    crank.velocity         = crank.angular_velocity.cross(crank.position);
    rod.rotation           = turned(-b);
    rod.angular_velocity   = {0, 0, -db * speed};
    rod.position           = 2 * crank.position + l / 2 * Vector3(std::cos(b), -std::sin(b), 0);
    rod.velocity           = 2 * crank.velocity + rod.angular_velocity.cross(rod.position - 2 * crank.position);
    slider.position        = {r * std::cos(angle) + l * std::cos(b), 0, 0};
    slider.velocity        = {-speed * (r * std::sin(angle) + l * std::sin(b) * db), 0, 0};
    const Body   one = scene.add("crank", crank), two = scene.add("rod", rod), three = scene.add("slider", slider);
    const Marker ground = scene.marker(scene.ground()), piston = scene.marker(three);
    scene.add("main", Revolute{scene.marker(one, {-r / 2, 0, 0}), ground});
    scene.add("big end", Revolute{scene.marker(two, {-l / 2, 0, 0}), scene.marker(one, {r / 2, 0, 0})});
    scene.add("small end", Revolute{scene.marker(two, {l / 2, 0, 0}), piston});
    scene.add("slide", Translational{scene.marker(three, {0, 0, 0}, axesAlong({1, 0, 0})), scene.marker(scene.ground(), {0, 0, 0}, axesAlong({1, 0, 0}))});
    scene.add("spring", SpringDamper{piston, scene.marker(scene.ground(), {-1, 0, 0}), stiffness, 0, 1.5});
    const Started start(scene);
    for (const Mode &mode : start.modes()) EXPECT_LT(std::abs(mode.value * mode.value - expected), 1e-4 * std::abs(expected)) << speed << " " << mode.value << " " << expected;
  }
}

/* The same where the axis of a wheel turns in space: a bevel wheel on a carrier, which rolls on a wheel of the ground, with inertia that depends on its attitude */
TEST(Linearize, AWheelWhoseAxisTurns)
{
  constexpr double r = 0.1, rp = 0.05, mass = 0.5, carrier = 0.05, stiffness = 20, angle = 0.3;
  for (const Vector3 &P : {Vector3(1e-3, 2e-3, 1e-3), Vector3(2e-3, 2e-3, 3.5e-3)})
    for (double speed : {0., 20., 50.}) {
      const double psi = angle * r / rp, ratio = r / rp; /* the carrier's angle, the planet's on it; the planet's moment about the carrier's axis changes with psi */
      const double J = carrier + mass * r * r + P(1) * ratio * ratio + P(0) * std::cos(psi) * std::cos(psi) + P(2) * std::sin(psi) * std::sin(psi);
      const double slope = (P(2) - P(0)) * std::sin(2 * psi) * ratio, expected = -(stiffness - stiffness * angle * slope / (2 * J)) / J;
      const Matrix3 A = Eigen::AngleAxisd(angle, Vector3::UnitX()).toRotationMatrix(), X = axesAlong({1, 0, 0});
      Scene         scene(PETSC_COMM_SELF);
      RigidBody     c = body(2, {carrier, 0.05, 0.05}), p = body(mass, P, A * Vector3(0, r, 0));
      c.rotation         = A;
      c.angular_velocity = {speed, 0, 0};
      p.rotation         = A * Eigen::AngleAxisd(-psi, Vector3::UnitY()).toRotationMatrix();
      p.angular_velocity = A * Vector3(speed, -ratio * speed, 0);
      p.velocity         = c.angular_velocity.cross(p.position);
      const Body   arm = scene.add("carrier", c), wheel = scene.add("planet", p);
      const Marker ground = scene.marker(scene.ground(), {0, 0, 0}, X), hub = scene.marker(arm, {0, 0, 0}, X);
      const Marker on_arm = scene.marker(arm, {0, r, 0}, axesAlong({0, 1, 0})), on_wheel = scene.marker(wheel, {0, 0, 0}, axesAlong({0, 1, 0}));
      scene.add("main", Revolute{hub, ground});
      scene.add("pin", Revolute{on_wheel, on_arm});
      scene.add("mesh", hhtdae::GearMesh{ground, hub, on_wheel, on_arm, scene.marker(arm, {-rp, r, 0}, axesAlong({0, 0, 1}))});
      scene.add("spring", TorsionalSpringDamper{hub, ground, stiffness, 0, 0});
      const Started start(scene);
      for (const Body axes : {Body{}, arm, wheel}) {
        Linearization     small;
        std::vector<Mode> modes;
        must(small.take(start.run.ts, 0, axes));
        must(small.modes(&modes));
        for (const Mode &mode : modes) EXPECT_LT(std::abs(mode.value * mode.value - expected), 1e-6 * std::abs(expected)) << speed << " " << mode.value << " " << expected;
      }
    }
}

/* Flap and pitch of a hinged blade on a driven hub, by the moments that turn it back, from whatever axes */
TEST(Linearize, AHingedBladeOnADrivenHub)
{
  constexpr double mass = 50, L = 5, e = 0.25, speed = 30, spring = 2000, I = 0.4;
  const double     across = mass * L * L / 12;
  for (bool flap : {true, false}) {
    const Vector3 hinge = flap ? Vector3(0, -1, 0) : Vector3(1, 0, 0);
    const double  at_hinge = across + mass * L * L / 4;
    const double  square = flap ? (spring + speed * speed * (at_hinge - 0.1 * I + mass * L / 2 * e)) / (at_hinge + 0.1 * I) : (spring + speed * speed * 0.8 * I) / I;
    Scene         scene(PETSC_COMM_SELF);
    RigidBody     h = body(1, {1, 1, 1}), b = body(mass, {I, across + 0.1 * I, across + 0.9 * I}, {e + L / 2, 0, 0});
    h.angular_velocity = b.angular_velocity = {0, 0, speed};
    b.velocity                              = h.angular_velocity.cross(b.position);
    const Body   hub = scene.add("hub", h), blade = scene.add("blade", b);
    const Marker axis = scene.marker(hub), ground = scene.marker(scene.ground());
    const Marker i = scene.marker(blade, {-L / 2, 0, 0}, axesAlong(hinge)), j = scene.marker(hub, {e, 0, 0}, axesAlong(hinge));
    scene.add("bearing", Revolute{axis, ground});
    scene.add("drive", RotationalMotion{axis, ground, TimeFunction::polynomial({0, speed})});
    scene.add("hinge", Revolute{i, j});
    scene.add("spring", TorsionalSpringDamper{i, j, spring, 0, 0});
    const Started start(scene);
    for (const Body axes : {Body{}, hub, blade}) {
      Linearization     small;
      std::vector<Mode> modes;
      StateSpace        space;
      must(small.take(start.run.ts, 0, axes));
      must(small.modes(&modes));
      for (const Mode &mode : modes) EXPECT_LT(std::abs(mode.value * mode.value + square), 1e-6 * square) << flap << " " << mode.value << " " << std::sqrt(square);
      must(small.stateSpace({Excitation::torque(i, hinge)}, {Measure::angle(i, j)}, &space));
      EXPECT_NEAR(space.C[0] * space.B[0] + space.C[1] * space.B[1], 0, 1e-9);
      const double static_angle = -(space.C[0] * space.B[1] / space.A[2]); /* z' = y, y' = A z + B: the angle of a moment of 1 */
      EXPECT_NEAR(std::abs(static_angle) * square * (flap ? at_hinge + 0.1 * I : I), 1, 1e-6);
    }
  }
}

namespace
{

/* Values of measures of a run at a time, and its linearization */
struct Constrained {
  std::vector<Measure> state, second;
  void                 add(Marker at)
  {
    for (int c = 0; c < 3; c++) {
      state.push_back(Measure::displacement(at, c));
      state.push_back(Measure::velocity(at, c));
      second.push_back(Measure::acceleration(at, c));
    }
  }
};

/* Two rods in space on a ball joint, with a hinge between them, or a rolling disc; k: which initial value differs by `apart` */
Constrained constrained(Scene &scene, bool rolls, int k, double apart)
{
  const auto  by = [&](int i) { return i == k ? apart : 0.; };
  Constrained measures;
  if (rolls) {
    constexpr double r = 0.3;
    RigidBody        b = body(1.5, {0.03, 0.03, 0.06});
    b.rotation         = (Eigen::AngleAxisd(0.4 + by(0), Vector3::UnitZ()) * Eigen::AngleAxisd(-M_PI / 2 + 0.3 + by(1), Vector3::UnitX())).toRotationMatrix();
    b.angular_velocity = b.rotation * Vector3(0.4 + by(2), 1.5 + by(3), 6 + by(4));
    const Vector3 axis = b.rotation.col(2), down = (axis * axis(2) - Vector3::UnitZ()).normalized();
    b.position         = {0.1 + by(5), 0.2, -r * down(2)};
    b.velocity         = b.angular_velocity.cross(-r * down);
    scene.gravity({0, 0, -9.81});
    const Body disc = scene.add("disc", b);
    scene.add("rolls", hhtdae::RollingDisc{scene.marker(disc), scene.marker(scene.ground()), r});
    for (const Vector3 &p : {Vector3(0, 0, 0), Vector3(0.2, 0, 0), Vector3(0, 0.1, 0.2)}) measures.add(scene.marker(disc, p));
    return measures;
  }
  const Matrix3 A = Eigen::AngleAxisd(0.5 + by(0), Vector3(1 + by(1), 2, -1).normalized()).toRotationMatrix(), B = A * Eigen::AngleAxisd(0.8 + by(2), Vector3::UnitZ()).toRotationMatrix();
  RigidBody     one = body(1, {0.1, 0.2, 0.25}, A * Vector3(0.5, 0, 0)), two = body(2, {0.05, 0.3, 0.3});
  one.rotation         = A;
  one.angular_velocity = A * Vector3(1 + by(3), -2, 3 + by(4));
  one.velocity         = one.angular_velocity.cross(one.position);
  two.rotation         = B;
  two.position         = A * Vector3(1, 0, 0) + B * Vector3(0.4, 0, 0);
  two.angular_velocity = one.angular_velocity + A * Vector3(0, 0, -4 + by(5));
  two.velocity         = 2 * one.velocity + two.angular_velocity.cross(B * Vector3(0.4, 0, 0));
  scene.gravity({0, -9.81, 0});
  const Body first = scene.add("first", one), second = scene.add("second", two);
  scene.add("ball", Spherical{scene.marker(first, {-0.5, 0, 0}), scene.marker(scene.ground())});
  scene.add("hinge", Revolute{scene.marker(second, {-0.4, 0, 0}), scene.marker(first, {0.5, 0, 0})});
  for (Body b : {first, second})
    for (const Vector3 &p : {Vector3(0, 0, 0), Vector3(0.2, 0, 0), Vector3(0, 0.1, 0.2)}) measures.add(scene.marker(b, p));
  return measures;
}

} // namespace

/* Reduction with constraints that change along the motion: the accelerations of the difference of two runs follow from
   the differences of positions and velocities */
TEST(Linearize, DifferenceOfTwoConstrainedRuns)
{
  constexpr double apart = 1e-4;
  for (bool rolls : {false, true})
    for (int k = 0; k < 6; k++) {
      Eigen::VectorXd value[3], second[3];
      StateSpace      space, of_second;
      for (int run : {0, 1, 2}) {
        Scene             scene(PETSC_COMM_SELF);
        const Constrained m = constrained(scene, rolls, k, (run - 1) * apart);
        const Started     start(scene);
        Snapshot          now;
        must(now.take(start.run.ts, 0));
        value[run].resize((Eigen::Index)m.state.size());
        second[run].resize((Eigen::Index)m.second.size());
        for (std::size_t i = 0; i < m.state.size(); i++) must(now.value(m.state[i], &value[run]((Eigen::Index)i)));
        for (std::size_t i = 0; i < m.second.size(); i++) must(now.value(m.second[i], &second[run]((Eigen::Index)i)));
        if (run != 1) continue;
        must(start.small.stateSpace({}, m.state, &space));
        must(start.small.stateSpace({}, m.second, &of_second));
      }
      using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      const Eigen::Map<const Rows> C(space.C.data(), space.outputs, space.states), C2(of_second.C.data(), of_second.outputs, of_second.states);
      const Eigen::VectorXd        y = value[2] - value[0], x = (C.transpose() * C).inverse() * (C.transpose() * y), y2 = second[2] - second[0];
      EXPECT_EQ(space.states, 8);
      EXPECT_GT(y.norm(), apart / 10);
      EXPECT_LT((C * x - y).norm(), 1e-6 * y.norm()) << rolls << " " << k;
      EXPECT_LT((C2 * x - y2).norm(), 1e-5 * y2.norm() + 1e-3 * apart) << rolls << " " << k << ": of " << y2.norm();
    }
}

/* A rod on a ball joint at the distance e from the axis of a hub that a motion drives with the speed W: the frequency
   across the plane of rotation is W sqrt(1 + 3 e/2 L), in the plane W sqrt(3 e/2 L). In space axes the state is not
   steady */
TEST(Linearize, ARigidBladeOnADrivenHub)
{
  const double speed = 12, L = 2, e = 0.3, mass = 1.5;
  for (const Vector3 &up : {Vector3(0, 0, 1), Vector3(0.6, 0, 0.8)}) {
    Scene         scene(PETSC_COMM_SELF);
    const Matrix3 A     = axesAlong(up);
    RigidBody     h     = body(1, {1, 1, 1}), b = body(mass, {1e-4, mass * L * L / 12, mass * L * L / 12}, A * Vector3(e + L / 2, 0, 0));
    h.angular_velocity  = b.angular_velocity = speed * up;
    b.velocity          = speed * up.cross(b.position);
    h.rotation          = b.rotation = A;
    const Body   hub    = scene.add("hub", h), blade = scene.add("blade", b);
    const Marker axis   = scene.marker(hub), ground = scene.marker(scene.ground(), {0, 0, 0}, A);
    scene.add("bearing", Revolute{axis, ground});
    scene.add("drive", RotationalMotion{axis, ground, TimeFunction::polynomial({0, speed})});
    scene.add("hinge", Spherical{scene.marker(blade, {-L / 2, 0, 0}), scene.marker(hub, {e, 0, 0})});
    SceneRun          run(scene, 1, tolerance(1e-8));
    Linearization     small;
    std::vector<Mode> modes;
    must(run.solve());
    must(small.take(run.ts, hub));
    must(small.modes(&modes));
    const auto w = frequencies(modes, 1e-2 * speed);
    ASSERT_EQ(w.size(), 2u); /* a thin rod rotates freely about its own axis */
    EXPECT_NEAR(w[0], speed * std::sqrt(1.5 * e / L), 1e-4 * speed);
    EXPECT_NEAR(w[1], speed * std::sqrt(1 + 1.5 * e / L), 1e-4 * speed); /* its thickness is not zero */
  }
}

/* A disc that rolls straight: I (I + m r^2) s^2 = I m g r - I_a (I_a + m r^2) rate^2 for its inclination, unstable
   below a critical speed */
TEST(Linearize, RollingDisc)
{
  const double mass = 1.5, r = 0.3, g = 9.81, It = mass * r * r / 4, Ia = mass * r * r / 2;
  for (double rate : {2., 5., 12.}) {
    Scene     scene(PETSC_COMM_SELF);
    RigidBody b        = body(mass, {It, It, Ia}, {0, 0, r});
    b.rotation         = Eigen::AngleAxisd(-M_PI / 2, Vector3::UnitX()).toRotationMatrix(); /* axis along y */
    b.angular_velocity = {0, rate, 0};
    b.velocity         = {rate * r, 0, 0};
    scene.gravity({0, 0, -g});
    const Body disc = scene.add("disc", b);
    scene.add("rolls", hhtdae::RollingDisc{scene.marker(disc), scene.marker(scene.ground()), r});
    const Started start(scene);
    const double  square = (It * mass * g * r - Ia * (Ia + mass * r * r) * rate * rate) / (It * (It + mass * r * r));
    double        found  = INFINITY;
    for (const Mode &mode : start.modes()) found = std::min(found, std::abs(mode.value * mode.value - square));
    EXPECT_LT(found, 1e-6 * std::abs(square)) << rate << ": " << square;
  }
}

/* A thin rod that swings on a ball joint: its rotation about its own axis has next to no inertia, and how little does not matter to the modes */
TEST(Linearize, AThinRodOnABallJoint)
{
  std::vector<double> found[2];
  for (int thinner : {0, 1}) {
    Scene         scene(PETSC_COMM_SELF);
    const Matrix3 A    = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
    RigidBody     b    = body(1, {thinner ? 1e-12 : 1e-7, 1. / 12, 1. / 12}, A * Vector3(0.5, 0, 0));
    b.rotation         = A;
    b.angular_velocity = A * Vector3(0, 3, -2);
    b.velocity         = b.angular_velocity.cross(b.position);
    scene.gravity({0, -9.81, 0});
    const Body rod = scene.add("rod", b);
    scene.add("ball", Spherical{scene.marker(rod, {-0.5, 0, 0}), scene.marker(scene.ground())});
    const Started start(scene);
    for (const Mode &mode : start.modes()) found[thinner].push_back(std::abs(mode.value));
  }
  ASSERT_EQ(found[0].size(), found[1].size());
  for (std::size_t k = 0; k < found[0].size(); k++) EXPECT_NEAR(found[0][k], found[1][k], 1e-3) << k;
}
