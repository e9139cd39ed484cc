/* Scenes of the benchmark mechanisms in short runs: exact solutions, published digits, and equations in fewer coordinates */
#include "hhtdae/scene.h"
#include "problems/fourbar.h"
#include "scene_output.h"
#include "scene_references.h"
#include "scene_watch.h"

using namespace hhtest;
using hhtex::Widen;

namespace
{

/* A run of a scene whose channels are read at intervals dt */
class Watched
{
public:
  TSHHT3Statistics s;

  Watched(Scene &scene, double end, double dt, const std::string &options, const hhtex::Watch::Look &look)
      : run_(scene, end, options), watch_(scene, dt, look)
  {
    must(TSSetMaxSteps(run_.ts, 1000000));
    must(watch_.attach(run_.ts));
    must(run_.solve());
    must(TSHHT3GetStatistics(run_.ts, &s));
  }

private:
  SceneRun     run_;
  hhtex::Watch watch_;
};

/* Errors at two tolerances: the second is within the bound, and smaller than the first as a method of second order requires */
void converges(const char *what, const std::function<double(double)> &error, double loose, double tight, double bound)
{
  const double a = error(loose), b = error(tight);
  MEASURED("%s: error %.2e at tolerance %g, %.2e at %g", what, a, loose, b, tight);
  EXPECT_LT(b, bound) << what;
  EXPECT_LT(b, a * std::pow(tight / loose, 0.5)) << what; /* h is proportional to the cube root of the tolerance, the error to its square */
}

std::string damped(double eps) { return tolerance(eps) + " -ts_hhtdae_alpha -0.05 "; }

/* For tests of multipliers: the error that the corrector leaves in q enters the multipliers divided by h^2 */
std::string sharp(double eps) { return tolerance(eps) + " -ts_hhtdae_corrector_tolerance 1e-6 "; }

Matrix3 axes(const Vector3 &x, const Vector3 &z)
{
  Matrix3 R;
  R << x, z.cross(x), z;
  return R;
}

RigidBody rod(double mass, double axial, double across, const Vector3 &from, const Vector3 &to, const Vector3 &y)
{
  RigidBody b;
  b.mass          = mass;
  b.inertia       = Vector3(axial, across, across).asDiagonal();
  b.position      = (from + to) / 2;
  const Vector3 x = (to - from).normalized();
  b.rotation << x, y, x.cross(y);
  return b;
}

const Vector3 ex = Vector3::UnitX(), ey = Vector3::UnitY(), ez = Vector3::UnitZ(), none = Vector3::Zero();

/* a channel of any name */
void look(Scene &scene, const Measure &m)
{
  static int count = 0;
  scene.channel("channel " + std::to_string(count++), m);
}

} // namespace

/* A01: a point on a massless rod, released from the horizontal; exact solution by Jacobi's elliptic functions */
TEST(SceneReferences, Pendulum)
{
  converges(
      "A01 pendulum, x, y, tension/30 N at t = 1",
      [](double eps) {
        Scene     scene(PETSC_COMM_SELF);
        PointMass p;
        double    error = 0;
        p.position      = -ex;
        scene.gravity(-9.81 * ey);
        const Marker  m = scene.marker(scene.add("bob", p)), o = scene.marker(scene.ground());
        const Element rod = scene.add("rod", PointDistance{m, o});
        scene.channel("x", Measure::displacement(m, 0));
        scene.channel("y", Measure::displacement(m, 1));
        scene.channel("Fx", Measure::jointForce(rod, 0, o));
        scene.channel("Fy", Measure::jointForce(rod, 1, o));
        Watched run(scene, 1, 0.5, sharp(eps), [&](double t, const std::vector<double> &c) {
          if (t < 0.4) return;
          const bool half = t < 0.9;
          Widen(error, c[0], half ? -0.391048791550546388 : 0.986291751131875319);
          Widen(error, c[1], half ? -0.920369948785192204 : -0.165010853125541169);
          Widen(error, std::hypot(c[2], c[3]) / 30, (half ? 27.0864875927482066 : 4.8562694074846766) / 30);
        });
        return error;
      },
      1e-6, 1e-8, 1e-4);
}

