/* Ranks that describe different scenes, or different runs of one scene, are detected */
#include "scene_output.h"

using namespace hhtest;

namespace
{

struct Masses {
  Scene     scene{PETSC_COMM_WORLD};
  Parameter k;

  Masses(int bodies, bool channel)
  {
    k = scene.parameter("k", 1);
    scene.gravity({0, 0, -9.81});
    for (int n = 0; n < bodies; n++) {
      PointMass b;
      b.position     = {(double)n, 0, 0};
      const Marker i = scene.marker(scene.add("", b));
      scene.add("", UserForce{i, {}, {}, {Expression{{}, [=](const Real *) -> Real { return -k.value(); }}, Expression{{}, [](const Real *) -> Real { return 0.0; }}, Expression{{}, [](const Real *) -> Real { return 0.0; }}}, {}});
    }
    scene.channel("t", Measure::time());
    if (channel) scene.channel("more", Measure::time());
  }
};

} // namespace

TEST(SameScene, OnAllRanks)
{
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  const bool last = size > 1 && rank == size - 1;
  for (int difference = 0; difference < 4; difference++) {
    Masses c(difference == 1 && last ? 11 : 12, difference == 2 && last);
    if (difference == 3 && last) must(c.scene.set("k", 2));
    TS                   ts = nullptr;
    ErrorTrap            trap;
    const PetscErrorCode failed = c.scene.createTS(&ts);
    EXPECT_EQ(failed != 0, difference && size > 1) << difference;
    const char *what[4] = {"", "bodies, markers", "channels", "parameters"};
    if (failed) {
      EXPECT_TRUE(trap.says("ranks describe different scenes")) << trap.message;
      EXPECT_TRUE(trap.says(what[difference] + std::string(difference == 1 ? "" : text(": rank %d", size - 1)))) << trap.message;
    }
    if (!failed) must(TSDestroy(&ts));
  }
}

TEST(SameScene, RunsToTheSameTime)
{
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  for (bool end : {false, true}) {
    Masses c(4, false);
    TS    ts;
    must(c.scene.createTS(&ts));
    must(TSSetMaxTime(ts, end && rank ? 0.2 : 0.1));
    must(TSSetTolerances(ts, !end && rank ? 1e-5 : 1e-6, nullptr, 1e-6, nullptr));
    {
      ErrorTrap trap;
      EXPECT_EQ(c.scene.solve(ts) != 0, size > 1);
      EXPECT_TRUE(size == 1 || trap.says(end ? "final time (TSSetMaxTime()) differs between ranks" : "absolute tolerance differs between ranks")) << trap.message;
    }
    must(TSDestroy(&ts));
  }
}
