/* What KSP gets: orderings, the choice of a solver, symmetry, and the names of redundant constraints */
#include "../../src/linear/graph.h"
#include "../../src/linear/linear.h"
#include "../bench/linear_matrices.h"
#include <gtest/gtest.h>
#include <cmath>
#include <hhtdae/hhtdae.h>
#include <petsc/private/matimpl.h>
#include <random>
#include <string>

#define OK(call) ASSERT_EQ((call), 0)

namespace
{

/* ---- orderings ---- */

std::vector<PetscInt> order_of(Mat A, const char type[])
{
  IS              row, col;
  PetscInt        n;
  const PetscInt *indices;
  EXPECT_EQ(MatGetOrdering(A, type, &row, &col), 0);
  EXPECT_EQ(ISGetLocalSize(row, &n), 0);
  EXPECT_EQ(ISGetIndices(row, &indices), 0);
  std::vector<PetscInt> order(indices, indices + n);
  EXPECT_EQ(ISRestoreIndices(row, &indices), 0);
  EXPECT_EQ(ISDestroy(&row), 0);
  EXPECT_EQ(ISDestroy(&col), 0);
  return order;
}

LinearWork work_of(Mat A, const std::vector<PetscInt> &order)
{
  LinearGraph graph;
  LinearWork  work;
  PetscBool   done, bounded;
  EXPECT_EQ(LinearGraphFromMat(A, &graph, &done), 0);
  EXPECT_TRUE(done);
  LinearCountWork(graph, order.data(), 1e12, &work, &bounded);
  EXPECT_TRUE(bounded);
  return work;
}

/* Entries of L by elimination of a dense Boolean matrix */
LinearWork work_by_elimination(Mat A, const std::vector<PetscInt> &order)
{
  const PetscInt                 n = (PetscInt)order.size();
  std::vector<std::vector<bool>> full(n, std::vector<bool>(n, false));
  std::vector<PetscInt>          place(n);
  LinearWork                     work;
  for (PetscInt k = 0; k < n; ++k) place[order[k]] = k;
  for (PetscInt i = 0; i < n; ++i) {
    PetscInt        count;
    const PetscInt *cols;
    EXPECT_EQ(MatGetRow(A, i, &count, &cols, NULL), 0);
    for (PetscInt k = 0; k < count; ++k) full[place[i]][place[cols[k]]] = full[place[cols[k]]][place[i]] = true;
    EXPECT_EQ(MatRestoreRow(A, i, &count, &cols, NULL), 0);
  }
  for (PetscInt k = 0; k < n; ++k) {
    std::vector<PetscInt> below;
    for (PetscInt i = k + 1; i < n; ++i)
      if (full[i][k]) below.push_back(i);
    for (PetscInt i : below)
      for (PetscInt j : below) full[i][j] = true;
    work.factor += 1.0 + (double)below.size();
    work.flops += (1.0 + (double)below.size()) * (1.0 + (double)below.size());
  }
  return work;
}

/* A solve with the factorization named; the residual relative to the right-hand side */
double residual_with(Mat A, const char pc_type[], const char package[], const char ordering[], bool transposed = false)
{
  KSP       ksp;
  PC        pc;
  Vec       b, x, r;
  PetscReal norm, scale;
  EXPECT_EQ(MatCreateVecs(A, &x, &b), 0);
  EXPECT_EQ(VecDuplicate(b, &r), 0);
  EXPECT_EQ(VecSetRandom(b, NULL), 0);
  EXPECT_EQ(KSPCreate(PETSC_COMM_SELF, &ksp), 0);
  EXPECT_EQ(KSPSetType(ksp, KSPPREONLY), 0);
  EXPECT_EQ(KSPGetPC(ksp, &pc), 0);
  EXPECT_EQ(PCSetType(pc, pc_type), 0);
  EXPECT_EQ(PCFactorSetMatSolverType(pc, package), 0);
  if (ordering) {
    EXPECT_EQ(PCFactorSetMatOrderingType(pc, ordering), 0);
  }
  EXPECT_EQ(KSPSetOperators(ksp, A, A), 0);
  if (transposed) {
    EXPECT_EQ(KSPSolveTranspose(ksp, b, x), 0);
    EXPECT_EQ(MatMultTranspose(A, x, r), 0);
  } else {
    EXPECT_EQ(KSPSolve(ksp, b, x), 0);
    EXPECT_EQ(MatMult(A, x, r), 0);
  }
  EXPECT_EQ(VecNorm(b, NORM_2, &scale), 0);
  EXPECT_EQ(VecAXPY(r, -1.0, b), 0);
  EXPECT_EQ(VecNorm(r, NORM_2, &norm), 0);
  EXPECT_EQ(KSPDestroy(&ksp), 0);
  EXPECT_EQ(VecDestroy(&x), 0);
  EXPECT_EQ(VecDestroy(&b), 0);
  EXPECT_EQ(VecDestroy(&r), 0);
  return norm / scale;
}

bool has(Mat A, const char package[], MatFactorType type)
{
  PetscBool available;
  EXPECT_EQ(MatGetFactorAvailable(A, package, type, &available), 0);
  return available;
}

TEST(LinearOrdering, IsAPermutationAndSavesFill)
{
  Entries entries = block(8, 8, 8, false);
  Mat     A;
  OK(create_matrix(entries, &A));
  const std::vector<PetscInt> order = order_of(A, MATORDERINGMETISND), again = order_of(A, MATORDERINGMETISND);
  std::vector<PetscInt>       natural(order.size());
  std::vector<bool>           met(order.size(), false);
  for (size_t k = 0; k < order.size(); ++k) {
    natural[k] = (PetscInt)k;
    ASSERT_TRUE(order[k] >= 0 && order[k] < (PetscInt)order.size() && !met[order[k]]);
    met[order[k]] = true;
  }
  EXPECT_EQ(order, again);
  EXPECT_LT(1.5 * work_of(A, order).flops, work_of(A, natural).flops);
  OK(MatDestroy(&A));
}

TEST(LinearOrdering, RegistrationTwiceChangesNothing)
{
  Entries entries = chain(5, 0);
  Mat     A;
  OK(create_matrix(entries, &A));
  const std::vector<PetscInt> before = order_of(A, MATORDERINGMETISND);
  OK(LinearRegister());
  OK(LinearRegister());
  EXPECT_EQ(before, order_of(A, MATORDERINGMETISND));
  OK(MatDestroy(&A));
}

TEST(LinearOrdering, DiagonalMatrixHasNoEdges)
{
  Entries entries;
  Mat     A;
  entries.n = 4;
  for (PetscInt i = 0; i < 4; ++i) entries.add(i, i, 1.0 + i);
  OK(create_matrix(entries, &A));
  EXPECT_EQ(order_of(A, MATORDERINGMETISND).size(), 4u);
  OK(MatDestroy(&A));
}

/* The direction of the permutation shows in the fill of PETSc's own factorization */
TEST(LinearOrdering, PetscFactorsWithLessFill)
{
  Entries       entries = block(5, 5, 5, false);
  Mat           A, F;
  IS            row, col;
  MatFactorInfo factor_info;
  MatInfo       info;
  OK(create_matrix(entries, &A));
  const std::vector<PetscInt> order = order_of(A, MATORDERINGMETISND);
  OK(MatGetOrdering(A, MATORDERINGMETISND, &row, &col));
  OK(MatFactorInfoInitialize(&factor_info));
  OK(MatGetFactor(A, MATSOLVERPETSC, MAT_FACTOR_LU, &F));
  OK(MatLUFactorSymbolic(F, A, row, col, &factor_info));
  OK(MatGetInfo(F, MAT_LOCAL, &info));
  EXPECT_DOUBLE_EQ(info.nz_used, 2 * work_of(A, order).factor - entries.n);
  OK(ISDestroy(&row));
  OK(ISDestroy(&col));
  OK(MatDestroy(&F));
  OK(MatDestroy(&A));
}

/* ---- the count of work ---- */

TEST(LinearWork, AgreesWithElimination)
{
  std::mt19937 random(7);
  for (int trial = 0; trial < 10; ++trial) {
    Entries entries;
    Mat     A;
    entries.n = 40;
    for (PetscInt i = 0; i < 40; ++i) entries.add(i, i, 1.0);
    for (int k = 0; k < 60; ++k)
      entries.add((PetscInt)(random() % 40), (PetscInt)(random() % 40), 1.0); /* unsymmetric */
    OK(create_matrix(entries, &A));
    for (const char *type : {"natural", MATORDERINGMETISND}) {
      const std::vector<PetscInt> order   = order_of(A, type);
      const LinearWork            counted = work_of(A, order), eliminated = work_by_elimination(A, order);
      EXPECT_EQ(counted.factor, eliminated.factor);
      EXPECT_EQ(counted.flops, eliminated.flops);
    }
    OK(MatDestroy(&A));
  }
}

TEST(LinearWork, StopsAtItsLimit)
{
  Entries     entries = block(6, 6, 6, false);
  Mat         A;
  LinearGraph graph;
  LinearWork  work;
  PetscBool   done, bounded;
  OK(create_matrix(entries, &A));
  OK(LinearGraphFromMat(A, &graph, &done));
  LinearCountWork(graph, order_of(A, "natural").data(), 1000, &work, &bounded);
  EXPECT_FALSE(bounded);
  EXPECT_GT(work.factor, 1000);
  EXPECT_LT(work.factor, 3000);
  OK(MatDestroy(&A));
}

/* ---- the choice ---- */

struct Chosen {
  std::string  ksp, pc, package;
  LinearChoice choice;
};

/* Sets options, lets the program do its part, and returns what the two functions make of it */
template <typename Program>
Chosen choose(Mat A, bool symmetric, const std::vector<const char *> &options, Program program,
              const char prefix[] = "")
{
  KSP           ksp;
  PC            pc;
  PetscOptions  database;
  KSPType       ksp_type;
  PCType        pc_type;
  MatSolverType package = NULL;
  Chosen        result;
  EXPECT_EQ(PetscOptionsCreate(&database), 0);
  for (const char *option : options) EXPECT_EQ(PetscOptionsInsertString(database, option), 0);
  EXPECT_EQ(KSPCreate(PETSC_COMM_SELF, &ksp), 0);
  EXPECT_EQ(PetscObjectSetOptions((PetscObject)ksp, database), 0);
  EXPECT_EQ(KSPSetOptionsPrefix(ksp, prefix), 0);
  EXPECT_EQ(KSPGetPC(ksp, &pc), 0);
  EXPECT_EQ(PetscObjectSetOptions((PetscObject)pc, database), 0);
  program(ksp, pc);
  EXPECT_EQ(LinearDefaults(ksp, &result.choice), 0);
  EXPECT_EQ(KSPSetOperators(ksp, A, A), 0);
  EXPECT_EQ(KSPSetFromOptions(ksp), 0);
  EXPECT_EQ(LinearChoose(ksp, A, symmetric ? PETSC_TRUE : PETSC_FALSE, &result.choice), 0);
  EXPECT_EQ(KSPGetType(ksp, &ksp_type), 0);
  EXPECT_EQ(PCGetType(pc, &pc_type), 0);
  EXPECT_EQ(PCFactorGetMatSolverType(pc, &package), 0);
  result.ksp     = ksp_type;
  result.pc      = pc_type;
  result.package = package ? package : "";
  EXPECT_EQ(KSPDestroy(&ksp), 0);
  EXPECT_EQ(PetscOptionsDestroy(&database), 0);
  return result;
}

void nothing(KSP, PC) {}

class LinearChoiceTest : public testing::Test
{
protected:
  Mat small, large;

