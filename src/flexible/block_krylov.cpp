/*
  Block Krylov-Schur as a type of SLEPc's EPS: thick-restart Lanczos on OP = (K - sigma M)^-1 M with M-orthonormal vectors.

  SLEPc's own type solves for one vector at a time, and each solve reads the factors from memory once. Here a block of
  vectors is solved for together. Blocks also find multiple eigenvalues, which a single vector cannot.

  The projected matrix T = V^T M OP V is computed in full, without the Lanczos recurrence, so that a restart is a
  change of the basis only. Options: -eps_ncv, -eps_tol, -eps_max_it (restarts), monitors; -eps_krylov_block <vectors>.
*/
#include "modes.h"
#include "scene/symmetric.h"
#include <algorithm>
#include <cmath>
#include <random>
#include <slepc/private/epsimpl.h>

namespace hhtdae
{

using Columns = Eigen::Ref<const MatrixXd>;

constexpr PetscInt default_block       = 6;  /* vectors of a block, -eps_krylov_block */
constexpr PetscInt projection_interval = 24; /* vectors added between two solutions of the projected problem */

struct BlockKrylov {
  PetscInt block = default_block, size = 0; /* vectors of a block, and of the basis before a restart */
  Mat      M = nullptr;
  MatrixXd V;                                     /* the deflated vectors, then the basis */
  MatrixXd T;                                     /* projected matrix of the basis */
  PetscInt deflated = 0, k = 0, projected_at = 0; /* deflated vectors; vectors of the basis, now and when the projected problem was last solved */
  MatrixXd W, MW;                                 /* the next block, M-orthonormal and M-orthogonal to V, and M times it */

  MatrixXd remainder; /* factor R of OP V_last = V T_last + Q R with M-orthonormal Q, for the last block of V */
  VectorXd theta;     /* Ritz values, */
  MatrixXd Y;         /* Ritz vectors in the basis, */
  VectorXd error;     /* and error bounds of theta */
};

/* ---- the operator and orthogonality ---- */

/* W = (K - sigma M)^-1 MW */
static PetscErrorCode SolveShifted(EPS eps, const MatrixXd &MW, MatrixXd *W)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)eps);
  Mat            B, X;

  PetscFunctionBegin;
  W->setZero(MW.rows(), MW.cols());
  if (!MW.cols()) PetscFunctionReturn(0);
  PetscCall(
      MatCreateDense(comm, MW.rows(), PETSC_DECIDE, PETSC_DETERMINE, MW.cols(), const_cast<double *>(MW.data()), &B));
  PetscCall(MatCreateDense(comm, MW.rows(), PETSC_DECIDE, PETSC_DETERMINE, MW.cols(), W->data(), &X));
  for (Mat A : {B, X}) {
    PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  }
  PetscCall(STMatMatSolve(eps->st, B, X));
  PetscCall(MatDestroy(&B));
  PetscCall(MatDestroy(&X));
  PetscFunctionReturn(0);
}

static PetscErrorCode Gram(EPS eps, const Columns &A, const MatrixXd &B, MatrixXd *G)
{
  PetscFunctionBegin;
  *G = A.transpose() * B;
  PetscCall(SumOverRanks(PetscObjectComm((PetscObject)eps), G));
  PetscFunctionReturn(0);
}

/* Subtracts from W its projection on V, where H = V^T M W; updates MW */
static PetscErrorCode SubtractProjection(const MatrixXd &H, BlockKrylov *b)
{
  MatrixXd part;

  PetscFunctionBegin;
  part = b->V.leftCols(b->deflated + b->k) * H;
  b->W -= part;
  PetscCall(Multiply(b->M, b->W, &b->MW));
  PetscFunctionReturn(0);
}

/* M-orthonormalizes W and updates MW. Directions whose squared norm is below `least` are discarded; with `scaled`, columns are first scaled to
   unit norm. Outputs: *smallest, the smallest eigenvalue of the Gram matrix; *back, so that W_old ~ W_new back; *full_back, the same with all
   directions, which measures the size of W_old. */
