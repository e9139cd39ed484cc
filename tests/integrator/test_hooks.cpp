/* What the integrator puts into a SNES (convergence test, line search, functions) is removed by TSReset(), TSDestroy()
   and a change of type, and the user's settings are restored */
#include "integrator/step/corrector.h"
#include "support.h"
#include <cstdio>
#include <petscdmda.h>
#include <unistd.h>

using namespace hhtest;

namespace
{

SNES snesOf(TS ts)
{
  SNES snes;
  must(TSGetSNES(ts, &snes));
  return snes;
}

std::string lineSearchOf(SNES snes)
{
  SNESLineSearch ls;
  must(SNESGetLineSearch(snes, &ls));
  const char *type = ((PetscObject)ls)->type_name;
  return type ? type : "";
}

/* Restores the initial state of the problem */
void rewind(Simulation &run)
{
  const Problem &p = run.problem;
  Array          u0(p.n), v0(p.n);
  p.initial(u0.data(), v0.data());
  const std::pair<Vec, Array *> x[2] = {{run.U, &u0}, {run.V, &v0}};
  for (auto &y : x) {
    for (PetscInt i = 0; i < p.n; i++) must(VecSetValue(y.first, i, (*y.second)[i], INSERT_VALUES));
    must(VecAssemblyBegin(y.first));
    must(VecAssemblyEnd(y.first));
  }
  must(TS2SetSolution(run.ts, run.U, run.V));
  must(TSSetTime(run.ts, p.t0));
  must(TSSetStepNumber(run.ts, 0));
  must(TSSetTimeStep(run.ts, 1e-3));
}

PetscErrorCode thirdIteration(SNES, PetscInt it, PetscReal, PetscReal, PetscReal, SNESConvergedReason *reason, void *ctx)
{
  ++*static_cast<int *>(ctx);
  *reason = it >= 3 ? SNES_CONVERGED_ITS : SNES_CONVERGED_ITERATING;
  return 0;
}

const Oscillators &springs()
{
  static const Oscillators p({1., 3.}, {0., .1}, true, 1.);
  return p;
}

} // namespace

/* The program continues with another TS type; the monitors of hhtdae, still registered, do nothing */
TEST(Hooks, AnotherTypeAfterSteps)
{
  Simulation run(springs(), tolerance(1e-6) + "-ts_hhtdae_summary -ts_hhtdae_progress");
  Printed    out;
  must(run.solve());
  const Array u = run.u();
  must(TSSetType(run.ts, TSALPHA2));
  EXPECT_EQ(lineSearchOf(snesOf(run.ts)), SNESLINESEARCHBT);
  PetscInt lag;
  must(SNESGetLagJacobian(snesOf(run.ts), &lag));
  EXPECT_EQ(lag, 1);
  rewind(run);
  must(run.solve());
  EXPECT_LT(relativeDifference(run.u(), u), 1e-4);
  must(TSSetType(run.ts, TSHHT3));
  rewind(run);
  must(run.solve());
  EXPECT_LT(relativeDifference(run.u(), u), 1e-4);
  EXPECT_GT(run.statistics().steps, 0);
}

/* Monitors of hhtdae that are called under another TS type must not use its data, even if these look like an
   integrator with a checkpoint to write */
TEST(Hooks, MonitorsOfAnotherType)
{
  const std::string checkpoint = testing::TempDir() + "hhtdae-hooks-" + std::to_string((long)getpid());
  Simulation        run(springs(), tolerance(1e-4) + "-ts_hhtdae_checkpoint " + checkpoint);
  must(run.solve());
  EXPECT_EQ(std::remove(checkpoint.c_str()), 0);
  must(TSSetType(run.ts, TSALPHA2));
  hht3::Integrator looks_alike;
  looks_alike.have_step = PETSC_TRUE;
  checkpoint.copy(looks_alike.checkpoint_file, checkpoint.size());
  void *data   = run.ts->data;
  run.ts->data = &looks_alike;
  EXPECT_EQ(TSMonitor(run.ts, 1, run.t(), run.U), 0);
  run.ts->data = data;
  EXPECT_NE(std::remove(checkpoint.c_str()), 0);
}

