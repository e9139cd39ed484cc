static char help[] = "Tutorial, step 5: the rod becomes a flexible strip, from a finite-element mesh.\n";

#include <hhtdae/flexible.h>
#include <hhtdae/helpers.h>
#include <hhtdae/query.h>

#include <slepceps.h>

using namespace hhtdae;

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(SlepcInitialize(&argc, &argv, nullptr, help)); /* in place of PetscInitialize() */
  PetscCall(TSHHT3Initialize());
  {
    FeModel     model(PETSC_COMM_WORLD);
    Reduction   reduction;
    ReducedBody body;
    PetscCall(model.readMesh("beam.msh", {{"steel", Material{2.1e11, 0.3, 7850}}}));
    reduction.attachments = {{"left"}, {"right"}}; /* node sets at which joints, forces and markers act */
    reduction.modes       = 6;
    PetscCall(Reduce(model, reduction, &body));
    PetscCall(AddStressModes(model, &body));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "first mode of the free strip: %.3f Hz\n", body.mode[0].frequency));

    Scene scene(PETSC_COMM_WORLD);
    scene.gravity({0, -9.81, 0});
    FlexibleBody strip;
    strip.model      = std::make_shared<ModalBody>(body.modal);
    strip.damping    = {{100, 0.02}, {1000, 0.1}}; /* two percent of critical to 100 Hz, ten to 1000 Hz and beyond */
    const Body   rod = scene.add("rod", strip), left = scene.attachment(rod, "left");
    const Marker tip = scene.marker(scene.attachment(rod, "right")), root = scene.marker(left);
    connect<Revolute>(scene, "pin", left, scene.ground(), {0, 0, 0}, {0, 0, 1});

    TS                  ts;
    Snapshot            now;
    Motion              bent;
    std::vector<double> eta, stress;
    PetscCall(scene.createTS(&ts));
    PetscCall(TSSetMaxTime(ts, 0.5));
    PetscCall(TSSetTolerances(ts, 1e-7, nullptr, 1e-7, nullptr));
    PetscCall(TSSetFromOptions(ts));
    PetscCall(scene.solve(ts));

    PetscCall(now.take(ts));
    PetscCall(now.relativeMotion(tip, root, &bent)); /* position of the tip relative to the root */
    PetscCall(now.modes(rod, &eta));
    PetscCall(VonMises(body, Eigen::Map<Eigen::VectorXd>(eta.data(), (Eigen::Index)eta.size()), &stress));
    double largest = 0; /* over this rank's nodes, then over all */
    for (const double s : stress) largest = std::max(largest, s);
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "at 0.5 s: deflection %.4f mm, largest stress %.4f MPa\n", 1e3 * bent.position(1), 1e-6 * largest));
    PetscCall(TSDestroy(&ts));
  }
  PetscCall(SlepcFinalize());
  return 0;
}
