/* Changes of coordinates during a run: order, error, rejections, predictor, checkpoints, roll-back */
#include "integrator/state.h"
#include "tumbling.h"

#include <fstream>
#include <iterator>
#include <unistd.h>

using namespace hhtest;

namespace
{

using Errors = Tumbling::Errors;

/* A frame whose z axis is the body's y axis, about which the body rotates, so that theta stays away from 0 for a while */
const Frame steady = {{{0., 0., 1.}, {1., 0., 0.}, {0., 1., 0.}}};

struct Result {
  Errors           e;
  TSHHT3Statistics s;
};

/* Largest errors after a tenth of the run, when the transient of the start has decayed */
Result measure(const Tumbling &p, const std::string &options, int often, bool turn = true)
{
  Simulation   run(p, options);
  FrameChanges changes(run, p, often, turn);
  Result       r;
  run.watch = [&](Simulation &s, PetscInt step, double t) {
    if (!step || t < .1 * p.t1) return;
    const Errors e = p.errors(t, s.u(), s.v(), s.a());
    widen(r.e.q, e.q);
    widen(r.e.v, e.v);
    widen(r.e.a, e.a);
    widen(r.e.lambda, e.lambda);
  };
  must(run.solve());
  r.s = run.statistics();
  EXPECT_EQ(r.s.changes, changes.commits);
  EXPECT_EQ(r.s.restarts, 1);
  MEASURED("%-19s %-24s errors q %.1e q' %.1e q'' %.1e lambda %.1e; %d steps, %d rejected, %d changes, %d iterations, "
           "%d matrices",
           p.name.c_str(), options.substr(options.find("-ts_hhtdae", options.find("corrector") + 10) + 11).c_str(),
           r.e.q, r.e.v, r.e.a, r.e.lambda, (int)r.s.steps, (int)r.s.rejected, (int)r.s.changes, (int)r.s.newton,
           (int)r.s.factorizations);
  return r;
}

struct Orders {
  double q, v, a, lambda;
};

/* `often` is the number of longer steps between changes; with `sameTimes` twice as many of the shorter steps, so that
   changes are at the same times */
Orders orders(const Tumbling &p, const std::string &options, int steps, int often, bool sameTimes)
{
  const Result coarse = measure(p, fixedSteps(p.t1 / steps) + options, often),
               fine   = measure(p, fixedSteps(p.t1 / (2 * steps)) + options, sameTimes ? 2 * often : often);
  const Orders o      = {order(coarse.e.q, fine.e.q), order(coarse.e.v, fine.e.v), order(coarse.e.a, fine.e.a),
                    p.pivot ? order(coarse.e.lambda, fine.e.lambda) : 0.};
  EXPECT_GE(fine.s.changes, often ? steps / often - 1 : 3);
  MEASURED("   order q %.2f, q' %.2f, q'' %.2f, lambda %.2f", o.q, o.v, o.a, o.lambda);
  return o;
}

void expectSecondOrder(const Tumbling &p, const std::string &options, int steps)
{
  SCOPED_TRACE(p.name + " " + options);
  for (const auto &[often, sameTimes] : {std::pair{0, true}, std::pair{steps / 8, true}, std::pair{10, false}}) {
    const Orders o = orders(p, options, steps, often, sameTimes);
    for (double x : {o.q, o.v, o.a, p.pivot ? o.lambda : 2.}) {
      EXPECT_GE(x, 1.9) << often;
      EXPECT_LT(x, 2.5) << often;
    }
  }
}

struct File {
  std::string name;
  explicit File(const char *what)
      : name(testing::TempDir() + "hhtdae-" + std::to_string((long)getpid()) + "-change-" + what)
  {
  }
  ~File() { std::remove(name.c_str()); }
};

struct State {
  double t;
  Array  u, v, a;
  bool   operator==(const State &o) const { return t == o.t && u == o.u && v == o.v && a == o.a; }
};

#if PETSC_VERSION_LT(3, 21, 0)
using Indicator = PetscScalar;
#else
using Indicator = PetscReal;
#endif

} // namespace

/* The reference itself against published digits */
TEST(Change, ReferenceOfTheFreeBody)
{
  const Tumbling       p(false, 10.);
  const Vector<double> w = p.bodyRates(10.);
  EXPECT_NEAR(w[0], -.30454331665178536, 1e-13);
  EXPECT_NEAR(w[1], -.95773345367212186, 1e-13);
  EXPECT_NEAR(w[2], .19386131788581033, 1e-13);
}

