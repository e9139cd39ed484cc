/*
  Steps of order 3 to 5: the accepted states that they need, the stage that follows from these, and the changes from and to HHT, the
  method of order two.

  HHT's unknown is an acceleration a that lags behind q'', and its velocities miss the differentiated constraints by O(h^2),
  drift.cpp; backward differentiation has neither. When the order rises from two to three, this drift is subtracted from the
  velocities of the history. Otherwise accelerations in the directions of the constraints, and with them the multipliers, would have
  an error of first order for as many steps as the history has. When the order falls to two, a_n and the drift are made as at a start.

  After a step that is far shorter than the one before, as to an event or the end of a run, the state at its beginning is left out of the history.
*/
#include "integrator/entries.h"
#include "order.h"
#include "predictor.h"
#include "stage.h"
#include "integrator/work_vec.h"
#include <algorithm>
#include <utility>

namespace hht3
{

namespace
{

/* A step shorter than this part of the last one is not used for differentiation: the error that the corrector leaves in the positions
   at its ends would be magnified as much in the velocities of the next step. Table in tests/bench/README.md. */
constexpr PetscReal short_step_ratio = 0.2;

/* The multiple of dV that psi_v contains: the drift at the end of a step of length h is taken for (h/drift_h)^2 dV */
PetscReal DriftOfHistory(const Order &o, const BDF &b)
{
  PetscReal sum = 0;
  for (PetscInt j = 0; j < o.now; j++)
    if (o.drift_h > 0) sum += b.c[j] * PetscSqr(o.hht[j] / o.drift_h);
  return sum;
}

/* Shifts the accelerations of the predictor so that they are those of `a` at t_n; their slopes do not change */
PetscErrorCode MovePredictor(Integrator &I, Vec a)
{
  Predictor &p = I.predictor;
  WorkVec    change;

  PetscFunctionBegin;
  PetscCall(change.like(a, I.spare));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar from, PetscScalar to, PetscScalar &d) { d = IsCoordinate(I, i) ? to - from : 0; }, Read(p.X[0]), Read(a), Write(change)));
  for (PetscInt k = 0; k <= p.available; k++) PetscCall(VecAXPY(p.X[k], 1, change));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the first attempt of order three or more from a state that HHT has left: the predictor gets q'' in place of a, and the drift
   of the velocities is measured */
