/* Contact: the law by what it promises, shapes by known values and by the rate of their penetration, kernels by
 * differences */
#include "kernel_checks.h"
#include "scene/kernels/contact.h"
#include "scene/scene_data.h"

using namespace hhtdae;

namespace
{

ContactLawData MakeLaw(double k, double e, double c, double mu, double vs, double onset = .1)
{
  ContactLawData law;
  law.stiffness     = k;
  law.exponent      = e;
  law.damping       = c;
  law.friction      = mu;
  law.slip_velocity = vs;
  law.onset         = onset;
  return law;
}

ContactLawData SomeLaw(Random &random)
{
  const double exponents[] = {1, 1.5, 2, 2.2};
  const double e           = exponents[(int)random(0, 3.999)];
  return MakeLaw(random(1, 5), e, random(0, .5), random(0, 1), random(.5, 2));
}

/* Random shapes and, in place(), random frames in which they touch with penetrations between .05 and .3 */
template <class Shape> struct Make;

template <class Shape> void Press(const typename Shape::Data &d, Frame<double> *f, double depth)
{
  Touch<double> t;
  Shape::template touch<double>(d, f, t);
  f[0].x += t.n * (t.depth - depth);
}

template <> struct Make<SpherePlaneShape> {
  static SpherePlaneShape::Data data(Random &r) { return {r(.5, 2), r(0, 1) < .5 ? 1 : 2}; }
};
template <> struct Make<EllipsoidPlaneShape> {
  static EllipsoidPlaneShape::Data data(Random &r) { return {{r(.5, 2), r(.5, 2), r(.5, 2)}, r(0, 1) < .5 ? 1 : 2}; }
};
template <> struct Make<TorusPlaneShape> {
  static TorusPlaneShape::Data data(Random &r) { return {r(.5, 2), r(.1, .5)}; }
};
template <> struct Make<SphereSphereShape> {
  static SphereSphereShape::Data data(Random &r) { return {r(.5, 2), r(.5, 2)}; }
};
template <> struct Make<SphereBoxShape> {
  static SphereBoxShape::Data data(Random &r) { return {r(.8, 2), {r(.5, 2), r(.5, 2), r(.5, 2)}}; }
};

/* The box's nearest point on a face, an edge or a corner: away from the borders between them, where the normal has a
 * kink */
template <class Shape> void Place(const typename Shape::Data &, Random &, Frame<double> *) {}
template <> void            Place<SphereBoxShape>(const SphereBoxShape::Data &d, Random &random, Frame<double> *f)
{
  const int    region = 1 + (int)random(0, 6.999); /* bits of the directions that are outside */
  Vec3<double> c;
  for (int k = 0; k < 3; k++) {
    const double sign = random(-1, 1) < 0 ? -1 : 1;
    c(k)              = sign * (region >> k & 1 ? d.half[k] + random(.5, 1) : d.half[k] * random(0, .9));
  }
  f[0].x = f[1].x + f[1].R * c;
}

template <class Shape> typename Contact<Shape>::Data Touching(Random &random, Frame<double> *f)
{
  typename Contact<Shape>::Data d{Make<Shape>::data(random), SomeLaw(random)};
  Place<Shape>(d.shape, random, f);
  Press<Shape>(d.shape, f, random(.05, .3));
  return d;
}

template <class Shape> struct Encounter {
  Frame<double>                 f[2];
  Twist<double>                 w[2];
  typename Contact<Shape>::Data d;
  explicit Encounter(Random &random)
  {
    for (int k = 0; k < 2; k++) {
      f[k] = random.frame();
      w[k] = random.twist();
    }
    d = Touching<Shape>(random, f);
  }
  Touch<double> touch() const
  {
    Touch<double> t;
    Shape::template touch<double>(d.shape, f, t);
    return t;
  }
  double rate(const Touch<double> &t) const { return -t.n.dot(Contact<Shape>::template slip<double>(f, w, t.p)); }
  double power() const
  {
    Wrench<double> on[2];
    Contact<Shape>::wrench(d, f, w, 0, nullptr, on);
    double p = 0;
    for (int k = 0; k < 2; k++) p += on[k].f.dot(w[k].v) + on[k].m.dot(w[k].w);
    return p;
  }
  /* the frames moved along their twists */
  DynamicVector depthAfter(double h) const
  {
    Encounter moved(*this);
    moved.advance(h);
    return DynamicVector::Constant(1, moved.touch().depth);
  }
  DynamicVector energyAfter(double h) const
  {
    Encounter moved(*this);
    moved.advance(h);
    return DynamicVector::Constant(1, Contact<Shape>::energy(d, moved.f));
  }

private:
  void advance(double h)
  {
    for (int k = 0; k < 2; k++) {
      f[k].x += h * w[k].v;
      f[k].R = Eigen::AngleAxisd(h * w[k].w.norm(), w[k].w.normalized()).toRotationMatrix() * f[k].R;
    }
  }
};

template <class Shape> class ContactKernel : public testing::Test
{
};
using Shapes =
    testing::Types<SpherePlaneShape, EllipsoidPlaneShape, TorusPlaneShape, SphereSphereShape, SphereBoxShape>;
TYPED_TEST_SUITE(ContactKernel, Shapes);

const Mat3<double>  upright = Mat3<double>::Identity();
const Frame<double> origin{Vec3<double>::Zero(), upright};
const Twist<double> rest{Vec3<double>::Zero(), Vec3<double>::Zero()};

template <class Shape>
Touch<double> TouchAt(const typename Shape::Data &d, const Vec3<double> &x, const Mat3<double> &R = upright)
{
  const Frame<double> f[2] = {{x, R}, origin};
  Touch<double>       t;
  Shape::template touch<double>(d, f, t);
  return t;
}

void ExpectTouch(const Touch<double> &t, double depth, const Vec3<double> &n, const Vec3<double> &p,
                 double tolerance = 1e-14)
{
  EXPECT_NEAR(t.depth, depth, tolerance);
  EXPECT_LT((t.n - n).norm(), tolerance) << "normal " << t.n.transpose();
  EXPECT_LT((t.p - p).norm(), tolerance) << "contact point " << t.p.transpose();
}

} // namespace

