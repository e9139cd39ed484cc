/* PETSc's time steppers: hhtdae, ALPHA2, and BDF on the first-order form. Output between steps is by the interpolation
   of hhtdae and BDF; ALPHA2 has none and gets cubic Hermite polynomials, so that no solver has to end steps at output
   points */
#ifndef WORKPRECISION_TS_H
#define WORKPRECISION_TS_H

#include "workprecision_firstorder.h"

#include <memory>

namespace wp
{

enum class Stepper { HHT, Alpha2, BDF };

struct TSSettings {
  Stepper                           stepper = Stepper::HHT;
  std::function<PetscErrorCode(TS)> configure;                            /* called after TSSetType() */
  FirstOrder::Form                  form  = FirstOrder::Form::Stabilized; /* BDF */
  bool                              euler = false; /* hhtdae on scenes: the scene's Euler angles in place of local rotation vectors */
  bool                              fixed = false; /* ALPHA2: constant steps of about 0.1 eps^0.4 of the run */
};

/* Data of the callbacks of one run */
struct TSRun {
  const Case                 &which;
  const Problem              &problem;
  const TSSettings           &settings;
  const Limits               &limits;
  CountedProblem              counted;
  Recorder                    recorder;
  std::unique_ptr<FirstOrder> system; /* BDF */
  Entries                     entries;
  std::vector<double>         u, v, u0, v0; /* output; values at the beginning of the last step of ALPHA2 */
  double                      t0              = 0.;
  TSI2Function                function        = nullptr; /* of the scene's own TS */
  TSI2Jacobian                jacobian        = nullptr;
  void                       *functionContext = nullptr, *jacobianContext = nullptr;
  TS                          ts = nullptr;
  Vec                         U = nullptr, V = nullptr, W[2] = {nullptr, nullptr};

  TSRun(const Case &c, const Problem &p, const Reference &ref, const TSSettings &s, const Limits &l)
      : which(c), problem(p), settings(s), limits(l), counted(p), recorder(ref), u(p.n), v(p.n), u0(p.n), v0(p.n)
  {
  }
};

inline PetscErrorCode StoreOutput(TSRun &r, Vec U, Vec V)
{
  const double *u, *v = nullptr;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  if (V) PetscCall(VecGetArrayRead(V, &v));
  if (r.system) {
    r.system->output(u, r.u.data(), r.v.data());
    r.recorder.store(r.u.data(), r.v.data());
  } else if (r.which.toStart) {
    std::copy_n(u, r.problem.n, r.u.begin());
    std::copy_n(v, r.problem.n, r.v.begin());
    r.which.toStart(r.problem, r.u.data(), r.v.data(), r.recorder.nextState());
    r.recorder.store(r.u.data(), r.v.data());
  } else
    r.recorder.store(u, v);
  if (V) PetscCall(VecRestoreArrayRead(V, &v));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscFunctionReturn(0);
}

/* Cubic Hermite polynomial for q and its derivative for q', linear for the rest */
inline PetscErrorCode StoreHermite(TSRun &r, double t, double t1, Vec U, Vec V)
{
  const double  h = t1 - r.t0, x = (t - r.t0) / h, z = 1. - x;
  const double *u, *v;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  for (PetscInt i = 0; i < r.problem.n; i++) {
    const double du = (u[i] - r.u0[i]) / h;
    if (r.problem.role[i] == TSHHT3_COORDINATE) {
      r.u[i] = z * r.u0[i] + x * u[i] + x * z * h * (z * (r.v0[i] - du) - x * (v[i] - du));
      r.v[i] = du + (z * z - 2. * x * z) * (r.v0[i] - du) + (x * x - 2. * x * z) * (v[i] - du);
    } else {
      r.u[i] = z * r.u0[i] + x * u[i];
      r.v[i] = du;
    }
  }
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscCall(VecRestoreArrayRead(U, &u));
  r.recorder.store(r.u.data(), r.v.data());
  PetscFunctionReturn(0);
}

inline PetscErrorCode StoreAt(TSRun &r, double tout, double t, Vec U, Vec V)
{
  PetscFunctionBegin;
  if (tout >= t)
    PetscCall(StoreOutput(r, U, V));
  else if (r.settings.stepper == Stepper::Alpha2)
    PetscCall(StoreHermite(r, tout, t, U, V));
  else if (r.settings.stepper == Stepper::HHT) {
    PetscCall(TSHHT3Interpolate(r.ts, tout, r.W[0], r.W[1], nullptr));
    PetscCall(StoreOutput(r, r.W[0], r.W[1]));
  } else {
    PetscCall(TSInterpolate(r.ts, tout, r.W[0]));
    PetscCall(StoreOutput(r, r.W[0], nullptr));
  }
  PetscFunctionReturn(0);
}

inline PetscErrorCode Watch(TS ts, PetscInt, PetscReal t, Vec U, void *ctx)
{
  TSRun       &r     = *static_cast<TSRun *>(ctx);
  const double slack = 1e-12 * (r.problem.t1 - r.problem.t0);
  Vec          V     = nullptr;

  PetscFunctionBegin;
  if (!r.system) PetscCall(TS2GetSolution(ts, &U, &V));
  while (!r.recorder.done() && r.recorder.next() <= t + slack) {
    const double tout = r.recorder.next();
    PetscCall(StoreAt(r, std::abs(t - tout) <= slack ? t : tout, t, U, V));
  }
  if (r.settings.stepper == Stepper::Alpha2) {
    const double *u, *v;
    PetscCall(VecGetArrayRead(U, &u));
    PetscCall(VecGetArrayRead(V, &v));
    if (r.which.accept) r.which.accept(r.problem, u, v);
    std::copy_n(u, r.problem.n, r.u0.begin());
    std::copy_n(v, r.problem.n, r.v0.begin());
    PetscCall(VecRestoreArrayRead(V, &v));
    PetscCall(VecRestoreArrayRead(U, &u));
    r.t0 = t;
  }
  if (r.counted.late) PetscCall(TSSetConvergedReason(ts, TS_CONVERGED_USER));
  PetscFunctionReturn(0);
}

inline PetscErrorCode FirstOrderFunction(TS, PetscReal t, Vec Y, Vec Yp, Vec F, void *ctx)
{
  const double *y, *yp;
  double       *f;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(Y, &y));
  PetscCall(VecGetArrayRead(Yp, &yp));
  PetscCall(VecGetArrayWrite(F, &f));
  static_cast<TSRun *>(ctx)->system->residual(t, y, yp, f);
  PetscCall(VecRestoreArrayWrite(F, &f));
  PetscCall(VecRestoreArrayRead(Yp, &yp));
  PetscCall(VecRestoreArrayRead(Y, &y));
  PetscFunctionReturn(0);
}

