/* A scene's start is the same on any number of ranks. */
#include "hhtdae/scene.h"
#include "scene_start.h"

using namespace hhtest;
using hhtdae::Assembly;

namespace
{

void expectSame(const Scene &a, const Scene &b, double tolerance)
{
  const hhtdae::StartResult &x = DataOf(a).started, &y = DataOf(b).started;
  EXPECT_EQ(x.redundant, y.redundant);
  ASSERT_EQ(x.dropped.size(), y.dropped.size());
  for (std::size_t k = 0; k < x.dropped.size(); k++) {
    EXPECT_EQ(x.dropped[k].element, y.dropped[k].element);
    EXPECT_EQ(x.dropped[k].row, y.dropped[k].row);
  }
  for (std::size_t i = 0; i < DataOf(a).bodies.size(); i++) {
    const hhtdae::BodyData &p = DataOf(a).bodies[i], &q = DataOf(b).bodies[i];
    EXPECT_NEAR((p.r - q.r).norm(), 0, tolerance) << p.name;
    EXPECT_NEAR((p.A - q.A).norm(), 0, tolerance) << p.name;
    EXPECT_NEAR((p.v - q.v).norm() + (p.w - q.w).norm(), 0, 100 * tolerance) << p.name;
  }
}

/* On all ranks together, and on each rank alone */
void compare(const std::function<void(Scene &)> &describe, double tolerance)
{
  Scene   all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
  Printed quiet;
  describe(all);
  describe(alone);
  ASSERT_EQ(all.setUp(), 0);
  ASSERT_EQ(alone.setUp(), 0);
  expectSame(all, alone, tolerance);
}

} // namespace

TEST(SceneStart, AssemblyOfAFourBar)
{
  compare(
      [](Scene &s) {
        Linkage   f;
        RigidBody crank        = rod(f.A, f.B);
        crank.fixed_start      = true;
        crank.angular_velocity = {0, 0, 2};
        crank.velocity         = Vector3(0, 0, 2).cross(crank.position);
        f.build(s, crank, {0.2, -0.1, 0.1});
        s.start().assembly = Assembly::Project;
      },
      1e-9);
}

TEST(SceneStart, RedundantRowsOfANet)
{
  compare([](Scene &s) { net(s, 6); }, 0);
}

TEST(SceneStart, Bricard) { compare(bricard, 0); }

TEST(SceneStart, EquilibriumOfAHangingNet)
{
  compare(
      [](Scene &s) {
        const int n    = 5;
        Body      last = s.ground();
        Vector3   at(0, 0, 0);
        for (int k = 0; k < n; k++) {
          const Vector3 next = at + Vector3(1, 0.1, 0);
          const Body    b    = s.add("", rod(at, next));
          pin(s, "", b, last, at);
          at   = next;
          last = b;
        }
        s.add("spring", hhtdae::SpringDamper{s.markerAt(last, at), s.marker(s.ground(), {3, 1, 0}), 20, 0, 0.5});
        s.gravity({0, -9.81, 0});
        s.start().equilibrium = true;
      },
      1e-7);
}

/* A run after rows were dropped: the nonzero pattern, the communication and the roles fit the remaining rows */
TEST(SceneStart, ARunWithRowsDropped)
{
  double r[2][3];
  for (int k = 0; k < 2; k++) {
    Scene   s(k ? PETSC_COMM_WORLD : PETSC_COMM_SELF);
    Printed quiet;
    Options in("-ts_rtol 1e-6 -ts_atol 1e-6");
    TS      ts;
    Vec     U, V;
    bricard(s);
    must(s.createTS(&ts));
    must(TSSetMaxTime(ts, 0.1));
    must(TSSetFromOptions(ts));
    must(s.solve(ts));
    must(TS2GetSolution(ts, &U, &V));
    const Array u = whole(U);
    for (int c = 0; c < 3; c++) r[k][c] = u[ModelOf(s).number.body[2] + c];
    must(TSDestroy(&ts));
  }
  for (int c = 0; c < 3; c++) EXPECT_NEAR(r[0][c], r[1][c], 1e-5);
}
