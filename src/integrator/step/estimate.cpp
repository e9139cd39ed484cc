/*
  The error test: (26), (27) with the weights Y_i.

  The local error is delta = k h^2 (a_{n+1} - a_n) for positions, and k_s h^3 s''' for first-order states, with s''' from the last three
  derivatives s'; lambda, V and F are not tested. In PETSc's terms weight_i = 1/max(atol_i, rtol_i Y_i) with Y_i the running maximum
  of |q_i| over accepted steps. As the local error is of third order, TSADAPTBASIC with its safety factor 0.9 is the
  controller (41), h_new = 0.9 h / Theta^(1/6).
*/
#include "corrector.h"
#include "integrator/entries.h"
#include "estimate.h"
#include "order.h"
#include "integrator/coordinates/rotations.h"

namespace hht3
{

namespace
{

/* 1/max(atol, rtol y), entry by entry if the user gave vectors of tolerances */
struct Tolerances {
  PetscReal          a, r;
  const PetscScalar *va = nullptr, *vr = nullptr;

  PetscReal absolute(PetscInt i) const { return va ? PetscRealPart(va[i]) : a; }
  PetscReal relative(PetscInt i) const { return vr ? PetscRealPart(vr[i]) : r; }
  PetscReal weight(PetscInt i, PetscReal y) const
  {
    const PetscReal tol = PetscMax(absolute(i), relative(i) * y);
    return tol > 0 ? 1 / tol : 0;
  }
};

} // namespace

PetscErrorCode ReduceNorm(TS ts, NormType type, PetscReal local, PetscReal *norm)
{
  PetscReal global;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(&local, &global, 1, MPIU_REAL, type == NORM_2 ? MPIU_SUM : MPIU_MAX, PetscObjectComm((PetscObject)ts)));
  *norm = type == NORM_2 ? PetscSqrtReal(global / PetscMax(Get(ts).norm_size, 1)) : global;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The first weights, the number p of entries in the norm (27), and the size below which a correction is rounding of q. An entry that
   is 0 so far and has only a relative tolerance counts in p, too (Options.RelativeToleranceOfWhatIsZeroAtTheStart). Unknowns that are
   not tested get the largest number as Y_i, so that their weight stays 0. */
static PetscErrorCode FirstWeights(TS ts, const Tolerances &tol, Vec U)
{
  Integrator &I        = Get(ts);
  PetscReal   local[3] = {0, 0, 0}, global[3];

  PetscFunctionBegin;
  if (!I.norm_size) PetscCall(ForSome(I.rotations.at, [](PetscInt, PetscScalar &y) { std::fill_n(&y, 3, 1); }, Write(I.ymax))); /* rounding of a rotation vector is that of the attitude, of size 1 */
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar u, PetscScalar &y, PetscScalar &w) {
      if (!IsDifferential(RoleOf(I, i))) {
        y = PETSC_MAX_REAL;
        return;
      }
      y = PetscMax(y, PetscAbsScalar(u));
      w = tol.weight(i, y);
      local[0] += PetscSqr(y * w);
      if (tol.absolute(i) > 0 || tol.relative(i) > 0) local[1] += 1;
      if (w > 0) local[2] += 1;
    },
    Read(U), Write(I.ymax), Write(I.weight)));
  PetscCallMPI(MPI_Allreduce(local, global, 3, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  I.norm_size = (PetscInt)(global[1] + 0.5);
  PetscCheck(global[2] > 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG,
             "No unknown enters the error test: there is neither a coordinate nor a first-order state with a tolerance above 0 (-ts_rtol, -ts_atol). Where all are 0 at the start, a relative tolerance is none: -ts_atol says how small is small");
  /* Rounding of q changes a by eps |q| / (beta h^2), and so the error estimate k h^2 (a_{n+1} - a_n) by an amount that does not depend on h */
  I.corrector.floor = 4 * PetscAbsReal(I.p.k) / I.p.beta * PETSC_MACHINE_EPSILON * PetscSqrtReal(global[0] / I.norm_size);
  if (I.corrector.floor > CorrectorTolerance(I))
    PetscCall(PetscInfo(ts, "the tolerance is so small that rounding of q stops the corrector at %g of it\n", (double)I.corrector.floor));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode UpdateWeights(TS ts, Vec U, bool all)
{
  Integrator &I   = Get(ts);
  Tolerances  tol = {ts->atol, ts->rtol};

  PetscFunctionBegin;
  if (ts->vatol) PetscCall(VecGetArrayRead(ts->vatol, &tol.va));
  if (ts->vrtol) PetscCall(VecGetArrayRead(ts->vrtol, &tol.vr));
  if (all || !I.norm_size) PetscCall(FirstWeights(ts, tol, U));
  else
    PetscCall(ForEntries(
      [&](PetscInt i, PetscScalar u, PetscScalar &y, PetscScalar &w) {
        if (!(PetscAbsScalar(u) > y)) return;
        y = PetscAbsScalar(u);
        w = tol.weight(i, y);
      },
      Read(U), Write(I.ymax), Write(I.weight)));
  if (ts->vatol) PetscCall(VecRestoreArrayRead(ts->vatol, &tol.va));
  if (ts->vrtol) PetscCall(VecRestoreArrayRead(ts->vrtol, &tol.vr));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before a step from U: if the user has changed the tolerances since the last step, makes all weights anew */
PetscErrorCode FollowTolerances(TS ts, Vec U)
{
  Integrator      &I     = Get(ts);
  const Vec        v[2]  = {ts->vatol, ts->vrtol};
  bool             other = I.of_atol != ts->atol || I.of_rtol != ts->rtol;

  PetscFunctionBegin;
  for (int k = 0; k < 2; k++) {
    PetscObjectId    id    = 0;
    PetscObjectState state = 0;
    if (v[k]) PetscCall(PetscObjectGetId((PetscObject)v[k], &id));
    if (v[k]) PetscCall(PetscObjectStateGet((PetscObject)v[k], &state));
    other          = other || (I.of_vectors && (id != I.of_id[k] || state != I.of_state[k]));
    I.of_id[k]    = id;
    I.of_state[k] = state;
  }
  if (other && I.norm_size) PetscCall(UpdateWeights(ts, U, true));
  I.of_vectors = PETSC_TRUE;
  I.of_atol    = ts->atol;
  I.of_rtol    = ts->rtol;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The norm of a correction from this rank's sum of squares of its weighted entries. The weight of multipliers is 0, but if one of
   them is not finite, nor is the norm: 0 times Inf or NaN is NaN. */
PetscErrorCode ReduceCorrection(TS ts, Vec dX, PetscReal sum, PetscReal h, PetscReal *e)
{
  Integrator     &I = Get(ts);
  const PetscReal q = PetscAbsReal(I.p.k) * h * h, s = I.p.gamma_s * h;
  PetscReal       states = 0;

  PetscFunctionBegin;
  if (I.count[TSHHT3_STATE]) PetscCall(ForSome(I.states, [&](PetscInt, PetscScalar d, PetscScalar w) { states += PetscSqr(d * w); }, Read(dX), Read(I.weight)));
  PetscCall(ReduceNorm(ts, NORM_2, PetscMax(sum - states, 0) * q * q + states * s * s, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CorrectionNorm(TS ts, Vec dX, PetscReal h, PetscReal *e)
{
  Sum squares;

  PetscFunctionBegin;
  PetscCall(ForEntries([&](PetscInt i, PetscScalar d, PetscScalar w) { squares.add(i, PetscSqr(d * w)); }, Read(dX), Read(Get(ts).weight)));
  PetscCall(ReduceCorrection(ts, dX, squares.total(), h, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode WeightCorrection(const Integrator &I, Vec dX, Vec to)
{
  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(to, dX, I.weight));
  PetscCall(VecPointwiseMult(to, to, I.weight));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* (26) of the coordinates: the sum of squares, or the maximum, on this rank. The lag of a_n is stretched to h as in PrepareStage(). */
static PetscErrorCode CoordinateErrors(const Integrator &I, NormType type, PetscReal *result)
{
  const PetscReal h = I.h, k = PetscAbsReal(I.p.k) * h * h, r = I.h_last > 0 ? h / I.h_last : 1;
  const bool      states  = I.count[TSHHT3_STATE]; /* states have weights, too, and are skipped; all other unknowns have weight 0 */
  PetscReal       largest = 0;
  Sum             sum;

  PetscFunctionBegin;
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar x, PetscScalar x0, PetscScalar a0, PetscScalar w) {
      if (states && !IsCoordinate(I, i)) return;
      const PetscReal d = PetscRealPart(w * (x - (a0 + r * (x0 - a0))));
      sum.add(i, d * d);
      largest = PetscMax(largest, PetscAbsReal(d));
    },
    Read(I.X), Read(I.X0), Read(I.A0), Read(I.weight)));
  *result = type == NORM_2 ? k * k * sum.total() : k * largest;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Adds the error of first-order states, whose third derivative needs s' at t_{n-1} */
static PetscErrorCode AddStateErrors(const Integrator &I, NormType type, PetscReal *result)
{
  const PetscReal h = I.h;

  PetscFunctionBegin;
  if (!I.count[TSHHT3_STATE] || I.predictor.available < 1) PetscFunctionReturn(PETSC_SUCCESS);
  const PetscReal last = I.predictor.t[0] - I.predictor.t[1], k = I.p.k_s * h * h * h * 2 / (last + h);
  PetscCall(ForSome(
    I.states,
    [&](PetscInt, PetscScalar w, PetscScalar before, PetscScalar v0, PetscScalar v1) {
      const PetscReal delta = PetscAbsReal(w * k * ((v1 - v0) / h - (v0 - before) / last));
      *result               = type == NORM_2 ? *result + delta * delta : PetscMax(*result, delta);
    },
    Read(I.weight), Read(I.predictor.X[1]), Read(I.V0), Read(I.V1)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TSEvaluateWLTE_HHT(TS ts, NormType type, PetscInt *order, PetscReal *wlte)
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
    PetscCall(ReduceNorm(ts, type, acc, wlte));
  }
  I.wlte_pending = *wlte;
  PetscCall(PetscLogEventEnd(events.estimate, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Keeps the error estimate of an accepted step for the corrector's tolerance in the next one. Usually TSAdapt has computed it already. */
PetscErrorCode NoteError(TS ts)
{
  Integrator &I = Get(ts);
  PetscReal   e;

  PetscFunctionBegin;
  if (I.wlte_pending < 0) PetscCall(TSEvaluateWLTE_HHT(ts, ts->adapt->wnormtype, NULL, &e));
  if (I.wlte_pending >= 0) I.corrector.wlte = I.wlte_pending;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
