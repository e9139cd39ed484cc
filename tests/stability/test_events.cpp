/* Events, roll-back, restarts, and changes of the state from outside */
#include "support.h"

using namespace hhtest;

namespace
{

/* A ball that falls from a height and bounces: q'' = -g between the bounces */
struct Ball : Problem {
  const double g = 9.81, height = 1.;
  explicit Ball(double end)
  {
    name = "ball";
    n    = 1;
    t1   = end;
    role = {TSHHT3_COORDINATE};
  }
  void initial(double *u, double *v) const override
  {
    u[0] = height;
    v[0] = 0.;
  }
  void residual(double, const double *, const double *, const double *a, double *f) const override { f[0] = a[0] + g; }
  void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
  {
    J.add(0, 0, sa);
  }
};

struct Bounces {
  std::vector<double> times;
  double              restitution;
};

#if PETSC_VERSION_LT(3, 21, 0)
using Indicator = PetscScalar;
#else
using Indicator = PetscReal;
#endif

PetscErrorCode heightOf(TS, PetscReal, Vec U, Indicator f[], void *)
{
  const PetscScalar *u;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  f[0] = PetscRealPart(u[0]);
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscFunctionReturn(0);
}

PetscErrorCode bounce(TS ts, PetscInt, PetscInt[], PetscReal t, Vec, PetscBool, void *ctx)
{
  auto *b = static_cast<Bounces *>(ctx);
  Vec   U, V;
  PetscFunctionBegin;
  b->times.push_back(t);
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(VecScale(V, -b->restitution));
  PetscCall(TSRestartStep(ts));
  PetscFunctionReturn(0);
}

} // namespace

TEST(Events, BouncingBall)
{
  const Ball          p(3.);
  Bounces             b         = {{}, .8};
  PetscInt            direction = -1;
  PetscBool           terminate = PETSC_FALSE;
  Simulation          run(p, tolerance(1e-8) + "-ts_adapt_dt_max 0.1 -ts_event_tol 1e-12");
  std::vector<double> exact;
  double              t = std::sqrt(2. * p.height / p.g), v = p.g * t;
  while (t < 3.) {
    exact.push_back(t);
    v *= b.restitution;
    t += 2. * v / p.g;
  }
  {
    Options in("-ts_event_tol 1e-12");
    must(TSSetEventHandler(run.ts, 1, &direction, &terminate, heightOf, bounce, &b));
    must(TSSetEventTolerances(run.ts, 1e-12, nullptr));
  }
  must(run.solve());
  ASSERT_EQ(b.times.size(), exact.size());
  double worst = 0.;
  for (size_t k = 0; k < exact.size(); k++) widen(worst, std::abs(b.times[k] - exact[k]));
  const TSHHT3Statistics s = run.statistics();
  MEASURED("%d bounces: times to %.1e, %d restarts, %d steps", (int)exact.size(), worst, (int)s.restarts, (int)s.steps);
  EXPECT_LT(worst, 1e-9);
  EXPECT_GE(s.restarts, (PetscInt)exact.size() + 1);
  PetscInt counted;
  must(TSGetStepNumber(run.ts, &counted));
  EXPECT_EQ(counted, s.steps);
}

/* An event on a constrained mechanism: the pendulum passes its lowest point, and the handler changes nothing */
TEST(Events, PendulumPassesItsLowestPoint)
{
  const Pendulum      p(-60., 1., 5.);
  std::vector<double> times;
  PetscInt            direction = 0;
  PetscBool           terminate = PETSC_FALSE;
  Simulation          run(p, tolerance(1e-8));
  auto                note = [](TS, PetscInt, PetscInt[], PetscReal t, Vec, PetscBool, void *ctx) -> PetscErrorCode {
    static_cast<std::vector<double> *>(ctx)->push_back(t);
    return 0;
  };
  must(TSSetEventHandler(run.ts, 1, &direction, &terminate, heightOf /* x */, note, &times));
  must(TSSetEventTolerances(run.ts, 1e-10, nullptr));
  must(run.solve());
  ASSERT_GT(times.size(), 2u);
  for (double t : times) {
    Array u(3), v(3), a(3);
    p.reference(t, u.data(), v.data(), a.data());
    EXPECT_NEAR(u[0], 0., 1e-4);
  }
  const ProblemErrors e = run.errors();
  MEASURED("pendulum with %d events: errors q %.1e, lambda %.1e; %d steps, %d tiny", (int)times.size(), e.q, e.lambda,
           (int)run.statistics().steps, (int)run.statistics().tiny_steps);
  EXPECT_LT(e.q, 1e-4);
  EXPECT_LT(e.lambda, 1e-3);
}