TEST(Hooks, AnotherTypeBeforeSetUp)
{
  Simulation run(springs(), tolerance(1e-6) + "-ts_dt 1e-3");
  must(TSSetType(run.ts, TSALPHA2));
  must(run.solve());
  EXPECT_LT(run.errors().q, 1e-3);
}

/* Also after a run with Jacobians by differences */
TEST(Hooks, AnotherTypeAfterDifferences)
{
  Simulation run(springs(), tolerance(1e-6) + "-snes_fd_color");
  must(run.solve());
  const Array u = run.u();
  must(TSSetType(run.ts, TSALPHA2));
  rewind(run);
  must(run.solve());
  EXPECT_LT(relativeDifference(run.u(), u), 1e-4);
}

/* Without any Jacobian the SNES of another type makes its own differences, whatever hhtdae had put into it */
TEST(Hooks, AnotherTypeWithoutAJacobian)
{
  for (const bool reset : {false, true})
    for (const bool options : {false, true}) {
      Simulation   run(springs(), tolerance(1e-6));
      TSI2Function function;
      void        *ctx;
      Vec          F;
      const TS     given = run.ts;
      TS           ts;
      must(TSGetI2Function(given, nullptr, &function, &ctx));
      must(VecDuplicate(run.U, &F));
      must(TSCreate(PETSC_COMM_SELF, &ts));
      must(TSSetType(ts, TSHHT3));
      must(TSSetI2Function(ts, F, function, ctx));
      must(TS2SetSolution(ts, run.U, run.V));
      must(TSSetMaxTime(ts, springs().t1));
      must(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_MATCHSTEP));
      must(TSSetTolerances(ts, 1e-6, nullptr, 1e-6, nullptr));
      must(TSSolve(ts, run.U));
      const Array u = run.u();
      run.ts        = ts;
      if (reset) must(TSReset(ts));
      must(TSSetType(ts, TSALPHA2));
      rewind(run);
      if (options) must(TSSetFromOptions(ts));
      must(TSSolve(ts, run.U));
      EXPECT_LT(relativeDifference(run.u(), u), 1e-4) << reset << options;
      must(TSSetType(ts, TSHHT3)); /* back to hhtdae, with a dense matrix in the SNES */
      rewind(run);
      must(TSSolve(ts, run.U));
      EXPECT_LT(relativeDifference(run.u(), u), 1e-4) << reset << options;
      run.ts = given;
      must(TSDestroy(&ts));
      must(VecDestroy(&F));
    }
}

/* KSP and PC types chosen by the integrator are removed with a change of type; those set by the user stay */
TEST(Hooks, SolversOfAnotherType)
{
  for (const bool set : {false, true}) {
    Simulation run(springs(), tolerance(1e-6) + (set ? "-ksp_type gmres -pc_type jacobi" : ""));
    KSP        ksp;
    PC         pc;
    must(run.solve());
    const Array u = run.u();
    must(TSSetType(run.ts, TSALPHA2));
    must(SNESGetKSP(snesOf(run.ts), &ksp));
    must(KSPGetPC(ksp, &pc));
    KSPType method;
    PCType  type;
    must(KSPGetType(ksp, &method));
    must(PCGetType(pc, &type));
    EXPECT_STREQ(method, set ? KSPGMRES : nullptr);
    EXPECT_STREQ(type, set ? PCJACOBI : nullptr);
    rewind(run);
    must(run.solve());
    EXPECT_LT(relativeDifference(run.u(), u), 1e-4) << set;
    must(TSSetType(run.ts, TSHHT3)); /* back to hhtdae */
    rewind(run);
    must(run.solve());
    EXPECT_LT(relativeDifference(run.u(), u), 1e-4) << set;
  }
}

TEST(Hooks, GoWithReset)
{
  Simulation run(springs(), tolerance(1e-5));
  const SNES snes = snesOf(run.ts);
  must(run.solve());
  EXPECT_EQ(snes->ops->converged, hht3::SNESConverged_HHT);
  must(TSReset(run.ts));
  EXPECT_EQ(snes->ops->converged, SNESConvergedDefault);
  EXPECT_EQ(snes->cnvP, nullptr);
  EXPECT_EQ(lineSearchOf(snes), SNESLINESEARCHBT);
  PetscInt lag;
  must(SNESGetLagJacobian(snes, &lag));
  EXPECT_EQ(lag, 1);
}

