/* Gears and racks between two bodies on one carrier; the tooth force acts at the pitch point. */
#include "scene/kernels/mesh.h"
#include "scene/motions/moving_pair.h"
#include <algorithm>

namespace hhtdae
{

namespace
{

/* sine of the largest angle between z_i and z_j that is accepted in the description; assembly corrects such an angle */
constexpr double parallel_sine = 1e-6;

template <class Spec> void CheckBodies(ElementBuilder &e, const Spec &s)
{
  const SceneData &scene = e.scene();
  const auto       body  = [&](Marker m) { return scene.markers[m.id].body; };
  e.require(s.i2, "marker i2");
  e.require(s.j2, "marker j2");
  e.require(s.mesh, "marker `mesh`");
  if (!e.good()) return;
  const PetscInt carrier = body(s.j1);
  for (Marker m : {s.j2, s.mesh})
    e.require(body(m) == carrier, std::string(m.id == s.j2.id ? "marker j2" : "marker `mesh`") + " is on " + scene.bodyName(body(m)) + " and j1 on " +
                                    scene.bodyName(carrier) + ", must be on the same carrier");
  e.require(body(s.i1) != body(s.i2), "both bodies are " + scene.bodyName(body(s.i1)) + ", must be two");
  for (Marker m : {s.i1, s.i2})
    if (scene.turnless(body(m)))
      e.require(false, "marker " + std::string(m.id == s.i1.id ? "i1" : "i2") + " is on " + scene.turnlessName(body(m)) + ", must be on a rigid body");
}

void CheckWheel(ElementBuilder &e, Marker i, Marker j, const char *which)
{
  RequirePair(e, i, j, true, std::string(which) + ": ");
  if (!e.good()) return;
  const Vector3 a = e.frame(i).R.col(2), b = e.frame(j).R.col(2);
  e.require(a.cross(b).norm() < parallel_sine, std::string(which) + ": the z axes of its markers are not parallel, as those of a revolute or cylindrical joint are");
}

/* Distance of a point from a marker's z axis */
double OffAxis(const Vector3 &x, const Frame<double> &j)
{
  const Vector3 u = x - j.x;
  return (u - u.dot(j.R.col(2)) * j.R.col(2)).norm();
}

/* Rotations are about z_j through the origin of j: a wheel's marker off that axis, or an axis that is not the joint's, would be teeth on a wheel that wobbles */
void CheckAxis(ElementBuilder &e, Marker i, Marker j, double lever, int number)
{
  const std::string   which = "wheel " + std::to_string(number);
  const SceneData    &s     = e.scene();
  const Frame<double> at    = e.frame(j);
  const double        most  = parallel_sine * std::abs(lever);
  const auto          body  = [&](Marker m) { return s.markers[m.id].body; };
  std::string         other;
  e.require(OffAxis(e.frame(i).x, at) <= most, which + ": marker i" + std::to_string(number) + " is " + Show(OffAxis(e.frame(i).x, at)) + " off the axis, z of marker j" + std::to_string(number) +
                                                   "; give the markers of the wheel's joint");
  for (const ElementData &joint : s.elements) {
    const bool turns = joint.type == std::string("revolute") || joint.type == std::string("cylindrical");
    if (!turns || !s.valid(joint.i) || !s.valid(joint.j) || std::minmax(body(joint.i), body(joint.j)) != std::minmax(body(i), body(j))) continue;
    const Frame<double> axis = s.frame(joint.j);
    if (OffAxis(at.x, axis) <= most && at.R.col(2).cross(axis.R.col(2)).norm() < parallel_sine) return;
    other = joint.name;
  }
  e.require(other.empty(), which + ": z of marker j" + std::to_string(number) + " is not the axis of " + other + ", on which it turns; give the markers of that joint");
}

template <class K> void CheckLever(ElementBuilder &e, const typename K::Data &d, int k, const char *which)
{
  e.require(std::abs(K::perAngle(d, k)) > parallel_sine * d.side[k].bearing.norm(),
            std::string(which) + ": the force of the teeth has no lever about its axis; z of `mesh` (planar: x) is the direction of that force, its origin the pitch point");
}

template <bool Rack, class Spec> Element Mesh(ElementBuilder &e, const Spec &s)
{
  using K = MeshRow<Rack>;
  CheckBodies(e, s);
  if (e.good()) CheckWheel(e, s.i1, s.j1, "wheel 1");
  if (e.good() && !Rack) CheckWheel(e, s.i2, s.j2, "wheel 2");
  if (e.good() && Rack) RequirePair(e, s.i2, s.j2, false, "rack: ");
  if (!e.good()) return e.done();
  const Frame<double> f[3] = {e.frame(s.i1), e.frame(s.i2), e.frame(s.mesh)}, bearing[2] = {e.frame(s.j1), e.frame(s.j2)};
  typename K::Data    d;
  d.axis = e.planar() ? 0 : 2;
  K::begin(d, f, bearing);
  CheckLever<K>(e, d, 0, "wheel 1");
  if (!Rack) CheckLever<K>(e, d, 1, "wheel 2");
  else e.require(std::abs(K::perAdvance(d, e.planar() ? 0 : 2)) > parallel_sine, "rack: the force of the teeth is across its way, z of j2 (planar: x)");
  if (e.good()) CheckAxis(e, s.i1, s.j1, K::perAngle(d, 0), 1);
  if (e.good() && !Rack) CheckAxis(e, s.i2, s.j2, K::perAngle(d, 1), 2);
  if (e.good()) e.constrain<K>({s.i1, s.i2, s.mesh}, d);
  return e.done();
}

} // namespace

template <> Element Scene::enter(const std::string &name, const GearMesh &s)
{
  ElementBuilder e(*this, name, "gear mesh", ElementData::Joint, s.i1, s.j1);
  return Mesh<false>(e, s);
}

template <> Element Scene::enter(const std::string &name, const RackMesh &s)
{
  ElementBuilder e(*this, name, "rack mesh", ElementData::Joint, s.i1, s.j1);
  return Mesh<true>(e, s);
}

} // namespace hhtdae
