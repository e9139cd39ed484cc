/* Scenes with user-defined variables, first-order states and user's forces, compared with independent solutions */
#include "hhtdae/scene.h"
#include "scene/runtime.h"
#include "support.h"
#include <array>

using namespace hhtdae;
using namespace hhtest;

namespace
{

/* Runs a scene to `end`; returns values of its variables and states by their handles */
class ExpressionRun
{
public:
  TS ts = nullptr;

  ExpressionRun(Scene &s, double end, const std::string &options) : s_(s)
  {
    must(s.createTS(&ts));
    must(TSSetMaxTime(ts, end));
    Options in(options);
    must(TSSetFromOptions(ts));
    must(s.solve(ts));
    Vec U;
    must(TS2GetSolution(ts, &U, nullptr));
    u = whole(U);
  }
  ~ExpressionRun() { TSDestroy(&ts); }
  ExpressionRun(const ExpressionRun &) = delete;
  double operator()(Variable v) const { return u[ModelOf(s_).number.variable[v.id]]; }
  double operator()(State x) const { return u[ModelOf(s_).number.state[x.id]]; }
  double position(Body b, int c) const { return u[ModelOf(s_).number.body[b.id] + c]; }

  Array u;

private:
  Scene &s_;
};

const std::string tight = " -ts_rtol 1e-10 -ts_atol 1e-10 -ts_hhtdae_corrector_tolerance 1e-6 ";

/* ---- a pendulum with a motor: tau = -kp (x - target) - kd theta', x a first-order filter of the angle ---- */

constexpr double mass = 1.5, length = .8, inertia = .3, gravity = 9.81, kp = 25, kd = 4, lag = .05, target = .7;

/* theta, theta', x by the classical Runge-Kutta method; theta is measured from the downward vertical */
std::array<double, 3> Reference(double end, int steps)
{
  using Y      = std::array<double, 3>;
  const auto f = [](const Y &y) -> Y {
    const double tau = -kp * (y[2] - target) - kd * y[1];
    return {y[1], (tau - mass * gravity * length * std::sin(y[0])) / (inertia + mass * length * length),
            (y[0] - y[2]) / lag};
  };
  const auto plus = [](const Y &y, double h, const Y &k) -> Y {
    return {y[0] + h * k[0], y[1] + h * k[1], y[2] + h * k[2]};
  };
  Y            y = {0, 0, 0};
  const double h = end / steps;
  for (int i = 0; i < steps; i++) {
    const Y a = f(y), b = f(plus(y, h / 2, a)), c = f(plus(y, h / 2, b)), d = f(plus(y, h, c));
    for (int k = 0; k < 3; k++) y[k] += h / 6 * (a[k] + 2 * b[k] + 2 * c[k] + d[k]);
  }
  return y;
}

struct MotorPendulum {
  Scene    scene;
  Variable angle, rate;
  State    filtered;
  Body     rod;
  Element  pin;

  explicit MotorPendulum(bool state, Space space = Space::Planar) : scene(PETSC_COMM_SELF, space)
  {
    scene.gravity({0, -gravity, 0});
    RigidBody b;
    b.mass           = mass;
    b.inertia        = inertia * Matrix3::Identity();
    b.position       = {0, -length, 0};
    b.rotation       = Eigen::AngleAxisd(-M_PI / 2, Vector3::UnitZ()).toRotationMatrix(); /* x along the rod */
    rod              = scene.add("rod", b);
    const Marker top = scene.marker(rod, {-length, 0, 0}), base = scene.marker(scene.ground(), {0, 0, 0}, b.rotation);
    pin      = scene.add("pin", Revolute{top, base});
    angle    = scene.variable("angle", Measure::angle(top, base));
    rate     = scene.variable("rate", Measure::angularVelocity(top, 2));
    filtered = scene.state("filtered",
                           Expression{{Measure::value(angle), Measure::value(State{0})},
                                      [](const Real *m) -> Real { return (m[0] - m[1]) / lag; }},
                           0);
    scene.add("motor",
              UserScalarForce{top, base,
                              Expression{{Measure::value(filtered), Measure::angularVelocity(top, 2, base)},
                                         [](const Real *m) -> Real { return -kp * (m[0] - target) - kd * m[1]; }},
                              true, state});
  }
};

} // namespace

