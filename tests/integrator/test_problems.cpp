/*
  The example problems are the yardstick of every other test, so they are checked without any integrator: Jacobians
  against differences of the residual, initial states against the constraints, references against the equations
  themselves.
*/
#include "problem.h"
#include "problems/andrews.h"
#include "problems/caraxis.h"
#include "problems/chain.h"
#include "problems/doublependulum.h"
#include "problems/fekete.h"
#include "problems/fourbar.h"
#include "problems/heavytop.h"
#include "problems/oscillators.h"
#include "problems/pendulum.h"
#include "problems/rolling.h"
#include "problems/slidercrank.h"
#include "problems/springpendulum.h"
#include "problems/uservars.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>

using namespace hhtex;

namespace
{

using Array = std::vector<double>;

struct State {
  Array u, v, a;
  explicit State(PetscInt n) : u(n), v(n), a(n) {}
};

using Dense = std::vector<Array>;

Array residual(const Problem &p, double t, const State &s)
{
  Array f(p.n, std::nan("")); /* an entry that the residual does not write becomes visible */
  p.residual(t, s.u.data(), s.v.data(), s.a.data(), f.data());
  return f;
}

Entries entries(const Problem &p, double t, const State &s, double sv, double sa)
{
  Entries J;
  p.jacobian(t, s.u.data(), s.v.data(), s.a.data(), sv, sa, J);
  return J;
}

Dense dense(const Problem &p, double t, const State &s, double sv, double sa)
{
  const Entries J = entries(p, t, s, sv, sa);
  Dense         D(p.n, Array(p.n, 0.));
  for (size_t k = 0; k < J.value.size(); k++) D[J.row[k]][J.col[k]] += J.value[k];
  return D;
}

/* dF/dx_j by the four-point formula, where x is one of the three arrays of the state */
Array differenceColumn(const Problem &p, double t, State s, Array State::*x, PetscInt j)
{
  const double h = 1e-4 * std::max(1., std::abs((s.*x)[j])), x0 = (s.*x)[j];
  auto         at = [&](double shift) {
    (s.*x)[j] = x0 + shift;
    return residual(p, t, s);
  };
  const Array f1 = at(h), f_1 = at(-h), f2 = at(2. * h), f_2 = at(-2. * h);
  Array       d(p.n);
  for (PetscInt i = 0; i < p.n; i++) d[i] = (8. * (f1[i] - f_1[i]) - (f2[i] - f_2[i])) / (12. * h);
  return d;
}

/* A random state near the initial one, so that lengths do not come near zero */
State randomState(const Problem &p, std::mt19937 &generator)
{
  std::uniform_real_distribution<double> uniform(-1., 1.);
  State                                  s(p.n);
  p.initial(s.u.data(), s.v.data());
  for (PetscInt i = 0; i < p.n; i++) {
    s.u[i] += (p.role[i] == TSHHT3_COORDINATE ? 0.2 : 3.) * uniform(generator);
    s.v[i] += 2. * uniform(generator);
    s.a[i] = 5. * uniform(generator);
  }
  return s;
}

bool isConstraint(const Problem &p, PetscInt i)
{
  return p.role[i] == TSHHT3_HOLONOMIC || p.role[i] == TSHHT3_NONHOLONOMIC;
}

/* Size of the terms in every row, as a scale for tolerances, because forces may cancel in the residual */
Array rowScale(const Problem &p, double t, const State &s)
{
  const Dense K = dense(p, t, s, 0., 0.), KC = dense(p, t, s, 1., 0.), KM = dense(p, t, s, 0., 1.);
  Array       scale(p.n, 1e-12);
  for (PetscInt i = 0; i < p.n; i++)
    for (PetscInt j = 0; j < p.n; j++)
      scale[i] += std::abs(K[i][j] * s.u[j]) + std::abs((KC[i][j] - K[i][j]) * s.v[j]) +
                  std::abs((KM[i][j] - K[i][j]) * s.a[j]);
  return scale;
}

struct ProblemCase {
  const char                               *name;
  std::function<std::unique_ptr<Problem>()> make;
};

void PrintTo(const ProblemCase &f, std::ostream *out) { *out << f.name; }

template <class P, class... Args> ProblemCase make(const char *name, Args... args)
{
  return {name, [=] { return std::unique_ptr<Problem>(new P(args...)); }};
}

class ProblemTest : public testing::TestWithParam<ProblemCase>
{
protected:
  std::unique_ptr<Problem> problem = GetParam().make();
};

TEST_P(ProblemTest, JacobianMatchesDifferencesOfTheResidual)
{
  const Problem &p = *problem;
  std::mt19937   generator(7);
  for (int sample = 0; sample < 4; sample++) {
    const State  s = randomState(p, generator);
    const double t = p.t0 + .3 + sample;
    const Dense  K = dense(p, t, s, 0., 0.), KC = dense(p, t, s, 1., 0.), KM = dense(p, t, s, 0., 1.);
    const Array  f = residual(p, t, s), scale = rowScale(p, t, s);
    for (PetscInt j = 0; j < p.n; j++) {
      const Array du = differenceColumn(p, t, s, &State::u, j), dv = differenceColumn(p, t, s, &State::v, j),
                  da = differenceColumn(p, t, s, &State::a, j);
      for (PetscInt i = 0; i < p.n; i++) {
        const double tolerance =
            1e-9 * (scale[i] + std::abs(f[i]) + std::abs(du[i]) + std::abs(dv[i]) + std::abs(da[i]));
        EXPECT_NEAR(K[i][j], du[i], tolerance) << "dF/dU(" << i << "," << j << ")";
        EXPECT_NEAR(KC[i][j] - K[i][j], dv[i], tolerance) << "dF/dU'(" << i << "," << j << ")";
        EXPECT_NEAR(KM[i][j] - K[i][j], da[i], tolerance) << "dF/dU''(" << i << "," << j << ")";
      }
    }
  }
}

TEST_P(ProblemTest, JacobianIsLinearInTheShiftsAndKeepsItsPattern)
{
  const Problem &p = *problem;
  std::mt19937   generator(11);
  const State    s1 = randomState(p, generator), s2 = randomState(p, generator);
  const Dense    K = dense(p, 1., s1, 0., 0.), KC = dense(p, 1., s1, 1., 0.), KM = dense(p, 1., s1, 0., 1.),
              mixed = dense(p, 1., s1, 2., -3.);
  for (PetscInt i = 0; i < p.n; i++)
    for (PetscInt j = 0; j < p.n; j++) {
      const double C = KC[i][j] - K[i][j], M = KM[i][j] - K[i][j];
      EXPECT_NEAR(mixed[i][j], K[i][j] + 2. * C - 3. * M,
                  1e-14 * (std::abs(K[i][j]) + std::abs(C) + std::abs(M)) * 10.);
    }
  const Entries e1 = entries(p, 0., s1, 0., 0.), e2 = entries(p, 2., s2, 3., 4.),
                e0 = entries(p, 0., State(p.n), 0., 0.);
  EXPECT_EQ(e1.row, e2.row);
  EXPECT_EQ(e1.col, e2.col);
  EXPECT_EQ(e1.row, e0.row);
  EXPECT_EQ(e1.col, e0.col);
}

TEST_P(ProblemTest, RolesFitTheRows)
{
  const Problem &p = *problem;
  ASSERT_EQ((PetscInt)p.role.size(), p.n);
  std::mt19937 generator(13);
  const State  s = randomState(p, generator);
  const Dense  K = dense(p, 1., s, 0., 0.), KC = dense(p, 1., s, 1., 0.), KM = dense(p, 1., s, 0., 1.);
  for (PetscInt i = 0; i < p.n; i++) {
    double velocity = 0., acceleration = 0., ownAcceleration = 0., multiplier = 0.;
    for (PetscInt j = 0; j < p.n; j++) {
      velocity     = std::max(velocity, std::abs(KC[i][j] - K[i][j]));
      acceleration = std::max(acceleration, std::abs(KM[i][j] - K[i][j]));
      if (i == j) ownAcceleration = std::abs(KM[i][j] - K[i][j]);
      if (isConstraint(p, j)) multiplier = std::max(multiplier, std::abs(K[i][j]));
    }
    if (p.role[i] == TSHHT3_COORDINATE) {
      EXPECT_GT(ownAcceleration, 0.) << "row " << i;
    }
    if (p.role[i] == TSHHT3_STATE) {
      EXPECT_GT(velocity, 0.) << "row " << i;
    }
    if (isConstraint(p, i)) {
      EXPECT_EQ(acceleration, 0.) << "row " << i;
      EXPECT_EQ(multiplier, 0.) << "row " << i;
      EXPECT_EQ(velocity > 0., p.role[i] == TSHHT3_NONHOLONOMIC) << "row " << i;
    }
  }
}

TEST_P(ProblemTest, EquationsOfMotionAreAffineInTheAccelerations)
{
  const Problem &p = *problem;
  std::mt19937   generator(17);
  State          s = randomState(p, generator), zero = s, twice = s;
  for (PetscInt i = 0; i < p.n; i++) {
    zero.a[i]  = 0.;
    twice.a[i] = 2. * s.a[i];
  }
  const Array f = residual(p, 1., s), f0 = residual(p, 1., zero), f2 = residual(p, 1., twice),
              scale = rowScale(p, 1., s);
  for (PetscInt i = 0; i < p.n; i++)
    EXPECT_NEAR(f2[i], 2. * f[i] - f0[i], 1e-13 * (scale[i] + std::abs(f0[i]))) << "row " << i;
}

/* Signs as in (6d): the reaction is the transpose of the constraint's derivative, by q or by q' */
TEST_P(ProblemTest, ReactionsAreTransposedConstraints)
{
  const Problem &p = *problem;
  std::mt19937   generator(19);
  const State    s = randomState(p, generator);
  const Dense    K = dense(p, 1., s, 0., 0.), KC = dense(p, 1., s, 1., 0.);
  for (PetscInt c = 0; c < p.n; c++) {
    if (!isConstraint(p, c)) continue;
    for (PetscInt i = 0; i < p.n; i++) {
      if (p.role[i] != TSHHT3_COORDINATE) continue;
      EXPECT_DOUBLE_EQ(K[i][c], p.role[c] == TSHHT3_HOLONOMIC ? K[c][i] : KC[c][i] - K[c][i])
          << "(" << i << "," << c << ")";
    }
  }
}

TEST_P(ProblemTest, InitialStateIsConsistent)
{
  const Problem &p = *problem;
  State          s(p.n);
  p.initial(s.u.data(), s.v.data());
  const Dense  K  = dense(p, p.t0, s, 0., 0.);
  const Array  f  = residual(p, p.t0, s);
  const double h  = 1e-4;
  const Array  f1 = residual(p, p.t0 + h, s), f_1 = residual(p, p.t0 - h, s);
  const Array  f2 = residual(p, p.t0 + 2. * h, s), f_2 = residual(p, p.t0 - 2. * h, s);
  for (PetscInt i = 0; i < p.n; i++) {
    if (!isConstraint(p, i)) continue;
    EXPECT_NEAR(f[i], 0., 1e-15 * std::max(1., (double)p.n)) << "row " << i;
    if (p.role[i] == TSHHT3_NONHOLONOMIC) continue;
    double rate = (8. * (f1[i] - f_1[i]) - (f2[i] - f_2[i])) / (12. * h); /* Phi_t */
    for (PetscInt j = 0; j < p.n; j++) rate += K[i][j] * s.v[j];
    EXPECT_NEAR(rate, 0., 1e-11) << "row " << i;
  }
}

TEST_P(ProblemTest, ReferenceStartsAtTheInitialState)
{
  const Problem &p = *problem;
  State          s(p.n), r(p.n);
  if (p.referenceTimes().empty()) GTEST_SKIP() << "no reference";
  EXPECT_EQ(p.referenceTimes()[0], p.t0);
  ASSERT_TRUE(p.reference(p.t0, r.u.data(), r.v.data(), r.a.data()));
  p.initial(s.u.data(), s.v.data());
  for (PetscInt i = 0; i < p.n; i++) {
    if (p.role[i] != TSHHT3_COORDINATE) continue;
    EXPECT_NEAR(r.u[i], s.u[i], 1e-15 * std::max(1., std::abs(s.u[i])));
    EXPECT_NEAR(r.v[i], s.v[i], 1e-15 * std::max(1., std::abs(s.v[i])));
  }
}

/* References are computed in long double. Where long double is no more than double, as under valgrind, they lack the digits */
bool extended()
{
  volatile const long double one = 1.L, small = std::ldexp(1.L, -60);
  return one + small != one;
}

const char *const noLongDouble = "long double is not more than double here";

/* F = 0 wherever the whole state is known, constraint rows wherever q is. The tolerance leaves room for tables of 12
 * digits. */
TEST_P(ProblemTest, ReferenceSolvesTheEquations)
{
  if (!extended()) GTEST_SKIP() << noLongDouble;
  const Problem &p = *problem;
  if (p.referenceTimes().empty()) GTEST_SKIP() << "no reference";
  const double tolerance = p.referenceEverywhere() ? 1e-12 : 1e-9;
  int          checked   = 0;
  for (double t : p.referenceTimes()) {
    State s(p.n);
    ASSERT_TRUE(p.reference(t, s.u.data(), s.v.data(), s.a.data())) << "t = " << t;
    bool complete = true;
    for (PetscInt i = 0; i < p.n; i++) {
      const bool moves = p.role[i] == TSHHT3_COORDINATE;
      if (std::isnan(s.u[i]) || (moves && (std::isnan(s.v[i]) || std::isnan(s.a[i])))) complete = false;
      for (Array State::*x : {&State::u, &State::v, &State::a})
        if (std::isnan((s.*x)[i])) (s.*x)[i] = 0.;
    }
    const Array f = residual(p, t, s), scale = rowScale(p, t, s);
    for (PetscInt i = 0; i < p.n; i++) {
      if (!complete && p.role[i] != TSHHT3_HOLONOMIC) continue;
      EXPECT_NEAR(f[i], 0., 1e-16 + tolerance * std::max(isConstraint(p, i) ? 1. : 0., scale[i]))
          << "t = " << t << ", row " << i;
      checked++;
    }
  }
  EXPECT_GT(checked, 0);
}

/* Velocities and accelerations of a reference are the derivatives of its positions */
TEST_P(ProblemTest, ReferenceMovesAsItSays)
{
  if (!extended()) GTEST_SKIP() << noLongDouble;
  const Problem &p = *problem;
  if (!p.referenceEverywhere()) GTEST_SKIP() << "no reference between given times";
  const double h = 1e-4;
  for (double t : p.referenceTimes()) {
    if (t < p.t0 + 3. * h || t > p.t1 - 3. * h) continue;
    State at(p.n), f1(p.n), f_1(p.n), f2(p.n), f_2(p.n);
    auto  get = [&](double shift, State &s) { return p.reference(t + shift, s.u.data(), s.v.data(), s.a.data()); };
    ASSERT_TRUE(get(0., at) && get(h, f1) && get(-h, f_1) && get(2. * h, f2) && get(-2. * h, f_2));
    for (PetscInt i = 0; i < p.n; i++) {
      if (p.role[i] != TSHHT3_COORDINATE && p.role[i] != TSHHT3_STATE) continue;
      const double v = (8. * (f1.u[i] - f_1.u[i]) - (f2.u[i] - f_2.u[i])) / (12. * h);
      const double a = (8. * (f1.v[i] - f_1.v[i]) - (f2.v[i] - f_2.v[i])) / (12. * h);
      EXPECT_NEAR(at.v[i], v, 1e-9 * (1. + std::abs(v) + std::abs(at.u[i]))) << "t = " << t << ", unknown " << i;
      if (p.role[i] == TSHHT3_COORDINATE) {
        EXPECT_NEAR(at.a[i], a, 1e-8 * (1. + std::abs(a) + std::abs(v))) << "t = " << t << ", unknown " << i;
      }
    }
  }
}

/* The adaptor to PETSc gives the residual and matrix of the problem, on any number of ranks */
TEST_P(ProblemTest, TimeStepperEvaluatesTheProblem)
{
  const Problem &p = *problem;
  TS             ts;
  Vec            U, V, A, F, X, Y;
  Mat            J;
  std::mt19937   generator(23);
  const State    s = randomState(p, generator);
  const double   t = 0.7, sv = 1.5, sa = 2.5;
  PetscInt       first, end;
  ASSERT_EQ(ProblemCreateTS(PETSC_COMM_WORLD, p, &ts, &U, &V), 0);
  for (Vec *x : {&A, &F, &X, &Y}) ASSERT_EQ(VecDuplicate(U, x), 0);
  ASSERT_EQ(VecGetOwnershipRange(U, &first, &end), 0);
  Array x(p.n);
  for (PetscInt i = 0; i < p.n; i++) x[i] = std::sin(1. + i);
  const std::pair<Vec, const Array *> pairs[] = {{U, &s.u}, {V, &s.v}, {A, &s.a}, {X, &x}};
  for (const auto &pair : pairs) {
    double *array;
    ASSERT_EQ(VecGetArrayWrite(pair.first, &array), 0);
    std::copy(pair.second->begin() + first, pair.second->begin() + end, array);
    ASSERT_EQ(VecRestoreArrayWrite(pair.first, &array), 0);
  }
  ASSERT_EQ(TSComputeI2Function(ts, t, U, V, A, F), 0);
  ASSERT_EQ(TSGetI2Jacobian(ts, &J, nullptr, nullptr, nullptr), 0);
  ASSERT_EQ(TSComputeI2Jacobian(ts, t, U, V, A, 0., 1., J, J), 0);
  Mat copy;
  ASSERT_EQ(MatDuplicate(J, MAT_DO_NOT_COPY_VALUES, &copy), 0);
  const Array f = residual(p, t, s);
  const Dense D = dense(p, t, s, sv, sa);
  for (Mat m : {J, copy}) { /* also into a duplicate */
    ASSERT_EQ(TSComputeI2Jacobian(ts, t, U, V, A, sv, sa, m, m), 0);
    ASSERT_EQ(MatMult(m, X, Y), 0);
    const double *fa, *ya;
    ASSERT_EQ(VecGetArrayRead(F, &fa), 0);
    ASSERT_EQ(VecGetArrayRead(Y, &ya), 0);
    for (PetscInt i = first; i < end; i++) {
      double product = 0., size = 1e-14;
      for (PetscInt j = 0; j < p.n; j++) {
        product += D[i][j] * x[j];
        size += std::abs(D[i][j] * x[j]);
      }
      EXPECT_DOUBLE_EQ(fa[i - first], f[i]);
      EXPECT_NEAR(ya[i - first], product, 1e-13 * size);
    }
    ASSERT_EQ(VecRestoreArrayRead(F, &fa), 0);
    ASSERT_EQ(VecRestoreArrayRead(Y, &ya), 0);
  }
  ASSERT_EQ(MatDestroy(&copy), 0);
  for (Vec *v : {&U, &V, &A, &F, &X, &Y}) ASSERT_EQ(VecDestroy(v), 0);
  ASSERT_EQ(TSDestroy(&ts), 0);
}

TEST_P(ProblemTest, RolesReachTheIntegrator)
{
  const Problem &p = *problem;
  TS             ts;
  Vec            U, V;
  PetscInt       sum = 0;
  ASSERT_EQ(ProblemCreateTS(PETSC_COMM_WORLD, p, &ts, &U, &V, true), 0);
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++) {
    IS       is;
    PetscInt size = 0, expected = std::count(p.role.begin(), p.role.end(), (TSHHT3Role)r), local = 0;
    ASSERT_EQ(TSHHT3GetIS(ts, (TSHHT3Role)r, &is), 0);
    if (is) {
      const PetscInt *index;
      ASSERT_EQ(ISGetSize(is, &size), 0);
      ASSERT_EQ(ISGetLocalSize(is, &local), 0);
      ASSERT_EQ(ISGetIndices(is, &index), 0);
      for (PetscInt k = 0; k < local; k++) EXPECT_EQ(p.role[index[k]], r) << "unknown " << index[k];
      ASSERT_EQ(ISRestoreIndices(is, &index), 0);
    }
    EXPECT_EQ(size, expected) << TSHHT3Roles[r];
    sum += size;
  }
  EXPECT_EQ(sum, p.n);
  ASSERT_EQ(VecDestroy(&U), 0);
  ASSERT_EQ(VecDestroy(&V), 0);
  ASSERT_EQ(TSDestroy(&ts), 0);
}