TEST(Change, SecondOrderOfAFreeBody)
{
  const Tumbling p(false, 8.);
  for (const char *o : {"-ts_hhtdae_alpha -0.05", "-ts_hhtdae_alpha -0.3", "-ts_hhtdae_radius 0.5"})
    expectSecondOrder(p, o, 800);
}

/* Also for lambda and q'', which would lose accuracy if a change mapped velocities only as tangent vectors and ignored
   their drift from the constraints (drift.cpp) */
TEST(Change, SecondOrderWithConstraints)
{
  const Tumbling p(true, 2.);
  for (const char *o : {"-ts_hhtdae_alpha -0.15", "-ts_hhtdae_alpha -0.3", "-ts_hhtdae_radius 0.5"})
    expectSecondOrder(p, o, 800);
}

TEST(Change, PaperFormStaysOfFirstOrder)
{
  for (bool pivot : {false, true}) {
    const Tumbling p(pivot, pivot ? 2. : 8.);
    SCOPED_TRACE(p.name);
    for (int often : {0, 200}) {
      const Orders o = orders(p, "-ts_hhtdae_form paper", 1600, often, true);
      for (double x : {o.q, o.v, o.a, pivot ? o.lambda : 1.}) {
        EXPECT_GE(x, .85);
        EXPECT_LT(x, 1.3);
      }
    }
  }
}

/* Compared with runs in a single frame that is well suited; other frames alone may double or triple the error */
TEST(Change, ErrorsAsWithoutChanges)
{
  for (bool pivot : {false, true}) {
    const Tumbling p(pivot, pivot ? .6 : 4., steady);
    SCOPED_TRACE(p.name);
    for (const char *o : {"-ts_hhtdae_alpha -0.3", "-ts_hhtdae_radius 0.5"}) {
      const std::string options = fixedSteps(p.t1 / 1000) + o;
      const Result      one = measure(p, options, 0, false), many = measure(p, options, 10);
      EXPECT_EQ(one.s.changes, 0);
      EXPECT_GE(many.s.changes, 99);
      EXPECT_LT(many.e.q, 4. * one.e.q);
      EXPECT_LT(many.e.v, 4. * one.e.v);
      EXPECT_LT(many.e.a, 4. * one.e.a);
      if (pivot) {
        EXPECT_LT(many.e.lambda, 1.5 * one.e.lambda);
      }
    }
  }
}

/* Forced changes cause no rejections, and the results differ by an amount of the size of the tolerance */
TEST(Change, ErrorControl)
{
  for (bool pivot : {false, true})
    for (double eps : {1e-5, 1e-7}) {
      const Tumbling p(pivot, pivot ? 4. : 20.);
      SCOPED_TRACE(p.name + text(" %g", eps));
      const std::string options = tolerance(eps) + "-ts_hhtdae_corrector_tolerance 1e-3 -ts_hhtdae_alpha -0.3";
      const Result      few = measure(p, options, 0), many = measure(p, options, 10);
      EXPECT_GT(many.s.changes, few.s.changes + many.s.steps / 20);
      EXPECT_LE(many.s.rejected, few.s.rejected + 2);
      EXPECT_LT(many.s.steps, 1.2 * few.s.steps);
      EXPECT_LT(many.e.q, 1.5 * few.e.q);
      EXPECT_EQ(many.s.corrector_fails, 0);
    }
}

/* Divided differences of the predictor's values */
static void differences(const hht3::Predictor &p, std::vector<Array> &d)
{
  std::vector<Array> x;
  for (PetscInt k = 0; k <= p.available; k++) x.push_back(whole(p.X[k]));
  for (PetscInt m = 0; m <= p.available; m++) {
    d.push_back(x[0]);
    for (PetscInt k = 0; k + m < p.available; k++)
      for (size_t i = 0; i < x[k].size(); i++) x[k][i] = (x[k][i] - x[k + 1][i]) / (p.t[k] - p.t[k + m + 1]);
  }
}

/* History and state after a change equal those of a run that has used the new frame from its start: the same
   differences of the predictor, and as many iterations afterwards */
