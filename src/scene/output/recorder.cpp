#include "scene/output/recorder.h"
#include "scene/guard.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace hhtdae
{

namespace
{

/* Evaluates the state at time t of the last step and lets the tasks record it */
PetscErrorCode RecordAt(Recorder &r, TS ts, double t, const std::vector<Task *> &tasks)
{
  Runtime      &R = r.R;
  Vec           U = r.U, V = r.V;
  const double *u, *v, *a, *local[3];
  const bool    solve = std::any_of(tasks.begin(), tasks.end(), [](const Task *task) { return task->from_equations; });
  PetscFunctionBegin;
  if (!r.dense) PetscCall(TS2GetSolution(ts, &U, &V));
  else PetscCall((solve ? TSHHT3EvaluateAt : TSHHT3Interpolate)(ts, t, U, V, r.A));
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  PetscCall(VecGetArrayRead(r.A, &a));
  PetscCall(LocalMotion(R, u, v, a, r.acceleration, local));
  R.bodies.move(local[0], local[1]);
  Evaluation e{t, local[0], local[1], local[2], R.bodies, R.n};
  for (Task *task : tasks) {
    PetscCall(task->record(R, e));
    task->done++;
  }
  PetscCall(VecRestoreArrayRead(r.A, &a));
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscFunctionReturn(0);
}

/* The next sample time of a task if it is at most t, up to rounding; else infinity */
double Due(const Recorder &r, const Task &task, double t)
{
  constexpr double never = std::numeric_limits<double>::infinity();
  if (task.done == 0) return r.begin;
  if (task.dt == 0) return r.last < t ? t : never;
  const double due = r.begin + task.done * task.dt;
  return due <= t + 1e-9 * task.dt ? std::min(due, t) : never;
}

/* Takes all samples of the step that ends at t. At each sample time the state is evaluated once for all tasks that are due */
PetscErrorCode RecordStep(Recorder &r, TS ts, double t)
{
  std::vector<Task *> now;
  std::vector<double> due(r.tasks.size());
  PetscFunctionBegin;
  for (bool ended = false; !ended;) {
    double next = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < due.size(); k++) {
      due[k] = Due(r, *r.tasks[k], t);
      next   = std::min(next, due[k]);
    }
    if (next > t) break;
    ended = next == t; /* tasks with dt = 0 are due only once at t */
    now.clear();
    for (std::size_t k = 0; k < due.size(); k++)
      if (due[k] == next) now.push_back(r.tasks[k].get());
    PetscCall(Guarded([&] { return RecordAt(r, ts, next, now); }));
  }
  r.last = t;
  for (auto &task : r.tasks) PetscCall(task->stepped(r.R));
  PetscFunctionReturn(0);
}

/* The first sample is taken after the first step: accelerations and multipliers of the start are not known before, and
   the first step may correct the initial state. */
PetscErrorCode Monitor(TS ts, PetscInt step, PetscReal t, Vec, void *ctx)
{
  Runtime &R = *static_cast<Runtime *>(ctx);
  PetscFunctionBegin;
  /* TSSolve() reports an interpolated final time with step = -1; it is within the last step, which has been sampled */
  if (step < 0) PetscFunctionReturn(0);
  Recorder &r = *R.recorder;
  if (!r.begun) {
    r.begun = true;
    r.begin = r.last = t;
    if (r.dense) PetscFunctionReturn(0);
    PetscCall(RecordStep(r, ts, t));
  } else if (t > r.last) { /* t is not larger after a roll-back */
    PetscCall(RecordStep(r, ts, t));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode ReadOptions(TS ts, OutputSettings &o)
{
  PetscReal rate = 0, dt = o.dt, animation_dt = o.animation_dt, page_dt = o.page_dt;
  char      file[PETSC_MAX_PATH_LEN] = "";
  PetscBool   set;
  const char *prefix;
  PetscFunctionBegin;
  PetscCall(TSGetOptionsPrefix(ts, &prefix));
  PetscOptionsBegin(PetscObjectComm((PetscObject)ts), prefix, "Results of a scene", "TS");
  const auto name = [&](const char *option, const char *text, std::string &value) {
    PetscFunctionBegin;
    PetscCall(PetscOptionsString(option, text, "Scene::output", value.c_str(), file, sizeof file, &set));
    if (set) value = file;
    PetscFunctionReturn(0);
  };
  PetscCall(name("-scene_output", "HDF5 file of the channels", o.file));
  PetscCall(name("-scene_csv", "CSV file of the channels", o.csv));
  PetscCall(PetscOptionsReal("-scene_dt", "Time between samples, 0: every step", "Scene::output", dt, &dt, nullptr));
  PetscCall(PetscOptionsReal("-scene_rate", "Samples per unit of time", "Scene::output", rate, &rate, &set));
  if (set) {
    PetscCheck(rate > 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "-scene_rate %g: samples per unit of time must be positive", (double)rate);
    dt = 1 / rate;
  }
  PetscCall(name("-scene_animation", "Prefix of the animation's files", o.animation));
  PetscCall(PetscOptionsReal("-scene_animation_dt", "Time between frames, 0: every step", "Scene::output", animation_dt, &animation_dt, nullptr));
  PetscCall(name("-scene_balance", "Energy and momentum at every step; a file, or printed", o.balance_file));
  if (set) o.balance = true;
  PetscCall(name("-scene_page", "HTML page that shows the run", o.page));
  PetscCall(PetscOptionsReal("-scene_page_dt", "Time between the page's frames, 0: as -scene_page_frames says", "Scene::output", page_dt, &page_dt, nullptr));
  PetscCall(PetscOptionsInt("-scene_page_frames", "Frames of the page from the start to the final time", "Scene::output", o.page_frames, &o.page_frames, nullptr));
  PetscCall(PetscOptionsInt("-scene_page_nodes", "Nodes that the page shows of whole finite-element bodies", "Scene::output", o.page_nodes, &o.page_nodes, nullptr));
  PetscOptionsEnd();
  PetscCheck(page_dt >= 0 && o.page_frames > 0 && o.page_nodes > 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "-scene_page_dt %g must not be negative, -scene_page_frames %d and -scene_page_nodes %d must be positive", (double)page_dt, (int)o.page_frames, (int)o.page_nodes);
  PetscCheck(dt >= 0 && animation_dt >= 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "times between samples (%g) and frames (%g) must not be negative", (double)dt, (double)animation_dt);
  o.dt           = dt;
  o.animation_dt = animation_dt;
  o.page_dt      = page_dt;
  PetscFunctionReturn(0);
}

/* Computes the time between the frames of a page from their number and the end time; a run without an end time has a frame at every step. */
PetscErrorCode SpreadFrames(TS ts, OutputSettings &o)
{
  PetscReal t, end;
  PetscFunctionBegin;
  if (o.page.empty() || o.page_dt > 0) PetscFunctionReturn(0);
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TSGetMaxTime(ts, &end));
  if (end > t && end < PETSC_MAX_REAL / 2) o.page_dt = (end - t) / o.page_frames;
  PetscCall(PetscInfo(ts, "scene: a frame of the page every %g\n", (double)o.page_dt));
  PetscFunctionReturn(0);
}

PetscErrorCode MakeTasks(Recorder &r, const OutputSettings &o)
{
  PetscFunctionBegin;
  for (auto make : {MakeTable, MakeAnimation, MakeBalanceSheet, MakePage}) {
    std::unique_ptr<Task> task;
    PetscCall(make(r.R, o, task));
    if (task) r.tasks.push_back(std::move(task));
  }
  PetscFunctionReturn(0);
}

/* For TS types other than TSHHT3: samples at the ends of steps, without accelerations */
PetscErrorCode FallBack(Recorder &r, TS ts)
{
  TSType type;
  PetscFunctionBegin;
  PetscCall(TSGetType(ts, &type));
  for (auto &task : r.tasks) task->dt = 0;
  PetscCall(VecSet(r.A, std::numeric_limits<double>::quiet_NaN()));
  PetscCall(PetscPrintf(r.R.scene.comm, "scene: TS type %s gives no values inside a step and no accelerations: samples are taken at the ends of steps, accelerations are nan\n", type));
  PetscFunctionReturn(0);
}

} // namespace

/* An error if the time between samples is so small that rounding would make sample times equal */
static PetscErrorCode CheckDistances(const Recorder &r, TS ts)
{
  PetscReal t, end;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TSGetMaxTime(ts, &end));
  const double latest = end < PETSC_MAX_REAL / 2 ? std::max(std::abs(t), std::abs(end)) : std::abs(t), least = 16 * PETSC_MACHINE_EPSILON * latest;
  for (const auto &task : r.tasks)
    PetscCheck(task->dt == 0 || (task->dt > least && std::isfinite(task->dt)), r.R.scene.comm, PETSC_ERR_ARG_OUTOFRANGE,
               "-scene_dt, -scene_animation_dt, -scene_page_dt: samples cannot be %g apart in a run to t = %g; at least %g, or 0 for every step", task->dt, latest, least);
  PetscFunctionReturn(0);
}