  void SetUp() override
  {
    Entries few = chain(100, 0), many = block(8, 8, 8, true);
    OK(create_matrix(few, &small));
    OK(create_matrix(many, &large));
    if (!has(small, MATSOLVERKLU, MAT_FACTOR_LU) || !has(large, "mumpsnd", MAT_FACTOR_CHOLESKY))
      GTEST_SKIP() << "this PETSc was built without KLU or without MUMPS";
  }
  void TearDown() override
  {
    OK(MatDestroy(&small));
    OK(MatDestroy(&large));
  }
};

TEST_F(LinearChoiceTest, ChainTakesKLUPair)
{
  Entries entries = chain(1000, 0); /* 5000 unknowns */
  Mat     A;
  OK(create_matrix(entries, &A));
  for (bool symmetric : {true, false}) {
    const Chosen c = choose(A, symmetric, {}, nothing);
    EXPECT_EQ(c.ksp, KSPPREONLY);
    EXPECT_EQ(c.pc, PCLU);
    EXPECT_EQ(c.package, has(A, "klupair", MAT_FACTOR_LU) ? "klupair" : MATSOLVERKLU);
    EXPECT_FALSE(c.choice.cholesky);
  }
  OK(MatDestroy(&A));
}

TEST_F(LinearChoiceTest, BlockTakesMUMPS)
{
  const Chosen symmetric = choose(large, true, {}, nothing), unsymmetric = choose(large, false, {}, nothing);
  EXPECT_EQ(symmetric.pc, PCCHOLESKY);
  EXPECT_EQ(symmetric.package, "mumpsnd");
  EXPECT_TRUE(symmetric.choice.cholesky);
  EXPECT_EQ(unsymmetric.pc, PCLU);
  EXPECT_EQ(unsymmetric.package, "mumpsnd");
  EXPECT_FALSE(unsymmetric.choice.cholesky);
}

/* 645 unknowns with one dense block want MUMPS, 5000 in a chain do not: size alone does not decide */
TEST_F(LinearChoiceTest, DenseBlockTakesMUMPS)
{
  Entries entries = chain(1, 640);
  Mat     A;
  OK(create_matrix(entries, &A));
  EXPECT_EQ(choose(A, true, {}, nothing).package, "mumpsnd");
  OK(MatDestroy(&A));
}

TEST_F(LinearChoiceTest, OptionsWin)
{
  EXPECT_EQ(choose(large, true, {"-ksp_type gmres"}, nothing).ksp, KSPGMRES);
  EXPECT_EQ(choose(large, true, {"-ksp_type gmres"}, nothing).package, "mumpsnd");
  EXPECT_EQ(choose(large, true, {"-pc_type jacobi"}, nothing).pc, PCJACOBI);
  EXPECT_EQ(choose(large, true, {"-pc_type lu"}, nothing).pc, PCLU);
  EXPECT_EQ(choose(small, true, {"-pc_type cholesky"}, nothing).pc, PCCHOLESKY);
  EXPECT_EQ(choose(large, true, {"-pc_factor_mat_solver_type klu"}, nothing).package, MATSOLVERKLU);
  EXPECT_EQ(choose(small, true, {"-pc_factor_mat_solver_type mumps"}, nothing).package, MATSOLVERMUMPS);
  EXPECT_EQ(choose(large, true, {"-pc_type lu -pc_factor_mat_solver_type petsc"}, nothing).package, MATSOLVERPETSC);
  EXPECT_EQ(choose(large, true, {"-a_pc_type jacobi"}, nothing, "a_").pc, PCJACOBI);
  EXPECT_EQ(choose(large, true, {"-pc_type jacobi"}, nothing, "a_").pc, PCCHOLESKY);
}

TEST_F(LinearChoiceTest, OrderingOptionReachesTheFactor)
{
  KSP          ksp;
  PC           pc;
  PetscOptions database;
  LinearChoice choice;
  IS           row, col;
  Vec          b, x;
  OK(PetscOptionsCreate(&database));
  OK(PetscOptionsInsertString(database, "-pc_factor_mat_ordering_type hhtdae_test"));
  /* An ordering of our own tells whether it was asked */
  static int called;
  called = 0;
  OK(MatOrderingRegister("hhtdae_test", [](Mat A, MatOrderingType, IS *r, IS *c) -> PetscErrorCode {
    ++called;
    return MatGetOrdering(A, MATORDERINGMETISND, r, c);
  }));
  OK(MatGetOrdering(large, "hhtdae_test", &row, &col));
  EXPECT_EQ(called, 1);
  OK(ISDestroy(&row));
  OK(ISDestroy(&col));
  OK(KSPCreate(PETSC_COMM_SELF, &ksp));
  OK(PetscObjectSetOptions((PetscObject)ksp, database));
  OK(KSPGetPC(ksp, &pc));
  OK(PetscObjectSetOptions((PetscObject)pc, database));
  OK(LinearDefaults(ksp, &choice));
  OK(KSPSetOperators(ksp, large, large));
  OK(KSPSetFromOptions(ksp));
  OK(LinearChoose(ksp, large, PETSC_TRUE, &choice));
  EXPECT_TRUE(choice.cholesky);
  OK(MatCreateVecs(large, &x, &b));
  OK(VecSet(b, 1.0));
  OK(KSPSolve(ksp, b, x));
  EXPECT_EQ(called, 2);
  OK(VecDestroy(&x));
  OK(VecDestroy(&b));
  OK(KSPDestroy(&ksp));
  OK(PetscOptionsDestroy(&database));
}

TEST_F(LinearChoiceTest, ProgramWins)
{
  EXPECT_EQ(choose(large, true, {}, [](KSP k, PC) { EXPECT_EQ(KSPSetType(k, KSPMINRES), 0); }).ksp, KSPMINRES);
  EXPECT_EQ(choose(large, true, {}, [](KSP, PC p) { EXPECT_EQ(PCSetType(p, PCJACOBI), 0); }).pc, PCJACOBI);
  EXPECT_EQ(choose(large, true, {}, [](KSP, PC p) { EXPECT_EQ(PCSetType(p, PCLU), 0); }).pc, PCLU);
  const auto klu = [](KSP, PC p) {
    EXPECT_EQ(PCSetType(p, PCLU), 0);
    EXPECT_EQ(PCFactorSetMatSolverType(p, MATSOLVERKLU), 0);
  };
  EXPECT_EQ(choose(large, true, {}, klu).package, MATSOLVERKLU);
  EXPECT_EQ(choose(large, true, {}, klu).pc, PCLU);
}

/* TSSetFromOptions() may come more than once */
TEST_F(LinearChoiceTest, SecondLookKnowsItsOwnDefaults)
{
  const auto before = [](KSP k, PC) {
    LinearChoice choice;
    EXPECT_EQ(LinearDefaults(k, &choice), 0);
    EXPECT_FALSE(choice.user_pc);
    EXPECT_EQ(KSPSetFromOptions(k), 0);
  };
  const Chosen c = choose(large, true, {}, before);
  EXPECT_FALSE(c.choice.user_pc);
  EXPECT_FALSE(c.choice.user_package);
  EXPECT_EQ(c.pc, PCCHOLESKY);
  EXPECT_EQ(c.package, "mumpsnd");
}

/* The factor gets the package's own ordering, not the one that PETSc prefers for its own factorization */
TEST_F(LinearChoiceTest, PackageOrdersByItself)
{
  KSP           ksp;
  PC            pc;
  LinearChoice  choice;
  Mat           F;
  MatFactorInfo info;
  PetscReal     chosen, own;
  OK(KSPCreate(PETSC_COMM_SELF, &ksp));
  OK(LinearDefaults(ksp, &choice));
  OK(KSPSetOperators(ksp, large, large));
  OK(KSPSetFromOptions(ksp));
  OK(LinearChoose(ksp, large, PETSC_TRUE, &choice));
  OK(KSPSetUp(ksp));
  OK(KSPGetPC(ksp, &pc));
  OK(PCFactorGetMatrix(pc, &F));
  OK(MatMumpsGetRinfog(F, 1, &chosen));
  OK(KSPDestroy(&ksp));

  OK(MatFactorInfoInitialize(&info));
  OK(MatGetFactor(large, "mumpsnd", MAT_FACTOR_CHOLESKY, &F));
  OK(MatCholeskyFactorSymbolic(F, large, NULL, &info));
  OK(MatMumpsGetRinfog(F, 1, &own));
  EXPECT_EQ(chosen, own);
  OK(MatDestroy(&F));
}

/* Symmetry is lost between two solves: L D L^T gives way to LU on the same KSP */
TEST_F(LinearChoiceTest, TurnsToLUWhenSymmetryIsLost)
{
  KSP          ksp;
  PC           pc;
  PCType       type;
  LinearChoice choice;
  Vec          b, x, r;
  PetscReal    norm;
  OK(KSPCreate(PETSC_COMM_SELF, &ksp));
  OK(LinearDefaults(ksp, &choice));
  OK(KSPSetOperators(ksp, large, large));
  OK(KSPSetFromOptions(ksp));
  OK(LinearChoose(ksp, large, PETSC_TRUE, &choice));
  OK(MatCreateVecs(large, &x, &b));
  OK(VecDuplicate(b, &r));
  OK(VecSet(b, 1.0));
  OK(KSPSolve(ksp, b, x));

  OK(MatSetValue(large, 0, 1, 5.0, INSERT_VALUES));
  OK(MatAssemblyBegin(large, MAT_FINAL_ASSEMBLY));
  OK(MatAssemblyEnd(large, MAT_FINAL_ASSEMBLY));
  OK(LinearChoose(ksp, large, PETSC_FALSE, &choice));
  EXPECT_FALSE(choice.cholesky);
  OK(KSPSolve(ksp, b, x));
  OK(MatMult(large, x, r));
  OK(VecAXPY(r, -1.0, b));
  OK(VecNorm(r, NORM_INFINITY, &norm));
  EXPECT_LT(norm, 1e-8);
  OK(KSPGetPC(ksp, &pc));
  OK(PCGetType(pc, &type));
  EXPECT_STREQ(type, PCLU);
  OK(VecDestroy(&x));
  OK(VecDestroy(&b));
  OK(VecDestroy(&r));
  OK(KSPDestroy(&ksp));
}

/* ---- MUMPS with our ordering ---- */

class MumpsND : public testing::Test
{
protected:
  Mat A;