TEST(Change, HistoryAsIfAlwaysInTheNewFrame)
{
  for (bool pivot : {false, true}) {
    PetscInt all[2] = {0, 0}; /* summed, because the numbers of iterations of single runs vary by chance */
    for (const char *o :
         {"-ts_hhtdae_alpha -0.3", "-ts_hhtdae_radius 0.2", "-ts_hhtdae_form paper -ts_hhtdae_alpha -0.3"}) {
      const std::string options =
          fixedSteps(pivot ? .0025 : .01) + o + " -ts_hhtdae_predictor_degree 3 -ts_max_steps 100";
      SCOPED_TRACE((pivot ? "pivot " : "free ") + options);
      const bool         first_order = options.find("paper") != std::string::npos; /* then the two runs differ by an error of first order */
      Frame              frame{};
      std::vector<Array> history[2];
      PetscInt           before[2], after[2], degree[2];
      for (int k = 0; k < 2; k++) {
        const Tumbling    p(pivot, 10., k ? frame : identity());
        Simulation        run(p, options);
        FrameChanges      changes(run, p, 60, false); /* after the transient of the start has decayed */
        hht3::Integrator &I = hht3::Get(run.ts);
        changes.twist       = !k;
        changes.last        = 60;
        changes.afterChange = [&] {
          frame     = p.frame;
          before[k] = I.stat.newton;
          differences(I.predictor, history[k]);
          for (Vec x : {I.U0, I.V0, I.A0, I.X0}) history[k].push_back(whole(x));
        };
        must(run.solve());
        ASSERT_EQ(changes.commits, 1);
        degree[k] = I.predictor.degree;
        after[k]  = run.statistics().newton - before[k];
      }
      ASSERT_EQ(history[0].size(), 8u);
      ASSERT_EQ(history[1].size(), 8u);
      double worst[8];
      for (size_t d = 0; d < 8; d++) {
        worst[d] = relativeDifference({&history[0][d][pivot ? 3 : 0], &history[0][d][pivot ? 3 : 0] + 3},
                                      {&history[1][d][pivot ? 3 : 0], &history[1][d][pivot ? 3 : 0] + 3});
        EXPECT_LT(worst[d], d == 3 ? .2 : first_order ? .1 : 1e-2) << d;
      }
      MEASURED("%-5s D0..D3 differ by %.1e %.1e %.1e %.1e, q q' q'' a by %.1e %.1e %.1e %.1e; iterations of 40 steps "
               "after the change %d, in the new frame always %d",
               pivot ? "pivot" : "free", worst[0], worst[1], worst[2], worst[3], worst[4], worst[5], worst[6], worst[7],
               (int)after[0], (int)after[1]);
      EXPECT_EQ(degree[0], degree[1]);
      for (int k = 0; k < 2; k++) all[k] += after[k];
    }
    EXPECT_LE(all[0], 1.15 * all[1] + 2.);
  }
}

/* A change to the same coordinates gives the same bits */
TEST(Change, IdentityKeepsAllBits)
{
  for (const char *form : {"second_order", "paper"}) {
    const Tumbling p(true, .5, steady);
    Array          u[2], v[2], a[2];
    for (int forced = 0; forced < 2; forced++) {
      Simulation   run(p, fixedSteps(.005) + "-ts_hhtdae_reuse 1,0,1 -ts_hhtdae_form " + form);
      FrameChanges changes(run, p, forced ? 3 : 0, false);
      changes.twist = false;
      must(run.solve());
      EXPECT_EQ(run.statistics().changes, forced ? 33 : 0);
      u[forced] = run.u();
      v[forced] = run.v();
      a[forced] = run.a();
    }
    EXPECT_EQ(u[0], u[1]);
    EXPECT_EQ(v[0], v[1]);
    EXPECT_EQ(a[0], a[1]);
  }
}

/* Entries that a change does not map keep their bits */
TEST(Change, OtherEntriesKeepTheirBits)
{
  const Tumbling     p(true, .5, steady);
  Simulation         run(p, fixedSteps(.005));
  FrameChanges       changes(run, p, 7, false);
  hht3::Integrator  &I = hht3::Get(run.ts);
  std::vector<Array> kept;
  const auto         all = [&] {
    std::vector<Array> x = {whole(I.U0), whole(I.V0), whole(I.A0), whole(I.X0)};
    for (PetscInt k = 0; k <= I.predictor.available; k++) x.push_back(whole(I.predictor.X[k]));
    return x;
  };
  int seen             = 0;
  changes.beforeChange = [&] { kept = all(); };
  changes.afterChange  = [&] {
    const std::vector<Array> now = all();
    ASSERT_EQ(now.size(), kept.size());
    for (size_t k = 0; k < now.size(); k++)
      for (int i = 0; i < 9; i++)
        if (i < 3 || i >= 6)
          EXPECT_EQ(now[k][i], kept[k][i]) << k << " " << i;
        else
          EXPECT_NE(now[k][i], kept[k][i]) << k << " " << i;
    seen++;
  };
  must(run.solve());
  EXPECT_EQ(seen, 14);
}

