/* Rods in a chain, or in a net with closed loops. */
#ifndef HHTEX_CHAIN_MODEL_H
#define HHTEX_CHAIN_MODEL_H

#include <hhtdae/scene.h>

#include <vector>

namespace hhtex
{

/* A rod of 1 kg and 1 m, x along it */
inline hhtdae::Body AddRod(hhtdae::Scene &scene, const hhtdae::Vector3 &from, const hhtdae::Matrix3 &rotation)
{
  using namespace hhtdae;
  RigidBody rod;
  rod.mass     = 1;
  rod.inertia  = Vector3(1e-3, 1. / 12, 1. / 12).asDiagonal();
  rod.rotation = rotation;
  rod.position = from + rotation.col(0) / 2;
  const Body b = scene.add("", rod);
  scene.shape(
      b, Shape::cylinder(0.03, 1, {0, 0, 0}, Eigen::AngleAxisd(PETSC_PI / 2, Vector3::UnitY()).toRotationMatrix()));
  return b;
}

/* A chain of n rods from the origin along x; returns the end of the last rod */
inline hhtdae::Marker AddChain(hhtdae::Scene &scene, PetscInt n, bool spherical)
{
  using namespace hhtdae;
  Marker last = scene.marker(scene.ground());
  for (PetscInt k = 0; k < n; k++) {
    const Body   b     = AddRod(scene, {(double)k, 0, 0}, Matrix3::Identity());
    const Marker first = scene.marker(b, {-0.5, 0, 0});
    if (spherical)
      scene.add("", Spherical{first, last});
    else
      scene.add("", Revolute{first, last});
    last = scene.marker(b, {0.5, 0, 0});
  }
  return last;
}

/* Knots in the xz plane, the first row held by the ground; rods along the rows and the columns */
inline hhtdae::Marker AddNet(hhtdae::Scene &scene, PetscInt rows, PetscInt columns)
{
  using namespace hhtdae;
  std::vector<Marker> knot(columns);
  const Matrix3       along_z = Eigen::AngleAxisd(-PETSC_PI / 2, Vector3::UnitY()).toRotationMatrix();
  for (PetscInt r = 0; r <= rows; r++)
    for (PetscInt c = 0; c < columns; c++) {
      const Vector3 x((double)c, 0, (double)r);
      const Marker  above = knot[c];
      if (r == 0) {
        knot[c] = scene.marker(scene.ground(), x);
        continue;
      }
      PointMass p;
      p.mass          = 0.5;
      p.position      = x;
      knot[c]         = scene.marker(scene.add("", p));
      const Body down = AddRod(scene, x - Vector3::UnitZ(), along_z);
      scene.add("", Spherical{scene.marker(down, {-0.5, 0, 0}), above});
      scene.add("", Spherical{scene.marker(down, {0.5, 0, 0}), knot[c]});
      if (c == 0) continue;
      const Body across = AddRod(scene, x - Vector3::UnitX(), Matrix3::Identity());
      scene.add("", Spherical{scene.marker(across, {-0.5, 0, 0}), knot[c - 1]});
      scene.add("", Spherical{scene.marker(across, {0.5, 0, 0}), knot[c]});
    }
  return knot[columns - 1];
}

} // namespace hhtex

#endif
