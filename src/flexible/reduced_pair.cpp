/*
  K and M projected on the space of a reduction, and the modes of that pair.

  The six rigid-body motions, known from the nodes' coordinates, are taken out of the space before the eigenvalue problem
  is solved, so no threshold tells them from soft modes and all modes are orthogonal to them in M to rounding
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

/* Directions of the space with less mass, relative to unit vectors in M, are combinations of the others */
constexpr double dependent_modes = 1e-13;

/* ---- the pair ---- */

struct ReducedPair {
  MatrixXd K, M, rigid; /* of the space; rigid: its vectors times M times the six rigid motions */
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
    part = T.transpose() * AT;
    pair->K.middleCols(from, count) = part;
    PetscCall(MultiplyColumns(model.M, T, from, count, &AT));
    part = T.transpose() * AT;
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

/* Combinations of the space that are orthonormal in M and, where it holds them, orthogonal to the rigid motions */
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

/* Numbers of the modes that are kept. Those of the list which are not there are reported when none can be missing */
static std::vector<PetscInt> Select(const Reduction &reduction, const VectorXd &lambda)
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

/* Modes of equal frequencies, some of which are kept, are turned together */
static PetscErrorCode TurnKept(const FeModel &model, const BodyScales &scales, const ReductionSpace &space,
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
  const std::vector<PetscInt> kept = Select(reduction, lambda);
  PetscCall(TurnKept(model, scales, *space, lambda, kept, &Y));
  const PetscInt n = (PetscInt)kept.size();
  space->elastic   = (PetscInt)lambda.size();
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
