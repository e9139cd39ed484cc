/*
  The error test: (26), (27) with the weights Y_i.

  Positions are judged by delta = k h^2 (a_{n+1} - a_n); first-order states by k_s h^3 s''' with s''' from the last three
  derivatives s'; lambda, V and F never. In PETSc's terms weight_i = 1/max(atol_i, rtol_i Y_i) with Y_i the running maximum
  of |q_i| over accepted steps. The local error is of third order, which makes TSADAPTBASIC with its safety factor 0.9 the
  controller (41), h_new = 0.9 h / Theta^(1/6).
*/
#include "impl.h"
#include "sweeps.h"

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

/* Running maxima y of |u| and weights w of entries that u exceeds; tolerances as in Tolerances::weight() */
struct Raise {
  Tolerances         tol;
  const PetscScalar *u;
  PetscScalar       *y, *w;

  template <class At>
  HHT3_INLINE void operator()(const At &at) const
  {
    const Four zero = {0, 0, 0, 0}, size = Absolute(at.get(u)), old = at.get(y);
    const Four a = tol.va ? at.get(tol.va) : zero + tol.a, r = tol.vr ? at.get(tol.vr) : zero + tol.r, t = Larger(a, r * size);
    at.put(w, size > old ? (t > 0 ? 1 / t : zero) : at.get(w));
    at.put(y, Larger(size, old));
  }
};

struct Squares {
  const PetscScalar *d, *w;
  Four               sum = {0, 0, 0, 0};

  template <class At>
  HHT3_INLINE void operator()(const At &at)
  {
    const Four x = at.get(d) * at.get(w);
    sum += x * x;
  }
};

/* a_{n+1} - a_n by the weights of coordinates, for the sum of squares or the largest; a_n as in BaseOfCoordinates */
template <bool largest>
struct Jumps {
  PetscReal          r;
  const PetscScalar *x, *x0, *a0, *w;
  const float       *moves; /* if there are states, whose weights are not meant */
  Four               result = {0, 0, 0, 0};

  template <class At>
  HHT3_INLINE void operator()(const At &at)
  {
    const Four a = at.get(a0), weight = moves ? at.get(w) * at.get(moves) : at.get(w), d = weight * (at.get(x) - (a + r * (at.get(x0) - a)));
    if (largest) result = Larger(Absolute(d), result);
    else result += d * d;
  }
};

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

/* The first weights. Also the size below which a correction is rounding of q, and the number of entries that enter the norm
   (p in (27)). What does not enter has a Y_i that it never exceeds, and so keeps its weight 0. */
