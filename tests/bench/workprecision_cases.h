/* The problems that have a reference, and the solvers of the comparison. A new problem or solver needs one more line here */
#ifndef WORKPRECISION_CASES_H
#define WORKPRECISION_CASES_H

#include "problems/andrews.h"
#include "problems/caraxis.h"
#include "problems/doublependulum.h"
#include "problems/fourbar.h"
#include "problems/heavytop.h"
#include "problems/oscillators.h"
#include "problems/pendulum.h"
#include "problems/rolling.h"
#include "problems/slidercrank.h"
#include "problems/springpendulum.h"
#include "problems/uservars.h"
#include "workprecision_ts.h"
#if defined(HHTDAE_HAVE_IDA)
#include "workprecision_ida.h"
#endif

namespace wp
{

template <class P, class... Args> Case makeCase(const char *name, Args... args)
{
  Case c;
  c.name = name;
  c.make = [=](std::unique_ptr<Problem> *p, Origin *) {
    p->reset(new P(args...));
    return (PetscErrorCode)0;
  };
  return c;
}

inline std::vector<Case> allCases()
{
  using namespace hhtex;
  std::vector<Case> cases = {
      makeCase<Pendulum>("pendulum"),
      makeCase<DoublePendulum>("doublependulum"),
      makeCase<SpringPendulum>("springpendulum"),
      makeCase<Oscillators>("oscillators", std::vector<double>{1., 5., 25.}, std::vector<double>{0., .05, .5}, true),
      makeCase<SliderCrank>("slidercrank"),
      makeCase<FourBar>("fourbar"),
      makeCase<Andrews>("andrews"),
      makeCase<CarAxis>("caraxis"),
      makeCase<HeavyTop>("heavytop"),
      makeCase<UserVars>("uservars"),
      makeCase<Sleigh>("sleigh"),
      makeCase<RollingDisc>("disc"),
  };
  for (Case &c : cases)
    if (c.name == "caraxis")
      c.phiT = [](const Problem &p, double t, const double *u, double *f) {
        const auto &axis = static_cast<const CarAxis &>(p);
        double      xb, yb;
        axis.road(t, xb, yb);
        const double dyb = axis.r * axis.w * std::cos(axis.w * t);
        f[4] -= -yb * dyb / xb * u[0] + dyb * u[1];
      };
  return cases;
}

struct Solver {
  std::string name, title;
  bool        inOverview;
  std::function<PetscErrorCode(const Case &, const Problem &, const Reference &, double, const Limits &, Run *)> run;
};

inline Solver makeTS(const char *name, const char *title, bool inOverview, TSSettings settings)
{
  return {name, title, inOverview,
          [settings](const Case &c, const Problem &p, const Reference &ref, double eps, const Limits &l, Run *run) {
            return RunTS(c, p, ref, settings, eps, l, run);
          }};
}

inline Solver makeHHT(const char *name, const char *title, bool inOverview, std::function<PetscErrorCode(TS)> configure)
{
  TSSettings s;
  s.configure = std::move(configure);
  return makeTS(name, title, inOverview, s);
}

inline PetscErrorCode SetFormAndAlpha(TS ts, TSHHT3Form form, double alpha)
{
  PetscFunctionBegin;
  PetscCall(TSHHT3SetForm(ts, form));
  PetscCall(TSHHT3SetAlpha(ts, alpha));
  PetscFunctionReturn(0);
}

inline PetscErrorCode SetRadius(TS ts, double radius)
{
  PetscFunctionBegin;
  PetscCall(TSHHT3SetForm(ts, TSHHT3_FORM_SECOND_ORDER));
  PetscCall(TSHHT3SetRadius(ts, radius));
  PetscFunctionReturn(0);
}

#if defined(HHTDAE_HAVE_IDA)
inline Solver makeIDA(const char *name, const char *title, bool inOverview, IDASettings s)
{
  return {name, title, inOverview,
          [s](const Case &c, const Problem &p, const Reference &ref, double eps, const Limits &l, Run *run) {
            IDASolver solver(c, p, ref, s);
            *run = solver.run(eps, l);
            return (PetscErrorCode)0;
          }};
}
#endif

inline void addForeign(std::vector<Solver> &list)
{
  TSSettings alpha2, bdf;
  alpha2.stepper   = Stepper::Alpha2;
  alpha2.configure = [](TS ts) { return TSAlpha2SetRadius(ts, 0.8); };
  bdf.stepper      = Stepper::BDF;
  bdf.configure    = [](TS ts) { return TSBDFSetOrder(ts, 5); };
  list.push_back(makeTS("alpha2", "PETSc ALPHA2, radius 0.8", false, alpha2));
  alpha2.fixed = true;
  list.push_back(makeTS("alpha2_h", "PETSc ALPHA2, constant steps", true, alpha2));
  alpha2.fixed     = false;
  alpha2.configure = [](TS ts) { return TSAlpha2SetRadius(ts, 0.); };
  list.push_back(makeTS("alpha2_0", "PETSc ALPHA2, radius 0", true, alpha2));
  list.push_back(makeTS("bdf", "PETSc BDF 5, stabilized index 2", true, bdf));
  bdf.form = FirstOrder::Form::Index3;
  list.push_back(makeTS("bdf3", "PETSc BDF 5, index 3", false, bdf));
#if defined(HHTDAE_HAVE_IDA)
  IDASettings ida;
  list.push_back(makeIDA("ida", "IDA, stabilized index 2", false, ida));
  ida.testVelocity = true;
  list.push_back(makeIDA("ida_v", "IDA, velocities tested", true, ida));
  ida.testVelocity = false;
  ida.form         = FirstOrder::Form::Index3;
  ida.looser       = 1e6;
  list.push_back(makeIDA("ida3", "IDA, index 3", true, ida));
#endif
}

/* The first solver is the one to which all others are compared: the integrator with default settings */
inline std::vector<Solver> allSolvers()
{
  const TSHHT3Form second = TSHHT3_FORM_SECOND_ORDER, paper = TSHHT3_FORM_PAPER;
  auto form = [](TSHHT3Form f, double alpha) { return [=](TS ts) { return SetFormAndAlpha(ts, f, alpha); }; };
  std::vector<Solver> list = {
      makeHHT("hhtdae", "hhtdae, defaults", true, nullptr),
      makeHHT("second-0.3", "hhtdae, second order, {/Symbol a} = -0.3", false, form(second, -.3)),
      makeHHT("second-0.1", "hhtdae, second order, {/Symbol a} = -0.1", true, form(second, -.1)),
      makeHHT("radius0.8", "hhtdae, second order, radius 0.8", false, [](TS ts) { return SetRadius(ts, .8); }),
      makeHHT("paper-0.3", "hhtdae, paper's form, {/Symbol a} = -0.3", true, form(paper, -.3)),
      makeHHT("paper-0.1", "hhtdae, paper's form, {/Symbol a} = -0.1", false, form(paper, -.1)),
  };
  auto order = [](PetscInt k) { return [=](TS ts) { return TSHHT3SetOrder(ts, k); }; };
  list.push_back(makeHHT("auto", "hhtdae, order chosen", true, order(TSHHT3_ORDER_AUTO)));
  for (PetscInt k : {3, 4, 5}) {
    const std::string digit = std::to_string(k);
    list.push_back(makeHHT(("order" + digit).c_str(), ("hhtdae, order " + digit).c_str(), false, order(k)));
  }
  TSSettings euler;
  euler.euler = true;
  list.push_back(makeTS("euler313", "hhtdae, scenes with Euler angles", false, euler));
  euler.configure = order(TSHHT3_ORDER_AUTO);
  list.push_back(makeTS("euler_auto", "hhtdae, Euler angles, order chosen", false, euler));
  addForeign(list);
  return list;
}

/* Variations of the defaults, one at a time */
inline std::vector<Solver> sweepSolvers()
{
  std::vector<Solver> list = {makeHHT("hhtdae", "defaults", true, nullptr)};
  auto                add  = [&](const std::string &name, std::function<PetscErrorCode(TS)> configure) {
    list.push_back(makeHHT(name.c_str(), name.c_str(), false, std::move(configure)));
  };
  auto number = [](double x) {
    char text[32];
    snprintf(text, sizeof(text), "%g", x);
    return std::string(text);
  };
  for (double c : {1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 1e-4})
    add("c=" + number(c), [c](TS ts) { return TSHHT3SetCorrectorTolerance(ts, c); });
  for (int d : {-1, 0, 1, 2, 3}) add("degree=" + number(d), [d](TS ts) { return TSHHT3SetPredictorDegree(ts, d); });
  for (double ratio : {1.1, 1.2, 1.4, 1.7, 2.})
    for (double rate : {.1, .25, .5})
      for (double hold : {1., 1.2, 1.4}) {
        if ((ratio != 1.4) + (rate != .25) + (hold != 1.2) > 1) continue;
        add("reuse=" + number(ratio) + "/" + number(rate) + "/" + number(hold),
            [=](TS ts) { return TSHHT3SetReuse(ts, ratio, rate, hold); });
      }
  for (double alpha : {-1. / 3., -.3, -.2, -.1, -.05, -.02})
    add("alpha=" + number(alpha), [alpha](TS ts) { return TSHHT3SetAlpha(ts, alpha); });
  for (double radius : {0., .5, .8, .9})
    add("radius=" + number(radius), [radius](TS ts) { return SetRadius(ts, radius); });
  return list;
}

} // namespace wp

#endif
