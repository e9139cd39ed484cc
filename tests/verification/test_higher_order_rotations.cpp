/*
  Orders three to five with local rotation vectors: bodies on a ball joint or free in space as scenes, against long double extrapolation of Euler's equations, which is
  checked with a closed form first.
*/
#include "../../examples/problems/extrapolation.h"
#include "scene_output.h"

#include <array>

using namespace hhtest;
using namespace hhtdae;

namespace
{

Matrix3 crossMatrix(const Vector3 &x) { return (Matrix3() << 0, -x(2), x(1), x(2), 0, -x(0), -x(1), x(0), 0).finished(); }

/* A spinning body; vectors from the joint or, without a joint, from the centre of mass, in body axes, which coincide
   with the space axes at the start */
struct Spinning {
  double  mass;
  Vector3 J, c, weight, spin; /* c: centre of mass from the joint; weight: in space axes */
  double  end;
  bool    joint() const { return c.norm() > 0; }
};

const Spinning heavy_top{1, {0.265, 0.265, 0.02}, {0, 0, 0.5}, {0, -8, -6}, {0, 0, 30}, 0.8},
  tumbling_top{1, {0.1, 0.45, 0.55}, {0.5, 0, 0}, {0, 0, -9.81}, {0.4, 4, 0.4}, 1.2}, satellite{1, {1, 2, 3}, {0, 0, 0}, {0, 0, 0}, {0.1, 2, 0.1}, 4};

/* Attitude, angular velocity, angular acceleration in space axes, force on the joint */
struct Motion {
  Matrix3 A;
  Vector3 w, alpha, force;
};

class ExactTop
{
public:
  explicit ExactTop(const Spinning &b)
      : b_(b), solution_([this](long double, const long double *y, long double *f) { rates(y, f); }, 0.L, 0.1L / b.spin.norm(),
                         {1, 0, 0, 0, 1, 0, 0, 0, 1, b.spin(0), b.spin(1), b.spin(2)})
  {
  }
  ExactTop(const ExactTop &) = delete;
  Motion at(double t)
  {
    const auto  y = solution_.at(t);
    long double f[12];
    Motion      m;
    Vector3     W, dW;
    rates(y.data(), f);
    for (int k = 0; k < 9; k++) m.A(k / 3, k % 3) = (double)y[k];
    for (int k = 0; k < 3; k++) {
      W(k)  = (double)y[9 + k];
      dW(k) = (double)f[9 + k];
    }
    m.w     = m.A * W;
    m.alpha = m.A * dW;
    m.force = b_.weight - b_.mass * (m.A * (dW.cross(b_.c) + W.cross(W.cross(b_.c)))); /* force of the body on the ground */
    return m;
  }

private:
  Spinning             b_;
  hhtex::Extrapolation solution_;

  void rates(const long double *y, long double *f) const
  {
    const long double *W = y + 9;
    long double        weight[3];
    for (int i = 0; i < 3; i++) {
      weight[i] = y[i] * b_.weight(0) + y[3 + i] * b_.weight(1) + y[6 + i] * b_.weight(2);
      for (int k = 0; k < 3; k++) f[3 * i + k] = y[3 * i + (k + 1) % 3] * W[(k + 2) % 3] - y[3 * i + (k + 2) % 3] * W[(k + 1) % 3];
    }
    for (int k = 0; k < 3; k++) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      f[9 + k]    = (b_.c(i) * weight[j] - b_.c(j) * weight[i] + (b_.J(i) - b_.J(j)) * W[i] * W[j]) / b_.J(k);
    }
  }
};

/* The body as a scene. Unknowns: position, rotation vector, multipliers */
struct Body1 {
  Scene    scene;
  Spinning b;
  Body1(const Spinning &spinning, Rotations rotations = Rotations::Local) : scene(PETSC_COMM_SELF), b(spinning)
  {
    RigidBody r;
    scene.start().rotations = rotations;
    scene.gravity(b.weight / b.mass);
    r.mass             = b.mass;
    r.inertia          = Matrix3(b.J.asDiagonal()) + b.mass * crossMatrix(b.c) * crossMatrix(b.c);
    r.center           = b.c;
    r.angular_velocity = b.spin;
    r.velocity         = b.spin.cross(b.c);
    const Body body    = scene.add("body", r);
    if (b.joint()) scene.add("pivot", Spherical{scene.marker(body), scene.marker(scene.ground())});
    for (int k = 0; k < 3; k++)
      for (int c = 0; c < 3; c++) scene.channel("", Measure::displacement(scene.marker(body, Vector3::Unit(k)), c, scene.marker(body), scene.marker(scene.ground())));
  }
};

