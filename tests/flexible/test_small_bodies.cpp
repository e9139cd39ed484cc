/* Steel bodies of the same shape with lengths from 0.1 mm to 100 m: scaled by their length, wave speed and mass, all
   results must be the same */
#include "dense.h"
#include "hhtdae/helpers.h"
#include "hhtdae/linearize.h"
#include "hhtdae/modes.h"
#include "reduction_cases.h"
#include "scene/model.h"
#include "scene_output.h"

using namespace hhtest;
using Complex  = std::complex<double>;
using Complexs = Eigen::Matrix<Complex, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

namespace
{

constexpr double lengths[] = {1, 100, 2e-2, 1e-3, 1e-4};
constexpr double width = 0.1, depth = 0.05; /* relative to the length */

ReducedBody reduced(double l, const Reduction &r)
{
  Made        made({{8, 2, 1}, {l, width * l, depth * l}});
  ReducedBody body;
  must(Reduce(made.model, r, &body));
  if (body.shape.size()) must(AddStressModes(made.model, &body));
  return body;
}

Vector3 middle(double x, double l) { return {x * l, width * l / 2, depth * l / 2}; }

/* Clamped at its left end and optionally at its right end; 1 % damping */
struct Cantilever {
  Scene  scene{PETSC_COMM_SELF};
  Body   body;
  Marker tip;
  explicit Cantilever(double l, const Reduction &r = both(4), bool both_ends = false)
  {
    FlexibleBody b;
    b.model   = std::make_shared<ModalBody>(reduced(l, r).modal);
    b.damping = {{0., 0.01}};
    body      = scene.add("beam", b);
    tip       = scene.marker(scene.attachment(body, "right"));
    scene.add("clamp", Fixed{scene.marker(scene.attachment(body, "left")), scene.marker(scene.ground(), middle(0, l))});
    if (both_ends) scene.add("other", Fixed{tip, scene.marker(scene.ground(), middle(1, l))});
  }
};

struct Taken {
  SceneRun      run;
  Linearization small;
  explicit Taken(Scene &s) : run(s, 1, tolerance(1e-8)) { must(small.take(run.ts)); }
};

/* |a - b| <= part |b| */
template <class A, class B> void expectEqual(const A &a, const B &b, double part, const std::string &what)
{
  ASSERT_EQ(a.rows(), b.rows()) << what;
  ASSERT_EQ(a.cols(), b.cols()) << what;
  EXPECT_LE((a - b).norm(), part * b.norm()) << what;
}

/* Eigenvalues times the length */
Eigen::VectorXcd values(const std::vector<Mode> &modes, double l)
{
  Eigen::VectorXcd v(modes.size());
  for (std::size_t k = 0; k < modes.size(); k++) v(k) = modes[k].value * l;
  return v;
}

Complexs complexOf(const std::vector<double> &x, PetscInt rows, PetscInt columns)
{
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(x.data(), rows, columns).cast<Complex>();
}

} // namespace

/* Results of a reduction. Modes are orthonormal in the mass matrix, which is proportional to l^3 */
TEST(SmallBodies, Reduction)
{
  for (Tie tie : {Tie::Rigid, Tie::Average}) {
    Reduction r  = both(6, tie);
    r.stiffening = true;
    ReducedBody one;
    for (double l : lengths) {
      ReducedBody       b = reduced(l, r);
      const std::string at = text("length %g", l);
      if (l == 1) {
        one = b;
        continue;
      }
      expectEqual(l * b.modal.omega, one.modal.omega, 1e-8, at);
      for (std::size_t k = 0; k < b.mode.size(); k++) EXPECT_NEAR(b.mode[k].residual, one.mode[k].residual, 1e-6) << at;
      for (int a = 0; a < 2; a++) {
        const ModalAttachment &x = b.modal.attachments[a], &y = one.modal.attachments[a];
        expectEqual(std::pow(l, 1.5) * x.translation, y.translation, 1e-6, at);
        expectEqual(std::pow(l, 2.5) * x.rotation, y.rotation, 1e-6, at);
        for (int c = 0; c < 6; c++) expectEqual(std::pow(l, c < 3 ? 4 : 5) * x.stiffening[c], y.stiffening[c], 1e-6, at + text(" load %d", c));
      }
      for (int c = 0; c < 6; c++) expectEqual(b.modal.stiffening[c], one.modal.stiffening[c], 1e-6, at);
      expectEqual(std::pow(l, 2.5) * b.stress.values, one.stress.values, 1e-6, at);
    }
  }
}

