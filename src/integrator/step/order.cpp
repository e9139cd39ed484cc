/*
  The error of steps above order two, and the choice of the order.

  Both come from the scaled differences S_m = tau_1 ... tau_m |q[t_{n+1}, ..., t_{n+1-m}]|, by the weights of the error test: order m has the
  error E_m = gamma_m h/tau_{m+1} S_{m+1}, HHT the one of (26) with q''' from the third difference. That order is taken with which the next step may be
  longest, 1/E_m^{1/(m+1)}, among the one at hand and its neighbours.

  In place of S_m stands an amplitude, which falls from step to step by no more than a fifth: where q^(m) passes zero S_m tells nothing of the next step.

  The same differences tell how stable an order is. On the imaginary axis order 3 grows by 0.2 % a step at h omega = 0.3 and by 1.1 % at 0.5, order 4 by 0.02 % and
  0.5 %, order 5 not at all below 0.7 but by 13 % at 1 (roots of their characteristic polynomials; A(86), A(73), A(51)-stable). An oscillation that hardly
  anything damps grows there, however small it is, until the error test sees it, and a fast spin gains energy. It shows in S_{m+1}/S_m = 2 sin(h omega/2), long before it has the size of the tolerance,
  since high differences magnify it. So this ratio limits the step of orders 3 to 5, and HHT, which has no such limit and takes the oscillation away, is chosen where its
  step is longer. Orders 3 and 4, whose limits are lower, are mostly ways to 5.
*/
#include "order.h"
#include "predictor.h"
#include "integrator/coordinates/rotations.h"
#include <algorithm>