static PetscErrorCode Normalize(EPS eps, bool scaled, double least, BlockKrylov *b, double *smallest, MatrixXd *back,
                                MatrixXd *full_back)
{
  MatrixXd G;

  PetscFunctionBegin;
  PetscCall(Gram(eps, b->W, b->MW, &G));
  const PetscInt n     = (PetscInt)G.cols();
  VectorXd       scale = G.diagonal().cwiseMax(0.).cwiseSqrt();
  if (!scaled) scale.setOnes();
  /* norms of W are of the order of 1/frequency^2, so that only exact zeros count as zero (SmallBodies.ManyModes) */
  const VectorXd       inverse = scale.unaryExpr([](double s) { return s > 0 ? 1 / s : 1; });
  const SymmetricEigen gram(inverse.asDiagonal() * (0.5 * (G + G.transpose())) * inverse.asDiagonal());
  PetscInt             from = 0;
  *smallest                 = n ? gram.values[0] : 0;
  while (from < n && !(gram.values[from] > least)) from++;
  const MatrixXd U = gram.vectors.rightCols(n - from);
  const VectorXd s = gram.values.tail(n - from).cwiseSqrt();
  const MatrixXd S = inverse.asDiagonal() * U * s.cwiseInverse().asDiagonal();
  *back            = s.asDiagonal() * U.transpose() * scale.asDiagonal();
  *full_back       = gram.values.cwiseMax(1e-15).cwiseSqrt().asDiagonal() * gram.vectors.transpose() *
               scale.asDiagonal();
  G = b->W * S;
  b->W.swap(G);
  G = b->MW * S;
  b->MW.swap(G);
  PetscFunctionReturn(0);
}

/* Orthonormalizes W against V and in itself to the next block, which has fewer columns, or none, if W lies partly or wholly in the space of V. H = V^T M W_old. */
static PetscErrorCode NextBlock(EPS eps, BlockKrylov *b, MatrixXd *H)
{
  MatrixXd       second, back, full_back;
  double         least;
  const PetscInt n = b->deflated + b->k;

  PetscFunctionBegin;
  PetscCall(Multiply(b->M, b->W, &b->MW));
  PetscCall(Gram(eps, b->V.leftCols(n), b->MW, H));
  PetscCall(SubtractProjection(*H, b));
  PetscCall(Normalize(eps, true, 1e-15, b, &least, &back, &b->remainder));
  PetscCall(Gram(eps, b->V.leftCols(n), b->MW, &second));
  if (least > 1e-4 && (!second.size() || second.cwiseAbs().maxCoeff() < 1e-13)) PetscFunctionReturn(0);
  /* second orthogonalization; columns were normalized before, so that those which lose most of their norm now were rounding */
  PetscCall(SubtractProjection(second, b));
  *H += second * back;
  PetscCall(Normalize(eps, false, 0.25, b, &least, &back, &full_back));
  PetscFunctionReturn(0);
}

/* ---- the projected problem ---- */

/* Extends T by the products of the last block of `count` vectors */
static void Extend(PetscInt count, const MatrixXd &H, BlockKrylov *b)
{
  const PetscInt before = b->k - count;
  b->T.conservativeResize(b->k, b->k);
  b->T.rightCols(count)                = H.bottomRows(b->k);
  b->T.bottomLeftCorner(count, before) = b->T.topRightCorner(before, count).transpose();
  const MatrixXd corner                = b->T.bottomRightCorner(count, count);
  b->T.bottomRightCorner(count, count) = 0.5 * (corner + corner.transpose());
}

