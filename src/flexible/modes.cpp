/* Blocks of distributed vectors, and factorizations, for the reduction of a body. Eigenvalues: eigenvalues.cpp */
#include "modes.h"
#include "hhtdae/hhtdae.h"
#include <algorithm>
#include <cmath>
#include <slepceps.h>
#include <sys/resource.h>

namespace hhtdae
{

/* ---- blocks ---- */

static PetscErrorCode WrapBlock(Mat A, bool columns_of_A, PetscInt count, const double *values, Mat *dense)
{
  PetscInt rows, cols;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(A, &rows, &cols));
  if (columns_of_A) rows = cols;
  PetscCall(MatCreateDense(PetscObjectComm((PetscObject)A), rows, PETSC_DECIDE, PETSC_DETERMINE, count,
                           const_cast<double *>(values), dense));
  PetscCall(MatAssemblyBegin(*dense, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*dense, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

PetscErrorCode MultiplyColumns(Mat A, const MatrixXd &X, PetscInt from, PetscInt count, MatrixXd *Y)
{
  Mat                B, C;
  PetscInt           rows;
  const PetscScalar *values;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(A, &rows, nullptr));
  Y->resize(rows, count);
  if (!count) PetscFunctionReturn(0);
  PetscCall(WrapBlock(A, true, count, X.data() + from * X.rows(), &B));
  PetscCall(MatMatMult(A, B, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &C));
  PetscCall(MatDenseGetArrayRead(C, &values));
  PetscInt lda;
  PetscCall(MatDenseGetLDA(C, &lda));
  for (PetscInt k = 0; k < count; k++) std::copy_n(values + (std::size_t)k * lda, rows, Y->col(k).data());
  PetscCall(MatDenseRestoreArrayRead(C, &values));
  PetscCall(MatDestroy(&B));
  PetscCall(MatDestroy(&C));
  PetscFunctionReturn(0);
}

PetscErrorCode Multiply(Mat A, const MatrixXd &X, MatrixXd *Y)
{
  PetscInt rows;
  MatrixXd part;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(A, &rows, nullptr));
  Y->resize(rows, X.cols());
  for (PetscInt k = 0; k < X.cols(); k += block_columns) {
    const PetscInt count = std::min<PetscInt>(block_columns, X.cols() - k);
    PetscCall(MultiplyColumns(A, X, k, count, &part));
    Y->middleCols(k, count) = part;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode SumOverRanks(MPI_Comm comm, MatrixXd *A)
{
  PetscMPIInt count;

  PetscFunctionBegin;
  PetscCall(PetscMPIIntCast(A->size(), &count));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, A->data(), count, MPI_DOUBLE, MPI_SUM, comm));
  PetscFunctionReturn(0);
}

/* ---- progress and time ---- */

PetscErrorCode Phase::begin(const char name[])
{
  const std::string full = std::string("Reduce: ") + name;

  PetscFunctionBegin;
  name_ = name;
  PetscLogStage stage;
  PetscCall(PetscLogStageGetId(full.c_str(), &stage));
  if (stage < 0) PetscCall(PetscLogStageRegister(full.c_str(), &stage));
  PetscCall(PetscLogStagePush(stage));
  begun_ = true;
  PetscCall(PetscTime(&start_));
  PetscFunctionReturn(0);
}

Phase::~Phase()
{
  if (begun_) (void)PetscLogStagePop();
}

PetscErrorCode Phase::end(const std::string &result)
{
  PetscLogDouble now, memory;
  struct rusage  usage;

  PetscFunctionBegin;
  begun_ = false;
  PetscCall(PetscLogStagePop());
  if (!print_) PetscFunctionReturn(0);
  PetscCall(PetscMemoryGetCurrentUsage(&memory));
  getrusage(RUSAGE_SELF, &usage);
  double bytes[2] = {memory, 1024. * usage.ru_maxrss};
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, bytes, 2, MPI_DOUBLE, MPI_SUM, comm_));
  PetscCall(PetscTime(&now));
  PetscCall(PetscPrintf(comm_, "reduce: %-18s %8.2f s  %8.1f MB (at most %.1f)  %s\n", name_.c_str(), now - start_,
                        bytes[0] / 1e6, bytes[1] / 1e6, result.c_str()));
  PetscFunctionReturn(0);
}

/* ---- factorizations ---- */

PetscErrorCode CreateSolver(MPI_Comm comm, KSP *ksp)
{
  PC            pc;
  PetscBool     found;
  MatSolverType package = "mumpsnd";
  PetscMPIInt   size;

  PetscFunctionBegin;
  PetscCall(TSHHT3Initialize());
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(KSPCreate(comm, ksp));
  PetscCall(KSPSetOptionsPrefix(*ksp, REDUCE_PREFIX));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPSetTolerances(*ksp, 1e-13, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, PCCHOLESKY));
  PetscCall(MatSolverTypeGet(package, size > 1 ? MATMPIAIJ : MATSEQAIJ, MAT_FACTOR_CHOLESKY, nullptr, &found, nullptr));
  if (found) PetscCall(PCFactorSetMatSolverType(pc, package));
  PetscCall(KSPSetFromOptions(*ksp));
  PetscFunctionReturn(0);
}

