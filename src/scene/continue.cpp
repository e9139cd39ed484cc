/* A run that continues another one from its present state, with a description that may have changed; states of runs before the first step. */
#include "extension.h"
#include "guard.h"
#include "journal.h"
#include "runtime.h"
#include "start.h"
#include "store.h"
#include <limits>

namespace hhtdae
{

namespace
{

constexpr double time_difference = 1e-6; /* units of time, or part of the time: over it motions show whether they move */

/* Whether two descriptions have the same coordinates, variables and states */
bool SameUnknowns(const SceneData &a, const SceneData &b)
{
  bool same = a.bodies.size() == b.bodies.size() && a.variables.size() == b.variables.size() && a.states.size() == b.states.size() &&
              a.extensions.size() == b.extensions.size();
  for (std::size_t k = 0; same && k < a.bodies.size(); k++) same = CoordinatesOf(a, a.bodies[k]) == CoordinatesOf(b, b.bodies[k]);
  for (std::size_t k = 0; same && k < a.extensions.size(); k++) same = a.extensions[k]->coordinates() == b.extensions[k]->coordinates();
  return same;
}

/* Batches of variables, states, channels and users' functions that have memory; CopyElementMemories() copies the memory of elements */
std::vector<Batch *> FunctionsWithMemory(const Runtime &R)
{
  std::vector<Batch *> all;
  for (const auto &b : R.batches)
    if (b->memory() && !b->isDescribed()) all.push_back(b.get());
  return all;
}

/* Number of values of accepted steps that an element stores, plus the number of angles that its expressions read */
int Memory(const SceneData &s, std::size_t e)
{
  int n = 0;
  if (e >= s.elements.size()) return 0;
  for (const Part &p : s.elements[e].parts) {
    n += p.store->memory();
    if (const std::vector<Expression> *all = p.store->expressions(p.index))
      for (const Expression &x : *all)
        for (const Measure &m : x.arguments) n += m.kind == Measure::Angle;
  }
  return n;
}

PetscErrorCode RefuseToContinue(const SceneData &s, const std::string &what)
{
  SETERRQ(s.comm, PETSC_ERR_SUP,
          "a run cannot go on when elements have come or gone that count angles over full turns or follow a curve, as %s: add or remove other joints, motions or forces instead (for "
          "example a motion of a velocity, to lock a shaft), or change a parameter of an element that exists in both runs",
          what.c_str());
}

PetscErrorCode CheckMemories(const SceneData &from, const SceneData &to)
{
  PetscFunctionBegin;
  for (std::size_t e = 0; e < std::max(from.elements.size(), to.elements.size()); e++) {
    const int before = Memory(from, e), after = Memory(to, e);
    if (before == after) continue;
    const ElementData &of = (before ? from : to).elements[e]; /* taken from the description that has the memory */
    PetscCall(RefuseToContinue(to, std::string(of.type) + " " + of.name + " has"));
  }
  PetscFunctionReturn(0);
}

/* Copies memories of functions, which are angles over full turns */
PetscErrorCode CopyFunctionMemories(const Runtime &from, Runtime &to)
{
  const std::vector<Batch *> a = FunctionsWithMemory(from), b = FunctionsWithMemory(to);
  int                        same = a.size() == b.size();
  PetscFunctionBegin;
  for (std::size_t k = 0; same && k < a.size(); k++) same = a[k]->memory() == b[k]->memory();
  if (to.size > 1) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, to.scene.comm));
  if (!same) PetscCall(RefuseToContinue(to.scene, "some have that channels, variables or formulas read"));
  for (std::size_t k = 0; k < a.size(); k++) {
    std::vector<double> memory(a[k]->memory());
    a[k]->copyMemory(memory.data(), false);
    b[k]->copyMemory(memory.data(), true);
  }
  PetscCall(KeepMemories(to));
  PetscFunctionReturn(0);
}

/* The parts of an element with memory */
std::vector<Part> PartsWithMemory(const ElementData &e)
{
  std::vector<Part> all;
  for (const Part &p : e.parts)
    if (p.store->memory()) all.push_back(p);
  return all;
}

/* Copies memories of elements (angles over full turns and points on curves) to the new description, because assembly uses
   them before there is a new run */
