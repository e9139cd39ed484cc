/* The preconditioner "hhtconstraint": what it leaves out, its coarse level, conjugate gradients on the constraints, what it refuses */
#include "linear/coarse.h"
#include "linear/constraint.h"
#include "linear/linear.h"
#include "bench/linear_matrices.h"
#include "view_text.h"
#include <gtest/gtest.h>
#include <hhtdae/hhtdae.h>
#include <cstring>
#include <petscksp.h>
#include <string>
#include <vector>

#define OK(call)       ASSERT_EQ((call), 0)
#define OK_VALUE(call) EXPECT_EQ((call), 0) /* in functions that return a value */

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
  /* with the positions of all nodes, of bricks of 1/nx */
  void bar(PetscInt nx, PetscInt ny, PetscInt nz, bool clamped = true)
  {
    create(block(nx, ny, nz, clamped), 3 * (nx + 1) * (ny + 1) * (nz + 1));
    nodes(3);
    place([&](PetscInt node, double place[3]) {
      place[0] = (double)(node % (nx + 1)) / (double)nx;
      place[1] = (double)(node / (nx + 1) % (ny + 1)) / (double)nx;
      place[2] = (double)(node / (nx + 1) / (ny + 1)) / (double)nx;
    });
  }
  template <class Place> void place(Place at)
  {
    Vec          positions;
    PetscScalar *place;
    OK(MatCreateVecs(A, &positions, NULL));
    OK(VecGetArray(positions, &place));
    for (PetscInt i = 0; i < coordinates; i += 3) at(i / 3, place + i);
    OK(VecRestoreArray(positions, &place));
    OK(PetscObjectCompose((PetscObject)A, LINEAR_POSITIONS, (PetscObject)positions));
    OK(VecDestroy(&positions));
  }
  PetscInt iterationsWith(const char aggregate[])
  {
    OK_VALUE(PetscOptionsSetValue(NULL, "-pc_hhtconstraint_aggregate", aggregate));
    solver(KSPCG, 1e-6);
    EXPECT_GT(solve(), 0);
    const PetscInt its = iterations();
    OK_VALUE(PetscOptionsClearValue(NULL, "-pc_hhtconstraint_aggregate"));
    OK_VALUE(KSPDestroy(&ksp));
    return its;
  }
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

/* What the whole body does crosses it in one iteration, not brick by brick */
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

/* Of a block that is not held and moves as one aggregate A_c is its mass and its moments of inertia, in units of its size: stiffness has no part in it */
TEST_F(ConstraintPC, AggregateIsARigidBody)
{
  const PetscInt size[3] = {8, 4, 2};
  const double   side[3] = {1, 0.5, 0.25}, mass = 8 * 4 * 2, radius = 0.5;
  PC             pc;
  CoarseLevel    coarse;
  PetscBool      failed;
  PetscObject    positions;
  bar(size[0], size[1], size[2], false);
  MatrixNodes nodes; /* nothing but nodes */
  for (PetscInt i = 0; i < n; i += 3) nodes.alone.push_back(i);
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

/* Nodes on a line are no rigid body: each keeps its own unknowns */
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

/* A body whose factor is large: the choice, and the way back where conjugate gradients do not serve */
class LargeBody : public ConstraintPC
{
protected:
  LinearChoice choice;

  void choose(bool positions, const char *options = NULL, bool rough = true)
  {
    create(block(20, 20, 20, true), 3 * 21 * 21 * 21);
    nodes(3);
    if (positions) {
      place([&](PetscInt node, double place[3]) {
        place[0] = node % 21;
        place[1] = node / 21 % 21;
        place[2] = node / 21 / 21;
      });
    }
    if (options) { OK(PetscOptionsInsertString(NULL, options)); }
    OK(KSPCreate(PETSC_COMM_SELF, &ksp));
    OK(LinearDefaults(ksp, &choice));
    choice.may_be_rough = (PetscBool)rough;
    OK(KSPSetFromOptions(ksp));
    OK(KSPSetOperators(ksp, A, A));
    OK(LinearChoose(ksp, A, PETSC_TRUE, &choice));
    if (options) { OK(PetscOptionsClear(NULL)); }
  }
  bool isConstraint()
  {
    PC        pc;
    PetscBool is = PETSC_FALSE;
    EXPECT_EQ(KSPGetPC(ksp, &pc), 0);
    EXPECT_EQ(PetscObjectTypeCompare((PetscObject)pc, PCHHTCONSTRAINT, &is), 0);
    return is;
  }
  /* b - A x relative to b */
  double leftOf()
  {
    PetscReal all = 0;
    double    forces = 0, constraints = 0;
    EXPECT_EQ(VecNorm(b, NORM_INFINITY, &all), 0);
    left(x, &forces, &constraints);
    return std::max(forces, constraints) / all;
  }
};

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
  OK(LinearDefaults(ksp, &anew)); /* another set-up: what was chosen is not taken for the user's */
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
  EXPECT_LT(leftOf(), 1e-3); /* of a factor in single precision at least */
  OK(LinearChoose(ksp, A, PETSC_TRUE, &choice));
  EXPECT_FALSE(isConstraint()) << "they are not tried again";
}

