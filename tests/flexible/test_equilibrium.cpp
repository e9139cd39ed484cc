/* Static equilibrium of thin parts: large rotations in few corrections, and no convergence to unstable states */
#include "hhtdae/helpers.h"
#include "box_model.h"
#include "hhtdae/flexible.h"
#include "scene/model.h"
#include "support.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

/* A constant force in space axes, given as an expression */
void load(Scene &s, Marker tip, Vector3 force)
{
  UserForce f;
  f.i = tip;
  for (int k = 0; k < 3; k++) f.force.push_back(Expression({Measure::time()}, [x = force(k)](const Real *t) -> Real { return 0. * t[0] + x; }));
  s.add("load", f);
}

/* A beam of one metre along x with a square section, clamped at its left end */
struct Plank {
  FeModel    model{PETSC_COMM_WORLD};
  FullFeBody fe;
  Scene      scene{PETSC_COMM_WORLD};
  Body       tip;

  Plank(int n, double depth, double young, Vector3 force, Vector3 position = Vector3::Zero(), FeLaw law = FeLaw::Large)
  {
    FullBody b;
    BoxBuilder({{n, 1, 1}, {1, depth, depth}, {young, 0, 2700}}, &model);
    b.law      = law;
    b.position = position;
    b.attachments.resize(2);
    b.attachments[0].name = "left";
    b.attachments[1].name = "right";
    b.attachments[1].tie  = Tie::Average;
    must(fe.add(scene, "plank", model, b));
    const Marker left = scene.marker(fe.attachment("left"));
    const auto   at   = DataOf(scene).frame(left);
    tip               = fe.attachment("right");
    scene.add("clamp", Fixed{left, scene.marker(scene.ground(), at.x, at.R)});
    load(scene, scene.marker(tip), force);
    scene.start().equilibrium = true;
    must(scene.setUp());
  }
  Vector3 axis() const { return DataOf(scene).bodies[tip.id].A.col(0); }
  int     corrections() const { return (int)DataOf(scene).started.equilibrium_iterations; }
};

} // namespace

/* The rounding errors of the forces of a stiff mesh move a soft spring by more than any tolerance of displacements.
   Reference by hand: m g L/2 cos(angle) = k angle */
TEST(Equilibrium, AStiffBodyOnASoftSpring)
{
  for (FeLaw law : {FeLaw::Small, FeLaw::Large}) {
    FeModel               model(PETSC_COMM_WORLD);
    FullFeBody            fe;
    FullBody              b;
    Scene                 scene(PETSC_COMM_WORLD);
    TorsionalSpringDamper spring;
    const Matrix3         axes = axesAlong({0, 1, 0});
    BoxBuilder({{6, 1, 1}, {1, 0.03, 0.03}, {2e11, 0.3, 7850}}, &model);
    b.law = law;
    b.attachments.resize(1);
    b.attachments[0].name = "left";
    must(fe.add(scene, "beam", model, b));
    spring.i         = scene.marker(fe.attachment("left"), Vector3::Zero(), axes);
    spring.j         = scene.marker(scene.ground(), {0, 0.015, 0.015}, axes);
    spring.stiffness = 30;
    scene.add("hinge", Revolute{spring.i, spring.j});
    scene.add("spring", spring);
    scene.gravity({0, 0, -9.81});
    scene.start().equilibrium = true;
    must(scene.setUp());
    const double moment = 7850 * 0.03 * 0.03 * 9.81 / 2;
    double       angle  = 0;
    for (int k = 0; k < 50; k++) angle += (moment * std::cos(angle) - 30 * angle) / (moment * std::sin(angle) + 30);
    const Matrix3 A = DataOf(scene).bodies[fe.attachment("left").id].A;
    EXPECT_NEAR(std::atan2(-A(2, 0), A(0, 0)), angle, 1e-3 * angle) << (law == FeLaw::Small ? "small" : "large"); /* bending: 1e-4 of it */
  }
}

/* At positions of some 100 m the forces of a stiff mesh have rounding errors, here 1e-4 of the load, which no
   correction can reduce */
TEST(Equilibrium, AMeshFarFromTheOrigin)
{
  for (FeLaw law : {FeLaw::Small, FeLaw::Large}) {
    const Vector3 far(50, 60, -70), force(0, 0, -1);
    Plank         here(8, 0.02, 2.1e11, force, Vector3::Zero(), law), there(8, 0.02, 2.1e11, force, far, law);
    const auto    sag = [](Plank &p, const Vector3 &at) { return (DataOf(p.scene).bodies[p.tip.id].r - at)(2) - 0.01; };
    EXPECT_LT(there.corrections(), 60);
    EXPECT_LT(sag(here, Vector3::Zero()), -5e-6);
    EXPECT_NEAR(sag(there, far), sag(here, Vector3::Zero()), -2e-3 * sag(here, Vector3::Zero()));
  }
}

