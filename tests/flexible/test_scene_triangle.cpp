/* One triangle of a scene's matrix: the same as of the whole one, the same run, and refusals that name what breaks the symmetry */
#include "box_model.h"
#include "hhtdae/flexible.h"
#include "scene/extension.h"
#include "scene_jacobian.h"
#include "scene_output.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

/* A beam of bricks held at one end, with a point mass on a spring at the other */
struct BeamScene {
  FeModel    model{PETSC_COMM_WORLD};
  Scene      scene{PETSC_COMM_WORLD};
  FullFeBody fe;

  BeamScene(FeLaw law, double skew = 0)
  {
    BoxBuilder({{4, 2, 1}, {2, 0.3, 0.2}, {2e6, 0.3, 1000}}, &model);
    if (skew != 0) {
      must(MatSetValue(model.K, 0, 1, skew, ADD_VALUES));
      must(MatAssemblyBegin(model.K, MAT_FINAL_ASSEMBLY));
      must(MatAssemblyEnd(model.K, MAT_FINAL_ASSEMBLY));
    }
    FullBody b;
    b.law          = law;
    b.mass_damping = 0.2;
    b.attachments  = {{"left"}, {"right", "", Tie::Average}};
    scene.gravity({0.3, 0, -9.81});
    must(fe.add(scene, "beam", model, b));
    const Marker left = scene.marker(fe.attachment("left")), right = scene.marker(fe.attachment("right"));
    const auto   l = DataOf(scene).frame(left), r = DataOf(scene).frame(right);
    scene.add("clamp", Fixed{left, scene.marker(scene.ground(), l.x, l.R)});
    PointMass load;
    load.mass     = 3;
    load.position = r.x + Vector3(0.1, 0.2, -1);
    scene.add("spring", SpringDamper{right, scene.marker(scene.add("load", load)), 200, 0, 1});
  }
};

/* Bodies and a point mass in a plane, a loop of joints */
struct FlatScene {
  Scene scene{PETSC_COMM_WORLD, Space::Planar};

  FlatScene()
  {
    RigidBody a, b;
    PointMass p;
    a.mass = 2;
    a.inertia = Vector3(1, 1, 0.3).asDiagonal();
    a.position = {1, 0, 0};
    b          = a;
    b.position = {3, 0, 0};
    p.mass     = 1;
    p.position = {4, 1, 0};
    const Body one = scene.add("a", a), two = scene.add("b", b), three = scene.add("p", p);
    scene.gravity({0, -9.81, 0});
    scene.add("hinge", Revolute{scene.marker(one, {-1, 0, 0}), scene.marker(scene.ground())});
    scene.add("knee", Revolute{scene.marker(one, {1, 0, 0}), scene.marker(two, {-1, 0, 0})});
    scene.add("rod", PointDistance{scene.marker(two, {1, 0, 0}), scene.marker(three)});
    scene.add("spring", SpringDamper{scene.marker(three), scene.marker(scene.ground(), {4, 3, 0}), 50, 0, 1.5});
  }
};

/* J x of any state, by all of the matrix and by one triangle */
template <class S, class... Args> void compareProducts(unsigned seed, Args... args)
{
  Array y[2];
  for (int half = 0; half < 2; half++) {
    Options in(half ? "-scene_symmetric_storage true" : "-scene_symmetric_storage false");
    S       s(args...);
    must(s.scene.setUp());
    AnyState state(s.scene, seed, 0.05);
    Vec      x;
    must(VecDuplicate(state.U, &x));
    must(VecSet(x, 0));
    for (PetscInt i = 0; i < state.R.n; i++) AnyState::add(x, i, std::sin(1. + 7 * i));
    must(Jacobian(state.R, 0, state.U, state.V, state.A, 2.7, 13., state.R.J));
    must(MatMult(state.R.J, x, state.F));
    y[half] = whole(state.F);
    PetscBool sbaij;
    must(PetscObjectTypeCompare((PetscObject)state.R.J, MATSEQSBAIJ, &sbaij));
    EXPECT_EQ((bool)sbaij, half == 1);
    must(VecDestroy(&x));
  }
  EXPECT_LT(relativeDifference(y[0], y[1]), 1e-13);
}

