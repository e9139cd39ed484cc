/* Geometric stiffening of bodies in modal coordinates against closed forms of beams */
#include "dense.h"
#include "beam_bodies.h"
#include "hhtdae/analyses.h"
#include "hhtdae/flexible.h"
#include "hhtdae/linearize.h"
#include "hhtdae/query.h"
#include "scene_output.h"
#include "scene_watch.h"
#include "spinbeam_model.h"

using namespace hhtest;

namespace
{

enum class As { Modal, Stiffened };

hhtex::SolidBeam strip(double depth, double width, int along, int across)
{
  hhtex::SolidBeam b;
  b.depth            = depth;
  b.width            = width;
  b.material.young   = 2e11;
  b.material.density = 7800;
  b.n[0]             = along;
  b.n[1]             = across;
  return b;
}

/* Equilibrium position of the tip of a cantilever of 1 m along x under a force at its centroid */
Vector3 loaded(const hhtex::SolidBeam &beam, As as, const Vector3 &force)
{
  FeModel         model(PETSC_COMM_SELF);
  Scene           scene(PETSC_COMM_SELF);
  hhtex::BeamEnds ends;
  UserForce       push;
  Snapshot        now;
  Motion          tip;
  must(ReadSolidBeam(beam, &model));
  must(AddModalBeam(scene, model, beam.length, 1, 30, &ends, Tie::Rigid, as == As::Stiffened));
  push.i = scene.marker(ends.tip);
  for (int c = 0; c < 3; c++) {
    const double f = force(c);
    push.force.push_back(Expression({Measure::time()}, [f](const Real *t) -> Real { return 0. * t[0] + f; }));
  }
  scene.add("clamp", Fixed{scene.marker(ends.root), scene.marker(scene.ground())});
  scene.add("push", push);
  TS ts;
  must(scene.createTS(&ts));
  must(StaticEquilibrium(ts, 0));
  must(now.take(ts));
  must(now.motion(push.i, &tip));
  must(TSDestroy(&ts));
  return tip.position;
}

} // namespace

/* A column under half of Euler's load, and under equal tension: the axial force increases or decreases the deflection
   as in the beam equation */
TEST(Stiffening, Column)
{
  const hhtex::SolidBeam b  = strip(0.02, 0.02, 10, 1);
  const double           EI = b.material.young * b.Iyy(), euler = PETSC_PI * PETSC_PI / 4 * EI, across = 1e-4 * EI;
  for (double axial : {0.5, -0.5}) {
    const double k = std::sqrt(std::abs(axial) * euler / EI), shape = axial > 0 ? std::tan(k) - k : k - std::tanh(k), exact = across * shape / (EI * k * k * k);
    const double z = loaded(b, As::Stiffened, {-axial * euler, 0, across}).z(), without = loaded(b, As::Modal, {-axial * euler, 0, across}).z();
    MEASURED("%g of Euler's load: deflection %.4e, of a beam %.4e, without stiffening %.4e m", axial, z, exact, without);
    EXPECT_NEAR(z, exact, 0.01 * exact);
    EXPECT_GT(std::abs(without - exact), 0.05 * exact);
  }
}

/*
  A thin strip under a force P in its plane and a small lateral force q. When the strip bends laterally, P has a moment
  about its axis: with s from the tip, GJ phi'' + P s^2 (q + P phi)/EI = 0 and EI v'' = s (q + P phi). Hence
  q + P phi = q f(s)/f(L) with GJ EI f'' + P^2 s^2 f = 0, f(0) = 1, f'(0) = 0; the strip buckles where f(L) = 0, at
  P = 4.013 sqrt(EI GJ)/L^2 (Timoshenko, Gere, Theory of Elastic Stability, section 6.3). Restrained warping at the ends and
  the bending in the plane increase this load by about 4 %, and by 2.6 % for a strip of half the depth.
*/
TEST(Stiffening, LateralBuckling)
{
  const hhtex::SolidBeam b  = strip(0.025, 0.00125, 40, 4);
  const double           EI = b.material.young * b.Iyy(), root = std::sqrt(EI * b.shearModulus() * b.torsion()), across = 1e-5 * EI;
  const auto             exact = [](double p) { /* deflection relative to that of q alone, p = P L^2/sqrt(EI GJ) */
    double term = 1, f = 0, integral = 0;
    for (int k = 0; k < 20; k++) {
      if (k) term *= -p * p / (4. * k * (4. * k - 1));
      f += term;
      integral += term / (4. * k + 3);
    }
    return 3 * integral / f;
  };
  const double alone = loaded(b, As::Stiffened, {0, 0, across}).z();
  EXPECT_NEAR(alone, across / (3 * EI), 0.01 * alone);
  EXPECT_GT(exact(4.012), 100);
  for (double p : {2., 3., 3.5}) {
    const double z = loaded(b, As::Stiffened, {0, p * root, across}).z() / alone, without = loaded(b, As::Modal, {0, p * root, across}).z() / alone;
    MEASURED("%.2f of the critical load: %.4f times the deflection, of a beam %.4f, without stiffening %.4f", p / 4.013, z, exact(p), without);
    EXPECT_LT(z, exact(p));
    EXPECT_GT(z, exact(p / 1.06));
    EXPECT_LT(without, 0.9 * exact(p));
  }
}

