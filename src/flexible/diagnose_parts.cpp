/* Checks that a model is connected: nodes are joined by couplings in K and by rigid attachments, across all ranks. */
#include "diagnose_nodes.h"
#include <algorithm>
#include <numeric>
#include <unordered_map>

namespace hhtdae
{

/* Union-find structure of own nodes and of the other ranks' nodes that are coupled to them */
class Parts
{
public:
  std::vector<PetscInt> ghosts; /* global numbers */

  explicit Parts(const FeModel &model) : model_(model), parent_(model.own)
  {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  PetscInt root(PetscInt i)
  {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(PetscInt i, PetscInt j)
  {
    i = root(i);
    j = root(j);
    if (i != j) parent_[std::max(i, j)] = std::min(i, j);
  }
  PetscInt place(PetscInt global)
  {
    if (global >= model_.first && global < model_.first + model_.own) return global - model_.first;
    const auto found = number_.emplace(global, (PetscInt)parent_.size());
    if (found.second) {
      ghosts.push_back(global);
      parent_.push_back(found.first->second);
    }
    return found.first->second;
  }
  PetscInt size() const { return (PetscInt)parent_.size(); }

private:
  const FeModel                         &model_;
  std::vector<PetscInt>                  parent_;
  std::unordered_map<PetscInt, PetscInt> number_;
};

static PetscErrorCode JoinNeighbours(const FeModel &model, const std::vector<Tied> &tied, Parts *parts)
{
  double             largest;
  PetscInt           n;
  const PetscInt    *cols;
  const PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(LargestEntry(model.comm, model.K, &largest));
  for (PetscInt row = 0; row < 3 * model.own; row++) {
    PetscCall(MatGetRow(model.K, 3 * model.first + row, &n, &cols, &v));
    for (PetscInt k = 0; k < n; k++)
      if (std::abs(v[k]) > coupling_tolerance * largest) parts->join(row / 3, parts->place(cols[k] / 3));
    PetscCall(MatRestoreRow(model.K, 3 * model.first + row, &n, &cols, &v));
  }
  for (const Tied &t : tied)
    if (t.tie == Tie::Rigid)
      for (PetscInt i : t.node) parts->join(t.node[0], i);
  PetscFunctionReturn(0);
}

/* Finds for each node the least global number in its part, by exchange between ranks until nothing changes */
static PetscErrorCode PropagateLeast(const FeModel &model, const std::vector<Tied> &tied, Parts *parts,
                                     std::vector<double> *least)
{
  Vec                 x, local;
  PetscScalar        *v;
  std::vector<double> link(tied.size());
  int                 changed = 1;

  PetscFunctionBegin;
  PetscCall(
      VecCreateGhost(model.comm, model.own, PETSC_DETERMINE, (PetscInt)parts->ghosts.size(), parts->ghosts.data(), &x));
  least->resize(parts->size());
  for (PetscInt i = 0; i < parts->size(); i++)
    (*least)[i] = (double)(i < model.own ? model.first + i : parts->ghosts[i - model.own]);
  while (changed) {
    changed   = 0;
    auto take = [&](PetscInt i, double value) {
      double &mine = (*least)[parts->root(i)];
      if (value < mine) {
        mine    = value;
        changed = 1;
      }
    };
    for (PetscInt i = 0; i < parts->size(); i++) take(i, (*least)[i]);
    for (std::size_t a = 0; a < tied.size(); a++)
      link[a] = tied[a].tie == Tie::Rigid && !tied[a].node.empty() ? (*least)[parts->root(tied[a].node[0])]
                                                                   : (double)model.nodes;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, link.data(), (PetscMPIInt)link.size(), MPI_DOUBLE, MPI_MIN, model.comm));
    for (std::size_t a = 0; a < tied.size(); a++)
      if (tied[a].tie == Tie::Rigid && !tied[a].node.empty()) take(tied[a].node[0], link[a]);
    PetscCall(VecGhostGetLocalForm(x, &local));
    PetscCall(VecGetArray(local, &v));
    for (PetscInt i = 0; i < parts->size(); i++) v[i] = (*least)[parts->root(i)];
    PetscCall(VecRestoreArray(local, &v));
    /* minimum over the ghosts to the owner, then the owner's value to the ghosts */
    PetscCall(VecGhostUpdateBegin(x, MIN_VALUES, SCATTER_REVERSE));
    PetscCall(VecGhostUpdateEnd(x, MIN_VALUES, SCATTER_REVERSE));
    PetscCall(VecGhostUpdateBegin(x, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecGhostUpdateEnd(x, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecGetArray(local, &v));
    for (PetscInt i = 0; i < parts->size(); i++) take(i, v[i]);
    PetscCall(VecRestoreArray(local, &v));
    PetscCall(VecGhostRestoreLocalForm(x, &local));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT, MPI_MAX, model.comm));
  }
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(0);
}

/* Numbers of nodes of the parts whose least nodes are `start` */
static PetscErrorCode PartSizes(const FeModel &model, Parts *parts, const std::vector<double> &least,
                                const std::vector<NodeValue> &start, std::vector<PetscInt> *size)
{
  PetscFunctionBegin;
  size->assign(start.size(), 0);
  for (PetscInt i = 0; i < model.own; i++)
    for (std::size_t k = 0; k < start.size(); k++)
      if (least[parts->root(i)] == (double)model.nodes - start[k].value) (*size)[k]++;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, size->data(), (PetscMPIInt)size->size(), MPIU_INT, MPI_SUM, model.comm));
  PetscFunctionReturn(0);
}

PetscErrorCode DescribeParts(const FeModel &model, const std::vector<Tied> &tied, std::string *text)
{
  Parts                  parts(model);
  std::vector<double>    least;
  std::vector<NodeValue> mine, first;
  std::vector<PetscInt>  size;
  PetscInt               count;

  PetscFunctionBegin;
  text->clear();
  PetscCall(JoinNeighbours(model, tied, &parts));
  PetscCall(PropagateLeast(model, tied, &parts, &least));
  for (PetscInt i = 0; i < model.own; i++)
    if (least[parts.root(i)] == (double)(model.first + i))
      mine.push_back({(double)(model.nodes - model.first - i), NodeLabel(model, i)});
  count = (PetscInt)mine.size();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPIU_INT, MPI_SUM, model.comm));
  if (count == 1) PetscFunctionReturn(0);
  PetscCall(Highest(model.comm, mine, &first));
  PetscCall(PartSizes(model, &parts, least, first, &size));
  *text = std::to_string(count) + " parts that nothing holds together: ";
  for (std::size_t k = 0; k < first.size(); k++)
    *text += (k ? "; " : "") + std::to_string(size[k]) + " nodes with node " + std::to_string(first[k].label);
  if (count > (PetscInt)first.size()) *text += "; ...";
  PetscFunctionReturn(0);
}

PetscErrorCode CheckConnected(const FeModel &model, const std::vector<Tied> &tied)
{
  std::string parts;
  PetscFunctionBegin;
  PetscCall(DescribeParts(model, tied, &parts));
  PetscCheck(parts.empty(), model.comm, PETSC_ERR_ARG_WRONG,
             "The FE model falls into %s; join them (coincident nodes that were not merged?), or reduce them as separate bodies", parts.c_str());
  PetscFunctionReturn(0);
}

} // namespace hhtdae