Recorder::~Recorder()
{
  PetscBool gone = PETSC_FALSE;
  if (PetscFinalized(&gone) || gone) return;
  for (Vec *x : {&U, &V, &A}) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(x));
}

/* If a checkpoint was loaded after TSSetUp() but before the recorder existed, the recorder's numbers are in the vector
   Runtime::axes, and the run continues the same files. Otherwise they are zero, or, after Scene::createTS(&next, ts),
   those of the other run; in that case this run has made no step. */
static PetscErrorCode ResumeFromLoaded(Runtime &R, TS ts, PetscReal t)
{
  const double *x;
  PetscInt      n, steps;
  PetscFunctionBegin;
  PetscCall(TSGetStepNumber(ts, &steps));
  PetscCall(VecGetLocalSize(R.axes, &n));
  PetscCall(VecGetArrayRead(R.axes, &x));
  const std::vector<double> stood(x + n - checkpoint_numbers + 2, x + n); /* the recorder's numbers follow the digest, kept.cpp */
  PetscCall(VecRestoreArrayRead(R.axes, &x));
  if (steps && stood[0] && stood[2] == t) PetscCall(ResumeOutput(R, stood.data()));
  PetscFunctionReturn(0);
}

PetscErrorCode AttachOutput(Runtime &R, const OutputSettings &settings, TS ts)
{
  OutputSettings o = settings;
  PetscReal      t;
  Vec            U;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &t));
  if (R.recorder) { /* a further TSSolve() continues the same output */
    if (t == R.recorder->last) PetscFunctionReturn(0);
    R.recorder->begun = false;
    for (auto &task : R.recorder->tasks) task->done = 0;
    PetscFunctionReturn(0);
  }
  PetscCall(ReadOptions(ts, o));
  auto r = std::make_shared<Recorder>(R);
  PetscCall(SpreadFrames(ts, o));
  PetscCall(MakeTasks(*r, o));
  if (r->tasks.empty()) PetscFunctionReturn(0);
  PetscBool dense;
  PetscCall(PetscObjectTypeCompare((PetscObject)ts, TSHHT3, &dense));
  r->dense = dense;
  PetscCall(TS2GetSolution(ts, &U, nullptr));
  PetscCall(VecDuplicate(U, &r->U));
  PetscCall(VecDuplicate(U, &r->V));
  PetscCall(VecDuplicate(U, &r->A));
  if (!dense) PetscCall(FallBack(*r, ts));
  PetscCall(CheckDistances(*r, ts));
  PetscCall(TSMonitorSet(ts, Monitor, &R, nullptr));
  R.recorder = r;
  PetscCall(ResumeFromLoaded(R, ts, t));
  PetscFunctionReturn(0);
}

