/* Application functions that fail now and then or permanently; bodies that leave the range in which their elements are
   defined */
#ifndef HHTDAE_BENCH_STABILITY_FAULTS_H
#define HHTDAE_BENCH_STABILITY_FAULTS_H

#include "../../examples/problems/pendulum.h"
#include "stability_models.h"

namespace hhtstab
{

/* ---- application functions ---- */

struct Spoiled : hhtex::Pendulum {
  int         every; /* every so many calls are spoiled; 0: all calls from t = 0.5 on */
  double      value;
  bool        matrix; /* spoils the Jacobian instead of the residual */
  mutable int calls = 0;
  Spoiled(int n, double with, bool in_matrix) : Pendulum(-60, 1, 2), every(n), value(with), matrix(in_matrix) {}
  bool now(double t) const { return every ? t > 0.1 && ++calls % every == 0 : t > 0.5; }
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    Pendulum::residual(t, u, v, a, f);
    if (!matrix && now(t)) f[1] = value;
  }
  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa,
                hhtex::Entries &J) const override
  {
    Pendulum::jacobian(t, u, v, a, sv, sa, J);
    if (matrix && now(t)) J.value[0] = value;
  }
};

inline PetscErrorCode SpoiledCase(Run &run, int every, double value, bool matrix)
{
  const Spoiled p(every, value, matrix);
  PetscFunctionBegin;
  PetscCall(ErrorOf(run, p, 1e-6));
  PetscFunctionReturn(0);
}

/* Calls SNESSetFunctionDomainError() before the application's residual */
struct OutsideDomain {
  TSI2Function inner;
  void        *ctx;
  int          every, calls = 0;
};

inline PetscErrorCode WithDomain(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *ctx)
{
  auto *d = static_cast<OutsideDomain *>(ctx);
  SNES  snes;
  PetscFunctionBegin;
  PetscCall(d->inner(ts, t, U, V, A, F, d->ctx));
  if (d->every ? t > 0.1 && ++d->calls % d->every == 0 : t > 0.5) {
    PetscCall(TSGetSNES(ts, &snes));
    PetscCall(SNESSetFunctionDomainError(snes));
  }
  PetscFunctionReturn(0);
}

inline PetscErrorCode DomainCase(Run &run, int every)
{
  const hhtex::Pendulum p(-60, 1, 2);
  ProblemRun            r(p);
  AgainstReference      error(p);
  OutsideDomain         domain = {nullptr, nullptr, every};
  Vec                   F;
  PetscFunctionBegin;
  PetscCall(r.create(run, 1e-6));
  PetscCall(TSGetI2Function(r.ts, &F, &domain.inner, &domain.ctx));
  PetscCall(TSSetI2Function(r.ts, nullptr, WithDomain, &domain));
  r.look                    = [&](double t, const double *u, const double *v) { error(t, u, v); };
  const PetscErrorCode code = run.solve(r.ts);
  run.judge(error.q);
  PetscFunctionReturn(code);
}

/* A user's force in a scene: -4 x, but NaN in every `every`-th evaluation */
inline PetscErrorCode ForceCase(Run &run, int every)
{
  using namespace hhtdae;
  Scene     scene(PETSC_COMM_SELF);
  PointMass mass;
  auto      calls = std::make_shared<int>(0);
  PetscFunctionBegin;
  mass.position  = {1, 0, 0};
  const Marker m = scene.marker(scene.add("mass", mass)), ground = scene.marker(scene.ground());
  UserForce    force;
  force.i     = m;
  force.force = {Expression{{Measure::displacement(m, 0, ground), Measure::time()},
                            [calls, every](const Real *x) -> Real {
                              const bool bad = every ? x[1].value() > 0.1 && ++*calls % every == 0 : x[1].value() > 0.5;
                              return bad ? x[0] * Real(NAN) : Real(x[0] * Real(-4));
                            }},
                 Expression{{Measure::time()}, [](const Real *x) -> Real { return x[0] * Real(0); }},
                 Expression{{Measure::time()}, [](const Real *x) -> Real { return x[0] * Real(0); }}};
  scene.add("force", force);
  scene.channel("x", Measure::displacement(m, 0));
  PetscCall(RunScene(run, scene, 3, 1e-6, 0.02,
                     [&](double t, const std::vector<double> &c) { run.judge(c[0] - std::cos(2 * t)); }));
  PetscFunctionReturn(0);
}

