/* Friction in joints: derivatives, the limits mu N and rest, dissipation, and the loads that follow from the reaction */
#include "kernel_checks.h"
#include "scene/kernels/friction.h"
#include "scene/model.h"

using namespace hhtdae;

namespace
{

FrictionData SomeFriction(Random &random)
{
  return {random(.1, 1), random(.2, 2), random(.3, 3), (int)random(0, 2.999)};
}

/* components and wrenches of one state; total power of the wrenches */
template <class K> struct Evaluated {
  double         c[K::count], power = 0;
  Wrench<double> on[2];
  Evaluated(const FrictionData &d, const Frame<double> *f, const Twist<double> *w, const double *z)
  {
    K::template components<double>(d, f, w, 0, z, c);
    K::template apply<double>(d, f, c, on);
    for (int k = 0; k < 2; k++) power += on[k].f.dot(w[k].v) + on[k].m.dot(w[k].w);
  }
};

template <class K> class JointFrictionKernel : public testing::Test
{
};
using Kernels = testing::Types<RevoluteFriction<3>, RevoluteFriction<2>, TranslationalFriction<2>,
                               TranslationalFriction<1>, CylindricalFriction, SphericalFriction>;
TYPED_TEST_SUITE(JointFrictionKernel, Kernels);

const Frame<double> origin{Vec3<double>::Zero(), Mat3<double>::Identity()};
const Twist<double> rest{Vec3<double>::Zero(), Vec3<double>::Zero()};

} // namespace

TYPED_TEST(JointFrictionKernel, DerivativesMasksBalance) { CheckForce<TypeParam>(SomeFriction); }

TYPED_TEST(JointFrictionKernel, TakesEnergyAlways)
{
  Random random(3);
  double strongest = 0;
  for (int k = 0; k < 500; k++) {
    const Frame<double>        f[2] = {random.frame(), random.frame()};
    const Twist<double>        w[2] = {random.twist(), random.twist()};
    const double               z[3] = {random(-5, 5), random(-5, 5), random(-5, 5)};
    const Evaluated<TypeParam> e(SomeFriction(random), f, w, z);
    EXPECT_LE(e.power, 1e-12);
    strongest = std::min(strongest, e.power);
  }
  EXPECT_LT(strongest, -1);
}

TYPED_TEST(JointFrictionKernel, VanishesWithoutLoadAndAtRest)
{
  Random                     random(5);
  const Frame<double>        f[2] = {random.frame(), random.frame()};
  const Twist<double>        w[2] = {random.twist(), random.twist()}, still[2] = {rest, rest};
  const double               none[3] = {0, 0, 0}, load[3] = {1, 2, 3};
  const FrictionData         d = SomeFriction(random);
  const Evaluated<TypeParam> unloaded(d, f, w, none), resting(d, f, still, load);
  for (int r = 0; r < TypeParam::count; r++) {
    EXPECT_EQ(unloaded.c[r], 0);
    EXPECT_EQ(resting.c[r], 0);
  }
  ForceJacobian<2, TypeParam::inputs> J;
  Wrench<double>                      on[2];
  TypeParam::jacobian(d, f, still, 0, none, on, J);
  EXPECT_TRUE(J.frames.allFinite() && J.twists.allFinite() && J.inputs.allFinite());
}

/* The law does not depend on the unit of force: mu N is as accurate for a load of 1e-12 as for 1e12 */
TYPED_TEST(JointFrictionKernel, GrowsWithTheLoadInAnyUnits)
{
  Random                     random(6);
  const Frame<double>        f[2] = {random.frame(), random.frame()};
  const Twist<double>        w[2] = {random.twist(), random.twist()};
  const FrictionData         d = SomeFriction(random);
  const double               load[3] = {1, 2, 3};
  const Evaluated<TypeParam> unit(d, f, w, load);
  for (double scale : {1e-12, 1e12}) {
    const double               scaled[3] = {scale, 2 * scale, 3 * scale};
    const Evaluated<TypeParam> e(d, f, w, scaled);
    for (int r = 0; r < TypeParam::count; r++) EXPECT_NEAR(e.c[r] / (scale * unit.c[r]), 1, 1e-12) << scale;
  }
}

