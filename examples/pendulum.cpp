static char help[] =
    "Simple pendulum in absolute coordinates with one constraint (IFToMM benchmark A01); exact solution.\n"
    "  -angle <-90>: release angle from the downward vertical, degrees (179.99: nearly inverted)\n"
    "  -spin <0>: initial angular velocity, rad/s (with -angle 30, -8 goes over the top)\n"
    "  -end <10>: end time, s\n";

#include "problems/pendulum.h"
#include "problem.h"

int main(int argc, char **argv)
{
  PetscReal angle = -90., spin = 0., end = 10.;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-angle", &angle, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-spin", &spin, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(hhtex::ProblemSolve(hhtex::Pendulum(angle, spin, end), 1e-6));
  PetscCall(PetscFinalize());
  return 0;
}
