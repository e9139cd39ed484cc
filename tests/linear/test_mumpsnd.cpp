/* MUMPS with our ordering: solutions, options, singular matrices, many right-hand sides */
#include "linear/linear.h"
#include "bench/linear_matrices.h"
#include <gtest/gtest.h>
#include <hhtdae/hhtdae.h>
#include <petsc/private/matimpl.h>
#include <string>

#define OK(call) ASSERT_EQ((call), 0)

namespace
{

/* Solves with this factorization; returns the residual relative to the right-hand side */
double residual_with(Mat A, const char pc_type[], const char package[], const char ordering[], bool transposed = false)
{
  KSP       ksp;
  PC        pc;
  Vec       b, x, r;
  PetscReal norm, scale;
  EXPECT_EQ(MatCreateVecs(A, &x, &b), 0);
  EXPECT_EQ(VecDuplicate(b, &r), 0);
  EXPECT_EQ(VecSetRandom(b, NULL), 0);
  EXPECT_EQ(KSPCreate(PETSC_COMM_SELF, &ksp), 0);
  EXPECT_EQ(KSPSetType(ksp, KSPPREONLY), 0);
  EXPECT_EQ(KSPGetPC(ksp, &pc), 0);
  EXPECT_EQ(PCSetType(pc, pc_type), 0);
  EXPECT_EQ(PCFactorSetMatSolverType(pc, package), 0);
  if (ordering) {
    EXPECT_EQ(PCFactorSetMatOrderingType(pc, ordering), 0);
  }
  EXPECT_EQ(KSPSetOperators(ksp, A, A), 0);
  if (transposed) {
    EXPECT_EQ(KSPSolveTranspose(ksp, b, x), 0);
    EXPECT_EQ(MatMultTranspose(A, x, r), 0);
  } else {
    EXPECT_EQ(KSPSolve(ksp, b, x), 0);
    EXPECT_EQ(MatMult(A, x, r), 0);
  }
  EXPECT_EQ(VecNorm(b, NORM_2, &scale), 0);
  EXPECT_EQ(VecAXPY(r, -1.0, b), 0);
  EXPECT_EQ(VecNorm(r, NORM_2, &norm), 0);
  EXPECT_EQ(KSPDestroy(&ksp), 0);
  EXPECT_EQ(VecDestroy(&x), 0);
  EXPECT_EQ(VecDestroy(&b), 0);
  EXPECT_EQ(VecDestroy(&r), 0);
  return norm / scale;
}

bool has(Mat A, const char package[], MatFactorType type)
{
  PetscBool available;
  EXPECT_EQ(MatGetFactorAvailable(A, package, type, &available), 0);
  return available;
}

class MumpsND : public testing::Test
{
protected:
  Mat A;

