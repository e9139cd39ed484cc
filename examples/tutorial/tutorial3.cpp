static char help[] = "Tutorial, step 3: forces and motions by formulas.\n";

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
    RigidBody bar, block;
    bar.mass         = 2;
    bar.inertia      = inertia::box(2, {1, 0.05, 0.05});
    bar.position     = {0.5, 0, 0};
    block.mass       = 1;
    block.position   = {0, 1, 0};
    const Body rod   = scene.add("rod", bar), base = scene.add("base", block);
    const Marker tip = scene.marker(rod, {0.5, 0, 0}), seat = scene.marker(base);
    connect<Revolute>(scene, "pin", rod, scene.ground(), {0, 0, 0}, {0, 0, 1});

    /* the base oscillates along x by 0.1 m, with a smooth start: a motion is a function of time */
    const Matrix3 along = axesAlong({1, 0, 0});
    const Marker  moved = scene.marker(base, {0, 0, 0}, along), rail = scene.marker(scene.ground(), {0, 1, 0}, along);
    scene.add("guide", Translational{moved, rail});
    scene.add("drive", TranslationalMotion{moved, rail, TimeFunction::formula([](const auto &t) { return 0.1 * (1. - cos(6. * t)); })});

    /* a stiffening spring with a damper between tip and base: tension as a function of length and rate */
    scene.add("spring", NonlinearSpring{tip, seat, [](const Real &l, const Real &v) {
                                          const Real d = l - 1.2;
                                          return 40. * d + 200. * d * d * d + 1.5 * v;
                                        }});

    TS       ts;
    Snapshot now;
    Motion   motion;
    double   length;
    PetscCall(scene.createTS(&ts));
    PetscCall(TSSetMaxTime(ts, 2));
    PetscCall(TSSetTolerances(ts, 1e-8, nullptr, 1e-8, nullptr));
    PetscCall(TSSetFromOptions(ts));
    PetscCall(scene.solve(ts));

    PetscCall(now.take(ts));
    PetscCall(now.motion(tip, &motion));
    PetscCall(now.value(Measure::distance(tip, seat), &length));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "tip at 2 s: %.4f %.4f m, length of the spring %.4f m\n", motion.position(0), motion.position(1), length));
    PetscCall(TSDestroy(&ts));
  }
  PetscCall(PetscFinalize());
  return 0;
}