/* Ritz values, by decreasing absolute value, and error bounds from the remainder of the last block; that of the earlier blocks is rounding */
static PetscErrorCode Ritz(EPS eps, PetscInt count, BlockKrylov *b)
{
  const SymmetricEigen  solver(b->T);
  std::vector<PetscInt> order(b->k);

  PetscFunctionBegin;
  PetscCheck(solver.found && solver.values.allFinite(), PetscObjectComm((PetscObject)eps),
             PETSC_ERR_CONV_FAILED, "The projected eigenvalue problem has no solution: solves are not finite");
  for (PetscInt i = 0; i < b->k; i++) order[i] = i;
  const VectorXd &value = solver.values;
  std::stable_sort(order.begin(), order.end(),
                   [&](PetscInt i, PetscInt j) { return std::abs(value[i]) > std::abs(value[j]); });
  b->theta.resize(b->k);
  b->Y.resize(b->k, b->k);
  for (PetscInt i = 0; i < b->k; i++) {
    b->theta[i] = value[order[i]];
    b->Y.col(i) = solver.vectors.col(order[i]);
  }
  b->error = (b->remainder * b->Y.bottomRows(count)).colwise().norm().transpose();
  PetscFunctionReturn(0);
}

/* eps->nconv: number of leading Ritz values that have converged */
static PetscErrorCode CountConverged(EPS eps, const BlockKrylov &b)
{
  const PetscInt count = std::min(b.k, eps->ncv);

  PetscFunctionBegin;
  bool good  = true;
  eps->nconv = 0;
  for (PetscInt i = 0; i < count; i++) {
    eps->eigr[i] = b.theta[i];
    eps->eigi[i] = 0;
    PetscCall((*eps->converged)(eps, eps->eigr[i], 0, b.error[i], &eps->errest[i], eps->convergedctx));
    good = good && eps->errest[i] < eps->tol;
    if (good) eps->nconv++;
  }
  PetscCall(EPSMonitor(eps, eps->its, eps->nconv, eps->eigr, eps->eigi, eps->errest, count));
  PetscFunctionReturn(0);
}

/* Replaces the basis by the leading `keep` Ritz vectors */
static PetscErrorCode Restart(PetscInt keep, BlockKrylov *b)
{
  MatrixXd X;

  PetscFunctionBegin;
  X = b->V.middleCols(b->deflated, b->k) * b->Y.leftCols(keep);
  b->V.middleCols(b->deflated, keep) = X;
  b->k = b->projected_at = keep;
  b->T                   = b->theta.head(keep).asDiagonal();
  PetscFunctionReturn(0);
}

/* ---- EPS ---- */

static PetscErrorCode SetUp(EPS eps)
{
  BlockKrylov *b = static_cast<BlockKrylov *>(eps->data);
  PetscBool    sinvert;
  PetscInt     n;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)eps->st, STSINVERT, &sinvert));
  PetscCheck(sinvert && eps->isgeneralized && eps->ishermitian && eps->which == EPS_TARGET_MAGNITUDE,
             PetscObjectComm((PetscObject)eps), PETSC_ERR_SUP,
             "EPS type %s is for symmetric pairs, the transformation " STSINVERT " and eigenvalues around the target; "
             "choose -eps_type " EPSKRYLOVSCHUR " for others",
             EPS_BLOCK_KRYLOV);
  PetscCall(PetscOptionsGetInt(((PetscObject)eps)->options, ((PetscObject)eps)->prefix, "-eps_krylov_block", &b->block,
                               nullptr));
  PetscCheck(b->block > 0, PetscObjectComm((PetscObject)eps), PETSC_ERR_ARG_OUTOFRANGE,
             "-eps_krylov_block %" PetscInt_FMT " has to be positive", b->block);
  PetscCall(EPSGetOperators(eps, nullptr, &b->M));
  PetscCall(MatGetSize(b->M, &n, nullptr));
  b->size = eps->ncv > 0 ? eps->ncv : 2 * eps->nev;
  b->size = std::max(b->size, eps->nev + 2 * b->block);
  if (eps->max_it == PETSC_DEFAULT) eps->max_it = 100;
  /* SLEPc's own basis stores the results only */
  eps->ncv = eps->mpd = std::min(n, eps->nev + b->block);
  PetscCall(EPSAllocateSolution(eps, 0));
  PetscFunctionReturn(0);
}

