static char help[] = "Tutorial, step 4: parameters, static equilibrium, natural frequencies.\n";

#include <hhtdae/analyses.h>
#include <hhtdae/helpers.h>
#include <hhtdae/linearize.h>
#include <hhtdae/scene.h>

using namespace hhtdae;

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  {
    Scene           scene(PETSC_COMM_WORLD);
    const Parameter k = scene.parameter("stiffness", 100); /* parameters have to be defined first */
    scene.gravity({0, -9.81, 0});
    RigidBody bar;
    bar.mass       = 2;
    bar.inertia    = inertia::box(2, {1, 0.05, 0.05});
    bar.position   = {0.5, 0, 0};
    const Body rod = scene.add("rod", bar);
    connect<Revolute>(scene, "pin", rod, scene.ground(), {0, 0, 0}, {0, 0, 1});
    const Marker tip = scene.marker(rod, {0.5, 0, 0}), hook = scene.marker(scene.ground(), {1, 1, 0});
    scene.add("spring", [=] { return SpringDamper{tip, hook, k, 0.5, 0.8}; }); /* elements that depend on them are described by a function */

    for (const double stiffness : {50., 100., 200.}) {
      TS                ts;
      Snapshot          now;
      Motion            motion;
      Linearization     small;
      std::vector<Mode> modes;
      PetscCall(scene.set("stiffness", stiffness));
      PetscCall(scene.createTS(&ts));
      PetscCall(StaticEquilibrium(ts, 0));
      PetscCall(now.take(ts));
      PetscCall(now.motion(tip, &motion));
      PetscCall(small.take(ts));
      PetscCall(small.modes(&modes));
      PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%.0f N/m: the tip rests at %.4f m, %.4f Hz, damping ratio %.4f\n", stiffness, motion.position(1),
                            modes[0].frequency(), modes[0].dampingRatio()));
      PetscCall(TSDestroy(&ts));
    }
  }
  PetscCall(PetscFinalize());
  return 0;
}
