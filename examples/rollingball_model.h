/* A ball and a disc that roll without slip on a plane. */
#ifndef HHTEX_ROLLINGBALL_MODEL_H
#define HHTEX_ROLLINGBALL_MODEL_H

#include <hhtdae/scene.h>

#include <cmath>

namespace hhtex
{

/* A ball on a slope; x down the slope, y across it */
struct RollingBall {
  static constexpr double mass = 2, radius = 0.3, across = 0.7 /* m/s, at the start */, g = 9.81;
  hhtdae::Scene           scene;
  explicit RollingBall(double angle, MPI_Comm comm = PETSC_COMM_WORLD) : scene(comm)
  {
    using namespace hhtdae;
    Matrix3 plane = Eigen::AngleAxisd(angle, Vector3::UnitY()).toRotationMatrix();
    scene.gravity({0, 0, -g});
    RigidBody ball;
    ball.mass             = mass;
    ball.inertia          = Matrix3::Identity() * (0.4 * mass * radius * radius);
    ball.position         = plane.col(2) * radius;
    ball.velocity         = plane.col(1) * across;
    ball.angular_velocity = plane.col(0) * (-across / radius);
    const Body    b       = scene.add("ball", ball);
    const Marker  ramp = scene.marker(scene.ground(), {0, 0, 0}, plane), center = scene.marker(b);
    const Element roll = scene.add("rolling", RollingSphere{center, ramp, radius});
    scene.shape(b, Shape::sphere(radius));
    for (int k = 0; k < 3; k++)
      scene.channel(std::string("x.") + "xyz"[k], Measure::displacement(center, k, ramp, ramp), "m");
    for (int k = 0; k < 3; k++) scene.channel(std::string("force.") + "nxy"[k], Measure::multiplier(roll, k), "N");
  }
};

/*
  The moments of inertia of a thin disc about its centre are C = m r^2/2 about the axis and A = C/2 perpendicular to it. With a lean s towards
  the middle of the circle of radius R, the balance of moments at the turning rate W is W^2 ((3/2) R + (r/4) sin s) = g tan s.
*/
struct LeaningDisc {
  static constexpr double mass = 2, r = 0.5, g = 9.81;
  hhtdae::Scene           scene;
  double                  W; /* turning rate */
  LeaningDisc(double s, double R, MPI_Comm comm = PETSC_COMM_WORLD)
      : scene(comm), W(std::sqrt(g * std::tan(s) / (1.5 * R + 0.25 * r * std::sin(s))))
  {
    using namespace hhtdae;
    scene.gravity({0, 0, -g});
    RigidBody     disc;
    const Vector3 axis(std::cos(s), 0, std::sin(s)); /* outwards and up */
    disc.mass    = mass;
    disc.inertia = Vector3(0.25, 0.25, 0.5).asDiagonal() * (mass * r * r);
    disc.rotation << Vector3::UnitY().cross(axis), Vector3::UnitY(), axis;
    disc.position         = {R, 0, r * std::cos(s)};
    disc.velocity         = {0, W * R, 0};
    disc.angular_velocity = Vector3(0, 0, W) - axis * (W * (R + r * std::sin(s)) / r);
    const Body   b        = scene.add("disc", disc);
    const Marker center   = scene.marker(b);
    scene.shape(b, Shape::cylinder(r, 0.02));
    const Element roll = scene.add("rolling", hhtdae::RollingDisc{center, scene.marker(scene.ground()), r});
    for (int k = 0; k < 3; k++) scene.channel(std::string("x.") + "xyz"[k], Measure::displacement(center, k), "m");
    for (int k = 0; k < 3; k++) scene.channel(std::string("force.") + "nxy"[k], Measure::multiplier(roll, k), "N");
    scene.channel("kinetic", Measure::kineticEnergy(), "J");
    scene.channel("potential", Measure::potentialEnergy(), "J");
  }
};

} // namespace hhtex

#endif
