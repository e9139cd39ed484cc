/* Screw, gear, rack and pinion, couplers of three joints: derivatives, full turns, transmission of motion and load */
#include "kernel_checks.h"
#include "scene/kernels/coupler.h"

using namespace hhtdae;

namespace
{

/* A random instance at a random state, whose counted angle is some turns away from the principal angle */
template <class K> typename K::Data Begin(Random &random, Frame<double> *f, typename K::Data d)
{
  for (int k = 0; k < K::markers; k += 2)
    while (std::abs(f[k].R.col(0).dot(f[k + 1].R.col(2))) > .9) f[k].R = random.rotation();
  K::begin(d, f);
  for (double &m : d.memory) m += kTurn * std::round(random(-3, 3)) + .1;
  d.start = random(-1, 1);
  return d;
}

template <int N, int R> typename CouplerRow<N, R>::Data Coupled(Random &random, Frame<double> *f)
{
  typename CouplerRow<N, R>::Data d;
  for (double &c : d.factor) c = random(-2, 2);
  d.axis = int(random(0, 2.999));
  return Begin<CouplerRow<N, R>>(random, f, d);
}

Frame<double> Turned(const Frame<double> &j, double angle, double advance = 0)
{
  return {j.x + advance * j.R.col(2), j.R * Eigen::AngleAxisd(angle, Vec3<double>::UnitZ()).toRotationMatrix()};
}

template <class K> double Row(const typename K::Data &d, const Frame<double> *f)
{
  double phi;
  K::template value<double>(d, f, 0., &phi);
  return phi;
}

} // namespace

TEST(CouplerKernels, DerivativesOfTwoTerms)
{
  CheckConstraint<CouplerRow<2, 2>>(Coupled<2, 2>, 1);
  CheckConstraint<CouplerRow<2, 1>>(Coupled<2, 1>, 2);
  CheckConstraint<CouplerRow<2, 0>>(Coupled<2, 0>, 3);
}

TEST(CouplerKernels, DerivativesOfThreeTerms)
{
  CheckConstraint<CouplerRow<3, 3>>(Coupled<3, 3>, 4);
  CheckConstraint<CouplerRow<3, 1>>(Coupled<3, 1>, 5);
}

TEST(CouplerKernels, DerivativesOfTheScrew)
{
  CheckConstraint<ScrewRow>([](Random &random, Frame<double> *f) {
    ScrewRow::Data d;
    d.pitch = random(-2, 2);
    return Begin<ScrewRow>(random, f, d);
  });
}

/* Two wheels over many turns: if each step is below half a turn and ends with accept(), the constraint stays
   satisfied; for a wrong ratio it does not */
TEST(CouplerKernels, GearTransmitsManyTurns)
{
  using Gear = CouplerRow<2, 2>;
  Random              random(6);
  const Frame<double> j1 = random.frame(), j2 = random.frame();
  const double        ratio = 2.5, first = .4, second = -.7;
  Gear::Data          d;
  d.factor[0]     = 1;
  d.factor[1]     = ratio;
  const auto pose = [&](double turn, double error, Frame<double> *f) { /* angle_1 + ratio angle_2 = start */
                                                                       f[0] = Turned(j1, first + turn);
                                                                       f[1] = j1;
                                                                       f[2] = Turned(j2, second - turn / ratio + error);
                                                                       f[3] = j2;
  };
  Frame<double> f[4];
  pose(0, 0, f);
  Gear::begin(d, f);
  EXPECT_NEAR(d.start, first + ratio * second, 1e-14);
  for (int k = 1; k <= 60; k++) {
    pose(1.3 * k, 0, f);
    EXPECT_NEAR(Row<Gear>(d, f), 0, 1e-12) << k;
    Gear::accept(d, f);
    EXPECT_NEAR(d.memory[0], first + 1.3 * k, 1e-12);
    EXPECT_NEAR(d.memory[1], second - 1.3 * k / ratio, 1e-12);
  }
  pose(1.3 * 60, .01, f);
  EXPECT_NEAR(Row<Gear>(d, f), -ratio * .01, 1e-12);
}