INSTANTIATE_TEST_SUITE_P(
    Examples, ProblemTest,
    testing::Values(make<Pendulum>("Pendulum"), make<Pendulum>("PendulumNearlyInverted", 179.99),
                    make<Pendulum>("PendulumOverTheTop", 30., -8.), make<Pendulum>("PendulumMoving", -100., 1.5),
                    make<Andrews>("Andrews"), make<Andrews>("AndrewsLong", 0.05), make<CarAxis>("CarAxis"),
                    make<FourBar>("FourBar"), make<FourBar>("FourBar5", (PetscInt)5), make<Sleigh>("Sleigh"),
                    make<RollingDisc>("RollingDisc"), make<UserVars>("UserVars"),
                    make<Oscillators>("Oscillators", Array{1., 10., 3., 2.}, Array{0., .05, 1., 3.}),
                    make<Oscillators>("OscillatorsCoupled", Array{0., 1., 10., 3.}, Array{0., .2, 1., 1.5}, true),
                    make<Chain>("Chain", (PetscInt)7), make<Chain>("ChainAtAnAngle", (PetscInt)1, -30.),
                    make<DoublePendulum>("DoublePendulum"), make<SpringPendulum>("SpringPendulum", 1e4),
                    make<SliderCrank>("SliderCrank"), make<HeavyTop>("HeavyTop"), make<Fekete>("Fekete")),
    [](const testing::TestParamInfo<ProblemCase> &info) { return std::string(info.param.name); });

