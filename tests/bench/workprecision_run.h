/*
  What all solvers of the work-precision comparison share: the counted problem, the output points, the errors and the
  clock.
*/
#ifndef WORKPRECISION_RUN_H
#define WORKPRECISION_RUN_H

#include "problem.h"
#include "process_use.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace wp
{

using hhtbench::ProcessorSeconds;
using hhtex::Entries;
using hhtex::Problem;

inline bool isMultiplier(TSHHT3Role r) { return r == TSHHT3_HOLONOMIC || r == TSHHT3_NONHOLONOMIC; }

/* Costs of a run, counted for all solvers in the same way, as far as possible in the problem's own functions */
struct Counters {
  long steps = 0, rejected = 0, newton = 0, residuals = 0, jacobians = 0, factorizations = 0;
};

constexpr const char *tooLong = "took longer than the limit";

/* One run, or the median of several; failure is empty if the solver reached the end */
struct Run {
  double   time = 0., error[3] = {-1., -1., -1.}; /* errors of q and states, of q', of lambda; negative where there is no reference */
  double   extra = 0.; /* part of the time that first-order forms spend in evaluations needed only by the adapter */
  Counters count;
  std::string failure;
};

/* Forwards and counts all calls. After the deadline, or after the largest number of residuals, residuals are NaN; this
   ends solvers that accept no step and therefore never call a monitor */
struct CountedProblem : Problem {
  const Problem &p;
  mutable long   residuals = 0, jacobians = 0;
  double         deadline = 1e300; /* CPU time of the process at which the run must end */
  double         most     = 1e300; /* largest number of residuals */
  mutable bool   late     = false;

  explicit CountedProblem(const Problem &problem) : p(problem)
  {
    name = p.name;
    n    = p.n;
    t0   = p.t0;
    t1   = p.t1;
    role = p.role;
  }
  void initial(double *u, double *v) const override { p.initial(u, v); }
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    if (++residuals > most || (residuals % 256 == 0 && ProcessorSeconds() > deadline)) late = true;
    if (late)
      std::fill_n(f, n, std::nan(""));
    else
      p.residual(t, u, v, a, f);
  }
  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa,
                Entries &J) const override
  {
    jacobians++;
    p.jacobian(t, u, v, a, sv, sa, J);
  }
};

/* The reference at the output points, with the weights 1/max(1, largest value so far), those of the integrator's error test */
struct Reference {
  PetscInt                         n;
  std::vector<TSHHT3Role>          role;
  std::vector<double>              times; /* output points without t0 */
  std::vector<std::vector<double>> u, v, weightU, weightV;

  /* Output points only: nothing is compared, and errors are negative */
  Reference(const Problem &p, const std::vector<double> &at)
      : n(p.n), role(p.role), times(at), u(at.size(), std::vector<double>(n, std::nan(""))), v(u),
        weightU(at.size(), std::vector<double>(n, 1.)), weightV(weightU)
  {
  }

  explicit Reference(const Problem &p) : n(p.n), role(p.role)
  {
    std::vector<double> ur(n), vr(n), ar(n), maxU(n, 1.), maxV(n, 1.);
    for (double t : p.referenceTimes()) {
      if (!p.reference(t, ur.data(), vr.data(), ar.data())) continue;
      for (PetscInt i = 0; i < n; i++) { /* fmax() ignores NaN, that is, values that are not known */
        maxU[i] = std::fmax(maxU[i], std::abs(ur[i]));
        maxV[i] = std::fmax(maxV[i], std::abs(vr[i]));
      }
      if (t <= p.t0) continue;
      times.push_back(t);
      u.push_back(ur);
      v.push_back(vr);
      weightU.push_back(maxU);
      weightV.push_back(maxV);
    }
  }

  /* error[] = the largest weighted difference over all output points */
  void compare(const std::vector<std::vector<double>> &us, const std::vector<std::vector<double>> &vs,
               double error[3]) const
  {
    error[0] = error[1] = error[2] = -1.;
    for (size_t k = 0; k < times.size(); k++)
      for (PetscInt i = 0; i < n; i++) {
        const bool differential = role[i] == TSHHT3_COORDINATE || role[i] == TSHHT3_STATE;
        if (differential) include(us[k][i], u[k][i], weightU[k][i], error[0]);
        if (role[i] == TSHHT3_COORDINATE) include(vs[k][i], v[k][i], weightV[k][i], error[1]);
        if (isMultiplier(role[i])) include(us[k][i], u[k][i], weightU[k][i], error[2]);
      }
  }

private:
  static void include(double x, double ref, double weight, double &error)
  {
    if (std::isnan(ref) || std::isnan(error)) return;
    const double e = std::abs(x - ref) / weight;
    if (!(e <= error)) error = e; /* a computed NaN must not be lost */
  }
};

/* Stores a solver's values at the output points, which must come in order */
struct Recorder {
  const Reference                 &ref;
  std::vector<std::vector<double>> u, v;

  explicit Recorder(const Reference &r) : ref(r) {}
  bool          done() const { return u.size() == ref.times.size(); }
  double        next() const { return ref.times[u.size()]; }
  const double *nextState() const { return ref.u[u.size()].data(); }
  void          store(const double *us, const double *vs)
  {
    u.emplace_back(us, us + ref.n);
    v.emplace_back(vs, vs + ref.n);
  }
  /* Errors of a run that reached the end */
  void finish(Run &run) const
  {
    if (!run.failure.empty()) return;
    if (!done()) {
      run.failure = "ended before the last output point";
      return;
    }
    ref.compare(u, v, run.error);
    for (double e : run.error)
      if (std::isnan(e)) run.failure = "result is not a number";
    if (run.error[0] > 1e3) run.failure = "left the solution (error above 1000)";
  }
};

/* Origin of a problem's reference */
struct Origin {
  std::string reference;                 /* empty: the problem's own reference, exact or tabulated */
  std::string failure;                   /* reason why there is no reliable reference */
  double      trusted[3] = {0., 0., 0.}; /* errors below these cannot be distinguished from those of the reference: q, q', multipliers */
  double      ida[3] = {}, hht[3] = {};  /* differences on which this is based */
};

/* Rotations of a scene: local vectors, Euler angles about axes chosen by the scene, or Euler angles of the problem,
   which the other solvers integrate */
enum class SceneAngles { None, Own, Problems };

/* A problem of the comparison. d Phi/dt of problems whose constraints move (first-order forms need it): adds to f, one
   entry per unknown. A scene has a TS of its own, for PETSc's second-order integrators, wants to know of accepted
   steps, and may give results in other coordinates than those of the start. */
struct Case {
  std::string                                                                    name;
  std::function<PetscErrorCode(std::unique_ptr<Problem> *, Origin *)>            make;
  std::function<void(const Problem &, double, const double *, double *)>         phiT     = nullptr;
  std::function<PetscErrorCode(const Problem &, SceneAngles, TS *)>              createTS = nullptr;
  std::function<void(const Problem &, const double *u, const double *v)>         accept   = nullptr;
  std::function<void(const Problem &, double *u, double *v, const double *near)> toStart  = nullptr;
  bool                                                                           scene    = false;
};

/* Limits for one run, in CPU seconds and residuals, beyond which a solver counts as failed */
struct Limits {
  double seconds = 10., residuals = 1e300;
};

} // namespace wp

#endif
