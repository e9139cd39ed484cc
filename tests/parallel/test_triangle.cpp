/* A distributed Jacobian that stores one triangle (MATSBAIJ): the same run as with the full matrix on one rank */
#include "triangle.h"

using namespace hhtest;

TEST(TriangleRanks, SameRunAsWithAllOfTheMatrix)
{
  Net               p;
  const std::string options = "-ts_rtol 1e-5 -ts_atol 1e-5 ";
  Mat               A;
  PetscBool         is;
  must(TSHHT3Initialize());
  must(MatCreateSBAIJ(PETSC_COMM_WORLD, 1, PETSC_DECIDE, PETSC_DECIDE, 36, 36, 1, nullptr, 0, nullptr, &A));
  must(MatGetFactorAvailable(A, "mumpsnd", MAT_FACTOR_CHOLESKY, &is));
  must(MatDestroy(&A));
  if (!is) GTEST_SKIP() << "this PETSc was built without MUMPS";
  p.t1 = 0.02; /* few steps, because MUMPS is slow with more ranks than cores */
  const TriangleRun self(PETSC_COMM_SELF, p, 0, options, true);
  for (PetscInt block : {1, 3}) {
    const TriangleRun half(PETSC_COMM_WORLD, p, block, options, block == 1);
    expectSame(self, half);
    EXPECT_EQ(half.solver, PCCHOLESKY);
    EXPECT_GT(half.s.steps, 3);
  }
  expectSame(self, TriangleRun(PETSC_COMM_WORLD, p, 1, options + "-pc_factor_mat_solver_type mumps ", true));
}

TEST(TriangleRanks, RedundantRowsAreNamed)
{
  const Net p(NetRods::Redundant);
  ErrorTrap trap;
  EXPECT_NE(TriangleRun(PETSC_COMM_WORLD, p, 1, "", true).error, 0);
  EXPECT_TRUE(trap.says("rows 34, 35 depend on one another")) << trap.message;
}
