/* Contacts that no end of a step would show: steps end within them (src/scene/look_ahead.h) */
#include "hhtdae/helpers.h"
#include "hhtdae/query.h"
#include "hhtdae/scene.h"
#include "scene/look_ahead.h"
#include "scene_output.h"
#include "scene_start.h"
#include <cmath>

using namespace hhtest;
using namespace hhtdae;

namespace
{

constexpr double infinity = std::numeric_limits<double>::infinity();

Vector3 VelocityAt(Scene &scene, Marker at, double end, double eps, double longest = 0)
{
  SceneRun run(scene, end, tolerance(eps) + (longest > 0 ? " -ts_adapt_dt_max " + std::to_string(longest) : std::string()));
  Snapshot now;
  Motion   m;
  must(run.solve());
  must(now.take(run.ts));
  must(now.motion(at, &m));
  return m.velocity;
}

} // namespace

/* Known gaps: a ball that is thrown above a ceiling and would come back within the step, one that passes another at 0.975 of the sum of the radii, or at 1.025 of it,
   a pin that dips below a surface once a turn, and a body that vibrates on another one */
TEST(LookAhead, Gaps)
{
  const Horizon once{4.69, 1e-4}, far{10, 1e-4};
  const double  up = LongestBeforeContact([](double t) { return 26.2 - 27.2 * t + 4.905 * t * t; }, {27.2, 9.81}, infinity, once);
  const double  touch = (27.2 - std::sqrt(27.2 * 27.2 - 4 * 4.905 * 26.2)) / 9.81;
  EXPECT_GT(up, touch);
  EXPECT_LT(up, 2 * 27.2 / 9.81 - touch);
  const auto   passing = [](double y) { return [y](double t) { return std::hypot(3 * t - 5, y) - 2; }; };
  const double half = std::sqrt(4 - 1.95 * 1.95) / 3, pass = LongestBeforeContact(passing(1.95), {3, 0}, 0.5, far);
  EXPECT_GT(pass, 5. / 3 - half);
  EXPECT_LT(pass, 5. / 3 + half);
  EXPECT_EQ(LongestBeforeContact(passing(2.05), {3, 0}, 0.5, far), 10);
  EXPECT_LT(LongestBeforeContact(passing(1.), {3, 0}, 0.5, far), 5. / 3); /* not beyond the depth of 0.5 */
  const auto   pin   = [](double t) { return 1 - 1.0005 * std::cos(10 * t + 1); };
  const double width = std::acos(1 / 1.0005) / 10, turn = LongestBeforeContact(pin, {10, 101}, infinity, Horizon{5, 1e-9});
  EXPECT_NEAR(turn, (2 * M_PI - 1) / 10, width);
  EXPECT_EQ(LongestBeforeContact([](double t) { return -1e-3 - 1e-4 * std::sin(100 * t); }, {1e-2, 1}, infinity, Horizon{0.01, 1e-9}), 0.01);
  EXPECT_EQ(LongestBeforeContact([](double t) { return 1e-9 - 1e-3 * t; }, {1e-3, 0}, infinity, Horizon{0.01, 1e-4}), 0.01); /* it turns back by 2e-5 */
}

/* A mass is thrown at 40 m/s, or at 100 m/s, against a ceiling, a stop or the end of a rope below the highest point of its flight. Steps in free flight grow until one is longer than the time
   beyond the ceiling. It comes down faster than without the contact. */
TEST(LookAhead, ABallUnderACeiling)
{
  for (int kind = 0; kind < 4; kind++)
    for (bool fast : {false, true})
      for (double eps : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
        Scene        s(PETSC_COMM_SELF);
        const double u = fast ? 100 : 40, ceiling = fast ? 450 : 70, end = fast ? 15 : 6, g = 9.81;
        RigidBody    b;
        b.velocity       = {0, 0, u};
        const Body   body = s.add("ball", b);
        const Marker i = s.marker(body), j = s.marker(s.ground()), down = s.marker(s.ground(), {0, 0, ceiling + 0.1}, hhtdae::axesAlong(Vector3(0, 0, -1)));
        ContactLaw   law;
        law.stiffness = 1e4;
        TranslationalStop stop{i, j};
        stop.upper = ceiling;
        stop.law   = law;
        stop.axis  = 2;
        DistanceStop rope{i, s.marker(s.ground(), {0, 0, -1})};
        rope.upper = ceiling + 1;
        rope.law   = law;
        if (kind == 0) s.add("ceiling", SpherePlane{i, down, 0.1, law});
        if (kind == 1) s.add("ceiling", EllipsoidPlane{i, down, {0.1, 0.2, 0.1}, law});
        if (kind == 2) s.add("ceiling", stop);
        if (kind == 3) s.add("ceiling", rope);
        s.gravity({0, 0, -g});
        const double touch = (u - std::sqrt(u * u - 2 * g * ceiling)) / g, after = -(u - g * touch) - g * (end - touch);
        EXPECT_NEAR(VelocityAt(s, i, end, eps)(2), after, 0.1 * u) << kind << " at " << eps;
      }
}

