/* The preconditioner "hhtconstraint": what it leaves out, conjugate gradients on the constraints, what it refuses */
#include "linear/constraint.h"
#include "bench/linear_matrices.h"
#include "view_text.h"
#include <gtest/gtest.h>
#include <hhtdae/hhtdae.h>
#include <petscksp.h>
#include <string>
#include <vector>

#define OK(call) ASSERT_EQ((call), 0)

namespace
{

/* Bricks held by multipliers at one face, unknowns 0 to coordinates - 1 of nodes of three */
class ConstraintPC : public testing::Test
{
protected:
  Mat      A = NULL;
  KSP      ksp = NULL;
  Vec      b = NULL, x = NULL;
  PetscInt n = 0, coordinates = 0;

  void create(const Entries &e, PetscInt of_them_coordinates)
  {
    n           = e.n;
    coordinates = of_them_coordinates;
    OK(create_matrix(e, &A));
    OK(MatCreateVecs(A, &x, &b));
    OK(VecSetRandom(b, NULL));
  }
  void bricks(PetscInt size) { create(block(size, size, size, true), 3 * (size + 1) * (size + 1) * (size + 1)); }
  void TearDown() override
  {
    OK(KSPDestroy(&ksp));
    OK(VecDestroy(&b));
    OK(VecDestroy(&x));
    OK(MatDestroy(&A));
  }
  void nodes(PetscInt size)
  {
    IS is;
    OK(ISCreateStride(PETSC_COMM_SELF, coordinates, 0, 1, &is));
    OK(ISSetBlockSize(is, size));
    OK(PetscObjectCompose((PetscObject)A, LINEAR_NODES, (PetscObject)is));
    OK(ISDestroy(&is));
  }
  void solver(const char type[], PetscReal rtol)
  {
    PC pc;
    OK(KSPCreate(PETSC_COMM_SELF, &ksp));
    OK(KSPSetType(ksp, type));
    OK(KSPSetOperators(ksp, A, A));
    OK(KSPSetTolerances(ksp, rtol, 0, PETSC_DEFAULT, 500));
    OK(KSPGetPC(ksp, &pc));
    OK(PCSetType(pc, PCHHTCONSTRAINT));
  }
  KSPConvergedReason solve()
  {
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    EXPECT_EQ(KSPSolve(ksp, b, x), 0);
    EXPECT_EQ(KSPGetConvergedReason(ksp, &reason), 0);
    return reason;
  }
  /* largest entries of b - A y, of rows of coordinates and of constraints */
  void left(Vec y, double *of_coordinates, double *of_constraints)
  {
    const PetscScalar *r;
    Vec                w;
    OK(VecDuplicate(b, &w));
    OK(MatMult(A, y, w));
    OK(VecAYPX(w, -1, b));
    OK(VecGetArrayRead(w, &r));
    *of_coordinates = *of_constraints = 0;
    for (PetscInt i = 0; i < n; i++) {
      double &most = i < coordinates ? *of_coordinates : *of_constraints;
      most         = std::max(most, std::abs(r[i]));
    }
    OK(VecRestoreArrayRead(w, &r));
    OK(VecDestroy(&w));
  }
  PetscInt iterations()
  {
    PetscInt its = 0;
    EXPECT_EQ(KSPGetIterationNumber(ksp, &its), 0);
    return its;
  }
  std::string view()
  {
    return ViewText([this](PetscViewer viewer) { return KSPView(ksp, viewer); });
  }

public:
  double worst_on_the_way = 0;
  static PetscErrorCode watch(KSP ksp, PetscInt, PetscReal, void *ctx)
  {
    auto  *t = static_cast<ConstraintPC *>(ctx);
    Vec    y;
    double forces, constraints;
    PetscFunctionBegin;
    PetscCall(VecDuplicate(t->b, &y));
    PetscCall(KSPBuildSolution(ksp, y, NULL));
    t->left(y, &forces, &constraints);
    t->worst_on_the_way = std::max(t->worst_on_the_way, constraints);
    PetscCall(VecDestroy(&y));
    PetscFunctionReturn(0);
  }
};

} // namespace

