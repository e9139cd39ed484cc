/* How the cases of the table of stability run their models: problems written by hand, and scenes. */
#ifndef HHTDAE_BENCH_STABILITY_MODELS_H
#define HHTDAE_BENCH_STABILITY_MODELS_H

#include "../../examples/problem.h"
#include "../../examples/problems/extrapolation.h"
#include "../../examples/scene_watch.h"
#include "stability_case.h"

#include <hhtdae/scene.h>

namespace hhtstab
{

using Array = std::vector<double>;

/* The TS of a problem, with a function that is called after every accepted step */
class ProblemRun
{
public:
  TS                                                              ts = nullptr;
  Vec                                                             U = nullptr, V = nullptr;
  std::function<void(double t, const double *u, const double *v)> look;
  std::function<PetscErrorCode(TS)>                               also; /* called in addition to `look` */

  explicit ProblemRun(const hhtex::Problem &p) : problem_(p) {}
  ~ProblemRun()
  {
    TSDestroy(&ts);
    VecDestroy(&U);
    VecDestroy(&V);
  }
  ProblemRun(const ProblemRun &) = delete;

  PetscErrorCode create(const Run &run, double tolerance, double fixed_h = 0)
  {
    PetscFunctionBegin;
    PetscCall(hhtex::ProblemCreateTS(PETSC_COMM_SELF, problem_, &ts, &U, &V));
    PetscCall(TSSetTimeStep(ts, 0.1)); /* set before the type it does not count as set by the user: the first step is chosen */
    PetscCall(TSSetType(ts, TSHHT3));
    PetscCall(run.prepare(ts, tolerance));
    if (fixed_h > 0) PetscCall(Run::fixSteps(ts, fixed_h));
    PetscCall(TSMonitorSet(ts, monitor, this, nullptr));
    PetscFunctionReturn(0);
  }

private:
  const hhtex::Problem &problem_;

  static PetscErrorCode monitor(TS ts, PetscInt step, PetscReal t, Vec, void *ctx)
  {
    auto              *r = static_cast<ProblemRun *>(ctx);
    const PetscScalar *u, *v;
    PetscFunctionBegin;
    if (step < 0) PetscFunctionReturn(0);
    if (r->look) {
      PetscCall(VecGetArrayRead(r->U, &u));
      PetscCall(VecGetArrayRead(r->V, &v));
      r->look(t, u, v);
      PetscCall(VecRestoreArrayRead(r->V, &v));
      PetscCall(VecRestoreArrayRead(r->U, &u));
    }
    if (r->also && step) PetscCall(r->also(ts));
    PetscFunctionReturn(0);
  }
};

/* Largest errors against the problem's reference, at about 100 times of the run and at its end */
struct AgainstReference {
  const hhtex::Problem &problem;
  Array                 u, v, a;
  double                q = 0, rate = 0, lambda = 0, scale = 0, next, before = 0;

  explicit AgainstReference(const hhtex::Problem &p) : problem(p), u(p.n), v(p.n), a(p.n), next(p.t0) {}
  void operator()(double t, const double *x, const double *y)
  {
    if (t < next && t < problem.t1) return;
    next   = t + std::fmin((problem.t1 - problem.t0) / 100, 50 * (t - before));
    before = t;
    if (!problem.reference(t, u.data(), v.data(), a.data())) return;
    for (PetscInt i = 0; i < problem.n; i++) {
      const bool multiplier = problem.role[i] == TSHHT3_HOLONOMIC || problem.role[i] == TSHHT3_NONHOLONOMIC;
      if (std::isnan(u[i]) || (multiplier && t == problem.t0)) continue; /* initial multipliers are not given */
      if (multiplier) {
        hhtex::Widen(lambda, x[i], u[i]);
        scale = std::fmax(scale, std::fabs(u[i]));
        continue;
      }
      hhtex::Widen(q, (x[i] - u[i]) / std::fmax(1, std::fabs(u[i])));
      if (!std::isnan(v[i])) hhtex::Widen(rate, (y[i] - v[i]) / std::fmax(1, std::fabs(v[i])));
    }
  }
  double multipliers() const { return scale > 0 ? lambda / scale : 0; }
};

/* Error of the positions of a problem with a reference, under error control: the figure of many cases */
inline PetscErrorCode ErrorOf(Run &run, const hhtex::Problem &p, double tolerance)
{
  ProblemRun       r(p);
  AgainstReference error(p);
  PetscFunctionBegin;
  PetscCall(r.create(run, tolerance));
  r.look                    = [&](double t, const double *u, const double *v) { error(t, u, v); };
  const PetscErrorCode code = run.solve(r.ts);
  run.judge(error.q);
  if (!code) run.note("velocities %.1e, multipliers %.1e", error.rate, error.multipliers());
  PetscFunctionReturn(code);
}

/* Runs a scene until `end` and calls look(t, channels) at the multiples of dt */
class SceneRun
{
public:
  TS ts = nullptr;

