/* The solver type "klupair": dense parts by panels */
#include "klupair_test.h"
#include "linear/linear.h"
#include <algorithm>
#include <random>

namespace
{

/* A body with dense unsymmetric modal blocks that carries other bodies by constraints on all modes; each of these
   carries a short chain */
Triplets modal_carrier(std::mt19937 &random, PetscInt modes, PetscInt attachments)
{
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Triplets                                e;
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

/* Dense diagonal blocks with entries coupling each to the following ones; unknowns in random order */
Triplets dense_blocks(std::mt19937 &random, PetscInt blocks, PetscInt size)
{
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<PetscInt>                  name(blocks * size);
  Triplets                                e;
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

  /* Changes every value slightly; structural zeros stay */
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

  /* Keeps this part of A and B of coupled_blocks(), and the whole coupling */
  void leave(double part, PetscInt n)
  {
    OK(MatScale(A, part));
    for (PetscInt i = 0; i < n; ++i) {
      set(i, n + i, 1.0);
      set(n + i, i, 1.0);
    }
  }

  /* Compares with the solution without panels and without old pivots */
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
  for (const Triplets &e : {modal_carrier(random, 60, 8), modal_carrier(random, 130, 3), modal_carrier(random, 80, 1),
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

/* Sparse saddle points with a dense corner of any size, including narrow panels and pivots that KLU chose differently
   from the plan */
TEST_F(KluPairPanels, RandomSaddlePoints)
{
  std::mt19937 random(23);
  int          met = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const PetscInt dense = 40 + 3 * trial;
    Triplets        e     = random_saddle(random, 150, 20 + 3 * trial);
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

/* [A I; I B] with diagonally dominant A and B */
Triplets coupled_blocks(std::mt19937 &random, PetscInt n)
{
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Triplets                                e;
  e.n = 2 * n;
  for (PetscInt i = 0; i < n; ++i) {
    for (PetscInt j = 0; j < n; ++j)
      for (PetscInt part : {(PetscInt)0, n}) e.add(part + i, part + j, i == j ? (double)n : uniform(random));
    e.add_symmetric(i, n + i, 1.0);
  }
  return e;
}

/* Almost nothing remains of A and B */
TEST_F(KluPairPanels, GivesUpBadPivots)
{
  std::mt19937   random(9);
  const PetscInt n = 90;
  for (double left : {0.0, 1e-14}) {
    factor(coupled_blocks(random, n));
    change(random);
    again();
    ASSERT_NE(view().find(used), std::string::npos) << view();
    EXPECT_LT(residual(), 1e-12);
    leave(left, n);
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

/* Where hundreds of solves follow, pivots that have just been found are used again for panels */
TEST_F(KluPairPanels, AtOnceForManySolves)
{
  std::mt19937   random(11);
  const PetscInt n = 90;
  for (bool often : {false, true}) {
    factor(coupled_blocks(random, n));
    if (often) {
      OK(LinearSolveOften(A));
    }
    leave(1e-14, n);
    again();
    EXPECT_EQ(counts().given_up, 1);
    EXPECT_EQ(view().find(used) != std::string::npos, often) << view();
    EXPECT_LT(residual(), 1e-12);
    EXPECT_LT(residual(true), 1e-12);
    expect_same_solution(1e-10);
  }
}

/* The same errors as without panels, and no error once the matrix is regular again */
TEST_F(KluPairPanels, SingularMatricesAreReported)
{
  std::mt19937  random(13);
  const Triplets e = modal_carrier(random, 80, 2);
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

/* Panels allocate nothing where there are no dense parts, or where they are not supported */
TEST_F(KluPairPanels, OnlyWhereTheyPay)
{
  std::mt19937 random(15);
  for (const Triplets &e : {chain(300, 0), spatial_chain(300), spatial_chain(320, 8), chain(100, 5)}) {
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
