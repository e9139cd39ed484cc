/* Springs, torsional springs, bushings and beams in a scene: which input is refused with which message, and short runs */
#include "scene/kernels/beam.h"
#include "scene/runtime.h"

#include <gtest/gtest.h>

using namespace hhtdae;

namespace
{

/* a rigid body 2 m along x from the ground's origin, a point mass, and markers */
struct Fixture {
  Scene  scene;
  Body   body, point;
  Marker root, tip, away, mass, beside;

  explicit Fixture(Space space = Space::Spatial) : scene(PETSC_COMM_SELF, space)
  {
    RigidBody b;
    PointMass p;
    b.position = {2, 0, 0};
    p.position = {0, 1, 0};
    body       = scene.add("block", b);
    point      = scene.add("bead", p);
    root       = scene.marker(scene.ground());
    tip        = scene.marker(body);
    away       = scene.markerAt(body, Vector3::Zero()); /* at the position of root */
    mass       = scene.marker(point);
    beside     = scene.marker(body, {0, 1, 0});
  }
  template <class Spec> std::string errors(const Spec &s)
  {
    std::string all;
    scene.add("it", s);
    for (const std::string &e : DataOf(scene).errors) all += e + "\n";
    DataOf(scene).errors.clear();
    return all;
  }
};

template <class Spec, class Change> std::string Errors(Spec s, const Change &change, Space space = Space::Spatial)
{
  Fixture f(space);
  s.i = f.tip;
  s.j = f.root;
  change(f, s);
  return f.errors(s);
}

void ExpectSays(const std::string &errors, const std::string &words)
{
  EXPECT_NE(errors.find(words), std::string::npos) << "expected: " << words << "\ngot: " << errors;
}

Beam Steel()
{
  Beam b;
  b.E = 2e3, b.G = 8e2, b.area = .5, b.Iyy = .02, b.Izz = .03, b.J = .04;
  return b;
}

const double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

} // namespace

TEST(ForceEntries, SpringDamperRefuses)
{
  const auto bad = [](auto change) { return Errors(SpringDamper{}, change); };
  ExpectSays(bad([](Fixture &, SpringDamper &s) { s.stiffness = -3; }),
             "spring-damper it: stiffness is -3, must be finite and not negative");
  ExpectSays(bad([](Fixture &, SpringDamper &s) { s.damping = kNaN; }), "damping is nan");
  ExpectSays(bad([](Fixture &, SpringDamper &s) { s.length = kInfinity; }), "length is inf");
  ExpectSays(bad([](Fixture &, SpringDamper &s) { s.preload = kNaN; }), "preload is nan");
  ExpectSays(bad([](Fixture &f, SpringDamper &s) { s.j = f.beside; }), "both markers are on block");
  ExpectSays(bad([](Fixture &, SpringDamper &s) { s.j = Marker{}; }), "marker j is not a marker of this scene");
  /* markers that coincide */
  ExpectSays(bad([](Fixture &f, SpringDamper &s) { s.i = f.away, s.length = .5; }),
             "free length of 0.5 without a direction");
  ExpectSays(bad([](Fixture &f, SpringDamper &s) { s.i = f.away, s.preload = 2; }), "preload of 2 without a direction");
  ExpectSays(bad([](Fixture &f, SpringDamper &s) { s.i = f.away, s.state = true; }), "set state = false");
  /* several at once */
  const std::string both = bad([](Fixture &, SpringDamper &s) { s.stiffness = s.damping = -1; });
  ExpectSays(both, "stiffness is -1");
  ExpectSays(both, "damping is -1");
}

TEST(ForceEntries, NonlinearSpringRefuses)
{
  const auto bad = [](auto change) { return Errors(NonlinearSpring{}, change); };
  ExpectSays(bad([](Fixture &, NonlinearSpring &) {}), "it has no tension");
  ExpectSays(bad([](Fixture &, NonlinearSpring &s) {
               s.tension = [](const Real &l, const Real &) -> Real { return sqrt(l - 5.); };
             }),
             "its tension is");
  ExpectSays(bad([](Fixture &, NonlinearSpring &s) {
               s.tension = [](const Real &l, const Real &v) -> Real { return l + sqrt(v); };
             }),
             "the derivative of its tension by rate is");
  ExpectSays(bad([](Fixture &f, NonlinearSpring &s) {
               s.i       = f.away;
               s.tension = [](const Real &l, const Real &) -> Real { return l; };
             }),
             "the markers coincide at the start");
  EXPECT_EQ(bad([](Fixture &, NonlinearSpring &s) {
              s.tension = [](const Real &l, const Real &v) -> Real { return 100. * pow(l - 1., 3) + 2. * v; };
            }),
            "");
}

