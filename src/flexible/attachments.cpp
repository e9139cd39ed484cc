/* Attachments of a body to be reduced: checks of node sets and weights, and the rows of averages. */
#include "attachments.h"
#include "body_check.h"
#include "exchange.h"
#include "modes.h"
#include "scene/symmetric.h"
#include <algorithm>
#include <set>

namespace hhtdae
{

/* Nodes count as collinear if the least principal moment of their weights is below this part of the largest one: the rotation about the line would be undefined */
constexpr double collinear_moments = 1e-8;
/* Averages count as linearly dependent if the least eigenvalue of the Gram matrix of their normalized rows is below this part of the largest one: the interior
   stiffness would be singular */
constexpr double dependent_averages = 1e-10;

static PetscErrorCode Sum(MPI_Comm comm, double *values, int n)
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, values, n, MPI_DOUBLE, MPI_SUM, comm));
  PetscFunctionReturn(0);
}

static PetscErrorCode AllTrue(MPI_Comm comm, bool mine, bool *all)
{
  int value = mine;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_INT, MPI_MIN, comm));
  *all = value != 0;
  PetscFunctionReturn(0);
}

PetscErrorCode OwnNodesOf(const FeModel &model, const std::string &set, const std::string &who, std::vector<PetscInt> *node)
{
  const auto found = model.sets.find(set);
  bool       has, right = true;

  PetscFunctionBegin;
  node->clear();
  PetscCall(AllTrue(model.comm, found != model.sets.end(), &has));
  if (!has) {
    std::string known;
    for (const auto &s : model.sets) known += (known.empty() ? "" : ", ") + s.first;
    SETERRQ(model.comm, PETSC_ERR_ARG_WRONG, "%s: the model has no node set '%s'; its sets are: %s", who.c_str(), set.c_str(),
            known.empty() ? "none" : known.c_str());
  }
  PetscInt before = -1;
  for (PetscInt n : found->second) {
    right  = right && n > before && n >= model.first && n < model.first + model.own;
    before = n;
    node->push_back(n - model.first);
  }
  PetscCall(AllTrue(model.comm, right, &right));
  PetscCheck(right, model.comm, PETSC_ERR_ARG_WRONG, "%s: the node set '%s' has to list own nodes by global number, in ascending order and each once",
             who.c_str(), set.c_str());
  PetscFunctionReturn(0);
}

static PetscErrorCode CountNodes(const FeModel &model, Tied *t)
{
  PetscInt mine = (PetscInt)t->node.size();
  struct {
    int count, rank;
  } best;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(&mine, &t->count, 1, MPIU_INT, MPI_SUM, model.comm));
  PetscCheck(t->count > 0, model.comm, PETSC_ERR_ARG_WRONG, "Attachment %s: its node set is empty", t->name.c_str());
  best.count = (int)mine;
  PetscCallMPI(MPI_Comm_rank(model.comm, &best.rank));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &best, 1, MPI_2INT, MPI_MAXLOC, model.comm));
  t->owner = best.rank;
  PetscFunctionReturn(0);
}

PetscErrorCode WeightsOfNodes(const FeModel &model, const Attachment &a, const std::vector<PetscInt> &node,
                              std::vector<double> *weight)
{
  std::vector<PetscInt> mine, all;

  PetscFunctionBegin;
  weight->assign(node.size(), 1.);
  if (a.weights.empty()) PetscFunctionReturn(0);
  for (PetscInt i : node) mine.push_back(NodeLabel(model, i));
  PetscCall(GatherAll(model.comm, mine, &all));
  std::sort(all.begin(), all.end());
  PetscCheck(std::adjacent_find(all.begin(), all.end()) == all.end(), model.comm, PETSC_ERR_ARG_WRONG,
             "Attachment %s: two nodes of its set have the same label, and weights go by labels", a.name.c_str());
  for (std::size_t i = 0; i < mine.size(); i++)
    (*weight)[i] = a.weights[std::lower_bound(all.begin(), all.end(), mine[i]) - all.begin()];
  PetscFunctionReturn(0);
}

static PetscErrorCode GetWeights(const FeModel &model, const Attachment &a, const Tied &t, std::vector<double> *weight)
{
  bool   right = true;
  double sum   = 0;

  PetscFunctionBegin;
  weight->assign(t.node.size(), 1.);
  if (a.weights.empty()) PetscFunctionReturn(0);
  PetscCheck(a.tie == Tie::Average, model.comm, PETSC_ERR_ARG_WRONG,
             "Attachment %s: weights are for averages, this one is rigid", t.name.c_str());
  PetscCheck((PetscInt)a.weights.size() == t.count, model.comm, PETSC_ERR_ARG_SIZ,
             "Attachment %s: %d weights for %" PetscInt_FMT
             " nodes; there has to be one for each node of the set, in the order of their labels",
             t.name.c_str(), (int)a.weights.size(), t.count);
  for (double w : a.weights) {
    right = right && w >= 0 && w < PETSC_MAX_REAL;
    sum += w;
  }
  PetscCheck(right && sum > 0, model.comm, PETSC_ERR_ARG_OUTOFRANGE,
             "Attachment %s: weights have to be positive numbers or zero, and not all zero", t.name.c_str());
  PetscCall(WeightsOfNodes(model, a, t.node, weight));
  PetscFunctionReturn(0);
}

