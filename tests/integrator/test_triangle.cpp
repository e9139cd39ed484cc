/* Jacobians that store one triangle (MATSBAIJ): the run is the same as with the full matrix, or is refused with a reason */
#include "triangle.h"

using namespace hhtest;

namespace
{

const char tight[] = "-ts_rtol 1e-5 -ts_atol 1e-5 ";

bool haveMUMPS(PetscInt block)
{
  Mat       A;
  PetscBool is;
  must(MatCreateSeqSBAIJ(PETSC_COMM_SELF, block, 6, 6, 1, nullptr, &A));
  must(MatGetFactorAvailable(A, "mumpsnd", MAT_FACTOR_CHOLESKY, &is));
  must(MatDestroy(&A));
  return is;
}

std::string refusal(const Problem &p, const std::string &options, bool setRoles)
{
  ErrorTrap trap;
  EXPECT_NE(TriangleRun(PETSC_COMM_SELF, p, 1, options, setRoles).error, 0) << p.name;
  return trap.message;
}

} // namespace

TEST(Triangle, SameRunAsWithAllOfTheMatrix)
{
  if (!haveMUMPS(1)) GTEST_SKIP() << "this PETSc was built without MUMPS";
  const Net p;
  for (bool setRoles : {true, false})
    for (const char *form : {"", "-ts_hhtdae_form paper "}) {
      const std::string options = std::string(tight) + form;
      const TriangleRun full(PETSC_COMM_SELF, p, 0, options, setRoles);
      for (PetscInt block : {1, 2, 3}) {
        const TriangleRun half(PETSC_COMM_SELF, p, block, options, setRoles);
        MEASURED("blocks of %d, roles %s%s: differ by %.1e in q, %.1e in lambda; %d steps", (int)block, setRoles ? "set" : "detected", *form ? ", paper's form" : "",
                 relativeDifference(full.q, half.q), relativeDifference(full.lambda, half.lambda), (int)half.s.steps);
        expectSame(full, half);
        EXPECT_EQ(half.solver, PCCHOLESKY);
        EXPECT_GT(half.s.steps, 20);
      }
    }
}

/* PETSc's LDL^T does not pivot: it can be used where there are no multipliers */
TEST(Triangle, TheUsersSolverHolds)
{
  const std::string cholesky = std::string(tight) + "-pc_type cholesky -pc_factor_mat_solver_type petsc ", package = std::string(tight) + "-pc_factor_mat_solver_type ";
  const Net         p, free(NetRods::None);
  const TriangleRun full(PETSC_COMM_SELF, p, 0, tight, true), unheld(PETSC_COMM_SELF, free, 0, tight, true);
  expectSame(unheld, TriangleRun(PETSC_COMM_SELF, free, 1, cholesky, true));
  expectSame(unheld, TriangleRun(PETSC_COMM_SELF, free, 1, package + "petsc ", true));
  expectSame(unheld, TriangleRun(PETSC_COMM_SELF, free, 1, std::string(tight) + "-ksp_type cg -ksp_rtol 1e-13 -pc_type jacobi ", true));
  if (haveMUMPS(1)) {
    expectSame(unheld, TriangleRun(PETSC_COMM_SELF, free, 3, tight, false));
    expectSame(full, TriangleRun(PETSC_COMM_SELF, p, 3, package + "mumps ", true));
  }
  const std::string said = refusal(p, "-pc_type lu ", true);
  EXPECT_NE(said.find("-pc_type cholesky"), std::string::npos) << said;
}

/* Differences fill whole columns, that is both triangles, and are refused */
TEST(Triangle, DifferencesAreRefused)
{
  TS   ts;
  Vec  U, V;
  Mat  S;
  auto residual = [](TS, PetscReal, Vec X, Vec, Vec A, Vec F, void *) -> PetscErrorCode { return VecWAXPY(F, 1, X, A); };
  must(VecCreateSeq(PETSC_COMM_SELF, 2, &U));
  must(VecDuplicate(U, &V));
  must(VecSet(U, 1));
  must(VecSet(V, 0));
  must(MatCreateSeqSBAIJ(PETSC_COMM_SELF, 1, 2, 2, 2, nullptr, &S));
  must(TSCreate(PETSC_COMM_SELF, &ts));
  must(TSSetType(ts, TSHHT3));
  must(TSSetI2Function(ts, nullptr, residual, nullptr));
  must(TSSetI2Jacobian(ts, S, S, nullptr, nullptr));
  must(TS2SetSolution(ts, U, V));
  {
    ErrorTrap trap;
    EXPECT_NE(TSSolve(ts, nullptr), 0);
    EXPECT_TRUE(trap.says("holds one triangle")) << trap.message;
  }
  must(TSDestroy(&ts));
  must(MatDestroy(&S));
  must(VecDestroy(&U));
  must(VecDestroy(&V));
}

TEST(Triangle, RedundantRowsAreNamed)
{
  const Net         p(NetRods::Redundant);
  const std::string said = refusal(p, "", true);
  EXPECT_NE(said.find("rows 34, 35 depend on one another"), std::string::npos) << said;
}

/* Roles that make the matrix unsymmetric are refused, whether set by the application or detected from the triangle */
TEST(Triangle, RolesThatBreakTheSymmetryAreNamed)
{
  const UserVars vars(1.);
  const Sleigh   sleigh(1.);
  const auto     says = [](const Problem &p, bool setRoles, const char *what) {
    const std::string said = refusal(p, "", setRoles);
    EXPECT_NE(said.find(what), std::string::npos) << p.name << ": " << said;
    EXPECT_NE(said.find("aij"), std::string::npos) << said;
  };
  for (bool setRoles : {true, false}) {
    says(sleigh, setRoles, "is a velocity-level constraint (of 1)");
    says(vars, setRoles, "is a");
  }
}

/* If the TS gets another SNES during a run, the matrix of that SNES stores one triangle */
TEST(Triangle, AnotherSNESBetweenSteps)
{
  const Sleigh p(1.);
  Simulation   run(p, tolerance(1e-5) + "-ts_exact_final_time stepover ");
  SNES         snes;
  Mat          S;
  must(run.step());
  must(MatCreateSeqSBAIJ(PETSC_COMM_SELF, 1, p.n, p.n, p.n, nullptr, &S));
  must(MatSetOption(S, MAT_IGNORE_LOWER_TRIANGULAR, PETSC_TRUE));
  must(SNESCreate(PETSC_COMM_SELF, &snes));
  must(SNESSetJacobian(snes, S, S, SNESTSFormJacobian, run.ts));
  must(TSSetSNES(run.ts, snes));
  {
    ErrorTrap trap;
    EXPECT_NE(run.step(), 0);
    EXPECT_TRUE(trap.says("is a velocity-level constraint (of 1)")) << trap.message;
  }
  must(SNESDestroy(&snes));
  must(MatDestroy(&S));
}
