/* Small motions against closed forms: modes, mode shapes, frequency response, minimal coordinates */
#include "hhtdae/helpers.h"
#include "hhtdae/linearize.h"
#include "hhtdae/modes.h"
#include "scene_output.h"
#include "small_motions.h"
#include <Eigen/LU>
#include <algorithm>

using namespace hhtest;

namespace
{

constexpr double m = 2, c = 3, k = 500;

/* A mass on a slider along an oblique axis, with a spring and a damper; no space coordinate is along the slider */
struct Slider {
  Scene       scene{PETSC_COMM_SELF};
  Marker      at, ground;
  Element     spring;
  Excitation  push;
  Slider(double damping = c)
  {
    const Matrix3 R      = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
    const Matrix3 along_z = Eigen::AngleAxisd(M_PI / 2, Vector3::UnitY()).toRotationMatrix();
    const Body    b      = scene.add("mass", body(m, {0.1, 0.2, 0.3}, R * Vector3(2, 0, 0)));
    at                   = scene.marker(b, {0, 0, 0}, R * along_z);
    ground               = scene.marker(scene.ground(), {0, 0, 0}, R * along_z);
    scene.add("slide", Translational{at, ground});
    spring = scene.add("spring", SpringDamper{at, ground, k, damping, 2});
    push   = Excitation::force(at, R.col(0));
  }
};

} // namespace

TEST(Linearize, DampedOscillator)
{
  Slider        s;
  const Started start(s.scene);
  const auto    modes = start.modes();
  ASSERT_EQ(modes.size(), 1u);
  EXPECT_NEAR(modes[0].value.real(), -c / (2 * m), 1e-9);
  EXPECT_NEAR(modes[0].value.imag(), std::sqrt(k / m - c * c / (4 * m * m)), 1e-8);
  EXPECT_NEAR(modes[0].dampingRatio(), c / (2 * std::sqrt(k * m)), 1e-10);
  EXPECT_NEAR(modes[0].frequency(), std::sqrt(k / m) / (2 * M_PI), 1e-9);
}

/* Response of displacement, acceleration and spring force; the load does not act on the spring directly */
TEST(Linearize, ResponseOfAnOscillator)
{
  Slider                     s;
  const Started              start(s.scene);
  const std::vector<double>  w = {0, 3, std::sqrt(k / m), 40, 1000};
  const std::vector<Measure> what = {Measure::distance(s.at, s.ground), Measure::rate(s.at, s.ground), Measure::acceleration(s.at, 2, s.ground, s.ground), Measure::force(s.spring, 0)};
  StateSpace                 space;
  must(start.small.stateSpace({s.push}, what, &space));
  ASSERT_EQ(space.states, 2);
  Eigen::Map<Eigen::Matrix<double, 2, 2, Eigen::RowMajor>> A(space.A.data());
  Eigen::Map<Eigen::Matrix<double, 2, 1>>                  B(space.B.data());
  for (std::size_t o = 0; o < what.size(); o++) {
    std::vector<Complex> h;
    must(start.small.response(s.push, what[o], w, &h));
    for (std::size_t i = 0; i < w.size(); i++) {
      const Complex iw(0, w[i]), x = 1. / (k - m * w[i] * w[i] + c * iw), expected[] = {x, iw * x, iw * iw * x, (k + c * iw) * x};
      const double  size = std::max({1 / k, std::abs(expected[o]), std::abs(x) * (o == 3 ? k : 0)});
      EXPECT_LT(std::abs(h[i] - expected[o]), 1e-8 * size) << o << " at " << w[i] << " " << h[i] << " " << expected[o];
      const Eigen::Vector2cd z = (iw * Eigen::Matrix2cd::Identity() - A.cast<Complex>()).inverse() * B.cast<Complex>();
      const Complex          y = space.C[2 * o] * z(0) + space.C[2 * o + 1] * z(1) + space.D[o];
      EXPECT_LT(std::abs(y - expected[o]), 1e-8 * size) << o << " at " << w[i] << " by minimal coordinates";
    }
  }
}

/* A state p with values of the size of pressures depends on the slider, p' = 2 (x - 2): its derivatives by differences
   must not be lost in the rounding of p0 */
TEST(Linearize, MeasuresFarFromZero)
{
  for (double p0 : {0., 1e5, 1e7, 2e8, 1e9}) {
    Slider         s;
    const Measure  x = Measure::displacement(s.at, 2, s.ground, s.ground);
    const State    p = s.scene.state("pressure", Expression{{x}, [](const Real *a) -> Real { return 2. * (a[0] - 2.); }}, p0);
    const Started        start(s.scene);
    std::vector<Complex> h, of_x;
    must(start.small.response(s.push, Measure::value(p), {1.}, &h));
    must(start.small.response(s.push, x, {1.}, &of_x));
    const Complex expected = 2. * of_x[0] / Complex(0, 1);
    MEASURED("p0 = %g: %.1e", p0, std::abs(h[0] / expected - 1.));
    EXPECT_LT(std::abs(h[0] / expected - 1.), 1e-6) << p0;
    StateSpace z;
    must(start.small.stateSpace({s.push}, {Measure::value(p)}, &z));
    double most = 0;
    for (double entry : z.C) most = std::max(most, std::abs(entry));
    EXPECT_GT(most, 1e-3) << p0;
  }
}

