/* Impacts, stick and slip, forces and motions that jump, with and without TSEvent. */
#ifndef HHTDAE_BENCH_STABILITY_EVENTS_H
#define HHTDAE_BENCH_STABILITY_EVENTS_H

#include "stability_models.h"

namespace hhtstab
{

/* ---- impacts and friction ---- */

/* An elastic ball that bounces six times, judged by the energy of its flights relative to that of the start. The
   tolerance is 1e-4 of the penetration, and every bounce may change the energy by 2 (1e-4)^(2/3) */
inline PetscErrorCode BounceCase(Run &run, double stiffness)
{
  using namespace hhtdae;
  const double radius = 0.1, height = 0.5, depth = std::pow(2.5 * 9.81 * height / stiffness, 0.4);
  Scene        scene(PETSC_COMM_SELF);
  RigidBody    ball;
  double       highest = 0, flights = 0, before = -1;
  PetscFunctionBegin;
  ball.position  = {0, 0, radius + height};
  const Marker m = scene.marker(scene.add("ball", ball));
  SpherePlane  contact;
  contact.i = m, contact.j = scene.marker(scene.ground());
  contact.radius        = radius;
  contact.law.stiffness = stiffness;
  scene.add("floor", contact);
  scene.gravity({0, 0, -9.81});
  scene.channel("z", Measure::displacement(m, 2));
  scene.channel("v", Measure::velocity(m, 2));
  PetscCall(RunScene(run, scene, 3, 1e-4 * depth, 1e-3, [&](double, const std::vector<double> &c) {
    highest = std::fmax(highest, c[0]);
    if (c[0] < radius + 1e-3) return;
    run.judge((0.5 * c[1] * c[1] + 9.81 * (c[0] - radius)) / (9.81 * height) - 1);
    if (before < 0 && c[1] >= 0) flights++;
    before = c[1] == 0 ? before : c[1];
  }));
  run.note("%d tops, highest %.4f of %.1f", (int)flights, highest - radius, height);
  PetscFunctionReturn(0);
}

/* A block on an incline too flat to slide: with the regularized friction law it creeps at v_s atanh(tan/mu), from any
   initial velocity. A creep of v_s is resolved only if the tolerance is below v_s times a second */
inline PetscErrorCode CreepCase(Run &run, double slip_velocity)
{
  using namespace hhtdae;
  const double slope = 0.2, mu = 0.4, exact = slip_velocity * std::atanh(std::tan(slope) / mu);
  Scene        scene(PETSC_COMM_SELF);
  RigidBody    block;
  double       last = 0;
  PetscFunctionBegin;
  const Matrix3 axes =
      Eigen::AngleAxisd(PETSC_PI / 2 + slope, Vector3::UnitY()).toRotationMatrix(); /* z points down the incline */
  block.velocity = 2 * axes.col(2);
  block.rotation = axes;
  const Marker m = scene.marker(scene.add("block", block)), guide = scene.marker(scene.ground(), Vector3::Zero(), axes);
  const Element joint = scene.add("guide", Translational{m, guide});
  JointFriction friction;
  friction.joint         = joint;
  friction.coefficient   = mu;
  friction.slip_velocity = slip_velocity;
  scene.add("friction", friction);
  scene.gravity({0, 0, -9.81});
  scene.channel("v", Measure::velocity(m, 2, {}, guide));
  PetscCall(
      RunScene(run, scene, 3, 1e-3 * slip_velocity, 0.01, [&](double, const std::vector<double> &c) { last = c[0]; }));
  run.judge(last / exact - 1);
  run.note("creeps at %.3e, exact %.3e", last, exact);
  PetscFunctionReturn(0);
}

/* A block on a moving belt, held by a spring: stick-slip motion */
struct Belt : hhtex::Problem {
  static constexpr double k = 40, mu = 0.3, fall = 0.6, belt = 0.5, g = 9.81;
  const double            slip;
  explicit Belt(double slip_velocity)
      : slip(slip_velocity), solution_(
                                 [this](long double, const long double *y, long double *f) {
                                   f[0] = y[1];
                                   f[1] = -k * y[0] - force(y[1]);
                                 },
                                 0.L, 0.2L * slip, {0, 0})
  {
    name = "belt";
    n    = 1;
    t1   = 5;
    role = {TSHHT3_COORDINATE};
  }
  /* mu decreases with the slip velocity, which causes the stick-slip motion */
  template <class T> T force(T v) const
  {
    return (T)(g * mu) * std::tanh((v - (T)belt) / (T)slip) * (1 - (T)fall * s2(v) / (1 + s2(v)));
  }
  template <class T> static T s2(T v) { return (v - (T)belt) * (v - (T)belt); }
  void                        initial(double *u, double *v) const override { u[0] = v[0] = 0; }
  void residual(double, const double *u, const double *v, const double *a, double *f) const override
  {
    f[0] = a[0] + k * u[0] + force(v[0]);
  }
  void jacobian(double, const double *, const double *v, const double *, double sv, double sa,
                hhtex::Entries &J) const override
  {
    const double d = v[0] - belt, th = std::tanh(d / slip), q = 1 + d * d;
    J.add(0, 0, sa + k + sv * g * mu * ((1 - th * th) / slip * (1 - fall * d * d / q) - th * fall * 2 * d / (q * q)));
  }
  bool reference(double t, double *u, double *v, double *a) const override
  {
    const auto y = solution_.at(t);
    u[0] = (double)y[0], v[0] = (double)y[1], a[0] = (double)(-k * y[0] - force(y[1]));
    return true;
  }

private:
  mutable hhtex::Extrapolation solution_;
};

inline PetscErrorCode BeltCase(Run &run, double slip)
{
  const Belt p(slip);
  PetscFunctionBegin;
  PetscCall(ErrorOf(run, p, 1e-7));
  PetscFunctionReturn(0);
}

inline void AddImpacts(Cases &cases)
{
  for (double k : {1e5, 1e7, 1e9, 1e11}) {
    Case &c = Add(cases, "impacts", Name("bouncing ball k=%.0e", k), "energy in flight", 6 * 2 * std::pow(1e-4, 2. / 3),
                  [k](Run &r) { return BounceCase(r, k); });
    if (k == 1e9) c.test();
  }
  for (double v : {1e-2, 1e-4, 1e-6})
    Add(cases, "impacts", Name("creep, v_s=%.0e", v), "velocity, relative", 1e-3, [v](Run &r) {
      return CreepCase(r, v);
    }).test();
  for (double v : {1e-2, 1e-3})
    Add(cases, "impacts", Name("stick-slip, v_s=%.0e", v), "position, exact", 2e-3,
        [v](Run &r) { return BeltCase(r, v); });
}

/* ---- discontinuities ---- */

/* x'' + w^2 x = F between t = 1 and t = 1 + width, where F has unit impulse or unit size */
struct Jump : hhtex::Problem {
  const double w        = 5, force, end;
  bool         by_event = false, on = false; /* the force is switched by events, otherwise by the time */
  Jump(double width, double size) : force(size), end(1 + width)
  {
    name = "jump";
    n    = 1;
    t1   = 4;
    role = {TSHHT3_COORDINATE};
  }
  bool active(double t) const { return by_event ? on : t > 1 && t <= end; }
  void initial(double *u, double *v) const override { u[0] = 1, v[0] = 0; }
  void residual(double t, const double *u, const double *, const double *a, double *f) const override
  {
    f[0] = a[0] + w * w * u[0] - (active(t) ? force : 0);
  }
  void jacobian(double, const double *, const double *, const double *, double, double sa,
                hhtex::Entries &J) const override
  {
    J.add(0, 0, sa + w * w);
  }
  bool reference(double t, double *u, double *v, double *a) const override
  {
    u[0] = std::cos(w * t), v[0] = -w * std::sin(w * t), a[0] = -w * w * u[0]; /* in motion from the start, so that steps are short */
    for (int k = 0; k < 2; k++) {
      const double s = t - (k ? end : 1), f = k ? -force : force;
      if (s <= 0) continue;
      u[0] += f / (w * w) * (1 - std::cos(w * s));
      v[0] += f / w * std::sin(w * s);
    }
    return true;
  }
};

#if PETSC_VERSION_LT(3, 21, 0)
using Indicator = PetscScalar;
#else
using Indicator = PetscReal;
#endif

inline PetscErrorCode WhenJumps(TS, PetscReal t, Vec, Indicator f[], void *ctx)
{
  f[0] = t - 1;
  f[1] = t - static_cast<Jump *>(ctx)->end;
  return 0;
}
inline PetscErrorCode SwitchThere(TS ts, PetscInt n, PetscInt which[], PetscReal, Vec, PetscBool, void *ctx)
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < n; k++) static_cast<Jump *>(ctx)->on = which[k] == 0;
  PetscCall(TSRestartStep(ts));
  PetscFunctionReturn(0);
}

