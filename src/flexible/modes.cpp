/* Blocks of distributed vectors, factorizations and eigenvalues for the reduction of a body. */
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
  for (PetscInt k = 0; k < count; k++) std::copy_n(values + k * lda, rows, Y->data() + k * rows);
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

using Columns = Eigen::Ref<const MatrixXd>;

/* By PETSc's dense matrices and not by Eigen: BLAS uses what the processor has, whatever flags we were compiled with */
static PetscErrorCode BlasProduct(bool transposed, const Columns &A, const Columns &B, MatrixXd *C)
{
  Mat a, b, c;

  PetscFunctionBegin;
  C->setZero(transposed ? A.cols() : A.rows(), B.cols());
  if (!A.size() || !B.size()) PetscFunctionReturn(0);
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, A.rows(), A.cols(), const_cast<double *>(A.data()), &a));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, B.rows(), B.cols(), const_cast<double *>(B.data()), &b));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, C->rows(), C->cols(), C->data(), &c));
  if (A.rows()) PetscCall(MatDenseSetLDA(a, A.outerStride()));
  if (B.rows()) PetscCall(MatDenseSetLDA(b, B.outerStride()));
  for (Mat m : {a, b, c}) {
    PetscCall(MatAssemblyBegin(m, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(m, MAT_FINAL_ASSEMBLY));
  }
  PetscCall(MatProductCreateWithMat(a, b, nullptr, c));
  PetscCall(MatProductSetType(c, transposed ? MATPRODUCT_AtB : MATPRODUCT_AB));
  PetscCall(MatProductSetFromOptions(c));
  PetscCall(MatProductSymbolic(c));
  PetscCall(MatProductNumeric(c));
  for (Mat *m : {&a, &b, &c}) PetscCall(MatDestroy(m));
  PetscFunctionReturn(0);
}

PetscErrorCode LocalProduct(const Columns &A, const Columns &B, MatrixXd *C) { return BlasProduct(true, A, B, C); }

PetscErrorCode Combine(const Columns &A, const Columns &B, MatrixXd *C) { return BlasProduct(false, A, B, C); }

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
  PetscCall(PetscTime(&start_));
  PetscFunctionReturn(0);
}

PetscErrorCode Phase::end(const std::string &result)
{
  PetscLogDouble now, memory;
  struct rusage  usage;

  PetscFunctionBegin;
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

/* PETSc's own interface to MUMPS counts inertia and null pivots only if told so, "mumpsnd" always */
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

/* Negative and null pivots; -1 and 0 where the package does not tell */
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

/* K - lambda M, a new matrix */
static PetscErrorCode Shifted(const Pencil &pencil, double lambda, Mat *S)
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
    lambda *= 1 + 1e-6; /* an eigenvalue was hit */
  }
  PetscCall(KSPDestroy(&ksp));
  if (!singular && negative >= 0) *count = negative - pencil.multipliers - (PetscInt)pencil.rigid.cols();
  PetscFunctionReturn(0);
}

/* ---- eigenvalues ---- */

/* Searched in the complement of the rigid modes and of those found before */
static PetscErrorCode Deflate(const Pencil &pencil, const MatrixXd &found, EPS eps)
{
  const PetscInt   n = (PetscInt)pencil.rigid.cols(), m = (PetscInt)found.cols();
  std::vector<Vec> v(n + m);

  PetscFunctionBegin;
  if (v.empty()) PetscFunctionReturn(0);
  for (PetscInt k = 0; k < n + m; k++) {
    const double *from = k < n ? pencil.rigid.data() + k * pencil.rigid.rows() : found.data() + (k - n) * found.rows();
    PetscInt      rows;
    PetscScalar  *values;
    PetscCall(MatCreateVecs(pencil.K, &v[k], nullptr));
    PetscCall(VecGetLocalSize(v[k], &rows));
    PetscCall(VecGetArray(v[k], &values));
    std::copy_n(from, rows, values);
    PetscCall(VecRestoreArray(v[k], &values));
  }
  PetscCall(EPSSetDeflationSpace(eps, n + m, v.data()));
  for (Vec &x : v) PetscCall(VecDestroy(&x));
  PetscFunctionReturn(0);
}

/* Above this number of modes with a bound on the frequency the spectrum is divided among several shifts */
constexpr PetscInt slice_from = 400;

