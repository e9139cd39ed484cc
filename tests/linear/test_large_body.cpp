/* A body with an expensive factorization: when conjugate gradients replace the factorization, and when the
   factorization returns because they fail */
#include "constraint_fixture.h"

TEST_F(LargeBody, ConjugateGradientsTakeThePlaceOfItsFactor)
{
  PetscBool changed = PETSC_TRUE;
  choose(true);
  EXPECT_TRUE(isConstraint()) << choice.text;
  EXPECT_GT(solve(), 0);
  EXPECT_LT(iterations(), 30);
  OK(LinearGiveUpKrylov(ksp, A, &choice, &changed));
  EXPECT_FALSE(changed);
  LinearChoice anew;
  OK(LinearDefaults(ksp, &anew)); /* in another set-up the earlier choice is not taken for the user's */
  EXPECT_FALSE(anew.user_pc);
}

TEST_F(LargeBody, AFactorWhereTheyDoNotServe)
{
  PetscBool changed = PETSC_FALSE;
  choose(true, "-ksp_max_it 3 -ksp_rtol 1e-8");
  ASSERT_TRUE(isConstraint()) << choice.text;
  EXPECT_LT(solve(), 0);
  OK(LinearGiveUpKrylov(ksp, A, &choice, &changed));
  EXPECT_TRUE(changed);
  EXPECT_FALSE(isConstraint()) << choice.text;
  EXPECT_GT(solve(), 0);
  EXPECT_LT(leftOf(), 1e-3); /* at least the accuracy of a factorization in single precision */
  OK(LinearChoose(ksp, A, PETSC_TRUE, &choice));
  EXPECT_FALSE(isConstraint()) << "they are not tried again";
}

/* The rows of multipliers are not the transpose of their columns, as with joints and motions: here they are half as large */
TEST_F(LargeBody, ConjugateGradientsWhereSymmetryIsLost)
{
  Vec       scale;
  PetscBool changed = PETSC_TRUE;
  choose(true);
  ASSERT_TRUE(isConstraint()) << choice.text;
  EXPECT_GT(solve(), 0);
  const PetscInt its  = iterations();
  const double   left = leftOf();
  OK(VecDuplicate(b, &scale));
  OK(VecSet(scale, 1));
  for (PetscInt row = coordinates; row < n; row += 7) { OK(VecSetValue(scale, row, 0.5, INSERT_VALUES)); }
  OK(VecAssemblyBegin(scale));
  OK(VecAssemblyEnd(scale));
  OK(MatDiagonalScale(A, scale, NULL));
  OK(VecDestroy(&scale));
  OK(LinearChoose(ksp, A, PETSC_FALSE, &choice));
  EXPECT_TRUE(isConstraint()) << choice.text;
  EXPECT_GT(solve(), 0);
  EXPECT_LE(iterations(), its + 3);
  EXPECT_LT(leftOf(), 1.5 * left);
  OK(LinearGiveUpKrylov(ksp, A, &choice, &changed));
  EXPECT_FALSE(changed);
}

TEST_F(LargeBody, AFactorWithoutPositions) { choose(false); EXPECT_FALSE(isConstraint()) << choice.text; }
TEST_F(LargeBody, AFactorWhereNobodyRefinesSolves) { choose(true, NULL, false); EXPECT_FALSE(isConstraint()) << choice.text; }
TEST_F(LargeBody, TheUsersFactor) { choose(true, "-pc_type cholesky"); EXPECT_FALSE(isConstraint()) << choice.text; }
TEST_F(LargeBody, TheUsersPreonly) { choose(true, "-ksp_type preonly"); EXPECT_FALSE(isConstraint()) << choice.text; }
