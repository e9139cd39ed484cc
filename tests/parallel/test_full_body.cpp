/* A whole finite-element model in a scene on several ranks: the same results as on one rank */
#include "box_model.h"
#include "hhtdae/flexible.h"
#include "hhtdae/linearize.h"
#include "hhtdae/modes.h"
#include "scene/model.h"
#include "scene_output.h"

using namespace hhtest;

namespace
{

Array runBeam(MPI_Comm comm, FeLaw law, const std::string &options = "")
{
  FeModel model(comm);
  BoxBuilder({{6, 2, 2}, {2, 0.3, 0.2}, {2e6, 0.3, 1000}}, &model);
  Scene      scene(comm);
  FullFeBody fe;
  FullBody   b;
  b.law         = law;
  b.attachments = {{"left"}, {"right", "", Tie::Average}};
  scene.gravity({0, 0, -9.81});
  must(fe.add(scene, "beam", model, b));
  const Marker left = scene.marker(fe.attachment("left")), right = scene.marker(fe.attachment("right"));
  const auto   l = DataOf(scene).frame(left), r = DataOf(scene).frame(right);
  if (law == FeLaw::Large) scene.add("hinge", Spherical{left, scene.marker(scene.ground(), l.x)});
  else scene.add("clamp", Fixed{left, scene.marker(scene.ground(), l.x, l.R)});
  RigidBody load;
  load.mass     = 20;
  load.position = r.x;
  scene.add("weld", Fixed{right, scene.marker(scene.add("load", load))});
  for (int k = 0; k < 3; k++) scene.channel(std::string(1, "xyz"[k]), Measure::displacement(right, k));
  SceneRun run(scene, 0.05, tolerance(1e-6) + " -ts_hhtdae_corrector_tolerance 1e-5 " + options);
  Array    x;
  must(run.solve());
  must(scene.sample(run.ts, 0.05, x));
  return x;
}

/* A beam with a load at its tip, held by a clamp or a hinge: displacement of the tip, force of the joint, motion of
   the held attachment */
Array runHeld(MPI_Comm comm, bool clamp, double young, const std::string &options, PetscReal *null_pivot)
{
  const double end = 0.05 * std::sqrt(2e6 / young);
  FeModel      model(comm);
  BoxBuilder({{6, 2, 2}, {2, 0.3, 0.2}, {young, 0.3, 1000}}, &model);
  Scene      scene(comm);
  FullFeBody fe;
  FullBody   b;
  b.attachments = {{"left"}, {"right", "", Tie::Average}};
  scene.gravity({0, 0, -9.81 * young / 2e6});
  must(fe.add(scene, "beam", model, b));
  const Marker  left = scene.marker(fe.attachment("left")), right = scene.marker(fe.attachment("right"));
  const auto    l = DataOf(scene).frame(left), r = DataOf(scene).frame(right);
  const Marker  ground = scene.marker(scene.ground(), l.x, l.R);
  const Element joint  = clamp ? scene.add("joint", Fixed{left, ground}) : scene.add("joint", Revolute{left, ground});
  RigidBody     load;
  load.mass     = 20;
  load.position = r.x;
  scene.add("weld", Fixed{right, scene.marker(scene.add("load", load))});
  for (int k = 0; k < 3; k++) scene.channel(std::string("tip") + "xyz"[k], Measure::displacement(right, k));
  for (int k = 0; k < 3; k++) scene.channel(std::string("force") + "xyz"[k], Measure::jointForce(joint, k));
  for (int k = 0; k < 3; k++) scene.channel(std::string("held") + "xyz"[k], Measure::displacement(left, k, ground));
  SceneRun run(scene, end, tolerance(1e-6) + " -ts_hhtdae_corrector_tolerance 1e-5 " + options);
  Array    x;
  SNES     snes;
  KSP      ksp;
  PC       pc;
  Mat      F;
  must(run.solve());
  must(scene.sample(run.ts, end, x));
  must(TSGetSNES(run.ts, &snes));
  must(SNESGetKSP(snes, &ksp));
  must(KSPGetPC(ksp, &pc));
  must(PCFactorGetMatrix(pc, &F));
  must(MatMumpsGetCntl(F, 3, null_pivot));
  return x;
}

} // namespace

/* Pivots that change their places need more memory than MUMPS has estimated: with PETSc's interface this ends with
   INFOG(1)=-9 on two ranks */
TEST(FullBodyRanks, SlowestModes)
{
  std::vector<Mode> modes[2];
  for (int k = 0; k < 2; k++) {
    const MPI_Comm comm = k ? PETSC_COMM_WORLD : PETSC_COMM_SELF;
    FeModel        model(comm);
    BoxBuilder({{6, 2, 2}, {1, 0.04, 0.02}, {2e9, 0.3, 1000}, [](int, int, int) { return true; }, [](Vector3 x) { return Vector3(x - Vector3(0, 0.02, 0.01)); }}, &model);
    Scene      scene(comm);
    FullFeBody fe;
    FullBody   b;
    b.law         = FeLaw::Small;
    b.attachments = {{"left"}, {"right"}};
    must(fe.add(scene, "beam", model, b));
    scene.add("clamp", Fixed{scene.marker(fe.attachment("left")), scene.marker(scene.ground())});
    SceneRun      run(scene, 1, "");
    Linearization small;
    must(small.take(run.ts));
    must(SlowestModes(small, 6, &modes[k]));
    ASSERT_EQ(modes[k].size(), 6u);
  }
  for (int i = 0; i < 6; i++) EXPECT_NEAR(modes[1][i].frequency(), modes[0][i].frequency(), 1e-6 * modes[0][i].frequency());
}

/* The model was read on other ranks than the scene's. Nodes were once looked up at positions of other ranks, which
   gave random positions or a scene reported as singular */