/* Vectors before a restart, unless options say how many: the block type needs more of them than SLEPc's own */
static PetscErrorCode SetSize(PetscInt count, PetscInt most, EPS eps)
{
  PetscInt  size;
  PetscBool blocks;

  PetscFunctionBegin;
  PetscCall(EPSGetDimensions(eps, nullptr, &size, nullptr));
  if (size > 0) PetscFunctionReturn(0);
  PetscCall(PetscObjectTypeCompare((PetscObject)eps, EPS_BLOCK_KRYLOV, &blocks));
  size = std::min(most, blocks ? (PetscInt)(2.5 * count) + 40 : std::max(count + 20, (PetscInt)(1.6 * count)));
  PetscCall(EPSSetDimensions(eps, count, size, PETSC_DEFAULT));
  PetscFunctionReturn(0);
}

static PetscErrorCode SetUpEps(const Pencil &pencil, const WantedModes &wanted, PetscInt count, bool slices,
                               const MatrixXd &found, KSP *ksp, EPS *eps)
{
  ST       st;
  MPI_Comm comm = PetscObjectComm((PetscObject)pencil.K);

  PetscFunctionBegin;
  PetscCall(EPSCreate(comm, eps));
  PetscCall(EPSSetOptionsPrefix(*eps, REDUCE_PREFIX));
  PetscCall(EPSSetOperators(*eps, pencil.K, pencil.M));
  PetscCall(EPSSetProblemType(*eps, EPS_GHEP));
  /* one more solve for each mode, which cleans vectors of the null space of M: there is none but for multipliers */
  PetscCall(EPSSetPurify(*eps, pencil.multipliers ? PETSC_TRUE : PETSC_FALSE));
  PetscCall(RegisterBlockKrylov());
  PetscCall(EPSSetType(*eps, slices ? EPSKRYLOVSCHUR : EPS_BLOCK_KRYLOV));
  PetscCall(EPSSetTolerances(*eps, 1e-11, 200));
  PetscCall(EPSGetST(*eps, &st));
  PetscCall(STSetType(st, STSINVERT));
  if (slices) {
    KSP slice;
    PC  pc;
    PetscCall(EPSSetWhichEigenpairs(*eps, EPS_ALL));
    PetscCall(EPSSetInterval(*eps, pencil.rigid.cols() ? 1e-3 * -wanted.shift : 0., wanted.below));
    PetscCall(EPSKrylovSchurGetKSP(*eps, &slice));
    PetscCall(KSPSetType(slice, KSPPREONLY));
    PetscCall(KSPGetPC(slice, &pc));
    PetscCall(PCSetType(pc, PCCHOLESKY));
    PetscCall(PCFactorSetMatSolverType(pc, "mumpsnd"));
  } else {
    if (!*ksp) PetscCall(CreateSolver(comm, ksp));
    PetscCall(STSetKSP(st, *ksp));
    PetscCall(EPSSetDimensions(*eps, count, PETSC_DEFAULT, PETSC_DEFAULT));
    PetscCall(EPSSetTarget(*eps, wanted.shift));
    PetscCall(EPSSetWhichEigenpairs(*eps, EPS_TARGET_MAGNITUDE));
    PetscCall(Deflate(pencil, found, *eps));
  }
  PetscCall(EPSSetFromOptions(*eps));
  if (!slices) PetscCall(SetSize(count, pencil.modes - (PetscInt)(pencil.rigid.cols() + found.cols()), *eps));
  PetscFunctionReturn(0);
}

/* All eigenpairs that converged; SLEPc returns them orthonormal in M */
static PetscErrorCode Collect(EPS eps, Mat K, NormalModes *modes)
{
  PetscInt    n, rows;
  Vec         x;
  PetscScalar value;

  PetscFunctionBegin;
  PetscCall(EPSGetConverged(eps, &n));
  PetscCall(MatGetLocalSize(K, &rows, nullptr));
  PetscCall(MatCreateVecs(K, &x, nullptr));
  modes->lambda.resize(n);
  modes->x.resize(rows, n);
  for (PetscInt k = 0; k < n; k++) {
    const PetscScalar *values;
    PetscCall(EPSGetEigenpair(eps, k, &value, nullptr, x, nullptr));
    PetscCall(VecGetArrayRead(x, &values));
    std::copy_n(values, rows, modes->x.data() + k * rows);
    PetscCall(VecRestoreArrayRead(x, &values));
    modes->lambda[k] = value;
  }
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(0);
}