TEST(Expressions, ControlledPendulum)
{
  const auto exact = Reference(.5, 20000);
  for (Space space : {Space::Planar, Space::Spatial})
    for (bool state : {false, true}) {
      MotorPendulum p(state, space);
      ExpressionRun      run(p.scene, .5, tight);
      MEASURED("%s, %s: angle off by %.1e, rate by %.1e, filter by %.1e", space == Space::Planar ? "planar" : "spatial",
               state ? "carried" : "eliminated", std::abs(run(p.angle) - exact[0]), std::abs(run(p.rate) - exact[1]),
               std::abs(run(p.filtered) - exact[2]));
      EXPECT_NEAR(run(p.angle), exact[0], 1e-6);
      EXPECT_NEAR(run(p.rate), exact[1], 1e-5);
      EXPECT_NEAR(run(p.filtered), exact[2], 1e-6);
    }
}

/* Everything that a state acts on is of second order */
TEST(Expressions, OrderOfTheControlledPendulum)
{
  const auto exact = Reference(.5, 20000);
  Array      error;
  for (int steps : {100, 200, 400}) {
    MotorPendulum p(false);
    ExpressionRun      run(p.scene, .5, fixedSteps(.5 / steps));
    error.push_back(std::hypot(run(p.angle) - exact[0], run(p.filtered) - exact[2]));
  }
  MEASURED("errors %.2e %.2e %.2e", error[0], error[1], error[2]);
  EXPECT_NEAR(order(error[1], error[2]), 2, .2);
}

/* Angles of expressions count full turns. */
TEST(Expressions, AnglesCountTurns)
{
  for (Space space : {Space::Planar, Space::Spatial}) {
    Scene     s(PETSC_COMM_SELF, space);
    RigidBody b;
    b.angular_velocity   = {0, 0, 3};
    const Body     wheel = s.add("wheel", b);
    const Variable angle = s.variable("angle", Measure::angle(s.marker(wheel), s.marker(s.ground())));
    ExpressionRun       run(s, 5, tight + " -ts_adapt_dt_max 0.25 ");
    EXPECT_NEAR(run(angle), 15, 1e-6);
  }
}

/* Reactions at rest as variables: the weight, its moment about a clamped end, and the same from multipliers */
TEST(Expressions, ReactionsOfACantilever)
{
  Scene s(PETSC_COMM_SELF);
  s.gravity({0, 0, -gravity});
  RigidBody b;
  b.mass                  = mass;
  b.position              = {length, 0, 0};
  const Body   beam       = s.add("beam", b);
  const Marker root       = s.marker(beam, {-length, 0, 0}),
               wall       = s.marker(s.ground(), {0, 0, 0}, Eigen::AngleAxisd(.4, Vector3::UnitY()).toRotationMatrix());
  const Matrix3         R = DataOf(s).markers[wall.id].R;
  const Element         clamp = s.add("clamp", Fixed{root, s.marker(s.ground())});
  std::vector<Variable> f, m, g;
  for (int c = 0; c < 3; c++) {
    f.push_back(s.variable("", Measure::jointForce(clamp, c)));
    m.push_back(s.variable("", Measure::jointMoment(clamp, c)));
    g.push_back(s.variable("", Measure::jointForce(clamp, c, wall)));
  }
  ExpressionRun      run(s, .01, tight);
  const Vector3 force(0, 0, mass * gravity), moment(0, -mass * gravity * length, 0), local = R.transpose() * force;
  for (int c = 0; c < 3; c++) {
    EXPECT_NEAR(run(f[c]), force(c), 1e-8);
    EXPECT_NEAR(run(m[c]), moment(c), 1e-8);
    EXPECT_NEAR(run(g[c]), local(c), 1e-8);
  }
}

namespace
{

/* A body in space under forces and moments in its own axes, with a reaction on another body, and a force that depends
   on accelerations */
struct Drifting {
  Scene                 scene{PETSC_COMM_SELF};
  Body                  a, b;
  Variable              acceleration, weighed;
  std::vector<Variable> momentum;

