static char help[] =
    "Double pendulum of two rods in space, 1 kg and 1 m each, released from rest in a horizontal line.\n"
    "  -joint <revolute>: revolute: about parallel axes, compared with the equations in two angles\n"
    "                     spherical: the second rod starts across the first; energy alone to compare with\n"
    "  -planar: bodies of a planar scene, 3 coordinates each (revolute joints)\n"
    "  -end <2>: end time, s\n";

#include "doublependulum_model.h"
#include "problem.h"
#include "problems/extrapolation.h"
#include "scene_watch.h"

#include <hhtdae/scene.h>

#include <cstring>

using namespace hhtdae;

static const double g = 9.81;

/* Angles of the rods from below, and their rates: (4/3) a'' + (1/2) b'' cos(a - b) + ..., masses and lengths 1 */
static void TwoAngles(long double, const long double *y, long double *f)
{
  const long double c = std::cos(y[0] - y[1]) / 2, s = std::sin(y[0] - y[1]) / 2, m1 = 4.L / 3, m2 = 1.L / 3;
  const long double q1 = -s * y[3] * y[3] - 1.5L * g * std::sin(y[0]), q2 = s * y[2] * y[2] - 0.5L * g * std::sin(y[1]);
  const long double det = m1 * m2 - c * c;
  f[0]                  = y[2];
  f[1]                  = y[3];
  f[2]                  = (m2 * q1 - c * q2) / det;
  f[3]                  = (m1 * q2 - c * q1) / det;
}

static PetscErrorCode Run(void)
{
  char      joint[16] = "revolute";
  PetscBool planar    = PETSC_FALSE;
  PetscReal end       = 2;
  TS        ts;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-joint", joint, sizeof joint, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-planar", &planar, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  const bool spherical = !std::strcmp(joint, "spherical");
  PetscCheck(spherical || !std::strcmp(joint, "revolute"), PETSC_COMM_WORLD, PETSC_ERR_ARG_WRONG,
             "-joint %s: must be revolute or spherical", joint);
  PetscCheck(!planar || !spherical, PETSC_COMM_WORLD, PETSC_ERR_ARG_INCOMP,
             "-planar and -joint spherical exclude each other");

  hhtex::DoublePendulumScene model(spherical, planar);
  Scene                     &scene = model.scene;
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetTolerances(ts, 1e-6, nullptr, 1e-6, nullptr));
  PetscCall(TSSetFromOptions(ts));

  /* ---- comparison during the run ---- */
  const long double    half_pi = std::acos(0.L);
  hhtex::Extrapolation exact(TwoAngles, 0, 0.02L, {half_pi, half_pi, 0, 0});
  double               error = 0, drift = 0, start = NAN;
  hhtex::Watch         watch(scene, 0.01, [&](double t, const std::vector<double> &x) {
    if (std::isnan(start)) start = x[2] + x[3];
    hhtex::Widen(drift, x[2] + x[3], start);
    if (spherical) return;
    const auto y = exact.at(t);
    hhtex::Widen(error, x[0], (double)(std::sin(y[0]) + std::sin(y[1])));
    hhtex::Widen(error, x[1], (double)(-std::cos(y[0]) - std::cos(y[1])));
  });
  PetscCall(watch.attach(ts));
  PetscCall(scene.solve(ts));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error:"));
  if (!spherical) PetscCall(PetscPrintf(PETSC_COMM_WORLD, " tip=%.3e", error));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, " energy=%.3e\n", drift));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(Run());
  PetscCall(PetscFinalize());
  return 0;
}
