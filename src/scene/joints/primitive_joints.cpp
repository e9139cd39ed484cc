/* Elements that consist of a single primitive constraint. Their comments name the multipliers. */
#include "joint_builder.h"
#include "scene/kernels/primitives.h"
#include "scene/kernels/primitives_axes.h"

namespace hhtdae
{

/* Force on i's body along j's x and y axes. */
template <> Element Scene::enter(const std::string &name, const InLine &s)
{
  JointBuilder e(*this, name, "in-line", s.i, s.j);
  e.spatialOnly();
  e.rows<OnLine>();
  return e.done();
}

/* Force on i's body along z_j. */
template <> Element Scene::enter(const std::string &name, const InPlane &s)
{
  JointBuilder e(*this, name, "in-plane", s.i, s.j);
  e.spatialOnly();
  e.rows<OnPlane<2>>();
  return e.done();
}

/* Moment on i's body about j's x and y axes. */
template <> Element Scene::enter(const std::string &name, const ParallelAxes &s)
{
  JointBuilder e(*this, name, "parallel axes", s.i, s.j);
  e.spatialOnly();
  e.branchRows<Parallel>();
  return e.done();
}

/* Moment on i's body about z_j x z_i. */
template <> Element Scene::enter(const std::string &name, const Perpendicular &s)
{
  JointBuilder e(*this, name, "perpendicular", s.i, s.j);
  e.spatialOnly();
  e.rows<AxesPerpendicular<2, 2>>();
  return e.done();
}

/* Moment on i's body about j's axes. */
template <> Element Scene::enter(const std::string &name, const Orientation &s)
{
  JointBuilder e(*this, name, "orientation", s.i, s.j);
  e.spatialOnly();
  e.orientationRows<Orient>();
  return e.done();
}

/* Tension of the link. If the markers coincide, the link has no direction. */
template <> Element Scene::enter(const std::string &name, const PointDistance &s)
{
  JointBuilder e(*this, name, "point distance", s.i, s.j);
  if (!(s.length < 0)) e.positive("length", s.length);
  if (!e.good()) return e.done();
  const double start = e.startDistance();
  e.require(!e.coincident(s.i, s.j), "the markers coincide at the start, must be apart; a spherical joint keeps points together");
  e.rows<Distance>({s.length < 0 ? start : s.length, s.length < 0});
  return e.done();
}

} // namespace hhtdae
