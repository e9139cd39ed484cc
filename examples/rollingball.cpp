static char help[] =
    "Rolling without slip, with constraints on velocities: a ball goes down a slope with 5/7 g sin(slope), exactly;\n"
    "a leaning disc goes round a circle.\n"
    "  -slope <20>: degrees\n"
    "  -disc: instead, a thin disc of radius 0.5 that leans by -lean in steady turning\n"
    "  -lean <20>: degrees; -circle <2>: radius of the path of its centre, m\n"
    "  -end <3>: end time, s\n";

#include "problem.h"
#include "rollingball_model.h"
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
  const double angle = slope * PETSC_PI / 180, mass = hhtex::RollingBall::mass, radius = hhtex::RollingBall::radius,
               g = hhtex::RollingBall::g, across = hhtex::RollingBall::across;
  hhtex::RollingBall model(angle);

  double       x = 0, force = 0;
  const double a = 5. / 7 * g * std::sin(angle), N = mass * g * std::cos(angle),
               friction = -2. / 7 * mass * g * std::sin(angle);
  PetscCall(Solve(model.scene, end, [&](double t, const std::vector<double> &c) {
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

static PetscErrorCode Disc(PetscReal end)
{
  PetscReal lean = 20, R = 2;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-lean", &lean, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-circle", &R, nullptr));
  hhtex::LeaningDisc model(lean * PETSC_PI / 180, R);
  const double       s = lean * PETSC_PI / 180, mass = model.mass, r = model.r, g = model.g, W = model.W;

  double x = 0, force = 0, drift = 0, start = NAN;
  PetscCall(Solve(model.scene, end, [&](double t, const std::vector<double> &c) {
    const double co = std::cos(W * t), si = std::sin(W * t), inward = -mass * W * W * R;
    hhtex::Widen(x, (Vector3(c[0], c[1], c[2]) - Vector3(R * co, R * si, r * std::cos(s))).norm());
    hhtex::Widen(force, (Vector3(c[3], c[4], c[5]) - Vector3(mass * g, inward * co, inward * si)).norm());
    if (std::isnan(start)) start = c[6] + c[7];
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
