/*
  Reduction of a finite-element model to a body in modal coordinates.

  The model is checked, a space of constraint and normal modes is found (craig_bampton.cpp), and K and M are projected
  on it. The six rigid-body motions, known from the nodes' coordinates, are taken out of that space before the
  eigenvalue problem of the reduced pair is solved, so no threshold tells them from soft modes and all modes are
  orthogonal to them in M to rounding (mean-axis conditions).
*/
#include "craig_bampton.h"
#include "invariants.h"
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <set>
#include <slepcsys.h>

namespace hhtdae
{

/* Directions of the space with less mass, relative to unit vectors in M, are combinations of the others */
constexpr double dependent_modes = 1e-13;

/* ---- what is asked for ---- */

static PetscErrorCode CheckReduction(const FeModel &model, const Reduction &r)
{
  PetscFunctionBegin;
  PetscCheck(r.modes >= 0 || r.modes == PETSC_DEFAULT, model.comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Reduction::modes is %" PetscInt_FMT ", it has to be 0 or more", r.modes);
  PetscCheck(r.max_frequency >= 0 && std::isfinite(r.max_frequency) && r.keep_below >= 0 && std::isfinite(r.keep_below),
             model.comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Reduction::max_frequency is %g and keep_below is %g, they have to be positive, or 0 for no bound",
             r.max_frequency, r.keep_below);
  PetscCheck(r.modes != PETSC_DEFAULT || r.max_frequency > 0 || r.method == Method::Static, model.comm,
             PETSC_ERR_ARG_WRONG,
             "Reduction::modes = PETSC_DEFAULT means all modes below max_frequency, which is not set");
  for (PetscInt k : r.keep)
    PetscCheck(k >= 0, model.comm, PETSC_ERR_ARG_OUTOFRANGE,
               "Reduction::keep lists mode %" PetscInt_FMT "; modes have numbers from 0", k);
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckModel(const FeModel &model, const Reduction &reduction, std::vector<Tied> *tied,
                                 BodyScales *scales)
{
  Phase phase(model.comm, reduction.progress);

  PetscFunctionBegin;
  PetscCall(phase.begin("checks"));
  PetscCall(CheckReduction(model, reduction));
  PetscCall(CheckMatrices(model));
  PetscCall(ResolveAttachments(model, reduction.attachments, tied));
  PetscCall(CheckConnected(model, *tied));
  PetscCall(ComputeScales(model, scales));
  PetscCall(CheckUnsupported(model, *scales));
  PetscCall(phase.end(std::to_string(model.nodes) + " nodes, mass " + std::to_string(scales->mass)));
  const std::string units = SuspectUnits(model, *scales);
  if (units.empty()) PetscFunctionReturn(0);
  PetscCall(PetscInfo(model.K, "%s\n", units.c_str()));
  if (reduction.progress) PetscCall(PetscPrintf(model.comm, "reduce: %s\n", units.c_str()));
  PetscFunctionReturn(0);
}

/* ---- the reduced pair ---- */

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
    PetscCall(LocalProduct(T, AT, &part));
    pair->K.middleCols(from, count) = part;
    PetscCall(MultiplyColumns(model.M, T, from, count, &AT));
    PetscCall(LocalProduct(T, AT, &part));
    pair->M.middleCols(from, count) = part;
  }
  PetscCall(Multiply(model.M, scales.rigid, &AT));
  PetscCall(LocalProduct(T, AT, &pair->rigid));
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
  const VectorXd                                scale = pair.M.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> mass(scale.asDiagonal() * pair.M * scale.asDiagonal());
  const PetscInt                                n    = (PetscInt)scale.size();
  PetscInt                                      from = 0;

  PetscFunctionBegin;
  while (from < n && mass.eigenvalues()[from] < dependent_modes) from++;
  if (from)
    PetscCall(
        PetscInfo(model.K, "%" PetscInt_FMT " of %" PetscInt_FMT " vectors are combinations of the others\n", from, n));
  *S = scale.asDiagonal() * mass.eigenvectors().rightCols(n - from) *
       mass.eigenvalues().tail(n - from).cwiseSqrt().cwiseInverse().asDiagonal();
  if (!holds_rigid) PetscFunctionReturn(0);
  const MatrixXd rigid = S->transpose() * pair.rigid; /* orthonormal columns, if they are in the space */
  const double   off   = (rigid.transpose() * rigid - MatrixXd::Identity(6, 6)).cwiseAbs().maxCoeff();
  PetscCheck(off < 1e-6, model.comm, PETSC_ERR_PLIB,
             "Reduce(): rigid-body motions are off by %g in the space of constraint modes; these were not solved "
             "exactly enough (an iterative solver with a coarse "
             "tolerance?)",
             off);
  const Eigen::HouseholderQR<MatrixXd> qr(rigid);
  const MatrixXd                       Q = qr.householderQ() * MatrixXd::Identity(rigid.rows(), rigid.rows());
  *S                                     = (*S * Q.rightCols(rigid.rows() - 6)).eval();
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
  const MatrixXd                                K = S.transpose() * pair.K * S;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> elastic(0.5 * (K + K.transpose()));
  PetscCheck(elastic.info() == Eigen::Success, model.comm, PETSC_ERR_CONV_FAILED,
             "Reduce(): the eigenvalues of the reduced pair were not found");
  *lambda            = elastic.eigenvalues();
  *Y                 = S * elastic.eigenvectors();
  const double least = std::max(1e-10 * scales.soft, 1e-14 * scales.stiff);
  if ((*lambda)[0] < least) PetscCall(MechanismError(model, space.x * Y->col(0), "K"));
  PetscFunctionReturn(0);
}

/* ---- a choice that does not depend on the ranks ---- */

/* The largest displacement of each mode is positive; among equal ones, that of the node with the least label */
static PetscErrorCode FixSigns(const FeModel &model, MatrixXd *X, MatrixXd *Y)
{
  const PetscInt        n = (PetscInt)X->cols();
  std::vector<double>   most(n, 0.), value(n, 0.);
  std::vector<PetscInt> first(n, PETSC_MAX_INT);

  PetscFunctionBegin;
  for (PetscInt k = 0; k < n && X->rows(); k++) most[k] = X->col(k).cwiseAbs().maxCoeff();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most.data(), (PetscMPIInt)n, MPI_DOUBLE, MPI_MAX, model.comm));
  for (PetscInt k = 0; k < n; k++)
    for (PetscInt i = 0; i < X->rows(); i++)
      if (std::abs((*X)(i, k)) > (1 - 1e-4) * most[k])
        first[k] = std::min(first[k], 3 * NodeLabel(model, i / 3) + i % 3);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, first.data(), (PetscMPIInt)n, MPIU_INT, MPI_MIN, model.comm));
  for (PetscInt k = 0; k < n; k++)
    for (PetscInt i = 0; i < X->rows(); i++)
      if (std::abs((*X)(i, k)) > (1 - 1e-4) * most[k] && first[k] == 3 * NodeLabel(model, i / 3) + i % 3)
        value[k] = (*X)(i, k);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value.data(), (PetscMPIInt)n, MPI_DOUBLE, MPI_SUM, model.comm));
  for (PetscInt k = 0; k < n; k++)
    if (value[k] < 0) {
      X->col(k) *= -1;
      Y->col(k) *= -1;
    }
  PetscFunctionReturn(0);
}

