/* "mumpsmixed": the factor matrix, which wraps a factor of "smumpsnd" or, after a fall back, of "mumpsnd" */
#include "mumpsmixed.h"

#if defined(HHTDAE_HAVE_SMUMPS) && defined(PETSC_USE_REAL_DOUBLE) && !defined(PETSC_USE_COMPLEX)
#include "linear.h"
#include "mumpsnd.h"
#include "vectors.h"
#include <petsc/private/matimpl.h>
#include <utility>
#include <vector>

namespace
{

/* Largest contraction rate of the refinement: the part of the error that one more solve may leave. With a larger rate double precision is as fast, and the
   error of rough solves would raise the rate that the corrector measures. MumpsMixed.BadConditionTakesDoublePrecision. */
constexpr PetscReal max_rate = 0.05;

/* Norms of corrections relative to the solution: refinement ends below the first one; where corrections stagnate, it has succeeded if they are below the second one */
constexpr PetscReal refined_correction = 1e-14, rounding_correction = 1e-8;
constexpr PetscInt  max_it = 20; /* steps of refinement of a solve */

/* Upper limit of the number of factorizations in double precision before single precision is tried again */
constexpr PetscInt max_wait = 256;

struct Mixed {
  Mat              A = nullptr; /* the matrix that was factored, and its state at that time */
  PetscObjectState state;
  Mat              F           = nullptr;
  bool             in_double   = false;              /* F is of double precision */
  PetscInt         retry_after = 0, until_retry = 0; /* factorizations in double precision before single precision is tried again, doubled with every fall back, and those still to
                                                        come. retry_after < 0: memory does not suffice for double precision */
  char             reason[128]     = "";
  bool             analysis_failed = false;   /* structurally singular, or too little memory for the factor */
  PetscReal        rate            = 0;       /* measured contraction rate of the refinement */
  IS               given_order     = nullptr; /* order of elimination from PETSc */
  Vec              r = nullptr, d = nullptr;  /* residual and correction */