TEST(FullBodyRanks, ModelOfOtherRanksThanTheScene)
{
  PetscMPIInt size;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  if (size == 1) GTEST_SKIP() << "the same ranks";
  for (int k = 0; k < 2; k++) {
    FeModel model(k ? PETSC_COMM_WORLD : PETSC_COMM_SELF);
    BoxBuilder({{2, 1, 1}, {1, 1, 1}, {2e6, 0.3, 1000}}, &model);
    Scene      scene(k ? PETSC_COMM_SELF : PETSC_COMM_WORLD);
    FullFeBody fe;
    ErrorTrap  trap;
    EXPECT_NE(fe.add(scene, "block", model, {}), 0);
    EXPECT_TRUE(trap.says("finite-element body block: its FE model is distributed over other ranks than the scene")) << trap.message;
    EXPECT_TRUE(DataOf(scene).bodies.empty());
  }
}

TEST(FullBodyRanks, SameAsOnOne)
{
  for (FeLaw law : {FeLaw::Small, FeLaw::Large}) {
    const Array all = runBeam(PETSC_COMM_WORLD, law), one = runBeam(PETSC_COMM_SELF, law);
    ASSERT_EQ(all.size(), one.size());
    for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(all[k], one[k], 1e-10) << "channel " << k;
    EXPECT_LT(one[2], 0.1 - 1e-4); /* it bends */
  }
}

/* Conjugate gradients with the constraint preconditioner and its coarse level: the same results up to the corrector's
   tolerance */
TEST(FullBodyRanks, ByConjugateGradients)
{
  for (FeLaw law : {FeLaw::Small, FeLaw::Large}) {
    const Array one = runBeam(PETSC_COMM_SELF, law);
    const Array all = runBeam(PETSC_COMM_WORLD, law, "-ksp_type cg -pc_type hhtconstraint -pc_hhtconstraint_aggregate 12 ");
    for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(all[k], one[k], 1e-8) << "channel " << k;
  }
}

/* Without memory for the factorization of a thick body, by default that of MUMPS, conjugate gradients are used, unless
   the user requests a factorization */
TEST(FullBodyRanks, WithoutRoomForAFactor)
{
  const auto runBlock = [](const std::string &options, bool iterative) {
    FeModel model(PETSC_COMM_WORLD);
    BoxBuilder({{9, 9, 9}, {1, 1, 1}, {2e6, 0.3, 1000}}, &model);
    Scene      scene(PETSC_COMM_WORLD);
    FullFeBody fe;
    FullBody   b;
    b.law         = FeLaw::Small;
    b.attachments = {{"left"}, {"right", "", Tie::Average}};
    scene.gravity({0, 0, -9.81});
    must(fe.add(scene, "block", model, b));
    const Marker left = scene.marker(fe.attachment("left")), right = scene.marker(fe.attachment("right"));
    const auto   l = DataOf(scene).frame(left);
    scene.add("clamp", Fixed{left, scene.marker(scene.ground(), l.x, l.R)});
    scene.channel("z", Measure::displacement(right, 2));
    SceneRun  run(scene, 0.01, tolerance(1e-6) + " -ts_hhtdae_corrector_tolerance 1e-5 " + options);
    SNES      snes;
    KSP       ksp;
    PC        pc;
    PetscBool constraint;
    Array     x;
    must(run.solve());
    must(scene.sample(run.ts, 0.01, x));
    must(TSGetSNES(run.ts, &snes));
    must(SNESGetKSP(snes, &ksp));
    must(KSPGetPC(ksp, &pc));
    must(PetscObjectTypeCompare((PetscObject)pc, "hhtconstraint", &constraint));
    EXPECT_EQ((bool)constraint, iterative);
    return x[0];
  };
  const double factored = runBlock("", false), without = runBlock("-mat_mumps_memory 1 ", true);
  EXPECT_LT(factored, 0.5 - 1e-4); /* it bends */
  EXPECT_NEAR(without, factored, 1e-8);
  ErrorTrap trap;
  EXPECT_ANY_THROW(runBlock("-mat_mumps_memory 1 -pc_type cholesky -pc_factor_mat_solver_type mumpsnd ", false));
  EXPECT_TRUE(trap.says("not enough memory")) << trap.message;
}

/* Factorizations in single precision: constraints are satisfied to a tenth of the corrector's tolerance of 1e-11 m
   (the rest depends on the order in which MUMPS' messages arrive: up to 4e-14 m was seen), and reactions differ by
   what the corrector leaves of them */
TEST(FullBodyRanks, InSinglePrecision)
{
  const std::string package = "-pc_factor_mat_solver_type ";
  for (bool clamp : {true, false})
    for (double young : {2e6, 2e11}) {
      PetscReal   in_double, in_single; /* these statistics tell which of the two was in use at the end */
      const Array d = runHeld(PETSC_COMM_SELF, clamp, young, package + "mumpsnd ", &in_double), s = runHeld(PETSC_COMM_WORLD, clamp, young, package + "mumpsmixed ", &in_single);
      EXPECT_LT(in_double, 1e-12);
      EXPECT_GT(in_single, 1e-8) << "it has fallen back";
      const double force = std::abs(d[5]);
      MEASURED("held %.1e %.1e tip %.1e force %.1e of %g", std::abs(d[8]), std::abs(s[8]), std::abs(d[2] - s[2]), std::abs(d[5] - s[5]), force);
      for (int k = 0; k < 3; k++) {
        EXPECT_NEAR(s[k], d[k], 1e-8) << k;
        EXPECT_NEAR(s[3 + k], d[3 + k], 1e-6 * force) << k;
        EXPECT_LT(std::abs(s[6 + k]), 1e-12) << k;
      }
      EXPECT_GT(force, 100);
    }
}