  void SetUp() override
  {
    Triplets entries = block(6, 6, 6, true);
    OK(create_matrix(entries, &A));
    if (!has(A, "mumpsnd", MAT_FACTOR_LU)) GTEST_SKIP() << "this PETSc was built without MUMPS";
  }
  void TearDown() override { OK(MatDestroy(&A)); }
};

TEST_F(MumpsND, Solves)
{
  EXPECT_LT(residual_with(A, PCLU, "mumpsnd", NULL), 1e-12);
  EXPECT_LT(residual_with(A, PCCHOLESKY, "mumpsnd", NULL), 1e-12);
  EXPECT_LT(residual_with(A, PCCHOLESKY, "mumpsnd", MATORDERINGMETISND), 1e-12);
  OK(MatSetValue(A, 0, 1, 5.0, INSERT_VALUES)); /* unsymmetric */
  OK(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  OK(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  EXPECT_LT(residual_with(A, PCLU, "mumpsnd", NULL), 1e-12);
  EXPECT_LT(residual_with(A, PCLU, "mumpsnd", NULL, true), 1e-12);
}

TEST_F(MumpsND, OptionsReachMUMPS)
{
  Mat           F;
  MatFactorInfo info;
  PetscInt      used;
  IS            row, col;
  OK(PetscOptionsInsertString(NULL, "-mat_mumps_icntl_7 2 -mat_mumps_icntl_14 77"));
  OK(MatGetOrdering(A, MATORDERINGEXTERNAL, &row, &col));
  OK(MatFactorInfoInitialize(&info));
  OK(MatGetFactor(A, "mumpsnd", MAT_FACTOR_LU, &F));
  OK(MatLUFactorSymbolic(F, A, row, col, &info));
  OK(MatMumpsGetInfog(F, 7, &used));
  EXPECT_EQ(used, 2); /* AMF */
  OK(MatMumpsGetIcntl(F, 14, &used));
  EXPECT_EQ(used, 77);
  OK(MatDestroy(&F));
  OK(PetscOptionsClearValue(NULL, "-mat_mumps_icntl_7"));
  OK(PetscOptionsClearValue(NULL, "-mat_mumps_icntl_14"));
}

/* None of MUMPS' built-in orderings takes fewer operations than the ordering that we pass */
TEST_F(MumpsND, OrderingIsNoWorseThanTheBuiltInOnes)
{
  MatFactorInfo info;
  PetscReal     ours = 0;
  OK(MatFactorInfoInitialize(&info));
  for (PetscInt ordering : {-1, 0, 2, 4, 6}) {
    Mat       F;
    PetscReal operations;
    OK(MatGetFactor(A, "mumpsnd", MAT_FACTOR_CHOLESKY, &F));
    if (ordering >= 0) {
      OK(MatMumpsSetIcntl(F, 7, ordering));
    }
    OK(MatCholeskyFactorSymbolic(F, A, NULL, &info));
    OK(MatMumpsGetRinfog(F, 1, &operations));
    if (ordering < 0) ours = operations;
    EXPECT_LE(ours, 1.05 * operations) << "ICNTL(7)=" << ordering;
    OK(MatDestroy(&F));
  }
}

/* A constraint given twice: the factorization fails instead of returning one of many solutions */
TEST_F(MumpsND, SingularMatrixIsReported)
{
  Triplets entries = block(4, 4, 4, true);
  for (PetscInt d = 0; d < 3; ++d) {
    const PetscInt row = entries.n++;
    entries.add_symmetric(row, d, 2.0); /* the first node is held already */
    entries.add(row, row, 0.0);
  }
  for (MatFactorType type : {MAT_FACTOR_CHOLESKY, MAT_FACTOR_LU}) {
    Mat            B, F;
    MatFactorInfo  info;
    MatFactorError error;
    OK(create_matrix(entries, &B));
    OK(MatFactorInfoInitialize(&info));
    OK(MatGetFactor(B, "mumpsnd", type, &F));
    if (type == MAT_FACTOR_LU) {
      OK(MatLUFactorSymbolic(F, B, NULL, NULL, &info));
      OK(MatLUFactorNumeric(F, B, &info));
    } else {
      OK(MatCholeskyFactorSymbolic(F, B, NULL, &info));
      OK(MatCholeskyFactorNumeric(F, B, &info));
    }
    OK(MatFactorGetError(F, &error));
    EXPECT_TRUE(error == MAT_FACTOR_NUMERIC_ZEROPIVOT || error == MAT_FACTOR_STRUCT_ZEROPIVOT) << error;
    OK(MatDestroy(&F));
    OK(MatDestroy(&B));
  }
}

/* Solves for all columns of a dense right-hand side at once, also with a factorization that has failed */
TEST_F(MumpsND, SolvesManyRightHandSides)
{
  const PetscInt columns = 70;
  Mat            F, B, X, R;
  MatFactorInfo  info;
  PetscReal      error, norm;
  OK(MatFactorInfoInitialize(&info));
  OK(MatCreateDense(PETSC_COMM_SELF, PETSC_DECIDE, columns, A->rmap->N, columns, NULL, &B));
  OK(MatSetRandom(B, NULL));
  OK(MatDuplicate(B, MAT_DO_NOT_COPY_VALUES, &X));
  OK(MatNorm(B, NORM_FROBENIUS, &norm));
  OK(MatGetFactor(A, "mumpsnd", MAT_FACTOR_CHOLESKY, &F));
  OK(MatCholeskyFactorSymbolic(F, A, NULL, &info));
  OK(MatCholeskyFactorNumeric(F, A, &info));
  OK(MatMatSolve(F, B, X));
  OK(MatMatMult(A, X, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &R));
  OK(MatAXPY(R, -1.0, B, SAME_NONZERO_PATTERN));
  OK(MatNorm(R, NORM_FROBENIUS, &error));
  EXPECT_LT(error, 1e-12 * norm);
  F->factorerrortype = MAT_FACTOR_NUMERIC_ZEROPIVOT;
  OK(MatMatSolve(F, B, X));
  OK(MatNorm(X, NORM_FROBENIUS, &error));
  EXPECT_FALSE(std::isfinite(error));
  for (Mat *M : {&F, &B, &X, &R}) OK(MatDestroy(M));
}

TEST_F(MumpsND, SmallWorkspaceGrows)
{
  Mat            F;
  MatFactorInfo  info;
  PetscInt       percent;
  MatFactorError error;
  OK(MatFactorInfoInitialize(&info));
  OK(MatGetFactor(A, "mumpsnd", MAT_FACTOR_LU, &F));
  OK(MatMumpsSetIcntl(F, 14, -60));
  OK(MatLUFactorSymbolic(F, A, NULL, NULL, &info));
  OK(MatLUFactorNumeric(F, A, &info));
  OK(MatFactorGetError(F, &error));
  EXPECT_EQ(error, MAT_FACTOR_NOERROR);
  OK(MatMumpsGetIcntl(F, 14, &percent));
  EXPECT_GT(percent, -60);
  OK(MatDestroy(&F));
}

} // namespace
