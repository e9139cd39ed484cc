static char help[] = "Double pendulum in its two angles: a mass matrix that depends on q, no constraints.\n"
                     "  -end <1>: end time, s\n";

#include "problems/doublependulum.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscReal end = 1.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(hhtex::ProblemSolve(hhtex::DoublePendulum(end), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
