/* Springs and dampers along the line between two markers: SpringDamper and NonlinearSpring. */
#include "scene/kernels/spring.h"
#include "requirements.h"

namespace hhtdae
{

namespace
{

void CheckDirection(ElementBuilder &e, const SpringDamper &s)
{
  const char *where = "the markers coincide at the start, ";
  e.require(!s.state, std::string(where) +
                          "which leaves its force state without a direction; move one of them or set state = false");
  e.require(s.length <= 0, std::string(where) + "which leaves a free length of " + Show(s.length) +
                               " without a direction; move one of them or set the length to 0");
  e.require(s.preload == 0, std::string(where) + "which leaves a preload of " + Show(s.preload) +
                                " without a direction; move one of them or drop the preload");
}

void CheckTension(ElementBuilder &e, const ForceLaw &tension, double length, double rate)
{
  const Real        y       = tension(Real(length, 2, 0), Real(rate, 2, 1));
  const char       *names[] = {"length", "rate"};
  const std::string where = " at length " + Show(length) + " and rate " + Show(rate) + " of the start, must be finite";
  e.require(std::isfinite(y.value()), "its tension is " + Show(y.value()) + where);
  for (int k = 0; k < y.derivatives().size(); k++)
    e.require(std::isfinite(y.derivatives()(k)),
              std::string("the derivative of its tension by ") + names[k] + " is " + Show(y.derivatives()(k)) + where);
}

} // namespace

template <> Element Scene::enter(const std::string &name, const SpringDamper &s)
{
  ElementBuilder e(*this, name, "spring-damper", ElementData::Force, s.i, s.j);
  double         length = s.length;
  RequireNotNegative(e, "stiffness", s.stiffness);
  RequireNotNegative(e, "damping", s.damping);
  RequireFinite(e, "length", s.length);
  RequireFinite(e, "preload", s.preload);
  RequireTwoBodies(e, s.i, s.j);
  if (e.good()) {
    const Frame<double> i = e.frame(s.i), j = e.frame(s.j);
    const bool          coincident = e.coincident(s.i, s.j);
    if (coincident) CheckDirection(e, s);
    if (length < 0) length = coincident ? 0 : (i.x - j.x).norm();
  }
  if (s.damping > 0)
    e.load<LinearSpring<true>>({s.i, s.j}, {s.stiffness, s.damping, length, s.preload}, {}, s.state);
  else
    e.load<LinearSpring<false>>({s.i, s.j}, {s.stiffness, 0, length, s.preload}, {}, s.state);
  return e.done();
}

template <> Element Scene::enter(const std::string &name, const NonlinearSpring &s)
{
  ElementBuilder e(*this, name, "nonlinear spring", ElementData::Force, s.i, s.j);
  e.require((bool)s.tension, "it has no tension; give a function of length and rate");
  RequireTwoBodies(e, s.i, s.j);
  if (e.good()) {
    const Frame<double> f[2] = {e.frame(s.i), e.frame(s.j)};
    const Twist<double> w[2] = {data().twist(s.i), data().twist(s.j)};
    const Line<double>  line(f);
    e.require(!e.coincident(s.i, s.j),
              "the markers coincide at the start, which leaves the tension without a direction; move one of them");
    if (e.good()) CheckTension(e, s.tension, line.length, line.rate(w));
  }
  e.load<CurveSpring>({s.i, s.j}, {s.tension}, {}, s.state);
  return e.done();
}

} // namespace hhtdae