/* A02: uprights and couplers of 1 m, released upright; exact solution by elliptic integrals. In space the constraints
   are redundant */
static double fourBars(Space space, const std::string &options, int windows = 2, double end = 1)
{
  const hhtex::FourBar exact(windows, end);
  std::vector<double>  u(exact.n), v(exact.n), a(exact.n);
  std::vector<Marker>  tops;
  Scene                scene(PETSC_COMM_SELF, space);
  double               error = 0;
  scene.gravity(-9.81 * ey);
  for (int k = 0; k <= windows; k++) {
    RigidBody b        = rod(1, 1e-3, 1. / 12, {1. * k, 0, 0}, {1. * k, 1, 0}, -ex);
    b.velocity         = 0.5 * ex;
    b.angular_velocity = -ez;
    const Body body    = scene.add("upright " + std::to_string(k), b);
    scene.add("", Revolute{scene.marker(body, -0.5 * ex), scene.marker(scene.ground(), {1. * k, 0, 0})});
    tops.push_back(scene.marker(body, 0.5 * ex));
  }
  for (int k = 0; k < windows; k++) {
    RigidBody b  = rod(1, 1e-3, 1. / 12, {1. * k, 1, 0}, {1. * k + 1, 1, 0}, ey);
    b.velocity   = ex;
    const Body c = scene.add("coupler " + std::to_string(k), b);
    scene.add("", Revolute{scene.marker(c, -0.5 * ex), tops[k]});
    scene.add("", Revolute{scene.marker(c, 0.5 * ex), tops[k + 1]});
  }
  scene.channel("x", Measure::displacement(tops[0], 0));
  scene.channel("y", Measure::displacement(tops[0], 1));
  Watched run(scene, end, end, options, [&](double t, const std::vector<double> &c) {
    if (t < end / 2) return;
    exact.reference(t, u.data(), v.data(), a.data());
    Widen(error, c[0], 2 * u[exact.upright(0)]);
    Widen(error, c[1], 2 * u[exact.upright(0) + 1]);
  });
  return error;
}
TEST(SceneReferences, FourBars)
{
  converges(
      "A02 four-bars in the plane, tip at t = 1", [](double eps) { return fourBars(Space::Planar, damped(eps)); }, 1e-6, 1e-8,
      2e-4);
  Printed quiet; /* messages about redundant rows that are dropped */
  EXPECT_LT(fourBars(Space::Spatial, damped(1e-7)), 1e-3);
}

/* The mechanism passes the flat position, where Phi_q loses rank, ten times: the error decreases with h^2, also at
   tolerances near rounding */
TEST(SceneReferences, FourBarsWithManyLoops)
{
  for (int windows : {1, 10}) {
    double before = 0;
    for (double h : {7.8125e-4, 3.90625e-4, 1.953125e-4}) {
      const double e = fourBars(Space::Planar, tolerance(1e-6) + text("-ts_adapt_type none -ts_dt %.17g", h), windows, 10);
      MEASURED("A02, N = %d, h = %g: error %.2e at t = 10", windows, h, e);
      EXPECT_LT(e, before > 0 ? before / 3 : 2e-4);
      before = e;
    }
    const double e = fourBars(Space::Planar, tolerance(1e-10), windows, 10);
    MEASURED("A02, N = %d, tolerance 1e-10: error %.2e at t = 10", windows, e);
    EXPECT_LT(e, 1e-4);
  }
}

