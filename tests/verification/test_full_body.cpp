/* A whole finite-element model in motion: its frequencies, conserved quantities, comparison with its own modes, fast
   rotation */
#include "dense.h"
#include "beam_bodies.h"
#include "hhtdae/modes.h"
#include "scene/scene_data.h"
#include "scene_output.h"
#include <algorithm>
#include <numeric>

using namespace hhtest;

namespace
{

std::string fixedAt(double h)
{
  return text(" -ts_dt %.17g -ts_adapt_type none -ts_max_steps 10000000 -ts_rtol 1e-6 -ts_atol 1e-6 ", h);
}

hhtex::SolidBeam slender(int elements = 6)
{
  hhtex::SolidBeam b;
  b.length   = 1;
  b.depth    = 0.05;
  b.width    = 0.03;
  b.n[0]     = elements;
  b.material = {2e9, 0.3, 1000};
  return b;
}

/* On each rank's own communicator, since these tests run on one rank */
struct BeamMesh {
  FeModel model{PETSC_COMM_SELF};
  explicit BeamMesh(const hhtex::SolidBeam &b) { must(ReadSolidBeam(b, &model)); }
};

Eigen::MatrixXd dense(Mat A, const std::vector<PetscInt> &rows)
{
  Eigen::MatrixXd D((Eigen::Index)rows.size(), (Eigen::Index)rows.size());
  const auto      n = (PetscInt)rows.size();
  D.setZero();
  must(MatGetValues(A, n, rows.data(), n, rows.data(), D.data())); /* symmetric */
  return D;
}

/* Circular frequency of the first mode with all nodes of the root fixed, computed from the matrices */
double firstFrequency(const FeModel &m)
{
  std::vector<PetscInt> rows;
  const auto           &root = m.sets.at("root");
  for (PetscInt n = 0; n < m.nodes; n++)
    if (!std::binary_search(root.begin(), root.end(), n))
      for (int c = 0; c < 3; c++) rows.push_back(3 * n + c);
  return std::sqrt(hhtest::EigenvaluesOf(dense(m.K, rows), dense(m.M, rows))(0));
}

/* Values of a channel at the ends of steps */
Array history(Scene &scene, double end, const std::string &options, const std::string &name, Array *time = nullptr)
{
  TemporaryFile file(name + ".csv");
  scene.output().csv = file.name;
  SceneRun run(scene, end, options);
  must(run.solve());
  const CSV table(file.text());
  if (time) *time = table.column("time");
  return table.column(name);
}

} // namespace

/* A cantilever oscillates about its static deflection; the damping removes the higher modes first. At alpha = 0 the
   method is the trapezoidal rule, which for an undamped mode has the circular frequency 2/h atan(omega h/2) with the
   step h, and which is weakly unstable with constraints; alpha = -0.001 changes the frequency by 4e-6 */
TEST(FullBodyDynamics, CantileverSwingsAtItsFrequency)
{
  const BeamMesh m(slender());
  Scene          scene(PETSC_COMM_SELF);
  FullFeBody     fe;
  FullBody       b;
  const double   omega = firstFrequency(m.model), ratio = 0.002, h = 2 * PETSC_PI / omega / 50;
  b.law               = FeLaw::Small;
  b.stiffness_damping = 2 * ratio / omega;
  b.attachments       = hhtex::BeamAttachments();
  scene.gravity({0, 0, -9.81});
  must(fe.add(scene, "beam", m.model, b));
  scene.add("clamp", Fixed{scene.marker(fe.attachment("root")), scene.marker(scene.ground())});
  scene.channel("z", Measure::displacement(scene.marker(fe.attachment("tip")), 2));
  Array       time;
  const Array z = history(scene, 30 * 50 * h, fixedAt(h) + " -ts_hhtdae_alpha -0.001 ", "z", &time);

  double      sag = 0, amplitude = 0;
  std::size_t last = z.size() - 10 * 50;
  for (std::size_t i = last; i < z.size(); i++) sag += z[i] / (double)(z.size() - last);
  Array crossing; /* upward zero crossings, by a cubic through the four points around each */
  for (std::size_t i = 10 * 50; i + 2 < z.size(); i++) {
    widen(amplitude, std::abs(z[i] - sag));
    if (!(z[i] < sag && z[i + 1] >= sag)) continue;
    double s = (sag - z[i]) / (z[i + 1] - z[i]);
    for (int k = 0; k < 20; k++) {
      const double p = -s * (s - 1) * (s - 2) / 6 * z[i - 1] + (s + 1) * (s - 1) * (s - 2) / 2 * z[i] -
                       (s + 1) * s * (s - 2) / 2 * z[i + 1] + (s + 1) * s * (s - 1) / 6 * z[i + 2];
      s -= (p - sag) / (z[i + 1] - z[i]);
    }
    crossing.push_back(time[i] + s * h);
  }
  ASSERT_GT(crossing.size(), 15u);
  const double turns = (double)crossing.size() - 1, found = 2 * PETSC_PI * turns / (crossing.back() - crossing[0]);
  const double expected = 2 / h * std::atan(omega * h / 2);
  MEASURED("amplitude %.3g m, circular frequency %.8g, of the matrices with this step %.8g: %.1e", amplitude, found,
           expected, found / expected - 1);
  EXPECT_GT(amplitude, 1e-4);
  EXPECT_NEAR(found / expected, 1, 2e-5);
  EXPECT_GT(std::abs(found / omega - 1), 1e-3) << "the step's effect is not seen";
}