template <class S, class... Args> void compareRuns(const std::string &options, double end, Args... args)
{
  Array            u[2];
  TSHHT3Statistics s[2];
  for (int half = 0; half < 2; half++) {
    Options  in(half ? "-mat_type sbaij " : "-mat_type aij ");
    S        scene(args...);
    SceneRun run(scene.scene, end, options + (half ? "-mat_type sbaij " : "-mat_type aij "));
    must(run.solve());
    Vec U;
    must(TSGetSolution(run.ts, &U));
    u[half] = whole(U);
    must(TSHHT3GetStatistics(run.ts, &s[half]));
  }
  EXPECT_EQ(s[0].steps, s[1].steps);
  EXPECT_EQ(s[0].newton, s[1].newton);
  EXPECT_EQ(s[0].jacobians, s[1].jacobians);
  EXPECT_EQ(s[0].factorizations, s[1].factorizations);
  EXPECT_GT(s[0].steps, 1);
  EXPECT_LT(relativeDifference(u[0], u[1]), 1e-8);
}

void expectRefused(const std::function<void(Scene &)> &add, const std::string &who)
{
  Options in("-scene_symmetric_storage true");
  Scene   scene(PETSC_COMM_WORLD);
  PointMass p;
  p.mass     = 1;
  p.position = {1, 0, 0};
  scene.add("spring", SpringDamper{scene.marker(scene.add("p", p)), scene.marker(scene.ground()), 10, 0, 1});
  add(scene);
  ErrorTrap trap;
  EXPECT_NE(scene.setUp(), 0);
  EXPECT_TRUE(trap.says(who)) << trap.message;
}

} // namespace

TEST(SceneTriangle, TheSameMatrix)
{
  for (unsigned seed : {1, 2}) {
    compareProducts<BeamScene>(seed, FeLaw::Large);
    compareProducts<BeamScene>(seed, FeLaw::Small);
    compareProducts<FlatScene>(seed);
  }
}

TEST(SceneTriangle, TheSameRun)
{
  compareRuns<BeamScene>(tolerance(1e-5), 0.05, FeLaw::Large);
  compareRuns<FlatScene>(tolerance(1e-5), 0.5);
  compareRuns<BeamScene>(tolerance(1e-5) + "-scene_equilibrium ", 0.05, FeLaw::Large);
}

/* Kinds do not show it: K of a file may be anything */
TEST(SceneTriangle, AnUnsymmetricStiffnessIsNotHalved)
{
  Options   in("-scene_symmetric_storage true");
  BeamScene good(FeLaw::Small), skew(FeLaw::Small, 1);
  TS        ts;
  must(good.scene.createTS(&ts));
  must(TSDestroy(&ts));
  ErrorTrap trap;
  EXPECT_NE(skew.scene.createTS(&ts), 0);
  EXPECT_TRUE(trap.says("unsymmetric by")) << trap.message;
}

TEST(SceneTriangle, WhatBreaksTheSymmetryIsNamed)
{
  expectRefused([](Scene &s) {
    RigidBody b;
    b.mass    = 1;
    b.inertia = Matrix3::Identity();
    s.add("rotor", b);
  }, "body rotor");
  expectRefused([](Scene &s) {
    PointMass p;
    p.mass     = 1;
    p.position = {3, 0, 0};
    s.add("damper", SpringDamper{s.marker(s.add("q", p)), s.marker(s.ground()), 10, 5, 1});
  }, "damper");
  expectRefused([](Scene &s) { s.state("filter", Expression{{}, [](const Real *) -> Real { return Real(1.); }}, 0); }, "state filter");
}
