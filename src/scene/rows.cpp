/* All rows of constraints of a scene at the described poses, and the lengths relative to which their violations are measured. */
#include "start.h"
#include <algorithm>
#include <numeric>

namespace hhtdae
{

const std::vector<int> &Directions(BodyKind k)
{
  static const std::vector<int> none, point = {0, 1, 2}, rigid = {0, 1, 2, 3, 4, 5}, planar = {0, 1, 5},
                                      planar_point = {0, 1};
  switch (k) {
  case BodyKind::Point:
    return point;
  case BodyKind::Rigid:
  case BodyKind::Flexible:
    return rigid;
  case BodyKind::Planar:
    return planar;
  case BodyKind::PlanarPoint:
    return planar_point;
  default:
    return none;
  }
}

namespace
{

void AddColumns(const SceneData &s, RowBlock &b, const DescribedRows &d, int k, PetscInt marker, ModalColumns modes)
{
  const MarkerData &m  = s.markers[marker];
  const std::size_t at = std::find(b.body.begin(), b.body.end(), m.body) - b.body.begin();
  if (at == b.body.size()) return; /* the body is fixed */
  const BodyData         &body      = s.bodies[m.body];
  const Vector3           lever     = body.A * m.s;
  const std::vector<int> &direction = Directions(KindOf(s, body));
  for (int r = 0; r < b.rows; r++) {
    const Vector3 x = d.J.block<1, 3>(r, 6 * k).transpose(), theta = d.J.block<1, 3>(r, 6 * k + 3).transpose();
    Eigen::Matrix<double, 6, 1> full;
    full << x, theta + lever.cross(x); /* dx = dr + dtheta x lever */
    for (std::size_t c = 0; c < direction.size(); c++) b.J(r, b.column[at] + (int)c) += full(direction[c]);
  }
  if (k == 0 && modes == ModalColumns::Included && d.modal.size())
    b.J.middleCols(b.column[at] + (int)direction.size(), d.modal.cols()) += d.modal;
}

bool IsFixed(FixedBodies fixed_bodies, const BodyData &b)
{
  const bool of_nodes = b.massless && b.carrier < 0;
  return b.fixed_start && (fixed_bodies == FixedBodies::FixedStart || (fixed_bodies == FixedBodies::Nodes && of_nodes));
}

/* Sets the movable bodies of an instance, and their first columns, in b */
void FindBodies(const SceneData &s, const StoreBase &store, PetscInt e, FixedBodies fixed_bodies, ModalColumns modes, RowBlock &b)
{
  int columns = 0;
  for (int k = 0; k < store.markers(); k++) {
    const PetscInt id = s.markers[store.marker(e, k)].body;
    if (id < 0 || IsFixed(fixed_bodies, s.bodies[id])) continue;
    if (std::find(b.body.begin(), b.body.end(), id) != b.body.end()) continue;
    b.body.push_back(id);
    b.column.push_back(columns);
    columns += modes == ModalColumns::Included ? Width(s, id) : (int)Directions(KindOf(s, s.bodies[id])).size();
  }
  b.column.push_back(columns);
}

/* b.speed = Phi_q q' + Phi_t, summed over all bodies, including those that must not be moved */
void Speeds(const SceneData &s, const DescribedRows &d, RowBlock &b)
{
  b.speed = b.rate;
  for (int k = 0; k < b.store->markers(); k++) {
    const Twist<double> w = s.twist(Marker{b.store->marker(b.instance, k)});
    for (int r = 0; r < b.rows; r++)
      b.speed(r) += d.J.block<1, 3>(r, 6 * k).dot(w.v) + d.J.block<1, 3>(r, 6 * k + 3).dot(w.w);
  }
  if (!d.modal.size()) return;
  const std::vector<double> &rate = s.bodies[s.markers[b.store->marker(b.instance, 0)].body].flexible->deformation_rate;
  b.speed += d.modal * Eigen::Map<const Eigen::VectorXd>(rate.data(), rate.size());
}

} // namespace

int Width(const SceneData &s, PetscInt b)
{
  const BodyData &body = s.bodies[b];
  return (int)Directions(KindOf(s, body)).size() + (body.flexible ? (int)body.flexible->model->modes() : 0);
}

std::vector<RowBlock> DescribeAll(const SceneData &s, double t, FixedBodies fixed_bodies, ModalColumns modes)
{
  std::vector<RowBlock> all;
  DescribedRows         d;
  for (std::size_t element = 0; element < s.elements.size(); element++) {
    int first = 0;
    for (const Part &p : s.elements[element].parts) {
      if (!p.store->isConstraint()) continue;
      RowBlock b;
      b.store     = p.store;
      b.instance  = p.index;
      b.element   = (PetscInt)element;
      b.first     = first;
      b.rows      = p.store->rows();
      b.active    = p.store->active(p.index);
      b.holonomic = p.store->isHolonomic();
      first += b.rows;
      d.modal.resize(0, 0);
      p.store->describe(s, p.index, t, d);
      b.name   = d.name;
      b.length = d.length;
      b.value  = Eigen::Map<const Eigen::VectorXd>(d.value, b.rows);
      b.rate   = Eigen::Map<const Eigen::VectorXd>(d.rate, b.rows);
      FindBodies(s, *p.store, p.index, fixed_bodies, modes, b);
      b.J.setZero(b.rows, b.column.back());
      for (int k = 0; k < p.store->markers(); k++) AddColumns(s, b, d, k, p.store->marker(p.index, k), modes);
      for (int r = 0; r < b.rows; r++)
        if (!b.has(r)) b.J.row(r).setZero();
      Speeds(s, d, b);
      all.push_back(std::move(b));
    }
  }
  return all;
}

double SceneSize(const SceneData &s)
{
  Eigen::AlignedBox3d box;
  for (const BodyData &b : s.bodies) box.extend(b.r);
  for (std::size_t m = 0; m < s.ownMarkers(); m++)
    if (s.markers[m].body >= -1) box.extend(s.frame(Marker{(PetscInt)m}).x);
  const double size = box.isEmpty() ? 0 : box.diagonal().norm();
  return size > 0 ? size : 1;
}

/* Unlike SceneSize() this excludes bodies without joints and markers used only for measures, which may be far away and
   would weaken the check of joints (SceneAssembly.FarMarkersAndBodies). The size is at least 1e-5 of the largest distance
   from the origin, so that rounding of positions is below 1e-11 of the size. */
double MechanismSize(const SceneData &s, const std::vector<RowBlock> &blocks)
{
  std::vector<PetscInt>           root(s.bodies.size());
  std::vector<Eigen::AlignedBox3d> box(s.bodies.size());
  double                          size = 0, far = 0;
  bool                            deformable = false; /* a body is flexible and extends beyond its frame: its size is not known here */
  const auto                      rootOf = [&](PetscInt b) {
    while (root[b] != b) b = root[b] = root[root[b]];
    return b;
  };
  std::iota(root.begin(), root.end(), 0);
  for (const RowBlock &b : blocks)
    for (PetscInt k : b.body) root[rootOf(k)] = rootOf(b.body[0]);
  for (const RowBlock &b : blocks) {
    if (b.body.empty()) continue;
    Eigen::AlignedBox3d &all = box[rootOf(b.body[0])];
    for (PetscInt k : b.body) {
      all.extend(s.bodies[k].r);
      deformable |= s.bodies[k].flexible || s.bodies[k].massless;
    }
    for (int k = 0; k < b.store->markers(); k++) all.extend(s.frame(Marker{b.store->marker(b.instance, k)}).x);
  }
  for (const Eigen::AlignedBox3d &b : box) {
    if (b.isEmpty()) continue;
    size = std::max(size, b.diagonal().norm());
    far  = std::max({far, b.min().norm(), b.max().norm()});
  }
  const double scene = SceneSize(s);
  /* a body whose only joint is at its origin would have the size zero */
  return deformable || size < 1e-6 * scene ? scene : std::max(size, 1e-5 * far);
}

std::string RowName(const SceneData &s, PetscInt element, int row, const char *kernel)
{
  const ElementData &e     = s.elements[element];
  int                total = 0;
  for (const Part &p : e.parts)
    if (p.store->isConstraint()) total += p.store->rows();
  return std::string(e.type) + " " + e.name + ": row " + std::to_string(row + 1) + " of " + std::to_string(total) +
         " (" + kernel + ")";
}

} // namespace hhtdae