  std::vector<std::pair<PetscInt, PetscInt>>  icntl; /* controls set by the program, repeated for each new factor */
  std::vector<std::pair<PetscInt, PetscReal>> cntl;
};

Mixed &Of(Mat F) { return *static_cast<Mixed *>(F->data); }

/* ---- the wrapped factor ---- */

PetscErrorCode MakeFactor(Mat F, Mat A, const char package[])
{
  Mixed &m = Of(F);

  PetscFunctionBegin;
  PetscCall(MatDestroy(&m.F));
  PetscCall(MatGetFactor(A, package, F->factortype, &m.F));
  for (const auto &set : m.icntl) PetscCall(MatMumpsSetIcntl(m.F, set.first, set.second));
  for (const auto &set : m.cntl) PetscCall(MatMumpsSetCntl(m.F, set.first, set.second));
  PetscFunctionReturn(0);
}

PetscErrorCode Symbolic(Mat F, Mat A)
{
  Mixed        &m = Of(F);
  MatFactorInfo info;

  PetscFunctionBegin;
  PetscCall(MatFactorInfoInitialize(&info));
  if (F->factortype == MAT_FACTOR_LU) PetscCall(m.F->ops->lufactorsymbolic(m.F, A, m.given_order, m.given_order, &info));
  else PetscCall(m.F->ops->choleskyfactorsymbolic(m.F, A, m.given_order, &info));
  F->factorerrortype = m.F->factorerrortype;
  m.analysis_failed  = F->factorerrortype != MAT_FACTOR_NOERROR;
  PetscFunctionReturn(0);
}

PetscErrorCode Numeric(Mat F, Mat A)
{
  Mixed        &m = Of(F);
  MatFactorInfo info;

  PetscFunctionBegin;
  PetscCall(MatFactorInfoInitialize(&info));
  PetscCall((F->factortype == MAT_FACTOR_LU ? m.F->ops->lufactornumeric : m.F->ops->choleskyfactornumeric)(m.F, A, &info));
  F->factorerrortype = m.F->factorerrortype;
  PetscFunctionReturn(0);
}

PetscErrorCode SolveOnce(const Mixed &m, Vec b, Vec x, bool transposed)
{
  PetscFunctionBegin;
  PetscCall((transposed ? m.F->ops->solvetranspose : m.F->ops->solve)(m.F, b, x));
  PetscFunctionReturn(0);
}

PetscErrorCode FallBack(Mat F, Mat A, const char reason[])
{
  Mixed &m = Of(F);

  PetscFunctionBegin;
  PetscCall(PetscInfo(F, "From single to double precision: %s\n", reason));
  m.in_double   = true;
  m.until_retry = m.retry_after = PetscClipInterval(2 * m.retry_after, 1, max_wait);
  PetscCall(PetscStrncpy(m.reason, reason, sizeof(m.reason)));
  PetscCall(MakeFactor(F, A, LINEAR_MUMPSND));
  PetscCall(Symbolic(F, A));
  if (!F->factorerrortype) PetscCall(Numeric(F, A));
  PetscFunctionReturn(0);
}

/* Falls back to double precision, and returns to single precision if memory does not suffice for it. A singular matrix is then reported as such, and the integrator takes a
   smaller step; the error of rough solves is left to the corrector (MumpsMixed.NoRoomToFallBack). The factor in single precision is computed again, because both factors
   together would take three times its memory. */
PetscErrorCode TryDouble(Mat F, Mat A, const char reason[])
{
  Mixed &m = Of(F);

  PetscFunctionBegin;
  if (m.retry_after < 0) PetscFunctionReturn(0);
  PetscCall(FallBack(F, A, reason));
  if (F->factorerrortype != MAT_FACTOR_OUTMEMORY) PetscFunctionReturn(0);
  PetscCall(PetscInfo(F, "There is no room for double precision: single precision stays\n"));
  m.in_double   = false;
  m.retry_after = -1;
  PetscCall(MakeFactor(F, A, LINEAR_SMUMPSND));
  PetscCall(Symbolic(F, A));
  if (!F->factorerrortype) PetscCall(Numeric(F, A));
  PetscFunctionReturn(0);
}

/* ---- refinement ---- */

/* d = F^-1 A e - e, where F is the factor: the error that remains of e after one step of refinement, up to its sign */
PetscErrorCode ErrorOf(const Mixed &m, Vec e, Vec work, Vec d)
{
  PetscFunctionBegin;
  PetscCall(MatMult(m.A, e, work));
  PetscCall(SolveOnce(m, work, d, false));
  PetscCall(VecAXPY(d, -1, e));
  PetscFunctionReturn(0);
}

PetscErrorCode MeasureRate(Mixed &m)
{
  Vec       e;
  PetscReal first, second;

  PetscFunctionBegin;
  if (!m.r) PetscCall(MatCreateVecs(m.A, &m.d, &m.r));
  PetscCall(VecDuplicate(m.d, &e));
  PetscCall(LinearPseudoRandom(e, 3));
  PetscCall(ErrorOf(m, e, m.r, m.d));
  PetscCall(VecNorm(m.d, NORM_2, &first));
  PetscCall(ErrorOf(m, m.d, m.r, e));
  PetscCall(VecNorm(e, NORM_2, &second));
  PetscCall(VecDestroy(&e));
  m.rate = first > 0 ? second / first : 0;
  PetscFunctionReturn(0);
}

/* Refines x, the first solution for b, to double precision; *good = PETSC_FALSE if corrections stagnate above rounding */
PetscErrorCode Refine(const Mixed &m, Vec b, Vec x, bool transposed, PetscBool *good)
{
  PetscReal e = 0, last, size;

  PetscFunctionBegin;
  *good = PETSC_FALSE;
  for (PetscInt it = 0; it < max_it; it++) {
    last = e;
    PetscCall((transposed ? MatMultTranspose : MatMult)(m.A, x, m.r));
    PetscCall(VecAYPX(m.r, -1, b));
    PetscCall(SolveOnce(m, m.r, m.d, transposed));
    PetscCall(VecAXPY(x, 1, m.d));
    PetscCall(VecNorm(m.d, NORM_2, &e));
    PetscCall(VecNorm(x, NORM_2, &size));
    *good = (PetscBool)(e * PetscMax(m.rate, it ? e / last : 0) <= refined_correction * size);
    if (*good || PetscIsInfOrNanReal(e)) PetscFunctionReturn(0);
    *good = (PetscBool)(e <= rounding_correction * size);
    if (it && e > 0.5 * last) PetscFunctionReturn(0);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode MaySolveRoughly(const Mixed &m, PetscBool *rough)
{
  PetscObjectState now;

  PetscFunctionBegin;
  PetscCall(LinearSolvesRoughly(m.A, rough));
  if (*rough) PetscFunctionReturn(0);
  PetscCall(PetscObjectStateGet((PetscObject)m.A, &now));
  *rough = (PetscBool)(now != m.state);
  if (*rough) PetscCall(PetscInfo(m.F, "The matrix has changed since it was factored: the solve is not refined\n"));
  PetscFunctionReturn(0);
}

PetscErrorCode Solve(Mat F, Vec b, Vec x, bool transposed)
{
  Mixed    &m = Of(F);
  PetscBool rough, good;
  PetscReal size;

  PetscFunctionBegin;
  if (F->factorerrortype) {
    PetscCall(PetscInfo(F, "Solve with a factor that failed: the result is Inf\n"));
    PetscCall(VecSet(x, PETSC_INFINITY));
    PetscFunctionReturn(0);
  }
  PetscCall(SolveOnce(m, b, x, transposed));
  if (m.in_double) PetscFunctionReturn(0);
  PetscCall(MaySolveRoughly(m, &rough));
  PetscCall(VecNorm(b, NORM_INFINITY, &size));
  if (rough || PetscIsInfOrNanReal(size)) PetscFunctionReturn(0);
  PetscCall(Refine(m, b, x, transposed, &good));
  if (good) PetscFunctionReturn(0);
  PetscCall(TryDouble(F, m.A, "a solve was not refined"));
  if (F->factorerrortype) PetscCall(VecSet(x, PETSC_INFINITY));
  else if (m.in_double) PetscCall(SolveOnce(m, b, x, transposed)); /* without memory for double precision x stays as it is */
  PetscFunctionReturn(0);
}

PetscErrorCode MatSolve_MumpsMixed(Mat F, Vec b, Vec x) { return Solve(F, b, x, false); }

PetscErrorCode MatSolveTranspose_MumpsMixed(Mat F, Vec b, Vec x) { return Solve(F, b, x, F->factortype == MAT_FACTOR_LU); }

/* ---- factorization ---- */

PetscErrorCode FactorSingle(Mat F, Mat A)
{
  Mixed          &m     = Of(F);
  const PetscBool error = A->erroriffailure;
  char            reason[128];

  PetscFunctionBegin;
  A->erroriffailure = (PetscBool)(error && m.retry_after < 0); /* otherwise double precision may succeed */
  PetscCall(Numeric(F, A));
  A->erroriffailure = error;
  if (F->factorerrortype == MAT_FACTOR_OUTMEMORY) { /* double precision would need twice the memory */
    PetscCheck(!error, PetscObjectComm((PetscObject)F), PETSC_ERR_MEM, "There is not enough memory to factor the matrix of %" PetscInt_FMT " rows in single precision", A->rmap->N);
    PetscFunctionReturn(0);
  }
  if (F->factorerrortype == MAT_FACTOR_OTHER) {
    PetscCall(FallBack(F, A, "the matrix is not one of single precision"));
    PetscFunctionReturn(0);
  }
  if (F->factorerrortype) {
    PetscCall(TryDouble(F, A, "the matrix is singular to single precision"));
    PetscFunctionReturn(0);
  }
  PetscCall(MeasureRate(m));
  if (m.rate <= max_rate) PetscFunctionReturn(0);
  PetscCall(PetscSNPrintf(reason, sizeof(reason), "of the error of a solve %.2g is left by the next one, %g is allowed", (double)m.rate, (double)max_rate));
  PetscCall(TryDouble(F, A, reason));
  PetscFunctionReturn(0);
}

PetscErrorCode FactorNumeric(Mat F, Mat A, const MatFactorInfo *)
{
  Mixed &m = Of(F);

  PetscFunctionBegin;
  if (m.analysis_failed && !m.in_double) PetscFunctionReturn(0);
  if (m.analysis_failed) m.until_retry = 0; /* memory did not suffice for double precision of an earlier matrix; single precision may do for this one */
  PetscCall(PetscObjectReference((PetscObject)A));
  PetscCall(MatDestroy(&m.A));
  m.A = A;
  PetscCall(PetscObjectStateGet((PetscObject)A, &m.state));
  if (m.in_double && m.until_retry-- <= 0) { /* the cause of the fall back may have been a single matrix: half the memory is worth another analysis now and then */
    m.in_double = false;
    PetscCall(MakeFactor(F, A, LINEAR_SMUMPSND));
    PetscCall(Symbolic(F, A));
    if (F->factorerrortype) PetscFunctionReturn(0);
  }
  PetscCall((m.in_double ? Numeric : FactorSingle)(F, A));
  F->assembled = PETSC_TRUE;
  PetscFunctionReturn(0);
}

PetscErrorCode FactorSymbolic(Mat F, Mat A, IS given_order)
{
  Mixed &m = Of(F);

  PetscFunctionBegin;
  PetscCall(PetscObjectReference((PetscObject)given_order));
  PetscCall(ISDestroy(&m.given_order));
  m.given_order = given_order;
  PetscCall(Symbolic(F, A));
  F->ops->lufactornumeric = F->ops->choleskyfactornumeric = FactorNumeric;
  F->ops->solve                                           = MatSolve_MumpsMixed;
  F->ops->solvetranspose                                  = MatSolveTranspose_MumpsMixed;
  PetscFunctionReturn(0);
}

PetscErrorCode LUFactorSymbolic(Mat F, Mat A, IS row, IS, const MatFactorInfo *) { return FactorSymbolic(F, A, row); }

PetscErrorCode CholeskyFactorSymbolic(Mat F, Mat A, IS row, const MatFactorInfo *) { return FactorSymbolic(F, A, row); }

/* ---- state ---- */

PetscErrorCode SaveState(Mat F, Archive *archive)
{
  Mixed &m = Of(F);

  PetscFunctionBegin;
  archive->plain(m.in_double);
  archive->plain(m.retry_after);
  archive->plain(m.until_retry);
  archive->plain(m.reason);
  PetscTryMethod(m.F, LINEAR_SAVE_STATE, (Mat, Archive *), (m.F, archive));
  PetscFunctionReturn(0);
}

PetscErrorCode LoadState(Mat F, Mat A, Archive *archive, PetscBool *same)
{
  Mixed   &m           = Of(F);
  bool     in_double   = m.in_double;
  PetscInt retry_after = 0, until_retry = 0;
  char     reason[sizeof(m.reason)] = "";

  PetscFunctionBegin;
  archive->plain(in_double);
  archive->plain(retry_after);
  archive->plain(until_retry);
  archive->plain(reason);
  reason[sizeof(reason) - 1] = 0;
  if (!archive->good) in_double = m.in_double;
  PetscMPIInt change = in_double != m.in_double, all;
  PetscCallMPI(MPI_Allreduce(&change, &all, 1, MPI_INT, MPI_MAX, PetscObjectComm((PetscObject)F)));
  if (all && !m.in_double) PetscCall(FallBack(F, A, reason)); /* the run had a factor in double precision */
  m.retry_after = retry_after;
  m.until_retry = until_retry;
  PetscTryMethod(m.F, LINEAR_LOAD_STATE, (Mat, Mat, Archive *, PetscBool *), (m.F, A, archive, same));
  F->factorerrortype = m.F->factorerrortype;
  if (!F->factorerrortype && !m.in_double) PetscCall(MeasureRate(m));
  PetscFunctionReturn(0);
}

/* ---- information and view ---- */

PetscErrorCode SetIcntl(Mat F, PetscInt i, PetscInt value)
{
  PetscFunctionBegin;
  PetscCall(MatMumpsSetIcntl(Of(F).F, i, value));
  Of(F).icntl.push_back({i, value});
  PetscFunctionReturn(0);
}

PetscErrorCode SetCntl(Mat F, PetscInt i, PetscReal value)
{
  PetscFunctionBegin;
  PetscCall(MatMumpsSetCntl(Of(F).F, i, value));
  Of(F).cntl.push_back({i, value});
  PetscFunctionReturn(0);
}

PetscErrorCode GetIcntl(Mat F, PetscInt i, PetscInt *value) { return MatMumpsGetIcntl(Of(F).F, i, value); }

PetscErrorCode GetCntl(Mat F, PetscInt i, PetscReal *value) { return MatMumpsGetCntl(Of(F).F, i, value); }

PetscErrorCode GetInfog(Mat F, PetscInt i, PetscInt *value) { return MatMumpsGetInfog(Of(F).F, i, value); }

PetscErrorCode GetRinfog(Mat F, PetscInt i, PetscReal *value) { return MatMumpsGetRinfog(Of(F).F, i, value); }

PetscErrorCode GetSolverType(Mat, MatSolverType *type) { return *type = LINEAR_MUMPSMIXED, 0; }

PetscErrorCode GetInfo(Mat F, MatInfoType which, MatInfo *info) { return MatGetInfo(Of(F).F, which, info); }

PetscErrorCode View(Mat F, PetscViewer viewer)
{
  const Mixed      &m = Of(F);
  PetscBool         ascii;
  PetscViewerFormat format;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(0);
  PetscCall(PetscViewerGetFormat(viewer, &format));
  if (format != PETSC_VIEWER_ASCII_INFO && format != PETSC_VIEWER_ASCII_INFO_DETAIL) PetscFunctionReturn(0);
  if (m.in_double) PetscCall(PetscViewerASCIIPrintf(viewer, "factors in double precision: in single precision, %s\n", m.reason));
  else PetscCall(PetscViewerASCIIPrintf(viewer, "factors in single precision; of the error of a solve %.2g is left by the next one\n", (double)m.rate));
  PetscCall(m.F->ops->view(m.F, viewer));
  PetscFunctionReturn(0);
}

/* ---- create and destroy ---- */

const char *const composed[] = {"MatFactorGetSolverType_C", "MatMumpsSetIcntl_C", "MatMumpsGetIcntl_C", "MatMumpsSetCntl_C", "MatMumpsGetCntl_C",
                                "MatMumpsGetInfog_C",       "MatMumpsGetRinfog_C", LINEAR_SAVE_STATE,   LINEAR_LOAD_STATE};

PetscErrorCode Compose(Mat F)
{
  const PetscObject f = (PetscObject)F;

  PetscFunctionBegin;
  PetscCall(PetscObjectComposeFunction(f, "MatFactorGetSolverType_C", GetSolverType));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsSetIcntl_C", SetIcntl));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsGetIcntl_C", GetIcntl));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsSetCntl_C", SetCntl));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsGetCntl_C", GetCntl));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsGetInfog_C", GetInfog));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsGetRinfog_C", GetRinfog));
  PetscCall(PetscObjectComposeFunction(f, LINEAR_SAVE_STATE, SaveState));
  PetscCall(PetscObjectComposeFunction(f, LINEAR_LOAD_STATE, LoadState));
  PetscFunctionReturn(0);
}

