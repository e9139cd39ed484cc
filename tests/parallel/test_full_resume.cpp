/* Finite-element bodies solved by conjugate gradients with "hhtconstraint": a resumed run repeats the uninterrupted
   one bit for bit, on any number of ranks */
#include "box_model.h"
#include "hhtdae/flexible.h"
#include "scene/model.h"
#include "scene_output.h"
#include "shared_file.h"

using namespace hhtest;

namespace
{

struct Case {
  Box         box;
  FeLaw       law  = FeLaw::Large;
  bool        free = false; /* spins in free flight; otherwise it hangs on a ball joint with a load at its end */
  std::string options;
};

struct End {
  Array            u, v;
  TSHHT3Statistics s;
  std::string      solver; /* output of -ksp_view */
};

End run(const Case &c, const std::string &options)
{
  const SharedFile view(".view");
  FeModel          model(PETSC_COMM_WORLD);
  BoxBuilder(c.box, &model);
  Scene      scene(PETSC_COMM_WORLD);
  FullFeBody fe;
  FullBody   b;
  b.law = c.law;
  if (c.free) b.angular_velocity = {5, 20, -10};
  else b.attachments = {{"left"}, {"right", "", Tie::Average}};
  scene.gravity({0, 0, -9.81});
  must(fe.add(scene, "beam", model, b));
  if (!c.free) {
    const Marker left = scene.marker(fe.attachment("left")), right = scene.marker(fe.attachment("right"));
    const auto   l = DataOf(scene).frame(left), r = DataOf(scene).frame(right);
    scene.add("hinge", Spherical{left, scene.marker(scene.ground(), l.x)});
    RigidBody load;
    load.position = r.x;
    scene.add("weld", Fixed{right, scene.marker(scene.add("load", load))});
  }
  SceneRun    in(scene, 100, c.options + options);
  End         e;
  Vec         U, V;
  SNES        snes;
  KSP         ksp;
  PetscViewer viewer;
  must(in.solve());
  must(TS2GetSolution(in.ts, &U, &V));
  must(TSHHT3GetStatistics(in.ts, &e.s));
  e.u = whole(U);
  e.v = whole(V);
  must(TSGetSNES(in.ts, &snes));
  must(SNESGetKSP(snes, &ksp));
  must(PetscViewerASCIIOpen(PETSC_COMM_WORLD, view.name.c_str(), &viewer));
  must(KSPView(ksp, viewer));
  must(PetscViewerDestroy(&viewer));
  e.solver = view.text();
  return e;
}

bool has(const End &e, const char *words) { return e.solver.find(words) != std::string::npos; }

/* Stops after each of some steps and resumes; returns the results and the view of the solver at the stops and at the end */
std::vector<End> repeats(const Case &c, int steps, const std::vector<int> &stops)
{
  SCOPED_TRACE(c.options);
  const SharedFile  file(".checkpoint");
  std::vector<End>  at;
  const auto        until = [](int n) { return " -ts_max_steps " + std::to_string(n) + " "; };
  const std::string every = " -ts_hhtdae_checkpoint " + file.name + " -ts_hhtdae_checkpoint_every ";
  const End         plain = run(c, until(steps));
  for (int stop : stops) {
    SCOPED_TRACE(stop);
    at.push_back(run(c, until(stop) + every + std::to_string(stop)));
    const Printed said;
    const End     resumed = run(c, until(steps) + "-ts_hhtdae_resume " + file.name);
    EXPECT_FALSE(said.says("other options")) << said.text();
    EXPECT_TRUE(plain.u == resumed.u);
    EXPECT_TRUE(plain.v == resumed.v);
    EXPECT_EQ(plain.s.newton, resumed.s.newton);
    EXPECT_EQ(plain.s.factorizations, resumed.s.factorizations);
    EXPECT_GT(resumed.s.steps, stop);
  }
  at.push_back(plain);
  return at;
}

const std::string cg = " -ksp_type cg -pc_type hhtconstraint -pc_hhtconstraint_aggregate 12 ", fgmres = " -ksp_type fgmres -pc_type hhtconstraint -pc_hhtconstraint_aggregate 12 ";
const Box         beam{{8, 3, 2}, {2, 0.6, 0.3}, {2e6, 0.3, 1000}};

} // namespace