static PetscErrorCode SetUpSort(EPS eps)
{
  PetscFunctionBegin;
  eps->sc->comparison    = SlepcCompareTargetMagnitude;
  eps->sc->comparisonctx = &eps->target;
  eps->sc->map           = nullptr;
  eps->sc->mapobj        = nullptr;
  eps->sc->rg            = nullptr;
  PetscFunctionReturn(0);
}

/* Copies SLEPc's deflation space to the first columns of V, M-orthonormalized */
static PetscErrorCode LoadDeflated(EPS eps, PetscInt rows, BlockKrylov *b)
{
  const PetscInt n = std::max<PetscInt>(0, eps->nds);
  MatrixXd       back, full_back;
  double         least;

  PetscFunctionBegin;
  if (!n) PetscFunctionReturn(0);
  b->W.resize(rows, n);
  for (PetscInt i = 0; i < n; i++) {
    Vec                v;
    const PetscScalar *values;
    PetscCall(BVGetColumn(eps->V, i - n, &v));
    PetscCall(VecGetArrayRead(v, &values));
    std::copy_n(values, rows, b->W.col(i).data());
    PetscCall(VecRestoreArrayRead(v, &values));
    PetscCall(BVRestoreColumn(eps->V, i - n, &v));
  }
  for (int pass = 0; pass < 2; pass++) {
    PetscCall(Multiply(b->M, b->W, &b->MW));
    PetscCall(Normalize(eps, true, 1e-14, b, &least, &back, &full_back));
  }
  b->deflated                = (PetscInt)b->W.cols();
  b->V.leftCols(b->deflated) = b->W;
  PetscFunctionReturn(0);
}

static PetscErrorCode StartBlock(EPS eps, BlockKrylov *b)
{
  PetscMPIInt                            rank;
  PetscInt                               rows;
  std::uniform_real_distribution<double> number(-1, 1);

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PetscObjectComm((PetscObject)eps), &rank));
  PetscCall(MatGetLocalSize(b->M, &rows, nullptr));
  std::mt19937 random(17 + (unsigned)rank);
  b->deflated = 0;
  b->k = b->projected_at = 0;
  b->V.setZero(rows, std::max<PetscInt>(0, eps->nds) + b->size + b->block);
  b->T.resize(0, 0);
  PetscCall(LoadDeflated(eps, rows, b));
  b->MW.resize(rows, b->block);
  for (PetscInt i = 0; i < b->MW.size(); i++) b->MW.data()[i] = number(random);
  /* maps the start vectors to the range of OP, on which M is definite even with multipliers */
  PetscCall(Multiply(b->M, MatrixXd(b->MW), &b->MW));
  PetscCall(SolveShifted(eps, b->MW, &b->W));
  MatrixXd H;
  PetscCall(NextBlock(eps, b, &H));
  PetscFunctionReturn(0);
}

