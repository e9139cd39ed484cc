/* Published benchmarks at the tolerances of work-precision diagrams: error against tolerance, and digits at tight tolerances */
#include "problems/fekete.h"
#include "problems/wheelset.h"
#include "support.h"

using namespace hhtest;

namespace
{

double digits(double error) { return -std::log10(error); }

/* Errors in q for rtol = atol = 1e-first, ..., 1e-last */
std::vector<double> errorsAgainstTolerance(const Problem &p, const std::string &options, int first, int last)
{
  std::vector<double> q;
  for (int k = first; k <= last; k++) {
    Simulation run(p, tolerance(std::pow(10., -k)) + options);
    must(run.solve());
    const ProblemErrors    e = run.errors();
    const TSHHT3Statistics s = run.statistics();
    MEASURED("%-9s %-28s rtol = atol = 1e-%02d: %.1f digits in q, errors q %.1e, q' %.1e, lambda %.1e; %d steps, %d "
             "rejected, "
             "%d iterations, %d factorizations, %.2f s",
             p.name.c_str(), options.c_str(), k, digits(e.q), e.q, e.v, e.lambda, (int)s.steps, (int)s.rejected,
             (int)s.newton, (int)s.factorizations, s.cpu);
    EXPECT_DOUBLE_EQ(run.t(), p.t1);
    q.push_back(e.q);
  }
  return q;
}

/* For a method of order 2 with an error estimate of order 3 the error decreases by the factor 10^(2/3) = 4.6 per
   decade of the tolerance */
void expectFalling(const std::vector<double> &q)
{
  for (size_t k = 0; k + 1 < q.size(); k++) EXPECT_LT(q[k + 1], 1.2 * q[k]) << "decade " << k;
  for (size_t k = 0; k + 2 < q.size(); k++) EXPECT_LT(q[k + 2], q[k] / 2.) << "decades " << k << ", " << k + 1;
  const double perDecade = std::pow(q.front() / q.back(), 1. / (q.size() - 1.));
  MEASURED("the error falls %.1f times per decade of the tolerance", perDecade);
  EXPECT_GT(perDecade, 3.);
  EXPECT_LT(perDecade, 12.);
}

} // namespace

TEST(Benchmarks, AndrewsErrorFallsWithTolerance)
{
  const std::vector<double> q = errorsAgainstTolerance(Andrews(), "", 5, 11);
  expectFalling(q);
  EXPECT_GE(digits(q.back()), 6.);
}

TEST(Benchmarks, AndrewsSixDigits)
{
  const std::vector<double> q = errorsAgainstTolerance(Andrews(), "-ts_hhtdae_alpha -0.05", 12, 12);
  EXPECT_GE(digits(q[0]), 6.);
}

/* Up to the end time of IFToMM A03, twice as many revolutions */
TEST(Benchmarks, AndrewsLongerRun)
{
  const std::vector<double> q = errorsAgainstTolerance(Andrews(.05), "-ts_hhtdae_alpha -0.05", 9, 9);
  EXPECT_GE(digits(q[0]), 3.);
}

TEST(Benchmarks, CarAxisErrorFallsWithTolerance)
{
  const std::vector<double> q = errorsAgainstTolerance(CarAxis(), "", 4, 9);
  expectFalling(q);
}

TEST(Benchmarks, CarAxisSixDigits)
{
  const std::vector<double> q = errorsAgainstTolerance(CarAxis(), "-ts_hhtdae_alpha -0.05", 12, 12);
  EXPECT_GE(digits(q[0]), 6.);
}

/* The paper's form is as accurate, because M is constant */
TEST(Benchmarks, CarAxisPaperForm)
{
  const std::vector<double> q = errorsAgainstTolerance(CarAxis(), "-ts_hhtdae_form paper", 4, 8);
  expectFalling(q);
}

/* Digits published for other codes: RADAU5 and DASSL at index 2 */
TEST(Benchmarks, Fekete)
{
  EXPECT_GE(digits(errorsAgainstTolerance(Fekete(), "", 4, 9).back()), 6.5);
  EXPECT_GE(digits(errorsAgainstTolerance(Fekete(), "-ts_hhtdae_order 5", 9, 9).back()), 7.);
}

TEST(Benchmarks, Wheelset)
{
  const std::vector<double> q = errorsAgainstTolerance(Wheelset(), "", 7, 9);
  EXPECT_LT(q.back(), q.front() / 5.);
  EXPECT_GE(digits(errorsAgainstTolerance(Wheelset(), "-ts_hhtdae_order 5", 10, 10).back()), 6.);
}

/* The Jacobian of the wheelset, by dual numbers, against differences at states near its motion */
TEST(Benchmarks, MatrixOfTheWheelset)
{
  const Wheelset p;
  const PetscInt n = p.n;
  Array          u(n), v(n), a(n, .1), f(n), g(n);
  p.initial(u.data(), v.data());
  for (PetscInt i = 0; i < n; i++) v[i] = .01 * (double)(i + 1);
  Entries J;
  p.jacobian(0., u.data(), v.data(), a.data(), 0., 0., J);
  for (PetscInt j = 0; j < n; j++) {
    const double d = 1e-6 * std::max(1e-2, std::abs(u[j]));
    Array        plus = u, minus = u;
    plus[j] += d;
    minus[j] -= d;
    p.residual(0., plus.data(), v.data(), a.data(), f.data());
    p.residual(0., minus.data(), v.data(), a.data(), g.data());
    for (size_t k = 0; k < J.value.size(); k++)
      if (J.col[k] == j) {
        const double difference = (f[J.row[k]] - g[J.row[k]]) / (2. * d);
        EXPECT_NEAR(J.value[k], difference, 1e-5 * std::max(1., std::abs(difference))) << J.row[k] << " " << j;
      }
  }
}