/* A force that is a steep function of the integral of a displacement. If almost the whole integral is in phase, the
   small out-of-phase part must not be differentiated with a very large increment */
TEST(Linearize, BothPartsOfASteepFunction)
{
  for (double damping : {0., 1e-12, 1e-3}) {
    Slider        s(damping);
    const Measure x = Measure::displacement(s.at, 2, s.ground, s.ground);
    const State   q = s.scene.state("integral", Expression{{x}, [](const Real *a) -> Real { return a[0] - 2.; }}, 0);
    const auto    zero = Expression{{}, [](const Real *) -> Real { return 0.; }}, steep = Expression{{Measure::value(q)}, [](const Real *a) -> Real { return 1e-9 * tanh(50. * a[0]); }};
    const Element f = s.scene.add("reading", UserForce{s.at, {}, s.ground, {zero, zero, steep}, {}});
    const Started start(s.scene);
    std::vector<Complex> h, of_q;
    must(start.small.response(s.push, Measure::elementForce(f, s.at, 2, s.ground), {3., 30.}, &h));
    must(start.small.response(s.push, Measure::value(q), {3., 30.}, &of_q));
    for (int k = 0; k < 2; k++) EXPECT_LT(std::abs(h[k] / (50e-9 * of_q[k]) - 1.), 1e-5) << damping << " " << h[k] << " " << of_q[k];
  }
}

/* Two rods, one suspended from the other: M and K in terms of the angles */
TEST(Linearize, DoublePendulum)
{
  for (Space kind : {Space::Planar, Space::Spatial}) {
    Scene scene(PETSC_COMM_SELF, kind);
    scene.gravity({0, -9.81, 0});
    const Body   one = scene.add("one", body(1, {1. / 12, 1e-3, 1. / 12}, {0, -0.5, 0})), two = scene.add("two", body(1, {1. / 12, 1e-3, 1. / 12}, {0, -1.5, 0}));
    const Marker elbow = scene.marker(one, {0, -0.5, 0});
    scene.add("pin", Revolute{scene.marker(one, {0, 0.5, 0}), scene.marker(scene.ground())});
    scene.add("elbow", Revolute{scene.marker(two, {0, 0.5, 0}), elbow});
    const Started start(scene);
    const auto    modes = start.modes();
    ASSERT_EQ(modes.size(), 2u);
    const Eigen::Matrix2d M = (Eigen::Matrix2d() << 4. / 3, 0.5, 0.5, 1. / 3).finished(), K = (Eigen::Matrix2d() << 1.5 * 9.81, 0, 0, 0.5 * 9.81).finished();
    const Eigen::Matrix2d A      = M.inverse() * K;
    const double          middle = A.trace() / 2, apart = std::sqrt(middle * middle - A.determinant());
    for (int i = 0; i < 2; i++) {
      const double          square = middle + (i ? apart : -apart);
      const Eigen::Vector2d v(A(0, 1), square - A(0, 0));
      EXPECT_NEAR(modes[i].value.imag(), std::sqrt(square), 1e-8);
      EXPECT_NEAR(modes[i].value.real(), 0, 1e-8);
      BodyPart a, b;
      must(start.small.part(modes[i], one, &a));
      must(start.small.part(modes[i], two, &b));
      EXPECT_LT(std::abs(b.rotation(2) / a.rotation(2) - v(1) / v(0)), 1e-7);
      EXPECT_LT(std::abs(b.displacement(0) / a.displacement(0) - (v(0) + v(1) / 2) / (v(0) / 2)), 1e-7);
      EXPECT_NEAR(a.share + b.share, 1, 1e-9);
      EXPECT_NEAR(a.share, v(0) * v(0) / 3 / v.dot(M * v), 1e-7);
      Complex height, sway;
      must(start.small.value(modes[i], Measure::displacement(elbow, 0), &sway));
      must(start.small.value(modes[i], Measure::displacement(elbow, 1), &height));
      EXPECT_LT(std::abs(sway - a.rotation(2)), 1e-9);
      EXPECT_LT(std::abs(height), 1e-9);
    }
  }
}

/* A force that is linear only within a hundredth of a millimetre */
TEST(Linearize, SteepForces)
{
  constexpr double width = 1e-5, stiffness = 1e6;
  Scene            scene(PETSC_COMM_SELF);
  const Body       b  = scene.add("b", body(m, {1, 1, 1}, {2, 0, 0}));
  const Marker     at = scene.marker(b), ground = scene.marker(scene.ground());
  const Element    grip = scene.add("grip", UserForce{at, ground, {}, {Expression{{Measure::displacement(at, 0)}, [=](const Real *x) { return -stiffness * width * tanh((x[0] - 2.) / width); }}, Expression{{}, [](const Real *) { return Real(0.); }}, Expression{{}, [](const Real *) { return Real(0.); }}}, {}});
  const Started    start(scene);
  std::vector<Complex> h;
  must(start.small.response(Excitation::force(at, {1, 0, 0}), Measure::force(grip, 0), {100, 1500}, &h));
  for (int k = 0; k < 2; k++) {
    const double w = k ? 1500 : 100, expected = -stiffness / (stiffness - m * w * w);
    EXPECT_LT(std::abs(h[k] - expected), 1e-7 * std::abs(expected)) << h[k] << " " << expected;
  }
}