/* A rotor in the plane, at 10 rad/s, whose finger rubs on a plane once in each of its eight turns */
TEST(LookAhead, AFingerOnceATurn)
{
  for (double eps : {1e-6, 1e-7, 1e-8}) {
    double left[2];
    for (double longest : {0., 0.005}) {
      Scene     s(PETSC_COMM_SELF, Space::Planar);
      RigidBody b;
      b.inertia(2, 2)    = 0.02;
      b.angular_velocity = {0, 0, 10};
      const Body   rotor = s.add("rotor", b);
      const Marker i = s.marker(rotor, {0, -0.2, 0}), j = s.marker(s.ground(), {0.205, 0, 0}, hhtdae::axesAlong(Vector3::UnitZ(), Vector3::UnitY()));
      ContactLaw   law;
      law.stiffness = 1e4;
      law.friction  = 0.3;
      s.add("pin", Revolute{s.marker(rotor), s.marker(s.ground())});
      s.add("plane", SpherePlane{i, j, 0.01, law});
      left[longest > 0] = VelocityAt(s, i, 5, eps, longest).norm() / 0.2;
    }
    EXPECT_LT(left[1], 9);
    EXPECT_NEAR(left[0], left[1], 0.05 * left[1]) << eps;
  }
}

/* A rotor that a constant moment brakes meets a stop just before it would turn back by itself, and leaves it after 0.1 s. Without the stop its speed is 1 at the end. */
TEST(LookAhead, AStopBelowTheTurningPoint)
{
  for (double eps : {1e-4, 1e-6, 1e-7, 1e-8}) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody b;
    b.angular_velocity  = {0, 0, 1};
    const Body   rotor  = s.add("rotor", b);
    const Marker i      = s.marker(rotor), j = s.marker(s.ground()), rim = s.marker(rotor, {1, 0, 0});
    RotationalStop stop{i, j};
    stop.upper         = 0.45;
    stop.law.stiffness = 1e4;
    UserScalarForce brake{i, j, TimeFunction(-1.)};
    brake.rotational = true;
    s.add("pin", Revolute{i, j});
    s.add("stop", stop);
    s.add("brake", brake);
    EXPECT_NEAR(VelocityAt(s, rim, 2, eps).norm(), 1.5351, 0.03) << eps; /* Runge and Kutta, eight digits */
  }
}

/* The speed after an elastic impact for tolerances of a hundredth and a third of the penetration, from 24 distances: the figures of ContactLaw, hhtdae/forces.h */
TEST(LookAhead, ElasticImpactsByTolerance)
{
  const double stiffness = 1e7, penetration = std::pow(1.25 / stiffness, 0.4);
  for (double ratio : {100., 3.}) {
    double least = infinity, most = 0;
    for (int k = 0; k < 24; k++) {
      Scene     s(PETSC_COMM_SELF);
      RigidBody b;
      b.position     = {0, 0, 0.15 + 0.01 * k / 24};
      b.velocity     = {0, 0, -1};
      const Marker i = s.marker(s.add("ball", b));
      ContactLaw   law;
      law.stiffness = stiffness;
      s.add("floor", SpherePlane{i, s.marker(s.ground()), 0.1, law});
      const double after = VelocityAt(s, i, 0.2, penetration / ratio)(2);
      least              = std::min(least, after);
      most               = std::max(most, after);
    }
    MEASURED("tolerance 1/%g of the penetration: %.3f to %.3f", ratio, least, most);
    EXPECT_GT(least, ratio > 10 ? 0.94 : 0.4);
    EXPECT_LT(most, ratio > 10 ? 1.06 : 1.6);
  }
}
