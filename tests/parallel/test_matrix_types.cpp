/* Distributed matrices of various types: the same run as with MATAIJ on one rank */
#include "matrix_types.h"
#include "triangle.h"

using namespace hhtest;

namespace
{

void expectSameRun(const MatrixRun &run, const MatrixRun &reference, const std::string &what)
{
  ASSERT_EQ(run.error, 0) << what << ": " << run.said;
  EXPECT_EQ(run.s.steps, reference.s.steps) << what;
  EXPECT_LT(relativeDifference(run.u, reference.u), 1e-7) << what;
}

} // namespace

TEST(MatrixTypesRanks, SameRunAsWithAIJ)
{
  Net               p;
  const std::string options = tolerance(1e-5);
  p.t1                      = 0.02;
  const MatrixRun self(PETSC_COMM_SELF, p, {}, options);
  Mat       A;
  PetscBool mumps;
  must(TSHHT3Initialize());
  must(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, 36, 36, 1, nullptr, 1, nullptr, &A));
  must(MatGetFactorAvailable(A, MATSOLVERMUMPS, MAT_FACTOR_LU, &mumps));
  must(MatDestroy(&A));
  if (!mumps) GTEST_SKIP() << "this PETSc was built without MUMPS";
  for (bool assembles : {true, false}) expectSameRun(MatrixRun(PETSC_COMM_WORLD, p, {MATAIJ, 1, Matrices::Shell, assembles}, options + "-ksp_type gmres -ksp_rtol 1e-12 "), self, "operator");
  for (PetscInt block : {2, 3}) {
    const MatrixRun run(PETSC_COMM_WORLD, p, {MATBAIJ, block}, options);
    EXPECT_EQ(run.package + " " + run.pc, MATSOLVERMUMPS " " PCLU);
    expectSameRun(run, self, "blocks of " + std::to_string((int)block));
    expectSameRun(MatrixRun(PETSC_COMM_WORLD, p, {MATBAIJ, block}, options + "-pc_factor_mat_solver_type mumps "), self, "the user's package, blocks of " + std::to_string((int)block));
    expectSameRun(MatrixRun(PETSC_COMM_WORLD, p, {MATSBAIJ, block}, options), self, "triangle in blocks of " + std::to_string((int)block));
  }
}

/* The rows of the matrix are distributed differently from the solution */
TEST(MatrixTypesRanks, DistributedOtherwise)
{
  const Pendulum p(-90., 0., 1.);
  Simulation     run(p, tolerance(1e-5), PETSC_COMM_WORLD);
  TSI2Jacobian   f;
  void          *ctx;
  Mat            P;
  PetscMPIInt    rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  if (size == 1) GTEST_SKIP() << "one rank has all rows";
  const PetscInt n = rank == size - 1 ? p.n : 0;
  must(TSGetI2Jacobian(run.ts, nullptr, nullptr, &f, &ctx));
  must(MatCreateAIJ(PETSC_COMM_WORLD, n, n, p.n, p.n, p.n, nullptr, p.n, nullptr, &P));
  must(TSSetI2Jacobian(run.ts, P, P, f, ctx));
  ErrorTrap trap;
  EXPECT_EQ(run.solve(), PETSC_ERR_ARG_SIZ);
  EXPECT_TRUE(trap.says("on rank 0 it has 0 rows")) << trap.message;
  must(MatDestroy(&P));
}
