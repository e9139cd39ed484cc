/* The formulas of the method are exact for polynomials and consistent with each other; error constants are measured */
#include "integrator/step/bdf.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace hht3;

/* Spectral radius of one step of HHT for q'' = -w^2 q, h = 1, measured by the growth of a run of it */
static double Growth(double alpha, double gamma, double beta, double w)
{
  const int    steps = 4000;
  const double K     = w * w, M = 1 + (1 + alpha) * K * beta;
  double       q = 1, v = .3 * w, a = -.7 * K, log = 0;
  for (int n = 0; n <= steps; n++) {
    const double size = std::sqrt(q * q + v * v / K + a * a / K / K);
    if (n > steps / 2) log += std::log(size);
    q /= size, v /= size, a /= size;
    const double predicted = q + v + (.5 - beta) * a, now = (-(1 + alpha) * K * predicted + alpha * K * q) / M;
    q = predicted + beta * now;
    v += (1 - gamma) * a + gamma * now;
    a = now;
  }
  return std::exp(log / (steps - steps / 2));
}

TEST(Formulas, HHTParametersOfThePaper)
{
  for (double alpha : {0., -.05, -.3, -1. / 3.}) {
    const Parameters p = HHTParameters(alpha, true);
    /* A step of length 1 from q = v = a = 0 with the force t: (9a) gives the acceleration, (2) the position, whose
       error from 1/6 is k times the change of a */
    const double a = 1 / p.ca(), q = p.beta * a;
    EXPECT_NEAR(a, 1 + alpha, 1e-15);
    EXPECT_NEAR(q - 1. / 6., p.k * a, 1e-15) << alpha;
    /* The spectral radius at infinite frequency is a double root */
    EXPECT_NEAR(Growth(alpha, p.gamma, p.beta, 1e8), p.rho, 1e-3) << alpha;
    /* Of second order and without damping at low frequencies, here with 1,000 steps per period */
    EXPECT_NEAR(Growth(alpha, p.gamma, p.beta, 2 * M_PI / 1000), 1, 1e-6) << alpha;
  }
  EXPECT_DOUBLE_EQ(HHTParameters(0, true).k, 1. / 12.);
}

TEST(Formulas, RadiusParametersAreSecondOrderAccurate)
{
  for (double rho : {0., .3, .5, .9, 1.}) {
    const Parameters p = RadiusParameters(rho);
    EXPECT_NEAR(p.gamma, .5 - p.am + p.af, 1e-15);
    EXPECT_NEAR(p.gamma, .5 - p.lag(), 1e-15);
    EXPECT_NEAR(p.gamma_s, .5 - p.lagState(), 1e-15);
    EXPECT_GE(p.beta, .25 + (p.af - p.am) / 2 - 1e-15); /* unconditional stability */
    EXPECT_LE(p.am, p.af + 1e-15);
    EXPECT_LE(p.af, .5 + 1e-15);
  }
}

/* HHT with alpha = -1/3 is Chung and Hulbert's method with radius 1/2 */
TEST(Formulas, BothFamiliesMeetAtOneHalf)
{
  const Parameters a = HHTParameters(-1. / 3., false), b = RadiusParameters(.5);
  EXPECT_NEAR(a.am, b.am, 1e-15);
  EXPECT_NEAR(a.af, b.af, 1e-15);
  EXPECT_NEAR(a.gamma, b.gamma, 1e-15);
  EXPECT_NEAR(a.beta, b.beta, 1e-15);
  EXPECT_NEAR(a.k, b.k, 1e-15);
}

/* (2a) and (2b) */
static double NewmarkPosition(const Parameters &p, double h, double q, double v, double a0, double a1) { return q + (h * v + OldPosition(p, h) * a0 + ScalePosition(p, h) * a1); }
static double NewmarkVelocity(const Parameters &p, double h, double v, double a0, double a1) { return v + (OldVelocity(p, h) * a0 + ScaleVelocity(p, h) * a1); }

