/*
  The predictor, section 6 of the paper: a, s', lambda, V, F at t_{n+1} extrapolated by a polynomial of degree 0 to 3 (up to 5 above order two) through the
  accepted steps, in Newton's form

    P_d(t) = D_0 + (t - t_n) D_1 + (t - t_n)(t - t_{n-1}) D_2 + ...

  with divided differences D_k. A polynomial of degree d missed the new value by exactly (t - t_n)...(t - t_{n-d}) D_{d+1}
  with the new difference, so that one sweep over the differences both updates them and tells which degree would have
  served best. That degree is used next; a higher one must be better by a margin, since it amplifies noise.
*/
#include "integrator/entries.h"
#include "predictor.h"
#include "integrator/sweeps.h"

namespace hht3
{

namespace
{

constexpr PetscReal higher_degree_margin = 0.7; /* a higher degree must have missed by less than this times the lower one's miss */

/* Predicted s' at t1 to the algorithmic w that gives it: the average of states in PrepareStage(), solved for w */
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

/* New differences D_0 ... D_{have+1} from the new values x and the old ones, D_0 ... D_have, in place, and sums of squares of the misses by the weights.
   The number of differences is the template's, for a loop without inner branches. */
template <int have>
struct NewDifferences {
  const PetscScalar *x, *w;
  PetscScalar       *D[have + 2];
  PetscReal          inverse[have + 1]; /* of the times that the differences span */
  Four               squares[have + 1] = {};

  template <class At>
  HHT3_INLINE void operator()(const At &at)
  {
    const Four weight = at.get(w);
    Four       now    = at.get(x);
    for (int k = 0; k <= have; k++) {
      const Four old = at.get(D[k]);
      at.put(D[k], now);
      now               = (now - old) * inverse[k];
      const Four missed = now * weight;
      squares[k] += missed * missed;
    }
    at.put(D[have + 1], now);
  }
};

/* The step at t1 is accepted. miss[k]: of degree k at t1, over the product of the times that its differences span; weights of unknowns that do not
   count are zero. */
template <int have>
PetscErrorCode RenewTo(const Integrator &I, Predictor &p, PetscReal miss[])
{
  NewDifferences<have> sweep;
  const bool           states = I.count[TSHHT3_STATE]; /* for which s' counts: a copy of X has them */
  const Vec            x      = states ? p.D[have + 1] : I.X;
  PetscInt             n;

  PetscFunctionBegin;
  if (states) {
    PetscCall(VecCopy(I.X, x));
    PetscCall(ForSome(I.states, [](PetscInt, PetscScalar rate, PetscScalar &now) { now = rate; }, Read(I.V1), Write(x)));
  }
  PetscCall(VecGetLocalSize(x, &n));
  PetscCall(VecGetArrayRead(x, &sweep.x));
  PetscCall(VecGetArrayRead(I.weight, &sweep.w));
  for (int k = 0; k <= have + 1; k++) PetscCall(VecGetArray(p.D[k], &sweep.D[k]));
  for (int k = 0; k <= have; k++) sweep.inverse[k] = 1 / (I.t1 - p.t[k]);
  sweep = Sweep(n, sweep);
  for (int k = 0; k <= have; k++) miss[k] = Total(sweep.squares[k]);
  for (int k = 0; k <= have + 1; k++) PetscCall(VecRestoreArray(p.D[k], &sweep.D[k]));
  PetscCall(VecRestoreArrayRead(I.weight, &sweep.w));
  PetscCall(VecRestoreArrayRead(x, &sweep.x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RenewDifferences(const Integrator &I, Predictor &p, PetscInt have, PetscReal miss[])
{
  static constexpr PetscErrorCode (*of[])(const Integrator &, Predictor &, PetscReal[]) = {RenewTo<0>, RenewTo<1>, RenewTo<2>, RenewTo<3>, RenewTo<4>, RenewTo<5>};
  static_assert(sizeof(of) / sizeof(of[0]) == max_degree + 1, "one for each number of differences");

  PetscFunctionBegin;
  PetscCall(of[have](I, p, miss));
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
  Integrator      &I = Get(ts);
  const Predictor &p = I.predictor;
  PetscReal        factor = 1;

  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(events.predict, ts, 0, 0, 0));
  PetscCall(VecCopy(p.D[0], X));
  for (int k = 1; k <= p.degree; k++) {
    factor *= I.t1 - p.t[k - 1];
    PetscCall(ForEntries([=](PetscInt, PetscScalar d, PetscScalar &x) { x += factor * d; }, Read(p.D[k]), Write(X)));
  }
  if (I.count[TSHHT3_STATE]) PetscCall(StatesToUnknowns(I, X));
  PetscCall(PetscLogEventEnd(events.predict, ts, 0, 0, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Positions stay: the unknowns of coordinates for which the step ends where it begins, all others as predicted. A static state is near where a load
   that comes at once meets what is far stiffer than inertia, and where the ends of such a load ring from step to step. */
PetscErrorCode PredictRest(const Integrator &I, Vec X)
{
  const PetscReal k = ScalePosition(I.p, I.h);

  PetscFunctionBegin;
  PetscCall(ForEntries([&](PetscInt i, PetscScalar u0, PetscScalar base, PetscScalar &x) { if (RoleOf(I, i) == TSHHT3_COORDINATE) x = (u0 - base) / k; }, Read(I.U0), Read(I.base[0]), Write(X)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The step at t1 is accepted: it becomes D_0, and the degree for the next step is chosen */
PetscErrorCode PredictorUpdate(TS ts)
{
  Integrator    &I = Get(ts);
  Predictor     &p = I.predictor;
  /* the estimate of states needs D_1, dense output of order k D_{k-1} */
  const PetscInt keep = PetscMax(p.degree_max, I.order.max > 2 ? I.order.max - 1 : I.count[TSHHT3_STATE] ? 1 : 0);
  const PetscInt have = PetscMin(p.available, keep); /* old D_0..D_have exist */
  PetscReal      miss[max_degree + 1], sum[max_degree + 1], factor = 1, best = PETSC_MAX_REAL;

  PetscFunctionBegin;
  if (!p.D[have + 1]) PetscCall(VecDuplicate(I.X, &p.D[have + 1]));
  PetscCall(RenewDifferences(I, p, have, miss));
  for (PetscInt k = have; k >= 0; k--) p.t[k + 1] = p.t[k];
  p.t[0]      = I.t1;
  p.available = PetscMin(have + 1, keep);
  p.degree    = PetscMin(p.available, p.degree_max);
  if (p.fixed || !p.degree_max) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Allreduce(miss, sum, (PetscMPIInt)(have + 1), MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  for (PetscInt d = 0; d <= PetscMin(have, p.degree_max); d++) {
    factor *= I.t1 - p.t[d + 1];
    const PetscReal m = PetscAbsReal(factor) * PetscSqrtReal(sum[d]);
    if (d > 0 && !(m < higher_degree_margin * best)) break;
    best     = m;
    p.degree = d;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