TEST(Change, BeforeTheStart)
{
  for (bool pivot : {false, true}) {
    const double e[3]  = {1.5707963267948966, .01, -1.5707963267948966},
                 e0[3] = {0., 1.5707963267948966, 1.5707963267948966};
    const Tumbling p(pivot, pivot ? .5 : 2., product(transposed(rotation313(e)), rotation313(e0)));
    const Result   r = measure(p, fixedSteps(p.t1 / 500) + "-ts_hhtdae_alpha -0.3", 0);
    EXPECT_GE(r.s.changes, 1);
    EXPECT_LT(r.e.q, 1e-3);
    EXPECT_LT(r.e.a, 1e-2);
  }
}

/* A run resumed between two changes repeats the uninterrupted run bit for bit */
TEST(Change, Checkpoint)
{
  for (const char *o : {"", "-ts_hhtdae_form paper "})
    for (bool pivot : {false, true}) {
      const Tumbling    p(pivot, pivot ? 1. : 5.);
      const File        running("running"), kept("kept");
      const std::string options =
          tolerance(1e-5) + o + "-ts_hhtdae_checkpoint_every 15 -ts_hhtdae_checkpoint " + running.name + " ";
      std::vector<State> steps[2];
      TSHHT3Statistics   s[2];
      const auto note = [](std::vector<State> &to, Simulation &r, double t) { to.push_back({t, r.u(), r.v(), r.a()}); };
      SCOPED_TRACE(p.name + " " + o);
      {
        Simulation   run(p, options);
        FrameChanges changes(run, p, 10);
        run.watch = [&](Simulation &r, PetscInt step, double t) {
          if (step > 45) note(steps[0], r, t);
          if (step == 46) /* at the beginning of this step the checkpoint of step 45 was written */
            std::ofstream(kept.name, std::ios::binary) << std::ifstream(running.name, std::ios::binary).rdbuf();
        };
        must(run.solve());
        s[0] = run.statistics();
      }
      Simulation   run(p, options + "-ts_hhtdae_resume " + kept.name);
      FrameChanges changes(run, p, 10);
      run.watch = [&](Simulation &r, PetscInt step, double t) {
        if (step > 45) note(steps[1], r, t);
      };
      must(run.solve());
      s[1] = run.statistics();
      EXPECT_GT(steps[0].size(), 10u);
      EXPECT_TRUE(steps[0] == steps[1]);
      EXPECT_EQ(s[0].changes, s[1].changes);
      EXPECT_EQ(s[0].residuals, s[1].residuals);
      EXPECT_EQ(s[0].factorizations, s[1].factorizations);
      EXPECT_LT(changes.commits, s[1].changes); /* only those after the checkpoint, plus one when it was loaded */
      EXPECT_GE(changes.commits, 2);
      MEASURED("%s: %d steps after the checkpoint repeated bit for bit, %d changes", p.name.c_str(),
               (int)steps[1].size(), (int)s[1].changes);
    }
}

TEST(Change, CheckpointsOfOtherVectorsAreRefused)
{
  const Tumbling p(false, 1.);
  const File     with("with"), without("without");
  {
    Simulation   run(p, tolerance(1e-5));
    FrameChanges changes(run, p);
    must(run.step());
    must(TSHHT3CheckpointSave(run.ts, with.name.c_str()));
    must(TSHHT3SetCheckpointVec(run.ts, nullptr));
    must(TSHHT3CheckpointSave(run.ts, without.name.c_str()));
  }
  const auto refusal = [&](const File &file, PetscInt size) {
    Simulation run(p, tolerance(1e-5) + "-ts_hhtdae_resume " + file.name);
    Vec        extra;
    must(VecCreateSeq(PETSC_COMM_SELF, PetscMax(size, 1), &extra));
    if (size) must(TSHHT3SetCheckpointVec(run.ts, extra));
    must(VecDestroy(&extra));
    ErrorTrap trap;
    return run.solve() ? trap.message : std::string();
  };
  p.frame = identity();
  EXPECT_NE(refusal(with, 0).find("9 entries of the application's own"), std::string::npos);
  EXPECT_NE(refusal(with, 8).find("expects 8"), std::string::npos);
  EXPECT_NE(refusal(without, 9).find("expects 9"), std::string::npos);
  EXPECT_EQ(refusal(with, 9), "");
  EXPECT_EQ(refusal(without, 0), "");
}

