static char help[] = "Planar chain of pinned rods that falls; no reference.\n"
                     "  -n <10>: number of rods, 1 kg and 1 m each\n"
                     "  -angle <0>: start angle from the horizontal, degrees (-90: hanging)\n"
                     "  -end <1>: end time, s\n";

#include "problems/chain.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscInt  rods  = 10;
  PetscReal angle = 0., end = 1.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-n", &rods, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-angle", &angle, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(hhtex::ProblemSolve(hhtex::Chain(rods, angle, end), 1e-4));
  PetscCall(PetscFinalize());
  return 0;
}
