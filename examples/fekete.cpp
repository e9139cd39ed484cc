static char help[] = "Points on a sphere that repel one another until they rest (IVP test set).\n";

#include "problems/fekete.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(hhtex::ProblemSolve(hhtex::Fekete(), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