/* A step that is rolled back and repeated gives the same bits */
TEST(Events, RollBackRepeatsTheStep)
{
  const Pendulum pendulum(-60., 1., 1.);
  const UserVars uservars(1.);
  for (const Problem *p : {(const Problem *)&pendulum, (const Problem *)&uservars})
    for (const char *form : {"second_order", "paper"}) {
      SCOPED_TRACE(p->name + " " + form);
      Simulation run(*p, fixedSteps(.004) + "-ts_hhtdae_reuse 1,0,1 -ts_hhtdae_form " + form);
      for (int k = 0; k < 20; k++) must(run.step());
      const Array  u = run.u(), v = run.v();
      const double t = run.t();
      must(run.step());
      const Array u1 = run.u(), v1 = run.v();
      must(TSRollBack(run.ts));
      EXPECT_EQ(run.t(), t);
      EXPECT_EQ(run.u(), u);
      EXPECT_EQ(run.v(), v);
      must(run.step());
      EXPECT_EQ(run.statistics().restarts, 1);
      EXPECT_LT(relativeDifference(run.u(), u1), 1e-10);
      EXPECT_LT(relativeDifference(run.v(), v1), 1e-10);
      must(run.solve());
      EXPECT_LT(run.errors().q, p == &pendulum || std::string(form) == "second_order" ? 1e-3 : 1e-2);
    }
}

/* A step is rolled back and repeated with half its length */
TEST(Events, RollBackAndAShorterStep)
{
  const Pendulum p(-60., 1., 1.);
  Simulation     run(p, fixedSteps(.01));
  for (int k = 0; k < 20; k++) must(run.step());
  const double t = run.t();
  must(run.step());
  must(TSRollBack(run.ts));
  must(TSSetTimeStep(run.ts, .005));
  must(run.step());
  EXPECT_NEAR(run.t(), t + .005, 1e-15);
  EXPECT_LT(run.errors().q, 1e-4);
  EXPECT_EQ(run.statistics().restarts, 1);
}

TEST(Events, RestartStep)
{
  const Pendulum p(-60., 1., 2.);
  Simulation     run(p, tolerance(1e-7));
  for (int k = 0; k < 50; k++) must(run.step());
  must(TSRestartStep(run.ts));
  must(run.step());
  EXPECT_EQ(run.statistics().restarts, 2);
  must(run.solve());
  EXPECT_LT(run.errors().q, 1e-3);
  EXPECT_LT(run.errors().lambda, 1e-2);
}

/* Velocities changed in a post-step function are noticed without any call that tells the TS */
TEST(Events, ChangeInAPostStepFunctionIsNoticed)
{
  const Oscillators p({1.}, {0.}, false, 10.);
  Simulation        run(p, tolerance(1e-8));
  static double     turned;
  turned    = 0.;
  auto turn = [](TS ts) -> PetscErrorCode {
    PetscReal t;
    Vec       U, V;
    PetscFunctionBegin;
    PetscCall(TSGetTime(ts, &t));
    if (t > 2. && turned == 0.) {
      turned = t;
      PetscCall(TS2GetSolution(ts, &U, &V));
      PetscCall(VecScale(V, -1.)); /* from here the motion runs backwards */
    }
    PetscFunctionReturn(0);
  };
  must(TSSetPostStep(run.ts, turn));
  must(run.solve());
  EXPECT_EQ(run.statistics().restarts, 2);
  EXPECT_NEAR(run.u()[0], std::cos(10. - 2. * turned), 1e-3);
}

/* Reading the solution, or writing the same velocities, does not count as a change. (Write access to U in a post-step
   function is a change for PETSc itself, which then calls TSRestartStep().) */
TEST(Events, TouchingIsNoChange)
{
  const Pendulum p(-60., 1., 1.);
  Simulation     run(p, tolerance(1e-6)), plain(p, tolerance(1e-6));
  auto           touch = [](TS ts) -> PetscErrorCode {
    Vec                U, V;
    const PetscScalar *u;
    PetscScalar       *v;
    PetscFunctionBegin;
    PetscCall(TS2GetSolution(ts, &U, &V));
    PetscCall(VecGetArrayRead(U, &u));
    PetscCall(VecRestoreArrayRead(U, &u));
    PetscCall(VecGetArray(V, &v));
    PetscCall(VecRestoreArray(V, &v));
    PetscFunctionReturn(0);
  };
  must(TSSetPostStep(run.ts, touch));
  must(run.solve());
  must(plain.solve());
  EXPECT_EQ(run.statistics().restarts, 1);
  EXPECT_EQ(run.u(), plain.u());
}
