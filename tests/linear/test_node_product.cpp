/* Matrix-vector products in single precision, and how the preconditioner "hhtconstraint" uses them */
#include "bench/linear_matrices.h"
#include "linear/constraint.h"
#include "linear/node_product.h"
#include "view_text.h"
#include <gtest/gtest.h>
#include <hhtdae/hhtdae.h>
#include <petscksp.h>
#include <vector>

#define OK(call)       ASSERT_EQ((call), 0)
#define OK_VALUE(call) EXPECT_EQ((call), 0) /* for functions that return a value */

namespace
{

class NodeProductTest : public testing::Test
{
protected:
  static constexpr PetscInt coordinates = 3 * 5 * 4 * 4;
  Mat                       A = NULL;
  Vec                       x = NULL, b = NULL, y = NULL;
  KSP                       ksp = NULL;
  PC                        pc  = NULL;
  PetscInt                  n   = 0;
  std::vector<PetscInt>     node;

  void SetUp() override
  {
    IS is;
    OK(TSHHT3Initialize());
    const Triplets e = block(4, 3, 3, true);
    n               = e.n;
    OK(create_matrix(e, &A));
    OK(MatCreateVecs(A, &x, &b));
    OK(VecDuplicate(b, &y));
    OK(VecSetRandom(x, NULL));
    OK(VecSetRandom(b, NULL));
    for (PetscInt i = 0; i < n; i++) node.push_back(i < coordinates ? i - i % 3 : -1);
    OK(ISCreateStride(PETSC_COMM_SELF, coordinates, 0, 1, &is));
    OK(ISSetBlockSize(is, 3));
    OK(PetscObjectCompose((PetscObject)A, LINEAR_NODES, (PetscObject)is));
    OK(ISDestroy(&is));
  }
  void TearDown() override
  {
    OK(KSPDestroy(&ksp));
    for (Vec *v : {&x, &b, &y}) OK(VecDestroy(v));
    OK(MatDestroy(&A));
  }
  /* Largest difference of the products with x, relative to the largest entry, in rows of coordinates and of constraints */
  void difference(NodeProduct &p, double *of_coordinates, double *of_constraints)
  {
    const PetscScalar *one, *other;
    PetscReal          most;
    OK(MatMult(A, x, b));
    OK(MatMult(p.shell, x, y));
    OK(VecNorm(b, NORM_INFINITY, &most));
    OK(VecGetArrayRead(b, &one));
    OK(VecGetArrayRead(y, &other));
    *of_coordinates = *of_constraints = 0;
    for (PetscInt i = 0; i < n; i++) {
      double &worst = i < coordinates ? *of_coordinates : *of_constraints;
      worst         = std::max(worst, std::abs(one[i] - other[i]) / most);
    }
    OK(VecRestoreArrayRead(b, &one));
    OK(VecRestoreArrayRead(y, &other));
  }
  void solver(PetscReal rtol)
  {
    OK(KSPDestroy(&ksp));
    OK(KSPCreate(PETSC_COMM_SELF, &ksp));
    OK(KSPSetType(ksp, KSPCG));
    OK(KSPSetOperators(ksp, A, A));
    OK(KSPSetTolerances(ksp, rtol, 0, PETSC_DEFAULT, 500));
    OK(KSPGetPC(ksp, &pc));
    OK(PCSetType(pc, PCHHTCONSTRAINT));
  }
  PetscInt solve()
  {
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    PetscInt           its    = -1;
    OK_VALUE(KSPSolve(ksp, b, y));
    OK_VALUE(KSPGetConvergedReason(ksp, &reason));
    OK_VALUE(KSPGetIterationNumber(ksp, &its));
    EXPECT_GT(reason, 0);
    return its;
  }
  /* ||b - A y|| / ||b|| */
  PetscReal left()
  {
    PetscReal whole = 1, rest = 0;
    OK_VALUE(VecNorm(b, NORM_2, &whole));
    OK_VALUE(MatMult(A, y, x));
    OK_VALUE(VecAYPX(x, -1, b));
    OK_VALUE(VecNorm(x, NORM_2, &rest));
    return rest / whole;
  }
  bool says(const char text[])
  {
    return ViewText([this](PetscViewer viewer) { return KSPView(ksp, viewer); }).find(text) != std::string::npos;
  }
};

} // namespace

/* Rows of coordinates agree to single precision, rows of constraints to double precision; of an unsymmetric matrix all
   blocks are stored */