static PetscErrorCode Settle(const FeModel &model, const BodyScales &scales, const VectorXd &lambda, MatrixXd *X,
                             MatrixXd *Y)
{
  PetscFunctionBegin;
  for (PetscInt from = 0, to; from < lambda.size(); from = to) {
    to = from + 1;
    while (to < lambda.size() && EqualFrequencies(lambda[to - 1], lambda[to])) to++;
    if (to - from > 1) PetscCall(TurnEqual(model, scales, from, to, X, Y));
  }
  PetscCall(FixSigns(model, X, Y));
  PetscFunctionReturn(0);
}

/* ---- selection ---- */

/* Numbers of the modes that are kept */
static PetscErrorCode Select(const FeModel &model, const Reduction &reduction, const VectorXd &lambda,
                             std::vector<PetscInt> *kept)
{
  std::set<PetscInt> wanted(reduction.keep.begin(), reduction.keep.end());

  PetscFunctionBegin;
  PetscCheck(wanted.empty() || *wanted.rbegin() < lambda.size(), model.comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Reduction::keep lists mode %" PetscInt_FMT ", but there are %d elastic modes (numbers from 0)",
             *wanted.rbegin(), (int)lambda.size());
  for (PetscInt k = 0; k < lambda.size(); k++) {
    const double frequency = std::sqrt(lambda[k]) / (2 * PETSC_PI);
    if (!wanted.empty() && !wanted.count(k)) continue;
    if (reduction.keep_below > 0 && frequency >= reduction.keep_below) continue;
    kept->push_back(k);
  }
  PetscFunctionReturn(0);
}