/* Rows of multipliers that are not the transpose of their columns, as those of joints and motions: half of what they were */
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

/* ---- what a run that goes on takes over ---- */

namespace
{

/* A solver of one run, and that of another one with the same matrix which takes over its state */
class SolverState : public LargeBody
{
protected:
  Archive   archive;
  KSP       other = NULL;
  Vec       y     = NULL;
  PetscBool same = PETSC_FALSE, usable = PETSC_FALSE;

  void TearDown() override
  {
    OK(KSPDestroy(&other));
    OK(VecDestroy(&y));
    LargeBody::TearDown();
  }
  /* As the integrator makes a KSP that the user chooses; "" for ours */
  void make(KSP *to, LinearChoice *of, const char type[], PetscReal rtol)
  {
    PC pc;
    OK(KSPCreate(PETSC_COMM_SELF, to));
    OK(KSPGetPC(*to, &pc));
    if (type[0]) {
      OK(KSPSetType(*to, type));
      OK(PCSetType(pc, PCHHTCONSTRAINT));
      OK(KSPSetTolerances(*to, rtol, 0, PETSC_DEFAULT, 500));
    }
    OK(LinearDefaults(*to, of));
    of->may_be_rough = PETSC_TRUE;
    OK(KSPSetFromOptions(*to));
    OK(KSPSetOperators(*to, A, A));
  }
  void first(const char type[], PetscReal rtol)
  {
    PetscBool symmetric;
    make(&ksp, &choice, type, rtol);
    OK(LinearIsSymmetric(A, &symmetric));
    OK(LinearChoose(ksp, A, symmetric, &choice));
  }
  void save() { OK(LinearSaveState(ksp, choice, &archive)); }
  void load(const char type[], PetscReal rtol, LinearChoice *of)
  {
    archive.reading = true;
    make(&other, of, type, rtol);
    OK(LinearLoadState(other, A, of, &archive, &same, &usable));
  }
  void goOn(const char type[], PetscReal rtol, LinearChoice *of)
  {
    save();
    load(type, rtol, of);
    EXPECT_TRUE(same);
    EXPECT_TRUE(usable);
  }
  /* The next solve of both */
  void expectSameSolve()
  {
    PetscBool equal = PETSC_FALSE;
    if (!y) { OK(VecDuplicate(x, &y)); }
    OK(KSPSolve(ksp, b, x));
    OK(KSPSolve(other, b, y));
    OK(VecEqual(x, y, &equal));
    EXPECT_TRUE(equal);
  }
  std::string viewOf(KSP of)
  {
    return ViewText([of](PetscViewer viewer) { return KSPView(of, viewer); });
  }
};

} // namespace