/* value() does not change the counted angle: a rejected step leaves no trace, however far it went */
TEST(CouplerKernels, OnlyAcceptedStepsAreRemembered)
{
  using Gear = CouplerRow<2, 2>;
  Random              random(7);
  const Frame<double> j    = random.frame();
  Frame<double>       f[4] = {Turned(j, 3), j, Turned(j, 0), j};
  Gear::Data          d;
  d.factor[0] = 1;
  Gear::begin(d, f);
  f[0] = Turned(j, 3.5);
  for (int k = 0; k < 3; k++) EXPECT_NEAR(Row<Gear>(d, f), -.5, 1e-14); /* beyond pi without a jump */
  EXPECT_NEAR(d.memory[0], 3, 1e-14);
}

/* x = r phi; a unit multiplier pushes the rack with a unit force and turns the pinion's body with the moment -r about z */
TEST(CouplerKernels, RackAndPinion)
{
  using Rack = CouplerRow<2, 1>;
  Random              random(8);
  const double        radius = .3;
  const Frame<double> j1 = random.frame(), j2 = random.frame();
  Frame<double>       f[4] = {Turned(j1, 1), j1, Turned(j2, 0, 2), j2};
  Rack::Data          d;
  d.factor[0] = -radius;
  d.factor[1] = 1;
  Rack::begin(d, f);
  double angle = 1;
  for (int k = 1; k <= 20; k++) {
    angle += 2;
    f[0] = Turned(j1, angle);
    f[2] = Turned(j2, 0, 2 + radius * (angle - 1));
    EXPECT_NEAR(Row<Rack>(d, f), 0, 1e-12);
    Rack::accept(d, f);
  }
  Rack::Gradient J;
  Rack::gradient(d, f, 0, J);
  EXPECT_NEAR((-J.segment<3>(12).transpose() - j2.R.col(2)).norm(), 0, 1e-14);
  EXPECT_NEAR((-J.segment<3>(3).transpose() + radius * j1.R.col(2)).norm(), 0, 1e-13);
  EXPECT_EQ(J.segment<3>(0).norm(), 0);
}

/* A screw advances by its pitch in each turn; its multiplier is the axial force on i's body, together with the moment
   -pitch/(2 pi) times the multiplier */
TEST(CouplerKernels, ScrewAdvancesByItsPitch)
{
  Random              random(9);
  const Frame<double> j = random.frame();
  ScrewRow::Data      d;
  d.pitch            = .05;
  Frame<double> f[2] = {Turned(j, -2, .4), j};
  ScrewRow::begin(d, f);
  for (int k = 1; k <= 40; k++) {
    f[0] = Turned(j, -2 + k * kTurn / 4, .4 + k * .05 / 4);
    EXPECT_NEAR(Row<ScrewRow>(d, f), 0, 1e-13) << k;
    ScrewRow::accept(d, f);
  }
  ScrewRow::Gradient J;
  ScrewRow::gradient(d, f, 0, J);
  EXPECT_NEAR((-J.segment<3>(0).transpose() - j.R.col(2)).norm(), 0, 1e-14);
  EXPECT_NEAR((-J.segment<3>(3).transpose() + .05 / kTurn * j.R.col(2)).norm(), 0, 1e-14);
}

/* A common rigid motion of all markers leaves every constraint unchanged, so that it is not loaded */
TEST(CouplerKernels, CommonMotionIsFree)
{
  Random random(10);
  for (int k = 0; k < 10; k++) {
    Frame<double>       f[6];
    const Twist<double> w = random.twist();
    Matrix<36, 1>       u;
    for (int m = 0; m < 6; m++) f[m] = random.frame();
    const auto d = Coupled<3, 2>(random, f);
    for (int m = 0; m < 6; m++) u.segment<6>(6 * m) << w.v + w.w.cross(f[m].x), w.w;
    CouplerRow<3, 2>::Gradient J;
    CouplerRow<3, 2>::gradient(d, f, 0, J);
    EXPECT_NEAR((J * u)(0), 0, 1e-12);
  }
}