PetscErrorCode CopyElementMemories(const Runtime &from, SceneData &to)
{
  std::vector<double>                           x;
  std::vector<int>                              found;
  std::vector<std::pair<StoreBase *, PetscInt>> into;
  PetscFunctionBegin;
  PetscCall(CheckMemories(from.scene, to));
  for (std::size_t e = 0; e < to.elements.size(); e++) {
    if (!Memory(to, e)) continue;
    const std::vector<Part> a = PartsWithMemory(from.scene.elements[e]), b = PartsWithMemory(to.elements[e]);
    for (std::size_t k = 0; k < std::min(a.size(), b.size()); k++) {
      const std::size_t at = x.size();
      const int         n  = b[k].store->memory();
      if (n != a[k].store->memory()) continue;
      x.resize(at + n, 0.);
      found.push_back(0);
      for (const auto &batch : from.batches)
        if (!found.back()) found.back() = batch->memoryOf(a[k].store, a[k].index, x.data() + at);
      into.push_back({b[k].store, b[k].index});
    }
  }
  /* Ranks that have an element have the same memory of it; the others contribute -infinity to the maximum */
  if (from.size > 1) {
    for (std::size_t i = 0, at = 0; i < into.size(); at += into[i++].first->memory())
      if (!found[i]) std::fill_n(x.begin() + at, into[i].first->memory(), -std::numeric_limits<double>::infinity());
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, x.data(), (PetscMPIInt)x.size(), MPI_DOUBLE, MPI_MAX, from.scene.comm));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, found.data(), (PetscMPIInt)found.size(), MPI_INT, MPI_MAX, from.scene.comm));
  }
  for (std::size_t i = 0, at = 0; i < into.size(); at += into[i++].first->memory())
    if (found[i]) into[i].first->remember(into[i].second, x.data() + at);
  PetscFunctionReturn(0);
}

/* Values that elements take from the start (lengths, sums of couplers): those that the run before has keep them, others take them from its present poses, which `to` describes */
void ContinueElements(const SceneData &from, SceneData &to)
{
  for (std::size_t e = 0; e < to.elements.size(); e++)
    for (std::size_t k = 0; k < to.elements[e].parts.size(); k++) {
      const Part &p     = to.elements[e].parts[k];
      const bool  known = e < from.elements.size() && k < from.elements[e].parts.size();
      const Part  none  = {nullptr, -1}, before = known ? from.elements[e].parts[k] : none;
      p.store->continueFrom(to, p.index, before.store, before.index);
    }
}

/* Copies the state between runs of the same model */
PetscErrorCode CopyState(const Runtime &from, TS ts, Runtime &to, TS next)
{
  Vec U, V, X, Y;
  PetscFunctionBegin;
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(TS2GetSolution(next, &X, &Y));
  PetscCall(VecCopy(U, X));
  PetscCall(VecCopy(V, Y));
  PetscCall(VecCopy(from.axes, to.axes));
  PetscCall(UseAxes(to));
  to.queried_angles = from.queried_angles;
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode NotBegun(TS ts, const char *call, Runtime **R)
{
  PetscInt steps;
  PetscFunctionBegin;
  *R = RunOf(ts);
  PetscCheck(*R, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG, "%s: the TS is not one of a scene, Scene::createTS() makes them", call);
  PetscCall(ReadCheckpoint(ts)); /* a run continued from a checkpoint has begun */
  PetscCall(TSGetStepNumber(ts, &steps));
  PetscCheck(!steps, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE,
             "%s: the run has begun and cannot be moved; make a run that continues it, Scene::createTS(&next, ts)", call);
  PetscFunctionReturn(0);
}

PetscErrorCode ReadCheckpoint(TS ts)
{
  PetscErrorCode (*read)(TS);
  PetscFunctionBegin;
  PetscCall(PetscObjectQueryFunction((PetscObject)ts, "TSHHT3ReadCheckpoint_C", &read));
  if (read) PetscCall(read(ts));
  PetscFunctionReturn(0);
}

PetscErrorCode BeginCopy(TS ts, TSHHT3Start start, TS *copy)
{
  Runtime  *R = RunOf(ts);
  PetscReal t, end, atol, rtol;
  PetscFunctionBegin;
  PetscCall(CheckUnchanged(R->scene)); /* elements added after the set-up have no unknowns */
  PetscCall(CreateRun(R->model, copy));
  PetscCall(CopyState(*R, ts, *RunOf(*copy), *copy));
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TSGetTolerances(ts, &atol, nullptr, &rtol, nullptr));
  PetscCall(TSSetTolerances(*copy, atol, nullptr, rtol, nullptr));
  PetscCall(TSSetTime(*copy, t));
  PetscCall(TSGetMaxTime(ts, &end)); /* the duration of the run, if it has an end, is the time scale of the first step size */
  if (end < PETSC_MAX_REAL / 2 && end > R->scene.start.time) PetscCall(TSSetMaxTime(*copy, t + end - R->scene.start.time));
  PetscCall(TSSetMaxSteps(*copy, 1)); /* TSStep() requires a maximum time or a maximum number of steps */
  PetscCall(TSHHT3SetStart(*copy, start));
  PetscCall(TSStep(*copy));
  PetscFunctionReturn(0);
}