static void Merge(const NormalModes &more, NormalModes *modes)
{
  const PetscInt                           n = (PetscInt)modes->lambda.size(), m = (PetscInt)more.lambda.size();
  std::vector<std::pair<double, PetscInt>> order;
  for (PetscInt k = 0; k < n; k++) order.push_back({modes->lambda[k], k});
  for (PetscInt k = 0; k < m; k++) order.push_back({more.lambda[k], n + k});
  std::sort(order.begin(), order.end());
  NormalModes all;
  all.lambda.resize(n + m);
  all.x.resize(more.x.rows(), n + m);
  for (PetscInt k = 0; k < n + m; k++) {
    const PetscInt from = order[k].second;
    all.lambda[k]       = order[k].first;
    if (from < n)
      all.x.col(k) = modes->x.col(from);
    else
      all.x.col(k) = more.x.col(from - n);
  }
  modes->lambda.swap(all.lambda);
  modes->x.swap(all.x);
}

/* EPSDestroy() resets the solver which it has; ours is to keep its factors */
static PetscErrorCode ReleaseSolver(EPS eps)
{
  ST  st;
  KSP none;

  PetscFunctionBegin;
  PetscCall(EPSGetST(eps, &st));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)eps), &none));
  PetscCall(STSetKSP(st, none));
  PetscCall(KSPDestroy(&none));
  PetscFunctionReturn(0);
}

/* One run of the eigensolver for the `count` lowest besides those in modes, which are added to it in ascending order */
static PetscErrorCode RunEps(const Pencil &pencil, const WantedModes &wanted, PetscInt count, bool slices, KSP *ksp,
                             NormalModes *modes)
{
  EPS                eps;
  EPSConvergedReason reason;
  PetscInt           converged, iterations;
  NormalModes        more;

  PetscFunctionBegin;
  PetscCall(SetUpEps(pencil, wanted, count, slices, modes->x, ksp, &eps));
  PetscCall(EPSSolve(eps));
  PetscCall(EPSGetConvergedReason(eps, &reason));
  PetscCall(EPSGetConverged(eps, &converged));
  PetscCall(EPSGetIterationNumber(eps, &iterations));
  const bool good = reason > 0 || converged >= count;
  if (good) PetscCall(Collect(eps, pencil.K, &more));
  if (!slices) PetscCall(ReleaseSolver(eps));
  PetscCall(EPSDestroy(&eps));
  PetscCheck(good, PetscObjectComm((PetscObject)pencil.K), PETSC_ERR_CONV_FAILED,
             "Reduce(): %" PetscInt_FMT " of %" PetscInt_FMT " normal modes converged in %" PetscInt_FMT
             " restarts; raise -" REDUCE_PREFIX "eps_max_it or -" REDUCE_PREFIX "eps_ncv, or ask for fewer modes",
             converged, count, iterations);
  modes->how +=
      (modes->how.empty() ? "" : " + ") + std::to_string(iterations) + (slices ? " restarts in slices" : " restarts");
  Merge(more, modes);
  PetscFunctionReturn(0);
}

/* A value between two eigenvalues, as high as they reach; *below: how many are below it */
static double InGap(const VectorXd &lambda, PetscInt *below)
{
  for (PetscInt p = (PetscInt)lambda.size(); p-- > 1;)
    if (lambda[p] > lambda[p - 1] * (1 + 1e-3)) {
      *below = p;
      return 0.5 * (lambda[p] + lambda[p - 1]);
    }
  *below = (PetscInt)lambda.size();
  return lambda[*below - 1] * (1 + 1e-5);
}

