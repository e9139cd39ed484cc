/* Fast spin, attitudes at which Euler angles are singular, bodies that tumble for a long time */
#ifndef HHTDAE_BENCH_STABILITY_ROTATION_H
#define HHTDAE_BENCH_STABILITY_ROTATION_H

#include "stability_models.h"

namespace hhtstab
{

/* A rotor on a hinge along the space z axis, where Euler angles are singular at the start */
inline PetscErrorCode RotorCase(Run &run, double spin, bool count)
{
  using namespace hhtdae;
  Scene     scene(PETSC_COMM_SELF);
  RigidBody rotor;
  PetscFunctionBegin;
  rotor.inertia          = Vector3(1, 1.3, 2).asDiagonal();
  rotor.angular_velocity = {0, 0, spin};
  const Body   b         = scene.add("rotor", rotor);
  const Marker m = scene.marker(b), ground = scene.marker(scene.ground());
  scene.add("bearing", Revolute{m, ground});
  for (int c = 0; c < 2; c++) scene.channel("", Measure::displacement(scene.marker(b, {1, 0, 0}), c));
  if (count) scene.channel("angle", Measure::angle(m, ground));
  PetscCall(RunScene(run, scene, 1, 1e-6, 0.01, [&](double t, const std::vector<double> &c) {
    run.judge(std::hypot(c[0] - std::cos(spin * t), c[1] - std::sin(spin * t)));
    if (count) run.judge((c[2] - spin * t) / spin);
  }));
  PetscFunctionReturn(0);
}

/* A free body in an arbitrary attitude, judged by the directions of its axes or, where these are unstable, by its
   angular momentum */
inline PetscErrorCode FreeCase(Run &run, const hhtdae::Vector3 &J, const hhtdae::Vector3 &spin, double tilt, double end,
                               double tolerance, bool momentum = false)
{
  using namespace hhtdae;
  FreeBody  exact(J, spin);
  Scene     scene(PETSC_COMM_SELF);
  RigidBody body;
  PetscFunctionBegin;
  const Matrix3 R       = Eigen::AngleAxisd(tilt, Vector3::UnitX()).toRotationMatrix();
  body.inertia          = J.asDiagonal();
  body.rotation         = R;
  body.angular_velocity = R * spin;
  const Body b          = scene.add("body", body);
  for (int k = 0; k < 3; k++)
    for (int c = 0; c < 3; c++) scene.channel("", Measure::displacement(scene.marker(b, Vector3::Unit(k)), c));
  for (int c = 0; c < 3; c++) scene.channel("", Measure::angularVelocity(scene.marker(b), c));
  PetscCall(RunScene(run, scene, end, tolerance, end / 200, [&](double t, const std::vector<double> &c) {
    Matrix3 A;
    for (int k = 0; k < 3; k++) A.col(k) = Eigen::Map<const Vector3>(&c[3 * k]);
    const Vector3 w = Eigen::Map<const Vector3>(&c[9]), L = A * J.asDiagonal() * A.transpose() * w;
    const Vector3 start = R * J.asDiagonal() * spin;
    for (int k = 0; k < 3 && !momentum; k++) run.judge((A.col(k) - R * exact.axis(t, k)).norm());
    if (momentum) run.judge((L - start).norm() / start.norm());
  }));
  run.note("%d changes of axes", (int)run.out.s.changes);
  PetscFunctionReturn(0);
}

/* A fast top in slow regular precession, whose nutation is far faster than the steps resolve; judged by the error
   relative to the path of precession. At 1e5 rad/s this path is 2 mm long, and 1e-2 of it is 20 times the tolerance;
   the smaller error with which a run ends depends on the last digits */
inline PetscErrorCode PrecessionCase(Run &run, double spin)
{
  using namespace hhtdae;
  const double l = 0.5, I3 = 0.02, I1 = 0.015 + l * l, theta = PETSC_PI / 3, end = 2;
  const double a    = I1 * std::cos(theta),
               rate = 2 * 9.81 * l / (I3 * spin + std::sqrt(I3 * spin * I3 * spin - 4 * a * 9.81 * l));
  Scene     scene(PETSC_COMM_SELF);
  RigidBody top;
  PetscFunctionBegin;
  top.inertia          = Vector3(0.015, 0.015, I3).asDiagonal();
  top.rotation         = Eigen::AngleAxisd(theta, Vector3::UnitX()).toRotationMatrix();
  const Vector3 axis   = top.rotation.col(2);
  top.angular_velocity = Vector3(0, 0, rate) + (spin - rate * std::cos(theta)) * axis;
  top.position         = l * axis;
  top.velocity         = top.angular_velocity.cross(top.position);
  const Body b         = scene.add("top", top);
  scene.add("pivot", Spherical{scene.marker(b, {0, 0, -l}), scene.marker(scene.ground())});
  scene.gravity({0, 0, -9.81});
  for (int c = 0; c < 3; c++) scene.channel("", Measure::displacement(scene.marker(b), c));
  PetscCall(RunScene(run, scene, end, 1e-6, end / 100, [&](double t, const std::vector<double> &c) {
    const Vector3 exact = Eigen::AngleAxisd(rate * t, Vector3::UnitZ()) * Vector3(l * axis);
    run.judge((Eigen::Map<const Vector3>(c.data()) - exact).norm() / (l * std::sin(theta) * rate * end));
  }));
  run.note("largest h omega %.1e; precession %.1e rad", run.out.s.h_max * spin, rate * end);
  PetscFunctionReturn(0);
}

/* A body with three different moments of inertia on a ball joint, turning over repeatedly; judged by energy */
inline PetscErrorCode TumbleCase(Run &run, double turns)
{
  using namespace hhtdae;
  const Vector3 spin(0.4, 4, 0.4);
  Scene         scene(PETSC_COMM_SELF);
  RigidBody     body;
  EnergyDrift   energy;
  PetscFunctionBegin;
  body.inertia          = Vector3(0.1, 0.2, 0.3).asDiagonal();
  body.center           = {0.5, 0, 0};
  body.velocity         = spin.cross(body.center);
  body.angular_velocity = spin;
  scene.add("pivot", Spherical{scene.marker(scene.add("body", body)), scene.marker(scene.ground())});
  scene.gravity({0, 0, -9.81});
  EnergyChannels(scene);
  PetscCall(RunScene(run, scene, 1.35 * turns, 1e-7, 0.05, [&](double, const std::vector<double> &c) {
    energy(c);
    run.judge(energy.relative());
  }));
  run.note("%d changes of axes", (int)run.out.s.changes);
  PetscFunctionReturn(0);
}

inline void AddRotation(Cases &cases)
{
  using hhtdae::Vector3;
  const char *axes = "axes, exact";
  for (double w : {1e3, 1e5}) {
    Add(cases, "spin", Name("rotor, %.0e rad/s", w), "place, exact", 1e-6, [w](Run &r) {
      return RotorCase(r, w, false);
    }).test();
    Add(cases, "spin", Name("rotor, %.0e rad/s, its angle", w), "full turns too", 1e-6,
        [w](Run &r) { return RotorCase(r, w, true); });
    Add(cases, "spin", Name("precession, %.0e rad/s", w), "place over the way", 2e-2,
        [w](Run &r) { return PrecessionCase(r, w); });
  }
  /* 100 rad at eps = 1e-7: the paper's form is of first order here */
  Add(cases, "spin", "free, 1e5 rad/s, wobbling", axes, 2e-2,
      [](Run &r) {
        return FreeCase(r, {1, 1, 1.8}, {1e4, 0, 1e5}, 1, 1e-3, 1e-7);
      })
      .paper(AllowedFirstOrder(1e-7, 100))
      .test();
  Add(cases, "spin", "free, 1e5 rad/s, three moments", axes, 2e-2, [](Run &r) {
    return FreeCase(r, {1, 2, 3}, {1e3, 1e3, 1e5}, 1, 1e-3, 1e-7);
  }).paper(AllowedFirstOrder(1e-7, 100));
  Add(cases, "gimbal", "middle axis, from theta=0", "angular momentum", 2e-2, [](Run &r) {
    return FreeCase(r, {1, 2, 3}, {0.5, 5, 0.5}, 0, 10, 1e-7, true);
  }).paper(AllowedFirstOrder(1e-7, 50));
  Add(cases, "gimbal", "through theta=0 exactly", axes, 2e-2, [](Run &r) {
    return FreeCase(r, {1, 2, 3}, {5, 0, 0}, 1, 10, 1e-7);
  }).paper(AllowedFirstOrder(1e-7, 50));
  Add(cases, "gimbal", "near theta=0: 1e-9 rad", axes, 2e-2, [](Run &r) {
    return FreeCase(r, {1, 2, 3}, {0.5, 0.2, 5}, 1e-9, 10, 1e-7);
  }).paper(AllowedFirstOrder(1e-7, 50));
  Add(cases, "gimbal", "tumbles for 60 turns", "energy over the kinetic", 5e-2,
      [](Run &r) { return TumbleCase(r, 60); })
      .paper(AllowedFirstOrder(1e-7, 60 * 2 * PETSC_PI))
      .within(40);
}

} // namespace hhtstab

#endif
