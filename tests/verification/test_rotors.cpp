/*
  Rotors in moving frames, compared with their equations in minimal coordinates, which are extrapolated in long double: a gyroscope in
  massive rings (gimbals), modelled by bodies and hinges, and a disc with an unbalance on a flexible shaft.
*/
#include "../../examples/problems/extrapolation.h"
#include "../../examples/scene_watch.h"
#include "hhtdae/helpers.h"
#include "scene_output.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

Matrix3 about(const Vector3 &axis, double angle) { return Eigen::AngleAxisd(angle, axis).toRotationMatrix(); }

/* Differences between two runs with steps h and h/2 and the exact solution, at 20 times */
struct Errors {
  double error[2];
  double order() const { return std::log2(error[0] / error[1]); }
};

/*
  The outer ring rotates by psi about the vertical, the inner ring by theta about x of the outer ring, the rotor by phi about z of the inner ring.
  With the constant w = phi' + psi' cos theta, and s, c = sin theta, cos theta

    D psi' + C w c = p,  D = Jo + (Iy + A) s^2 + Iz c^2,      (Ix + A) theta'' = psi'^2 s c (Iy + A - Iz) - C w psi' s + m g l s
*/
struct Gyroscope {
  const double Jo = 0.02, I[3] = {0.01, 0.012, 0.006}, mass = 0.5, l = 0.06, A = 0.008, C = 0.015, g = 9.81; /* of the inner ring, about its centre of mass */
  const double theta = 1, yaw = -0.5, spin = 60;
  const double Ix = I[0] + mass * l * l, Iy = I[1] + mass * l * l, Iz = I[2];
  const double w = spin + yaw * std::cos(theta);
  hhtex::Extrapolation motion{[this](long double, const long double *y, long double *f) { rates(y, f); }, 0.L, 1e-2, {0, theta, 0, 0}};

  long double inertia(long double s, long double c) const { return Jo + (Iy + A) * s * s + Iz * c * c; }
  void rates(const long double *y, long double *f) const /* y: psi, theta, phi, theta' */
  {
    const long double s = std::sin(y[1]), c = std::cos(y[1]), s0 = std::sin((long double)theta), c0 = std::cos((long double)theta);
    const long double psi = (inertia(s0, c0) * yaw + C * w * (c0 - c)) / inertia(s, c);
    f[0]                  = psi;
    f[1]                  = y[3];
    f[2]                  = w - psi * c;
    f[3]                  = (psi * psi * s * c * (Iy + A - Iz) - C * w * psi * s + mass * g * l * s) / (Ix + A);
  }
  /* Position of a point on the rotor's rim */
  Vector3 rim(double t)
  {
    const auto y = motion.at(t);
    return about(Vector3::UnitZ(), (double)y[0]) * about(Vector3::UnitX(), (double)y[1]) * about(Vector3::UnitZ(), (double)y[2]) * Vector3(0.1, 0, 0.02);
  }
};

double errorOf(Gyroscope &exact, double end, double h, Rotations rotations)
{
  Scene         scene(PETSC_COMM_SELF);
  RigidBody     outer, inner, rotor;
  double        worst = 0;
  const Matrix3 tilt = about(Vector3::UnitX(), exact.theta);
  const Vector3 x = Vector3::UnitX(), axis = tilt.col(2), turning(0, 0, exact.yaw);
  scene.start().rotations = rotations;
  scene.gravity({0, 0, -exact.g});
  outer.inertia          = Vector3(0.03, 0.01, exact.Jo).asDiagonal();
  outer.angular_velocity = turning;
  inner.mass             = exact.mass;
  inner.inertia          = Vector3(exact.I[0], exact.I[1], exact.I[2]).asDiagonal();
  inner.center           = {0, 0, exact.l};
  inner.rotation         = tilt;
  inner.angular_velocity = turning;
  inner.velocity         = turning.cross(exact.l * axis);
  rotor.inertia          = Vector3(exact.A, exact.A, exact.C).asDiagonal();
  rotor.rotation         = tilt;
  rotor.angular_velocity = turning + exact.spin * axis;
  const Body one = scene.add("outer", outer), two = scene.add("inner", inner), three = scene.add("rotor", rotor);
  scene.add("yaw", Revolute{scene.marker(one), scene.marker(scene.ground())});
  scene.add("pitch", Revolute{scene.marker(two, Vector3::Zero(), axesAlong(x)), scene.marker(one, Vector3::Zero(), axesAlong(x))});
  scene.add("spin", Revolute{scene.marker(three), scene.marker(two)});
  for (int c = 0; c < 3; c++) scene.channel("", Measure::displacement(scene.marker(three, {0.1, 0, 0.02}), c));
  SceneRun     run(scene, end, fixedSteps(h) + " -ts_hhtdae_corrector_tolerance 1e-6 ");
  hhtex::Watch watch(scene, end / 20, [&](double t, const std::vector<double> &p) { widen(worst, (Eigen::Map<const Vector3>(p.data()) - exact.rim(t)).norm()); });
  must(watch.attach(run.ts));
  must(run.solve());
  return worst;
}

