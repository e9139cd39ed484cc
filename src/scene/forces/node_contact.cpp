/* Contact of kept nodes of a flexible body, kernels/node_contact.h. */
#include "scene/kernels/node_contact.h"
#include "contact_requirements.h"
#include "scene/runtime.h"
#include <set>

namespace hhtdae
{

namespace
{

/* For measures: the resultant of the forces on all nodes with the moment about the body's centre of mass, and the load on
   the other body with the moment about its marker */
template <class Shape> class NodeContactProbe : public Probe
{
public:
  NodeContactProbe(PetscInt i, const typename NodeContactBatch<Shape>::Instance &e) : i_(i), e_(e) {}
  int      markers() const override { return 2; }
  PetscInt marker(int k) const override { return k ? e_.on.j : i_; }
  void     loads(const Evaluation &ev, Wrench<double> *on) const override
  {
    for (int k = 0; k < 2; k++) on[k] = {Vector3::Zero(), Vector3::Zero()};
    NodeContactBatch<Shape>::nearOnes(ev, e_, [&](const NodesOnBody::Ball &b) {
      Wrench<double> one[2];
      Contact<Shape>::wrench(e_.data, b.f, b.w, ev.t, nullptr, one);
      on[0].f += one[0].f;
      on[0].m += one[0].m + b.arm.cross(one[0].f);
      on[1].f += one[1].f;
      on[1].m += one[1].m;
    });
  }
  void components(const Evaluation &ev, double *c) const override
  {
    Wrench<double> on[2];
    loads(ev, on);
    for (int k = 0; k < 3; k++) c[k] = on[0].f(k);
  }

private:
  PetscInt                                   i_;
  typename NodeContactBatch<Shape>::Instance e_;
};

template <class Shape> class NodeContactStore : public StoreBase
{
public:
  struct Item {
    PetscInt                            element = -1, marker[2] = {-1, -1}; /* markers on the floating frame and of the other shape */
    std::shared_ptr<const ContactNodes> nodes;
    typename Contact<Shape>::Data       data;
  };
  std::vector<Item> all;

  PetscInt      size() const override { return (PetscInt)all.size(); }
  int           markers() const override { return 2; }
  PetscInt      marker(PetscInt e, int k) const override { return all[e].marker[k]; }
  PetscInt      element(PetscInt e) const override { return all[e].element; }
  int           rows() const override { return 3; }

  void localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const override
  {
    auto batch    = std::make_unique<NodeContactBatch<Shape>>();
    batch->bodies = l.bodies;
    for (PetscInt e = 0; e < size(); e++)
      if (l.needed(*this, e)) batch->all.push_back(instance(l, e));
    if (!batch->all.empty()) batches.push_back(std::move(batch));
  }

  std::unique_ptr<Probe> probe(Localizer &l, PetscInt e) const override
  {
    const PetscInt i = l.marker(all[e].marker[0]);
    return std::make_unique<NodeContactProbe<Shape>>(i, instance(l, e));
  }

private:
  typename NodeContactBatch<Shape>::Instance instance(Localizer &l, PetscInt e) const
  {
    typename NodeContactBatch<Shape>::Instance x;
    const PetscInt                             i = l.marker(all[e].marker[0]);
    x.on.j                                       = l.marker(all[e].marker[1]);
    x.on.body                                    = l.bodies->marker.empty() ? -1 : l.bodies->marker[i].body;
    x.on.nodes                                   = all[e].nodes;
    x.data                                       = all[e].data;
    x.mine                                       = OwnerOf(*l.run->model, *this, e) == l.run->rank;
    return x;
  }
};

/* Numbers of the nodes among the kept nodes, without repetitions */
std::vector<PetscInt> PlacesOf(ElementBuilder &e, const ModalBody &m, const NodeContact &s)
{
  std::vector<PetscInt> places;
  std::set<PetscInt>    found;
  for (PetscInt label : s.nodes) {
    const PetscInt k = m.node(label);
    e.require(k >= 0, e.scene().bodyName(s.body.id) + " has not kept node " + std::to_string(label) + "; keep it when the body is reduced (Reduction::node_sets, hhtreduce -keep_nodes)");
    found.insert(k);
  }
  for (PetscInt k = 0; k < (PetscInt)m.nodes.size() && s.nodes.empty(); k++) found.insert(k);
  places.assign(found.begin(), found.end());
  e.require(!places.empty(), e.scene().bodyName(s.body.id) + " has kept no nodes; keep some when the body is reduced (Reduction::node_sets, hhtreduce -keep_nodes)");
  return places;
}

template <class Shape> void Put(ElementBuilder &e, Marker i, Marker j, std::shared_ptr<const ContactNodes> nodes, const typename Shape::Data &shape, const ContactLaw &law)
{
  typename NodeContactStore<Shape>::Item item;
  item.marker[0] = i.id;
  item.marker[1] = j.id;
  item.nodes     = std::move(nodes);
  item.data      = {shape, law};
  e.put<NodeContactStore<Shape>>(std::move(item));
}

} // namespace

template <> Element Scene::enter(const std::string &name, const NodeContact &x)
{
  SceneData &s        = data();
  const bool flexible = s.valid(x.body) && s.bodies[x.body.id].flexible;
  if (!flexible) { /* an ElementBuilder needs the marker of the floating frame, which does not exist */
    const Element none = absent(name);
    s.errors.push_back("node contact " + s.elements[none.id].name + ": its body is not a flexible one of this scene");
    return none;
  }
  const Marker at{s.bodies[x.body.id].flexible->frame, number_};
  ElementBuilder e(*this, name, "node contact", ElementData::Force, at, x.j);
  if (!e.good()) return e.done();
  const PetscInt other = s.markers[x.j.id].body;
  e.require(other < 0 || s.bodies[other].carrier != x.body.id, "marker j is on the same flexible body " + s.bodyName(x.body.id));
  /* only the force on a sphere without friction has no moment about its centre */
  if (x.radius_j == 0 || x.law.friction != 0) RequireNoPoint(e, x.j, "j");
  if (x.radius_j == 0) RequireNotNegative(e, "radius", x.radius);
  else RequirePositive(e, "radius", x.radius);
  if (x.radius_j != 0) RequirePositive(e, "radius_j", x.radius_j);
  const auto                 &model  = s.bodies[x.body.id].flexible->model;
  const std::vector<PetscInt> places = PlacesOf(e, *model, x);
  const ContactLaw            law    = CheckedLaw(e, x.law);
  if (!e.good()) return e.done();
  if (x.radius_j == 0) Put<SpherePlaneShape>(e, at, x.j, MakeContactNodes(model, places), {x.radius, 2}, law);
  else Put<SphereSphereShape>(e, at, x.j, MakeContactNodes(model, places), {x.radius, x.radius_j}, law);
  return e.done();
}

} // namespace hhtdae
