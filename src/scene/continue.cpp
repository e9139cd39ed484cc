/* A run that goes on where another one is, with a description that may have changed. */
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

/* Whether what was described anew has the coordinates, variables and states of before */
bool SameUnknowns(const SceneData &a, const SceneData &b)
{
  bool same = a.bodies.size() == b.bodies.size() && a.variables.size() == b.variables.size() && a.states.size() == b.states.size() &&
              a.extensions.size() == b.extensions.size();
  for (std::size_t k = 0; same && k < a.bodies.size(); k++) same = CoordinatesOf(a, a.bodies[k]) == CoordinatesOf(b, b.bodies[k]);
  for (std::size_t k = 0; same && k < a.extensions.size(); k++) same = a.extensions[k]->coordinates() == b.extensions[k]->coordinates();
  return same;
}

/* Of variables, states, channels and users' functions; what joints and forces remember is in their description, CarryTurns() */
std::vector<Batch *> FunctionsThatRemember(const Runtime &R)
{
  std::vector<Batch *> all;
  for (const auto &b : R.batches)
    if (b->memory() && !b->isDescribed()) all.push_back(b.get());
  return all;
}

/* Numbers that an element remembers, and angles that its formulas read */
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

PetscErrorCode RefuseToCarry(const SceneData &s, const std::string &what)
{
  SETERRQ(s.comm, PETSC_ERR_SUP,
          "a run cannot go on when elements have come or gone that count angles over full turns or follow a curve, as %s: let joints, motions or forces come and go in their place (of "
          "velocities, to lock a shaft), or change a parameter of an element that stays",
          what.c_str());
}

PetscErrorCode CheckMemories(const SceneData &from, const SceneData &to)
{
  PetscFunctionBegin;
  for (std::size_t e = 0; e < std::max(from.elements.size(), to.elements.size()); e++) {
    const int before = Memory(from, e), after = Memory(to, e);
    if (before == after) continue;
    const ElementData &of = (before ? from : to).elements[e]; /* where it is there */
    PetscCall(RefuseToCarry(to, std::string(of.type) + " " + of.name + " has"));
  }
  PetscFunctionReturn(0);
}

/* Angles over full turns that functions read, which go on from where they are */
PetscErrorCode CarryMemories(const Runtime &from, Runtime &to)
{
  const std::vector<Batch *> a = FunctionsThatRemember(from), b = FunctionsThatRemember(to);
  int                        same = a.size() == b.size();
  PetscFunctionBegin;
  for (std::size_t k = 0; same && k < a.size(); k++) same = a[k]->memory() == b[k]->memory();
  if (to.size > 1) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, to.scene.comm));
  if (!same) PetscCall(RefuseToCarry(to.scene, "some have that channels, variables or formulas read"));
  for (std::size_t k = 0; k < a.size(); k++) {
    std::vector<double> memory(a[k]->memory());
    a[k]->copyMemory(memory.data(), false);
    b[k]->copyMemory(memory.data(), true);
  }
  PetscCall(KeepMemories(to));
  PetscFunctionReturn(0);
}

/* The parts of an element that remember */
std::vector<Part> Remembering(const ElementData &e)
{
  std::vector<Part> all;
  for (const Part &p : e.parts)
    if (p.store->memory()) all.push_back(p);
  return all;
}

/* Angles over full turns and points on curves, which go on from where they are: in the description, by which assembly goes before there is a run */
PetscErrorCode CarryTurns(const Runtime &from, SceneData &to)
{
  std::vector<double>                           x;
  std::vector<int>                              found;
  std::vector<std::pair<StoreBase *, PetscInt>> into;
  PetscFunctionBegin;
  PetscCall(CheckMemories(from.scene, to));
  for (std::size_t e = 0; e < to.elements.size(); e++) {
    if (!Memory(to, e)) continue;
    const std::vector<Part> a = Remembering(from.scene.elements[e]), b = Remembering(to.elements[e]);
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
  /* the ranks that have an element have the same numbers of it */
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

/* The same model: its vectors */
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
  to.asked = from.asked;
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode NotBegun(TS ts, const char *call, Runtime **R)
{
  PetscInt steps;
  PetscFunctionBegin;
  *R = RunOf(ts);
  PetscCheck(*R, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG, "%s: the TS is not one of a scene, Scene::createTS() makes them", call);
  PetscCall(ReadCheckpoint(ts)); /* a run that goes on from one has begun */
  PetscCall(TSGetStepNumber(ts, &steps));
  PetscCheck(!steps, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE,
             "%s: the run has begun and is not to be moved; make one that goes on from it, Scene::createTS(&next, ts)", call);
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
  PetscCall(CheckUnchanged(R->scene, R->scene.start_given)); /* elements that came too late have no unknowns */
  PetscCall(CreateRun(R->model, copy));
  PetscCall(CopyState(*R, ts, *RunOf(*copy), *copy));
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TSGetTolerances(ts, &atol, nullptr, &rtol, nullptr));
  PetscCall(TSSetTolerances(*copy, atol, nullptr, rtol, nullptr));
  PetscCall(TSSetTime(*copy, t));
  PetscCall(TSGetMaxTime(ts, &end)); /* as long as the run is, where it has an end: no unit of time is known otherwise */
  if (end < PETSC_MAX_REAL / 2 && end > R->scene.start.time) PetscCall(TSSetMaxTime(*copy, t + end - R->scene.start.time));
  PetscCall(TSSetMaxSteps(*copy, 1)); /* for PETSc, which wants an end */
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

/* A change is one everywhere: ranks whose values differ would wait for each other */
PetscErrorCode ParametersChanged(const Runtime &R, PetscBool *changed)
{
  PetscMPIInt other = R.step_parameters != ParametersNow(R.scene);
  PetscFunctionBegin;
  if (R.size > 1) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &other, 1, MPI_INT, MPI_MAX, R.scene.comm));
  *changed = other ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(0);
}

