/* Starts with velocities that strong damping removes in a transient far shorter than any step */
#include "hhtdae/scene.h"
#include "support.h"

#include <algorithm>

using namespace hhtest;
using namespace hhtdae;

namespace
{

constexpr double length = 1., first_rate = 3., second_rate = -2., second_angle = 0.4; /* second rod: relative to the first, which lies along x */

struct Rods {
  Scene  scene;
  Marker tip;
  explicit Rods(Space space) : scene(PETSC_COMM_SELF, space)
  {
    scene.gravity({0, -9.81, 0});
    scene.start().assembly = Assembly::Project;
  }
};

RigidBody rod(const Vector3 &at, double angle, const Vector3 &velocity, double rate)
{
  RigidBody b;
  b.inertia          = Vector3(1e-3, length * length / 12, length * length / 12).asDiagonal();
  b.rotation         = Eigen::AngleAxisd(angle, Vector3::UnitZ()).toRotationMatrix();
  b.position         = at + 0.5 * length * b.rotation.col(0);
  b.velocity         = velocity + Vector3(0, 0, rate).cross(0.5 * length * b.rotation.col(0));
  b.angular_velocity = {0, 0, rate};
  return b;
}

/* Two rods on pins that both move at the start; the pin of the first one has a damper */
void damped(Rods &r, double c)
{
  const Vector3 elbow(length, 0, 0), speed(0, first_rate * length, 0);
  const Body    one = r.scene.add("one", rod(Vector3::Zero(), 0, Vector3::Zero(), first_rate)),
             two    = r.scene.add("two", rod(elbow, second_angle, speed, second_rate));
  const Marker i = r.scene.marker(one, {-0.5 * length, 0, 0}), j = r.scene.marker(r.scene.ground());
  r.scene.add("pin", Revolute{i, j});
  r.scene.add("elbow", Revolute{r.scene.marker(two, {-0.5 * length, 0, 0}), r.scene.marker(one, {0.5 * length, 0, 0})});
  TorsionalSpringDamper d;
  d.i       = i;
  d.j       = j;
  d.damping = c;
  r.scene.add("damper", d);
  r.tip = r.scene.marker(two, {0.5 * length, 0, 0});
}

/* The motion after the transient: the first rod is at rest, and the second keeps its angular momentum about the elbow */
void stopped(Rods &r)
{
  const Vector3 elbow(length, 0, 0), arm = 0.5 * length * Vector3(std::cos(second_angle), std::sin(second_angle), 0);
  const double  momentum = second_rate * length * length / 3 + arm.cross(Vector3(0, first_rate * length, 0)).z(), rate = momentum / (length * length / 3);
  const Body    two      = r.scene.add("two", rod(elbow, second_angle, Vector3::Zero(), rate));
  r.scene.add("elbow", Revolute{r.scene.marker(two, {-0.5 * length, 0, 0}), r.scene.marker(r.scene.ground(), elbow)});
  r.tip = r.scene.marker(two, {0.5 * length, 0, 0});
}

struct Path {
  std::vector<double> x;
  TSHHT3Statistics    stat;
};

Path run(Rods &r, const std::string &options)
{
  for (int c = 0; c < 2; c++) r.scene.channel(c ? "y" : "x", Measure::displacement(r.tip, c));
  TS   ts;
  Path p;
  must(r.scene.createTS(&ts));
  must(TSSetMaxTime(ts, 1.));
  Options in(options);
  must(TSSetFromOptions(ts));
  must(r.scene.solve(ts));
  must(r.scene.sample(ts, 1., p.x));
  must(TSHHT3GetStatistics(ts, &p.stat));
  must(TSDestroy(&ts));
  return p;
}

/* Masses in a row connected by springs and strong dampers, fixed at one end, under gravity along the row, initially
   undeformed */
struct Row : Problem {
  const double k = 1e6, c = 1e5;
  Row()
  {
    name = "row";
    n    = 40;
    t1   = 1.;
    role = std::vector<TSHHT3Role>((size_t)n, TSHHT3_COORDINATE);
  }
  void initial(double *u, double *v) const override
  {
    std::fill_n(u, n, 0.);
    std::fill_n(v, n, 0.);
  }
  void residual(double, const double *u, const double *v, const double *a, double *f) const override
  {
    for (PetscInt i = 0; i < n; i++) f[i] = a[i] - 1;
    for (PetscInt i = 0; i < n; i++) {
      const double force = k * (u[i] - (i ? u[i - 1] : 0.)) + c * (v[i] - (i ? v[i - 1] : 0.));
      f[i] += force;
      if (i) f[i - 1] -= force;
    }
  }
  void jacobian(double, const double *, const double *, const double *, double sv, double sa, Entries &J) const override
  {
    const double d = k + c * sv;
    for (PetscInt i = 0; i < n; i++) {
      J.add(i, i, sa + (i + 1 < n ? 2. : 1.) * d);
      if (!i) continue;
      J.add(i, i - 1, -d);
      J.add(i - 1, i, -d);
    }
  }
};

} // namespace

/* The initial acceleration is that of the transient. If it were used for a whole step, the rods would be thrown far
   beyond their rest position */
TEST(StiffStart, StrongDampingStopsAtOnce)
{
  const auto still = [](double eps, const char *steps) {
    Rods r(Space::Planar);
    stopped(r);
    return run(r, tolerance(eps) + steps);
  };
  const Path exact = still(1e-8, "");
  const auto error = [&](const Path &p) { return std::hypot(p.x[0] - exact.x[0], p.x[1] - exact.x[1]); };
  for (Space space : {Space::Planar, Space::Spatial})
    for (double c : {1e6, 1e9, 1e12})
      for (const char *steps : {"", "-ts_adapt_type none -ts_dt 1e-3"})
        for (double eps : {1e-3, 1e-5}) {
          Rods r(space);
          damped(r, c);
          const Path   p = run(r, tolerance(eps) + steps), q = still(eps, steps);
          const double e = error(p), without = error(q);
          MEASURED("%s, damper of %g N m s, tolerance %g%s: error %.1e in %d steps, %.1e in %d of the rod that hangs on a pin at rest", space == Space::Planar ? "planar" : "spatial", c, eps,
                   *steps ? ", fixed steps" : "", e, (int)p.stat.steps, without, (int)q.stat.steps);
          EXPECT_LT(e, 3 * without + 300 / c);
          EXPECT_LT(p.stat.steps, 4 * q.stat.steps); /* with 1e6 the first steps resolve part of the transient */
        }
}

/* Damping spreads the reaction at the fixed end along the row. This is not a transient to be skipped, which would cost
   additional matrices */
TEST(StiffStart, SpreadingLoadsAreNoTransients)
{
  const Row  p;
  Simulation run(p, fixedSteps(1e-2));
  PetscInt   first = 0;
  run.watch        = [&](Simulation &r, PetscInt step, double) {
    if (step == 1) first = r.statistics().factorizations;
  };
  must(run.solve());
  EXPECT_LE(first, 3);
}