/* ---- kernels ---- */

TYPED_TEST(ContactKernel, DerivativesMasksBalance) { CheckForce<Contact<TypeParam>>(Touching<TypeParam>); }

/* the chain rule by hand against automatic differentiation of components() and apply(), which force states use */
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

/* normal and contact point belong together */
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
    s.d.law.onset                      = k % 2 ? .1 : 1;
    const DynamicVector rate           = Difference([&](double h) { return s.energyAfter(h); });
    EXPECT_NEAR(s.power(), -rate(0), 1e-7 * (1 + std::abs(rate(0))));
  }
}

/* what is not elastic takes energy; N is never negative */
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

/* force and Jacobian come up from zero when contact begins, for the linear law as well */
TYPED_TEST(ContactKernel, BeginsContinuously)
{
  using K = Contact<TypeParam>;
  Random random(23);
  for (double exponent : {1., 1.5, 2.}) {
    Encounter<TypeParam> s(random);
    for (Twist<double> &w : s.w) w = {w.v / 20, w.w / 20}; /* not parting so fast that the force is zero */
    s.d.law              = MakeLaw(3, exponent, .5, .8, .5);
    const double small[] = {1e-4, 1e-6, 1e-8};
    double       before  = 1e3;
    for (double depth : small) {
      Press<TypeParam>(s.d.shape, s.f, depth);
      ForceJacobian<2, 0> J;
      Wrench<double>      on[2];
      K::jacobian(s.d, s.f, s.w, 0, nullptr, on, J);
      const double now = J.frames.cwiseAbs().maxCoeff();
      EXPECT_LT(checks::ToVector<2>(on).norm(), 200 * std::pow(depth, std::max(exponent, 1.5)));
      EXPECT_LT(now, .2 * before); /* like d^(e-1) at least */
      EXPECT_GT(now, 0);
      before = now;
    }
  }
}

