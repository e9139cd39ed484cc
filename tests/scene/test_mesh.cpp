/* Gears and racks whose force acts at the pitch point: derivatives, and the balance of every body from outputs alone */
#include "kernel_checks.h"
#include "scene/kernels/mesh.h"
#include "scene_output.h"
#include "scene_start.h"

using namespace hhtest;
using hhtdae::Frame; /* tumbling.h has a Frame, too */

namespace
{

template <bool Rack> typename MeshRow<Rack>::Data RandomMesh(hhtdae::Random &random, hhtdae::Frame<double> *f)
{
  using K = MeshRow<Rack>;
  typename K::Data d;
  d.axis = int(random(0, 2.999));
  for (int k = 0; k < 2; k++) {
    d.side[k] = {random.vector(2), random.rotation(), random.rotation()};
    while (std::abs(K::template onCarrier<double>(f[k], f[2]).R.col(0).dot(d.side[k].axes.col(2))) > .9) f[k].R = random.rotation();
    if (k < K::memory)
      d.memory[k] = PrincipalAngle<double>(K::template onCarrier<double>(f[k], f[2]), {d.side[k].bearing, d.side[k].axes}) +
                    kTurn * std::round(random(-3, 3)) + .1;
  }
  d.start = random(-1, 1);
  return d;
}

/* A load on a body: the reaction of a joint, on the body of its marker i, or the opposite on the other body */
struct Load {
  std::string force, moment, point; /* names of channels; moment may be empty; point: where the force acts */
  double      sign;
};

struct Machine {
  Scene                    scene;
  Marker                   space;
  std::vector<std::string> made;

  explicit Machine(Space kind = Space::Spatial) : scene(PETSC_COMM_SELF, kind), space(scene.marker(scene.ground())) {}

  /* channels of all three components in space axes: f.NAME, m.NAME; x.NAME of a marker; a.NAME, w'.NAME of a body */
  void reaction(const std::string &name, Element joint)
  {
    for (int c = 0; c < 3; c++) {
      scene.channel("f." + name + std::to_string(c), Measure::jointForce(joint, c, space));
      scene.channel("m." + name + std::to_string(c), Measure::jointMoment(joint, c, space));
    }
  }
  void point(const std::string &name, Marker m)
  {
    for (int c = 0; c < 3; c++) scene.channel("x." + name + std::to_string(c), Measure::displacement(m, c));
  }
  Body ball(const std::string &name, double mass, double inertia, const Vector3 &at)
  {
    RigidBody b;
    b.mass     = mass;
    b.inertia  = inertia * Matrix3::Identity();
    b.position = at;
    Body   body   = scene.add(name, b);
    Marker centre = scene.marker(body);
    point(name, centre);
    for (int c = 0; c < 3; c++) {
      scene.channel("a." + name + std::to_string(c), Measure::acceleration(centre, c));
      scene.channel("w." + name + std::to_string(c), Measure::angularAcceleration(centre, c));
    }
    return body;
  }
};

class Rows
{
public:
  Rows(const CSV &t, std::size_t row) : t_(t), row_(row) {}
  Vector3 operator()(const std::string &name) const
  {
    Vector3 x;
    for (int c = 0; c < 3; c++) x(c) = t_.column(name + std::to_string(c))[row_];
    return x;
  }

private:
  const CSV  &t_;
  std::size_t row_;
};

/* The laws of Newton and Euler for a body with the inertia of a sphere, about its centre of mass */
void ExpectBalance(const CSV &t, const std::string &body, double mass, double inertia, const Vector3 &gravity, const std::vector<Load> &loads)
{
  double force = 0, moment = 0, scale = 0;
  for (std::size_t k = 0; k < t.row.size(); k++) {
    const Rows r(t, k);
    Vector3    F = mass * (gravity - r("a." + body)), M = -inertia * r("w." + body);
    for (const Load &l : loads) {
      const Vector3 f = l.sign * r("f." + l.force), arm = r("x." + l.point) - r("x." + body);
      F += f;
      M += arm.cross(f);
      if (!l.moment.empty()) M += l.sign * r("m." + l.moment);
      scale = std::max(scale, f.norm());
    }
    widen(force, F.norm());
    widen(moment, M.norm());
  }
  MEASURED("balance of %-8s: force %.1e, moment %.1e; largest load %.1f", body.c_str(), force, moment, scale);
  EXPECT_LT(force, 1e-8 * scale) << body;
  EXPECT_LT(moment, 1e-8 * scale) << body;
  EXPECT_GT(scale, 1.) << body;
}

CSV run(Machine &m, double end, double dt, const std::string &options = tolerance(1e-6))
{
  TemporaryFile file("mesh.csv");
  SceneRun      r(m.scene, end, options + text(" -scene_dt %g -scene_csv ", dt) + file.name);
  must(r.solve());
  return CSV(file.text());
}

} // namespace

