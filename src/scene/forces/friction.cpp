/* Friction in joints: the kernel that fits the joint, with the multipliers of its position rows as inputs;
 * kernels/friction.h */
#include "scene/kernels/friction.h"
#include "scene/scene_data.h"
#include <cstring>
#include <sstream>

namespace hhtdae
{

namespace
{

template <class K> void Enter(ElementBuilder &e, const JointFriction &s, Marker i, Marker j, int axis)
{
  std::vector<ScalarRef> load;
  for (int row = 0; row < K::inputs; row++)
    load.push_back({ScalarRef::Multiplier, s.joint.id, row}); /* position rows come first */
  e.load<K>({i, j}, {s.coefficient, s.radius, s.slip_velocity, axis}, load);
}

void CheckNumbers(ElementBuilder &e, const JointFriction &s, bool turns)
{
  auto check = [&e](bool good, const char *what, double x, const char *must) {
    std::ostringstream message;
    message << what << " is " << x << ", must " << must;
    e.require(good && std::isfinite(x), message.str());
  };
  check(s.coefficient >= 0, "coefficient", s.coefficient, "not be negative");
  check(s.slip_velocity > 0, "slip velocity", s.slip_velocity, "be positive");
  if (turns) check(s.radius > 0, "radius of pin or ball", s.radius, "be positive");
}

} // namespace

template <> Element Scene::add(const std::string &name, const JointFriction &s)
{
  const auto       &all   = data_->elements;
  const bool        known = s.joint.id >= 0 && s.joint.id < (PetscInt)all.size();
  const Marker      i = known ? all[s.joint.id].i : Marker{}, j = known ? all[s.joint.id].j : Marker{};
  const std::string type = known ? all[s.joint.id].type : "", joint = known ? all[s.joint.id].name : "";
  ElementBuilder    e(*this, name, "joint friction", ElementData::Force, i, j);
  const bool        planar = e.planar();
  e.require(known, "its joint is not an element of this scene; add the joint first");
  if (type == "revolute") {
    CheckNumbers(e, s, true);
    if (planar)
      Enter<RevoluteFriction<2>>(e, s, i, j, 2);
    else
      Enter<RevoluteFriction<3>>(e, s, i, j, 2);
  } else if (type == "translational") {
    CheckNumbers(e, s, false);
    if (planar)
      Enter<TranslationalFriction<1>>(e, s, i, j, 0); /* planar translations are along x_j */
    else
      Enter<TranslationalFriction<2>>(e, s, i, j, 2);
  } else if (type == "cylindrical") {
    CheckNumbers(e, s, true);
    Enter<CylindricalFriction>(e, s, i, j, 2);
  } else if (type == "spherical") {
    CheckNumbers(e, s, true);
    Enter<SphericalFriction>(e, s, i, j, 2);
  } else if (known) {
    e.require(false, "\"" + joint + "\" is a " + type +
                         "; friction is for revolute, translational, cylindrical and spherical joints");
  }
  return e.done();
}

} // namespace hhtdae
