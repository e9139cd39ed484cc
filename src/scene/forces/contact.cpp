/*
  Contact forces, kernels/contact.h. In planar scenes the plane is the line along x_j with matter on the side of
  negative y_j, and spheres, ellipsoids and boxes are discs, ellipses and rectangles.
*/
#include "scene/kernels/contact.h"
#include "contact_requirements.h"
#include <limits>

namespace hhtdae
{

namespace
{

enum class Round { No, I, Both }; /* which shapes are spheres about their markers' origins */

ElementBuilder Entry(Scene &scene, const std::string &name, const char *type, Marker i, Marker j, const ContactLaw &law, Round round)
{
  ElementBuilder e(scene, name, type, ElementData::Force, i, j);
  RequireTwoBodies(e, i, j);
  /* Without friction, the force on a sphere has no moment about the marker's origin */
  if (law.friction != 0 || round == Round::No) RequireNoPoint(e, i, "i");
  if (law.friction != 0 || round != Round::Both) RequireNoPoint(e, j, "j");
  return e;
}

int PlaneNormal(const ElementBuilder &e) { return e.planar() ? 1 : 2; }

} // namespace

template <> Element Scene::enter(const std::string &name, const SpherePlane &s)
{
  ElementBuilder e = Entry(*this, name, "sphere-plane contact", s.i, s.j, s.law, Round::I);
  RequirePositive(e, "radius", s.radius);
  e.load<Contact<SpherePlaneShape>>({s.i, s.j}, {{s.radius, PlaneNormal(e)}, CheckedLaw(e, s.law)}, {},
                                    s.state);
  return e.done();
}

template <> Element Scene::enter(const std::string &name, const EllipsoidPlane &s)
{
  ElementBuilder e = Entry(*this, name, "ellipsoid-plane contact", s.i, s.j, s.law, Round::No);
  for (int k = 0; k < 3; k++) RequirePositive(e, Component("semiaxis", k), s.semiaxes(k));
  const EllipsoidPlaneShape::Data shape{{s.semiaxes(0), s.semiaxes(1), s.semiaxes(2)}, PlaneNormal(e)};
  e.load<Contact<EllipsoidPlaneShape>>({s.i, s.j}, {shape, CheckedLaw(e, s.law)}, {}, s.state);
  return e.done();
}

template <> Element Scene::enter(const std::string &name, const TorusPlane &s)
{
  ElementBuilder e = Entry(*this, name, "torus-plane contact", s.i, s.j, s.law, Round::No);
  e.require(!e.planar(), "a planar scene has no torus; a wheel is a SpherePlane with the outer radius");
  RequirePositive(e, "radius", s.radius);
  RequirePositive(e, "tube radius", s.tube);
  e.load<Contact<TorusPlaneShape>>({s.i, s.j}, {{s.radius, s.tube}, CheckedLaw(e, s.law)}, {}, s.state);
  return e.done();
}

template <> Element Scene::enter(const std::string &name, const SphereSphere &s)
{
  ElementBuilder e = Entry(*this, name, "sphere-sphere contact", s.i, s.j, s.law, Round::Both);
  RequirePositive(e, "radius of i", s.radius_i);
  RequirePositive(e, "radius of j", s.radius_j);
  if (e.good()) e.require(!e.coincident(s.i, s.j), "the spheres are concentric at the start, without a direction to be pushed apart");
  e.load<Contact<SphereSphereShape>>({s.i, s.j}, {{s.radius_i, s.radius_j}, CheckedLaw(e, s.law)}, {}, s.state);
  return e.done();
}

template <> Element Scene::enter(const std::string &name, const SphereBox &s)
{
  ElementBuilder e = Entry(*this, name, "sphere-box contact", s.i, s.j, s.law, Round::I);
  RequirePositive(e, "radius", s.radius);
  SphereBoxShape::Data shape{s.radius, {s.half(0), s.half(1), s.half(2)}};
  if (e.planar())
    shape.half[2] = std::numeric_limits<double>::infinity(); /* so that a face normal to z is never the nearest one */
  for (int k = 0; k < (e.planar() ? 2 : 3); k++) RequirePositive(e, Component("half length", k), s.half(k));
  e.load<Contact<SphereBoxShape>>({s.i, s.j}, {shape, CheckedLaw(e, s.law)}, {}, s.state);
  return e.done();
}

} // namespace hhtdae
