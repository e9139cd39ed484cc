/* Factorizations in single precision: accuracy of solves, and when double precision replaces them */
#include "bench/linear_matrices.h"
#include "linear/linear.h"
#include "linear/memory.h"
#include "view_text.h"
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <hhtdae/hhtdae.h>
#include <petsc/private/matimpl.h>
#include <petscksp.h>
#include <string>

#define OK(call) ASSERT_EQ((call), 0)
#define OKIN(call) EXPECT_EQ((call), 0) /* for functions with results */

namespace
{

/* A KSP with this factorization, and a known solution */
struct Solver {
  Mat       A;
  KSP       ksp;
  PC        pc;
  Vec       known, b, x;
  PetscReal error = -1; /* relative to the known solution */

  Solver(Mat matrix, const char package[], const char type[] = PCCHOLESKY) : A(matrix)
  {
    EXPECT_EQ(KSPCreate(PetscObjectComm((PetscObject)A), &ksp), 0);
    EXPECT_EQ(KSPSetType(ksp, KSPPREONLY), 0);
    EXPECT_EQ(KSPGetPC(ksp, &pc), 0);
    EXPECT_EQ(PCSetType(pc, type), 0);
    EXPECT_EQ(PCFactorSetMatSolverType(pc, package), 0);
    EXPECT_EQ(KSPSetOperators(ksp, A, A), 0);
    EXPECT_EQ(MatCreateVecs(A, &x, &b), 0);
    EXPECT_EQ(VecDuplicate(x, &known), 0);
    EXPECT_EQ(VecSetRandom(known, NULL), 0);
  }
  ~Solver()
  {
    EXPECT_EQ(KSPDestroy(&ksp), 0);
    for (Vec *v : {&known, &b, &x}) EXPECT_EQ(VecDestroy(v), 0);
  }
  Solver(const Solver &) = delete;

  void solve(double unit = 1, bool transposed = false)
  {
    PetscReal size;
    EXPECT_EQ((transposed ? MatMultTranspose : MatMult)(A, known, b), 0);
    EXPECT_EQ(VecScale(b, unit), 0);
    EXPECT_EQ((transposed ? KSPSolveTranspose : KSPSolve)(ksp, b, x), 0);
    EXPECT_EQ(VecScale(x, 1 / unit), 0);
    EXPECT_EQ(VecAXPY(x, -1, known), 0);
    EXPECT_EQ(VecNorm(x, NORM_2, &error), 0);
    EXPECT_EQ(VecNorm(known, NORM_2, &size), 0);
    error /= size;
  }

  KSPConvergedReason reason() const
  {
    KSPConvergedReason r;
    EXPECT_EQ(KSPGetConvergedReason(ksp, &r), 0);
    return r;
  }

  PCFailedReason failed() const
  {
    PCFailedReason r;
    EXPECT_EQ(PCGetFailedReason(pc, &r), 0);
    return r;
  }

  std::string text() const
  {
    return ViewText([&](PetscViewer v) { return KSPView(ksp, v); });
  }
};

/* The stiffness matrix of a rod held at its ends, whose condition number grows like n^2 */
Triplets rod(PetscInt n)
{
  Triplets e;
  e.n = n;
  for (PetscInt i = 0; i < n; i++) {
    e.add(i, i, 2.);
    if (i) e.add_symmetric(i - 1, i, -1.);
  }
  return e;
}

/* A block whose first node is held twice */
Triplets redundant(PetscInt side)
{
  Triplets e = block(side, side, side, true);
  for (PetscInt d = 0; d < 3; ++d) {
    const PetscInt row = e.n++;
    e.add_symmetric(row, d, 2.0);
    e.add(row, row, 0.0);
  }
  return e;
}

class MumpsMixed : public testing::Test
{
protected:
  Mat A = nullptr;

  void SetUp() override
  {
    PetscBool available;
    create(block(6, 6, 6, true));
    OK(MatGetFactorAvailable(A, "mumpsmixed", MAT_FACTOR_LU, &available));
    if (!available) GTEST_SKIP() << "there is no MUMPS of single precision";
  }
  void TearDown() override { OK(MatDestroy(&A)); }

  void create(const Triplets &e)
  {
    OK(MatDestroy(&A));
    OK(create_matrix(e, &A));
  }

