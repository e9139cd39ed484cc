/* Measures as arguments of expressions: values, exact derivatives in the Jacobian of a scene, refused input */
#include "scene_jacobian.h"

using namespace hhtdae;
using namespace hhtest;

namespace
{

Matrix3 turned(double x, double y, double z)
{
  return (Eigen::AngleAxisd(x, Vector3::UnitX()) * Eigen::AngleAxisd(y, Vector3::UnitY()) *
          Eigen::AngleAxisd(z, Vector3::UnitZ()))
      .toRotationMatrix();
}

/* Two bodies in joints and a point mass, with markers off their centres */
struct Mechanism {
  Scene                 scene;
  Body                  a, b, p;
  Marker                on_ground, on_a, on_b, on_p, hinge_a, hinge_b;
  Element               ball, hinge, spring;
  std::vector<Variable> variables;

  explicit Mechanism(Space space = Space::Spatial) : scene(PETSC_COMM_SELF, space)
  {
    const bool flat         = space == Space::Planar;
    scene.start().assembly  = Assembly::Off; /* assembly is off, since any state may be used */
    scene.start().redundant = Redundant::Keep;
    RigidBody one;
    one.mass = 2;
    one.inertia << .4, .02, .01, .02, .5, .03, .01, .03, .6;
    one.position = {.3, .2, flat ? 0 : -.1};
    one.rotation = flat ? turned(0, 0, .4) : turned(.4, .9, -.3);
    a            = scene.add("a", one);
    one.position = {1.2, -.3, flat ? 0 : .4};
    one.rotation = flat ? turned(0, 0, -1) : turned(1.1, -.5, .7);
    b            = scene.add("b", one);
    PointMass point;
    point.position  = {-.5, .8, flat ? 0 : .6};
    p               = scene.add("p", point);
    const auto at   = [&](double x, double y, double z) { return Vector3(x, y, flat ? 0 : z); };
    const auto axes = [&](double x, double y, double z) { return flat ? turned(0, 0, z) : turned(x, y, z); };
    on_ground       = scene.marker(scene.ground(), at(.1, -.2, .3), axes(.2, .1, .5));
    on_a            = scene.marker(a, at(.2, .3, -.1), axes(-.3, .6, .2));
    on_b            = scene.marker(b, at(-.1, .2, .25), axes(.5, -.2, .9));
    on_p            = scene.marker(p);
    hinge_a         = scene.marker(a, at(.5, 0, .1), axes(.1, .2, .3));
    hinge_b         = scene.marker(b, at(-.5, .1, 0), axes(.3, -.1, .2));
    hinge           = scene.add("hinge", Revolute{hinge_b, hinge_a});
    if (flat)
      ball = scene.add("ball", Revolute{on_a, on_ground});
    else
      ball = scene.add("ball", Spherical{on_a, on_ground});
    SpringDamper s{on_b, on_p, 3, .5, .7};
    s.state = true;
    spring  = scene.add("spring", s);
  }

  Variable add(const Expression &e)
  {
    variables.push_back(scene.variable("", e, .1));
    return variables.back();
  }

  std::vector<Measure> ofMarkers() const
  {
    std::vector<Measure> all;
    using Maker = Measure (*)(Marker, int, Marker, Marker);
    for (Maker make : {Maker(Measure::displacement), Maker(Measure::velocity), Maker(Measure::acceleration),
                       Maker(Measure::angularVelocity), Maker(Measure::angularAcceleration)}) {
      all.push_back(make(on_b, 0, on_a, on_a));
      all.push_back(make(on_a, 1, on_b, on_ground));
      all.push_back(make(on_b, 0, on_p, hinge_a));
      all.push_back(make(hinge_a, 1, {}, {}));
      all.push_back(make(on_a, 2, {}, on_b));
    }
    all.push_back(Measure::distance(on_b, on_p));
    all.push_back(Measure::distance(on_a, on_b));
    all.push_back(Measure::rate(on_p, on_a));
    all.push_back(Measure::rate(on_b, on_ground));
    all.push_back(Measure::angle(hinge_b, hinge_a));
    all.push_back(Measure::angle(on_b, on_ground));
    return all;
  }
};

double worstJacobian(Scene &s)
{
  double worst = 0;
  must(s.setUp());
  for (unsigned seed : {1, 2, 3})
    for (Rotations rotations : all_rotations) {
      AnyState state(s, seed, 0.4, rotations);
      widen(worst, state.jacobianError(.7, 1.3));
      if (rotations == Rotations::Local) widen(worst, state.jacobianError(.7, 1.3, .4));
      widen(worst, state.jacobianError(0, 0));
    }
  MEASURED("Jacobian against differences: %.1e", worst);
  return worst;
}

class Both : public testing::TestWithParam<Space>
{
};

} // namespace