/* If the shaft turns with both bodies there is no slip */
TYPED_TEST(JointFrictionKernel, RigidMotionOfBothDoesNotSlip)
{
  Random                     random(7);
  const Frame<double>        f[2] = {random.frame(), random.frame()};
  const Vec3<double>         v = random.vector(), turn = random.vector();
  const Twist<double>        w[2]    = {{v + turn.cross(f[0].x), turn}, {v + turn.cross(f[1].x), turn}};
  const double               load[3] = {1, 2, 3};
  const Evaluated<TypeParam> e(SomeFriction(random), f, w, load);
  for (int r = 0; r < TypeParam::count; r++) EXPECT_NEAR(e.c[r], 0, 1e-14);
}

/* Fast slip: the moment mu r N about z_j opposes the rotation, N = |(2, 3, 6)| = 7 */
TEST(JointFriction, RevoluteKnownValue)
{
  const FrictionData  d{.2, .5, 1e-3, 0};
  const Frame<double> f[2]    = {origin, origin};
  Twist<double>       w[2]    = {rest, rest};
  const double        load[3] = {2, 3, 6};
  w[0].w                      = {5, 7, 3}; /* only the component about z matters */
  const Evaluated<RevoluteFriction<3>> e(d, f, w, load);
  EXPECT_NEAR(e.on[0].m(2), -.2 * .5 * 7, 1e-8);
  EXPECT_EQ(e.on[0].m(0), 0);
  w[0].w(2) = 1e-3; /* r w/v_s = 1/2 */
  const Evaluated<RevoluteFriction<3>> slow(d, f, w, load);
  EXPECT_NEAR(slow.on[0].m(2), -.2 * .5 * 7 * std::tanh(.5), 1e-8);
}

TEST(JointFriction, TranslationalKnownValue)
{
  for (int axis = 0; axis < 3; axis++) {
    const FrictionData  d{.3, 0, 1e-3, axis};
    const Frame<double> f[2]    = {{Vec3<double>(0, 0, 2), Mat3<double>::Identity()}, origin};
    Twist<double>       w[2]    = {rest, rest};
    const double        load[2] = {-3, 4};
    w[0].v(axis)                = -2;
    const Evaluated<TranslationalFriction<2>> e(d, f, w, load);
    EXPECT_NEAR(e.on[0].f(axis), .3 * 5, 1e-8);
    EXPECT_NEAR(e.on[1].f(axis), -.3 * 5, 1e-8);
    const Evaluated<TranslationalFriction<1>> one(d, f, w, load);
    EXPECT_NEAR(one.on[0].f(axis), .3 * 3, 1e-8);
  }
}

/* Slip with the components 3 along and 4 around the axis: the friction force mu N has the opposite direction */
TEST(JointFriction, CylindricalFrictionFollowsTheHelix)
{
  const FrictionData  d{.5, 2, 1e-3, 0};
  const Frame<double> f[2]    = {origin, origin};
  Twist<double>       w[2]    = {rest, rest};
  const double        load[2] = {6, 8};
  w[0].v(2)                   = 3;
  w[0].w(2)                   = 2;
  const Evaluated<CylindricalFriction> e(d, f, w, load);
  EXPECT_NEAR(e.on[0].f(2), -.5 * 10 * .6, 1e-8);
  EXPECT_NEAR(e.on[0].m(2), -.5 * 10 * .8 * 2, 1e-8);
}

TEST(JointFriction, SphericalMomentOpposesTheRelativeRotation)
{
  const FrictionData  d{.1, 3, 1e-3, 0};
  const Frame<double> f[2]    = {origin, origin};
  Twist<double>       w[2]    = {rest, rest};
  const double        load[3] = {0, 3, 4};
  w[0].w                      = {1, 2, 2};
  w[1].w                      = {-1, -2, -2};
  const Evaluated<SphericalFriction> e(d, f, w, load);
  EXPECT_LT((e.on[0].m + .1 * 3 * 5 * Vec3<double>(1, 2, 2) / 3).norm(), 1e-8);
}