/* The beam of Simo and Vu-Quoc on its hub, against a linear beam with centrifugal stiffening (examples/spinbeam.cpp) */
TEST(Stiffening, SpinUp)
{
  FeModel         model(PETSC_COMM_SELF);
  Scene           scene(PETSC_COMM_SELF);
  hhtex::BeamEnds ends;
  must(ReadSolidBeam(hhtex::SpinningArm(), &model));
  must(AddModalBeam(scene, model, 10, 1, 6, &ends, Tie::Average, true));
  hhtex::SpinUp(scene, ends);
  SceneRun run(scene, 15, tolerance(1e-5));
  double   worst = 0;
  hhtex::Watch watch(scene, 1, [&](double t, const std::vector<double> &x) {
    for (const auto &p : {std::pair{4., -.34239}, {6., -.54406}, {8., -.54320}, {10., -.36284}, {12., -.15084}})
      if (std::abs(t - p.first) < 1e-9) widen(worst, std::abs(x[1] - p.second));
  });
  must(watch.attach(run.ts));
  must(run.solve());
  MEASURED("largest difference %.2e m of 0.574", worst);
  EXPECT_LT(worst, 3e-3);
}

/* Frequency of bending out of the plane of rotation, which increases with the speed (Southwell): w^2 of a cantilever
   with EI = m = L = 1 by Ritz's method with powers of x, to 10 digits; 6.4495 at a speed of 5 (Wright and others, J.
   Appl. Mech. 49, 1982) */
static double flapping(double speed)
{
  constexpr int   n = 8;
  Eigen::MatrixXd K(n, n), M(n, n);
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) {
      const double p = i + 2, q = j + 2;
      M(i, j) = 1 / (p + q + 1);
      K(i, j) = p * (p - 1) * q * (q - 1) / (p + q - 3) + speed * speed / 2 * p * q * (1 / (p + q - 1) - 1 / (p + q + 1));
    }
  return std::sqrt(hhtest::EigenvaluesOf(K, M)(0));
}

/* Frequency of the free vibration after a lateral push, from its zero crossings */
static double measured(bool stiffened)
{
  FeModel         model(PETSC_COMM_SELF);
  Scene           scene(PETSC_COMM_SELF);
  hhtex::BeamEnds ends;
  UserForce       push;
  double          before = 0, first = 0, last = 0;
  int             passages = 0;
  must(ReadSolidBeam(hhtex::SpinningArm(), &model));
  must(AddModalBeam(scene, model, 10, 1, 8, &ends, Tie::Average, stiffened));
  hhtex::SpinUp(scene, ends);
  push.i = scene.marker(ends.tip);
  for (double f : {0., 0., 1.})
    push.force.push_back(Expression({Measure::time()}, [f](const Real *t) -> Real { return exp((t[0] - 17.) * (17. - t[0]) * 40.) * f; }));
  scene.add("push", push);
  scene.channel("across", Measure::displacement(push.i, 2));
  SceneRun     run(scene, 28, tolerance(1e-6));
  hhtex::Watch watch(scene, 0.01, [&](double t, const std::vector<double> &x) {
    if (t > 18 && before * x[2] < 0) {
      last = t - 0.01 * x[2] / (x[2] - before);
      if (!passages++) first = last;
    }
    before = x[2];
  });
  must(watch.attach(run.ts));
  must(run.solve());
  return PETSC_PI * (passages - 1) / (last - first);
}

TEST(Stiffening, SouthwellsFrequencies)
{
  const double unit = std::sqrt(1.4e4 / 1.2) / 100, exact = flapping(hhtex::spin_speed / unit) * unit; /* sqrt(EI/m)/L^2, 1/s */
  EXPECT_NEAR(flapping(0), 3.5160, 1e-4);
  EXPECT_NEAR(flapping(5), 6.4495, 1e-4);
  const double with = measured(true), without = measured(false);
  MEASURED("%.4f rad/s, of a beam %.4f, without stiffening %.4f", with, exact, without);
  EXPECT_NEAR(with, exact, 5e-3 * exact);
  EXPECT_GT(std::abs(without - exact), 0.05 * exact);
}

/* In axes that rotate with the arm, which the linearization chooses itself: the square of the frequency in the plane
   of rotation is that out of the plane minus the square of the speed */
TEST(Stiffening, SouthwellsFrequenciesOfALinearization)
{
  FeModel           model(PETSC_COMM_SELF);
  Scene             scene(PETSC_COMM_SELF);
  hhtex::BeamEnds   ends;
  Linearization     small;
  std::vector<Mode> modes;
  must(ReadSolidBeam(hhtex::SpinningArm(), &model));
  must(AddModalBeam(scene, model, 10, 1, 8, &ends, Tie::Average, true));
  hhtex::SpinUp(scene, ends);
  SceneRun run(scene, 40, tolerance(1e-7));
  must(run.solve());
  must(small.take(run.ts));
  must(small.modes(&modes));
  const double unit = std::sqrt(1.4e4 / 1.2) / 100, speed = hhtex::spin_speed, across = flapping(speed / unit) * unit, in_plane = std::sqrt(across * across - speed * speed);
  std::vector<double> found;
  for (const Mode &m : modes)
    if (std::abs(m.value) > 1e-3 * speed) found.push_back(std::abs(m.value));
  MEASURED("at %g rad/s in the plane %.5f, across %.5f; of a beam %.5f, %.5f", speed, found[0], found[1], in_plane, across);
  EXPECT_NEAR(found[0], in_plane, 5e-3 * in_plane);
  EXPECT_NEAR(found[1], across, 5e-3 * across);
}
