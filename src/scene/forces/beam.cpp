/* Beam between two markers. */
#include "scene/kernels/beam.h"
#include "requirements.h"

namespace hhtdae
{

namespace
{

/* Checks the cross-section; in a planar scene the beam bends about z only */
void CheckSection(ElementBuilder &e, const Beam &s)
{
  RequirePositive(e, "E", s.E);
  RequirePositive(e, "area", s.area);
  RequirePositive(e, "Izz", s.Izz);
  if (!e.planar()) {
    RequirePositive(e, "Iyy", s.Iyy);
    RequirePositive(e, "J", s.J);
    RequirePositive(e, "G", s.G);
  } else {
    RequireNotNegative(e, "Iyy", s.Iyy);
    RequireNotNegative(e, "J", s.J);
    if (s.shear_y > 0 || s.shear_z > 0)
      RequirePositive(e, "G", s.G);
    else
      RequireNotNegative(e, "G", s.G);
  }
  RequireNotNegative(e, "shear_y", s.shear_y);
  RequireNotNegative(e, "shear_z", s.shear_z);
  RequireNotNegative(e, "damping", s.damping);
}

/* Checks that the x axes of the markers point from j to i */
void CheckPlacement(ElementBuilder &e, const Beam &s)
{
  const Frame<double>    f[2] = {e.frame(s.i), e.frame(s.j)};
  Mat3<double>           E;
  const Relative<double> r = BeamForce<false>::relative<double>(f, nullptr, E);
  e.require(!e.coincident(s.i, s.j), "the markers coincide at the start; a beam runs from j to i");
  e.require(r.phi.norm() < 3, "marker i is turned by " + Show(r.phi.norm()) +
                                  " rad from j at the start; the x axes of both must run along the beam, from j to i");
  if (e.good())
    e.require(r.d(0) > 0.5 * r.d.norm(),
              "the x axes of its markers do not point from j to i; they must run along the beam");
}

} // namespace

template <> Element Scene::enter(const std::string &name, const Beam &s)
{
  ElementBuilder e(*this, name, "beam", ElementData::Force, s.i, s.j);
  double         length = s.length;
  CheckSection(e, s);
  e.require(std::isfinite(s.length) && s.length != 0,
            "length is " + Show(s.length) + ", must be positive, or negative for the distance at the start");
  RequireTwoBodies(e, s.i, s.j);
  RequireTurning(e, s.i, "i");
  RequireTurning(e, s.j, "j");
  if (e.good()) {
    CheckPlacement(e, s);
    if (length < 0) length = (e.frame(s.i).x - e.frame(s.j).x).norm();
  }
  const BeamForce<true>::Data d =
      BeamForce<true>::section(length, s.E, s.G, s.area, s.Iyy, s.Izz, s.J, s.shear_y, s.shear_z, s.damping);
  if (s.damping > 0)
    e.load<BeamForce<true>>({s.i, s.j}, d, {}, s.state);
  else
    e.load<BeamForce<false>>({s.i, s.j}, {d.length, d.stretching, d.turning, 0}, {}, s.state);
  return e.done();
}

} // namespace hhtdae
