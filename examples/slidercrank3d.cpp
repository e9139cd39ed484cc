static char help[] =
    "Spatial slider-crank (Masoudi, Haug; IFToMM library): crank about x, rod on a ball and a universal joint.\n"
    "Compared with the equation in the crank's one angle.\n"
    "  -speed <6>: of the crank at the start, rad/s\n"
    "  -end <5>: end time, s\n";

#include "problem.h"
#include "scene_references.h"
#include "scene_watch.h"
#include "slidercrank3d_model.h"

#include <hhtdae/scene.h>

using namespace hhtdae;

static PetscErrorCode Run(void)
{
  PetscReal speed = 6, end = 5;
  TS        ts;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-speed", &speed, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));

  hhtex::SpatialSliderCrank model(speed);
  Scene                    &scene = model.scene;
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetTolerances(ts, 1e-6, nullptr, 1e-6, nullptr));
  PetscCall(TSSetFromOptions(ts));

  hhtex::SliderCrankReference exact(speed);
  double                      error = 0, drift = 0, start = NAN;
  hhtex::Watch                watch(scene, 0.01, [&](double t, const std::vector<double> &x) {
    if (std::isnan(start)) start = x[1] + x[2];
    hhtex::Widen(drift, x[1] + x[2], start);
    hhtex::Widen(error, x[0], exact.slider(t));
  });
  PetscCall(watch.attach(ts));
  PetscCall(scene.solve(ts));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: slider=%.3e energy=%.3e\n", error, drift));
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
