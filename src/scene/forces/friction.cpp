/* Friction in joints: selects the kernel for the type of the joint, whose inputs are the multipliers of the joint's position rows;
   kernels/friction.h */
#include "scene/kernels/friction.h"
#include "requirements.h"

namespace hhtdae
{

namespace
{

template <class K> void Enter(ElementBuilder &e, const JointFriction &s, Marker i, Marker j, int axis)
{
  std::vector<ScalarRef> load;
  for (int row = 0; row < K::inputs; row++)
    load.push_back({ScalarRef::Multiplier, s.joint.id, row}); /* the position rows of the joint come first */
  e.load<K>({i, j}, {s.coefficient, s.radius, s.slip_velocity, axis}, load);
}

void Check(ElementBuilder &e, const JointFriction &s, Marker i, Marker j, bool turns)
{
  RequireNotNegative(e, "coefficient", s.coefficient);
  RequirePositive(e, "slip velocity", s.slip_velocity);
  if (!turns) return;
  RequirePositive(e, "radius of pin or ball", s.radius);
  RequireTurning(e, i, "i");
  RequireTurning(e, j, "j");
}

} // namespace

template <> Element Scene::enter(const std::string &name, const JointFriction &s)
{
  const auto       &all   = data().elements;
  const bool        known = data().valid(s.joint);
  const Marker      i = known ? all[s.joint.id].i : Marker{}, j = known ? all[s.joint.id].j : Marker{};
  const std::string type = known ? all[s.joint.id].type : "", joint = known ? all[s.joint.id].name : "";
  ElementBuilder    e(*this, name, "joint friction", ElementData::Force, i, j);
  const bool        planar = e.planar();
  e.require(known, "its joint is not an element of this scene; add the joint first");
  if (type == "revolute") {
    Check(e, s, i, j, true);
    if (planar)
      Enter<RevoluteFriction<2>>(e, s, i, j, 2);
    else
      Enter<RevoluteFriction<3>>(e, s, i, j, 2);
  } else if (type == "translational") {
    Check(e, s, i, j, false);
    if (planar)
      Enter<TranslationalFriction<1>>(e, s, i, j, 0); /* planar translations are along x_j */
    else
      Enter<TranslationalFriction<2>>(e, s, i, j, 2);
  } else if (type == "cylindrical") {
    Check(e, s, i, j, true);
    Enter<CylindricalFriction>(e, s, i, j, 2);
  } else if (type == "spherical") {
    Check(e, s, i, j, true);
    Enter<SphericalFriction>(e, s, i, j, 2);
  } else if (known) {
    e.require(false, "\"" + joint + "\" is of type " + type +
                         "; friction is for revolute, translational, cylindrical and spherical joints");
  }
  return e.done();
}

} // namespace hhtdae
