static char help[] =
    "N-four-bar mechanism that passes its singular configuration (IFToMM benchmark A02); exact solution.\n"
    "  -n <2>: number of windows; 2n+1 rods\n"
    "  -end <10>: end time, s\n";

#include "problems/fourbar.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscInt  windows = 2;
  PetscReal end     = 10.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-n", &windows, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(hhtex::ProblemSolve(hhtex::FourBar(windows, end), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