/* Both formulas for tanh(x)/x, and their derivative with respect to y = x^2, agree */
TEST(JointFriction, RegularizationIsSmoothAtRest)
{
  for (double x : {1e-9, 1e-3, .01, .031, .032, .1, .5, 2., 19., 21., 1e3}) {
    using T            = Dual<1>;
    const T      ratio = TanhRatio<T>(T(x * x, 0));
    const double y = x * x, th = std::tanh(x);
    const double series  = -1. / 3. + y * (4. / 15. - y * (17. / 105. - y * 248. / 2835.)),
                 formula = (1 - th * th - th / x) / (2 * y);
    EXPECT_NEAR(ratio.value(), th / x, 1e-15) << x;
    EXPECT_NEAR(ratio.derivatives()(0), x < .02 ? series : formula, 1e-12) << x;
  }
  EXPECT_EQ(TanhRatio<double>(0.), 1);
}

/* ---- entries ---- */

namespace
{

bool Mentions(Scene &scene, const std::string &text)
{
  for (const std::string &e : DataOf(scene).errors)
    if (e.find(text) != std::string::npos) return true;
  return false;
}

struct Shaft {
  Scene  scene{PETSC_COMM_SELF};
  Body   body = scene.add("shaft", RigidBody{});
  Marker i = scene.marker(body), j = scene.marker(scene.ground());
};

} // namespace

TEST(JointFrictionEntry, TakesThePositionRowsOfItsJoint)
{
  Shaft         s;
  const Element revolute = s.scene.add("pin", Revolute{s.i, s.j}),
                slider   = s.scene.add("rail", Translational{s.i, s.j});
  s.scene.add("friction", JointFriction{revolute, .1, .2});
  s.scene.add("sliding", JointFriction{slider, .1});
  ASSERT_TRUE(DataOf(s.scene).errors.empty()) << DataOf(s.scene).errors[0];
  const int rows[] = {3, 2};
  for (int k = 0; k < 2; k++) {
    const ElementData &e = DataOf(s.scene).elements[2 + k];
    ASSERT_EQ(e.parts.size(), 1u);
    const StoreBase &store = *e.parts[0].store;
    ASSERT_EQ(store.inputs(), rows[k]);
    for (int r = 0; r < rows[k]; r++) {
      const ScalarRef ref = store.input(e.parts[0].index, r);
      EXPECT_EQ(ref.kind, ScalarRef::Multiplier);
      EXPECT_EQ(ref.id, k);
      EXPECT_EQ(ref.component, r);
    }
  }
}

TEST(JointFrictionEntry, RefusesByName)
{
  Shaft         s;
  const Element pin = s.scene.add("pin", Revolute{s.i, s.j}), weld = s.scene.add("weld", Fixed{s.i, s.j});
  s.scene.add("f", JointFriction{weld, .1, .2});
  EXPECT_TRUE(Mentions(s.scene, "joint friction f: \"weld\" is of type fixed; friction is for revolute"))
      << DataOf(s.scene).errors.back();
  s.scene.add("g", JointFriction{Element{}, .1, .2});
  EXPECT_TRUE(Mentions(s.scene, "joint friction g: its joint is not an element"));
  s.scene.add("h", JointFriction{pin, -.1, 0, -1});
  EXPECT_TRUE(Mentions(s.scene, "joint friction h: coefficient is -0.1"));
  EXPECT_TRUE(Mentions(s.scene, "joint friction h: radius of pin or ball is 0"));
  EXPECT_TRUE(Mentions(s.scene, "joint friction h: slip velocity is -1"));
  EXPECT_TRUE(DataOf(s.scene).elements.back().parts.empty());
}

namespace
{

/* Rates of the coordinates of a scene at the end of a run */
Eigen::VectorXd RatesAfter(Scene &scene, double end)
{
  TS  ts;
  Vec U, V;
  EXPECT_EQ(scene.createTS(&ts), 0);
  EXPECT_EQ(TSSetMaxTime(ts, end), 0);
  EXPECT_EQ(TSSetTolerances(ts, 1e-7, nullptr, 1e-7, nullptr), 0);
  EXPECT_EQ(scene.solve(ts), 0);
  EXPECT_EQ(TS2GetSolution(ts, &U, &V), 0);
  const PetscScalar *v;
  PetscInt           n;
  EXPECT_EQ(VecGetLocalSize(V, &n), 0);
  EXPECT_EQ(VecGetArrayRead(V, &v), 0);
  const Eigen::VectorXd rates = Eigen::Map<const Eigen::VectorXd>(v, n);
  EXPECT_EQ(VecRestoreArrayRead(V, &v), 0);
  EXPECT_EQ(TSDestroy(&ts), 0);
  return rates;
}

} // namespace

