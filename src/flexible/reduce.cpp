/*
  Reduction of a finite-element model to a body in modal coordinates.

  The model is checked, a subspace and its modes are computed (craig_bampton.h), and the body receives the modes at its nodes, the
  motions of its attachments and its invariants.
*/
#include "craig_bampton.h"
#include "invariants.h"
#include "kept_nodes.h"
#include "loads.h"
#include "stiffening.h"
#include <algorithm>
#include <cmath>
#include <slepcsys.h>

namespace hhtdae
{

/* ---- checks ---- */

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
  if (r.method != Method::Static && r.modes == PETSC_DEFAULT) PetscFunctionReturn(0);
  const PetscInt most = (r.method == Method::Static ? 0 : r.modes) + 6 * std::max<PetscInt>((PetscInt)r.attachments.size() - 1, 0); /* six rigid motions are not elastic modes */
  for (PetscInt k : r.keep)
    PetscCheck(k < most, model.comm, PETSC_ERR_ARG_OUTOFRANGE,
               "Reduction::keep lists mode %" PetscInt_FMT ", but there are %" PetscInt_FMT " elastic modes at most (numbers from 0)", k, most);
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckModel(const FeModel &model, const Reduction &reduction, std::vector<Tied> *tied, KeptNodes *kept,
                                 std::vector<ResolvedLoad> *loads, BodyScales *scales)
{
  Phase phase(model.comm, reduction.progress);

  PetscFunctionBegin;
  PetscCall(phase.begin("checks"));
  PetscCall(CheckReduction(model, reduction));
  PetscCall(CheckMatrices(model));
  PetscCall(ResolveAttachments(model, reduction.attachments, tied));
  PetscCall(ResolveKeptNodes(model, reduction, kept));
  PetscCall(ResolveLoads(model, reduction.loads, loads));
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

/* ---- the modes in the full model ---- */

/* Removes the rigid motions that rounding has left in the modes X, and in the motions of rigid attachments */
static PetscErrorCode SubtractRigidMotions(const FeModel &model, const BodyScales &scales, const std::vector<Tied> &tied,
                                           MatrixXd *X, MatrixXd *motion)
{
  MatrixXd Mr, part;

  PetscFunctionBegin;
  PetscCall(Multiply(model.M, scales.rigid, &Mr));
  part = Mr.transpose() * (*X);
  PetscCall(SumOverRanks(model.comm, &part));
  X->noalias() -= scales.rigid * part;
  for (std::size_t a = 0; a < tied.size(); a++) {
    motion->middleRows(6 * a, 3) -= RigidMotion(tied[a].position, scales.center) * scales.frame * part;
    motion->middleRows(6 * a + 3, 3) -= scales.frame.bottomRows<3>() * part;
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

/* Checks the mean-axis conditions: a mode carries no momentum and no moment of momentum. |int phi dm| is at most sqrt(mass). */
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

/* ---- reduction ---- */

static const char *MethodName(Method method)
{
  return method == Method::CraigBampton ? "Craig-Bampton" : method == Method::FreeFree ? "free-free" : "static";
}

/* Without attachments Craig-Bampton becomes the free-free method. The constraint modes of a single attachment are rigid motions, so that there is no static space. */
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
  } else if (*method == Method::FreeFree)
    PetscCall(FreeFreeSpace(model, tied, reduction, scales, space));
  else
    PetscCall(CraigBamptonSpace(model, tied, reduction, scales, space));
  PetscFunctionReturn(0);
}

/* Replaces x by x Y, a few rows at a time, without a second block of the size of x */
static PetscErrorCode CombineInPlace(const MatrixXd &Y, MatrixXd *x)
{
  const PetscInt rows = (PetscInt)x->rows(), step = 4096;
  MatrixXd       part;

  PetscFunctionBegin;
  for (PetscInt from = 0; from < rows; from += step) {
    const PetscInt count = std::min(step, rows - from);
    part = x->middleRows(from, count) * Y;
    x->block(from, 0, count, Y.cols()) = part;
  }
  x->conservativeResize(Eigen::NoChange, Y.cols());
  PetscFunctionReturn(0);
}

/* Replaces the vectors of the space by the modes of the reduced pair */
static PetscErrorCode ToModes(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                              const BodyScales &scales, ReductionSpace *space)
{
  const auto last = std::max_element(reduction.keep.begin(), reduction.keep.end());
  Phase      phase(model.comm, reduction.progress);

  PetscFunctionBegin;
  PetscCheck(space->elastic || reduction.keep.empty(), model.comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Reduction::keep lists modes, but the body has none");
  PetscCheck(last == reduction.keep.end() || *last < space->elastic, model.comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Reduction::keep lists mode %" PetscInt_FMT ", but there are %" PetscInt_FMT
             " elastic modes (numbers from 0)",
             *last, space->elastic);
  PetscCall(phase.begin("shapes"));
  PetscCall(CombineInPlace(space->Y, &space->x));
  space->motion = (space->motion * space->Y).eval();
  PetscCall(SubtractRigidMotions(model, scales, tied, &space->x, &space->motion));
  PetscCall(FixSigns(model, &space->x, &space->motion));
  PetscCall(phase.end(std::to_string(space->lambda.size()) + " modes"));
  PetscFunctionReturn(0);
}

/* A notice where bounds on frequencies, or attachments, leave fewer kinds of modes than were asked for; it may be a mistake in units */
static PetscErrorCode TellOfMissingModes(const FeModel &model, const Reduction &r, Method method, const ReductionSpace &space)
{
  const char *left = space.lambda.size() ? "the body has constraint modes alone" : "the body is rigid";

  PetscFunctionBegin;
  if (space.elastic && !space.lambda.size())
    PetscCall(PetscPrintf(model.comm, "reduce: keep_below = %g leaves none of %" PetscInt_FMT " modes, the slowest of which has the frequency %g: %s\n", r.keep_below,
                          space.elastic, std::sqrt(space.lowest) / (2 * PETSC_PI), left));
  else if (method != Method::Static && r.modes != 0 && r.max_frequency > 0 && !space.normal)
    PetscCall(PetscPrintf(model.comm, "reduce: no normal mode has a frequency below max_frequency = %g: %s\n", r.max_frequency, left));
  else if (method == Method::Static && !space.elastic)
    PetscCall(PetscPrintf(model.comm, "reduce: constraint modes of fewer than two attachments are rigid motions: %s\n", left));
  PetscFunctionReturn(0);
}

static void FillModes(const ReductionSpace &space, ReducedBody *body)
{
  const PetscInt n = (PetscInt)space.lambda.size();
  body->modal.omega   = space.lambda.cwiseSqrt();
  body->elastic_scale = n ? space.lambda.maxCoeff() : 0.;
  body->mode.clear();
  for (PetscInt k = 0; k < n; k++) body->mode.push_back({body->modal.omega[k] / (2 * PETSC_PI), space.residual[k]});
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

PetscErrorCode StartSlepc()
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
  std::vector<Tied>         tied;
  KeptNodes                 kept;
  std::vector<ResolvedLoad> loads;
  BodyScales                scales;
  ReductionSpace            space;
  Method                    method;
  Phase                     phase(model.comm, reduction.progress);

  PetscFunctionBegin;
  PetscCall(StartSlepc());
  PetscCall(CheckModel(model, reduction, &tied, &kept, &loads, &scales));
  PetscCall(FindSpace(model, tied, reduction, scales, &method, &space));
  PetscCall(ToModes(model, tied, reduction, scales, &space));
  PetscCall(TellOfMissingModes(model, reduction, method, space));

  PetscCall(phase.begin("invariants"));
  FillModes(space, body);
  PetscCall(ComputeInvariants(model, scales, space.x, &body->modal));
  PetscCall(FillAttachments(model, tied, space.x, space.motion, &body->modal));
  PetscCall(FillNodes(model, kept, space.x, &body->modal));
  PetscCall(FillLoads(model, reduction.loads, loads, scales, space.x, &body->modal));
  PetscCall(CheckMeanAxes(model, scales, body->modal));
  PetscCall(phase.end(std::to_string(body->modal.modes()) + " modes"));
  if (reduction.stiffening) PetscCall(ComputeStiffening(model, tied, scales, reduction, space.x, &body->modal));

  body->comm     = model.comm;
  body->source   = model.source;
  body->method   = MethodName(method);
  body->fe_nodes = model.nodes;
  CopyNodes(model, reduction.all_nodes, &space.x, body);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