std::vector<double> ParametersNow(const SceneData &s)
{
  std::vector<double> x;
  for (const ParameterData &p : s.parameters) x.push_back(*p.present);
  return x;
}

PetscErrorCode ParametersAt(const Runtime &R, TS ts, PetscReal t, std::vector<double> *values)
{
  PetscReal now;
  PetscInt  steps;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &now));
  PetscCall(TSGetStepNumber(ts, &steps));
  *values = steps && t != now && !R.step_parameters.empty() ? R.step_parameters : ParametersNow(R.scene);
  PetscFunctionReturn(0);
}

PetscErrorCode KeepStart(TS ts, Vec A)
{
  Runtime &R = *RunOf(ts);
  Vec      now[3];
  PetscFunctionBegin;
  PetscCall(TS2GetSolution(ts, &now[0], &now[1]));
  now[2] = A;
  for (int k = 0; k < 3; k++) {
    if (!R.start_state[k]) PetscCall(VecDuplicate(A, &R.start_state[k]));
    PetscCall(VecCopy(now[k], R.start_state[k]));
  }
  PetscCall(TSGetTime(ts, &R.start_time));
  R.start_parameters = ParametersNow(R.scene);
  PetscFunctionReturn(0);
}

PetscErrorCode StateOfStart(TS ts, PetscReal t, Vec state[3], TS *copy)
{
  Runtime  &R = *RunOf(ts);
  PetscBool same[2] = {PETSC_FALSE, PETSC_FALSE};
  PetscReal now;
  Vec       U, V;
  PetscFunctionBegin;
  *copy = nullptr;
  PetscCall(TSGetTime(ts, &now));
  PetscCheck(t == now, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "Time %g: the run has not begun, and its state is that of t = %g", (double)t, (double)now);
  PetscCall(TS2GetSolution(ts, &U, &V));
  if (R.start_state[2] && t == R.start_time && R.start_parameters == ParametersNow(R.scene)) {
    PetscCall(VecEqual(U, R.start_state[0], &same[0]));
    PetscCall(VecEqual(V, R.start_state[1], &same[1]));
  }
  if (same[0] && same[1]) {
    for (int k = 0; k < 3; k++) PetscCall(VecCopy(R.start_state[k], state[k]));
    PetscFunctionReturn(0);
  }
  PetscCall(BeginCopy(ts, TSHHT3_START_REPORT, copy));
  PetscCall(TSHHT3EvaluateAt(*copy, t, state[0], state[1], state[2]));
  PetscFunctionReturn(0);
}

namespace
{

/* Whether parameters are others than `before` on any rank; all ranks have to take the same branch */
PetscErrorCode ParametersChanged(const Runtime &R, const std::vector<double> &before, PetscBool *changed)
{
  PetscMPIInt other = before != ParametersNow(R.scene);
  PetscFunctionBegin;
  if (R.size > 1) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &other, 1, MPI_INT, MPI_MAX, R.scene.comm));
  *changed = other ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(0);
}

