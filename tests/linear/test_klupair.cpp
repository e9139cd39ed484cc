/* The solver type "klupair": solutions, kept and rejected pivots, singular matrices, orderings */
#include "klupair_test.h"
#include <algorithm>
#include <hhtdae/hhtdae.h>
#include <petscksp.h>
#include <random>

namespace
{

TEST_F(KluPair, SolvesChainsNetsAndBlocks)
{
  for (const Triplets &e : {chain(1, 0), chain(300, 0), chain(10, 40), spatial_chain(1), spatial_chain(300),
                           spatial_chain(320, 8), block(4, 4, 4, true), block(5, 5, 5, false)}) {
    factor(e);
    EXPECT_EQ(error(), MAT_FACTOR_NOERROR);
    EXPECT_LT(residual(), 1e-12) << e.n;
    EXPECT_LT(residual(true), 1e-12) << e.n;
  }
}

TEST_F(KluPair, AgreesWithDenseLUOnRandomSaddlePoints)
{
  std::mt19937 random(11);
  for (int trial = 0; trial < 30; ++trial) {
    Mat       dense;
    Vec       b, x, y;
    PetscReal norm, scale;
    factor(random_saddle(random, 40, 10 + trial % 20));
    ASSERT_EQ(error(), MAT_FACTOR_NOERROR);
    OK(MatConvert(A, MATSEQDENSE, MAT_INITIAL_MATRIX, &dense));
    OK(MatLUFactor(dense, NULL, NULL, NULL)); /* LAPACK, partial pivoting */
    OK(MatCreateVecs(A, &x, &b));
    OK(VecDuplicate(x, &y));
    OK(VecSetRandom(b, NULL));
    for (bool transposed : {false, true}) {
      OK(transposed ? MatSolveTranspose(dense, b, y) : MatSolve(dense, b, y));
      OK(transposed ? MatSolveTranspose(F, b, x) : MatSolve(F, b, x));
      OK(VecNorm(y, NORM_INFINITY, &scale));
      OK(VecAXPY(x, -1.0, y));
      OK(VecNorm(x, NORM_INFINITY, &norm));
      EXPECT_LT(norm, 1e-7 * scale) << trial;
    }
    OK(VecDestroy(&b));
    OK(VecDestroy(&x));
    OK(VecDestroy(&y));
    OK(MatDestroy(&dense));
  }
}

TEST_F(KluPair, SameSolutionAsPetscsKLU)
{
  Mat       K;
  Vec       b, x, y;
  PetscReal norm, scale;
  PetscBool available;
  factor(spatial_chain(200, 10));
  OK(MatGetFactorAvailable(A, MATSOLVERKLU, MAT_FACTOR_LU, &available));
  if (!available) GTEST_SKIP() << "this PETSc was built without KLU";
  OK(MatGetFactor(A, MATSOLVERKLU, MAT_FACTOR_LU, &K));
  OK(MatLUFactorSymbolic(K, A, NULL, NULL, &info));
  OK(MatLUFactorNumeric(K, A, &info));
  OK(MatCreateVecs(A, &x, &b));
  OK(VecDuplicate(x, &y));
  OK(VecSetRandom(b, NULL));
  OK(MatSolve(F, b, x));
  OK(MatSolve(K, b, y));
  OK(VecNorm(y, NORM_INFINITY, &scale));
  OK(VecAXPY(x, -1.0, y));
  OK(VecNorm(x, NORM_INFINITY, &norm));
  EXPECT_LT(norm, 1e-8 * scale);
  OK(VecDestroy(&b));
  OK(VecDestroy(&x));
  OK(VecDestroy(&y));
  OK(MatDestroy(&K));
}

/* ---- the next matrix ---- */

TEST_F(KluPair, KeepsItsPivots)
{
  factor(spatial_chain(100));
  for (int k = 0; k < 4; ++k) {
    for (PetscInt i = 0; i < 600; ++i) set(i, i, 2.0 + 0.1 * k + 0.01 * (i % 7));
    OK(MatLUFactorNumeric(F, A, &info));
    EXPECT_LT(residual(), 1e-12);
    EXPECT_LT(residual(true), 1e-12);
  }
  const Counts c = counts();
  EXPECT_EQ(c.analyses, 1);
  EXPECT_EQ(c.pivoting, 1);
  EXPECT_EQ(c.kept, 4);
  EXPECT_EQ(c.given_up, 0);
}

/* Every tenth multiplier loses the entry with which it was paired; other entries still determine all multipliers */
TEST_F(KluPair, GivesUpBadPivots)
{
  for (double left : {0.0, 1e-13}) {
    const Triplets      e = spatial_chain(40);
    const LinearPivots p = pivots_of(e);
    factor(e);
    for (PetscInt lambda = 240; lambda < e.n; lambda += 10) {
      set(lambda, p.col[lambda], left);
      set(p.col[lambda], lambda, left);
    }
    OK(MatLUFactorNumeric(F, A, &info));
    EXPECT_EQ(error(), MAT_FACTOR_NOERROR);
    EXPECT_LT(residual(), 1e-12) << left;
    EXPECT_LT(residual(true), 1e-12) << left;
    const Counts c = counts();
    EXPECT_EQ(c.given_up, 1);
    EXPECT_GE(c.pivoting, 2);
  }
}

/* Each planned pivot is 1/900 of the largest entry in its column, which the pivot tolerance accepts, and entries grow
   by this factor from one pivot to the next, although the matrix is well conditioned */
TEST_F(KluPair, PivotsAsPlannedThatLetEntriesGrow)
{
  for (bool rows : {false, true}) {
    Triplets e;
    e.n = 14;
    for (PetscInt i = 0; i < e.n; ++i) {
      e.add(i, i, 1.0);
      if (i + 1 < e.n) rows ? e.add(i, i + 1, -900.0) : e.add(i + 1, i, -900.0);
      if (i + 1 < e.n) rows ? e.add(e.n - 1, i, 1.0) : e.add(i, e.n - 1, 1.0);
    }
    factor(e);
    EXPECT_EQ(error(), MAT_FACTOR_NOERROR);
    EXPECT_LT(residual(), 1e-10) << rows;
    EXPECT_LT(residual(true), 1e-10) << rows;
  }
}

/* Two pairs of unknowns, and one unknown coupled to all of them. Without diagonal entries the large entries of the
   last unknown would be the pivots, and its row would fill the factors; when pivots are planned anew, the other
   unknowns are paired among themselves */
TEST_F(KluPair, PlansAnewWhenTheFillGrows)
{
  const PetscInt n = 400;
  Triplets        e;
  e.n = n + 1;
  e.add(n, n, 1.0);
  for (PetscInt i = 0; i < n; ++i) {
    e.add(i, i, 1.0);
    e.add_symmetric(n, i, 10.0 + 0.01 * i);
    if (i % 2) e.add_symmetric(i, i - 1, 0.5);
  }
  MatInfo before, after;
  factor(e);
  EXPECT_LT(residual(), 1e-10);
  OK(MatGetInfo(F, MAT_LOCAL, &before));
  for (PetscInt i = 0; i < n; ++i) set(i, i, 0.0);
  for (int k = 1; k <= 3; ++k) {
    set(n, n, k);
    OK(MatLUFactorNumeric(F, A, &info));
    EXPECT_EQ(error(), MAT_FACTOR_NOERROR);
    EXPECT_LT(residual(), 1e-10);
    EXPECT_EQ(counts().analyses, 2);
    EXPECT_EQ(counts().kept, k);
  }
  OK(MatGetInfo(F, MAT_LOCAL, &after));
  EXPECT_LT(after.nz_used, 1.2 * before.nz_used);
}

TEST_F(KluPair, RefactorOptionOff)
{
  OK(PetscOptionsSetValue(NULL, "-mat_klupair_refactor", "false"));
  factor(chain(10, 0));
  OK(PetscOptionsClearValue(NULL, "-mat_klupair_refactor"));
  OK(MatLUFactorNumeric(F, A, &info));
  EXPECT_EQ(counts().pivoting, 2);
  EXPECT_EQ(counts().kept, 0);
}

TEST_F(KluPair, AnotherPatternIsAnalysedAnew)
{
  factor(spatial_chain(30));
  Mat     B;
  Triplets e = spatial_chain(30);
  e.add_symmetric(0, 100, 0.3);
  OK(create_matrix(e, &B));
  OK(MatLUFactorNumeric(F, B, &info));
  OK(MatDestroy(&A));
  A = B;
  EXPECT_EQ(counts().analyses, 2);
  EXPECT_LT(residual(), 1e-12);
}

/* Another matrix with the same pattern needs a comparison but no analysis */
TEST_F(KluPair, AnotherMatrixOfThePattern)
{
  factor(spatial_chain(30));
  Mat B;
  OK(MatDuplicate(A, MAT_COPY_VALUES, &B));
  OK(MatScale(B, 3.0));
  OK(MatLUFactorNumeric(F, B, &info));
  OK(MatDestroy(&A));
  A = B;
  EXPECT_EQ(counts().analyses, 1);
  EXPECT_EQ(counts().pivoting, 1);
  EXPECT_LT(residual(), 1e-12);
}

/* ---- singular matrices ---- */

TEST_F(KluPair, SingularMatricesAreReported)
{
  Triplets empty = chain(5, 0), twice = chain(5, 0), both;
  empty.add(empty.n, empty.n, 0.0);
  ++empty.n;
  const PetscInt row = twice.n++;
  twice.add_symmetric(row, 0, 0.0);
  both.n = 3;
  both.add(0, 0, 1.0);
  both.add_symmetric(0, 1, 1.0);
  both.add_symmetric(0, 2, 1.0);
  for (const Triplets &e : {empty, twice, both}) {
    factor(e);
    EXPECT_EQ(error(), MAT_FACTOR_NUMERIC_ZEROPIVOT);
  }
}

/* An empty matrix, as on ranks whose interior has only multipliers, all unknowns of which belong to the interface of
   the next rank */
TEST_F(KluPair, MatrixWithoutEntries)
{
  Triplets nothing;
  nothing.n = 6;
  factor(nothing);
  EXPECT_EQ(error(), MAT_FACTOR_NUMERIC_ZEROPIVOT);
}

TEST_F(KluPair, ValuesThatAreNotFinite)
{
  for (double value : {(double)NAN, (double)INFINITY}) {
    factor(chain(5, 0));
    const double before = 2.0;
    set(4, 4, value);
    OK(MatLUFactorNumeric(F, A, &info));
    EXPECT_NE(error(), MAT_FACTOR_NOERROR) << value;
    set(4, 4, before);
    OK(MatLUFactorNumeric(F, A, &info));
    EXPECT_EQ(error(), MAT_FACTOR_NOERROR);
    EXPECT_LT(residual(), 1e-12);
  }
}

/* The KSP fails like with PETSc's packages, and works again when the matrix is regular */
TEST_F(KluPair, SolverFailsAndRecovers)
{
  KSP                ksp;
  PC                 pc;
  Vec                b, x;
  KSPConvergedReason reason;
  Triplets            e      = chain(5, 0);
  const PetscInt     lambda = 15;
  OK(create_matrix(e, &A));
  OK(KSPCreate(PETSC_COMM_SELF, &ksp));
  OK(KSPSetType(ksp, KSPPREONLY));
  OK(KSPGetPC(ksp, &pc));
  OK(PCSetType(pc, PCLU));
  OK(PCFactorSetMatSolverType(pc, LINEAR_KLUPAIR));
  OK(KSPSetOperators(ksp, A, A));
  OK(MatCreateVecs(A, &x, &b));
  OK(VecSet(b, 1.0));
  OK(KSPSolve(ksp, b, x));
  OK(KSPGetConvergedReason(ksp, &reason));
  EXPECT_GT(reason, 0);
  Mat good;
  OK(MatDuplicate(A, MAT_COPY_VALUES, &good));
  OK(MatZeroRowsColumns(A, 1, &lambda, 0.0, NULL, NULL));
  OK(KSPSolve(ksp, b, x));
  OK(KSPGetConvergedReason(ksp, &reason));
  EXPECT_EQ(reason, KSP_DIVERGED_PC_FAILED);
  OK(MatCopy(good, A, DIFFERENT_NONZERO_PATTERN));
  OK(KSPSetOperators(ksp, A, A));
  OK(KSPSolve(ksp, b, x));
  OK(KSPGetConvergedReason(ksp, &reason));
  EXPECT_GT(reason, 0);
  OK(MatDestroy(&good));
  OK(VecDestroy(&b));
  OK(VecDestroy(&x));
  OK(KSPDestroy(&ksp));
}

/* ---- orderings and information about the factor ---- */

TEST_F(KluPair, OrderingsSolveAndSayTheirName)
{
  const Triplets e = block(6, 6, 6, true);
  for (const char *name : {"amd", "metis"}) {
    OK(PetscOptionsSetValue(NULL, "-mat_klupair_ordering", name));
    factor(e);
    EXPECT_LT(residual(), 1e-12);
    EXPECT_NE(view().find(name[0] == 'a' ? "ordering AMD" : "ordering METIS"), std::string::npos) << view();
  }
  OK(PetscOptionsClearValue(NULL, "-mat_klupair_ordering"));
}

TEST_F(KluPair, AutomaticOrderingIsTheBetterOne)
{
  double fill[3];
  for (const Triplets &e : {block(8, 8, 8, true), chain(300, 0)}) {
    int k = 0;
    for (const char *name : {"auto", "amd", "metis"}) {
      MatInfo got;
      OK(PetscOptionsSetValue(NULL, "-mat_klupair_ordering", name));
      factor(e);
      OK(MatGetInfo(F, MAT_LOCAL, &got));
      fill[k++] = got.nz_used;
    }
    EXPECT_LE(fill[0], 1.05 * std::min(fill[1], fill[2]));
  }
  OK(PetscOptionsClearValue(NULL, "-mat_klupair_ordering"));
}

TEST_F(KluPair, GivenOrderingIsFollowed)
{
  IS            row, col;
  MatInfo       own, natural;
  const Triplets e = block(6, 6, 6, false);
  factor(e);
  OK(MatGetInfo(F, MAT_LOCAL, &own));
  OK(MatGetOrdering(A, MATORDERINGNATURAL, &row, &col));
  factor(e, row);
  OK(MatGetInfo(F, MAT_LOCAL, &natural));
  EXPECT_LT(residual(), 1e-12);
  EXPECT_GT(natural.nz_used, 1.2 * own.nz_used);
  OK(ISDestroy(&row));
  OK(ISDestroy(&col));
}

/* A permuted triangular matrix has no fill; it is solved, also transposed and with new values, like any other */
TEST_F(KluPair, BlocksOfAReducibleMatrix)
{
  std::mt19937          random(17);
  const PetscInt        n = 300;
  std::vector<PetscInt> name(n);
  Triplets               e;
  MatInfo               got;
  e.n = n;
  for (PetscInt i = 0; i < n; ++i) name[i] = i;
  std::shuffle(name.begin(), name.end(), random);
  for (PetscInt i = 0; i < n; ++i) {
    e.add(name[i], name[i], 4.0);
    for (int k = 0; k < 3 && i; ++k) e.add(name[i], name[random() % i], 1.0);
  }
  factor(e);
  OK(MatGetInfo(F, MAT_LOCAL, &got));
  EXPECT_NE(view().find("diagonal blocks"), std::string::npos) << view();
  EXPECT_LE(got.nz_used, (double)e.row.size());
  for (int k = 0; k < 2; ++k) {
    EXPECT_LT(residual(), 1e-12);
    EXPECT_LT(residual(true), 1e-12);
    set(name[7], name[7], 5.0);
    OK(MatLUFactorNumeric(F, A, &info));
  }
  EXPECT_EQ(counts().analyses, 1);
}

/* If the planned pivots are kept, the factors have exactly the predicted number of entries for a single diagonal block */
TEST_F(KluPair, FillIsAsForeseen)
{
  MatInfo got;
  factor(block(5, 5, 5, false));
  OK(MatGetInfo(F, MAT_LOCAL, &got));
  EXPECT_GT(got.nz_used, 0);
  EXPECT_DOUBLE_EQ(got.fill_ratio_given, got.fill_ratio_needed);
  factor(spatial_chain(500));
  OK(MatGetInfo(F, MAT_LOCAL, &got));
  EXPECT_LT(got.fill_ratio_needed, 1.1 * got.fill_ratio_given);
}

} // namespace