/* The report measures differences against the reference in the scales it documents */
TEST(ProblemReport, ErrorsAreRelativeToTheReference)
{
  FourBar       p(2, 1.);
  ProblemErrors errors;
  TS            ts;
  Vec           U, V;
  State         r(p.n);
  double        lambdaMax = 0.;
  ASSERT_EQ(ProblemCreateTS(PETSC_COMM_WORLD, p, &ts, &U, &V), 0);
  ASSERT_TRUE(p.reference(0.8, r.u.data(), r.v.data(), r.a.data()));
  for (PetscInt i = p.pins(); i < p.n; i++) lambdaMax = std::max(lambdaMax, std::abs(r.u[i]));
  for (PetscInt i = 0; i < p.n; i++) {
    if (p.role[i] == TSHHT3_HOLONOMIC) r.v[i] = 0.;
    ASSERT_EQ(VecSetValue(U, i, r.u[i] + (i == 2 ? 1e-3 : i == p.pins() ? 1e-2 : 0.), INSERT_VALUES), 0);
    ASSERT_EQ(VecSetValue(V, i, r.v[i] + (i == 4 ? 1e-5 : 0.), INSERT_VALUES), 0);
  }
  for (Vec x : {U, V}) {
    ASSERT_EQ(VecAssemblyBegin(x), 0);
    ASSERT_EQ(VecAssemblyEnd(x), 0);
  }
  ASSERT_EQ(ProblemComputeErrors(0.8, p, U, V, &errors), 0);
  EXPECT_NEAR(errors.q, 1e-3 / std::max(1., std::abs(r.u[2])), 1e-12);
  EXPECT_NEAR(errors.v, 1e-5 / std::max(1., std::abs(r.v[4])), 1e-12);
  EXPECT_NEAR(errors.lambda, 1e-2 / lambdaMax, 1e-12);
  EXPECT_LT(errors.other, 0.); /* the problem has no unknowns of that kind */
  ASSERT_EQ(VecDestroy(&U), 0);
  ASSERT_EQ(VecDestroy(&V), 0);
  ASSERT_EQ(TSDestroy(&ts), 0);
}

