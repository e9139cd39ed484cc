static char help[] = "Slider-crank with a spring-damper, from SUNDIALS' example idaSlCrank_dns.c, here as index 3.\n"
                     "  -end <10>: end time, s\n";

#include "problems/slidercrank.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscReal end = 10.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(hhtex::ProblemSolve(hhtex::SliderCrank(end), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
