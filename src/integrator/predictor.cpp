/*
  The predictor, section 6 of the paper: a, s', lambda, V, F at t_{n+1} extrapolated by a polynomial of degree 0 to 3 (up to 5 above order two) through the
  accepted steps, in Newton's form

    P_d(t) = D_0 + (t - t_n) D_1 + (t - t_n)(t - t_{n-1}) D_2 + ...

  with divided differences D_k. A polynomial of degree d missed the new value by exactly (t - t_n)...(t - t_{n-d}) D_{d+1}
  with the new difference, so that one sweep over the differences both updates them and tells which degree would have
  served best. That degree is used next; a higher one must be better by a margin, since it amplifies noise.
*/
#include "impl.h"
#include "sweeps.h"

namespace hht3
{

namespace
{

constexpr PetscReal margin = 0.7; /* a higher degree must have missed by less than this times the lower one's miss */

/* New differences from the old ones and the new values x, in place; misses of the degrees 0..have, squared. Weights of
   unknowns that do not count are zero. The number of differences is a template's, for a loop without inner branches. */
template <int have, bool grow>
struct Renewal {
  const PetscScalar *x, *w;
  PetscScalar       *D[have + 2];
  PetscReal          inverse[have + 1]; /* of the times that the differences span */
  Four               sum[have + 1] = {};

  template <class At>
  HHT3_INLINE void operator()(const At &at)
  {
    const Four weight = at.get(w);
    Four       fresh  = at.get(x);
    for (int k = 0; k <= have; k++) {
      const Four old = at.get(D[k]);
      at.put(D[k], fresh);
      fresh            = (fresh - old) * inverse[k];
      const Four missed = fresh * weight;
      sum[k] += missed * missed;
    }
    if (grow) at.put(D[have + 1], fresh);
  }
};

template <int have, bool grow>
void Renew(PetscInt n, const PetscReal span[], const PetscScalar *x, PetscScalar *const D[], const PetscScalar *w, PetscReal miss[])
{
  Renewal<have, grow> r;
  r.x = x;
  r.w = w;
  for (int k = 0; k <= have; k++) r.inverse[k] = 1 / span[k];
  for (int k = 0; k <= (grow ? have + 1 : have); k++) r.D[k] = D[k];
  r = Sweep(n, r);
  for (int k = 0; k <= have; k++) miss[k] = Total(r.sum[k]);
}

void RenewDifferences(PetscInt n, PetscInt have, PetscInt keep, const PetscReal span[], const PetscScalar *x, PetscScalar *const D[], const PetscScalar *w, PetscReal miss[])
{
  static_assert(max_degree == 5, "one case for each number of differences");
  const bool grow = have < keep;
  switch (have) {
  case 0: (grow ? Renew<0, true> : Renew<0, false>)(n, span, x, D, w, miss); break;
  case 1: (grow ? Renew<1, true> : Renew<1, false>)(n, span, x, D, w, miss); break;
  case 2: (grow ? Renew<2, true> : Renew<2, false>)(n, span, x, D, w, miss); break;
  case 3: (grow ? Renew<3, true> : Renew<3, false>)(n, span, x, D, w, miss); break;
  case 4: (grow ? Renew<4, true> : Renew<4, false>)(n, span, x, D, w, miss); break;
  default: Renew<5, false>(n, span, x, D, w, miss); break;
  }
}

/* x = D_0 + factor_1 D_1 + ... */
template <int degree>
struct Extrapolation {
  const PetscScalar *D[degree + 1];
  PetscReal          factor[degree + 1];
  PetscScalar       *x;

  template <class At>
  HHT3_INLINE void operator()(const At &at) const
  {
    Four sum = at.get(D[0]);
    for (int k = 1; k <= degree; k++) sum += factor[k] * at.get(D[k]);
    at.put(x, sum);
  }
};

template <int degree>
PetscErrorCode Extrapolate(const Predictor &p, PetscReal t, Vec X)
{
  Extrapolation<degree> e;
  PetscInt              n;

  PetscFunctionBegin;
  e.factor[0] = 1;
  for (int k = 1; k <= degree; k++) e.factor[k] = e.factor[k - 1] * (t - p.t[k - 1]);
  PetscCall(VecGetLocalSize(X, &n));
  for (int k = 0; k <= degree; k++) PetscCall(VecGetArrayRead(p.D[k], &e.D[k]));
  PetscCall(VecGetArrayWrite(X, &e.x));
  Sweep(n, e);
  PetscCall(VecRestoreArrayWrite(X, &e.x));
  for (int k = 0; k <= degree; k++) PetscCall(VecRestoreArrayRead(p.D[k], &e.D[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The new values: a, lambda, V, F as they are, of states s' */
PetscErrorCode TrueValues(const Integrator &I, Vec x)
{
  const PetscScalar *v;
  PetscScalar       *a;

  PetscFunctionBegin;
  PetscCall(VecCopy(I.X, x));
  PetscCall(VecGetArrayRead(I.V1, &v));
  PetscCall(VecGetArray(x, &a));
  for (PetscInt i : I.states) a[i] = v[i];
  PetscCall(VecRestoreArray(x, &a));
  PetscCall(VecRestoreArrayRead(I.V1, &v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Predicted s' at t1 to the algorithmic w that gives it: the average of StageOfStates() in stage.cpp, solved for w */
PetscErrorCode StatesToUnknowns(const Integrator &I, Vec X)
{
  const Parameters  &p = I.p;
  const PetscReal    r = I.h_last > 0 ? I.h / I.h_last : 1;
  const PetscScalar *v0, *x0;
  PetscScalar       *x;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(I.V0, &v0));
  PetscCall(VecGetArrayRead(I.X0, &x0));
  PetscCall(VecGetArray(X, &x));
  for (PetscInt i : I.states) x[i] = ((1 - p.af_s) * x[i] + p.af_s * v0[i] - p.am_s * (v0[i] + r * (x0[i] - v0[i]))) / (1 - p.am_s);
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

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.predict, ts, 0, 0, 0));
  switch (p.degree) {
  case 0: PetscCall(VecCopy(p.D[0], X)); break;
  case 1: PetscCall(Extrapolate<1>(p, I.t1, X)); break;
  case 2: PetscCall(Extrapolate<2>(p, I.t1, X)); break;
  case 3: PetscCall(Extrapolate<3>(p, I.t1, X)); break;
  case 4: PetscCall(Extrapolate<4>(p, I.t1, X)); break;
  default: PetscCall(Extrapolate<5>(p, I.t1, X)); break;
  }
  if (I.count[TSHHT3_STATE]) PetscCall(StatesToUnknowns(I, X));
  PetscCall(PetscLogEventEnd(events.predict, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The step at t1 is accepted: it becomes D_0, and the degree for the next step is chosen */
PetscErrorCode PredictorUpdate(TS ts)
{
  Integrator        &I    = Get(ts);
  Predictor         &p    = I.predictor;
  /* the estimate of states needs D_1, dense output of order k D_{k-1} */
  const PetscInt     keep = PetscMax(p.degree_max, I.order.max > 2 ? I.order.max - 1 : I.count[TSHHT3_STATE] ? 1 : 0);
  const PetscInt     have = PetscMin(p.available, keep);                           /* old D_0..D_have exist */
  PetscReal          span[max_degree + 1], miss[max_degree + 1] = {}, sum[max_degree + 1];
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
  RenewDifferences(n, have, keep, span, x, D, w, miss);
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