/* Published or independently computed digits */

TEST(ProblemDigits, PendulumFromHorizontal)
{
  Pendulum     p;
  State        s(3);
  const double expected[][4] = {{.5, -0.391048791550546388, -0.920369948785192204, 27.0864875927482066},
                                {5., -0.942305435043757335, -0.334754338414000581, 9.85182017952403709},
                                {10., -0.27508746257611686, -0.961419205099125064, 28.2945672060672506}};
  for (const auto &e : expected) {
    ASSERT_TRUE(p.reference(e[0], s.u.data(), s.v.data(), s.a.data()));
    EXPECT_NEAR(s.u[0], e[1], 4e-15);
    EXPECT_NEAR(s.u[1], e[2], 4e-15);
    EXPECT_NEAR(s.u[2], e[3], 1e-13);
  }
}

TEST(ProblemDigits, FourBar)
{
  if (!extended()) GTEST_SKIP() << noLongDouble;
  FourBar      two(2), forty(40);
  State        s2(two.n), s40(forty.n);
  const double expected[][5] = {
      {1., -0.195020301949435094, -0.980799205662173833, -0.115356880632109898, -0.993324111300450186},
      {5., -0.811310461005107412, -0.584615545348975548, -0.540190050675526274, -0.841543052464443055},
      {10., 0.328458111540815379, 0.944518538178600962, 0.180512226686728389, 0.983572740582311575}};
  for (const auto &e : expected) {
    ASSERT_TRUE(two.reference(e[0], s2.u.data(), s2.v.data(), s2.a.data()));
    ASSERT_TRUE(forty.reference(e[0], s40.u.data(), s40.v.data(), s40.a.data()));
    EXPECT_NEAR(2. * s2.u[0], e[1], 4e-15);
    EXPECT_NEAR(2. * s2.u[1], e[2], 4e-15);
    EXPECT_NEAR(2. * s40.u[0], e[3], 4e-15);
    EXPECT_NEAR(2. * s40.u[1], e[4], 4e-15);
  }
}