inline PetscErrorCode FirstOrderJacobian(TS, PetscReal t, Vec Y, Vec Yp, PetscReal c, Mat, Mat P, void *ctx)
{
  TSRun        &r = *static_cast<TSRun *>(ctx);
  const double *y, *yp;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(Y, &y));
  PetscCall(VecGetArrayRead(Yp, &yp));
  r.system->jacobian(t, y, yp, c, r.entries);
  PetscCall(VecRestoreArrayRead(Yp, &yp));
  PetscCall(VecRestoreArrayRead(Y, &y));
  PetscCall(MatSetValuesCOO(P, r.entries.value.data(), INSERT_VALUES));
  PetscFunctionReturn(0);
}

/* Vectors of tolerances that exclude multipliers and other algebraic unknowns, and velocities in the first-order form,
   from the error test; PETSc has no other way */
inline PetscErrorCode SelectiveTolerances(TSRun &r, double eps)
{
  Vec      tolerance;
  double  *x;
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(r.U, &tolerance));
  PetscCall(VecGetSize(tolerance, &n));
  PetscCall(VecGetArrayWrite(tolerance, &x));
  for (PetscInt i = 0; i < n; i++) {
    const bool tested =
        i < r.problem.n && (r.problem.role[i] == TSHHT3_COORDINATE || r.problem.role[i] == TSHHT3_STATE);
    x[i] = tested ? eps : 1e100;
  }
  PetscCall(VecRestoreArrayWrite(tolerance, &x));
  PetscCall(TSSetTolerances(r.ts, eps, tolerance, eps, nullptr));
  PetscCall(VecDestroy(&tolerance));
  PetscFunctionReturn(0);
}

