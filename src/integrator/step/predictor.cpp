/*
  The predictor, section 6 of the paper: a, s', lambda, V, F at t_{n+1} extrapolated by the polynomial of degree 0 to 3 (up to 5 above order two) through their
  values at the ends of the accepted steps.

  The polynomial of degree d through the values before a new one misses it by the scaled difference of order d + 1. So one sweep shows
  which degree would have been the best one for the last step; it is used for the next. A higher degree must be better by a margin,
  since it amplifies noise.
*/
#include "integrator/entries.h"
#include "predictor.h"
#include "integrator/sweeps.h"
#include <algorithm>

namespace hht3
{

namespace
{

constexpr PetscReal higher_degree_margin = 0.7; /* a higher degree is taken if its error was less than this times that of the lower one */

/* Replaces the predicted s' at t1 by the algorithmic w that gives it: the average of states in PrepareStage(), solved for w */
PetscErrorCode StatesToUnknowns(const Integrator &I, Vec X)
{
  const Parameters &p = I.p;
  const PetscReal   r = I.h_last > 0 ? I.h / I.h_last : 1;

  PetscFunctionBegin;
  PetscCall(ForSome(
    I.states, [&](PetscInt, PetscScalar v0, PetscScalar x0, PetscScalar &x) { x = ((1 - p.af_s) * x + p.af_s * v0 - p.am_s * (v0 + r * (x0 - v0))) / (1 - p.am_s); },
    Read(I.V0), Read(I.X0), Write(X)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sums of squares of weighted scaled differences, or the largest ones. `room` is a constant so that loops are unrolled; points
   that are missing have factors of zero. */
template <int room, bool largest>
struct DifferenceSweep {
  const PetscScalar *x[room], *w;
  PetscReal          factor[room][room];
  Four               result[room] = {};

  template <class At>
  HHT3_INLINE void operator()(const At &at)
  {
    const Four weight = at.get(w);
    Four       d[room];
    for (int j = 0; j < room; j++) d[j] = at.get(x[j]);
    for (int m = 1; m < room; m++) {
      for (int j = 0; j + m < room; j++) d[j] = (d[j] - d[j + 1]) * factor[m][j];
      const Four weighted = d[0] * weight;
      if (largest) result[m] = Larger(Absolute(weighted), result[m]);
      else result[m] += weighted * weighted;
    }
  }
  PetscReal total(int m) const { return largest ? PetscMax(PetscMax(result[m][0], result[m][1]), PetscMax(result[m][2], result[m][3])) : Total(result[m]); }
};

template <int room, bool largest>
PetscErrorCode SweepDifferences(const Integrator &I, PetscInt points, const Vec x[], const PetscReal t[], PetscReal result[])
{
  DifferenceSweep<room, largest> d;
  PetscInt                       n;

  PetscFunctionBegin;
  for (int m = 1; m < room; m++)
    for (int j = 0; j + m < room; j++) d.factor[m][j] = j + m < points ? DifferenceFactor(t, m, j) : 0;
  PetscCall(VecGetLocalSize(I.weight, &n));
  PetscCall(VecGetArrayRead(I.weight, &d.w));
  for (int j = 0; j < room; j++) PetscCall(VecGetArrayRead(x[j < points ? j : 0], &d.x[j]));
  d = Sweep(n, d);
  for (int m = 1; m < points; m++) result[m] = d.total(m);
  for (int j = 0; j < room; j++) PetscCall(VecRestoreArrayRead(x[j < points ? j : 0], &d.x[j]));
  PetscCall(VecRestoreArrayRead(I.weight, &d.w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode ScaledDifferences(TS ts, NormType type, PetscInt points, const Vec x[], const PetscReal t[], PetscReal S[])
{
  const Integrator &I = Get(ts);
  constexpr int     few = default_degree + 2, most = max_degree + 2;
  const auto        sweep = type == NORM_2 ? points > few ? SweepDifferences<most, false> : SweepDifferences<few, false> : points > few ? SweepDifferences<most, true> : SweepDifferences<few, true>;

  PetscFunctionBegin;
  PetscCall(sweep(I, points, x, t, S));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, S + 1, (PetscMPIInt)(points - 1), MPIU_REAL, type == NORM_2 ? MPIU_SUM : MPIU_MAX, PetscObjectComm((PetscObject)ts)));
  for (PetscInt m = 1; m < points && type == NORM_2; m++) S[m] = PetscSqrtReal(S[m] / PetscMax(I.norm_size, 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SlopeOfUnknowns(const Integrator &I, Vec slope)
{
  const Predictor &p = I.predictor;

  PetscFunctionBegin;
  PetscCall(VecWAXPY(slope, -1, p.X[1], p.X[0]));
  PetscCall(VecScale(slope, 1 / (p.t[0] - p.t[1])));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forgets the history; X[0] is left as the only point */
PetscErrorCode PredictorReset(TS ts)
{
  Predictor &p = Get(ts).predictor;

  PetscFunctionBegin;
  p.available = 0;
  p.degree    = 0;
  p.t[0]      = ts->ptime;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode Predict(TS ts, Vec X)
{
  Integrator &I = Get(ts);
  Predictor  &p = I.predictor;
  PetscScalar weight[max_degree + 1];

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.predict, ts, 0, 0, 0));
  LagrangeWeights(p.degree, p.t, I.t1, weight);
  PetscCall(VecZeroEntries(X));
  PetscCall(VecMAXPY(X, p.degree + 1, weight, p.X));
  if (I.count[TSHHT3_STATE]) PetscCall(StatesToUnknowns(I, X));
  PetscCall(PetscLogEventEnd(events.predict, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the unknowns of coordinates so that U1 = U0; all others stay as predicted. Where a load sets in suddenly on a system whose
   stiffness in a step far exceeds its inertia, the solution is near the static one; the prediction is far off there, and also after
   it, while such a load makes accelerations oscillate from step to step. */
PetscErrorCode PredictRest(const Integrator &I, Vec X)
{
  const PetscReal k = ScalePosition(I.p, I.h);

  PetscFunctionBegin;
  PetscCall(ForEntries([&](PetscInt i, PetscScalar u0, PetscScalar base, PetscScalar &x) { if (RoleOf(I, i) == TSHHT3_COORDINATE) x = (u0 - base) / k; }, Read(I.U0), Read(I.base[0]), Write(X)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The step at t1 is accepted: it becomes X[0], and the degree for the next step is chosen */
PetscErrorCode PredictorUpdate(TS ts)
{
  Integrator    &I = Get(ts);
  Predictor     &p = I.predictor;
  /* the error estimate of states needs the value before t_n, dense output of order k those at the ends of k steps */
  const PetscInt keep = PetscMax(p.degree_max, I.order.max > 2 ? I.order.max - 1 : I.count[TSHHT3_STATE] ? 1 : 0);
  const PetscInt have = PetscMin(p.available, keep) + 1;
  PetscReal      S[max_degree + 2], best = PETSC_MAX_REAL;

  PetscFunctionBegin;
  if (!p.X[have]) PetscCall(VecDuplicate(I.X, &p.X[have]));
  std::rotate(p.X, p.X + have, p.X + have + 1);
  std::copy_backward(p.t, p.t + have, p.t + have + 1);
  p.t[0] = I.t1;
  PetscCall(VecCopy(I.X, p.X[0]));
  if (I.count[TSHHT3_STATE]) PetscCall(ForSome(I.states, [](PetscInt, PetscScalar rate, PetscScalar &now) { now = rate; }, Read(I.V1), Write(p.X[0])));
  p.available = PetscMin(have, keep);
  p.degree    = PetscMin(p.available, p.degree_max);
  if (p.fixed || !p.degree_max) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ScaledDifferences(ts, NORM_2, have + 1, p.X, p.t, S));
  for (PetscInt d = 0; d < PetscMin(have, p.degree_max + 1); d++) {
    if (d > 0 && !(S[d + 1] < higher_degree_margin * best)) break;
    best     = S[d + 1];
    p.degree = d;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
