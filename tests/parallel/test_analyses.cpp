/* User constraints, stops and analyses between bodies of several ranks give the results of one rank */
#include "hhtdae/analyses.h"
#include "hhtdae/query.h"
#include "scene_output.h"
#include <cmath>

using namespace hhtest;

namespace
{

/* A chain in which the tips 2 and 7 depend on each other and on time, and tip 9 rises twice as fast as tip 0; with a
   stop and a rope */
struct Chain : Rods {
  Element circle, rope, stop;

  explicit Chain(MPI_Comm comm) : Rods(10, comm)
  {
    circle = scene.add("circle", UserConstraint{{Expression{{Measure::displacement(tip[2], 1), Measure::displacement(tip[7], 1), Measure::displacement(tip[7], 0), Measure::time()},
                                                            [](const Real *m) { return m[1] - 0.5 * m[0] - 0.01 * (m[2] * m[2] - 64) + 0.05 * sin(m[3]); }}}});
    for (int i = 0; i < 10; i++) scene.add("", TorsionalSpringDamper{centre[i], i ? centre[i - 1] : scene.marker(scene.ground()), 300. + 10 * i, 5, 0});
    DistanceStop d{tip[9], tip[0]};
    d.upper = 9.0005;
    d.law   = {1e4, 1};
    rope    = scene.add("rope", d);
    RotationalStop r{centre[1], centre[0]};
    r.lower = -0.02;
    r.upper = 0.5;
    r.law   = {1e4, 1.5, 0.1};
    stop    = scene.add("stop", r);
  }
  void ask(TS ts, std::vector<double> &all)
  {
    Snapshot now;
    Motion   m;
    Load     l;
    must(now.take(ts));
    for (int k : {2, 7, 9}) {
      must(now.motion(tip[k], &m));
      all.insert(all.end(), {m.position(0), m.position(1), m.velocity(0), m.velocity(1), m.acceleration(1)});
    }
    for (Element e : {circle, rope, stop}) {
      must(now.load(e, e.id == rope.id ? tip[9] : e.id == stop.id ? centre[1] : tip[7], &l));
      all.insert(all.end(), {l.force(0), l.force(1), l.moment(2)});
    }
  }
};

std::vector<double> answers(MPI_Comm comm)
{
  std::vector<double> all;
  TS                  ts;
  Chain               still(comm);
  still.scene.start().assembly = Assembly::Project;
  must(still.scene.createTS(&ts));
  must(StaticEquilibrium(ts, 1));
  still.ask(ts, all);
  must(AssembleAt(ts, 1.5));
  still.ask(ts, all);
  must(TSDestroy(&ts));
  Chain moving(comm);
  moving.scene.add("fast", UserConstraint{{Expression{{Measure::velocity(moving.tip[9], 1), Measure::velocity(moving.tip[0], 1)}, [](const Real *m) { return m[0] - 2 * m[1]; }}}});
  moving.scene.start().assembly = Assembly::Project;
  SceneRun run(moving.scene, 0.2, tolerance(1e-8) + " -ts_adapt_type none -ts_dt 1e-3 ");
  must(run.solve());
  moving.ask(run.ts, all);
  return all;
}

} // namespace

TEST(AnalysesRanks, TheSameAnswers)
{
  const auto one = answers(PETSC_COMM_SELF), all = answers(PETSC_COMM_WORLD);
  ASSERT_EQ(one.size(), all.size());
  for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(one[k], all[k], 1e-6 * std::max(1., std::abs(one[k]))) << k;
}

/* Forty rods of 1/40 m with a total mass of 2 kg, pulled along x by 30 N: in equilibrium the slope of rod k is the
   weight from it to the end over the pull */
TEST(AnalysesRanks, HangingChain)
{
  const int    n = 40;
  const double length = 1. / n, mass = 2. / n;
  Scene        scene(PETSC_COMM_WORLD);
  Marker       last = scene.marker(scene.ground());
  TS           ts;
  Snapshot     now;
  Motion       end;
  double       exact = 0;
  scene.gravity({0, -9.81, 0});
  for (int k = 0; k < n; k++) {
    RigidBody b;
    b.mass          = mass;
    b.inertia       = Vector3(mass * 0.005 * 0.005 / 2, mass * length * length / 12, mass * length * length / 12).asDiagonal();
    b.position      = {(k + 0.5) * length, 0, 0};
    const Body rod  = scene.add("rod" + std::to_string(k), b);
    scene.add("pin" + std::to_string(k), Revolute{scene.marker(rod, {-length / 2, 0, 0}), last});
    last                = scene.marker(rod, {length / 2, 0, 0});
    const double weight = mass * 9.81 * (n - k - 0.5);
    exact -= length * weight / std::hypot(weight, 30);
  }
  UserForce pull;
  pull.i     = last;
  const Expression none{{}, [](const Real *) -> Real { return 0; }};
  pull.force = {Expression{{}, [](const Real *) -> Real { return 30; }}, none, none};
  scene.add("pull", pull);
  must(scene.createTS(&ts));
  must(StaticEquilibrium(ts, 0));
  must(now.take(ts));
  must(now.motion(last, &end));
  EXPECT_NEAR(end.position(1), exact, 1e-8);
  must(TSDestroy(&ts));
}