  /* Makes the matrix unsymmetric */
  void skew()
  {
    OK(MatSetValue(A, 0, 1, 5.0, INSERT_VALUES));
    OK(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    OK(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  }
};

} // namespace

TEST_F(MumpsMixed, SinglePrecisionIsSingle)
{
  for (const char *type : {PCLU, PCCHOLESKY}) {
    Solver s(A, "smumpsnd", type);
    s.solve();
    EXPECT_LT(s.error, 1e-3) << type;
    EXPECT_GT(s.error, 1e-9) << type;
    EXPECT_NE(s.text().find("in single precision"), std::string::npos) << s.text();
  }
}

TEST_F(MumpsMixed, SolvesToDoublePrecision)
{
  for (const char *type : {PCLU, PCCHOLESKY}) {
    Solver s(A, "mumpsmixed", type), d(A, "mumpsnd", type);
    s.solve();
    d.solve();
    EXPECT_LT(s.error, 1e-12) << type;
    EXPECT_LT(s.error, 10 * d.error + 1e-14) << type;
    EXPECT_NE(s.text().find("factors in single precision"), std::string::npos) << s.text();
  }
  skew();
  Solver s(A, "mumpsmixed", PCLU);
  s.solve();
  EXPECT_LT(s.error, 1e-12);
  s.solve(1, true);
  EXPECT_LT(s.error, 1e-12);
}

/* It uses half of the memory, which is its purpose */
TEST_F(MumpsMixed, TakesHalfTheMemory)
{
  PetscInt bytes[2];
  create(block(16, 16, 16, true));
  for (int k = 0; k < 2; k++) {
    Mat    F;
    Solver s(A, k ? "mumpsmixed" : "mumpsnd");
    s.solve();
    EXPECT_LT(s.error, 1e-11);
    OK(PCFactorGetMatrix(s.pc, &F));
    OK(MatMumpsGetInfog(F, 19, &bytes[k])); /* MB on all ranks */
  }
  EXPECT_LT((double)bytes[1], 0.6 * (double)bytes[0]);
}

/* One solve without refinement while the caller removes the error; with as many refinements as needed before and after */
TEST_F(MumpsMixed, RoughSolves)
{
  Solver s(A, "mumpsmixed");
  s.solve();
  EXPECT_LT(s.error, 1e-12);
  OK(LinearSolveRoughly(A, PETSC_TRUE));
  s.solve();
  EXPECT_LT(s.error, 1e-3);
  EXPECT_GT(s.error, 1e-9);
  OK(LinearSolveRoughly(A, PETSC_FALSE));
  s.solve();
  EXPECT_LT(s.error, 1e-12);
}

/* An old factor of a changed matrix solves with its own matrix, like any other old factor: refinement must not mix
   both matrices */
TEST_F(MumpsMixed, AnOldFactorStaysOne)
{
  Solver old(A, "mumpsnd"), s(A, "mumpsmixed");
  for (Solver *k : {&old, &s}) {
    OK(VecSet(k->known, 1));
    k->solve();
    OK(PCSetReusePreconditioner(k->pc, PETSC_TRUE));
  }
  OK(MatScale(A, 1.5));
  for (Solver *k : {&old, &s}) {
    k->solve();
    EXPECT_NEAR(k->error, 0.5, 1e-4);
  }
}

TEST_F(MumpsMixed, RightHandSidesOfAnySize)
{
  for (const char *package : {"smumpsnd", "mumpsmixed"}) {
    Solver    s(A, package);
    PetscReal norm;
    for (double unit : {1e-200, 1e-40, 1e40, 1e200}) {
      s.solve(unit);
      EXPECT_LT(s.error, package[0] == 's' ? 1e-3 : 1e-12) << package << " " << unit;
    }
    OK(VecSet(s.b, 0));
    OK(KSPSolve(s.ksp, s.b, s.x));
    OK(VecNorm(s.x, NORM_2, &norm));
    EXPECT_EQ(norm, 0);
    OK(VecSetValue(s.b, 3, NAN, INSERT_VALUES));
    OK(VecAssemblyBegin(s.b));
    OK(VecAssemblyEnd(s.b));
    OK(KSPSolve(s.ksp, s.b, s.x));
    OK(VecNorm(s.x, NORM_2, &norm));
    EXPECT_FALSE(std::isfinite(norm)) << package;
  }
}

TEST_F(MumpsMixed, EntriesBeyondTheRange)
{
  for (double unit : {1e60, 1e-60}) {
    create(block(4, 4, 4, true));
    OK(MatScale(A, unit));
    Solver single(A, "smumpsnd"), mixed(A, "mumpsmixed");
    single.solve();
    EXPECT_LT(single.reason(), 0) << unit;
    EXPECT_NE(single.failed(), PC_NOERROR) << unit;
    mixed.solve();
    EXPECT_GT(mixed.reason(), 0) << unit;
    EXPECT_LT(mixed.error, 1e-12) << unit;
    EXPECT_NE(mixed.text().find("factors in double precision: in single precision, the matrix is"), std::string::npos) << mixed.text();
  }
}

TEST_F(MumpsMixed, SingularMatrixIsReported)
{
  create(redundant(4));
  for (const char *type : {PCLU, PCCHOLESKY})
    for (const char *package : {"smumpsnd", "mumpsmixed"}) {
      Solver s(A, package, type);
      s.solve();
      EXPECT_EQ(s.reason(), KSP_DIVERGED_PC_FAILED) << package << type;
      EXPECT_TRUE(s.failed() == PC_FACTOR_NUMERIC_ZEROPIVOT || s.failed() == PC_FACTOR_STRUCT_ZEROPIVOT) << package << type << s.failed();
    }
  Solver s(A, "mumpsmixed");
  OK(KSPSetErrorIfNotConverged(s.ksp, PETSC_TRUE));
  OK(PetscPushErrorHandler(PetscReturnErrorHandler, NULL));
  EXPECT_NE(KSPSetUp(s.ksp), 0);
  OK(PetscPopErrorHandler());
  EXPECT_TRUE(A->erroriffailure);
}

/* A matrix with NaN neither causes an endless wait nor gives a solution */
TEST_F(MumpsMixed, MatrixThatIsNotANumber)
{
  OK(MatSetValue(A, 4, 4, NAN, INSERT_VALUES));
  OK(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  OK(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  for (const char *package : {"smumpsnd", "mumpsmixed"}) {
    Solver s(A, package);
    s.solve();
    EXPECT_FALSE(s.reason() > 0 && std::isfinite(s.error)) << package;
  }
}

/* Regular, but singular to single precision */
TEST_F(MumpsMixed, BadConditionTakesDoublePrecision)
{
  create(rod(300));
  Solver good(A, "mumpsmixed");
  good.solve();
  EXPECT_LT(good.error, 1e-11);
  EXPECT_NE(good.text().find("factors in single precision"), std::string::npos) << good.text();
  Mat B;
  OK(create_matrix(rod(20000), &B));
  Solver bad(B, "mumpsmixed"), d(B, "mumpsnd");
  bad.solve();
  d.solve();
  EXPECT_NE(bad.text().find("factors in double precision"), std::string::npos) << bad.text();
  EXPECT_LE(bad.error, 1e-8);
  EXPECT_LE(bad.error, 10 * d.error + 1e-14);
  OK(MatDestroy(&B));
}

/* With the MUMPS controls that the program has set. After every fallback, twice as many matrices are factored in
   double precision before single precision is tried again */
TEST_F(MumpsMixed, FallsBackAndReturns)
{
  Mat         F;
  PetscInt    value;
  Solver      s(A, "mumpsmixed");
  std::string said;
  OK(PCFactorSetUpMatSolverType(s.pc));
  OK(PCFactorGetMatrix(s.pc, &F));
  OK(MatMumpsSetIcntl(F, 14, 77));
  for (double unit : {2., 1e60, 2., 2., 1e60, 2., 2., 2., 2.}) {
    OK(MatScale(A, unit));
    s.solve();
    EXPECT_LT(s.error, 1e-12);
    said += s.text().find("factors in double precision") != std::string::npos ? 'd' : 's';
    OK(MatMumpsGetIcntl(F, 14, &value));
    EXPECT_EQ(value, 77);
    OK(MatScale(A, 1 / unit));
  }
  EXPECT_EQ(said, "sddsdddss");
}

TEST_F(MumpsMixed, SmallWorkspaceGrows)
{
  Mat      F;
  PetscInt percent;
  Solver   s(A, "mumpsmixed", PCLU);
  OK(PCFactorSetUpMatSolverType(s.pc));
  OK(PCFactorGetMatrix(s.pc, &F));
  OK(MatMumpsSetIcntl(F, 14, -60));
  s.solve();
  EXPECT_LT(s.error, 1e-12);
  OK(MatMumpsGetIcntl(F, 14, &percent));
  EXPECT_GT(percent, -60);
  EXPECT_NE(s.text().find("factors in single precision"), std::string::npos) << s.text();
}

/* If the predicted memory is not available, no factorization is begun, with every package, and also when falling back
   to double precision */
TEST_F(MumpsMixed, NoRoom)
{
  create(block(12, 12, 12, true)); /* 22 MB in single precision, 40 in double */
  const auto solved = [&](const char package[], const char memory[]) {
    OKIN(PetscOptionsSetValue(NULL, "-mat_mumps_memory", memory));
    Solver s(A, package);
    s.solve();
    OKIN(PetscOptionsClearValue(NULL, "-mat_mumps_memory"));
    if (s.reason() < 0) {
      EXPECT_EQ(s.failed(), PC_FACTOR_OUTMEMORY) << package << memory;
      EXPECT_FALSE(std::isfinite(s.error)) << package << memory;
    }
    return s.reason() > 0;
  };
  for (const char *package : {"mumpsnd", "smumpsnd", "mumpsmixed"}) {
    EXPECT_FALSE(solved(package, "1")) << package;
    EXPECT_TRUE(solved(package, "1000")) << package;
    EXPECT_TRUE(solved(package, "0")) << package;
  }
  EXPECT_TRUE(solved("mumpsmixed", "30"));
  EXPECT_FALSE(solved("mumpsnd", "30"));
  OK(MatScale(A, 1e60));
  EXPECT_FALSE(solved("mumpsmixed", "30"));
}

/* If there is no memory for double precision, the result in single precision counts: a singular matrix is not reported
   as lack of memory, a matrix that is solved inaccurately is solved, and the next one is factored as usual */
TEST_F(MumpsMixed, NoRoomToFallBack)
{
  Triplets       singular = redundant(8), loose = block(8, 8, 8, true);
  const PetscInt first    = loose.n;
  for (PetscInt i = first; i < first + 100; i++) { /* a chain of springs that is hardly held */
    const double k = 1 + 0.1 * std::sin(i);
    loose.add(i, i, i > first ? k : 1e-5);
    if (i == first) continue;
    loose.add(i - 1, i - 1, k);
    loose.add_symmetric(i - 1, i, -k);
  }
  loose.n += 100;
  OK(PetscOptionsSetValue(NULL, "-mat_mumps_memory", "8")); /* 6 MB in single precision, 10 in double */
  create(singular);
  {
    Solver s(A, "mumpsmixed");
    s.solve();
    EXPECT_EQ(s.failed(), PC_FACTOR_NUMERIC_ZEROPIVOT) << PCFailedReasons[s.failed()];
    for (PetscInt row = singular.n - 3; row < singular.n; row++) { OK(MatSetValue(A, row, row, 1.0, INSERT_VALUES)); }
    OK(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    OK(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
    s.solve();
    EXPECT_GT(s.reason(), 0) << PCFailedReasons[s.failed()];
    EXPECT_LT(s.error, 1e-11);
  }
  create(loose);
  {
    Solver s(A, "mumpsmixed");
    OK(LinearSolveRoughly(A, PETSC_TRUE));
    for (double unit : {1., 2.}) {
      OK(MatScale(A, unit));
      s.solve();
      EXPECT_GT(s.reason(), 0) << PCFailedReasons[s.failed()];
      EXPECT_LT(s.error, 0.5);
      EXPECT_NE(s.text().find("factors in single precision"), std::string::npos) << s.text();
    }
    OK(LinearSolveRoughly(A, PETSC_FALSE));
    s.solve();
    EXPECT_LT(s.error, 1e-8);
  }
  /* a support so weak that solves cannot be refined does not prevent later factorizations */
  loose.add(first, first, 1e-7 - 1e-5);
  OK(PetscOptionsSetValue(NULL, "-mat_mumps_cntl_3", "1e-9")); /* no null pivot yet */
  create(loose);
  {
    Solver s(A, "mumpsmixed");
    OK(LinearSolveRoughly(A, PETSC_TRUE));
    s.solve();
    OK(LinearSolveRoughly(A, PETSC_FALSE));
    s.solve();
    EXPECT_EQ(s.failed(), PC_NOERROR) << PCFailedReasons[s.failed()];
    EXPECT_LT(s.error, 1);
    OK(LinearSolveRoughly(A, PETSC_TRUE));
    OK(MatScale(A, 2));
    s.solve();
    EXPECT_GT(s.reason(), 0) << PCFailedReasons[s.failed()];
    EXPECT_NE(s.text().find("factors in single precision"), std::string::npos) << s.text();
  }
  OK(PetscOptionsClearValue(NULL, "-mat_mumps_cntl_3"));
  OK(PetscOptionsClearValue(NULL, "-mat_mumps_memory"));
}

/* The solver that replaces a factorization without enough memory, if the user has not chosen one */
TEST_F(MumpsMixed, WhatSolvesWithoutRoom)
{
  for (PetscBool symmetric : {PETSC_TRUE, PETSC_FALSE}) {
    create(block(8, 8, 8, true));
    KSP          ksp;
    LinearChoice choice;
    PetscBool    changed, same;
    OK(KSPCreate(PETSC_COMM_SELF, &ksp));
    OK(LinearDefaults(ksp, &choice));
    OK(KSPSetOperators(ksp, A, A));
    OK(LinearChoose(ksp, A, symmetric, &choice));
    OK(LinearChooseSmaller(ksp, A, &choice, &changed));
    EXPECT_TRUE(changed);
    OK(PetscObjectTypeCompare((PetscObject)ksp, symmetric ? KSPCG : KSPFGMRES, &same));
    EXPECT_TRUE(same);
    OK(LinearChooseSmaller(ksp, A, &choice, &changed));
    EXPECT_FALSE(changed);
    OK(LinearChoose(ksp, A, PETSC_FALSE, &choice)); /* symmetry is lost */
    OK(PetscObjectTypeCompare((PetscObject)ksp, KSPFGMRES, &same));
    EXPECT_TRUE(same);
    OK(KSPDestroy(&ksp));
  }
  Solver       s(A, "mumpsnd");
  LinearChoice choice;
  PetscBool    changed;
  OK(LinearDefaults(s.ksp, &choice));
  OK(LinearChooseSmaller(s.ksp, A, &choice, &changed));
  EXPECT_FALSE(changed);
}

TEST(Memory, OfTheMachine)
{
  LinearMemory m;
  const double free = LinearFreeMemory();
  EXPECT_GT(free, 1);
#if defined(__linux__)
  EXPECT_LT(free, 1e9);
#endif
  OK(LinearMemoryOf(PETSC_COMM_SELF, 7, 5, &m));
  EXPECT_EQ(m.need, 7);
  EXPECT_EQ(m.free, 5);
  OK(LinearMemoryOf(PETSC_COMM_SELF, 7, -1, &m));
  EXPECT_GT(m.free, 0.5 * free);
}

/* Files as the kernel writes them: a limit applies to all groups below its group (SLURM jobs, systemd slices) */
TEST(Memory, OfControlGroups)
{
  char root[] = "/tmp/hhtdae_memory_XXXXXX";
  ASSERT_NE(mkdtemp(root), nullptr);
  const std::string at    = root;
  const auto        write = [&](const std::string &file, const std::string &text) {
    std::filesystem::create_directories(std::filesystem::path(at + file).parent_path());
    std::ofstream(at + file) << text;
  };
  const std::string job = "/sys/fs/cgroup/job_7", leaf = job + "/step_0/user/task_0";
  write("/proc/meminfo", "MemTotal: 99000000 kB\nMemAvailable: 50000000 kB\nSwapFree: 1000000 kB\n");
  EXPECT_NEAR(LinearFreeMemory(at), 51000000 * 1.024e-3, 1e-6);
  write("/proc/self/cgroup", "1:name=systemd:/\n0::/job_7/step_0/user/task_0\n");
  write(leaf + "/memory.max", "max\n");
  write(leaf + "/memory.current", "1000000\n");
  EXPECT_NEAR(LinearFreeMemory(at), 51000000 * 1.024e-3, 1e-6);
  write(job + "/memory.max", "8000000000\n");
  write(job + "/memory.current", "3000000000\n");
  write(job + "/memory.stat", "anon 2000000000\nfile 500000000\n");
  EXPECT_NEAR(LinearFreeMemory(at), 5500, 1e-6);
  write(leaf + "/memory.max", "2000000000\n");
  EXPECT_NEAR(LinearFreeMemory(at), 1999, 1e-6);
  std::filesystem::remove_all(at);
}

TEST_F(MumpsMixed, ManyRightHandSides)
{
  Mat           F, B, X, R;
  MatFactorInfo info;
  PetscReal     error, norm;
  OK(MatFactorInfoInitialize(&info));
  OK(MatCreateDense(PETSC_COMM_SELF, PETSC_DECIDE, 5, A->rmap->N, 5, NULL, &B));
  OK(MatSetRandom(B, NULL));
  OK(MatDuplicate(B, MAT_DO_NOT_COPY_VALUES, &X));
  OK(MatNorm(B, NORM_FROBENIUS, &norm));
  OK(MatGetFactor(A, "mumpsmixed", MAT_FACTOR_CHOLESKY, &F));
  OK(MatCholeskyFactorSymbolic(F, A, NULL, &info));
  OK(MatCholeskyFactorNumeric(F, A, &info));
  OK(MatMatSolve(F, B, X));
  OK(MatMatMult(A, X, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &R));
  OK(MatAXPY(R, -1.0, B, SAME_NONZERO_PATTERN));
  OK(MatNorm(R, NORM_FROBENIUS, &error));
  EXPECT_LT(error, 1e-12 * norm);
  for (Mat *M : {&F, &B, &X, &R}) OK(MatDestroy(M));
}