/* An angle at half a turn, where it jumps from pi to -pi */
TEST(Linearize, AngleOfHalfATurn)
{
  Scene scene(PETSC_COMM_SELF, Space::Planar);
  scene.gravity({0, -9.81, 0});
  const Body   rod = scene.add("rod", body(1, {1. / 12, 1e-3, 1. / 12}, {0, -0.5, 0}));
  const Marker pin = scene.marker(rod, {0, 0.5, 0}), turned = scene.marker(scene.ground(), {0, 0, 0}, Eigen::AngleAxisd(M_PI, Vector3::UnitZ()).toRotationMatrix());
  scene.add("pin", Revolute{pin, turned});
  const Started start(scene);
  Complex       angle;
  must(start.small.value(start.modes()[0], Measure::angle(pin, turned), &angle));
  EXPECT_LT(std::abs(angle - 1.), 1e-8);
}

/* A sleeping top: I s^2 - i I_a spin s - m g l = 0 for the inclination; coordinates and axes of the joint rotate with
   the top */
TEST(Linearize, SleepingTop)
{
  const double mass = 3, l = 0.4, It = 0.3 + mass * l * l, Ia = 0.5, g = 9.81;
  for (double spin : {15., 40.})
    for (const Vector3 &up : {Vector3(0, 0, 1), Vector3(0.6, 0, 0.8), Vector3(1, 0, 0)}) {
      Scene     scene(PETSC_COMM_SELF);
      RigidBody b        = body(mass, {0.3, 0.3, Ia}, l * up);
      b.rotation         = axesAlong(up) * Eigen::AngleAxisd(0.3, Vector3::UnitZ()).toRotationMatrix();
      b.angular_velocity = spin * up;
      scene.gravity(-g * up);
      const Body top = scene.add("top", b);
      scene.add("tip", Spherical{scene.marker(top, {0, 0, -l}), scene.marker(scene.ground())});
      const Started start(scene);
      const auto    w    = frequencies(start.modes());
      const double  root = std::sqrt(Ia * Ia * spin * spin - 4 * It * mass * g * l);
      ASSERT_EQ(w.size(), 2u) << spin << " " << up.transpose();
      EXPECT_NEAR(w[0], (Ia * spin - root) / (2 * It), 1e-6);
      EXPECT_NEAR(w[1], (Ia * spin + root) / (2 * It), 1e-6);
    }
}

/* A rotor in a bearing on springs: its frequencies split with the speed. The axes of the joint rotate with the rotor
   or are fixed to the bearing */
TEST(Linearize, WhirlOfARotor)
{
  const double It = 0.3, Ia = 0.5, Ib = 0.1, stiffness = 200;
  for (double spin : {0., 5., 60.})
    for (bool swap : {false, true}) {
      Scene     scene(PETSC_COMM_SELF);
      RigidBody r        = body(4, {It, It, Ia});
      r.angular_velocity = {0, 0, spin};
      const Body   rotor = scene.add("rotor", r), bearing = scene.add("bearing", body(1, {Ib, Ib, Ib}));
      const Marker i = scene.marker(rotor), j = scene.marker(bearing);
      scene.add("axle", swap ? Revolute{j, i} : Revolute{i, j});
      scene.add("mount", Bushing{j, scene.marker(scene.ground()), Vector3(1e4, 1e4, 2e4), Vector3(stiffness, stiffness, 90)});
      const Started start(scene);
      auto          w = frequencies(start.modes());
      const double  I = It + Ib, root = std::sqrt(Ia * Ia * spin * spin + 4 * I * stiffness);
      std::vector<double> expected = {(root - Ia * spin) / (2 * I), (root + Ia * spin) / (2 * I), std::sqrt(90 / Ib), std::sqrt(1e4 / 5), std::sqrt(1e4 / 5), std::sqrt(2e4 / 5)};
      std::sort(expected.begin(), expected.end());
      ASSERT_EQ(w.size(), expected.size()) << spin;
      for (std::size_t n = 0; n < w.size(); n++) EXPECT_NEAR(w[n], expected[n], 1e-6 * expected[n]) << spin;
    }
}

/* The same rotor in axes that rotate with it: the frequency of backward whirl is larger by the speed, that of forward
   whirl smaller; motions along or about the axis are unchanged */