inline PetscErrorCode JumpCase(Run &run, double width, bool event, double largest)
{
  Jump             p(width, 1 / width);
  ProblemRun       r(p);
  AgainstReference error(p);
  const PetscInt   direction[2] = {0, 0};
  const PetscBool  terminate[2] = {PETSC_FALSE, PETSC_FALSE};
  TSAdapt          adapt;
  PetscFunctionBegin;
  PetscCall(r.create(run, 1e-6));
  r.look = [&](double t, const double *u, const double *v) { error(t, u, v); };
  PetscCall(TSGetAdapt(r.ts, &adapt));
  PetscCall(TSAdaptSetStepLimits(adapt, 0, largest));
  p.by_event = event;
  if (event) {
    PetscCall(TSSetEventHandler(r.ts, 2, (PetscInt *)direction, (PetscBool *)terminate, WhenJumps, SwitchThere, &p));
    PetscCall(TSSetEventTolerances(r.ts, 1e-12, nullptr));
  }
  const PetscErrorCode code = run.solve(r.ts);
  run.judge(error.q);
  PetscFunctionReturn(code);
}

/* x'' = -sign(x): parabolas, energy x'^2/2 + |x| */
struct BangBang : hhtex::Problem {
  BangBang()
  {
    name = "bang-bang";
    n    = 1;
    t1   = 20;
    role = {TSHHT3_COORDINATE};
  }
  void initial(double *u, double *v) const override { u[0] = 1, v[0] = 0; }
  void residual(double, const double *u, const double *, const double *a, double *f) const override
  {
    f[0] = a[0] + (u[0] > 0) - (u[0] < 0);
  }
  void jacobian(double, const double *, const double *, const double *, double, double sa,
                hhtex::Entries &J) const override
  {
    J.add(0, 0, sa);
  }
  bool reference(double t, double *u, double *v, double *a) const override
  {
    const double T = std::sqrt(2.), s = std::fmod(t, 4 * T), sign = s < T || s > 3 * T ? 1 : -1,
                 d = s < T       ? s
                     : s > 3 * T ? s - 4 * T
                                 : s - 2 * T;
    u[0] = sign * (1 - d * d / 2), v[0] = -sign * d, a[0] = -sign;
    return true;
  }
};

