/* Snapshots of a run give the same answers on all ranks as on one */
#include "hhtdae/query.h"
#include "scene_output.h"

using namespace hhtest;

namespace
{

std::vector<double> answers(MPI_Comm comm)
{
  Rods                rods(6, comm);
  std::vector<double> all;
  const Element       spring = rods.scene.add("spring", SpringDamper{rods.tip[5], rods.centre[0], 30});
  const Variable      v      = rods.scene.variable("v", Measure::jointForce(rods.pin[3], 1));
  SceneRun            run(rods.scene, 0.5, tolerance(1e-9) + " -ts_adapt_type none -ts_dt 2e-3 "); /* fixed steps, so that both runs have the same */
  Snapshot            now;
  must(run.solve());
  must(now.take(run.ts, 0.5));
  for (int k = 0; k < 6; k++) {
    Motion m, r;
    Load   l;
    double x[4];
    must(now.motion(rods.tip[k], &m, rods.centre[(k + 3) % 6]));
    must(now.relativeMotion(rods.tip[k], rods.centre[(k + 2) % 6], &r));
    must(now.load(rods.pin[k], rods.centre[k], &l, rods.centre[(k + 4) % 6]));
    must(now.value(Measure::acceleration(rods.tip[k], 1), &x[0]));
    must(now.value(Measure::multiplier(rods.pin[k], 0), &x[1]));
    must(now.value(Measure::value(v), &x[2]));
    must(now.value(Measure::elementForce(spring, rods.centre[0], 1), &x[3]));
    for (const Vector3 &y : {m.position, m.velocity, m.acceleration, m.angular_velocity, r.position, r.velocity, r.acceleration, l.force, l.moment})
      all.insert(all.end(), y.data(), y.data() + 3);
    all.insert(all.end(), x, x + 4);
  }
  double e[2];
  must(now.energy(&e[0], &e[1]));
  all.insert(all.end(), e, e + 2);
  return all;
}

} // namespace

TEST(QueryRanks, TheSameAnswers)
{
  const auto one = answers(PETSC_COMM_SELF), all = answers(PETSC_COMM_WORLD);
  ASSERT_EQ(one.size(), all.size());
  for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(one[k], all[k], 1e-6 * std::max(1., std::abs(one[k]))) << k;
}

/* Several runs side by side, with a parameter changed between them */
TEST(QueryRanks, RunsSideBySide)
{
  Scene           scene(PETSC_COMM_WORLD);
  const Parameter mass = scene.parameter("mass", 1);
  Marker          last = scene.marker(scene.ground());
  for (int k = 0; k < 5; k++) {
    const Body b = scene.add("", [=] {
      RigidBody r;
      r.mass     = mass;
      r.position = {k + 0.5, 0, 0};
      return r;
    });
    scene.add("", Spherical{scene.marker(b, {-0.5, 0, 0}), last});
    last = scene.marker(b, {0.5, 0, 0});
  }
  scene.gravity({0, -9.81, 0});
  SceneRun light(scene, 0.3, tolerance(1e-7));
  must(scene.set("mass", 3));
  SceneRun heavy(scene, 0.3, tolerance(1e-7)), again(scene, 0.3, tolerance(1e-7));
  for (double t : {0.1, 0.2, 0.3})
    for (SceneRun *run : {&light, &heavy, &again}) {
      must(TSSetMaxTime(run->ts, t));
      must(run->solve());
    }
  Snapshot now;
  Motion   x[3];
  int      k = 0;
  for (SceneRun *run : {&light, &heavy, &again}) {
    must(now.take(run->ts));
    must(now.motion(last, &x[k++]));
  }
  EXPECT_EQ(x[1].position, x[2].position);
  EXPECT_GT((x[0].position - x[1].position).norm(), 1e-3);
}

/* One constraint whose rows hold bodies of different ranks against a gravity of 3 m/s^2 */
TEST(QueryRanks, LoadsOfRowsOnDifferentBodies)
{
  Scene               scene(PETSC_COMM_WORLD, Space::Planar);
  std::vector<Marker> at;
  UserConstraint      rows;
  for (int k = 0; k < 6; k++) {
    RigidBody b;
    b.mass     = k + 1;
    b.position = {0, k + 1., 0};
    at.push_back(scene.marker(scene.add("", b)));
    rows.rows.push_back({{Measure::displacement(at[k], 0)}, [](const Real *m) { return m[0]; }});
  }
  const Element hold = scene.add("hold", rows);
  scene.gravity({3, 0, 0});
  SceneRun run(scene, 0.1, tolerance(1e-6));
  Snapshot now;
  must(run.solve());
  must(now.take(run.ts));
  for (int k = 0; k < 6; k++) {
    Load l;
    must(now.load(hold, at[k], &l));
    EXPECT_NEAR(l.force(0), -3 * (k + 1), 1e-8) << k;
  }
}
