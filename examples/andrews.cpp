static char help[] =
    "Andrews' squeezing mechanism: seven bodies, three closed loops (IVP test set; IFToMM benchmark A03).\n"
    "  -end <0.03>: end time, s; there is a reference at 0.005, 0.01, 0.02, 0.03 and 0.05\n";

#include "problems/andrews.h"
#include "problem.h"

int main(int argc, char **argv)
{
  TS        ts;
  Vec       U, V;
  PetscReal end = 0.03;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  const hhtex::Andrews problem(end);
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
