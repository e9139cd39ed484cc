/* Incomplete or impossible set-ups of a program are reported before the run */
#include "support.h"
#include <unistd.h>

using namespace hhtest;

TEST(FrontDoor, InitialValuesThatAreNoNumbers)
{
  const Oscillators p({1., 2.}, {.1, .1}, false, 1.);
  for (double bad : {(double)NAN, (double)INFINITY})
    for (bool velocity : {false, true}) {
      Simulation run(p, tolerance(1e-5));
      Vec        x = velocity ? run.V : run.U;
      must(VecSetValue(x, 1, bad, INSERT_VALUES));
      must(VecAssemblyBegin(x));
      must(VecAssemblyEnd(x));
      ErrorTrap trap;
      EXPECT_EQ(run.solve(), PETSC_ERR_FP);
      EXPECT_TRUE(trap.says(std::string("initial ") + (velocity ? "velocity" : "value") + " of unknown 1 is " + (std::isnan(bad) ? "not a number" : "infinite"))) << trap.message;
    }
}

TEST(FrontDoor, FirstOrderPrograms)
{
  for (bool implicit : {false, true}) {
    TS  ts;
    Vec U;
    must(VecCreateSeq(PETSC_COMM_SELF, 1, &U));
    must(VecSet(U, 1));
    must(TSCreate(PETSC_COMM_SELF, &ts));
    must(TSSetType(ts, TSHHT3));
    if (implicit) must(TSSetIFunction(ts, nullptr, [](TS, PetscReal, Vec X, Vec V, Vec F, void *) -> PetscErrorCode { return VecWAXPY(F, 1, X, V); }, nullptr));
    else must(TSSetRHSFunction(ts, nullptr, [](TS, PetscReal, Vec X, Vec F, void *) -> PetscErrorCode { return VecCopy(X, F); }, nullptr));
    must(TSSetMaxTime(ts, 1));
    ErrorTrap trap;
    EXPECT_NE(TSSolve(ts, U), 0);
    EXPECT_TRUE(trap.says("TSSetI2Function()")) << trap.message;
    EXPECT_TRUE(trap.says(implicit ? "TSSetIFunction() alone" : "TSSetRHSFunction()")) << trap.message;
    must(TSDestroy(&ts));
    must(VecDestroy(&U));
  }
}

TEST(FrontDoor, NestedVectors)
{
  const Oscillators p({1., 2.}, {.1, .1}, false, 1.);
  for (bool velocity : {false, true}) {
    Simulation run(p, tolerance(1e-5));
    Vec        part[2], nest;
    for (Vec &x : part) must(VecCreateSeq(PETSC_COMM_SELF, 1, &x));
    must(VecCreateNest(PETSC_COMM_SELF, 2, nullptr, part, &nest));
    must(VecSet(nest, 0));
    must(TS2SetSolution(run.ts, velocity ? run.U : nest, velocity ? nest : run.V));
    for (Vec &x : part) must(VecDestroy(&x));
    must(VecDestroy(&nest));
    ErrorTrap trap;
    EXPECT_EQ(run.solve(), PETSC_ERR_SUP);
    EXPECT_TRUE(trap.says(std::string("The ") + (velocity ? "time derivative of the solution" : "solution") + " is a vector of type nest")) << trap.message;
  }
}

TEST(FrontDoor, CheckpointAtTheEnd)
{
  const Oscillators p({1., 2.}, {.1, .1}, false, 1.);
  const std::string file = "front_door_" + std::to_string(getpid()) + ".cp";
  Simulation        run(p, tolerance(1e-5) + "-ts_hhtdae_checkpoint " + file);
  must(run.solve());
  ASSERT_EQ(access(file.c_str(), R_OK), 0);
  Simulation again(p, tolerance(1e-5) + "-ts_max_time 1.5 -ts_hhtdae_resume " + file);
  must(again.solve());
  EXPECT_GT(again.statistics().steps, run.statistics().steps);
  std::remove(file.c_str());
}

TEST(FrontDoor, CheckpointsThatCannotBeWritten)
{
  const Oscillators p({1., 2.}, {.1, .1}, false, 1.);
  for (const char *file : {"/no/such/directory/file", "/dev/null", "/dev/null/file"}) {
    Simulation run(p, tolerance(1e-5) + "-ts_hhtdae_checkpoint " + file);
    ErrorTrap  trap;
    EXPECT_EQ(run.solve(), PETSC_ERR_FILE_OPEN);
    EXPECT_TRUE(trap.says("No checkpoint can be written to " + std::string(file))) << trap.message;
    EXPECT_EQ(run.statistics().steps, 0);
  }
}

/* The run is shorter than the rounding of the time, or so short that 1/h^2 overflows */
TEST(FrontDoor, RunsOfNoLength)
{
  const Pendulum p(-90., 0., 1.);
  for (bool late : {false, true}) {
    Simulation run(p, tolerance(1e-5));
    must(TSSetTime(run.ts, late ? 1e15 : 0.));
    must(TSSetMaxTime(run.ts, late ? 1e15 + 1. : 1e-300));
    ErrorTrap trap;
    EXPECT_EQ(run.solve(), PETSC_ERR_ARG_OUTOFRANGE) << late;
    EXPECT_TRUE(trap.says(late ? "leaves no room for steps" : "choose a smaller unit of time")) << trap.message;
  }
}

TEST(FrontDoor, OneVectorForBoth)
{
  const Pendulum p(-90., 0., 1.);
  Simulation     run(p, tolerance(1e-5));
  must(TS2SetSolution(run.ts, run.U, run.U));
  ErrorTrap trap;
  EXPECT_EQ(run.solve(), PETSC_ERR_ARG_IDN);
  EXPECT_TRUE(trap.says("one vector for both")) << trap.message;
}

/* A SNES made by the program with SNESCreate(), without a DM and without a solution vector, is used; one with a
   function of the program is refused */
TEST(FrontDoor, ASNESOfTheProgram)
{
  const Pendulum p(-90., 0., 1.);
  Simulation     own(p, tolerance(1e-5)), given(p, tolerance(1e-5));
  Mat            J;
  SNES           snes;
  TSI2Jacobian   f;
  void          *ctx;
  must(TSGetI2Jacobian(given.ts, &J, nullptr, &f, &ctx));
  must(PetscObjectReference((PetscObject)J));
  must(SNESCreate(PETSC_COMM_SELF, &snes));
  must(TSSetSNES(given.ts, snes));
  must(SNESDestroy(&snes));
  must(TSSetI2Jacobian(given.ts, J, J, f, ctx));
  must(MatDestroy(&J));
  must(own.solve());
  must(given.solve());
  EXPECT_EQ(given.u(), own.u());
  Simulation refused(p, tolerance(1e-5));
  Vec        r;
  must(SNESCreate(PETSC_COMM_SELF, &snes));
  must(TSSetSNES(refused.ts, snes));
  must(VecDuplicate(refused.U, &r));
  must(SNESSetFunction(snes, r, [](SNES, Vec X, Vec F, void *) { return VecCopy(X, F); }, nullptr));
  ErrorTrap trap;
  EXPECT_EQ(refused.solve(), PETSC_ERR_SUP);
  EXPECT_TRUE(trap.says("SNESSetFunction()")) << trap.message;
  must(VecDestroy(&r));
  must(SNESDestroy(&snes));
}