/* Among many rows of the residual some seem, by chance, not to have decreased after a correction, different ones in
   every step. When the time since the last proof was one for all rows, these cases added up, and 14 matrices were made
   in these 20 steps */
TEST(FullBodyDynamics, FixedStepsOfManyNodesKeepTheirMatrix)
{
  hhtex::SolidBeam rubber;
  rubber.n[0] = 20;
  rubber.n[1] = rubber.n[2] = 4;
  rubber.length             = 0.4;
  rubber.depth = rubber.width = 0.08;
  rubber.element              = hhtex::BeamElement::Brick20;
  rubber.material             = {5e6, 0.4, 1100};
  const BeamMesh   m(rubber);
  Scene            scene(PETSC_COMM_SELF);
  FullFeBody       fe;
  FullBody         b;
  TSHHT3Statistics first, all;
  const double     h = 2 * PETSC_PI / (PetscSqr(1.8751 / rubber.length) * std::sqrt(rubber.material.young * rubber.Iyy() / (rubber.material.density * rubber.area()))) / 100;
  b.law              = FeLaw::Large;
  b.attachments      = {hhtex::BeamAttachments()[0]};
  scene.gravity({0, 0, -9.81});
  must(fe.add(scene, "beam", m.model, b));
  scene.add("clamp", Fixed{scene.marker(fe.attachment("root")), scene.marker(scene.ground())});
  SceneRun run(scene, 1, text(" -ts_dt %.17g -ts_adapt_type none -ts_max_steps 1 -ts_rtol 1e-5 -ts_atol 4e-6 ", h));
  must(run.solve());
  must(TSHHT3GetStatistics(run.ts, &first));
  must(TSSetMaxSteps(run.ts, 21));
  must(run.solve());
  must(TSHHT3GetStatistics(run.ts, &all));
  MEASURED("%d matrices in %d steps", (int)(all.jacobians - first.jacobians), (int)(all.steps - first.steps));
  EXPECT_EQ(all.steps - first.steps, 20);
  EXPECT_LE(all.jacobians - first.jacobians, 4);
}

/* By default (conjugate gradients) and by a factorization: the same motion and the same accelerations between steps;
   -ts_view shows which solver was used */
TEST(FullBodyDynamics, LargeBodyByConjugateGradientsAsByAFactor)
{
  hhtex::SolidBeam rubber;
  rubber.n[0] = 30;
  rubber.n[1] = rubber.n[2] = 7;
  rubber.length             = 0.6;
  rubber.depth = rubber.width = 0.14;
  rubber.element              = hhtex::BeamElement::Brick20;
  rubber.material             = {5e6, 0.4, 1100};
  const BeamMesh m(rubber);
  double         tip[2], between[2];
  for (int factor = 0; factor < 2; factor++) {
    Scene               scene(PETSC_COMM_SELF);
    FullFeBody          fe;
    FullBody            b;
    std::vector<double> values;
    PetscReal           t;
    SNES                snes;
    KSP                 ksp;
    PetscBool           cg;
    b.law         = FeLaw::Large;
    b.attachments = hhtex::BeamAttachments();
    scene.gravity({0, 0, -9.81});
    must(fe.add(scene, "beam", m.model, b));
    scene.add("clamp", Fixed{scene.marker(fe.attachment("root")), scene.marker(scene.ground())});
    const Marker end = scene.marker(fe.attachment("tip"));
    scene.channel("z", Measure::displacement(end, 2));
    scene.channel("a", Measure::acceleration(end, 2));
    SceneRun run(scene, 1, std::string(" -ts_dt 0.005 -ts_adapt_type none -ts_max_steps 2 -ts_rtol 1e-6 -ts_atol 1e-6 ") + (factor ? "-pc_type cholesky " : ""));
    must(run.solve());
    must(TSGetTime(run.ts, &t));
    must(scene.sample(run.ts, t, values));
    tip[factor] = values[0];
    must(scene.sample(run.ts, t - 0.0025, values));
    between[factor] = values[1];
    must(TSGetSNES(run.ts, &snes));
    must(SNESGetKSP(snes, &ksp));
    must(PetscObjectTypeCompare((PetscObject)ksp, KSPCG, &cg));
    EXPECT_EQ((bool)cg, !factor);
  }
  MEASURED("tip %.8g, %.8g, acceleration between steps %.8g, %.8g", tip[0], tip[1], between[0], between[1]);
  EXPECT_NEAR(tip[0], tip[1], 2e-6);
  EXPECT_NEAR(between[0], between[1], 1e-4 * std::abs(between[1]));
}

