/* For constant M the paper's form and the second-order form are the same method */
#include "support.h"

using namespace hhtest;

namespace
{

struct Path {
  std::vector<Array> u, v;
};

Path path(const Problem &p, int steps, const std::string &options)
{
  Path       result;
  Simulation run(p, fixedSteps((p.t1 - p.t0) / steps) + "-ts_hhtdae_corrector_tolerance 1e-12 " + options);
  run.watch = [&](Simulation &r, PetscInt, double) {
    result.u.push_back(r.u());
    result.v.push_back(r.v());
  };
  must(run.solve());
  return result;
}

double difference(const std::vector<Array> &a, const std::vector<Array> &b, const std::vector<PetscInt> &which)
{
  double d = 0., m = 0.;
  for (size_t n = 0; n < a.size(); n++)
    for (PetscInt i : which) {
      widen(d, std::abs(a[n][i] - b[n][i]));
      m = std::max(m, std::abs(b[n][i]));
    }
  return m > 0. ? d / m : d;
}

void compare(const Problem &p, int steps, double multipliers)
{
  std::vector<PetscInt> q, lambda;
  for (PetscInt i = 0; i < p.n; i++) (p.role[i] == TSHHT3_COORDINATE ? q : lambda).push_back(i);
  for (double alpha : {-.05, -.3, -1. / 3.}) {
    const std::string a = text(" -ts_hhtdae_alpha %.17g ", alpha);
    const Path        x = path(p, steps, a + "-ts_hhtdae_form paper"), y = path(p, steps, a);
    ASSERT_EQ(x.u.size(), (size_t)steps + 1);
    ASSERT_EQ(y.u.size(), (size_t)steps + 1);
    const double dq = difference(x.u, y.u, q), dv = difference(x.v, y.v, q), dl = difference(x.u, y.u, lambda);
    MEASURED("%-14s alpha %7.4f, %d steps: forms differ by %.1e in q, %.1e in q', %.1e in lambda", p.name.c_str(),
             alpha, steps, dq, dv, dl);
    EXPECT_LT(dq, 1e-10);
    EXPECT_LT(dv, 1e-10);
    EXPECT_LT(dl, multipliers);
  }
}

} // namespace

TEST(Equivalence, Oscillators) { compare(Oscillators({1., 10., 300.}, {0., .1, .02}, true, 4.), 200, 1e-10); }
TEST(Equivalence, Pendulum) { compare(Pendulum(-90., 0., 2.), 200, 1e-9); }
TEST(Equivalence, SpringPendulum) { compare(SpringPendulum(1e3, 1.), 400, 1e-10); }
TEST(Equivalence, Chain) { compare(Chain(5, 0., .5), 200, 1e-8); }
TEST(Equivalence, CarAxis) { compare(CarAxis(), 600, 1e-8); }

/* With variable M the forms differ, so that the comparison above is sensitive */
TEST(Equivalence, NotForVariableMass)
{
  const DoublePendulum p(1.);
  const Path x = path(p, 200, "-ts_hhtdae_alpha -0.3 -ts_hhtdae_form paper"), y = path(p, 200, "-ts_hhtdae_alpha -0.3");
  EXPECT_GT(difference(x.u, y.u, {0, 1}), 1e-4);
}

/* HHT with alpha = -1/3 is Chung and Hulbert's method of radius 1/2; with other alpha it is not */
TEST(Equivalence, RadiusOneHalf)
{
  const Oscillators p({1.}, {0.}, false, 4.);
  const Path x = path(p, 100, "-ts_hhtdae_radius 0.5"), y = path(p, 100, "-ts_hhtdae_alpha -0.33333333333333331");
  EXPECT_LT(difference(x.u, y.u, {0}), 1e-13);
  const double      rho   = .6;
  const std::string alpha = text("-ts_hhtdae_alpha %.17g", (rho - 1) / (rho + 1));
  EXPECT_GT(difference(path(p, 100, text("-ts_hhtdae_radius %g", rho)).u, path(p, 100, alpha).u, {0}), 1e-6);
}
