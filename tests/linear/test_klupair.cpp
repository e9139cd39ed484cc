/* The solver type "klupair": which pivots it plans, what it solves, when it keeps its pivots, what it does without */
#include "linear/klupair.h"
#include "linear/klupair_matching.h"
#include "bench/linear_matrices.h"
#include "view_text.h"
#include <algorithm>
#include <gtest/gtest.h>
#include <hhtdae/hhtdae.h>
#include <petscksp.h>
#include <random>
#include <string>

#define OK(call) ASSERT_EQ((call), 0)

namespace
{

/* ---- planned pivots ---- */

struct Rows {
  Mat        A;
  LinearRows rows;
  explicit Rows(const Entries &entries)
  {
    PetscBool done;
    EXPECT_EQ(create_matrix(entries, &A), 0);
    EXPECT_EQ(MatGetRowIJ(A, 0, PETSC_FALSE, PETSC_FALSE, &rows.n, &rows.start, &rows.col, &done), 0);
    EXPECT_EQ(MatSeqAIJGetArrayRead(A, &rows.val), 0);
  }
  ~Rows()
  {
    PetscBool done;
    EXPECT_EQ(MatSeqAIJRestoreArrayRead(A, &rows.val), 0);
    EXPECT_EQ(MatRestoreRowIJ(A, 0, PETSC_FALSE, PETSC_FALSE, &rows.n, &rows.start, &rows.col, &done), 0);
    EXPECT_EQ(MatDestroy(&A), 0);
  }
  double value(PetscInt i, PetscInt j) const
  {
    for (PetscInt k = rows.start[i]; k < rows.start[i + 1]; ++k)
      if (rows.col[k] == j) return rows.val[k];
    return 0;
  }
};

/* A permutation; the number of its pivots that are zero */
PetscInt zero_pivots(const Rows &A, const LinearPivots &p)
{
  std::vector<bool> met(p.col.size(), false);
  PetscInt          zeros = 0;
  for (size_t i = 0; i < p.col.size(); ++i) {
    EXPECT_TRUE(p.col[i] >= 0 && p.col[i] < (PetscInt)met.size() && !met[p.col[i]]) << i;
    met[p.col[i]] = true;
    zeros += A.value((PetscInt)i, p.col[i]) == 0;
  }
  return zeros;
}

LinearPivots pivots_of(const Entries &entries, PetscInt zeros_left = 0)
{
  const Rows   A(entries);
  LinearPivots p;
  LinearFindPivots(A.rows, &p);
  EXPECT_EQ((PetscInt)p.col.size(), entries.n);
  EXPECT_EQ(zero_pivots(A, p), zeros_left);
  return p;
}

TEST(KluPairPivots, DiagonalStaysWhereItHasValues)
{
  const LinearPivots p = pivots_of(block(3, 3, 3, false));
  EXPECT_EQ(p.zeros, 0);
  for (size_t i = 0; i < p.col.size(); ++i) EXPECT_EQ(p.col[i], (PetscInt)i);
}

TEST(KluPairPivots, EveryMultiplierHasItsCoordinate)
{
  for (const Entries &e :
       {chain(1, 0), chain(50, 0), chain(5, 12), spatial_chain(60), spatial_chain(64, 8), block(3, 3, 3, true)}) {
    const LinearPivots p = pivots_of(e);
    EXPECT_EQ(p.pairs, p.zeros);
    EXPECT_EQ(p.unmatched, 0);
    for (size_t i = 0; i < p.col.size(); ++i) EXPECT_EQ(p.col[p.col[i]], (PetscInt)i);
  }
}

/* As many constraints as coordinates, and each multiplier but the last prefers the coordinate of the next one: only an
   exchange along the whole row of them leaves one for everybody */
TEST(KluPairPivots, LongExchange)
{
  const PetscInt n = 3000;
  Entries        e;
  e.n = 2 * n;
  for (PetscInt i = 0; i < n; ++i) {
    e.add(i, i, 1.0);
    e.add_symmetric(n + i, i, 0.6);
    if (i > 0) e.add_symmetric(n + i, i - 1, 1.0);
  }
  const LinearPivots p = pivots_of(e);
  EXPECT_EQ(p.pairs, n);
  EXPECT_LT(p.looked, 100.0 * n);
}

TEST(KluPairPivots, ExplicitZerosAreNoPivots)
{
  Entries e;
  e.n = 4;
  for (PetscInt i = 0; i < 2; ++i) e.add(i, i, 1.0);
  e.add(2, 2, 0.0);
  e.add_symmetric(2, 0, 0.0);
  e.add_symmetric(2, 1, 1.0);
  e.add_symmetric(3, 0, 1.0);
  e.add_symmetric(3, 1, 1.0);
  const LinearPivots p = pivots_of(e);
  EXPECT_EQ(p.col, (std::vector<PetscInt>{3, 2, 1, 0}));
}

TEST(KluPairPivots, LargeEntryIsPreferred)
{
  Entries e;
  e.n = 4;
  for (PetscInt i = 0; i < 3; ++i) {
    e.add(i, i, 1.0);
    e.add_symmetric(3, i, i == 1 ? 2.0 : 1e-6);
  }
  EXPECT_EQ(pivots_of(e).col[3], 1);
}

TEST(KluPairPivots, TwoUnknownsWithoutDiagonal)
{
  Entries e;
  e.n = 3;
  e.add(2, 2, 1.0);
  e.add_symmetric(0, 1, 1.0);
  EXPECT_EQ(pivots_of(e).col, (std::vector<PetscInt>{1, 0, 2}));
}

/* No two rows exchange their pivots here: a cycle of three */
TEST(KluPairPivots, UnsymmetricCycle)
{
  Entries e;
  e.n = 3;
  for (PetscInt i = 0; i < 3; ++i) e.add(i, (i + 1) % 3, 1.0);
  EXPECT_EQ(pivots_of(e).col, (std::vector<PetscInt>{1, 2, 0}));
}

/* Two multipliers of one coordinate, and a row without any entry */
TEST(KluPairPivots, SingularByItsPattern)
{
  Entries e;
  e.n = 4;
  e.add(0, 0, 1.0);
  e.add_symmetric(1, 0, 1.0);
  e.add_symmetric(2, 0, 1.0);
  e.add(3, 3, 0.0);
  const LinearPivots p = pivots_of(e, 2);
  EXPECT_EQ(p.unmatched, 1); /* the third row has a place by its pattern */
}

/* Ten times as many bodies: ten times as many entries looked at */
TEST(KluPairPivots, WorkGrowsWithTheChain)
{
  for (PetscInt loops : {0, 8}) {
    const double few  = pivots_of(spatial_chain(1000, loops)).looked,
                 many = pivots_of(spatial_chain(10000, loops)).looked;
    EXPECT_LT(many, 13 * few) << loops;
    EXPECT_LT(many, 300.0 * 10000) << loops;
  }
  EXPECT_LT(pivots_of(chain(10000, 0)).looked, 13 * pivots_of(chain(1000, 0)).looked);
}

TEST(KluPairPivots, MatchingIsALargestOne)
{
  std::mt19937 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const PetscInt  n = 8;
    LinearBipartite G;
    G.right = n;
    G.start.assign(1, 0);
    for (PetscInt l = 0; l < n; ++l) {
      for (PetscInt r = 0; r < n; ++r)
        if (random() % 5 == 0) G.adj.push_back(r);
      G.start.push_back((PetscInt)G.adj.size());
    }
    std::vector<PetscInt> of_left(n, -1), of_right(n, -1);
    double                looked = 0;
    LinearMaximumMatching(G, &of_left, &of_right, &looked);
    PetscInt size = 0;
    for (PetscInt l = 0; l < n; ++l) {
      if (of_left[l] < 0) continue;
      EXPECT_EQ(of_right[of_left[l]], l);
      ++size;
    }
    /* Hall: by the subset of left vertices that lacks most neighbours */
    PetscInt lacking = 0;
    for (unsigned set = 0; set < 1u << n; ++set) {
      unsigned neighbours = 0;
      for (PetscInt l = 0; l < n; ++l)
        for (PetscInt k = G.start[l]; k < G.start[l + 1] && (set >> l & 1); ++k) neighbours |= 1u << G.adj[k];
      lacking = std::max(lacking, (PetscInt)(__builtin_popcount(set) - __builtin_popcount(neighbours)));
    }
    EXPECT_EQ(size, n - lacking);
  }
}