/* With all modes of the same frequencies, which are turned together */
static std::vector<PetscInt> WithEqual(const VectorXd &lambda, const std::vector<PetscInt> &kept)
{
  std::set<PetscInt> all(kept.begin(), kept.end());
  for (PetscInt k : kept) {
    for (PetscInt l = k; l > 0 && EqualFrequencies(lambda[l - 1], lambda[l]); l--) all.insert(l - 1);
    for (PetscInt l = k; l + 1 < lambda.size() && EqualFrequencies(lambda[l], lambda[l + 1]); l++) all.insert(l + 1);
  }
  return std::vector<PetscInt>(all.begin(), all.end());
}

static MatrixXd Columns(const MatrixXd &A, const std::vector<PetscInt> &columns)
{
  MatrixXd some(A.rows(), (Eigen::Index)columns.size());
  for (std::size_t k = 0; k < columns.size(); k++) some.col(k) = A.col(columns[k]);
  return some;
}

/* The kept ones among those that are there */
static void Thin(const std::vector<PetscInt> &there, const std::vector<PetscInt> &kept, VectorXd *lambda, MatrixXd *X,
                 MatrixXd *motion)
{
  std::vector<PetscInt> place;
  if (there.size() == kept.size()) return;
  for (PetscInt k : kept) place.push_back((PetscInt)(std::lower_bound(there.begin(), there.end(), k) - there.begin()));
  *lambda = Columns(lambda->transpose(), place).transpose().eval();
  *X      = Columns(*X, place);
  *motion = Columns(*motion, place);
}

/* ---- the modes in the full model ---- */