/*
  Displacement z = x + iy of the shaft's end and slope s, both complex; the disc's centre of mass is at the distance e
  (campbell.cpp computes the frequencies):

    m (z'' - e speed^2 exp(i speed t)) + 12 EI/L^3 z - 6 EI/L^2 s = 0,      It s'' - i Ip speed s' - 6 EI/L^2 z + 4 EI/L s = 0
*/
struct Shaft {
  const double L = 0.5, radius = 0.01, E = 2.1e11, mass = 8, It = 0.045, Ip = 0.09, e = 1e-5, speed;
  const double inertia = M_PI * std::pow(radius, 4) / 4;
  hhtex::Extrapolation motion{[this](long double t, const long double *y, long double *f) { rates(t, y, f); }, 0.L, 1e-3, {0, 0, 0, 0, 0, 0, 0, 0}};

  explicit Shaft(double at) : speed(at) {}
  void rates(long double t, const long double *y, long double *f) const /* x, y of z, of s, and their rates */
  {
    const long double k = E * inertia / L;
    for (int i = 0; i < 4; i++) f[i] = y[4 + i];
    for (int i = 0; i < 2; i++) {
      const long double turn = i ? std::sin(speed * t) : std::cos(speed * t), across = i ? y[6] : -y[7];
      f[4 + i] = e * speed * speed * turn - (12 * k / (L * L) * y[i] - 6 * k / L * y[2 + i]) / mass;
      f[6 + i] = (Ip * speed * across + 6 * k / L * y[i] - 4 * k * y[2 + i]) / It;
    }
  }
  Vector3 end(double t)
  {
    const auto y = motion.at(t);
    return {(double)y[0], (double)y[1], L};
  }
};

double errorOf(Shaft &exact, double end, double h, Rotations rotations)
{
  Scene         scene(PETSC_COMM_SELF);
  RigidBody     hub, disc;
  Beam          shaft;
  double        worst = 0;
  const Matrix3 along = axesAlong(Vector3::UnitX(), Vector3::UnitZ());
  scene.start().rotations = rotations;
  hub.angular_velocity    = {0, 0, exact.speed};
  disc.mass               = exact.mass;
  disc.inertia            = Vector3(exact.It, exact.It, exact.Ip).asDiagonal();
  disc.center             = {exact.e, 0, 0};
  disc.position           = {0, 0, exact.L};
  disc.velocity           = {0, exact.speed * exact.e, 0};
  disc.angular_velocity   = {0, 0, exact.speed};
  const Body at = scene.add("hub", hub), wheel = scene.add("disc", disc);
  shaft.i      = scene.marker(wheel, Vector3::Zero(), along);
  shaft.j      = scene.marker(at, Vector3::Zero(), along);
  shaft.length = exact.L;
  shaft.E      = exact.E;
  shaft.G      = 8e10;
  shaft.area   = M_PI * exact.radius * exact.radius;
  shaft.Iyy = shaft.Izz = exact.inertia;
  shaft.J               = 2 * exact.inertia;
  const Marker turning  = scene.marker(at), still = scene.marker(scene.ground());
  scene.add("bearing", Revolute{turning, still});
  scene.add("drive", RotationalMotion{turning, still, TimeFunction::polynomial({0, exact.speed})});
  scene.add("shaft", shaft);
  for (int c = 0; c < 3; c++) scene.channel("", Measure::displacement(shaft.i, c));
  SceneRun     run(scene, end, fixedSteps(h) + " -ts_hhtdae_corrector_tolerance 1e-6 ");
  hhtex::Watch watch(scene, end / 20, [&](double t, const std::vector<double> &p) { widen(worst, (Eigen::Map<const Vector3>(p.data()) - exact.end(t)).norm()); });
  must(watch.attach(run.ts));
  must(run.solve());
  return worst;
}

template <class Exact> Errors errorsOf(Exact &exact, double end, double h, Rotations rotations)
{
  return {{errorOf(exact, end, h, rotations), errorOf(exact, end, h / 2, rotations)}};
}

} // namespace

TEST(Rotors, GyroscopeInACage)
{
  Gyroscope    exact;
  const Errors local = errorsOf(exact, 2, 1e-3, Rotations::Local), euler = errorsOf(exact, 2, 1e-3, Rotations::Euler313);
  MEASURED("errors of a point of the rim, h = 1e-3 and half of it: %.2e, %.2e m, Euler angles %.2e, %.2e", local.error[0], local.error[1], euler.error[0], euler.error[1]);
  EXPECT_NEAR(local.order(), 2, 0.1);
  EXPECT_LT(local.error[1], 1e-5);
  EXPECT_LT(local.error[1], 1.5 * euler.error[1]); /* whose Euler angles are here the angles of the cage's hinges */
}

/* Speed between the first and the second critical speed */
TEST(Rotors, UnbalanceOnAFlexibleShaft)
{
  for (double speed : {40., 300.}) {
    Shaft        exact(speed);
    const Errors local = errorsOf(exact, 1, 2e-4, Rotations::Local), euler = errorsOf(exact, 1, 2e-4, Rotations::Euler313);
    MEASURED("%g rad/s: errors of the shaft's end, h = 2e-4 and half of it: %.2e, %.2e m, Euler angles %.2e, %.2e", speed, local.error[0], local.error[1], euler.error[0], euler.error[1]);
    EXPECT_NEAR(local.order(), 2, 0.3);
    EXPECT_LT(local.error[1], 0.01 * exact.e);
    EXPECT_LT(local.error[1], 1.03 * euler.error[1]);
  }
}