TEST(Mesh, Derivatives)
{
  CheckConstraint<MeshRow<false>>(RandomMesh<false>, 1);
  CheckConstraint<MeshRow<true>>(RandomMesh<true>, 2);
}

/* Sun and planet on a carrier that turns, under gravity, with a brake on the planet. The force between the teeth has a
   pressure angle of 20 degrees, passes through the pitch point and does not load the carrier */
TEST(Mesh, WheelsOnATurningCarrier)
{
  Machine       m;
  Scene        &s = m.scene;
  const Vector3 g{1, -9.81, 0.5};
  const double  pressure = 20 * M_PI / 180;
  const Body    carrier = m.ball("carrier", 3, 2, {0.5, 0.2, 0}), sun = m.ball("sun", 2, 0.4, {0, 0, 0}), planet = m.ball("planet", 1, 0.1, {0.9, 0, 0});
  const Marker  on_sun = s.marker(sun), on_planet = s.marker(planet), at_sun = s.markerAt(carrier, {0, 0, 0}), at_planet = s.markerAt(carrier, {0.9, 0, 0}),
               teeth = s.markerAt(carrier, {0.6, 0, 0}, axesAlong({std::sin(pressure), std::cos(pressure), 0}));
  const Element axle = s.add("axle", Revolute{s.markerAt(carrier, {0, 0, 0}), m.space}), b1 = s.add("b1", Revolute{on_sun, at_sun}),
                b2 = s.add("b2", Revolute{on_planet, at_planet}), mesh = s.add("mesh", GearMesh{on_sun, at_sun, on_planet, at_planet, teeth});
  s.gravity(g);
  s.add("brake", TorsionalSpringDamper{on_planet, at_planet, 0, 0.3, 0, 0});
  s.add("motor", TorsionalSpringDamper{on_sun, m.space, 0, 0, 0, 15});
  m.reaction("b1", b1);
  m.reaction("b2", b2);
  m.reaction("axle", axle);
  m.reaction("mesh", mesh);
  m.point("teeth", teeth);
  m.point("origin", m.space);
  s.channel("sun angle", Measure::angle(on_sun, at_sun));
  s.channel("planet angle", Measure::angle(on_planet, at_planet));
  s.channel("brake", Measure::angularVelocity(on_planet, 2, at_planet));
  s.channel("tooth", Measure::multiplier(mesh, 0));
  const CSV t = run(m, 2, 0.0123);
  /* brake and motor are couples about z, known from outputs */
  double most = 0;
  for (std::size_t k = 0; k < t.row.size(); k++) {
    const Rows    r(t, k);
    const double  brake = -0.3 * t.column("brake")[k];
    const Vector3 z(0, 0, 1), F = r("f.mesh"), P = r("x.teeth");
    const auto    about = [&](const std::string &b, const Vector3 &f, const Vector3 &p) { return Vector3((p - r("x." + b)).cross(f)); };
    const Vector3 sun_f = 2 * (g - r("a.sun")) + r("f.b1") + F, planet_f = 1 * (g - r("a.planet")) + r("f.b2") - F,
                  carrier_f = 3 * (g - r("a.carrier")) + r("f.axle") - r("f.b1") - r("f.b2");
    const Vector3 sun_m = -0.4 * r("w.sun") + r("m.b1") + about("sun", F, P) + 15 * z,
                  planet_m = -0.1 * r("w.planet") + r("m.b2") + about("planet", -F, P) + brake * z,
                  carrier_m = -2 * r("w.carrier") + r("m.axle") + about("carrier", r("f.axle"), r("x.origin")) - r("m.b1") +
                              about("carrier", -r("f.b1"), r("x.sun")) - r("m.b2") + about("carrier", -r("f.b2"), r("x.planet")) - brake * z;
    for (const Vector3 &x : {sun_f, planet_f, carrier_f, sun_m, planet_m, carrier_m}) widen(most, x.norm());
    EXPECT_NEAR(F.norm(), std::abs(t.column("tooth")[k]), 1e-9);
  }
  const Array  sun_angle = t.column("sun angle"), planet_angle = t.column("planet angle"), tooth = t.column("tooth");
  const double last = sun_angle.back();
  MEASURED("wheels on a carrier: %.1f and %.1f turns, force of the teeth %.2f N, largest imbalance %.1e", last / 2 / M_PI,
           planet_angle.back() / 2 / M_PI, tooth.back(), most);
  EXPECT_LT(most, 1e-4); /* loads of about 100 N, at samples between steps */
  EXPECT_GT(std::abs(last), 15.);
  EXPECT_NEAR(planet_angle.back(), -2 * last, 1e-8 * std::abs(last)); /* radii 0.6 and 0.3 */
  EXPECT_GT(std::abs(tooth.back()), 5.);
}