/* Every iterate of conjugate gradients satisfies the constraints, and they converge although the matrix is indefinite */
TEST_F(ConstraintPC, ConjugateGradientsMoveAlongTheConstraints)
{
  double forces, constraints;
  bricks(6);
  nodes(3);
  solver(KSPCG, 1e-10);
  OK(KSPMonitorSet(ksp, watch, this, NULL));
  EXPECT_GT(solve(), 0);
  left(x, &forces, &constraints);
  EXPECT_LT(forces, 1e-7);
  EXPECT_LT(constraints, 1e-12);
  EXPECT_LT(worst_on_the_way, 1e-12);
  EXPECT_GT(iterations(), 5);
  EXPECT_LT(iterations(), 100);
}

TEST_F(ConstraintPC, MinimalResidualsConvergeAsWell)
{
  double forces, constraints;
  bricks(4);
  solver(KSPFGMRES, 1e-10);
  EXPECT_GT(solve(), 0);
  left(x, &forces, &constraints);
  EXPECT_LT(forces, 1e-7);
  EXPECT_LT(constraints, 1e-9);
}

/* Nodes are found by the pattern of their rows, but for those that multipliers single out */
TEST_F(ConstraintPC, NodesToldAndFound)
{
  bricks(3);
  solver(KSPCG, 1e-6);
  EXPECT_GT(solve(), 0);
  const PetscInt found = iterations();
  EXPECT_NE(view().find(std::to_string(64 + 2 * 16) + " nodes"), std::string::npos) << view();
  nodes(3);
  OK(KSPDestroy(&ksp));
  solver(KSPCG, 1e-6);
  EXPECT_GT(solve(), 0);
  EXPECT_NE(view().find("64 nodes"), std::string::npos) << view();
  EXPECT_LE(iterations(), found + 1);
  /* one node of all: the factorization of the whole */
  nodes(coordinates);
  OK(KSPDestroy(&ksp));
  solver(KSPCG, 1e-6);
  EXPECT_GT(solve(), 0);
  EXPECT_LE(iterations(), 1);
}

/* New values in the old pattern, and another matrix */
TEST_F(ConstraintPC, FollowsTheMatrix)
{
  double forces, constraints;
  bricks(3);
  nodes(3);
  solver(KSPCG, 1e-10);
  EXPECT_GT(solve(), 0);
  OK(MatScale(A, 3));
  EXPECT_GT(solve(), 0);
  left(x, &forces, &constraints);
  EXPECT_LT(forces, 1e-7);
  EXPECT_LT(constraints, 1e-12);
  OK(VecDestroy(&b));
  OK(VecDestroy(&x));
  OK(MatDestroy(&A));
  OK(KSPReset(ksp));
  bricks(4);
  OK(KSPSetOperators(ksp, A, A));
  EXPECT_GT(solve(), 0);
  left(x, &forces, &constraints);
  EXPECT_LT(forces, 1e-7);
}

/* Constraints that say the same thing twice: the solve fails, and says so */
TEST_F(ConstraintPC, DependentConstraintsFail)
{
  Entries e = block(2, 2, 2, true);
  for (PetscInt d = 0; d < 3; d++) e.add_symmetric(d, e.n++, 1.0);
  create(e, 81);
  nodes(3);
  solver(KSPCG, 1e-8);
  EXPECT_LT(solve(), 0);
}

TEST_F(ConstraintPC, Refusals)
{
  Mat triangle;
  bricks(2);
  OK(MatSetOption(A, MAT_SYMMETRIC, PETSC_TRUE));
  OK(MatConvert(A, MATSEQSBAIJ, MAT_INITIAL_MATRIX, &triangle));
  solver(KSPCG, 1e-8);
  OK(KSPSetOperators(ksp, triangle, triangle));
  OK(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  EXPECT_EQ(KSPSetUp(ksp), PETSC_ERR_SUP);
  OK(PetscPopErrorHandler());
  OK(MatDestroy(&triangle));
  OK(KSPDestroy(&ksp));
  IS elsewhere;
  OK(ISCreateStride(PETSC_COMM_SELF, 3, n, 1, &elsewhere));
  OK(PetscObjectCompose((PetscObject)A, LINEAR_NODES, (PetscObject)elsewhere));
  OK(ISDestroy(&elsewhere));
  solver(KSPCG, 1e-8);
  OK(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  EXPECT_EQ(KSPSetUp(ksp), PETSC_ERR_ARG_OUTOFRANGE);
  OK(PetscPopErrorHandler());
}
