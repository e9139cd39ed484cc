/*
  Numerical damping of one oscillator q'' + w^2 q = 0 against the amplification matrix A of the method, from h w = 1e-2
  to 1e4. With x_n = (q, h q', h^2 a)_n, x_{n+1} = A x_n. The h^2 a_n of a run follow from its q and q' by (2a) and
  (2b).
*/
#include "support.h"

#include <array>
#include <complex>

using namespace hhtest;

namespace
{

using Real   = long double; /* extended precision, because least squares squares the condition number */
using Values  = std::array<Real, 3>;
using Matrix = std::array<Values, 3>;

struct Method {
  Real am, af, gamma, beta;
  /* Determinant of (2a), (2b) for a_n and a_{n+1}: zero for the trapezoidal rule, where a_n = -w^2 q_n */
  Real determinant() const { return gamma * (.5L - beta) - beta * (1 - gamma); }
  bool trapezoidal() const { return std::abs(determinant()) < 1e-12L; }
};

Method hht(Real alpha) { return {0, -alpha, (1 - 2 * alpha) / 2, (1 - alpha) * (1 - alpha) / 4}; }
Method radius(Real rho)
{
  const Real am = (2 * rho - 1) / (rho + 1), af = rho / (rho + 1), gamma = .5L - am + af;
  return {am, af, gamma, (gamma + .5L) * (gamma + .5L) / 4};
}

/* From (2) and (1-am) a1 + am a = -w^2 [(1-af) q1 + af q] */
Matrix amplification(const Method &m, Real hw)
{
  const Real w2 = hw * hw, c = 1 - m.am + w2 * (1 - m.af) * m.beta;
  Matrix     A;
  A[2] = {-w2 / c, -w2 * (1 - m.af) / c, -(m.am + w2 * (1 - m.af) * (.5L - m.beta)) / c};
  for (int j = 0; j < 3; j++) {
    A[0][j] = m.beta * A[2][j] + (j == 0 ? 1 : j == 1 ? 1 : .5L - m.beta);
    A[1][j] = m.gamma * A[2][j] + (j == 0 ? 0 : j == 1 ? 1 : 1 - m.gamma);
  }
  return A;
}

Values next(const Matrix &A, const Values &x)
{
  Values y = {0, 0, 0};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) y[i] += A[i][j] * x[j];
  return y;
}

Real size(const Values &x) { return std::max({std::abs(x[0]), std::abs(x[1]), std::abs(x[2])}); }

/* The largest of the roots of z^3 + c2 z^2 + c1 z + c0, by simultaneous iteration */
Real largestRoot(Real c0, Real c1, Real c2)
{
  using Complex      = std::complex<Real>;
  Complex z[3]       = {1, Complex(.4L, .9L), Complex(.4L, .9L) * Complex(.4L, .9L)};
  auto    polynomial = [&](Complex x) { return ((x + c2) * x + c1) * x + c0; };
  for (int it = 0; it < 2000; it++)
    for (int k = 0; k < 3; k++) {
      const Complex d = (z[k] - z[(k + 1) % 3]) * (z[k] - z[(k + 2) % 3]);
      if (std::abs(d) > 0) z[k] -= polynomial(z[k]) / d;
    }
  return std::max({std::abs(z[0]), std::abs(z[1]), std::abs(z[2])});
}

Real spectralRadius(const Matrix &A)
{
  const Real trace  = A[0][0] + A[1][1] + A[2][2];
  const Real minors = A[0][0] * A[1][1] - A[0][1] * A[1][0] + A[0][0] * A[2][2] - A[0][2] * A[2][0] +
                      A[1][1] * A[2][2] - A[1][2] * A[2][1];
  const Real det = A[0][0] * (A[1][1] * A[2][2] - A[1][2] * A[2][1]) -
                   A[0][1] * (A[1][0] * A[2][2] - A[1][2] * A[2][0]) +
                   A[0][2] * (A[1][0] * A[2][1] - A[1][1] * A[2][0]);
  return largestRoot(-det, minors, -trace);
}

struct Oscillator : Oscillators { /* with arbitrary initial values */
  double q0, v0;
  Oscillator(double w, double q, double v, double end) : Oscillators({w}, {0.}, false, end), q0(q), v0(v) {}
  void initial(double *u, double *v) const override
  {
    u[0] = q0;
    v[0] = v0;
  }
};

/* x_0..x_{N-1} of a run with h = 1. The tolerance is so small that the run starts from a_0 = q''_0, which excites the
   third root. */
