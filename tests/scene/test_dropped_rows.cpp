/* Constraints that are redundant at the start are dropped; if they are violated later the run ends with an error,
   otherwise not */
#include "hhtdae/analyses.h"
#include "hhtdae/joints.h"
#include "scene/model.h"
#include "scene_output.h"
#include "scene_start.h"
#include <cmath>

using namespace hhtest;
using namespace hhtdae;

namespace
{

std::string failure(Scene &s, double end, const std::string &options = "")
{
  Printed   quiet;
  ErrorTrap trap;
  SceneRun  run(s, end, options);
  run.solve();
  return trap.message;
}

/* A wheel driven by two motions that agree until t = 0.5 */
void twoMotions(Scene &s, MotionOf of)
{
  RigidBody b;
  b.angular_velocity = {0, 0, 1};
  const Body   wheel = s.add("wheel", b);
  const Marker i = s.marker(wheel), j = s.marker(s.ground());
  const bool   speeds = of == MotionOf::Velocity;
  s.add("axle", Revolute{i, j});
  s.add("first", RotationalMotion{i, j, speeds ? TimeFunction(1) : TimeFunction::polynomial({0, 1}), of});
  s.add("second", RotationalMotion{i, j, TimeFunction::formula([=](TimeFunction::Number t) -> TimeFunction::Number {
                                     const TimeFunction::Number f = speeds ? TimeFunction::Number(1) : t;
                                     if (t.value().value() < 0.5) return f;
                                     return f + (t - 0.5) * (t - 0.5) * (t - 0.5);
                                   }),
                                   of});
}

} // namespace

/* A planar four-bar of revolute joints in space: three redundant rows are satisfied over full turns, also with loose
   tolerances */
TEST(DroppedRows, ALinkageOverFullTurns)
{
  for (double tol : {1e-2, 1e-3, 1e-6}) {
    Scene   s(PETSC_COMM_SELF);
    Linkage l;
    RigidBody crank = rod(l.A, l.B);
    l.build(s, crank);
    s.add("drive", RotationalMotion{s.markerAt(l.crank, l.A), s.marker(s.ground()), TimeFunction::polynomial({0, 0, 3})});
    s.gravity({0, -9.81, 0});
    EXPECT_EQ(failure(s, 3, "-ts_rtol " + std::to_string(tol) + " -ts_atol " + std::to_string(tol)), "") << tol;
    EXPECT_EQ(DataOf(s).started.dropped.size(), 3u);
  }
}
TEST(DroppedRows, ANetAndBricardsMechanism)
{
  Scene s(PETSC_COMM_SELF);
  net(s, 3);
  s.gravity({0, -9.81, 0});
  EXPECT_EQ(failure(s, 1, "-ts_rtol 1e-3 -ts_atol 1e-3"), "");
  for (const char *tol : {"1e-1", "1e-2", "1e-3", "1e-5"}) {
    Scene b(PETSC_COMM_SELF);
    bricard(b);
    EXPECT_EQ(failure(b, 3, std::string("-ts_rtol ") + tol + " -ts_atol " + tol), "") << tol;
  }
}

/* The violation is judged by the user's vectors of tolerances, too */
TEST(DroppedRows, LooseTolerancesByVectors)
{
  Scene   s(PETSC_COMM_SELF);
  Printed quiet;
  Vec     U, tolerance;
  bricard(s);
  SceneRun run(s, 3, "-ts_rtol 1e-9 -ts_atol 1e-9");
  must(TSGetSolution(run.ts, &U));
  must(VecDuplicate(U, &tolerance));
  must(VecSet(tolerance, 1e-2));
  must(TSSetTolerances(run.ts, 1e-9, tolerance, 1e-9, tolerance));
  must(VecDestroy(&tolerance));
  must(run.solve());
}

TEST(DroppedRows, MotionsThatPart)
{
  for (MotionOf of : {MotionOf::Displacement, MotionOf::Velocity}) {
    Scene s(PETSC_COMM_SELF), until(PETSC_COMM_SELF);
    twoMotions(s, of);
    const std::string said = failure(s, 1, "-ts_rtol 1e-5 -ts_atol 1e-5");
    EXPECT_NE(said.find("rotational motion second: row 1 of 1 (driven ang"), std::string::npos) << said;
    EXPECT_NE(said.find("was dropped as redundant at the start, and is violated by"), std::string::npos) << said;
    twoMotions(until, of);
    EXPECT_EQ(failure(until, 0.4), "");
  }
}

/* A coupler on three cranks, the first of them driven. With cranks of equal length the third one follows; with another
   length the mechanism is locked. Only the dropped row shows this, because it would remove the last degree of freedom */