/* Rows of the constraints at the present state, then a little later, from which their rates follow. Others are zero. */
PetscErrorCode RowsOfConstraints(Runtime &R, TS ts, const std::vector<double> &parameters, std::vector<double> *rows)
{
  PetscReal            t;
  Vec                  U, V, F, part;
  const double        *x;
  PetscInt             n;
  const WithParameters then(R.scene, parameters);
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(VecDuplicate(U, &F));
  for (double later : {0., time_difference * std::max(1., std::abs(t))}) {
    PetscCall(Residual(R, t + later, U, V, V, F));
    for (TSHHT3Role role : {TSHHT3_HOLONOMIC, TSHHT3_NONHOLONOMIC}) {
      PetscCall(VecGetSubVector(F, R.roles[role], &part));
      PetscCall(VecGetLocalSize(part, &n));
      PetscCall(VecGetArrayRead(part, &x));
      rows->insert(rows->end(), x, x + n);
      PetscCall(VecRestoreArrayRead(part, &x));
      PetscCall(VecRestoreSubVector(F, R.roles[role], &part));
    }
  }
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(0);
}

/* Whether parameters have changed what constraints prescribe, and the run goes on from the nearest state that they allow: velocities in any start but with `off`, positions with `project` */
PetscErrorCode StartWillProject(Runtime &R, TS ts, PetscBool *project)
{
  TSHHT3Start         start;
  std::vector<double> before, now;
  PetscErrorCode (*get)(TS, TSHHT3Start *);
  PetscFunctionBegin;
  *project = PETSC_FALSE;
  PetscCall(PetscObjectQueryFunction((PetscObject)ts, "TSHHT3GetStart_C", &get));
  PetscCall(get(ts, &start));
  if (start == TSHHT3_START_OFF) PetscFunctionReturn(0);
  PetscCall(RowsOfConstraints(R, ts, R.step_parameters, &before));
  PetscCall(RowsOfConstraints(R, ts, {}, &now));
  PetscInt positions;
  PetscCall(ISGetLocalSize(R.roles[TSHHT3_HOLONOMIC], &positions));
  const bool moved    = !std::equal(now.begin(), now.begin() + positions, before.begin());
  PetscMPIInt found[2] = {moved, now != before};
  if (R.size > 1) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, found, 2, MPI_INT, MPI_MAX, R.scene.comm));
  *project = found[1] && (!found[0] || start == TSHHT3_START_PROJECT) ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(0);
}

PetscErrorCode PresentState(TS ts, Vec state[3], PetscBool *done, TS *copy)
{
  Runtime  &R = *RunOf(ts);
  PetscReal t;
  PetscBool changed, project = PETSC_FALSE;
  PetscErrorCode (*evaluate)(TS, PetscBool, Vec, Vec, Vec, PetscBool *);
  PetscFunctionBegin;
  PetscCall(ParametersChanged(R, R.step_parameters, &changed));
  if (changed && !R.step_parameters.empty()) PetscCall(StartWillProject(R, ts, &project));
  if (project) {
    PetscCall(TSGetTime(ts, &t));
    PetscCall(BeginCopy(ts, TSHHT3_START_PROJECT, copy));
    PetscCall(TSHHT3EvaluateAt(*copy, t, state[0], state[1], state[2]));
    *done = PETSC_TRUE;
    PetscFunctionReturn(0);
  }
  PetscCall(PetscObjectQueryFunction((PetscObject)ts, "TSHHT3EvaluatePresent_C", &evaluate));
  PetscCall(evaluate(ts, changed, state[0], state[1], state[2], done));
  PetscFunctionReturn(0);
}

/* For TS types other than TSHHT3, which provide neither accelerations nor states between steps */
PetscErrorCode StateOfOtherType(TS ts, PetscReal t, Vec state[3])
{
  PetscReal now;
  TSType    type;
  Vec       U, V;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &now));
  PetscCall(TSGetType(ts, &type));
  PetscCheck(t == now, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "Time %g: TS type %s gives the state at the end of its last step alone, which is t = %g; hhtdae at any time of the step", (double)t, type, (double)now);
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(VecCopy(U, state[0]));
  PetscCall(VecCopy(V, state[1]));
  PetscCall(VecSet(state[2], std::numeric_limits<double>::quiet_NaN()));
  PetscFunctionReturn(0);
}

} // namespace

