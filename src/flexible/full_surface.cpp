/* The surface of a whole finite-element body for the page of a run: positions of its nodes and von Mises stress there. */
#include "flexible/element.h"
#include "flexible/exchange.h"
#include "flexible/full_body.h"
#include "flexible/sides.h"
#include "flexible/surface.h"
#include "scene/output/page_mesh.h"
#include <algorithm>
#include <numeric>

namespace hhtdae
{

namespace
{

class FullMesh : public PageMesh
{
public:
  explicit FullMesh(const FullExtension &body) : x(body), part(body.model->comm) {}

  PetscErrorCode setUp(std::size_t most);
  PetscErrorCode values(const double *u, std::vector<double> &mine) override;

private:
  const FullExtension  &x;
  std::vector<PetscInt> own;  /* this rank's nodes of the surface, counted from its first node */
  FeModel               part; /* this rank's elements at these nodes, with the body's materials */
  ElementNodes          near; /* the nodes of these elements */
  std::vector<double>   X;    /* their undeformed positions in space axes */
  Sides                 sides;

  PetscErrorCode setUpStress(const std::vector<PetscInt> &node);
  PetscErrorCode vonMises(const double *u, std::vector<double> &mine) const;
  template <class Shape> void addStress(const FeElement &e, const std::vector<double> &now, std::vector<double> &sum) const;
};

/* Whether all elements have a material, as stress needs it */
bool HasMaterials(const FeModel &m)
{
  return !m.materials.empty() &&
         std::all_of(m.elements.begin(), m.elements.end(), [&](const FeElement &e) { return e.material >= 0 && e.material < (PetscInt)m.materials.size(); });
}

PetscErrorCode FullMesh::setUp(std::size_t most)
{
  const FeModel           &m = *x.model;
  std::vector<FeElement>   elements;
  std::vector<std::size_t> of, kept;
  std::vector<PetscInt>    node;
  std::vector<double>      mine;
  PetscMPIInt              rank, size;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(m.comm, &rank));
  PetscCallMPI(MPI_Comm_size(m.comm, &size));
  name = x.name;
  for (const TieNodes &t : x.ties) frames.push_back(t.frame);
  PetscCall(GatherTo0(m.comm, m.elements.data(), m.elements.size(), &elements, &of));
  if (!rank) OuterTriangles(elements, &node, &surface.triangle);
  const auto exchangeNodes = [&]() { /* sends the nodes from the first rank to all, and their positions back to it */
                                     PetscInt count = (PetscInt)node.size();
                                     PetscFunctionBegin;
                                     PetscCallMPI(MPI_Bcast(&count, 1, MPIU_INT, 0, m.comm));
                                     node.resize(count);
                                     PetscCallMPI(MPI_Bcast(node.data(), (PetscMPIInt)count, MPIU_INT, 0, m.comm));
                                     own.clear();
                                     mine.clear();
                                     for (auto n = std::lower_bound(node.begin(), node.end(), m.first); n != node.end() && *n < m.first + m.own; ++n) {
                                       const Vector3 p = x.placed(&m.coordinates[3 * (*n - m.first)]);
                                       own.push_back(*n - m.first);
                                       mine.insert(mine.end(), p.data(), p.data() + 3);
                                     }
                                     PetscCall(GatherTo0(m.comm, mine.data(), mine.size(), &surface.point, &of));
                                     PetscFunctionReturn(0);
  };
  PetscCall(exchangeNodes());
  const PetscInt all = (PetscInt)node.size();
  if (!rank) {
    ThinSurface(surface.point, most, &kept, &surface.triangle);
    for (std::size_t k = 0; k < kept.size(); k++) node[k] = node[kept[k]]; /* in place, because kept is sorted */
    node.resize(kept.size());
  }
  PetscCall(exchangeNodes());
  if ((PetscInt)node.size() < all)
    PetscCall(PetscInfo((PetscObject)nullptr, "scene: the page shows %" PetscInt_FMT " of the %" PetscInt_FMT " nodes on the surface of %s; -scene_page_nodes\n", (PetscInt)node.size(), all, name.c_str()));
  nodes.resize((std::size_t)size);
  const PetscMPIInt count = (PetscMPIInt)own.size();
  PetscCallMPI(MPI_Allgather(&count, 1, MPI_INT, nodes.data(), 1, MPI_INT, m.comm));
  PetscCall(setUpStress(node));
  PetscFunctionReturn(0);
}

PetscErrorCode FullMesh::setUpStress(const std::vector<PetscInt> &node)
{
  const FeModel &m             = *x.model;
  PetscMPIInt    has_materials = HasMaterials(m);
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &has_materials, 1, MPI_INT, MPI_LAND, m.comm));
  stress = has_materials;
  if (!stress) PetscFunctionReturn(0);
  for (const FeElement &e : m.elements)
    if (std::any_of(e.node, e.node + FeNodes(e.type), [&](PetscInt n) { return std::binary_search(node.begin(), node.end(), n); })) part.elements.push_back(e);
  part.own       = m.own;
  part.materials = m.materials;
  PetscCall(near.setUp(part));
  PetscCall(ChooseSides(part, near, &sides));
  std::vector<double> placed(3 * (std::size_t)m.own + 1);
  for (PetscInt n = 0; n < m.own; n++) {
    const Vector3 p = x.placed(&m.coordinates[3 * (std::size_t)n]);
    std::copy(p.data(), p.data() + 3, &placed[3 * (std::size_t)n]);
  }
  X.resize(3 * near.global.size() + 1);
  PetscCall(near.bring(3, placed.data(), X.data()));
  PetscFunctionReturn(0);
}

