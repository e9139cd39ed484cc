/* The state of a scene at a final time at which no step ends */
#include "support.h"

#include <hhtdae/scene.h>

using namespace hhtest;

namespace
{

struct Swing {
  hhtdae::Scene scene{PETSC_COMM_SELF};
  TS            ts = nullptr;
  Vec           U = nullptr, V = nullptr;

  explicit Swing(TSExactFinalTimeOption option)
  {
    using namespace hhtdae;
    RigidBody rod;
    rod.position = {.5, 0, 0};
    Body arm     = scene.add("arm", rod);
    scene.add("pin", Revolute{scene.marker(arm, {-.5, 0, 0}), scene.marker(scene.ground())});
    scene.gravity({0, -9.81, 0});
    must(scene.createTS(&ts));
    must(TSSetMaxTime(ts, .5));
    must(TSSetTolerances(ts, 1e-7, nullptr, 1e-7, nullptr));
    must(TSSetExactFinalTime(ts, option));
    must(scene.solve(ts));
    must(TS2GetSolution(ts, &U, &V));
  }
  ~Swing() { TSDestroy(&ts); }
  double t() const
  {
    PetscReal t;
    must(TSGetTime(ts, &t));
    return t;
  }
};

} // namespace

TEST(SceneFinalTime, ByInterpolation)
{
  const Swing exact(TS_EXACTFINALTIME_MATCHSTEP), between(TS_EXACTFINALTIME_INTERPOLATE), over(TS_EXACTFINALTIME_STEPOVER);
  EXPECT_EQ(between.t(), .5);
  EXPECT_GT(over.t(), .5);
  MEASURED("positions %.1e, velocities %.1e of a step that ends there", relativeDifference(whole(between.U), whole(exact.U)), relativeDifference(whole(between.V), whole(exact.V)));
  EXPECT_LT(relativeDifference(whole(between.V), whole(exact.V)), 1e-4);
  EXPECT_GT(relativeDifference(whole(over.V), whole(exact.V)), 1e-3); /* otherwise the test would show nothing */
}
