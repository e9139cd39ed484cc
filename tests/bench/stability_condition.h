/*
  Conditioning of the Newton matrix for the three scalings that the paper weighs, of any TS of type TSHHT3 that has made
  a step:

    (a) positions as unknowns: the application's Jacobian J as it is
    (b) accelerations as unknowns, constraints unscaled: J D_c
    (c) constraints scaled by 1/(beta h^2) too: D_r J D_c, the integrator's matrix

  cond_2 by power iteration on A^T A and its inverse. The inverse of all three comes from one factorization of (c) in
  long double and the scalings, which are exact: (a) and (b) are conditioned up to 1e20 and more, beyond what a
  factorization of theirs could tell.
*/
#ifndef HHTDAE_BENCH_STABILITY_CONDITION_H
#define HHTDAE_BENCH_STABILITY_CONDITION_H

#include "../../examples/problems/andrews.h"
#include "../../examples/problems/fourbar.h"
#include "integrator/formulas.h"
#include "stability_models.h"

#include <Eigen/Dense>

namespace hhtstab
{

using LongMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using LongVector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

/* Largest singular value of the matrix whose products are apply() and its transpose */
template <class Apply> long double LargestSingularValue(Eigen::Index n, Apply apply)
{
  LongVector  x    = LongVector::NullaryExpr(n, [](Eigen::Index i) { return 1 + std::sin(7.L * i); });
  long double last = 0, now = 0;
  for (int k = 0; k < 500; k++) {
    x /= x.norm();
    x   = apply(apply(x, false), true);
    now = std::sqrt(x.norm());
    if (k > 5 && std::fabs(now / last - 1) < 1e-6L) break;
    last = now;
  }
  return now;
}

struct Conditions {
  double a, b, c;
};

inline Conditions ConditionsOf(const LongMatrix &C, const LongVector &row, const LongVector &col)
{
  const Eigen::PartialPivLU<LongMatrix> lu(C), lut(C.transpose());
  const Eigen::Index                    n = C.rows();
  double                                cond[3];
  for (int s = 0; s < 3; s++) { /* A = R^-1 C K^-1, where R and K contain the scalings of (c) that this case lacks */
    const LongVector R = s < 2 ? row : LongVector::Ones(n).eval(), K = s < 1 ? col : LongVector::Ones(n).eval();
    const auto       A = [&](const LongVector &x, bool transposed) -> LongVector {
      return transposed ? LongVector((C.transpose() * x.cwiseQuotient(R)).cwiseQuotient(K))
                              : LongVector((C * x.cwiseQuotient(K)).cwiseQuotient(R));
    };
    const auto inverse = [&](const LongVector &x, bool transposed) -> LongVector {
      return transposed ? LongVector(R.cwiseProduct(lut.solve(LongVector(K.cwiseProduct(x)))))
                        : LongVector(K.cwiseProduct(lu.solve(LongVector(R.cwiseProduct(x)))));
    };
    cond[s] = (double)(LargestSingularValue(n, A) * LargestSingularValue(n, inverse));
  }
  return {cond[0], cond[1], cond[2]};
}

inline PetscErrorCode MarkRole(TS ts, TSHHT3Role role, double value, LongVector &mark)
{
  IS              is;
  const PetscInt *index;
  PetscInt        n;
  PetscFunctionBegin;
  PetscCall(TSHHT3GetIS(ts, role, &is));
  if (!is) PetscFunctionReturn(0);
  PetscCall(ISGetLocalSize(is, &n));
  PetscCall(ISGetIndices(is, &index));
  for (PetscInt i = 0; i < n; i++) mark(index[i]) = value;
  PetscCall(ISRestoreIndices(is, &index));
  PetscFunctionReturn(0);
}

/* For the present state of a TS on one rank and a step of length h */
inline PetscErrorCode ScalingConditions(TS ts, double h, Conditions *cond)
{
  TSHHT3Form form;
  PetscReal  alpha, t;
  SNES       snes;
  Mat        J, P;
  Vec        U, V, A;
  PetscInt   n;
  PetscFunctionBegin;
  PetscCall(TSHHT3GetForm(ts, &form));
  PetscCall(TSHHT3GetAlpha(ts, &alpha));
  const hht3::Parameters p = hht3::HHTParameters(alpha, form == TSHHT3_FORM_PAPER);
  const double           s = hht3::ScalePosition(p, h);
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetJacobian(snes, &J, &P, nullptr, nullptr));
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(TSHHT3GetAcceleration(ts, &A));
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TSComputeI2Jacobian(ts, t, U, V, A, hht3::ShiftV(p, h), hht3::ShiftA(p, h), J, P));
  PetscCall(MatGetSize(P, &n, nullptr));
  LongMatrix C   = LongMatrix::Zero(n, n);
  LongVector row = LongVector::Ones(n), col = row;
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt    *j;
    const PetscScalar *v;
    PetscInt           m;
    PetscCall(MatGetRow(P, i, &m, &j, &v));
    for (PetscInt k = 0; k < m; k++) C(i, j[k]) += v[k];
    PetscCall(MatRestoreRow(P, i, &m, &j, &v));
  }
  PetscCall(MarkRole(ts, TSHHT3_HOLONOMIC, 1 / s, row));
  PetscCall(MarkRole(ts, TSHHT3_COORDINATE, s, col));
  C     = row.asDiagonal() * C * col.asDiagonal();
  *cond = ConditionsOf(C, row, col);
  PetscFunctionReturn(0);
}