TEST(Linearize, WhirlInTheAxesOfTheRotor)
{
  const double It = 0.3, Ia = 0.5, Ib = 0.1, stiffness = 200, spin = 7;
  Scene        scene(PETSC_COMM_SELF);
  RigidBody    r     = body(4, {It, It, Ia});
  r.angular_velocity = {0, 0, spin};
  const Body   rotor = scene.add("rotor", r), bearing = scene.add("bearing", body(1, {Ib, Ib, Ib}));
  const Marker j     = scene.marker(bearing);
  scene.add("axle", Revolute{scene.marker(rotor), j});
  scene.add("mount", Bushing{j, scene.marker(scene.ground()), Vector3(1e4, 1e4, 2e4), Vector3(stiffness, stiffness, 90)});
  SceneRun          run(scene, 1, tolerance(1e-8));
  Linearization     small;
  std::vector<Mode> modes;
  must(small.take(run.ts, rotor));
  must(small.modes(&modes));
  const auto          w = frequencies(modes);
  const double        I = It + Ib, root = std::sqrt(Ia * Ia * spin * spin + 4 * I * stiffness), across = std::sqrt(1e4 / 5);
  std::vector<double> expected = {(root - Ia * spin) / (2 * I) + spin, (root + Ia * spin) / (2 * I) - spin, std::sqrt(90 / Ib), across - spin, across + spin, std::sqrt(2e4 / 5)};
  std::sort(expected.begin(), expected.end());
  ASSERT_EQ(w.size(), expected.size());
  for (std::size_t n = 0; n < w.size(); n++) EXPECT_NEAR(w[n], expected[n], 1e-6 * expected[n]);
}

/* A mass with a controller that contains a lag and a variable: m s^2 + c s + k + gain/(1 + tau s) = 0 */
TEST(Linearize, StatesAndVariables)
{
  const double gain = 300, tau = 0.05;
  Slider       s;
  const Variable shown = s.scene.variable("shown", Expression{{Measure::distance(s.at, s.ground)}, [=](const Real *x) { return gain * (x[0] - 2.); }});
  const State    filtered = s.scene.state("filtered", Expression{{Measure::value(shown), Measure::value(State{0})}, [=](const Real *x) { return (x[0] - x[1]) / tau; }}, 0);
  s.scene.add("drive", UserScalarForce{s.at, s.ground, Expression{{Measure::value(filtered)}, [](const Real *x) { return -x[0]; }}});
  const Started start(s.scene);
  const auto    modes = start.modes();
  ASSERT_EQ(modes.size(), 2u); /* a complex pair and a real one */
  for (const Mode &mode : modes) {
    const Complex v = mode.value;
    EXPECT_LT(std::abs((m * v * v + c * v + k) * (1. + tau * v) + gain), 1e-6 * (k + gain)) << v;
  }
  Complex x, y;
  must(start.small.value(modes[0], Measure::distance(s.at, s.ground), &x));
  must(start.small.value(modes[0], Measure::value(shown), &y));
  EXPECT_LT(std::abs(y - gain * x), 1e-6 * gain);
}

/* The slowest modes of a chain, by sparse and by dense algebra; the analysis does not change the run */
TEST(Linearize, SlowestModesOfAChain)
{
  Rods              rods(12);
  for (int i = 0; i < 12; i++) rods.scene.add("", TorsionalSpringDamper{rods.centre[i], i ? rods.centre[i - 1] : rods.scene.marker(rods.scene.ground()), 400. + 10 * i, 0.2, 0});
  const Started     start(rods.scene);
  const auto        all = start.modes();
  std::vector<Mode> slow;
  must(SlowestModes(start.small, 5, &slow));
  ASSERT_EQ(all.size(), 12u);
  ASSERT_EQ(slow.size(), 5u);
  for (int i = 0; i < 5; i++) {
    EXPECT_LT(std::abs(slow[i].value - all[i].value), 1e-7 * std::abs(all[i].value));
    for (std::size_t n = 0; n < 6 * 12; n++) EXPECT_LT(std::abs(slow[i].shape[n] - all[i].shape[n]), 1e-5) << i << " " << n;
  }
}

/* Motions without inertia, or with negligible inertia compared with their damping: a first-order lag, and a mass that
   creeps back to equilibrium */
TEST(Linearize, SlowestModesWithoutInertia)
{
  const double tau = 20, damping = 1e6;
  Slider       s(damping);
  s.scene.state("lag", Expression{{Measure::value(State{0}), Measure::distance(s.at, s.ground)}, [=](const Real *x) { return (x[1] - x[0]) / tau; }}, 2);
  const Started     start(s.scene);
  std::vector<Mode> slow;
  for (double shift : {1., 0.3}) {
    must(SlowestModes(start.small, 2, &slow, shift));
    double lag = INFINITY, creeps = INFINITY;
    for (const Mode &mode : slow) {
      lag    = std::min(lag, std::abs(mode.value + 1 / tau));
      creeps = std::min(creeps, std::abs(mode.value + k / damping));
    }
    EXPECT_LT(lag, 1e-6);
    EXPECT_LT(creeps, 1e-8);
  }
}

/* Linearization before the first step, after it, and later in the same run */
TEST(Linearize, StartOfARun)
{
  Rods              rods(3);
  SceneRun          run(rods.scene, 0.3, tolerance(1e-8));
  Linearization     before, after;
  std::vector<Mode> one, two;
  must(before.take(run.ts));
  must(before.modes(&one));
  must(TSStep(run.ts));
  must(after.take(run.ts, 0));
  must(after.modes(&two));
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t k = 0; k < one.size(); k++) EXPECT_LT(std::abs(one[k].value - two[k].value), 1e-9);
  must(run.solve());
  must(after.take(run.ts));
  must(after.modes(&two));
  EXPECT_GT(std::abs(one[0].value - two[0].value), 1e-2);
}

