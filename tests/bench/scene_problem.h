/*
  A scene as a problem of the comparison, so that every integrator of workprecision_*.h runs on it:

    std::unique_ptr<SceneProblem> p;
    PetscCall(SceneProblem::make("pendulum", [](MPI_Comm comm) { ... return scene; }, 2., &p));
    IDASolver ida(SceneCase(*p), *p, reference, settings);

  The problem is serial. Residual and Jacobian are those of the scene's TS, evaluated on the caller's arrays. The
  consistent start, which reference(t0) returns, is the one that hhtdae computes, read at the beginning of its first step.

  A scene counts full turns of angles from accepted step to accepted step. Other integrators do not report their accepted
  steps: here the last state before the time advances counts as accepted. initial() restores the counts of the start.

  Other integrators also support neither local rotation vectors nor the change of axes of a body whose Euler angles come
  near their singularity. The problem therefore has Euler angles about fixed axes: fitAxes() chooses the axes of all bodies
  so that they stay away from the singularity for the whole run, and checkAxes() refuses scenes for which there are no such
  axes. hhtdae uses its own coordinates, and toStart() converts its results to these angles.
*/
#ifndef HHTDAE_BENCH_SCENE_PROBLEM_H
#define HHTDAE_BENCH_SCENE_PROBLEM_H

#include "problem.h"
#include "scene/kernels/motion.h"
#include "scene/output/channels.h"
#include "scene/runtime.h"
#include "scene_axes.h"
#include "../euler_run.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

namespace hhtbench
{

class SceneProblem : public hhtex::Problem
{
public:
  /* Makes a scene on this communicator that has not been set up; the scene may be a member of another object */
  using Build = std::function<std::shared_ptr<hhtdae::Scene>(MPI_Comm)>;

  static PetscErrorCode make(const std::string &name, const Build &build, double end, std::unique_ptr<SceneProblem> *p)
  {
    PetscFunctionBegin;
    p->reset(new SceneProblem);
    (*p)->name = name;
    PetscCall((*p)->setUp(build, end));
    PetscFunctionReturn(0);
  }

