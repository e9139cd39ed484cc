/* Two rods that fall from the horizontal: in revolute joints or, with the second rod perpendicular to the first, on ball joints. */
#ifndef HHTEX_DOUBLEPENDULUM_MODEL_H
#define HHTEX_DOUBLEPENDULUM_MODEL_H

#include <hhtdae/scene.h>

namespace hhtex
{

struct DoublePendulumScene {
  hhtdae::Scene scene;

  explicit DoublePendulumScene(bool spherical, bool planar, MPI_Comm comm = PETSC_COMM_WORLD)
      : scene(comm, planar ? hhtdae::Space::Planar : hhtdae::Space::Spatial)
  {
    using namespace hhtdae;
    scene.gravity({0, -9.81, 0});
    Matrix3 across; /* x of the second rod along space z */
    across << 0, 0, -1, 0, 1, 0, 1, 0, 0;
    const Body   a   = rod("upper rod", {0, 0, 0}, Matrix3::Identity());
    const Body   b   = rod("lower rod", {1, 0, 0}, spherical ? across : Matrix3(Matrix3::Identity()));
    const Marker top = scene.marker(a, {-0.5, 0, 0}), elbow = scene.marker(a, {0.5, 0, 0}),
                 hand = scene.marker(b, {-0.5, 0, 0});
    const Marker tip = scene.marker(b, {0.5, 0, 0}), origin = scene.marker(scene.ground());
    if (spherical) {
      scene.add("shoulder", Spherical{top, origin});
      scene.add("elbow", Spherical{hand, elbow});
    } else {
      scene.add("shoulder", Revolute{top, origin});
      scene.add("elbow", Revolute{hand, elbow});
    }
    scene.channel("tip.x", Measure::displacement(tip, 0), "m");
    scene.channel("tip.y", Measure::displacement(tip, 1), "m");
    scene.channel("kinetic", Measure::kineticEnergy(), "J");
    scene.channel("potential", Measure::potentialEnergy(), "J");
  }

private:
  /* 1 kg, 1 m, x along it */
  hhtdae::Body rod(const char *name, const hhtdae::Vector3 &from, const hhtdae::Matrix3 &rotation)
  {
    hhtdae::RigidBody b;
    b.mass                   = 1;
    b.inertia                = hhtdae::Vector3(1e-3, 1. / 12, 1. / 12).asDiagonal();
    b.rotation               = rotation; /* x along the rod */
    b.position               = from + rotation.col(0) * 0.5;
    const hhtdae::Body added = scene.add(name, b);
    scene.shape(added, hhtdae::Shape::box({0.5, 0.03, 0.03}));
    return added;
  }
};

} // namespace hhtex

#endif
