/* Starts that violate the constraints; steps from 1e-12 to 1; tolerances from 1e-2 to 1e-12; a million steps */
#ifndef HHTDAE_BENCH_STABILITY_START_H
#define HHTDAE_BENCH_STABILITY_START_H

#include "stability_stiff.h"

namespace hhtstab
{

/* ---- inconsistent starts ---- */

/* A pendulum that starts too long and with a velocity along its rod; the reference starts at the nearest consistent state */
struct Displaced : hhtex::Pendulum {
  const double stretch, along;
  Displaced(double longer, double speed) : Pendulum(-60, 1, 2), stretch(longer), along(speed) {}
  void initial(double *u, double *v) const override
  {
    Pendulum::initial(u, v);
    for (int i = 0; i < 2; i++) v[i] += along * u[i];
    for (int i = 0; i < 2; i++) u[i] *= 1 + stretch;
  }
};

inline PetscErrorCode DisplacedCase(Run &run, double stretch, double along, TSHHT3Start start)
{
  const Displaced  p(stretch, along);
  ProblemRun       r(p);
  AgainstReference error(p);
  PetscFunctionBegin;
  PetscCall(r.create(run, 1e-6));
  PetscCall(TSHHT3SetStart(r.ts, start));
  r.look = [&](double t, const double *u, const double *v) {
    if (t > 0) error(t, u, v);
  };
  const PetscErrorCode code = run.solve(r.ts);
  run.judge(error.q);
  PetscFunctionReturn(code);
}

/* A rod on a hinge from which it is apart by `gap` */
inline PetscErrorCode GapCase(Run &run, double gap, hhtdae::Assembly assembly)
{
  using namespace hhtdae;
  const double theta = -PETSC_PI / 3, w = std::sqrt(9.81 * 0.5 / (1. / 3));
  Scene        scene(PETSC_COMM_SELF, Space::Planar);
  RigidBody    rod;
  PetscFunctionBegin;
  rod.inertia  = Matrix3::Identity() / 12;
  rod.rotation = Eigen::AngleAxisd(theta - PETSC_PI / 2, Vector3::UnitZ()).toRotationMatrix();
  rod.position = (0.5 + gap) * rod.rotation.col(0);
  const Body b = scene.add("rod", rod);
  scene.add("hinge", Revolute{scene.marker(b, {-0.5, 0, 0}), scene.marker(scene.ground())});
  scene.gravity({0, -9.81, 0});
  scene.start().assembly = assembly;
  for (int c = 0; c < 2; c++) scene.channel("", Measure::displacement(scene.marker(b), c));
  PetscCall(RunScene(run, scene, 2, 1e-6, 0.02, [&](double t, const std::vector<double> &c) {
    const hhtex::PendulumMotion p(w, theta, 0, t);
    run.judge(std::hypot(c[0] - 0.5 * p.sine, c[1] + 0.5 * p.cosine));
  }));
  PetscFunctionReturn(0);
}

inline void AddStarts(Cases &cases)
{
  using hhtdae::Assembly;
  const char *position = "position, nearest start", *error = "says what is wrong";
  for (double x : {1e-9, 1e-3, 0.1}) {
    Add(cases, "starts", Name("%.0e too long, project", x), position, 2e-3,
        [x](Run &r) { return DisplacedCase(r, x, 0, TSHHT3_START_PROJECT); });
    Add(cases, "starts", Name("velocity off by %.0e, project", x), position, 2e-3,
        [x](Run &r) { return DisplacedCase(r, 0, x, TSHHT3_START_PROJECT); });
    for (auto start : {TSHHT3_START_REPORT, TSHHT3_START_OFF}) {
      const char *word = start == TSHHT3_START_OFF ? ", off" : ", report";
      Case       &c = Add(cases, "starts", Name("%.0e too long", x) + word, x < 1e-6 ? position : error, 2e-3 + 2 * x,
                          [x, start](Run &r) { return DisplacedCase(r, x, 0, start); });
      if (x > 1e-6) c.mustFail("too short for the corrector").test();
      Add(cases, "starts", Name("velocity off by %.0e", x) + word, position, 2e-3,
          [x, start](Run &r) { return DisplacedCase(r, 0, x, start); });
    }
  }
  Add(cases, "starts", "scene, gap of 0.1, project", position, 2e-3, [](Run &r) {
    return GapCase(r, 0.1, Assembly::Project);
  }).test();
  Add(cases, "starts", "scene, gap of 0.1, report", "names the joint", 2e-3,
      [](Run &r) { return GapCase(r, 0.1, Assembly::Report); })
      .mustFail("hinge")
      .test();
  Add(cases, "starts", "scene, gap of 0.1, off", error, 0.2, [](Run &r) {
    return GapCase(r, 0.1, Assembly::Off);
  }).mustFail("too short for the corrector");
}

/* ---- steps and tolerances ---- */

/* Steps of constant length; the figure is in units of what the method promises: positions within (h w)^2 w t plus
   rounding, velocities w times that, multipliers of short steps within 5 %. Steps of a tenth of a period and longer do
   not resolve the motion: there the rod must keep its length to 1e-6, and the energy that it gains must stay below
   that of a full turn */
inline PetscErrorCode FixedStepCase(Run &run, double h)
{
  const double          w = 3.5, steps = h > 1e-2 ? 200 : 1000;
  const hhtex::Pendulum p(-60, 1, h > 1e-2 ? steps * h : 10);
  ProblemRun            r(p);
  AgainstReference      error(p);
  double                length = 0, start = 0, growth = 0;
  PetscFunctionBegin;
  PetscCall(r.create(run, 1e-8, h));
  r.look = [&](double t, const double *u, const double *v) {
    error(t, u, v);
    const double E = (v[0] * v[0] + v[1] * v[1]) / 2 + p.g * u[1];
    if (t == 0) start = E;
    growth = std::fmax(growth, E - start);
    hhtex::Widen(length, std::hypot(u[0], u[1]), 1);
  };
  if (h <= 1e-2) PetscCall(TSSetMaxSteps(r.ts, (PetscInt)steps));
  const PetscErrorCode code = run.solve(r.ts);
  if (h > 1e-2) {
    run.judge(length / 1e-6);
    run.judge(growth / (2 * p.g));
    run.note("length to %.1e, energy grows by %.1e J", length, growth);
  } else {
    run.out.finished   = !code && run.out.s.steps == (PetscInt)steps;
    const double bound = h * h * w * w * w * steps * h + 1e-11;
    run.judge(error.q / bound);
    run.judge(error.rate / (w * bound + 1e-9 + 10 * PETSC_MACHINE_EPSILON / std::fmax(h, 1e-7) +
                            (h > 1e-4 ? h * h * w * w * w : 0)));
    if (h < 1e-4) run.judge(error.multipliers() / 0.05);
    run.note("errors %.1e, velocities %.1e, multipliers %.1e", error.q, error.rate, error.multipliers());
  }
  PetscFunctionReturn(code);
}

/* Any first step under error control */
inline PetscErrorCode FirstStepCase(Run &run, double h)
{
  const hhtex::Pendulum p(-60, 1, 2);
  ProblemRun            r(p);
  AgainstReference      error(p);
  PetscFunctionBegin;
  PetscCall(r.create(run, 1e-6));
  PetscCall(TSSetTimeStep(r.ts, h));
  r.look                    = [&](double t, const double *u, const double *v) { error(t, u, v); };
  const PetscErrorCode code = run.solve(r.ts);
  run.judge(error.q);
  PetscFunctionReturn(code);
}

inline PetscErrorCode ToleranceCase(Run &run, double eps)
{
  const hhtex::Pendulum p(-60, 1, 2);
  PetscFunctionBegin;
  PetscCall(ErrorOf(run, p, eps));
  PetscFunctionReturn(0);
}

inline void AddSteps(Cases &cases)
{
  for (int d = 0; d >= -12; d--) {
    const double h = std::pow(10, d);
    Case &c = Add(cases, "steps", Name("fixed h=%.0e", h), d > -2 ? "length, energy over bound" : "error over bound", 1,
                  [h](Run &r) { return FixedStepCase(r, h); });
    if (d % 6 == 0) c.test();
  }
  for (double h : {1e-12, 1e-6, 1., 1e3})
    Add(cases, "steps", Name("first h=%.0e", h), "position, exact", 2e-3, [h](Run &r) { return FirstStepCase(r, h); });
  for (int d = -2; d >= -12; d--) { /* of second order: global errors proportional to eps^(2/3) */
    const double eps = std::pow(10, d), way5 = Allowed(eps, 5), way8 = Allowed(eps, 8);
    Add(cases, "tolerances", Name("pendulum eps=%.0e", eps), "position, exact", way5,
        [eps](Run &r) { return ToleranceCase(r, eps); });
    if (d >= -10)
      Add(cases, "tolerances", Name("slider-crank eps=%.0e", eps), "position, exact", way8,
          [eps](Run &r) { return SliderCrankCase(r, 0.3, 1, 1, 8, 1, eps); });
  }
}

/* ---- a million steps ---- */

/* Two masses on a rod, thrown: position and attitude are known at any time, and the method's damping is the only loss */
struct Dumbbell : hhtex::Problem {
  static constexpr double m1 = 1, m2 = 2, spin = 1, throw_x = 1e-3, throw_y = 2e-3;
  explicit Dumbbell(double end)
  {
    name = "dumbbell";
    n    = 5;
    t1   = end;
    role.assign(4, TSHHT3_COORDINATE);
    role.push_back(TSHHT3_HOLONOMIC);
  }
  void initial(double *u, double *v) const override
  {
    const double u0[5] = {-m2 / (m1 + m2), 0, m1 / (m1 + m2), 0, 0},
                 v0[5] = {throw_x, throw_y + spin * u0[0], throw_x, throw_y + spin * u0[2], 0};
    std::copy_n(u0, 5, u);
    std::copy_n(v0, 5, v);
  }
  void residual(double, const double *u, const double *, const double *a, double *f) const override
  {
    const double d[2] = {u[2] - u[0], u[3] - u[1]};
    for (int i = 0; i < 2; i++) {
      f[i]     = m1 * a[i] - d[i] * u[4];
      f[2 + i] = m2 * a[2 + i] + d[i] * u[4];
    }
    f[4] = (d[0] * d[0] + d[1] * d[1] - 1) / 2;
  }
  void jacobian(double, const double *u, const double *, const double *, double, double sa,
                hhtex::Entries &J) const override
  {
    for (PetscInt i = 0; i < 2; i++) {
      const double d = u[2 + i] - u[i];
      J.add(i, i, m1 * sa + u[4]);
      J.add(i, i + 2, -u[4]);
      J.add(i + 2, i, -u[4]);
      J.add(i + 2, i + 2, m2 * sa + u[4]);
      for (PetscInt s = 0; s < 2; s++) {
        J.add(i + 2 * s, 4, s ? d : -d);
        J.add(4, i + 2 * s, s ? d : -d);
      }
    }
  }
};

struct Drifts {
  double position = 0, velocity = 0, acceleration = 0, energy = 0, momentum = 0, angular = 0;
};

/* Constraints on all three levels every 1000 steps, and conserved quantities; the figure is the worst one relative to
   its own bound */
inline PetscErrorCode MillionDumbbell(Run &run)
{
  const double   h     = 1e-3;
  const PetscInt steps = 1000000;
  const Dumbbell p(h * steps);
  ProblemRun     r(p);
  Drifts         d;
  PetscInt       count = 0;
  double         E0 = 0, L0 = 0, P0[2] = {0, 0};
  PetscFunctionBegin;
  PetscCall(r.create(run, 1e-8, h));
  r.also = [&](TS ts) -> PetscErrorCode {
    Vec                A;
    const PetscScalar *a;
    PetscFunctionBegin;
    if (++count % 1000) PetscFunctionReturn(0);
    const PetscScalar *x, *y;
    PetscCall(TSHHT3GetAcceleration(ts, &A));
    PetscCall(VecGetArrayRead(A, &a));
    PetscCall(VecGetArrayRead(r.U, &x));
    PetscCall(VecGetArrayRead(r.V, &y));
    double q[2], w[2], c[2];
    for (int i = 0; i < 2; i++) q[i] = x[2 + i] - x[i], w[i] = y[2 + i] - y[i], c[i] = a[2 + i] - a[i];
    hhtex::Widen(d.position, (q[0] * q[0] + q[1] * q[1] - 1) / 2);
    hhtex::Widen(d.velocity, q[0] * w[0] + q[1] * w[1]);
    hhtex::Widen(d.acceleration, q[0] * c[0] + q[1] * c[1] + w[0] * w[0] + w[1] * w[1]);
    const double m[2] = {Dumbbell::m1, Dumbbell::m2};
    double       E = 0, L = 0, P[2] = {0, 0};
    for (int b = 0; b < 2; b++) {
      E += m[b] * (y[2 * b] * y[2 * b] + y[2 * b + 1] * y[2 * b + 1]) / 2;
      L += m[b] * (x[2 * b] * y[2 * b + 1] - x[2 * b + 1] * y[2 * b]);
      for (int i = 0; i < 2; i++) P[i] += m[b] * y[2 * b + i];
    }
    if (!E0) E0 = E, L0 = L, P0[0] = P[0], P0[1] = P[1];
    hhtex::Widen(d.energy, E / E0, 1);
    hhtex::Widen(d.angular, L / L0, 1);
    for (int i = 0; i < 2; i++) hhtex::Widen(d.momentum, P[i], P0[i]);
    PetscCall(VecRestoreArrayRead(r.V, &y));
    PetscCall(VecRestoreArrayRead(r.U, &x));
    PetscCall(VecRestoreArrayRead(A, &a));
    PetscFunctionReturn(0);
  };
  const PetscErrorCode code = run.solve(r.ts);
  run.judge(d.position / 1e-10);
  run.judge(d.velocity / 1e-5);
  run.judge(d.acceleration / 1e-2);
  run.judge(d.energy / 1e-3);
  run.judge(d.angular / 1e-3);
  run.judge(d.momentum / 1e-9);
  if (!code && run.out.s.steps < steps) run.judge(NAN);
  run.note("Phi %.1e, its rate %.1e, second %.1e; energy %.1e, momentum %.1e, angular %.1e", d.position, d.velocity,
           d.acceleration, d.energy, d.momentum, d.angular);
  PetscFunctionReturn(code);
}

/* The pendulum under error control until it has taken a million steps */
inline PetscErrorCode MillionPendulum(Run &run)
{
  const hhtex::Pendulum p(-60, 0, 1e9);
  ProblemRun            r(p);
  PetscInt              count  = 0;
  double                length = 0, rate = 0, start = 0, drift = 0, tension = 0;
  PetscFunctionBegin;
  PetscCall(r.create(run, 1e-7));
  PetscCall(TSSetMaxSteps(r.ts, 1000000));
  r.look = [&](double, const double *u, const double *v) {
    if (count++ % 100) return;
    const double V2 = v[0] * v[0] + v[1] * v[1], E = V2 / 2 + p.g * u[1];
    if (count == 1) start = E;
    hhtex::Widen(length, std::hypot(u[0], u[1]), 1);
    hhtex::Widen(rate, u[0] * v[0] + u[1] * v[1]);
    if (count > 1) hhtex::Widen(tension, u[2], V2 - p.g * u[1]); /* lambda = v^2 - g y */
    hhtex::Widen(drift, E, start);
  };
  const PetscErrorCode code = run.solve(r.ts);
  run.out.finished          = !code && run.out.s.steps == 1000000;
  run.judge(length / 1e-6);
  run.judge(rate / 1e-3);
  run.judge(tension / (0.05 * 2 * p.g));
  run.note("t = %.0f; length %.1e, its rate %.1e, tension %.1e; energy fell by %.2f of %.2f J", run.out.t, length, rate,
           tension, drift, p.g / 2);
  PetscFunctionReturn(code);
}

inline void AddMillion(Cases &cases)
{
  Add(cases, "million", "dumbbell, h=1e-3", "drifts over their bounds", 1, MillionDumbbell).within(60);
  Add(cases, "million", "pendulum, eps=1e-7", "constraints over their bounds", 1, MillionPendulum).within(60);
}

} // namespace hhtstab

#endif
