#include "scene/output/mesh.h"
#include "scene/symmetric.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

namespace
{

constexpr int around = 24, rings = 12; /* numbers of facets: around the axis of cylinders and spheres, and along the axis of spheres */

/* Adds points of a shape, given in the axes of the shape, and cells between them */
class Builder
{
public:
  Builder(Mesh &m, PetscInt body, const Vector3 &origin, const Matrix3 &axes)
      : mesh_(m), body_(body), origin_(origin), axes_(axes), first_((PetscInt)m.point.size())
  {
  }
  void point(double x, double y, double z) { mesh_.point.push_back({body_, origin_ + axes_ * Vector3(x, y, z)}); }
  void polygon(std::initializer_list<PetscInt> corners) { cell(mesh_.polygons, corners.begin(), corners.end()); }
  void polygon(const std::vector<PetscInt> &corners) { cell(mesh_.polygons, corners.begin(), corners.end()); }
  void line(std::initializer_list<PetscInt> ends) { cell(mesh_.lines, ends.begin(), ends.end()); }

private:
  Mesh    &mesh_;
  PetscInt body_;
  Vector3  origin_;
  Matrix3  axes_;
  PetscInt first_;

  template <class I> void cell(Mesh::Cells &cells, I begin, I end)
  {
    for (; begin != end; ++begin) cells.point.push_back(first_ + *begin);
    cells.close(body_);
  }
};

void Box(Builder &b, const Vector3 &h)
{
  for (int k = 0; k < 8; k++) b.point(k & 1 ? h(0) : -h(0), k & 2 ? h(1) : -h(1), k & 4 ? h(2) : -h(2));
  b.polygon({0, 2, 3, 1});
  b.polygon({4, 5, 7, 6});
  b.polygon({0, 1, 5, 4});
  b.polygon({2, 6, 7, 3});
  b.polygon({0, 4, 6, 2});
  b.polygon({1, 3, 7, 5});
}

void Cylinder(Builder &b, const Vector3 &h)
{
  std::vector<PetscInt> bottom, top;
  for (int k = 0; k < around; k++) {
    const double a = 2 * M_PI * k / around;
    b.point(h(0) * std::cos(a), h(1) * std::sin(a), -h(2));
    b.point(h(0) * std::cos(a), h(1) * std::sin(a), h(2));
    const PetscInt next = (k + 1) % around;
    b.polygon({2 * k, 2 * next, 2 * next + 1, 2 * k + 1});
    bottom.insert(bottom.begin(), 2 * k);
    top.push_back(2 * k + 1);
  }
  b.polygon(bottom);
  b.polygon(top);
}

void Sphere(Builder &b, const Vector3 &h)
{
  b.point(0, 0, -h(2));
  for (int r = 1; r < rings; r++)
    for (int k = 0; k < around; k++) {
      const double a = 2 * M_PI * k / around, c = M_PI * r / rings;
      b.point(h(0) * std::sin(c) * std::cos(a), h(1) * std::sin(c) * std::sin(a), -h(2) * std::cos(c));
    }
  b.point(0, 0, h(2));
  const PetscInt top = 1 + (rings - 1) * around, last = 1 + (rings - 2) * around;
  for (PetscInt k = 0; k < around; k++) {
    const PetscInt n = (k + 1) % around;
    b.polygon({0, 1 + n, 1 + k});
    b.polygon({last + k, last + n, top});
    for (PetscInt r = 1; r < last; r += around) b.polygon({r + k, r + n, r + around + n, r + around + k});
  }
}

void Octahedron(Builder &b, const Vector3 &h)
{
  for (int k = 0; k < 3; k++)
    for (int sign : {-1, 1}) b.point(k == 0 ? sign * h(0) : 0, k == 1 ? sign * h(1) : 0, k == 2 ? sign * h(2) : 0);
  for (PetscInt x : {0, 1})
    for (PetscInt y : {2, 3})
      for (PetscInt z : {4, 5}) {
        if ((x + y + z) % 2) b.polygon({x, y, z});
        else b.polygon({x, z, y});
      }
}

/* A length of the scene, in proportion to which bodies without extent are drawn */
double Size(const SceneData &s)
{
  if (s.bodies.empty()) return 1;
  Vector3 low = s.bodies[0].r, high = low;
  for (const BodyData &b : s.bodies) {
    low  = low.cwiseMin(b.r);
    high = high.cwiseMax(b.r);
  }
  for (std::size_t m = 0; m < s.ownMarkers(); m++) {
    if (s.markers[m].body < -1) continue;
    const Vector3 x = s.frame(Marker{(PetscInt)m}).x;
    low             = low.cwiseMin(x);
    high            = high.cwiseMax(x);
  }
  const double size = (high - low).norm();
  return size > 0 ? size : 1;
}

/* Adds the default shape of a body. Its semiaxes a_k are those of the solid ellipsoid with the same mass and moments of
   inertia, I_1 = m (a_2^2 + a_3^2)/5 */
void Default(Mesh &m, const SceneData &s, PetscInt id, const std::vector<PetscInt> &markers, double size)
{
  const BodyData &b    = s.bodies[id];
  Vector3         semi = Vector3::Constant(0.02 * size);
  Matrix3         axes = Matrix3::Identity();
  if (!b.point && !s.planar && b.mass > 0) {
    const SymmetricEigen principal(b.inertia);
    const Vector3        I = principal.values;
    for (int k = 0; k < 3; k++) semi(k) = std::max(0.005 * size, std::sqrt(std::max(0.0, 2.5 * (I.sum() - 2 * I(k)) / b.mass)));
    axes = principal.vectors;
    if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  }
  Builder octahedron(m, id, Vector3::Zero(), axes);
  Octahedron(octahedron, semi);
  Builder  rays(m, id, Vector3::Zero(), Matrix3::Identity());
  PetscInt n = 0;
  rays.point(0, 0, 0);
  for (PetscInt k : markers) {
    const Vector3 &x = s.markers[k].s;
    if (x.norm() < 1e-6 * size) continue;
    rays.point(x(0), x(1), x(2));
    rays.line({0, ++n});
  }
}

} // namespace

Mesh MakeMesh(const SceneData &s)
{
  Mesh                               m;
  std::vector<char>                  has(s.bodies.size(), 0);
  std::vector<std::vector<PetscInt>> markers(s.bodies.size());
  for (const ShapeData &d : s.shapes) {
    if (d.body >= 0) has[d.body] = 1;
    const Vector3 origin = d.body < 0 ? d.shape.position : Vector3(d.shape.position - s.bodies[d.body].center);
    Builder       b(m, d.body, origin, d.shape.axes);
    if (d.shape.kind == Shape::Box) Box(b, d.shape.size);
    else if (d.shape.kind == Shape::Cylinder) Cylinder(b, d.shape.size);
    else Sphere(b, d.shape.size);
  }
  for (const std::vector<PetscInt> &line : s.lines) {
    for (PetscInt k : line) {
      m.lines.point.push_back((PetscInt)m.point.size());
      m.point.push_back({s.markers[k].body, s.markers[k].s});
    }
    m.lines.close(s.markers[line[0]].body);
  }
  const double size = Size(s);
  for (std::size_t k = 0; k < s.ownMarkers(); k++)
    if (s.markers[k].body >= 0) markers[s.markers[k].body].push_back((PetscInt)k);
  for (std::size_t b = 0; b < s.bodies.size(); b++)
    if (!has[b]) Default(m, s, (PetscInt)b, markers[b], size);
  return m;
}

} // namespace hhtdae
