/* What the preconditioner for finite elements receives: which unknowns form a node, and the positions of nodes */
#include "linear/constraint.h"
#include "support.h"

using namespace hhtest;

namespace
{

/* Two nodes of three unknowns, each held by springs, and one unknown that belongs to no node */
class NodesTest : public testing::Test
{
protected:
  static constexpr PetscInt n = 7;
  TS  ts = nullptr;
  Mat A  = nullptr;
  Vec u = nullptr, v = nullptr, reference = nullptr;

  static PetscErrorCode residual(TS, PetscReal, Vec U, Vec, Vec A, Vec F, void *)
  {
    PetscFunctionBegin;
    PetscCall(VecWAXPY(F, 4, U, A));
    PetscFunctionReturn(0);
  }
  static PetscErrorCode jacobian(TS, PetscReal, Vec, Vec, Vec, PetscReal, PetscReal a, Mat J, Mat, void *)
  {
    PetscFunctionBegin;
    for (PetscInt i = 0; i < n; i++) PetscCall(MatSetValue(J, i, i, a + 4, INSERT_VALUES));
    PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
    PetscFunctionReturn(0);
  }
  void SetUp() override
  {
    must(MatCreateSeqAIJ(PETSC_COMM_SELF, n, n, 1, nullptr, &A));
    must(MatCreateVecs(A, &u, &v));
    must(VecDuplicate(u, &reference));
    must(VecSet(u, 0.5));
    for (PetscInt i = 0; i < n; i++) must(VecSetValue(reference, i, (PetscScalar)(i * i), INSERT_VALUES));
    must(VecAssemblyBegin(reference));
    must(VecAssemblyEnd(reference));
    must(TSCreate(PETSC_COMM_SELF, &ts));
    must(TSSetType(ts, TSHHT3));
    must(TSSetI2Function(ts, nullptr, residual, nullptr));
    must(TSSetI2Jacobian(ts, A, A, jacobian, nullptr));
    must(TS2SetSolution(ts, u, v));
    must(TSSetTimeStep(ts, 0.01));
    must(TSSetMaxSteps(ts, 3));
    must(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_STEPOVER));
  }
  void TearDown() override
  {
    for (Vec *x : {&u, &v, &reference}) must(VecDestroy(x));
    must(MatDestroy(&A));
    must(TSDestroy(&ts));
  }
  static IS nodes(PetscInt count, PetscInt size)
  {
    IS is;
    must(ISCreateStride(PETSC_COMM_SELF, count, 0, 1, &is));
    must(ISSetBlockSize(is, size));
    return is;
  }
  PetscObject told(const char name[])
  {
    PetscObject found = nullptr;
    must(PetscObjectQuery((PetscObject)A, name, &found));
    return found;
  }
};

} // namespace

/* Positions are those at the state at which the matrix was made, reference plus unknowns; here they hardly move */
TEST_F(NodesTest, PositionsFollowTheState)
{
  IS  is = nodes(6, 3);
  Vec difference;
  must(TSHHT3SetNodes(ts, is, reference));
  must(ISDestroy(&is));
  must(TSSolve(ts, u));
  ASSERT_NE(told(LINEAR_POSITIONS), nullptr);
  must(VecDuplicate(u, &difference));
  must(VecWAXPY(difference, -1, reference, (Vec)told(LINEAR_POSITIONS)));
  PetscReal least, most;
  must(VecMin(difference, nullptr, &least));
  must(VecMax(difference, nullptr, &most));
  EXPECT_GT(least, 0.4);
  EXPECT_LT(most, 0.51);
  must(VecDestroy(&difference));
}

TEST_F(NodesTest, WithoutPositionsNoneAreMade)
{
  IS is = nodes(6, 3);
  must(TSHHT3SetNodes(ts, is, nullptr));
  must(TSSolve(ts, u));
  EXPECT_NE(told(LINEAR_NODES), nullptr);
  EXPECT_EQ(told(LINEAR_POSITIONS), nullptr);
  must(ISDestroy(&is));
}

TEST_F(NodesTest, TakenBack)
{
  IS is = nodes(6, 3);
  must(TSHHT3SetNodes(ts, is, reference));
  must(TSSolve(ts, u));
  must(TSHHT3SetNodes(ts, nullptr, nullptr));
  EXPECT_EQ(told(LINEAR_NODES), nullptr);
  EXPECT_EQ(told(LINEAR_POSITIONS), nullptr);
  must(TSSetMaxSteps(ts, 6));
  must(TSSolve(ts, u));
  EXPECT_EQ(told(LINEAR_POSITIONS), nullptr);
  must(ISDestroy(&is));
}

TEST_F(NodesTest, Refusals)
{
  IS  pairs = nodes(6, 2), whole = nodes(6, 3);
  Vec other;
  must(VecCreateSeq(PETSC_COMM_SELF, n + 1, &other));
  {
    ErrorTrap trap;
    EXPECT_EQ(TSHHT3SetNodes(ts, pairs, reference), PETSC_ERR_ARG_SIZ);
    EXPECT_TRUE(trap.says("nodes of three unknowns")) << trap.message;
    EXPECT_EQ(TSHHT3SetNodes(ts, whole, other), PETSC_ERR_ARG_SIZ);
  }
  EXPECT_EQ(TSHHT3SetNodes(ts, pairs, nullptr), 0);
  must(VecDestroy(&other));
  for (IS *is : {&pairs, &whole}) must(ISDestroy(is));
}
