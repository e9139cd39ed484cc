/* In free flight the error estimate is zero for every step size; bodies must nevertheless not fly through an obstacle */
#include "hhtdae/scene.h"
#include "support.h"

#include <algorithm>

using namespace hhtest;

namespace
{

struct Flight {
  double   lowest = 1e300;
  PetscInt steps  = 0;
};

/* Lowest value of a channel, sampled at the ends of steps and between them */
Flight fly(hhtdae::Scene &scene, double end, const std::string &options, bool limited)
{
  struct Watch {
    hhtdae::Scene &scene;
    Flight         flight;
    double         last = 0;
  } watch{scene, {}, 0};
  TS ts;
  must(scene.createTS(&ts));
  must(TSSetMaxTime(ts, end));
  if (!limited) must(TSHHT3SetStepLimit(ts, nullptr, nullptr));
  Options in(options);
  must(TSSetFromOptions(ts));
  must(TSMonitorSet(
      ts,
      [](TS s, PetscInt step, PetscReal t, Vec, void *ctx) -> PetscErrorCode {
        Watch              &w = *static_cast<Watch *>(ctx);
        std::vector<double> values;
        if (step <= 0) return 0;
        for (int k = 1; k <= 8; k++) {
          PetscCall(w.scene.sample(s, w.last + (t - w.last) * k / 8, values));
          w.flight.lowest = std::min(w.flight.lowest, values[0]);
        }
        w.last         = t;
        w.flight.steps = step;
        return 0;
      },
      &watch, nullptr));
  must(scene.solve(ts));
  must(TSDestroy(&ts));
  return watch.flight;
}

hhtdae::RigidBody ball(double height, double speed)
{
  hhtdae::RigidBody b;
  b.mass     = 2;
  b.inertia  = hhtdae::Matrix3::Identity() * 0.01;
  b.position = {0.02, 0.01, height};
  b.velocity = {0, 0, speed};
  return b;
}

constexpr double radius = 0.1;

/* speed: initial velocity upwards */
Flight ontoBox(double speed, const std::string &options, bool limited = true)
{
  hhtdae::Scene scene(PETSC_COMM_SELF);
  scene.gravity({0, 0, -9.81});
  const hhtdae::Marker center = scene.marker(scene.add("ball", ball(2, speed)));
  scene.add("box", hhtdae::SphereBox{
                       center, scene.marker(scene.ground()), radius, {0.5, 0.5, 0.05}, {1e7, 1.5, 0.2, 0.3, 1e-2}});
  scene.channel("height", hhtdae::Measure::displacement(center, 2));
  return fly(scene, 3, options, limited);
}

Flight ontoBall(double speed, const std::string &options, bool limited = true)
{
  hhtdae::Scene scene(PETSC_COMM_SELF, hhtdae::Space::Spatial);
  scene.gravity({0, 0, -9.81});
  const hhtdae::Marker center = scene.marker(scene.add("ball", ball(2, speed)));
  scene.add(
      "ball on ball",
      hhtdae::SphereSphere{center, scene.marker(scene.ground(), {0.02, 0.01, 0}), radius, radius, {1e7, 1.5, 0.2}});
  scene.channel("height", hhtdae::Measure::displacement(center, 2));
  return fly(scene, 3, options, limited);
}

} // namespace

TEST(Approach, NoBallFliesThroughABoxOrABall)
{
  for (double eps : {1e-3, 1e-4, 1e-5, 1e-6, 1e-8})
    for (double speed : {0., 3., -20.}) {
      const Flight box = ontoBox(speed, tolerance(eps)), other = ontoBall(speed, tolerance(eps));
      EXPECT_GT(box.lowest, 0.05 + 0.5 * radius)
          << "eps " << eps << ", speed " << speed << ", " << box.steps << " steps";
      EXPECT_GT(other.lowest, 1.5 * radius) << "eps " << eps << ", speed " << speed << ", " << other.steps << " steps";
      MEASURED("eps %g, speed %g: lowest %g above the box in %d steps, %g above the ball in %d", eps, speed, box.lowest,
               (int)box.steps, other.lowest, (int)other.steps);
    }
}

/* Control experiment: without a limit of the steps some bodies fly through, so that the test above is not vacuous */
TEST(Approach, WithoutALimitSomeDo)
{
  int through = 0;
  for (double eps : {1e-3, 1e-4, 1e-5, 1e-6, 1e-8})
    for (double speed : {0., 3., -20.}) {
      through += ontoBox(speed, tolerance(eps), false).lowest < 0;
      through += ontoBall(speed, tolerance(eps), false).lowest < 0;
    }
  MEASURED("%d of 30 balls fly through", through);
  EXPECT_GT(through, 0);
}

/* TSHHT3SetStepLimit() with a function of the application, on a problem in free flight */
TEST(Approach, StepsAreAsLongAsTheApplicationAllows)
{
  HeavyTop     p(.2);
  Simulation   run(p, tolerance(1e-3));
  const double most = 2e-3;
  must(TSHHT3SetStepLimit(
      run.ts,
      [](TS, PetscReal, Vec, Vec, Vec, PetscReal *h, void *ctx) -> PetscErrorCode {
        *h = *static_cast<const double *>(ctx);
        return 0;
      },
      const_cast<double *>(&most)));
  must(run.solve());
  EXPECT_LE(run.statistics().h_max, most);
  EXPECT_GE(run.statistics().steps, 100);
  EXPECT_LE(run.statistics().steps, 130);
}