  void SetUp() override
  {
    Entries entries = block(6, 6, 6, true);
    OK(create_matrix(entries, &A));
    if (!has(A, "mumpsnd", MAT_FACTOR_LU)) GTEST_SKIP() << "this PETSc was built without MUMPS";
  }
  void TearDown() override { OK(MatDestroy(&A)); }
};

TEST_F(MumpsND, Solves)
{
  EXPECT_LT(residual_with(A, PCLU, "mumpsnd", NULL), 1e-12);
  EXPECT_LT(residual_with(A, PCCHOLESKY, "mumpsnd", NULL), 1e-12);
  EXPECT_LT(residual_with(A, PCCHOLESKY, "mumpsnd", MATORDERINGMETISND), 1e-12);
  OK(MatSetValue(A, 0, 1, 5.0, INSERT_VALUES)); /* unsymmetric */
  OK(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  OK(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  EXPECT_LT(residual_with(A, PCLU, "mumpsnd", NULL), 1e-12);
  EXPECT_LT(residual_with(A, PCLU, "mumpsnd", NULL, true), 1e-12);
}

TEST_F(MumpsND, OptionsReachMUMPS)
{
  Mat           F;
  MatFactorInfo info;
  PetscInt      used;
  IS            row, col;
  OK(PetscOptionsInsertString(NULL, "-mat_mumps_icntl_7 2 -mat_mumps_icntl_14 77"));
  OK(MatGetOrdering(A, MATORDERINGEXTERNAL, &row, &col));
  OK(MatFactorInfoInitialize(&info));
  OK(MatGetFactor(A, "mumpsnd", MAT_FACTOR_LU, &F));
  OK(MatLUFactorSymbolic(F, A, row, col, &info));
  OK(MatMumpsGetInfog(F, 7, &used));
  EXPECT_EQ(used, 2); /* AMF */
  OK(MatMumpsGetIcntl(F, 14, &used));
  EXPECT_EQ(used, 77);
  OK(MatDestroy(&F));
  OK(PetscOptionsClearValue(NULL, "-mat_mumps_icntl_7"));
  OK(PetscOptionsClearValue(NULL, "-mat_mumps_icntl_14"));
}

/* Of the orderings that MUMPS has inside none takes fewer operations than the one that we pass */
TEST_F(MumpsND, OrderingIsNoWorseThanTheBuiltInOnes)
{
  MatFactorInfo info;
  PetscReal     ours = 0;
  OK(MatFactorInfoInitialize(&info));
  for (PetscInt ordering : {-1, 0, 2, 4, 6}) {
    Mat       F;
    PetscReal operations;
    OK(MatGetFactor(A, "mumpsnd", MAT_FACTOR_CHOLESKY, &F));
    if (ordering >= 0) {
      OK(MatMumpsSetIcntl(F, 7, ordering));
    }
    OK(MatCholeskyFactorSymbolic(F, A, NULL, &info));
    OK(MatMumpsGetRinfog(F, 1, &operations));
    if (ordering < 0) ours = operations;
    EXPECT_LE(ours, 1.05 * operations) << "ICNTL(7)=" << ordering;
    OK(MatDestroy(&F));
  }
}

/* A constraint given twice: the factorization fails instead of returning one of many solutions */
TEST_F(MumpsND, SingularMatrixIsReported)
{
  Entries entries = block(4, 4, 4, true);
  for (PetscInt d = 0; d < 3; ++d) {
    const PetscInt row = entries.n++;
    entries.add_symmetric(row, d, 2.0); /* the first node is held already */
    entries.add(row, row, 0.0);
  }
  for (MatFactorType type : {MAT_FACTOR_CHOLESKY, MAT_FACTOR_LU}) {
    Mat            B, F;
    MatFactorInfo  info;
    MatFactorError error;
    OK(create_matrix(entries, &B));
    OK(MatFactorInfoInitialize(&info));
    OK(MatGetFactor(B, "mumpsnd", type, &F));
    if (type == MAT_FACTOR_LU) {
      OK(MatLUFactorSymbolic(F, B, NULL, NULL, &info));
      OK(MatLUFactorNumeric(F, B, &info));
    } else {
      OK(MatCholeskyFactorSymbolic(F, B, NULL, &info));
      OK(MatCholeskyFactorNumeric(F, B, &info));
    }
    OK(MatFactorGetError(F, &error));
    EXPECT_TRUE(error == MAT_FACTOR_NUMERIC_ZEROPIVOT || error == MAT_FACTOR_STRUCT_ZEROPIVOT) << error;
    OK(MatDestroy(&F));
    OK(MatDestroy(&B));
  }
}

/* All columns of a dense right-hand side at once, and of a factor that failed */
TEST_F(MumpsND, SolvesManyRightHandSides)
{
  const PetscInt columns = 70;
  Mat            F, B, X, R;
  MatFactorInfo  info;
  PetscReal      error, norm;
  OK(MatFactorInfoInitialize(&info));
  OK(MatCreateDense(PETSC_COMM_SELF, PETSC_DECIDE, columns, A->rmap->N, columns, NULL, &B));
  OK(MatSetRandom(B, NULL));
  OK(MatDuplicate(B, MAT_DO_NOT_COPY_VALUES, &X));
  OK(MatNorm(B, NORM_FROBENIUS, &norm));
  OK(MatGetFactor(A, "mumpsnd", MAT_FACTOR_CHOLESKY, &F));
  OK(MatCholeskyFactorSymbolic(F, A, NULL, &info));
  OK(MatCholeskyFactorNumeric(F, A, &info));
  OK(MatMatSolve(F, B, X));
  OK(MatMatMult(A, X, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &R));
  OK(MatAXPY(R, -1.0, B, SAME_NONZERO_PATTERN));
  OK(MatNorm(R, NORM_FROBENIUS, &error));
  EXPECT_LT(error, 1e-12 * norm);
  F->factorerrortype = MAT_FACTOR_NUMERIC_ZEROPIVOT;
  OK(MatMatSolve(F, B, X));
  OK(MatNorm(X, NORM_FROBENIUS, &error));
  EXPECT_FALSE(std::isfinite(error));
  for (Mat *M : {&F, &B, &X, &R}) OK(MatDestroy(M));
}

TEST_F(MumpsND, SmallWorkspaceGrows)
{
  Mat            F;
  MatFactorInfo  info;
  PetscInt       percent;
  MatFactorError error;
  OK(MatFactorInfoInitialize(&info));
  OK(MatGetFactor(A, "mumpsnd", MAT_FACTOR_LU, &F));
  OK(MatMumpsSetIcntl(F, 14, -60));
  OK(MatLUFactorSymbolic(F, A, NULL, NULL, &info));
  OK(MatLUFactorNumeric(F, A, &info));
  OK(MatFactorGetError(F, &error));
  EXPECT_EQ(error, MAT_FACTOR_NOERROR);
  OK(MatMumpsGetIcntl(F, 14, &percent));
  EXPECT_GT(percent, -60);
  OK(MatDestroy(&F));
}

/* ---- symmetry ---- */

TEST(LinearSymmetry, IsSeen)
{
  Entries   entries = chain(200, 3);
  Mat       A;
  PetscBool symmetric;
  OK(create_matrix(entries, &A));
  OK(LinearIsSymmetric(A, &symmetric));
  EXPECT_TRUE(symmetric);

  /* Large and small scales side by side, as masses in kg and inertias of small parts */
  Vec d;
  OK(MatCreateVecs(A, &d, NULL));
  for (PetscInt i = 0; i < entries.n; ++i)
    OK(VecSetValue(d, i, PetscPowReal(10.0, (PetscReal)(i % 9) - 4), INSERT_VALUES));
  OK(VecAssemblyBegin(d));
  OK(VecAssemblyEnd(d));
  OK(MatDiagonalScale(A, d, d));
  OK(LinearIsSymmetric(A, &symmetric));
  EXPECT_TRUE(symmetric);
  OK(VecDestroy(&d));
  OK(MatDestroy(&A));
}

TEST(LinearSymmetry, OneWrongEntryIsSeen)
{
  for (double relative : {1e-9, 1e-6, 1.0}) {
    Entries   entries = chain(200, 3);
    Mat       A;
    PetscBool symmetric;
    entries.add(301, 300, relative); /* row and column of one body, entries of order one */
    OK(create_matrix(entries, &A));
    OK(LinearIsSymmetric(A, &symmetric));
    EXPECT_FALSE(symmetric) << relative;
    OK(MatDestroy(&A));
  }
}

/* ---- redundant constraints ---- */

std::vector<PetscInt> dependent(const Entries &entries, PetscInt first_multiplier, PetscInt max = 100)
{
  Mat                   A;
  IS                    multipliers;
  PetscInt              n = -1;
  std::vector<PetscInt> rows(max);
  EXPECT_EQ(create_matrix(entries, &A), 0);
  EXPECT_EQ(ISCreateStride(PETSC_COMM_SELF, entries.n - first_multiplier, first_multiplier, 1, &multipliers), 0);
  EXPECT_EQ(LinearNameDependent(A, multipliers, max, &n, rows.data()), 0);
  EXPECT_EQ(ISDestroy(&multipliers), 0);
  EXPECT_EQ(MatDestroy(&A), 0);
  rows.resize(n);
  return rows;
}

TEST(LinearDependent, NoneInARegularMatrix)
{
  for (PetscInt bodies : {1, 10, 300}) {
    Entries entries = chain(bodies, 0);
    EXPECT_TRUE(dependent(entries, 3 * bodies).empty()) << bodies;
  }
}

TEST(LinearDependent, DoubledConstraint)
{
  Entries        entries = chain(10, 0);
  const PetscInt first = 30, twice = first + 8, row = entries.n++;
  for (size_t k = 0, size = entries.row.size(); k < size; ++k)
    if (entries.row[k] == twice) entries.add_symmetric(row, entries.col[k], -3.0 * entries.val[k]);
  EXPECT_EQ(dependent(entries, first), (std::vector<PetscInt>{twice, row}));
}

/* Two independent dependences at once, of very different scale: all rows of both are named, and no others */
TEST(LinearDependent, TwoDependencesOfDifferentScale)
{
  Entries        entries = chain(40, 0);
  const PetscInt first = 120, a = first + 3, b = first + 30, c = first + 51, ab = entries.n++, cc = entries.n++;
  for (size_t k = 0, size = entries.row.size(); k < size; ++k) {
    if (entries.row[k] == a) entries.add_symmetric(ab, entries.col[k], entries.val[k]);
    if (entries.row[k] == b) entries.add_symmetric(ab, entries.col[k], 0.5 * entries.val[k]);
    if (entries.row[k] == c) entries.add_symmetric(cc, entries.col[k], 1e5 * entries.val[k]);
  }
  EXPECT_EQ(dependent(entries, first), (std::vector<PetscInt>{a, b, c, ab, cc}));
  EXPECT_EQ(dependent(entries, first, 2).size(), 2u);
}

/* A loop: distances of three points on a line fixed pairwise, x2-x1, x3-x2, x1-x3; the fourth constraint is apart */
TEST(LinearDependent, Loop)
{
  Entries e;
  e.n                 = 8;
  const double mass[] = {1e3, 2.0, 1e-2, 5.0};
  for (PetscInt i = 0; i < 4; ++i) e.add(i, i, mass[i]);
  const PetscInt ends[4][2] = {{0, 1}, {1, 2}, {2, 0}, {3, 0}};
  for (PetscInt c = 0; c < 4; ++c) {
    e.add_symmetric(4 + c, ends[c][0], -1.0);
    e.add_symmetric(4 + c, ends[c][1], 1.0);
  }
  EXPECT_EQ(dependent(e, 4), (std::vector<PetscInt>{4, 5, 6}));
}

TEST(LinearDependent, MultiplierWithoutCoordinates)
{
  Entries        entries = chain(3, 0);
  const PetscInt empty   = entries.n++;
  entries.add(empty, empty, 0.0);
  EXPECT_EQ(dependent(entries, 9), (std::vector<PetscInt>{empty}));
}

} // namespace