/* Clamped at one end, with a force on the other */
class LoadedBody
{
public:
  Scene         scene{PETSC_COMM_SELF};
  const Marker &tip() const { return force_.i; }

  LoadedBody(const hhtex::SolidBeam &mesh, const Expression &x, const Expression &z) : mesh_(mesh)
  {
    FullBody b;
    b.law         = FeLaw::Large;
    b.attachments = hhtex::BeamAttachments();
    must(fe_.add(scene, "beam", mesh_.model, b));
    scene.add("clamp", Fixed{scene.marker(fe_.attachment("root")), scene.marker(scene.ground())});
    force_.i     = scene.marker(fe_.attachment("tip"));
    force_.j     = scene.marker(scene.ground());
    force_.force = {x, constant(0), z};
    scene.add("load", force_);
  }
  static Expression constant(double f) { return Expression{{Measure::time()}, [f](const Real *t) -> Real { return f + 0 * t[0]; }}; }

private:
  const BeamMesh mesh_;
  FullFeBody     fe_;
  UserForce      force_;
};

/* 3 x 2 x 1 m of 10-node tetrahedra */
static hhtex::SolidBeam tetrahedra()
{
  hhtex::SolidBeam block;
  block.n[0]     = 9;
  block.n[1]     = 6;
  block.n[2]     = 3;
  block.length   = 3;
  block.depth    = 2;
  block.width    = 1;
  block.element  = hhtex::BeamElement::Tetrahedron10;
  block.material = {7e8, 0.33, 2700};
  return block;
}

/* A load that sets in within four steps: the rates at the start predict values at the end of the first step that are
   far off, and Newton's method diverges from them. Starting from the last values it converges; otherwise h would be
   reduced, and stay short */
TEST(FullBodyDynamics, FirstOfFixedStepsAsAsked)
{
  LoadedBody       beam(tetrahedra(), LoadedBody::constant(0), Expression{{Measure::time()}, [](const Real *t) -> Real { return -1e7 * min(t[0] / 0.02, 1.); }});
  TSHHT3Statistics s;
  SceneRun         run(beam.scene, 1, " -ts_dt 5e-3 -ts_adapt_type none -ts_max_steps 3 -ts_rtol 1e-4 -ts_atol 1e-4 -ts_hhtdae_alpha -0.05 ");
  must(run.solve());
  must(TSHHT3GetStatistics(run.ts, &s));
  MEASURED("%d steps, %d failed corrections, %d retries, h at least %g", (int)s.steps, (int)s.corrector_fails, (int)s.retries, (double)s.h_min);
  EXPECT_EQ(s.corrector_fails, 0);
  EXPECT_EQ(s.h_min, 5e-3);
}

/* A load that acts suddenly, with steps that do not resolve the vibration of the ends of the body. The error that
   conjugate gradients leave in the first correction is larger in the positions than the correction itself, which is no
   reason for another matrix */