TEST(FullBodyResume, ByConjugateGradients)
{
  repeats({beam, FeLaw::Large, false, tolerance(1e-4) + cg}, 20, {1, 12});
}

/* With a checkpoint after every step */
TEST(FullBodyResume, WritingChangesNothing)
{
  const SharedFile  file(".checkpoint");
  const Case        c{beam, FeLaw::Large, false, tolerance(1e-4) + cg + "-ts_max_steps 12 "};
  const End         plain = run(c, ""), writing = run(c, "-ts_hhtdae_checkpoint " + file.name + " -ts_hhtdae_checkpoint_every 1 ");
  EXPECT_TRUE(plain.u == writing.u);
  EXPECT_TRUE(plain.v == writing.v);
  EXPECT_EQ(plain.s.newton, writing.s.newton);
}

TEST(FullBodyResume, ByMinimalResiduals)
{
  repeats({beam, FeLaw::Large, false, tolerance(1e-4) + fgmres}, 16, {9});
}

/* Without a coarse level the multipliers and their nodes are factored by the fine level */
TEST(FullBodyResume, WithoutACoarseLevel)
{
  repeats({beam, FeLaw::Large, false, tolerance(1e-4) + cg + "-pc_hhtconstraint_aggregate 0 "}, 16, {9});
}

/* A body that has rotated: with its positions at the stop the nodes would be aggregated differently */
TEST(FullBodyResume, AfterTurns)
{
  repeats({beam, FeLaw::Large, true, tolerance(1e-4) + cg + "-ts_adapt_type none -ts_dt 0.01 "}, 16, {10});
}

/* The rounding of products in single precision was part of the error of a solve, so that products changed to double
   precision; after the stop they are in double precision as well */
TEST(FullBodyResume, AfterProductsHaveFallenBack)
{
  const Box              stiff{{8, 3, 2}, {2, 0.6, 0.3}, {2e11, 0.3, 1000}};
  const std::vector<End> at = repeats({stiff, FeLaw::Large, false, tolerance(1e-4) + cg + "-ksp_rtol 1e-4 -ts_adapt_type none -ts_dt 0.01 "}, 12, {6});
  for (const End &e : at) EXPECT_TRUE(has(e, "products in double precision")) << e.solver;
}

namespace
{

/* No memory for the factorization of a thick body */
const Case block{{{9, 9, 9}, {1, 1, 1}, {2e6, 0.3, 1000}}, FeLaw::Small, false, tolerance(1e-4)};

} // namespace

TEST(FullBodyResume, ChosenForWantOfRoom)
{
  Case c = block;
  c.options += "-mat_mumps_memory 1 ";
  for (const End &e : repeats(c, 6, {3})) EXPECT_TRUE(has(e, "hhtconstraint")) << e.solver;
}

namespace
{

/* So large that conjugate gradients are the default, on one rank; on several ranks the matrix is too small for that,
   and the factorization would be one of MUMPS, which repeats runs only to rounding */
Case large(const std::string &options)
{
  Case c;
  c.box     = {{20, 20, 20}, {1, 1, 1}, {2e6, 0.3, 1000}};
  c.free    = true;
  c.law     = FeLaw::Small;
  c.options = tolerance(1e-4) + "-ts_adapt_type none " + options;
  return c;
}

bool several()
{
  int size;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  return size > 1;
}

} // namespace

TEST(FullBodyResume, ChosenByDefault)
{
  if (several()) GTEST_SKIP();
  for (const End &e : repeats(large("-ts_dt 0.001 "), 4, {2})) EXPECT_TRUE(has(e, "hhtconstraint")) << e.solver;
}

/* Conjugate gradients with many iterations are replaced by a factorization, which at the first stop has been chosen
   but not yet made */
TEST(FullBodyResume, AfterAFactorHasTakenTheirPlace)
{
  if (several()) GTEST_SKIP();
  const std::vector<End> at = repeats(large("-ts_dt 0.05 -ksp_rtol 1e-8 -pc_hhtconstraint_aggregate 0 "), 3, {1, 2});
  for (const End &e : at) EXPECT_FALSE(has(e, "hhtconstraint")) << e.solver;
  EXPECT_TRUE(has(at[0], "has not been set up")) << at[0].solver;
}