TEST(Linearize, RunDoesNotNotice)
{
  Array end[2];
  for (int asked = 0; asked < 2; asked++) {
    Rods     rods(3);
    SceneRun run(rods.scene, 0.5, tolerance(1e-6));
    for (double t : {0., 0.2, 0.5}) {
      must(TSSetMaxTime(run.ts, t));
      if (t > 0) must(run.solve());
      if (!asked) continue;
      Linearization        small;
      std::vector<Mode>    modes;
      std::vector<Complex> h;
      must(small.take(run.ts));
      must(small.modes(&modes));
      must(small.response(Excitation::force(rods.tip[2], {0, 1, 0}), Measure::displacement(rods.tip[2], 1), {5}, &h));
    }
    Vec U;
    must(TSGetSolution(run.ts, &U));
    end[asked] = whole(U);
  }
  EXPECT_EQ(end[0], end[1]);
}

TEST(Linearize, ErrorsThatSayWhatToDo)
{
  Slider        s;
  SceneRun      run(s.scene, 1, "");
  Linearization small;
  std::vector<Mode>    modes;
  std::vector<Complex> h;
  ErrorTrap     trap;
  EXPECT_NE(small.modes(&modes), 0);
  EXPECT_TRUE(trap.says("take()")) << trap.message;
  must(small.take(run.ts));
  EXPECT_NE(small.response(Excitation::force(s.ground, {1, 0, 0}), Measure::time(), {1}, &h), 0);
  EXPECT_TRUE(trap.says("on the ground")) << trap.message;
  EXPECT_NE(small.response(Excitation::force(Marker{1000}, {1, 0, 0}), Measure::time(), {1}, &h), 0);
  EXPECT_TRUE(trap.says("not one of this scene")) << trap.message;
  EXPECT_NE(small.response(Excitation::force(s.at, {NAN, 0, 0}), Measure::time(), {1}, &h), 0);
  EXPECT_TRUE(trap.says("not a number")) << trap.message;
  EXPECT_NE(small.response(s.push, Measure::time(), {1, NAN}, &h), 0);
  EXPECT_TRUE(trap.says("must be finite")) << trap.message;
  EXPECT_NE(SlowestModes(small, 0, &modes), 0);
  EXPECT_TRUE(trap.says("must be positive")) << trap.message;
}

/* Inputs to which a body cannot respond */
TEST(Linearize, LoadsThatMoveNothing)
{
  StateSpace space;
  ErrorTrap  trap;
  for (bool planar : {false, true}) {
    Scene        scene(PETSC_COMM_SELF, planar ? Space::Planar : Space::Spatial);
    const Marker at = scene.marker(planar ? scene.add("plate", body(1, {1, 1, 1})) : scene.add("ball", PointMass{1}));
    const Started start(scene);
    EXPECT_NE(start.small.stateSpace({Excitation::torque(at, {1, 0, 0})}, {Measure::velocity(at, 0)}, &space), 0);
    EXPECT_TRUE(trap.says(planar ? "the body plate stays in the plane" : "the body ball does not turn")) << trap.message;
    must(start.small.stateSpace({Excitation::force(at, {1, 0, 0})}, {Measure::velocity(at, 0)}, &space));
  }
}

/* The acceleration of the ground acts on all masses: a mass on a spring, and a suspended rod with J s^2 + m g l = -m l
   a for its angle */
TEST(Linearize, AShakenGround)
{
  const std::vector<double> w = {0, 3, 12, 40};
  std::vector<Complex>      h;
  Slider                    s;
  const Started             slider(s.scene);
  const Vector3             along = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix().col(0);
  must(slider.small.response(Excitation::groundAcceleration(along), Measure::distance(s.at, s.ground), w, &h));
  for (std::size_t i = 0; i < w.size(); i++) {
    const Complex expected = -m / (k - m * w[i] * w[i] + c * Complex(0, w[i]));
    EXPECT_LT(std::abs(h[i] - expected), 1e-8 * std::abs(expected)) << w[i];
  }
  for (Space kind : {Space::Planar, Space::Spatial}) {
    Scene scene(PETSC_COMM_SELF, kind);
    scene.gravity({0, -9.81, 0});
    const Body   rod = scene.add("rod", body(1.5, {0.1, 0.1, 0.1}, {0, -0.5, 0}));
    const Marker pin = scene.marker(rod, {0, 0.5, 0}), ground = scene.marker(scene.ground());
    scene.add("pin", Revolute{pin, ground});
    const Started start(scene);
    StateSpace    z;
    must(start.small.response(Excitation::groundAcceleration({1, 0, 0}), Measure::angle(pin, ground), w, &h));
    for (std::size_t i = 0; i < w.size(); i++) {
      const double expected = -1.5 * 0.5 / (1.5 * 9.81 * 0.5 - (0.1 + 1.5 * 0.25) * w[i] * w[i]);
      EXPECT_LT(std::abs(h[i] - expected), 1e-8 * std::abs(expected)) << w[i] << " " << h[i];
    }
    must(start.small.stateSpace({Excitation::groundAcceleration({1, 0, 0})}, {Measure::angularAcceleration(pin, 2)}, &z));
    EXPECT_NEAR(z.D[0], -1.5 * 0.5 / (0.1 + 1.5 * 0.25), 1e-9);
  }
}