INSTANTIATE_TEST_SUITE_P(Measures, Both, testing::Values(Space::Spatial, Space::Planar),
                         [](const auto &p) { return p.param == Space::Planar ? "planar" : "spatial"; });

TEST_P(Both, DerivativesOfMarkers)
{
  Mechanism m(GetParam());
  for (const Measure &x : m.ofMarkers()) m.add(x);
  EXPECT_LT(worstJacobian(m.scene), 1e-7);
}

TEST_P(Both, DerivativesOfScalarsAndJoints)
{
  Mechanism      m(GetParam());
  const State    x = m.scene.state("x",
                                   Expression{{Measure::distance(m.on_a, m.on_p), Measure::time()},
                                           [](const Real *k) -> Real { return k[0] * cos(k[1]); }},
                                   .2);
  const Variable v = m.add(Expression{{Measure::value(x), Measure::multiplier(m.hinge, 1)},
                                      [](const Real *k) -> Real { return k[0] * k[1]; }});
  m.add(Expression{{Measure::value(v), Measure::force(m.spring, 0), Measure::multiplier(m.ball, 0)},
                   [](const Real *k) -> Real { return 1. / (2. + k[0] * k[0]) + k[1] * sin(k[2]); }});
  m.add(
      Expression{{Measure::time(), Measure::value(Variable{(PetscInt)DataOf(m.scene).variables.size()})}, /* a variable that depends on itself */
                 [](const Real *k) -> Real { return k[0] + .1 * k[1] * k[1]; }});
  for (int c = 0; c < 3; c++)
    for (Marker frame : {Marker{}, m.on_ground, m.on_b})
      for (Element e : {m.ball, m.hinge}) {
        m.add(Measure::jointForce(e, c, frame));
        m.add(Measure::jointMoment(e, c, frame));
      }
  EXPECT_LT(worstJacobian(m.scene), 1e-7);
}

TEST(Measures, DerivativesOfOtherReactions)
{
  Mechanism     m;
  const Marker  edge  = m.scene.marker(m.b, {.1, 0, .3}, turned(.3, .2, .1));
  const Element knife = m.scene.add("knife", KnifeEdge{edge, m.on_ground}),
                drive = m.scene.add("drive", RotationalMotion{m.hinge_b, m.hinge_a, TimeFunction::polynomial({0, 1})}),
                gear  = m.scene.add("gear", Gear{m.hinge_b, m.hinge_a, m.on_a, m.on_ground, 2.});
  for (Element e : {knife, drive, gear})
    for (int c = 0; c < 3; c++) {
      m.add(Measure::jointForce(e, c));
      m.add(Measure::jointMoment(e, c, m.on_a));
    }
  EXPECT_LT(worstJacobian(m.scene), 1e-7);
}

/* A door on two hinges with five redundant rows: the multipliers of dropped rows are zero, and the remaining reactions
   carry the door */
TEST(Measures, JointsWithRedundantRows)
{
  Scene     s(PETSC_COMM_SELF);
  RigidBody d;
  d.mass                     = 3;
  d.position                 = {.4, 0, 1};
  const Body            door = s.add("door", d);
  std::vector<Variable> force, all;
  for (double z : {.3, 1.7}) {
    const Element hinge = s.add("", Revolute{s.markerAt(door, {0, 0, z}), s.marker(s.ground(), {0, 0, z})});
    for (int c = 0; c < 3; c++) {
      force.push_back(s.variable("", Measure::jointForce(hinge, c)));
      all.push_back(s.variable("", Measure::jointMoment(hinge, c)));
    }
    for (int r = 0; r < 5; r++) all.push_back(s.variable("", Measure::multiplier(hinge, r)));
  }
  EXPECT_LT(worstJacobian(s), 1e-7);
  AnyState state(s, 5);
  IS       is = state.R.roles[TSHHT3_HOLONOMIC];
  PetscInt n;
  must(ISGetSize(is, &n));
  EXPECT_EQ(n, 5);
  int      zeros = 0;
  for (Variable v : all) zeros += state.definition(v) == 0;
  EXPECT_GE(zeros, 5);
  EXPECT_LT(zeros, (int)all.size());
  /* the hinges are the only forces on the door */
  const Array    f     = state.residual();
  const PetscInt first = ModelOf(s).number.body[door.id];
  for (int c = 0; c < 3; c++) {
    const double sum = state.definition(force[c]) + state.definition(force[3 + c]);
    EXPECT_NEAR(sum, 3 * state.get(state.A, first + c) - f[first + c], 1e-12);
  }
}