PetscErrorCode Destroy(Mat F)
{
  Mixed &m = Of(F);

  PetscFunctionBegin;
  PetscCall(MatDestroy(&m.F));
  PetscCall(MatDestroy(&m.A));
  PetscCall(ISDestroy(&m.given_order));
  PetscCall(VecDestroy(&m.r));
  PetscCall(VecDestroy(&m.d));
  delete &m;
  F->data = NULL;
  for (const char *name : composed) PetscCall(PetscObjectComposeFunction((PetscObject)F, name, NULL));
  PetscFunctionReturn(0);
}

PetscErrorCode MatGetFactor_MumpsMixed(Mat A, MatFactorType type, Mat *factor)
{
  Mat F;

  PetscFunctionBegin;
  PetscCall(MatCreate(PetscObjectComm((PetscObject)A), &F));
  PetscCall(MatSetSizes(F, A->rmap->n, A->cmap->n, A->rmap->N, A->cmap->N));
  PetscCall(PetscStrallocpy(LINEAR_MUMPSMIXED, &((PetscObject)F)->type_name));
  PetscCall(MatSetUp(F));
  F->data                        = new Mixed();
  F->factortype                  = type;
  F->ops->lufactorsymbolic       = LUFactorSymbolic;
  F->ops->choleskyfactorsymbolic = CholeskyFactorSymbolic;
  F->ops->getinfo                = GetInfo;
  F->ops->view                   = View;
  F->ops->destroy                = Destroy;
  PetscCall(MakeFactor(F, A, LINEAR_SMUMPSND));
  F->canuseordering = Of(F).F->canuseordering;
  PetscCall(PetscFree(F->solvertype));
  PetscCall(PetscStrallocpy(LINEAR_MUMPSMIXED, &F->solvertype));
  PetscCall(PetscStrallocpy(MATORDERINGEXTERNAL, (char **)&F->preferredordering[type]));
  PetscCall(Compose(F));
  *factor = F;
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode LinearRegisterMumpsMixed(void)
{
  PetscFunctionBegin;
  PetscCall(LinearRegisterForTypes(LINEAR_MUMPSMIXED, MatGetFactor_MumpsMixed));
  PetscFunctionReturn(0);
}

#else

PetscErrorCode LinearRegisterMumpsMixed(void) { return 0; }

#endif