PetscErrorCode PresentState(TS ts, Vec state[3], PetscBool *done)
{
  Runtime  &R = *RunOf(ts);
  PetscBool changed;
  PetscErrorCode (*evaluate)(TS, PetscBool, Vec, Vec, Vec, PetscBool *);
  PetscFunctionBegin;
  PetscCall(ParametersChanged(R, &changed));
  PetscCall(PetscObjectQueryFunction((PetscObject)ts, "TSHHT3EvaluatePresent_C", &evaluate));
  PetscCall(evaluate(ts, changed, state[0], state[1], state[2], done));
  PetscFunctionReturn(0);
}

/* Other TS types know neither accelerations nor times between steps */
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
  if (t == now) PetscCall(PresentState(ts, state, &done));
  if (!done) PetscCall((from_equations ? TSHHT3EvaluateAt : TSHHT3Interpolate)(ts, t, state[0], state[1], state[2]));
  PetscFunctionReturn(0);
}

namespace
{

PetscErrorCode CompleteBy(TS ts, Runtime &R, Vec A, TS *copy)
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
  const PetscErrorCode failed = CompleteBy(ts, R, A, &copy); /* dropped rows may be violated there: the two go all the same */
  PetscCall(VecDestroy(&A));
  PetscCall(TSDestroy(&copy));
  PetscCall(failed);
  PetscFunctionReturn(0);
}

/* Rows of constraints that are not met at rest, or not for long: those of motions that do not stand still */
static PetscErrorCode Moving(Runtime &R, double t, Vec U, Vec V, PetscBool *moving)
{
  const double soon = 1e-6 * std::max(1., std::abs(t));
  Vec          now, later, rows;
  double       most;
  PetscFunctionBegin;
  *moving = PETSC_FALSE;
  PetscCall(VecDuplicate(U, &now));
  PetscCall(VecDuplicate(U, &later));
  PetscCall(Residual(R, t, U, V, V, now));
  PetscCall(Residual(R, t + soon, U, V, V, later));
  PetscCall(VecAXPY(later, -1, now));
  for (const auto &[role, F] : {std::pair(TSHHT3_HOLONOMIC, later), std::pair(TSHHT3_NONHOLONOMIC, now)}) {
    PetscCall(VecGetSubVector(F, R.roles[role], &rows));
    PetscCall(VecNorm(rows, NORM_INFINITY, &most));
    PetscCall(VecRestoreSubVector(F, R.roles[role], &rows));
    if (most > 0) *moving = PETSC_TRUE;
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
  PetscCall(Moving(R, t, U, V, &moving));
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
  if (journal_) {
    journal_->stale = true;
    PetscCall(Guarded([&] {
      describeAnew();
      return PetscErrorCode(0);
    }));
    Model &M = *model_;
    PetscCheck(SameUnknowns(old->scene, M.scene), old->scene.comm, PETSC_ERR_ARG_WRONG,
               "Scene::createTS(): the run cannot go on, since bodies, variables or states of the scene are not those that it was made with");
    M.continues    = true;
    M.begin        = t;
    M.first        = old->model->continues ? old->model->first : old->scene.start.time;
    M.number.owner = old->number.owner;
    M.left         = 1e-2 * (atol + rtol) / std::max(MechanismSize(M.scene, DescribeAll(M.scene, t, Hold::None)), 1e-2 * (atol + rtol)); /* ten times what its corrector leaves (Continue.ChainOfRuns) */
    PetscErrorCode failed = CarryTurns(*old, M.scene);
    if (!failed) failed = WriteState(M, *old, U, V);
    if (!failed) failed = createTS(ts);
    journal_->stale = true; /* this model is of this run alone; the next one from the start is described anew */
    PetscCall(failed);
    PetscCall(CarryMemories(*old, *RunOf(*ts)));
    Vec X, Y;
    PetscCall(TS2GetSolution(*ts, &X, &Y));
    PetscCall(CarryAngles(*old, U, V, *RunOf(*ts), X, Y));
    /* A run leaves constraints as nearly met as its tolerance wants, and what takes hold of moving bodies is an impact (Continue.ImpactOfALinkWithoutMass) */
    if (M.scene.started.misfit > 0 || M.scene.started.velocity_misfit > 0) PetscCall(ToNearestConsistent(*ts));
    PetscFunctionReturn(0);
  }
  PetscCall(createTS(ts));
  PetscCall(CopyState(*old, from, *RunOf(*ts), *ts));
  PetscCall(TSSetTime(*ts, t));
  /* Velocities at the end of a step meet constraints to second order, those that a run begins with have to meet them (Continue.ChainOfRuns) */
  PetscInt steps, rows[2];
  PetscCall(TSGetStepNumber(from, &steps));
  PetscCall(ISGetSize(RunOf(*ts)->roles[TSHHT3_HOLONOMIC], &rows[0]));
  PetscCall(ISGetSize(RunOf(*ts)->roles[TSHHT3_NONHOLONOMIC], &rows[1]));
  if (steps && rows[0] + rows[1] && data().start.assembly != Assembly::Off) PetscCall(ToNearestConsistent(*ts));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
