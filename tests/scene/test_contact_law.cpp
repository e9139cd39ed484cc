/* Properties of the contact law: smoothness, impact, friction */
#include "contact_cases.h"

using namespace hhtdae;

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

TEST(ContactLaw, ExponentsByTheirShortCuts)
{
  for (double e : {1., 1.0000001, 1.5, 1.5000001})
    EXPECT_NEAR(ElasticForce<double>(MakeLaw(2, e, 0, 0, 1), .3), 2 * std::pow(.3, e), 1e-14);
}

/* During fast separation the force is zero, where Hunt and Crossley's law would pull; at rest N = k d^e, with the
   damping factor 1 + c d' */
TEST(ContactLaw, DampingFactor)
{
  const ContactLaw     law = MakeLaw(10, 2, 2, 0, 1);
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
  const ContactLaw     law = MakeLaw(10, 1.5, 0, .4, 1e-2);
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

/* A ball of mass 1 and radius 1 on the plane, moving along the normal; returns height above the plane and velocity */
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

/* Without gravity the law gives v dv/(1 + c d') = -k d^e dd. Its integral is the same for approach and separation,
   hence v/c - ln(1 + c v)/c^2 is equal at u (approach) and -u' (separation), whatever k and e */
TEST(ContactLaw, SpeedAfterImpact)
{
  for (double e : {1., 1.5, 2.}) {
    const double c = .3, u = 2;
    const Bounce ball{{{1, 2}, MakeLaw(1e3, e, c, .5, 1)}, 0};
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

/* Dropped from height 1: without damping the ball comes back with its energy; with damping each bounce is lower, and
   the energy including the elastic one never increases */
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