/* Spatial slider-crank against the equation of motion in terms of the crank's angle */
TEST(SceneReferences, SliderCrank)
{
  converges(
      "spatial slider-crank, slider to t = 1",
      [](double eps) {
        const Vector3 A(0, 0.1, 0.12), B(0, 0.1, 0.2), S(0.2, 0, 0), n = (S - B).cross(ex).normalized(), w = 6 * ex;
        const Matrix3 X = axes(ey, ex);
        Scene         scene(PETSC_COMM_SELF);
        double        error = 0;
        scene.gravity(-9.81 * ez);
        RigidBody crank, slider, link = rod(0.5, 4e-4, 4e-3, B, S, n);
        crank.mass             = 0.12;
        crank.inertia          = Vector3(1e-4, 1e-4, 1e-5).asDiagonal();
        crank.position         = (A + B) / 2;
        crank.angular_velocity = w;
        crank.velocity         = w.cross(B - A) / 2;
        link.angular_velocity  = {1.92, -0.96, 0.48};
        link.velocity          = {0.12, -0.24, 0};
        slider.mass            = 2;
        slider.position        = S;
        slider.velocity        = 0.24 * ex;
        const Body c = scene.add("crank", crank), r = scene.add("rod", link), s = scene.add("slider", slider),
                   g = scene.ground();
        scene.add("pin", Revolute{scene.markerAt(c, A, X), scene.markerAt(g, A, X)});
        scene.add("ball", Spherical{scene.markerAt(r, B), scene.markerAt(c, B)});
        scene.add("cross", Universal{scene.markerAt(r, S, axes(ex, n)), scene.markerAt(s, S, X)});
        scene.add("guide", Translational{scene.markerAt(s, S, X), scene.marker(g, none, X)});
        scene.channel("x", Measure::displacement(scene.marker(s), 0));
        hhtex::SliderCrankReference exact(6);
        Watched                     run(scene, 1, 0.02, damped(eps),
                                        [&](double t, const std::vector<double> &v) { Widen(error, v[0], exact.slider(t)); });
        return error;
      },
      1e-6, 1e-8, 5e-5);
}

/* A04: also closure of the loop and energy, with the redundant row dropped by the scene */
TEST(SceneReferences, Bricard)
{
  using Reference    = hhtex::BricardReference;
  double     closure = 0, drift = 0, start = 0;
  Printed    quiet;
  const auto run = [&](double eps) {
    Scene scene(PETSC_COMM_SELF);
    scene.gravity(-9.81 * ey);
    const Matrix3       along[3] = {axes(ey, ex), axes(ez, ey), axes(ex, ez)};
    std::vector<Marker> P;
    Body                before = scene.ground();
    double              error  = 0;
    for (int k = 0; k < 6; k++) {
      const Vector3  x    = Reference::point(k);
      const Matrix3 &R    = along[Reference::axis(k)];
      Body           next = scene.ground();
      if (k < 5) {
        const Vector3 d = Reference::point(k + 1) - x, y = Vector3::Unit(Reference::axis(k));
        next = scene.add("", rod(1, 0.01 / 6, 1.01 / 12, x, x + d, y));
      }
      P.push_back(scene.markerAt(before, x, R));
      scene.add("", Revolute{scene.markerAt(next, x, R), P.back()});
      before = next;
    }
    for (int k = 2; k < 6; k++)
      for (int c = 0; c < 3; c++) look(scene, Measure::displacement(P[k], c));
    scene.channel("T", energy(Measure::KineticEnergy));
    scene.channel("V", energy(Measure::PotentialEnergy));
    Reference exact(0.1);
    closure = drift = 0;
    Watched w(scene, 2, 0.05, damped(eps), [&](double t, const std::vector<double> &c) {
      Vector3 p[6];
      Reference::points(exact.at(t), p);
      if (t == 0) start = c[12] + c[13];
      for (int k = 2; k < 6; k++)
        Widen(k < 5 ? error : closure, (Eigen::Map<const Vector3>(&c[3 * k - 6]) - p[k]).norm());
      Widen(drift, c[12] + c[13], start);
    });
    return error;
  };
  const double a = run(1e-6), b = run(1e-8);
  EXPECT_LT(b, 1e-4);
  EXPECT_LT(b, a / 10);
  EXPECT_LT(closure, 1e-8);
  EXPECT_LT(drift, 1e-3);
}

