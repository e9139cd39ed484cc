/* Selects nodes of all ranks to be named in messages, and raises errors that name them. */
#include "diagnose_nodes.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

static bool IsHigher(const NodeValue &a, const NodeValue &b)
{
  return a.value > b.value || (a.value == b.value && a.label < b.label);
}

constexpr int max_named_nodes = 5;

PetscErrorCode Highest(MPI_Comm comm, std::vector<NodeValue> mine, std::vector<NodeValue> *all)
{
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  std::sort(mine.begin(), mine.end(), IsHigher);
  mine.resize(max_named_nodes, {-1, -1});
  all->resize(size * max_named_nodes);
  PetscCallMPI(MPI_Allgather(mine.data(), max_named_nodes * sizeof(NodeValue), MPI_BYTE, all->data(),
                             max_named_nodes * sizeof(NodeValue), MPI_BYTE, comm));
  std::sort(all->begin(), all->end(), IsHigher);
  all->resize(max_named_nodes);
  while (!all->empty() && all->back().value < 0) all->pop_back();
  PetscFunctionReturn(0);
}

static std::string List(const std::vector<NodeValue> &nodes)
{
  std::string text;
  for (std::size_t i = 0; i < nodes.size(); i++) {
    if (i) text += i + 1 == nodes.size() ? " and " : ", ";
    text += std::to_string(nodes[i].label);
  }
  return text;
}

PetscErrorCode NameNodes(const FeModel &model, const std::vector<PetscInt> &bad, PetscInt *count, std::string *labels)
{
  std::vector<NodeValue> mine, all;
  PetscInt               n = (PetscInt)bad.size();

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(&n, count, 1, MPIU_INT, MPI_SUM, model.comm));
  for (PetscInt i : bad) mine.push_back({1, NodeLabel(model, i)});
  PetscCall(Highest(model.comm, mine, &all));
  *labels = List(all);
  if (*count > (PetscInt)all.size()) *labels += " ...";
  PetscFunctionReturn(0);
}

PetscErrorCode MostMoved(const FeModel &model, const Eigen::VectorXd &u, std::string *labels)
{
  std::vector<NodeValue> mine, all;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < model.own; i++) mine.push_back({u.segment<3>(3 * i).norm(), NodeLabel(model, i)});
  PetscCall(Highest(model.comm, mine, &all));
  /* nodes that hardly move do not belong to the mechanism */
  while (!all.empty() && all.back().value < 1e-3 * all.front().value) all.pop_back();
  *labels = List(all);
  PetscFunctionReturn(0);
}

PetscErrorCode MechanismError(const FeModel &model, const Eigen::VectorXd &u, const char where[])
{
  std::string labels;

  PetscFunctionBegin;
  PetscCall(MostMoved(model, u, &labels));
  SETERRQ(model.comm, PETSC_ERR_MAT_LU_ZRPVT,
          "The FE model has a mechanism: %s is singular beyond rigid-body motions. It moves without stiffness most at "
          "node(s) %s; look there for "
          "elements that hang on a node or an edge, are missing, or have reduced integration (C3D8R)",
          where, labels.c_str());
}

PetscErrorCode LargestEntry(MPI_Comm comm, Mat A, double *largest)
{
  PetscInt           begin, end, n;
  const PetscScalar *v;

  PetscFunctionBegin;
  *largest = 0;
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  for (PetscInt i = begin; i < end; i++) {
    PetscCall(MatGetRow(A, i, &n, nullptr, &v));
    for (PetscInt k = 0; k < n; k++) *largest = std::max(*largest, std::abs(v[k]));
    PetscCall(MatRestoreRow(A, i, &n, nullptr, &v));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, largest, 1, MPI_DOUBLE, MPI_MAX, comm));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
