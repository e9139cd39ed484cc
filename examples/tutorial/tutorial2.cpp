static char help[] = "Tutorial, step 2: what is recorded, what can be asked, what can be looked at.\n";

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
    RigidBody bar;
    bar.mass          = 2;
    bar.inertia       = inertia::box(2, {1, 0.05, 0.05});
    bar.position      = {0.5, 0, 0};
    const Body    rod = scene.add("rod", bar);
    const Element pin = connect<Revolute>(scene, "pin", rod, scene.ground(), {0, 0, 0}, {0, 0, 1});
    const Marker  tip = scene.marker(rod, {0.5, 0, 0}), end = scene.marker(rod, {-0.5, 0, 0});

    scene.shape(rod, Shape::box({0.5, 0.025, 0.025})); /* for pictures: half edges */
    scene.channel("height", Measure::displacement(tip, 1), "m");
    scene.channel("load", Expression{{Measure::jointForce(pin, 0), Measure::jointForce(pin, 1)},
                                     [](const Real *f) { return sqrt(f[0] * f[0] + f[1] * f[1] + 1e-12); }}, "N");
    scene.output().csv = "tutorial2.csv";
    scene.output().dt  = 0.01;

    TS       ts;
    Snapshot now;
    Load     load;
    double   kinetic, potential;
    PetscCall(scene.createTS(&ts));
    PetscCall(TSSetMaxTime(ts, 1));
    PetscCall(TSSetTolerances(ts, 1e-8, nullptr, 1e-8, nullptr));
    PetscCall(TSSetFromOptions(ts)); /* -scene_page tutorial2.html: the run in a browser */
    PetscCall(scene.solve(ts));

    PetscCall(now.take(ts));
    PetscCall(now.load(pin, end, &load));
    PetscCall(now.energy(&kinetic, &potential));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "the pin's force on the rod at 1 s: %.3f %.3f N\n", load.force(0), load.force(1)));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "kinetic energy at 1 s: %.4f J\n", kinetic));
    PetscCall(TSDestroy(&ts));
  }
  PetscCall(PetscFinalize());
  return 0;
}
