/* Shared by the tests of the integrator: a run as an object, capture of errors and output, errors against references */
#ifndef HHTDAE_TESTS_SUPPORT_H
#define HHTDAE_TESTS_SUPPORT_H

#include "problem.h"
#include "problems/andrews.h"
#include "problems/caraxis.h"
#include "problems/chain.h"
#include "problems/doublependulum.h"
#include "problems/fourbar.h"
#include "problems/heavytop.h"
#include "problems/oscillators.h"
#include "problems/pendulum.h"
#include "problems/rolling.h"
#include "problems/slidercrank.h"
#include "problems/springpendulum.h"
#include "problems/uservars.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace hhtest
{

using namespace hhtex;
using Array = std::vector<double>;

/* Calls a PETSc function that must succeed; GoogleTest turns the exception into a failure */
inline void must(PetscErrorCode code)
{
  if (code) throw std::runtime_error("PETSc error " + std::to_string((int)code));
}

inline std::string text(const char *format, ...)
{
  char    buffer[1024];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

/* Prints measured figures in the output of the test */
#define MEASURED(...) std::printf("[ MEASURED ] %s\n", hhtest::text(__VA_ARGS__).c_str())

/* During its lifetime PETSc's errors are returned, and their first message is stored instead of being printed with a trace */
class ErrorTrap
{
public:
  std::string message;

  ErrorTrap() { PetscPushErrorHandler(keep, this); }
  ~ErrorTrap() { PetscPopErrorHandler(); }
  ErrorTrap(const ErrorTrap &) = delete;
  bool says(const std::string &part) const { return message.find(part) != std::string::npos; }

private:
  static PetscErrorCode keep(MPI_Comm, int, const char *, const char *, PetscErrorCode code, PetscErrorType type,
                             const char *message, void *ctx)
  {
    if (type == PETSC_ERROR_INITIAL && message) static_cast<ErrorTrap *>(ctx)->message = message;
    return code;
  }
};

/* During its lifetime PETSc's output is stored instead of being printed */
class Printed
{
public:
  Printed() : before_(PetscVFPrintf)
  {
    kept().clear();
    PetscVFPrintf = keep;
  }
  ~Printed() { PetscVFPrintf = before_; }
  Printed(const Printed &) = delete;
  const std::string &text() const { return kept(); }
  bool               says(const std::string &part) const { return text().find(part) != std::string::npos; }

private:
  PetscErrorCode (*before_)(FILE *, const char[], va_list);

  static std::string &kept()
  {
    static std::string text;
    return text;
  }
  static PetscErrorCode keep(FILE *, const char format[], va_list arguments)
  {
    std::vector<char> buffer(1 << 14);
    size_t            length = 0;
    PetscCall(PetscVSNPrintf(buffer.data(), buffer.size(), format, &length, arguments));
    kept() += buffer.data();
    return 0;
  }
};

/* During its lifetime these options replace those of the command line */
class Options
{
public:
  explicit Options(const std::string &text)
  {
    must(PetscOptionsCreate(&options_));
    must(PetscOptionsInsertString(options_, text.c_str()));
    must(PetscOptionsPush(options_));
  }
  ~Options()
  {
    PetscOptionsPop();
    PetscOptionsDestroy(&options_);
  }
  Options(const Options &) = delete;

private:
  PetscOptions options_ = nullptr;
};

/* All entries of a vector, on every rank */
inline Array whole(Vec x)
{
  VecScatter         scatter;
  Vec                all;
  PetscInt           n;
  const PetscScalar *a;
  must(VecScatterCreateToAll(x, &scatter, &all));
  must(VecScatterBegin(scatter, x, all, INSERT_VALUES, SCATTER_FORWARD));
  must(VecScatterEnd(scatter, x, all, INSERT_VALUES, SCATTER_FORWARD));
  must(VecGetSize(all, &n));
  must(VecGetArrayRead(all, &a));
  Array result(a, a + n);
  must(VecRestoreArrayRead(all, &a));
  must(VecDestroy(&all));
  must(VecScatterDestroy(&scatter));
  return result;
}

/* A problem with a TS for it, set up from options */
class Simulation
{
public:
  TS             ts = nullptr;
  Vec            U = nullptr, V = nullptr;
  const Problem &problem;
  /* Called by TSSolve() after the start and after every accepted step */
  std::function<void(Simulation &, PetscInt step, double t)> watch;

  Simulation(const Problem &p, const std::string &options, MPI_Comm comm = PETSC_COMM_SELF, bool setRoles = false)
      : Simulation(p, options, Empty())
  {
    must(ProblemCreateTS(comm, p, &ts, &U, &V, setRoles));
    if (!setRoles) must(TSSetType(ts, TSHHT3));
    must(TSMonitorSet(ts, monitor, this, nullptr));
    Options in(options_);
    must(TSSetFromOptions(ts));
  }
  ~Simulation()
  {
    TSDestroy(&ts);
    VecDestroy(&U);
    VecDestroy(&V);
  }
  Simulation(const Simulation &) = delete;

  PetscErrorCode solve()
  {
    Options in(options_);
    return TSSolve(ts, nullptr);
  }
  PetscErrorCode step()
  {
    Options in(options_);
    return TSStep(ts);
  }
  Array u() const { return whole(U); }
  Array v() const { return whole(V); }
  Array a() const
  {
    Vec A;
    must(TSHHT3GetAcceleration(ts, &A));
    return whole(A);
  }
  double t() const
  {
    PetscReal t;
    must(TSGetTime(ts, &t));
    return t;
  }
  TSHHT3Statistics statistics() const
  {
    TSHHT3Statistics s;
    must(TSHHT3GetStatistics(ts, &s));
    return s;
  }
  TSConvergedReason reason() const
  {
    TSConvergedReason r;
    must(TSGetConvergedReason(ts, &r));
    return r;
  }
  ProblemErrors errors() const
  {
    ProblemErrors e;
    PetscReal     t;
    must(TSGetTime(ts, &t));
    must(ProblemComputeErrors(t, problem, U, V, &e));
    return e;
  }

private:
  std::string options_;

  /* Delegated constructor: once it has completed, the destructor runs even if the other constructor throws */
  struct Empty {
  };
  Simulation(const Problem &p, const std::string &options, Empty) : problem(p), options_(options) {}

  static PetscErrorCode monitor(TS, PetscInt step, PetscReal t, Vec, void *ctx)
  {
    Simulation *run = static_cast<Simulation *>(ctx);
    if (run->watch && step >= 0) run->watch(*run, step, t);
    return 0;
  }
};

/* Options for steps of constant length with corrections solved almost to rounding */
inline std::string fixedSteps(double h)
{
  return text(" -ts_adapt_type none -ts_dt %.17g -ts_rtol 1e-8 -ts_atol 1e-8 -ts_hhtdae_corrector_tolerance 1e-3 ", h);
}

inline std::string tolerance(double eps) { return text(" -ts_rtol %g -ts_atol %g ", eps, eps); }

inline void widen(double &to, double by)
{
  if (!(by <= to)) to = by;
}

/* Largest errors over `samples` times of a run with steps of one length; those of lambda after a tenth of the run, when
   the transient of the start has died out */
inline ProblemErrors fixedStepErrors(const Problem &p, int steps, const std::string &options, int samples = 10)
{
  ProblemErrors worst;
  Simulation    run(p, fixedSteps((p.t1 - p.t0) / steps) + options);
  run.watch = [&](Simulation &r, PetscInt step, double) {
    if (step == 0 || step % (steps / samples)) return;
    const ProblemErrors e = r.errors();
    widen(worst.q, e.q);
    widen(worst.v, e.v);
    widen(worst.other, e.other);
    if (step >= steps / 10) widen(worst.lambda, e.lambda);
  };
  must(run.solve());
  if (run.statistics().steps != steps) throw std::runtime_error("not the number of steps asked for");
  return worst;
}

inline double order(double coarse, double fine, double ratio = 2.) { return std::log(coarse / fine) / std::log(ratio); }

inline double norm(const Array &x)
{
  double s = 0.;
  for (double v : x) s += v * v;
  return std::sqrt(s);
}

/* Largest difference relative to the largest entry of b; infinite for arrays of different lengths */
inline double relativeDifference(const Array &a, const Array &b)
{
  if (a.size() != b.size()) return PETSC_INFINITY;
  double d = 0., m = 0.;
  for (size_t i = 0; i < b.size(); i++) {
    widen(d, std::abs(a[i] - b[i]));
    m = std::max(m, std::abs(b[i]));
  }
  return m > 0. ? d / m : d;
}

struct Factory {
  const char                               *name;
  std::function<std::unique_ptr<Problem>()> make;
};

template <class P, class... Args> Factory factory(const char *name, Args... args)
{
  return {name, [=] { return std::unique_ptr<Problem>(new P(args...)); }};
}

/* All example problems in small and short versions */
inline std::vector<Factory> allProblems()
{
  return {factory<Pendulum>("pendulum", -90., 0., 1.),
          factory<Oscillators>("oscillators", Array{1., 5., 20.}, Array{0., .1, .5}, true, 2.),
          factory<DoublePendulum>("doublependulum", 1.),
          factory<UserVars>("uservars", 1.),
          factory<Andrews>("andrews", .01),
          factory<CarAxis>("caraxis"),
          factory<FourBar>("fourbar", 2, .4),
          factory<SliderCrank>("slidercrank", 1.),
          factory<SpringPendulum>("springpendulum", 1e4, .5),
          factory<HeavyTop>("heavytop", .2),
          factory<Sleigh>("sleigh", 1.),
          factory<RollingDisc>("rollingdisc", 1.),
          factory<Chain>("chain", 10, 0., .3)};
}

} // namespace hhtest

#endif
