static char help[] =
    "Planar slider-crank with an elastic rod (Simeon 1996; \"crank\" of the test set for IVP solvers), t in [0, 0.1].\n"
    "The rod is a body in modal coordinates; the reference was computed by extrapolation, to 11 digits.\n"
    "  -mass <full,partial,constant>: how far the rod's mass matrix follows its deformation\n"
    "  -scene_page <file.html>: the mechanism in a page that any browser opens, the rod coloured by its stress\n";

#include "flexcrank_model.h"
#include "flexcrank_surface.h"
#include "problem.h"
#include "scene_watch.h"

#include <hhtdae/scene.h>

using namespace hhtdae;

static PetscErrorCode Run(void)
{
  const char *const   forms[] = {"full", "partial", "constant", "ModalMass", "", nullptr};
  PetscEnum           form    = (PetscEnum)0;
  std::vector<double> x;
  TS                  ts;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetEnum(nullptr, nullptr, "-mass", forms, &form, nullptr));
  hhtex::FlexCrank m((ModalMass)form);
  m.scene.surface(m.link, hhtex::RodSurface(m.rod));
  m.scene.output().page_title = "A slider-crank with an elastic rod";
  PetscCall(m.scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, 0.1));
  PetscCall(TSSetMaxSteps(ts, 10000000));
  PetscCall(TSSetTolerances(ts, 1e-7, nullptr, 1e-7, nullptr));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(m.scene.solve(ts));

  PetscCall(m.scene.sample(ts, 0.1, x));
  const Eigen::Vector4d q = m.rod.V * Eigen::Map<const Eigen::Vector4d>(x.data());
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "rod: q=%.9e,%.9e,%.9e,%.9e slider=%.12f torque=%.6f\n", q(0), q(1), q(2), q(3), x[4], x[5]));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: q=%.3e slider=%.3e\n", (q - hhtex::FlexCrankExact()).cwiseAbs().maxCoeff(),
                        std::fabs(x[4] - hhtex::flexcrank_slider)));
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
