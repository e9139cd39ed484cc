static char help[] =
    "Non-holonomic constraints: Chaplygin's sleigh, or a vertical disc rolling on a plane; exact solutions.\n"
    "  -disc <false>: the disc\n"
    "  -end <10>: end time, s\n";

#include "problems/rolling.h"
#include "problem.h"

#include <memory>

int main(int argc, char **argv)
{
  PetscBool                       disc = PETSC_FALSE;
  PetscReal                       end  = 10.;
  std::unique_ptr<hhtex::Problem> system;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-disc", &disc, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  if (disc)
    system.reset(new hhtex::RollingDisc(end));
  else
    system.reset(new hhtex::Sleigh(end));
  PetscCall(hhtex::ProblemSolve(*system, 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
