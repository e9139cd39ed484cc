/* Channels between the ends of steps: reactions, accelerations and force states are as accurate as positions */
#include "scene_output.h"

using namespace hhtest;

namespace
{

struct Table {
  std::vector<std::string> name;
  std::vector<Array>       row; /* time first */
  Array                    u;   /* at the end of the run */
  TSHHT3Statistics         statistics;
};

/* A run with all channels of the scene recorded at intervals dt; dt = 0: at the ends of steps; dt < 0: not recorded */
Table record(Scene &scene, double end, double dt, const std::string &options)
{
  TemporaryFile file("samples.csv");
  SceneRun      run(scene, end, options + (dt < 0 ? std::string() : text(" -scene_dt %.17g -scene_csv ", dt) + file.name));
  must(run.solve());
  Table t;
  Vec   U;
  must(TSGetSolution(run.ts, &U));
  must(TSHHT3GetStatistics(run.ts, &t.statistics));
  t.u = whole(U);
  if (dt < 0) return t;
  const CSV csv(file.text());
  t.name = csv.name;
  t.row  = csv.row;
  return t;
}

/* Largest difference of column c from a reference sampled at the same times */
double difference(const Table &a, const Table &b, std::size_t c)
{
  double d = 0;
  for (std::size_t k = 1; k < a.row.size(); k++) widen(d, std::abs(a.row[k][c] - b.row[k][c]));
  return d;
}

} // namespace

/* A slider driven by gravity alone has q''' = 0, so that a step may be as long as the run; the lever arm of its weight
   grows like t^2 */
TEST(SceneSamples, SliderInOneStep)
{
  for (const char *form : {"", " -ts_hhtdae_form paper"}) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody b;
    Matrix3   along;
    along << 0, 0, 1, 1, 0, 0, 0, 1, 0; /* z along x */
    b.mass            = 2;
    b.position        = {1, 0, 0};
    const Marker foot = s.marker(s.ground(), {0, 0, 0}, along), space = s.marker(s.ground());
    const Body   body   = s.add("slider", b);
    const Element joint = s.add("guide", Translational{foot, s.marker(body, {0, 0, 0}, along)});
    s.gravity({3, -9, 0});
    s.channel("moment", Measure::jointMoment(joint, 2, space), "N m");
    s.channel("x", Measure::displacement(s.marker(body), 0), "m");
    const Table t = record(s, 4.5, 0.75, std::string(" -ts_adapt_type none -ts_dt 4.5") + form);
    ASSERT_EQ(t.statistics.steps, 1);
    ASSERT_EQ(t.row.size(), 7u);
    for (const Array &r : t.row) {
      const double x = 1 + 1.5 * r[0] * r[0];
      EXPECT_NEAR(r[2], x, 1e-9 * x) << r[0];
      EXPECT_NEAR(r[1], -18 * x, 1e-9 * 18 * x) << r[0];
    }
  }
}