/* Bevel gears on the ground: axes along z and x, radii 0.5 and 0.2 */
TEST(Mesh, BevelGears)
{
  Machine      m;
  Scene       &s = m.scene;
  const Body   big = m.ball("big", 2, 0.4, {0, 0, 0}), small = m.ball("small", 1, 0.05, {0.6, 0, 0.2});
  const Marker on_big = s.marker(big), on_small = s.marker(small, {0, 0, 0}, axesAlong({1, 0, 0})), at_big = s.marker(s.ground()),
               at_small = s.marker(s.ground(), {0.6, 0, 0.2}, axesAlong({1, 0, 0})), teeth = s.marker(s.ground(), {0.5, 0, 0}, axesAlong({0, 1, 0}));
  const Element b1 = s.add("b1", Revolute{on_big, at_big}), b2 = s.add("b2", Revolute{on_small, at_small}),
                mesh = s.add("mesh", GearMesh{on_big, at_big, on_small, at_small, teeth});
  s.add("motor", RotationalMotion{on_big, at_big, TimeFunction::polynomial({0, 0, 2})}); /* begins at rest */
  for (const auto &[name, e] : {std::pair{"b1", b1}, {"b2", b2}, {"mesh", mesh}}) m.reaction(name, e);
  m.point("teeth", teeth);
  m.point("at", at_small);
  s.channel("big angle", Measure::angle(on_big, at_big));
  s.channel("small angle", Measure::angle(on_small, at_small));
  const CSV t = run(m, 3, 0.017);
  ExpectBalance(t, "small", 1, 0.05, Vector3::Zero(), {{"b2", "b2", "at", 1}, {"mesh", "", "teeth", -1}});
  const Array a = t.column("big angle"), b = t.column("small angle");
  EXPECT_NEAR(std::abs(b.back()), 2.5 * a.back(), 1e-7 * a.back());
  EXPECT_GT(a.back(), 15.);
  /* 4 rad/s^2 on the large wheel and 2.5 times that on the small one: F = 0.05 * 10 / 0.2 */
  EXPECT_NEAR(std::abs(t.column("f.mesh1").back()), 2.5, 1e-6);
  EXPECT_NEAR(std::abs(t.column("f.b21").back()), 2.5, 1e-6);
}

/* A rack on a guide with a pressure angle of 20 degrees: the guide carries the force component across its direction. A
   coupler produces the same motion without loading bearing and guide */