TEST(DroppedRows, AThirdCrankOfAnotherLength)
{
  for (double length : {1., 1.2}) {
    Scene                s(PETSC_COMM_SELF, Space::Planar);
    const Vector3        up(std::cos(1.), std::sin(1.), 0);
    std::vector<Vector3> foot{{0, 0, 0}, {2, 0, 0}, Vector3(1, 0, 0) + (1 - length) * up};
    const Body           coupler = s.add("coupler", rod(up, Vector3(2, 0, 0) + up));
    for (int k = 0; k < 3; k++) {
      const Vector3 head  = Vector3(k == 2 ? 1 : 2 * k, 0, 0) + up;
      const Body    crank = s.add("crank " + std::to_string(k + 1), rod(foot[k], head));
      s.add("foot " + std::to_string(k + 1), Revolute{s.markerAt(crank, foot[k]), s.markerAt(s.ground(), foot[k])});
      s.add("head " + std::to_string(k + 1), Revolute{s.markerAt(crank, head), s.markerAt(coupler, head)});
      if (k == 0) s.add("drive", RotationalMotion{s.markerAt(crank, foot[k]), s.markerAt(s.ground(), foot[k]), TimeFunction::polynomial({0, 1})});
    }
    const std::string said = failure(s, 1.5, "-ts_rtol 1e-4 -ts_atol 1e-4 -scene_assemble project");
    EXPECT_EQ(DataOf(s).started.dropped.size(), 1u);
    if (length == 1) EXPECT_EQ(said, "");
    else EXPECT_NE(said.find("was dropped as redundant at the start, and is violated by"), std::string::npos) << said;
  }
}

/* The violation is noticed at the end of the last step as well, and in kinematics and static equilibrium */
TEST(DroppedRows, InTheLastStepAndInKinematics)
{
  Scene s(PETSC_COMM_SELF), k(PETSC_COMM_SELF);
  twoMotions(s, MotionOf::Displacement);
  EXPECT_NE(failure(s, 0.9, "-ts_dt 0.9 -ts_adapt_type none").find("is violated by 0.064 at t = 0.9"), std::string::npos);
  twoMotions(k, MotionOf::Displacement);
  Printed  quiet;
  SceneRun run(k, 1, "");
  must(Kinematics(run.ts, 0.3));
  {
    ErrorTrap trap;
    EXPECT_NE(Kinematics(run.ts, 1), 0);
    EXPECT_TRUE(trap.says("second: row 1 of 1 (driven angle) was dropped")) << trap.message;
  }
  {
    ErrorTrap trap;
    EXPECT_NE(StaticEquilibrium(run.ts, 1), 0);
    EXPECT_TRUE(trap.says("second: row 1 of 1 (driven angle) was dropped")) << trap.message;
  }
  PetscReal t;
  must(TSGetTime(run.ts, &t));
  EXPECT_EQ(t, 0.3);
}

/* Two hinges of a door on one line: friction in the hinge whose rows are dropped has no load, which a message reports */
TEST(DroppedRows, FrictionThatReadsThem)
{
  for (int k = 0; k < 2; k++) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody b;
    b.position         = {.5, 0, 1};
    b.velocity         = {0, .5, 0};
    b.angular_velocity = {0, 0, 1};
    const Body    door = s.add("door", b);
    Element       hinge[2];
    for (int h = 0; h < 2; h++) hinge[h] = s.add("hinge " + std::to_string(h), Revolute{s.markerAt(door, {0, 0, .3 + 1.4 * h}), s.markerAt(s.ground(), {0, 0, .3 + 1.4 * h})});
    s.add("rub", JointFriction{hinge[k], .3, .01});
    Printed out;
    must(s.setUp());
    EXPECT_EQ(out.says("joint friction rub takes the forces of dropped rows for zero"), k == 1) << out.text();
  }
}

/* A set-up that fails because there is no equilibrium, followed by a set-up without equilibrium */
TEST(DroppedRows, AfterASetUpThatFailed)
{
  Scene     s(PETSC_COMM_SELF);
  RigidBody b;
  b.position = {5, 0, 0};
  twoMotions(s, MotionOf::Displacement);
  s.add("free", b); /* this body falls */
  s.gravity({0, 0, -9.81});
  s.start().equilibrium = true;
  {
    Printed   quiet;
    ErrorTrap trap;
    EXPECT_NE(s.setUp(), 0);
  }
  s.start().equilibrium = false;
  Printed quiet;
  must(s.setUp());
  EXPECT_EQ(ModelOf(s).scene.started.dropped.size(), 1u);
  EXPECT_NE(failure(s, 1).find("was dropped as redundant at the start, and is violated by"), std::string::npos);
}