/* A flywheel in bearings with the load m g slows down at mu r m g/I; a block on a rail at mu g */
TEST(JointFrictionEntry, SlowsDownAsCoulombSays)
{
  const double g = 9.81, mu = .2, r = .5, t = .5;
  for (bool planar : {false, true}) {
    Scene     scene(PETSC_COMM_SELF, planar ? Space::Planar : Space::Spatial);
    RigidBody wheel;
    wheel.mass             = 2;
    wheel.inertia          = 3 * Matrix3::Identity();
    wheel.angular_velocity = {0, 0, 4};
    const Body    body     = scene.add("wheel", wheel);
    const Element pin      = scene.add("pin", Revolute{scene.marker(body), scene.marker(scene.ground())});
    scene.gravity({0, -g, 0});
    scene.add("friction", JointFriction{pin, mu, r});
    const Eigen::VectorXd v = RatesAfter(scene, t);
    const double          w = 4 - mu * r * 2 * g / 3 * t;
    EXPECT_NEAR(planar ? v(2) : v.segment<3>(3).sum(), w, 1e-4); /* rotation about z only: the sum of the Euler rates is the angular velocity */
  }
  Matrix3 axes;
  axes << 0, 0, 1, 1, 0, 0, 0, 1, 0; /* z_j along x */
  for (bool planar : {false, true}) {
    Scene     scene(PETSC_COMM_SELF, planar ? Space::Planar : Space::Spatial);
    RigidBody block;
    block.mass           = 2;
    block.velocity       = {-3, 0, 0};
    const Body    body   = scene.add("block", block);
    const Matrix3 rail   = planar ? Matrix3(Matrix3::Identity()) : axes;
    const Element slider = scene.add("rail", Translational{scene.marker(body, Vector3::Zero(), rail),
                                                           scene.marker(scene.ground(), Vector3::Zero(), rail)});
    scene.gravity({0, -g, 0});
    scene.add("friction", JointFriction{slider, mu});
    EXPECT_NEAR(RatesAfter(scene, t)(0), -3 + mu * g * t, 1e-4);
  }
}

/* A crank drives a piston under gas pressure through a rod at 1 rad; the iteration for initial accelerations converges
   with a rate of about mu tan(1) */
TEST(JointFrictionEntry, StartsAtAnyCoefficient)
{
  for (double mu = .1; mu < .25; mu += .005) {
    Scene         scene(PETSC_COMM_SELF, Space::Planar);
    const double  c = std::cos(1.), s = std::sin(1.);
    RigidBody     rod, piston, crank;
    rod.mass        = .01;
    rod.inertia     = 1e-6 * Matrix3::Identity();
    rod.position    = {-c / 2, s / 2, 0};
    piston.inertia  = .01 * Matrix3::Identity();
    crank.mass      = 5;
    crank.inertia   = .1 * Matrix3::Identity();
    crank.position  = {-c, s, 0};
    crank.angular_velocity = {0, 0, 1};
    for (RigidBody *b : {&rod, &piston, &crank}) b->velocity = {-.2, 0, 0};
    const Body    r = scene.add("rod", rod), p = scene.add("piston", piston), k = scene.add("crank", crank);
    scene.add("bearing", Revolute{scene.marker(k, {0, -.2, 0}), scene.marker(scene.ground(), {-c, s - .2, 0})});
    scene.add("pin", Revolute{scene.marker(r, {-c / 2, s / 2, 0}), scene.marker(k)});
    scene.add("gudgeon", Revolute{scene.marker(r, {c / 2, -s / 2, 0}), scene.marker(p)});
    const Element slide = scene.add("slide", Translational{scene.marker(p), scene.marker(scene.ground())});
    scene.add("friction", JointFriction{slide, mu});
    const auto constant = [](double x) { return Expression({}, [x](const Real *) -> Real { return Real(x); }); };
    UserForce  gas;
    gas.i     = scene.marker(p);
    gas.force = {constant(-1000), constant(0), constant(0)};
    scene.add("gas", gas);
    TS ts;
    EXPECT_EQ(scene.createTS(&ts), 0);
    EXPECT_EQ(TSSetMaxTime(ts, 1e-3), 0);
    EXPECT_EQ(scene.solve(ts), 0) << mu;
    EXPECT_EQ(TSDestroy(&ts), 0);
  }
}