/* After TSReset() a run starts afresh even if the step number is not 0 */
TEST(Hooks, AnotherSetUpAfterReset)
{
  Simulation run(springs(), tolerance(1e-5));
  must(run.solve());
  const Array u = run.u();
  const SNES  snes = snesOf(run.ts);
  Mat         J;
  Vec         A;
  must(SNESGetJacobian(snes, &J, nullptr, nullptr, nullptr));
  must(PetscObjectReference((PetscObject)J));
  must(TSReset(run.ts));
  {
    ErrorTrap trap;
    EXPECT_EQ(TSHHT3GetAcceleration(run.ts, &A), PETSC_ERR_ARG_WRONGSTATE);
  }
  must(SNESSetJacobian(snes, J, J, nullptr, nullptr));
  must(MatDestroy(&J));
  rewind(run);
  must(TSSetStepNumber(run.ts, 7));
  must(run.solve());
  EXPECT_LT(relativeDifference(run.u(), u), 1e-4);
  EXPECT_EQ(run.statistics().restarts, 1);
  EXPECT_EQ(lineSearchOf(snes), SNESLINESEARCHSHELL); /* the backtracking search that PETSc chose in between is not a choice of the user */
}

/* A SNES that the user has created outlives the TS, with the user's convergence test restored */
TEST(Hooks, SharedSNESOutlivesTheTS)
{
  SNES snes;
  int  asked = 0;
  Vec  x, r;
  Mat  J;
  {
    Simulation run(springs(), tolerance(1e-5));
    snes = snesOf(run.ts);
    must(PetscObjectReference((PetscObject)snes));
    must(run.solve());
  }
  EXPECT_EQ(snes->ops->converged, SNESConvergedDefault);
  must(SNESReset(snes));
  must(VecCreateSeq(PETSC_COMM_SELF, 1, &x));
  must(VecDuplicate(x, &r));
  must(MatCreateSeqAIJ(PETSC_COMM_SELF, 1, 1, 1, nullptr, &J));
  must(SNESSetFunction(
      snes, r,
      [](SNES, Vec y, Vec f, void *) {
        must(VecPointwiseMult(f, y, y));
        must(VecShift(f, -2.));
        return (PetscErrorCode)0;
      },
      nullptr));
  must(SNESSetJacobian(
      snes, J, J,
      [](SNES, Vec y, Mat, Mat P, void *) {
        const PetscScalar *a;
        must(VecGetArrayRead(y, &a));
        must(MatSetValue(P, 0, 0, 2. * a[0], INSERT_VALUES));
        must(VecRestoreArrayRead(y, &a));
        must(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
        must(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
        return (PetscErrorCode)0;
      },
      nullptr));
  must(VecSet(x, 1.));
  must(SNESSolve(snes, nullptr, x));
  EXPECT_NEAR(whole(x)[0], std::sqrt(2.), 1e-7);
  must(SNESSetConvergenceTest(snes, thirdIteration, &asked, nullptr));
  must(SNESSolve(snes, nullptr, x));
  EXPECT_EQ(asked, 4);
  must(SNESDestroy(&snes));
  must(VecDestroy(&x));
  must(VecDestroy(&r));
  must(MatDestroy(&J));
}

/* Two TS share one SNES and make steps in turn */
TEST(Hooks, OneSNESForTwoTS)
{
  const Pendulum p(-90., 0., .5), q(-60., 1., .5);
  const auto     options = fixedSteps(1e-3) + "-ts_exact_final_time stepover ";
  Simulation     a(p, options), b(q, options), c(p, options), d(q, options);
  must(TSSetSNES(b.ts, snesOf(a.ts)));
  for (int k = 0; k < 20; k++)
    for (Simulation *run : {&a, &b, &c, &d}) {
      must(run->step());
      EXPECT_EQ(lineSearchOf(snesOf(run->ts)), SNESLINESEARCHSHELL);
    }
  EXPECT_LT(relativeDifference(a.u(), c.u()), 1e-7); /* each step makes its own matrix */
  EXPECT_LT(relativeDifference(b.u(), d.u()), 1e-7);
  must(TSDestroy(&a.ts)); /* resets the SNES and its matrix; the DM then creates a new one */
  for (int k = 0; k < 20; k++)
    for (Simulation *run : {&b, &d}) must(run->step());
  EXPECT_LT(relativeDifference(b.u(), d.u()), 3e-7);
}

/* The TS gets another SNES in the middle of a run */
TEST(Hooks, AnotherSNESBetweenSteps)
{
  const Pendulum p(-90., 0., .5);
  const auto     options = tolerance(1e-6) + "-ts_dt 1e-3 -ts_exact_final_time stepover ";
  Simulation     run(p, options), plain(p, options);
  for (int k = 0; k < 10; k++) must(run.step());
  SNES snes;
  Mat  J;
  must(SNESGetJacobian(snesOf(run.ts), &J, nullptr, nullptr, nullptr));
  must(SNESCreate(PETSC_COMM_SELF, &snes));
  must(SNESSetJacobian(snes, J, J, SNESTSFormJacobian, run.ts));
  must(TSSetSNES(run.ts, snes));
  must(SNESDestroy(&snes));
  for (int k = 0; k < 10; k++) must(run.step());
  for (int k = 0; k < 20; k++) must(plain.step());
  EXPECT_LT(relativeDifference(run.u(), plain.u()), 1e-4);
}

/* The TS gets another matrix in the middle of a run, which is not assembled yet, or whose nonzero pattern is that of
   the differences from then on */
TEST(Hooks, AnotherMatrixBetweenSteps)
{
  const Pendulum p(-90., 0., .5);
  for (const char *more : {"", "-snes_fd_color"}) {
    const auto   options = tolerance(1e-6) + "-ts_dt 1e-3 -ts_exact_final_time stepover " + more;
    Simulation   run(p, options), plain(p, options);
    TSI2Jacobian f;
    void        *ctx;
    Mat          P, now;
    Vec          A, B;
    must(VecDuplicate(run.U, &A));
    must(VecDuplicate(run.U, &B));
    for (int k = 0; k < 10; k++) must(run.step());
    must(TSHHT3EvaluateAt(run.ts, run.t() - 1e-4, nullptr, nullptr, A));
    must(TSGetI2Jacobian(run.ts, nullptr, nullptr, &f, &ctx));
    must(MatCreateSeqAIJ(PETSC_COMM_SELF, p.n, p.n, p.n, nullptr, &P));
    if (*more) {
      for (PetscInt i = 0; i < p.n; i++)
        for (PetscInt j = 0; j < p.n; j++) must(MatSetValue(P, i, j, 0., INSERT_VALUES));
      must(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
      must(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
    }
    must(TSSetI2Jacobian(run.ts, P, P, f, ctx));
    for (int k = 0; k < 10; k++) must(run.step());
    for (int k = 0; k < 20; k++) must(plain.step());
    must(SNESGetJacobian(snesOf(run.ts), nullptr, &now, nullptr, nullptr));
    EXPECT_EQ(now, P);
    EXPECT_EQ(run.statistics().corrector_fails + run.statistics().retries, 0);
    EXPECT_LT(relativeDifference(run.u(), plain.u()), 1e-4);
    const double t = std::min(run.t(), plain.t()) - 1e-4;
    must(TSHHT3EvaluateAt(run.ts, t, nullptr, nullptr, A));
    must(TSHHT3EvaluateAt(plain.ts, t, nullptr, nullptr, B));
    EXPECT_LT(relativeDifference(whole(A), whole(B)), 1e-3);
    must(MatDestroy(&P));
    must(VecDestroy(&A));
    must(VecDestroy(&B));
  }
}

/* A convergence test set by the user is used, and its context is destroyed exactly once, with the SNES */
TEST(Hooks, UsersTestStays)
{
  static int destroyed;
  destroyed = 0;
  int asked = 0;
  {
    Simulation run(springs(), tolerance(1e-5) + "-ts_dt 0.01 -ts_max_steps 5");
    const SNES snes = snesOf(run.ts);
    must(SNESSetConvergenceTest(snes, thirdIteration, &asked, [](void *) {
      destroyed++;
      return (PetscErrorCode)0;
    }));
    must(run.solve());
    EXPECT_GE(asked, 20);
    EXPECT_GE(run.statistics().newton, 15);
    must(TSReset(run.ts));
    EXPECT_EQ(snes->ops->converged, thirdIteration);
    EXPECT_EQ(destroyed, 0);
  }
  EXPECT_EQ(destroyed, 1);
}

/* A monitor may evaluate the Jacobian, for example the mass matrix, in the matrices of the TS; the result must not be
   used as Newton matrix */
TEST(Hooks, MonitorsThatEvaluateTheJacobian)
{
  const Pendulum p(-90., 0., 1.);
  const auto     options = tolerance(1e-7), file = "hooks_" + std::to_string(getpid()) + ".cp";
  const auto     look = [](Simulation &r, PetscInt, double t) {
    Mat J, P;
    Vec A;
    must(VecDuplicate(r.U, &A));
    must(VecZeroEntries(A));
    must(TSGetI2Jacobian(r.ts, &J, &P, nullptr, nullptr));
    must(TSComputeI2Jacobian(r.ts, t, r.U, r.V, A, 0., 1., J, P));
    must(VecDestroy(&A));
  };
  Simulation plain(p, options), run(p, options);
  run.watch = look;
  must(plain.solve());
  must(run.solve());
  EXPECT_LE(run.statistics().retries, plain.statistics().retries);
  EXPECT_LT(run.errors().q, 4. * plain.errors().q);
  Simulation first(p, options + "-ts_max_time .5 -ts_hhtdae_checkpoint " + file), through(p, options), rest(p, options + "-ts_hhtdae_resume " + file); /* nor is it in a checkpoint */
  for (Simulation *r : {&first, &through, &rest}) r->watch = look;
  must(first.solve());
  must(TSSetMaxTime(through.ts, .5));
  must(through.solve());
  must(TSSetMaxTime(through.ts, 1.));
  must(through.solve());
  must(rest.solve());
  std::remove(file.c_str());
  for (int k = 0; k < 3; k++) EXPECT_NEAR(rest.u()[k], through.u()[k], 1e-8) << k; /* pivots are chosen again, so that the last digits differ */
}

namespace
{

/* q'' + q^3 = 0 from q = 2, with a given DM */
struct OnDM {
  TS  ts;
  Vec U, V;
  explicit OnDM(DM dm)
  {
    must(DMCreateGlobalVector(dm, &U));
    must(VecDuplicate(U, &V));
    must(VecSet(U, 2.));
    must(TSCreate(PETSC_COMM_SELF, &ts));
    must(TSSetType(ts, TSHHT3));
    must(TSSetDM(ts, dm));
    must(TSSetI2Function(
        ts, nullptr,
        [](TS, PetscReal, Vec U, Vec, Vec A, Vec F, void *) -> PetscErrorCode {
          PetscFunctionBegin;
          PetscCall(VecPointwiseMult(F, U, U));
          PetscCall(VecPointwiseMult(F, F, U));
          PetscCall(VecAXPY(F, 1., A));
          PetscFunctionReturn(0);
        },
        nullptr));
    must(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_MATCHSTEP));
    must(TSSetFromOptions(ts));
    must(TS2SetSolution(ts, U, V));
  }
  ~OnDM()
  {
    TSDestroy(&ts);
    VecDestroy(&U);
    VecDestroy(&V);
  }
  OnDM(const OnDM &) = delete;
  void to(double end)
  {
    must(TSSetMaxTime(ts, end));
    must(TSSolve(ts, U));
  }
};

/* x + x^3 = 10 */
void solveStatic(SNES snes, Vec x)
{
  must(SNESSolve(snes, nullptr, x));
  EXPECT_NEAR(whole(x)[0], 2., 1e-6);
}

} // namespace

/* PETSc stores the functions of a SNES in its DM. Two solvers that share a DM nevertheless each use their own
   functions in the steps */
TEST(Hooks, TwoSolversOnOneDM)
{
  DM   dm;
  SNES snes;
  Vec  x, r;
  must(DMDACreate1d(PETSC_COMM_SELF, DM_BOUNDARY_NONE, 4, 1, 1, nullptr, &dm));
  must(DMSetUp(dm));
  Options in(tolerance(1e-5));
  OnDM    alone(dm);
  alone.to(.5);
  alone.to(1.);
  {
    OnDM a(dm), b(dm);
    for (double t : {.5, 1.})
      for (OnDM *run : {&a, &b}) run->to(t);
    EXPECT_EQ(whole(a.U), whole(alone.U));
    EXPECT_EQ(whole(b.U), whole(alone.U));
  }
  OnDM c(dm);
  c.to(.5);
  {
    OnDM gone(dm);
    gone.to(.5);
  }
  c.to(1.);
  EXPECT_EQ(whole(c.U), whole(alone.U));
  OnDM d(dm);
  d.to(.5);
  must(DMCreateGlobalVector(dm, &x));
  must(VecDuplicate(x, &r));
  must(SNESCreate(PETSC_COMM_SELF, &snes));
  must(SNESSetDM(snes, dm));
  must(SNESSetFunction(
      snes, r,
      [](SNES, Vec X, Vec F, void *) -> PetscErrorCode {
        PetscFunctionBegin;
        PetscCall(VecPointwiseMult(F, X, X));
        PetscCall(VecPointwiseMult(F, F, X));
        PetscCall(VecAXPY(F, 1., X));
        PetscCall(VecShift(F, -10.));
        PetscFunctionReturn(0);
      },
      nullptr));
  solveStatic(snes, x);
  {
    Printed said;
    d.to(.8);
    d.to(1.);
    EXPECT_TRUE(said.says("DMClone()")) << said.text();
    EXPECT_EQ(said.text().find("DMClone()"), said.text().rfind("DMClone()"));
  }
  EXPECT_LT(relativeDifference(whole(d.U), whole(alone.U)), 1e-2);
  must(VecSet(x, 0.));
  solveStatic(snes, x);
  {
    OnDM other(dm); /* beside a second TS with differences of its own, which still exists */
    must(TSSetType(other.ts, TSALPHA2));
    must(TSSetTimeStep(other.ts, .01));
    other.to(.5);
    OnDM again(dm);
    again.to(.5);
    EXPECT_LT(relativeDifference(whole(other.U), whole(again.U)), 1e-2);
  }
  must(SNESDestroy(&snes));
  must(VecDestroy(&x));
  must(VecDestroy(&r));
  must(DMDestroy(&dm));
}

/* A SNES function of the user that calls the integrator's is refused: it could add forces to the steps which the
   consistent start does not contain */
TEST(Hooks, FunctionAroundOurs)
{
  const Pendulum p(-90., 0., 1.);
  Simulation     run(p, tolerance(1e-5));
  must(SNESSetFunction(
      snesOf(run.ts), nullptr, [](SNES snes, Vec X, Vec F, void *ts) -> PetscErrorCode { return SNESTSFormFunction(snes, X, F, ts); }, run.ts));
  ErrorTrap trap;
  EXPECT_EQ(run.solve(), PETSC_ERR_SUP);
  EXPECT_TRUE(trap.says("TSSetI2Function()")) << trap.message;
}

/* A clone made before the first solve shares the SNES of a TS whose options have been read */
TEST(Hooks, CloneBeforeTheFirstSolve)
{
  const Pendulum p(-90., 0., .5);
  Simulation     run(p, tolerance(1e-5)), plain(p, tolerance(1e-5));
  TS             clone;
  Vec            U, V;
  must(VecDuplicate(run.U, &U));
  must(VecDuplicate(run.U, &V));
  must(VecCopy(run.U, U));
  must(VecCopy(run.V, V));
  must(TSClone(run.ts, &clone));
  must(TS2SetSolution(clone, U, V));
  must(TSSetExactFinalTime(clone, TS_EXACTFINALTIME_MATCHSTEP));
  must(TSSetMaxTime(clone, p.t1));
  must(TSSetTolerances(clone, 1e-5, nullptr, 1e-5, nullptr));
  must(TSSolve(clone, U));
  must(plain.solve());
  EXPECT_LT(relativeDifference(whole(U), plain.u()), 1e-3);
  must(TSDestroy(&clone));
  must(run.solve());
  EXPECT_LT(relativeDifference(run.u(), plain.u()), 1e-6);
  must(VecDestroy(&U));
  must(VecDestroy(&V));
}