std::vector<Values> states(double hw, double q0, double v0, const std::string &options, const Method &m, int N)
{
  const Oscillator   p(hw, q0, v0, N);
  std::vector<Values> x;
  Simulation         run(p, fixedSteps(1.) + options + " -ts_rtol 1e-13 -ts_atol 1e-13");
  run.watch = [&](Simulation &r, PetscInt, double) { x.push_back({r.u()[0], r.v()[0], 0}); };
  must(run.solve());
  for (int n = 0; n < N; n++) { /* solves (2a), (2b) for a_n and a_{n+1} */
    const Real b = x[n + 1][0] - x[n][0] - x[n][1], c = x[n + 1][1] - x[n][1];
    x[n][2] = m.trapezoidal() ? -(Real)hw * hw * x[n][0] : (m.gamma * b - m.beta * c) / m.determinant();
  }
  x.pop_back();
  return x;
}

/* The matrix that maps each x_n to x_{n+1} in the least-squares sense, from the first states of the runs; for the
   trapezoidal rule the matrix for (q, h q') */
Matrix fit(const std::vector<std::vector<Values>> &runs, int pairs, bool two)
{
  Real S[3][3] = {}, T[3][3] = {};
  for (const auto &x : runs) {
    const Real small = 1e-3L * size(x[0]);
    for (int n = 0; n < pairs && n + 1 < (int)x.size() && size(x[n]) > small; n++) {
      const Real w = 1 / size(x[n]);
      for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
          S[i][j] += w * w * x[n][i] * x[n][j];
          T[i][j] += w * w * x[n + 1][i] * x[n][j];
        }
    }
  }
  if (two)
    for (int i = 0; i < 3; i++) {
      S[i][2] = S[2][i] = i == 2;
      T[i][2] = T[2][i] = 0;
    }
  Matrix A; /* A S = T with symmetric S: Cramer's rule row by row */
  auto   det = [](const Real M[3][3]) {
    return M[0][0] * (M[1][1] * M[2][2] - M[1][2] * M[2][1]) - M[0][1] * (M[1][0] * M[2][2] - M[1][2] * M[2][0]) +
           M[0][2] * (M[1][0] * M[2][1] - M[1][1] * M[2][0]);
  };
  const Real D = det(S);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      Real M[3][3];
      for (int k = 0; k < 3; k++)
        for (int l = 0; l < 3; l++) M[k][l] = l == j ? T[i][k] : S[k][l];
      A[i][j] = det(M) / D;
    }
  return A;
}

void compare(const char *name, const std::string &options, const Method &m)
{
  constexpr int N = 300;
  for (double hw : {1e-2, 3e-2, 1e-1, .3, 1., 3., 10., 30., 100., 1e3, 1e4}) {
    SCOPED_TRACE(text("%s, h w = %g", name, hw));
    const Matrix                          A    = amplification(m, hw);
    const std::vector<std::vector<Values>> runs = {states(hw, 1., 0., options, m, N), states(hw, 0., hw, options, m, N),
                                                  states(hw, .6, -.8 * hw, options, m, N)};
    Real                                  difference = 0;
    for (const auto &x : runs) {
      Values y = x[0];
      for (int n = 0; n < N; n++, y = next(A, y))
        difference = std::max(difference, std::max(std::abs(x[n][0] - y[0]), std::abs(x[n][1] - y[1])) / size(x[0]));
    }
    const Real theory = spectralRadius(A), measured = spectralRadius(fit(runs, 40, m.trapezoidal()));
    MEASURED("%-22s h w = %-6g spectral radius %.8Lf, measured %.8Lf (difference %.1Le), states to %.1Le", name, hw,
             theory, measured, measured - theory, difference);
    EXPECT_LT(difference, 1e-8);
    EXPECT_NEAR((double)measured, (double)theory, hw < 0.02 ? 1e-4 : 1e-6); /* a consistent start hardly excites the third root */
    EXPECT_LE((double)theory, 1. + 1e-12);
  }
}

} // namespace

TEST(Damping, HHT)
{
  for (double alpha : {0., -.05, -.3, -1. / 3.})
    compare(text("alpha %.4g", alpha).c_str(), text("-ts_hhtdae_alpha %.17g", alpha), hht(alpha));
}

TEST(Damping, PaperForm)
{
  for (double alpha : {-.05, -.3})
    compare(text("paper alpha %.4g", alpha).c_str(), text("-ts_hhtdae_form paper -ts_hhtdae_alpha %.17g", alpha),
            hht(alpha));
}

TEST(Damping, Radius)
{
  for (double rho : {0., .5, .9, 1.})
    compare(text("radius %.4g", rho).c_str(), text("-ts_hhtdae_radius %.17g", rho), radius(rho));
}

/* The spectral radius at infinity has the value that the setters state */
TEST(Damping, RadiusAtInfinity)
{
  for (double rho : {0.1, .5, .9, 1.}) EXPECT_NEAR((double)spectralRadius(amplification(radius(rho), 1e7)), rho, 1e-4);
  for (double alpha : {-.05, -.3, -1. / 3.})
    EXPECT_NEAR((double)spectralRadius(amplification(hht(alpha), 1e7)), (1 + alpha) / (1 - alpha), 1e-4);
}
