/* The solver type "mumpsnd" on all ranks together: many right-hand sides at once, and workspace that must grow */
#include "distributed_matrix.h"
#include "linear/linear.h"
#include <hhtdae/hhtdae.h>
#include <petsc/private/matimpl.h>

using namespace hhtest;

namespace
{

const PetscInt COLUMNS = 70; /* more than MUMPS processes at a time */

class MumpsNDRanks : public testing::Test
{
protected:
  Mat           A = nullptr, F = nullptr;
  MatFactorInfo info;

  void SetUp() override
  {
    PetscBool available;
    must(TSHHT3Initialize());
    distribute(block(6, 5, 4, true));
    must(MatGetFactorAvailable(A, "mumpsnd", MAT_FACTOR_LU, &available));
    if (!available) GTEST_SKIP() << "this PETSc was built without MUMPS";
    must(MatFactorInfoInitialize(&info));
  }

  void TearDown() override
  {
    must(MatDestroy(&F));
    must(MatDestroy(&A));
  }

  void distribute(const Triplets &e)
  {
    must(MatDestroy(&A));
    A = distributed(e);
  }

  void factor(MatFactorType type)
  {
    must(MatDestroy(&F));
    must(MatGetFactor(A, "mumpsnd", type, &F));
    if (type == MAT_FACTOR_LU)
      must(MatLUFactorSymbolic(F, A, nullptr, nullptr, &info));
    else
      must(MatCholeskyFactorSymbolic(F, A, nullptr, &info));
    refactor();
  }

  void refactor()
  {
    if (F->factortype == MAT_FACTOR_LU)
      must(MatLUFactorNumeric(F, A, &info));
    else
      must(MatCholeskyFactorNumeric(F, A, &info));
  }

  /* Columns that depend on the global row only; gap: additional rows in memory that are not part of the matrix (lda) */
  Mat columns(PetscInt count, PetscInt gap)
  {
    Mat      B;
    PetscInt rows, begin;
    must(MatGetLocalSize(A, &rows, nullptr));
    must(MatGetOwnershipRange(A, &begin, nullptr));
    must(MatCreate(PETSC_COMM_WORLD, &B));
    must(MatSetSizes(B, rows, PETSC_DECIDE, PETSC_DETERMINE, count));
    must(MatSetType(B, MATDENSE));
    must(MatDenseSetLDA(B, rows + gap));
    must(MatSetUp(B));
    PetscScalar *values;
    must(MatDenseGetArray(B, &values));
    for (PetscInt k = 0; k < count; k++)
      for (PetscInt i = 0; i < rows; i++)
        values[k * (rows + gap) + i] = std::sin(1.3 * (double)(begin + i) + 0.7 * (double)k);
    must(MatDenseRestoreArray(B, &values));
    return B;
  }

  /* Solutions of all columns at once against one solve for each of them */
  void compare(PetscInt count, PetscInt gap)
  {
    Mat       B = columns(count, gap), X = columns(count, 2 * gap);
    Vec       x, single;
    PetscReal error, norm;
    must(MatCreateVecs(A, &single, nullptr));
    must(MatMatSolve(F, B, X));
    for (PetscInt k = 0; k < count; k++) {
      must(MatDenseGetColumnVecRead(B, k, &x));
      must(MatSolve(F, x, single));
      must(MatDenseRestoreColumnVecRead(B, k, &x));
      must(VecNorm(single, NORM_2, &norm));
      must(MatDenseGetColumnVecRead(X, k, &x));
      must(VecAXPY(single, -1, x));
      must(MatDenseRestoreColumnVecRead(X, k, &x));
      must(VecNorm(single, NORM_2, &error));
      ASSERT_LT(error, 1e-11 * norm) << "column " << k;
      ASSERT_GT(norm, 0);
    }
    must(VecDestroy(&single));
    must(MatDestroy(&B));
    must(MatDestroy(&X));
  }
};

TEST_F(MumpsNDRanks, ManyRightHandSides)
{
  for (MatFactorType type : {MAT_FACTOR_CHOLESKY, MAT_FACTOR_LU}) {
    factor(type);
    compare(COLUMNS, 0);
    compare(COLUMNS, 3);
    compare(1, 0);
    compare(2, 1);
  }
}

TEST_F(MumpsNDRanks, ManyRightHandSidesInSmallBlocks)
{
  must(PetscOptionsSetValue(nullptr, "-mat_mumps_icntl_27", "5"));
  factor(MAT_FACTOR_CHOLESKY);
  must(PetscOptionsClearValue(nullptr, "-mat_mumps_icntl_27"));
  compare(COLUMNS, 0);
}

/* The distribution of the solution may change with every factorization, and between A and its transpose */
TEST_F(MumpsNDRanks, ManyRightHandSidesAfterChanges)
{
  PetscInt begin, end;
  Vec      b, x, r;
  must(MatGetOwnershipRange(A, &begin, &end));
  factor(MAT_FACTOR_LU);
  compare(COLUMNS, 0);
  if (begin == 0 && end > 1) must(MatSetValue(A, 0, 1, 5., INSERT_VALUES)); /* unsymmetric */
  must(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  must(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  refactor();
  compare(COLUMNS, 0);
  must(MatCreateVecs(A, &x, &b));
  must(VecDuplicate(b, &r));
  must(VecSet(b, 1));
  must(MatSolveTranspose(F, b, x));
  must(MatMultTranspose(A, x, r));
  must(VecAXPY(r, -1, b));
  PetscReal residual;
  must(VecNorm(r, NORM_INFINITY, &residual));
  EXPECT_LT(residual, 1e-10);
  compare(COLUMNS, 0);
  for (Vec *v : {&b, &x, &r}) must(VecDestroy(v));
}

/* A sparse B is refused by all ranks */
TEST_F(MumpsNDRanks, WhatItTakes)
{
  factor(MAT_FACTOR_CHOLESKY);
  Mat         X = columns(A->cmap->N, 0);
  std::string said;
  {
    ErrorTrap trap;
    EXPECT_NE(MatMatSolve(F, A, X), 0);
    said = trap.message;
  }
  EXPECT_NE(said.find("dense"), std::string::npos) << said;
  must(MatDestroy(&X));
}

TEST_F(MumpsNDRanks, SmallWorkspaceGrows)
{
  PetscInt       percent;
  MatFactorError error;
  distribute(block(10, 10, 10, true));
  must(MatGetFactor(A, "mumpsnd", MAT_FACTOR_LU, &F));
  must(MatMumpsSetIcntl(F, 14, -60));
  must(MatLUFactorSymbolic(F, A, nullptr, nullptr, &info));
  refactor();
  must(MatFactorGetError(F, &error));
  EXPECT_EQ(error, MAT_FACTOR_NOERROR);
  must(MatMumpsGetIcntl(F, 14, &percent));
  EXPECT_GT(percent, -60);
  compare(3, 0);
}

} // namespace
