/* Observed order of convergence at fixed steps, from the errors over the run for h and h/2 */
#include "support.h"

using namespace hhtest;

namespace
{

struct Setting {
  const char *name, *options;
};

const Setting second_order[] = {{"alpha -0.05", "-ts_hhtdae_alpha -0.05"},
                                {"alpha -0.3", "-ts_hhtdae_alpha -0.3"},
                                {"alpha -1/3", "-ts_hhtdae_alpha -0.33333333333333331"},
                                {"radius 0", "-ts_hhtdae_radius 0"},
                                {"radius 0.5", "-ts_hhtdae_radius 0.5"},
                                {"radius 0.9", "-ts_hhtdae_radius 0.9"}};
const Setting paper[]        = {{"paper -0.05", "-ts_hhtdae_form paper -ts_hhtdae_alpha -0.05"},
                                {"paper -0.3", "-ts_hhtdae_form paper -ts_hhtdae_alpha -0.3"},
                                {"paper -1/3", "-ts_hhtdae_form paper -ts_hhtdae_alpha -0.33333333333333331"}};

struct Orders {
  double q, v, lambda, other;
};

Orders measure(const Problem &p, const Setting &s, int steps)
{
  const ProblemErrors coarse = fixedStepErrors(p, steps, s.options), fine = fixedStepErrors(p, 2 * steps, s.options);
  const Orders        o = {order(coarse.q, fine.q), order(coarse.v, fine.v), order(coarse.lambda, fine.lambda),
                           order(coarse.other, fine.other)};
  MEASURED(
      "%-15s %-12s order q %.2f, q' %.2f, lambda %.2f, others %.2f; errors q %.1e, q' %.1e, lambda %.1e, others %.1e",
      p.name.c_str(), s.name, o.q, o.v, o.lambda, o.other, fine.q, fine.v, fine.lambda, fine.other);
  return o;
}

void expectSecondOrder(const Problem &p, const Setting &s, int steps, bool lambda, bool others = false)
{
  SCOPED_TRACE(p.name + ", " + s.name);
  const Orders o = measure(p, s, steps);
  EXPECT_GE(o.q, 1.95);
  EXPECT_GE(o.v, 1.95);
  EXPECT_LT(o.q, 3.5); /* a higher order would mean that the measured errors are not those of the method */
  if (lambda) {
    EXPECT_GE(o.lambda, 1.9);
  }
  if (others) {
    EXPECT_GE(o.other, 1.9);
  }
}

} // namespace

TEST(Order, OscillatorsBothForms)
{
  const Oscillators p({1., 3., 7.}, {0., .1, .02}, true, 4.);
  for (const Setting &s : second_order) expectSecondOrder(p, s, 1000, false);
  for (const Setting &s : paper) expectSecondOrder(p, s, 1000, false);
}

TEST(Order, PendulumBothForms)
{
  const Pendulum p(-90., 0., 2.);
  for (const Setting &s : second_order) expectSecondOrder(p, s, 1000, true);
  for (const Setting &s : paper) expectSecondOrder(p, s, 1000, true);
}

TEST(Order, TrapezoidalRuleWithoutConstraints)
{
  for (const char *options : {"-ts_hhtdae_alpha 0", "-ts_hhtdae_form paper -ts_hhtdae_alpha 0"}) {
    const Setting s = {options, options};
    expectSecondOrder(DoublePendulum(1.), s, 800, false);
    expectSecondOrder(Oscillators({1., 3., 7.}, {0., .1, .02}, true, 4.), s, 1000, false);
  }
}

TEST(Order, SecondOrderFormForVariableMass)
{
  const DoublePendulum p(1.);
  for (const Setting &s : second_order) expectSecondOrder(p, s, 800, false);
}

TEST(Order, SecondOrderFormForVariableMassWithConstraints)
{
  const HeavyTop p(.2);
  for (const Setting &s : {second_order[0], second_order[1], second_order[4]}) expectSecondOrder(p, s, 500, true);
}

/* First-order states, user-defined variables and force states */
TEST(Order, SecondOrderFormForStatesAndDefinitions)
{
  const UserVars p(2.);
  for (const Setting &s : second_order) expectSecondOrder(p, s, 1000, true, true);
}

TEST(Order, NonholonomicConstraints)
{
  const Sleigh p(2.);
  for (const Setting &s : {second_order[0], second_order[1], second_order[4]}) expectSecondOrder(p, s, 800, true);
}

/* (9a) divides the inertia at t_{n+1} by 1+alpha and mixes it with M(q_n) q''_n */
TEST(Order, PaperFormIsOfFirstOrderForVariableMass)
{
  const DoublePendulum p(1.);
  for (const Setting &s : paper) {
    SCOPED_TRACE(s.name);
    const Orders o = measure(p, s, 6400);
    EXPECT_GT(o.q, .8);
    EXPECT_LT(o.q, 1.3);
    EXPECT_GT(o.v, .8);
    EXPECT_LT(o.v, 1.3);
  }
}

/* With steps of alternating length, h and 2h set by the user, the order is kept */
TEST(Order, ChangingSteps)
{
  const Pendulum pendulum(-90., 0., 1.5);
  const UserVars uservars(1.5);
  for (const Problem *p : {(const Problem *)&pendulum, (const Problem *)&uservars})
    for (const Setting &s : {second_order[1], second_order[4]}) {
      SCOPED_TRACE(p->name + ", " + s.name);
      double q[2] = {0., 0.}, v[2] = {0., 0.}, lambda[2] = {0., 0.};
      for (int fine = 0; fine < 2; fine++) {
        const double h = p->t1 / (fine ? 1200 : 600);
        Simulation   run(*p, fixedSteps(h) + s.options);
        for (int k = 0; k < (fine ? 800 : 400); k++) {
          must(TSSetTimeStep(run.ts, k % 2 ? 2. * h : h));
          must(run.step());
          if (k % 40 != 39) continue;
          const ProblemErrors e = run.errors();
          widen(q[fine], e.q);
          widen(v[fine], e.v);
          if (k > 40) widen(lambda[fine], e.lambda);
        }
        EXPECT_NEAR(run.t(), p->t1, 1e-9);
      }
      MEASURED("%-15s %-12s changing steps: order q %.2f, q' %.2f, lambda %.2f", p->name.c_str(), s.name,
               order(q[0], q[1]), order(v[0], v[1]), order(lambda[0], lambda[1]));
      EXPECT_GE(order(q[0], q[1]), 1.9);
      EXPECT_GE(order(v[0], v[1]), 1.9);
      EXPECT_GE(order(lambda[0], lambda[1]), 1.8);
    }
}
