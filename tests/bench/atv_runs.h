/*
  The all-terrain vehicle with several integrators: hhtdae, and SUNDIALS IDA on the index-3 first-order form in the
  manner of Adams' GSTIFF (BDF of variable order, velocities and multipliers excluded from the error test) and on the
  stabilized index-2 form. Every run returns the channels of the scene every 4 ms, and its costs.
*/
#ifndef HHTDAE_BENCH_ATV_RUNS_H
#define HHTDAE_BENCH_ATV_RUNS_H

#include "atv_model.h"
#include "atv_surface.h"
#include "scene_watch.h"
#include "stability_condition.h"
#include "workprecision_scene.h"
#include <hhtdae/flexible.h>

namespace hhtbench
{

using namespace hhtdae;

struct AtvRun {
  std::string                      name, failure;
  PetscReal                        eps = 0, step_max = 0; /* 0: no limit of the step */
  double                           cpu       = 0;         /* CPU seconds of the solve */
  long                             equations = 0;
  wp::Counters                     count;
  std::vector<double>              time;
  std::vector<std::vector<double>> x; /* channels at these times */
};

/* Writes a run to a file and reads it back in another process */
template <class Values> bool WriteValues(const Values &x, FILE *file)
{
  const size_t n = x.size();
  return std::fwrite(&n, sizeof n, 1, file) == 1 && std::fwrite(x.data(), sizeof x[0], n, file) == n;
}
template <class Values> bool ReadValues(FILE *file, Values *x)
{
  size_t n;
  if (std::fread(&n, sizeof n, 1, file) != 1) return false;
  x->resize(n);
  return std::fread(x->data(), sizeof(*x)[0], n, file) == n;
}
inline bool Write(const AtvRun &run, FILE *file)
{
  const double        number[] = {run.eps, run.step_max, run.cpu, (double)run.equations, (double)run.x.size()};
  std::vector<double> numbers(number, number + 5);
  bool                good = WriteValues(run.name, file) && WriteValues(run.failure, file) && WriteValues(numbers, file) && WriteValues(run.time, file) &&
              std::fwrite(&run.count, sizeof run.count, 1, file) == 1;
  for (const auto &x : run.x) good = good && WriteValues(x, file);
  return good;
}
inline bool Read(FILE *file, AtvRun *run)
{
  std::vector<double> number;
  if (!ReadValues(file, &run->name) || !ReadValues(file, &run->failure) || !ReadValues(file, &number) || !ReadValues(file, &run->time) ||
      std::fread(&run->count, sizeof run->count, 1, file) != 1)
    return false;
  run->eps       = number[0];
  run->step_max  = number[1];
  run->cpu       = number[2];
  run->equations = (long)number[3];
  run->x.resize((size_t)number[4]);
  return std::all_of(run->x.begin(), run->x.end(), [&](std::vector<double> &x) { return ReadValues(file, &x); });
}

class AtvRuns
{
public:
  std::shared_ptr<const ModalBody> model;
  double                           end = 2, dt = 4e-3, limit = 120; /* s; limit: CPU seconds of a run */

  using Configure = std::function<PetscErrorCode(TS)>;

  /* Purpose of a run. A sample within a step costs as much as ten steps, so that time and samples need two runs */
  enum Of { Time, Samples, Both };

  /* configure is called after the tolerances have been set */
  PetscErrorCode hht(const std::string &name, double eps, double step_max, const Configure &configure, AtvRun *run, Of of = Both) const
  {
    PetscFunctionBegin;
    *run = started(name, eps, step_max);
    if (of != Samples) PetscCall(hhtSolve(configure, false, run));
    if (of == Time) PetscFunctionReturn(0);
    const double cpu = run->cpu;
    PetscCall(hhtSolve(configure, true, run));
    if (of == Both) run->cpu = cpu;
    PetscFunctionReturn(0);
  }

#if defined(HHTDAE_HAVE_IDA)
  PetscErrorCode ida(const std::string &name, double eps, double step_max, wp::FirstOrder::Form form, AtvRun *run) const
  {
    std::unique_ptr<SceneProblem> p;
    std::shared_ptr<hhtex::Atv>   atv;
    wp::IDASettings               settings;
    struct State {
      double              t;
      std::vector<double> u, v, a;
    };
    std::vector<State> states;

    PetscFunctionBegin;
    *run = started(name, eps, step_max);
    PetscCall(SceneProblem::make(
        name,
        [&](MPI_Comm comm) {
          atv = std::make_shared<hhtex::Atv>(comm, model);
          atv->watchFrame();
          return std::shared_ptr<Scene>(atv, &atv->scene);
        },
        end, &p));
    const wp::Reference points(*p, times());
    settings.form         = form;
    settings.maxStep      = step_max;
    settings.testVelocity = form == wp::FirstOrder::Form::Stabilized;
    settings.looser       = form == wp::FirstOrder::Form::Stabilized ? 1e3 : 1e6;
    settings.part         = partOfTolerance(*atv, p->n);
    settings.look         = [&](double t, const double *u, const double *v, const double *a) {
      states.push_back({t, {u, u + p->n}, {v, v + p->n}, {a, a + p->n}});
    };
    const wp::Case case_ = wp::SceneCase(*p);
    const wp::Run  r     = wp::IDASolver(case_, *p, points, settings).run(eps, wp::Limits{limit});
    run->failure         = r.failure;
    run->cpu             = r.time - r.extra;
    run->count           = r.count;
    run->equations       = equations(*p, form);
    std::vector<double> u(p->n), v(p->n), a(p->n), x;
    if (p->reference(p->t0, u.data(), v.data(), a.data())) states.insert(states.begin(), State{p->t0, u, v, a});
    for (const State &s : states) {
      PetscCall(p->channels(s.t, s.u.data(), s.v.data(), s.a.data(), x));
      run->time.push_back(s.t);
      run->x.push_back(x);
    }
    PetscFunctionReturn(0);
  }
#endif

