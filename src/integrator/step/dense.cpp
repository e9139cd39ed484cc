/*
  Dense output within the last accepted step, section 7 of the method.

  Order two: cubic Hermite polynomials for q (from q, q'), for q' (from q', q'') and for states (from s, s'); linear for q'', lambda, V and F.

  Order k above two: for q, q' and states the polynomials of degree k through the last k + 1 values, which for q is the polynomial
  that defines the step; for q'', s', lambda, V and F those through the values that the predictor keeps, of degree k if there are
  enough.

  At both ends of the step the result is the step's own values.
*/
#include "dense.h"
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "integrator/coordinates/rotations.h"
#include <algorithm>

namespace hht3
{

namespace
{

/* The value of a polynomial, as a weighted sum of vectors */
struct WeightedSum {
  PetscInt    n = 0;
  PetscScalar weight[max_order + 2];
  Vec         vec[max_order + 2];

  void add(PetscReal w, Vec v)
  {
    weight[n] = w;
    vec[n++]  = v;
  }
  PetscErrorCode value(std::vector<Vec> &spare, WorkVec &x)
  {
    PetscFunctionBegin;
    PetscCall(x.like(vec[0], spare));
    PetscCall(VecZeroEntries(x));
    PetscCall(VecMAXPY(x, n, weight, vec));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};

/* The polynomial through `end` at t_{n+1} and k values x at times t before it, evaluated at the time `at` */
WeightedSum Through(const Integrator &I, PetscReal at, Vec end, PetscInt k, const PetscReal t[], const Vec x[])
{
  PetscReal   node[max_order + 1] = {I.t1}, weight[max_order + 1];
  WeightedSum sum;

  std::copy_n(t, k, node + 1);
  LagrangeWeights(k, node, at, weight);
  for (PetscInt j = 0; j <= k; j++) sum.add(weight[j], j ? x[j - 1] : end);
  return sum;
}

/* The same through the last values of U or U' */
WeightedSum ThroughStates(const Integrator &I, PetscReal at, Vec end, Vec begin, const Vec past[])
{
  Vec x[max_order] = {begin};

  std::copy_n(past, I.order.now - 1, x + 1);
  return Through(I, at, end, I.order.now, I.order.t, x);
}

/* The cubic Hermite polynomial on [0, 1] that is 0 at 0 and 1 at 1, with slopes of 0 */
PetscReal HermiteEnd(PetscReal x) { return x * x * (1 + 2 * (1 - x)); }

/* The cubic Hermite polynomial of values and slopes at both ends of the step */
WeightedSum Hermite(const Integrator &I, PetscReal x, Vec y0, Vec d0, Vec y1, Vec d1)
{
  const PetscReal z = 1 - x;
  WeightedSum     sum;

  sum.add(HermiteEnd(z), y0);
  sum.add(I.h * x * z * z, d0);
  sum.add(HermiteEnd(x), y1);
  sum.add(-I.h * x * x * z, d1);
  return sum;
}

WeightedSum Linear(PetscReal x, Vec y0, Vec y1)
{
  WeightedSum sum;
  sum.add(1 - x, y0);
  sum.add(x, y1);
  return sum;
}

/* The polynomials of q and s, of q', q'' and s', and of algebraic unknowns */
struct Polynomials {
  WeightedSum differential, velocity, acceleration, rate, algebraic;
};

Polynomials OfStep(const Integrator &I, PetscReal t)
{
  const PetscReal x = StepFraction(I, t), inside = PetscClipInterval(t, I.t0, I.t1);

  if (I.order.accepted <= 2) return {Hermite(I, x, I.U0, I.V0, I.U1, I.V1), Hermite(I, x, I.V0, I.A0, I.V1, I.A1), Linear(x, I.A0, I.A1), Linear(x, I.V0, I.V1), Linear(x, I.U0, I.U1)};
  const WeightedSum unknowns = Through(I, inside, I.X, PetscMin(I.predictor.available + 1, I.order.now), I.predictor.t, I.predictor.X);
  return {ThroughStates(I, inside, I.U1, I.U0, I.order.U), ThroughStates(I, inside, I.V1, I.V0, I.order.V), unknowns, unknowns, unknowns};
}

/* Corrects the rotation vectors in U, at order two, which have been interpolated as other coordinates are */
PetscErrorCode AtRotations(Integrator &I, PetscReal x, WeightedSum velocity, Vec U)
{
  WorkVec V;

  PetscFunctionBegin;
  PetscCall(velocity.value(I.spare, V));
  PetscCall(ForSome(
    I.rotations.at, [&](PetscInt, const PetscScalar &v0, const PetscScalar &v1, const PetscScalar &v, PetscScalar &u) { InterpolateCommutator(I, x, HermiteEnd(x), &v0, &v1, &v, &u); }, Read(I.V0),
    Read(I.V1), Read(V), Write(U)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* The position of t in the last step, from 0 to 1, exact at the ends */
PetscReal StepFraction(const Integrator &I, PetscReal t) { return t == I.t1 ? 1 : PetscClipInterval((t - I.t0) / I.h, 0, 1); }

/* Whether the only known state is that at t_n, and t is t_n: when TSEvent has rolled a step back, after which monitors are called;
   after an error; and when event functions are evaluated before the first step of a start. */
bool IsBeginOfStep(TS ts, PetscReal t) { return (Get(ts).event_ahead || (!Get(ts).have_step && Get(ts).at_begin)) && t == ts->ptime; }

PetscErrorCode Interpolate(TS ts, PetscReal t, Vec U, Vec V, Vec A)
{
  Integrator &I = Get(ts);
  const Vec   out[3] = {U, V, A}, begin[3] = {I.event_ahead ? ts->vec_sol : I.U0, I.event_ahead ? ts->vec_dot : I.V0, I.A0};
  PetscInt    n, size;

  PetscFunctionBegin;
  if (IsBeginOfStep(ts, t)) {
    for (int k = 0; k < 3; k++)
      if (out[k]) PetscCall(VecCopy(begin[k], out[k]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCheck(I.have_step, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE, "There is no step to interpolate in: none was accepted since the start, the last restart or roll-back");
  PetscCheck(t >= I.t0 - I.h * PETSC_SQRT_MACHINE_EPSILON && t <= I.t1 + I.h * PETSC_SQRT_MACHINE_EPSILON, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "Time %g is not in the last step [%g, %g]", (double)t, (double)I.t0, (double)I.t1);
  PetscCall(VecGetLocalSize(I.U0, &n));
  for (Vec x : out) {
    if (!x) continue;
    PetscCall(VecGetLocalSize(x, &size));
    PetscCheck(size == n, PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ, "A vector for values of the last step has %" PetscInt_FMT " entries on this rank, must be %" PetscInt_FMT " as the solution has", size, n);
  }
  Polynomials p = OfStep(I, t);
  WorkVec     differential, velocity, acceleration, rate, algebraic;
  if (U) {
    PetscCall(p.differential.value(I.spare, differential));
    PetscCall(p.algebraic.value(I.spare, algebraic));
    PetscCall(ForEntries([&](PetscInt i, PetscScalar q, PetscScalar l, PetscScalar &u) { u = IsDifferential(RoleOf(I, i)) ? q : l; }, Read(differential), Read(algebraic), Write(U)));
    if (I.rotations.is && I.order.accepted <= 2) PetscCall(AtRotations(I, StepFraction(I, t), p.velocity, U));
  }
  if (V) {
    PetscCall(p.velocity.value(I.spare, velocity));
    PetscCall(p.rate.value(I.spare, rate));
    PetscCall(ForEntries([&](PetscInt i, PetscScalar q, PetscScalar s, PetscScalar &v) { v = IsCoordinate(I, i) ? q : RoleOf(I, i) == TSHHT3_STATE ? s : 0; }, Read(velocity), Read(rate), Write(V)));
  }
  if (A) {
    PetscCall(p.acceleration.value(I.spare, acceleration));
    PetscCall(TakeRoles(I, acceleration, {TSHHT3_COORDINATE}, A));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