TEST(Mesh, RackAndPinion)
{
  const double pressure = 20 * M_PI / 180, r = 0.2;
  for (Space kind : {Space::Spatial, Space::Planar}) {
    const bool planar = kind == Space::Planar;
    CSV       *by_mesh = nullptr;
    std::vector<CSV> t;
    for (bool coupler : {false, true}) {
      Machine      m(kind);
      Scene       &s = m.scene;
      const Body   pinion = m.ball("pinion", 2, 0.1, {0, r, 0}), rack = m.ball("rack", 3, 1, {0.1, -0.05, 0});
      const Matrix3 way = planar ? Matrix3(Matrix3::Identity()) : axesAlong({1, 0, 0});
      Matrix3       e;
      e.col(0) = Vector3(std::cos(pressure), std::sin(pressure), 0);
      e.col(1) = Vector3(-std::sin(pressure), std::cos(pressure), 0);
      e.col(2) = Vector3(0, 0, 1);
      const Matrix3 along = planar ? e : axesAlong(e.col(0));
      const Marker  on_pinion = s.marker(pinion), at_pinion = s.marker(s.ground(), {0, r, 0}), on_rack = s.marker(rack, {0, 0, 0}, way),
                   at_rack = s.marker(s.ground(), {0, -0.05, 0}, way), teeth = s.marker(s.ground(), {0, 0, 0}, along);
      const Element bearing = s.add("bearing", Revolute{on_pinion, at_pinion}), guide = s.add("guide", Translational{on_rack, at_rack});
      const Element mesh = coupler ? s.add("mesh", RackAndPinion{on_pinion, at_pinion, on_rack, at_rack, r})
                                   : s.add("mesh", RackMesh{on_pinion, at_pinion, on_rack, at_rack, teeth});
      s.add("motor", TorsionalSpringDamper{on_pinion, at_pinion, 0, 0, 0, 1});
      s.add("load", SpringDamper{on_rack, s.marker(s.ground(), {-2, -0.05, 0}), 4, 0.5, 2.1});
      for (const auto &[name, element] : {std::pair{"bearing", bearing}, {"guide", guide}, {"mesh", mesh}}) m.reaction(name, element);
      m.point("teeth", teeth);
      s.channel("angle", Measure::angle(on_pinion, at_pinion));
      t.push_back(run(m, 3, 0.05));
      (void)by_mesh;
    }
    ASSERT_EQ(t[0].row.size(), t[1].row.size());
    double motion = 0, way = 0, across = 0, guided = 0, lever = 0;
    for (std::size_t k = 0; k < t[0].row.size(); k++) {
      const Rows    a(t[0], k), b(t[1], k);
      const Vector3 F = a("f.mesh");
      widen(motion, std::abs(t[0].column("angle")[k] - t[1].column("angle")[k]));
      widen(way, std::abs(t[0].column("angle")[k] * r - (a("x.rack")(0) - 0.1))); /* the pitch line is below the centre */
      widen(across, std::abs(F(1) - std::tan(pressure) * F(0)));
      widen(guided, std::abs(a("f.guide")(1) - F(1))); /* the rack does not move across the guide, so that the forces of guide and teeth balance */
      widen(lever, std::abs(a("f.bearing")(0) + F(0) - 2 * a("a.pinion")(0)) + std::abs(a("f.bearing")(1) + F(1) - 2 * a("a.pinion")(1)));
      EXPECT_NEAR(b("f.bearing").norm(), 0, 1e-7);
      EXPECT_NEAR(b("f.guide")(1), 0, 1e-7);
    }
    MEASURED("rack and pinion: motion as by the coupler to %.1e, angle and advance to %.1e; force of the teeth off its direction %.1e, guide %.1e, bearing %.1e; "
             "largest force %.2f",
             motion, way, across, guided, lever, Rows(t[0], 3)("f.mesh").norm());
    EXPECT_LT(motion, 1e-7);
    EXPECT_LT(way, 1e-8);
    EXPECT_LT(across, 1e-8);
    EXPECT_LT(guided, 1e-7);
    EXPECT_LT(lever, 1e-7);
    EXPECT_GT(Rows(t[0], 3)("f.mesh").norm(), 1.);
  }
}

