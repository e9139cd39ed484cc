/* Flexible bodies on several ranks: joined with each other and with rigid ones across ranks, the same as on one. */
#include "hhtdae/scene.h"
#include "modal_cloud.h"
#include "scene/model.h"
#include "scene_output.h"

using namespace hhtest;

namespace
{

/* A hanging chain of flexible and rigid links in turn */
Array runChain(MPI_Comm comm)
{
  Scene scene(comm);
  scene.gravity({0, 1, -9.81});
  Marker  last = scene.marker(scene.ground());
  Vector3 at   = Vector3::Zero();
  for (int k = 0; k < 6; k++) {
    const std::string name = "link" + std::to_string(k);
    Marker            from, to;
    if (k % 2 == 0) {
      ModalCloud c(7, 3, 10 + k);
      if (k % 4 == 0) c.stiffen(k + 1);
      FlexibleBody     b;
      b.model    = std::make_shared<ModalBody>(c.body);
      b.position = at - c.X[0];
      b.damping  = {{10, 0.02}};
      const Body body = scene.add(name, b);
      from = scene.marker(scene.attachment(body, "hub"));
      to   = scene.marker(scene.attachment(body, "tip"));
      scene.channel(name, Measure::modal(body, 1));
    } else {
      RigidBody b;
      b.position      = at + Vector3(0, 0, -0.5);
      const Body body = scene.add(name, b);
      from = scene.marker(body, {0, 0, 0.5});
      to   = scene.marker(body, {0, 0, -0.5});
    }
    scene.add("joint" + std::to_string(k), Spherical{from, last});
    at   = DataOf(scene).frame(to).x;
    last = to;
  }
  for (int k = 0; k < 3; k++) scene.channel(std::string(1, "xyz"[k]), Measure::displacement(last, k));
  SceneRun run(scene, 0.5, tolerance(1e-6) + " -ts_hhtdae_corrector_tolerance 1e-8 ");
  Array    x;
  must(run.solve());
  must(scene.sample(run.ts, 0.5, x));
  return x;
}

} // namespace

TEST(FlexibleSceneRanks, ChainOfLinks)
{
  const Array all = runChain(PETSC_COMM_WORLD), one = runChain(PETSC_COMM_SELF);
  ASSERT_EQ(all.size(), one.size());
  for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(all[k], one[k], 1e-10) << "channel " << k;
}