/* Formulas that read a parameter jump with it, and so may forces and motions: the steps before say nothing of those after it */
PetscErrorCode RestartAfterChange(Runtime &R, TS ts)
{
  PetscInt  steps;
  PetscBool changed;
  PetscErrorCode (*note)(TS);
  PetscFunctionBegin;
  PetscCall(TSGetStepNumber(ts, &steps));
  if (!steps || R.start_parameters.empty()) PetscFunctionReturn(0);
  PetscCall(ParametersChanged(R, R.start_parameters, &changed));
  if (!changed) PetscFunctionReturn(0);
  PetscCall(PetscInfo(ts, "scene: parameters have been changed since the end of the last solve(): restart\n"));
  PetscCall(TSRestartStep(ts));
  PetscCall(PetscObjectQueryFunction((PetscObject)ts, "TSHHT3NoteChange_C", &note));
  if (note) PetscCall(note(ts));
  R.start_parameters = ParametersNow(R.scene);
  PetscFunctionReturn(0);
}

PetscErrorCode StateAt(TS ts, PetscReal t, bool from_equations, Vec state[3], TS *copy)
{
  PetscInt  steps;
  PetscReal now;
  PetscBool ours, done = PETSC_FALSE;
  PetscFunctionBegin;
  *copy = nullptr;
  PetscCall(TSGetStepNumber(ts, &steps));
  PetscCall(TSGetTime(ts, &now));
  PetscCall(PetscObjectTypeCompare((PetscObject)ts, TSHHT3, &ours));
  if (!ours) {
    PetscCall(StateOfOtherType(ts, t, state));
    PetscFunctionReturn(0);
  }
  if (!steps) {
    PetscCall(StateOfStart(ts, t, state, copy));
    PetscFunctionReturn(0);
  }
  if (t == now) PetscCall(PresentState(ts, state, &done, copy));
  std::vector<double> parameters;
  PetscCall(ParametersAt(*RunOf(ts), ts, t, &parameters));
  const WithParameters then(RunOf(ts)->scene, parameters);
  if (!done) PetscCall((from_equations ? TSHHT3EvaluateAt : TSHHT3Interpolate)(ts, t, state[0], state[1], state[2]));
  PetscFunctionReturn(0);
}

