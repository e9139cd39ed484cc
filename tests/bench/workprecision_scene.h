/* Scenes in the comparison: their case, and a reference where no formula gives one. The reference is IDA's at a tight
   tolerance. Two differences measure its quality: the difference to IDA at a tolerance ten times as large, which
   estimates its error, and the differences to hhtdae, another method on another formulation, at two tolerances, of
   which the second must be smaller */
#ifndef WORKPRECISION_SCENE_H
#define WORKPRECISION_SCENE_H

#include "scene_problem.h"
#include "workprecision_ts.h"
#if defined(HHTDAE_HAVE_IDA)
#include "workprecision_ida.h"
#endif

namespace wp
{

using hhtbench::SceneProblem;

inline const SceneProblem &AsScene(const Problem &p) { return static_cast<const SceneProblem &>(p); }

/* The functions of any scene that solvers need */
inline Case SceneCallbacks()
{
  Case c;
  c.scene    = true;
  c.createTS = [](const Problem &q, SceneAngles angles, TS *ts) {
    return angles == SceneAngles::None ? AsScene(q).createTS(ts) : AsScene(q).createEulerTS(ts, angles == SceneAngles::Problems);
  };
  c.accept   = [](const Problem &q, const double *u, const double *v) { AsScene(q).accept(u, v); };
  c.toStart  = [](const Problem &q, double *u, double *v, const double *near) { AsScene(q).toStart(u, v, near); };
  c.phiT     = [](const Problem &q, double t, const double *, double *f) { AsScene(q).phiT(t, f); };
  return c;
}

/* The case of an existing scene problem */
inline Case SceneCase(const SceneProblem &p)
{
  Case c = SceneCallbacks();
  c.name = p.name;
  return c;
}

#if defined(HHTDAE_HAVE_IDA)

struct SceneReferenceSettings {
  int         intervals = 20;    /* output points, equally spaced */
  double      eps       = 1e-11; /* tolerance of IDA */
  double      hht[2]    = {1e-6, 1e-8};
  Limits      limits    = {60.}; /* of each run */
  IDASettings ida;               /* largest step, order and other settings; both forms are tried one after the other */
};

struct SceneReferenceReport {
  std::string form;                        /* form of IDA; empty: there is no reference */
  std::string failure;                     /* reason of a failure; empty: none */
  double      ida[3]    = {-1., -1., -1.}; /* largest weighted difference to IDA at 10 eps: q, q', multipliers */
  double      hht[2][3] = {{-1., -1., -1.}, {-1., -1., -1.}}; /* differences to hhtdae at its two tolerances */
  double      idaTime = 0., hhtTime[2] = {0., 0.};
  Counters    idaCount;
  /* An error below this cannot be told from the reference's */
  double trusted(int kind) const { return 3. * ida[kind]; }
};

namespace detail
{

inline std::vector<double> OutputTimes(const Problem &p, int intervals)
{
  std::vector<double> times;
  for (int k = 1; k <= intervals; k++) times.push_back(k == intervals ? p.t1 : p.t0 + k * (p.t1 - p.t0) / intervals);
  return times;
}

/* One run of IDA that records the states at the output points */
inline Run RunForStates(const SceneProblem &p, const Reference &ref, IDASettings ida, double eps, const Limits &limits,
                        std::vector<std::vector<double>> (&states)[3])
{
  for (auto &s : states) s.clear();
  const auto look = ida.look;
  ida.look        = [&](double t, const double *u, const double *v, const double *a) {
    if (look) look(t, u, v, a);
    states[0].emplace_back(u, u + p.n);
    states[1].emplace_back(v, v + p.n);
    states[2].emplace_back(a, a + p.n);
  };
  IDASolver solver(SceneCase(p), p, ref, ida);
  return solver.run(eps, limits);
}

/* Finds the form of IDA that reaches the end: stabilized, otherwise index 3 */
inline PetscErrorCode FindStates(SceneProblem &p, const SceneReferenceSettings &s, IDASettings &ida,
                                 SceneReferenceReport &r)
{
  const Reference                  points(p, OutputTimes(p, s.intervals));
  std::vector<std::vector<double>> states[3];

  PetscFunctionBegin;
  for (FirstOrder::Form form : {FirstOrder::Form::Stabilized, FirstOrder::Form::Index3}) {
    const bool index3 = form == FirstOrder::Form::Index3;
    ida               = s.ida;
    ida.form          = form;
    ida.testVelocity  = !index3;
    ida.looser        = 1e6;
    const Run run     = RunForStates(p, points, ida, s.eps, s.limits, states);
    if (!run.failure.empty()) {
      r.failure += (r.failure.empty() ? "" : "; ") +
                   std::string(index3 ? "IDA, index 3: " : "IDA, stabilized index 2: ") + run.failure;
      continue;
    }
    r.form     = index3 ? "IDA, index 3" : "IDA, stabilized index 2";
    r.idaTime  = run.time;
    r.idaCount = run.count;
    for (size_t k = 0; k < points.times.size(); k++)
      PetscCall(p.addReference(points.times[k], states[0][k].data(), states[1][k].data(), states[2][k].data()));
    break;
  }
  PetscFunctionReturn(0);
}

} // namespace detail

/* Computes the reference of p and measures its quality; the report's failure is empty if IDA and hhtdae agree better
   at hhtdae's tighter tolerance. A failure of a solver is not an error */
inline PetscErrorCode ComputeSceneReference(SceneProblem &p, const SceneReferenceSettings &s, SceneReferenceReport *r)
{
  IDASettings ida;

  PetscFunctionBegin;
  *r = SceneReferenceReport();
  PetscCall(detail::FindStates(p, s, ida, *r));
  if (r->form.empty()) PetscFunctionReturn(0);
  r->failure.clear();
  const Reference ref(p);
  const Case      c = SceneCase(p);
  IDASolver       looser(c, p, ref, ida);
  const Run       second = looser.run(10. * s.eps, s.limits);
  if (!second.failure.empty()) r->failure = "IDA at the looser tolerance: " + second.failure;
  std::copy_n(second.error, 3, r->ida);
  for (int k = 0; k < 2; k++) {
    Run run;
    PetscCall(RunTS(c, p, ref, TSSettings(), s.hht[k], s.limits, &run));
    if (!run.failure.empty()) r->failure += (r->failure.empty() ? "" : "; ") + std::string("hhtdae: ") + run.failure;
    std::copy_n(run.error, 3, r->hht[k]);
    r->hhtTime[k] = run.time;
  }
  if (r->failure.empty() &&
      !(r->hht[1][0] < 1e-3 && (r->hht[1][0] < 0.5 * r->hht[0][0] || r->hht[1][0] < r->trusted(0) || r->hht[1][0] < s.hht[0])))
    r->failure = "hhtdae and IDA do not agree on the positions, or not the better the tighter hhtdae's tolerance";
  PetscFunctionReturn(0);
}

#endif

} // namespace wp

#endif
