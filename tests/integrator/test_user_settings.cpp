/* The user's settings of TS, TSAdapt and SNES are respected: each option has the effect that it must have, or is
   reported to have none */
#include "integrator/state.h"
#include "support.h"

#include <functional>

using namespace hhtest;

namespace
{

const Pendulum &pendulum()
{
  static const Pendulum p(-90., 0., .5);
  return p;
}

struct Outcome {
  PetscErrorCode   code;
  std::string      message, printed;
  TSHHT3Statistics s;
  double           t, first, error;
  std::vector<double> times;
};

Outcome runWith(const std::string &options)
{
  Outcome    o = {};
  Simulation run(pendulum(), tolerance(1e-5) + options);
  ErrorTrap  trap;
  Printed    out;
  run.watch = [&](Simulation &, PetscInt, double t) { o.times.push_back(t); };
  o.code    = run.solve();
  o.message = trap.message;
  o.printed = out.text();
  o.s       = run.statistics();
  o.t       = run.t();
  o.first   = o.times.size() > 1 ? o.times[1] - o.times[0] : 0.;
  o.error   = o.code ? NAN : run.errors().q;
  return o;
}

int attempts(const Outcome &o) { return (int)(o.s.steps + o.s.rejected + o.s.corrector_fails + o.s.retries); }

struct Row {
  std::string                                               with, without; /* in addition to the options that both runs have */
  std::function<bool(const Outcome &with, const Outcome &without)> effect;
};

} // namespace

TEST(UserSettings, EveryOptionHasItsEffect)
{
  using O                = const Outcome &;
  const std::string test = "-snes_convergence_test default -snes_lag_jacobian 1 ";
  const Row         rows[] = {
    {"-ts_rtol 1e-8 -ts_atol 1e-8", "", [](O w, O o) { return w.s.steps > 2 * o.s.steps && w.error < o.error; }},
    {"-ts_max_steps 3", "", [](O w, O) { return w.s.steps == 3; }},
    {"-ts_max_time 0.2", "", [](O w, O) { return w.t == .2; }},
    {"-ts_init_time 0.1", "", [](O w, O) { return w.times[0] == .1; }},
    {"-ts_dt 1e-4", "", [](O w, O o) { return std::abs(w.first - 1e-4) < 1e-12 && o.first > 2e-4; }},
    {"-ts_exact_final_time stepover", "", [](O w, O o) { return w.t > .5 && o.t == .5; }},
    {"-ts_max_reject 0 -ts_dt .4", "-ts_dt .4", [](O w, O o) { return w.message.find("rejected too often") != std::string::npos && !o.code; }},
    {"-ts_max_snes_failures 1 -snes_max_it 1 -ts_dt .1", "-snes_max_it 1 -ts_dt .1",
             [](O w, O o) { return w.message.find("-ts_max_snes_failures") != std::string::npos && !o.code && o.s.corrector_fails > 0; }},
    {"-ts_max_reject 0 -ts_dt .4 -ts_error_if_step_fails 0", "", [](O w, O) { return !w.code && w.t < .4; }},
    {"-ts_adapt_type none -ts_dt 1e-2", "", [](O w, O) { return w.s.steps == 50; }},
    {"-ts_rtol 1e-8 -ts_atol 1e-8 -ts_adapt_type basic", "-ts_rtol 1e-8 -ts_atol 1e-8", [](O w, O o) { return w.s.newton != o.s.newton; }},
    {"-ts_adapt_type dsp", "", [](O w, O o) { return w.s.rejected < o.s.rejected && w.times[3] != o.times[3] && w.error < 1e-2; }},
    {"-ts_adapt_dt_max 1e-3", "", [](O w, O) { return w.s.h_max < 1.0101e-3; }},
    {"-ts_adapt_dt_min 2e-2 -ts_dt .05", "-ts_dt .05", [](O w, O o) { return w.s.rejected < o.s.rejected || w.s.steps < o.s.steps; }},
    {"-ts_adapt_safety .5", "", [](O w, O o) { return (double)w.s.steps > 1.3 * (double)o.s.steps; }},
    {"-ts_adapt_clip .1,1", "", [](O w, O o) { return w.s.h_max < 1.0101 * w.first && o.s.h_max > 2. * o.first; }},
    {"-ts_adapt_wnormtype infinity", "", [](O w, O o) { return w.s.steps > o.s.steps; }},
    {"-ts_adapt_always_accept -ts_dt .1", "-ts_dt .1", [](O w, O o) { return w.s.rejected == 0 && o.s.rejected > 0; }},
    {"-ts_adapt_scale_solve_failed .9 -snes_max_it 1 -ts_dt .1", "-snes_max_it 1 -ts_dt .1", [](O w, O o) { return w.message.find("rejected too often") != std::string::npos && !o.code; }},
    {"-snes_max_it 1", "", [](O w, O o) { return w.s.newton <= attempts(w) + 10 && o.s.newton > o.s.steps * 3 / 2; }},
    {"-snes_convergence_test skip -snes_max_it 3", "", [](O w, O) { return w.s.newton >= 3 * attempts(w) && w.error < 1e-2; }},
    {test + "-snes_rtol 1e-12", test + "-snes_rtol 1e-1", [](O w, O o) { return w.s.newton > o.s.newton + o.s.steps / 2; }},
    {test + "-snes_stol 1e-1", test, [](O w, O o) { return w.s.newton < o.s.newton; }},
    {test + "-snes_atol 1e-1", test, [](O w, O o) { return w.s.newton < o.s.newton; }},
    {test + "-snes_max_funcs 2", test, [](O w, O o) { return (w.code || w.s.corrector_fails > 0) && !o.s.corrector_fails; }},
    {"-snes_lag_jacobian 1", "", [](O w, O o) { return w.s.factorizations > 2 * o.s.factorizations; }},
    {"-snes_linesearch_type bt", "", [](O w, O o) { return w.s.residuals - w.s.newton >= o.s.residuals - o.s.newton + o.s.steps / 2 && w.error < 1e-2; }},
    {"-snes_linesearch_type basic -snes_linesearch_damping .5", "", [](O w, O o) { return w.s.newton > o.s.newton + o.s.steps; }},
    {"-snes_monitor", "", [](O w, O) { return w.printed.find("SNES Function norm") != std::string::npos; }},
    {"-snes_error_if_not_converged -snes_max_it 1 -ts_dt .1", "-snes_max_it 1 -ts_dt .1", [](O w, O o) { return w.code && !o.code; }},
    {"-ksp_type gmres -pc_type none -ksp_max_it 1", "", [](O w, O) { return w.code && w.message.find("DIVERGED_ITS") != std::string::npos; }},
  };
  for (const Row &r : rows) {
    const Outcome w = runWith(r.with), o = runWith(r.without);
    MEASURED("%-60s %d steps %d rejected %d fails %d iterations (%d %d %d %d)%s", r.with.c_str(), (int)w.s.steps, (int)w.s.rejected, (int)w.s.corrector_fails, (int)w.s.newton, (int)o.s.steps,
             (int)o.s.rejected, (int)o.s.corrector_fails, (int)o.s.newton, w.code ? " error" : "");
    EXPECT_TRUE(r.effect(w, o)) << r.with << ": " << w.message << w.printed;
  }
}