namespace
{

PetscErrorCode ProjectByCopy(TS ts, Runtime &R, Vec A, TS *copy)
{
  PetscReal t;
  Vec       U, V;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(BeginCopy(ts, TSHHT3_START_PROJECT, copy));
  PetscCall(TSHHT3EvaluateAt(*copy, t, U, V, A));
  PetscCall(VecCopy(RunOf(*copy)->axes, R.axes));
  PetscCall(UseAxes(R));
  PetscCall(KeepStart(ts, A));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode ToNearestConsistent(TS ts)
{
  Runtime &R    = *RunOf(ts);
  TS       copy = nullptr;
  Vec      U, A;
  PetscFunctionBegin;
  PetscCall(TSGetSolution(ts, &U));
  PetscCall(VecDuplicate(U, &A));
  /* checked only after A and copy are destroyed, since ProjectByCopy() reports violated dropped rows as an error */
  const PetscErrorCode failed = ProjectByCopy(ts, R, A, &copy);
  PetscCall(VecDestroy(&A));
  PetscCall(TSDestroy(&copy));
  PetscCall(failed);
  PetscFunctionReturn(0);
}

/* Whether motions move bodies at t: constraints at velocity level are violated at rest, or holonomic constraints change within a short time */
static PetscErrorCode HasMovingMotions(Runtime &R, double t, Vec U, Vec V, PetscBool *moving)
{
  Vec          now, later, rows;
  double       largest;
  PetscFunctionBegin;
  *moving = PETSC_FALSE;
  PetscCall(VecDuplicate(U, &now));
  PetscCall(VecDuplicate(U, &later));
  PetscCall(Residual(R, t, U, V, V, now));
  PetscCall(Residual(R, t + time_difference * std::max(1., std::abs(t)), U, V, V, later));
  PetscCall(VecAXPY(later, -1, now));
  for (const auto &[role, F] : {std::pair(TSHHT3_HOLONOMIC, later), std::pair(TSHHT3_NONHOLONOMIC, now)}) {
    PetscCall(VecGetSubVector(F, R.roles[role], &rows));
    PetscCall(VecNorm(rows, NORM_INFINITY, &largest));
    PetscCall(VecRestoreSubVector(F, R.roles[role], &rows));
    if (largest > 0) *moving = PETSC_TRUE;
  }
  PetscCall(VecDestroy(&now));
  PetscCall(VecDestroy(&later));
  PetscFunctionReturn(0);
}

PetscErrorCode StartWithMotions(TS ts)
{
  Runtime     &R = *RunOf(ts);
  PetscReal    t;
  Vec          U, V;
  const char  *prefix;
  PetscBool    moving, chosen;
  PetscOptions options;
  PetscFunctionBegin;
  PetscCall(TSGetOptionsPrefix(ts, &prefix));
  PetscCall(PetscObjectGetOptions((PetscObject)ts, &options));
  PetscCall(PetscOptionsHasName(options, prefix, "-ts_hhtdae_start", &chosen));
  if (chosen) PetscFunctionReturn(0);
  if (R.scene.start.assembly == Assembly::Off) PetscFunctionReturn(0);
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(HasMovingMotions(R, t, U, V, &moving));
  if (moving) PetscCall(TSHHT3SetStart(ts, TSHHT3_START_PROJECT));
  PetscFunctionReturn(0);
}

PetscErrorCode Scene::createTS(TS *ts, TS from)
{
  Runtime  *old;
  PetscReal t, atol, rtol;
  Vec       U, V;
  PetscFunctionBegin;
  PetscCall(FindRun(*this, from, "Scene::createTS()", &old));
  PetscCall(ReadCheckpoint(from));
  PetscCall(TSGetTime(from, &t));
  PetscCall(TSGetTolerances(from, &atol, nullptr, &rtol, nullptr));
  PetscCall(TS2GetSolution(from, &U, &V));
  bool anew = !journal_->parameters.empty();
  if (!anew) {
    PetscCall(setUp());
    anew = model_ != old->model; /* true if setUp() has described the scene anew because of another StartPolicy */
  }
  if (anew) {
    journal_->stale = true;
    PetscCall(Guarded([&] {
      describeAnew();
      return PetscErrorCode(0);
    }));
    Model &M = *model_;
    PetscCheck(SameUnknowns(old->scene, M.scene), old->scene.comm, PETSC_ERR_ARG_WRONG,
               "Scene::createTS(): the run cannot go on, since bodies, variables or states of the scene differ from those of the run");
    M.continues    = true;
    M.begin        = t;
    M.first_begin         = old->model->continues ? old->model->first_begin : old->scene.start.time;
    M.number.owner = old->number.owner;
    /* ten times the error that the corrector of the old run allows (Continue.ChainOfRuns) */
    M.inherited_misfit    = 1e-2 * (atol + rtol) / std::max(MechanismSize(M.scene, DescribeAll(M.scene, t, FixedBodies::None)), 1e-2 * (atol + rtol));
    PetscErrorCode failed = CopyElementMemories(*old, M.scene);
    if (!failed) failed = WriteState(M, *old, U, V);
    if (!failed) ContinueElements(old->scene, M.scene);
    if (!failed) failed = createTS(ts);
    journal_->stale = true; /* this model belongs to this run only; the next run from the start needs a new description */
    PetscCall(failed);
    PetscCall(CopyFunctionMemories(*old, *RunOf(*ts)));
    Vec X, Y;
    PetscCall(TS2GetSolution(*ts, &X, &Y));
    PetscCall(CarryAngles(*old, U, V, *RunOf(*ts), X, Y));
    /* The old run satisfies constraints only to its tolerance, and new joints between moving bodies are an impact (Continue.ImpactOfALinkWithoutMass) */
    if (M.scene.started.misfit > 0 || M.scene.started.velocity_misfit > 0) PetscCall(ToNearestConsistent(*ts));
    PetscFunctionReturn(0);
  }
  PetscCall(createTS(ts));
  PetscCall(CopyState(*old, from, *RunOf(*ts), *ts));
  PetscCall(TSSetTime(*ts, t));
  /* Velocities at the end of a step satisfy the constraints to second order; initial ones must be consistent (Continue.ChainOfRuns) */
  PetscInt steps, rows[2];
  PetscCall(TSGetStepNumber(from, &steps));
  PetscCall(ISGetSize(RunOf(*ts)->roles[TSHHT3_HOLONOMIC], &rows[0]));
  PetscCall(ISGetSize(RunOf(*ts)->roles[TSHHT3_NONHOLONOMIC], &rows[1]));
  if (steps && rows[0] + rows[1] && data().start.assembly != Assembly::Off) PetscCall(ToNearestConsistent(*ts));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
