/* Torsional springs and dampers: TorsionalSpringDamper and NonlinearTorsionalSpring. */
#include "requirements.h"
#include "scene/kernels/spring_torsion.h"

namespace hhtdae
{

namespace
{

void CheckMarkers(ElementBuilder &e, Marker i, Marker j)
{
  RequireTwoBodies(e, i, j);
  RequireTurning(e, i, "i");
  RequireTurning(e, j, "j");
  if (e.good())
    e.require(AngleDefined(e.frame(i), e.frame(j)),
              "the x axis of marker i is along the z axis of j, the angle about it is undefined; turn marker i");
}

void CheckMoment(ElementBuilder &e, const ForceLaw &moment, double angle, double rate)
{
  const Real        y       = moment(Real(angle, 2, 0), Real(rate, 2, 1));
  const char       *names[] = {"angle", "rate"};
  const std::string where   = " at angle " + Show(angle) + " and rate " + Show(rate) + " of the start, must be finite";
  e.require(std::isfinite(y.value()), "its moment is " + Show(y.value()) + where);
  for (int k = 0; k < y.derivatives().size(); k++)
    e.require(std::isfinite(y.derivatives()(k)),
              std::string("the derivative of its moment by ") + names[k] + " is " + Show(y.derivatives()(k)) + where);
}

} // namespace

template <> Element Scene::enter(const std::string &name, const TorsionalSpringDamper &s)
{
  ElementBuilder e(*this, name, "torsional spring-damper", ElementData::Force, s.i, s.j);
  double         start = 0;
  RequireNotNegative(e, "stiffness", s.stiffness);
  RequireNotNegative(e, "damping", s.damping);
  RequireFinite(e, "angle", s.angle);
  RequireFinite(e, "preload", s.preload);
  CheckMarkers(e, s.i, s.j);
  if (e.good()) start = PrincipalAngle<double>(e.frame(s.i), e.frame(s.j));
  if (s.damping > 0)
    e.load<LinearTorsion<true>>({s.i, s.j}, {{start}, s.stiffness, s.damping, s.angle, s.preload}, {}, s.state);
  else
    e.load<LinearTorsion<false>>({s.i, s.j}, {{start}, s.stiffness, 0, s.angle, s.preload}, {}, s.state);
  return e.done();
}

template <> Element Scene::enter(const std::string &name, const NonlinearTorsionalSpring &s)
{
  ElementBuilder e(*this, name, "nonlinear torsional spring", ElementData::Force, s.i, s.j);
  double         start = 0;
  e.require((bool)s.moment, "it has no moment; give a function of angle and rate");
  CheckMarkers(e, s.i, s.j);
  if (e.good()) {
    const Frame<double> i = e.frame(s.i), j = e.frame(s.j);
    start = PrincipalAngle<double>(i, j);
    CheckMoment(e, s.moment, start, AngleRate<double>(i, j, data().twist(s.i), data().twist(s.j)));
  }
  e.load<CurveTorsion>({s.i, s.j}, {{start}, s.moment}, {}, s.state);
  return e.done();
}

} // namespace hhtdae