  ~SceneProblem() override
  {
    PetscBool gone = PETSC_FALSE;
    if (PetscFinalized(&gone) || gone) return;
    for (Vec &x : x_) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&x));
    PetscCallAbort(PETSC_COMM_SELF, TSDestroy(&ts_));
  }

  hhtdae::Scene   &scene() const { return *scene_; }
  hhtdae::Runtime &run() const { return *hhtdae::RunOf(ts_); } /* the run whose residual and Jacobian are evaluated */

  /* A TS of the scene at its start, as a user gets it; type TSHHT3 with default settings */
  PetscErrorCode createTS(TS *ts) const
  {
    Vec U, V;

    PetscFunctionBegin;
    PetscCall(scene_->createTS(ts));
    hhtdae::Runtime &R = *hhtdae::RunOf(*ts);
    latest_            = &R;
    if (!R.bodies.local && !axes_.empty()) PetscCall(useAxes(R));
    PetscCall(TS2GetSolution(*ts, &U, &V));
    PetscCall(hhtdae::InitialState(R, U, V));
    PetscCall(TSSetMaxTime(*ts, t1));
    PetscCall(TSSetMaxSteps(*ts, 100000000));
    PetscFunctionReturn(0);
  }
  /* The same with Euler angles, about the problem's axes if `problems`, otherwise about axes that the scene chooses.
     For callers that evaluate the problem's residual or integrate with another type */
  PetscErrorCode createEulerTS(TS *ts, bool problems = true) const
  {
    Vec U, V;

    PetscFunctionBegin;
    PetscCall(createTS(ts));
    if (!latest_->bodies.local) PetscFunctionReturn(0);
    PetscCall(hhtest::UseEulerAngles(*latest_));
    PetscCall(hhtdae::AttachReframing(*latest_, *ts));
    if (problems && !axes_.empty()) PetscCall(useAxes(*latest_));
    PetscCall(TS2GetSolution(*ts, &U, &V));
    PetscCall(hhtdae::InitialState(*latest_, U, V));
    PetscFunctionReturn(0);
  }

  /* Runs hhtdae once. If a body changes the axes of its Euler angles during the run, bodies get other axes for the
     start: those that their attitudes in this run leave farthest from the singularity. nearest: the smallest |sin
     theta| with these axes. To be called before references are added */
  PetscErrorCode fitAxes(double *nearest, double eps = 1e-5)
  {
    std::vector<Attitudes> path;
    PetscInt               changes;

    PetscFunctionBegin;
    *nearest = 1.;
    PetscCall(runOnce(eps, path, &changes));
    if (!changes) PetscFunctionReturn(0);
    for (size_t b = 0; b < path.size(); b++)
      if (!path[b].empty()) *nearest = std::min(*nearest, ChooseAxes(path[b], &axes_[4 * b]));
    PetscCall(findStart());
    PetscFunctionReturn(0);
  }

  /* The same, and an error if a body comes too near to the singularity with any axes */
  PetscErrorCode checkAxes(double eps = 1e-5)
  {
    double nearest;

    PetscFunctionBegin;
    PetscCall(fitAxes(&nearest, eps));
    PetscCheck(nearest > singular(), PETSC_COMM_SELF, PETSC_ERR_SUP,
               "Scene %s: between t = %g and %g a body turns so that any axes for its Euler angles come near the "
               "singularity (|sin theta| "
               "= %.3g); hhtdae changes axes on the way, which no other integrator can follow; compare the scene over "
               "a shorter time",
               name.c_str(), t0, t1, nearest);
    PetscFunctionReturn(0);
  }
  static constexpr double singular() { return 0.1; }

  /* Converts hhtdae's coordinates and velocities in the run of the latest TS to angles about the axes of the start;
     full turns are chosen nearest to `near` */
  void toStart(double *u, double *v, const double *near) const
  {
    hhtdae::Bodies &B = latest_->bodies;
    B.move(u, v);
    for (PetscInt b = 0; b < B.own; b++) {
      const hhtdae::LocalBody &k = B.body[b];
      if (!hhtdae::TurnsInSpace(k.kind)) continue;
      const hhtdae::Matrix3 C = axes(b);
      if (B.local || (C - k.C).cwiseAbs().maxCoeff() > 1e-14) ToAxes(B.now[b], C, u + k.first + 3, v + k.first + 3);
      for (PetscInt i = k.first + 3; i < k.first + 6; i++)
        if (std::isfinite(near[i])) u[i] += 2. * PETSC_PI * std::round((near[i] - u[i]) / (2. * PETSC_PI));
    }
  }

  /* The scene's channels in a state; accelerations and reactions are right if a and the multipliers in u are. With
     channels of angles, which count full turns, states must come in the order of time */
  PetscErrorCode channels(double t, const double *u, const double *v, const double *a,
                          std::vector<double> &values) const
  {
    hhtdae::Runtime &R = run();

    PetscFunctionBegin;
    values.clear();
    accept(u, v);
    PetscCall(hhtdae::ChannelValues(R, hhtdae::Evaluation{t, u, v, a, R.bodies, R.n}, values));
    PetscFunctionReturn(0);
  }

  /* Tells the elements with memory of an accepted step, for integrators that know their accepted steps */
  void accept(const double *u, const double *v) const
  {
    hhtdae::Runtime &R = run();
    R.bodies.move(u, v);
    if (!R.has_memory) return;
    for (auto &b : R.batches) b->accept(R.bodies);
  }

  /* Adds d Phi/dt of the holonomic rows to f. It is exact and does not depend on the positions, because time enters
     only through motions */
  void phiT(double t, double *f) const
  {
    for (const auto &m : motions_) f[m.first] += (*m.second)(t).f1;
  }
  bool hasMotions() const { return !motions_.empty(); }

  /* ---- Problem ---- */

  void initial(double *u, double *v) const override
  {
    PetscCallAbort(PETSC_COMM_SELF, rewind());
    std::copy(u0_.begin(), u0_.end(), u);
    std::copy(v0_.begin(), v0_.end(), v);
  }

  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    const bool remembers = run().has_memory;
    if (remembers && t > last_.t && !last_.u.empty()) accept(last_.u.data(), last_.v.data());
    if (evaluate(t, u, v, a, f)) std::fill_n(f, n, std::nan("")); /* PETSc has printed the error message */
    if (!remembers || !std::all_of(u, u + n, [](double x) { return std::isfinite(x); })) return;
    last_.t = t;
    last_.u.assign(u, u + n);
    last_.v.assign(v, v + n);
  }

  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa,
                hhtex::Entries &J) const override
  {
    PetscCallAbort(PETSC_COMM_SELF, evaluate(t, u, v, a, sv, sa, J));
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    for (const State &s : states_) {
      if (std::abs(s.t - t) > 1e-12 * (t1 - t0)) continue;
      std::copy(s.u.begin(), s.u.end(), u);
      std::copy(s.v.begin(), s.v.end(), v);
      std::copy(s.a.begin(), s.a.end(), a);
      return true;
    }
    return false;
  }
  std::vector<double> referenceTimes() const override
  {
    std::vector<double> times;
    for (const State &s : states_) times.push_back(s.t);
    return times;
  }

  /* Adds a state to the reference, in the order of time, after the start. Multipliers, variables, force states and
     accelerations are computed again: they follow from the other unknowns, which integrators know more accurately */
  PetscErrorCode addReference(double t, const double *u, const double *v, const double *a)
  {
    State     s;
    PetscBool found;

    PetscFunctionBegin;
    s.t = t;
    s.u.assign(u, u + n);
    s.v.assign(v, v + n);
    s.a.assign(a, a + n);
    accept(u, v);
    PetscCall(consistent(s, &found));
    states_.push_back(s);
    PetscFunctionReturn(0);
  }