PetscErrorCode FullMesh::values(const double *u, std::vector<double> &mine)
{
  PetscFunctionBegin;
  for (PetscInt n : own) mine.insert(mine.end(), u + 3 * n, u + 3 * n + 3);
  if (stress) PetscCall(vonMises(u, mine));
  PetscFunctionReturn(0);
}

template <class Shape> void FullMesh::addStress(const FeElement &e, const std::vector<double> &now, std::vector<double> &sum) const
{
  PetscInt               place[Shape::nodes];
  fe::NodeVectors<Shape> rest, u;
  fe::NodeStress<Shape>  at;
  for (int i = 0; i < Shape::nodes; i++) {
    place[i]    = near.place(e.node[i]);
    rest.col(i) = Eigen::Map<const Eigen::Vector3d>(&X[3 * (std::size_t)place[i]]);
    u.col(i)    = Eigen::Map<const Eigen::Vector3d>(&now[3 * (std::size_t)place[i]]) - rest.col(i);
  }
  const fe::StressAtNodes<Shape> kernel(rest);
  const fe::Lame                 lame(part.materials[e.material]);
  if (x.spec.law == FeLaw::Large) kernel.large(u, lame, at);
  else kernel(u, lame, at);
  for (int i = 0; i < Shape::nodes; i++)
    if (sides.material[place[i]] == e.material) Eigen::Map<Eigen::Matrix<double, 6, 1>>(&sum[6 * (std::size_t)place[i]]) += at.col(i);
}

PetscErrorCode FullMesh::vonMises(const double *u, std::vector<double> &mine) const
{
  std::vector<double> now(3 * near.global.size() + 1), here(6 * near.global.size() + 1, 0), sum(6 * (std::size_t)part.own + 1, 0);
  PetscFunctionBegin;
  PetscCall(near.bring(3, u, now.data()));
  for (const FeElement &e : part.elements) fe::WithShape(e.type, [&](auto shape) { addStress<decltype(shape)>(e, now, here); });
  PetscCall(near.add(6, here.data(), sum.data()));
  for (PetscInt n : own) {
    const double *t = &sum[6 * (std::size_t)n], a = t[0] - t[1], b = t[1] - t[2], c = t[2] - t[0];
    mine.push_back(std::sqrt((a * a + b * b + c * c) / 2 + 3 * (t[3] * t[3] + t[4] * t[4] + t[5] * t[5])) / std::max(1., sides.count[n]));
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FullExtension::pageMesh(std::size_t most_nodes, std::unique_ptr<PageMesh> *mesh) const
{
  PetscInt64 count = (PetscInt64)model->elements.size();
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPIU_INT64, MPI_SUM, model->comm));
  if (!count) PetscFunctionReturn(0); /* a model of matrices only has no surface */
  auto made = std::make_unique<FullMesh>(*this);
  PetscCall(made->setUp(most_nodes));
  *mesh = std::move(made);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
