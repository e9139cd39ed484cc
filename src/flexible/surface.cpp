/*
  The surface of a reduced body's mesh, for the page of a scene: faces that belong to one element only, as triangles between their corners. It is
  assembled on the first rank, to which the others send their elements and their nodes' rows.
*/
#include "flexible/surface.h"
#include "flexible/body_name.h"
#include "flexible/element_shapes.h"
#include "flexible/exchange.h"
#include <algorithm>
#include <array>

namespace hhtdae
{

namespace
{

struct Face {
  std::array<PetscInt, 4> key, corner; /* key: sorted corners, equal for both elements at the face; corner: counter-clockwise from outside, the first one repeated for triangles */
  bool                    operator<(const Face &f) const { return key < f.key; }
};

std::vector<Face> OuterFaces(const std::vector<FeElement> &elements)
{
  std::vector<Face> all, outer;
  for (const FeElement &e : elements)
    fe::WithShape(e.type, [&](auto shape) {
      for (const auto &of : shape.face) {
        Face face;
        for (int k = 0; k < 4; k++) face.corner[k] = e.node[of[k % shape.perface]];
        face.key = face.corner;
        std::sort(face.key.begin(), face.key.begin() + shape.perface);
        if (shape.perface == 3) face.key[3] = -1;
        all.push_back(face);
      }
    });
  std::sort(all.begin(), all.end());
  for (std::size_t k = 0; k < all.size();) {
    std::size_t next = k + 1;
    while (next < all.size() && all[next].key == all[k].key) next++;
    if (next == k + 1) outer.push_back(all[k]);
    k = next;
  }
  return outer;
}

/* Triangles by indices in `node`, the sorted nodes of the surface */
void Triangulate(const std::vector<Face> &faces, std::vector<PetscInt> *node, std::vector<int> *triangle)
{
  for (const Face &f : faces) node->insert(node->end(), f.corner.begin(), f.corner.end());
  std::sort(node->begin(), node->end());
  node->erase(std::unique(node->begin(), node->end()), node->end());
  const auto place = [&](PetscInt n) { return (int)(std::lower_bound(node->begin(), node->end(), n) - node->begin()); };
  for (const Face &f : faces) {
    for (int k : {0, 1, 2}) triangle->push_back(place(f.corner[k]));
    if (f.key[3] >= 0)
      for (int k : {0, 2, 3}) triangle->push_back(place(f.corner[k]));
  }
}

} // namespace

void OuterTriangles(const std::vector<FeElement> &elements, std::vector<PetscInt> *node, std::vector<int> *triangle)
{
  Triangulate(OuterFaces(elements), node, triangle);
}

namespace
{

/* Positions, modes and stress modes of this rank's nodes on the surface */
struct SurfaceRows {
  std::vector<double> point;
  std::vector<float>  shape, stress;
};

SurfaceRows OwnRows(const ReducedBody &b, const std::vector<PetscInt> &node)
{
  SurfaceRows r;
  const auto  begin = std::lower_bound(node.begin(), node.end(), b.first), end = std::lower_bound(node.begin(), node.end(), b.first + b.own);
  for (auto n = begin; n != end; ++n) {
    const PetscInt own = *n - b.first;
    r.point.insert(r.point.end(), &b.coordinates[3 * (std::size_t)own], &b.coordinates[3 * (std::size_t)own] + 3);
    for (int c = 0; c < 3; c++)
      for (Eigen::Index k = 0; k < b.shape.cols(); k++) r.shape.push_back((float)b.shape(3 * own + c, k));
    const auto at = std::lower_bound(b.stress.node.begin(), b.stress.node.end(), own);
    if (at == b.stress.node.end() || *at != own) continue;
    for (int c = 0; c < 6; c++)
      for (Eigen::Index k = 0; k < b.stress.values.cols(); k++) r.stress.push_back((float)b.stress.values(6 * (at - b.stress.node.begin()) + c, k));
  }
  return r;
}

using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

} // namespace

PetscErrorCode MakeSurface(const ReducedBody &body, Surface *surface)
{
  PetscMPIInt              rank;
  std::vector<FeElement>   elements;
  std::vector<std::size_t> of;
  std::vector<PetscInt>    node;
  std::vector<float>       shape, stress;
  PetscInt64               count[2] = {body.own, (PetscInt64)body.elements.size()};
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(body.comm, &rank));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 2, MPIU_INT64, MPI_SUM, body.comm));
  std::string       error;
  const std::string who = BodyName(body);
  if (!count[1]) error = who + " has no elements: its surface is not known";
  else if (!count[0] || body.coordinates.size() != 3 * (std::size_t)body.own || body.shape.rows() != 3 * body.own || body.shape.cols() != body.modal.modes())
    error = who + " has no modes at its nodes: it has to be reduced with all nodes for its surface to be shown";
  PetscCall(Agree(body.comm, error, PETSC_ERR_ARG_INCOMP));
  *surface = Surface();
  PetscCall(GatherTo0(body.comm, body.elements.data(), body.elements.size(), &elements, &of));
  if (!rank) OuterTriangles(elements, &node, &surface->triangle);
  PetscInt nodes = (PetscInt)node.size();
  PetscCallMPI(MPI_Bcast(&nodes, 1, MPIU_INT, 0, body.comm));
  node.resize(nodes);
  PetscCallMPI(MPI_Bcast(node.data(), (PetscMPIInt)nodes, MPIU_INT, 0, body.comm));
  const SurfaceRows own = OwnRows(body, node);
  PetscCall(GatherTo0(body.comm, own.point.data(), own.point.size(), &surface->point, &of));
  PetscCall(GatherTo0(body.comm, own.shape.data(), own.shape.size(), &shape, &of));
  PetscCall(GatherTo0(body.comm, own.stress.data(), own.stress.size(), &stress, &of));
  if (rank) PetscFunctionReturn(0);
  const Eigen::Index modes = body.modal.modes();
  surface->shape = Eigen::Map<const RowMajor>(shape.data(), 3 * nodes, modes);
  if (!stress.empty() && stress.size() == (std::size_t)(6 * nodes * modes)) surface->stress = Eigen::Map<const RowMajor>(stress.data(), 6 * nodes, modes);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
