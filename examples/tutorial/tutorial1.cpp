static char help[] = "Tutorial, step 1: a rod on a pin is let go and swings.\n";

#include <hhtdae/helpers.h>
#include <hhtdae/query.h>
#include <hhtdae/scene.h>

using namespace hhtdae;

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  {
    Scene scene(PETSC_COMM_WORLD);
    scene.gravity({0, -9.81, 0});

    RigidBody bar; /* 1 m long, 2 kg, along x; its centre half a metre from the pin */
    bar.mass       = 2;
    bar.inertia    = inertia::box(2, {1, 0.05, 0.05});
    bar.position   = {0.5, 0, 0};
    const Body rod = scene.add("rod", bar);
    connect<Revolute>(scene, "pin", rod, scene.ground(), {0, 0, 0}, {0, 0, 1});
    const Marker tip = scene.marker(rod, {0.5, 0, 0});

    TS       ts;
    Snapshot now;
    Motion   motion;
    PetscCall(scene.createTS(&ts));
    PetscCall(TSSetMaxTime(ts, 1));
    PetscCall(TSSetTolerances(ts, 1e-8, nullptr, 1e-8, nullptr));
    PetscCall(TSSetFromOptions(ts));
    PetscCall(scene.solve(ts));

    PetscCall(now.take(ts));
    PetscCall(now.motion(tip, &motion));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "tip at 1 s: %.5f %.5f m\n", motion.position(0), motion.position(1)));
    PetscCall(TSDestroy(&ts));
  }
  PetscCall(PetscFinalize());
  return 0;
}
