/*
  Helpers for describing scenes: axes along a direction, moments of inertia, joints from a point and an axis.

    RigidBody rod;
    rod.mass     = 2;
    rod.inertia  = inertia::cylinder(rod.mass, 0.02, 1);           its axis is z
    rod.rotation = axesAlong(direction);                           z along the rod
    connect<Revolute>(scene, "pin", arm, scene.ground(), point, axis);
*/
#ifndef HHTDAE_HELPERS_H
#define HHTDAE_HELPERS_H

#include "hhtdae/scene.h"
#include <cmath>
#include <type_traits>

namespace hhtdae
{

/* Orthonormal right-handed axes (columns). The z axis is along `z`, which need not be of unit length; the x axis is the direction
   perpendicular to it that is nearest to `x`. If `x` is along z or not given, the space axis along which z has its smallest component (the
   first of several) takes the place of `x`: z along (0, 0, 1) gives the space axes themselves. */
inline Matrix3 axesAlong(const Vector3 &z, const Vector3 &x = Vector3::Zero())
{
  Matrix3 A;
  A.col(2)        = z.normalized();
  Vector3 p       = x - A.col(2).dot(x) * A.col(2);
  if (!(p.norm() > 1e-8 * x.norm())) {
    const Vector3 a     = A.col(2).cwiseAbs();
    const int     least = a(0) <= a(1) && a(0) <= a(2) ? 0 : a(1) <= a(2) ? 1 : 2;
    p                   = Vector3::Unit(least) - A(least, 2) * A.col(2);
  }
  A.col(0) = p.normalized();
  A.col(1) = A.col(2).cross(A.col(0));
  return A;
}

/* Moments of inertia of homogeneous bodies about their centre of mass, in their own axes */
namespace inertia
{

inline Matrix3 diagonal(double x, double y, double z) { return Vector3(x, y, z).asDiagonal(); }
/* full edges along x, y, z */
inline Matrix3 box(double mass, const Vector3 &e)
{
  const Vector3 s = e.cwiseAbs2();
  return mass / 12 * diagonal(s(1) + s(2), s(2) + s(0), s(0) + s(1));
}
/* about z, hollow from `inner` to `outer` */
inline Matrix3 tube(double mass, double outer, double inner, double length)
{
  const double r2 = outer * outer + inner * inner, side = mass * (r2 / 4 + length * length / 12);
  return diagonal(side, side, mass * r2 / 2);
}
/* thin, along z, without a moment about it */
inline Matrix3 rod(double mass, double length) { return tube(mass, 0, 0, length); }
inline Matrix3 cylinder(double mass, double radius, double length) { return tube(mass, radius, 0, length); }
inline Matrix3 disc(double mass, double radius) { return tube(mass, radius, 0, 0); }
inline Matrix3 ellipsoid(double mass, const Vector3 &radii)
{
  const Vector3 s = radii.cwiseAbs2();
  return mass / 5 * diagonal(s(1) + s(2), s(2) + s(0), s(0) + s(1));
}
inline Matrix3 sphere(double mass, double radius) { return ellipsoid(mass, Vector3::Constant(radius)); }

/* Parallel-axis theorem (Steiner): inertia about the point at d from the centre of mass. RigidBody::inertia is about the centre of
   mass, so the result is of use there only as a part of a sum about the common centre of mass */
inline Matrix3 about(const Matrix3 &J, double mass, const Vector3 &d) { return J + mass * (d.squaredNorm() * Matrix3::Identity() - d * d.transpose()); }
/* Inertia J, given in the part's own axes (the columns of R), transformed to the axes in which R is given */
inline Matrix3 turned(const Matrix3 &J, const Matrix3 &R) { return R * J * R.transpose(); }

} // namespace inertia

/* One rigid body made of several parts: total mass, centre of mass and inertia. Its origin and axes are those in which the positions and
   rotations of the parts are given. */
inline RigidBody composed(const std::vector<RigidBody> &parts)
{
  RigidBody all;
  all.mass    = 0;
  all.inertia = Matrix3::Zero();
  for (const RigidBody &p : parts) {
    all.mass += p.mass;
    all.center += p.mass * (p.position + p.rotation * p.center);
  }
  all.center /= all.mass;
  for (const RigidBody &p : parts) all.inertia += inertia::about(inertia::turned(p.inertia, p.rotation), p.mass, p.position + p.rotation * p.center - all.center);
  return all;
}

/* A joint of two bodies from a point and an axis at the start, both in space axes: makes markers on both bodies there, with the axes
   axesAlong(axis). For all joints between two coinciding markers: Revolute, Spherical, Cylindrical, Translational, Planar, Fixed, Screw,
   InLine, InPlane, ParallelAxes, Orientation. In planar scenes the axis is z, and Translational slides along x of space; for another
   direction make the markers yourself. */
template <class Joint> Element connect(Scene &scene, const std::string &name, Body i, Body j, const Vector3 &point, const Vector3 &axis = Vector3::UnitZ())
{
  static_assert(!std::is_same_v<Joint, Universal>, "connect() makes z axes parallel, those of a Universal are perpendicular: give it two markers of their own");
  const Matrix3 A = axesAlong(axis);
  Joint         joint;
  joint.i = scene.markerAt(i, point, A);
  joint.j = scene.markerAt(j, point, A);
  return scene.add(name, joint);
}

} // namespace hhtdae

#endif
