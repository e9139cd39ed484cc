static char help[] =
    "Stiff flyball governor (IFToMM A05): a shaft, two rods with a mass each, a slider on springs and dampers.\n"
    "Compared with the equations in the rods' angle, the slider's height and the shaft's cyclic angle.\n"
    "  -stiffness <8e5> -damping <4e4>: of each spring-damper, N/m and N s/m\n"
    "  -end <10>: end time, s\n";

#include "flyball_model.h"
#include "problem.h"
#include "scene_references.h"
#include "scene_watch.h"

#include <hhtdae/scene.h>

using namespace hhtdae;

static PetscErrorCode Run(void)
{
  PetscReal stiffness = 8e5, damping = 4e4, end = 10;
  TS        ts;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-stiffness", &stiffness, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-damping", &damping, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));

  hhtex::Flyball model(stiffness, damping);
  Scene         &scene = model.scene;
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetTolerances(ts, 1e-6, nullptr, 1e-6, nullptr));
  PetscCall(TSSetFromOptions(ts));

  hhtex::FlyballReference exact(stiffness, damping);
  double                  slide = 0, tip = 0;
  hhtex::Watch            watch(scene, 0.02, [&](double t, const std::vector<double> &x) {
    const auto   y = exact.at(t);
    const double r = 0.05 + std::cos(y.p);
    hhtex::Widen(slide, x[0], y.s);
    hhtex::Widen(
                   tip,
                   (Vector3(x[1], x[2], x[3]) - Vector3(r * std::cos(y.turn), r * std::sin(y.turn), 1 - std::sin(y.p))).norm());
  });
  PetscCall(watch.attach(ts));
  PetscCall(scene.solve(ts));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: slider=%.3e tip=%.3e\n", slide, tip));
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