TEST(FullBodyDynamics, LoadThatComesAtOnce)
{
  PetscReal end[2];
  for (int factor = 0; factor < 2; factor++) {
    LoadedBody          beam(tetrahedra(), LoadedBody::constant(5e3), LoadedBody::constant(0));
    TSHHT3Statistics    s;
    std::vector<double> values;
    PetscReal           t;
    beam.scene.channel("x", Measure::displacement(beam.tip(), 0));
    SceneRun run(beam.scene, 1, std::string(" -ts_dt 1e-3 -ts_adapt_type none -ts_max_steps 30 ") + (factor ? "-pc_type cholesky" : "-ksp_type cg -pc_type hhtconstraint"));
    must(run.solve());
    must(TSHHT3GetStatistics(run.ts, &s));
    must(TSGetTime(run.ts, &t));
    must(beam.scene.sample(run.ts, t, values));
    end[factor] = values[0] - tetrahedra().length;
    MEASURED("%d steps, %d matrices, %d failed corrections, %d retries; tip %.8g", (int)s.steps, (int)s.jacobians, (int)s.corrector_fails, (int)s.retries, (double)end[factor]);
    EXPECT_EQ(s.corrector_fails, 0);
    EXPECT_EQ(s.retries, 0);
    EXPECT_LE(s.jacobians, 4);
    EXPECT_EQ(s.steps, 30);
  }
  EXPECT_NEAR(end[0], end[1], 1e-5 * std::abs(end[1]));
}

/* A thin plate under a sudden load, with steps of many periods of its thickness vibration. The accelerations of the
   start, and those that oscillate from step to step, predict strains of order 100. The correction converges if it
   starts from the values at the beginning of the step, and the following steps start from these at once */
TEST(FullBodyDynamics, FixedStepsOfAThinPlate)
{
  hhtex::SolidBeam plate;
  plate.n[0] = plate.n[1] = 10;
  plate.n[2]              = 1;
  plate.length = plate.depth = 1;
  plate.width                = 0.005;
  plate.element              = hhtex::BeamElement::Brick20;
  plate.material             = {2e11, 0.3, 7800};
  LoadedBody       body(plate, LoadedBody::constant(0), LoadedBody::constant(-100));
  TSHHT3Statistics s;
  SceneRun         run(body.scene, 1, " -ts_dt 1e-3 -ts_adapt_type none -ts_max_steps 10 -ts_rtol 1e-4 -ts_atol 1e-4 ");
  must(run.solve());
  must(TSHHT3GetStatistics(run.ts, &s));
  MEASURED("%d steps, %d corrections, %d failed, %d retries, h at least %g", (int)s.steps, (int)s.newton, (int)s.corrector_fails, (int)s.retries, (double)s.h_min);
  EXPECT_EQ(s.corrector_fails, 0);
  EXPECT_EQ(s.h_min, 1e-3);
  EXPECT_LE(s.retries, 2);
}

/* Free flight with a spin whose centrifugal load makes the body vibrate: errors are proportional to the square of the step */
TEST(FullBodyDynamics, EnergyAndMomentumOfAFreeBody)
{
  hhtex::SolidBeam block = slender(3);
  block.depth            = 0.4;
  block.width            = 0.3;
  block.material         = {5e4, 0.3, 1000};
  const BeamMesh m(block);
  double         drift[3][3];
  for (int k = 0; k < 3; k++) {
    Scene      scene(PETSC_COMM_SELF);
    FullFeBody fe;
    FullBody   b;
    b.angular_velocity = {0.5, -1, 2};
    b.velocity         = {0.1, 0.2, -0.1};
    TemporaryFile file(text("full_balance%d.csv", k));
    must(fe.add(scene, "block", m.model, b));
    scene.output().balance      = true;
    scene.output().balance_file = file.name;
    SceneRun run(scene, 1, fixedAt(4e-3 / (1 << k)) + " -ts_hhtdae_alpha 0 -ts_hhtdae_corrector_tolerance 1e-3 ");
    must(run.solve());
    const CSV   table(file.text());
    const Array energy = table.column("total"), lx = table.column("Lx"), ly = table.column("Ly"),
                lz = table.column("Lz"), px = table.column("px"), elastic = table.column("elastic");
    for (double &d : drift[k]) d = 0;
    double strain = 0;
    for (std::size_t i = 0; i < energy.size(); i++) {
      widen(drift[k][0], std::abs(energy[i] - energy[0]) / energy[0]);
      widen(drift[k][1],
            Vector3(lx[i] - lx[0], ly[i] - ly[0], lz[i] - lz[0]).norm() / Vector3(lx[0], ly[0], lz[0]).norm());
      widen(drift[k][2], std::abs(px[i] / px[0] - 1));
      widen(strain, elastic[i] / energy[0]);
    }
    EXPECT_GT(strain, 1e-3) << "the body does not vibrate";
  }
  MEASURED("drift of energy %.2e, %.2e, %.2e, of angular momentum %.2e, %.2e, %.2e, of momentum %.1e", drift[0][0],
           drift[1][0], drift[2][0], drift[0][1], drift[1][1], drift[2][1], drift[2][2]);
  for (int q = 0; q < 2; q++) {
    EXPECT_LT(drift[2][q], 1e-4);
    EXPECT_LT(drift[2][q], 0.3 * drift[1][q]);
    EXPECT_LT(drift[1][q], 0.3 * drift[0][q]);
  }
  EXPECT_LT(drift[2][2], 1e-9);
}

