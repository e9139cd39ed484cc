/* Stiff springs and bushings, modes far faster than the motion, mass ratios, links almost without mass */
#ifndef HHTDAE_BENCH_STABILITY_STIFF_H
#define HHTDAE_BENCH_STABILITY_STIFF_H

#include "../../examples/problems/oscillators.h"
#include "../../examples/problems/pendulum.h"
#include "../../examples/problems/springpendulum.h"
#include "stability_models.h"

namespace hhtstab
{

/* ---- springs ---- */

/* A mass on a spring of k N/m, released from the horizontal: exact solution as far as it can be resolved, otherwise
   the rigid rod, whose distance is 100/k */
inline PetscErrorCode SpringCase(Run &run, double k)
{
  const hhtex::SpringPendulum p(k, 2);
  const hhtex::Pendulum       rod(90, 0, 2);
  PetscFunctionBegin;
  if (k <= 1e6) {
    PetscCall(ErrorOf(run, p, 1e-6));
    PetscFunctionReturn(0);
  }
  ProblemRun r(p);
  double     u[3], v[3], a[3];
  PetscCall(r.create(run, 1e-6));
  r.look = [&](double t, const double *x, const double *) {
    rod.reference(t, u, v, a);
    run.judge(std::hypot(x[0] - u[0], x[1] - u[1]));
  };
  PetscCall(run.solve(r.ts));
  PetscFunctionReturn(0);
}

/* A rod held by a bushing at one point: a physical pendulum except for a deflection mg/k */
inline PetscErrorCode BushingCase(Run &run, double k, double eps)
{
  using namespace hhtdae;
  const double theta = -PETSC_PI / 3, w = std::sqrt(9.81 * 0.5 / (1. / 3));
  Scene        scene(PETSC_COMM_SELF);
  RigidBody    rod;
  PetscFunctionBegin;
  rod.inertia  = Vector3(1e-3, 1. / 12, 1. / 12).asDiagonal();
  rod.rotation = Eigen::AngleAxisd(theta - PETSC_PI / 2, Vector3::UnitZ()).toRotationMatrix();
  rod.position = 0.5 * rod.rotation.col(0);
  const Body b = scene.add("rod", rod);
  Bushing    bushing;
  bushing.i         = scene.marker(b, {-0.5, 0, 0});
  bushing.j         = scene.marker(scene.ground(), Vector3::Zero(), rod.rotation);
  bushing.stiffness = {k, k, k};
  scene.add("bushing", bushing);
  scene.gravity({0, -9.81, 0});
  for (int c = 0; c < 2; c++) scene.channel(c ? "y" : "x", Measure::displacement(scene.marker(b), c));
  PetscCall(RunScene(run, scene, 2, eps, 0.02, [&](double t, const std::vector<double> &c) {
    const hhtex::PendulumMotion p(w, theta, 0, t);
    run.judge(std::hypot(c[0] - 0.5 * p.sine, c[1] + 0.5 * p.cosine));
  }));
  PetscFunctionReturn(0);
}

inline void AddSprings(Cases &cases)
{
  for (int d = 3; d <= 14; d++) {
    const double k = std::pow(10, d);
    Case        &c = Add(cases, "springs", Name("k=%.0e", k), d <= 6 ? "position, exact" : "position, rigid rod",
                         Allowed(1e-6, 5), [k](Run &r) { return SpringCase(r, k); });
    if (d == 14) c.test();
  }
  for (double k : {1e6, 1e10, 1e14})
    Add(cases, "springs", Name("bushing k=%.0e", k), "position, rigid joint", Allowed(1e-6, 3.5),
        [k](Run &r) { return BushingCase(r, k, 1e-6); });
  /* the stiffest bushing where the error test permits most: an energy of k eps^2/2 is 5e5 times that of the pendulum */
  for (double eps : {1e-4, 1e-5})
    Add(cases, "springs", Name("bushing k=1e+14 eps=%.0e", eps), "position, rigid joint", Allowed(eps, 3.5),
        [eps](Run &r) { return BushingCase(r, 1e14, eps); })
      .test();
}

/* ---- modes ---- */

/* A mode of 1e7 Hz beside one of 1 rad/s, both excited, at h omega from 1e-3 to 1e6, in 2000 fixed steps. The figure
   is in units of what the method promises: the slow mode within h^2 t, the fast one within (h omega)^2 omega t while
   it is resolved; above h omega = 0.1 the fast mode never exceeds twice its initial amplitude, and from h omega = 1 on
   it is damped out at the end */
inline PetscErrorCode ModeCase(Run &run, double h_omega)
{
  const double             w = 2 * PETSC_PI * 1e7, h = h_omega / w;
  const hhtex::Oscillators p({1, w}, {0, 0}, false, 2000 * h);
  ProblemRun               r(p);
  double                   last = 0, slow = 0, fast = 0;
  PetscFunctionBegin;
  PetscCall(r.create(run, 1e-8, h));
  r.look = [&](double t, const double *u, const double *) {
    last = u[1];
    hhtex::Widen(slow, (u[0] - std::cos(t)) / (h * h * t + 1e-9));
    hhtex::Widen(fast, h_omega <= 0.1 ? (u[1] - std::cos(w * t)) / (h_omega * h_omega * w * t + 1e-6) : u[1] / 2);
  };
  PetscCall(run.solve(r.ts));
  run.judge(slow);
  run.judge(fast);
  if (h_omega >= 1) run.judge(last / 1e-6);
  run.note("slow %.1e, fast %.1e of the bound; fast mode at the end %.1e", slow, fast, last);
  PetscFunctionReturn(0);
}

/* A tumbling body with modes of 0.1 to 10 MHz, which is a rigid one to 1e-10; the modes must not determine the step */
inline PetscErrorCode ModalCase(Run &run)
{
  using namespace hhtdae;
  const Vector3 J(1, 2, 3), spin(1, 0.5, 5);
  const int     modes = 5;
  FreeBody      exact(J, spin);
  auto          model = std::make_shared<ModalBody>();
  Scene         scene(PETSC_COMM_SELF);
  FlexibleBody  body;
  PetscFunctionBegin;
  model->name    = "stiff";
  model->mass    = 2;
  model->moments = Vector3(0.5 * J.sum() - J(0), 0.5 * J.sum() - J(1), 0.5 * J.sum() - J(2)).asDiagonal();
  model->omega =
      2 * PETSC_PI * Eigen::VectorXd::LinSpaced(modes, 5, 7).unaryExpr([](double x) { return std::pow(10, x); });
  model->first.setZero(3, modes);
  for (int c = 0; c < 3; c++) {
    model->moment[c].setZero(3, modes);
    model->moment[c].row(c).setConstant(0.3); /* centrifugal forces excite all of them */
    model->quadratic[c]     = Eigen::MatrixXd::Identity(modes, modes) / 3;
    model->quadratic[3 + c] = Eigen::MatrixXd::Zero(modes, modes);
  }
  ModalAttachment a;
  a.name        = "tip";
  a.position    = {1, 0, 0};
  a.translation = Eigen::MatrixXd::Constant(3, modes, 0.1);
  a.rotation    = Eigen::MatrixXd::Zero(3, modes);
  model->attachments.push_back(a);
  body.model            = model;
  body.angular_velocity = spin;
  const Body b          = scene.attachment(scene.add("body", body), "tip");
  for (int c = 0; c < 3; c++) scene.channel(std::string(1, "xyz"[c]), Measure::displacement(scene.marker(b), c));
  PetscCall(RunScene(run, scene, 5, 1e-6, 0.05, [&](double t, const std::vector<double> &c) {
    run.judge((Eigen::Map<const Vector3>(c.data()) - exact.axis(t, 0)).norm());
  }));
  run.note("largest h omega %.1e", run.out.s.h_max * 2 * PETSC_PI * 1e7);
  PetscFunctionReturn(0);
}

inline void AddModes(Cases &cases)
{
  for (int d = -3; d <= 6; d++) {
    const double x = std::pow(10, d);
    Case        &c = Add(cases, "modes", Name("h omega=%.0e", x), "error over the method's own bound", 1,
                         [x](Run &r) { return ModeCase(r, x); });
    if (d == 6 || d == 0) c.test();
  }
  Add(cases, "modes", "flexible body, 10 MHz", "attachment, rigid body", Allowed(1e-6, 25), ModalCase).paper(0.2);
}

/* ---- masses ---- */

/* Reference: two masses on massless rods, stretched at the start, in angles from the vertical */
struct TwoMasses {
  double                       ratio; /* m2/m1 */
  mutable hhtex::Extrapolation solution;
  static constexpr double      start = 0.92729521800161223; /* atan(0.8/0.6) */

