static char help[] =
    "Bricard's mechanism (IFToMM A04): five rods, six hinges, one degree of freedom where counting finds none.\n"
    "Its constraints are redundant by one row. Compared with the equations in two relative angles.\n"
    "  -section <0.1>: edge of the rods' square section, m\n"
    "  -end <10>: end time, s\n"
    "-scene_redundant refuse shows the row that the scene leaves out.\n";

#include "problem.h"
#include "scene_references.h"
#include "scene_watch.h"

#include <hhtdae/scene.h>

using namespace hhtdae;
using Reference = hhtex::BricardReference;

static PetscErrorCode Run(void)
{
  PetscReal section = 0.1, end = 10;
  TS        ts;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-section", &section, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));

  Scene scene(PETSC_COMM_WORLD);
  scene.gravity({0, -9.81, 0});
  Body    before = scene.ground();
  Matrix3 axes[3]; /* markers with z along an axis of space */
  axes[0] << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  axes[1] << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  axes[2].setIdentity();
  std::vector<Marker> joints;
  for (int k = 0; k < 6; k++) {
    const Vector3 P    = Reference::point(k);
    Body          next = scene.ground();
    if (k < 5) { /* the rod from P_k to P_k+1 */
      const Vector3 d = Reference::point(k + 1) - P, along = d.cwiseAbs();
      RigidBody     rod;
      rod.mass = 1;
      rod.inertia =
          ((1 + section * section) / 12 * (Vector3::Ones() - along) + section * section / 6 * along).asDiagonal();
      rod.position = P + d / 2;
      next         = scene.add("rod " + std::to_string(k), rod);
      scene.shape(next, Shape::box(along / 2 + Vector3::Ones() * 0.5 * section));
    }
    const Matrix3 &R = axes[Reference::axis(k)];
    const Marker   j = scene.markerAt(before, P, R);
    scene.add("hinge " + std::to_string(k), Revolute{scene.markerAt(next, P, R), j});
    joints.push_back(j);
    before = next;
  }
  for (int k = 2; k < 6; k++)
    for (int c = 0; c < 3; c++)
      scene.channel("P" + std::to_string(k) + "." + "xyz"[c], Measure::displacement(joints[k], c), "m");
  scene.channel("kinetic", Measure::kineticEnergy(), "J");
  scene.channel("potential", Measure::potentialEnergy(), "J");

  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetTolerances(ts, 1e-6, nullptr, 1e-6, nullptr));
  PetscCall(TSSetFromOptions(ts));

  Reference    exact(section);
  double       error = 0, closure = 0, drift = 0, start = 0;
  hhtex::Watch watch(scene, 0.02, [&](double t, const std::vector<double> &x) {
    Vector3 P[6];
    Reference::points(exact.at(t), P);
    for (int k = 2; k < 6; k++)
      hhtex::Widen(k < 5 ? error : closure, (Eigen::Map<const Vector3>(&x[3 * (k - 2)]) - P[k]).norm());
    if (t == 0) start = x[12] + x[13];
    hhtex::Widen(drift, x[12] + x[13], start);
  });
  PetscCall(watch.attach(ts));
  PetscCall(scene.solve(ts));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: points=%.3e closure=%.3e energy=%.3e\n", error, closure, drift));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(Run());
  PetscCall(PetscFinalize());
  return 0;
}
