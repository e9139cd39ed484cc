static char help[] = "Double pendulum in its two angles: a mass matrix that depends on q, no constraints.\n"
                     "  -end <1>: end time, s\n";

#include "problems/doublependulum.h"
#include "problem.h"

int main(int argc, char **argv)
{
  TS        ts;
  Vec       U, V;
  PetscReal end = 1.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  const hhtex::DoublePendulum problem(end);
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