  explicit TwoMasses(double r)
      : ratio(r), solution([r](long double, const long double *y, long double *f) { rates(r, y, f); }, 0.L,
                           0.01L / std::sqrt(1 + (long double)r), {start, start, 0, 0})
  {
  }
  static void rates(long double r, const long double *y, long double *f)
  {
    const long double g = 9.81L, d = y[0] - y[1], c = std::cos(d), s = std::sin(d), den = 1 + r * s * s;
    f[0] = y[2];
    f[1] = y[3];
    f[2] = (-r * s * (y[3] * y[3] + c * y[2] * y[2]) - g * ((1 + r) * std::sin(y[0]) - r * c * std::sin(y[1]))) / den;
    f[3] =
        (s * ((1 + r) * y[2] * y[2] + r * c * y[3] * y[3]) + g * (1 + r) * (c * std::sin(y[0]) - std::sin(y[1]))) / den;
  }
  /* beyond a ratio of 1e5 the light mass stays on the straight line between the pivot and the heavy mass, to 1/ratio */
  void at(double t, double x[4]) const
  {
    long double a, b;
    if (ratio > 1e5)
      a = b = hhtex::PendulumMotion(std::sqrt(9.81L / 2), start, 0, t).theta;
    else {
      const auto y = solution.at(t);
      a = y[0], b = y[1];
    }
    x[0] = (double)std::sin(a), x[1] = -(double)std::cos(a);
    x[2] = x[0] + (double)std::sin(b), x[3] = x[1] - (double)std::cos(b);
  }
};

inline PetscErrorCode MassCase(Run &run, double ratio)
{
  using namespace hhtdae;
  const TwoMasses exact(ratio);
  Scene           scene(PETSC_COMM_SELF, Space::Planar);
  double          x[4];
  PetscFunctionBegin;
  exact.at(0, x);
  Marker last = scene.marker(scene.ground());
  for (int k = 0; k < 2; k++) {
    PointMass m;
    m.mass          = k ? ratio : 1;
    m.position      = {x[2 * k], x[2 * k + 1], 0};
    const Marker at = scene.marker(scene.add(k ? "second" : "first", m));
    scene.add("", PointDistance{at, last});
    for (int c = 0; c < 2; c++) scene.channel("", Measure::displacement(at, c));
    last = at;
  }
  scene.gravity({0, -9.81, 0});
  PetscCall(RunScene(run, scene, 2, 1e-6, 0.02, [&](double t, const std::vector<double> &c) {
    exact.at(t, x);
    for (int k = 0; k < 4; k++) run.judge(c[k] - x[k]);
  }));
  PetscFunctionReturn(0);
}

/* Three rods on ball joints in space, of which the middle one is almost massless; judged by energy */
inline PetscErrorCode HeavyLightHeavy(Run &run, double ratio)
{
  using namespace hhtdae;
  Scene       scene(PETSC_COMM_SELF);
  EnergyDrift energy;
  PetscFunctionBegin;
  Marker last = scene.marker(scene.ground());
  for (int k = 0; k < 3; k++) {
    RigidBody rod;
    rod.mass             = k == 1 ? 1 : ratio;
    rod.inertia          = rod.mass * Matrix3(Vector3(1e-2, 1. / 12, 1. / 12).asDiagonal());
    rod.position         = {k + 0.5, 0, 0};
    rod.angular_velocity = {0, 0.4, 0}; /* all alike: out of the plane */
    rod.velocity         = rod.angular_velocity.cross(rod.position);
    const Body b         = scene.add("rod " + std::to_string(k), rod);
    scene.add("joint " + std::to_string(k), Spherical{scene.marker(b, {-0.5, 0, 0}), last});
    last = scene.marker(b, {0.5, 0, 0});
  }
  scene.gravity({0, -9.81, 0});
  EnergyChannels(scene);
  PetscCall(RunScene(run, scene, 1, 1e-6, 0.01, [&](double, const std::vector<double> &c) {
    energy(c);
    run.judge(energy.relative());
  }));
  PetscFunctionReturn(0);
}

/* ---- slider-crank: crank of length r, rod of length 1, masses 1, rod, 1; equation of motion in one coordinate by hand ---- */

struct SliderCrankByHand {
  long double r, rod;
  bool equal; /* crank as long as the rod: the rod's angle is minus that of the crank on the branch that inertia selects */
  mutable hhtex::Extrapolation solution;