/* Almost all existing modes are requested, so that Krylov spaces are exhausted */
TEST(SmallBodies, ManyModes)
{
  for (Method method : {Method::CraigBampton, Method::FreeFree})
    for (PetscInt modes : {20, 30, 60}) {
      Eigen::VectorXd one;
      for (double l : {1., 1e-3, 5e-4, 1e-4, 1e-6}) {
        Reduction r = both(modes, Tie::Average);
        r.method    = method;
        r.all_nodes = false;
        const ReducedBody b = reduced(l, r);
        if (l == 1) one = b.modal.omega;
        expectEqual((l * b.modal.omega).eval(), one, 1e-8, text("%d modes at %g", (int)modes, l));
      }
    }
}

TEST(SmallBodies, Modes)
{
  Eigen::VectorXcd one;
  for (double l : lengths) {
    Cantilever              beam(l);
    const Taken       t(beam.scene);
    std::vector<Mode> modes;
    must(t.small.modes(&modes));
    const Eigen::VectorXcd v = values(modes, l);
    if (l == 1) one = v;
    ASSERT_EQ(v.size(), one.size()) << l;
    for (Eigen::Index k = 0; k < v.size(); k++) {
      EXPECT_LT(std::abs(v(k) - one(k)), 1e-9 * std::abs(one(k))) << l << ": mode " << k;
      EXPECT_NEAR(modes[k].dampingRatio(), -one(k).real() / std::abs(one(k)), 1e-9) << l << ": mode " << k;
    }
  }
}

/* With the default shift, which is far below the modes, and with others */
TEST(SmallBodies, SlowestModes)
{
  for (double l : lengths) {
    Cantilever              beam(l);
    const Taken       t(beam.scene);
    std::vector<Mode> all, slow;
    must(t.small.modes(&all));
    for (double shift : {1., 0.1 / l, 300 / l}) {
      must(SlowestModes(t.small, 3, &slow, shift));
      for (int k = 0; k < 3; k++) EXPECT_LT(std::abs(slow[k].value - all[k].value), 1e-8 * std::abs(all[k].value)) << l << ": mode " << k << " from " << shift;
    }
  }
}

/* Six rigid-body modes beside elastic ones, or alone: in modal coordinates and for the whole model, in which the
   rounding of the stiffness acts on rigid motions */
TEST(SmallBodies, SlowestModesOfAFreeBody)
{
  for (bool whole : {false, true}) {
    std::vector<double> one;
    for (double l : lengths) {
      Scene             scene(PETSC_COMM_SELF);
      Made              made({{8, 2, 1}, {l, width * l, depth * l}});
      FullFeBody        fe;
      FlexibleBody      b;
      if (whole) {
        must(fe.add(scene, "beam", made.model, FullBody()));
      } else {
        b.model = std::make_shared<ModalBody>(reduced(l, both(30)).modal);
        scene.add("beam", b);
      }
      const Taken         t(scene);
      std::vector<Mode>   slow;
      std::vector<double> elastic;
      must(SlowestModes(t.small, 16, &slow)); /* each rigid motion has two eigenvalues */
      for (const Mode &m : slow)
        if (std::abs(m.value) > 100 / l) elastic.push_back(std::abs(m.value) * l);
      if (l == 1) one = elastic;
      ASSERT_GE(elastic.size(), 4u) << l;
      for (std::size_t k = 0; k < 4; k++) EXPECT_NEAR(elastic[k], one[k], 1e-5 * one[k]) << l; /* with rigid motions the default shift is kept */
      must(SlowestModes(t.small, 3, &slow, l < 1 ? 300 / l : 1));
      for (const Mode &m : slow) EXPECT_LT(std::abs(m.value), 1 / l) << l;
    }
  }
}

/* A whole body on a hinge and a soft spring: the small parts of fast modes that an eigensolver leaves in the slow mode
   have far more stiffness than the slow mode has inertia */
