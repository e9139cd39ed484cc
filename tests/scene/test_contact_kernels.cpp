/* Contact: kernels against differences and physical properties of the forces; entries of a scene */
#include "contact_cases.h"
#include "scene/model.h"

using namespace hhtdae;

namespace
{

template <class Shape> class ContactKernel : public testing::Test
{
};
using Shapes =
    testing::Types<SpherePlaneShape, EllipsoidPlaneShape, TorusPlaneShape, SphereSphereShape, SphereBoxShape>;
TYPED_TEST_SUITE(ContactKernel, Shapes);

} // namespace

/* ---- kernels ---- */

TYPED_TEST(ContactKernel, DerivativesMasksBalance) { CheckForce<Contact<TypeParam>>(Touching<TypeParam>); }

/* The hand-written chain rule against automatic differentiation of components() and apply(), which force states use */
TYPED_TEST(ContactKernel, AgreesWithItsComponents)
{
  using K = Contact<TypeParam>;
  Random random(11);
  for (int k = 0; k < 30; k++) {
    const Encounter<TypeParam> s(random);
    ForceJacobian<2, 0>        J, automatic;
    Wrench<double>             on[2], same[2];
    K::jacobian(s.d, s.f, s.w, 0, nullptr, on, J);
    Force<K, 2, 3>::template jacobian<typename K::Data, 0>(s.d, s.f, s.w, 0, nullptr, same, automatic);
    ExpectClose(J.frames, automatic.frames, 1e-12, "d wrenches/d frames");
    ExpectClose(J.twists, automatic.twists, 1e-12, "d wrenches/d twists");
    ExpectClose(checks::ToVector<2>(on), checks::ToVector<2>(same), 1e-13, "wrenches");
  }
}

/* Normal and contact point are consistent: the rate of penetration is the normal velocity at the contact point */
TYPED_TEST(ContactKernel, RateOfPenetrationIsTheNormalVelocityAtTheContactPoint)
{
  Random random(13);
  for (int k = 0; k < 30; k++) {
    const Encounter<TypeParam> s(random);
    const DynamicVector        rate = Difference([&](double h) { return s.depthAfter(h); });
    EXPECT_NEAR(s.rate(s.touch()), rate(0), 1e-8);
    EXPECT_NEAR(s.touch().n.norm(), 1, 1e-11);
  }
}

/* without damping and friction the force comes from its potential */
TYPED_TEST(ContactKernel, UndampedForceHasAPotential)
{
  Random random(15);
  for (int k = 0; k < 30; k++) {
    Encounter<TypeParam> s(random);
    s.d.law.damping = s.d.law.friction = 0;
    const DynamicVector rate           = Difference([&](double h) { return s.energyAfter(h); });
    EXPECT_NEAR(s.power(), -rate(0), 1e-7 * (1 + std::abs(rate(0))));
  }
}

/* The inelastic part of the force dissipates energy; N is never negative */
TYPED_TEST(ContactKernel, DampingAndFrictionTakeEnergy)
{
  Random random(17);
  double strongest = 0;
  for (int k = 0; k < 500; k++) {
    Encounter<TypeParam> s(random);
    s.d.law.damping         = random(0, 5);
    const Touch<double> t   = s.touch();
    const double        all = s.power(), elastic = -ElasticForce<double>(s.d.law, t.depth) * s.rate(t);
    EXPECT_LE(all - elastic, 1e-12);
    strongest = std::min(strongest, all - elastic);
  }
  EXPECT_LT(strongest, -1);
}

TYPED_TEST(ContactKernel, NothingBeforeTouching)
{
  using K = Contact<TypeParam>;
  Random random(19);
  for (int k = 0; k < 30; k++) {
    Encounter<TypeParam> s(random);
    Press<TypeParam>(s.d.shape, s.f, k < 15 ? -1e-12 : -random(0, 3));
    ForceJacobian<2, 0> J;
    Wrench<double>      on[2];
    double              c[3];
    J.frames.setOnes();
    J.twists.setOnes();
    K::jacobian(s.d, s.f, s.w, 0, nullptr, on, J);
    EXPECT_EQ(J.frames.norm() + J.twists.norm(), 0);
    EXPECT_EQ(checks::ToVector<2>(on).norm(), 0);
    K::wrench(s.d, s.f, s.w, 0, nullptr, on);
    EXPECT_EQ(checks::ToVector<2>(on).norm(), 0);
    K::template components<double>(s.d, s.f, s.w, 0, nullptr, c);
    EXPECT_EQ(std::abs(c[0]) + std::abs(c[1]) + std::abs(c[2]), 0);
  }
}

