static char help[] = "A wheelset on a straight track: contact points as variables, creep forces (IVP test set).\n";

#include "problems/wheelset.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(hhtex::ProblemSolve(hhtex::Wheelset(), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