  explicit SceneRun(hhtdae::Scene &scene) : scene_(scene) {}
  ~SceneRun() { TSDestroy(&ts); }
  SceneRun(const SceneRun &) = delete;

  PetscErrorCode create(const Run &run, double end, double tolerance, double fixed_h = 0)
  {
    PetscFunctionBegin;
    PetscCall(scene_.createTS(&ts));
    PetscCall(TSSetMaxTime(ts, end));
    PetscCall(run.prepare(ts, tolerance));
    if (fixed_h > 0) PetscCall(Run::fixSteps(ts, fixed_h));
    PetscFunctionReturn(0);
  }
  PetscErrorCode solve(Run &run, double dt, const hhtex::Watch::Look &look)
  {
    hhtex::Watch watch(scene_, dt, look);
    PetscFunctionBegin;
    PetscCall(watch.attach(ts));
    const PetscErrorCode code = run.solve(ts, [&] { return scene_.solve(ts); });
    PetscFunctionReturn(code);
  }

private:
  hhtdae::Scene &scene_;
};

/* create() and solve() without anything in between */
inline PetscErrorCode RunScene(Run &run, hhtdae::Scene &scene, double end, double tolerance, double dt,
                               const hhtex::Watch::Look &look)
{
  SceneRun r(scene);
  PetscFunctionBegin;
  PetscCall(r.create(run, end, tolerance));
  PetscCall(r.solve(run, dt, look));
  PetscFunctionReturn(0);
}

/* Adds channels of both energies as the last channels of a scene; conservative scenes are judged by their sum */
inline void EnergyChannels(hhtdae::Scene &scene)
{
  scene.channel("kinetic", hhtdae::Measure::kineticEnergy(), "J");
  scene.channel("potential", hhtdae::Measure::potentialEnergy(), "J");
}

/* Drift of the energy relative to the largest kinetic energy so far */
struct EnergyDrift {
  double start = 0, drift = 0, largest = 0;
  bool   begun = false;
  void   operator()(const std::vector<double> &c)
  {
    const double T = c[c.size() - 2], E = T + c[c.size() - 1];
    if (!begun) start = E;
    begun   = true;
    largest = std::fmax(largest, T);
    hhtex::Widen(drift, E, start);
  }
  double relative() const { return drift / std::fmax(largest, 1e-300); }
};

/* A free rigid body: Euler's equations, attitude by columns of R; moments J, angular velocity in body axes */
class FreeBody
{
public:
  FreeBody(const hhtdae::Vector3 &J, const hhtdae::Vector3 &spin)
      : J_(J), solution_([this](long double, const long double *y, long double *f) { rates(y, f); }, 0.L,
                         0.1L / (long double)spin.norm(), {1, 0, 0, 0, 1, 0, 0, 0, 1, spin(0), spin(1), spin(2)})
  {
  }
  FreeBody(const FreeBody &) = delete;
  hhtdae::Vector3 axis(double t, int k)
  {
    const auto y = solution_.at(t);
    return {(double)y[k], (double)y[3 + k], (double)y[6 + k]};
  }

private:
  hhtdae::Vector3      J_;
  hhtex::Extrapolation solution_;

  void rates(const long double *y, long double *f) const /* R by rows: R' = R [w x] */
  {
    const long double *w = y + 9;
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < 3; k++)
        f[3 * i + k] = y[3 * i + (k + 1) % 3] * w[(k + 2) % 3] - y[3 * i + (k + 2) % 3] * w[(k + 1) % 3];
    for (int k = 0; k < 3; k++)
      f[9 + k] = (J_((k + 1) % 3) - J_((k + 2) % 3)) * w[(k + 1) % 3] * w[(k + 2) % 3] / J_(k);
  }
};

} // namespace hhtstab

#endif