inline PetscErrorCode CreateFirstOrderTS(TSRun &r)
{
  std::vector<double> y, yp;
  Mat                 J;
  Vec                 F;
  double             *array;

  PetscFunctionBegin;
  r.system.reset(new FirstOrder(r.counted, r.settings.form, r.which.phiT));
  r.system->initial(r.problem, y, yp);
  r.system->jacobian(r.problem.t0, y.data(), yp.data(), 1., r.entries);
  std::vector<PetscInt> row(r.entries.row), col(r.entries.col);
  PetscCall(TSCreate(PETSC_COMM_SELF, &r.ts));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, r.system->size, &r.U));
  PetscCall(VecDuplicate(r.U, &F));
  PetscCall(VecGetArrayWrite(r.U, &array));
  std::copy(y.begin(), y.end(), array);
  PetscCall(VecRestoreArrayWrite(r.U, &array));
  PetscCall(MatCreate(PETSC_COMM_SELF, &J));
  PetscCall(MatSetSizes(J, r.system->size, r.system->size, r.system->size, r.system->size));
  PetscCall(MatSetType(J, MATSEQAIJ));
  PetscCall(MatSetPreallocationCOO(J, (PetscCount)row.size(), row.data(), col.data()));
  PetscCall(TSSetIFunction(r.ts, F, FirstOrderFunction, &r));
  PetscCall(TSSetIJacobian(r.ts, J, J, FirstOrderJacobian, &r));
  PetscCall(TSSetSolution(r.ts, r.U));
  PetscCall(TSSetTime(r.ts, r.problem.t0));
  PetscCall(TSSetMaxTime(r.ts, r.problem.t1));
  PetscCall(TSSetExactFinalTime(r.ts, TS_EXACTFINALTIME_MATCHSTEP));
  PetscCall(VecDestroy(&F));
  PetscCall(MatDestroy(&J));
  PetscFunctionReturn(0);
}

/* ALPHA2 and BDF neither choose their first step nor their linear solver: they get a step small enough for the
   tolerance, a direct solver, and error control */
inline PetscErrorCode ConfigureOther(TSRun &r, double eps)
{
  TSAdapt adapt;
  SNES    snes;
  KSP     ksp;
  PC      pc;

  PetscFunctionBegin;
  /* a last step of another length would leave a transient in the multipliers */
  PetscCall(
      TSSetTimeStep(r.ts, (r.problem.t1 - r.problem.t0) *
                              (r.settings.fixed ? 1. / std::round(10. * std::pow(eps, -.4)) : 1e-3 * std::cbrt(eps))));
  PetscCall(TSGetAdapt(r.ts, &adapt));
  PetscCall(TSAdaptSetType(adapt, r.settings.fixed ? TSADAPTNONE : TSADAPTBASIC));
  PetscCall(SelectiveTolerances(r, eps));
  PetscCall(TSSetMaxSNESFailures(r.ts, 50));
  PetscCall(TSSetMaxStepRejections(r.ts, 100));
  PetscCall(TSGetSNES(r.ts, &snes));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERKLU));
  PetscFunctionReturn(0);
}

/* The scene's own callbacks with counters and the deadline */
inline PetscErrorCode NativeFunction(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *ctx)
{
  TSRun                &r = *static_cast<TSRun *>(ctx);
  const CountedProblem &c = r.counted;

  PetscFunctionBegin;
  if (++c.residuals % 256 == 0 && !c.late) c.late = ProcessorSeconds() > c.deadline;
  if (c.late)
    PetscCall(VecSet(F, std::nan("")));
  else
    PetscCall(r.function(ts, t, U, V, A, F, r.functionContext));
  PetscFunctionReturn(0);
}

inline PetscErrorCode NativeJacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P,
                                     void *ctx)
{
  TSRun &r = *static_cast<TSRun *>(ctx);

  PetscFunctionBegin;
  r.counted.jacobians++;
  PetscCall(r.jacobian(ts, t, U, V, A, sv, sa, J, P, r.jacobianContext));
  PetscFunctionReturn(0);
}

inline PetscErrorCode CreateNativeTS(TSRun &r)
{
  Vec F;
  Mat J, P;

  PetscFunctionBegin;
  PetscCall(r.which.createTS(r.problem, r.settings.stepper != Stepper::HHT ? SceneAngles::Problems : r.settings.euler ? SceneAngles::Own : SceneAngles::None, &r.ts));
  PetscCall(TSGetI2Function(r.ts, &F, &r.function, &r.functionContext));
  PetscCall(TSGetI2Jacobian(r.ts, &J, &P, &r.jacobian, &r.jacobianContext));
  PetscCall(TSSetI2Function(r.ts, F, NativeFunction, &r));
  PetscCall(TSSetI2Jacobian(r.ts, J, P, NativeJacobian, &r));
  PetscCall(TS2GetSolution(r.ts, &r.U, &r.V));
  PetscCall(PetscObjectReference((PetscObject)r.U));
  PetscCall(PetscObjectReference((PetscObject)r.V));
  PetscFunctionReturn(0);
}

