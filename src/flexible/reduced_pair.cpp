/*
  K and M projected on the subspace of a reduction, and the modes of that pair.

  The six rigid-body motions, known from the nodes' coordinates, are removed from the subspace before the eigenvalue problem
  is solved. So no threshold is needed to distinguish them from soft modes, and all modes are M-orthogonal to them up to rounding
  (mean-axis conditions).
*/
#include "craig_bampton.h"
#include "scene/complement.h"
#include "scene/symmetric.h"
#include <algorithm>
#include <cmath>
#include <set>

namespace hhtdae
{

/* Vectors of the space are linearly dependent if the Gram matrix in M, scaled to a unit diagonal, has smaller eigenvalues; such directions are dropped */
constexpr double dependent_modes = 1e-13;

/* ---- the pair ---- */

struct ReducedPair {
  MatrixXd K, M, rigid; /* T^T K T, T^T M T and T^T M r for the vectors T of the space and the six rigid motions r */
};

static PetscErrorCode Project(const FeModel &model, const BodyScales &scales, const MatrixXd &T, ReducedPair *pair)
{
  const PetscInt n = (PetscInt)T.cols();
  MatrixXd       AT, part;

  PetscFunctionBegin;
  pair->K.resize(n, n);
  pair->M.resize(n, n);
  for (PetscInt from = 0; from < n; from += block_columns) {
    const PetscInt count = std::min(block_columns, n - from);
    PetscCall(MultiplyColumns(model.K, T, from, count, &AT));
    part                            = T.transpose() * AT;
    pair->K.middleCols(from, count) = part;
    PetscCall(MultiplyColumns(model.M, T, from, count, &AT));
    part                            = T.transpose() * AT;
    pair->M.middleCols(from, count) = part;
  }
  PetscCall(Multiply(model.M, scales.rigid, &AT));
  pair->rigid = T.transpose() * AT;
  PetscCall(SumOverRanks(model.comm, &pair->K));
  PetscCall(SumOverRanks(model.comm, &pair->M));
  PetscCall(SumOverRanks(model.comm, &pair->rigid));
  pair->K = 0.5 * (pair->K + pair->K.transpose()).eval();
  pair->M = 0.5 * (pair->M + pair->M.transpose()).eval();
  PetscFunctionReturn(0);
}

/* An M-orthonormal basis of the space or, if it contains the rigid motions, of their M-orthogonal complement in it */
static PetscErrorCode ElasticBasis(const FeModel &model, const ReducedPair &pair, bool holds_rigid, MatrixXd *S)
{
  const VectorXd       scale = pair.M.diagonal().cwiseSqrt().cwiseInverse();
  const SymmetricEigen mass(scale.asDiagonal() * pair.M * scale.asDiagonal());
  const PetscInt       n    = (PetscInt)scale.size();
  PetscInt             from = 0;

  PetscFunctionBegin;
  while (from < n && mass.values[from] < dependent_modes) from++;
  if (from)
    PetscCall(
        PetscInfo(model.K, "%" PetscInt_FMT " of %" PetscInt_FMT " vectors are combinations of the others\n", from, n));
  *S = scale.asDiagonal() * mass.vectors.rightCols(n - from) *
       mass.values.tail(n - from).cwiseSqrt().cwiseInverse().asDiagonal();
  if (!holds_rigid) PetscFunctionReturn(0);
  const MatrixXd rigid = S->transpose() * pair.rigid; /* orthonormal columns, if they are in the space */
  const double   off   = (rigid.transpose() * rigid - MatrixXd::Identity(6, 6)).cwiseAbs().maxCoeff();
  PetscCheck(off < 1e-6, model.comm, PETSC_ERR_PLIB,
             "Reduce(): rigid-body motions are off by %g in the space of constraint modes; these were not solved "
             "exactly enough (an iterative solver with a coarse "
             "tolerance?)",
             off);
  *S = (*S * OrthogonalComplement(rigid)).eval();
  PetscFunctionReturn(0);
}

static PetscErrorCode SolvePair(const FeModel &model, const BodyScales &scales, const ReducedPair &pair,
                                const ReductionSpace &space, VectorXd *lambda, MatrixXd *Y)
{
  MatrixXd S;

  PetscFunctionBegin;
  PetscCall(ElasticBasis(model, pair, space.holds_rigid, &S));
  if (!S.cols()) {
    lambda->resize(0);
    Y->resize(pair.K.rows(), 0);
    PetscFunctionReturn(0);
  }
  const MatrixXd       K = S.transpose() * pair.K * S;
  const SymmetricEigen elastic(0.5 * (K + K.transpose()));
  PetscCheck(elastic.found, model.comm, PETSC_ERR_CONV_FAILED,
             "Reduce(): the eigenvalues of the reduced pair were not found");
  *lambda            = elastic.values;
  *Y                 = S * elastic.vectors;
  const double least = std::max(1e-10 * scales.soft, 1e-14 * scales.stiff);
  if ((*lambda)[0] < least) PetscCall(MechanismError(model, space.x * Y->col(0), "K"));
  PetscFunctionReturn(0);
}

/* ---- which modes ---- */

/* Numbers of the modes to be kept. Modes of reduction.keep that do not exist are reported later, when no mode can be missing */
static std::vector<PetscInt> SelectKept(const Reduction &reduction, const VectorXd &lambda)
{
  const std::set<PetscInt> wanted(reduction.keep.begin(), reduction.keep.end());
  std::vector<PetscInt>    kept;

  for (PetscInt k = 0; k < lambda.size(); k++) {
    const double frequency = std::sqrt(lambda[k]) / (2 * PETSC_PI);
    if (!wanted.empty() && !wanted.count(k)) continue;
    if (reduction.keep_below > 0 && frequency >= reduction.keep_below) continue;
    kept.push_back(k);
  }
  return kept;
}

/* Makes the combination of modes of equal frequencies unique, if some of them are kept */
static PetscErrorCode FixEqualFrequencies(const FeModel &model, const BodyScales &scales, const ReductionSpace &space,
                                          const VectorXd &lambda, const std::vector<PetscInt> &kept, MatrixXd *Y)
{
  MatrixXd X, some;

  PetscFunctionBegin;
  for (PetscInt from = 0, to; from < lambda.size(); from = to) {
    to = from + 1;
    while (to < lambda.size() && EqualFrequencies(lambda[to - 1], lambda[to])) to++;
    const auto first = std::lower_bound(kept.begin(), kept.end(), from);
    if (to - from == 1 || first == kept.end() || *first >= to) continue;
    some = Y->middleCols(from, to - from);
    X = space.x * some;
    PetscCall(TurnEqual(model, scales, 0, to - from, &X, &some));
    Y->middleCols(from, to - from) = some;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode SolveSpace(const FeModel &model, const Reduction &reduction, const BodyScales &scales,
                          ReductionSpace *space)
{
  Phase       phase(model.comm, reduction.progress);
  ReducedPair pair;
  VectorXd    lambda;
  MatrixXd    Y;

  PetscFunctionBegin;
  PetscCall(phase.begin("reduced pair"));
  if (space->x.cols()) { /* the same on all ranks */
    PetscCall(Project(model, scales, space->x, &pair));
    PetscCall(SolvePair(model, scales, pair, *space, &lambda, &Y));
  }
  const std::vector<PetscInt> kept = SelectKept(reduction, lambda);
  PetscCall(FixEqualFrequencies(model, scales, *space, lambda, kept, &Y));
  const PetscInt n = (PetscInt)kept.size();
  space->elastic   = (PetscInt)lambda.size();
  space->lowest    = space->elastic ? lambda[0] : 0;
  space->lambda.resize(n);
  space->Y.resize(space->x.cols(), n);
  for (PetscInt k = 0; k < n; k++) {
    space->lambda[k] = lambda[kept[k]];
    space->Y.col(k)  = Y.col(kept[k]);
  }
  PetscCall(phase.end(std::to_string(n) + " of " + std::to_string(lambda.size()) + " modes kept"));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
