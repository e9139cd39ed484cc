/* Constrained systems with little numerical damping: whatever excites oscillations of the multipliers, such as the
   remaining error of the corrector, must not dominate the error test */
#include "support.h"
#include "integrator/formulas.h"

using namespace hhtest;

namespace
{

struct Outcome {
  int    steps;
  double q, v;
};

Outcome run(const Problem &p, const std::string &options)
{
  Simulation s(p, tolerance(1e-5) + options + " -ts_max_steps 20000");
  must(s.solve());
  EXPECT_EQ(s.reason(), TS_CONVERGED_TIME) << options;
  const ProblemErrors e = s.errors();
  MEASURED("%s%s: %d steps, %d rejected, %d iterations, errors q %.1e, q' %.1e, lambda %.1e", p.name.c_str(), options.c_str(),
           (int)s.statistics().steps, (int)s.statistics().rejected, (int)s.statistics().newton, e.q, e.v, e.lambda);
  return {(int)s.statistics().steps, e.q, e.v};
}

/* The result with much damping, as a reference: the worse of two runs, because in a single run the errors at the end
   may cancel */
Outcome muchDamping(const Problem &p)
{
  const Outcome a = run(p, " -ts_hhtdae_alpha -0.3"), b = run(p, " -ts_hhtdae_alpha -0.1");
  return {std::max(a.steps, b.steps), std::max(a.q, b.q), std::max(a.v, b.v)};
}

const std::vector<Factory> &constrained()
{
  static const std::vector<Factory> list = {factory<Pendulum>("pendulum", -90., 0., 2.), factory<FourBar>("fourbar", 2, 2.),
                                            factory<Andrews>("andrews", .03)};
  return list;
}

} // namespace

TEST(LittleDamping, StepsAndErrorsStayWhatTheyAre)
{
  for (const Factory &f : constrained()) {
    const std::unique_ptr<Problem> p = f.make();
    const Outcome                  full = muchDamping(*p);
    for (double alpha : {-.05, -.02, -.01}) {
      const Outcome o = run(*p, text(" -ts_hhtdae_alpha %g", alpha));
      EXPECT_LT(o.steps, 2 * full.steps) << f.name << alpha;
      EXPECT_LT(o.q, 2 * full.q) << f.name << alpha;
      EXPECT_LT(o.v, 2 * full.v) << f.name << alpha;
    }
  }
}

/* Little damping set by a spectral radius */
TEST(LittleDamping, SpectralRadius)
{
  for (const Factory &f : constrained()) {
    const std::unique_ptr<Problem> p = f.make();
    const Outcome                  full = muchDamping(*p);
    for (double radius : {.905, .98}) {
      const Outcome o = run(*p, text(" -ts_hhtdae_radius %g", radius));
      EXPECT_LT(o.steps, 2 * full.steps) << f.name << radius;
      EXPECT_LT(o.q, 2 * full.q) << f.name << radius;
      EXPECT_LT(o.v, 2 * full.v) << f.name << radius;
    }
  }
}

/* Without any numerical damping; these runs are short enough to complete */
TEST(LittleDamping, NoneAtAll)
{
  for (const Factory &f : constrained()) {
    const std::unique_ptr<Problem> p = f.make();
    const Outcome                  full = muchDamping(*p);
    const Outcome                  o    = run(*p, " -ts_hhtdae_alpha 0");
    EXPECT_LT(o.steps, 6 * full.steps) << f.name;
    EXPECT_LT(o.q, 2 * full.q) << f.name;
  }
}

TEST(LittleDamping, ToleranceOfTheCorrector)
{
  auto tolerance = [](double alpha) { return hht3::ConstrainedTolerance(1e-3, hht3::HHTParameters(alpha, false).rho); };
  EXPECT_DOUBLE_EQ(tolerance(-.3), 1e-3);
  EXPECT_NEAR(tolerance(-.05), 1e-3, 1e-15);
  EXPECT_NEAR(tolerance(-.01), 4.3231e-5, 1e-9);
  EXPECT_DOUBLE_EQ(tolerance(0.), 1e-8);
}

/* -ts_view shows the corrector tolerance in use; a value set by the user is not changed */
TEST(LittleDamping, UsersToleranceStands)
{
  const Pendulum p(-90., 0., .1);
  for (const char *given : {"", " -ts_hhtdae_corrector_tolerance 0.002"}) {
    Simulation s(p, tolerance(1e-5) + "-ts_hhtdae_alpha -0.01" + given);
    must(s.solve());
    Printed printed;
    must(TSView(s.ts, PETSC_VIEWER_STDOUT_SELF));
    EXPECT_TRUE(printed.says(*given ? "error left below 0.002 of the tolerance," : "error left below 4.32311e-05 of the tolerance (small"))
        << printed.text();
  }
}