static constexpr const char *expected_output = "hhtdae scene output";

PetscErrorCode ExpectOutput(TS ts, const OutputSettings &o)
{
  PetscContainer mark;
  PetscFunctionBegin;
  if (o.file.empty() && o.csv.empty() && o.animation.empty() && o.page.empty() && !o.balance) PetscFunctionReturn(0);
  PetscCall(PetscContainerCreate(PetscObjectComm((PetscObject)ts), &mark));
  PetscCall(PetscObjectCompose((PetscObject)ts, expected_output, (PetscObject)mark));
  PetscCall(PetscContainerDestroy(&mark));
  PetscFunctionReturn(0);
}

PetscErrorCode OutputIsAttached(TS ts)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectCompose((PetscObject)ts, expected_output, nullptr));
  PetscFunctionReturn(0);
}

PetscErrorCode TellOfNoOutput(const Runtime &R, TS ts)
{
  PetscInt    steps;
  PetscObject mark;
  PetscFunctionBegin;
  PetscCall(TSGetStepNumber(ts, &steps));
  if (steps) PetscFunctionReturn(0);
  PetscCall(PetscObjectQuery((PetscObject)ts, expected_output, &mark));
  if (!mark) PetscFunctionReturn(0);
  PetscCall(PetscPrintf(R.scene.comm, "scene: Scene::output() requests results, which Scene::solve() writes; TSSolve() and TSStep() write none\n"));
  PetscCall(OutputIsAttached(ts));
  PetscFunctionReturn(0);
}

PetscErrorCode SaveOutput(Runtime &R, double *x)
{
  PetscFunctionBegin;
  if (!R.recorder) PetscFunctionReturn(0);
  const Recorder &r = *R.recorder;
  x[0]              = r.begun;
  x[1]              = r.begin;
  x[2]              = r.last;
  for (const auto &task : r.tasks) {
    double *own = x + 4 + task->slot() * (task_numbers + 1);
    own[0]      = 1 + task->done;
    PetscCall(task->save(R, own + 1));
  }
  PetscFunctionReturn(0);
}

/* Resumes the output at the state of a checkpoint. Tasks that the checkpoint does not contain begin at their next sample
   time, counted from the same first sample. */
PetscErrorCode ResumeOutput(Runtime &R, const double *x)
{
  PetscFunctionBegin;
  if (!R.recorder || !x[0]) PetscFunctionReturn(0);
  Recorder &r = *R.recorder;
  r.begun     = true;
  r.begin     = x[1];
  r.last      = x[2];
  for (auto &task : r.tasks) {
    const double *own = x + 4 + task->slot() * (task_numbers + 1);
    if (own[0] > 0) {
      task->done = own[0] - 1;
      PetscCall(task->resume(R, own + 1));
    } else task->done = task->dt > 0 ? 1 + std::floor((r.last - r.begin) / task->dt * (1 + 1e-9)) : 1;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode FinishOutput(Runtime &R)
{
  PetscFunctionBegin;
  if (!R.recorder) PetscFunctionReturn(0);
  for (auto &task : R.recorder->tasks) PetscCall(task->finish(R));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
