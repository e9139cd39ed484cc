static char help[] = "Heavy top: a fast spinning body with a quaternion as coordinates and a singular mass matrix.\n"
                     "  -end <1>: end time, s\n";

#include "problems/heavytop.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscReal end = 1.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(hhtex::ProblemSolve(hhtex::HeavyTop(end), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