/* When contact begins, the force increases continuously from zero, and so does the Jacobian except for the linear law */
TYPED_TEST(ContactKernel, BeginsContinuously)
{
  using K = Contact<TypeParam>;
  Random random(23);
  for (double exponent : {1., 1.5, 2.}) {
    Encounter<TypeParam> s(random);
    for (Twist<double> &w : s.w) w = {w.v / 20, w.w / 20}; /* slow enough that the normal force does not vanish by separation */
    s.d.law              = MakeLaw(3, exponent, .5, .8, .5);
    const double small[] = {1e-4, 1e-6, 1e-8};
    double       before  = 1e3;
    for (double depth : small) {
      Press<TypeParam>(s.d.shape, s.f, depth);
      ForceJacobian<2, 0> J;
      Wrench<double>      on[2];
      K::jacobian(s.d, s.f, s.w, 0, nullptr, on, J);
      const double now = J.frames.cwiseAbs().maxCoeff();
      EXPECT_LT(checks::ToVector<2>(on).norm(), 200 * std::pow(depth, exponent));
      if (exponent > 1) { EXPECT_LT(now, .2 * before); } /* at least like d^(e-1) */
      EXPECT_GT(now, 0);
      before = now;
    }
  }
}

/* ---- entries ---- */

TEST(ContactEntry, RefusesByName)
{
  Scene      scene(PETSC_COMM_SELF);
  const Body ball = scene.add("ball", RigidBody{});
  const auto i = scene.marker(ball), j = scene.marker(scene.ground());
  ContactLaw law;
  law.stiffness     = 0;
  law.exponent      = .5;
  law.damping       = -2;
  law.friction      = -3;
  law.slip_velocity = 0;
  scene.add("a", SpherePlane{i, j, -1, law});
  scene.add("b", EllipsoidPlane{i, j, {1, 0, 1}});
  scene.add("c", TorusPlane{i, j, 0, -1});
  scene.add("d", SphereSphere{i, j, 0, -2});
  scene.add("e", SphereBox{i, j, 1, {1, 1, -4}});
  scene.add("f", SpherePlane{i, i});
  const char                     *expected[] = {"sphere-plane contact a: radius is -1",
                                                "sphere-plane contact a: stiffness is 0",
                                                "sphere-plane contact a: exponent is 0.5",
                                                "sphere-plane contact a: damping is -2",
                                                "sphere-plane contact a: friction coefficient is -3",
                                                "sphere-plane contact a: slip velocity is 0",
                                                "ellipsoid-plane contact b: semiaxis y is 0",
                                                "torus-plane contact c: radius is 0",
                                                "torus-plane contact c: tube radius is -1",
                                                "sphere-sphere contact d: radius of i is 0",
                                                "sphere-sphere contact d: radius of j is -2",
                                                "sphere-box contact e: half length z is -4",
                                                "sphere-plane contact f: markers i and j"};
  const std::vector<std::string> &errors     = DataOf(scene).errors;
  EXPECT_EQ(errors.size(), std::size(expected));
  for (const char *start : expected) {
    const auto found =
        std::find_if(errors.begin(), errors.end(), [&](const std::string &e) { return e.find(start) == 0; });
    EXPECT_NE(found, errors.end()) << "no error begins with: " << start;
  }
  for (const ElementData &e : DataOf(scene).elements) EXPECT_TRUE(e.parts.empty());
}

/* A ball thrown along the plane without spin ends up rolling at 5/7 of its speed, with the penetration at which k d^e
   is its weight; the same for forces eliminated and as force states */
TEST(ContactEntry, BallBeginsToRoll)
{
  const double R = .5, m = 2, g = 9.81, u = 1, mu = .3;
  for (bool state : {false, true}) {
    Scene      scene(PETSC_COMM_SELF);
    RigidBody  ball;
    ContactLaw law;
    law.stiffness      = 1e5;
    law.damping        = 1;
    law.friction       = mu;
    const double depth = std::pow(m * g / law.stiffness, 1 / law.exponent);
    ball.mass          = m;
    ball.inertia       = .4 * m * R * R * Matrix3::Identity();
    ball.position      = {0, 0, R - depth};
    ball.velocity      = {u, 0, 0};
    const Marker i     = scene.marker(scene.add("ball", ball));
    scene.gravity({0, 0, -g});
    scene.add("floor", SpherePlane{i, scene.marker(scene.ground()), R, law, state});
    TS ts;
    ASSERT_EQ(scene.createTS(&ts), 0);
    ASSERT_EQ(TSSetMaxTime(ts, .2), 0); /* it slips until 2/7 u/(mu g) = .097 */
    ASSERT_EQ(TSSetTolerances(ts, 1e-6, nullptr, 1e-6, nullptr), 0);
    ASSERT_EQ(scene.solve(ts), 0);
    Vec                U, V;
    const PetscScalar *q, *v;
    ASSERT_EQ(TS2GetSolution(ts, &U, &V), 0);
    ASSERT_EQ(VecGetArrayRead(U, &q), 0);
    ASSERT_EQ(VecGetArrayRead(V, &v), 0);
    EXPECT_NEAR(v[0], 5. / 7. * u, 2e-3);
    EXPECT_NEAR(v[1], 0, 1e-6);
    EXPECT_NEAR(q[2], R - depth, 1e-4 * R);
    ASSERT_EQ(VecRestoreArrayRead(U, &q), 0);
    ASSERT_EQ(VecRestoreArrayRead(V, &v), 0);
    ASSERT_EQ(TSDestroy(&ts), 0);
  }
}