TEST(Mesh, WhatCannotBe)
{
  const auto says = [](const std::string &part, auto describe) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody far;
    far.position   = {1, 0, 0};
    const Body   a = s.add("a", RigidBody()), b = s.add("b", far);
    const Marker i1 = s.marker(a), i2 = s.marker(b), j1 = s.marker(s.ground()), j2 = s.marker(s.ground(), {1, 0, 0});
    describe(s, a, b, i1, j1, i2, j2);
    ErrorTrap trap;
    EXPECT_NE(s.setUp(), 0);
    EXPECT_TRUE(trap.says(part)) << trap.message;
  };
  const auto up = axesAlong({0, 1, 0}), out = axesAlong({1, 0, 0});
  says("has no lever", [&](Scene &s, Body, Body, Marker i1, Marker j1, Marker i2, Marker j2) {
    s.add("m", GearMesh{i1, j1, i2, j2, s.marker(s.ground(), {0.5, 0, 0}, out)});
  });
  says("must be on the same carrier", [&](Scene &s, Body a, Body, Marker i1, Marker j1, Marker i2, Marker j2) {
    s.add("m", GearMesh{i1, j1, i2, j2, s.marker(a, {0.5, 0, 0}, up)});
  });
  says("are not parallel", [&](Scene &s, Body, Body b, Marker i1, Marker j1, Marker, Marker j2) {
    s.add("m", GearMesh{i1, j1, s.marker(b, {0, 0, 0}, axesAlong({0, 0.6, 0.8})), j2, s.marker(s.ground(), {0.5, 0, 0}, up)});
  });
  says("across its way", [&](Scene &s, Body, Body, Marker i1, Marker j1, Marker i2, Marker) {
    s.add("m", RackMesh{i1, j1, i2, s.marker(s.ground(), {1, 0, 0}, out), s.marker(s.ground(), {0.5, 0, 0}, up)});
  });
  says("marker `mesh` is not a marker", [&](Scene &s, Body, Body, Marker i1, Marker j1, Marker i2, Marker j2) {
    s.add("m", GearMesh{i1, j1, i2, j2, Marker{}});
  });
}

/* A marker off the axis on which its wheel turns would give another ratio than that of the wheels: 1.490 or 1.24 in place of 1.5, by where it is */
TEST(Mesh, WheelsTurnOnTheirAxes)
{
  const Vector3 P1(0, 0, 0), P2(.5, 0, 0), off(.05, .02, 0), along(0, 0, .3);
  const auto    says = [&](const Vector3 &i, const Vector3 &j) {
    Scene     s(PETSC_COMM_SELF);
    RigidBody b;
    const Body one = s.add("one", b);
    b.position     = P2;
    const Body   two = s.add("two", b);
    const Marker i1 = s.markerAt(one, P1), j1 = s.marker(s.ground(), P1), i2 = s.markerAt(two, P2), j2 = s.marker(s.ground(), P2);
    s.add("first", Revolute{i1, j1});
    s.add("second", Revolute{i2, j2});
    s.add("teeth", GearMesh{i == P1 ? i1 : s.markerAt(one, i), j == P1 ? j1 : s.marker(s.ground(), j), i2, j2, s.marker(s.ground(), {.3, 0, 0}, hhtest::axesAlong(Vector3(0, 1, 0)))});
    ErrorTrap error;
    return s.setUp() ? error.message : std::string();
  };
  EXPECT_EQ(says(P1, P1), "");
  EXPECT_EQ(says(P1 + along, P1), "");
  EXPECT_EQ(says(P1, P1 - along), "");
  for (const Vector3 &j : {P1, Vector3(P1 + along)}) {
    const std::string error = says(P1 + off, j);
    EXPECT_NE(error.find("gear mesh teeth: wheel 1: marker i1 is 0.0538516 off the axis, z of marker j1"), std::string::npos) << error;
  }
  const std::string error = says(P1 + off, P1 + off);
  EXPECT_NE(error.find("gear mesh teeth: wheel 1: z of marker j1 is not the axis of first, on which it turns"), std::string::npos) << error;
}