/* A05 for a second */
TEST(SceneReferences, Flyball)
{
  hhtex::FlyballReference exact; /* expensive because of its stiffness, hence computed once */
  converges(
      "A05 governor, slider and tip to t = 1",
      [&](double eps) {
        const Vector3 w = 2 * M_PI * ez;
        Scene         scene(PETSC_COMM_SELF);
        double        error = 0;
        scene.gravity(-9.81 * ez);
        RigidBody shaft, slider;
        shaft.mass              = 0.3;
        shaft.inertia           = Vector3(1.0001, 1.0001, 2e-4).asDiagonal() * 0.025;
        shaft.position          = 0.5 * ez;
        shaft.angular_velocity  = w;
        slider.mass             = 3;
        slider.inertia          = Matrix3::Identity() * 0.005;
        slider.position         = 0.5 * ez;
        slider.angular_velocity = w;
        const Body   S = scene.add("shaft", shaft), Z = scene.add("slider", slider);
        const Marker axis = scene.marker(S);
        scene.add("bearing", Revolute{axis, scene.marker(scene.ground(), 0.5 * ez)});
        scene.add("guide", Translational{scene.marker(Z), axis});
        for (double side : {1., -1.}) {
          /* rod and end mass as one body on a hinge: the centre of mass is at (0.15 + 5)/5.3 of the rod */
          const Vector3 hinge(0.05 * side, 0, 1), out(std::cos(M_PI / 6) * side, 0, -0.5);
          const double  c = 5.15 / 5.3, across = 0.025 * 1.0001 + 0.3 * (c - 0.5) * (c - 0.5) + 5 * (1 - c) * (1 - c);
          RigidBody     arm    = rod(5.3, 0.025 * 2e-4, across, hinge, hinge + out, ey);
          arm.center           = (c - 0.5) * ex;
          arm.velocity         = w.cross(Vector3(hinge + c * out));
          arm.angular_velocity = w;
          const Body R         = scene.add("", arm);
          scene.add("", Revolute{scene.markerAt(R, hinge, axes(ez, ey)), scene.markerAt(S, hinge, axes(ez, ey))});
          scene.add("", SpringDamper{scene.marker(R), scene.markerAt(Z, {0.05 * side, 0, 0.5}), 8e5, 4e4, 0.5});
          const Marker tip = scene.marker(R, 0.5 * ex);
          for (int k = 0; k < 3; k++) look(scene, Measure::displacement(tip, k));
        }
        scene.channel("s", Measure::displacement(scene.marker(Z), 2));
        Watched run(scene, 1, 0.05, damped(eps), [&](double t, const std::vector<double> &v) {
          const auto    y = exact.at(t);
          const double  r = 0.05 + std::cos(y.p);
          const Vector3 tip(r * std::cos(y.turn), r * std::sin(y.turn), 1 - std::sin(y.p));
          Widen(error, (Vector3(v[0], v[1], v[2]) - tip).norm());
          Widen(error, (Vector3(-v[3], -v[4], v[5]) - tip).norm());
          Widen(error, v[6], y.s);
        });
        EXPECT_LT(run.s.steps, 2000); /* the steps do not follow the stiffness, whose time scale is 1/27000 s */
        return error;
      },
      1e-6, 1e-8, 5e-5);
}

/* The heavy top of Bruels and Cardona up to its first table time, including the reaction; with constant steps, since
   every change of the step excites the multipliers */