/* What rounding of the products leaves is measured at the first solve with a matrix: later ones, which it would not suit, are not judged */
TEST_F(SolverState, ProductsThatWereMeasured)
{
  LinearChoice of;
  bar(40, 4, 4);
  OK(VecSet(b, 1)); /* it bends: small forces of large ones */
  first(KSPCG, 1e-2);
  EXPECT_GT(solve(), 0);
  EXPECT_NE(view().find("single precision"), std::string::npos) << view();
  goOn(KSPCG, 1e-2, &of);
  for (KSP k : {ksp, other}) OK(KSPSetTolerances(k, 1e-4, 0, PETSC_DEFAULT, 500));
  expectSameSolve();
  EXPECT_NE(viewOf(other).find("single precision"), std::string::npos);
  OK(KSPDestroy(&ksp));
  solver(KSPCG, 1e-4);
  EXPECT_GT(solve(), 0);
  EXPECT_NE(view().find("double precision"), std::string::npos) << "the test shows nothing";
  /* into one that has fallen back */
  Archive again;
  again.data    = archive.data;
  again.reading = true;
  OK(LinearLoadState(ksp, A, &of, &again, &same, &usable));
  EXPECT_TRUE(same && usable);
  expectSameSolve();
}

/* Conjugate gradients that were given up are not tried again; a solver that has gone on with either takes the other one as well */
TEST_F(SolverState, AFactorInPlaceOfConjugateGradients)
{
  PetscBool    changed = PETSC_FALSE;
  LinearChoice of;
  choose(true, "-ksp_max_it 3 -ksp_rtol 1e-8");
  EXPECT_LT(solve(), 0);
  save();
  Archive before;
  std::swap(archive, before);
  OK(LinearGiveUpKrylov(ksp, A, &choice, &changed));
  ASSERT_TRUE(changed);
  EXPECT_GT(solve(), 0);
  goOn("", 0, &of);
  expectSameSolve();
  OK(LinearChoose(other, A, PETSC_TRUE, &of));
  std::swap(ksp, other);
  EXPECT_FALSE(isConstraint());
  Archive after;
  after.data                     = archive.data;
  before.reading = after.reading = true;
  for (Archive *a : {&before, &after}) {
    OK(LinearLoadState(ksp, A, &of, a, &same, &usable));
    EXPECT_TRUE(same);
    EXPECT_TRUE(usable);
    EXPECT_EQ(isConstraint(), a == &before);
    EXPECT_GT(solve(), 0);
  }
  std::swap(ksp, other);
  expectSameSolve();
}

/* Where there was no room for a factor there is none later, whatever the matrix becomes */
TEST_F(SolverState, WantOfRoom)
{
  PetscBool    changed = PETSC_FALSE;
  LinearChoice of;
  bar(8, 4, 4);
  first("", 0);
  OK(LinearChooseSmaller(ksp, A, &choice, &changed));
  ASSERT_TRUE(changed);
  EXPECT_GT(solve(), 0);
  goOn("", 0, &of);
  expectSameSolve();
  OK(LinearChoose(other, A, PETSC_FALSE, &of));
  std::swap(ksp, other);
  EXPECT_TRUE(isConstraint());
}

/* A coarse matrix whose first values were not symmetric keeps the LU of the user's package */
TEST_F(SolverState, FactorizationOfTheCoarseLevel)
{
  Vec          left;
  LinearChoice of;
  bar(8, 4, 4);
  OK(PetscOptionsInsertString(NULL, "-pc_hhtconstraint_aggregate 30 -coarse_pc_factor_mat_solver_type mumpsnd"));
  OK(VecDuplicate(b, &left));
  OK(VecSet(left, 1));
  OK(VecSetValue(left, 300, 2, INSERT_VALUES));
  OK(MatDiagonalScale(A, left, NULL));
  first(KSPFGMRES, 1e-6);
  EXPECT_GT(solve(), 0);
  OK(VecReciprocal(left));
  OK(MatDiagonalScale(A, left, NULL));
  EXPECT_GT(solve(), 0);
  goOn(KSPFGMRES, 1e-6, &of);
  expectSameSolve();
  EXPECT_NE(viewOf(other).find("LU, with mumpsnd"), std::string::npos) << viewOf(other);
  OK(VecDestroy(&left));
  OK(PetscOptionsClear(NULL));
}

