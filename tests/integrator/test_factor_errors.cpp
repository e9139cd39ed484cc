/* A package that cannot factor a matrix reports it through its preconditioner, and the step is repeated or refused;
   every other error of a package is returned unchanged */
#include "support.h"

#include <petsc/private/matimpl.h>

using namespace hhtest;

namespace
{

/* A package (klupair with changed functions) whose factorizations fail as described here */
struct Faulty {
  int            calls = 0, at = 0, until = 1 << 30; /* factorizations so far; those from `at` to `until` fail */
  PetscErrorCode code  = 0;
  MatFactorError error = MAT_FACTOR_NOERROR;
};
Faulty faulty;

constexpr char package[] = "faulty";

PetscErrorCode (*realNumeric)(Mat, Mat, const MatFactorInfo *);
PetscErrorCode (*realSymbolic)(Mat, Mat, IS, IS, const MatFactorInfo *);

PetscErrorCode numeric(Mat F, Mat A, const MatFactorInfo *info)
{
  PetscFunctionBegin;
  PetscCall((*realNumeric)(F, A, info));
  F->ops->lufactornumeric = numeric;
  if (++faulty.calls < faulty.at || faulty.calls >= faulty.until) PetscFunctionReturn(0);
  PetscCheck(!faulty.code, PETSC_COMM_SELF, faulty.code, "The package has a defect");
  F->factorerrortype = faulty.error;
  PetscFunctionReturn(0);
}

PetscErrorCode symbolic(Mat F, Mat A, IS row, IS col, const MatFactorInfo *info)
{
  PetscFunctionBegin;
  PetscCall((*realSymbolic)(F, A, row, col, info));
  realNumeric             = F->ops->lufactornumeric;
  F->ops->lufactornumeric = numeric;
  PetscFunctionReturn(0);
}

PetscErrorCode getFactor(Mat A, MatFactorType type, Mat *F)
{
  PetscFunctionBegin;
  PetscCall(MatGetFactor(A, "klupair", type, F));
  realSymbolic                 = (*F)->ops->lufactorsymbolic;
  (*F)->ops->lufactorsymbolic  = symbolic;
  PetscFunctionReturn(0);
}

std::string runFaulty(const Faulty &how, PetscErrorCode *code, TSHHT3Statistics *s = nullptr, const std::string &options = "")
{
  must(MatSolverTypeRegister(package, MATSEQAIJ, MAT_FACTOR_LU, getFactor));
  faulty = how;
  const Pendulum p(-90., 0., .5);
  Simulation     run(p, tolerance(1e-5) + "-pc_type lu -pc_factor_mat_solver_type faulty " + options);
  ErrorTrap      trap;
  *code = run.solve();
  if (s) *s = run.statistics();
  return trap.message;
}

Faulty failing(int at, PetscErrorCode code, MatFactorError error = MAT_FACTOR_NOERROR)
{
  Faulty f;
  f.at    = at;
  f.code  = code;
  f.error = error;
  return f;
}

} // namespace

TEST(FactorErrors, GoUpAsTheyAre)
{
  PetscErrorCode code;
  for (PetscErrorCode e : {PETSC_ERR_MEM, PETSC_ERR_PLIB, PETSC_ERR_LIB, PETSC_ERR_MPI}) {
    for (int at : {1, 4}) {
      const std::string message = runFaulty(failing(at, e), &code);
      EXPECT_EQ(code, e) << at;
      EXPECT_NE(message.find("The package has a defect"), std::string::npos) << message;
    }
  }
}

TEST(FactorErrors, SingularMatricesCutTheStep)
{
  PetscErrorCode   code;
  TSHHT3Statistics s;
  Faulty           f = failing(6, (PetscErrorCode)0, MAT_FACTOR_NUMERIC_ZEROPIVOT);
  f.until            = 8;
  EXPECT_EQ(runFaulty(f, &code, &s), "");
  EXPECT_EQ(code, 0);
  EXPECT_GE(s.corrector_fails, 1);
  f.until                   = 1 << 30;
  const std::string message = runFaulty(f, &code);
  EXPECT_NE(code, 0);
  EXPECT_NE(message.find("faulty has met a zero pivot"), std::string::npos) << message; /* from the start that replaces too short steps */
  const std::string at_once = runFaulty(f, &code, nullptr, "-ts_max_reject 0 -ts_dt 1e-3 -ts_adapt_dt_max 1e-3 -ts_hhtdae_reuse 1,0,1");
  EXPECT_NE(at_once.find("singular, or a pivot of it too small for faulty"), std::string::npos) << at_once;
}

TEST(FactorErrors, OutOfMemoryEndsTheRunAtOnce)
{
  PetscErrorCode    code;
  TSHHT3Statistics  s;
  const std::string message = runFaulty(failing(4, (PetscErrorCode)0, MAT_FACTOR_OUTMEMORY), &code, &s);
  EXPECT_EQ(code, PETSC_ERR_MEM);
  EXPECT_NE(message.find("not enough memory to factor the Newton matrix of 3 rows by faulty"), std::string::npos) << message;
  EXPECT_LE(s.corrector_fails, 1);
}

TEST(FactorErrors, OtherReasonsAreNamed)
{
  PetscErrorCode    code;
  const std::string message = runFaulty(failing(4, (PetscErrorCode)0, MAT_FACTOR_OTHER), &code);
  EXPECT_EQ(code, PETSC_ERR_NOT_CONVERGED);
  EXPECT_NE(message.find("FACTOR_OTHER"), std::string::npos) << message;
  EXPECT_EQ(message.find("singular"), std::string::npos) << message;
}
