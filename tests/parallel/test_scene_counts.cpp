/* What a run records from step to step, on all ranks together: angles that snapshots ask for, dropped rows */
#include "hhtdae/analyses.h"
#include "hhtdae/query.h"
#include "scene_output.h"
#include "scene_start.h"
#include <cmath>

using namespace hhtest;

/* A row of wheels, each on its own axle beside the previous one, distributed over the ranks. The first wheel is
   driven, gears drive the others */
TEST(SceneCounts, AnglesOfQuestions)
{
  const double turn = 2 * M_PI;
  const int    n    = 6;
  for (bool kinematic : {false, true}) {
    Scene               scene(PETSC_COMM_WORLD);
    std::vector<Marker> i, j;
    for (int k = 0; k < n; k++) {
      RigidBody b;
      b.position         = {2. * k, 0, 0};
      b.angular_velocity = {0, 0, k % 2 ? -turn : turn};
      const Body wheel   = scene.add("", b);
      i.push_back(scene.marker(wheel));
      j.push_back(scene.marker(scene.ground(), b.position));
      scene.add("", Revolute{i[k], j[k]});
      if (k) scene.add("", Gear{i[k - 1], j[k - 1], i[k], j[k]});
    }
    if (kinematic) scene.add("drive", RotationalMotion{i[0], j[0], TimeFunction::polynomial({0, turn})});
    SceneRun run(scene, 3.4, "");
    Snapshot now;
    double   x;
    must(now.take(run.ts));
    must(now.value(Measure::angle(i[n - 1], i[0]), &x));
    EXPECT_NEAR(x, 0, 1e-10);
    if (kinematic) must(Kinematics(run.ts, 3.4));
    else must(run.solve());
    must(now.take(run.ts));
    must(now.value(Measure::angle(i[n - 1], i[0]), &x)); /* counted from the first question on */
    EXPECT_NEAR(x, -6.8 * turn, 1e-5);
    must(now.value(Measure::angle(i[n - 1], j[n - 1]), &x)); /* counted by the gear */
    EXPECT_NEAR(x, -3.4 * turn, 1e-5);
  }
}

TEST(SceneCounts, DroppedRows)
{
  for (bool part : {false, true}) {
    Scene   scene(PETSC_COMM_WORLD);
    Linkage l;
    Printed quiet;
    l.build(scene);
    const Marker i = scene.markerAt(l.crank, l.A), j = scene.marker(scene.ground());
    scene.add("first", RotationalMotion{i, j, TimeFunction::polynomial({0, 0, 1})});
    scene.add("second", RotationalMotion{i, j, TimeFunction::polynomial({0, 0, 1, part ? 0.5 : 0})});
    SceneRun  run(scene, 1, "");
    ErrorTrap trap;
    EXPECT_EQ(run.solve() != 0, part);
    if (part) {
      EXPECT_TRUE(trap.says("rotational motion second: row 1 of 1 (driven angle) was dropped as redundant")) << trap.message;
    }
  }
}