TEST(ProblemDigits, SliderCrank)
{
  SliderCrank  p;
  State        s(5);
  const double expected[5] = {1.275675848650, 1.023578558980, -.498813049183, 1.1137561583, -.7625072751};
  ASSERT_TRUE(p.reference(10., s.u.data(), s.v.data(), s.a.data()));
  for (int i = 0; i < 5; i++) EXPECT_NEAR(s.u[i], expected[i], 2e-10);
}

TEST(ProblemDigits, SpringPendulum)
{
  if (!extended()) GTEST_SKIP() << noLongDouble;
  const double expected[][4] = {{1e2, -.174468935324, -1.209469318983, 4.279765120420},
                                {1e4, .787163379341, -.619690574822, 2.147759695750},
                                {1e6, .79350278087, -.60859605453, 2.1028888670}};
  for (const auto &e : expected) {
    SpringPendulum p(e[0]);
    State          s(2);
    ASSERT_TRUE(p.reference(2., s.u.data(), s.v.data(), s.a.data()));
    EXPECT_NEAR(s.u[0], e[1], 2e-11);
    EXPECT_NEAR(s.u[1], e[2], 2e-11);
    EXPECT_NEAR(s.v[0], e[3], 1e-9);
  }
}

TEST(ProblemDigits, HeavyTop)
{
  HeavyTop     p(2.);
  State        s(p.n);
  const double expected[][7] = {
      {.5, -.70246829705663, -.02116518470181, -.71140025765169, 523.2812435144, 404.2061783201, 357.3361764531},
      {2., -.15041682274585, -.72416559163698, -.67302226956031, -260.735211311, 613.612698983, 309.716631391}};
  for (const auto &e : expected) {
    ASSERT_TRUE(p.reference(e[0], s.u.data(), s.v.data(), s.a.data()));
    for (int i = 0; i < 3; i++) EXPECT_NEAR(s.u[i], e[1 + i], 1e-10);
    for (int i = 0; i < 3; i++) EXPECT_NEAR(-s.u[7 + i], e[4 + i], 1e-7); /* force of the pivot on the top */
  }
}

