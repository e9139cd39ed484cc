/* Mechanisms for the tests of a scene's start. */
#ifndef HHTDAE_TESTS_SCENE_START_H
#define HHTDAE_TESTS_SCENE_START_H

#include "hhtdae/scene.h"
#include "scene_run.h"

namespace hhtest
{

using hhtdae::Body;
using hhtdae::Marker;
using hhtdae::Matrix3;
using hhtdae::RigidBody;
using hhtdae::Scene;
using hhtdae::SceneData;
using hhtdae::Vector3;

/* Axes with z along a unit vector of space */
inline Matrix3 axesAlong(const Vector3 &z)
{
  Matrix3 R;
  R.col(2) = z;
  R.col(0) = (std::abs(z(0)) < 0.5 ? Vector3(1, 0, 0) : Vector3(0, 1, 0)).cross(z).normalized();
  R.col(1) = z.cross(Vector3(R.col(0)));
  return R;
}

/* A slender rod of mass 1 from one point to another, with x along it; its moment of inertia about x is a thousandth of
   that across */
inline RigidBody rod(const Vector3 &from, const Vector3 &to)
{
  RigidBody    b;
  const double L  = (to - from).norm();
  b.position      = (from + to) / 2;
  const Vector3 x = (to - from) / L,
                y = (std::abs(x(2)) < 0.9 ? Vector3(0, 0, 1) : Vector3(1, 0, 0)).cross(x).normalized();
  b.rotation << x, y, x.cross(y);
  b.inertia = (Vector3(1e-3, 1, 1) * L * L / 12).asDiagonal();
  return b;
}

/* A revolute joint of i and j at a point of space about an axis of space */
inline hhtdae::Element pin(Scene &s, const std::string &name, Body i, Body j, const Vector3 &at,
                           const Vector3 &axis = Vector3(0, 0, 1))
{
  return s.add(name, hhtdae::Revolute{s.markerAt(i, at, axesAlong(axis)), s.markerAt(j, at, axesAlong(axis))});
}

/* A four-bar linkage in the xy plane: a crank of length 1, a coupler and a rocker on the ground at a distance of 3 */
struct Linkage {
  Vector3 A{0, 0, 0}, B, C, D{3, 0, 0};
  Body    crank, coupler, rocker;

  explicit Linkage(double angle = 1, double coupler_length = 2.5, double rocker_length = 2)
  {
    B               = Vector3(std::cos(angle), std::sin(angle), 0);
    const Vector3 d = D - B;
    const double  r = d.norm(), x = (r * r + coupler_length * coupler_length - rocker_length * rocker_length) / (2 * r);
    const double  y = std::sqrt(std::max(0.0, coupler_length * coupler_length - x * x));
    C               = B + (x * d + y * Vector3(0, 0, 1).cross(d)) / r;
  }
  /* shift: initial displacement of the rocker from its assembled position; the pins are placed where the bodies meet
     when assembled */
  void build(Scene &s, const RigidBody &crank_body, const Vector3 &shift = Vector3::Zero())
  {
    RigidBody b = rod(C, D);
    crank       = s.add("crank", crank_body);
    coupler     = s.add("coupler", rod(B, C));
    b.position += shift;
    rocker = s.add("rocker", b);
    pin(s, "A", crank, s.ground(), A);
    pin(s, "B", crank, coupler, B);
    s.add("C", hhtdae::Revolute{s.markerAt(coupler, C), s.markerAt(rocker, C + shift)});
    s.add("D", hhtdae::Revolute{s.markerAt(rocker, D + shift), s.marker(s.ground(), D)});
  }
  void build(Scene &s) { build(s, rod(A, B)); }
};

/* Bricard's mechanism (IFToMM benchmark A04): five rods, six revolute joints, one degree of freedom */
inline void bricard(Scene &s)
{
  const Vector3 P[6]    = {{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}};
  const Vector3 axis[3] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  Body          last    = s.ground();
  for (int k = 0; k < 5; k++) {
    const Body next = s.add("rod " + std::to_string(k + 1), rod(P[k], P[k + 1]));
    pin(s, "hinge " + std::to_string(k), next, last, P[k], axis[k % 3]);
    last = next;
  }
  pin(s, "hinge 5", s.ground(), last, P[5], axis[2]);
  s.gravity({0, -9.81, 0});
}

/* A net of n x n nodes of rods with pins in the xy plane, suspended at one corner; its meshes are skewed squares */
inline void net(Scene &s, int n)
{
  const auto                     at = [](int i, int j) { return Vector3(i + 0.2 * j, j - 0.1 * i, 0); };
  std::vector<std::vector<Body>> ends(n * n);
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++)
      for (int side = 0; side < 2; side++) {
        const int k = i + (side == 0), l = j + (side == 1);
        if (k >= n || l >= n) continue;
        const Body b = s.add("", rod(at(i, j), at(k, l)));
        ends[i * n + j].push_back(b);
        ends[k * n + l].push_back(b);
      }
  ends[0].insert(ends[0].begin(), s.ground());
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++)
      for (std::size_t e = 1; e < ends[i * n + j].size(); e++)
        pin(s, "", ends[i * n + j][e], ends[i * n + j][0], at(i, j));
}

} // namespace hhtest

#endif
