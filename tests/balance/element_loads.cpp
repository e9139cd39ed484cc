#include "balance/element_loads.h"
#include <algorithm>
#include <cmath>

namespace hhtest
{

using namespace hhtdae;

namespace
{

bool Is(const ElementData &e, const char *type) { return std::string(e.type) == type; }
bool Ends(const ElementData &e, const std::string &with)
{
  const std::string s = e.type;
  return s.size() >= with.size() && s.compare(s.size() - with.size(), with.size(), with) == 0;
}

/* The joints of a coupler with their factors: factor times the multiplier is the moment or force on i's body */
std::vector<Coupler::Term> Terms(const Specs &specs, PetscInt element)
{
  if (const Gear *g = specs.of<Gear>(element)) return {{g->i1, g->j1, true, 1}, {g->i2, g->j2, true, g->ratio}};
  if (const RackAndPinion *g = specs.of<RackAndPinion>(element))
    return {{g->i1, g->j1, true, -g->radius}, {g->i2, g->j2, false, 1}};
  if (const Coupler *g = specs.of<Coupler>(element)) return g->terms;
  return {};
}

Vector3 Three(const std::vector<double> &c, std::size_t first) { return {c[first], c[first + 1], c[first + 2]}; }

} // namespace

bool ElementLoads::couples(const SceneData &scene, PetscInt element)
{
  const ElementData &e = scene.elements[(std::size_t)element];
  return Is(e, "gear") || Is(e, "rack and pinion") || Is(e, "coupler");
}

bool ElementLoads::known(const SceneData &scene, const Specs &specs, PetscInt element)
{
  const ElementData &e = scene.elements[(std::size_t)element];
  if (couples(scene, element)) return !Terms(specs, element).empty();
  if (e.kind != ElementData::Force) return !Is(e, "attachment");
  if (Is(e, "user force")) return specs.of<UserForce>(element);
  if (Ends(e, "contact"))
    return specs.of<SpherePlane>(element) || specs.of<EllipsoidPlane>(element) || specs.of<TorusPlane>(element) ||
           specs.of<SphereSphere>(element) || specs.of<SphereBox>(element);
  if (Is(e, "translational stop")) return specs.of<TranslationalStop>(element);
  for (const char *type : {"rotational stop", "distance stop", "spring-damper", "nonlinear spring", "torsional spring-damper", "nonlinear torsional spring",
                           "bushing", "beam", "joint friction", "user scalar force", "user scalar moment"})
    if (Is(e, type)) return true;
  return false;
}

ElementLoads::Place ElementLoads::at(Marker m) const
{
  const MarkerData &k = scene_.markers[(std::size_t)m.id];
  if (k.body < 0) return {k.s, Vector3::Zero(), k.R};
  const Pose   &b   = body_[(std::size_t)k.body];
  const Vector3 arm = b.A * k.s;
  return {b.r + arm, b.v + b.w.cross(arm), b.A * k.R};
}

/* Force and moment on i's body at x, and the opposite on j's body at the same point: action and reaction of a massless
   element */
void ElementLoads::pair(const ElementData &e, const Vector3 &x, const Vector3 &f, const Vector3 &m,
                        std::vector<Load> &loads) const
{
  loads.push_back({bodyOf(e.i), x, f, m});
  loads.push_back({bodyOf(e.j), x, -f, -m});
}

void ElementLoads::coupler(PetscInt element, double multiplier, std::vector<Load> &loads) const
{
  for (const Coupler::Term &t : Terms(specs_, element)) {
    const Place   i = at(t.i), j = at(t.j);
    const Vector3 load = t.factor * multiplier * j.R.col(!t.rotation && scene_.planar ? 0 : 2), none = Vector3::Zero();
    const Vector3 f = t.rotation ? none : load, m = t.rotation ? load : none;
    loads.push_back({bodyOf(t.i), i.x, f, m});
    loads.push_back({bodyOf(t.j), i.x, -f, -m});
  }
}

/* A tension along the line between the markers' origins */
void ElementLoads::along(const ElementData &e, double tension, std::vector<Load> &loads) const
{
  const Vector3 x = at(e.i).x, line = x - at(e.j).x;
  const double  l = line.norm();
  if (l > 0) pair(e, x, -tension / l * line, Vector3::Zero(), loads);
}

/* Force and moment on i about its origin, in j's axes, or (mean) in the frame halfway on the rotation from j to i */
void ElementLoads::six(const ElementData &e, const Reading &r, bool mean, std::vector<Load> &loads) const
{
  const Place i = at(e.i), j = at(e.j);
  Matrix3     E = j.R;
  if (mean) {
    const Eigen::AngleAxisd turn(Matrix3(j.R.transpose() * i.R));
    E = j.R * Eigen::AngleAxisd(0.5 * turn.angle(), turn.axis()).toRotationMatrix();
  }
  pair(e, i.x, E * Three(r.component, 0), E * Three(r.component, 3), loads);
}

/* A moment about z_j, a force along z_j, or a moment in space axes, depending on the type of the joint with friction */
void ElementLoads::friction(const ElementData &e, const Reading &r, std::vector<Load> &loads) const
{
  const Place   i = at(e.i), j = at(e.j);
  const Vector3 axis = j.R.col(2), none = Vector3::Zero();
  const auto    joint = std::find_if(scene_.elements.begin(), scene_.elements.end(), [&](const ElementData &k) {
    return k.kind == ElementData::Joint && k.i.id == e.i.id && k.j.id == e.j.id;
  });
  if (Is(*joint, "translational"))
    pair(e, i.x, r.component[0] * j.R.col(scene_.planar ? 0 : 2), none, loads);
  else if (Is(*joint, "cylindrical"))
    pair(e, i.x, r.component[0] * axis, r.component[1] * axis, loads);
  else if (Is(*joint, "spherical"))
    pair(e, i.x, none, Three(r.component, 0), loads);
  else
    pair(e, i.x, none, r.component[0] * axis, loads);
}

/* Contact point: the deepest point of shape i; between spheres the middle of the overlap */
Vector3 ElementLoads::touch(PetscInt element) const
{
  const ElementData &e = scene_.elements[(std::size_t)element];
  const Place        i = at(e.i), j = at(e.j);
  const Vector3      n = j.R.col(scene_.planar ? 1 : 2), d = i.x - j.x;
  if (const SpherePlane *s = specs_.of<SpherePlane>(element)) return i.x - s->radius * n;
  if (const EllipsoidPlane *s = specs_.of<EllipsoidPlane>(element)) {
    const Vector3 down = i.R.transpose() * n, low = s->semiaxes.cwiseProduct(down);
    return i.x - i.R * s->semiaxes.cwiseProduct(low) / low.norm();
  }
  if (const TorusPlane *s = specs_.of<TorusPlane>(element)) {
    const Vector3 axle = i.R.col(2), across = n - axle * axle.dot(n);
    const double  y = across.squaredNorm() / 1e-6; /* a disc that lies flat touches in the middle of its ring, see TorusPlaneShape */
    return i.x - s->radius * (y < 1 ? Vector3(1e3 * (1.5 - 0.5 * y) * across) : across.normalized()) - s->tube * n;
  }
  if (const SphereSphere *s = specs_.of<SphereSphere>(element)) {
    const double depth = s->radius_i + s->radius_j - d.norm();
    return i.x - (s->radius_i - 0.5 * depth) * d.normalized();
  }
  const SphereBox *s = specs_.of<SphereBox>(element);
  const Vector3    c = j.R.transpose() * d;
  Vector3          q = c.cwiseMax(-s->half).cwiseMin(s->half);
  if (scene_.planar) q(2) = c(2);
  Vector3 out = c - q;
  if (out.norm() == 0) { /* the centre is inside: out through the nearest face */
    int face = 0;
    for (int k = 1; k < (scene_.planar ? 2 : 3); k++)
      if (std::abs(c(k)) - s->half(k) > std::abs(c(face)) - s->half(face)) face = k;
    out(face) = c(face) < 0 ? -1 : 1;
  }
  return i.x - s->radius * (j.R * out.normalized());
}

void ElementLoads::contact(PetscInt element, const Reading &r, std::vector<Load> &loads) const
{
  const ElementData &e     = scene_.elements[(std::size_t)element];
  const Vector3      force = Three(r.component, 0);
  pair(e, touch(element), specs_.of<SphereSphere>(element) ? force : Vector3(at(e.j).R * force), Vector3::Zero(),
       loads);
}

void ElementLoads::user(PetscInt element, const Reading &r, std::vector<Load> &loads) const
{
  const UserForce &u     = *specs_.of<UserForce>(element);
  const Matrix3    E     = u.frame.id < 0 ? Matrix3(Matrix3::Identity()) : at(u.frame).R;
  const Vector3    force = u.force.empty() ? Vector3::Zero() : Vector3(E * Three(r.component, 0)), x = at(u.i).x;
  const Vector3    moment = u.moment.empty() ? Vector3::Zero() : Vector3(E * Three(r.component, u.force.size()));
  loads.push_back({bodyOf(u.i), x, force, moment});
  if (u.j.id >= 0) loads.push_back({bodyOf(u.j), x, -force, -moment});
}

void ElementLoads::add(PetscInt element, const Reading &r, std::vector<Load> &loads) const
{
  const ElementData &e = scene_.elements[(std::size_t)element];
  if (couples(scene_, element))
    coupler(element, r.component[0], loads);
  else if (e.kind != ElementData::Force)
    pair(e, at(e.i).x, r.force, r.moment, loads);
  else if (Is(e, "user force"))
    user(element, r, loads);
  else if (Ends(e, "contact"))
    contact(element, r, loads);
  else if (Is(e, "joint friction"))
    friction(e, r, loads);
  else if (Is(e, "bushing") || Is(e, "beam"))
    six(e, r, Is(e, "beam"), loads);
  else if (Is(e, "user scalar force"))
    along(e, -r.component[0], loads);
  else if (Is(e, "distance stop"))
    along(e, r.component[0], loads);
  else if (Is(e, "translational stop")) {
    const int axis = specs_.of<TranslationalStop>(element)->axis;
    pair(e, at(e.i).x, r.component[0] * at(e.j).R.col(scene_.planar && axis == 2 ? 0 : axis), Vector3::Zero(), loads);
  } else if (Ends(e, "spring-damper") || Ends(e, "spring"))
    if (std::string(e.type).find("torsional") == std::string::npos)
      along(e, r.component[0], loads);
    else
      pair(e, at(e.i).x, Vector3::Zero(), r.component[0] * at(e.j).R.col(2), loads);
  else
    pair(e, at(e.i).x, Vector3::Zero(), r.component[0] * at(e.j).R.col(2), loads); /* user scalar moment, rotational stop */
}

} // namespace hhtest
