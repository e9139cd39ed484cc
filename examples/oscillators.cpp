static char help[] = "Linear oscillators with given frequencies and damping ratios; exact solution.\n"
                     "  -frequencies <1,5,25>: angular frequencies, rad/s\n"
                     "  -damping <0,...>: damping ratios, as many as frequencies (fewer: 0 for the rest)\n"
                     "  -couple <false>: mix the oscillators, so that damping and stiffness matrices are full\n"
                     "  -end <10>: end time, s\n";

#include "problems/oscillators.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscReal frequency[100] = {1., 5., 25.}, damping[100] = {0.}, end = 10.;
  PetscInt  nf = 100, nd = 100;
  PetscBool couple = PETSC_FALSE, given;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetRealArray(nullptr, nullptr, "-frequencies", frequency, &nf, &given));
  if (!given) nf = 3;
  PetscCall(PetscOptionsGetRealArray(nullptr, nullptr, "-damping", damping, &nd, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-couple", &couple, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(hhtex::ProblemSolve(hhtex::Oscillators({frequency, frequency + nf}, {damping, damping + nf}, couple, end), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