/* Errors of attitude, angular velocity, angular acceleration and multipliers */
using Errors = std::array<double, 4>;

struct BodyRun {
  Body1    body;
  ExactTop    exact;
  SceneRun run;
  Vec      U, V, A;

  BodyRun(const Spinning &b, const std::string &options) : body(b), exact(b), run(body.scene, 1e3, options + " -ts_hhtdae_corrector_tolerance 1e-8 ")
  {
    Vec x;
    must(TSGetSolution(run.ts, &x));
    for (Vec *y : {&U, &V, &A}) must(VecDuplicate(x, y));
  }
  ~BodyRun()
  {
    for (Vec *y : {&U, &V, &A}) VecDestroy(y);
  }
  BodyRun(const BodyRun &) = delete;
  double t() const
  {
    PetscReal now;
    must(TSGetTime(run.ts, &now));
    return now;
  }
  void step(double h)
  {
    must(TSSetTimeStep(run.ts, h));
    must(TSStep(run.ts));
  }
  TSHHT3Statistics statistics() const
  {
    TSHHT3Statistics s;
    must(TSHHT3GetStatistics(run.ts, &s));
    return s;
  }
  /* By dense output, which has the step's values at its end */
  void widenBy(Errors &worst, double t)
  {
    std::vector<double> x;
    must(body.scene.sample(run.ts, t, x));
    must(TSHHT3Interpolate(run.ts, t, U, V, A));
    const Array  u = whole(U), v = whole(V), a = whole(A);
    const Motion m = exact.at(t);
    for (int k = 0; k < 3; k++)
      for (int c = 0; c < 3; c++) widen(worst[0], std::abs(x[3 * k + c] - m.A(c, k)));
    for (int c = 0; c < 3; c++) {
      widen(worst[1], std::abs(v[3 + c] - m.w(c)));
      widen(worst[2], std::abs(a[3 + c] - m.alpha(c)));
      if (body.b.joint()) widen(worst[3], std::min(std::abs(u[6 + c] - m.force(c)), std::abs(u[6 + c] + m.force(c))));
    }
  }
};

/* Largest errors in the second half of the run, with steps h, ratio h, h, ...; at their ends or within them */
Errors errorsAt(const Spinning &b, int k, double h, double ratio, bool within)
{
  BodyRun r(b, fixedSteps(.01) + text(" -ts_hhtdae_order %d ", k));
  Errors  worst  = {};
  bool    longer = false;
  for (double s = .001 * h; s < h; s *= 1.2) r.step(s); /* the errors of these steps of order two are negligible */
  while (r.t() < b.end - ratio * h) {
    const double begin = r.t(), step = longer ? ratio * h : h;
    longer = !longer;
    r.step(step);
    if (r.t() < .5 * b.end) continue;
    for (double x : within ? std::vector<double>{.2, .5, .7} : std::vector<double>{1}) r.widenBy(worst, x == 1 ? r.t() : begin + x * step);
  }
  EXPECT_GT(r.statistics().of_order[k], 20);
  return worst;
}

struct Case {
  const char     *name;
  const Spinning &body;
  double          h; /* of order 3 */
};
const Case cases[] = {{"heavy top", heavy_top, 1.2e-3}, {"tumbling top", tumbling_top, 2e-3}, {"satellite", satellite, 4e-3}};

} // namespace

/* A symmetric free body: A = exp([L] t/J1) exp([e3] (1 - J3/J1) s t) */
TEST(HigherOrderRotations, ReferenceAgainstClosedForm)
{
  const Spinning b{1, {2, 2, 3}, {0, 0, 0}, {0, 0, 0}, {1, .5, 4}, 3};
  ExactTop          exact(b);
  const Vector3  L = b.J.asDiagonal() * b.spin;
  const Matrix3  A = Eigen::AngleAxisd(b.end / 2 * L.norm(), L.normalized()).toRotationMatrix() * Eigen::AngleAxisd(-.5 * 4 * b.end, Vector3::UnitZ()).toRotationMatrix();
  EXPECT_LT((exact.at(b.end).A - A).norm(), 1e-13);
}