/* Nodes that were found in other values are not found again, and nobody says that the bits are the same */
TEST_F(SolverState, NodesOfOtherValues)
{
  LinearChoice of;
  PetscScalar  diagonal;
  bricks(3);
  OK(MatGetValue(A, 5, 5, &diagonal));
  OK(MatSetValue(A, 5, 5, 0, INSERT_VALUES));
  OK(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  OK(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  first(KSPFGMRES, 1e-6);
  OK(KSPSetUp(ksp));
  OK(MatSetValue(A, 5, 5, diagonal, INSERT_VALUES));
  OK(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  OK(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  EXPECT_GT(solve(), 0);
  save();
  load(KSPFGMRES, 1e-6, &of);
  EXPECT_FALSE(same);
  EXPECT_TRUE(usable);
  std::swap(ksp, other);
  EXPECT_GT(solve(), 0);
}

/* The user wishes otherwise now */
TEST_F(SolverState, OtherOptions)
{
  bar(8, 4, 4);
  first(KSPCG, 1e-6);
  EXPECT_GT(solve(), 0);
  for (const char *option : {"-pc_hhtconstraint_aggregate 30", "-pc_hhtconstraint_single 0", "-pc_hhtconstraint_aggregate 0"}) {
    LinearChoice of;
    archive = Archive();
    save();
    OK(PetscOptionsInsertString(NULL, option));
    load(KSPCG, 1e-6, &of);
    OK(PetscOptionsClear(NULL));
    EXPECT_FALSE(same) << option;
    EXPECT_TRUE(usable) << option;
    const std::string shown = viewOf(other);
    EXPECT_NE(shown.find(strstr(option, "30") ? "8 aggregates" : strstr(option, "single") ? "double precision" : "all else"), std::string::npos) << shown;
    OK(KSPDestroy(&other));
  }
}

/* Bytes that say something else, or end early: solved with what is taken, or said not to be usable */
TEST_F(SolverState, DamagedBytes)
{
  PetscInt refused = 0, unusable = 0;
  bar(4, 2, 2);
  OK(PetscOptionsSetValue(NULL, "-pc_hhtconstraint_aggregate", "12"));
  first(KSPCG, 1e-6);
  EXPECT_GT(solve(), 0);
  save();
  const std::vector<char> good = archive.data;
  OK(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  std::uint64_t random = 1;
  const auto    below  = [&random](std::size_t n) { return (std::size_t)((random = random * 6364136223846793005ull + 1442695040888963407ull) >> 33) % n; };
  for (int k = 0; k < 400; k++) {
    LinearChoice of;
    archive      = Archive();
    archive.data = good;
    const std::size_t at = below(k % 2 ? good.size() : std::min<std::size_t>(good.size(), 6000)); /* the division, and all */
    if (k % 8 == 0) archive.data.resize(at);
    else archive.data[at] = (char)(k % 3 ? archive.data[at] ^ (1 << below(8)) : (int)below(256));
    load(KSPCG, 1e-6, &of);
    refused += !same;
    if (usable) {
      OK(KSPSolve(other, b, x));
    } else { /* set up anew it serves */
      std::swap(ksp, other);
      OK(KSPSetOperators(ksp, A, A));
      EXPECT_GT(solve(), 0);
      std::swap(ksp, other);
      unusable++;
    }
    OK(KSPDestroy(&other));
  }
  OK(PetscPopErrorHandler());
  OK(PetscOptionsClearValue(NULL, "-pc_hhtconstraint_aggregate"));
  EXPECT_GT(refused, 50);
  EXPECT_GT(unusable, 10);
}