inline void AddFaults(Cases &cases)
{
  const char *position = "position, exact", *last = "error; last state, exact";
  Add(cases, "faults", "NaN in every 97th residual", position, 2e-3, [](Run &r) {
    return SpoiledCase(r, 97, NAN, false);
  }).test();
  Add(cases, "faults", "Inf in every 7th residual", "position, exact, or error", 2e-3, [](Run &r) {
    return SpoiledCase(r, 7, INFINITY, false);
  }).orFail("not a number");
  Add(cases, "faults", "NaN in every 5th Jacobian", position, 2e-3, [](Run &r) {
    return SpoiledCase(r, 5, NAN, true);
  }).test();
  Add(cases, "faults", "NaN residual for good", last, 2e-3, [](Run &r) {
    return SpoiledCase(r, 0, NAN, false);
  }).mustFail("not a number");
  Add(cases, "faults", "NaN Jacobian for good", last, 2e-3, [](Run &r) { return SpoiledCase(r, 0, NAN, true); })
      .mustFail("Jacobian (TSSetI2Jacobian()) is not a number")
      .test();
  Add(cases, "faults", "domain error, every 97th call", position, 2e-3, [](Run &r) {
    return DomainCase(r, 97);
  }).test();
  Add(cases, "faults", "domain error, every 7th call", position, 2e-3, [](Run &r) { return DomainCase(r, 7); });
  Add(cases, "faults", "domain error for good", last, 2e-3, [](Run &r) { return DomainCase(r, 0); })
      .mustFail("No step from t = 0.")
      .test();
  Add(cases, "faults", "scene, NaN force now and then", position, 2e-3, [](Run &r) { return ForceCase(r, 97); }).test();
  Add(cases, "faults", "scene, NaN force for good", last, 2e-3, [](Run &r) { return ForceCase(r, 0); })
      .mustFail("not a number")
      .test();
}

/* ---- out of range ---- */

/* A ball released beside a box falls past it */
inline PetscErrorCode BesideTheBox(Run &run)
{
  using namespace hhtdae;
  Scene     scene(PETSC_COMM_SELF);
  RigidBody ball;
  PetscFunctionBegin;
  ball.position  = {1.6, 0, 3};
  const Marker m = scene.marker(scene.add("ball", ball));
  SphereBox    contact;
  contact.i = m, contact.j = scene.marker(scene.ground());
  contact.radius = 0.5;
  scene.add("box", contact);
  scene.gravity({0, 0, -9.81});
  for (int c = 0; c < 3; c++) scene.channel("", Measure::displacement(m, c));
  PetscCall(RunScene(run, scene, 100, 1e-6, 0.5, [&](double t, const std::vector<double> &c) {
    run.judge((Eigen::Map<const Vector3>(c.data()) - Vector3(1.6, 0, 3 - 9.81 * t * t / 2)).norm() / (1 + t * t));
  }));
  PetscFunctionReturn(0);
}

/* A ball that starts deep below a plane is thrown out; judged by energy */
inline PetscErrorCode DeepBelow(Run &run, double depth)
{
  using namespace hhtdae;
  const double k = 1e5, E0 = k * std::pow(depth, 2.5) / 2.5;
  double       last = 0;
  Scene        scene(PETSC_COMM_SELF);
  RigidBody    ball;
  PetscFunctionBegin;
  ball.position  = {0, 0, 0.1 - depth};
  const Marker m = scene.marker(scene.add("ball", ball));
  SpherePlane  contact;
  contact.i = m, contact.j = scene.marker(scene.ground());
  contact.radius        = 0.1;
  contact.law.stiffness = k;
  scene.add("plane", contact);
  scene.channel("z", Measure::displacement(m, 2));
  scene.channel("v", Measure::velocity(m, 2));
  PetscCall(RunScene(run, scene, 1, 1e-6, 0.01, [&](double, const std::vector<double> &c) {
    last = c[0];
    if (c[0] > 0.1) run.judge(c[1] * c[1] / (2 * E0) - 1);
  }));
  if (last < 0.1) run.judge(NAN);
  PetscFunctionReturn(0);
}

/* A slide driven by a spline through (0, 0), (1, 1), (2, 0), far beyond its last point: the spline continues with the
   last slope, -1.5 */
inline PetscErrorCode BeyondSpline(Run &run)
{
  using namespace hhtdae;
  Scene     scene(PETSC_COMM_SELF, Space::Planar);
  RigidBody slide;
  PetscFunctionBegin;
  slide.velocity = {1.5, 0, 0};
  const Marker m = scene.marker(scene.add("slide", slide)), ground = scene.marker(scene.ground());
  scene.add("guide", Translational{m, ground});
  scene.add("motion",
            TranslationalMotion{m, ground, TimeFunction::spline({0, 1, 2}, {0, 1, 0}), MotionOf::Displacement, 0});
  scene.channel("x", Measure::displacement(m, 0));
  PetscCall(RunScene(run, scene, 50, 1e-6, 0.1, [&](double t, const std::vector<double> &c) {
    const double s = t < 1 ? t : 2 - t;
    run.judge((c[0] - (t < 2 ? 1.5 * s - 0.5 * s * s * s : -1.5 * (t - 2))) / (1 + t));
  }));
  PetscFunctionReturn(0);
}

