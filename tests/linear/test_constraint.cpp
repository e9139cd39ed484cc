/* The preconditioner "hhtconstraint": blocks of nodes, coarse level, conjugate gradients with constraints, refused input */
#include "constraint_fixture.h"
#include "linear/coarse.h"

/* Every iterate of conjugate gradients satisfies the constraints, and the iteration converges although the matrix is
   indefinite */
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

/* Nodes are detected by the pattern of their rows, except those that multipliers distinguish */
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
  /* all unknowns as one node: the whole matrix is factored */
  nodes(coordinates);
  OK(KSPDestroy(&ksp));
  solver(KSPCG, 1e-6);
  EXPECT_GT(solve(), 0);
  EXPECT_LE(iterations(), 1);
}

/* The nodes of the same matrix are given anew, and then no longer given */
TEST_F(ConstraintPC, FollowsTheNodes)
{
  bricks(3);
  nodes(3);
  solver(KSPCG, 1e-6);
  EXPECT_GT(solve(), 0);
  EXPECT_GT(iterations(), 1);
  nodes(coordinates); /* all unknowns as one node: the whole matrix is factored */
  OK(MatScale(A, 2));
  EXPECT_GT(solve(), 0);
  EXPECT_LE(iterations(), 1);
  OK(PetscObjectCompose((PetscObject)A, LINEAR_NODES, NULL));
  OK(MatScale(A, 2));
  EXPECT_GT(solve(), 0);
  EXPECT_NE(view().find(std::to_string(64 + 2 * 16) + " nodes"), std::string::npos) << view();
}

/* New values in the same pattern, and another matrix */
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

/* With dependent constraints the solve fails with an error that says so */
TEST_F(ConstraintPC, DependentConstraintsFail)
{
  Triplets e = block(2, 2, 2, true);
  for (PetscInt d = 0; d < 3; d++) e.add_symmetric(d, e.n++, 1.0);
  create(e, 81);
  nodes(3);
  solver(KSPCG, 1e-8);
  EXPECT_LT(solve(), 0);
}

/* With a coarse level, motions of the whole body are solved in one iteration instead of spreading brick by brick */
TEST_F(ConstraintPC, CoarseLevelKeepsIterationsDown)
{
  PetscInt without[2], with[2], i = 0;
  for (PetscInt size : {8, 24}) {
    bar(size, size / 4, size / 4);
    without[i] = iterationsWith("0");
    with[i++]  = iterationsWith("30");
    TearDown();
  }
  EXPECT_GT(without[1], 2 * without[0]);
  EXPECT_LT(with[1], 1.5 * with[0]);
  EXPECT_LT(with[1], without[1] / 2);
}

/* The coarse level is factored by panels from the first matrix on, because its many solves benefit even if a single
   factorization would not */
TEST_F(ConstraintPC, CoarseLevelByPanels)
{
  bar(12, 4, 4);
  OK(PetscOptionsSetValue(NULL, "-pc_hhtconstraint_aggregate", "20"));
  solver(KSPCG, 1e-6);
  EXPECT_GT(solve(), 0);
  EXPECT_NE(view().find("dense panels for these pivots"), std::string::npos) << view();
  OK(PetscOptionsClearValue(NULL, "-pc_hhtconstraint_aggregate"));
}

TEST_F(ConstraintPC, CoarseLevelMovesAlongTheConstraints)
{
  double forces, constraints;
  bar(8, 4, 4);
  OK(PetscOptionsSetValue(NULL, "-pc_hhtconstraint_aggregate", "30"));
  solver(KSPCG, 1e-10);
  OK(KSPMonitorSet(ksp, watch, this, NULL));
  EXPECT_GT(solve(), 0);
  OK(PetscOptionsClearValue(NULL, "-pc_hhtconstraint_aggregate"));
  left(x, &forces, &constraints);
  EXPECT_LT(forces, 1e-7);
  EXPECT_LT(constraints, 1e-12);
  EXPECT_LT(worst_on_the_way, 1e-12);
  EXPECT_NE(view().find("coarse level: 8 aggregates, " + std::to_string(6 * 8 + 2 * 3 * 25) + " unknowns"), std::string::npos) << view();
}

/* For a free block that is a single aggregate, A_c consists of its mass and its moments of inertia, scaled by its
   size; stiffness does not contribute */
TEST_F(ConstraintPC, AggregateIsARigidBody)
{
  const PetscInt size[3] = {8, 4, 2};
  const double   side[3] = {1, 0.5, 0.25}, mass = 8 * 4 * 2, radius = 0.5;
  PC             pc;
  CoarseLevel    coarse;
  PetscBool      failed;
  PetscObject    positions;
  bar(size[0], size[1], size[2], false);
  MatrixNodes nodes; /* only coordinates */
  for (PetscInt i = 0; i < n; i += 3) nodes.node_blocks.push_back(i);
  solver(KSPCG, 1e-6);
  OK(KSPGetPC(ksp, &pc));
  OK(PetscObjectQuery((PetscObject)A, LINEAR_POSITIONS, &positions));
  OK(CoarseCreate({nodes, A, (Vec)positions}, n, &coarse));
  OK(CoarseFill(pc, (Vec)positions, &coarse, &failed));
  EXPECT_FALSE(failed);
  for (PetscInt i = 0; i < 6; i++)
    for (PetscInt j = 0; j < 6; j++) {
      const double square = side[0] * side[0] + side[1] * side[1] + side[2] * side[2];
      const double moment = i < 3 ? 0 : mass * (square - side[i - 3] * side[i - 3]) / 12 / (radius * radius);
      PetscScalar  a;
      OK(MatGetValue(coarse.A, i, j, &a));
      EXPECT_NEAR(a, i != j ? 0 : i < 3 ? mass : moment, 1e-10 * mass) << i << ' ' << j;
    }
  OK(CoarseDestroy(&coarse));
}

/* Nodes on a line do not form a rigid body with six motions: each keeps its own unknowns */
TEST_F(ConstraintPC, NodesOnALineStandApart)
{
  bar(6, 2, 2);
  place([](PetscInt node, double place[3]) {
    for (int k = 0; k < 3; k++) place[k] = 0.1 * (k + 1) * (double)node;
  });
  solver(KSPCG, 1e-8);
  EXPECT_GT(solve(), 0);
  EXPECT_NE(view().find("coarse level: 0 aggregates, " + std::to_string(n) + " unknowns"), std::string::npos) << view();
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
