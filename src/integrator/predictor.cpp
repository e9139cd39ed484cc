/*
  The predictor, section 6 of the paper: a, s', lambda, V, F at t_{n+1} extrapolated by a polynomial of degree 0 to 3 through the
  accepted steps, in Newton's form

    P_d(t) = D_0 + (t - t_n) D_1 + (t - t_n)(t - t_{n-1}) D_2 + ...

  with divided differences D_k. A polynomial of degree d missed the new value by exactly (t - t_n)...(t - t_{n-d}) D_{d+1}
  with the new difference, so that one sweep over the differences both updates them and tells which degree would have
  served best. That degree is used next; a higher one must be better by a margin, since it amplifies noise.
*/
#include "impl.h"

namespace hht3
{

namespace
{

constexpr PetscReal margin = 0.7; /* a higher degree must have missed by less than this times the lower one's miss */

/* New differences from the old ones and the new values x, in place; misses of the degrees 0..have, squared. Weights of
   unknowns that do not count are zero. The number of differences is a template's, for a loop without inner branches. */
template <int have>
void SweepFixed(PetscInt n, bool grow, const PetscReal span[], const PetscScalar *x, PetscScalar *const D[], const PetscScalar *w, PetscReal miss[])
{
  PetscReal    inverse[have + 1], sum[have + 1] = {};
  PetscScalar *d[have + 1], *const next = grow ? D[have + 1] : nullptr;
  for (int k = 0; k <= have; k++) {
    inverse[k] = 1 / span[k];
    d[k]       = D[k];
  }
  for (PetscInt i = 0; i < n; i++) {
    PetscScalar fresh = x[i];
    for (int k = 0; k <= have; k++) {
      const PetscScalar old = d[k][i];
      d[k][i]               = fresh;
      fresh                 = (fresh - old) * inverse[k];
      sum[k] += PetscSqr(PetscRealPart(fresh * w[i]));
    }
    if (next) next[i] = fresh;
  }
  for (int k = 0; k <= have; k++) miss[k] = sum[k];
}

void Sweep(PetscInt n, PetscInt have, PetscInt keep, const PetscReal span[], const PetscScalar *x, PetscScalar *const D[], const PetscScalar *w, PetscReal miss[])
{
  static_assert(max_degree == 3, "one case for each number of differences");
  const bool grow = have < keep;
  switch (have) {
  case 0: SweepFixed<0>(n, grow, span, x, D, w, miss); break;
  case 1: SweepFixed<1>(n, grow, span, x, D, w, miss); break;
  case 2: SweepFixed<2>(n, grow, span, x, D, w, miss); break;
  default: SweepFixed<3>(n, false, span, x, D, w, miss); break;
  }
}

/* The new values: a, lambda, V, F as they are, of states s' */
PetscErrorCode TrueValues(const Integrator &I, Vec x)
{
  const PetscScalar *v;
  PetscScalar       *a;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecCopy(I.X, x));
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArrayRead(I.V1, &v));
  PetscCall(VecGetArray(x, &a));
  for (PetscInt i = 0; i < n; i++)
    if (I.role[i] == TSHHT3_STATE) a[i] = v[i];
  PetscCall(VecRestoreArray(x, &a));
  PetscCall(VecRestoreArrayRead(I.V1, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Predicted s' at t1 to the algorithmic w that gives it: the average of StepStage() in equations.cpp, solved for w */
PetscErrorCode StatesToUnknowns(const Integrator &I, Vec X)
{
  const Parameters  &p = I.p;
  const PetscReal    r = I.h_last > 0 ? I.h / I.h_last : 1;
  const PetscScalar *v0, *x0;
  PetscScalar       *x;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(X, &n));
  PetscCall(VecGetArrayRead(I.V0, &v0));
  PetscCall(VecGetArrayRead(I.X0, &x0));
  PetscCall(VecGetArray(X, &x));
  for (PetscInt i = 0; i < n; i++)
    if (I.role[i] == TSHHT3_STATE) x[i] = ((1 - p.af_s) * x[i] + p.af_s * v0[i] - p.am_s * (v0[i] + r * (x0[i] - v0[i]))) / (1 - p.am_s);
  PetscCall(VecRestoreArray(X, &x));
  PetscCall(VecRestoreArrayRead(I.X0, &x0));
  PetscCall(VecRestoreArrayRead(I.V0, &v0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* Forgets the history; D_0 stands as the only point */
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
  Integrator  &I = Get(ts);
  Predictor   &p = I.predictor;
  PetscReal    factor = 1;
  PetscScalar  coef[max_degree];

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.predict, ts, 0, 0, 0));
  PetscCall(VecCopy(p.D[0], X));
  for (PetscInt k = 0; k < p.degree; k++) coef[k] = factor *= I.t1 - p.t[k];
  if (p.degree) PetscCall(VecMAXPY(X, p.degree, coef, &p.D[1]));
  if (I.count[TSHHT3_STATE]) PetscCall(StatesToUnknowns(I, X));
  PetscCall(PetscLogEventEnd(events.predict, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The step at t1 is accepted: it becomes D_0, and the degree for the next step is chosen */
PetscErrorCode PredictorUpdate(TS ts)
{
  Integrator        &I    = Get(ts);
  Predictor         &p    = I.predictor;
  const PetscInt     keep = PetscMax(p.degree_max, I.count[TSHHT3_STATE] ? 1 : 0); /* the estimate of states needs D_1 */
  const PetscInt     have = PetscMin(p.available, keep);                           /* old D_0..D_have exist */
  PetscReal          span[max_degree + 1], miss[max_degree + 1] = {0, 0, 0, 0}, sum[max_degree + 1];
  PetscScalar       *D[max_degree + 1] = {};
  const PetscReal    t = I.t1;
  const PetscScalar *x, *w;
  Vec                now = I.X;
  PetscInt           n;

  PetscFunctionBegin;
  for (PetscInt k = 0; k <= keep; k++)
    if (!p.D[k]) PetscCall(VecDuplicate(I.X, &p.D[k]));
  for (PetscInt k = 0; k <= have; k++) span[k] = t - p.t[k];
  PetscCall(VecGetLocalSize(I.X, &n));
  if (I.count[TSHHT3_STATE]) PetscCall(TrueValues(I, now = I.work));
  PetscCall(VecGetArrayRead(now, &x));
  PetscCall(VecGetArrayRead(I.weight, &w));
  for (PetscInt k = 0; k <= keep; k++) PetscCall(VecGetArray(p.D[k], &D[k]));
  Sweep(n, have, keep, span, x, D, w, miss);
  for (PetscInt k = 0; k <= keep; k++) PetscCall(VecRestoreArray(p.D[k], &D[k]));
  PetscCall(VecRestoreArrayRead(I.weight, &w));
  PetscCall(VecRestoreArrayRead(now, &x));
  for (PetscInt k = have; k >= 0; k--) p.t[k + 1] = p.t[k];
  p.t[0]      = t;
  p.available = PetscMin(have + 1, keep);

  if (p.fixed || !p.degree_max) {
    p.degree = PetscMin(p.available, p.degree_max);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCallMPI(MPI_Allreduce(miss, sum, (PetscMPIInt)(have + 1), MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  PetscReal factor = 1, best = PETSC_MAX_REAL;
  p.degree = 0;
  for (PetscInt d = 0; d <= PetscMin(have, p.degree_max); d++) {
    factor *= span[d];
    const PetscReal m = PetscAbsReal(factor) * PetscSqrtReal(sum[d]);
    if (m < margin * best || d == 0) {
      best     = m;
      p.degree = d;
    } else break;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