/* Sum of the weights w, centroid, and moments sum w (r^2 I - r r^T) about the centroid */
static PetscErrorCode Moments(const FeModel &model, const Tied &t, const std::vector<double> &weight, double *sum,
                              Vector3 *centroid, Matrix3 *J)
{
  double s[4] = {0, 0, 0, 0};

  PetscFunctionBegin;
  for (std::size_t i = 0; i < t.node.size(); i++) {
    const Vector3 X = NodePosition(model, t.node[i]);
    s[3] += weight[i];
    for (int c = 0; c < 3; c++) s[c] += weight[i] * X[c];
  }
  PetscCall(Sum(model.comm, s, 4));
  *sum      = s[3];
  *centroid = Vector3(s[0], s[1], s[2]) / s[3];
  J->setZero();
  for (std::size_t i = 0; i < t.node.size(); i++) {
    const Vector3 r = NodePosition(model, t.node[i]) - *centroid;
    *J += weight[i] * (r.squaredNorm() * Matrix3::Identity() - r * r.transpose());
  }
  PetscCall(Sum(model.comm, J->data(), 9));
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckRotation(const FeModel &model, const Tied &t, const Matrix3 &J)
{
  const Vector3 moments = SymmetricEigen(J).values;

  PetscFunctionBegin;
  PetscCheck(t.count > 1, model.comm, PETSC_ERR_ARG_WRONG,
             "Attachment %s: a single node has no rotation to follow; take its neighbours into the set, three nodes at "
             "least that are not on a line",
             t.name.c_str());
  PetscCheck(moments[0] > collinear_moments * moments[2], model.comm, PETSC_ERR_ARG_WRONG,
             "Attachment %s: its %" PetscInt_FMT
             " nodes are on a line (or have no weight off it), so the rotation about that line is %s; "
             "take in a node off the line",
             t.name.c_str(), t.count, t.tie == Tie::Rigid ? "without stiffness" : "not defined");
  PetscFunctionReturn(0);
}

/* Rows of the rigid motion nearest to the displacements u: rotation theta = J^-1 sum w r x u, translation mean u + theta x (point - centroid) */
static void SetRows(const FeModel &model, const std::vector<double> &weight, double sum, const Vector3 &centroid,
                    const Matrix3 &J, Tied *t)
{
  const Matrix3 inverse = J.inverse(), arm = Cross(t->position - centroid);
  t->row.resize(t->node.size());
  for (std::size_t i = 0; i < t->node.size(); i++) {
    const Vector3 r     = NodePosition(model, t->node[i]) - centroid;
    const Matrix3 theta = inverse * Cross(r) * weight[i];
    t->row[i] << weight[i] / sum * Matrix3::Identity() - arm * theta, theta;
  }
}

static PetscErrorCode ResolveOne(const FeModel &model, const Attachment &a, Tied *t)
{
  std::vector<double> weight;
  double              sum = 0;
  Vector3             centroid;
  Matrix3             J;

  PetscFunctionBegin;
  t->name = a.name;
  t->tie  = a.tie;
  PetscCall(OwnNodesOf(model, a.set.empty() ? a.name : a.set, "Attachment " + a.name, &t->node));
  PetscCall(CountNodes(model, t));
  PetscCall(GetWeights(model, a, *t, &weight));
  PetscCall(Moments(model, *t, weight, &sum, &centroid, &J));
  PetscCall(CheckRotation(model, *t, J));
  t->position = a.at_given ? a.position : centroid;
  PetscCheck(t->position.allFinite(), model.comm, PETSC_ERR_ARG_OUTOFRANGE, "Attachment %s: its position is not finite",
             a.name.c_str());
  if (a.tie == Tie::Average) SetRows(model, weight, sum, centroid, J, t);
  PetscFunctionReturn(0);
}

/* Refuses nodes in two rigid attachments and, with `averages`, nodes in a rigid and an averaging attachment */
static PetscErrorCode CheckOverlap(const FeModel &model, const std::vector<Tied> &tied, bool averages)
{
  std::vector<int> holder(model.own, -1);
  const int        none = (int)tied.size() * (int)tied.size();
  int              pair = none, at = -1;

  PetscFunctionBegin;
  for (int pass = 0; pass < (averages ? 2 : 1); pass++)
    for (std::size_t a = 0; a < tied.size(); a++) {
      if ((tied[a].tie == Tie::Rigid) != (pass == 0)) continue;
      for (PetscInt n : tied[a].node) {
        if (holder[n] >= 0 && pair == none) {
          pair = holder[n] * (int)tied.size() + (int)a;
          at   = (int)n;
        }
        if (pass == 0 && holder[n] < 0) holder[n] = (int)a;
      }
    }
  int all = pair;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MIN, model.comm));
  if (all == none) PetscFunctionReturn(0);
  PetscInt label = pair == all ? NodeLabel(model, at) : -1;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &label, 1, MPIU_INT, MPI_MAX, model.comm));
  const Tied &x = tied[all / (int)tied.size()], &y = tied[all % (int)tied.size()];
  SETERRQ(model.comm, PETSC_ERR_ARG_WRONG,
          "Attachments %s and %s overlap: node %" PetscInt_FMT
          " is in both; the nodes of a rigid attachment can be in no other %sone",
          x.name.c_str(), y.name.c_str(), label, averages ? "" : "rigid ");
}

