/*
  SUNDIALS IDA through its C interface: analytic Jacobian, variable order up to 5, its own first step, dense output by
  IDA_NORMAL. Small systems get its dense solver, the others KLU. The settings are the best of those tried: order 3
  costs 1.2 times more at equal error, and so does the dense solver throughout.
*/
#ifndef WORKPRECISION_IDA_H
#define WORKPRECISION_IDA_H

#include "workprecision_firstorder.h"

#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunmatrix/sunmatrix_sparse.h>

#include <numeric>

namespace wp
{

struct IDASettings {
  FirstOrder::Form form         = FirstOrder::Form::Stabilized;
  bool             testVelocity = false; /* whether velocities enter the error test */
  int              maxOrder     = 5;
  PetscInt         sparseFrom   = 15;  /* number of unknowns from which on KLU is used, since it is faster there */
  /* factor of the absolute tolerance of unknowns excluded from the error test, which Newton's convergence test still
     includes; with 1 it fails at small tolerances */
  double           looser       = 1e3;
  long   maxSteps  = 20000;            /* number of steps after which IDA checks the limit of time */
  double maxStep   = 0.;               /* largest step; 0: no limit */
  /* part of the error test at which the iteration ends, with up to ten corrections; 0: IDA's default, a third, with
     up to four corrections. With the default a matrix from before the release of a strong damper continues to act
     like the damper */
  double newton    = 0.;
  /* 0: 0.01 sqrt(eps) of the run. IDA's default is so short, where velocities are tested, that rounding dominates the
     accelerations and the first step fails */
  double firstStep = 0.;
  std::vector<double> part; /* factors of the absolute tolerance of the tested unknowns; empty: all 1 */
  /* sees every output point: t, U, U', U'' */
  std::function<void(double, const double *, const double *, const double *)> look = nullptr;
};

class IDASolver
{
public:
  IDASolver(const Case &c, const Problem &problem, const Reference &ref, const IDASettings &s)
      : counted_(problem), system_(counted_, s.form, c.phiT), recorder_(ref), settings_(s)
  {
    system_.initial(problem, y0_, yp0_);
  }
  IDASolver(const IDASolver &)            = delete;
  IDASolver &operator=(const IDASolver &) = delete;

  ~IDASolver()
  {
    IDAFree(&memory_);
    if (solver_) SUNLinSolFree(solver_);
    if (matrix_) SUNMatDestroy(matrix_);
    for (N_Vector x : {y_, yp_, tolerance_, id_})
      if (x) N_VDestroy(x);
    if (context_) SUNContext_Free(&context_);
  }

  /* Values recorded at the output points */
  const Recorder &recorded() const { return recorder_; }

  Run run(double eps, const Limits &limits)
  {
    Run run;
    try {
      setUp(eps);
      solve(limits, run);
      statistics(run);
    } catch (const Failure &f) {
      run.failure = f.what;
      if (memory_) statistics(run);
    }
    recorder_.finish(run);
    return run;
  }

private:
  struct Failure {
    std::string what;
  };
  CountedProblem        counted_;
  FirstOrder            system_;
  Recorder              recorder_;
  IDASettings           settings_;
  std::vector<double>   y0_, yp0_;
  Entries               entries_;
  std::vector<PetscInt> slot_; /* position of an entry in the matrix's array of values */
  SUNContext            context_ = nullptr;
  N_Vector              y_ = nullptr, yp_ = nullptr, tolerance_ = nullptr, id_ = nullptr;
  SUNMatrix             matrix_ = nullptr;
  SUNLinearSolver       solver_ = nullptr;
  void                 *memory_ = nullptr;

  static void check(int code, const char *call)
  {
    if (code < 0) throw Failure{std::string(call) + " failed: " + IDAGetReturnFlagName(code)};
  }

  void setUp(double eps)
  {
    const PetscInt n = system_.size;
    check(SUNContext_Create(nullptr, &context_), "SUNContext_Create");
    for (N_Vector *x : {&y_, &yp_, &tolerance_, &id_}) *x = N_VNew_Serial(n, context_);
    std::copy(y0_.begin(), y0_.end(), N_VGetArrayPointer(y_));
    std::copy(yp0_.begin(), yp0_.end(), N_VGetArrayPointer(yp_));
    for (PetscInt i = 0; i < n; i++) {
      const bool tested          = system_.isDifferential(i) && (settings_.testVelocity || !system_.isVelocity(i));
      N_VGetArrayPointer(id_)[i] = tested;
      N_VGetArrayPointer(tolerance_)[i] = tested ? eps : eps * settings_.looser;
      if (tested && (size_t)i < settings_.part.size()) N_VGetArrayPointer(tolerance_)[i] *= settings_.part[i];
    }
    memory_ = IDACreate(context_);
    check(IDASetErrFile(memory_, nullptr), "IDASetErrFile");
    check(IDAInit(memory_, residual, counted_.t0, y_, yp_), "IDAInit");
    check(IDASVtolerances(memory_, eps, tolerance_), "IDASVtolerances");
    check(IDASetId(memory_, id_), "IDASetId");
    check(IDASetSuppressAlg(memory_, SUNTRUE), "IDASetSuppressAlg");
    check(IDASetUserData(memory_, this), "IDASetUserData");
    check(IDASetMaxOrd(memory_, settings_.maxOrder), "IDASetMaxOrd");
    check(IDASetMaxNumSteps(memory_, settings_.maxSteps), "IDASetMaxNumSteps");
    if (settings_.maxStep > 0.) check(IDASetMaxStep(memory_, settings_.maxStep), "IDASetMaxStep");
    const double first =
        settings_.firstStep > 0. ? settings_.firstStep : 1e-2 * std::sqrt(eps) * (counted_.t1 - counted_.t0);
    check(IDASetInitStep(memory_, first), "IDASetInitStep");
    createMatrix();
    check(IDASetLinearSolver(memory_, solver_, matrix_), "IDASetLinearSolver");
    check(IDASetJacFn(memory_, jacobian), "IDASetJacFn");
    if (settings_.newton > 0.) {
      check(IDASetNonlinConvCoef(memory_, settings_.newton), "IDASetNonlinConvCoef");
      check(IDASetMaxNonlinIters(memory_, 10), "IDASetMaxNonlinIters");
    }
  }

