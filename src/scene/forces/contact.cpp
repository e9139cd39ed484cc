/*
  Contact forces, kernels/contact.h. In planar scenes the plane is the line along x_j with matter on the side of
  negative y, and spheres, ellipsoids and boxes are discs, ellipses and rectangles.
*/
#include "scene/kernels/contact.h"
#include "scene/scene_data.h"
#include <limits>
#include <sstream>

namespace hhtdae
{

namespace
{

void RequirePositive(ElementBuilder &e, double x, const char *what)
{
  std::ostringstream message;
  message << what << " is " << x << ", must be positive";
  e.require(std::isfinite(x) && x > 0, message.str());
}

void RequireNotNegative(ElementBuilder &e, double x, const char *what)
{
  std::ostringstream message;
  message << what << " is " << x << ", must not be negative";
  e.require(std::isfinite(x) && x >= 0, message.str());
}

/* size: of the smaller of the two shapes */
ContactLawData CheckedLaw(ElementBuilder &e, const ContactLaw &law, double size)
{
  std::ostringstream message;
  RequirePositive(e, law.stiffness, "stiffness");
  RequireNotNegative(e, law.damping, "damping");
  RequireNotNegative(e, law.friction, "friction coefficient");
  RequirePositive(e, law.slip_velocity, "slip velocity");
  message << "exponent is " << law.exponent << ", must be 1 or more (1.5: Hertz)";
  e.require(std::isfinite(law.exponent) && law.exponent >= 1, message.str());
  ContactLawData d;
  static_cast<ContactLaw &>(d) = law;
  d.onset                      = 1e-4 * size; /* far less than a penetration that matters to a body of this size */
  return d;
}

ElementBuilder Entry(Scene &scene, const std::string &name, const char *type, Marker i, Marker j)
{
  return ElementBuilder(scene, name, type, ElementData::Force, i, j);
}

int PlaneNormal(const ElementBuilder &e) { return e.planar() ? 1 : 2; }

} // namespace

template <> Element Scene::add(const std::string &name, const SpherePlane &s)
{
  ElementBuilder e = Entry(*this, name, "sphere-plane contact", s.i, s.j);
  RequirePositive(e, s.radius, "radius");
  e.load<Contact<SpherePlaneShape>>({s.i, s.j}, {{s.radius, PlaneNormal(e)}, CheckedLaw(e, s.law, s.radius)}, {},
                                    s.state);
  return e.done();
}

template <> Element Scene::add(const std::string &name, const EllipsoidPlane &s)
{
  ElementBuilder e      = Entry(*this, name, "ellipsoid-plane contact", s.i, s.j);
  const char    *what[] = {"semiaxis x", "semiaxis y", "semiaxis z"};
  for (int k = 0; k < 3; k++) RequirePositive(e, s.semiaxes(k), what[k]);
  const EllipsoidPlaneShape::Data shape{{s.semiaxes(0), s.semiaxes(1), s.semiaxes(2)}, PlaneNormal(e)};
  e.load<Contact<EllipsoidPlaneShape>>({s.i, s.j}, {shape, CheckedLaw(e, s.law, s.semiaxes.minCoeff())}, {}, s.state);
  return e.done();
}

template <> Element Scene::add(const std::string &name, const TorusPlane &s)
{
  ElementBuilder e = Entry(*this, name, "torus-plane contact", s.i, s.j);
  e.require(!e.planar(), "a planar scene has no torus; a wheel is a SpherePlane with the outer radius");
  RequirePositive(e, s.radius, "radius");
  RequirePositive(e, s.tube, "tube radius");
  const double size = s.radius + s.tube;
  e.load<Contact<TorusPlaneShape>>({s.i, s.j}, {{s.radius, s.tube}, CheckedLaw(e, s.law, size)}, {}, s.state);
  return e.done();
}

template <> Element Scene::add(const std::string &name, const SphereSphere &s)
{
  ElementBuilder e = Entry(*this, name, "sphere-sphere contact", s.i, s.j);
  RequirePositive(e, s.radius_i, "radius of i");
  RequirePositive(e, s.radius_j, "radius of j");
  const double size = std::min(s.radius_i, s.radius_j);
  e.load<Contact<SphereSphereShape>>({s.i, s.j}, {{s.radius_i, s.radius_j}, CheckedLaw(e, s.law, size)}, {}, s.state);
  return e.done();
}

template <> Element Scene::add(const std::string &name, const SphereBox &s)
{
  ElementBuilder e      = Entry(*this, name, "sphere-box contact", s.i, s.j);
  const char    *what[] = {"half length x", "half length y", "half length z"};
  RequirePositive(e, s.radius, "radius");
  SphereBoxShape::Data shape{s.radius, {s.half(0), s.half(1), s.half(2)}};
  if (e.planar())
    shape.half[2] = std::numeric_limits<double>::infinity(); /* the nearest face is never above or below */
  for (int k = 0; k < (e.planar() ? 2 : 3); k++) RequirePositive(e, s.half(k), what[k]);
  e.load<Contact<SphereBoxShape>>({s.i, s.j}, {shape, CheckedLaw(e, s.law, s.radius)}, {}, s.state);
  return e.done();
}

} // namespace hhtdae