/* Verifies the accuracy that the headers claim for their references: change of the reference when its step is halved */
template <class P, class... Args> double changeByHalving(double t, double step, Args... args)
{
  P      coarse(args..., t, step), fine(args..., t, step / 2.);
  State  c(coarse.n), f(fine.n);
  double change = 0.;
  EXPECT_TRUE(coarse.reference(t, c.u.data(), c.v.data(), c.a.data()));
  EXPECT_TRUE(fine.reference(t, f.u.data(), f.v.data(), f.a.data()));
  for (PetscInt i = 0; i < coarse.n; i++) {
    if (coarse.role[i] == TSHHT3_COORDINATE)
      change = std::max({change, std::abs(c.u[i] - f.u[i]), std::abs(c.v[i] - f.v[i])});
  }
  return change;
}

TEST(ProblemDigits, ReferencesDoNotChangeWithTheStep)
{
  if (!extended()) GTEST_SKIP() << noLongDouble;
  EXPECT_LT(changeByHalving<UserVars>(5., 0.01), 1e-14);
  EXPECT_LT(changeByHalving<DoublePendulum>(1., 0.01), 1e-14);
  EXPECT_LT(changeByHalving<SliderCrank>(10., 0.05), 1e-14);
  for (double k : {1e2, 1e4, 1e6})
    EXPECT_LT(changeByHalving<SpringPendulum>(2., std::min(.05, 1. / std::sqrt(k)), k), 1e-12) << "k = " << k;
}

} // namespace