TEST(SmallBodies, SlowestModesOfAStiffBodyOnASoftSpring)
{
  for (double stiffness : {3., 300.}) {
    Scene                scene(PETSC_COMM_SELF);
    Made                 made({{6, 1, 1}, {1, 0.03, 0.03}}); /* steel */
    FullFeBody           fe;
    FullBody             b;
    TorsionalSpringDamper spring;
    b.law         = FeLaw::Small;
    b.attachments = both().attachments;
    must(fe.add(scene, "beam", made.model, b));
    const Matrix3 axes = axesAlong({0, 1, 0});
    spring.i           = scene.marker(fe.attachment("left"), Vector3::Zero(), axes);
    spring.j           = scene.marker(scene.ground(), {0, 0.015, 0.015}, axes);
    spring.stiffness   = stiffness;
    scene.add("hinge", Revolute{spring.i, spring.j});
    scene.add("spring", spring);
    const Taken       t(scene);
    std::vector<Mode> all, slow;
    must(t.small.modes(&all));
    const double rigid = std::sqrt(stiffness / (7850 * 0.03 * 0.03 * (1. / 3 + 0.03 * 0.03 / 12))); /* the exact inertia of consistent masses */
    for (int count : {1, 3, 6})
      for (double shift : {1., 10., 100.}) {
        SCOPED_TRACE(text("%g N m/rad: %d modes about %g 1/s", stiffness, count, shift));
        must(SlowestModes(t.small, count, &slow, shift));
        ASSERT_EQ((int)slow.size(), count);
        EXPECT_NEAR(std::abs(slow[0].value), rigid, 1e-3 * rigid);
        for (int k = 0; k < count; k++) EXPECT_NEAR(std::abs(slow[k].value), std::abs(all[k].value), 1e-3 * std::abs(all[k].value)) << k; /* dense algebra loses five more digits */
      }
  }
}

/* Eight modes over more than two decades, the fastest far from any shift that suits the slowest: each is found once,
   to six digits */
TEST(SmallBodies, ModesOfAllSpeeds)
{
  Scene                 scene(PETSC_COMM_SELF);
  Made                  made({{6, 1, 1}, {1, 0.05, 0.05}});
  FullFeBody            fe;
  FullBody              b;
  RigidBody             mass;
  TorsionalSpringDamper spring;
  b.law         = FeLaw::Small;
  b.attachments = both().attachments;
  must(fe.add(scene, "beam", made.model, b));
  mass.mass            = 5;
  mass.inertia         = Vector3(0.01, 0.01, 0.01).asDiagonal();
  mass.position        = Vector3(1.3, 0.025, 0.025);
  const auto    tip    = scene.add("mass", mass);
  const Matrix3 axes   = axesAlong({0, 1, 0});
  spring.i             = scene.marker(tip, {-0.3, 0, 0}, axes);
  spring.j             = scene.marker(fe.attachment("right"), Vector3::Zero(), axes);
  spring.stiffness     = 200;
  scene.add("clamp", Fixed{scene.marker(fe.attachment("left")), scene.marker(scene.ground(), {0, 0.025, 0.025})});
  scene.add("hinge", Revolute{spring.i, spring.j});
  scene.add("spring", spring);
  const Taken       t(scene);
  std::vector<Mode> all, slow;
  must(t.small.modes(&all));
  for (double shift : {1., 20., 3000.}) {
    must(SlowestModes(t.small, 8, &slow, shift));
    ASSERT_EQ(slow.size(), 8u);
    for (int k = 0; k < 8; k++) EXPECT_NEAR(std::abs(slow[k].value), std::abs(all[k].value), 1e-6 * std::abs(all[k].value)) << k << " about " << shift;
  }
}

/* The axes of the linearization rotate with the flexible bodies if all rotate alike; otherwise a message says so, in
   any order of the bodies, except for spins too small to affect a mode */
