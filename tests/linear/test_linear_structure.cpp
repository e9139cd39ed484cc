/* What is derived from a matrix: orderings and their work, symmetry, names of redundant constraints */
#include "linear/graph.h"
#include "linear/linear.h"
#include "bench/linear_matrices.h"
#include <gtest/gtest.h>
#include <cmath>
#include <hhtdae/hhtdae.h>
#include <random>
#include <string>

#define OK(call) ASSERT_EQ((call), 0)

namespace
{

/* ---- orderings ---- */

std::vector<PetscInt> order_of(Mat A, const char type[])
{
  IS              row, col;
  PetscInt        n;
  const PetscInt *indices;
  EXPECT_EQ(MatGetOrdering(A, type, &row, &col), 0);
  EXPECT_EQ(ISGetLocalSize(row, &n), 0);
  EXPECT_EQ(ISGetIndices(row, &indices), 0);
  std::vector<PetscInt> order(indices, indices + n);
  EXPECT_EQ(ISRestoreIndices(row, &indices), 0);
  EXPECT_EQ(ISDestroy(&row), 0);
  EXPECT_EQ(ISDestroy(&col), 0);
  return order;
}

LinearWork work_of(Mat A, const std::vector<PetscInt> &order)
{
  LinearGraph graph;
  LinearWork  work;
  PetscBool   done, bounded;
  EXPECT_EQ(LinearGraphFromMat(A, &graph, &done), 0);
  EXPECT_TRUE(done);
  LinearCountWork(graph, order.data(), 1e12, &work, &bounded);
  EXPECT_TRUE(bounded);
  return work;
}

/* Number of entries of L, by elimination of a dense Boolean matrix */
LinearWork work_by_elimination(Mat A, const std::vector<PetscInt> &order)
{
  const PetscInt                 n = (PetscInt)order.size();
  std::vector<std::vector<bool>> full(n, std::vector<bool>(n, false));
  std::vector<PetscInt>          place(n);
  LinearWork                     work;
  for (PetscInt k = 0; k < n; ++k) place[order[k]] = k;
  for (PetscInt i = 0; i < n; ++i) {
    PetscInt        count;
    const PetscInt *cols;
    EXPECT_EQ(MatGetRow(A, i, &count, &cols, NULL), 0);
    for (PetscInt k = 0; k < count; ++k) full[place[i]][place[cols[k]]] = full[place[cols[k]]][place[i]] = true;
    EXPECT_EQ(MatRestoreRow(A, i, &count, &cols, NULL), 0);
  }
  for (PetscInt k = 0; k < n; ++k) {
    std::vector<PetscInt> below;
    for (PetscInt i = k + 1; i < n; ++i)
      if (full[i][k]) below.push_back(i);
    for (PetscInt i : below)
      for (PetscInt j : below) full[i][j] = true;
    work.factor += 1.0 + (double)below.size();
    work.flops += (1.0 + (double)below.size()) * (1.0 + (double)below.size());
  }
  return work;
}

TEST(LinearOrdering, IsAPermutationAndSavesFill)
{
  Triplets entries = block(8, 8, 8, false);
  Mat     A;
  OK(create_matrix(entries, &A));
  const std::vector<PetscInt> order = order_of(A, MATORDERINGMETISND), again = order_of(A, MATORDERINGMETISND);
  std::vector<PetscInt>       natural(order.size());
  std::vector<bool>           met(order.size(), false);
  for (size_t k = 0; k < order.size(); ++k) {
    natural[k] = (PetscInt)k;
    ASSERT_TRUE(order[k] >= 0 && order[k] < (PetscInt)order.size() && !met[order[k]]);
    met[order[k]] = true;
  }
  EXPECT_EQ(order, again);
  EXPECT_LT(1.5 * work_of(A, order).flops, work_of(A, natural).flops);
  OK(MatDestroy(&A));
}

TEST(LinearOrdering, RegistrationTwiceChangesNothing)
{
  Triplets entries = chain(5, 0);
  Mat     A;
  OK(create_matrix(entries, &A));
  const std::vector<PetscInt> before = order_of(A, MATORDERINGMETISND);
  OK(LinearRegister());
  OK(LinearRegister());
  EXPECT_EQ(before, order_of(A, MATORDERINGMETISND));
  OK(MatDestroy(&A));
}

TEST(LinearOrdering, DiagonalMatrixHasNoEdges)
{
  Triplets entries;
  Mat     A;
  entries.n = 4;
  for (PetscInt i = 0; i < 4; ++i) entries.add(i, i, 1.0 + i);
  OK(create_matrix(entries, &A));
  EXPECT_EQ(order_of(A, MATORDERINGMETISND).size(), 4u);
  OK(MatDestroy(&A));
}

/* The direction of the permutation is visible in the fill of PETSc's own factorization */
TEST(LinearOrdering, PetscFactorsWithLessFill)
{
  Triplets       entries = block(5, 5, 5, false);
  Mat           A, F;
  IS            row, col;
  MatFactorInfo factor_info;
  MatInfo       info;
  OK(create_matrix(entries, &A));
  const std::vector<PetscInt> order = order_of(A, MATORDERINGMETISND);
  OK(MatGetOrdering(A, MATORDERINGMETISND, &row, &col));
  OK(MatFactorInfoInitialize(&factor_info));
  OK(MatGetFactor(A, MATSOLVERPETSC, MAT_FACTOR_LU, &F));
  OK(MatLUFactorSymbolic(F, A, row, col, &factor_info));
  OK(MatGetInfo(F, MAT_LOCAL, &info));
  EXPECT_DOUBLE_EQ(info.nz_used, 2 * work_of(A, order).factor - entries.n);
  OK(ISDestroy(&row));
  OK(ISDestroy(&col));
  OK(MatDestroy(&F));
  OK(MatDestroy(&A));
}

/* ---- the count of work ---- */

TEST(LinearWork, AgreesWithElimination)
{
  std::mt19937 random(7);
  for (int trial = 0; trial < 10; ++trial) {
    Triplets entries;
    Mat     A;
    entries.n = 40;
    for (PetscInt i = 0; i < 40; ++i) entries.add(i, i, 1.0);
    for (int k = 0; k < 60; ++k)
      entries.add((PetscInt)(random() % 40), (PetscInt)(random() % 40), 1.0); /* unsymmetric */
    OK(create_matrix(entries, &A));
    for (const char *type : {"natural", MATORDERINGMETISND}) {
      const std::vector<PetscInt> order   = order_of(A, type);
      const LinearWork            counted = work_of(A, order), eliminated = work_by_elimination(A, order);
      EXPECT_EQ(counted.factor, eliminated.factor);
      EXPECT_EQ(counted.flops, eliminated.flops);
    }
    OK(MatDestroy(&A));
  }
}

TEST(LinearWork, StopsAtItsLimit)
{
  Triplets     entries = block(6, 6, 6, false);
  Mat         A;
  LinearGraph graph;
  LinearWork  work;
  PetscBool   done, bounded;
  OK(create_matrix(entries, &A));
  OK(LinearGraphFromMat(A, &graph, &done));
  LinearCountWork(graph, order_of(A, "natural").data(), 1000, &work, &bounded);
  EXPECT_FALSE(bounded);
  EXPECT_GT(work.factor, 1000);
  EXPECT_LT(work.factor, 3000);
  OK(MatDestroy(&A));
}

/* ---- symmetry ---- */

TEST(LinearSymmetry, IsSeen)
{
  Triplets   entries = chain(200, 3);
  Mat       A;
  PetscBool symmetric;
  OK(create_matrix(entries, &A));
  OK(LinearIsSymmetric(A, &symmetric));
  EXPECT_TRUE(symmetric);

  /* Large and small scales in one matrix, as for masses in kg and moments of inertia of small parts */
  Vec d;
  OK(MatCreateVecs(A, &d, NULL));
  for (PetscInt i = 0; i < entries.n; ++i)
    OK(VecSetValue(d, i, PetscPowReal(10.0, (PetscReal)(i % 9) - 4), INSERT_VALUES));
  OK(VecAssemblyBegin(d));
  OK(VecAssemblyEnd(d));
  OK(MatDiagonalScale(A, d, d));
  OK(LinearIsSymmetric(A, &symmetric));
  EXPECT_TRUE(symmetric);
  OK(VecDestroy(&d));
  OK(MatDestroy(&A));
}

TEST(LinearSymmetry, OneWrongEntryIsSeen)
{
  for (double relative : {1e-9, 1e-6, 1.0}) {
    Triplets   entries = chain(200, 3);
    Mat       A;
    PetscBool symmetric;
    entries.add(301, 300, relative); /* row and column of one body, with entries of order one */
    OK(create_matrix(entries, &A));
    OK(LinearIsSymmetric(A, &symmetric));
    EXPECT_FALSE(symmetric) << relative;
    OK(MatDestroy(&A));
  }
}

/* ---- redundant constraints ---- */

std::vector<PetscInt> dependent(const Triplets &entries, PetscInt first_multiplier, PetscInt max = 100)
{
  Mat                   A;
  IS                    multipliers;
  PetscInt              n = -1;
  std::vector<PetscInt> rows(max);
  EXPECT_EQ(create_matrix(entries, &A), 0);
  EXPECT_EQ(ISCreateStride(PETSC_COMM_SELF, entries.n - first_multiplier, first_multiplier, 1, &multipliers), 0);
  EXPECT_EQ(LinearNameDependent(A, multipliers, 1e-9, max, &n, rows.data()), 0);
  EXPECT_EQ(ISDestroy(&multipliers), 0);
  EXPECT_EQ(MatDestroy(&A), 0);
  rows.resize(n);
  return rows;
}

TEST(LinearDependent, NoneInARegularMatrix)
{
  for (PetscInt bodies : {1, 10, 300}) {
    Triplets entries = chain(bodies, 0);
    EXPECT_TRUE(dependent(entries, 3 * bodies).empty()) << bodies;
  }
}

TEST(LinearDependent, DoubledConstraint)
{
  Triplets        entries = chain(10, 0);
  const PetscInt first = 30, twice = first + 8, row = entries.n++;
  for (size_t k = 0, size = entries.row.size(); k < size; ++k)
    if (entries.row[k] == twice) entries.add_symmetric(row, entries.col[k], -3.0 * entries.val[k]);
  EXPECT_EQ(dependent(entries, first), (std::vector<PetscInt>{twice, row}));
}

/* Two independent dependences of very different scale: all rows of both are named, and no others */
TEST(LinearDependent, TwoDependencesOfDifferentScale)
{
  Triplets        entries = chain(40, 0);
  const PetscInt first = 120, a = first + 3, b = first + 30, c = first + 51, ab = entries.n++, cc = entries.n++;
  for (size_t k = 0, size = entries.row.size(); k < size; ++k) {
    if (entries.row[k] == a) entries.add_symmetric(ab, entries.col[k], entries.val[k]);
    if (entries.row[k] == b) entries.add_symmetric(ab, entries.col[k], 0.5 * entries.val[k]);
    if (entries.row[k] == c) entries.add_symmetric(cc, entries.col[k], 1e5 * entries.val[k]);
  }
  EXPECT_EQ(dependent(entries, first), (std::vector<PetscInt>{a, b, c, ab, cc}));
  EXPECT_EQ(dependent(entries, first, 2).size(), 2u);
}

/* A loop: the pairwise distances of three points on a line are fixed, x2-x1, x3-x2, x1-x3; the fourth constraint is
   independent */
TEST(LinearDependent, Loop)
{
  Triplets e;
  e.n                 = 8;
  const double mass[] = {1e3, 2.0, 1e-2, 5.0};
  for (PetscInt i = 0; i < 4; ++i) e.add(i, i, mass[i]);
  const PetscInt ends[4][2] = {{0, 1}, {1, 2}, {2, 0}, {3, 0}};
  for (PetscInt c = 0; c < 4; ++c) {
    e.add_symmetric(4 + c, ends[c][0], -1.0);
    e.add_symmetric(4 + c, ends[c][1], 1.0);
  }
  EXPECT_EQ(dependent(e, 4), (std::vector<PetscInt>{4, 5, 6}));
}

TEST(LinearDependent, MultiplierWithoutCoordinates)
{
  Triplets        entries = chain(3, 0);
  const PetscInt empty   = entries.n++;
  entries.add(empty, empty, 0.0);
  EXPECT_EQ(dependent(entries, 9), (std::vector<PetscInt>{empty}));
}

} // namespace