/* A table shaken along x with a mass on a spring and damper: x/y = (k + i w c)/(k - m w^2 + i w c), with the motion
   given as displacement, velocity or acceleration; the force of the drive accelerates both masses */
TEST(Linearize, AShakenBase)
{
  const double               m = 2, k = 300, c = 5, table_mass = 3;
  const std::vector<double>  at = {0.5, 5, 12, 13, 40};
  for (MotionOf of : {MotionOf::Displacement, MotionOf::Velocity, MotionOf::Acceleration}) {
    Scene        s(PETSC_COMM_SELF);
    const Body   table = s.add("table", body(table_mass, {1, 1, 1})), mass = s.add("mass", body(m, {1, 1, 1}, {1, 0, 0}));
    const Matrix3 along = Eigen::AngleAxisd(M_PI / 2, Vector3::UnitY()).toRotationMatrix();
    const Marker i = s.marker(table, Vector3::Zero(), along), j = s.marker(s.ground(), Vector3::Zero(), along), top = s.marker(mass, Vector3::Zero(), along);
    s.add("rail", Translational{i, j});
    s.add("slide", Translational{top, s.markerAt(table, {1, 0, 0}, along)});
    const Element drive = s.add("drive", TranslationalMotion{i, j, 0., of});
    s.add("spring", SpringDamper{top, i, k, c});
    TS ts;
    must(s.createTS(&ts));
    Linearization                     small;
    std::vector<std::complex<double>> x, f;
    must(small.take(ts));
    must(small.response(Excitation::motion(drive), Measure::displacement(top, 0), at, &x));
    must(small.response(Excitation::motion(drive), Measure::elementForce(drive, i, 0), at, &f));
    for (std::size_t l = 0; l < at.size(); l++) {
      const std::complex<double> s1(0, at[l]), stiff = k + s1 * c, y = of == MotionOf::Displacement ? 1 : of == MotionOf::Velocity ? 1. / s1 : 1. / (s1 * s1);
      const std::complex<double> exact = y * stiff / (stiff + m * s1 * s1), force = s1 * s1 * (m * exact + table_mass * y);
      EXPECT_LT(std::abs(x[l] - exact), 1e-8 * std::abs(exact)) << (int)of << " at " << at[l];
      EXPECT_LT(std::abs(f[l] - force), 1e-8 * std::abs(force)) << (int)of << " at " << at[l];
    }
    StateSpace z;
    if (of == MotionOf::Acceleration) {
      must(small.stateSpace({Excitation::motion(drive)}, {Measure::displacement(top, 0)}, &z));
      ASSERT_EQ(z.states, 4); /* positions of both, the velocity of the mass, and the velocity of the table as a state */
      using Dense = Eigen::Matrix<std::complex<double>, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      const Dense A = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(z.A.data(), 4, 4).cast<std::complex<double>>();
      const Dense B = Eigen::Map<Eigen::MatrixXd>(z.B.data(), 4, 1).cast<std::complex<double>>(), C = Eigen::Map<Eigen::MatrixXd>(z.C.data(), 1, 4).cast<std::complex<double>>();
      const Dense y = C * (std::complex<double>(0, 12) * Dense::Identity(4, 4) - A).inverse() * B;
      EXPECT_LT(std::abs(y(0, 0) + z.D[0] - x[2]), 1e-8 * std::abs(x[2]));
    } else {
      ErrorTrap trap;
      EXPECT_NE(small.stateSpace({Excitation::motion(drive)}, {Measure::displacement(top, 0)}, &z), 0);
      EXPECT_TRUE(trap.says("is a motion of a displacement or velocity")) << trap.message;
    }
    must(TSDestroy(&ts));
  }
}

namespace
{

/* Results of a linearization as a list of numbers */
std::vector<double> said(const Linearization &small, const Excitation &in, const std::vector<Measure> &out, Body body)
{
  std::vector<double> all;
  const auto          add = [&](Complex x) {
    all.push_back(x.real());
    all.push_back(x.imag());
  };
  std::vector<Mode> modes;
  must(small.modes(&modes));
  for (const Mode &m : modes) add(m.value);
  for (const Measure &what : out) {
    std::vector<Complex> h;
    Complex              x;
    must(small.response(in, what, {1., 3.}, &h));
    for (const Complex &y : h) add(y);
    must(small.value(modes[0], what, &x));
    add(x);
  }
  BodyPart part;
  must(small.part(modes[0], body, &part));
  for (int c = 0; c < 3; c++) add(part.displacement(c));
  StateSpace space;
  must(small.stateSpace({in}, out, &space));
  for (const auto *x : {&space.A, &space.B, &space.C, &space.D}) all.insert(all.end(), x->begin(), x->end());
  return all;
}

} // namespace

