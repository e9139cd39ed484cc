/* Flexible bodies on several ranks, connected to each other and to rigid ones across ranks: the same results as on one rank */
#include "hhtdae/scene.h"
#include "modal_cloud.h"
#include "scene/model.h"
#include "scene_output.h"
#include "scene_run.h"

using namespace hhtest;

namespace
{

/* A suspended chain of alternately flexible and rigid links */
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

/* Flexible bodies connected at their attachments, with dampers between them that depend on measured velocities and
   accelerations */
struct Ring {
  Scene scene;

  explicit Ring(MPI_Comm comm) : scene(comm)
  {
    std::vector<Marker> from, to;
    for (int k = 0; k < 4; k++) {
      ModalCloud c(7, 3, 30 + k);
      if (k == 1) c.stiffen(5);
      FlexibleBody b;
      b.model            = std::make_shared<ModalBody>(c.body);
      b.position         = {2. * k, 0.1 * k, 0};
      b.velocity         = {0, 0.2 * k, 0.1};
      b.angular_velocity = {0.3, -0.1 * k, 0.2};
      b.damping          = {{10, 0.02}};
      const Body body    = scene.add("body" + std::to_string(k), b);
      from.push_back(scene.marker(scene.attachment(body, "hub"), {0.1, 0, 0.2}));
      to.push_back(scene.marker(scene.attachment(body, "tip"), {0, 0.1, 0}));
    }
    for (int k = 0; k < 4; k++) {
      const int         next = (k + 1) % 4;
      const std::string name = std::to_string(k);
      Bushing           bush{from[next], to[k], {30, 20, 10}, {3, 2, 4}, {0.5, 0.4, 0.3}, {0.1, 0.05, 0.2}};
      bush.state = k == 2;
      scene.add("bush" + name, bush);
      const Variable v = scene.variable("v" + name, Expression{{Measure::acceleration(to[k], 0, from[next]), Measure::velocity(to[next], 1, to[k], from[k])},
                                                               [](const Real *m) -> Real { return 0.1 * m[0] + m[1]; }});
      if (k % 2) scene.add("pull" + name, UserScalarForce{from[k], to[next], Expression{Measure::value(v)}});
      else scene.add("rod" + name, PointDistance{from[k], to[next]});
      for (int c = 0; c < 3; c++) scene.channel(name + std::string(1, "xyz"[c]), Measure::displacement(to[k], c));
    }
    scene.start().assembly = Assembly::Project;
  }
};

/* Numbers derived from the residual and the matrix that do not depend on the order of the unknowns, at a state that
   does not depend on it either */
Array numbers(MPI_Comm comm)
{
  Ring   ring(comm);
  Vec    x[3], F, y;
  Mat    J;
  double norm, sum;
  Array  all;
  must(ring.scene.setUp());
  const std::unique_ptr<Runtime> R = layOut(ring.scene);
  must(MatCreateVecs(R->J, &x[0], &F));
  for (int k = 1; k < 3; k++) must(VecDuplicate(x[0], &x[k]));
  must(VecDuplicate(F, &y));
  must(InitialState(*R, x[0], x[1]));
  must(VecZeroEntries(x[2]));
  const double by[3] = {0.05, 0.3, 0.7};
  for (int k = 0; k < 3; k++) must(VecShift(x[k], by[k]));
  must(Residual(*R, 0.2, x[0], x[1], x[2], F));
  must(VecNorm(F, NORM_2, &norm));
  all.push_back(norm);
  must(MatDuplicate(R->J, MAT_DO_NOT_COPY_VALUES, &J));
  must(Jacobian(*R, 0.2, x[0], x[1], x[2], 2.7, 13, J));
  must(MatNorm(J, NORM_FROBENIUS, &norm));
  all.push_back(norm);
  must(MatMult(J, F, y));
  must(VecNorm(y, NORM_2, &norm));
  must(VecDot(F, y, &sum));
  all.push_back(norm);
  all.push_back(sum);
  must(MatMultTranspose(J, F, y));
  must(VecNorm(y, NORM_2, &norm));
  all.push_back(norm);
  for (Vec *v : {&x[0], &x[1], &x[2], &F, &y}) must(VecDestroy(v));
  must(MatDestroy(&J));
  return all;
}

Array runRing(MPI_Comm comm)
{
  Ring     ring(comm);
  SceneRun run(ring.scene, 0.3, tolerance(1e-6) + " -ts_hhtdae_corrector_tolerance 1e-8 ");
  Array    x;
  must(run.solve());
  must(ring.scene.sample(run.ts, 0.3, x));
  return x;
}

} // namespace

TEST(FlexibleSceneRanks, MatrixBetweenAttachments)
{
  const Array all = numbers(PETSC_COMM_WORLD), one = numbers(PETSC_COMM_SELF);
  ASSERT_EQ(all.size(), one.size());
  for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(all[k], one[k], 1e-12 * std::abs(one[k])) << "number " << k;
}

TEST(FlexibleSceneRanks, RingOfFlexibleBodies)
{
  const Array all = runRing(PETSC_COMM_WORLD), one = runRing(PETSC_COMM_SELF);
  ASSERT_EQ(all.size(), one.size());
  for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(all[k], one[k], 1e-9) << "channel " << k;
}

TEST(FlexibleSceneRanks, ChainOfLinks)
{
  const Array all = runChain(PETSC_COMM_WORLD), one = runChain(PETSC_COMM_SELF);
  ASSERT_EQ(all.size(), one.size());
  for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(all[k], one[k], 1e-10) << "channel " << k;
}