private:
  struct State {
    double              t = 0;
    std::vector<double> u, v, a;
  };
  std::shared_ptr<hhtdae::Scene> scene_;
  TS                             ts_              = nullptr; /* holds residual and Jacobian */
  Vec                            x_[4]            = {};      /* U, U', U'', F, whose arrays are those of the caller */
  Mat                            J_               = nullptr; /* of ts_ */
  TSI2Function                   function_        = nullptr;
  TSI2Jacobian                   jacobian_        = nullptr;
  void                          *functionContext_ = nullptr, *jacobianContext_ = nullptr;
  std::vector<PetscInt>          row_, col_;
  std::vector<double>            u0_, v0_, axes_; /* the start, its axes and memories */
  std::vector<State>             states_;
  mutable State                  last_;                                    /* the last state evaluated */
  mutable hhtdae::Runtime       *latest_          = nullptr;               /* of the TS made last */
  std::vector<std::pair<PetscInt, const hhtdae::TimeFunction *>> motions_; /* rows and their functions of time */

  SceneProblem() = default;

  /* Runs hhtdae from start to end and records the attitudes of all bodies with Euler angles */
  PetscErrorCode runOnce(double eps, std::vector<Attitudes> &path, PetscInt *changes) const
  {
    TSHHT3Statistics  s;
    TSConvergedReason reason;
    TS                ts;

    PetscFunctionBegin;
    PetscCall(createEulerTS(&ts));
    AttitudeWatch watch = {*hhtdae::RunOf(ts), path};
    path.assign(watch.R.bodies.own, {});
    PetscCall(TSSetTolerances(ts, eps, nullptr, eps, nullptr));
    PetscCall(TSSetErrorIfStepFails(ts, PETSC_FALSE));
    PetscCall(TSMonitorSet(ts, WatchAttitudes, &watch, nullptr));
    PetscCall(TSSolve(ts, nullptr));
    PetscCall(TSGetConvergedReason(ts, &reason));
    PetscCheck(reason > 0, PETSC_COMM_SELF, PETSC_ERR_NOT_CONVERGED,
               "Scene %s: hhtdae does not reach the end at tolerance %g (%s)", name.c_str(), eps,
               TSConvergedReasons[reason]);
    PetscCall(TSHHT3GetStatistics(ts, &s));
    *changes = s.changes;
    PetscCall(TSDestroy(&ts));
    PetscFunctionReturn(0);
  }

  /* axes at the start, as the scene uses them */
  hhtdae::Matrix3 axes(PetscInt b) const
  {
    const double *x = &axes_[4 * b];
    return Eigen::Quaterniond(x[0], x[1], x[2], x[3]).normalized().toRotationMatrix();
  }

  static PetscErrorCode copy(Vec x, std::vector<double> &to)
  {
    const double *array;
    PetscInt      n;

    PetscFunctionBegin;
    PetscCall(VecGetLocalSize(x, &n));
    PetscCall(VecGetArrayRead(x, &array));
    to.assign(array, array + n);
    PetscCall(VecRestoreArrayRead(x, &array));
    PetscFunctionReturn(0);
  }

  PetscErrorCode setUp(const Build &build, double end)
  {
    Vec U, F;

    PetscFunctionBegin;
    scene_ = build(PETSC_COMM_SELF);
    PetscCheck(scene_ && DataOf(*scene_).comm == PETSC_COMM_SELF, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
               "Scene %s: build it on the communicator that is passed, which is PETSC_COMM_SELF", name.c_str());
    t1 = end;
    PetscCall(createEulerTS(&ts_));
    PetscCall(TSGetTime(ts_, &t0));
    PetscCall(TSGetSolution(ts_, &U));
    PetscCall(VecGetSize(U, &n));
    PetscCall(copy(run().axes, axes_));
    PetscCall(TSGetI2Function(ts_, &F, &function_, &functionContext_));
    PetscCall(TSGetI2Jacobian(ts_, &J_, nullptr, &jacobian_, &jacobianContext_));
    for (Vec &x : x_) PetscCall(VecCreateSeqWithArray(PETSC_COMM_SELF, 1, n, nullptr, &x));
    PetscCall(findRoles());
    PetscCall(findPattern());
    findMotions<hhtdae::DrivenAngle>();
    findMotions<hhtdae::DrivenAdvance>();
    PetscCall(findStart());
    PetscFunctionReturn(0);
  }

  PetscErrorCode findRoles()
  {
    PetscFunctionBegin;
    PetscCall(TSSetUp(ts_));
    role.assign(n, TSHHT3_NUM_ROLES);
    for (int r = 0; r < TSHHT3_NUM_ROLES; r++) {
      IS              is;
      const PetscInt *index;
      PetscInt        count;
      PetscCall(TSHHT3GetIS(ts_, (TSHHT3Role)r, &is));
      PetscCall(ISGetLocalSize(is, &count));
      PetscCall(ISGetIndices(is, &index));
      for (PetscInt k = 0; k < count; k++) role[index[k]] = (TSHHT3Role)r;
      PetscCall(ISRestoreIndices(is, &index));
    }
    for (PetscInt i = 0; i < n; i++)
      PetscCheck(role[i] != TSHHT3_NUM_ROLES, PETSC_COMM_SELF, PETSC_ERR_PLIB, "Scene %s: unknown %d has no role",
                 name.c_str(), (int)i);
    PetscFunctionReturn(0);
  }

  PetscErrorCode findPattern()
  {
    const PetscInt *i, *j;
    PetscInt        rows;
    PetscBool       done;

    PetscFunctionBegin;
    PetscCall(MatGetRowIJ(J_, 0, PETSC_FALSE, PETSC_FALSE, &rows, &i, &j, &done));
    PetscCheck(done, PETSC_COMM_SELF, PETSC_ERR_SUP, "Scene %s: its matrix gives no rows", name.c_str());
    for (PetscInt r = 0; r < rows; r++)
      for (PetscInt k = i[r]; k < i[r + 1]; k++) {
        row_.push_back(r);
        col_.push_back(j[k]);
      }
    PetscCall(MatRestoreRowIJ(J_, 0, PETSC_FALSE, PETSC_FALSE, &rows, &i, &j, &done));
    PetscFunctionReturn(0);
  }

  /* Finds the rows that are f(t) minus an angle or a displacement */
  template <class K> void findMotions()
  {
    for (const auto &b : run().batches)
      if (const auto *batch = dynamic_cast<const hhtdae::ConstraintBatch<K> *>(b.get()))
        for (const auto &e : batch->all)
          if (e.active & 1) motions_.emplace_back(e.lambda, &e.data.function);
  }

  PetscErrorCode findStart()
  {
    State     s;
    TS        ts;
    Vec       U, V;
    PetscBool found;

    PetscFunctionBegin;
    states_.clear();
    PetscCall(createEulerTS(&ts));
    PetscCall(TS2GetSolution(ts, &U, &V));
    PetscCall(copy(U, u0_));
    PetscCall(copy(V, v0_));
    PetscCall(TSDestroy(&ts));
    s.t = t0;
    s.u = u0_;
    s.v = v0_;
    s.a.assign(n, 0.);
    PetscCall(consistent(s, &found));
    PetscCheck(found, PETSC_COMM_SELF, PETSC_ERR_NOT_CONVERGED,
               "Scene %s: hhtdae makes no first step; run it by itself with -info to see why", name.c_str());
    PetscCall(rewind());
    states_.push_back(s);
    PetscFunctionReturn(0);
  }

  static PetscErrorCode paste(const std::vector<double> &from, Vec x)
  {
    double *array;

    PetscFunctionBegin;
    PetscCall(VecGetArrayWrite(x, &array));
    std::copy(from.begin(), from.end(), array);
    PetscCall(VecRestoreArrayWrite(x, &array));
    PetscFunctionReturn(0);
  }

  /* Computes accelerations, multipliers, variables and force states that are consistent with q, q' and the states of
     s, like hhtdae's start: taken from the beginning of one step. If they are not found s is not changed */
  PetscErrorCode consistent(State &s, PetscBool *found) const
  {
    TS                ts;
    Vec               U, V, W[3];
    TSConvergedReason reason;

    PetscFunctionBegin;
    PetscCall(createEulerTS(&ts));
    PetscCall(remember(*hhtdae::RunOf(ts)));
    PetscCall(TSHHT3SetCoordinateChange(ts, nullptr, nullptr, nullptr, nullptr));
    PetscCall(TSHHT3SetStart(ts, TSHHT3_START_OFF));
    PetscCall(TS2GetSolution(ts, &U, &V));
    PetscCall(paste(s.u, U));
    PetscCall(paste(s.v, V));
    PetscCall(TSSetTime(ts, s.t));
    PetscCall(TSSetMaxTime(ts, s.t + t1 - t0));
    PetscCall(TSSetMaxSteps(ts, 1));
    PetscCall(TSSetTolerances(ts, 1e-8, nullptr, 1e-8, nullptr));
    PetscCall(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_STEPOVER));
    PetscCall(TSSetErrorIfStepFails(ts, PETSC_FALSE));
    PetscCall(TSSolve(ts, nullptr));
    PetscCall(TSGetConvergedReason(ts, &reason));
    *found = reason > 0 ? PETSC_TRUE : PETSC_FALSE;
    if (*found) {
      for (Vec &w : W) PetscCall(VecCreateSeq(PETSC_COMM_SELF, n, &w));
      PetscCall(TSHHT3Interpolate(ts, s.t, W[0], W[1], W[2]));
      PetscCall(copy(W[0], s.u));
      PetscCall(copy(W[1], s.v));
      PetscCall(copy(W[2], s.a));
      for (Vec &w : W) PetscCall(VecDestroy(&w));
    }
    PetscCall(TSDestroy(&ts));
    PetscFunctionReturn(0);
  }

  /* Sets axes and memories of the start in a run */
  PetscErrorCode useAxes(hhtdae::Runtime &R) const
  {
    PetscFunctionBegin;
    PetscCall(paste(axes_, R.axes));
    PetscCall(hhtdae::UseAxes(R));
    PetscFunctionReturn(0);
  }
  PetscErrorCode rewind() const
  {
    PetscFunctionBegin;
    last_.u.clear();
    PetscCall(useAxes(run()));
    PetscFunctionReturn(0);
  }
  /* Copies what the elements remember at present to another run */
  PetscErrorCode remember(hhtdae::Runtime &R) const
  {
    PetscFunctionBegin;
    for (std::size_t k = 0; k < R.batches.size(); k++) {
      std::vector<double> memory(R.batches[k]->memory());
      run().batches[k]->copyMemory(memory.data(), false);
      R.batches[k]->copyMemory(memory.data(), true);
    }
    PetscFunctionReturn(0);
  }

  PetscErrorCode place(const double *u, const double *v, const double *a) const
  {
    PetscFunctionBegin; /* PETSc's arrays are not const, but these are not written to */
    PetscCall(VecPlaceArray(x_[0], u));
    PetscCall(VecPlaceArray(x_[1], v));
    PetscCall(VecPlaceArray(x_[2], a));
    PetscFunctionReturn(0);
  }
  PetscErrorCode take() const
  {
    PetscFunctionBegin;
    for (int k = 0; k < 3; k++) PetscCall(VecResetArray(x_[k]));
    PetscFunctionReturn(0);
  }

  PetscErrorCode evaluate(double t, const double *u, const double *v, const double *a, double *f) const
  {
    PetscFunctionBegin;
    PetscCall(place(u, v, a));
    PetscCall(VecPlaceArray(x_[3], f));
    const PetscErrorCode failed = function_(ts_, t, x_[0], x_[1], x_[2], x_[3], functionContext_);
    PetscCall(VecResetArray(x_[3]));
    PetscCall(take());
    PetscCall(failed);
    PetscFunctionReturn(0);
  }

  PetscErrorCode evaluate(double t, const double *u, const double *v, const double *a, double sv, double sa,
                          hhtex::Entries &J) const
  {
    const double *value;

    PetscFunctionBegin;
    PetscCall(place(u, v, a));
    const PetscErrorCode failed = jacobian_(ts_, t, x_[0], x_[1], x_[2], sv, sa, J_, J_, jacobianContext_);
    PetscCall(take());
    PetscCall(failed);
    PetscCall(MatSeqAIJGetArrayRead(J_, &value));
    J.row.insert(J.row.end(), row_.begin(), row_.end());
    J.col.insert(J.col.end(), col_.begin(), col_.end());
    J.value.insert(J.value.end(), value, value + row_.size());
    PetscCall(MatSeqAIJRestoreArrayRead(J_, &value));
    PetscFunctionReturn(0);
  }
};

} // namespace hhtbench

#endif
