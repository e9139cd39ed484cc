/* Flyball governor: a shaft, two rods with a mass each, a slider on springs and dampers. */
#ifndef HHTEX_FLYBALL_MODEL_H
#define HHTEX_FLYBALL_MODEL_H

#include <hhtdae/scene.h>

namespace hhtex
{

struct Flyball {
  hhtdae::Scene scene;

  explicit Flyball(double stiffness, double damping, MPI_Comm comm = PETSC_COMM_WORLD) : scene(comm)
  {
    using namespace hhtdae;
    const double  spin = 2 * PETSC_PI, down = PETSC_PI / 6;
    const Vector3 w(0, 0, spin);
    scene.gravity({0, 0, -9.81});

    RigidBody shaft         = Bar(2), slider;
    shaft.position          = {0, 0, 0.5};
    shaft.angular_velocity  = w;
    slider.mass             = 3;
    slider.inertia          = Matrix3::Identity() * (3 * 0.02 / 12);
    slider.position         = {0, 0, 0.5};
    slider.angular_velocity = w;
    const Body S = scene.add("shaft", shaft), Z = scene.add("slider", slider);
    scene.shape(S, Shape::box({0.01, 0.01, 0.5}));
    scene.shape(Z, Shape::box({0.05, 0.05, 0.05}));
    const Marker top = scene.marker(S), below = scene.marker(scene.ground(), {0, 0, 0.5});
    scene.add("bearing", Revolute{top, below});
    scene.add("guide", Translational{scene.marker(Z), top});

    Marker rod_tip;
    for (int side : {1, -1}) {
      const std::string name = side > 0 ? "right" : "left";
      RigidBody         rod  = Bar(0);
      rod.rotation =
          Eigen::AngleAxisd(side * down, Vector3::UnitY()).toRotationMatrix(); /* x axis outwards, or inwards */
      const Vector3 out    = rod.rotation.col(0) * side, hinge(0.05 * side, 0, 1);
      rod.position         = hinge + out / 2;
      rod.velocity         = w.cross(rod.position);
      rod.angular_velocity = w;
      const Body R         = scene.add(name + " rod", rod);
      scene.shape(R, Shape::box({0.5, 0.01, 0.01}));
      Matrix3 y_as_z; /* z along y */
      y_as_z << 0, 1, 0, 0, 0, 1, 1, 0, 0;
      scene.add(name + " hinge", Revolute{scene.markerAt(R, hinge, y_as_z), scene.markerAt(S, hinge, y_as_z)});
      PointMass ball;
      ball.mass     = 5;
      ball.position = hinge + out;
      ball.velocity = w.cross(ball.position);
      const Body B  = scene.add(name + " ball", ball);
      scene.shape(B, Shape::sphere(0.06));
      const Marker tip = scene.markerAt(R, ball.position);
      scene.add(name + " tip", Spherical{scene.marker(B), tip});
      const Marker low = scene.markerAt(Z, {0.05 * side, 0, 0.5}), high = scene.marker(R);
      scene.add(name + " spring", SpringDamper{low, high, stiffness, damping, 0.5});
      scene.line({low, high});
      if (side > 0) rod_tip = tip;
    }
    scene.channel("slider.z", Measure::displacement(scene.marker(Z), 2), "m");
    scene.channel("tip.x", Measure::displacement(rod_tip, 0), "m");
    scene.channel("tip.y", Measure::displacement(rod_tip, 1), "m");
    scene.channel("tip.z", Measure::displacement(rod_tip, 2), "m");
  }

private:
  /* a bar of 0.3 kg, 1 m long and 0.01 m thick, along an axis */
  static hhtdae::RigidBody Bar(int axis)
  {
    hhtdae::RigidBody b;
    hhtdae::Vector3   J = hhtdae::Vector3::Constant(0.3 * 1.0001 / 12);
    J(axis)             = 0.3 * 2e-4 / 12;
    b.mass              = 0.3;
    b.inertia           = J.asDiagonal();
    return b;
  }
};

} // namespace hhtex

#endif
