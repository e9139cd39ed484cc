/* A run of one model by one integrator: samples of its channels at common times, and its costs */
#ifndef HHTDAE_SOAK_MODEL_RUN_H
#define HHTDAE_SOAK_MODEL_RUN_H

#include "balance/newton_euler.h"
#include "bench/page.h"
#include "bench/process_use.h"
#include "model.h"
#include "model_residual.h"

namespace soak
{

using hhtbench::ProcessorSeconds;

constexpr int samples = 24; /* not counting the start */

struct Trajectory {
  std::string                      failure;  /* empty: the run reached the end */
  std::vector<std::vector<double>> x;        /* channels at the sample times, without the start */
  std::vector<long>                steps_at; /* steps so far, at the sample times */
  TSHHT3Statistics                 cost{};
  double                           cpu    = 0;
  double                           misfit = 0, slip = -1; /* largest values at ends of steps, see Misfit() */
  long                             steps = 0;
  double      balance = -1, between = -1; /* largest imbalance of a body at ends of steps, and at samples between them */
  double      unsolved = -1;              /* largest residual of a body at ends of steps, beyond what is allowed */
  int         unjudged = 0;               /* number of bodies */
  std::string out_of_balance, where_unsolved; /* where and when these largest values occurred */
  bool        late = false; /* stopped at the limit of work */
  bool        arrived() const { return failure.empty() && (int)x.size() == samples; }
};

inline double SampleTime(double end, int k) { return k == samples ? end : end * k / samples; }

/* Error handler that keeps the first message of an error instead of printing PETSc's trace */
class Quiet
{
public:
  std::string message;
  explicit Quiet(bool loud = false) : loud_(loud) { PetscPushErrorHandler(keep, this); }
  ~Quiet() { PetscPopErrorHandler(); }
  Quiet(const Quiet &) = delete;

private:
  bool                  loud_;
  static PetscErrorCode keep(MPI_Comm comm, int line, const char *function, const char *file, PetscErrorCode code,
                             PetscErrorType type, const char *message, void *ctx)
  {
    Quiet *q = static_cast<Quiet *>(ctx);
    if (type == PETSC_ERROR_INITIAL && message && q->message.empty()) q->message = message;
    return q->loud_ ? PetscTraceBackErrorHandler(comm, line, function, file, code, type, message, nullptr) : code;
  }
};

/* Limits of runs are counted in work instead of time, so that results do not depend on the load of the machine:
   residuals, where those of small systems count at least as much as the operations that accompany them */
constexpr double work_per_second = 1e7; /* approximately, for an idle core */
inline double    WorkOf(double residuals, PetscInt unknowns) { return residuals * ((double)unknowns + 50); }

/* ---- hhtdae ---- */

struct Settings {
  double            eps       = 0; /* 0: default */
  bool              paper     = false;
  double            radius    = -1;    /* negative: default */
  bool              options   = false; /* use options from the command line */
  double            work      = 1e300; /* limit of work, see WorkOf() */
  double            first     = 0;     /* length of the first step, after which steps grow by at most a fifth; 0: default */
  double            corrector = 0;     /* 0: default */
  bool              laws      = false; /* judge the balance of every body */
  double            tolerance = 0;     /* for the laws: the tolerance of the run, and the error of a position that the corrector may leave, */
  double            slack     = 0;     /* see model_residual.h */
  std::string       save, resume;      /* checkpoint to write, checkpoint to resume from */
  long              save_at = 0;       /* after this step */
  const Trajectory *until   = nullptr; /* for a resumed run: the samples before the checkpoint */
};

struct Watcher {
  Scene               &scene;
  double               end;
  const Settings      &settings;
  std::size_t          observed; /* number of channels of the model; those of the laws follow */
  hhtest::NewtonEuler *laws;
  Trajectory          &result;
};

/* Keeps the largest value so far, and a note where it occurred */
inline void Keep(const hhtest::Imbalance &now, double t, double *most, std::string *note)
{
  if (!(now.largest <= *most) && note) *note = hhtbench::Text("%s at t = %g by %.1e", now.where.c_str(), t, now.largest);
  if (!(now.largest <= *most)) *most = now.largest;
}

inline PetscErrorCode JudgeLaws(Watcher &w, TS ts, double t)
{
  std::vector<double> values;
  BodyResiduals       left(ts, w.settings.slack, w.settings.tolerance);
  PetscFunctionBegin;
  PetscCall(w.scene.sample(ts, t, values));
  PetscCall(left.make(ts, t));
  Keep(w.laws->judge(values, left.get()), t, &w.result.balance, &w.result.out_of_balance);
  Keep(w.laws->unsolved(values, left.get()), t, &w.result.unsolved, &w.result.where_unsolved);
  PetscFunctionReturn(0);
}

/* Violation of the constraints by the state: of positions, in lengths and sines; of velocities, as they are, and times
   the step, because every step solves them anew */
inline PetscErrorCode Misfit(TS ts, PetscReal t, Trajectory *result)
{
  Vec                U, V, A, F;
  const PetscScalar *f;
  PetscReal          before;
  PetscFunctionBegin;
  PetscCall(TSGetPrevTime(ts, &before));
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(VecDuplicate(U, &A));
  PetscCall(VecDuplicate(U, &F));
  PetscCall(VecZeroEntries(A));
  PetscCall(TSComputeI2Function(ts, t, U, V, A, F));
  PetscCall(VecGetArrayRead(F, &f));
  for (TSHHT3Role role : {TSHHT3_HOLONOMIC, TSHHT3_NONHOLONOMIC}) {
    IS              is;
    const PetscInt *row;
    PetscInt        n;
    const bool      position = role == TSHHT3_HOLONOMIC;
    PetscCall(TSHHT3GetIS(ts, role, &is));
    PetscCall(ISGetLocalSize(is, &n));
    PetscCall(ISGetIndices(is, &row));
    for (PetscInt k = 0; k < n; k++) {
      const double off = std::abs(PetscRealPart(f[row[k]]));
      result->misfit   = std::max(result->misfit, position ? off : off * (t - before));
      if (!position) result->slip = std::max(result->slip, off);
    }
    PetscCall(ISRestoreIndices(is, &row));
  }
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCall(VecDestroy(&A));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(0);
}

inline PetscErrorCode WatchRun(TS ts, PetscInt step, PetscReal t, Vec X, void *ctx)
{
  Watcher            &w = *static_cast<Watcher *>(ctx);
  std::vector<double> values;
  const std::size_t   before = w.result.x.size();
  bool                late   = false;
  PetscFunctionBegin;
  if (step <= 0) PetscFunctionReturn(0);
  while ((int)w.result.x.size() < samples && SampleTime(w.end, (int)w.result.x.size() + 1) <= t * (1 + 1e-12)) {
    const double at = std::fmin(t, SampleTime(w.end, (int)w.result.x.size() + 1));
    PetscCall(w.scene.sample(ts, at, values));
    if (w.laws && at < t) Keep(w.laws->judge(values), at, &w.result.between, nullptr);
    values.resize(w.observed);
    w.result.x.push_back(values);
    w.result.steps_at.push_back((long)step);
  }
  if (w.laws && (w.result.x.size() > before || step < 20)) PetscCall(JudgeLaws(w, ts, t));
  if (w.result.x.size() > before) PetscCall(Misfit(ts, t, &w.result));
  if (step == w.settings.save_at && !w.settings.save.empty()) /* after the samples of the step, which the resumed run does not repeat */
    PetscCall(TSHHT3CheckpointSave(ts, w.settings.save.c_str()));
  if (step % 16 == 0) {
    PetscInt         unknowns;
    TSHHT3Statistics cost;
    PetscCall(VecGetSize(X, &unknowns));
    PetscCall(TSHHT3GetStatistics(ts, &cost));
    late = WorkOf(cost.residuals, unknowns) > w.settings.work;
  }
  if (late) {
    w.result.late    = true;
    w.result.failure = hhtbench::Text("took longer than the limit, at t = %g of %g", t, w.end);
    PetscCall(TSSetConvergedReason(ts, TS_CONVERGED_USER));
  }
  PetscFunctionReturn(0);
}

inline PetscErrorCode SolveBy(const Model &m, const Settings &s, Trajectory *result)
{
  TS                ts;
  TSConvergedReason reason;
  PetscFunctionBegin;
  std::unique_ptr<hhtest::NewtonEuler> laws;
  if (s.laws) {
    laws             = std::make_unique<hhtest::NewtonEuler>(*m.scene, m.specs);
    result->unjudged = (int)DataOf(*m.scene).bodies.size() - laws->judged();
  }
  PetscCall(m.scene->createTS(&ts));
  PetscCall(TSSetMaxTime(ts, m.end));
  PetscCall(TSSetMaxSteps(ts, 100000000));
  if (s.eps > 0) PetscCall(TSSetTolerances(ts, s.eps, nullptr, s.eps, nullptr));
  if (s.paper) PetscCall(TSHHT3SetForm(ts, TSHHT3_FORM_PAPER));
  if (s.radius >= 0) PetscCall(TSHHT3SetRadius(ts, s.radius));
  if (s.corrector > 0) PetscCall(TSHHT3SetCorrectorTolerance(ts, s.corrector));
  if (s.first > 0) {
    TSAdapt adapt;
    PetscCall(TSSetTimeStep(ts, s.first));
    PetscCall(TSGetAdapt(ts, &adapt));
    PetscCall(TSAdaptSetClip(adapt, 0.1, 1.2));
  }
  if (s.options) PetscCall(TSSetFromOptions(ts));
  if (!s.resume.empty()) PetscCall(TSHHT3CheckpointLoad(ts, s.resume.c_str()));
  if (s.until) {
    result->x.assign(s.until->x.begin(), s.until->x.begin() + (long)s.until->x.size());
    result->steps_at = s.until->steps_at;
  }
  Watcher watcher{*m.scene, m.end, s, m.observed.size(), laws.get(), *result};
  PetscCall(TSMonitorSet(ts, WatchRun, &watcher, nullptr));
  const double         start  = ProcessorSeconds();
  const PetscErrorCode failed = m.scene->solve(ts);
  result->cpu                 = ProcessorSeconds() - start;
  PetscCall(TSHHT3GetStatistics(ts, &result->cost));
  result->steps = (long)result->cost.steps;
  PetscCall(failed);
  PetscCall(TSGetConvergedReason(ts, &reason));
  if (reason < 0) result->failure = TSConvergedReasons[reason];
  for (const auto &x : result->x)
    for (double v : x)
      if (!std::isfinite(v)) result->failure = "a result is not a number";
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

/* The scene is made anew for every run, because a run changes axes and counted angles */
inline Trajectory RunHHT(const Model &m, const Settings &s)
{
  Trajectory result;
  Quiet      quiet(s.options);
  if (SolveBy(m, s, &result)) result.failure = quiet.message.empty() ? "error without a message" : quiet.message;
  if (result.failure.empty() && (int)result.x.size() != samples) result.failure = "ended early";
  return result;
}

} // namespace soak

#endif