/* ---- modes against the model from which they were made ---- */

namespace
{

/* Displacement of the tip of a cantilever after a small oblique force is applied suddenly, at many times */
Array struck(const FeModel &model, PetscInt modes, double force)
{
  Scene           scene(PETSC_COMM_SELF);
  FullFeBody      fe;
  hhtex::BeamEnds ends;
  if (modes >= 0) {
    must(AddModalBeam(scene, model, 1, 1, modes, &ends, Tie::Rigid));
  } else {
    must(AddFullBeam(scene, model, FeLaw::Small, &fe, &ends, Tie::Rigid));
  }
  const Marker tip = scene.marker(ends.tip);
  scene.add("clamp", Fixed{scene.marker(ends.root), scene.marker(scene.ground())});
  UserForce push;
  push.i = tip;
  for (double f : {3 * force, force, 2 * force})
    push.force.push_back(Expression({Measure::time()}, [f](const Real *t) -> Real { return 0. * t[0] + f; }));
  scene.add("push", push);
  scene.channel("y", Measure::displacement(tip, 1));
  scene.channel("z", Measure::displacement(tip, 2));
  scene.channel("turn", Measure::angularVelocity(tip, 2));
  TemporaryFile file(text("struck%d.csv", (int)modes));
  scene.output().csv        = file.name;
  const std::string options = " -ts_dt 2e-4 -ts_adapt_type none -ts_max_steps 10000000 -ts_rtol 1e-11 -ts_atol 1e-11 "
                              "-ts_hhtdae_corrector_tolerance 0.1 ";
  SceneRun          run(scene, 0.06, options);
  must(run.solve());
  const CSV table(file.text());
  Array     all;
  for (const char *name : {"y", "z"})
    for (double x : table.column(name)) all.push_back(x / force);
  return all;
}

} // namespace

/* Small displacements: all modes of the model together give its motion except for terms of second order; with fewer
   modes the error is larger */
TEST(FullBodyDynamics, ModesAgainstTheModel)
{
  const BeamMesh m(slender(2)); /* 32 nodes, of which 16 are not at an attachment */
  const double   force  = 1e-3;
  const Array    whole  = struck(m.model, -1, force);
  double         before = PETSC_MAX_REAL, error = 0;
  std::string    all;
  for (PetscInt modes : {0, 2, 6, 48}) {
    error = relativeDifference(struck(m.model, modes, force), whole);
    all += text(" %d: %.1e", (int)modes, error);
    EXPECT_LT(error, before) << modes;
    before = error;
  }
  const double larger = relativeDifference(struck(m.model, 48, 30 * force), struck(m.model, -1, 30 * force));
  MEASURED("difference to the whole model, by normal modes:%s; all of them, 30 times the force: %.1e", all.c_str(),
           larger);
  EXPECT_LT(error, 1e-5);
  EXPECT_NEAR(larger / error, 30, 10) << "what is left must be of second order in the displacement";
}

/* A stiff bar in fast rotation is longer by L (tan(a L)/(a L) - 1), a = Omega sqrt(rho/E); its strain is 1e-4, so that
   terms of second order are a relative 1e-4. The effect of the step is of the same size: on a circle the method's
   acceleration is larger than Omega^2 r by the relative amount c (Omega h)^2, where for its parameters, with f =
   -alpha, c = -1/12 + (1/4 + beta - gamma/2) - (gamma - 1/2)^2/2 + f (1 - f)/2 */