static PetscErrorCode FirstWeights(TS ts, PetscInt n, const Raise &all)
{
  Integrator &I        = Get(ts);
  PetscReal   local[2] = {0, 0}, global[2];

  PetscFunctionBegin;
  for (PetscInt i : I.rotations.at) std::fill_n(all.y + i, 3, 1); /* a turn is rounded as the attitude is */
  for (PetscInt i = 0; i < n; i++) {
    if (!IsDifferential(RoleOf(I, i))) {
      all.y[i] = PETSC_MAX_REAL;
      continue;
    }
    all.y[i] = PetscMax(all.y[i], PetscAbsScalar(all.u[i]));
    all.w[i] = all.tol.weight(i, all.y[i]);
    local[0] += PetscSqr(all.y[i] * all.w[i]);
    if (all.w[i] > 0) local[1] += 1;
  }
  PetscCallMPI(MPI_Allreduce(local, global, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  I.norm_size = (PetscInt)(global[1] + 0.5);
  PetscCheck(I.norm_size > 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG,
             "No unknown enters the error test: there is neither a coordinate nor a first-order state with a tolerance above 0 (-ts_rtol, -ts_atol)");
  /* rounding of q moves a by eps |q| / (beta h^2), and with it the estimate by this much, at any h */
  I.corrector.floor = 4 * PetscAbsReal(I.p.k) / I.p.beta * PETSC_MACHINE_EPSILON * PetscSqrtReal(global[0] / I.norm_size);
  if (I.corrector.floor > CorrectorTolerance(I))
    PetscCall(PetscInfo(ts, "the tolerance is so small that rounding of q stops the corrector at %g of it\n", (double)I.corrector.floor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Y_i and the weights after U has been accepted */
PetscErrorCode UpdateWeights(TS ts, Vec U)
{
  Integrator &I = Get(ts);
  Raise       all;
  PetscInt    n;

  PetscFunctionBegin;
  PetscCall(GetTolerances(ts, &all.tol));
  PetscCall(VecGetLocalSize(U, &n));
  PetscCall(VecGetArrayRead(U, &all.u));
  PetscCall(VecGetArray(I.ymax, &all.y));
  PetscCall(VecGetArray(I.weight, &all.w));
  if (I.norm_size) Sweep(n, all);
  else PetscCall(FirstWeights(ts, n, all));
  PetscCall(VecRestoreArray(I.weight, &all.w));
  PetscCall(VecRestoreArray(I.ymax, &all.y));
  PetscCall(VecRestoreArrayRead(U, &all.u));
  PetscCall(RestoreTolerances(ts, &all.tol));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From this rank's sum of squares of a correction by the weights to its norm. Multipliers have no weight, but must be numbers: 0
   times Inf or NaN is NaN. */
PetscErrorCode ReduceCorrection(TS ts, Vec dX, PetscReal sum, PetscReal *e)
{
  Integrator        &I = Get(ts);
  const PetscReal    q = PetscAbsReal(I.p.k) * I.h * I.h, s = I.p.gamma_s * I.h;
  PetscReal          states = 0;
  const PetscScalar *d, *w;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(dX, &d));
  PetscCall(VecGetArrayRead(I.weight, &w));
  for (PetscInt i : I.states) states += PetscSqr(d[i] * w[i]);
  PetscCall(VecRestoreArrayRead(I.weight, &w));
  PetscCall(VecRestoreArrayRead(dX, &d));
  PetscCall(Reduce(ts, NORM_2, I.norm_size, PetscMax(sum - states, 0) * q * q + states * s * s, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A correction in units of the tolerance: the change of the error estimate that it makes, (40) */
PetscErrorCode CorrectionNorm(TS ts, Vec dX, PetscReal *e)
{
  Integrator &I = Get(ts);
  Squares     all;
  PetscInt    n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(dX, &n));
  PetscCall(VecGetArrayRead(dX, &all.d));
  PetscCall(VecGetArrayRead(I.weight, &all.w));
  all = Sweep(n, all);
  PetscCall(VecRestoreArrayRead(I.weight, &all.w));
  PetscCall(VecRestoreArrayRead(dX, &all.d));
  PetscCall(ReduceCorrection(ts, dX, Total(all.sum), e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* to = dX times the squares of its weights: a product with it is that of corrections, whose norm is CorrectionNorm() but for a factor */
PetscErrorCode WeightCorrection(const Integrator &I, Vec dX, Vec to)
{
  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(to, dX, I.weight));
  PetscCall(VecPointwiseMult(to, to, I.weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (26) of the coordinates: the sum of squares, or the largest, on this rank */
static PetscErrorCode CoordinateErrors(const Integrator &I, NormType type, PetscReal *result)
{
  const PetscReal h = I.h, k = PetscAbsReal(I.p.k) * h * h;
  Jumps<false>    sum;
  PetscInt        n;

  PetscFunctionBegin;
  sum.r     = I.h_last > 0 ? h / I.h_last : 1;
  sum.moves = I.states.empty() ? nullptr : I.moves.data();
  PetscCall(VecGetLocalSize(I.X, &n));
  PetscCall(VecGetArrayRead(I.X, &sum.x));
  PetscCall(VecGetArrayRead(I.X0, &sum.x0));
  PetscCall(VecGetArrayRead(I.A0, &sum.a0));
  PetscCall(VecGetArrayRead(I.weight, &sum.w));
  if (type == NORM_2) *result = k * k * Total(Sweep(n, sum).result);
  else {
    const Four x = Sweep(n, Jumps<true>{sum.r, sum.x, sum.x0, sum.a0, sum.w, sum.moves}).result;
    *result      = k * PetscMax(PetscMax(x[0], x[1]), PetscMax(x[2], x[3]));
  }
  PetscCall(VecRestoreArrayRead(I.weight, &sum.w));
  PetscCall(VecRestoreArrayRead(I.A0, &sum.a0));
  PetscCall(VecRestoreArrayRead(I.X0, &sum.x0));
  PetscCall(VecRestoreArrayRead(I.X, &sum.x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The same of first-order states, added; their third derivative wants the step before the last */
static PetscErrorCode AddStateErrors(const Integrator &I, NormType type, PetscReal *result)
{
  const PetscReal    h = I.h;
  const PetscScalar *w, *v0, *v1, *d1;

  PetscFunctionBegin;
  if (!I.count[TSHHT3_STATE] || I.predictor.available < 1) PetscFunctionReturn(PETSC_SUCCESS);
  const PetscReal span = I.predictor.t[0] + h - I.predictor.t[1], k = I.p.k_s * h * h * h * 2 / span;
  PetscCall(VecGetArrayRead(I.V0, &v0));
  PetscCall(VecGetArrayRead(I.V1, &v1));
  PetscCall(VecGetArrayRead(I.predictor.D[1], &d1));
  PetscCall(VecGetArrayRead(I.weight, &w));
  for (PetscInt i : I.states) {
    const PetscReal delta = PetscAbsReal(w[i] * k * ((v1[i] - v0[i]) / h - d1[i]));
    *result               = type == NORM_2 ? *result + delta * delta : PetscMax(*result, delta);
  }
  PetscCall(VecRestoreArrayRead(I.weight, &w));
  PetscCall(VecRestoreArrayRead(I.predictor.D[1], &d1));
  PetscCall(VecRestoreArrayRead(I.V1, &v1));
  PetscCall(VecRestoreArrayRead(I.V0, &v0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode EvaluateWLTE(TS ts, NormType type, PetscInt *order, PetscReal *wlte)
{
  Integrator &I   = Get(ts);
  PetscReal   acc = 0;

  PetscFunctionBegin;
  if (order) *order = I.order.now + 1;
  *wlte = -1;
  if (I.status != TS_STEP_PENDING) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscLogEventBegin(events.estimate, ts, 0, 0, 0));
  if (I.order.now > 2) PetscCall(ErrorOfOrder(ts, type, wlte));
  else {
    PetscCall(CoordinateErrors(I, type, &acc));
    PetscCall(AddRotationErrors(I, type, &acc));
    PetscCall(AddStateErrors(I, type, &acc));
    PetscCall(Reduce(ts, type, I.norm_size, acc, wlte));
  }
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

} // namespace hht3