PetscErrorCode EnterBDF(TS ts)
{
  Integrator &I = Get(ts);
  Order      &o = I.order;

  PetscFunctionBegin;
  PetscCall(PetscInfo(ts, "order %" PetscInt_FMT " from t = %g\n", o.now, (double)ts->ptime));
  PetscCall(MovePredictor(I, I.A0));
  I.drift_removed = 0;
  if (o.hht[0] > 0 && I.count[TSHHT3_HOLONOMIC] && I.corrector.matrix.have) {
    if (!I.have_drift) PetscCall(MeasureDrift(ts));
    o.drift_h = o.hht[0];
  } else o.drift_h = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Before the first attempt of order two from a state that a higher order has left: makes a_n, w_n and the drift as HHT would have
   left them, from the slope of q'' */
PetscErrorCode LeaveBDF(TS ts)
{
  Integrator &I = Get(ts);
  WorkVec     slope;

  PetscFunctionBegin;
  PetscCall(PetscInfo(ts, "order 2 from t = %g\n", (double)ts->ptime));
  if (I.order.made > 2 && I.predictor.available > 0) {
    PetscCall(slope.like(I.X0, I.spare));
    PetscCall(SlopeOfUnknowns(I, slope));
    PetscCall(ForEntries(
      [&](PetscInt i, PetscScalar a, PetscScalar v, PetscScalar s, PetscScalar &x) {
        const TSHHT3Role r = RoleOf(I, i);
        if (r == TSHHT3_COORDINATE) x = a + I.hht.lag() * I.h_last * s;
        if (r == TSHHT3_STATE) x = v + I.hht.lagState() * I.h_last * s;
      },
      Read(I.A0), Read(I.V0), Read(slope), Write(I.X0)));
    I.jerk = Jerk::None;
    if (I.corrector.matrix.have) PetscCall(SetDriftOfStart(ts, slope));
  }
  PetscCall(MovePredictor(I, I.X0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

void Spans(const Order &o, PetscReal t1, PetscReal tau[])
{
  for (PetscInt j = 0; j <= o.past; j++) tau[j] = t1 - o.t[j];
}

PetscErrorCode SetUpOrder(TS ts)
{
  Integrator &I = Get(ts);
  Order      &o = I.order;

  PetscFunctionBegin;
  o.max = o.wanted == TSHHT3_ORDER_AUTO ? max_order : o.wanted;
  PetscCheck(o.max == 2 || I.form == TSHHT3_FORM_SECOND_ORDER, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_INCOMP,
             "Orders above two (-ts_hhtdae_order) satisfy the equations of motion at the end of a step, as the second-order form does; the paper's form (-ts_hhtdae_form paper) has order 2 alone");
  if (!I.predictor.fixed) I.predictor.degree_max = PetscMax(o.max, default_degree);
  if (o.max == 2) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt j = 0; j < o.max; j++) {
    if (!o.U[j]) PetscCall(VecDuplicate(ts->vec_sol, &o.U[j]));
    if (!o.V[j]) PetscCall(VecDuplicate(ts->vec_sol, &o.V[j]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ViewOrder(TS ts, PetscViewer viewer)
{
  const Integrator &I     = Get(ts);
  const Order      &o     = I.order;
  const PetscInt   *steps = I.stat.of_order;
  char              what[64];

  PetscFunctionBegin;
  if (o.wanted == 2) PetscFunctionReturn(PETSC_SUCCESS);
  if (o.wanted == TSHHT3_ORDER_AUTO) PetscCall(PetscSNPrintf(what, sizeof(what), "chosen in each step, 2 to %" PetscInt_FMT, max_order));
  else PetscCall(PetscSNPrintf(what, sizeof(what), "%" PetscInt_FMT ", after starts from 2", o.wanted));
  PetscCall(PetscViewerASCIIPrintf(viewer, "order %s (now %" PetscInt_FMT "); steps of order 2 to 5: %" PetscInt_FMT ", %" PetscInt_FMT ", %" PetscInt_FMT ", %" PetscInt_FMT "\n", what, o.now,
                                   steps[2], steps[3], steps[4], steps[5]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

void ResetOrder(TS ts)
{
  Integrator &I = Get(ts);
  Order      &o = I.order;

  if (o.max == 2) return;
  static_cast<OrderState &>(o) = OrderState();
  o.t[0]                       = ts->ptime;
  I.p                          = I.hht;
}

void CommitOrder(Integrator &I)
{
  Order &o = I.order;

  if (o.max == 2) return;
  if (o.accepted > 0 && (o.past == 0 || I.h >= short_step_ratio * I.h_last)) {
    /* The oldest vectors are exchanged for U0, V0, which become the first ones of the past; CommitStep() then exchanges U0, V0 for U1, V1 */
    std::rotate(o.U, o.U + o.max - 1, o.U + o.max);
    std::rotate(o.V, o.V + o.max - 1, o.V + o.max);
    std::swap(o.U[0], I.U0);
    std::swap(o.V[0], I.V0);
    std::copy_backward(o.t, o.t + o.max, o.t + o.max + 1);
    std::copy_backward(o.hht, o.hht + o.max, o.hht + o.max + 1);
    o.past = PetscMin(o.past + 1, o.max);
  }
  o.t[0]   = I.t1;
  o.hht[0] = o.accepted == 2 ? I.h : 0;
  o.made   = o.accepted;
  o.memory = o.after;
  o.since  = o.next == o.now ? o.since + 1 : 0;
  if (o.wait > 0) o.wait--;
  o.above  = o.now > 2 ? o.above + 1 : 0;
  o.now    = PetscMin(o.next, PetscMax(2, o.past));
}

PetscErrorCode CutPast(TS ts, PetscInt n)
{
  Order &o = Get(ts).order;

  PetscFunctionBegin;
  if (n == o.past) PetscFunctionReturn(PETSC_SUCCESS);
  o.past = n;
  if (o.now == 2 || o.now <= n) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "bodies rotate too far in %" PetscInt_FMT " steps for order %" PetscInt_FMT " at t = %g\n", o.now, o.now, (double)ts->ptime));
  o.now   = n < 3 ? 2 : n;
  o.since = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode UseOrder(TS ts)
{
  Integrator &I = Get(ts);
  Order      &o = I.order;
  PetscReal   tau[max_order + 1];

  PetscFunctionBegin;
  if (o.max == 2) PetscFunctionReturn(PETSC_SUCCESS);
  o.measured = PETSC_FALSE;
  if ((o.now > 2) != (o.ready > 2)) {
    if (o.now > 2) PetscCall(EnterBDF(ts));
    else PetscCall(LeaveBDF(ts));
    I.corrector.matrix.want = PETSC_TRUE;
  }
  o.ready = o.now;
  Spans(o, I.t1, tau);
  I.p = o.now > 2 ? BDFParameters(o.now, I.h, tau) : I.hht;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PrepareStage() of orders above two. The base of U1 is psi_q + gamma h psi_v for coordinates, and psi_q for states and for rotation
   vectors, see StageOfRotations(). */
PetscErrorCode PrepareBDF(TS ts)
{
  Integrator        &I = Get(ts);
  Order             &o = I.order;
  PetscReal          tau[max_order + 1];
  Vec                U[max_order] = {I.U0}, V[max_order] = {I.V0};
  const PetscScalar *u[max_order], *v[max_order];

  PetscFunctionBegin;
  Spans(o, I.t1, tau);
  const BDF       b      = BDFOf(o.now, tau);
  const PetscReal drift_removed = DriftOfHistory(o, b);
  std::copy(o.U, o.U + o.now - 1, U + 1);
  std::copy(o.V, o.V + o.now - 1, V + 1);
  for (PetscInt j = 0; j < o.now; j++) {
    PetscCall(VecGetArrayRead(U[j], &u[j]));
    PetscCall(VecGetArrayRead(V[j], &v[j]));
  }
  const auto psi = [&](const PetscScalar *const x[], PetscInt i, PetscScalar sum) {
    for (PetscInt j = 0; j < o.now; j++) sum += b.c[j] * x[j][i]; /* not by VecMAXPY(), whose rounding is different: HigherOrderRotations.ObservedOrders */
    return sum;
  };
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar &bu, PetscScalar &bv, PetscScalar &ba, PetscScalar dV) {
      bv = IsCoordinate(I, i) ? psi(v, i, -drift_removed * dV) : 0;
      bu = IsDifferential(RoleOf(I, i)) ? psi(u, i, 0) + b.gh * bv : 0;
      ba = 0;
    },
    Write(I.base[0]), Write(I.base[1]), Write(I.base[2]), Read(drift_removed != 0 ? I.dV : I.V0 /* times zero */)));
  PetscCall(ForSome(
    I.rotations.at,
    [&](PetscInt i, PetscScalar &bu) {
      for (PetscInt k = 0; k < 3; k++) (&bu)[k] = psi(u, i + k, 0);
    },
    Write(I.base[0])));
  for (PetscInt j = 0; j < o.now; j++) {
    PetscCall(VecRestoreArrayRead(U[j], &u[j]));
    PetscCall(VecRestoreArrayRead(V[j], &v[j]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Maps the past to new coordinates. HHT's drift in its velocities was measured in the old ones, and is no longer subtracted. */
PetscErrorCode MapPast(TS ts)
{
  Integrator &I = Get(ts);
  Order      &o = I.order;
  WorkVec     A;

  PetscFunctionBegin;
  if (!o.past) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(A.like(I.A0));
  for (PetscInt j = 0; j < o.past; j++) {
    PetscCall(VecZeroEntries(A));
    PetscCall((*I.change.map)(ts, o.t[j + 1], o.U[j], o.V[j], A, I.change.ctx));
  }
  o.drift_h = 0;
  for (PetscReal &h : o.hht) h = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Number of steps of order two after a higher order has failed. It is doubled each time, as each attempt at a higher order may end in
   another failure of the corrector, or lets an oscillation grow. */
static constexpr PetscInt first_wait = 4;

/* If there were this many times as many steps above order two as the last wait, the next wait is first_wait again */
static constexpr PetscInt steps_to_forgive = 10;

void LowerToTwo(Order &o)
{
  o.wait = o.penalty = o.above >= steps_to_forgive * o.penalty ? first_wait : 2 * o.penalty;
  o.next             = 2;
}

/* After a failed corrector iteration: where a force has a corner, prediction and history of high order are far off, so that order two
   is tried at once, at the same h */
PetscErrorCode LowerAfterFailure(TS ts)
{
  Integrator &I = Get(ts);
  Order      &o = I.order;

  PetscFunctionBegin;
  if (o.now == 2) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "the corrector has failed with order %" PetscInt_FMT " at t = %g\n", o.now, (double)ts->ptime));
  if (!ts->reason) ts->time_step = I.h;
  LowerToTwo(o);
  o.now   = 2;
  o.since = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
