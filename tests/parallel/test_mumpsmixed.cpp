/* Factorizations in single precision over all ranks: known solutions, and the same decision on all ranks when double
   precision replaces them */
#include "distributed_matrix.h"
#include "linear/linear.h"
#include "linear/memory.h"
#include <hhtdae/hhtdae.h>
#include <petscksp.h>

using namespace hhtest;

namespace
{

class MumpsMixedRanks : public testing::Test
{
protected:
  Mat       A   = nullptr;
  KSP       ksp = nullptr;
  PC        pc;
  PetscReal error = -1;

  void SetUp() override
  {
    PetscBool available;
    must(TSHHT3Initialize());
    A = distributed(block(6, 5, 4, true));
    must(MatGetFactorAvailable(A, "mumpsmixed", MAT_FACTOR_LU, &available));
    if (!available) GTEST_SKIP() << "there is no MUMPS of single precision";
  }

  void TearDown() override
  {
    must(KSPDestroy(&ksp));
    must(MatDestroy(&A));
  }

  void use(const char package[], const char type[])
  {
    must(KSPDestroy(&ksp));
    must(KSPCreate(PETSC_COMM_WORLD, &ksp));
    must(KSPSetType(ksp, KSPPREONLY));
    must(KSPGetPC(ksp, &pc));
    must(PCSetType(pc, type));
    must(PCFactorSetMatSolverType(pc, package));
    must(KSPSetOperators(ksp, A, A));
  }

  /* Solves A x = b, where x is known */
  void solve(bool transposed = false)
  {
    Vec       known, b, x;
    PetscInt  begin, end;
    PetscReal size;
    must(MatCreateVecs(A, &x, &b));
    must(VecDuplicate(x, &known));
    must(VecGetOwnershipRange(known, &begin, &end));
    for (PetscInt i = begin; i < end; i++) must(VecSetValue(known, i, std::sin(1.3 * (double)i + 0.2), INSERT_VALUES));
    must(VecAssemblyBegin(known));
    must(VecAssemblyEnd(known));
    must((transposed ? MatMultTranspose : MatMult)(A, known, b));
    must((transposed ? KSPSolveTranspose : KSPSolve)(ksp, b, x));
    must(VecAXPY(x, -1, known));
    must(VecNorm(x, NORM_2, &error));
    must(VecNorm(known, NORM_2, &size));
    error /= size;
    for (Vec *v : {&known, &b, &x}) must(VecDestroy(v));
  }

  /* sets an entry of A from the last rank only */
  void setOnLast(PetscInt row, PetscInt col, double value)
  {
    PetscInt begin, end;
    must(MatGetOwnershipRange(A, &begin, &end));
    if (row >= begin && row < end) must(MatSetValue(A, row, col, value, INSERT_VALUES));
    must(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    must(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  }

  KSPConvergedReason reason()
  {
    KSPConvergedReason r;
    must(KSPGetConvergedReason(ksp, &r));
    return r;
  }
};

TEST_F(MumpsMixedRanks, Solves)
{
  for (const char *type : {PCCHOLESKY, PCLU}) {
    use("smumpsnd", type);
    solve();
    EXPECT_LT(error, 1e-3);
    EXPECT_GT(error, 1e-9);
    use("mumpsmixed", type);
    solve();
    EXPECT_LT(error, 1e-12);
    must(LinearSolveRoughly(A, PETSC_TRUE));
    solve();
    EXPECT_LT(error, 1e-3);
    EXPECT_GT(error, 1e-9);
    must(LinearSolveRoughly(A, PETSC_FALSE));
  }
}

/* The distribution of the solution may change with every factorization, and between A and its transpose */
TEST_F(MumpsMixedRanks, SolvesAfterChanges)
{
  use("mumpsmixed", PCLU);
  solve();
  EXPECT_LT(error, 1e-12);
  setOnLast(0, 1, 5.);
  solve();
  EXPECT_LT(error, 1e-12);
  solve(true);
  EXPECT_LT(error, 1e-12);
  solve();
  EXPECT_LT(error, 1e-12);
}

/* One entry on one rank is beyond the range of single precision */
TEST_F(MumpsMixedRanks, AnEntryBeyondTheRange)
{
  PetscInt n;
  must(MatGetSize(A, &n, nullptr));
  const Triplets e = block(6, 5, 4, true);
  setOnLast(n - 1, e.col.back(), 1e60);
  setOnLast(e.col.back(), n - 1, 1e60);
  use("smumpsnd", PCCHOLESKY);
  solve();
  EXPECT_LT(reason(), 0);
  use("mumpsmixed", PCCHOLESKY);
  solve();
  EXPECT_GT(reason(), 0);
  EXPECT_LT(error, 1e-8);
}

/* Memory is counted for all ranks together, since they share a machine, and the result is the same on all */
TEST_F(MumpsMixedRanks, NoRoom)
{
  PetscMPIInt size;
  LinearMemory m;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  must(LinearMemoryOf(PETSC_COMM_WORLD, 3, 100, &m));
  EXPECT_EQ(m.need, 3 * size);
  EXPECT_EQ(m.free, 100);
  must(PetscOptionsSetValue(nullptr, "-mat_mumps_memory", "0.5"));
  for (const char *package : {"mumpsnd", "mumpsmixed"}) {
    use(package, PCCHOLESKY);
    solve();
    EXPECT_EQ(reason(), KSP_DIVERGED_PC_FAILED) << package;
  }
  must(PetscOptionsClearValue(nullptr, "-mat_mumps_memory"));
}

TEST_F(MumpsMixedRanks, Singular)
{
  Triplets e = block(4, 4, 4, true);
  for (PetscInt d = 0; d < 3; d++) { /* the first node is already held */
    const PetscInt row = e.n++;
    e.add_symmetric(row, d, 2.);
    e.add(row, row, 0.);
  }
  must(MatDestroy(&A));
  A = distributed(e);
  for (const char *package : {"smumpsnd", "mumpsmixed"})
    for (const char *type : {PCCHOLESKY, PCLU}) {
      use(package, type);
      solve();
      EXPECT_EQ(reason(), KSP_DIVERGED_PC_FAILED) << package << type;
    }
}

} // namespace
