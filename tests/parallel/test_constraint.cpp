/* The preconditioner "hhtconstraint" on several ranks: products in single precision, coarse level, matrices with
   changing values */
#include "distributed_matrix.h"
#include "linear/constraint.h"
#include "linear/matrix_nodes.h"
#include "linear/node_product.h"
#include <hhtdae/hhtdae.h>
#include <petscksp.h>

using namespace hhtest;

namespace
{

/* A clamped bar whose nodes are on one rank each, with multipliers on the last rank */
class ConstraintRanks : public testing::Test
{
protected:
  static constexpr PetscInt NX = 13, NY = 4, NZ = 4, nodes = NX * NY * NZ;
  Mat                       A   = nullptr;
  Vec                       x, b, y;
  KSP                       ksp = nullptr;
  PetscInt                  begin, end;

  void SetUp() override
  {
    PetscMPIInt rank, size;
    must(TSHHT3Initialize());
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    MPI_Comm_size(PETSC_COMM_WORLD, &size);
    const Triplets e = block(NX - 1, NY - 1, NZ - 1, true);
    begin           = 3 * (nodes * rank / size);
    end             = rank == size - 1 ? e.n : 3 * (nodes * (rank + 1) / size);
    A               = distributed(e, begin, end);
    must(MatCreateVecs(A, &x, &b));
    must(VecDuplicate(b, &y));
    must(VecSetRandom(x, nullptr));
    must(MatMult(A, x, b));
    tell();
  }
  void tell()
  {
    IS           is;
    Vec          positions;
    PetscScalar *place;
    const PetscInt last = std::min(end, 3 * nodes);
    must(ISCreateStride(PETSC_COMM_WORLD, last - begin, begin, 1, &is));
    must(ISSetBlockSize(is, 3));
    must(PetscObjectCompose((PetscObject)A, LINEAR_NODES, (PetscObject)is));
    must(ISDestroy(&is));
    must(VecDuplicate(b, &positions));
    must(VecGetArray(positions, &place));
    for (PetscInt i = begin; i < last; i += 3) {
      const PetscInt node = i / 3;
      place[i - begin]    = (double)(node % NX);
      place[i - begin + 1] = (double)(node / NX % NY);
      place[i - begin + 2] = (double)(node / NX / NY);
    }
    must(VecRestoreArray(positions, &place));
    must(PetscObjectCompose((PetscObject)A, LINEAR_POSITIONS, (PetscObject)positions));
    must(VecDestroy(&positions));
  }
  void TearDown() override
  {
    must(KSPDestroy(&ksp));
    for (Vec *v : {&x, &b, &y}) must(VecDestroy(v));
    must(MatDestroy(&A));
  }
  void solver(PetscReal rtol)
  {
    PC pc;
    must(KSPCreate(PETSC_COMM_WORLD, &ksp));
    must(KSPSetType(ksp, KSPCG));
    must(KSPSetOperators(ksp, A, A));
    must(KSPSetTolerances(ksp, rtol, 0, PETSC_DEFAULT, 300));
    must(KSPGetPC(ksp, &pc));
    must(PCSetType(pc, PCHHTCONSTRAINT));
  }
  /* returns the number of iterations, and the error of the known solution */
  PetscInt solve(PetscReal *error)
  {
    PetscInt  its;
    PetscReal size;
    must(KSPSolve(ksp, b, y));
    must(KSPGetIterationNumber(ksp, &its));
    must(VecNorm(x, NORM_2, &size));
    must(VecAXPY(y, -1, x));
    must(VecNorm(y, NORM_2, error));
    *error /= size;
    return its;
  }
};

} // namespace

TEST_F(ConstraintRanks, ProductAgreesWithTheMatrix)
{
  MatrixNodes of;
  NodeProduct p;
  PetscBool   usable;
  PetscReal   size, difference;
  must(FindMatrixNodes(A, &of));
  EXPECT_TRUE(of.three_unknowns);
  must(NodeProductFill(A, of.node, false, &p, &usable));
  EXPECT_TRUE(usable);
  must(MatMult(p.shell, x, y));
  must(VecNorm(b, NORM_INFINITY, &size));
  must(VecAXPY(y, -1, b));
  must(VecNorm(y, NORM_INFINITY, &difference));
  EXPECT_LT(difference, 1e-6 * size);
  must(NodeProductDestroy(&p));
}

/* With new values the number of iterations is that of a solver that has never seen the old ones: each rank's copy of
   the coarse matrix is updated */
TEST_F(ConstraintRanks, FollowsTheMatrix)
{
  PetscReal error;
  must(PetscOptionsSetValue(nullptr, "-pc_hhtconstraint_aggregate", "30"));
  solver(1e-10);
  const PetscInt first = solve(&error);
  EXPECT_LT(error, 1e-7);
  EXPECT_GT(first, 5);
  Vec scale;
  must(VecDuplicate(b, &scale));
  must(VecSet(scale, 1));
  for (PetscInt i = begin; i < std::min(end, 3 * nodes); i++)
    if (i / 3 % NX > NX / 2) must(VecSetValue(scale, i, 30, INSERT_VALUES));
  must(VecAssemblyBegin(scale));
  must(VecAssemblyEnd(scale));
  must(MatDiagonalScale(A, scale, scale));
  must(MatMult(A, x, b));
  const PetscInt again = solve(&error);
  EXPECT_LT(error, 1e-7);
  must(KSPDestroy(&ksp));
  solver(1e-10);
  EXPECT_NEAR(again, solve(&error), 1);
  must(VecDestroy(&scale));
  must(PetscOptionsClearValue(nullptr, "-pc_hhtconstraint_aggregate"));
}

/* Repeated corrections by inaccurate solves reach double precision */
TEST_F(ConstraintRanks, RefinesLooseSolves)
{
  PetscReal error = 1;
  Vec       answer, residual;
  must(VecDuplicate(b, &answer));
  must(VecDuplicate(b, &residual));
  solver(1e-3);
  for (int k = 0; k < 8; k++) {
    must(MatMult(A, answer, residual));
    must(VecAYPX(residual, -1, b));
    must(KSPSolve(ksp, residual, y));
    must(VecAXPY(answer, 1, y));
  }
  must(VecAXPY(answer, -1, x));
  must(VecNorm(answer, NORM_INFINITY, &error));
  EXPECT_LT(error, 1e-11);
  must(VecDestroy(&answer));
  must(VecDestroy(&residual));
}
