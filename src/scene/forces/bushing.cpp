/* Bushing: six springs and dampers in the axes of marker j. */
#include "scene/kernels/bushing.h"
#include "requirements.h"

namespace hhtdae
{

namespace
{

/* The rotation at the start must be well below half a turn, where rotation vectors are discontinuous */
void CheckRotation(ElementBuilder &e, const Bushing &s)
{
  const Matrix3 R     = e.frame(s.j).R.transpose() * e.frame(s.i).R;
  const double  angle = RotationVector<double>(UnitQuaternion<double>(R)).norm();
  e.require(angle < 3, "marker i is turned by " + Show(angle) +
                           " rad from j at the start, half a turn is too far; align the markers");
}

} // namespace

template <> Element Scene::enter(const std::string &name, const Bushing &s)
{
  ElementBuilder e(*this, name, "bushing", ElementData::Force, s.i, s.j);
  RequireNotNegative(e, "stiffness", s.stiffness);
  RequireNotNegative(e, "torsional_stiffness", s.torsional_stiffness);
  RequireNotNegative(e, "damping", s.damping);
  RequireNotNegative(e, "torsional_damping", s.torsional_damping);
  RequireFinite(e, "force", s.force);
  RequireFinite(e, "moment", s.moment);
  RequireTwoBodies(e, s.i, s.j);
  RequireTurning(e, s.j, "j"); /* the force acts at i, which causes a moment about j's origin */
  const bool elastic = !s.torsional_stiffness.isZero(0) || !s.moment.isZero(0),
             viscous = !s.torsional_damping.isZero(0);
  if (elastic || viscous) RequireTurning(e, s.i, "i");
  if (elastic && e.good()) CheckRotation(e, s);
  if (viscous || !s.damping.isZero(0))
    e.load<BushingForce<true>>({s.i, s.j},
                               {s.stiffness, s.torsional_stiffness, s.damping, s.torsional_damping, s.force, s.moment},
                               {}, s.state);
  else
    e.load<BushingForce<false>>({s.i, s.j},
                                {s.stiffness, s.torsional_stiffness, s.damping, s.torsional_damping, s.force, s.moment},
                                {}, s.state);
  return e.done();
}

} // namespace hhtdae