TEST(Formulas, NewmarkIsExactForConstantAcceleration)
{
  const Parameters p = HHTParameters(-.3, false);
  EXPECT_NEAR(NewmarkPosition(p, .1, 2., 3., 4., 4.), 2 + .1 * 3 + .005 * 4, 1e-15);
  EXPECT_NEAR(NewmarkVelocity(p, .1, 3., 4., 4.), 3.4, 1e-15);
}

/* With q''' = 1, a_n = lag h and a_{n+1} = (1 + lag) h by definition of the lag: the error in q is k h^2 (a_{n+1} -
 * a_n) */
TEST(Formulas, ErrorConstantOfThePosition)
{
  for (double rho : {0., .5, .9, 1.}) {
    const Parameters p = RadiusParameters(rho);
    const double     h = .5, a0 = p.lag() * h, a1 = (1 + p.lag()) * h;
    EXPECT_NEAR(NewmarkPosition(p, h, 0., 0., a0, a1) - h * h * h / 6, p.k * h * h * (a1 - a0), 1e-15);
    EXPECT_NEAR(NewmarkVelocity(p, h, 0., a0, a1), h * h / 2, 1e-15); /* q' is exact, which is the purpose of the lag */
  }
  for (double alpha : {-.05, -.3}) {
    const Parameters p = HHTParameters(alpha, false);
    const double     h = .5, a0 = p.lag() * h, a1 = (1 + p.lag()) * h;
    EXPECT_NEAR(NewmarkPosition(p, h, 0., 0., a0, a1) - h * h * h / 6, p.k * h * h * (a1 - a0), 1e-15);
    EXPECT_NEAR(NewmarkVelocity(p, h, 0., a0, a1), h * h / 2, 1e-15);
  }
}

/* s = t^3/6 in steps of 1, where w is a polynomial of second degree; for comparison, the error constant of backward
   differentiation of second order is 1/3 */
TEST(Formulas, ErrorConstantOfAState)
{
  for (double rho : {0., .1, .3, .5, .9, 1.}) {
    const Parameters p = RadiusParameters(rho);
    const double     l = p.lagState();
    const auto       w = [&](double t) { return t * t / 2. + l * t + l * (p.am_s - .5); };
    for (double t : {0., 1., 7.}) {
      const double average = (1. - p.am_s) * w(t + 1.) + p.am_s * w(t), rates = (1. - p.af_s) * (t + 1.) * (t + 1.) / 2. + p.af_s * t * t / 2.;
      EXPECT_NEAR(average, rates, 1e-13);
      EXPECT_NEAR(t * t * t / 6. + (1. - p.gamma_s) * w(t) + p.gamma_s * w(t + 1.) - std::pow(t + 1., 3) / 6., p.k_s, 1e-13) << rho;
    }
  }
  EXPECT_NEAR(RadiusParameters(0.).k_s, 1. / 3., 1e-15);
}

/* The scalings turn shifts into the derivatives of (2): sigma_v D_c = gamma h, sigma_a D_c = ca */
TEST(Formulas, ScalingsAndShiftsBelongTogether)
{
  for (double h : {1., 1e-3, 1e-9}) {
    const Parameters p = HHTParameters(-.2, true);
    EXPECT_NEAR(ShiftA(p, h) * ScalePosition(p, h) / p.ca(), 1., 1e-14);
    EXPECT_NEAR(ShiftV(p, h) * ScalePosition(p, h) / ScaleVelocity(p, h), 1., 1e-14);
    /* for the column of a state, d s'/d w over d s/d w is the same sigma_v */
    const double dw = (1 - p.am_s) / (1 - p.af_s);
    EXPECT_NEAR(ShiftV(p, h) * ScaleState(p, h) / dw, 1., 1e-13);
  }
}

