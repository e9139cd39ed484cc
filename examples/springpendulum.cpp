static char help[] = "Stiff spring pendulum: a fast stretching frequency above a slow swing.\n"
                     "  -k <1e4>: spring stiffness, N/m\n"
                     "  -end <2>: end time, s\n";

#include "problems/springpendulum.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscReal k = 1e4, end = 2.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-k", &k, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(hhtex::ProblemSolve(hhtex::SpringPendulum(k, end), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