inline PetscErrorCode BangBangCase(Run &run)
{
  const BangBang p;
  PetscFunctionBegin;
  PetscCall(
      ErrorOf(run, p, 1e-8)); /* 14 jumps, each with an error of the velocity that acts for 10 s on average */
  PetscFunctionReturn(0);
}

/* A base whose prescribed motion has a jump of acceleration, velocity or position at t = 1; a mass on a spring of 25
   N/m is mounted on it */
inline PetscErrorCode MovedBase(Run &run, int derivative)
{
  using namespace hhtdae;
  const double w = 5;
  Scene        scene(PETSC_COMM_SELF);
  PointMass    base, rider;
  PetscFunctionBegin;
  rider.position = {1, 0, 0};
  const Marker a = scene.marker(scene.add("base", base)), b = scene.marker(scene.add("rider", rider)),
               ground = scene.marker(scene.ground());
  const Matrix3 along = Eigen::AngleAxisd(PETSC_PI / 2, Vector3::UnitY()).toRotationMatrix();
  const Marker  rail  = scene.marker(scene.ground(), Vector3::Zero(), along);
  scene.add("rail", InLine{a, rail});
  scene.add("rider's rail", InLine{b, rail});
  const auto motion = [derivative](double t) -> TimeFunction::Value {
    const double s = t - 1;
    if (s <= 0) return {0, 0, 0};
    return derivative == 2   ? TimeFunction::Value{s * s / 2, s, 1}
           : derivative == 1 ? TimeFunction::Value{s, 1, 0}
                             : TimeFunction::Value{1, 0, 0};
  };
  scene.add("motion", TranslationalMotion{a, ground, TimeFunction::values(motion), MotionOf::Displacement, 0});
  scene.add("spring", SpringDamper{b, a, w * w, 0, 1});
  scene.channel("base", Measure::displacement(a, 0));
  scene.channel("rider", Measure::displacement(b, 0));
  PetscCall(RunScene(run, scene, 3, 1e-6, 0.02, [&](double t, const std::vector<double> &c) {
    const double s = t - 1, f = motion(t).f;
    double       x = f; /* displacement of the mass from its start: f minus the lag of the spring */
    if (s > 0)
      x -= derivative == 2 ? (1 - std::cos(w * s)) / (w * w) : derivative == 1 ? std::sin(w * s) / w : std::cos(w * s);
    run.judge(c[0] - f);
    run.judge(c[1] - 1 - x);
  }));
  PetscFunctionReturn(0);
}