/* Bending is far softer than stretching: after any correction along a straight line, the residual forces are far above
   the load */
TEST(Equilibrium, AThinPlankBentFar)
{
  for (double depth : {0.02, 0.005}) {
    const double young = 2.1e11, EI = young * std::pow(depth, 4) / 12;
    const int    n     = 6;
    /* 8-node bricks with 2^3 points are too stiff in bending: shear increases the stiffness by the factor 1 + (l/h)^2 G/E */
    const double stiffer = 1 + 0.5 / std::pow(n * depth, 2);
    const Plank  p(n, depth, young, {0, 3 * stiffer * EI, 0});
    const double turn = std::atan2(p.axis()(1), p.axis()(0));
    MEASURED("plank %g m deep: turned by %.2f in %d corrections", depth, turn, p.corrections());
    /* the elastica under P L^2/EI = 3: 0.9860 */
    EXPECT_NEAR(turn, 0.986, 0.05);
    EXPECT_LE(p.corrections(), 40);
  }
}

/* A column under an axial force and a small lateral one: above the critical load the nearly straight equilibrium is
   unstable and must not be the result */
TEST(Equilibrium, AColumnBuckles)
{
  const double depth = 0.1, young = 1e7, EI = young * std::pow(depth, 4) / 12;
  const int    n       = 10;
  const double stiffer = 1 + 0.5 / std::pow(n * depth, 2), critical = stiffer * EI * PETSC_PI * PETSC_PI / 4;
  for (double part : {0.7, 1.5})
    for (double aside : {1e-3, 1e-2, 5e-2}) {
      const Plank  p(n, depth, young, {-part * critical, aside * critical, 0});
      const double turn = std::atan2(p.axis()(1), p.axis()(0));
      MEASURED("column under %g of its critical load, %g aside: turned by %.3f in %d corrections", part, aside, turn, p.corrections());
      if (part < 1) {
        EXPECT_NEAR(turn, 0, 0.3);
      } else {
        EXPECT_GT(std::abs(turn), 1);
      }
      EXPECT_LE(p.corrections(), 200);
    }
}

/* Rigid pieces connected by beam elements, bent like the elastica of P L^2/EI = 3, whose tip moves by 0.6033 across
   and 0.2544 along */
TEST(Equilibrium, AChainOfBeamsBentFar)
{
  const double depth = 0.02, young = 2.1e11, area = depth * depth, I = std::pow(depth, 4) / 12;
  const int    n     = 20;
  Scene        s(PETSC_COMM_WORLD);
  Body         last;
  for (int k = 0; k <= n; k++) {
    RigidBody node;
    node.mass       = 7850 * area / n;
    node.inertia    = (7850. / n * Vector3(2 * I, I, I)).asDiagonal();
    node.position   = {1. * k / n, 0, 0};
    const Body here = s.add("node " + std::to_string(k), node);
    if (k == 0) {
      s.add("clamp", Fixed{s.marker(here), s.marker(s.ground())});
    } else {
      Beam piece;
      piece.i       = s.marker(here);
      piece.j       = s.marker(last);
      piece.length  = 1. / n;
      piece.E       = young;
      piece.G       = young / 2;
      piece.area    = area;
      piece.Iyy     = piece.Izz = I;
      piece.J       = 0.141 * area * area;
      piece.shear_y = piece.shear_z = 5. / 6 * area;
      s.add("piece " + std::to_string(k), piece);
    }
    last = here;
  }
  RigidBody pan; /* makes the search harder */
  pan.mass     = 7850 * area;
  pan.inertia  = pan.mass * area * Matrix3::Identity();
  pan.position = {1, 0, 0};
  s.add("hook", Fixed{s.marker(s.add("pan", pan)), s.marker(last)});
  load(s, s.marker(last), {0, 3 * young * I, 0});
  s.start().equilibrium = true;
  must(s.setUp());
  const Vector3 r = DataOf(s).bodies[last.id].r;
  MEASURED("chain of beams: tip at %.4f, %.4f in %d corrections", r(0), r(1), (int)DataOf(s).started.equilibrium_iterations);
  EXPECT_NEAR(r(1), 0.6033, 2e-3);
  EXPECT_NEAR(r(0), 1 - 0.2544, 2e-3);
  EXPECT_LE((int)DataOf(s).started.equilibrium_iterations, 40);
}
