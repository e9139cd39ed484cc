/* The state that a solver takes over from a solver of another run: LinearSaveState(), LinearLoadState() with
   "hhtconstraint" and the choice of the solver */
#include "constraint_fixture.h"
#include <cstdint>
#include <cstring>

namespace
{

/* A solver of one run, and a solver of another run with the same matrix that takes over its state */
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
  /* Makes a KSP like the integrator; type: chosen by the user, "" for the default */
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
  /* Compares the next solve of both */
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

/* Rounding errors of the products are measured at the first solve with a matrix; later solves, for which products
   might be too inaccurate, are not tested again */
TEST_F(SolverState, ProductsThatWereMeasured)
{
  LinearChoice of;
  bar(40, 4, 4);
  OK(VecSet(b, 1)); /* bending: small forces as differences of large ones */
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
  /* into a solver that has already fallen back to double precision */
  Archive again;
  again.data    = archive.data;
  again.reading = true;
  OK(LinearLoadState(ksp, A, &of, &again, &same, &usable));
  EXPECT_TRUE(same && usable);
  expectSameSolve();
}

/* Conjugate gradients that were given up are not tried again; a solver that has already used either solver can take
   over the state of the other */
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

/* If there was no memory for a factorization none is tried later, whatever the matrix */
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

/* A coarse matrix that was unsymmetric at first keeps the LU of the package chosen by the user */
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

/* Nodes that were detected with other values are not detected again, and equality of bits is not promised */
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

/* The user has other options now */
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

/* Damaged or truncated data: either accepted and usable for solving, or refused as not usable */
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
    const std::size_t at = below(k % 2 ? good.size() : std::min<std::size_t>(good.size(), 6000)); /* in the division into nodes, or anywhere */
    if (k % 8 == 0) archive.data.resize(at);
    else archive.data[at] = (char)(k % 3 ? archive.data[at] ^ (1 << below(8)) : (int)below(256));
    load(KSPCG, 1e-6, &of);
    refused += !same;
    if (usable) {
      OK(KSPSolve(other, b, x));
    } else { /* after a new set-up it works */
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