/* The table over h = 1e-2 ... 1e-8, reported line by line. The figure is the largest of two: the change of (c) below h
   = 1e-5, in units of 1 %; and the deviation of the growth from 1e-5 to 1e-8, in units of a factor of 2, from h^-4 for
   (a), whose mass block grows relative to the constraints, and from h^-2 for (b) */
using ConditionReport = std::function<void(const std::string &model, double h, const Conditions &)>;

inline PetscErrorCode JudgeConditions(Run &run, TS ts, const std::string &model, const ConditionReport &report)
{
  Conditions at5 = {0, 0, 0}, at2 = at5, c = at5;
  PetscFunctionBegin;
  for (int d = -2; d >= -8; d--) {
    PetscCall(ScalingConditions(ts, std::pow(10, d), &c));
    if (report) report(model, std::pow(10, d), c);
    if (d == -2) at2 = c;
    if (d == -5) at5 = c;
    if (d < -5) run.judge((c.c / at5.c - 1) / 0.01);
  }
  run.judge(std::log2(c.a / at5.a / 1e12));
  run.judge(std::log2(c.b / at5.b / 1e6));
  run.note("(a) %.0e to %.0e, (b) %.0e to %.0e, (c) %.0e to %.0e", at2.a, c.a, at2.b, c.b, at2.c, c.c);
  PetscFunctionReturn(0);
}

inline PetscErrorCode ProblemConditions(Run &run, const hhtex::Problem &p, const ConditionReport &report)
{
  ProblemRun r(p);
  PetscFunctionBegin;
  PetscCall(r.create(run, 1e-6));
  PetscCall(TSSetMaxSteps(r.ts, 5));
  PetscCall(run.solve(r.ts));
  PetscCall(JudgeConditions(run, r.ts, p.name, report));
  run.out.finished = true;
  PetscFunctionReturn(0);
}

/* A chain of rods on ball joints as a scene */
inline PetscErrorCode SceneConditions(Run &run, const ConditionReport &report)
{
  using namespace hhtdae;
  Scene    scene(PETSC_COMM_SELF);
  SceneRun r(scene);
  PetscFunctionBegin;
  Marker last = scene.marker(scene.ground());
  for (int k = 0; k < 10; k++) {
    RigidBody rod;
    rod.inertia  = Vector3(1e-2, 1. / 12, 1. / 12).asDiagonal();
    rod.position = {k + 0.5, 0, 0};
    const Body b = scene.add("", rod);
    scene.add("", Spherical{scene.marker(b, {-0.5, 0, 0}), last});
    last = scene.marker(b, {0.5, 0, 0});
  }
  scene.gravity({0, 0, -9.81});
  PetscCall(r.create(run, 1, 1e-6));
  PetscCall(TSSetMaxSteps(r.ts, 5));
  PetscCall(run.solve(r.ts));
  PetscCall(JudgeConditions(run, r.ts, "chain of 10, scene", report));
  run.out.finished = true;
  PetscFunctionReturn(0);
}

inline void AddConditions(Cases &cases, const ConditionReport &report = {})
{
  const char *figure = "(a) h^-4, (b) h^-2, (c) constant";
  Add(cases, "condition", "Andrews", figure, 1,
      [report](Run &r) { return ProblemConditions(r, hhtex::Andrews(), report); });
  Add(cases, "condition", "four-bar", figure, 1,
      [report](Run &r) { return ProblemConditions(r, hhtex::FourBar(2, 1), report); });
  Add(cases, "condition", "chain of 10, scene", figure, 1, [report](Run &r) {
    return SceneConditions(r, report);
  }).test();
}

} // namespace hhtstab

#endif