/* Krylov spaces may leave out copies of eigenvalues that are there several times, as symmetric bodies have them */
static PetscErrorCode CountMissing(const Pencil &pencil, const NormalModes &modes, PetscInt *missing)
{
  PetscBool verify = PETSC_TRUE;
  PetscInt  below, count;

  PetscFunctionBegin;
  *missing = 0;
  PetscCall(PetscOptionsGetBool(nullptr, REDUCE_PREFIX, "-verify", &verify, nullptr));
  if (!verify || !modes.lambda.size()) PetscFunctionReturn(0);
  const double sigma = InGap(modes.lambda, &below);
  PetscCall(CountBelow(pencil, sigma, &count));
  if (count >= 0) *missing = count - below;
  PetscCall(PetscInfo(pencil.K, "%" PetscInt_FMT " modes below %g by inertia, %" PetscInt_FMT " found\n", count, sigma,
                      below));
  PetscFunctionReturn(0);
}

constexpr int      most_searches = 6;
constexpr PetscInt beyond =
    2; /* modes that are looked for above those wanted, to see whether frequencies are equal there */

/* Slices have solvers of their own, which are gone after them */
static PetscErrorCode FactorAgain(const Pencil &pencil, double shift, KSP *ksp)
{
  Mat       S = pencil.K;
  PetscBool singular;
  PetscInt  negative;

  PetscFunctionBegin;
  if (shift != 0)
    PetscCall(Shifted(pencil, shift, &S));
  else
    PetscCall(PetscObjectReference((PetscObject)S));
  PetscCall(CreateSolver(PetscObjectComm((PetscObject)pencil.K), ksp));
  PetscCall(Factor(*ksp, S, &singular, &negative));
  PetscCall(MatDestroy(&S));
  PetscCheck(!singular, PetscObjectComm((PetscObject)pencil.K), PETSC_ERR_MAT_LU_ZRPVT,
             "Reduce(): the stiffness is singular to the solver, though it had normal modes");
  PetscFunctionReturn(0);
}

/* The lowest `count` of modes are used while the factorization is there, then it goes */
static PetscErrorCode Use(const WhileFactored &use, PetscInt count, KSP *ksp, NormalModes *modes)
{
  PetscFunctionBegin;
  modes->wanted = std::min(count, (PetscInt)modes->lambda.size());
  PetscCall(use(*ksp, modes));
  PetscCall(KSPDestroy(ksp));
  PetscFunctionReturn(0);
}

PetscErrorCode FindModes(const Pencil &pencil, const WantedModes &wanted, const WhileFactored &use, KSP *ksp,
                         NormalModes *modes)
{
  MPI_Comm       comm = PetscObjectComm((PetscObject)pencil.K);
  const PetscInt most = pencil.modes - (PetscInt)pencil.rigid.cols(), count = std::min(wanted.count, most);
  PetscInt       missing = 0, from = slice_from, rows;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetInt(nullptr, REDUCE_PREFIX, "-slices_from", &from, nullptr));
  PetscCall(MatGetLocalSize(pencil.K, &rows, nullptr));
  modes->lambda.resize(0);
  modes->x.resize(rows, 0);
  if (count <= 0) PetscFunctionReturn(Use(use, 0, ksp, modes));
  const bool slices = wanted.below > 0 && count >= from;
  if (slices) PetscCall(KSPDestroy(ksp)); /* it has its own, and counts by inertia itself */
  const PetscInt ask = slices ? count : std::min(count + beyond, most);
  PetscCall(RunEps(pencil, wanted, ask, slices, ksp, modes));
  if (slices) PetscCall(FactorAgain(pencil, wanted.shift, ksp));
  PetscCall(Use(use, count, ksp, modes));
  for (int search = 0; !slices; search++) {
    PetscCall(CountMissing(pencil, *modes, &missing));
    if (missing <= 0 || search == most_searches) break;
    PetscCall(RunEps(pencil, wanted, std::min(missing, most - (PetscInt)modes->lambda.size()), slices, ksp, modes));
    PetscCall(Use(use, count, ksp, modes));
  }
  PetscCheck(missing <= 0, comm, PETSC_ERR_CONV_FAILED,
             "Reduce(): the eigensolver misses %" PetscInt_FMT
             " of the lowest normal modes, as the inertia of the shifted stiffness tells; "
             "raise -" REDUCE_PREFIX "eps_ncv",
             missing);
  PetscCheck(modes->lambda.size() >= count, comm, PETSC_ERR_CONV_FAILED,
             "Reduce(): only %d of %" PetscInt_FMT " normal modes converged; raise -" REDUCE_PREFIX
             "eps_max_it or -" REDUCE_PREFIX "eps_ncv",
             (int)modes->lambda.size(), count);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