TEST(FullBodyDynamics, BarInFastRotation)
{
  hhtex::SolidBeam bar = slender(4);
  bar.material         = {2e9, 0, 1000};
  const double   spin = 30, aL = spin * bar.length * std::sqrt(bar.material.density / bar.material.young);
  const double   exact = bar.length * (std::tan(aL) / aL - 1);
  const BeamMesh m(bar);
  double         error[2];
  for (int k = 0; k < 2; k++) {
    Scene           scene(PETSC_COMM_SELF);
    FullFeBody      fe;
    hhtex::BeamEnds ends;
    must(AddFullBeam(scene, m.model, FeLaw::Large, &fe, &ends));
    const Body   hub  = scene.add("hub", RigidBody{});
    const Marker axis = scene.marker(hub), ground = scene.marker(scene.ground());
    scene.add("bearing", Revolute{axis, ground});
    scene.add("drive", RotationalMotion{axis, ground, TimeFunction::step5(0, 0, 0.8, spin), MotionOf::Velocity});
    scene.add("clamp", Fixed{scene.marker(ends.root), axis});
    scene.channel("x", Measure::displacement(scene.marker(ends.tip), 0, axis, axis));
    const double h    = 2e-3 / (1 << k);
    const Array  x    = history(scene, 1.6, fixedAt(h) + " -ts_hhtdae_alpha -0.3 -ts_hhtdae_corrector_tolerance 1e-4 ", "x");
    double       mean = 0;
    const auto   n    = (std::size_t)(0.5 / h);
    for (std::size_t i = x.size() - n; i < x.size(); i++) mean += (x[i] - bar.length) / (double)n;
    error[k] = mean / exact - 1;
  }
  MEASURED("extension %.4e m of a bar of 1 m; the model's is off by %.2e, %.2e", exact, error[0], error[1]);
  EXPECT_LT(std::abs(error[1]), 5e-4);
  const double f = 0.3, beta = (1 + f) * (1 + f) / 4, gamma = 0.5 + f;
  const double c = -1. / 12 + (0.25 + beta - gamma / 2) - f * f / 2 + f * (1 - f) / 2;
  EXPECT_NEAR((error[0] - error[1]) / (spin * spin * 2e-3 * 2e-3 * 0.75), c, 0.1 * c);
}

/* Slowest modes about rest, by sparse algebra over nodes and multipliers, against the matrices */
TEST(FullBodyModes, ClampedBeam)
{
  const BeamMesh    m(slender());
  Scene             scene(PETSC_COMM_SELF);
  FullFeBody        fe;
  FullBody          b;
  const double      omega = firstFrequency(m.model), ratio = 0.02;
  std::vector<Mode> modes;
  Linearization     small;
  b.law               = FeLaw::Small;
  b.stiffness_damping = 2 * ratio / omega;
  b.attachments       = hhtex::BeamAttachments();
  must(fe.add(scene, "beam", m.model, b));
  scene.add("clamp", Fixed{scene.marker(fe.attachment("root")), scene.marker(scene.ground())});
  SceneRun run(scene, 1, fixedAt(1e-4));
  must(small.take(run.ts));
  must(SlowestModes(small, 4, &modes));
  MEASURED("circular frequency %.9g, of the matrices %.9g; damping ratio %.6g", std::abs(modes[0].value), omega, modes[0].dampingRatio());
  EXPECT_NEAR(std::abs(modes[0].value) / omega, 1, 1e-6);
  EXPECT_NEAR(modes[0].dampingRatio() / ratio, 1, 1e-6);
  for (std::size_t k = 1; k < modes.size(); k++) EXPECT_NEAR(modes[k].dampingRatio() / std::abs(modes[k].value), ratio / omega, 1e-6 * ratio / omega);
}

/* A free body: six rigid-body modes without stiffness, and the first bending modes */
TEST(FullBodyModes, FreeBeam)
{
  const BeamMesh        m(slender());
  Scene                 scene(PETSC_COMM_SELF);
  FullFeBody            fe;
  FullBody              b;
  std::vector<PetscInt> rows(3 * m.model.nodes);
  std::vector<Mode>     modes;
  Linearization         small;
  std::iota(rows.begin(), rows.end(), 0);
  const Eigen::VectorXd expected = hhtest::EigenvaluesOf(dense(m.model.K, rows), dense(m.model.M, rows));
  b.law = FeLaw::Small;
  must(fe.add(scene, "beam", m.model, b));
  SceneRun run(scene, 1, fixedAt(1e-4));
  must(small.take(run.ts));
  must(SlowestModes(small, 12, &modes));
  std::vector<double> found;
  for (const Mode &mode : modes)
    if (mode.value.imag() > 1) found.push_back(mode.value.imag());
  ASSERT_GE(found.size(), 2u);
  for (int k = 0; k < 2; k++) {
    MEASURED("circular frequency %.9g, of the matrices %.9g", found[k], std::sqrt(expected(6 + k)));
    EXPECT_NEAR(found[k] / std::sqrt(expected(6 + k)), 1, 1e-5);
  }
}