/* ---- the law ---- */

TEST(ContactLaw, RampIsTwiceContinuouslyDifferentiable)
{
  for (double s : {-3., -.25, .25, 1., 7.}) EXPECT_EQ(SmoothRamp<double>(s), std::max(0., s));
  double slope = 0, h = 1e-4;
  for (double s = -.3; s < .3; s += h) {
    const double value = SmoothRamp<double>(s), next = SmoothRamp<double>(s + h), now = (next - value) / h;
    EXPECT_GE(value, 0);
    EXPECT_GE(now, slope - 1e-9);              /* convex */
    EXPECT_LT(now - slope, 3 * h / .5 * 1.01); /* slope 3 u^2 - 2 u^3 rises by 1.5/(2 w) at most */
    slope = now;
  }
  EXPECT_NEAR(slope, 1, 1e-9);
}

TEST(ContactLaw, LinearLawSetsInSmoothly)
{
  const ContactLawData law = MakeLaw(7, 1, 0, 0, 1, .1);
  EXPECT_NEAR(ElasticForce<double>(law, .1), .7, 1e-15);
  EXPECT_NEAR(ElasticForce<double>(law, .5), 3.5, 1e-15);
  using T = Dual<1>;
  EXPECT_NEAR(ElasticForce<T>(law, T(.1 - 1e-12, 1, 0)).derivatives()(0), 7, 1e-9);
  EXPECT_NEAR(ElasticForce<T>(law, T(1e-12, 1, 0)).derivatives()(0), 0, 1e-9);
  for (double d = .001; d < .1; d += .001) EXPECT_GT(ElasticForce<T>(law, T(d, 1, 0)).derivatives()(0), 0);
}

TEST(ContactLaw, ExponentsByTheirShortCuts)
{
  for (double e : {1.5, 1.5000001})
    EXPECT_NEAR(ElasticForce<double>(MakeLaw(2, e, 0, 0, 1), .3), 2 * std::pow(.3, e), 1e-14);
}

/* parting fast, the force is zero, where Hunt and Crossley's would pull; at rest N = k d^e, damped 1 + c d' */
TEST(ContactLaw, DampingFactor)
{
  const ContactLawData law = MakeLaw(10, 2, 2, 0, 1);
  const Vec3<double>   n(0, 0, 1);
  const double         elastic = 10 * .2 * .2;
  auto                 N = [&](double rate) { return ContactForce<double>(law, .2, n, Vec3<double>(1, 2, -rate))(2); };
  EXPECT_NEAR(N(0), elastic, 1e-15);
  EXPECT_NEAR(N(3), elastic * 7, 1e-14);
  EXPECT_NEAR(N(-.3), elastic * .4, 1e-15);
  EXPECT_GT(N(-.55), 0);
  EXPECT_EQ(N(-.7), 0);
  EXPECT_EQ(N(-100), 0);
}

TEST(ContactLaw, FrictionLimit)
{
  const ContactLawData law = MakeLaw(10, 1.5, 0, .4, 1e-2);
  const Vec3<double>   n(0, 0, 1);
  const double         N = 10 * std::pow(.25, 1.5);
  Vec3<double>         F = ContactForce<double>(law, .25, n, Vec3<double>(.6, -.8, 5));
  EXPECT_LT((F - N * Vec3<double>(-.4 * .6, .4 * .8, 1)).norm(), 1e-13);
  F = ContactForce<double>(law, .25, n, Vec3<double>(0, 2e-3, 0));
  EXPECT_LT((F - N * Vec3<double>(0, -.4 * std::tanh(.2), 1)).norm(), 1e-13);
  F = ContactForce<double>(law, .25, n, Vec3<double>(0, 0, 0));
  EXPECT_LT((F - N * n).norm(), 1e-15);
}

