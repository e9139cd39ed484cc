/* The directory of a mesh's nodes; see mesh_nodes.h. */
#include "flexible/mesh_nodes.h"
#include "flexible/exchange.h"
#include <algorithm>

namespace hhtdae
{

int MeshNodes::rankOf(PetscInt index) const
{
  return (int)(std::upper_bound(offset_.begin(), offset_.end(), index) - offset_.begin()) - 1;
}

PetscErrorCode MeshNodes::build(const std::string &file, MeshFile *mesh)
{
  PetscMPIInt size;
  PetscInt    largest = 0, all;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm_, &size));
  for (const MeshPoint &p : mesh->points) largest = std::max(largest, p.tag);
  PetscCallMPI(MPI_Allreduce(&largest, &all, 1, MPIU_INT, MPI_MAX, comm_));
  const PetscInt64 range = all / size + (PetscInt64)1; /* rank r stores the numbers from r range to (r + 1) range - 1 */
  PetscCall(collect(file, mesh, range));
  PetscCall(resolve(file, mesh, range));
  PetscCall(keepMembers(mesh));
  PetscFunctionReturn(0);
}

PetscErrorCode MeshNodes::collect(const std::string &file, MeshFile *mesh, PetscInt64 range)
{
  PetscMPIInt              size;
  std::vector<std::size_t> from;
  std::string              problem;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm_, &size));
  {
    std::vector<std::vector<MeshPoint>> out(size);
    for (const MeshPoint &p : mesh->points) out[p.tag / range].push_back(p);
    std::vector<MeshPoint>().swap(mesh->points);
    PetscCall(Exchange(comm_, out, &points_, &from));
  }
  std::sort(points_.begin(), points_.end(), [](const MeshPoint &a, const MeshPoint &b) { return a.tag < b.tag; });
  for (std::size_t k = 1; k < points_.size() && problem.empty(); k++)
    if (points_[k].tag == points_[k - 1].tag)
      problem = "mesh " + file + ": node " + std::to_string(points_[k].tag) + " is there twice";
  PetscCall(Agree(comm_, problem));
  std::vector<PetscInt> counts;
  PetscCall(GatherAll(comm_, std::vector<PetscInt>{(PetscInt)points_.size()}, &counts));
  offset_.assign(size + 1, 0);
  for (int r = 0; r < size; r++) offset_[r + 1] = offset_[r] + counts[r];
  PetscFunctionReturn(0);
}

PetscErrorCode MeshNodes::resolve(const std::string &file, MeshFile *mesh, PetscInt64 range) const
{
  PetscMPIInt           size, rank;
  std::vector<PetscInt> tags;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm_, &size));
  PetscCallMPI(MPI_Comm_rank(comm_, &rank));
  for (const MeshCell &c : mesh->cells) tags.insert(tags.end(), c.node, c.node + FeNodes(c.type));
  for (const MeshMember &m : mesh->members) tags.push_back(m.node);
  std::sort(tags.begin(), tags.end());
  tags.erase(std::unique(tags.begin(), tags.end()), tags.end());

  std::vector<std::vector<PetscInt>> out(size);
  std::vector<PetscInt>              asked, index, answer;
  std::vector<std::size_t>           from, place;
  std::string                        problem;
  for (PetscInt t : tags) {
    const bool known = t >= 1 && t / range < size;
    if (!known)
      problem = "mesh " + file + ": an element has the node " + std::to_string(t) + ", which is not among $Nodes";
    out[known ? t / range : 0].push_back(t); /* tags are sorted, so that answers in rank order are in the order of the tags */
  }
  PetscCall(Agree(comm_, problem));
  PetscCall(Exchange(comm_, out, &asked, &from));
  for (PetscInt t : asked) {
    const auto at = std::lower_bound(points_.begin(), points_.end(), t,
                                     [](const MeshPoint &p, PetscInt tag) { return p.tag < tag; });
    if (at == points_.end() || at->tag != t)
      problem = "mesh " + file + ": an element has the node " + std::to_string(t) + ", which is not among $Nodes";
    answer.push_back(offset_[rank] + (PetscInt)(at - points_.begin()));
  }
  PetscCall(Agree(comm_, problem));
  PetscCall(Answer(comm_, answer, from, &index, &place));
  const auto replace = [&](PetscInt &node) {
    node = index[std::lower_bound(tags.begin(), tags.end(), node) - tags.begin()];
  };
  for (MeshCell &c : mesh->cells)
    for (int i = 0; i < FeNodes(c.type); i++) replace(c.node[i]);
  for (MeshMember &m : mesh->members) replace(m.node);
  PetscFunctionReturn(0);
}

PetscErrorCode MeshNodes::keepMembers(MeshFile *mesh)
{
  PetscMPIInt              size;
  std::vector<std::size_t> from;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm_, &size));
  std::vector<std::vector<MeshMember>> out(size);
  for (const MeshMember &m : mesh->members) out[rankOf(m.node)].push_back(m);
  std::vector<MeshMember>().swap(mesh->members);
  PetscCall(Exchange(comm_, out, &members_, &from));
  std::sort(members_.begin(), members_.end());
  members_.erase(std::unique(members_.begin(), members_.end()), members_.end());
  PetscFunctionReturn(0);
}

PetscErrorCode MeshNodes::ask(const std::vector<PetscInt> &index, std::vector<MeshPoint> *points,
                              std::vector<MeshMember> *regions) const
{
  PetscMPIInt                        size, rank;
  std::vector<PetscInt>              asked;
  std::vector<std::size_t>           from, place, unused;
  std::vector<std::vector<PetscInt>> back;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm_, &size));
  PetscCallMPI(MPI_Comm_rank(comm_, &rank));
  std::vector<std::vector<PetscInt>> out(size), slot(size); /* slot: positions in `index` */
  for (std::size_t k = 0; k < index.size(); k++) {
    const int r = rankOf(index[k]);
    out[r].push_back(index[k]);
    slot[r].push_back((PetscInt)k);
  }
  PetscCall(Exchange(comm_, out, &asked, &from));

  std::vector<MeshPoint> answer(asked.size()), got;
  for (std::size_t k = 0; k < asked.size(); k++) answer[k] = points_[asked[k] - offset_[rank]];
  PetscCall(Answer(comm_, answer, from, &got, &place));
  points->resize(index.size());
  for (int r = 0; r < size; r++)
    for (std::size_t k = 0; k < slot[r].size(); k++) (*points)[slot[r][k]] = got[place[r] + k];

  std::vector<std::vector<MeshMember>> memberships(size);
  for (int r = 0; r < size; r++)
    for (std::size_t k = from[r]; k < from[r + 1]; k++) {
      auto at = std::lower_bound(members_.begin(), members_.end(), MeshMember{asked[k], 0});
      for (; at != members_.end() && at->node == asked[k]; ++at)
        memberships[r].push_back({(PetscInt)(k - from[r]), at->region});
    }
  PetscCall(Exchange(comm_, memberships, regions, &place));
  for (int r = 0; r < size; r++)
    for (std::size_t k = place[r]; k < place[r + 1]; k++) (*regions)[k].node = slot[r][(*regions)[k].node];
  PetscFunctionReturn(0);
}

} // namespace hhtdae
