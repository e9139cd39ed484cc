static char help[] = "Car axis on a bumpy road: a constraint that depends on time (IVP test set).\n";

#include "problems/caraxis.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(hhtex::ProblemSolve(hhtex::CarAxis(), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