namespace
{

/* A ball of mass 1 and radius 1 on the plane, moving along its normal; returns height above touching and velocity */
struct Bounce {
  Contact<SpherePlaneShape>::Data d;
  double                          gravity;
  double                          acceleration(double y, double v) const
  {
    const Frame<double> f[2] = {{Vec3<double>(.3, -.2, 1 + y), upright}, origin};
    const Twist<double> w[2] = {{Vec3<double>(0, 0, v), Vec3<double>::Zero()}, rest};
    Wrench<double>      on[2];
    Contact<SpherePlaneShape>::wrench(d, f, w, 0, nullptr, on);
    return on[0].f(2) - gravity;
  }
  void step(double &y, double &v, double h) const /* classical Runge-Kutta method */
  {
    const double a1 = acceleration(y, v), v2 = v + h / 2 * a1, a2 = acceleration(y + h / 2 * v, v2);
    const double v3 = v + h / 2 * a2, a3 = acceleration(y + h / 2 * v2, v3), v4 = v + h * a3,
                 a4 = acceleration(y + h * v3, v4);
    y += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
};

} // namespace

/* Without gravity the law gives v dv/(1 + c d') = -k d^e dd. Its integral, the same on the way in and out, says that
   v/c - ln(1 + c v)/c^2 is equal at u (in) and -u' (out), whatever k and e. */
TEST(ContactLaw, SpeedAfterImpact)
{
  for (double e : {1., 1.5, 2.}) {
    const double c = .3, u = 2;
    const Bounce ball{{{1, 2}, MakeLaw(1e3, e, c, .5, 1, 1e-3)}, 0};
    double       y = 0, v = -u;
    for (int k = 0; k < 1000000 && !(v > 0 && y > 0); k++) ball.step(y, v, 1e-5);
    auto G = [&](double s) { return s / c - std::log(1 + c * s) / (c * c); };
    EXPECT_NEAR(G(u), G(-v), 1e-7);
    EXPECT_LT(v, .8 * u);
    EXPECT_GT(v, .4 * u);
    if (e == 1.5) {
      EXPECT_NEAR(v / u, 1 / (1 + 2. / 3. * c * u), .04);
    }
  }
}

/* Dropped from height 1: undamped, it comes back with the energy it had; damped, each bounce is lower, and the energy
   with the elastic one never rises. */
TEST(ContactLaw, DropAndBounce)
{
  for (double c : {0., .1}) {
    const Bounce ball{{{1, 2}, MakeLaw(1e4, 1.5, c, 0, 1)}, 9.81};
    double       y = 1, v = 0, last = 1, before = 9.81, low = 0;
    int          bounces = 0;
    for (int k = 0; k < 40000 && bounces < 4; k++) {
      const double rising = v;
      ball.step(y, v, 1e-4);
      const double d = std::max(0., -y), energy = v * v / 2 + 9.81 * y + 1e4 * std::pow(d, 2.5) / 2.5;
      EXPECT_LE(energy, before + 1e-5); /* N v h is 4e-5 at the end of the step in which contact begins */
      before = energy;
      low    = std::min(low, y);
      if (rising > 0 && v <= 0) {
        bounces++;
        if (c == 0) {
          EXPECT_NEAR(y, 1, 1e-5);
        } else {
          EXPECT_LT(y, .95 * last);
        }
        last = y;
      }
    }
    EXPECT_EQ(bounces, 4);
    EXPECT_LT(low, -.02);
  }
}

/* ---- shapes ---- */

TEST(ContactShapes, SphereOnPlane)
{
  ExpectTouch(TouchAt<SpherePlaneShape>({2, 2}, {3, 4, 1.9}), .1, {0, 0, 1}, {3, 4, -.1});
  ExpectTouch(TouchAt<SpherePlaneShape>({2, 2}, {3, 4, 2.5}), -.5, {0, 0, 1}, {3, 4, .5});
  ExpectTouch(TouchAt<SpherePlaneShape>({2, 1}, {3, 1.5, 0}), .5, {0, 1, 0}, {3, -.5, 0}); /* disc of a planar scene */
}

/* upright ellipsoids by their semiaxes; a turned one by its support function */
TEST(ContactShapes, EllipsoidOnPlane)
{
  const EllipsoidPlaneShape::Data d{{1, 2, 3}, 2};
  ExpectTouch(TouchAt<EllipsoidPlaneShape>(d, {5, 6, 2.8}), .2, {0, 0, 1}, {5, 6, -.2});
  const Mat3<double> lying = Eigen::AngleAxisd(M_PI / 2, Vec3<double>::UnitX()).toRotationMatrix();
  ExpectTouch(TouchAt<EllipsoidPlaneShape>(d, {5, 6, 2.8}, lying), -.8, {0, 0, 1}, {5, 6, .8});
  const Mat3<double> tilted = Eigen::AngleAxisd(M_PI / 4, Vec3<double>::UnitX()).toRotationMatrix();
  const double       reach  = std::sqrt((4 + 9) / 2.);
  const auto         t      = TouchAt<EllipsoidPlaneShape>(d, {0, 0, 2}, tilted);
  EXPECT_NEAR(t.depth, reach - 2, 1e-14);
  const Vec3<double> local = tilted.transpose() * (t.p - Vec3<double>(0, 0, 2));
  EXPECT_NEAR(local(0) * local(0) + local(1) * local(1) / 4 + local(2) * local(2) / 9, 1, 1e-14); /* on the surface */
  EXPECT_NEAR(t.p(2), 2 - reach, 1e-14);                                                          /* and lowest */
}

TEST(ContactShapes, EllipsoidWithEqualSemiaxesIsASphere)
{
  Random random(29);
  for (int k = 0; k < 20; k++) {
    Frame<double>                            f[2] = {random.frame(), random.frame()};
    const Twist<double>                      w[2] = {random.twist(), random.twist()};
    const Contact<SpherePlaneShape>::Data    sphere{{1.3, 2}, SomeLaw(random)};
    const Contact<EllipsoidPlaneShape>::Data ellipsoid{{{1.3, 1.3, 1.3}, 2}, sphere.law};
    Press<SpherePlaneShape>(sphere.shape, f, .2);
    ForceJacobian<2, 0> a, b;
    Wrench<double>      on_a[2], on_b[2];
    Contact<SpherePlaneShape>::jacobian(sphere, f, w, 0, nullptr, on_a, a);
    Contact<EllipsoidPlaneShape>::jacobian(ellipsoid, f, w, 0, nullptr, on_b, b);
    ExpectClose(checks::ToVector<2>(on_b), checks::ToVector<2>(on_a), 1e-12, "wrenches");
    ExpectClose(b.frames, a.frames, 1e-12, "d wrenches/d frames");
    ExpectClose(b.twists, a.twists, 1e-12, "d wrenches/d twists");
  }
}

/* a wheel about the y axis, leaning by an angle towards lying flat */
TEST(ContactShapes, TorusOnPlane)
{
  const TorusPlaneShape::Data d{2, .5};
  auto leaning = [](double a) { return Eigen::AngleAxisd(a - M_PI / 2, Vec3<double>::UnitX()).toRotationMatrix(); };
  ExpectTouch(TouchAt<TorusPlaneShape>(d, {7, 8, 2.4}, leaning(0)), .1, {0, 0, 1}, {7, 8, -.1});
  for (double a : {.3, M_PI / 4, 1.5}) {
    /* z_i is at (0, cos a, sin a), so the circle's lowest point is at 2 (0, sin a, -cos a) */
    const double reach = 2 * std::cos(a) + .5;
    ExpectTouch(TouchAt<TorusPlaneShape>(d, {7, 8, 2}, leaning(a)), reach - 2, {0, 0, 1},
                {7, 8 + 2 * std::sin(a), 2 - reach}, 1e-13);
  }
}

/* flat: the middle of the ring; differentiable through it */
TEST(ContactShapes, TorusLyingFlat)
{
  const TorusPlaneShape::Data d{2, .5};
  ExpectTouch(TouchAt<TorusPlaneShape>(d, {7, 8, .4}), .1 + 2 * .375e-3, {0, 0, 1}, {7, 8, -.1});
  Random random(31);
  for (double tilt : {0., 1e-4, .9e-3, 1.1e-3}) {
    const Mat3<double>         R    = Eigen::AngleAxisd(tilt, random.direction()).toRotationMatrix();
    const Frame<double>        f[2] = {{Vec3<double>(7, 8, .4), R}, origin};
    const Twist<double>        w[2] = {random.twist(), random.twist()};
    Encounter<TorusPlaneShape> s(random);
    std::copy(f, f + 2, s.f);
    std::copy(w, w + 2, s.w);
    s.d.shape                = d;
    const DynamicVector rate = Difference([&](double h) { return s.depthAfter(h); }, 2e-6);
    EXPECT_NEAR(s.rate(s.touch()), rate(0), 1e-7);
    const Contact<TorusPlaneShape>::Data contact{d, MakeLaw(3, 1.5, .2, .5, 1)};
    ForceJacobian<2, 0>                  J;
    Wrench<double>                       on[2];
    DynamicMatrix                        frames(12, 12);
    Contact<TorusPlaneShape>::jacobian(contact, f, w, 0, nullptr, on, J);
    for (int a = 0; a < 12; a++)
      frames.col(a) = Difference(
          [&](double h) {
            Frame<double>  g[2] = {f[0], f[1]};
            Wrench<double> moved[2];
            g[a / 6] = Moved(f[a / 6], a % 6, h);
            Contact<TorusPlaneShape>::wrench(contact, g, w, 0, nullptr, moved);
            return checks::ToVector<2>(moved);
          },
          2e-6);
    ExpectClose(J.frames, frames, 1e-7, "d wrenches/d frames");
  }
}

TEST(ContactShapes, SphereOnSphere)
{
  ExpectTouch(TouchAt<SphereSphereShape>({1, 2}, {0, 2.8, 0}), .2, {0, 1, 0}, {0, 1.9, 0}, 1e-11);
  ExpectTouch(TouchAt<SphereSphereShape>({1, 2}, {4, 0, 3}), -2, {.8, 0, .6}, {2.4, 0, 1.8}, 1e-11);
  const auto inside = TouchAt<SphereSphereShape>({1, 2}, {0, 0, 0});
  EXPECT_TRUE(inside.n.allFinite() && inside.p.allFinite());
  EXPECT_EQ(inside.n.norm(), 0);
}

/* exchanged spheres exchange their wrenches */
TEST(ContactShapes, SpheresExchanged)
{
  Random random(37);
  for (int k = 0; k < 20; k++) {
    const Encounter<SphereSphereShape> s(random);
    const Frame<double>                f[2] = {s.f[1], s.f[0]};
    const Twist<double>                w[2] = {s.w[1], s.w[0]};
    Wrench<double>                     on[2], exchanged[2];
    Contact<SphereSphereShape>::wrench(s.d, s.f, s.w, 0, nullptr, on);
    Contact<SphereSphereShape>::wrench({{s.d.shape.radius_j, s.d.shape.radius_i}, s.d.law}, f, w, 0, nullptr,
                                       exchanged);
    for (int m = 0; m < 2; m++) {
      EXPECT_LT((on[m].f - exchanged[1 - m].f).norm(), 1e-11 * (1 + on[m].f.norm()));
      EXPECT_LT((on[m].m - exchanged[1 - m].m).norm(), 1e-11 * (1 + on[m].m.norm()));
    }
  }
}

TEST(ContactShapes, SphereOnBox)
{
  const SphereBoxShape::Data d{1, {1, 2, 3}};
  const double               r2 = std::sqrt(.5), r3 = std::sqrt(1 / 3.);
  /* faces */
  ExpectTouch(TouchAt<SphereBoxShape>(d, {.5, 1, 3.8}), .2, {0, 0, 1}, {.5, 1, 2.8});
  ExpectTouch(TouchAt<SphereBoxShape>(d, {-2.5, 1, 2}), -.5, {-1, 0, 0}, {-1.5, 1, 2});
  /* edges, corners */
  ExpectTouch(TouchAt<SphereBoxShape>(d, {1.6, -2.8, 1}), 0, {.6, -.8, 0}, {1, -2, 1}, 1e-13);
  ExpectTouch(TouchAt<SphereBoxShape>(d, {1.5, .3, -3.5}), 1 - r2, {r2, 0, -r2}, {1.5 - r2, .3, -3.5 + r2});
  ExpectTouch(TouchAt<SphereBoxShape>(d, {-1.5, 2.5, 3.5}), 1 - .5 / r3, {-r3, r3, r3},
              {-1.5 + r3, 2.5 - r3, 3.5 - r3});
  /* centre inside, nearest the face x = 1; on the face; on the very corner */
  ExpectTouch(TouchAt<SphereBoxShape>(d, {.9, 1, 2}), 1.1, {1, 0, 0}, {-.1, 1, 2});
  ExpectTouch(TouchAt<SphereBoxShape>(d, {1, 1, 2}), 1, {1, 0, 0}, {0, 1, 2});
  EXPECT_NEAR(TouchAt<SphereBoxShape>(d, {1, 2, 3}).n.norm(), 1, 1e-14);
  EXPECT_NEAR(TouchAt<SphereBoxShape>(d, {1 + 3e-16, 2 + 5e-16, 3}).n.norm(), 1, 1e-14);
  /* a box without end along z, as planar scenes have it */
  ExpectTouch(TouchAt<SphereBoxShape>({1, {1, 2, std::numeric_limits<double>::infinity()}}, {.9, 1, 0}), 1.1, {1, 0, 0},
              {-.1, 1, 0});
}

/* depth and normal go over continuously from face to edge to corner, and through a face */
TEST(ContactShapes, SphereOnBoxIsContinuous)
{
  const SphereBoxShape::Data d{1, {1, 2, 3}};
  const double               e         = 1e-9;
  const Vec3<double>         borders[] = {{1, 1, 3.5}, {1, 2, 3.5}, {1.3, 2, 3.5}, {.5, 1.5, 3}};
  for (const Vec3<double> &x : borders)
    for (int k = 0; k < 8; k++) {
      const Vec3<double> step(k & 1 ? e : -e, k & 2 ? e : -e, k & 4 ? e : -e);
      const auto         here = TouchAt<SphereBoxShape>(d, x), there = TouchAt<SphereBoxShape>(d, x + step);
      EXPECT_NEAR(here.depth, there.depth, 4 * e);
      EXPECT_LT((here.n - there.n).norm(), 10 * e);
    }
}

/* a centre inside the box: away from where two faces are equally near, the derivatives are right as well */
TEST(ContactShapes, SphereInsideBox)
{
  CheckForce<Contact<SphereBoxShape>>([](Random &random, Frame<double> *f) {
    f[0].x = f[1].x + f[1].R * Vec3<double>(random(-.5, .5), random(-.5, .5), random(.8, .9));
    return Contact<SphereBoxShape>::Data{{.4, {1, 1, 1}}, SomeLaw(random)};
  });
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
  const std::vector<std::string> &errors     = scene.data().errors;
  EXPECT_EQ(errors.size(), std::size(expected));
  for (const char *start : expected) {
    const auto found =
        std::find_if(errors.begin(), errors.end(), [&](const std::string &e) { return e.find(start) == 0; });
    EXPECT_NE(found, errors.end()) << "no error begins with: " << start;
  }
  for (const ElementData &e : scene.data().elements) EXPECT_TRUE(e.parts.empty());
}

/* A ball thrown along the plane without spin ends up rolling at 5/7 of its speed, sunk in to where k d^e is its weight.
   The forces eliminated and carried as states alike. */
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
    ASSERT_EQ(TSSetMaxTime(ts, .2), 0); /* slips until 2/7 u/(mu g) = .097 */
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