/* A linearization belongs to the state at which it was made: a pendulum with a spring that counts turns swings on, and
   the results stay the same */
TEST(Linearize, GoesOnBeingOfItsState)
{
  for (const char *rotations : {"local", "euler313"}) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody b        = body(1, {0.1, 0.2, 0.3}, {1, 0, 0});
    b.angular_velocity = {0, 0, 9};
    b.velocity         = {0, 9, 0};
    const Body   rod   = s.add("rod", b);
    const Marker i = s.markerAt(rod, {0, 0, 0}), j = s.marker(s.ground()), tip = s.markerAt(rod, {1.5, 0, 0});
    s.gravity({0, -9.81, 0});
    s.add("pin", Spherical{i, j});
    Bushing bush;
    bush.i                   = i;
    bush.j                   = j;
    bush.torsional_stiffness = {0.03, 0.04, 0};
    s.add("bush", bush);
    const Element spring = s.add("spring", TorsionalSpringDamper{i, j, 0.5, 0});
    SceneRun      run(s, .9, tolerance(1e-8) + " -scene_rotations " + rotations);
    Linearization small;
    must(run.solve());
    must(small.take(run.ts));
    const Excitation           in   = Excitation::force(tip, {0, 0, 1});
    const std::vector<Measure> out  = {Measure::displacement(tip, 2), Measure::velocity(tip, 1), Measure::acceleration(tip, 0), Measure::force(spring, 0)};
    const std::vector<double>  then = said(small, in, out, rod);
    must(TSSetMaxTime(run.ts, 1.4));
    must(run.solve());
    const std::vector<double> now = said(small, in, out, rod);
    ASSERT_EQ(now.size(), then.size());
    for (std::size_t k = 0; k < now.size(); k++) EXPECT_EQ(now[k], then[k]) << rotations << " " << k;
    Snapshot after; /* the run has kept its own count of turns */
    double   turns;
    must(after.take(run.ts));
    must(after.value(Measure::force(spring, 0), &turns));
    EXPECT_GT(std::abs(turns), 0.5 * 2 * M_PI);
  }
}

/* m z'' = -k z - c z' - a z'' - m g'': measures of acceleration are relative to the ground, also inside variables and
   forces that contain them */
TEST(Linearize, GroundAccelerationAndMeasuresOfAcceleration)
{
  for (double feedback : {0., 3.}) {
    Scene     s(PETSC_COMM_SELF);
    PointMass p;
    p.mass         = m;
    const Marker q = s.marker(s.add("mass", p)), g = s.marker(s.ground());
    s.add("line", InLine{q, g});
    s.add("spring", SpringDamper{q, s.marker(s.ground(), {0, 0, -1}), 50, c, 1});
    const Measure  z = Measure::displacement(q, 2), a = Measure::acceleration(q, 2);
    const Variable v = s.variable("acceleration", a);
    UserForce      f;
    f.i     = q;
    f.force = {TimeFunction(0), TimeFunction(0), Expression({a}, [=](const Real *x) -> Real { return -feedback * x[0]; })};
    s.add("feedback", f);
    const Started        start(s);
    const double         w = 4;
    const Complex        x = -m / Complex(50 - (m + feedback) * w * w, c * w), expected[] = {x, -w * w * x, -w * w * x};
    const std::vector<Measure> what = {z, a, Measure::value(v)};
    StateSpace           space;
    must(start.small.stateSpace({Excitation::groundAcceleration({0, 0, 1})}, what, &space));
    for (int k = 0; k < 3; k++) {
      std::vector<Complex> h;
      must(start.small.response(Excitation::groundAcceleration({0, 0, 1}), what[k], {w}, &h));
      EXPECT_LT(std::abs(h[0] - expected[k]), 1e-8 * std::abs(expected[k])) << feedback << k << h[0] << expected[k];
    }
    EXPECT_NEAR(space.D[1], -m / (m + feedback), 1e-8);
    EXPECT_NEAR(space.D[2], -m / (m + feedback), 1e-8);
  }
}

/* z' = V, V = -2 z + (y - 1)/2, y'' = -5 (y - z) - 0.3 (y' - z') + f: a variable in a velocity-level constraint acts
   as if its definition were written there */