TEST(UserSettings, WhatHasNoMeaningIsSaidOnce)
{
  struct {
    const char *option, *rules;
  } rows[] = {
    {"-snes_rtol 1e-3", "-snes_convergence_test default"},
    {"-snes_atol 1e-3", "-snes_convergence_test default"},
    {"-snes_stol 1e-3", "-snes_convergence_test default"},
    {"-snes_divergence_tolerance 1e9", "-snes_convergence_test default"},
    {"-snes_max_funcs 1000", "-snes_convergence_test default"},
    {"-snes_linesearch_damping 1", "-snes_linesearch_type basic"},
    {"-snes_linesearch_maxstep 1e9", "-snes_linesearch_type bt"},
    {"-snes_linesearch_max_it 5", "-snes_linesearch_type l2"},
    {"-snes_max_fail 3", "-snes_linesearch_type bt"},
  };
  for (auto &r : rows) {
    const std::string name(r.option, strcspn(r.option, " "));
    const Outcome     alone = runWith(r.option), with = runWith(std::string(r.option) + " " + r.rules);
    const size_t      at = alone.printed.find(name + " has no effect");
    EXPECT_NE(at, std::string::npos) << r.option << ": " << alone.printed;
    EXPECT_EQ(alone.printed.find("has no effect", at + name.size() + 2), std::string::npos) << alone.printed;
    EXPECT_EQ(with.printed.find("has no effect"), std::string::npos) << r.option << ": " << with.printed;
  }
  EXPECT_EQ(runWith("").printed, "");
}

