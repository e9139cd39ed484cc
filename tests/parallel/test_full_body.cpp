/* A finite-element model in a scene on several ranks: the same as on one. */
#include "box_model.h"
#include "hhtdae/flexible.h"
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

} // namespace

TEST(FullBodyRanks, SameAsOnOne)
{
  for (FeLaw law : {FeLaw::Small, FeLaw::Large}) {
    const Array all = runBeam(PETSC_COMM_WORLD, law), one = runBeam(PETSC_COMM_SELF, law);
    ASSERT_EQ(all.size(), one.size());
    for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(all[k], one[k], 1e-10) << "channel " << k;
    EXPECT_LT(one[2], 0.1 - 1e-4); /* it sags */
  }
}

/* Conjugate gradients behind the constraint preconditioner with its coarse level: the same within what the corrector leaves */
TEST(FullBodyRanks, ByConjugateGradients)
{
  for (FeLaw law : {FeLaw::Small, FeLaw::Large}) {
    const Array one = runBeam(PETSC_COMM_SELF, law);
    const Array all = runBeam(PETSC_COMM_WORLD, law, "-ksp_type cg -pc_type hhtconstraint -pc_hhtconstraint_aggregate 12 ");
    for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(all[k], one[k], 1e-8) << "channel " << k;
  }
}