TEST(Linearize, VariablesInRowsOfVelocities)
{
  std::vector<Complex> values[2];
  for (bool written : {false, true}) {
    Scene     s(PETSC_COMM_SELF);
    PointMass p;
    p.mass         = 2;
    const Marker q = s.marker(s.add("follower", p)), g = s.marker(s.ground());
    p.mass         = 1;
    p.position     = {0, 0, 1};
    const Marker y = s.marker(s.add("mass", p));
    s.add("line", InLine{q, g});
    s.add("other line", InLine{y, g});
    s.add("spring", SpringDamper{q, y, 5, .3, 1});
    const Measure zq = Measure::displacement(q, 2), zy = Measure::displacement(y, 2), speed = Measure::velocity(q, 2);
    if (written) s.add("row", UserConstraint{{Expression({speed, zq, zy}, [](const Real *x) -> Real { return x[0] + 2 * x[1] - .5 * (x[2] - 1); })}});
    else {
      const Variable half = s.variable("half", Expression({zy}, [](const Real *x) -> Real { return .5 * (x[0] - 1); }));
      const Variable v    = s.variable("speed", Expression({zq, Measure::value(half)}, [](const Real *x) -> Real { return -2 * x[0] + x[1]; }));
      s.add("row", UserConstraint{{Expression({speed, Measure::value(v)}, [](const Real *x) -> Real { return x[0] - x[1]; })}});
    }
    const Started start(s);
    for (const Mode &mode : start.modes()) values[written].push_back(mode.value);
    const Excitation in = Excitation::force(y, {0, 0, 1});
    StateSpace       space;
    must(start.small.stateSpace({in}, {zq, zy}, &space));
    ASSERT_EQ(space.states, 3);
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const double           w = 2;
    const Eigen::MatrixXcd A = Eigen::Map<Rows>(space.A.data(), 3, 3).cast<Complex>(), B = Eigen::Map<Rows>(space.B.data(), 3, 1).cast<Complex>(),
                           C = Eigen::Map<Rows>(space.C.data(), 2, 3).cast<Complex>();
    const Eigen::MatrixXcd h     = C * (Complex(0, w) * Eigen::MatrixXcd::Identity(3, 3) - A).partialPivLu().solve(B);
    const Complex          iw(0, w), of_y = 1. / (-w * w + 5 + .3 * iw - (5. + .3 * iw) * .5 / (iw + 2.));
    EXPECT_LT(std::abs(h(1) - of_y), 1e-8) << h(1) << of_y;
    EXPECT_LT(std::abs(h(0) - .5 * of_y / (iw + 2.)), 1e-8) << h(0);
  }
  ASSERT_EQ(values[0].size(), values[1].size());
  for (std::size_t k = 0; k < values[0].size(); k++) EXPECT_LT(std::abs(values[0][k] - values[1][k]), 1e-8);
}

/* A bead on a line that rotates with w about the bead's rest position, with springs k = 5 w^2: the eigenvalue is 2i w
   in any unit of time */
TEST(Linearize, RowsThatTurnByThemselves)
{
  for (double w : {1e-5, 0.1, 1., 50., 2 * M_PI / 0.01, 2 * M_PI / 0.00125, 1e3, 1e6}) {
    Scene     s(PETSC_COMM_SELF, Space::Planar);
    PointMass p;
    p.position           = {1, 0, 0};
    const Marker  q      = s.marker(s.add("bead", p)), g = s.marker(s.ground(), {1, 0, 0});
    const Measure x      = Measure::displacement(q, 0, g), y = Measure::displacement(q, 1, g);
    s.add("line", UserConstraint{{Expression({x, y, Measure::time()}, [=](const Real *m) -> Real { return m[0] * sin(w * m[2]) - m[1] * cos(w * m[2]); })}});
    UserForce f;
    f.i           = q;
    const auto of = [=](const Measure &m) { return Expression({m}, [=](const Real *d) -> Real { return -5 * w * w * d[0]; }); };
    f.force       = {of(x), of(y), TimeFunction(0)};
    s.add("springs", f);
    const Started start(s);
    const auto    modes = start.modes();
    ASSERT_EQ(modes.size(), 1u);
    EXPECT_NEAR(modes[0].value.imag() / w, 2, 1e-5) << w;
    EXPECT_NEAR(modes[0].value.real() / w, 0, 1e-5) << w;
  }
}

/* Force, moment and acceleration of the ground: an input without effect is refused, also together with one that has an
   effect */
TEST(Linearize, ExcitationsWithoutEffect)
{
  Scene        s(PETSC_COMM_SELF, Space::Planar);
  const Body   b = s.add("body", body(1, {1, 1, 1})), d = s.add("dot", PointMass());
  const Marker q = s.marker(b), r = s.marker(d), g = s.marker(s.ground(), {1, 0, 0}), h = s.marker(s.ground(), {0, 1, 0});
  for (Marker k : {q, r}) {
    s.add("", SpringDamper{k, g, 3, 1, .5});
    s.add("", SpringDamper{k, h, 3, 1, .5});
  }
  const Started        start(s);
  std::vector<Complex> x;
  const auto           refused = [&](const Excitation &in, const std::string &why) {
    ErrorTrap trap;
    EXPECT_NE(start.small.response(in, Measure::displacement(q, 0), {1.}, &x), 0) << why;
    EXPECT_TRUE(trap.says(why)) << trap.message;
  };
  refused(Excitation::groundAcceleration({0, 0, 1}), "the acceleration of the ground, (0., 0., 1.), moves nothing");
  refused(Excitation::force(q, {0, 0, 1}), "the force of an excitation, (0., 0., 1.), moves nothing: the body body stays in the plane");
  Excitation both = Excitation::force(r, {1, 0, 0});
  both.moment     = {0, 0, 1};
  refused(both, "the moment of an excitation, (0., 0., 1.), moves nothing: the body dot does not turn");
  must(start.small.response(Excitation::force(r, {1, 0, 0}), Measure::displacement(r, 0), {1.}, &x));
}