/* A slider is driven out of the reach of crank and rod, which is reached at t = 2 */
inline PetscErrorCode OutOfReach(Run &run)
{
  using namespace hhtdae;
  const double x0 = 1.5, v0 = 0.25, a = std::acos(x0 / 2), da = -v0 / (2 * std::sin(a));
  Scene        scene(PETSC_COMM_SELF, Space::Planar);
  RigidBody    rod[2];
  PetscFunctionBegin;
  Marker last = scene.marker(scene.ground());
  for (int k = 0; k < 2; k++) {
    const double angle = k ? -a : a, spin = k ? -da : da, x = (k ? 1.5 : 0.5) * std::cos(a), y = 0.5 * std::sin(a);
    rod[k].inertia             = Matrix3::Identity() / 12;
    rod[k].rotation            = Eigen::AngleAxisd(angle, Vector3::UnitZ()).toRotationMatrix();
    rod[k].position            = {x, y, 0};
    rod[k].angular_velocity(2) = spin;
    rod[k].velocity            = {-(k ? 1.5 : 0.5) * std::sin(a) * da, 0.5 * std::cos(a) * da, 0};
    const Body b               = scene.add(k ? "rod" : "crank", rod[k]);
    scene.add("", Revolute{scene.marker(b, {-0.5, 0, 0}), last});
    last = scene.marker(b, {0.5, 0, 0});
  }
  RigidBody slide;
  slide.position = {x0, 0, 0};
  slide.velocity = {v0, 0, 0};
  const Marker s = scene.marker(scene.add("slide", slide)), ground = scene.marker(scene.ground());
  scene.add("guide", Translational{s, ground});
  scene.add("pin", Revolute{last, s});
  scene.add("motion", TranslationalMotion{s, ground, TimeFunction::polynomial({x0, v0}), MotionOf::Displacement, 0});
  scene.channel("x", Measure::displacement(s, 0));
  PetscCall(RunScene(run, scene, 3, 1e-6, 0.01,
                     [&](double t, const std::vector<double> &c) { run.judge(c[0] - x0 - v0 * t); }));
  PetscFunctionReturn(0);
}

/* A bead slides along an open curve, a straight line of 1 m, and beyond its end */
inline PetscErrorCode BeyondCurve(Run &run)
{
  using namespace hhtdae;
  Scene     scene(PETSC_COMM_SELF, Space::Planar);
  PointMass bead;
  PetscFunctionBegin;
  bead.position  = {0.5, -0.5, 0};
  bead.velocity  = {1, -1, 0};
  const Marker m = scene.marker(scene.add("bead", bead));
  PointOnCurve curve;
  curve.i = m, curve.j = scene.marker(scene.ground());
  curve.points = {{0, 0, 0}, {0.5, -0.5, 0}, {1, -1, 0}};
  scene.add("wire", curve);
  scene.gravity({0, -9.81, 0});
  for (int c = 0; c < 2; c++) scene.channel("", Measure::displacement(m, c));
  PetscCall(RunScene(run, scene, 2, 1e-6, 0.02, [&](double t, const std::vector<double> &c) {
    const double x = 0.5 + t + 9.81 * t * t / 4;
    run.judge(std::hypot(c[0] - x, c[1] + x) / (1 + x));
  }));
  PetscFunctionReturn(0);
}

/* A mass passes through the anchor of its own spring, where the direction of the spring is undefined */
inline PetscErrorCode ThroughTheAnchor(Run &run)
{
  using namespace hhtdae;
  const double w = 2, v0 = 5;
  Scene        scene(PETSC_COMM_SELF, Space::Planar);
  PointMass    mass;
  PetscFunctionBegin;
  mass.position  = {1, 0, 0};
  mass.velocity  = {-v0, 0, 0};
  const Marker m = scene.marker(scene.add("mass", mass));
  scene.add("spring", SpringDamper{m, scene.marker(scene.ground()), w * w, 0, 1});
  for (int c = 0; c < 2; c++) scene.channel("", Measure::displacement(m, c));
  /* 1 - v0/w sin(w t) until it is 0; there the velocity is v1, and the motion beyond is the mirror image */
  const double t1 = std::asin(w / v0) / w, v1 = v0 * std::cos(w * t1);
  PetscCall(RunScene(run, scene, 2.2, 1e-6, 0.01, [&](double t, const std::vector<double> &c) {
    const double s = t - t1, back = (PETSC_PI + 2 * std::asin(w / std::sqrt(v1 * v1 + w * w))) / w;
    const double x = s < 0 ? 1 - v0 / w * std::sin(w * t) : -(1 - std::cos(w * s) + v1 / w * std::sin(w * s));
    if (s < back) run.judge(std::hypot(c[0] - x, c[1]));
  }));
  PetscFunctionReturn(0);
}

inline void AddRange(Cases &cases)
{
  Add(cases, "range", "ball beside a box, 49 km", "place over 1 + t^2", 1e-6, BesideTheBox).test();
  for (double d : {1., 1e3})
    Add(cases, "range", Name("ball %.0e m below a plane", d), "energy", 1e-2, [d](Run &r) { return DeepBelow(r, d); });
  Add(cases, "range", "motion beyond its spline", "place over 1 + t", 1e-5, BeyondSpline).test();
  Add(cases, "range", "motion out of reach", "ends there; place", 1e-3, OutOfReach)
      .mustFail("No step from t = ")
      .test();
  Add(cases, "range", "bead beyond its curve", "place, relative", 1e-3, BeyondCurve);
  Add(cases, "range", "spring through its anchor", "position, exact", 5e-3, ThroughTheAnchor);
}

} // namespace hhtstab

#endif
