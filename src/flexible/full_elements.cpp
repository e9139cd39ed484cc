/* A finite-element body with large displacements: M (x'' - g + a x') + internal force, summed over the elements with own nodes. */
#include "flexible/element.h"
#include "flexible/full_nodes.h"
#include "scene/runtime.h"
#include <algorithm>

namespace hhtdae
{

namespace
{

template <class Shape> class ElementBatch : public Batch
{
  static constexpr int n = Shape::nodes;

public:
  struct Instance {
    NodePlace              node[n];
    fe::NodeVectors<Shape> X; /* undeformed initial positions in space axes */
    fe::Mass<Shape>        mass;
    fe::Lame               lame;
    bool                   first; /* this is the first of the ranks with this element, which adds its energy */
  };
  std::vector<Instance> all;
  const FullExtension  &x;

  explicit ElementBatch(const FullExtension &e) : x(e) {}

  void pattern(Pattern &p) override
  {
    for (const Instance &e : all)
      for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) request_.push_back(p.need(e.node[i].group, e.node[j].group));
  }

  void residual(Evaluation &ev) override
  {
    for (const Instance &e : all) {
      fe::NodeVectors<Shape> u, a, f;
      const fe::NodeVectors<Shape> still = gather(ev.u, e) - e.X;
      u = still;
      a = (gather(ev.a, e) + x.spec.mass_damping * gather(ev.v, e)).colwise() - ev.bodies.gravity;
      fe::LargeForce<Shape>(e.X, u, e.lame, f);
      f.noalias() += a * e.mass;
      for (int i = 0; i < n; i++) AddRows(ev, e.node[i], f.col(i));
    }
  }

  void jacobian(Evaluation &ev) override
  {
    const double m = ev.sa + ev.sv * x.spec.mass_damping;
    const Slot  *slot = slot_.data();
    for (const Instance &e : all) {
      fe::NodeVectors<Shape> f;
      fe::Stiffness<Shape>   K;
      fe::LargeForce<Shape>(e.X, gather(ev.u, e) - e.X, e.lame, f, &K);
      for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
          Matrix3 B = K.template block<3, 3>(3 * i, 3 * j);
          B.diagonal().array() += m * e.mass(i, j);
          ev.sink.add(*slot++, B, 3, 3);
        }
    }
  }

  void addTo(Balance &B, const Evaluation &ev) const override
  {
    for (const Instance &e : all) {
      if (!e.first) continue;
      fe::NodeVectors<Shape>       f;
      double                       elastic;
      const fe::NodeVectors<Shape> u = gather(ev.u, e), v = gather(ev.v, e), p = v * e.mass;
      fe::LargeForce<Shape>(e.X, u - e.X, e.lame, f, nullptr, &elastic);
      B.elastic += elastic;
      B.kinetic += 0.5 * p.cwiseProduct(v).sum();
      B.gravity -= ev.bodies.gravity.dot(u * e.mass.rowwise().sum());
      B.linear += p.rowwise().sum();
      for (int i = 0; i < n; i++) B.angular += Vector3(u.col(i)).cross(Vector3(p.col(i)));
    }
  }

private:
  static fe::NodeVectors<Shape> gather(const double *u, const Instance &e)
  {
    fe::NodeVectors<Shape> y;
    for (int i = 0; i < n; i++) y.col(i) = At(u, e.node[i]);
    return y;
  }
};

template <class Shape>
void Localize(const FullExtension &x, ElementType type, PetscMPIInt rank, Localizer &l, std::vector<std::unique_ptr<Batch>> &batches)
{
  auto batch = std::make_unique<ElementBatch<Shape>>(x);
  for (const FeElement &e : x.elements) {
    if (e.type != type) continue;
    typename ElementBatch<Shape>::Instance i{{}, {}, {}, fe::Lame(x.model->materials[e.material]), false};
    PetscMPIInt first = rank;
    for (int k = 0; k < Shape::nodes; k++) {
      const std::size_t at = std::lower_bound(x.near.begin(), x.near.end(), e.node[k]) - x.near.begin();
      i.node[k]  = PlaceNode(x, l, e.node[k]);
      i.X.col(k) = Eigen::Map<const Vector3>(&x.near_x[3 * at]);
      first      = std::min(first, x.ownerOf(e.node[k]));
    }
    fe::ElementMass<Shape>(i.X, x.model->materials[e.material].density, i.mass);
    i.first = first == rank;
    batch->all.push_back(i);
  }
  if (!batch->all.empty()) batches.push_back(std::move(batch));
}

} // namespace

void LocalizeElements(const FullExtension &x, Localizer &l, std::vector<std::unique_ptr<Batch>> &batches)
{
  const PetscMPIInt rank = l.run->rank;
  Localize<fe::Tetrahedron4>(x, ElementType::Tetrahedron4, rank, l, batches);
  Localize<fe::Tetrahedron10>(x, ElementType::Tetrahedron10, rank, l, batches);
  Localize<fe::Brick8>(x, ElementType::Brick8, rank, l, batches);
  Localize<fe::Brick20>(x, ElementType::Brick20, rank, l, batches);
}

} // namespace hhtdae