  /* Repeats the first run and writes its page */
  PetscErrorCode page(const ReducedBody &body, const std::string &file) const
  {
    TS      ts;
    TSAdapt adapt;

    PetscFunctionBegin;
    hhtex::Atv atv(PETSC_COMM_SELF, model);
    PetscCall(hhtex::ShowAtvFrame(body, &atv));
    atv.scene.output().page = file;
    PetscCall(atv.scene.createTS(&ts));
    PetscCall(TSSetMaxTime(ts, end));
    PetscCall(TSSetMaxSteps(ts, 100000000));
    PetscCall(TSSetTolerances(ts, 1e-5, nullptr, 1e-5, nullptr));
    PetscCall(TSGetAdapt(ts, &adapt));
    PetscCall(TSAdaptSetStepLimits(adapt, PETSC_DEFAULT, 5e-4));
    PetscCall(atv.scene.solve(ts));
    PetscCall(TSDestroy(&ts));
    PetscFunctionReturn(0);
  }

  /* cond_2 of the Newton matrix in the paper's three scalings, after ten steps, for a step of length h */
  PetscErrorCode conditions(const std::vector<double> &h, std::vector<hhtstab::Conditions> *list) const
  {
    TS ts;

    PetscFunctionBegin;
    hhtex::Atv atv(PETSC_COMM_SELF, model);
    PetscCall(atv.scene.createTS(&ts));
    PetscCall(TSSetMaxTime(ts, end));
    PetscCall(TSSetMaxSteps(ts, 10));
    PetscCall(TSSetTolerances(ts, 1e-5, nullptr, 1e-5, nullptr));
    PetscCall(atv.scene.solve(ts));
    list->resize(h.size());
    for (size_t k = 0; k < h.size(); k++) PetscCall(hhtstab::ScalingConditions(ts, h[k], &(*list)[k]));
    PetscCall(TSDestroy(&ts));
    PetscFunctionReturn(0);
  }

  std::vector<double> times() const
  {
    std::vector<double> t;
    for (int k = 1; k <= (int)std::lround(end / dt); k++) t.push_back(k * dt);
    return t;
  }

private:
  /* IDA tests all unknowns against the same absolute tolerance, in metres and radians. A modal coordinate has other
     units: its tolerance is multiplied by `part`, a tenth of the reciprocal of the largest motion of an attachment per
     unit of the coordinate, the best of the values tried for IDA. Errors of pitch rate and reaction with the largest
     step of the paper: part = 1 10 % and 14 %; the reciprocal 6.7 % and 12.5 %; a tenth of it 0.2 % and 0.4 %, all at
     4,600 to 4,900 iterations. The errors are due to iterations that end too early: if IDA's iteration ends at 0.01 of
     the error test instead of a third, part = 1 gives 1.3 % and 1.2 % */
  std::vector<double> partOfTolerance(const hhtex::Atv &atv, PetscInt n) const
  {
    std::vector<double> part(n, 1.);
    const PetscInt      first = ModelOf(atv.scene).number.body[atv.frame.id] + 6;
    for (PetscInt k = 0; k < model->modes(); k++) {
      double most = 1;
      for (const ModalAttachment &a : model->attachments) most = std::max({most, a.translation.col(k).norm(), a.rotation.col(k).norm()});
      part[first + k] = 0.1 / most;
    }
    return part;
  }