TEST(ForceEntries, TorsionRefuses)
{
  const auto bad = [](auto change) { return Errors(TorsionalSpringDamper{}, change); };
  ExpectSays(bad([](Fixture &, TorsionalSpringDamper &s) { s.stiffness = -3; }),
             "torsional spring-damper it: stiffness is -3");
  ExpectSays(bad([](Fixture &, TorsionalSpringDamper &s) { s.damping = -3; }), "damping is -3");
  ExpectSays(bad([](Fixture &, TorsionalSpringDamper &s) { s.angle = kNaN; }), "angle is nan");
  ExpectSays(bad([](Fixture &, TorsionalSpringDamper &s) { s.preload = kInfinity; }), "preload is inf");
  ExpectSays(bad([](Fixture &f, TorsionalSpringDamper &s) { s.i = f.mass; }), "marker i is on the point mass bead");
  ExpectSays(bad([](Fixture &f, TorsionalSpringDamper &s) {
               s.i = f.scene.marker(f.body, Vector3::Zero(),
                                    Eigen::AngleAxisd(-M_PI / 2, Vector3::UnitY()).toRotationMatrix());
             }),
             "the angle about it is undefined");
  ExpectSays(Errors(NonlinearTorsionalSpring{}, [](Fixture &, NonlinearTorsionalSpring &) {}), "it has no moment");
  ExpectSays(Errors(NonlinearTorsionalSpring{},
                    [](Fixture &, NonlinearTorsionalSpring &s) {
                      s.moment = [](const Real &a, const Real &) -> Real { return log(a); };
                    }),
             "its moment is -inf");
}

TEST(ForceEntries, BushingRefuses)
{
  const auto bad = [](auto change) { return Errors(Bushing{}, change); };
  ExpectSays(bad([](Fixture &, Bushing &s) { s.stiffness(1) = -3; }), "bushing it: stiffness y is -3");
  ExpectSays(bad([](Fixture &, Bushing &s) { s.torsional_stiffness(2) = -3; }), "torsional_stiffness z is -3");
  ExpectSays(bad([](Fixture &, Bushing &s) { s.damping(0) = kNaN; }), "damping x is nan");
  ExpectSays(bad([](Fixture &, Bushing &s) { s.torsional_damping(0) = -1; }), "torsional_damping x is -1");
  ExpectSays(bad([](Fixture &, Bushing &s) { s.force(0) = kNaN; }), "force x is nan");
  ExpectSays(bad([](Fixture &, Bushing &s) { s.moment(0) = kNaN; }), "moment x is nan");
  ExpectSays(bad([](Fixture &f, Bushing &s) { s.j = f.mass; }), "marker j is on the point mass bead");
  ExpectSays(bad([](Fixture &f, Bushing &s) { s.i = f.mass, s.torsional_stiffness(0) = 1; }),
             "marker i is on the point mass bead");
  EXPECT_EQ(bad([](Fixture &f, Bushing &s) { s.i = f.mass, s.stiffness(0) = 1; }), "");
  ExpectSays(bad([](Fixture &f, Bushing &s) {
               s.torsional_stiffness(0) = 1;
               s.i =
                   f.scene.marker(f.body, Vector3::Zero(), Eigen::AngleAxisd(3.1, Vector3::UnitY()).toRotationMatrix());
             }),
             "marker i is turned by 3.1 rad");
}

TEST(ForceEntries, BeamRefuses)
{
  const auto bad = [](auto change, Space space = Space::Spatial) { return Errors(Steel(), change, space); };
  EXPECT_EQ(bad([](Fixture &, Beam &) {}), "");
  for (double Beam::*member : {&Beam::E, &Beam::G, &Beam::area, &Beam::Iyy, &Beam::Izz, &Beam::J})
    ExpectSays(bad([=](Fixture &, Beam &b) { b.*member = 0; }), "is 0, must be finite and positive");
  ExpectSays(bad([](Fixture &, Beam &b) { b.Izz = -1; }), "beam it: Izz is -1");
  ExpectSays(bad([](Fixture &, Beam &b) { b.shear_z = -1; }), "shear_z is -1");
  ExpectSays(bad([](Fixture &, Beam &b) { b.damping = -1; }), "damping is -1");
  ExpectSays(bad([](Fixture &, Beam &b) { b.length = 0; }), "length is 0, must be positive");
  ExpectSays(bad([](Fixture &f, Beam &b) { b.i = f.mass; }), "marker i is on the point mass bead");
  ExpectSays(bad([](Fixture &f, Beam &b) { b.i = f.away; }), "the markers coincide at the start");
  ExpectSays(bad([](Fixture &f, Beam &b) { b.i = f.root, b.j = f.tip; }), "do not point from j to i");
  const auto bending = [](Fixture &, Beam &b) { b.G = b.Iyy = b.J = 0; };
  EXPECT_EQ(bad(bending, Space::Planar), "");
  ExpectSays(bad([](Fixture &, Beam &b) { b.G = 0, b.shear_y = .4; }, Space::Planar), "G is 0");
}

/* ---- short runs ---- */

