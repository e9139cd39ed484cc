/* Matrix types that an application may supply: the run is the same as with MATAIJ, or is refused with an error that
   names the type */
#include "matrix_types.h"
#include "triangle.h"
#include <cstdio>
#include <petscdmshell.h>
#include <unistd.h>

using namespace hhtest;

namespace
{

const std::string tight = tolerance(1e-5), krylov = tight + "-ksp_type gmres -ksp_rtol 1e-12 ";

void expectSameRun(const MatrixRun &run, const MatrixRun &reference, const std::string &what)
{
  ASSERT_EQ(run.error, 0) << what << ": " << run.said;
  EXPECT_EQ(run.s.steps, reference.s.steps) << what;
  EXPECT_EQ(run.s.newton, reference.s.newton) << what;
  EXPECT_LT(relativeDifference(run.u, reference.u), 1e-7) << what;
  EXPECT_EQ(run.other, 0) << what << ": the application's Jacobian got another operator than its own";
}

void expectOperators(const Problem &p, bool setRoles)
{
  const MatrixRun reference(PETSC_COMM_SELF, p, {}, tight, setRoles);
  for (bool assembles : {true, false}) expectSameRun(MatrixRun(PETSC_COMM_SELF, p, {MATAIJ, 1, Matrices::Shell, assembles}, krylov, setRoles), reference, p.name + (assembles ? "" : ", not assembled"));
  expectSameRun(MatrixRun(PETSC_COMM_SELF, p, {MATAIJ, 1, Matrices::Second}, krylov, setRoles), reference, p.name + ", another matrix");
}

struct ShortNet : Net {
  explicit ShortNet(NetRods rods = NetRods::Independent) : Net(rods) { t1 = .1; }
};

} // namespace

/* Rows and columns of an operator J are scaled like those of the assembled matrix P */
TEST(MatrixTypes, Operators)
{
  for (bool setRoles : {true, false}) expectOperators(ShortNet(), setRoles);
  expectOperators(ShortNet(NetRods::None), false);
  expectOperators(UserVars(.2), false);
  expectOperators(Sleigh(.2), false);
}

/* A MATSHELL operator has no values that a checkpoint could store: the matrix is made again after resuming */
TEST(MatrixTypes, OperatorsResume)
{
  const ShortNet    p;
  const std::string file = "matrix_types_" + std::to_string(getpid()) + ".cp", half = krylov + "-ts_max_time .05 -ts_hhtdae_checkpoint " + file, rest = krylov + "-ts_hhtdae_resume " + file;
  const Matrices    shell{MATAIJ, 1, Matrices::Shell};
  ASSERT_EQ(MatrixRun(PETSC_COMM_SELF, p, {}, half).error, 0);
  const MatrixRun reference(PETSC_COMM_SELF, p, {}, rest);
  ASSERT_EQ(MatrixRun(PETSC_COMM_SELF, p, shell, half).error, 0);
  const MatrixRun run(PETSC_COMM_SELF, p, shell, rest);
  std::remove(file.c_str());
  ASSERT_EQ(run.error, 0) << run.said;
  EXPECT_EQ(run.s.steps, reference.s.steps);
  EXPECT_EQ(run.s.corrector_fails, 0);
  EXPECT_EQ(run.other, 0);
  EXPECT_LT(relativeDifference(run.u, reference.u), 2e-3); /* difference of the multipliers, which solves of this accuracy leave */
}

TEST(MatrixTypes, AssembledTypes)
{
  const ShortNet  p;
  const MatrixRun reference(PETSC_COMM_SELF, p, {}, tight);
  expectSameRun(MatrixRun(PETSC_COMM_SELF, p, {MATDENSE}, tight), reference, "dense");
  for (PetscInt block : {1, 2, 3}) {
    const std::string what = "blocks of " + std::to_string((int)block);
    const MatrixRun   run(PETSC_COMM_SELF, p, {MATBAIJ, block}, tight);
    if (run.package != MATSOLVERMUMPS) GTEST_SKIP() << "this PETSc was built without MUMPS";
    expectSameRun(run, reference, what);
    for (const char *options : {"", "-pc_type cholesky "}) expectSameRun(MatrixRun(PETSC_COMM_SELF, p, {MATSBAIJ, block}, tight + options), reference, what + ", one triangle " + options);
  }
}

/* PETSc's ordering of a block matrix permutes blocks; our ordering must do so as well */
TEST(MatrixTypes, OrderingsOfBlocks)
{
  const ShortNet  p, free(NetRods::None);
  const MatrixRun reference(PETSC_COMM_SELF, p, {}, tight), unheld(PETSC_COMM_SELF, free, {}, tight);
  if (MatrixRun(PETSC_COMM_SELF, p, {MATSBAIJ}, tight).package != "mumpsnd") GTEST_SKIP() << "this PETSc was built without MUMPS";
  for (PetscInt block : {1, 2, 3})
    for (const char *ordering : {"nd", "rcm", "metisnd"}) {
      const std::string options = tight + "-pc_type cholesky -pc_factor_mat_solver_type mumpsnd -pc_factor_mat_ordering_type " + ordering, what = std::string(ordering) + " of blocks of " + std::to_string((int)block);
      expectSameRun(MatrixRun(PETSC_COMM_SELF, p, {MATSBAIJ, block}, options), reference, what);
    }
  expectSameRun(MatrixRun(PETSC_COMM_SELF, free, {MATBAIJ, 3}, tight + "-pc_type lu -pc_factor_mat_solver_type petsc -pc_factor_mat_ordering_type metisnd"), unheld, "LU of blocks of 3");
}

