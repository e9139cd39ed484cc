static char help[] =
    "Bricard's mechanism (IFToMM A04): five rods, six hinges, one degree of freedom where counting finds none.\n"
    "Its constraints are redundant by one row. Compared with the equations in two relative angles.\n"
    "  -section <0.1>: edge of the rods' square section, m\n"
    "  -end <10>: end time, s\n"
    "-scene_redundant refuse shows the row that the scene leaves out.\n";

#include "bricard_model.h"
#include "problem.h"
#include "scene_references.h"
#include "scene_watch.h"

#include <hhtdae/scene.h>

using namespace hhtdae;
using Reference = hhtex::BricardReference;

static PetscErrorCode Run(void)
{
  PetscReal section = 0.1, end = 10;
  TS        ts;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-section", &section, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));

  hhtex::Bricard model(section);
  Scene         &scene = model.scene;
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetTolerances(ts, 1e-6, nullptr, 1e-6, nullptr));
  PetscCall(TSSetFromOptions(ts));

  Reference    exact(section);
  double       error = 0, closure = 0, drift = 0, start = NAN;
  hhtex::Watch watch(scene, 0.02, [&](double t, const std::vector<double> &x) {
    Vector3 P[6];
    Reference::points(exact.at(t), P);
    for (int k = 2; k < 6; k++)
      hhtex::Widen(k < 5 ? error : closure, (Eigen::Map<const Vector3>(&x[3 * (k - 2)]) - P[k]).norm());
    if (std::isnan(start)) start = x[12] + x[13];
    hhtex::Widen(drift, x[12] + x[13], start);
  });
  PetscCall(watch.attach(ts));
  PetscCall(scene.solve(ts));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: points=%.3e closure=%.3e energy=%.3e\n", error, closure, drift));
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