TEST(SmallBodies, AxesOfSeveralBodies)
{
  const auto model = std::make_shared<ModalBody>(reduced(1, both(4)).modal);
  const auto said  = [&](double first, double second) {
    Scene   scene(PETSC_COMM_SELF);
    Printed out;
    for (double spin : {first, second}) {
      FlexibleBody b;
      b.model            = model;
      b.angular_velocity = {0, 0, spin};
      scene.add("", b);
    }
    const Taken t(scene);
    return out.text().find("do not turn alike") != std::string::npos;
  };
  EXPECT_FALSE(said(0, 0));
  EXPECT_FALSE(said(50, 50));
  EXPECT_FALSE(said(50, 50.001));
  EXPECT_FALSE(said(0, 1e-6));
  EXPECT_TRUE(said(0, 50));
  EXPECT_TRUE(said(50, 0));
  EXPECT_TRUE(said(50, -50));
}

/* Options that lose all digits lead to an error, not to wrong modes */
TEST(SmallBodies, SlowestModesAreChecked)
{
  Options           options("-scene_modes_pep_scale none -scene_modes_pep_target 1");
  Cantilever              beam(1e-4);
  const Taken       t(beam.scene);
  std::vector<Mode> slow;
  ErrorTrap         trap;
  EXPECT_NE(SlowestModes(t.small, 3, &slow), 0);
  EXPECT_TRUE(trap.says("without balance")) << trap.message;
}

/* A multiple eigenvalue: a search finds as many of its modes as rounding separates, at first nine of twelve here */
TEST(SmallBodies, SlowestModesOfEqualParts)
{
  Scene             scene(PETSC_COMM_SELF);
  std::vector<Mode> slow;
  for (int k = 0; k < 42; k++) {
    PointMass m;
    m.position          = {double(k), 0, 0};
    const Body   b      = scene.add("", m);
    const Marker i      = scene.marker(b), j = scene.marker(scene.ground(), m.position);
    SpringDamper spring{i, scene.marker(scene.ground(), m.position - Vector3::UnitZ())};
    spring.stiffness = k < 12 ? 4 : 13 + k;
    scene.add("", InLine{i, j});
    scene.add("", spring);
  }
  const Taken t(scene);
  must(SlowestModes(t.small, 14, &slow));
  ASSERT_EQ(slow.size(), 14u);
  for (int k = 0; k < 12; k++) EXPECT_NEAR(std::abs(slow[k].value), 2, 1e-8) << k;
  for (int k = 12; k < 14; k++) EXPECT_NEAR(std::abs(slow[k].value), std::sqrt(13. + k), 1e-8) << k;
  Complexs shapes(12, (Eigen::Index)slow[0].shape.size());
  for (int k = 0; k < 12; k++) shapes.row(k) = Eigen::Map<const Complexs>(slow[k].shape.data(), 1, shapes.cols()).normalized();
  EXPECT_EQ(hhtest::RankOf(shapes, 1e-6), 12);
  for (const auto &wrong : {std::pair<PetscInt, double>{1000, 1}, {3, NAN}}) {
    ErrorTrap trap;
    EXPECT_NE(SlowestModes(t.small, wrong.first, &slow, wrong.second), 0);
    EXPECT_TRUE(trap.says(wrong.first == 3 ? "shift" : "too many")) << trap.message;
  }
}

/* Transfer functions by minimal coordinates and by the sparse system, at low frequency and near the first modes: from
   force and moment at the tip to displacement, velocity, acceleration and rotation there */
TEST(SmallBodies, StateSpace)
{
  const double speeds[] = {0, 400, 3000};
  Complexs     one[3];
  for (double l : lengths) {
    Cantilever                       beam(l);
    const Taken                t(beam.scene);
    const Marker               ground = beam.scene.marker(beam.scene.ground());
    const std::vector<Measure> out    = {Measure::displacement(beam.tip, 2), Measure::velocity(beam.tip, 2), Measure::acceleration(beam.tip, 2), Measure::angle(beam.tip, ground)};
    const std::vector<Excitation> in  = {Excitation::force(beam.tip, {0, 1, 1}), Excitation::torque(beam.tip, {1, 1, 1})};
    StateSpace                    z;
    must(t.small.stateSpace(in, out, &z));
    const Complexs A = complexOf(z.A, z.states, z.states), B = complexOf(z.B, z.states, 2), C = complexOf(z.C, 4, z.states), D = complexOf(z.D, 4, 2);
    for (int w = 0; w < 3; w++) {
      Complexs h = C * hhtest::SolveComplex(Complex(0, speeds[w] / l) * Complexs::Identity(z.states, z.states) - A, B) + D;
      for (int o = 0; o < 4; o++)
        for (int i = 0; i < 2; i++) {
          std::vector<Complex> x;
          must(t.small.response(in[i], out[o], {speeds[w] / l}, &x));
          if (speeds[w] > 0 || o % 3 == 0) {
            EXPECT_LT(std::abs(x[0] - h(o, i)), 1e-6 * std::abs(x[0])) << l << ": " << i << " to " << o << " at " << speeds[w];
          }
          h(o, i) *= std::pow(l, o < 3 ? 1 + o : 2) * (i ? l : 1);
        }
      if (l == 1) one[w] = h;
      for (int o = 0; o < 4; o++)
        if (speeds[w] > 0 || o % 3 == 0) expectEqual(h.row(o).eval(), one[w].row(o).eval(), 1e-6, text("length %g, output %d at %g", l, o, speeds[w]));
    }
  }
}

