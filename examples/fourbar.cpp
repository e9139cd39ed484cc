static char help[] =
    "N-four-bar mechanism that passes its singular configuration (IFToMM benchmark A02); exact solution.\n"
    "  -n <2>: number of windows; 2n+1 rods\n"
    "  -end <10>: end time, s\n";

#include "problems/fourbar.h"
#include "problem.h"

int main(int argc, char **argv)
{
  TS        ts;
  Vec       U, V;
  PetscInt  windows = 2;
  PetscReal end     = 10.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-n", &windows, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  const hhtex::FourBar problem(windows, end);
  PetscCall(hhtex::ProblemCreateTS(PETSC_COMM_WORLD, problem, &ts, &U, &V));
  PetscCall(TSSetType(ts, TSHHT3));
  PetscCall(TSSetTolerances(ts, 1e-6, nullptr, 1e-6, nullptr));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(TSSolve(ts, U));
  PetscCall(hhtex::ProblemReport(ts, problem, U, V));

  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscCall(TSDestroy(&ts));
  PetscCall(PetscFinalize());
  return 0;
}