namespace hht3
{

namespace
{

/* S_{m+1}/S_m up to which orders 3, 4, 5 are taken for stable: h omega = 0.4, 0.5, 0.65 */
constexpr PetscReal stable_ratio[max_order + 1] = {0, 0, 0, 0.4, 0.49, 0.64};

/* From step to step that ratio counts as no more than so many times as much, from this value up: sharp places that are soon over are no oscillation */
constexpr PetscReal ratio_growth = 1.15, least_ratio = 0.1;

/* Of an amplitude in the course of a step of constant length */
constexpr PetscReal amplitude_decay = 0.8;

/* Differences below this part of the tolerance tell of rounding and of what the corrector leaves */
constexpr PetscReal least_difference = 0.5;

/* Of h from one step to the next above order two: coefficients of variable steps grow with it */
constexpr PetscReal max_growth = 2;

/* S_m of U1, U0 and the past as far as that goes; those beyond are -1 */
PetscErrorCode DifferencesOfStates(TS ts, NormType type, PetscReal S[])
{
  Integrator &I   = Get(ts);
  Order      &o   = I.order;
  Vec         x[] = {I.U1, I.U0, o.U[0], o.U[1], o.U[2], o.U[3], o.U[4]};
  PetscReal   t[max_order + 2] = {I.t1};

  PetscFunctionBegin;
  if (!o.measured || type != o.norm) { /* by the estimate */
    std::copy_n(o.t, max_order + 1, t + 1);
    std::fill_n(o.S, max_order + 2, -1);
    PetscCall(ScaledDifferences(ts, type, o.past + 2, x, t, o.S));
    o.measured = PETSC_TRUE;
    o.norm     = type;
  }
  std::copy_n(o.S, max_order + 2, S);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of the accepted step, and the candidates for the next one */
struct Candidates {
  PetscReal S[max_order + 3]; /* -1: not known */
  PetscReal E[max_order + 2]; /* likewise */
  PetscReal ratio[max_order + 1]; /* of S_{m+1} to S_m, for as long as it lasts; 0 where stability is no matter */
};

PetscErrorCode FindCandidates(TS ts, Candidates *c)
{
  Integrator    &I   = Get(ts);
  Order         &o   = I.order;
  const PetscInt now = o.now;
  PetscReal      tau[max_order + 2];

  PetscFunctionBegin;
  for (PetscReal &s : c->S) s = -1;
  for (PetscReal &e : c->E) e = -1;
  Spans(I.order, I.t1, tau);
  PetscCall(DifferencesOfStates(ts, ts->adapt->wnormtype, c->S));
  for (PetscInt m = 2; m <= max_order + 1; m++)
    if (c->S[m] >= 0) c->S[m] = o.after.S[m] = PetscMax(c->S[m], amplitude_decay * o.memory.S[m] * PetscPowRealInt(I.h / I.h_last, m));
  for (PetscInt m = 3; m <= max_order; m++) {
    c->ratio[m] = 0;
    if (c->S[m + 1] < 0) continue;
    const PetscReal ratio = c->S[m] > 0 && c->S[m + 1] > (I.fixed_h ? 0 : least_difference) ? c->S[m + 1] / c->S[m] : 0;
    o.after.ratio[m]      = PetscMin(ratio, PetscMax(ratio_growth * o.memory.ratio[m], least_ratio));
    if (o.wanted == TSHHT3_ORDER_AUTO) c->ratio[m] = o.after.ratio[m];
  }
  for (PetscInt m = PetscMax(now - 1, 3); m <= PetscMin(now + 1, o.max); m++)
    if (c->S[m + 1] >= 0) c->E[m] = ErrorFactor(m, tau) * c->S[m + 1];
  if (now == 2) c->E[2] = I.wlte_pending;
  else c->E[2] = HHTErrorFactor(I.hht, I.h, tau) * c->S[3];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What stability leaves of the present h for order m */
PetscReal StableReach(const Candidates &c, PetscInt m) { return m > 2 && c.ratio[m] > 0 ? stable_ratio[m] / c.ratio[m] : PETSC_MAX_REAL; }

/* What is left of it by the m steps in which no body may turn farther than a rotation vector tells, with some room for spins that grow */
PetscReal TurnReach(const Integrator &I, PetscInt m) { return m > 2 && I.order.spin > 0 ? 0.9 * longest_turn / (m * I.order.spin * I.h) : PETSC_MAX_REAL; }

/* How much longer the next step of order m may be, with `safety` for its error */
PetscReal StepRatio(const Integrator &I, const Candidates &c, PetscInt m, PetscReal safety)
{
  return PetscMin(c.E[m] > 0 ? safety * PetscPowReal(c.E[m], (PetscReal)-1 / (m + 1)) : PETSC_MAX_REAL, PetscMin(StableReach(c, m), TurnReach(I, m)));
}

/* Better: at fixed steps the one with the smaller error that is stable, else the one with the larger step */
bool IsBetterOrder(const Integrator &I, const Candidates &c, PetscInt m, PetscInt than)
{
  if (c.E[m] < 0 || c.E[than] < 0) return false;
  if (!I.fixed_h) return StepRatio(I, c, m, 1) > StepRatio(I, c, than, 1);
  const bool m_stable = StableReach(c, m) >= 1, than_stable = StableReach(c, than) >= 1;
  return m_stable == than_stable ? c.E[m] < c.E[than] : m_stable;
}

/* The order for the step after the accepted one, -ts_hhtdae_order auto. The present one is left after as many steps as its history has, or for HHT at once. */
PetscInt BestOrder(const Integrator &I, const Candidates &c)
{
  const Order   &o     = I.order;
  const PetscInt k     = o.now;
  const bool     known = k < o.max && c.E[k + 1] >= 0 && o.past >= k;

  if (k == 2) return known && o.wait == 0 && IsBetterOrder(I, c, 3, 2) ? 3 : 2;
  if (o.above > k && IsBetterOrder(I, c, 2, k)) return 2; /* differences over steps of order two have kinks where h changes */
  if (o.since < k) return k;
  if (k > 3 && IsBetterOrder(I, c, k - 1, k)) return k - 1;
  return known && IsBetterOrder(I, c, k + 1, k) ? k + 1 : k;
}

/* A fixed order is reached from two as soon as the history is there */
PetscInt NextToFixed(const Order &o) { return o.now < o.max && o.wait == 0 && o.past >= o.now + 1 ? o.now + 1 : o.now; }

} // namespace

/* Of the attempt: its local error in units of the tolerance */
PetscErrorCode ErrorOfOrder(TS ts, NormType type, PetscReal *wlte)
{
  Integrator    &I = Get(ts);
  const PetscInt k = I.order.now;
  PetscReal      tau[max_order + 2], S[max_order + 4];

  PetscFunctionBegin;
  Spans(I.order, I.t1, tau);
  PetscCall(DifferencesOfStates(ts, type, S));
  *wlte = ErrorFactor(k, tau) * S[k + 1];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For the step after the accepted one, whose estimate is known. *next: the length that the controller has chosen for the present order, and that of the next
   one on return; NULL if another one than ours chooses it. */
PetscErrorCode ChooseOrder(TS ts, PetscReal *next)
{
  Integrator &I = Get(ts);
  Order      &o = I.order;
  Candidates  c;

  PetscFunctionBegin;
  if (o.chosen || o.max == 2) PetscFunctionReturn(PETSC_SUCCESS);
  o.chosen = PETSC_TRUE;
  o.next   = o.now;
  o.after  = o.memory;
  if (o.past < 2 || I.wlte_pending < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(FindCandidates(ts, &c));
  if (o.now > 2 && StableReach(c, o.now) < 1) LowerToTwo(o);
  else o.next = o.wanted == TSHHT3_ORDER_AUTO ? BestOrder(I, c) : NextToFixed(o);
  if (o.next != o.now)
    PetscCall(PetscInfo(ts, "order %" PetscInt_FMT " after %" PetscInt_FMT " at t = %g, h = %g: errors %g, %g, %g of the tolerance, differences %g, %g, %g\n", o.next, o.now, (double)I.t1, (double)I.h,
                        (double)c.E[o.now - 1], (double)c.E[o.now], (double)c.E[o.now + 1], (double)c.S[o.now], (double)c.S[o.now + 1], (double)c.S[o.now + 2]));
  if (!next) PetscFunctionReturn(PETSC_SUCCESS);
  if ((o.next > 2 || o.now > 2) && c.E[o.next] >= 0)
    *next = I.h * PetscClipInterval(StepRatio(I, c, o.next, ts->adapt->safety), ts->adapt->clip[0], ts->adapt->clip[1]);
  if (o.next > 2) *next = PetscMin(*next, max_growth * I.h);
  *next = PetscClipInterval(*next, ts->adapt->dt_min, ts->adapt->dt_max);
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
