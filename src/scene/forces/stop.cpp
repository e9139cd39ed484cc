/* Stops of joints, ropes and struts */
#include "scene/kernels/stop.h"
#include "contact_requirements.h"

namespace hhtdae
{

namespace
{

StopData CheckedStop(ElementBuilder &e, double lower, double upper, const ContactLaw &law)
{
  StopData d{};
  e.require(!std::isnan(lower) && !std::isnan(upper) && lower <= upper, "lower is " + Show(lower) + " and upper " + Show(upper) + ", must be numbers with lower <= upper");
  e.require(std::isfinite(lower) || std::isfinite(upper), "neither lower nor upper is given");
  e.require(law.friction == 0, "friction coefficient is " + Show(law.friction) + ", a stop has none");
  d.lower = lower;
  d.upper = upper;
  d.law   = CheckedLaw(e, law);
  return d;
}

} // namespace

template <> Element Scene::enter(const std::string &name, const RotationalStop &s)
{
  ElementBuilder e(*this, name, "rotational stop", ElementData::Force, s.i, s.j);
  RequireTwoBodies(e, s.i, s.j);
  RequireTurning(e, s.i, "i");
  RequireTurning(e, s.j, "j");
  if (e.good())
    e.require(AngleDefined(e.frame(s.i), e.frame(s.j)), "the x axis of marker i is along the z axis of j, the angle about it is undefined; turn marker i");
  StopData d = CheckedStop(e, s.lower, s.upper, s.law);
  if (e.good()) d.memory[0] = PrincipalAngle<double>(e.frame(s.i), e.frame(s.j));
  e.load<TurnStop>({s.i, s.j}, d, {}, s.state);
  return e.done();
}

template <> Element Scene::enter(const std::string &name, const TranslationalStop &s)
{
  ElementBuilder e(*this, name, "translational stop", ElementData::Force, s.i, s.j);
  RequireTwoBodies(e, s.i, s.j);
  RequireTurning(e, s.j, "j"); /* the force acts at i's origin, which causes a moment about j's origin */
  e.require(s.axis >= 0 && s.axis < 3, "axis is " + std::to_string(s.axis) + ", must be 0, 1 or 2");
  StopData d = CheckedStop(e, s.lower, s.upper, s.law);
  d.axis     = e.slidingAxis(s.axis);
  e.load<AdvanceStop>({s.i, s.j}, d, {}, s.state);
  return e.done();
}

template <> Element Scene::enter(const std::string &name, const DistanceStop &s)
{
  ElementBuilder e(*this, name, "distance stop", ElementData::Force, s.i, s.j);
  RequireTwoBodies(e, s.i, s.j);
  e.require(!(s.lower < 0), "lower is " + Show(s.lower) + ", a distance is not negative");
  e.require(s.lower > 0 || std::isfinite(s.upper), "neither lower nor upper is given");
  if (e.good() && s.lower > 0) e.require(!e.coincident(s.i, s.j), "the markers coincide at the start: below lower, without a direction to be pushed apart");
  const StopData d = CheckedStop(e, s.lower, s.upper, s.law);
  e.load<LengthStop>({s.i, s.j}, d, {}, s.state);
  return e.done();
}

} // namespace hhtdae
