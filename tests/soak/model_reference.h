/*
  The reference of a model by SUNDIALS IDA, on the stabilized first-order form of index 2: variable-order BDF, another
  formulation, other step and error control. Of the library it shares the scene's residual and Jacobian, and the
  consistent start.

  The axes of Euler angles that come near their singularity are changed here as well: the run is interrupted at an output
  point before, the state is converted to the new angles, and IDA starts again from there.
*/
#ifndef HHTDAE_SOAK_MODEL_REFERENCE_H
#define HHTDAE_SOAK_MODEL_REFERENCE_H

#include "model_run.h"

#ifdef HHTDAE_HAVE_IDA
#include "bench/scene_problem.h"
#include "bench/workprecision_ida.h"

namespace soak
{

/* The scene from a given state on; its residual is NaN where Euler angles come near their singularity, so that IDA
   stops there */
struct Leg : hhtex::Problem {
  const hhtbench::SceneProblem &p;
  std::vector<double>           u0, v0, a0;
  std::vector<PetscInt>         angles; /* index of the first Euler angle of each body that has Euler angles */
  mutable bool                  singular = false;

  static constexpr double least = 0.2; /* smallest sine of theta */

  Leg(const hhtbench::SceneProblem &problem) : p(problem)
  {
    name = p.name;
    n    = p.n;
    t0   = p.t0;
    t1   = p.t1;
    role = p.role;
    for (const LocalBody &b : runtime().bodies.body)
      if (TurnsInSpace(b.kind)) angles.push_back(b.first + 3);
  }
  Runtime &runtime() const { return p.run(); }

  void initial(double *u, double *v) const override
  {
    std::copy(u0.begin(), u0.end(), u);
    std::copy(v0.begin(), v0.end(), v);
  }
  bool reference(double t, double *u, double *v, double *a) const override
  {
    if (t != t0) return false;
    initial(u, v);
    std::copy(a0.begin(), a0.end(), a);
    return true;
  }
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    for (PetscInt e : angles)
      if (!(std::abs(std::sin(u[e + 1])) > least)) {
        singular = true;
        std::fill_n(f, n, std::nan(""));
        return;
      }
    p.residual(t, u, v, a, f);
  }
  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa,
                hhtex::Entries &J) const override
  {
    p.jacobian(t, u, v, a, sv, sa, J);
  }

  /* Changes the axes of all bodies according to their present motion, and converts the state (u0, v0, a0) to the new angles */
  void reframe()
  {
    Bodies &B = runtime().bodies;
    for (PetscInt b = 0; b < (PetscInt)B.body.size(); b++) {
      const LocalBody k = B.body[b];
      if (!TurnsInSpace(k.kind)) continue;
      double   *eps = &u0[k.first + 3], *rate = &v0[k.first + 3], *acc = &a0[k.first + 3];
      Matrix3   A;
      EulerAxes e;
      EulerFrame(eps, A, e);
      const Vector3 x(rate[0], rate[1], rate[2]),
          w = AngularVelocity(e, x), alpha = AngularVelocity(e, Vector3(acc[0], acc[1], acc[2])) + Convective(e, x, w);
      const Matrix3 C     = ChooseAxes(A * k.C, w);
      const Vector3 angle = EulerAngles(A * k.C * C.transpose());
      EulerFrame(angle.data(), A, e);
      const Vector3 y = EulerRates(e, w), z = EulerRates(e, alpha - Convective(e, y, w));
      for (int i = 0; i < 3; i++) {
        eps[i]  = angle(i);
        rate[i] = y(i);
        acc[i]  = z(i);
      }
      B.body[b].C = C;
    }
  }
};

inline wp::Case CaseOf(const Leg &leg)
{
  wp::Case c;
  c.name = leg.name;
  if (leg.p.hasMotions())
    c.phiT = [](const wp::Problem &q, double t, const double *, double *f) {
      static_cast<const Leg &>(q).p.phiT(t, f);
    };
  return c;
}

struct ReferenceRun {
  Model                                   model;
  std::unique_ptr<hhtbench::SceneProblem> problem;
  Trajectory                              result;
  int                                     legs = 0;
  double                                  work = 0; /* used so far */
};

constexpr int fine = 16; /* output points of IDA per sample */

