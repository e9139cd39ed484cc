/*
  Conditioning of the Newton matrix against h for the three scalings that the paper weighs:

    (a) positions as unknowns: the application's Jacobian as it is
    (b) accelerations as unknowns, constraints unscaled: their rows vanish like beta h^2
    (c) the same with constraints scaled by 1/(beta h^2), the integrator's matrix

  cond_2 by one-sided Jacobi rotations in long double, which finds small singular values of graded matrices.
*/
#include "integrator/formulas.h"
#include "support.h"

using namespace hhtest;

namespace
{

using Dense = std::vector<std::vector<long double>>; /* by columns */

long double condition(Dense A)
{
  const size_t n   = A.size();
  auto         dot = [&](size_t i, size_t j) {
    long double s = 0;
    for (size_t k = 0; k < n; k++) s += A[i][k] * A[j][k];
    return s;
  };
  for (int sweep = 0; sweep < 60; sweep++) {
    long double off = 0;
    for (size_t i = 0; i < n; i++)
      for (size_t j = i + 1; j < n; j++) {
        const long double a = dot(i, i), b = dot(j, j), c = dot(i, j);
        if (c == 0) continue;
        off                 = std::max(off, std::abs(c) / std::sqrt(a * b));
        const long double z = (b - a) / (2 * c), t = (z >= 0 ? 1 : -1) / (std::abs(z) + std::sqrt(1 + z * z)),
                          cs = 1 / std::sqrt(1 + t * t), sn = cs * t;
        for (size_t k = 0; k < n; k++) {
          const long double x = A[i][k], y = A[j][k];
          A[i][k] = cs * x - sn * y;
          A[j][k] = sn * x + cs * y;
        }
      }
    if (off < 1e-16L) break;
  }
  long double largest = 0, smallest = std::sqrt(dot(0, 0));
  for (size_t i = 0; i < n; i++) {
    largest  = std::max(largest, std::sqrt(dot(i, i)));
    smallest = std::min(smallest, std::sqrt(dot(i, i)));
  }
  return largest / smallest;
}

/* The transpose, with the rows as columns: in (b) the rows differ in size, in (a) both rows and columns */
Dense rowsOf(Mat P)
{
  PetscInt n;
  must(MatGetSize(P, &n, nullptr));
  Dense A(n, std::vector<long double>(n, 0.L));
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt j = 0; j < n; j++) {
      PetscScalar v;
      must(MatGetValue(P, i, j, &v));
      A[i][j] = v;
    }
  return A;
}

/* The integrator's matrix D_r J D_c by its formula, from the application's Jacobian at the present state */
Dense byFormula(Simulation &run, double h)
{
  const hht3::Parameters p        = hht3::HHTParameters(-.3, false);
  const double           position = hht3::ScalePosition(p, h);
  SNES                   snes;
  Mat                    J, P;
  Vec                    A;
  must(TSGetSNES(run.ts, &snes));
  must(SNESGetJacobian(snes, &J, &P, nullptr, nullptr));
  must(TSHHT3GetAcceleration(run.ts, &A));
  must(TSComputeI2Jacobian(run.ts, run.t(), run.U, run.V, A, hht3::ShiftV(p, h), hht3::ShiftA(p, h), J, P));
  Dense          D     = rowsOf(P);
  const Problem &model = run.problem;
  for (PetscInt i = 0; i < model.n; i++)
    for (PetscInt j = 0; j < model.n; j++) {
      if (model.role[i] == TSHHT3_HOLONOMIC) D[i][j] /= position;
      if (model.role[j] == TSHHT3_COORDINATE) D[i][j] *= position;
    }
  return D;
}

double difference(const Dense &A, const Dense &B)
{
  long double d = 0, m = 0;
  for (size_t i = 0; i < A.size(); i++)
    for (size_t j = 0; j < A.size(); j++) {
      d = std::max(d, std::abs(A[i][j] - B[i][j]));
      m = std::max(m, std::abs(B[i][j]));
    }
  return (double)(d / m);
}

/* The matrix that the integrator made in the first step of length h, taken from the SNES; if it shortened the step or
   made it without the corrector, the matrix by formula */
Dense newtonMatrix(Simulation &run, double h)
{
  SNES snes;
  Mat  P;
  must(TSSetTimeStep(run.ts, h));
  must(run.step());
  must(TSGetSNES(run.ts, &snes));
  must(SNESGetJacobian(snes, nullptr, &P, nullptr, nullptr));
  const Dense made = rowsOf(P), formula = byFormula(run, h);
  if (std::abs(run.t() - run.problem.t0 - h) > 1e-9 * h || run.statistics().tiny_steps) return formula;
  if (h < 2e-4) {
    EXPECT_LT(difference(made, formula), 1e-3) << "h = " << h;
  }
  return made;
}

struct Conditions {
  double a, b, c;
};

Conditions conditions(const Problem &p, double h)
{
  Simulation        run(p, fixedSteps(h) + "-ts_hhtdae_reuse 1,0,1 -ts_hhtdae_start off -ts_exact_final_time stepover");
  const Dense       C = newtonMatrix(run, h);
  const long double s = hht3::ScalePosition(hht3::HHTParameters(-.3, false), h);
  Dense             A = C, B = C;
  for (PetscInt i = 0; i < p.n; i++)
    for (PetscInt j = 0; j < p.n; j++) {
      if (p.role[i] == TSHHT3_HOLONOMIC) B[i][j] *= s;
      A[i][j] = p.role[j] == TSHHT3_COORDINATE ? B[i][j] / s : B[i][j];
    }
  return {(double)condition(A), (double)condition(B), (double)condition(C)};
}

void table(const Problem &p)
{
  std::vector<Conditions> cond;
  MEASURED("%s: cond_2 of the Newton matrix, scalings (a), (b), (c)", p.name.c_str());
  for (int k = 1; k <= 12; k++) {
    cond.push_back(conditions(p, std::pow(10., -k)));
    MEASURED("  h = 1e-%02d  %9.2e  %9.2e  %9.2e", k, cond.back().a, cond.back().b, cond.back().c);
  }
  const Conditions &at4 = cond[3], &at6 = cond[5], &last = cond.back();
  for (int k = 4; k < 12; k++) EXPECT_NEAR(cond[k].c / at4.c, 1., .01); /* has reached its limit */
  EXPECT_GT(at6.b / at4.b, 5e3);                                        /* like h^-2 */
  EXPECT_GT(at6.a / at4.a, 5e3);
  EXPECT_GT(last.b / last.c, 1e12);
  EXPECT_GT(last.a / last.c, 1e12);
}

} // namespace

TEST(Condition, JacobiFindsGradedSingularValues)
{
  Dense A = {{1.L, 1e-3L}, {1e-20L, 1e-12L}}; /* by columns; det = 1e-12 - 1e-23 */
  EXPECT_NEAR((double)(condition(A) * 1e-12L), 1., 1e-5);
}

TEST(Condition, Pendulum) { table(Pendulum(-60., 1., 10.)); }
TEST(Condition, Andrews) { table(Andrews()); }
TEST(Condition, FourBar) { table(FourBar(2, 1.)); }
TEST(Condition, CarAxis) { table(CarAxis()); }