/* What rounding left of rigid motions goes; motion: of the rigid attachments */
static PetscErrorCode TakeOutRigid(const FeModel &model, const BodyScales &scales, const std::vector<Tied> &tied,
                                   MatrixXd *X, MatrixXd *motion)
{
  MatrixXd Mr, part;

  PetscFunctionBegin;
  PetscCall(Multiply(model.M, scales.rigid, &Mr));
  PetscCall(LocalProduct(Mr, *X, &part));
  PetscCall(SumOverRanks(model.comm, &part));
  X->noalias() -= scales.rigid * part;
  for (std::size_t a = 0; a < tied.size(); a++) {
    motion->middleRows(6 * a, 3) -= RigidMotion(tied[a].position, scales.center) * scales.frame * part;
    motion->middleRows(6 * a + 3, 3) -= scales.frame.bottomRows<3>() * part;
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Residuals(const FeModel &model, const BodyScales &scales, const std::vector<Tied> &tied,
                                const VectorXd &lambda, const MatrixXd &X, std::vector<ReducedMode> *mode)
{
  MatrixXd Kx, Mx;
  VectorXd residual, force;

  PetscFunctionBegin;
  mode->clear();
  for (PetscInt from = 0; from < X.cols(); from += block_columns) {
    const PetscInt count = std::min<PetscInt>(block_columns, X.cols() - from);
    PetscCall(MultiplyColumns(model.K, X, from, count, &Kx));
    PetscCall(MultiplyColumns(model.M, X, from, count, &Mx));
    PetscCall(TiedNorms(model, tied, scales.length, Kx, &force));
    Kx -= Mx * lambda.segment(from, count).asDiagonal();
    PetscCall(TiedNorms(model, tied, scales.length, Kx, &residual));
    for (PetscInt k = 0; k < count; k++)
      mode->push_back({std::sqrt(lambda[from + k]) / (2 * PETSC_PI), residual[k] / force[k]});
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode FillAttachments(const FeModel &model, const std::vector<Tied> &tied, const MatrixXd &X,
                                      const MatrixXd &rigid_motion, ModalBody *body)
{
  MatrixXd average;

  PetscFunctionBegin;
  PetscCall(AverageMotions(model, tied, X, &average));
  body->attachments.clear();
  for (std::size_t a = 0; a < tied.size(); a++) {
    const MatrixXd &motion = tied[a].tie == Tie::Rigid ? rigid_motion : average;
    ModalAttachment attachment;
    attachment.name        = tied[a].name;
    attachment.position    = tied[a].position;
    attachment.translation = motion.middleRows(6 * a, 3);
    attachment.rotation    = motion.middleRows(6 * a + 3, 3);
    body->attachments.push_back(attachment);
  }
  PetscFunctionReturn(0);
}

/* Mean-axis conditions: neither momentum nor moment of momentum comes with a mode. |int phi dm| can be sqrt(mass) at
 * most. */
static PetscErrorCode CheckMeanAxes(const FeModel &model, const BodyScales &scales, const ModalBody &body)
{
  const double limit = 1e-8;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < body.modes(); k++) {
    Vector3 angular;
    for (int c = 0; c < 3; c++)
      angular[c] = body.moment[(c + 1) % 3]((c + 2) % 3, k) - body.moment[(c + 2) % 3]((c + 1) % 3, k);
    const double p = body.first.col(k).norm() / std::sqrt(body.mass),
                 l = angular.norm() / std::sqrt(scales.moments.trace());
    PetscCheck(p < limit && l < limit, model.comm, PETSC_ERR_PLIB,
               "Reduce(): mode %" PetscInt_FMT
               " carries momentum (%g) or moment of momentum (%g), relative to a rigid motion",
               k, p, l);
  }
  PetscFunctionReturn(0);
}

/* ---- all together ---- */

static const char *MethodName(Method method)
{
  return method == Method::CraigBampton ? "Craig-Bampton" : method == Method::FreeFree ? "free-free" : "static";
}

/* Without attachments there is nothing to hold: modes of the free body. The modes of one attachment are rigid motions.
 */
static PetscErrorCode FindSpace(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                                const BodyScales &scales, Method *method, ReductionSpace *space)
{
  PetscFunctionBegin;
  *method = reduction.method;
  if (*method == Method::CraigBampton && tied.empty()) *method = Method::FreeFree;
  const bool no_normal = *method == Method::Static || reduction.modes == 0;
  if (no_normal && (*method == Method::FreeFree || tied.size() < 2)) {
    space->x.resize(3 * model.own, 0);
    space->motion.resize(6 * tied.size(), 0);
    space->holds_rigid = false;
  } else if (*method == Method::FreeFree)
    PetscCall(FreeFreeSpace(model, tied, reduction, scales, space));
  else
    PetscCall(CraigBamptonSpace(model, tied, reduction, scales, space));
  PetscFunctionReturn(0);
}

/* Modes of the reduced pair in place of the space's vectors */
static PetscErrorCode ToModes(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                              const BodyScales &scales, ReductionSpace *space, VectorXd *lambda)
{
  Phase                 phase(model.comm, reduction.progress);
  ReducedPair           pair;
  MatrixXd              Y, X;
  std::vector<PetscInt> kept, there;

  PetscFunctionBegin;
  PetscCall(phase.begin("reduced pair"));
  lambda->resize(0);
  if (space->x.cols()) {
    PetscCall(Project(model, scales, space->x, &pair));
    PetscCall(SolvePair(model, scales, pair, *space, lambda, &Y));
    PetscCall(Select(model, reduction, *lambda, &kept));
    there   = WithEqual(*lambda, kept);
    Y       = Columns(Y, there);
    *lambda = Columns(lambda->transpose(), there).transpose().eval();
    PetscCall(Combine(space->x, Y, &X));
    space->x.swap(X);
    X.resize(0, 0);
    space->motion = (space->motion * Y).eval();
    PetscCall(TakeOutRigid(model, scales, tied, &space->x, &space->motion));
    PetscCall(Settle(model, scales, *lambda, &space->x, &space->motion));
    Thin(there, kept, lambda, &space->x, &space->motion);
  } else
    PetscCheck(reduction.keep.empty(), model.comm, PETSC_ERR_ARG_OUTOFRANGE,
               "Reduction::keep lists modes, but the body has none");
  PetscCall(phase.end(std::to_string(lambda->size()) + " modes kept"));
  PetscFunctionReturn(0);
}

static void CopyNodes(const FeModel &model, bool keep, MatrixXd *x, ReducedBody *body)
{
  body->own = body->first = 0;
  body->coordinates.clear();
  body->label.clear();
  body->elements.clear();
  body->shape.resize(0, 0);
  body->stress = StressModes();
  if (!keep) return;
  body->own         = model.own;
  body->first       = model.first;
  body->coordinates = model.coordinates;
  body->elements    = model.elements;
  for (PetscInt i = 0; i < model.own; i++) body->label.push_back(NodeLabel(model, i));
  body->shape.swap(*x);
}

/* Programs that started PETSc alone */
static PetscErrorCode StartSlepc()
{
  PetscBool started;

  PetscFunctionBegin;
  PetscCall(SlepcInitialized(&started));
  if (started) PetscFunctionReturn(0);
  PetscCall(SlepcInitializeNoArguments());
  PetscCall(PetscRegisterFinalize(SlepcFinalize));
  PetscFunctionReturn(0);
}

PetscErrorCode Reduce(const FeModel &model, const Reduction &reduction, ReducedBody *body)
{
  std::vector<Tied> tied;
  BodyScales        scales;
  ReductionSpace    space;
  VectorXd          lambda;
  Method            method;
  Phase             phase(model.comm, reduction.progress);

  PetscFunctionBegin;
  PetscCall(StartSlepc());
  PetscCall(CheckModel(model, reduction, &tied, &scales));
  PetscCall(FindSpace(model, tied, reduction, scales, &method, &space));
  PetscCall(ToModes(model, tied, reduction, scales, &space, &lambda));

  PetscCall(phase.begin("invariants"));
  body->modal.omega = lambda.cwiseSqrt();
  PetscCall(ComputeInvariants(model, scales, space.x, &body->modal));
  PetscCall(FillAttachments(model, tied, space.x, space.motion, &body->modal));
  PetscCall(CheckMeanAxes(model, scales, body->modal));
  PetscCall(Residuals(model, scales, tied, lambda, space.x, &body->mode));
  PetscCall(phase.end(std::to_string(body->modal.modes()) + " modes"));

  body->comm          = model.comm;
  body->source        = model.source;
  body->method        = MethodName(method);
  body->fe_nodes      = model.nodes;
  body->elastic_scale = lambda.size() ? lambda.maxCoeff() : 0.;
  CopyNodes(model, reduction.all_nodes, &space.x, body);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