/* Samples are of second order, like the values at the ends of steps: reactions, accelerations, force states, a variable */
TEST(SceneSamples, OrderBetweenSteps)
{
  std::vector<Table> t;
  for (double h : {0.004, 0.002, 0.001, 0.00025}) {
    Rods          rods(2);
    Scene        &s = rods.scene;
    SpringDamper  spring{rods.tip[1], s.marker(s.ground(), {1, 0.5, 0}), 30, 0.5, 1};
    spring.state        = true;
    const Element  pull = s.add("pull", spring);
    const Variable v    = s.variable("v", Expression({Measure::jointForce(rods.pin[0], 1), Measure::force(pull, 0)},
                                                     [](const Real *m) -> Real { return 0.1 * m[0] * m[0] + 2. * m[1]; }));
    for (int c = 0; c < 2; c++) s.channel("pin0" + std::to_string(c), Measure::jointForce(rods.pin[0], c), "N");
    s.channel("pin11", Measure::jointForce(rods.pin[1], 1), "N");
    s.channel("multiplier", Measure::multiplier(rods.pin[1], 0), "N");
    s.channel("a", Measure::acceleration(rods.tip[1], 1), "m/s^2");
    s.channel("alpha", Measure::angularAcceleration(rods.tip[1], 2), "rad/s^2");
    s.channel("pull", Measure::force(pull, 0), "N");
    s.channel("v", Measure::value(v));
    t.push_back(record(s, 0.6, 0.0251327, fixedSteps(h) + "-ts_exact_final_time stepover"));
  }
  for (std::size_t c = 1; c < t[0].name.size(); c++) {
    double e[3];
    for (int k = 0; k < 3; k++) e[k] = difference(t[k], t[3], c);
    MEASURED("%-12s errors of samples at h = 4, 2, 1 ms: %.2e %.2e %.2e, order %.2f %.2f", t[0].name[c].c_str(), e[0],
             e[1], e[2], order(e[0], e[1]), order(e[1], e[2]));
    EXPECT_GT(order(e[0], e[1]), 1.85) << t[0].name[c];
    EXPECT_GT(order(e[1], e[2]), 1.85) << t[0].name[c]; /* the reference has h = 0.25 ms, so that 2.1 is the best observable order */
  }
}

namespace
{

/* A rod on a motor that falls on a ball, with friction in the contact, a stop that depends on a reaction, and a
   nonlinear spring */
struct Clatter {
  Rods    rods{3};
  Element stop;

  Clatter()
  {
    Scene &s = rods.scene;
    s.add("motor", RotationalMotion{s.marker(rods.body[0]), s.marker(s.ground()),
                                    TimeFunction::harmonic(0.4, 9, M_PI / 2, -0.4), MotionOf::Displacement});
    SphereSphere ball{rods.tip[2], s.marker(s.ground(), {2.2, -0.9, 0}), 0.2, 0.3, {}, false};
    ball.law.stiffness = 1e4;
    ball.law.friction  = 0.3;
    s.add("ball", ball);
    s.add("friction", JointFriction{rods.pin[1], 0.2, 0.05, 1e-2});
    const Variable v = s.variable("v", Expression({Measure::jointForce(rods.pin[1], 1), Measure::acceleration(rods.tip[2], 1)},
                                                  [](const Real *m) -> Real { return m[0] + 0.1 * m[1]; }));
    s.state("x", Expression({Measure::value(v)}, [](const Real *m) -> Real { return sin(m[0]); }), 0);
    const Marker space = s.marker(s.ground());
    for (int c = 0; c < 3; c++) {
      s.channel("f0" + std::to_string(c), Measure::jointForce(rods.pin[0], c, space), "N");
      s.channel("f2" + std::to_string(c), Measure::jointForce(rods.pin[2], c, space), "N");
      s.channel("a" + std::to_string(c), Measure::acceleration(rods.centre[1], c));
      s.channel("g" + std::to_string(c), Measure::jointForce(rods.pin[1], c, space), "N");
    }
    s.channel("v", Measure::value(v));
    s.channel("angle", Measure::angle(rods.tip[2], rods.tip[0]));
  }
};

} // namespace

/* The run is the same to the last bit with and without samples */
TEST(SceneSamples, LeaveTheRunAlone)
{
  for (const char *options : {"", "-ts_hhtdae_form paper", "-scene_redundant keep -ts_adapt_type none -ts_dt 2e-3"}) {
    Clatter     with, without;
    const auto  o = tolerance(1e-5) + options;
    const Table a = record(with.rods.scene, 1.2, 1e-3, o), b = record(without.rods.scene, 1.2, -1, o);
    EXPECT_EQ(a.u, b.u) << options;
    EXPECT_EQ(a.statistics.newton, b.statistics.newton);
    EXPECT_EQ(a.statistics.residuals, b.statistics.residuals);
    EXPECT_EQ(a.statistics.factorizations, b.statistics.factorizations);
  }
}

/* Newton's law for the middle rod at every sample of a run with contacts, from outputs alone; no sample exceeds the
   values at the ends of steps */
