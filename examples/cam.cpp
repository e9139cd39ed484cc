static char help[] = "A cam lifts a follower against a spring: which force keeps them together, which torque turns the shaft, and at what speed does "
                     "the follower jump off?\n"
                     "Kinematics and inverse dynamics by calls, without a run in time, against closed forms.\n"
                     "  -points <180>: positions of a turn\n"
                     "  -speeds <6>: number of speeds of the shaft, from 300 revolutions per minute on\n";

#include "problem.h"

#include <hhtdae/analyses.h>
#include <hhtdae/query.h>
#include <hhtdae/scene.h>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace hhtdae;

namespace
{

constexpr double height = 0.01, turn = 2 * M_PI;                            /* m, rad */
constexpr double mass = 0.4, stiffness = 8e3, preload = 60, gravity = 9.81; /* of the follower and its spring */

/* The lift at an angle: up in the first half turn, down in the second, by the polynomial of degree 5, so that the acceleration is continuous */
template <class T> T Lift(const T &angle, double plain)
{
  const T      u = (angle - turn * std::floor(plain / turn)) * (1 / M_PI);
  const double v = plain / M_PI - 2 * std::floor(plain / turn);
  const T      w = v < 1 ? u : T(2) - u;
  return height * w * w * w * (10. - w * (15. - 6. * w));
}

/* Exact force between cam and follower, and torque on the shaft, at angle a and speed w */
struct Exact {
  double force, torque;

  Exact(double a, double w)
  {
    using Second = TimeFunction::Number; /* with first and second derivative */
    const Second s    = Lift<Second>(Second(Dual<1>(a, 0), 0), a);
    const double rate = s.value().derivatives()(0), curvature = s.derivatives()(0).derivatives()(0);
    force             = mass * (curvature * w * w + gravity) + preload + stiffness * s.value().value();
    torque            = force * rate;
  }
};

struct CamDrive {
  Scene   scene{PETSC_COMM_WORLD};
  Marker  hub, bearing;
  Element cam, drive;

  CamDrive()
  {
    const Parameter speed = scene.parameter("speed", 1);
    RigidBody       shaft, follower;
    follower.mass     = mass;
    follower.position = {0, 0, 0.05};
    const Matrix3 along_x = Eigen::AngleAxisd(M_PI / 2, Vector3::UnitY()).toRotationMatrix();
    const Body    S = scene.add("shaft", shaft), F = scene.add("follower", follower);
    hub               = scene.marker(S, Vector3::Zero(), along_x);
    bearing           = scene.marker(scene.ground(), Vector3::Zero(), along_x);
    const Marker foot = scene.marker(F), seat = scene.marker(scene.ground(), {0, 0, 0.05});
    scene.gravity({0, 0, -gravity});
    scene.add("bearing", Revolute{hub, bearing});
    scene.add("guide", Translational{foot, seat});
    scene.add("spring", SpringDamper{foot, scene.marker(scene.ground(), {0, 0, 0.15}), stiffness, 0, -1, -preload});
    cam   = scene.add("cam", UserConstraint{{Expression{{Measure::displacement(foot, 2, seat), Measure::angle(hub, bearing)},
                                                        [](const Real *m) { return m[0] - Lift<Real>(m[1], m[1].value()); }}}});
    drive = scene.add("drive", [=, i = hub, j = bearing] { return RotationalMotion{i, j, TimeFunction::polynomial({0, speed})}; });
    scene.start().assembly = Assembly::Project; /* velocities follow the drive */
  }
};

struct Turn {
  double              least = 1e300, most = 0, torque = 0, error = 0;
  std::vector<double> force; /* at each point */
};

/* Kinematics at points of a turn at a speed in rad/s */
PetscErrorCode OneTurn(CamDrive &c, double speed, PetscInt points, Turn *t)
{
  TS       ts;
  Snapshot now;
  PetscFunctionBegin;
  *t = Turn();
  PetscCall(c.scene.set("speed", speed));
  PetscCall(c.scene.createTS(&ts));
  for (PetscInt k = 0; k < points; k++) {
    const double angle = turn * (double)k / (double)points;
    double       force, torque;
    PetscCall(Kinematics(ts, angle / speed));
    PetscCall(now.take(ts));
    PetscCall(now.value(Measure::multiplier(c.cam, 0), &force));
    PetscCall(now.value(Measure::jointMoment(c.drive, 2), &torque));
    const Exact exact(angle, speed);
    t->force.push_back(force);
    t->least  = std::min(t->least, force);
    t->most   = std::max(t->most, force);
    t->torque = std::max(t->torque, std::abs(torque));
    t->error  = std::max({t->error, std::abs(force - exact.force) / (preload + mass * gravity), std::abs(torque - exact.torque) / (preload * height)});
  }
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

PetscErrorCode Run()
{
  PetscInt points = 180, speeds = 6;
  double   error = 0;
  CamDrive cam;
  Turn     t;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-points", &points, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-speeds", &speeds, nullptr));
  PetscCheck(points > 1 && speeds > 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "-points %d and -speeds %d must be positive", (int)points, (int)speeds);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "speed 1/min  least force N  largest force N  largest torque N m\n"));
  for (PetscInt k = 0; k < speeds; k++) {
    const double rpm = 300. * (double)(k + 1);
    PetscCall(OneTurn(cam, rpm * turn / 60, points, &t));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%11.0f  %13.3f  %15.3f  %18.4f%s\n", rpm, t.least, t.most, t.torque, t.least < 0 ? "  jumps off" : ""));
    error = std::max(error, t.error);
  }
  /* At every point the force is a constant plus a multiple of the speed's square: two turns determine the speed at which it is zero. */
  double jump = 1e300, exact = 1e300;
  Turn   slow;
  PetscCall(OneTurn(cam, 100, points, &slow));
  PetscCall(OneTurn(cam, 200, points, &t));
  for (PetscInt k = 0; k < points; k++) {
    const double a = turn * (double)k / (double)points, rest = Exact(a, 0).force, inertia = Exact(a, 1).force - rest, by = (t.force[k] - slow.force[k]) / (200. * 200 - 100 * 100);
    if (by < 0) jump = std::min(jump, std::sqrt((100. * 100 * by - slow.force[k]) / by));
    if (inertia < 0) exact = std::min(exact, std::sqrt(-rest / inertia));
  }
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "jumps off at %.3f 1/min, by theory %.3f\n", jump * 60 / turn, exact * 60 / turn));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: %.2e\n", std::max(error, std::abs(jump - exact) / exact)));
  PetscFunctionReturn(0);
}

} // namespace

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(Run());
  PetscCall(PetscFinalize());
  return 0;
}