  SliderCrankByHand(double crank, double rod_mass, double angle, double speed)
      : r(crank), rod(rod_mass), equal(crank == 1),
        solution([this](long double, const long double *y, long double *f) { rates(y, f); }, 0.L,
                 0.01L * (equal ? 1 : std::sqrt(1 - (long double)crank * crank)), {angle, speed})
  {
  }
  SliderCrankByHand(const SliderCrankByHand &) = delete;

  struct Place {
    double angle, rod, slider; /* angle of the crank, angle of the rod, position of the slider along x */
  };
  Place at(double t) const
  {
    const long double a = solution.at(t)[0], b = equal ? -a : -std::asin(r * std::sin(a));
    return {(double)a, (double)b, (double)(r * std::cos(a) + std::cos(b))};
  }

private:
  /* kinetic energy m(a) a'^2 / 2: m a'' + m' a'^2 / 2 + V' = 0 */
  void rates(const long double *y, long double *f) const
  {
    const long double s = std::sin(y[0]), c = std::cos(y[0]), g = 9.81L;
    long double       sb = -s, cb = c, b1 = -1, b2 = 0; /* the rod's angle and its derivatives with respect to a */
    if (!equal) {
      sb = -r * s, cb = std::sqrt(1 - sb * sb);
      b1 = -r * c / cb, b2 = (r * s + sb * b1 * b1) / cb;
    }
    const long double X1 = -r * s - sb * b1, X2 = -r * c - cb * b1 * b1 - sb * b2;           /* slider */
    const long double x1 = -r * s - sb * b1 / 2, x2 = -r * c - (cb * b1 * b1 + sb * b2) / 2; /* centre of the rod */
    const long double y1 = r * c + cb * b1 / 2, y2 = -r * s + (cb * b2 - sb * b1 * b1) / 2;
    const long double m    = r * r / 3 + X1 * X1 + rod * (x1 * x1 + y1 * y1 + b1 * b1 / 12);
    const long double half = X1 * X2 + rod * (x1 * x2 + y1 * y2 + b1 * b2 / 12);
    f[0]                   = y[1];
    f[1]                   = -(half * y[1] * y[1] + g * (r * c / 2 + rod * y1)) / m;
  }
};

inline PetscErrorCode SliderCrankCase(Run &run, double crank, double rod_mass, double angle, double speed, double end,
                                      double tolerance)
{
  using namespace hhtdae;
  SliderCrankByHand exact(crank, rod_mass, angle, speed);
  Scene             scene(PETSC_COMM_SELF, Space::Planar);
  PetscFunctionBegin;
  const double  b = exact.at(0).rod, db = crank == 1 ? -speed : -crank * std::cos(angle) * speed / std::cos(b);
  const Vector3 along(std::cos(angle), std::sin(angle), 0), rod_along(std::cos(b), std::sin(b), 0), P = crank * along,
                                                                                                    S = P + rod_along;
  const auto turned = [](double w, const Vector3 &x) { return Vector3(-w * x(1), w * x(0), 0); };
  RigidBody  c, r, s;
  c.rotation = Eigen::AngleAxisd(angle, Vector3::UnitZ()).toRotationMatrix();
  r.rotation = Eigen::AngleAxisd(b, Vector3::UnitZ()).toRotationMatrix();
  r.mass     = rod_mass;
  c.inertia  = Matrix3::Identity() * crank * crank / 12;
  r.inertia  = Matrix3::Identity() * rod_mass / 12;
  c.position = P / 2, r.position = P + rod_along / 2, s.position = S;
  c.angular_velocity(2) = speed, r.angular_velocity(2) = db;
  c.velocity = turned(speed, c.position), r.velocity = turned(speed, P) + turned(db, rod_along) / 2;
  s.velocity   = turned(speed, P) + turned(db, rod_along);
  const Body C = scene.add("crank", c), R = scene.add("rod", r), L = scene.add("slider", s);
  scene.add("main bearing", Revolute{scene.marker(C, {-crank / 2, 0, 0}), scene.marker(scene.ground())});
  scene.add("crank pin", Revolute{scene.marker(R, {-0.5, 0, 0}), scene.marker(C, {crank / 2, 0, 0})});
  scene.add("slider pin", Revolute{scene.marker(R, {0.5, 0, 0}), scene.marker(L)});
  scene.add("guide", Translational{scene.marker(L), scene.marker(scene.ground())});
  scene.gravity({0, -9.81, 0});
  scene.channel("slider", Measure::displacement(scene.marker(L), 0));
  for (int k = 0; k < 2; k++) scene.channel(k ? "y" : "x", Measure::displacement(scene.marker(R), k));
  PetscCall(RunScene(run, scene, end, tolerance, 0.01, [&](double t, const std::vector<double> &x) {
    const auto p = exact.at(t);
    run.judge(x[0] - p.slider);
    run.judge(x[1] - (crank * std::cos(p.angle) + std::cos(p.rod) / 2));
    run.judge(x[2] - (crank * std::sin(p.angle) + std::sin(p.rod) / 2));
  }));
  PetscFunctionReturn(0);
}

inline void AddMasses(Cases &cases)
{
  for (double x : {1e-10, 1e-6, 1e-3, 1e3, 1e6, 1e8, 1e10})
    Add(cases, "masses", Name("two masses 1:%.0e", x), "position, exact", Allowed(1e-6, 8),
        [x](Run &r) { return MassCase(r, x); });
  for (double x : {1e5, 1e10})
    Add(cases, "masses", Name("heavy-light-heavy %.0e", x), "energy over the kinetic", 1e-2, [x](Run &r) {
      return HeavyLightHeavy(r, x);
    }).paper(5e-2);
  for (double m : {1e-3, 1e-6, 1e-9, 1e-12})
    Add(cases, "masses", Name("slider-crank, rod %.0e kg", m), "position, exact", Allowed(1e-6, 16), [m](Run &r) {
      return SliderCrankCase(r, 0.3, m, 1, 8, 2, 1e-6);
    }).test();
}

} // namespace hhtstab

#endif
