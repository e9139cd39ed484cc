#include "scene/output/page_description.h"
#include "scene/output/json.h"
#include "scene/output/page_surface.h"
#include "scene/symmetric.h"
#include <algorithm>
#include <cstring>

namespace hhtdae
{

namespace
{

std::string Object(std::initializer_list<std::pair<const char *, std::string>> entries)
{
  std::string out = "{";
  for (const auto &[name, value] : entries) {
    if (out.size() > 1) out += ',';
    out += '"';
    out += name;
    out += "\":" + value;
  }
  return out + '}';
}

std::string List(const std::vector<std::string> &entries)
{
  std::string out = "[";
  for (std::size_t k = 0; k < entries.size(); k++) out += (k ? ",\n" : "") + entries[k];
  return out + ']';
}

const char *Boolean(bool x) { return x ? "true" : "false"; }

std::string PlaceText(PetscInt body, const Vector3 &s, const Matrix3 &R)
{
  const Eigen::Quaterniond  q(R);
  const std::vector<double> x{(double)body, s(0), s(1), s(2), q.x(), q.y(), q.z(), q.w()};
  return JSONNumbers(x);
}

std::string MarkerText(const SceneData &s, Marker m)
{
  if (!s.valid(m) || s.markers[m.id].body < -1) return "null";
  const MarkerData &k = s.markers[m.id];
  return PlaceText(k.body, k.s, k.R);
}

std::string ShapeText(const char *kind, const Vector3 &size, PetscInt body, const Vector3 &at, const Matrix3 &axes, int colour = -1)
{
  return Object({{"kind", JSONText(kind)}, {"size", JSONNumbers(size)}, {"at", PlaceText(body, at, axes)}, {"colour", std::to_string(colour)}});
}

std::string ShapeText(const SceneData &s, const ShapeData &d)
{
  static const char *const kind[] = {"box", "cylinder", "sphere"};
  const Vector3            at     = d.body < 0 ? d.shape.position : Vector3(d.shape.position - s.bodies[d.body].center);
  return ShapeText(kind[d.shape.kind], d.shape.size, d.body, at, d.shape.axes, d.shape.colour);
}

/* The solid box, as JSON, with the body's mass and moments of inertia, I_1 = m (a_2^2 + a_3^2)/3 for half edges a_k;
   empty if no box has this inertia */
std::string BoxOfInertia(const SceneData &s, PetscInt id)
{
  const BodyData &b = s.bodies[id];
  if (b.point || s.planar || !(b.mass > 0) || b.carrier >= 0) return "";
  const SymmetricEigen principal(b.inertia);
  const Vector3        I    = principal.values;
  Matrix3              axes = principal.vectors;
  Vector3              half;
  for (int k = 0; k < 3; k++) half(k) = std::sqrt(std::max(0.0, 1.5 * (I.sum() - 2 * I(k)) / b.mass));
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  return half.allFinite() && half.maxCoeff() > 0 ? ShapeText("box", half, id, Vector3::Zero(), axes) : "";
}

using Meshes = std::vector<std::unique_ptr<PageMesh>>;

std::string MeshText(const PageMesh &m)
{
  return Object({{"name", JSONText(m.name)}, {"modes", "0"}, {"carrier", "-1"}, {"rest", "[]"}, {"mesh", "true"}, {"guess", "false"}, {"shapes", "[]"}});
}

Vector3 Mean(const std::vector<double> &point)
{
  return Eigen::Map<const Eigen::Matrix3Xd>(point.data(), 3, (Eigen::Index)point.size() / 3).rowwise().mean();
}

std::vector<std::string> BodyTexts(const SceneData &s, const Meshes &meshes)
{
  std::vector<std::vector<std::string>> shapes(s.bodies.size());
  std::vector<char>                     drawn(s.bodies.size(), 0);
  std::vector<std::string>              out;
  std::vector<PetscInt>                 carrier;
  std::vector<std::string>              rest; /* undeformed positions of the frames of attachments */
  for (const BodyData &b : s.bodies) {
    carrier.push_back(b.carrier);
    rest.push_back(b.carrier < 0 ? "[]" : JSONNumbers(Vector3(s.bodies[b.carrier].flexible->place(b.attachment).position - s.bodies[b.carrier].center)));
  }
  for (std::size_t m = 0; m < meshes.size(); m++)
    for (Marker frame : meshes[m]->frames) {
      const PetscInt b = s.markers[frame.id].body;
      carrier[b]       = (PetscInt)(s.bodies.size() + m);
      rest[b]          = JSONNumbers(Vector3(s.bodies[b].r - Mean(meshes[m]->surface.point)));
    }
  /* a body with a surface is drawn without shapes of the user, which would be inside the surface */
  for (const SurfaceData &d : s.surfaces) drawn[d.body] = 1;
  for (const ShapeData &d : s.shapes)
    if (d.body >= 0 && !drawn[d.body]) shapes[d.body].push_back(ShapeText(s, d));
  for (const std::vector<PetscInt> &line : s.lines) { /* a line with all its markers on one body counts as the shape of this body */
    const PetscInt first = s.markers[line[0]].body;
    if (first >= 0 && std::all_of(line.begin(), line.end(), [&](PetscInt m) { return s.markers[m].body == first; })) drawn[first] = 1;
  }
  for (std::size_t b = 0; b < s.bodies.size(); b++) {
    const BodyData &d     = s.bodies[b];
    const bool      guess = shapes[b].empty() && !drawn[b];
    if (guess && !d.flexible) {
      const std::string box = BoxOfInertia(s, (PetscInt)b);
      if (!box.empty()) shapes[b].push_back(box);
    }
    out.push_back(Object({{"name", JSONText(d.name)},
                          {"modes", std::to_string(d.flexible ? d.flexible->model->modes() : 0)},
                          {"carrier", std::to_string(carrier[b])},
                          {"rest", rest[b]},
                          {"mesh", "false"},
                          {"guess", Boolean(guess)},
                          {"shapes", List(shapes[b])}}));
  }
  return out;
}

std::vector<std::string> ElementTexts(const SceneData &s)
{
  static const char *const kind[] = {"joint", "motion", "force"};
  std::vector<std::string> out;
  for (const ElementData &e : s.elements)
    if (std::strcmp(e.type, "attachment") != 0)
      out.push_back(Object({{"name", JSONText(e.name)}, {"type", JSONText(e.type)}, {"kind", JSONText(kind[e.kind])}, {"i", MarkerText(s, e.i)}, {"j", MarkerText(s, e.j)}}));
  return out;
}

/* Direction that is up in the page: against gravity; without gravity z, or y in planar scenes */
Vector3 Up(const SceneData &s)
{
  const double g = s.gravity.norm();
  if (g > 0 && std::isfinite(g)) return -s.gravity / g;
  return s.planar ? Vector3::UnitY() : Vector3::UnitZ();
}

} // namespace

std::string DescribePage(const SceneData &s, const std::string &title, const Meshes &meshes)
{
  std::vector<std::string> ground, lines, channels, surfaces;
  for (const ShapeData &d : s.shapes)
    if (d.body < 0) ground.push_back(ShapeText(s, d));
  for (const std::vector<PetscInt> &line : s.lines) {
    std::vector<std::string> places;
    for (PetscInt m : line) places.push_back(MarkerText(s, Marker{m}));
    lines.push_back(List(places));
  }
  for (const ChannelData &c : s.channels) channels.push_back(Object({{"name", JSONText(c.name)}, {"unit", JSONText(c.unit)}}));
  for (const SurfaceData &d : s.surfaces)
    surfaces.push_back(Object({{"body", std::to_string(d.body)}, {"stress", Boolean(d.surface && HasStress(*d.surface))}, {"unit", JSONText(d.surface ? d.surface->stress_unit : "")}, {"moving", "false"}}));
  std::vector<std::string> bodies = BodyTexts(s, meshes);
  for (std::size_t m = 0; m < meshes.size(); m++) {
    bodies.push_back(MeshText(*meshes[m]));
    surfaces.push_back(Object({{"body", std::to_string(s.bodies.size() + m)},
                               {"stress", Boolean(meshes[m]->stress)},
                               {"unit", JSONText(meshes[m]->surface.stress_unit)},
                               {"moving", "true"}}));
  }
  return Object({{"format", "1"},
                 {"title", JSONText(title)},
                 {"planar", Boolean(s.planar)},
                 {"up", JSONNumbers(Up(s))},
                 {"bodies", List(bodies)},
                 {"ground", List(ground)},
                 {"lines", List(lines)},
                 {"elements", List(ElementTexts(s))},
                 {"channels", List(channels)},
                 {"surfaces", List(surfaces)}});
}

} // namespace hhtdae