/* A step rolled back after a change is repeated in the new coordinates, without another change */
TEST(Change, RollBack)
{
  for (const char *form : {"second_order", "paper"}) {
    const Tumbling p(true, 1.);
    SCOPED_TRACE(form);
    Simulation   run(p, fixedSteps(.002) + "-ts_hhtdae_reuse 1,0,1 -ts_hhtdae_form " + form);
    FrameChanges changes(run, p, 20);
    for (int k = 0; k < 20; k++) must(run.step());
    const int    commits = changes.commits;
    const Array  u = run.u(), v = run.v();
    const double t      = run.t();
    const Errors before = p.errors(t, u, v, run.a());
    must(run.step());
    ASSERT_EQ(changes.commits, commits + 1);
    const int   tests = changes.tests;
    const Array u1 = run.u(), v1 = run.v();
    must(TSRollBack(run.ts));
    EXPECT_EQ(run.t(), t);
    EXPECT_NE(run.u(), u);
    const Errors after = p.errors(t, run.u(), run.v(), run.a());
    EXPECT_NEAR(after.q, before.q, 1e-12);
    EXPECT_NEAR(after.v, before.v, 1e-12);
    must(run.step());
    EXPECT_EQ(changes.tests, tests);
    EXPECT_EQ(changes.commits, commits + 1);
    EXPECT_EQ(run.statistics().restarts, 1);
    EXPECT_LT(relativeDifference(run.u(), u1), 1e-10);
    EXPECT_LT(relativeDifference(run.v(), v1), 1e-10);
    must(run.solve());
    const Errors end = p.errors(p.t1, run.u(), run.v(), run.a());
    EXPECT_LT(end.q, std::string(form) == "paper" ? 3e-2 : 1e-3);
  }
}

/* Events are located by rolling steps back, with changes in between; here the body's z axis becomes horizontal */
TEST(Change, Events)
{
  struct Context {
    const Tumbling     *p;
    std::vector<double> times;
  };
  for (bool pivot : {false, true}) {
    const Tumbling      p(pivot, pivot ? 2. : 8.);
    std::vector<double> times[2];
    for (int forced = 0; forced < 2; forced++) {
      Context      c = {&p, {}};
      Simulation   run(p, tolerance(1e-8));
      FrameChanges changes(run, p, forced ? 2 : 0);
      PetscInt     direction = 0;
      PetscBool    terminate = PETSC_FALSE;
      const auto   height    = [](TS, PetscReal, Vec U, Indicator f[], void *ctx) -> PetscErrorCode {
        const Tumbling &b = *static_cast<Context *>(ctx)->p;
        f[0]              = product(rotation313(&whole(U)[b.at]), b.frame)[2][2]; /* third component of the z axis */
        return 0;
      };
      const auto note = [](TS, PetscInt, PetscInt[], PetscReal t, Vec, PetscBool, void *ctx) -> PetscErrorCode {
        static_cast<Context *>(ctx)->times.push_back(t);
        return 0;
      };
      must(TSSetEventHandler(run.ts, 1, &direction, &terminate, height, note, &c));
      must(TSSetEventTolerances(run.ts, 1e-10, nullptr));
      must(run.solve());
      EXPECT_GE(run.statistics().changes, forced ? 50 : 2);
      EXPECT_LT(p.errors(p.t1, run.u(), run.v(), run.a()).q, 1e-3);
      times[forced] = c.times;
    }
    ASSERT_GE(times[0].size(), 2u);
    ASSERT_EQ(times[0].size(), times[1].size());
    double worst = 0.;
    for (size_t k = 0; k < times[0].size(); k++) widen(worst, std::abs(times[0][k] - times[1][k]));
    MEASURED("%s: %d events, times with and without forced changes differ by %.1e", p.name.c_str(),
             (int)times[0].size(), worst);
    EXPECT_LT(worst, pivot ? 1e-5 : 1e-3); /* the error of the run is 2e-4 */
  }
}

