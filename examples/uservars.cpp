static char help[] = "Crane with user-defined variables, force states and a controller: uses q'' and lambda outside "
                     "the equations of motion.\n"
                     "  -end <5>: end time, s\n";

#include "problems/uservars.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscReal end = 5.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(hhtex::ProblemSolve(hhtex::UserVars(end), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