/* Orders of attitude, angular velocity, angular acceleration and multipliers, at constant steps and at h, 1.2 h, h,
   ...; in the latter case the change of h reduces the order of quantities that are differentiated twice */
TEST(HigherOrderRotations, ObservedOrders)
{
  for (const Case &c : cases)
    for (double ratio : {1., 1.2})
      for (int k : {3, 4, 5}) {
        const double h = c.h * (k - 2);
        const Errors coarse = errorsAt(c.body, k, h, ratio, false), fine = errorsAt(c.body, k, h / 2, ratio, false);
        MEASURED("%s, order %d, ratio %.1f: attitude %.2f, w %.2f, w' %.2f, lambda %.2f; errors %.1e, %.1e, %.1e, %.1e", c.name, k, ratio, order(coarse[0], fine[0]),
                 order(coarse[1], fine[1]), order(coarse[2], fine[2]), order(coarse[3], fine[3]), fine[0], fine[1], fine[2], fine[3]);
        for (int i = 0; i < (c.body.joint() ? 4 : 3); i++) {
          EXPECT_GE(order(coarse[i], fine[i]), i >= 2 && ratio > 1 ? k - 1.3 : k - .3) << c.name << ", order " << k << ", ratio " << ratio << ", " << i;
        }
      }
}

TEST(HigherOrderRotations, DenseOutput)
{
  for (int k : {3, 4, 5}) {
    const double h = 3e-3 * (k - 2);
    const Errors coarse = errorsAt(tumbling_top, k, h, 1, true), fine = errorsAt(tumbling_top, k, h / 2, 1, true);
    MEASURED("order %d within steps: attitude %.2f, w %.2f, w' %.2f, lambda %.2f", k, order(coarse[0], fine[0]), order(coarse[1], fine[1]), order(coarse[2], fine[2]), order(coarse[3], fine[3]));
    for (int i = 0; i < 4; i++) EXPECT_GE(order(coarse[i], fine[i]), k - .4) << k << " " << i;
  }
}

/* ---- several bodies, long runs, limits ---- */

namespace
{

/* Rods on ball joints; the first rod spins */
struct SpatialChain {
  Scene scene{PETSC_COMM_SELF};
  SpatialChain()
  {
    Marker last = scene.marker(scene.ground());
    scene.gravity({0, -9.81, 0});
    for (int k = 0; k < 3; k++) {
      RigidBody b;
      b.inertia          = Vector3(.01, 1. / 12, 1. / 12).asDiagonal();
      b.position         = {k + .5, 0, 0};
      b.angular_velocity = {k ? 0. : 20., 0, 0};
      const Body body    = scene.add("rod" + std::to_string(k), b);
      scene.add("ball" + std::to_string(k), Spherical{scene.marker(body, {-.5, 0, 0}), last});
      last = scene.marker(body, {.5, 0, 0});
    }
  }
};

struct Remembered {
  double t;
  Array  u, v;
  bool   operator==(const Remembered &o) const { return t == o.t && u == o.u && v == o.v; }
};

Remembered stateOf(TS ts)
{
  Vec       U, V;
  PetscReal t;
  must(TSGetTime(ts, &t));
  must(TS2GetSolution(ts, &U, &V));
  return {t, whole(U), whole(V)};
}

TSHHT3Statistics statisticsOf(TS ts)
{
  TSHHT3Statistics s;
  must(TSHHT3GetStatistics(ts, &s));
  return s;
}

} // namespace

/* Past attitudes are written to the checkpoint as they are in memory, relative to the reference attitude, which is
   written as well */
TEST(HigherOrderRotations, CheckpointsRepeatTheRun)
{
  const TemporaryFile file("order_rotations"), info("order_rotations.info");
  for (const char *which : {"4", "auto"})
    for (int at : {3, 6, 25}) {
      SCOPED_TRACE(std::string(which) + " " + std::to_string(at));
      const std::string  options = tolerance(1e-6) + " -ts_hhtdae_order " + which + " ";
      std::vector<Remembered> states;
      SpatialChain       a, b;
      SceneRun           plain(a.scene, 10, options);
      for (int k = 0; k < at; k++) must(TSStep(plain.ts));
      must(TSHHT3CheckpointSave(plain.ts, file.name.c_str()));
      for (int k = 0; k < 15; k++) {
        must(TSStep(plain.ts));
        states.push_back(stateOf(plain.ts));
      }
      SceneRun resumed(b.scene, 10, options + "-ts_hhtdae_resume " + file.name);
      Options  in("-ts_hhtdae_resume " + file.name);
      for (int k = 0; k < 15; k++) {
        must(TSStep(resumed.ts));
        EXPECT_TRUE(stateOf(resumed.ts) == states[k]) << k;
      }
      for (int k = 2; k <= 5; k++) EXPECT_EQ(statisticsOf(resumed.ts).of_order[k], statisticsOf(plain.ts).of_order[k]);
      if (at == 25) {
        EXPECT_GT(statisticsOf(plain.ts).of_order[4], 10);
      }
    }
}