/* Variants of IDA, since one may succeed where another fails: the treatment of unknowns outside the error test, and the form */
struct Way {
  wp::FirstOrder::Form form;
  double               looser;
};
constexpr int ways = 3;
inline Way    WayOf(int k)
{
  const Way all[ways] = {{wp::FirstOrder::Form::Stabilized, 1e3},
                         {wp::FirstOrder::Form::Stabilized, 1e7},
                         {wp::FirstOrder::Form::Index3, 1e6}};
  return all[k];
}

/* A residual of IDA, with the operations that belong to it, takes about three times as long as one of hhtdae of the
   same size */
inline double WorkOfIDA(double residuals, const Leg &leg) { return 3 * WorkOf(residuals, 2 * leg.n); }

/* Runs one leg until IDA stops; the state at the last output point that was reached becomes the start of the next leg */
inline PetscErrorCode RunLeg(ReferenceRun &r, Leg &leg, int &point, int way, double eps, double newton, double work,
                             std::string *failure)
{
  std::vector<double> times, values;
  wp::IDASettings     settings;
  PetscErrorCode      failed = 0;
  PetscFunctionBegin;
  for (int k = point + 1; k <= samples * fine; k++)
    times.push_back(k == samples * fine ? leg.t1 : leg.t1 * k / (samples * fine));
  settings.form          = WayOf(way).form;
  settings.looser        = WayOf(way).looser;
  settings.newton        = newton;
  settings.testVelocity  = settings.form == wp::FirstOrder::Form::Stabilized;
  double              at = leg.t0;
  std::vector<double> u, v, a;
  settings.look = [&](double t, const double *U, const double *V, const double *A) {
    at = t;
    u.assign(U, U + leg.n);
    v.assign(V, V + leg.n);
    a.assign(A, A + leg.n);
    point++;
    if (!failed) failed = r.problem->channels(t, U, V, A, values);
    if (point % fine == 0) r.result.x.push_back(values);
  };
  leg.singular = false;
  const wp::Reference output(leg, times);
  wp::IDASolver       ida(CaseOf(leg), leg, output, settings);
  const wp::Run       run = ida.run(eps, wp::Limits{1e9, work / WorkOfIDA(1, leg)});
  *failure                = run.failure;
  r.result.steps += run.count.steps;
  r.work += WorkOfIDA((double)run.count.residuals, leg);
  r.legs++;
  if (u.empty() && !run.failure.empty()) PetscFunctionReturn(failed);
  leg.u0 = u;
  leg.v0 = v;
  leg.a0 = a;
  leg.t0 = at;
  PetscFunctionReturn(failed);
}

inline PetscErrorCode SolveByIDA(ReferenceRun &r, double eps, double newton, double work)
{
  std::string failure;
  PetscFunctionBegin;
  PetscCall(hhtbench::SceneProblem::make(
      "model", [&](MPI_Comm) { return r.model.scene; }, r.model.end, &r.problem));
  Leg leg(*r.problem);
  leg.u0.resize(leg.n);
  leg.v0.resize(leg.n);
  leg.a0.resize(leg.n);
  r.problem->initial(leg.u0.data(), leg.v0.data());
  r.problem->reference(leg.t0, leg.u0.data(), leg.v0.data(), leg.a0.data());
  const double start = ProcessorSeconds();
  for (int point = 0, stuck = 0, way = 0; point < samples * fine;) {
    const int before = point;
    PetscCall(RunLeg(r, leg, point, way, eps, newton, work - r.work, &failure));
    if (failure.empty()) break;
    const bool late = r.legs > 100 || r.work >= work;
    stuck           = point == before ? stuck + 1 : 0;
    if (leg.singular && stuck < 2)
      leg.reframe();
    else
      way = stuck ? way + 1 : 0;
    if (late || way == ways) {
      r.result.failure = "IDA: " + failure;
      break;
    }
  }
  r.result.cpu = ProcessorSeconds() - start;
  PetscFunctionReturn(0);
}

/* newton: see wp::IDASettings */
inline Trajectory RunIDA(Model model, double eps, double work, int *legs, double newton = 0)
{
  ReferenceRun r;
  Quiet        quiet;
  r.model = std::move(model);
  if (SolveByIDA(r, eps, newton, work)) r.result.failure = "IDA: " + quiet.message;
  if (r.result.failure.empty() && (int)r.result.x.size() != samples) r.result.failure = "IDA ended early";
  for (const auto &x : r.result.x)
    for (double value : x)
      if (!std::isfinite(value)) r.result.failure = "IDA: a result is not a number";
  *legs = r.legs;
  return r.result;
}

} // namespace soak

#endif
#endif