  PetscErrorCode hhtSolve(const Configure &configure, bool watched, AtvRun *run) const
  {
    TS                ts;
    TSAdapt           adapt;
    TSHHT3Statistics  s;
    TSConvergedReason reason;
    Vec               U;
    PetscInt          n;

    PetscFunctionBegin;
    hhtex::Atv atv(PETSC_COMM_SELF, model);
    atv.watchFrame();
    PetscCall(atv.scene.createTS(&ts));
    PetscCall(TSSetMaxTime(ts, end));
    PetscCall(TSSetMaxSteps(ts, 100000000));
    PetscCall(TSSetTolerances(ts, run->eps, nullptr, run->eps, nullptr));
    PetscCall(TSGetAdapt(ts, &adapt));
    if (run->step_max > 0) PetscCall(TSAdaptSetStepLimits(adapt, PETSC_DEFAULT, run->step_max));
    if (configure) PetscCall(configure(ts));
    PetscCall(TSSetFromOptions(ts));
    PetscCall(TSSetErrorIfStepFails(ts, PETSC_FALSE));
    hhtex::Watch watch(atv.scene, dt, [run](double t, const std::vector<double> &x) {
      run->time.push_back(t);
      run->x.push_back(x);
    });
    if (watched) PetscCall(watch.attach(ts));
    const double begin = wp::ProcessorSeconds(); /* including the set-up, as for the other solvers */
    PetscCall(atv.scene.solve(ts));
    run->cpu = wp::ProcessorSeconds() - begin;
    PetscCall(TSGetConvergedReason(ts, &reason));
    if (reason <= 0) run->failure = TSConvergedReasons[reason];
    PetscCall(TSHHT3GetStatistics(ts, &s));
    run->count = {s.steps, s.rejected, s.newton, s.residuals, s.jacobians, s.factorizations};
    PetscCall(TSGetSolution(ts, &U));
    PetscCall(VecGetSize(U, &n));
    run->equations = n;
    PetscCall(TSDestroy(&ts));
    PetscFunctionReturn(0);
  }

  static AtvRun started(const std::string &name, double eps, double step_max)
  {
    AtvRun r;
    r.name     = name;
    r.eps      = eps;
    r.step_max = step_max;
    return r;
  }

  static long equations(const SceneProblem &p, wp::FirstOrder::Form form)
  {
    long n = p.n;
    for (TSHHT3Role r : p.role)
      n += r == TSHHT3_COORDINATE || (form == wp::FirstOrder::Form::Stabilized && r == TSHHT3_HOLONOMIC);
    return n;
  }
};

/* Largest difference of a channel from the reference, relative to its largest value; NaN for a run that did not reach
   the end. The reference may have additional samples between those of the run */
inline double Difference(const AtvRun &run, const AtvRun &reference, PetscInt channel)
{
  double       most = 0, worst = 0;
  const size_t c = (size_t)channel, n = run.x.size(), all = reference.x.size();
  if (!run.failure.empty() || n < 2 || (all - 1) % (n - 1)) return std::nan("");
  for (const auto &x : reference.x) most = std::max(most, std::fabs(x[c]));
  for (size_t k = 0; k < n; k++) hhtex::Widen(worst, run.x[k][c], reference.x[k * ((all - 1) / (n - 1))][c]);
  return worst / most;
}

/* ---- stress ---- */

/* Largest von Mises stress of one node during a run */
struct NodeStress {
  double stress = 0, time = 0;
};

class AtvStress
{
public:
  AtvStress(const ReducedBody &body, const hhtex::Atv &channels) : body_(body), atv_(channels) {}

  PetscErrorCode spots(const AtvRun &run, PetscInt count, std::vector<HotSpot> *list) const
  {
    HotSpots hot(body_);
    PetscFunctionBegin;
    for (size_t k = 0; k < run.x.size(); k++) PetscCall(hot.add(run.time[k], atv_.modes(run.x[k])));
    PetscCall(hot.highest(count, 0.05, list));
    PetscFunctionReturn(0);
  }

  NodeStress at(const AtvRun &run, PetscInt label) const
  {
    NodeStress   most;
    Eigen::Index row = -1;
    for (size_t i = 0; i < body_.stress.node.size(); i++)
      if (body_.label[(size_t)body_.stress.node[i]] == label) row = (Eigen::Index)(6 * i);
    if (row < 0) return {std::nan(""), std::nan("")};
    for (size_t k = 0; k < run.x.size(); k++) {
      const Eigen::Matrix<double, 6, 1> s = body_.stress.values.middleRows<6>(row) * atv_.modes(run.x[k]);
      const double                      mises =
          std::sqrt(0.5 * (std::pow(s[0] - s[1], 2) + std::pow(s[1] - s[2], 2) + std::pow(s[2] - s[0], 2)) +
                    3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
      if (mises > most.stress) most = {mises, run.time[k]};
    }
    return most;
  }

private:
  const ReducedBody &body_;
  const hhtex::Atv  &atv_;
};

} // namespace hhtbench

#endif
