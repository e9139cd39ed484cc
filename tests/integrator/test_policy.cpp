/* The corrector's decisions as pure functions of numbers: when an iteration ends, and when a new matrix is due */
#include "integrator/step/policy.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace hht3;

namespace
{

/* The error left when a linear iteration of rate xi, whose first correction is e, is ended by the test, and the number
   of corrections */
struct End {
  double left;
  int    corrections;
};

End iterate(double xi, double e, double tol, double known)
{
  Corrections c;
  for (int k = 1; k <= 10; k++) {
    c.before      = c.last;
    c.last        = e;
    c.with_matrix = k;
    c.left        = 10 - k;
    const Verdict v = JudgeCorrections(c, known, tol, 0.);
    if (k >= 2) known = c.rate();
    if (v == Verdict::Converged) return {e * xi / (1. - xi), k};
    if (v != Verdict::GoOn) return {-1., k};
    e *= xi;
  }
  return {-1., 11};
}

} // namespace

/* (40): whatever the rate, the remaining error is below the tolerance, but not far below it */
TEST(Policy, ErrorLeftIsBelowTheTolerance)
{
  for (double xi : {1e-3, .05, .2, .3})
    for (double e : {1e-3, 1., 30.}) {
      const double tol = 1e-3;
      const End    end = iterate(xi, e, tol, -1.);
      EXPECT_GE(end.left, 0.) << xi << " " << e;
      EXPECT_LE(end.left, tol) << xi << " " << e;
      if (end.corrections > 2) {
        EXPECT_GT(end.left, tol * xi * (1. - 1e-9)) << xi << " " << e;
      }
    }
}

/* A rate known from earlier iterations saves the second correction; it is taken as at least 0.3 */
TEST(Policy, KnownRates)
{
  EXPECT_EQ(iterate(1e-3, 1e-3, 1e-3, -1.).corrections, 2);
  EXPECT_EQ(iterate(1e-3, 1e-3, 1e-3, 1e-3).corrections, 1);
  EXPECT_EQ(iterate(1e-3, 2.2e-3, 1e-3, 1e-3).corrections, 1); /* the limit is 0.3/0.7 of the tolerance */
  EXPECT_EQ(iterate(1e-3, 2.5e-3, 1e-3, 1e-3).corrections, 2);
  EXPECT_EQ(iterate(.5, 1e-4, 1e-3, -1.).corrections, 1); /* so small that it is accepted with any rate */
}

TEST(Policy, WhatCannotConverge)
{
  const double tol = 1e-3;
  EXPECT_EQ(JudgeCorrections({2., 1., 2, 8}, -1., tol, 0.), Verdict::Stalled);
  EXPECT_EQ(JudgeCorrections({1., 1., 2, 8}, -1., tol, 0.), Verdict::Stalled);
  EXPECT_EQ(JudgeCorrections({.9, 1., 2, 8}, -1., tol, 0.), Verdict::Stalled); /* 0.9^8 is larger than 1e-4 */
  EXPECT_EQ(JudgeCorrections({.2, 1., 2, 8}, -1., tol, 0.), Verdict::GoOn);
  EXPECT_EQ(JudgeCorrections({.2, 1., 2, 0}, -1., tol, 0.), Verdict::Stalled);
  EXPECT_EQ(JudgeCorrections({1., 0., 1, 0}, -1., tol, 0.), Verdict::TooMany);
  EXPECT_EQ(JudgeCorrections({1., .5, 5, 3}, -1., tol, 1.), Verdict::Converged); /* corrections of the size of rounding */
}

/* The error of a Krylov solve in the first correction may exceed the correction of the positions; the rate is known
   only from the third correction */
TEST(Policy, RoughSolves)
{
  EXPECT_EQ(JudgeCorrections({2., 1., 2, 8, true}, -1., 1e-3, 0.), Verdict::GoOn);
  EXPECT_EQ(JudgeCorrections({2., 1., 3, 7, true}, -1., 1e-3, 0.), Verdict::Stalled);
  EXPECT_EQ(JudgeCorrections({2., 1., 2, 0, true}, -1., 1e-3, 0.), Verdict::Stalled);
  EXPECT_EQ(JudgeCorrections({1e-6, 1., 2, 8, true}, -1., 1e-3, 0.), Verdict::Converged);
}

/* One matrix is used as long as h stays near that of the matrix and corrections converge */
TEST(Policy, MatrixServesManySteps)
{
  const ReuseOptions o;
  MatrixPolicy       m;
  EXPECT_TRUE(m.due(1., o));
  m.made(1.);
  m.learn(true, false, .01, o);
  for (double h : {1., 1.39, 1. / 1.39}) EXPECT_FALSE(m.due(h, o)) << h;
  for (double h : {1.41, 1. / 1.41}) EXPECT_TRUE(m.due(h, o)) << h;
  m.fresh = PETSC_FALSE;
  m.learn(true, false, .3, o); /* too slow */
  EXPECT_TRUE(m.due(1., o));
  m.made(1.);
  m.learn(true, false, .1, o);
  EXPECT_FALSE(m.due(1., o));
  m.forget();
  EXPECT_TRUE(m.due(1., o));
}

/* With a matrix that needs no factorization the limit of the rate is lower: a new matrix costs less than additional
   corrections, unless the user has set the limit */
TEST(Policy, RateWithoutFactor)
{
  ReuseOptions o;
  EXPECT_EQ(o.of(false).slow_rate, o.slow_rate);
  EXPECT_LT(o.of(true).slow_rate, o.slow_rate);
  EXPECT_EQ(o.of(true).ratio, o.ratio);
  o.given = PETSC_TRUE;
  EXPECT_EQ(o.of(true).slow_rate, o.slow_rate);
}

/* If old matrices fail repeatedly, they are tried less and less often; after one success the policy is as before */
TEST(Policy, ReuseBacksOff)
{
  const ReuseOptions o;
  MatrixPolicy       m;
  int                steps[8] = {};
  for (int failure = 0; failure < 8; failure++) {
    m.made(1.); /* the correction is repeated with a new matrix */
    m.learn(true, true, .1, o);
    while (m.due(1., o)) {
      steps[failure]++;
      ASSERT_LT(steps[failure], 100);
      m.made(1.);
      m.learn(true, false, .1, o);
    }
    m.fresh = PETSC_FALSE; /* an old matrix is tried again, and fails */
  }
  const int expected[8] = {1, 2, 4, 8, 16, 32, 32, 32};
  for (int k = 0; k < 8; k++) EXPECT_EQ(steps[k], expected[k]) << k;
  m.learn(true, false, .1, o); /* the old matrix succeeds */
  m.made(1.);
  m.learn(true, true, .1, o);
  EXPECT_EQ(m.renew_steps, 1);
}
