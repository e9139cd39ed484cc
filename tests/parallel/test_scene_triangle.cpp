/* One triangle of a scene's matrix on several ranks: its products are those of the whole one, and so is the run on one rank */
#include "box_model.h"
#include "hhtdae/flexible.h"
#include "scene/runtime.h"
#include "scene_output.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

struct Outcome {
  double           product; /* a norm of J x at the start */
  Array            at;      /* the load's place at the end */
  TSHHT3Statistics s;
};

Outcome runBeam(MPI_Comm comm, bool triangle)
{
  const std::string storage = std::string("-scene_symmetric_storage ") + (triangle ? "true " : "false ");
  Options           in(storage);
  FeModel           model(comm);
  BoxBuilder({{6, 2, 2}, {2, 0.3, 0.2}, {2e6, 0.3, 1000}}, &model);
  Scene      scene(comm);
  FullFeBody fe;
  FullBody   b;
  b.law         = FeLaw::Large;
  b.attachments = {{"left"}, {"right", "", Tie::Average}};
  scene.gravity({0, 0, -9.81});
  must(fe.add(scene, "beam", model, b));
  const Marker left = scene.marker(fe.attachment("left")), right = scene.marker(fe.attachment("right"));
  const auto   l = DataOf(scene).frame(left), r = DataOf(scene).frame(right);
  PointMass    load;
  load.mass     = 20;
  load.position = r.x;
  scene.add("hinge", Spherical{left, scene.marker(scene.ground(), l.x)});
  const Marker hung = scene.marker(scene.add("load", load));
  scene.add("pin", Spherical{right, hung});
  for (int k = 0; k < 3; k++) scene.channel(std::string(1, "xyz"[k]), Measure::displacement(hung, k));
  SceneRun run(scene, 0.05, storage + tolerance(1e-6) + " -ts_hhtdae_corrector_tolerance 1e-5 ");
  Outcome  o;
  Vec      U, V, A, x, y;
  Runtime &R = *RunOf(run.ts);
  must(TS2GetSolution(run.ts, &U, &V));
  for (Vec *v : {&A, &x, &y}) must(VecDuplicate(U, v));
  must(VecSet(A, 1));
  must(VecSet(x, 1));
  must(Jacobian(R, 0, U, V, A, 2.7, 13., R.J));
  EXPECT_EQ(R.triangle, triangle);
  must(MatMult(R.J, x, y));
  must(VecNorm(y, NORM_2, &o.product));
  for (Vec *v : {&A, &x, &y}) must(VecDestroy(v));
  must(run.solve());
  must(scene.sample(run.ts, 0.05, o.at));
  must(TSHHT3GetStatistics(run.ts, &o.s));
  return o;
}

} // namespace

TEST(SceneTriangleRanks, TheSameRun)
{
  const Outcome half = runBeam(PETSC_COMM_WORLD, true), full = runBeam(PETSC_COMM_WORLD, false), one = runBeam(PETSC_COMM_SELF, false);
  EXPECT_NEAR(half.product, full.product, 1e-10 * full.product);
  EXPECT_EQ(half.s.steps, full.s.steps);
  EXPECT_EQ(half.s.newton, full.s.newton);
  EXPECT_EQ(half.s.factorizations, full.s.factorizations);
  for (int k = 0; k < 3; k++) {
    EXPECT_NEAR(half.at[k], full.at[k], 1e-10);
    EXPECT_NEAR(half.at[k], one.at[k], 1e-10);
  }
}