TEST(SceneSamples, ForcesBalanceThroughContacts)
{
  for (const char *options : {"", "-ts_hhtdae_form paper"}) {
    Clatter     fine, steps;
    const Table t = record(fine.rods.scene, 1.2, 7.77e-4, tolerance(1e-4) + options),
                e = record(steps.rods.scene, 1.2, 0, tolerance(1e-4) + options);
    const auto  column = [&](const std::string &what) {
      for (std::size_t c = 0; c < t.name.size(); c++)
        if (t.name[c].rfind(what, 0) == 0) return c;
      throw std::runtime_error(what);
    };
    double imbalance = 0, largest = 0, own = 0;
    for (std::size_t k = 1; k + 1 < t.row.size(); k++) /* the first and the last sample are ends of steps */
      for (int c = 0; c < 2; c++) {
        const std::string axis = std::to_string(c);
        const Array      &r    = t.row[k];
        /* loads on rod 1: the pin to rod 0 acts on rod 1, the pin to rod 2 acts on rod 2 */
        const double force = r[column("g" + axis)] - r[column("f2" + axis)] - (c == 1 ? 9.81 : 0);
        widen(imbalance, std::abs(force - r[column("a" + axis)]));
        widen(largest, std::abs(r[column("g" + axis)]));
      }
    for (const Array &r : e.row)
      for (int c = 0; c < 2; c++) widen(own, std::abs(r[column("g" + std::to_string(c))]));
    MEASURED("contacts %-24s: %d samples, imbalance %.1e N, largest reaction %.1f N, at the steps %.1f N", options,
             (int)t.row.size(), imbalance, largest, own);
    EXPECT_LT(imbalance, 1e-8 * largest);
    EXPECT_LT(largest, 1.2 * own);
  }
}

/* Channels of positions alone need no linear solves */
TEST(SceneSamples, OnlyWhereTheyAreNeeded)
{
  Rods rods(2);
  rods.scene.channel("y", Measure::displacement(rods.tip[1], 1), "m");
  rods.scene.channel("spring", Measure::force(rods.scene.add("spring", SpringDamper{rods.tip[1], rods.scene.marker(rods.scene.ground()), 3, 1}), 0));
  PetscLogEvent      sample;
  PetscEventPerfInfo before, after;
  must(PetscLogDefaultBegin());
  must(TSHHT3Initialize());
  must(PetscLogEventGetId("HHT3Sample", &sample));
  must(PetscLogEventGetPerfInfo(PETSC_DETERMINE, sample, &before));
  record(rods.scene, 0.2, 1e-3, tolerance(1e-5));
  must(PetscLogEventGetPerfInfo(PETSC_DETERMINE, sample, &after));
  EXPECT_EQ(after.count, before.count);
  Rods other(2);
  other.scene.channel("f", Measure::jointForce(other.pin[0], 1), "N");
  record(other.scene, 0.2, 1e-3, tolerance(1e-5));
  must(PetscLogEventGetPerfInfo(PETSC_DETERMINE, sample, &after));
  EXPECT_GT(after.count, before.count + 100);
}

/* With another TS type samples are possible only at the ends of steps */
TEST(SceneSamples, OfOtherTypes)
{
  Scene     s(PETSC_COMM_SELF);
  PointMass b;
  s.gravity({0, 0, -2});
  s.channel("z", Measure::displacement(s.marker(s.add("ball", b)), 2));
  SceneRun            run(s, 1, "-ts_type alpha2 -ts_dt 0.1 -ts_adapt_type none");
  std::vector<double> x;
  must(run.solve());
  must(s.sample(run.ts, 1, x));
  EXPECT_NEAR(x[0], -1, 1e-6);
  ErrorTrap trap;
  EXPECT_NE(s.sample(run.ts, 0.95, x), 0);
  EXPECT_TRUE(trap.says("TS type alpha2 gives the state at the end of its last step alone, which is t = 1")) << trap.message;
}
