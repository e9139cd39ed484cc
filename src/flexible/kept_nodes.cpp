/*
  Nodes that a reduction keeps. The rotation of a node is that of the rigid motion nearest to the displacements of the nodes that K couples it to:
  theta = J^-1 sum r x u, with r from their centroid and J = sum (r^2 1 - r r^T).
*/
#include "kept_nodes.h"
#include "attachments.h"
#include "exchange.h"
#include "scene/symmetric.h"
#include <algorithm>
#include <map>
#include <set>

namespace hhtdae
{

namespace
{

/* Neighbours count as collinear, so that the node has no rotation, if their least principal moment is below this part of the largest one */
constexpr double collinear_neighbours = 1e-8;

struct Neighbour {
  PetscInt kept, node; /* index of the kept node, global number of the neighbour */
};

/* The nodes that K couples to the kept ones, themselves included; on all ranks */
PetscErrorCode Neighbours(const FeModel &model, const KeptNodes &kept, std::vector<Neighbour> *all)
{
  std::vector<Neighbour> mine;

  PetscFunctionBegin;
  for (std::size_t k = 0; k < kept.label.size(); k++) {
    std::set<PetscInt> coupled;
    if (kept.own[k] < 0) continue;
    for (PetscInt c = 0; c < 3; c++) {
      const PetscInt  row = 3 * (model.first + kept.own[k]) + c;
      const PetscInt *column;
      PetscInt        n;
      PetscCall(MatGetRow(model.K, row, &n, &column, nullptr));
      for (PetscInt i = 0; i < n; i++) coupled.insert(column[i] / 3);
      PetscCall(MatRestoreRow(model.K, row, &n, &column, nullptr));
    }
    for (PetscInt node : coupled) mine.push_back({(PetscInt)k, node});
  }
  PetscCall(GatherAll(model.comm, mine, all));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FindLabels(const FeModel &model, const std::vector<PetscInt> &label, const std::string &who, std::vector<PetscInt> *own)
{
  std::map<PetscInt, PetscInt> node_of_label;
  std::vector<int>             found(label.size() + 1, 0);

  PetscFunctionBegin;
  for (PetscInt i = 0; i < model.own; i++) node_of_label[NodeLabel(model, i)] = i;
  own->assign(label.size(), -1);
  for (std::size_t k = 0; k < label.size(); k++) {
    const auto at = node_of_label.find(label[k]);
    if (at == node_of_label.end()) continue;
    (*own)[k] = at->second;
    found[k]  = 1;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, found.data(), (PetscMPIInt)found.size(), MPI_INT, MPI_SUM, model.comm));
  for (std::size_t k = 0; k < label.size(); k++)
    PetscCheck(found[k], model.comm, PETSC_ERR_ARG_WRONG, "%s: the model has no node %" PetscInt_FMT, who.c_str(), label[k]);
  PetscFunctionReturn(0);
}

PetscErrorCode ResolveKeptNodes(const FeModel &model, const Reduction &reduction, KeptNodes *kept)
{
  std::vector<PetscInt> own, mine, node;

  PetscFunctionBegin;
  PetscCall(FindLabels(model, reduction.nodes, "Reduction::nodes", &own));
  mine = reduction.nodes;
  for (const std::string &set : reduction.node_sets) {
    PetscCall(OwnNodesOf(model, set, "Nodes to be kept", &node));
    for (PetscInt i : node) mine.push_back(NodeLabel(model, i));
  }
  PetscCall(GatherAll(model.comm, mine, &kept->label));
  std::sort(kept->label.begin(), kept->label.end());
  kept->label.erase(std::unique(kept->label.begin(), kept->label.end()), kept->label.end());
  PetscCall(FindLabels(model, kept->label, "Nodes to be kept", &kept->own));
  PetscFunctionReturn(0);
}

PetscErrorCode FillNodes(const FeModel &model, const KeptNodes &kept, const MatrixXd &x, ModalBody *body)
{
  const Eigen::Index     n = (Eigen::Index)kept.label.size();
  std::vector<Neighbour> near;
  MatrixXd               place = MatrixXd::Zero(3, n), center = MatrixXd::Zero(4, n), J = MatrixXd::Zero(9, n), motion = MatrixXd::Zero(6 * n, x.cols());

  PetscFunctionBegin;
  body->nodes.clear();
  if (!n) PetscFunctionReturn(0);
  PetscCall(Neighbours(model, kept, &near));
  near.erase(std::remove_if(near.begin(), near.end(), [&](const Neighbour &i) { return i.node < model.first || i.node >= model.first + model.own; }), near.end());
  for (const Neighbour &i : near) center.col(i.kept) += Eigen::Vector4d(1, 0, 0, 0) + (Eigen::Vector4d() << 0, NodePosition(model, i.node - model.first)).finished();
  PetscCall(SumOverRanks(model.comm, &center));
  const auto arm = [&](const Neighbour &i) { return Vector3(NodePosition(model, i.node - model.first) - center.col(i.kept).tail<3>() / center(0, i.kept)); };
  for (const Neighbour &i : near) {
    const Vector3 r = arm(i);
    Eigen::Map<Matrix3>(J.col(i.kept).data()) += r.squaredNorm() * Matrix3::Identity() - r * r.transpose();
  }
  PetscCall(SumOverRanks(model.comm, &J));
  body->nodes.resize(n);
  std::vector<Matrix3> inverse(n, Matrix3::Zero());
  for (Eigen::Index k = 0; k < n; k++) {
    const Matrix3 moments = Eigen::Map<const Matrix3>(J.col(k).data());
    const Vector3 values  = SymmetricEigen(moments).values;
    ModalNode    &node    = body->nodes[k];
    node.label            = kept.label[k];
    node.turns            = values[0] > collinear_neighbours * values[2];
    if (node.turns) inverse[k] = moments.inverse();
    if (kept.own[k] < 0) continue;
    place.col(k)                 = NodePosition(model, kept.own[k]);
    motion.middleRows<3>(6 * k) = x.middleRows<3>(3 * kept.own[k]);
  }
  for (const Neighbour &i : near) motion.middleRows<3>(6 * i.kept + 3).noalias() += (inverse[i.kept] * Cross(arm(i))) * x.middleRows<3>(3 * (i.node - model.first));
  PetscCall(SumOverRanks(model.comm, &place));
  PetscCall(SumOverRanks(model.comm, &motion));
  for (Eigen::Index k = 0; k < n; k++) {
    body->nodes[k].position    = place.col(k);
    body->nodes[k].translation = motion.middleRows<3>(6 * k);
    body->nodes[k].rotation    = motion.middleRows<3>(6 * k + 3);
  }
  PetscFunctionReturn(0);
}

} // namespace hhtdae