/* ---- the factor ---- */

struct Counts {
  int analyses, pivoting, kept, given_up;
};

class KluPair : public testing::Test
{
protected:
  Mat           A = NULL, F = NULL;
  MatFactorInfo info;

  void SetUp() override
  {
    PetscBool available;
    Entries   entries = chain(1, 0);
    Mat       probe;
    OK(create_matrix(entries, &probe));
    OK(MatGetFactorAvailable(probe, LINEAR_KLUPAIR, MAT_FACTOR_LU, &available));
    OK(MatDestroy(&probe));
    if (!available) GTEST_SKIP() << "built without KLU";
    OK(MatFactorInfoInitialize(&info));
  }
  void TearDown() override
  {
    OK(MatDestroy(&F));
    OK(MatDestroy(&A));
  }

  void factor(const Entries &entries, IS order = NULL)
  {
    OK(MatDestroy(&F));
    OK(MatDestroy(&A));
    OK(create_matrix(entries, &A));
    OK(MatGetFactor(A, LINEAR_KLUPAIR, MAT_FACTOR_LU, &F));
    OK(MatLUFactorSymbolic(F, A, order, order, &info));
    OK(MatLUFactorNumeric(F, A, &info));
  }

  MatFactorError error()
  {
    MatFactorError e;
    EXPECT_EQ(MatFactorGetError(F, &e), 0);
    return e;
  }