TEST(SceneReferences, HeavyTop)
{
  const Vector3 x(.60555056137707, .59895768179494, -.52398302743003), Om(-2.6915909121430, 150, 4.9172609898946),
      F(-640.2364079921, -148.6277113470, 136.9293130385);
  double error[2][3];
  for (int fine : {0, 1}) {
    Scene     scene(PETSC_COMM_SELF);
    RigidBody b;
    scene.gravity(-9.81 * ez);
    b.mass              = 15;
    b.inertia           = Vector3(0.234375, 0.46875, 0.234375).asDiagonal();
    b.position          = ey;
    b.angular_velocity  = {0, 150, -4.61538};
    b.velocity          = b.angular_velocity.cross(ey);
    const Body    B     = scene.add("top", b);
    const Marker  pivot = scene.marker(B, -ey);
    const Element joint = scene.add("pivot", Spherical{pivot, scene.marker(scene.ground())});
    for (int k = 0; k < 3; k++) look(scene, Measure::displacement(scene.marker(B), k));
    for (int k = 0; k < 3; k++) look(scene, Measure::angularVelocity(pivot, k, {}, pivot));
    for (int k = 0; k < 3; k++) look(scene, Measure::jointForce(joint, k));
    Watched run(scene, 0.2, 0.2, fixedSteps(fine ? 5e-5 : 1e-4) + " -ts_hhtdae_corrector_tolerance 1e-6 ", [&](double t, const std::vector<double> &c) {
      if (t < 0.1) return;
      error[fine][0] = (Eigen::Map<const Vector3>(&c[0]) - x).norm();
      error[fine][1] = (Eigen::Map<const Vector3>(&c[3]) - Om).norm();
      error[fine][2] = (Eigen::Map<const Vector3>(&c[6]) - F).norm();
    });
  }
  const double bound[] = {1e-7, 1e-4, 2e-3};
  for (int k = 0; k < 3; k++) {
    MEASURED("heavy top, %s at t = 0.2: error %.2e with h = 1e-4, %.2e with 5e-5",
             k == 0   ? "x"
             : k == 1 ? "Omega"
                      : "F",
             error[0][k], error[1][k]);
    EXPECT_LT(error[1][k], bound[k]);
    EXPECT_LT(error[1][k], error[0][k] * 0.6);
  }
}

/* A body tumbles about its middle axis on a ball joint: Euler angles are referred to new axes repeatedly, without loss
   of steps */
TEST(SceneReferences, Tumbling)
{
  for (Rotations rotations : {Rotations::Local, Rotations::Euler313}) {
  Scene     scene(PETSC_COMM_SELF);
  scene.start().rotations = rotations;
  RigidBody b;
  double    start = 0, drift = 0, largest = 0;
  scene.gravity(-9.81 * ez);
  b.inertia          = Vector3(0.1, 0.2, 0.3).asDiagonal();
  b.position         = 0.5 * ex;
  b.angular_velocity = {0.4, 4, 0.4};
  b.velocity         = b.angular_velocity.cross(b.position);
  const Body B       = scene.add("body", b);
  scene.add("pivot", Spherical{scene.marker(B, -0.5 * ex), scene.marker(scene.ground())});
  scene.channel("T", energy(Measure::KineticEnergy));
  scene.channel("V", energy(Measure::PotentialEnergy));
  Watched run(scene, 60, 0.1, damped(1e-6), [&](double t, const std::vector<double> &c) {
    if (t == 0) start = c[0] + c[1];
    Widen(drift, c[0] + c[1], start);
    largest = std::max(largest, c[0]);
  });
  MEASURED("tumbling for 60 s: %d changes of axes, %d steps, %d rejected, energy to %.1e of %.1f J", (int)run.s.changes,
           (int)run.s.steps, (int)run.s.rejected, drift, largest);
  EXPECT_EQ(run.s.changes > 10, rotations == Rotations::Euler313);
  EXPECT_LT(run.s.rejected, run.s.steps / 10);
  EXPECT_LT(drift, 0.02 * largest);
  }
}

/* A ball rolls down a slope: 5/7 g sin, friction 2/7 m g sin, normal force m g cos. For rotation about a fixed axis a
   local rotation vector has no error */