  void createMatrix()
  {
    const PetscInt n = system_.size;
    system_.jacobian(counted_.t0, y0_.data(), yp0_.data(), 1., entries_);
    slot_.resize(entries_.row.size());
    if (n < settings_.sparseFrom) {
      matrix_ = SUNDenseMatrix(n, n, context_);
      solver_ = SUNLinSol_Dense(y_, matrix_, context_);
      for (size_t k = 0; k < slot_.size(); k++) slot_[k] = entries_.col[k] * n + entries_.row[k];
      return;
    }
    std::vector<size_t> order(slot_.size());
    std::iota(order.begin(), order.end(), 0);
    auto position = [&](size_t k) { return std::make_pair(entries_.col[k], entries_.row[k]); };
    std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return position(a) < position(b); });
    PetscInt last = -1;
    for (size_t k = 0; k < order.size(); k++)
      slot_[order[k]] = k > 0 && position(order[k]) == position(order[k - 1]) ? last : ++last;
    matrix_ = SUNSparseMatrix(n, n, last + 1, CSC_MAT, context_);
    for (size_t k : order) {
      SUNSparseMatrix_IndexValues(matrix_)[slot_[k]]              = entries_.row[k];
      SUNSparseMatrix_IndexPointers(matrix_)[entries_.col[k] + 1] = slot_[k] + 1;
    }
    pattern_.assign(SUNSparseMatrix_IndexValues(matrix_), SUNSparseMatrix_IndexValues(matrix_) + last + 1);
    columns_.assign(SUNSparseMatrix_IndexPointers(matrix_), SUNSparseMatrix_IndexPointers(matrix_) + n + 1);
    solver_ = SUNLinSol_KLU(y_, matrix_, context_);
  }
  std::vector<sunindextype> pattern_, columns_; /* kept, because IDA clears the matrix including its pattern before every Jacobian */

  void solve(const Limits &limits, Run &run)
  {
    std::vector<double> u(counted_.n), v(counted_.n), a(counted_.n);
    const double        start = ProcessorSeconds();
    system_.extra             = 0;
    counted_.deadline         = start + limits.seconds;
    counted_.most             = limits.residuals;
    while (!recorder_.done()) {
      realtype  t;
      const int code = IDASolve(memory_, recorder_.next(), &t, y_, yp_, IDA_NORMAL);
      run.time       = ProcessorSeconds() - start;
      if (counted_.late) throw Failure{tooLong};
      if (code != IDA_TOO_MUCH_WORK) check(code, "IDASolve");
      if (code == IDA_TOO_MUCH_WORK) continue;
      system_.output(N_VGetArrayPointer(y_), u.data(), v.data());
      recorder_.store(u.data(), v.data());
      if (!settings_.look) continue;
      system_.accelerations(N_VGetArrayPointer(yp_), a.data());
      settings_.look(t, u.data(), v.data(), a.data());
    }
    run.time = ProcessorSeconds() - start;
  }

  void statistics(Run &run)
  {
    long steps = 0, errorFails = 0, newton = 0, setups = 0;
    run.extra = system_.extraSeconds();
    IDAGetNumSteps(memory_, &steps);
    IDAGetNumErrTestFails(memory_, &errorFails);
    IDAGetNumNonlinSolvIters(memory_, &newton);
    IDAGetNumLinSolvSetups(memory_, &setups);
    run.count = {steps, errorFails, newton, counted_.residuals, counted_.jacobians, setups};
  }

  static int residual(realtype t, N_Vector y, N_Vector yp, N_Vector f, void *self)
  {
    static_cast<IDASolver *>(self)->system_.residual(t, N_VGetArrayPointer(y), N_VGetArrayPointer(yp),
                                                     N_VGetArrayPointer(f));
    for (sunindextype i = 0; i < NV_LENGTH_S(f); i++)
      if (!std::isfinite(N_VGetArrayPointer(f)[i])) return 1; /* a recoverable error: IDA tries a smaller step */
    return 0;
  }

  static int jacobian(realtype t, realtype c, N_Vector y, N_Vector yp, N_Vector, SUNMatrix J, void *self, N_Vector,
                      N_Vector, N_Vector)
  {
    auto     &s = *static_cast<IDASolver *>(self);
    realtype *value;
    s.system_.jacobian(t, N_VGetArrayPointer(y), N_VGetArrayPointer(yp), c, s.entries_);
    if (SUNMatGetID(J) == SUNMATRIX_DENSE) {
      value = SUNDenseMatrix_Data(J);
      std::fill_n(value, SUNDenseMatrix_LData(J), 0.);
    } else {
      value = SUNSparseMatrix_Data(J);
      std::fill_n(value, s.pattern_.size(), 0.);
      std::copy(s.pattern_.begin(), s.pattern_.end(), SUNSparseMatrix_IndexValues(J));
      std::copy(s.columns_.begin(), s.columns_.end(), SUNSparseMatrix_IndexPointers(J));
    }
    for (size_t k = 0; k < s.slot_.size(); k++) value[s.slot_[k]] += s.entries_.value[k];
    return 0;
  }
};

} // namespace wp

#endif