  /* max |b - A x| / max |x| for a random right-hand side */
  double residual(bool transposed = false)
  {
    Vec       b, x, r;
    PetscReal norm, scale;
    EXPECT_EQ(MatCreateVecs(A, &x, &b), 0);
    EXPECT_EQ(VecDuplicate(b, &r), 0);
    EXPECT_EQ(VecSetRandom(b, NULL), 0);
    EXPECT_EQ(transposed ? MatSolveTranspose(F, b, x) : MatSolve(F, b, x), 0);
    EXPECT_EQ(transposed ? MatMultTranspose(A, x, r) : MatMult(A, x, r), 0);
    EXPECT_EQ(VecAXPY(r, -1.0, b), 0);
    EXPECT_EQ(VecNorm(r, NORM_INFINITY, &norm), 0);
    EXPECT_EQ(VecNorm(x, NORM_INFINITY, &scale), 0);
    EXPECT_EQ(VecDestroy(&b), 0);
    EXPECT_EQ(VecDestroy(&x), 0);
    EXPECT_EQ(VecDestroy(&r), 0);
    return norm / scale;
  }

  void set(PetscInt i, PetscInt j, double v)
  {
    OK(MatSetValue(A, i, j, v, INSERT_VALUES));
    OK(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    OK(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  }

  std::string view()
  {
    return ViewText([this](PetscViewer viewer) { return MatView(F, viewer); }, PETSC_VIEWER_ASCII_INFO);
  }

  Counts counts()
  {
    Counts            c    = {-1, -1, -1, -1};
    const std::string text = view();
    const size_t      at   = text.find("analyses:");
    EXPECT_NE(at, std::string::npos) << text;
    if (at == std::string::npos) return c;
    EXPECT_EQ(sscanf(text.c_str() + at,
                     "analyses: %d, factorizations with pivoting: %d, with old pivots: %d, of these given up: %d",
                     &c.analyses, &c.pivoting, &c.kept, &c.given_up),
              4)
        << text;
    return c;
  }
};

TEST_F(KluPair, SolvesChainsNetsAndBlocks)
{
  for (const Entries &e : {chain(1, 0), chain(300, 0), chain(10, 40), spatial_chain(1), spatial_chain(300),
                           spatial_chain(320, 8), block(4, 4, 4, true), block(5, 5, 5, false)}) {
    factor(e);
    EXPECT_EQ(error(), MAT_FACTOR_NOERROR);
    EXPECT_LT(residual(), 1e-12) << e.n;
    EXPECT_LT(residual(true), 1e-12) << e.n;
  }
}

/* [D B; C 0] with as many as three quarters of multipliers, unsymmetric values, entries over six orders of magnitude */
Entries random_saddle(std::mt19937 &random, PetscInt coordinates, PetscInt multipliers)
{
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Entries                                e;
  e.n = coordinates + multipliers;
  for (PetscInt i = 0; i < coordinates; ++i) e.add(i, i, std::pow(10.0, 3 * uniform(random)));
  for (PetscInt k = 0; k < coordinates; ++k)
    e.add((PetscInt)(random() % coordinates), (PetscInt)(random() % coordinates), 0.1 * uniform(random));
  for (PetscInt m = 0; m < multipliers; ++m)
    for (int k = 0; k < 4; ++k) {
      const PetscInt q = k ? (PetscInt)(random() % coordinates) : m;
      const double   b = uniform(random);
      e.add(coordinates + m, q, b);
      e.add(q, coordinates + m, b * (1 + 0.3 * uniform(random)));
    }
  return e;
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

/* Every tenth multiplier loses the entry that it was paired by; all of them are held by others still */
TEST_F(KluPair, GivesUpBadPivots)
{
  for (double left : {0.0, 1e-13}) {
    const Entries      e = spatial_chain(40);
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

/* Every pivot as planned is a 900th of its column, which the pivot tolerance lets pass, and entries grow by that factor from one to the next. The
   matrix itself is well conditioned. */
TEST_F(KluPair, PivotsAsPlannedThatLetEntriesGrow)
{
  for (bool rows : {false, true}) {
    Entries e;
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

/* Two and two unknowns, and one coupled to all. Without diagonals the large entries of the last one would be the
   pivots, and its row would fill the factors; paired anew, the others do among themselves. */
TEST_F(KluPair, PlansAnewWhenTheFillGrows)
{
  const PetscInt n = 400;
  Entries        e;
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
  Entries e = spatial_chain(30);
  e.add_symmetric(0, 100, 0.3);
  OK(create_matrix(e, &B));
  OK(MatLUFactorNumeric(F, B, &info));
  OK(MatDestroy(&A));
  A = B;
  EXPECT_EQ(counts().analyses, 2);
  EXPECT_LT(residual(), 1e-12);
}

/* Another matrix of the same pattern costs a comparison and no analysis */
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
  Entries empty = chain(5, 0), twice = chain(5, 0), both;
  empty.add(empty.n, empty.n, 0.0);
  ++empty.n;
  const PetscInt row = twice.n++;
  twice.add_symmetric(row, 0, 0.0);
  both.n = 3;
  both.add(0, 0, 1.0);
  both.add_symmetric(0, 1, 1.0);
  both.add_symmetric(0, 2, 1.0);
  for (const Entries &e : {empty, twice, both}) {
    factor(e);
    EXPECT_EQ(error(), MAT_FACTOR_NUMERIC_ZEROPIVOT);
  }
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

/* The KSP fails as PETSc's do, and recovers when the matrix does */
TEST_F(KluPair, SolverFailsAndRecovers)
{
  KSP                ksp;
  PC                 pc;
  Vec                b, x;
  KSPConvergedReason reason;
  Entries            e      = chain(5, 0);
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

/* ---- orderings and what the factor says of itself ---- */

TEST_F(KluPair, OrderingsSolveAndSayTheirName)
{
  const Entries e = block(6, 6, 6, true);
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
  for (const Entries &e : {block(8, 8, 8, true), chain(300, 0)}) {
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
  const Entries e = block(6, 6, 6, false);
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

/* A triangular matrix in disguise has no fill, and is solved with transposes and new values as any other */
TEST_F(KluPair, BlocksOfAReducibleMatrix)
{
  std::mt19937          random(17);
  const PetscInt        n = 300;
  std::vector<PetscInt> name(n);
  Entries               e;
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

/* Where the planned pivots are kept, the factors have exactly the entries foreseen for one diagonal block */
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

/* ---- dense panels ---- */

/* A body with modes, dense and with values that are not symmetric, that carries others by constraints on all modes;
   each of these carries a little chain */
Entries modal_carrier(std::mt19937 &random, PetscInt modes, PetscInt attachments)
{
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Entries                                e;
  e.n            = modes;
  const auto add = [&](PetscInt i, PetscInt j, double v) {
    e.add(i, j, v);
    e.add(j, i, v * (1 + 0.2 * uniform(random)));
  };
  for (PetscInt i = 0; i < modes; ++i) {
    e.add(i, i, 0.5 * (double)modes);
    for (PetscInt j = 0; j < i; ++j) add(i, j, uniform(random));
  }
  for (PetscInt a = 0; a < attachments; ++a) {
    const PetscInt q = e.n, lambda = q + 12;
    e.n += 21;
    for (PetscInt i = 0; i < 12; ++i) e.add(q + i, q + i, 2.0 + uniform(random));
    for (PetscInt d = 0; d < 5; ++d) {
      for (PetscInt i = 0; i < modes; ++i) add(lambda + d, i, uniform(random));
      for (PetscInt i = 0; i < 6; ++i) add(lambda + d, q + i, uniform(random));
    }
    for (PetscInt d = 5; d < 9; ++d)
      for (PetscInt i = 0; i < 12; ++i) add(lambda + d, q + i, uniform(random));
  }
  return e;
}

/* Diagonal blocks, dense in themselves, with entries from each to those after it; unknowns shuffled */
Entries dense_blocks(std::mt19937 &random, PetscInt blocks, PetscInt size)
{
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<PetscInt>                  name(blocks * size);
  Entries                                e;
  e.n = blocks * size;
  for (PetscInt i = 0; i < e.n; ++i) name[i] = i;
  std::shuffle(name.begin(), name.end(), random);
  for (PetscInt i = 0; i < e.n; ++i) {
    for (PetscInt j = i - i % size; j < i - i % size + size; ++j)
      e.add(name[i], name[j], i == j ? 0.5 * (double)size : uniform(random));
    for (int k = 0; k < 3 && i >= size; ++k)
      e.add(name[i], name[(PetscInt)(random() % (i - i % size))], uniform(random));
  }
  return e;
}

class KluPairPanels : public KluPair
{
protected:
  const std::string used = "dense panels for these pivots";

  /* Every value a little different, structural zeros stay */
  void change(std::mt19937 &random, double part = 0.1)
  {
    std::uniform_real_distribution<double> uniform(1 - part, 1 + part);
    PetscScalar                           *value;
    MatInfo                                got;
    OK(MatGetInfo(A, MAT_LOCAL, &got));
    OK(MatSeqAIJGetArray(A, &value));
    for (PetscInt k = 0; k < (PetscInt)got.nz_used; ++k) value[k] *= uniform(random);
    OK(MatSeqAIJRestoreArray(A, &value));
  }

  void again(MatFactorError expected = MAT_FACTOR_NOERROR)
  {
    OK(MatLUFactorNumeric(F, A, &info));
    EXPECT_EQ(error(), expected);
  }

  /* The same matrix without panels, and without old pivots */
  void expect_same_solution(double tolerance)
  {
    Mat       fresh;
    Vec       b, x, y;
    PetscReal norm, scale;
    OK(PetscOptionsSetValue(NULL, "-mat_klupair_panels", "false"));
    OK(MatGetFactor(A, LINEAR_KLUPAIR, MAT_FACTOR_LU, &fresh));
    OK(MatLUFactorSymbolic(fresh, A, NULL, NULL, &info));
    OK(MatLUFactorNumeric(fresh, A, &info));
    OK(PetscOptionsClearValue(NULL, "-mat_klupair_panels"));
    OK(MatCreateVecs(A, &x, &b));
    OK(VecDuplicate(x, &y));
    OK(VecSetRandom(b, NULL));
    for (bool transposed : {false, true}) {
      OK(transposed ? MatSolveTranspose(fresh, b, y) : MatSolve(fresh, b, y));
      OK(transposed ? MatSolveTranspose(F, b, x) : MatSolve(F, b, x));
      OK(VecNorm(y, NORM_INFINITY, &scale));
      OK(VecAXPY(x, -1.0, y));
      OK(VecNorm(x, NORM_INFINITY, &norm));
      EXPECT_LT(norm, tolerance * scale);
    }
    for (Vec *v : {&b, &x, &y}) OK(VecDestroy(v));
    OK(MatDestroy(&fresh));
  }
};

TEST_F(KluPairPanels, SameSolutionsForChangingValues)
{
  std::mt19937 random(5);
  for (const Entries &e : {modal_carrier(random, 60, 8), modal_carrier(random, 130, 3), modal_carrier(random, 80, 1),
                           chain(6, 50), block(5, 5, 5, true)}) {
    factor(e);
    for (int k = 0; k < 4; ++k) {
      change(random);
      again();
      EXPECT_NE(view().find(used), std::string::npos) << view();
      EXPECT_LT(residual(), 1e-11);
      EXPECT_LT(residual(true), 1e-11);
      expect_same_solution(1e-8);
    }
    EXPECT_EQ(counts().pivoting, 1);
    EXPECT_EQ(counts().kept, 4);
  }
}

/* Sparse saddle points with a dense corner of every size: also narrow panels, and pivots that KLU chose otherwise than
   planned */
TEST_F(KluPairPanels, RandomSaddlePoints)
{
  std::mt19937 random(23);
  int          met = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const PetscInt dense = 40 + 3 * trial;
    Entries        e     = random_saddle(random, 150, 20 + 3 * trial);
    for (PetscInt i = 0; i < dense; ++i)
      for (PetscInt j = 0; j < dense; ++j) e.add(i, j, std::cos((double)(i * i + 3 * j + trial)));
    factor(e);
    change(random, 0.02);
    again();
    met += view().find(used) != std::string::npos;
    EXPECT_LT(residual(), 1e-9) << trial;
    EXPECT_LT(residual(true), 1e-9) << trial;
    expect_same_solution(1e-6);
  }
  EXPECT_GT(met, 20);
}

TEST_F(KluPairPanels, SeveralDiagonalBlocks)
{
  std::mt19937 random(7);
  factor(dense_blocks(random, 5, 70));
  EXPECT_NE(view().find("diagonal blocks"), std::string::npos) << view();
  for (int k = 0; k < 3; ++k) {
    change(random);
    again();
    EXPECT_NE(view().find(used), std::string::npos) << view();
    EXPECT_LT(residual(), 1e-12);
    EXPECT_LT(residual(true), 1e-12);
    expect_same_solution(1e-10);
  }
}

/* [A I; I B], where nothing or nearly nothing remains of A and B */
TEST_F(KluPairPanels, GivesUpBadPivots)
{
  std::mt19937                           random(9);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const PetscInt                         n = 90;
  for (double left : {0.0, 1e-14}) {
    Entries e;
    e.n = 2 * n;
    for (PetscInt i = 0; i < n; ++i) {
      for (PetscInt j = 0; j < n; ++j)
        for (PetscInt part : {(PetscInt)0, n}) e.add(part + i, part + j, i == j ? (double)n : uniform(random));
      e.add_symmetric(i, n + i, 1.0);
    }
    factor(e);
    change(random);
    again();
    ASSERT_NE(view().find(used), std::string::npos) << view();
    EXPECT_LT(residual(), 1e-12);
    OK(MatScale(A, left));
    for (PetscInt i = 0; i < n; ++i) {
      set(i, n + i, 1.0);
      set(n + i, i, 1.0);
    }
    again();
    EXPECT_EQ(counts().given_up, 1);
    EXPECT_LT(residual(), 1e-12) << left;
    EXPECT_LT(residual(true), 1e-12) << left;
    again(); /* with the new pivots */
    EXPECT_EQ(counts().given_up, 1);
    EXPECT_LT(residual(), 1e-12) << left;
    expect_same_solution(1e-10);
  }
}

/* The same errors as without panels, and none once the matrix is regular again */
TEST_F(KluPairPanels, SingularMatricesAreReported)
{
  std::mt19937  random(13);
  const Entries e = modal_carrier(random, 80, 2);
  for (const char *panels : {"true", "false"})
    for (double value : {0.0, (double)NAN, (double)INFINITY}) {
      OK(PetscOptionsSetValue(NULL, "-mat_klupair_panels", panels));
      factor(e);
      again();
      EXPECT_EQ(view().find(used) != std::string::npos, panels[0] == 't') << view();
      Mat            good;
      const PetscInt row = 20;
      OK(MatDuplicate(A, MAT_COPY_VALUES, &good));
      OK(MatZeroRows(A, 1, &row, value, NULL, NULL));
      again(value == 0 ? MAT_FACTOR_NUMERIC_ZEROPIVOT : MAT_FACTOR_OTHER);
      OK(MatCopy(good, A, DIFFERENT_NONZERO_PATTERN));
      again();
      EXPECT_LT(residual(), 1e-11);
      OK(MatDestroy(&good));
    }
  OK(PetscOptionsClearValue(NULL, "-mat_klupair_panels"));
}

/* Nothing is allocated where nothing is dense, nor for what panels do not know */
TEST_F(KluPairPanels, OnlyWhereTheyPay)
{
  std::mt19937 random(15);
  for (const Entries &e : {chain(300, 0), spatial_chain(300), spatial_chain(320, 8), chain(100, 5)}) {
    factor(e);
    again();
    EXPECT_NE(view().find("no dense panels: they would not pay"), std::string::npos) << view();
  }
  OK(PetscOptionsSetValue(NULL, "-mat_klupair_row_scale", "max"));
  factor(modal_carrier(random, 60, 8));
  again();
  EXPECT_EQ(view().find(used), std::string::npos) << view();
  EXPECT_LT(residual(), 1e-11);
  OK(PetscOptionsClearValue(NULL, "-mat_klupair_row_scale"));
}

} // namespace
