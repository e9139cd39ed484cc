static char help[] = "Stiff spring pendulum: a fast stretching frequency above a slow swing.\n"
                     "  -k <1e4>: spring stiffness, N/m\n"
                     "  -end <2>: end time, s\n";

#include "problems/springpendulum.h"
#include "problem.h"

int main(int argc, char **argv)
{
  TS        ts;
  Vec       U, V;
  PetscReal k = 1e4, end = 2.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-k", &k, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  const hhtex::SpringPendulum problem(k, end);
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
