/*
  Joints of coincident points and parallel axes. The comment of each joint lists its multipliers in their order: forces on i's body,
  which act at i's origin, then moments on it. Planar scenes have only the rows in the plane, and translation is along x_j, since z
  is normal to the plane.
*/
#include "joint_builder.h"
#include "scene/kernels/convel.h"
#include "scene/kernels/primitives.h"
#include "scene/kernels/primitives_axes.h"

namespace hhtdae
{

/* Force in space axes. */
template <> Element Scene::enter(const std::string &name, const Spherical &s)
{
  JointBuilder e(*this, name, "spherical", s.i, s.j);
  e.spatialOnly();
  e.rows<Coincide>();
  return e.done();
}

/* Force in space axes; moment about j's x and y axes. */
template <> Element Scene::enter(const std::string &name, const Revolute &s)
{
  JointBuilder e(*this, name, "revolute", s.i, s.j);
  if (e.planar()) {
    e.rows<Coincide2>();
  } else {
    e.rows<Coincide>();
    e.branchRows<Parallel>();
  }
  return e.done();
}

/* Force in space axes; moment about z_j x z_i. */
template <> Element Scene::enter(const std::string &name, const Universal &s)
{
  JointBuilder e(*this, name, "universal", s.i, s.j);
  e.spatialOnly();
  e.rows<Coincide>();
  e.rows<AxesPerpendicular<2, 2>>();
  return e.done();
}

/* Force in space axes; moment, see convel.h. The z axes may point in the same direction or away from each other, as at
   the start. */
template <> Element Scene::enter(const std::string &name, const ConstantVelocity &s)
{
  JointBuilder e(*this, name, "constant velocity", s.i, s.j);
  e.spatialOnly();
  e.rows<Coincide>();
  if (e.good() && e.start(0).R.col(2).dot(e.start(1).R.col(2)) < 0)
    e.rows<EqualRotation<true>>();
  else
    e.rows<EqualRotation<false>>();
  return e.done();
}

/* Force along j's x and y axes, moment about j's axes. Planar: force along y_j, moment about z. */
template <> Element Scene::enter(const std::string &name, const Translational &s)
{
  JointBuilder e(*this, name, "translational", s.i, s.j);
  if (e.planar()) {
    e.rows<OnPlane<1>>();
    e.branchRows<OrientInPlane>();
  } else {
    e.rows<OnLine>();
    e.orientationRows<Orient>();
  }
  return e.done();
}

/* Force along j's x and y axes, moment about them. */
template <> Element Scene::enter(const std::string &name, const Cylindrical &s)
{
  JointBuilder e(*this, name, "cylindrical", s.i, s.j);
  e.spatialOnly();
  e.rows<OnLine>();
  e.branchRows<Parallel>();
  return e.done();
}

/* Force along z_j, moment about j's x and y axes. */
template <> Element Scene::enter(const std::string &name, const Planar &s)
{
  JointBuilder e(*this, name, "planar", s.i, s.j);
  e.spatialOnly();
  e.rows<OnPlane<2>>();
  e.branchRows<Parallel>();
  return e.done();
}

/* Force in space axes, moment about j's axes. Planar: force along x and y, moment about z. */
template <> Element Scene::enter(const std::string &name, const Fixed &s)
{
  JointBuilder e(*this, name, "fixed", s.i, s.j);
  if (e.planar()) {
    e.rows<Coincide2>();
    e.branchRows<OrientInPlane>();
  } else {
    e.rows<Coincide>();
    e.orientationRows<Orient>();
  }
  return e.done();
}

} // namespace hhtdae