TEST_F(NodeProductTest, AgreesWithTheMatrix)
{
  NodeProduct p;
  PetscBool   usable;
  double      coordinate, constraint;
  OK(NodeProductFill(A, node, false, &p, &usable));
  EXPECT_TRUE(usable);
  EXPECT_TRUE(p.symmetric);
  const size_t half = p.own.column.size();
  difference(p, &coordinate, &constraint);
  EXPECT_LT(coordinate, 1e-6);
  EXPECT_GT(coordinate, 1e-10);
  EXPECT_LT(constraint, 1e-15);
  OK(MatScale(A, 3)); /* new values */
  OK(NodeProductFill(A, node, true, &p, &usable));
  difference(p, &coordinate, &constraint);
  EXPECT_LT(coordinate, 1e-6);
  OK(MatSetOption(A, MAT_NEW_NONZERO_LOCATIONS, PETSC_FALSE));
  OK(MatSetValue(A, 0, 3, 1, ADD_VALUES));
  OK(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  OK(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  OK(NodeProductFill(A, node, true, &p, &usable));
  EXPECT_FALSE(p.symmetric);
  EXPECT_EQ(p.own.column.size(), 2 * half - p.row.size());
  difference(p, &coordinate, &constraint);
  EXPECT_LT(coordinate, 1e-6);
  EXPECT_LT(constraint, 1e-15);
  OK(NodeProductDestroy(&p));
}

/* In a matrix of two million entries a single entry is unsymmetric, by a small amount far above the rounding of single
   precision */
TEST(NodeProduct, OneUnsymmetricEntry)
{
  Mat                   A;
  Vec                   x, y;
  NodeProduct           p;
  PetscBool             usable;
  PetscScalar           entry;
  const PetscInt        first = 3 * 10 * 21 * 21, second = first + 3;
  const Triplets         e = block(20, 20, 20, false);
  std::vector<PetscInt> node;
  OK(TSHHT3Initialize());
  OK(create_matrix(e, &A));
  for (PetscInt i = 0; i < e.n; i++) node.push_back(i - i % 3);
  OK(NodeProductFill(A, node, false, &p, &usable));
  EXPECT_TRUE(p.symmetric);
  OK(MatGetValue(A, first, first, &entry));
  OK(MatSetValue(A, first, second, 2e-6 * entry, ADD_VALUES));
  OK(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  OK(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  OK(NodeProductFill(A, node, true, &p, &usable));
  EXPECT_FALSE(p.symmetric);
  OK(MatCreateVecs(A, &x, &y));
  OK(VecSetValue(x, first, 1, INSERT_VALUES)); /* a vector for its column only, so that the transposed entry does not contribute */
  OK(VecAssemblyBegin(x));
  OK(VecAssemblyEnd(x));
  OK(MatMult(p.shell, x, y));
  PetscScalar of_product, of_matrix;
  OK(VecGetValues(y, 1, &second, &of_product));
  OK(MatGetValue(A, second, first, &of_matrix));
  EXPECT_NEAR(of_product, of_matrix, 2e-7 * entry);
  OK(NodeProductDestroy(&p));
  OK(VecDestroy(&x));
  OK(VecDestroy(&y));
  OK(MatDestroy(&A));
}

/* For a few digits single precision is used, for many it is not; the user's operator is unchanged afterwards */
TEST_F(NodeProductTest, ServesFewDigits)
{
  Mat of_user;
  solver(1e-2);
  EXPECT_GT(solve(), 1);
  EXPECT_TRUE(says("in single precision"));
  EXPECT_LT(left(), 0.1);
  OK(PCGetOperators(pc, &of_user, NULL));
  EXPECT_EQ(of_user, A);
  solver(1e-12);
  EXPECT_GT(solve(), 1);
  EXPECT_LT(left(), 1e-10);
  OK(PetscOptionsSetValue(NULL, "-pc_hhtconstraint_single", "0"));
  solver(1e-2);
  EXPECT_GT(solve(), 1);
  OK(PetscOptionsClearValue(NULL, "-pc_hhtconstraint_single"));
  EXPECT_TRUE(says("products in double precision"));
}

/* Entries beyond the range of single precision */
TEST_F(NodeProductTest, OutOfRange)
{
  OK(MatScale(A, 1e30));
  solver(1e-2);
  EXPECT_GT(solve(), 1);
  EXPECT_TRUE(says("products in double precision"));
  EXPECT_LT(left(), 0.1);
}

/* Springs to the ground that are weak compared with those between nodes: the stiffness of rigid motions is lost in the
   rounding of single precision */
TEST_F(NodeProductTest, RoundingIsMeasured)
{
  const PetscInt first = coordinates;
  OK(MatDestroy(&A));
  Triplets e = block(4, 3, 3, false);
  OK(create_matrix(e, &A));
  /* In 1e10 (A - its row sums of each component) + 1 rigid translations have only the stiffness of the springs */
  for (PetscInt i = 0; i < first; i++) {
    PetscScalar        sum = 0;
    PetscInt           m;
    const PetscInt    *col;
    const PetscScalar *value;
    OK(MatGetRow(A, i, &m, &col, &value));
    for (PetscInt k = 0; k < m; k++)
      if (col[k] % 3 == i % 3) sum += value[k];
    OK(MatRestoreRow(A, i, &m, &col, &value));
    OK(MatSetValue(A, i, i, -sum, ADD_VALUES));
    OK(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    OK(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  }
  OK(MatScale(A, 1e10));
  OK(MatShift(A, 1));
  IS is;
  OK(ISCreateStride(PETSC_COMM_SELF, first, 0, 1, &is));
  OK(ISSetBlockSize(is, 3));
  OK(PetscObjectCompose((PetscObject)A, LINEAR_NODES, (PetscObject)is));
  OK(ISDestroy(&is));
  for (Vec *v : {&x, &b, &y}) OK(VecDestroy(v));
  OK(MatCreateVecs(A, &x, &b));
  OK(VecDuplicate(b, &y));
  OK(VecSet(b, 1));
  solver(1e-2);
  OK(KSPSolve(ksp, b, y));
  EXPECT_TRUE(says("products in double precision"));
}