inline PetscErrorCode CreateTS(TSRun &r, double eps)
{
  static const TSType type[] = {TSHHT3, TSALPHA2, TSBDF};

  PetscFunctionBegin;
  if (r.settings.stepper == Stepper::BDF)
    PetscCall(CreateFirstOrderTS(r));
  else if (r.which.createTS)
    PetscCall(CreateNativeTS(r));
  else
    PetscCall(hhtex::ProblemCreateTS(PETSC_COMM_SELF, r.counted, &r.ts, &r.U, &r.V));
  /* set before TSSetType(), PETSc's default of 0.1 does not count as set by the user: TSHHT3 chooses the first step */
  if (r.settings.stepper == Stepper::HHT && !r.which.createTS) PetscCall(TSSetTimeStep(r.ts, 0.1));
  PetscCall(TSSetType(r.ts, type[(int)r.settings.stepper]));
  PetscCall(TSSetMaxSteps(r.ts, 100000000));
  if (r.settings.stepper == Stepper::HHT) {
    PetscCall(TSSetTolerances(r.ts, eps, nullptr, eps, nullptr));
  } else
    PetscCall(ConfigureOther(r, eps));
  if (r.settings.configure) PetscCall(r.settings.configure(r.ts));
  PetscCall(TSSetFromOptions(r.ts));
  PetscCall(TSSetErrorIfStepFails(r.ts, PETSC_FALSE));
  for (Vec &w : r.W) PetscCall(VecDuplicate(r.U, &w));
  PetscCall(TSMonitorSet(r.ts, Watch, &r, nullptr));
  PetscCall(TSSetUp(r.ts));
  PetscFunctionReturn(0);
}

inline PetscErrorCode SolveTS(TSRun &r, Run &run)
{
  PetscFunctionBegin;
  if (r.system) r.system->extra = 0;
  r.counted.residuals = r.counted.jacobians = 0;
  const double start                        = ProcessorSeconds();
  r.counted.deadline                        = start + r.limits.seconds;
  const PetscErrorCode e                    = TSSolve(r.ts, r.U);
  run.time                                  = ProcessorSeconds() - start;
  if (r.system) run.extra = r.system->extraSeconds();
  PetscCall(e);
  PetscFunctionReturn(0);
}

inline PetscErrorCode ReadTSCounters(TSRun &r, Run &run)
{
  PetscInt steps, rejected, newton;

  PetscFunctionBegin;
  if (r.settings.stepper == Stepper::HHT) {
    TSHHT3Statistics s;
    PetscCall(TSHHT3GetStatistics(r.ts, &s));
    run.count = {s.steps, s.rejected, s.newton, r.counted.residuals, r.counted.jacobians, s.factorizations};
    PetscFunctionReturn(0);
  }
  PetscCall(TSGetStepNumber(r.ts, &steps));
  PetscCall(TSGetStepRejections(r.ts, &rejected));
  PetscCall(TSGetSNESIterations(r.ts, &newton));
  run.count = {steps, rejected, newton, r.counted.residuals, r.counted.jacobians, newton}; /* full Newton: a factorization in each iteration */
  PetscFunctionReturn(0);
}

/* A solver that gives up is a result, not an error of the benchmark */
inline PetscErrorCode RunTS(const Case &c, const Problem &problem, const Reference &ref, const TSSettings &settings,
                            double eps, const Limits &limits, Run *run)
{
  TSRun             r(c, problem, ref, settings, limits);
  TSConvergedReason reason = TS_CONVERGED_ITERATING;

  PetscFunctionBegin;
  *run = Run();
  PetscCall(CreateTS(r, eps));
  PetscCall(PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr));
  const PetscErrorCode e = SolveTS(r, *run);
  PetscCall(PetscPopErrorHandler());
  PetscCall(ReadTSCounters(r, *run));
  PetscCall(TSGetConvergedReason(r.ts, &reason));
  if (r.counted.late)
    run->failure = tooLong;
  else if (e)
    run->failure = "error in TSSolve()";
  else if (reason <= 0)
    run->failure = TSConvergedReasons[reason];
  r.recorder.finish(*run);
  PetscCall(TSDestroy(&r.ts));
  PetscCall(VecDestroy(&r.U));
  PetscCall(VecDestroy(&r.V));
  for (Vec &w : r.W) PetscCall(VecDestroy(&w));
  PetscFunctionReturn(0);
}

} // namespace wp

#endif
