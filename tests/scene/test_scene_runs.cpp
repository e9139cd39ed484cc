/* One scene and several runs; calls in the wrong order; handles of another scene: each gives the right result or a
   clear error */
#include "scene_output.h"

using namespace hhtest;

namespace
{

/* A wheel that makes many turns against a torsional spring, whose angle is counted */
struct Winder {
  Scene   scene{PETSC_COMM_SELF};
  Body    wheel;
  Marker  on, at;
  Element pin;

  Winder()
  {
    RigidBody b;
    b.angular_velocity = {0, 0, 9};
    wheel              = scene.add("wheel", b);
    on                 = scene.marker(wheel);
    at                 = scene.marker(scene.ground());
    pin                = scene.add("pin", Revolute{on, at});
    scene.add("spring", TorsionalSpringDamper{on, at, 0.05, 0, 0, 0});
  }
};

Array solution(TS ts)
{
  Vec U;
  must(TSGetSolution(ts, &U));
  return whole(U);
}

void expectError(PetscErrorCode code, const ErrorTrap &trap, const std::string &part)
{
  EXPECT_NE(code, 0) << part;
  EXPECT_TRUE(trap.says(part)) << trap.message;
}

} // namespace

/* Each TS starts from the description, including counted angles and reference axes */
TEST(SceneRuns, ASecondTSIsASecondRun)
{
  Winder w;
  Array  end[2];
  for (Array &x : end) {
    SceneRun run(w.scene, 3, tolerance(1e-6));
    must(run.solve());
    x = solution(run.ts);
  }
  EXPECT_EQ(end[0], end[1]);
}

/* Two runs that make steps alternately give the same digits as one after the other */
TEST(SceneRuns, SideBySide)
{
  Winder   w;
  SceneRun alone(w.scene, 3, tolerance(1e-6));
  must(alone.solve());
  SceneRun first(w.scene, 3, tolerance(1e-6)), second(w.scene, 3, tolerance(1e-6));
  for (SceneRun *run : {&first, &second}) must(TSSetMaxSteps(run->ts, 0));
  PetscInt steps;
  must(TSGetStepNumber(alone.ts, &steps));
  for (PetscInt k = 1; k <= steps; k++)
    for (SceneRun *run : {&first, &second}) {
      must(TSSetMaxSteps(run->ts, k));
      must(run->solve());
    }
  EXPECT_EQ(solution(first.ts), solution(alone.ts));
  EXPECT_EQ(solution(second.ts), solution(alone.ts));
}

/* A run owns what it needs of the scene, which may be destroyed */
TEST(SceneRuns, OutlivesItsScene)
{
  TS    ts;
  Array end;
  {
    Winder w;
    must(w.scene.createTS(&ts));
    SceneRun run(w.scene, 1, tolerance(1e-6));
    must(run.solve());
    end = solution(run.ts);
  }
  must(TSSetMaxTime(ts, 1));
  Options in(tolerance(1e-6));
  must(TSSetFromOptions(ts));
  must(TSSolve(ts, nullptr));
  EXPECT_EQ(solution(ts), end);
  must(TSDestroy(&ts));
}

TEST(SceneRuns, TheSameTSDoesNotStartAgain)
{
  Winder   w;
  SceneRun run(w.scene, 1, tolerance(1e-6));
  must(run.solve());
  must(TSSetMaxTime(run.ts, 2)); /* continuing the run is allowed */
  must(run.solve());
  must(TSSetTime(run.ts, 0));
  must(TSSetStepNumber(run.ts, 0));
  must(TSRestartStep(run.ts));
  ErrorTrap trap;
  expectError(run.solve(), trap, "the TS starts again at t = 0");
  EXPECT_TRUE(trap.says("take a new TS")) << trap.message;
}

TEST(SceneRuns, SolveNeedsATSOfTheScene)
{
  Winder    a, b;
  TS        ts;
  ErrorTrap trap;
  Array     values;
  must(a.scene.createTS(&ts));
  expectError(b.scene.solve(ts), trap, "Scene::solve(): the TS is not of this scene");
  expectError(b.scene.sample(ts, 0, values), trap, "Scene::sample(): the TS is not of this scene");
  must(TSDestroy(&ts));
  must(TSCreate(PETSC_COMM_SELF, &ts));
  expectError(a.scene.solve(ts), trap, "not of this scene");
  must(TSDestroy(&ts));
}