/* A restart requested by the user, with changes before and after it */
TEST(Change, Restart)
{
  const Tumbling p(true, 1.);
  Simulation     run(p, tolerance(1e-7));
  FrameChanges   changes(run, p, 10);
  for (int k = 0; k < 40; k++) must(run.step());
  must(TSRestartStep(run.ts));
  must(run.solve());
  EXPECT_EQ(run.statistics().restarts, 2);
  EXPECT_LT(p.errors(p.t1, run.u(), run.v(), run.a()).q, 1e-3);
}

TEST(Change, MultipliersAreNotToBeMapped)
{
  const Tumbling p(true, 1., steady);
  Simulation     run(p, tolerance(1e-5));
  must(TSHHT3SetCoordinateChange(
      run.ts,
      [](TS ts, PetscReal, Vec, Vec, PetscBool *change, void *) -> PetscErrorCode {
        PetscInt step;
        must(TSGetStepNumber(ts, &step));
        *change = step == 5 ? PETSC_TRUE : PETSC_FALSE;
        return 0;
      },
      [](TS, PetscReal, Vec U, Vec, Vec, void *) -> PetscErrorCode { return VecScale(U, 2.); }, nullptr, nullptr));
  ErrorTrap trap;
  EXPECT_EQ(run.solve(), PETSC_ERR_ARG_WRONG);
  EXPECT_TRUE(trap.says("unknown 6")) << trap.message;
}

/* A test without a map is called once for every accepted state, but cannot change coordinates */
TEST(Change, TestWithoutMap)
{
  struct Seen {
    std::vector<double> times;
    double              until;
  };
  const auto test = [](TS, PetscReal t, Vec, Vec, PetscBool *change, void *ctx) -> PetscErrorCode {
    auto *seen = static_cast<Seen *>(ctx);
    seen->times.push_back(t);
    *change = t < seen->until ? PETSC_FALSE : PETSC_TRUE;
    return 0;
  };
  const auto     map = [](TS, PetscReal, Vec, Vec, Vec, void *) -> PetscErrorCode { return 0; };
  const Tumbling p(false, 1., steady);
  Seen           all = {{}, 2.}, some = {{}, .5};
  {
    std::vector<double> times;
    Simulation          run(p, tolerance(1e-5));
    run.watch = [&](Simulation &, PetscInt, double t) { times.push_back(t); };
    must(TSHHT3SetCoordinateChange(run.ts, test, nullptr, nullptr, &all));
    must(run.solve());
    times.resize(
        all.times.size()); /* the last state begins no step, and the monitor may have been called twice at the end */
    EXPECT_GT(times.size(), 10u);
    EXPECT_EQ(all.times, times);
  }
  Simulation run(p, tolerance(1e-5));
  ErrorTrap  trap;
  EXPECT_EQ(TSHHT3SetCoordinateChange(run.ts, nullptr, map, nullptr, nullptr), PETSC_ERR_ARG_NULL);
  EXPECT_TRUE(trap.says("a map but no test")) << trap.message;
  must(TSHHT3SetCoordinateChange(run.ts, test, nullptr, nullptr, &some));
  EXPECT_EQ(run.solve(), PETSC_ERR_ARG_WRONGSTATE);
  EXPECT_TRUE(trap.says("there is no map")) << trap.message;
}

/* With the user's -snes_lag_jacobian a matrix in the old coordinates is not used after a change */
TEST(Change, UserLag)
{
  const Tumbling p(true, 1.);
  Simulation     run(p, fixedSteps(.002) + "-snes_lag_jacobian 4");
  FrameChanges   changes(run, p, 10);
  must(run.solve());
  EXPECT_EQ(run.statistics().corrector_fails, 0);
  EXPECT_LT(p.errors(p.t1, run.u(), run.v(), run.a()).q, 1e-3);
}

TEST(Change, IsReported)
{
  for (int forced = 0; forced < 2; forced++) {
    const Tumbling p(false, 1., steady);
    Simulation     run(p, fixedSteps(.01) + "-ts_hhtdae_summary");
    FrameChanges   changes(run, p, forced ? 30 : 0, false);
    Printed        out;
    must(run.solve());
    {
      Options none("");
      must(TSView(run.ts, PETSC_VIEWER_STDOUT_SELF));
    }
    EXPECT_EQ(out.says(" changes=3\n"), forced == 1) << out.text();
    EXPECT_EQ(out.says("changes="), forced == 1) << out.text();
    EXPECT_EQ(out.says("coordinates changed at t=0.9, step 90, the last of 3 changes"), forced == 1) << out.text();
  }
}
