static char help[] = "Quarter car: body and wheel on vertical guides, suspension of spring and damper, tire in contact "
                     "with a moving road.\n"
                     "Compared with the equations in two heights; over a curb of 0.1 m the tire lifts off.\n"
                     "  -road <bump>: bump, a step up by a quintic; sine; curb, a steeper step\n"
                     "  -height <0.05>: of the road's motion, m\n"
                     "  -tire <torus>: torus or sphere\n"
                     "  -end <2>: end time, s\n";

#include "problem.h"
#include "quartercar_model.h"
#include "scene_references.h"
#include "scene_watch.h"

#include <hhtdae/scene.h>

#include <cstring>

using namespace hhtdae;

static PetscErrorCode Run(void)
{
  char      road[16] = "bump", tire[16] = "torus";
  PetscReal height = 0.05, end = 2;
  TS        ts;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-road", road, sizeof road, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-tire", tire, sizeof tire, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-height", &height, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  const bool torus = !std::strcmp(tire, "torus");
  PetscCheck(torus || !std::strcmp(tire, "sphere"), PETSC_COMM_WORLD, PETSC_ERR_ARG_WRONG,
             "-tire %s: must be torus or sphere", tire);

  hhtex::QuarterCarReference::Parameters p;
  if (!std::strcmp(road, "bump"))
    p.road = TimeFunction::step5(0.2, 0, 0.35, height);
  else if (!std::strcmp(road, "curb"))
    p.road = TimeFunction::step5(0.2, 0, 0.24, height);
  else if (!std::strcmp(road, "sine"))
    p.road = TimeFunction::formula([height](const TimeFunction::Number &t) -> TimeFunction::Number {
      return (1. - cos(t * 10.)) * (0.5 * height);
    });
  else
    SETERRQ(PETSC_COMM_WORLD, PETSC_ERR_ARG_WRONG, "-road %s: must be bump, curb or sine", road);

  hhtex::QuarterCar model(p, torus);
  Scene            &scene = model.scene;
  const double      hub = model.hub, deck = model.deck, weight = p.body * 9.81;
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetTolerances(ts, 1e-6, nullptr, 1e-6, nullptr));
  PetscCall(TSSetFromOptions(ts));

  hhtex::QuarterCarReference exact(p);
  double                     error = 0, load = 0, off = 0;
  hhtex::Watch               watch(scene, 0.001, [&](double t, const std::vector<double> &x) {
    const double N = exact.tire(t);
    hhtex::Widen(error, x[0] - deck, exact.body(t));
    hhtex::Widen(error, x[1] - hub, exact.wheel(t));
    hhtex::Widen(load, x[2] / weight, N / weight);
    if (N == 0) off += 0.001;
  });
  PetscCall(watch.attach(ts));
  PetscCall(scene.solve(ts));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "lifted: %.3f s\nerror: heights=%.3e tire=%.3e\n", off, error, load));
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
