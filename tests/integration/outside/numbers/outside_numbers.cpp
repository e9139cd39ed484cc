/* A mass on a spring of the user's own and a user-defined variable, both functions of the state: what user's code and library hand to
   each other here are numbers with derivatives, vectors and functions. Prints the distance from the closed form. */
#include <cmath>
#include <hhtdae/scene.h>

using namespace hhtdae;

static PetscErrorCode Run()
{
  const double k = 20, m = 2, amplitude = 0.25, end = 1.5;
  TS           ts;
  TSType       type;
  Vec          U;
  PetscFunctionBegin;
  Scene     scene(PETSC_COMM_WORLD);
  PointMass mass;
  mass.mass         = m;
  mass.position     = Vector3(1 + amplitude, 0, 0);
  const Marker at   = scene.marker(scene.add("mass", mass)), origin = scene.marker(scene.ground());
  /* tension = (k1 + k2) (l - 1), one half by the spring, one half by a force from a variable */
  scene.add("spring", NonlinearSpring{at, origin, [k](const Real &l, const Real &) -> Real { return Real(0.5 * k * (l - 1.)); }});
  const Variable v = scene.variable(
    "tension", Expression{{Measure::distance(at, origin), Measure::displacement(at, 0), Measure::velocity(at, 0)},
                          [k](const Real *x) -> Real { return Real(0.25 * k * (x[0] + x[1] - 2.) + 0. * x[2]); }});
  scene.add("force", UserScalarForce{at, origin, Expression{{Measure::value(v)}, [](const Real *x) -> Real { return Real(-x[0]); }}});
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetTolerances(ts, 1e-8, nullptr, 1e-8, nullptr));
  PetscCall(TSSetMaxSteps(ts, 100000));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(scene.solve(ts));
  PetscCall(TSGetType(ts, &type));
  PetscCall(TSGetSolution(ts, &U));
  const PetscScalar *u;
  PetscCall(VecGetArrayRead(U, &u));
  const double error = std::abs(u[0] - 1 - amplitude * std::cos(std::sqrt(k / m) * end));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "type %s error %g\n", type, error));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(PetscInitialize(&argc, &argv, nullptr, nullptr));
  PetscCall(Run());
  return PetscFinalize();
}