TEST_P(Both, DerivativesOfUserForces)
{
  for (bool state : {false, true}) {
    Mechanism   m(GetParam());
    const auto  product    = [](const Real *k) -> Real { return k[0] * sin(k[1]) + .3 * k[0] * k[0]; };
    const State x          = m.scene.state("x", Measure::distance(m.on_a, m.on_p), .2);
    const auto  expression = [&](int c) {
      return Expression{
          {Measure::displacement(m.on_b, c, m.on_a, m.on_a), Measure::velocity(m.on_p, (c + 1) % 3, m.hinge_b)},
          product};
    };
    UserForce f;
    f.i = m.on_b, f.j = m.on_a, f.frame = m.hinge_a, f.state = state;
    for (int c = 0; c < 3; c++) {
      f.force.push_back(expression(c));
      f.moment.push_back(Expression{{Measure::angularVelocity(m.on_a, c), Measure::multiplier(m.hinge, 0)}, product});
    }
    const Element six = m.scene.add("six", f);
    f.j = f.frame = {};
    f.force.clear();
    m.scene.add("moment", f);
    f.moment.clear();
    for (int c = 0; c < 3; c++)
      f.force.push_back(Expression{{Measure::value(x), Measure::rate(m.on_b, m.on_p)}, product});
    f.i = m.on_p;
    m.scene.add("force", f);
    m.scene.add("along", UserScalarForce{m.on_p, m.on_b,
                                         Expression{{Measure::distance(m.on_p, m.on_b), Measure::time()}, product},
                                         false, state});
    m.scene.add("about", UserScalarForce{
                             m.hinge_b, m.hinge_a,
                             Expression{{Measure::angle(m.hinge_b, m.hinge_a), Measure::force(m.spring, 0)}, product},
                             true, state});
    if (state) m.add(Measure::force(six, 4));
    EXPECT_LT(worstJacobian(m.scene), 1e-7);
  }
}

/* A force that depends on q'' becomes a force state even if this was not requested, so that the equations of motion
   stay affine in q'' */
TEST(Measures, ForcesOfAccelerationsAreCarried)
{
  Mechanism     m;
  const Element e =
      m.scene.add("added mass", UserScalarForce{m.on_p, m.on_b,
                                                Expression{{Measure::acceleration(m.on_p, 0)},
                                                           [](const Real *k) -> Real { return -.3 * k[0] * k[0]; }}});
  m.add(Measure::force(e, 0));
  EXPECT_LT(worstJacobian(m.scene), 1e-7);
  AnyState state(m.scene, 4);
  IS       is = state.R.roles[TSHHT3_FORCE];
  PetscInt n;
  must(ISGetSize(is, &n));
  EXPECT_EQ(n, 2);
}

/* Rates of displacements, velocities, distances and angles are their time derivatives along any motion */
TEST_P(Both, RatesOfMeasures)
{
  Mechanism             m(GetParam());
  std::vector<Variable> x, dx;
  const auto            pair = [&](const Measure &f, const Measure &rate) {
    x.push_back(m.add(f));
    dx.push_back(m.add(rate));
  };
  for (int c = 0; c < 3; c++)
    for (Marker i : {m.on_a, m.on_b, m.on_p})
      for (Marker j : {Marker{}, m.on_ground, m.hinge_b}) {
        pair(Measure::displacement(i, c, j), Measure::velocity(i, c, j));
        pair(Measure::velocity(i, c, j, m.on_ground), Measure::acceleration(i, c, j, m.on_ground));
        pair(Measure::angularVelocity(i, c, j), Measure::angularAcceleration(i, c, j));
      }
  pair(Measure::distance(m.on_a, m.on_p), Measure::rate(m.on_a, m.on_p));
  pair(Measure::distance(m.on_b, m.on_ground), Measure::rate(m.on_b, m.on_ground));
  if (GetParam() == Space::Planar) pair(Measure::angle(m.on_a, m.on_b), Measure::angularVelocity(m.on_a, 2, m.on_b));
  must(m.scene.setUp());
  const double d     = 1e-5;
  double       worst = 0;
  for (std::size_t k = 0; k < x.size(); k++) {
    AnyState     state(m.scene, 7);
    state.refer();
    const double rate = state.definition(dx[k]);
    state.advance(d);
    const double after = state.definition(x[k]);
    AnyState     back(m.scene, 7);
    back.refer();
    back.advance(-d);
    const double before = back.definition(x[k]), difference = (after - before) / (2 * d);
    widen(worst, std::abs(difference - rate) / std::max(1., std::abs(rate)));
  }
  MEASURED("rates of measures against differences: %.1e", worst);
  EXPECT_LT(worst, 1e-7);
}