/* If M is singular, applies OP once more, divided by theta, so that components in the null space of M vanish and M-norms stay one */
static PetscErrorCode Purify(EPS eps, BlockKrylov *b)
{
  PetscFunctionBegin;
  for (PetscInt from = 0; from < eps->nconv; from += block_columns) {
    const PetscInt count = std::min(block_columns, eps->nconv - from);
    PetscCall(MultiplyColumns(b->M, b->V, b->deflated + from, count, &b->MW));
    PetscCall(SolveShifted(eps, b->MW, &b->W));
    b->V.middleCols(b->deflated + from, count) = b->W * b->theta.segment(from, count).cwiseInverse().asDiagonal();
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode StoreResults(EPS eps, BlockKrylov *b)
{
  PetscFunctionBegin;
  PetscCall(Restart(eps->nconv, b));
  if (eps->purify) PetscCall(Purify(eps, b));
  for (PetscInt i = 0; i < eps->nconv; i++) {
    Vec          v;
    PetscScalar *values;
    PetscCall(BVGetColumn(eps->V, i, &v));
    PetscCall(VecGetArray(v, &values));
    std::copy_n(b->V.data() + (b->deflated + i) * b->V.rows(), b->V.rows(), values);
    PetscCall(VecRestoreArray(v, &values));
    PetscCall(BVRestoreColumn(eps->V, i, &v));
  }
  b->V.resize(0, 0);
  b->W.resize(0, 0);
  b->MW.resize(0, 0);
  PetscFunctionReturn(0);
}

/* Adds a block to the basis, and solves the projected problem if enough vectors were added since the last time */
static PetscErrorCode ExtendSpace(EPS eps, BlockKrylov *b)
{
  const PetscInt count = (PetscInt)b->W.cols();
  MatrixXd       H;

  PetscFunctionBegin;
  b->V.middleCols(b->deflated + b->k, count) = b->W;
  b->k += count;
  PetscCall(SolveShifted(eps, MatrixXd(b->MW), &b->W));
  PetscCall(NextBlock(eps, b, &H));
  Extend(count, H, b);
  const bool full = b->k + b->W.cols() > b->size + b->block;
  if (b->W.cols() && !full && (b->k < eps->nev || b->k - b->projected_at < projection_interval)) PetscFunctionReturn(0);
  b->projected_at = b->k;
  PetscCall(Ritz(eps, count, b));
  PetscCall(CountConverged(eps, *b));
  PetscFunctionReturn(0);
}

static PetscErrorCode Solve(EPS eps)
{
  BlockKrylov *b = static_cast<BlockKrylov *>(eps->data);

  PetscFunctionBegin;
  PetscCall(StartBlock(eps, b));
  eps->its   = 1;
  eps->nconv = 0;
  while (eps->reason == EPS_CONVERGED_ITERATING) {
    if (!b->W.cols()) {
      eps->reason = EPS_DIVERGED_BREAKDOWN; /* M vanishes on the complement of the deflated vectors */
      break;
    }
    PetscCall(ExtendSpace(eps, b));
    if (eps->nconv >= eps->nev)
      eps->reason = EPS_CONVERGED_TOL;
    else if (!b->W.cols())
      eps->reason = EPS_DIVERGED_BREAKDOWN; /* the Krylov space is invariant and cannot grow */
    else if (b->k + b->W.cols() > b->size + b->block) {
      if (eps->its >= eps->max_it)
        eps->reason = EPS_DIVERGED_ITS;
      else {
        PetscCall(Restart(eps->nconv + (b->k - eps->nconv) / 2, b));
        eps->its++;
      }
    }
  }
  PetscCall(StoreResults(eps, b));
  PetscFunctionReturn(0);
}

static PetscErrorCode BackTransform(EPS eps)
{
  PetscFunctionBegin;
  PetscCall(STBackTransform(eps->st, eps->nconv, eps->eigr, eps->eigi));
  PetscFunctionReturn(0);
}

static PetscErrorCode Destroy(EPS eps)
{
  PetscFunctionBegin;
  delete static_cast<BlockKrylov *>(eps->data);
  eps->data = nullptr;
  PetscFunctionReturn(0);
}

static PetscErrorCode Create(EPS eps)
{
  PetscFunctionBegin;
  eps->data               = new BlockKrylov;
  eps->categ              = EPS_CATEGORY_KRYLOV;
  eps->useds              = PETSC_FALSE;
  eps->ops->setup         = SetUp;
  eps->ops->setupsort     = SetUpSort;
  eps->ops->solve         = Solve;
  eps->ops->backtransform = BackTransform;
  eps->ops->destroy       = Destroy;
  PetscFunctionReturn(0);
}

PetscErrorCode RegisterBlockKrylov()
{
  PetscFunctionBegin;
  PetscCall(EPSRegister(EPS_BLOCK_KRYLOV, Create));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
