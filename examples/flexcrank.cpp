static char help[] =
    "Planar slider-crank with an elastic rod (Simeon 1996; \"crank\" of the test set for IVP solvers), t in [0, 0.1].\n"
    "The rod is a body in modal coordinates; the reference was computed by extrapolation, to 11 digits.\n"
    "  -mass <full,partial,constant>: how far the rod's mass matrix follows its deformation\n";

#include "flexcrank_rod.h"
#include "problem.h"
#include "scene_watch.h"

#include <hhtdae/scene.h>

using namespace hhtdae;

static PetscErrorCode Run(void)
{
  const char *const      forms[] = {"full", "partial", "constant", "ModalMass", "", nullptr};
  PetscEnum              form    = (PetscEnum)0;
  const hhtex::SimeonRod rod;
  const double           L1 = 0.15, L2 = rod.length, speed = 150;
  TS                     ts;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetEnum(nullptr, nullptr, "-mass", forms, &form, nullptr));

  /* ---- the start: stretched out, near to smooth motion ---- */
  const Eigen::Vector4d q(0, 0, 0.103339863e-4, 0.169327969e-4), rate(0.444896105, 0.463434311e-2, -0.178591076e-5, -0.268938672e-5);
  const double          turn = -speed * L1 / (L2 + q(3));
  Scene                 scene(PETSC_COMM_WORLD);

  RigidBody crank;
  crank.mass             = 0.36;
  crank.inertia          = Vector3(1e-5, 7.02e-4, 7.02e-4).asDiagonal(); /* 0.002727 about the pivot */
  crank.position         = {L1 / 2, 0, 0};
  crank.velocity         = {0, speed * L1 / 2, 0};
  crank.angular_velocity = {0, 0, speed};
  PointMass slider;
  slider.mass     = 0.075552;
  slider.position = {L1 + L2 + q(3), 0, 0};
  slider.velocity = {rate(3), 0, 0};
  FlexibleBody link;
  link.model            = std::make_shared<ModalBody>(rod.body);
  link.mass             = (ModalMass)form;
  link.position         = {L1, 0, 0};
  link.velocity         = {0, speed * L1 + turn * L2 / 2, 0};
  link.angular_velocity = {0, 0, turn};
  link.deformation      = rod.V.inverse() * q;
  link.deformation_rate = rod.V.inverse() * rate;

  const Body c = scene.add("crank", crank), r = scene.add("rod", link), s = scene.add("slider", slider), ground = scene.ground();
  scene.shape(c, Shape::box({L1 / 2, 0.005, 0.005}));
  scene.shape(r, Shape::box({L2 / 2, 0.004, 0.004}, {L2 / 2, 0, 0}));
  scene.shape(s, Shape::box({0.02, 0.01, 0.01}));

  /* ---- joints ---- */
  const Marker pivot = scene.marker(c, {-L1 / 2, 0, 0}), base = scene.marker(ground), end = scene.marker(scene.attachment(r, "end"));
  const Marker mass = scene.marker(s);
  scene.add("pivot", Revolute{pivot, base});
  scene.add("pin", Revolute{scene.marker(scene.attachment(r, "pin")), scene.marker(c, {L1 / 2, 0, 0})});
  scene.add("end", Spherical{end, mass});
  scene.add("guide", InPlane{mass, scene.marker(ground, {0, 0, 0}, Eigen::AngleAxisd(-M_PI / 2, Vector3::UnitX()).toRotationMatrix())});
  const Element drive = scene.add("drive", RotationalMotion{pivot, base, TimeFunction::polynomial({0, speed})});

  for (int k = 0; k < 4; k++) scene.channel("eta" + std::to_string(k), Measure::modal(r, k));
  scene.channel("slider", Measure::displacement(mass, 0), "m");
  scene.channel("torque", Measure::multiplier(drive, 0), "N m");

  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, 0.1));
  PetscCall(TSSetMaxSteps(ts, 10000000));
  PetscCall(TSSetTolerances(ts, 1e-7, nullptr, 1e-7, nullptr));
  PetscCall(TSSetFromOptions(ts));

  PetscCall(scene.solve(ts));
  std::vector<double> x;
  PetscCall(scene.sample(ts, 0.1, x));
  const Eigen::Vector4d exact(1.893192843026e-4, 2.3757513204864e-5, -5.3238967781898e-6, -8.3633132916616e-6);
  const Eigen::Vector4d found = rod.V * Eigen::Map<const Eigen::Vector4d>(x.data());
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "q: %.9e %.9e %.9e %.9e, slider %.12f, torque %.8f\n", found(0), found(1), found(2), found(3), x[4], x[5]));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: q=%.3e slider=%.3e\n", (found - exact).cwiseAbs().maxCoeff(), std::fabs(x[4] - 0.169737332640)));
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
