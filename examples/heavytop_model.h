/* Bodies on a ball joint. */
#ifndef HHTEX_HEAVYTOP_MODEL_H
#define HHTEX_HEAVYTOP_MODEL_H

#include <hhtdae/scene.h>

namespace hhtex
{

/* mass, moments of inertia about the centre, its place and the angular velocity at the start in body axes, which are
 * those of space */
inline hhtdae::RigidBody Top(double mass, const hhtdae::Vector3 &J, const hhtdae::Vector3 &center,
                             const hhtdae::Vector3 &spin)
{
  hhtdae::RigidBody b;
  b.mass             = mass;
  b.inertia          = J.asDiagonal();
  b.center           = center;
  b.velocity         = spin.cross(center);
  b.angular_velocity = spin;
  return b;
}

inline void Hang(hhtdae::Scene &scene, const hhtdae::RigidBody &body)
{
  using namespace hhtdae;
  scene.gravity({0, 0, -9.81});
  const Body   b     = scene.add("top", body);
  const Marker pivot = scene.marker(b), center = scene.marker(b, body.center);
  scene.shape(b, Shape::cylinder(0.3, 0.1, body.center));
  const Element joint = scene.add("pivot", Spherical{pivot, scene.marker(scene.ground())});
  for (int k = 0; k < 3; k++) scene.channel(std::string("x.") + "xyz"[k], Measure::displacement(center, k), "m");
  for (int k = 0; k < 3; k++)
    scene.channel(std::string("Omega.") + "xyz"[k], Measure::angularVelocity(pivot, k, {}, pivot), "rad/s");
  for (int k = 0; k < 3; k++) scene.channel(std::string("F.") + "xyz"[k], Measure::jointForce(joint, k), "N");
  scene.channel("kinetic", Measure::kineticEnergy(), "J");
  scene.channel("potential", Measure::potentialEnergy(), "J");
}

/* 24 revolutions a second */
struct FastTop {
  hhtdae::Scene scene;
  explicit FastTop(MPI_Comm comm = PETSC_COMM_WORLD) : scene(comm)
  {
    Hang(scene, Top(15, {0.234375, 0.46875, 0.234375}, {0, 1, 0}, {0, 150, -4.61538}));
  }
};

/* A body spun about the middle one of its principal axes: it turns over */
struct TumblingTop {
  hhtdae::Scene scene;
  explicit TumblingTop(MPI_Comm comm = PETSC_COMM_WORLD) : scene(comm)
  {
    Hang(scene, Top(1, {0.1, 0.2, 0.3}, {0.5, 0, 0}, {0.4, 4, 0.4}));
  }
};

} // namespace hhtex

#endif