TEST(UserSettings, TolerancesSetByTheProgramAreReportedToo)
{
  Simulation run(pendulum(), tolerance(1e-5) + "-ts_max_steps 2");
  Printed    out;
  SNES       snes;
  must(TSGetSNES(run.ts, &snes));
  must(SNESSetTolerances(snes, 1e-50, 1e-12, 1e-8, 30, 10000));
  must(run.solve());
  EXPECT_TRUE(out.says("SNESSetTolerances() has no effect")) << out.text();
  EXPECT_EQ(hht3::Get(run.ts).corrector.max_it, 30); /* only the number of iterations changes */
}

TEST(UserSettings, NumberOfIterations)
{
  for (int its : {4, 25, 50}) {
    Simulation run(pendulum(), tolerance(1e-5) + text("-snes_max_it %d -ts_max_steps 2", its));
    must(run.solve());
    EXPECT_EQ(hht3::Get(run.ts).corrector.max_it, its);
  }
  Simulation plain(pendulum(), tolerance(1e-5) + "-ts_max_steps 2");
  must(plain.solve());
  EXPECT_EQ(hht3::Get(plain.ts).corrector.max_it, 10);
}

/* ---- types of TSAdapt that are not part of PETSc, or not made for this integrator ---- */

namespace
{

PetscErrorCode growByTwentieth(TSAdapt, TS, PetscReal h, PetscInt *scheme, PetscReal *next, PetscBool *accept, PetscReal *e, PetscReal *ea, PetscReal *er)
{
  *scheme = 0;
  *next   = 1.05 * h;
  *accept = PETSC_TRUE;
  *e = *ea = *er = -1;
  return 0;
}

PetscErrorCode createUsers(TSAdapt adapt)
{
  adapt->ops->choose = growByTwentieth;
  return 0;
}

} // namespace

TEST(UserSettings, TSAdaptOfTheUsers)
{
  must(TSAdaptRegister("twentieth", createUsers));
  const Outcome o = runWith("-ts_adapt_type twentieth -ts_dt 1e-3 -ts_max_steps 30");
  ASSERT_EQ(o.code, 0) << o.message;
  for (size_t i = 2; i < o.times.size(); i++) {
    const double before = o.times[i - 1] - o.times[i - 2], h = o.times[i] - o.times[i - 1];
    if (o.times[i] < .45) {
      EXPECT_NEAR(h / before, 1.05, 1e-6) << i;
    }
  }
}

TEST(UserSettings, TSAdaptOfAHistory)
{
  const Pendulum &p = pendulum();
  PetscReal       times[] = {0., 1e-3, 2.5e-3, 3e-3, 4e-3, 4.3e-3, 6e-3};
  Simulation      run(p, tolerance(1e-5) + "-ts_adapt_type history -ts_max_steps 6 -ts_exact_final_time stepover");
  TSAdapt         adapt;
  size_t          at = 0;
  must(TSGetAdapt(run.ts, &adapt));
  must(TSAdaptHistorySetHistory(adapt, 7, times, PETSC_FALSE));
  must(TSSetTimeStep(run.ts, times[1]));
  run.watch = [&](Simulation &, PetscInt, double t) {
    EXPECT_NEAR(t, times[at], 1e-12);
    at = std::min<size_t>(at + 1, 6);
  };
  must(run.solve());
  EXPECT_NEAR(run.t(), 6e-3, 1e-12);
}

TEST(UserSettings, TSAdaptByCFL)
{
  Simulation run(pendulum(), tolerance(1e-5) + "-ts_adapt_type cfl -ts_adapt_always_accept -ts_dt 1e-3 -ts_max_steps 20 -ts_exact_final_time stepover");
  must(TSSetCFLTimeLocal(run.ts, 2e-3));
  must(run.solve());
  EXPECT_NEAR(run.t(), 1e-3 + 19 * .9 * 2e-3, 1e-9);
}

TEST(UserSettings, TSAdaptGleeIsRefused)
{
  const Outcome o = runWith("-ts_adapt_type glee");
  EXPECT_EQ(o.code, PETSC_ERR_SUP);
  EXPECT_NE(o.message.find("-ts_adapt_type glee"), std::string::npos) << o.message;
}

TEST(UserSettings, StagesAreCheckedByTheUser)
{
  Simulation run(pendulum(), tolerance(1e-5) + "-ts_dt 1e-2");
  TSAdapt    adapt;
  must(TSGetAdapt(run.ts, &adapt));
  must(TSAdaptSetCheckStage(adapt, [](TSAdapt, TS ts, PetscReal, Vec, PetscBool *accept) {
    PetscReal h;
    must(TSGetTimeStep(ts, &h));
    *accept = (PetscBool)(h < 2e-3);
    return (PetscErrorCode)0;
  }));
  must(run.solve());
  EXPECT_LT(run.statistics().h_max, 2e-3);
}