TEST(SceneReferences, RollingBall)
{
  const auto error = [](double eps, Rotations rotations) {
    const double  s = 0.4, r = 0.3, a = 5. / 7 * 9.81 * std::sin(s);
    const Matrix3 plane = Eigen::AngleAxisd(s, ey).toRotationMatrix();
    Scene         scene(PETSC_COMM_SELF);
    RigidBody     b;
    double        error     = 0;
    scene.start().rotations = rotations;
    scene.gravity(-9.81 * ez);
    b.mass             = 2;
    b.inertia          = Matrix3::Identity() * (0.8 * r * r);
    b.position         = plane.col(2) * r;
    b.velocity         = 0.7 * plane.col(1);
    b.angular_velocity = -0.7 / r * plane.col(0);
    const Marker  ramp = scene.marker(scene.ground(), none, plane), c = scene.marker(scene.add("ball", b));
    const Element roll = scene.add("rolling", RollingSphere{c, ramp, r});
    for (int k = 0; k < 3; k++) look(scene, Measure::displacement(c, k, ramp, ramp));
    for (int k = 0; k < 3; k++) look(scene, Measure::multiplier(roll, k));
    const Vector3 F(19.62 * std::cos(s), -0.8 * a, 0);
    Watched       run(scene, 2, 0.1, sharp(eps), [&](double t, const std::vector<double> &v) {
      Widen(error, (Eigen::Map<const Vector3>(&v[0]) - Vector3(a * t * t / 2, 0.7 * t, r)).norm());
      Widen(error, (Eigen::Map<const Vector3>(&v[3]) - F).norm() / 20);
    });
    return error;
  };
  converges("ball on a slope, x and force/20 N to t = 2", [&](double eps) { return error(eps, Rotations::Euler313); }, 1e-6, 1e-8, 1e-4);
  EXPECT_LT(error(1e-6, Rotations::Local), 1e-6);
}

/* A quarter car passes a curb: the tire loses contact and regains it */
TEST(SceneReferences, QuarterCar)
{
  hhtex::QuarterCarReference::Parameters p;
  p.road = TimeFunction::step5(0.1, 0, 0.14, 0.1);
  hhtex::QuarterCarReference exact(p);
  const double               hub = 0.3 - p.sink();
  double                     air = 0;
  converges(
      "quarter car over a curb, heights to t = 1",
      [&](double eps) {
        Scene      scene(PETSC_COMM_SELF);
        RigidBody  wheel, body, road;
        ContactLaw law;
        double     error = 0;
        scene.gravity(-9.81 * ez);
        wheel.mass         = p.wheel;
        wheel.position     = hub * ez;
        body.mass          = p.body;
        body.position      = ez;
        const Marker datum = scene.marker(scene.ground()), w = scene.marker(scene.add("wheel", wheel)),
                     b = scene.marker(scene.add("body", body)), r = scene.marker(scene.add("road", road));
        for (Marker m : {w, b, r}) scene.add("", Translational{m, datum});
        scene.add("", TranslationalMotion{r, datum, p.road});
        scene.add("suspension", SpringDamper{b, w, p.stiffness, p.damping, -1, -p.body * 9.81});
        law.stiffness = p.tire;
        law.damping   = p.tire_damping;
        scene.add("tire", SpherePlane{w, r, 0.3, law});
        look(scene, Measure::displacement(b, 2));
        look(scene, Measure::displacement(w, 2));
        air = 0;
        Watched run(scene, 1, 0.002, damped(eps), [&](double t, const std::vector<double> &v) {
          Widen(error, v[0] - 1, exact.body(t));
          Widen(error, v[1] - hub, exact.wheel(t));
          if (exact.tire(t) == 0) air += 0.002;
        });
        return error;
      },
      1e-6, 1e-8, 2e-5);
  EXPECT_GT(air, 0.02);
}
