/*
  The error of steps above order two, and the choice of the order.

  Both are computed from the scaled differences S_m = tau_1 ... tau_m |q[t_{n+1}, ..., t_{n+1-m}]| in the norm of the error test:
  order m has the error E_m = gamma_m h/tau_{m+1} S_{m+1}, HHT that of (26) with q''' from the third difference. Of the present order
  and its neighbours, the one that allows the longest next step, proportional to E_m^{-1/(m+1)}, is chosen.

  Instead of S_m an amplitude is used, which decreases by at most a fifth per step: where q^(m) passes through zero, S_m says nothing
  about the next step.

  The same differences show whether an order is stable. On the imaginary axis order 3 grows by 0.2 % a step at h omega = 0.3 and by
  1.1 % at 0.5, order 4 by 0.02 % and 0.5 %, order 5 not at all below 0.7 but by 13 % at 1 (roots of their characteristic polynomials;
  A(86), A(73), A(51)-stable). There an oscillation with hardly any damping grows, however small it is, until it shows in the error
  test, and a fast spin gains energy. The ratio S_{m+1}/S_m = 2 sin(h omega/2) shows it long before it has the size of the tolerance,
  since high differences magnify it. So this ratio limits the step of orders 3 to 5. HHT, which has no such limit and damps the
  oscillation, is chosen if its step is longer. Orders 3 and 4, whose limits are lower, are mostly intermediate to order 5.
*/
#include "order.h"
#include "predictor.h"
#include "integrator/coordinates/rotations.h"
#include <algorithm>

namespace hht3
{

namespace
{

/* Largest S_{m+1}/S_m for which orders 3, 4, 5 count as stable: h omega = 0.4, 0.5, 0.65 */
constexpr PetscReal stable_ratio[max_order + 1] = {0, 0, 0, 0.4, 0.49, 0.64};

/* The ratio that is used grows by at most this factor per step once it exceeds least_ratio: a short sharp change of the motion is no
   oscillation */
constexpr PetscReal ratio_growth = 1.15, least_ratio = 0.1;

/* Smallest factor on an amplitude per step of constant length */
constexpr PetscReal amplitude_decay = 0.8;

/* Differences below this, in units of the tolerance, are dominated by rounding and by the error that the corrector leaves */
constexpr PetscReal least_difference = 0.5;

/* Largest growth of h from one step to the next above order two: the coefficients of variable steps grow with it */
constexpr PetscReal max_growth = 2;

/* S_m of U1, U0 and the past, as far as it reaches; -1 for higher m */
PetscErrorCode DifferencesOfStates(TS ts, NormType type, PetscReal S[])
{
  Integrator &I   = Get(ts);
  Order      &o   = I.order;
  Vec         x[] = {I.U1, I.U0, o.U[0], o.U[1], o.U[2], o.U[3], o.U[4]};
  PetscReal   t[max_order + 2] = {I.t1};

  PetscFunctionBegin;
  if (!o.measured || type != o.norm) { /* the error estimate has usually measured them */
    std::copy_n(o.t, max_order + 1, t + 1);
    std::fill_n(o.S, max_order + 2, -1);
    PetscCall(ScaledDifferences(ts, type, o.past + 2, x, t, o.S));
    o.measured = PETSC_TRUE;
    o.norm     = type;
  }
  std::copy_n(o.S, max_order + 2, S);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Amplitudes, errors and ratios after the accepted step, by order: what the choice of the next order is made of */
struct Candidates {
  PetscReal S[max_order + 3]; /* amplitude of S_m; -1: not known */
  PetscReal E[max_order + 2]; /* error E_m; -1: not known */
  PetscReal ratio[max_order + 1]; /* S_{m+1}/S_m with its growth limited; 0: stability does not limit the step */
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

/* Longest step, as a multiple of the present h, for which order m is stable */
PetscReal StableReach(const Candidates &c, PetscInt m) { return m > 2 && c.ratio[m] > 0 ? stable_ratio[m] / c.ratio[m] : PETSC_MAX_REAL; }

/* Longest step, as a multiple of the present h, for which no body turns by more than longest_turn in the m steps of the history, less
   10 % for spins that grow */
PetscReal TurnReach(const Integrator &I, PetscInt m) { return m > 2 && I.order.spin > 0 ? 0.9 * longest_turn / (m * I.order.spin * I.h) : PETSC_MAX_REAL; }

/* Longest next step of order m, as a multiple of the present h, with the factor `safety` on the step that its error allows */
PetscReal StepRatio(const Integrator &I, const Candidates &c, PetscInt m, PetscReal safety)
{
  return PetscMin(c.E[m] > 0 ? safety * PetscPowReal(c.E[m], (PetscReal)-1 / (m + 1)) : PETSC_MAX_REAL, PetscMin(StableReach(c, m), TurnReach(I, m)));
}

/* Whether order m is better than order `than`: with fixed steps if it alone is stable, or if it has the smaller error; otherwise if
   its step is longer */
bool IsBetterOrder(const Integrator &I, const Candidates &c, PetscInt m, PetscInt than)
{
  if (c.E[m] < 0 || c.E[than] < 0) return false;
  if (!I.fixed_h) return StepRatio(I, c, m, 1) > StepRatio(I, c, than, 1);
  const bool m_stable = StableReach(c, m) >= 1, than_stable = StableReach(c, than) >= 1;
  return m_stable == than_stable ? c.E[m] < c.E[than] : m_stable;
}

/* The order for the step after the accepted one, with -ts_hhtdae_order auto. Order k is used for k steps at least before it is
   changed; to order two it may change at once. */
PetscInt BestOrder(const Integrator &I, const Candidates &c)
{
  const Order   &o     = I.order;
  const PetscInt k     = o.now;
  const bool     known = k < o.max && c.E[k + 1] >= 0 && o.past >= k;

  if (k == 2) return known && o.wait == 0 && IsBetterOrder(I, c, 3, 2) ? 3 : 2;
  if (o.above > k && IsBetterOrder(I, c, 2, k)) return 2; /* not while the history has steps of order two, whose differences have kinks where h changes */
  if (o.since < k) return k;
  if (k > 3 && IsBetterOrder(I, c, k - 1, k)) return k - 1;
  return known && IsBetterOrder(I, c, k + 1, k) ? k + 1 : k;
}

/* The next order on the way from two to a fixed order, which rises as soon as the history allows it */
PetscInt NextToFixed(const Order &o) { return o.now < o.max && o.wait == 0 && o.past >= o.now + 1 ? o.now + 1 : o.now; }

} // namespace

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