TEST(SceneRuns, CallsAfterTheSetUp)
{
  using Call = std::function<void(Winder &)>;
  const std::vector<std::pair<std::string, Call>> calls = {
    {"body late", [](Winder &w) { w.scene.add("late", RigidBody()); }},
    {"body point", [](Winder &w) { w.scene.add("point", PointMass()); }},
    {"spring-damper late", [](Winder &w) { w.scene.add("late", SpringDamper{w.on, w.at, 1}); }},
    {"variable late", [](Winder &w) { w.scene.variable("late", Measure::time()); }},
    {"state late", [](Winder &w) { w.scene.state("late", Measure::time(), 0); }},
    {"gravity", [](Winder &w) { w.scene.gravity({0, 0, 1}); }},
    {"channel late", [](Winder &w) { w.scene.channel("late", Measure::time()); }},
    {"shape", [](Winder &w) { w.scene.shape(w.wheel, Shape::sphere(1)); }},
    {"line", [](Winder &w) { w.scene.line({w.on, w.at}); }},
  };
  for (const auto &[name, call] : calls) {
    Winder   w;
    SceneRun run(w.scene, 0.1, "");
    call(w);
    must(run.solve()); /* a run continues after its scene has been changed */
    ErrorTrap trap;
    TS        ts;
    expectError(w.scene.createTS(&ts), trap, name);
    EXPECT_TRUE(trap.says("after")) << trap.message;
  }
}

/* A run may continue with coordinates of another kind (rotation vectors or Euler angles); bodies keep their positions */
TEST(SceneRuns, GoesOnWithAnotherStart)
{
  Scene     s(PETSC_COMM_SELF);
  RigidBody top;
  TS        next;
  PetscReal t;
  Array     before, after;
  top.angular_velocity = {0.3, 0, 2};
  s.channel("x", Measure::displacement(s.marker(s.add("top", top), {1, 0, 0}), 0));
  SceneRun run(s, 0.5, tolerance(1e-6));
  must(run.solve());
  must(s.sample(run.ts, 0.5, before));
  s.start().rotations = Rotations::Euler313;
  must(s.createTS(&next, run.ts));
  must(TSGetTime(next, &t));
  must(s.sample(next, 0.5, after));
  EXPECT_EQ(t, 0.5);
  EXPECT_NEAR(before[0], std::cos(1.), 0.1); /* it has turned */
  EXPECT_NEAR(before[0], after[0], 1e-12);
  must(TSDestroy(&next));
}

TEST(SceneRuns, HandlesOfAnotherScene)
{
  using Call = std::function<void(Winder &, Winder &)>;
  const std::vector<std::pair<std::string, Call>> calls = {
    {"marker i is not a marker of this scene", [](Winder &w, Winder &o) { w.scene.add("s", SpringDamper{o.on, w.at, 1}); }},
    {"marker j is not a marker of this scene", [](Winder &w, Winder &o) { w.scene.add("s", SpringDamper{w.on, o.at, 1}); }},
    {"its body is not one of this scene", [](Winder &w, Winder &o) { w.scene.marker(o.wheel); }},
    {"its body is not one of this scene", [](Winder &w, Winder &o) { w.scene.markerAt(o.wheel, {0, 0, 0}); }},
    {"shape: its body is not one of this scene", [](Winder &w, Winder &o) { w.scene.shape(o.wheel, Shape::sphere(1)); }},
    {"a marker is not one of this scene", [](Winder &w, Winder &o) { w.scene.line({w.on, o.at}); }},
    {"marker i is not one of this scene", [](Winder &w, Winder &o) { w.scene.channel("c", Measure::displacement(o.on, 0)); }},
    {"marker `frame` is not one of this scene", [](Winder &w, Winder &o) { w.scene.channel("c", Measure::jointForce(w.pin, 0, o.at)); }},
    {"its element is not one of this scene", [](Winder &w, Winder &o) { w.scene.channel("c", Measure::multiplier(o.pin, 0)); }},
    {"not a variable of this scene", [](Winder &w, Winder &o) {
       w.scene.variable("v", Measure::time());
       w.scene.channel("c", Measure::value(o.scene.variable("v", Measure::time())));
     }},
    {"its joint is not an element of this scene", [](Winder &w, Winder &o) { w.scene.add("f", JointFriction{o.pin, 0.1, 0.1}); }},
    {"marker i2 is not a marker of this scene", [](Winder &w, Winder &o) { w.scene.add("g", GearMesh{w.on, w.at, o.on, w.at, w.at}); }},
  };
  for (const auto &[message, call] : calls) {
    Winder    w, other;
    call(w, other);
    ErrorTrap trap;
    expectError(w.scene.setUp(), trap, message);
  }
  Winder w, other;
  w.scene.marker(other.scene.ground()); /* the ground is the same in all scenes */
  must(w.scene.setUp());
}