inline void AddJumps(Cases &cases)
{
  const char  *position = "position, exact";
  const double smooth   = Allowed(1e-6, 20); /* error of the oscillation */
  Add(cases, "jumps", "force, 1 s", position, smooth + 2 * AllowedJump(1e-6, 1) / 5,
      [](Run &r) { return JumpCase(r, 1, false, 1e3); });
  Add(cases, "jumps", "force, 1 s, TSEvent, restart", position, smooth, [](Run &r) {
    return JumpCase(r, 1, true, 1e3);
  }).test();
  Add(cases, "jumps", "force, 1 ms, TSEvent, restart", position, smooth, [](Run &r) {
    return JumpCase(r, 1e-3, true, 1e3);
  }).test();
  Add(cases, "jumps", "force, 1 us, TSEvent, restart", position, smooth,
      [](Run &r) { return JumpCase(r, 1e-6, true, 1e3); });
  Add(cases, "jumps", "force, 1 ms, h below 0.5 ms", position, smooth + 2 * AllowedJump(1e-6, 1e3) / 5,
      [](Run &r) { return JumpCase(r, 1e-3, false, 5e-4); });
  Add(cases, "jumps", "bang-bang, 20 s", position, std::sqrt(14) * 10 * AllowedJump(1e-8, 2), BangBangCase);
  Add(cases, "jumps", "motion, its acceleration", position, 2e-3, [](Run &r) { return MovedBase(r, 2); });
  Add(cases, "jumps", "motion, its velocity", position, 2e-3, [](Run &r) { return MovedBase(r, 1); });
  Add(cases, "jumps", "motion, its position", "ends at the jump", 2e-3, [](Run &r) { return MovedBase(r, 0); })
      .mustFail("No step from t = ")
      .test();
}

} // namespace hhtstab

#endif
