/* Flexible bodies in motion: comparison with an independent solution, the rigid limit, conserved quantities */
#include "flexcrank_model.h"
#include "hhtdae/scene.h"
#include "modal_cloud.h"
#include "scene/model.h"
#include "scene_output.h"

using namespace hhtest;

namespace
{

std::string fixed(double h) { return text(" -ts_dt %g -ts_adapt_type none -ts_max_steps 10000000 ", h); }

FlexibleBody cloudBody(const ModalCloud &c)
{
  FlexibleBody b;
  b.model            = std::make_shared<ModalBody>(c.body);
  b.velocity         = {0.1, 0.4, -0.3};
  b.angular_velocity = {1, -2, 0.7};
  return b;
}

RigidBody sameRigid(const ModalCloud &c)
{
  RigidBody b;
  b.mass             = c.body.mass;
  b.inertia          = c.body.inertia();
  b.velocity         = {0.1, 0.4, -0.3};
  b.angular_velocity = {1, -2, 0.7};
  return b;
}

} // namespace

/* The flexible slider-crank in its own coordinates, solved by extrapolation; the error is of second order down to 1e-9 m */
TEST(FlexibleDynamics, SimeonsSliderCrank)
{
  double error[2];
  for (int k = 0; k < 2; k++) {
    hhtex::FlexCrank m(ModalMass::Full, PETSC_COMM_SELF);
    SceneRun         run(m.scene, 0.1, fixed(2e-6 / (1 << k)) + " -ts_hhtdae_alpha -0.01 ");
    Array            x;
    must(run.solve());
    must(m.scene.sample(run.ts, 0.1, x));
    error[k] = (m.rod.V * Eigen::Map<const Eigen::Vector4d>(x.data()) - hhtex::FlexCrankExact()).cwiseAbs().maxCoeff();
  }
  MEASURED("errors of the rod's coordinates %.2e, %.2e m: order %.2f", error[0], error[1], std::log2(error[0] / error[1]));
  EXPECT_LT(error[1], 1e-9);
  EXPECT_GT(std::log2(error[0] / error[1]), 1.6);
}

TEST(FlexibleDynamics, WithoutModesIsTheRigidBody)
{
  const ModalCloud c(9, 0, 21);
  Array            x[2];
  for (int flexible = 0; flexible < 2; flexible++) {
    Scene scene(PETSC_COMM_SELF);
    scene.gravity({0, 0, -9.81});
    Marker     pivot, far;
    if (flexible) {
      const Body body = scene.add("body", cloudBody(c));
      pivot           = scene.marker(scene.attachment(body, "hub"));
      far             = scene.marker(scene.attachment(body, "tip"));
    } else {
      const Body body = scene.add("body", sameRigid(c));
      pivot           = scene.marker(body, c.X[0]);
      far             = scene.marker(body, c.X[1]);
    }
    const Vector3 at = DataOf(scene).frame(pivot).x;
    for (auto &b : DataOf(scene).bodies) b.v = b.w.cross(b.r - at); /* rotation about the pivot */
    scene.add("ball", Spherical{pivot, scene.marker(scene.ground(), at)});
    for (int k = 0; k < 3; k++) scene.channel(std::string(1, "xyz"[k]), Measure::displacement(far, k));
    SceneRun run(scene, 1, fixed(1e-3) + " -ts_hhtdae_corrector_tolerance 1e-9 ");
    must(run.solve());
    must(scene.sample(run.ts, 1, x[flexible]));
  }
  for (int k = 0; k < 3; k++) EXPECT_NEAR(x[0][k], x[1][k], 1e-10);
}

/* Free flight with spin and vibration: the errors of energy and momentum are proportional to the square of the step */
static void flyFreely(const ModalCloud &c)
{
  double drift[2][2];
  for (int k = 0; k < 2; k++) {
    Scene        scene(PETSC_COMM_SELF);
    FlexibleBody b     = cloudBody(c);
    TemporaryFile file(text("balance%d.csv", k));
    b.deformation_rate = Eigen::Vector4d(0.5, -1, 0.3, 0.8);
    const Body body = scene.add("body", b);
    scene.add("spring", SpringDamper{scene.marker(scene.attachment(body, "tip")), scene.marker(scene.attachment(body, "hub")), 5, 0, 0.5}); /* forces on attachments */
    scene.output().balance      = true;
    scene.output().balance_file = file.name;
    SceneRun run(scene, 5, fixed(4e-3 / (1 << k)) + " -ts_hhtdae_alpha 0 ");
    must(run.solve());
    const CSV   table(file.text());
    const Array energy = table.column("total"), lx = table.column("Lx"), ly = table.column("Ly"), lz = table.column("Lz");
    drift[k][0] = drift[k][1] = 0;
    for (std::size_t i = 0; i < energy.size(); i++) {
      widen(drift[k][0], std::abs(energy[i] - energy[0]) / energy[0]);
      widen(drift[k][1], Vector3(lx[i] - lx[0], ly[i] - ly[0], lz[i] - lz[0]).norm() / Vector3(lx[0], ly[0], lz[0]).norm());
    }
  }
  MEASURED("drift of energy %.2e, %.2e, of angular momentum %.2e, %.2e", drift[0][0], drift[1][0], drift[0][1], drift[1][1]);
  for (int q = 0; q < 2; q++) {
    EXPECT_LT(drift[1][q], 1e-3);
    EXPECT_LT(drift[1][q], 0.35 * drift[0][q]);
  }
}

TEST(FlexibleDynamics, EnergyAndMomentumOfAFreeBody)
{
  ModalCloud c(9, 4, 5);
  flyFreely(c);
  c.stiffen(4);
  flyFreely(c);
}

/* Falling without spin causes no strain; a spin causes strain by the centrifugal load */
TEST(FlexibleDynamics, RigidMotionCausesNoStrain)
{
  for (double spin : {0., 3.}) {
    const ModalCloud c(9, 4, 5);
    Scene            scene(PETSC_COMM_SELF);
    FlexibleBody     b = cloudBody(c);
    b.angular_velocity = {0, 0, spin};
    scene.gravity({1, 2, -9.81});
    const Body body = scene.add("body", b);
    for (int k = 0; k < 4; k++) scene.channel(text("eta%d", k), Measure::modal(body, k));
    SceneRun run(scene, 1, tolerance(1e-6));
    Array    x;
    must(run.solve());
    must(scene.sample(run.ts, 1, x));
    for (double eta : x) {
      if (spin == 0) EXPECT_LT(std::abs(eta), 1e-13);
      else EXPECT_GT(std::abs(eta), 1e-5);
    }
  }
}
