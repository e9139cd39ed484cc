/* Shared by the tests of "klupair": matrices, planned pivots and factors */
#ifndef HHTDAE_TESTS_KLUPAIR_TEST_H
#define HHTDAE_TESTS_KLUPAIR_TEST_H

#include "linear/klupair.h"
#include "linear/klupair_matching.h"
#include "bench/linear_matrices.h"
#include "view_text.h"
#include <gtest/gtest.h>
#include <petscmat.h>
#include <random>
#include <string>

#define OK(call) ASSERT_EQ((call), 0)

struct Rows {
  Mat        A;
  LinearRows rows;
  explicit Rows(const Triplets &entries)
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

/* Checks that the pivots form a permutation; returns the number of zero pivots */
inline PetscInt zero_pivots(const Rows &A, const LinearPivots &p)
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

inline LinearPivots pivots_of(const Triplets &entries, PetscInt zeros_left = 0)
{
  const Rows   A(entries);
  LinearPivots p;
  LinearFindPivots(A.rows, &p);
  EXPECT_EQ((PetscInt)p.col.size(), entries.n);
  EXPECT_EQ(zero_pivots(A, p), zeros_left);
  return p;
}

/* [D B; C 0] with up to three quarters of the unknowns being multipliers, unsymmetric values, entries over six orders
   of magnitude */
inline Triplets random_saddle(std::mt19937 &random, PetscInt coordinates, PetscInt multipliers)
{
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Triplets                                e;
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
    Triplets   entries = chain(1, 0);
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

  void factor(const Triplets &entries, IS order = NULL)
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

#endif
