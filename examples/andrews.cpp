static char help[] =
    "Andrews' squeezing mechanism: seven bodies, three closed loops (IVP test set; IFToMM benchmark A03).\n"
    "  -end <0.03>: end time, s; there is a reference at 0.005, 0.01, 0.02, 0.03 and 0.05\n";

#include "problems/andrews.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscReal end = 0.03;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(hhtex::ProblemSolve(hhtex::Andrews(end), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