/* Gram matrix of the rows of averages, normalized: singular if averages are linearly dependent */
static PetscErrorCode GramOfAverages(const FeModel &model, const std::vector<Tied> &tied, MatrixXd *G)
{
  std::vector<std::vector<std::pair<int, int>>> uses(model.own); /* for each own node: averages that contain it, and its index there */

  PetscFunctionBegin;
  for (std::size_t a = 0; a < tied.size(); a++)
    for (std::size_t i = 0; i < tied[a].row.size(); i++) uses[tied[a].node[i]].push_back({(int)a, (int)i});
  G->setZero(6 * tied.size(), 6 * tied.size());
  for (const auto &use : uses)
    for (const auto &x : use)
      for (const auto &y : use)
        G->block<6, 6>(6 * x.first, 6 * y.first) +=
            tied[x.first].row[x.second] * tied[y.first].row[y.second].transpose();
  PetscCall(SumOverRanks(model.comm, G));
  for (std::size_t a = 0; a < tied.size(); a++)
    if (tied[a].tie == Tie::Rigid) G->block<6, 6>(6 * a, 6 * a).setIdentity();
  const VectorXd scale = G->diagonal().cwiseSqrt().cwiseInverse();
  *G                   = (scale.asDiagonal() * *G * scale.asDiagonal()).eval();
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckIndependent(const FeModel &model, const std::vector<Tied> &tied)
{
  MatrixXd G;

  PetscFunctionBegin;
  if (tied.empty()) PetscFunctionReturn(0);
  PetscCall(GramOfAverages(model, tied, &G));
  const SymmetricEigen gram(0.5 * (G + G.transpose()));
  if (gram.values[0] > dependent_averages * gram.values.tail<1>()[0]) PetscFunctionReturn(0);
  std::string names;
  for (std::size_t a = 0; a < tied.size(); a++)
    if (gram.vectors.block<6, 1>(6 * a, 0).norm() > 1e-3) names += (names.empty() ? "" : ", ") + tied[a].name;
  SETERRQ(model.comm, PETSC_ERR_ARG_WRONG,
          "The averages of the attachments %s depend on each other: they are over the same few nodes; give each one "
          "nodes of its own",
          names.c_str());
}

static PetscErrorCode ResolveEach(const FeModel &model, const std::vector<Attachment> &attachments, std::vector<Tied> *tied)
{
  std::set<std::string> names;

  PetscFunctionBegin;
  tied->resize(attachments.size());
  for (std::size_t a = 0; a < attachments.size(); a++) {
    PetscCheck(!attachments[a].name.empty(), model.comm, PETSC_ERR_ARG_WRONG, "Attachment %d has no name", (int)a);
    PetscCheck(names.insert(attachments[a].name).second, model.comm, PETSC_ERR_ARG_WRONG,
               "There are two attachments of the name %s", attachments[a].name.c_str());
    PetscCall(ResolveOne(model, attachments[a], &(*tied)[a]));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode CheckAttachments(const FeModel &model, const std::vector<Attachment> &attachments)
{
  std::vector<Tied> tied;

  PetscFunctionBegin;
  PetscCall(ResolveEach(model, attachments, &tied));
  PetscCall(CheckOverlap(model, tied, false));
  PetscFunctionReturn(0);
}

PetscErrorCode ResolveAttachments(const FeModel &model, const std::vector<Attachment> &attachments,
                                  std::vector<Tied> *tied)
{
  PetscFunctionBegin;
  PetscCall(ResolveEach(model, attachments, tied));
  PetscCall(CheckOverlap(model, *tied, true));
  PetscCall(CheckIndependent(model, *tied));
  PetscFunctionReturn(0);
}

PetscErrorCode AverageMotions(const FeModel &model, const std::vector<Tied> &tied, const Eigen::MatrixXd &u,
                              Eigen::MatrixXd *motion)
{
  PetscFunctionBegin;
  motion->setZero(6 * tied.size(), u.cols());
  for (std::size_t a = 0; a < tied.size(); a++)
    for (std::size_t i = 0; i < tied[a].row.size(); i++)
      motion->middleRows(6 * a, 6).noalias() += tied[a].row[i] * u.middleRows(3 * tied[a].node[i], 3);
  PetscCall(SumOverRanks(model.comm, motion));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
