/* Adds output to the description of a scene: channels, shapes and lines. */
#include "scene/measures.h"

namespace hhtdae
{

/* Whether `name` is in the HDF5 group `group`, which would have the same name as a channel */
static bool Within(const std::string &group, const std::string &name) { return name.size() > group.size() && name.compare(0, group.size(), group) == 0 && name[group.size()] == '/'; }

Channel Scene::channel(const std::string &given, const Expression &value, const std::string &unit)
{
  if (recording()) record([=](Scene &s) { s.channel(given, value, unit); });
  SceneData        &s    = data();
  const std::string name = given.empty() ? "channel " + std::to_string(s.channels.size()) : given;
  const std::string who = "channel " + name + ": ";
  s.refuseLate("channel " + name);
  if (name.front() == '/' || name.back() == '/' || name.find("//") != std::string::npos)
    s.errors.push_back(who + "a name neither begins nor ends with /, which separates groups in the file");
  if (name == "time" || Within("time", name)) s.errors.push_back(who + "this name is taken by the times of the samples");
  for (const ChannelData &c : s.channels) {
    if (c.name == name) s.errors.push_back(who + "there is one of this name");
    if (Within(c.name, name) || Within(name, c.name))
      s.errors.push_back(who + "there is channel " + c.name + ", and what stands before a / is a group of channels in the file, which is not a channel itself");
  }
  if (!value.f) s.errors.push_back(who + "its function is empty");
  for (const Measure &m : value.arguments) {
    const std::string error = CheckMeasure(s, m, false);
    if (!error.empty()) s.errors.push_back(who + error);
  }
  s.channels.push_back({name, unit, value});
  return Channel{(PetscInt)s.channels.size() - 1};
}

void Scene::shape(Body body, const Shape &shape)
{
  if (recording()) record([=](Scene &s) { s.shape(body, shape); });
  SceneData &s = data();
  s.refuseLate("shape of a body");
  if (body.id != -1 && !s.valid(body)) {
    s.errors.push_back("shape: its body is not one of this scene");
    return;
  }
  if (!shape.size.allFinite() || shape.size.minCoeff() < 0) s.errors.push_back("shape of " + s.bodyName(body.id) + ": sizes must be finite and not negative");
  s.shapes.push_back({body.id, shape});
}

void Scene::surface(Body body, std::shared_ptr<const Surface> surface)
{
  if (recording()) record([=](Scene &s) { s.surface(body, surface); });
  SceneData &s = data();
  s.refuseLate("surface of a body");
  if (!s.valid(body) || !s.bodies[body.id].flexible) {
    s.errors.push_back("surface: its body is not a flexible one of this scene");
    return;
  }
  s.surfaces.push_back({body.id, std::move(surface)});
}

void Scene::line(const std::vector<Marker> &markers)
{
  if (recording()) record([=](Scene &s) { s.line(markers); });
  SceneData            &s = data();
  std::vector<PetscInt> ids;
  s.refuseLate("line");
  for (Marker m : markers) {
    if (!s.valid(m) || s.markers[m.id].body < -1) s.errors.push_back("line: a marker is not one of this scene");
    ids.push_back(m.id);
  }
  if (ids.size() < 2) s.errors.push_back("line: it takes two markers or more");
  s.lines.push_back(ids);
}

} // namespace hhtdae