/* With both ends clamped no constraint is redundant, for any size and number of modes */
TEST(SmallBodies, Attachments)
{
  for (Tie tie : {Tie::Rigid, Tie::Average})
    for (double l : lengths)
      for (int modes : {0, 6}) {
        Cantilever    beam(l, both(modes, tie), true);
        Printed out;
        TS      ts;
        must(beam.scene.createTS(&ts));
        must(TSDestroy(&ts));
        EXPECT_EQ(DataOf(beam.scene).started.redundant, 0) << l << " with " << modes << ": " << out.text();
      }
}

/* The same in a large scene */
TEST(SmallBodies, AttachmentsInALargeScene)
{
  Cantilever beam(1e-4, both(0), true);
  for (double x : {-5., 5.}) {
    RigidBody b;
    b.mass     = 100;
    b.inertia  = Matrix3::Identity();
    b.position = {x, 0, 0};
    beam.scene.add(text("block %g", x), b);
  }
  Printed out;
  TS      ts;
  must(beam.scene.createTS(&ts));
  must(TSDestroy(&ts));
  EXPECT_EQ(DataOf(beam.scene).started.redundant, 0) << out.text();
}

namespace
{

/* A force of 1000 N times the square of the length acts at the tip, and the scene starts in equilibrium */
void hangLoad(Cantilever &beam, double l)
{
  UserForce f;
  f.i = beam.tip;
  for (int k = 0; k < 3; k++) f.force.push_back(Expression({Measure::time()}, [x = k < 2 ? 0 : -1e3 * l * l](const Real *t) -> Real { return 0. * t[0] + x; }));
  beam.scene.add("load", f);
  beam.scene.start().equilibrium = true;
}

} // namespace

/* Bending by a force at the tip: the same relative deflection in the same number of iterations */
TEST(SmallBodies, Equilibrium)
{
  double   one        = 0;
  PetscInt iterations = 0;
  for (double l : lengths) {
    Cantilever beam(l);
    hangLoad(beam, l);
    must(beam.scene.setUp());
    const double down = (DataOf(beam.scene).frame(beam.tip).x - middle(1, l)).z() / l;
    if (l == 1) {
      one        = down;
      iterations = DataOf(beam.scene).started.equilibrium_iterations;
    }
    EXPECT_NEAR(down, one, 1e-9 * std::abs(one)) << l;
    EXPECT_EQ(DataOf(beam.scene).started.equilibrium_iterations, iterations) << l;
  }
}

/* At rest accelerations are rounding errors, and those of rotations are the larger the smaller a body is: the
   imbalance of loads that they leave decides about convergence */
TEST(SmallBodies, StartFromEquilibrium)
{
  double one = 0;
  for (double l : lengths) {
    Cantilever beam(l);
    hangLoad(beam, l);
    SceneRun run(beam.scene, 1e-3 * l, "-ts_rtol 1e-6 -ts_atol 1e-6 -ts_max_steps 20");
    must(run.solve());
    const double down = (DataOf(beam.scene).frame(beam.tip).x - middle(1, l)).z() / l;
    if (l == 1) one = down;
    EXPECT_NEAR(down, one, 1e-9 * std::abs(one)) << l;
    EXPECT_GT(std::abs(one), 1e-5);
  }
}
