static char help[] =
    "Rolling without slip, with constraints on velocities: a ball goes down a slope with 5/7 g sin(slope), exactly;\n"
    "a leaning disc goes round a circle.\n"
    "  -slope <20>: degrees\n"
    "  -disc: instead, a thin disc of radius 0.5 that leans by -lean in steady turning\n"
    "  -lean <20>: degrees; -circle <2>: radius of the path of its centre, m\n"
    "  -end <3>: end time, s\n";

#include "problem.h"
#include "scene_watch.h"

#include <hhtdae/scene.h>

using namespace hhtdae;

static PetscErrorCode Solve(Scene &scene, PetscReal end, const hhtex::Watch::Look &look)
{
  TS ts;

  PetscFunctionBeginUser;
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetTolerances(ts, 1e-6, nullptr, 1e-6, nullptr));
  PetscCall(TSSetFromOptions(ts));
  hhtex::Watch watch(scene, 0.01, look);
  PetscCall(watch.attach(ts));
  PetscCall(scene.solve(ts));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

/* x down the slope, y across it */
static PetscErrorCode Ball(PetscReal end)
{
  PetscReal slope = 20;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-slope", &slope, nullptr));
  const double angle = slope * PETSC_PI / 180, mass = 2, radius = 0.3, g = 9.81, across = 0.7; /* m/s, at the start */
  Matrix3      plane = Eigen::AngleAxisd(angle, Vector3::UnitY()).toRotationMatrix();
  Scene        scene(PETSC_COMM_WORLD);
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

  double       x = 0, force = 0;
  const double a = 5. / 7 * g * std::sin(angle), N = mass * g * std::cos(angle),
               friction = -2. / 7 * mass * g * std::sin(angle);
  PetscCall(Solve(scene, end, [&](double t, const std::vector<double> &c) {
    hhtex::Widen(x, c[0], 0.5 * a * t * t);
    hhtex::Widen(x, c[1], across * t);
    hhtex::Widen(x, c[2], radius);
    hhtex::Widen(force, c[3], N);
    hhtex::Widen(force, c[4], friction);
    hhtex::Widen(force, c[5], 0);
  }));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: x=%.3e force=%.3e\n", x, force));
  PetscFunctionReturn(0);
}

/*
  About its centre a thin disc has the moments C = m r^2/2, about the axis, and A = C/2. With lean s towards the middle
  of the circle of radius R, the balance of moments at the turning rate W gives  W^2 ((3/2) R + (r/4) sin s) = g tan s.
*/
static PetscErrorCode Disc(PetscReal end)
{
  PetscReal lean = 20, R = 2;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-lean", &lean, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-circle", &R, nullptr));
  const double s = lean * PETSC_PI / 180, mass = 2, r = 0.5, g = 9.81;
  const double W = std::sqrt(g * std::tan(s) / (1.5 * R + 0.25 * r * std::sin(s)));
  Scene        scene(PETSC_COMM_WORLD);
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
  const Element roll = scene.add("rolling", RollingDisc{center, scene.marker(scene.ground()), r});
  for (int k = 0; k < 3; k++) scene.channel(std::string("x.") + "xyz"[k], Measure::displacement(center, k), "m");
  for (int k = 0; k < 3; k++) scene.channel(std::string("force.") + "nxy"[k], Measure::multiplier(roll, k), "N");
  scene.channel("kinetic", Measure::kineticEnergy(), "J");
  scene.channel("potential", Measure::potentialEnergy(), "J");

  double x = 0, force = 0, drift = 0, start = 0;
  PetscCall(Solve(scene, end, [&](double t, const std::vector<double> &c) {
    const double co = std::cos(W * t), si = std::sin(W * t), inward = -mass * W * W * R;
    hhtex::Widen(x, (Vector3(c[0], c[1], c[2]) - Vector3(R * co, R * si, r * std::cos(s))).norm());
    hhtex::Widen(force, (Vector3(c[3], c[4], c[5]) - Vector3(mass * g, inward * co, inward * si)).norm());
    if (t == 0) start = c[6] + c[7];
    hhtex::Widen(drift, c[6] + c[7], start);
  }));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: x=%.3e force=%.3e energy=%.3e\n", x, force, drift));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscReal end  = 3;
  PetscBool disc = PETSC_FALSE;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-disc", &disc, nullptr));
  PetscCall(disc ? Disc(end) : Ball(end));
  PetscCall(PetscFinalize());
  return 0;
}
