/* Which solver a KSP gets, depending on the matrix, on options and on the program */
#include "linear/choose.h"
#include "bench/linear_matrices.h"
#include <gtest/gtest.h>
#include <hhtdae/hhtdae.h>
#include <vector>
#include <string>

#define OK(call) ASSERT_EQ((call), 0)

namespace
{

bool has(Mat A, const char package[], MatFactorType type)
{
  PetscBool available;
  EXPECT_EQ(MatGetFactorAvailable(A, package, type, &available), 0);
  return available;
}

struct Chosen {
  std::string  ksp, pc, package;
  LinearChoice choice;
};

/* Sets options, lets the program make its settings, and returns the result of the two functions */
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
    Triplets few = chain(100, 0), many = block(8, 8, 8, true);
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
  Triplets entries = chain(1000, 0); /* 5000 unknowns */
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

/* A large factorization is in single precision if the caller's iteration removes the error of its solves, unless the
   user has chosen otherwise */
TEST_F(LinearChoiceTest, LargeFactorsAreSingle)
{
  Mat  A;
  KSP  ksp;
  auto chosen = [&](bool rough, const char type[], const std::string &option) {
    LinearChoice  choice;
    PetscOptions  database;
    PC            pc;
    MatSolverType package;
    std::string   name;
    EXPECT_EQ(PetscOptionsCreate(&database), 0);
    EXPECT_EQ(PetscOptionsInsertString(database, option.c_str()), 0);
    EXPECT_EQ(KSPCreate(PETSC_COMM_SELF, &ksp), 0);
    EXPECT_EQ(KSPGetPC(ksp, &pc), 0);
    for (PetscObject o : {(PetscObject)ksp, (PetscObject)pc}) EXPECT_EQ(PetscObjectSetOptions(o, database), 0);
    EXPECT_EQ(KSPSetType(ksp, type), 0);
    EXPECT_EQ(LinearDefaults(ksp, &choice), 0);
    choice.may_be_rough = (PetscBool)rough;
    EXPECT_EQ(KSPSetOperators(ksp, A, A), 0);
    EXPECT_EQ(KSPSetFromOptions(ksp), 0);
    EXPECT_EQ(LinearChoose(ksp, A, PETSC_TRUE, &choice), 0);
    EXPECT_EQ(PCFactorGetMatSolverType(pc, &package), 0);
    name = package;
    EXPECT_EQ(KSPDestroy(&ksp), 0);
    EXPECT_EQ(PetscOptionsDestroy(&database), 0);
    return name;
  };
  OK(create_matrix(block(18, 18, 18, true), &A));
  if (!has(A, "mumpsmixed", MAT_FACTOR_CHOLESKY)) GTEST_SKIP() << "there is no MUMPS of single precision";
  EXPECT_EQ(chosen(true, KSPPREONLY, ""), "mumpsmixed");
  EXPECT_EQ(chosen(true, KSPPREONLY, "-pc_type lu"), "mumpsmixed");
  EXPECT_EQ(chosen(true, KSPPREONLY, "-pc_factor_mat_solver_type mumpsnd"), "mumpsnd");
  EXPECT_EQ(chosen(true, KSPPREONLY, "-ksp_type fgmres"), "mumpsnd");
  EXPECT_EQ(chosen(false, KSPPREONLY, ""), "mumpsnd");
  OK(MatDestroy(&A));
  EXPECT_EQ(choose(large, true, {}, [](KSP, PC) {}).package, "mumpsnd");
}

/* A matrix of 645 unknowns with one dense block gets MUMPS, a chain of 5000 does not: size alone does not decide */
TEST_F(LinearChoiceTest, DenseBlockTakesMUMPS)
{
  Triplets entries = chain(1, 640);
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
  /* An ordering of our own that counts its calls */
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

/* A factorization that replaces conjugate gradients reads the options that their preconditioner did not read */
TEST_F(LinearChoiceTest, OrderingOptionReachesALaterFactor)
{
  KSP          ksp;
  PC           pc;
  LinearChoice choice;
  PetscBool    changed, same;
  static int   called;
  called = 0;
  OK(MatOrderingRegister("hhtdae_later", [](Mat A, MatOrderingType, IS *r, IS *c) -> PetscErrorCode {
    ++called;
    return MatGetOrdering(A, MATORDERINGMETISND, r, c);
  }));
  OK(PetscOptionsSetValue(NULL, "-pc_factor_mat_ordering_type", "hhtdae_later"));
  OK(KSPCreate(PETSC_COMM_SELF, &ksp));
  OK(LinearDefaults(ksp, &choice));
  OK(KSPSetOperators(ksp, small, small));
  OK(KSPSetFromOptions(ksp));
  OK(LinearChoose(ksp, small, PETSC_FALSE, &choice));
  OK(LinearChooseSmaller(ksp, small, &choice, &changed));
  ASSERT_TRUE(changed) << choice.text;
  choice.no_room = PETSC_FALSE;
  OK(LinearTakeFactor(ksp, &choice));
  OK(LinearChoose(ksp, small, PETSC_FALSE, &choice));
  OK(KSPGetPC(ksp, &pc));
  OK(PetscObjectTypeCompare((PetscObject)pc, PCLU, &same));
  EXPECT_TRUE(same) << choice.text;
  OK(KSPSetUp(ksp));
  EXPECT_EQ(called, 1);
  OK(PetscOptionsClearValue(NULL, "-pc_factor_mat_ordering_type"));
  OK(KSPDestroy(&ksp));
}

/* The factor has the name under which it was requested; otherwise PETSc would take the same choice for another one */
TEST_F(LinearChoiceTest, APackageIsChosenTwice)
{
  for (const char *package : {"klupair", "kluparts", "mumpsnd", "mumpsmixed"}) {
    SCOPED_TRACE(package);
    if (!has(small, package, MAT_FACTOR_LU)) continue;
    KSP           ksp;
    PC            pc;
    MatSolverType type;
    OK(KSPCreate(PETSC_COMM_SELF, &ksp));
    OK(KSPSetOperators(ksp, small, small));
    OK(KSPGetPC(ksp, &pc));
    OK(PCSetType(pc, PCLU));
    OK(PCFactorSetMatSolverType(pc, package));
    OK(KSPSetUp(ksp));
    OK(PCFactorSetMatSolverType(pc, package));
    OK(PCFactorGetMatSolverType(pc, &type));
    EXPECT_STREQ(type, package);
    OK(KSPDestroy(&ksp));
  }
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

/* TSSetFromOptions() may be called more than once */
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

/* A package that was chosen automatically is not taken for the program's choice in another set-up; the program's
   choice is respected whenever it is made */
TEST_F(LinearChoiceTest, SecondLookAfterAChoice)
{
  KSP          ksp;
  PC           pc;
  LinearChoice choice;
  OK(KSPCreate(PETSC_COMM_SELF, &ksp));
  OK(KSPGetPC(ksp, &pc));
  OK(LinearDefaults(ksp, &choice));
  OK(KSPSetOperators(ksp, large, large));
  OK(LinearChoose(ksp, large, PETSC_TRUE, &choice));
  OK(LinearDefaults(ksp, &choice));
  EXPECT_FALSE(choice.user_pc);
  EXPECT_FALSE(choice.user_package);
  OK(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  OK(LinearDefaults(ksp, &choice));
  EXPECT_FALSE(choice.user_pc);
  EXPECT_TRUE(choice.user_package);
  OK(PCSetType(pc, PCLU));
  OK(LinearDefaults(ksp, &choice));
  EXPECT_TRUE(choice.user_pc);
  OK(KSPDestroy(&ksp));
}

/* The factorization uses the package's own ordering, not the one that PETSc prefers for its own factorization */
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

/* If symmetry is lost between two solves, L D L^T is replaced by LU in the same KSP */
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

} // namespace