TEST(Formulas, CorrectorStopsByTheRate)
{
  EXPECT_DOUBLE_EQ(CorrectorError(.5, 2.), 2.); /* (40): xi/(1-xi) */
  EXPECT_DOUBLE_EQ(CorrectorError(.1, 9.), 1.);
  EXPECT_EQ(CorrectorError(1., 1.), PETSC_MAX_REAL);
  EXPECT_EQ(CorrectorError(2., 1.), PETSC_MAX_REAL);
}

/* Backward differentiation: textbook values at constant steps; at variable steps exact for polynomials up to its order */
TEST(Formulas, BackwardDifferentiation)
{
  const double constant[] = {0., 1., 2. / 3., 6. / 11., 12. / 25., 60. / 137.};
  const double equal[]    = {1., 2., 3., 4., 5., 6.}, uneven[] = {.3, .9, 1.1, 2.2, 2.7, 3.9};
  for (int k = 1; k <= 5; k++) EXPECT_NEAR(hht3::BDFOf(k, equal).gh, constant[k], 1e-15);
  EXPECT_NEAR(hht3::BDFOf(3, equal).c[0], 18. / 11., 1e-14);
  EXPECT_NEAR(hht3::BDFOf(3, equal).c[1], -9. / 11., 1e-14);
  EXPECT_NEAR(hht3::BDFOf(3, equal).c[2], 2. / 11., 1e-14);
  for (int k = 1; k <= 5; k++) {
    const hht3::BDF b = hht3::BDFOf(k, uneven);
    for (int m = 0; m <= k + 1; m++) { /* q = t^m about t_{n+1} */
      double psi = 0.;
      for (int j = 0; j < k; j++) psi += b.c[j] * std::pow(-uneven[j], m);
      const double derivative = ((m == 0) - psi) / b.gh, missed = std::abs(derivative - (m == 1));
      if (m <= k) {
        EXPECT_NEAR(missed, 0., 1e-12) << k << " " << m;
        continue;
      }
      /* q[...] of t^{k+1} is 1: the error is gamma h tau_1 ... tau_k */
      double product = b.gh;
      for (int j = 0; j < k; j++) product *= uneven[j];
      EXPECT_NEAR(missed * b.gh, product, 1e-12 * product) << k;
      double t[7] = {}, d[7];
      for (int j = 0; j <= k; j++) t[j + 1] = -uneven[j];
      for (int j = 0; j <= k + 1; j++) d[j] = std::pow(t[j], m);
      for (int n = 1; n <= k + 1; n++)
        for (int j = 0; j + n <= k + 1; j++) d[j] = (d[j] - d[j + 1]) * hht3::DifferenceFactor(t, n, j);
      EXPECT_NEAR(hht3::ErrorFactor(k, uneven) * d[0], product, 1e-11 * product) << k;
    }
    const hht3::Parameters p = hht3::BDFParameters(k, uneven[0], uneven);
    EXPECT_DOUBLE_EQ(p.beta, p.gamma * p.gamma);
    EXPECT_NEAR(hht3::ScaleVelocity(p, uneven[0]), b.gh, 1e-15);
    EXPECT_EQ(p.ca(), 1.);
  }
}

/* Lagrange weights are exact at the nodes and reproduce polynomials between them */
TEST(Formulas, LagrangeWeights)
{
  const double node[] = {1.7, 1.1, .4, -.3, -2.};
  double       weight[5];
  for (int j = 0; j < 5; j++) {
    hht3::LagrangeWeights(4, node, node[j], weight);
    for (int i = 0; i < 5; i++) EXPECT_EQ(weight[i], i == j ? 1. : 0.);
  }
  hht3::LagrangeWeights(4, node, .9, weight);
  for (int m = 0; m <= 4; m++) {
    double sum = 0.;
    for (int i = 0; i < 5; i++) sum += weight[i] * std::pow(node[i], m);
    EXPECT_NEAR(sum, std::pow(.9, m), 1e-13);
  }
}
