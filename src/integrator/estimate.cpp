/*
  The error test: (26), (27) with the weights Y_i, and the decision to hold h.

  Positions are judged by delta = k h^2 (a_{n+1} - a_n); first-order states by k_s h^3 s''' with s''' from the last three
  derivatives s'; lambda, V and F never. In PETSc's terms weight_i = 1/max(atol_i, rtol_i Y_i) with Y_i the running maximum
  of |q_i| over accepted steps. The local error is of third order, which makes TSADAPTBASIC with its safety factor 0.9 the
  controller (41), h_new = 0.9 h / Theta^(1/6).
*/
#include "impl.h"

namespace hht3
{

namespace
{

struct Tolerances { /* scalar, or vector where the user gave vectors */
  const PetscScalar *va = nullptr, *vr = nullptr;
  PetscReal          a, r;
  PetscReal          weight(PetscInt i, PetscReal y) const
  {
    const PetscReal tol = PetscMax(va ? PetscRealPart(va[i]) : a, (vr ? PetscRealPart(vr[i]) : r) * y);
    return tol > 0 ? 1 / tol : 0;
  }
};

PetscErrorCode GetTolerances(TS ts, Tolerances *t)
{
  PetscFunctionBegin;
  t->a = ts->atol;
  t->r = ts->rtol;
  if (ts->vatol) PetscCall(VecGetArrayRead(ts->vatol, &t->va));
  if (ts->vrtol) PetscCall(VecGetArrayRead(ts->vrtol, &t->vr));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RestoreTolerances(TS ts, Tolerances *t)
{
  PetscFunctionBegin;
  if (ts->vatol) PetscCall(VecRestoreArrayRead(ts->vatol, &t->va));
  if (ts->vrtol) PetscCall(VecRestoreArrayRead(ts->vrtol, &t->vr));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Four partial sums: one alone waits for each addition */
PetscReal SumOfSquares(PetscInt n, const PetscScalar *d, const PetscScalar *w)
{
  PetscReal part[4] = {0, 0, 0, 0};
  PetscInt  i       = 0;
  for (; i + 4 <= n; i += 4)
    for (int k = 0; k < 4; k++) part[k] += PetscSqr(PetscRealPart(d[i + k] * w[i + k]));
  for (; i < n; i++) part[0] += PetscSqr(PetscRealPart(d[i] * w[i]));
  return (part[0] + part[1]) + (part[2] + part[3]);
}

/* Root mean square or maximum over all ranks of values accumulated locally */
PetscErrorCode Reduce(TS ts, NormType type, PetscInt size, PetscReal local, PetscReal *norm)
{
  PetscReal global;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(&local, &global, 1, MPIU_REAL, type == NORM_2 ? MPIU_SUM : MPIU_MAX, PetscObjectComm((PetscObject)ts)));
  *norm = type == NORM_2 ? PetscSqrtReal(global / PetscMax(size, 1)) : global;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* Y_i and the weights after U has been accepted. Also the size below which a correction is rounding of q, and the number
   of entries that enter the norm (p in (27)), which the first call counts. */
PetscErrorCode UpdateWeights(TS ts, Vec U)
{
  Integrator        &I = Get(ts);
  Tolerances         tol;
  const PetscScalar *u;
  PetscScalar       *y, *w;
  PetscInt           n;
  PetscReal          local[2] = {0, 0}, global[2];

  PetscFunctionBegin;
  PetscCall(GetTolerances(ts, &tol));
  PetscCall(VecGetLocalSize(U, &n));
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArray(I.ymax, &y));
  PetscCall(VecGetArray(I.weight, &w));
  for (PetscInt i = 0; i < n; i++) {
    if (!IsDifferential(RoleOf(I, i))) continue;
    if (PetscAbsScalar(u[i]) <= PetscRealPart(y[i]) && I.norm_size) continue;
    y[i] = PetscMax(PetscRealPart(y[i]), PetscAbsScalar(u[i]));
    w[i] = tol.weight(i, PetscRealPart(y[i]));
    local[0] += PetscSqr(PetscRealPart(y[i] * w[i]));
    if (PetscRealPart(w[i]) > 0) local[1] += 1;
  }
  PetscCall(VecRestoreArray(I.weight, &w));
  PetscCall(VecRestoreArray(I.ymax, &y));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(RestoreTolerances(ts, &tol));
  if (!I.norm_size) {
    PetscCallMPI(MPI_Allreduce(local, global, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
    I.norm_size = (PetscInt)(global[1] + 0.5);
    PetscCheck(I.norm_size > 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG,
               "No unknown enters the error test: there is neither a coordinate nor a first-order state with a tolerance above 0 (-ts_rtol, -ts_atol)");
    /* rounding of q moves a by eps |q| / (beta h^2), and with it the estimate by this much, at any h */
    I.corrector.floor = 4 * PetscAbsReal(I.p.k) / I.p.beta * PETSC_MACHINE_EPSILON * PetscSqrtReal(global[0] / I.norm_size);
    if (I.corrector.floor > CorrectorTolerance(I))
      PetscCall(PetscInfo(ts, "the tolerance is so small that rounding of q stops the corrector at %g of it\n", (double)I.corrector.floor));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A correction in units of the tolerance: the change of the error estimate that it makes, (40) */
PetscErrorCode CorrectionNorm(TS ts, Vec dX, PetscReal *e)
{
  Integrator        &I = Get(ts);
  const PetscReal    q = PetscAbsReal(I.p.k) * I.h * I.h, s = I.p.gamma_s * I.h;
  const PetscScalar *d, *w;
  PetscReal          sum = 0, states = 0;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(dX, &n));
  PetscCall(VecGetArrayRead(dX, &d));
  PetscCall(VecGetArrayRead(I.weight, &w));
  /* multipliers have no weight, but must be numbers: 0 times Inf or NaN is NaN */
  sum = SumOfSquares(n, d, w);
  if (I.count[TSHHT3_STATE])
    for (PetscInt i = 0; i < n; i++)
      if (I.role[i] == TSHHT3_STATE) states += PetscSqr(PetscRealPart(d[i] * w[i]));
  sum = PetscMax(sum - states, 0) * q * q + states * s * s;
  PetscCall(VecRestoreArrayRead(I.weight, &w));
  PetscCall(VecRestoreArrayRead(dX, &d));
  PetscCall(Reduce(ts, NORM_2, I.norm_size, sum, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode EvaluateWLTE(TS ts, NormType type, PetscInt *order, PetscReal *wlte)
{
  Integrator        &I = Get(ts);
  const PetscReal    h = I.h, r = I.h_last > 0 ? h / I.h_last : 1, kq = I.p.k * h * h;
  const bool         states = I.count[TSHHT3_STATE] > 0, second = states && I.predictor.available >= 1;
  const PetscReal    tn = I.predictor.t[0], span = second ? tn + h - I.predictor.t[1] : 1;
  const PetscScalar *x, *x0, *a0, *w, *v0 = nullptr, *v1 = nullptr, *d1 = nullptr;
  PetscReal          acc = 0;
  PetscInt           n;

  PetscFunctionBegin;
  if (order) *order = 3;
  *wlte = -1;
  if (I.status != TS_STEP_PENDING) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(events.estimate, ts, 0, 0, 0));
  PetscCall(VecGetLocalSize(I.X, &n));
  PetscCall(VecGetArrayRead(I.X, &x));
  PetscCall(VecGetArrayRead(I.X0, &x0));
  PetscCall(VecGetArrayRead(I.A0, &a0));
  PetscCall(VecGetArrayRead(I.weight, &w));
  if (second) {
    PetscCall(VecGetArrayRead(I.V0, &v0));
    PetscCall(VecGetArrayRead(I.V1, &v1));
    PetscCall(VecGetArrayRead(I.predictor.D[1], &d1));
  }
  for (PetscInt i = 0; i < n; i++) {
    const PetscReal wi = PetscRealPart(w[i]);
    if (!(wi > 0)) continue;
    PetscReal delta = 0;
    if (RoleOf(I, i) == TSHHT3_COORDINATE) delta = kq * PetscRealPart(x[i] - (a0[i] + r * (x0[i] - a0[i])));
    else if (second) delta = I.p.k_s * h * h * h * 2 * PetscRealPart((v1[i] - v0[i]) / h - d1[i]) / span;
    delta *= wi;
    acc = type == NORM_2 ? acc + delta * delta : PetscMax(acc, PetscAbsReal(delta));
  }
  if (second) {
    PetscCall(VecRestoreArrayRead(I.predictor.D[1], &d1));
    PetscCall(VecRestoreArrayRead(I.V1, &v1));
    PetscCall(VecRestoreArrayRead(I.V0, &v0));
  }
  PetscCall(VecRestoreArrayRead(I.weight, &w));
  PetscCall(VecRestoreArrayRead(I.A0, &a0));
  PetscCall(VecRestoreArrayRead(I.X0, &x0));
  PetscCall(VecRestoreArrayRead(I.X, &x));
  PetscCall(Reduce(ts, type, I.norm_size, acc, wlte));
  I.wlte_pending = *wlte;
  PetscCall(PetscLogEventEnd(events.estimate, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The estimate of an accepted step, for the corrector's tolerance in the next one: TSAdapt has usually asked for it */
PetscErrorCode NoteError(TS ts)
{
  Integrator &I = Get(ts);
  PetscReal   e;

  PetscFunctionBegin;
  if (I.wlte_pending < 0) PetscCall(EvaluateWLTE(ts, NORM_2, NULL, &e));
  if (I.wlte_pending >= 0) I.corrector.wlte = I.wlte_pending;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a failed correction the error test would lead h straight back to where it failed: it may do so by and by. And a gain
   in h below the threshold costs more in matrices than it saves in steps. Not near the end of the run, where
   TSAdapt fits the last steps to the final time.

   With little damping small losses are not taken either, which at 0.9 of the h for an error of 1 leaves that below 1. They alternate
   as the multipliers' oscillation does in the estimate, and each is a kick in step with it: at alpha = -0.003 (heavy
   top, quaternions) the two drove one another until h had fallen tenfold. */
PetscErrorCode HoldStep(TS ts, PetscReal h, PetscReal *next)
{
  Integrator      &I = Get(ts);
  const Corrector &c = I.corrector;

  PetscFunctionBegin;
  if (I.h_limit > 0 && *next > I.h_limit && !I.fixed_h) *next = PetscMax(h, I.h_limit);
  const PetscReal loss = I.constraints() && RelativeDamping(I.p.rho) < 1 ? 0.95 : 1;
  if (*next == h || *next <= loss * h || *next >= c.hold * h || I.fixed_h || HHT3EventActive(ts)) PetscFunctionReturn(PETSC_SUCCESS);
  if (ts->exact_final_time == TS_EXACTFINALTIME_MATCHSTEP && HHT3NextStop(ts) - (ts->ptime + h) < 4 * *next) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "h = %g is held, not worth %g\n", (double)h, (double)*next));
  *next = h;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