namespace
{

struct Motion {
  Matrix<6, 1> q, v; /* of the centre of mass and rotation */
};

/* A body that is thrown with a spin and held to the ground by one element; its position at t = 0.4 */
template <class Spec> PetscErrorCode Throw(const Spec &spec, Motion *m)
{
  Scene              scene(PETSC_COMM_SELF);
  RigidBody          b;
  Spec               s = spec;
  TS                 ts;
  Vec                U, V;
  const PetscScalar *u, *v;

  PetscFunctionBegin;
  b.mass             = 2;
  b.inertia          = Vector3(1, 2, 2.5).asDiagonal();
  b.position         = {2, .25, .5};
  b.velocity         = {.5, 1, -1};
  b.angular_velocity = {1, -.5, 2};
  const Body body    = scene.add("block", b);
  s.i = scene.marker(body, {-.5, .25, .125}, Eigen::AngleAxisd(.2, Vector3(1, 2, 3).normalized()).toRotationMatrix());
  s.j = scene.marker(scene.ground(), {.25, .125, 0});
  scene.add("it", s);
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, .4));
  PetscCall(TSSetTimeStep(ts, 1e-3));
  PetscCall(TSSetTolerances(ts, 1e-8, nullptr, 1e-8, nullptr));
  PetscCall(scene.solve(ts));
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  const PetscInt at = ModelOf(scene).number.body[body.id];
  for (int k = 0; k < 6; k++) {
    m->q(k) = u[at + k];
    m->v(k) = v[at + k];
  }
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

/* The element gives the same motion whether its force is eliminated or a force state, and it has an effect */
template <class Spec> void ExpectSameAsState(Spec s)
{
  Motion eliminated, carried, unloaded;
  s.state = false;
  ASSERT_EQ(Throw(s, &eliminated), 0);
  s.state = true;
  ASSERT_EQ(Throw(s, &carried), 0);
  ASSERT_EQ(Throw(SpringDamper{}, &unloaded), 0);
  EXPECT_LT((eliminated.q - carried.q).norm(), 1e-5);
  EXPECT_LT((eliminated.v - carried.v).norm(), 1e-4);
  EXPECT_GT((eliminated.v - unloaded.v).norm(), 1e-2);
}

} // namespace

/* m x'' + c x' + k x = 0 along x, from x = 0.5 at rest: eliminated and as a force state */
TEST(ForceEntries, DampedOscillator)
{
  const double m = 2, k = 8, c = 1, T = 1.5, x0 = .5;
  for (bool state : {false, true}) {
    Scene              scene(PETSC_COMM_SELF);
    PointMass          p;
    SpringDamper       s;
    TS                 ts;
    Vec                U, V;
    const PetscScalar *u;
    p.mass       = m;
    p.position   = {1 + x0, 0, 0};
    const Body b = scene.add("bead", p);
    s.i          = scene.marker(b);
    s.j          = scene.marker(scene.ground());
    s.stiffness  = k;
    s.damping    = c;
    s.length     = 1;
    s.state      = state;
    scene.add("spring", s);
    ASSERT_EQ(scene.createTS(&ts), 0);
    ASSERT_EQ(TSSetMaxTime(ts, T), 0);
    ASSERT_EQ(TSSetTimeStep(ts, 1e-3), 0);
    ASSERT_EQ(TSSetTolerances(ts, 1e-8, nullptr, 1e-8, nullptr), 0);
    ASSERT_EQ(scene.solve(ts), 0);
    ASSERT_EQ(TS2GetSolution(ts, &U, &V), 0);
    ASSERT_EQ(VecGetArrayRead(U, &u), 0);
    const double d = c / (2 * m), w = std::sqrt(k / m - d * d);
    EXPECT_NEAR(u[ModelOf(scene).number.body[b.id]] - 1,
                x0 * std::exp(-d * T) * (std::cos(w * T) + d / w * std::sin(w * T)), 1e-5);
    ASSERT_EQ(VecRestoreArrayRead(U, &u), 0);
    ASSERT_EQ(TSDestroy(&ts), 0);
  }
}

TEST(ForceEntries, AsForceStates)
{
  SpringDamper spring;
  spring.stiffness = 40, spring.damping = 2, spring.length = 1, spring.preload = 3;
  ExpectSameAsState(spring);
  NonlinearSpring cubic;
  cubic.tension = [](const Real &l, const Real &v) -> Real { return 20. * pow(l - 1., 3) + 2. * v; };
  ExpectSameAsState(cubic);
  TorsionalSpringDamper torsion;
  torsion.stiffness = 40, torsion.damping = 2, torsion.angle = .5, torsion.preload = 3;
  ExpectSameAsState(torsion);
  Bushing bushing;
  bushing.stiffness = {40, 50, 60}, bushing.torsional_stiffness = {10, 20, 30}, bushing.force = {1, 2, 3};
  ExpectSameAsState(bushing);
  bushing.damping = {4, 5, 6}, bushing.torsional_damping = {1, 2, 3};
  ExpectSameAsState(bushing);
  Beam beam = Steel();
  ExpectSameAsState(beam);
  beam.damping = .01;
  ExpectSameAsState(beam);
}