TEST(MatrixTypes, Refusals)
{
  const ShortNet  p;
  const MatrixRun managed(PETSC_COMM_SELF, p, {MATAIJ, 1, Matrices::Managed}, krylov);
  EXPECT_NE(managed.error, 0);
  EXPECT_TRUE(managed.says("type shell without MatScale()")) << managed.said;
  for (bool setRoles : {true, false})
    for (MatType type : {MATSHELL, MATNEST}) {
      const MatrixRun run(PETSC_COMM_SELF, p, {type}, krylov, setRoles);
      EXPECT_NE(run.error, 0);
      EXPECT_TRUE(run.says(std::string("is of type ") + type + ", which gives no rows")) << run.said;
    }
}

/* A matrix whose size, or parallel layout, does not fit the solution */
TEST(MatrixTypes, OfAnotherSize)
{
  const Pendulum p(-90., 0., 1.);
  Simulation     run(p, tight);
  TSI2Jacobian   f;
  void          *ctx;
  Mat            P;
  must(TSGetI2Jacobian(run.ts, nullptr, nullptr, &f, &ctx));
  must(MatCreateSeqAIJ(PETSC_COMM_SELF, p.n + 1, p.n + 1, p.n + 1, nullptr, &P));
  must(TSSetI2Jacobian(run.ts, P, P, f, ctx));
  ErrorTrap trap;
  EXPECT_EQ(run.solve(), PETSC_ERR_ARG_SIZ);
  EXPECT_TRUE(trap.says("4 rows and 4 columns of 4, and the solution 3 entries of 3")) << trap.message;
  must(MatDestroy(&P));
}

/* Cholesky for a matrix that is not symmetric: the user's choice is kept, and a message says that it is a poor one */
TEST(MatrixTypes, CholeskyOfAnUnsymmetricMatrix)
{
  const UserVars  unsymmetric(1.);
  const Pendulum  symmetric(-90., 0., 1.);
  const Problem  *p[2] = {&unsymmetric, &symmetric};
  for (int k = 0; k < 2; k++) {
    Printed    out;
    Simulation run(*p[k], tolerance(1e-4) + "-pc_type cholesky");
    must(run.step());
    EXPECT_EQ(out.says("-pc_type cholesky takes one triangle of a matrix that is not symmetric"), k == 0) << out.text();
  }
}

/* A DMShell of the application may create a matrix of any type; one that creates none leads to an error that says so.
   x'' + 4 x = 0 */
TEST(MatrixTypes, OfADMShell)
{
  for (const bool gives : {true, false}) {
    DM  dm;
    Vec U, V;
    Mat A;
    TS  ts;
    must(VecCreateSeq(PETSC_COMM_SELF, 3, &U));
    must(VecDuplicate(U, &V));
    must(VecSet(U, 1.));
    must(VecSet(V, 0.));
    must(MatCreateSeqAIJ(PETSC_COMM_SELF, 3, 3, 1, nullptr, &A));
    for (PetscInt i = 0; i < 3; i++) must(MatSetValue(A, i, i, 0., INSERT_VALUES));
    must(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    must(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
    must(DMShellCreate(PETSC_COMM_SELF, &dm));
    if (gives) must(DMShellSetMatrix(dm, A));
    else must(DMShellSetCreateMatrix(dm, [](DM, Mat *) { return (PetscErrorCode)PETSC_ERR_SUP; }));
    must(TSCreate(PETSC_COMM_SELF, &ts));
    must(TSSetDM(ts, dm));
    must(TSSetType(ts, TSHHT3));
    must(TSSetI2Function(
        ts, nullptr, [](TS, PetscReal, Vec x, Vec, Vec a, Vec F, void *) { return VecWAXPY(F, 4., x, a); }, nullptr));
    must(TSSetI2Jacobian(
        ts, nullptr, nullptr,
        [](TS, PetscReal, Vec, Vec, Vec, PetscReal, PetscReal shift, Mat, Mat P, void *) {
          must(MatZeroEntries(P));
          return MatShift(P, 4. + shift);
        },
        nullptr));
    must(TS2SetSolution(ts, U, V));
    must(TSSetMaxTime(ts, 1.));
    must(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_MATCHSTEP));
    must(TSSetTolerances(ts, 1e-7, nullptr, 1e-7, nullptr));
    if (gives) {
      must(TSSolve(ts, nullptr));
      EXPECT_NEAR(whole(U)[1], std::cos(2.), 1e-4);
    } else {
      ErrorTrap trap;
      EXPECT_EQ(TSSolve(ts, nullptr), PETSC_ERR_ARG_WRONGSTATE);
      EXPECT_TRUE(trap.says("no DM that makes one")) << trap.message;
    }
    must(TSDestroy(&ts));
    must(DMDestroy(&dm));
    must(VecDestroy(&U));
    must(VecDestroy(&V));
    must(MatDestroy(&A));
  }
}