/* Enables the detection of null pivots in PETSc's own interface to MUMPS; "mumpsnd" always detects them */
static PetscErrorCode PrepareMumps(PC pc)
{
  MatSolverType package = nullptr;
  PetscBool     mumps   = PETSC_FALSE;
  Mat           F;

  PetscFunctionBegin;
  PetscCall(PCFactorGetMatSolverType(pc, &package));
  if (package) PetscCall(PetscStrcmp(package, MATSOLVERMUMPS, &mumps));
  if (!mumps) PetscFunctionReturn(0);
  PetscCall(PCFactorSetUpMatSolverType(pc));
  PetscCall(PCFactorGetMatrix(pc, &F));
#if defined(PETSC_HAVE_MUMPS)
  PetscCall(MatMumpsSetIcntl(F, 13, 1));
  PetscCall(MatMumpsSetIcntl(F, 24, 1));
  PetscCall(MatMumpsSetCntl(F, 3, 1e-14));
#endif
  PetscFunctionReturn(0);
}

/* Numbers of negative and of null pivots; -1 and 0 if the package does not count them */
static PetscErrorCode GetNegative(PC pc, PetscInt *negative, PetscInt *zero)
{
  PetscBool factored;
  Mat       F         = nullptr;
  void (*tells)(void) = nullptr;

  PetscFunctionBegin;
  *negative = -1;
  *zero     = 0;
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCCHOLESKY, &factored));
  if (!factored) PetscFunctionReturn(0);
  PetscCall(PCFactorGetMatrix(pc, &F));
  PetscCall(PetscObjectQueryFunction((PetscObject)F, "MatMumpsGetInfog_C", &tells));
#if defined(PETSC_HAVE_MUMPS)
  if (tells) {
    PetscCall(MatMumpsGetInfog(F, 12, negative));
    PetscCall(MatMumpsGetInfog(F, 28, zero));
  }
#endif
  PetscFunctionReturn(0);
}

PetscErrorCode Factor(KSP ksp, Mat A, PetscBool *singular, PetscInt *negative)
{
  PC             pc;
  PCFailedReason reason;
  PetscInt       zero = 0, rows;

  PetscFunctionBegin;
  PetscCall(MatGetSize(A, &rows, nullptr));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PrepareMumps(pc));
  PetscCall(KSPSetUp(ksp));
  PetscCall(PCGetFailedReason(pc, &reason));
  *negative = -1;
  if (!reason) PetscCall(GetNegative(pc, negative, &zero));
  PetscCheck(reason != PC_FACTOR_OUTMEMORY, PetscObjectComm((PetscObject)ksp), PETSC_ERR_MEM,
             "Reduce(): memory does not suffice for the factors of a matrix of %" PetscInt_FMT
             " rows; use more processes on more machines, a coarser mesh, or an iterative solver (-" REDUCE_PREFIX
             "ksp_type cg -" REDUCE_PREFIX "pc_type gamg)",
             rows);
  *singular = reason || zero > 0 ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(0);
}

PetscErrorCode SolveBlock(KSP ksp, const MatrixXd &F, MatrixXd *X)
{
  Mat                b, x;
  MPI_Comm           comm = PetscObjectComm((PetscObject)ksp);
  KSPConvergedReason reason;

  PetscFunctionBegin;
  X->setZero(F.rows(), F.cols());
  PetscCall(MatCreateDense(comm, F.rows(), PETSC_DECIDE, PETSC_DETERMINE, F.cols(), const_cast<double *>(F.data()), &b));
  PetscCall(MatCreateDense(comm, F.rows(), PETSC_DECIDE, PETSC_DETERMINE, F.cols(), X->data(), &x));
  for (Mat A : {b, x}) {
    PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  }
  PetscCall(KSPMatSolve(ksp, b, x));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCall(MatDestroy(&b));
  PetscCall(MatDestroy(&x));
  PetscCheck(reason >= 0, comm, PETSC_ERR_CONV_FAILED,
             "Reduce(): the solver of -" REDUCE_PREFIX "ksp_type did not converge (%s) for constraint modes or residuals",
             KSPConvergedReasons[reason]);
  PetscFunctionReturn(0);
}

PetscErrorCode Shifted(const Pencil &pencil, double lambda, Mat *S)
{
  PetscFunctionBegin;
  PetscCall(MatDuplicate(pencil.K, MAT_COPY_VALUES, S));
  PetscCall(MatAXPY(*S, -lambda, pencil.M, DIFFERENT_NONZERO_PATTERN));
  PetscFunctionReturn(0);
}

PetscErrorCode CountBelow(const Pencil &pencil, double lambda, PetscInt *count)
{
  KSP       ksp;
  Mat       S;
  PetscBool singular;
  PetscInt  negative;

  PetscFunctionBegin;
  *count = -1;
  PetscCall(CreateSolver(PetscObjectComm((PetscObject)pencil.K), &ksp));
  for (int attempt = 0; attempt < 3; attempt++) {
    PetscCall(Shifted(pencil, lambda, &S));
    PetscCall(Factor(ksp, S, &singular, &negative));
    PetscCall(MatDestroy(&S));
    if (!singular) break;
    lambda *= 1 + 1e-6; /* lambda was an eigenvalue */
  }
  PetscCall(KSPDestroy(&ksp));
  if (!singular && negative >= 0) *count = negative - pencil.multipliers - (PetscInt)pencil.rigid.cols();
  PetscFunctionReturn(0);
}

} // namespace hhtdae
