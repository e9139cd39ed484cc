static char help[] =
    "Heavy top on a ball joint (Bruels, Cardona 2010): 24 revolutions a second, passing upside down.\n"
    "Compared with tabulated digits of the centre of mass, the angular velocity and the reaction.\n"
    "  -end <2>: end time, s; the table has t = 0.2, 0.5, 1, 1.5, 2\n"
    "  -turns <0>: instead, a body with three different moments of inertia tumbles on the joint for so many\n"
    "              revolutions, through every attitude; prints changes of its angles' axes and drift of energy\n";

#include "heavytop_model.h"
#include "problem.h"
#include "scene_watch.h"

#include <hhtdae/scene.h>

using namespace hhtdae;

/* Reference computed with DOP853 at a tolerance of 3e-14 (energy drift 5e-11): t, x, Omega_x, Omega_z (body axes), force of the joint on the
   top */
static const double table[][9] = {{0.2, .60555056137707, .59895768179494, -.52398302743003, -2.6915909121430,
                                   4.9172609898946, -640.2364079921, -148.6277113470, 136.9293130385},
                                  {0.5, -.70246829705663, -.02116518470181, -.71140025765169, -.4710531017439,
                                   5.9010830483260, 523.2812435144, 404.2061783201, 357.3361764531},
                                  {1.0, .17334396409833, .64008859207046, -.74849079113368, -.8220781016856,
                                   -5.9232913481169, -517.6007394769, -396.8431014895, 404.5749251630},
                                  {1.5, -.96816571563814, .25030606213278, -.00142208385119, .3462137843463,
                                   4.6053599853369, 305.2520963488, -100.1277955532, -316.3527961145},
                                  {2.0, -.15041682274585, -.72416559163698, -.67302226956031, .122233219492,
                                   -5.855624589205, -260.735211311, 613.612698983, 309.716631391}};

static PetscErrorCode Solve(Scene &scene, PetscReal end, const hhtex::Watch::Look &look, double dt, TS *ts)
{
  PetscFunctionBeginUser;
  PetscCall(scene.createTS(ts));
  PetscCall(TSSetMaxTime(*ts, end));
  PetscCall(TSSetMaxSteps(*ts, 1000000000));
  PetscCall(TSSetTolerances(*ts, 1e-6, nullptr, 1e-6, nullptr));
  PetscCall(TSSetFromOptions(*ts));
  hhtex::Watch watch(scene, dt, look);
  PetscCall(watch.attach(*ts));
  PetscCall(scene.solve(*ts));
  PetscFunctionReturn(0);
}

static PetscErrorCode Spin(PetscReal end)
{
  TS     ts;
  double x = 0, omega = 0, force = 0, energy = 0, start = NAN;

  PetscFunctionBeginUser;
  hhtex::FastTop model;
  const auto     compare = [&](double t, const std::vector<double> &c) {
    if (std::isnan(start)) start = c[9] + c[10];
    hhtex::Widen(energy, c[9] + c[10], start);
    for (const double *row : table) {
      if (std::fabs(row[0] - t) > 1e-9) continue;
      for (int k = 0; k < 3; k++) {
        hhtex::Widen(x, c[k], row[1 + k]);
        hhtex::Widen(force, c[6 + k], row[6 + k]);
      }
      hhtex::Widen(omega, c[3], row[4]);
      hhtex::Widen(omega, c[4], 150);
      hhtex::Widen(omega, c[5], row[5]);
    }
  };
  PetscCall(Solve(model.scene, end, compare, 0.1, &ts));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: x=%.3e Omega=%.3e F=%.3e energy=%.3e\n", x, omega, force, energy));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

static PetscErrorCode Tumble(PetscReal turns)
{
  TS               ts;
  TSHHT3Statistics s;
  double           angle = 0, last = 0, rate = 0, start = NAN, drift = 0, largest = 0, turned = 0, low = 1, high = -1;

  PetscFunctionBeginUser;
  hhtex::TumblingTop model;
  const auto         look = [&](double t, const std::vector<double> &c) {
    const double w = Vector3(c[3], c[4], c[5]).norm();
    if (std::isnan(start))
      start = c[9] + c[10];
    else
      angle += 0.5 * (w + rate) * (t - last);
    last = t, rate = w;
    hhtex::Widen(drift, c[9] + c[10], start);
    largest = std::fmax(largest, c[9]);
    low = std::fmin(low, 2 * c[2]), high = std::fmax(high, 2 * c[2]);
    turned = angle / (2 * PETSC_PI);
  };
  /* a revolution takes some 1.3 s */
  PetscCall(Solve(model.scene, 1.35 * turns, look, 0.02, &ts));
  PetscCall(TSHHT3GetStatistics(ts, &s));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "tumbled: revolutions=%.1f attitude=%.3f..%.3f changes=%d rejected=%d steps=%d kinetic=%.3f\n",
                        turned, low, high, (int)s.changes, (int)s.rejected, (int)s.steps, largest));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: energy=%.3e\n", drift));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscReal end = 2, turns = 0;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-turns", &turns, nullptr));
  PetscCall(turns > 0 ? Tumble(turns) : Spin(end));
  PetscCall(PetscFinalize());
  return 0;
}