/* Every step is made twice: when a step is rolled back, past attitudes must refer to the previous reference attitude again */
TEST(HigherOrderRotations, RollBack)
{
  SpatialChain chain;
  SceneRun     run(chain.scene, 10, fixedSteps(4e-3) + " -ts_hhtdae_corrector_tolerance 1e-6 -ts_hhtdae_order 5 ");
  for (int k = 0; k < 40; k++) {
    must(TSStep(run.ts));
    const Remembered first = stateOf(run.ts);
    must(TSRollBack(run.ts));
    must(TSSetTimeStep(run.ts, 4e-3));
    must(TSStep(run.ts));
    const Remembered second = stateOf(run.ts);
    EXPECT_NEAR(second.t, first.t, 1e-14);
    for (PetscInt i = 0; i < 18; i++) EXPECT_NEAR(second.u[i], first.u[i], 1e-9) << k << " " << i;
  }
  EXPECT_GT(statisticsOf(run.ts).of_order[5], 30);
}

/* Rotations too large for a rotation vector are not used as history: the order decreases with the rotation per step,
   and the attitude stays right. With variable steps the order is kept */
TEST(HigherOrderRotations, FastSpin)
{
  const Spinning rotor{1, {1, 1, 1}, {0, 0, 0}, {0, 0, 0}, {0, 0, 100}, 1};
  const struct {
    double turn;
    int    order;
  } cases[] = {{.3, 5}, {.7, 4}, {.9, 3}, {1.2, 2}, {2.5, 2}};
  for (const auto &c : cases) {
    BodyRun r(rotor, fixedSteps(.01) + " -ts_hhtdae_order 5 ");
    Errors  worst = {};
    for (int k = 0; k < 100; k++) {
      r.step(c.turn / 100);
      r.widenBy(worst, r.t());
      r.widenBy(worst, r.t() - .4 * c.turn / 100);
    }
    MEASURED("%g rad a step: order %d, error of the attitude %.1e", c.turn, c.order, worst[0]);
    EXPECT_GT(r.statistics().of_order[c.order], 90) << c.turn;
    EXPECT_LT(worst[0], 1e-10) << c.turn;
  }
  /* With variable steps the scene's limit of one radian per step determines h, and no step is rejected because of a
     higher order */
  for (const char *which : {"2", "5", "auto"}) {
    BodyRun r({1, {1, 2, 2.01}, {0, 0, 0}, {0, 0, 0}, {100, 1e-3, 0}, 1}, tolerance(1e-5) + text(" -ts_hhtdae_order %s ", which));
    while (r.t() < 2) must(TSStep(r.run.ts));
    const TSHHT3Statistics s = r.statistics();
    MEASURED("order %s: steps of order 2 to 5: %d, %d, %d, %d, the longest %g", which, (int)s.of_order[2], (int)s.of_order[3], (int)s.of_order[4], (int)s.of_order[5], (double)s.h_max);
    EXPECT_LE(s.h_max, 1.01e-2);
    EXPECT_LT(s.steps, 250);
  }
}

/* Fewer steps for the same error than with order two */
TEST(HigherOrderRotations, FewerSteps)
{
  double   error[2];
  PetscInt steps[2];
  for (int k = 0; k < 2; k++) {
    BodyRun r(tumbling_top, tolerance(1e-6) + (k ? " -ts_hhtdae_order auto " : ""));
    Errors  worst = {};
    while (r.t() < 4) {
      must(TSStep(r.run.ts));
      r.widenBy(worst, r.t());
    }
    error[k] = worst[0];
    steps[k] = r.statistics().steps;
  }
  MEASURED("order 2: %d steps, error %.1e; auto: %d steps, error %.1e", (int)steps[0], error[0], (int)steps[1], error[1]);
  EXPECT_LT(3 * steps[1], steps[0]);
  EXPECT_LT(error[1], 1.5 * error[0]);
}