  explicit Drifting(bool state)
  {
    RigidBody r;
    r.inertia          = Vector3(.2, .3, .4).asDiagonal();
    r.position         = {0, 0, 0};
    r.angular_velocity = {.3, 1, .2};
    a                  = scene.add("a", r);
    r.mass             = 2;
    r.position         = {1, .5, 0};
    r.angular_velocity = {-.5, .1, .7};
    b                  = scene.add("b", r);
    UserForce f;
    f.i = f.frame = scene.marker(a, {.1, .2, 0});
    f.j           = scene.marker(b, {0, -.1, .3});
    f.state       = state;
    for (int c = 0; c < 3; c++) {
      f.force.push_back(
          Expression{{Measure::displacement(f.i, c, f.j, f.i), Measure::velocity(f.i, c, f.j, f.i), Measure::time()},
                     [](const Real *m) -> Real { return -5. * m[0] * (1. + .3 * sin(m[2])) - .2 * m[1]; }});
      f.moment.push_back(
          Expression{{Measure::angularVelocity(f.i, c, f.j, f.i)}, [](const Real *m) -> Real { return -.3 * m[0]; }});
    }
    scene.add("bond", f);
    acceleration = scene.variable("acceleration", Measure::acceleration(f.i, 0, f.j));
    for (int c = 0; c < 3; c++)
      momentum.push_back(
          scene.variable("", Expression{{Measure::velocity(scene.marker(a), c), Measure::velocity(scene.marker(b), c)},
                                        [](const Real *m) -> Real { return m[0] + 2. * m[1]; }}));
  }
};

} // namespace

/* A force has the same effect as a force state and when it is eliminated; action and reaction balance */
TEST(Expressions, CarriedAndEliminatedAgree)
{
  Drifting e(false), c(true);
  ExpressionRun eliminated(e.scene, 1.5, tight), carried(c.scene, 1.5, tight);
  for (int k = 0; k < 3; k++) {
    EXPECT_NEAR(eliminated.position(e.a, k), carried.position(c.a, k), 1e-7);
    EXPECT_NEAR(eliminated(e.momentum[k]), 0, 1e-8);
  }
  EXPECT_NEAR(eliminated(e.acceleration), carried(c.acceleration), 1e-5);
  EXPECT_GT(std::abs(eliminated.position(e.a, 0)), .05);
}

/* Added mass: a force -m_a x'' slows a falling body like an additional inertia m_a, in both forms of the method */
TEST(Expressions, AddedMass)
{
  for (const char *form : {"-ts_hhtdae_form paper", "-ts_hhtdae_form second_order"}) {
    Scene s(PETSC_COMM_SELF);
    s.gravity({0, -gravity, 0});
    PointMass p;
    p.mass             = 2;
    const Body    body = s.add("body", p);
    const Marker  i    = s.marker(body);
    UserForce     f;
    const Measure a = Measure::acceleration(i, 1);
    f.i             = i;
    f.force         = {Expression{{}, [](const Real *) -> Real { return 0.; }},
                       Expression{{a}, [](const Real *m) -> Real { return -3. * m[0]; }},
                       Expression{{}, [](const Real *) -> Real { return 0.; }}};
    s.add("added mass", f);
    const Variable v = s.variable("a", a);
    ExpressionRun       run(s, 1, tight + form);
    EXPECT_NEAR(run(v), -gravity * 2 / 5, 1e-8) << form;
    EXPECT_NEAR(run.position(body, 1), -gravity * .4 / 2, 1e-7) << form;
  }
}

/* A function that returns a value which is not finite makes the step fail, and -info names the function */
TEST(Expressions, FunctionsThatAreNotFiniteFailTheRun)
{
  Scene s(PETSC_COMM_SELF);
  s.gravity({0, -gravity, 0});
  const Marker i = s.marker(s.add("stone", PointMass()));
  s.variable("root", Expression{{Measure::displacement(i, 1)}, [](const Real *m) -> Real { return sqrt(m[0] + .5); }},
             .7);
  TS ts;
  must(s.createTS(&ts));
  must(TSSetMaxTime(ts, 10));
  {
    Options in(tight + " -ts_max_snes_failures 5 -ts_adapt_dt_max 0.01");
    must(TSSetFromOptions(ts));
  }
  Printed   text;
  ErrorTrap trap;
  must(PetscInfoAllow(PETSC_TRUE));
  const PetscErrorCode failed = s.solve(ts);
  must(PetscInfoAllow(PETSC_FALSE));
  TSConvergedReason reason;
  PetscReal         t;
  must(TSGetConvergedReason(ts, &reason));
  must(TSGetTime(ts, &t));
  EXPECT_TRUE(failed || reason < 0);
  EXPECT_NEAR(t, std::sqrt(2 * .5 / gravity), 1e-2);
  EXPECT_TRUE(text.says("variable root is ")) << trap.message;
  must(TSDestroy(&ts));
}
