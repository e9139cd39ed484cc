/* Kept nodes and load cases in reductions and in scenes: the same on several ranks as on one */
#include "box_model.h"
#include "hhtdae/flexible.h"
#include "modal_cloud.h"
#include "scene/model.h"
#include "scene_output.h"
#include "scene_run.h"

using namespace hhtest;
using namespace hhtdae;

namespace
{

ReducedBody reduced(MPI_Comm comm)
{
  FeModel    model(comm);
  BoxBuilder builder({{9, 2, 2}, {0.5, 0.08, 0.1}}, &model);
  Reduction  r;
  builder.addSet("top", [](const Vector3 &x) { return x[2] > 0.0999; });
  r.attachments = {Attachment{"left"}, Attachment{"right"}};
  r.node_sets   = {"top", "left"};
  r.nodes       = {40, 5};
  r.loads       = {LoadCase{"pressure", "top"}, LoadCase{"dead", "top", false}, LoadCase{"push", "", true, {3, 81}, {1, 2, 3, -2, 0, 4}}};
  ReducedBody body;
  must(Reduce(model, r, &body));
  return body;
}

double off(const Eigen::MatrixXd &a, const Eigen::MatrixXd &b)
{
  EXPECT_EQ(a.size(), b.size());
  return a.size() && a.size() == b.size() ? (a - b).norm() / (1e-9 + b.norm()) : 0;
}

/* Two flexible bodies and a rigid one connected at kept nodes, with modal loads that depend on each other */
Array shake(MPI_Comm comm)
{
  Scene               scene(comm);
  std::vector<Body>   flex;
  std::vector<Marker> at;
  scene.gravity({0, 1, -9.81});
  scene.groundAcceleration(TimeFunction::harmonic(2, 5), 0, TimeFunction::harmonic(1, 7));
  for (int k = 0; k < 4; k++) {
    ModalCloud   c(9, 3, 40 + k);
    FlexibleBody b;
    c.keepNodes(k);
    b.model    = std::make_shared<ModalBody>(c.body);
    b.position = {3. * k, 0, 0};
    b.damping  = {{10, 0.02}};
    flex.push_back(scene.add(text("body %d", k), b));
    at.push_back(scene.marker(scene.node(flex[k], 13)));
  }
  for (int k = 0; k < 4; k++) {
    const int n = (k + 1) % 4;
    scene.add(text("spring %d", k), SpringDamper{at[k], scene.marker(scene.node(flex[n], 16)), 30, 1});
    ModalLoad load{flex[k], k % 2 ? "dead" : "follows", Expression{{Measure::velocity(at[n], 0), Measure::displacement(at[n], 1, at[k]), Measure::time()}, [](const Real *m) -> Real { return 0.05 * m[0] * m[1] + 0.1 * sin(m[2]); }}};
    load.state = k == 3;
    if (k == 2) load.scale.arguments[0] = Measure::acceleration(at[n], 0);
    scene.add(text("load %d", k), load);
    scene.channel(text("eta %d", k), Measure::modal(flex[k], 1));
    scene.channel(text("x %d", k), Measure::displacement(at[k], 2));
  }
  ContactLaw law;
  law.stiffness = 100;
  law.friction  = 0.2;
  for (int k = 0; k < 3; k++) { /* with the next body and with the ground */
    const Element touch = scene.add(text("touch %d", k), NodeContact{flex[k], {}, 1, k < 2 ? scene.marker(scene.attachment(flex[k + 1], "hub")) : scene.markerAt(scene.ground(), {6, 0, 0}), 1, law});
    scene.channel(text("force %d", k), Measure::force(touch, 0));
  }
  scene.add("ball", Spherical{at[0], scene.markerAt(scene.ground(), DataOf(scene).frame(at[0]).x)});
  SceneRun run(scene, 0.3, tolerance(1e-6) + " -ts_hhtdae_corrector_tolerance 1e-8 ");
  Array    x;
  must(run.solve());
  must(scene.sample(run.ts, 0.3, x));
  return x;
}

} // namespace

TEST(KeptNodesRanks, Reduction)
{
  const ReducedBody a = reduced(PETSC_COMM_WORLD), b = reduced(PETSC_COMM_SELF);
  ASSERT_EQ(a.modal.nodes.size(), b.modal.nodes.size());
  ASSERT_EQ(a.modal.loads.size(), b.modal.loads.size());
  for (std::size_t k = 0; k < b.modal.nodes.size(); k++) {
    const ModalNode &x = a.modal.nodes[k], &y = b.modal.nodes[k];
    EXPECT_EQ(x.label, y.label);
    EXPECT_TRUE(x.turns && y.turns);
    EXPECT_EQ(x.position, y.position);
    EXPECT_LT(off(x.translation, y.translation) + off(x.rotation, y.rotation), 1e-6);
  }
  for (std::size_t k = 0; k < b.modal.loads.size(); k++) {
    const ModalLoadCase &x = a.modal.loads[k], &y = b.modal.loads[k];
    EXPECT_EQ(x.name, y.name);
    EXPECT_LT(off(x.force, y.force) + off(x.moment, y.moment) + off(x.modal, y.modal), 1e-6);
    EXPECT_LT(off(x.moment_gradient, y.moment_gradient) + off(x.force_gradient, y.force_gradient) + off(x.modal_gradient, y.modal_gradient), 1e-6);
  }
}

TEST(KeptNodesRanks, Scene)
{
  const Array all = shake(PETSC_COMM_WORLD), one = shake(PETSC_COMM_SELF);
  ASSERT_EQ(all.size(), one.size());
  for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(all[k], one[k], 1e-9 * (1 + std::abs(one[k]))) << "channel " << k;
}
