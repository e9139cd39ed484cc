/*
  Rolling without slip and the knife edge: a holonomic row for the contact, velocity-level rows for its tangents. The
  body stays on the side of the plane on which it starts. Multipliers: force of the contact on i's body along the
  axes of j named in rolling.h, first along the normal.
*/
#include "scene/kernels/rolling.h"
#include "joint_builder.h"
#include "scene/kernels/primitives.h"

namespace hhtdae
{

namespace
{

/* The radius, and the side of the plane normal to axis `normal` of j on which the centre is at the start; the positive side if the centre is
   in the plane */
RollingData StartOnPlane(JointBuilder &e, double radius, int normal)
{
  RollingData data{radius, 1};
  e.positive("radius", radius);
  if (e.good() && (e.start(0).x - e.start(1).x).dot(e.start(1).R.col(normal)) < 0) data.side = -1;
  return data;
}

/* Magnitude of the cosine of the angle between axis a of i and z_j at the start */
double CosineToNormal(const JointBuilder &e, int a) { return std::abs(e.start(0).R.col(a).dot(e.start(1).R.col(2))); }

} // namespace

/* Multipliers: force along the normal away from the plane; friction along j's x and y axes. In planar scenes the disc is a wheel on
   the x axis of j: force along y_j, friction along x_j. */
template <> Element Scene::enter(const std::string &name, const RollingDisc &s)
{
  JointBuilder      e(*this, name, "rolling disc", s.i, s.j);
  const RollingData data = StartOnPlane(e, s.radius, e.planar() ? 1 : 2);
  if (e.planar()) {
    e.rows<OnPlane<1>>({data.side * s.radius});
    e.rows<SphereNoSlip<1, 1>>(data);
    return e.done();
  }
  if (e.good())
    e.require(CosineToNormal(e, 2) < std::cos(DiscOnPlane::flat_angle),
              "the disc lies flat on the plane at the start, z_i must not be normal to the plane");
  e.rows<DiscOnPlane>(data);
  e.rows<DiscNoSlip>(data);
  return e.done();
}

/* Multipliers: force along z_j; friction along j's x and y axes. */
template <> Element Scene::enter(const std::string &name, const RollingSphere &s)
{
  JointBuilder e(*this, name, "rolling sphere", s.i, s.j);
  e.spatialOnly();
  const RollingData data = StartOnPlane(e, s.radius, 2);
  e.rows<OnPlane<2>>({data.side * s.radius});
  e.rows<SphereNoSlip<2, 2>>(data);
  return e.done();
}

/* Multipliers: force along z_j; force along y_i. */
template <> Element Scene::enter(const std::string &name, const KnifeEdge &s)
{
  JointBuilder e(*this, name, "knife edge", s.i, s.j);
  e.spatialOnly();
  if (e.good())
    e.require(CosineToNormal(e, 1) < 1 - 1e-8,
              "y_i is normal to the plane at the start, must have a part in the plane");
  e.rows<OnPlane<2>>();
  e.rows<KnifeNoSlip>();
  return e.done();
}

} // namespace hhtdae