/* Components in a frame are those of the vector in space rotated into the frame's axes; angles are those between the
   markers' axes */
TEST(Measures, ComponentsAndAngles)
{
  Mechanism             m;
  std::vector<Variable> space, local;
  for (int c = 0; c < 3; c++) {
    space.push_back(m.add(Measure::acceleration(m.on_b, c, m.on_a)));
    local.push_back(m.add(Measure::acceleration(m.on_b, c, m.on_a, m.on_ground)));
  }
  const Variable angle = m.add(Measure::angle(m.hinge_b, m.on_ground));
  must(m.scene.setUp());
  AnyState      state(m.scene, 11, 0);
  const Matrix3 R = turned(.2, .1, .5);
  Vector3       a, b;
  for (int c = 0; c < 3; c++) {
    a(c) = state.definition(space[c]);
    b(c) = state.definition(local[c]);
  }
  EXPECT_LT((b - R.transpose() * a).norm(), 1e-12 * a.norm());
  const Vector3 x = turned(1.1, -.5, .7) * turned(.3, -.1, .2).col(0);
  EXPECT_NEAR(state.definition(angle), std::atan2(x.dot(R.col(1)), x.dot(R.col(0))), 1e-12);
}

namespace
{

/* The error message of setUp() */
template <class F> std::string refusal(F describe)
{
  Mechanism m;
  describe(m);
  ErrorTrap trap;
  EXPECT_NE((int)m.scene.setUp(), 0);
  return trap.message;
}

} // namespace

TEST(Measures, RefusedByName)
{
  const auto    one  = [](const Real *k) -> Real { return k[0]; };
  const Measure time = Measure::time();
  const auto    says = [](const std::string &text, const std::vector<std::string> &parts) {
    for (const std::string &p : parts) EXPECT_NE(text.find(p), std::string::npos) << text;
  };
  says(refusal([&](Mechanism &m) {
         m.scene.variable("speed", Expression{std::vector<Measure>(17, time), one});
       }),
       {"variable speed", "17 arguments"});
  says(refusal([&](Mechanism &m) {
         m.scene.state("integral", Expression({time}, {}), 0);
       }),
       {"state integral", "empty"});
  says(refusal([&](Mechanism &m) {
         m.scene.variable("d", Measure::distance(m.on_a, Marker{99}));
         m.scene.variable("f", Measure::displacement(m.on_a, 3));
       }),
       {"variable d, argument 1 (distance)", "marker j", "variable f", "component is 3"});
  says(refusal([&](Mechanism &m) { m.scene.variable("l", Measure::multiplier(m.hinge, 5)); }),
       {"variable l", "hinge", "rows 0 to 4, not 5"});
  says(refusal([&](Mechanism &m) { m.scene.variable("l", Measure::multiplier(m.spring, 0)); }),
       {"spring", "not a joint"});
  says(refusal([&](Mechanism &m) { m.scene.variable("l", Measure::multiplier(Element{77}, 0)); }),
       {"variable l", "not one of this scene"});
  says(refusal([&](Mechanism &m) {
         const Element e = m.scene.add("soft", SpringDamper{m.on_a, m.on_b, 1});
         m.scene.variable("tension", Measure::force(e, 0));
       }),
       {"variable tension", "soft", "state = true"});
  says(refusal([&](Mechanism &m) { m.scene.variable("v", Measure::value(Variable{3})); }),
       {"variable v", "not a variable"});
  says(refusal([&](Mechanism &m) {
         Measure e;
         e.kind = Measure::KineticEnergy;
         m.scene.variable("energy", e);
       }),
       {"variable energy", "output alone"});
  says(refusal([&](Mechanism &m) {
         UserForce f;
         f.i = m.on_a;
         f.force.resize(2);
         m.scene.add("push", f);
       }),
       {"user force push", "2 components", "none or three"});
  says(refusal([&](Mechanism &m) {
         m.scene.add("pull", UserScalarForce{m.on_a, m.on_b, Measure::value(State{})});
       }),
       {"user scalar force pull", "not a state"});
}
