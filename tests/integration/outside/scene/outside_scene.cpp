/* A rod released from the horizontal, as a scene: prints its distance from the closed form after a quarter of a swing. */
#include <cmath>
#include <hhtdae/scene.h>

using namespace hhtdae;

static PetscErrorCode Run()
{
  const double g = 9.81, length = 2, period = 4 * 1.8540746773013719 / std::sqrt(1.5 * g / length); /* 4 K(1/sqrt 2) / w */
  TS           ts;
  TSType       type;
  Vec          U;
  PetscFunctionBegin;
  Scene     scene(PETSC_COMM_WORLD);
  RigidBody rod;
  rod.mass     = 3;
  rod.inertia  = Vector3(1e-3, 1, 1).asDiagonal(); /* m l^2 / 12 = 1 */
  rod.position = Vector3(length / 2, 0, 0);
  const Body body = scene.add("rod", rod);
  scene.add("pin", Revolute{scene.marker(body, {-length / 2, 0, 0}), scene.marker(scene.ground())});
  scene.gravity({0, -g, 0});
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, period / 4)); /* at the lowest point */
  PetscCall(TSSetTolerances(ts, 1e-7, nullptr, 1e-7, nullptr));
  PetscCall(TSSetMaxSteps(ts, 100000));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(scene.solve(ts));
  PetscCall(TSGetType(ts, &type));
  PetscCall(TSGetSolution(ts, &U));
  const PetscScalar *u;
  PetscCall(VecGetArrayRead(U, &u));
  const double error = std::hypot(u[0], u[1] + length / 2);
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
